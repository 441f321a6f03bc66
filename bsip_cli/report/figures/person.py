"""The person as the model: bones, markers and the measured ground force, seen obliquely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.dynamics.segment_motion import segment_motion
from bsip_cli.report.figures import canvas
from bsip_cli.report.figures.canvas import MM, Figure
from bsip_cli.report.records import clock_of, flags_of, measured_of

_YAW, _PITCH = np.radians(-140.0), np.radians(12.0)  # from the front, from their right
_WIDE, _HIGH, _LINE = 62.0 * MM, 92.0 * MM, 10.0  # points; from one line of text to the next
_MARGIN_M = 0.06
_LONGEST = 30  # letters of a trial's label in a line under the figure
_TILE_M = 0.5
_LIMBS = {"l": ("#9a9a9a", 2.2), "r": (canvas.INK, 1.8), "": (canvas.INK, 1.8)}


def stick_figure(pose: Pose, trial: str) -> Figure:
    """Left limbs grey, right ones black; the arrow of one body weight is half as long as the
    person is tall."""
    figure = Figure(_HIGH, _WIDE)
    force = np.linalg.norm(pose.force_N)
    lines = [
        canvas.plain(trial, _LONGEST) + f", {pose.time_s:.2f} s",
        "right black, left grey",
    ]
    lines += [f"ground force {force:.0f} N"] if np.isfinite(force) else []
    top = _HIGH - _LINE * len(lines) - 2.0
    for k, text in enumerate(lines, start=1):
        middle = _WIDE / 2, top + k * _LINE
        figure.text(middle, text, 7.5, fill=canvas.SOFT, text_anchor="middle")
    centre = pose.bones_m[0, 0]
    steps = _TILE_M * np.arange(-1, 2)
    ends = np.array([steps[0], steps[-1]])
    floor = [[(x, y, 0.0) for y in ends] for x in steps]
    floor += [[(x, y, 0.0) for x in ends] for y in steps]
    ground = projected(np.array(floor) + np.array([*centre[:2], pose.ground_m]), centre)
    bones, markers = projected(pose.bones_m, centre), projected(pose.markers_m, centre)
    head, radius = projected(pose.head_m, centre), _HEAD_RADIUS_M
    arrow = projected(np.array([pose.force_at_m, pose.tip_m()]), centre)
    shown = [bones.reshape(-1, 2), ground.reshape(-1, 2), markers, head[None] + radius]
    shown += [arrow] if np.isfinite(arrow).all() else []
    low = np.min([one.min(axis=0) for one in shown], axis=0) - _MARGIN_M
    high = np.max([one.max(axis=0) for one in shown], axis=0) + _MARGIN_M
    per_m = float(np.min(np.array([_WIDE, top]) / (high - low)))
    shift = (np.array([_WIDE, top]) - per_m * (high - low)) / 2

    def at(points: np.ndarray) -> np.ndarray:
        across, up = np.moveaxis(per_m * (points - low) + shift, -1, 0)
        return np.stack([across, top - up], axis=-1)

    figure.line(at(ground), canvas.FAINT, 0.6)
    for one, side in zip(bones, pose.sides, strict=True):
        figure.line(at(one), *_LIMBS[side], stroke_linecap="square")
    figure.dots(at(head)[None], "o", 2 * radius * per_m, "#ffffff", canvas.INK, 1.4)
    figure.dots(at(markers), "o", 2.6, "#ffffff", canvas.BLUE, 0.8)
    if np.isfinite(arrow).all():
        foot, tip = at(arrow)
        along = (tip - foot) / np.linalg.norm(tip - foot)
        beside = np.array([-along[1], along[0]])
        base = tip - 7.0 * along
        figure.line(np.array([foot, base]), canvas.GREEN, 2.2)
        head = np.array([base - 3.5 * beside, tip, base + 3.5 * beside])
        figure.line(head, canvas.GREEN, 1.0, fill=canvas.GREEN)
    return figure


def projected(points_m: np.ndarray, centre_m: np.ndarray) -> np.ndarray:
    """(..., 2) of points (..., 3) [m]: turned about the vertical, seen from a little above."""
    x, y, z = np.moveaxis(points_m - np.array([centre_m[0], centre_m[1], 0.0]), -1, 0)
    across = -np.sin(_YAW) * x + np.cos(_YAW) * y
    away = np.cos(_YAW) * x + np.sin(_YAW) * y
    return np.stack([across, np.cos(_PITCH) * z + np.sin(_PITCH) * away], axis=-1)


# --- poses ----------------------------------------------------------------------------------------

_FORCES, _POINT = ["fx_N", "fy_N", "fz_N"], ["cop_ap_m", "cop_ml_m"]
_HEAD_RADIUS_M = 0.1
_ON_GROUND_PERCENTILE = 2.0


@dataclass(frozen=True, eq=False)
class Pose:
    """Positions and force in the person's axes (anterior, right, up).

    bones_m : (b, 2, 3) end points; sides : (b,) ``l``, ``r`` or empty.
    head_m : (3,) centre of the head. markers_m : (m, 3) as the model carries them.
    force_at_m : (3,) where the ground force acts; force_N : (3,), NaN where it is not measured.
    ground_m : height of the ground. body_weight_N : what an arrow of half a body height stands for.
    """

    time_s: float
    bones_m: np.ndarray
    sides: tuple[str, ...]
    head_m: np.ndarray
    markers_m: np.ndarray
    force_at_m: np.ndarray
    force_N: np.ndarray
    ground_m: float
    body_weight_N: float

    def tip_m(self) -> np.ndarray:
        """(3,) tip of the force's arrow."""
        top = float(self.head_m[2]) + _HEAD_RADIUS_M - self.ground_m
        return self.force_at_m + self.force_N * 0.5 * top / self.body_weight_N

    def reach_m(self) -> float:
        """How far the bones reach from the pelvis on the average."""
        return float(np.linalg.norm(self.bones_m - self.bones_m[0, 0], axis=-1).mean())

    def is_loaded(self) -> bool:
        """The plates carry half the body's weight at least."""
        return bool(self.force_N[2] > 0.5 * self.body_weight_N)


def poses_of(
    body: Person,
    kinematics: pd.DataFrame,
    reconstruction: pd.DataFrame | None,
    anterior: np.ndarray,
    body_weight_N: float,
    instants: int,
) -> tuple[Pose, ...]:
    """Poses of a trial, as the model makes them, at evenly spread instants; none where no frame is
    determined. anterior : (2,) the person's forward direction in the world."""
    rows = _compared(kinematics, reconstruction)
    if rows.empty:
        return ()
    rows = rows.iloc[np.unique(np.linspace(0, len(rows) - 1, instants).astype(int))]
    q = rows[[f"q_{name}" for name in body.skeleton.q_names]].to_numpy()
    still = np.zeros((len(q), len(body.skeleton.v_names)))
    motion = segment_motion(pinocchio_model(body), q, still, still)
    R, p = motion.rotation, motion.position_m
    x, y = anterior / np.linalg.norm(anterior)
    axes = np.array([[x, y, 0.0], [y, -x, 0.0], [0.0, 0.0, 1.0]])  # forward, to the right, up
    bones = _bones(body)
    segments, starts, tips, sides = zip(*bones, strict=True)
    start, end = (
        _points(R, p, np.array(segments), np.array(ends)) @ axes.T for ends in (starts, tips)
    )
    head = body.skeleton.index("head") if "head" in body.skeleton.segments else 0
    own = body.markers_in_joint_m()[body.marker_segments == head]
    centre = own.mean(axis=0) if len(own) else np.array([0.0, 0.15, 0.0])
    heads = (p[:, head] + R[:, head] @ centre) @ axes.T
    markers = _points(R, p, body.marker_segments, body.markers_in_joint_m()) @ axes.T
    low = np.minimum(start[..., 2], end[..., 2]).min(axis=1)
    times = rows["time_s"].to_numpy()
    ground = float(np.percentile(low, _ON_GROUND_PERCENTILE))
    force, point = _forces(reconstruction, times, axes, ground)
    ends = np.stack([start, end], axis=2)
    each = zip(times.tolist(), ends, heads, markers, point, force, strict=True)
    return tuple(
        Pose(time_s, two, sides, centre, seen, at, measured, ground, body_weight_N)
        for time_s, two, centre, seen, at, measured in each
    )


def _compared(kinematics: pd.DataFrame, reconstruction: pd.DataFrame | None) -> pd.DataFrame:
    """Rows of determined frames, within the compared span if there is one."""
    rows = kinematics[kinematics["determined"].astype(bool)]
    if reconstruction is not None:
        compared = clock_of(reconstruction)[flags_of(reconstruction, "valid")]
        if len(compared):
            inside = rows["time_s"].between(compared[0], compared[-1])
            rows = rows[inside] if inside.any() else rows
    return rows


def _points(R: np.ndarray, p: np.ndarray, segments: np.ndarray, local: np.ndarray) -> np.ndarray:
    """(n, b, 3) world positions of points fixed to segments."""
    return p[:, segments] + np.einsum("nbij,bj->nbi", R[:, segments], local)


def _bones(body: Person) -> list[tuple[int, np.ndarray, np.ndarray, str]]:
    """Segment, end points in the axes of its joint, and side: from each joint to the next one; the
    last segments of a limb end at their markers."""
    skeleton, joints = body.skeleton, body.joint_positions_m()
    bones: list[tuple[int, np.ndarray, np.ndarray]] = []
    for i, name in enumerate(skeleton.segments):
        children = [k for k, parent in enumerate(skeleton.parents) if parent == i]
        origin = body.origin_in_joint_m[i]
        bones += [(i, np.zeros(3), origin)] if origin.any() else []
        bones += [(i, origin, joints[k]) for k in children if not np.allclose(joints[k], origin)]
        if not children and name != "head":
            bones += [(i, np.zeros(3), tip) for tip in _tips(body, i)]
    sided = []
    for i, start, tip in bones:
        side = skeleton.side(skeleton.segments[i])
        if not side and abs(tip[2]) >= 0.02:  # on the trunk, what leads sideways leads to a limb
            side = "r" if tip[2] > 0.0 else "l"
        sided.append((i, start, tip, side))
    return sided


def _tips(body: Person, segment: int) -> list[np.ndarray]:
    """Where a limb ends: its farthest marker, for a foot the hindmost too."""
    own = body.markers_in_joint_m()[body.marker_segments == segment]
    if len(own) == 0:
        return [np.array([0.0, -body.lengths_m[segment], 0.0])]
    tips = [own[np.argmax(np.linalg.norm(own, axis=1))]]
    if body.skeleton.segments[segment].startswith("foot"):
        tips = [own[np.argmax(own[:, 0])], own[np.argmin(own[:, 0])]]
    return tips


def _forces(
    reconstruction: pd.DataFrame | None, times: np.ndarray, axes: np.ndarray, ground_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) measured force and its point in person axes; NaN where it is not whole."""
    force, point = np.full((len(times), 3), np.nan), np.full((len(times), 3), np.nan)
    if reconstruction is None or len(clock_of(reconstruction)) == 0:
        return force, point
    measured = measured_of(reconstruction)
    clock = measured["time_s"].to_numpy()
    nearest = np.clip(np.searchsorted(clock, times - 1e-9), 0, len(clock) - 1)
    rows = measured.iloc[nearest]
    seen = (np.abs(clock[nearest] - times) < 0.02) & rows["valid"].to_numpy(dtype=bool)
    force[seen] = (rows[_FORCES].to_numpy() @ axes.T)[seen]
    point[seen] = rows[_POINT].assign(ground_m=ground_m).to_numpy()[seen]
    return force, point
