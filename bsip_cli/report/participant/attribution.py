"""Which parameters of which segment make RM's errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bsip_cli.body.names import SEGMENTS
from bsip_cli.report.blocks import Block, Bullets, Grid, Heading, Paragraph, Picture
from bsip_cli.report.figures.attribution_bars import AttributionBars, attribution_bars
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import COMPONENTS, component_label, listing, number, segment_label

GROUPS = ("mass", "centre_of_mass", "inertia")
_COPS = ("cop_ap", "cop_ml")
_LARGEST = 3
_WORTH_PERCENT = 5.0


def blocks(record: ParticipantRecord) -> list[Block]:
    """Attribution over all trials of movement whose data OM had not seen, else over all."""
    heading = Heading("Where the table's (RM's) errors come from")
    tables = {
        trial.label: trial.attribution
        for trial in record.trials
        if trial.attribution is not None and len(trial.attribution) and trial.role != "static"
    }
    held_out = {k: t for k, t in tables.items() if (t["data"] == "held_out").all()}
    chosen = held_out or tables
    if not chosen:
        return [heading, Paragraph("RM's errors were not attributed to segments.", "note")]
    pooled = pooled_shares(list(chosen.values()))
    return [
        heading,
        Paragraph(
            "RM and OM differ in every segment's mass, centre of mass and inertia. Which of these "
            "differences makes the simulated force follow better? Each gets the share of RM's "
            "squared error that goes when its parameters become OM's, averaged over all orders in "
            "which they may be exchanged; a share below zero makes the error larger, and the shares "
            "of neighbours may cancel. What OM leaves is the rest; all together are 100 %. The "
            "differences stand with OM's 95 % intervals, and “too much” or “too far” only where "
            "they exceed them; OM splits a segment from its neighbour partly by the table, and "
            "inherits what is wrong with the recordings."
        ),
        Bullets(_sentences(pooled)),
        _bars(pooled, list(chosen)),
        _grid(pooled),
    ]


def pooled_shares(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """``attribution`` rows of all trials as one, weighted by their squared errors."""
    rows = pd.concat(tables, ignore_index=True)
    weight = rows["n"] * rows["rmse"] ** 2
    rows = rows.assign(part=weight * rows["share_percent"], weight=weight)
    keys = ["component", "segment", "group"]
    pooled = rows.groupby(keys, sort=False, as_index=False).agg(
        part=("part", "sum"),
        weight=("weight", "sum"),
        n=("n", "sum"),
        source=("source", "first"),
        unit=("rmse_unit", "first"),
    )
    pooled["share_percent"] = pooled["part"] / pooled["weight"]
    pooled["rmse"] = np.sqrt(pooled["weight"] / pooled["n"])
    return pooled


def _sentences(pooled: pd.DataFrame) -> tuple[str, ...]:
    """The largest shares of the errors in the centre of pressure, with what OM has changed."""
    said = []
    for component in _COPS:
        rows = pooled[(pooled["component"] == component) & (pooled["segment"] != "")]
        large = rows[rows["share_percent"] >= _WORTH_PERCENT]
        for row in large.nlargest(_LARGEST, "share_percent").to_dict("records"):
            said.append(
                f"{number(row['share_percent'], 0)} % of the squared error in "
                f"{component_label(component)} comes from the {row['source']}."
            )
    return tuple(said)


def _bars(pooled: pd.DataFrame, trials: Sequence[str]) -> Picture:
    present = set(pooled["segment"])
    segments = [name for name in SEGMENTS if name in present]
    shares = {}
    for component in _COPS:
        rows = pooled[pooled["component"] == component].set_index(["segment", "group"])
        if len(rows):
            values = [[rows["share_percent"].get((s, g), 0.0) for g in GROUPS] for s in segments]
            rest = rows["share_percent"].get(("", "rest"), np.nan)
            name = f"{component_label(component)} (rest {number(rest, 0)} %)"
            shares[name] = np.array(values)
    figure = attribution_bars(AttributionBars(tuple(map(segment_label, segments)), shares))
    caption = (
        f"Share of RM's squared COP error by segment and group of parameters, over "
        f"{listing(trials)}. To the right: the error goes with OM's parameters."
    )
    return Picture(figure, caption, "Bars: share of the error per segment.", "attribution")


def _grid(pooled: pd.DataFrame) -> Grid:
    lines = []
    for component in (c for c in COMPONENTS if c in set(pooled["component"])):
        rows = pooled[pooled["component"] == component]
        of_segments = rows[rows["segment"] != ""].nlargest(_LARGEST, "share_percent")
        largest = [
            f"{segment_label(r['segment'])}: {r['group'].replace('_', ' ')} "
            f"{number(r['share_percent'], 0)} %"
            for r in of_segments.to_dict("records")
        ]
        rest = rows.loc[rows["group"] == "rest", "share_percent"]
        lines.append(
            (
                component_label(component),
                "; ".join(largest),
                str(rows["unit"].iloc[0]),
                number(rows["rmse"].iloc[0], 2),
                number(rest.iloc[0], 0),
            )
        )
    head = ("component", "largest shares of RM's squared error", "unit", "RMSE of RM", "rest [%]")
    return Grid(
        head,
        tuple(lines),
        "The largest shares in every component (moments about the mean centre of pressure)",
        words=2,
    )
