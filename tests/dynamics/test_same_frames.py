"""Centres of pressure are compared over the frames that all compared methods have."""

import numpy as np
import pytest

from bsip_cli.stages.reconstruct import over_the_same_frames

NONE = float("nan")


def signals(cop: list[float]) -> dict[str, np.ndarray]:
    return {"cop_ap": np.array(cop), "cop_ml": np.array(cop), "fz": np.array([700.0, 210.0, 800.0])}


def test_a_frame_without_one_methods_cop_is_compared_in_none():
    """RM's force is just too small in the second frame, where all others err by far."""
    found = over_the_same_frames(
        {
            "measured": signals([0.0, 0.0, 0.0]),
            "RM": signals([0.01, NONE, 0.01]),
            "RM+mass": signals([0.01, 0.3, 0.01]),
            "OM": signals([0.02, 0.4, 0.02]),
            "base": signals([0.02, 0.4, NONE]),
        }
    )
    for method, errors in {"RM+mass": [0.01, NONE, 0.01], "OM": [0.02, NONE, 0.02]}.items():
        assert found[method]["cop_ap"] == pytest.approx(errors, nan_ok=True)
    assert np.isfinite(found["measured"]["cop_ml"]).tolist() == [True, False, True]
    assert found["OM"]["fz"].tolist() == [700.0, 210.0, 800.0]
