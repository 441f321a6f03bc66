"""A whole run on a small simulated study: its files, their origin, and what runs again when.

All tests that need the run stand in this file, so that they share it.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from bsip_cli import __version__, library
from bsip_cli.artifacts import held_alone, read_header, write_artifact
from bsip_cli.config import load_config
from bsip_cli.files import fingerprints
from bsip_cli.pipeline import STAGES, Stage, producer
from bsip_cli.running.runner import perform, why_stale
from bsip_cli.schemas import SCHEMAS, bsip_names
from bsip_cli.simulate.study import simulate_study
from bsip_cli.stages.diagnosed_trials import prior_of, weighed
from bsip_cli.stages.frames import person_of
from bsip_cli.stages.trial_scene import scene_of
from bsip_cli.study.study import load_study
from tests.small_study import Run, small

OPTIONS = small("MF", static=1.0, sequence=10.0, squat=3.0)
TRIALS = ("task-sequence_run-1", "task-squat_run-1", "task-static")
GOLDEN = Path(__file__).with_name("files_of_a_run.txt")
FITTED_ONLY = "diagnosis_causes"  # a figure of those people of whom a cause was fitted in full
UNITS = 2 * (3 * 6 + 10) + 4  # 6 stages per trial, 10 per participant, 4 of the cohort


class WholeRun(Run):
    """All stages on both participants."""

    def files(self) -> dict[str, Path]:
        """Without what is known of their times, which is another in each folder."""
        found = sorted(
            p for p in self.out.rglob("*") if p.is_file() and p.name != fingerprints.NAME
        )
        return {path.relative_to(self.out).as_posix(): path for path in found}

    def fitted_causes(self, sub: str) -> int:
        """Of how many candidates a person's diagnosis states a gain."""
        return int(self.read("overall-diagnosis", sub)["gain_percent"].notna().sum())

    def content(self) -> dict[str, bytes]:
        return {name: path.read_bytes() for name, path in self.files().items()}

    def times(self) -> dict[str, int]:
        return {name: path.stat().st_mtime_ns for name, path in self.files().items()}

    def rewritten(self, before: dict[str, int]) -> set[str]:
        return {name for name, time in self.times().items() if before.get(name) != time}

    def recording(self, stem: str) -> Path:
        return self.study / stem.split("_")[0] / f"{stem}.c3d"

    def changed(self, before: dict[str, bytes]) -> list[str]:
        """Files that are no more what they were, gone or new."""
        now = self.content()
        return [name for name in {**before, **now} if before.get(name) != now.get(name)]


def kind_of(name: str) -> str:
    """Of an artifact's file: a trial's and a participant's may end alike."""
    ending, of_a_trial = Path(name).stem.split("_")[-1], "_task-" in name
    fitting = (kind for kind, schema in SCHEMAS.items() if schema.file_name == ending)
    return next((k for k in fitting if (SCHEMAS[k].level == "trial") == of_a_trial), ending)


def stages_of(names: set[str]) -> set[str]:
    """Which stages wrote these artifacts."""
    return {producer(kind_of(name)).label for name in names if name.endswith(".parquet")}


def owners_of(names: set[str], stage: str) -> set[str]:
    """Trials, participants or group of a stage's artifacts among these names."""
    kinds = [kind for each in STAGES if each.name == stage for kind in each.writes]
    return {
        Path(name).stem.removesuffix(f"_{SCHEMAS[kind].file_name}")
        for name in names
        for kind in kinds
        if name.endswith(".parquet") and kind_of(name) == kind
    }


def options_in(folder: Path, text: str) -> Path:
    (folder / "own.toml").write_text(text)
    return folder / "own.toml"


@pytest.fixture(scope="session")
def first_run(tmp_path_factory):
    """Made once; nobody changes it."""
    folder = tmp_path_factory.mktemp("small")
    simulate_study(folder / "study", OPTIONS)
    run = WholeRun.within(folder)
    answer = run.done("run", "--jobs", 2)
    assert answer.summary == f"bsip run: {UNITS} done; results in {run.out}"
    return run


@pytest.fixture
def run(first_run, tmp_path) -> WholeRun:
    """A copy to change."""
    return first_run.copied_to(tmp_path)


# --- what a run leaves --------------------------------------------------------------------------


def test_rm_mass_stands_beside_rm_and_om(first_run):
    """In held-out trials too; one number changes no centre of pressure."""
    masses = first_run.read("bsip").groupby("method")["mass_kg"].sum()
    row = first_run.read("identification").set_index("method")
    assert masses["RM+mass"] == pytest.approx(row.loc["RM+mass", "mass_factor"] * masses["RM"])
    fit = first_run.read("fit", "sub-01_task-squat_run-1")
    assert set(fit["data"]) == {"held_out"}
    rmse = fit.pivot(index="component", columns="method", values="rmse")
    assert rmse.loc["cop_ap", "RM+mass"] == pytest.approx(rmse.loc["cop_ap", "RM"])
    assert (rmse[["RM", "RM+mass", "OM"]] > 0.0).all(axis=None)


def test_files_of_a_run(first_run):
    """Exactly these: a new or a lost file is a change that others must hear of.

    A line has the endings of a name behind it; XX and TRIAL stand for each of them.
    """
    golden = [line.split() for line in GOLDEN.read_text(encoding="utf-8").splitlines()]
    names = {
        f"{name}{ending}".replace("XX", sub).replace("TRIAL", trial)
        for name, *endings in golden
        for ending in endings or [""]
        for sub in ("01", "02")
        for trial in TRIALS
        if FITTED_ONLY not in name or first_run.fitted_causes(f"sub-{sub}")
    }
    assert set(first_run.files()) == names


@pytest.mark.long
def test_two_runs_give_the_same_bytes(first_run, tmp_path):
    """Another folder, one process instead of two."""
    again = WholeRun(first_run.study, tmp_path / "elsewhere")
    again.done("run", "--jobs", 1)
    assert again.changed(first_run.content()) == []


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.label)
def test_every_artifact_says_what_made_it(first_run, stage):
    files = {path.name: path for path in first_run.files().values()}
    files |= {path.name: path for path in first_run.study.rglob("*.c3d")}
    facts = set() if stage.level == "cohort" else {"participant"}
    for kind in stage.writes:
        artifacts = {name: path for name, path in files.items() if name.endswith(".parquet")}
        written = [path for name, path in artifacts.items() if kind_of(name) == kind]
        assert len(written) == {"trial": 6, "participant": 2, "cohort": 1}[stage.level]
        for path in written:
            header = read_header(path, kind)
            made_by = header["provenance"]["made_by"]
            assert made_by["stage"] == stage.name
            assert made_by["bsip_version"] == __version__
            assert {"numpy", "scipy", "pin", "ezc3d"} <= set(made_by["libraries"])
            assert set(made_by["options"]) == set(stage.options) | facts
            of_people = {name: read_of(stage, name, files) for name in ("sub-01", "sub-02")}
            answers = {x for x in made_by["inputs"] if x.endswith(" of the group")}
            named = set(made_by["inputs"]) - answers
            hashes = {name: sha256(files[name]) for name in named - set(of_people)}
            hashes |= {name: joint_sha256(of_people[name]) for name in named & set(of_people)}
            assert {name: made_by["inputs"][name] for name in named} == hashes
            people = [path.name for found in of_people.values() for path in found]
            read = {name for name in [*hashes, *people] if name not in of_people}
            recordings = {name for name in read if name.endswith(".c3d")}
            kinds = {kind_of(name) for name in read - recordings}
            kinds |= {name.removesuffix(" of the group") for name in answers}
            assert set(stage.reads) <= kinds
            assert kinds == set(stage.inputs)
            owner = path.name.removesuffix(f"_{kind}.parquet") if stage.reads_recordings else None
            assert recordings == {name for name in files if is_recording_of(name, owner)}


def is_recording_of(name: str, owner: str | None) -> bool:
    """Of a trial, or any of a participant's."""
    stem = name.removesuffix(".c3d")
    return stem != name and owner in (stem, stem.split("_")[0])


def read_of(stage: Stage, participant: str, files: dict[str, Path]) -> list[Path]:
    """What a stage of the group reads of a participant."""
    read = stage.inputs if stage.level == "cohort" else ()
    found = [path for path in files.values() if path.parent.name == participant]
    return [path for path in found if kind_of(path.name) in read]


def joint_sha256(paths: list[Path]) -> str:
    lines = sorted(f"{path.name} {sha256(path)}\n" for path in paths)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_show_prints_the_tables(first_run, bsip):
    brief = bsip.done("show", first_run.out)
    assert len(brief.out.splitlines()) <= 24
    assert [f"sub-0{k}: " in brief.out for k in (1, 2)] == [True, True]
    assert "| " not in brief.out
    answer = bsip.done("show", first_run.out, "--full")
    assert str(first_run.out / "sub-02" / "report.html") in answer.out
    assert answer.out.count("| ") > 20
    assert "Is anything wrong: sub-01" in answer.out
    assert len(re.findall(r"^  - (?:Use|First) ", answer.out, re.MULTILINE)) == 2


def test_methods_say_what_was_done(first_run, bsip, tmp_path):
    answer = bsip.done("methods", first_run.out)
    text = " ".join(answer.out.split())
    assert "Recordings of 2 persons (1 female and 1 male;" in text
    assert f"bsip {__version__}" in text
    assert "(hansen2017, 50 Hz)" in text
    assert 'Options other than the defaults: marker_set = "hansen2017".' in text
    cited = {int(n) for n in re.findall(r"\[(\d+)\]", text)}
    assert cited == set(range(1, len(re.findall(r"^\[\d+\] ", answer.out, re.MULTILINE)) + 1))
    assert bsip("methods", tmp_path).code == 2


def test_methods_name_options_that_differ(run, bsip, tmp_path):
    other = options_in(tmp_path, "[reconstruct]\ncutoff_hz = 7.0\n")
    asked = ("--participant", "sub-01", "--config", other)
    run.done("reconstruct", *asked)
    text = " ".join(bsip("methods", run.out).out.split())
    assert "Options that differ among the results (the text gives the first): reconstruct." in text
    assert "below 7.0 Hz" in text


def test_the_library_gives_the_same_tables(first_run):
    """All but what a run knows from the other person: the faults of their laboratory."""
    trials = {
        name: library.read(first_run.recording(f"sub-01_task-{name}"))
        for name in ("sequence_run-1", "squat_run-1", "static")
    }
    study, _ = load_study(first_run.study, load_config([]).roles.model_dump())
    known = study.participants[0]
    person = library.Person(
        trials,
        sex=known.sex,
        mass_kg=known.mass_kg,
        height_m=known.height_m,
        options={"marker_set": "hansen2017"},
    )
    diagnosis, gains, moments = person.diagnose(), person.extend(), person.joints()
    compared = 0
    for stage in STAGES[: [one.name for one in STAGES].index("laboratory")]:
        for kind in stage.writes:
            for name in trials if stage.level == "trial" else ("",):
                if kind in ("reconstruction", "fit"):
                    continue  # `extend` adds what the diagnosis named
                owner = f"sub-01_task-{name}" if name else "sub-01"
                expected = first_run.read(kind, owner)
                pd.testing.assert_frame_equal(person.table(kind, name), expected)
                compared += 1
    assert compared > 30
    in_run = first_run.read("overall-diagnosis")
    named = set(in_run.loc[in_run["verdict"] == "named", "effect"])
    assert set(diagnosis["effect"]) >= named
    assert set(gains) == set(moments) == set(trials)


@pytest.mark.parametrize("what", ["joints", "opensim", "bids"])
def test_every_trial_is_exported(first_run, tmp_path, what):
    to = tmp_path / "to"
    answer = first_run.done("export", "--what", what, "--to", to)
    names = {path.relative_to(to).as_posix() for path in to.rglob("*") if path.is_file()}
    if what == "bids":
        assert {"dataset_description.json", "participants.tsv"} < names
        stem = "sub-02/motion/sub-02_task-squat_tracksys-bsip_run-1"
        assert {f"{stem}_{one}" for one in ("motion.tsv", "channels.tsv", "motion.json")} < names
        return
    stems = [f"sub-0{k}/sub-0{k}_{trial}" for k in (1, 2) for trial in TRIALS]
    if what == "opensim":  # one plate under both feet, of which one is lifted in the sequence only
        assert {f"{stem}_motion.mot" for stem in stems} < names
        assert {path for path in names if "osim" in path} == set(_models(first_run))
        # once, and once of the other recordings
        assert answer.err.count("no loads: the plates do not measure what acts on each foot") == 2
        return
    assert names == {f"{stem}_joint-moments.csv" for stem in stems}
    for stem in stems:
        table = first_run.read("joint-moments", stem.split("/")[1])
        found = pd.read_csv(to / f"{stem}_joint-moments.csv")
        assert list(found) == list(table)
        assert found["moment_Nm"].to_numpy() == pytest.approx(table["moment_Nm"], nan_ok=True)


def _models(run: Run) -> list[str]:
    uses = (run.read("choice", f"sub-0{k}").iloc[0]["use"] for k in (1, 2))
    return [f"sub-0{k}/sub-0{k}_{use}.osim" for k, use in enumerate(uses, start=1)]


def test_info_tells_what_made_an_artifact(first_run, bsip):
    path = first_run.path("bsip")
    answer = bsip.done("info", path)
    lines = answer.out.splitlines()
    assert lines[0] == path.name
    assert lines[1].startswith("kind      bsip, version 1: ")
    assert any(line.startswith(f"made by   bsip identify {__version__} with") for line in lines)
    assert any(line.startswith("  input   sub-01_skeleton.parquet sha256 ") for line in lines)
    assert "  option  participant = " in answer.out
    assert "  mass_kg [kg" in answer.out


# --- what runs again ----------------------------------------------------------------------------


def test_second_run_does_nothing(run):
    content, times = run.content(), run.times()
    answer = run.done("run", "--jobs", 2)
    assert answer.err.splitlines() == [f"bsip run: {UNITS} up to date; results in {run.out}"]
    assert answer.out == ""
    assert run.times() == times
    assert run.content() == content


def test_touched_recording_is_the_same_recording(run):
    times = run.times()
    for path in run.study.rglob("*.c3d"):
        os.utime(path)
    answer = run.call("ingest")
    assert answer.summary.startswith("bsip ingest: 8 up to date;")
    assert run.times() == times


@pytest.mark.long
def test_changed_recording_runs_again_with_what_reads_it(run):
    with run.recording("sub-01_task-squat_run-1").open("ab") as handle:
        handle.write(bytes(512))
    times = run.times()
    run.done("run", "--jobs", 2)
    rewritten = run.rewritten(times)
    trials = {f"sub-01_{trial}" for trial in TRIALS}  # all read what the session was made of
    assert owners_of(rewritten, "ingest") == {"sub-01", *trials}
    assert owners_of(rewritten, "scale") == {"sub-01"}
    assert owners_of(rewritten, "ik") == trials
    assert owners_of(rewritten, "stats") == {"group"}
    assert not any("sub-02" in name for name in rewritten)


def test_changed_option_reruns_its_stage_and_its_readers(run, tmp_path):
    own = options_in(tmp_path, "[reconstruct]\ncop_min_force_percent_bw = 31.0\n")
    times = run.times()
    chosen = ("--participant", "sub-01", "--config", own)
    answer = run.call("run", *chosen)
    assert answer.summary.startswith("bsip run: 18 done, 10 up to date;")
    rewritten = run.rewritten(times)
    assert stages_of(rewritten) == {
        "reconstruct (trial)",
        "laboratory (participant)",
        "diagnose (participant)",
        "diagnose (trial)",
        "extend (participant)",
        "extend (trial)",
        "extend (participant, gain)",
        "joints (trial)",
        "choose (participant)",
        "report (participant)",
    }
    assert all("sub-01" in name for name in rewritten)
    made_by = run.provenance("fit", f"sub-01_{TRIALS[0]}")["made_by"]
    assert made_by["options"]["reconstruct"]["cop_min_force_percent_bw"] == 31.0


def test_changed_option_of_the_cohort(run, tmp_path):
    own = options_in(tmp_path, "[stats]\nalpha = 0.04\n")
    times = run.times()
    answer = run.call("run", "--config", own)
    assert answer.summary.startswith(f"bsip run: 3 done, {UNITS - 3} up to date;")
    group = {"stats (cohort)", "tables (cohort)", "report (cohort)"}
    assert stages_of(run.rewritten(times)) == group


def test_changed_role_rebuilds_the_skeleton(run):
    """The calibrating trial is a matter of roles, not of scale's own options."""
    config = run.config()
    assert run.perform("scale", config=config).state == "fresh"
    roles = config.roles.model_copy(update={"static": ("squat",)})
    changed = config.model_copy(update={"roles": roles})
    assert run.perform("scale", config=changed).state == "done"
    trial = run.read("person")["calibration_trial"][0]
    assert trial == "sub-01_task-squat_run-1"


def test_joint_moments_of_whom_nothing_was_identified(run):
    for kind in ("bsip", "covariance", "extended-bsip"):
        table = run.read(kind)
        run.rewrite(kind, table[table["method"].isin(["RM", "RM+mass"])])
    stem = f"sub-01_{TRIALS[1]}"
    assert run.perform("joints", stem).state == "done"
    assert set(run.read("joint-moments", stem)["method"]) == {"RM", "RM+mass"}


def test_force_redoes_with_the_same_result(run):
    content, times = run.content(), run.times()
    answer = run.call("regress", "--force")
    assert answer.summary.startswith("bsip regress: 2 done;")
    assert owners_of(run.rewritten(times), "regress") == {"sub-01", "sub-02"}
    assert stages_of(run.rewritten(times)) == {"regress (participant)"}
    assert run.content() == content


def delete(path: Path) -> None:
    path.unlink()


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-40])


def make_other_kind(path: Path) -> None:
    shutil.copy(path.with_name(path.name.replace("regression", "bsip")), path)


def make_other_version(path: Path) -> None:
    """As an earlier bsip might have left it: all but the version as it would be now."""
    table = pq.read_table(path)
    header = table.schema.metadata[b"bsip"]
    now = f'"schema_version": {SCHEMAS["regression"].version}'.encode()
    old = header.replace(now, b'"schema_version": 0')
    assert old != header
    pq.write_table(table.replace_schema_metadata({"bsip": old}), path)


@pytest.mark.parametrize("damage", [delete, truncate, make_other_kind, make_other_version])
def test_artifact_that_is_none_is_refused_by_its_reader_and_made_again(run, damage):
    path = run.path("regression")
    content = path.read_bytes()
    assert run.perform("regress").state == "fresh"
    damage(path)
    outcome = run.perform("identify")
    if damage is delete:
        assert outcome.state == "waiting"
    else:
        assert (outcome.state, outcome.exit_code) == ("refused", 3)
        assert str(path) in outcome.sentences[0]
        assert "To correct it: run " in outcome.sentences[0]
    assert run.perform("regress").state == "done"
    assert path.read_bytes() == content
    assert run.perform("identify").state == ("fresh" if damage is delete else "done")
    assert not run.path("refusal-identify").exists()


@pytest.mark.parametrize("change", [delete, lambda path: path.write_text("edited")])
@pytest.mark.parametrize("name", ["sub-01/report.html", "group/tables/table1_segment_mass.csv"])
def test_lost_or_edited_page_is_made_again_and_that_is_said(run, change, name):
    page = run.out / name
    unit = run.unit_of_group("tables") if "tables" in name else run.unit("report")
    content = page.read_bytes()
    assert perform(unit).state == "fresh"
    change(page)
    outcome = perform(unit)
    assert outcome.state == "done"
    if change is not delete:
        assert outcome.sentences[0] == f"{name} has changed since bsip wrote it: made again"
    assert page.read_bytes() == content


# --- whose results are stale stays out of the group ---------------------------------------------


@pytest.mark.parametrize("command", [("stats",), ("run", "--group")], ids=" ".join)
def test_who_is_stale_is_left_out_of_the_group_and_named(run, command):
    """Heavier by a kilogram in participants.tsv; then as before, and all is as before."""
    table, content, times = run.study / "participants.tsv", run.content(), run.times()
    before = pd.read_csv(table, sep="\t")
    heavier = before["mass_kg"] + [0.0, 1.0]
    before.assign(mass_kg=heavier).to_csv(table, sep="\t", index=False, na_rep="n/a")
    answer = run.call(command[0], *command[1:])
    assert answer.code == 3
    first = {"stats": "stats", "run": "laboratory"}[command[0]]
    assert answer.err.splitlines()[0] == (
        f"{first}: sub-02: left out of the group, since what `bsip ingest` made of sub-02 is not "
        "up to date (other options (participant)); run `bsip run` first"
    )
    assert set(run.read("values", "group")["participant"]) == {"sub-01"}
    assert all(name.startswith("group/") for name in run.rewritten(times))
    before.to_csv(table, sep="\t", index=False, na_rep="n/a")
    run.done("run", "--group")
    assert run.content() == content


def test_all_are_left_out_of_the_group(run, tmp_path):
    own = options_in(tmp_path, "[reconstruct]\ncop_min_force_percent_bw = 31.0\n")
    times = run.times()
    answer = run.call("run", "--config", own, "--group")
    assert answer.code == 3
    lines = answer.err.splitlines()
    because = " is not up to date (other options (reconstruct)); run `bsip run` first"
    assert [line for line in lines if line.endswith(because)] == lines[:2]
    assert [line.split(":")[1] for line in lines[:2]] == [" sub-01", " sub-02"]
    kept_from = "group: left out of laboratory, stats, tables, report, since an input was refused"
    assert lines.count(kept_from) == 1
    assert stages_of(run.rewritten(times)) == set()


def test_a_stage_of_the_group_alone_says_what_is_stale_before_it(run, tmp_path):
    own = options_in(tmp_path, "[stats]\nalpha = 0.04\n")
    answer = run.done("tables", "--config", own)
    assert answer.err.splitlines()[0] == (
        "tables: group: what `bsip stats` made of group is not up to date "
        "(other options (stats)); `bsip run` brings it up to date"
    )
    answer = run.call("tables")
    assert answer.err.startswith("bsip tables: 1 ")


# --- bad data beside good -----------------------------------------------------------------------


@pytest.mark.long
def test_corrupt_recording_and_its_return(run, first_run):
    """The rest goes on without it; mended, everything is as if nothing had been."""
    recording = run.recording("sub-01_task-squat_run-1")
    whole, times = recording.read_bytes(), run.times()
    recording.write_bytes(whole[:1000])
    answer = run.call("run", "--jobs", 2)
    assert answer.code == 3
    assert "Traceback" not in answer.err
    (sentence,) = [line for line in answer.err.splitlines() if str(recording) in line]
    assert sentence.startswith(f"ingest: {recording}: ")
    assert "; expected " in sentence
    assert ". To correct it: " in sentence
    assert " 1 refused, 5 without input;" in answer.summary
    rewritten = run.rewritten(times)
    # What sub-01 tells of the laboratory is less: the diagnosis of sub-02 may change.
    for stage in ("ingest", "scale", "ik", "regress", "identify"):
        written = (name for name in rewritten if "refusal" not in name)
        assert not any("sub-02" in owner or "squat" in owner for owner in owners_of(written, stage))
    assert owners_of(rewritten, "identify") == {"sub-01"}
    assert "sub-01_task-squat_run-1" not in set(run.read("values", "group")["trial"])

    recording.write_bytes(whole)
    run.done("run", "--jobs", 2)
    assert run.changed(first_run.content()) == []


def test_refused_recording_that_is_taken_out(run):
    recording = run.recording("sub-01_task-squat_run-1")
    recording.write_bytes(b"")
    assert run.call("ingest").code == 3
    assert run.path("refusal-ingest", recording.stem).exists()
    recording.unlink()
    run.done("ingest")
    assert not run.path("refusal-ingest", recording.stem).exists()


def test_stale_artifact_of_a_refused_unit_is_not_read(run):
    """The kinematics of an earlier run do not stand for what the last run refused."""
    stem = f"sub-01_{TRIALS[1]}"
    assert run.perform("reconstruct", stem).state == "fresh"
    shutil.copy(run.path("kinematics", stem), run.path("refusal-ik", stem))
    assert run.perform("reconstruct", stem).state == "waiting"


def test_refusal_of_a_later_stage_does_not_take_a_trial_away(run):
    """Else what a run does would depend on the run before."""
    stem = f"sub-01_{TRIALS[0]}"
    shutil.copy(run.path("kinematics", stem), run.path("refusal-reconstruct", stem))
    assert run.perform("identify").state == "fresh"


def test_refusal_makes_the_cohort_look_again(run):
    """What a participant had before the refusal is no result any more."""
    assert not why_stale(run.unit_of_group("stats"))
    shutil.copy(run.path("person"), run.path("refusal-scale", "sub-02"))
    assert why_stale(run.unit_of_group("stats"))


@pytest.mark.parametrize(("stage", "counts"), [("scale", False), ("extend", True)])
def test_who_counts_in_the_tables_after_a_refusal(run, stage, counts):
    """What comes after the numbers that are compared takes nobody away."""
    shutil.copy(run.path("person"), run.path(f"refusal-{stage}", "sub-02"))
    assert perform(run.unit_of_group("stats")).state == "done"
    assert ("sub-02" in set(run.read("values", "group")["participant"])) == counts


def test_report_follows_what_was_refused(run):
    refusal = run.path("refusal-ingest", f"sub-01_{TRIALS[1]}")
    notes = {"made_by": {}, "messages": [], "facts": {}}
    for sentence in ("its header is torn", "its frames are lost"):
        row = {"stage": "ingest", "kind": "bad data", "sentence": sentence}
        write_artifact(refusal, "refusal", pd.DataFrame([row]), notes)
        assert run.perform("report").state == "done"
        assert sentence in (run.out / "sub-01" / "report.html").read_text(encoding="utf-8")
        assert run.perform("report").state == "fresh"


def test_bad_line_of_the_table_does_not_stop_the_others(run, bsip, tmp_path):
    table = run.study / "participants.tsv"
    table.write_text(table.read_text().replace("sub-02\tF", "sub-02\t2"))
    answer = bsip("ingest", run.study, "--out", tmp_path / "new", "--jobs", 2)
    assert answer.code == 3
    (sentence,) = [line for line in answer.err.splitlines() if line.startswith("study: ")]
    assert f"{table}: sex '2' of sub-02; expected M, F, other or n/a. To correct it: " in sentence
    assert answer.summary.startswith("bsip ingest: 4 done, 1 refused;")
    assert sorted(path.name for path in (tmp_path / "new").iterdir() if path.is_dir()) == ["sub-01"]


def test_place_that_cannot_be_written_is_no_refusal_of_the_data(run):
    path = run.path("regression")
    path.unlink()
    path.mkdir()
    outcome = run.perform("regress")
    assert outcome.exit_code == 2
    assert f"{path}: cannot be written" in outcome.sentences[0]
    assert not run.path("refusal-regress").exists()
    assert not [each for each in path.parent.iterdir() if each.name.endswith(".part")]


def test_nothing_is_made_without_what_could_not_be_written(run):
    """A trial lost to a full disk would else be missing in what is made of the others."""
    path = run.path("wrench", f"sub-01_{TRIALS[1]}")
    path.unlink()
    path.mkdir()
    before = run.files()
    answer = run.call("run", "--participant", "sub-01", "--force")
    assert answer.code == 2
    assert answer.summary.startswith("bsip run: 2 done, 1 not to be written;")
    assert run.files() == before


def test_warnings_are_told_and_kept(run):
    """A mass that the plates contradict: said on the terminal and in the artifact."""
    table = run.study / "participants.tsv"
    table.write_text(table.read_text().replace("\tM\t", "\tM\t1", 1))
    answer = run.done("scale", "--participant", "sub-01")
    (told,) = [line for line in answer.err.splitlines() if "do not agree" in line]
    assert "the plates measure" in told
    assert told.removeprefix("scale: ") in run.provenance("person")["messages"]


def test_where_no_trial_is_on_the_plates_nobody_says_that_nothing_is_wrong(run, monkeypatch):
    monkeypatch.setattr("bsip_cli.stages.diagnose.diagnosed", lambda *_: None)
    run.path("diagnosis").unlink()
    outcome = run.perform("diagnose")
    assert outcome.state == "done"
    told = " ".join(outcome.sentences)
    assert "no movement can be diagnosed" in told and "Inconclusive" in told
    assert "Nothing is wrong" not in told
    assert run.read("overall-diagnosis").empty


def test_a_static_trial_off_the_plates_weighs_nobody(run):
    stem = f"sub-01_{TRIALS[2]}"
    unit = run.unit("diagnose")
    assert stem in {trial.stem for trial, _ in weighed(unit, person_of(unit)).scenes}
    run.rewrite("wrench", run.read("wrench", stem).assign(valid=False), stem)
    unit = run.unit("diagnose")
    assert stem not in {trial.stem for trial, _ in weighed(unit, person_of(unit)).scenes}


@pytest.fixture
def judged_by(monkeypatch) -> list[float | None]:
    """By what part of the stated mass the one differs against which a diagnosis judges; nothing
    for the stated mass."""
    shares: list[float | None] = []

    def noted(unit, person, share=None):
        shares.append(share)
        return prior_of(unit, person, share)

    monkeypatch.setattr("bsip_cli.stages.diagnosed_trials.prior_of", noted)
    return shares


def test_a_mass_that_all_trials_contradict_makes_none_of_them_odd(run, judged_by):
    """The table's body is 5 % heavier than the person on the plates."""
    table = run.read("regression")
    table[[name for name in bsip_names() if not name.startswith("com")]] *= 1.05
    run.rewrite("regression", table)
    run.path("diagnosis").unlink()
    assert run.perform("diagnose").state == "done"
    assert judged_by == [None, pytest.approx(1 / 1.05 - 1, abs=0.004)]
    told = run.read("overall-diagnosis")
    assert set(told[told["verdict"] != "rejected"]["class_id"]) == {"W"}


def test_who_weighs_what_is_stated_is_judged_by_that(run, judged_by):
    run.path("diagnosis").unlink()
    assert run.perform("diagnose").state == "done"
    assert judged_by == [None]


def test_exchanged_labels_are_put_right_before_the_poses(run):
    """The knee's markers bear each other's labels for a second: as if nothing had been."""
    before = residuals_seen(run)
    stem = f"sub-01_{TRIALS[1]}"
    clean, markers = run.read("kinematics", stem), run.read("markers", stem)
    swap = {"RKNEL": "RKNEM", "RKNEM": "RKNEL"}
    wrong = markers["time_s"].between(1.0, 2.0)
    markers.loc[wrong, "marker"] = markers.loc[wrong, "marker"].replace(swap)
    markers = markers.sort_values(["time_s", "marker"], kind="stable", ignore_index=True)
    run.rewrite("markers", markers, stem)
    outcome = run.perform("ik", stem)
    assert any("; corrected" in sentence for sentence in outcome.sentences)
    events = run.read("marker-events", stem)
    (event,) = events[events["kind"] == "swap"].itertuples()
    assert {event.marker, event.partner} == set(swap)
    assert (event.start_s, event.end_s) == pytest.approx((1.0, 2.0), abs=0.021)
    assert event.put_right
    pd.testing.assert_frame_equal(run.read("kinematics", stem), clean, atol=1e-6)
    np.testing.assert_allclose(residuals_seen(run), before, atol=1e-6)


def residuals_seen(run: Run) -> np.ndarray:
    """(N, m, 3) of the markers in the squat, as the diagnosis sees them."""
    unit = run.unit("diagnose")
    person = person_of(unit)
    (squat,) = (t for t in unit.trials("kinematics") if t.stem == f"sub-01_{TRIALS[1]}")
    scene = scene_of(unit, person, prior_of(unit, person).phi, squat)
    assert scene.residual_m is not None
    return scene.residual_m


# --- two at once ---------------------------------------------------------------------------------


def test_a_second_run_on_the_same_folder_is_refused(run):
    """It says who is busy, changes nothing there, and does everybody else."""
    before = run.content()
    with held_alone(run.out / "sub-01"):
        answer = run.call("run", "--force")
    assert answer.code == 2
    assert "sub-01: another bsip is writing there. To correct it: wait until" in answer.err
    assert not [name for name in run.changed(before) if "sub-01" in name]
    run.done("run")
