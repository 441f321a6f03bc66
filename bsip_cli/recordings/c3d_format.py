"""The C3D format: numbers, header and parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.model import refusal

BLOCK = 512
FULL = 0xFFFF  # frame number that does not fit the header's word
_C3D_KEY = 0x50
_PC, _DEC, _MIPS = 84, 85, 86  # processors; files of the last are hardly met, and are refused
_TEXT, _BYTE, _INTEGER, _FLOAT = -1, 1, 2, 4  # the size of one is the absolute value
_MOST_RECORDS = 20_000
_MOST_EMPTY = 255  # texts without letters, of which a torn file may claim any number

Value = tuple[str, ...] | np.ndarray
Group = Mapping[str, Value]
Parameters = Mapping[str, Group]


# --- numbers as a processor stores them -----------------------------------------------------------


def integers(raw: bytes) -> np.ndarray:
    """Signed 16-bit integers."""
    return np.frombuffer(raw, "<i2")


def floats(raw: bytes, processor: int) -> np.ndarray:
    """32-bit floats as float64: IEEE, or of a VAX, whose high word comes first and whose exponent
    is larger by two."""
    with np.errstate(invalid="ignore"):  # bits of a signalling NaN
        if processor != _DEC:
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
    if len(content) < BLOCK or content[1] != _C3D_KEY or content[0] < 1:
        raise refusal(path, f"no C3D header in a file of {len(content)} bytes", "a C3D file")
    at = (content[0] - 1) * BLOCK + 3
    processor = content[at] if at < len(content) else 0
    if processor not in (_PC, _DEC):
        raise BadDataError(
            f"its parameter section names processor {processor}"
            f"{' (MIPS)' if processor == _MIPS else ''}, which bsip does not read",
            expected="84 (PC) or 85 (DEC)",
            remedy="export the trial again, or convert it to the PC format",
            file=path,
        )
    _, *counts = integers(content[:BLOCK]).view(np.uint16)[:10].tolist()
    scale, rate_hz = floats(content[12:16] + content[20:24], processor).tolist()
    n_points, n_analog, first, last, *_, data_start, samples = counts
    return Header(processor, n_points, n_analog, first, last, scale, data_start, samples, rate_hz)


# --- the chain of parameters ----------------------------------------------------------------------


class _BrokenError(Exception):
    """Where the chain of records cannot be followed; turned into a BadDataError."""


def read_parameters(path: Path, content: bytes, processor: int) -> Parameters:
    """All parameters by group and name; ``content`` is the file up to its data."""
    groups: dict[int, str] = {}
    values: list[tuple[int, str, Value]] = []
    at, claimed = (content[0] - 1) * BLOCK + 4, 0
    try:
        for _ in range(_MOST_RECORDS):
            if not 0 <= at < len(content):
                raise _BrokenError("its records run into the data")
            if not (n_letters := abs(_signed(content[at]))):
                break
            after = at + 2 + n_letters
            letters = content[at + 2 : after]
            if len(content) < after + 4 or not all(32 <= byte < 127 for byte in letters):
                raise _BrokenError(f"the record at byte {at} has no readable name")
            number = _signed(content[at + 1])
            name = letters.decode("ascii").strip().upper()
            if number == 0:
                raise _BrokenError(f"{name} belongs to no group")
            if number < 0:
                groups[-number] = name
            else:
                value, size = _value(content, after + 2, name, processor)
                claimed += size
                if claimed > len(content):
                    raise _BrokenError(f"{name} and those before claim more bytes than there are")
                values.append((number, name, value))
            step = content[after] + 256 * content[after + 1]
            if not step:
                break
            at = after + step
    except _BrokenError as fault:
        told = f"its parameter section is broken: {fault}"
        raise refusal(path, told, "a standard C3D file") from fault
    found: dict[str, dict[str, Value]] = {name: {} for name in groups.values()}
    for number, name, value in values:
        if number in groups:
            found[groups[number]][name] = value
    return found


def _value(content: bytes, at: int, name: str, processor: int) -> tuple[Value, int]:
    """Of the parameter whose type stands at a byte: texts, or numbers in their shape, first index
    fastest; and the bytes that it fills."""
    kind, rank = _signed(content[at]), content[at + 1]
    if kind not in (_TEXT, _BYTE, _INTEGER, _FLOAT) or rank > 7:
        raise _BrokenError(f"{name} has type {kind} and {rank} dimensions")
    start = at + 2 + rank
    shape = tuple(content[at + 2 : start])
    size = abs(kind) * math.prod(shape)
    raw = content[start : start + size]
    if len(raw) < size or len(shape) < rank:
        raise _BrokenError(f"{name} claims {size} bytes, more than there are")
    if kind == _TEXT:
        width, *others = shape or (1,)
        n = size // width if width else min(math.prod(others), _MOST_EMPTY) * bool(others)
        return tuple(_text(raw[k * width : (k + 1) * width]) for k in range(n)), size
    if kind == _BYTE:
        flat = np.frombuffer(raw, np.uint8)
    else:
        flat = floats(raw, processor) if kind == _FLOAT else integers(raw)
    return flat.reshape(shape or (1,), order="F"), size


def _text(raw: bytes) -> str:
    """Without filling blanks; bytes that are no UTF-8 are Latin-1."""
    try:
        known = raw.decode("utf-8")
    except UnicodeDecodeError:
        known = raw.decode("latin-1")
    return known.replace("\0", " ").strip()


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte
