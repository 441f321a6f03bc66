"""A walk over a C3D file's parameter records before ezc3d follows them.

ezc3d reads the length of a description as a signed byte: one of more than 127 characters,
or a torn chain of records, makes it fill gigabytes of memory before it gives up.
"""

from __future__ import annotations

import math
from pathlib import Path

from bsip_cli.errors import BadDataError

_BLOCK = 512
_LONGEST = 127
_TEXT = -1
_NUMBERS = ("USED", "RATE", "SCALE", "FRAMES", "GEN_SCALE", "OFFSET", "DATA_START")
_TYPES = (_TEXT, 1, 2, 4)  # characters, bytes, integers, floats: the size of one in bytes


def check_parameters(path: Path, data_start_block: int) -> None:
    """Refuse a file whose parameter records cannot be followed to their end."""
    fault = find_fault(path.read_bytes()[: _reach(data_start_block)])
    if fault:
        raise BadDataError(
            f"its parameter section is broken: {fault}",
            expected="a standard C3D file",
            remedy="export the trial again",
            file=path,
        )


def find_fault(content: bytes) -> str:
    """What is wrong with the parameter records, or nothing."""
    groups: dict[int, str] = {}
    texts: list[tuple[int, str]] = []
    position = (content[0] - 1) * _BLOCK + 4
    while True:
        if not 0 <= position < len(content) - 2:
            return "its records run into the data"
        length = abs(_signed(content[position]))
        if length == 0:
            return _text_fault(groups, texts)
        after_name = position + 2 + length
        name = _name(content, position + 2, after_name)
        if not name:
            return f"the record at byte {position} has no readable name"
        group = _signed(content[position + 1])
        if fault := _record_fault(content, group, after_name + 2):
            return f"{name} {fault}"
        if group < 0:
            groups[-group] = name
        elif _signed(content[after_name + 2]) == _TEXT:
            texts.append((group, name))
        step = int.from_bytes(content[after_name : after_name + 2], "little")
        if step == 0:
            return _text_fault(groups, texts)
        position = after_name + step


def _name(content: bytes, start: int, stop: int) -> str:
    """The name of a record; empty if it is cut off or no text."""
    name = content[start:stop]
    readable = len(content) >= stop + 4 and all(32 <= byte < 127 for byte in name)
    return name.decode("ascii").upper() if readable else ""


def _text_fault(groups: dict[int, str], texts: list[tuple[int, str]]) -> str:
    """ezc3d takes these for numbers without looking, and crashes."""
    for group, name in texts:
        if groups.get(group) in ("POINT", "ANALOG") and name in _NUMBERS:
            return f"{groups[group]}:{name} is text"
    return ""


def _record_fault(content: bytes, group: int, at: int) -> str:
    """The fault of one group (negative id) or parameter, whose body starts at a byte."""
    if group < 0:
        return "" if content[at] <= _LONGEST else f"has a description of {content[at]} characters"
    if group == 0:
        return "belongs to no group"
    kind, rank = _signed(content[at]), content[at + 1]
    dimensions = content[at + 2 : at + 2 + rank]
    if kind not in _TYPES or rank > 7:
        return f"has type {kind} and {rank} dimensions"
    end = at + 2 + rank + abs(kind) * math.prod(dimensions)
    if end >= len(content):
        return f"claims {abs(kind) * math.prod(dimensions)} bytes, more than there are"
    if content[end] > _LONGEST:
        return f"has a description of {content[end]} characters, ezc3d reads {_LONGEST}"
    return ""


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _reach(data_start_block: int) -> int | None:
    """Bytes up to the data; None where the header does not say."""
    return (data_start_block - 1) * _BLOCK if data_start_block > 2 else None
