"""C3D files: markers and force plates through ezc3d."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import ezc3d
import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings import world
from bsip_cli.recordings.analog import check_samples
from bsip_cli.recordings.assemble import Forces, PlateSource, settle_forces
from bsip_cli.recordings.c3d_header import check_header
from bsip_cli.recordings.c3d_plates import PlateChannels, plate_surfaces, read_plates, value
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.plates import local_wrench
from bsip_cli.recordings.units import length_in_m

_UNLABELLED = re.compile(r"^(\*.*|u\d+|unlabell?ed.*|)$", re.IGNORECASE)
_OUTPUT_GROUPS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_OUTPUT_NAMES = re.compile(
    r"^(centreofmass.*|centerofmass.*|.*(angles?|forces?|moments?|power))$", re.IGNORECASE
)
_AXIS_ENDINGS = "OALP"  # Plug-in Gait draws a segment by four points, PELO PELA PELL PELP


@dataclass(frozen=True)
class _Points:
    labels: tuple[str, ...]
    positions_m: np.ndarray  # (n_frames, n_markers, 3), lab frame, NaN = missing
    findings: tuple[Finding, ...]


def read_c3d(path: Path) -> Recording:
    """Markers and plates of a C3D file, SI, Z-up world frame."""
    check_header(path)
    content = _open(path)
    parameters = content["parameters"]
    rate_hz = _positive(content["header"]["points"]["frame_rate"], "POINT:RATE", path)
    unit_m, unit_findings = _length_unit(parameters, content)
    points = _points(parameters, content, unit_m)
    analog = content["data"]["analogs"][0]
    per_frame = max(1, analog.shape[1] // max(1, len(points.positions_m)))
    plates, plate_findings = read_plates(parameters, analog, per_frame, unit_m)
    up = _up(parameters, points, plate_surfaces(parameters, unit_m))
    forces = settle_forces(
        [_source(plate, rate_hz * per_frame) for plate in plates], world.rotation_to_z_up(up)
    )
    return _recording(path, content, points, per_frame, up, forces, unit_findings + plate_findings)


def _open(path: Path) -> ezc3d.c3d:
    try:
        return ezc3d.c3d(str(path))
    except (RuntimeError, OSError, ValueError, TypeError, IndexError, MemoryError) as error:
        raise BadDataError(
            f"ezc3d cannot read it: {str(error).strip().rstrip('.')}",
            expected="a standard C3D file",
            remedy="export the trial again",
            file=path,
        ) from error


def _positive(number: float, name: str, path: Path) -> float:
    if not np.isfinite(number) or number <= 0:
        raise BadDataError(f"{name} is {number:g} Hz", expected="a rate above 0 Hz", file=path)
    return float(number)


def _length_unit(parameters: Mapping, content: Mapping) -> tuple[float, list[Finding]]:
    """Size of the unit of points; guessed from the size of the scene if it is misspelt."""
    units = value(parameters.get("POINT", {}), "UNITS")
    stated = units[0] if len(units) else ""
    size = length_in_m(stated)
    exact = stated.strip().lower() in ("m", "mm", "cm")
    if size is None:
        extent = np.nanmax(np.abs(content["data"]["points"][:3]), initial=0.0)
        size = 1e-3 if extent > 20.0 else 1.0
    if exact:
        return size, []
    finding = Finding(
        check="unit",
        subject="points",
        found=f"POINT:UNITS '{stated}'",
        expected="m or mm",
        action=f"read lengths in {'m' if size == 1.0 else 'mm' if size == 1e-3 else 'cm'}",
        level="corrected",
    )
    return size, [finding]


def _points(parameters: Mapping, content: Mapping, unit_m: float) -> _Points:
    """The real markers: model outputs and unlabelled points dropped."""
    data = content["data"]["points"]
    positions = np.transpose(data[:3], (2, 1, 0)) * unit_m
    residuals = content["data"]["meta_points"]["residuals"][0].T
    invalid = ~np.isfinite(positions).all(axis=-1) | (positions == 0).all(axis=-1)
    if residuals.shape == invalid.shape:
        invalid |= residuals < 0
    positions[invalid] = np.nan
    labels, findings = _labels(parameters, positions)
    outputs = _model_outputs(parameters, labels)
    kept = [i for i, label in enumerate(labels) if i not in outputs and not _unlabelled(label)]
    if len(kept) < len(labels):
        findings.append(_dropped(labels, outputs, len(kept)))
    return _Points(tuple(labels[i] for i in kept), positions[:, kept], tuple(findings))


def _unlabelled(label: str) -> bool:
    return bool(_UNLABELLED.match(label.split(":")[-1].strip()))


def _dropped(labels: Sequence[str], outputs: set[int], n_kept: int) -> Finding:
    n_unlabelled = len(labels) - n_kept - len(outputs)
    return Finding(
        check="points",
        subject="",
        found=f"{len(outputs)} model outputs and {max(n_unlabelled, 0)} unlabelled points",
        expected="markers",
        action=f"kept {n_kept} of {len(labels)} points",
        level="info",
    )


def _labels(parameters: Mapping, positions: np.ndarray) -> tuple[list[str], list[Finding]]:
    """POINT:LABELS with its continuations; duplicates resolved by POINT:DESCRIPTIONS."""
    group = parameters.get("POINT", {})
    labels = _continued(group, "LABELS", positions.shape[1])
    counts = Counter(labels)
    twice = [i for i, label in enumerate(labels) if counts[label] > 1 and not _unlabelled(label)]
    if not twice:
        return labels, []
    descriptions = _continued(group, "DESCRIPTIONS", len(labels))
    renamed = [descriptions[i] if i in twice else label for i, label in enumerate(labels)]
    resolved = len(set(renamed[i] for i in twice)) == len(twice) and all(
        renamed[i] and renamed[i] not in counts.keys() - {labels[i]} for i in twice
    )
    names = ", ".join(sorted({labels[i] for i in twice}))
    finding = Finding(
        check="labels",
        subject=names,
        found=f"{len(twice)} points share {len(set(labels[i] for i in twice))} labels",
        expected="one point per label",
        action="named them by POINT:DESCRIPTIONS" if resolved else "cannot tell them apart",
        level="corrected" if resolved else "warning",
    )
    return (renamed if resolved else labels), [finding]


def _continued(group: Mapping, name: str, n: int) -> list[str]:
    """NAME, NAME2, NAME3, ... joined and padded with empty strings to n."""
    texts = list(value(group, name))
    more = 2
    while f"{name}{more}" in group:
        texts += list(value(group, f"{name}{more}"))
        more += 1
    texts = [text.strip() for text in texts[:n]]
    return texts + [""] * (n - len(texts))


def _model_outputs(parameters: Mapping, labels: Sequence[str]) -> set[int]:
    """Indices of angles, forces, moments, powers, modelled points and drawn segment axes."""
    group = parameters.get("POINT", {})
    listed = {name.strip() for key in _output_keys(group) for name in value(group, key)}
    bare = [label.split(":")[-1] for label in labels]
    axes = _segment_axes(bare)
    return {
        i
        for i, label in enumerate(labels)
        if label and (label in listed or bare[i] in axes or _OUTPUT_NAMES.match(bare[i]))
    }


def _output_keys(group: Mapping) -> list[str]:
    """POINT:TYPE_GROUPS lists pairs of plural and singular; the plural names the list."""
    plurals = [name.strip() for name in value(group, "TYPE_GROUPS")][::2]
    names = {*plurals, *_OUTPUT_GROUPS}
    return [name for name in names if name in group and _is_text(value(group, name))]


def _is_text(values: Sequence) -> bool:
    return all(isinstance(entry, str) for entry in values)


def _segment_axes(labels: Sequence[str]) -> set[str]:
    present = set(labels)
    stems = {label[:-1] for label in labels if label[-1:] == "O" and len(label) >= 3}
    complete = {s for s in stems if all(s + ending in present for ending in _AXIS_ENDINGS)}
    return {stem + ending for stem in complete for ending in _AXIS_ENDINGS}


def _up(parameters: Mapping, points: _Points, surfaces: Sequence[np.ndarray]) -> world.Up:
    """From the plates and the markers above them, else the labels, else what the file says."""
    surface = None
    if surfaces:
        normals = np.array([np.cross(c[0] - c[1], c[0] - c[3]) for c in surfaces])
        centres = np.array([c.mean(axis=0) for c in surfaces])
        surface = world.up_from_surface(normals, centres, points.positions_m)
    screen = value(parameters.get("POINT", {}), "Y_SCREEN")
    return (
        surface
        or world.up_from_labels(points.labels, points.positions_m)
        or (world.up_from_name(screen[0]) if len(screen) else None)
        or world.Up(2, 1, "nothing says otherwise")
    )


def _source(plate: PlateChannels, analog_rate_hz: float) -> PlateSource:
    wrench = local_wrench(plate.plate.kind, plate.channels, plate.plate)
    samples = check_samples(
        plate.channels, plate.counts, wrench.force_N[:, 2], analog_rate_hz
    )
    return PlateSource(plate.plate, wrench, samples, plate.baseline)


def _recording(
    path: Path,
    content: Mapping,
    points: _Points,
    per_frame: int,
    up: world.Up,
    forces: Forces,
    findings: list[Finding],
) -> Recording:
    rate_hz = float(content["header"]["points"]["frame_rate"])
    rotation = world.rotation_to_z_up(up)
    turned = world.finding_about(up)
    return Recording(
        path=path,
        marker_rate_hz=rate_hz,
        labels=points.labels,
        markers_m=points.positions_m @ rotation.T,
        analog_rate_hz=rate_hz * per_frame,
        plates=forces.plates,
        findings=(*points.findings, *findings, *([turned] if turned else []), *forces.findings),
        rotation_world_lab=rotation,
        forces_note=forces.note,
        time0_s=content["header"]["points"]["first_frame"] / rate_hz,
    )
