"""How each plate's numbers are to be understood, decided over all trials of a session alike.

A few repairs are tried: other units, another point that moments are about, the corners in another
order, two plates exchanged; for all plates alike or for one. Each has a prior, how rare it is, and
a likelihood, how well forces so understood press under a person's feet (`under_the_feet`). One that
is surely better than what the files say is made; where nothing makes a person of the forces, the
plate is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.special import logsumexp

from bsip_cli.recordings.handedness import Handedness, handedness
from bsip_cli.recordings.label_words import meanings
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.person_size import height_m
from bsip_cli.recordings.plate_reading import EXCHANGED, ONE_ALONE, REVERSED, PlateReading
from bsip_cli.recordings.plate_source import C3dPlate, ForceOnPoint, PlateSource
from bsip_cli.recordings.plates import LOADED_N, inside_share
from bsip_cli.recordings.repeated_plates import repeated_plates
from bsip_cli.recordings.under_the_feet import BESIDE_M, Area, Body, Evidence, Feet, evidence

_SURE = 0.95  # probability from which on a repair is made
_FEW = 100  # samples that each plate of a trial is seen by
_ALIKE_M = 0.01  # readings whose centres of pressure differ by less are one,
_ALIKE_SHARE = 0.03  # if their total forces differ by less than this part of the load
_RIM_M = 0.02
_MOSTLY_OUTSIDE = 0.2  # share inside the outline
_TOUCHED_N = 20.0
_PULLS = 3.0  # a force is reversed if it pulls so many times what it pushes

# Logarithms: how often something else is wrong; how each trial and plate looks then (a person: -1).
_UNKNOWN, _UNKNOWN_EACH = -5.3, -1.5
_IN_PART = -2.3  # markers or forces alone are mirrored more rarely than both: one in ten

_UNTOLD = "its numbers are no force under a foot as they stand, and several corrections make one"

Readings = Mapping[str, PlateReading]
Mirrored = Literal["", "all", "markers", "forces"]


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

    ``sources`` by their names at these samples; for each ``loaded`` (n,) bool, the ``feet`` on its
    place, ``push_N`` and ``pull_N`` summed over all samples as the file has them.
    """

    sources: dict[str, PlateSource]
    loaded: dict[str, np.ndarray]
    feet: dict[str, Area]
    body: Body
    push_N: dict[str, float]
    pull_N: dict[str, float]


@dataclass(frozen=True)
class Verdict:
    """How a plate is understood, or why it is left out (``refusal``, a clause).

    ``before`` and ``after``: what its numbers make as the file says, and as they are understood,
    where that differs. ``rivals``: repairs that would each explain a plate that is left out, and
    that cannot be told apart. ``repeats`` names the plates whose copy or sum it is.
    """

    reading: PlateReading = field(default_factory=PlateReading)
    before: Evidence | None = None
    after: Evidence | None = None
    refusal: str = ""
    rivals: tuple[str, ...] = ()
    repeats: tuple[str, ...] = ()


def look_at(opened: Opened) -> Look | None:
    """What a trial shows of its plates; None if none is loaded."""
    recording = opened.recording
    lifts = {s.name: np.where(s.usable, s.lift_N(), 0.0) for s in opened.sources}
    heavy = {name: _heavy(lift) for name, lift in lifts.items()}
    chosen = [np.flatnonzero(mask) for mask in heavy.values()]
    chosen = [some[:: max(1, len(some) // _FEW)] for some in chosen if len(some)]
    if not chosen:
        return None
    samples = np.unique(np.concatenate(chosen))
    frames = np.round(samples * recording.marker_rate_hz / recording.analog_rate_hz).astype(int)
    samples, frames = samples[frames < recording.n_frames], frames[frames < recording.n_frames]
    floor = opened.sources[0].floor_m(PlateReading())
    feet = Feet.of(recording.markers_m, frames, floor if abs(floor) < 1.0 else 0.0)
    return Look(
        sources={s.name: s.at(samples) for s in opened.sources},
        loaded={name: mask[samples] for name, mask in heavy.items()},
        feet={s.name: feet.on(s.plate(PlateReading()).corners_m).area() for s in opened.sources},
        body=Body.of(_by_segment(recording), recording.marker_rate_hz, frames),
        push_N={name: float(lift[lift > LOADED_N].sum()) for name, lift in lifts.items()},
        pull_N={name: float(-lift[lift < -LOADED_N].sum()) for name, lift in lifts.items()},
    )


@dataclass(frozen=True)
class Scene:
    """What is mirrored along an axis of the world: nothing, all, the markers or the forces."""

    mirrored: Mirrored = ""
    axis: int = 0

    def of(self, opened: Opened) -> Opened:
        """The recording put right."""
        recording, sources = opened.recording, opened.sources
        if self.mirrored in ("all", "markers"):
            markers = recording.markers_m.copy()
            markers[..., self.axis] *= -1.0
            recording = replace(recording, markers_m=markers)
        if self.mirrored in ("all", "forces"):
            sources = tuple(source.mirrored(self.axis) for source in sources)
        return Opened(recording, sources)

    def log_prior(self) -> float:
        return {"": 0.0, "all": 0.0, "markers": _IN_PART, "forces": _IN_PART}[self.mirrored]


@dataclass(frozen=True)
class SessionReading:
    """How all recordings of a session are to be understood: the scene, and each plate."""

    scene: Scene = field(default_factory=Scene)
    plates: Mapping[str, Verdict] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Survey:
    """What is kept of a trial until all of a session are seen: small, however long it is."""

    hands: Handedness
    looks: Mapping[Scene, Look]
    height_m: float | None

    @classmethod
    def of(cls, opened: Opened) -> Survey:
        hands = handedness(opened.recording.labels, opened.recording.markers_m)
        scenes = [Scene()]
        if hands.is_mirrored:
            scenes += [Scene("all"), Scene("markers", 0), Scene("markers", 1)]
        if any(isinstance(source, ForceOnPoint) for source in opened.sources):
            scenes += [Scene("forces", 0), Scene("forces", 1)]
        looks = {scene: look_at(scene.of(opened)) for scene in scenes}
        known = {scene: look for scene, look in looks.items() if look is not None}
        return cls(hands, known, height_m(_by_segment(opened.recording)))


def settle_session(trials: Sequence[Survey]) -> SessionReading:
    """The scene and the plates' readings that make a person of a session."""
    hands = Handedness.of_all([trial.hands for trial in trials])
    scenes = [Scene("all"), Scene("markers", 0), Scene("markers", 1)]
    if not hands.is_mirrored:
        plates, _ = settle(_seen(trials, Scene()))
        if not any(verdict.refusal for verdict in plates.values()):
            return SessionReading(Scene(), plates)
        scenes = [Scene(), Scene("forces", 0), Scene("forces", 1)]
    seen = {scene: _seen(trials, scene) for scene in scenes}
    most = max(map(len, seen.values()))
    settled = [(scene, *settle(some)) for scene, some in seen.items() if len(some) == most]
    good = [one for one in settled if not any(verdict.refusal for verdict in one[1].values())]
    scene, plates, _ = max(good or settled[:1], key=lambda one: one[0].log_prior() + one[2])
    return SessionReading(scene, plates)


def _seen(trials: Sequence[Survey], scene: Scene) -> list[Look]:
    return [trial.looks[scene] for trial in trials if scene in trial.looks]


def settle(looks: Sequence[Look]) -> tuple[dict[str, Verdict], float]:
    """A verdict for each plate of a session, and how likely all that they read is (logarithm)."""
    repeats = repeated_plates([look.sources for look in looks])
    every = dict.fromkeys(name for look in looks for name in look.sources)
    names = [name for name in every if name not in repeats]
    session = _Session([_without(look, repeats) for look in looks], names)
    stated = session.signed(dict.fromkeys(names, PlateReading()))
    chosen = _repaired(session, stated)
    verdicts = {name: _verdict(session, stated, chosen, name) for name in names}
    repeated = {name: Verdict(repeats=others) for name, others in repeats.items()}
    return verdicts | repeated, chosen.log_prior + session.log_likelihood(chosen.readings)


def _heavy(lift_N: np.ndarray) -> np.ndarray:
    size = np.abs(lift_N)
    return size > max(LOADED_N, 0.5 * np.percentile(size, 99)) if len(size) else size > 0


def _by_segment(recording: Recording) -> dict[str, np.ndarray]:
    """The markers of each segment (n_frames, k, 3), by what their labels mean."""
    known = meanings(recording.labels)
    columns: dict[str, list[int]] = {}
    for k, label in enumerate(recording.labels):
        if label in known:
            columns.setdefault(known[label].segment, []).append(k)
    return {segment: recording.markers_m[:, some] for segment, some in columns.items()}


def _without(look: Look, names: Mapping[str, object]) -> Look:
    return replace(look, sources={n: s for n, s in look.sources.items() if n not in names})


@dataclass(eq=False)
class _Session:
    """What readings make of all trials; each plate is read once in each way."""

    looks: Sequence[Look]
    names: Sequence[str]
    _known: dict[tuple[str, PlateReading], list] = field(default_factory=dict)

    def log_likelihood(self, readings: Readings) -> float:
        total = 0.0
        for k, look in enumerate(self.looks):
            seen = [self._seen(name, readings[name])[k] for name in look.sources]
            total += sum(one.log_likelihood() for one, _, _ in seen)
            total += look.body.log_likelihood([f for _, f, _ in seen], [cop for *_, cop in seen])
        return total

    def evidence(self, name: str, reading: PlateReading) -> Evidence:
        """Mean over the trials in which the plate is loaded."""
        found = [one for one, *_ in filter(None, self._seen(name, reading))]
        return Evidence.mean(found)

    def alike(self, some: Readings, others: Readings) -> bool:
        """Whether they leave the same total force, and each plate's centre of pressure."""
        changed = [name for name in self.names if some[name] != others[name]]
        for k, look in enumerate(self.looks):
            pairs = [
                (self._seen(name, some[name])[k], self._seen(name, others[name])[k], name)
                for name in changed
                if name in look.sources
            ]
            apart = [np.abs(one[2] - two[2])[look.loaded[name]] for one, two, name in pairs]
            if any(np.nanmax(gap, initial=0.0) >= _ALIKE_M for gap in apart):
                return False
            turned = np.sum([one[1] - two[1] for one, two, _ in pairs], axis=0)
            total = np.sum([self._seen(n, some[n])[k][1][:, 2] for n in look.sources], axis=0)
            if pairs and np.nanmean(np.abs(turned)) > _ALIKE_SHARE * np.nanmean(np.abs(total)):
                return False
        return True

    def signed(self, readings: Readings) -> dict[str, PlateReading]:
        """With the signs that let the person press: mirrored corners turn a plate's axis over."""
        return {name: self._signed(name, reading) for name, reading in readings.items()}

    def alternatives(self) -> dict[PlateReading, list[str]]:
        """Other readings, and the plates that they are possible for."""
        found: dict[PlateReading, list[str]] = {}
        for name in self.names:
            possible = (r for source in self._sources(name) for r in source.alternatives())
            for reading in dict.fromkeys(possible):
                if reading != PlateReading():
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

    def is_all_c3d(self) -> bool:
        return all(isinstance(self._sources(name)[0], C3dPlate) for name in self.names)

    def _sources(self, name: str) -> list[PlateSource]:
        return [look.sources[name] for look in self.looks if name in look.sources]

    def _signed(self, name: str, reading: PlateReading) -> PlateReading:
        push = sum(look.push_N.get(name, 0.0) for look in self.looks)
        pull = sum(look.pull_N.get(name, 0.0) for look in self.looks)
        if reading.mirrored:
            push, pull = pull, push
        return replace(reading, sign=-1 if pull > _PULLS * push else 1)

    def _seen(self, name: str, reading: PlateReading) -> list:
        """Evidence, force (n, 3) and centre of pressure (n, 2) in each trial; None without it."""
        key = (name, reading)
        if key not in self._known:
            self._known[key] = [_read(look, name, reading) for look in self.looks]
        return self._known[key]


def _read(look: Look, name: str, reading: PlateReading) -> tuple | None:
    if name not in look.sources:
        return None
    source = look.sources[name]
    if reading.place_of:
        source = source.in_place_of(look.sources[reading.place_of])
    plate, floor = source.plate(reading), source.floor_m(reading)
    loaded = look.loaded[name]
    found = evidence(
        plate.force_N[loaded],
        plate.moment_Nm[loaded],
        source.at(np.flatnonzero(loaded)).left_at_point(reading),
        None if (lever := source.lever_m(reading)) is None else lever[loaded],
        look.feet[reading.place_of or name].at(loaded),
        plate.corners_m,
        floor,
    )
    cop = plate.cop_m(floor)
    cop[np.abs(plate.force_N[:, 2]) < _TOUCHED_N] = np.nan
    return found, plate.force_N, cop


# --- the choice -------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Choice:
    """Readings with their prior, and, where something is still wrong, the repairs of each plate, in
    words, that would do and that these trials cannot tell apart."""

    readings: Readings
    log_prior: float = 0.0
    rivals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def _repaired(session: _Session, stated: Readings) -> _Choice:
    """The readings after every repair that is sure, one after the other."""
    chosen = _Choice(stated)
    for _ in range(len(session.names) + 1):
        better = _better(session, chosen.readings)
        chosen = replace(better, log_prior=chosen.log_prior + better.log_prior)
        if better.log_prior == 0.0:
            break
    return chosen


def _better(session: _Session, now: Readings) -> _Choice:
    """What is surely better than the readings now; these, with rivals, if nothing is.

    Readings that give the same forces at the same places are one.
    """
    here = _of_signs(now) + session.log_likelihood(now)
    alternatives = session.alternatives()
    if not alternatives:
        return _Choice(now)
    rarest = max(reading.log_prior() for reading in alternatives)
    if session.is_all_c3d() and here > rarest + np.log(1 / _SURE - 1):
        return _Choice(now)  # no repair could be surer
    tried = [(now, _of_signs(now)), *_repairs(session, now, alternatives)]
    logs = np.array([prior + session.log_likelihood(readings) for readings, prior in tried])
    seen = sum(1 + len(look.sources) for look in session.looks)
    unknown = _UNKNOWN + _UNKNOWN_EACH * seen  # a fault that no reading mends
    logs -= logsumexp([*logs, unknown])
    best = tried[int(np.argmax(logs))]
    same = [k for k, (r, _) in enumerate(tried) if logs[k] > -12 and session.alike(best[0], r)]
    if 0 in same:
        return _Choice(now)
    if np.exp(logsumexp(logs[same])) >= _SURE:
        return _Choice(*best)
    likely = [readings for k, (readings, _) in enumerate(tried) if logs[k] > np.log(1 - _SURE)]
    rivals = {
        name: tuple(dict.fromkeys(r[name].words() for r in likely if r[name] != now[name]))
        for name in session.names
    }
    return _Choice(now, rivals=rivals)


def _repairs(
    session: _Session, now: Readings, alternatives: Mapping[PlateReading, Sequence[str]]
) -> Iterator[tuple[Readings, float]]:
    """Readings with one more repair, of all plates or of one, and the logarithm of its prior."""
    for reading, names in alternatives.items():
        for some in {tuple(names), *((name,) for name in names)}:
            changed = {n: session.centred(n, _keeping_place(reading, now[n])) for n in some}
            readings = session.signed({**now, **changed})
            alone = ONE_ALONE * (len(some) < len(session.names))
            yield readings, reading.log_prior() + alone + _of_signs(readings)
    for one, two in combinations(session.names, 2):
        pair = (session.looks[0].sources.get(one), session.looks[0].sources.get(two))
        if type(pair[0]) is type(pair[1]):
            places = {one: now[two].place_of or two, two: now[one].place_of or one}
            changed = {n: replace(now[n], place_of=places[n] * (places[n] != n)) for n in places}
            if all(n in look.sources for look in session.looks for n in (one, two)):
                yield {**now, **changed}, EXCHANGED + _of_signs(now)


def _of_signs(readings: Readings) -> float:
    """Logarithm of how rare it is that files hold the action on the plate, where they do."""
    return REVERSED * any(reading.sign < 0 for reading in readings.values())


def _keeping_place(reading: PlateReading, now: PlateReading) -> PlateReading:
    return replace(reading, place_of=now.place_of)


def _verdict(session: _Session, stated: Readings, chosen: _Choice, name: str) -> Verdict:
    reading = chosen.readings[name]
    before, after = session.evidence(name, stated[name]), session.evidence(name, reading)
    rivals = chosen.rivals.get(name, ())
    fault = _fault(after) or (_UNTOLD if len(rivals) > 1 else "")
    if fault:
        return Verdict(reading, before, after, refusal=fault, rivals=rivals)
    return Verdict(session.fits_outline(name, reading), before, after)


def _fault(found: Evidence) -> str:
    """Why this is no force under a foot, as a clause; empty if it may be one."""
    if found.distance_m > BESIDE_M:
        return f"its centre of pressure lies {found.distance_m:.2f} m beside the feet on the ground"
    if not np.isfinite(found.distance_m) and found.outside_m > BESIDE_M:
        return f"its centre of pressure lies {found.outside_m:.2f} m outside the plate"
    return ""
