"""The ground wrench that a motion needs, and a motion whose feet can give it.

Forces are differences of momentum over time. As in the table-cart model, the pelvis is moved over
the feet until the centre of pressure follows the weight that the feet are to carry.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded
from scipy.ndimage import gaussian_filter1d

from tests.blind.second_world.body import Body
from tests.blind.second_world.kinematics import Poses, poses_of
from tests.blind.second_world.motion import Foot, Motion
from tests.blind.second_world.smooth import about_z, turned

GRAVITY = np.array([0.0, 0.0, 9.81])
_ROUNDS = 7
_CART_HEIGHT = 0.95  # of the table-cart model's mass, for a person of the table's stature
_LEAST_SHARE = 0.015  # of the weight on the lighter foot


OnGround = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Times (N,) [s] and the velocity (N, 3) of a place [m/s] to the ground force (N, 3) [N]."""


@dataclass(frozen=True)
class Load:
    """Something that the ground has to carry besides the body; place_m (3,) in the segment."""

    segment: str
    place_m: np.ndarray
    on_ground: OnGround


@dataclass(frozen=True)
class Balanced:
    """A motion with its ground wrench about the lab's origin.

    force_n, moment_nm (N, 3); cop_m, wanted_cop_m (N, 2) on the ground; centres_m (N, 2) of the
    support of each foot.
    """

    motion: Motion
    poses: Poses
    force_n: np.ndarray
    moment_nm: np.ndarray
    cop_m: np.ndarray
    wanted_cop_m: np.ndarray
    centres_m: dict[str, np.ndarray]


def balanced(motion: Motion, loads: Sequence[Load] = (), rounds: int = _ROUNDS) -> Balanced:
    """Move the pelvis over the feet until the centre of pressure is where it is wanted."""
    body = motion.body
    centres = {side: support_centre(body, foot) for side, foot in motion.feet.items()}
    right = motion.weight_right[:, None]
    wanted = right * centres["r"] + (1.0 - right) * centres["l"]
    wanted[:, 0] += motion.ahead_m
    shift = np.zeros_like(wanted)
    for number in range(rounds):
        poses = poses_of(motion, shift)
        force, moment = ground_wrench(body, poses, motion.t, loads)
        cop = _cop(force, moment, least_n=50.0)
        if number < rounds - 1:
            missing = wanted - _cop(force, moment, least_n=0.5 * body.mass_kg * GRAVITY[2])
            shift = shift + _cart_shift(missing, body, motion.rate_hz)
    return Balanced(motion, poses, force, moment, cop, wanted, centres)


def support_centre(body: Body, foot: Foot) -> np.ndarray:
    """Middle (N, 2) of a foot's support on the ground."""
    ahead = body.foot_centre_m * [1.0, 1.0, 0.0]
    return foot.place_m + turned(about_z(foot.yaw_rad), ahead)[:, :2]


def ground_wrench(
    body: Body, poses: Poses, times_s: np.ndarray, loads: Sequence[Load] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and moment about the lab's origin [N m], (N, 3) each."""
    momentum, angular, first_moment = (np.zeros((len(times_s), 3)) for _ in range(3))
    for segment, part in body.parts.items():
        R = poses.rotations[segment]
        com = poses.points_m(segment, part.com_m)
        velocity = rate_of(com, times_s)
        inertia = R @ part.inertia @ R.transpose(0, 2, 1)
        spin = turned(inertia, _angular_velocity(R, times_s))
        momentum += part.mass * velocity
        angular += part.mass * np.cross(com, velocity) + spin
        first_moment += part.mass * com
    force = rate_of(momentum, times_s) + body.mass_kg * GRAVITY
    moment = rate_of(angular, times_s) + np.cross(first_moment, GRAVITY)
    for load in loads:
        place = poses.points_m(load.segment, load.place_m)
        added = load.on_ground(times_s, rate_of(place, times_s))
        force, moment = force + added, moment + np.cross(place, added)
    return force, moment


def rate_of(course: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    """Derivative over time along the first axis, by differences."""
    return np.gradient(course, times_s[1] - times_s[0], axis=0, edge_order=2)


def by_foot(found: Balanced) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The wrench of each foot about the lab's origin: force (N, 3) [N], moment (N, 3) [N m].

    They sum up to the whole; while both feet stand, they also push each other apart a little.
    """
    right, left = found.motion.feet["r"], found.motion.feet["l"]
    share = _share_of_right(found, right, left)
    both = np.minimum(right.may_carry, left.may_carry)
    apart = both * (8.0 + 6.0 * np.sin(0.7 * found.motion.t))
    apart *= np.minimum(1.0, 4.0 * np.minimum(share, 1.0 - share))
    between = share[:, None] * found.centres_m["r"] + (1.0 - share[:, None]) * found.centres_m["l"]
    off = found.cop_m - between
    shares = {"r": share, "l": 1.0 - share}
    push = {"r": apart, "l": -apart}
    forces, moments = {}, {}
    for side, part in shares.items():
        forces[side] = found.force_n * part[:, None]
        forces[side][:, 1] += push[side]
        cop = np.column_stack([found.centres_m[side] + off, np.zeros(len(off))])
        moments[side] = np.cross(cop, forces[side])
    free = found.moment_nm[:, 2] - sum(moment[:, 2] for moment in moments.values())
    for side, part in shares.items():
        moments[side][:, 2] += part * free
    return {side: (forces[side], moments[side]) for side in shares}


def _share_of_right(found: Balanced, right: Foot, left: Foot) -> np.ndarray:
    """Where the centre of pressure lies from the left (0) to the right foot (1)."""
    line = found.centres_m["r"] - found.centres_m["l"]
    along = ((found.cop_m - found.centres_m["l"]) * line).sum(axis=1) / (line**2).sum(axis=1)
    share = np.clip(along, _LEAST_SHARE, 1.0 - _LEAST_SHARE) * right.may_carry
    return 1.0 - (1.0 - share) * left.may_carry


def _cop(force: np.ndarray, moment: np.ndarray, least_n: float) -> np.ndarray:
    return np.column_stack([-moment[:, 1], moment[:, 0]]) / np.maximum(force[:, 2:], least_n)


def _cart_shift(missing_m: np.ndarray, body: Body, rate_hz: float) -> np.ndarray:
    """How to move a cart on a table to shift the centre of pressure by missing_m (N, 2)."""
    edge, last = int(0.02 * rate_hz), len(missing_m) - 1
    smooth = gaussian_filter1d(np.clip(missing_m, -0.12, 0.12), 0.008 * rate_hz, axis=0)
    smooth[:edge] = smooth[edge]
    smooth[last - edge + 1 :] = smooth[last - edge]
    stiff = 1.05 * _CART_HEIGHT * body.scale / GRAVITY[2] * rate_hz**2
    bands = np.zeros((3, len(missing_m)))
    bands[0, 1:] = bands[2, :-1] = -stiff
    bands[1] = 1.0 + 2.0 * stiff
    bands[1, 0] = bands[1, -1] = 1.0 + stiff
    return solve_banded((1, 1), bands, smooth)


def _angular_velocity(R: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    """In the lab (N, 3) [rad/s]."""
    W = rate_of(R, times_s) @ R.transpose(0, 2, 1)
    columns = [W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]]
    return 0.5 * np.stack(columns, axis=1)
