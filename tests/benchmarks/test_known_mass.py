"""The experiment with known masses, small: the simulator carries them, and they come back."""

import numpy as np
import pytest

from benchmarks import known_mass
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import draw_person


@pytest.mark.parametrize("worn", known_mass.LOADS, ids=lambda worn: worn.name)
def test_the_simulated_body_is_heavier_by_the_load(worn):
    person = draw_person(np.random.default_rng(3), Richness())
    heavier = known_mass.with_load(person, worn)
    before, after = person.inertias[worn.body], heavier.inertias[worn.body]
    load = worn.load
    assert after.mass_kg - before.mass_kg == pytest.approx(load.mass_kg)
    moment = after.mass_kg * after.com_m - before.mass_kg * before.com_m
    np.testing.assert_allclose(moment, load.mass_kg * np.array(load.position_m), atol=1e-12)
    others = {name for name in person.inertias if name != worn.body}
    assert all(heavier.inertias[name] is person.inertias[name] for name in others)


def test_tables_count_what_lies_inside_the_intervals():
    rows = [
        known_mass.Found("load", "method", "mass", value, 0.1, 1.0) for value in (0.95, 1.05, 1.2)
    ]
    assert known_mass.inside(rows) == "2 of 3"
    assert known_mass.mean_of(rows).startswith("1.067 (sd 0.126) ± 0.100")


@pytest.mark.long
def test_one_person(tmp_path):
    rows = list(known_mass.person(tmp_path, seed=7, duration_s=14.0))
    for worn in known_mass.LOADS:
        (found,) = known_mass.chosen(rows, worn.name, "one segment", "mass")
        assert found.value == pytest.approx(worn.load.mass_kg, abs=0.1)
        (total, *_) = known_mass.chosen(rows, worn.name, "hansen2017", "total mass")
        assert total.value == pytest.approx(worn.load.mass_kg, abs=0.1)
    for found in known_mass.chosen(rows, known_mass.NOTHING, "one segment", "mass"):
        assert abs(found.value) < 0.1
    for table in (known_mass.table_differences, known_mass.table_traces):
        assert "nan" not in table(rows * 2)
