"""``bsip compare-loads``: what it refuses, and a simulated mass that it finds."""

from __future__ import annotations

import json
import shutil

import pytest

from bsip_cli.artifacts import read_artifact
from bsip_cli.pipeline import producer

KINDS = ("wrench", "skeleton", "marker-positions", "kinematics", "regression")
STEMS = ("sub-01_task-squat_run-1", "sub-01_task-squat_run-2", "sub-01_task-walk_run-1")


def load(mass_kg: float = 1.0, segment: str = "shank_r", **where: object) -> str:
    lines = {"segment": segment, "mass_kg": mass_kg, "position_m": [0.0, -0.15, 0.03], **where}
    return "\n".join(["[[loads]]", *(f"{k} = {json.dumps(v)}" for k, v in lines.items()), ""])


@pytest.fixture
def finished(empty_study, tmp_path):
    """A study whose artifacts are there, empty: what is refused is refused before they are read."""
    out = tmp_path / "out" / "sub-01"
    out.mkdir(parents=True)
    for stem in STEMS:
        (empty_study / "sub-01" / f"{stem}.c3d").write_bytes(b"")
    for kind in KINDS:
        owners = STEMS if producer(kind).level == "trial" else ("sub-01",)
        for owner in owners:
            (out / f"{owner}_{kind}.parquet").write_bytes(b"")
    return empty_study, out.parent


RUN_2 = load(tasks=["squat"], runs=[2])


@pytest.mark.parametrize(
    ("declared", "options", "said"),
    [
        ("", (), "no recording with a declared load has motion and forces; expected [[loads]]"),
        (load(), (), "no recording without a declared load has motion and forces"),
        (RUN_2, ("--with", "jump"), "--with: there is no jump; expected some of squat"),
        (RUN_2, ("--with", "squat"), "squat_run-1 and sub-01_task-squat_run-2 do not carry the"),
        (RUN_2, ("--with", "walk", "--without", "walk"), "walk_run-1 in --with and in"),
        (RUN_2, ("--with", "walk", "--without", "squat_run-1"), "carry the same declared load"),
        (RUN_2, ("--with", "static"), "sub-01_task-static: no motion or forces, or refused"),
        (
            load(tasks=["walk"]) + load(0.5, runs=[2]),
            (),
            "do not carry the same declared loads; expected the same in all recordings of a set",
        ),
    ],
)
def test_sets_that_cannot_be_compared(bsip, finished, declared, options, said):
    study, out = finished
    earlier = out / "sub-01" / "sub-01_load-comparison.parquet"
    earlier.write_bytes(b"")
    (study / "study.toml").write_text(declared)
    answer = bsip("compare-loads", study, "--out", out, "--participant", "sub-01", *options)
    assert (answer.code, answer.out) == (2, "")
    assert said in answer.err.splitlines()[0]
    assert not earlier.exists()


def test_names_the_command_to_run_first(bsip, empty_study, tmp_path):
    who = ("--out", tmp_path / "out", "--participant", "sub-01")
    answer = bsip("compare-loads", empty_study, *who)
    assert answer.code == 2
    assert "run `bsip ingest` first" in answer.err


@pytest.mark.long
def test_a_simulated_kilogram_comes_back(bsip, tmp_path):
    """Run 2 carries 1 kg on a shank: found beside run 1, and not found where run 3 has none."""
    study, out = tmp_path / "study-1", tmp_path / "out"
    drawn = ("--participants", 1, "--seed", 11, "--task", "static", "--task", "sequence")
    hidden = ("--effect", "added_mass", "--size", 1, "--target", "shank_r")
    for run in (1, 2, 3):
        what = (*hidden, "--effect-tasks", "sequence") if run == 2 else ()
        root = tmp_path / f"study-{run}"
        bsip("simulate", root, *drawn, "--sequence-s", 20, "--run", run, *what)
        name = f"sub-01_task-sequence_run-{run}.c3d"
        if run > 1:
            shutil.move(root / "sub-01" / name, study / "sub-01" / name)
    for stage in ("ingest", "scale", "ik", "regress"):
        bsip.done(stage, study, "--out", out)
    truth = json.loads((tmp_path / "study-2" / "truth" / "sub-01_truth.json").read_text())
    position = truth["effects"][0]["position_m"]

    def compared(run: int, *loads: str):
        config = tmp_path / "loads.toml"
        config.write_text("".join(loads))
        who = ("--participant", "sub-01", "--config", config)
        sets = ("--with", f"sequence_run-{run}", "--without", "sequence_run-1")
        answer = bsip.done("compare-loads", study, "--out", out, *who, *sets)
        assert "whole body" in answer.out
        assert ("the mass may be zero" in answer.out) == (run == 3)
        path = out / "sub-01" / "sub-01_load-comparison.parquet"
        return read_artifact(path, "load-comparison"), answer.err

    found = {
        run: compared(run, load(position_m=position, tasks=["sequence"], runs=[run]))[0]
        for run in (2, 3)
    }
    for run, truly_kg in ((2, 1.0), (3, 0.0)):
        masses = found[run][found[run]["quantity"] == "m"].set_index(["analysis", "segment"])
        for place in (("loaded segments", "shank_r"), ("two identifications", "all")):
            low, high = masses.loc[place, ["ci_low", "ci_high"]]
            assert low < truly_kg < high
            assert high - low < 0.5
    worn = found[2]
    inside = (worn["ci_low"] <= worn["expected"]) & (worn["expected"] <= worn["ci_high"])
    assert inside.mean() > 0.9
    assert len(worn) == 1 + 150 + 13
    both, said = compared(2, load(0.5, runs=[2]), load(0.5, "foot_r", runs=[2]))
    assert set(both["analysis"]) == {"two identifications"}
    assert "loads on the right shank and the right foot, of which a joint connects some" in said
