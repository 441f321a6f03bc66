"""What the ground wrench can show of 150 parameters: 128 combinations."""

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.dynamics.base_parameters import expressions, find_basis
from bsip_cli.dynamics.ground_wrench import pinocchio_model, wrench_regressor
from bsip_cli.segments import SEGMENTS
from tests.body.standing_person import random_states, standing, tilted_person


@pytest.fixture(scope="module", params=["standing", "tilted"])
def model(request):
    person = standing().person if request.param == "standing" else tilted_person()
    return pinocchio_model(person)


def rank_by_gap(matrix):
    """Rank, and the ratio of the last counted singular value to the first that is not."""
    values = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=0), compute_uv=False)
    ratios = values[:-1] / np.maximum(values[1:], 1e-300)
    rank = int(np.argmax(ratios)) + 1
    return rank, ratios[rank - 1]


def test_all_forty_rows_have_the_same_rank_as_six(model):
    data, states = model.createData(), zip(*random_states(model, 40, seed=1), strict=True)
    rows = [pin.computeJointTorqueRegressor(model, data, *state).copy() for state in states]
    for count in (40, 6):
        rank, gap = rank_by_gap(np.concatenate([row[:count] for row in rows]))
        assert rank == 128
        assert gap > 1e6


def test_the_basis_reproduces_the_regressor_at_states_it_never_saw(model):
    basis = find_basis(model)
    assert basis.rank == 128
    assert len(set(basis.independent.tolist())) == 128
    states = random_states(model, 10, seed=2)
    Y = wrench_regressor(model, *states, np.array([0.5, 1.0, 0.0]))
    again = Y[..., basis.independent] @ basis.combine
    np.testing.assert_allclose(again, Y, rtol=0, atol=1e-8 * np.abs(Y).max())
    scale = np.linalg.norm(Y.reshape(-1, 150), axis=0)  # and column by column
    error = np.linalg.norm((again - Y).reshape(-1, 150), axis=0)
    assert np.all(error <= 1e-7 * scale.max())
    np.testing.assert_array_equal(basis.combine[:, basis.independent], np.eye(128))


def test_the_whole_bodys_mass_leads_and_no_other_mass(model):
    """Spherical joints hide the mass beyond them; the masses beyond hinges are hidden as well."""
    basis = find_basis(model)
    assert basis.independent[0] == 0
    assert [k for k in basis.independent if k % 10 == 0] == [0]
    np.testing.assert_allclose(basis.combine[0, ::10], 1.0, atol=1e-8)
    np.testing.assert_allclose(np.delete(basis.combine[0].reshape(15, 10), 0, axis=1), 0, atol=1e-8)


def test_expressions_are_in_words(model):
    segments = standing().person.skeleton.segments
    rows = expressions(find_basis(model), segments)
    names = [name for name, _, _ in rows]
    assert len(set(names)) == len(rows) == 128
    name, expression, unit = rows[0]
    assert (name, unit) == ("m lower_torso", "kg")
    assert expression.startswith("m lower_torso + m upper_torso + m head")
    assert all(f"m {segment}" in expression for segment in SEGMENTS)
    assert expression.count("+") == 14
    units = {name.split()[0]: unit for name, _, unit in rows}
    assert units["mcx"] == "kg m"
    assert units["Ixy"] == "kg m2"
    others = [expression for _, expression, _ in rows[1:]]
    assert any("m head" in one and "+ 0." in one for one in others)  # a mass times a distance
    assert "mcx head" in names  # no mass of the head's own
    assert "m head" not in names
