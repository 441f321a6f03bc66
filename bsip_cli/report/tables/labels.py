"""What the names in the data are called in print, and numbers as the papers print them; a number that
is not there is a dash.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isnan

from bsip_cli.statistics.cohort_values import Topic

UNITS = {"mm2": "mm²", "% body weight": "% BW"}

SEQUENCE_IN_PRINT = "in the paper: random, 120 s"

SEGMENT_ORDER = (
    "lower_torso",
    "upper_torso",
    "head",
    "upper_arm_l",
    "forearm_l",
    "hand_l",
    "upper_arm_r",
    "forearm_r",
    "hand_r",
    "thigh_l",
    "shank_l",
    "foot_l",
    "thigh_r",
    "shank_r",
    "foot_r",
)
"""As in table 1 of Hansen 2017; other segments follow."""


def segment_rank(name: str) -> int:
    return SEGMENT_ORDER.index(name) if name in SEGMENT_ORDER else len(SEGMENT_ORDER)


def unit(name: str) -> str:
    return UNITS.get(name, name)


def task(topic: Topic) -> str:
    """The movement; the one that identified OM is named as such."""
    if topic.role == "sequence":
        return f"{topic.task} (identified OM; {SEQUENCE_IN_PRINT})"
    return topic.task


ABSENT = "-"


def number(decimals: int) -> Callable[[float], str]:
    return lambda value: ABSENT if isnan(value) else _rounded(value, decimals)


def mean_sd(decimals: int) -> Callable[[float, float], str]:
    """M(SD), in whole numbers from a thousand on; one participant has no SD."""

    def form(mean: float, sd: float) -> str:
        if isnan(mean):
            return ABSENT
        places = 0 if abs(mean) >= 1000.0 else decimals
        spread = ABSENT if isnan(sd) else _rounded(sd, places)
        return f"{_rounded(mean, places)}({spread})"

    return form


def interval(decimals: int) -> Callable[[float, float], str]:
    def form(low: float, high: float) -> str:
        if isnan(low) or isnan(high):
            return ABSENT
        return f"[{_rounded(low, decimals)}, {_rounded(high, decimals)}]"

    return form


def p_value(p: float) -> str:
    """Three decimals without the leading zero."""
    if isnan(p):
        return ABSENT
    return "<.001" if p < 0.0005 else f"{p:.3f}".removeprefix("0")


def count(value: float) -> str:
    return ABSENT if isnan(value) else f"{value:.0f}"


def counts_of(a: float, b: float, n: float) -> str:
    """How many for the one, how many for the other, of how many."""
    return ABSENT if isnan(a) or n == 0 else f"{a:.0f} : {b:.0f} of {n:.0f}"


def _rounded(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text
