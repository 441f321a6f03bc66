"""Section 7: what to mind, warnings, options and versions."""

from __future__ import annotations

from bsip_cli.report.blocks import Block, Bullets, Heading, Paragraph, Picture, Section
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.figures.workflow import workflow
from bsip_cli.report.origins import options_grids

_MIND = (
    "The masses of table 1 come from the identified combinations and a rule that splits them, "
    "nearness to the regression. Read them with the data shares in each participant's report.",
    "Tests compare participants, never frames: frames of a recording are not independent.",
    "Errors on trials that identified the parameters favour OM. Only held-out data tell which "
    "method predicts better.",
)


def section(record: CohortRecord) -> Section:
    warned: Block = (
        Bullets(
            tuple(
                f"{stage}{f' ({unit})' if unit else ''}: {text}"
                for stage, unit, text in record.made.messages
            ),
            "warning",
        )
        if record.made.messages
        else Paragraph("No stage had anything to warn of.")
    )
    return Section(
        "limits",
        "Limits, warnings, options",
        (
            Bullets(_MIND),
            Heading("Warnings"),
            warned,
            Heading("How the numbers were made"),
            _way(record),
            *options_grids(record.made),
        ),
    )


def _way(record: CohortRecord) -> Block:
    return Picture(
        workflow(record.steps),
        "The way of the data: each stage with those whose results it needs.",
        f"Flow chart of the stages: {', '.join(step.name for step in record.steps)}.",
        "fig2_workflow",
    )
