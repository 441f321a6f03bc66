"""What a C3D file states twice, in its header and in its parameters: rates and scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_header import Header
from bsip_cli.recordings.c3d_layout import Layout
from bsip_cli.recordings.c3d_parameters import Parameters, number
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.timebase import MOST_HZ

_SAME = 1e-3


def settle_rate(
    path: Path, header: Header, parameters: Parameters, layout: Layout
) -> tuple[float, list[Finding]]:
    """Frames per second, and findings where the file's statements of rates differ."""
    stated = number(parameters.get("POINT", {}), "RATE")
    usable = [rate for rate in (stated, header.rate_hz) if np.isfinite(rate) and 0 < rate < MOST_HZ]
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


def settle_scale(header: Header, parameters: Parameters) -> tuple[float, list[Finding]]:
    """Size of one count of the coordinates, negative where they are floats, as ezc3d wants it."""
    stated = number(parameters.get("POINT", {}), "SCALE")
    if not np.isfinite(stated) or stated == 0:
        stated = header.scale if np.isfinite(header.scale) and header.scale else 1.0
    if header.scale < 0:
        return -abs(stated), []
    if abs(abs(stated) - header.scale) <= _SAME * abs(stated):
        return abs(stated), []
    finding = Finding(
        check="scale",
        subject="points",
        found=f"POINT:SCALE is {stated:g}, the header says {header.scale:g}",
        expected="one scale",
        action=f"used {abs(stated):g}",
        level="warning",
    )
    return abs(stated), [finding]
