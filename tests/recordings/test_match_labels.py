"""Labels to markers: aliases, prefixes, duplicates, two people."""

from __future__ import annotations

from pathlib import Path

import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.marker_guess import guess_marker_set
from bsip_cli.recordings.read import read_recording

CASE = Path(__file__).parents[2].parent / "shared" / "cases" / "27-underscore-prefix"

WANTED = {"RASIS": ["RASI", "R.ASIS"], "LASIS": ["LASI"], "C7": [], "T10": [], "RCAL": ["RHEE"]}


def test_names_aliases_and_case():
    match = match_labels(["rasi", "LASIS", "C7", "x", "t10", "RHEE"], WANTED)
    assert match.index == {"RASIS": 0, "LASIS": 1, "C7": 2, "T10": 4, "RCAL": 5}
    assert match.missing == () and match.findings == ()


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


def test_separators_do_not_count():
    match = match_labels(["R.ASI", "L_ASI", "c 7", "T-10", "r.heel", "R_HEE"], WANTED)
    assert match.index == {"RASIS": 0, "LASIS": 1, "C7": 2, "T10": 3, "RCAL": 5}


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


def test_two_people_are_refused_with_the_list():
    labels = [p + m for p in ("A:", "B:") for m in ("RASI", "LASI", "C7", "T10")]
    with pytest.raises(BadDataError, match=r"'A:'.*'B:'"):
        match_labels(labels, WANTED)


def test_a_prefix_chooses_between_two_people():
    labels = [p + m for p in ("A:", "B:") for m in ("RASI", "LASI", "C7", "T10")]
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


@pytest.mark.skipif(not CASE.is_dir(), reason="the cases of users (../shared/cases) are missing")
def test_the_case_of_an_underscore():
    file = CASE / "study" / "sub-01" / "sub-01_task-static.c3d"
    guess = guess_marker_set(read_recording(file).labels)
    assert guess.is_shipped and guess.name == "hansen2017"
