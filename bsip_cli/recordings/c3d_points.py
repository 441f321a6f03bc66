"""The markers of a C3D file: units, missing points, labels, model outputs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_content import Content
from bsip_cli.recordings.c3d_parameters import Group, texts
from bsip_cli.recordings.labels import is_unlabelled
from bsip_cli.recordings.missing_points import without_sentinels
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.scene_size import move_like_markers, settle_unit, without_absurd

_OUTPUT_GROUPS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_OUTPUT_NAMES = re.compile(
    r"^(centreofmass.*|centerofmass.*|.*(angles?|forces?|moments?|power))$", re.IGNORECASE
)
_AXIS_ENDINGS = "OALP"  # Plug-in Gait draws a segment by four points, PELO PELA PELL PELP


@dataclass(frozen=True, eq=False)
class Points:
    """The real markers of a file."""

    labels: tuple[str, ...]
    positions_m: np.ndarray  # (n_frames, n_markers, 3), lab frame, NaN = missing
    unit_m: float  # size of the file's unit of length
    findings: tuple[Finding, ...]


def read_points(content: Content, path: Path) -> Points:
    """The real markers: model outputs and unlabelled points dropped."""
    group = content.group("POINT")
    labels, findings = _labels(group, content.positions.shape[1])
    outputs = _model_outputs(group, labels)
    kept = [i for i, label in enumerate(labels) if i not in outputs and not is_unlabelled(label)]
    if len(kept) < len(labels):
        findings.append(_dropped(labels, outputs, len(kept)))
    every = np.where(_written(content.positions)[..., None], content.positions, np.nan)
    positions = every[:, kept]
    is_valid = content.is_valid[:, kept]
    is_ignored = not is_valid.any() and bool(np.isfinite(positions).any())
    if not is_ignored:
        positions[~is_valid] = np.nan
    findings += without_sentinels(positions)
    stated = "".join(texts(group, "UNITS")[:1])
    scene = positions if kept else np.where(content.is_valid[..., None], every, np.nan)
    names = [labels[i] for i in kept] if kept else labels
    unit_m, about_unit = settle_unit(scene, names, stated, "POINT:UNITS")
    positions *= unit_m
    findings += [*without_absurd(positions), *about_unit]
    if is_ignored:
        findings.append(_about_invalid(positions, content.rate_hz, path))
    return Points(tuple(labels[i] for i in kept), positions, unit_m, tuple(findings))


def _written(positions: np.ndarray) -> np.ndarray:
    """Points with a position, (n_frames, n_points) bool: three zeros are none."""
    return np.isfinite(positions).all(axis=-1) & (positions != 0).any(axis=-1)


def _about_invalid(positions_m: np.ndarray, rate_hz: float, path: Path) -> Finding:
    """All points are marked as not seen: what is said if they move as markers do, else refused."""
    found = f"all {positions_m.shape[1]} points are marked invalid (residual -1) in every frame"
    if move_like_markers(positions_m, rate_hz):
        return Finding(
            check="points",
            subject="",
            found=f"{found}, and they move as the markers of a person do",
            expected="a residual of 0 or more where a point was seen",
            action="read them all the same",
            level="warning",
        )
    raise BadDataError(
        f"{found}, and what is written there does not move as markers do",
        expected="points that the cameras saw",
        remedy="reconstruct the trial and export it again",
        file=path,
    )


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


def _labels(group: Group, n_points: int) -> tuple[list[str], list[Finding]]:
    """POINT:LABELS with its continuations; duplicates by POINT:DESCRIPTIONS if these tell."""
    labels = _continued(group, "LABELS", n_points)
    counts = Counter(labels)
    twice = [i for i, label in enumerate(labels) if counts[label] > 1 and not is_unlabelled(label)]
    if not twice:
        return labels, []
    descriptions = _continued(group, "DESCRIPTIONS", len(labels))
    renamed = [descriptions[i] if i in twice else label for i, label in enumerate(labels)]
    resolved = len({renamed[i] for i in twice}) == len(twice) and all(
        renamed[i] and renamed[i] not in counts.keys() - {labels[i]} for i in twice
    )
    if not resolved:  # what nobody asks for need not be told apart
        return labels, []
    names = ", ".join(sorted({labels[i] for i in twice}))
    finding = Finding(
        check="labels",
        subject=names,
        found=f"{len(twice)} points share {len({labels[i] for i in twice})} labels",
        expected="one point per label",
        action="named them by POINT:DESCRIPTIONS",
        level="corrected",
    )
    return renamed, [finding]


def _continued(group: Group, name: str, n: int) -> list[str]:
    """NAME, NAME2, NAME3, ... joined and padded with empty strings to n."""
    known = texts(group, name)[:n]
    return known + [""] * (n - len(known))


def _model_outputs(group: Group, labels: Sequence[str]) -> set[int]:
    """Indices of angles, forces, moments, powers, modelled points and drawn segment axes."""
    listed = {name for key in _output_keys(group) for name in texts(group, key)}
    bare = [label.split(":")[-1] for label in labels]
    axes = _segment_axes(bare)
    return {
        i
        for i, label in enumerate(labels)
        if label and (label in listed or bare[i] in axes or _OUTPUT_NAMES.match(bare[i]))
    }


def _output_keys(group: Group) -> set[str]:
    """POINT:TYPE_GROUPS lists pairs of plural and singular; the plural names the list."""
    return {*(name.upper() for name in texts(group, "TYPE_GROUPS")[::2]), *_OUTPUT_GROUPS}


def _segment_axes(labels: Sequence[str]) -> set[str]:
    present = set(labels)
    stems = {label[:-1] for label in labels if label[-1:] == "O" and len(label) >= 3}
    complete = {s for s in stems if all(s + ending in present for ending in _AXIS_ENDINGS)}
    return {stem + ending for stem in complete for ending in _AXIS_ENDINGS}
