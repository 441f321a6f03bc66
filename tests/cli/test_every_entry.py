"""Every entry in a study is used, or said with the reason why not; nothing is opened for that."""

from __future__ import annotations

import os
from pathlib import Path

import pandas as pd
import pytest

from bsip_cli.artifacts import empty_table, write_artifact_in_parts
from bsip_cli.config import load_config
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.pipeline import STAGES
from bsip_cli.report.words import labelled, task_of, trial_label
from bsip_cli.running.session import open_study
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import SCHEMAS
from bsip_cli.simulate.study import simulate_study
from bsip_cli.study.study import Study, Trial, load_study
from bsip_cli.study.trials import STEM_BYTES
from tests.small_study import Run, small

ROLES = {"static": ("static",), "sequence": ("sequence",)}
ANNEX = "../.git/annex/objects/Qk/1z/MD5E-s10--a.c3d/MD5E-s10--a.c3d"


def load(root: Path) -> tuple[Study, list[str]]:
    study, refusals = load_study(root, ROLES)
    return study, [str(refusal) for refusal in refusals]


@pytest.fixture
def folder(empty_study) -> Path:
    """A participant's, with one sound recording."""
    return empty_study / "sub-01"


def make(folder: Path, *names: str) -> None:
    """Files; with ``/`` at the end a folder, ``|`` a FIFO, ``name -> target`` a link."""
    for name in names:
        if " -> " in name:
            link, target = name.split(" -> ")
            (folder / link).symlink_to(target)
        elif name.endswith("/"):
            (folder / name).mkdir()
        elif name.endswith("|"):
            os.mkfifo(folder / name.rstrip("|"))
        else:
            (folder / name).write_bytes(b"")


def added(study: Study) -> dict[str, list[str]]:
    """The first participant's trials but the sound one, with the files that are read of each."""
    trials = study.participants[0].trials
    return {t.stem: [f.name for f in t.files] for t in trials if t.task != "static"}


# --- used -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "names",
    [
        ["sub-01_task-walk.C3D"],
        ["sub-01_task-walk.TRC", "sub-01_task-walk.MOT"],
        ["sub-01_task-walk.trc", "sub-01_task-walk.mot"],
        ["sub-01_task-walk.trc", "sub-01_task-walk_grf.mot"],
        ["sub-01_task-walk.trc", "sub-01_task-walk_forces.mot"],
        ["sub-01_task-walk.trc", "sub-01_task-walk_GRF.sto"],
        ["sub-01_task-walk.trc", "sub-01_task-walk.sto"],
        ["sub-01_task-walk.trc"],
    ],
)
def test_a_recording_with_its_forces_is_used(empty_study, folder, names):
    make(folder, *names)
    study, refusals = load(empty_study)
    assert (refusals, study.notes) == ([], ())
    assert added(study) == {"sub-01_task-walk": names}


def test_links_are_followed(empty_study, folder, tmp_path):
    make(tmp_path, "elsewhere/", "a.c3d")
    make(tmp_path / "elsewhere", "sub-01_ses-2_task-walk.c3d")
    make(folder, f"sub-01_task-hop.c3d -> {tmp_path / 'a.c3d'}", f"ses-2 -> {tmp_path}/elsewhere")
    study, refusals = load(empty_study)
    assert refusals == []
    assert list(added(study)) == ["sub-01_ses-2_task-walk", "sub-01_task-hop"]


@pytest.mark.parametrize("name", [".DS_Store", "._sub-01_task-walk.c3d", ".sub-01_task-w.c3d.x/"])
def test_what_is_hidden_is_passed_over(empty_study, folder, name):
    make(folder, name)
    study, refusals = load(empty_study)
    assert (added(study), refusals, study.notes) == ({}, [], ())


# --- looks like a recording and cannot be used: refused -------------------------------------------

MISNAMED = "its name does not say what it is"


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["sub-01_task-walk.c3d -> nowhere.c3d"], "is a broken symbolic link to nowhere.c3d"),
        ([f"sub-01_task-walk.c3d -> {ANNEX}"], f"link to {ANNEX}; .*`datalad get`"),
        (["sub-01_task-walk.c3d -> sub-01_task-walk.c3d"], "Too many levels of symbolic links"),
        (["sub-01_task-walk.c3d|"], "is a FIFO"),
        (["sub-01_task-walk.c3d -> /dev/zero"], "is a device"),
        (["sub-01_task-walk.c3d/"], "is a folder"),
        (["sub-01_task-walk.c3d.gz"], "is packed; .*unpack it"),
        (["sub-01_task-walk.trc.ZIP"], "is packed"),
        (["sub-01_task-walk.zip"], "is packed"),
        (["sub-01_task-walk.tar.gz"], "is packed"),
        (["any.c3d.xz"], "is packed"),
        (["sub-01_task-walk.mot"], "forces without markers; expected sub-01_task-walk.trc"),
        (["sub-01_task-walk_GRF.STO"], "forces without markers; expected sub-01_task-walk.trc"),
        (["sub-02_task-walk.c3d"], "its name says sub-02 and its folder sub-01"),
        (["sub-01_static.c3d"], MISNAMED),
        (["sub-01_task-walk_run-a.c3d"], MISNAMED),
        (["sub-01_task-walk fast.c3d"], MISNAMED),
        (["sub-01_task-walk.c3d.c3d"], MISNAMED),
        (["walk\nstudy: all is well.c3d"], f"walk.study: all is well.c3d: {MISNAMED}"),
        (["gän\udcffge.c3d"], MISNAMED),
        (["Tom 1.c3d", "Tom 2.c3d"], rf"Tom 1.c3d: {MISNAMED} \(likewise Tom 2.c3d\)"),
        (["sub-01_ses-2_task-walk.c3d"], "its name says sub-01_ses-2 and its folder sub-01;"),
        ([f"{'sub-01_task-':w<{STEM_BYTES + 1}}.c3d"], f"letters before .* at most {STEM_BYTES}"),
        (
            ["sub-01_task-walk.trc", "sub-01_task-walk.mot", "sub-01_task-walk_grf.mot"],
            "walk.trc: there are sub-01_task-walk.mot and sub-01_task-walk_grf.mot next to it",
        ),
        (["sub-01_task-w.trc", "sub-01_task-w.mot", "sub-01_task-w.MOT"], "task-w.MOT and .*mot"),
        (
            ["sub-01_task-walk.trc", "sub-01_task-walk.mot|"],
            "walk.trc: its forces, sub-01_task-walk.mot: is a FIFO",
        ),
        (["ses-2 -> nowhere"], "is a broken symbolic link to nowhere; expected a session's"),
        (["ses-two_a/"], "a session's folder of this name"),
    ],
)
def test_what_cannot_be_used_is_refused(empty_study, folder, names, said):
    """In one sentence with the reason; the sound recording is used all the same."""
    make(folder, *names)
    study, refusals = load_study(empty_study, ROLES)
    assert added(study) == {}
    assert study.notes == ()
    (refusal,) = refusals
    assert refusal.exit_code == 3
    assert str(refusal).startswith(str(folder))
    assert str(refusal).isprintable()
    with pytest.raises(BadDataError, match=said):
        raise refusal


def test_many_alike_are_told_together(empty_study, folder):
    make(folder, *(f"sub-01_task-t{k:02d}.c3d -> {ANNEX}{k}" for k in range(30)))
    _, (refusal,) = load(empty_study)
    assert f"sub-01_task-t00.c3d: is a broken symbolic link to {ANNEX}0 (likewise " in refusal
    assert "sub-01_task-t20.c3d and 9 more)" in refusal


def test_a_name_may_be_as_long_as_its_artifacts(empty_study, folder, tmp_path, monkeypatch):
    """The longest that is allowed, and the longest name that is written of it."""
    stem = f"{'sub-01_task-':w<{STEM_BYTES}}"
    make(folder, f"{stem}.c3d")
    assert list(added(load(empty_study)[0])) == [stem]
    kinds = [s for s in SCHEMAS.values() if s.level == "trial"]
    kind = max(kinds, key=lambda schema: len(schema.file_name))
    assert max(len(f"refusal-{stage.name}") for stage in STAGES) <= len(kind.file_name)
    monkeypatch.setattr(os, "getpid", lambda: 4194304)  # the longest
    path = tmp_path / "out" / f"{stem}_{kind.file_name}.parquet"
    rows = empty_table(kind.kind)
    write_artifact_in_parts(path, kind.kind, [pd.DataFrame(rows)], dict)
    assert path.exists()


@pytest.mark.parametrize("names", [("Walk.c3d", "walk.c3d"), ("walk.c3d", "walk.trc")])
def test_names_whose_results_would_lie_in_one_file(empty_study, folder, names):
    make(folder, *(f"sub-01_task-{name}" for name in names))
    study, refusals = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-02"]
    assert "sub-01_task-{}, sub-01_task-{}".format(*names) in refusals[0]


def test_participants_that_differ_in_capitals_only(empty_study):
    with (empty_study / "participants.tsv").open("a") as table:
        table.write("sub-a1\tM\t70\t1.80\nsub-A1\tM\t70\t1.80\n")
    make(empty_study, "sub-a1/", "sub-A1/")
    for name in ("sub-a1", "sub-A1"):
        make(empty_study / name, f"{name}_task-static.c3d")
    study, refusals = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-01", "sub-02", "sub-a1"]
    assert "sub-A1 stands twice, in other capitals as sub-a1" in refusals[0]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("sub-03 -> nowhere", "sub-03: is a broken symbolic link to nowhere"),
        ("sub-03", "sub-03: is a file"),
        ("sub-03|", "sub-03: is a FIFO"),
        ("sub-03/", "sub-03: no recordings"),
    ],
)
def test_a_participant_s_folder_that_is_none(empty_study, name, said):
    with (empty_study / "participants.tsv").open("a") as table:
        table.write("sub-03\tM\t70\t1.80\n")
    make(empty_study, name)
    study, refusals = load(empty_study)
    assert [person.id for person in study.participants] == ["sub-01", "sub-02"]
    assert len(refusals) == 1
    assert said in refusals[0]


def test_a_recording_beside_the_folders(empty_study):
    make(empty_study, "sub-01_task-walk.c3d", "README")
    _, (refusal,) = load(empty_study)
    assert "sub-01_task-walk.c3d: lies in no participant's folder" in refusal


@pytest.mark.parametrize("error", [OSError(5, "Input/output error"), PermissionError(13, "No")])
@pytest.mark.parametrize("place", ["study", "sub-01", "ses-1"])
def test_a_folder_that_cannot_be_listed(empty_study, folder, failing, error, place):
    make(folder, "ses-1/")
    failing("iterdir", lambda path: path.name == place, error)
    study, (refusal,) = load(empty_study)
    assert f"{place}: cannot be listed ({error.strerror})" in refusal
    left = ["sub-02"] if place == "sub-01" else ["sub-01", "sub-02"]
    assert [person.id for person in study.participants] == left


def test_an_entry_that_cannot_be_looked_at(empty_study, folder, failing):
    make(folder, "sub-01_task-walk.c3d")
    error = OSError(5, "Input/output error")
    failing("stat", lambda path: path.name == "sub-01_task-walk.c3d", error)
    study, (refusal,) = load(empty_study)
    assert added(study) == {}
    assert "walk.c3d: cannot be looked at (Input/output error)" in refusal


def test_a_study_whose_path_is_no_utf8(empty_study, tmp_path):
    root = empty_study.rename(tmp_path / "st\udcffudy")
    with pytest.raises(UsageError, match=r"st\?udy: its path holds bytes that are no UTF-8"):
        load(root)


# --- plainly no recording: said -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["notes.txt"], "files that are no recordings and not used: sub-01/notes.txt"),
        (
            [f"{k}.enf" for k in range(8)] + ["1.XCP", "2.xcp", "LICENCE"],
            "not used: 8 .enf, 2 .xcp",
        ),
        (["raw/", "motion/"], "not looked into, .*: sub-01/motion, sub-01/raw"),
        (["results.zip", "sub-01_task-static.c3d.gz"], "sub-01/results.zip, sub-01/sub-01_task-st"),
        (["sub-01_task-static.mot"], "forces that are not used, .*: sub-01/sub-01_task-static.mot"),
        (["walk_ik.mot"], "not used: sub-01/walk_ik.mot"),
        (["a\nb.txt -> nowhere"], "not used: sub-01/a.b.txt"),
        (["../sub-09/"], "participants.tsv does not name sub-09: not used"),
    ],
)
def test_what_is_no_recording_is_said(empty_study, folder, names, said):
    make(folder, *names)
    study, refusals = load(empty_study)
    assert (added(study), refusals) == ({}, [])
    (note,) = study.notes
    assert note.isprintable()
    with pytest.raises(ValueError, match=said):
        raise ValueError(note)


def test_notes_are_of_the_whole_study(empty_study):
    for name in ("sub-01", "sub-02"):
        make(empty_study / name, "a.enf", "b.enf", "ses-1/")
        make(empty_study / name / "ses-1", "c.enf", "ses-1 -> ..")
    study, _ = load(empty_study)
    assert [note.partition(": ")[2] for note in study.notes] == [
        "sub-01/ses-1/ses-1, sub-02/ses-1/ses-1",
        "6 .enf",
    ]


def test_nobody_else_is_looked_at(empty_study):
    make(empty_study, "sub-09/")
    make(empty_study / "sub-02", "a.enf", "Tom.c3d")
    study, refusals = load_study(empty_study, ROLES, ["sub-01"])
    assert (study.notes, refusals) == ((), [])


# --- through the command line ---------------------------------------------------------------------


def test_notes_and_refusals_come_first(bsip, empty_study, folder, tmp_path):
    make(folder, "Tom\x1b[2J.c3d", "a.enf", "b\nc.enf")
    answer = bsip("scale", empty_study, "--out", tmp_path / "out")
    first, second, *_ = answer.err.splitlines()
    assert first == (
        "study: files that are no recordings and not used: sub-01/a.enf, sub-01/b?c.enf"
    )
    assert second.startswith(f"study: {folder}/Tom?[2J.c3d: {MISNAMED}")
    assert "1 refused" in answer.summary


def test_a_fifo_for_a_table_ends(bsip, empty_study, tmp_path):
    (empty_study / "participants.tsv").unlink()
    os.mkfifo(empty_study / "participants.tsv")
    answer = bsip("run", empty_study, "--out", tmp_path / "out")
    assert answer.code == 3
    assert f"{empty_study}/participants.tsv: cannot be read: it is a FIFO" in answer.err


def test_a_note_is_no_fault(empty_study, folder, tmp_path):
    make(folder, "a.enf", "raw/")
    opened = open_study(empty_study, tmp_path / "out", (), None)
    assert [(one.state, one.exit_code) for one in opened.refusals] == [("noted", 0)] * 2


# --- sessions as in BIDS: sub-01/ses-2/sub-01_ses-2_task-walking_run-1.c3d ------------------------


def test_trials_know_their_session(empty_study, folder):
    first, second = "ses-2/sub-01_ses-2_task-sequence_run-1", "ses-pre/sub-01_ses-pre_task-w"
    make(folder, "ses-2/", "ses-pre/", f"{first}.c3d", f"{second}.trc", f"{second}_grf.mot")
    study, refusals = load(empty_study)
    trials = study.participants[0].trials
    assert refusals == []
    assert [(t.session, t.task, t.run, t.role) for t in trials] == [
        ("2", "sequence", 1, "sequence"),
        ("pre", "w", None, "validation"),
        (None, "static", None, "static"),
    ]
    assert trials[1].files[1].name == "sub-01_ses-pre_task-w_grf.mot"


def test_artifacts_of_all_sessions_lie_with_their_participant(empty_study, folder):
    make(folder, "ses-2/", "ses-2/sub-01_ses-2_task-walking_run-1.c3d")
    study, _ = load(empty_study)
    person = study.participants[0]
    unit = Unit(STAGES[0], study, Path("out"), load_config([]), person, person.trials[0])
    name = "sub-01_ses-2_task-walking_run-1"
    assert unit.path("markers") == Path("out/sub-01") / f"{name}_markers.parquet"
    assert list(unit.inputs()) == [f"{name}.c3d"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "ses-2/sub-01_task-walk.c3d",
            "its name says sub-01 and its folder sub-01_ses-2; expected "
            "names like sub-01_ses-2_task-",
        ),
        ("ses-2/sub-01_ses-3_task-walk.c3d", "says sub-01_ses-3 and its folder sub-01_ses-2"),
        ("ses-2/sub-02_ses-2_task-walk.c3d", "says sub-02_ses-2 and its folder sub-01_ses-2"),
        ("ses-2/sub-01_ses-_task-walk.c3d", "its name does not say what it is"),
        ("ses-2/sub-01_ses-2_task-walk.mot", "forces without markers"),
    ],
)
def test_what_cannot_be_used_in_a_session(empty_study, folder, name, said):
    make(folder, "ses-2/", name)
    study, (refusal,) = load(empty_study)
    assert [trial.stem for trial in study.participants[0].trials] == ["sub-01_task-static"]
    assert refusal.startswith(str(folder / name))
    assert said in refusal


def test_a_participant_who_has_sessions_only(empty_study, folder):
    (folder / "sub-01_task-static.c3d").unlink()
    make(folder, "ses-1/", "ses-2/", *(f"ses-{k}/sub-01_ses-{k}_task-walk.c3d" for k in "12"))
    study, refusals = load(empty_study)
    assert refusals == []
    assert [trial.session for trial in study.participants[0].trials] == ["1", "2"]


def test_labels_tell_sessions_apart():
    stem = "sub-01_ses-pre_task-walk_run-2"
    assert trial_label(stem) == "walk (session pre, run 2)"
    assert trial_label("sub-01_ses-2_task-walk") == "walk (session 2)"
    assert task_of(stem) == "walk"
    assert labelled(f"in {stem} and sub-1_task-hop") == "in walk (session pre, run 2) and hop"


# --- the same numbers -----------------------------------------------------------------------------


RENAMED = {
    "sub-01_task-sequence_run-1": "sub-01_ses-1_task-sequence_run-1",
    "sub-01_task-static": "sub-01_ses-2_task-static",
}


def performed(run: Run) -> list[Trial]:
    """Ingest and scale; the trials."""
    _, refusals = load_study(run.study, run.config().roles.model_dump())
    assert refusals == []
    trials = run.unit("ingest").study.participants[0].trials
    for stage in STAGES[:3]:
        for stem in [trial.stem for trial in trials] if stage.level == "trial" else [""]:
            outcome = run.perform(stage.name, stem)
            assert outcome.state == "done", outcome
    return list(trials)


@pytest.mark.long
def test_sessions_change_no_number(tmp_path):
    """One body and one skeleton, whichever sessions the recordings are of."""
    root, flat = tmp_path / "study", Run(tmp_path / "study", tmp_path / "flat")
    simulate_study(root, small(static=1.0, sequence=4.0))
    performed(flat)
    for stem, new in RENAMED.items():
        folder = root / "sub-01" / new.split("_")[1]
        folder.mkdir()
        (root / "sub-01" / f"{stem}.c3d").rename(folder / f"{new}.c3d")
    sessions = Run(root, tmp_path / "sessions")
    assert {trial.stem for trial in performed(sessions)} == set(RENAMED.values())
    paths = sorted((flat.out / "sub-01").glob("*.parquet"))
    assert len(paths) == sum(len(s.writes) * (2 if s.level == "trial" else 1) for s in STAGES[:3])
    kinds = {schema.file_name: kind for kind, schema in SCHEMAS.items()}
    for path in paths:
        kind = kinds[path.stem.rpartition("_")[2]]
        stem = path.stem.removesuffix(f"_{SCHEMAS[kind].file_name}")
        other = sessions.read(kind, RENAMED.get(stem, stem))
        if kind == "readings":  # a row for each session
            assert set(other["session"]) == {"1", "2"}
            continue
        expected = flat.read(kind, stem).replace(RENAMED)
        pd.testing.assert_frame_equal(expected, other, check_exact=True)
