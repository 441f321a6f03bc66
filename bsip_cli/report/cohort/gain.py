"""Section 5: the gain of identification, participant by participant."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.blocks import Block, Heading, Paragraph, Picture, Section
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.figures.errors_per_task import ErrorsPerTask, errors_per_task
from bsip_cli.report.figures.gain_dots import GainDots, gain_dots
from bsip_cli.report.words import component_label
from bsip_cli.statistics.methods import METHODS, RM

_ERRORS = (
    ("cop_error", "COP error [mm]", "errors_cop"),
    ("grf_vertical", "vertical force error [% BW]", "errors_vertical_force"),
)
_DATA = {"identification": "used to identify", "held_out": "held out"}


def section(record: CohortRecord) -> Section:
    blocks = [*_dots(record), Heading("Errors per movement")]
    for variable, quantity, name in _ERRORS:
        blocks += _per_task(record, variable, quantity, name)
    return Section("gain", "How much identification gains", tuple(blocks))


def _dots(record: CohortRecord) -> list[Block]:
    ratios, names = record.ratios, tuple(record.ratios.of_component)
    if not names:
        return [Paragraph("There is no error of both methods to compare.", "warning")]
    of_method = {
        method: np.array([ratios.over_rm(name, method) for name in names])
        for method in METHODS
        if method != RM
    }
    data = GainDots(tuple(component_label(name) for name in names), of_method)
    where = "held-out data" if record.ratios.held_out else "the data that identified the parameters"
    caption = (
        f"Error of RM+mass and of OM over error of RM, on {where}; a dot per participant (in the "
        "order of the participants, from top to bottom), the bar their geometric mean. What RM+mass "
        "gains is one number's doing, no gain of identification. The scale is one of ratios: half "
        "and double lie equally far from 1."
    )
    return [
        Picture(
            gain_dots(data),
            caption,
            "Dots: error ratios RM+mass to RM and OM to RM per component.",
            "gain",
        )
    ]


def _per_task(record: CohortRecord, variable: str, quantity: str, name: str) -> list[Block]:
    rows = record.task_errors[variable].dropna(subset=list(METHODS), how="all")
    if rows.empty:
        return [Paragraph(f"There is no {quantity} to show.", "note")]
    keys = list(dict.fromkeys(zip(rows["task"], rows["data"], strict=True)))
    people = sorted(rows["participant"].unique())
    wide = rows.set_index(["task", "data", "participant"])
    errors = {
        method: np.array(
            [[wide[method].get((*key, person), np.nan) for person in people] for key in keys]
        )
        for method in METHODS
    }
    tasks, data = zip(*((task, _DATA.get(how, how)) for task, how in keys), strict=True)
    caption = (
        f"{quantity} per movement and participant (mean over the runs); from left to right "
        "RM, RM+mass and OM, thick lines are the means. The COP error is the length of the errors "
        "in both directions."
        if variable == "cop_error"
        else f"{quantity} per movement and participant, as above."
    )
    figure = errors_per_task(ErrorsPerTask(tasks, data, errors, quantity))
    return [
        Picture(figure, caption, f"Points: {quantity} of RM, RM+mass and OM per movement.", name)
    ]
