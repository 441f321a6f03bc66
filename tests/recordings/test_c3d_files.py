"""C3D below its plates: samples, broken and odd parameters, sizes that are none."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.c3d_content import about_scales, read_content, scaled
from bsip_cli.recordings.c3d_format import (
    BLOCK,
    floats,
    integers,
    number,
    numbers,
    read_parameters,
    texts,
)
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

N = 30
PC, DEC = 84, 85


def _write_plates(folder: Path, *shares: float) -> Path:
    """Somebody stands on plates that bear these shares."""
    force, moment = standing_wrench(10 * N)
    plates = [PlateSpec(share * force, share * moment) for share in shares]
    return write_c3d(folder / "a.c3d", *standing_markers(N), plates)


@pytest.fixture
def path(tmp_path) -> Path:
    return _write_plates(tmp_path, 1.0)


def test_samples_and_parameters_come_back(path):
    content = read_content(path)
    markers, labels = standing_markers(N)
    np.testing.assert_allclose(content.positions, 1e3 * markers, atol=1e-3)
    assert content.is_valid.all() and content.is_valid.shape == (N, len(labels))
    assert content.analog.shape == (6, 10 * N)
    assert texts(content.group("POINT"), "LABELS") == labels
    assert numbers(content.group("FORCE_PLATFORM"), "CORNERS").shape == (3, 4, 1)


def test_labels_that_are_no_utf8(path):
    content = path.read_bytes()
    label = standing_markers(1)[1][0].encode()
    path.write_bytes(content.replace(label, b"\xe9" + label[1:], 1))
    labels = texts(read_content(path).group("POINT"), "LABELS")
    assert labels[0] == "\u00e9" + label[1:].decode()


def _record(content: bytes, name: str, group: str = "ANALOG") -> int:
    """Where the value's type stands, after name and step."""
    return content.find(name.encode(), content.find(group.encode())) + len(name) + 2


def _check(path) -> None:
    force, _ = standing_wrench(10 * N)
    recording = read_recording(path)
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=0.01)
    np.testing.assert_allclose(recording.markers_m, standing_markers(N)[0], atol=1e-6)


def test_offset_as_floats(path):
    """As `Dance.c3d` has them."""
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


@pytest.fixture
def content(tmp_path) -> bytearray:
    """Of a file without plates."""
    return bytearray(write_c3d(tmp_path / "markers.c3d", *standing_markers(N)).read_bytes())


def _parameters_of(tmp_path, content: bytes):
    return read_parameters(tmp_path / "a.c3d", bytes(content), PC)


def test_records_may_end_with_the_last_byte_before_the_data(tmp_path):
    """The two zeros behind the last one, or the first of them."""
    group = bytes([5, 255]) + b"POINT" + struct.pack("<H", 3) + bytes([0])
    head = bytes([2, 80]).ljust(BLOCK, b"\0") + bytes([1, 80, 1, PC])
    for end in (b"\0\0", b"\0"):
        assert _parameters_of(tmp_path, head + group + end) == {"POINT": {}}
    with pytest.raises(BadDataError, match="no readable name"):
        _parameters_of(tmp_path, head + group[:-1])
    with pytest.raises(BadDataError, match="no readable name"):
        _parameters_of(tmp_path, head + group + b"\5")


def test_texts_without_letters_fill_no_memory(tmp_path):
    group = bytes([5, 255]) + b"POINT" + struct.pack("<H", 3) + bytes([0])
    text = bytes([1, 1]) + b"X" + struct.pack("<H", 0) + bytes([255, 6, 0, *[255] * 5, 0])
    head = bytes([2, 80]).ljust(BLOCK, b"\0") + bytes([1, 80, 1, PC])
    assert _parameters_of(tmp_path, head + group + text + bytes(4))["POINT"]["X"] == ("",) * 255


def test_numbers_of_a_good_file(tmp_path, content):
    point = _parameters_of(tmp_path, content)["POINT"]
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
        _parameters_of(tmp_path, content[: 20 * 512])
    content[content.find(b"USED")] = 0
    with pytest.raises(BadDataError, match="no readable name"):
        _parameters_of(tmp_path, content)


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
    assert read_recording(path).n_frames == N


@pytest.fixture
def two_plates(tmp_path) -> Path:
    return _write_plates(tmp_path, 0.4, 0.6)


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
    found, _ = scaled(counts, group, is_float=False)
    np.testing.assert_array_equal(found, [first, counts[1]])


def _excluded(path: Path) -> tuple[int, list[str]]:
    """How many plates are left, and what is said of the others."""
    recording = read_recording(path)
    findings = [finding for finding in recording.findings if finding.level == "excluded"]
    return len(recording.plates), [finding.found for finding in findings]


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "0"])
def test_size_of_all_channels(two_plates, value):
    place = two_plates.read_bytes().find(b"GEN_SCALE") + len("GEN_SCALE") + 2
    _write(two_plates, place, 0 if two_plates.read_bytes()[place + 1] == 0 else 1, float(value))
    said = [f"ANALOG:GEN_SCALE times SCALE is {value}"] * 2
    assert _excluded(two_plates) == (0, said)
    assert read_recording(two_plates).forces_note == "the file has no usable force plates"


@pytest.mark.parametrize("value", ["nan", "inf", "0.5"])
def test_size_of_one_channel(two_plates, value):
    content = two_plates.read_bytes()
    place = content.find(b"SCALE", content.find(b"GEN_SCALE") + 9) + len("SCALE") + 2
    _write(two_plates, place, 1, float(value))
    said = [f"ANALOG:GEN_SCALE times SCALE is {value}"] if value != "0.5" else []
    assert _excluded(two_plates) == (2 - len(said), said)


def test_a_file_that_ends_before_its_first_frame(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", *standing_markers(1))
    content = path.read_bytes()
    start = 512 * (struct.unpack_from("<H", content, 16)[0] - 1)
    frame = 16 * len(standing_markers(1)[1])
    path.write_bytes(content[: start + frame - 4])
    with pytest.raises(BadDataError, match="ends before its first frame"):
        read_content(path)


def test_gaps_written_as_nan_are_no_sign_of_integers(path):
    raw = bytearray(path.read_bytes())
    raw[12:16] = np.float32(1.0).tobytes()  # a header that calls floats integers
    start, words = 512 * (struct.unpack_from("<H", raw, 16)[0] - 1), len(standing_markers(N)[1]) * 4
    frame = 4 * (words + 6 * 10)
    for k in range(N):  # each third marker is not seen
        for marker in range(0, words // 4, 3):
            at = start + k * frame + 16 * marker
            raw[at : at + 12] = np.full(3, np.nan, np.float32).tobytes()
    path.write_bytes(raw)
    positions = read_content(path).positions
    markers = 1e3 * standing_markers(N)[0]
    seen = [k for k in range(words // 4) if k % 3]
    np.testing.assert_allclose(positions[:, seen], markers[:, seen], atol=1e-3)


def test_records_that_together_claim_more_than_there_is(tmp_path):
    group = bytes([5, 255]) + b"MANUF" + struct.pack("<H", 3) + b"\0"
    text = b"".join(
        bytes([2, 1]) + b"T%d" % k + struct.pack("<H", 8) + bytes([255, 2, 200, 20, 0, 0])
        for k in range(3)
    )  # each of 4,000 letters, and the next begins within them
    content = bytes(512) + bytes([0, 0, 1, PC]) + group + text + bytes(6000)
    content = b"\x02" + content[1:]
    with pytest.raises(BadDataError, match="claim more bytes than there are"):
        read_parameters(tmp_path / "a.c3d", content, PC)
