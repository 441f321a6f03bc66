"""The first block of a C3D file, read before any memory is taken for its data."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

from bsip_cli.errors import BadDataError

_BLOCK = 512
_C3D_KEY = 0x50
_DEC, _MIPS = 85, 86
_FULL = 0xFFFF  # frame number that does not fit the header's word
_MANY_TIMES = 20


@dataclass(frozen=True)
class Header:
    """The counts a C3D header claims."""

    n_points: int
    n_analog_per_frame: int  # channels times samples per frame
    first_frame: int
    last_frame: int
    data_start_block: int
    is_float: bool

    @property
    def n_frames(self) -> int:
        return self.last_frame - self.first_frame + 1

    @property
    def bytes_per_frame(self) -> int:
        return (4 * self.n_points + self.n_analog_per_frame) * (4 if self.is_float else 2)


def check_header(path: Path) -> Header:
    """Refuse empty, foreign, MIPS-format and truncated files with what was found."""
    size = _file_size(path)
    with path.open("rb") as stream:
        block = stream.read(_BLOCK)
        if len(block) < _BLOCK or block[1] != _C3D_KEY:
            raise BadDataError(
                f"no C3D header in a file of {size} bytes",
                expected="a C3D file",
                remedy="export the trial again",
                file=path,
            )
        stream.seek((block[0] - 1) * _BLOCK if block[0] else 0)
        parameters = stream.read(4)
    processor = parameters[3] if len(parameters) > 3 else 0
    if processor == _MIPS:
        raise BadDataError(
            "numbers in MIPS (SGI) format",
            expected="PC or DEC format",
            remedy="convert the file to PC format",
            file=path,
        )
    header = _parse(block, processor == _DEC)
    _refuse_truncated(path, header, size)
    return header


def _file_size(path: Path) -> int:
    try:
        size = path.stat().st_size
    except OSError as error:
        raise BadDataError(f"cannot be opened ({error.strerror})", file=path) from error
    if size == 0:
        raise BadDataError("the file is empty", expected="a C3D file", file=path)
    return size


def _parse(block: bytes, is_dec: bool) -> Header:
    n_points, n_analog, first, last = struct.unpack_from("<4H", block, 2)
    sign_byte = block[13] if is_dec else block[15]  # DEC floats have their words swapped
    (data_start,) = struct.unpack_from("<H", block, 16)
    is_float = bool(sign_byte & 0x80)  # a negative point scale means floating-point data
    return Header(n_points, n_analog, first, last, data_start, is_float)


def _refuse_truncated(path: Path, header: Header, size: int) -> None:
    """The data the header promises must be in the file (a last partial block is forgiven).

    ezc3d reads what is there and says nothing; and a count that is absurd asks for memory.
    """
    if header.n_frames <= 0 or header.data_start_block < 2:
        return
    available = size - (header.data_start_block - 1) * _BLOCK
    promised = header.n_frames * header.bytes_per_frame
    if header.last_frame == _FULL and promised < _MANY_TIMES * max(available, 1):
        return  # the true count is elsewhere
    if promised > available + _BLOCK:
        raise BadDataError(
            f"the header promises {promised} bytes of data ({header.n_points} points, "
            f"{header.n_frames} frames) and the file holds {max(available, 0)}",
            expected="a complete file",
            remedy="copy or export the trial again",
            file=path,
        )
