"""Section 3: what is wrong in whose recordings, and what several people share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Paragraph, Section
from bsip_cli.report.candidates import Candidate
from bsip_cli.report.cohort.record import CohortRecord, Member
from bsip_cli.report.shared import SHARED, Person, named_people, person_of, shared_causes
from bsip_cli.report.words import capital, count, number

_NOT_RUN = "Nobody's recordings were searched for errors: run `bsip diagnose`."
_TOO_SHORT = "No recording was long enough on the plates to look for errors"
_BY_CHANCE = (
    "Where nothing is wrong, chance raises an alarm in about one participant of twenty: what one of "
    "many shows, slightly, may be none."
)


def people_of(members: Sequence[Member]) -> tuple[Person, ...]:
    """Those whom the diagnosis has searched."""
    return tuple(person_of(m.id, m.diagnosis) for m in members if m.diagnosis is not None)


def verdict(record: CohortRecord) -> Paragraph:
    """One paragraph on whether anything is wrong."""
    people = people_of(record.members)
    looked_at = [p for p in people if p.was_looked_at]
    if not looked_at:
        return Paragraph(f"{_TOO_SHORT}." if people else _NOT_RUN, "note")
    wrong = [p.id for p in looked_at if p.causes]
    asked = count(len(looked_at), "participant")
    if not wrong:
        return Paragraph(f"Nothing is wrong above the noise, in {asked}.", "good")
    return Paragraph(
        f"Something is wrong in {len(wrong)} of {asked}: {named_people(wrong)}. Section 3 says what.",
        "warning",
    )


def section(record: CohortRecord) -> Section:
    people = people_of(record.members)
    blocks: list[Block] = [verdict(record)] if not people else []
    blocks += _unsearched(record.members, people)
    right = [p.id for p in people if p.was_looked_at and not p.causes]
    if right:
        blocks.append(
            Paragraph(f"Nothing is wrong above the noise in {named_people(right)}.", "good")
        )
    reports = {m.id for m in record.members if m.has_report}
    rows = tuple(_row(one.id, cause, reports) for one in people for cause in one.causes)
    if rows:
        head = ("participant", "found", "recordings", "removes [%]")
        caption = (
            "What was found; rivals look alike in these recordings. Removes: of the squared "
            "difference in unseen seconds, with 95 % interval. The participants' reports say more"
        )
        blocks.append(Grid(head, rows, caption, words=3))
    if shared := shared_causes(people):
        blocks += [Paragraph(SHARED), Bullets(shared, "warning")]
    if len(people) > 1:
        blocks.append(Paragraph(_BY_CHANCE, "note"))
    return Section("diagnoses", "What is wrong in the recordings", tuple(blocks))


def _unsearched(members: Sequence[Member], people: Sequence[Person]) -> list[Block]:
    """Those of whom nothing can be said."""
    known = {p.id for p in people}
    missing = [m.id for m in members if m.facts is not None and m.id not in known]
    said: list[Block] = []
    if missing and people:
        said.append(Paragraph(f"Not searched for errors: {named_people(missing)}.", "note"))
    short = [p.id for p in people if not p.was_looked_at]
    if short:
        said.append(Paragraph(f"{_TOO_SHORT}: {named_people(short)}.", "note"))
    return said


def _row(person: str, cause: Sequence[Candidate], reports: set[str]) -> tuple[str | Cell, ...]:
    first = cause[0]
    told = [capital(rival.told()) for rival in cause]
    gain, low, high = first.gain
    return (
        Cell(person, link=f"../{person}/report.html" if person in reports else ""),
        told[0] if len(told) == 1 else f"One of these: {'; '.join(told)}",
        first.where(),
        f"{number(gain)} ({number(low)} to {number(high)})" if np.isfinite(gain) else "not tested",
    )
