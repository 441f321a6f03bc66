"""Which analog samples can be believed: not NaN, clipped, stuck, lost or a spike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.model import Finding

_RAILS = (2047, 2048, 32767, 32768)  # counts of 12- and 16-bit converters
_FLAT_S = 0.02  # a true peak is not flat for longer
_STUCK_S = 0.5
_LOAD_CHANGE = 0.2  # of the largest load
_LOST_S = 0.1
_ABRUPT_N = 100.0  # load beside samples that are all zero: they are lost
_SPIKE_SHARE = 1.0  # of the channel's range: up and down again within one sample
_SPIKE_NOISE = 20.0  # times the median step
_ONE_LEVEL = 0.2  # of the spike: the samples beside it are alike
_ABSURD_N = 15_000.0
_MANY = 0.02  # of the samples


@dataclass(frozen=True, eq=False)
class SampleCheck:
    """One mask per fault, (n,) bool, True = faulty."""

    not_a_number: np.ndarray
    clipped: np.ndarray
    stuck: np.ndarray
    lost: np.ndarray  # all channels zero amid load
    spikes: np.ndarray  # single samples far from both neighbours, or beyond 15 kN
    silent_channels: tuple[int, ...]  # identically zero although the plate is loaded

    def usable(self) -> np.ndarray:
        return ~(self.not_a_number | self.clipped | self.stuck | self.lost | self.spikes)


def check_samples(
    channels: np.ndarray, counts: np.ndarray, load: np.ndarray, rate_hz: float
) -> SampleCheck:
    """Judge one plate's channels (n, k); ``counts`` (n, k) are the converter's integers.

    ``load`` (n,) is the plate's vertical force, used to see a channel that does not answer.
    """
    nan = ~np.isfinite(channels).all(axis=1)
    clipped = np.zeros(len(channels), bool)
    stuck = np.zeros(len(channels), bool)
    silent = []
    for i in range(channels.shape[1]):
        clipped |= _at_rail(counts[:, i]) | _flat_top(channels[:, i], rate_hz)
        stuck_here = _stuck(channels[:, i], load, rate_hz)
        if stuck_here.any() and not np.nan_to_num(channels[:, i]).any():
            silent.append(i)
        else:
            stuck |= stuck_here
    lost = lost_samples(channels, load, rate_hz)
    spikes = spike_samples(channels, load)
    return SampleCheck(
        nan, clipped, stuck & ~clipped, lost, spikes & ~clipped & ~lost, tuple(silent)
    )


def lost_samples(channels: np.ndarray, load: np.ndarray, rate_hz: float) -> np.ndarray:
    """Short stretches in which all channels (n, k) are zero beside loaded samples, (n,) bool.

    Longer ones may be flight on a plate whose small forces were set to zero. One sample on
    each side, which may be half lost, belongs to them.
    """
    lost = np.zeros(len(load), bool)
    heavy = np.concatenate([[False], np.abs(np.nan_to_num(load)) > _ABRUPT_N, [False]])
    for start, stop in runs((channels == 0).all(axis=1)):
        before = start == 0 or heavy[max(start - 1, 0) : start + 1].any()
        after = stop == len(load) or heavy[stop + 1 : stop + 3].any()
        if before and after and stop - start <= _LOST_S * rate_hz:
            lost[max(start - 1, 0) : stop + 1] = True
    return lost


def spike_samples(channels: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Samples with a spike in one of the channels (n, k), or a load (n,) above 15 kN, (n,) bool.

    If there are many they are no exceptions, and the plate as a whole is judged elsewhere.
    """
    spikes = np.abs(np.nan_to_num(load)) > _ABSURD_N
    for channel in channels.T:
        spikes |= _spikes(channel)
    return spikes if spikes.mean() <= _MANY else np.zeros(len(spikes), bool)


def _spikes(signal: np.ndarray) -> np.ndarray:
    """Single samples that leave and come back by all of the signal's range, (n,) bool."""
    spikes = np.zeros(len(signal), bool)
    known = signal[np.isfinite(signal)]
    if len(known) < 5:
        return spikes
    low, high = np.percentile(known, [1, 99])
    least = max(
        _SPIKE_SHARE * (high - low), _SPIKE_NOISE * float(np.median(np.abs(np.diff(known)))), 1e-3
    )
    padded = np.concatenate([signal[1:2], signal, signal[-2:-1]])
    with np.errstate(invalid="ignore"):
        left, right = padded[1:-1] - padded[:-2], padded[1:-1] - padded[2:]
        jump = np.where(left * right > 0, np.minimum(np.abs(left), np.abs(right)), 0.0)
        spikes |= (jump > least) & (np.abs(left - right) < _ONE_LEVEL * jump)
    return spikes


def runs(mask: np.ndarray) -> np.ndarray:
    """Start and stop (exclusive) of each stretch of True, (n_runs, 2)."""
    edges = np.diff(np.concatenate([[0], np.asarray(mask, np.int8), [0]]))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])


def long_runs(mask: np.ndarray, least: int) -> np.ndarray:
    """The mask with stretches of True shorter than ``least`` samples taken out, (n,) bool."""
    kept = np.zeros(len(mask), bool)
    stretches = runs(mask)
    for start, stop in stretches[np.diff(stretches, axis=1)[:, 0] >= least]:
        kept[start:stop] = True
    return kept


def _at_rail(counts: np.ndarray) -> np.ndarray:
    whole = np.rint(np.nan_to_num(counts))
    is_count = np.abs(np.nan_to_num(counts) - whole) < 0.01
    return long_runs(is_count & np.isin(np.abs(whole), _RAILS), 2)


def _flat_top(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """Long runs of exactly the extreme value, far from where the signal usually is."""
    known = signal[np.isfinite(signal)]
    flat = np.zeros(len(signal), bool)
    if not len(known):
        return flat
    largest = np.abs(known).max()
    for extreme in (known.min(), known.max()):
        far = abs(extreme - np.median(known)) > 0.1 * largest
        if abs(extreme) >= 0.6 * largest and far:
            flat |= long_runs(signal == extreme, max(4, round(_FLAT_S * rate_hz)))
    return flat


def _stuck(signal: np.ndarray, load: np.ndarray, rate_hz: float) -> np.ndarray:
    """Stretches of a constant channel during which the plate's load changes."""
    same = np.concatenate([[False], np.diff(signal) == 0])
    stuck = np.zeros(len(signal), bool)
    scale = np.max(np.abs(load[np.isfinite(load)]), initial=0.0)
    for start, stop in runs(long_runs(same, round(_STUCK_S * rate_hz))):
        part = load[start:stop]
        if not np.isfinite(part).any():
            continue
        if np.nanmax(part) - np.nanmin(part) > max(_LOAD_CHANGE * scale, 50.0):
            stuck[start - 1 : stop] = True
    return stuck


def sample_findings(plate: str, samples: SampleCheck) -> list[Finding]:
    """Lines for the quality table about one plate's faulty samples."""
    n = len(samples.stuck)
    findings = [
        Finding(
            check=f"analog_{name}",
            subject=plate,
            found=f"{mask.sum()} of {n} samples {words}",
            expected="none",
            action="marked them unusable",
            level="warning",
        )
        for name, words, mask in (
            ("nan", "are not a number", samples.not_a_number),
            ("clipped", "lie at the converter's limit", samples.clipped),
            ("stuck", "do not answer to the load", samples.stuck),
            ("lost", "are zero in all channels amid load", samples.lost),
            ("spike", "leave their neighbours and come back at once", samples.spikes),
        )
        if mask.any()
    ]
    if samples.silent_channels:
        names = ", ".join(str(i + 1) for i in samples.silent_channels)
        findings.append(
            Finding(
                check="analog_silent",
                subject=plate,
                found=f"channel {names} of the plate is zero throughout",
                expected="a signal that answers to the load",
                action="kept the plate",
                level="warning",
            )
        )
    return findings
