"""The C3D format as far as it is followed before ezc3d may: numbers, header, parameters,
and where both state counts, rates or scales, which of them is believed.

A torn chain of parameters makes ezc3d fill gigabytes of memory for minutes, and the counts that
parameters and header give must be compared with the file's size before anything is read by them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.model import Finding, refusal
from bsip_cli.recordings.text_tables import MOST_HZ

BLOCK = 512
C3D_KEY = 0x50
FULL = 0xFFFF  # frame number that does not fit the header's word
PC, DEC, MIPS = 84, 85, 86  # processors; ezc3d knows no numbers of the last, which is refused
TEXT, BYTE, INTEGER, FLOAT = -1, 1, 2, 4  # the size of one is the absolute value
LONGEST_DESCRIPTION = 127  # ezc3d reads the length as a signed byte
_MOST_RECORDS = 20_000

Value = tuple[str, ...] | np.ndarray
Group = Mapping[str, Value]
Parameters = Mapping[str, Group]


# --- numbers as a processor stores them -----------------------------------------------------------


def integers(raw: bytes) -> np.ndarray:
    """Signed 16-bit integers."""
    return np.frombuffer(raw, "<i2").astype(np.int16)


def floats(raw: bytes, processor: int) -> np.ndarray:
    """32-bit floats as float64: IEEE, or of a VAX, whose high word comes first and whose exponent
    is larger by two."""
    with np.errstate(invalid="ignore"):  # bits of a signalling NaN
        if processor != DEC:
            return np.frombuffer(raw, "<f4").astype(float)
        high, low = np.frombuffer(raw, "<u2").reshape(-1, 2).T.astype(np.uint32)
        values = ((high << 16) | low).view(np.float32).astype(float) / 4
        values[(high & 0x7F80) == 0] = 0.0
        return values


# --- groups of named texts and arrays -------------------------------------------------------------


def numbers(group: Group, name: str) -> np.ndarray:
    """A numeric parameter with its continuations (SCALE, SCALE2, ...); empty if there is none.

    The last axis counts plates or channels, as the format stores it (first index fastest).
    """
    parts = [part for part in _continued(group, name) if isinstance(part, np.ndarray)]
    if len(parts) == 1:
        return parts[0].astype(float)
    return np.concatenate([np.zeros(0), *(np.ravel(part) for part in parts)])


def whole_numbers(group: Group, name: str) -> np.ndarray:
    """A numeric parameter as integers, also where it is stored as floats; NaN counts as 0."""
    return np.clip(np.nan_to_num(numbers(group, name)), -1e9, 1e9).astype(int)


def texts(group: Group, name: str) -> list[str]:
    """A text parameter with its continuations (LABELS, LABELS2, ...); empty if there is none."""
    parts = [part for part in _continued(group, name) if isinstance(part, tuple)]
    return [printable(text) for part in parts for text in part]


def number(group: Group, name: str) -> float:
    """The first number of a parameter, NaN if there is none."""
    return float(next(iter(np.ravel(numbers(group, name))), math.nan))


def _continued(group: Group, name: str) -> list[Value]:
    parts: list[Value] = []
    while (part := group.get(f"{name}{len(parts) + 1}" if parts else name)) is not None:
        parts.append(part)
    return parts


# --- the first block ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """The counts a C3D header claims."""

    processor: int
    n_points: int
    n_analog_per_frame: int  # channels times samples per frame
    first_frame: int  # counted from 1
    last_frame: int
    scale: float  # negative: the data are floats
    data_start_block: int
    samples_per_frame: int
    rate_hz: float

    @property
    def n_frames(self) -> int:
        return self.last_frame - self.first_frame + 1

    @property
    def is_full(self) -> bool:
        """The last frame's number does not fit: the true count is elsewhere."""
        return self.last_frame == FULL


def read_header(path: Path, content: bytes) -> Header:
    """Parse the header; refuse an empty or foreign file with what was found."""
    if not content:
        remedy = "copy or export the trial again"
        raise refusal(path, "the file is empty", "a C3D file", remedy)
    if len(content) < BLOCK or content[1] != C3D_KEY or content[0] < 1:
        raise refusal(path, f"no C3D header in a file of {len(content)} bytes", "a C3D file")
    at = (content[0] - 1) * BLOCK + 3
    processor = content[at] if at < len(content) else 0
    if processor not in (PC, DEC):
        raise BadDataError(
            f"its parameter section names processor {processor}"
            f"{' (MIPS)' if processor == MIPS else ''}, which ezc3d does not read",
            expected="84 (PC) or 85 (DEC)",
            remedy="export the trial again, or convert it to the PC format",
            file=path,
        )
    _, *counts = integers(content[:BLOCK]).view(np.uint16)[:10].tolist()
    scale, rate_hz = floats(content[12:16] + content[20:24], processor).tolist()
    n_points, n_analog, first, last, *_, data_start, samples = counts
    return Header(processor, n_points, n_analog, first, last, scale, data_start, samples, rate_hz)


# --- the chain of parameters ----------------------------------------------------------------------


@dataclass(frozen=True)
class Record:
    """One group (negative id) or parameter, its value as stored."""

    group: int
    name: str
    description: bytes
    is_plain: bool  # as ezc3d wants it: no gap to the next record, no long description
    kind: int = BYTE
    shape: tuple[int, ...] = (0,)
    value: bytes = b""

    def numbers(self, processor: int) -> np.ndarray:
        """The value in its shape, first index fastest; empty for a text."""
        if self.kind == TEXT:
            return np.zeros(0)
        if self.kind == BYTE:
            flat = np.frombuffer(self.value, np.uint8).astype(np.int16)
        else:
            is_float = self.kind == FLOAT
            flat = floats(self.value, processor) if is_float else integers(self.value)
        return flat.reshape(self.shape or (1,), order="F")


class _BrokenError(Exception):
    """Where the chain of records cannot be followed; turned into a BadDataError."""


def read_records(path: Path, content: bytes) -> list[Record]:
    """All records in their order; ``content`` is the file up to its data."""
    found: list[Record] = []
    position: int | None = (content[0] - 1) * BLOCK + 4
    try:
        while position is not None and len(found) < _MOST_RECORDS:
            position = _follow(content, position, found)
    except _BrokenError as fault:
        told = f"its parameter section is broken: {fault}"
        raise refusal(path, told, "a standard C3D file") from fault
    return found


def _follow(content: bytes, at: int, found: list[Record]) -> int | None:
    """Add the record at a byte to those found; where the next one is, None behind the last."""
    if not 0 <= at < len(content):
        raise _BrokenError("its records run into the data")
    if not (n_letters := abs(_signed(content[at]))):
        return None
    after = at + 2 + n_letters
    letters = content[at + 2 : after]
    if len(content) < after + 4 or not all(32 <= byte < 127 for byte in letters):
        raise _BrokenError(f"the record at byte {at} has no readable name")
    group = _signed(content[at + 1])
    name, step = letters.decode("ascii").strip().upper(), content[after] + 256 * content[after + 1]
    kind, value, end = BYTE, b"", after + 2
    shape: tuple[int, ...] = (0,)
    if group == 0:
        raise _BrokenError(f"{name} belongs to no group")
    if group > 0:
        kind, rank = _signed(content[end]), content[end + 1]
        if kind not in (TEXT, BYTE, INTEGER, FLOAT) or rank > 7:
            raise _BrokenError(f"{name} has type {kind} and {rank} dimensions")
        start = end + 2 + rank
        shape = tuple(content[end + 2 : start])
        size = abs(kind) * math.prod(shape)
        value, end = content[start : start + size], start + size
        if len(value) < size or len(shape) < rank:
            raise _BrokenError(f"{name} claims {size} bytes, more than there are")
    stop = end + 1 + (content[end] if end < len(content) else 0)
    description = content[end + 1 : stop]
    is_plain = step in (0, stop - after) and len(description) <= LONGEST_DESCRIPTION
    found.append(Record(group, name, description, is_plain, kind, shape, value))
    return after + step if step else None


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def group_names(records: Sequence[Record]) -> Mapping[int, str]:
    """Names of the groups by their (positive) number."""
    return {-record.group: record.name for record in records if record.group < 0}


def parameters_of(records: Sequence[Record], processor: int) -> Parameters:
    """The numeric parameters by group and name; texts count as empty."""
    names = group_names(records)
    found: dict[str, dict[str, Value]] = {name: {} for name in names.values()}
    for record in records:
        if record.group in names:
            found[names[record.group]][record.name] = record.numbers(processor)
    return found


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
    it is refused: ezc3d takes the parameters' word, and was wrong in 3 of 5 real files. Where the
    sign of the scales is not that of what is written, numbers and length decide together.
    """
    file_size = len(content)
    stated = _by_header(header, parameters, file_size)
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


def _are_floats(data: bytes, header: Header) -> bool:
    """Whether coordinates and samples can be 32-bit floats: two integers hardly make such sizes."""
    sizes = np.abs(floats(data[: len(data) // 4 * 4], header.processor))
    with np.errstate(invalid="ignore"):
        return bool(((sizes == 0) | ((sizes > _TINY) & (sizes < _HUGE))).mean() > _MOSTLY)


def _about_kind(read: Layout, header: Header, parameters: Parameters) -> Finding:
    stated = number(parameters.get("POINT", {}), "SCALE")
    found = f"POINT:SCALE is {stated:g}, the header's scale {header.scale:g}, and the data are "
    kind = "floats" if read.is_float else "integers"
    expected = f"{'negative' if read.is_float else 'positive'} scales of {kind}"
    return Finding("scale", "points", found + kind, expected, f"read {kind}", "corrected")


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
        others_hz = np.array([analog_hz / layout.samples_per_frame, cameras_hz])
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
    """Size of one count of the coordinates, negative where they are floats, as ezc3d wants it."""
    stated = number(parameters.get("POINT", {}), "SCALE")
    if not np.isfinite(stated) or stated == 0:
        stated = header.scale if np.isfinite(header.scale) and header.scale else 1.0
    size = abs(stated)
    if is_float:
        return -size, []
    if abs(size - abs(header.scale)) <= _SAME * size:
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

    What the file says may be no number, or zero: a plate of such channels is left out. An offset at
    either end of counts with a sign is the middle of counts without.
    """
    general = number(group, "GEN_SCALE") if np.size(group.get("GEN_SCALE", ())) else 1.0
    scales, offsets = np.ones(n_channels), np.zeros(n_channels)
    for values, name in ((scales, "SCALE"), (offsets, "OFFSET")):
        given = np.ravel(numbers(group, name))[:n_channels]
        values[: len(given)] = given
    with np.errstate(invalid="ignore", over="ignore"):
        scales *= general
    is_unsigned = is_unsigned or bool((np.abs(offsets) >= _WORD // 2 - 1).any())
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
