"""Net forces, moments and powers at the joints (Hansen 2017, equation 1): Newton and Euler from the
free ends of the tree to the pelvis, with each foot's own ground wrench.

The wrench at a joint is what the anatomical structures that cross it exert on the distal segment.
It carries and drives all bodies beyond the joint, less what the ground does: for arms, head and
trunk the way is from above, for legs from below, and what is missing at the pelvis is the residual
of the whole body.

**Axes** are those of the joint coordinate system (Grood and Suntay 1983; Wu 2002 and 2005 for hip,
ankle and spine): the first is Z of the proximal segment (to the right), the third Y of the distal
one (up along it), the second is perpendicular to both, Y x Z (ahead in the neutral pose). They are
not those of the tree: a knee's or elbow's hinge leans by its tilts. Second and third axes of left
joints point the other way, so that left and right numbers mean the same. A number is the projection
on an axis, not a component along skew axes: so moments times the rates of the angles add up to the
power. `AXES` says what a positive one does to the distal segment.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.dynamics.ground_wrench import pinocchio_model, skew
from bsip_cli.dynamics.segment_motion import SegmentMotion, segment_motion
from bsip_cli.segments import without_side

_LIMB = ("flexion", "adduction", "internal_rotation")
_SPINE = ("extension", "bending_right", "turning_left")
AXES = {
    "waist": _SPINE,
    "neck": _SPINE,
    "sternoclavicular": ("backward_rotation", "depression", "protraction"),
    "shoulder": _LIMB,
    "elbow": _LIMB,
    "wrist": _LIMB,
    "hip": _LIMB,
    "knee": ("extension", "adduction", "internal_rotation"),
    "ankle": ("dorsiflexion", "inversion", "internal_rotation"),
}
"""By kind of joint: where a positive moment about its three axes turns the distal segment."""

PARALLEL = np.sin(np.deg2rad(10.0))
"""First and third axis nearer to each other than 10 degrees leave the second without a direction
(gimbal lock, the arm raised to the side). Chosen: rates of angles are there six times the truth's
error."""


def axes_of(joint: str) -> tuple[str, str, str]:
    """Names of a joint's three axes."""
    return AXES[without_side(joint)]


@dataclass(frozen=True, eq=False)
class JointLoads:
    """Of J joints (all but the floating base), N frames and k bodies, (N, J, 3, k) in the axes of
    the joint coordinate systems; NaN where an axis has no direction, or a foot's wrench is unknown.

    force_N, moment_Nm : by the proximal on the distal segment. power_W : moment times the rate of
    the angle about the same axis; the three add up to the joint's power.
    The same with ``_sd``: standard deviations, first order.
    """

    joints: tuple[str, ...]
    force_N: np.ndarray
    moment_Nm: np.ndarray
    rate_rad_s: np.ndarray  # (N, J, 3) of the angle about each axis
    force_sd_N: np.ndarray
    moment_sd_Nm: np.ndarray

    @property
    def power_W(self) -> np.ndarray:
        return self.moment_Nm * self.rate_rad_s[..., None]


@dataclass(frozen=True, eq=False)
class Ground:
    """What the ground does to one foot.

    wrench : (N, 6) on the foot, world, about the origin; zero in the air, NaN if unknown.
    noise : (N, 6) its standard deviation about ``noise_at_m`` (3,), where a plate's channels are
        independent; zero in the air.
    """

    wrench: np.ndarray
    noise: np.ndarray
    noise_at_m: np.ndarray


@dataclass(frozen=True, eq=False)
class Spread:
    """Standard errors that joint loads inherit.

    covariances : k of (P, P), of the inertial parameters of each body; None: known.
    centre_m : of a joint's centre in each direction; a moment changes by what the joint's force
        does along that lever. turns_rad2 : (n, 3, 3) covariances of the turn of each segment's
        frame in its own axes: a turned axis shows a part of the moment and the force across it.
    """

    covariances: tuple[np.ndarray | None, ...]
    centre_m: float
    turns_rad2: np.ndarray | None = None


def joint_loads(
    person: Person,
    q: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    phi: np.ndarray,
    ground: Mapping[str, Ground],
    spread: Spread,
    block: int = 500,
    every: int = 1,
) -> JointLoads:
    """Inverse dynamics of a motion with k bodies.

    Parameters
    ----------
    q, v, a : (N, nq), (N, nv), (N, nv) in Pinocchio's conventions.
    phi : (P, k) inertial parameters of the segments with mass about their joint centres.
    ground : by segment, the ground's wrench; other segments touch nothing.
    block : frames at once: temporary memory grows with it, not with N.
    every : what the parameters' errors do is computed in every which frame, with lines between.
    """
    skeleton, model = person.skeleton, pinocchio_model(person)
    joints, k = skeleton.joints[1:], phi.shape[1]
    shape = (len(q), len(joints), 3)
    value, variance = np.zeros((2, 2, *shape, k))
    rates = np.empty(shape)
    beyond = [skeleton.beyond(i) for i in range(1, len(joints) + 1)]
    for start in range(0, len(q), block):
        now = slice(start, start + block)
        motion = segment_motion(model, q[now], v[now], a[now])
        rows = np.stack([motion.wrenches(i) for i in skeleton.bodies], axis=1)
        some = np.unique(np.append(np.arange(0, len(rows), every), len(rows) - 1))
        needs = rows @ phi.reshape(1, -1, 10, k)
        for j, segments in enumerate(beyond):
            axes, rates[now, j] = _axes(skeleton, motion, j + 1)
            centre = motion.position_m[:, j + 1]
            onto = _projection(axes, centre)
            bodies = [b for b, i in enumerate(skeleton.bodies) if i in segments]
            touching = [ground[s] for n in segments if (s := skeleton.segments[n]) in ground]
            wrench = needs[:, bodies].sum(axis=1)
            for one in touching:
                wrench -= one.wrench[now, :, None]
                about = np.eye(6)
                about[3:, :3] = skew(one.noise_at_m[None])[0]
                squared = (onto @ about) ** 2 @ (one.noise[now, :, None] ** 2)
                variance[:, now, j] += _halves(squared)
            value[:, now, j] = found = _halves(onto @ wrench)
            own = onto[some] @ rows[some][:, bodies].swapaxes(1, 2).reshape(len(some), 6, -1)
            columns = (10 * np.array(bodies)[:, None] + np.arange(10)).ravel()
            for m, covariance in enumerate(spread.covariances):
                if covariance is not None:
                    part = covariance[np.ix_(columns, columns)]
                    of_each = np.einsum("nij,nij->ni", own @ part, own)
                    at_all = _between(some, of_each, len(rows))
                    variance[:, now, j, :, m] += _halves(at_all[..., None])[..., 0]
            force, moment = wrench[:, :3], wrench[:, 3:] - skew(centre) @ wrench[:, :3]
            across = (force**2).sum(axis=1, keepdims=True) - found[0] ** 2
            variance[1, now, j] += spread.centre_m**2 * np.maximum(across, 0.0)
            if spread.turns_rad2 is not None:
                ends = [skeleton.parents[j + 1], j + 1]
                frames, turns = motion.rotation[:, ends], spread.turns_rad2[ends]
                variance[:, now, j] += _of_turns(axes, frames, turns, np.stack([force, moment]))
    sd = np.sqrt(variance)
    return JointLoads(joints, value[0], value[1], rates, sd[0], sd[1])


def _of_turns(
    axes: np.ndarray, frames: np.ndarray, turns_rad2: np.ndarray, world: np.ndarray
) -> np.ndarray:
    """Variance (2, n, 3, k) of what axes (n, 3, 3) show of vectors (2, n, 3, k) where the frames
    (n, 2, 3, 3) of the proximal segment, which carries the first axis, and of the distal one, which
    carries the third, are turned with covariances (2, 3, 3)."""
    roots = np.linalg.cholesky(turns_rad2).swapaxes(1, 2) @ frames.swapaxes(2, 3)
    first, second, third = axes.swapaxes(0, 1)
    cosine = np.einsum("nc,nc->n", first, third)[:, None]
    # A vector is a first + b second + c third. The second axis stays perpendicular to both others:
    # it leans against each turn by as much as that tilts the other two towards it.
    ends = (first, third)
    shown = [np.einsum("nc,hnck->hnk", e, world) for e in ends]
    variance = np.zeros_like(world)
    for end, (axis, root) in enumerate(zip(ends, roots.swapaxes(0, 1), strict=True)):
        variance[:, :, 2 * end] = ((root @ skew(axis) @ world) ** 2).sum(axis=2)
        along = (shown[end] - cosine * shown[1 - end]) / (1.0 - cosine**2)
        lean = np.einsum("nij,nj->ni", root, np.cross(axis, second))
        variance[:, :, 1] += along**2 * (lean**2).sum(axis=1)[:, None]
    return variance


def _halves(wrench: np.ndarray) -> np.ndarray:
    """(2, n, 3, k) of (n, 6, k): forces, then moments."""
    return np.stack([wrench[:, :3], wrench[:, 3:]])


def _between(some: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """(count, c) on lines between the values (s, c) at indices (s,)."""
    if len(some) == count:
        return values
    return np.stack([np.interp(np.arange(count), some, x) for x in values.T], axis=1)


def _axes(skeleton: Skeleton, motion: SegmentMotion, i: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 3) rows: unit axes in the world; (n, 3) rates of the angles about them [rad/s].

    With c the cosine between first and third axis, w . e1 = rate1 + c rate3 and the reverse.
    """
    parent, side = skeleton.parents[i], skeleton.side(skeleton.segments[i])
    sign = -1.0 if side == "l" else 1.0
    first, third = motion.rotation[:, parent, :, 2], sign * motion.rotation[:, i, :, 1]
    across = np.cross(third, first)  # the sign of a left joint's comes with its third
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    skewed = sine < PARALLEL
    with np.errstate(invalid="ignore", divide="ignore"):
        second = np.where(skewed, np.nan, across / sine)
        turning = motion.turning_rad_s[:, i] - motion.turning_rad_s[:, parent]
        along = np.einsum("nc,nc->n", first, third)
        one, two, three = (np.einsum("nc,nc->n", turning, e) for e in (first, second, third))
        rates = np.stack([one - along * three, two * sine[:, 0] ** 2, three - along * one], axis=1)
        rates = np.where(skewed, np.nan, rates / sine**2)
    return np.stack([first, second, third], axis=1), rates


def _projection(axes: np.ndarray, centre_m: np.ndarray) -> np.ndarray:
    """(n, 6, 6): a world wrench about the origin as forces along the axes (n, 3, 3) and moments
    about them through the joint's centre (n, 3): e . (m - p x f) = e . m + (p x e) . f."""
    onto = np.zeros((len(axes), 6, 6))
    onto[:, :3, :3] = onto[:, 3:, 3:] = axes
    onto[:, 3:, :3] = np.cross(centre_m[:, None], axes)
    return onto


def of_accelerations(
    person: Person, q: np.ndarray, phi: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (N, J, 3) of forces [N] and moments [N m] for errors of a with covariance
    (N, nv, nv) in poses (N, nq) of a body phi (P,).

    A body at rest is accelerated by one unit of each velocity in turn: what that changes.
    """
    count, nv = covariance.shape[:2]
    known = Spread((None,), 0.0)

    def at(a: np.ndarray) -> np.ndarray:
        still = np.zeros((len(a), nv))
        poses = np.repeat(q, len(a) // count, axis=0)
        found = joint_loads(person, poses, still, a, phi[:, None], {}, known)
        return np.stack([found.force_N[..., 0], found.moment_Nm[..., 0]])

    rest = at(np.zeros((count, nv)))
    each = at(np.tile(np.eye(nv), (count, 1))).reshape(2, count, nv, *rest.shape[2:])
    response = each - rest[:, :, None]
    variance = np.einsum("wnijx,nik,wnkjx->wnjx", response, covariance, response, optimize=True)
    force, moment = np.sqrt(np.maximum(variance, 0.0))
    return force, moment
