"""The interface of all effects: what else could make the measured wrench differ."""

from __future__ import annotations

import re
import tomllib
from abc import ABC
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bsip_cli.effects.scene import Scene
from bsip_cli.segments import in_words, the_joint

_FILE = Path(__file__).with_name("catalogue.toml")
ABOUT: dict[str, dict[str, Any]] = tomllib.loads(_FILE.read_text(encoding="utf-8"))
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


Parameters = tuple[Parameter, ...]
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
    or, if that is linear in these parameters, ``tangent``. What is no physics is in the table
    ``catalogue.toml`` under its name; what a person should read are templates for what ``spoken``
    knows.
    """

    name: ClassVar[str]
    numbers: ClassVar[tuple[Parameter, ...]] = ()  # its parameters, the same in every trial
    # How far it reaches: the same in all trials of a laboratory's session, or of a person; or not.
    scope: ClassVar[str] = "trial"
    segments: ClassVar[tuple[str, ...]] = ()  # where it may sit: all whose names begin so
    of_the_body: ClassVar[bool] = False  # of the person, and in one trial if in another
    while_moving: ClassVar[bool] = False  # not of who stands still to be calibrated
    of_the_forces: ClassVar[bool] = False  # what is measured is wrong, and can be corrected
    of_the_plates: ClassVar[bool] = False  # so that the truth is what was measured, less the change
    on_its_segment: ClassVar[bool] = False  # the change is what moves or holds more at the target
    says: ClassVar[str]  # the cause with its sizes
    shortly: ClassVar[str] = ""  # in fewest words, where fewer are enough
    orders: ClassVar[tuple[str, str]] = ("more", "less")  # of a first number above and below zero
    is_signed: ClassVar[bool] = True  # whether ``says`` shows the sign of a number
    looks: ClassVar[str]  # what a person sees of it in the curves
    remedy: ClassVar[str]  # what would separate it from others of its ambiguity group
    least_named: ClassVar[Mapping[str, float]] = {}  # of a parameter: smaller ones are not reported

    def __init_subclass__(cls) -> None:
        """With the name of its class, and what the table says of it."""
        name = re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()
        for key, value in ({"name": name} | ABOUT[name] if name in ABOUT else {}).items():
            if key == "numbers":
                value = [Parameter(**one) for one in value]
            setattr(cls, key, tuple(value) if isinstance(value, list) else value)

    @property
    def is_shared(self) -> bool:
        """Whether trials can share it, with the same numbers."""
        return self.scope != "trial"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Segments, plates or markers it may sit at; one empty name where there is no choice."""
        if not self.segments:
            return ("",)
        return tuple(name for name in scene.bodies if name.startswith(self.segments))

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

    def is_free(self, scene: Scene, target: str) -> np.ndarray:
        """(K,) True for the parameters without a scan."""
        return np.array([not p.scan for p in self.parameters(scene, target)])

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N, 6) what it adds to the simulated wrench, about the world's origin [N, N m]."""
        return self.tangent(scene, target, values) @ values[self.is_free(scene, target)]

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N, 6, k) derivative of ``change`` for the k parameters without a scan.

        By central differences of a thousandth of typical.
        """
        steps = 1e-3 * np.diag([p.typical for p in self.parameters(scene, target)])
        columns = [
            self.change(scene, target, values + step) - self.change(scene, target, values - step)
            for step in steps[self.is_free(scene, target)]
        ]
        return np.stack(columns, axis=-1) / (2 * np.diag(steps)[self.is_free(scene, target)])

    def signature(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N, 6, k) the same for typical sizes."""
        sizes = np.array([p.typical for p in self.parameters(scene, target) if not p.scan])
        return self.tangent(scene, target, values) * sizes

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray | None:
        """(N, m, 3) what it adds to the residuals of the inverse kinematics [m], segment axes.

        A marker's error less what the pose follows of it; None where no marker is touched.
        """
        return None

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
        for p, x in zip(self.parameters(scene, target), values, strict=True):
            near = 0.0 if p.scan else NEAR * p.typical
            inside = p.least + near < x < p.most - near or (p.scan and p.least <= x <= p.most)
            if not inside or abs(x) < self.least_named.get(p.name, 0.0):
                return False
        return True

    def agrees(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Whether the residuals of the markers allow it: they do not grow by it."""
        if scene.residual_m is None:
            return True
        change = self.marker_change(scene, target, values)
        return change is None or explained_share(scene.residual_m, change) > -DISAGREEMENT

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """What the diagnosis prints; by default the parameters."""
        parameters = self.parameters(scene, target)
        return tuple((p.name, p.unit, float(x)) for p, x in zip(parameters, values, strict=True))

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        """What a person should read, without interval."""
        known = self.spoken(scene, target, values)
        short = self.shortly.format(**known)
        return Words(self.says.format(short=short, **known), short, is_signed=self.is_signed)

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        """What the templates may name: parameters and what is reported, in the units that people
        read; ``size`` and ``order`` of the first; ``length`` of the vector that the first three
        are; and the target: as it is (``place``), a segment, a joint."""
        numbers = (
            *Effect.reported(self, scene, target, values),
            *self.reported(scene, target, values),
        )
        known: dict[str, Any] = {n: readable_unit(n, u)[0] * x for n, u, x in numbers}
        name, unit, first = numbers[0]
        known |= {"size": abs(known[name]), "order": self.orders[not first > 0]}
        known["length"] = readable_unit(name, unit)[0] * np.linalg.norm(values[:3])
        return known | {"place": target, "segment": in_words(target), "joint": the_joint(target)}


def explained_share(residual_m: np.ndarray, change_m: np.ndarray) -> float:
    """Part of the markers' squared residuals (N, m, 3) that a change takes away."""
    known = np.isfinite(residual_m).all(axis=2)
    before = float((residual_m[known] ** 2).sum())
    after = float(((residual_m - change_m)[known] ** 2).sum())
    return 1 - after / max(before, 1e-12)


def along_xyz(name: str, unit: str, most: float, typical: float, sd: float = 0.0) -> Parameters:
    """Parameters ``name_x``, ``name_y`` and ``name_z`` of either sign, known to ``sd``."""
    return tuple(
        Parameter(f"{name}_{axis}", unit, -most, most, typical, known_to=sd) for axis in "xyz"
    )


def parts_xyz(name: str, unit: str, values: Iterable[float]) -> Reported:
    """The first three values as ``name_x``, ``name_y`` and ``name_z``."""
    return tuple((f"{name}_{axis}", unit, float(x)) for axis, x in zip("xyz", values, strict=False))


def size_and_parts(name: str, unit: str, values: np.ndarray) -> Reported:
    """The length of the vector that the first three values are, and its parts."""
    return (name, unit, float(np.linalg.norm(values[:3]))), *parts_xyz(name, unit, values)


# --- what is made of an effect --------------------------------------------------------------------


@dataclass(frozen=True)
class Number:
    """A parameter with its 95 % interval, NaN where there is none."""

    name: str
    unit: str
    value: float
    low: float = np.nan
    high: float = np.nan

    @classmethod
    def within(cls, name: str, unit: str, value: float, half: float) -> Number:
        """With an interval that reaches as far to either side."""
        return cls(name, unit, value, value - half, value + half)

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
