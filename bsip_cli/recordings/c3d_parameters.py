"""The parameter section of a C3D file: groups of named texts and arrays of numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_numbers import floats, integers

_BLOCK = 512
_TEXT, _BYTE, _INTEGER, _FLOAT = -1, 1, 2, 4  # the size of one is the absolute value
_MOST_RECORDS = 20_000

Value = tuple[str, ...] | np.ndarray
Group = Mapping[str, Value]
Parameters = Mapping[str, Group]


class _BrokenError(Exception):
    """Where the chain of records cannot be followed; turned into a BadDataError."""


def read_parameters(path: Path, content: bytes, processor: int) -> Parameters:
    """All groups by name in capitals; ``content`` is the file up to its data.

    Numbers come as arrays whose last axis counts plates or channels, as the format stores
    them (first index fastest); texts without the blanks that fill them up.
    """
    try:
        return _groups(content, processor)
    except _BrokenError as fault:
        raise BadDataError(
            f"its parameter section is broken: {fault}",
            expected="a standard C3D file",
            remedy="export the trial again",
            file=path,
        ) from fault


def numbers(group: Group, name: str) -> np.ndarray:
    """A numeric parameter with its continuations (SCALE, SCALE2, ...); empty if there is none."""
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
    return [text for part in parts for text in part]


def number(group: Group, name: str) -> float:
    """The first number of a parameter, NaN if there is none."""
    values = np.ravel(numbers(group, name))
    return float(values[0]) if len(values) else float("nan")


def _continued(group: Group, name: str) -> list[Value]:
    parts = [group[name]] if name in group else []
    more = 2
    while parts and f"{name}{more}" in group:
        parts.append(group[f"{name}{more}"])
        more += 1
    return parts


def _groups(content: bytes, processor: int) -> dict[str, dict[str, Value]]:
    names: dict[int, str] = {}
    found: list[tuple[int, str, Value]] = []
    position = (content[0] - 1) * _BLOCK + 4
    for _ in range(_MOST_RECORDS):
        if not 0 <= position < len(content) - 2:
            raise _BrokenError("its records run into the data")
        length = abs(_signed(content[position]))
        if length == 0:
            break
        group = _signed(content[position + 1])
        after_name = position + 2 + length
        name = _name(content, position + 2, after_name)
        if group < 0:
            names[-group] = name
        elif group > 0:
            found.append((group, name, _value(content, after_name + 2, name, processor)))
        else:
            raise _BrokenError(f"{name} belongs to no group")
        step = int(integers(content[after_name : after_name + 2], processor)[0]) & 0xFFFF
        if step == 0:
            break
        position = after_name + step
    result: dict[str, dict[str, Value]] = {name: {} for name in names.values()}
    for group, name, value in found:
        if group in names:
            result[names[group]][name] = value
    return result


def _name(content: bytes, start: int, stop: int) -> str:
    name = content[start:stop]
    if len(content) < stop + 4 or not all(32 <= byte < 127 for byte in name):
        raise _BrokenError(f"the record at byte {start - 2} has no readable name")
    return name.decode("ascii").strip().upper()


def _value(content: bytes, at: int, name: str, processor: int) -> Value:
    """One parameter's value, whose type is at a byte."""
    kind, rank = _signed(content[at]), content[at + 1]
    if kind not in (_TEXT, _BYTE, _INTEGER, _FLOAT) or rank > 7:
        raise _BrokenError(f"{name} has type {kind} and {rank} dimensions")
    shape = tuple(content[at + 2 : at + 2 + rank])
    start = at + 2 + rank
    size = abs(kind) * math.prod(shape)
    raw = content[start : start + size]
    if len(raw) < size or len(shape) < rank:
        raise _BrokenError(f"{name} claims {size} bytes, more than there are")
    if kind == _TEXT:
        return _split_text(raw, shape)
    values = {
        _BYTE: lambda: np.frombuffer(raw, np.uint8).astype(np.int16),
        _INTEGER: lambda: integers(raw, processor),
        _FLOAT: lambda: floats(raw, processor),
    }[kind]()
    return values.reshape(shape or (1,), order="F")


def _split_text(raw: bytes, shape: tuple[int, ...]) -> tuple[str, ...]:
    """Texts of equal length, the first dimension, one after the other."""
    length = shape[0] if shape else 1
    if length == 0:
        return ("",) * math.prod(shape[1:])
    cells = (raw[i : i + length] for i in range(0, len(raw), length))
    return tuple(_decoded(cell).replace("\0", " ").strip() for cell in cells)


def _decoded(cell: bytes) -> str:
    try:
        return cell.decode("utf-8")
    except UnicodeDecodeError:
        return cell.decode("latin-1")


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte
