"""What holds for every test of the package, whatever the data."""

import subprocess
import sys

import numpy as np
import pytest

from bsip_cli.statistics.fit_measures import fit_measures, posturography
from bsip_cli.statistics.hypothesis_tests import (
    equivalence_tost,
    fisher_z_difference,
    one_way_anova,
    paired_t,
    repeated_measures_anova,
    wilcoxon,
    williams_t,
)
from bsip_cli.statistics.samples import lilliefors_test

MODULES = "fit_measures hypothesis_tests samples"
VALUES = [0.0, 0.1, 1 / 3, 2.0, 3.5, -5.0, 1e-40, 1e8, 1e8 + 1e-7, 1e12, np.nan, np.inf]


# What only some tests give.
OWN = {
    paired_t: "mean_a sd_a mean_b sd_b difference ci_low ci_high df1",
    wilcoxon: "difference effect_size",
    equivalence_tost: "difference ci_low ci_high bound df1",
    one_way_anova: "df1 df2 effect_size",
    repeated_measures_anova: "df1 df2 effect_size epsilon",
    williams_t: "difference df1",
    fisher_z_difference: "difference",
    lilliefors_test: "",
}


def answer(test, *arguments):
    """The reason and the numbers that a test should give."""
    result = test(*arguments)
    result = result[0] if isinstance(result, tuple) else result
    names = ("statistic", "p_value", *OWN[test].split())
    return result.reason, [getattr(result, name) for name in names]


def assert_defined_where_it_can_be(x, y):
    """Errors and paths exist wherever there are samples; they know no test and give no reason."""
    there = int(np.isfinite(x + y).sum())
    fit, sway = fit_measures(x, y, body_weight_N=700.0), posturography(x, y, 100.0)
    assert fit.n == sway.n == there
    assert np.isfinite([fit.rmse, fit.rmse_percent_bw, sway.rms_ap_mm]).all() == (there > 0)
    assert np.isfinite(sway.ellipse_area_mm2) == (there > 2)


@pytest.mark.parametrize("seed", range(150))
def test_any_data_gives_all_numbers_or_a_reason(seed):
    """Constant, tied, empty, huge, missing: never an exception, a warning or a silent nan."""
    rng = np.random.default_rng(seed)
    values = rng.choice(VALUES, rng.integers(1, len(VALUES) + 1))
    x, y, z = rng.choice(values, (3, rng.integers(0, 14)))
    if seed % 3 == 0:
        y = x * (1 + rng.choice([0, 1e-15, 1e-9])) + rng.choice([0, 0.1])
    assert_defined_where_it_can_be(x, y)
    answers = [
        answer(lilliefors_test, x),
        answer(paired_t, x, y),
        answer(wilcoxon, x, y),
        answer(equivalence_tost, x, y, 0.5),
        answer(one_way_anova, [x, y, z]),
        answer(repeated_measures_anova, np.column_stack([x, y, z])),
        answer(
            williams_t,
            *rng.choice([-1, -0.9, 0, 0.9, 1 - 1e-13, 1, np.nan], 3),
            rng.choice([3, 9.5]),
        ),
        answer(fisher_z_difference, rng.choice([-1, 0.3, np.nan]), 0.5, rng.choice([3, 12])),
    ]
    for reason, numbers in answers:
        assert reason or not np.isnan(numbers).any(), numbers


def test_statsmodels_is_imported_only_when_needed():
    code = "import sys\n" + "".join(
        f"import bsip_cli.statistics.{module}\n" for module in MODULES.split()
    )
    code += "assert 'statsmodels' not in sys.modules and 'pandas' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
