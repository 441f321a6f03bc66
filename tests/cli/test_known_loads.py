"""[[loads]] of study.toml: what it may say, and what it changes in a simulated study."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from bsip_cli.config import Config, Load
from bsip_cli.pipeline import STAGES
from bsip_cli.running.runner import perform
from bsip_cli.schemas import bsip_names
from bsip_cli.simulate.people import Inertia, combined
from bsip_cli.simulate.recording import measure_trial, simulate_trial, write_trial
from bsip_cli.simulate.study import participant_person, simulate_study
from bsip_cli.study.study import load_study
from tests.small_study import Run, small

GOOD = '[[loads]]\nsegment = "shank_r"\nmass_kg = 1.0\nposition_m = [0.0, -0.15, 0.03]\n'


# --- what it may say ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            GOOD.replace("shank_r", "shnk_r"),
            "loads.0.segment: there is no shnk_r (did you mean shank_r?); expected one of",
        ),
        (GOOD.replace("1.0", "-1.0"), "loads.0.mass_kg = -1.0: Input should be greater than 0"),
        (GOOD.replace("-0.15", "-150"), "loads.0.position_m.1 = -150: Input should be greater"),
        (GOOD.replace("-0.15, ", ""), "loads.0.position_m.2 is missing"),
        (GOOD.replace("mass_kg = 1.0\n", ""), "loads.0.mass_kg is missing"),
        (GOOD + 'task = "static"\n', "unknown option loads.0.task (did you mean tasks?)"),
        (GOOD + 'tasks = ["statik"]\n', "loads.0.tasks: there is no statik (did you mean static?)"),
        (
            GOOD + 'participants = ["sub-1"]\n',
            "loads.0.participants: there is no sub-1 (did you mean sub-0",
        ),
        (GOOD + "runs = [2]\n", "loads.0.runs: there is no 2; expected none, no recording has any"),
    ],
)
def test_load_that_cannot_be(bsip, empty_study, tmp_path, text, said):
    (empty_study / "study.toml").write_text(text)
    answer = bsip("ingest", empty_study, "--out", tmp_path / "out")
    assert answer.code == 2
    (line,) = answer.err.splitlines()
    assert said in line


def test_load_that_no_recording_carries(bsip, empty_study, tmp_path):
    (empty_study / "sub-01" / "sub-01_task-squat_run-1.c3d").write_bytes(b"")
    (empty_study / "study.toml").write_text(GOOD + 'participants = ["sub-02"]\ntasks = ["squat"]\n')
    answer = bsip("ingest", empty_study, "--out", tmp_path / "out")
    assert answer.code == 2
    assert "loads.0: 1 kg on shank_r are carried in no recording" in answer.err


@pytest.mark.parametrize(
    ("who", "trial", "carried"),
    [
        ({}, ("sub-01", "static", None), True),
        ({"tasks": ("squat",)}, ("sub-01", "squat", 2), True),
        ({"tasks": ("squat",)}, ("sub-01", "static", None), False),
        ({"runs": (2,)}, ("sub-01", "squat", 2), True),
        ({"runs": (2,)}, ("sub-01", "squat", 1), False),
        ({"runs": (2,)}, ("sub-01", "static", None), False),
        ({"participants": ("sub-02",)}, ("sub-01", "squat", 1), False),
    ],
)
def test_which_trials_carry_a_load(who, trial, carried):
    load = Load(segment="hand_l", mass_kg=0.5, position_m=(0.0, -0.1, 0.0), **who)
    assert load.is_carried_in(*trial) == carried


# --- what it changes ----------------------------------------------------------------------------

PLAIN, LOADED = "sub-01_task-sequence_run-1", "sub-01_task-sequence_run-2"
STATIC = "sub-01_task-static"
BACKPACK = Load(segment="upper_torso", mass_kg=8.0, position_m=(-0.2, -0.2, 0.0))
OPTIONS = small(seed=5, static=1.0, sequence=14.0)


def with_backpack(person):
    point = Inertia(BACKPACK.mass_kg, np.array(BACKPACK.position_m), np.zeros((3, 3)))
    thorax = combined([(person.inertias["thorax"], np.zeros(3)), (point, np.zeros(3))])
    return replace(person, inertias={**person.inertias, "thorax": thorax})


@dataclass(frozen=True)
class LoadedRun(Run):
    """With options as if study.toml had them."""

    changes: dict = field(default_factory=dict)

    def config(self) -> Config:
        return super().config().model_copy(update=self.changes)

    def declare(self, *loads: Load) -> None:
        self.changes["loads"] = loads

    def options(self, section: str, **values) -> None:
        self.changes[section] = getattr(self.config(), section).model_copy(update=values)

    def everything(self, until: str) -> dict[str, str]:
        """All stages up to one; the state of each unit."""
        _, refusals = load_study(self.study, self.config().roles.model_dump())
        assert not refusals
        states = {}
        for stage in STAGES[: [each.name for each in STAGES].index(until) + 1]:
            stems = (STATIC, PLAIN, LOADED) if stage.level == "trial" else ("",)
            for stem in stems:
                states[f"{stage.name} {stem}".strip()] = self.perform(stage.name, stem).state
        return states

    def loads_in(self, kind: str, owner: str = "sub-01") -> list | dict:
        return self.provenance(kind, owner)["facts"]["loads"]


@pytest.fixture(scope="session")
def carried(tmp_path_factory):
    """Run 1 with nothing, the static trial and run 2 with 8 kg on the back; undeclared."""
    root = tmp_path_factory.mktemp("carried")
    simulate_study(root / "study", OPTIONS)
    person = participant_person(OPTIONS, 1)
    for number, (task, stem) in enumerate((("static", STATIC), ("sequence", LOADED))):
        rng = np.random.default_rng([5, number])
        moved = simulate_trial(with_backpack(person), task, rng, OPTIONS.durations_s[task])
        path = root / "study" / "sub-01" / f"{stem}.c3d"
        rates, richness = OPTIONS.rates_of(task), OPTIONS.richness
        measured = measure_trial(moved, person, rates, OPTIONS.laboratory, richness, rng)
        write_trial(path, measured, richness.quantised)
    run = LoadedRun.within(root)
    states = run.everything("identify")
    assert set(states.values()) == {"done"}
    return run


@pytest.fixture
def run(carried, tmp_path) -> LoadedRun:
    return replace(carried.copied_to(tmp_path), changes={})


WORN = (
    BACKPACK.model_copy(update={"tasks": ("static",)}),
    BACKPACK.model_copy(update={"runs": (2,)}),
)


@pytest.fixture(scope="session")
def declared(carried, tmp_path_factory) -> LoadedRun:
    """The same with the loads declared; nobody changes it."""
    copy = replace(carried.copied_to(tmp_path_factory.mktemp("declared")), changes={})
    copy.declare(*WORN)
    assert copy.everything("identify")["identify"] == "done"
    return copy


@pytest.mark.long
def test_load_in_the_static_trial_is_no_mass_of_the_person(carried, run):
    stated = run.unit("scale").participant.mass_kg
    before = carried.read("person").iloc[0]
    assert before["plate_mass_kg"] - stated == pytest.approx(8.0, abs=0.3)
    run.declare(*WORN)
    assert run.perform("ingest", STATIC).state == "done"
    told = run.perform("scale")
    assert not [sentence for sentence in told.sentences if "the plates measure" in sentence]
    assert run.read("person").iloc[0]["plate_mass_kg"] == pytest.approx(stated, abs=0.3)


@pytest.mark.long
def test_mass_taken_from_the_plates_is_without_the_load(run):
    table = run.study / "participants.tsv"
    header, line = table.read_text().splitlines()
    name, sex, mass, height = line.split("\t")
    table.write_text(f"{header}\n{name}\t{sex}\tn/a\t{height}\n")
    run.declare(*WORN)
    for stem in (STATIC, PLAIN, LOADED):
        run.perform("ingest", stem)
    told = run.perform("scale").sentences
    assert any("plates without the known load (8 kg on the upper torso)" in line for line in told)
    person = run.read("person").iloc[0]
    assert person["mass_source"] == "plates"
    assert person["mass_kg"] == pytest.approx(float(mass), abs=0.3)


@pytest.mark.long
def test_declared_load_is_not_taken_for_the_body(carried, declared):
    """Both runs together identify: without a word no body explains both, declared one does."""
    stated = declared.unit("identify").participant.mass_kg
    masses = declared.read("bsip").query("method == 'OM'")["mass_kg"]
    assert masses.sum() == pytest.approx(stated, abs=0.4)
    misfit, fit = (r.read("identification").iloc[0] for r in (carried, declared))
    assert misfit["rms_fz_N"] > 30.0  # half of the weight of 8 kg is 39 N
    assert fit["rms_fz_N"] < 0.3 * misfit["rms_fz_N"]
    assert fit["trials"] == f"{PLAIN}, {LOADED}"
    blocks = declared.read("used-blocks")
    assert set(blocks["trial"]) == {PLAIN, LOADED}
    used = (blocks["end_s"] - blocks["start_s"]).sum()
    assert fit["duration_s"] == pytest.approx(used + 0.02 * len(blocks))


@pytest.mark.long
def test_prediction_and_report_include_the_load(declared, tmp_path):
    run = declared.copied_to(tmp_path)
    run.everything("reconstruct")
    assert run.perform("report").state == "done"
    for stem in (PLAIN, LOADED):
        table = run.read("reconstruction", stem)
        table = table[table["valid"]]
        force = table.groupby("method")["fz_N"].mean()
        assert force["OM"] == pytest.approx(force["measured"], abs=5.0)
        assert force["RM"] == pytest.approx(force["measured"], abs=5.0)
    load = {"segment": "upper_torso", "mass_kg": 8.0, "position_m": [-0.2, -0.2, 0.0]}
    assert run.loads_in("reconstruction", LOADED) == [load]
    assert run.loads_in("reconstruction", PLAIN) == []
    assert run.loads_in("bsip") == {PLAIN: [], LOADED: [load]}
    report = (run.out / "sub-01" / "report.html").read_text(encoding="utf-8")
    plain = report.replace("\N{NO-BREAK SPACE}", " ")
    assert "8 kg on the upper torso in static and sequence (run 2)" in plain


@pytest.mark.long
def test_changed_load_redoes_what_it_touches_and_nothing_else(run):
    run.everything("reconstruct")
    assert set(run.everything("reconstruct").values()) == {"fresh"}
    run.declare(BACKPACK.model_copy(update={"participants": ("sub-02",)}))
    assert set(run.everything("reconstruct").values()) == {"fresh"}
    run.declare(WORN[1])
    touched = {f"ingest {LOADED}", f"ik {LOADED}", "scale", "identify"}
    states = run.everything("reconstruct")
    assert states[f"ingest {PLAIN}"] == states[f"ingest {STATIC}"] == "fresh"
    assert {states[name] for name in touched} == {"done"}
    assert {states[f"reconstruct {stem}"] for stem in (STATIC, PLAIN, LOADED)} == {"done"}


# --- several identification trials --------------------------------------------------------------


@pytest.mark.long
def test_run_with_unusable_forces_does_not_identify(declared, tmp_path):
    run = declared.copied_to(tmp_path)
    beside_the_plate = run.read("wrench", PLAIN).assign(valid=False)
    run.rewrite("wrench", beside_the_plate, PLAIN)
    assert run.perform("identify").state == "done"
    assert set(run.read("used-blocks")["trial"]) == {LOADED}
    assert run.read("identification").iloc[0]["trials"] == LOADED


@pytest.mark.long
def test_blocks_are_left_out_in_each_run(run):
    run.declare(*WORN)
    run.options("identify", hold_out_fraction=0.25, block_s=2.0)
    run.everything("identify")
    blocks = run.read("used-blocks")
    for stem in (PLAIN, LOADED):
        kinematics, wrench = run.read("kinematics", stem), run.read("wrench", stem)
        times = kinematics["time_s"].to_numpy()
        usable = kinematics["determined"].to_numpy() & wrench["valid"].to_numpy()
        used = np.zeros(len(times), dtype=bool)
        for row in blocks[blocks["trial"] == stem].itertuples():
            used |= (times >= row.start_s) & (times <= row.end_s)
        left_out = ((times - times[0]) // 2.0) % 4 == 3  # every fourth block
        assert (used == usable & ~left_out).all()
        assert (usable & left_out).any()


@pytest.mark.long
def test_order_of_the_runs_does_not_matter(declared, tmp_path):
    run = declared.copied_to(tmp_path)
    first = declared.read("bsip").query("method == 'OM'")
    unit = run.unit("identify")
    turned = replace(unit.participant, trials=unit.participant.trials[::-1])
    assert perform(replace(unit, participant=turned), force=True).state == "done"
    second = run.read("bsip").query("method == 'OM'")
    for name in bsip_names():
        moved = (second[name] - first[name]).abs() / first[f"{name}_sd"]
        assert moved.max() < 5e-3, name  # what is left is the solver's tolerance
