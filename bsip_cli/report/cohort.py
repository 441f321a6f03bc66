"""The report of the cohort: a first page, and folded sections."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import compress, groupby
from math import isfinite
from pathlib import PurePosixPath
from typing import Any

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
    Terms,
    first_of,
    picture,
)
from bsip_cli.report.causes import effect_title, parameter_label, place_label, size_words
from bsip_cli.report.cohort_record import (
    SHARED,
    CohortRecord,
    Member,
    Searched,
    named_people,
    shared_causes,
)
from bsip_cli.report.figures.charts import Strip, gain_dots, strips
from bsip_cli.report.records import how_made
from bsip_cli.report.tables.build import IN_PRINT, TAGS
from bsip_cli.report.tables.model import Table
from bsip_cli.report.verdict import probability_of
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
    probability_words,
    signed,
    significant,
    task_of,
    trial_label,
    true_minus,
)
from bsip_cli.segments import SEGMENTS
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN

_MOST = 6  # sentences of a kind on the first page


def cohort_document(record: CohortRecord) -> Document:
    """The page of a whole study."""
    sections = {
        ("people", "Who took part?"): [_people(record)],
        ("diagnoses", "What is wrong in the recordings"): diagnosis_blocks(record),
        ("laboratory", "The laboratory"): _laboratory(record.laboratory),
        ("gain", "Do identified parameters follow the forces better?"): _gain(record),
        ("tables", "The papers' tables"): _tables(record),
        ("made", "How was it made?"): how_made(record.made, record.defaults),
    }
    return Document(
        title="Cohort (all participants): do motion and measured forces agree?",
        subtitle="Ground forces measured by plates, against those computed from markers.",
        front=tuple(_front(record)),
        sections=(*(Section(*name, tuple(of)) for name, of in sections.items()), WORDS),
    )


# --- first page -----------------------------------------------------------------------------------


def _front(record: CohortRecord) -> Iterator[Block]:
    done = [m for m in record.members if m.facts is not None and m.identification is not None]
    everyone = count(len(record.members), "participant")
    uses = [m.use for m in record.members if m.use]
    used = listing([f"{name} for {uses.count(name)}" for name in dict.fromkeys(uses)], "not known")
    software = ", ".join(sorted(record.made.versions.get("bsip", ())))
    decided = [m.identification["decided"] for m in done if m.identification is not None]
    ends = dict.fromkeys(
        number(x, 0) for x in (min(decided, default=np.nan), max(decided, default=np.nan))
    )
    data = (
        f"; the data decide {' to '.join(ends)} of their {10 * len(SEGMENTS)} parameters"
        if decided
        else ""
    )
    people = ("Participants", f"OM of {len(done)} of {everyone}{data}")
    use = ("Parameters", f"use {used} (OM: identified; RM: table; RM+mass: scaled table)")
    yield Terms((people, use, ("Software", f"bsip {software}")))
    yield light_of_all(record)
    yield Heading("How large are the errors?")
    yield from _strips(record)
    yield Heading("The laboratory")
    yield from _laboratory_in_brief(record.laboratory)
    refused = [
        f"{', '.join(filter(None, (member.id, r.unit)))}, {r.stage} refused: {r.sentence}"
        for member in record.members
        for r in member.refusals
    ]
    missing = list(dict.fromkeys((*record.missing, *refused)))
    yield Heading("Who could not be used, and why")
    nobody = Paragraph("Nobody is missing.")
    yield first_of(missing, _MOST, "could_not_be_used", "warning") if missing else nobody


def light_of_all(record: CohortRecord) -> Light:
    """How many of the persons' own lights are red, amber, without an answer, and fine; the worst
    gives the colour."""
    people = _searched_people(record)
    lights = [(m.id, m.light.state) for m in record.members if m.light is not None]
    of_state = {
        state: (words, own)
        for state, words in TEXTS["states"].items()
        if (own := [name for name, its in lights if its == state])
    }
    if not people:
        return Light("inconclusive", "Not examined", TEXTS["nobody_searched"])
    if not of_state:
        return Light("inconclusive", "Not known", "Nobody's report was made: run `bsip report`.")
    title = count(len(lights), "participant")
    title += " with a report" if len(lights) < len(people) else ""
    title += f": {'; '.join(f'{len(own)} {words}' for words, own in of_state.values())}"
    large = [f"Large error: {named_people(of_state['large'][1])}."] if "large" in of_state else []
    return Light(next(iter(of_state)), title, " ".join((*large, *shared_causes(people)[:2])))


def _yardsticks(record: CohortRecord) -> tuple[errors.Yardstick, ...]:
    shipped = record.defaults["diagnosis"]
    limits = (
        record.made.number(f"diagnosis.{name}", float(shipped[name]))
        for name in (errors.COP_LIMIT_M, errors.FORCE_LIMIT_PERCENT)
    )
    return errors.yardsticks(*limits)


def _strips(record: CohortRecord) -> Iterator[Block]:
    members = record.members
    names = tuple(member.id for member in members)
    rows, drawn, far_out = {"participant": [*names]}, [], []
    for one in _yardsticks(record):
        values = np.array([member.yardstick(one.name) for member in members], dtype=float)
        far = is_far(values, one.good, one.limit)
        title = f"{one.title} [{one.unit}]".replace("Centre of pressure (COP)", "COP")
        end = errors.ENDS_AT * one.limit
        drawn.append(Strip(title, values, names, far, one.good, one.limit, end))
        rows[one.name] = list(values)
        what = one.in_sentence().replace(" (COP)", "")
        for member, v in compress(zip(members, values, strict=True), far):
            far_out.append((f"{member.id} ({what} {number(v)} {one.unit})", member.link()))
    if not any(np.isfinite(strip.values).any() for strip in drawn):
        yield Paragraph("No errors are known.", "warning")
        return
    yield picture("yardsticks", strips(drawn), pd.DataFrame(rows))
    if linked := tuple((words, link) for words, link in far_out if link):
        yield Links("Far from the others, or large:", linked[: 2 * _MOST])
    elif far_out:
        yield Paragraph(f"Far from the others, or large: {listing([w for w, _ in far_out])}.")
    else:
        yield Paragraph("Nobody lies far from the others, and no error is large.")


_FAR = 3.0
"""Robust standard deviations (median absolute deviation times 1.4826) beyond the median: Leys 2013,
J Exp Soc Psychol 49, 764."""
_FEWEST = 5  # persons among whom one can lie far out


def is_far(values: np.ndarray, good: float, limit: float) -> np.ndarray:
    """(p,) of values that are large, or not good and far above the others."""
    known, beyond = values[np.isfinite(values)], np.inf
    if len(known) >= _FEWEST:
        middle = float(np.median(known))
        beyond = middle + _FAR * 1.4826 * float(np.median(np.abs(known - middle)))
    return np.nan_to_num(values) > min(limit, max(good, beyond))


# --- people ---------------------------------------------------------------------------------------


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


# --- what is wrong in whose recordings, and what several people share -----------------------------


def _searched_people(record: CohortRecord) -> tuple[Searched, ...]:
    return tuple(m.searched for m in record.members if m.searched is not None)


def diagnosis_blocks(record: CohortRecord) -> Iterator[Block]:
    """Of each participant, what was found, missed or not searched for."""
    people = _searched_people(record)
    missing = [m.id for m in record.members if m.facts is not None and m.searched is None]
    without = [p.id for p in people if not p.was_searched]
    if not people:
        yield Paragraph(TEXTS["nobody_searched"], "note")
    elif missing:
        yield Paragraph(f"Not searched for errors: {named_people(missing)}.", "note")
    if without:
        no_trial = "No recording has motion with every contact on a plate"
        yield Paragraph(f"{no_trial}: {named_people(without)}.", "note")
    nothing: dict[tuple[str, ...], list[str]] = {}
    for one in people:
        if one.was_searched and not one.causes:
            nothing.setdefault(tuple(map(trial_label, one.trials)), []).append(one.id)
    for trials, names in nothing.items():
        where = f" (searched: {listing(trials)})" if trials else ""
        yield Paragraph(f"No fault was found in {named_people(names)}{where}.", "good")
    if rows := tuple(_cause_rows(record)):
        head = ("participant", "found", "recordings", "probability")
        caption = "Probability: that the cause, or one of the group, is there"
        if short := abbreviations(task_of(t) for one in people for t in one.trials):
            caption += f". {short}"
        yield Grid(head, rows, caption, words=3)
    if shared := shared_causes(people):
        yield from (Paragraph(SHARED), Bullets(shared, "warning"))
    if rows:
        yield Paragraph(TEXTS["some_are_wrong"], "note")


def _cause_rows(record: CohortRecord) -> Iterator[tuple[str | Cell, ...]]:
    for member in record.members:
        for cause in member.searched.causes if member.searched else ():
            texts = [capital(one.in_words()) for one in cause]
            trials = [*dict.fromkeys(trial_label(x) for one in cause for x in one.trials)]
            yield (
                Cell(member.id, link=member.link()),
                texts[0] if len(texts) == 1 else f"One of these: {'; '.join(texts)}",
                "all" if cause[0].is_of_all else listing(trials),
                probability_words(probability_of(cause)) or MISSING,
            )


# --- plates, clock and vertical by all persons together, and what to do ---------------------------

_SAID = ("named", "ambiguous")
_LABORATORY = TEXTS["laboratory"]
_LIMITS = {
    ("sync_offset", "delay"): "a delay of",
    ("plate_translation", "x"): "a plate shifted by",
    ("plate_gain", "gain"): "a force's gain off by",
}


def _laboratory_in_brief(table: pd.DataFrame | None) -> Iterator[Block]:
    """For the first page: what is wrong with it, or what would have been named."""
    if table is None:
        yield Paragraph(_LABORATORY["not_run"], "note")
        return
    said, unnamed = tuple(named_sentences(table)), tuple(unnamed_sentences(table))
    if said:
        yield Bullets(said, "warning")
        yield Paragraph(_LABORATORY["what_to_do"], "note")
    yield from (Paragraph(text, "good") for text in unnamed)
    if not said and not unnamed:
        yield Paragraph(_LABORATORY["alone"], "note")


def _laboratory(table: pd.DataFrame | None) -> Iterator[Block]:
    """A table per laboratory of several persons: what is said, and the likeliest of the rest."""
    if table is None:
        yield Paragraph(_LABORATORY["not_run"], "note")
        return
    head = ("fault", "where", "number", "estimate (95 % interval)", "seen from", "probability")
    for name, rows in _of_several(table).groupby("laboratory"):
        said = rows["verdict"].isin(_SAID)  # and of each other fault the likeliest number
        rest = rows[~said & ~rows["effect"].isin(rows.loc[said, "effect"])]
        likeliest = rest.sort_values("probability", ascending=False).drop_duplicates("effect")
        cells = tuple(map(_fault, pd.concat([rows[said], likeliest]).to_dict("records")))
        caption = f"Laboratory {name}. {_LABORATORY['caption']}"
        yield Grid(head, cells, caption, words=3, name=f"laboratory_{name}", data=rows)


def _fault(row: Mapping[Any, Any]) -> tuple[str | Cell, ...]:
    name, unit = row["parameter"], row["unit"]
    low, high, estimate, limit = (
        size_words(name, unit, row[x]) if isfinite(row[x]) else MISSING
        for x in ("ci_low", "ci_high", "estimate", "limit")
    )
    return (
        Cell(capital(effect_title(row["effect"])), "warning" if row["verdict"] in _SAID else ""),
        place_label(row["effect"], row["target"]),
        parameter_label(row["effect"], name),
        f"{estimate} ({low} to {high})",
        limit,
        probability_words(row["probability"]),
    )


def named_sentences(table: pd.DataFrame) -> Iterator[str]:
    """What is wrong with which laboratory of several persons, and who deviates from it; of causes
    that look alike the likeliest, with the names of the others."""
    several = table["laboratory"].isin(_of_several(table)["laboratory"])
    said = table[several & table["verdict"].isin(_SAID)]
    said = said.drop_duplicates(["laboratory", "sentence"])
    alone = np.where(said["class_id"] == "", said["sentence"], said["class_id"])
    for (laboratory, _), rows in said.groupby(["laboratory", alone], sort=False):
        likeliest, *others = rows.sort_values("probability", ascending=False).to_dict("records")
        text = f"Laboratory {laboratory}: {likeliest['sentence']}."
        if others:
            places = ((x["effect"], place_label(x["effect"], x["target"])) for x in others)
            names = [effect_title(x) + (f" ({place})" if place else "") for x, place in places]
            text += f" It may also be: {listing(names)}."
        yield true_minus(text)


def unnamed_sentences(table: pd.DataFrame) -> Iterator[str]:
    """Of a laboratory in which nothing is wrong, what would have been named."""
    for sentence in table.loc[table["effect"] == "inconclusive", "sentence"]:
        yield f"Nothing can be said of the laboratory: {sentence}."
    for name, rows in _of_several(table).groupby("laboratory"):
        if rows["verdict"].isin(_SAID).any():
            continue
        limits = []
        for (effect, parameter), words in _LIMITS.items():
            mine = rows[(rows["effect"] == effect) & (rows["parameter"] == parameter)]
            for best in mine.sort_values("limit").head(1).to_dict("records"):
                if isfinite(best["limit"]):
                    size = size_words(parameter, best["unit"], best["limit"])
                    limits.append(f"{words} {size}")
        yield _LABORATORY["nothing"].format(laboratory=name, limits=listing(limits))


def _of_several(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of laboratories in which several persons were recorded: of one alone, the person's own
    diagnosis weighs more causes than those of a laboratory."""
    rows = table[table["scope"] == "laboratory"]
    return rows[rows.groupby("laboratory")["persons"].transform("max") > 1]


# --- the gain of identification -------------------------------------------------------------------


def _gain(record: CohortRecord) -> Iterator[Block]:
    ratios = record.ratios
    names = tuple(ratios.of_component)
    labels = [*map(component_label, names)]
    if not names:
        yield Paragraph("No trial could be compared with both methods.", "warning")
        return
    if not ratios.held_out:
        yield Paragraph(TEXTS["nobody_held_out"], "warning")
    worse, rows = [], []
    for name, label in zip(names, labels, strict=True):
        over = ratios.over_best_other(name)
        better = int((over < 1 - SAME_WITHIN).sum())
        fewer, everyone = int((over > 1 + SAME_WITHIN).sum()), int(np.isfinite(over).sum())
        worse += [label] if _typical(over) > 0.0 or fewer > better else []
        changes = (signed(100.0 * _typical(ratios.over_rm(name, m))) for m in (RM_MASS, OM))
        counts = better, fewer, everyone - better - fewer, everyone
        rows.append((label, *changes, *map(str, counts)))
    said = TEXTS["om_worse"].format(components=listing(worse)) if worse else TEXTS["om_better"]
    yield Paragraph(said, "warning" if worse else "good")
    others = [method for method in METHODS if method != RM]
    of_method = {m: np.array([ratios.over_rm(name, m) for name in names]) for m in others}
    where = "held-out data" if ratios.held_out else "the data that identified the parameters"
    data = pd.concat(table.assign(component=name) for name, table in ratios.of_component.items())
    yield picture("gain", gain_dots(labels, of_method), data.reset_index(), where=where)
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


# --- tables ---------------------------------------------------------------------------------------


def _tables(record: CohortRecord) -> Iterator[Block]:
    """With their legends; tests compare people, so a single one has none."""
    paths = [PurePosixPath(file) for file in record.table_files]
    files = {
        stem: tuple((path.suffix.removeprefix("."), f"../{path}") for path in own)
        for stem, own in groupby(paths, key=lambda path: path.stem)
    }
    if not record.tables:
        yield Paragraph("No tables were made.", "warning")
    elif len([m for m in record.members if m.identification is not None]) < 2:
        yield Paragraph("Tests compare people: of one person there is nothing to test.", "note")
        yield Links("The tables as files:", tuple((name, of[0][1]) for name, of in files.items()))
    else:
        yield Paragraph("All tests, and how each was made, are in the files.", "note")
        for tag, table in zip(TAGS, record.tables, strict=False):
            yield Heading(table.title)
            if tag in IN_PRINT:
                yield from _table(table)
            if own := files.pop(table.name, ()):
                yield Links("As a file:", own)
        published = tuple((name, of[0][1]) for name, of in files.items())
        yield from [Links("Next to the published values:", published)] if published else []


def _table(table: Table) -> Iterator[Block]:
    """Means, the interval of their difference, and its p-value."""
    if not table.rows:
        yield Paragraph("There are no numbers for this table.", "note")
        return
    printed = table.printed_columns()
    kept = [
        c.text or c.heading.endswith(("M(SD)", " CI")) or c.heading in ("n", "p") for c in printed
    ]
    columns = [*compress(printed, kept)]
    rows: list[tuple[str | Cell, ...]] = []
    for group, cells in table.printed_groups():
        rows += [(Cell(group, "group"), *[""] * (len(columns) - 1))] if group else []
        rows += [tuple(compress(one, kept)) for one in cells]
    words = max(1, sum(column.text for column in columns))
    yield Grid(tuple(one.heading for one in columns), tuple(rows), words=words)
    yield from (Paragraph(note, "note") for note in table.notes[:1])  # the legend
