"""Section 6: the inertial parameters, and how much of each the data decided."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Heading, Paragraph, Picture, Section
from bsip_cli.report.figures.com_differences import ComDifferences, com_differences
from bsip_cli.report.figures.segment_masses import SegmentMasses, segment_masses
from bsip_cli.report.participant.excitation import base_blocks, excitation_blocks
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import (
    count,
    listing,
    number,
    percent,
    segment_label,
    signed,
    with_spread,
)
from bsip_cli.schemas import share_name
from bsip_cli.statistics.methods import OM, RM, RM_MASS

DECIDED, FROM_TABLE = 0.8, 0.2
_COM = ("com_x_m", "com_y_m", "com_z_m")
_MOMENTS = ("ixx_kgm2", "iyy_kgm2", "izz_kgm2")
_MM, _KG_CM2 = 1e3, 1e4


def section(record: ParticipantRecord) -> Section:
    rm, om = record.method(RM), record.method(OM)
    if om.empty or rm.empty:
        gone = OM if om.empty else RM
        blocks: list[Block] = [
            Paragraph(f"There are no parameters of {gone}, so nothing can be compared.", "warning")
        ]
    else:
        om = om.reindex(rm.index)
        rm_mass_kg = record.method(RM_MASS)["mass_kg"].reindex(rm.index).to_numpy(dtype=float)
        blocks = [
            Paragraph(_in_words(om)),
            _masses_picture(rm, rm_mass_kg, om),
            _masses_grid(rm, rm_mass_kg, om),
            Heading("Centres of mass"),
            _com_picture(rm, om),
            _com_grid(rm, om),
            Heading("Moments of inertia"),
            _moments_grid(rm, om),
        ]
    return Section(
        "parameters",
        "The inertial parameters",
        (
            *blocks,
            *excitation_blocks(record),
            *_identification(record.identification),
            *base_blocks(record),
        ),
    )


# --- masses, centres, moments -------------------------------------------------------------------


def _in_words(om: pd.DataFrame) -> str:
    shares = om["mass_data_share"]
    decided = [segment_label(s) for s in om.index[shares > DECIDED]]
    table = [segment_label(s) for s in om.index[shares < FROM_TABLE]]
    between = int(((shares >= FROM_TABLE) & (shares <= DECIDED)).sum())
    by_data, by_table = listing(decided, "no segment"), listing(table, "no segment")
    text = (
        f"The data narrowed most (data share above {percent(DECIDED)} %) the mass of {by_data}. "
        f"The table still decides (data share under {percent(FROM_TABLE)} %) that of {by_table}. "
    )
    if between:
        text += f"{count(between, 'segment lies', 'segments lie')} between. "
    unknown = int(shares.isna().sum())
    if unknown:
        text += f"For {count(unknown, 'segment')} the data share is not known. "
    return text + (
        "The data share is the part of the table's variance that the data removed, given what the "
        "table says of everything else: at 0 % the number is the table's; a large share does not "
        "mean that it is right. Each estimator counts it against the spread it starts from itself, "
        "so shares of different estimators do not compare."
    )


def _labels(frame: pd.DataFrame) -> tuple[str, ...]:
    return tuple(segment_label(name) for name in frame.index)


def _masses_picture(rm: pd.DataFrame, rm_mass_kg: np.ndarray, om: pd.DataFrame) -> Picture:
    data = SegmentMasses(
        _labels(rm),
        rm["mass_kg"].to_numpy(),
        rm_mass_kg,
        om["mass_kg"].to_numpy(),
        om["mass_kg_sd"].to_numpy(),
        om["mass_data_share"].to_numpy(),
    )
    return Picture(
        segment_masses(data),
        "Segment masses by table (RM), by the table times one number (RM+mass) and by identification "
        "(OM), the difference of OM and RM "
        "with its 95 % interval, and how much of the mass the data decided.",
        "Points: segment masses of RM, RM+mass and OM; bars: data share.",
        "masses",
    )


def _masses_grid(rm: pd.DataFrame, rm_mass_kg: np.ndarray, om: pd.DataFrame) -> Grid:
    table, own = rm["mass_kg"].to_numpy(dtype=float), om["mass_kg"].to_numpy(dtype=float)
    sd, share = om["mass_kg_sd"].to_numpy(dtype=float), om["mass_data_share"].to_numpy(dtype=float)
    rows = [
        (
            label,
            number(table[k], 3),
            number(rm_mass_kg[k], 3),
            with_spread(own[k], sd[k], 3),
            signed(100.0 * (own[k] / table[k] - 1.0)),
            _share_cell(share[k]),
        )
        for k, label in enumerate(_labels(rm))
    ]
    total = (
        "whole body",
        number(table.sum(), 3),
        number(rm_mass_kg.sum(), 3),
        number(own.sum(), 3),
        signed(100.0 * (own.sum() / table.sum() - 1.0)),
        "",
    )
    return Grid(
        ("segment", "RM [kg]", "RM+mass [kg]", "OM [kg] ± sd", "change [%]", "data share [%]"),
        (*rows, total),
        "Segment masses; the change is that from RM to OM",
    )


def _share_cell(share: float) -> Cell:
    return Cell(percent(share), "warning" if share < FROM_TABLE else "")


def _com_picture(rm: pd.DataFrame, om: pd.DataFrame) -> Picture:
    data = ComDifferences(
        _labels(rm),
        _MM * (om[list(_COM)] - rm[list(_COM)]).to_numpy(),
        _MM * om[[f"{name}_sd" for name in _COM]].to_numpy(),
        om[[share_name(name) for name in _COM]].to_numpy(),
    )
    return Picture(
        com_differences(data),
        "How far identification moves each centre of mass from the table's, "
        "with 95 % intervals. Full points: the data decided more than half; empty ones: the table.",
        "Points: difference of the centres of mass per segment and axis.",
        "centres_of_mass",
    )


def _com_grid(rm: pd.DataFrame, om: pd.DataFrame) -> Grid:
    return _three_axes(
        rm,
        om,
        _COM,
        _MM,
        1,
        "Centre of mass in the segment's frame, from its proximal joint [mm]",
        ("X (forward)", "Y (up)", "Z (to the right)"),
    )


def _moments_grid(rm: pd.DataFrame, om: pd.DataFrame) -> Grid:
    return _three_axes(
        rm,
        om,
        _MOMENTS,
        _KG_CM2,
        1,
        "Moments of inertia about the segment's centre of mass, segment axes [kg cm²]; RM+mass: RM's "
        "times its number",
        ("about X", "about Y", "about Z"),
    )


def _three_axes(
    rm: pd.DataFrame,
    om: pd.DataFrame,
    columns: Sequence[str],
    scale: float,
    digits: int,
    caption: str,
    axes: Sequence[str],
) -> Grid:
    table, own, sd, share = (
        frame[list(names)].to_numpy(dtype=float)
        for frame, names in (
            (rm, columns),
            (om, columns),
            (om, [f"{c}_sd" for c in columns]),
            (om, [share_name(c) for c in columns]),
        )
    )
    rows = []
    for i, label in enumerate(_labels(rm)):
        cells: list[str | Cell] = [label]
        for k in range(len(columns)):
            cells += [
                number(scale * table[i, k], digits),
                with_spread(scale * own[i, k], scale * sd[i, k], digits),
                _share_cell(share[i, k]),
            ]
        rows.append(tuple(cells))
    head = ("segment", *("RM", "OM ± sd", "data [%]") * len(columns))
    groups = (("", 1), *((axis, 3) for axis in axes))
    return Grid(head, tuple(rows), caption, groups=groups)


# --- what the identification used ---------------------------------------------------------------


def _identification(table: pd.DataFrame) -> list[Block]:
    if table.empty:
        return []
    rows = tuple(
        (
            row["estimator"],
            row["method"],
            number(row["duration_s"]),
            number(row["samples"], 0),
            number(row["effective_samples"], 0),
            number(row["rank"], 0),
            *(
                number(row[f"rms_{c}"], 2)
                for c in ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")
            ),
        )
        for _, row in table.iterrows()
    )
    head = (
        "estimator",
        "method",
        "time used [s]",
        "frames",
        "independent values",
        "base parameters",
        "Fx [N]",
        "Fy [N]",
        "Fz [N]",
        "Mx [N m]",
        "My [N m]",
        "Mz [N m]",
    )
    notes = tuple(
        f"{row['method']} ({row['estimator']}): {row['note']}"
        for _, row in table.iterrows()
        if row["note"]
    )
    grid = Grid(
        head,
        rows,
        "What the identification used, and its residual (RMS)",
        words=2,
        groups=(("", 6), ("residual", 6)),
    )
    return [grid, Bullets(notes)] if notes else [grid]
