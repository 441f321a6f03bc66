from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.body.inertia import PARAMETERS, from_phi, readable_jacobian, readable_jacobians
from bsip_cli.identification.prior import prior_of
from bsip_cli.identification.problem import Estimate, noise_of
from bsip_cli.identification.uncertainty import readable
from bsip_cli.stages.identification_problem import spread_from
from tests.identification.synthetic_identification import SPREAD, world


def ar1(a, count, seed):
    white = np.random.default_rng(seed).normal(size=(count + 200, 6))
    return lfilter([1.0], [1.0, -a], white, axis=0)[200:]


def even(residual):
    """As if the accelerations were equally noisy throughout."""
    return residual, np.ones(len(residual))


@pytest.mark.parametrize("a", [0.0, 0.5, 0.9])
def test_memory_of_the_residuals_reduces_the_samples(a):
    noise = noise_of([even(ar1(a, 6000, seed=1))])
    assert noise.samples == 6000
    assert np.mean(noise.effective) == pytest.approx(6000 * (1 - a) / (1 + a), rel=0.15)
    np.testing.assert_allclose(noise.rms, np.sqrt(1 / (1 - a**2)), rtol=0.1)


def test_weights_count_independent_samples():
    noise = noise_of([even(ar1(0.9, 6000, seed=2) * [1, 2, 3, 4, 5, 6])])
    expected = noise.effective / 6000 / noise.rms**2
    np.testing.assert_allclose(noise.weights(), expected)
    np.testing.assert_allclose(noise.weights() * noise.rms**2, 0.1 / 1.9, rtol=0.3)


def test_intervals_do_not_run_into_each_other():
    """Two long intervals with a jump between: the same as one series of both, not less."""
    parts = [ar1(0.5, 3000, seed=3), ar1(0.5, 3000, seed=4)]
    apart, joined = noise_of([even(p) for p in parts]), noise_of([even(np.concatenate(parts))])
    np.testing.assert_allclose(apart.rms, joined.rms)
    np.testing.assert_allclose(apart.effective, joined.effective, rtol=0.1)


def test_degenerate_residuals_keep_finite_weights():
    for series in (np.zeros((50, 6)), np.ones((2, 6))):
        noise = noise_of([even(series)])
        assert np.isfinite(noise.weights()).all()
        assert np.all(noise.effective >= 1)


def test_fast_frames_count_less():
    """Noise of 1 everywhere and 2 per unit of level, found back, and the weights undo it."""
    rng = np.random.default_rng(6)
    level = rng.uniform(0.1, 3.0, 8000)
    spread = np.sqrt(1.0 + 4.0 * level**2)
    noise = noise_of([(spread[:, None] * rng.normal(size=(8000, 6)), level)])
    np.testing.assert_allclose(noise.steady, 1.0, rtol=0.25)
    np.testing.assert_allclose(noise.with_level, 2.0, rtol=0.1)
    weights = noise.weights_at(level)
    np.testing.assert_allclose(weights.mean(axis=0), 1.0, rtol=1e-9)
    np.testing.assert_allclose(weights * spread[:, None] ** 2 / noise.rms**2, 1.0, rtol=0.3)


def test_the_priors_mean_is_rm_about_the_joints():
    prior = world().prior
    for i, inertia in enumerate(prior.inertias):
        back = from_phi(prior.phi[10 * i : 10 * i + 10]).moved(prior.origin_in_joint_m[i])
        np.testing.assert_allclose(back.readable(), inertia.readable(), rtol=0, atol=1e-12)
    torso = world().person.skeleton.index("upper_torso")
    assert np.linalg.norm(prior.origin_in_joint_m[torso]) > 0.3  # the neck, from the waist


def scatter(draws=4000):
    """(draws, 15, 10) readable parameters of small draws phi = mean + S z, a thousandth of S."""
    z = np.random.default_rng(5).normal(0, 1e-3, (draws, 150))
    phi = (z @ world().prior.root.T + world().prior.phi).reshape(draws, 15, 10)
    return np.array([[from_phi(segment).readable() for segment in one] for one in phi])


def test_the_priors_spread_is_that_of_the_options():
    prior, person = world().prior, world().person
    sd = scatter().std(axis=0) * 1e3
    masses = np.array([body.mass_kg for body in prior.inertias])
    alone, scale = 0.20 * masses, 0.03 * masses.sum()
    # Masses spread by 20 % each before their sum is known to 3 %: conditional variance.
    known = alone**2 - alone**4 / ((alone**2).sum() + scale**2)
    np.testing.assert_allclose(sd[:, 0], np.sqrt(known), rtol=0.05)
    rods = np.sqrt([6 * np.trace(b.tensor_kgm2) / b.mass_kg for b in prior.inertias])
    centres = 0.06 * rods[:, None] * np.ones(3)
    torso = person.skeleton.index("upper_torso")  # the table's editions disagree about it
    centres[torso, 0] = np.hypot(centres[torso, 0], 0.019)
    np.testing.assert_allclose(sd[:, 1:4], centres, rtol=0.05)
    limbs = [person.skeleton.index(f"{name}_l") for name in ("thigh", "shank", "forearm")]
    np.testing.assert_allclose(rods[limbs], person.lengths_m[limbs], rtol=0.12)
    moments = np.array([np.diag(body.tensor_kgm2) for body in prior.inertias])
    # A tensor strays on its own, and with its segment's mass.
    part = np.sqrt(known)[:, None] / masses[:, None]
    np.testing.assert_allclose(sd[:, 4:7], np.hypot(0.30, part) * moments, rtol=0.05)
    sizes = np.sqrt(moments[:, [0, 0, 1]] * moments[:, [1, 2, 2]])
    products = np.array([body.readable()[7:] for body in prior.inertias])
    own = 0.15 * sizes
    own[torso, 0] = np.hypot(own[torso, 0], products[torso, 0])
    np.testing.assert_allclose(sd[:, 7:], np.hypot(own, part * products), rtol=0.05)
    np.testing.assert_allclose(sd, prior.readable_sd, rtol=0.05)


def test_only_masses_and_tensors_hang_together_and_the_masses_sum_is_the_scales():
    read = scatter()
    alone = 0.20 * np.array([body.mass_kg for body in world().prior.inertias])
    scale = 0.03 * sum(body.mass_kg for body in world().prior.inertias)
    total = read[:, :, 0].sum(axis=1).std() * 1e3
    assert total == pytest.approx((1 / (alone**2).sum() + 1 / scale**2) ** -0.5, rel=0.05)
    correlation = np.corrcoef(read.reshape(len(read), -1).T)
    centres = [10 * segment + k for segment in range(15) for k in (1, 2, 3)]
    apart = correlation[centres] - np.eye(150)[centres]
    assert np.abs(apart).max() < 5 / np.sqrt(len(read))
    torso, thigh = (10 * world().person.skeleton.index(s) for s in ("upper_torso", "thigh_l"))
    assert correlation[torso, thigh] < -0.2


def test_left_and_right_go_together_and_the_midline_is_not_lopsided():
    spread = replace(SPREAD, left_right_correlation=0.93, midline_sd_m=0.005)
    person, bodies = world().person, world().prior.inertias
    prior = prior_of(bodies, person, spread)
    read = readable_jacobians(prior.phi) @ prior.root
    covariance = read @ read.T
    correlation = covariance / np.sqrt(np.outer(*[np.diag(covariance)] * 2))
    left, right = (10 * person.skeleton.index(f"shank_{side}") for side in "lr")
    together = correlation[range(left, left + 10), range(right, right + 10)]
    mirrored = np.array([1, 1, 1, -1, 1, 1, 1])  # mass, centre, moments
    np.testing.assert_allclose(together[1:7] * mirrored[1:], 0.93, atol=0.05)
    for name in ("lower_torso", "upper_torso", "head"):
        i = person.skeleton.index(name)
        assert prior.readable_sd[i, 3] == pytest.approx(0.005, rel=1e-6)


def test_a_limb_without_markers_leaves_its_twin_alone():
    fixed = np.zeros(15, dtype=bool)
    fixed[world().person.skeleton.index("hand_l")] = True
    spread = replace(SPREAD, left_right_correlation=0.93)
    prior = prior_of(world().prior.inertias, world().person, spread, fixed)
    hands = [world().person.skeleton.index(f"hand_{side}") for side in "lr"]
    covariance = prior.root @ prior.root.T
    first, second = (slice(10 * hand, 10 * hand + 10) for hand in hands)
    assert np.abs(covariance[first, second]).max() < 1e-12
    assert all((hand,) in prior.pairs for hand in hands)


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


def test_an_origin_off_its_anatomy_widens_centres_alone_and_each_side_for_itself():
    alike = replace(SPREAD, left_right_correlation=0.93)
    sure = prior_of(world().prior.inertias, world().person, alike)
    off = prior_of(world().prior.inertias, world().person, replace(alike, origin_sd_m=0.008))
    centres = np.hypot(sure.readable_sd[:, 1:4], 0.008)
    np.testing.assert_allclose(off.readable_sd[:, 1:4], centres, rtol=1e-6)
    np.testing.assert_allclose(off.readable_sd[:, 0], sure.readable_sd[:, 0], rtol=1e-6)
    np.testing.assert_allclose(off.readable_sd[:, 4:], sure.readable_sd[:, 4:], rtol=1e-6)
    left, right = (10 * world().person.skeleton.index(f"forearm_{side}") for side in "lr")
    covariance = off.root @ off.root.T
    jacobians = [readable_jacobian(off.phi[k : k + 10])[1:4] for k in (left, right)]
    both = jacobians[0] @ covariance[left : left + 10, right : right + 10] @ jacobians[1].T
    sides = [sure.readable_sd[k // 10, 1:4] for k in (left, right)]
    people = 0.93 * sides[0] * sides[1] * np.array([1, 1, -1])
    np.testing.assert_allclose(np.diag(both), people, rtol=1e-3)


def test_forces_tell_nothing_of_an_origin_off_its_anatomy():
    prior = replace(world().prior, origin_sd_m=0.008)
    covariance = prior.root @ prior.root.T
    sure = readable(Estimate(prior.phi, 0 * covariance, ""), prior)
    np.testing.assert_allclose(sure.sd[:, 1:4], 0.008)
    np.testing.assert_allclose(np.delete(sure.sd, (1, 2, 3), axis=1), 0.0, atol=1e-12)


def test_people_may_be_of_another_table_in_all_segments_together():
    """A covariance more, along what the other table differs by; no number of its own changes."""
    bodies, person = world().prior.inertias, world().person
    percent = np.zeros((len(bodies), 2))
    names = list(person.skeleton.body_names)
    thighs, pelvis = [names.index(f"thigh_{side}") for side in "lr"], names.index("lower_torso")
    percent[thighs], percent[pelvis] = [14.0, 1.8], [-9.0, 0.0]
    free = replace(SPREAD, total_mass_sd_percent=1e6)
    alone = prior_of(bodies, person, free)
    both = prior_of(bodies, person, replace(free, other_table_percent=percent, other_table_sd=0.5))
    more = both.root @ both.root.T - alone.root @ alone.root.T
    values, vectors = np.linalg.eigh(more)
    assert np.abs(values[:-1]).max() < 1e-9 * values[-1]
    assert both.white @ both.root == pytest.approx(np.eye(len(more)), abs=1e-6)
    mass = vectors[::10, -1] * np.sqrt(values[-1])
    expected = [0.5 * percent[i, 0] / 100 * bodies[i].mass_kg for i in (*thighs, pelvis)]
    assert np.abs(mass[[*thighs, pelvis]]) == pytest.approx(np.abs(expected), rel=1e-6)
    assert mass[thighs[0]] * mass[pelvis] < 0 < mass[thighs[0]] * mass[thighs[1]]


def test_what_tables_differ_by_counts_once():
    """What all segments share and what each has of its own make the difference over sqrt(2)."""
    options = {"other_table_sd": 0.5, "midline_sd_m": 0.005, "left_right_correlation": 0.9}
    prior = SimpleNamespace(model_dump=lambda: options | {"total_mass_sd_percent": 3.0})
    unit = SimpleNamespace(config=SimpleNamespace(prior=prior))
    people, differ = np.array([7.0, 1.0]), np.array([14.0, -11.0])
    mass, along = np.sqrt(people**2 + differ**2 / 2)
    spread = spread_from(unit, np.array([[mass, 3.0, along, 3.0, 20.0, *differ]]))
    own = np.array([spread.mass_sd_percent[0], spread.com_sd_percent[0, 1]])
    np.testing.assert_allclose(own**2 + (0.5 * differ) ** 2, people**2 + differ**2 / 2)
    assert spread.com_sd_percent[0].tolist()[::2] == [3.0, 3.0]
