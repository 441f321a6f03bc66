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
from bsip_cli.errors import BadDataError
from bsip_cli.segments import in_words
from bsip_cli.stated import OTHER, with_other

# --- skin landmarks in place of joint centres, which markerless systems give ----------------------

# The stand-ins lie where the regressions below lead back to the given centres. What keypoints do
# not show is taken as in upright standing: the pelvis faces along the line from the hips to the
# shoulders, knees and ankles bend about the line of the hips.

# Hip joint centre in fractions of the distance of the ASIS, from their middle; X anterior, Y up, Z
# right.
HIP_FRACTIONS = with_other({"M": (-0.095, -0.370, 0.361), "F": (-0.139, -0.336, 0.372)})
_HALF_M = 0.04  # of the distance of the stand-ins across a joint; only middle and direction count
_ACROMION = 0.11  # above the shoulder's centre, in parts of the length from hips to shoulders
_ACROSS = {
    "knee_centre": ("knee_lateral", "knee_medial"),
    "ankle_centre": ("malleolus_lateral", "malleolus_medial"),
    "elbow_centre": ("elbow_lateral", "elbow_medial"),
}
_TRUNK = ("hip_centre_l", "hip_centre_r", "shoulder_centre_l", "shoulder_centre_r")
_PELVIS = ("asis_l", "asis_r", "sacrum")


def stood_in_for(known: Collection[str]) -> set[str]:
    """Names of the skin landmarks that the known centres can stand in for."""
    if not set(_TRUNK) <= set(known):
        return set()
    stand_ins = {
        f"{name}_{side}"
        for centre, names in _ACROSS.items()
        for side in "lr"
        if f"{centre}_{side}" in known
        for name in names
    }
    return {*stand_ins, *_PELVIS, "acromion_l", "acromion_r"} - set(known)


def with_skin(
    landmarks: Mapping[str, np.ndarray], sex: str
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Landmarks (3,) [m] with skin landmarks for the joint centres among them, and what was done.

    Those that have markers stay as they are.
    """
    wanted = stood_in_for(landmarks.keys())
    if not wanted:
        return dict(landmarks), ()
    hips = 0.5 * (landmarks["hip_centre_l"] + landmarks["hip_centre_r"])
    shoulders = 0.5 * (landmarks["shoulder_centre_l"] + landmarks["shoulder_centre_r"])
    across = landmarks["hip_centre_r"] - landmarks["hip_centre_l"]
    right = unit(across)
    up = shoulders - hips
    up = up - (up @ right) * right
    y = unit(up)
    x = np.cross(y, right)
    ahead, above, aside = HIP_FRACTIONS[sex]
    width = float(np.linalg.norm(across)) / (2 * aside)
    middle = hips - width * (ahead * x + above * y)
    placed = {
        "asis_l": middle - 0.5 * width * right,
        "asis_r": middle + 0.5 * width * right,
        "sacrum": middle - width * x,
    }
    for side in "lr":
        placed[f"acromion_{side}"] = landmarks[f"shoulder_centre_{side}"] + _ACROMION * up
        outward = right if side == "r" else -right
        for centre, (lateral, medial) in _ACROSS.items():
            if (given := landmarks.get(f"{centre}_{side}")) is not None:
                placed[f"{lateral}_{side}"] = given + _HALF_M * outward
                placed[f"{medial}_{side}"] = given - _HALF_M * outward
    note = "joint centres are given, no skin landmarks: placed from them as in upright standing: "
    return dict(landmarks) | {name: placed[name] for name in wanted}, (
        note + ", ".join(in_words(name) for name in sorted(wanted)),
    )


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


def _with_trunk(
    landmarks: Mapping[str, np.ndarray],
    waist: np.ndarray,
    pelvis_axes: np.ndarray,
    sex: str,
    stature_m: float,
) -> tuple[Mapping[str, np.ndarray], list[str]]:
    """Landmarks (3,) [m] with C7 and both acromia, whatever the set has of them, and what was put
    in, in words.

    ``waist`` (3,) is the lumbar joint centre [m], ``pelvis_axes`` (3, 3) X, Y, Z as columns.
    """
    missing = [name for name in ("c7", "acromion_l", "acromion_r") if name not in landmarks]
    if not missing:
        return landmarks, []
    right = pelvis_axes[:, 2]
    if "acromion_l" in landmarks and "acromion_r" in landmarks:
        middle = 0.5 * (landmarks["acromion_l"] + landmarks["acromion_r"])
        right, basis = landmarks["acromion_r"] - landmarks["acromion_l"], "the acromia"
    elif "c7" in landmarks and "suprasternale" in landmarks:
        middle = _between(landmarks["c7"], landmarks["suprasternale"], waist)
        basis = "C7 and the suprasternale"
    else:
        length = _LENGTH_TO_TORSO * mean_length_m(sex, "torso", stature_m)
        middle = waist + length * pelvis_axes[:, 1]
        basis = "the pelvis, the trunk straight on it"
        if "suprasternale" not in landmarks and "c7" not in landmarks:
            missing.append("suprasternale")
    # by the mean proportions about the acromia's middle
    up = middle - waist
    tall = float(np.linalg.norm(up))
    y = up / tall
    x = unit(np.cross(y, right))
    half = 0.5 * _BREADTH * tall * np.cross(x, y)
    placed = {"acromion_r": middle + half, "acromion_l": middle - half}
    for name, (ahead, above) in (("c7", _C7), ("suprasternale", _SUPRASTERNALE)):
        placed[name] = middle + tall * (ahead * x + above * y)
    names = ", ".join(in_words(name) for name in missing)
    note = f"no marker for {names}: placed by mean proportions from {basis}"
    return dict(landmarks) | {name: placed[name] for name in missing}, [note]


def _between(c7: np.ndarray, suprasternale: np.ndarray, waist: np.ndarray) -> np.ndarray:
    """The middle of the acromia, from where it lies next to the middle of these two."""
    middle = 0.5 * (c7 + suprasternale)
    up = middle - waist
    ahead = suprasternale - c7
    ahead = ahead - (ahead @ up) / (up @ up) * up
    x, y = 0.5 * (_C7 + _SUPRASTERNALE)
    length = float(np.linalg.norm(up))
    return middle - length * x * ahead / np.linalg.norm(ahead) - y * up


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

    BadDataError: landmarks without which there is no skeleton are missing: all are named.
    """
    if missing := missing_landmarks(landmarks.keys()):
        raise BadDataError(
            f"no marker for {', '.join(missing)}",
            expected="at least one frame of the calibrating trial in which they are visible",
            remedy="name the markers that serve in a marker set (`bsip markers FILE` shows what "
            "the labels are taken for), or calibrate with another trial",
        )
    axes, middle, width = _pelvis(landmarks)
    _require_sides(landmarks, axes[:, 2])
    waist = middle + width * (axes @ _LJC[sex])
    landmarks, notes = _with_trunk(landmarks, waist, axes, sex, stature_m)
    if sex == OTHER:
        notes.insert(0, _MEAN_OF_BOTH)
    hips = hip_centres(landmarks, sex)
    assert hips is not None
    width, line, right = _thorax(landmarks, waist, stature_m, notes)
    part, angle = _CJC[sex]
    neck = landmarks["c7"] + part * width * _turned(line, right, angle)
    down = _SJC[0] * width * _turned(line, right, _SJC[1])
    sternum = landmarks.get("suprasternale", landmarks["c7"] + width * line)
    up = unit(neck - waist)
    thorax = np.stack([unit(np.cross(up, right)), up, right], axis=1)
    centres = {"waist": waist, "hip_r": hips["r"], "hip_l": hips["l"], "neck": neck}
    limbs = _Limbs(landmarks, sex, stature_m, centres, {}, {}, notes, [])
    for side, sign in (("l", -1.0), ("r", 1.0)):
        across = width * _SCJ * np.array([1.0, 1.0, sign])
        centres[f"sternoclavicular_{side}"] = sternum + thorax @ across
        raised = landmarks[f"acromion_{side}"] + down
        centres[f"shoulder_{side}"] = landmarks.get(f"shoulder_centre_{side}", raised)
        limbs.add_arm(side, sign * right, unit(waist - neck))
        for joint, name in (("knee", "knee"), ("ankle", "malleolus")):
            lateral, half_m = landmarks[f"{name}_lateral_{side}"], _HALF_BREADTH[name] * stature_m
            limbs.add_hinge(joint, name, side, lateral, sign * axes[:, 2], half_m)
        toes = _mean(landmarks, _toes(side))
        assert toes is not None
        limbs.ends[f"foot_{side}"] = toes
    if limbs.lateral_only:
        where = ", ".join(map(in_words, limbs.lateral_only))
        notes.append(f"lateral markers only: centres from the mean breadth at {where}")
    return JointCentres(centres, axes, limbs.hinges, limbs.ends, tuple(notes))


def breadth_m(landmark: str, stature_m: float) -> float:
    """The mean breadth at the joint of a lateral landmark."""
    return 2 * _HALF_BREADTH[landmark.partition("_")[0]] * stature_m


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


_OF_LEGS = ("knee_lateral", "malleolus_lateral", "calcaneus")
_REQUIRED = ("asis_l", "asis_r", *(f"{name}_{side}" for name in _OF_LEGS for side in "lr"))


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


def _require_sides(landmarks: Mapping[str, np.ndarray], right: np.ndarray) -> None:
    """Right-hand landmarks must lie to the right of left-hand ones, as the pelvis has it."""
    swapped = [
        in_words(name)
        for name in ("acromion", *_OF_LEGS)
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


def _thorax(
    landmarks: Mapping[str, np.ndarray], waist: np.ndarray, stature_m: float, notes: list[str]
) -> tuple[float, np.ndarray, np.ndarray]:
    """Width, direction from C7 to the suprasternale, and to the right."""
    c7 = landmarks["c7"]
    if "suprasternale" in landmarks:
        line = landmarks["suprasternale"] - c7
        right = unit(np.cross(line, c7 - waist))
        return float(np.linalg.norm(line)), unit(line), right
    notes.append("no suprasternale: thorax width and neck estimated from the stature")
    right = unit(landmarks["acromion_r"] - landmarks["acromion_l"])
    forward = unit(np.cross(c7 - waist, right))
    return _THORAX_WIDTH * stature_m, _turned(forward, right, _THORAX_SLOPE), right


@dataclass(frozen=True, eq=False)
class _Limbs:
    """Arms and legs, added side by side to what a :class:`JointCentres` holds."""

    landmarks: Mapping[str, np.ndarray]
    sex: str
    stature_m: float
    centres: dict[str, np.ndarray]
    hinges: dict[str, np.ndarray]
    ends: dict[str, np.ndarray]
    notes: list[str]
    lateral_only: list[str]  # joints

    def add_arm(self, side: str, outward: np.ndarray, down: np.ndarray) -> None:
        """What is missing hangs along ``down`` (3,), the trunk's unit vector, or goes on in a
        straight line."""
        shoulder, wrist = self.centres[f"shoulder_{side}"], self._wrist(side)
        lateral = self.landmarks.get(f"elbow_lateral_{side}")
        half_m = 0.0 if lateral is None else _HALF_BREADTH["elbow"] * self.stature_m
        upper, fore = (mean_length_m(self.sex, row, self.stature_m) for row in ("arm", "forearm"))
        if lateral is None and wrist is None:
            self.notes.append(
                f"no markers on the {in_words(f'arm_{side}')}: it hangs straight down"
            )
            lateral, wrist = shoulder + upper * down, shoulder + (upper + fore) * down
        elif lateral is None:
            assert wrist is not None
            self.notes.append(f"no marker on the {in_words(f'elbow_{side}')}: taken as straight")
            lateral = shoulder + upper / (upper + fore) * (wrist - shoulder)
        elif wrist is None:
            self.notes.append(
                f"no marker on the {in_words(f'wrist_{side}')}: the forearm goes on straight from "
                "the elbow, in its mean length"
            )
            wrist = lateral + fore * (lateral - shoulder) / np.linalg.norm(lateral - shoulder)
        if half_m:  # lateral is the normal of the arm's plane where it is bent, else the body's
            upwards = unit(shoulder - lateral)
            normal = np.cross(unit(lateral - wrist), upwards)
            outward = outward - (outward @ upwards) * upwards
            if np.linalg.norm(normal) < 0.35:  # less than about 20 degrees
                outward = unit(outward)
            else:
                outward = unit(normal) * np.sign(normal @ outward)
        self.centres[f"wrist_{side}"] = wrist
        self.add_hinge("elbow", "elbow", side, lateral, outward, half_m)
        hand = _mean(self.landmarks, tuple(f"metacarpal_{k}_{side}" for k in (2, 3, 5)))
        if hand is not None:
            self.ends[f"hand_{side}"] = hand

    def _wrist(self, side: str) -> np.ndarray | None:
        """The middle of the styloids; where only one marker sits on the wrist, that one."""
        names = (f"styloid_radial_{side}", f"styloid_ulnar_{side}")
        styloids = [self.landmarks[name] for name in names if name in self.landmarks]
        if len(styloids) == 2:
            return 0.5 * (styloids[0] + styloids[1])
        single = self.landmarks.get(f"wrist_{side}", styloids[0] if styloids else None)
        if single is not None:
            words = in_words(f"wrist_{side}")
            self.notes.append(f"the {words} has one marker only: taken as its centre")
        return single

    def add_hinge(
        self,
        joint: str,
        name: str,
        side: str,
        lateral: np.ndarray,
        outward: np.ndarray,
        half_m: float,
    ) -> None:
        """Between both landmarks; where the lateral one is alone, ``half_m`` inwards of it."""
        medial = self.landmarks.get(f"{name}_medial_{side}")
        centre, across = lateral - half_m * unit(outward), outward
        if medial is not None:
            centre, across = 0.5 * (lateral + medial), lateral - medial
        elif half_m:
            self.lateral_only.append(f"{joint}_{side}")
        self.centres[f"{joint}_{side}"] = centre
        self.hinges[f"{joint}_{side}"] = unit(across if side == "r" else -across)


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
