"""Poses of all segments, the legs by inverse kinematics onto the feet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from tests.blind.second_world.body import SIDES, Body
from tests.blind.second_world.motion import Foot, Motion
from tests.blind.second_world.smooth import about_x, about_y, about_z, turned

_STANDING = 0.990  # height of the hips above the ankles over the leg's length
_STRETCHED = 0.9955  # no leg is longer than that
_SOFTNESS_M, _SOON_S = 0.003, 0.24  # how the pelvis gives way to a leg at its end
_TUCKED_RAD = 0.14  # of the forearm towards the body
_TOES_AND_PELVIS = (0.6, 0.4, 0.05)  # what a knee points along: toes, pelvis, outward
_SHANK_TURN_RAD = 0.10  # inward, as the knee bends


@dataclass(frozen=True)
class Poses:
    """Per segment its rotation (N, 3, 3) and origin (N, 3) [m] in the lab."""

    rotations: dict[str, np.ndarray]
    origins_m: dict[str, np.ndarray]

    def points_m(self, segment: str, place_m: np.ndarray) -> np.ndarray:
        """Course (N, 3) of a place (3,) or (N, 3) in the segment's frame."""
        return self.origins_m[segment] + turned(self.rotations[segment], place_m)


def poses_of(motion: Motion, shift_m: np.ndarray) -> Poses:
    """Of a motion whose pelvis is moved by shift_m (N, 2) over the ground."""
    R: dict[str, np.ndarray] = {}
    origins: dict[str, np.ndarray] = {}
    poses = Poses(R, origins)
    body, q = motion.body, motion.q
    feet = {side: foot_pose(body, foot) for side, foot in motion.feet.items()}
    R["pelvis"] = _in_turn(q["pelvis_yaw"], q["pelvis_pitch"], q["pelvis_roll"])
    origins["pelvis"] = _pelvis_course(motion, shift_m, R["pelvis"], feet)
    R["abdomen"] = R["pelvis"] @ _bent(motion, 1.0 - motion.at_spine)
    R["torso"] = R["abdomen"] @ _bent(motion, motion.at_spine)
    origins["abdomen"] = poses.points_m("pelvis", body.joints_m["lumbar"])
    spine = body.joints_m["spine"]
    origins["torso"] = poses.points_m("abdomen", spine) - turned(R["torso"], spine)
    R["head"] = R["torso"] @ _in_turn(q["neck_yaw"], q["neck_pitch"], q["neck_roll"])
    origins["head"] = poses.points_m("torso", body.joints_m["neck"])
    for side in SIDES:
        _add_arm(poses, motion, side)
        _add_leg(poses, body, side, *feet[side])
    return poses


def foot_pose(body: Body, foot: Foot) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (N, 3, 3) and ankle (N, 3) [m]; a raised heel turns the foot about its ball."""
    heading = about_z(foot.yaw_rad)
    height = body.ankle_height_m + foot.lifted_m
    flat = np.column_stack([foot.place_m, height])
    raised = turned(heading @ about_y(foot.heel_rad), body.ball_m)
    ankle = flat + turned(heading, body.ball_m) - raised
    return heading @ about_y(foot.pitch_rad + foot.heel_rad), ankle


def _bent(motion: Motion, part: float) -> np.ndarray:
    """A part of the trunk's turn."""
    pitch, roll, yaw = (part * motion.q[f"trunk_{name}"] for name in ("pitch", "roll", "yaw"))
    return about_y(pitch) @ about_x(roll) @ about_z(yaw)


def _in_turn(yaw: np.ndarray, pitch: np.ndarray, roll: np.ndarray) -> np.ndarray:
    return about_z(yaw) @ about_y(pitch) @ about_x(roll)


def _pelvis_course(
    motion: Motion, shift_m: np.ndarray, R: np.ndarray, feet: dict[str, tuple]
) -> np.ndarray:
    """As high as wanted, but no higher than both legs reach, smoothly."""
    body, q = motion.body, motion.q
    ahead = q["ahead"] + shift_m[:, 0] + 0.035 * body.scale
    left = q["left"] + shift_m[:, 1]
    standing = [
        np.maximum(ankle[:, 2] - motion.feet[side].lifted_m, 0.0)
        for side, (_, ankle) in feet.items()
    ]
    wanted = sum(standing) / 2.0 + _STANDING * body.leg_m + q["up"] + motion.bounce_m
    too_high = np.ones(len(wanted))
    for side, (_, ankle) in feet.items():
        hip = turned(R, body.joints_m[f"hip_{side}"])
        apart = (ahead + hip[:, 0] - ankle[:, 0]) ** 2 + (left + hip[:, 1] - ankle[:, 1]) ** 2
        reach = np.sqrt(np.maximum((_STRETCHED * body.leg_m) ** 2 - apart, 0.01))
        highest = ankle[:, 2] + reach - hip[:, 2]
        too_high += np.exp(-np.clip((highest - wanted) / _SOFTNESS_M, -300.0, 300.0))
    soon = int(_SOON_S * motion.rate_hz)
    lowered = maximum_filter1d(_SOFTNESS_M * np.log(too_high), 2 * soon + 1)
    up = wanted - gaussian_filter1d(lowered, soon / 2.5)
    return np.column_stack([ahead, left, up])


def _add_arm(poses: Poses, motion: Motion, side: str) -> None:
    body, sign = motion.body, SIDES[side]
    R, origins = poses.rotations, poses.origins_m
    upper, fore, hand = (f"{limb}_{side}" for limb in ("upper_arm", "forearm", "hand"))

    def angle(name: str) -> np.ndarray:
        return motion.q[f"{name}_{side}"]

    raised = about_y(-angle("flexion")) @ about_x(sign * angle("abduction"))
    R[upper] = R["torso"] @ raised @ about_z(-sign * angle("rotation"))
    origins[upper] = poses.points_m("torso", body.joints_m[f"shoulder_{side}"])
    tucked = about_x(np.full(len(motion.t), sign * _TUCKED_RAD))
    turn = about_z(-sign * angle("pronation"))
    R[fore] = R[upper] @ about_y(-angle("elbow")) @ tucked @ turn
    origins[fore] = poses.points_m(upper, np.array([0.0, 0.0, -body.lengths_m["upper_arm"]]))
    R[hand] = R[fore] @ about_y(-angle("wrist")) @ about_x(sign * angle("wrist_side"))
    origins[hand] = poses.points_m(fore, np.array([0.0, 0.0, -body.lengths_m["forearm"]]))


def _add_leg(poses: Poses, body: Body, side: str, R_foot: np.ndarray, ankle: np.ndarray) -> None:
    """Two bars from hip to ankle; the knee lies where toes and pelvis point."""
    sign, pelvis = SIDES[side], poses.rotations["pelvis"]
    thigh, shank = body.lengths_m["thigh"], body.lengths_m["shank"]
    hip = poses.points_m("pelvis", body.joints_m[f"hip_{side}"])
    long = np.minimum(np.linalg.norm(ankle - hip, axis=1), 0.99995 * body.leg_m)
    down = _unit(ankle - hip)
    toes, front, outward = _TOES_AND_PELVIS
    heading = _unit(R_foot[:, :, 0] * [1.0, 1.0, 0.0])
    pointing = toes * heading + front * pelvis[:, :, 0] + outward * sign * pelvis[:, :, 1]
    knee_ahead = _unit(pointing - (pointing * down).sum(axis=1)[:, None] * down)
    cosine = (thigh**2 + long**2 - shank**2) / (2.0 * thigh * long)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    knee = hip + thigh * (cosine[:, None] * down + sine[:, None] * knee_ahead)
    axis = np.cross(-down, knee_ahead)
    bent = (thigh**2 + shank**2 - long**2) / (2.0 * thigh * shank)
    flexion = np.pi - np.arccos(np.clip(bent, -1.0, 1.0))
    turn = about_z(-sign * _SHANK_TURN_RAD * (1.0 - np.exp(-flexion / 0.5)))
    R, origins = poses.rotations, poses.origins_m
    R[f"thigh_{side}"], origins[f"thigh_{side}"] = _along(hip - knee, axis), hip
    R[f"shank_{side}"], origins[f"shank_{side}"] = _along(knee - ankle, axis) @ turn, knee
    R[f"foot_{side}"], origins[f"foot_{side}"] = R_foot, ankle


def _along(up: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) with z along up and y along the knee's axis."""
    z = _unit(up)
    return np.stack([np.cross(axis, z), axis, z], axis=2)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
