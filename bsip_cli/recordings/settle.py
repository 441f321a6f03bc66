"""How each plate's numbers are to be understood, decided over all trials of a session alike.

A few repairs are tried: other units, another point that moments are about, the corners in another
order, two plates exchanged; for all plates alike or for one. Each has a prior, how rare it is, and
a likelihood, how well forces so understood press under a person's feet (`under_the_feet`). One that
is surely better than what the files say is made; where nothing makes a person of the forces, the
plate is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import logsumexp

from bsip_cli.recordings.body_motion import (
    SMOOTH_S,
    Body,
    Harmony,
    Match,
    balance_log_likelihood,
)
from bsip_cli.recordings.handedness import Handedness, handedness
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.person_size import by_segment, height_m
from bsip_cli.recordings.plate_reading import (
    AS_STATED,
    EXCHANGED,
    MIRRORED,
    ONE_ALONE,
    REVERSED,
    TURNED,
    PlateReading,
)
from bsip_cli.recordings.plate_source import C3dPlate, ForceOnPoint, PlateSource
from bsip_cli.recordings.plates import LOADED_N, inside_share
from bsip_cli.recordings.repeated_plates import repeated_plates
from bsip_cli.recordings.under_the_feet import BESIDE_M, Area, Evidence, Feet, evidence

_SURE = 0.95  # probability from which on a repair is made
_RATHER = 0.9  # probability from which on the file is believed
_SURELY_NOBODY = 0.999  # probability from which on no reading is believed
_LEAST_LIKELY = -12.0  # logarithm: less adds nothing
_FEW = 100  # samples that each plate of a trial is seen by
_ALIKE_M = 0.01  # readings whose centres of pressure differ by less are one,
_ALIKE_SHARE = 0.03  # if their forces differ by less than this part of the load,
_ALIKE_TORQUE_M = 0.003  # and their vertical moments by less than this times the load
_RIM_M = 0.02
_MOSTLY_OUTSIDE = 0.2  # share inside the outline
_TOUCHED_N = 20.0
_PULLS = 3.0  # a force is reversed if it pulls so many times what it pushes

# Logarithms: how often something else is wrong; how each trial and plate looks then (a person: -1).
_UNKNOWN, _UNKNOWN_EACH = -6.2, -1.5
_IN_PART = -2.3  # markers or forces alone are mirrored more rarely than both: one in ten

_AS_IT_IS = "taken as they stand"
_UNTOLD = "its numbers are no force under a foot as they stand, and several corrections make one"
_AGAINST = "its force is not one that carries and drives the body that the markers show"

Readings = Mapping[str, PlateReading]
Moved = Literal["", "all", "markers", "forces"]


@dataclass(frozen=True, eq=False)
class Opened:
    """A recording whose plates are not yet understood; ``recording`` is without them."""

    recording: Recording
    sources: tuple[PlateSource, ...]

    def with_plates(self, numbers: Collection[int]) -> Opened:
        """Only plates of these numbers; without any, all."""
        names = set(map(str, numbers))
        chosen = (source for source in self.sources if not names or source.name in names)
        return replace(self, sources=tuple(chosen))


@dataclass(frozen=True, eq=False)
class Look:
    """What one trial shows: some loaded samples, small however long the trial is.

    ``sources`` by their names at these samples, and ``smooth`` averaged over as long as the
    ``body``; for each ``loaded`` (n,) bool; the ``feet``.
    """

    sources: dict[str, PlateSource]
    smooth: dict[str, PlateSource]
    loaded: dict[str, np.ndarray]
    feet: Feet
    body: Body

    def areas(self) -> dict[str, Area]:
        """Of the feet on each plate's place."""
        places = {n: s.plate(AS_STATED).corners_m for n, s in self.sources.items()}
        return {name: self.feet.on(corners).area() for name, corners in places.items()}

    def seen_in(self, scene: Scene) -> Look:
        """In the axes of a scene."""
        changed = self
        if scene.moved in ("all", "markers"):
            body, feet = self.body.moved(scene.change()), self.feet.moved(scene.change())
            changed = replace(changed, body=body, feet=feet)
        if scene.moved in ("all", "forces"):
            sources, smooth = (
                {
                    name: source.moved(scene.change(), scene.corners_only)
                    for name, source in some.items()
                }
                for some in (self.sources, self.smooth)
            )
            changed = replace(changed, sources=sources, smooth=smooth)
        return changed


@dataclass(frozen=True)
class Verdict:
    """How a plate is understood, or why it is left out (``refusal``, a clause).

    ``before`` and ``after``: what its numbers make as the file says, and as they are understood,
    where that differs. ``rivals``: repairs that would each explain a plate, and that cannot be
    told apart: it is left out, or, if only the vertical moment differs, doubted. ``repeats`` names
    the plates whose copy or sum it is.
    """

    reading: PlateReading = field(default_factory=PlateReading)
    before: Evidence | None = None
    after: Evidence | None = None
    refusal: str = ""
    rivals: tuple[str, ...] = ()
    repeats: tuple[str, ...] = ()


def look_at(opened: Opened) -> Look | None:
    """What a trial shows of its plates; None if none is loaded."""
    recording, sources = opened.recording, opened.sources
    heavy = {s.name: _heavy(np.where(s.usable, s.lift_N(), 0.0)) for s in sources}
    chosen = [np.flatnonzero(mask) for mask in heavy.values()]
    chosen = [some[:: max(1, len(some) // _FEW)] for some in chosen if len(some)]
    if not chosen:
        return None
    samples = np.unique(np.concatenate(chosen))
    frames = np.round(samples * recording.marker_rate_hz / recording.analog_rate_hz).astype(int)
    samples, frames = samples[frames < recording.n_frames], frames[frames < recording.n_frames]
    floor = sources[0].floor_m(AS_STATED)
    sigma = SMOOTH_S * recording.analog_rate_hz
    return Look(
        sources={s.name: s.at(samples) for s in sources},
        smooth={s.name: s.smoothed(sigma).at(samples) for s in sources},
        loaded={name: mask[samples] for name, mask in heavy.items()},
        feet=Feet.of(recording.markers_m, frames, floor if abs(floor) < 1.0 else 0.0),
        body=Body.of(
            by_segment(recording.labels, recording.markers_m), recording.marker_rate_hz, frames
        ),
    )


@dataclass(frozen=True)
class Scene:
    """In what axes the world is written that are not those of the person: all of it, the markers
    or the forces alone; mirrored along an ``axis``, or turned about the vertical.

    corners_only : of a C3D the channels were not mirrored with the plates' corners.
    """

    moved: Moved = ""
    axis: int = 0
    quarter_turns: int = 0
    corners_only: bool = False

    def change(self) -> np.ndarray:
        """From the axes as written to those of the person, (3, 3)."""
        if self.quarter_turns:
            c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][self.quarter_turns]
            return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return np.diag([-1.0 if k == self.axis else 1.0 for k in range(3)])

    def of(self, opened: Opened) -> Opened:
        """The recording put right."""
        recording, sources = opened.recording, opened.sources
        if self.moved in ("all", "markers"):
            markers = recording.markers_m @ self.change().T
            recording = replace(recording, markers_m=markers)
        if self.moved in ("all", "forces"):
            change = self.change()
            sources = tuple(source.moved(change, self.corners_only) for source in sources)
        return Opened(recording, sources)

    def of_markers(self) -> tuple[bool, int]:
        """What is done to the markers."""
        is_moved = self.moved in ("all", "markers")
        return is_moved, self.axis * is_moved

    def log_prior(self) -> float:
        if self.moved == "forces":
            return TURNED if self.quarter_turns else MIRRORED
        return _IN_PART if self.moved == "markers" else 0.0

    def words(self) -> str:
        """What is done, as a clause; empty if nothing."""
        if not self.moved:
            return ""
        what = {"all": "markers and forces", "markers": "the markers", "forces": "the forces"}
        if self.quarter_turns:
            return f"turned {what[self.moved]} by {90 * self.quarter_turns} degrees"
        return f"reversed the {'XY'[self.axis]} axis of {what[self.moved]}"


_MIRRORS = (
    Scene("all"),
    Scene("all", corners_only=True),
    Scene("markers", 0),
    Scene("markers", 1),
)
_FORCES_MOVED = (
    *(Scene("forces", axis) for axis in (0, 1)),
    *(Scene("forces", quarter_turns=turns) for turns in (1, 2, 3)),
)


@dataclass(frozen=True)
class SessionReading:
    """How all recordings of a session are to be understood: the scene, and each plate."""

    scene: Scene = field(default_factory=Scene)
    plates: Mapping[str, Verdict] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Survey:
    """What is kept of a trial until all of a session are seen: small, however long it is."""

    hands: Handedness
    look: Look | None
    height_m: float | None

    @classmethod
    def of(cls, opened: Opened) -> Survey:
        labels, markers = opened.recording.labels, opened.recording.markers_m
        return cls(
            handedness(labels, markers), look_at(opened), height_m(by_segment(labels, markers))
        )


def settle_session(trials: Sequence[Survey]) -> SessionReading:
    """The scene and the plates' readings that make a person of a session."""
    looks = [trial.look for trial in trials if trial.look is not None]
    is_mirrored = Handedness.of_all([trial.hands for trial in trials]).is_mirrored
    scenes = _MIRRORS if is_mirrored else (Scene(), *_FORCES_MOVED)
    if not looks:
        return SessionReading(scenes[0])
    repeats = repeated_plates([look.sources for look in looks])
    worlds = [_World.of(scene, looks, repeats) for scene in scenes]
    chosen = _repaired(worlds)
    verdicts = {name: _verdict(worlds[0], chosen, name) for name in worlds[0].names}
    repeated = {name: Verdict(repeats=others) for name, others in repeats.items()}
    return SessionReading(chosen.world.scene, verdicts | repeated)


def _heavy(lift_N: np.ndarray) -> np.ndarray:
    size = np.abs(lift_N)
    return size > max(LOADED_N, 0.5 * np.percentile(size, 99)) if len(size) else size > 0


class _Seen(NamedTuple):
    """A plate as read in one trial: at n samples, and smooth, (n, 6) about the world's origin."""

    evidence: Evidence
    force_N: np.ndarray
    cop_m: np.ndarray
    torque_Nm: np.ndarray
    smooth: np.ndarray


@dataclass(eq=False)
class _World:
    """A scene, and what readings make of all trials in it; each plate is read once in each way."""

    scene: Scene
    looks: Sequence[Look]
    names: Sequence[str]
    areas: Sequence[Mapping[str, Area]]
    _known: dict[tuple[str, PlateReading], list[_Seen | None]] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: Scene, looks: Sequence[Look], repeats: Collection[str]) -> _World:
        """Without plates that repeat others."""
        seen = [look.seen_in(scene) if scene.moved else look for look in looks]
        kept = [
            replace(look, sources={n: s for n, s in look.sources.items() if n not in repeats})
            for look in seen
        ]
        names = list(dict.fromkeys(name for look in kept for name in look.sources))
        return cls(scene, kept, names, [look.areas() for look in kept])

    def stated(self) -> dict[str, PlateReading]:
        """As the files say."""
        return self.signed(dict.fromkeys(self.names, AS_STATED))

    def log_likelihood(self, readings: Readings) -> float:
        total = 0.0
        for k, look in enumerate(self.looks):
            seen = [self.seen(name, readings[name])[k] for name in look.sources]
            total += sum(one.evidence.log_likelihood() for one in seen if one)
        matches = self._matches(readings)
        total += sum(map(balance_log_likelihood, matches))
        return total + Harmony.of(matches).log_likelihood()

    def lever_log_likelihood(self, readings: Readings) -> float:
        """The part of the likelihood that moments about no lever have, in all trials."""
        seen = (one for name in self.names for one in self.seen(name, readings[name]) if one)
        return float(np.nansum([one.evidence.lever_log_likelihood() for one in seen]))

    def harmony(self, readings: Readings) -> Harmony:
        return Harmony.of(self._matches(readings))

    def _matches(self, readings: Readings) -> list[Match]:
        found = []
        for k, look in enumerate(self.looks):
            seen = [self.seen(name, readings[name])[k] for name in look.sources]
            total = np.sum([one.smooth for one in seen if one], axis=0)
            found.append(look.body.match(total) if seen else Match())
        return found

    def evidence(self, name: str, reading: PlateReading) -> Evidence:
        """Mean over the trials in which the plate is loaded."""
        return Evidence.mean([one.evidence for one in self.seen(name, reading) if one])

    def signed(self, readings: Readings) -> dict[str, PlateReading]:
        """With the signs that let the person press: mirrored corners turn a plate's axis over."""
        return {name: self._signed(name, reading) for name, reading in readings.items()}

    def alternatives(self) -> dict[PlateReading, list[str]]:
        """Other readings, and the plates that they are possible for."""
        found: dict[PlateReading, list[str]] = {}
        for name in self.names:
            possible = (r for source in self._sources(name) for r in source.alternatives())
            for reading in dict.fromkeys(possible):
                if reading != AS_STATED:
                    found.setdefault(reading, []).append(name)
        return found

    def centred(self, name: str, reading: PlateReading) -> PlateReading:
        """With the fixed point that suits all trials, if the moments are about one."""
        if reading.about != "fixed":
            return reading
        some = [source for source in self._sources(name) if isinstance(source, ForceOnPoint)]
        return ForceOnPoint.with_centre(some, reading)

    def fits_outline(self, name: str, reading: PlateReading) -> PlateReading:
        """With a wider outline where the load lies under a foot but beside the stated one."""
        plates = [
            look.sources[name].at(np.flatnonzero(look.loaded[name]))
            for look in self.looks
            if name in look.sources
        ]
        of_c3d = [plate for plate in plates if isinstance(plate, C3dPlate)]
        if not of_c3d:
            return reading
        cop = np.concatenate([plate.local_cop_m(reading) for plate in of_c3d])
        stated = of_c3d[0].read_description(reading).half_size_m()
        if not inside_share(cop, stated) < _MOSTLY_OUTSIDE:
            return reading
        x, y = np.maximum(np.nanpercentile(np.abs(cop), 99, axis=0) + _RIM_M, stated).tolist()
        return replace(reading, half_size_m=(x, y))

    def _sources(self, name: str) -> list[PlateSource]:
        return [look.sources[name] for look in self.looks if name in look.sources]

    def _signed(self, name: str, reading: PlateReading) -> PlateReading:
        push = pull = 0.0
        for look in self.looks:
            if name in look.sources:
                lift = look.sources[name].lift_N(reading)[look.loaded[name]]
                push, pull = push + lift.clip(min=0).sum(), pull + (-lift).clip(min=0).sum()
        return replace(reading, sign=-1 if pull > _PULLS * push else 1)

    def seen(self, name: str, reading: PlateReading) -> list[_Seen | None]:
        """In each trial; None without the plate."""
        key = (name, reading)
        if key not in self._known:
            pairs = zip(self.looks, self.areas, strict=True)
            self._known[key] = [_read(look, areas, name, reading) for look, areas in pairs]
        return self._known[key]


def _read(look: Look, areas: Mapping[str, Area], name: str, reading: PlateReading) -> _Seen | None:
    if name not in look.sources:
        return None
    source, smooth = look.sources[name], look.smooth[name]
    if other := reading.place_of:
        source = source.in_place_of(look.sources[other])
        smooth = smooth.in_place_of(look.smooth[other])
    plate, floor = source.plate(reading), source.floor_m(reading)
    loaded = look.loaded[name]
    found = evidence(
        plate.force_N[loaded],
        plate.moment_Nm[loaded],
        source.at(np.flatnonzero(loaded)).left_at_point(reading),
        None if (lever := source.lever_m(reading)) is None else lever[loaded],
        areas[reading.place_of or name].at(loaded),
        plate.corners_m,
        floor,
    )
    cop = plate.cop_m(floor)
    cop[np.abs(plate.force_N[:, 2]) < _TOUCHED_N] = np.nan
    x, y = cop.T
    torque = plate.moment_Nm[:, 2] - x * plate.force_N[:, 1] + y * plate.force_N[:, 0]
    return _Seen(found, plate.force_N, cop, torque, np.nan_to_num(smooth.plate(reading).wrench()))


# --- the choice -------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Choice:
    """Readings in a world, with their prior; and, where these trials cannot tell them from others,
    the repairs of each plate that would do, in words, which may differ in the vertical moment
    only; or none makes a person."""

    world: _World
    readings: Readings
    rivals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    only_torque: bool = False
    is_no_person: bool = False

    def log_posterior(self) -> float:
        """But for a constant."""
        return self.log_prior() + self.world.log_likelihood(self.readings)

    def log_prior(self) -> float:
        """How rare it is that so much is wrong at once, logarithm."""
        readings = list(self.readings.values())
        repairs: dict[PlateReading, int] = {}
        for reading in readings:
            repair = replace(reading, centre_m=None, place_of="", sign=1)
            repairs[repair] = repairs.get(repair, 0) + 1
        alone = sum(n < len(readings) for repair, n in repairs.items() if repair != AS_STATED)
        return (
            self.world.scene.log_prior()
            + sum(repair.log_prior() for repair in repairs)
            + ONE_ALONE * alone
            + EXCHANGED * sum(bool(reading.place_of) for reading in readings) / 2
            + REVERSED * any(reading.sign < 0 for reading in readings)
        )

    def words(self, name: str, now: _Choice) -> str:
        """What is done to a plate's numbers, as a clause; the scene where it is another one."""
        scene = self.world.scene.words() if self.world is not now.world else ""
        return ", ".join(filter(None, (scene, self.readings[name].words()))) or _AS_IT_IS

    def goes_beyond(self, other: _Choice) -> bool:
        """Whether all repairs of another choice are made, and more."""
        if other.world is not self.world and other.world.scene.moved:
            return False
        return all(
            mine == theirs or theirs == default
            for name, reading in other.readings.items()
            for mine, theirs, default in zip(
                astuple(self.readings[name]), astuple(reading), astuple(AS_STATED), strict=True
            )
        )

    def is_alike(self, other: _Choice, torque: bool = True) -> bool:
        """Whether both leave the same forces (and vertical moments) at the same places under the
        same body."""
        return self.world.scene.of_markers() == other.world.scene.of_markers() and all(
            self._is_alike(other, name, torque) for name in self.world.names
        )

    def _is_alike(self, other: _Choice, name: str, with_torque: bool) -> bool:
        some = self.world.seen(name, self.readings[name])
        others = other.world.seen(name, other.readings[name])
        for look, one, two in zip(self.world.looks, some, others, strict=True):
            if one is None or two is None or not (loaded := look.loaded[name]).any():
                continue
            load = np.abs(one.force_N[loaded, 2]).mean()
            apart = np.linalg.norm((one.force_N - two.force_N)[loaded], axis=1)
            gap = np.abs(one.cop_m - two.cop_m)[loaded]
            torque = np.abs(one.torque_Nm - two.torque_Nm)[loaded]
            if np.nanmax(gap, initial=0.0) >= _ALIKE_M or apart.mean() > _ALIKE_SHARE * load:
                return False
            if (
                with_torque
                and np.isfinite(torque).any()
                and np.nanmedian(torque) > _ALIKE_TORQUE_M * load
            ):
                return False
        return True


def _repaired(worlds: Sequence[_World]) -> _Choice:
    """The readings after every repair that is sure, one after the other."""
    chosen = _Choice(worlds[0], worlds[0].stated())
    for _ in range(len(chosen.world.names) + 2):
        better = _better(chosen, worlds)
        if better.readings == chosen.readings and better.world is chosen.world:
            return better
        chosen, worlds = better, [better.world]
    return chosen


def _better(now: _Choice, worlds: Sequence[_World]) -> _Choice:
    """What is surely better than the readings now; these, with rivals, if nothing is.

    Repairs in other worlds are tried only where the files cannot be taken as they are.
    """
    others = [_Choice(world, world.stated()) for world in worlds if world is not now.world]
    tried = [now, *others, *_repairs(now)]
    found = _surest(tried)
    if others and (found is not now or now.world.scene.moved):
        found = _surest([*tried, *(one for other in others for one in _repairs(other))])
    return found


def _surest(tried: Sequence[_Choice]) -> _Choice:
    """The surest; the first, with rivals, if none is sure."""
    now = tried[0]
    logs = np.array([one.log_posterior() for one in tried])
    seen = sum(1 + len(look.sources) for look in now.world.looks)
    best = tried[int(np.argmax(logs))]
    # A fault that no reading mends; that the file's moments have no lever is none.
    unknown = _UNKNOWN + _UNKNOWN_EACH * seen + now.world.lever_log_likelihood(now.readings)
    # Forces that go with the motion may still lie beside the feet.
    goes = max(best.world.harmony(best.readings).log_likelihood(), 0.0)
    if unknown + goes - logsumexp([*logs, unknown + goes]) > np.log(_SURELY_NOBODY):
        return replace(now, is_no_person=True)
    logs -= logsumexp([*logs, unknown])
    likely = [k for k in range(len(tried)) if logs[k] > _LEAST_LIKELY]
    same = [k for k in likely if best.is_alike(tried[k])]
    if 0 in same:
        return now
    # A further fault that the trials do not show is no more likely here than in a sound file.
    unlikely = [k for k in likely if logs[k] < np.log(1 - _SURE) and tried[k].goes_beyond(best)]
    if np.exp(logsumexp(logs[sorted({*same, *unlikely})])) >= _SURE:
        return best
    like_now = {0, *(k for k in likely if now.is_alike(tried[k]))}
    if np.exp(logsumexp(logs[list(like_now)])) >= (_SURE if now.world.scene.moved else _RATHER):
        return now
    some = [tried[k] for k in likely if logs[k] > np.log(1 - _SURE)]
    words = {name: dict.fromkeys(one.words(name, now) for one in some) for name in now.world.names}
    rivals = {name: tuple(all_) for name, all_ in words.items() if set(all_) != {_AS_IT_IS}}
    in_torque = all(now.is_alike(one, torque=False) for one in some)
    return replace(now, rivals=rivals, only_torque=in_torque)


def _repairs(now: _Choice) -> Iterator[_Choice]:
    """One more repair, of all plates or of one."""
    world = now.world
    for reading, names in world.alternatives().items():
        for some in {tuple(names), *((name,) for name in names)}:
            changed = {n: world.centred(n, _with(reading, now.readings[n])) for n in some}
            yield _Choice(world, world.signed({**now.readings, **changed}))
    for one, two in combinations(world.names, 2):
        if all(n in look.sources for look in world.looks for n in (one, two)):
            places = {
                one: now.readings[two].place_of or two,
                two: now.readings[one].place_of or one,
            }
            changed = {
                n: replace(now.readings[n], place_of=places[n] * (places[n] != n)) for n in places
            }
            yield _Choice(world, {**now.readings, **changed})


def _with(repair: PlateReading, now: PlateReading) -> PlateReading:
    """One more repair of a plate's numbers, which may be exchanged or have a channel reversed."""
    if repair.reversed_channel:
        return replace(now, reversed_channel=repair.reversed_channel)
    return replace(repair, place_of=now.place_of, reversed_channel=now.reversed_channel)


def _verdict(as_stated: _World, chosen: _Choice, name: str) -> Verdict:
    world, reading = chosen.world, chosen.readings[name]
    before = as_stated.evidence(name, as_stated.stated()[name])
    after = world.evidence(name, reading)
    rivals = chosen.rivals.get(name, ())
    fault = _fault(after)
    if not fault and not chosen.only_torque:
        fault = _UNTOLD if rivals else _AGAINST if chosen.is_no_person else ""
    if fault:
        return Verdict(reading, before, after, refusal=fault, rivals=rivals)
    return Verdict(world.fits_outline(name, reading), before, after, rivals=rivals)


def _fault(found: Evidence) -> str:
    """Why this is no force under a foot, as a clause; empty if it may be one."""
    if found.distance_m > BESIDE_M:
        return f"its centre of pressure lies {found.distance_m:.2f} m beside the feet on the ground"
    if not np.isfinite(found.distance_m) and found.outside_m > BESIDE_M:
        return f"its centre of pressure lies {found.outside_m:.2f} m outside the plate"
    return ""
