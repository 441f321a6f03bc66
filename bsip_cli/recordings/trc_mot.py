"""A TRC with its MOT: markers and ground forces in the convention of OpenSim (Y up)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files.force_files import forces_beside
from bsip_cli.recordings import world
from bsip_cli.recordings.analog import spike_samples
from bsip_cli.recordings.assemble import why_no_forces
from bsip_cli.recordings.force_times import UNEVEN, MarkerTimes, settle_force_times
from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.mot import GroundForce, Mot, read_mot
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

_VALUES_PER_BYTE = 5  # of both files: a grid of forces may need as much memory as c3d_guard allows
_LARGEST_ROOM = 20.0  # a point of force further away is in mm


@dataclass(frozen=True, eq=False)
class _Action:
    """All forces of a MOT, lab frame, sign and unit settled, at the MOT's times."""

    names: tuple[str, ...]
    force_N: np.ndarray  # (n_forces, n, 3), on the body
    moment_Nm: np.ndarray  # (n_forces, n, 3), about the lab's origin
    findings: tuple[Finding, ...]


def read_trc_mot(path: Path) -> Recording:
    """Markers from the TRC; plates from the file of forces beside it, if there is one."""
    trc = read_trc(path)
    times, positions, findings = _even_markers(trc, path)
    mot_path = forces_beside(path)
    mot = read_mot(mot_path) if mot_path else None
    most = _VALUES_PER_BYTE * sum(file.stat().st_size for file in (path, mot_path) if file)
    up = _up(trc, mot)
    rotation = world.rotation_to_z_up(up)
    analog_rate_hz, plates, note, found = _plates(mot, up, rotation, times, most)
    turned = world.finding_about(up)
    return Recording(
        path=path,
        marker_rate_hz=times.rate_hz,
        labels=trc.labels,
        markers_m=positions @ rotation.T,
        analog_rate_hz=analog_rate_hz,
        plates=() if note else plates,
        findings=(*trc.findings, *findings, *([turned] if turned else []), *found),
        rotation_world_lab=rotation,
        forces_note=note,
        time0_s=times.first_s,
    )


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
    if mot is not None and (loaded := _largest_loads(mot)) is not None:
        force, point = loaded
        scale = _point_scale(mot)
        surface = world.up_from_surface(
            np.abs(force).mean(axis=0)[None], point * scale, trc.positions_m
        )
    return (
        surface
        or world.up_from_labels(trc.labels, trc.positions_m)
        or world.Up(1, 1, "the convention of TRC files")
    )


def _largest_loads(mot: Mot) -> tuple[np.ndarray, np.ndarray] | None:
    pairs = [(f.force_N, f.point) for f in mot.forces if f.point is not None]
    if not pairs:
        return None
    force, point = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    loaded = np.linalg.norm(np.nan_to_num(force), axis=1) > LOADED_N
    return (force[loaded], point[loaded]) if loaded.any() else None


def _point_scale(mot: Mot) -> float:
    """Metres per length unit of the points of force."""
    loaded = _largest_loads(mot)
    far = loaded is not None and np.median(np.abs(loaded[1]).max(axis=1)) > _LARGEST_ROOM
    return 1e-3 if far else 1.0


def _plates(
    mot: Mot | None,
    up: world.Up,
    rotation: np.ndarray,
    markers: MarkerTimes,
    most_values: int,
) -> tuple[float, tuple[Plate, ...], str, tuple[Finding, ...]]:
    """Analog rate, plates, the reason for none, findings."""
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
    action = _action(mot, up)
    samples_s = markers.first_s + np.arange(round(last) + 1) / grid.rate_hz
    plates = tuple(
        _plate(name, onto_grid(grid, np.hstack([force, moment]), samples_s), rotation)
        for name, force, moment in zip(action.names, action.force_N, action.moment_Nm, strict=True)
    )
    findings += [*grid.findings, *action.findings, *_coverage(plates, grid, markers)]
    return grid.rate_hz, plates, why_no_forces(plates), tuple(findings)


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


def _action(mot: Mot, up: world.Up) -> _Action:
    scale = _point_scale(mot)
    force = np.array([f.force_N for f in mot.forces])
    moment = np.array([_moment_about_origin(f, scale) for f in mot.forces])
    lift = force @ up.vector()
    findings = [*_about_missing(mot)]
    if scale != 1.0:
        findings.append(_finding("unit", "points of force beyond 20 m", "m", "read them in mm"))
    if np.nansum(lift) < 0:
        force, moment = -force, -moment
        median = np.nanmedian(lift[np.abs(lift) > LOADED_N / 5])
        found = f"median vertical force {median:.0f} N: the action on the ground"
        findings.append(
            _finding("plate_sign", found, "the force on the body", "reversed forces and torques")
        )
    return _Action(tuple(f.name for f in mot.forces), force, moment, tuple(findings))


def _moment_about_origin(force: GroundForce, scale_m: float) -> np.ndarray:
    """p x F + T, (n, 3); what the file does not have is zero."""
    moment = np.zeros_like(force.force_N) if force.moment is None else force.moment
    if force.point is None:
        return moment
    return np.cross(force.point * scale_m, force.force_N) + moment


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


def _finding(check: str, found: str, expected: str, action: str) -> Finding:
    return Finding(check, "", found, expected, action, "corrected")


def _plate(name: str, wrench: np.ndarray, rotation: np.ndarray) -> Plate:
    """A plate of unknown outline from its wrench (n, 6), lab frame."""
    usable = np.isfinite(wrench).all(axis=1) & ~spike_samples(wrench, np.abs(wrench).max(axis=1))
    return Plate(name, wrench[:, :3] @ rotation.T, wrench[:, 3:] @ rotation.T, None, usable)


def _coverage(plates: tuple[Plate, ...], grid: Grid, markers: MarkerTimes) -> list[Finding]:
    findings = []
    for plate in plates:
        missing = ~np.isfinite(plate.wrench()).all(axis=1)
        spikes = ~plate.usable & ~missing
        n = len(missing)
        if missing.any():
            found = f"no force for {missing.sum()} of {n} samples of the markers' time"
            expected = (
                f"forces as long as the markers, {markers.span()} s (the file "
                f"has {grid.samples_s[0]:.4g} to {grid.samples_s[-1]:.4g} s)"
            )
            findings.append(_lost("nan", plate, found, expected))
        if spikes.any():
            found = f"{spikes.sum()} of {n} samples leave their neighbours and come back at once"
            findings.append(_lost("spike", plate, found, "none"))
    return findings


def _lost(kind: str, plate: Plate, found: str, expected: str) -> Finding:
    action = "marked them unusable"
    return Finding(f"analog_{kind}", plate.name, found, expected, action, "warning")
