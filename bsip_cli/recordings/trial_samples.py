"""What is kept of a trial until all of a session are seen: small, however long it is."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.body_motion import FALLS, SMOOTH_S, USUAL, Body, GateLimits
from bsip_cli.recordings.clock import NO_DELAY, Delay, lags, motion_and_forces
from bsip_cli.recordings.label_words import meanings
from bsip_cli.recordings.plate_reading import AS_STATED, FrameChange
from bsip_cli.recordings.plate_source import Opened, PlateSource, lift_N
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.scene import Handedness, Stature, by_segment, handedness, height_m, stature
from bsip_cli.recordings.under_the_feet import Feet
from bsip_cli.recordings.written import Lengths

_FEW = 100  # samples that each plate of a trial is seen by
_LOADED = 0.05  # of the largest force: less is nobody
_BLOCK_S = 0.02  # over which a total is averaged: filters leave it as it is
_SAME = 0.999  # correlation of totals over equal times: nobody moves twice so alike


@dataclass(frozen=True, eq=False)
class TrialSamples:
    """Some samples at which plates are loaded.

    ``sources`` by their names, none if no plate is loaded, and ``smooth``, averaged over as long as
    the ``body``; for each ``loaded`` (n,) bool; the ``feet``. ``mass_kg`` : that the forces of a
    text file carry if they are in N, 0 where that is not known. ``late`` : the same with forces of
    another ``delay``, of each that may be. ``total_N`` : the plates' vertical force in each 20 ms.
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
    delay: Delay = NO_DELAY
    late: tuple[TrialSamples, ...] = ()
    total_N: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, opened: Opened, limits: GateLimits = USUAL) -> TrialSamples:
        stated = replace(cls._of(opened), lengths=opened.lengths, mass_kg=_mass_kg(opened))
        if stated.sources:
            stated = replace(stated, total_N=_total_N(opened))
        found = lags(opened, limits) if stated.sources else None
        if found is None:
            return stated
        none, *others = found.delays(limits)
        late = (
            replace(cls._of(opened.with_forces_from(delay.seconds)), delay=delay)
            for delay in others
        )
        return replace(stated, delay=none, late=tuple(one for one in late if one.sources))

    @classmethod
    def _of(cls, opened: Opened) -> TrialSamples:
        recording = opened.recording
        markers, rate_hz = recording.markers_m, recording.analog_rate_hz
        segments = by_segment(recording.labels, markers)
        heavy = {s.name: _heavy(np.where(s.usable, lift_N(s), 0.0)) for s in opened.sources}
        sources = opened.sources if any(mask.any() for mask in heavy.values()) else ()
        few = [np.flatnonzero(heavy[s.name]) for s in sources]
        few = [some[:: max(1, len(some) // _FEW)] for some in few]
        samples = np.unique(np.concatenate(few)) if few else np.zeros(0, int)
        frames = np.round(samples * recording.marker_rate_hz / rate_hz).astype(int)
        samples, frames = samples[frames < recording.n_frames], frames[frames < recording.n_frames]
        known = meanings(recording.labels)
        sides = [known[n].segment[-1] if n in known else "" for n in recording.labels]
        sides = [side if side in "lr" else "" for side in sides]
        floor = sources[0].floor_m() if sources else 0.0
        return cls(
            name=recording.path.stem,
            hands=handedness(recording.labels, markers),
            height_m=height_m(segments),
            stature=stature(recording.labels, markers),
            stated_height_m=recording.stated.height_m,
            sources={s.name: s.at(samples) for s in sources},
            smooth={s.name: s.smoothed(SMOOTH_S * rate_hz).at(samples) for s in sources},
            loaded={s.name: heavy[s.name][samples] for s in sources},
            feet=Feet.of(markers, sides, frames, floor if abs(floor) < 1.0 else 0.0),
            body=Body.of(segments if sources else {}, recording.marker_rate_hz, frames),
        )

    def without(self, plates: Collection[str]) -> TrialSamples:
        return replace(self, sources={n: s for n, s in self.sources.items() if n not in plates})

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


def _heavy(lift_N: np.ndarray) -> np.ndarray:
    size = np.abs(lift_N)
    return size > max(LOADED_N, 0.5 * np.percentile(size, 99)) if len(size) else size > 0


def same_movements(trials: Sequence[TrialSamples]) -> list[tuple[str, str]]:
    """Names of pairs that are one recording, exported twice: filtered, renamed, in two formats."""
    return [
        (one.name, other.name)
        for one, other in combinations(trials, 2)
        if _are_same(one.total_N, other.total_N)
    ]


def _are_same(one: np.ndarray, other: np.ndarray) -> bool:
    n = min(len(one), len(other))
    if max(len(one), len(other)) > n + 1 or n < _FEW:
        return False
    both = np.array([one[:n], other[:n]])
    return bool(both.std(axis=1).all() and abs(np.corrcoef(both)[0, 1]) > _SAME)


def _total_N(opened: Opened) -> np.ndarray:
    """(n,) of all plates, as the file says."""
    lifts = [np.where(s.usable, np.nan_to_num(lift_N(s)), 0.0) for s in opened.sources]
    step = max(1, round(_BLOCK_S * opened.recording.analog_rate_hz))
    total = np.sum(lifts, axis=0) if lifts else np.zeros(0)
    return np.asarray(total[: len(total) // step * step].reshape(-1, step).mean(axis=1))
