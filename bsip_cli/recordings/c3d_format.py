"""The C3D format as far as it is followed before ezc3d may: numbers, header, parameters.

A torn chain of parameters makes ezc3d fill gigabytes of memory for minutes, and the counts that
parameters and header give must be compared with the file's size before anything is read by them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.model import refusal

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
