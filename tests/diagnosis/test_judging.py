"""Whether what is found in one trial is the image of what another shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.explanation import Explanation, Fit
from bsip_cli.diagnosis.held_out import Gain
from bsip_cli.diagnosis.judging import NAMELESS_WORTH, TINY_WORTH, Tried, stands_beside
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.effects.catalogue import EFFECTS

ROWS = 400
NO_GAIN = Gain(np.zeros(1), np.ones(1, dtype=bool), 1.0)


def course(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(ROWS)


def with_course(known: np.ndarray, residual: np.ndarray) -> Tried:
    """A cause whose change of the residual goes along with ``known``."""
    size = residual @ known / (known @ known)
    fit = Fit((), residual - size * known, known[:, None])
    return Tried(None, 1.0, 0.0, NO_GAIN, fit, is_leftover=False, is_first=True, is_tiny=False)


@pytest.mark.parametrize(("likeness", "stands"), [(0.0, True), (0.1, True), (0.9, False)])
def test_a_cause_stands_beside_what_explains_little_of_it(likeness, stands):
    """The residual is that of both; likeness : cosine between their courses."""
    slight = course(1)
    cause = likeness * slight + np.sqrt(1 - likeness**2) * course(2)
    residual = slight + cause + 0.1 * course(3)
    one, other = with_course(cause, residual), with_course(slight, residual)
    assert stands_beside(one, other, Fit((), residual, np.zeros((ROWS, 0)))) == stands


def test_the_image_of_a_cause_does_not_stand_beside_it():
    """Nothing but the slight one is there; the other one goes along with it."""
    slight = course(1)
    residual = slight + 0.1 * course(3)
    image = with_course(slight + course(2), residual)
    before = Fit((), residual, np.zeros((ROWS, 0)))
    assert not stands_beside(image, with_course(slight, residual), before)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(("tiny", "least"), [(False, NAMELESS_WORTH), (True, TINY_WORTH)])
def test_what_hardly_changes_the_forces_explains_the_more_and_stands_alone(tiny, least, first):
    """Without a name."""
    one = replace(with_course(course(1), course(1)), is_tiny=tiny, is_first=first)
    gains = (of(factor * least) for factor in (0.99, 1.01))
    told = [not replace(one, gain=gain).is_too_little_unnamed for gain in gains]
    assert told == [False, first or not tiny]


def of(share: float) -> Gain:
    """A gain by this share of the squared residual, the same in two blocks."""
    return Gain(np.array([share, share]) / 2, np.ones(2, dtype=bool), 1.0)


@pytest.mark.parametrize(("p_value", "good"), [(1e-30, True), (1e-12, False)])
def test_a_gain_that_is_not_sure_is_enough_beyond_doubt_only(p_value, good):
    """10 % of the squared residual, its standard error 6 %. Nulls have had a chance of 1e-12."""
    place = Place(Candidate(EFFECTS["plate_crosstalk"], "1 fy>fz", ()), (0,))
    gain = Gain(np.array([0.092, 0.008]), np.ones(2, dtype=bool), 1.0)
    assert gain.is_real()
    assert not gain.is_sure()
    one = replace(with_course(course(1), course(1)), explanation=Explanation(place, np.zeros(1)))
    assert replace(one, gain=gain, p_value=p_value).is_good == good
