"""Plates aside and late are unknowns beside the body."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bsip_cli.dynamics.ground_wrench import predicted_wrench
from bsip_cli.identification.consistent import estimate, fit_with_weights, terms_of
from bsip_cli.identification.problem import (
    INSTRUMENT_COUNT,
    Instruments,
    Problem,
    accumulate,
    even_noise,
)
from tests.identification.synthetic_identification import RATE_HZ, recording, regressor, world

ASIDE_M, LATE_S = 0.03, 0.02
ERRING = Instruments(place_sd_m=0.005, delay_sd_s=0.003, phi=world().prior.phi)


def test_columns_are_what_a_moved_and_a_late_plate_would_read():
    rows = regressor(stride=1)[:200]
    wrench = rows @ ERRING.phi
    place, late = ERRING.columns(rows, RATE_HZ)[..., :2], ERRING.columns(rows, RATE_HZ)[..., 2]
    assert place.shape[-1] + 1 == INSTRUMENT_COUNT
    for axis in range(2):
        moved = wrench.copy()  # the same force through a point further along
        moved[:, 3:] += np.cross(0.005 * np.eye(3)[axis], wrench[:, :3])
        np.testing.assert_allclose(place[..., axis], moved - wrench, atol=1e-12)
    frames = np.arange(2, 198)
    earlier = CubicSpline(np.arange(200), wrench)(frames - 0.003 * RATE_HZ) - wrench[frames]
    for component in range(6):
        slope, *_ = np.polyfit(earlier[:, component], late[frames, component], 1)
        assert slope == pytest.approx(1.0, abs=0.1)


def problem_with(change, beside):
    """A table's body whose forces a fault of the instruments has changed."""
    one = recording(20.0, phi=world().prior.phi)
    one = replace(one, wrench=change(one.wrench))
    model, phi = world().model, world().prior.phi
    reference = np.append(one.q[:, :2].mean(axis=0), 0.0)
    joint = accumulate(model, [one], 8.0, reference, instruments=ERRING)
    noise = even_noise(np.array([3.0, 3, 3, 1, 1, 1]), joint.samples)
    body = joint.of_the_body(len(phi))
    return Problem(
        body, noise, world().prior, world().basis, 4.0, jointly=joint if beside else None
    )


def aside(wrench):
    moved = wrench.copy()
    moved[:, 3:] += np.cross([0.0, ASIDE_M, 0.0], wrench[:, :3])
    return moved


def late(wrench):
    frames = np.arange(len(wrench)) - LATE_S * RATE_HZ
    return np.stack([np.interp(frames, np.arange(len(wrench)), c) for c in wrench.T], axis=1)


@pytest.mark.parametrize(
    ("fault", "shown", "part"), [(aside, np.s_[3::10], 0.01), (late, np.s_[::10], 0.7)]
)
def test_the_body_does_not_take_up_what_the_plates_do(fault, shown, part):
    table = world().prior.phi
    alone, spared = (estimate(problem_with(fault, with_it)).phi for with_it in (False, True))
    taken, kept = (np.abs(phi - table)[shown].max() for phi in (alone, spared))
    assert kept < part * taken


def test_a_body_of_the_table_stays_one_without_a_fault():
    found = estimate(problem_with(lambda wrench: wrench, True)).phi
    assert np.abs(found[::10] - world().prior.phi[::10]).max() < 0.2
    model, q = world().model, recording(2.0).q
    still = [np.zeros((len(q), model.nv))] * 2
    wrench = predicted_wrench(model, q, *still, found[:, None], np.zeros(3))[..., 0]
    expected = predicted_wrench(model, q, *still, world().prior.phi[:, None], np.zeros(3))[..., 0]
    np.testing.assert_allclose(wrench[:, 2], expected[:, 2], rtol=0.005)


def test_decided_parameters_are_those_of_the_body():
    """What the data tell of plates and clock does not count: the trace of the body alone."""
    terms = terms_of(problem_with(aside, True))
    fit = fit_with_weights(terms)
    before, after = (
        terms.shown @ one @ terms.shown.T for one in (fit.prior_covariance, fit.optimum.covariance)
    )
    scale = np.sqrt(np.diag(before))
    kept = np.trace(
        np.linalg.solve(before / np.outer(scale, scale), after / np.outer(scale, scale))
    )
    assert fit.decided == pytest.approx(len(before) - kept, abs=0.01)
    whole = np.trace(np.linalg.solve(fit.prior_covariance, fit.optimum.covariance))
    assert 1 < len(fit.prior_covariance) - whole - fit.decided < INSTRUMENT_COUNT
