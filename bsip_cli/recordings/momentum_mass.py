"""The mass that the plates measure in intervals of a trial: the balance of momentum.

Over a interval in which every contact is on the plates the impulse of the vertical force is
m (g T + dv), dv the change of the centre of mass's vertical velocity. The markers show dv but for
what they leave unseen: segments heavier or lighter than the table says, centres of mass elsewhere
between the joints than the markers, soft tissue. These errors belong to how a segment moves against
the rest, so that they cancel where the posture moves alike at both ends: between the apexes of
whole strides, and in quiet stance.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from bsip_cli.body.anthropometry import load_table
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.contacts import (
    Contacts,
    bears_alone,
)
from bsip_cli.recordings.model import Plate
from bsip_cli.recordings.trunk_motion import low_pass, mean_path, path_reach_m_s2
from bsip_cli.segments import SEGMENTS, TRUNK, without_side

# A segment's share of the body's mass against the table: published regressions err by 10 to 25 %
# of a segment's mass (configs/default.toml, [prior]), the large segments by less.
MASS_SHARE_SD = 0.15
# The centre of mass against the markers' mean, as part of the way to the neighbouring segment: a
# segment's markers sit at one of its ends or in its middle, its centre at 0.35 to 0.6 of it.
PLACE_SD = 0.2
DELAY_SD_S = 0.003  # between plates and cameras, filters included
# Forces that do not go with the motion may be late; by 0.05 s and more they are moved before.
DELAYS_S = np.linspace(-0.05, 0.05, 21)
ZERO_SD_N = 2.0  # of all plates together, after their zero is taken off
STILL_SD_M_S = 0.006  # heart, breath, and noise of markers in quiet stance
SOFT_SD = 0.15  # soft tissue and the rest, of the spread of the segments' velocities
IMPACT_SD_S = 0.004  # soft tissue after an impact, times the acceleration [m/s2]

MARGIN_S = 0.5  # of markers about a interval, for the filter
EDGE_S = 0.1  # at either end of a recording the filtered velocity is not to be trusted
NODE_S = 0.2  # the impulse is compared this often
LONGEST_S = 2.0
SHORTEST_S = 0.3
LEAST_MEAN_N = 50.0
UPRIGHT_COS = 0.8  # pelvis over the shanks, 37 degrees: less is sitting or a deep squat
UPRIGHT_SHARE = 0.3  # of a interval
COMES_AND_GOES = 4.0  # reduced chi-square of the impulses within a interval: twice the errors
DOUBTFUL_SD = 0.5

NEIGHBOUR = {
    "lower_torso": "upper_torso",
    "upper_torso": "lower_torso",
    "head": "upper_torso",
    "upper_arm": "upper_torso",
    "forearm": "upper_arm",
    "hand": "forearm",
    "thigh": "lower_torso",
    "shank": "thigh",
    "foot": "shank",
}
"""The segment that a segment hangs on, or nearly so."""
_KINDS = tuple(NEIGHBOUR)
_ROWS = {"lower_torso": "pelvis", "upper_torso": "torso", "upper_arm": "arm"}


@dataclass(frozen=True)
class Interval:
    """One interval's mass and its relative errors.

    ``own_sd`` : relative, independent of other intervals.
    ``common`` : relative errors (one standard deviation each) shared by all intervals of a person:
    per kind of segment its share of the mass and the place of its centre.
    ``of_trial`` : the same for errors that a trial's intervals share: delay, zero.
    ``steadiness`` : reduced chi-square of the impulses within it.
    """

    start_s: float
    seconds: float
    mass_kg: float
    own_sd: float
    common: tuple[float, ...]
    of_trial: tuple[float, ...]
    steadiness: float

    def without(self, load_kg: float) -> Interval:
        """The same less a mass that is known to be carried."""
        own = max(self.mass_kg - load_kg, 1e-3)
        up = self.mass_kg / own
        common, of_trial = (tuple(up * np.array(each)) for each in (self.common, self.of_trial))
        return replace(self, mass_kg=own, own_sd=up * self.own_sd, common=common, of_trial=of_trial)

    def record(self) -> dict[str, Any]:
        """For an artifact's facts."""
        return asdict(self)

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> Interval:
        """From an artifact's facts, which have lists for tuples."""
        known: Any = {k: tuple(x) if isinstance(x, list) else x for k, x in record.items()}
        return cls(**known)


@dataclass(frozen=True, eq=False)
class SegmentMotion:
    """Vertical velocity of the centre of mass and of what it is made of.

    velocity_m_s : (n,) of the centre of mass. common : (n, 18) its possible errors, one standard
    deviation each. own_sd : (n,) of the rest. acceleration_m_s2 : (n,).
    """

    velocity_m_s: np.ndarray
    common: np.ndarray
    own_sd: np.ndarray
    acceleration_m_s2: np.ndarray


def segment_motion(markers_m: Mapping[str, np.ndarray], rate_hz: float) -> SegmentMotion | None:
    """From markers (n, k, 3) per segment; None without a marker on the trunk."""
    paths = {name: mean_path(each[..., 2]) for name, each in markers_m.items()}
    seen = {
        name: np.gradient(low_pass(path, rate_hz)) * rate_hz
        for name, path in paths.items()
        if path is not None
    }
    if not {"lower_torso", "upper_torso"} & set(seen):
        return None
    share = _shares()
    weight = np.array([share[without_side(name)] for name in seen])
    speeds = np.stack(list(seen.values()))
    centre = weight @ speeds / weight.sum()
    spread = np.sqrt(weight @ (speeds - centre) ** 2 / weight.sum())
    common = np.zeros((len(centre), 2 * len(_KINDS)))
    for name, own, velocity in zip(seen, weight / weight.sum(), speeds, strict=True):
        kind = without_side(name)
        k = _KINDS.index(kind)
        common[:, k] += MASS_SHARE_SD * own * (velocity - centre)
        carrier = _carrier(NEIGHBOUR[kind], name[len(kind) :], set(seen) - {name})
        near = seen.get(carrier, centre)
        common[:, len(_KINDS) + k] += PLACE_SD * own * (velocity - near)
    acceleration = np.gradient(centre) * rate_hz
    hidden = (1.0 - weight.sum()) * float(spread.max())
    own_sd = np.sqrt(
        STILL_SD_M_S**2 + (SOFT_SD * spread) ** 2 + (IMPACT_SD_S * acceleration) ** 2 + hidden**2
    )
    return SegmentMotion(centre, common, own_sd, acceleration)


def body_reach_m_s2(markers_m: Mapping[str, np.ndarray], rate_hz: float) -> np.ndarray | None:
    """What the vertical force has to be over the mass (n,): gravity and the acceleration of the
    centre of mass, from markers (n, k, 3) per segment; None without a marker on the trunk.

    In 15 moving trials of six public recordings the force is as this has it to 2 to 20 % of the
    weight in 19 of 20 frames (running 30); as the trunk's markers alone have it to 3 to 36.
    """
    heights = {name: mean_path(each[..., 2]) for name, each in markers_m.items()}
    seen = {name: path for name, path in heights.items() if path is not None}
    if not set(TRUNK) & set(seen):
        return None
    weights = shares_of_seen(list(seen))
    centre = sum(weight * seen[name] for name, weight in weights.items()) / sum(weights.values())
    return path_reach_m_s2(np.asarray(centre), rate_hz)


def _carrier(kind: str, side: str, names: Collection[str]) -> str:
    """The nearest seen segment from a kind on towards the trunk; empty if there is none."""
    for _ in _KINDS:
        for found in (kind + side, kind):
            if found in names:
                return found
        kind = NEIGHBOUR[kind]
    return ""


def shares_of_seen(names: Collection[str]) -> dict[str, float]:
    """Each seen segment's share of the body's mass, with that of unseen ones beyond it."""
    shares = _shares()
    found: dict[str, float] = {}
    for segment in SEGMENTS:
        kind = without_side(segment)
        if carrier := _carrier(kind, segment[len(kind) :], names):
            found[carrier] = found.get(carrier, 0.0) + shares[kind]
    return found


def _shares() -> dict[str, float]:
    """Share of the body's mass per kind of segment, mean of both sexes."""
    table = load_table("dumas2007")
    rows = {kind: _ROWS.get(kind, kind) for kind in _KINDS}
    return {
        kind: (table["M", row].mass_fraction + table["F", row].mass_fraction) / 2
        for kind, row in rows.items()
    }


def intervals_of(
    markers_m: Mapping[str, np.ndarray],
    force_z_N: np.ndarray,
    measured: np.ndarray,
    rate_hz: float,
) -> tuple[Interval, ...]:
    """What each interval with all contacts ``measured`` (n,) bool by plates shows.

    ``markers_m`` (n, k, 3) per segment; ``force_z_N`` (n,) is the sum of all plates. A interval
    counts where the person is upright for a part of it.
    """
    found, inner = [], measured.copy()
    edge, margin = round(EDGE_S * rate_hz), round(MARGIN_S * rate_hz)
    inner[:edge] = inner[len(inner) - edge :] = False
    for start, stop in runs(inner):
        seconds = (stop - 1 - start) / rate_hz
        part = slice(max(0, start - margin), stop + margin)
        near = {name: each[part] for name, each in markers_m.items()}
        if seconds < SHORTEST_S or (motion := segment_motion(near, rate_hz)) is None:
            continue
        upright = upright_frames(near)
        pieces = max(1, int(np.ceil(seconds / LONGEST_S)))
        edges = np.round(np.linspace(start, stop - 1, pieces + 1)).astype(int) - part.start
        for first, last in itertools.pairwise(edges.tolist()):
            if upright[first : last + 1].mean() < UPRIGHT_SHARE:
                continue
            if (one := _stretch(force_z_N[part], motion, first, last, rate_hz)) is not None:
                found.append(replace(one, start_s=one.start_s + part.start / rate_hz))
    return tuple(found)


def intervals_alone(
    markers_m: Mapping[str, np.ndarray],
    feet: Contacts,
    plates: Sequence[Plate],
    rate_hz: float,
) -> dict[str, tuple[Interval, ...]]:
    """The same of each plate, while it bears the person alone."""
    return {
        one.name: intervals_of(
            markers_m, one.lift_N, feet.surely_measured & bears_alone(one, plates), rate_hz
        )
        for one in plates
    }


def _stretch(
    force_z_N: np.ndarray, motion: SegmentMotion, first: int, last: int, rate_hz: float
) -> Interval | None:
    """As the clocks say, or else as late as it goes with the motion best."""
    found = _delayed(force_z_N, motion, first, last, rate_hz, 0.0)
    if found is None or found.steadiness < COMES_AND_GOES:
        return found
    shifted = (_delayed(force_z_N, motion, first, last, rate_hz, x) for x in DELAYS_S)
    return min((x for x in shifted if x is not None), key=lambda x: x.steadiness, default=found)


def _delayed(
    force_z_N: np.ndarray,
    motion: SegmentMotion,
    first: int,
    last: int,
    rate_hz: float,
    late_s: float,
) -> Interval | None:
    """With forces that come so late."""
    seconds = (last - first) / rate_hz
    count = max(1, round(seconds / NODE_S))
    nodes = np.unique(np.round(np.linspace(first, last, count + 1)).astype(int))
    known_N = np.nan_to_num(force_z_N)  # all of it between the nodes, unless they are moved
    steps = (known_N[:-1] + known_N[1:]) / 2 / rate_hz
    total = np.concatenate([[0.0], np.cumsum(steps)])
    impulse = np.diff(np.interp(nodes + late_s * rate_hz, np.arange(len(total)), total))
    if impulse.sum() / seconds < LEAST_MEAN_N:
        return None
    time = np.diff(nodes) / rate_hz
    reach = GRAVITY_M_S2 * time + np.diff(motion.velocity_m_s[nodes])
    difference = np.diff(np.eye(len(nodes)), axis=0)
    own = (difference * motion.own_sd[nodes] ** 2) @ difference.T
    common = np.diff(motion.common[nodes], axis=0)
    weight_N = impulse.sum() / max(float(reach.sum()), 1e-9) * GRAVITY_M_S2
    if weight_N <= 0:
        return None
    delay = DELAY_SD_S * np.diff(motion.acceleration_m_s2[nodes])
    zero = ZERO_SD_N * GRAVITY_M_S2 / weight_N * time
    of_trial = np.stack([delay, zero], axis=1)
    covariance = own + common @ common.T + of_trial @ of_trial.T
    solved = np.linalg.solve(covariance, reach)
    weights = solved / (reach @ solved)
    mass = float(weights @ impulse)
    own_sd = float(np.sqrt(weights @ own @ weights))
    if mass <= 0 or 1.0 / np.sqrt(reach @ solved) > DOUBTFUL_SD:
        return None
    residual = impulse / mass - reach
    free = len(impulse) - 1
    chi = float(residual @ np.linalg.solve(covariance, residual)) / free if free else 1.0
    return Interval(
        float(first / rate_hz),
        seconds,
        mass,
        own_sd * max(1.0, float(np.sqrt(chi))),
        tuple((weights @ common).tolist()),
        tuple((weights @ of_trial).tolist()),
        chi,
    )


def upright_frames(markers_m: Mapping[str, np.ndarray]) -> np.ndarray:
    """The pelvis is over the middle of both shanks, not behind them, (n,) bool.

    Without markers on both, nothing is known to be upright.
    """
    nothing = np.empty((0, 0, 3))
    seen = [markers_m.get(name, nothing) for name in ("lower_torso", "shank_l", "shank_r")]
    paths = [mean_path(each[..., axis]) for each in seen for axis in range(3)]
    known = [path for path in paths if path is not None]
    if len(known) < len(paths):
        return np.zeros(len(next(iter(markers_m.values()))), bool)
    pelvis, *shanks = np.reshape(known, (3, 3, -1))
    up = pelvis - np.mean(shanks, axis=0)
    return np.asarray(up[2] > UPRIGHT_COS * np.maximum(np.linalg.norm(up, axis=0), 1e-6))
