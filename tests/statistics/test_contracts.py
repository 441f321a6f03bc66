"""What holds for every test of the package, whatever the data."""

import subprocess
import sys
from dataclasses import astuple

import numpy as np
import pytest

from bsip_cli.statistics.cohort_groups import one_way_anova, repeated_measures_anova
from bsip_cli.statistics.correlation_tests import fisher_z_difference, williams_t
from bsip_cli.statistics.fit_measures import fit_measures
from bsip_cli.statistics.paired_tests import equivalence_tost, paired_t, wilcoxon
from bsip_cli.statistics.posturography import posturography
from bsip_cli.statistics.samples import lilliefors_test

MODULES = "cohort_groups correlation_tests fit_measures paired_tests posturography samples"
VALUES = [0.0, 0.1, 1 / 3, 2.0, 3.5, -5.0, 1e-40, 1e8, 1e8 + 1e-7, 1e12, np.nan, np.inf]


def has_nan(result) -> bool:
    return any(isinstance(value, float) and np.isnan(value) for value in astuple(result))


@pytest.mark.parametrize("seed", range(150))
def test_any_data_gives_all_numbers_or_a_reason(seed):
    """Constant, tied, empty, huge, missing: never an exception, a warning or a silent nan."""
    rng = np.random.default_rng(seed)
    values = rng.choice(VALUES, rng.integers(1, len(VALUES) + 1))
    x, y, z = rng.choice(values, (3, rng.integers(0, 14)))
    if seed % 3 == 0:
        y = x * (1 + rng.choice([0, 1e-15, 1e-9])) + rng.choice([0, 0.1])
    results = [
        lilliefors_test(x),
        paired_t(x, y),
        wilcoxon(x, y),
        equivalence_tost(x, y, 0.5),
        one_way_anova([x, y, z]),
        repeated_measures_anova(np.column_stack([x, y, z])),
        fit_measures(x, y, body_weight_N=700.0),
        posturography(x, y, 100.0),
        williams_t(*rng.choice([-1, -0.9, 0, 0.9, 1 - 1e-13, 1, np.nan], 3), rng.choice([3, 9.5])),
        fisher_z_difference(rng.choice([-1, 0.3, np.nan]), 9.5, 0.5, rng.choice([3, 12])),
    ]
    for result in results:
        assert bool(result.reason) or not has_nan(result), result


def test_statsmodels_is_imported_only_when_needed():
    code = "import sys\n" + "".join(
        f"import bsip_cli.statistics.{module}\n" for module in MODULES.split()
    )
    code += "assert 'statsmodels' not in sys.modules and 'pandas' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
