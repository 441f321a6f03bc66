"""Which parameters to use, near the top of the report."""

from __future__ import annotations

import pandas as pd

from bsip_cli.report.blocks import Block, Grid, Heading, Paragraph
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import MISSING, number
from bsip_cli.statistics.choice import Difference
from bsip_cli.statistics.methods import OM, RM

_RATIOS = ("om", "rm_mass", "om_rm_mass")


def blocks(record: ParticipantRecord) -> list[Block]:
    """Nothing where ``choose`` has not run."""
    if record.choice is None:
        return []
    first = record.choice.iloc[0]
    said: list[Block] = [
        Heading("Which parameters to use"),
        Paragraph(str(first["sentence"]), "warning" if first["use"] == RM else "good"),
    ]
    rare = record.identification[record.identification["rare"].astype(bool)]
    said += [
        Paragraph(
            f"Do not use {row.method}: a body like this is rarer than 1 in 100 people, most by "
            f"{row.farthest}.",
            "warning",
        )
        for row in rare.itertuples()
    ]
    return [*said, _grid(record.choice)] if first["trials"] else said


def _grid(choice: pd.DataFrame) -> Grid:
    return Grid(
        ("movement", "use", "OM over RM", "RM+mass over RM", "OM over RM+mass", "trials"),
        tuple(_row(row) for _, row in choice.iterrows()),
        "Errors as ratios, the geometric mean of six components and both directions of the centre "
        "of pressure, with one standard error to either side. "
        f"{OM} is used only where its error is smaller than both others by more than that, RM+mass "
        "only where it is smaller than RM's.",
        words=2,
    )


def _row(row: pd.Series) -> tuple[str, ...]:
    ratios = (_ratio(row[f"ratio_{name}"], row[f"log_error_{name}"]) for name in _RATIOS)
    return (str(row["movement"]), str(row["use"]), *ratios, str(row["trials"]))


def _ratio(ratio: float, log_error: float) -> str:
    low, high = Difference.of_ratio(ratio, log_error).interval()
    ends = f" ({number(low, 2)} to {number(high, 2)})" if number(low) != MISSING else ""
    return f"{number(ratio, 2)}{ends}"
