"""A first skeleton from one standing pose: segment frames, lengths, markers on their segments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.anthropometry import mean_length_m, stature_m
from bsip_cli.body.joint_centres import JointCentres, joint_centres, unit
from bsip_cli.body.keypoints import with_skin
from bsip_cli.body.markersets import MarkerSet
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.functional_legs import functional_landmarks

Frame = tuple[np.ndarray, np.ndarray]  # origin (3,) and axes (3, 3) with X, Y, Z as columns


@dataclass(frozen=True, eq=False)
class Calibration:
    """A first guess of the person, the pose it was taken in (nq,), and what was assumed."""

    person: Person
    q: np.ndarray
    anterior: np.ndarray
    stature_m: float
    notes: tuple[str, ...]


def calibrate(
    skeleton: Skeleton,
    marker_set: MarkerSet,
    positions: Mapping[str, np.ndarray],
    sex: str,
    height_m: float | None,
    trials: Sequence[Mapping[str, np.ndarray]] = (),
) -> Calibration:
    """Build the skeleton from marker positions in one standing pose.

    Parameters
    ----------
    positions : label to (3,) world position [m], Z up; only markers that are visible.
    sex : M, F or other, for the joint-centre regressions.
    height_m : stature, or None to estimate it from the long segments.
    trials : of each trial, label to (N, 3) positions [m]: knees and ankles without markers are
        found from their movement there.

    Raises
    ------
    BadDataError
        Landmarks are missing (all are named).
    """
    landmarks, placed = with_skin(_landmarks(marker_set, positions), sex)
    moved = functional_landmarks(marker_set, landmarks, positions, trials, sex)
    landmarks |= moved.landmarks
    guess = height_m or _rough_stature(landmarks)
    centres = joint_centres(landmarks, sex, guess)
    lengths = _lengths(centres)
    stature = height_m or stature_m(sex, {k: lengths[k] for k in ("torso", "thigh", "shank")})
    frames = _frames(skeleton, centres, landmarks)
    person = _person(skeleton, marker_set, positions, centres, frames, sex, stature, landmarks)
    forward = centres.pelvis_axes[:, 0] * np.array([1.0, 1.0, 0.0])
    return Calibration(
        person,
        _pose(person, frames),
        unit(forward),
        stature,
        (*placed, *moved.notes, *centres.notes),
    )


def _landmarks(marker_set: MarkerSet, positions: Mapping[str, np.ndarray]) -> dict:
    gathered: dict[str, list[np.ndarray]] = {}
    for marker in marker_set.markers:
        if marker.landmark and marker.label in positions:
            gathered.setdefault(marker.landmark, []).append(positions[marker.label])
    return {name: np.mean(found, axis=0) for name, found in gathered.items()}


# Heights above the heel marker, as parts of the stature: C7, the acromia, the ASIS.
_HEIGHTS = (("c7", 0.84), ("acromion_l", 0.82), ("asis_l", 0.54))


def _rough_stature(landmarks: Mapping[str, np.ndarray]) -> float:
    """Stature from the height of the highest known landmark over the heel; upright standing."""
    for name, part in _HEIGHTS:
        if name in landmarks and "calcaneus_l" in landmarks:
            return float(landmarks[name][2] - landmarks["calcaneus_l"][2]) / part
    raise BadDataError(
        "no marker for calcaneus_l, or none for c7, acromion_l and asis_l",
        expected="the heel and one of these in the static trial",
        remedy="state height_m in participants.tsv, or name these markers in a marker set",
    )


def _lengths(centres: JointCentres) -> dict[str, float]:
    p = centres.positions

    def mean(a: str, b: str) -> float:
        return float(np.mean([np.linalg.norm(p[f"{a}_{s}"] - p[f"{b}_{s}"]) for s in "lr"]))

    return {
        "torso": float(np.linalg.norm(p["neck"] - p["waist"])),
        "thigh": mean("hip", "knee"),
        "shank": mean("knee", "ankle"),
    }


def _frames(
    skeleton: Skeleton, centres: JointCentres, landmarks: Mapping[str, np.ndarray]
) -> dict[str, Frame]:
    """Origin and axes of every segment in the standing pose (ISB, as in Dumas 2007)."""
    p = centres.positions
    up = p["neck"] - p["waist"]
    torso = _y_first(up, _torso_right(landmarks, p, up))
    frames = {
        "lower_torso": (p["waist"], centres.pelvis_axes),
        "upper_torso": (p["neck"], torso),
        "head": (p["neck"], _head(landmarks, p["neck"], torso)),
    }
    for s in "lr":
        # Rods without mass need no axes of their own: their angles count from this pose.
        frames[f"clavicle_{s}"] = (p[f"sternoclavicular_{s}"], torso)
        elbow, knee = centres.hinges[f"elbow_{s}"], centres.hinges[f"knee_{s}"]
        upper, fore = p[f"shoulder_{s}"] - p[f"elbow_{s}"], p[f"elbow_{s}"] - p[f"wrist_{s}"]
        thigh, shank = p[f"hip_{s}"] - p[f"knee_{s}"], p[f"knee_{s}"] - p[f"ankle_{s}"]
        frames[f"upper_arm_{s}"] = (p[f"shoulder_{s}"], _y_first(upper, elbow))
        frames[f"forearm_{s}"] = (p[f"elbow_{s}"], _y_first(fore, elbow))
        frames[f"thigh_{s}"] = (p[f"hip_{s}"], _y_first(thigh, knee))
        frames[f"shank_{s}"] = (p[f"knee_{s}"], _y_first(shank, knee))
        across = _across_the_wrist(landmarks, s, elbow)
        end = centres.ends.get(f"hand_{s}")
        along = fore if end is None else p[f"wrist_{s}"] - end
        frames[f"hand_{s}"] = (p[f"wrist_{s}"], _y_first(along, across))
        sole = centres.ends[f"foot_{s}"] - landmarks[f"calcaneus_{s}"]
        frames[f"foot_{s}"] = (p[f"ankle_{s}"], _x_first(sole, centres.hinges[f"ankle_{s}"]))
    return {name: frames[name] for name in skeleton.segments}


def _across_the_wrist(
    landmarks: Mapping[str, np.ndarray], side: str, elbow: np.ndarray
) -> np.ndarray:
    """To the person's right between the styloids; as the elbow's hinge where they are not there."""
    names = (f"styloid_radial_{side}", f"styloid_ulnar_{side}")
    if not all(name in landmarks for name in names):
        return elbow
    radial, ulnar = (landmarks[name] for name in names)
    return radial - ulnar if side == "r" else ulnar - radial


def _torso_right(landmarks, centres, up):
    if "suprasternale" in landmarks and "c7" in landmarks:
        return np.cross(landmarks["suprasternale"] - landmarks["c7"], up)
    return centres["shoulder_r"] - centres["shoulder_l"]


def _head(landmarks: Mapping[str, np.ndarray], neck: np.ndarray, torso: np.ndarray) -> np.ndarray:
    """Axes of the head: to the right between paired markers, up to the vertex or vertically."""
    pairs = [
        landmarks[f"{name}_r"] - landmarks[f"{name}_l"]
        for name in ("temple", "forehead", "occiput")
        if f"{name}_r" in landmarks
    ]
    right = np.mean(pairs, axis=0) if pairs else torso[:, 2]
    up = landmarks["vertex"] - neck if "vertex" in landmarks else np.array([0.0, 0.0, 1.0])
    return _y_first(up, right)


def _y_first(y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Axes with Y along ``y`` and Z as near to ``z`` as that allows."""
    y = unit(y)
    x = unit(np.cross(y, z))
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _x_first(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Axes with X along ``x`` and Z as near to ``z`` as that allows."""
    x = unit(x)
    y = unit(np.cross(z, x))
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _person(skeleton, marker_set, positions, centres, frames, sex, stature, landmarks) -> Person:
    n = len(skeleton.segments)
    joints = dict(centres.positions) | {"root": centres.positions["waist"]}
    in_parent, origin = np.zeros((n, 3)), np.zeros((n, 3))
    parent_tilt, child_tilt = np.zeros(n), np.zeros(n)
    for i, name in enumerate(skeleton.segments):
        start, axes = frames[name]
        joint = joints[skeleton.joints[i]]
        origin[i] = axes.T @ (start - joint)
        if skeleton.parents[i] < 0:
            continue
        parent_start, parent_axes = frames[skeleton.segments[skeleton.parents[i]]]
        in_parent[i] = parent_axes.T @ (joint - parent_start)
        if skeleton.joint_types[i] == "revolute":
            hinge = centres.hinges[skeleton.joints[i]]
            parent_tilt[i] = _tilt(parent_axes.T @ hinge)
            child_tilt[i] = _tilt(axes.T @ hinge)
    present = [m for m in marker_set.markers if m.label in positions]
    on = [skeleton.carrying(m.segment, m.landmark) for m in present]
    index = np.array([skeleton.index(segment) for segment in on])
    local = np.array(
        [
            frames[segment][1].T @ (positions[m.label] - frames[segment][0])
            for m, segment in zip(present, on, strict=True)
        ]
    )
    return Person(
        skeleton,
        in_parent,
        parent_tilt,
        child_tilt,
        origin,
        _table_lengths(skeleton, centres, frames, sex, stature, landmarks),
        tuple(m.label for m in present),
        index,
        local,
        np.array([m.weight for m in present]),
        ~np.array(skeleton.informed(set(on))),
    )


def _tilt(axis: np.ndarray) -> float:
    """Tilt about X of a hinge, from its direction in a segment (the X part is the frame's own)."""
    return float(np.arctan2(-axis[1], axis[2]))


def _table_lengths(skeleton, centres, frames, sex, stature, landmarks) -> np.ndarray:
    """(n,) lengths as the anthropometric table defines them; of a clavicle, joint to joint."""
    p = centres.positions
    lengths: list[float] = []
    for name, row in zip(skeleton.segments, skeleton.table_rows, strict=True):
        side = skeleton.side(name)
        ends = {
            "": (f"sternoclavicular_{side}", f"shoulder_{side}"),
            "torso": ("neck", "waist"),
            "arm": (f"shoulder_{side}", f"elbow_{side}"),
            "forearm": (f"elbow_{side}", f"wrist_{side}"),
            "thigh": (f"hip_{side}", f"knee_{side}"),
            "shank": (f"knee_{side}", f"ankle_{side}"),
        }
        if row in ends:
            a, b = ends[row]
            lengths.append(float(np.linalg.norm(p[a] - p[b])))
        elif row == "pelvis":
            origin, axes = frames["lower_torso"]
            middle = axes.T @ (0.5 * (p["hip_l"] + p["hip_r"]) - origin)
            lengths.append(float(np.hypot(middle[0], middle[1])))
        elif row == "foot":
            lengths.append(
                float(np.linalg.norm(centres.ends[name] - landmarks[f"calcaneus_{side}"]))
            )
        elif row == "hand" and name in centres.ends:
            lengths.append(float(np.linalg.norm(centres.ends[name] - p[f"wrist_{side}"])))
        elif row == "head" and "vertex" in landmarks:
            lengths.append(float(np.linalg.norm(landmarks["vertex"] - p["neck"])))
        else:
            lengths.append(mean_length_m(sex, row, stature))
    return np.array(lengths)


def _pose(person: Person, frames: Mapping[str, Frame]) -> np.ndarray:
    """(nq,) configuration of the standing pose."""
    skeleton = person.skeleton
    q = np.zeros(len(skeleton.q_names))
    neutral = person.joint_rotations()
    for i, name in enumerate(skeleton.segments):
        at = skeleton.q_starts[i]
        start, axes = frames[name]
        if skeleton.parents[i] < 0:
            q[at : at + 3] = start - axes @ person.origin_in_joint_m[i]
            q[at + 3 : at + 7] = Rotation.from_matrix(axes).as_quat()
            continue
        parent_axes = frames[skeleton.segments[skeleton.parents[i]]][1]
        turn = Rotation.from_matrix(neutral[i].T @ parent_axes.T @ axes)
        if skeleton.joint_types[i] == "spherical":
            q[at : at + 4] = turn.as_quat()
        else:
            q[at] = turn.as_rotvec() @ person.hinge_axes()[i]
    return q
