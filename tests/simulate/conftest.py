"""People and trials shared by the simulator's tests (simulated once per session)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import Person, draw_person
from bsip_cli.simulate.trial import Trial, simulate_trial

DURATION_S = {
    "static": 1.0,
    "sequence": 14.0,
    "throwing": 2.0,
    "basketball": 2.4,
    "squat": 3.0,
    "steps": 3.4,
    "walking": 1.2,
    "running": 0.8,
}


@cache
def person_of(seed: int) -> Person:
    return draw_person(np.random.default_rng(seed), Richness())


@cache
def trial_of_task(task: str, seed: int = 3) -> Trial:
    rng = np.random.default_rng([seed, 7])
    return simulate_trial(person_of(seed), task, rng, DURATION_S[task], ball_mass_kg=0.3)


@pytest.fixture(scope="session")
def person() -> Person:
    return person_of(3)


@pytest.fixture(scope="session")
def trial():
    """A function from the task's name to its trial."""
    return trial_of_task
