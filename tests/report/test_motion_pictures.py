"""Poses as film data, the person as a model, the stages as a flow chart."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest
from matplotlib.patches import FancyBboxPatch

from bsip_cli.pipeline import STAGES
from bsip_cli.report.figures.body_model import body_model, projected
from bsip_cli.report.figures.workflow import Step, workflow
from bsip_cli.report.film import film_data
from bsip_cli.report.poses import Poses
from bsip_cli.stages.group_report import steps


@pytest.fixture
def poses() -> Poses:
    rng = np.random.default_rng(4)
    bones = rng.uniform(0.2, 1.6, (3, 2, 2, 3))
    forces = np.array([[0.0, 10.0, 700.0], [np.nan] * 3, [5.0, 0.0, 650.0]])
    return Poses(
        time_s=np.array([0.0, 0.05, 0.1]),
        bones_m=bones,
        sides=("l", ""),
        head_m=np.array([[0.1, 0.2, 1.7]] * 3),
        head_radius_m=0.1,
        markers_m=rng.uniform(0.2, 1.6, (3, 4, 3)),
        force_m=np.where(np.isnan(forces), np.nan, 0.05),
        forces_N=forces,
        ground_m=0.05,
        body_weight_N=700.0,
    )


def test_film_data_hold_every_position_to_the_millimetre(poses):
    film = json.loads(film_data(poses))
    assert (film["frames"], film["bones"], film["markers"]) == (3, 2, 4)
    assert film["sides"] == "l-"
    assert film["times_ms"] == [0, 50, 100]
    numbers = np.frombuffer(base64.b64decode(film["positions"]), "<i2").reshape(3, -1, 3)
    origin = np.array([*poses.bones_m[0, 0, 0, :2], poses.ground_m])
    ends = numbers[:, :4].reshape(3, 2, 2, 3) / 1000 + origin
    np.testing.assert_allclose(ends, poses.bones_m, atol=5.1e-4)
    np.testing.assert_allclose(numbers[:, 5:9] / 1000 + origin, poses.markers_m, atol=5.1e-4)
    tips = numbers[:, 10] / 1000 + origin
    np.testing.assert_allclose(tips[[0, 2]], poses.arrow_tips_m()[[0, 2]], atol=5.1e-4)
    assert (numbers[1, 9:] == -32768).all()  # no force was measured there


def test_the_model_shows_its_markers_and_the_force(poses):
    (axes,) = body_model(poses, 0).axes
    (markers,) = axes.lines
    assert len(markers.get_xdata()) == 4
    assert "700 N" in [text.get_text() for text in axes.texts]
    (without,) = body_model(poses, 1).axes
    assert not without.texts


def test_the_model_is_seen_from_the_front_and_above():
    """The person looks along x: toes towards the viewer are drawn lower than the heel."""
    toe, heel, right = np.array([[0.2, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.0, 0.2, 0.0]])
    centre = np.zeros(3)
    assert projected(toe, centre)[1] < projected(heel, centre)[1]
    assert projected(right, centre)[0] < 0.0  # facing us, their right is on our left


def test_the_flow_chart_has_every_stage_once():
    (axes,) = workflow(steps()).axes
    names = [text.get_text() for text in axes.texts]
    for stage in STAGES:
        assert names.count(stage.name) == 1
    assert sum(isinstance(patch, FancyBboxPatch) for patch in axes.patches) == len(steps())


def test_arrows_join_only_what_nothing_else_joins():
    chain = (
        Step("a", ("trial",), "", ()),
        Step("b", ("trial",), "", ("a",)),
        Step("c", ("trial",), "", ("a", "b")),
    )
    (axes,) = workflow(chain).axes
    arrows = [text for text in axes.texts if getattr(text, "arrow_patch", None) is not None]
    assert len(arrows) == 2
