"""What may be done to an export: things.csv has a row for each, kind, slot and what it sets.

What draws more than the value of a field is a function here: it changes the export by its own draw
and returns what it did in words. Two things of the same slot would undo each other; a circumstance
has one of a slot at most.
"""

from __future__ import annotations

import csv
from ast import literal_eval
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.circumstances.export import Y_UP, Export

Change = Callable[[Export, np.random.Generator, int], str]
Damage = Callable[[np.ndarray, float, np.random.Generator], np.ndarray]
NO_EXPORT = "wrong forces"
"""What no other understanding of the numbers puts right: it is to be refused or said."""


@dataclass(frozen=True)
class Thing:
    """kind : as in the table of outcomes. formats : where it can happen.

    name : of the matter that must be named, a pattern of judge.NAMES, where the numbers of the
        artifacts cannot show it: a stated mass in pounds. Empty: the numbers tell.
    """

    id: str
    kind: str
    slot: str
    name: str
    formats: tuple[str, ...]
    change: Change


def pick(rng: np.random.Generator, options: Any) -> Any:
    """One of the options."""
    options = list(options)
    return options[int(rng.integers(len(options)))]


def _setting(row: Mapping[str, str]) -> Change:
    """What sets fields, ``field=value; field=one|other``, and says so with their values."""
    fields = [field.split("=") for field in row["sets"].split("; ")]

    def change(export: Export, rng: np.random.Generator, plates: int) -> str:
        for name, values in fields:
            options = list(map(_value, values.split("|")))
            setattr(export, name, pick(rng, options) if len(options) > 1 else options[0])
        return row["says"].format(**vars(export))

    return change


def _value(text: str) -> Any:
    """A number, True, a tuple of numbers; else a text."""
    with suppress(ValueError, SyntaxError):
        return literal_eval(text)
    return text


# Units of length


def _points(export: Export, unit: str, stated: str) -> None:
    export.point_unit = export.corner_unit = unit
    export.stated_point_unit = stated


def points_unit_stated(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit = pick(rng, ("cm", "m", "in"))
    _points(export, unit, pick(rng, ("in", "inches")) if unit == "in" else unit)
    return f"points in {unit}, said to be {export.stated_point_unit}"


def points_unit_wrong(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit, stated = pick(rng, (("mm", "m"), ("m", "mm"), ("cm", "mm"), ("cm", "m"), ("in", "mm")))
    _points(export, unit, stated)
    return f"points in {unit}, said to be {stated}"


def points_unit_blank(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit = pick(rng, ("mm", "cm", "m", "in"))
    _points(export, unit, "")
    return f"points in {unit}, unit blank"


# Moments


def moments_wrong(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit, stated = pick(rng, (("Nm", "Nmm"), ("Nmm", "Nm")))
    export.moment_unit, export.stated_moment_unit = unit, stated
    return f"moments in {unit}, said to be {stated}"


# Axes

X_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
Z_DOWN = np.diag([1.0, -1.0, -1.0])


def _about_vertical(degrees: float) -> np.ndarray:
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _mirror(rng: np.random.Generator) -> np.ndarray:
    """Of one level axis."""
    axis = pick(rng, (0, 1))
    return np.diag([-1.0 if k == axis else 1.0 for k in range(3)])


def _reversed_one(component: int) -> np.ndarray:
    return np.array([-1.0 if k == component else 1.0 for k in range(6)])


def _in_exported(turn: np.ndarray, export: Export) -> np.ndarray:
    """A change of the lab's axes, as one of the exported axes."""
    return export.axes @ turn @ export.axes.T


def other_axis_up(export: Export, rng: np.random.Generator, plates: int) -> str:
    upright = np.eye(3) if export.format == "trc" else Y_UP
    name, axes = pick(rng, (("Y or Z", upright), ("X", X_UP), ("-Z", Z_DOWN)))
    export.axes = axes
    return f"axis {name} up (the format's other one)" if name == "Y or Z" else f"axis {name} up"


def odd_angle(export: Export, rng: np.random.Generator, plates: int) -> str:
    degrees = float(rng.uniform(5.0, 85.0))
    export.axes = export.axes @ _about_vertical(degrees)
    return f"lab turned by {degrees:.0f} degrees about the vertical"


def mirrored_all(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.axes = export.axes @ _mirror(rng)
    return "left-handed export of points and forces"


def mirrored_markers(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.marker_axes = _in_exported(_mirror(rng), export)
    return "left-handed export of the points only"


def mirrored_forces(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.force_axes = _in_exported(_mirror(rng), export)
    return "left-handed export of the forces and plates only"


def forces_turned(export: Export, rng: np.random.Generator, plates: int) -> str:
    degrees = pick(rng, (90.0, 180.0, 270.0, 30.0))
    export.force_axes = _in_exported(_about_vertical(degrees), export)
    return f"forces and plates turned by {degrees:.0f} degrees against the points"


# Signs

CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def one_component(export: Export, rng: np.random.Generator, plates: int) -> str:
    component = int(rng.integers(6))
    export.channel_signs = _reversed_one(component)
    return f"component {CHANNELS[component]} with the other sign"


def one_plate_signs(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate = _one_of(rng, plates)
    export.plate_signs = {plate: -np.ones(6)}
    return f"all six channels of plate {plate + 1} with the other sign"


def one_plate_component(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate, component = _one_of(rng, plates), int(rng.integers(6))
    export.plate_signs = {plate: _reversed_one(component)}
    return f"component {CHANNELS[component]} of plate {plate + 1} with the other sign"


def one_plate_horizontal(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate = _one_of(rng, plates)
    export.plate_signs = {plate: np.array([-1.0, -1.0, 1.0, 1.0, 1.0, 1.0])}
    return f"Fx and Fy of plate {plate + 1} with the other sign, moments not"


def one_plate_axes(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate = _one_of(rng, plates)
    export.exchanged = {plate: (True, True)}
    return f"Fx and Fy, Mx and My of plate {plate + 1} exchanged"


def level_exchanged(export: Export, rng: np.random.Generator, plates: int) -> str:
    which = range(plates) if rng.random() < 0.6 else [_one_of(rng, plates)]
    forces = bool(rng.random() < 0.6)
    export.exchanged = dict.fromkeys(which, (forces, not forces))
    named = ", ".join(str(k + 1) for k in which)
    return f"the level {'forces' if forces else 'moments'} of plate {named} exchanged"


def sensors_exchanged(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate, names = (
        _one_of(rng, plates),
        ("Fx12", "Fx34", "Fy14", "Fy23", "Fz1", "Fz2", "Fz3", "Fz4"),
    )
    first = 4 if rng.random() < 0.7 else 0
    one, other = (int(k) for k in first + rng.choice(4, 2, replace=False))
    export.plate_type, export.sensors_exchanged = 3, {plate: (one, other)}
    return f"{names[one]} and {names[other]} of plate {plate + 1}, of type 3, exchanged"


# Plates


def plates_exchanged(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.plate_order = [1, 0, *range(2, plates)]
    return "the readings of plates 1 and 2 exchanged"


def corners_turned(export: Export, rng: np.random.Generator, plates: int) -> str:
    turn = int(rng.integers(1, 4))
    which = range(plates) if rng.random() < 0.6 else [_one_of(rng, plates)]
    export.corner_roll = dict.fromkeys(which, turn)
    named = ", ".join(str(k + 1) for k in which)
    return f"corners of plate {named} turned by {90 * turn} degrees"


def plates_height(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.plate_rise_m = float(rng.choice([-1, 1]) * rng.uniform(0.2, 0.8))
    return f"the plates' surface stated {export.plate_rise_m:.2f} m too high"


def channel_twice(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate, (one, other) = _one_of(rng, plates), rng.choice(6, 2, replace=False)
    export.listed_twice = {plate: (int(one), int(other))}
    return f"{CHANNELS[other]} of plate {plate + 1} listed as the channel of {CHANNELS[one]}"


# Samples of one plate, in every trial


def spikes(export: Export, rng: np.random.Generator, plates: int) -> str:
    count, times = int(rng.integers(1, 9)), float(np.exp(rng.uniform(np.log(0.2), np.log(4.0))))

    def hit(channels: np.ndarray, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
        channels = channels.copy()
        for sample in rng.integers(0, len(channels), count):
            channel = int(rng.integers(channels.shape[1]))
            height = times * np.abs(channels[:, channel]).max()
            channels[sample, channel] += rng.choice([-height, height])
        return channels

    return _damaged(export, rng, plates, hit, f"{count} spikes {times:.1f} times the largest load")


def cut_off(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.limit_share, export.damaged_plate = float(rng.uniform(0.1, 0.9)), _one_of(rng, plates)
    return (
        f"plate {export.damaged_plate + 1}: vertical channel cut at {export.limit_share:.0%} of "
        "the way from quiet stance to its largest"
    )


def lost_samples(export: Export, rng: np.random.Generator, plates: int) -> str:
    count, length_s = int(rng.integers(1, 5)), float(rng.uniform(0.003, 0.06))

    def hit(channels: np.ndarray, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
        channels, length = channels.copy(), max(round(length_s * rate_hz), 1)
        for first in rng.integers(0, len(channels) - length, count):
            channels[first : first + length] = 0.0
        return channels

    return _damaged(export, rng, plates, hit, f"all zero {count} times for {length_s:.3f} s")


def one_plate_gain(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate, gain = _one_of(rng, plates), pick(rng, (0.5, 0.8, 1.25, 2.0))
    export.plate_gains, export.stated_mass = {plate: gain}, True
    return f"plate {plate + 1} reads {gain:g} times the load; the mass is stated"


def force_unit(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit, export.mot_force_N = pick(rng, (("kN", 1000.0), ("lbf", 4.448222), ("kgf", 9.80665)))
    return f"forces and moments in {unit} for N"


def _damaged(export: Export, rng: np.random.Generator, plates: int, hit: Damage, words: str) -> str:
    export.damage, export.damaged_plate = hit, _one_of(rng, plates)
    return f"plate {export.damaged_plate + 1}: {words}"


def _one_of(rng: np.random.Generator, plates: int) -> int:
    """One of the two plates that are surely stepped on."""
    return int(rng.integers(min(plates, 2)))


# Time


def forces_late(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.late_s = float(rng.choice([-1, 1]) * np.exp(rng.uniform(np.log(0.05), np.log(1.0))))
    return f"forces {export.late_s:.2f} s late"


def few_decimals(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.marker_hz = float(pick(rng, (60, 120, 240)))
    export.time_decimals = 3 if export.marker_hz > 120 else pick(rng, (2, 3))
    return f"{export.marker_hz:g} Hz, times printed with {export.time_decimals} decimals"


def shifted_start(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.trc_start_s = export.mot_start_s = float(np.round(rng.uniform(0.5, 20.0), 2))
    return f"times start at {export.trc_start_s:g} s"


def points_start_later(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.trc_start_s = float(np.round(rng.uniform(0.5, 20.0), 2))
    return f"times of the points start at {export.trc_start_s:g} s, those of the forces at 0"


# Labels


def prefix(export: Export, rng: np.random.Generator, plates: int) -> str:
    text = pick(rng, ("Anna:", "subject1_", "S01.", "skeleton_007:", "P3-", "Jean Paul:"))
    export.label = lambda name: text + name
    return f"labels with {text!r} in front"


def lower_case(export: Export, rng: np.random.Generator, plates: int) -> str:
    change = pick(rng, (str.lower, str.title))
    export.label = change
    return f"labels as {change('RASIS')}"


def separators(export: Export, rng: np.random.Generator, plates: int) -> str:
    mark = pick(rng, ("_", ".", "-", " "))
    export.label = lambda name: name[0] + mark + name[1:] if name[0] in "RL" else name
    return f"labels as {export.label('RASIS')}"


def cut_labels(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.label = lambda name: name[:4]
    return "labels cut to four letters"


# Missing points


def missing_values(export: Export, rng: np.random.Generator, plates: int) -> str:
    stores = ("nan", "zero", "held", "-16512", "-9999")
    export.missing = pick(rng, stores if export.format == "c3d" else (*stores, "9999999"))
    export.hidden_share = float(rng.uniform(0.04, 0.2))
    return f"hidden points ({export.hidden_share:.0%} of the time) stored as {export.missing}"


def unnamed_columns(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.unnamed = int(rng.integers(1, 4))
    return f"{export.unnamed} unnamed trajectories in every third row"


# Dialects of force tables


def mot_names(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_columns = pick(
        rng,
        (
            "{n}_ground_force_v{a} {n}_ground_force_p{a} {n}_ground_torque_{a}",
            "ground_force{n}_v{a} ground_force{n}_p{a} ground_torque{n}_{a}",
            "force{n}_v{a} force{n}_p{a} torque{n}_{a}",
            "FP{n}_v{a} FP{n}_p{a} FP{n}_m{a}",
            "plate{n}_force_{a} plate{n}_cop_{a} plate{n}_moment_{a}",
        ),
    )
    return f"columns named {export.mot_columns.split()[0].format(n=1, a='x')}"


# participants.tsv


def sex_in_words(export: Export, rng: np.random.Generator, plates: int) -> str:
    male, female = pick(
        rng,
        (("male", "female"), ("Male", "Female"), ("m", "f"), ("man", "woman"), ("Mann", "Frau")),
    )
    export.sex = {"M": male, "F": female}
    return f"sex as {male} and {female}"


def table_format(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.separator = pick(rng, ("\t", ",", ";"))
    export.encoding = pick(rng, ("utf-8", "utf-8-sig", "utf-16"))
    export.trailing_lines = int(rng.integers(0, 3))
    return (
        f"participants.tsv with {export.separator!r}, {export.encoding}, "
        f"{export.trailing_lines} empty lines at the end"
    )


def _things() -> tuple[Thing, ...]:
    with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return tuple(
        Thing(
            *(row[name] for name in ("id", "kind", "slot", "name")),
            tuple(row["formats"].split()),
            _setting(row) if row["sets"] else globals()[row["id"]],
        )
        for row in rows
    )


THINGS = _things()
KINDS = tuple(dict.fromkeys(thing.kind for thing in THINGS))
