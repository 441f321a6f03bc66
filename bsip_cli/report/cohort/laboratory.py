"""Plates, clock and vertical by all persons together, and what to do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Paragraph, Section
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.effect_words import effect_title, parameter_label, place_label, size_words
from bsip_cli.report.verdict import probability_words
from bsip_cli.report.words import MISSING, TEXTS, capital, listing, true_minus

SAID = ("named", "ambiguous")
_TEXTS = TEXTS["laboratory"]
_HEAD = ("fault", "where", "number", "estimate (95 % interval)", "seen from", "probability")


def first(record: CohortRecord) -> Iterator[Block]:
    """For the first page: what is wrong with it, or what would have been named."""
    if record.laboratory is None:
        yield Paragraph(_TEXTS["not_run"], "note")
        return
    said = tuple(named_sentences(record.laboratory))
    unnamed = tuple(unnamed_sentences(record.laboratory))
    if said:
        yield Bullets(said, "warning")
        yield Paragraph(_TEXTS["what_to_do"], "note")
    yield from (Paragraph(text, "good") for text in unnamed)
    if not said and not unnamed:
        yield Paragraph(_TEXTS["alone"], "note")


def section(record: CohortRecord) -> Section:
    """A table per laboratory of several persons: what is said, and the likeliest of the rest."""
    table = record.laboratory
    blocks: list[Block] = [Paragraph(_TEXTS["not_run"], "note")] if table is None else []
    if table is not None:
        for number, rows in _of_several(table).groupby("laboratory"):
            name = f"laboratory_{number}"
            said = rows["verdict"].isin(SAID)  # and of each other fault the likeliest number
            rest = rows[~said & ~rows["effect"].isin(rows.loc[said, "effect"])]
            likeliest = rest.sort_values("probability", ascending=False).drop_duplicates("effect")
            cells = tuple(map(_row, pd.concat([rows[said], likeliest]).to_dict("records")))
            caption = f"Laboratory {number}. {_TEXTS['caption']}"
            blocks.append(Grid(_HEAD, cells, caption, words=3, name=name, data=rows))
    return Section("laboratory", "The laboratory", tuple(blocks))


def named_sentences(table: pd.DataFrame) -> Iterator[str]:
    """What is wrong with which laboratory of several persons, and who deviates from it; of causes
    that look alike the likeliest, with the names of the others."""
    several = table["laboratory"].isin(_of_several(table)["laboratory"])
    said = table[several & table["verdict"].isin(SAID)]
    said = said.drop_duplicates(["laboratory", "sentence"])
    alone = np.where(said["class_id"] == "", said["sentence"], said["class_id"])
    for (laboratory, _), rows in said.groupby(["laboratory", alone], sort=False):
        likeliest, *others = rows.sort_values("probability", ascending=False).to_dict("records")
        text = f"Laboratory {laboratory}: {likeliest['sentence']}."
        if others:
            text += f" It may also be: {listing([_named(one) for one in others])}."
        yield true_minus(text)


def _named(row: Mapping[Any, Any]) -> str:
    title, place = effect_title(row["effect"]), place_label(row["effect"], row["target"])
    return f"{title} ({place})" if place else title


def unnamed_sentences(table: pd.DataFrame) -> Iterator[str]:
    """Of a laboratory in which nothing is wrong, what would have been named."""
    for sentence in table.loc[table["effect"] == "inconclusive", "sentence"]:
        yield f"Nothing can be said of the laboratory: {sentence}."
    for number, rows in _of_several(table).groupby("laboratory"):
        if not rows["verdict"].isin(SAID).any():
            limits = listing(list(_limits(rows)))
            yield (
                f"Laboratory {number}: no fault of plates, clock or vertical was named; these "
                f"recordings would have shown {limits}."
            )


def _of_several(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of laboratories in which several persons were recorded: of one alone, the person's own
    diagnosis weighs more causes than those of a laboratory."""
    rows = table[table["scope"] == "laboratory"]
    return rows[rows.groupby("laboratory")["persons"].transform("max") > 1]


_SHOWN = {
    ("sync_offset", "delay"): "a delay of",
    ("plate_translation", "x"): "a plate shifted by",
    ("plate_gain", "gain"): "a force's gain off by",
}


def _limits(rows: pd.DataFrame) -> Iterator[str]:
    for (effect, parameter), words in _SHOWN.items():
        mine = rows[(rows["effect"] == effect) & (rows["parameter"] == parameter)]
        for best in mine.sort_values("limit").head(1).to_dict("records"):
            if isfinite(best["limit"]):
                yield f"{words} {size_words(parameter, best['unit'], best['limit'])}"


def _row(row: Mapping[Any, Any]) -> tuple[str | Cell, ...]:
    name, unit = row["parameter"], row["unit"]
    low, high, estimate, limit = (
        size_words(name, unit, row[x]) if isfinite(row[x]) else MISSING
        for x in ("ci_low", "ci_high", "estimate", "limit")
    )
    return (
        Cell(capital(effect_title(row["effect"])), "warning" if row["verdict"] in SAID else ""),
        place_label(row["effect"], row["target"]),
        parameter_label(row["effect"], name),
        f"{estimate} ({low} to {high})",
        limit,
        probability_words(row["probability"]),
    )
