"""Broken parameter sections are refused before ezc3d follows them."""

from __future__ import annotations

import pytest
from recording_writers import standing_markers, write_c3d

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_parameters import find_fault
from bsip_cli.recordings.read import read_recording


@pytest.fixture
def content(tmp_path) -> bytearray:
    markers, labels = standing_markers(20)
    return bytearray(write_c3d(tmp_path / "a.c3d", markers, labels).read_bytes())


def test_a_good_file_has_no_fault(content):
    assert find_fault(bytes(content)) == ""


def test_number_that_is_text(content):
    at = content.find(b"GEN_SCALE") + len(b"GEN_SCALE") + 2
    content[at] = 255
    assert "GEN_SCALE is text" in find_fault(bytes(content))


def test_torn_chain_and_unreadable_name(content):
    at = content.find(b"UNITS") + len(b"UNITS")
    content[at : at + 2] = b"\xff\x7f"
    assert "run into the data" in find_fault(bytes(content))
    content[content.find(b"USED")] = 0
    assert "no readable name" in find_fault(bytes(content))


def test_long_description(tmp_path, content):
    at = content.find(b"FRAMES") + len(b"FRAMES") + 6
    content[at] = 163
    assert "description of 163" in find_fault(bytes(content))
    path = tmp_path / "b.c3d"
    path.write_bytes(content)
    with pytest.raises(BadDataError, match="description"):
        read_recording(path)
