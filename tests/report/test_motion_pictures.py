"""The person as the model, and who is shown in which pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.report.figures.person import Pose, projected, stick_figure


@pytest.fixture
def pose() -> Pose:
    rng = np.random.default_rng(4)
    return Pose(
        time_s=0.25,
        bones_m=rng.uniform(0.2, 1.6, (2, 2, 3)),
        sides=("l", ""),
        head_m=np.array([0.1, 0.2, 1.7]),
        head_radius_m=0.1,
        markers_m=rng.uniform(0.2, 1.6, (4, 3)),
        force_at_m=np.full(3, 0.05),
        force_N=np.array([0.0, 0.0, 700.0]),
        ground_m=0.05,
        body_weight_N=700.0,
    )


def test_the_figure_shows_markers_force_and_when(pose):
    figure = stick_figure(pose, "squat $1$")
    (markers,) = figure.axes[0].lines
    assert len(markers.get_xdata()) == 4
    said = figure.get_supxlabel()
    assert "measured ground force, 700 N" in said
    assert said.startswith(r"squat \$1\$, 0.25 s")
    unmeasured = replace(pose, force_N=np.full(3, np.nan))
    assert "ground force" not in stick_figure(unmeasured, "squat").get_supxlabel()


def test_a_force_too_small_for_a_centre_of_pressure_has_no_arrow(pose):
    nowhere = replace(pose, force_at_m=np.full(3, np.nan))
    assert not stick_figure(nowhere, "squat").axes[0].texts
    assert stick_figure(pose, "squat").axes[0].texts


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
