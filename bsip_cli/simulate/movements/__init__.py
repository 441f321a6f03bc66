"""One file per family of movements; this table is all that the rest knows of them.

A movement is a function (person, rng, duration_s, ball_mass_kg) -> Plan.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bsip_cli.simulate.movements import moving, standing
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan

Movement = Callable[[Person, np.random.Generator, float, float], Plan]
MOVEMENTS: dict[str, tuple[Movement, float]] = {
    "static": (standing.static, 2.0),
    "sequence": (standing.sequence, 120.0),
    "throwing": (standing.throwing, 3.0),
    "basketball": (moving.basketball, 3.0),
    "squat": (standing.squat, 6.0),
    "steps": (standing.steps, 5.0),
    "walking": (moving.walking, 1.2),
    "running": (moving.running, 0.8),
    "hops": (moving.hops, 5.0),
    "stepon": (standing.stepon, 9.0),
    "postures": (standing.postures, 35.0),
}
"""By task, the movement and its usual duration [s]."""
