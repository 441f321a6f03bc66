"""C3D files: markers and force plates."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from itertools import combinations
from pathlib import Path

import numpy as np

from bsip_cli.recordings import scene
from bsip_cli.recordings.analog import check_samples, sample_findings
from bsip_cli.recordings.c3d_content import Content, read_content
from bsip_cli.recordings.c3d_format import Group, number, numbers, texts, whole_numbers
from bsip_cli.recordings.c3d_person import stated_person
from bsip_cli.recordings.labels import is_unlabelled
from bsip_cli.recordings.model import Finding, Recording, refusal
from bsip_cli.recordings.plate_reading import AS_STATED, Opened
from bsip_cli.recordings.plate_wrench import lost_baseline
from bsip_cli.recordings.plates import (
    CHANNELS_OF,
    PlateDescription,
    corners_are_plausible,
    measured,
    side_lengths,
)
from bsip_cli.recordings.plates_of_files import C3dPlate
from bsip_cli.recordings.units import force_in_N, length_in_m, moment_in_Nm

_OUTPUT_GROUPS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_OUTPUT_NAMES = re.compile(
    r"^(centreofmass.*|centerofmass.*|.*(angles?|forces?|moments?|power))$", re.IGNORECASE
)
_AXIS_ENDINGS = "OALP"  # Plug-in Gait draws a segment by four points, PELO PELA PELL PELP
_MOST_PLATES = 64
_PLATE_UNITS = ("mm", "cm", "in", "m")
_USUAL_SIDES_M = (0.35, 1.25)  # of plates as they are sold: so that one unit alone can fit
_USUAL_LENGTHS_M = (1.0, 1e-3)  # m, mm
_HEAD = re.compile(r"[^\W_]+[_.\- ]+")  # of the person, in front of most labels
_SAME_PLACE_M = 1e-3  # as precise as corners are written
# Of the longest side: over 160 plates of the public recordings corners miss a rectangle's by 0.7 %.
_PARALLEL = 0.02
_PLACE_APART_M = 5e-3  # of two ways to read ORIGIN, that can be distinguished
_AXIS = re.compile(r"([FMTP])\d*([XYZ])")  # of a channel's label, in capitals: FX1, F1X, Force.Fx1
_FIRST_YEAR = 1987  # of the format
_VOLTS = {"V", "v", "Volts", "volts", "mV"}


def open_c3d(path: Path) -> Opened:
    """Markers of a C3D file, SI, Z-up world frame, and its plates as it describes them."""
    content = read_content(path)
    labels, positions_m, unit_m, about_points = _read_points(content, path)
    surfaces = plate_surfaces(content.group("FORCE_PLATFORM"), unit_m)
    up = _up(content, labels, positions_m, surfaces)
    rotation = scene.rotation_to_z_up(up)
    plates, about_plates, about_samples = read_plates(content, unit_m, rotation)
    stated, about_person = stated_person(content.parameters)
    about = (*content.findings, *about_points, *about_plates, *scene.findings_about(up))
    about_person += _recorded_on(content.group("TRIAL"))
    recording = Recording(
        path=path,
        marker_rate_hz=content.rate_hz,
        labels=labels,
        markers_m=positions_m @ rotation.T,
        analog_rate_hz=content.rate_hz * content.samples_per_frame,
        plates=(),
        findings=(*about, *about_person, *about_samples),
        rotation_world_lab=rotation,
        forces_note="",
        time0_s=content.first_frame / content.rate_hz,
        stated=stated,
    )
    return Opened(recording, tuple(plates))


def _recorded_on(trial: Group) -> tuple[Finding, ...]:
    """TRIAL:DATE, where BTS writes year, month and day; nothing where that is no day."""
    try:
        day = date(*map(int, np.ravel(whole_numbers(trial, "DATE"))))
    except (TypeError, ValueError):
        return ()
    about = Finding("recorded_on", "", day.isoformat(), "", "said in the report", "info")
    return (about,) if day.year >= _FIRST_YEAR else ()


def _up(
    content: Content,
    labels: Sequence[str],
    positions_m: np.ndarray,
    surfaces: Sequence[np.ndarray],
) -> scene.Up:
    """From the plates and the markers above them, else the labels, else what the file says."""
    surface = None
    if surfaces:
        normals = np.array([np.cross(c[0] - c[1], c[0] - c[3]) for c in surfaces])
        centres = np.array([c.mean(axis=0) for c in surfaces])
        surface = scene.up_from_surface(normals, centres, positions_m)
    screen = texts(content.group("POINT"), "Y_SCREEN")
    return (
        surface
        or scene.up_from_labels(labels, positions_m)
        or (scene.up_from_name(screen[0]) if screen else None)
        or scene.Up(2, 1, "nothing says otherwise")
    )


# --- the points -----------------------------------------------------------------------------------


def _read_points(
    content: Content, path: Path
) -> tuple[tuple[str, ...], np.ndarray, float, list[Finding]]:
    """Labels and positions (n_frames, n_markers, 3) of the real markers [m], lab frame, NaN =
    missing, without model outputs and unlabelled points; the size of the file's unit of length."""
    group = content.group("POINT")
    labels, findings = _labels(group, content.positions.shape[1])
    outputs = _model_outputs(group, labels)
    kept = [i for i, label in enumerate(labels) if i not in outputs and not is_unlabelled(label)]
    if len(kept) < len(labels):
        n_unlabelled = max(len(labels) - len(kept) - len(outputs), 0)
        found = f"{len(outputs)} model outputs and {n_unlabelled} unlabelled points"
        action = f"kept {len(kept)} of {len(labels)} points"
        findings.append(Finding("points", "", found, "markers", action, "info"))
    every, is_valid = content.positions, content.is_valid
    is_written = np.isfinite(every).all(axis=-1) & (every != 0).any(axis=-1)  # three zeros are none
    every = np.where(is_written[..., None], every, np.nan)
    positions = every[:, kept]
    is_ignored = not is_valid[:, kept].any() and bool(np.isfinite(positions).any())
    if not is_ignored:
        positions[~is_valid[:, kept]] = np.nan
    findings += scene.without_sentinels(positions)
    stated = "".join(texts(group, "UNITS")[:1])
    shown = positions if kept else np.where(is_valid[..., None], every, np.nan)
    names = [labels[i] for i in kept]
    unit_m, about_unit = scene.decided_unit(shown, names or labels, stated, "POINT:UNITS")
    positions *= unit_m
    findings += [*scene.without_absurd(positions), *about_unit]
    if is_ignored:
        findings.append(_about_invalid(positions, content.rate_hz, path))
    return tuple(names), positions, unit_m, findings


def _about_invalid(positions_m: np.ndarray, rate_hz: float, path: Path) -> Finding:
    """All points are marked as not seen: what is said if they move as markers do, else refused."""
    found = f"all {positions_m.shape[1]} points are marked invalid (residual -1) in every frame"
    if not scene.move_like_markers(positions_m, rate_hz):
        found += ", and what is written there does not move as markers do"
        remedy = "reconstruct the trial and export it again"
        raise refusal(path, found, "points that the cameras saw", remedy)
    found += ", and they move as the markers of a person do"
    expected = "a residual of 0 or more where a point was seen"
    return Finding("points", "", found, expected, "read them all the same", "warning")


def _labels(group: Group, n_points: int) -> tuple[list[str], list[Finding]]:
    """POINT:LABELS with its continuations; duplicates by POINT:DESCRIPTIONS if these name them."""
    labels, descriptions = (
        (texts(group, name) + [""] * n_points)[:n_points] for name in ("LABELS", "DESCRIPTIONS")
    )
    counts = Counter(labels)
    twice = [i for i, label in enumerate(labels) if counts[label] > 1 and not is_unlabelled(label)]
    renamed = [descriptions[i] if i in twice else label for i, label in enumerate(labels)]
    resolved = len({renamed[i] for i in twice}) == len(twice) and all(
        renamed[i] and renamed[i] not in counts.keys() - {labels[i]} for i in twice
    )
    if not twice or not resolved:  # what nobody asks for need not be distinguished
        return labels, []
    shared = sorted({labels[i] for i in twice})
    found = f"{len(twice)} points share {len(shared)} labels"
    expected, action = "one point per label", "named them by POINT:DESCRIPTIONS"
    return renamed, [Finding("labels", ", ".join(shared), found, expected, action, "corrected")]


def _model_outputs(group: Group, labels: Sequence[str]) -> set[int]:
    """Indices of angles, forces, moments, powers, modelled points and drawn segment axes.

    POINT:TYPE_GROUPS lists pairs of plural and singular; the plural names the list.
    """
    keys = {*(name.upper() for name in texts(group, "TYPE_GROUPS")[::2]), *_OUTPUT_GROUPS}
    listed = {name for key in keys for name in texts(group, key)}
    names = [label.split(":")[-1] for label in labels]
    heads = Counter(found[0] for name in names if (found := _HEAD.match(name)))
    head, number = max(heads.items(), key=lambda one: one[1], default=("", 0))
    bare = [name.removeprefix(head if 2 * number > len(names) else "") for name in names]
    stems = {label[:-1] for label in bare if label[-1:] == "O" and len(label) >= 3}
    drawn = [{stem + ending for ending in _AXIS_ENDINGS} for stem in stems]
    axes = {name for axes in drawn if axes <= set(bare) for name in axes}
    return {
        i
        for i, label in enumerate(labels)
        if label and ({label, bare[i]} & listed or bare[i] in axes or _OUTPUT_NAMES.match(bare[i]))
    }


# --- the groups FORCE_PLATFORM and ANALOG, one plate at a time, in SI -----------------------------


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
    plates, about_samples = [], []
    group = content.group("FORCE_PLATFORM")
    stated = _stated_plates(group)
    table, findings = _channel_table(content)
    for index in range(_n_plates(group)):
        try:
            where = length_unit_m, index, rotation_world_lab
            plate, about, faulty = _read_plate(content, table, *where)
        except _UnusablePlateError as why:
            if 0 < stated <= index:  # not used, as the file says
                continue
            action = "left the plate out; export the trial with its force plates set up"
            findings.append(Finding("plate", str(index + 1), *why.words, action, "excluded"))
            continue
        plates.append(plate)
        findings += about
        about_samples += faulty
    if len(plates) > stated:
        found, expected = f"FORCE_PLATFORM:USED is {stated}", f"the {len(plates)} it describes"
        findings.append(Finding("plate", "", found, expected, "read them", "corrected"))
    for one in (plate.description for plate in plates):
        gap_m = np.linalg.norm(one.corners_m[::2].sum(axis=0) - one.corners_m[1::2].sum(axis=0))
        if gap_m > _PARALLEL * side_lengths(one.corners_m).max():
            found = f"its corners are {1e3 * gap_m:.0f} mm away from a rectangle's"
            action = "took them as they are; correct FORCE_PLATFORM:CORNERS"
            findings.append(Finding("plate", one.name, found, "a rectangle", action, "warning"))
    for one, other in combinations([plate.description for plate in plates], 2):
        if np.abs(one.corners_m - other.corners_m).max() < _SAME_PLACE_M:
            found, expected = f"its corners are those of plate {one.name}", "a place of its own"
            action = "took them as they are; correct FORCE_PLATFORM:CORNERS"
            findings.append(Finding("plate", other.name, found, expected, action, "warning"))
    return plates, findings, about_samples


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
    """As many as are used, or more that are described."""
    corners = np.ravel(numbers(group, "CORNERS"), order="F")
    whole = corners[: len(corners) // 12 * 12].reshape(-1, 4, 3)[:_MOST_PLATES]
    is_place = [bool(np.isfinite(one).all() and np.ptp(one, axis=0).any()) for one in whole]
    described = is_place.index(False) if False in is_place else len(is_place)
    return max(described, _stated_plates(group))


def _stated_plates(group: Group) -> int:
    used = number(group, "USED")
    return int(min(max(used, 0), _MOST_PLATES)) if np.isfinite(used) else 0


def _read_plate(
    content: Content,
    table: np.ndarray,
    length_unit_m: float,
    index: int,
    rotation_world_lab: np.ndarray,
) -> tuple[C3dPlate, list[Finding], list[Finding]]:
    group, name = content.group("FORCE_PLATFORM"), str(index + 1)
    kind = _kind(group, index)
    written = _slab(group, "CORNERS", index, (3, 4)).T
    plate_unit_m, about_size = _plate_unit(written, length_unit_m, name)
    origin = _slab(group, "ORIGIN", index, (3,))
    size_m = side_lengths(written * plate_unit_m).max()  # sensors lie no deeper, no farther aside
    is_own = np.abs(origin).max() * plate_unit_m > size_m > np.abs(origin).max() * length_unit_m
    origin = origin * (length_unit_m if is_own else plate_unit_m)
    if kind == 3 and not origin[:2].all():
        found = "a type 3 plate whose ORIGIN lacks the distances of the sensors"
        raise _UnusablePlateError(found, "the half distances a and b of the sensors")
    rows = _channel_rows(table, kind, index, content, _n_plates(group))
    raw, scales = content.analog[rows].T, content.analog_scales[rows]
    _check_apart(kind, rows, raw)
    if not np.isfinite(scales).all() or not scales.any():  # one of size zero does not answer
        size = next((s for s in scales if not np.isfinite(s)), 0.0)
        found = f"ANALOG:GEN_SCALE times SCALE is {size:g}"
        raise _UnusablePlateError(found, "numbers other than 0")
    channels, about_units = _in_si(content, kind, index, raw, rows, length_unit_m)
    polynomial = np.ravel(numbers(group, "FPCOPPOLY"), order="F")[12 * index : 12 * (index + 1)]
    corrects = kind == 3 and len(polynomial) == 12 and np.isfinite(polynomial).all()
    corrects = corrects and bool(polynomial.any())
    polynomials = polynomial.reshape(2, 6) if corrects else None
    stated = PlateDescription(name, kind, written * plate_unit_m, origin, polynomials)
    stated, about_origin = _without_place(stated)
    source = C3dPlate(stated, measured(channels, kind), np.ones(len(raw), bool), rotation_world_lab)
    lift, counts = (
        source.measured @ source.local(AS_STATED)[2],
        raw / np.where(scales == 0, 1.0, scales),
    )
    rate_hz = content.rate_hz * content.samples_per_frame
    samples = check_samples(channels, counts, lift, rate_hz)
    source = replace(source, usable=samples.usable())
    baseline = _baseline(group, content.samples_per_frame, len(raw))
    down = float(np.sign((rotation_world_lab @ stated.rotation_lab_plate()[:, 2])[2]))
    subtracted = lost_baseline(down * lift, name, source.usable, baseline)
    if subtracted is not None:
        mean = source.measured[baseline].mean(axis=0)
        source = replace(source, measured=source.measured - mean)
    about_samples = [*sample_findings(name, samples, rate_hz), *filter(None, [subtracted])]
    return source, [*about_size, *about_origin, *about_units], about_samples


def _check_apart(kind: int, rows: np.ndarray, raw: np.ndarray) -> None:
    """Two channels that are one, or a copy, measure no two things; single sensors of a symmetric
    load may be equal where somebody computed them."""
    names = CHANNELS_OF[kind]
    for i, j in combinations(range(len(names)), 2):
        copied = kind != 3 and np.ptp(raw[:, i]) > 0 and np.array_equal(raw[:, i], raw[:, j])
        if rows[i] == rows[j] or copied:
            found = f"its {names[i]} and {names[j]} hold the same numbers"
            raise _UnusablePlateError(found, "an analog channel for each in FORCE_PLATFORM:CHANNEL")


def _kind(group: Group, index: int) -> int:
    kinds = np.ravel(whole_numbers(group, "TYPE"))
    if index >= len(kinds):
        raise _UnusablePlateError("no FORCE_PLATFORM:TYPE", "a type for each plate")
    if kinds[index] not in CHANNELS_OF:
        raise _UnusablePlateError(f"force platform type {kinds[index]}", "types 1 to 4")
    return int(kinds[index])


def _slab(group: Group, name: str, index: int, shape: tuple[int, ...]) -> np.ndarray:
    """The part of an array parameter that belongs to one plate (the last axis counts plates)."""
    flat, size = np.ravel(numbers(group, name), order="F"), int(np.prod(shape))
    if len(flat) < size * (index + 1):
        found = f"FORCE_PLATFORM:{name} has no entry for it"
        raise _UnusablePlateError(found, f"{size} numbers for each plate")
    return flat[size * index : size * (index + 1)].reshape(shape, order="F")


def _plate_unit(
    written: np.ndarray, length_unit_m: float, name: str
) -> tuple[float, list[Finding]]:
    """Size of the unit of corners (4, 3): the points', or the one that makes them a plate."""
    if corners_are_plausible(written * length_unit_m):
        return length_unit_m, []
    sizes = {unit: size for unit in _PLATE_UNITS if (size := length_in_m(unit)) is not None}
    low, high = _USUAL_SIDES_M
    fitting = {
        unit: size
        for unit, size in sizes.items()
        if low <= (sides := side_lengths(written * size)).min() and sides.max() <= high
        if corners_are_plausible(written * size)
    }
    found, expected = _sides(written * length_unit_m), "a rectangle of 0.1 to 5 m"
    if len(fitting) != 1:
        raise _UnusablePlateError(f"corners that are no plate: {found}", expected)
    ((unit, size),) = fitting.items()
    action = f"read CORNERS in {unit}: {_sides(written * size)}"
    expected += " in the unit of the points"
    return size, [Finding("unit", name, found, expected, action, "corrected")]


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


def _sides(corners_m: np.ndarray) -> str:
    return "sides of " + ", ".join(f"{side:.3g}" for side in side_lengths(corners_m)) + " m"


def _channel_table(content: Content) -> tuple[np.ndarray, list[Finding]]:
    """FORCE_PLATFORM:CHANNEL, (channels, plates). Where the labels of the channels contradict it as
    the format wants it, and agree with one other way to write it, that one counts."""
    group = content.group("FORCE_PLATFORM")
    table = np.atleast_1d(whole_numbers(group, "CHANNEL"))
    table = table[:, None] if table.ndim == 1 else table
    if table.ndim != 2:
        return np.zeros((0, 0), int), []
    orders = {
        "": table,
        "stored by rows": np.ravel(table, order="F").reshape(table.shape),
        "with a row for each plate": table.T,
    }
    axes = [
        "".join((_AXIS.findall(label.upper()) or [""])[-1])
        for label in texts(content.group("ANALOG"), "LABELS")[: len(content.analog)]
    ]
    kinds = np.ravel(whole_numbers(group, "TYPE"))[: _n_plates(group)].tolist()
    fitting: dict[bytes, tuple[str, np.ndarray]] = {}
    for order, one in orders.items():
        for first, counted in ((1, one), (0, one + 1)):
            if _fits_labels(counted, kinds, axes):
                words = [order, "" if first else "counted from 0"]
                known = " and ".join(filter(None, words)), counted
                fitting.setdefault(counted.astype(int).tobytes(), known)
    if len(fitting) != 1 or not (words := next(iter(fitting.values()))[0]):
        return table, []
    found = f"by the labels of its channels FORCE_PLATFORM:CHANNEL is {words}"
    expected = "counted from 1, a column for each plate"
    about = Finding("plate", "", found, expected, "read it so", "corrected")
    return next(iter(fitting.values()))[1], [about]


def _fits_labels(table: np.ndarray, kinds: Sequence[int], axes: Sequence[str]) -> bool:
    """Whether the channels of all plates measure by their labels what the plates' types want."""
    for index, kind in enumerate(kinds):
        wanted = [name[:2].upper().replace("T", "M") for name in CHANNELS_OF.get(kind, ())]
        if not wanted or len(table) < len(wanted) or table.shape[1] <= index:
            return False
        rows = table[: len(wanted), index] - 1
        if rows.min() < 0 or rows.max() >= len(axes):
            return False
        if [axes[row].replace("T", "M") for row in rows] != wanted:
            return False
    return bool(kinds)


def _channel_rows(
    table: np.ndarray, kind: int, index: int, content: Content, n_plates: int
) -> np.ndarray:
    wanted, n_analog = len(CHANNELS_OF[kind]), len(content.analog)
    if table.shape[0] < wanted or table.shape[1] <= index:
        found = f"{table.shape[0]} channels listed for it"
        expected = f"{wanted} channels of a type {kind} plate"
        if table.shape[1] >= wanted:
            found = f"FORCE_PLATFORM:CHANNEL has {table.shape[0]} rows"
            expected += ", a column for each plate"
        raise _UnusablePlateError(found, expected)
    rows = table[:wanted, index] - 1
    if rows.min() < 0 or rows.max() >= n_analog:
        claimed = rows.max() + 1 if rows.max() >= n_analog else 0
        found = f"it claims analog channel {claimed}"
        expected = f"one of the file's {n_analog}"
        if not claimed:
            found += " in FORCE_PLATFORM:CHANNEL"
            expected += ", counted from 1"
        raise _UnusablePlateError(found, expected)
    for other in set(range(min(n_plates, table.shape[1]))) - {index}:
        shared = np.isin(rows, table[:, other] - 1)
        if shared.any() and not shared.all():  # all: a copy
            found = f"analog channel {rows[shared][0] + 1} is also listed for plate {other + 1}"
            raise _UnusablePlateError(found, "channels of its own in FORCE_PLATFORM:CHANNEL")
    return rows


def _in_si(
    content: Content,
    kind: int,
    index: int,
    raw: np.ndarray,
    rows: np.ndarray,
    length_unit_m: float,
) -> tuple[np.ndarray, list[Finding]]:
    """Channels in N, N m and m, by the plate's matrix (6, 6) if it has one that is not zero.

    A unit that is no mechanical one (V) means N and N x length: volts may be scaled forces, a
    misprint not. Where no unit of moments is stated, nobody measures in N times cm or inches, but
    in N mm, or, as the feet show, N m.
    """
    usual_Nm = length_unit_m if length_unit_m in _USUAL_LENGTHS_M else 1e-3
    matrix = numbers(content.group("FORCE_PLATFORM"), "CAL_MATRIX")
    if kind == 4 and matrix.ndim == 3 and matrix.shape[:2] == (6, 6) and matrix.shape[2] > index:
        own = matrix[:, :, index]
        if own.any():
            return raw @ own.T * np.repeat([1.0, usual_Nm], 3), []
    stated = texts(content.group("ANALOG"), "UNITS")
    units = [stated[row] if row < len(stated) else "" for row in rows]
    sizes = []
    for position, unit in enumerate(units):
        if kind == 3 or position < 3:
            sizes.append(force_in_N(unit) or 1.0)
        elif kind == 1 and position < 5:
            sizes.append(length_in_m(unit) or length_unit_m)
        else:
            sizes.append(moment_in_Nm(unit) or usual_Nm)
    known = (force_in_N, moment_in_Nm, length_in_m)
    odd = {unit for unit in units if unit and all(size(unit) is None for size in known)}
    found = f"channels in {', '.join(sorted(map(repr, odd)))}"
    expected = "N and N mm or N m, or a calibration matrix"
    action = "took the scaled numbers as N, and as N times the unit of length"
    level = "info" if odd <= _VOLTS else "warning"
    about = Finding("unit", str(index + 1), found, expected, action, level)
    return raw * np.array(sizes), [about] if odd else []


def _baseline(group: Group, samples_per_frame: int, n_samples: int) -> slice | None:
    """Samples of FORCE_PLATFORM:ZERO, which counts frames from 1; (1, 0) and (0, x) mean none."""
    zero = np.ravel(whole_numbers(group, "ZERO"))
    if len(zero) < 2 or zero[0] < 1 or zero[1] <= zero[0]:
        return None
    start, stop = (int(zero[0]) - 1) * samples_per_frame, int(zero[1]) * samples_per_frame
    return slice(start, stop) if stop <= n_samples else None
