"""Between artifacts' tables and the arrays of science: person, markers, wrench, known loads."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person, load_parameters
from bsip_cli.body.skeleton import Skeleton, load_skeleton
from bsip_cli.report.words import listing, segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names, share_name
from bsip_cli.study.study import Trial

WRENCH = ["fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm"]


def markers_from(frame: pd.DataFrame) -> tuple[np.ndarray, tuple[str, ...], np.ndarray]:
    """Times (N,), labels and positions (N, m, 3) [m] of a ``markers`` table."""
    first = frame["time_s"].iloc[0]
    labels = tuple(frame.loc[frame["time_s"] == first, "marker"])
    positions = frame[["x_m", "y_m", "z_m"]].to_numpy().reshape(-1, len(labels), 3)
    return frame["time_s"].to_numpy()[:: len(labels)], labels, positions


def ordered_markers(
    labels: tuple[str, ...], positions: np.ndarray, wanted: tuple[str, ...]
) -> np.ndarray:
    """(N, len(wanted), 3) positions in another order of markers; NaN for those not there."""
    ordered = np.full((len(positions), len(wanted), 3), np.nan)
    for k, name in enumerate(wanted):
        if name in labels:
            ordered[:, k] = positions[:, labels.index(name)]
    return ordered


def person_from(
    skeleton_rows: pd.DataFrame, marker_rows: pd.DataFrame, skeleton: Skeleton
) -> Person:
    """The person as ``scale`` wrote it."""
    rows = skeleton_rows.set_index("segment").loc[list(skeleton.segments)]
    return Person(
        skeleton,
        rows[["joint_x_m", "joint_y_m", "joint_z_m"]].to_numpy(),
        rows["parent_tilt_rad"].to_numpy(),
        rows["child_tilt_rad"].to_numpy(),
        rows[["origin_x_m", "origin_y_m", "origin_z_m"]].to_numpy(),
        rows["length_m"].to_numpy(),
        tuple(marker_rows["marker"]),
        np.array([skeleton.index(name) for name in marker_rows["segment"]]),
        marker_rows[["x_m", "y_m", "z_m"]].to_numpy(),
        marker_rows["weight"].to_numpy(),
        rows["held"].to_numpy(),
    )


def person_of(unit: Unit) -> Person:
    """The unit's participant, with the configured skeleton."""
    skeleton = load_skeleton(unit.config.skeleton)
    return person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)


def coordinates_from(
    frame: pd.DataFrame, skeleton: Skeleton
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (N, nq), v (N, nv) and a (N, nv) of a ``kinematics`` table."""
    q = frame[[f"q_{name}" for name in skeleton.q_names]].to_numpy()
    v, a = (frame[[f"{one}_{name}" for name in skeleton.v_names]].to_numpy() for one in "va")
    return q, v, a


def acceleration_noise(frame: pd.DataFrame, skeleton: Skeleton) -> np.ndarray:
    """(N,) noise level of the pelvis' acceleration [m/s2] of a ``kinematics`` table.

    All coordinates are smoothed alike, so theirs have the same shape over time.
    """
    linear = frame[[f"sd_{name}" for name in skeleton.v_names[:3]]].to_numpy()
    return np.sqrt((linear**2).mean(axis=1))


def bsip_table(
    method: str, segments: tuple[str, ...], values: np.ndarray, sd: np.ndarray, share: np.ndarray
) -> pd.DataFrame:
    """Rows of one method: values, standard deviations and data shares, each (n, 10)."""
    names = bsip_names()
    table = pd.DataFrame({"method": method, "segment": list(segments)})
    table[list(names)] = values
    table[[f"{name}_sd" for name in names]] = sd
    table[[share_name(name) for name in names]] = share
    return table


# --- the known loads of a trial, as parameters for science and in words for people ----------------


def load_phi(unit: Unit, person: Person, trial: Trial | None = None) -> np.ndarray:
    """(10 n,) parameters of a trial's loads about the joint centres; the unit's own by default."""
    loads = unit.loads(trial)
    return load_parameters([(x.segment, x.mass_kg, x.position_m) for x in loads], person)


def load_words(unit: Unit, trial: Trial | None = None) -> str:
    """``1 kg on the right shank and 2 kg on the upper torso``; empty without loads."""
    loads = unit.loads(trial)
    return listing([f"{x.mass_kg:g} kg on the {segment_label(x.segment)}" for x in loads], "")


def loads_record(unit: Unit, trial: Trial | None = None) -> list[dict]:
    """Segment, mass and position of each, for an artifact's facts."""
    kept = {"segment", "mass_kg", "position_m"}
    return [x.model_dump(mode="json", include=kept) for x in unit.loads(trial)]
