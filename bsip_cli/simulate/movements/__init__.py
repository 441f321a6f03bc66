"""One file per family of movements; this table is all that the rest knows of them.

A movement is a function (person, rng, duration_s, ball_mass_kg) -> Plan.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bsip_cli.simulate.movements.moving import basketball, hops, running, walking
from bsip_cli.simulate.movements.standing import (
    postures,
    sequence,
    squat,
    static,
    stepon,
    steps,
    throwing,
)
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan

Movement = Callable[[Person, np.random.Generator, float, float], Plan]
_TABLE: dict[str, tuple[Movement, float]] = {
    "static": (static, 2.0),
    "sequence": (sequence, 120.0),
    "throwing": (throwing, 3.0),
    "basketball": (basketball, 3.0),
    "squat": (squat, 6.0),
    "steps": (steps, 5.0),
    "walking": (walking, 1.2),
    "running": (running, 0.8),
    "hops": (hops, 5.0),
    "stepon": (stepon, 9.0),
    "postures": (postures, 35.0),
}
MOVEMENTS = {task: movement for task, (movement, _) in _TABLE.items()}
DEFAULT_DURATION_S = {task: duration_s for task, (_, duration_s) in _TABLE.items()}
