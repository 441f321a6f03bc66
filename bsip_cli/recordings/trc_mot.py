"""A TRC with its MOT: markers and ground forces in the convention of OpenSim (Y up)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files.force_files import forces_beside
from bsip_cli.recordings import world
from bsip_cli.recordings.analog import spike_samples
from bsip_cli.recordings.force_times import UNEVEN, MarkerTimes, settle_force_times
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.mot import GroundForce, Mot, read_mot
from bsip_cli.recordings.opened import Opened
from bsip_cli.recordings.plate_reading import PlateReading
from bsip_cli.recordings.plate_source import ForceOnPoint, points_that_move
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.timebase import (
    FRAMES,
    MOST_HZ,
    Grid,
    counted,
    even_grid,
    in_seconds,
    onto_grid,
)
from bsip_cli.recordings.trc import Trc, read_trc
from bsip_cli.recordings.units import length_in_m, moment_in_Nm

_VALUES_PER_BYTE = 5  # of both files: a grid of forces may need as much memory as c3d_guard allows
_MM = 1e-3


def open_trc_mot(path: Path) -> Opened:
    """Markers from the TRC; forces as written in the file beside it, if there is one."""
    trc = read_trc(path)
    times, positions, findings = _even_markers(trc, path)
    mot_path = forces_beside(path)
    mot = read_mot(mot_path) if mot_path else None
    most = _VALUES_PER_BYTE * sum(file.stat().st_size for file in (path, mot_path) if file)
    up = _up(trc, mot)
    rotation = world.rotation_to_z_up(up)
    analog_rate_hz, sources, note, found = _forces(mot, rotation, times, most)
    turned = world.finding_about(up)
    recording = Recording(
        path=path,
        marker_rate_hz=times.rate_hz,
        labels=trc.labels,
        markers_m=positions @ rotation.T,
        analog_rate_hz=analog_rate_hz,
        plates=(),
        findings=(*trc.findings, *findings, *([turned] if turned else []), *found),
        rotation_world_lab=rotation,
        forces_note=note,
        time0_s=times.first_s,
    )
    return Opened(recording, sources)


def _even_markers(trc: Trc, path: Path) -> tuple[MarkerTimes, np.ndarray, tuple[Finding, ...]]:
    """Times, positions (n, n_markers, 3) at these even times, and what was done."""
    if len(trc.stamps.values) < 2:
        raise BadDataError(
            f"{len(trc.stamps.values)} frame",
            expected="at least 2 frames with times",
            remedy="export the whole trial",
            file=path,
        )
    stamps, findings = in_seconds(trc.stamps, trc.rates_hz)
    if stamps is not None and trc.counts_frames:
        stamps, about = counted(stamps, trc.rates_hz)
        findings += about
    if stamps is None:
        raise BadDataError(
            "times that count frames, and no DataRate",
            expected="times in s, or the rate in the header",
            remedy="export the trial with its rate",
            file=path,
        )
    grid = even_grid(stamps, trc.rates_hz)
    if grid is None:
        raise BadDataError(
            "times that do not increase evenly",
            expected=f"increasing times of one rate, below {MOST_HZ:,.0f} Hz",
            remedy="export the trial again",
            file=path,
        )
    unsure_s = float(np.ptp(stamps.values[grid.samples] - grid.samples_s))
    times = MarkerTimes(
        first_s=float(grid.time_s[0]),
        rate_hz=grid.rate_hz,
        n=len(grid.time_s),
        unsure_s=np.inf if stamps.unit == FRAMES else unsure_s,
    )
    return times, onto_grid(grid, trc.positions_m), (*findings, *grid.findings)


def _up(trc: Trc, mot: Mot | None) -> world.Up:
    """From the direction of the forces, the markers telling its sign; else labels; else Y."""
    surface = None
    if mot is not None:
        force = np.concatenate([f.force_N for f in mot.forces])
        points = [np.zeros_like(f.force_N) if f.point is None else f.point for f in mot.forces]
        loaded = np.linalg.norm(np.nan_to_num(force), axis=1) > LOADED_N
        on_floor = np.concatenate(points)[loaded] * _MM  # at least: what is low is low in any unit
        if loaded.any():
            mean = np.abs(force[loaded]).mean(axis=0)
            surface = world.up_from_surface(mean[None], on_floor, trc.positions_m)
    return (
        surface
        or world.up_from_labels(trc.labels, trc.positions_m)
        or world.Up(1, 1, "the convention of TRC files")
    )


def _forces(
    mot: Mot | None,
    rotation: np.ndarray,
    markers: MarkerTimes,
    most_values: int,
) -> tuple[float, tuple[ForceOnPoint, ...], str, tuple[Finding, ...]]:
    """Analog rate, forces as written, the reason for none, findings."""
    if mot is None:
        return markers.rate_hz, (), "no .mot file of the same name beside the .trc", ()
    if note := _unplaced(mot):
        return markers.rate_hz, (), note, mot.findings
    settled = settle_force_times(mot.stamps, markers)
    findings = [*mot.findings, *settled.findings]
    grid = None
    if settled.stamps is not None:
        grid = even_grid(settled.stamps, settled.rates_hz, markers.rate_hz)
        if grid is not None and settled.is_simultaneous:
            torn_off_s = grid.time_s[0] - settled.stamps.values[0] if grid.samples.start else 0.0
            grid = grid.from_time(markers.first_s + torn_off_s)
    if grid is None:
        note = settled.note or UNEVEN
        return markers.rate_hz, (), note, tuple(findings)
    last = markers.lasts_s() * grid.rate_hz
    if 6 * last * len(mot.forces) > most_values:
        rows = len(mot.stamps.values)
        note = f"the .mot has {rows} rows and {last:.3g} would be needed beside the .trc"
        return markers.rate_hz, (), note, tuple(findings)
    samples_s = markers.first_s + np.arange(round(last) + 1) / grid.rate_hz
    findings += [*grid.findings, *_about_missing(mot)]
    sources = []
    for force in mot.forces:
        source, found = _source(force, grid, samples_s, rotation, markers)
        sources.append(source)
        findings += found
    return grid.rate_hz, tuple(sources), "", tuple(findings)


def _source(
    force: GroundForce,
    grid: Grid,
    samples_s: np.ndarray,
    rotation: np.ndarray,
    markers: MarkerTimes,
) -> tuple[ForceOnPoint, list[Finding]]:
    """One force on the markers' time, as written, with its faulty samples marked."""
    point = _in_si(force.point, length_in_m, force.point_unit)
    moment = _in_si(force.moment, moment_in_Nm, force.moment_unit)
    loaded = np.linalg.norm(np.nan_to_num(force.force_N), axis=1) > LOADED_N
    parts = [x for x in (force.force_N, point, moment) if x is not None]
    rows = onto_grid(grid, np.hstack(parts), samples_s)
    columns = iter(np.split(rows, len(parts), axis=1))
    missing = ~np.isfinite(rows).all(axis=1)
    height = [] if point is None else point[loaded] @ rotation[2]
    source = ForceOnPoint(
        name=force.name,
        force_N=next(columns),
        points=None if point is None else next(columns),
        moment=next(columns, np.zeros((len(rows), 3))),  # without columns: no free torque, and said
        point_height=float(np.nanmedian(height)) if len(height) else 0.0,
        points_move=point is not None and points_that_move(point, loaded),
        usable=~missing,
        rotation_world_lab=rotation,
    )
    wrench = source.plate(PlateReading()).wrench()  # points alone leap where the load begins
    spikes = spike_samples(wrench, np.abs(wrench[:, :3]).max(axis=1)) & ~missing
    source = replace(source, usable=~missing & ~spikes)
    return source, _coverage(force.name, missing, spikes, grid, markers)


def _in_si(
    values: np.ndarray | None, size: Callable[[str], float | None], unit: str
) -> np.ndarray | None:
    """In the unit that the file names; as written where it names none that is known."""
    return None if values is None else values * (size(unit) or 1.0)


def _unplaced(mot: Mot) -> str:
    """Why the forces have no centre of pressure, or nothing."""
    bare = [f.name for f in mot.forces if f.point is None and f.moment is None]
    bare = [name for name in bare if np.nan_to_num(mot.forces[int(name) - 1].force_N).any()]
    if not bare:
        return ""
    which = "" if len(bare) == len(mot.forces) else f" {' and '.join(bare)}"
    return (
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


def _coverage(
    name: str, missing: np.ndarray, spikes: np.ndarray, grid: Grid, markers: MarkerTimes
) -> list[Finding]:
    findings, n = [], len(missing)
    if missing.any():
        found = f"no force for {missing.sum()} of {n} samples of the markers' time"
        expected = (
            f"forces as long as the markers, {markers.span()} s (the file "
            f"has {grid.samples_s[0]:.4g} to {grid.samples_s[-1]:.4g} s)"
        )
        findings.append(_lost("nan", name, found, expected))
    if spikes.any():
        found = f"{spikes.sum()} of {n} samples leave their neighbours and come back at once"
        findings.append(_lost("spike", name, found, "none"))
    return findings


def _lost(kind: str, name: str, found: str, expected: str) -> Finding:
    return Finding(f"analog_{kind}", name, found, expected, "marked them unusable", "warning")
