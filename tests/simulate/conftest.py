"""People and trials shared by the simulator's tests (simulated once per session)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import Inertia, Person, draw_person, second_moments
from bsip_cli.simulate.recording import Trial, simulate_trial

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


NOTHING_RICH = Richness(
    soft_tissue=0.0,
    marker_noise_m=0.0,
    marker_drift_m=0.0,
    gaps=False,
    force_noise_n=0.0,
    moment_noise_nm=0.0,
    quantised=False,
    hinge_tilt=0.0,
    joint_centre_offset=0.0,
    placement_error_m=0.0,
)
"""No noise, no gaps, rigid markers, hinges along Z, joint centres as predicted."""


def is_physical(part: Inertia) -> bool:
    """Positive mass and positive definite second moments (pseudo-inertia > 0)."""
    moments = np.linalg.eigvalsh(second_moments(part.tensor_kgm2))
    return part.mass_kg > 0.0 and bool(moments.min() > 0.0)
