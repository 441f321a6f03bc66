"""Forces that carry and drive a body go with its momentum."""

import numpy as np
import pytest

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.body_motion import Body, Harmony

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
    force = MASS_KG * (body.acceleration_m_s2 + np.array([0.0, 0.0, GRAVITY_M_S2]))
    moment = MASS_KG * body.spin_m2_s2 + np.cross(body.place_m, force)
    return np.nan_to_num(np.hstack([force, moment]))


@pytest.fixture(scope="module")
def body():
    return Body.of(_markers(), RATE_HZ, FRAMES)


def test_its_own_wrench_is_in_full_harmony(body):
    match = body.match(_wrench(body))
    assert match.gap_m < 1e-6 and match.seconds > 2.5
    found = Harmony.of([match])
    assert all(found.correlations[kind] > 0.95 for kind in ("force", "vertical"))
    assert found.log_likelihood() > 10.0


@pytest.mark.parametrize(("columns", "kind"), [([0, 1], "force"), ([5], "vertical")])
def test_a_reversed_part_goes_against_the_motion(body, columns, kind):
    about_centre = _wrench(body)
    about_centre[:, 3:] -= np.cross(body.place_m, about_centre[:, :3])
    about_centre[:, columns] *= -1.0
    about_centre[:, 3:] += np.cross(body.place_m, about_centre[:, :3])
    assert Harmony.of([body.match(about_centre)]).correlations[kind] < -0.95


def test_other_axes_change_nothing(body):
    mirror = np.diag([1.0, -1.0, 1.0])
    wrench = _wrench(body)
    seen = np.hstack([wrench[:, :3] @ mirror, -wrench[:, 3:] @ mirror])
    one, other = body.match(wrench), body.moved(mirror).match(seen)
    assert one.seconds == other.seconds
    np.testing.assert_allclose(one.sums["vertical"], other.sums["vertical"])


def test_a_body_of_which_little_is_seen_says_nothing():
    match = Body.of({"foot_l": _markers()["lower_torso"]}, RATE_HZ, FRAMES).match(np.ones((N, 6)))
    assert match.sums is None and np.isnan(match.gap_m)
    assert Harmony.of([match]).log_likelihood() == 0.0
