"""Which segment parameters come out, how sure they are, and in which movements to use them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Numbered, Paragraph, Picture, Section
from bsip_cli.report.figures.bars import SegmentMasses, segment_masses
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import (
    MISSING,
    capital,
    listing,
    number,
    percent,
    segment_label,
    signed,
    with_spread,
)
from bsip_cli.statistics.choice import Difference
from bsip_cli.statistics.methods import OM, RM, RM_MASS

_FROM_TABLE = 0.2  # less of the variance than this removed: the number is the table's
_COM = ["com_x_m", "com_y_m", "com_z_m"]
_RATIOS = ("om", "rm_mass", "om_rm_mass")
_MOST_STEPS = 3


def section(record: ParticipantRecord) -> Section:
    blocks = (*_choice(record), *_masses(record), *_next(record))
    return Section("parameters", "Which segment parameters come out?", blocks)


def _choice(record: ParticipantRecord) -> Iterator[Block]:
    """Nothing where ``choose`` has not run."""
    choice = record.choice
    if choice is None or choice.empty:
        return
    yield Paragraph(str(choice["sentence"].iloc[0]))
    for row in record.identification[record.identification["rare"].astype(bool)].itertuples():
        yield Paragraph(
            f"Do not use {row.method}: a body like this is rarer than 1 in 100 people, most by "
            f"{row.farthest}.",
            "warning",
        )
    if choice["trials"].iloc[0]:
        yield Grid(
            ("movement", "use", "OM over RM", "RM+mass over RM", "OM over RM+mass", "recordings"),
            tuple(_choice_row(row) for _, row in choice.iterrows()),
            "Errors as ratios (below 1: smaller), with one standard error to either side.",
            words=2,
        )


def _choice_row(row: pd.Series) -> tuple[str, ...]:
    ratios = (_ratio(row[f"ratio_{name}"], row[f"log_error_{name}"]) for name in _RATIOS)
    return (str(row["movement"]), str(row["use"]), *ratios, str(row["trials"]))


def _ratio(ratio: float, log_error: float) -> str:
    low, high = Difference.of_ratio(ratio, log_error).interval()
    ends = f" ({number(low, 2)} to {number(high, 2)})" if number(low) != MISSING else ""
    return f"{number(ratio, 2)}{ends}"


# --- parameters ---------------------------------------------------------------------------------


def _masses(record: ParticipantRecord) -> Iterator[Block]:
    rm, om = record.method(RM), record.method(OM)
    if om.empty or rm.empty:
        gone = OM if om.empty else RM
        yield Paragraph(
            f"There are no parameters of {gone}, so nothing can be compared.", "warning"
        )
        return
    om = om.reindex(rm.index)
    rm_mass_kg = record.method(RM_MASS)["mass_kg"].reindex(rm.index).to_numpy(dtype=float)
    labels = tuple(segment_label(name) for name in rm.index)
    table, own = rm["mass_kg"].to_numpy(dtype=float), om["mass_kg"].to_numpy(dtype=float)
    sd, share = (om[c].to_numpy(dtype=float) for c in ("mass_kg_sd", "mass_data_share"))
    yield Picture(
        segment_masses(SegmentMasses(labels, table, rm_mass_kg, own, sd, share)),
        "masses",
        "Segment masses by table (RM), by the table times one number (RM+mass) and identified (OM), "
        "their difference, and how much of each the data decide.",
        "Points: segment masses; bars: how much the data decide.",
        "long bars to the right are good: the number is this person's. Short ones: it is the table's.",
        "do not read a difference into a mass that the data hardly decide.",
    )
    shift_mm = 1e3 * np.linalg.norm(om[_COM].to_numpy() - rm[_COM].to_numpy(), axis=1)
    rows = [
        (
            label,
            number(table[k], 2),
            with_spread(own[k], sd[k], 2),
            signed(100.0 * (own[k] / table[k] - 1.0)),
            number(shift_mm[k], 0),
            Cell(percent(share[k]), "warning" if share[k] < _FROM_TABLE else ""),
        )
        for k, label in enumerate(labels)
    ]
    total = ("whole body", number(table.sum(), 2), number(own.sum(), 2))
    change = signed(100.0 * (own.sum() / table.sum() - 1.0))
    yield Grid(
        (
            "segment",
            "RM [kg]",
            "OM [kg] ± sd",
            "change [%]",
            "centre of mass moves [mm]",
            "data decide [%]",
        ),
        (*rows, (*total, change, "", "")),
        "Centres of mass and tensors of inertia with their errors are in the CSV.",
        name="segment_parameters",
        data=record.bsip,
    )


def _next(record: ParticipantRecord) -> Iterator[Block]:
    """What to record to know more."""
    table = record.excitation
    if table.empty:
        yield Paragraph("How well the movement excites the parameters was not computed.", "note")
        return
    combinations = table[table["quantity"] == "combinations"]
    silent = [segment_label(n) for n in combinations.loc[combinations["value"] == 0, "name"]]
    if silent:
        yield Paragraph(f"The movement tells nothing of {listing(silent)} that the table does not.")
    steps = table[table["quantity"] == "next"].head(_MOST_STEPS)
    if len(steps):
        yield Heading("What to record next time")
        yield Numbered(
            tuple(
                f"{capital(row['text'])}: {number(row['value'])} per cent points more decided by the "
                f"data, most of all for the {segment_label(row['segment'])}."
                for row in steps.to_dict("records")
            )
        )
