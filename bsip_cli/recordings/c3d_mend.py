"""A C3D file written anew where ezc3d would misread or refuse it although it is sound.

Seen in real files: counts of points, channels, frames or rates in the parameters that the header
and the file's length contradict, where ezc3d takes the parameters' word (`type1.C3D` has no
ANALOG:RATE, `kyowadengyo.c3d` counts a point too many, `evart.c3d` lacks scales and has 17 samples
at a rate that says 16); ANALOG:OFFSET as floats (`Dance.c3d`); a gap between two parameters
(`badParameterOffset.c3d`); a description of more than 127 characters (`BKINtechnologies.c3d`).
From the format's text: offsets below zero, whose sign ezc3d drops; integer samples without a sign;
more frames than the header can count, of which ezc3d reads the first 65535: these are written in
pieces.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bsip_cli.recordings.c3d_format import (
    BLOCK,
    C3D_KEY,
    FLOAT,
    FULL,
    INTEGER,
    LONGEST_DESCRIPTION,
    PC,
    Header,
    Record,
    floats,
    group_names,
    integers,
    number,
    numbers,
    parameters_of,
)
from bsip_cli.recordings.c3d_layout import Layout, says_unsigned

_MOST_FRAMES = 60_000
_MOST = 255  # entries of one dimension; more continue in NAME2, NAME3, ...
_CEILING = 1 + 1e-6  # ezc3d truncates the quotient of two rates


def needs_mending(
    header: Header, records: Sequence[Record], layout: Layout, rate_hz: float
) -> bool:
    """Whether ezc3d would refuse the file or read another layout or scaling than this one."""
    parameters = parameters_of(records, header.processor)
    point, analog = parameters.get("POINT", {}), parameters.get("ANALOG", {})
    per_frame = layout.samples_per_frame * layout.n_channels
    offsets = np.ravel(numbers(analog, "OFFSET"))
    reads_analog = layout.n_channels == 0 or (
        number(analog, "USED") == layout.n_channels
        and _whole(number(analog, "RATE") / rate_hz) == layout.samples_per_frame
        and np.isfinite(number(analog, "GEN_SCALE"))
        and min(len(offsets), np.ravel(numbers(analog, "SCALE")).size) >= layout.n_channels
        and all(record.kind == INTEGER for record in records if record.name == "OFFSET")
        and (layout.is_float if says_unsigned(records) else not (offsets < 0).any())
    )
    return not (
        reads_analog
        and all(record.is_plain for record in records)
        and (header.n_points, header.n_analog_per_frame) == (layout.n_points, per_frame)
        and header.n_frames == layout.n_frames == _whole(number(point, "FRAMES")) & FULL
        and (header.data_start_block - 1) * BLOCK == layout.start
        and number(point, "USED") == layout.n_points
        and abs(number(point, "RATE") - rate_hz) < 1e-9
        and (number(point, "SCALE") < 0) == layout.is_float
    )


def _whole(value: float) -> int:
    """Truncated as ezc3d does; -1 for what is no number."""
    return int(value) if np.isfinite(value) else -1


def pieces(layout: Layout) -> list[Layout]:
    """The layout in parts whose frames a header can count."""
    return [
        replace(
            layout,
            start=layout.start + first * layout.bytes_per_frame,
            n_frames=min(_MOST_FRAMES, layout.n_frames - first),
        )
        for first in range(0, layout.n_frames, _MOST_FRAMES)
    ]


def mended(
    content: bytes,
    header: Header,
    records: Sequence[Record],
    layout: Layout,
    rate_hz: float,
    scale: float,
) -> bytes:
    """The same points and analog counts in PC numbers; scales of channels are 1, offsets 0."""
    own = [
        replace(
            record,
            value=_as_pc(record.value, record.kind, header.processor),
            description=record.description[:LONGEST_DESCRIPTION],
        )
        for record in records
    ]
    start = 2 + len(_section(_replaced(own, layout, rate_hz, scale))) // BLOCK
    section = _section(_replaced(own, layout, rate_hz, scale, start))
    data = content[layout.start : layout.start + layout.n_bytes]
    data = _as_pc(data, FLOAT if layout.is_float else INTEGER, header.processor)
    # The first block with the decided counts, without events.
    per_frame = layout.n_channels * layout.samples_per_frame
    head = struct.pack("<2B4H", 2, C3D_KEY, layout.n_points, per_frame, 1, layout.n_frames)
    head += struct.pack("<HfHHf", 0, scale, start, layout.samples_per_frame, rate_hz)
    return head + bytes(BLOCK - len(head)) + section + data + bytes(-len(data) % BLOCK)


def _as_pc(value: bytes, kind: int, processor: int) -> bytes:
    """Numbers as a PC stores them."""
    if kind == INTEGER:
        return integers(value).astype("<i2").tobytes()
    return floats(value, processor).astype("<f4").tobytes() if kind == FLOAT else value


def _replaced(
    records: Sequence[Record], layout: Layout, rate_hz: float, scale: float, start: int = 0
) -> list[Record]:
    """All records, but those that count and scale as the layout wants them."""
    names = group_names(records)
    point, analog = (_number_of(names, name, k) for k, name in enumerate(("POINT", "ANALOG")))
    n = layout.n_channels
    counts = [min(_MOST, n - k) for k in range(0, n, _MOST)]
    parts = [(f"{k + 1}" if k else "", count) for k, count in enumerate(counts)]
    decided = [
        _words(point, "USED", [layout.n_points]),
        _words(point, "FRAMES", [layout.n_frames]),
        _words(point, "DATA_START", [start]),
        _reals(point, "RATE", [rate_hz]),
        _reals(point, "SCALE", [scale]),
        _words(analog, "USED", [n]),
        _reals(analog, "RATE", [rate_hz * layout.samples_per_frame * _CEILING]),
        _reals(analog, "GEN_SCALE", [1.0]),
        *(_reals(analog, f"SCALE{part}", [1.0] * k) for part, k in parts),
        *(_words(analog, f"OFFSET{part}", [0] * k) for part, k in parts),
    ]
    groups = [
        Record(-number, name, b"", True)
        for number, name in ({point: "POINT", analog: "ANALOG"} | dict(names)).items()
    ]
    known = {(record.group, record.name) for record in decided}
    others = [r for r in records if r.group in names and (r.group, r.name) not in known]
    return [*groups, *decided, *others]


def _number_of(names: Mapping[int, str], wanted: str, place: int) -> int:
    """The number of a group; a free one if the file lacks it."""
    found = [number for number, name in names.items() if name == wanted]
    return found[-1] if found else max(names, default=0) + 1 + place


def _words(group: int, name: str, values: list[int]) -> Record:
    value = np.array(values).astype("<u2").tobytes()
    return Record(group, name, b"", True, INTEGER, (len(values),), value)


def _reals(group: int, name: str, values: list[float]) -> Record:
    value = np.array(values, "<f4").tobytes()
    return Record(group, name, b"", True, FLOAT, (len(values),), value)


def _section(records: Sequence[Record]) -> bytes:
    """The parameter section: its four bytes, the records, zeros to the end of the block."""
    chain = b""
    for record in records:
        body = bytes([len(record.description)]) + record.description
        if record.group > 0:
            shape = bytes([len(record.shape), *record.shape])
            body = struct.pack("<b", record.kind) + shape + record.value + body
        name = record.name.encode("ascii")
        chain += struct.pack("<bb", len(name), record.group) + name
        chain += struct.pack("<H", len(body) + 2) + body
    n_blocks = -(-(4 + len(chain) + 2) // BLOCK)
    section = bytes([1, C3D_KEY, min(n_blocks, _MOST), PC]) + chain
    return section + bytes(n_blocks * BLOCK - len(section))
