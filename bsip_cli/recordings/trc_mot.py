"""A TRC with its MOT: markers and ground forces in the convention of OpenSim (Y up)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from bsip_cli.files.regular import forces_beside
from bsip_cli.recordings import scene
from bsip_cli.recordings.analog import check_samples, sample_findings
from bsip_cli.recordings.gaps import LARGEST_LAB_M
from bsip_cli.recordings.model import Finding, Recording, refusal
from bsip_cli.recordings.mot import GroundForce, Mot, read_mot
from bsip_cli.recordings.plate_reading import Opened, PlateReading
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.plates_of_files import ForceOnPoint, points_that_move
from bsip_cli.recordings.text_tables import (
    FRAMES,
    MOST_HZ,
    UNITS_S,
    Grid,
    Stamps,
    about_unit,
    counted,
    even_grid,
    in_seconds,
    onto_grid,
)
from bsip_cli.recordings.trc import Trc, read_trc
from bsip_cli.recordings.under_the_feet import BESIDE_M
from bsip_cli.recordings.units import length_in_m, moment_in_Nm
from bsip_cli.recordings.written import AS_WRITTEN, Lengths, Written

# Of both files: a grid of forces may need no more memory than this.
_VALUES_PER_BYTE = 5
_MM = 1e-3
_UNEVEN = "the times of the .mot do not increase evenly"
_WHAT = "times of the forces"
_UNIT_NAMES = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3}
_UNIT_NAMES |= {"us": 1e-6, "\N{MICRO SIGN}s": 1e-6, "microseconds": 1e-6}


def open_trc_mot(path: Path, written: Written = AS_WRITTEN) -> Opened:
    """Markers from the TRC; forces as written in the file beside it, if there is one."""
    trc = read_trc(path)
    times, positions, findings = _even_markers(trc, path)
    times = times.faster(written.pace)
    mot_path = forces_beside(path)
    mot = read_mot(mot_path, written.force_N) if mot_path else None
    most = _VALUES_PER_BYTE * sum(file.stat().st_size for file in (path, mot_path) if file)
    up, up_of_forces = _ups(trc, positions, mot)
    rotation, of_forces = map(scene.rotation_to_z_up, (up, up_of_forces))
    findings = [*trc.findings, *findings, *scene.findings_about(up, up_of_forces)]
    sources: tuple[ForceOnPoint, ...] = ()
    rate_hz, lengths, note = times.rate_hz, None, ""
    try:
        paced = mot and replace(mot, stamps=mot.stamps.faster(written.force_pace))
        rate_hz, sources, lengths = _forces(paced, of_forces, times, most, findings)
    except _NoForcesError as why:
        note = str(why)
    recording = Recording(
        path=path,
        marker_rate_hz=times.rate_hz,
        labels=trc.labels,
        markers_m=positions @ rotation.T,
        analog_rate_hz=rate_hz,
        plates=(),
        findings=tuple(findings),
        rotation_world_lab=rotation,
        forces_note=note,
        time0_s=times.first_s,
    )
    return Opened(recording, sources, lengths, partial(open_trc_mot, path))


def _even_markers(trc: Trc, path: Path) -> tuple[_MarkerTimes, np.ndarray, list[Finding]]:
    """Times, positions (n, n_markers, 3) at these even times, and what was done."""
    if len(trc.stamps.values) < 2:
        found, expected = f"{len(trc.stamps.values)} frame", "at least 2 frames with times"
        raise refusal(path, found, expected, "export the whole trial")
    findings: list[Finding] = []
    stamps = in_seconds(trc.stamps, trc.rates_hz, findings)
    if stamps is not None and trc.counts_frames:
        stamps = counted(stamps, trc.rates_hz, findings)
    if stamps is None:
        found, remedy = "times that count frames, and no DataRate", "export the trial with its rate"
        raise refusal(path, found, "times in s, or the rate in the header", remedy)
    grid = even_grid(stamps, trc.rates_hz)
    if grid is None:
        expected = f"increasing times of one rate, below {MOST_HZ:,.0f} Hz"
        raise refusal(path, "times that do not increase evenly", expected)
    unsure_s = float(np.ptp(stamps.values[grid.samples] - grid.samples_s))
    first_s, unsure_s = float(grid.time_s[0]), np.inf if stamps.unit == FRAMES else unsure_s
    times = _MarkerTimes(first_s, grid.rate_hz, len(grid.time_s), unsure_s)
    return times, onto_grid(grid, trc.positions_m), [*findings, *grid.findings]


def _ups(trc: Trc, positions_m: np.ndarray, mot: Mot | None) -> tuple[scene.Up, scene.Up]:
    """Of the markers, and of the forces, which a conversion may have left in other axes.

    From the direction of the forces, the markers telling its sign; else labels; else Y.
    """
    by_labels = scene.up_from_labels(trc.labels, trc.positions_m)
    surface = None
    if mot is not None:
        force = np.concatenate([f.force_N for f in mot.forces])
        points = [np.zeros_like(f.force_N) if f.point is None else f.point for f in mot.forces]
        loaded = np.linalg.norm(np.nan_to_num(force), axis=1) > LOADED_N
        on_floor = np.concatenate(points)[loaded] * _MM  # at least: what is low is low in any unit
        if loaded.any():
            mean = np.abs(force[loaded]).mean(axis=0)
            of_forces = scene.Up(int(np.argmax(mean)), 1, "the forces point there")
            if by_labels and by_labels.axis != of_forces.axis:
                by_segment = scene.by_segment(
                    trc.labels, positions_m @ scene.rotation_to_z_up(by_labels).T
                )
                feet = [by_segment[name] for name in ("foot_l", "foot_r") if name in by_segment]
                if _lie_below(on_floor / _MM @ scene.rotation_to_z_up(of_forces).T, feet):
                    return by_labels, of_forces
            surface = scene.up_from_surface(mean[None], on_floor, trc.positions_m)
    up = surface or by_labels or scene.Up(1, 1, "the convention of TRC files")
    return up, up


def _lie_below(points_m: np.ndarray, feet_m: list[np.ndarray]) -> bool:
    """Whether points of force (n, 3), in m or, where no laboratory is so large, in cm or mm, lie
    where markers of the feet (n_frames, k, 3) are seen, or between both, in axes turned by some
    right angle about the vertical, or mirrored."""
    if not feet_m:
        return False
    between = np.mean([foot.mean(axis=1) for foot in feet_m], axis=0)
    seen = np.concatenate([between, *(foot.reshape(-1, 3) for foot in feet_m)])
    seen = seen[np.isfinite(seen).all(axis=1)]
    points = points_m[np.isfinite(points_m).all(axis=1), :2] @ np.array([1.0, 1j])
    if not len(points) or not len(seen):
        return False
    near = cKDTree(seen[:, :2])
    sizes = (1.0,) if np.median(np.abs(points)) < LARGEST_LAB_M else (1e-2, 1e-3)
    ways = product((points, points.conj()), sizes, range(4))
    turned = (places * size * 1j**quarter for places, size, quarter in ways)
    distances = (near.query(np.column_stack([z.real, z.imag]))[0] for z in turned)
    return any(np.median(distance) < BESIDE_M for distance in distances)


class _NoForcesError(Exception):
    """Why a table gives no forces."""


def _forces(
    mot: Mot | None,
    rotation: np.ndarray,
    markers: _MarkerTimes,
    most_values: int,
    findings: list[Finding],
) -> tuple[float, tuple[ForceOnPoint, ...], Lengths]:
    """Rate, forces as written on the markers' time, and how long they last; adds what is said."""
    if mot is None:
        raise _NoForcesError("no .mot file of the same name next to the .trc")
    findings += mot.findings
    _check_placed(mot)
    grid = _force_grid(mot.stamps, markers, findings)
    last = markers.lasts_s() * grid.rate_hz
    if 6 * last * len(mot.forces) > most_values:
        rows = len(mot.stamps.values)
        needed = f"the .mot has {rows} rows and {last:.3g} would be needed for the .trc"
        raise _NoForcesError(needed)
    samples_s = markers.first_s + np.arange(round(last) + 1) / grid.rate_hz
    findings += [*grid.findings, *_about_missing(mot)]
    sources = [_source(one, grid, samples_s, rotation, markers, findings) for one in mot.forces]
    forces_s = float(grid.time_s[-1] - grid.time_s[0])
    step_s = max(1 / grid.rate_hz, 1 / markers.rate_hz)
    return grid.rate_hz, tuple(sources), Lengths(markers.lasts_s(), forces_s, step_s)


def _source(
    force: GroundForce,
    grid: Grid,
    samples_s: np.ndarray,
    rotation: np.ndarray,
    markers: _MarkerTimes,
    findings: list[Finding],
) -> ForceOnPoint:
    """One force on the markers' time, with its faulty samples marked, and said; points and moments
    in the unit that the file names, as written where it names none that is known."""
    point, moment = force.point, force.moment
    if point is not None:
        point = point * (length_in_m(force.point_unit) or 1.0)
    if moment is not None:
        moment = moment * (moment_in_Nm(force.moment_unit) or 1.0)
    loaded = np.linalg.norm(np.nan_to_num(force.force_N), axis=1) > LOADED_N
    parts = [x for x in (force.force_N, point, moment) if x is not None]
    rows = onto_grid(grid, np.hstack(parts), samples_s)
    columns = iter(np.split(rows, len(parts), axis=1))
    missing = ~np.isfinite(rows).all(axis=1)
    height = np.zeros(0) if point is None else point[loaded] @ rotation[2]
    height = height[np.isfinite(height)]
    source = ForceOnPoint(
        name=force.name,
        force_N=next(columns),
        points=None if point is None else next(columns),
        moment=next(columns, np.zeros((len(rows), 3))),  # without columns: no free torque, and said
        point_height=float(np.median(height)) if len(height) else 0.0,
        points_move=point is not None and points_that_move(point, loaded),
        known=~missing,
        rotation_world_lab=rotation,
    )
    wrench = source.plate(PlateReading()).wrench  # points alone leap where the load begins
    samples = check_samples(wrench, wrench, np.abs(wrench[:, :3]).max(axis=1), grid.rate_hz)
    if source.points is not None and source.points_move:
        # Loads without a point are marked once it is known whose points they are.
        samples.stuck[np.flatnonzero(~source.points.any(axis=1)), 3:5] = False
    samples = replace(samples, not_a_number=missing, silent_channels=())  # no column, or no torque
    expected = (
        f"forces as long as the markers, {markers.span()} s (the file "
        f"has {grid.samples_s[0]:.4g} to {grid.samples_s[-1]:.4g} s)"
    )
    none = f"no force for {missing.sum()} of {len(rows)} samples of the markers' time"
    if samples_s[-1] - grid.samples_s[-1] > 1 / markers.rate_hz:
        expected += "; forces after rows that were lost in between come too early"
    findings += [
        replace(one, found=none, expected=expected) if one.check == "analog_nan" else one
        for one in sample_findings(force.name, samples, grid.rate_hz, markers.first_s)
    ]
    return replace(source, known=samples.usable())


def _check_placed(mot: Mot) -> None:
    """Whether the forces have a centre of pressure."""
    bare = [f for f in mot.forces if f.point is None and f.moment is None]
    bare = [force for force in bare if np.nan_to_num(force.force_N).any()]
    if bare:
        names = " and ".join(force.name for force in bare)
        which = "" if len(bare) == len(mot.forces) else f" {names}"
        raise _NoForcesError(
            f"the .mot has no columns for the point and none for the moment of its forces{which}, "
            "and without them no centre of pressure is known"
        )


def _about_missing(mot: Mot) -> list[Finding]:
    findings = []
    for force in mot.forces:
        if force.moment is None and force.point is not None:
            found, action = "no columns for its moment", "took the free torque as zero"
        elif force.point is None and force.moment is not None:
            found, action = "no columns for its point", "took its moment about the lab's origin"
        else:
            continue
        expected = "force, point and moment of each plate"
        findings.append(Finding("columns", force.name, found, expected, action, "warning"))
    return findings


# --- the times of the forces against those of the markers -----------------------------------------


@dataclass(frozen=True)
class _MarkerTimes:
    """When the markers were seen."""

    first_s: float
    rate_hz: float
    n: int
    unsure_s: float = 0.0  # by how much the first may be off: the last digit that is printed

    def faster(self, times: float) -> _MarkerTimes:
        """As if seen by cameras so many times as fast."""
        slower = (self.first_s / times, self.rate_hz * times, self.n, self.unsure_s / times)
        return self if times == 1.0 else _MarkerTimes(*slower)

    def lasts_s(self) -> float:
        return (self.n - 1) / self.rate_hz

    def span(self) -> str:
        return _span(self.first_s, self.first_s + self.lasts_s())


def _force_grid(stamps: Stamps, markers: _MarkerTimes, findings: list[Finding]) -> Grid:
    """The forces' times in seconds of the markers' clock, on an even grid."""
    with np.errstate(over="ignore", invalid="ignore"):
        increase = np.isfinite(stamps.values).all() and stamps.step() > 0
    if len(stamps.values) < 2 or not increase:
        raise _NoForcesError(_UNEVEN)
    stamps, rates_hz = _in_seconds(stamps, markers, findings)
    is_simultaneous = bool(rates_hz) or _begin_together(stamps, markers, findings)
    grid = even_grid(stamps, rates_hz, markers.rate_hz)
    if grid is None:
        raise _NoForcesError(_UNEVEN)
    if not is_simultaneous:
        return grid
    torn_off_s = grid.time_s[0] - stamps.values[0] if grid.samples.start else 0.0
    return grid.from_time(markers.first_s + torn_off_s)


def _in_seconds(
    stamps: Stamps, markers: _MarkerTimes, findings: list[Finding]
) -> tuple[Stamps, tuple[float, ...]]:
    """And the rate of stamps that count rows, the first at the first frame.

    Of seconds, ms and microseconds that one by which forces and markers last alike; stamps that
    count rows have the rate that makes a whole number of rows per frame.
    """
    step, n, unit = stamps.step(), len(stamps.values), stamps.unit.strip()
    stated_s = _UNIT_NAMES.get(unit.lower())
    if stated_s is not None and stated_s != 1.0:
        findings.append(about_unit(f"in {unit}", "read them so", _WHAT))
        return stamps.times(stated_s), ()
    if stamps.count():
        ratio = round(n / markers.n)
        if ratio >= 1 and abs(n - ratio * markers.n) <= ratio:
            rate_hz = ratio * markers.rate_hz
            action = f"took the first as the first frame's and {rate_hz:g} Hz"
            findings.append(about_unit("that count rows", action, _WHAT))
            own = stamps.times(1 / rate_hz, float(stamps.values[0]))
            return replace(own, digits=(0.0, 0.0)), (rate_hz,)
        late_s = abs(stamps.values[0] / 1e3 - markers.first_s)
        if stamps.values[0] < 2 or late_s > 1 / markers.rate_hz:
            note = f"the times of the .mot count {n} rows, and none of its rates has as many in "
            raise _NoForcesError(f"{note}the {markers.n} frames of the markers")
    lasts = abs(float(stamps.values[-1] - stamps.values[0]))
    sizes = {"s": 1.0, **UNITS_S}
    possible = {name: size for name, size in sizes.items() if step * size * MOST_HZ >= 1}
    if not possible:
        raise _NoForcesError(_UNEVEN)
    name = min(possible, key=lambda unit: abs(np.log(lasts * possible[unit] / markers.lasts_s())))
    if name == "s":
        return stamps, ()
    findings.append(
        about_unit(f"in {name}: {step:.4g} from row to row", f"read them in {name}", _WHAT)
    )
    return stamps.times(possible[name]), ()


def _begin_together(stamps: Stamps, markers: _MarkerTimes, findings: list[Finding]) -> bool:
    """Whether the forces begin with the markers, whatever the stamps say.

    Forces that begin at another time than the markers but last as long were counted from another
    zero. There are none where they share no time otherwise.
    """
    times = stamps.values
    first, last = float(times.min()), float(times.max())
    near = 1 / markers.rate_hz + stamps.step()
    is_as_long = abs((last - first) - markers.lasts_s()) <= near + stamps.digits[1]
    apart_s = abs(first - markers.first_s)
    overlap_s = min(last, markers.first_s + markers.lasts_s()) - max(first, markers.first_s)
    is_together = overlap_s > min(near, 0.5 * (last - first))
    found = f"forces at {_span(first, last)} s and markers at {markers.span()} s"
    action, level = "took their first samples as simultaneous", "corrected"
    counts_frames = not np.isfinite(markers.unsure_s)
    # Clocks that were started apart do not stop after the same time: both files were cut alike.
    if is_as_long and not (is_together and markers.unsure_s < apart_s <= near):
        if apart_s <= (markers.unsure_s if is_together and not counts_frames else near):
            return True  # within what is printed
        if counts_frames and is_together:
            found += ": as long, and those count frames"
        elif is_together:
            found, level = f"{found}: as long, but not from one zero", "warning"
            action += "; if both times are right, cut both files to the time that they share"
        else:
            found += ": as long, and never at once"
    elif not is_together:
        raise _NoForcesError(found)
    elif counts_frames and apart_s > near:
        found, level = f"{found}: perhaps from another zero", "warning"
        action = "took both as written; if they were cut alike, give them the same first time"
    else:
        return False
    findings.append(Finding("time", "", found, "one clock", action, level))
    return is_as_long


def _span(first_s: float, last_s: float) -> str:
    return f"{first_s:.4g} to {last_s:.4g}" if last_s < 1e4 else f"{first_s:.6f} to {last_s:.6f}"
