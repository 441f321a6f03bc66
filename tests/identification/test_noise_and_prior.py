import numpy as np
import pytest
from scipy.signal import lfilter
from synthetic_identification import SPREAD, world

from bsip_cli.body.inertia import PARAMETERS, from_phi
from bsip_cli.identification.estimator import Estimate
from bsip_cli.identification.noise import noise_of
from bsip_cli.identification.uncertainty import readable


def ar1(a, count, seed):
    white = np.random.default_rng(seed).normal(size=(count + 200, 6))
    return lfilter([1.0], [1.0, -a], white, axis=0)[200:]


@pytest.mark.parametrize("a", [0.0, 0.5, 0.9])
def test_memory_of_the_residuals_reduces_the_samples(a):
    noise = noise_of([ar1(a, 6000, seed=1)])
    assert noise.samples == 6000
    assert np.mean(noise.effective) == pytest.approx(6000 * (1 - a) / (1 + a), rel=0.15)
    np.testing.assert_allclose(noise.rms, np.sqrt(1 / (1 - a**2)), rtol=0.1)


def test_weights_count_independent_samples():
    noise = noise_of([ar1(0.9, 6000, seed=2) * [1, 2, 3, 4, 5, 6]])
    expected = noise.effective / 6000 / noise.rms**2
    np.testing.assert_allclose(noise.weights(), expected)
    np.testing.assert_allclose(noise.weights() * noise.rms**2, 0.1 / 1.9, rtol=0.3)


def test_stretches_do_not_run_into_each_other():
    """Two long stretches with a jump between: the same as one series of both, not less."""
    parts = [ar1(0.5, 3000, seed=3), ar1(0.5, 3000, seed=4)]
    apart, joined = noise_of(parts), noise_of([np.concatenate(parts)])
    np.testing.assert_allclose(apart.rms, joined.rms)
    np.testing.assert_allclose(apart.effective, joined.effective, rtol=0.1)


def test_degenerate_residuals_keep_finite_weights():
    for series in (np.zeros((50, 6)), np.ones((2, 6))):
        noise = noise_of([series])
        assert np.isfinite(noise.weights()).all()
        assert np.all(noise.effective >= 1)


def test_the_priors_mean_is_rm_about_the_joints():
    prior = world().prior
    for i, inertia in enumerate(prior.inertias):
        back = from_phi(prior.phi[10 * i : 10 * i + 10]).moved(prior.origin_in_joint_m[i])
        np.testing.assert_allclose(back.readable(), inertia.readable(), rtol=0, atol=1e-12)
    torso = world().person.skeleton.index("upper_torso")
    assert np.linalg.norm(prior.origin_in_joint_m[torso]) > 0.3  # the neck, from the waist


def test_the_priors_spread_is_that_of_the_options():
    """Small draws phi = mean + S z scatter as the options say, in what people read."""
    prior, person = world().prior, world().person
    draws = np.random.default_rng(5).normal(0, 1e-3, (4000, 150)) @ prior.root.T + prior.phi
    for name in ("head", "upper_torso", "thigh_l", "hand_r"):
        i = person.skeleton.index(name)
        read = np.array([from_phi(row).readable() for row in draws[:, 10 * i : 10 * i + 10]])
        sd = read.std(axis=0) * 1e3
        body, length = prior.inertias[i], person.lengths_m[i]
        moments = np.diag(body.tensor_kgm2)
        np.testing.assert_allclose(sd[0], 0.20 * body.mass_kg, rtol=0.05)
        np.testing.assert_allclose(sd[1:4], 0.06 * length, rtol=0.05)
        np.testing.assert_allclose(sd[4:7], 0.30 * moments, rtol=0.05)
        xy = 0.5 * 0.30 * np.sqrt(moments[0] * moments[1])
        np.testing.assert_allclose(sd[7], xy, rtol=0.05)
        np.testing.assert_allclose(sd, prior.readable_sd[i], rtol=0.05)
    assert SPREAD.mass_sd_percent == 20.0


def test_segments_spread_independently():
    covariance = world().prior.root @ world().prior.root.T
    for i in range(15):
        block = slice(10 * i, 10 * i + 10)
        outside = covariance[block].copy()
        outside[:, block] = 0.0
        assert not outside.any()


def test_no_data_no_share_and_all_data_all_share():
    prior = world().prior
    covariance = prior.root @ prior.root.T
    same = readable(Estimate(prior.phi, covariance, ""), prior)
    np.testing.assert_allclose(same.share, 0.0, atol=1e-9)
    np.testing.assert_allclose(same.sd, prior.readable_sd, rtol=1e-6)
    half = readable(Estimate(prior.phi, 0.25 * covariance, ""), prior)
    np.testing.assert_allclose(half.share, 0.75, rtol=1e-6)
    sure = readable(Estimate(prior.phi, 0 * covariance, ""), prior)
    np.testing.assert_array_equal(sure.share, 1.0)
    for i, inertia in enumerate(prior.inertias):
        np.testing.assert_allclose(same.values[i], inertia.readable(), atol=1e-12)
    assert same.values.shape == same.sd.shape == (15, len(PARAMETERS))
