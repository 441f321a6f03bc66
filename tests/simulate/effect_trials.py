"""Trials with effects, and what a quiet laboratory measures of them."""

from __future__ import annotations

from functools import cache

import numpy as np

from bsip_cli.simulate.effects import Effect, drawn
from bsip_cli.simulate.options import Asked, Laboratory, Rates
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.recording import MM, Measurement, Trial, measure_trial, simulate_trial
from tests.blind import outside_effects  # noqa: F401 (the simulator knows them from here on)
from tests.blind.blind_cases import CATALOGUE, OUTSIDE
from tests.simulate.conftest import NOTHING_RICH, person_of

G = 9.81
PERSON_SEED = 3
DURATION_S = {"static": 3.0, "squat": 4.0, "hops": 4.0, "stepon": 9.0}
SIZES = {name: allowed.most for name, allowed in {**CATALOGUE, **OUTSIDE}.items()}
SIZES["over_smoothing"] = 2.0  # the lower a cut-off, the more it takes


def effect_of(name: str, size: float | None = None, target: str = "", seed: int = 1):
    asked = Asked(name, SIZES[name] if size is None else size, target)
    return drawn(asked, np.random.default_rng(seed))


@cache
def trial_with(task: str, *asked: tuple[str, float, str]) -> Trial:
    person = person_of(PERSON_SEED)
    rng = np.random.default_rng([PERSON_SEED, 7])
    effects = [effect_of(*one) for one in asked]
    for effect in effects:
        person = effect.person(person)
    return simulate_trial(person, task, rng, DURATION_S[task], effects=effects)


@cache
def measured_with(task: str, *asked: tuple[str, float, str]) -> Measurement:
    """Noise-free, with effects of the instruments only."""
    effects = [effect_of(*one) for one in asked]
    return measured(trial_with(task), person_of(PERSON_SEED), effects)


def measured(trial: Trial, person: Person, effects: list[Effect]) -> Measurement:
    """By a laboratory without noise."""
    rng = np.random.default_rng(5)
    return measure_trial(trial, person, Rates(), Laboratory(), NOTHING_RICH, rng, effects=effects)


def weight_n() -> float:
    return person_of(PERSON_SEED).mass_kg * G


def readings(measurement: Measurement) -> np.ndarray:
    """(N, 6) of the first plate in N and N m."""
    return measurement.channels[:, :6] / np.repeat([1.0, MM], 3)
