"""The first page of a person's report: who, is anything wrong, how large, what to use and to do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bsip_cli.report import blocks, verdict
from bsip_cli.report.candidates import OF_THE_WEIGHT, Candidate, analysed, effects_in
from bsip_cli.report.effect_words import effect_title, separating_recording
from bsip_cli.report.errors import MARKERS, SOURCES, overall_pieces, use_sentence
from bsip_cli.report.participant.errors import all_peaks, moment_change
from bsip_cli.report.recordings import (
    beyond,
    is_said,
    large_alone,
    large_finding,
    light_for,
    measured_of,
    must_wait,
    names_of,
    number_of_main_part,
    use_lines,
    worst_of,
)
from bsip_cli.report.records import HowMade, ParticipantRecord, TrialRecord
from bsip_cli.report.words import METHODS, TEXTS, abbreviations, capital, count, listing, number
from bsip_cli.statistics.methods import RM

if TYPE_CHECKING:
    from bsip_cli.report.figures.person import Pose

_SEXES = {"M": "man", "F": "woman"}
_MOST = 2  # findings in full
_FEW = 3  # findings, whose actions are all given
_MOST_KINDS = 4  # of findings that are named only
_MOST_TO_DO = 3
_POSES = 8  # among which the one is chosen that is shown


def front(record: ParticipantRecord) -> tuple[blocks.Block, ...]:
    """The blocks of the first page, in the order in which a reader asks."""
    light = light_for(record)
    has_findings = record.causes or large_finding(record)
    return (
        *portrait(record),
        blocks.Terms((*who(record),)),
        blocks.Heading("Is anything wrong?"),
        replace(light, text="") if has_findings and light.state == "large" else light,
        *_causes(record),
        *_sizes(record),
        *_sure(record, light),
        blocks.Heading("What may be used?"),
        blocks.Bullets(tuple(use_lines(record))),
        blocks.Paragraph(
            use_sentence(record.choice, record.identification, must_wait(record), is_known=True)
        ),
        blocks.Heading("What to do next"),
        blocks.Bullets(tuple(to_do(record, light))),
    )


def who(record: ParticipantRecord) -> Iterator[tuple[str, str]]:
    """Names and what is known: the person, the recordings, the software."""
    facts = record.facts
    mass, plates = float(facts["mass_kg"]), float(facts["plate_mass_kg"])
    sex = f"{_SEXES[facts['sex']]}, " if facts["sex"] in _SEXES else ""
    person = f"{sex}{number(mass, 1)} kg ({facts['mass_source']}"
    if np.isfinite(plates) and number(plates, 1) != number(mass, 1):
        person += f"; the plates say {number(plates, 1)} kg"
    yield "Person", f"{record.id}, {person}), {number(facts['height_m'], 2)} m"
    names = [trial.task for trial in record.trials]
    times = {name: names.count(name) for name in names}
    tasks = [name if n == 1 else f"{n} × {name}" for name, n in times.items()]
    short = abbreviations(names)
    stems = tuple(f"{trial.stem}." for trial in record.trials)
    files = sum(name.startswith(stems) for name in HowMade.of(record.origins).files)
    said = [*([short] if short else []), count(files, "file")]
    yield "Recordings", f"{listing(tasks)} ({'; '.join(said)})"
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
    """A line per finding, the most important first; of those that have no room what they are."""
    if record.diagnosis is None or record.detection is None:
        return
    everywhere = analysed(record.detection, record.diagnosis)
    peaks, large = all_peaks(record.trials), large_finding(record)
    shown = _causes_shown(record)
    lines = [
        verdict.cause_line(cause, everywhere, moment_change(cause, record.causes, peaks))
        for cause in shown
    ]
    if large or lines:
        yield blocks.Numbered((*large, *lines))
    if more := record.causes[len(shown) :]:
        address = (("More below", f"#{verdict.ALL_FAULTS}"),)
        first = 1 + len(large) + len(shown)
        yield blocks.Links("", address, f". {'; '.join(_in_brief(more, first))}.")


def _in_brief(causes: Sequence[Sequence[Candidate]], first: int) -> Iterator[str]:
    """``3 and 5: marker not in its place``; findings of which one may be the other count together."""
    groups: list[tuple[list[int], list[str]]] = []
    for k, cause in enumerate(causes, first):
        titles = [effect_title(one.effect) for one in cause]
        mine = [group for group in groups if {*group[1]} & {*titles}]
        merged = [k, *(n for numbers, _ in mine for n in numbers)]
        titles = [*(title for _, others in mine for title in others), *titles]
        groups = [group for group in groups if group not in mine]
        groups.append((sorted(merged), titles))
    groups.sort()
    for numbers, titles in groups[:_MOST_KINDS]:
        which = listing([str(k) for k in numbers])
        if len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1:
            which = f"{numbers[0]} to {numbers[-1]}"
        yield f"{which}: {' / '.join(dict.fromkeys(titles))}"
    if rest := sum(len(numbers) for numbers, _ in groups[_MOST_KINDS:]):
        yield f"{rest} more"


def _causes_shown(record: ParticipantRecord) -> tuple[Sequence[Candidate], ...]:
    """Those of which the page says all."""
    return record.causes[: _MOST - len(large_finding(record))]


def _sure(record: ParticipantRecord, light: blocks.Light) -> Iterator[blocks.Block]:
    """Of the error, of what was found, of what might have been missed; nothing where no search was
    made."""
    if record.diagnosis is None or record.detection is None:
        return
    unseen = verdict.unseen(record.detection, record.diagnosis)
    said = []
    if light.state == "large":
        known = verdict.main_part(record.budget, effects_in(record.causes), record.use())
        said.append(f"The large error is certain{'' if known else ', its cause unknown'}.")
        unseen = unseen if known else verdict.MAY_HIDE
    elif not record.causes:
        said.append("No fault is more probable than not.")
    said.append(unseen)
    if text := " ".join(filter(None, said)):
        yield blocks.Heading("How sure is this?")
        yield blocks.Paragraph(text)


# --- how large ----------------------------------------------------------------------------------


def _sizes(record: ParticipantRecord) -> Iterator[blocks.Block]:
    """The yardsticks, and what makes the error: each says of which parameters it is."""
    use, bar = record.use(), tuple(budget_bar(record))
    table = {one.name: number(size) for one, size in measured_of(record, RM)} if bar else {}
    scales = []
    for one, size in measured_of(record):
        other = table.get(one.name, number(size))
        scales.append(one.scale(size, "" if other == number(size) else f"with {RM} {other}"))
    named = use if large_finding(record) else METHODS[use]  # the finding says what it is
    yield blocks.Heading(f"How large are the errors with {named}?")
    yield blocks.Scales(tuple(scales))
    yield blocks.Paragraph(SOURCES, "note")
    yield from bar


def budget_bar(record: ParticipantRecord) -> Iterator[blocks.Block]:
    """What makes the error of the table's parameters, as one bar."""
    if record.budget is None:
        return
    if pieces := overall_pieces(record.budget, effects_in(record.causes)):
        use = record.use()
        other = f" of {METHODS[RM]}, not {use}" if use != RM else ", by cause"
        yield blocks.Bar(f"What makes the squared error{other}", pieces)


# --- what to do ---------------------------------------------------------------------------------


def to_do(record: ParticipantRecord, light: blocks.Light) -> list[str]:
    """At most three things."""
    causes, first = _causes_shown(record), 1 + len(large_finding(record))
    few = record.causes if len(record.causes) <= _FEW else causes
    said = [f"{refusal.unit or record.id}: {refusal.sentence}" for refusal in record.refusals[:1]]
    said += _look_at(record)
    said += verdict.consequences(few, first, only_actions=True)
    groups = [(k, cause) for k, cause in enumerate(causes, first) if len(cause) > 1]
    for k, cause in groups[:1]:
        members = [(one.effect, one.target) for one in cause]
        on_scale = cause[0].class_id == OF_THE_WEIGHT
        step = "weigh the person on a scale" if on_scale else separating_recording(members, most=1)
        said.append(f"To learn the cause of finding {k}, {step}.")
    if not beyond(record) and (alone := large_alone(record)):
        where = listing([names_of(record)[trial.stem] for trial in alone])
        said.append(TEXTS["to_do"]["forces"].format(trial=where))
    if light.state == "inconclusive" and not beyond(record):
        said.append(TEXTS["to_do"]["contacts"])
    if light.state == "fine" and not said:
        said.append(TEXTS["usable"]["fine"])
    rows = record.excitation.query("quantity == 'next'")
    if said in ([], [TEXTS["usable"]["fine"]]) and len(rows):
        text = rows["text"].iloc[0]
        said.append(f"Optional, to know the parameters better, record: {text}.")
    return said[:_MOST_TO_DO]


def _look_at(record: ParticipantRecord) -> Iterator[str]:
    """Where to look for what makes the largest error, which is the first finding; nothing where
    another finding makes the largest part."""
    if number_of_main_part(record):
        return
    is_finding = bool(large_finding(record)) or is_said(record)
    number_of_it = "Finding 1: " if is_finding else ""
    texts = TEXTS["to_do"]
    for one, _ in beyond(record)[:1]:
        worst = worst_of(record, one)
        if one.name == MARKERS:
            yield f"{number_of_it}{texts['markers']}"
        elif worst is not None:
            yield f"{number_of_it}{texts['forces'].format(trial=names_of(record)[worst.stem])}"
