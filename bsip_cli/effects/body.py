"""A body that is heavier, bends, swings or breathes otherwise than the model's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import centre_of_pressure
from bsip_cli.dynamics.segment_motion import UP, Point
from bsip_cli.effects.effect import Effect, Parameter, Reported, along_xyz
from bsip_cli.effects.scene import Scene

# --- masses ---------------------------------------------------------------------------------------


class StatedMass(Effect):
    """A person heavier or lighter than is stated, every segment alike: what a laboratory's plates
    must not be blamed for. No part of the catalogue: within one person it looks like a
    gain of all plates."""

    name = "stated_mass"
    scope = "person"
    says = "the person weighs {size:.1f} % {order} than is stated"
    remedy = "weigh the person as recorded"
    parameter = Parameter("share", "1", -0.5, 1.0, 0.01)  # scales, clothes and a week make as much
    numbers = (parameter,)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[0] * scene.predicted


MASS_SHARE, CENTRE_SHARE, INERTIA_SHARE = 0.2, 0.06, 0.3  # how far people are from tables
LEAST_FORCE_N = 50.0


class SegmentInertia(Effect):
    """A segment whose mass, centre of mass and inertia are not those of the table."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        length = scene.length_of(target)
        mass = MASS_SHARE * float(scene.phi_of(target)[0])
        return (
            Parameter("mass_change", "kg", -5 * mass, 10 * mass, mass),
            *along_xyz("shift", "m", length, CENTRE_SHARE * length),
            Parameter("inertia_change", "1", -1.0, 3.0, INERTIA_SHARE),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return scene.wrenches(target) @ (_changes(scene.phi_of(target)) @ values)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """A body with these parameters exists, with its centre of mass inside the segment."""
        phi = scene.phi_of(target) + _changes(scene.phi_of(target)) @ values
        if phi[0] <= 0:
            return False
        origin = scene.person.origin_in_joint_m[scene.person.skeleton.index(target)]
        body = from_phi(phi).moved(origin)
        return body.is_physical() and bool(np.linalg.norm(body.com_m) < scene.length_of(target))

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The part of the squared error of wrench and centre of pressure that it takes away."""
        heights = [plate.centre_m()[2] for plate in scene.plates]
        height = float(np.mean(heights)) if heights else 0.0  # of the plates' surface
        after = scene.predicted + self.change(scene, target, values)
        wrenches = (scene.measured, scene.predicted, after)
        seen, was, now = (centre_of_pressure(one, height, LEAST_FORCE_N) for one in wrenches)
        share, cop_share = _share(*wrenches, scene.valid), _share(seen, was, now, scene.valid)
        return (("share", "1", share), ("cop_share", "1", cop_share))


def _changes(phi: np.ndarray) -> np.ndarray:
    """(10, 5) of a segment's parameters (10,) about the joint by those of the effect: the whole
    segment heavier, its mass moved, its tensor about the centre of mass larger, to first order."""
    mass, body = phi[0], from_phi(phi)
    central = Inertia(0.0, body.com_m, body.tensor_kgm2).phi()
    return np.column_stack([phi / mass, mass * moved_phi(body.com_m), central])


def moved_phi(place_m: np.ndarray) -> np.ndarray:
    """(10, 3) change of the inertial parameters of 1 kg at a place (3,) for each metre along an
    axis: exact, since they are quadratic in the place."""
    ahead, behind = (
        [Inertia(1.0, place_m + step, np.zeros((3, 3))).phi() for step in side * np.eye(3)]
        for side in (1, -1)
    )
    return 0.5 * np.transpose(np.subtract(ahead, behind))


def _share(measured: np.ndarray, before: np.ndarray, after: np.ndarray, valid: np.ndarray) -> float:
    """1 less the ratio of the squared errors, every component counted by its error before."""
    known = valid & np.isfinite(measured + before + after).all(axis=1)
    if not known.any():
        return float("nan")
    was, now = (((measured - x)[known] ** 2).mean(axis=0) for x in (before, after))
    return float(1 - np.mean(now / np.maximum(was, 1e-12)))


# --- joints that are misplaced in the model, and one that it lacks --------------------------------


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


MOST_M = 0.05  # further off no palpated or regressed centre lies


class JointCentre(Effect):
    """A joint that truly lies elsewhere in the parent segment than the model has it.

    The true centre is the model's plus the shift, in the parent's axes.

    In the static trial the limb lies where its markers are, whichever centre the model has. When
    the joint turns, true and modelled limb come apart by (R_parent - R_child) shift: the limb's
    masses are in other places, and its markers drag the pose along. A residual that stays the
    same may be lost where scaling has moved the markers.
    """

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

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        shares = dict(zip(AXES, values.tolist(), strict=True))
        large = {axis: x for axis, x in shares.items() if abs(x) >= _WORTH_A_WORD} or shares
        parts = (f"{100 * x:.0f} % of its {_MOVEMENTS[axis]}" for axis, x in large.items())
        return {"parts": ", ".join(parts)}

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
        moved -= displaced(
            0.5 * BELOW * float(scene.phi_of(target)[0]), middle, shift, scene.rate_hz
        )
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


# --- soft tissue and breath -----------------------------------------------------------------------

# Body weights by which the vertical force changes within IMPACT_S: at most 0.6 in fast movements
# without impacts of either simulator, 1.1 to 3 in heel drops, hops and landings.
IMPACT, IMPACT_S = 0.8, 0.05
FREQUENCIES_HZ = (2.5, 3.0, 3.5, 4.0, 5.0, 6.5)
DAMPING = (0.1, 0.2, 0.4)
# Soft tissue is no point on one spring: its numbers are known to these standard deviations. Beneath
# the markers of a limb the skin slides, and the mass that swings there is found too low.
MASS_KG, LIMB_MASS_KG, FREQUENCY_HZ, DAMPING_RATIO = 0.5, 0.8, 0.05, 0.02


class WobblingMass(Effect):
    """A part of a segment's mass that swings against the bone.

    A mass on a spring and a damper at the segment's centre of mass.

    Looked for only where an impact sets it swinging: in slow movement it is a heavier segment. It
    need not swing to the sides as it does up and down: how much of it seems to is a number of its
    own, which is not reported.
    """

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Where the vertical force ever changes by IMPACT body weights within IMPACT_S."""
        frames = max(1, round(IMPACT_S * scene.rate_hz))
        force, valid = scene.measured[:, 2], scene.valid
        change = np.abs(force[frames:] - force[:-frames])[valid[frames:] & valid[:-frames]]
        if not (change > IMPACT * scene.mass_kg * GRAVITY_M_S2).any():
            return ()
        return super().targets(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        most = max(0.8 * float(scene.phi_of(target)[0]), 0.1)
        known_to = MASS_KG if target.endswith("torso") else LIMB_MASS_KG
        return (
            Parameter("mass", "kg", 0.0, most, 4.0, known_to=known_to),
            Parameter("frequency", "Hz", 2.0, 8.0, 1.0, FREQUENCIES_HZ, known_to=FREQUENCY_HZ),
            Parameter("damping_ratio", "1", 0.02, 1.0, 0.1, DAMPING, known_to=DAMPING_RATIO),
            Parameter("mass_sideways", "kg", -most, most, 4.0),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        mass, frequency, damping, sideways = values
        key = (self.name, target, float(frequency), float(damping))
        upright, aside = scene.once(key, lambda: _swings(scene, target, frequency, damping))
        return mass * upright + sideways * aside

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """Without what seems to swing to the sides."""
        return super().reported(scene, target, values)[:3]


def _swings(
    scene: Scene, target: str, frequency_hz: float, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 6) each : what 1 kg adds to the wrench by swinging instead of staying in its segment, up
    and down and to the sides.

    x'' = -2 damping pace x' - pace^2 x - ground, at rest when the trial begins; exact where the
    ground's acceleration is linear between samples.
    """
    from scipy.signal import cont2discrete, lfilter  # heavy: reports never need it

    point = scene.centre(target)
    ground, pace = point.acceleration_m_s2, 2 * np.pi * frequency_hz

    system = [1.0, 2 * damping * pace, pace**2]

    def response(numerator: list[float]) -> np.ndarray:
        """(N, 3) travel of the mass against its segment [m], or with s^2 its acceleration."""
        b, a, _ = cont2discrete((numerator, system), 1 / scene.rate_hz, method="foh")
        return lfilter(np.ravel(b), a, ground - ground[0], axis=0)

    travel, force = response([-1.0]), response([-1.0, 0.0, 0.0])

    def swinging(axes: np.ndarray) -> np.ndarray:
        own, stretch = force * axes, travel * axes
        carried = ground + own - scene.model.gravity.linear
        moment = np.cross(point.position_m, own) + np.cross(stretch, carried)
        return np.hstack([own, moment])

    upright = swinging(UP)
    return upright, swinging(np.ones(3)) - upright


SLOWEST_HZ, FASTEST_HZ = 0.12, 0.6
# The breastbone moves ahead and up; torso axes.
OUTWARD = np.array([0.8, 0.6, 0.0])
LEAST_BREATHS = 3
# A quarter of it is no finding: so much is where the markers of the chest breathe and no mass does.
TYPICAL_KG_M = 0.3
PACE_HZ = 3e-4  # to which a pace is known: nobody breathes like a clock


class Breathing(Effect):
    """The chest that moves with every breath while the model's trunk stands still.

    Moved mass times amplitude, a sine ahead and up in the upper torso.
    """

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("upper_torso",) if _slowest_hz(scene) < FASTEST_HZ else ()

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        apart = 0.5 / max(float(np.ptp(scene.times_s)), 1.0)
        slowest = _slowest_hz(scene)
        paces = tuple(float(f) for f in np.arange(slowest, FASTEST_HZ, apart))
        return (
            Parameter("cosine", "kg m", -1.0, 1.0, TYPICAL_KG_M),
            Parameter("sine", "kg m", -1.0, 1.0, TYPICAL_KG_M),
            Parameter("frequency", "Hz", slowest, 0.7, apart, paces, known_to=PACE_HZ),
        )

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in cosine and sine."""
        pace = 2 * np.pi * values[2]
        phase = pace * (scene.times_s - scene.times_s[0])
        moved = np.stack([np.cos(phase), np.sin(phase)])[..., None]
        speed = pace * np.stack([-np.sin(phase), np.cos(phase)])[..., None]
        i, motion = scene.person.skeleton.index(target), scene.motion
        out = motion.rotation[:, i] @ OUTWARD
        w, dw = motion.turning_rad_s[:, i], motion.turning_acceleration_rad_s2[:, i]
        turned = np.cross(dw, out) + np.cross(w, np.cross(w, out))
        force = moved * (turned - pace**2 * out) + 2 * speed * np.cross(w, out)
        centre = scene.centre(target)
        carried = centre.acceleration_m_s2 - scene.model.gravity.linear
        moment = np.cross(centre.position_m, force) + moved * np.cross(out, carried)
        return np.moveaxis(np.concatenate([force, moment], axis=2), 0, 2)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        amplitude = float(np.hypot(values[0], values[1]))
        return ("amplitude", "kg m", amplitude), ("frequency", "Hz", float(values[2]))


def _slowest_hz(scene: Scene) -> float:
    """A few breaths are needed to distinguish them from any other slow signal."""
    return max(SLOWEST_HZ, LEAST_BREATHS / max(float(np.ptp(scene.times_s)), 1.0))
