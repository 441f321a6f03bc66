"""Section 2: what the simulation gets wrong, of which causes, and what could not be seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from bsip_cli.body.names import SEGMENTS
from bsip_cli.report.blocks import (
    Block,
    Cell,
    Grid,
    Heading,
    Mark,
    Paragraph,
    Picture,
    Section,
    Tone,
)
from bsip_cli.report.diagnosis import (
    Candidate,
    Limit,
    candidates_of,
    causes_of,
    limits_of,
    limits_sentence,
    verdict_words,
)
from bsip_cli.report.effect_words import effect_title, place_label
from bsip_cli.report.figures.candidate_gains import CandidateGains, candidate_gains
from bsip_cli.report.figures.mass_limits import MassLimits, mass_limits
from bsip_cli.report.participant import attribution, residual
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import (
    MISSING,
    component_label,
    labelled,
    number,
    percent,
    segment_label,
)

NOT_RUN = "The recordings were not searched for errors: run `bsip diagnose`."
_MOST_IN_FIGURE = 12
_WHOLE_LAB = (  # causes whose limits fit into one table
    "sync_offset",
    "clock_drift",
    "plate_translation",
    "plate_rotation",
    "plate_gain",
    "plate_crosstalk",
    "plate_zero",
    "plate_drift",
    "gravity_tilt",
    "released_object",
    "wobbling_mass",
    "breathing",
    "unmeasured_contact",
    "marker_shift",
)


def verdict(record: ParticipantRecord) -> list[Block]:
    """What stands on the first screen."""
    if record.diagnosis is None or record.detection is None:
        return [Paragraph(NOT_RUN, "note")]
    said = verdict_words(record.diagnosis, record.detection, record.gains)
    found = bool(causes_of(candidates_of(record.diagnosis)))
    tone: Tone = "warning" if found or record.diagnosis.empty else "good"
    return [Paragraph(said[0], tone), *(Paragraph(text) for text in said[1:])]


def section(record: ParticipantRecord) -> Section:
    blocks: list[Block] = [
        Paragraph(
            "The simulated ground forces are compared with the measured ones, and every known cause "
            "of a difference is tried: errors of the plates, the clocks, the markers and the model. "
            "A cause is named only if chance would rarely bring as much (family-wise 5 %) and if it "
            "helps on data that it was not fitted to. Causes that look alike in these recordings "
            "are named together."
        )
    ]
    if record.diagnosis is None or record.detection is None:
        blocks.append(Paragraph(NOT_RUN, "note"))
    else:
        candidates = candidates_of(record.diagnosis)
        limits = limits_of(record.detection, record.diagnosis)
        blocks += [Heading("The causes looked at"), *ranking(candidates)]
        if record.gains is not None:
            blocks += [Heading("What the result gains"), *gain_blocks(record.gains)]
        blocks += [Heading("What could not have been seen"), *detection(limits)]
    blocks += [*residual.blocks(record), *attribution.blocks(record)]
    return Section("diagnosis", "What the simulation gets wrong", tuple(blocks))


# --- ranking ------------------------------------------------------------------------------------


def ranking(candidates: Sequence[Candidate]) -> list[Block]:
    """The candidates as a figure and in words."""
    if not candidates:
        return [Paragraph("No cause came near to explaining anything.")]
    known = [one for one in candidates if np.isfinite(one.gain[0])][:_MOST_IN_FIGURE]
    blocks: list[Block] = []
    if known:
        gain, low, high = np.array([one.gain for one in known]).T
        figure = candidate_gains(
            CandidateGains(
                tuple(_numbered(k, one) for k, one in enumerate(known, start=1)),
                tuple(one.verdict for one in known),
                gain,
                low,
                high,
            )
        )
        caption = (
            "The candidates that were fitted in full, in the order of the diagnosis. How much of "
            "the squared (whitened) residual each removes from data held out; an interval that "
            "reaches below zero may be no gain at all. Arrows: the interval runs on."
        )
        blocks.append(Picture(figure, caption, "Dots: gain of each cause.", "diagnosis_causes"))
    rows = tuple(_row(k, one) for k, one in enumerate(candidates, start=1))
    head = ("cause", "verdict", "in words", "in", "chance [%]", "gain [%]")
    return [*blocks, Grid(head, rows, "Causes looked at, gain with 95 % interval", words=4)]


def _numbered(k: int, one: Candidate) -> str:
    return f"{k}. {one.label}"


def _row(k: int, one: Candidate) -> tuple[str | Cell, ...]:
    marks: dict[str, Mark] = {"named": "group", "ambiguous": "warning"}
    verdict = f"rival, class {one.class_id}" if one.verdict == "ambiguous" else one.verdict
    gain, low, high = one.gain
    reason = one.why_not()
    return (
        _numbered(k, one),
        Cell(verdict, marks.get(one.verdict, "")),
        f"{one.what()}; rejected: {reason}" if reason else one.what(),
        one.where(),
        percent(one.p_value, 1),
        f"{number(gain, 1)} ({number(low, 1)} to {number(high, 1)})",
    )


# --- gains --------------------------------------------------------------------------------------


def gain_blocks(gains: pd.DataFrame) -> list[Block]:
    """A ``gain`` table: errors before and after the causes are in the model."""
    if gains.empty:
        return [Paragraph("No cause was added to the model, so nothing was gained.")]
    rows = tuple(
        (
            component_label(r["component"]),
            r["method"],
            r["unit"],
            number(r["rmse_before"], 2),
            Cell(number(r["rmse_after"], 2), "better" if r["ci_low"] > 0 else ""),
            f"{number(r['gain_percent'], 0)} ({number(r['ci_low'], 0)} to {number(r['ci_high'], 0)})",
        )
        for r in gains.to_dict("records")
    )
    data = "; ".join(labelled(text).replace("_", " ") for text in gains["data"].unique())
    head = ("component", "method", "unit", "before", "after", "gain [%]")
    return [
        Grid(
            head,
            rows,
            f"Error (RMSE) without and with the causes in the model; data — {data}",
            words=3,
            groups=(("", 3), ("RMSE", 2), ("", 1)),
        )
    ]


# --- detection limits ---------------------------------------------------------------------------


def detection(limits: Sequence[Limit]) -> list[Block]:
    """What these very recordings could not have shown, in words, a figure and a table."""
    if not limits:
        return [Paragraph("The limits of detection are not known.", "note")]
    sentence = limits_sentence(limits)
    blocks: list[Block] = [Paragraph(sentence)] if sentence else []
    blocks.append(
        Paragraph(
            "Each limit is the size that would be found in 95 of 100 recordings like these, while "
            "the inertial parameters and the cause's other numbers stay free. Smaller errors may be "
            "there. Causes that were found have no limit.",
            "note",
        )
    )
    masses = {
        x.target: x.size for x in limits if x.effect == "added_mass" and x.parameter == "mass"
    }
    shown = [segment for segment in SEGMENTS if segment in masses]
    if shown:
        figure = mass_limits(
            MassLimits(tuple(segment_label(s) for s in shown), np.array([masses[s] for s in shown]))
        )
        caption = (
            "How heavy something unknown on a segment must be, wherever on it, to be told from the "
            "segment's own uncertain parameters."
        )
        blocks.append(Picture(figure, caption, "Dots: least mass.", "diagnosis_masses"))
    rows = tuple(row for effect in _WHOLE_LAB for row in _limit_rows(effect, limits))
    if rows:
        head = ("cause", "found from", "where it shows best", "recordings")
        blocks.append(Grid(head, rows, "Least size that would be found", words=3))
    return blocks


def _limit_rows(effect: str, limits: Sequence[Limit]) -> Iterator[tuple[str, ...]]:
    """A row per unit: the range over all places and directions."""
    of_it = [x for x in limits if x.effect == effect]
    for unit in dict.fromkeys(x.unit for x in of_it):
        sizes = sorted((x for x in of_it if x.unit == unit), key=lambda x: x.size)
        least, most = sizes[0], sizes[-1]
        words = [least.in_words(), most.in_words()]
        yield (
            effect_title(effect),
            words[0] if words[0] == words[1] else " to ".join(words),
            place_label(effect, least.target) if len({x.target for x in sizes}) > 1 else MISSING,
            "together" if least.trials > 1 else "the best alone",
        )
