"""Labels to markers: aliases, prefixes, duplicates, two people."""

from __future__ import annotations

import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.labels import match_labels

WANTED = {"RASIS": ["RASI", "R.ASIS"], "LASIS": ["LASI"], "C7": [], "T10": [], "RCAL": ["RHEE"]}


def test_names_aliases_and_case():
    match = match_labels(["rasi", "LASIS", "C7", "x", "t10", "RHEE"], WANTED)
    assert match.index == {"RASIS": 0, "LASIS": 1, "C7": 2, "T10": 4, "RCAL": 5}
    assert match.missing == () and match.findings == () and match.share() == 1.0


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


def test_two_people_are_refused_with_the_list():
    labels = [p + m for p in ("A:", "B:") for m in ("RASI", "LASI", "C7", "T10")]
    with pytest.raises(BadDataError, match=r"'A:'.*'B:'"):
        match_labels(labels, WANTED)
