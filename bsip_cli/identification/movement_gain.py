"""What ten more seconds of each movement would add to what is known about this person."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin

from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import wrench_regressor
from bsip_cli.files.regular import read_toml, shipped
from bsip_cli.identification.problem import Problem
from bsip_cli.identification.uncertainty import Beforehand, beforehand

# --- movements that a person can be asked for, and the motion of each in this body ----------------


DURATION_S = 10.0
RATE_HZ = 25.0  # the fastest movement has 2.2 Hz; differences at 25 Hz err by some 2 % there
_EASE_S = 1.5
_AXES = "xyz"
_SIDES = {"l": "left", "r": "right"}


@dataclass(frozen=True)
class Swing:
    """One joint's part: rotation about a segment axis (0 to 2), about a middle, at a growing pace.

    ``hz`` is the pace at the beginning and at the end.
    """

    joint: str
    axis: int
    middle_rad: float
    swing_rad: float
    hz: tuple[float, float]
    phase_rad: float

    def angle_rad(self, times_s: np.ndarray) -> np.ndarray:
        """(N,) angle over the time from the beginning, zero at both ends."""
        slow, fast = self.hz
        cycles = slow * times_s + 0.5 * (fast - slow) * times_s**2 / DURATION_S
        wave = np.sin(2 * np.pi * cycles + self.phase_rad)
        part = np.clip(np.minimum(times_s, DURATION_S - times_s) / _EASE_S, 0.0, 1.0)
        eased = part**3 * (10 - 15 * part + 6 * part**2)  # two continuous derivatives
        return eased * (self.middle_rad + self.swing_rad * wave)


@dataclass(frozen=True)
class Movement:
    """A movement from standing: the instruction, the foot that stays, and the joints."""

    name: str
    text: str
    stance: str
    swings: tuple[Swing, ...]


# --- which movements there are ----------------------------------------------------------------


def load_movements() -> tuple[Movement, ...]:
    """The movements of ``configs/movements.toml``, those of one side once for each side."""
    movements = []
    for row in read_toml(shipped("movements.toml"))["movements"]:
        for side in _SIDES if "side" in row else ("",):
            other = {"l": "r", "r": "l"}.get(side, "")
            words = {"side": _SIDES.get(side, ""), "other": _SIDES.get(other, "")}
            letters, swings = {"side": side, "other": other}, []
            for part in row["joints"]:
                joint, axis = part["joint"].format(**letters), _AXES.index(part["axis"])
                mirror = -1.0 if joint.endswith("_l") and axis < 2 else 1.0
                middle, swing = (mirror * np.deg2rad(part[n]) for n in ("middle_deg", "swing_deg"))
                phase = np.deg2rad(part.get("phase_deg", 0.0))
                swings.append(Swing(joint, axis, middle, swing, tuple(part["hz"]), phase))
            name, stance = (row[key].format(**letters) for key in ("name", "stance"))
            movements.append(Movement(name, row["text"].format(**words), stance, tuple(swings)))
    return tuple(movements)


def possible(movement: Movement, person: Person) -> bool:
    """Whether the skeleton has the joints and markers show them."""
    skeleton = person.skeleton
    joints = {swing.joint for swing in movement.swings}
    if not joints <= set(skeleton.joints) or f"foot_{movement.stance}" not in skeleton.segments:
        return False
    return not any(person.held[skeleton.joints.index(joint)] for joint in joints)


# --- as motion of this person -----------------------------------------------------------------


def motion_of(
    movement: Movement, person: Person, model: pin.Model
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (N, nq), v and a (N, nv) of the movement, the ground at height 0 below the stance foot.

    The base moves so that the stance foot stays. Velocities and accelerations are differences on
    the manifold.
    """
    step = 1.0 / RATE_HZ
    times = np.arange(-step, DURATION_S + 1.5 * step, step)
    upright = pin.neutral(model)  # segments' Y up and X along the world's X
    upright[3:7] = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    skeleton = person.skeleton
    turns = np.zeros((len(times), model.nv))  # of the joints, from standing upright
    for swing in movement.swings:
        joint = skeleton.joints.index(swing.joint)
        # A hinge has one coordinate, whatever axis it turns about.
        axis = swing.axis if skeleton.joint_types[joint] == "spherical" else 0
        turns[:, skeleton.v_starts[joint] + axis] += swing.angle_rad(times)
    q = np.stack([pin.integrate(model, upright, x) for x in turns])
    # the stance foot where the first pose, upright, has it, its lowest marker on the ground
    data, foot = model.createData(), skeleton.index(f"foot_{movement.stance}")
    pin.forwardKinematics(model, data, q[0])
    home = data.oMi[foot + 1].copy()
    markers = person.markers_in_joint_m()[person.marker_segments == foot]
    home.translation[2] = -min((home.rotation @ markers.T)[2], default=0.0)
    for row in q:
        pin.forwardKinematics(model, data, row)
        base = home * data.oMi[foot + 1].inverse() * data.oMi[1]
        row[:7] = pin.SE3ToXYZQUAT(base)
    steps = np.stack([pin.difference(model, a, b) for a, b in pairwise(q)])
    v = (steps[1:] + steps[:-1]) / (2 * step)
    a = (steps[1:] - steps[:-1]) / step**2
    return q[1:-1], v, a


_ADVISED = 3
_STRIDE = 2  # frames; squares of 2.2 Hz need 9 Hz


@dataclass(frozen=True, eq=False)
class Gain:
    """What a movement adds.

    share : increase of the mean data share of all parameters (0 to 1); segments (n,) of each.
    wrench : part of the unknown variance of the ground wrench that it removes, in the mean of all
        movements (0 to 1): there the heavy segments count.
    """

    movement: Movement
    share: float
    segments: np.ndarray
    wrench: float

    @property
    def best_segment(self) -> int:
        """Index of the segment that gains most."""
        return int(np.argmax(self.segments))


@dataclass(frozen=True)
class Advice:
    """Every possible movement on its own, best first, and the few that help most together.

    A gain in ``together`` counts what the movements before it in the tuple already decide: the
    second best on its own is often the first one's twin.
    """

    alone: tuple[Gain, ...]
    together: tuple[Gain, ...]


def advice(problem: Problem, person: Person, model: pin.Model) -> Advice:
    """Gains over what the recordings of the problem decide, at their noise.

    A second of movement is taken to hold as many independent samples as one of the recordings'.
    """
    known, _ = problem.trusted_equations()
    offers = [
        (movement, _information(movement, problem, person, model))
        for movement in load_movements()
        if possible(movement, person)
    ]
    before = beforehand(problem)
    all_motion = np.sum([added for _, added in offers], axis=0)
    alone = _gains(before, known, offers, all_motion)
    together: list[Gain] = []
    best = alone
    while best and len(together) < _ADVISED:
        together.append(best[0])
        known = known + next(added for m, added in offers if m is best[0].movement)
        offers = [offer for offer in offers if offer[0] is not best[0].movement]
        best = _gains(before, known, offers, all_motion)
    return Advice(tuple(alone), tuple(together))


def _information(
    movement: Movement, problem: Problem, person: Person, model: pin.Model
) -> np.ndarray:
    """(P, P) weighted sum of Y^T Y over the movement, moments about the ground below the pelvis."""
    q, v, a = motion_of(movement, person, model)
    reference = np.append(q[:, :2].mean(axis=0), 0.0)
    q, v, a = (rows[::_STRIDE] for rows in (q, v, a))
    regressor = wrench_regressor(model, q, v, a, reference)
    regressor = regressor * ~problem.prior.fixed_parameters()
    noise = problem.noise
    independent = noise.effective * DURATION_S / problem.equations.duration_s
    rows = regressor * (np.sqrt(independent / len(q)) / noise.rms / problem.trust_ratio)[:, None]
    rows = rows.reshape(-1, rows.shape[-1])
    return rows.T @ rows


def _gains(
    before: Beforehand,
    known: np.ndarray,
    offers: list[tuple[Movement, np.ndarray]],
    all_motion: np.ndarray,
) -> list[Gain]:
    """Gain of each offer on its own over what is known, best first."""
    if not offers:
        return []
    now, unknown = before.share(known), before.wrench_variance(known, all_motion)
    gains = []
    for movement, added in offers:
        more = before.share(known + added) - now
        left = before.wrench_variance(known + added, all_motion) / unknown
        gains.append(Gain(movement, float(more.mean()), more.mean(axis=1), 1.0 - left))
    return sorted(gains, key=lambda gain: -gain.share)
