"""Force plates that are late, lie elsewhere, or read wrongly; markers that slip, are mistaken for
each other, or are smoothed; persons who are not what these show.

Channels are the six components in the plate's own axes, moments about its sensor.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Self

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import COMPONENTS, Instruments, SensingPlate
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.effects.base import JOINTS, Effect, Target, direction, span
from bsip_cli.simulate.numerics import frame_of, from_rotation_vector, glide, rotate, runs, step
from bsip_cli.simulate.people import Inertia, Person
from bsip_cli.simulate.plan import Plan

AXES = ("x", "y", "z")
TURNS = {"yaw": 2, "tilt_x": 0, "tilt_y": 1}


# --- clocks ---------------------------------------------------------------------------------------


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


# --- plates ---------------------------------------------------------------------------------------


class TurnedAxes(Effect):
    """turn_rad : rotation vector, lab axes."""

    turn_rad: np.ndarray

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, size * _axis(target.name, rng))


class GravityTilt(TurnedAxes, name="gravity_tilt"):
    """The lab's axes are turned against the world by turn_rad.

    Markers and forces turn together about the first plate's centre, so that the physics
    stays whole; only gravity no longer points down the lab's vertical.
    """

    def measured(self, instruments: Instruments) -> Instruments:
        turn, pivot = from_rotation_vector(self.turn_rad), instruments.plates[0].centre_m
        points = (instruments.points_m - pivot) @ turn.T + pivot
        readings = []
        for reading, plate in zip(instruments.readings, instruments.plates, strict=True):
            force, moment = plate.lab_wrench(reading, pivot)
            readings.append(plate.reading(force @ turn.T, moment @ turn.T, pivot))
        return replace(instruments, points_m=points, readings=np.stack(readings))


class CameraFrame(TurnedAxes, name="camera_frame"):
    """All markers are turned by turn_rad about the lab's origin."""

    def measured(self, instruments: Instruments) -> Instruments:
        turn = from_rotation_vector(self.turn_rad)
        return replace(instruments, points_m=instruments.points_m @ turn.T)


class OfEveryPlate(Effect, ABC):
    """A plate reads otherwise, or each of them."""

    plate = 0  # its number; 0 for all

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
        return f"plate {self.plate}" if self.plate else "all plates"


class PlateTranslation(OfEveryPlate, name="plate_translation"):
    """The plate truly lies at its stated place plus shift_m (lab axes).

    plate : its number, or 0 for all of them.
    """

    shift_m: np.ndarray
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, size * _axis(target.name, rng), int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, 3:] -= np.cross(plate.axes.T @ self.shift_m, reading[:, :3])


class PlateRotation(OfEveryPlate, name="plate_rotation"):
    """The plate is truly turned by turn_rad (rotation vector, lab axes) about its centre."""

    turn_rad: np.ndarray
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        axis = np.eye(3)[TURNS[target.name or "yaw"]]
        return cls(size, size * axis, int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        force, moment = plate.lab_wrench(reading, plate.centre_m)
        turn = from_rotation_vector(self.turn_rad)
        reading[:] = plate.reading(force @ turn, moment @ turn, plate.centre_m)


def _axis(name: str, rng: np.random.Generator) -> np.ndarray:
    """(3,) a lab axis, or a drawn horizontal direction."""
    heading = rng.uniform(-np.pi, np.pi)
    drawn = np.array([np.cos(heading), np.sin(heading), 0.0])
    return np.eye(3)[AXES.index(name)] if name else drawn


# --- channels -------------------------------------------------------------------------------------


class ChannelFault(OfEveryPlate):
    """An error of one channel. plate : its number, or 0 for all."""

    channel: str
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, target.name or "fz", int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        column = COMPONENTS.index(self.channel)
        reading[:, column] = self.shown(reading[:, column], times_s)

    @abstractmethod
    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        """What the channel (N,) shows instead of its true values."""

    def place(self) -> str:
        return self.channel + (f" of plate {self.plate}" if self.plate else "")


class PlateGain(ChannelFault, name="plate_gain"):
    """The channel shows 1 + size times the truth."""

    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return (1.0 + self.size) * values


class OwnSignal(ChannelFault):
    """Something is added to the channel, whatever it measures."""

    def injected(self, instruments: Instruments) -> Instruments:
        """What the software that wrote the file has set to zero stays so."""
        changed = self.measured(instruments)
        silent = (instruments.readings == 0).all(axis=2, keepdims=True)
        return replace(changed, readings=np.where(silent, 0.0, changed.readings))


class PlateZero(OwnSignal, name="plate_zero"):
    """A constant is added to the channel."""

    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return values + self.size


class PlateDrift(OwnSignal, name="plate_drift"):
    """The channel's zero moves at a constant rate, from 0 at the start of each trial."""

    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return values + self.size * times_s


class PlateCrosstalk(OfEveryPlate, name="plate_crosstalk"):
    """Channel `to` shows size times channel `source` plus its own."""

    source: str
    to: str
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        source, _, to = (target.name or "fz:fx").partition(":")
        if source not in COMPONENTS or to not in COMPONENTS or source == to:
            raise cls.wrong_target(target.name)
        return cls(size, source, to, int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        source, to = COMPONENTS.index(self.source), COMPONENTS.index(self.to)
        reading[:, to] += self.size * reading[:, source]

    def place(self) -> str:
        return f"{self.source}:{self.to}" + (f" of plate {self.plate}" if self.plate else "")


# --- markers --------------------------------------------------------------------------------------


SLIP_S = 0.05
SOFT = 0.1  # of the window of a slide, in which it speeds up, and slows down
COMPANIONS = 3
CLOSE_PAIRS = 5
LEAST_FRAMES = 15  # a shorter interval between gaps is not smoothed


class OnSkin(Effect):
    """A marker moves along the skin, and stays there.

    along : (3,) unit vector in the frame of the three markers that keep their distance to it best.
    """

    marker: str
    draw_of_marker: int
    along: np.ndarray

    def measured(self, instruments: Instruments) -> Instruments:
        drawn = instruments.labels[self.draw_of_marker % len(instruments.labels)]
        column = instruments.column(self.marker or drawn)
        way = self.size * self.moved(instruments.frame_times_s())
        points = instruments.points_m.copy()
        distance = np.linalg.norm(points - points[:, [column]], axis=2)
        seen = np.isfinite(distance).mean(axis=0)
        spread = np.nanstd(np.where(seen > 0.5, distance, 0.0), axis=0)
        spread = np.where(seen > 0.5, spread, np.inf)
        spread[column] = np.inf
        a, b, c = points[:, np.argsort(spread, kind="stable")[:COMPANIONS]].transpose(1, 0, 2)
        # NaN where a companion is lost: then that frame of the marker is lost too
        points[:, column] += way[:, None] * rotate(frame_of(b - a, c - a), self.along)
        return replace(instruments, points_m=points)

    @abstractmethod
    def moved(self, times_s: np.ndarray) -> np.ndarray:
        """(F,) part of the way that it has gone, 0 to 1."""


class MarkerShift(OnSkin, name="marker_shift"):
    """A marker slips along the skin, within SLIP_S, and stays there.

    from_share : the part of a trial after which it slips, unless from_s is given.
    """

    from_share: float
    from_s: float | None

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        number, share = int(rng.integers(1 << 16)), float(rng.uniform(0.2, 0.6))
        from_s = target.settings.get("from_s")
        return cls(size, target.name, number, direction(rng), share, from_s)

    def moved(self, times_s: np.ndarray) -> np.ndarray:
        start = self.from_share * times_s[-1] if self.from_s is None else self.from_s
        return step(times_s, start, start + SLIP_S)


class MarkerSlide(OnSkin, name="marker_slide"):
    """A marker slides along the skin for a part of the trial, and stays there.

    window_share : start and end as parts of a trial.
    """

    window_share: tuple[float, float]

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        number, share = int(rng.integers(1 << 16)), span(rng, 0.1, 0.4, 0.3, 0.5)
        return cls(size, target.name, number, direction(rng), share)

    def moved(self, times_s: np.ndarray) -> np.ndarray:
        start, end = (share * times_s[-1] for share in self.window_share)
        return glide(times_s, start, end, SOFT * (end - start))


class MarkerSwap(Effect, name="marker_swap"):
    """Two markers carry each other's label for `size` seconds.

    start_share : where the window lies in each trial, 0 at its start and 1 at its end,
        unless start_s is given.
    """

    first: str
    second: str
    draw_of_pair: int
    start_share: float
    start_s: float | None

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        first, _, second = target.name.partition("+")
        if bool(first) != bool(second) or (first and first == second):
            raise cls.wrong_target(target.name)
        number, share = int(rng.integers(CLOSE_PAIRS)), float(rng.uniform(0.2, 0.8))
        return cls(size, first, second, number, share, target.settings.get("start_s"))

    def measured(self, instruments: Instruments) -> Instruments:
        if self.first:
            a, b = instruments.column(self.first), instruments.column(self.second)
        else:
            points = np.nanmedian(instruments.points_m, axis=0)
            distance = np.linalg.norm(points[:, None] - points[None], axis=2)
            distance[np.tril_indices(len(points))] = np.inf
            flat = np.argsort(np.nan_to_num(distance, nan=np.inf), axis=None)[self.draw_of_pair]
            a, b = map(int, np.unravel_index(flat, distance.shape))
        times = instruments.frame_times_s()
        free = max(times[-1] - self.size, 0.0)
        start = self.start_share * free if self.start_s is None else self.start_s
        inside = np.flatnonzero((times >= start) & (times < start + self.size))
        points = instruments.points_m.copy()
        points[inside, a], points[inside, b] = points[inside, b].copy(), points[inside, a].copy()
        return replace(instruments, points_m=points)

    def place(self) -> str:
        return f"{self.first}+{self.second}" if self.first else ""


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

    joint: str
    shift_m: np.ndarray

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        joint = target.name or str(rng.choice(JOINTS))
        return cls(size, joint, size * direction(rng))

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

    segment: str

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, target.name or str(rng.choice(SEGMENTS)))

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
