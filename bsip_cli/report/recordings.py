"""How large the errors of a person's recordings are with the parameters to use, and when; which
recordings may still be used, and for what."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pandas as pd

from bsip_cli.report import verdict
from bsip_cli.report.blocks import Light
from bsip_cli.report.budget import Piece
from bsip_cli.report.causes import (
    EFFECT_WORDS,
    OF_THE_WEIGHT,
    Candidate,
    Cause,
    effect_title,
    effects_in,
    is_large,
)
from bsip_cli.report.errors import (
    COP,
    COP_LIMIT_M,
    FORCE,
    FORCE_LIMIT_PERCENT,
    MARKERS,
    Yardstick,
    errors_of,
    use_sentence,
    yardsticks,
)
from bsip_cli.report.records import ParticipantRecord, TrialRecord, clock_of, flags_of, signals_of
from bsip_cli.report.words import TEXTS, findings, listing, number, say, task_of, trial_label
from bsip_cli.statistics.methods import MEASURED, OM, RM

_IN_THE_MODEL = {"person", "skin", "unnamed"}  # families of what nobody can correct or state
_OF_THE_MOTION = {"motion", "frame"}  # families of what makes the motion wrong
_USABLE = ("full", "care")  # as they are
_MOST_REASONS = 4  # in a line
_MOST_RUNS = 4  # of a task, in a line
_once = lru_cache(maxsize=1)  # of the person at hand: many places ask


# --- how large ----------------------------------------------------------------------------------


def _sizes(
    record: ParticipantRecord, trials: Sequence[TrialRecord], markers_mm: float, method: str = ""
) -> dict[Yardstick, float]:
    """The yardsticks, with the limits that the diagnosis was run with, and numbers of trials; by a
    method, or by the one to use now."""
    limits = (record.option("diagnosis", name) for name in (COP_LIMIT_M, FORCE_LIMIT_PERCENT))
    fits = [
        trial.fit[trial.fit["method"] == (method or use_now(record, trial.task))]
        for trial in trials
        if trial.fit is not None
    ]
    values = errors_of(fits) | {MARKERS: markers_mm}
    return {one: values[one.name] for one in yardsticks(*limits)}


def measured_of(record: ParticipantRecord, method: str = "") -> dict[Yardstick, float]:
    """The three yardsticks with this person's numbers, by a method, or by the one to use now."""
    markers_mm = 1e3 * float(record.facts["marker_rms_m"])
    return _sizes(record, record.moving_trials(), markers_mm, method)


@_once
def _of_each(record: ParticipantRecord) -> dict[str, dict[Yardstick, float]]:
    """The yardsticks with the numbers of each recording, by its stem."""
    return {one.stem: _sizes(record, [one], one.markers_mm()) for one in record.trials}


def _large(sizes: Mapping[Yardstick, float]) -> list[tuple[Yardstick, float]]:
    return [(one, size) for one, size in sizes.items() if one.is_large(size)]


@_once
def beyond(record: ParticipantRecord) -> list[tuple[Yardstick, float]]:
    """The yardsticks beyond which the errors of all recordings together are."""
    return _large(measured_of(record))


def large_alone(record: ParticipantRecord, with_markers: bool = False) -> list[TrialRecord]:
    """Recordings in motion with an error of the forces, or of the markers too, beyond a yardstick."""
    asked = (COP, FORCE, MARKERS) if with_markers else (COP, FORCE)
    found = ((trial, _large(_of_each(record)[trial.stem])) for trial in record.moving_trials())
    return [trial for trial, large in found if any(one.name in asked for one, _ in large)]


def worst_of(record: ParticipantRecord, yardstick: Yardstick) -> TrialRecord | None:
    """The recording in motion where an error is largest; None where none has it."""
    sizes = [(_of_each(record)[trial.stem][yardstick], trial) for trial in record.moving_trials()]
    known = [(size, trial) for size, trial in sizes if np.isfinite(size)]
    return max(known, key=lambda one: one[0])[1] if known else None


def largest_in(record: ParticipantRecord, trial: TrialRecord) -> tuple[TrialRecord, Yardstick]:
    """The recording, and which of its errors of the forces is farthest beyond its yardstick."""
    own = [pair for pair in _of_each(record)[trial.stem].items() if pair[0].name != MARKERS]
    return trial, max(own, key=lambda pair: np.nan_to_num(pair[1]) / pair[0].limit)[0]


@_once
def names_of(record: ParticipantRecord) -> dict[str, str]:
    """Stem of each recording: its task; ``swing run 3`` where it is not the only one."""
    stems = [trial.stem for trial in record.trials]
    tasks = [*map(task_of, stems)]
    return {
        stem: task if tasks.count(task) == 1 else trial_label(stem, "{} {}")
        for stem, task in zip(stems, tasks, strict=True)
    }


# --- the answer, and the finding that it is -------------------------------------------------------


def even_with_om(record: ParticipantRecord) -> bool:
    """Whether errors are large with OM, where that is to be used, be it later."""
    return record.use() == OM and bool(_large(measured_of(record, OM)))


@_once
def light_for(record: ParticipantRecord) -> Light:
    """The answer, as `bsip show` prints it too."""
    large = [f"{one.short()} {number(size)} {one.unit}" for one, size in beyond(record)]
    alone = [names_of(record)[trial.stem] for trial in large_alone(record, with_markers=True)]
    tables = record.diagnosis, record.detection, record.budget
    before = int(bool(large) and not is_said(record))  # `large_finding`
    even = even_with_om(record)
    return verdict.light_of(*tables, large, use_now(record), alone, before, even)


@_once
def large_finding(record: ParticipantRecord) -> tuple[str, ...]:
    """The first finding where errors are large and the diagnosis has none that says so: how large,
    where most, whether the cause is known; else none."""
    found = beyond(record)
    if not found or is_said(record) or light_for(record).state != "large":
        return ()
    first, size = found[0]
    worst = worst_of(record, first)
    own = _of_each(record)[worst.stem][first] if worst else size
    said = say(
        "large_finding",
        used=use_now(record, worst.task) if worst else use_words(record),
        errors=[one.short() for one, _ in found],  # of several the yardsticks have the sizes
        size=number(size),
        unit=first.brief_unit(),
        worst=names_of(record)[worst.stem] if worst else "",
        own=number(own),
        why="" if all(one.name == MARKERS for one, _ in found) else _why_large(record, worst),
    )
    return (said,)


def is_said(record: ParticipantRecord) -> bool:
    """Whether the diagnosis has a finding of a large error where the largest one is."""
    worst = [worst_of(record, one) for one, _ in beyond(record)[:1]]
    return any(
        is_large(cause) and all(one is None or _concerns(cause, one) for one in worst)
        for cause in record.causes
    )


def _why_large(record: ParticipantRecord, worst: TrialRecord | None) -> str:
    """What makes the largest part, as far as the budget of the parameters to use tells; nothing
    where the light says it."""
    part, is_left = main_part(record)
    is_found = worst is not None and any(_concerns(cause, worst) for cause in record.causes)
    return say(
        "why_large",
        part=part.label if part else "",
        number=_number_of(record, part) if part else 0,
        besides=" besides the table's parameters" if is_left else "",
        other_findings=is_found,
        any_finding=bool(record.causes),
        title=light_for(record).title,
        none_found=verdict.NONE_FOUND,
    )


def main_part(record: ParticipantRecord) -> tuple[Piece | None, bool]:
    """Of a large error, what makes the largest part; None if unknown, so that nothing is of unknown
    cause whose bar has no such part. And whether that is what OM has left."""
    found = effects_in(record.causes)
    ranked, is_left = verdict.ranked_parts(record.budget, found, even_with_om(record))
    is_known = bool(ranked) and ranked[0].label not in verdict.NO_CAUSE
    return (ranked[0] if is_known else None), is_left


def numbered(record: ParticipantRecord) -> dict[int, Cause]:
    """What the diagnosis found, by its number in the report."""
    return dict(enumerate(record.causes, start=1 + len(large_finding(record))))


def number_of_main_part(record: ParticipantRecord) -> int:
    """Of the finding that makes the largest part of a large error of forces; 0 if none does."""
    part, is_left = main_part(record)
    of_markers = all(one.name == MARKERS for one, _ in beyond(record))
    return 0 if part is None or is_left or of_markers else _number_of(record, part)


def _number_of(record: ParticipantRecord, part: Piece) -> int:
    causes = enumerate(record.causes, start=1 if is_said(record) else 2)
    return next((k for k, c in causes if effect_title(c[0].effect) in part.label), 0)


# --- which recordings may be used ---------------------------------------------------------------


@dataclass(frozen=True)
class Use:
    """What a recording may be used for, a key of ``uses`` in the texts, and why for no more;
    ``brief``: the same where many stand in a line."""

    kind: str
    why: str = ""
    brief: str = ""

    def in_words(self) -> str:
        """For a cell."""
        return TEXTS["uses"][self.kind]["short"] + (f" ({self.why})" if self.why else "")


def use_lines(record: ParticipantRecord) -> Iterator[str]:
    """A line per kind of use, the best first."""
    if light_for(record).state == "inconclusive":
        yield TEXTS["usable"]["inconclusive"]
        return
    uses = uses_of(record)
    for kind, words in TEXTS["uses"].items():
        because: dict[str, list[str]] = {}
        for stem in (stem for stem, use in uses.items() if use.kind == kind):
            because.setdefault(uses[stem].brief or uses[stem].why, []).append(stem)
        if len(because) > _MOST_REASONS:
            stems = [stem for of in because.values() for stem in of]
            because = {"reasons below, under What was recorded": stems}
        parts = [
            f"{_listed(of, record)}{f' ({why})' if why else ''}" for why, of in because.items()
        ]
        if parts:
            yield f"{words['long']}: {'; '.join(parts)}."


def _listed(stems: Sequence[str], record: ParticipantRecord) -> str:
    names, items = names_of(record), []
    if len(stems) == len(names):
        return "all recordings"
    for task in dict.fromkeys(map(task_of, stems)):
        of = [names[stem] for stem in stems if task_of(stem) == task]
        items += [f"{len(of)} × {task}"] if len(of) > _MOST_RUNS else of
    return listing(items)


def _before_any(record: ParticipantRecord) -> str:
    """What has to be done before any parameters are used: the calibration is bad, or errors are large
    and no recording may be used; else empty."""
    kinds = {use.kind for use in uses_of(record).values()}
    if "calibration" in kinds:
        return str(TEXTS["usable"]["calibration"])
    is_large = light_for(record).state == "large"
    return TEXTS["usable"]["large"] if is_large and kinds.isdisjoint(_USABLE) else ""


def must_wait(record: ParticipantRecord) -> str:
    """The same, or why OM should not be used yet: not all recordings that identified it may be used
    themselves."""
    trials = listing(om_waits(record), "")
    later = TEXTS["usable"]["identified"].format(trials=trials) if trials else ""
    return _before_any(record) or later


@_once
def om_waits(record: ParticipantRecord) -> list[str]:
    """Names of the recordings for which OM, where that is to be used, has to wait."""
    uses = {record.use(), *(record.use(trial.task) for trial in record.moving_trials())}
    own = record.identification_trials() if OM in uses else ()
    causes, kinds = dict(enumerate(record.causes)), {}
    for trial in own:
        sizes = _sizes(record, [trial], trial.markers_mm(), OM)
        kinds[trial.stem] = _use_of(record, trial, causes, sizes).kind
    return [names_of(record)[stem] for stem, kind in kinds.items() if kind not in _USABLE]


def use_now(record: ParticipantRecord, movement: str = "all") -> str:
    """The method whose parameters to use, in one movement or mostly: the table's as long as OM has
    to wait, if it does. Every number and sentence of a page is of these."""
    found = record.use(movement)
    return RM if found == OM and om_waits(record) else found


def use_words(record: ParticipantRecord) -> str:
    """``OM (running, walking: RM)``: where other parameters are to be used than mostly."""
    others: dict[str, list[str]] = {}
    for movement in dict.fromkeys(trial.task for trial in record.moving_trials()):
        others.setdefault(use_now(record, movement), []).append(movement)
    others.pop(first := use_now(record), None)
    said = "; ".join(f"{', '.join(some)}: {method}" for method, some in others.items())
    return f"{first} ({said})" if said else first


def not_yet(record: ParticipantRecord) -> str:
    """After the parameters to use, where something has to be done before any are."""
    return " (not yet)" if _before_any(record) else ""


def use_said(record: ParticipantRecord, brief: bool = False) -> str:
    """Which parameters to use, and why, in sentences; or what has to be done before, with what the
    errors so far tell, if not ``brief``."""
    waits = must_wait(record)
    if waits and brief:
        return waits
    lead = f"{waits} {TEXTS['so_far']}" if waits else "Use"
    return use_sentence(record.choice, record.identification, lead)


@_once
def uses_of(record: ParticipantRecord) -> dict[str, Use]:
    """Of each recording, by its stem, as far as its errors and the findings tell."""
    causes = numbered(record)
    return {t.stem: _use_of(record, t, causes, _of_each(record)[t.stem]) for t in record.trials}


def _use_of(
    record: ParticipantRecord,
    trial: TrialRecord,
    causes: Mapping[int, Cause],
    every: Mapping[Yardstick, float],
) -> Use:
    """By the worst of its markers, its forces and the findings that concern it; ``causes``: all
    findings of the diagnosis by their numbers; ``every``: its errors."""
    calibrates = trial.role == "static" and trial.stem == record.facts["calibration_trial"]
    out = "calibration" if calibrates else "out"  # on the calibration all else rests
    if trial.kinematics is None or trial.kinematics.empty:
        return Use(out, "no motion was computed")
    found = {k: cause for k, cause in causes.items() if _concerns(cause, trial)}
    families = {k: {EFFECT_WORDS[one.effect].family for one in of} for k, of in found.items()}
    large = sorted(_large(every), key=lambda pair: -pair[1] / pair[0].limit)
    sizes = {x.name: f"{x.brief} error {number(size)} {x.brief_unit()}" for x, size in large}
    if MARKERS in sizes:
        return Use(out, listing([*sizes.values()]), sizes[MARKERS])
    unexplained = findings([k for k, cause in found.items() if is_large(cause)])
    moved = findings([k for k, of in families.items() if of <= _OF_THE_MOTION])
    if wrong := [*sizes.values()] or [unexplained] * bool(unexplained):
        after = f"after {moved}" if moved else ""
        return Use("motion", "; ".join(filter(None, (listing(wrong), after))), after or wrong[0])
    if not any(np.isfinite(size) for one, size in every.items() if one.name != MARKERS):
        return Use("motion", "forces could not be compared")
    correct = findings([k for k, of in families.items() if not of <= _IN_THE_MODEL])
    if correct:
        return Use("corrected", correct)
    return Use("care" if found else "full", findings([*found]))


def _concerns(cause: Sequence[Candidate], trial: TrialRecord) -> bool:
    """What quiet stance shows of a mass or a plate concerns all recordings, and so does what all
    persons of a laboratory share."""
    is_of_all = cause[0].class_id == OF_THE_WEIGHT or cause[0].is_of_all
    return is_of_all or any(trial.stem in one.trials for one in cause)


# --- what an error looks like over time, from which follows what to check first -------------------

_MOST = 0.5  # of the squared error: what makes as much sets the kind
_PART = 0.25  # of the frames, in which an even error has as little
_BRIEF_S = 0.2  # to either side of the worst moment


@dataclass(frozen=True)
class Shape:
    """``kind`` : shifted (a centre of pressure, by a constant), constant (of a force), load (goes
    along with it), brief, impact (the force changes fast), light (there is little load) or mixed.
    ``column`` : of the signals, the one with most of the error. ``worst_s`` : when it is largest [s].
    """

    kind: str
    column: str
    worst_s: float


def shape_of(
    reconstruction: pd.DataFrame | None, method: str, columns: Sequence[str]
) -> Shape | None:
    """Of the method's signals (centre of pressure [m] or force [N]) less the measured ones; None if
    not known."""
    if reconstruction is None or method not in set(reconstruction["method"]):
        return None
    signals = {name: signals_of(reconstruction, name) for name in (*columns, "fz_N")}
    clock, load = clock_of(reconstruction), signals["fz_N"][MEASURED]
    off = np.array([signals[name][method] - signals[name][MEASURED] for name in columns])
    known = flags_of(reconstruction, "valid") & np.isfinite([*off, load]).all(axis=0)
    if not off[:, known].any():
        return None
    clock, load, off = clock[known], load[known], off[:, known]
    power, is_load = (off**2).sum(axis=0), "fz_N" in columns  # of the load itself, or under it
    worst_s = float(clock[np.argmax(power)])
    near = np.abs(clock - worst_s) <= _BRIEF_S
    speed = np.abs(np.gradient(load, clock)) if len(load) > 1 else np.zeros_like(load)
    frames = {
        "brief": near & (near.mean() <= _PART),
        "impact": speed > np.quantile(speed, 1.0 - _PART),
        "light": (load < np.quantile(load, _PART)) & (not is_load),
    }
    mean = float((off.mean(axis=1) ** 2).sum() / power.mean())
    shares = {"constant" if is_load else "shifted": mean}
    if is_load:
        along = load - load.mean()
        shares["load"] = float((off[0] @ along) ** 2 / ((along @ along) * power.sum() or np.inf))
    shares |= {kind: float(power[of].sum() / power.sum()) for kind, of in frames.items()}
    kind = max(shares, key=shares.__getitem__)
    kind = kind if shares[kind] >= _MOST else "mixed"
    return Shape(kind, columns[int(np.argmax((off**2).sum(axis=1)))], worst_s)
