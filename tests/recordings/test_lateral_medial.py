"""Two columns of one label are the lateral and the medial marker of a joint by their places."""

import numpy as np
import pytest

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.recordings.marker_guess import told_from, with_numbers_placed, with_pairs_named

SET = load_marker_set("hansen2017")
# Y to the left: the lateral markers lie outside.
PLACES_M = {"LKNEL": 0.2, "LKNEM": 0.1, "RKNEL": -0.2, "RKNEM": -0.1, "LASIS": 0.12, "RASIS": -0.12}
NAMES = tuple(PLACES_M)


def _markers(stride_m: float = 0.0) -> np.ndarray:
    """(20, 6, 3); the legs are so far apart fore and aft."""
    markers = np.zeros((20, len(NAMES), 3))
    markers[..., 1] = list(PLACES_M.values())
    markers[:, :2, 0] = stride_m
    return markers


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5], [1, 0, 3, 2, 4, 5], [5, 1, 2, 0, 4, 3]])
@pytest.mark.parametrize("prefix", ["", "Anna:"])
@pytest.mark.parametrize("turn_deg", [0.0, 130.0])
def test_cut_labels_get_their_names_back(order, prefix, turn_deg):
    c, s = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
    markers = _markers(0.5)[:, order] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    labels, (said,) = with_pairs_named([prefix + NAMES[k][:4] for k in order], markers, SET)
    assert [label for label in labels if "KNE" in label] == [
        prefix + NAMES[k] for k in order if "KNE" in NAMES[k]
    ]
    assert said.level == "corrected" and "LKNE" in said.subject


def test_nothing_is_done_where_labels_are_whole():
    assert with_pairs_named(NAMES, _markers(), SET) == (NAMES, [])


def test_two_that_change_places_stay_as_they_are():
    markers = _markers()
    markers[::2, [0, 1]] = markers[::2, [1, 0]]
    named, _ = with_pairs_named([name[:4] for name in NAMES], markers, SET)
    assert named[:2] == ("LKNE", "LKNE") and named[2:4] == ("RKNEL", "RKNEM")


def test_without_the_trunk_nothing_tells():
    labels = [name[:4] for name in NAMES[:4]]
    assert with_pairs_named(labels, _markers()[:, :4], SET)[0] == tuple(labels)


def test_three_of_a_label_are_no_pair():
    labels = ["LKNE", "LKNE", "RKNE", "LKNE", "LASI", "RASI"]
    named, _ = with_pairs_named(labels, _markers(), SET)
    assert named.count("LKNE") == 3


def test_a_ghost_is_no_medial_marker():
    markers = _markers()
    markers[:, 1] += [0.15, 0.03, -0.06]
    named, _ = with_pairs_named([name[:4] for name in NAMES], markers, SET)
    assert named[:2] == ("LKNE", "LKNE") and named[2:4] == ("RKNEL", "RKNEM")


NUMBERED = ("LKNE1", "LKNE2", "RKNE1", "RKNE2", "LASIS", "RASIS")


def _placed(markers: np.ndarray, labels=NUMBERED) -> tuple[dict[str, str], list]:
    marker_set, said = with_numbers_placed(labels, markers, told_from(labels).marker_set)
    return {marker.label: marker.landmark for marker in marker_set.markers}, said


def test_places_tell_numbered_ones():
    outer_first, nothing = _placed(_markers())
    assert outer_first["LKNE1"] == "knee_lateral_l" and outer_first["RKNE2"] == "knee_medial_r"
    inner_first, (said,) = _placed(_markers()[:, [1, 0, 3, 2, 4, 5]])
    assert inner_first["LKNE2"] == "knee_lateral_l" and inner_first["RKNE1"] == "knee_medial_r"
    assert nothing == [] and "the outer ones for LKNE2, RKNE2" in said.action


def test_numbered_ones_that_are_no_pair_are_no_landmarks():
    markers = _markers()
    markers[:, 1] += [0.15, 0.03, -0.06]
    markers[::2, [2, 3]] = markers[::2, [3, 2]]
    found, said = _placed(markers)
    assert "LKNE1" not in found and "LKNE2" not in found
    assert found["RKNE1"] == found["RKNE2"] == ""
    assert [one.subject for one in said] == ["LKNE1, LKNE2", "RKNE1, RKNE2"]
