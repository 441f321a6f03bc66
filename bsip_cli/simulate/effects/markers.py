"""Markers that slip, are mistaken for each other, are smoothed, or stand still."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.instruments.readings import Instruments
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.effects.base import JOINTS, Effect, Target, direction, span
from bsip_cli.simulate.numerics import frame_of, glide, rotate, runs, step
from bsip_cli.simulate.people import Inertia, Person
from bsip_cli.simulate.plan import Plan

SLIP_S = 0.05
SOFT = 0.1  # of the window of a slide, in which it speeds up, and slows down
COMPANIONS = 3
CLOSE_PAIRS = 5
LEAST_FRAMES = 15  # a shorter interval between gaps is not smoothed


@dataclass(frozen=True, eq=False)
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
        points[:, column] += way[:, None] * rotate(companion_frame(points, column), self.along)
        return replace(instruments, points_m=points)

    @abstractmethod
    def moved(self, times_s: np.ndarray) -> np.ndarray:
        """(F,) part of the way that it has gone, 0 to 1."""


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
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


def companion_frame(points_m: np.ndarray, column: int) -> np.ndarray:
    """(F, 3, 3) axes of the markers that keep their distance to a marker best.

    NaN where one of them is lost: then that frame of the marker is lost too.
    """
    distance = np.linalg.norm(points_m - points_m[:, [column]], axis=2)
    seen = np.isfinite(distance).mean(axis=0)
    spread = np.nanstd(np.where(seen > 0.5, distance, 0.0), axis=0)
    spread = np.where(seen > 0.5, spread, np.inf)
    spread[column] = np.inf
    a, b, c = points_m[:, np.argsort(spread, kind="stable")[:COMPANIONS]].transpose(1, 0, 2)
    return frame_of(b - a, c - a)


@dataclass(frozen=True, eq=False)
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

    def _pair(self, instruments: Instruments) -> tuple[int, int]:
        """The columns of the two markers."""
        if self.first:
            return instruments.column(self.first), instruments.column(self.second)
        points = np.nanmedian(instruments.points_m, axis=0)
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        distance[np.tril_indices(len(points))] = np.inf
        flat = np.argsort(np.nan_to_num(distance, nan=np.inf), axis=None)[self.draw_of_pair]
        a, b = np.unravel_index(flat, distance.shape)
        return int(a), int(b)

    def measured(self, instruments: Instruments) -> Instruments:
        a, b = self._pair(instruments)
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


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
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
