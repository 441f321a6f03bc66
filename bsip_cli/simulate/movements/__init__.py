"""One file per family of movements; this table is all that the rest knows of them.

A movement is a function (person, rng, duration_s, ball_mass_kg) -> Plan.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bsip_cli.simulate.movements.basketball import basketball
from bsip_cli.simulate.movements.gait import running, walking
from bsip_cli.simulate.movements.hops import hops
from bsip_cli.simulate.movements.sequence import sequence
from bsip_cli.simulate.movements.standing import squat, static
from bsip_cli.simulate.movements.stepon import stepon
from bsip_cli.simulate.movements.steps import steps
from bsip_cli.simulate.movements.throwing import throwing
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan

MOVEMENTS: dict[str, Callable[[Person, np.random.Generator, float, float], Plan]] = {
    "static": static,
    "sequence": sequence,
    "throwing": throwing,
    "basketball": basketball,
    "squat": squat,
    "steps": steps,
    "walking": walking,
    "running": running,
    "hops": hops,
    "stepon": stepon,
}
DEFAULT_DURATION_S = {
    "static": 2.0,
    "sequence": 120.0,
    "throwing": 3.0,
    "basketball": 3.0,
    "squat": 6.0,
    "steps": 5.0,
    "walking": 1.2,
    "running": 0.8,
    "hops": 5.0,
    "stepon": 9.0,
}
