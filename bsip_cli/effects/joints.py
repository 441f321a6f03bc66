"""Joints that are misplaced in the model, and one that it lacks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import Person
from bsip_cli.dynamics.segment_motion import UP, Point
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words, along_xyz
from bsip_cli.effects.scene import Scene
from bsip_cli.segments import the_joint


def displaced(mass_kg: float, centre: Point, shift_m: np.ndarray, rate_hz: float) -> np.ndarray:
    """(N, 6, k) what the wrench about the world's origin gains when a mass is shifted, turned as
    the model has it.

    centre : the mass' own, as the model moves it. shift_m : (N, 3, k) small, world axes.
    """
    speed = np.gradient(shift_m, 1 / rate_hz, axis=0)
    force = mass_kg * np.gradient(speed, 1 / rate_hz, axis=0)
    carried = mass_kg * (centre.acceleration_m_s2 + GRAVITY_M_S2 * UP)
    moment = np.cross(centre.position_m[..., None], force, axis=1)
    moment += np.cross(shift_m, carried[..., None], axis=1)
    return np.concatenate([force, moment], axis=1)


MOST_M = 0.05


class JointCentre(Effect):
    """A joint that truly lies elsewhere in the parent segment than the model has it.

    The true centre is the model's plus the shift, in the parent's axes.

    In the static trial the limb lies where its markers are, whichever centre the model has. When
    the joint turns, true and modelled limb come apart by (R_parent - R_child) shift: the limb's
    masses are in other places, and its markers drag the pose along. A residual that stays the
    same may be lost where scaling has moved the markers.
    """

    name = "joint_centre"
    is_of_person = True
    of_the_body = True
    numbers = along_xyz("shift", "m", -MOST_M, MOST_M, 0.015)
    looks = (
        "moments and centre of pressure that err with the angle of one joint; its markers"
        " fit worse as it bends"
    )
    remedy = "record a trial that turns this joint alone, and scale with it"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.person.skeleton.joints[1:]

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        i = scene.person.skeleton.joints.index(target)
        return scene.once((self.name, i), lambda: self._wrenches(scene, i)) @ values

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        i = scene.person.skeleton.joints.index(target)
        markers = scene.markers_beyond(i)
        apart = (self._apart(scene, i) @ values)[:, None, :, None]
        errors = np.broadcast_to(apart, (len(apart), len(markers), 3, 1))
        return scene.pose_response.left(errors, markers)[..., 0]

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """No further than palpated or regressed centres lie off."""
        return bool(np.linalg.norm(values) < MOST_M)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        size = f"{1000 * np.linalg.norm(values):.0f} mm"
        what = f"the centre of {the_joint(target)} lies {size} from where the model has it"
        return Words(what, is_signed=False)

    @staticmethod
    def _apart(scene: Scene, i: int) -> np.ndarray:
        """(N, 3, 3) world shift of the limb beyond joint i for a unit shift along each parent
        axis."""
        parent = scene.motion.rotation[:, scene.person.skeleton.parents[i]]
        neutral = scene.person.joint_rotations()[i]
        return parent - scene.motion.rotation[:, i] @ neutral.T

    def _wrenches(self, scene: Scene, i: int) -> np.ndarray:
        """(N, 6, 3) change of the simulated wrench for a unit shift along each parent axis."""
        apart, markers = self._apart(scene, i), scene.markers_beyond(i)
        errors = np.broadcast_to(apart[:, None], (len(apart), len(markers), 3, 3))
        dragged = scene.response.of(scene.pose_response.of(errors, markers))
        return displaced(*scene.mass_beyond(i), apart, scene.rate_hz) - dragged


BELOW = 0.4  # of length and mass of the upper torso: up to T12/L1
CHORD = 0.3  # share at which the change is exact; for others it is taken for linear
AXES = {"flexion": 2, "lateral": 0, "axial": 1}
LITTLE_RAD = 0.15
SHARE = 0.15  # to which a part is known: no trunk bends at two places only
_WORTH_A_WORD = 0.05
_MOVEMENTS = {"flexion": "bending forwards", "lateral": "bending sideways", "axial": "turning"}


@dataclass(frozen=True, eq=False)
class SplitTorso:
    """The two parts of a torso that bends a second time.

    segment : that is split. joint_m : (3,) second joint from the first, segment axes.
    below : part of length and mass below the second joint.
    shares : per axis, in the order of ``AXES``, the part of the first joint's turn that happens at
        the second.
    """

    segment: str
    joint_m: np.ndarray
    below: float
    shares: tuple[float, ...]


def split_torso(person: Person, target: str, values: np.ndarray) -> SplitTorso:
    """The torso as the effect's values (3,) describe it."""
    joint = _second_joint(person, person.skeleton.index(target))
    return SplitTorso(target, joint, BELOW, tuple(float(x) for x in values))


def _second_joint(person: Person, i: int) -> np.ndarray:
    """(3,) T12/L1 from the waist, on the line to the neck, torso axes [m]."""
    return BELOW * person.origin_in_joint_m[i]


class MissingJoint(Effect):
    """A trunk that bends a second time between waist and neck.

    A part of the waist's turn happens at T12/L1 instead; the parameters are that part, per axis.
    What lies above is turned as the model has it, but shifted; the part below turns less. The
    markers above follow and drag the pose along.
    """

    name = "missing_joint"
    is_of_person = True
    numbers = tuple(Parameter(axis, "1", -0.5, 1.5, 0.3, known_to=SHARE) for axis in AXES)
    looks = "markers of the trunk that fit badly when it bends, and moments that go with the bend"
    remedy = "put markers on both sides of T12/L1 and bend the trunk"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        skeleton = scene.person.skeleton
        jointed = zip(skeleton.segments, skeleton.joint_types, strict=True)
        return tuple(s for s, kind in jointed if s == "upper_torso" and kind == "spherical")

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return scene.once((self.name, target), lambda: self._wrenches(scene, target)) @ values

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        errors = self._errors(scene, target) @ values
        markers = scene.markers_beyond(scene.person.skeleton.index(target))
        return scene.pose_response.left(errors[..., None], markers)[..., 0]

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """Range of the second bend about each axis: its part of the turn that the pose would have
        without it."""
        i = scene.person.skeleton.index(target)

        def dragged() -> np.ndarray:
            """(N, 3, 3) by how much less the pose turns the waist, per share."""
            moved = scene.pose_response.of(self._errors(scene, target), scene.markers_beyond(i))
            at = scene.person.skeleton.v_starts[i]
            return moved[:, at : at + 3]

        turn = _turn(scene, i) - scene.once((self.name, target, "dragged"), dragged) @ values
        ranges = np.ptp(turn[:, list(AXES.values())], axis=0) * values
        return tuple((axis, "rad", float(x)) for axis, x in zip(AXES, ranges, strict=True))

    def is_identifiable(self, scene: Scene, target: str) -> np.ndarray:
        """A movement that is hardly made says nothing of its part."""
        made = np.ptp(_turn(scene, scene.person.skeleton.index(target)), axis=0) > LITTLE_RAD
        return made[list(AXES.values())]

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        asked = np.where(self.is_identifiable(scene, target), values, 0.0)
        return super().possible(scene, target, asked)

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        shares = dict(zip(AXES, values.tolist(), strict=True))
        large = {axis: x for axis, x in shares.items() if abs(x) >= _WORTH_A_WORD} or shares
        parts = ", ".join(f"{100 * x:.0f} % of its {_MOVEMENTS[axis]}" for axis, x in large.items())
        short = "the trunk moves at a second joint between waist and neck"
        return Words(f"{short} ({parts})", short)

    @staticmethod
    def _errors(scene: Scene, target: str) -> np.ndarray:
        """(N, m', 3, 3) how markers of the torso and beyond lie off, per share and axis."""
        person, i = scene.person, scene.person.skeleton.index(target)
        joint, places = _second_joint(person, i), person.markers_in_joint_m()
        above = _shift_of(scene, i, joint)
        shifts = []
        for m in scene.markers_beyond(i):
            below = person.marker_segments[m] == i and places[m, 1] < joint[1]
            shifts.append(_shift_of(scene, i, places[m]) if below else above)
        return np.stack(shifts, axis=1)

    def _wrenches(self, scene: Scene, target: str) -> np.ndarray:
        """(N, 6, 3) change of the simulated wrench, per share and axis."""
        i = scene.person.skeleton.index(target)
        joint = _second_joint(scene.person, i)
        shift = _shift_of(scene, i, joint)
        moved = displaced(*scene.mass_beyond(i), shift, scene.rate_hz)
        # The part below is shifted by half as much on average.
        middle = scene.motion.point(i, 0.5 * joint)
        moved -= displaced(0.5 * BELOW * float(scene.phi_of(i)[0]), middle, shift, scene.rate_hz)
        pose = scene.pose_response.of(self._errors(scene, target), scene.markers_beyond(i))
        return moved - scene.response.of(pose)


def _turn(scene: Scene, i: int) -> np.ndarray:
    """(N, 3) rotation vector of a spherical joint [rad]."""
    at = scene.person.skeleton.q_starts[i]
    return Rotation.from_quat(scene.q[:, at : at + 4]).as_rotvec()


def _shift_of(scene: Scene, i: int, place_m: np.ndarray) -> np.ndarray:
    """(N, 3, 3) how a place (3,) below the second joint truly lies off, per share and axis."""
    turn = _turn(scene, i)
    parent = scene.motion.rotation[:, scene.person.skeleton.parents[i]]
    parent = parent @ scene.person.joint_rotations()[i]
    straight = Rotation.from_rotvec(turn).apply(place_m)
    columns = []
    for axis in AXES.values():
        less = turn.copy()
        less[:, axis] *= 1 - CHORD
        columns.append((Rotation.from_rotvec(less).apply(place_m) - straight) / CHORD)
    return parent @ np.stack(columns, axis=2)
