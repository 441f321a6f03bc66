"""What a C3D file holds: markers and analog samples, by the counts, rates and scales that are
believed where header, parameters and the file's length contradict each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_format import (
    BLOCK,
    FULL,
    Group,
    Header,
    Parameters,
    floats,
    integers,
    number,
    numbers,
    read_header,
    read_parameters,
    texts,
)
from bsip_cli.recordings.model import Finding, refusal
from bsip_cli.recordings.text_tables import MOST_HZ

_LARGEST_FILE = 2**31  # bytes


@dataclass(frozen=True, eq=False)
class Content:
    """What a C3D file holds, in its units and lab frame.

    positions : (n_frames, n_points, 3); NaN where the point was not seen, unless none ever is.
    is_valid : (n_frames, n_points) bool, a camera saw the point. analog : (n_channels, n_frames *
    samples_per_frame). first_frame : counted from 0. analog_scales : (n_channels,) of one converter
    count.
    """

    parameters: Parameters
    positions: np.ndarray
    is_valid: np.ndarray
    analog: np.ndarray
    rate_hz: float
    first_frame: int
    analog_scales: np.ndarray
    samples_per_frame: int
    findings: tuple[Finding, ...]

    @property
    def time0_s(self) -> float:
        """Of the first frame."""
        return self.first_frame / self.rate_hz

    def group(self, name: str) -> Group:
        return self.parameters.get(name, {})


def read_content(path: Path) -> Content:
    """Read a C3D file; a foreign, broken or cut one is refused."""
    raw = _bytes(path)
    header = read_header(path, raw)
    reach = (header.data_start_block - 1) * BLOCK if header.data_start_block > 2 else None
    parameters = read_parameters(path, raw[:reach], header.processor)
    layout, findings = decided_layout(path, header, parameters, raw)
    rate_hz, about_rate = decided_rate(path, header, parameters, layout)
    scale, about_scale = decided_scale(header, parameters, layout.is_float)
    about_scale += about_scales(parameters.get("ANALOG", {}), layout.n_channels)
    data = raw[layout.start : layout.start + layout.n_bytes]
    words = floats(data, header.processor) if layout.is_float else integers(data)
    frames = words.reshape(layout.n_frames, layout.words_per_frame)
    points, samples = np.split(frames, [4 * layout.n_points], axis=1)
    if header.is_full:
        points = points[: _n_filled(points, layout)]
    places = points.reshape(len(points), layout.n_points, 4)
    positions = places[..., :3] * (1.0 if layout.is_float else scale)
    is_valid = places[..., 3] >= 0
    if is_valid.any():
        positions[~is_valid] = np.nan
    n_samples = len(points) * layout.samples_per_frame
    counts = samples[: len(points)].reshape(n_samples, layout.n_channels).T
    analog, scales = scaled(counts, parameters.get("ANALOG", {}), layout.is_float)
    return Content(
        parameters,
        positions,
        is_valid,
        analog,
        rate_hz,
        first_frame=max(header.first_frame, 1) - 1,
        analog_scales=scales,
        samples_per_frame=layout.samples_per_frame,
        findings=(*findings, *about_rate, *about_scale),
    )


def _bytes(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        if size > _LARGEST_FILE:
            found, most = f"a file of {size / 1e9:.1f} GB", f"at most {_LARGEST_FILE / 1e9:.1f} GB"
            raise refusal(path, found, most, "cut the trial into shorter ones")
        return path.read_bytes()
    except OSError as error:
        raise BadDataError(f"cannot be opened ({error.strerror})", file=path) from error


def _n_filled(points: np.ndarray, layout: Layout) -> int:
    """The number of frames without those of zeros that only fill the last block of the file."""
    n = len(points)
    most = min(BLOCK // layout.bytes_per_frame, n - 1)
    filled = np.flatnonzero(points[n - most :].any(axis=1))
    return n - most + (int(filled[-1]) + 1 if len(filled) else 0)


# --- what header and parameters both state: the file's size judges between them -------------------


_SAME = 1e-3
_TINY, _HUGE, _MOSTLY = 1e-9, 1e9, 0.99  # of floats in any unit; of pairs of integers few are so
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
    path: Path, header: Header, parameters: Parameters, content: bytes
) -> tuple[Layout, list[Finding]]:
    """The layout of the data, and a finding where header and parameters disagree.

    A layout that wants more bytes than the file holds is out (a last partial block is
    forgiven); one that ends with the file goes first. Where the file's length does not decide,
    it is refused: the parameters' word was wrong in 3 of 5 real files. Where the
    sign of the scales is not that of what is written, numbers and length decide together.
    """
    file_size = len(content)
    stated = _by_header(header, parameters, file_size)
    many = replace(stated, n_frames=_many_frames(parameters))
    if many.n_frames > stated.n_frames and many.ends_with(file_size):
        stated = many  # of the header's count the high word is lost
    other = _by_parameters(stated, parameters)
    if stated.n_frames < 1 or stated.words_per_frame < 1 or stated.start < BLOCK:
        stated = other
    if not (stated.ends_with(file_size) or other.ends_with(file_size)):
        for one in (stated, other):
            read = replace(one, is_float=not one.is_float)
            are_floats = read.fits(file_size) and _are_floats(content[read.start :], header)
            if read.ends_with(file_size) and read.n_frames > 0 and are_floats == read.is_float:
                return read, [_about_kind(read, header, parameters)]
    both = f"the header counts {stated.describe()}, the parameters {other.describe()}"
    fitting = [layout for layout in dict.fromkeys((stated, other)) if layout.fits(file_size)]
    fitting = [layout for layout in fitting if layout.ends_with(file_size)] or fitting
    if not fitting and stated.words_per_frame < 1:
        found, remedy = (
            "it holds no points and no analog samples",
            "export the trial with its markers",
        )
        raise refusal(path, found, "markers", remedy)
    if not fitting:
        found = (
            f"the header promises {stated.n_bytes} bytes of data ({stated.n_points} points, "
            f"{stated.n_frames} frames) and the file holds {stated.room(file_size)}"
        )
        raise refusal(path, found, "a complete file", "copy or export the trial again")
    if len(fitting) == 2:
        raise refusal(path, f"{both}, and the file's length fits both", "one count of each")
    wanted = fitting[0]
    in_file = wanted.room(file_size) // wanted.bytes_per_frame
    if not in_file:
        remedy = "copy or export the trial again"
        raise refusal(path, "the file ends before its first frame does", "a complete file", remedy)
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


def _are_floats(data: bytes, header: Header) -> bool:
    """Whether coordinates and samples can be 32-bit floats: two integers hardly make such sizes."""
    with np.errstate(invalid="ignore"):
        sizes = np.abs(floats(data[: len(data) // 4 * 4], header.processor))
    sizes = sizes[~np.isnan(sizes)]  # gaps
    are_such = (sizes == 0) | ((sizes > _TINY) & (sizes < _HUGE))
    return bool(len(sizes) and are_such.mean() > _MOSTLY)


def _about_kind(read: Layout, header: Header, parameters: Parameters) -> Finding:
    stated = number(parameters.get("POINT", {}), "SCALE")
    found = f"POINT:SCALE is {stated:g}, the header's scale {header.scale:g}, and the data are "
    kind = "floats" if read.is_float else "integers"
    expected = f"{'negative' if read.is_float else 'positive'} scales of {kind}"
    return Finding("scale", "points", found + kind, expected, f"read {kind}", "corrected")


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
    """Frames per second, and findings where the file's statements of rates differ: the header's
    where ANALOG:RATE or TRIAL:CAMERA_RATE agree with it and with POINT:RATE neither does."""
    stated = number(parameters.get("POINT", {}), "RATE")
    usable = [rate for rate in (stated, header.rate_hz) if np.isfinite(rate) and 0 < rate < MOST_HZ]
    if not usable:
        found, remedy = f"POINT:RATE is {stated:g} Hz", "export the trial with its rate"
        raise refusal(path, found, "a rate above 0 Hz", remedy)
    rate_hz, findings = usable[0], []
    analog_hz = number(parameters.get("ANALOG", {}), "RATE")
    if len(usable) < 2 or abs(usable[1] / rate_hz - 1) > _SAME:
        cameras_hz = number(parameters.get("TRIAL", {}), "CAMERA_RATE")
        of_analog_hz = analog_hz / layout.samples_per_frame if layout.n_channels else np.nan
        others_hz = np.array([of_analog_hz, cameras_hz])
        agrees = [bool((np.abs(others_hz / one - 1) <= _SAME).any()) for one in usable]
        found = f"POINT:RATE says {stated:g} Hz, the header {header.rate_hz:g} Hz"
        level = "warning"
        if agrees == [False, True]:
            rate_hz, level = usable[1], "corrected"
            found += ", with which ANALOG:RATE or TRIAL:CAMERA_RATE agrees"
        action = f"read {rate_hz:g} Hz"
        findings.append(Finding("rate", "points", found, "one rate", action, level))
    real_hz = rate_hz * layout.samples_per_frame
    if layout.n_channels and not abs(analog_hz / real_hz - 1) <= _SAME:
        found = (
            f"ANALOG:RATE says {analog_hz:g} Hz, and each frame of the markers at "
            f"{rate_hz:g} Hz has {layout.samples_per_frame} samples"
        )
        expected = f"{real_hz:g} Hz"
        findings.append(Finding("rate", "analog", found, expected, f"read {expected}", "corrected"))
    return rate_hz, findings


def decided_scale(
    header: Header, parameters: Parameters, is_float: bool
) -> tuple[float, list[Finding]]:
    """Size of one count of the coordinates that are integers."""
    stated = number(parameters.get("POINT", {}), "SCALE")
    if not np.isfinite(stated) or stated == 0:
        stated = header.scale if np.isfinite(header.scale) and header.scale else 1.0
    size = abs(stated)
    if is_float or abs(size - abs(header.scale)) <= _SAME * size:
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


def scaled(counts: np.ndarray, group: Group, is_float: bool) -> tuple[np.ndarray, np.ndarray]:
    """Of the converter's counts (n_channels, n), as ANALOG scales them, (count - OFFSET) x SCALE x
    GEN_SCALE; and the size of each channel's count. One and zero where the file says nothing.

    What the file says may be no number, or zero: a plate of such channels is left out. Integers and
    offsets have no sign if FORMAT says so, or an offset at either end of counts with a sign, which
    is the middle of counts without.
    """
    scales, offsets = np.ones(len(counts)), np.zeros(len(counts))
    for values, name in ((scales, "SCALE"), (offsets, "OFFSET")):
        given = np.ravel(numbers(group, name))[: len(counts)]
        values[: len(given)] = given
    is_unsigned = "".join(texts(group, "FORMAT")).startswith("UNSIGNED")
    if is_unsigned or (np.abs(offsets) >= _WORD // 2 - 1).any():
        offsets = np.where(offsets < 0, offsets + _WORD, offsets)
        counts = counts if is_float else np.where(counts < 0, counts + float(_WORD), counts)
    with np.errstate(invalid="ignore", over="ignore"):
        if numbers(group, "GEN_SCALE").size:
            scales *= number(group, "GEN_SCALE")
        return (counts - offsets[:, None]) * scales[:, None], scales
