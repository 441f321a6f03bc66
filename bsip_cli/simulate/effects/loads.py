"""What a body carries, leans on or is pulled by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from bsip_cli.body.markersets import load_marker_set, shipped_names
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.instruments.readings import Instruments
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.effects.base import (
    Effect,
    OnSegment,
    Target,
    body_of,
    by,
    named,
    setting,
    span,
    uniform,
    with_body,
)
from bsip_cli.simulate.numerics import rotate, second_derivative, step, swung, window
from bsip_cli.simulate.people import Inertia, Person
from bsip_cli.simulate.plan import GRAVITY, Ball, G, Load, Plan, Poses

HANDS = ("hand_l", "hand_r")
HEAVY = ("thigh_l", "thigh_r", "upper_torso", "lower_torso")
BALL_RADIUS_M = 0.03
OFF_AXIS_M, ALONG_M = 0.05, 0.05
IN_FRONT_M = np.array([0.04, 0.0, 0.0])
OPENING_S = 0.04
MOST_OF_SEGMENT = 0.8
OUTWARD = np.array([0.8, 0.6, 0.0])  # of the chest: ahead and up, thorax axes
RAMP_S = 0.4
ASIDE, MOST_ASIDE = 0.15, 0.3  # horizontal part of a support, of a constant force
CENTRES_M = (0.3, 0.9)  # from the hand: of a racket, of a driver
SPREADS = (0.3, 0.7)  # of the mass about its centre, over the centre's distance
LEAST_RADIUS_M = 0.01
MOST_TILT_RAD = 0.8
UNSTEADINESS, PACE_HZ = 0.15, 0.6
CLEAR_OF_FLIGHT_S = 0.3
CUTOFF_HZ = 10.0
LOADED_N = 40.0


def beside_the_axis(size: float, target: Target, rng: np.random.Generator) -> np.ndarray:
    """(3,) OFF_AXIS_M aside and up to ALONG_M along a segment."""
    angle, along = rng.uniform(-np.pi, np.pi), rng.uniform(-ALONG_M, ALONG_M)
    return np.array([OFF_AXIS_M * np.cos(angle), along, OFF_AXIS_M * np.sin(angle)])


def mostly_upwards(size: float, target: Target, rng: np.random.Generator) -> np.ndarray:
    """(3,) unit vector, walkway axes (Y up)."""
    aside, heading = rng.uniform(0.0, MOST_ASIDE), rng.uniform(-np.pi, np.pi)
    return np.array([aside * np.cos(heading), np.sqrt(1 - aside**2), aside * np.sin(heading)])


# --- carried --------------------------------------------------------------------------------------


class AddedMass(OnSegment, name="added_mass"):
    """A small ball of `size` kg on a segment, as of a bag or a cast; the scale did not see it.

    offset_m : (3,) from the segment's centre of mass, segment axes.
    """

    segment: str = named(*SEGMENTS)
    offset_m: np.ndarray = by(beside_the_axis)

    def position_m(self, person: Person) -> np.ndarray:
        return super().position_m(person) + self.offset_m

    def body(self, person: Person) -> Person:
        tensor = 0.4 * self.size * BALL_RADIUS_M**2 * np.eye(3)
        ball = Inertia(self.size, self.position_m(person), tensor)
        return with_body(person, self.segment, ball)

    def injected(self, instruments: Instruments) -> Instruments:
        return with_mass_at(instruments, self.segment, self.size)


class ReleasedObject(OnSegment, name="released_object"):
    """A point mass of `size` kg that a segment carries until it lets go; it falls off the plate.

    release_share : when, as a part of each trial, unless release_s is given.
    """

    segment: str = named(*HANDS)
    release_share: float = uniform(0.35, 0.65)
    release_s: float | None = setting("release_s")

    def position_m(self, person: Person) -> np.ndarray:
        return super().position_m(person) + IN_FRONT_M

    def _hold(self, times_s: np.ndarray, length_s: float) -> tuple[np.ndarray, float]:
        """1 while held, 0 when gone, with an opening hand of OPENING_S between; and the release."""
        release = self.release_share * length_s if self.release_s is None else self.release_s
        return 1.0 - step(times_s, release - 0.5 * OPENING_S, release + 0.5 * OPENING_S), release

    def plan(self, person: Person, plan: Plan) -> Plan:
        hold, release = self._hold(plan.recorded_times_s(), plan.recorded_length_s())
        return plan.with_load(Ball(*self.where(person), self.size, hold, release))

    def injected(self, instruments: Instruments) -> Instruments:
        length = len(instruments.points_m) / instruments.marker_hz
        hold, _ = self._hold(instruments.sample_times_s(), length)
        return with_mass_at(instruments, self.segment, self.size, hold)


class ObjectHandled(OnSegment, name="object_handled"):
    """A point mass of `size` kg that a segment picks up and puts down again, beside the plates.

    window_share : start and end as parts of each trial.
    """

    segment: str = named(*HANDS)
    window_share: tuple[float, float] = span(0.2, 0.35, 0.25, 0.4)

    def plan(self, person: Person, plan: Plan) -> Plan:
        start, end = (share * plan.recorded_length_s() for share in self.window_share)
        half = 0.5 * OPENING_S
        hold = window(plan.recorded_times_s(), start - half, end + half, OPENING_S)
        body, place = self.where(person)
        return plan.with_load(Ball(body, place + IN_FRONT_M, self.size, hold, end))


class Implement(OnSegment, name="implement"):
    """Two balls of `size` kg together on a line through the hand's centre of mass, held through
    each trial.

    centre_m : (3,) of both from there, hand's axes. spread_m : of each from their common centre.
    """

    centre_m: np.ndarray
    spread_m: float

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        hand = target.name or str(rng.choice(HANDS))
        distance = target.settings.get("distance", float(rng.uniform(*CENTRES_M)))
        azimuth, out = rng.uniform(-np.pi, np.pi), rng.uniform(-MOST_TILT_RAD, MOST_TILT_RAD)
        flat = np.cos(out)
        axis = np.array([np.sin(out), flat * np.cos(azimuth), flat * np.sin(azimuth)])
        return cls(size, hand, distance * axis, distance * float(rng.uniform(*SPREADS)))

    def body(self, person: Person) -> Person:
        distance = float(np.linalg.norm(self.centre_m))
        axis = self.centre_m / max(distance, LEAST_RADIUS_M)
        across = self.spread_m**2 * (np.eye(3) - np.outer(axis, axis))
        tensor = self.size * (across + LEAST_RADIUS_M**2 * np.eye(3))
        held = Inertia(self.size, self.position_m(person) + self.centre_m, tensor)
        return with_body(person, self.segment, held)

    def facts(self, person: Person) -> dict[str, Any]:
        return {"distance_m": float(np.linalg.norm(self.centre_m))}


# --- swinging -------------------------------------------------------------------------------------


class WobblingMass(OnSegment, name="wobbling_mass"):
    """`size` kg of a segment hang on a spring and a damper, equal in all directions.

    They rest at the segment's centre of mass in quiet stance, so that mass and centre of
    mass stay the person's.
    """

    segment: str = named(*HEAVY)
    frequency_hz: float = uniform(3.5, 7.0, "frequency", 0.5, 20.0, "Hz")
    damping_ratio: float = uniform(0.1, 0.3, "damping", 0.01, 1.0)

    def position_m(self, person: Person) -> np.ndarray:
        return person.inertias[body_of(self.segment)].com_m

    def body(self, person: Person) -> Person:
        """The bone keeps what does not wobble."""
        body = body_of(self.segment)
        part = person.inertias[body]
        if self.size > MOST_OF_SEGMENT * part.mass_kg:
            raise UsageError(
                f"{self.size:g} kg of {self.segment} cannot wobble",
                expected=f"at most {MOST_OF_SEGMENT * part.mass_kg:.1f} kg, 80 % of the segment",
            )
        rest = replace(part, mass_kg=part.mass_kg - self.size)
        return replace(person, inertias={**person.inertias, body: rest})

    def plan(self, person: Person, plan: Plan) -> Plan:
        tissue = self.size, self.frequency_hz, self.damping_ratio
        return plan.with_load(Swinging(*self.where(person), *tissue))


@dataclass(frozen=True, eq=False)
class Swinging(Load):
    """A point mass on a spring and a damper at a point of a body."""

    mass_kg: float
    frequency_hz: float
    damping_ratio: float

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """The force of spring and damper, which bears the mass' weight too."""
        r = poses.point(self.body, self.position_m)
        of_the_point = second_derivative(r, step_s)
        travel, own = swung(self.frequency_hz, self.damping_ratio, of_the_point, step_s)
        force = self.mass_kg * (own - GRAVITY)
        return force, np.cross(r + travel, force)


class Breathing(Effect, name="breathing"):
    """Moved mass times amplitude is `size`; it moves as a sine at the chest."""

    frequency_hz: float = uniform(0.2, 0.32, "frequency", 0.05, 2.0, "Hz")
    phase_rad: float = uniform(-np.pi, np.pi)

    def plan(self, person: Person, plan: Plan) -> Plan:
        times = plan.recorded_times_s()
        wave = np.sin(2.0 * np.pi * self.frequency_hz * times + self.phase_rad)
        dipole = self.size * wave[:, None] * OUTWARD
        return plan.with_load(ChestMotion("thorax", person.inertias["thorax"].com_m, dipole))


@dataclass(frozen=True, eq=False)
class ChestMotion(Load):
    """Mass that leaves its place in a body: mass times displacement (T, 3), body axes."""

    dipole_kgm: np.ndarray

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """What it takes more than the same mass at rest in the body, to first order."""
        r = poses.point(self.body, self.position_m)
        dipole = rotate(poses.rotation[self.body], self.dipole_kgm)
        force, acceleration = second_derivative(dipole, step_s), second_derivative(r, step_s)
        return force, np.cross(r, force) + np.cross(dipole, acceleration - GRAVITY)


# --- held from outside ----------------------------------------------------------------------------


class UnmeasuredContact(OnSegment, name="unmeasured_contact"):
    """A mostly upward force on a segment, as of a rail on a hand, of `size` N on average.

    window_share : start and end as parts of each trial, unless start_s and end_s are given.
    heading_rad : of the small horizontal part, from ahead. phase_rad : of its unsteadiness.
    Near a flight the person lets go.
    """

    segment: str = named(*HANDS)
    window_share: tuple[float, float] = span(0.15, 0.35, 0.3, 0.45)
    start_s: float | None = setting("start_s")
    end_s: float | None = setting("end_s")
    heading_rad: float = uniform(-np.pi, np.pi)
    phase_rad: float = uniform(-np.pi, np.pi)

    def plan(self, person: Person, plan: Plan) -> Plan:
        times = plan.recorded_times_s()
        start, end = (share * plan.recorded_length_s() for share in self.window_share)
        start = start if self.start_s is None else self.start_s
        end = end if self.end_s is None else self.end_s
        strength = window(times, start, end, RAMP_S)
        strength *= 1.0 + UNSTEADINESS * np.sin(2 * np.pi * PACE_HZ * times + self.phase_rad)
        inside = (times >= start) & (times <= end)
        strength = strength / strength[inside].mean() if inside.any() else strength
        for first, last in plan.flights:
            a, b = times[first] - CLEAR_OF_FLIGHT_S, times[last] + CLEAR_OF_FLIGHT_S
            strength *= 1.0 - window(times, a, b, CLEAR_OF_FLIGHT_S)
        aside = ASIDE * np.array([np.cos(self.heading_rad), 0.0, np.sin(self.heading_rad)])
        force = self.size * strength[:, None] * (np.array([0.0, 1.0, 0.0]) + aside)
        return plan.with_load(Support(*self.where(person), force))


class ExternalForce(OnSegment, name="external_force"):
    """`size` N on a segment's centre of mass, mostly upwards and always the same; not in trials
    with a flight, which would be another one.

    direction : (3,) unit vector, walkway axes (Y up).
    """

    segment: str = named(*SEGMENTS)
    direction: np.ndarray = by(mostly_upwards)

    def plan(self, person: Person, plan: Plan) -> Plan:
        if plan.flights:
            return plan
        force = np.tile(self.size * self.direction, (len(plan), 1))
        return plan.with_load(Support(*self.where(person), force))

    def facts(self, person: Person) -> dict[str, Any]:
        return {"upwards_n": float(self.size * self.direction[1])}


@dataclass(frozen=True, eq=False)
class Support(Load):
    """An outside force (T, 3) on a point of the body."""

    force_n: np.ndarray

    def force(self, path_m: np.ndarray, step_s: float) -> np.ndarray:
        """What the body exerts on the support."""
        return -self.force_n


# --- in measured data -----------------------------------------------------------------------------


def with_mass_at(
    instruments: Instruments, where: str, mass_kg: float, hold: np.ndarray | None = None
) -> Instruments:
    """Plates as they would read with a point mass in the middle of some markers.

    Its weight and its acceleration act on the plates that carry the person at that moment, shared
    as they share the person's weight. What it would have done to the movement is left out.

    where : a segment, or labels joined by "+". hold : (N,) 1 while it is carried.
    UsageError: no such marker.
    BadDataError: the markers are lost for more than half of the trial.
    """
    times, samples = instruments.frame_times_s(), instruments.sample_times_s()
    spline = make_interp_spline(times, _smooth_path(instruments, where), k=5)
    place, acceleration = (
        f(np.minimum(samples, times[-1])) for f in (spline, spline.derivative(2))
    )
    force = mass_kg * (acceleration + G * instruments.up)
    force = force if hold is None else hold[:, None] * force
    pairs = list(zip(instruments.readings, instruments.plates, strict=True))
    vertical = np.stack([r[:, :3] @ plate.axes.T @ instruments.up for r, plate in pairs])
    # the readings are the force on the person, or that on the plate
    sign = 1.0 if np.nansum(vertical) > 0.0 else -1.0
    load = np.nan_to_num(sign * vertical)
    load = np.where(load > LOADED_N, load, 0.0)
    parts = (sign * load / np.maximum(load.sum(axis=0), LOADED_N))[..., None] * force
    added = [
        plate.reading(part, np.cross(place - plate.sensor_m, part), plate.sensor_m)
        for part, plate in zip(parts, instruments.plates, strict=True)
    ]
    return replace(instruments, readings=instruments.readings + added)


def _smooth_path(instruments: Instruments, where: str) -> np.ndarray:
    """(F, 3) middle of the markers, gaps bridged, low-passed."""
    labels = markers_of(where, instruments.labels)
    if not labels:
        raise UsageError(
            f"no marker of {where!r} is in the recording",
            expected=f"labels joined by '+', of {', '.join(instruments.labels)}",
        )
    middle = instruments.points_m[:, [instruments.column(label) for label in labels]].mean(axis=1)
    times, seen = instruments.frame_times_s(), np.isfinite(middle).all(axis=1)
    if seen.mean() < 0.5 or len(times) < 30:
        raise BadDataError(
            f"the markers {', '.join(labels)} are all seen in {seen.sum()} of {len(seen)} frames",
            expected="more than half of them, and at least 30 frames",
        )
    path = np.stack([np.interp(times, times[seen], column[seen]) for column in middle.T], axis=1)
    cutoff = min(CUTOFF_HZ, 0.4 * instruments.marker_hz)
    return sosfiltfilt(butter(2, cutoff, fs=instruments.marker_hz, output="sos"), path, axis=0)


def markers_of(where: str, labels: tuple[str, ...]) -> list[str]:
    """The recording's labels that are meant: themselves joined by "+", or those of a segment.

    Prefixes (``Subject:RASI``) need not be given. For a segment the shipped marker set that
    knows most of the labels decides. Empty if there are none.
    """
    bare = {label.rpartition(":")[2]: label for label in labels} | {x: x for x in labels}
    asked = where.split("+")
    if all(name in bare for name in asked):
        return [bare[name] for name in asked]
    best: dict[str, list[str]] = {}
    for name in shipped_names():
        found: dict[str, list[str]] = {}
        for marker in load_marker_set(name).markers:
            names = [one for one in (marker.label, *marker.aliases) if one in bare]
            if names:
                found.setdefault(marker.segment, []).append(bare[names[0]])
        if sum(map(len, found.values())) > sum(map(len, best.values())):
            best = found
    return best.get(where, [])
