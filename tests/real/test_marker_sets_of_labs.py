"""Marker sets of several laboratories, from the recording to poses; skipped without recordings."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.program import Answer, Program

DATA = Path(__file__).parents[2].parent / "shared" / "data"

pytestmark = [
    pytest.mark.real,
    pytest.mark.long,
    pytest.mark.skipif(
        not DATA.is_dir(), reason="the real recordings (../shared/data) are missing"
    ),
]


@dataclass(frozen=True)
class Lab:
    """A recording, its person, and what should become of it.

    ``median_mm`` is the largest that half of the markers may lie off; ``said`` what bsip tells.
    """

    recording: str
    marker_set: str
    median_mm: float
    said: tuple[str, ...] = ()
    unmarked: tuple[str, ...] = ()
    options: str = ""
    person: str = "M\tn/a\tn/a"


HANDS, HEAD = ("hand_l", "hand_r"), ("head",)
ARMS = ("upper_arm_l", "upper_arm_r", "forearm_l", "forearm_r", *HANDS)
LABS = {
    "van Sint Jan": Lab("ezc3d_rehazenter_qualisys/Qualisys.c3d", "van_sint_jan", 5),
    "clusters, knees by movement": Lab(
        "hamner_other/run200.trc",
        "hamner_other",
        6,
        ("the left knee has no marker: centre from its movement", "no markers on the head"),
        HEAD,
    ),
    "Helen Hayes, labels cut": Lab(
        "motionanalysis_helenhayes/Sample_Jump2.c3d",
        "helen_hayes",
        7,
        ("named them by POINT:DESCRIPTIONS", "no marker for c7: placed by mean proportions"),
        HANDS,
    ),
    "arms abroad": Lab(
        "return11_static/c3dfile1.c3d", "return11_static", 2, person="F\t58.35\t1.6"
    ),
    "sprinter": Lab(
        "sprinter_ja1/JA1Gait35.c3d",
        "sprinter_ja1",
        10,
        ("the left wrist has one marker only",),
        (*HEAD, *HANDS),
    ),
    "no arms": Lab(
        "opensim_walking/test_walking.c3d",
        "hamner_other",
        6,
        ("no markers on the left arm: it hangs straight down",),
        (*HEAD, *ARMS),
    ),
    "legs only, on request": Lab(
        "ktk_walk_and_serve/walk.c3d",
        "plugin_gait",
        5,
        ("the trunk straight on it",),
        ("upper_torso", *HEAD, *ARMS),
        '[scale]\nmay_be_held = ["head", "upper_arm", "forearm", "hand", "upper_torso"]\n',
        "M\t73.4\t1.639",
    ),
    "French names": Lab(
        "golf_french/swing1.c3d",
        "words",
        9,
        ("no shipped set fits well", "EASG = left asis", "not understood: L5"),
    ),
    "words of no set, running": Lab("type3_running_kistler/Running_0002.c3d", "words", 9, ()),
    "walks in and out": Lab("edge_btk/Gait.c3d", "helen_hayes", 5, (), (*HEAD, *HANDS)),
}


def laid_out(root: Path, lab: Lab) -> Path:
    """A study of the one recording."""
    study, source = root / "study", DATA / lab.recording
    target = study / "sub-01" / f"sub-01_task-trial{source.suffix.lower()}"
    target.parent.mkdir(parents=True)
    shutil.copyfile(source, target)
    forces = source.with_name(f"{source.stem}_grf.mot")
    if forces.exists():
        shutil.copyfile(forces, target.with_suffix(".mot"))
    header = "participant_id\tsex\tmass_kg\theight_m"
    (study / "participants.tsv").write_text(f"{header}\nsub-01\t{lab.person}\n")
    (study / "study.toml").write_text(lab.options)
    return study


def stage(name: str, study: Path) -> Answer:
    return Program()(name, study, "--out", study.with_name("out"))


@pytest.mark.parametrize("lab", LABS.values(), ids=LABS.keys())
def test_from_the_recording_to_poses(tmp_path, lab):
    study = laid_out(tmp_path, lab)
    answers = [stage(name, study) for name in ("ingest", "scale", "ik")]
    told = "\n".join(answer.err for answer in answers)
    assert [answer.code for answer in answers] == [0, 0, 0], told
    for words in lab.said:
        assert words in told
    out = tmp_path / "out" / "sub-01"
    quality = pd.read_parquet(out / "sub-01_task-trial_quality.parquet").set_index("check")
    assert quality.loc["marker_set", "found"] == lab.marker_set
    skeleton = pd.read_parquet(out / "sub-01_skeleton.parquet").set_index("segment")
    assert set(skeleton.index[skeleton["held"]]) == set(lab.unmarked)
    residuals = pd.read_parquet(out / "sub-01_task-trial_marker-residuals.parquet")
    squares = residuals.assign(square=residuals["residual_m"] ** 2).groupby("marker")["square"]
    assert 1000 * np.sqrt(squares.mean()).median() < lab.median_mm


def test_legs_only_are_refused_unasked(tmp_path):
    study = laid_out(tmp_path, Lab("ktk_walk_and_serve/walk.c3d", "plugin_gait", 0))
    stage("ingest", study)
    answer = stage("scale", study)
    assert answer.code == 3
    assert "no markers on the upper torso" in answer.err
    assert '"hand", "upper_torso"]' in answer.err
