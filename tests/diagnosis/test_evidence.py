"""In the evidence's coordinates a null is white noise of variance 1, and an effect is not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.diagnosis.evidence import TrialEvidence, trial_evidence

RATE_HZ, COUNT = 50.0, 3000
GAP = slice(1000, 1150)
ARRAYS = ("times_s", "valid", "q", "measured", "predicted")


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Null (N, 6) of autocorrelated noise that is twice as large in fast frames, and of nuisances
    (N, 6, m) of unit variance; the frames' noise level (N,)."""
    rng = np.random.default_rng(seed)
    level = 1.0 + (np.sin(np.arange(COUNT) / 200) > 0)
    noise = lfilter([1.0], [1.0, -0.94], rng.normal(size=(COUNT, 6)), axis=0)
    slow = lfilter([1.0], [1.0, -0.98], rng.normal(size=(COUNT, 6, 5)), axis=0)
    return noise * level[:, None] + slow @ rng.normal(size=5), slow, level


def scene_of(measured: np.ndarray, rate_hz: float = RATE_HZ, mass_kg: float = 1.0):
    """As much of a scene as the evidence looks at: nobody moves, and a gap is not valid."""
    count = len(measured)
    valid = np.ones(count, dtype=bool)
    valid[GAP] = False
    scene = SimpleNamespace(
        times_s=np.arange(count) / rate_hz,
        rate_hz=rate_hz,
        valid=valid,
        q=np.zeros((count, 7)),
        measured=measured,
        predicted=np.zeros((count, 6)),
        mass_kg=mass_kg,
    )
    scene.every = lambda stride: scene
    scene.once = lambda key, make: make()
    return scene


def evidence(seed: int, more: np.ndarray | float = 0.0, mass_kg: float = 1.0) -> TrialEvidence:
    """Three of the nuisances are the trial's own, two are shared."""
    null, nuisances, level = drawn(seed)
    own, shared = nuisances[..., :3], nuisances[..., 3:]
    return trial_evidence("a", scene_of(null + more, mass_kg=mass_kg), own, shared, level, 8.0)


def without_shared(one: TrialEvidence) -> np.ndarray:
    """The white residual, the shared nuisances a random effect too."""
    left, sizes, _ = np.linalg.svd(one.shared, full_matrices=False)
    return one.residual - left @ ((1 - 1 / np.sqrt(1 + sizes**2)) * (left.T @ one.residual))


def score(one: TrialEvidence, signature: np.ndarray) -> float:
    white = one.white(signature[..., None])[:, 0]
    return white @ one.residual / np.linalg.norm(white)


def swing(size: float) -> np.ndarray:
    """(N, 6) of the vertical force."""
    t = np.arange(COUNT) / RATE_HZ
    return size * np.sin(2 * np.pi * 1.3 * t)[:, None] * np.eye(6)[2]


@pytest.mark.parametrize("seed", range(4))
def test_a_null_is_white(seed):
    series = without_shared(evidence(seed)).reshape(-1, 6)
    assert np.std(series) == pytest.approx(1.0, abs=0.1)
    for component in series.T:
        neighbours = np.corrcoef(component[1:], component[:-1])[0, 1]
        assert abs(neighbours) < 4 / np.sqrt(len(component))
    assert np.abs(np.corrcoef(series.T) - np.eye(6)).max() < 0.15


def test_signatures_of_nothing_score_as_chance_has_it():
    """The score of a random signature is a standard normal."""
    rng = np.random.default_rng(8)
    signatures = lfilter([1.0], [1.0, -0.96], rng.normal(size=(COUNT, 6, 200)), axis=0)
    scores = []
    for seed in range(3):
        found = evidence(seed)
        white = found.white(signatures)
        scores.append(white.T @ without_shared(found) / np.linalg.norm(white, axis=0))
    assert np.std(scores) == pytest.approx(1.0, abs=0.12)


def test_an_effect_stands_out_and_a_nuisance_does_not():
    effect = swing(4.0)
    found = evidence(1, effect)
    white = found.white(effect[..., None])[:, 0]
    assert score(found, effect) > 6
    assert white @ found.residual / (white @ white) == pytest.approx(1.0, abs=0.4)
    own = drawn(1)[1][..., 0]
    assert abs(score(found, own)) < 4
    far = evidence(1, 3 * own)
    assert abs(score(far, own)) < 6 < np.linalg.norm(far.filtered.filter(3 * own[..., None]))


def test_beside_a_known_effect_the_noise_is_smaller():
    """A large effect is taken for noise until it is known."""
    effect = swing(60.0) * (np.arange(COUNT) % 400 < 200)[:, None]
    found = evidence(1, effect)
    known = found.with_noise_beside(found.filtered.filter.one(effect))
    clean = evidence(1)
    apart = known.whitening.spread[:, 2] / clean.whitening.spread[:, 2]
    np.testing.assert_allclose(apart, 1.0, atol=0.02)
    assert (found.whitening.spread[:, 2] > 1.3 * known.whitening.spread[:, 2]).mean() > 0.9
    assert score(known, effect) > 1.3 * score(found, effect)


def test_outside_the_valid_frames_nothing_counts():
    null, *_ = drawn(2)
    spoil = np.zeros_like(null)
    spoil[GAP] = 1e6
    first, second = evidence(2), evidence(2, spoil)
    np.testing.assert_array_equal(first.residual, second.residual)
    assert not first.white(spoil[..., None]).any()
    assert len(first.rows_s()) == len(first.residual)
    inside = (first.rows_s() >= GAP.start / RATE_HZ) & (first.rows_s() < GAP.stop / RATE_HZ)
    assert not inside.any()


def test_moments_are_about_where_the_person_stands():
    """The same lab, its origin 3 m away."""
    null, nuisances, level = drawn(3)
    away = np.array([3.0, -2.0, 0.0])

    def moved(wrenches):
        result = wrenches.copy()
        result[:, 3:] += np.cross(away, wrenches[:, :3], axisa=0, axisb=1, axisc=1)
        return result

    scene = scene_of(moved(null[..., None])[..., 0])
    scene.q[:, :2] = away[:2]
    own, shared = moved(nuisances[..., :3]), moved(nuisances[..., 3:])
    again = trial_evidence("a", scene, own, shared, level, 8.0)
    np.testing.assert_allclose(again.residual, evidence(3).residual, atol=1e-8)


def test_noise_is_never_taken_for_less_than_labs_have():
    """Beside somebody of 40 t, whose plates may err by 200 N, this noise is nothing."""
    light, heavy = evidence(1), evidence(1, mass_kg=40_000.0)
    assert heavy.residual.std() < 0.1 * light.residual.std()
    signature = np.ones((COUNT, 6, 1))
    assert np.linalg.norm(heavy.white(signature)) < 0.1 * np.linalg.norm(light.white(signature))


def test_many_nuisances_do_not_make_the_noise_look_small():
    """What they take off white noise is their number, and the rest keeps its size."""
    rng = np.random.default_rng(4)
    count, many = 600, 900
    noise, level = rng.normal(size=(count, 6)), np.ones(count)
    scene = scene_of(noise)
    scene.valid[:] = True
    nuisances = 10.0 * rng.normal(size=(count, 6, many))
    one = trial_evidence("a", scene, nuisances, np.zeros((count, 6, 1)), level, 20.0)
    left = 1 - many / len(one.residual)
    assert (one.residual**2).mean() == pytest.approx(left, rel=0.1)


def test_a_fast_recording_is_filtered_before_frames_are_left_out():
    """A hum that the slow rate would fold back to 1 Hz is gone."""
    _, nuisances, level = drawn(3)
    fine = 4
    times = np.arange(fine * COUNT) / (fine * RATE_HZ)
    hum = np.sin(2 * np.pi * 51.0 * times)[:, None] * np.ones(6)
    scene = scene_of(hum, fine * RATE_HZ)
    scene.valid[:] = True
    slow = SimpleNamespace(**{k: v[::fine] for k, v in vars(scene).items() if k in ARRAYS})
    slow.rate_hz = RATE_HZ
    scene.every = {fine: slow}.get
    levels = np.repeat(level, fine)
    found = trial_evidence("a", scene, nuisances[..., :3], nuisances[..., 3:], levels, 8.0)
    assert found.scene is slow
    assert np.abs(found.filtered.residual[10:-10]).max() < 1e-3
