"""ik: joint coordinates, velocities and accelerations from the markers of one trial."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.motion.inverse_kinematics import Poses, held_upright, solve_trial
from bsip_cli.motion.marker_events import summaries
from bsip_cli.motion.marker_evidence import marker_evidence
from bsip_cli.motion.marker_fit import MarkerFit, marker_fit
from bsip_cli.motion.smoothing import Motion, smooth_motion
from bsip_cli.report.words import count
from bsip_cli.running.unit import Unit
from bsip_cli.segments import the_joint
from bsip_cli.stages.frames import columns, markers_from, ordered_markers, person_of, rate_of

_MOST_SAID = 5  # of a trial's sentences about single markers


def run(unit: Unit) -> None:
    """Read markers and the person; write kinematics, marker-residuals and marker-events, of the
    poses after exchanged labels were corrected."""
    person = person_of(unit)
    frame = unit.read("markers")
    times, labels, positions = markers_from(frame)
    markers = ordered_markers(labels, positions, person.markers)
    filled = frame["filled"].to_numpy().reshape(len(times), len(labels), 1)
    filled = ordered_markers(labels, filled, person.markers)[..., 0] == 1
    poses, decided = _solved(unit, person, markers)
    scales = unit.config.ik.model_dump(include={"marker_sd_m", "robust_limit_m"})
    scales["strays_m"] = unit.read("marker-positions")["residual_m"].fillna(0.0).to_numpy()

    def refit(other: np.ndarray, at: np.ndarray) -> MarkerFit:
        return marker_fit(person, other, _solved(unit, person, other)[0].q, at, **scales)

    fit = marker_fit(person, markers, poses.q, times, **scales)
    evidence = marker_evidence(fit, refit, filled)
    for sentence in summaries(evidence.events, _MOST_SAID):
        unit.say(sentence)
    if evidence.any_corrected():
        poses, decided = _solved(unit, person, evidence.markers_m)
    known, angle_sd = _determined(unit, person, poses, decided)
    options = unit.config.smoothing.model_dump()
    options["robust_limit_m"] = unit.config.ik.robust_limit_m
    markers, rate_hz = evidence.markers_m, rate_of(times)
    motion = smooth_motion(person, poses.q, known, rate_hz, markers=markers, **options)
    facts = {"marker_noise_m": motion.marker_noise_m, "marker_rms_m": poses.rms_m()}
    unit.write("kinematics", _kinematics(times, angle_sd, poses, motion, person.skeleton), facts)
    names = np.tile(np.array(person.markers, dtype=object), len(times))
    residuals = {"time_s": np.repeat(times, len(person.markers)), "marker": names}
    residuals["residual_m"] = poses.residual_m.ravel()
    unit.write("marker-residuals", pd.DataFrame(residuals))
    unit.write("marker-events", [asdict(one) for one in evidence.events])


def _solved(unit: Unit, person: Person, markers: np.ndarray) -> tuple[Poses, np.ndarray]:
    """Poses, and which coordinates (nv,) the markers decide; the others are held near neutral, the
    head upright."""
    options = unit.config.ik
    fixed = options.model_dump(include={"marker_sd_m", "robust_limit_m", "iterations"})
    poses = solve_trial(person, markers, posture_sd_rad=options.posture_sd_rad, **fixed)
    count = np.isfinite(poses.residual_m).sum(axis=1)
    shown = count >= 0.5 * count.max()  # people walk in and out
    decided = np.median(poses.coordinate_sd[shown], axis=0) < options.undetermined_sd_rad
    decided[:3] = True  # the base's position is in metres
    if not decided.all():
        sd = np.where(decided, options.posture_sd_rad, options.held_sd_rad)
        poses = solve_trial(person, markers, posture_sd_rad=sd, **fixed)
    if not decided[_neck(person.skeleton)].any():
        poses = replace(poses, q=held_upright(person, poses.q))
    return poses, decided


def _neck(skeleton: Skeleton) -> slice:
    """Its velocities."""
    start = skeleton.v_starts[skeleton.index("head")]
    return slice(start, start + 3)


def _determined(
    unit: Unit, person: Person, poses: Poses, decided: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joints (N, joints) whose angles the markers decide in a frame as they do in most others, but
    none beyond an undecided one; the largest standard deviation (N,) of an angle that most frames
    decide. The user is informed of what markers do not decide."""
    skeleton = person.skeleton
    if not decided.all():
        angles = zip(skeleton.joints, np.split(decided, skeleton.v_starts[1:]), strict=True)
        counts = [(joint, int((~own).sum()), len(own)) for joint, own in angles]
        names = ", ".join(
            (f"{lost} of {size} coordinates of " if lost < size else "") + the_joint(joint)
            for joint, lost, size in counts
            if lost
        )
        upright = "" if decided[_neck(skeleton)].any() else ", the head upright"
        unit.say(f"no markers decide {names}; held near the neutral pose{upright}")
    sd = np.where(decided, poses.coordinate_sd, 0.0)
    sd[:, :3] = 0.0  # the base's position is in metres
    of_joint = np.maximum.reduceat(sd, skeleton.v_starts, axis=1)
    seen = poses.converged & np.isfinite(poses.residual_m).any(axis=1)
    known = (of_joint < unit.config.ik.undetermined_sd_rad) & seen[:, None]
    for i, parent in enumerate(skeleton.parents[1:], start=1):
        known[:, i] &= known[:, parent]
    whole = zip(skeleton.joints, known.all(axis=0), strict=True)
    lost = [the_joint(name) for name, ok in whole if not ok]
    if lost:
        frames = count(int((~known.all(axis=1)).sum()), "frame")
        unit.say(f"{frames} without a pose of {', '.join(lost)}")
    return known, of_joint.max(axis=1)


def _kinematics(
    times: np.ndarray, angle_sd: np.ndarray, poses: Poses, motion: Motion, skeleton: Skeleton
) -> pd.DataFrame:
    table = {"time_s": times, "determined": motion.inner, "marker_rms_m": poses.frame_rms_m()}
    table |= {"angle_sd_rad": angle_sd, "cutoff_hz": motion.cutoff_hz}
    for prefix, values in (("q", motion.q), ("v", motion.v), ("a", motion.a), ("sd", motion.a_sd)):
        names = skeleton.q_names if prefix == "q" else skeleton.v_names
        table |= columns([f"{prefix}_{name}" for name in names], values)
    return pd.DataFrame(table)
