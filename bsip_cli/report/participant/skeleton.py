"""Section 5: the person's segments and joints."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Paragraph, Section
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import listing, number, segment_label, signed, with_spread

_FAR_PERCENT = 5.0
_MM = 1000.0
_Z95 = 1.96


def section(record: ParticipantRecord) -> Section:
    rows = record.skeleton.set_index("segment")
    blocks: list[Block] = [
        Paragraph(_in_words(rows)),
        Grid(
            (
                "segment",
                "hangs on",
                "joint",
                "type",
                "length [mm]",
                "first guess [mm]",
                "change [%]",
                "joint moved by [mm]",
            ),
            tuple(_row(str(name), row) for name, row in rows.iterrows()),
            "Lengths are those that scale the anthropometric table, ± one standard deviation",
            words=4,
        ),
        Heading("Left against right"),
        *_symmetry(rows),
        Heading("Where the markers sit"),
        _markers(record),
    ]
    return Section("skeleton", "The skeleton", tuple(blocks))


def _change(row: pd.Series) -> float:
    first = row["first_guess_m"]
    return 100.0 * (row["length_m"] / first - 1.0) if first else np.nan


def _in_words(rows: pd.DataFrame) -> str:
    changes = rows.apply(_change, axis=1)
    far = [
        f"{segment_label(str(s))} ({signed(c, 1)} %)"
        for s, c in changes.items()
        if abs(c) > _FAR_PERCENT
    ]
    text = (
        f"Refinement moved these lengths by more than {_FAR_PERCENT:.0f} % from their first "
        f"guess: {listing(far)}."
    )
    held = [segment_label(s) for s in rows.index[rows["held"].astype(bool)]]
    if held:
        text += (
            f" No markers inform {listing(held)}: their joints are held at the neutral pose, "
            "and their parameters cannot be identified."
        )
    return text


def _row(name: str, row: pd.Series) -> tuple[str | Cell, ...]:
    change = _change(row)
    kind = f"{row['joint_type']}, held" if row["held"] else row["joint_type"]
    return (
        segment_label(name),
        segment_label(row["parent"] or "") or "–",
        row["joint"],
        kind,
        with_spread(_MM * row["length_m"], _MM * row["length_sd_m"]),
        number(_MM * row["first_guess_m"]),
        Cell(signed(change, 1), "warning" if abs(change) > _FAR_PERCENT else ""),
        number(_MM * row["joint_shift_m"]),
    )


def _symmetry(rows: pd.DataFrame) -> list[Block]:
    length, sd = (rows[name].astype(float) for name in ("length_m", "length_sd_m"))
    pairs = [
        (str(name)[:-2], length[name], length[right], _Z95 * float(np.hypot(sd[name], sd[right])))
        for name, right in ((name, f"{str(name)[:-2]}_r") for name in rows.index)
        if str(name).endswith("_l") and right in rows.index
    ]
    if not pairs:
        return [Paragraph("The skeleton has no pairs of segments.", "note")]
    grid = tuple(
        (
            segment_label(name),
            number(_MM * left),
            number(_MM * right),
            Cell(_apart(left, right, error), "group" if abs(left - right) > error else ""),
            signed(200.0 * (left - right) / (left + right), 1),
        )
        for name, left, right, error in pairs
    )
    clear = [segment_label(name) for name, left, right, error in pairs if abs(left - right) > error]
    sentence = (
        f"Clear of its error is a difference of the {listing(clear)}."
        if clear
        else "No difference is clear of its error."
    )
    return [
        Paragraph(
            f"{sentence} Left and right were tied softly, so a difference that the markers "
            "do not show clearly is drawn towards zero. Where no error stands (hands, feet) the "
            "lengths come straight from the markers, and so do their differences: none of this is "
            "a measurement of the person's symmetry."
        ),
        Grid(
            ("segment", "left [mm]", "right [mm]", "left − right [mm]", "left − right [%]"),
            grid,
            "Left against right, ± what 95 % of differences stay within if nothing differs",
        ),
    ]


def _apart(left: float, right: float, error: float) -> str:
    spread = "" if np.isnan(error) else f" ± {number(_MM * error, 1)}"
    return f"{signed(_MM * (left - right), 1)}{spread}"


def _markers(record: ParticipantRecord) -> Grid:
    rows = tuple(
        (
            row["marker"],
            segment_label(row["segment"]),
            number(row["weight"], 2),
            *(number(_MM * row[axis]) for axis in ("x_m", "y_m", "z_m")),
            number(_MM * row["shift_m"]),
            number(_MM * row["residual_m"]),
        )
        for _, row in record.marker_positions.iterrows()
    )
    return Grid(
        ("marker", "segment", "weight", "X", "Y", "Z", "moved by [mm]", "residual [mm]"),
        rows,
        "Position in the segment (X forward, Y up, Z to the right), how far refinement moved it "
        "from the calibration trial, RMS residual over the refining frames",
        groups=(("", 3), ("position [mm]", 3), ("", 2)),
        words=2,
    )
