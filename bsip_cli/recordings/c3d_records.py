"""The chain of records of a C3D file's parameter section, followed before ezc3d follows it.

A torn chain makes ezc3d fill gigabytes of memory for minutes, and the counts that parameters and
header give must be compared with the file's size before anything is read by them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_header import BLOCK
from bsip_cli.recordings.c3d_numbers import floats, integers
from bsip_cli.recordings.c3d_parameters import Parameters, Value

TEXT, BYTE, INTEGER, FLOAT = -1, 1, 2, 4  # the size of one is the absolute value
LONGEST_DESCRIPTION = 127  # ezc3d reads the length as a signed byte
_MOST_RECORDS = 20_000


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
        read = {
            BYTE: lambda: np.frombuffer(self.value, np.uint8).astype(np.int16),
            INTEGER: lambda: integers(self.value),
            FLOAT: lambda: floats(self.value, processor),
        }[self.kind]
        return read().reshape(self.shape or (1,), order="F")


class _BrokenError(Exception):
    """Where the chain of records cannot be followed; turned into a BadDataError."""


def read_records(path: Path, content: bytes) -> list[Record]:
    """All records in their order; ``content`` is the file up to its data."""
    try:
        return _records(content)
    except _BrokenError as fault:
        raise BadDataError(
            f"its parameter section is broken: {fault}",
            expected="a standard C3D file",
            remedy="export the trial again",
            file=path,
        ) from fault


def parameters_of(records: Sequence[Record], processor: int) -> Parameters:
    """The numeric parameters by group and name; texts count as empty."""
    names = group_names(records)
    found: dict[str, dict[str, Value]] = {name: {} for name in names.values()}
    for record in records:
        if record.group in names:
            found[names[record.group]][record.name] = record.numbers(processor)
    return found


def group_names(records: Sequence[Record]) -> Mapping[int, str]:
    """Names of the groups by their (positive) number."""
    return {-record.group: record.name for record in records if record.group < 0}


def _records(content: bytes) -> list[Record]:
    found: list[Record] = []
    position = (content[0] - 1) * BLOCK + 4
    for _ in range(_MOST_RECORDS):
        if not 0 <= position < len(content) - 2:
            raise _BrokenError("its records run into the data")
        length = abs(_signed(content[position]))
        if length == 0:
            break
        after_name = position + 2 + length
        name = _name(content, position + 2, after_name)
        step = int(integers(content[after_name : after_name + 2])[0]) & 0xFFFF
        found.append(_record(content, _signed(content[position + 1]), name, after_name, step))
        if step == 0:
            break
        position = after_name + step
    return found


def _name(content: bytes, start: int, stop: int) -> str:
    name = content[start:stop]
    if len(content) < stop + 4 or not all(32 <= byte < 127 for byte in name):
        raise _BrokenError(f"the record at byte {start - 2} has no readable name")
    return name.decode("ascii").strip().upper()


def _record(content: bytes, group: int, name: str, after_name: int, step: int) -> Record:
    at = after_name + 2
    if group < 0:
        description, stop = _description(content, at)
        is_plain = _is_plain(description, stop - after_name, step)
        return Record(group, name, description, is_plain)
    if group == 0:
        raise _BrokenError(f"{name} belongs to no group")
    kind, rank = _signed(content[at]), content[at + 1]
    if kind not in (TEXT, BYTE, INTEGER, FLOAT) or rank > 7:
        raise _BrokenError(f"{name} has type {kind} and {rank} dimensions")
    shape = tuple(content[at + 2 : at + 2 + rank])
    start = at + 2 + rank
    size = abs(kind) * math.prod(shape)
    value = content[start : start + size]
    if len(value) < size or len(shape) < rank:
        raise _BrokenError(f"{name} claims {size} bytes, more than there are")
    description, stop = _description(content, start + size)
    is_plain = _is_plain(description, stop - after_name, step)
    return Record(group, name, description, is_plain, kind, shape, value)


def _description(content: bytes, at: int) -> tuple[bytes, int]:
    """A description whose length is at a byte, and where it ends."""
    length = content[at] if at < len(content) else 0
    return content[at + 1 : at + 1 + length], at + 1 + length


def _is_plain(description: bytes, length: int, step: int) -> bool:
    return step in (0, length) and len(description) <= LONGEST_DESCRIPTION


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte
