"""Positions as written against a person and a laboratory: the unit of length, how tall the person
is, which way is up, are left and right on their sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from bsip_cli.recordings.label_words import meanings
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.units import length_in_m, length_name

_PERSON_M = (0.25, 8.0)  # the markers' extent in one frame: a limb to two people
_ANYTHING_M = (0.02, 30.0)  # a clearly stated unit is doubted only beyond this
_FEWEST_MARKERS = 4  # that make a volume
_FASTEST_M_S = 15.0  # half of the markers, half of the time: a sprinter's
_SMOOTH = 0.2  # of the markers' distance from their middle: their second difference
_USUAL_M = 1.6
_INCH_M = 0.0254
_GUESSED_M = (1e-3, 1.0, 1e-2)  # mm, m, cm: what a file may be in that does not say it
_FEW = 100  # frames by which a stature is found
_LEAST, _MOST = 0.65, 1.5  # of the stated height: people sit, and markers sit on hats
_PEOPLE_M = (0.6, 2.4)  # from one year on
# The highest marker's distance from the feet over the stature, by the part that it sits on.
_PARTS = {"head": 0.96, "upper_torso": 0.85, "lower_torso": 0.61}
# 3.5 standard deviations of the pelvis of 13 people of known height in five public laboratories;
# heads and shoulders of 11 scatter by 1 % only, but a set's head markers may sit 6 % lower.
_STATURE_PERCENT = 11.0
_SHOULDERS = ("c7", "acromion")
_FLAT_M = 0.035  # of every marker of a foot over its own lowest
_UNITS_M = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "dm": 0.1, "ft": 0.3048, "m": 1.0}

_LOW = ("foot_l", "foot_r", "malleolus_lateral_l", "malleolus_lateral_r")
_HIGH = ("head", "upper_torso")
_CLEARLY_ABOVE_M = 0.2
_CLEAR_SHARE = 0.75  # of all marker positions on one side of the floor
_AXES = "XYZ"

_FEW_FRAMES = 50  # by which sides are found
_AHEAD_OF = {"legs": "pelvis", "arms": "trunk"}  # parts of `Handedness`
_CLEAR = 0.6  # sine of the angle from ahead to the right: 1 in a person who stands square

# What is in front and behind, and what has a left and a right one, by landmarks without sides.
_SIDED_PARTS = {
    "pelvis": (("asis",), ("psis", "sacrum"), ("asis", "psis")),
    "trunk": (("suprasternale", "xiphoid"), ("c7", "t10"), ("acromion",)),
    "head": (("forehead", "temple"), ("occiput",), ("forehead", "temple", "occiput")),
    "feet": (
        ("metatarsal_1", "metatarsal_2", "metatarsal_5"),
        ("calcaneus",),
        ("calcaneus", "metatarsal_1", "metatarsal_2", "metatarsal_5"),
    ),
    "legs": (("asis",), ("psis", "sacrum"), ("knee_lateral",)),
    "arms": (("suprasternale", "xiphoid"), ("c7", "t10"), ("elbow_lateral",)),
}

# Ends of segments: the distance between them changes less than that to the other side's other end.
# In 71 pairs of public trials that move by 50 mm (in six tenths of all frames) it changes by 0.36
# of that at most, from pelvis to knee, which no segment joins, by 1.7 times (squats).
_LIMBS = {
    "thighs": ("asis", "knee_lateral"),
    "shanks": ("knee_lateral", "malleolus_lateral"),
    "upper arms": ("acromion", "elbow_lateral"),
    "forearms": ("elbow_lateral", "styloid_radial"),
}
_CHANGES_M, _TIMES = 0.05, 2.0


# --- the unit of length ---------------------------------------------------------------------------


def decided_unit(
    positions: np.ndarray, labels: Sequence[str], stated: str, name: str
) -> tuple[float, list[Finding]]:
    """Size of the unit in metres, and a finding where the file's statement cannot be taken.

    ``positions`` (n_frames, n_markers, 3) as written, NaN = missing; ``stated`` is the file's
    word and ``name`` its place. The stature by the labels decides: a stated unit must make
    a person, else the one does that makes a person most like others. Of markers that show no
    stature their extent decides, where it fits a person in another unit only.
    """
    stated_m = length_in_m(stated)
    is_plain = stated.strip().lower() in map(length_name, _GUESSED_M)
    if (tall := height_m(by_segment(labels, positions))) is not None:
        sizes, size, (low, high) = [*_GUESSED_M, _INCH_M], tall, _PEOPLE_M
        (least, most), seen = _PEOPLE_M, f"are those of a person {tall:.4g} of it tall"
    else:
        sizes, size, (low, high) = [*_GUESSED_M], _extent(positions), _PERSON_M
        (least, most), seen = _ANYTHING_M, f"span {size:.4g} of it"
    fitting = [one for one in sizes if low <= size * one <= high]
    if stated_m is not None and (least <= size * stated_m <= most or not fitting):
        unit_m, is_said = stated_m, not is_plain
    elif tall is not None:
        usual = [abs(np.log(tall * one / _USUAL_M)) for one in fitting]
        unit_m, is_said = fitting[int(np.argmin(usual))] if fitting else 1e-3, True
    else:
        otherwise = 1e-3 if size > _PERSON_M[1] else 1.0
        unit_m, is_said = fitting[0] if fitting else otherwise, True
    found, expected = (
        f"{name} '{stated}', and the markers {seen}",
        "m or mm, and the size of a person",
    )
    action = f"read lengths in {length_name(unit_m)}"
    about = Finding("unit", "points", found, expected, action, "corrected")
    return unit_m, [about] if is_said else []


def move_like_markers(positions_m: np.ndarray, rate_hz: float) -> bool:
    """Whether positions (n_frames, n_markers, 3) can only be those of markers on a person.

    They are as far apart as a person is large, no two at one place, change from frame to frame,
    no faster than people, and smoothly. Numbers that are none, or left from another trial's
    memory, do not.
    """
    known = np.isfinite(positions_m).all(axis=-1)
    if len(known) < 3 or not _PERSON_M[0] <= _extent(positions_m) <= _PERSON_M[1]:
        return False
    middle = np.nanmedian(positions_m[known.any(axis=1)], axis=0)
    middle = middle[np.isfinite(middle).all(axis=1)]
    if len(np.unique(middle, axis=0)) < max(len(middle), _FEWEST_MARKERS):
        return False
    steps = np.diff(positions_m, axis=0)
    size, bend = (np.linalg.norm(x, axis=-1) for x in (steps, np.diff(steps, axis=0)))
    size, bend = size[np.isfinite(size)], bend[np.isfinite(bend)]
    if not len(bend) or (size > 0).mean() < 0.5:
        return False
    spread = float(np.median(np.linalg.norm(middle - middle.mean(axis=0), axis=1)))
    return bool(np.median(size) * rate_hz < _FASTEST_M_S and np.median(bend) < _SMOOTH * spread)


def _extent(positions: np.ndarray) -> float:
    """Median over the frames of the largest side of the markers' box; NaN if there are few."""
    known = np.isfinite(positions).all(axis=-1)
    enough = np.flatnonzero(known.sum(axis=1) >= _FEWEST_MARKERS)
    some = enough[:: max(1, len(enough) // 200)]
    sides = [np.ptp(positions[k, known[k]], axis=0).max() for k in some]
    return float(np.median(sides)) if sides else float("nan")


# --- how tall the person is -----------------------------------------------------------------------


def by_segment(labels: Sequence[str], markers: np.ndarray) -> dict[str, np.ndarray]:
    """The markers (n_frames, n_markers, 3) of each segment, by what their labels mean."""
    known = meanings(labels)
    columns: dict[str, list[int]] = {}
    for k, label in enumerate(labels):
        if label in known:
            columns.setdefault(known[label].segment, []).append(k)
    return {segment: markers[:, some] for segment, some in columns.items()}


def height_m(markers_m: Mapping[str, np.ndarray]) -> float | None:
    """From a trial's markers (n_frames, k, 3) per segment: the longest way from the feet to the
    highest part that is seen, nearly always; None without feet or trunk."""
    feet = [markers_m[name] for name in ("foot_l", "foot_r") if name in markers_m]
    part = next((name for name in _PARTS if name in markers_m), None)
    if not feet or part is None:
        return None
    low = np.concatenate(feet, axis=1)
    step = max(1, len(low) // _FEW)
    gaps = markers_m[part][::step, :, None] - low[::step, None]
    distance = np.linalg.norm(gaps, axis=-1).reshape(len(gaps), -1)
    seen = distance[np.isfinite(distance).any(axis=1)]
    return float(np.percentile(np.nanmax(seen, axis=1), 90)) / _PARTS[part] if len(seen) else None


@dataclass(frozen=True)
class Stature:
    """How tall the markers make a person who stands on flat feet, by the highest ``part``."""

    height_m: float
    part: str

    @classmethod
    def of_all(cls, trials: Sequence[Stature | None]) -> Stature | None:
        """Median over those by the part that shows it best; None without any."""
        told = [one for one in trials if one is not None]
        part = next((name for name in _PARTS if any(one.part == name for one in told)), None)
        heights = [one.height_m for one in told if one.part == part]
        return cls(float(np.median(heights)), part) if part is not None else None

    def against(self, stated_m: float) -> tuple[str, str, str] | None:
        """What was found, what was expected, what to do; None where markers cannot
        distinguish both."""
        percent = 100.0 * (self.height_m / stated_m - 1.0)
        if abs(percent) <= _STATURE_PERCENT:
            return None
        return (
            f"stated is a height of {stated_m:.2f} m, and the markers are those of a person "
            f"{self.height_m:.2f} m tall ({percent:+.0f} %)",
            f"the same to {_STATURE_PERCENT:.0f} %, by markers on the "
            f"{self.part.replace('_', ' ')} and the feet of people who stand",
            "took the stated one; correct height_m, or the unit and the labels of the markers",
        )


def stature(labels: Sequence[str], markers_m: np.ndarray) -> Stature | None:
    """From a trial's markers (n_frames, n_markers, 3), world frame; None where nobody stands with a
    foot flat on the ground, or no part is known whose height people share."""
    known = meanings(labels)
    by_part = by_segment(labels, markers_m)
    if not any(m.landmark.startswith(_SHOULDERS) for m in known.values()):
        by_part.pop("upper_torso", None)
    part = next((name for name in _PARTS if name in by_part), None)
    feet = [by_part[name] for name in ("foot_l", "foot_r") if name in by_part]
    if part is None or not feet:
        return None
    tall = [np.zeros(0)]
    for foot in feet:
        foot = foot[:, np.isfinite(foot).all(axis=-1).any(axis=0)]
        if not foot.size:
            continue
        lift = foot[..., 2] - np.nanpercentile(foot[..., 2], 2, axis=0)
        frames = np.flatnonzero((lift < _FLAT_M).all(axis=1))
        frames = frames[:: max(1, len(frames) // _FEW)]
        if len(frames):
            ways = by_part[part][frames, :, None] - foot[frames, None]
            tall.append(np.linalg.norm(ways, axis=-1).reshape(len(frames), -1).max(axis=1))
    found = np.concatenate(tall)
    found = found[np.isfinite(found)]
    return Stature(float(np.percentile(found, 90)) / _PARTS[part], part) if len(found) else None


def no_person(height_m: float, stated_m: float | None) -> tuple[str, str, str] | None:
    """What was found, what was expected, what to do; None where it may be a person."""
    low, high = _PEOPLE_M if stated_m is None else (_LEAST * stated_m, _MOST * stated_m)
    if low <= height_m <= high:
        return None
    expected = "0.6 to 2.4 m" if stated_m is None else f"the stated {stated_m:.2f} m"
    wanted = (stated_m or 1.7) / height_m
    pairs = {
        f"{one} for {other}": abs(np.log(_UNITS_M[one] / _UNITS_M[other] / wanted))
        for one, other in permutations(_UNITS_M, 2)
    }
    near = min(pairs, key=pairs.__getitem__)
    cause = "correct the unit of length in the recordings, or the height in participants.tsv"
    if pairs[near] < np.log(1.2):
        cause += f" (it looks like {near})"
    return f"markers of a person {height_m:.2f} m tall", expected, cause


# --- which way is up ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Up:
    """The vertical as a signed lab axis, and what it was read from."""

    axis: int  # 0, 1, 2
    sign: int  # +1 or -1
    reason: str

    @property
    def name(self) -> str:
        return ("+" if self.sign > 0 else "-") + _AXES[self.axis]


def up_from_surface(
    normals: np.ndarray, points_on_floor_m: np.ndarray, markers_m: np.ndarray
) -> Up | None:
    """The lab axis nearest to the floor's normal, its sign from the markers above the floor.

    ``normals`` (n, 3) of either sign, ``points_on_floor_m`` (n, 3), ``markers_m``
    (n_frames, n_markers, 3), all in the lab frame. None if nothing shows the sign.
    """
    axis = int(np.argmax(np.abs(normals).sum(axis=0)))
    seen = markers_m[np.isfinite(markers_m).all(axis=-1)]
    if not len(seen) or not np.isfinite(points_on_floor_m[:, axis]).any():
        return None
    above = float(np.mean(seen[:, axis] > np.nanmedian(points_on_floor_m[:, axis])))
    if 1 - _CLEAR_SHARE < above < _CLEAR_SHARE:
        return None
    return Up(axis, 1 if above > 0.5 else -1, "the markers lie above the force plates")


def up_from_labels(labels: Sequence[str], markers_m: np.ndarray) -> Up | None:
    """From the feet to trunk and head, by what the labels say."""
    understood, middles = meanings(labels), []
    for places in (_LOW, _HIGH):
        chosen = [
            i
            for i, label in enumerate(labels)
            if (m := understood.get(label)) and (m.segment in places or m.landmark in places)
        ]
        points = markers_m[:, chosen].reshape(-1, 3)
        middles.append(points[np.isfinite(points).all(axis=1)])
    if not all(map(len, middles)):
        return None
    rise = np.median(middles[1], axis=0) - np.median(middles[0], axis=0)
    axis = int(np.argmax(np.abs(rise)))
    sideways = np.delete(np.abs(rise), axis).max()
    if abs(rise[axis]) < max(_CLEARLY_ABOVE_M, 2 * sideways):
        return None
    return Up(axis, 1 if rise[axis] > 0 else -1, "the feet lie below head and trunk")


def up_from_name(name: str) -> Up | None:
    """From POINT:Y_SCREEN, whose sign laboratories use either way: only the axis counts."""
    letter = name.strip().upper()[-1:]
    return Up(_AXES.index(letter), 1, "POINT:Y_SCREEN") if letter and letter in _AXES else None


def rotation_to_z_up(up: Up) -> np.ndarray:
    """Proper rotation world <- lab, (3, 3), that sends ``up`` to +Z and keeps X where it can."""
    z = np.where(np.arange(3) == up.axis, float(up.sign), 0.0)
    x = np.eye(3)[1 if up.axis == 0 else 0]
    return np.array([x, np.cross(z, x), z])


def findings_about(up: Up, of_forces: Up) -> list[Finding]:
    """A line for the quality table if the lab frame was not Z-up, or that of the forces another."""
    if up.axis != of_forces.axis:
        found = f"the forces point along {of_forces.name}, and the body stands along {up.name}"
        action, expected = "turned both axes Z-up, each in its own way", "one laboratory frame"
        return [Finding("up_axis", "forces", found, expected, action, "corrected")]
    if up.axis == 2 and up.sign > 0:
        return []
    found, action = f"the lab's vertical is {up.name}: {up.reason}", "turned the lab frame Z-up"
    return [Finding("up_axis", "", found, "+Z", action, "corrected")]


# --- left and right -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Handedness:
    """Sine of the angle from ahead to the right, from above, by part of the body; -1: mirrored."""

    parts: Mapping[str, float]

    @property
    def sign(self) -> int:
        """-1 if every part that is clear has left and right exchanged, and at least two that know
        by themselves what is ahead, 1 if none has; else 0."""
        clear = self._clear()
        signs = np.sign(list(clear.values()))
        witnesses = {_AHEAD_OF.get(name, name) for name in clear}
        alike = len(witnesses) >= 2 and np.ptp(signs) == 0
        return int(signs[0]) if alike else 0

    def exchanged(self) -> list[str]:
        """Parts with left and right exchanged, where not all have."""
        wrong = [name for name, value in self._clear().items() if value < 0]
        return [] if self.sign < 0 else wrong

    def _clear(self) -> dict[str, float]:
        """Without those that do not stand square: feet one before the other."""
        return {name: value for name, value in self.parts.items() if abs(value) > _CLEAR}

    @classmethod
    def of_all(cls, trials: Sequence[Handedness]) -> Handedness:
        """Median over the trials."""
        names = dict.fromkeys(name for trial in trials for name in trial.parts)
        return cls(
            {n: float(np.median([t.parts[n] for t in trials if n in t.parts])) for n in names}
        )


def handedness(labels: Sequence[str], markers_m: np.ndarray) -> Handedness:
    """Of a trial's markers (n_frames, n_markers, 3), world frame, by what their labels mean."""
    known = _landmarks(labels)
    frames = markers_m[:: max(1, len(markers_m) // _FEW_FRAMES)]

    def mean(names: Sequence[str]) -> np.ndarray:
        there = [known[name] for name in names if name in known]
        return frames[:, there, :2].mean(axis=1) if there else np.full((len(frames), 2), np.nan)

    found = {}
    for part, (front, back, sides) in _SIDED_PARTS.items():
        ends = (
            [name + side for name in names for side in ("", "_l", "_r")] for names in (front, back)
        )
        ahead = np.subtract(*map(mean, ends))
        both = [n for n in sides if f"{n}_l" in known and f"{n}_r" in known]
        right = np.subtract(*(mean([f"{n}_{side}" for n in both]) for side in "rl"))
        sine = ahead[:, 1] * right[:, 0] - ahead[:, 0] * right[:, 1]
        sine = sine / (np.linalg.norm(ahead, axis=1) * np.linalg.norm(right, axis=1))
        if np.isfinite(sine).any():
            found[part] = float(np.nanmedian(sine))
    return Handedness(found)


def crossed_limbs(labels: Sequence[str], markers_m: np.ndarray) -> list[str]:
    """Segments of markers (n_frames, n_markers, 3) whose ends keep their distance from those of the
    other side, and not from each other."""
    known, found = _landmarks(labels), []

    def change_m(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.ptp(np.percentile(np.linalg.norm(one - other, axis=-1), [20, 80])))

    for limb, ends in _LIMBS.items():
        names = [f"{end}_{side}" for end in ends for side in "lr"]
        if not all(name in known for name in names):
            continue
        places = markers_m[:, [known[name] for name in names]]
        places = places[np.isfinite(places).all(axis=(1, 2))]
        if not len(places):
            continue
        upper_l, upper_r, lower_l, lower_r = places.swapaxes(0, 1)
        own = max(change_m(upper_l, lower_l), change_m(upper_r, lower_r))
        other = max(change_m(upper_l, lower_r), change_m(upper_r, lower_l))
        if own > max(_CHANGES_M, _TIMES * other):
            found.append(limb)
    return found


def _landmarks(labels: Sequence[str]) -> dict[str, int]:
    meant = meanings(labels)
    return {meant[n].landmark: k for k, n in enumerate(labels) if n in meant}
