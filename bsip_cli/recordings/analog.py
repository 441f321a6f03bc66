"""Which analog samples can be believed: not NaN, clipped, stuck, lost, repeated or a spike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

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
_FALSE_POSITIVE = 1e-3  # plates with a sound interval that is called stuck or repeated
_ROUNDING = 4 / 3  # steps beside the cubic by rounding alone: (1 + (4 + 4 + 1 + 1) / 6) / 2
_BLOCK = 8  # samples: a shorter block holds too little noise to be known again
_NAMED = 5  # intervals in a sentence


@dataclass(frozen=True, eq=False)
class SampleCheck:
    """One mask per fault, (n,) bool, True = faulty."""

    not_a_number: np.ndarray
    clipped: np.ndarray
    stuck: np.ndarray  # (n, k): a channel repeats one value
    lost: np.ndarray  # all channels zero amid load or noise
    repeated: np.ndarray  # a block equal to the one before, as of a buffer written twice
    spikes: np.ndarray  # single samples far from both neighbours, or beyond 15 kN
    silent_channels: tuple[int, ...]  # identically zero although the plate is loaded

    def usable(self) -> np.ndarray:
        faulty = self.not_a_number | self.clipped | self.lost | self.repeated | self.spikes
        return ~(faulty | self.stuck.any(axis=1))


def check_samples(
    channels: np.ndarray, counts: np.ndarray, load: np.ndarray, rate_hz: float
) -> SampleCheck:
    """Judge one plate's channels (n, k); ``counts`` (n, k): the converter's, less its offset.

    ``load`` (n,) is the plate's vertical force, used to see a channel that does not answer.
    """
    nan = ~np.isfinite(channels).all(axis=1)
    clipped, noisy = np.zeros(len(channels), bool), np.zeros(len(channels), int)
    stuck = np.zeros(channels.shape, bool)
    silent = []
    spikes = spike_samples(channels, load)
    absent, unloaded = (channels == 0).all(axis=1), np.abs(np.nan_to_num(load)) <= _ABRUPT_N
    # Zero is no natural reading where most unloaded samples are noise, on both sides of zero.
    is_natural = 2 * absent.sum() > unloaded.sum() or not (load[1:] * load[:-1] < 0).any()
    gone = absent & is_natural
    # As the converter gave them: a calibration matrix mixes a channel at its limit with others.
    noises = [_noise_beyond_rounding(channel) for channel in counts.T]
    dead = _dead(channels, load, noises)
    for i, (channel, noise) in enumerate(zip(counts.T, noises, strict=True)):
        if dead[i]:
            stuck[:, i] = bool(channels[0, i])
            silent += [] if channels[0, i] else [i]
            continue
        size = np.abs(np.nan_to_num(channel))
        is_count = np.abs(size - np.rint(size)) < 0.01
        clipped |= long_runs(is_count & np.isin(np.rint(size), _RAILS), 2)  # the converter's limit
        clipped |= _cut_off(channel, rate_hz)
        stuck[:, i] = _stuck(channel, noise, load, gone, spikes, rate_hz, channels.shape[1])
        noisy += noise
        if stuck[:, i].any() and not np.nan_to_num(channel).any():
            silent.append(i)
            stuck[:, i] = False
    stuck &= ~clipped[:, None]
    lost = _lost(absent, is_natural, load, spikes, rate_hz) | (stuck.all(axis=1) & absent)
    stuck &= ~lost[:, None]
    return SampleCheck(
        not_a_number=nan,
        clipped=clipped,
        stuck=stuck,
        lost=lost,
        repeated=repeated_samples(counts, noisy),
        spikes=spikes & ~clipped & ~lost,
        silent_channels=tuple(silent),
    )


def _dead(channels: np.ndarray, load: np.ndarray, noises: Sequence[np.ndarray]) -> np.ndarray:
    """Channels (k,) of one value throughout, the load's among them, while others show noise, which
    it would have too, and change as under a foot."""
    n = len(channels)
    constant = np.ptp(np.nan_to_num(channels), axis=0) if n else np.ones(channels.shape[1])
    others = np.nan_to_num(channels)[:, constant > 0]
    if (
        constant.all()
        or np.ptp(np.nan_to_num(load)) > 0
        or not np.ptp(others, axis=0).max(initial=0.0) > _TOUCHED
    ):
        return np.zeros(len(constant), bool)
    shown = max((int(noise.sum()) for noise in noises), default=0)
    is_noisy = shown >= np.log2(n * len(constant) / _FALSE_POSITIVE)
    return np.asarray((constant == 0) & is_noisy)


def _lost(
    absent: np.ndarray, is_natural: bool, load: np.ndarray, spikes: np.ndarray, rate_hz: float
) -> np.ndarray:
    """Intervals in which all channels are zero (``absent``) amid load, (n,) bool.

    It comes or goes with a jump that no foot makes in one sample and twice as high as any step
    elsewhere, or both with such steps; or loaded samples lie on both sides of a short interval: a
    longer one may be flight on a plate whose small forces were set to zero. One sample on each
    side, which may be half lost, belongs to them.
    """
    lost, size = np.zeros(len(load), bool), np.abs(np.nan_to_num(load))
    heavy, near = size > _ABRUPT_N, min(2, int(_RISE_S * rate_hz)) if is_natural else 2
    intervals, foot = runs(absent), size.max(initial=0.0) / (_RISE_S * rate_hz)
    leaps = _leaps(np.abs(load), intervals, spikes, _ABRUPT_N, foot)
    for (start, stop), leap in zip(intervals, leaps, strict=True):
        amid = heavy[max(start - near, 0) : start].any() and heavy[stop : stop + near].any()
        if leap or (amid and stop - start <= _LOST_S * rate_hz):
            lost[max(start - 1, 0) : stop + 1] = True
    return lost


def _leaps(
    signal: np.ndarray, intervals: np.ndarray, spikes: np.ndarray, least: float, foot: float = 0.0
) -> np.ndarray:
    """Whether a signal (n,) steps into and out of intervals (m, 2) by more than ``least`` and
    twice its largest step elsewhere, or into or out of them by more than ``foot`` too, (m,)."""
    steps = np.pad(np.abs(np.nan_to_num(np.diff(signal))), 1)
    jumps = steps[intervals]
    steps[intervals] = 0.0
    steps[:-1][spikes] = steps[1:][spikes] = 0.0
    jumps[jumps <= max(least, 2.0 * steps.max())] = 0.0
    return np.asarray((jumps > foot).any(axis=1) | jumps.all(axis=1))


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
    least = max(least, _clear(whole), _SPIKE_NOISE * float(np.median(np.abs(beside))))
    for k in np.flatnonzero((np.abs(beside) > least) & known).tolist():
        if 2 <= k < len(signal) - 2:
            first = max(k - _AROUND, 0)
            around = whole[first : k + _AROUND + 1].copy()
            around[k - first] -= beside[k]
            spikes[k] = np.abs(beside[k]) > _SPIKE_CLEAR * np.abs(_beside_cubic(around)).max()
    return spikes


def _clear(signal: np.ndarray) -> float:
    """What is more than the converter's steps, and counts against the signal's size."""
    steps = np.abs(np.diff(signal))
    size = np.abs(np.nanpercentile(signal, [1, 99])).max()
    return float(max(_SPIKE_SHARE * size, _SPIKE_STEPS * steps[steps > 0].min(initial=size)))


def _beside_cubic(signal: np.ndarray) -> np.ndarray:
    """Samples (n,) less the cubic through the two before and the two after."""
    p = np.pad(signal, 2, mode="reflect")
    return np.asarray(signal - (4.0 * (p[1:-3] + p[3:-1]) - p[:-4] - p[4:]) / 6.0)


def runs(mask: np.ndarray) -> np.ndarray:
    """Start and stop (exclusive) of each interval of True, (n_runs, 2)."""
    edges = np.diff(np.concatenate([[0], np.asarray(mask, np.int8), [0]]))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])


def long_runs(mask: np.ndarray, least: int) -> np.ndarray:
    """The mask with intervals of True shorter than ``least`` samples taken out, (n,) bool."""
    kept = np.zeros(len(mask), bool)
    intervals = runs(mask)
    for start, stop in intervals[np.diff(intervals, axis=1)[:, 0] >= least]:
        kept[start:stop] = True
    return kept


def _cut_off(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """Long runs of exactly the largest or smallest value, as an amplifier at its limit leaves them.

    A smooth course stays at the level of its peak 2.4 times as long as at the next level (both go
    by square roots); at a limit it stays far longer. Where there are few levels, as of a coarse
    converter in quiet stance, nothing can be said.
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


def repeated_samples(channels: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Blocks of samples of all channels (n, k) that equal the block just before, (n,) bool.

    ``noise`` (n,) counts the channels' events of noise: each comes again with 1/2 at most.
    """
    n, repeated = len(channels), np.zeros(len(channels), bool)
    if n < 2 * _BLOCK:
        return repeated
    weights = np.random.default_rng(1).integers(1, 2**63, channels.shape[1] + _BLOCK, np.uint64)
    rows = np.ascontiguousarray(channels, float).view(np.uint64) @ weights[_BLOCK:]
    blocks = np.lib.stride_tricks.sliding_window_view(rows, _BLOCK) @ weights[:_BLOCK]
    order = np.argsort(blocks, kind="stable")
    lags = np.zeros(n, int)  # to the last block alike, if there is one
    alike = blocks[order[1:]] == blocks[order[:-1]]
    lags[order[1:][alike]] = np.diff(order)[alike]
    starts = np.flatnonzero(np.diff(lags, prepend=0))
    for start, stop in pairwise([*starts, n]):
        lag = lags[start]
        if noise[start : stop + _BLOCK - 1][:lag].sum() >= np.log2(n**2 / _FALSE_POSITIVE):
            equal = runs((channels[lag:] == channels[:-lag]).all(axis=1)) + lag
            for first, end in equal[equal[:, 1] - equal[:, 0] >= lag]:
                repeated[first:end] |= first <= start < end
    return repeated


def _noise_beyond_rounding(signal: np.ndarray) -> np.ndarray:
    """Samples (n,) that leave their neighbours' cubic to the other side than the one before, and
    by more than rounding of a smooth course to the converter's steps (or to 32 bits) explains."""
    whole = np.nan_to_num(signal)
    steps = np.abs(np.diff(whole))
    if len(whole) < 3 or not steps.any():
        return np.zeros(len(whole), bool)
    digit = np.finfo(np.float32).eps * np.abs(whole).max()
    beside, least = _beside_cubic(whole), 1.01 * _ROUNDING * max(steps[steps > 0].min(), digit)
    turns = (beside[1:] * beside[:-1] < 0) & (
        np.maximum(*np.abs([beside[1:], beside[:-1]])) > least
    )
    return np.concatenate([[False], turns & (steps > 0)])


def _stuck(
    channel: np.ndarray,
    noise: np.ndarray,
    load: np.ndarray,
    gone: np.ndarray,
    spikes: np.ndarray,
    rate_hz: float,
    n_channels: int,
) -> np.ndarray:
    """Intervals of one value of a channel (n,) that its ``noise`` would have changed, (n,) bool.

    If one of two intervals of a length holds T events of noise, the other holds none with
    probability 2^-T; T is that of the calmest other interval as long (or half of all there is),
    loaded or unloaded as this one. All such intervals must be less than the rest.
    Without noise, a interval amid load is stuck if the channel leaps into it or out of it, and a
    long one while the load changes. Where the plate is set to zero (``gone``), nothing is.
    """
    stuck, n = np.zeros(channel.shape, bool), len(channel)
    held = runs((np.diff(channel) == 0) & ~gone[:-1]) + np.array([0, 1])
    held = held[held[:, 1] - held[:, 0] >= max(4, _FLAT_S * rate_hz)]
    if not len(held):
        return stuck
    lengths, size = held[:, 1] - held[:, 0], np.abs(np.nan_to_num(load))
    bears = ~gone if gone.any() else size > _ABRUPT_N
    on = np.array([2 * bears[a:b].sum() > b - a for a, b in held], bool)
    faulty = on | _leaps(np.abs(load), held, spikes, _ABRUPT_N, size.max() / (_RISE_S * rate_hz))
    faulty &= _leaps(channel, held, spikes, _clear(channel))
    for loaded in (True, False):
        state = (bears == loaded) & ~gone
        for shorter, length in pairwise([0, *np.unique(lengths[on == loaded])]):
            longer = (lengths >= length) & (on == loaded)
            n_others = state.sum() - lengths[longer].sum()
            part = min(length, n_others // 2)
            events = np.log2(n * n_channels / max(part, 1) / _FALSE_POSITIVE)
            if n_others < lengths[longer].sum() or part - shorter < events:
                continue  # no exceptions; or the next shorter is no less probable
            others = state.copy()
            for a, b in held[longer]:
                others[a:b] = False
            total = np.cumsum(noise[others])
            if (total[part:] - total[:-part]).min(initial=n) >= events:
                faulty |= longer
    change = np.array([np.ptp(size[a:b]) for a, b in held])
    faulty |= (lengths > _STUCK_S * rate_hz) & (change > max(_LOAD_CHANGE * size.max(), 50.0))
    for a, b in held[faulty]:
        stuck[a:b] = True
    return stuck


def sample_findings(
    plate: str, samples: SampleCheck, rate_hz: float, time0_s: float = 0.0
) -> list[Finding]:
    """Lines for the quality table about one plate's faulty samples, the first at ``time0_s``."""
    n, stuck, clock = len(samples.stuck), samples.stuck, (rate_hz, time0_s)
    held = "; ".join(
        f"channel {i + 1} {times(stuck[:, i], *clock)}" for i in np.flatnonzero(stuck.any(axis=0))
    )
    lost, repeated = (times(mask, *clock) for mask in (samples.lost, samples.repeated))
    said = "none", "marked them unusable", "warning"
    findings = [
        Finding(f"analog_{name}", plate, f"{mask.sum()} of {n} samples {words}", *said)
        for name, words, mask in (
            ("nan", "are not a number", samples.not_a_number),
            ("clipped", "stay at the converter's limit, or at the last value", samples.clipped),
            ("stuck", f"repeat one value: {held}", stuck.any(axis=1)),
            ("lost", f"are zero in all channels at once: {lost}", samples.lost),
            ("repeated", f"equal the block before: {repeated}", samples.repeated),
            ("spike", "leave their neighbours and come back at once", samples.spikes),
        )
        if mask.any()
    ]
    if samples.silent_channels:
        names = ", ".join(str(i + 1) for i in samples.silent_channels)
        found = f"channel {names} of the plate is zero throughout"
        answer = "a signal that answers to the load", "kept the plate", "warning"
        findings.append(Finding("analog_silent", plate, found, *answer))
    return findings


def times(
    mask: np.ndarray, rate_hz: float, time0_s: float, digits: int = 3, most: int = _NAMED
) -> str:
    """The intervals of True in words, on the file's clock (``time0_s`` is the first sample's);
    ``most`` of them."""
    intervals = runs(mask)
    ends_s = time0_s + intervals[:most] / rate_hz
    spans = (f"{a:.{digits}f} to {b:.{digits}f} s" for a, b in ends_s)
    more = f" and {len(intervals) - most} more" if len(intervals) > most else ""
    return ", ".join(spans) + more
