import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.statistics.fit_measures import posturography

RATE_HZ = 100.0
TURN = 2 * np.pi * np.arange(10_001) / 1000  # ten turns in 100 s


def test_circle():
    radius_m = 0.02
    sway = posturography(radius_m * np.cos(TURN), 0.5 + radius_m * np.sin(TURN), RATE_HZ)
    assert sway.duration_s == pytest.approx(100.0)
    assert sway.rms_ap_mm == pytest.approx(20.0 / np.sqrt(2), rel=1e-4)
    assert sway.rms_ml_mm == pytest.approx(20.0 / np.sqrt(2), rel=1e-4)
    assert sway.rms_ml_origin_m == pytest.approx(np.sqrt(0.25 + 0.02**2 / 2), rel=1e-4)
    assert sway.sway_length_mm == pytest.approx(10 * 2 * np.pi * 20.0, rel=1e-4)
    assert sway.mean_velocity_mm_s == pytest.approx(2 * np.pi * 2.0, rel=1e-4)
    # covariance r^2/2 on both axes; 5.991 is the 95 % quantile of chi-square with 2 df
    assert sway.ellipse_area_mm2 == pytest.approx(np.pi * 5.991465 * 20.0**2 / 2, rel=1e-3)


def test_ellipse_area_does_not_depend_on_the_heading():
    ap, ml = 0.03 * np.cos(TURN), 0.01 * np.sin(TURN)
    turned = Rotation.from_euler("z", 33, degrees=True).as_matrix()[:2, :2] @ np.stack([ap, ml])
    along = posturography(ap, ml, RATE_HZ)
    assert along.ellipse_area_mm2 == pytest.approx(np.pi * 5.991465 * 30 * 10 / 2, rel=1e-3)
    assert posturography(*turned, RATE_HZ).ellipse_area_mm2 == pytest.approx(along.ellipse_area_mm2)


def test_ellipse_holds_95_percent_of_normal_points():
    points = np.random.default_rng(0).multivariate_normal([1, 2], [[4, 1], [1, 2]], 200_000)
    inverse = np.linalg.inv(np.cov(points.T))
    centred = points - points.mean(axis=0)
    distance = np.einsum("ni,ij,nj->n", centred, inverse, centred)
    area = posturography(*(points.T / 1e3), RATE_HZ).ellipse_area_mm2
    radius = area / (np.pi * np.sqrt(np.linalg.det(np.cov(points.T))))
    assert np.mean(distance < radius) == pytest.approx(0.95, abs=0.002)


def test_no_path_and_no_time_across_a_gap():
    ap = np.arange(10) * 1e-3
    ap[5:] += 1.0  # a jump of a metre between the stretches
    sway = posturography(ap, np.zeros(10), RATE_HZ, [(0, 5), (5, 10)])
    assert sway.sway_length_mm == pytest.approx(8.0)
    assert sway.duration_s == pytest.approx(0.08)
    assert sway.mean_velocity_mm_s == pytest.approx(100.0)
    ap[7] = np.nan
    sway = posturography(ap, np.zeros(10), RATE_HZ, [(0, 5), (5, 10)])
    assert sway.sway_length_mm == pytest.approx(6.0)
    assert sway.n == 9


def test_straight_line_and_standstill_have_no_area():
    line = np.linspace(0, 0.1, 50)
    assert posturography(line, 0.3 * line, RATE_HZ).ellipse_area_mm2 == pytest.approx(0, abs=1e-3)
    still = posturography(np.full(50, 0.1), np.full(50, 0.2), RATE_HZ)
    assert still.sway_length_mm == still.mean_velocity_mm_s == still.ellipse_area_mm2 == 0.0


def test_too_little_data():
    empty = posturography([], [], RATE_HZ)
    assert np.isnan([empty.rms_ap_mm, empty.ellipse_area_mm2, empty.duration_s]).all()
    apart = posturography([0.1, np.nan, 0.3], np.zeros(3), RATE_HZ)
    assert np.isnan([apart.mean_velocity_mm_s, apart.ellipse_area_mm2]).all()
    assert apart.rms_ap_mm == pytest.approx(100.0)
    with pytest.raises(ValueError, match="rate_hz"):
        posturography([0.0], [0.0], 0.0)
