"""What an effect is: something hidden in a recording that a simulation of it would get wrong.

A class, in the file of what it changes (`instruments` with persons, or `loads`), and a row of
`effects.csv`. An effect may change the person who is measured, what the body carries (`body`,
`plan`) or what the instruments deliver (`measured`). It is drawn once for a participant, and then
does the same in every trial that it touches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, ClassVar, Self, dataclass_transform

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import Instruments
from bsip_cli.segments import SEGMENTS
from bsip_cli.simulate.people import Inertia, Person, combined, table
from bsip_cli.simulate.plan import Plan

NOWHERE = "none"  # what the target of an effect without a place may be
JOINTS = tuple(
    f"{joint}_{side}" for joint in ("hip", "shoulder", "knee", "ankle", "elbow") for side in "lr"
)
TABLE = {row["name"]: row for row in table("effects/effects.csv")}
READ: dict[str, Callable[[str], Any]] = {
    **dict.fromkeys(("least", "most"), float),
    **dict.fromkeys(("settings", "needs"), str.split),
    **dict.fromkeys(("spares_static", "injectable"), "yes".__eq__),
    "targets": lambda text: _with_names(text, ", "),
    "choices": lambda text: _with_names(text, " ").split(),
}
"""How the columns of the table are read that are no text."""


def _with_names(text: str, separator: str) -> str:
    return text.format(segments=separator.join(SEGMENTS), joints=separator.join(JOINTS))


# --- what an effect draws -------------------------------------------------------------------------


@dataclass(frozen=True)
class Target:
    """Where an effect sits: a name, and settings that would be drawn otherwise.

    On the command line ``NAME,key=number,key=number``; every part may be missing.
    """

    name: str = ""
    settings: dict[str, float] = field(default_factory=dict)


def by(draw: Callable[[float, Target, np.random.Generator], Any]) -> Any:
    """A parameter of an effect that follows from its size, its target and random numbers."""
    return field(metadata={"draw": draw})


def named(*otherwise: str) -> Any:
    """The target's name, or else one of these, drawn."""
    return by(lambda size, target, rng: target.name or str(rng.choice(otherwise)))


def setting(key: str) -> Any:
    """A setting of the target, None if it is not given."""
    return by(lambda size, target, rng: target.settings.get(key))


def uniform(
    low: float, high: float, key: str = "", least: float = 0, most: float = np.inf, unit: str = ""
) -> Any:
    """A number drawn between two, unless the target's setting `key` gives one in its bounds."""

    def draw(size: float, target: Target, rng: np.random.Generator) -> float:
        number = float(rng.uniform(low, high))
        number = target.settings.get(key, number)
        if key and not least <= number <= most:
            bounds = f"{least:g} to {most:g} {unit}".strip()
            raise UsageError(f"a {key} of {number:g}", expected=bounds)
        return number

    return by(draw)


def span(first: float, last: float, shortest: float, longest: float) -> Any:
    """Start (drawn between first and last) and end as parts of a trial."""

    def draw(size: float, target: Target, rng: np.random.Generator) -> tuple[float, float]:
        start = float(rng.uniform(first, last))
        return start, start + float(rng.uniform(shortest, longest))

    return by(draw)


def direction(rng: np.random.Generator) -> np.ndarray:
    """(3,) a random unit vector."""
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


# --- effects --------------------------------------------------------------------------------------


@dataclass_transform(frozen_default=True, eq_default=False)
@dataclass(frozen=True, eq=False)
class Effect:
    """Base of all effects; each becomes a frozen dataclass of its drawn parameters.

    name : as in `effects.csv`, which has the rest. unit, least, most : of the size, its bounds.
    targets : what a target may be, in words. choices : names that it may have; empty: any.
    settings : keys that a target may set.
    spares_static : not in static trials, unless they are asked for.
    drawn_for : "person": for each participant; else once for the lab.
    at : segment, marker or joint that it sits at, of its parameters.
    injectable : whether it can be hidden in measured data. hint : for those that are not, why.
    needs : "plates" where it works on forces, and "surface" where on a plate's place.
    """

    size: float

    name: ClassVar[str]
    unit: ClassVar[str]
    least: ClassVar[float]
    most: ClassVar[float]
    targets: ClassVar[str]
    choices: ClassVar[list[str]]
    settings: ClassVar[list[str]]
    at: ClassVar[str] = ""
    spares_static: ClassVar[bool]
    drawn_for: ClassVar[str]
    injectable: ClassVar[bool]
    hint: ClassVar[str]
    needs: ClassVar[list[str]]

    def __init_subclass__(cls, name: str = "") -> None:
        dataclass(frozen=True, eq=False)(cls)
        if name:  # no base of several
            EFFECTS[name] = cls
            for column, text in TABLE[name].items():
                setattr(cls, column, READ.get(column, str)(text))

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        """The effect with all its parameters; those that the target leaves open are drawn, in
        order."""
        how = {one.name: one.metadata["draw"] for one in fields(cls) if one.metadata}
        return cls(size, **{name: draw(size, target, rng) for name, draw in how.items()})

    @classmethod
    def wrong_target(cls, name: str) -> UsageError:
        """The refusal of a target that it cannot have."""
        return UsageError(f"{cls.name} cannot have the target {name!r}", expected=cls.targets)

    def person(self, person: Person) -> Person:
        """The person as she or he really is, in all trials."""
        return person

    def body(self, person: Person) -> Person:
        """The moving body of one trial, with what is fixed to it."""
        return person

    def plan(self, person: Person, plan: Plan) -> Plan:
        """The movement, with what the body carries or leans on."""
        return plan

    def measured(self, instruments: Instruments) -> Instruments:
        """What markers and plates deliver."""
        return instruments

    def injected(self, instruments: Instruments) -> Instruments:
        """Measured data as they would have been with the effect."""
        return self.measured(instruments)

    def facts(self, person: Person) -> dict[str, Any]:
        """Further truth that depends on the person."""
        return {}

    def place(self) -> str:
        """Segment, plate channel, marker or joint that it sits at, for the truth."""
        return self.at.format(**vars(self))

    def record(self) -> dict[str, Any]:
        """The drawn parameters, for the truth, as JSON has them."""
        drawn = {k: x.tolist() if isinstance(x, np.ndarray) else x for k, x in asdict(self).items()}
        return {"effect": self.name, "target": self.place(), "unit": self.unit, **drawn}


EFFECTS: dict[str, type[Effect]] = dict.fromkeys(TABLE, Effect)
"""The classes by name, in the order of the table; each enters itself."""


class OnSegment(Effect):
    """An effect at a segment, by default at its centre of mass."""

    segment: str

    def position_m(self, person: Person) -> np.ndarray:
        """(3,) in the segment's frame."""
        return person.segment_inertias()[self.segment].com_m

    def where(self, person: Person) -> tuple[str, np.ndarray]:
        """The simulated body, and the place (3,) in its frame."""
        return body_of(self.segment), self.position_m(person)

    def facts(self, person: Person) -> dict[str, Any]:
        return {"position_m": self.position_m(person).tolist()}


def body_of(segment: str) -> str:
    """The simulated body of a segment; things on the upper torso sit on the thorax."""
    return "thorax" if segment == "upper_torso" else segment


def with_body(person: Person, segment: str, more: Inertia) -> Person:
    """The person with a rigid body fixed to a segment; ``more`` in the axes of its body."""
    body, origin = body_of(segment), np.zeros(3)
    heavier = combined([(person.inertias[body], origin), (more, origin)])
    return replace(person, inertias={**person.inertias, body: heavier})
