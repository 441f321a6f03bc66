"""The person as the model, and who is shown in which pose."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from bsip_cli.report.figures.canvas import BLUE, GREEN
from bsip_cli.report.figures.person import Pose, projected, stick_figure


@pytest.fixture
def pose() -> Pose:
    rng = np.random.default_rng(4)
    return Pose(
        time_s=0.25,
        bones_m=rng.uniform(0.2, 1.6, (2, 2, 3)),
        sides=("l", ""),
        head_m=np.array([0.1, 0.2, 1.7]),
        markers_m=rng.uniform(0.2, 1.6, (4, 3)),
        force_at_m=np.full(3, 0.05),
        force_N=np.array([0.0, 0.0, 700.0]),
        ground_m=0.05,
        body_weight_N=700.0,
    )


def drawn(pose: Pose, colour: str, trial: str = "squat") -> list[str]:
    """The outlines of that colour."""
    root = ElementTree.fromstring(stick_figure(pose, trial).svg())
    return [one.get("d") for one in root.iter() if one.get("stroke") == colour]


def said(pose: Pose, trial: str = "squat") -> list[str]:
    return [
        one.text
        for one in ElementTree.fromstring(stick_figure(pose, trial).svg()).iter()
        if one.text
    ]


def test_the_figure_shows_markers_force_and_when(pose):
    (markers,) = drawn(pose, BLUE)
    assert markers.count("M") == 4
    assert any("ground force 700 N" in line for line in said(pose))
    assert "squat <1>, 0.25 s" in said(pose, "squat <1>")
    unmeasured = replace(pose, force_N=np.full(3, np.nan))
    assert not any("ground force" in line for line in said(unmeasured))


def test_a_force_too_small_for_a_centre_of_pressure_has_no_arrow(pose):
    assert not drawn(replace(pose, force_at_m=np.full(3, np.nan)), GREEN)
    assert drawn(pose, GREEN)


def test_one_body_weight_is_half_as_long_as_the_person_is_tall(pose):
    np.testing.assert_allclose(pose.tip_m() - pose.force_at_m, [0, 0, 0.5 * (1.8 - 0.05)])
    assert pose.is_loaded()
    assert not replace(pose, force_N=np.full(3, np.nan)).is_loaded()


def test_the_model_is_seen_from_the_front_and_above():
    """The person looks along x: toes towards the viewer are drawn lower than the heel."""
    toe, heel, right = np.array([[0.2, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.0, 0.2, 0.0]])
    centre = np.zeros(3)
    assert projected(toe, centre)[1] < projected(heel, centre)[1]
    assert projected(right, centre)[0] < 0.0  # facing us, their right is on our left
