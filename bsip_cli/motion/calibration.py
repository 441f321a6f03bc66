"""A first skeleton from one standing pose: segment frames, lengths, markers on their segments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.anthropometry import mean_length_m, stature_m
from bsip_cli.body.joint_centres import JointCentres, hip_centres, joint_centres, unit, with_skin
from bsip_cli.body.markersets import Marker, MarkerSet
from bsip_cli.body.person import Person, rigid_motion
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.segments import in_words

Places = Mapping[str, np.ndarray]  # label or landmark to its position [m]
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
    positions: Places,
    sex: str,
    height_m: float | None,
    trials: Sequence[Places] = (),
) -> Calibration:
    """Build the skeleton from marker positions in one standing pose.

    positions : label to (3,) world position [m], Z up; only markers that are visible.
    sex : M, F or other, for the joint-centre regressions.
    height_m : stature, or None to estimate it from the long segments.
    trials : of each trial, label to (N, 3) positions [m]: knees and ankles without markers are
        found from their movement there.

    BadDataError: landmarks are missing (all are named).
    """
    gathered: dict[str, list[np.ndarray]] = {}
    for marker in marker_set.markers:
        if marker.landmark and marker.label in positions:
            gathered.setdefault(marker.landmark, []).append(positions[marker.label])
    means = {name: np.mean(found, axis=0) for name, found in gathered.items()}
    landmarks, placed = with_skin(means, sex)
    moved, notes = functional_landmarks(marker_set, landmarks, positions, trials, sex)
    landmarks |= moved
    guess = height_m or _rough_stature(landmarks)
    centres = joint_centres(landmarks, sex, guess)
    lengths = {"torso": _joint_to_joint(centres, "torso", "")}
    for row in ("thigh", "shank"):
        lengths[row] = float(np.mean([_joint_to_joint(centres, row, side) for side in "lr"]))
    stature = height_m or stature_m(sex, lengths)
    frames = _frames(skeleton, centres, landmarks)
    lengths_m = _table_lengths(skeleton, centres, frames, sex, stature, landmarks)
    person = _person(skeleton, marker_set, positions, centres, frames, lengths_m)
    forward = centres.pelvis_axes[:, 0] * np.array([1.0, 1.0, 0.0])
    return Calibration(
        person, _pose(person, frames), unit(forward), stature, (*placed, *notes, *centres.notes)
    )


# Heights above the heel marker, as parts of the stature: C7, the acromia, the ASIS.
_HEIGHTS = (("c7", 0.84), ("acromion_l", 0.82), ("asis_l", 0.54))


def _rough_stature(landmarks: Places) -> float:
    """Stature from the height of the highest known landmark over the heel; upright standing."""
    for name, part in _HEIGHTS:
        if name in landmarks and "calcaneus_l" in landmarks:
            return float(landmarks[name][2] - landmarks["calcaneus_l"][2]) / part
    raise BadDataError(
        "no marker for calcaneus_l, or none for c7, acromion_l and asis_l",
        expected="the heel and one of these in the static trial",
        remedy="state height_m in participants.tsv, or name these markers in a marker set",
    )


_ENDS = {  # joints at both ends, by row of the table; of a clavicle, which has none
    "": ("sternoclavicular", "shoulder"),
    "torso": ("neck", "waist"),
    "arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
    "thigh": ("hip", "knee"),
    "shank": ("knee", "ankle"),
}
# The joint whose axis is the segment's Z.
_HINGE = {"upper_arm": "elbow", "forearm": "elbow", "thigh": "knee", "shank": "knee"}


def _frames(skeleton: Skeleton, centres: JointCentres, landmarks: Places) -> dict[str, Frame]:
    """Origin and axes of every segment in the standing pose (ISB, as in Dumas 2007)."""
    p = centres.positions
    up = p["neck"] - p["waist"]
    right = p["shoulder_r"] - p["shoulder_l"]
    if "suprasternale" in landmarks and "c7" in landmarks:
        right = np.cross(landmarks["suprasternale"] - landmarks["c7"], up)
    torso = _y_first(up, right)
    # the head: to the right between paired markers, up to the vertex or vertically
    pairs = [
        landmarks[f"{name}_r"] - landmarks[f"{name}_l"]
        for name in ("temple", "forehead", "occiput")
        if {f"{name}_r", f"{name}_l"} <= landmarks.keys()
    ]
    vertical = np.array([0.0, 0.0, 1.0])
    up = landmarks["vertex"] - p["neck"] if "vertex" in landmarks else vertical
    head = _y_first(up, np.mean(pairs, axis=0) if pairs else torso[:, 2])
    frames = {
        "lower_torso": (p["waist"], centres.pelvis_axes),
        "upper_torso": (p["neck"], torso),
        "head": (p["neck"], head),
    }
    for s in "lr":
        # Rods without mass need no axes of their own: their angles count from this pose.
        frames[f"clavicle_{s}"] = (p[f"sternoclavicular_{s}"], torso)
        for name, hinge in _HINGE.items():
            start, end = (p[f"{joint}_{s}"] for joint in _ENDS[name.removeprefix("upper_")])
            frames[f"{name}_{s}"] = (start, _y_first(start - end, centres.hinges[f"{hinge}_{s}"]))
        radial, ulnar = (landmarks.get(f"styloid_{name}_{s}") for name in ("radial", "ulnar"))
        across = centres.hinges[f"elbow_{s}"]  # or to the person's right between the styloids
        if radial is not None and ulnar is not None:
            across = (1.0 if s == "r" else -1.0) * (radial - ulnar)
        wrist, fingers = p[f"wrist_{s}"], centres.ends.get(f"hand_{s}")
        along = p[f"elbow_{s}"] - wrist if fingers is None else wrist - fingers
        frames[f"hand_{s}"] = (wrist, _y_first(along, across))
        sole = centres.ends[f"foot_{s}"] - landmarks[f"calcaneus_{s}"]
        x = unit(sole)
        y = unit(np.cross(centres.hinges[f"ankle_{s}"], x))
        frames[f"foot_{s}"] = (p[f"ankle_{s}"], np.stack([x, y, np.cross(x, y)], axis=1))
    return {name: frames[name] for name in skeleton.segments}


def _y_first(y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Axes with Y along ``y`` and Z as near to ``z`` as that allows."""
    y = unit(y)
    x = unit(np.cross(y, z))
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _person(
    skeleton: Skeleton,
    marker_set: MarkerSet,
    positions: Places,
    centres: JointCentres,
    frames: Mapping[str, Frame],
    lengths_m: np.ndarray,
) -> Person:
    joints = dict(centres.positions) | {"root": centres.positions["waist"]}
    placed = [
        (*frames[name], joints[joint])
        for name, joint in zip(skeleton.segments, skeleton.joints, strict=True)
    ]
    origin = np.array([axes.T @ (start - joint) for start, axes, joint in placed])
    in_parent = np.zeros_like(origin)
    tilts = np.zeros((2, len(placed)))  # of hinges, as parent and child see them
    for i, parent in enumerate(skeleton.parents[1:], start=1):
        (parent_start, parent_axes, _), (_, axes, joint) = placed[parent], placed[i]
        in_parent[i] = parent_axes.T @ (joint - parent_start)
        if skeleton.joint_types[i] == "revolute":
            for k, seen_from in enumerate((parent_axes, axes)):
                _, y, z = seen_from.T @ centres.hinges[skeleton.joints[i]]  # X is the frame's own
                tilts[k, i] = np.arctan2(-y, z)
    present = [m for m in marker_set.markers if m.label in positions]
    on = [skeleton.carrying(m.segment, m.landmark) for m in present]
    local = [
        frames[name][1].T @ (positions[m.label] - frames[name][0])
        for m, name in zip(present, on, strict=True)
    ]
    return Person(
        skeleton,
        in_parent,
        tilts[0],
        tilts[1],
        origin,
        lengths_m,
        tuple(m.label for m in present),
        np.array([skeleton.index(name) for name in on]),
        np.array(local),
        np.array([m.weight for m in present]),
        ~np.array(skeleton.informed(set(on))),
    )


def _joint_to_joint(centres: JointCentres, row: str, side: str) -> float:
    start, end = (centres.positions[f"{one}_{side}" if side else one] for one in _ENDS[row])
    return float(np.linalg.norm(end - start))


def _table_lengths(
    skeleton: Skeleton,
    centres: JointCentres,
    frames: Mapping[str, Frame],
    sex: str,
    stature: float,
    landmarks: Places,
) -> np.ndarray:
    """(n,) lengths as the anthropometric table defines them; of a clavicle, joint to joint."""
    p, lengths = centres.positions, np.empty(len(skeleton.segments))
    for i, (name, row) in enumerate(zip(skeleton.segments, skeleton.table_rows, strict=True)):
        side = skeleton.side(name)
        if row in _ENDS:
            lengths[i] = _joint_to_joint(centres, row, side)
        elif row == "pelvis":
            start, axes = frames["lower_torso"]
            x, y, _ = axes.T @ (0.5 * (p["hip_l"] + p["hip_r"]) - start)
            lengths[i] = np.hypot(x, y)
        elif name in centres.ends:  # of a foot or a hand
            start = landmarks[f"calcaneus_{side}"] if row == "foot" else p[f"wrist_{side}"]
            lengths[i] = np.linalg.norm(centres.ends[name] - start)
        elif row == "head" and "vertex" in landmarks:
            lengths[i] = np.linalg.norm(landmarks["vertex"] - p["neck"])
        else:
            lengths[i] = mean_length_m(sex, row, stature)
    return lengths


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


# --- a joint from the movement of the segments that it joins: SCoRE and SARA (Ehrig 2006, 2007) ---


_LEAST_FRAMES = 20


@dataclass(frozen=True, eq=False)
class FunctionalJoint:
    """The point and the line that stay where they are in both segments, in the reference pose.

    point : (3,) on the axis, nearest to the markers' middle [m].
    axis : (3,) unit vector of the direction in which the point is known worst.
    turned_rad : largest turn of one segment against the other from the reference pose.
    residual_m : how far the point parts between both segments, root mean square.
    """

    point: np.ndarray
    axis: np.ndarray
    turned_rad: float
    residual_m: float

    def nearest_to(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(3,) the point of the axis nearest to the line through a and b (3,)."""
        # It lies in the plane of that line and of the direction across both.
        along = unit(b - a)
        return self._at_plane(a, np.cross(unit(np.cross(self.axis, along)), along))

    def in_plane(self, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        """(3,) where the axis meets the plane through a, b and c (3,)."""
        return self._at_plane(a, np.cross(b - a, c - a))

    def _at_plane(self, inside: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return self.point + self.axis * ((inside - self.point) @ normal) / (self.axis @ normal)


def functional_joint(
    proximal: np.ndarray,
    distal: np.ndarray,
    reference_proximal: np.ndarray,
    reference_distal: np.ndarray,
) -> FunctionalJoint | None:
    """The joint between two clusters of markers; None without enough frames.

    proximal, distal : (N, k, 3) world positions of each cluster [m], k of at least 3, NaN where
        missing; frames in which one is missing are left out.
    reference_proximal, reference_distal : (k, 3) world positions in the pose that counts.
    """
    whole = np.isfinite(proximal).all(axis=(1, 2)) & np.isfinite(distal).all(axis=(1, 2))
    if whole.sum() < _LEAST_FRAMES:
        return None
    turn_a, shift_a = rigid_motion(reference_proximal, proximal[whole])
    turn_b, shift_b = rigid_motion(reference_distal, distal[whole])
    rows = np.concatenate([turn_a, -turn_b], axis=2).reshape(-1, 6)
    middle = 0.5 * (reference_proximal.mean(axis=0) + reference_distal.mean(axis=0))
    start = np.concatenate([middle, middle])
    right = (shift_b - shift_a).reshape(-1) - rows @ start
    u, strength, vt = np.linalg.svd(rows, full_matrices=False)
    step = vt[:5].T @ ((u[:, :5].T @ right) / strength[:5])  # nothing along the axis
    points = (start + step).reshape(2, 3)
    left = (rows @ (start + step) - (shift_b - shift_a).reshape(-1)).reshape(-1, 3)
    axis = vt[5].reshape(2, 3).sum(axis=0)
    relative = np.einsum("nji,njk->nik", turn_a, turn_b)
    cosine = 0.5 * (np.trace(relative, axis1=1, axis2=2) - 1.0)
    return FunctionalJoint(
        points.mean(axis=0),
        unit(axis),
        float(np.arccos(np.clip(cosine, -1.0, 1.0)).max()),
        float(np.sqrt((left**2).sum(axis=1).mean())),
    )


_LEAST_TURN_DEG = {"knee": 30.0, "ankle": 20.0}  # less leaves the axis to the noise of the skin
_LARGEST_RESIDUAL_M = 0.02  # the clusters do not turn about one line
_HALF_M = 0.04  # of the distance of the epicondyles put in; only their middle and direction count


def functional_landmarks(
    marker_set: MarkerSet,
    landmarks: Places,
    reference: Places,
    trials: Sequence[Places],
    sex: str,
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Epicondyles and malleoli (3,) [m] in the reference pose of the sides that have neither, where
    movement shows the joints, and how they were found, in words.

    landmarks : those that have markers, in the reference pose; without pelvis and feet nothing is
        found.
    reference : label to (3,) position in the reference pose.
    trials : of each trial, label to (N, 3) positions [m], NaN where missing.
    """
    found: dict[str, np.ndarray] = {}
    notes: list[str] = []
    on: dict[str, list[Marker]] = {}
    hips = hip_centres(landmarks, sex)
    for m in marker_set.markers:
        if m.label in reference:
            on.setdefault(m.segment, []).append(m)
    for side in "lr":
        missing = not {f"knee_lateral_{side}", f"malleolus_lateral_{side}"} & landmarks.keys()
        heel = landmarks.get(f"calcaneus_{side}")
        limb = [on.get(f"{name}_{side}", []) for name in ("thigh", "shank", "foot")]
        front = [reference[m.label] for m in limb[2] if not m.landmark.startswith("calcaneus")]
        if not missing or hips is None or heel is None or not front:
            continue
        knee = _joint("knee", limb[:2], reference, trials)
        ankle = _joint("ankle", limb[1:], reference, trials)
        if knee is None or ankle is None:
            continue
        above = knee.nearest_to(hips[side], heel)
        middle = {"malleolus": ankle.in_plane(heel, np.mean(front, axis=0), above)}
        middle["knee"] = knee.nearest_to(hips[side], middle["malleolus"])
        right = hips["r"] - hips["l"]
        outward = knee.axis * np.sign(knee.axis @ right) * (1.0 if side == "r" else -1.0)
        for name, centre in middle.items():
            found[f"{name}_lateral_{side}"] = centre + _HALF_M * outward
            found[f"{name}_medial_{side}"] = centre - _HALF_M * outward
        notes += [
            f"the {in_words(f'{name}_{side}')} has no marker: centre from its movement (turned by "
            f"up to {np.rad2deg(one.turned_rad):.0f} degrees, {1000 * one.residual_m:.0f} mm)"
            for name, one in (("knee", knee), ("ankle", ankle))
        ]
    return found, tuple(notes)


def _joint(
    kind: str,
    segments: Sequence[Sequence[Marker]],
    reference: Places,
    trials: Sequence[Places],
) -> FunctionalJoint | None:
    """The joint between two segments with these markers; None where markers or movement do not
    show it."""
    labels = [[m.label for m in markers] for markers in segments]
    complete = [trial for trial in trials if all(n in trial for n in [*labels[0], *labels[1]])]
    if min(map(len, labels)) < 3 or not complete:
        return None
    clusters = (
        np.concatenate([np.stack([trial[n] for n in names], axis=1) for trial in complete])
        for names in labels
    )
    still = (np.stack([reference[n] for n in names]) for names in labels)
    joint = functional_joint(*clusters, *still)
    if joint is None or joint.residual_m > _LARGEST_RESIDUAL_M:
        return None
    return joint if np.rad2deg(joint.turned_rad) >= _LEAST_TURN_DEG[kind] else None
