"""Sizes of the analog counts that are no numbers are said, and their plates not used."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

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
