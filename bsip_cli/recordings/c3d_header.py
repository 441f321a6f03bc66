"""The first block of a C3D file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_numbers import DEC, MIPS, PC, floats, integers

BLOCK = 512
C3D_KEY = 0x50
_FULL = 0xFFFF  # frame number that does not fit the header's word


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
        return self.last_frame == _FULL


def read_header(path: Path, content: bytes) -> Header:
    """Parse the header; refuse an empty or foreign file with what was found."""
    if not content:
        raise BadDataError(
            "the file is empty",
            expected="a C3D file",
            remedy="copy or export the trial again",
            file=path,
        )
    if len(content) < BLOCK or content[1] != C3D_KEY or content[0] < 1:
        raise BadDataError(
            f"no C3D header in a file of {len(content)} bytes",
            expected="a C3D file",
            remedy="export the trial again",
            file=path,
        )
    return _parse(content, _processor(path, content))


def _processor(path: Path, content: bytes) -> int:
    at = (content[0] - 1) * BLOCK + 3
    found = content[at] if at < len(content) else 0
    if found not in (PC, DEC):
        name = " (MIPS)" if found == MIPS else ""
        raise BadDataError(
            f"its parameter section names processor {found}{name}, which ezc3d does not read",
            expected="84 (PC) or 85 (DEC)",
            remedy="export the trial again, or convert it to the PC format",
            file=path,
        )
    return found


def _parse(content: bytes, processor: int) -> Header:
    words = integers(content[:BLOCK]).view(np.uint16)
    scale, rate_hz = floats(content[12:16] + content[20:24], processor)
    return Header(
        processor=processor,
        n_points=int(words[1]),
        n_analog_per_frame=int(words[2]),
        first_frame=int(words[3]),
        last_frame=int(words[4]),
        scale=float(scale),
        data_start_block=int(words[8]),
        samples_per_frame=int(words[9]),
        rate_hz=float(rate_hz),
    )
