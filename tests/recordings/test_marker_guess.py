"""Which marker set a recording uses, told from its labels."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.body.markersets import load_marker_set, shipped_names
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.marker_guess import guess_marker_set
from bsip_cli.recordings.read import read_recording

OF_REAL_FILES = {
    "biobuddy_ech/right_knee.c3d": "biobuddy_ech",
    "btk_functional_ll/FunctionalWalk.c3d": "plugin_gait",
    "btk_pig/PiG_Motion-FlatFoot-Full.c3d": "plugin_gait",
    "c3dorg_plate_types/analogfpscale04.c3d": "plugin_gait",
    "edge_btk/Gait.c3d": "helen_hayes",
    "ezc3d_rehazenter_qualisys/Qualisys.c3d": "van_sint_jan",
    "hamner_other/run200.trc": "hamner_other",
    "ktk_walk_and_serve/kinematics_tennis_serve.c3d": "plugin_gait",
    "ktk_walk_and_serve/walk.c3d": "plugin_gait",
    "motionanalysis_helenhayes/Sample_Jump2.c3d": "helen_hayes",
    "opencap_subject4/squats1.trc": "opencap_subject4",
    "opensim_walking/walking2.c3d": "hamner_other",
    "pycgm/Sample_Static.c3d": "plugin_gait",
    "return11_static/c3dfile1.c3d": "return11_static",
    "sprinter_ja1/JA1Gait35.c3d": "sprinter_ja1",
    "squat2_pig61/markers.trc": "plugin_gait",
}
OF_NO_SET = (
    "edge_nimble/JH_01.c3d",
    "edge_ezc3d/FP_Type3.c3d",
    "c3dorg_plate_types/FP1.C3D",
    "type3_running_kistler/Running_0002.c3d",
)


@pytest.mark.parametrize("prefix", ["", "Subject_01:", "A:B:"])
@pytest.mark.parametrize("name", shipped_names())
def test_each_set_is_guessed_from_its_own_labels(name, prefix):
    labels = [f"{prefix}{marker.label}" for marker in load_marker_set(name).markers]
    assert guess_marker_set(labels).name == name


@pytest.mark.parametrize("name", shipped_names())
def test_each_set_is_guessed_without_its_optional_markers_and_with_a_quarter_lost(name):
    labels = [m.label for m in load_marker_set(name).markers if not m.optional]
    kept = np.random.default_rng(0).permutation(labels)[: int(0.75 * len(labels))]
    assert guess_marker_set([*kept, "*12", "stick_1", "stick_2"]).name == name


def test_aliases_and_case_count():
    aliases = {"RASIS": "rasi", "LASIS": "Lasi", "RPSIS": "RPSI", "LPSIS": "LPSI "}
    labels = [m.label for m in load_marker_set("hansen2017").markers]
    assert guess_marker_set([aliases.get(name, name) for name in labels]).name == "hansen2017"


def test_labels_that_fit_no_set_are_refused_with_a_remedy():
    with pytest.raises(BadDataError) as caught:
        guess_marker_set(["M001", "M002", "C7"])
    assert "hansen2017" in str(caught.value)
    assert "marker_set" in caught.value.remedy
    assert "M001" in caught.value.found


def test_the_lower_half_of_a_set_is_enough():
    labels = "LASI RASI LPSI RPSI LTHI LKNE LTIB LANK LHEE LTOE RTHI RKNE RTIB RANK RHEE RTOE"
    assert guess_marker_set(labels.split()).name == "plugin_gait"
    assert guess_marker_set([*labels.split(), "LFIB", "RFIB"]).name == "plugin_gait"


@pytest.mark.real
@pytest.mark.parametrize(("name", "expected"), OF_REAL_FILES.items())
def test_sets_of_real_recordings(real_data, name, expected):
    assert guess_marker_set(read_recording(real_data / name).labels).name == expected


@pytest.mark.real
@pytest.mark.parametrize("name", OF_NO_SET)
def test_real_recordings_of_no_shipped_set(real_data, name):
    with pytest.raises(BadDataError, match="no known marker set fits"):
        guess_marker_set(read_recording(real_data / name).labels)
