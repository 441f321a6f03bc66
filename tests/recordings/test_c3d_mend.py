"""Files that ezc3d misreads or refuses, though they are sound: the copy written anew."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from bsip_cli.recordings import c3d_content
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

N = 30


@pytest.fixture
def path(tmp_path):
    markers, labels = standing_markers(N)
    force, moment = standing_wrench(10 * N)
    return write_c3d(tmp_path / "a.c3d", markers, labels, [PlateSpec(force, moment)])


def _record(content: bytes, name: str, group: str = "ANALOG") -> int:
    """Where the value's type stands, after name and step."""
    return content.find(name.encode(), content.find(group.encode())) + len(name) + 2


def _check(path) -> None:
    force, _ = standing_wrench(10 * N)
    recording = read_recording(path)
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=0.01)
    np.testing.assert_allclose(recording.markers_m, standing_markers(N)[0], atol=1e-6)


def test_a_sound_file_is_not_written_anew(path, monkeypatch):
    monkeypatch.setattr(c3d_content, "mended", None)
    _check(path)


def test_offset_as_floats(path):
    """As `Dance.c3d` has them; ezc3d: OFFSET parameter is not an INT."""
    content = bytearray(path.read_bytes())
    at = _record(content, "OFFSET")
    assert content[at] == 2
    name = at - 2 - len("OFFSET")
    n = struct.unpack_from("<H", content, at - 2)[0]
    values = bytes([4, 1, 6]) + np.zeros(6, "<f4").tobytes() + b"\0"
    grown = content[: at - 2] + struct.pack("<H", len(values) + 2) + values + content[at - 2 + n :]
    assert grown[name : name + 6] == b"OFFSET"
    end = 512 * (content[16] - 1)
    extra = len(grown) - len(content)
    assert not any(grown[end : end + extra])  # zeros that fill the last block
    path.write_bytes(grown[:end] + grown[end + extra :])
    _check(path)


def test_offset_below_zero(path):
    """ezc3d drops its sign."""
    content = bytearray(path.read_bytes())
    at = _record(content, "OFFSET")
    content[at + 3 : at + 5] = struct.pack("<h", -5)
    path.write_bytes(content)
    force, _ = standing_wrench(10 * N)
    moved = read_recording(path).plates[0].force_N - force
    assert np.abs(moved).max() == pytest.approx(5.0, abs=0.01)
    assert np.ptp(moved, axis=0).max() < 0.02


def test_too_few_scales(path):
    """As `evart.c3d` has them."""
    content = bytearray(path.read_bytes())
    at = content.find(b"SCALE", content.find(b"GEN_SCALE") + 9) + len("SCALE") + 2
    assert content[at] == 4 and content[at + 2] == 6
    content[at + 2] = 4
    after = at + 3 + 16
    content[after : after + 9] = bytes([8]) + bytes(8)  # the rest becomes a description
    path.write_bytes(content)
    _check(path)
