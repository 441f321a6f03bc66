"""Stand-ins for landmarks of trunk and arms that a marker set lacks.

Where a recording shows some of the trunk's landmarks, the others are placed by the mean
proportions of nine people in the recordings of seven labs (standard deviation 0.03 of the length
from the lumbar joint to between the acromia, some 15 mm). Where it shows none, the trunk stands
straight on the pelvis and the arms hang straight down, in the mean lengths of the anthropometric
table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.anthropometry import mean_length_m
from bsip_cli.body.names import in_words

# From between the acromia, X ahead and Y along the trunk, as parts of the length from the lumbar
# joint to there; the distance of the acromia and that length over the table's torso likewise.
_C7, _SUPRASTERNALE = np.array([-0.126, 0.069]), np.array([0.167, -0.110])
_BREADTH, _LENGTH_TO_TORSO = 0.742, 0.94


@dataclass(frozen=True, eq=False)
class Completed:
    """Landmarks (3,) [m] with the stand-ins among them, and what was put in, in words."""

    landmarks: Mapping[str, np.ndarray]
    notes: tuple[str, ...]


def with_trunk(
    landmarks: Mapping[str, np.ndarray],
    waist: np.ndarray,
    pelvis_axes: np.ndarray,
    sex: str,
    stature_m: float,
) -> Completed:
    """C7 and both acromia, whatever the set has of them.

    ``waist`` (3,) is the lumbar joint centre [m], ``pelvis_axes`` (3, 3) X, Y, Z as columns.
    """
    wanted = ("c7", "acromion_l", "acromion_r")
    missing = [name for name in wanted if name not in landmarks]
    if not missing:
        return Completed(landmarks, ())
    acromia = "acromion_l" in landmarks and "acromion_r" in landmarks
    if acromia:
        middle = 0.5 * (landmarks["acromion_l"] + landmarks["acromion_r"])
        right = landmarks["acromion_r"] - landmarks["acromion_l"]
        basis = "the acromia"
    elif "c7" in landmarks and "suprasternale" in landmarks:
        middle = _between(landmarks["c7"], landmarks["suprasternale"], waist)
        right, basis = pelvis_axes[:, 2], "C7 and the suprasternale"
    else:
        length = _LENGTH_TO_TORSO * mean_length_m(sex, "torso", stature_m)
        middle, right = waist + length * pelvis_axes[:, 1], pelvis_axes[:, 2]
        basis = "the pelvis, the trunk straight on it"
    placed = _placed(middle, waist, right)
    if not acromia and "suprasternale" not in landmarks and "c7" not in landmarks:
        missing.append("suprasternale")
    names = ", ".join(in_words(name) for name in missing)
    note = f"no marker for {names}: placed by mean proportions from {basis}"
    return Completed(dict(landmarks) | {name: placed[name] for name in missing}, (note,))


def _between(c7: np.ndarray, suprasternale: np.ndarray, waist: np.ndarray) -> np.ndarray:
    """The middle of the acromia, from where it lies beside the middle of these two."""
    middle = 0.5 * (c7 + suprasternale)
    up = middle - waist
    ahead = suprasternale - c7
    ahead = ahead - (ahead @ up) / (up @ up) * up
    x, y = 0.5 * (_C7 + _SUPRASTERNALE)
    length = float(np.linalg.norm(up))
    return middle - length * x * ahead / np.linalg.norm(ahead) - y * up


def _placed(middle: np.ndarray, waist: np.ndarray, right: np.ndarray) -> dict[str, np.ndarray]:
    """C7, suprasternale and acromia by the mean proportions about the acromia's middle."""
    up = middle - waist
    length = float(np.linalg.norm(up))
    y = up / length
    x = np.cross(y, right)
    x /= np.linalg.norm(x)
    half = 0.5 * _BREADTH * length * np.cross(x, y)
    return {
        "c7": middle + length * (_C7[0] * x + _C7[1] * y),
        "suprasternale": middle + length * (_SUPRASTERNALE[0] * x + _SUPRASTERNALE[1] * y),
        "acromion_r": middle + half,
        "acromion_l": middle - half,
    }


@dataclass(frozen=True, eq=False)
class Arm:
    """Elbow's lateral landmark and wrist centre (3,) [m], where they are known, and the notes."""

    lateral: np.ndarray
    wrist: np.ndarray
    notes: tuple[str, ...]


def whole_arm(
    landmarks: Mapping[str, np.ndarray],
    shoulder: np.ndarray,
    down: np.ndarray,
    side: str,
    sex: str,
    stature_m: float,
) -> Arm:
    """The arm's landmarks; what is missing hangs down or goes on in a straight line.

    ``shoulder`` (3,) is the joint centre [m], ``down`` (3,) the trunk's downward unit vector.
    """
    notes: list[str] = []
    wrist = _wrist(landmarks, side, notes)
    lateral = landmarks.get(f"elbow_lateral_{side}")
    upper, fore = (mean_length_m(sex, row, stature_m) for row in ("arm", "forearm"))
    if lateral is None and wrist is None:
        notes.append(f"no markers on the {in_words(f'arm_{side}')}: it hangs straight down")
        return Arm(shoulder + upper * down, shoulder + (upper + fore) * down, tuple(notes))
    if lateral is None:
        assert wrist is not None
        notes.append(f"no marker on the {in_words(f'elbow_{side}')}: taken as straight")
        return Arm(shoulder + upper / (upper + fore) * (wrist - shoulder), wrist, tuple(notes))
    if wrist is None:
        notes.append(
            f"no marker on the {in_words(f'wrist_{side}')}: the forearm goes on straight from the "
            "elbow, in its mean length"
        )
        along = lateral - shoulder
        return Arm(lateral, lateral + fore * along / np.linalg.norm(along), tuple(notes))
    return Arm(lateral, wrist, tuple(notes))


def _wrist(landmarks: Mapping[str, np.ndarray], side: str, notes: list[str]) -> np.ndarray | None:
    """The middle of the styloids; where only one marker sits on the wrist, that one."""
    styloids = [
        landmarks[name]
        for name in (f"styloid_radial_{side}", f"styloid_ulnar_{side}")
        if name in landmarks
    ]
    if len(styloids) == 2:
        return 0.5 * (styloids[0] + styloids[1])
    single = landmarks.get(f"wrist_{side}", styloids[0] if styloids else None)
    if single is not None:
        notes.append(f"the {in_words(f'wrist_{side}')} has one marker only: taken as its centre")
    return single
