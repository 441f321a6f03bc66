"""Knees and ankles found from movement, against those that markers show."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.calibration import calibrate, functional_landmarks
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.read import read_recording
from tests.body.standing_person import HEIGHT_M, standing_markers

DATA = Path(__file__).parents[2].parent / "shared" / "data"
JOINTS = ("knee_lateral", "knee_medial", "malleolus_lateral", "malleolus_medial")
NAMED = {f"{name}_{side}" for name in JOINTS for side in "lr"}


def found_in(file: str, marker_set_name: str, frame: int) -> tuple[Mapping, tuple, Mapping]:
    """What movement shows in a recording, in one of its frames; how; where all landmarks are."""
    recording, marker_set = read_recording(DATA / file), load_marker_set(marker_set_name)
    match = match_labels(recording.labels, marker_set.wanted())
    trial = {label: recording.markers_m[:, k] for label, k in match.index.items()}
    still = {label: track[frame] for label, track in trial.items()}
    known = {m.landmark: still[m.label] for m in marker_set.markers if m.label in still}
    without = {name: place for name, place in known.items() if name not in NAMED}
    return *functional_landmarks(marker_set, without, still, [trial], "M"), known


@pytest.mark.real
@pytest.mark.skipif(not DATA.is_dir(), reason="the real recordings (../shared/data) are missing")
def test_gait_shows_the_joints_that_markers_show():
    found, notes, known = found_in("ezc3d_rehazenter_qualisys/Qualisys.c3d", "van_sint_jan", 100)
    assert set(found) == NAMED
    for side in "lr":
        for joint, allowed_m in (("knee", 0.025), ("malleolus", 0.025)):
            names = [f"{joint}_{part}_{side}" for part in ("lateral", "medial")]
            own = np.mean([found[name] for name in names], axis=0)
            marked = np.mean([known[name] for name in names], axis=0)
            assert np.linalg.norm(own - marked) < allowed_m, (joint, side)
        lateral = found[f"knee_lateral_{side}"] - found[f"knee_medial_{side}"]
        marked = known[f"knee_lateral_{side}"] - known[f"knee_medial_{side}"]
        cosine = lateral @ marked / np.linalg.norm(lateral) / np.linalg.norm(marked)
        assert np.rad2deg(np.arccos(cosine)) < 15
    assert any("the left knee has no marker: centre from its movement" in n for n in notes)


def test_markers_go_before_movement():
    still = standing_markers()
    marker_set = load_marker_set("hansen2017")
    known = {m.landmark: still[m.label] for m in marker_set.markers if m.landmark}
    assert functional_landmarks(marker_set, known, still, [], "M") == ({}, ())


def test_without_clusters_or_movement_the_landmarks_stay_missing():
    still = {k: v for k, v in standing_markers().items() if k[1:4] not in ("KNE", "MAL")}
    trials = [{label: np.tile(place, (50, 1)) for label, place in still.items()}]
    skeleton, marker_set = load_skeleton("hansen2017"), load_marker_set("hansen2017")
    with pytest.raises(BadDataError, match="knee_lateral_l, knee_lateral_r, malleolus_lateral_l"):
        calibrate(skeleton, marker_set, still, "M", HEIGHT_M, trials)
