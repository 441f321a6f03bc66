"""Do these forces carry and drive this body? Newton and Euler for the whole of it.

The sum of all plates' wrenches is the rate of the body's momentum, linear and angular, which the
markers tell. Horizontal forces go with the acceleration of the centre of mass, moments about it
with the rate of the angular momentum. In complete stretches of 50 sound public recordings the
forces correlate by 0.5 to 0.99 in movement (median 0.9), moments about level axes by 0.4 to 0.97,
about the vertical by 0 to 0.9, and none clearly below zero over a second or more.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.names import without_side
from bsip_cli.recordings.momentum_mass import NEIGHBOUR, shares_of_seen

SMOOTH_S = 0.04
"""Standard deviation of the bell that forces and markers alike are averaged with: 3 Hz."""

_MOST_OF_IT = 0.5  # of the body's mass
_OFTEN = 0.9  # of the frames
_FEWEST_FRAMES = 10
_EDGE_S = 0.1
_COMPLETE = 0.15  # of the weight that the motion needs: all contacts are on the plates
_SHORTEST_S = 0.2
_FALLS = 0.2  # of gravity: less is flight
_BALANCE_M = 0.03  # of the centre of mass from the centre of pressure: median 15 mm, golf 56
_BANDWIDTH_HZ = 3.0
_MOST_NUMBERS = 12.0  # that count as independent, however long a session is
_CLOSEST = 0.97  # correlation
# Below these, movement is noise of markers and plates [m/s2; m2/s2].
_FLOORS = {"force": 0.03, "level": 0.03, "vertical": 0.015}
# Of the way from a segment's markers, which mark its lower joint or the top of the trunk, to those
# of the segment that it hangs on: about there is its centre of mass.
_TO_NEIGHBOUR = dict.fromkeys(("thigh", "shank", "upper_arm", "forearm"), 0.5) | {
    "upper_torso": 0.3
}


@dataclass(frozen=True, eq=False)
class Body:
    """The centre of mass, as the segments' markers tell it, at n samples; NaN: not known.

    place_m : (n, 3). acceleration_m_s2 : (n, 3). spin_m2_s2 : rate of the angular momentum about
    it, over the mass, (n, 3). lasts_s : what each sample stands for, (n,).
    """

    place_m: np.ndarray
    acceleration_m_s2: np.ndarray
    spin_m2_s2: np.ndarray
    lasts_s: np.ndarray

    @classmethod
    def of(cls, markers_m: Mapping[str, np.ndarray], rate_hz: float, frames: np.ndarray) -> Body:
        """From a trial's markers (n_frames, k, 3) per segment, world frame, at some frames (n,)."""
        paths = {name: _paths(markers) for name, markers in markers_m.items()}
        paths = {name: path for name, path in paths.items() if path.shape[1]}
        weights = shares_of_seen(list(paths))
        mass = sum(weights.values())
        n_frames = max((len(path) for path in paths.values()), default=0)
        if mass < _MOST_OF_IT or n_frames < _FEWEST_FRAMES:
            nothing = np.full((len(frames), 3), np.nan)
            return cls(nothing, nothing, nothing, np.zeros(len(frames)))
        paths = _about_centres({name: _smooth(paths[name], rate_hz) for name in weights})
        place = sum(share / mass * paths[n].mean(axis=1) for n, share in weights.items())
        place = np.asarray(place)
        velocity = np.gradient(place, axis=0) * rate_hz
        spin = np.zeros_like(place)
        for name, share in weights.items():
            away = paths[name] - place[:, None]
            turning = np.cross(away, np.gradient(away, axis=0) * rate_hz)
            spin += share / mass * turning.mean(axis=1)
        acceleration = np.gradient(velocity, axis=0) * rate_hz
        edge = np.ones(n_frames, bool)
        edge[round(_EDGE_S * rate_hz) : n_frames - round(_EDGE_S * rate_hz)] = False
        acceleration[edge] = np.nan
        rates = np.gradient(spin, axis=0) * rate_hz
        lasts = np.diff(frames, append=frames[-1:] + 1) / rate_hz
        lasts = np.minimum(lasts, 0.5 / _BANDWIDTH_HZ)
        return cls(place[frames], acceleration[frames], rates[frames], lasts)

    def moved(self, change: np.ndarray) -> Body:
        """In other axes (3, 3), mirrored ones too."""
        return replace(
            self,
            place_m=self.place_m @ change.T,
            acceleration_m_s2=self.acceleration_m_s2 @ change.T,
            spin_m2_s2=np.linalg.det(change) * self.spin_m2_s2 @ change.T,
        )

    def match(self, wrench: np.ndarray) -> Match:
        """With a total wrench (n, 6) about the world's origin, smoothed alike."""
        needed = GRAVITY_M_S2 + self.acceleration_m_s2[:, 2]
        known = np.isfinite(needed) & np.isfinite(wrench).all(axis=1) & (wrench[:, 2] > 0)
        known &= needed > _FALLS * GRAVITY_M_S2
        if not known.any():
            return Match()
        mass = wrench[known, 2] / needed[known]
        whole = float(np.percentile(mass, 90))
        known[known] = np.abs(mass / whole - 1.0) < _COMPLETE
        seconds = float(self.lasts_s[known].sum())
        if seconds < _SHORTEST_S:
            return Match()
        force, place = wrench[known, :3] / whole, self.place_m[known]
        moment = wrench[known, 3:] / whole - np.cross(place, force)
        acceleration, spin = self.acceleration_m_s2[known], self.spin_m2_s2[known]
        lean = moment[:, :2] - spin[:, :2]
        return Match(
            gap_m=float(np.sqrt(np.mean((lean**2).sum(axis=1)))) / GRAVITY_M_S2,
            seconds=seconds,
            sums={
                "force": _sums(force[:, :2], acceleration[:, :2], _FLOORS["force"]),
                "level": _sums(moment[:, :2], spin[:, :2], _FLOORS["level"]),
                "vertical": _sums(moment[:, 2:], spin[:, 2:], _FLOORS["vertical"]),
            },
        )


@dataclass(frozen=True)
class Match:
    """How a trial's wrench goes with its body; gap_m NaN: nothing is known.

    gap_m : of the centre of mass from over the centre of pressure, movement taken off, RMS.
    seconds : in which the plates measure everything. sums : of products of force with motion, of
    the force's and of the motion's squares, by kind.
    """

    gap_m: float = float("nan")
    seconds: float = 0.0
    sums: Mapping[str, tuple[float, float, float]] | None = None


@dataclass(frozen=True)
class Harmony:
    """Of all trials together: correlation of forces with motion, by kind, and how sure [1]."""

    correlations: Mapping[str, float]
    numbers: float

    @classmethod
    def of(cls, matches: Iterable[Match]) -> Harmony:
        some = [(match.seconds, match.sums) for match in matches if match.sums is not None]
        seconds = sum(each for each, _ in some)
        total = {kind: np.sum([sums[kind] for _, sums in some], axis=0) for kind in _FLOORS if some}
        return cls(
            {kind: float(ab / np.sqrt(aa * bb)) for kind, (ab, aa, bb) in total.items()},
            min(_MOST_NUMBERS, 2.0 * _BANDWIDTH_HZ * seconds),
        )

    def log_likelihood(self) -> float:
        """Of a rising line through numbers that scatter like these, logarithm; against a falling
        one as much."""
        close = np.clip(list(self.correlations.values()), -_CLOSEST, _CLOSEST)
        return float(-0.5 * self.numbers * np.sum(np.sign(close) * np.log(1.0 - close**2)))


def balance_log_likelihood(match: Match) -> float:
    """How likely a person stands so far from over the centre of pressure, logarithm."""
    return 0.0 if np.isnan(match.gap_m) else float(-2.0 * np.log1p((match.gap_m / _BALANCE_M) ** 2))


def _paths(markers_m: np.ndarray) -> np.ndarray:
    """Paths (n_frames, k, 3) of the markers that are seen nearly always, gaps bridged."""
    seen = np.isfinite(markers_m).all(axis=-1)
    often = np.flatnonzero(seen.mean(axis=0) > _OFTEN) if len(seen) else np.zeros(0, int)
    paths = markers_m[:, often].copy()
    frames = np.arange(len(paths))
    for path, known in zip(paths.swapaxes(0, 1), seen[:, often].T, strict=True):
        for axis in range(3):
            path[:, axis] = np.interp(frames, frames[known], path[known, axis])
    return paths


def _about_centres(paths: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Each segment's markers moved to where its centre of mass is."""
    found = {}
    for name, path in paths.items():
        kind = without_side(name)
        near = NEIGHBOUR[kind]
        home = next((one for one in (near + name[len(kind) :], near) if one in paths), name)
        part = _TO_NEIGHBOUR.get(kind, 0.0) * (home != name)
        found[name] = (1 - part) * path + part * paths[home].mean(axis=1, keepdims=True)
    return found


def _smooth(paths: np.ndarray, rate_hz: float) -> np.ndarray:
    return np.asarray(gaussian_filter1d(paths, SMOOTH_S * rate_hz, axis=0, mode="nearest"))


def _sums(force: np.ndarray, motion: np.ndarray, floor: float) -> tuple[float, float, float]:
    """About their means, with the noise of both beside what they are."""
    a, b = force - force.mean(axis=0), motion - motion.mean(axis=0)
    noise = a.size * floor**2
    return float((a * b).sum()), float((a**2).sum() + noise), float((b**2).sum() + noise)
