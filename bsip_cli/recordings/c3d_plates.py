"""The force plates of a C3D file, SI, as its groups FORCE_PLATFORM and ANALOG describe them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from bsip_cli.recordings.analog import check_samples, sample_findings
from bsip_cli.recordings.c3d_content import Content
from bsip_cli.recordings.c3d_format import Group, number, numbers, texts, whole_numbers
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.plate_reading import AS_STATED
from bsip_cli.recordings.plate_wrench import lost_baseline
from bsip_cli.recordings.plates import (
    CHANNELS,
    CHANNELS_OF,
    LOADED_N,
    PlateDescription,
    corners_are_plausible,
    measured,
    parallelogram_gap,
    side_lengths,
)
from bsip_cli.recordings.plates_of_files import C3dPlate
from bsip_cli.recordings.units import force_in_N, length_in_m, moment_in_Nm

_MOST_PLATES = 64
_PLATE_UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "m": 1.0}
_USUAL_SIDES_M = (0.35, 1.25)  # of plates as they are sold: so that one unit alone can fit
_USUAL_LENGTHS_M = (1.0, 1e-3)  # m, mm
_SAME_PLACE_M = 1e-3  # as precise as corners are written
# Of the longest side: over 160 plates of the public recordings corners miss a rectangle's by 0.7 %.
_PARALLEL = 0.02
_PLACE_APART_M = 5e-3  # of two ways to read ORIGIN, that can be distinguished
_AXIS = re.compile(r"([FMTP])\d*([XYZ])")  # of a channel's label, in capitals: FX1, F1X, Force.Fx1
_VOLTS = {"V", "v", "Volts", "volts", "mV"}


class _UnusablePlateError(Exception):
    """Why one plate cannot be used, and what was expected; turned into a Finding."""

    def __init__(self, found: str, expected: str) -> None:
        super().__init__(found)
        self.words = found, expected


def read_plates(
    content: Content, length_unit_m: float, rotation_world_lab: np.ndarray
) -> tuple[list[C3dPlate], list[Finding], list[Finding]]:
    """All plates that the file describes and that its channels can fill, with their baseline
    subtracted and faulty samples marked; what is said of the descriptions, and of the samples.

    ``length_unit_m`` is the size of the unit of points, corners and origins.
    """
    plates, about_samples, filled = [], [], []
    group = content.group("FORCE_PLATFORM")
    stated = _stated_plates(group)
    table, findings = _channel_table(content)
    for index in range(_n_plates(group)):
        try:
            description, about = _description(group, index, length_unit_m)
            rows = _channel_rows(table, description.kind, index, content)
            channels, about_units = _in_si(content, description.kind, index, rows, length_unit_m)
        except _UnusablePlateError as why:
            if 0 < stated <= index:  # not used, as the file says
                continue
            action = "left the plate out; export the trial with its force plates set up"
            findings.append(Finding("plate", str(index + 1), *why.words, action, "excluded"))
            continue
        filled.append((description, rows, channels))
        findings += [*about, *about_units]
    upright, about_axes = _upright([(one.kind, channels) for one, _, channels in filled])
    findings += about_axes
    for (description, rows, _), channels in zip(filled, upright, strict=True):
        plate, faulty = _plate(content, description, rows, channels, rotation_world_lab)
        plates.append(plate)
        about_samples += faulty
    if _corners_by_rows(group):
        found, expected = "FORCE_PLATFORM:CORNERS has a row for each corner", "a column for each"
        findings.append(Finding("plate", "", found, expected, "read it so", "corrected"))
    if len(plates) > stated:
        found, expected = f"FORCE_PLATFORM:USED is {stated}", f"the {len(plates)} it describes"
        findings.append(Finding("plate", "", found, expected, "read them", "corrected"))
    return plates, findings + _about_places([plate.description for plate in plates]), about_samples


def _about_places(descriptions: Sequence[PlateDescription]) -> list[Finding]:
    """Corners that are no rectangle, and those of another plate."""
    said = []
    for one in descriptions:
        gap_m = parallelogram_gap(one.corners_m)
        if gap_m > _PARALLEL * side_lengths(one.corners_m).max():
            found = f"its corners are {1e3 * gap_m:.0f} mm away from a rectangle's"
            said.append((one.name, found, "a rectangle"))
    for one, other in combinations(descriptions, 2):
        if np.abs(one.corners_m - other.corners_m).max() < _SAME_PLACE_M:
            found = f"its corners are those of plate {one.name}"
            said.append((other.name, found, "a place of its own"))
    action = "took them as they are; correct FORCE_PLATFORM:CORNERS"
    return [Finding("plate", *words, action, "warning") for words in said]


def plate_surfaces(group: Group, length_unit_m: float) -> list[np.ndarray]:
    """Corners (4, 3) of every plausible plate, lab frame, even of those without channels."""
    surfaces = _all_corners(group)[: _n_plates(group)] * length_unit_m
    return [corners for corners in surfaces if corners_are_plausible(corners)]


def _all_corners(group: Group) -> np.ndarray:
    """(n, 4, 3), as written; also where rows stand for corners, which is no way of the format."""
    written = numbers(group, "CORNERS")
    flat = np.ravel(written.swapaxes(0, 1) if _corners_by_rows(group) else written, order="F")
    return flat[: len(flat) // 12 * 12].reshape(-1, 4, 3)


def _corners_by_rows(group: Group) -> bool:
    return numbers(group, "CORNERS").shape[:2] == (4, 3)


def _n_plates(group: Group) -> int:
    """As many as are used, or more that are described."""
    corners = _all_corners(group)[:_MOST_PLATES]
    is_place = [bool(np.isfinite(one).all() and np.ptp(one, axis=0).any()) for one in corners]
    return max([*is_place, False].index(False), _stated_plates(group))


def _stated_plates(group: Group) -> int:
    used = number(group, "USED")
    return int(min(max(used, 0), _MOST_PLATES)) if np.isfinite(used) else 0


def _plate(
    content: Content,
    description: PlateDescription,
    rows: np.ndarray,
    channels: np.ndarray,
    rotation_world_lab: np.ndarray,
) -> tuple[C3dPlate, list[Finding]]:
    """The plate whose channels (n, k) are those ``rows``, without its baseline where that is lost,
    its faulty samples marked; and what is said of these."""
    values = measured(channels, description.kind)
    source = C3dPlate(description, values, np.ones(len(values), bool), rotation_world_lab)
    lift, scales = values @ source.local(AS_STATED)[2], content.analog_scales[rows]
    counts = content.analog[rows].T / np.where(scales == 0, 1.0, scales)
    rate_hz = content.rate_hz * content.samples_per_frame
    samples = check_samples(channels, counts, lift, rate_hz)
    source = replace(source, usable=samples.usable())
    findings = sample_findings(description.name, samples, rate_hz, content.time0_s)
    group = content.group("FORCE_PLATFORM")
    baseline = _baseline(group, content.samples_per_frame, len(values))
    down = float(np.sign((rotation_world_lab @ description.rotation_lab_plate()[:, 2])[2]))
    lost = lost_baseline(down * lift, description.name, source.usable, baseline)
    if lost is None:
        return source, findings
    return replace(source, measured=values - values[baseline].mean(axis=0)), [*findings, lost]


def _baseline(group: Group, samples_per_frame: int, n_samples: int) -> slice | None:
    """Samples of FORCE_PLATFORM:ZERO, which counts frames from 1; (1, 0) and (0, x) mean none."""
    zero = np.ravel(whole_numbers(group, "ZERO"))
    if len(zero) < 2 or zero[0] < 1 or zero[1] <= zero[0]:
        return None
    start, stop = (int(zero[0]) - 1) * samples_per_frame, int(zero[1]) * samples_per_frame
    return slice(start, stop) if stop <= n_samples else None


# --- what FORCE_PLATFORM says of one plate --------------------------------------------------------


def _description(
    group: Group, index: int, length_unit_m: float
) -> tuple[PlateDescription, list[Finding]]:
    kinds, name = np.ravel(whole_numbers(group, "TYPE")), str(index + 1)
    if index >= len(kinds):
        raise _UnusablePlateError("no FORCE_PLATFORM:TYPE", "a type for each plate")
    if (kind := int(kinds[index])) not in CHANNELS_OF:
        raise _UnusablePlateError(f"force platform type {kind}", "types 1 to 4")
    _numbers_of(group, "CORNERS", index, 12)  # refuses a plate without
    written = _all_corners(group)[index]
    plate_unit_m, about = _plate_unit(written, length_unit_m, name)
    origin = _numbers_of(group, "ORIGIN", index, 3)
    size_m = side_lengths(written * plate_unit_m).max()  # sensors lie no deeper, no farther aside
    is_own = np.abs(origin).max() * plate_unit_m > size_m > np.abs(origin).max() * length_unit_m
    origin = origin * (length_unit_m if is_own else plate_unit_m)
    if kind == 3 and not origin[:2].all():
        found = "a type 3 plate whose ORIGIN lacks the distances of the sensors"
        raise _UnusablePlateError(found, "the half distances a and b of the sensors")
    polynomial = np.ravel(numbers(group, "FPCOPPOLY"), order="F")[12 * index : 12 * (index + 1)]
    corrects = kind == 3 and len(polynomial) == 12 and np.isfinite(polynomial).all()
    polynomials = polynomial.reshape(2, 6) if corrects and polynomial.any() else None
    stated = PlateDescription(name, kind, written * plate_unit_m, origin, polynomials)
    stated, about_origin = _without_place(stated)
    return stated, about + about_origin


def _numbers_of(group: Group, name: str, index: int, size: int) -> np.ndarray:
    """The part of an array parameter that belongs to one plate (the last axis counts plates)."""
    flat = np.ravel(numbers(group, name), order="F")
    if len(flat) < size * (index + 1):
        found = f"FORCE_PLATFORM:{name} has no entry for it"
        raise _UnusablePlateError(found, f"{size} numbers for each plate")
    return flat[size * index : size * (index + 1)]


def _plate_unit(
    written: np.ndarray, length_unit_m: float, name: str
) -> tuple[float, list[Finding]]:
    """Size of the unit of corners (4, 3): the points', or the one that makes them a plate."""
    if corners_are_plausible(written * length_unit_m):
        return length_unit_m, []
    low, high = _USUAL_SIDES_M
    fitting = {}
    for unit, size in _PLATE_UNITS.items():
        sides = side_lengths(written * size)
        if low <= sides.min() and sides.max() <= high and corners_are_plausible(written * size):
            fitting[unit] = size
    found, expected = _sides(written * length_unit_m), "a rectangle of 0.1 to 5 m"
    if len(fitting) != 1:
        raise _UnusablePlateError(f"corners that are no plate: {found}", expected)
    ((unit, size),) = fitting.items()
    action = f"read CORNERS in {unit}: {_sides(written * size)}"
    expected += " in the unit of the points"
    return size, [Finding("unit", name, found, expected, action, "corrected")]


def _sides(corners_m: np.ndarray) -> str:
    return "sides of " + ", ".join(f"{side:.3g}" for side in side_lengths(corners_m)) + " m"


def _without_place(stated: PlateDescription) -> tuple[PlateDescription, list[Finding]]:
    """With moments about the plate's centre where ORIGIN repeats its place in the laboratory.

    An offset in the plate's axes, which differ, is the same numbers by no chance.
    """
    centre, origin = stated.centre_m(), stated.origin_m
    in_plate = stated.rotation_lab_plate().T @ centre
    same = np.abs(origin - centre).max() < _SAME_PLACE_M
    if stated.kind == 3 or not same or np.abs(in_plate - centre).max() < _PLACE_APART_M:
        return stated, []
    numbers_mm = ", ".join(f"{1e3 * value:.0f}" for value in origin)
    found = f"ORIGIN is the plate's place in the laboratory ({numbers_mm} mm)"
    expected = "the way from the plate's sensor to the middle of its surface"
    action = "took the moments about the middle of its surface"
    about = Finding("plate_origin", stated.name, found, expected, action, "corrected")
    return replace(stated, origin_m=np.zeros(3)), [about]


# --- its channels ---------------------------------------------------------------------------------


def _channel_table(content: Content) -> tuple[np.ndarray, list[Finding]]:
    """FORCE_PLATFORM:CHANNEL, (channels, plates). Where the labels of the channels contradict it as
    the format wants it, and agree with one other way to write it, that one counts; where they agree
    with none and it names channels that are not there, the first that names some for all plates."""
    group, n_analog = content.group("FORCE_PLATFORM"), len(content.analog)
    table = np.atleast_1d(whole_numbers(group, "CHANNEL"))
    table = table[:, None] if table.ndim == 1 else table
    kinds = np.ravel(whole_numbers(group, "TYPE"))[: _n_plates(group)].tolist()
    if table.ndim != 2:
        return np.zeros((0, 0), int), []
    orders = {
        "": table,
        "stored by rows": np.ravel(table, order="F").reshape(table.shape),
        "stored with a row for each plate": table.T,
    }
    if table.shape[1] == 1 and kinds and not len(table) % len(kinds):
        orders["stored as one list"] = table.reshape(len(kinds), -1).T
    shifts, least = {"": 0, "counted from 0": 1}, int(table.min(initial=n_analog))
    if table.max(initial=0) - least + 1 == n_analog:  # of a file from which the first were cut
        shifts[f"counted from {least}"] = 1 - least
    ways = {
        " and ".join(filter(None, (order, count))): one + shift
        for (order, one), (count, shift) in product(orders.items(), shifts.items())
    }
    labels = texts(content.group("ANALOG"), "LABELS")[:n_analog]
    measuring = ["".join((_AXIS.findall(label.upper()) or [""])[-1]) for label in labels]
    by = "by the labels of its channels "
    fitting = [words for words, one in ways.items() if _fits(one, kinds, n_analog, measuring)]
    if not fitting:
        by = "by the number of its channels "
        fitting = [words for words, one in ways.items() if _fits(one, kinds, n_analog)][:1]
    are_one = all(np.array_equal(ways[words], ways[fitting[0]]) for words in fitting)
    if not fitting or not fitting[0] or not are_one:
        return table, []
    found = f"{by}FORCE_PLATFORM:CHANNEL is {fitting[0]}"
    expected = "counted from 1, a column for each plate"
    about = Finding("plate", "", found, expected, "read it so", "corrected")
    return ways[fitting[0]], [about]


def _fits(
    table: np.ndarray, kinds: Sequence[int], n_analog: int, measuring: Sequence[str] = ()
) -> bool:
    """Whether all plates have channels that are there and that measure by their labels, if these
    are asked, what the plates' types want."""
    for index, kind in enumerate(kinds):
        wanted = [name[:2].upper().replace("T", "M") for name in CHANNELS_OF.get(kind, ())]
        if not wanted or len(table) < len(wanted) or table.shape[1] <= index:
            return False
        rows = table[: len(wanted), index] - 1
        if rows.min() < 0 or rows.max() >= (len(measuring) or n_analog):
            return False
        if measuring and [measuring[row].replace("T", "M") for row in rows] != wanted:
            return False
    return bool(kinds)


def _channel_rows(table: np.ndarray, kind: int, index: int, content: Content) -> np.ndarray:
    """Of a plate, in the analog data: each a channel of its own that measures."""
    names, n_analog, n_plates = CHANNELS_OF[kind], len(content.analog), table.shape[1]
    if len(table) < len(names) or n_plates <= index:
        found = f"{len(table)} channels listed for it"
        expected = f"{len(names)} channels of a type {kind} plate"
        if n_plates >= len(names):
            found = f"FORCE_PLATFORM:CHANNEL has {len(table)} rows"
            expected += ", a column for each plate"
        raise _UnusablePlateError(found, expected)
    rows = table[: len(names), index] - 1
    if rows.max() >= n_analog:
        found = f"it claims analog channel {rows.max() + 1}"
        raise _UnusablePlateError(found, f"one of the file's {n_analog}")
    if rows.min() < 0:
        found = "it claims analog channel 0 in FORCE_PLATFORM:CHANNEL"
        raise _UnusablePlateError(found, f"one of the file's {n_analog}, counted from 1")
    for other in range(min(_n_plates(content.group("FORCE_PLATFORM")), n_plates)):
        shared = np.isin(rows, table[:, other] - 1)
        if other != index and shared.any() and not shared.all():  # all: a copy
            found = f"analog channel {rows[shared][0] + 1} is also listed for plate {other + 1}"
            raise _UnusablePlateError(found, "channels of its own in FORCE_PLATFORM:CHANNEL")
    raw, scales = content.analog[rows], content.analog_scales[rows]
    if not np.isfinite(scales).all() or not scales.any():  # one of size zero does not answer
        size = next((s for s in scales if not np.isfinite(s)), 0.0)
        found = f"ANALOG:GEN_SCALE times SCALE is {size:g}"
        raise _UnusablePlateError(found, "numbers other than 0")
    for i, j in combinations(range(len(names)), 2):
        # Single sensors of a symmetric load may be equal where somebody computed them.
        copied = kind != 3 and np.ptp(raw[i]) > 0 and np.array_equal(raw[i], raw[j])
        if rows[i] == rows[j] or copied:
            found = f"its {names[i]} and {names[j]} hold the same numbers"
            raise _UnusablePlateError(found, "an analog channel for each in FORCE_PLATFORM:CHANNEL")
    return rows


def _upright(plates: Sequence[tuple[int, np.ndarray]]) -> tuple[list[np.ndarray], list[Finding]]:
    """Channels (n, k) of plates, by their types, with the axes named so that Z bears the load: some
    write these in the axes of a laboratory whose X or Y is up, beside corners. Nobody stands on a
    plate by level forces alone."""
    channels, bearing = [one for _, one in plates], set[int]()
    own = [k for k, (kind, _) in enumerate(plates) if CHANNELS_OF[kind] == CHANNELS]
    for k in own:
        force = np.abs(channels[k][:, :3])
        loaded = np.linalg.norm(force, axis=1) > LOADED_N
        if loaded.any():
            bearing.add(int(np.argmax(force[loaded].mean(axis=0))))
    if len(bearing) != 1 or bearing == {2}:
        return channels, []
    (up,) = bearing
    order = [(up + 1 + axis) % 3 for axis in range(3)]
    for k in own:
        channels[k] = channels[k][:, [*order, *(3 + axis for axis in order)]]
    found = f"{CHANNELS[order[2]]} of the plates bears the load, and Fz does not"
    action = f"took {', '.join(CHANNELS[axis] for axis in order)} for Fx, Fy, Fz, and moments so"
    return channels, [Finding("plate", "", found, "Fz across the plate", action, "corrected")]


def _in_si(
    content: Content, kind: int, index: int, rows: np.ndarray, length_unit_m: float
) -> tuple[np.ndarray, list[Finding]]:
    """Channels (n, k) in N, N m and m, by the plate's matrix (6, 6) if it has one that is not zero.

    A unit that is no mechanical one (V) means N and N x length: volts may be scaled forces, a
    misprint not. Where no unit of moments is stated, nobody measures in N times cm or inches, but
    in N mm, or, as the feet show, N m.
    """
    raw = content.analog[rows].T
    usual_Nm = length_unit_m if length_unit_m in _USUAL_LENGTHS_M else 1e-3
    matrix = numbers(content.group("FORCE_PLATFORM"), "CAL_MATRIX")
    if kind == 4 and matrix.ndim == 3 and matrix.shape[:2] == (6, 6) and matrix.shape[2] > index:
        own = matrix[:, :, index]
        if own.any():
            return raw @ own.T * np.repeat([1.0, usual_Nm], 3), []
    stated = texts(content.group("ANALOG"), "UNITS")
    units = [stated[row] if row < len(stated) else "" for row in rows]
    moment = moment_in_Nm, usual_Nm
    usual = {"F": (force_in_N, 1.0), "P": (length_in_m, length_unit_m), "M": moment, "T": moment}
    sizes = []
    for name, unit in zip(CHANNELS_OF[kind], units, strict=True):
        known, otherwise = usual[name[0]]
        sizes.append(known(unit) or otherwise)
    known_ones = (force_in_N, moment_in_Nm, length_in_m)
    odd = {unit for unit in units if unit and all(size(unit) is None for size in known_ones)}
    found = f"channels in {', '.join(sorted(map(repr, odd)))}"
    expected = "N and N mm or N m, or a calibration matrix"
    action = "took the scaled numbers as N, and as N times the unit of length"
    level = "info" if odd <= _VOLTS else "warning"
    about = Finding("unit", str(index + 1), found, expected, action, level)
    return raw * np.array(sizes), [about] if odd else []
