"""Which analog samples can be believed: not NaN, clipped, stuck, lost or a spike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.model import Finding

_RAILS = (2047, 2048, 32767, 32768)  # counts of 12- and 16-bit converters
_FLAT_S = 0.02  # a true peak is not flat for longer
_LONGER, _FEW_LEVELS = 5.0, 20  # see _cut_off: twice 2.4
_FAR = 0.6  # of the largest value; the level of an unloaded plate is no limit
_STUCK_S = 0.5
_LOAD_CHANGE = 0.2  # of the largest load
_LOST_S = 0.1
_RISE_S = 0.005  # a foot takes longer to its peak: heel strike 10 to 20 ms (Whittle 1999)
_ABRUPT_N = 100.0  # load beside samples that are all zero: they are lost
# A spike beside the cubic through its neighbours must be larger than
# - 5 % of the channel's size: among ten samples of a frame, less moves it by under half a per cent;
# - 10 times the median of what samples are beside it: 6.7 standard deviations of normal noise;
# - twice what flips of the converter by one step can be beside it, 1 + (4 + 4 + 1 + 1) / 6 steps;
# - 6 times what is left around it: of its own size, a sixth falls on the second samples.
_SPIKE_SHARE, _SPIKE_NOISE, _SPIKE_STEPS, _SPIKE_CLEAR = 0.05, 10.0, 16 / 3, 6.0
_TOUCHED = 20.0  # N or N m: what counts on a plate that bears nobody
_AROUND = 12  # samples on either side
_ABSURD_N = 15_000.0  # triple jumpers land with 15 times their weight (Perttunen 2000): 12 kN
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
    """Judge one plate's channels (n, k); ``counts`` (n, k): the converter's, less its offset.

    ``load`` (n,) is the plate's vertical force, used to see a channel that does not answer.
    """
    nan = ~np.isfinite(channels).all(axis=1)
    clipped = np.zeros(len(channels), bool)
    stuck = np.zeros(len(channels), bool)
    silent = []
    # As the converter gave them: a calibration matrix mixes a channel at its limit with others.
    for i, channel in enumerate(counts.T):
        clipped |= _at_rail(channel) | _cut_off(channel, rate_hz)
        stuck_here = _stuck(channel, load, rate_hz)
        if stuck_here.any() and not np.nan_to_num(channel).any():
            silent.append(i)
        else:
            stuck |= stuck_here
    lost = lost_samples(channels, load, rate_hz)
    spikes = spike_samples(channels, load)
    return SampleCheck(
        nan, clipped, stuck & ~clipped, lost, spikes & ~clipped & ~lost, tuple(silent)
    )


def lost_samples(channels: np.ndarray, load: np.ndarray, rate_hz: float) -> np.ndarray:
    """Short stretches in which all channels (n, k) are zero amid load, (n,) bool.

    Loaded samples lie on both sides; or on one, with a jump that no foot makes in one sample and
    twice as high as any step elsewhere: a touch-down is lost with what was before it. Longer
    ones may be flight on a plate whose small forces were set to zero. One sample on each side,
    which may be half lost, belongs to them.
    """
    lost, size = np.zeros(len(load), bool), np.abs(np.nan_to_num(load))
    heavy = np.concatenate([[False], size > _ABRUPT_N, [False]])
    gone = runs((channels == 0).all(axis=1))
    steps = np.abs(np.diff(size, prepend=0.0, append=0.0))  # into each sample, and out of the last
    jumps = steps[gone]
    steps[gone] = 0.0
    foot = size.max(initial=0.0) / (_RISE_S * rate_hz)
    leaps = (jumps > max(_ABRUPT_N, foot, 2.0 * steps.max())).any(axis=1)
    for (start, stop), leap in zip(gone, leaps, strict=True):
        before = start == 0 or heavy[max(start - 1, 0) : start + 1].any()
        after = stop == len(load) or heavy[stop + 1 : stop + 3].any()
        if (leap or (before and after)) and stop - start <= _LOST_S * rate_hz:
            lost[max(start - 1, 0) : stop + 1] = True
    return lost


def spike_samples(channels: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Samples with a spike in one of the channels (n, k), or a load (n,) above 15 kN, (n,) bool.

    If there are many they are no exceptions, and the plate as a whole is judged elsewhere.
    """
    size = np.abs(np.nan_to_num(load))
    spikes = size > _ABSURD_N
    bears = np.percentile(size, 99) > _ABRUPT_N if len(size) else False
    for channel in channels.T:
        spikes |= _spikes(channel, 0.0 if bears else _TOUCHED)
    return spikes if spikes.mean() <= _MANY else np.zeros(len(spikes), bool)


def _spikes(signal: np.ndarray, least: float) -> np.ndarray:
    """Single samples that leave a smooth course by more than ``least`` and come back, (n,) bool.

    What is left of a sample beside the cubic through its neighbours is then large against noise,
    steps of the converter and the channel's size, and once it is taken away, the surroundings are
    smooth: a foot that touches down leaves more than one such sample.
    """
    spikes, known = np.zeros(len(signal), bool), np.isfinite(signal)
    if known.sum() < 5:
        return spikes
    samples = np.arange(len(signal))
    whole = np.interp(samples, samples[known], signal[known])
    steps = np.abs(np.diff(whole))
    if not steps.any():
        return spikes
    beside = _beside_cubic(whole)
    least = max(
        least,
        _SPIKE_SHARE * float(np.abs(np.percentile(whole, [1, 99])).max()),
        _SPIKE_NOISE * float(np.median(np.abs(beside))),
        _SPIKE_STEPS * float(steps[steps > 0].min()),
    )
    for k in np.flatnonzero((np.abs(beside) > least) & known).tolist():
        if 2 <= k < len(signal) - 2:
            first = max(k - _AROUND, 0)
            around = whole[first : k + _AROUND + 1].copy()
            around[k - first] -= beside[k]
            spikes[k] = np.abs(beside[k]) > _SPIKE_CLEAR * np.abs(_beside_cubic(around)).max()
    return spikes


def _beside_cubic(signal: np.ndarray) -> np.ndarray:
    """Samples (n,) less the cubic through the two before and the two after."""
    p = np.pad(signal, 2, mode="reflect")
    return np.asarray(signal - (4.0 * (p[1:-3] + p[3:-1]) - p[:-4] - p[4:]) / 6.0)


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


def _cut_off(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """Long runs of exactly the largest or smallest value, as an amplifier at its limit leaves them.

    A smooth course stays at the level of its peak 2.4 times as long as at the next level (both go
    by square roots); at a limit it stays far longer. Where there are few levels, as of a coarse
    converter in quiet stance, nothing can be told.
    """
    flat = np.zeros(len(signal), bool)
    levels, counts = np.unique(signal[np.isfinite(signal)], return_counts=True)
    if len(levels) < _FEW_LEVELS:
        return flat
    far = np.abs(levels) >= _FAR * np.abs(levels).max()
    for k in (0, len(levels) - 1):
        others = counts[far & (np.arange(len(levels)) != k)]
        if far[k] and counts[k] > _LONGER * others.max(initial=1):
            flat |= long_runs(signal == levels[k], max(4, round(_FLAT_S * rate_hz)))
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
