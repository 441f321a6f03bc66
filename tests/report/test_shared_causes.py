"""What the cohort's report and the terminal say of causes that several people share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from bsip_cli.report.blocks import Bullets, Grid, Light
from bsip_cli.report.cohort import diagnosis_blocks, light_of_all
from bsip_cli.report.cohort_record import (
    CohortRecord,
    Member,
    Ratios,
    named_people,
    searched,
    shared_causes,
)
from bsip_cli.report.records import HowMade
from tests.report.fake_study import diagnosis

TRIAL = "sub-01_task-sequence_run-1"
FOUND = diagnosis([TRIAL])  # a turned plate, a group of two, one rejected
TURNED = FOUND[FOUND["verdict"] != "ambiguous"]
NOTHING = FOUND[FOUND["verdict"] == "rejected"]
FACTS = {"trials": [TRIAL]}


def turned_by(radians: float, half: float = 0.01) -> pd.DataFrame:
    """The plate of ``fake_study``, with another angle and the half of its interval."""
    yaw = TURNED["parameter"] == "yaw"
    new = {"estimate": radians, "ci_low": radians - half, "ci_high": radians + half}
    table = TURNED.copy()
    for column, value in new.items():
        table.loc[yaw, column] = value
    return table


def shared(**tables: pd.DataFrame) -> tuple[str, ...]:
    return shared_causes([searched(name, table, FACTS) for name, table in tables.items()])


@pytest.mark.parametrize(
    ("eve", "sizes"),
    [
        (turned_by(0.04), "2.0 to 2.3°, equal within their intervals."),
        (turned_by(0.07), "2.0 to 4.0°; the sizes differ by more than their intervals."),
        (turned_by(0.07, np.nan), "2.0 to 4.0°."),  # without an interval they are not compared
    ],
)
def test_a_cause_of_two_people_is_told_with_their_sizes(eve, sizes):
    (said,) = shared(ann=turned_by(0.035), bob=NOTHING, eve=eve)
    where = "Force plate turned or tilted: plate 1: in 2 of 3 participants (ann and eve)"
    assert said == f"{where}, {sizes}"


def test_many_sizes_that_chance_spreads_may_be_the_same():
    """Thirty intervals at 95 % seldom have a value in common."""
    angles = norm.ppf((np.arange(30) + 0.5) / 30, 0.035, 0.01 / 1.96)
    people = {f"p{k}": turned_by(angle) for k, angle in enumerate(angles)}
    (said,) = shared(**people)
    assert angles.max() - angles.min() > 0.02  # so no value lies in all intervals
    assert said.endswith(", equal within their intervals.")


def test_what_one_person_has_or_the_laboratory_tells_of_itself_is_not_shared():
    assert shared(ann=TURNED, bob=NOTHING) == ()
    known = TURNED.assign(persons=2)
    assert shared(ann=known, eve=known) == ()
    blocks = diagnosis_blocks(cohort(ann=TURNED, eve=TURNED))
    (said,) = (block for block in blocks if isinstance(block, Bullets))
    assert len(said.items) == 1


def test_twice_in_one_person_is_not_shared_but_counts_among_the_sizes():
    again = turned_by(0.07).assign(rank=TURNED["rank"] + 10)
    assert shared(ann=pd.concat([TURNED, again]), bob=NOTHING) == ()
    (said,) = shared(ann=pd.concat([TURNED, again]), bob=turned_by(0.035))
    assert "2.0 to 4.0°" in said


def test_only_those_count_of_whom_such_a_recording_was_searched():
    elsewhere = {"trials": ["sub-02_task-squat"]}
    people = [searched(name, TURNED, FACTS) for name in ("ann", "eve")]
    (said,) = shared_causes([*people, searched("bob", NOTHING, elsewhere)])
    assert "in 2 of 2 participants" in said
    standing = TURNED.assign(trials="sub-01_task-static")  # which is weighed, not searched
    people = [searched(name, standing, FACTS) for name in ("ann", "eve")]
    (said,) = shared_causes([*people, searched("bob", NOTHING, elsewhere)])
    assert "in 2 of 3 participants" in said


def test_a_member_of_a_group_counts_and_is_told_as_one():
    offset = FOUND["effect"] == "plate_zero"
    named = FOUND[offset].assign(verdict="named", class_id="")
    first, *others = shared(ann=FOUND, bob=FOUND, eve=named, tom=FOUND)
    assert "in 4 of 4 participants" in first and "(ann" not in first
    assert first.endswith("; one of several that look alike in ann, bob and tom.")
    assert "possibly in 3 of 4 participants" in others[-1]
    assert others[-1].endswith("; one of several that look alike in all of them.")


def test_what_is_named_once_is_in_no_group_of_the_same_person():
    named = FOUND[FOUND["effect"] == "plate_zero"].assign(verdict="named", class_id="", rank=9)
    first, *_ = shared(ann=pd.concat([FOUND, named]), eve=named)
    assert "look alike" not in first


def test_more_than_a_list_holds_is_counted():
    plates = range(1, 11)
    many = pd.concat([TURNED.assign(target=str(k), rank=TURNED["rank"] + 9 * k) for k in plates])
    *said, last = shared(ann=many, eve=many)
    assert len(said) == 8
    assert last.startswith("And 2 more")


def test_many_people_are_counted():
    names = [f"sub-{k:02d}" for k in range(15)]
    assert named_people(names).endswith("sub-11 and 3 more")
    assert named_people(names[:2]) == "sub-00 and sub-01"


# --- the section --------------------------------------------------------------------------------


def cohort(**tables: pd.DataFrame | None) -> CohortRecord:
    found = {n: None if t is None else searched(n, t, FACTS) for n, t in tables.items()}
    members = tuple(Member(name, {}, {}, True, (), one) for name, one in found.items())
    return CohortRecord(members, Ratios({}, held_out=False), (), (), (), HowMade(), {})


def text_of(record: CohortRecord) -> str:
    return " ".join(getattr(b, "text", "") for b in diagnosis_blocks(record))


def test_the_section_lists_causes_and_names_those_without():
    record = cohort(ann=FOUND, bob=NOTHING, eve=None, tom=TURNED.iloc[:0])
    text = text_of(record)
    assert "No fault was found in bob (searched: sequence (run 1))." in text
    assert "Not searched for errors: eve." in text
    assert "No recording has motion with every contact on a plate: tom." in text
    (grid,) = (b for b in diagnosis_blocks(record) if isinstance(b, Grid))
    first, group = grid.cells()
    assert (first[0].text, first[0].link) == ("ann", "../ann/report.html")
    assert first[1].text.startswith("Plate 1 is turned by +2.0 degrees")
    assert first[3].text == "99.5 %"
    assert group[1].text.startswith("One of these: ")
    assert group[3].text == "96.0 %"


@pytest.mark.parametrize(
    ("states", "said"),
    [
        (
            ["cause", "large", "cause"],
            "large: 3 participants: 1 with a large error; 2 with something found but no large "
            "error. Large error: eve. Force plate turned or tilted: plate 1: in 3 of 3",
        ),
        (
            ["fine", "cause", "fine"],
            "cause: 3 participants: 1 with something found but no large error; 2 fine.",
        ),
        (["fine"], "fine: 1 participant: 1 fine."),
        (["fine", "inconclusive"], "inconclusive: 2 participants: 1 inconclusive; 1 fine."),
        ([None], "inconclusive: Not known. Nobody's report was made"),
        ([None, "fine"], "fine: 1 participant with a report: 1 fine."),
    ],
)
def test_the_light_of_all_is_that_of_their_own(states, said):
    record = cohort(**dict.fromkeys(["ann", "eve", "bob"][: len(states)], TURNED))
    lights = [state and Light(state, "", "") for state in states]
    pairs = zip(record.members, lights, strict=True)
    members = tuple(replace(member, light=one) for member, one in pairs)
    light = light_of_all(replace(record, members=members))
    assert f"{light.state}: {light.title}. {light.text}".startswith(said)


def test_the_light_of_all_where_nobody_was_searched():
    assert "run `bsip diagnose`" in light_of_all(cohort(bob=None)).text


def test_what_a_probability_means_is_said_where_something_was_found():
    assert "one in twenty is expected not to be there" in text_of(cohort(ann=TURNED))
    assert "one in twenty" not in text_of(cohort(bob=NOTHING, eve=NOTHING))


def test_a_person_without_report_has_no_link():
    record = cohort(ann=TURNED)
    record = replace(record, members=(replace(record.members[0], has_report=False),))
    (grid,) = (b for b in diagnosis_blocks(record) if isinstance(b, Grid))
    assert not grid.cells()[0][0].link
