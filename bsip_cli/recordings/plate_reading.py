"""How a file is understood, as it says or as proves true: the numbers of one plate, and the
laboratory's axes against those of the person; and plates before that is decided."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, combinations
from typing import Literal, Protocol

import numpy as np
from scipy.linalg import block_diag
from scipy.ndimage import gaussian_filter1d

from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plates import CHANNELS, CHANNELS_OF, cop_at_height
from bsip_cli.recordings.written import AS_WRITTEN, Lengths, Written

Reference = Literal["stated", "reversed", "centred", "origin", "fixed"]
Moved = Literal["", "all", "markers", "forces"]

# Natural logarithms of how often a laboratory's files need a repair, beside being as they say. Only
# their order of magnitude counts: one in thirty for units, which exporters confuse most, one in a
# hundred for a reference point or a turned plate, one in five hundred for corners the other way
# round (none of 157 plates of 20 laboratories).
_SCALED, _OTHER_POINT, TURNED, MIRRORED = -3.4, -4.6, -4.6, -6.2
# Of moments: units as N cm, N dm or kgf m, seldom seen, beside N m and N mm.
RARE_SCALES, _RARELY_SCALED = (1e-2, 1e-1, 1e1, 1e2), -4.6
# Without the forces, or these without the moments, or one channel; two that are exchanged.
_MOMENTS_REVERSED = -6.2
_BOTH_REVERSED = -float(np.log(2))  # rather than one of them
_TWO_OF_SENSORS = -float(np.log(28))  # which of eight, nothing says beforehand
REVERSED = -2.3  # the action on the plate: one in ten
EXCHANGED = -5.3  # two plates
ONE_ALONE = -0.7  # one plate of several: what goes wrong, goes wrong for all more often
OTHER_GAIN = _MOMENTS_REVERSED + ONE_ALONE  # of one plate, as rare as another fault of its numbers

_ODD = -2.3  # of ten frames that are turned one is so by no multiple of 90 degrees
_IN_PART = -2.3  # markers or forces alone are mirrored more rarely than both: one in ten


@dataclass(frozen=True)
class PlateReading:
    """What is done to a plate's numbers; the defaults take them as the file says.

    Attributes
    ----------
    moment_scale, point_scale : what moments and points are multiplied with; of a plate of type 1
        the first counts for the vertical moment, its sign for the points too.
    about : what moments are about. "stated": what the file says, in a MOT the point; "reversed" and
        "centred": ORIGIN the other way or without its part along the surface; "origin": the lab's
        origin; "fixed": one point, ``centre_m``, for all samples.
    turn : the corners are moved on by so many places (each 90 degrees).
    mirrored : the corners are taken in the other direction round.
    sign : -1 where the numbers are the action on the plate.
    place_of : the plate whose place (C3D), or points (MOT), belong to this one's force and moment.
    channels : what is wrong with single channels, as written: "reversed" and one name or two,
        "exchanged" and two; "" if nothing. Names are CHANNELS, or a plate's own where they differ.
    half_size_m : half the outline's sides where the stated outline is too small.
    """

    moment_scale: float = 1.0
    point_scale: float = 1.0
    about: Reference = "stated"
    centre_m: tuple[float, float, float] | None = None
    turn: int = 0
    mirrored: bool = False
    sign: int = 1
    place_of: str = ""
    channels: str = ""
    half_size_m: tuple[float, float] | None = None

    def repairs(self) -> dict[tuple[object, ...], float]:
        """Each, by what it is, and how rare it is, natural logarithm."""
        both = self.channels.startswith("reversed") and " and " in self.channels
        sensors = any(name in CHANNELS_OF[3] for name in self.channels.split())
        of_channels = _MOMENTS_REVERSED + _BOTH_REVERSED * both + _TWO_OF_SENSORS * sensors
        each = {
            ("moments", scale := abs(self.moment_scale)): (
                _RARELY_SCALED if scale in RARE_SCALES else _SCALED * (scale != 1.0)
            ),
            ("points", self.point_scale): _SCALED * (self.point_scale != 1.0),
            ("signs", self.moment_scale < 0): _MOMENTS_REVERSED * (self.moment_scale < 0),
            ("channels", self.channels): of_channels * bool(self.channels),
            ("about", self.about): _OTHER_POINT * (self.about != "stated"),
            ("corners", self.turn, self.mirrored): (
                MIRRORED if self.mirrored else TURNED * (self.turn != 0)
            ),
        }
        return {what: rare for what, rare in each.items() if rare}

    def channel_matrix(self, names: Sequence[str] = CHANNELS) -> np.ndarray:
        """To what the channels of these names are from what is written as such, (k, k)."""
        right = np.eye(len(names))
        named = [k for k, name in enumerate(names) if name in self.channels.split()]
        is_sign = self.channels.startswith("reversed")
        right[named] = -right[named] if is_sign else right[named[::-1]]
        return right

    def measured_matrix(self, kind: int) -> np.ndarray:
        """The same of what a plate of a C3D has measured (`plates.measured`), (k, k), where its own
        channels are no forces and moments of the whole plate."""
        if kind == 1:
            points = np.sign(self.moment_scale) * self.point_scale * self.channel_matrix(POINT)
            return np.asarray(block_diag(np.eye(3), np.kron(points, np.eye(3)), self.moment_scale))
        own = CHANNELS_OF[kind]
        return np.eye(len(own)) if own == CHANNELS else self.channel_matrix(own)

    def in_units(self, moments: float, points: float) -> PlateReading:
        """With numbers of another size, of the same sign."""
        sign = -1.0 if self.moment_scale < 0 else 1.0
        return replace(self, moment_scale=sign * moments, point_scale=points)

    def words(self) -> str:
        """What was done about units, reference and axes, as one clause; empty if nothing."""
        done = [
            _MOMENT_SCALES.get(abs(self.moment_scale), ""),
            "reversed the moments against the forces" * (self.moment_scale < 0),
            _POINT_SCALES.get(self.point_scale, ""),
            _ABOUT[self.about],
            self.channels,
            f"exchanged its place with that of {self.place_of}" * bool(self.place_of),
            "took the corners in the other direction round" * self.mirrored,
            f"turned the plate's axes by {90 * self.turn} degrees" * bool(self.turn),
        ]
        return ", ".join(filter(None, done))


AS_STATED = PlateReading()
POINT = ("Px", "Py")
ALIKE = dict.fromkeys((2, 4), (CHANNELS[:3], CHANNELS[3:])) | {
    1: (CHANNELS[:3], CHANNELS[3:], POINT),
    3: (CHANNELS[:2], CHANNELS[3:5], CHANNELS_OF[3]),
}


def faults_of_channels(alike: Sequence[Sequence[str]]) -> list[str]:
    """One of CHANNELS reversed, or both level forces; any two that are alike exchanged."""
    pairs = (pair for names in alike for pair in combinations(names, 2))
    level = alike[0][:2]
    return [
        f"reversed {level[0]} and {level[1]}",
        *(f"reversed {name}" for name in CHANNELS),
        *(f"exchanged {one} and {other}" for one, other in pairs),
    ]


_MOMENT_SCALES = {
    1e-3: "read the moments in N mm",
    1e3: "read the moments in N m, a thousand times what their unit says",
} | {scale: f"read the moments as {scale:g} times what their unit says" for scale in RARE_SCALES}
_POINT_SCALES = {
    1e-3: "read the points of force in mm",
    1e-2: "read the points of force in cm",
    1e1: "read the points of force in cm",
    1e3: "read the points of force in m",
}
_ABOUT = {
    "stated": "",
    "reversed": "reversed ORIGIN",
    "centred": "took ORIGIN for a place in the laboratory and the moments about the plate's centre",
    "origin": "took the moments about the laboratory's origin, the points for centres of pressure",
    "fixed": "took the moments about one point of the plate, the points for centres of pressure",
}


# --- axes -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FrameChange:
    """What of a session is written in other axes than it should be, and how these are changed: a
    horizontal ``axis`` reversed or, where ``turned_deg`` is not 0, a turn about the vertical, of
    which the standard deviation is ``turned_sd_deg``; by it a centre of pressure may be off by
    ``unsure_m``, in 19 of 20.

    corners_only : of a C3D the channels were not mirrored with the plates' corners.
    """

    moved: Moved = ""
    axis: int = 0
    turned_deg: float = 0.0
    turned_sd_deg: float = 0.0
    unsure_m: float = 0.0
    corners_only: bool = False

    @property
    def moves_markers(self) -> bool:
        return self.moved in ("all", "markers")

    @property
    def moves_forces(self) -> bool:
        return self.moved in ("all", "forces")

    def matrix(self) -> np.ndarray:
        """From the axes as written to those of the person, (3, 3)."""
        if self.turned_deg:
            c, s = np.cos(np.deg2rad(self.turned_deg)), np.sin(np.deg2rad(self.turned_deg))
            return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return np.diag([-1.0 if k == self.axis else 1.0 for k in range(3)])

    def of_markers(self) -> tuple[bool, int]:
        """What is done to the markers."""
        return self.moves_markers, self.axis * self.moves_markers

    def log_prior(self) -> float:
        if self.moved == "forces":
            turned = TURNED + _ODD * (self.turned_sd_deg > 0)
            return turned if self.turned_deg else MIRRORED
        return _IN_PART if self.moved == "markers" else 0.0

    def words(self) -> str:
        """What is done, as a clause; empty if nothing."""
        if not self.moved:
            return ""
        what = {"all": "markers and forces", "markers": "the markers", "forces": "the forces"}
        if self.turned_deg:
            sd = f" +- {self.turned_sd_deg:.2g}" if self.turned_sd_deg else ""
            return (
                f"turned {what[self.moved]} by {self.turned_deg:.4g}{sd} degrees about the vertical"
            )
        return f"reversed the {'XY'[self.axis]} axis of {what[self.moved]}"


MIRRORS = (
    FrameChange("all"),
    FrameChange("all", corners_only=True),
    FrameChange("markers", 0),
    FrameChange("markers", 1),
)
FORCES_MOVED = (
    *(FrameChange("forces", axis) for axis in (0, 1)),
    *(FrameChange("forces", turned_deg=turn) for turn in (90.0, 180.0, 270.0)),
)


# --- one plate of one recording -------------------------------------------------------------------


# Of the force: what makers state for a plate's linearity and cross talk. A copy or a sum is the
# same reading and differs by rounding; the loads of two feet differ by tens of per cent mostly.
_SAME, _MOSTLY = 0.01, 0.9
# Filtered, it differs by more; but no two plates are loaded at one place. The median distance of
# centres of pressure was 93 mm at least for 66 pairs of plates in public (kyowadengyo.c3d), 222 mm
# for all others. Once both are averaged, a 6 Hz low pass of all columns moves it by 0.1 to 3 mm, in
# running by 10 to 19 mm, and forces by 3 % at most, in the median.
# As the units may be wrong, it must be less than the centre of pressure itself spreads by.
_SAME_PLACE_M, _NEARLY, _MEETS = 0.03, 0.1, 0.75
_BEARS = 0.05
_MOST_TERMS = 4  # of a sum


class PlateSource(Protocol):
    """What every format's plate can say of itself; arrays are at the analog rate."""

    @property
    def name(self) -> str: ...

    @property
    def usable(self) -> np.ndarray:
        """Samples that can be believed, (n,) bool."""

    def parts(self) -> np.ndarray:
        """What every reading combines linearly, (n, k)."""

    def matrix(self, reading: PlateReading) -> np.ndarray:
        """From the parts to the wrench about the world's origin, world frame, (6, k)."""

    def at(self, samples: np.ndarray) -> PlateSource:
        """These samples alone."""

    def later(self, by: int) -> PlateSource:
        """Each sample's ``by``-th after it, not usable where there is none."""

    def smoothed(self, sigma: float) -> PlateSource:
        """Averaged with a bell of a standard deviation of so many samples."""

    def plate(self, reading: PlateReading) -> Plate:
        """In the world frame."""

    def level_matrices(self, reading: PlateReading) -> tuple[np.ndarray, np.ndarray] | None:
        """From the parts to the horizontal moment at the points that the file calls centres of
        pressure, as read and as written, (2, k) each; None where it names no such points."""

    def lever_m(self, reading: PlateReading) -> np.ndarray | None:
        """How far from the sensor, or from the origin of its points, the force is, (n,); None where
        there is neither."""

    def sensors_log_likelihood(self, reading: PlateReading) -> float:
        """How likely a plate's single sensors share its load so, logarithm; 0 without any."""

    def in_place_of(self, other: PlateSource) -> PlateSource:
        """This force where the other one is."""

    def floor_m(self, reading: PlateReading = AS_STATED) -> float:
        """Height of the surface, world frame."""

    def scaled(self, times: float) -> PlateSource:
        """So many times the force and moment."""

    def moved(self, change: np.ndarray, corners_only: bool = False) -> PlateSource:
        """In other axes of the world (3, 3), turned or as if seen in a mirror; what channels hold
        is mirrored too unless ``corners_only``."""

    def alternatives(self) -> Iterable[PlateReading]:
        """Other ways to understand the numbers, sign and size of the outline aside."""

    def findings(self, reading: PlateReading) -> list[Finding]:
        """What is to be said of this reading beyond its words."""


def later_samples(n: int, by: int | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ``by``-th after each of n samples, the nearest one where there is none, and where."""
    samples = np.arange(n) + by
    return samples.clip(0, n - 1), (samples >= 0) & (samples < n)


def lift_N(source: PlateSource) -> np.ndarray:
    """Vertical force as the file says, world frame, (n,)."""
    return np.asarray(source.parts() @ source.matrix(AS_STATED)[2])


@dataclass(frozen=True, eq=False)
class Opened:
    """A recording as its file has it, before it is decided how its plates' numbers are understood:
    ``recording`` is without its plates. ``lengths`` where markers and forces have a file each, and
    ``reread`` to open these otherwise than they say."""

    recording: Recording
    sources: tuple[PlateSource, ...]
    lengths: Lengths | None = None
    reread: Callable[[Written], Opened] | None = None

    def as_written(self, written: Written) -> Opened:
        """With forces in another unit and cameras of another rate than the files say."""
        return self.reread(written) if self.reread and written != AS_WRITTEN else self

    def with_plates(self, numbers: Collection[int]) -> Opened:
        """Only plates of these numbers; without any, all."""
        names = set(map(str, numbers))
        chosen = (source for source in self.sources if not names or source.name in names)
        return replace(self, sources=tuple(chosen))

    def with_forces_from(self, delay_s: float) -> Opened:
        """With the forces of so much later, of a clock that came late."""
        by = round(delay_s * self.recording.analog_rate_hz)
        return replace(self, sources=tuple(one.later(by) for one in self.sources)) if by else self

    def with_gains(self, gains: Mapping[str, float]) -> Opened:
        """What plates of these names read over the gain of each."""
        scaled = (one.scaled(1 / gains.get(one.name, 1.0)) for one in self.sources)
        return replace(self, sources=tuple(scaled)) if gains else self

    def in_frame(self, change: FrameChange) -> Opened:
        """In other axes."""
        recording, sources, matrix = self.recording, self.sources, change.matrix()
        if change.moves_markers:
            recording = replace(recording, markers_m=recording.markers_m @ matrix.T)
        if change.moves_forces:
            sources = tuple(one.moved(matrix, change.corners_only) for one in sources)
        return replace(self, recording=recording, sources=sources)


def in_lab(change: np.ndarray, rotation_world_lab: np.ndarray) -> np.ndarray:
    """A change of the world's axes, as one of the lab's, (3, 3)."""
    return np.asarray(rotation_world_lab.T @ change @ rotation_world_lab)


def averaged(values: np.ndarray, usable: np.ndarray, sigma: float) -> np.ndarray:
    """Averaged over samples (n, k), with nothing where they are not usable."""
    known = np.where(usable[:, None], np.nan_to_num(values), 0.0)
    return np.asarray(gaussian_filter1d(known, sigma, axis=0, mode="nearest"))


# --- plates that are copies or sums of others, as treadmills and virtual plates export them -------


def repeated_plates(
    trials: Sequence[Mapping[str, PlateSource]], smooth: Sequence[Mapping[str, PlateSource]]
) -> dict[str, tuple[str, ...]]:
    """Names of plates whose force is that of another, or the sum of others, in every trial: as
    large, or, averaged by a bell (``smooth``), at the same place.

    Fewer terms are tried first, so that each is needed; of two copies the later one repeats. Forces
    push, whichever way the plate lies and its signs are.
    """
    repeated: dict[str, tuple[str, ...]] = {}
    wrenches, smoothed = (
        [{name: _pushing(source) for name, source in trial.items()} for trial in some]
        for some in (trials, smooth)
    )
    floors_m = {name: source.floor_m() for trial in trials for name, source in trial.items()}
    names = list(floors_m)
    for name in reversed(names):
        others = [n for n in names if n != name and n not in repeated]
        earlier = [n for n in others if names.index(n) < names.index(name)]
        at_place = partial(_is_at_place, floor_m=floors_m[name])
        for seen, is_sum in ((wrenches, _is_as_large), (smoothed, at_place)):
            sums = (combinations(others, n) for n in range(2, min(len(others), _MOST_TERMS) + 1))
            possible = chain(combinations(earlier, 1), *sums)
            found = (some for some in possible if is_sum(*_own_and_sum(seen, name, some)))
            if name not in repeated and (terms := next(found, None)) is not None:
                repeated[name] = terms
    return repeated


def _pushing(source: PlateSource) -> np.ndarray:
    """The wrench about the world's origin as the file says, of the sign that pushes up, (n, 6);
    NaN where it cannot be believed."""
    wrench = source.parts() @ source.matrix(AS_STATED).T
    usable = np.where(source.usable, np.where(wrench[:, 2] < 0, -1.0, 1.0), np.nan)
    return np.asarray(wrench * usable[:, None])


def _own_and_sum(
    trials: Sequence[Mapping[str, np.ndarray]], name: str, terms: Sequence[str]
) -> tuple[np.ndarray, float]:
    """A plate's wrench and the sum of others', (2, n, 6), where some bear load in the trials that
    have them all; from which force [N] on they do."""
    common = [trial for trial in trials if name in trial and all(t in trial for t in terms)]
    own = [np.concatenate([t[n] for t in common] or [np.zeros((0, 6))]) for n in (name, *terms)]
    wrenches = np.stack(own)
    wrenches = wrenches[:, np.isfinite(wrenches[..., 2]).all(axis=0)]
    forces = wrenches[..., 2]
    # Plates that bear nothing are alike; a few samples may be damaged on one of them.
    least = _BEARS * forces.max(initial=0.0)
    wrenches = wrenches[:, forces.max(axis=0) > least]
    return np.stack([wrenches[0], wrenches[1:].sum(axis=0)]), least


def _gap(both: np.ndarray, least_N: float) -> np.ndarray:
    """Of the forces, as a part of the plate's own, (n,)."""
    own_N, sum_N = both[..., 2]
    return np.asarray(np.abs(own_N - sum_N) / own_N.clip(min=least_N))


def _is_as_large(both: np.ndarray, least_N: float) -> bool:
    return bool(both.any() and np.mean(_gap(both, least_N) < _SAME) > _MOSTLY)


def _is_at_place(both: np.ndarray, least_N: float, floor_m: float) -> bool:
    """And nearly as large: plates whose corners are stated as the same have loads of their own."""
    bears = (both[..., 2] > least_N).all(axis=0)
    if not bears.any():
        return False
    one, other = cop_at_height(both[..., :3], both[..., 3:], floor_m)
    low, high = np.percentile(one[bears], (16, 84), axis=0)
    near_m = min(_SAME_PLACE_M, 0.5 * float(np.hypot(*(high - low))))
    there = bears & (np.hypot(*(one - other).T) < near_m)
    return bool(np.mean(there & (_gap(both, least_N) < _NEARLY)) > _MEETS)
