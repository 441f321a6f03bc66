"""From a plan and the pelvis' pose to the pose of every body, and to the ground wrench.

Legs by inverse kinematics. The wrench by the rate of momentum of all bodies (Newton and Euler for
the whole): F = dp/dt - m g and M = dL/dt - sum r x m g about the walkway's origin, with momenta by
numerical differentiation of positions and rotations. No equations of motion of a tree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.numerics import (
    about_axis,
    about_x,
    about_y,
    about_z,
    derivative,
    euler_zxy,
    frame_of,
    rotate,
    transpose,
    unskew,
)
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Inertia, Person
from bsip_cli.simulate.plan import GRAVITY, Load, Plan, Poses, total_load

DOWN = np.array([0.0, -1.0, 0.0])
# Of a clavicle at an arm raised by 120 degrees (Ludewig 2009, J Bone Joint Surg Am 91): raised,
# drawn back, turned backwards about its own axis.
RHYTHM_RAD = np.deg2rad([10.0, 16.0, 30.0])
RAISED = 1.0 - np.cos(np.deg2rad(120.0))
Turns = dict[str, np.ndarray]
"""Rotations (T, 3, 3) of bodies against the body they hang on; of the pelvis in the walkway frame,
nominal in flight. None of the thorax where the trunk is stiff."""


def clavicle_turn(arm_in_thorax: np.ndarray, own_rad: np.ndarray, sign: float) -> np.ndarray:
    """(T, 3, 3) rotation of a clavicle against the thorax, none where the arm hangs.

    arm_in_thorax : (T, 3, 3). own_rad : (T, 2) raised and brought forward on top of the arm's
    rhythm.
    sign : 1 of the right side, -1 of the left one.
    """
    part = (1.0 - arm_in_thorax[:, 1, 1]) / RAISED
    raised, back, turned = (part * angle for angle in RHYTHM_RAD)
    raised, forward = raised + own_rad[:, 0], own_rad[:, 1] - back
    return about_y(sign * forward) @ about_x(-sign * raised) @ about_z(turned)


def turns_of(person: Person, plan: Plan) -> Turns:
    """What the plan prescribes above the hips, wherever the pelvis is."""
    angles = plan.angles_rad
    turns = {
        "lower_torso": euler_zxy(plan.pelvis_angles_rad),
        "abdomen": euler_zxy(angles["waist"]),
        "head": euler_zxy(angles["neck"]),
    }
    if "spine" in angles:
        turns["thorax"] = euler_zxy(angles["spine"])
    for side, sign in SIDE_SIGN.items():
        flexion, deviation, pronation = angles[f"wrist_{side}"].T
        arm = euler_zxy(np.array([1.0, -sign, sign]) * angles[f"shoulder_{side}"])
        turns[f"upper_arm_{side}"] = arm
        if f"sternoclavicular_{side}" in person.joints_m:
            own = angles.get(f"girdle_{side}", np.zeros((len(plan), 2)))
            turns[f"clavicle_{side}"] = clavicle_turn(arm, own, sign)
        elbow = angles[f"elbow_{side}"]
        turns[f"forearm_{side}"] = about_axis(person.hinges[f"elbow_{side}"], elbow)
        wrist = about_y(sign * pronation) @ about_z(flexion) @ about_x(-sign * deviation)
        turns[f"hand_{side}"] = wrist
    return turns


def poses_of(
    person: Person, plan: Plan, turns: Turns, pelvis_m: np.ndarray, pelvis_rotation: np.ndarray
) -> Poses:
    """All bodies' poses for the pelvis' path (T, 3) and rotation (T, 3, 3), and ``turns_of`` the
    plan."""
    joints = person.joints_m
    poses = Poses({"lower_torso": pelvis_rotation}, {"lower_torso": pelvis_m}, np.zeros(len(plan)))
    rotation, origin = poses.rotation, poses.origin_m

    def hang(body: str, parent: str, place_m: np.ndarray) -> None:
        origin[body] = poses.point(parent, place_m)
        rotation[body] = rotation[parent] @ turns[body]

    hang("abdomen", "lower_torso", np.zeros(3))
    thorax = rotation["abdomen"] @ turns["thorax"] if "thorax" in turns else rotation["abdomen"]
    origin["thorax"] = poses.point("abdomen", joints["tjc"]) + rotate(thorax, joints["cjc"])
    rotation["thorax"] = thorax
    origin["head"], rotation["head"] = origin["thorax"], thorax @ turns["head"]
    for side in SIDES:
        upper, lower, clavicle = (f"{b}_{side}" for b in ("upper_arm", "forearm", "clavicle"))
        shoulder = joints[f"shoulder_{side}"]
        hang(upper, "thorax", shoulder)
        if clavicle in turns:
            joint = joints[f"sternoclavicular_{side}"]
            hang(clavicle, "thorax", joint)
            origin[upper] = poses.point(clavicle, shoulder - joint)
        hang(lower, upper, joints[f"elbow_{side}"])
        hang(f"hand_{side}", lower, joints[f"wrist_{side}"])
        excess = _leg(person, plan, side, poses)
        np.maximum(poses.excess_reach_m, excess, out=poses.excess_reach_m)
    return poses


def _leg(person: Person, plan: Plan, side: str, poses: Poses) -> np.ndarray:
    """Thigh and shank between the hip and the planned ankle; returns the excess reach.

    The knee angle follows from the distance (law of cosines, exact for a tilted hinge);
    the free turn about the line from hip to ankle brings the hinge between the lateral
    axes of the pelvis and of the foot.
    """
    planned, hinge = plan.feet[side], person.hinges[f"knee_{side}"]
    thigh, shank, foot = (f"{name}_{side}" for name in ("thigh", "shank", "foot"))
    hip = poses.point("lower_torso", person.joints_m[f"hip_{side}"])
    line = planned.position_m - hip
    distance = np.linalg.norm(line, axis=1)
    upper, lower = person.lengths_m[thigh], person.lengths_m[shank]
    longest = plan.longest_reach * (upper + lower)
    reach = np.minimum(distance, longest)

    along = float(hinge @ DOWN)
    cosine = (reach**2 - upper**2 - lower**2) / (2.0 * upper * lower)
    cosine = (cosine - along**2) / (1.0 - along**2)
    bend = about_axis(hinge, -np.arccos(np.clip(cosine, -1.0, 1.0)))
    ankle_in_thigh = upper * DOWN + lower * rotate(bend, DOWN)
    lateral = poses.rotation["lower_torso"][:, :, 2] + planned.rotation[:, :, 2]
    in_thigh = frame_of(ankle_in_thigh, np.broadcast_to(hinge, ankle_in_thigh.shape))
    poses.origin_m[thigh] = hip
    poses.rotation[thigh] = frame_of(line, lateral) @ transpose(in_thigh)
    poses.origin_m[shank] = poses.point(thigh, upper * DOWN)
    poses.rotation[shank] = poses.rotation[thigh] @ bend
    poses.origin_m[foot], poses.rotation[foot] = planned.position_m, planned.rotation
    return np.maximum(distance - longest, 0.0)


@dataclass(frozen=True, eq=False)
class Momentum:
    """Whole-body momentum in an inertial frame.

    com_m : (T, 3). linear : (T, 3) [kg m/s]. angular : (T, 3) about the origin [kg m2/s].
    """

    mass_kg: float
    com_m: np.ndarray
    linear: np.ndarray
    angular: np.ndarray

    def spin(self) -> np.ndarray:
        """(T, 3) angular momentum about the centre of mass."""
        return self.angular - np.cross(self.com_m, self.linear)


def momentum_of(inertias: dict[str, Inertia], poses: Poses, step_s: float) -> Momentum:
    """Sum over bodies of their momenta."""
    samples = len(next(iter(poses.origin_m.values())))
    first, linear, angular = np.zeros((3, samples, 3))
    for body, part in inertias.items():
        R, r = poses.rotation[body], poses.point(body, part.com_m)
        p = part.mass_kg * derivative(r, step_s)
        turning = unskew(transpose(R) @ derivative(R, step_s))  # body axes
        first += part.mass_kg * r
        linear += p
        angular += np.cross(r, p) + rotate(R, turning @ part.tensor_kgm2)
    mass = sum(part.mass_kg for part in inertias.values())
    return Momentum(mass, first / mass, linear, angular)


def locked_inertia(inertias: dict[str, Inertia], poses: Poses, com_m: np.ndarray) -> np.ndarray:
    """(T, 3, 3) inertia of the body as if it were stiff, about its centre of mass."""
    total = np.zeros((len(com_m), 3, 3))
    for body, part in inertias.items():
        R, r = poses.rotation[body], poses.point(body, part.com_m) - com_m
        parallel = np.sum(r * r, axis=-1)[:, None, None] * np.eye(3) - r[:, :, None] * r[:, None, :]
        total += R @ part.tensor_kgm2 @ transpose(R) + part.mass_kg * parallel
    return total


def ground_wrench(
    inertias: dict[str, Inertia], poses: Poses, step_s: float, loads: Iterable[Load] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Force (T, 3) [N] on the body and moment (T, 3) [N m] about the walkway's origin."""
    momentum = momentum_of(inertias, poses, step_s)
    weight = momentum.mass_kg * GRAVITY
    load_force, load_moment = total_load(loads, poses, step_s)
    force = derivative(momentum.linear, step_s) - weight + load_force
    gravity_moment = np.cross(momentum.com_m, weight)
    return force, derivative(momentum.angular, step_s) - gravity_moment + load_moment
