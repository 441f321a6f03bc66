"""When everything that touches the person is measured by a plate: by where the feet are, and by
whether the plates' vertical force carries the motion of the trunk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import long_runs, runs, times
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.plates import cop_at_height
from bsip_cli.recordings.resample import FrameWrench
from bsip_cli.recordings.under_the_feet import outline

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
_BLINK_S = 0.06  # shorter touches without load are no touch
_LEAST_WINDOW_S = 0.1
_TRUNK_CUTOFF_HZ = 6.0
_SAID = 2, 6  # of times: digits, and so many at most


@dataclass(frozen=True, eq=False)
class PlateLoad:
    """One plate at the marker rate."""

    name: str
    corners_m: np.ndarray | None  # (4, 3)
    force_z_N: np.ndarray  # (n_frames,)
    cop_m: np.ndarray  # (n_frames, 2), NaN without load
    usable: np.ndarray  # (n_frames,) bool


@dataclass(frozen=True, eq=False)
class ContactWindows:
    valid: np.ndarray  # (n_frames,) bool: every contact is measured
    on_ground: dict[str, np.ndarray]  # side -> (n_frames,) bool
    on_plate: dict[str, np.ndarray]  # side -> (n_frames,) bool: touches, and is measured
    reasons: tuple[Finding, ...]


def plate_loads(recording: Recording, wrench: FrameWrench) -> tuple[PlateLoad, ...]:
    """The plates of a recording as `contact_windows` wants them."""
    loads = []
    for plate, rows, usable in zip(
        recording.plates, wrench.per_plate, wrench.plate_usable, strict=True
    ):
        height = 0.0 if plate.corners_m is None else float(plate.corners_m[:, 2].mean())
        cop = cop_at_height(rows[:, :3], rows[:, 3:], height)
        cop[rows[:, 2] < TOUCHED_N] = np.nan
        loads.append(PlateLoad(plate.name, plate.corners_m, rows[:, 2], cop, usable))
    return tuple(loads)


def bears_alone(plate: PlateLoad, plates: Sequence[PlateLoad]) -> np.ndarray:
    """Frames in which no other plate is touched, (n_frames,) bool."""
    others = [np.abs(one.force_z_N) < TOUCHED_N for one in plates if one is not plate]
    return np.logical_and.reduce([plate.usable, *others])


@dataclass(frozen=True, eq=False)
class FootContacts:
    """What the feet's markers say of the contacts, whatever the person's mass."""

    measured: np.ndarray  # (n_frames,) bool: samples usable, no foot beside the plates
    on_ground: dict[str, np.ndarray]  # side -> (n_frames,) bool
    on_plate: dict[str, np.ndarray]  # side -> (n_frames,) bool
    beside: np.ndarray  # (n_frames,) bool: a foot on the floor beside the plates
    usable: np.ndarray  # (n_frames,) bool
    total_N: np.ndarray  # (n_frames,), of all plates
    reasons: tuple[Finding, ...]

    @property
    def has_both(self) -> bool:
        """Both feet have markers; a foot without any may stand anywhere."""
        return set(self.on_ground) == {"l", "r"}

    @property
    def surely_measured(self) -> np.ndarray:
        """``measured`` where both feet are seen, (n_frames,) bool."""
        return self.measured & self.has_both


def foot_contacts(
    foot_markers_m: Mapping[str, np.ndarray],
    rate_hz: float,
    plates: Sequence[PlateLoad],
    n_frames: int,
) -> FootContacts:
    """Frames in which no foot stands beside the plates.

    ``foot_markers_m`` per side "l"/"r" (n_frames, k, 3).
    """
    beside = nothing = np.zeros(n_frames, bool)
    if not plates:
        return FootContacts(nothing, {}, {}, nothing, nothing, np.zeros(n_frames), ())
    usable = np.logical_and.reduce([plate.usable for plate in plates])
    total = np.sum([plate.force_z_N for plate in plates], axis=0)
    on_ground, on_plate, reasons, measured = {}, {}, [], usable.copy()
    for side, markers in foot_markers_m.items():
        foot = _Foot.of(markers, rate_hz)
        on_ground[side], on_plate[side] = _touches(foot, plates, rate_hz)
        off, name = on_ground[side] & ~on_plate[side], _SIDES.get(side, side) + " foot"
        measured &= ~off & foot.seen
        beside = beside | off
        said = (
            (off & usable, "on the floor beside the plates"),
            (~foot.seen, "no foot marker seen"),
        )
        for mask, words in said:
            if mask.any():
                reasons.append(_finding(name, f"{words}: {times(mask, rate_hz, *_SAID)}"))
    if not usable.all():
        reasons.append(_finding("", f"force samples unusable: {times(~usable, rate_hz, *_SAID)}"))
    return FootContacts(measured, on_ground, on_plate, beside, usable, total, tuple(reasons))


def contact_windows(
    feet: FootContacts,
    trunk_markers_m: np.ndarray,
    mass_kg: float | None,
    rate_hz: float,
    stands_kg: float | None = None,
) -> ContactWindows:
    """Frames in which the plates measure all that touches the person.

    ``trunk_markers_m`` (n_frames, k, 3) stand for the centre of mass of ``mass_kg``. Where that is
    None, no frame can be shown to be free of other contacts, and none is valid. ``stands_kg`` is
    what the plates read of the person standing still: where that is less, the forces or the mass
    are wrong alike in all frames, and nothing else bears the person.
    """
    reasons = feet.reasons
    if not feet.usable.any() or mass_kg is None:
        if feet.usable.any():
            reasons += (_finding("", NO_MASS),)
        nothing = np.zeros(len(feet.measured), bool)
        return ContactWindows(nothing, feet.on_ground, feet.on_plate, reasons)
    balance = _vertical_forces(feet.total_N, trunk_markers_m, mass_kg, rate_hz)
    mismatch = np.zeros_like(feet.measured)
    if balance is not None:
        mismatch = _mismatch(*balance, mass_kg * GRAVITY_M_S2, rate_hz)
    shortest = round(_LEAST_WINDOW_S * rate_hz)
    valid = long_runs(feet.measured & ~mismatch, shortest)
    least_share = min(1.0, stands_kg / mass_kg) if stands_kg else 1.0
    if balance is not None and _is_borne(balance, valid, least_share):
        mismatch |= valid  # what a person does not weigh is missing in all of it
        valid = np.zeros_like(valid)
    unexplained = np.zeros_like(mismatch)
    for start, stop in runs(mismatch):  # but for those that a foot beside the plates explains
        unexplained[start:stop] = feet.beside[start:stop].mean() < 0.5
    if unexplained.any():
        loaded = feet.measured & (feet.total_N > TOUCHED_N)
        cause = "a contact they do not measure (seat, box, hands, a plate that is not in the file)"
        if loaded.any() and mismatch[loaded].mean() > 0.5:
            cause = f"the mass of {mass_kg:.1f} kg is wrong, or something bears the person all the "
            cause += "time (a plate that is not in the file, a rail)"
        force = f"the plates' {np.mean(feet.total_N[unexplained]):.0f} N do not carry the motion"
        reasons += (_finding("", f"{force}: {cause} {times(unexplained, rate_hz, *_SAID)}"),)
    return ContactWindows(valid, feet.on_ground, feet.on_plate, reasons)


@dataclass(frozen=True, eq=False)
class _Foot:
    position_m: np.ndarray  # (n_frames, k, 2), horizontal
    height_m: np.ndarray  # (n_frames, k), over each marker's standing height; inf = unseen
    speed_m_s: np.ndarray  # (n_frames,), of the lowest marker
    seen: np.ndarray  # (n_frames,) bool

    @classmethod
    def of(cls, markers_m: np.ndarray, rate_hz: float) -> _Foot:
        """A marker's standing height is the 2nd percentile of its heights."""
        known = np.isfinite(markers_m).all(axis=-1)
        columns = zip(markers_m[..., 2].T, known.T, strict=True)
        height0_m = np.array([np.percentile(z[k], 2) if k.any() else 0.0 for z, k in columns])
        height = np.where(known, np.nan_to_num(markers_m[..., 2]) - height0_m, np.inf)
        frames, reach = np.arange(len(markers_m)), max(1, round(0.02 * rate_hz))
        after, before = np.minimum(frames + reach, frames[-1:]), np.maximum(frames - reach, 0)
        span = np.maximum(after - before, 1)[:, None, None]  # about 40 ms
        velocity = (markers_m[after] - markers_m[before]) / span * rate_hz
        speed = np.linalg.norm(velocity, axis=-1)[frames, height.argmin(axis=1)]
        return cls(markers_m[..., :2], height, np.nan_to_num(speed, nan=0.0), known.any(axis=1))


def _touches(
    foot: _Foot, plates: Sequence[PlateLoad], rate_hz: float
) -> tuple[np.ndarray, np.ndarray]:
    """Whether the foot touches, and whether a plate measures it, (n_frames,) bool each.

    A foot on a moving belt is not slow: the load under it decides.
    """
    near_load = np.zeros(len(foot.seen), bool)  # a marker is near the load of a plate
    for plate in plates:
        gap = np.linalg.norm(foot.position_m - plate.cop_m[:, None], axis=-1)
        is_close = (np.nan_to_num(gap, nan=np.inf) < _COP_DISTANCE_M).any(axis=1)
        near_load |= (plate.force_z_N > TOUCHED_N) & is_close
    low = foot.height_m.min(axis=1) < _TOUCH_HEIGHT_M
    touching = low & ((foot.speed_m_s < _TOUCH_SPEED_M_S) | near_load)
    outlines = [plate.corners_m for plate in plates if plate.corners_m is not None]
    sole = foot.height_m < SOLE_HEIGHT_M
    inside = np.zeros(sole.shape, bool)
    for corners in outlines:
        inside |= inside_outline(foot.position_m, corners, _OUTLINE_TOLERANCE_M)
    # Every low marker of the foot lies on one plate or another.
    measured = np.all(inside | ~sole, axis=1) if outlines else np.zeros_like(low)
    if len(outlines) < len(plates):
        measured = measured | near_load
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


def _vertical_forces(
    total_force_z_N: np.ndarray, trunk_markers_m: np.ndarray, mass_kg: float, rate_hz: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """What the plates measure, and what the trunk's motion needs, (n_frames,) each."""
    reach = reach_m_s2(trunk_markers_m, rate_hz)
    return None if reach is None else (low_pass(total_force_z_N, rate_hz), mass_kg * reach)


def _mismatch(
    measured_N: np.ndarray, needed_N: np.ndarray, weight_N: float, rate_hz: float
) -> np.ndarray:
    """Frames in which the trunk's motion needs another vertical force than measured."""
    allowed = _MISMATCH_SHARE * (weight_N + np.abs(needed_N - weight_N))
    different = np.abs(measured_N - needed_N) > allowed
    return long_runs(different, max(2, round(_MISMATCH_S * rate_hz)))


def _is_borne(balance: tuple[np.ndarray, np.ndarray], frames: np.ndarray, share: float) -> bool:
    """Whether something else bears the person in the mean of frames that each might do: a foot on a
    plate that is not there, while the body sinks. In 181 trials of real and simulated recordings
    the means agree to 5 % with the ``share`` of the weight that quiet standing shows."""
    measured_N, needed_N = (force_N[frames].sum() for force_N in balance)
    return bool(measured_N < (1.0 - _MISMATCH_SHARE / 2) * share * needed_N)


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
    return float(masses[count >= count.max() / 2].max()) / np.sqrt(near)


def reach_m_s2(trunk_markers_m: np.ndarray, rate_hz: float) -> np.ndarray | None:
    """Gravity and the vertical acceleration of the markers' mean (n_frames, k, 3), low-passed,
    (n_frames,)."""
    height = mean_path(trunk_markers_m[..., 2])
    if height is None:
        return None
    velocity = np.gradient(low_pass(height, rate_hz)) * rate_hz
    return GRAVITY_M_S2 + np.gradient(velocity) * rate_hz


def mean_path(height: np.ndarray) -> np.ndarray | None:
    """Mean of one coordinate (n_frames, k) of the markers seen nearly always, gaps interpolated,
    (n_frames,); None without such a marker."""
    known = np.isfinite(height)
    if not height.size or len(height) < 10:
        return None
    often = np.flatnonzero(known.mean(axis=0) > 0.9)
    if not len(often):
        return None
    frames = np.arange(len(height))
    filled = [np.interp(frames, frames[known[:, i]], height[known[:, i], i]) for i in often]
    return np.mean(filled, axis=0)


def low_pass(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """Zero phase, order 4."""
    cutoff = min(_TRUNK_CUTOFF_HZ, 0.45 * rate_hz)
    sections = butter(2, cutoff, fs=rate_hz, output="sos")
    pad = min(len(signal) - 1, round(rate_hz))
    return sosfiltfilt(sections, np.asarray(signal), padlen=pad)
