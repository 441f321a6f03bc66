import numpy as np
import pytest
from scipy.stats import pearsonr

from bsip_cli.statistics.fit_measures import fit_measures

PHASE = 2 * np.pi * np.arange(1000) / 100  # ten whole periods
SINE = np.sin(PHASE)


def test_equal_signals():
    fit = fit_measures(SINE, SINE, body_weight_N=700.0)
    assert (fit.rmse, fit.rmse_percent_bw) == (0.0, 0.0)
    assert fit.pearson_r == pytest.approx(1.0)
    assert (fit.schwer_m, fit.schwer_p, fit.schwer_c) == (0.0, 0.0, 0.0)
    assert fit.n == 1000


def test_scaled_signal_is_an_error_of_magnitude_only():
    fit = fit_measures(SINE, 1.1 * SINE)
    assert fit.schwer_m == pytest.approx(0.1, abs=1e-12)
    assert fit.schwer_p == pytest.approx(0.0, abs=1e-12)
    assert fit.schwer_c == pytest.approx(0.1, abs=1e-12)


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


def test_only_finite_samples_of_the_stretches_count():
    spoilt = SINE.copy()
    spoilt[200:300] = 50.0
    spoilt[10] = np.nan
    fit = fit_measures(SINE, spoilt, [(0, 200), (300, 1000)])
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
