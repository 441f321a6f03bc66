"""Section 4: the motion as the model sees it, and how far its markers lie from the real ones."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Film, Grid, Heading, Paragraph, Picture, Section
from bsip_cli.report.figures.body_model import body_model
from bsip_cli.report.figures.marker_residuals import MarkerResiduals, marker_residuals
from bsip_cli.report.figures.residual_over_time import ResidualOverTime, residual_over_time
from bsip_cli.report.figures.stick_strip import stick_strip
from bsip_cli.report.poses import Poses
from bsip_cli.report.records import ParticipantRecord, TrialRecord
from bsip_cli.report.sticks import Motion, poses_at_instants, poses_of_stretch
from bsip_cli.report.words import listing, number

_INSTANTS = {"static": 2}
_USUAL_INSTANTS = 8
_FILM_S, _FILM_HZ = 10.0, 20.0
_WORST = 3
_MOST_EVENTS = 30
_MM = 1000.0


def section(record: ParticipantRecord) -> Section:
    blocks: list[Block] = [
        Paragraph(
            "Grey limbs are left, black limbs right. The green arrow is the measured ground "
            "force at its centre of pressure, where all contacts are on plates; one body "
            "weight is half as long as the person is tall."
        ),
        *_model(record),
    ]
    for trial in record.trials:
        blocks += [Heading(trial.label), *_poses(record, trial), *_over_time(trial)]
    markers = [Heading("Markers"), *_markers(record), *_events(record)]
    return Section("motion", "The motion", (*blocks, *markers))


def _motion(record: ParticipantRecord, trial: TrialRecord) -> Motion | None:
    if trial.kinematics is None:
        return None
    anterior = record.facts[["anterior_x", "anterior_y"]].to_numpy(dtype=float)
    return Motion(
        record.body, trial.kinematics, trial.reconstruction, anterior, record.body_weight()
    )


def _model(record: ParticipantRecord) -> list[Block]:
    """The person in the widest pose of the trials with a measured force, as figure 1 of
    Hansen 2017."""
    found = []
    for trial in record.trials:
        motion = _motion(record, trial)
        poses = None if motion is None else poses_at_instants(motion, _USUAL_INSTANTS)
        if poses is not None and _is_loaded(poses).any():
            found.append((*_widest(poses), poses, trial))
    if not found:
        return []
    _, k, poses, trial = max(found, key=lambda one: one[0])
    return [
        Picture(
            body_model(poses, k),
            f"The person as the model: its markers and the ground force in {trial.label} at "
            f"{poses.time_s[k]:.2f} s.",
            "The model with its markers and the ground force.",
            "fig1_model",
        )
    ]


def _widest(poses: Poses) -> tuple[float, int]:
    """How far the pose reaches that reaches farthest of those with a force, and its number."""
    ends = poses.bones_m - poses.bones_m[:, :1, :1]
    reach = np.linalg.norm(ends, axis=-1).mean(axis=(1, 2))
    reach[~_is_loaded(poses)] = -np.inf
    k = int(np.argmax(reach))
    return float(reach[k]), k


def _is_loaded(poses: Poses) -> np.ndarray:
    """(n,) True where the plates carry half the body's weight at least."""
    return np.nan_to_num(poses.forces_N[:, 2]) > 0.5 * poses.body_weight_N


def _poses(record: ParticipantRecord, trial: TrialRecord) -> list[Block]:
    """The trial as a strip of poses and, where somebody moves, as a film."""
    motion = _motion(record, trial)
    if motion is None:
        return [Paragraph(f"The pose was not computed in {trial.label}.", "note")]
    strip = poses_at_instants(motion, _INSTANTS.get(trial.role, _USUAL_INSTANTS))
    if strip is None:
        return [Paragraph(f"No frame of {trial.label} is determined by its markers.", "warning")]
    forces = int(np.isfinite(strip.arrow_tips_m()).all(axis=1).sum())
    caption = (
        f"{trial.label}: the pose at {len(strip.time_s)} instants, the force at {forces} of them."
    )
    picture = Picture(
        stick_strip(strip),
        caption,
        f"Stick figures of {trial.label}.",
        f"sticks_{trial.stem.split('_', 1)[-1]}",
    )
    return [picture, *([] if trial.role == "static" else _film(motion, trial))]


def _film(motion: Motion, trial: TrialRecord) -> list[Block]:
    poses = poses_of_stretch(motion, _FILM_S, _FILM_HZ)
    if poses is None or len(poses.time_s) < 2:
        return []
    first, last = poses.time_s[[0, -1]]
    caption = f"{trial.label} from {first:.1f} to {last:.1f} s; drag to turn it. Blue: markers."
    return [Film(poses, caption, f"Moving stick figure of {trial.label}.")]


def _over_time(trial: TrialRecord) -> list[Block]:
    frame = trial.kinematics
    if frame is None or len(frame) < 2 or not frame["marker_rms_m"].notna().any():
        return []
    data = ResidualOverTime(
        frame["time_s"].to_numpy(), _MM * frame["marker_rms_m"].to_numpy(), _worst(trial, frame)
    )
    rms = float(np.sqrt(np.nanmean(data.rms_mm**2)))
    caption = f"{trial.label}: distance of the markers from the model, {number(rms, 1)} mm RMS."
    return [
        Picture(residual_over_time(data), caption, f"Marker residual over time in {trial.label}.")
    ]


def _worst(trial: TrialRecord, frame: pd.DataFrame) -> np.ndarray:
    """(n,) residual of each frame's worst marker [mm]."""
    if trial.residuals is None:
        return np.full(len(frame), np.nan)
    worst = trial.residuals.groupby("time_s")["residual_m"].max()
    return _MM * worst.reindex(frame["time_s"]).to_numpy()


def _markers(record: ParticipantRecord) -> list[Block]:
    frames = [trial.residuals for trial in record.trials if trial.residuals is not None]
    rows = pd.concat(frames) if frames else pd.DataFrame({"marker": [], "residual_m": []})
    squares = rows["residual_m"].astype(float) ** 2
    by_marker = squares.groupby(rows["marker"]).mean().dropna()
    if by_marker.empty:
        return [Paragraph("No marker residuals are known.", "warning")]
    data = MarkerResiduals(
        tuple(by_marker.index.astype(str)),
        _MM * np.sqrt(by_marker.to_numpy()),
        _MM * float(np.sqrt(squares.mean())),
    )
    worst = np.argsort(-data.rms_mm, kind="stable")[:_WORST]
    named = listing([f"{data.markers[k]} ({number(data.rms_mm[k], 1)} mm)" for k in worst])
    return [
        Picture(
            marker_residuals(data),
            "RMS distance of each marker from its model, all trials.",
            "Bars: RMS residual per marker.",
            "marker_residuals",
        ),
        Paragraph(
            f"The farthest from the model: {named}. A single marker far above the others has "
            "slipped, is swapped, or sits where the model does not expect it."
        ),
    ]


def _events(record: ParticipantRecord) -> list[Block]:
    """What the inverse kinematics says of single markers; nothing where it was not asked."""
    known = [(trial.label, t) for trial in record.trials if (t := trial.marker_events) is not None]
    rows = [
        (label, str(row["kind"]), str(row["sentence"]), number(_MM * float(row["size_m"]), 0))
        for label, table in known
        for _, row in table.iterrows()
    ]
    if not known:
        return []
    if not rows:
        return [Paragraph("No marker jumps, slips, bears another's label or sits wrong.")]
    caption = "Markers that jump, slip, bear another's label or sit wrong."
    if len(rows) > _MOST_EVENTS:
        caption += f" {len(rows) - _MOST_EVENTS} more are in the trials' marker-events."
    head = ("trial", "what", "in words", "size [mm]")
    return [Grid(head, tuple(rows[:_MOST_EVENTS]), caption, words=3)]
