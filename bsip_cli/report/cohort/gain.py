"""The gain of identification, participant by participant."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Grid, Paragraph, Picture, Section
from bsip_cli.report.cohort.record import CohortRecord, Ratios
from bsip_cli.report.figures.strips import gain_dots
from bsip_cli.report.gains import one_number_alone
from bsip_cli.report.words import component_label, listing, percent, signed
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN


def section(record: CohortRecord) -> Section:
    return Section("gain", "Do identified parameters follow the forces better?", (*_gain(record),))


def _gain(record: CohortRecord) -> Iterator[Block]:
    ratios = record.ratios
    names = tuple(ratios.of_component)
    if not names:
        yield Paragraph("No trial could be compared with both methods.", "warning")
        return
    if not ratios.held_out:
        yield Paragraph(
            "Nobody has held-out data: these numbers are from the data that identified the "
            "parameters, and favour OM.",
            "warning",
        )
    worse = [component_label(name) for name in names if _is_worse(ratios.over_rival(name))]
    yield Paragraph(
        f"RM or RM+mass follows better on the whole, or in more participants, in: {listing(worse)}."
        if worse
        else "OM follows better than RM and RM+mass in every component.",
        "warning" if worse else "good",
    )
    yield from _one_number(ratios)
    others = [method for method in METHODS if method != RM]
    of_method = {m: np.array([ratios.over_rm(name, m) for name in names]) for m in others}
    where = "held-out data" if ratios.held_out else "the data that identified the parameters"
    data = pd.concat(table.assign(component=name) for name, table in ratios.of_component.items())
    yield Picture(
        gain_dots([component_label(name) for name in names], of_method),
        "gain",
        f"Error of RM+mass and of OM over error of RM, on {where}; a dot per participant, the bar "
        "their geometric mean.",
        "Dots: error ratios per component.",
        "left of 1 follows better. What RM+mass gains is one number's doing, no gain of "
        "identification.",
        "use OM only where its dots lie left of those of RM+mass.",
        data.reset_index(),
    )
    yield Grid(
        ("component", RM_MASS, OM, "OM better", "RM or RM+mass better", "the same", "all"),
        tuple(_row(name, ratios) for name in names),
        f"Change of the error from RM. The same: within {percent(SAME_WITHIN)} %.",
        groups=(("", 1), ("typical change [%]", 2), ("number of participants", 4)),
    )


def _one_number(ratios: Ratios) -> Iterator[Block]:
    """What one number for the whole mass does without identification."""
    name = "grf_vertical"
    if name in ratios.of_component:
        rm_mass, om = (_typical(ratios.over_rm(name, method)) for method in (RM_MASS, OM))
        if np.isfinite(rm_mass):
            over = (1 + om) / (1 + rm_mass) - 1
            yield Paragraph(one_number_alone(component_label(name), rm_mass, om, over))


def _typical(ratios: np.ndarray) -> float:
    """Relative change of the errors, their geometric mean; NaN without any."""
    known = ratios[np.isfinite(ratios)]
    return float(np.exp(np.log(known).mean())) - 1.0 if len(known) else float("nan")


def _counts(ratios: np.ndarray) -> tuple[int, int, int]:
    """In how many participants OM is better, in how many worse, and of how many."""
    better, worse = int((ratios < 1 - SAME_WITHIN).sum()), int((ratios > 1 + SAME_WITHIN).sum())
    return better, worse, int(np.isfinite(ratios).sum())


def _is_worse(ratios: np.ndarray) -> bool:
    better, worse, _ = _counts(ratios)
    return _typical(ratios) > 0.0 or worse > better


def _row(component: str, ratios: Ratios) -> tuple[str, ...]:
    better, worse, everyone = _counts(ratios.over_rival(component))
    return (
        component_label(component),
        *(signed(100.0 * _typical(ratios.over_rm(component, m))) for m in (RM_MASS, OM)),
        str(better),
        str(worse),
        str(everyone - better - worse),
        str(everyone),
    )
