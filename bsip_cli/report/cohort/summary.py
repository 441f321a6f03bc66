"""Section 1: what came out, in words."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.blocks import Block, Bullets, Grid, Heading, Paragraph, Section
from bsip_cli.report.cohort import diagnoses
from bsip_cli.report.cohort.ratios import Ratios
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.gains import one_number_alone
from bsip_cli.report.words import (
    component_label,
    count,
    listing,
    percent,
    signed,
)
from bsip_cli.statistics.methods import OM, RM_MASS, SAME_WITHIN


def section(record: CohortRecord) -> Section:
    done = [m for m in record.members if m.facts is not None and m.identification is not None]
    blocks: list[Block] = [
        Paragraph(
            f"{len(done)} of {count(len(record.members), 'participant')} of the study have "
            "identified parameters."
        ),
        *_missing(record),
        Heading("Is anything wrong in the recordings?"),
        diagnoses.verdict(record),
        Heading("Do the identified parameters follow the forces better?"),
        *_gain(record),
    ]
    return Section("summary", "Summary", tuple(blocks))


def _missing(record: CohortRecord) -> list[Block]:
    sentences = list(record.missing)
    for member in record.members:
        sentences += [
            f"{', '.join(filter(None, (member.id, r.unit)))}, {r.stage} refused: {r.sentence}"
            for r in member.refusals
        ]
        if member.identification is None and not any(member.id in s for s in sentences):
            sentences.append(f"{member.id} has no identified parameters; no refusal says why.")
    if not sentences:
        return [Paragraph("Nobody is missing from the tables.")]
    return [
        Paragraph("Who is missing, and why:"),
        Bullets(tuple(dict.fromkeys(sentences)), "warning"),
    ]


def _gain(record: CohortRecord) -> list[Block]:
    held_out = record.ratios.held_out
    rows = [_row(component, record.ratios) for component in record.ratios.of_component]
    if not rows:
        return [Paragraph("No trial could be compared with both methods.", "warning")]
    blocks: list[Block] = []
    if not held_out:
        blocks.append(
            Paragraph(
                "Nobody has held-out data: these numbers are from the data that "
                "identified the parameters, and favour OM.",
                "warning",
            )
        )
    worse = [
        component_label(component)
        for component in record.ratios.of_component
        if _is_worse(record.ratios.over_rival(component))
    ]
    blocks.append(
        Paragraph(
            "RM or RM+mass follows better on the whole, or in more participants, in: "
            f"{listing(worse)}.",
            "warning",
        )
        if worse
        else Paragraph(
            "OM follows better than RM and RM+mass in every component, by the typical change and in "
            "the number of participants. Of the centre of pressure and the vertical force, tests with Holm's "
            "correction say what could be chance: under table 4.",
            "good",
        )
    )
    blocks += _one_number(record.ratios)
    blocks.append(
        Grid(
            ("component", RM_MASS, OM, "OM better", "RM or RM+mass better", "the same", "all"),
            tuple(rows),
            "Change of the mean error (RMSE) from RM, "
            + ("held-out data" if held_out else "identification data"),
            groups=(("", 1), ("typical change [%]", 2), ("number of participants", 4)),
        )
    )
    blocks.append(
        Paragraph(
            "Typical: the geometric mean of the participants' error ratios. The same: within "
            f"{percent(SAME_WITHIN)} %. Tests stand in the papers' tables.",
            "note",
        )
    )
    return blocks


def _one_number(ratios: Ratios) -> list[Block]:
    """What one number for the whole mass does without identification."""
    name = "grf_vertical"
    if name not in ratios.of_component:
        return []
    rm_mass, om = (_typical(ratios.over_rm(name, method)) for method in (RM_MASS, OM))
    if not np.isfinite(rm_mass):
        return []
    said = one_number_alone(component_label(name), rm_mass, om, (1 + om) / (1 + rm_mass) - 1)
    return [Paragraph(f"{said} (Geometric means over the participants.)")]


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
