"""How a C3D file's data lie in it: header and parameters must agree, the file's size judges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_header import BLOCK, Header
from bsip_cli.recordings.c3d_parameters import Parameters, number
from bsip_cli.recordings.model import Finding


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

    def ends_with(self, file_size: int) -> bool:
        """The file ends with the data or fills its last block behind them."""
        rest = file_size - self.start - self.n_bytes
        return rest == 0 or (file_size % BLOCK == 0 and 0 < rest <= BLOCK)

    def describe(self) -> str:
        return (
            f"{self.n_points} points, {self.n_channels} channels of {self.samples_per_frame} "
            f"samples, {self.n_frames} frames from byte {self.start}"
        )


def settle_layout(
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
    fitting = [layout for layout in dict.fromkeys((stated, other)) if _fits(layout, file_size)]
    if not fitting:
        raise _refusal(path, stated, file_size)
    exact = [layout for layout in fitting if layout.ends_with(file_size)]
    fitting = exact or fitting
    if len(fitting) == 2:
        raise _undecided(path, stated, other)
    chosen = _cut(fitting[0], file_size)
    findings = [] if stated == other else [_disagreement(stated, other, chosen)]
    return chosen, findings + _missing_end(fitting[0], chosen) + _odd_length(chosen, file_size)


def _refusal(path: Path, stated: Layout, file_size: int) -> BadDataError:
    if stated.words_per_frame < 1:
        return BadDataError(
            "it holds no points and no analog samples",
            expected="markers",
            remedy="export the trial with its markers",
            file=path,
        )
    return BadDataError(
        f"the header promises {stated.n_bytes} bytes of data ({stated.n_points} points, "
        f"{stated.n_frames} frames) and the file holds {stated.room(file_size)}",
        expected="a complete file",
        remedy="copy or export the trial again",
        file=path,
    )


def _undecided(path: Path, stated: Layout, other: Layout) -> BadDataError:
    return BadDataError(
        f"the header counts {stated.describe()}, the parameters {other.describe()}, and the "
        "file's length fits both",
        expected="one count of each",
        remedy="export the trial again",
        file=path,
    )


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
    """The count of frames that does not fit the header, 0 if nothing tells it.

    TRIAL's fields of two words each, or a float.
    """
    trial, point = parameters.get("TRIAL", {}), parameters.get("POINT", {})
    first, last = (_long(trial, f"ACTUAL_{end}_FIELD") for end in ("START", "END"))
    for count in (last - first + 1, number(point, "LONG_FRAMES"), number(point, "FRAMES")):
        if np.isfinite(count) and count > 0:
            return int(min(count, 2**40))
    return 0


def _long(group, name: str) -> float:
    """Two 16-bit words as one number, the low word first."""
    if name not in group or not isinstance(group[name], np.ndarray) or group[name].size != 2:
        return float("nan")
    low, high = np.ravel(group[name]).astype(int) & 0xFFFF
    return float(low + 65536 * high)


def _by_parameters(stated: Layout, parameters: Parameters) -> Layout:
    """What the groups POINT and ANALOG say, the header's where they say nothing."""
    point, analog = parameters.get("POINT", {}), parameters.get("ANALOG", {})
    n_points, n_frames = _count(point, "USED"), _count(point, "FRAMES")
    n_channels, block = _count(analog, "USED"), _count(point, "DATA_START")
    if n_frames == 0xFFFF or (n_frames is not None and n_frames == stated.n_frames & 0xFFFF):
        n_frames = None  # the count that does not fit
    return replace(
        stated,
        n_points=stated.n_points if n_points is None else n_points,
        n_channels=stated.n_channels if n_channels is None else n_channels,
        n_frames=n_frames or stated.n_frames,
        start=(block - 1) * BLOCK if block is not None and block > 1 else stated.start,
    )


def _count(group, name: str) -> int | None:
    """A count, stored as an integer without sign or as a float."""
    value = number(group, name)
    if not np.isfinite(value) or abs(value) > 1e9:
        return None
    return int(value) & 0xFFFF if value < 0 else int(value)


def _fits(layout: Layout, file_size: int) -> bool:
    whole = layout.n_frames > 0 and layout.words_per_frame > 0
    return whole and 0 < layout.n_bytes <= layout.room(file_size) + BLOCK


def _cut(layout: Layout, file_size: int) -> Layout:
    in_file = layout.room(file_size) // layout.bytes_per_frame
    return replace(layout, n_frames=min(layout.n_frames, in_file))


def _missing_end(wanted: Layout, chosen: Layout) -> list[Finding]:
    missing = wanted.n_frames - chosen.n_frames
    if missing <= 0:
        return []
    return [
        Finding(
            check="layout",
            subject="",
            found=f"the file ends {missing} frames early",
            expected=f"{wanted.n_frames} frames",
            action=f"read {chosen.n_frames}",
            level="warning",
        )
    ]


def _odd_length(layout: Layout, file_size: int) -> list[Finding]:
    """Where a file does not end with its data, bytes came in or went."""
    if layout.ends_with(file_size):
        return []
    rest = file_size - layout.start - layout.n_bytes
    return [
        Finding(
            check="layout",
            subject="",
            found=f"{rest} bytes follow the data that the header counts",
            expected=f"none, or as many as fill the last {BLOCK} bytes",
            action="read the data where the header says",
            level="warning",
        )
    ]


def _disagreement(stated: Layout, other: Layout, chosen: Layout) -> Finding:
    return Finding(
        check="layout",
        subject="",
        found=f"the header counts {stated.describe()}, the parameters {other.describe()}",
        expected="one count of each",
        action=f"read {chosen.describe()}",
        level="warning",
    )
