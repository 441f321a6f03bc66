"""A C3D file's samples: points and analog channels, scaled as the file says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_header import BLOCK, Header, read_header
from bsip_cli.recordings.c3d_layout import Layout, settle_layout
from bsip_cli.recordings.c3d_numbers import floats, integers
from bsip_cli.recordings.c3d_parameters import (
    Group,
    Parameters,
    number,
    numbers,
    read_parameters,
    texts,
)
from bsip_cli.recordings.model import Finding

_LARGEST_FILE = 2**31  # bytes
_FRAMES_TO_JUDGE = 500
_SAME = 1e-3
_INTEGER_LIMIT = 32_768.0


@dataclass(frozen=True)
class Content:
    """What a C3D file holds, in its own units and lab frame."""

    parameters: Parameters
    rate_hz: float
    first_frame: int  # counted from 0
    positions: np.ndarray  # (n_frames, n_points, 3)
    is_valid: np.ndarray  # (n_frames, n_points) bool: no camera lost the point
    analog: np.ndarray  # (n_channels, n_frames * samples_per_frame)
    analog_scales: np.ndarray  # (n_channels,), size of one converter count
    samples_per_frame: int
    findings: tuple[Finding, ...]

    def group(self, name: str) -> Group:
        return self.parameters.get(name, {})


def read_content(path: Path) -> Content:
    """Read a C3D file of any processor; memory stays within a few times the file's size."""
    raw = _bytes(path)
    header = read_header(path, raw)
    reach = (header.data_start_block - 1) * BLOCK if header.data_start_block > 2 else None
    parameters = read_parameters(path, raw[:reach], header.processor)
    layout, findings = settle_layout(
        path, header, parameters, len(raw), partial(_roughness, raw, header.processor)
    )
    rate_hz, about_rate = _rate(path, header, parameters, layout)
    scale, about_scale = _point_scale(header, parameters)
    frames = _frames(raw, layout, header.processor)
    if header.is_full:
        frames = _without_padding(frames)
    positions = frames[:, : 4 * layout.n_points].reshape(len(frames), layout.n_points, 4)
    n_samples = len(frames) * layout.samples_per_frame
    analog = frames[:, 4 * layout.n_points :].reshape(n_samples, layout.n_channels).T
    factor = 1.0 if layout.is_float else abs(scale)
    scales = _analog_scales(parameters.get("ANALOG", {}), layout.n_channels)
    return Content(
        parameters=parameters,
        rate_hz=rate_hz,
        first_frame=max(header.first_frame, 1) - 1,
        positions=positions[..., :3] * factor,
        is_valid=positions[..., 3] >= 0,
        analog=_scaled(analog, parameters.get("ANALOG", {}), scales, layout.is_float),
        analog_scales=scales,
        samples_per_frame=layout.samples_per_frame,
        findings=(*findings, *about_rate, *about_scale),
    )


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


def _frames(raw: bytes, layout: Layout, processor: int) -> np.ndarray:
    """All words of the data as float64, (n_frames, words_per_frame)."""
    data = raw[layout.start : layout.start + layout.n_bytes]
    words = floats(data, processor) if layout.is_float else integers(data, processor).astype(float)
    return words.reshape(layout.n_frames, layout.words_per_frame)


def _without_padding(frames: np.ndarray) -> np.ndarray:
    """Without the frames of zeros that only fill the last block of the file."""
    most = min(BLOCK // (2 * frames.shape[1]), len(frames) - 1)
    n = len(frames)
    while n > len(frames) - most and not frames[n - 1].any():
        n -= 1
    return frames[:n]


def _roughness(raw: bytes, processor: int, layout: Layout) -> float:
    """How little one frame resembles the next: a wrong layout mixes coordinates and channels.

    The median over the words of the mean step between frames over their spread.
    """
    if layout.n_frames < 2:
        return np.inf
    shown = replace(layout, n_frames=min(layout.n_frames, _FRAMES_TO_JUDGE))
    frames = _frames(raw[: shown.start + shown.n_bytes], shown, processor)
    with np.errstate(invalid="ignore", over="ignore"):
        step, spread = np.abs(np.diff(frames, axis=0)).mean(axis=0), frames.std(axis=0)
    known = np.isfinite(step) & np.isfinite(spread) & (spread > 0)
    return float(np.median(step[known] / spread[known])) if known.any() else np.inf


def _rate(
    path: Path, header: Header, parameters: Parameters, layout: Layout
) -> tuple[float, list[Finding]]:
    """Frames per second, and findings where the file's statements of rates differ."""
    stated = number(parameters.get("POINT", {}), "RATE")
    usable = [rate for rate in (stated, header.rate_hz) if np.isfinite(rate) and 0 < rate < 1e5]
    if not usable:
        raise BadDataError(
            f"POINT:RATE is {stated:g} Hz",
            expected="a rate above 0 Hz",
            remedy="export the trial with its rate",
            file=path,
        )
    rate_hz = usable[0]
    findings = []
    if len(usable) < 2 or abs(usable[1] / rate_hz - 1) > _SAME:
        findings.append(
            Finding(
                check="rate",
                subject="points",
                found=f"POINT:RATE says {stated:g} Hz, the header {header.rate_hz:g} Hz",
                expected="one rate",
                action=f"read {rate_hz:g} Hz",
                level="warning",
            )
        )
    analog_hz = number(parameters.get("ANALOG", {}), "RATE")
    real_hz = rate_hz * layout.samples_per_frame
    if layout.n_channels and not abs(analog_hz / real_hz - 1) <= _SAME:
        findings.append(
            Finding(
                check="rate",
                subject="analog",
                found=f"ANALOG:RATE says {analog_hz:g} Hz, and each frame of the markers at "
                f"{rate_hz:g} Hz has {layout.samples_per_frame} samples",
                expected=f"{real_hz:g} Hz",
                action=f"read {real_hz:g} Hz",
                level="corrected",
            )
        )
    return rate_hz, findings


def _point_scale(header: Header, parameters: Parameters) -> tuple[float, list[Finding]]:
    """Size of one count of the coordinates; floats are not scaled."""
    stated = number(parameters.get("POINT", {}), "SCALE")
    if not np.isfinite(stated) or stated == 0:
        stated = header.scale
    if header.scale < 0 or abs(abs(stated) - abs(header.scale)) <= _SAME * abs(stated):
        return stated, []
    finding = Finding(
        check="scale",
        subject="points",
        found=f"POINT:SCALE is {stated:g}, the header says {header.scale:g}",
        expected="one scale",
        action=f"used {stated:g}",
        level="warning",
    )
    return stated, [finding]


def _analog_scales(group: Group, n_channels: int) -> np.ndarray:
    """GEN_SCALE times SCALE, one where the file says nothing or zero, (n_channels,)."""
    general = number(group, "GEN_SCALE")
    scales = np.ones(n_channels)
    given = np.ravel(numbers(group, "SCALE"))[:n_channels]
    scales[: len(given)] = given
    scales *= general if np.isfinite(general) else 1.0
    return scales


def _scaled(analog: np.ndarray, group: Group, scales: np.ndarray, is_float: bool) -> np.ndarray:
    """(count - offset) x scale, (n_channels, n)."""
    offsets = np.zeros(len(scales))
    given = np.ravel(numbers(group, "OFFSET"))[: len(scales)]
    offsets[: len(given)] = given
    if texts(group, "FORMAT")[:1] == ["UNSIGNED"]:
        offsets = np.where(offsets < 0, offsets + 2 * _INTEGER_LIMIT, offsets)
        if not is_float:
            analog = np.where(analog < 0, analog + 2 * _INTEGER_LIMIT, analog)
    with np.errstate(invalid="ignore", over="ignore"):
        return (analog - offsets[:, None]) * scales[:, None]
