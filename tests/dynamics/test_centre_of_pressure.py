"""Where the force acts on the ground, and the frames over which methods are compared there."""

import numpy as np
import pytest

from bsip_cli.dynamics.ground_wrench import anterior_and_right, centre_of_pressure
from bsip_cli.stages.reconstruct import over_the_same_frames


def wrench_at(point, force, free_moment=0.0):
    """Force and moment about the world's origin of a force at a point and a moment about Z."""
    moment = np.cross(point, force) + np.array([0, 0, free_moment])
    return np.concatenate([force, moment])[None]


@pytest.mark.parametrize("height_m", [0.0, 0.4, -0.02])
@pytest.mark.parametrize("horizontal", [(0.0, 0.0), (60.0, -35.0)])
def test_the_point_of_the_force_comes_back(height_m, horizontal):
    point = np.array([0.7, -0.25, height_m])
    wrench = wrench_at(point, [*horizontal, 650.0], free_moment=4.0)
    found = centre_of_pressure(wrench, height_m, 50.0)
    np.testing.assert_allclose(found, [[0.7, -0.25]], atol=1e-12)


def test_the_wrong_height_moves_it_along_the_force():
    wrench = wrench_at(np.array([0.7, -0.25, 0.0]), [65.0, 0.0, 650.0])
    np.testing.assert_allclose(centre_of_pressure(wrench, 0.1, 50.0), [[0.71, -0.25]], atol=1e-12)


def test_nothing_while_unloaded():
    point = np.array([0.1, 0.2, 0.0])
    wrench = np.concatenate([wrench_at(point, [0, 0, fz]) for fz in (0.0, 49.9, 50.1, -700.0)])
    found = centre_of_pressure(wrench, 0.0, 50.0)
    assert np.isnan(found[[0, 1, 3]]).all()
    np.testing.assert_allclose(found[2], [0.1, 0.2])


@pytest.mark.parametrize("heading", [0.0, 0.7, 2.0, -2.9])
def test_anterior_up_and_right_are_a_right_handed_frame(heading):
    """X anterior, Y up, Z right (ISB): anterior x up = right; up is the world's Z."""
    anterior = np.array([np.cos(heading), np.sin(heading)])
    right = np.cross([*anterior, 0.0], [0.0, 0.0, 1.0])
    points = np.array([anterior, right[:2], 0.3 * anterior - 0.2 * right[:2]])
    forward, sideways = anterior_and_right(points, anterior)
    np.testing.assert_allclose(forward, [1.0, 0.0, 0.3], atol=1e-12)
    np.testing.assert_allclose(sideways, [0.0, 1.0, -0.2], atol=1e-12)


def signals(cop):
    return {"cop_ap": np.array(cop), "cop_ml": np.array(cop), "fz": np.array([700.0, 210.0, 800.0])}


def test_a_frame_without_one_methods_cop_is_compared_in_none():
    """RM's force is just too small in the second frame, where all others err by far."""
    found = over_the_same_frames(
        {
            "measured": signals([0.0, 0.0, 0.0]),
            "RM": signals([0.01, np.nan, 0.01]),
            "RM+mass": signals([0.01, 0.3, 0.01]),
            "OM": signals([0.02, 0.4, 0.02]),
            "base": signals([0.02, 0.4, np.nan]),
        },
        np.ones(3, bool),
    )
    for method, errors in {"RM+mass": [0.01, np.nan, 0.01], "OM": [0.02, np.nan, 0.02]}.items():
        assert found[method]["cop_ap"] == pytest.approx(errors, nan_ok=True)
    assert np.isfinite(found["measured"]["cop_ml"]).tolist() == [True, False, True]
    assert found["OM"]["fz"].tolist() == [700.0, 210.0, 800.0]


def test_what_is_not_judged_is_missing():
    both = {name: signals([0.0, 0.1, 0.2]) for name in ("measured", "OM")}
    found = over_the_same_frames(both, np.array([True, False, True]))
    for one in found["OM"].values():
        assert np.isfinite(one).tolist() == [True, False, True]
