"""TRC with MOT: axes, signs, rates, lost rows, points that are missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
    X_UP_FROM_Z_UP,
    Y_UP_FROM_Z_UP,
    standing_markers,
    standing_wrench,
    write_mot,
    write_trc,
)
from tests.recordings.standing_on_two_plates import of_table

N = 80
TURN = Y_UP_FROM_Z_UP.T
NAMINGS = {
    "numbered": ("ground_force_1_v{}", "ground_force_1_p{}", "ground_force_1_m{}"),
    "bare": ("ground_force_v{}", "ground_force_p{}", "ground_torque_{}"),
}
MARKERS, LABELS = standing_markers(N)
FORCE, MOMENT = standing_wrench(N)


def _columns(force, moment, naming="numbered", point_scale=1.0, turn=TURN):
    """Force at the point of pressure with its free torque, written in the lab frame."""
    point = np.column_stack(
        [-moment[:, 1] / force[:, 2], moment[:, 0] / force[:, 2], 0 * force[:, 2]]
    )
    free = moment - np.cross(point, force)
    parts = (force @ turn, point @ turn * point_scale, free @ turn)
    return {
        name.format(axis): values[:, i]
        for name, values in zip(NAMINGS[naming], parts, strict=True)
        for i, axis in enumerate("xyz")
    }


def _read(
    tmp_path,
    columns=None,
    markers_m=MARKERS @ TURN,
    *,
    mot="a.mot",
    start_s=0.0,
    later_s=0.0,
    force_hz=100.0,
):
    """What is read of markers in the lab frame and of a table of forces that begins later."""
    write_trc(tmp_path / "a.trc", start_s + np.arange(N) / 100.0, markers_m, LABELS)
    if columns:
        times_s = start_s + later_s + np.arange(len(next(iter(columns.values())))) / force_hz
        write_mot(tmp_path / mot, times_s, columns)
    return read_recording(tmp_path / "a.trc")


def _levels(recording) -> dict[str, str]:
    return {f.check: f.level for f in recording.findings}


@pytest.mark.parametrize("naming", NAMINGS)
@pytest.mark.parametrize("mot", ["a.mot", "a_grf.mot", "a_Forces.STO"])
def test_known_wrench_comes_back(tmp_path, naming, mot):
    recording = _read(tmp_path, _columns(FORCE, MOMENT, naming), mot=mot)
    np.testing.assert_allclose(recording.markers_m, MARKERS, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].force_N, FORCE, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, MOMENT, atol=1e-6)
    assert recording.plates[0].corners_m is None
    assert recording.forces_note == ""
    assert _levels(recording) == {"up_axis": "corrected"}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("\n", "\r\n"),
        ("PathFileType", "\ufeffPathFileType"),
        ("Frame#\tTime", "Frame#\tTimes"),
        ("Frame#\tTime", "Frame#\tTimes\t"),
        ("Frame#", "frame #"),
        ("\n\n", "\n"),
        ("\t", " "),
        ("\t\t\t", "\t\t"),
        ("\tUnits", ""),
    ],
)
def test_header_variants(tmp_path, old, new):
    _read(tmp_path)
    path = tmp_path / "a.trc"
    path.write_text(path.read_text().replace(old, new))
    recording = read_recording(path)
    assert recording.labels == tuple(LABELS)
    np.testing.assert_allclose(recording.markers_m, MARKERS, atol=1e-6)


def test_lost_rows_and_cells_are_said_or_refused(tmp_path):
    _read(tmp_path)
    path = tmp_path / "a.trc"
    lines = path.read_text().splitlines()
    cells = lines[30].split("\t")

    def said(lines: list[str], end: str = "\n") -> list[str]:
        path.write_text("\n".join(lines) + end)
        checks = ("layout", "rate", "time", "points")
        return [f.found for f in read_recording(path).findings if f.check in checks]

    def with_cell(cell: str) -> list[str]:
        row = "\t".join([*cells[:5], cell, *cells[6:]])
        return said([*lines[:30], row, *lines[31:]])

    assert said(lines) == []
    assert said(lines[:-3]) == [f"the header counts {N} frames, the file has {N - 3}"]
    assert "the last row is cut" in said([*lines[:-1], lines[-1][:40]], end="")
    assert with_cell("1.2.3")[0].startswith("1 cells that are no numbers")
    assert with_cell("9e9")[0].startswith("1 positions more than")
    extra = [line + "\tMORE" if line.startswith("Frame#") else line for line in lines]
    with pytest.raises(BadDataError, match="26 cells under 9 labels"):
        said(extra)


def test_spikes_are_marked(tmp_path):
    columns = _columns(*standing_wrench(10 * N))
    columns["ground_force_1_vy"][194] = 1e7
    recording = _read(tmp_path, columns, force_hz=1000.0)
    assert (~recording.plates[0].usable).sum() == 1
    assert "analog_spike" in _levels(recording)


def test_faster_forces(tmp_path):
    force, moment = standing_wrench(10 * N)
    recording = _read(tmp_path, _columns(force, moment), start_s=1.5, force_hz=1000.0)
    assert recording.analog_rate_hz == pytest.approx(1000.0)
    assert recording.time0_s == pytest.approx(1.5)
    np.testing.assert_allclose(recording.markers_m, MARKERS, atol=1e-6)
    n = len(recording.plates[0].force_N)
    assert n == (N - 1) * 10 + 1
    np.testing.assert_allclose(recording.plates[0].force_N, force[:n], atol=1e-6)


def test_action_on_the_ground_is_reversed(tmp_path):
    columns = _columns(FORCE, MOMENT)
    recording = _read(tmp_path, {name: x if "_p" in name else -x for name, x in columns.items()})
    np.testing.assert_allclose(recording.plates[0].force_N, FORCE, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, MOMENT, atol=1e-6)
    assert "plate_sign" in _levels(recording)


def test_forces_shorter_than_the_markers(tmp_path):
    force, moment = standing_wrench(N - 20)
    (plate,) = _read(tmp_path, _columns(force, moment), later_s=0.1).plates
    np.testing.assert_array_equal(np.flatnonzero(plate.usable), np.arange(10, N - 10))
    np.testing.assert_allclose(plate.force_N[plate.usable], force, atol=1e-6)


def test_uneven_stamps_are_resampled(tmp_path):
    stamps = np.arange(N) / 100.0 + 0.002 * np.random.default_rng(1).uniform(-1, 1, N)
    markers = MARKERS.copy()
    markers[:, 7, 0] = 0.2 + 0.5 * stamps
    recording = read_recording(write_trc(tmp_path / "a.trc", stamps, markers @ TURN, LABELS))
    assert _levels(recording)["time"] == "corrected"
    np.testing.assert_allclose(
        recording.markers_m[:, 7, 0], 0.2 + 0.5 * recording.time_s(), atol=1e-6
    )


@pytest.mark.parametrize("text", ["", "endheader\n", "endheader\ntime\tx\n0\t1\n0.1\tq\n"])
def test_broken_mot_is_refused(tmp_path, text):
    _read(tmp_path)
    (tmp_path / "a.mot").write_text(text)
    with pytest.raises(BadDataError):
        read_recording(tmp_path / "a.trc")


@pytest.mark.parametrize("point_scale", [1.0, 1000.0])
@pytest.mark.parametrize("forces", [TURN, X_UP_FROM_Z_UP.T, np.eye(3)])
@pytest.mark.parametrize("markers", [TURN, X_UP_FROM_Z_UP.T, np.eye(3)])
def test_markers_and_forces_are_turned_each_in_its_own_way(tmp_path, markers, forces, point_scale):
    """A conversion may turn a TRC and leave its MOT, or the other way round."""
    columns = _columns(FORCE, MOMENT, "numbered", point_scale, forces)
    recording = _read(tmp_path, columns, MARKERS @ markers)
    are_z_up = (markers == np.eye(3)).all() and (forces == np.eye(3)).all()
    expected = {} if are_z_up else {"up_axis": "corrected"}
    actions = {f.check: f.action for f in recording.findings}
    if point_scale != 1.0:
        expected |= {"plate_cop": "corrected"}
        assert "points of force in mm" in actions["plate_cop"]
    assert _levels(recording) == expected
    np.testing.assert_allclose(markers @ recording.rotation_world_lab.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(recording.markers_m, MARKERS, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].force_N, FORCE, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, MOMENT, atol=1e-5)


@pytest.mark.parametrize("lost", [0, 6])
def test_forces_that_end_before_the_markers_may_have_lost_rows(tmp_path, lost):
    columns = {
        name: np.delete(x, slice(20, 20 + lost)) for name, x in _columns(FORCE, MOMENT).items()
    }
    said = [f.expected for f in _read(tmp_path, columns).findings if f.check == "analog_nan"]
    assert ["come too early" in one for one in said] == [True] * (lost > 0)


def test_who_lies_on_the_plates_keeps_the_forces_axes(tmp_path):
    """Head and feet along the laboratory's Z, forces along Y: no conversion."""
    lying = MARKERS @ np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])
    under_the_back = np.cross([0.2, 0.9, 0.0], FORCE)
    recording = _read(tmp_path, _columns(FORCE, under_the_back), lying @ TURN)
    assert not any(f.check == "up_axis" and f.subject for f in recording.findings)
    np.testing.assert_allclose(recording.rotation_world_lab @ TURN.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("light_N", [12.0, 40.0])
def test_a_missing_point_is_the_nearest_known_one_under_a_light_force_only(tmp_path, light_N):
    columns = _columns(FORCE, MOMENT)
    lifted = slice(50, 60)
    noise = np.random.default_rng(2).normal(0.0, 1.0, (3, 10))
    for axis, value in zip("xyz", noise + np.array([[0.0], [light_N], [0.0]]), strict=True):
        columns[f"ground_force_1_v{axis}"][lifted] = value
        for name in (f"ground_force_1_p{axis}", f"ground_force_1_m{axis}"):
            columns[name][lifted] = np.nan
    (plate,) = _read(tmp_path, columns).plates
    if light_N > 20.0:
        assert not plate.usable[lifted].any()
        return
    assert plate.usable[lifted].all()
    held = [49] * 5 + [60] * 5
    np.testing.assert_allclose(plate.cop_m(0.0)[lifted], plate.cop_m(0.0)[held], atol=1e-9)


def test_a_load_without_a_point_is_marked_and_said(tmp_path):
    columns = _columns(FORCE, MOMENT)
    for axis in "xyz":
        columns[f"ground_force_1_p{axis}"][50:60] = 0.0
    recording = _read(tmp_path, columns)
    assert np.flatnonzero(~recording.plates[0].usable).tolist() == list(range(50, 60))
    said = f"10 of {N} samples have a force and no point"
    assert any(said in f.found for f in recording.findings)


def test_exchanged_points_are_no_missing_ones():
    """Points are zero while their own plate bears nothing, which is while the other one does."""
    first, second = of_table()
    half = np.arange(len(first.known)) < len(first.known) // 2
    bears = (half, ~half)
    first, second = (
        replace(one, force_N=one.force_N * on[:, None], points=one.points * on[:, None])
        for one, on in zip((first, second), bears, strict=True)
    )
    wrong = replace(first, points=second.points), replace(second, points=first.points)
    assert not any(one.usable[on].any() for one, on in zip(wrong, bears, strict=True))
    right = wrong[0].in_place_of(wrong[1]), wrong[1].in_place_of(wrong[0])
    assert all(one.usable.all() for one in right)
    np.testing.assert_array_equal(right[0].points, first.points)
