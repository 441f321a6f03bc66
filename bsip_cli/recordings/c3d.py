"""C3D files: markers, and what is said of the person and the day."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import numpy as np

from bsip_cli.recordings import scene
from bsip_cli.recordings.c3d_content import Content, read_content
from bsip_cli.recordings.c3d_format import Group, texts, whole_numbers
from bsip_cli.recordings.c3d_person import stated_person
from bsip_cli.recordings.c3d_plates import plate_surfaces, read_plates
from bsip_cli.recordings.gaps import without_absurd, without_sentinels
from bsip_cli.recordings.labels import is_unlabelled
from bsip_cli.recordings.model import Finding, Recording, refusal
from bsip_cli.recordings.plate_reading import Opened

# Turns about the vertical by right angles, which two ways to turn a frame Z-up may differ by.
_QUARTERS = [
    np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
]
_OUTPUT_GROUPS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_OUTPUT_NAMES = re.compile(
    r"^(centreofmass.*|centerofmass.*|.*(angles?|forces?|moments?|power))$", re.IGNORECASE
)
_AXIS_ENDINGS = "OALP"  # Plug-in Gait draws a segment by four points, PELO PELA PELL PELP
_HEAD = re.compile(r"[^\W_]+[_.\- ]+")  # of the person, in front of most labels
_FIRST_YEAR = 1987  # of the format
_FEW_PERCENT = 2.0  # of positions may be ghosts
_NEAR_FLOOR_M = 0.12  # markers of a foot that stands


def open_c3d(path: Path) -> Opened:
    """Markers of a C3D file, SI, Z-up world frame, and its plates as it describes them."""
    content = read_content(path)
    labels, positions_m, unit_m, about_points = _read_points(content, path)
    surfaces = plate_surfaces(content.group("FORCE_PLATFORM"), unit_m)
    up, up_of_plates = _ups(content, labels, positions_m, surfaces)
    rotation, of_plates = map(scene.rotation_to_z_up, (up, up_of_plates))
    plates, about_plates, about_samples = read_plates(content, unit_m, of_plates)
    stated, about_person = stated_person(content.parameters)
    about = (*content.findings, *about_points, *about_plates)
    about += tuple(scene.findings_about(up, up_of_plates))
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
        time0_s=content.time0_s,
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


def _ups(
    content: Content,
    labels: Sequence[str],
    positions_m: np.ndarray,
    surfaces: Sequence[np.ndarray],
) -> tuple[scene.Up, scene.Up]:
    """Of the markers, and of the plates, which a conversion may have left in other axes.

    From the plates and the markers above them, else the labels, else what the file says.
    """
    surface, by_labels = None, scene.up_from_labels(labels, positions_m)
    if surfaces:
        normals = np.array([np.cross(c[0] - c[1], c[0] - c[3]) for c in surfaces])
        centres = np.array([c.mean(axis=0) for c in surfaces])
        surface = scene.up_from_surface(normals, centres, positions_m)
        of_plates = scene.Up(int(np.argmax(np.abs(normals).sum(axis=0))), 1, "the plates lie level")

        def stand(up: scene.Up, up_of_plates: scene.Up) -> bool:
            turn, of_plates = map(scene.rotation_to_z_up, (up, up_of_plates))
            level = [corners @ of_plates.T for corners in surfaces]
            quarters = _QUARTERS if up != up_of_plates else [np.eye(3)]
            turned = ([corners @ quarter.T for corners in level] for quarter in quarters)
            return any(_stands_on(labels, positions_m @ turn.T, one) for one in turned)

        if (
            by_labels
            and by_labels.axis != of_plates.axis
            and not (surface and stand(surface, surface))
            and stand(by_labels, of_plates)
        ):
            return by_labels, of_plates
    screen = texts(content.group("POINT"), "Y_SCREEN")
    up = (
        surface
        or by_labels
        or (scene.up_from_name(screen[0]) if screen else None)
        or scene.Up(2, 1, "nothing says otherwise")
    )
    return up, up


def _stands_on(
    labels: Sequence[str], markers_m: np.ndarray, surfaces_m: Sequence[np.ndarray]
) -> bool:
    """Whether a person of markers (n_frames, n_markers, 3) is over surfaces of corners (4, 3), both
    Z-up: none of the body under the floor, and at times a foot on a surface."""
    floor_m = np.median([corners[:, 2].mean() for corners in surfaces_m])
    heights = markers_m[..., 2] - floor_m
    if np.nanpercentile(heights, _FEW_PERCENT) < -_NEAR_FLOOR_M:
        return False
    by_part = scene.by_segment(labels, markers_m)
    feet = [by_part[name].reshape(-1, 3) for name in ("foot_l", "foot_r") if name in by_part]
    seen = np.concatenate([np.zeros((0, 3)), *feet])
    low = seen[np.abs(seen[:, 2] - floor_m) < _NEAR_FLOOR_M, :2]
    edges = ((one[:, :2].min(axis=0), one[:, :2].max(axis=0)) for one in surfaces_m)
    return any(((low > least) & (low < most)).all(axis=1).any() for least, most in edges)


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
    findings += without_sentinels(positions)
    stated = "".join(texts(group, "UNITS")[:1])
    shown = positions if kept else np.where(is_valid[..., None], every, np.nan)
    names = [labels[i] for i in kept]
    unit_m, about_unit = scene.decided_unit(shown, names or labels, stated, "POINT:UNITS")
    positions *= unit_m
    findings += [*without_absurd(positions), *about_unit]
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
