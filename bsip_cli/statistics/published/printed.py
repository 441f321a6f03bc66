"""Numbers as print gives them: every one stands for all that round to it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

_NUMBER = r"-?\d*\.?\d+"
_CELL = re.compile(rf"(?P<mean>{_NUMBER})(?:\((?P<sd>{_NUMBER})\))?(?P<marks>\D*)")
_RANGE = re.compile(rf"\[(?P<low>{_NUMBER}), (?P<high>{_NUMBER})\]")


@dataclass(frozen=True)
class Interval:
    """All numbers from ``low`` to ``high``."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return 0.5 * (self.low + self.high)

    def meets(self, other: Interval) -> bool:
        """Whether some number lies in both."""
        return self.low <= other.high and other.low <= self.high

    def size(self) -> Interval:
        """Of the numbers without their sign."""
        if self.low <= 0.0 <= self.high:
            return Interval(0.0, max(-self.low, self.high))
        return Interval(*sorted((abs(self.low), abs(self.high))))

    def negative(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)


def image(function: Callable[..., float], *arguments: Interval) -> Interval:
    """What a function makes of intervals; it must rise or fall with each argument throughout."""
    corners = product(*((one.low, one.high) for one in arguments))
    values = [function(*corner) for corner in corners]
    return Interval(min(values), max(values))


def rounded_from(text: str) -> Interval:
    """The numbers that are printed as ``text``.

    Raises
    ------
    ValueError
        `text` is no number.
    """
    _, _, decimals = text.partition(".")
    half = 0.5 * 10.0 ** -len(decimals)
    return Interval(float(text) - half, float(text) + half)


@dataclass(frozen=True)
class Cell:
    """M(SD) with the marks behind it; ``sd``, never below 0, is None where only one number is
    printed."""

    text: str
    mean: Interval
    sd: Interval | None
    marks: str

    def spread(self) -> Interval:
        """The standard deviation.

        Raises
        ------
        ValueError
            None is printed.
        """
        if self.sd is None:
            raise ValueError(f"{self.text} has no standard deviation")
        return self.sd

    @classmethod
    def of(cls, text: str) -> Cell:
        """From print.

        Raises
        ------
        ValueError
            `text` is neither a number nor M(SD).
        """
        found = _CELL.fullmatch(text)
        if found is None:
            raise ValueError(f"neither a number nor M(SD): {text!r}")
        sd = rounded_from(found["sd"]) if found["sd"] else None
        if sd is not None:
            sd = Interval(max(sd.low, 0.0), sd.high)
        return cls(text, rounded_from(found["mean"]), sd, found["marks"])


def range_of(text: str) -> tuple[Interval, Interval]:
    """Both ends of a printed [low, high].

    Raises
    ------
    ValueError
        `text` is no such range.
    """
    found = _RANGE.fullmatch(text)
    if found is None:
        raise ValueError(f"no range: {text!r}")
    return rounded_from(found["low"]), rounded_from(found["high"])
