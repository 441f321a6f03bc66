"""What is kept of a trial until all of a session are seen: small, however long it is.

Do the forces come when the body moves as they drive it, and does it move as fast? Systems that
are started by hand differ by tenths of a second, or by whole ones; and a file may state another
rate than that of the cameras, so that accelerations are wrong by its square. In 66 public trials
forces and body go together best within 0.04 s of the stated time, if at all, and a hidden delay of
0.3 s was found to 0.04 s.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import find_peaks
from scipy.special import logsumexp

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.body_motion import SMOOTH_S, USUAL, Balance, Body, GateLimits
from bsip_cli.recordings.one_person import Sizes, sizes_of
from bsip_cli.recordings.plate_reading import (
    AS_STATED,
    FrameChange,
    Opened,
    PlateSource,
    later_samples,
    lift_N,
    repeated_plates,
)
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.scene import Handedness, Stature, by_segment, handedness, height_m, stature
from bsip_cli.recordings.shared_forces import Course
from bsip_cli.recordings.trunk_motion import FALLS
from bsip_cli.recordings.under_the_feet import Feet
from bsip_cli.recordings.written import OTHER_RATE, PACES, Lengths

DELAYED = -4.6
"""Logarithm: clocks differ by more than `LEAST_S` in one trial of a hundred."""

LEAST_S = 0.05
"""More than any sound recording shows, see above; a smaller delay is left to the diagnosis, which
sees it along the simulation."""

_MOST_S = 10.0  # whoever lets more pass has another recording
_STEP_S = 0.02  # half of the bell that forces and markers are averaged with
# Logarithm, of one step of lags a second away: tenths of a second are as frequent as whole ones.
_LOG_PRIOR = DELAYED + float(np.log(_STEP_S / 2 / np.log(_MOST_S / LEAST_S)))
_NEAR_S = 0.1  # lags so near are one
# Of a clock that runs otherwise, or of a table that lost rows and was numbered anew: what forces
# come later or earlier by at a trial's end, up to that share of it (more is another rate, `PACES`).
_DRIFT_STEP_S, _MOST_DRIFT_S, _DRIFT_SHARE = 0.1, 2.0, 0.15


@dataclass(frozen=True)
class Delay:
    """Of the forces after the body; ``kept`` : the part of the trial whose forces are then known;
    ``log_posterior`` : how rare it is, and how well lift and body then go together."""

    seconds: float = 0.0
    kept: float = 1.0
    log_posterior: float = 0.0

    def limits(self, usual: GateLimits) -> GateLimits:
        """A part of a trial counts as so many independent numbers less."""
        return replace(usual, independent_numbers=self.kept * usual.independent_numbers)


@dataclass(frozen=True, eq=False)
class Lags:
    """How well forces go with the body if they are taken from later, logarithm, (n,) each: as the
    file says; the force alone, turned or mirrored as suits it best; and the lift alone, which no
    unit, reference point or order of corners changes. kept : see `Delay`. ``path_m`` : of the
    centre of mass in each step. ``drift_s`` : by what forces surely come later at the trial's end
    than at its start, where they come with the motion; 0 if that is not sure."""

    seconds: np.ndarray
    kept: np.ndarray
    as_stated: np.ndarray
    of_force: np.ndarray
    of_lift: np.ndarray
    path_m: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    drift_s: float = 0.0

    def _now(self, kind: np.ndarray) -> np.ndarray:
        """Of a kind (..., n) at the stated times, nearly, (...,)."""
        now = np.abs(self.seconds) <= LEAST_S
        return np.asarray(kind[..., now].max(axis=-1).clip(min=0.0))

    def goes(self) -> float:
        """How well forces go with the body at the stated times, in whatever axes and units."""
        return float(self._now(self.of_force))

    def delays(self, limits: GateLimits = USUAL) -> list[Delay]:
        """None, and all that are not surely others if any surely is better: who moves in cycles
        goes nearly as well with the forces of another one, and only the right reading of the plates
        shows which it is."""
        none = Delay(log_posterior=self.of_lift[len(self.seconds) // 2])
        surely = -float(np.log(1 - limits.corrected_percent / 100))
        every = np.array([self.as_stated, self.of_force, self.of_lift])
        highest = every.max(axis=1)
        if not (highest > self._now(every) + surely).any():
            return [none]
        least = (highest - surely).clip(min=surely)[:, None]
        may_be, likelier = (every >= least).any(axis=0), every[:2].max(axis=0)
        found = [none]
        for k in find_peaks(likelier)[0]:
            before, here, after = likelier[k - 1 : k + 2]  # of a parabola
            bend = 2.0 * here - before - after
            aside = 0.5 * (after - before) / bend if bend > 0 else 0.0
            delay_s = float(self.seconds[k] + aside * (self.seconds[k + 1] - self.seconds[k]))
            if may_be[k] and abs(delay_s) > LEAST_S:
                rare = _LOG_PRIOR - float(np.log(abs(delay_s)))
                found.append(Delay(delay_s, self.kept[k], rare + self.of_lift[k]))
        return found


def surest(logs: Mapping[Delay, float], of_none: float, limits: GateLimits) -> Delay | None:
    """The likeliest by logarithms of posteriors, if it or one near it surely is right."""
    if not logs:
        return None
    best = max(logs, key=logs.__getitem__)
    near = [log for one, log in logs.items() if abs(one.seconds - best.seconds) <= _NEAR_S]
    surely = np.exp(logsumexp(near) - logsumexp([of_none, *logs.values()]))
    return best if surely >= limits.corrected_percent / 100 else None


def lags(opened: Opened, limits: GateLimits = USUAL) -> Lags | None:
    """Of a trial, its plates as the file says but for their signs; None where nothing shows it."""
    rate_hz = opened.recording.marker_rate_hz
    step = max(1, round(_STEP_S * rate_hz))
    if step / rate_hz > LEAST_S or not opened.sources:
        return None
    body, samples, wrenches = motion_and_forces(opened, step)
    if not np.isfinite(body.rate).any():
        return None
    total = np.zeros((len(body.rate), 6))
    total[len(samples) :] = np.nan
    usable = {source.name: source.usable[samples] for source in opened.sources}
    for name, pushing in wrenches.items():
        pushing[~usable[name]] = np.nan
        total[: len(samples)] += pushing if np.nansum(pushing[:, 2]) >= 0 else -pushing
    most = min(round(_MOST_S * rate_hz / step), len(total))
    by = np.arange(-most, most + 1)
    found = [_goes(body, total, k, limits) for k in by.tolist()]
    kept, as_stated, of_force, of_lift = np.array(found).T
    drift_s = _drift_s(body, total, step / rate_hz, float(of_force.max()), limits)
    return Lags(by * step / rate_hz, kept, as_stated, of_force, of_lift, body.place_m, drift_s)


def _drift_s(
    body: Body, total: np.ndarray, step_s: float, of_delays: float, limits: GateLimits
) -> float:
    """As `Lags` has it, of what goes with the body by ``of_delays`` at the best of all lags."""
    steps = np.arange(len(total))
    most_s = min(_MOST_DRIFT_S, _DRIFT_SHARE * len(total) * step_s)
    sizes_s = _DRIFT_STEP_S * np.arange(1, int(most_s / _DRIFT_STEP_S) + 1)
    drifts_s = [*-sizes_s[::-1], *sizes_s]
    if not drifts_s:
        return 0.0
    by = (np.round(drift / step_s * steps / len(total)).astype(int) for drift in drifts_s)
    goes = np.array([_goes(body, total, one, limits)[2] for one in by])
    rare = DELAYED - np.log(len(goes))
    surely = np.log(limits.corrected_percent / (100 - limits.corrected_percent))
    best = int(np.argmax(goes))
    return float(drifts_s[best]) if goes[best] + rare > of_delays + surely else 0.0


def motion_and_forces(opened: Opened, step: int) -> tuple[Body, np.ndarray, dict[str, np.ndarray]]:
    """The body at every ``step``-th of the frames; the samples (n,) of the same times, fewer where
    the plates end before the markers; and each plate's wrench there as the file says, (n, 6),
    averaged as the body is, without plates that repeat others."""
    recording = opened.recording
    rate_hz, analog_hz = recording.marker_rate_hz, recording.analog_rate_hz
    frames = np.arange(0, recording.n_frames, step)
    samples = np.round(frames * analog_hz / rate_hz).astype(int)
    samples = samples[samples < min(len(source.usable) for source in opened.sources)]
    wrenches = {}
    smooth = {one.name: one.smoothed(SMOOTH_S * analog_hz).at(samples) for one in opened.sources}
    repeated = repeated_plates([{one.name: one for one in opened.sources}], [smooth])
    for name, source in smooth.items():
        if name not in repeated:
            wrenches[name] = source.parts() @ source.matrix(AS_STATED).T
    body = Body.of(by_segment(recording.labels, recording.markers_m), rate_hz, frames)
    return body, samples, wrenches


def _goes(
    body: Body, total: np.ndarray, by: int | np.ndarray, limits: GateLimits
) -> tuple[float, ...]:
    """As `Lags` has it from ``kept`` on, each row's force from ``by`` rows later."""
    rows, there = later_samples(len(total), by)
    later = np.where(there[:, None], total[rows], np.nan)
    kept = float(np.isfinite(later).all(axis=1).mean())
    part = Delay(kept=kept).limits(limits)
    balance = Balance.of(body, later, part)
    lift, level = balance.lift_log_likelihood(), balance.level_log_likelihood()
    return kept, lift + balance.log_likelihood(part), lift + level, lift


def paces(body: Body, total: np.ndarray, limits: GateLimits) -> np.ndarray:
    """How much better the plates' total wrench (n, 6), smoothed as the body is, is as large as each
    of `PACES` needs it, logarithm (m,), than as the first does: where the plates hold all of the
    body by the one and by the other, each by its independent numbers."""
    found = [Balance.of(body.faster(times), total, limits) for times in PACES]
    gains, stated = np.zeros(len(PACES)), found[0]
    for k, (times, one) in enumerate(zip(PACES, found, strict=True)):
        gain = one.numbers * (one.size_log_likelihood() - one.size_log_likelihood(1 / times))
        back = stated.size_log_likelihood(times) - stated.size_log_likelihood()
        gains[k] = (gain + stated.numbers * back) / max(one.numbers + stated.numbers, 1.0)
    return gains


def log_odds_of(of_trials: Sequence[Sequence[float]], times: float) -> float:
    """Of all trials so many times as fast as they are read, from what `PACES` are of each."""
    nearest = int(np.argmin(np.abs(PACES - times)))
    return float(np.sum([one[nearest] for one in of_trials]))


def pace(of_trials: Sequence[np.ndarray], percent: float) -> float:
    """How many times as fast as stated trials ran, from what `PACES` are of each; 1 where it is not
    so likely that they ran faster, or slower."""
    logs = np.sum([np.zeros(len(PACES)), *of_trials], axis=0)
    logs[1:] += OTHER_RATE - np.log(len(PACES) - 1)
    best = int(np.argmax(logs))
    same_way = np.sign(np.log(PACES)) == np.sign(np.log(PACES[best]))
    surely = np.exp(logsumexp(logs[same_way]) - logsumexp(logs))
    return float(PACES[best]) if surely >= percent / 100 else 1.0


# --- some samples of a trial ----------------------------------------------------------------------


_FEW = 100  # samples that each plate of a trial is seen by
_LOADED = 0.05  # of the largest force: less is nobody


@dataclass(frozen=True, eq=False)
class TrialSamples:
    """Some samples at which plates are loaded.

    ``sources`` by their names, none if no plate is loaded, and ``smooth``, averaged over as long as
    the ``body``; for each ``loaded`` (n,) bool; the ``feet``. ``mass_kg`` : that the forces of a
    text file carry if they are in N, 0 where that is not known. ``late`` : the same with forces of
    another ``delay``, of each that may be. ``drift_s`` : see `Lags`. ``course`` and ``sizes`` : to
    compare it with others.
    """

    name: str
    hands: Handedness
    height_m: float | None
    stature: Stature | None
    stated_height_m: float | None
    sources: dict[str, PlateSource]
    smooth: dict[str, PlateSource]
    loaded: dict[str, np.ndarray]
    feet: Feet
    body: Body
    lengths: Lengths | None = None
    mass_kg: float = 0.0
    delay: Delay = Delay()
    late: tuple[TrialSamples, ...] = ()
    drift_s: float = 0.0
    course: Course = field(default_factory=Course)
    sizes: Sizes = field(default_factory=dict)

    @classmethod
    def of(cls, opened: Opened, limits: GateLimits = USUAL) -> TrialSamples:
        recording = opened.recording
        stated = replace(
            cls._of(opened),
            lengths=opened.lengths,
            mass_kg=_mass_kg(opened),
            sizes=sizes_of(recording.labels, recording.markers_m),
        )
        if not stated.sources:
            return stated
        if (found := lags(opened, limits)) is None:
            return replace(stated, course=Course.of(opened))
        none, *others = found.delays(limits)
        late = (
            replace(cls._of(opened.with_forces_from(delay.seconds)), delay=delay)
            for delay in others
        )
        steps_s = (found.seconds[1] - found.seconds[0]) * np.arange(len(found.path_m))
        return replace(
            stated,
            course=Course.of(opened, steps_s, found.path_m, found.goes()),
            drift_s=found.drift_s,
            delay=none,
            late=tuple(one for one in late if one.sources),
        )

    @classmethod
    def _of(cls, opened: Opened) -> TrialSamples:
        recording = opened.recording
        markers, rate_hz = recording.markers_m, recording.analog_rate_hz
        segments = by_segment(recording.labels, markers)
        heavy = {}
        for source in opened.sources:
            size = np.abs(np.where(source.usable, lift_N(source), 0.0))
            most = np.percentile(size, 99) if len(size) else 0.0
            heavy[source.name] = size > max(LOADED_N, 0.5 * most)
        sources = opened.sources if any(mask.any() for mask in heavy.values()) else ()
        few = [np.flatnonzero(heavy[s.name]) for s in sources]
        few = [some[:: max(1, len(some) // _FEW)] for some in few]
        samples = np.unique(np.concatenate(few)) if few else np.zeros(0, int)
        frames = np.round(samples * recording.marker_rate_hz / rate_hz).astype(int)
        samples, frames = samples[frames < recording.n_frames], frames[frames < recording.n_frames]
        floors = [source.floor_m() for source in sources] or [0.0]
        return cls(
            name=recording.path.stem,
            hands=handedness(recording.labels, markers),
            height_m=height_m(segments),
            stature=stature(recording.labels, markers),
            stated_height_m=recording.stated.height_m,
            sources={s.name: s.at(samples) for s in sources},
            smooth={s.name: s.smoothed(SMOOTH_S * rate_hz).at(samples) for s in sources},
            loaded={s.name: heavy[s.name][samples] for s in sources},
            feet=Feet.of(recording.labels, markers, frames, floors),
            body=Body.of(segments if sources else {}, recording.marker_rate_hz, frames),
        )

    def without(self, plates: Collection[str]) -> TrialSamples:
        sources, smooth = (
            {name: one for name, one in of.items() if name not in plates}
            for of in (self.sources, self.smooth)
        )
        return replace(self, sources=sources, smooth=smooth)

    def bears_all_feet(self) -> bool:
        """Whether every foot on the ground stands on one of the plates, as the file has them."""
        outlines = [source.plate(AS_STATED).corners_m for source in self.sources.values()]
        return self.feet.all_on([one for one in outlines if one is not None])

    def in_frame(self, change: FrameChange) -> TrialSamples:
        """In other axes."""
        changed, matrix = self, change.matrix()
        if change.moves_markers:
            changed = replace(changed, body=self.body.moved(matrix), feet=self.feet.moved(matrix))
        if change.moves_forces:
            sources, smooth = (
                {name: source.moved(matrix, change.corners_only) for name, source in some.items()}
                for some in (self.sources, self.smooth)
            )
            changed = replace(changed, sources=sources, smooth=smooth)
        return changed


def _mass_kg(opened: Opened) -> float:
    """What nearly all of the force over the acceleration that it carries comes to at most."""
    if opened.lengths is None or not opened.sources:
        return 0.0
    step = max(1, round(SMOOTH_S * opened.recording.marker_rate_hz))
    body, samples, wrenches = motion_and_forces(opened, step)
    size = np.zeros(len(samples))
    for wrench in wrenches.values():
        size += np.linalg.norm(wrench[:, :3], axis=1)
    needed = GRAVITY_M_S2 + body.rate[: len(samples), 2]
    carried = size[needed > FALLS * GRAVITY_M_S2] / needed[needed > FALLS * GRAVITY_M_S2]
    loaded = carried[carried > _LOADED * carried.max(initial=0.0)]
    return float(np.percentile(loaded, 90)) if len(loaded) else 0.0
