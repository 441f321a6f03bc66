"""What is wrong in whose recordings, and what several people share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Light, Paragraph, Section
from bsip_cli.report.candidates import is_large
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.shared import SHARED, Cause, Searched, named_people, shared_causes
from bsip_cli.report.verdict import probability_of, probability_words
from bsip_cli.report.words import MISSING, capital, count, labelled, listing

_NOT_RUN = "Nobody's recordings were searched for errors: run `bsip diagnose`."
_NO_TRIAL = "No recording has motion with every contact on a plate"
_SOME_ARE_WRONG = (
    "The probabilities hold as far as the model of ordinary errors does. Of findings with 95 %, one "
    "in twenty is expected not to be there: among many people some are not."
)


def light(record: CohortRecord) -> Light:
    """Whether anything is wrong in anybody's recordings."""
    people = _people(record)
    asked = [p for p in people if p.was_searched]
    if not asked:
        return Light("inconclusive", "Inconclusive", f"{_NO_TRIAL}." if people else _NOT_RUN)
    wrong = [p for p in asked if p.causes]
    how_many = count(len(asked), "participant")
    if not wrong:
        return Light("fine", f"Nothing wrong above the noise in {how_many}", "")
    large = [p.id for p in wrong if any(is_large(cause) for cause in p.causes)]
    names = named_people([p.id for p in wrong])
    said = f"In {names}." + (f" Large, cause unknown: {named_people(large)}." if large else "")
    shared = " ".join(shared_causes(people)[:2])
    title = f"Something is wrong in {len(wrong)} of {how_many}"
    return Light("large" if large else "cause", title, f"{said} {shared}".rstrip())


def section(record: CohortRecord) -> Section:
    people = _people(record)
    blocks: list[Block] = [] if people else [Paragraph(_NOT_RUN, "note")]
    blocks += _unsearched(record)
    blocks += [Paragraph(text, "good") for text in _nothing_found(people)]
    reports = {m.id for m in record.members if m.has_report}
    rows = tuple(_row(one.id, cause, reports) for one in people for cause in one.causes)
    if rows:
        head = ("participant", "found", "recordings", "probability", "removes [%]")
        caption = (
            "What was found, or a group of which one is there. Probability: of the cause, or of the "
            "group. Removes: of the squared difference between measured and simulated forces, in "
            "units of its noise, in seconds left out when its size was fitted, with 95 % interval"
        )
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
            of_movements.setdefault(_movements(one), []).append(one.id)
    return [
        f"Nothing wrong above the noise was found in {named_people(names)}{movements}."
        for movements, names in of_movements.items()
    ]


def _movements(one: Searched) -> str:
    return f" (searched: {labelled(listing(list(one.trials)))})" if one.trials else ""


def _row(person: str, cause: Cause, reports: set[str]) -> tuple[str | Cell, ...]:
    tested = next((one for one in cause if np.isfinite(one.gain[0])), cause[0])
    told = [capital(one.told()) for one in cause]
    return (
        Cell(person, link=f"../{person}/report.html" if person in reports else ""),
        told[0] if len(told) == 1 else f"One of these: {'; '.join(told)}",
        labelled(listing(list(dict.fromkeys(t for one in cause for t in one.trials)))),
        probability_words(probability_of(cause)) or MISSING,
        tested.removes(),
    )
