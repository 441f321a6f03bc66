"""A known wrench and known markers come back from C3D files of all kinds."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.plates import CHANNELS_OF, PlateDescription, corners_are_plausible
from bsip_cli.recordings.read import open_recording, read_recording
from tests.recordings.recording_writers import (
    CORNERS_M,
    ORIGIN_M,
    X_UP_FROM_Z_UP,
    Y_UP_FROM_Z_UP,
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

N = 60
RATIO = 10


def _spec(**options) -> PlateSpec:
    return PlateSpec(*standing_wrench(N * RATIO), **options)


def _origin(kind: int) -> np.ndarray:
    """Under the surface; of sensors the distances from its middle."""
    return np.array([0.12, 0.2, -0.05]) if kind == 3 else ORIGIN_M


def _write(path, *specs, **options):
    return write_c3d(path, *standing_markers(N), specs, **options)


def _edited(tmp_path, *changes: tuple[int, bytes]):
    """A file with other bytes at these places."""
    path = _write(tmp_path / "a.c3d", _spec())
    content = bytearray(path.read_bytes())
    for at, new in changes:
        content[at : at + len(new)] = new
    path.write_bytes(content)
    return path


def _value_of(tmp_path, group: bytes, name: bytes) -> int:
    """The place of a parameter's first value in such a file."""
    content = _write(tmp_path / "sound.c3d", _spec()).read_bytes()
    return content.find(name, content.find(group)) + len(name) + 4


def _check_wrench(recording: Recording, atol_N: float = 0.01) -> None:
    force, moment = standing_wrench(N * RATIO)
    assert len(recording.plates) == 1, recording.findings
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=atol_N)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, moment, atol=atol_N)
    assert recording.plates[0].usable.all()
    assert recording.forces_note == ""


def _levels(recording: Recording, check: str) -> list[str]:
    return [f.level for f in recording.findings if f.check == check]


def test_writer_winds_the_corners_as_the_format_wants():
    plate = PlateDescription("1", 2, CORNERS_M, ORIGIN_M)
    np.testing.assert_allclose(plate.rotation_lab_plate()[:, 2], [0, 0, -1])


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_known_wrench_comes_back(tmp_path, kind):
    spec = _spec(kind=kind, origin_m=_origin(kind))
    recording = read_recording(_write(tmp_path / "a.c3d", spec))
    _check_wrench(recording)
    assert not recording.findings
    assert recording.analog_rate_hz == 1000.0


@pytest.mark.parametrize(
    ("unit", "force_unit", "moment_unit"),
    [
        ("mm", "N", "Nmm"),
        ("mm", "N", "Nm"),
        ("m", "N", "Nm"),
        ("m", "N", "N.mm"),
        ("mete", "Newtons", "Newton-meters"),
        ("mm", "nt", "ntmm"),
        ("mm", "V", "V"),
        ("mm", "Q", "Nmm"),
    ],
)
def test_units(tmp_path, unit, force_unit, moment_unit):
    stated = "Nmm" if moment_unit == "V" else moment_unit
    path = _write(tmp_path / "a.c3d", _spec(), unit=unit, force_unit=force_unit, moment_unit=stated)
    recording = read_recording(path)
    _check_wrench(recording)
    markers, _ = standing_markers(N)
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)
    expected = {"mete": "corrected", "V": "info", "Q": "warning"}
    assert _levels(recording, "unit") == [expected[x] for x in (unit, force_unit) if x in expected]


@pytest.mark.parametrize(("unit", "size"), [("m", 1e-3), ("mm", 1.0), ("furlong", 1e-3)])
def test_a_unit_that_makes_no_person_is_corrected(tmp_path, unit, size):
    """Markers in mm called m, in m called mm, and in mm called nothing that is known."""
    markers, labels = standing_markers(N)
    path = write_c3d(
        tmp_path / "a.c3d", markers / size * (1e-3 if unit == "mm" else 1), labels, unit=unit
    )
    recording = read_recording(path)
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)
    assert _levels(recording, "unit") == ["corrected"]


@pytest.mark.parametrize("what", ["points", "data"])
def test_header_and_parameters_that_disagree(tmp_path, what):
    """The frames' own order tells which counts are right; a rate is no count."""
    sound = _write(tmp_path / "a.c3d", _spec()).read_bytes()
    at, stated = (
        (_value_of(tmp_path, b"POINT", b"USED"), 8) if what == "points" else (16, sound[16])
    )
    assert sound[at] == stated
    recording = read_recording(_edited(tmp_path, (at, bytes([stated + 1]))))
    _check_wrench(recording)
    assert _levels(recording, "layout") == ["warning"]


@pytest.mark.parametrize("stated", [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
def test_scales_that_call_floats_integers(tmp_path, stated):
    """The header's, then the parameter's."""
    at = _value_of(tmp_path, b"POINT", b"SCALE")
    header, parameter = (np.float32(one).tobytes() for one in stated)
    recording = read_recording(_edited(tmp_path, (12, header), (at, parameter)))
    _check_wrench(recording)
    assert _levels(recording, "scale") == ["corrected"] * (stated[0] > 0)


def test_a_rate_that_two_others_contradict(tmp_path):
    at = _value_of(tmp_path, b"POINT", b"RATE")
    recording = read_recording(_edited(tmp_path, (at, np.float32(60).tobytes())))
    _check_wrench(recording)
    assert (recording.marker_rate_hz, recording.analog_rate_hz) == (100.0, 1000.0)
    (said,) = (f.found for f in recording.findings if f.check == "rate")
    assert "POINT:RATE says 60 Hz" in said


@pytest.mark.parametrize(
    ("kind", "table", "words"),
    [
        (2, lambda table: table - 1, "counted from 0"),
        (3, lambda table: table - 1, "counted from 0"),
        (1, lambda table: table.ravel().reshape(table.shape, order="F"), "by rows"),
        (4, lambda table: table.T - 1, "a row for each plate and counted from 0"),
        (2, lambda table: table.T, "a row for each plate"),
        (3, lambda table: table + 7, "counted from 8"),
        (2, lambda table: table.ravel(order="F"), "as one list"),
    ],
)
@pytest.mark.parametrize("label", ["{axis}{plate}", "Force.{axis}{plate}"])
def test_channels_that_are_listed_otherwise(tmp_path, kind, table, words, label):
    """The labels of the channels tell how; without them it is told by which channels there are."""
    path, spec = tmp_path / "a.c3d", _spec(kind=kind, origin_m=_origin(kind))
    aside = replace(spec, corners_m=spec.corners_m + np.array([1.0, 0.0, 0.0]))
    content = ezc3d.c3d(str(write_c3d(path, *standing_markers(N), [spec, aside])))
    sound = read_recording(path)
    listed = content["parameters"]["FORCE_PLATFORM"]["CHANNEL"]
    listed["value"] = table(listed["value"][: len(CHANNELS_OF[kind])])
    content.write(str(path))
    unknown = read_recording(path)
    content["parameters"]["ANALOG"]["LABELS"]["value"] = [
        label.format(axis=axis, plate=plate) for plate in (1, 2) for axis in CHANNELS_OF[kind]
    ]
    content.write(str(path))
    read = read_recording(path)
    assert [words in f.found for f in read.findings if f.check == "plate"] == [True]
    for some in (read, unknown) if words != "by rows" else (read,):
        for one, other in zip(some.plates, sound.plates, strict=True):
            np.testing.assert_allclose(one.moment_Nm, other.moment_Nm, atol=1e-3)
        assert any(words in f.found for f in some.findings if f.check == "plate")


def test_corners_with_a_row_for_each(tmp_path):
    path = _write(tmp_path / "a.c3d", _spec())
    content = ezc3d.c3d(str(path))
    corners = content["parameters"]["FORCE_PLATFORM"]["CORNERS"]
    corners["value"] = corners["value"].swapaxes(0, 1)
    content.write(str(path))
    recording = read_recording(path)
    assert _levels(recording, "plate") == ["corrected"]
    _check_wrench(recording)


def test_corners_of_equal_diagonals_may_still_be_no_plate():
    away = np.array([1.0, 0.0, 0.0])
    crossed = CORNERS_M + np.array([away, 0 * away, away, 0 * away])
    assert not corners_are_plausible(crossed)


def test_more_plates_are_described_than_used(tmp_path):
    markers, labels = standing_markers(N)
    aside = _spec(corners_m=CORNERS_M + np.array([0.7, 0.0, 0.0]))
    path = write_c3d(tmp_path / "a.c3d", markers, labels, [_spec(), aside])
    content = ezc3d.c3d(str(path))
    content["parameters"]["FORCE_PLATFORM"]["USED"]["value"] = [1]
    content.write(str(path))
    opened = open_recording(path)
    assert [source.name for source in opened.sources] == ["1", "2"]
    (said,) = [one for one in opened.recording.findings if one.check == "plate"]
    assert (said.found, said.level) == ("FORCE_PLATFORM:USED is 1", "corrected")


@pytest.mark.parametrize("away", [(0.0, 0.0, 0.06), (0.05, 0.0, 0.0)])
def test_corners_that_are_no_rectangle_are_said(tmp_path, away):
    corners = CORNERS_M.copy()
    corners[2] += away
    findings = read_recording(_write(tmp_path / "a.c3d", _spec(corners_m=corners))).findings
    (said,) = [one for one in findings if one.check == "plate"]
    assert "mm away from a rectangle's" in said.found and said.level == "warning"


def test_rate_of_the_plates_that_is_no_multiple(tmp_path):
    at = _value_of(tmp_path, b"ANALOG", b"RATE")
    recording = read_recording(_edited(tmp_path, (at, np.array([1037.0], "<f4").tobytes())))
    _check_wrench(recording)
    assert recording.analog_rate_hz == 1000.0
    assert _levels(recording, "rate") == ["corrected"]


def test_more_frames_than_the_header_can_count(tmp_path):
    n = 66_000
    markers = np.tile(np.arange(1, 5)[:, None] * 0.3 + 1, (n, 1, 3))
    markers[:, 0, 0] += np.arange(n) * 1e-5
    recording = read_recording(write_c3d(tmp_path / "a.c3d", markers, list("ABCD")))
    assert recording.n_frames == n
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)


def test_a_header_that_promises_the_world_takes_no_memory(tmp_path):
    promise = b"\xff\x7f"  # 32767 points, and frames
    path = _edited(tmp_path, (2, promise), (8, promise))
    tracemalloc.start()
    recording = read_recording(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30e6  # the header asks for 4 GB
    assert _levels(recording, "layout") == ["warning"]
    _check_wrench(recording)
    at = _value_of(tmp_path, b"POINT", b"USED")
    with pytest.raises(BadDataError, match="promises"):
        read_recording(_edited(tmp_path, (2, promise), (8, promise), (at, promise)))


@pytest.mark.parametrize("kind", [2, 3, 4])
def test_flipped_sign_is_corrected_and_said(tmp_path, kind):
    spec = _spec(kind=kind, origin_m=_origin(kind), sign=-1.0)
    recording = read_recording(_write(tmp_path / "a.c3d", spec))
    _check_wrench(recording)
    assert _levels(recording, "plate_sign") == ["corrected"]


@pytest.mark.parametrize("kind", [2, 3])
def test_origin_of_either_sign_gives_the_same_wrench(tmp_path, kind):
    origin = _origin(kind)
    stated = origin * [1, 1, -1] if kind == 3 else -origin
    spec = _spec(kind=kind, origin_m=origin, stated_origin_m=stated)
    _check_wrench(read_recording(_write(tmp_path / "a.c3d", spec)))


@pytest.mark.parametrize("kind", [2, 4])
def test_an_origin_that_repeats_the_place_of_the_plate(tmp_path, kind):
    place = CORNERS_M.mean(axis=0)
    spec = _spec(kind=kind, origin_m=np.zeros(3), stated_origin_m=place)
    recording = read_recording(_write(tmp_path / "a.c3d", spec))
    _check_wrench(recording)
    assert _levels(recording, "plate_origin") == ["corrected"]


def test_an_origin_that_is_nearly_the_place_of_the_plate_is_an_offset(tmp_path):
    place = CORNERS_M.mean(axis=0) + np.array([0.0, 0.005, 0.0])
    recording = read_recording(_write(tmp_path / "a.c3d", _spec(origin_m=place)))
    assert _levels(recording, "plate_origin") == []


def test_y_up_laboratory_is_turned(tmp_path):
    markers, labels = standing_markers(N)
    force, moment = standing_wrench(N * RATIO)
    turn = Y_UP_FROM_Z_UP.T
    spec = PlateSpec(force @ turn, moment @ turn, corners_m=CORNERS_M @ turn)
    recording = read_recording(write_c3d(tmp_path / "a.c3d", markers @ turn, labels, [spec]))
    assert _levels(recording, "up_axis") == ["corrected"]
    rotation = recording.rotation_world_lab
    np.testing.assert_allclose(rotation @ Y_UP_FROM_Z_UP, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)
    _check_wrench(recording)


@pytest.mark.parametrize("turn", [Y_UP_FROM_Z_UP.T, X_UP_FROM_Z_UP.T])
@pytest.mark.parametrize("whose", ["markers", "plates"])
def test_plates_in_other_axes_than_the_markers_are_turned_by_themselves(tmp_path, whose, turn):
    aside_m = np.array([0.8, 0.0, 0.0])  # where heights are those of no one who lies there
    markers, labels = standing_markers(N)
    force, moment = standing_wrench(N * RATIO)
    moment, expected = moment + np.cross(aside_m, force), markers + aside_m
    matrices = (turn, np.eye(3)) if whose == "markers" else (np.eye(3), turn)
    markers, corners = expected @ matrices[0], (CORNERS_M + aside_m) @ matrices[1]
    spec = PlateSpec(force @ matrices[1], moment @ matrices[1], corners_m=corners)
    recording = read_recording(write_c3d(tmp_path / "a.c3d", markers, labels, [spec]))
    (about,) = [finding for finding in recording.findings if finding.check == "up_axis"]
    assert about.expected == "one laboratory frame"
    np.testing.assert_allclose(recording.markers_m, expected, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=1e-3)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, moment, atol=1e-3)


@pytest.mark.parametrize("up", [0, 1])
def test_channels_in_axes_of_which_another_one_is_up(tmp_path, up):
    """Corners as the format wants them, and Fx or Fy across the plate."""
    path = _write(tmp_path / "a.c3d", _spec())
    content = ezc3d.c3d(str(path))
    six = content["data"]["analogs"][:, :6]
    content["data"]["analogs"][:, :6] = np.roll(six.reshape(2, 3, -1), up + 1, 1).reshape(1, 6, -1)
    content.write(str(path))
    recording = read_recording(path)
    (said,) = (f.found for f in recording.findings if f.check == "plate")
    assert said.startswith(f"{('Fx', 'Fy')[up]} of the plates bears the load")
    _check_wrench(recording)


@pytest.mark.parametrize("shift_m", [0.0, 0.6, -1.2])
def test_who_lies_on_a_plate_is_not_turned_upright(tmp_path, shift_m):
    markers, labels = standing_markers(N)
    lying = markers[..., [0, 2, 1]] * [1.0, 1.0, 0.4] + [0.0, shift_m, 0.0]
    force, moment = standing_wrench(N * RATIO)
    spec = PlateSpec(force, moment, corners_m=CORNERS_M)
    recording = read_recording(write_c3d(tmp_path / "a.c3d", lying, labels, [spec]))
    np.testing.assert_allclose(recording.rotation_world_lab, np.eye(3))


def test_x_up_without_plates_from_the_labels(tmp_path):
    markers, labels = standing_markers(N)
    recording = read_recording(write_c3d(tmp_path / "a.c3d", markers[..., [2, 0, 1]], labels))
    assert np.linalg.det(recording.rotation_world_lab) == pytest.approx(1.0)
    np.testing.assert_allclose(recording.markers_m[..., 2], markers[..., 2], atol=1e-6)
    assert recording.plates == () and "no usable force plates" in recording.forces_note


def test_missing_points_are_nan(tmp_path):
    markers, labels = standing_markers(N)
    markers[10:20, 3] = np.nan
    markers[30, 2] = 0.0
    recording = read_recording(write_c3d(tmp_path / "a.c3d", markers, labels))
    expected = np.zeros((N, len(labels)), bool)
    expected[10:20, 3] = expected[30, 2] = True
    np.testing.assert_array_equal(np.isnan(recording.markers_m).all(axis=-1), expected)


def test_nan_at_the_end_of_the_analog_samples(tmp_path):
    spec = _spec()
    spec.force_N[-17:, 1] = np.nan
    plate = read_recording(_write(tmp_path / "a.c3d", spec)).plates[0]
    np.testing.assert_array_equal(
        np.flatnonzero(~plate.usable), np.arange(N * RATIO - 17, N * RATIO)
    )


def test_clipped_and_stuck_samples(tmp_path):
    force, moment = standing_wrench(N * RATIO)
    force[:, 2] = np.minimum(force[:, 2] * np.linspace(0.2, 3.0, N * RATIO), 1500.0)
    recording = read_recording(_write(tmp_path / "a.c3d", PlateSpec(force, moment)))
    np.testing.assert_array_equal(recording.plates[0].usable, force[:, 2] < 1500.0)
    assert _levels(recording, "analog_clipped") == ["warning"]


@pytest.mark.parametrize("head", ["", "Tom:", "Tom_", "S01-"])
def test_model_outputs_and_unlabelled_points_are_dropped(tmp_path, head):
    markers, labels = standing_markers(N)
    extra = (
        "LHipAngles LKneeMoment LKneeTwist PELO PELA PELL PELP RGroundReactionForce CentreOfMass"
    )
    labels = [head + label for label in labels]
    more = [*(head + label for label in extra.split()), "*41"]
    path = write_c3d(
        tmp_path / "a.c3d",
        np.concatenate([markers, 1.0 + np.zeros((N, len(more), 3))], axis=1),
        [*labels, *more],
        point_parameters={"ANGLES": ["LHipAngles", "LKneeTwist"]},
    )
    assert read_recording(path).labels == tuple(labels)


FAR_CORNERS_M = np.array([[0, 0, 0], [1e9, 0, 0], [1e9, 1, 0], [0, 1, 0.0]])


@pytest.mark.parametrize(
    ("corners_m", "options"), [(CORNERS_M, {"channel_shift": 3}), (FAR_CORNERS_M, {})]
)
def test_a_plate_of_missing_channels_or_nonsense_corners_is_left_out(tmp_path, corners_m, options):
    path = _write(tmp_path / "a.c3d", _spec(corners_m=corners_m), **options)
    recording = read_recording(path)
    assert recording.plates == () and recording.forces_note
    assert _levels(recording, "plate") == ["excluded"]


@pytest.mark.parametrize(("one", "other"), [((3, 0), (4, 0)), ((2, 1), (2, 0))])
def test_a_channel_measures_one_thing(tmp_path, one, other):
    """My listed as Mx; the lift of one plate listed as that of another."""
    path, spec = tmp_path / "a.c3d", _spec()
    aside = replace(spec, corners_m=spec.corners_m + np.array([1.0, 0.0, 0.0]))
    content = ezc3d.c3d(str(write_c3d(path, *standing_markers(N), [spec, aside])))
    listed = content["parameters"]["FORCE_PLATFORM"]["CHANNEL"]["value"]
    listed[one] = listed[other]
    content.write(str(path))
    left_out = {f.subject: f.found for f in read_recording(path).findings if f.check == "plate"}
    said = "same numbers" if one[1] == other[1] else "is also listed for plate"
    assert set(left_out) == {str(k + 1) for k in (one[1], other[1])}
    assert all(said in found for found in left_out.values())


def test_plates_never_loaded(tmp_path):
    force, moment = standing_wrench(N * RATIO)
    recording = read_recording(_write(tmp_path / "a.c3d", PlateSpec(0.01 * force, 0.01 * moment)))
    assert recording.plates == () and "never loaded" in recording.forces_note


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.c3d", b""),
        ("a.c3d", b"no c3d at all"),
        ("a.c3d", b"\x02P" + 510 * b"\xff"),
        ("none.c3d", None),
        ("a.txt", None),
    ],
)
def test_foreign_and_missing_files_are_refused(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(BadDataError):
        read_recording(tmp_path / name)


def test_truncated_file_is_refused(tmp_path):
    path = _write(tmp_path / "a.c3d", _spec())
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(BadDataError, match="promises"):
        read_recording(path)


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ((2019, 5, 24), ["2019-05-24"]),
        ((24, 5, 2019), []),
        ((19, 5, 24), []),
        ((2019, 5), []),
        ((0, 0, 0), []),
    ],
)
def test_a_day_of_recording_is_said_where_it_is_one(tmp_path, written, said):
    path = _write(tmp_path / "a.c3d", _spec())
    content = ezc3d.c3d(str(path))
    content.add_parameter("TRIAL", "DATE", list(written))
    content.write(str(path))
    findings = read_recording(path).findings
    assert [f.found for f in findings if f.check == "recorded_on"] == said
