"""Refine a skeleton over frames of all trials, without the markers that sit elsewhere there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion.calibration import Calibration
from bsip_cli.motion.inverse_kinematics import solve_poses, solve_trial, tree_of
from bsip_cli.motion.marker_events import offsets
from bsip_cli.motion.marker_fit import marker_fit
from bsip_cli.motion.scaling import Refinement, ScalingOptions, refine, varied_frames

_FRAMES_PER_TRIAL = 400
_MOST = 0.8  # of the markers
_FEW = 0.5  # of the trials


@dataclass(frozen=True, eq=False)
class TrialMarkers:
    """Frames of one trial: times_s (N,), markers_m (N, m, 3) world in the person's order, NaN where
    missing."""

    times_s: np.ndarray
    markers_m: np.ndarray

    def frames(self, chosen: slice | np.ndarray) -> TrialMarkers:
        """Some of the frames."""
        return TrialMarkers(self.times_s[chosen], self.markers_m[chosen])

    def without(self, hidden: np.ndarray) -> TrialMarkers:
        """Without the markers that are hidden (m,)."""
        return replace(self, markers_m=np.where(hidden[:, None], np.nan, self.markers_m))


def refine_over_trials(
    calibration: Calibration,
    standing: TrialMarkers,
    standing_trial: int,
    trials: Iterable[TrialMarkers],
    frames: int,
    options: ScalingOptions,
    ik: dict,
) -> Refinement:
    """Fit the geometry to ``frames`` frames of all trials that differ most.

    A marker that sits elsewhere throughout fewer than half of the trials has no say there, since it
    would drag its place in the model towards the middle: the fit is made again without it.

    Parameters
    ----------
    standing : the one frame that the calibration is like, of the trial with this number.
    ik : keyword options of :func:`solve_poses`.
    """
    seen = [_thinned(one) for one in trials]
    fit = _refined(calibration, standing, seen, frames, options, ik)
    elsewhere = np.array([_elsewhere(fit.person, one, ik) for one in seen])
    elsewhere &= elsewhere.mean(axis=0) < _FEW
    if not elsewhere.any():
        return fit
    standing = standing.without(elsewhere[standing_trial])
    kept = [one.without(off) for one, off in zip(seen, elsewhere, strict=True)]
    return _refined(calibration, standing, kept, frames, options, ik)


def _thinned(one: TrialMarkers) -> TrialMarkers:
    """Some of the frames that show nearly all markers."""
    stride = max(1, len(one.times_s) // _FRAMES_PER_TRIAL)
    fewer = one.frames(slice(None, None, stride))
    return fewer.frames(np.isfinite(fewer.markers_m[..., 0]).mean(axis=1) > _MOST)


def _elsewhere(person: Person, one: TrialMarkers, ik: dict) -> np.ndarray:
    """(m,) markers that sit elsewhere than in the model throughout a trial."""
    if not len(one.times_s):
        return np.zeros(len(person.markers), dtype=bool)
    poses = solve_trial(person, one.markers_m, **ik)
    scales = {name: ik[name] for name in ("marker_sd_m", "robust_limit_m")}
    fit = marker_fit(person, one.markers_m, poses.q, one.times_s, **scales)
    off = {event.marker for event in offsets(fit, fit.residual_m) if event.kind == "offset"}
    return np.isin(person.markers, list(off))


def _refined(
    calibration: Calibration,
    standing: TrialMarkers,
    seen: Sequence[TrialMarkers],
    frames: int,
    options: ScalingOptions,
    ik: dict,
) -> Refinement:
    """To the frame ``standing`` and to what is seen in the trials."""
    person = calibration.person
    markers = [standing.markers_m, *(one.markers_m for one in seen if len(one.times_s))]
    poses = [solve_poses(person, standing.markers_m, calibration.q, **ik).q]
    poses += [solve_trial(person, one, **ik).q for one in markers[1:]]
    all_markers, all_poses = np.concatenate(markers), np.concatenate(poses)
    orientations, _ = tree_of(person).forward(all_poses)
    chosen = varied_frames(orientations, frames)
    return refine(person, all_markers[chosen], all_poses[chosen], options, ik)
