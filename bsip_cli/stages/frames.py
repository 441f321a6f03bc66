"""Between artifacts' tables and the arrays of science: person, markers, wrench, known loads."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.body.inertia import from_readable
from bsip_cli.body.person import Person, load_parameters
from bsip_cli.body.skeleton import Skeleton, load_skeleton
from bsip_cli.report.words import listing, segment_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names, share_name
from bsip_cli.study.study import Trial

WRENCH = ["fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm"]
XYZ = ["x_m", "y_m", "z_m"]


def markers_from(frame: pd.DataFrame) -> tuple[np.ndarray, tuple[str, ...], np.ndarray]:
    """Times (N,), labels and positions (N, m, 3) [m] of a ``markers`` table."""
    first = frame["time_s"].iloc[0]
    labels = tuple(frame.loc[frame["time_s"] == first, "marker"])
    positions = frame[XYZ].to_numpy().reshape(-1, len(labels), 3)
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
        rows[[f"joint_{name}" for name in XYZ]].to_numpy(),
        rows["parent_tilt_rad"].to_numpy(),
        rows["child_tilt_rad"].to_numpy(),
        rows[[f"origin_{name}" for name in XYZ]].to_numpy(),
        rows["length_m"].to_numpy(),
        tuple(marker_rows["marker"]),
        np.array([skeleton.index(name) for name in marker_rows["segment"]]),
        marker_rows[XYZ].to_numpy(),
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


@dataclass(frozen=True, eq=False)
class TrialSignals:
    """Motion and forces of a trial with N frames.

    q (N, nq), v and a (N, nv). determined : (N,) frames whose pose the markers determine.
    acceleration_noise : (N,) noise level of the pelvis' acceleration [m/s2]; all coordinates are
    smoothed alike, so theirs have the same shape over time. wrench : (N, 6) on the body about the
    world's origin. measured : (N,) frames with every contact on a plate. plates : by name, the
    wrench (N, 6) of each.
    """

    times_s: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    determined: np.ndarray
    acceleration_noise: np.ndarray
    wrench: np.ndarray
    measured: np.ndarray
    plates: Mapping[str, np.ndarray]

    @property
    def valid(self) -> np.ndarray:
        """(N,) frames whose pose is determined and whose contacts are all measured."""
        return self.determined & self.measured

    @property
    def rate_hz(self) -> float:
        return rate_of(self.times_s)


def signals_of(unit: Unit, person: Person, trial: Trial | None = None) -> TrialSignals:
    """Of a trial, by default the unit's own, from its ``kinematics`` and ``wrench``."""
    kinematics, wrench = unit.read("kinematics", trial), unit.read("wrench", trial)
    linear = kinematics[[f"sd_{name}" for name in person.skeleton.v_names[:3]]].to_numpy()
    return TrialSignals(
        kinematics["time_s"].to_numpy(),
        *coordinates_from(kinematics, person.skeleton),
        kinematics["determined"].to_numpy(),
        np.sqrt((linear**2).mean(axis=1)),
        wrench[WRENCH].to_numpy(),
        wrench["valid"].to_numpy(),
        plate_wrenches(wrench),
    )


def plate_wrenches(wrench: pd.DataFrame) -> dict[str, np.ndarray]:
    """By name, the readings (N, 6) of the plates in a ``wrench`` table."""
    found = (re.fullmatch(r"plate(.*)_fx_N", str(column)) for column in wrench)
    names = [one[1] for one in found if one]
    return {name: wrench[[f"plate{name}_{c}" for c in WRENCH]].to_numpy() for name in names}


def rate_of(times_s: np.ndarray) -> float:
    """Frames per second [Hz]."""
    return 1.0 / float(np.median(np.diff(times_s)))


def columns(names: Sequence[str], values: np.ndarray) -> dict[str, np.ndarray]:
    """An array (N, k) as the columns of a table, by name."""
    return dict(zip(names, values.T, strict=True))


def bsip_table(
    method: str, segments: tuple[str, ...], values: np.ndarray, sd: np.ndarray, share: np.ndarray
) -> pd.DataFrame:
    """Rows of one method: values, standard deviations and data shares, each (n, 10)."""
    names = bsip_names()
    table = {"method": method, "segment": list(segments)} | columns(names, values)
    table |= columns([f"{name}_sd" for name in names], sd)
    return pd.DataFrame(table | columns([share_name(name) for name in names], share))


def parameters_of(bsip: pd.DataFrame, person: Person) -> tuple[list[str], np.ndarray]:
    """Methods and the parameters (10 n, k) of the segments with mass, about the joint centres."""
    methods = list(dict.fromkeys(bsip["method"]))
    origins = person.origin_in_joint_m[list(person.skeleton.bodies)]
    bodies = []
    for method in methods:
        rows = bsip[bsip["method"] == method].set_index("segment")
        rows = rows.loc[list(person.skeleton.body_names), list(bsip_names())].to_numpy()
        pairs = zip(map(from_readable, rows), origins, strict=True)
        bodies.append(np.concatenate([one.moved(-origin).phi() for one, origin in pairs]))
    return methods, np.stack(bodies, axis=1)


# --- the known loads of a trial, as parameters for science and in words for people ----------------


def load_phi(unit: Unit, person: Person, trial: Trial | None = None) -> np.ndarray:
    """(10 n,) parameters of a trial's loads about the joint centres; the unit's own by default."""
    loads = unit.loads(trial)
    return load_parameters([(x.segment, x.mass_kg, x.position_m) for x in loads], person)


def load_words(unit: Unit, trial: Trial) -> str:
    """``1 kg on the right shank and 2 kg on the upper torso``; empty without loads."""
    loads = unit.loads(trial)
    return listing([f"{x.mass_kg:g} kg on the {segment_label(x.segment)}" for x in loads], "")


def loads_record(unit: Unit, trial: Trial | None = None) -> list[dict[str, object]]:
    """Segment, mass and position of each, for an artifact's facts."""
    kept = {"segment", "mass_kg", "position_m"}
    return [x.model_dump(mode="json", include=kept) for x in unit.loads(trial)]
