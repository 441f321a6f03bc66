"""From the plan and the pelvis' pose to the pose of every body; legs by inverse kinematics."""

from __future__ import annotations

import numpy as np

from bsip_cli.simulate.girdle import clavicle_turn
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.poses import Poses
from bsip_cli.simulate.rotations import (
    about_axis,
    about_x,
    about_y,
    about_z,
    euler_zxy,
    frame_of,
    rotate,
    transpose,
)

DOWN = np.array([0.0, -1.0, 0.0])
Turns = dict[str, np.ndarray]
"""Rotations (T, 3, 3) of bodies against the body they hang on; of the pelvis in the walkway frame,
nominal in flight. None of the thorax where the trunk is stiff."""


def centre_of_mass(person: Person, poses: Poses) -> np.ndarray:
    """(T, 3) centre of mass of the whole body."""
    first = np.zeros_like(poses.origin_m["lower_torso"])
    for body, part in person.inertias.items():
        first += part.mass_kg * poses.point(body, part.com_m)
    return first / sum(part.mass_kg for part in person.inertias.values())


def turns_of(person: Person, plan: Plan) -> Turns:
    """What the plan prescribes above the hips, wherever the pelvis is."""
    angles, bend = plan.angles_rad, person.trunk_bend
    waist = angles["waist"]
    turns = {
        "lower_torso": euler_zxy(plan.pelvis_angles_rad),
        "abdomen": euler_zxy((1.0 - bend) * waist),
        "head": euler_zxy(angles["neck"]),
    }
    if bend:
        turns["thorax"] = euler_zxy(bend * waist)
    if "spine" in angles:
        spine = euler_zxy(angles["spine"])
        turns["thorax"] = turns["thorax"] @ spine if bend else spine
    for side in SIDES:
        sign = SIDE_SIGN[side]
        mirror = np.array([1.0, -sign, sign])
        flexion, deviation, pronation = angles[f"wrist_{side}"].T
        turns[f"upper_arm_{side}"] = euler_zxy(mirror * angles[f"shoulder_{side}"])
        if f"sternoclavicular_{side}" in person.joints_m:
            own = angles.get(f"girdle_{side}", np.zeros((len(plan), 2)))
            turns[f"clavicle_{side}"] = clavicle_turn(turns[f"upper_arm_{side}"], own, sign)
        turns[f"forearm_{side}"] = about_axis(
            person.hinges[f"elbow_{side}"], angles[f"elbow_{side}"]
        )
        turns[f"hand_{side}"] = (
            about_y(sign * pronation) @ about_z(flexion) @ about_x(-sign * deviation)
        )
    return turns


def poses_of(
    person: Person, plan: Plan, turns: Turns, pelvis_m: np.ndarray, pelvis_rotation: np.ndarray
) -> Poses:
    """All bodies' poses for the pelvis' path (T, 3) and rotation (T, 3, 3), and ``turns_of`` the
    plan."""
    rotation = {"lower_torso": pelvis_rotation}
    origin = {"lower_torso": pelvis_m}
    _trunk(person, turns, rotation, origin)
    for side in SIDES:
        _arm(person, turns, side, rotation, origin)
    excess = np.maximum(
        _leg(person, plan, "l", rotation, origin), _leg(person, plan, "r", rotation, origin)
    )
    return Poses(rotation, origin, excess)


def _trunk(
    person: Person, turns: Turns, rotation: dict[str, np.ndarray], origin: dict[str, np.ndarray]
) -> None:
    abdomen = rotation["lower_torso"] @ turns["abdomen"]
    thorax = abdomen @ turns["thorax"] if "thorax" in turns else abdomen
    rotation["abdomen"], rotation["thorax"] = abdomen, thorax
    origin["abdomen"] = origin["lower_torso"]
    upper_joint = origin["abdomen"] + rotate(abdomen, person.joints_m["tjc"])
    origin["thorax"] = upper_joint + rotate(thorax, person.joints_m["cjc"])
    rotation["head"] = thorax @ turns["head"]
    origin["head"] = origin["thorax"]


def _arm(
    person: Person,
    turns: Turns,
    side: str,
    rotation: dict[str, np.ndarray],
    origin: dict[str, np.ndarray],
) -> None:
    joints = person.joints_m
    upper, lower, hand = (f"{name}_{side}" for name in ("upper_arm", "forearm", "hand"))
    origin[upper] = origin["thorax"] + rotate(rotation["thorax"], joints[f"shoulder_{side}"])
    if (clavicle := f"clavicle_{side}") in turns:
        joint = joints[f"sternoclavicular_{side}"]
        rotation[clavicle] = rotation["thorax"] @ turns[clavicle]
        origin[clavicle] = origin["thorax"] + rotate(rotation["thorax"], joint)
        rod = joints[f"shoulder_{side}"] - joint
        origin[upper] = origin[clavicle] + rotate(rotation[clavicle], rod)
    rotation[upper] = rotation["thorax"] @ turns[upper]
    origin[lower] = origin[upper] + rotate(rotation[upper], joints[f"elbow_{side}"])
    rotation[lower] = rotation[upper] @ turns[lower]
    origin[hand] = origin[lower] + rotate(rotation[lower], joints[f"wrist_{side}"])
    rotation[hand] = rotation[lower] @ turns[hand]


def _leg(
    person: Person,
    plan: Plan,
    side: str,
    rotation: dict[str, np.ndarray],
    origin: dict[str, np.ndarray],
) -> np.ndarray:
    """Thigh and shank between the hip and the planned ankle; returns the excess reach.

    The knee angle follows from the distance (law of cosines, exact for a tilted hinge);
    the free turn about the line from hip to ankle brings the hinge between the lateral
    axes of the pelvis and of the foot.
    """
    foot_path = plan.feet[side]
    thigh, shank, foot = (f"{name}_{side}" for name in ("thigh", "shank", "foot"))
    hip = origin["lower_torso"] + rotate(rotation["lower_torso"], person.joints_m[f"hip_{side}"])
    line = foot_path.position_m - hip
    distance = np.linalg.norm(line, axis=1)
    upper, lower = person.lengths_m[thigh], person.lengths_m[shank]
    longest = plan.longest_reach * (upper + lower)
    reach = np.minimum(distance, longest)

    hinge = person.hinges[f"knee_{side}"]
    along = float(hinge @ DOWN)
    cosine = (reach**2 - upper**2 - lower**2) / (2.0 * upper * lower)
    cosine = (cosine - along**2) / (1.0 - along**2)
    flexion = np.arccos(np.clip(cosine, -1.0, 1.0))
    bend = about_axis(hinge, -flexion)
    ankle_in_thigh = upper * DOWN + lower * rotate(bend, DOWN)

    lateral = rotation["lower_torso"][:, :, 2] + foot_path.rotation[:, :, 2]
    in_thigh = frame_of(ankle_in_thigh, np.broadcast_to(hinge, ankle_in_thigh.shape))
    rotation[thigh] = frame_of(line, lateral) @ transpose(in_thigh)
    rotation[shank] = rotation[thigh] @ bend
    rotation[foot] = foot_path.rotation
    origin[thigh] = hip
    origin[shank] = hip + rotate(rotation[thigh], upper * DOWN)
    origin[foot] = foot_path.position_m
    return np.maximum(distance - longest, 0.0)
