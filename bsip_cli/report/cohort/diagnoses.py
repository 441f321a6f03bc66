"""What is wrong in whose recordings, and what several people share."""

from __future__ import annotations

from collections.abc import Sequence

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Light, Paragraph, Section, State
from bsip_cli.report.cohort.record import (
    SHARED,
    Cause,
    CohortRecord,
    Member,
    Searched,
    named_people,
    shared_causes,
)
from bsip_cli.report.verdict import probability_of, probability_words
from bsip_cli.report.words import MISSING, capital, count, labelled, listing

_NOT_RUN = "Nobody's recordings were searched for errors: run `bsip diagnose`."
_NO_TRIAL = "No recording has motion with every contact on a plate"
_STATES: dict[State, str] = {  # the worst first
    "large": "with a large error",
    "cause": "with something found but no large error",
    "inconclusive": "inconclusive",
    "fine": "fine",
}
_SOME_ARE_WRONG = (
    "The probabilities hold as far as the model of ordinary errors does. Of findings with 95 %, one "
    "in twenty is expected not to be there: among many people some are not."
)


def light(record: CohortRecord) -> Light:
    """How many of the persons' own lights are red, amber, without an answer, and fine; the worst
    gives the colour."""
    people = _people(record)
    of_state: dict[State, list[Member]] = {state: [] for state in _STATES}
    for member in record.members:
        if member.light is not None:
            of_state[member.light.state].append(member)
    there = [state for state, members in of_state.items() if members]
    if not people:
        return Light("inconclusive", "Not examined", _NOT_RUN)
    if not there:
        return Light("inconclusive", "Not known", "Nobody's report was made: run `bsip report`.")
    known = sum(map(len, of_state.values()))
    how_many = count(known, "participant")
    if known < len(people):
        how_many += " with a report"
    title = f"{how_many}: {'; '.join(f'{len(of_state[s])} {_STATES[s]}' for s in there)}"
    large = of_state["large"]
    said = [f"Large error: {named_people([m.id for m in large])}."] if large else []
    return Light(there[0], title, " ".join((*said, *shared_causes(people)[:2])))


def section(record: CohortRecord) -> Section:
    people = _people(record)
    blocks: list[Block] = [] if people else [Paragraph(_NOT_RUN, "note")]
    blocks += _unsearched(record)
    blocks += [Paragraph(text, "good") for text in _nothing_found(people)]
    reports = {m.id for m in record.members if m.has_report}
    rows = tuple(_row(one.id, cause, reports) for one in people for cause in one.causes)
    if rows:
        head = ("participant", "found", "recordings", "probability")
        caption = "Probability: that the cause, or one of the group, is there"
        blocks.append(Grid(head, rows, caption, words=3))
    if shared := shared_causes(people):
        blocks += [Paragraph(SHARED), Bullets(shared, "warning")]
    if rows:
        blocks.append(Paragraph(_SOME_ARE_WRONG, "note"))
    return Section("diagnoses", "What is wrong in the recordings", tuple(blocks))


def _people(record: CohortRecord) -> tuple[Searched, ...]:
    return tuple(m.searched for m in record.members if m.searched is not None)


def _unsearched(record: CohortRecord) -> list[Block]:
    """Those of whom nothing can be said."""
    people = _people(record)
    missing = [m.id for m in record.members if m.facts is not None and m.searched is None]
    said: list[Block] = []
    if missing and people:
        said.append(Paragraph(f"Not searched for errors: {named_people(missing)}.", "note"))
    without = [p.id for p in people if not p.was_searched]
    if without:
        said.append(Paragraph(f"{_NO_TRIAL}: {named_people(without)}.", "note"))
    return said


def _nothing_found(people: Sequence[Searched]) -> list[str]:
    """Those of the same movements together."""
    of_movements: dict[str, list[str]] = {}
    for one in people:
        if one.was_searched and not one.causes:
            movements = labelled(listing(list(one.trials)))
            told = f" (searched: {movements})" if one.trials else ""
            of_movements.setdefault(told, []).append(one.id)
    return [
        f"No fault was found in {named_people(names)}{movements}."
        for movements, names in of_movements.items()
    ]


def _row(person: str, cause: Cause, reports: set[str]) -> tuple[str | Cell, ...]:
    told = [capital(one.told()) for one in cause]
    return (
        Cell(person, link=f"../{person}/report.html" if person in reports else ""),
        told[0] if len(told) == 1 else f"One of these: {'; '.join(told)}",
        labelled(listing(list(dict.fromkeys(t for one in cause for t in one.trials)))),
        probability_words(probability_of(cause)) or MISSING,
    )
