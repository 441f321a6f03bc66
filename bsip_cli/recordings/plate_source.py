"""One plate of one recording before it is decided how its numbers are to be understood."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from typing import Protocol

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plate_reading import AS_STATED, FrameChange, PlateReading
from bsip_cli.recordings.written import AS_WRITTEN, Lengths, Written

# Of the force: what makers state for a plate's linearity and cross talk. A copy or a sum is the
# same reading and differs by rounding; the loads of two feet differ by tens of per cent mostly.
_SAME, _MOSTLY = 0.01, 0.9
_BEARS = 0.05
_MOST_TERMS = 4  # of a sum


class PlateSource(Protocol):
    """What every format's plate can say of itself; arrays are at the analog rate."""

    @property
    def name(self) -> str: ...

    @property
    def usable(self) -> np.ndarray:
        """Samples that can be believed, (n,) bool."""

    def parts(self) -> np.ndarray:
        """What every reading combines linearly, (n, k)."""

    def matrix(self, reading: PlateReading) -> np.ndarray:
        """From the parts to the wrench about the world's origin, world frame, (6, k)."""

    def at(self, samples: np.ndarray) -> PlateSource:
        """These samples alone."""

    def later(self, by: int) -> PlateSource:
        """Each sample's ``by``-th after it, not usable where there is none."""

    def smoothed(self, sigma: float) -> PlateSource:
        """Averaged with a bell of a standard deviation of so many samples."""

    def plate(self, reading: PlateReading) -> Plate:
        """In the world frame."""

    def level_matrices(self, reading: PlateReading) -> tuple[np.ndarray, np.ndarray] | None:
        """From the parts to the horizontal moment at the points that the file calls centres of
        pressure, as read and as written, (2, k) each; None where it names no such points."""

    def lever_m(self, reading: PlateReading) -> np.ndarray | None:
        """How far from the sensor, or from the origin of its points, the force is, (n,); None where
        there is neither."""

    def sensors_log_likelihood(self, reading: PlateReading) -> float:
        """How likely a plate's single sensors share its load so, logarithm; 0 without any."""

    def in_place_of(self, other: PlateSource) -> PlateSource:
        """This force where the other one is."""

    def floor_m(self, reading: PlateReading = AS_STATED) -> float:
        """Height of the surface, world frame."""

    def scaled(self, times: float) -> PlateSource:
        """So many times the force and moment."""

    def moved(self, change: np.ndarray, corners_only: bool = False) -> PlateSource:
        """In other axes of the world (3, 3), turned or as if seen in a mirror; what channels hold
        is mirrored too unless ``corners_only``."""

    def alternatives(self) -> Iterable[PlateReading]:
        """Other ways to understand the numbers, sign and size of the outline aside."""

    def findings(self, reading: PlateReading) -> list[Finding]:
        """What is to be said of this reading beyond its words."""


def later_samples(n: int, by: int) -> tuple[np.ndarray, np.ndarray]:
    """The ``by``-th after each of n samples, the nearest one where there is none, and where."""
    samples = np.arange(n) + by
    return samples.clip(0, n - 1), (samples >= 0) & (samples < n)


def lift_N(source: PlateSource) -> np.ndarray:
    """Vertical force as the file says, world frame, (n,)."""
    return np.asarray(source.parts() @ source.matrix(AS_STATED)[2])


@dataclass(frozen=True, eq=False)
class Opened:
    """A recording as its file has it, before it is decided how its plates' numbers are understood:
    ``recording`` is without its plates. ``lengths`` where markers and forces have a file each, and
    ``reread`` to open these otherwise than they say."""

    recording: Recording
    sources: tuple[PlateSource, ...]
    lengths: Lengths | None = None
    reread: Callable[[Written], Opened] | None = None

    def as_written(self, written: Written) -> Opened:
        """With forces in another unit and cameras of another rate than the files say."""
        return self.reread(written) if self.reread and written != AS_WRITTEN else self

    def with_plates(self, numbers: Collection[int]) -> Opened:
        """Only plates of these numbers; without any, all."""
        names = set(map(str, numbers))
        chosen = (source for source in self.sources if not names or source.name in names)
        return replace(self, sources=tuple(chosen))

    def with_forces_from(self, delay_s: float) -> Opened:
        """With the forces of so much later, of a clock that came late."""
        by = round(delay_s * self.recording.analog_rate_hz)
        return replace(self, sources=tuple(one.later(by) for one in self.sources)) if by else self

    def with_gains(self, gains: Mapping[str, float]) -> Opened:
        """What plates of these names read over the gain of each."""
        scaled = (one.scaled(1 / gains.get(one.name, 1.0)) for one in self.sources)
        return replace(self, sources=tuple(scaled)) if gains else self

    def in_frame(self, change: FrameChange) -> Opened:
        """In other axes."""
        recording, sources, matrix = self.recording, self.sources, change.matrix()
        if change.moves_markers:
            recording = replace(recording, markers_m=recording.markers_m @ matrix.T)
        if change.moves_forces:
            sources = tuple(one.moved(matrix, change.corners_only) for one in sources)
        return replace(self, recording=recording, sources=sources)


def in_lab(change: np.ndarray, rotation_world_lab: np.ndarray) -> np.ndarray:
    """A change of the world's axes, as one of the lab's, (3, 3)."""
    return np.asarray(rotation_world_lab.T @ change @ rotation_world_lab)


def averaged(values: np.ndarray, usable: np.ndarray, sigma: float) -> np.ndarray:
    """Averaged over samples (n, k), with nothing where they are not usable."""
    known = np.where(usable[:, None], np.nan_to_num(values), 0.0)
    return np.asarray(gaussian_filter1d(known, sigma, axis=0, mode="nearest"))


# --- plates that are copies or sums of others, as treadmills and virtual plates export them -------


def repeated_plates(trials: Sequence[Mapping[str, PlateSource]]) -> dict[str, tuple[str, ...]]:
    """Names of plates whose force is that of another, or the sum of others, in every trial.

    Fewer terms are tried first, so that each is needed; of two copies the later one repeats. Forces
    are vertical ones, whichever way the plate lies and its signs are.
    """
    repeated: dict[str, tuple[str, ...]] = {}
    forces = [
        {name: np.where(s.usable, np.abs(lift_N(s)), np.nan) for name, s in trial.items()}
        for trial in trials
    ]
    names = list(dict.fromkeys(n for trial in trials for n in trial))
    for name in reversed(names):
        others = [n for n in names if n != name and n not in repeated]
        earlier = [n for n in others if names.index(n) < names.index(name)]
        sums = (combinations(others, n) for n in range(2, min(len(others), _MOST_TERMS) + 1))
        possible = chain(combinations(earlier, 1), *sums)
        terms = next((some for some in possible if _is_sum(forces, name, some)), None)
        if terms is not None:
            repeated[name] = terms
    return repeated


def _is_sum(trials: Sequence[Mapping[str, np.ndarray]], name: str, terms: Sequence[str]) -> bool:
    """In every trial that has them all."""
    common = [trial for trial in trials if name in trial and all(t in trial for t in terms)]
    if not common:
        return False
    forces = np.stack([np.concatenate([t[n] for t in common]) for n in (name, *terms)])
    forces = forces[:, np.isfinite(forces).all(axis=0)]
    if not forces[0].any():
        return False
    # Plates that bear nothing are alike; a few samples may be damaged on one of them.
    loaded = forces.max(axis=0) > _BEARS * forces.max()
    gap = np.abs(forces[0] - forces[1:].sum(axis=0))[loaded]
    return bool(np.mean(gap < _SAME * forces[0, loaded]) > _MOSTLY)
