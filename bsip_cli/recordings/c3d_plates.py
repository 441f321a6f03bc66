"""The FORCE_PLATFORM and ANALOG groups of a C3D file, one plate at a time, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.c3d_content import Content
from bsip_cli.recordings.c3d_parameters import Group, number, numbers, texts, whole_numbers
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.plates import N_CHANNELS, PlateDescription, corners_are_plausible
from bsip_cli.recordings.units import force_in_N, length_in_m, moment_in_Nm


@dataclass(frozen=True, eq=False)
class PlateChannels:
    """One plate's description and its channels."""

    plate: PlateDescription
    channels: np.ndarray  # (n, 6 or 8): N and N m (type 1: m), sensor's origin, plate frame
    counts: np.ndarray  # (n, 6 or 8): the same as converter counts, to see the rails
    baseline: slice | None  # analog samples of FORCE_PLATFORM:ZERO


_MOST_PLATES = 64
_PLATE_UNITS = ("mm", "cm", "in", "m")
_USUAL_SIDES_M = (0.35, 1.25)  # of plates as they are sold: so that one unit alone can fit
_USUAL_LENGTHS_M = (1.0, 1e-3)  # m, mm
_VOLTS = {"V", "v", "Volts", "volts", "mV"}


class _UnusablePlateError(Exception):
    """Why one plate cannot be used, and what was expected; turned into a Finding."""

    def __init__(self, found: str, expected: str) -> None:
        super().__init__(found)
        self.found = found
        self.expected = expected


def read_plates(
    content: Content, length_unit_m: float
) -> tuple[list[PlateChannels], list[Finding]]:
    """All plates that the file describes and that its channels can fill.

    ``length_unit_m`` is the size of the unit of points, corners and origins.
    """
    group = content.group("FORCE_PLATFORM")
    plates, findings = [], []
    for index in range(_n_plates(group)):
        try:
            plate, about_units = _read_plate(content, length_unit_m, index)
            plates.append(plate)
            findings += about_units
        except _UnusablePlateError as reason:
            action = "left the plate out; export the trial with its force plates set up"
            findings.append(
                Finding("plate", str(index + 1), reason.found, reason.expected, action, "excluded")
            )
    return plates, findings


def plate_surfaces(group: Group, length_unit_m: float) -> list[np.ndarray]:
    """Corners (4, 3) of every plausible plate, lab frame, even of those without channels."""
    surfaces = []
    for index in range(_n_plates(group)):
        try:
            surfaces.append(_slab(group, "CORNERS", index, (3, 4)).T * length_unit_m)
        except _UnusablePlateError:
            break
    return [corners for corners in surfaces if corners_are_plausible(corners)]


def _n_plates(group: Group) -> int:
    used = number(group, "USED")
    return int(min(max(used, 0), _MOST_PLATES)) if np.isfinite(used) else 0


def _read_plate(
    content: Content, length_unit_m: float, index: int
) -> tuple[PlateChannels, list[Finding]]:
    group = content.group("FORCE_PLATFORM")
    kind = _kind(group, index)
    written = _slab(group, "CORNERS", index, (3, 4)).T
    plate_unit_m, about_size = _plate_unit(written, length_unit_m, index)
    corners = written * plate_unit_m
    origin = _slab(group, "ORIGIN", index, (3,)) * plate_unit_m
    if kind == 3 and not origin[:2].all():
        raise _UnusablePlateError(
            "a type 3 plate whose ORIGIN lacks the distances of the sensors",
            "the half distances a and b of the sensors",
        )
    rows = _channel_rows(group, kind, index, len(content.analog))
    raw = content.analog[rows].T
    scales = content.analog_scales[rows]
    _check_scales(scales)
    plate = PlateChannels(
        plate=PlateDescription(
            str(index + 1), kind, corners, origin, _cop_polynomial(group, kind, index)
        ),
        channels=_in_si(content, kind, index, raw, rows, length_unit_m),
        counts=raw / np.where(scales == 0, 1.0, scales),
        baseline=_baseline(group, content.samples_per_frame, len(raw)),
    )
    return plate, [*about_size, *_about_units(content, kind, index, rows)]


def _plate_unit(
    written: np.ndarray, length_unit_m: float, index: int
) -> tuple[float, list[Finding]]:
    """Size of the unit of corners (4, 3): the points', or the one that makes them a plate."""
    if corners_are_plausible(written * length_unit_m):
        return length_unit_m, []
    sizes = {name: size for name in _PLATE_UNITS if (size := length_in_m(name)) is not None}
    fitting = {name: size for name, size in sizes.items() if _is_usual_plate(written * size)}
    sides = _sides(written * length_unit_m)
    if len(fitting) != 1:
        raise _UnusablePlateError(
            f"corners that are no plate: {sides}", "a rectangle of 0.1 to 5 m"
        )
    ((name, size),) = fitting.items()
    expected = "a rectangle of 0.1 to 5 m in the unit of the points"
    action = f"read CORNERS and ORIGIN in {name}: {_sides(written * size)}"
    return size, [Finding("unit", str(index + 1), sides, expected, action, "corrected")]


def _is_usual_plate(corners_m: np.ndarray) -> bool:
    low, high = _USUAL_SIDES_M
    sides = _side_lengths(corners_m)
    return corners_are_plausible(corners_m) and bool(low <= sides.min() and sides.max() <= high)


def _check_scales(scales: np.ndarray) -> None:
    """One channel of size zero is one that does not answer, which is judged elsewhere."""
    if not np.isfinite(scales).all() or not scales.any():
        size = next((s for s in scales if not np.isfinite(s)), 0.0)
        raise _UnusablePlateError(
            f"ANALOG:GEN_SCALE times SCALE is {size:g}", "numbers other than 0"
        )


def _kind(group: Group, index: int) -> int:
    kinds = np.ravel(whole_numbers(group, "TYPE"))
    if index >= len(kinds):
        raise _UnusablePlateError("no FORCE_PLATFORM:TYPE", "a type for each plate")
    if kinds[index] not in N_CHANNELS:
        raise _UnusablePlateError(f"force platform type {kinds[index]}", "types 1 to 4")
    return int(kinds[index])


def _slab(group: Group, name: str, index: int, shape: tuple[int, ...]) -> np.ndarray:
    """The part of an array parameter that belongs to one plate (the last axis counts plates)."""
    flat = np.ravel(numbers(group, name), order="F")
    size = int(np.prod(shape))
    if len(flat) < size * (index + 1):
        raise _UnusablePlateError(
            f"FORCE_PLATFORM:{name} has no entry for it", f"{size} numbers for each plate"
        )
    return flat[size * index : size * (index + 1)].reshape(shape, order="F")


def _channel_rows(group: Group, kind: int, index: int, n_analog: int) -> np.ndarray:
    table = np.atleast_1d(whole_numbers(group, "CHANNEL"))
    table = table[:, None] if table.ndim == 1 else table
    wanted = N_CHANNELS[kind]
    if table.ndim != 2 or table.shape[0] < wanted or table.shape[1] <= index:
        raise _UnusablePlateError(
            f"{table.shape[0]} channels listed for it", f"{wanted} channels of a type {kind} plate"
        )
    rows = table[:wanted, index] - 1
    if rows.min() < 0 or rows.max() >= n_analog:
        claimed = rows.max() + 1 if rows.max() >= n_analog else 0
        raise _UnusablePlateError(
            f"it claims analog channel {claimed}", f"one of the file's {n_analog}"
        )
    return rows


def _in_si(
    content: Content,
    kind: int,
    index: int,
    raw: np.ndarray,
    rows: np.ndarray,
    length_unit_m: float,
) -> np.ndarray:
    """Channels in N, N m and m; a unit that is no mechanical one (V) means N and N x length."""
    if kind == 4 and (matrix := _cal_matrix(content.group("FORCE_PLATFORM"), index)) is not None:
        return raw @ matrix.T * np.repeat([1.0, _usual_moment_Nm(length_unit_m)], 3)
    units = _units(content.group("ANALOG"), rows)
    return raw * np.array([_size(unit, kind, i, length_unit_m) for i, unit in enumerate(units)])


def _about_units(content: Content, kind: int, index: int, rows: np.ndarray) -> list[Finding]:
    """A line for units that are no mechanical ones: volts may be scaled forces, a misprint not."""
    if kind == 4 and _cal_matrix(content.group("FORCE_PLATFORM"), index) is not None:
        return []
    odd = {
        unit
        for unit in _units(content.group("ANALOG"), rows)
        if unit and force_in_N(unit) is None and moment_in_Nm(unit) is None
        if length_in_m(unit) is None
    }
    if not odd:
        return []
    return [
        Finding(
            check="unit",
            subject=str(index + 1),
            found=f"channels in {', '.join(sorted(repr(unit) for unit in odd))}",
            expected="N and N mm or N m, or a calibration matrix",
            action="took the scaled numbers as N, and as N times the unit of length",
            level="info" if odd <= _VOLTS else "warning",
        )
    ]


def _size(unit: str, kind: int, position: int, length_unit_m: float) -> float:
    """Size in SI of the channel at one position of a plate of this type."""
    if kind == 3 or position < 3:
        return force_in_N(unit) or 1.0
    if kind == 1 and position < 5:
        return length_in_m(unit) or length_unit_m
    return moment_in_Nm(unit) or _usual_moment_Nm(length_unit_m)


def _usual_moment_Nm(length_unit_m: float) -> float:
    """Size of the unit of moments where none is stated: nobody measures in N times cm or inches,
    but in N mm, or, as the feet tell, N m."""
    return length_unit_m if length_unit_m in _USUAL_LENGTHS_M else 1e-3


def _units(group: Group, rows: np.ndarray) -> list[str]:
    units = texts(group, "UNITS")
    return [units[row] if row < len(units) else "" for row in rows]


def _cal_matrix(group: Group, index: int) -> np.ndarray | None:
    """The plate's 6 x 6 matrix to N and N x length; None if there is none or only zeros."""
    matrix = numbers(group, "CAL_MATRIX")
    if matrix.ndim != 3 or matrix.shape[:2] != (6, 6) or matrix.shape[2] <= index:
        return None
    return matrix[:, :, index] if matrix[:, :, index].any() else None


def _cop_polynomial(group: Group, kind: int, index: int) -> np.ndarray | None:
    """Kistler's coefficients, (2, 6); None if there are none or only zeros."""
    flat = np.ravel(numbers(group, "FPCOPPOLY"), order="F")[12 * index : 12 * (index + 1)]
    usable = kind == 3 and len(flat) == 12 and np.isfinite(flat).all() and flat.any()
    return flat.reshape(2, 6) if usable else None


def _baseline(group: Group, samples_per_frame: int, n_samples: int) -> slice | None:
    """FORCE_PLATFORM:ZERO counts frames from 1; (1, 0) and (0, x) mean none."""
    zero = np.ravel(whole_numbers(group, "ZERO"))
    if len(zero) < 2 or zero[0] < 1 or zero[1] <= zero[0]:
        return None
    start, stop = (int(zero[0]) - 1) * samples_per_frame, int(zero[1]) * samples_per_frame
    return slice(start, stop) if stop <= n_samples else None


def _side_lengths(corners_m: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.roll(corners_m, -1, axis=0) - corners_m, axis=1)


def _sides(corners_m: np.ndarray) -> str:
    return "sides of " + ", ".join(f"{side:.3g}" for side in _side_lengths(corners_m)) + " m"
