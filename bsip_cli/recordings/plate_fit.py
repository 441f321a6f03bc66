"""What readings make of one plate in all trials of a session."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.recordings.body_motion import INDEPENDENT_S
from bsip_cli.recordings.plate_of_table import ForceOnPoint
from bsip_cli.recordings.plate_reading import AS_STATED, PlateReading
from bsip_cli.recordings.plate_source import PlateSource
from bsip_cli.recordings.trial_samples import TrialSamples
from bsip_cli.recordings.under_the_feet import (
    Evidence,
    Feet,
    evidence,
    lever_log_likelihood,
    log_likelihood,
    mean_evidence,
)

_PULLS = 3.0  # a force is reversed if it pulls so many times what it pushes


@dataclass(frozen=True, eq=False)
class PlateTrial:
    """A plate in one trial: ``source`` at the samples in which it is loaded, with its parts (n, k)
    there and, averaged, at all samples of the trial, ``smooth`` (m, k); ``apart`` (n,) where one
    other plate is loaded too: two feet, two plates; ``body_m`` (n, 3) the centre of mass,
    NaN where that is but for a moment."""

    trial: int
    source: PlateSource
    parts: np.ndarray
    smooth: np.ndarray
    feet: Feet
    apart: np.ndarray
    corners_m: np.ndarray | None
    body_m: np.ndarray

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
        apart = np.sum(others, axis=0, initial=0) == 1 if others else np.zeros(len(loaded), bool)
        smooth_parts = np.nan_to_num(smooth.parts())
        body = samples.body.place_m[loaded].copy()
        if samples.body.lasts_s[loaded][apart].sum() < INDEPENDENT_S:
            body[:] = np.nan
        return cls(trial, source, source.parts(), smooth_parts, feet, apart, corners, body)


@dataclass(frozen=True, eq=False)
class PlateFit:
    """A reading, with its sign and its fixed point, and how well it makes forces under feet.

    For each of n trials that have the plate: from the parts to the wrench, ``matrices`` (6, k), and
    what it shows, ``found`` (n, 8), with its logarithmic likelihood, of all trials together; that
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

    def wrenches(self) -> dict[int, np.ndarray]:
        """Of the loaded samples about the world's origin (n, 6), by trial."""
        pairs = zip(self.trials, self.matrices, strict=True)
        return {one.trial: one.parts @ matrix.T for one, matrix in pairs}

    def smooth_wrenches(self) -> dict[int, np.ndarray]:
        """Of all samples (m, 6), by trial."""
        pairs = zip(self.trials, self.matrices, strict=True)
        return {one.trial: one.smooth @ matrix.T for one, matrix in pairs}


def plate_fits(
    trials: Sequence[TrialSamples], name: str, readings: Sequence[PlateReading]
) -> list[PlateFit]:
    """Of readings that all put the plate in the same place."""
    (place,) = {reading.place_of for reading in readings}
    seen = [PlateTrial.of(k, t, name, place) for k, t in enumerate(trials) if name in t.sources]
    readings = [_centred(replace(reading, sign=1), seen) for reading in readings]
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
    return evidence(wrench, floors, one.feet, one.apart, one.corners_m, lever, level_Nm, one.body_m)


def _centred(reading: PlateReading, seen: Sequence[PlateTrial]) -> PlateReading:
    """With the fixed point that suits all trials, if the moments are about one."""
    if reading.about != "fixed":
        return reading
    some = [one.source for one in seen if isinstance(one.source, ForceOnPoint)]
    return ForceOnPoint.with_centre(some, reading)
