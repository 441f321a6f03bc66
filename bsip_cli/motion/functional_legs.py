"""Knees and ankles without markers, from how thigh, shank and foot moved against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.joint_centres import hip_centres
from bsip_cli.body.markersets import MarkerSet
from bsip_cli.body.names import in_words
from bsip_cli.body.person import rigid_motion

# --- a joint from the movement of the segments that it joins: SCoRE and SARA (Ehrig 2006, 2007) ---


_LEAST_FRAMES = 20


@dataclass(frozen=True, eq=False)
class FunctionalJoint:
    """The point and the line that stay where they are in both segments, in the reference pose.

    Attributes
    ----------
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
        along = (b - a) / np.linalg.norm(b - a)
        across = np.cross(self.axis, along)
        across /= np.linalg.norm(across)
        # Seen along the other line: how far to go on the axis until both meet.
        beside = np.cross(across, along)
        return self.point + self.axis * ((a - self.point) @ beside) / (self.axis @ beside)

    def in_plane(self, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        """(3,) where the axis meets the plane through a, b and c (3,)."""
        normal = np.cross(b - a, c - a)
        return self.point + self.axis * ((a - self.point) @ normal) / (self.axis @ normal)


def functional_joint(
    proximal: np.ndarray,
    distal: np.ndarray,
    reference_proximal: np.ndarray,
    reference_distal: np.ndarray,
) -> FunctionalJoint | None:
    """The joint between two clusters of markers; None without enough frames.

    Parameters
    ----------
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
        axis / np.linalg.norm(axis),
        float(np.arccos(np.clip(cosine, -1.0, 1.0)).max()),
        float(np.sqrt((left**2).sum(axis=1).mean())),
    )


# --------------------------------------------------------------------------------------------------


_LEAST_TURN_DEG = {"knee": 30.0, "ankle": 20.0}  # less leaves the axis to the noise of the skin
_LARGEST_RESIDUAL_M = 0.02  # the clusters do not turn about one line
_HALF_M = 0.04  # of the distance of the epicondyles put in; only their middle and direction count


@dataclass(frozen=True, eq=False)
class FunctionalLandmarks:
    """Landmarks (3,) [m] in the reference pose, and how they were found, in words."""

    landmarks: Mapping[str, np.ndarray]
    notes: tuple[str, ...]


def functional_landmarks(
    marker_set: MarkerSet,
    landmarks: Mapping[str, np.ndarray],
    reference: Mapping[str, np.ndarray],
    trials: Sequence[Mapping[str, np.ndarray]],
    sex: str,
) -> FunctionalLandmarks:
    """Epicondyles and malleoli of the sides that have neither, where movement shows the joints.

    Parameters
    ----------
    landmarks : those that have markers, in the reference pose; without pelvis and feet nothing is
        found.
    reference : label to (3,) position in the reference pose.
    trials : of each trial, label to (N, 3) positions [m], NaN where missing.
    """
    found: dict[str, np.ndarray] = {}
    notes: list[str] = []
    hips = hip_centres(landmarks, sex)
    for side in "lr":
        missing = not {f"knee_lateral_{side}", f"malleolus_lateral_{side}"} & landmarks.keys()
        heel = landmarks.get(f"calcaneus_{side}")
        forefoot = _forefoot(side, marker_set, reference)
        if not missing or hips is None or heel is None or forefoot is None:
            continue
        knee = _joint("knee", f"thigh_{side}", f"shank_{side}", marker_set, reference, trials)
        ankle = _joint("ankle", f"shank_{side}", f"foot_{side}", marker_set, reference, trials)
        if knee is None or ankle is None:
            continue
        above = knee.nearest_to(hips[side], heel)
        middle = {"malleolus": ankle.in_plane(heel, forefoot, above)}
        middle["knee"] = knee.nearest_to(hips[side], middle["malleolus"])
        right = hips["r"] - hips["l"]
        outward = knee.axis * np.sign(knee.axis @ right) * (1.0 if side == "r" else -1.0)
        for name, centre in middle.items():
            found[f"{name}_lateral_{side}"] = centre + _HALF_M * outward
            found[f"{name}_medial_{side}"] = centre - _HALF_M * outward
        notes += [_note(f"knee_{side}", knee), _note(f"ankle_{side}", ankle)]
    return FunctionalLandmarks(found, tuple(notes))


def _forefoot(
    side: str, marker_set: MarkerSet, reference: Mapping[str, np.ndarray]
) -> np.ndarray | None:
    """The middle of the foot's markers but the heel's."""
    places = [
        reference[m.label]
        for m in marker_set.markers
        if m.segment == f"foot_{side}" and not m.landmark.startswith("calcaneus")
        if m.label in reference
    ]
    return np.mean(places, axis=0) if places else None


def _joint(
    kind: str,
    proximal: str,
    distal: str,
    marker_set: MarkerSet,
    reference: Mapping[str, np.ndarray],
    trials: Sequence[Mapping[str, np.ndarray]],
) -> FunctionalJoint | None:
    """The joint between two segments; None where markers or movement do not show it."""
    labels = [
        [m.label for m in marker_set.markers if m.segment == segment and m.label in reference]
        for segment in (proximal, distal)
    ]
    complete = [trial for trial in trials if all(n in trial for n in [*labels[0], *labels[1]])]
    if min(map(len, labels)) < 3 or not complete:
        return None
    clusters = [
        np.concatenate([np.stack([trial[n] for n in names], axis=1) for trial in complete])
        for names in labels
    ]
    still = [np.stack([reference[n] for n in names]) for names in labels]
    joint = functional_joint(clusters[0], clusters[1], still[0], still[1])
    if joint is None or joint.residual_m > _LARGEST_RESIDUAL_M:
        return None
    return joint if np.rad2deg(joint.turned_rad) >= _LEAST_TURN_DEG[kind] else None


def _note(name: str, joint: FunctionalJoint) -> str:
    return (
        f"the {in_words(name)} has no marker: centre from its movement (turned by up to "
        f"{np.rad2deg(joint.turned_rad):.0f} degrees, {1000 * joint.residual_m:.0f} mm)"
    )
