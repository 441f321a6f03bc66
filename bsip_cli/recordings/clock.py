"""Do the forces come when the body moves as they drive it, and does it move as fast? Systems that
are started by hand differ by tenths of a second, or by whole ones; and a file may state another
rate than that of the cameras, so that accelerations are wrong by its square.

In 66 public trials forces and body go together best within 0.04 s of the stated time, if at all,
and a hidden delay of 0.3 s was found to 0.04 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from bsip_cli.recordings.body_motion import SMOOTH_S, USUAL, Balance, Body, GateLimits
from bsip_cli.recordings.plate_reading import AS_STATED
from bsip_cli.recordings.plate_source import Opened, later_samples
from bsip_cli.recordings.scene import by_segment
from bsip_cli.recordings.written import OTHER_RATE, PACES

DELAYED = -4.6
"""Logarithm: clocks differ by more than `LEAST_S` in one trial of a hundred."""

LEAST_S = 0.05
"""More than any sound recording shows, see above; a smaller delay is left to the diagnosis, which
sees it along the simulation."""

_MOST_S = 10.0  # whoever lets more pass has another recording
_STEP_S = 0.02  # half of the bell that forces and markers are averaged with
_NEAR_S = 0.1  # lags so near are one


@dataclass(frozen=True, eq=False)
class Lags:
    """How well forces go with the body if they are taken from later, logarithm, (n,) each; of the
    lift alone, how corners, axes and moments are read does not matter."""

    seconds: np.ndarray
    log_likelihood: np.ndarray
    of_lift: np.ndarray

    def delay_s(self, limits: GateLimits) -> float:
        """Of the forces after the body, 0 where that is not sure or as small as others find; by the
        lift where the whole is no better."""
        is_large = np.abs(self.seconds) > LEAST_S
        if self.log_likelihood.max() < self.of_lift.max():
            # What carries and drives the body is still to confirm it: no prior is taken off twice.
            return self._peak_s(self.of_lift, is_large, 0.0, limits)
        rarely = DELAYED - float(np.log(len(self.seconds)))
        return self._peak_s(self.log_likelihood, is_large, rarely, limits)

    def _peak_s(
        self, log_likelihood: np.ndarray, is_large: np.ndarray, rarely: float, limits: GateLimits
    ) -> float:
        best = int(np.argmax(log_likelihood))
        logs = log_likelihood + is_large * rarely
        near = is_large & (np.abs(self.seconds - self.seconds[best]) <= _NEAR_S)
        surely = np.exp(logsumexp(logs[near]) - logsumexp([*logs, 0.0]))
        is_inside = 0 < best < len(self.seconds) - 1
        if not (is_large[best] and is_inside and surely >= limits.corrected_percent / 100):
            return 0.0
        before, here, after = log_likelihood[best - 1 : best + 2]  # of a parabola
        bend = 2.0 * here - before - after
        aside = 0.5 * (after - before) / bend if bend > 0 else 0.0
        return float(self.seconds[best] + aside * (self.seconds[best + 1] - self.seconds[best]))


def lags(opened: Opened, limits: GateLimits = USUAL) -> Lags | None:
    """Of a trial, its plates as the file says but for their signs; None where nothing shows it."""
    rate_hz = opened.recording.marker_rate_hz
    step = max(1, round(_STEP_S * rate_hz))
    if step / rate_hz > LEAST_S or not opened.sources:
        return None
    body, samples, wrenches = motion_and_forces(opened, step)
    if not np.isfinite(body.rate).any():
        return None
    total = np.zeros((len(body.rate), 6))
    total[len(samples) :] = np.nan
    for source in opened.sources:
        pushing = wrenches[source.name]
        pushing[~source.usable[samples]] = np.nan
        total[: len(samples)] += pushing if np.nansum(pushing[:, 2]) >= 0 else -pushing
    most, near = (round(seconds * rate_hz / step) for seconds in (_MOST_S, 2 * _NEAR_S))
    most = min(most, len(total))
    rough = {k: _goes(body, total, k, limits) for k in range(-2 * (most // 2), most + 1, 2)}
    peaks = [0, *(max(rough, key=lambda k: rough[k][which]) for which in (0, 1))]
    fine = {k for peak in peaks for k in range(peak - near, peak + near + 1)} - rough.keys()
    found = dict(sorted({**rough, **{k: _goes(body, total, k, limits) for k in fine}}.items()))
    seconds = np.array(list(found)) * step / rate_hz
    return Lags(seconds, *np.array(list(found.values())).T)


def motion_and_forces(opened: Opened, step: int) -> tuple[Body, np.ndarray, dict[str, np.ndarray]]:
    """The body at every ``step``-th of the frames; the samples (n,) of the same times, fewer where
    the plates end before the markers; and each plate's wrench there as the file says, (n, 6),
    averaged as the body is."""
    recording = opened.recording
    rate_hz, analog_hz = recording.marker_rate_hz, recording.analog_rate_hz
    frames = np.arange(0, recording.n_frames, step)
    samples = np.round(frames * analog_hz / rate_hz).astype(int)
    samples = samples[samples < min(len(source.usable) for source in opened.sources)]
    wrenches = {}
    for source in opened.sources:
        parts = source.smoothed(SMOOTH_S * analog_hz).at(samples).parts()
        wrenches[source.name] = parts @ source.matrix(AS_STATED).T
    body = Body.of(by_segment(recording.labels, recording.markers_m), rate_hz, frames)
    return body, samples, wrenches


def _goes(body: Body, total: np.ndarray, by: int, limits: GateLimits) -> tuple[float, float]:
    balance = Balance.of(body, _shifted(total, by), limits)
    return balance.log_likelihood(limits), balance.lift_log_likelihood()


def paces(body: Body, total: np.ndarray, limits: GateLimits) -> np.ndarray:
    """How much better the plates' total wrench (n, 6), smoothed as the body is, is as large as each
    of `PACES` needs it, logarithm (m,), than as the first does: where the plates hold all of the
    body by the one and by the other, each by its independent numbers."""
    found = [Balance.of(body.faster(times), total, limits) for times in PACES]
    gains, stated = np.zeros(len(PACES)), found[0]
    for k, (times, one) in enumerate(zip(PACES, found, strict=True)):
        gain = one.numbers * (one.size_log_likelihood() - one.size_log_likelihood(1 / times))
        back = stated.size_log_likelihood(times) - stated.size_log_likelihood()
        gains[k] = (gain + stated.numbers * back) / max(one.numbers + stated.numbers, 1.0)
    return gains


def log_odds_of(of_trials: Sequence[Sequence[float]], times: float) -> float:
    """Of all trials so many times as fast as they are read, from what `PACES` are of each."""
    nearest = int(np.argmin(np.abs(PACES - times)))
    return float(np.sum([one[nearest] for one in of_trials]))


def pace(of_trials: Sequence[np.ndarray], percent: float) -> float:
    """How many times as fast as stated trials ran, from what `PACES` are of each; 1 where it is not
    so likely that they ran faster, or slower."""
    logs = np.sum([np.zeros(len(PACES)), *of_trials], axis=0)
    logs[1:] += OTHER_RATE - np.log(len(PACES) - 1)
    best = int(np.argmax(logs))
    same_way = np.sign(np.log(PACES)) == np.sign(np.log(PACES[best]))
    surely = np.exp(logsumexp(logs[same_way]) - logsumexp(logs))
    return float(PACES[best]) if surely >= percent / 100 else 1.0


def _shifted(values: np.ndarray, by: int) -> np.ndarray:
    """Each row's ``by``-th after it, NaN where there is none."""
    rows, there = later_samples(len(values), by)
    return np.where(there[:, None], values[rows], np.nan)
