"""Labels to markers: aliases, prefixes, cut and doubled labels, two people, pairs of a joint."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.marker_guess import (
    guess_marker_set,
    told_from,
    with_numbers_placed,
    with_pairs_named,
)
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import write_c3d

WANTED = {"RASIS": ["RASI", "R.ASIS"], "LASIS": ["LASI"], "C7": [], "T10": [], "RCAL": ["RHEE"]}


def test_exact_case_goes_first():
    match = match_labels(["c7", "C7"], {"C7": [], "NECK": ["c7"]})
    assert match.index == {"C7": 1, "NECK": 0}


def test_prefix_is_stripped_and_things_are_ignored():
    labels = ["P1:RASI", "P1:LASI", "P1:C7", "Bar:BL", "*12", "", "P1:T10"]
    match = match_labels(labels, WANTED)
    assert match.prefix == "P1:"
    assert match.index == {"RASIS": 0, "LASIS": 1, "C7": 2, "T10": 6}
    assert match.missing == ("RCAL",)


def test_duplicates_match_nothing_and_are_said():
    match = match_labels(["RASI", "RASI", "LASI", "C7"], WANTED)
    assert "RASIS" in match.missing
    assert any("share" in finding.found for finding in match.findings)


@pytest.mark.parametrize(
    "labels",
    [
        ["rasi", "LASIS", "C7", "x", "t10", "RHEE"],
        ["R.ASI", "L_ASI", "c 7", "", "T-10", "r.heel", "R_HEE"],
    ],
)
def test_names_and_aliases_in_any_case_with_any_separator(labels):
    match = match_labels(labels, WANTED)
    assert match.index == {"RASIS": 0, "LASIS": 1, "C7": 2, "T10": 4, "RCAL": len(labels) - 1}
    assert match.missing == () and match.findings == ()


def test_spellings_that_fall_together_match_nothing():
    match = match_labels(["R.ASI", "R_ASI", "LASI"], {"RASIS": ["RASI"], "LASIS": ["LASI"]})
    assert match.index == {"LASIS": 2}


def test_labels_cut_to_four_characters():
    wanted = {"FHEAD": [], "RKNEL": [], "RKNEM": [], "LHAND": []}
    match = match_labels(["FHEA", "RKNE", "LHAN", "a longer label"], wanted)
    assert match.index == {"FHEAD": 0, "LHAND": 2}  # RKNE may be either
    whole = match_labels(["FHEA", "LHAN", "a longer label", "another"], wanted)
    assert whole.index == {}


def test_empty_points_are_not_there_and_are_said():
    labels = ["RASI", "LASI", "C7", "T10", "RHEE", "RHEE"]
    match = match_labels(labels, WANTED, seen=[True, True, False, True, False, True])
    assert match.index == {"RASIS": 0, "LASIS": 1, "T10": 3, "RCAL": 5}
    assert [(f.subject, f.found) for f in match.findings] == [
        ("C7", "labelled, but seen in no frame"),
        ("C7", "1 of 5 markers not in the file"),
    ]


def test_nobody_misses_optional_markers():
    match = match_labels(["RASI", "LASI", "T10"], WANTED, optional=("C7", "RCAL"))
    assert match.missing == ("C7", "RCAL") and match.findings == ()


def test_many_shared_labels_are_refused_with_what_to_do():
    with pytest.raises(BadDataError, match=r"3 of 5 markers .* RASIS, LASIS, C7") as caught:
        match_labels(["RASI", "LASI", "C7", "T10", "RASI", "LASI", "C7"], WANTED)
    assert "DESCRIPTIONS" in caught.value.remedy and "prefixes" in caught.value.remedy


def test_two_people_are_refused_with_the_list_unless_a_prefix_chooses():
    labels = [p + m for p in ("A:", "B:") for m in ("RASI", "LASI", "C7", "T10")]
    with pytest.raises(BadDataError, match=r"'A:'.*'B:'"):
        match_labels(labels, WANTED)
    for wish in ("B:", "B"):
        match = match_labels(labels, WANTED, prefix=wish)
        assert match.prefix == "B:"
        assert match.index == {"RASIS": 4, "LASIS": 5, "C7": 6, "T10": 7}
    with pytest.raises(BadDataError, match=r"'Carl'.*A:, B:"):
        match_labels(labels, WANTED, prefix="Carl")


BODY = {
    name: []
    for name in ["RASI", "LASI", "RKNE", "LKNE", "RANK", "LANK", "RHEE", "LHEE", "C7", "T10"]
}


@pytest.mark.parametrize("affix", ["S01_{}", "S01 {}", "Mr.X.{}", "p-{}", "{}_1", "{}-Raw", "X{}"])
def test_what_all_labels_begin_or_end_with_is_taken_off(affix):
    match = match_labels([affix.format(name) for name in BODY], BODY)
    assert list(match.index) == list(BODY) and match.missing == ()
    assert match.prefix == affix.format("")


def test_two_people_without_a_colon():
    labels = [f"{person}_{name}" for name in BODY for person in "AB"]
    with pytest.raises(BadDataError, match=r"2 people in one file: 'A_' .10 markers., 'B_' .10"):
        match_labels(labels, BODY)
    assert match_labels(labels, BODY, prefix="B").index["LASI"] == labels.index("B_LASI")


def test_of_two_versions_of_a_person_one_is_taken_and_said():
    labels = [*BODY, *(f"{name}_filtered" for name in BODY)]
    assert list(match_labels(labels, BODY).index.values()) == list(range(len(BODY)))
    labels = [*(f"{name}_study" for name in BODY), "rank", "lank", "rhee", "lhee", "r_kne"]
    match = match_labels(labels, BODY)
    assert list(match.index.values()) == list(range(len(BODY))) and match.prefix == "_study"
    assert any("are there twice" in finding.found for finding in match.findings)


def test_a_set_with_the_affix_in_its_own_labels_keeps_it():
    wanted = {f"A_{name}": [] for name in BODY}
    assert match_labels(list(wanted), wanted).prefix == ""


def test_the_case_of_an_underscore(shared_cases):
    file = shared_cases / "27-underscore-prefix/study/sub-01/sub-01_task-static.c3d"
    guess = guess_marker_set(read_recording(file).labels)
    assert guess.is_shipped and guess.name == "hansen2017"


HANSEN = load_marker_set("hansen2017")
LABELS = [marker.label for marker in HANSEN.markers]


@pytest.mark.parametrize("has_descriptions", [True, False])
def test_cut_labels_lose_only_what_is_doubled_and_not_described(tmp_path, has_descriptions):
    """Columns are told by their positions."""
    cut = [label[:4] for label in LABELS]
    assert len(set(cut)) == 34
    places = np.tile(0.1 * (1.0 + np.arange(len(cut)))[:, None], (5, 1, 3))
    parameters = {"DESCRIPTIONS": LABELS} if has_descriptions else None
    path = write_c3d(tmp_path / "a.c3d", places, cut, point_parameters=parameters)
    recording = read_recording(path)
    assert guess_marker_set(recording.labels).name == "hansen2017"
    match = match_labels(recording.labels, HANSEN.wanted(), optional=HANSEN.optional())
    doubled = {f"{side}{joint}" for side in "LR" for joint in ("KNEL", "KNEM", "MALL", "MALM")}
    assert set(match.missing) == (set() if has_descriptions else doubled)
    columns = recording.markers_m[0, list(match.index.values()), 0]
    own = [0.1 * (1.0 + LABELS.index(label)) for label in match.index]
    np.testing.assert_allclose(columns, own, atol=1e-6)
    shared = [set(f.subject.split(", ")) for f in match.findings if "several columns" in f.found]
    assert shared == ([] if has_descriptions else [doubled])


# Y to the left: the lateral markers lie outside.
ACROSS_M = {"LKNEL": 0.2, "LKNEM": 0.1, "RKNEL": -0.2, "RKNEM": -0.1, "LASIS": 0.12, "RASIS": -0.12}
PAIRED = tuple(ACROSS_M)


def _standing(stride_m: float = 0.0) -> np.ndarray:
    """(20, 6, 3); the legs are so far apart fore and aft."""
    markers = np.zeros((20, len(PAIRED), 3))
    markers[..., 1] = list(ACROSS_M.values())
    markers[:, :2, 0] = stride_m
    return markers


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5], [1, 0, 3, 2, 4, 5], [5, 1, 2, 0, 4, 3]])
@pytest.mark.parametrize("prefix", ["", "Anna:"])
@pytest.mark.parametrize("turn_deg", [0.0, 130.0])
def test_cut_labels_get_their_names_back(order, prefix, turn_deg):
    turn = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    markers = _standing(0.5)[:, order] @ turn.T
    labels, (said,) = with_pairs_named([prefix + PAIRED[k][:4] for k in order], markers, HANSEN)
    assert [label for label in labels if "KNE" in label] == [
        prefix + PAIRED[k] for k in order if "KNE" in PAIRED[k]
    ]
    assert said.level == "corrected" and "LKNE" in said.subject


def test_nothing_is_done_where_labels_are_whole():
    assert with_pairs_named(PAIRED, _standing(), HANSEN) == (PAIRED, [])


def test_two_that_change_places_stay_as_they_are():
    markers = _standing()
    markers[::2, [0, 1]] = markers[::2, [1, 0]]
    named, _ = with_pairs_named([name[:4] for name in PAIRED], markers, HANSEN)
    assert named[:2] == ("LKNE", "LKNE") and named[2:4] == ("RKNEL", "RKNEM")


def test_without_the_trunk_nothing_tells():
    labels = [name[:4] for name in PAIRED[:4]]
    assert with_pairs_named(labels, _standing()[:, :4], HANSEN)[0] == tuple(labels)


def test_three_of_a_label_are_no_pair():
    labels = ["LKNE", "LKNE", "RKNE", "LKNE", "LASI", "RASI"]
    named, _ = with_pairs_named(labels, _standing(), HANSEN)
    assert named.count("LKNE") == 3


def test_a_ghost_is_no_medial_marker():
    markers = _standing()
    markers[:, 1] += [0.15, 0.03, -0.06]
    named, _ = with_pairs_named([name[:4] for name in PAIRED], markers, HANSEN)
    assert named[:2] == ("LKNE", "LKNE") and named[2:4] == ("RKNEL", "RKNEM")


NUMBERED = ("LKNE1", "LKNE2", "RKNE1", "RKNE2", "LASIS", "RASIS")


def _placed(markers: np.ndarray) -> tuple[dict[str, str], list]:
    marker_set, said = with_numbers_placed(NUMBERED, markers, told_from(NUMBERED).marker_set)
    return {marker.label: marker.landmark for marker in marker_set.markers}, said


def test_places_tell_numbered_ones():
    outer_first, nothing = _placed(_standing())
    assert outer_first["LKNE1"] == "knee_lateral_l" and outer_first["RKNE2"] == "knee_medial_r"
    inner_first, (said,) = _placed(_standing()[:, [1, 0, 3, 2, 4, 5]])
    assert inner_first["LKNE2"] == "knee_lateral_l" and inner_first["RKNE1"] == "knee_medial_r"
    assert nothing == [] and "the outer ones for LKNE2, RKNE2" in said.action


def test_numbered_ones_that_are_no_pair_are_no_landmarks():
    markers = _standing()
    markers[:, 1] += [0.15, 0.03, -0.06]
    markers[::2, [2, 3]] = markers[::2, [3, 2]]
    found, said = _placed(markers)
    assert "LKNE1" not in found and "LKNE2" not in found
    assert found["RKNE1"] == found["RKNE2"] == ""
    assert [one.subject for one in said] == ["LKNE1, LKNE2", "RKNE1, RKNE2"]
