"""A TRC with its MOT: markers and ground forces in the convention of OpenSim (Y up)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files.force_files import forces_beside
from bsip_cli.recordings import world
from bsip_cli.recordings.analog import spike_samples
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.mot import GroundForce, Mot, read_mot
from bsip_cli.recordings.plate_reading import PlateReading
from bsip_cli.recordings.plate_source import ForceOnPoint, points_that_move
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.settle import Opened
from bsip_cli.recordings.timebase import MOST_HZ, Grid, even_grid, onto_grid
from bsip_cli.recordings.trc import Trc, read_trc

_VALUES_PER_BYTE = 5  # of both files: a grid of forces may need as much memory as c3d_guard allows
_MM = 1e-3


def open_trc_mot(path: Path) -> Opened:
    """Markers from the TRC; forces as written in the file beside it, if there is one."""
    trc = read_trc(path)
    time_s, rate_hz, positions, findings = _even_markers(trc, path)
    mot_path = forces_beside(path)
    mot = read_mot(mot_path) if mot_path else None
    most = _VALUES_PER_BYTE * sum(file.stat().st_size for file in (path, mot_path) if file)
    up = _up(trc, mot)
    rotation = world.rotation_to_z_up(up)
    analog_rate_hz, sources, note, found = _forces(mot, rotation, time_s, rate_hz, most)
    turned = world.finding_about(up)
    recording = Recording(
        path=path,
        marker_rate_hz=rate_hz,
        labels=trc.labels,
        markers_m=positions @ rotation.T,
        analog_rate_hz=analog_rate_hz,
        plates=(),
        findings=(*trc.findings, *findings, *([turned] if turned else []), *found),
        rotation_world_lab=rotation,
        forces_note=note,
        time0_s=float(time_s[0]),
    )
    return Opened(recording, sources)


def _even_markers(
    trc: Trc, path: Path
) -> tuple[np.ndarray, float, np.ndarray, tuple[Finding, ...]]:
    """Times (n,), rate, positions (n, n_markers, 3) on an even grid, and what was done."""
    if len(trc.time_s) < 2:
        raise BadDataError(
            f"{len(trc.time_s)} frame",
            expected="at least 2 frames with times",
            remedy="export the whole trial",
            file=path,
        )
    grid = even_grid(trc.time_s, trc.rate_hz)
    if grid is None:
        raise BadDataError(
            "times that do not increase evenly",
            expected=f"increasing times of one rate, below {MOST_HZ:,.0f} Hz",
            remedy="export the trial again",
            file=path,
        )
    return grid.time_s, grid.rate_hz, onto_grid(grid, trc.time_s, trc.positions_m), grid.findings


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
    time_s: np.ndarray,
    marker_rate_hz: float,
    most_values: int,
) -> tuple[float, tuple[ForceOnPoint, ...], str, tuple[Finding, ...]]:
    """Analog rate, forces as written, the reason for none, findings."""
    if mot is None:
        return marker_rate_hz, (), "no .mot file of the same name beside the .trc", ()
    grid = even_grid(mot.time_s, float("nan"))
    if grid is None:
        return marker_rate_hz, (), "the times of the .mot do not increase evenly", ()
    last = float(time_s[-1] - time_s[0]) * grid.rate_hz
    if 6 * last * len(mot.forces) > most_values:
        note = f"the .mot has {len(mot.time_s)} rows and {last:.3g} would be needed beside the .trc"
        return marker_rate_hz, (), note, ()
    analog = replace(grid, time_s=time_s[0] + np.arange(round(last) + 1) / grid.rate_hz)
    if any(force.point is None and force.moment is None for force in mot.forces):
        note = "the .mot has forces, and neither the points that they act on nor moments"
        return marker_rate_hz, (), note, mot.findings
    sources, findings = [], [*mot.findings, *grid.findings]
    for force in mot.forces:
        source, found = _source(force, analog, mot.time_s, rotation)
        sources.append(source)
        findings += found
    return grid.rate_hz, tuple(sources), "", tuple(findings)


def _source(
    force: GroundForce, grid: Grid, stamps_s: np.ndarray, rotation: np.ndarray
) -> tuple[ForceOnPoint, list[Finding]]:
    """One force on the markers' time, as written, with its faulty samples marked."""
    loaded = np.linalg.norm(np.nan_to_num(force.force_N), axis=1) > LOADED_N
    parts = [x for x in (force.force_N, force.point, force.moment) if x is not None]
    rows = onto_grid(grid, stamps_s, np.hstack(parts))
    missing = ~np.isfinite(rows).all(axis=1)
    columns = iter(np.split(rows, len(parts), axis=1))
    height = [] if force.point is None else force.point[loaded] @ rotation[2]
    source = ForceOnPoint(
        name=force.name,
        force_N=next(columns),
        points=None if force.point is None else next(columns),
        moment=None if force.moment is None else next(columns),
        point_height=float(np.nanmedian(height)) if len(height) else 0.0,
        points_move=force.point is not None and points_that_move(force.point, loaded),
        usable=~missing,
        rotation_world_lab=rotation,
    )
    wrench = source.plate(PlateReading()).wrench()  # points alone leap where the load begins
    spikes = spike_samples(wrench, np.abs(wrench[:, :3]).max(axis=1)) & ~missing
    source = replace(source, usable=~missing & ~spikes)
    return source, _coverage(force.name, missing, spikes)


def _coverage(name: str, missing: np.ndarray, spikes: np.ndarray) -> list[Finding]:
    findings, n = [], len(missing)
    if missing.any():
        found = f"no force for {missing.sum()} of {n} samples of the markers' time"
        findings.append(_lost("nan", name, found, "forces as long as the markers"))
    if spikes.any():
        found = f"{spikes.sum()} of {n} samples leave their neighbours and come back at once"
        findings.append(_lost("spike", name, found, "none"))
    return findings


def _lost(kind: str, name: str, found: str, expected: str) -> Finding:
    return Finding(f"analog_{kind}", name, found, expected, "marked them unusable", "warning")
