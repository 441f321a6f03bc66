"""Poses as compact data for the page's own player."""

from __future__ import annotations

import base64
import json

import numpy as np

from bsip_cli.report.poses import Poses

_MM = 1000.0
_MISSING = -32768  # where a number is missing
_MOST = 32767


def film_data(poses: Poses) -> str:
    """JSON: numbers of frames, bones and markers, and per frame 16-bit integers [mm], base64.

    Of each frame: both ends of all bones, the head, the markers, foot and tip of the force.
    Positions are relative to the middle of the first pose's pelvis on the ground.
    """
    origin = np.array([*poses.bones_m[0, 0, 0, :2], poses.ground_m])
    count = len(poses.time_s)
    frames = np.concatenate(
        [
            _flat(poses.bones_m - origin),
            _flat(poses.head_m - origin),
            _flat(poses.markers_m - origin),
            _flat(poses.force_m - origin),
            _flat(poses.arrow_tips_m() - origin),
        ],
        axis=1,
    )
    whole = np.where(np.isfinite(frames), np.round(_MM * frames), _MISSING)
    packed = np.clip(whole, _MISSING, _MOST).astype("<i2").tobytes()
    data = {
        "frames": count,
        "bones": poses.bones_m.shape[1],
        "markers": poses.markers_m.shape[1],
        "sides": "".join(side or "-" for side in poses.sides),
        "head_mm": round(_MM * poses.head_radius_m),
        "times_ms": [round(_MM * float(t)) for t in poses.time_s],
        "positions": base64.b64encode(packed).decode("ascii"),
    }
    return json.dumps(data, separators=(",", ":"))


def _flat(x: np.ndarray) -> np.ndarray:
    return x.reshape(len(x), -1)
