"""What the cohort's report and the terminal say of causes that several people share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fake_study import diagnosis

from bsip_cli.report.blocks import Bullets, Grid
from bsip_cli.report.cohort import diagnoses
from bsip_cli.report.cohort.ratios import Ratios
from bsip_cli.report.cohort.record import CohortRecord, Member
from bsip_cli.report.origins import HowMade
from bsip_cli.report.shared import named_people, person_of, shared_causes

FOUND = diagnosis(["sub-01_task-sequence_run-1"])  # a turned plate, a class of two, one rejected
TURNED = FOUND[FOUND["verdict"] != "ambiguous"]
NOTHING = FOUND[FOUND["verdict"] == "rejected"]


def turned_by(radians: float, half: float = 0.01) -> pd.DataFrame:
    """The plate of ``fake_study``, with another angle and the half of its interval."""
    yaw = TURNED["parameter"] == "yaw"
    new = {"estimate": radians, "ci_low": radians - half, "ci_high": radians + half}
    table = TURNED.copy()
    for column, value in new.items():
        table.loc[yaw, column] = value
    return table


def shared(**tables: pd.DataFrame) -> tuple[str, ...]:
    return shared_causes([person_of(name, table) for name, table in tables.items()])


def test_a_cause_of_two_people_is_told_with_their_sizes():
    (said,) = shared(ann=turned_by(0.035), bob=NOTHING, eve=turned_by(0.04))
    assert said == (
        "Force plate turned or tilted: plate 1: in 2 of 3 participants (ann and eve), +2.01 to "
        "+2.29°; the sizes agree."
    )


def test_sizes_whose_intervals_lie_apart_differ():
    (said,) = shared(ann=turned_by(0.035), eve=turned_by(0.07))
    assert said.endswith("the sizes differ by more than their intervals.")


def test_sizes_without_intervals_are_not_compared():
    (said,) = shared(ann=turned_by(0.035), eve=turned_by(0.07, np.nan))
    assert said.endswith("+4.0°.")


def test_what_one_person_has_is_not_shared():
    assert shared(ann=TURNED, bob=NOTHING) == ()


def test_twice_in_one_person_is_not_shared():
    again = TURNED.assign(rank=TURNED["rank"] + 10)
    assert shared(ann=pd.concat([TURNED, again]), bob=NOTHING) == ()


def test_a_rival_counts_and_is_told_as_one():
    offset = FOUND["effect"] == "plate_zero"
    named = FOUND[offset].assign(verdict="named", class_id="")
    first, *others = shared(ann=FOUND, bob=FOUND, eve=named, tom=FOUND.assign(class_id="X"))
    assert "in 4 of 4 participants (ann, bob, eve and tom)" in first
    assert first.endswith("; one of several that look alike in ann, bob and tom.")
    assert others[-1].endswith("; one of several that look alike in all of them.")


def test_many_people_are_counted():
    names = [f"sub-{k:02d}" for k in range(15)]
    assert named_people(names).endswith("sub-11 and 3 more")
    assert named_people(names[:2]) == "sub-00 and sub-01"


# --- the section --------------------------------------------------------------------------------


def cohort(**tables: pd.DataFrame | None) -> CohortRecord:
    members = tuple(Member(name, {}, {}, True, (), table) for name, table in tables.items())
    return CohortRecord(members, Ratios({}, held_out=False), {}, (), (), (), HowMade(), ())


def text_of(record: CohortRecord) -> str:
    return " ".join(getattr(b, "text", "") for b in diagnoses.section(record).blocks)


def test_the_section_lists_causes_and_names_those_without():
    record = cohort(ann=FOUND, bob=NOTHING, eve=None, tom=TURNED.iloc[:0])
    text = text_of(record)
    assert "Nothing is wrong above the noise in bob." in text
    assert "Not searched for errors: eve." in text
    assert "No recording was long enough on the plates to look for errors: tom." in text
    (grid,) = (b for b in diagnoses.section(record).blocks if isinstance(b, Grid))
    first, rivals = grid.cells()
    assert (first[0].text, first[0].link) == ("ann", "../ann/report.html")
    assert first[1].text.startswith("Plate 1 is turned by +2.0 degrees")
    assert rivals[1].text.startswith("One of these: ")


def test_what_is_shared_stands_in_the_section():
    blocks = diagnoses.section(cohort(ann=TURNED, eve=TURNED)).blocks
    (said,) = (b for b in blocks if isinstance(b, Bullets))
    assert len(said.items) == 1


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"ann": TURNED, "bob": NOTHING}, "Something is wrong in 1 of 2 participants: ann."),
        ({"bob": NOTHING}, "Nothing is wrong above the noise, in 1 participant."),
        ({"bob": None}, "Nobody's recordings were searched for errors"),
        ({"bob": TURNED.iloc[:0]}, "No recording was long enough"),
    ],
)
def test_the_verdict_of_all(tables, said):
    assert diagnoses.verdict(cohort(**tables)).text.startswith(said)


def test_a_person_without_report_has_no_link():
    record = cohort(ann=TURNED)
    record = replace(record, members=(replace(record.members[0], has_report=False),))
    (grid,) = (b for b in diagnoses.section(record).blocks if isinstance(b, Grid))
    assert not grid.cells()[0][0].link
