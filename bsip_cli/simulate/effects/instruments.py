"""Force plates that are late, lie elsewhere, or read wrongly; markers that slip, are mistaken for
each other, or are smoothed; persons who are not what these show.

Channels are the six components in the plate's own axes, moments about its sensor.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import COMPONENTS, Instruments, SensingPlate
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.effects.base import (
    JOINTS,
    Effect,
    Target,
    by,
    direction,
    named,
    setting,
    span,
    uniform,
)
from bsip_cli.simulate.numerics import frame_of, from_rotation_vector, glide, rotate, runs, step
from bsip_cli.simulate.people import Inertia, Person
from bsip_cli.simulate.plan import Plan

TURNS = {"x": 0, "y": 1, "z": 2, "tilt_x": 0, "tilt_y": 1, "yaw": 2}
"""Lab axes by the names of targets."""


def along_an_axis(usual: str = "") -> Any:
    """(3,) the size along a lab axis, or along a drawn horizontal direction."""

    def draw(size: float, target: Target, rng: np.random.Generator) -> np.ndarray:
        heading, name = rng.uniform(-np.pi, np.pi), target.name or usual
        drawn = np.array([np.cos(heading), np.sin(heading), 0.0])
        return size * (np.eye(3)[TURNS[name]] if name else drawn)

    return by(draw)


def part_of_name(index: int, separator: str, usual: str) -> Any:
    """What stands before (0) or after (2) the separator in the target's name."""
    return by(lambda size, target, rng: (target.name or usual).partition(separator)[index])


def number_below(count: int) -> Any:
    """A whole number drawn from 0 to count - 1."""
    return by(lambda size, target, rng: int(rng.integers(count)))


# --- clocks and axes ------------------------------------------------------------------------------


class SyncOffset(Effect, name="sync_offset"):
    """The force comes late by `size` (early if negative)."""

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.with_forces_from(instruments.sample_times_s() - self.size)


class ClockDrift(Effect, name="clock_drift"):
    """The force's delay grows by `size` seconds per second, from 0 at the start of a trial."""

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.with_forces_from(instruments.sample_times_s() * (1.0 - self.size))


class FrameRate(Effect, name="frame_rate"):
    """All was recorded at 1 + `size` times the rate that the file states."""

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.said_slower(1.0 + self.size)


class GravityTilt(Effect, name="gravity_tilt"):
    """The lab's axes are turned against the world by turn_rad (rotation vector, lab axes).

    Markers and forces turn together about the first plate's centre, so that the physics
    stays whole; only gravity no longer points down the lab's vertical.
    """

    turn_rad: np.ndarray = along_an_axis()

    def measured(self, instruments: Instruments) -> Instruments:
        turn, pivot = from_rotation_vector(self.turn_rad), instruments.plates[0].centre_m
        points = (instruments.points_m - pivot) @ turn.T + pivot
        readings = []
        for reading, plate in zip(instruments.readings, instruments.plates, strict=True):
            force, moment = plate.lab_wrench(reading, pivot)
            readings.append(plate.reading(force @ turn.T, moment @ turn.T, pivot))
        return replace(instruments, points_m=points, readings=np.stack(readings))


class CameraFrame(Effect, name="camera_frame"):
    """All markers are turned by turn_rad (rotation vector, lab axes) about the lab's origin."""

    turn_rad: np.ndarray = along_an_axis()

    def measured(self, instruments: Instruments) -> Instruments:
        turn = from_rotation_vector(self.turn_rad)
        return replace(instruments, points_m=instruments.points_m @ turn.T)


# --- plates and their channels --------------------------------------------------------------------


class OfEveryPlate(Effect, ABC):
    """A plate reads otherwise, or each of them.

    at : as in the table, of a single plate; what follows "of" is left out if it is all of them.
    """

    plate: int = by(lambda size, target, rng: int(target.settings.get("plate", 0)))

    def measured(self, instruments: Instruments) -> Instruments:
        number, count = self.plate, len(instruments.plates)
        if not 0 <= number <= count:
            raise UsageError(f"there is no plate {number}", expected=f"1 to {count}, or 0 for all")
        readings, times = instruments.readings.copy(), instruments.sample_times_s()
        for index, plate in enumerate(instruments.plates):
            if number in (0, index + 1):
                self.read(readings[index], plate, times)
        return replace(instruments, readings=readings)

    @abstractmethod
    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        """Change a plate's true reading (N, 6) into what it shows, at times (N,)."""

    def place(self) -> str:
        channel = super().place()
        plate = f"plate {self.plate}" if self.plate else ""
        return " of ".join(filter(None, (channel, plate))) or "all plates"


class PlateTranslation(OfEveryPlate, name="plate_translation"):
    """The plate truly lies at its stated place plus shift_m (lab axes)."""

    shift_m: np.ndarray = along_an_axis()

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, 3:] -= np.cross(plate.axes.T @ self.shift_m, reading[:, :3])


class PlateRotation(OfEveryPlate, name="plate_rotation"):
    """The plate is truly turned by turn_rad (rotation vector, lab axes) about its centre."""

    turn_rad: np.ndarray = along_an_axis("yaw")

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        force, moment = plate.lab_wrench(reading, plate.centre_m)
        turn = from_rotation_vector(self.turn_rad)
        reading[:] = plate.reading(force @ turn, moment @ turn, plate.centre_m)


class PlateCrosstalk(OfEveryPlate, name="plate_crosstalk"):
    """Channel `to` shows size times channel `source` plus its own."""

    source: str = part_of_name(0, ":", "fz:fx")
    to: str = part_of_name(2, ":", "fz:fx")

    def __post_init__(self) -> None:
        if self.source == self.to or not {self.source, self.to} <= set(COMPONENTS):
            raise self.wrong_target(f"{self.source}:{self.to}")

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        source, to = COMPONENTS.index(self.source), COMPONENTS.index(self.to)
        reading[:, to] += self.size * reading[:, source]


class OfOneChannel(OfEveryPlate):
    """One channel shows something else than the truth."""

    channel: str = named("fz")

    @property
    def column(self) -> int:
        """Of a reading."""
        return COMPONENTS.index(self.channel)


class PlateGain(OfOneChannel, name="plate_gain"):
    """The channel shows 1 + size times the truth."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, self.column] *= 1.0 + self.size


class PlateZero(OfOneChannel, name="plate_zero"):
    """A constant is added to the channel, whatever it measures."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, self.column] += self.size

    def injected(self, instruments: Instruments) -> Instruments:
        """What the software that wrote the file has set to zero stays so."""
        changed = self.measured(instruments)
        silent = (instruments.readings == 0).all(axis=2, keepdims=True)
        return replace(changed, readings=np.where(silent, 0.0, changed.readings))


class PlateDrift(PlateZero, name="plate_drift"):
    """The channel's zero moves at a constant rate, from 0 at the start of each trial."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, self.column] += self.size * times_s


# --- markers --------------------------------------------------------------------------------------


SLIP_S = 0.05
SOFT = 0.1  # of the window of a slide, in which it speeds up, and slows down
COMPANIONS = 3
CLOSE_PAIRS = 5
LEAST_FRAMES = 15  # a shorter interval between gaps is not smoothed


class OnSkin(Effect):
    """A marker moves along the skin, and stays there."""

    marker: str = by(lambda size, target, rng: target.name)
    draw_of_marker: int = number_below(1 << 16)

    def slipped(self, instruments: Instruments, along: np.ndarray, gone: np.ndarray) -> Instruments:
        """Instruments with the marker moved by the part gone (F,) of `size`.

        along : (3,) in the frame of the three markers that keep their distance to it best.
        """
        drawn = instruments.labels[self.draw_of_marker % len(instruments.labels)]
        column, points = instruments.column(self.marker or drawn), instruments.points_m.copy()
        distance = np.linalg.norm(points - points[:, [column]], axis=2)
        seen = np.isfinite(distance).mean(axis=0) > 0.5
        seen[column] = False
        spread = np.where(seen, np.nanstd(np.where(seen, distance, 0.0), axis=0), np.inf)
        a, b, c = points[:, np.argsort(spread, kind="stable")[:COMPANIONS]].transpose(1, 0, 2)
        # NaN where a companion is lost: then that frame of the marker is lost too
        way = (self.size * gone)[:, None] * rotate(frame_of(b - a, c - a), along)
        points[:, column] += way
        return replace(instruments, points_m=points)


class MarkerShift(OnSkin, name="marker_shift"):
    """A marker slips along the skin, within SLIP_S, and stays there.

    from_share : the part of a trial after which it slips, unless from_s is given.
    along : (3,) unit vector in the frame of the markers beside it.
    """

    from_share: float = uniform(0.2, 0.6)
    from_s: float | None = setting("from_s")
    along: np.ndarray = by(lambda size, target, rng: direction(rng))

    def measured(self, instruments: Instruments) -> Instruments:
        times = instruments.frame_times_s()
        start = self.from_share * times[-1] if self.from_s is None else self.from_s
        return self.slipped(instruments, self.along, step(times, start, start + SLIP_S))


class MarkerSlide(OnSkin, name="marker_slide"):
    """A marker slides along the skin for a part of the trial, and stays there.

    window_share : start and end as parts of a trial.
    along : (3,) unit vector in the frame of the markers beside it.
    """

    window_share: tuple[float, float] = span(0.1, 0.4, 0.3, 0.5)
    along: np.ndarray = by(lambda size, target, rng: direction(rng))

    def measured(self, instruments: Instruments) -> Instruments:
        times = instruments.frame_times_s()
        start, end = (share * times[-1] for share in self.window_share)
        gone = glide(times, start, end, SOFT * (end - start))
        return self.slipped(instruments, self.along, gone)


class MarkerSwap(Effect, name="marker_swap"):
    """Two markers carry each other's label for `size` seconds.

    draw_of_pair : of the closest pairs, unless first and second are given.
    start_share : where the window lies in each trial, 0 at its start and 1 at its end,
        unless start_s is given.
    """

    first: str = part_of_name(0, "+", "")
    second: str = part_of_name(2, "+", "")
    draw_of_pair: int = number_below(CLOSE_PAIRS)
    start_share: float = uniform(0.2, 0.8)
    start_s: float | None = setting("start_s")

    def __post_init__(self) -> None:
        if bool(self.first) != bool(self.second) or (self.first and self.first == self.second):
            raise self.wrong_target(f"{self.first}+{self.second}")

    def measured(self, instruments: Instruments) -> Instruments:
        if self.first:
            a, b = instruments.column(self.first), instruments.column(self.second)
        else:
            places = np.nanmedian(instruments.points_m, axis=0)
            distance = np.linalg.norm(places[:, None] - places[None], axis=2)
            distance[np.tril_indices(len(places))] = np.inf
            flat = np.argsort(np.nan_to_num(distance, nan=np.inf), axis=None)[self.draw_of_pair]
            a, b = map(int, np.unravel_index(flat, distance.shape))
        times = instruments.frame_times_s()
        free = max(times[-1] - self.size, 0.0)
        start = self.start_share * free if self.start_s is None else self.start_s
        inside = np.flatnonzero((times >= start) & (times < start + self.size))[:, None]
        points = instruments.points_m.copy()
        points[inside, [a, b]] = points[inside, [b, a]]
        return replace(instruments, points_m=points)

    def place(self) -> str:
        return super().place().strip("+")  # nothing where the pair is drawn in each recording


class OverSmoothing(Effect, name="over_smoothing"):
    """The lab delivers its markers after a Butterworth low-pass (order 4, zero phase) at `size`."""

    def measured(self, instruments: Instruments) -> Instruments:
        rate = instruments.marker_hz
        if self.size >= 0.5 * rate:
            return instruments
        # two passes of order 2: the corner is raised so that both together cut at `size`
        corner = self.size / (np.sqrt(2.0) - 1.0) ** 0.25
        filters = butter(2, min(corner, 0.49 * rate), fs=rate, output="sos")
        points = instruments.points_m.copy()
        for column in range(points.shape[1]):
            for part in runs(np.isfinite(points[:, column]).all(axis=1)):
                if part.stop - part.start >= LEAST_FRAMES:
                    points[part, column] = sosfiltfilt(filters, points[part, column], axis=0)
        return replace(instruments, points_m=points)


# --- persons who are not what landmarks, tables or the skeleton's joints say ----------------------


# Joints that a model finds between (or beside) markers of the segment above them.
LANDMARKS = {"knee": ("KNEL", "KNEM"), "ankle": ("MALL", "MALM"), "elbow": ("ELB", "ELBM")}
LEAST_RANGE_RAD = 0.25  # a trial that bends the waist less bends the spine less too


class JointCentre(Effect, name="joint_centre"):
    """The true centre lies at shift_m from where its landmarks put it (parent segment's axes).

    Hips and shoulders move against the markers; knees, ankles, elbows stay and their
    landmarks are palpated wrongly by the opposite shift.
    """

    joint: str = named(*JOINTS)
    shift_m: np.ndarray = by(lambda size, target, rng: size * direction(rng))

    def person(self, person: Person) -> Person:
        kind, side = self.joint[:-2], self.joint[-1]
        if kind not in LANDMARKS:
            joints = {**person.joints_m, self.joint: person.joints_m[self.joint] + self.shift_m}
            return replace(person, joints_m=joints)
        markers = dict(person.markers)
        for label in {side.upper() + name for name in LANDMARKS[kind]} & set(markers):
            marker = markers[label]
            markers[label] = replace(marker, position_m=marker.position_m - self.shift_m)
        return replace(person, markers=markers)


class MissingJoint(Effect, name="missing_joint"):
    """The spine bends at T12/L1 through `size` rad, and the waist by as much less.

    In all three axes the same part of the trunk's motion; in a trial that bends the trunk by
    less than LEAST_RANGE_RAD, in proportion.
    """

    def plan(self, person: Person, plan: Plan) -> Plan:
        waist = plan.angles_rad["waist"]
        flexion_range = float(np.ptp(waist[plan.keep, 0]))
        part = min(1.0, self.size / max(flexion_range, LEAST_RANGE_RAD))
        angles = {**plan.angles_rad, "waist": (1.0 - part) * waist, "spine": part * waist}
        notes = {**plan.notes, "missing_joint_range_rad": part * flexion_range}
        return replace(plan, angles_rad=angles, notes=notes)


class SegmentInertia(Effect, name="segment_inertia"):
    """A segment is heavier by the part `size` of its mass, and so are its second moments.

    The other segments are lighter in proportion: the person's mass stays. The centre of mass
    moves away from the segment's origin by half of `size`, the origin's distance being 1.
    """

    segment: str = named(*SEGMENTS)

    def person(self, person: Person) -> Person:
        own = ("abdomen", "thorax") if self.segment == "upper_torso" else (self.segment,)
        mass = sum(person.inertias[body].mass_kg for body in own)
        others = (person.mass_kg - (1.0 + self.size) * mass) / (person.mass_kg - mass)
        inertias = {}
        for body, part in person.inertias.items():
            scale = 1.0 + self.size if body in own else others
            along = 1.0 + 0.5 * self.size if body in own else 1.0
            com = part.com_m * np.array([1.0, along, 1.0])
            inertias[body] = Inertia(scale * part.mass_kg, com, scale * part.tensor_kgm2)
        return replace(person, inertias=inertias)
