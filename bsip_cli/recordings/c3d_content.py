"""What a C3D file holds: ezc3d reads it, after a check of its counts against its length.

Own parsing goes as far as that check needs: header, records of parameters, counts, rates. Where
ezc3d would misread or refuse a sound file (c3d_mend says which), it reads a copy written anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_agreement import settle_rate, settle_scale
from bsip_cli.recordings.c3d_guard import Samples, read_by_ezc3d
from bsip_cli.recordings.c3d_header import BLOCK, Header, read_header
from bsip_cli.recordings.c3d_layout import Layout, settle_layout
from bsip_cli.recordings.c3d_mend import mended, needs_mending, pieces
from bsip_cli.recordings.c3d_numbers import floats, integers
from bsip_cli.recordings.c3d_parameters import Group, Parameters
from bsip_cli.recordings.c3d_records import parameters_of, read_records
from bsip_cli.recordings.c3d_scaling import says_unsigned, scaling_of
from bsip_cli.recordings.model import Finding

_LARGEST_FILE = 2**31  # bytes


@dataclass(frozen=True, eq=False)
class Content:
    """What a C3D file holds, in its own units and lab frame."""

    parameters: Parameters
    rate_hz: float
    first_frame: int  # counted from 0
    positions: np.ndarray  # (n_frames, n_points, 3); NaN where invalid, unless all points are
    is_valid: np.ndarray  # (n_frames, n_points) bool: no camera lost the point
    analog: np.ndarray  # (n_channels, n_frames * samples_per_frame)
    analog_scales: np.ndarray  # (n_channels,), size of one converter count
    samples_per_frame: int
    findings: tuple[Finding, ...]

    def group(self, name: str) -> Group:
        return self.parameters.get(name, {})


def read_content(path: Path) -> Content:
    """Read a C3D file; a foreign, broken or cut one is refused before ezc3d sees it."""
    raw = _bytes(path)
    header = read_header(path, raw)
    reach = (header.data_start_block - 1) * BLOCK if header.data_start_block > 2 else None
    records = read_records(path, raw[:reach])
    stated = parameters_of(records, header.processor)
    layout, findings = settle_layout(path, header, stated, len(raw))
    rate_hz, about_rate = settle_rate(path, header, stated, layout)
    point_scale, about_scale = settle_scale(header, stated)
    scaling = scaling_of(stated.get("ANALOG", {}), layout.n_channels, says_unsigned(records))
    if needs_mending(header, records, layout, rate_hz):
        samples = _read_pieces(
            path, layout, lambda part: mended(raw, header, records, part, rate_hz, point_scale)
        )
        samples = replace(samples, analog=scaling.applied(samples.analog, layout.is_float))
    else:
        samples = _read_piece(path, raw, layout)
    if header.is_full:
        samples = _without_padding(samples, layout)
    positions = samples.positions
    if not (samples.residuals >= 0).any():
        positions = _written(raw, header, layout, abs(point_scale))[: len(positions)]
    return Content(
        parameters=samples.parameters,
        rate_hz=rate_hz,
        first_frame=max(header.first_frame, 1) - 1,
        positions=positions,
        is_valid=samples.residuals >= 0,
        analog=samples.analog,
        analog_scales=scaling.scales,
        samples_per_frame=layout.samples_per_frame,
        findings=(*findings, *about_rate, *about_scale),
    )


def _written(raw: bytes, header: Header, layout: Layout, scale: float) -> np.ndarray:
    """Positions (n_frames, n_points, 3), also of invalid points, for which ezc3d has NaN."""
    data = raw[layout.start : layout.start + layout.n_bytes]
    words = floats(data, header.processor) if layout.is_float else scale * integers(data)
    points = words.reshape(-1, layout.words_per_frame)[:, : 4 * layout.n_points]
    return np.array(points.reshape(len(points), layout.n_points, 4)[..., :3])


def _bytes(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        if size > _LARGEST_FILE:
            raise BadDataError(
                f"a file of {size / 1e9:.1f} GB",
                expected=f"at most {_LARGEST_FILE / 1e9:.1f} GB",
                remedy="cut the trial into shorter ones",
                file=path,
            )
        return path.read_bytes()
    except OSError as error:
        raise BadDataError(f"cannot be opened ({error.strerror})", file=path) from error


def _read_pieces(path: Path, layout: Layout, written: Callable[[Layout], bytes]) -> Samples:
    """What ezc3d reads of a file that is written anew in one or several pieces."""
    parts = pieces(layout)
    read = [_read_piece(path, written(part), part) for part in parts]
    whole = [*map(_padded, read[:-1], parts), read[-1]]
    return replace(
        read[0],
        positions=np.concatenate([one.positions for one in whole]),
        residuals=np.concatenate([one.residuals for one in whole]),
        analog=np.concatenate([one.analog for one in whole], axis=1),
    )


def _read_piece(path: Path, content: bytes, layout: Layout) -> Samples:
    samples = read_by_ezc3d(content, path)
    _check_counts(path, samples, layout)
    return samples


def _padded(samples: Samples, layout: Layout) -> Samples:
    """With the empty frames at the end, which ezc3d drops."""
    missing = layout.n_frames - len(samples.positions)
    return replace(
        samples,
        positions=np.pad(samples.positions, ((0, missing), (0, 0), (0, 0))),
        residuals=np.pad(samples.residuals, ((0, missing), (0, 0)), constant_values=-1),
        analog=np.pad(samples.analog, ((0, 0), (0, missing * layout.samples_per_frame))),
    )


def _without_padding(samples: Samples, layout: Layout) -> Samples:
    """Without the frames of zeros that only fill the last block of the file."""
    most = min(BLOCK // layout.bytes_per_frame, len(samples.positions) - 1)
    n = len(samples.positions)
    stop = n
    while stop > n - most and not samples.positions[stop - 1].any():
        stop -= 1
    return replace(
        samples,
        positions=samples.positions[:stop],
        residuals=samples.residuals[:stop],
        analog=samples.analog[:, : stop * layout.samples_per_frame],
    )


def _check_counts(path: Path, samples: Samples, layout: Layout) -> None:
    """Refuse what ezc3d reads with other counts; it may drop empty frames at the end."""
    n_frames, n_points, _ = samples.positions.shape
    n_channels, n_samples = samples.analog.shape
    if (
        (n_points, n_channels) == (layout.n_points, layout.n_channels)
        and 0 < n_frames <= layout.n_frames
        and (n_channels == 0 or n_samples == n_frames * layout.samples_per_frame)
    ):
        return
    raise BadDataError(
        f"ezc3d reads {n_points} points and {n_channels} channels in {n_frames} frames",
        expected=layout.describe(),
        remedy="export the trial again",
        file=path,
    )
