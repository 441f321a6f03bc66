"""Gaps of a known motion: rigid segments exactly, single markers by splines, ends never."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.recordings.gaps import fill_gaps

RATE_HZ = 100.0


def _body(n: int = 200) -> np.ndarray:
    """Four markers of one rigid body in fast motion, (n, 4, 3)."""
    t = np.arange(n) / RATE_HZ
    local = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0.05, 0.05, 0.1]])
    turn = Rotation.from_rotvec(np.column_stack([np.sin(5 * t), 2 * np.sin(3 * t), t]))
    path = np.column_stack([0.5 * np.sin(4 * t), t, 1 + 0.1 * np.cos(9 * t)])
    return np.einsum("nij,kj->nki", turn.as_matrix(), local) + path[:, None]


def test_rigid_segment_is_exact():
    truth = _body()
    holed = truth.copy()
    holed[50:80, 3] = np.nan
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.0, max_rigid_gap_s=0.5)
    np.testing.assert_allclose(result.markers_m, truth, atol=1e-12)
    assert result.filled.sum() == 30 and result.rigid.sum() == 30
    assert result.filled[50:80, 3].all()


def test_spline_where_the_segment_cannot_help():
    truth = _body()
    holed = truth.copy()
    holed[50:58, 3] = holed[50:58, 2] = np.nan
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.2, max_rigid_gap_s=0.2)
    assert not result.rigid.any() and result.filled.sum() == 16
    assert np.abs(result.markers_m - truth).max() < 5e-4


def test_the_segment_bridges_what_the_spline_must_leave():
    holed = _body()
    holed[50:70, 3] = np.nan  # its mates are seen
    holed[100:120, :] = np.nan  # nothing is
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.1, max_rigid_gap_s=0.3)
    assert result.rigid[50:70, 3].all() and result.rigid.sum() == result.filled.sum() == 20
    assert np.isnan(result.markers_m[100:120]).all()


def test_limits_hold_to_the_frame():
    for frames, expected in ((10, True), (11, False)):
        holed = _body()
        holed[50 : 50 + frames, 3] = np.nan
        result = fill_gaps(holed, RATE_HZ, [], max_gap_s=0.1, max_rigid_gap_s=0.5)
        assert result.filled.any() == expected


def test_markers_on_a_line_give_no_orientation():
    truth = _body()
    truth[:, 2] = 2 * truth[:, 1] - truth[:, 0]
    holed = truth.copy()
    holed[50:55, 3] = np.nan
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.2, max_rigid_gap_s=0.2)
    assert not result.rigid.any() and result.filled.sum() == 5


def test_long_gaps_and_ends_stay():
    holed = _body()
    holed[:10, 0] = holed[-10:, 1] = holed[60:90, 2] = np.nan
    result = fill_gaps(holed, RATE_HZ, [], max_gap_s=0.2, max_rigid_gap_s=0.2)
    assert not result.filled.any()
    np.testing.assert_array_equal(result.markers_m, holed)
