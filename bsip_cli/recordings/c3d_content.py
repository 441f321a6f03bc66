"""What a C3D file holds: ezc3d reads it, after a check of its counts against its length.

Own parsing goes as far as that check needs: header, records of parameters, counts, rates. Where
ezc3d would misread or refuse a sound file (see `needs_mending`), it reads a copy written anew. It
runs in a process of its own: a damaged file may crash it, hang it or fill the memory.
"""

from __future__ import annotations

import io
import os
import signal
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_child import REFUSED
from bsip_cli.recordings.c3d_format import (
    BLOCK,
    C3D_KEY,
    FLOAT,
    FULL,
    INTEGER,
    LONGEST_DESCRIPTION,
    PC,
    Group,
    Header,
    Layout,
    Parameters,
    Record,
    Value,
    about_scales,
    decided_layout,
    decided_rate,
    decided_scale,
    floats,
    group_names,
    integers,
    number,
    numbers,
    parameters_of,
    read_header,
    read_records,
    says_unsigned,
    scaling_of,
)
from bsip_cli.recordings.model import Finding, refusal

_LARGEST_FILE = 2**31  # bytes
_CHILD = Path(__file__).with_name("c3d_child.py")
# Measured on files of 0.01 to 5 MB: 100 MB of address space and 8 MB for each MB of the file,
# 0.4 s for each MB.
_MEMORY_BYTES, _MEMORY_PER_BYTE = 1_000_000_000, 40
_CPU_S, _CPU_S_PER_MB = 10, 5
_WALL_PER_CPU = 6  # other processes may want the same cores


@dataclass(frozen=True, eq=False)
class Samples:
    """What ezc3d read, in the file's units and lab frame."""

    parameters: Parameters
    positions: np.ndarray  # (n_frames, n_points, 3); NaN where invalid, unless all points are
    residuals: np.ndarray  # (n_frames, n_points), negative where no camera saw the point
    analog: np.ndarray  # (n_channels, n_frames * samples_per_frame)


@dataclass(frozen=True, eq=False)
class Content(Samples):
    """What a C3D file holds."""

    rate_hz: float
    first_frame: int  # counted from 0
    analog_scales: np.ndarray  # (n_channels,), size of one converter count
    samples_per_frame: int
    findings: tuple[Finding, ...]

    @property
    def is_valid(self) -> np.ndarray:
        """No camera lost the point, (n_frames, n_points) bool."""
        return self.residuals >= 0

    def group(self, name: str) -> Group:
        return self.parameters.get(name, {})


def read_content(path: Path) -> Content:
    """Read a C3D file; a foreign, broken or cut one is refused before ezc3d sees it."""
    raw = _bytes(path)
    header = read_header(path, raw)
    reach = (header.data_start_block - 1) * BLOCK if header.data_start_block > 2 else None
    records = read_records(path, raw[:reach])
    stated = parameters_of(records, header.processor)
    layout, findings = decided_layout(path, header, stated, raw)
    rate_hz, about_rate = decided_rate(path, header, stated, layout)
    point_scale, about_scale = decided_scale(header, stated, layout.is_float)
    about_scale += about_scales(stated.get("ANALOG", {}), layout.n_channels)
    scaling = scaling_of(stated.get("ANALOG", {}), layout.n_channels, says_unsigned(records))
    if needs_mending(header, records, layout, rate_hz):
        samples = _read_pieces(
            path, layout, lambda part: mended(raw, header, records, part, rate_hz, point_scale)
        )
        samples = replace(samples, analog=scaling.applied(samples.analog, layout.is_float))
    else:
        samples = _read_piece(path, raw, layout)
    if header.is_full:
        samples = _of_length(samples, layout, _filled_frames(samples, layout))
    positions = samples.positions
    if not (samples.residuals >= 0).any():
        positions = _written(raw, header, layout, abs(point_scale))[: len(positions)]
    return Content(
        samples.parameters,
        positions,
        samples.residuals,
        samples.analog,
        rate_hz,
        first_frame=max(header.first_frame, 1) - 1,
        analog_scales=scaling.scales,
        samples_per_frame=layout.samples_per_frame,
        findings=(*findings, *about_rate, *about_scale),
    )


def _bytes(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        if size > _LARGEST_FILE:
            found, most = f"a file of {size / 1e9:.1f} GB", f"at most {_LARGEST_FILE / 1e9:.1f} GB"
            raise refusal(path, found, most, "cut the trial into shorter ones")
        return path.read_bytes()
    except OSError as error:
        raise BadDataError(f"cannot be opened ({error.strerror})", file=path) from error


def _written(raw: bytes, header: Header, layout: Layout, scale: float) -> np.ndarray:
    """Positions (n_frames, n_points, 3), also of invalid points, for which ezc3d has NaN."""
    data = raw[layout.start : layout.start + layout.n_bytes]
    words = floats(data, header.processor) if layout.is_float else scale * integers(data)
    points = words.reshape(-1, layout.words_per_frame)[:, : 4 * layout.n_points]
    return np.array(points.reshape(len(points), layout.n_points, 4)[..., :3])


def _read_pieces(path: Path, layout: Layout, written: Callable[[Layout], bytes]) -> Samples:
    """What ezc3d reads of a file that is written anew in one or several pieces.

    The empty frames at the end of a piece, which ezc3d drops, are put back before the next one.
    """
    parts = pieces(layout)
    read = [_read_piece(path, written(part), part) for part in parts]
    ends = [part.n_frames for part in parts[:-1]] + [len(read[-1].positions)]
    whole = [_of_length(r, layout, n) for r, n in zip(read, ends, strict=True)]
    return replace(
        read[0],
        positions=np.concatenate([one.positions for one in whole]),
        residuals=np.concatenate([one.residuals for one in whole]),
        analog=np.concatenate([one.analog for one in whole], axis=1),
    )


def _of_length(samples: Samples, layout: Layout, n_frames: int) -> Samples:
    """So many frames; those that are missing at the end are empty."""
    missing = max(n_frames - len(samples.positions), 0)
    n_samples, n_more = n_frames * layout.samples_per_frame, missing * layout.samples_per_frame
    residuals = np.pad(samples.residuals, ((0, missing), (0, 0)), constant_values=-1)
    return replace(
        samples,
        positions=np.pad(samples.positions, ((0, missing), (0, 0), (0, 0)))[:n_frames],
        residuals=residuals[:n_frames],
        analog=np.pad(samples.analog, ((0, 0), (0, n_more)))[:, :n_samples],
    )


def _filled_frames(samples: Samples, layout: Layout) -> int:
    """The number of frames without those of zeros that only fill the last block of the file."""
    n = len(samples.positions)
    most = min(BLOCK // layout.bytes_per_frame, n - 1)
    filled = np.flatnonzero(samples.positions[n - most :].any(axis=(1, 2)))
    return n - most + (int(filled[-1]) + 1 if len(filled) else 0)


def _read_piece(path: Path, content: bytes, layout: Layout) -> Samples:
    """Refuse what ezc3d reads with other counts; it may drop empty frames at the end."""
    samples = read_by_ezc3d(content, path)
    n_frames, n_points, _ = samples.positions.shape
    n_channels, n_samples = samples.analog.shape
    if (
        (n_points, n_channels) == (layout.n_points, layout.n_channels)
        and 0 < n_frames <= layout.n_frames
        and (n_channels == 0 or n_samples == n_frames * layout.samples_per_frame)
    ):
        return samples
    found = f"ezc3d reads {n_points} points and {n_channels} channels in {n_frames} frames"
    raise refusal(path, found, layout.describe())


# --- ezc3d in a process of its own ----------------------------------------------------------------


def read_by_ezc3d(content: bytes, named: Path) -> Samples:
    """Parameters, points and analogs of a C3D file by ezc3d; faults name the file ``named``.

    ezc3d does not notice when reading fails half way: it gets a copy of what was read already.
    """
    memory_bytes = _MEMORY_BYTES + _MEMORY_PER_BYTE * len(content)
    cpu_s = _CPU_S + int(_CPU_S_PER_MB * len(content) / 1e6)
    wall_s = _WALL_PER_CPU * cpu_s
    command = [sys.executable, "-P", str(_CHILD), str(memory_bytes), str(cpu_s)]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    expected = "a standard C3D file"
    try:
        with tempfile.TemporaryFile() as copy:
            copy.write(content)
            copy.seek(0)
            ran = subprocess.run(
                command,
                stdin=copy,
                capture_output=True,
                check=False,
                env={**os.environ, **one_thread},
                timeout=wall_s,
            )
    except subprocess.TimeoutExpired as error:
        raise refusal(named, f"ezc3d did not finish within {wall_s} s", expected) from error
    if ran.returncode == 0:
        return _samples(ran.stdout)
    words = ran.stderr.decode("utf-8", "replace").strip().rstrip(".")
    if ran.returncode == REFUSED:
        raise refusal(named, f"ezc3d cannot read it: {words}", expected)
    ending = f"exit code {ran.returncode}: {words.splitlines()[-1] if words else 'no word'}"
    if ran.returncode < 0:
        ending = signal.Signals(-ran.returncode).name
    raise refusal(named, f"ezc3d ended in its middle ({ending})", expected)


def _samples(archive: bytes) -> Samples:
    parameters: dict[str, dict[str, Value]] = {}
    with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
        for k, (group, name) in enumerate(arrays["names"]):
            value = arrays[f"parameter_{k}"]
            own = tuple(map(_cleaned, value)) if value.dtype.kind == "U" else value
            parameters.setdefault(str(group).strip().upper(), {})[str(name).strip().upper()] = own
        read = [arrays[name] for name in ("positions", "residuals", "analog")]
    return Samples(parameters, *read)


def _cleaned(text: str) -> str:
    """Without filling blanks; bytes that are no UTF-8 come as surrogates and are Latin-1."""
    raw = str(text).encode("utf-8", "surrogateescape")
    try:
        known = raw.decode("utf-8")
    except UnicodeDecodeError:
        known = raw.decode("latin-1")
    return known.replace("\0", " ").strip()


# --- written anew where ezc3d would misread or refuse a sound file --------------------------------

# Seen in real files: counts of points, channels, frames or rates in the parameters that the header
# and the file's length contradict, where ezc3d takes the parameters' word (`type1.C3D` has no
# ANALOG:RATE, `kyowadengyo.c3d` counts a point too many, `evart.c3d` lacks scales and has 17
# samples at a rate that says 16); ANALOG:OFFSET as floats (`Dance.c3d`); a gap between two
# parameters (`badParameterOffset.c3d`); a description of more than 127 characters
# (`BKINtechnologies.c3d`). From the format's text: offsets below zero, whose sign ezc3d drops;
# integer samples without a sign; more frames than the header can count, of which ezc3d reads the
# first 65535: these are written in pieces.

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
        and (number(point, "SCALE") < 0) == (header.scale < 0) == layout.is_float
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
