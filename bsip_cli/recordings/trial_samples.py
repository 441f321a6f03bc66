"""What is kept of a trial until all of a session are seen: small, however long it is."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.body_motion import FALLS, SMOOTH_S, USUAL, Body, GateLimits
from bsip_cli.recordings.clock import NO_DELAY, Delay, lags, motion_and_forces
from bsip_cli.recordings.label_words import meanings
from bsip_cli.recordings.plate_reading import FrameChange
from bsip_cli.recordings.plate_source import Opened, PlateSource, lift_N
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.scene import Handedness, Stature, by_segment, handedness, height_m, stature
from bsip_cli.recordings.under_the_feet import Feet
from bsip_cli.recordings.written import Lengths

_FEW = 100  # samples that each plate of a trial is seen by
_LOADED = 0.05  # of the largest force: less is nobody


@dataclass(frozen=True, eq=False)
class TrialSamples:
    """Some samples at which plates are loaded.

    ``sources`` by their names, none if no plate is loaded, and ``smooth``, averaged over as long as
    the ``body``; for each ``loaded`` (n,) bool; the ``feet``. ``mass_kg`` : that the forces of a
    text file carry if they are in N, 0 where that is not known. ``late`` : the same with forces of
    another ``delay``, of each that may be.
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

    @classmethod
    def of(cls, opened: Opened, limits: GateLimits = USUAL) -> TrialSamples:
        stated = replace(cls._of(opened), lengths=opened.lengths, mass_kg=_mass_kg(opened))
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
