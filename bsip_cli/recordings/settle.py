"""How each plate's numbers are to be understood, decided over all trials of a session alike.

A few repairs are tried: other units, another point that moments are about, the corners in another
order, two plates exchanged; for all plates alike or for one. Each has a prior, how rare it is, and
a likelihood, how well forces so understood press under a person's feet (`under_the_feet`) and carry
and drive the body (`body_motion`). One that is surely better than what the files say is made; where
nothing makes a person of the forces, the plate is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.special import logsumexp

from bsip_cli.recordings.body_motion import Balance, Body, turn_of_forces
from bsip_cli.recordings.frame_change import FORCES_MOVED, MIRRORS, FrameChange
from bsip_cli.recordings.gate_limits import USUAL, GateLimits
from bsip_cli.recordings.handedness import Handedness
from bsip_cli.recordings.plate_fit import PlateFit, plate_fits
from bsip_cli.recordings.plate_reading import (
    AS_STATED,
    EXCHANGED,
    ONE_ALONE,
    REVERSED,
    PlateReading,
)
from bsip_cli.recordings.plates import cop_at_height
from bsip_cli.recordings.repeated_plates import repeated_plates
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.under_the_feet import BESIDE_M, Evidence, outline

_SURELY_NOBODY = 0.999  # probability from which on no reading is believed
_LEAST_LIKELY = -12.0  # logarithm: less adds nothing
_ALIKE_M = 0.01  # readings whose centres of pressure differ by less are one,
_ALIKE_SHARE = 0.01  # if their forces differ by less than this part of the load,
_ALIKE_TORQUE_M = 0.003  # and their vertical moments by less than this times the load
_RIM_M = 0.02
_CLEARLY = 3.0  # standard deviations
_MOSTLY_OUTSIDE = 0.8  # share of the load

# Logarithms: how often something else is wrong; how each trial and plate looks then (a person: -1).
_UNKNOWN, _UNKNOWN_EACH = -6.2, -1.5

Doubted = Literal["", "vertical moment", "force and centre of pressure"]

_ALL: Doubted = "force and centre of pressure"
_AS_IT_IS = "taken as they stand"
_UNTOLD = "its numbers are no force under a foot as they stand, and several corrections make one"
_AGAINST = "its force is not one that carries and drives the body that the markers show"


@dataclass(frozen=True)
class Verdict:
    """How a plate is understood, or why it is left out (``refusal``, a clause).

    ``before`` and ``after``: what its numbers make as the file says, and as they are understood,
    where that differs. ``rivals``: repairs that would each explain a plate, and that cannot be
    told apart: it is left out, or what is ``doubted`` is said: its vertical moment where only that
    differs, its force where it is likeliest as the file says. ``repeats`` names the plates whose
    copy or sum it is.
    """

    reading: PlateReading = field(default_factory=PlateReading)
    before: Evidence | None = None
    after: Evidence | None = None
    refusal: str = ""
    rivals: tuple[str, ...] = ()
    doubted: Doubted = ""
    repeats: tuple[str, ...] = ()


@dataclass(frozen=True)
class SessionReading:
    """How all recordings of a session are to be understood: their axes, and each plate."""

    frame: FrameChange = field(default_factory=FrameChange)
    plates: Mapping[str, Verdict] = field(default_factory=dict)


def settle_session(trials: Sequence[TrialSamples], limits: GateLimits = USUAL) -> SessionReading:
    """The axes and the plates' readings that make a person of a session."""
    is_mirrored = Handedness.of_all([trial.hands for trial in trials]).is_mirrored
    changes = MIRRORS if is_mirrored else (FrameChange(), *FORCES_MOVED)
    repeats = repeated_plates([trial.sources for trial in trials])
    trials = [trial.without(repeats) for trial in trials if trial.sources]
    if not trials:
        return SessionReading(changes[0])
    hypotheses = [Hypothesis.as_stated(change, trials, limits) for change in changes]
    if (turn := hypotheses[0].odd_turn()) is not None:
        hypotheses.append(Hypothesis.as_stated(turn, trials, limits))
    chosen = _corrected(hypotheses)
    verdicts = {name: _verdict(hypotheses[0].fits[name], chosen, name) for name in chosen.of.fits}
    repeated = {name: Verdict(repeats=others) for name, others in repeats.items()}
    return SessionReading(chosen.of.frame, verdicts | repeated)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Axes, and a reading of each plate in them; ``trials`` and ``body`` are in these axes."""

    frame: FrameChange
    trials: Sequence[TrialSamples]
    body: Body
    fits: Mapping[str, PlateFit]
    limits: GateLimits

    @classmethod
    def as_stated(
        cls, change: FrameChange, trials: Sequence[TrialSamples], limits: GateLimits
    ) -> Hypothesis:
        """As the files say, in other axes."""
        trials = [trial.in_frame(change) for trial in trials]
        names = dict.fromkeys(name for trial in trials for name in trial.sources)
        fits = {name: plate_fits(trials, name, [AS_STATED])[0] for name in names}
        body = Body.of_all([trial.body for trial in trials])
        return cls(change, trials, body, fits, limits)

    def odd_turn(self) -> FrameChange | None:
        """Of the forces against markers that are not mirrored, if it is surely no multiple of 90
        degrees."""
        found = turn_of_forces(self.body, self._total(), self.limits)
        if self.frame.moved or found is None:
            return None
        angle, sd = np.rad2deg(found)
        if abs((angle + 45.0) % 90.0 - 45.0) < _CLEARLY * sd:
            return None
        return FrameChange("forces", turned_deg=round(angle, 2), turned_sd_deg=round(sd, 2))

    @cached_property
    def balance(self) -> Balance:
        return Balance.of(self.body, self._total(), self.limits)

    def _total(self) -> np.ndarray:
        """All plates' wrench at the samples of all trials, (n, 6)."""
        total = [np.zeros((len(trial.body.trial), 6)) for trial in self.trials]
        for fit in self.fits.values():
            for k, wrench in fit.smooth_wrenches().items():
                total[k] += wrench
        return np.concatenate(total)

    @cached_property
    def log_posterior(self) -> float:
        """But for a constant."""
        on_feet = sum(fit.log_likelihood for fit in self.fits.values())
        return self._log_prior() + on_feet + self.balance.log_likelihood(self.limits)

    def _log_prior(self) -> float:
        """How rare it is that so much is wrong at once, logarithm."""
        readings = [fit.reading for fit in self.fits.values()]
        repairs: dict[PlateReading, int] = {}
        for reading in readings:
            repair = replace(reading, centre_m=None, place_of="", sign=1)
            repairs[repair] = repairs.get(repair, 0) + 1
        alone = sum(n < len(readings) for repair, n in repairs.items() if repair != AS_STATED)
        return (
            self.frame.log_prior()
            + sum(repair.log_prior() for repair in repairs)
            + ONE_ALONE * alone
            + EXCHANGED * sum(bool(reading.place_of) for reading in readings) / 2
            + REVERSED * any(reading.sign < 0 for reading in readings)
        )

    def words(self, name: str, now: Hypothesis) -> str:
        """What is done to a plate's numbers, as a clause; to the axes where they are others."""
        axes = self.frame.words() if self.frame != now.frame else ""
        return ", ".join(filter(None, (axes, self.fits[name].reading.words()))) or _AS_IT_IS

    def goes_beyond(self, other: Hypothesis) -> bool:
        """Whether all repairs of another hypothesis are made, and more."""
        if other.frame != self.frame and other.frame.moved:
            return False
        return all(
            mine == theirs or theirs == default
            for name, fit in other.fits.items()
            for mine, theirs, default in zip(
                astuple(self.fits[name].reading),
                astuple(fit.reading),
                astuple(AS_STATED),
                strict=True,
            )
        )

    def is_alike(self, other: Hypothesis, torque: bool = True) -> bool:
        """Whether both leave the same forces (and vertical moments) at the same places under the
        same body."""
        return self.frame.of_markers() == other.frame.of_markers() and all(
            _are_alike(fit, other.fits[name], torque) for name, fit in self.fits.items()
        )

    def with_one_more(self) -> Iterator[Hypothesis]:
        """One more repair, of all plates or of one."""
        possible: dict[PlateReading, dict[str, PlateFit]] = {}
        for name, now in self.fits.items():
            repairs = list(dict.fromkeys(r for t in now.trials for r in t.source.alternatives()))
            asked = [_with(repair, now.reading) for repair in repairs]
            fits = plate_fits(self.trials, name, asked) if asked else []
            for repair, fit in zip(repairs, fits, strict=True):
                possible.setdefault(repair, {})[name] = fit
        for repair, some in possible.items():
            if repair != AS_STATED:
                yield self._with(some)
                yield from (self._with({name: fit}) for name, fit in some.items() if len(some) > 1)
        for pair in combinations(self.fits, 2):
            if all(name in trial.sources for trial in self.trials for name in pair):
                yield self._with({a: self._in_place_of(a, b) for a, b in (pair, pair[::-1])})

    def _with(self, fits: Mapping[str, PlateFit]) -> Hypothesis:
        return Hypothesis(self.frame, self.trials, self.body, {**self.fits, **fits}, self.limits)

    def _in_place_of(self, name: str, other: str) -> PlateFit:
        place = self.fits[other].reading.place_of or other
        reading = replace(self.fits[name].reading, place_of=place * (place != name))
        return plate_fits(self.trials, name, [reading])[0]


def _with(repair: PlateReading, now: PlateReading) -> PlateReading:
    """One more repair of a plate's numbers, which may be exchanged or have a channel reversed."""
    if repair.reversed_channel:
        return replace(now, reversed_channel=repair.reversed_channel)
    return replace(repair, place_of=now.place_of, reversed_channel=now.reversed_channel)


def _are_alike(one: PlateFit, other: PlateFit, with_torque: bool) -> bool:
    others = other.wrenches()
    for plate, wrench in zip(one.trials, one.wrenches().values(), strict=True):
        both = np.array([wrench, others[plate.trial]])
        if not both.shape[1]:
            continue
        load = np.abs(wrench[:, 2]).mean()
        apart = np.linalg.norm(both[0, :, :3] - both[1, :, :3], axis=1)
        floors = np.array(
            [
                [fit_floor]
                for fit_floor in (
                    plate.source.floor_m(one.reading),
                    plate.source.floor_m(other.reading),
                )
            ]
        )
        cop = cop_at_height(both[..., :3], both[..., 3:], floors)
        gap = np.abs(cop[0] - cop[1])
        if np.nanmax(gap, initial=0.0) >= _ALIKE_M or apart.mean() > _ALIKE_SHARE * load:
            return False
        torque = both[..., 5] - cop[..., 0] * both[..., 1] + cop[..., 1] * both[..., 0]
        if with_torque and np.nanmedian(np.abs(torque[0] - torque[1])) > _ALIKE_TORQUE_M * load:
            return False
    return True


# --- the choice -------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Choice:
    """The hypothesis that is believed; and, where the trials cannot tell it from others, the
    repairs of each plate that would do, in words, and what of it is in doubt, if it is believed
    all the same; or none makes a person."""

    of: Hypothesis
    rivals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    doubted: Doubted = ""
    is_no_person: bool = False


def _corrected(stated: Sequence[Hypothesis]) -> _Choice:
    """The readings after every repair that is sure, one after the other.

    Repairs in other axes are tried only where the files cannot be taken as they are.
    """
    now, others = stated[0], stated[1:]
    for _ in range(len(now.fits) + 2):
        tried = [now, *others, *now.with_one_more()]
        choice = _surest(tried)
        if others and (choice.of is not now or now.frame.moved):
            choice = _surest([*tried, *(one for o in others for one in o.with_one_more())])
        if choice.of is now:
            break
        now, others = choice.of, ()
    return choice


def _surest(tried: Sequence[Hypothesis]) -> _Choice:
    """The surest; the first, with rivals, if none is sure."""
    now, limits = tried[0], tried[0].limits
    believed, corrected = limits.believed_percent / 100, limits.corrected_percent / 100
    logs = np.array([one.log_posterior for one in tried])
    seen = sum(1 + len(trial.sources) for trial in now.trials)
    best = tried[int(np.argmax(logs))]
    # A fault that no reading mends; that the file's moments have no lever is none.
    lever = sum(fit.lever_log_likelihood() for fit in now.fits.values())
    unknown = _UNKNOWN + _UNKNOWN_EACH * seen + lever
    # Forces that go with the motion may still lie beside the feet.
    goes = max(best.balance.drive_log_likelihood(), 0.0)
    if unknown + goes - logsumexp([*logs, unknown + goes]) > np.log(_SURELY_NOBODY):
        return _Choice(now, is_no_person=True)
    logs -= logsumexp([*logs, unknown])
    likely = [k for k in range(len(tried)) if logs[k] > _LEAST_LIKELY]
    like_now = {0, *(k for k in likely if now.is_alike(tried[k]))}
    if np.exp(logsumexp(logs[list(like_now)])) >= (corrected if now.frame.moved else believed):
        return _Choice(now)
    same = [k for k in likely if best.is_alike(tried[k])]
    # A further fault that the trials do not show is no more likely here than in a sound file.
    unlikely = [k for k in likely if logs[k] < np.log(1 - corrected) and tried[k].goes_beyond(best)]
    if np.exp(logsumexp(logs[sorted({*same, *unlikely})])) >= corrected:
        return _Choice(best)
    some = [now, *(tried[k] for k in likely if logs[k] > np.log(1 - corrected))]
    words = {name: dict.fromkeys(one.words(name, now) for one in some) for name in now.fits}
    rivals = {name: tuple(all_) for name, all_ in words.items() if set(all_) != {_AS_IT_IS}}
    if all(now.is_alike(one, torque=False) for one in some):
        return _Choice(now, rivals, "vertical moment")
    return _Choice(now, rivals, _ALL if best is now and not now.frame.moved else "")


# --- what is said of it -----------------------------------------------------------------------


def _verdict(stated: PlateFit, chosen: _Choice, name: str) -> Verdict:
    fit, rivals = chosen.of.fits[name], chosen.rivals.get(name, ())
    before, after = stated.evidence(), fit.evidence()
    fault = _fault(after)
    if not fault and not chosen.doubted:
        fault = _UNTOLD if rivals else _AGAINST if chosen.is_no_person else ""
    if fault:
        return Verdict(fit.reading, before, after, refusal=fault, rivals=rivals)
    is_loaded = np.isfinite([after.distance_m, after.outside_m]).any()
    doubted: Doubted = chosen.doubted if rivals and is_loaded else ""
    return Verdict(_with_outline(fit), before, after, rivals=rivals, doubted=doubted)


def _fault(found: Evidence) -> str:
    """Why this is no force under a foot, as a clause; empty if it may be one."""
    if found.distance_m > BESIDE_M:
        return f"its centre of pressure lies {found.distance_m:.2f} m beside the feet on the ground"
    if not np.isfinite(found.distance_m) and found.outside_m > BESIDE_M:
        return f"its centre of pressure lies {found.outside_m:.2f} m outside the plate"
    return ""


def _with_outline(fit: PlateFit) -> PlateReading:
    """With a wider outline where the load lies under a foot but beside the stated one."""
    plates = [one.source.plate(fit.reading) for one in fit.trials]
    offsets = [
        outline(plate.cop_m(one.source.floor_m(fit.reading)), plate.corners_m)
        for one, plate in zip(fit.trials, plates, strict=True)
        if plate.corners_m is not None
    ]
    along = np.concatenate([each for each, _ in offsets] or [np.zeros((0, 2))])
    if not len(along) or (along > (half := offsets[0][1])).any(axis=1).mean() < _MOSTLY_OUTSIDE:
        return fit.reading
    x, y = np.maximum(np.nanpercentile(along, 99, axis=0) + _RIM_M, half).tolist()
    return replace(fit.reading, half_size_m=(x, y))
