"""Section 6, second half: what the movement showed, what to record next, base parameters."""

from __future__ import annotations

import pandas as pd

from bsip_cli.report.blocks import Block, Bullets, Grid, Heading, Paragraph
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import count, listing, number, percent, segment_label, significant

_BEST_MOVEMENTS = 8
_BASE_ROWS = 10


def excitation_blocks(record: ParticipantRecord) -> list[Block]:
    """How well the movement excited each segment, and which movements would tell more."""
    table = record.excitation
    title = Heading("How well the movement excited the parameters")
    if table.empty:
        return [title, Paragraph("The excitation was not computed.")]
    return [
        title,
        Paragraph(f"{_condition(table)} {_not_excited(table)}"),
        _segments(table),
        Heading("What to record next time"),
        *_next(table),
    ]


def _rows(table: pd.DataFrame, quantity: str) -> pd.DataFrame:
    return table[table["quantity"] == quantity].set_index("name")


def _condition(table: pd.DataFrame) -> str:
    singular = _rows(table, "singular_value")["value"]
    condition = _rows(table, "condition_number")["value"].iloc[0]
    return (
        f"Of {count(len(singular), 'combination')} of parameters that ground forces can show, this "
        f"movement shows {int((singular > 1.0).sum())} better than the table knows them. The "
        f"condition number is {significant(condition)}: the larger, the more some combinations "
        "hang on noise."
    )


def _not_excited(table: pd.DataFrame) -> str:
    known = _rows(table, "combinations")["value"]
    silent = [segment_label(name) for name in known.index[known == 0]]
    if not silent:
        return (
            "Every segment was excited: of each, the data know at least one combination of its ten "
            "parameters better than the table does."
        )
    return (
        f"Not excited: {listing(silent)}. The data know no combination of the ten parameters of "
        f"{'these segments' if len(silent) > 1 else 'this segment'} better than the table does."
    )


def _segments(table: pd.DataFrame) -> Grid:
    possible = _rows(table, "segment")["value"].sort_values(kind="stable")
    known = _rows(table, "combinations")["value"].reindex(possible.index)
    said = _rows(table, "data_share")["text"].reindex(possible.index)
    rows = tuple(
        (segment_label(name), said[name], number(known[name], 0), percent(possible[name]))
        for name in possible.index
    )
    return Grid(
        ("segment", "what OM rests on", "combinations of ten", "could decide [%]"),
        rows,
        "Excitation, the least first: on what OM's numbers rest, how many combinations of the ten "
        "parameters the data know better than the table, and the mean share that they could decide",
        words=2,
    )


def _next(table: pd.DataFrame) -> list[Block]:
    alone, together = _rows(table, "movement"), _rows(table, "next")
    if alone.empty:
        return [Paragraph("No movement could be computed for this skeleton and its markers.")]
    now = _rows(table, "segment")["value"].mean()
    steps = tuple(
        f"{_sentence(row['text'])}: {'' if k == 0 else 'another '}{number(row['value'])} points, "
        f"most of all for the {segment_label(row['segment'])}."
        for k, (_, row) in enumerate(together.iterrows())
    )
    best = alone.head(_BEST_MOVEMENTS)
    forces = _rows(table, "movement_forces")["value"].reindex(best.index)
    rows = tuple(
        (
            _sentence(row["text"]),
            segment_label(row["segment"]),
            number(row["value"], 2),
            number(known, 0),
        )
        for (_, row), known in zip(best.iterrows(), forces, strict=True)
    )
    least = alone.iloc[-1]
    return [
        Paragraph(
            f"The movement lets the data decide {percent(now)} % of the parameters' variance in "
            f"the mean. For {count(len(alone), 'movement')}, ten seconds each, it was computed "
            "with this person's skeleton, at this recording's noise and beside what is known "
            "already, by how many percent points a further recording would raise that. These "
            "help most, one after the other:"
        ),
        Bullets(steps),
        Grid(
            ("movement", "gains most", "data share [+ % points]", "forces [− %]"),
            rows,
            f"The {len(rows)} movements that help most, each on its own: rise of the mean data share, "
            "and how much of the ground forces' variance that the parameters leave unknown it "
            "would remove (there heavy segments count most). Of all, it would help "
            f"least to {least['text']} ({number(least['value'], 2)})",
            words=2,
        ),
    ]


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def base_blocks(record: ParticipantRecord) -> list[Block]:
    """The base parameters that are known best and worst."""
    table = record.base_parameters
    if table.empty:
        return [Paragraph("No base parameters were written.", "note")]
    limit = record.option("identify", "sigma_percent_limit", 5.0)
    ordered = table.sort_values("sigma_percent", kind="stable")
    good = int((ordered["sigma_percent"] < limit).sum())
    best = ordered.head(_BASE_ROWS)
    worst = ordered.iloc[len(best) :].tail(_BASE_ROWS)
    return [
        Heading("Base parameters"),
        Paragraph(
            f"The ground forces determine {count(len(table), 'combination')} of the parameters. "
            f"{count(good, 'of them is', 'of them are')} known to better than {limit:g} % (sd relative to the value). "
            "Behind a large number may also stand a combination that is nearly zero."
        ),
        _base_grid(best, "known best"),
        *([_base_grid(worst, "known worst")] if len(worst) else []),
    ]


def _base_grid(table: pd.DataFrame, which: str) -> Grid:
    rows = tuple(
        (
            row["name"],
            row["expression"],
            row["unit"],
            significant(row["rm_value"]),
            significant(row["value"]),
            significant(row["sd"], 2),
            significant(row["sigma_percent"]),
        )
        for _, row in table.iterrows()
    )
    return Grid(
        ("leading parameter", "combination", "unit", "RM", "identified", "sd", "sigma [%]"),
        rows,
        f"The {count(len(rows), 'base parameter')} {which}, sorted by sd relative to the value",
        words=3,
    )
