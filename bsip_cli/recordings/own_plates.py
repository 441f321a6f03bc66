"""Which force plate measures which foot, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.contacts import SOLE_HEIGHT_M, TOUCHED_N, inside_outline
from bsip_cli.recordings.plates import cop_at_height
from bsip_cli.recordings.under_the_feet import BESIDE_M

SIDES = ("l", "r")
_NOBODY, _LEFT, _RIGHT, _SHARED, _UNCLEAR = -1, 0, 1, 2, 3
_NEARER = 0.5  # of the other foot's distance: so near a centre of pressure is under one foot alone
_AGREE = 0.95  # of a contact's frames, where the centre of pressure alone shows the foot
_AROUND_S = 0.05  # about a load: what the plate reads below the threshold is still the foot's


@dataclass(frozen=True, eq=False)
class Reading:
    """A plate: wrench (N, 6) on the body about the world's origin, corners (4, 3) or None."""

    wrench: np.ndarray
    corners_m: np.ndarray | None

    def height_m(self) -> float:
        return 0.0 if self.corners_m is None else float(self.corners_m[:, 2].mean())

    def cop_m(self) -> np.ndarray:
        """(N, 2)."""
        return cop_at_height(self.wrench[:, :3], self.wrench[:, 3:], self.height_m())


@dataclass(frozen=True, eq=False)
class FootForces:
    """What the plates show of each foot.

    wrench : by side, (N, 6) on the foot about the world's origin; zero in the air, NaN where not
        known. plate : by side, (N, P) which plates bear it.
    unknown : by reason, (N,) frames in which the feet's wrenches are not known; by side where
        only that foot's is not.
    """

    wrench: dict[str, np.ndarray]
    plate: dict[str, np.ndarray]
    unknown: dict[str, dict[str, np.ndarray]]


def foot_forces(
    plates: Sequence[Reading],
    feet_m: Mapping[str, np.ndarray],
    on_ground: Mapping[str, np.ndarray],
    on_plate: Mapping[str, np.ndarray],
    rate_hz: float,
) -> FootForces:
    """Give every plate's wrench to the one foot that stands on it.

    A plate with an outline belongs to the foot whose low points lie on it; if both feet's do, it is
    shared and neither foot's wrench is known. Without an outline, or where no point is on it, it
    belongs to the foot on whose ground its centre of pressure lies, if that is so throughout a
    contact and clearly nearer than to the other foot.

    Parameters
    ----------
    feet_m : by side "l", "r", points (N, k, 3) of the foot, k at least 2, world.
    on_ground, on_plate : by side, (N,) the foot touches; its contact is measured.
    """
    count = len(feet_m["l"])
    owners = np.array([_owner(p, feet_m, on_ground, rate_hz) for p in plates])
    owners = owners.reshape(len(plates), count)
    readings = np.array([p.wrench for p in plates]).reshape(len(plates), count, 6)
    broken = ~np.isfinite(readings).all(axis=(0, 2))
    wrench, plate, unknown = {}, {}, {}
    for number, side in enumerate(SIDES):
        plate[side] = (owners == number).T
        unknown[side] = {
            "both feet are on one plate": (owners == _SHARED).any(axis=0),
            "no foot is clearly under a plate's load": (owners == _UNCLEAR).any(axis=0),
            "the foot is on the floor beside the plates": on_ground[side] & ~on_plate[side],
            "force samples are unusable": broken,
            "there is no force plate": np.full(count, not plates),
        }
        wrench[side] = np.einsum("np,pnc->nc", plate[side], np.nan_to_num(readings))
        wrench[side][np.logical_or.reduce(list(unknown[side].values()))] = np.nan
    return FootForces(wrench, plate, unknown)


def plate_noise(plate: Reading, at_m: np.ndarray) -> np.ndarray:
    """(6,) standard deviation of the white noise of a loaded plate's channels about a point (3,).

    Third differences leave little of movement; the median of their size is not moved by impacts.
    Their variance is 20 times that of the noise.
    """
    loaded = np.nan_to_num(plate.wrench[:, 2]) > TOUCHED_N
    moved = plate.wrench.copy()
    moved[:, 3:] -= np.cross(at_m, plate.wrench[:, :3])
    whole = loaded[3:] & loaded[2:-1] & loaded[1:-2] & loaded[:-3]
    third = np.diff(moved, n=3, axis=0)[whole]
    third = third[np.isfinite(third).all(axis=1)]
    if not len(third):
        return np.zeros(6)
    return np.asarray(1.4826 * np.median(np.abs(third), axis=0) / np.sqrt(20.0))


def _owner(
    plate: Reading,
    feet_m: Mapping[str, np.ndarray],
    on_ground: Mapping[str, np.ndarray],
    rate_hz: float,
) -> np.ndarray:
    """(N,) whose load the plate bears: by low points on its outline, else by its load.

    The owner of a load owns what the plate reads shortly before and after it.
    """
    loaded = np.nan_to_num(plate.wrench[:, 2]) > TOUCHED_N
    on = np.zeros((2, len(loaded)), bool)
    for k, side in enumerate(SIDES if plate.corners_m is not None else ()):
        assert plate.corners_m is not None
        foot = feet_m[side]
        low = foot[..., 2] - np.percentile(foot[..., 2], 2, axis=0) < SOLE_HEIGHT_M
        inside = inside_outline(foot[..., :2], plate.corners_m, 0.0)
        on[k] = on_ground[side] & (low & inside).any(1)
    owner = np.select([on.all(axis=0), on[0], on[1]], [_SHARED, _LEFT, _RIGHT], default=_NOBODY)
    asked = loaded & (owner == _NOBODY)
    owner[asked] = _by_load(plate, feet_m, on_ground, asked)[asked]
    owner[~loaded] = _NOBODY
    filled, reach = owner.copy(), round(_AROUND_S * rate_hz)
    for start, stop in runs(loaded):
        for part, own in (
            (slice(max(0, start - reach), start), owner[start]),
            (slice(stop, stop + reach), owner[stop - 1]),
        ):
            filled[part] = np.where(loaded[part], filled[part], own)
    return filled


def _by_load(
    plate: Reading,
    feet_m: Mapping[str, np.ndarray],
    on_ground: Mapping[str, np.ndarray],
    asked: np.ndarray,
) -> np.ndarray:
    """(N,) whose ground the centre of pressure lies on, in the frames asked for."""
    cop, both = plate.cop_m(), on_ground["l"] & on_ground["r"]
    gaps = np.array([_distance(cop, feet_m[side][..., :2]) for side in SIDES])
    least, most = gaps.min(axis=0), gaps.max(axis=0)
    clear = (least < BESIDE_M) & ((least < _NEARER * most) | ~both)
    owner = np.where(clear, gaps.argmin(axis=0), _UNCLEAR)
    for start, stop in runs(asked):
        frames = np.arange(start, stop)[both[start:stop]]
        if len(frames):
            kinds, counts = np.unique(owner[frames], return_counts=True)
            is_one = counts.max() >= _AGREE * len(frames)
            owner[frames] = kinds[counts.argmax()] if is_one else _UNCLEAR
    return owner


def _distance(places_m: np.ndarray, foot_m: np.ndarray) -> np.ndarray:
    """(N,) from places (N, 2) to the nearest line between two points of a foot (N, k, 2)."""
    gaps = []
    for i, j in combinations(range(foot_m.shape[1]), 2):
        along, away = foot_m[:, j] - foot_m[:, i], places_m - foot_m[:, i]
        share = np.einsum("nc,nc->n", away, along) / np.maximum((along**2).sum(axis=1), 1e-9)
        gaps.append(np.linalg.norm(away - np.clip(share, 0, 1)[:, None] * along, axis=1))
    return np.min(gaps, axis=0)
