"""Joints hold together and feet stay where they stand."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.simulate.numerics import bridge, derivative, glide, soft_polyline, step, transpose

TASKS = ("static", "squat", "throwing", "steps", "basketball", "walking", "running")


@pytest.mark.parametrize("task", TASKS)
def test_legs_close_at_the_ankle(trial, person, task):
    poses = trial(task).poses
    for side in "lr":
        ankle = poses.point(f"shank_{side}", person.joints_m[f"ankle_{side}"])
        assert np.abs(ankle - poses.origin_m[f"foot_{side}"]).max() < 1e-9
        hip = poses.point("lower_torso", person.joints_m[f"hip_{side}"])
        assert np.abs(hip - poses.origin_m[f"thigh_{side}"]).max() < 1e-12


@pytest.mark.parametrize("task", TASKS)
def test_knees_are_hinges_about_their_tilted_axis(trial, person, task):
    poses = trial(task).poses
    for side in "lr":
        axis = person.hinges[f"knee_{side}"]
        knee = transpose(poses.rotation[f"thigh_{side}"]) @ poses.rotation[f"shank_{side}"]
        assert np.abs(knee @ axis - axis).max() < 1e-9


@pytest.mark.parametrize("task", ["static", "squat", "throwing", "sequence"])
def test_flat_standing_feet_do_not_move(trial, task):
    here = trial(task)
    for side in "lr":
        foot = here.plan.feet[side]
        path, loaded = foot.position_m[here.plan.keep], foot.share[here.plan.keep] > 1e-6
        assert np.ptp(path[loaded], axis=0).max() < 1e-9


@pytest.mark.parametrize("task", ["walking", "running", "basketball"])
def test_a_loaded_foot_keeps_a_point_on_the_ground(trial, person, task):
    """Feet may roll about the heel or the metatarsal heads, but those do not slip."""
    here = trial(task)
    for side in "lr":
        foot, keep = here.plan.feet[side], here.plan.keep
        length = person.lengths_m[f"foot_{side}"]
        points = [
            here.poses.point(f"foot_{side}", np.array([x * length, -person.ankle_height_m, 0.0]))
            for x in (-0.27, 0.73)
        ]
        slip = np.min(
            [np.linalg.norm(derivative(point, 0.001), axis=1) for point in points], axis=0
        )
        depth = np.max([np.abs(point[:, 1]) for point in points], axis=0)
        loaded = foot.share[keep] > 1e-3
        loaded[:5] = loaded[-5:] = False
        edges = np.flatnonzero(np.diff(foot.share[keep] > 1e-3))
        for edge in edges:
            loaded[max(edge - 5, 0) : edge + 6] = False
        assert slip[loaded].max() < 0.02
        assert depth[loaded].max() < 0.35


@pytest.mark.parametrize("task", TASKS)
def test_movements_are_smooth(trial, task):
    """No jumps: positions at 1 kHz have bounded third differences (jerk)."""
    poses = trial(task).poses
    for body in ("lower_torso", "head", "hand_r", "shank_l"):
        jerk = np.diff(poses.origin_m[body], 3, axis=0) / 0.001**3
        assert np.abs(jerk).max() < 2e4


def test_bridge_meets_both_states():
    rng = np.random.default_rng(0)
    start, end = rng.standard_normal((2, 4))
    t = np.linspace(0.0, 0.5, 200)
    piece = np.polynomial.Polynomial.fit(t, bridge(start, end, 0.5, t), 7)
    for order in range(4):
        slope = piece.deriv(order) if order else piece
        assert slope(np.array([0.0, 0.5])) == pytest.approx([start[order], end[order]], abs=1e-6)


def test_curves_start_and_end_where_they_should():
    t = np.linspace(-1.0, 2.0, 3001)
    for curve in (step(t, 0.0, 1.0), glide(t, 0.0, 1.0, 0.2, 0.3)):
        assert curve[0] == 0.0
        assert curve[-1] == pytest.approx(1.0, abs=1e-12)
        assert np.all(np.diff(curve) >= -1e-12)
    line = soft_polyline(t, np.array([0.0, 1.0]), np.array([2.0, 5.0]), 0.02)
    assert line[0] == pytest.approx(2.0)
    assert line[-1] == pytest.approx(5.0)
    assert line[np.searchsorted(t, 0.5)] == pytest.approx(3.5, abs=1e-3)
