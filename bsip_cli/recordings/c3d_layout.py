"""How a C3D file's data lie in it: header and parameters must agree, the file's size judges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_header import BLOCK, Header
from bsip_cli.recordings.c3d_parameters import Parameters, number
from bsip_cli.recordings.model import Finding

_SMOOTHER = 0.7  # times the roughness of the other layout


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
    def n_samples(self) -> int:
        return self.n_frames * self.samples_per_frame

    @property
    def words_per_frame(self) -> int:
        return 4 * self.n_points + self.n_channels * self.samples_per_frame

    @property
    def bytes_per_frame(self) -> int:
        return self.words_per_frame * (4 if self.is_float else 2)

    @property
    def n_bytes(self) -> int:
        return self.n_frames * self.bytes_per_frame

    def describe(self) -> str:
        return (
            f"{self.n_points} points, {self.n_channels} channels of {self.samples_per_frame} "
            f"samples, {self.n_frames} frames"
        )


def settle_layout(
    path: Path,
    header: Header,
    parameters: Parameters,
    file_size: int,
    roughness: Callable[[Layout], float],
) -> tuple[Layout, list[Finding]]:
    """The layout of the data, and a finding where header and parameters disagree.

    A layout that wants more bytes than the file holds is out (a last partial block is
    forgiven); of two that fit, the one whose ``roughness`` is clearly smaller.
    """
    start = (max(header.data_start_block, 1) - 1) * BLOCK
    available = max(file_size - start, 0)
    stated = _by_header(header, parameters, start, available)
    other = _by_parameters(stated, parameters)
    if stated.n_frames < 1 or stated.words_per_frame < 1:
        stated = other
    if stated.words_per_frame < 1:
        raise BadDataError(
            "it holds no points and no analog samples",
            expected="markers",
            remedy="export the trial with its markers",
            file=path,
        )
    fitting = [_cut(layout, available) for layout in (stated, other) if _fits(layout, available)]
    if not fitting:
        raise BadDataError(
            f"the header promises {stated.n_bytes} bytes of data ({stated.n_points} points, "
            f"{stated.n_frames} frames) and the file holds {available}",
            expected="a complete file",
            remedy="copy or export the trial again",
            file=path,
        )
    chosen = fitting[0]
    if len(fitting) == 2 and roughness(fitting[1]) < _SMOOTHER * roughness(fitting[0]):
        chosen = fitting[1]
    findings = [] if stated == other else [_disagreement(stated, other, chosen)]
    wanted = stated if chosen is fitting[0] and _fits(stated, available) else other
    return chosen, findings + _missing_end(wanted, chosen) + _odd_length(chosen, file_size)


def _by_header(header: Header, parameters: Parameters, start: int, available: int) -> Layout:
    samples = max(header.samples_per_frame, 1)
    layout = Layout(
        n_points=header.n_points,
        n_channels=header.n_analog_per_frame // samples,
        samples_per_frame=samples,
        n_frames=header.n_frames,
        is_float=header.scale < 0,
        start=start,
    )
    if header.is_full or header.n_frames < 1:
        in_file = available // max(layout.bytes_per_frame, 1)
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
    n_channels = _count(analog, "USED")
    if n_frames == 0xFFFF or (n_frames is not None and n_frames == stated.n_frames & 0xFFFF):
        n_frames = None  # the count that does not fit
    return replace(
        stated,
        n_points=stated.n_points if n_points is None else n_points,
        n_channels=stated.n_channels if n_channels is None else n_channels,
        n_frames=n_frames or stated.n_frames,
    )


def _count(group, name: str) -> int | None:
    """A count, stored as an integer without sign or as a float."""
    value = number(group, name)
    if not np.isfinite(value) or abs(value) > 1e9:
        return None
    return int(value) & 0xFFFF if value < 0 else int(value)


def _fits(layout: Layout, available: int) -> bool:
    whole = layout.n_frames > 0 and layout.words_per_frame > 0
    return whole and layout.n_bytes <= available + BLOCK


def _cut(layout: Layout, available: int) -> Layout:
    return replace(layout, n_frames=min(layout.n_frames, available // layout.bytes_per_frame))


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
    """A file ends with its data or fills its last block: else bytes came in or went."""
    rest = file_size - layout.start - layout.n_bytes
    if rest == 0 or (file_size % BLOCK == 0 and rest <= BLOCK):
        return []
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
