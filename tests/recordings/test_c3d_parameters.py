"""Records of parameters: what they say in every processor's numbers, and broken ones."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_format import (
    BLOCK,
    DEC,
    PC,
    floats,
    integers,
    number,
    numbers,
    parameters_of,
    read_records,
    texts,
)
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import standing_markers, write_c3d


@pytest.fixture
def content(tmp_path) -> bytearray:
    markers, labels = standing_markers(20)
    return bytearray(write_c3d(tmp_path / "a.c3d", markers, labels).read_bytes())


def _parameters(tmp_path, content: bytes):
    return parameters_of(read_records(tmp_path / "a.c3d", bytes(content)), PC)


def test_records_may_end_with_the_last_byte_before_the_data(tmp_path):
    """The two zeros behind the last one, or the first of them."""
    group = bytes([5, 255]) + b"POINT" + struct.pack("<H", 3) + bytes([0])
    head = bytes([2, 80]).ljust(BLOCK, b"\0") + bytes([1, 80, 1, PC])
    for end in (b"\0\0", b"\0"):
        (record,) = read_records(tmp_path / "a.c3d", head + group + end)
        assert record.name == "POINT"
    with pytest.raises(BadDataError, match="no readable name"):
        read_records(tmp_path / "a.c3d", head + group[:-1])
    with pytest.raises(BadDataError, match="no readable name"):
        read_records(tmp_path / "a.c3d", head + group + b"\5")


def test_numbers_of_a_good_file(tmp_path, content):
    point = _parameters(tmp_path, content)["POINT"]
    assert number(point, "RATE") == 100.0
    assert number(point, "USED") == 8
    assert len(numbers(point, "LABELS")) == 0 and texts(point, "RATE") == []
    assert np.isnan(number(point, "NONE"))


def test_continuations_are_joined():
    group = {"SCALE": np.array([1.0, 2.0]), "SCALE2": np.array([3.0]), "UNITS": ("N",)}
    np.testing.assert_array_equal(numbers(group, "SCALE"), [1.0, 2.0, 3.0])
    assert texts({"UNITS": ("N",), "UNITS2": ("Nmm", "V")}, "UNITS") == ["N", "Nmm", "V"]


def _as_vax(value: float) -> bytes:
    bits = struct.pack("<f", 4 * value)
    return bits[2:] + bits[:2]


@pytest.mark.parametrize(
    ("processor", "write_int", "write_float"),
    [
        (PC, lambda i: struct.pack("<h", i), lambda x: struct.pack("<f", x)),
        (DEC, lambda i: struct.pack("<h", i), _as_vax),
    ],
)
def test_numbers_of_every_processor(processor, write_int, write_float):
    whole, real = [0, 1, -2, 32767], [0.0, 1.0, -0.25, 1234.5]
    assert integers(b"".join(map(write_int, whole))).tolist() == whole
    assert floats(b"".join(map(write_float, real)), processor).tolist() == real


def test_torn_chain_and_unreadable_name(tmp_path, content):
    at = content.find(b"UNITS") + len(b"UNITS")
    content[at : at + 2] = b"\xff\x7f"
    with pytest.raises(BadDataError, match="run into the data"):
        _parameters(tmp_path, content[: 20 * 512])
    content[content.find(b"USED")] = 0
    with pytest.raises(BadDataError, match="no readable name"):
        _parameters(tmp_path, content)


def test_a_text_where_a_number_belongs_is_no_number(tmp_path, content):
    at = content.find(b"GEN_SCALE") + len(b"GEN_SCALE") + 2
    content[at] = 255
    path = tmp_path / "a.c3d"
    path.write_bytes(content)
    try:
        read_recording(path)
    except BadDataError as error:
        assert "parameter section" in str(error)


def test_a_long_description_is_no_fault(tmp_path, content):
    """ezc3d reads its length as a signed byte and refuses the file."""
    at = content.find(b"FRAMES") + len(b"FRAMES") + 2
    n = content[at - 2] + 256 * content[at - 1]
    length = content[at + 4]
    assert n == 2 + 2 + 2 + 1 + length
    content[at + 4 : at + 5 + length] = bytes([163]) + 163 * b"x"
    content[at - 2 : at] = struct.pack("<H", 7 + 163)
    end = 163 - length
    header_blocks = 512 * (content[16] - 1)
    del content[header_blocks : header_blocks + end]  # zeros that fill the last block
    path = tmp_path / "b.c3d"
    path.write_bytes(content)
    assert read_recording(path).n_frames == 20
