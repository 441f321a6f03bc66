"""What the columns of a force table mean: plate, quantity, axis and unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

# Words, then an axis with or without the letter of its quantity (vx, Fx, px, x), then what is left.
_WORDS = {
    **dict.fromkeys(("force", "forces", "grf", "grfs"), "force"),
    **dict.fromkeys(("cop", "pressure", "point", "position"), "point"),
    **dict.fromkeys(("moment", "moments", "grm"), "moment"),
    **dict.fromkeys(("torque", "torques"), "torque"),
    **dict.fromkeys(("left", "right"), "side"),
    **dict.fromkeys(("ground", "reaction", "plate", "platform", "external", "free"), ""),
    **dict.fromkeys(("centre", "center", "application", "applied"), ""),
}
_LETTERS = {"v": "force", "f": "force", "p": "point", "c": "point", "m": "moment", "t": "torque"}
_KNOWN = "|".join(sorted(_WORDS, key=len, reverse=True))
_AXIS = r"[vfpcmt]?[xyz](?=[lr]?(?![a-z]))"
_TOKEN = re.compile(
    rf"(?P<word>{_KNOWN}|fp(?![a-z]))|(?:(?<![a-z])of(?![a-z]))|(?P<number>\d+)|(?P<axis>{_AXIS})"
    rf"|(?P<other>[lr](?={_AXIS})|[a-z]+?(?={_KNOWN}|{_AXIS}|[^a-z]|$))"
)
_JOINT_REACTION = re.compile(r"_on_.+_in_")  # OpenSim's: body_on_body_in_frame
_UNIT = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")


@dataclass(frozen=True)
class Meaning:
    """What one column holds."""

    plate: str  # "" where the name says none
    quantity: str  # force, point, moment, torque
    axis: str  # x, y, z
    unit: str  # in brackets behind the name, "" without


@dataclass
class PlateColumns:
    """The columns of one plate, by quantity and axis."""

    plate: str
    columns: dict[str, dict[str, int]] = field(default_factory=dict)

    def of(self, quantity: str) -> list[int] | None:
        """Columns of x, y and z; None if one of them is missing."""
        found = self.columns.get(quantity, {})
        return [found[axis] for axis in "xyz"] if len(found) == 3 else None


def meaning_of(name: str) -> Meaning | None:
    """A column's meaning: '1_ground_force_px' is x of the point of plate '1'.

    None for a name with no axis, with two, or with no word or letter for a quantity, and for the
    force between two bodies.
    """
    unit = _UNIT.search(name)
    tokens = list(_TOKEN.finditer(_UNIT.sub("", name).lower()))
    axes = [token["axis"] for token in tokens if token["axis"]]
    if len(axes) != 1 or _JOINT_REACTION.search(name.lower()):
        return None
    words = [token["word"] for token in tokens if token["word"]]
    said = [quantity for word in words if (quantity := _WORDS.get(word, "")) not in ("", "side")]
    plate = [name for token in tokens if (name := token["number"] or token["other"])]
    plate += [word[0] for word in words if _WORDS.get(word) == "side"]
    letter = axes[0][:-1]
    if letter == "v" and "force" not in said and not {"ground", "fp"} & set(words):
        return None  # a velocity
    quantity = _LETTERS[letter] if letter else said[-1] if said else ""
    if not quantity and (alone := next((part for part in plate if part in _LETTERS), "")):
        plate.remove(alone)  # F1_x
        quantity = _LETTERS[alone]
    if not quantity:
        return None
    return Meaning("".join(plate), quantity, axes[0][-1], unit[1].strip() if unit else "")


def by_plate(names: Sequence[str]) -> tuple[list[PlateColumns], list[tuple[str, str]]]:
    """The columns of each plate that has forces, and pairs of names that mean the same."""
    plates: dict[str, PlateColumns] = {}
    twice = []
    for i, name in enumerate(names):
        if (meaning := meaning_of(name)) is None:
            continue
        plate = plates.setdefault(meaning.plate, PlateColumns(meaning.plate))
        first = plate.columns.setdefault(meaning.quantity, {}).setdefault(meaning.axis, i)
        if first != i:
            twice.append((names[first], name))
    return [plate for plate in plates.values() if "force" in plate.columns], twice
