"""When everything that touches the person is measured by a plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.analog import long_runs, runs
from bsip_cli.recordings.force_balance import ContactLimits, force_mismatch
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.plates import cop_at_height
from bsip_cli.recordings.resample import FrameWrench

NO_MASS = (
    "whether something else bears the person (seat, box, hands) cannot be told: neither a stated "
    "mass nor this trial's plates tell what the person weighs"
)
_SIDES = {"l": "left", "r": "right"}


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

    def windows(self, rate_hz: float) -> list[tuple[float, float]]:
        """Valid stretches [s from the first frame]."""
        return [(a / rate_hz, b / rate_hz) for a, b in runs(self.valid)]


def plate_loads(recording: Recording, wrench: FrameWrench) -> tuple[PlateLoad, ...]:
    """The plates of a recording as `contact_windows` wants them."""
    loads = []
    for plate, rows, usable in zip(
        recording.plates, wrench.per_plate, wrench.plate_usable, strict=True
    ):
        height = 0.0 if plate.corners_m is None else float(plate.corners_m[:, 2].mean())
        cop = cop_at_height(rows[:, :3], rows[:, 3:], height)
        cop[rows[:, 2] < ContactLimits.loaded_N] = np.nan
        loads.append(PlateLoad(plate.name, plate.corners_m, rows[:, 2], cop, usable))
    return tuple(loads)


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


def foot_contacts(
    foot_markers_m: Mapping[str, np.ndarray],
    foot_height0_m: Mapping[str, np.ndarray | None],
    rate_hz: float,
    plates: Sequence[PlateLoad],
    n_frames: int,
    limits: ContactLimits | None = None,
) -> FootContacts:
    """Frames in which no foot stands beside the plates.

    ``foot_markers_m`` per side "l"/"r" (n_frames, k, 3); ``foot_height0_m`` per side the
    standing height of each marker (k,), or None: then the 2nd percentile of its heights.
    """
    limits = limits or ContactLimits()
    nothing = np.zeros(n_frames, bool)
    if not plates:
        reason = _finding("", "no force plate", "no frame is compared")
        return FootContacts(nothing, {}, {}, nothing, nothing, np.zeros(n_frames), (reason,))
    usable = np.logical_and.reduce([plate.usable for plate in plates])
    total = np.sum([plate.force_z_N for plate in plates], axis=0)
    on_ground, on_plate, reasons = {}, {}, []
    measured, beside = usable.copy(), nothing
    for side, markers in foot_markers_m.items():
        foot = _Foot.of(markers, foot_height0_m.get(side), rate_hz)
        on_ground[side], on_plate[side] = _touches(foot, plates, rate_hz, limits)
        off = on_ground[side] & ~on_plate[side]
        measured &= ~off & foot.seen
        beside = beside | off
        reasons += _foot_findings(side, off, ~foot.seen, rate_hz)
    if not usable.all():
        reasons.append(_finding("", f"force samples unusable: {_times(~usable, rate_hz)}"))
    return FootContacts(measured, on_ground, on_plate, beside, usable, total, tuple(reasons))


def contact_windows(
    feet: FootContacts,
    trunk_markers_m: np.ndarray,
    mass_kg: float | None,
    rate_hz: float,
    limits: ContactLimits | None = None,
) -> ContactWindows:
    """Frames in which the plates measure all that touches the person.

    ``trunk_markers_m`` (n_frames, k, 3) stand for the centre of mass of ``mass_kg``. Where that is
    None, no frame can be shown to be free of other contacts, and none is valid.
    """
    limits = limits or ContactLimits()
    if not feet.usable.any() or mass_kg is None:
        reasons = feet.reasons
        if feet.usable.any():
            reasons += (_finding("", NO_MASS),)
        nothing = np.zeros(len(feet.measured), bool)
        return ContactWindows(nothing, feet.on_ground, feet.on_plate, reasons)
    mismatch = force_mismatch(feet.total_N, trunk_markers_m, mass_kg, rate_hz, limits)
    valid = feet.measured & ~mismatch
    unexplained = _runs_apart_from(mismatch, feet.beside)
    loaded = feet.measured & (feet.total_N > limits.loaded_N)
    throughout = bool(loaded.any()) and mismatch[loaded].mean() > 0.5
    findings = _force_findings(unexplained, feet.total_N, mass_kg, throughout, rate_hz)
    reasons = (*feet.reasons, *findings)
    valid = long_runs(valid, round(limits.least_window_s * rate_hz))
    return ContactWindows(valid, feet.on_ground, feet.on_plate, reasons)


@dataclass(frozen=True, eq=False)
class _Foot:
    position_m: np.ndarray  # (n_frames, k, 2), horizontal
    height_m: np.ndarray  # (n_frames, k), over each marker's standing height; inf = unseen
    speed_m_s: np.ndarray  # (n_frames,), of the lowest marker
    seen: np.ndarray  # (n_frames,) bool

    @classmethod
    def of(cls, markers_m: np.ndarray, height0_m: np.ndarray | None, rate_hz: float) -> _Foot:
        known = np.isfinite(markers_m).all(axis=-1)
        if height0_m is None:
            height0_m = _low_percentile(markers_m[..., 2], known)
        height = np.where(known, np.nan_to_num(markers_m[..., 2]) - height0_m, np.inf)
        speed = np.linalg.norm(_central_difference(markers_m, rate_hz), axis=-1)
        lowest = height.argmin(axis=1)
        frames = np.arange(len(markers_m))
        return cls(
            position_m=markers_m[..., :2],
            height_m=height,
            speed_m_s=np.nan_to_num(speed[frames, lowest], nan=0.0),
            seen=known.any(axis=1),
        )


def _low_percentile(height_m: np.ndarray, known: np.ndarray) -> np.ndarray:
    """2nd percentile of each marker's heights over time, zero if never seen, (k,)."""
    columns = zip(height_m.T, known.T, strict=True)
    return np.array([np.percentile(z[k], 2) if k.any() else 0.0 for z, k in columns])


def _central_difference(markers_m: np.ndarray, rate_hz: float) -> np.ndarray:
    """Velocity over about 40 ms, (n_frames, k, 3)."""
    reach = max(1, round(0.02 * rate_hz))
    frames = np.arange(len(markers_m))
    after = np.minimum(frames + reach, len(frames) - 1)
    before = np.maximum(frames - reach, 0)
    span = np.maximum(after - before, 1)[:, None, None]
    return (markers_m[after] - markers_m[before]) / span * rate_hz


def _touches(
    foot: _Foot, plates: Sequence[PlateLoad], rate_hz: float, limits: ContactLimits
) -> tuple[np.ndarray, np.ndarray]:
    """Whether the foot touches, and whether a plate measures it, (n_frames,) bool each.

    A foot on a moving belt is not slow: the load under it tells.
    """
    near_load = _near_load(foot, plates, limits)
    low = foot.height_m.min(axis=1) < limits.touch_height_m
    touching = low & ((foot.speed_m_s < limits.touch_speed_m_s) | near_load)
    outlines = [plate.corners_m for plate in plates if plate.corners_m is not None]
    inside = _inside_outlines(foot, outlines, limits) if outlines else np.zeros_like(low)
    without_outline = any(plate.corners_m is None for plate in plates)
    measured = inside | near_load if without_outline else inside
    off = long_runs(touching & ~measured, max(1, round(limits.blink_s * rate_hz)))
    flat = (foot.height_m < limits.sole_height_m).all(axis=1)
    off = _until_toe_off(off, flat & measured, foot, rate_hz, limits)
    on_ground = (touching & measured) | off
    return on_ground, on_ground & ~off


def _until_toe_off(
    off: np.ndarray, standing: np.ndarray, foot: _Foot, rate_hz: float, limits: ContactLimits
) -> np.ndarray:
    """Contacts beside the plates (n_frames,) until the toes have left the floor, or the whole foot
    is standing (n_frames,) on a plate: its markers rise well before the toes do."""
    rolling = foot.height_m.min(axis=1) < limits.roll_height_m
    rolling &= (foot.speed_m_s < limits.roll_speed_m_s) & ~standing
    longest = round(limits.roll_s * rate_hz)
    lasting = off.copy()
    for _, stop in runs(off):
        has_left = ~rolling[stop : stop + longest]
        lasting[stop : stop + (has_left.argmax() if has_left.any() else len(has_left))] = True
    return lasting


def _near_load(foot: _Foot, plates: Sequence[PlateLoad], limits: ContactLimits) -> np.ndarray:
    """A foot marker lies close to the centre of pressure of a loaded plate, (n_frames,)."""
    near = np.zeros(len(foot.seen), bool)
    for plate in plates:
        gap = np.linalg.norm(foot.position_m - plate.cop_m[:, None], axis=-1)
        is_close = (np.nan_to_num(gap, nan=np.inf) < limits.cop_distance_m).any(axis=1)
        near |= (plate.force_z_N > limits.loaded_N) & is_close
    return near


def _inside_outlines(
    foot: _Foot, outlines: Sequence[np.ndarray], limits: ContactLimits
) -> np.ndarray:
    """Every low marker of the foot lies on one plate or another, (n_frames,)."""
    sole = foot.height_m < limits.sole_height_m
    inside = np.zeros(sole.shape, bool)
    for corners in outlines:
        inside |= inside_outline(foot.position_m, corners[:, :2], limits.outline_tolerance_m)
    return np.asarray((inside | ~sole).all(axis=1))


def inside_outline(points_m: np.ndarray, corners_m: np.ndarray, tolerance_m: float) -> np.ndarray:
    """Points (..., 2) in the rectangle of corners (4, 2) widened by the tolerance."""
    x, y = corners_m[0] - corners_m[1], corners_m[0] - corners_m[3]
    offset = points_m - corners_m.mean(axis=0)  # NaN is nowhere inside
    inside = np.ones(points_m.shape[:-1], bool)
    for side in (x, y):
        length = np.linalg.norm(side)
        along = offset[..., 0] * side[0] / length + offset[..., 1] * side[1] / length
        inside &= np.abs(along) <= length / 2 + tolerance_m
    return inside


def _foot_findings(side: str, off: np.ndarray, unseen: np.ndarray, rate_hz: float) -> list[Finding]:
    name = _SIDES.get(side, side) + " foot"
    findings = []
    if off.any():
        findings.append(_finding(name, f"on the floor beside the plates: {_times(off, rate_hz)}"))
    if unseen.any():
        findings.append(_finding(name, f"no foot marker seen: {_times(unseen, rate_hz)}"))
    return findings


def _runs_apart_from(mask: np.ndarray, explained: np.ndarray) -> np.ndarray:
    """The runs of ``mask`` of which less than half is explained."""
    apart = np.zeros_like(mask)
    for start, stop in runs(mask):
        apart[start:stop] = explained[start:stop].mean() < 0.5
    return apart


def _force_findings(
    mismatch: np.ndarray, total_N: np.ndarray, mass_kg: float, throughout: bool, rate_hz: float
) -> list[Finding]:
    """``throughout``: most of the loaded frames do not fit, so that the mass may be wrong."""
    if not mismatch.any():
        return []
    force = f"the plates' {np.mean(total_N[mismatch]):.0f} N do not carry the motion"
    if throughout:
        cause = f"the mass of {mass_kg:.1f} kg is wrong, or something bears the person all the time"
    else:
        cause = "a contact they do not measure (seat, box, hands)"
    return [_finding("", f"{force}: {cause} {_times(mismatch, rate_hz)}")]


def _finding(subject: str, found: str, action: str = "left these frames out") -> Finding:
    return Finding("contacts", subject, found, "every contact on a plate", action, "excluded")


def _times(mask: np.ndarray, rate_hz: float, most: int = 6) -> str:
    """The stretches of True in words."""
    stretches = runs(mask)
    words = [f"{a / rate_hz:.2f} to {b / rate_hz:.2f} s" for a, b in stretches[:most]]
    more = f" and {len(stretches) - most} more" if len(stretches) > most else ""
    return ", ".join(words) + more
