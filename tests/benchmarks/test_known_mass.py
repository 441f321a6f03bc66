"""The experiment with known masses, small: the simulator carries them, and they come back."""

import pandas as pd
import pytest

from benchmarks import known_mass


def test_tables_count_what_lies_inside_the_intervals():
    values = pd.Series([0.95, 1.05, 1.2])
    rows = pd.DataFrame(
        {"difference": values, "ci_low": values - 0.1, "ci_high": values + 0.1, "truth": 1.0}
    )
    assert known_mass.inside(rows) == "2 of 3"
    assert known_mass.mean_of(rows).startswith("1.067 (sd 0.126) ± 0.100")


@pytest.mark.long
def test_one_person(tmp_path):
    found = list(known_mass.person(tmp_path, seed=7, duration_s=14.0))
    assert [one.carried for one in found] == [True, False] * 3
    for one in found:
        for place in ((known_mass.ONE, one.segment), (known_mass.TWO, "all")):
            mass = one.rows(*place, "m")
            assert known_mass.inside(mass) == "1 of 1", (place, mass)
            assert (mass["ci_high"] - mass["ci_low"] < 0.6).all()
    for table in (known_mass.table_one_segment, known_mass.table_differences):
        assert "nan" not in table(found * 2)
