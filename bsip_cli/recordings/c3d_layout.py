"""What header and parameters of a C3D file both state: counts, rates, scales. The file's size
judges between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_format import (
    BLOCK,
    FULL,
    TEXT,
    Group,
    Header,
    Parameters,
    Record,
    group_names,
    number,
    numbers,
)
from bsip_cli.recordings.model import Finding, refusal
from bsip_cli.recordings.timebase import MOST_HZ

_SAME = 1e-3
_WORD = 0x10000


@dataclass(frozen=True)
class Layout:
    """Counts of one frame and of all, and where the first lies."""

    n_points: int
    n_channels: int
    samples_per_frame: int
    n_frames: int
    is_float: bool
    start: int  # byte

    @property
    def words_per_frame(self) -> int:
        return 4 * self.n_points + self.n_channels * self.samples_per_frame

    @property
    def bytes_per_frame(self) -> int:
        return self.words_per_frame * (4 if self.is_float else 2)

    @property
    def n_bytes(self) -> int:
        return self.n_frames * self.bytes_per_frame

    def room(self, file_size: int) -> int:
        """Bytes from the first frame to the end of the file."""
        return max(file_size - self.start, 0)

    def fits(self, file_size: int) -> bool:
        """The file holds it, but for a last partial block."""
        return self.n_frames > 0 and 0 < self.n_bytes <= self.room(file_size) + BLOCK

    def ends_with(self, file_size: int) -> bool:
        """The file ends with the data or fills its last block behind them."""
        rest = file_size - self.start - self.n_bytes
        return rest == 0 or (file_size % BLOCK == 0 and 0 < rest <= BLOCK)

    def describe(self) -> str:
        return (
            f"{self.n_points} points, {self.n_channels} channels of {self.samples_per_frame} "
            f"samples, {self.n_frames} frames from byte {self.start}"
        )


def decided_layout(
    path: Path, header: Header, parameters: Parameters, file_size: int
) -> tuple[Layout, list[Finding]]:
    """The layout of the data, and a finding where header and parameters disagree.

    A layout that wants more bytes than the file holds is out (a last partial block is
    forgiven); one that ends with the file goes first. Where the file's length does not decide,
    it is refused: ezc3d takes the parameters' word, and was wrong in 3 of 5 real files.
    """
    stated = _by_header(header, parameters, file_size)
    other = _by_parameters(stated, parameters)
    if stated.n_frames < 1 or stated.words_per_frame < 1 or stated.start < BLOCK:
        stated = other
    both = f"the header counts {stated.describe()}, the parameters {other.describe()}"
    fitting = [layout for layout in dict.fromkeys((stated, other)) if layout.fits(file_size)]
    fitting = [layout for layout in fitting if layout.ends_with(file_size)] or fitting
    if not fitting:
        raise _too_large(path, stated, file_size)
    if len(fitting) == 2:
        raise refusal(path, f"{both}, and the file's length fits both", "one count of each")
    wanted = fitting[0]
    in_file = wanted.room(file_size) // wanted.bytes_per_frame
    chosen = replace(wanted, n_frames=min(wanted.n_frames, in_file))
    said = []
    if stated != other:
        said.append((both, "one count of each", f"read {chosen.describe()}"))
    if missing := wanted.n_frames - chosen.n_frames:
        found = f"the file ends {missing} frames early"
        said.append((found, f"{wanted.n_frames} frames", f"read {chosen.n_frames}"))
    if not chosen.ends_with(file_size):  # bytes came in or went
        rest = file_size - chosen.start - chosen.n_bytes
        found = f"{rest} bytes follow the data that the header counts"
        expected = f"none, or as many as fill the last {BLOCK} bytes"
        said.append((found, expected, "read the data where the header says"))
    return chosen, [Finding("layout", "", *words, "warning") for words in said]


def _too_large(path: Path, stated: Layout, file_size: int) -> BadDataError:
    if stated.words_per_frame < 1:
        found = "it holds no points and no analog samples"
        return refusal(path, found, "markers", "export the trial with its markers")
    found = (
        f"the header promises {stated.n_bytes} bytes of data ({stated.n_points} points, "
        f"{stated.n_frames} frames) and the file holds {stated.room(file_size)}"
    )
    return refusal(path, found, "a complete file", "copy or export the trial again")


def _by_header(header: Header, parameters: Parameters, file_size: int) -> Layout:
    samples = max(header.samples_per_frame, 1)
    layout = Layout(
        n_points=header.n_points,
        n_channels=header.n_analog_per_frame // samples,
        samples_per_frame=samples,
        n_frames=header.n_frames,
        is_float=header.scale < 0,
        start=(max(header.data_start_block, 1) - 1) * BLOCK,
    )
    if header.is_full or header.n_frames < 1:
        in_file = layout.room(file_size) // max(layout.bytes_per_frame, 1)
        return replace(layout, n_frames=_many_frames(parameters) or in_file)
    return layout


def _many_frames(parameters: Parameters) -> int:
    """The count of frames that does not fit the header, 0 if nothing shows it.

    TRIAL's fields of two words each, the low word first, or a float.
    """
    trial, point, ends = parameters.get("TRIAL", {}), parameters.get("POINT", {}), []
    for name in ("ACTUAL_START_FIELD", "ACTUAL_END_FIELD"):
        words = trial.get(name)
        if isinstance(words, np.ndarray) and words.size == 2:
            low, high = np.ravel(words).astype(int) & 0xFFFF
            ends.append(float(low + 65536 * high))
    span = [ends[1] - ends[0] + 1] if len(ends) == 2 else []
    for count in (*span, number(point, "LONG_FRAMES"), number(point, "FRAMES")):
        if np.isfinite(count) and count > 0:
            return int(min(count, 2**40))
    return 0


def _by_parameters(stated: Layout, parameters: Parameters) -> Layout:
    """What the groups POINT and ANALOG say, the header's where they say nothing."""
    point, analog = parameters.get("POINT", {}), parameters.get("ANALOG", {})
    n_points, n_frames = _count(point, "USED"), _count(point, "FRAMES")
    n_channels, block = _count(analog, "USED"), _count(point, "DATA_START")
    if n_frames == FULL or (n_frames is not None and n_frames == stated.n_frames & FULL):
        n_frames = None  # the count that does not fit
    return replace(
        stated,
        n_points=stated.n_points if n_points is None else n_points,
        n_channels=stated.n_channels if n_channels is None else n_channels,
        n_frames=n_frames or stated.n_frames,
        start=(block - 1) * BLOCK if block is not None and block > 1 else stated.start,
    )


def _count(group: Group, name: str) -> int | None:
    """A count, stored as an integer without sign or as a float."""
    value = number(group, name)
    if not np.isfinite(value) or abs(value) > 1e9:
        return None
    return int(value) & 0xFFFF if value < 0 else int(value)


# --- rates and scales -----------------------------------------------------------------------------


def decided_rate(
    path: Path, header: Header, parameters: Parameters, layout: Layout
) -> tuple[float, list[Finding]]:
    """Frames per second, and findings where the file's statements of rates differ."""
    stated = number(parameters.get("POINT", {}), "RATE")
    usable = [rate for rate in (stated, header.rate_hz) if np.isfinite(rate) and 0 < rate < MOST_HZ]
    if not usable:
        found, remedy = f"POINT:RATE is {stated:g} Hz", "export the trial with its rate"
        raise refusal(path, found, "a rate above 0 Hz", remedy)
    rate_hz, findings = usable[0], []
    if len(usable) < 2 or abs(usable[1] / rate_hz - 1) > _SAME:
        found = f"POINT:RATE says {stated:g} Hz, the header {header.rate_hz:g} Hz"
        action = f"read {rate_hz:g} Hz"
        findings.append(Finding("rate", "points", found, "one rate", action, "warning"))
    analog_hz = number(parameters.get("ANALOG", {}), "RATE")
    real_hz = rate_hz * layout.samples_per_frame
    if layout.n_channels and not abs(analog_hz / real_hz - 1) <= _SAME:
        found = (
            f"ANALOG:RATE says {analog_hz:g} Hz, and each frame of the markers at "
            f"{rate_hz:g} Hz has {layout.samples_per_frame} samples"
        )
        expected = f"{real_hz:g} Hz"
        findings.append(Finding("rate", "analog", found, expected, f"read {expected}", "corrected"))
    return rate_hz, findings


def decided_scale(header: Header, parameters: Parameters) -> tuple[float, list[Finding]]:
    """Size of one count of the coordinates, negative where they are floats, as ezc3d wants it."""
    stated = number(parameters.get("POINT", {}), "SCALE")
    if not np.isfinite(stated) or stated == 0:
        stated = header.scale if np.isfinite(header.scale) and header.scale else 1.0
    size = abs(stated)
    if header.scale < 0:
        return -size, []
    if abs(size - header.scale) <= _SAME * size:
        return size, []
    found = f"POINT:SCALE is {stated:g}, the header says {header.scale:g}"
    return size, [Finding("scale", "points", found, "one scale", f"used {size:g}", "warning")]


def about_scales(group: Group, n_channels: int) -> list[Finding]:
    """A warning where there are scales, and not for all channels."""
    n_scales = np.ravel(numbers(group, "SCALE")).size
    if n_scales == 0 or n_scales >= n_channels:
        return []
    found = f"ANALOG:SCALE has {n_scales} numbers for {n_channels} channels"
    action = f"took 1 for those after the {n_scales}th; export the trial again"
    return [Finding("scale", "analog", found, "one for each channel", action, "warning")]


@dataclass(frozen=True, eq=False)
class Scaling:
    """Of the analog channels: (count - offset) x scale, each (n_channels,)."""

    scales: np.ndarray
    offsets: np.ndarray
    is_unsigned: bool

    def applied(self, counts: np.ndarray, is_float: bool) -> np.ndarray:
        """Counts of the converter (n_channels, n) as the file scales them."""
        if self.is_unsigned and not is_float:
            counts = np.where(counts < 0, counts + _WORD, counts)
        with np.errstate(invalid="ignore", over="ignore"):
            return (counts - self.offsets[:, None]) * self.scales[:, None]


def scaling_of(group: Group, n_channels: int, is_unsigned: bool) -> Scaling:
    """GEN_SCALE times SCALE, one where the file says nothing; OFFSET, zero likewise.

    What the file says may be no number, or zero: a plate of such channels is left out. An offset of
    -32768 is the middle of counts without sign, written with one.
    """
    general = number(group, "GEN_SCALE") if np.size(group.get("GEN_SCALE", ())) else 1.0
    scales, offsets = np.ones(n_channels), np.zeros(n_channels)
    for values, name in ((scales, "SCALE"), (offsets, "OFFSET")):
        given = np.ravel(numbers(group, name))[:n_channels]
        values[: len(given)] = given
    with np.errstate(invalid="ignore", over="ignore"):
        scales *= general
    is_unsigned = is_unsigned or bool((offsets == -_WORD // 2).any())
    if is_unsigned:
        offsets = np.where(offsets < 0, offsets + _WORD, offsets)
    return Scaling(scales, offsets, is_unsigned)


def says_unsigned(records: Sequence[Record]) -> bool:
    """ANALOG:FORMAT: whether integer samples and offsets have no sign."""
    names = group_names(records)
    formats = [
        record.value
        for record in records
        if record.kind == TEXT and (names.get(record.group), record.name) == ("ANALOG", "FORMAT")
    ]
    return bool(formats) and formats[-1].strip().startswith(b"UNSIGNED")
