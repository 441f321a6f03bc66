"""The momentum route against closed forms, and the physics of every movement."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.simulate.balance import ground_wrench, momentum_of
from bsip_cli.simulate.numerics import about_z
from bsip_cli.simulate.people import Inertia
from bsip_cli.simulate.plan import GRAVITY, Poses
from bsip_cli.simulate.recording import Trial

STEP_S = 0.001
STANDING = ("static", "sequence", "squat", "throwing")


def test_a_driven_pendulum_needs_the_wrench_of_the_textbook():
    """A rod turning about a fixed pivot at the origin: F and M in closed form."""
    mass, length, spin_inertia = 3.0, 0.4, 0.02
    t = np.arange(2000) * STEP_S
    angle = 0.8 * np.sin(5.0 * t)
    speed, acceleration = 4.0 * np.cos(5.0 * t), -20.0 * np.sin(5.0 * t)
    tensor = np.diag([0.03, 0.01, spin_inertia])
    part = Inertia(mass, np.array([0.0, -length, 0.0]), tensor)
    poses = Poses({"rod": about_z(angle)}, {"rod": np.zeros((2000, 3))}, np.zeros(2000))
    force, moment = ground_wrench({"rod": part}, poses, STEP_S)

    along = np.stack([np.sin(angle), -np.cos(angle), 0 * t], axis=1)
    across = np.stack([np.cos(angle), np.sin(angle), 0 * t], axis=1)
    expected = mass * length * (acceleration[:, None] * across - (speed**2)[:, None] * along)
    expected = expected - mass * GRAVITY
    about_pivot = (spin_inertia + mass * length**2) * acceleration
    about_pivot = about_pivot + mass * 9.81 * length * np.sin(angle)
    inner = slice(20, -20)
    assert np.abs(force - expected)[inner].max() < 1e-6
    assert np.abs(moment[inner, 2] - about_pivot[inner]).max() < 1e-6
    assert np.abs(moment[inner, :2]).max() < 1e-9


def test_quiet_stance_carries_the_weight(trial, person):
    quiet = trial("static")
    weight = 9.81 * person.mass_kg
    assert quiet.force_n[:, 1].mean() == pytest.approx(weight, rel=2e-4)
    assert np.abs(quiet.force_n[:, 1] / weight - 1.0).max() < 0.01


@pytest.mark.parametrize("task", ["basketball", "running"])
def test_flight_is_free_of_force_and_moment(trial, person, task):
    flight = trial(task)
    plan, poses = flight.plan, flight.poses
    force, moment = ground_wrench(person.inertias, poses, STEP_S)
    com = momentum_of(person.inertias, poses, STEP_S).com_m
    about_com = moment - np.cross(com, force)
    released = 1.0 - plan.ball.hold[plan.keep] if plan.ball else np.ones(len(force))
    checked = 0
    for first, last in plan.flights:
        air = np.zeros(len(plan), dtype=bool)
        air[first + 5 : last - 4] = True
        air = air[plan.keep] & (released == 1.0)
        air[:10] = air[-10:] = False  # one-sided differences
        checked += air.sum()
        if air.any():
            assert np.abs(force[air]).max() < 1.0
            assert np.abs(about_com[air]).max() < 0.5
    assert checked > 50


@pytest.mark.parametrize("task", ["basketball", "running"])
def test_flight_with_the_ball_in_hand_is_measured_as_nothing(trial, task):
    flight = trial(task)
    for first, last in flight.plan.flights:
        start = max(first + 5 - flight.plan.keep.start, 0)
        end = max(last - 4 - flight.plan.keep.start, 0)
        assert np.abs(flight.force_n[start:end]).max(initial=0.0) < 1.0


@pytest.mark.parametrize(
    "task",
    ["static", "sequence", "squat", "throwing", "steps", "basketball", "walking", "running"],
)
def test_the_ground_never_pulls(trial, person, task):
    lowest = trial(task).force_n[:, 1].min()
    assert lowest > (-1.0 if task in ("basketball", "running") else 0.2 * 9.81 * person.mass_kg)


@pytest.mark.parametrize("task", [*STANDING, "basketball"])
def test_cop_stays_on_the_plate(trial, task):
    here = trial(task)
    cop = _loaded_cop(here)
    ahead, aside = np.abs(cop - np.array(here.plan.plate_centre_m)).T
    assert here.all_contacts_measured().all()
    assert ahead.max() < 0.3
    assert aside.max() < 0.6


@pytest.mark.parametrize("task", [*STANDING, "basketball", "steps"])
def test_cop_stays_within_the_feet(trial, task):
    here = trial(task)
    cop = _loaded_cop(here)
    feet = [here.plan.feet[side] for side in "lr"]
    low = np.min([f.position_m[:, [0, 2]].min(axis=0) for f in feet], axis=0)
    high = np.max([f.position_m[:, [0, 2]].max(axis=0) for f in feet], axis=0)
    assert np.all(cop.min(axis=0) > low - 0.06)
    assert np.all(cop.max(axis=0) < high + np.array([0.19, 0.06]))


@pytest.mark.parametrize("task", ["steps", "walking", "running"])
def test_each_foot_carries_its_load_under_itself(trial, task):
    here = trial(task)
    total, moments = (sum(parts) for parts in zip(*here.feet.values(), strict=True))
    air = np.zeros(len(here.plan), dtype=bool)
    for first, last in here.plan.flights:
        air[first : last + 1] = True
    ground = ~air[here.plan.keep]
    assert np.abs(total - here.force_n)[ground].max() < 1e-6
    assert np.abs(moments - here.moment_nm)[ground].max() < 1e-6
    for side in "lr":
        force, moment = here.feet[side]
        loaded = force[:, 1] > 30.0
        cop = centre_of_pressure(force[loaded], moment[loaded])
        ankle = here.poses.origin_m[f"foot_{side}"][loaded][:, [0, 2]]
        assert np.abs(cop - ankle).max() < 0.24
    assert not here.all_contacts_measured().all() or task == "running"


def test_the_ball_changes_the_wrench_until_it_is_released(trial, person):
    throw = trial("throwing")
    ball, keep = throw.plan.ball, throw.plan.keep
    bare, _ = ground_wrench(person.inertias, throw.poses, STEP_S)
    difference = throw.force_n - bare
    held, gone = ball.hold[keep] == 1.0, ball.hold[keep] == 0.0
    held[:20] = gone[-20:] = False
    path = throw.poses.point(ball.body, ball.position_m)
    acceleration = np.gradient(np.gradient(path, STEP_S, axis=0), STEP_S, axis=0)
    expected = ball.mass_kg * (acceleration - GRAVITY)
    assert np.abs(difference[gone]).max() < 1e-6
    assert np.abs((difference - expected)[held]).max() < 0.02
    assert throw.time_s[np.argmax(ball.hold[keep] < 0.5)] == pytest.approx(
        ball.release_s, abs=0.002
    )


def centre_of_pressure(force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """(T, 2) X and Z on the ground where the horizontal moments vanish."""
    return np.stack([moment[:, 2], -moment[:, 0]], axis=1) / force[:, 1:2]


def _loaded_cop(trial: Trial) -> np.ndarray:
    loaded = trial.force_n[:, 1] > 50.0
    return centre_of_pressure(trial.force_n[loaded], trial.moment_nm[loaded])
