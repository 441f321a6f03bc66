"""Sizes of the analog counts that are no numbers are said, and their plates not used."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.recordings.c3d_format import about_scales, scaling_of
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

N = 30


@pytest.fixture
def path(tmp_path) -> Path:
    markers, labels = standing_markers(N)
    force, moment = standing_wrench(10 * N)
    plates = [PlateSpec(share * force, share * moment) for share in (0.4, 0.6)]
    return write_c3d(tmp_path / "a.c3d", markers, labels, plates)


def _write(path: Path, place: int, dimensions: int, value: float) -> None:
    """A float at the beginning of a parameter, whose type stands at ``place``."""
    content = bytearray(path.read_bytes())
    assert tuple(content[place : place + 2]) == (4, dimensions)
    struct.pack_into("<f", content, place + 2 + dimensions, value)
    path.write_bytes(content)


@pytest.mark.parametrize(("n_scales", "is_said"), [(0, False), (7, True), (12, False), (16, False)])
def test_scales_that_do_not_reach_all_channels_are_said(n_scales, is_said):
    found = [f.found for f in about_scales({"SCALE": np.full(n_scales, 0.1)}, 12)]
    assert found == ["ANALOG:SCALE has 7 numbers for 12 channels"] * is_said


@pytest.mark.parametrize(
    ("offset", "first"),
    [
        (-32768.0, [0.0, -1.0, 8.0]),
        (32767.0, [1.0, 0.0, 9.0]),
        (-30000.0, [-2768.0, 62767.0, -2760.0]),
        (0.0, [-32768.0, 32767.0, -32760.0]),
    ],
)
def test_an_offset_of_half_the_counts_is_of_counts_without_sign(offset, first):
    group = {"OFFSET": np.array([offset, 0.0])}
    counts = np.array([[-32768.0, 32767.0, -32760.0], [3.0, 4.0, 5.0]])
    found = scaling_of(group, 2, is_unsigned=False).applied(counts, is_float=False)
    np.testing.assert_array_equal(found, [first, counts[1]])


def _excluded(path: Path) -> tuple[int, list[str]]:
    """How many plates are left, and what is said of the others."""
    recording = read_recording(path)
    findings = [finding for finding in recording.findings if finding.level == "excluded"]
    return len(recording.plates), [finding.found for finding in findings]


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "0"])
def test_size_of_all_channels(path, value):
    place = path.read_bytes().find(b"GEN_SCALE") + len("GEN_SCALE") + 2
    _write(path, place, 0 if path.read_bytes()[place + 1] == 0 else 1, float(value))
    said = [f"ANALOG:GEN_SCALE times SCALE is {value}"] * 2
    assert _excluded(path) == (0, said)
    assert read_recording(path).forces_note == "the file has no usable force plates"


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_size_of_one_channel(path, value):
    content = path.read_bytes()
    place = content.find(b"SCALE", content.find(b"GEN_SCALE") + 9) + len("SCALE") + 2
    _write(path, place, 1, float(value))
    assert _excluded(path) == (1, [f"ANALOG:GEN_SCALE times SCALE is {value}"])


def test_sizes_that_are_numbers(path):
    assert _excluded(path) == (2, [])
