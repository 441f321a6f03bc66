"""A way to understand all recordings of a session, and how likely it is that a person makes it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from bsip_cli.recordings.body_motion import (
    INDEPENDENT_S,
    Balance,
    Body,
    GateLimits,
    turn_of_forces,
)
from bsip_cli.recordings.plate_reading import (
    AS_STATED,
    EXCHANGED,
    ONE_ALONE,
    OTHER_GAIN,
    REVERSED,
    FrameChange,
    PlateReading,
    PlateSource,
)
from bsip_cli.recordings.plates import cop_at_height
from bsip_cli.recordings.plates_of_files import ForceOnPoint
from bsip_cli.recordings.shared_forces import ALIKE_M
from bsip_cli.recordings.trial_samples import TrialSamples, pace, paces
from bsip_cli.recordings.under_the_feet import (
    PASSES_M,
    Evidence,
    Feet,
    evidence,
    lever_log_likelihood,
    log_likelihood,
    mean_evidence,
)

AS_IT_IS = "taken as they stand"

# Readings whose centres of pressure differ by less than `ALIKE_M` are one, if their forces differ
# by less than this part of the load, and their vertical moments by less than this times it.
_ALIKE_SHARE, _ALIKE_TORQUE_M = 0.01, 0.003
_CLEARLY, _IN_19_OF_20 = 3.0, 1.96  # standard deviations
# Of one plate, that masses do not show for sure: steps of an eighth.
_GAINS = np.geomspace(0.4, 2.5, 16)
_PULLS = 3.0  # a force is reversed if it pulls so many times what it pushes


# --- what readings make of one plate in all trials -----------------------------------------------


@dataclass(frozen=True, eq=False)
class PlateTrial:
    """A plate in one trial: ``source`` at the samples in which it is loaded, with its parts (n, k)
    there and, averaged, at all samples of the trial, ``smooth`` (m, k); ``apart`` (n,) where one
    other plate is loaded too: two feet, two plates; ``body_m`` (n, 3) the centre of mass,
    NaN where that is but for a moment; ``passes`` (n,) where it goes over this plate alone."""

    trial: int
    source: PlateSource
    parts: np.ndarray
    smooth: np.ndarray
    feet: Feet
    apart: np.ndarray
    corners_m: np.ndarray | None
    body_m: np.ndarray
    passes: np.ndarray

    @classmethod
    def of(cls, trial: int, samples: TrialSamples, name: str, place: str) -> PlateTrial:
        """The plate ``name`` in its own place, or in that of another one."""
        source, smooth = samples.sources[name], samples.smooth[name]
        if place:
            source = source.in_place_of(samples.sources[place])
            smooth = smooth.in_place_of(samples.smooth[place])
        loaded = np.flatnonzero(samples.loaded[name])
        source, corners = source.at(loaded), source.plate(AS_STATED).corners_m
        feet = samples.feet.at(loaded).on(corners)
        others = [samples.loaded[other][loaded] for other in samples.sources if other != name]
        besides = np.sum(others, axis=0) if others else np.zeros(len(loaded), int)
        apart, alone = besides == 1, besides == 0
        smooth_parts = np.nan_to_num(smooth.parts())
        body = samples.body.place_m[loaded].copy()
        way = body[alone & np.isfinite(body).all(axis=1), :2]
        goes = len(way) > 0 and float(np.linalg.norm(np.ptp(way, axis=0))) > PASSES_M
        if samples.body.lasts_s[loaded][apart].sum() < INDEPENDENT_S:
            body[:] = np.nan
        return cls(
            trial, source, source.parts(), smooth_parts, feet, apart, corners, body, alone & goes
        )


@dataclass(frozen=True, eq=False)
class PlateFit:
    """A reading, with its sign and its fixed point, and how well it makes forces under feet.

    For each of n trials that have the plate: from the parts to the wrench, ``matrices`` (6, k), and
    what it shows, ``found`` (n, 10), with its logarithmic likelihood, of all trials together; that
    of its sensors is ``of_sensors``.
    """

    reading: PlateReading
    trials: Sequence[PlateTrial]
    matrices: Sequence[np.ndarray]
    found: np.ndarray
    log_likelihood: float
    of_sensors: float

    def log_likelihood_of_nobody(self) -> float:
        """The part that distinguishes readings from one another, and no person from nobody."""
        return float(lever_log_likelihood(self.found).sum()) + self.of_sensors

    def evidence(self) -> Evidence:
        """Mean over the trials."""
        return mean_evidence(self.found)

    def wrenches(self, smooth: bool = False) -> dict[int, np.ndarray]:
        """About the world's origin by trial, of the loaded samples (n, 6), or averaged of all."""
        pairs = zip(self.trials, self.matrices, strict=True)
        return {one.trial: (one.smooth if smooth else one.parts) @ m.T for one, m in pairs}


def plate_fits(
    trials: Sequence[TrialSamples], name: str, readings: Sequence[PlateReading]
) -> list[PlateFit]:
    """Of readings that all put the plate in the same place."""
    (place,) = {reading.place_of for reading in readings}
    seen = [PlateTrial.of(k, t, name, place) for k, t in enumerate(trials) if name in t.sources]
    readings = [replace(reading, sign=1) for reading in readings]
    points = [one.source for one in seen if isinstance(one.source, ForceOnPoint)]
    readings = [
        ForceOnPoint.with_centre(points, one) if one.about == "fixed" else one for one in readings
    ]
    matrices, found, push, pull = [], [], 0.0, 0.0
    for one in seen:
        every = np.array([one.source.matrix(reading) for reading in readings])  # (r, 6, k)
        wrench = one.parts @ every.swapaxes(1, 2)
        push = push + wrench[..., 2].clip(min=0).sum(axis=1)
        pull = pull + (-wrench[..., 2]).clip(min=0).sum(axis=1)
        matrices.append(every)
        found.append(_evidence(one, readings, wrench))
    of_sensors = [sum(one.source.sensors_log_likelihood(r) for one in seen) for r in readings]
    likely = log_likelihood(np.array(found)).sum(axis=0) + of_sensors
    signs = np.where(pull > _PULLS * push, -1, 1)  # mirrored corners turn a plate's axis over
    return [
        PlateFit(
            replace(reading, sign=int(sign)),
            seen,
            [sign * every[k] for every in matrices],
            np.array([rows[k] for rows in found]),
            float(likely[k]),
            of_sensors[k],
        )
        for k, (reading, sign) in enumerate(zip(readings, signs, strict=True))
    ]


def _evidence(one: PlateTrial, readings: Sequence[PlateReading], wrench: np.ndarray) -> np.ndarray:
    floors = np.array([one.source.floor_m(reading) for reading in readings])
    levers = [one.source.lever_m(reading) for reading in readings]
    levels = [one.source.level_matrices(reading) for reading in readings]
    level_Nm = None
    if all(level is not None for level in levels):
        both = one.parts @ np.array(levels).transpose(1, 0, 3, 2)  # (2, r, n, 2)
        level_Nm = tuple(np.linalg.norm(both, axis=-1))
    lever = None if levers[0] is None else np.array(levers)
    where = one.feet, one.apart, one.corners_m, lever, level_Nm, one.body_m, one.passes
    return evidence(wrench, floors, *where)


# --- of all plates, in axes that are the same for all ---------------------------------------------


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
        cops = [
            cop_at_height(wrench[:, :3], wrench[:, 3:], fit.trials[0].source.floor_m(fit.reading))
            for fit in self.fits.values()
            for wrench in fit.wrenches().values()
        ]
        far = max((np.sqrt(np.nanmean((c**2).sum(axis=1))) for c in cops if len(c)), default=0.0)
        return FrameChange(
            "forces",
            turned_deg=round(float(angle), 2),
            turned_sd_deg=round(float(sd), 2),
            unsure_m=round(float(_IN_19_OF_20 * np.deg2rad(sd) * far), 3),
        )

    @cached_property
    def balance(self) -> Balance:
        return Balance.of(self.body, self._total(), self.limits)

    def _total(self, names: Collection[str] = ()) -> np.ndarray:
        """The wrench of all plates, or of some, at the samples of all trials, (n, 6)."""
        return np.concatenate(self._totals(names or self.fits))

    def _totals(self, names: Collection[str]) -> list[np.ndarray]:
        total = [np.zeros((len(trial.body.trial), 6)) for trial in self.trials]
        for name in names:
            for k, wrench in self.fits[name].wrenches(smooth=True).items():
                total[k] += wrench
        return total

    @cached_property
    def of_paces(self) -> dict[str, np.ndarray]:
        totals = zip(self.trials, self._totals(self.fits), strict=True)
        return {trial.name: paces(trial.body, total, self.limits) for trial, total in totals}

    def paces(self, percent: float) -> dict[str, float]:
        """How many times as fast as stated trials ran, other than 1, where that is so likely: one
        for all, where together they show it, or else each its own."""
        of_all = pace(list(self.of_paces.values()), percent)
        own = {name: pace([one], percent) for name, one in self.of_paces.items()}
        found = own if of_all == 1.0 else dict.fromkeys(own, of_all)
        return {name: times for name, times in found.items() if times != 1.0}

    @cached_property
    def log_posterior(self) -> float:
        """But for a constant."""
        return self._log_on_feet() + self.balance.log_likelihood(self.limits)

    def _log_on_feet(self) -> float:
        return self._log_prior() + sum(fit.log_likelihood for fit in self.fits.values())

    def log_posterior_of_gains(self) -> float:
        """The same where besides one plate of several may have another gain, which moves no centre
        of pressure and which no reading mends."""
        if len(self.fits) == 1:
            return self.log_posterior
        total = self._total()
        gained = [
            Balance.of(self.body, total + (gain - 1.0) * own, self.limits)
            for own in map(self._total, ([name] for name in self.fits))
            for gain in _GAINS
        ]
        logs = [one.log_likelihood(self.limits) for one in gained]
        some = float(logsumexp(logs) - np.log(len(_GAINS)))
        return float(np.logaddexp(self.log_posterior, self._log_on_feet() + OTHER_GAIN + some))

    def _log_prior(self) -> float:
        """How rare it is that so much is wrong at once, logarithm; what is wrong with several
        plates alike is one fault, whatever else is wrong with one of them."""
        readings = [fit.reading for fit in self.fits.values()]
        each = [reading.repairs() for reading in readings]
        repairs = {what: rare for one in each for what, rare in one.items()}
        alone = sum(not all(what in one for one in each) for what in repairs)
        return (
            self.frame.log_prior()
            + sum(repairs.values())
            + ONE_ALONE * alone
            + EXCHANGED * sum(bool(reading.place_of) for reading in readings) / 2
            + REVERSED * any(reading.sign < 0 for reading in readings)
        )

    def words(self, name: str, now: Hypothesis) -> str:
        """What is done to a plate's numbers, as a clause; to the axes where they are others."""
        axes = self.frame.words() if self.frame != now.frame else ""
        return ", ".join(filter(None, (axes, self.fits[name].reading.words()))) or AS_IT_IS

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
        for repair, every in possible.items():
            some = {n: fit for n, fit in every.items() if fit.reading != self.fits[n].reading}
            if repair != AS_STATED and some:
                yield self._with(some)
                yield from (self._with({name: fit}) for name, fit in some.items() if len(some) > 1)
        for pair in combinations(self.fits, 2):
            if all(name in trial.sources for trial in self.trials for name in pair):
                exchanged = {}
                for name, other in (pair, pair[::-1]):
                    place = self.fits[other].reading.place_of or other
                    reading = replace(self.fits[name].reading, place_of=place * (place != name))
                    (exchanged[name],) = plate_fits(self.trials, name, [reading])
                yield self._with(exchanged)

    def _with(self, fits: Mapping[str, PlateFit]) -> Hypothesis:
        return Hypothesis(self.frame, self.trials, self.body, {**self.fits, **fits}, self.limits)


def _with(repair: PlateReading, now: PlateReading) -> PlateReading:
    """One more repair of a plate's numbers; one of its channels may come with another reference."""
    if repair.channels:
        about = now.about if repair.about == "stated" else repair.about
        return replace(now, channels=repair.channels, about=about)
    return replace(repair, place_of=now.place_of, channels=now.channels)


def _are_alike(one: PlateFit, other: PlateFit, with_torque: bool) -> bool:
    others = other.wrenches()
    for plate, wrench in zip(one.trials, one.wrenches().values(), strict=True):
        if not len(wrench):
            continue
        both = np.array([wrench, others[plate.trial]])
        floors = np.array([[plate.source.floor_m(fit.reading)] for fit in (one, other)])
        cop = cop_at_height(both[..., :3], both[..., 3:], floors)
        load = np.abs(wrench[:, 2]).mean()
        apart = np.linalg.norm(both[0, :, :3] - both[1, :, :3], axis=1)
        if np.nanmax(np.abs(cop[0] - cop[1]), initial=0.0) >= ALIKE_M:
            return False
        if apart.mean() > _ALIKE_SHARE * load:
            return False
        torque = both[..., 5] - cop[..., 0] * both[..., 1] + cop[..., 1] * both[..., 0]
        if with_torque and np.nanmedian(np.abs(torque[0] - torque[1])) > _ALIKE_TORQUE_M * load:
            return False
    return True
