"""BIDS-Motion: one tracking system per trial, columns as `_channels.tsv` lists them (BIDS 1.10)."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.exports.identified import export_words
from bsip_cli.body.exports.opensim_motion import coordinates
from bsip_cli.body.skeleton import Skeleton

TRACKSYS = "bsip"


@dataclass(frozen=True, eq=False)
class Channel:
    """One column: its line in ``_channels.tsv``, and values (N,), NaN where missing."""

    name: str
    component: str
    type: str
    tracked_point: str
    units: str
    reference_frame: str
    values: np.ndarray


def channels(
    markers: Sequence[str],
    markers_m: np.ndarray,
    skeleton: Skeleton,
    q: np.ndarray,
    determined: np.ndarray,
    plates: Mapping[str, np.ndarray],
) -> list[Channel]:
    """Markers (N, m, 3), pose q (N, nq) in the frames that determine it, and ground wrenches (N, 6)
    on the body about the world's origin, by plate; world frame, SI, angles in degrees."""
    places = (
        Channel(f"{name}_{axis}", axis, "POS", name, "m", "global", markers_m[:, k, c])
        for k, name in enumerate(markers)
        for c, axis in enumerate("xyz")
    )
    components = [("f", axis, "N") for axis in "xyz"] + [("m", axis, "N m") for axis in "xyz"]
    forces = (
        Channel(f"plate{name}_{what}{axis}", axis, "MISC", f"plate{name}", unit, "global", values)
        for name, wrench in plates.items()
        for (what, axis, unit), values in zip(components, wrench.T, strict=True)
    )
    return [*places, *_pose(skeleton, q, determined), *forces]


def _pose(skeleton: Skeleton, q: np.ndarray, determined: np.ndarray) -> Iterator[Channel]:
    def seen(values: np.ndarray) -> np.ndarray:
        found = np.full(len(q), np.nan)
        found[determined] = values
        return found

    base, known = skeleton.segments[0], q[determined]
    for c, axis in enumerate("xyz"):
        yield Channel(f"{base}_t{axis}", axis, "POS", base, "m", "global", seen(known[:, c]))
    for c, part in enumerate("xyzw", start=3):
        name = f"{base}_quat_{part}"
        yield Channel(name, f"quat_{part}", "ORNT", base, "n/a", "global", seen(known[:, c]))
    for name, trajectory in coordinates(skeleton, known).items():
        joint, part = name.rsplit("_", 1)
        if joint == skeleton.joints[0]:
            continue
        axis = part[1] if part in ("rx", "ry", "rz") else "n/a"
        values = seen(np.rad2deg(trajectory))
        yield Channel(name, axis, "JNTANG", joint, "deg", "joint", values)


def motion_tsv(columns: Sequence[Channel]) -> str:
    """Values, a row per frame, without a header."""
    rows = np.column_stack([one.values for one in columns])
    lines = ("\t".join("n/a" if np.isnan(x) else f"{x:.9g}" for x in row) for row in rows)
    return "\n".join([*lines, ""])


def channels_tsv(columns: Sequence[Channel]) -> str:
    """A row per column of the motion."""
    names = ("name", "component", "type", "tracked_point", "units", "reference_frame")
    rows = ("\t".join(getattr(one, name) for name in names) for one in columns)
    return "\n".join(["\t".join(names), *rows, ""])


def channels_json() -> str:
    """What the reference frames are."""
    return _json({"reference_frame": {"Levels": export_words()["bids_reference_frames"]}})


def motion_json(columns: Sequence[Channel], task: str, rate_hz: float, version: str) -> str:
    """What is recorded, and how often."""
    counts = Counter(one.type for one in columns)
    return _json(
        {
            "TaskName": task,
            "SamplingFrequency": rate_hz,
            "RecordingDuration": len(columns[0].values) / rate_hz,
            "TrackingSystemName": "markers, model of the body and force plates, by bsip",
            "SoftwareVersions": f"bsip {version}",
            "MotionChannelCount": len(columns),
            "TrackedPointsCount": len({one.tracked_point for one in columns}),
            "MissingValues": "n/a",
        }
        | {f"{kind}ChannelCount": number for kind, number in sorted(counts.items())}
    )


def _json(content: dict[str, object]) -> str:
    return json.dumps(content, indent=2) + "\n"
