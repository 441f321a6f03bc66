"""Scores against the same least squares done at length."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from bsip_cli.diagnosis.explanation import Explanation
from bsip_cli.diagnosis.signatures import Place, Signatures, signatures_of
from bsip_cli.diagnosis.together import together
from bsip_cli.effects.catalogue import EFFECTS
from tests.diagnosis.noisy_trial import all_of, late, noisy, part_of_moving

NAMES = ("sync_offset", "gravity_tilt", "released_object")


@cache
def signatures() -> Signatures:
    scenes = (noisy(part_of_moving(0, 6), 1), noisy(late(part_of_moving(6, 6), 0.002), 2))
    return signatures_of(all_of(*scenes), [EFFECTS[name] for name in NAMES])


def column_of(found: Signatures, place: Place) -> np.ndarray:
    """(R, k) white derivative at the null, by the explanation's own way."""
    scene = found.evidence.trials[place.trials[0]].scene
    null = place.candidate.values(scene, np.zeros(len(place.candidate.free(scene))))
    return Explanation(place, null).tangent(found.evidence)


def places_of(found: Signatures, name: str) -> list[int]:
    return [k for k, p in enumerate(found.places) if p.candidate.effect.name == name]


@pytest.mark.parametrize("name", NAMES)
def test_scores_and_sizes_are_those_of_least_squares(name):
    found = signatures()
    residual = found.evidence.residual
    known = np.random.default_rng(4).normal(size=(len(residual), 2))
    logs, sizes = found.scores(np.column_stack([residual, 2 * residual]), known)
    basis, _ = np.linalg.qr(known)
    for k in places_of(found, name)[::5]:
        column = column_of(found, found.places[k])
        column = column - basis @ (basis.T @ column)
        left = residual - basis @ (basis.T @ residual)
        size, *_ = np.linalg.lstsq(column, left, rcond=None)
        lost = (left**2).sum() - ((left - column @ size) ** 2).sum()
        np.testing.assert_allclose(sizes[k], size, rtol=1e-3, atol=1e-4 * np.abs(size).max())
        free = column.shape[1]
        assert logs[k, 0] == pytest.approx(-chi2.logsf(lost, free), rel=1e-3, abs=1e-3)
        assert logs[k, 1] == pytest.approx(-chi2.logsf(4 * lost, free), rel=1e-3, abs=1e-3)


@pytest.mark.parametrize(("of_its_own", "is_asked"), [(0.15, False), (0.25, True)])
def test_what_is_known_almost_explains_is_not_asked(of_its_own, is_asked):
    found = signatures()
    (k, *_) = places_of(found, "sync_offset")
    column = column_of(found, found.places[k])[:, 0]
    other = np.random.default_rng(4).normal(size=len(column))
    other -= column * (column @ other) / (column @ column)
    other *= np.linalg.norm(column) / np.linalg.norm(other)
    known = np.sqrt(1 - of_its_own) * column + np.sqrt(of_its_own) * other
    scores, _ = found.scores(found.evidence.residual[:, None], known[:, None])
    assert bool(scores[k, 0] > 0) == is_asked


def test_information_is_the_gram_matrix():
    found = signatures()
    known = np.zeros((len(found.evidence.residual), 0))
    for k in places_of(found, "gravity_tilt"):
        column = column_of(found, found.places[k])
        expected = column.T @ column
        np.testing.assert_allclose(
            found.information(known)[k], expected, atol=1e-4 * np.abs(expected).max()
        )


def test_what_lasts_is_looked_for_in_all_trials_together_too():
    found = signatures()
    trials = {name: {found.places[k].trials for k in places_of(found, name)} for name in NAMES}
    assert trials["sync_offset"] == {(0,), (1,), (0, 1)}
    assert trials["released_object"] == {(0,), (1,)}
    delay = found.places[places_of(found, "sync_offset")[0]].candidate
    assert found.trials_of(delay) == {0, 1}


def test_what_touches_no_valid_frame_is_no_candidate():
    """An object that is let go before the plates measure anything."""
    scene = noisy(part_of_moving(0, 6), 1)
    late_start = replace(scene, valid=scene.times_s > 3.2)
    found = signatures_of(all_of(late_start), [EFFECTS["released_object"]])
    releases = [place.candidate.scanned[0] for place in found.places]
    assert min(releases) > 3.0
    everywhere = signatures_of(all_of(scene), [EFFECTS["released_object"]])
    assert min(place.candidate.scanned[0] for place in everywhere.places) < 2.0


def test_in_other_noise_they_are_whitened_anew():
    """Twice the noise, half the size of every signature."""
    found = signatures()
    others = tuple(
        replace(one, whitening=replace(one.whitening, spread=2 * one.whitening.spread))
        for one in found.evidence.trials
    )
    again = found.on(together(others))
    assert again.places == found.places
    for k in places_of(found, "sync_offset"):
        np.testing.assert_allclose(
            column_of(again, again.places[k]), _stored_column(again, k), atol=2e-3
        )
    assert np.linalg.norm(_stored_column(again, 0)) < 0.7 * np.linalg.norm(_stored_column(found, 0))


def _stored_column(found: Signatures, k: int) -> np.ndarray:
    place = found.places[k]
    return found.evidence.white({t: found.white(t, place.candidate) for t in place.trials})
