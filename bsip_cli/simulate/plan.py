"""What a movement prescribes: joint angles, feet, support, and what the body carries.

Walkway frame: X ahead, Y up, Z right, origin on the ground; moments are about it. A plan leaves the
pelvis' horizontal path (and in flight its whole pose) to `balance`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from bsip_cli.simulate.numerics import rotate, second_derivative

STEP_S = 0.001
GRAVITY = np.array([0.0, -9.81, 0.0])
G = -GRAVITY[1]


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies in one world frame.

    rotation : (T, 3, 3) by body. origin_m : (T, 3) by body.
    excess_reach_m : (T,) how far the feet were out of the legs' reach (0 = reachable).
    """

    rotation: dict[str, np.ndarray]
    origin_m: dict[str, np.ndarray]
    excess_reach_m: np.ndarray

    def point(self, body: str, position_m: np.ndarray) -> np.ndarray:
        """(T, 3) world path of a point (3,) of a body."""
        return self.origin_m[body] + rotate(self.rotation[body], position_m)

    def part(self, samples: slice) -> Poses:
        """The same poses at some of the samples."""
        rotation = {name: R[samples] for name, R in self.rotation.items()}
        origin = {name: p[samples] for name, p in self.origin_m.items()}
        return Poses(rotation, origin, self.excess_reach_m[samples])


@dataclass(frozen=True, eq=False)
class Load(ABC):
    """Something that the body has to move, to hold, or may lean on.

    over_time : names of the fields that are arrays over time.
    """

    over_time: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Force (T, 3) that the body exerts on it, and that force's moment (T, 3)."""

    def thinned(self, samples: slice) -> Self:
        """The same load at some of the samples."""
        return replace(self, **{name: getattr(self, name)[samples] for name in self.over_time})


@dataclass(frozen=True, eq=False)
class Ball(Load):
    """A ball, or any small object, in a hand; a point mass.

    position_m : (3,) in the body's frame.
    hold : (T,) 1 while held, falling smoothly to 0 at the release.
    release_s : when half the load has left the hand, on the recording's clock.
    """

    over_time = ("hold",)
    body: str
    mass_kg: float
    position_m: np.ndarray
    hold: np.ndarray
    release_s: float

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """The force that moves and holds it."""
        r = poses.point(self.body, self.position_m)
        force = self.hold[:, None] * self.mass_kg * (second_derivative(r, step_s) - GRAVITY)
        return force, np.cross(r, force)


def total_load(loads: Iterable[Load], poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Force (T, 3) and moment (T, 3) of the body on all its loads."""
    force, moment = np.zeros((2, *poses.origin_m[next(iter(poses.origin_m))].shape))
    for load in loads:
        one_force, one_moment = load.wrench(poses, step_s)
        force += one_force
        moment += one_moment
    return force, moment


@dataclass(frozen=True, eq=False)
class Foot:
    """One foot over time.

    position_m : (T, 3) ankle joint centre. rotation : (T, 3, 3) foot frame in the walkway frame.
    share : (T,) part of the ground force that this foot carries (0 when it is in the air).
    cop_m : (T, 2) centre of pressure under this foot, X and Z.
    on_plate : (T,) whether its contact (if any) is on the plate.
    """

    position_m: np.ndarray
    rotation: np.ndarray
    share: np.ndarray
    cop_m: np.ndarray
    on_plate: np.ndarray


@dataclass(frozen=True, eq=False)
class Plan:
    """A movement before balance. All arrays share one time axis.

    angles_rad : waist, neck (T, 3): flexion about Z, about X, about Y;
        spine (T, 3), if given: the same, of the thorax on the abdomen;
        girdle_* (T, 2), if given: clavicle raised and brought forward beside what the arm's rhythm
        does; shoulder_* (T, 3): flexion, abduction, internal rotation; elbow_* (T,): flexion;
        wrist_* (T, 3): flexion, radial deviation, pronation.
    pelvis_angles_rad : (T, 3) about Z, X, Y in the walkway frame; (nominal in flight).
    pelvis_m : (T, 3) nominal path of the lumbar joint centre.
    feet : by side, "l" and "r".
    com_height_m : (T,) prescribed height of the centre of mass, or None: then the
        pelvis keeps its nominal height.
    flights : (first, last) sample of each phase without contact.
    speed_m_s : mean forward speed.
    sway_share : part of the unbalanced motion's COP excursion that is left standing.
    longest_reach : of a leg, as part of thigh plus shank; keeps knees from locking.
    keep : the part of the samples that is recorded.
    ball : a ball in a hand. loads : what else the body carries or leans on.
    plate_centre_m : X and Z of the first plate's centre, walkway frame.
    """

    step_s: float
    angles_rad: dict[str, np.ndarray]
    pelvis_angles_rad: np.ndarray
    pelvis_m: np.ndarray
    feet: dict[str, Foot]
    keep: slice
    com_height_m: np.ndarray | None = None
    flights: tuple[tuple[int, int], ...] = ()
    speed_m_s: float = 0.0
    sway_share: float = 0.0
    longest_reach: float = 0.9985
    ball: Ball | None = None
    loads: tuple[Load, ...] = ()
    plate_centre_m: tuple[float, float] = (0.0, 0.0)
    notes: dict[str, object] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.pelvis_m)

    def cop_m(self) -> np.ndarray:
        """(T, 2) planned centre of pressure of both feet together."""
        left, right = self.feet["l"], self.feet["r"]
        return left.share[:, None] * left.cop_m + right.share[:, None] * right.cop_m

    def all_loads(self) -> tuple[Load, ...]:
        """The ball and everything else that the body has to move or to lean on."""
        return self.loads if self.ball is None else (self.ball, *self.loads)

    def with_load(self, load: Load) -> Plan:
        return replace(self, loads=(*self.loads, load))

    def recorded_times_s(self) -> np.ndarray:
        """(T,) times of the samples on the recording's clock."""
        return (np.arange(len(self)) - self.keep.start) * self.step_s

    def recorded_length_s(self) -> float:
        return (self.keep.stop - self.keep.start) * self.step_s

    def thinned(self, factor: int) -> Plan:
        """Every `factor`-th sample."""

        def thin(part: Any) -> Any:
            if isinstance(part, np.ndarray):
                return part[::factor]
            if isinstance(part, dict):
                return {name: thin(one) for name, one in part.items()}
            if isinstance(part, Foot):
                return Foot(*(thin(getattr(part, one.name)) for one in fields(part)))
            return part.thinned(slice(None, None, factor)) if isinstance(part, Load) else part

        over_time = ("angles_rad", "pelvis_angles_rad", "pelvis_m", "feet", "com_height_m", "ball")
        return replace(
            self,
            **{name: thin(getattr(self, name)) for name in over_time},
            step_s=self.step_s * factor,
            loads=tuple(map(thin, self.loads)),
            keep=slice(self.keep.start // factor, -(-self.keep.stop // factor)),
        )
