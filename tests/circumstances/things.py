"""What may be done to an export, one entry each: kind, slot, and a function that does it.

A function changes the export by its own draw and returns what it did in words. Two things of the
same slot would undo each other; a circumstance has one of a slot at most.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.circumstances.export import Y_UP, Export

Change = Callable[[Export, np.random.Generator, int], str]
Damage = Callable[[np.ndarray, float, np.random.Generator], np.ndarray]


@dataclass(frozen=True)
class Thing:
    """kind : as in the table of outcomes. formats : where it can happen.

    name : of the matter that must be named, a pattern of judge.NAMES, where the numbers of the
        artifacts cannot show it: a stated mass in pounds. Empty: the numbers tell.
    """

    kind: str
    slot: str
    change: Change
    formats: tuple[str, ...] = ("c3d", "trc")
    name: str = ""

    @property
    def id(self) -> str:
        return self.change.__name__


def pick(rng: np.random.Generator, options: Any) -> Any:
    """One of the options."""
    options = list(options)
    return options[int(rng.integers(len(options)))]


# Units of length


def points_unit_stated(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit = pick(rng, ("cm", "m", "in"))
    export.point_unit = export.corner_unit = unit
    export.stated_point_unit = pick(rng, ("in", "inches")) if unit == "in" else unit
    return f"points in {unit}, said to be {export.stated_point_unit}"


def points_unit_wrong(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit, stated = pick(rng, (("mm", "m"), ("m", "mm"), ("cm", "mm"), ("cm", "m"), ("in", "mm")))
    export.point_unit = export.corner_unit = unit
    export.stated_point_unit = stated
    return f"points in {unit}, said to be {stated}"


def points_unit_blank(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit = pick(rng, ("mm", "cm", "m", "in"))
    export.point_unit = export.corner_unit = unit
    export.stated_point_unit = ""
    return f"points in {unit}, unit blank"


def corners_other_unit(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.corner_unit = pick(rng, ("m", "cm", "in"))
    return f"points in mm, plate corners in {export.corner_unit}"


# Moments


def moments_Nm_stated(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.moment_unit = "Nm"
    export.stated_moment_unit = pick(rng, ("Nm", "N m", "N*m", "N.m"))
    return f"moments in N m, said to be {export.stated_moment_unit}"


def moments_blank(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.moment_unit = pick(rng, ("Nm", "Nmm"))
    export.stated_moment_unit = ""
    return f"moments in {export.moment_unit}, unit blank"


def moments_wrong(export: Export, rng: np.random.Generator, plates: int) -> str:
    unit, stated = pick(rng, (("Nm", "Nmm"), ("Nmm", "Nm")))
    export.moment_unit, export.stated_moment_unit = unit, stated
    return f"moments in {unit}, said to be {stated}"


def mot_moments_Nmm(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.moment_unit = "Nmm"
    return "moments in N mm"


def mot_adapter_units(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.moment_unit, export.mot_point_unit = "Nmm", "mm"
    return "force table with points in mm and moments in N mm"


def mot_points_unit(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_point_unit = pick(rng, ("mm", "cm"))
    return f"force table with points in {export.mot_point_unit}, moments in N m"


# What the moments are about


def surface_origin_zero(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.reference, export.origin = "surface", "zero"
    return "moments about the surface's centre, ORIGIN zero"


def surface_origin_given(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.reference, export.origin = "surface", "sensor"
    return "moments about the surface's centre, ORIGIN gives the sensor"


def origin_reversed(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.origin = "reversed"
    return "ORIGIN with the other sign"


def origin_place(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.origin = "place"
    return "ORIGIN is the plate's place in the lab"


def mot_about_centre(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.reference = "plate_centre"
    return "points of pressure beside moments about the plate's centre"


def mot_about_origin(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.reference = "lab_origin"
    return "points of pressure beside moments about the lab's origin"


def mot_no_points(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_points = False
    export.reference = pick(rng, ("point", "plate_centre", "lab_origin"))
    return f"no points in the force table, moments about the {export.reference}"


def mot_no_moments(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_moments = False
    return "no moments in the force table"


def mot_forces_only(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_points = export.mot_moments = False
    return "neither points nor moments in the force table"


# Axes

X_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
Z_DOWN = np.diag([1.0, -1.0, -1.0])
Y_DOWN = Z_DOWN @ Y_UP


def _about_vertical(degrees: float) -> np.ndarray:
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


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
    axis = pick(rng, (0, 1))
    export.axes = export.axes @ np.diag([-1.0 if k == axis else 1.0 for k in range(3)])
    return "left-handed export of points and forces"


def mirrored_markers(export: Export, rng: np.random.Generator, plates: int) -> str:
    axis = pick(rng, (0, 1))
    mirror = np.diag([-1.0 if k == axis else 1.0 for k in range(3)])
    export.marker_axes = _in_exported(mirror, export)
    return "left-handed export of the points only"


def mirrored_forces(export: Export, rng: np.random.Generator, plates: int) -> str:
    axis = pick(rng, (0, 1))
    mirror = np.diag([-1.0 if k == axis else 1.0 for k in range(3)])
    export.force_axes = _in_exported(mirror, export)
    return "left-handed export of the forces and plates only"


def forces_turned(export: Export, rng: np.random.Generator, plates: int) -> str:
    degrees = pick(rng, (90.0, 180.0, 270.0, 30.0))
    export.force_axes = _in_exported(_about_vertical(degrees), export)
    return f"forces and plates turned by {degrees:.0f} degrees against the points"


# Signs


def all_signs(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.channel_signs = -np.ones(6)
    return "all six channels as the force on the ground"


def force_signs(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.channel_signs = np.array([-1.0] * 3 + [1.0] * 3)
    return "forces with the other sign, moments not"


def moment_signs(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.channel_signs = np.array([1.0] * 3 + [-1.0] * 3)
    return "moments with the other sign, forces not"


CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def one_component(export: Export, rng: np.random.Generator, plates: int) -> str:
    component = int(rng.integers(6))
    export.channel_signs = np.array([-1.0 if k == component else 1.0 for k in range(6)])
    return f"component {CHANNELS[component]} with the other sign"


def one_plate_signs(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate = _one_of(rng, plates)
    export.plate_signs = {plate: -np.ones(6)}
    return f"all six channels of plate {plate + 1} with the other sign"


def one_plate_component(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate, component = _one_of(rng, plates), int(rng.integers(6))
    export.plate_signs = {plate: np.array([-1.0 if k == component else 1.0 for k in range(6)])}
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


def corners_wound(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.corner_wound = True
    return "corners wound the other way"


def plate_doubled(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.doubled = True
    return "plate 1 twice"


def plate_sum(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.summed = True
    return "a virtual plate that is the sum of the others"


def plates_height(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.plate_rise_m = float(rng.choice([-1, 1]) * rng.uniform(0.2, 0.8))
    return f"the plates' surface stated {export.plate_rise_m:.2f} m too high"


def channel_twice(export: Export, rng: np.random.Generator, plates: int) -> str:
    plate, (one, other) = _one_of(rng, plates), rng.choice(6, 2, replace=False)
    export.listed_twice = {plate: (int(one), int(other))}
    return f"{CHANNELS[other]} of plate {plate + 1} listed as the channel of {CHANNELS[one]}"


def plate_type(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.plate_type = pick(rng, (1, 3, 4))
    return f"plates of type {export.plate_type}"


def calibration_in_Nm(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.plate_type, export.moment_unit = 4, "Nm"
    return "plates of type 4, CAL_MATRIX in N m, channels in V"


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


def tared(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.tared = True
    return "plates zeroed as each trial begins, whoever stands on them"


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


def rates(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.marker_hz = float(pick(rng, (50, 60, 85, 120, 150, 200, 240, 250)))
    export.analog_per_marker = int(pick(rng, (1, 2, 4, 5, 8, 10)))
    return f"markers at {export.marker_hz:g} Hz, forces {export.analog_per_marker} times as fast"


def other_rate_stated(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.stated_rate = pick(rng, (0.5, 0.8, 1.2, 2.0))
    return f"the file states {export.stated_rate:g} times the cameras' rate"


def force_rate_stated(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_rate = pick(rng, (0.5, 0.8, 1.2, 2.0))
    return f"times of the force table of {export.mot_rate:g} times the plates' rate"


def forces_late(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.late_s = float(rng.choice([-1, 1]) * np.exp(rng.uniform(np.log(0.05), np.log(1.0))))
    return f"forces {export.late_s:.2f} s late"


def forces_of_another(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.of_another = True
    return "the force tables of the two trials exchanged"


def few_decimals(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.marker_hz = float(pick(rng, (60, 120, 240)))
    export.time_decimals = 3 if export.marker_hz > 120 else pick(rng, (2, 3))
    return f"{export.marker_hz:g} Hz, times printed with {export.time_decimals} decimals"


def milliseconds(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.time_unit, export.time_decimals = "ms", pick(rng, (0, 1, 3))
    return "times in ms"


def frame_numbers(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.time_unit = "frames"
    return "frame numbers instead of times in the TRC"


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


def residuals_negative(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.residuals = "negative"
    return "all residuals -1"


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


def mot_file_name(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_suffix = pick(rng, (".MOT", ".sto", "_forces.mot", "_grf.mot"))
    return f"force table in a file that ends in {export.mot_suffix}"


def nan_when_unloaded(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mot_unloaded = "nan"
    return "points and moments NaN while a plate is unloaded"


# participants.tsv


def mass_in_pounds(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.mass_unit = "lb"
    return "mass in pounds"


def height_in_cm(export: Export, rng: np.random.Generator, plates: int) -> str:
    export.height_unit = pick(rng, ("cm", "in", "mm"))
    return f"height in {export.height_unit}"


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


C3D, TEXT = ("c3d",), ("trc",)
NO_EXPORT = "wrong forces"
"""What no other understanding of the numbers puts right: it is to be refused or said."""
THINGS = (
    Thing("length unit", "length", points_unit_stated),
    Thing("length unit", "length", points_unit_wrong),
    Thing("length unit", "length", points_unit_blank),
    Thing("length unit", "length", corners_other_unit, C3D),
    Thing("moment unit", "moment", moments_Nm_stated, C3D),
    Thing("moment unit", "moment", moments_blank, C3D),
    Thing("moment unit", "moment", moments_wrong, C3D),
    Thing("moment unit", "moment", mot_moments_Nmm, TEXT),
    Thing("moment unit", "moment", mot_adapter_units, TEXT),
    Thing("moment unit", "moment", mot_points_unit, TEXT),
    Thing("moment reference", "reference", surface_origin_zero, C3D),
    Thing("moment reference", "reference", surface_origin_given, C3D),
    Thing("moment reference", "reference", origin_reversed, C3D),
    Thing("moment reference", "reference", origin_place, C3D),
    Thing("moment reference", "reference", mot_about_centre, TEXT),
    Thing("moment reference", "reference", mot_about_origin, TEXT),
    Thing("moment reference", "reference", mot_no_points, TEXT),
    Thing("moment reference", "reference", mot_no_moments, TEXT),
    Thing("moment reference", "reference", mot_forces_only, TEXT),
    Thing("axes", "axes", other_axis_up),
    Thing("axes", "axes", odd_angle),
    Thing("mirrored", "axes", mirrored_all),
    Thing("mirrored", "axes", mirrored_markers),
    Thing("mirrored", "axes", mirrored_forces),
    Thing("axes", "axes", forces_turned),
    Thing("signs", "signs", all_signs),
    Thing("signs", "signs", force_signs),
    Thing("signs", "signs", moment_signs),
    Thing("signs", "signs", one_component),
    Thing("signs", "signs", one_plate_signs),
    Thing("signs", "signs", one_plate_component),
    Thing("signs", "signs", one_plate_horizontal, C3D),
    Thing("signs", "signs", one_plate_axes, C3D),
    Thing("signs", "signs", level_exchanged),
    Thing("plates", "plates", plates_exchanged),
    Thing("plates", "plates", corners_turned, C3D),
    Thing("plates", "plates", corners_wound, C3D),
    Thing("plates", "plates", plate_doubled),
    Thing("plates", "plates", plate_sum),
    Thing(NO_EXPORT, "plates_height", plates_height),
    Thing(NO_EXPORT, "channels", channel_twice, C3D),
    Thing("plate type", "type", plate_type, C3D),
    Thing("plate type", "moment", calibration_in_Nm, C3D),
    Thing("plate type", "type", sensors_exchanged, C3D),
    Thing("samples", "samples", spikes, C3D),
    Thing("samples", "samples", cut_off, C3D),
    Thing("samples", "samples", lost_samples, C3D),
    Thing(NO_EXPORT, "samples", tared),
    Thing(NO_EXPORT, "gain", one_plate_gain),
    Thing(NO_EXPORT, "force_unit", force_unit, TEXT),
    Thing("time", "time", rates),
    Thing("time", "time", other_rate_stated),
    Thing("time", "time", force_rate_stated, TEXT),
    Thing("time", "time", forces_late),
    Thing(NO_EXPORT, "time", forces_of_another, TEXT),
    Thing("time", "time", few_decimals, TEXT),
    Thing("time", "time", milliseconds, TEXT),
    Thing("time", "time", frame_numbers, TEXT),
    Thing("time", "time", shifted_start, TEXT),
    Thing("time", "time", points_start_later, TEXT),
    Thing("labels", "labels", prefix),
    Thing("labels", "labels", lower_case),
    Thing("labels", "labels", separators),
    Thing("labels", "labels", cut_labels),
    Thing("missing", "missing", missing_values),
    Thing("missing", "residuals", residuals_negative, C3D),
    Thing("missing", "unnamed", unnamed_columns, TEXT),
    Thing("force table", "names", mot_names, TEXT),
    Thing("force table", "file", mot_file_name, TEXT),
    Thing("force table", "unloaded", nan_when_unloaded, TEXT),
    Thing("person", "mass", mass_in_pounds, name="mass"),
    Thing("person", "height", height_in_cm, name="height"),
    Thing("person", "sex", sex_in_words),
    Thing("person", "table", table_format),
)
KINDS = tuple(dict.fromkeys(thing.kind for thing in THINGS))
