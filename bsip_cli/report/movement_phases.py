"""In which phase of the movement each frame is, so that an error can be told by phase."""

from __future__ import annotations

import numpy as np
import pandas as pd

STILL = "standing still"
PHASES = (
    STILL,
    "moving on one level",
    "body going down",
    "body going up",
    "hard push or landing",
)
HARD = 1.5  # vertical force over body weight
RISING_M_S = 0.1  # pelvis, up or down
STILL_M_S, STILL_RAD_S = 0.05, 0.5  # pelvis, and the fastest joint


def phases_of(
    pelvis_m_s: np.ndarray, joint_rad_s: np.ndarray, load: np.ndarray, known: np.ndarray
) -> np.ndarray:
    """(n,) index into `PHASES`; -1 where ``known`` does not hold or the motion is not known.

    pelvis_m_s : (n, 3) velocity, world, Z up. joint_rad_s : (n,) of the fastest joint.
    load : (n,) vertical force over body weight.
    """
    rising, speed = pelvis_m_s[:, 2], np.linalg.norm(pelvis_m_s, axis=1)
    still = (speed < STILL_M_S) & (joint_rad_s < STILL_RAD_S)
    phase = np.select(
        [load > HARD, rising < -RISING_M_S, rising > RISING_M_S, still], [4, 2, 3, 0], default=1
    )
    return np.where(known & np.isfinite(speed + joint_rad_s + load), phase, -1)


def motion_of(kinematics: pd.DataFrame, clock_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity of the pelvis (n, 3) [m/s] and speed of the fastest joint (n,) [rad/s], both at the
    times ``clock_s`` (n,) and NaN outside the recording."""
    time = kinematics["time_s"].to_numpy()
    if len(time) < 2:
        return np.full((len(clock_s), 3), np.nan), np.full(len(clock_s), np.nan)
    place = kinematics[["q_root_tx", "q_root_ty", "q_root_tz"]].to_numpy()
    names = (str(name) for name in kinematics.columns)
    joints = [c for c in names if c.startswith("v_") and not c.startswith("v_root_t")]
    fastest = kinematics[joints].abs().max(axis=1, skipna=False).to_numpy()
    velocity = np.gradient(place, time, axis=0)
    columns = [_at(clock_s, time, v) for v in (*velocity.T, fastest)]
    return np.stack(columns[:3], axis=1), columns[3]


def _at(clock_s: np.ndarray, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.interp(clock_s, time_s, values, left=np.nan, right=np.nan)
