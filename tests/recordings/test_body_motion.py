"""Forces that carry and drive a body go with its momentum."""

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.body_motion import USUAL, Balance, Body, turn_of_forces

RATE_HZ, N, MASS_KG = 100.0, 300, 70.0
FRAMES = np.arange(N)


def _markers() -> dict[str, np.ndarray]:
    """A trunk that sways and turns about the vertical; one segment that holds all of the mass."""
    t = FRAMES / RATE_HZ
    angle = 0.4 * np.sin(5.0 * t)
    arms = np.array([[0.2, 0.0], [-0.2, 0.0], [0.0, 0.2], [0.0, -0.2]])
    c, s = np.cos(angle), np.sin(angle)
    x = arms[:, 0] * c[:, None] - arms[:, 1] * s[:, None] + 0.05 * np.sin(4.0 * t)[:, None]
    y = arms[:, 0] * s[:, None] + arms[:, 1] * c[:, None] + 0.03 * np.cos(6.0 * t)[:, None]
    return {"lower_torso": np.stack([x, y, np.ones_like(x)], axis=-1)}


def _wrench(body: Body) -> np.ndarray:
    """What Newton and Euler ask for, about the world's origin."""
    force = MASS_KG * (body.rate[:, :3] + np.array([0.0, 0.0, GRAVITY_M_S2]))
    moment = MASS_KG * body.rate[:, 3:] + np.cross(body.place_m, force)
    return np.nan_to_num(np.hstack([force, moment]))


@pytest.fixture(scope="module")
def body():
    return Body.of(_markers(), RATE_HZ, FRAMES)


def test_its_own_wrench_balances_and_drives_it(body):
    found = Balance.of(body, _wrench(body), USUAL)
    assert max(found.gaps_m) < 1e-6
    assert all(found.correlations[kind] > 0.95 for kind in ("force", "vertical"))
    assert found.drive_log_likelihood() > 10.0


@pytest.mark.parametrize(("columns", "kind"), [([0, 1], "force"), ([5], "vertical")])
def test_a_reversed_part_goes_against_the_motion(body, columns, kind):
    about_centre = _wrench(body)
    about_centre[:, 3:] -= np.cross(body.place_m, about_centre[:, :3])
    about_centre[:, columns] *= -1.0
    about_centre[:, 3:] += np.cross(body.place_m, about_centre[:, :3])
    assert Balance.of(body, about_centre, USUAL).correlations[kind] < -0.95


def test_other_axes_change_nothing(body):
    mirror = np.diag([1.0, -1.0, 1.0])
    wrench = _wrench(body)
    seen = np.hstack([wrench[:, :3] @ mirror, -wrench[:, 3:] @ mirror])
    one = Balance.of(body, wrench, USUAL)
    other = Balance.of(body.moved(mirror), seen, USUAL)
    assert one.numbers == other.numbers
    assert one.correlations == pytest.approx(other.correlations)


@pytest.mark.parametrize(
    "change", [np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, -1.0, 1.0]), np.eye(3)[[1, 0, 2]]]
)
def test_the_force_alone_goes_with_the_body_in_whatever_axes(body, change):
    """And whatever its moments are."""
    wrench = _wrench(body)
    one = Balance.of(body, wrench, USUAL)
    other = Balance.of(body, np.hstack([wrench[:, :3] @ change.T, 0.0 * wrench[:, 3:]]), USUAL)
    assert other.level_log_likelihood() == pytest.approx(one.level_log_likelihood(), rel=1e-3)
    assert one.level_log_likelihood() > 10.0
    assert other.drive_log_likelihood() < 0.5 * one.drive_log_likelihood()


def test_a_body_of_which_little_is_seen_says_nothing():
    little = Body.of({"foot_l": _markers()["lower_torso"]}, RATE_HZ, FRAMES)
    found = Balance.of(little, np.ones((N, 6)), USUAL)
    assert found.gaps_m == () and found.log_likelihood(USUAL) == 0.0


def test_each_trial_counts_with_its_own_means(body):
    """A force that is offset in one of two trials goes with the motion no less."""
    offset = _wrench(body)
    offset[:, 0] += 30.0
    one = Balance.of(body, _wrench(body), USUAL)
    both = Balance.of(Body.of_all([body, body]), np.vstack([_wrench(body), offset]), USUAL)
    assert len(both.gaps_m) == 2
    assert both.correlations["force"] == pytest.approx(one.correlations["force"], abs=1e-3)


def test_a_centre_of_mass_that_is_thought_to_be_elsewhere_is_a_gap_and_no_motion(body):
    wrench = _wrench(body)
    aside = replace(body, place_m=body.place_m + np.array([0.03, -0.02, 0.0]))
    one, other = (Balance.of(each, wrench, USUAL) for each in (body, aside))
    assert max(other.gaps_m) == pytest.approx(np.hypot(0.03, 0.02), rel=0.05)
    assert other.correlations["level"] == pytest.approx(one.correlations["level"], abs=0.02)


def test_noise_is_that_of_markers_seen_to_a_millimetre():
    """White noise on markers at rest, against what is said of its momentum's rate."""
    rng = np.random.default_rng(3)
    still = np.repeat(_markers()["lower_torso"][:1], 4000, axis=0)
    noisy = {"lower_torso": still + rng.normal(0.0, 1e-3, still.shape)}
    body = Body.of(noisy, RATE_HZ, np.arange(4000))
    expected = 1e-6 * body.noise[0]
    np.testing.assert_allclose(np.nanvar(body.rate, axis=0), expected, rtol=0.25)


@pytest.mark.parametrize("turn_deg", [-125.0, 0.0, 31.0])
def test_the_turn_of_forces_is_found(body, turn_deg):
    c, s = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
    back = np.kron(np.eye(2), [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    noise = np.random.default_rng(1).normal(0.0, 5.0, (N, 6))
    angle, sd = turn_of_forces(body, _wrench(body) @ back.T + noise, USUAL)
    assert np.rad2deg(sd) < 5.0
    assert np.rad2deg(angle) == pytest.approx(turn_deg, abs=3 * np.rad2deg(sd))
