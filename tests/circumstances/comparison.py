"""Compare what was taken from a trial with the truth, up to a turn and a shift of the lab."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import convolve1d
from scipy.optimize import linear_sum_assignment

from tests.circumstances.sound import Trial
from tests.circumstances.taken import TakenTrial

# What counts as right. The sound recordings keep them with a margin of two or more.
RATE, SCALE, VERTICAL_FORCE = 0.005, 0.005, 0.02
COP_MEDIAN_M, COP_P95_M = 0.010, 0.030
HORIZONTAL_N, TORQUE_NM = 10.0, 3.0
FORCE_RMS_SHARE = 0.05  # of the body's weight
MARKER_M, MARKER_SHARE = 0.03, 0.001
LABELS_SHARE = 0.9
TILT_DEG = 2.0
# Forces of so much of the measured time are numbers that are passed on; so much is most of it.
SOME_SHARE, MOST_SHARE = 0.1, 0.7
LOADED_SHARE = 0.12  # of the body's weight: a plate's centre of pressure is judged


@dataclass(frozen=True)
class Comparison:
    """wrong : quantities whose numbers are wrong, with what was found.

    kept_share : of the time that the plates measured every contact, in which forces are passed on.
    """

    wrong: dict[str, str]
    has_markers: bool
    kept_share: float

    @property
    def has_forces(self) -> bool:
        return self.kept_share > SOME_SHARE

    @property
    def is_whole(self) -> bool:
        return self.has_markers and self.kept_share > MOST_SHARE


@dataclass(frozen=True, eq=False)
class _Lab:
    """taken = scale * turn @ truth + shift_m; turn may mirror."""

    scale: float
    turn: np.ndarray
    shift_m: np.ndarray

    @property
    def mirrored(self) -> bool:
        return bool(np.linalg.det(self.turn) < 0)

    def points(self, taken_m: np.ndarray) -> np.ndarray:
        return (taken_m - self.shift_m) @ self.turn / self.scale

    def wrench(self, taken: np.ndarray) -> np.ndarray:
        """(n, 6) about the truth's origin, in the truth's axes."""
        force, moment = taken[:, :3], taken[:, 3:]
        moment = (moment - np.cross(self.shift_m, force)) / self.scale
        return np.hstack([force @ self.turn, np.linalg.det(self.turn) * moment @ self.turn])


def compare(
    taken: TakenTrial, truth: Trial, labels: tuple[str, ...], lost: np.ndarray, weight_N: float
) -> Comparison:
    """lost : (n, markers) where the export hid a marker."""
    wrong = _rate(taken, truth)
    frames = _truth_frames(taken, truth)
    common = [name for name in labels if np.isfinite(taken.markers_m.get(name, np.nan)).any()]
    if len(common) < 6:
        return Comparison(wrong, False, 0.0)
    if len(common) < LABELS_SHARE * len(labels):
        wrong["labels"] = f"{len(common)} of {len(labels)} markers"
    columns = [labels.index(name) for name in common]
    points = np.stack([taken.markers_m[name] for name in common], axis=1)
    true, hidden = truth.markers_m[frames][:, columns], lost[frames][:, columns]
    seen = ~hidden & np.isfinite(points + true).all(axis=2)
    lab = _fitted(points, true, seen)
    wrong |= _markers(lab, points, true)
    use = taken.valid & np.isfinite(taken.wrench).all(axis=1)
    kept_share = float(use.mean() / truth.measured_share)
    if kept_share > SOME_SHARE:
        wrong |= _forces(lab, taken, truth, frames, use, weight_N)
    return Comparison(wrong, True, kept_share)


def _rate(taken: TakenTrial, truth: Trial) -> dict[str, str]:
    rate = 1.0 / np.median(np.diff(taken.time_s)) if len(taken.time_s) > 1 else 0.0
    if abs(rate / truth.rate_hz - 1.0) > RATE:
        return {"rate": f"{rate:.2f} Hz for {truth.rate_hz:.2f} Hz"}
    if len(taken.time_s) < 0.9 * len(truth.time_s):
        return {"rate": f"{len(taken.time_s)} frames of {len(truth.time_s)}"}
    return {}


def _truth_frames(taken: TakenTrial, truth: Trial) -> np.ndarray:
    """The truth's frame of each taken one: by number if all are there, else by time."""
    if len(taken.time_s) == len(truth.time_s):
        return np.arange(len(truth.time_s))
    frames = np.round((taken.time_s - taken.time_s[0]) * truth.rate_hz).astype(int)
    return np.clip(frames, 0, len(truth.time_s) - 1)


def _fitted(points: np.ndarray, true: np.ndarray, use: np.ndarray) -> _Lab:
    """Least squares over the points that were not hidden; the better of turned and mirrored."""
    a, b = true[use], points[use]
    centre_a, centre_b = np.median(a, axis=0), np.median(b, axis=0)
    for _ in range(4):
        u, _, vt = np.linalg.svd((b - centre_b).T @ (a - centre_a))
        turn = u @ vt
        scale = np.median(
            np.linalg.norm(b - centre_b, axis=1) / np.linalg.norm(a - centre_a, axis=1).clip(1e-9)
        )
        shift = np.median(b - scale * a @ turn.T, axis=0)
        error = np.linalg.norm(b - scale * a @ turn.T - shift, axis=1)
        kept = error <= 3.0 * np.median(error) + 1e-6
        a, b = a[kept], b[kept]
        centre_a, centre_b = a.mean(axis=0), b.mean(axis=0)
    return _Lab(float(scale), turn, shift)


def _markers(lab: _Lab, points: np.ndarray, true: np.ndarray) -> dict[str, str]:
    wrong = {}
    if abs(lab.scale - 1.0) > SCALE:
        wrong["scale"] = f"lengths times {lab.scale:.4g}"
    if lab.mirrored:
        wrong["handedness"] = "mirrored"
    tilt = np.rad2deg(np.arccos(np.clip(lab.turn[2, 2], -1.0, 1.0)))
    if tilt > TILT_DEG:
        wrong["vertical"] = f"vertical off by {tilt:.0f} degrees"
    error = np.linalg.norm(lab.points(points) - true, axis=2)
    share = np.mean(error[np.isfinite(error)] > MARKER_M)
    if share > MARKER_SHARE:
        wrong["markers"] = f"{share:.1%} of the points off by up to {np.nanmax(error):.3g} m"
    return wrong


def _forces(
    lab: _Lab,
    taken: TakenTrial,
    truth: Trial,
    frames: np.ndarray,
    use: np.ndarray,
    weight_N: float,
) -> dict[str, str]:
    true = truth_wrenches(truth)[frames][use]
    plates = np.stack([lab.wrench(w)[use] for w in taken.plates.values()], axis=1)
    wrong = _one_wrench(lab.wrench(taken.wrench)[use], true.sum(axis=1), weight_N, "all plates")
    plates = np.nan_to_num(plates)
    # Which plate is which: by its forces or by its moments, whichever speaks for the reader.
    by_plate = [
        _plate_by_plate(plates, true, part, weight_N) for part in (slice(0, 3), slice(3, 6))
    ]
    return min(by_plate, key=len) | wrong


def _plate_by_plate(
    plates: np.ndarray, true: np.ndarray, part: slice, weight_N: float
) -> dict[str, str]:
    """Plates (n, plates, 6) against the truth's, paired where these columns differ least."""
    loaded = np.mean(np.abs(true[:, :, 2]) > 0.02 * weight_N, axis=0) > 0
    cost = np.sum((true[:, :, None, part] - plates[:, None, :, part]) ** 2, axis=(0, 3))
    wrong: dict[str, str] = {}
    for k, m in zip(*linear_sum_assignment(cost), strict=True):
        if loaded[k]:
            wrong = _one_wrench(plates[:, m], true[:, k], weight_N, f"plate {k + 1}") | wrong
    return wrong


def truth_wrenches(truth: Trial) -> np.ndarray:
    """(frames, plates, 6), averaged over a frame's time, half of it before and half after."""
    wrench = np.concatenate([truth.force_N, truth.moment_Nm], axis=2)
    per_frame = max(round(len(truth.analog_s) / len(truth.time_s)), 1)
    # An even number of samples has no middle one: the two at the ends count half.
    weights = np.ones(per_frame + 1)
    weights[[0, -1]] = 0.5
    if per_frame % 2:
        weights = np.ones(per_frame)
    return convolve1d(wrench, weights / weights.sum(), axis=0, mode="nearest")[::per_frame]


def _one_wrench(found: np.ndarray, true: np.ndarray, weight_N: float, name: str) -> dict[str, str]:
    """Force, centre of pressure and free torque of (n, 6) against the truth's."""
    loaded = true[:, 2] > LOADED_SHARE * weight_N
    if loaded.sum() < 5:
        return {}
    found, true, wrong = found[loaded], true[loaded], {}
    ratio = np.median(found[:, 2] / true[:, 2])
    off = np.linalg.norm(found[:, :3] - true[:, :3], axis=1)
    across = np.median(np.linalg.norm(found[:, :2] - true[:, :2], axis=1))
    rms = np.sqrt(np.mean(off**2))
    if abs(ratio - 1.0) > VERTICAL_FORCE:
        wrong["force"] = f"{name}: vertical force times {ratio:.3f}"
    elif across > HORIZONTAL_N or rms > FORCE_RMS_SHARE * weight_N:
        wrong["force"] = f"{name}: horizontal force off by {across:.0f} N, RMS {rms:.0f} N"
    usable = np.abs(found[:, 2]) > 1e-3 * weight_N
    if not usable.any():
        return wrong
    apart = np.linalg.norm(_cop(found[usable]) - _cop(true[usable]), axis=1)
    middle, high = np.median(apart), np.percentile(apart, 95)
    if middle > COP_MEDIAN_M or high > COP_P95_M:
        wrong["cop"] = f"{name}: centre of pressure off by {middle:.3f} m, 95 %: {high:.3f} m"
    torque = np.median(np.abs(_free_torque(found[usable]) - _free_torque(true[usable])))
    if torque > TORQUE_NM:
        wrong["moment"] = f"{name}: free torque off by {torque:.1f} N m"
    return wrong


def _cop(wrench: np.ndarray) -> np.ndarray:
    """(n, 2) on the floor z = 0."""
    return np.column_stack([-wrench[:, 4], wrench[:, 3]]) / wrench[:, 2:3]


def _free_torque(wrench: np.ndarray) -> np.ndarray:
    x, y = _cop(wrench).T
    return wrench[:, 5] - (x * wrench[:, 1] - y * wrench[:, 0])
