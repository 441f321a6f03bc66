"""Find the pelvis' path that makes a planned movement physically possible.

On the ground the centre of pressure must follow the plan; in flight the centre of mass
must fall freely and the angular momentum about it must stay constant. All of it is one
fixed-point iteration on the pelvis' pose:

- horizontally, the moment balance about the planned COP is a linear two-point boundary
  value problem for the centre of mass (a cart-table with varying vertical force; in
  flight it reduces to uniform motion), solved for the whole trial at once;
- vertically, the pelvis keeps its nominal height, or the centre of mass a prescribed one;
- in flight, the pelvis turns so that the angular momentum is kept; septic polynomials
  carry the correction into the stances beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import solve_banded
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from bsip_cli.errors import NumericalError
from bsip_cli.simulate.calculus import bridge, derivative, integral
from bsip_cli.simulate.kinematics import Poses, poses_of
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.rotations import euler_zxy, from_rotation_vector
from bsip_cli.simulate.wrench import GRAVITY, Momentum, ball_load, momentum_of

G = -GRAVITY[1]
SWAY_LIMIT_M = np.array([0.045, 0.020])  # ahead, aside
ENDS_FIT = 24  # samples of a flight's end that give its derivatives
LONGEST_BRIDGE_S = 0.35
CLOSE_ENOUGH_M = 1e-9
MOST_ROUNDS = 80
MOST_LOWERINGS = 12


@dataclass(frozen=True)
class State:
    """The pelvis' path (T, 3) and rotation (T, 3, 3) in the walkway frame."""

    pelvis_m: np.ndarray
    rotation: np.ndarray


def balanced(person: Person, plan: Plan, thin: int = 1) -> Poses:
    """Poses of the balanced movement, at the plan's samples.

    thin : balance every `thin`-th sample only and interpolate (for long standing trials).
    """
    coarse = plan.thinned(thin) if thin > 1 else plan
    state, height = _within_reach(person, coarse)
    if thin > 1:
        state = _refined(coarse, state, plan)
    poses = poses_of(person, plan, state.pelvis_m, state.rotation)
    if poses.excess_reach_m.max() > 0.0:
        raise NumericalError(
            f"a foot is {1000 * poses.excess_reach_m.max():.1f} mm out of reach",
            expected=f"legs that reach after lowering the body by {1000 * height:.0f} mm",
            remedy="use another seed",
        )
    return poses


def _within_reach(person: Person, plan: Plan) -> tuple[State, float]:
    """Balance, lowering the body until the legs reach the planned feet."""
    lowered = np.zeros(len(plan))
    for attempt in range(MOST_LOWERINGS):
        state, poses = _balance(person, _lowered(plan, lowered), final=attempt > 0)
        excess = poses.excess_reach_m
        if excess.max() == 0.0 and attempt > 0:
            break
        if excess.max() > 0.0:
            lowered = lowered + _lowering(excess, plan)
    return state, float(lowered.max())


def _lowering(excess_m: np.ndarray, plan: Plan) -> np.ndarray:
    """How much lower to go: everywhere the same if the height is prescribed."""
    needed = 1.25 * excess_m + np.where(excess_m > 0.0, 0.003, 0.0)
    if plan.com_height_m is not None:
        return np.full(len(plan), needed.max())
    samples = max(int(0.5 / plan.step_s), 1)
    wide = maximum_filter1d(needed, 2 * samples + 1, mode="nearest")
    return gaussian_filter1d(wide, samples / 4.0, mode="nearest", truncate=6.0)


def _lowered(plan: Plan, by_m: np.ndarray) -> Plan:
    drop = np.stack([np.zeros_like(by_m), by_m, np.zeros_like(by_m)], axis=1)
    height = None if plan.com_height_m is None else plan.com_height_m - by_m
    return replace(plan, pelvis_m=plan.pelvis_m - drop, com_height_m=height)


def _balance(person: Person, plan: Plan, final: bool) -> tuple[State, Poses]:
    """The fixed-point iteration; a rough one unless `final`."""
    rotation = euler_zxy(plan.pelvis_angles_rad)
    state = State(plan.pelvis_m.copy(), rotation)
    cop = plan.cop_m()
    if plan.sway_share:
        state, cop = _with_sway(person, plan, state, cop)
    tolerance = CLOSE_ENOUGH_M if final else 1e-4
    if not plan.flights:
        tolerance = max(tolerance, 1e-6)
    for _ in range(MOST_ROUNDS):
        poses = poses_of(person, plan, state.pelvis_m, state.rotation)
        momentum = momentum_of(person.inertias, poses, plan.step_s)
        ball_force, ball_moment = ball_load(plan.ball, poses, plan.step_s)
        turn = _flight_turns(plan, momentum, ball_force, ball_moment)
        target = _com_target(plan, momentum, cop, ball_force, ball_moment)
        miss = target - momentum.com_m
        state = State(
            state.pelvis_m + miss, from_rotation_vector(turn) @ state.rotation
        )
        if max(np.abs(miss).max(), np.abs(turn).max()) < tolerance:
            break
    return state, poses_of(person, plan, state.pelvis_m, state.rotation)


def _with_sway(
    person: Person, plan: Plan, state: State, cop: np.ndarray
) -> tuple[State, np.ndarray]:
    """Stand over the planned COP, and leave a part of the COP's natural excursion in it."""
    for _ in range(3):
        poses = poses_of(person, plan, state.pelvis_m, state.rotation)
        momentum = momentum_of(person.inertias, poses, plan.step_s)
        miss = np.zeros_like(momentum.com_m)
        miss[:, [0, 2]] = cop - momentum.com_m[:, [0, 2]]
        state = State(state.pelvis_m + miss, state.rotation)
    turning = derivative(momentum.spin(), plan.step_s)
    weight = momentum.mass_kg * G
    excursion = np.stack([turning[:, 2], -turning[:, 0]], axis=1) / weight
    kept = SWAY_LIMIT_M * np.tanh(plan.sway_share * excursion / SWAY_LIMIT_M)
    return state, cop + gaussian_filter1d(kept, 0.03 / plan.step_s, axis=0, mode="nearest")


def _com_target(
    plan: Plan,
    momentum: Momentum,
    cop_m: np.ndarray,
    ball_force: np.ndarray,
    ball_moment: np.ndarray,
) -> np.ndarray:
    """(T, 3) path of the centre of mass that puts the COP where it is planned."""
    height = _height_target(plan, momentum, ball_force)
    mass = momentum.mass_kg
    lift = mass * (derivative(derivative(height, plan.step_s), plan.step_s) + G)
    for first, last in plan.flights:
        lift[first : last + 1] = -ball_force[first : last + 1, 1]
    total = lift + ball_force[:, 1]
    load = derivative(momentum.spin(), plan.step_s) + ball_moment
    ahead = _cart_table(height, mass, lift, total * cop_m[:, 0] - load[:, 2], plan)
    aside = _cart_table(height, mass, lift, total * cop_m[:, 1] + load[:, 0], plan, 0.0)
    return np.stack([ahead, height, aside], axis=1)


def _cart_table(
    height: np.ndarray,
    mass: float,
    lift: np.ndarray,
    moment: np.ndarray,
    plan: Plan,
    speed: float | None = None,
) -> np.ndarray:
    """Solve lift c - mass height c'' = moment for c (T,), with c' = speed at both ends."""
    n = len(height)
    speed = plan.speed_m_s if speed is None else speed
    stiffness = mass * height / plan.step_s**2
    bands = np.zeros((3, n))
    bands[0, 2:] = -stiffness[1:-1]
    bands[1, 1:-1] = lift[1:-1] + 2.0 * stiffness[1:-1]
    bands[2, :-2] = -stiffness[1:-1]
    right = moment.copy()
    bands[1, 0], bands[0, 1], right[0] = -1.0, 1.0, speed * plan.step_s
    bands[1, -1], bands[2, -2], right[-1] = 1.0, -1.0, speed * plan.step_s
    return solve_banded((1, 1), bands, right)


def _height_target(plan: Plan, momentum: Momentum, ball_force: np.ndarray) -> np.ndarray:
    """(T,) height of the centre of mass; a held ball slows its rise in flight."""
    if plan.com_height_m is None:
        return momentum.com_m[:, 1]
    if plan.ball is None:
        return plan.com_height_m
    correction = np.zeros((len(plan), 1))
    for first, last in plan.flights:
        inside = slice(first, last + 1)
        sink = -ball_force[inside, 1] / momentum.mass_kg
        speed = integral(sink, plan.step_s)
        correction[inside, 0] = integral(speed - speed.mean(), plan.step_s)
    return plan.com_height_m + _carried_into_stance(correction, plan)[:, 0]


def _flight_turns(
    plan: Plan, momentum: Momentum, ball_force: np.ndarray, ball_moment: np.ndarray
) -> np.ndarray:
    """(T, 3) rotation vectors by which the pelvis must turn to keep the angular momentum.

    In each flight the constant momentum is chosen so that the turns at both its ends vanish.
    """
    turns = np.zeros_like(momentum.com_m)
    for first, last in plan.flights:
        inside = slice(first, last + 1)
        com = momentum.com_m[inside]
        torque = np.cross(com, ball_force[inside]) - ball_moment[inside]
        spin = momentum.spin()[inside] - integral(torque, plan.step_s)
        mobility = np.linalg.inv(momentum.locked[inside])
        mean_rate = np.einsum("tij,tj->i", mobility, spin)
        kept = np.linalg.solve(mobility.sum(axis=0), mean_rate)
        rate = np.einsum("tij,tj->ti", mobility, kept - spin)
        turn = integral(rate, plan.step_s)
        ramp = np.linspace(0.0, 1.0, len(turn))[:, None]
        turns[inside] = turn - ramp * turn[-1]
    return _carried_into_stance(turns, plan) if plan.flights else turns


def _carried_into_stance(values: np.ndarray, plan: Plan) -> np.ndarray:
    """Fill the samples outside flights with septic bridges between the flights' ends."""
    result = values.copy()
    zero = np.zeros((4, values.shape[1]))
    knots: list[tuple[int, np.ndarray]] = [(0, zero)]
    for first, last in plan.flights:
        window = values[first : last + 1]
        knots.append((first, _end_state(window, plan.step_s, at_start=True)))
        knots.append((last, _end_state(window, plan.step_s, at_start=False)))
    knots.append((len(values) - 1, zero))
    for (a, start), (b, end) in zip(knots[0::2], knots[1::2], strict=True):
        result[a : b + 1] = _bridge_or_rest(start, end, b - a + 1, plan.step_s)
    return result


def _bridge_or_rest(start: np.ndarray, end: np.ndarray, n: int, step_s: float) -> np.ndarray:
    """One bridge over a short stance; over a long one, to zero and back."""
    longest = int(LONGEST_BRIDGE_S / step_s)
    zero = np.zeros_like(start)
    if n - 1 <= 2 * longest:
        return bridge(start, end, (n - 1) * step_s, np.arange(n) * step_s)
    filled = np.zeros((n, start.shape[1]))
    times = np.arange(longest + 1) * step_s
    filled[: longest + 1] = bridge(start, zero, longest * step_s, times)
    filled[n - 1 - longest :] = bridge(zero, end, longest * step_s, times)
    return filled


def _end_state(window: np.ndarray, step_s: float, at_start: bool) -> np.ndarray:
    """Value and three derivatives (4, D) at an end of a flight, from the flight's side only."""
    n = min(ENDS_FIT, len(window))
    part = window[:n] if at_start else window[-n:]
    times = np.arange(n) * step_s if at_start else np.arange(1 - n, 1) * step_s
    scale = times[np.abs(times).argmax()]
    fit = np.polynomial.polynomial.polyfit(times / scale, part, 6)[:4]
    return fit * np.array([1.0, 1.0, 2.0, 6.0])[:, None] / scale ** np.arange(4)[:, None]


def _refined(coarse: Plan, state: State, plan: Plan) -> State:
    """Interpolate the coarse pelvis path to the plan's samples (quintic spline)."""
    coarse_s = np.arange(len(coarse)) * coarse.step_s
    fine_s = np.arange(len(plan)) * plan.step_s
    path = make_interp_spline(coarse_s, state.pelvis_m, k=5)(fine_s)
    return State(path, euler_zxy(plan.pelvis_angles_rad))
