"""ik: joint coordinates, velocities and accelerations from the markers of one trial."""

from __future__ import annotations

from dataclasses import astuple, fields

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.motion.inverse_kinematics import Poses, solve_trial
from bsip_cli.motion.marker_events import MarkerEvent, summaries
from bsip_cli.motion.marker_evidence import marker_evidence
from bsip_cli.motion.marker_fit import MarkerFit, marker_fit
from bsip_cli.motion.smoothing import Motion, smooth_motion
from bsip_cli.stages.frames import markers_from, ordered_markers, person_from
from bsip_cli.unit import Unit

_MOST_SAID = 5  # of a trial's sentences about single markers


def run(unit: Unit) -> None:
    """Read markers and the person; write kinematics, marker-residuals and marker-events."""
    skeleton = load_skeleton(unit.config.skeleton)
    person = person_from(unit.read("skeleton"), unit.read("marker-positions"), skeleton)
    frame = unit.read("markers")
    times, labels, positions = markers_from(frame)
    markers = ordered_markers(labels, positions, person.markers)
    poses, decided = _poses(unit, person, markers)
    determined, angle_sd = _determined(unit, poses, decided)
    rate = 1.0 / float(np.median(np.diff(times)))
    filled = frame["filled"].to_numpy().reshape(len(times), len(labels), 1)
    filled = ordered_markers(labels, filled, person.markers)[..., 0] == 1
    events = _events(unit, person, markers, filled, times, poses, decided)
    motion = smooth_motion(person, poses.q, determined, rate, **unit.config.smoothing.model_dump())
    determined &= motion.inner
    unit.write(
        "kinematics",
        _kinematics(times, determined, angle_sd, poses, motion, skeleton),
        facts={"marker_noise_m": motion.marker_noise_m, "marker_rms_m": poses.rms_m()},
    )
    unit.write(
        "marker-residuals",
        pd.DataFrame(
            {
                "time_s": np.repeat(times, len(person.markers)),
                "marker": np.tile(np.array(person.markers, dtype=object), len(times)),
                "residual_m": poses.residual_m.ravel(),
            }
        ),
    )
    unit.write("marker-events", events)


def _poses(unit: Unit, person: Person, markers: np.ndarray) -> tuple[Poses, np.ndarray]:
    """Poses, and which coordinates (nv,) the markers decide; the others are held near neutral."""
    options = unit.config.ik
    fixed = options.model_dump(include={"marker_sd_m", "robust_limit_m", "iterations"})
    poses = solve_trial(person, markers, posture_sd_rad=options.posture_sd_rad, **fixed)
    decided = np.median(poses.coordinate_sd, axis=0) < options.undetermined_sd_rad
    decided[:3] = True  # the base's position is in metres
    if not decided.all():
        names = ", ".join(np.array(person.skeleton.v_names)[~decided])
        unit.warn(f"{unit.name}: no markers decide {names}; held near the neutral pose")
        sd = np.where(decided, options.posture_sd_rad, options.held_sd_rad)
        poses = solve_trial(person, markers, posture_sd_rad=sd, **fixed)
    return poses, decided


def _determined(unit: Unit, poses: Poses, decided: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frames in which the markers decide every angle that they decide in most frames."""
    angle_sd = poses.coordinate_sd[:, 3:][:, decided[3:]].max(axis=1)
    seen = np.isfinite(poses.residual_m).any(axis=1)
    determined = (angle_sd < unit.config.ik.undetermined_sd_rad) & poses.converged & seen
    if not determined.all():
        unit.warn(f"{unit.name}: {int((~determined).sum())} frames without a pose")
    return determined, angle_sd


def _events(
    unit: Unit,
    person: Person,
    markers: np.ndarray,
    filled: np.ndarray,
    times: np.ndarray,
    poses: Poses,
    decided: np.ndarray,
) -> pd.DataFrame:
    """Markers that jump, slip, bear another's label or sit wrong; the user is told the worst."""
    options = unit.config.ik
    scales = options.model_dump(include={"marker_sd_m", "robust_limit_m"})
    sd = np.where(decided, options.posture_sd_rad, options.held_sd_rad)

    def refit(other: np.ndarray, at: np.ndarray) -> MarkerFit:
        again = solve_trial(
            person, other, posture_sd_rad=sd, iterations=options.iterations, **scales
        )
        return marker_fit(person, other, again.q, at, **scales)

    found = marker_evidence(marker_fit(person, markers, poses.q, times, **scales), refit, filled)
    for sentence in summaries(found, _MOST_SAID):
        unit.warn(f"{unit.name}: {sentence}")
    columns = [field.name for field in fields(MarkerEvent)]
    return pd.DataFrame([astuple(one) for one in found], columns=columns)


def _kinematics(times, determined, angle_sd, poses: Poses, motion: Motion, skeleton):
    tables = [
        pd.DataFrame(
            {
                "time_s": times,
                "determined": determined,
                "marker_rms_m": poses.frame_rms_m(),
                "angle_sd_rad": angle_sd,
            }
        )
    ]
    for prefix, values, names in (
        ("q", motion.q, skeleton.q_names),
        ("v", motion.v, skeleton.v_names),
        ("a", motion.a, skeleton.v_names),
        ("sd", motion.a_sd, skeleton.v_names),
    ):
        tables.append(pd.DataFrame(values, columns=[f"{prefix}_{name}" for name in names]))
    return pd.concat(tables, axis=1)
