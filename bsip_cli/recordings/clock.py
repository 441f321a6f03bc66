"""Do the forces come when the body moves as they drive it? Systems that are started by hand differ
by tenths of a second.

In 35 public trials with movement forces and body go together best within 0.04 s of the stated time,
and a hidden delay of 0.3 s was found to 0.04 s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from bsip_cli.recordings.body_motion import SMOOTH_S, USUAL, Balance, Body, GateLimits
from bsip_cli.recordings.plate_reading import AS_STATED
from bsip_cli.recordings.plate_source import Opened, PlateSource, later_samples
from bsip_cli.recordings.scene import by_segment

DELAYED = -4.6
"""Logarithm: clocks differ by more than `LEAST_S` in one trial of a hundred."""

LEAST_S = 0.1  # a smaller delay is left to the diagnosis, which sees it along the simulation
_MOST_S = 1.0
_STEP_S = 0.02  # half of the bell that forces and markers are averaged with
_NEAR_S = 0.1  # lags so near are one


@dataclass(frozen=True, eq=False)
class Lags:
    """How well forces go with the body if they are taken from later, logarithm, (n,) each."""

    seconds: np.ndarray
    log_likelihood: np.ndarray

    def delay_s(self, limits: GateLimits) -> float:
        """Of the forces after the body, 0 where that is not sure or as small as others find."""
        best = int(np.argmax(self.log_likelihood))
        is_large = np.abs(self.seconds) > LEAST_S
        logs = self.log_likelihood + is_large * (DELAYED - np.log(len(self.seconds)))
        near = np.abs(self.seconds - self.seconds[best]) <= _NEAR_S
        surely = np.exp(logsumexp(logs[near]) - logsumexp([*logs, 0.0]))
        is_inside = 0 < best < len(self.seconds) - 1
        if not (is_large[best] and is_inside and surely >= limits.corrected_percent / 100):
            return 0.0
        before, here, after = self.log_likelihood[best - 1 : best + 2]  # of a parabola
        bend = 2.0 * here - before - after
        aside = 0.5 * (after - before) / bend if bend > 0 else 0.0
        return float(self.seconds[best] + aside * (self.seconds[1] - self.seconds[0]))


def lags(opened: Opened, limits: GateLimits = USUAL) -> Lags | None:
    """Of a trial, its plates as the file says but for their signs; None where nothing tells."""
    recording = opened.recording
    rate_hz, analog_hz = recording.marker_rate_hz, recording.analog_rate_hz
    step = max(1, round(_STEP_S * rate_hz))
    if step / rate_hz > LEAST_S or not opened.sources:
        return None
    frames = np.arange(0, recording.n_frames, step)
    body = Body.of(by_segment(recording.labels, recording.markers_m), rate_hz, frames)
    samples = np.round(frames * analog_hz / rate_hz).astype(int)
    samples = samples[samples < min(len(source.usable) for source in opened.sources)]
    total = np.full((len(frames), 6), np.nan)
    wrenches = [_wrench(one, samples, SMOOTH_S * analog_hz) for one in opened.sources]
    total[: len(samples)] = np.sum(wrenches, axis=0)
    if not np.isfinite(body.rate).any():
        return None
    most = round(_MOST_S * rate_hz / step)
    balances = [Balance.of(body, _shifted(total, k), limits) for k in range(-most, most + 1)]
    likely = np.array([balance.log_likelihood(limits) for balance in balances])
    return Lags(np.arange(-most, most + 1) * step / rate_hz, likely)


def _wrench(source: PlateSource, samples: np.ndarray, sigma: float) -> np.ndarray:
    """As the file says, pushing, (n, 6); NaN at samples that cannot be used."""
    wrench = source.smoothed(sigma).at(samples).parts() @ source.matrix(AS_STATED).T
    wrench[~source.usable[samples]] = np.nan
    return np.asarray(wrench if np.nansum(wrench[:, 2]) >= 0 else -wrench)


def _shifted(values: np.ndarray, by: int) -> np.ndarray:
    """Each row's ``by``-th after it, NaN where there is none."""
    rows, there = later_samples(len(values), by)
    return np.where(there[:, None], values[rows], np.nan)
