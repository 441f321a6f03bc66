"""The first page of a person's report: who, is anything wrong, how large, what to use and to do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bsip_cli.report import blocks, verdict
from bsip_cli.report.candidates import OF_THE_WEIGHT, analysed, effects_in, is_large
from bsip_cli.report.effect_words import separating_recording
from bsip_cli.report.errors import (
    COP_LIMIT_M,
    ENDS_AT,
    FORCE_LIMIT_PERCENT,
    MARKERS,
    SOURCES,
    Yardstick,
    errors_of,
    overall_pieces,
    use_sentence,
    yardsticks,
)
from bsip_cli.report.records import ParticipantRecord, TrialRecord
from bsip_cli.report.words import METHODS, TEXTS, abbreviations, capital, count, listing, number

if TYPE_CHECKING:
    from bsip_cli.report.figures.person import Pose

_SEXES = {"M": "man", "F": "woman"}
_MOST = 2  # causes, and things to do
_POSES = 8  # among which the one is chosen that is shown
_SIGNS = "✓ fine; ▲ something found; ■ large error; ? inconclusive."


def front(record: ParticipantRecord) -> tuple[blocks.Block, ...]:
    """The blocks of the first page, in the order in which a reader asks."""
    light = light_for(record)
    return (
        *portrait(record),
        blocks.Terms((*who(record),)),
        blocks.Heading("Is anything wrong?"),
        replace(light, text="") if record.causes and large_errors(record) else light,
        blocks.Paragraph(_SIGNS, "note"),
        *_causes(record),
        *budget_bar(record),
        blocks.Heading("How large are the errors?"),
        blocks.Scales(tuple(yardstick.scale(value) for yardstick, value in measured_of(record))),
        blocks.Paragraph(
            f"Root mean square (RMS), with {METHODS[record.use()]}. Scales end at "
            f"{ENDS_AT:g} × large. {SOURCES}",
            "note",
        ),
        *_sure(record, light),
        blocks.Heading("Which parameters to use"),
        blocks.Paragraph(
            use_sentence(record.choice, record.identification, light.state == "large")
        ),
        blocks.Heading("What to do next"),
        blocks.Bullets(tuple(to_do(record, light))),
    )


def light_for(record: ParticipantRecord) -> blocks.Light:
    """The answer, as `bsip show` prints it too."""
    large = large_errors(record)
    return verdict.light_of(record.diagnosis, record.detection, record.budget, large, record.use())


def large_errors(record: ParticipantRecord) -> list[str]:
    """The yardsticks beyond which the errors are."""
    return [
        f"{one.in_sentence().removesuffix(' error')} {number(value)} {one.unit}"
        for one, value in measured_of(record)
        if one.words(value) == "large"
    ]


def who(record: ParticipantRecord) -> Iterator[tuple[str, str]]:
    """Names and what is known: the person, the recordings, the software."""
    facts = record.facts
    mass, plates = float(facts["mass_kg"]), float(facts["plate_mass_kg"])
    person = f"{_SEXES.get(facts['sex'], 'sex not stated')}, {number(mass, 1)} kg ({facts['mass_source']}"
    if np.isfinite(plates) and number(plates, 1) != number(mass, 1):
        person += f"; the plates say {number(plates, 1)} kg"
    yield "Person", f"{record.id}, {person}), {number(facts['height_m'], 2)} m"
    names = [trial.task for trial in record.trials]
    times = {name: names.count(name) for name in names}
    tasks = [name if n == 1 else f"{n} × {name}" for name, n in times.items()]
    dates = sorted(trial.file_date for trial in record.trials if trial.file_date)
    saved = f"; files saved {' to '.join(dict.fromkeys((dates[0], dates[-1])))}" if dates else ""
    short = abbreviations(names)
    yield "Recordings", f"{listing(tasks)}{f' ({short})' if short else ''}{saved}"
    used = listing([trial.label for trial in record.identification_trials()])
    yield "Identified from", used
    versions = dict.fromkeys(origin.bsip_version for origin in record.origins)
    yield "Software", f"bsip {', '.join(versions)}"
    for name in ("mass", "height"):
        if note := str(record.facts[f"{name}_note"]):
            yield capital(name), f"{capital(note)}."


# --- the person ---------------------------------------------------------------------------------


def portrait(record: ParticipantRecord) -> tuple[blocks.Block, ...]:
    """The widest pose of the trials with a measured force; nothing without any pose."""
    found = [(trial, pose) for trial in record.trials for pose in _poses(record, trial)]
    if not found:
        return ()
    loaded = [one for one in found if one[1].is_loaded()] or found
    trial, pose = max(loaded, key=lambda one: one[1].reach_m())
    from bsip_cli.report.figures.person import stick_figure

    shows = f"{trial.label}: left grey, right black, ground force green"
    figure = stick_figure(pose, trial.label)
    return (blocks.Portrait(figure, "person", shows, f"Stick figure. {shows}."),)


def _poses(record: ParticipantRecord, trial: TrialRecord) -> tuple[Pose, ...]:
    from bsip_cli.report.figures.person import poses_of

    if trial.kinematics is None:
        return ()
    anterior = record.facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    measured = trial.kinematics, trial.reconstruction
    return poses_of(record.body, *measured, anterior, record.body_weight(), _POSES)


# --- is anything wrong --------------------------------------------------------------------------


def _causes(record: ParticipantRecord) -> Iterator[blocks.Block]:
    """A line per cause that was found, the most probable first."""
    if record.diagnosis is None or record.detection is None:
        return
    everywhere = analysed(record.detection, record.diagnosis)
    lines = tuple(verdict.cause_line(cause, everywhere) for cause in record.causes)
    if lines:
        yield blocks.Numbered(lines[:_MOST])
    if len(lines) > _MOST:
        more = f"{count(len(lines) - _MOST, 'more finding')} below"
        yield blocks.Links("", ((more, f"#{verdict.ALL_FAULTS}"),))


def _sure(record: ParticipantRecord, light: blocks.Light) -> Iterator[blocks.Block]:
    """Of the error, of what was found, of what might have been missed; nothing where no search was
    made."""
    if record.diagnosis is None or record.detection is None:
        return
    said = []
    if light.state == "large":
        unknown = ", its cause is not known" if verdict.CAUSE_UNKNOWN in light.title else ""
        said.append(f"That the error is large is certain{unknown}.")
    if any(not is_large(cause) for cause in record.causes):
        said.append("Each fault states its own probability.")
    elif light.state != "large":
        said.append("No fault is more probable than not.")
    yield blocks.Heading("How sure is this?")
    yield blocks.Paragraph(
        " ".join((*said, verdict.unseen(record.detection, record.diagnosis))).rstrip()
    )


def budget_bar(record: ParticipantRecord) -> Iterator[blocks.Block]:
    """What makes the error of the table's parameters, as one bar."""
    if record.budget is None:
        return
    if pieces := overall_pieces(record.budget, effects_in(record.causes)):
        yield blocks.Bar(
            "What makes the squared error of the forces with a table's parameters (RM)", pieces
        )


# --- how large ----------------------------------------------------------------------------------


def measured_of(record: ParticipantRecord) -> tuple[tuple[Yardstick, float], ...]:
    """The three yardsticks with this person's numbers, by the method that is to be used."""
    fits = [trial.fit for trial in record.moving_trials() if trial.fit is not None]
    values = errors_of(fits, record.use()) | {MARKERS: 1e3 * float(record.facts["marker_rms_m"])}
    limits = (record.option("diagnosis", name) for name in (COP_LIMIT_M, FORCE_LIMIT_PERCENT))
    return tuple((one, values[one.name]) for one in yardsticks(*limits))


# --- what to do ---------------------------------------------------------------------------------


def to_do(record: ParticipantRecord, light: blocks.Light) -> list[str]:
    """Whether the data may be used, and at most two things to do."""
    causes = record.causes
    said = [f"{refusal.unit or record.id}: {refusal.sentence}" for refusal in record.refusals[:1]]
    said = [TEXTS["usable"][light.state], *said]
    said += verdict.consequences(causes[:_MOST], only_actions=True)
    groups = [(k, cause) for k, cause in enumerate(causes[:_MOST], start=1) if len(cause) > 1]
    for k, cause in groups[:1]:
        members = [(one.effect, one.target) for one in cause]
        on_scale = cause[0].class_id == OF_THE_WEIGHT
        step = "weigh the person on a scale" if on_scale else separating_recording(members, most=1)
        said.append(f"To learn the cause of finding {k}, {step}.")
    large = [one for one, value in measured_of(record) if one.words(value) == "large"]
    if light.state == "inconclusive" and not large:
        said.append(TEXTS["to_do"]["contacts"])
    said += [text for one in large[:1] if (text := _where_large(record, one))]
    if len(said) == 1 and len(rows := record.excitation.query("quantity == 'next'")):
        text = rows["text"].iloc[0]
        said.append(f"Optional, to know the parameters better, record: {text}.")
    return said[: _MOST + 1]


def _where_large(record: ParticipantRecord, yardstick: Yardstick) -> str:
    """Where to look for what makes an error large; empty where no recording has it."""
    if yardstick.name == MARKERS:
        return str(TEXTS["to_do"]["markers"])
    fits = {t.label: t.fit for t in record.moving_trials() if t.fit is not None}
    sizes = {label: errors_of([fit], record.use())[yardstick.name] for label, fit in fits.items()}
    known = {label: size for label, size in sizes.items() if np.isfinite(size)}
    if not known:
        return ""
    worst = max(known, key=known.__getitem__)
    return str(TEXTS["to_do"]["forces"]).format(trial=worst, error=yardstick.in_sentence())
