"""The report of the cohort: a first page, and folded sections; here all but the laboratory's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import compress
from pathlib import PurePosixPath

import numpy as np
import pandas as pd

from bsip_cli.report import errors
from bsip_cli.report.blocks import (
    WORDS,
    Block,
    Bullets,
    Cell,
    Document,
    Grid,
    Heading,
    Light,
    Links,
    Paragraph,
    Section,
    State,
    Terms,
    first_of,
    picture,
)
from bsip_cli.report.cohort import laboratory
from bsip_cli.report.cohort.record import (
    SHARED,
    Cause,
    CohortRecord,
    Member,
    Searched,
    named_people,
    shared_causes,
)
from bsip_cli.report.figures.charts import Strip, gain_dots, strips
from bsip_cli.report.records import how_made
from bsip_cli.report.tables.build import BUILDERS, IN_PRINT
from bsip_cli.report.tables.model import Table
from bsip_cli.report.verdict import probability_of, probability_words
from bsip_cli.report.words import (
    MISSING,
    TEXTS,
    abbreviations,
    capital,
    component_label,
    count,
    listing,
    number,
    percent,
    signed,
    significant,
    task_of,
    trial_label,
)
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN

_KEPT = ("n", "p")  # columns of the tables, next to means
_MOST = 6  # sentences of a kind on the first page
_FAR = 3.0
"""Robust standard deviations (median absolute deviation times 1.4826) beyond the median: Leys 2013,
J Exp Soc Psychol 49, 764."""
_FEWEST = 5  # persons among whom one can lie far out
_GAIN = "Do identified parameters follow the forces better?"


def cohort_document(record: CohortRecord) -> Document:
    """The page of a whole study."""
    return Document(
        title="Cohort (all participants): do motion and measured forces agree?",
        subtitle="Ground forces measured by plates, against those computed from markers.",
        front=tuple(_front(record)),
        sections=(
            Section("people", "Who took part?", (_people(record),)),
            diagnoses_section(record),
            laboratory.section(record),
            Section("gain", _GAIN, tuple(_gain(record))),
            Section("tables", "The papers' tables", tuple(_tables(record))),
            Section("made", "How was it made?", tuple(how_made(record.made, record.defaults))),
            WORDS,
        ),
    )


# --- first page ---------------------------------------------------------------------------------


def _front(record: CohortRecord) -> Iterator[Block]:
    done = [m for m in record.members if m.facts is not None and m.identification is not None]
    everyone = count(len(record.members), "participant")
    uses = [m.use for m in record.members if m.use]
    used = listing([f"{name} for {uses.count(name)}" for name in dict.fromkeys(uses)], "not known")
    software = ", ".join(sorted(record.made.versions.get("bsip", ())))
    people = ("Participants", f"{len(done)} of {everyone} have identified parameters")
    use = ("Parameters", f"use {used} (OM: identified; RM: table; RM+mass: scaled table)")
    yield Terms((people, use, ("Software", f"bsip {software}")))
    yield light_of_all(record)
    yield Heading("How large are the errors?")
    yield from _strips(record)
    yield Heading("The laboratory")
    yield from laboratory.first(record)
    missing = _missing(record)
    yield Heading("Who could not be used, and why")
    nobody = (Paragraph("Nobody is missing."),)
    where = "the participants' reports"
    yield from first_of(missing, _MOST, where, "warning") if missing else nobody


def _yardsticks(record: CohortRecord) -> tuple[errors.Yardstick, ...]:
    diagnosis = record.defaults["diagnosis"]
    limits = (
        record.made.number(f"diagnosis.{name}", float(diagnosis[name]))
        for name in (errors.COP_LIMIT_M, errors.FORCE_LIMIT_PERCENT)
    )
    return errors.yardsticks(*limits)


def _strips(record: CohortRecord) -> Iterator[Block]:
    members = record.members
    rows = {"participant": [member.id for member in members]}
    drawn, far_out = [], []
    for one in _yardsticks(record):
        values = np.array([member.yardstick(one.name) for member in members], dtype=float)
        far = is_far(values, one.good, one.limit)
        title = f"{one.title} [{one.unit}]".replace("Centre of pressure (COP)", "COP")
        names = tuple(member.id for member in members)
        end = errors.ENDS_AT * one.limit
        drawn.append(Strip(title, values, names, far, one.good, one.limit, end))
        rows[one.name] = list(values)
        what = one.in_sentence().replace(" (COP)", "")
        for member, v in compress(zip(members, values, strict=True), far):
            far_out.append((f"{member.id} ({what} {number(v)} {one.unit})", member))
    if not any(np.isfinite(strip.values).any() for strip in drawn):
        yield Paragraph("No errors are known.", "warning")
        return
    yield picture("yardsticks", strips(drawn), pd.DataFrame(rows))
    linked = tuple((words, member.link()) for words, member in far_out if member.link())
    if linked:
        yield Links("Far from the others, or large:", linked[: 2 * _MOST])
    elif far_out:
        yield Paragraph(f"Far from the others, or large: {listing([w for w, _ in far_out])}.")
    else:
        yield Paragraph("Nobody lies far from the others, and no error is large.")


def is_far(values: np.ndarray, good: float, limit: float) -> np.ndarray:
    """(p,) of values that are large, or not good and far above the others."""
    known = values[np.isfinite(values)]
    beyond = np.inf
    if len(known) >= _FEWEST:
        middle = float(np.median(known))
        beyond = middle + _FAR * 1.4826 * float(np.median(np.abs(known - middle)))
    return np.nan_to_num(values) > min(limit, max(good, beyond))


def _missing(record: CohortRecord) -> list[str]:
    refused = [
        f"{', '.join(filter(None, (member.id, r.unit)))}, {r.stage} refused: {r.sentence}"
        for member in record.members
        for r in member.refusals
    ]
    return list(dict.fromkeys((*record.missing, *refused)))


# --- people -------------------------------------------------------------------------------------


def _people(record: CohortRecord) -> Grid:
    words = ("participant", "calibrated on", "sex", "use")
    body = ("mass [kg]", "plates against it [%]", "height [m]")
    known = (f"{one.title} [{one.unit}]" for one in _yardsticks(record))
    head = (*words, *body, *known, "identified on [s]", "condition number", "refusals")
    rows = tuple(_person(record, member) for member in record.members)
    return Grid(head, rows, words=len(words))


def _person(record: CohortRecord, member: Member) -> tuple[str | Cell, ...]:
    name = Cell(member.id, link=member.link())
    refusals = Cell(str(len(member.refusals)), "warning" if member.refusals else "")
    if member.facts is None:
        return (name, *[MISSING] * 11, refusals)
    facts, identified = member.facts, member.identification or {}
    values = ((one, member.yardstick(one.name)) for one in _yardsticks(record))
    return (
        name,
        trial_label(str(facts["calibration_trial"])),
        str(facts["sex"]),
        member.use or MISSING,
        number(facts["mass_kg"], 2),
        signed(100.0 * (facts["plate_mass_kg"] / facts["mass_kg"] - 1.0), 1),
        number(facts["height_m"], 2),
        *(Cell(number(v), "warning" if one.is_large(v) else "") for one, v in values),
        number(identified.get("duration_s")),
        significant(identified.get("condition_number")),
        refusals,
    )


# --- tables -------------------------------------------------------------------------------------


def _tables(record: CohortRecord) -> Iterator[Block]:
    """With their legends; tests compare people, so a single one has none."""
    files: dict[str, list[tuple[str, str]]] = {}
    for file in map(PurePosixPath, record.table_files):
        files.setdefault(file.stem, []).append((file.suffix.removeprefix("."), f"../{file}"))
    if not record.tables:
        yield Paragraph("No tables were made.", "warning")
    elif len([m for m in record.members if m.identification is not None]) < 2:
        yield Paragraph("Tests compare people: of one person there is nothing to test.", "note")
        yield Links("The tables as files:", tuple((name, of[0][1]) for name, of in files.items()))
    else:
        yield Paragraph("All tests, and how each was made, are in the files.", "note")
        for tag, table in zip(BUILDERS, record.tables, strict=False):
            yield Heading(table.title)
            if tag in IN_PRINT:
                yield from _table(table)
            if own := files.pop(table.name, []):
                yield Links("As a file:", tuple(own))
        published = tuple((name, of[0][1]) for name, of in files.items())
        yield from [Links("Next to the published values:", published)] if published else []


def _table(table: Table) -> Iterator[Block]:
    """Means, the interval of their difference, and its p-value."""
    if not table.rows:
        yield Paragraph("There are no numbers for this table.", "note")
        return
    columns = [
        (k, column)
        for k, column in enumerate(table.printed_columns())
        if column.text or column.heading.endswith(("M(SD)", " CI")) or column.heading in _KEPT
    ]
    rows: list[tuple[str | Cell, ...]] = []
    group = ""
    for row in table.rows:
        if row.group != group:
            group = row.group
            rows.append((Cell(group, "group"), *[""] * (len(columns) - 1)))
        cells = table.printed_cells(row)
        rows.append(tuple(cells[k] for k, _ in columns))
    words = sum(column.text for _, column in columns)
    yield Grid(tuple(one.heading for _, one in columns), tuple(rows), words=max(1, words))
    yield from (Paragraph(note, "note") for note in table.notes[:1])  # the legend


# --- the gain of identification -------------------------------------------------------------------


def _gain(record: CohortRecord) -> Iterator[Block]:
    ratios = record.ratios
    names = tuple(ratios.of_component)
    if not names:
        yield Paragraph("No trial could be compared with both methods.", "warning")
        return
    if not ratios.held_out:
        yield Paragraph(TEXTS["nobody_held_out"], "warning")
    worse, rows = [], []
    for name in names:
        over = ratios.over_best_other(name)
        better = int((over < 1 - SAME_WITHIN).sum())
        fewer, everyone = int((over > 1 + SAME_WITHIN).sum()), int(np.isfinite(over).sum())
        worse += [component_label(name)] if _typical(over) > 0.0 or fewer > better else []
        changes = (signed(100.0 * _typical(ratios.over_rm(name, m))) for m in (RM_MASS, OM))
        counts = better, fewer, everyone - better - fewer, everyone
        rows.append((component_label(name), *changes, *map(str, counts)))
    yield Paragraph(
        f"RM or RM+mass follows better on the whole, or in more participants, in: {listing(worse)}."
        if worse
        else "OM follows better than RM and RM+mass in every component.",
        "warning" if worse else "good",
    )
    if (name := "grf_vertical") in names:
        rm_mass, om = (_typical(ratios.over_rm(name, method)) for method in (RM_MASS, OM))
        if np.isfinite(rm_mass):
            yield Paragraph(errors.one_number_alone(component_label(name), rm_mass, om))
    others = [method for method in METHODS if method != RM]
    of_method = {m: np.array([ratios.over_rm(name, m) for name in names]) for m in others}
    where = "held-out data" if ratios.held_out else "the data that identified the parameters"
    data = pd.concat(table.assign(component=name) for name, table in ratios.of_component.items())
    figure = gain_dots([component_label(name) for name in names], of_method)
    yield picture("gain", figure, data.reset_index(), where=where)
    yield Grid(
        ("component", RM_MASS, OM, "OM better", "RM or RM+mass better", "the same", "all"),
        tuple(rows),
        f"Change of the error from RM. The same: within {percent(SAME_WITHIN)} %.",
        groups=(("", 1), ("typical change [%]", 2), ("number of participants", 4)),
    )


def _typical(ratios: np.ndarray) -> float:
    """Relative change of the errors, their geometric mean; NaN without any."""
    known = ratios[np.isfinite(ratios)]
    return float(np.exp(np.log(known).mean())) - 1.0 if len(known) else float("nan")


# --- what is wrong in whose recordings, and what several people share -----------------------------

_NOT_RUN = "Nobody's recordings were searched for errors: run `bsip diagnose`."
_NO_TRIAL = "No recording has motion with every contact on a plate"
_STATES: dict[State, str] = TEXTS["states"]


def light_of_all(record: CohortRecord) -> Light:
    """How many of the persons' own lights are red, amber, without an answer, and fine; the worst
    gives the colour."""
    people = _searched_people(record)
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


def diagnoses_section(record: CohortRecord) -> Section:
    """Of each participant, what was found, missed or not searched for."""
    people = _searched_people(record)
    blocks: list[Block] = [] if people else [Paragraph(_NOT_RUN, "note")]
    missing = [m.id for m in record.members if m.facts is not None and m.searched is None]
    if missing and people:
        blocks.append(Paragraph(f"Not searched for errors: {named_people(missing)}.", "note"))
    if without := [p.id for p in people if not p.was_searched]:
        blocks.append(Paragraph(f"{_NO_TRIAL}: {named_people(without)}.", "note"))
    blocks += [Paragraph(text, "good") for text in _nothing_found(people)]
    reports = {m.id for m in record.members if m.has_report}
    rows = tuple(_cause_row(one.id, cause, reports) for one in people for cause in one.causes)
    if rows:
        head = ("participant", "found", "recordings", "probability")
        caption = "Probability: that the cause, or one of the group, is there"
        if short := abbreviations(task_of(t) for one in people for t in one.trials):
            caption += f". {short}"
        blocks.append(Grid(head, rows, caption, words=3))
    if shared := shared_causes(people):
        blocks += [Paragraph(SHARED), Bullets(shared, "warning")]
    if rows:
        blocks.append(Paragraph(TEXTS["some_are_wrong"], "note"))
    return Section("diagnoses", "What is wrong in the recordings", tuple(blocks))


def _searched_people(record: CohortRecord) -> tuple[Searched, ...]:
    return tuple(m.searched for m in record.members if m.searched is not None)


def _nothing_found(people: Sequence[Searched]) -> list[str]:
    of_movements: dict[str, list[str]] = {}
    for one in people:
        if one.was_searched and not one.causes:
            movements = listing([trial_label(stem) for stem in one.trials])
            where = f" (searched: {movements})" if one.trials else ""
            of_movements.setdefault(where, []).append(one.id)
    return [
        f"No fault was found in {named_people(names)}{movements}."
        for movements, names in of_movements.items()
    ]


def _cause_row(person: str, cause: Cause, reports: set[str]) -> tuple[str | Cell, ...]:
    texts = [capital(one.in_words()) for one in cause]
    return (
        Cell(person, link=f"../{person}/report.html" if person in reports else ""),
        texts[0] if len(texts) == 1 else f"One of these: {'; '.join(texts)}",
        listing([*dict.fromkeys(trial_label(stem) for one in cause for stem in one.trials)]),
        probability_words(probability_of(cause)) or MISSING,
    )
