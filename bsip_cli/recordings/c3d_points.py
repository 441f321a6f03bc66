"""The markers of a C3D file: units, missing points, labels, model outputs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.c3d_content import Content
from bsip_cli.recordings.c3d_parameters import Group, texts
from bsip_cli.recordings.labels import is_unlabelled
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.scene_size import without_absurd

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
    findings: tuple[Finding, ...]


def read_points(content: Content, unit_m: float) -> Points:
    """The real markers: model outputs and unlabelled points dropped."""
    positions = content.positions * unit_m
    invalid = ~np.isfinite(positions).all(axis=-1) | (positions == 0).all(axis=-1)
    positions[invalid | ~content.is_valid] = np.nan
    group = content.group("POINT")
    labels, findings = _labels(group, positions)
    findings += without_absurd(positions)
    outputs = _model_outputs(group, labels)
    kept = [i for i, label in enumerate(labels) if i not in outputs and not is_unlabelled(label)]
    if len(kept) < len(labels):
        findings.append(_dropped(labels, outputs, len(kept)))
    return Points(tuple(labels[i] for i in kept), positions[:, kept], tuple(findings))


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


def _labels(group: Group, positions: np.ndarray) -> tuple[list[str], list[Finding]]:
    """POINT:LABELS with its continuations; duplicates resolved by POINT:DESCRIPTIONS."""
    labels = _continued(group, "LABELS", positions.shape[1])
    counts = Counter(labels)
    twice = [i for i, label in enumerate(labels) if counts[label] > 1 and not is_unlabelled(label)]
    if not twice:
        return labels, []
    descriptions = _continued(group, "DESCRIPTIONS", len(labels))
    renamed = [descriptions[i] if i in twice else label for i, label in enumerate(labels)]
    resolved = len({renamed[i] for i in twice}) == len(twice) and all(
        renamed[i] and renamed[i] not in counts.keys() - {labels[i]} for i in twice
    )
    names = ", ".join(sorted({labels[i] for i in twice}))
    finding = Finding(
        check="labels",
        subject=names,
        found=f"{len(twice)} points share {len({labels[i] for i in twice})} labels",
        expected="one point per label",
        action="named them by POINT:DESCRIPTIONS" if resolved else "cannot tell them apart",
        level="corrected" if resolved else "warning",
    )
    return (renamed if resolved else labels), [finding]


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
