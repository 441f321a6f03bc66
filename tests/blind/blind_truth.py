"""What the diagnosis should print for what the simulator hid: the one place that maps names.

The simulator speaks of channels in the plate's own axes, its z into the floor, and of seconds as
parts of a trial; the diagnosis of forces on the body, z up, and of the file's clock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

PLATE = "1"  # of a simulated lab that has one
# The simulated plate's axes turned about x until z points up.
Z_UP = {"fx": 1.0, "fy": -1.0, "fz": -1.0, "mx": 1.0, "my": -1.0, "mz": -1.0}
ASIDE = 0.15  # horizontal part of an unmeasured contact, of its vertical part
IN_TRIAL = ("start", "end", "release_time", "from_time")  # times on one recording's clock
Record = dict[str, Any]
Mapping = Callable[[Record, Record], tuple[str, dict[str, float]]]


@dataclass(frozen=True)
class Expected:
    """target : as the diagnosis names it. values : parameters as it prints them, in SI units."""

    effect: str
    target: str
    values: dict[str, float]

    def of_the_session(self) -> dict[str, float]:
        """The values that are no times in one recording."""
        return {name: x for name, x in self.values.items() if name not in IN_TRIAL}

    def same_target(self, other: str) -> bool:
        """Whether another target means the same; a pair of markers in either order."""
        return sorted(self.target.split("+")) == sorted(other.split("+"))


def expected(record: Record, trial: Record) -> Expected:
    """What should be printed for one effect of the truth in one trial of the truth."""
    effect = record["effect"]
    if effect.startswith("outside_"):
        return Expected("unexplained", "", {})
    target, values = MAPPINGS[effect](record, trial)
    return Expected(effect, target, values)


def _xyz(name: str, vector: Iterable[float]) -> dict[str, float]:
    return {f"{name}_{axis}": float(x) for axis, x in zip("xyz", vector, strict=True)}


def _plate(record: Record) -> str:
    """The plate that errs; 0 stands for all of them."""
    return str(record["plate"] or PLATE)


def _channel(name: str, signed: bool) -> Mapping:
    def mapped(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
        sign = Z_UP[record["channel"]] if signed else 1.0
        return f"{_plate(record)} {record['channel']}", {name: sign * record["size"]}

    return mapped


def _vector(names: tuple[str, ...], field: str, place: Callable[[Record], str]) -> Mapping:
    return lambda record, trial: (place(record), dict(zip(names, record[field], strict=True)))


def _of_segment(**columns: str) -> Mapping:
    """Parameters that the truth has under other names, at its segment."""
    return lambda record, trial: (
        record.get("segment", "upper_torso"),
        {name: record[column] for name, column in columns.items()},
    )


def _crosstalk(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    source, sink = record["source"], record["to"]
    sign = Z_UP[source] * Z_UP[sink]
    return f"{_plate(record)} {source}>{sink}", {"coefficient": sign * record["size"]}


def _turned(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    x, y, _ = record["turn_rad"]
    return "", {"angle": float(np.hypot(x, y)), "angle_x": x, "angle_y": y}


def _window(record: Record, trial: Record) -> dict[str, float]:
    """Of the movement, of which a delay may have cut the beginning off the recording."""
    begin = trial["recorded_from_s"]
    start, end = (share * (trial["duration_s"] + begin) - begin for share in record["window_share"])
    return {"start": start, "end": end}


def _released(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    begin, release = trial["recorded_from_s"], record["release_s"]
    if release is None:
        release = record["release_share"] * (trial["duration_s"] + begin)
    return record["segment"], {"mass": record["size"], "release_time": release - begin}


def _in_lab(walkway: np.ndarray, trial: Record) -> dict[str, float]:
    """A force in the walkway's axes (X ahead, Y up, Z right), in which it is drawn."""
    force = np.array(trial["walkway_to_lab"]["rotation"]) @ walkway
    return {"force": float(np.linalg.norm(force)), **_xyz("force", force)}


def _contact(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    heading = record["heading_rad"]
    walkway = np.array([ASIDE * np.cos(heading), 1.0, ASIDE * np.sin(heading)])
    force = _in_lab(record["size"] * walkway, trial)
    return record["segment"], {**_window(record, trial), **force}


def _implement(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    distance = float(np.linalg.norm(record["centre_m"]))
    inertia = record["size"] * (distance**2 + record["spread_m"] ** 2)
    return record["segment"], {"mass": record["size"], "centre": distance, "inertia": inertia}


def _shifted_marker(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    """Its direction is drawn in the frame of neighbouring markers: only its length is known."""
    start = record["from_s"]
    if start is None:
        start = record["from_share"] * trial["duration_s"]
    return record["marker"], {"shift": record["size"], "from_time": start}


def _sliding(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    """As of a shifted one."""
    start, end = (share * trial["duration_s"] for share in record["window_share"])
    return record["marker"], {"way": record["size"], "start": start, "end": end}


def _swapped(record: Record, trial: Record) -> tuple[str, dict[str, float]]:
    start = record["start_s"]
    if start is None:
        start = record["start_share"] * (trial["duration_s"] - record["size"])
    pair = f"{record['first']}+{record['second']}"
    return pair, {"start": start, "end": start + record["size"]}


MAPPINGS: dict[str, Mapping] = {
    "sync_offset": lambda r, trial: ("", {"delay": r["size"]}),
    "clock_drift": lambda r, trial: ("", {"rate_error": r["size"]}),
    "frame_rate": lambda r, trial: ("", {"rate_ratio": 1 + r["size"]}),
    "plate_translation": _vector(("x", "y", "z"), "shift_m", _plate),
    "plate_rotation": _vector(("tilt_x", "tilt_y", "yaw"), "turn_rad", _plate),
    "plate_gain": _channel("gain", signed=False),
    "plate_crosstalk": _crosstalk,
    "plate_zero": _channel("offset", signed=True),
    "plate_drift": _channel("drift", signed=True),
    "gravity_tilt": _turned,
    "added_mass": lambda r, trial: (
        r["segment"],
        {"mass": r["size"], **_xyz("position", r["position_m"])},
    ),
    "released_object": _released,
    "wobbling_mass": _of_segment(
        mass="size", frequency="frequency_hz", damping_ratio="damping_ratio"
    ),
    "breathing": _of_segment(amplitude="size", frequency="frequency_hz"),
    "unmeasured_contact": _contact,
    "joint_centre": _vector(("shift_x", "shift_y", "shift_z"), "shift_m", lambda r: r["joint"]),
    "missing_joint": lambda r, trial: (
        "upper_torso",
        {"flexion": trial["missing_joint_range_rad"]},
    ),
    "marker_shift": _shifted_marker,
    "marker_swap": _swapped,
    "over_smoothing": lambda r, trial: ("", {"cutoff": r["size"]}),
    # What share of the error a segment's table values make is not known to the simulator.
    "segment_inertia": _of_segment(),
    "implement": _implement,
    "camera_frame": _turned,
    "external_force": lambda r, trial: (
        r["segment"],
        _in_lab(r["size"] * np.array(r["direction"]), trial),
    ),
    "object_handled": lambda r, trial: (r["segment"], {"mass": r["size"], **_window(r, trial)}),
    "marker_slide": _sliding,
}


def equivalents(record: Record, tasks: set[str]) -> set[str]:
    """Effects that nothing in these recordings tells from the hidden one (design, section 6).

    tasks : of the recordings that hold it; where somebody hops or steps onto the plate, load and
    offset differ.
    """
    effect, channel = record["effect"], record.get("channel")
    if tasks & {"hops", "stepon"}:
        return set()
    vertical = {"plate_gain", "plate_zero", "added_mass"}
    if effect == "added_mass" and record["segment"].startswith(("foot", "shank")):
        return vertical - {effect}
    if effect in ("plate_gain", "plate_zero") and channel == "fz":
        return vertical - {effect}
    level = {"gravity_tilt", "plate_rotation", "plate_zero"}
    tilted = effect == "plate_rotation" and not record["turn_rad"][2]
    if effect == "gravity_tilt" or tilted or (effect == "plate_zero" and channel in ("fx", "fy")):
        return level - {effect}
    return set()
