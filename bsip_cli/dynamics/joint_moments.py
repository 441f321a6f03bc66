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

from collections.abc import Mapping, Sequence
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
    value, variance = np.zeros((2, len(q), len(joints), 6, k))  # forces, then moments
    rates = np.empty((len(q), len(joints), 3))
    beyond = [skeleton.beyond(i) for i in range(1, len(joints) + 1)]
    carries = np.array([np.isin(skeleton.bodies, list(segments)) for segments in beyond])
    ends = (list(skeleton.parents[1:]), list(range(1, len(joints) + 1)))
    turns = spread.turns_rad2  # of the segments that carry the first axis, Z, and the third, Y
    levers = [] if turns is None else [_lever(turns[ends[0]], 2), _lever(turns[ends[1]], 1)]
    for start in range(0, len(q), block):
        now = slice(start, start + block)
        motion = segment_motion(model, q[now], v[now], a[now])
        rows = motion.wrenches(skeleton.bodies)
        needs = rows @ phi.reshape(1, -1, 10, k)
        wrench = (carries @ needs.reshape(*needs.shape[:2], -1)).reshape(len(rows), -1, 6, k)
        axes, rates[now] = _axes(skeleton, motion)
        centres = motion.position_m[:, 1:]
        onto = _projection(axes, centres)
        for segment, one in ground.items():
            on = [j for j, segments in enumerate(beyond) if skeleton.index(segment) in segments]
            wrench[:, on] -= one.wrench[now, None, :, None]
            about = np.eye(6)
            about[3:, :3] = skew(one.noise_at_m[None])[0]
            variance[now, on] += (onto[:, on] @ about) ** 2 @ one.noise[now, None, :, None] ** 2
        value[now] = onto @ wrench
        variance[now] += _of_parameters(rows, onto, carries, spread.covariances, every)
        force = wrench[:, :, :3]
        moment = wrench[:, :, 3:] - skew(centres) @ force
        squares = np.einsum("njck,njck->njk", force, force)[:, :, None]
        across = squares - value[now, :, :3] ** 2
        variance[now, :, 3:] += spread.centre_m**2 * np.maximum(across, 0.0)
        if levers:
            frames = (motion.rotation[:, end].swapaxes(2, 3) for end in ends)
            turned = [lever @ frame for lever, frame in zip(levers, frames, strict=True)]
            shown = _of_turns(axes, turned, np.concatenate([force, moment], axis=3))
            variance[now] += np.concatenate([shown[..., :k], shown[..., k:]], axis=2)
    sd = np.sqrt(variance)
    return JointLoads(joints, value[:, :, :3], value[:, :, 3:], rates, sd[:, :, :3], sd[:, :, 3:])


def _of_parameters(
    rows: np.ndarray,
    onto: np.ndarray,
    carries: np.ndarray,
    covariances: Sequence[np.ndarray | None],
    every: int,
) -> np.ndarray:
    """Variance (n, J, 6, k) by errors of the inertial parameters.

    rows (n, b, 6, 10) : ground wrench of each body by its parameters; onto (n, J, 6, 6) : of a
    wrench at a joint. carries (J, b) : whether a joint carries a body. every : as in `joint_loads`.
    """
    some = np.unique(np.append(np.arange(0, len(rows), every), len(rows) - 1))
    fewer = rows[some].swapaxes(1, 2)
    variance = np.zeros((len(rows), len(carries), 6, len(covariances)))
    for j, bodies in enumerate(carries):
        own = onto[some, j] @ fewer[:, :, bodies].reshape(len(some), 6, -1)
        columns = np.repeat(bodies, 10)
        for m, covariance in enumerate(covariances):
            if covariance is not None:
                part = covariance[np.ix_(columns, columns)]
                of_each = np.einsum("nij,nij->ni", own @ part, own)
                if len(some) < len(rows):
                    every_frame = np.arange(len(rows))
                    lines = [np.interp(every_frame, some, x) for x in of_each.T]
                    of_each = np.stack(lines, axis=1)
                variance[:, j, :, m] = of_each
    return variance


def _lever(turns_rad2: np.ndarray, axis: int) -> np.ndarray:
    """(J, 2, 3) how turns of one standard deviation, with covariances (J, 3, 3), move an axis of
    their frames in two directions across it."""
    across = np.delete(np.eye(3), axis, axis=0)
    moved = across @ skew(np.eye(3)[axis])
    covariance = moved @ turns_rad2 @ moved.T
    return np.asarray(np.linalg.cholesky(covariance).swapaxes(1, 2) @ across)


def _of_turns(axes: np.ndarray, turned: Sequence[np.ndarray], vectors: np.ndarray) -> np.ndarray:
    """Variance (n, J, 3, c) of what the axes (n, J, 3, 3) show of vectors (n, J, 3, c), world.

    turned : of the first and of the third axis, (n, J, 2, 3) how far turns of one standard
        deviation of the segment that carries it move the axis in two directions across it.
    """
    first, second, third = np.moveaxis(axes, 2, 0)
    cosine = np.einsum("njc,njc->nj", first, third)[..., None]
    changes = []
    for (axis, other), turn in zip(((first, third), (third, first)), turned, strict=True):
        # The second axis stays perpendicular to both others: where one leans towards it, it leans
        # back, and shows that part of the vector that is along that one and not along the other.
        lean = np.hypot(*np.moveaxis((turn @ second[..., None])[..., 0], 2, 0))[..., None]
        along = lean * (axis - cosine * other) / (1.0 - cosine**2)
        changes.append((np.concatenate([turn, along[:, :, None]], axis=2) @ vectors) ** 2)
    (one, two, of_first), (three, four, of_third) = (np.moveaxis(x, 2, 0) for x in changes)
    return np.stack([one + two, of_first + of_third, three + four], axis=2)


def _axes(skeleton: Skeleton, motion: SegmentMotion) -> tuple[np.ndarray, np.ndarray]:
    """Of all joints, (n, J, 3, 3) rows: unit axes in the world; (n, J, 3) rates of the angles about
    them [rad/s].

    With c the cosine between first and third axis, w . e1 = rate1 + c rate3 and the reverse.
    """
    parents = list(skeleton.parents[1:])
    left = np.array([skeleton.side(segment) == "l" for segment in skeleton.segments[1:]])
    sign = np.where(left, -1.0, 1.0)[:, None]
    first, third = motion.rotation[:, parents][..., 2], sign * motion.rotation[:, 1:, :, 1]
    across = np.cross(third, first)  # the sign of a left joint's comes with its third
    sine = np.linalg.norm(across, axis=2, keepdims=True)
    skewed = sine < PARALLEL
    with np.errstate(invalid="ignore", divide="ignore"):
        second = np.where(skewed, np.nan, across / sine)
        turning = motion.turning_rad_s[:, 1:] - motion.turning_rad_s[:, parents]
        along = (first * third).sum(axis=2)
        axes = np.stack([first, second, third], axis=2)
        one, two, three = np.moveaxis((axes @ turning[..., None])[..., 0], 2, 0)
        rates = np.stack([one - along * three, two * sine[..., 0] ** 2, three - along * one], 2)
        rates = np.where(skewed, np.nan, rates / sine**2)
    return axes, rates


def _projection(axes: np.ndarray, centres_m: np.ndarray) -> np.ndarray:
    """(n, J, 6, 6): a world wrench about the origin as forces along the axes (n, J, 3, 3) and
    moments about them through the joint's centre (n, J, 3): e . (m - p x f) = e . m + (p x e) . f.
    """
    onto = np.zeros((*axes.shape[:2], 6, 6))
    onto[..., :3, :3] = onto[..., 3:, 3:] = axes
    onto[..., 3:, :3] = np.cross(centres_m[:, :, None], axes)
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
