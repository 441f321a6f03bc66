"""Which body a target means, and when something happens in a trial."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.names import SEGMENTS
from bsip_cli.simulate.plan import Plan

SEGMENT_NAMES = "a segment: " + ", ".join(SEGMENTS)


def body_of(segment: str) -> str:
    """The simulated body of a segment; things on the upper torso sit on the thorax."""
    return "thorax" if segment == "upper_torso" else segment


def recorded_times_s(plan: Plan) -> np.ndarray:
    """(T,) times of a plan's samples on the recording's clock."""
    return (np.arange(len(plan)) - plan.keep.start) * plan.step_s


def recorded_length_s(plan: Plan) -> float:
    """How long the recording is."""
    return (plan.keep.stop - plan.keep.start) * plan.step_s
