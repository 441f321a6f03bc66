"""Two recordings of one person: what changed, and intervals that hold it."""

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.body.person import load_parameters
from bsip_cli.identification.difference import change_of_segments, difference
from bsip_cli.identification.problem import Estimate, Problem
from tests.identification.synthetic_identification import problem_of, regressor, remeasured, world

NOISE = np.array([10.0, 10.0, 10.0, 5.0, 5.0, 5.0])
DRAWS = 200
SHANK = "shank_r"


def gaussian(problem: Problem) -> Estimate:
    """Posterior mean and covariance under the prior: the linear case the formulae are exact for."""
    information, right = problem.equations.weighted(problem.noise.weights())
    root = problem.prior.root
    inner = np.linalg.inv(np.eye(len(root)) + root.T @ information @ root)
    step = root @ inner @ root.T @ (right - information @ problem.prior.phi)
    return Estimate(problem.prior.phi + step, root @ inner @ root.T, "")


def load_phi() -> np.ndarray:
    return load_parameters([(SHANK, 1.0, (0.02, -0.2, 0.03))], world().person)


def draws(seeds: tuple[int, int]):
    """Pairs of problems: a person drawn from the prior, in b with the load, both with noise."""
    rng = np.random.default_rng(4)
    rows = [regressor(20.0, seed) for seed in seeds]
    empty = [problem_of(r, np.zeros(r.shape[:2]), NOISE) for r in rows]
    root = world().prior.root
    for _ in range(DRAWS):
        person = world().prior.phi + root @ rng.standard_normal(len(root))
        pair = []
        for r, phi, problem in zip(rows, (person, person + load_phi()), empty, strict=True):
            measured = r @ phi + NOISE * rng.standard_normal(r.shape[:2])
            equations = remeasured(problem.equations, r, measured)
            pair.append(replace(problem, equations=equations))
        yield tuple(pair)


@pytest.mark.parametrize("seeds", [(1, 1), (1, 2)])
def test_intervals_of_a_difference_hold_what_is_resolved_of_the_change(seeds):
    root = world().prior.root
    n = len(root) // 10
    directions = np.zeros((4, 10 * n))
    i = 10 * world().person.skeleton.index(SHANK)
    directions[0, ::10] = 1.0
    directions[[1, 2, 3], [i, i + 1, i + 2]] = 1.0
    scores = []
    for a, b in draws(seeds):
        found = difference(gaussian(a), gaussian(b), root @ root.T)
        sd = np.sqrt(np.einsum("ki,ij,kj->k", directions, found.covariance, directions))
        scores.append(directions @ (found.phi - found.resolution @ load_phi()) / sd)
    np.testing.assert_allclose(np.std(scores, axis=0), 1.0, atol=0.15)
    np.testing.assert_allclose(np.mean(scores, axis=0), 0.0, atol=0.25)


def test_the_same_motion_knows_the_difference_better_than_either_value():
    a, b = next(draws((1, 1)))
    root = world().prior.root
    first, second = gaussian(a), gaussian(b)
    found = difference(first, second, root @ root.T)
    masses = slice(None, None, 10)
    both = np.diag(first.covariance + second.covariance)[masses]
    assert (np.diag(found.covariance)[masses] < 0.5 * both).all()


def test_a_segments_own_mass_is_blurred_and_the_total_is_not():
    a, b = next(draws((1, 2)))
    root = world().prior.root
    found = difference(gaussian(a), gaussian(b), root @ root.T)
    seen = found.resolution @ load_phi()
    assert abs(seen[::10].sum() - 1.0) < 0.01
    assert seen[10 * world().person.skeleton.index(SHANK)] < 0.98


def test_change_of_one_segment_returns_the_load_within_its_interval():
    i = world().person.skeleton.index(SHANK)
    truth = load_phi()[10 * i : 10 * i + 10]
    found = [change_of_segments(a, b, [i]) for a, b in draws((1, 2))]
    scores = [(f.phi - truth) / np.sqrt(np.diag(f.covariance)) for f in found]
    np.testing.assert_allclose(np.std(scores, axis=0), 1.0, atol=0.15)
    np.testing.assert_allclose(np.mean(scores, axis=0), 0.0, atol=0.25)
    assert np.sqrt(found[0].covariance[0, 0]) < 0.05


def test_nothing_is_resolved_of_a_segment_that_keeps_the_table():
    fixed = np.repeat(np.arange(15) == world().person.skeleton.index("head"), 10)
    root = np.where(fixed[:, None] | fixed, 0.0, world().prior.root)
    a, b = (
        gaussian(replace(problem, prior=replace(problem.prior, root=root)))
        for problem in next(draws((1, 2)))
    )
    found = difference(a, b, root @ root.T)
    assert not found.covariance[fixed].any() and not found.resolution[fixed].any()
    assert np.isfinite(found.phi).all() and (np.diag(found.covariance)[~fixed] > 0).all()
