"""The interface of all effects: what else could make the measured wrench differ."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np

from bsip_cli.effects.scene import Scene

NEAR = 0.01  # of the typical size: so near to a bound counts as at it
DISAGREEMENT = 0.02  # of the squared residuals of the markers


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    name, unit : as in the diagnosis artifact.
    least, most : physical bounds; outside, the explanation is none.
    typical : a size that labs meet: the unit of steps and the spread before the data.
    scan : values to try where the derivative at the null says nothing (a frequency, a moment in
        time); empty for a parameter that is zero where the effect is absent.
    known_to : standard deviation that no recording betters, since the truth is less simple than
        the effect's model: nobody leans on a rail along a ramp.
    is_given : it keeps the value that is tried: the data do not decide it.
    """

    name: str
    unit: str
    least: float
    most: float
    typical: float
    scan: tuple[float, ...] = ()
    known_to: float = 0.0
    is_given: bool = False


Reported = tuple[tuple[str, str, float], ...]  # name, unit and value of what is printed


@dataclass(frozen=True)
class Words:
    """A cause in words, of which each sentence about it is made.

    what : all of it, without interval. short : in fewest words, empty where these are all.
    against : by what it is judged, where that is no usual size. remark : what follows the interval.
    is_signed : whether a negative number has its sign in ``what``, and so in its interval.
    """

    what: str
    short: str = ""
    against: str = ""
    remark: str = ""
    is_signed: bool = True


class Effect(ABC):
    """A cause outside the inertial parameters that changes wrench or markers.

    All parameters without a scan vanish together: then there is no effect. One defines ``change``
    or, if that is linear in these parameters, ``tangent``.
    """

    name: ClassVar[str]
    numbers: ClassVar[tuple[Parameter, ...]] = ()  # its parameters, the same in every trial
    is_of_laboratory: ClassVar[bool] = False  # the same in every trial of a recording session
    is_of_person: ClassVar[bool] = False  # the same in every trial of a person
    of_the_body: ClassVar[bool] = False  # of the person, and in one trial if in another
    while_moving: ClassVar[bool] = False  # not of who stands still to be calibrated
    of_the_forces: ClassVar[bool] = False  # what is measured is wrong, and can be corrected
    of_the_plates: ClassVar[bool] = False  # so that the truth is what was measured, less the change
    on_its_segment: ClassVar[bool] = False  # the change is what moves or holds more at the target
    looks: ClassVar[str]  # what a person sees of it in the curves
    remedy: ClassVar[str]  # what would separate it from others of its ambiguity group
    least_named: ClassVar[Mapping[str, float]] = {}  # of a parameter: smaller ones are not reported

    @property
    def is_shared(self) -> bool:
        """Whether trials can share it, with the same numbers."""
        return self.is_of_laboratory or self.is_of_person

    @property
    def scope(self) -> str:
        """How far it reaches, if it is there."""
        if self.is_of_laboratory:
            return "laboratory"
        return "person" if self.is_of_person else "trial"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Segments, plates or markers it may sit at; one empty name where there is no choice."""
        return ("",)

    def is_shared_at(self, scene: Scene, target: str) -> bool:
        """Whether a trial has it at a target if the others have."""
        return True

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        """Its numbers, in the order in which ``change`` takes them."""
        return self.numbers

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        """Values to try of the parameters that have a scan; by default every combination."""
        return product(*(p.scan for p in self.parameters(scene, target) if p.scan))

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(s,) how far around scanned values a finer search looks; by default typical sizes."""
        return np.array([p.typical for p in self.parameters(scene, target) if p.scan])

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N, 6) what it adds to the simulated wrench, about the world's origin [N, N m]."""
        return self.tangent(scene, target, values) @ values[self.is_free(scene, target)]

    @abstractmethod
    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        """What a person should read, without interval."""

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray | None:
        """(N, m, 3) what it adds to the residuals of the inverse kinematics [m], segment axes.

        A marker's error less what the pose follows of it; None where no marker is touched.
        """
        return None

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """What the diagnosis prints; by default the parameters."""
        parameters = self.parameters(scene, target)
        return tuple((p.name, p.unit, float(x)) for p, x in zip(parameters, values, strict=True))

    def is_free(self, scene: Scene, target: str) -> np.ndarray:
        """(K,) True for the parameters without a scan."""
        return np.array([not p.scan for p in self.parameters(scene, target)])

    def is_identifiable(self, scene: Scene, target: str) -> np.ndarray:
        """(k,) True for the parameters without a scan of which the motion can decide anything."""
        return np.ones(int(self.is_free(scene, target).sum()), dtype=bool)

    def alike(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(n, K) values whose change is the same wherever the recording is valid, the plainest
        first; by default these alone."""
        return values[None]

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Whether the values can be true of a body or a lab; at a bound they would go beyond it.
        What is too small to be named cannot."""
        bounded = tuple(zip(self.parameters(scene, target), values, strict=True))
        within = all(
            p.least <= x <= p.most
            if p.scan
            else p.least + NEAR * p.typical < x < p.most - NEAR * p.typical
            for p, x in bounded
        )
        return within and all(abs(x) >= self.least_named.get(p.name, 0.0) for p, x in bounded)

    def agrees(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Whether the residuals of the markers allow it: they do not grow by it."""
        if scene.residual_m is None:
            return True
        change = self.marker_change(scene, target, values)
        return change is None or explained_share(scene.residual_m, change) > -DISAGREEMENT

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N, 6, k) derivative of ``change`` for the k parameters without a scan.

        By central differences of a thousandth of typical.
        """
        parameters = self.parameters(scene, target)
        columns = []
        for k, parameter in enumerate(parameters):
            if parameter.scan:
                continue
            step = np.zeros(len(parameters))
            step[k] = 1e-3 * parameter.typical
            ahead = self.change(scene, target, values + step)
            columns.append((ahead - self.change(scene, target, values - step)) / (2 * step[k]))
        return np.stack(columns, axis=-1)

    def signature(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N, 6, k) the same for typical sizes."""
        parameters = self.parameters(scene, target)
        sizes = np.array([p.typical for p in parameters if not p.scan])
        return self.tangent(scene, target, values) * sizes


def explained_share(residual_m: np.ndarray, change_m: np.ndarray) -> float:
    """Part of the markers' squared residuals (N, m, 3) that a change takes away."""
    known = np.isfinite(residual_m).all(axis=2)
    before = float((residual_m[known] ** 2).sum())
    after = float(((residual_m - change_m)[known] ** 2).sum())
    return 1 - after / max(before, 1e-12)


def along_xyz(
    name: str, unit: str, least: float, most: float, typical: float, known_to: float = 0.0
) -> tuple[Parameter, ...]:
    """Parameters ``name_x``, ``name_y`` and ``name_z`` that are described alike."""
    described = (unit, least, most, typical, (), known_to)
    return tuple(Parameter(f"{name}_{axis}", *described) for axis in "xyz")


def parts_xyz(name: str, unit: str, values: Iterable[float]) -> Reported:
    """The first three values as ``name_x``, ``name_y`` and ``name_z``."""
    return tuple((f"{name}_{axis}", unit, float(x)) for axis, x in zip("xyz", values, strict=False))


# --- what is made of an effect --------------------------------------------------------------------


@dataclass(frozen=True)
class Number:
    """A parameter with its 95 % interval, NaN where there is none."""

    name: str
    unit: str
    value: float
    low: float = np.nan
    high: float = np.nan

    def interval(self, is_signed: bool = True) -> str:
        """``1.87 to 2.14°``; without signs as sizes, if zero is not between them."""
        factor, unit = readable_unit(self.name, self.unit)
        low, high = factor * self.low, factor * self.high
        if not np.isfinite(high - low):
            return ""
        if not is_signed and low * high > 0:
            low, high = sorted((abs(low), abs(high)))
        digits = digits_of(high - low if high > low else factor * self.value)
        return with_unit(f"{low:z.{digits}f} to {high:z.{digits}f}", unit)

    def size(self) -> str:
        """``1.99°``, with the digits of its interval."""
        factor, unit = readable_unit(self.name, self.unit)
        digits = digits_of(factor * (self.high - self.low))
        return with_unit(f"{factor * self.value:z.{digits}f}", unit)

    def certainty(self) -> float:
        """Its size over the width of its interval; 0 where none is known."""
        width = self.high - self.low
        return abs(self.value) / max(width, 1e-12) if np.isfinite(width) else 0.0


@dataclass(frozen=True)
class Judged:
    """An effect at a place with its numbers, and what is made of it.

    trials : their names. p_value : 1 less ``probability`` that it is there, where no test gives
    another. class_id : of faults that look alike here; empty for one alone. scope : laboratory,
    person or trial. gain : percent of the squared white residual on data held out, and its
    interval. rms_change : root mean square of what it does to the component that it changes most
    [N, N m]. persons : of the laboratory who share it, 0 of this person's own; own : its largest
    number by this person's recordings alone, None where they say nothing of a shared one.
    """

    effect: str
    target: str
    trials: tuple[str, ...]
    numbers: tuple[Number, ...]
    words: Words
    p_value: float
    probability: float
    verdict: str = "named"  # or ambiguous, or rejected
    class_id: str = ""
    scope: str = "trial"
    gain: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    rms_change: float = np.nan
    persons: int = 0
    own: Number | None = None


# --- the units and digits in which people read the sizes of effects -------------------------------

_SCALES = {"rad": (57.29577951308232, "°"), "m": (1000.0, "mm")}
_PLAIN_NUMBERS = ("damping_ratio", "rate_ratio")


def readable_unit(parameter: str, unit: str) -> tuple[float, str]:
    """Factor and unit in which people read a parameter."""
    if parameter == "delay":
        return 1000.0, "ms"
    if parameter == "rate_error":
        return 1e6, "ppm"
    if unit == "1":
        return (1.0, "") if parameter in _PLAIN_NUMBERS else (100.0, "%")
    return _SCALES.get(unit, (1.0, unit))


def with_unit(text: str, unit: str) -> str:
    """``2.5 ms``, ``1.3°``, or a number alone."""
    return f"{text}{'' if unit == '°' else ' '}{unit}".strip()


def digits_of(width: float) -> int:
    """Decimals that leave two digits of a number of this size."""
    if not abs(width) > 0:
        return 1
    exponent = int(f"{abs(width):e}".split("e")[1])
    return max(0, 1 - exponent)
