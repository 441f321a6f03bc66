"""When everything that touches the person is measured by a plate: by where the feet are, and by
whether the plates' vertical force carries the motion of the trunk; and which force plate measures
which foot, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.ndimage import binary_propagation
from scipy.stats import median_abs_deviation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import long_runs, runs, times
from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.trunk_motion import low_pass, reach_m_s2
from bsip_cli.recordings.under_the_feet import BESIDE_M, LOWEST_M, lowest, outline

NO_MASS = (
    "whether something else bears the person (seat, box, hands) is not known: neither a stated "
    "mass nor this trial's plates show what the person weighs"
)
_SIDES = {"l": "left", "r": "right"}
_TOUCH_HEIGHT_M = 0.035  # above a marker's own standing height
SOLE_HEIGHT_M = 0.06  # markers this low belong to the footprint
_TOUCH_SPEED_M_S = 0.6
_ROLL_HEIGHT_M = 0.09  # of the lowest marker while only the toes touch
_ROLL_SPEED_M_S = 1.2
_ROLL_S = 0.2  # a step is pushed off within this time
_OUTLINE_TOLERANCE_M = 0.03
TOUCHED_N = 20.0
_COP_DISTANCE_M = 0.35
_MISMATCH_SHARE = 0.35  # of body weight, and of the force's own departure from it
_MISMATCH_S = 0.1
_IN_19_OF_20 = 1.96  # standard deviations
_BLINK_S = 0.06  # shorter touches without load are no touch
_LEAST_WINDOW_S = 0.1
_SAID = 2, 6  # of times: digits, and so many at most


def bears_alone(plate: Plate, plates: Sequence[Plate]) -> np.ndarray:
    """Frames in which no other plate is touched, (n_frames,) bool."""
    others = [np.abs(one.lift_N) < TOUCHED_N for one in plates if one is not plate]
    return np.logical_and.reduce([plate.usable, *others])


@dataclass(frozen=True, eq=False)
class Contacts:
    """In which frames every contact is measured, as far as is known, and why not in the others: by
    the feet's markers whatever the person's mass, then by the forces too."""

    valid: np.ndarray  # (n_frames,) bool: samples usable, nothing touches what is no plate
    on_ground: dict[str, np.ndarray]  # side -> (n_frames,) bool
    on_plate: dict[str, np.ndarray]  # side -> (n_frames,) bool: touches, and is measured
    beside: np.ndarray  # (n_frames,) bool: a foot on the floor beside the plates
    usable: np.ndarray  # (n_frames,) bool
    total_N: np.ndarray  # (n_frames,), of all plates
    reasons: tuple[Finding, ...]
    time0_s: float = 0.0

    @property
    def surely_measured(self) -> np.ndarray:
        """``valid`` where both feet have markers, (n_frames,) bool: one without may stand
        anywhere."""
        return self.valid & (set(self.on_ground) == {"l", "r"})


def foot_contacts(
    foot_markers_m: Mapping[str, np.ndarray],
    rate_hz: float,
    plates: Sequence[Plate],
    n_frames: int,
    time0_s: float = 0.0,
) -> Contacts:
    """Frames in which no foot stands beside the plates, which are at the marker rate.

    ``foot_markers_m`` per side "l"/"r" (n_frames, k, 3); ``time0_s`` of the first frame.
    """
    beside = nothing = np.zeros(n_frames, bool)
    if not plates:
        return Contacts(nothing, {}, {}, nothing, nothing, np.zeros(n_frames), ())
    usable = np.logical_and.reduce([plate.usable for plate in plates])
    total = np.sum([plate.lift_N for plate in plates], axis=0)
    on_ground, on_plate, reasons, valid = {}, {}, [], usable.copy()
    clock = rate_hz, time0_s, *_SAID
    where = "on the floor beside the plates"
    if any(plate.corners_m is None for plate in plates):
        where += ", or on one that bears nothing"
    for side, markers in foot_markers_m.items():
        foot = _Foot.of(markers, rate_hz)
        on_ground[side], on_plate[side] = _touches(foot, plates, rate_hz)
        off, name = on_ground[side] & ~on_plate[side], _SIDES.get(side, side) + " foot"
        valid &= ~off & foot.seen
        beside = beside | off
        said = (
            (off & usable, where),
            (~foot.seen, "no foot marker seen"),
        )
        for mask, words in said:
            if mask.any():
                reasons.append(_finding(name, f"{words}: {times(mask, *clock)}"))
    if not usable.all():
        reasons.append(_finding("", f"force samples unusable: {times(~usable, *clock)}"))
    known = valid, on_ground, on_plate, beside, usable, total, tuple(reasons)
    return Contacts(*known, time0_s)


def contact_windows(
    feet: Contacts,
    trunk_markers_m: np.ndarray,
    mass_kg: float | None,
    rate_hz: float,
    stands_kg: float | None = None,
    body_reach_m_s2: np.ndarray | None = None,
) -> Contacts:
    """Frames in which the plates measure all that touches the person.

    ``trunk_markers_m`` (n_frames, k, 3) stand for the centre of mass of ``mass_kg``. Where that is
    None, no frame can be shown to be free of other contacts, and none is valid. ``stands_kg`` is
    what the plates read of the person standing still: where that is less, the forces or the mass
    are wrong alike in all frames, and nothing else bears the person. ``body_reach_m_s2``
    (n_frames,) is what the vertical force has to be over the mass, by all segments: with it, what
    bears the person is left out from its first touch to its last.
    """
    reasons = feet.reasons
    if not feet.usable.any() or mass_kg is None:
        if feet.usable.any():
            reasons += (_finding("", NO_MASS),)
        return replace(feet, valid=np.zeros_like(feet.valid), reasons=reasons)
    shortest, mismatch = round(_LEAST_WINDOW_S * rate_hz), np.zeros_like(feet.valid)
    valid = long_runs(feet.valid, shortest)
    if (reach := reach_m_s2(trunk_markers_m, rate_hz)) is not None:
        measured_N, needed_N = low_pass(feet.total_N, rate_hz), mass_kg * reach
        weight_N = mass_kg * GRAVITY_M_S2
        allowed_N = _MISMATCH_SHARE * (weight_N + np.abs(needed_N - weight_N))
        different = np.abs(measured_N - needed_N) > allowed_N
        mismatch = long_runs(different, max(2, round(_MISMATCH_S * rate_hz)))
        if body_reach_m_s2 is not None:
            apart = measured_N / weight_N - body_reach_m_s2 / GRAVITY_M_S2
            mismatch = _from_its_start(mismatch, apart, feet.valid, TOUCHED_N / weight_N)
        valid = long_runs(feet.valid & ~mismatch, shortest)
        # Something else may bear the person in all of these frames, though in none for sure: a foot
        # on a plate that is not there, while the body sinks. In 181 trials of real and simulated
        # recordings the means agree to 5 % with the share of the weight that quiet standing shows.
        share = min(1.0, stands_kg / mass_kg) if stands_kg else 1.0
        least_N = (1.0 - _MISMATCH_SHARE / 2) * share * needed_N[valid].sum()
        if measured_N[valid].sum() < least_N:
            mismatch |= valid
            valid = np.zeros_like(valid)
    unexplained = np.zeros_like(mismatch)
    for start, stop in runs(mismatch):  # but for those that a foot beside the plates explains
        unexplained[start:stop] = feet.beside[start:stop].mean() < 0.5
    if unexplained.any():
        loaded = feet.valid & (feet.total_N > TOUCHED_N)
        cause = "a contact they do not measure (seat, box, hands, a plate that is not in the file) "
        cause += "or, if brief, an impact that the markers do not follow"
        if loaded.any() and mismatch[loaded].mean() > 0.5:
            cause = f"the mass by which they are judged, {mass_kg:.1f} kg, is wrong, or something "
            cause += "bears the person all the time (a plate that is not in the file, a rail)"
        force = f"the plates' {np.mean(feet.total_N[unexplained]):.0f} N do not carry the motion"
        when = times(unexplained, rate_hz, feet.time0_s, *_SAID)
        reasons += (_finding("", f"{force}: {cause} {when}"),)
    return replace(feet, valid=valid, reasons=reasons)


def _from_its_start(
    mismatch: np.ndarray, apart: np.ndarray, valid: np.ndarray, least: float
) -> np.ndarray:
    """Where something else clearly bears the person (n,), and before and after it where it bears
    less: the difference ``apart`` (n,) is beyond that of 19 of 20 of the other ``valid`` frames,
    and beyond the ``least`` that is a touch."""
    others = apart[valid & ~mismatch]
    if not mismatch.any() or not len(others):
        return mismatch
    usual = max(least, _IN_19_OF_20 * median_abs_deviation(others, scale="normal"))
    more = np.abs(apart - np.median(others)) > usual
    return np.asarray(binary_propagation(mismatch, mask=mismatch | more))


@dataclass(frozen=True, eq=False)
class _Foot:
    position_m: np.ndarray  # (n_frames, k, 2), horizontal
    height_m: np.ndarray  # (n_frames, k), over each marker's standing height; inf = unseen
    speed_m_s: np.ndarray  # (n_frames,), of the lowest marker
    seen: np.ndarray  # (n_frames,) bool
    lowest_m: np.ndarray  # (n_frames,), height of the lowest marker, NaN where none is seen

    @classmethod
    def of(cls, markers_m: np.ndarray, rate_hz: float) -> _Foot:
        """A marker's standing height is the 2nd percentile of its heights."""
        known = np.isfinite(markers_m).all(axis=-1)
        height_m = np.where(known, markers_m[..., 2], np.nan)
        height = np.nan_to_num(height_m - lowest(height_m), nan=np.inf)
        low_m = np.fmin.reduce(height_m, axis=1, initial=np.nan)
        frames, reach = np.arange(len(markers_m)), max(1, round(0.02 * rate_hz))
        after, before = np.minimum(frames + reach, frames[-1:]), np.maximum(frames - reach, 0)
        span = np.maximum(after - before, 1)[:, None, None]  # about 40 ms
        velocity = (markers_m[after] - markers_m[before]) / span * rate_hz
        speed = np.linalg.norm(velocity, axis=-1)[frames, height.argmin(axis=1)]
        speed = np.nan_to_num(speed, nan=0.0)
        return cls(markers_m[..., :2], height, speed, known.any(axis=1), low_m)

    def goes_below(self, corners_m: np.ndarray) -> bool:
        """Whether a surface is a step to this foot, which also stands lower."""
        return float(lowest(self.lowest_m[:, None])[0]) < corners_m[:, 2].mean() + LOWEST_M[0]


def _touches(foot: _Foot, plates: Sequence[Plate], rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether the foot touches, and whether a plate measures it, (n_frames,) bool each.

    A foot on a moving belt is not slow, nor is one on a step as low as elsewhere: the load under it
    decides.
    """
    on_step = np.zeros(len(foot.seen), bool)
    near_load = np.zeros(len(foot.seen), bool)  # a marker is near the load of a plate
    for plate in plates:
        gap = np.linalg.norm(foot.position_m - plate.cop_m()[:, None], axis=-1)
        is_close = (np.nan_to_num(gap, nan=np.inf) < _COP_DISTANCE_M).any(axis=1)
        bears = (plate.lift_N > TOUCHED_N) & is_close
        near_load |= bears
        if plate.corners_m is not None and foot.goes_below(plate.corners_m):
            above = foot.lowest_m - plate.corners_m[:, 2].mean()
            on_step |= bears & (above > LOWEST_M[0]) & (above < LOWEST_M[1])
    low = foot.height_m.min(axis=1) < _TOUCH_HEIGHT_M
    touching = (low & ((foot.speed_m_s < _TOUCH_SPEED_M_S) | near_load)) | on_step
    outlines = [plate.corners_m for plate in plates if plate.corners_m is not None]
    sole = foot.height_m < SOLE_HEIGHT_M
    on_some = ~sole if outlines else np.zeros_like(sole)
    for corners in outlines:
        on_some |= inside_outline(foot.position_m, corners, _OUTLINE_TOLERANCE_M)
    measured = np.all(on_some, axis=1)  # every low marker of the foot lies on one plate or another
    if len(outlines) < len(plates):
        measured |= near_load
    off = long_runs(touching & ~measured, max(1, round(_BLINK_S * rate_hz)))
    off = _until_toe_off(off, sole.all(axis=1) & measured, foot, rate_hz)
    on_ground = (touching & measured) | off
    return on_ground, on_ground & ~off


def _until_toe_off(
    off: np.ndarray, standing: np.ndarray, foot: _Foot, rate_hz: float
) -> np.ndarray:
    """Contacts beside the plates (n_frames,) until the toes have left the floor, or the whole foot
    is standing (n_frames,) on a plate: its markers rise well before the toes do."""
    rolling = foot.height_m.min(axis=1) < _ROLL_HEIGHT_M
    rolling &= (foot.speed_m_s < _ROLL_SPEED_M_S) & ~standing
    longest = round(_ROLL_S * rate_hz)
    lasting = off.copy()
    for _, stop in runs(off):
        has_left = ~rolling[stop : stop + longest]
        lasting[stop : stop + (has_left.argmax() if has_left.any() else len(has_left))] = True
    return lasting


def inside_outline(points_m: np.ndarray, corners_m: np.ndarray, tolerance_m: float) -> np.ndarray:
    """Points (..., 2) in the rectangle of corners (4, 3) widened by the tolerance."""
    along, half = outline(points_m, corners_m)  # NaN is nowhere inside
    return np.asarray((along <= half + tolerance_m).all(axis=-1))


def _finding(subject: str, found: str) -> Finding:
    action = "left these frames out"
    return Finding("contacts", subject, found, "every contact on a plate", action, "excluded")


# --- the balance of vertical forces ---------------------------------------------------------------


def agreeing_mass(
    total_force_z_N: np.ndarray,
    trunk_markers_m: np.ndarray,
    frames: np.ndarray,
    rate_hz: float,
) -> float | None:
    """The largest mass [kg] with which the force goes with the trunk's motion in many of the
    ``frames`` (n_frames,) bool: in half as many as with any other.

    Only good enough to find frames in which something else bears the person; the largest, because
    what bears a person takes weight off the plates. None without load or trunk markers.
    """
    reach = reach_m_s2(trunk_markers_m, rate_hz)
    if reach is None:
        return None
    measured = low_pass(total_force_z_N, rate_hz)
    loaded = frames & (measured > 5 * TOUCHED_N) & (reach > GRAVITY_M_S2 / 2)
    if not loaded.any():
        return None
    masses = np.sort(measured[loaded] / reach[loaded])
    near = 1.0 + _MISMATCH_SHARE / 2
    above = np.searchsorted(masses, masses * near, side="right")
    count = above - np.searchsorted(masses, masses / near)
    return float(masses[count >= count.max() / 2].max() / np.sqrt(near))


# --- which plate measures which foot --------------------------------------------------------------


SIDES = ("l", "r")
_NOBODY, _LEFT, _RIGHT, _SHARED, _UNCLEAR = -1, 0, 1, 2, 3
_NEARER = 0.5  # of the other foot's distance: so near a centre of pressure is under one foot alone
_AGREE = 0.95  # of a contact's impulse, where the centre of pressure alone shows the foot
_AROUND_S = 0.05  # about a load: what the plate reads below the threshold is still the foot's


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
    plates: Sequence[Plate],
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
    shape = len(plates), count
    owners = np.array([_owner(p, feet_m, on_ground, rate_hz) for p in plates]).reshape(shape)
    readings = np.array([p.wrench for p in plates]).reshape(*shape, 6)
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


def plate_noise(plate: Plate, at_m: np.ndarray) -> np.ndarray:
    """(6,) standard deviation of the white noise of a loaded plate's channels about a point (3,).

    Third differences leave little of movement; the median of their size is not moved by impacts.
    Their variance is 20 times that of the noise.
    """
    loaded = np.nan_to_num(plate.lift_N) > TOUCHED_N
    moved = plate.wrench.copy()
    moved[:, 3:] -= np.cross(at_m, plate.wrench[:, :3])
    whole = loaded[3:] & loaded[2:-1] & loaded[1:-2] & loaded[:-3]
    third = np.diff(moved, n=3, axis=0)[whole]
    third = third[np.isfinite(third).all(axis=1)]
    if not len(third):
        return np.zeros(6)
    return np.asarray(1.4826 * np.median(np.abs(third), axis=0) / np.sqrt(20.0))


def _owner(
    plate: Plate,
    feet_m: Mapping[str, np.ndarray],
    on_ground: Mapping[str, np.ndarray],
    rate_hz: float,
) -> np.ndarray:
    """(N,) whose load the plate bears: by low points on its outline, else by its load.

    The owner of a load owns what the plate reads shortly before and after it.
    """
    loaded = np.nan_to_num(plate.lift_N) > TOUCHED_N
    on = np.zeros((2, len(loaded)), bool)
    for k, side in enumerate(SIDES):
        if plate.corners_m is None:
            continue
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
    plate: Plate,
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
        if len(frames):  # who hardly loads it, as before a chair is left, hardly shows where
            kinds, which = np.unique(owner[frames], return_inverse=True)
            loads = np.bincount(which, weights=plate.lift_N[frames])
            is_one = loads.max() >= _AGREE * loads.sum()
            owner[frames] = kinds[loads.argmax()] if is_one else _UNCLEAR
    return owner


def _distance(places_m: np.ndarray, foot_m: np.ndarray) -> np.ndarray:
    """(N,) from places (N, 2) to the nearest line between two points of a foot (N, k, 2)."""
    gaps = []
    for i, j in combinations(range(foot_m.shape[1]), 2):
        along, away = foot_m[:, j] - foot_m[:, i], places_m - foot_m[:, i]
        share = np.einsum("nc,nc->n", away, along) / np.maximum((along**2).sum(axis=1), 1e-9)
        gaps.append(np.linalg.norm(away - np.clip(share, 0, 1)[:, None] * along, axis=1))
    return np.min(gaps, axis=0)
