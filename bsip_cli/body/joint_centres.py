"""Joint centres from bony landmarks in one standing pose (Reed 1999, as Dumas 2007 uses them).

Positions are world coordinates [m]; ``landmarks`` maps the names of
:data:`bsip_cli.body.person.LANDMARKS` to (3,) positions. The pelvis fractions are those in
the ISB pelvis frame (Dumas and Wojtusch 2018), since the pubis is not marked; the shoulder is the
2007 edition's, whose angle is measured from the line C7 to suprasternale.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.anthropometry import mean_length_m
from bsip_cli.body.keypoints import HIP_FRACTIONS, stood_in_for
from bsip_cli.body.names import in_words
from bsip_cli.errors import BadDataError
from bsip_cli.stated.sex_words import OTHER, with_other

# --- stand-ins for landmarks of trunk and arms that a marker set lacks ----------------------------

# Where a recording shows some of the trunk's landmarks, the others are placed by the mean
# proportions of nine people in the recordings of seven labs (standard deviation 0.03 of the length
# from the lumbar joint to between the acromia, some 15 mm). Where it shows none, the trunk stands
# straight on the pelvis and the arms hang straight down, in the mean lengths of the anthropometric
# table.


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


# --------------------------------------------------------------------------------------------------


# Fractions of the distance between the ASIS, from their middle; X anterior, Y up, Z right.
_LJC = with_other({"M": (-0.335, -0.032, 0.0), "F": (-0.340, 0.049, 0.0)})
# Fraction of the thorax width (C7 to suprasternale) and angle above that line [degrees].
_CJC = with_other({"M": (0.55, 8.0), "F": (0.53, 14.0)})
_SJC = (0.42, -67.0)
# Sternoclavicular joint from suprasternale, thorax axes, in thorax widths: 6.3, 6.9 and 25.5 mm in
# the 50th percentile man of the OpenSim arm models (Holzbaur 2005), 136 mm wide as below.
_SCJ = np.array([0.046, 0.051, 0.187])
# Half breadths for joints with a lateral marker only, as fractions of the stature.
_HALF_BREADTH = {"elbow": 0.022, "knee": 0.031, "malleolus": 0.022}
_MEAN_OF_BOTH = (
    "sex other or not stated: joint centres, segment masses and inertias are the mean of the "
    "women's and the men's tables"
)
# Used where a marker set has no suprasternale: the sample's thorax width over stature, and the
# slope of the line C7 to suprasternale below the horizontal [degrees].
_THORAX_WIDTH, _THORAX_SLOPE = 0.077, -25.0


@dataclass(frozen=True, eq=False)
class JointCentres:
    """World positions [m] by name (``hip_l`` ...) and the directions the frames are built on.

    ``pelvis_axes`` (3, 3) has X, Y, Z as columns; ``hinges`` maps ``elbow_l`` ... to unit vectors
    that point to the person's right; ``ends`` maps ``hand_l``, ``foot_l`` ... to segment ends;
    ``notes`` says what had to be estimated.
    """

    positions: Mapping[str, np.ndarray]
    pelvis_axes: np.ndarray
    hinges: Mapping[str, np.ndarray]
    ends: Mapping[str, np.ndarray]
    notes: tuple[str, ...]


def joint_centres(landmarks: Mapping[str, np.ndarray], sex: str, stature_m: float) -> JointCentres:
    """Joint centres of the whole body; trunk and arms may lack landmarks, pelvis and legs not.

    Raises
    ------
    BadDataError
        Landmarks without which there is no skeleton are missing: all are named.
    """
    _require(landmarks)
    axes, middle, width = _pelvis(landmarks)
    _require_sides(landmarks, axes[:, 2])
    waist = middle + width * (axes @ _LJC[sex])
    completed = with_trunk(landmarks, waist, axes, sex, stature_m)
    landmarks, notes = completed.landmarks, list(completed.notes)
    if sex == OTHER:
        notes.insert(0, _MEAN_OF_BOTH)
    hips = hip_centres(landmarks, sex)
    assert hips is not None
    centres = {"waist": waist, "hip_r": hips["r"], "hip_l": hips["l"]}
    width, line, right = _thorax(landmarks, axes, centres["waist"], stature_m, notes)
    part, angle = _CJC[sex]
    centres["neck"] = landmarks["c7"] + part * width * _turned(line, right, angle)
    down = _SJC[0] * width * _turned(line, right, _SJC[1])
    sternum = landmarks.get("suprasternale", landmarks["c7"] + width * line)
    up = unit(centres["neck"] - waist)
    thorax = np.stack([unit(np.cross(up, right)), up, right], axis=1)
    hinges: dict[str, np.ndarray] = {}
    ends: dict[str, np.ndarray] = {}
    for side, sign in (("l", -1.0), ("r", 1.0)):
        across = width * _SCJ * np.array([1.0, 1.0, sign])
        centres[f"sternoclavicular_{side}"] = sternum + thorax @ across
        outward = right if side == "r" else -right
        raised = landmarks[f"acromion_{side}"] + down
        centres[f"shoulder_{side}"] = landmarks.get(f"shoulder_centre_{side}", raised)
        shoulder, below = centres[f"shoulder_{side}"], unit(waist - centres["neck"])
        arm = whole_arm(landmarks, shoulder, below, side, sex, stature_m)
        notes += arm.notes
        _arm(landmarks, arm, centres, hinges, ends, side, outward, stature_m, notes)
        outward = axes[:, 2] if side == "r" else -axes[:, 2]
        _leg(landmarks, centres, hinges, ends, side, outward, stature_m, notes)
    return JointCentres(centres, axes, hinges, ends, tuple(notes))


def hip_centres(landmarks: Mapping[str, np.ndarray], sex: str) -> dict[str, np.ndarray] | None:
    """Hip joint centres (3,) [m] by side, from the pelvis alone; None without its landmarks."""
    behind = _mean(landmarks, ("psis_l", "psis_r", "sacrum"))
    if behind is None or not {"asis_l", "asis_r"} <= landmarks.keys():
        return None
    axes, middle, width = _pelvis(landmarks)
    return {
        side: middle + width * (axes @ (HIP_FRACTIONS[sex] * np.array([1.0, 1.0, sign])))
        for side, sign in (("r", 1.0), ("l", -1.0))
    }


_REQUIRED = (
    "asis_l",
    "asis_r",
    *(
        f"{name}_{side}"
        for name in ("knee_lateral", "malleolus_lateral", "calcaneus")
        for side in "lr"
    ),
)


def missing_landmarks(known: Collection[str]) -> list[str]:
    """What has no landmark among the known ones and no skeleton can do without, in words."""
    known = {*known, *stood_in_for(known)}
    missing = [name for name in _REQUIRED if name not in known]
    missing += [
        f"a metatarsal of the {in_words(f'foot_{side}')}"
        for side in "lr"
        if not any(name in known for name in _toes(side))
    ]
    if not any(name in known for name in ("psis_l", "psis_r", "sacrum")):
        missing.append("psis_l and psis_r, or sacrum")
    return missing


def _require(landmarks: Mapping[str, np.ndarray]) -> None:
    missing = missing_landmarks(landmarks.keys())
    if missing:
        raise BadDataError(
            f"no marker for {', '.join(missing)}",
            expected="at least one frame of the calibrating trial in which they are visible",
            remedy="name the markers that serve in a marker set (`bsip markers FILE` shows what "
            "the labels are taken for), or calibrate with another trial",
        )


def _require_sides(landmarks: Mapping[str, np.ndarray], right: np.ndarray) -> None:
    """Right-hand landmarks must lie to the right of left-hand ones, as the pelvis has it."""
    swapped = [
        in_words(name)
        for name in ("acromion", "knee_lateral", "malleolus_lateral", "calcaneus")
        if {f"{name}_r", f"{name}_l"} <= landmarks.keys()
        and (landmarks[f"{name}_r"] - landmarks[f"{name}_l"]) @ right < 0
    ]
    if swapped:
        raise BadDataError(
            f"left and right are exchanged for {', '.join(swapped)}",
            expected="right markers on the pelvis' right side in the calibrating pose",
            remedy="correct the labels of that trial, or calibrate with another",
        )


def _pelvis(landmarks: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, float]:
    right, left = landmarks["asis_r"], landmarks["asis_l"]
    middle = 0.5 * (right + left)
    back = _mean(landmarks, ("psis_l", "psis_r"))
    back = landmarks["sacrum"] if back is None else back
    z = unit(right - left)
    y = unit(np.cross(z, middle - back))
    return np.stack([np.cross(y, z), y, z], axis=1), middle, float(np.linalg.norm(right - left))


def _thorax(landmarks, pelvis, waist, stature_m, notes):
    c7 = landmarks["c7"]
    if "suprasternale" in landmarks:
        line = landmarks["suprasternale"] - c7
        right = unit(np.cross(line, c7 - waist))
        return float(np.linalg.norm(line)), unit(line), right
    notes.append("no suprasternale: thorax width and neck estimated from the stature")
    right = unit(landmarks["acromion_r"] - landmarks["acromion_l"])
    forward = unit(np.cross(c7 - waist, right))
    return _THORAX_WIDTH * stature_m, _turned(forward, right, _THORAX_SLOPE), right


def _arm(landmarks, arm, centres, hinges, ends, side, outward, stature_m, notes):
    shoulder, lateral, wrist = centres[f"shoulder_{side}"], arm.lateral, arm.wrist
    long_axis = unit(shoulder - lateral)
    medial = landmarks.get(f"elbow_medial_{side}")
    if medial is not None:
        elbow, across = 0.5 * (lateral + medial), lateral - medial
    elif f"elbow_lateral_{side}" not in landmarks:
        elbow, across = lateral, outward
    else:
        notes.append(_lateral_only(f"elbow_{side}"))
        across = _across_bent_elbow(long_axis, lateral - wrist, outward)
        elbow = lateral - _HALF_BREADTH["elbow"] * stature_m * unit(across)
    centres[f"elbow_{side}"], centres[f"wrist_{side}"] = elbow, wrist
    hinges[f"elbow_{side}"] = unit(across if side == "r" else -across)
    hand = _mean(landmarks, tuple(f"metacarpal_{k}_{side}" for k in (2, 3, 5)))
    if hand is not None:
        ends[f"hand_{side}"] = hand


def _across_bent_elbow(long_axis, forearm, outward):
    """Lateral direction: normal of the arm's plane where the elbow is bent, else the body's."""
    normal = np.cross(unit(forearm), long_axis)
    across = outward - (outward @ long_axis) * long_axis
    if np.linalg.norm(normal) < 0.35:  # less than about 20 degrees
        return unit(across)
    return unit(normal) * np.sign(normal @ across)


def _leg(landmarks, centres, hinges, ends, side, outward, stature_m, notes):
    for joint, name in (("knee", "knee"), ("ankle", "malleolus")):
        lateral = landmarks[f"{name}_lateral_{side}"]
        medial = landmarks.get(f"{name}_medial_{side}")
        if medial is not None:
            centres[f"{joint}_{side}"], across = 0.5 * (lateral + medial), lateral - medial
        else:
            notes.append(_lateral_only(f"{joint}_{side}"))
            across = outward
            half = _HALF_BREADTH[name] * stature_m
            centres[f"{joint}_{side}"] = lateral - half * unit(across)
        hinges[f"{joint}_{side}"] = unit(across if side == "r" else -across)
    ends[f"foot_{side}"] = _mean(landmarks, _toes(side))


def _lateral_only(joint: str) -> str:
    return f"the {in_words(joint)} has a lateral marker only: centre from the mean breadth"


def _toes(side: str) -> tuple[str, ...]:
    return tuple(f"metatarsal_{k}_{side}" for k in (1, 2, 5))


def _mean(landmarks: Mapping[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray | None:
    known = [landmarks[name] for name in names if name in landmarks]
    return np.mean(known, axis=0) if known else None


def _turned(direction: np.ndarray, right: np.ndarray, degrees: float) -> np.ndarray:
    """A forward direction raised by an angle in the sagittal plane whose normal is ``right``."""
    forward = unit(direction - (direction @ right) * right)
    angle = np.deg2rad(degrees)
    return np.cos(angle) * forward + np.sin(angle) * np.cross(right, forward)


def unit(vector: np.ndarray) -> np.ndarray:
    """The vector scaled to length one."""
    return vector / np.linalg.norm(vector)
