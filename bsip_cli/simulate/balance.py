"""Find the pelvis' path that makes a planned movement physically possible, and the ground wrench.

On the ground the centre of pressure must follow the plan; in flight the centre of mass
must fall freely and the angular momentum about it must stay constant. All of it is one
fixed-point iteration on the pelvis' pose:

- horizontally, the moment balance about the planned COP is a linear two-point boundary
  value problem for the centre of mass (a cart-table with varying vertical force; in
  flight it reduces to uniform motion), solved for the whole trial at once;
- vertically, the pelvis keeps its nominal height, or the centre of mass a prescribed one;
- in flight, the pelvis turns so that the angular momentum is kept; the turning fades out
  in the stances beside it.

The wrench by the rate of momentum of all bodies (Newton and Euler for the whole):
F = dp/dt - m g and M = dL/dt - sum r x m g about the walkway's origin, with momenta by numerical
differentiation of positions and rotations. No equations of motion of a tree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import solve_banded
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from bsip_cli.errors import NumericalError
from bsip_cli.simulate.numerics import (
    HALF_WIDTH,
    bridge,
    derivative,
    from_rotation_vector,
    integral,
    rotate,
    runs,
    second_derivative,
    transpose,
    unskew,
)
from bsip_cli.simulate.people import Inertia, Person
from bsip_cli.simulate.plan import (
    GRAVITY,
    G,
    Load,
    Plan,
    Poses,
    Turns,
    poses_of,
    total_load,
    turns_of,
)

UP = np.array([0.0, 1.0, 0.0])
SWAY_LIMIT_M = np.array([0.045, 0.020])  # ahead, aside
LONGEST_BRIDGE_S = 0.30
LOWERING_REACH_S = 0.45
TURN_REACH_S = 0.16
HASTE = 1.35  # over-relaxation of the turns: the feet do not follow the pelvis
RATE_WEIGHT_S = 0.05  # metres of path per rad/s of turning, in what mixing makes small
LOADED_HASTE = 0.7  # what is carried turns with it, and `locked` does not know it
CLOSE_ENOUGH_M = 2e-7  # and rad
LOADED_CLOSE_ENOUGH_M = 2e-5
EDGE_S = 0.05  # of the margin: one-sided differences of a load's acceleration
STANDING_CLOSE_ENOUGH_M = 1e-6
ROUGH_M = 1e-4
DIVERGED_M = 50.0
REFINING_SLACK = 0.0005  # reach kept back for what interpolation adds
MOST_ROUNDS = 60
MOST_LOWERINGS = 12
MIXING_DEPTH = 6


@dataclass(frozen=True, eq=False)
class State:
    """The pelvis' path (T, 3), and its turn (T, 3) against the plan as a rotation vector.

    The turn is kept as its rate [rad/s].
    """

    pelvis_m: np.ndarray
    turn_rate: np.ndarray

    def poses(self, person: Person, plan: Plan, turns: Turns) -> Poses:
        """All bodies' poses; ``turns`` are those of the plan."""
        rotation = turns["lower_torso"]
        if self.turn_rate.any():
            rotation = from_rotation_vector(integral(self.turn_rate, plan.step_s)) @ rotation
        return poses_of(person, plan, turns, self.pelvis_m, rotation)

    def moved(self, by_m: np.ndarray) -> State:
        """The pelvis shifted by (T, 3)."""
        return State(self.pelvis_m + by_m, self.turn_rate)


def balanced(person: Person, plan: Plan, thin: int = 1) -> Poses:
    """Poses of the balanced movement, at the plan's samples.

    thin : balance every `thin`-th sample only and interpolate (for long standing trials).
    """
    if thin == 1:
        state, height = _within_reach(person, plan)
    else:
        coarse = replace(plan.thinned(thin), longest_reach=plan.longest_reach - REFINING_SLACK)
        state, height = _within_reach(person, coarse)
        spline = make_interp_spline(np.arange(len(coarse)) * coarse.step_s, state.pelvis_m, k=5)
        path = spline(np.arange(len(plan)) * plan.step_s)
        state = State(path, np.zeros_like(path))
    poses = state.poses(person, plan, turns_of(person, plan))
    excess = poses.excess_reach_m.max()
    if excess > 0.0:
        raise NumericalError(
            f"a foot is {1000 * excess:.1f} mm out of reach",
            expected=f"legs that reach after lowering the body by {1000 * height:.0f} mm",
            remedy="use another seed",
        )
    return poses


def _within_reach(person: Person, plan: Plan) -> tuple[State, float]:
    """Balance, lowering the body until the legs reach the planned feet."""
    lowered = np.zeros(len(plan))
    state = State(plan.pelvis_m, np.zeros_like(plan.pelvis_m))
    final = False
    for _ in range(MOST_LOWERINGS):
        height = None if plan.com_height_m is None else plan.com_height_m - lowered
        low = replace(plan, pelvis_m=plan.pelvis_m - lowered[:, None] * UP, com_height_m=height)
        state, poses, left = _balance(person, low, state, final)
        excess = poses.excess_reach_m
        if excess.max() == 0.0 and final and left < ROUGH_M:
            break
        final = final or excess.max() == 0.0
        # smooth, and the same throughout each flight
        needed = 1.06 * excess + np.where(excess > 0.0, 0.002, 0.0)
        near = _near_flights(plan, LOWERING_REACH_S)
        lower = _dilated(needed, LOWERING_REACH_S, plan.step_s)
        further = near * needed.max() + (1.0 - near) * lower
        lowered = lowered + further
        state = state.moved(-further[:, None] * UP)
    if not left < ROUGH_M:
        raise _out_of_balance(left)
    return state, float(lowered.max())


def _out_of_balance(left: float) -> NumericalError:
    return NumericalError(
        f"the movement does not come into balance: {1000 * left:.2g} mm or mrad are left",
        expected=f"less than {1000 * ROUGH_M:g}",
        remedy="use another seed or a smaller effect",
    )


def _near_flights(plan: Plan, reach_s: float) -> np.ndarray:
    """(T,) smooth mask: 1 in flight, 0 more than twice reach_s away from any."""
    mask = np.zeros(len(plan))
    for first, last in plan.flights:
        mask[first : last + 1] = 1.0
    return _dilated(mask, reach_s, plan.step_s)


def _dilated(values: np.ndarray, reach_s: float, step_s: float) -> np.ndarray:
    """The largest value within reach, smoothed, at least as large as the value itself."""
    samples = max(int(reach_s / step_s), 1)
    wide = maximum_filter1d(values, 2 * samples + 1, mode="nearest")
    return gaussian_filter1d(wide, samples / 4.0, mode="nearest", truncate=3.9)


def _balance(person: Person, plan: Plan, state: State, final: bool) -> tuple[State, Poses, float]:
    """The fixed-point iteration; a rough one, without turns in flight, unless `final`.

    The number is the size of the last correction, in m or rad.
    """
    cop, turns = plan.cop_m(), turns_of(person, plan)
    if plan.sway_share:
        state, cop = _with_sway(person, plan, turns, state, cop)
    tolerance, mixer = ROUGH_M, Mixer()
    if final and plan.flights:
        tolerance = LOADED_CLOSE_ENOUGH_M if plan.loads else CLOSE_ENOUGH_M
    elif final:
        tolerance = STANDING_CLOSE_ENOUGH_M
    edge = round(EDGE_S / plan.step_s) if plan.loads else 0
    inner = slice(edge, len(plan) - edge)
    for _ in range(MOST_ROUNDS):
        poses = state.poses(person, plan, turns)
        momentum = momentum_of(person.inertias, poses, plan.step_s)
        load = total_load(plan.all_loads(), poses, plan.step_s)
        shift = _com_target(plan, momentum, cop, load) - momentum.com_m
        turn = np.zeros_like(shift)
        if final and plan.flights:
            locked = locked_inertia(person.inertias, poses, momentum.com_m)
            turn = _turn_rate(plan, state.turn_rate, momentum, locked, load) - state.turn_rate
        turned = plan.step_s * np.abs(turn).sum(axis=0)
        left = max(np.abs(shift[inner]).max(), turned.max())
        if not left < DIVERGED_M:
            raise _out_of_balance(left)
        if plan.loads:  # what is carried couples the pelvis' path and turns
            point = np.stack([state.pelvis_m, RATE_WEIGHT_S * state.turn_rate])
            shift, turn = mixer.step(point, np.stack([shift, RATE_WEIGHT_S * turn]))
            turn = turn / RATE_WEIGHT_S
        state = State(state.pelvis_m + shift, state.turn_rate + turn)
        if left < tolerance:
            break
    return state, state.poses(person, plan, turns), float(left)


class Mixer:
    """Remembers the last steps of an iteration x -> x + step(x) and proposes better ones.

    Anderson mixing: Walker and Ni, Anderson acceleration for fixed-point iterations, SIAM J.
    Numer. Anal. 2011.
    """

    def __init__(self) -> None:
        self._points: list[np.ndarray] = []
        self._steps: list[np.ndarray] = []

    def step(self, point: np.ndarray, plain: np.ndarray) -> np.ndarray:
        """The step to take from a point where the plain iteration would take `plain` (same shape).

        Of the remembered points that combination is left whose plain step would be smallest.
        """
        self._points = [*self._points[-MIXING_DEPTH:], point.ravel()]
        self._steps = [*self._steps[-MIXING_DEPTH:], plain.ravel()]
        if len(self._steps) == 1:
            return plain
        moved = np.diff(np.stack(self._points), axis=0)
        changed = np.diff(np.stack(self._steps), axis=0)
        share, *_ = np.linalg.lstsq(changed.T, plain.ravel(), rcond=1e-10)
        return plain - (share @ (moved + changed)).reshape(plain.shape)


def _with_sway(
    person: Person, plan: Plan, turns: Turns, state: State, cop: np.ndarray
) -> tuple[State, np.ndarray]:
    """Stand over the planned COP, and leave a part of the COP's natural excursion in it."""
    for _ in range(3):
        momentum = momentum_of(person.inertias, state.poses(person, plan, turns), plan.step_s)
        miss = np.zeros_like(momentum.com_m)
        miss[:, [0, 2]] = cop - momentum.com_m[:, [0, 2]]
        state = state.moved(miss)
    turning = derivative(momentum.spin(), plan.step_s)
    excursion = np.stack([turning[:, 2], -turning[:, 0]], axis=1) / (momentum.mass_kg * G)
    kept = SWAY_LIMIT_M * np.tanh(plan.sway_share * excursion / SWAY_LIMIT_M)
    return state, cop + gaussian_filter1d(kept, 0.03 / plan.step_s, axis=0, mode="nearest")


def _com_target(
    plan: Plan, momentum: Momentum, cop_m: np.ndarray, carried: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """(T, 3) path of the centre of mass that puts the COP where it is planned."""
    load_force, load_moment = carried
    height, mass = _height_target(plan, momentum, load_force), momentum.mass_kg
    lift = mass * (second_derivative(height, plan.step_s) + G)
    load = derivative(momentum.spin(), plan.step_s) + load_moment
    for first, last in plan.flights:  # only the loads act, and the spin is kept
        air = slice(first, last + 1)
        lift[air] = -load_force[air, 1]
        load[air] = np.cross(momentum.com_m[air], load_force[air])
    total, table = lift + load_force[:, 1], (mass * height, lift, plan.step_s)
    moment, speed = total * cop_m[:, 0] - load[:, 2], plan.speed_m_s
    ahead = _cart_table(*table, moment, speed)
    if speed:  # a gait enters and leaves at the speed it has in its middle
        middle = len(ahead) // 2
        speed = (ahead[middle + 1] - ahead[middle - 1]) / (2.0 * plan.step_s)
        ahead = _cart_table(*table, moment, speed)
    aside = _cart_table(*table, total * cop_m[:, 1] + load[:, 0], 0.0)
    return np.stack([ahead, height, aside], axis=1)


def _cart_table(
    mass_height: np.ndarray, lift: np.ndarray, step_s: float, moment: np.ndarray, speed: float
) -> np.ndarray:
    """c (T,), the centre of mass in one direction, of lift c - mass height c'' = moment (T,).

    mass_height : (T,) [kg m]. lift : (T,) vertical force on the body [N]. speed : c' at both ends.
    """
    stiffness = mass_height / step_s**2
    bands = np.zeros((3, len(moment)))
    bands[0, 2:] = -stiffness[1:-1]
    bands[1, 1:-1] = lift[1:-1] + 2.0 * stiffness[1:-1]
    bands[2, :-2] = -stiffness[1:-1]
    right = moment.copy()
    bands[1, 0], bands[0, 1], right[0] = -1.0, 1.0, speed * step_s
    bands[1, -1], bands[2, -2], right[-1] = 1.0, -1.0, speed * step_s
    return solve_banded((1, 1), bands, right)


def _height_target(plan: Plan, momentum: Momentum, load_force: np.ndarray) -> np.ndarray:
    """(T,) height of the centre of mass; what the body carries slows its rise in flight.

    The prescribed height holds at each landing. Before it the body rises a little faster,
    which a septic bridge in the stance before the flight prepares; another one in the
    stance after it takes up what the load still does at the landing.
    """
    if plan.com_height_m is None:
        return momentum.com_m[:, 1]
    height, dt = plan.com_height_m.copy(), plan.step_s
    if not plan.all_loads():
        return height
    # samples on the ground before, between and after the flights that serve as bridges
    longest, edges = round(LONGEST_BRIDGE_S / dt), [-1, *np.ravel(plan.flights), len(plan)]
    ground = zip(edges[::2], edges[1::2], strict=True)
    stances = pairwise(min(longest, landed - left - 1) for left, landed in ground)
    rest, times = np.zeros(4), np.arange(longest) * dt
    for (first, last), (before, after) in zip(plan.flights, stances, strict=True):
        sink = -load_force[first : last + 1, 1] / momentum.mass_kg
        speed = integral(sink, dt)
        speed = speed - speed[-1]
        rise = integral(speed, dt)
        rise = rise - rise[-1]
        height[first : last + 1] += rise
        k = HALF_WIDTH + 1  # next to the edges, where differences reach out of the flight
        takeoff = np.array([rise[0], speed[0], sink[0], (sink[k] - sink[0]) / (k * dt)])
        landing = np.array([0.0, 0.0, sink[-1], (sink[-1] - sink[-k - 1]) / (k * dt)])
        height[first - before : first] += bridge(rest, takeoff, before * dt, times[:before])
        # the same bridge, run backwards in time
        backwards = landing * [1.0, -1.0, 1.0, -1.0]
        landed = bridge(rest, backwards, after * dt, times[:after])
        height[last + 1 : last + 1 + after] += landed[::-1]
    return height


def _turn_rate(
    plan: Plan,
    rate: np.ndarray,
    momentum: Momentum,
    locked: np.ndarray,
    carried: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """(T, 3) the pelvis' turning rate that keeps the angular momentum in flight.

    What is needed to keep it is faded out in the stances beside a flight; in running the
    stances are so short that it is kept throughout. The momentum that is kept is chosen,
    for each group of flights, so that the pelvis comes back to its planned orientation.
    """
    load_force, load_moment = carried
    weight = _near_flights(plan, TURN_REACH_S)
    haste = LOADED_HASTE if plan.loads else HASTE
    result = np.zeros_like(rate)
    for group in runs(weight > 0.0):
        w = weight[group, None]
        torque = np.cross(momentum.com_m[group], load_force[group]) - load_moment[group]
        spin = momentum.spin()[group] - integral(torque, plan.step_s)
        mobility = np.linalg.inv(locked[group])
        lacking = w * (rate[group] - haste * np.einsum("tij,tj->ti", mobility, spin))
        gain = haste * np.einsum("t,tij->ij", weight[group], mobility)
        kept = np.linalg.solve(gain, -lacking.sum(axis=0))
        result[group] = lacking + haste * w * np.einsum("tij,j->ti", mobility, kept)
    return result


# --- momentum and the ground's wrench -------------------------------------------------------------


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
