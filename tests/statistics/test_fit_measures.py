"""Agreement of signals, and sway, against signals whose measures are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import pearsonr

from bsip_cli.statistics.fit_measures import fit_measures, posturography

PHASE = 2 * np.pi * np.arange(1000) / 100  # ten whole periods
SINE = np.sin(PHASE)


def test_equal_signals():
    fit = fit_measures(SINE, SINE, body_weight_N=700.0)
    assert (fit.rmse, fit.rmse_percent_bw) == (0.0, 0.0)
    assert fit.pearson_r == pytest.approx(1.0)
    assert (fit.schwer_m, fit.schwer_p, fit.schwer_c) == (0.0, 0.0, 0.0)
    assert fit.n == 1000


@pytest.mark.parametrize("shift", [1e-9, 0.1, 1.0, np.pi / 2, np.pi])
def test_shifted_sine_is_an_error_of_phase_only(shift):
    fit = fit_measures(SINE, np.sin(PHASE - shift))
    assert fit.schwer_p == pytest.approx(shift / np.pi, rel=1e-6)
    assert fit.schwer_m == pytest.approx(0.0, abs=1e-12)


def test_against_the_formulas_of_the_notes():
    m, c = np.random.default_rng(0).normal(size=(2, 500)) + 0.3
    fit = fit_measures(m, c, body_weight_N=50.0)
    mm, cc, mc = np.mean(m * m), np.mean(c * c), np.mean(m * c)
    magnitude, phase = np.sqrt(cc / mm) - 1, np.arccos(mc / np.sqrt(mm * cc)) / np.pi
    assert fit.schwer_m == pytest.approx(magnitude)
    assert fit.schwer_p == pytest.approx(phase)
    assert fit.schwer_c == pytest.approx(np.hypot(magnitude, phase))
    assert fit.pearson_r == pytest.approx(pearsonr(m, c).statistic)
    assert fit.rmse == pytest.approx(np.sqrt(np.mean((m - c) ** 2)))
    assert fit.rmse_percent_bw == pytest.approx(2.0 * fit.rmse)
    assert fit.n_effective == pytest.approx(500, rel=0.1)


def test_only_samples_that_are_finite_in_both_count():
    spoilt, holed = SINE.copy(), SINE.copy()
    spoilt[200:300], holed[200:300] = 50.0, np.nan
    spoilt[10] = np.nan
    fit = fit_measures(holed, spoilt)
    assert (fit.n, fit.rmse) == (899, 0.0)
    assert np.isnan(fit.rmse_percent_bw)


def test_empty():
    for fit in (fit_measures([], []), fit_measures(SINE, np.full(1000, np.nan))):
        assert fit.n == 0
        assert np.isnan(
            [fit.rmse, fit.pearson_r, fit.schwer_m, fit.schwer_c, fit.n_effective]
        ).all()


@pytest.mark.parametrize(
    ("measured", "computed"),
    [
        (np.full(1000, 0.1), SINE),
        (SINE, np.full(1000, 0.1)),
        (np.full(1000, 0.1), np.full(1000, 0.3)),
        ([1.0], [2.0]),
    ],
)
def test_constant_signals_have_no_correlation_but_an_error(measured, computed):
    fit = fit_measures(measured, computed)
    assert np.isnan([fit.pearson_r, fit.n_effective]).all()
    assert np.isfinite([fit.rmse, fit.schwer_m, fit.schwer_p, fit.schwer_c]).all()


def test_zero_signals_have_no_metric():
    zero = np.zeros(1000)
    fit = fit_measures(zero, SINE)
    assert np.isnan([fit.schwer_m, fit.schwer_p, fit.schwer_c]).all()
    fit = fit_measures(SINE, zero)
    assert fit.schwer_m == -1.0
    assert np.isnan([fit.schwer_p, fit.schwer_c]).all()


# --- posturography --------------------------------------------------------------------------------


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
    ap = np.arange(11) * 1e-3
    ap[6:] += 1.0  # a jump of a metre between the intervals
    ap[5] = np.nan
    sway = posturography(ap, np.zeros(11), RATE_HZ)
    assert sway.sway_length_mm == pytest.approx(8.0)
    assert sway.duration_s == pytest.approx(0.08)
    assert sway.mean_velocity_mm_s == pytest.approx(100.0)
    ap[8] = np.nan
    sway = posturography(ap, np.zeros(11), RATE_HZ)
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
