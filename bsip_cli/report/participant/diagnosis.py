"""Section 2: what the simulation gets wrong, of which causes, and what could not be seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import (
    Block,
    Cell,
    Grid,
    Heading,
    Mark,
    Numbered,
    Paragraph,
    Picture,
    Section,
    Tone,
)
from bsip_cli.report.budget import (
    FIRST,
    LEAST_TOLD_SIZE,
    pieces,
    segment_shares,
    size_of,
    trials_of,
)
from bsip_cli.report.candidates import Candidate, candidates_of
from bsip_cli.report.figures.candidate_gains import CandidateGains, candidate_gains
from bsip_cli.report.figures.error_bars import Bar, error_bars
from bsip_cli.report.participant import detection, residual
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.verdict import (
    change_sentence,
    probability_words,
    put_right_sentence,
    verdict_of,
    worth_telling,
)
from bsip_cli.report.words import (
    MISSING,
    capital,
    component_label,
    labelled,
    number,
    segment_label,
    signed,
)
from bsip_cli.statistics.methods import OM

NOT_RUN = "The recordings were not searched for errors: run `bsip diagnose`."
_MOST_IN_FIGURE = 12
_LEAST_GAIN = 0.05  # percent: less prints as none


def verdict(record: ParticipantRecord) -> list[Block]:
    """What stands on the first screen."""
    if record.diagnosis is None or record.detection is None:
        return [Paragraph(NOT_RUN, "note")]
    tables = (record.diagnosis, record.detection, record.gains, record.changes)
    said = verdict_of(*tables, record.budget)
    tone: Tone = "warning" if said.found or record.diagnosis.empty else "good"
    blocks: list[Block] = [Paragraph(said.headline, tone)]
    if said.causes:
        blocks.append(Numbered(said.causes))
    rest = (*put_right(record), *said.results, *said.advice, said.limits)
    return [*blocks, *budget_bars(record), *(Paragraph(text) for text in rest if text)]


def budget_bars(record: ParticipantRecord) -> list[Block]:
    """What makes RM's error, trial by trial."""
    budget = record.budget
    if budget is None or budget.empty:
        return []
    bars = []
    for stem, label in trials_of(budget):
        for component in FIRST:
            size, unit = size_of(budget, stem, component)
            if size >= LEAST_TOLD_SIZE:
                parts = tuple((p.label, p.share) for p in pieces(budget, stem, component))
                name = f"{label}: {component_label(component)}, {number(size, 1)} {unit}"
                bars.append(Bar(name, parts))
    caption = (
        "What makes the error of the table's parameters (RM), and how large it is. Each colour is "
        "something that a simulation gets wrong; what stands left of zero makes the error smaller "
        "where it is. Hatched: what nothing explains. Good: little is hatched, and the error is "
        "small. Much that is hatched in a large error: something is wrong that has no name here; "
        "look at the recording. A large part of the table's parameters: identified ones (OM) help."
    )
    text = "Bars: shares of the squared error by cause."
    return [Picture(error_bars(bars), caption, text, "error_budget")]


def put_right(record: ParticipantRecord) -> tuple[str, ...]:
    """What of the markers was wrong and is no longer, before anything was diagnosed."""
    tables = [(trial.stem, trial.marker_events) for trial in record.trials]
    return put_right_sentence([(stem, t) for stem, t in tables if t is not None])


def section(record: ParticipantRecord) -> Section:
    odds = f"{record.option('diagnosis', 'fault_prior_odds', 0.1):g}"
    named_from = f"{100 * record.option('diagnosis', 'named_from', 0.95):g}"
    blocks: list[Block] = [
        Paragraph(
            "One statistical model explains the difference between measured and simulated ground "
            "forces: by noise, by ordinary errors of ordinary size (segment parameters, joint "
            "centres, markers, smoothing), and by causes from a catalogue of faults of plates, "
            "clocks, markers and model. Causes join it one after the other, the most probable "
            f"first, while one more is more probable than none. Before the data its odds are {odds} "
            "to 1, spread evenly over the catalogue; the recordings decide the rest. Where "
            "nearly every cause seems to explain something of a recording, that recording counts "
            f"for less. A single name is said from a probability of {named_from} % on, else "
            "the smallest group of names that holds as much; what is less probable is not told."
        )
    ]
    if record.diagnosis is None or record.detection is None:
        blocks.append(Paragraph(NOT_RUN, "note"))
    else:
        blocks += [
            Heading("The causes found, and those that came nearest"),
            *ranking(candidates_of(record.diagnosis)),
        ]
        if record.gains is not None and len(record.gains):
            blocks += [Heading("What the forces gain"), *gain_blocks(record.gains)]
        if record.changes is not None and len(record.changes):
            blocks += [Heading("What the body's parameters become"), *change_blocks(record)]
        blocks += [
            Heading("What might have gone unseen"),
            *detection.blocks(record.detection, record.diagnosis, named_from),
        ]
    blocks += [*residual.blocks(record), *_segments(record)]
    return Section("diagnosis", "What the simulation gets wrong", tuple(blocks))


def _segments(record: ParticipantRecord) -> list[Block]:
    """Which segments of the table make RM's error."""
    if record.budget is None or record.budget.empty:
        return []
    return [
        Heading("Which segments of the table are wrong"),
        Paragraph(
            "The part of RM's squared error that goes with the mass, centre of mass and inertia of "
            "each segment. Neighbours can take each other's part, and a share below zero makes the "
            "error larger where it is; all segments together are the table's part of the budget."
        ),
        Grid(
            ("component", "largest shares of RM's squared error, with 95 % interval"),
            tuple(segment_shares(record.budget)),
            "Segments whose parameters make RM's error, all trials together",
            words=2,
        ),
    ]


# --- ranking ------------------------------------------------------------------------------------


def ranking(candidates: Sequence[Candidate]) -> list[Block]:
    """The candidates as a figure and in words."""
    if not candidates:
        return [Paragraph("No cause of the catalogue came near.")]
    numbered = list(enumerate(candidates, start=1))
    known = [(k, one) for k, one in numbered if np.isfinite(one.gain[0])][:_MOST_IN_FIGURE]
    blocks: list[Block] = []
    if known:
        gain, low, high = np.array([one.gain for _, one in known]).T
        figure = candidate_gains(
            CandidateGains(
                tuple(_numbered(k, one) for k, one in known),
                tuple(one.answer for _, one in known),
                gain,
                low,
                high,
            )
        )
        caption = (
            "How much of the squared difference between measured and simulated forces (in units of "
            "its noise) each cause that was found removes, given all others, in seconds that it was "
            "not fitted to, with 95 % interval. An interval that reaches below zero may be no gain "
            "at all; an arrow: it runs on. Letters in brackets: a group of which one is there; only "
            "the member that is in the model has a gain."
        )
        blocks.append(Picture(figure, caption, "Dots: gain of each cause.", "diagnosis_causes"))
    rows = tuple(_row(k, one) for k, one in numbered)
    head = (
        "cause",
        "verdict",
        "in words",
        "recordings",
        "scope",
        "probability",
        "changes [N or N m]",
        "removes [%]",
    )
    caption = (
        "Causes that were found or came nearest. Scope: everybody recorded in the laboratory, this "
        "person always, or single trials. Probability: that it is there, given all else that was "
        "found. Changes: root mean square of what it does to the force or moment that it changes "
        "most. Removes: of the squared difference in unseen seconds, with 95 % interval"
    )
    return [*blocks, Grid(head, rows, caption, words=5)]


def _numbered(k: int, one: Candidate) -> str:
    return f"{k}. {f'({one.class_id}) ' if one.class_id else ''}{one.label}"


def _row(k: int, one: Candidate) -> tuple[str | Cell, ...]:
    marks: dict[str, Mark] = {"named": "group", "ambiguous": "warning"}
    answers = {
        "ambiguous": f"one of group {one.class_id}",
        "unnamed": "found, without a name",
        "rejected": "not sure" if one.probability >= 0.5 else "not so",
    }
    return (
        _numbered(k, one),
        Cell(answers.get(one.answer, one.answer), marks.get(one.verdict, "")),
        capital(one.told()),
        one.where(),
        one.scope or MISSING,
        probability_words(one.probability) or MISSING,
        number(one.rms_change, 1),
        one.removes(),
    )


# --- gains --------------------------------------------------------------------------------------


def gain_blocks(gains: pd.DataFrame) -> list[Block]:
    """A ``gain`` table with rows: errors before and after the causes are in the model."""
    rows = tuple(
        (
            component_label(r["component"]),
            r["unit"],
            number(r["rmse_before"], 2),
            Cell(number(r["rmse_after"], 2), "better" if r["ci_low"] >= _LEAST_GAIN else ""),
            f"{_whole(r['gain_percent'])} ({_whole(r['ci_low'])} to {_whole(r['ci_high'])})",
        )
        for r in gains.to_dict("records")
    )
    return [
        Paragraph(_data_words(gains)),
        Grid(
            ("component", "unit", "before", "after", "less by [%]"),
            rows,
            "Error of OM before and after the causes are in the model; ✓ marks a sure gain",
            words=2,
            groups=(("", 2), ("RMSE", 2), ("95 % interval", 1)),
        ),
    ]


def _whole(percent: float) -> str:
    """Without decimals, but where only these tell it from zero."""
    return number(percent, 0 if abs(percent) >= 1 else 1)


def _data_words(gains: pd.DataFrame) -> str:
    """On which recordings, from ``held_out: a, b; identification: c``."""
    kinds = {
        "held_out": "seconds that identified no parameter",
        "identification": "seconds that identified the parameters too",
    }
    parts = [text.partition(": ") for data in gains["data"].unique() for text in data.split("; ")]
    said = [f"{labelled(stems)} ({kinds.get(kind, kind)})" for kind, _, stems in parts]
    return (
        "Every second was judged with sizes of the causes that were found without it, in "
        f"{'; '.join(dict.fromkeys(said))}."
    )


def change_blocks(record: ParticipantRecord) -> list[Block]:
    """Masses and centres of mass before and after the causes are in the model."""
    assert record.changes is not None
    worth = worth_telling(record.changes)
    if worth.empty:
        return [Paragraph(change_sentence(record.changes))]
    before = record.method(OM)
    rows = tuple(
        (
            segment_label(r["segment"]),
            number(before["mass_kg"].get(r["segment"]), 3),
            number(before["mass_kg"].get(r["segment"], np.nan) + r["mass_change_kg"], 3),
            signed(r["mass_change_kg"], 3),
            number(1000 * r["com_change_m"], 1),
        )
        for r in worth.to_dict("records")
    )
    head = ("segment", "OM", "with the causes", "change", "centre of mass moves [mm]")
    return [
        Grid(
            head,
            rows,
            "The identified parameters without and with the causes in the model, segments that "
            "change",
            groups=(("", 1), ("mass [kg]", 3), ("", 1)),
        )
    ]
