"""Segments without markers keep the table's values, whatever the wrench says."""

from __future__ import annotations

import importlib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bsip_cli.body.person import Person
from bsip_cli.dynamics.base_parameters import Basis, find_basis
from bsip_cli.identification.base import base_parameters
from bsip_cli.identification.prior import Prior, prior_of
from bsip_cli.identification.problem import Problem
from bsip_cli.identification.uncertainty import excitation, readable
from tests.body.standing_person import standing
from tests.identification.synthetic_identification import SPREAD, problem_of, regressor, world

ESTIMATORS = ("consistent", "hansen2017", "robert2017", "base")


def without(*labels: str) -> Person:
    """The standing person's geometry, some markers not there."""
    person = standing().person
    kept = np.array([label not in labels for label in person.markers])
    gone = set(np.unique(person.marker_segments)) - set(person.marker_segments[kept])
    held = np.array([i in gone for i in range(len(person.skeleton.segments))])
    return replace(
        person,
        markers=tuple(np.array(person.markers)[kept]),
        marker_segments=person.marker_segments[kept],
        marker_positions_m=person.marker_positions_m[kept],
        marker_weights=person.marker_weights[kept],
        held=held,
    )


@cache
def headless() -> Problem:
    """No markers on the head; its mass is 20 % above the table's, the wrench shows it."""
    prior = prior_of(world().prior.inertias, without("RTEM", "LTEM", "FHEAD"), SPREAD)
    known = prior.fixed_parameters()
    truth = np.where(known, 1.2 * prior.phi, world().phi_true)
    rows = regressor()[::10]
    return with_known(problem_of(rows, rows @ truth, 2.0), prior, find_basis(world().model, known))


def with_known(whole: Problem, prior: Prior, basis: Basis) -> Problem:
    """Once the segments without markers are taken for the table's."""
    equations = whole.equations.with_known(prior.phi, prior.fixed_parameters())
    return replace(whole, equations=equations, prior=prior, basis=basis)


def head() -> int:
    return world().person.skeleton.index("head")


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_head_keeps_the_tables_values(estimator):
    problem = headless()
    estimate = importlib.import_module(f"bsip_cli.identification.{estimator}").estimate(problem)
    found = readable(estimate, problem.prior)
    np.testing.assert_allclose(
        found.values[head()], problem.prior.inertias[head()].readable(), rtol=1e-5, atol=1e-9
    )
    np.testing.assert_allclose(found.share[head()], 0.0, atol=1e-5)
    if estimator == "hansen2017":
        np.testing.assert_allclose(found.sd[head()], problem.prior.readable_sd[head()], rtol=1e-6)
    others = np.delete(found.share, head(), axis=0)
    assert others.max() > 0.5


def test_no_combination_holds_it():
    problem = headless()
    columns = slice(10 * head(), 10 * head() + 10)
    assert not problem.basis.combine[:, columns].any()
    assert problem.basis.rank < world().basis.rank == 128
    found = excitation(problem)
    assert found.combinations[head()] == 0 and found.segment_share[head()] < 1e-9


def test_the_others_explain_what_is_left_of_the_wrench():
    """With the head as the table says, the other combinations come back."""
    prior = headless().prior
    known = prior.fixed_parameters()
    truth = np.where(known, prior.phi, world().phi_true)
    rows = regressor()
    whole = problem_of(rows, rows @ truth, 1.0)
    problem = with_known(whole, prior, headless().basis)
    fit = base_parameters(problem)
    np.testing.assert_allclose(fit.values, problem.basis.combine @ truth, atol=1e-5)
    np.testing.assert_allclose(
        problem.equations.residual_rms(prior.phi),
        whole.equations.residual_rms(prior.phi),
        rtol=1e-6,
    )


def test_who_is_without_data():
    segments = world().person.skeleton.segments

    def lost(*labels: str) -> set[str]:
        return {s for s, one in zip(segments, without(*labels).without_data(), strict=True) if one}

    assert lost() == set()
    assert lost("RTEM", "LTEM", "FHEAD") == {"head"}
    assert lost("RHAND") == {"hand_r"}  # the styloids do not show how it bends
    assert lost("RWRR", "RWRU", "RHAND") == {"hand_r"}


@pytest.mark.parametrize("fixed", [True, False])
def test_the_scale_tells_about_all_that_is_free(fixed):
    person = without("RTEM", "LTEM", "FHEAD")
    known = None if fixed else np.zeros(len(person.skeleton.segments), dtype=bool)
    prior = prior_of(world().prior.inertias, person, SPREAD, known)
    assert prior.fixed[head()] == fixed
    masses = prior.root[::10]
    free = masses[~prior.fixed].sum(axis=0)
    assert 0.9 * prior.total_mass_sd_kg < np.linalg.norm(free) <= prior.total_mass_sd_kg
    assert not fixed or masses[head()] @ free == pytest.approx(0.0, abs=1e-12)
