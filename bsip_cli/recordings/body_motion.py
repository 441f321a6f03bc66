"""Do these forces carry and drive this body? Newton and Euler for the whole of it.

The sum of all plates' wrenches is the rate of the body's momentum, linear and angular, which the
markers show. Horizontal forces go with the acceleration of the centre of mass, moments about it
with the rate of the angular momentum. In complete intervals of 50 sound public recordings the
forces correlate by 0.5 to 0.99 in movement (median 0.9), moments about level axes by 0.4 to 0.97,
about the vertical by 0 to 0.9, and none clearly below zero over a second or more. Where they
correlate by 0.9, forces are 0.75 to 1.25 times as large as the motion, level moments 0.9 to 1.6.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.momentum_mass import NEIGHBOUR, shares_of_seen
from bsip_cli.recordings.trunk_motion import FALLS
from bsip_cli.segments import without_side

SMOOTH_S = 0.04
"""Standard deviation of the bell that forces and markers alike are averaged with: half of the
amplitude is left at 4.7 Hz; horizontal forces of plates and of markers hardly agree above 3."""

# After so long a sample is independent: half the inverse of the bell's noise bandwidth.
INDEPENDENT_S = 2.0 * np.sqrt(np.pi) * SMOOTH_S
_EDGE_S = 4.0 * SMOOTH_S  # how far the bell reaches: nearer to an end, it averages nothing
_MOST_OF_IT = 0.5  # of the body's mass
_OFTEN = 0.9  # of the frames
_FEWEST_FRAMES = 10
_ROUNDS = 5  # of weights that follow the residuals
_CLOSEST = 0.97  # correlation: the highest of moments in sound recordings, see above
_SAME = 1.0 - 1e-9  # correlation: of no noise
_ALIKE = 0.15  # logarithm of force over motion: its scatter over sound recordings, see above
_KINDS = {"force": [0, 1], "level": [3, 4], "vertical": [5]}  # columns of a wrench
# Those whose sizes are compared, and the usual one, logarithm: the spin of the segments about their
# own centres is not in the motion.
_SIZES = {"force": ([0, 1], 0.0), "lift": ([2], 0.0), "level": ([3, 4], 0.26)}
_LIFT = list(_SIZES).index("lift")
# Of the way from a segment's markers, which mark its lower joint or the top of the trunk, to those
# of the segment that it hangs on: about there is its centre of mass.
_TO_NEIGHBOUR = dict.fromkeys(("thigh", "shank", "upper_arm", "forearm"), 0.5) | {
    "upper_torso": 0.3
}


@dataclass(frozen=True)
class GateLimits:
    """Options of `ingest`; their reasons are in configs/default.toml, whose values these are."""

    believed_percent: float = 85.0
    corrected_percent: float = 95.0
    balance_median_m: float = 0.024
    complete_percent: float = 15.0
    marker_noise_m: float = 0.001
    independent_numbers: float = 12.0


USUAL = GateLimits()


@dataclass(frozen=True, eq=False)
class Body:
    """The momentum that the segments' markers show, at n samples; NaN: not known.

    place_m : of the centre of mass, (n, 3). rate : of the momentum over the mass, linear [m/s2] and
    angular about the centre of mass [m2/s2], (n, 6). noise : its variance over that of a marker's
    place, (n, 6). lasts_s : what each sample stands for, (n,). trial : its number, (n,).
    """

    place_m: np.ndarray
    rate: np.ndarray
    noise: np.ndarray
    lasts_s: np.ndarray
    trial: np.ndarray

    @classmethod
    def of(cls, markers_m: Mapping[str, np.ndarray], rate_hz: float, frames: np.ndarray) -> Body:
        """From a trial's markers (n_frames, k, 3) per segment, world frame, at some frames (n,)."""
        paths = {name: _paths(markers) for name, markers in markers_m.items()}
        paths = {name: path for name, path in paths.items() if path.shape[1]}
        weights = shares_of_seen(list(paths))
        mass = sum(weights.values())
        n_frames = max((len(path) for path in paths.values()), default=0)
        if mass < _MOST_OF_IT or n_frames < _FEWEST_FRAMES:
            nothing = np.full((len(frames), 6), np.nan)
            return cls(nothing[:, :3], nothing, nothing, nothing[:, 0], np.zeros(len(frames), int))
        smooth = partial(gaussian_filter1d, sigma=SMOOTH_S * rate_hz, axis=0, mode="nearest")
        paths = _about_centres({name: smooth(paths[name]) for name in weights})
        place = np.asarray(sum(w / mass * paths[n].mean(axis=1) for n, w in weights.items()))
        velocity = np.gradient(place, axis=0) * rate_hz
        spin, noise = np.zeros_like(place), np.zeros(6)
        for name, weight in weights.items():
            away = paths[name] - place[:, None]
            turning = np.cross(away, np.gradient(away, axis=0) * rate_hz)
            spin += weight / mass * turning.mean(axis=1)
            lever2 = (away**2).sum(axis=-1, keepdims=True) - away**2
            share2 = (weight / mass) ** 2 / away.shape[1]
            noise += share2 * np.append(np.ones(3), lever2.mean(axis=(0, 1)))
        rate = np.gradient(np.hstack([velocity, spin]), axis=0) * rate_hz
        edge = np.ones(n_frames, bool)
        edge[round(_EDGE_S * rate_hz) : n_frames - round(_EDGE_S * rate_hz)] = False
        rate[edge] = np.nan
        lasts = np.diff(frames, append=frames[-1:] + 1) / rate_hz
        # Of smoothed white noise: the integral of w^4 exp(-w^2 s^2) over its spectrum.
        noise *= 3.0 / (8.0 * np.sqrt(np.pi) * rate_hz * SMOOTH_S**5)
        lasts = np.minimum(lasts, INDEPENDENT_S)
        each = np.tile(noise, (len(frames), 1))
        return cls(place[frames], rate[frames], each, lasts, np.zeros(len(frames), int))

    @classmethod
    def of_all(cls, trials: Sequence[Body]) -> Body:
        """The same person in several trials."""
        columns = zip(*((b.place_m, b.rate, b.noise, b.lasts_s) for b in trials), strict=True)
        number = np.repeat(np.arange(len(trials)), [len(b.trial) for b in trials])
        place, rate, noise, lasts = map(np.concatenate, columns)
        return cls(place, rate, noise, lasts, number)

    def moved(self, change: np.ndarray) -> Body:
        """In other axes (3, 3), mirrored ones too."""
        linear, angular = np.split(self.rate @ np.kron(np.eye(2), change).T, 2, axis=1)
        angular = np.linalg.det(change) * angular
        return replace(self, place_m=self.place_m @ change.T, rate=np.hstack([linear, angular]))

    def faster(self, times: float) -> Body:
        """The same so many times as fast."""
        return replace(self, rate=self.rate * times**2, noise=self.noise * times**4)


@dataclass(frozen=True)
class Balance:
    """How the total wrenches of all trials of a session go with their bodies.

    gaps_m : of each trial, of the centre of mass from over the centre of pressure, movement taken
    off, RMS; without trials in which nothing is known. correlations : of force with motion, by
    kind; numbers : how many independent ones they are of. sizes : of force over motion, logarithm,
    above the usual one, each with their correlation. turned : correlation of level forces that are
    turned or mirrored as suits them best.
    """

    gaps_m: tuple[float, ...] = ()
    correlations: Mapping[str, float] | None = None
    numbers: float = 0.0
    sizes: tuple[tuple[float, float], ...] = ()
    turned: float = 0.0

    @classmethod
    def of(cls, body: Body, wrench: np.ndarray, limits: GateLimits) -> Balance:
        """Of total wrenches (n, 6) about the world's origin, smoothed as the body is."""
        if (some := _Complete.of(body, wrench, limits)) is None:
            return cls()
        force, motion = some.wrench.copy(), some.rate
        force[:, 3:] -= _cross(some.place_m, force[:, :3])
        lean = force[:, 3:5] - motion[:, 3:5]
        lean2 = (lean**2).sum(axis=1)
        # The centre of mass is thought to be off by as much all through a trial: a gap, no motion.
        lift = force[:, 2]
        force[:, 3:5] -= (some.over(lean.T, lift) @ some.member * lift).T
        together = some.about_means(force, motion)
        force2 = some.about_means(force, force) + some.noise
        motion2 = some.about_means(motion, motion) + some.noise

        across, wanted = (one[:, :2] @ [[1.0], [1j]] for one in (force, motion))
        turned = max(abs(some.about_means(across, x)[0]) for x in (wanted, wanted.conj()))

        def correlation(k: list[int]) -> float:
            return float(together[k].sum() / np.sqrt(force2[k].sum() * motion2[k].sum()))

        return cls(
            tuple(np.sqrt(some.member @ lean2 / some.member.sum(axis=1)) / GRAVITY_M_S2),
            {kind: correlation(k) for kind, k in _KINDS.items()},
            some.numbers,
            tuple(
                (0.5 * float(np.log(force2[k].sum() / motion2[k].sum())) - usual, correlation(k))
                for k, usual in _SIZES.values()
            ),
            float(turned / np.sqrt(force2[:2].sum() * motion2[:2].sum())),
        )

    def log_likelihood(self, limits: GateLimits) -> float:
        """How likely a person is so balanced and driven, logarithm.

        Gaps in the plane are as Student's t with two degrees of freedom, whose median is its scale.
        """
        gaps = np.array(self.gaps_m) / limits.balance_median_m
        return float(-2.0 * np.log1p(gaps**2).sum()) + self.drive_log_likelihood()

    def drive_log_likelihood(self) -> float:
        """Of a rising line through numbers that scatter like these, logarithm; against a falling
        one as much."""
        if self.correlations is None:
            return 0.0
        axes = np.array([len(_KINDS[kind]) for kind in self.correlations])
        return float(axes @ self._rising(list(self.correlations.values())))

    def lift_log_likelihood(self) -> float:
        """The same of the vertical force alone."""
        return float(
            sum(self._rising([alike for _, alike in self.sizes[_LIFT : _LIFT + 1]], _SAME))
        )

    def level_log_likelihood(self) -> float:
        """The same of level forces in whatever axes."""
        return 2.0 * float(self._rising([self.turned], _SAME)[0])

    def _rising(self, correlations: Sequence[float], closest: float = _CLOSEST) -> np.ndarray:
        close = np.clip(correlations, -closest, closest)
        return np.asarray(-0.5 * self.numbers * np.sign(close) * np.log(1.0 - close**2))

    def size_log_likelihood(self, times: float = 1.0) -> float:
        """That forces are as large as they need be if the body moves so many times as fast,
        logarithm: as Student's t with four degrees of freedom. The one may be all the larger the
        less they go together."""
        total = 0.0
        for size, alike in self.sizes:
            if alike > 0:
                room = _ALIKE**2 + np.log(alike) ** 2 + (1 - alike**2) / self.numbers
                total -= 2.5 * np.log1p(0.25 * (size - 2 * np.log(times)) ** 2 / room)
        return float(total)


@dataclass(frozen=True, eq=False)
class _Complete:
    """The samples in which the plates have every contact; all of them over the person's mass.

    wrench, rate, place_m : of the plates and of the body (n, 6), (n, 3). member : of which trial
    (trials, n), 0 or 1. noise : of all samples together, (6,). numbers :
    independent ones, as many as count.
    """

    wrench: np.ndarray
    rate: np.ndarray
    place_m: np.ndarray
    member: np.ndarray
    noise: np.ndarray
    numbers: float

    @classmethod
    def of(cls, body: Body, wrench: np.ndarray, limits: GateLimits) -> _Complete | None:
        """The person is the same in all trials: contacts are complete where the force is the weight
        that the motion needs, and the weight is what they nearly reach at most."""
        needed = GRAVITY_M_S2 + body.rate[:, 2]
        known = np.isfinite(needed) & np.isfinite(wrench).all(axis=1) & (wrench[:, 2] > 0)
        known &= needed > FALLS * GRAVITY_M_S2
        if not known.any():
            return None
        mass = wrench[known, 2] / needed[known]
        whole = np.percentile(mass, 90)
        known[known] = np.abs(mass / whole - 1.0) < limits.complete_percent / 100
        member = (body.trial[known] == np.arange(body.trial.max() + 1)[:, None]).astype(float)
        seconds = member @ body.lasts_s[known]
        member = member[seconds >= INDEPENDENT_S]
        if not len(member):
            return None
        numbers = float(seconds[seconds >= INDEPENDENT_S].sum() / INDEPENDENT_S)
        known[known] = of_trial = member.any(axis=0)
        member = member[:, of_trial]
        return cls(
            wrench[known] / whole,
            body.rate[known],
            body.place_m[known],
            member,
            limits.marker_noise_m**2 * (member @ body.noise[known]).sum(axis=0),
            min(limits.independent_numbers, numbers),
        )

    def over(self, values: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Of values (..., n) what goes with another signal (n,) in each trial, (..., trials)."""
        return np.asarray((values * other) @ self.member.T / (self.member @ other**2))

    def about_means(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Sums of products (n, k) about the means of each trial, (k,)."""
        means = (self.member @ a) * (self.member @ b) / self.member.sum(axis=1)[:, None]
        return np.asarray((self.member @ (a * b) - means).sum(axis=0))


def turn_of_forces(
    body: Body, wrench: np.ndarray, limits: GateLimits
) -> tuple[float, float] | None:
    """The turn of the wrenches about the vertical through the origin that suits the body best, and
    its standard deviation [rad]; None if nothing is known.

    Least squares of horizontal forces, of level moments about the centre of mass but for what a
    constant error of its place does, and of the places themselves, each over its own residual; of
    places that of usual gaps at least, and a trial is one number.
    """
    if (some := _Complete.of(body, wrench, limits)) is None:
        return None
    level = np.array([1.0, 1j])
    force, lift = some.wrench[:, :2] @ level, some.wrench[:, 2]
    moment = some.wrench[:, 3:5] @ level - 1j * some.place_m[:, 2] * force
    wanted = some.rate[:, 3:5] @ level - 1j * (some.place_m[:, :2] @ level) * lift
    places = [some.over(one, lift) for one in (moment, wanted)]
    ones = np.ones_like(lift)
    motion = some.rate[:, :2] @ level
    groups = [
        (*(one - some.over(one, ones) @ some.member for one in (force, motion)), some.numbers),
        (
            moment - places[0] @ some.member * lift,
            wanted - places[1] @ some.member * lift,
            some.numbers,
        ),
        (*places, len(some.member)),
    ]
    least = (0.0, 0.0, limits.balance_median_m**2)
    weights, turn, total = [1.0, 1.0, 1.0], 1.0 + 0j, 0j
    for _ in range(_ROUNDS):
        total = sum(
            weight * number * (np.conj(a) * b).mean()
            for weight, (a, b, number) in zip(weights, groups, strict=True)
        )
        turn = total / abs(total)
        left = [float(np.mean(np.abs(turn * a - b) ** 2)) for a, b, _ in groups]
        weights = [2.0 / max(one, floor) for one, floor in zip(left, least, strict=True)]
    return float(np.angle(turn)), float(1.0 / np.sqrt(abs(total)))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of (n, 3) each: ten times as fast as numpy's on small arrays."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


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
