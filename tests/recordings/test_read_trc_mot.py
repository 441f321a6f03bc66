"""TRC and MOT: units, axes, column names, signs, rates and time stamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import (
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
    "in front": ("1_ground_force_v{}", "1_ground_force_p{}", "1_ground_torque_{}"),
    "joined": ("ground_force1_v{}", "ground_force1_p{}", "ground_torque1_{}"),
    "sided": ("R_ground_force_v{}", "R_ground_force_p{}", "R_ground_torque_{}"),
    "short": ("F1_{}", "P1_{}", "M1_{}"),
    "plate": ("FP1_F{}", "FP1_P{}", "FP1_M{}"),
    "moment": ("ground_force_r_v{}", "ground_force_r_p{}", "ground_moment_r_m{}"),
}


def _columns(force, moment, naming="numbered", point_scale=1.0, y_up=True):
    """Force at the point of pressure with its free torque, written in the lab frame."""
    point = np.column_stack(
        [-moment[:, 1] / force[:, 2], moment[:, 0] / force[:, 2], 0 * force[:, 2]]
    )
    free = moment - np.cross(point, force)
    turn = TURN if y_up else np.eye(3)
    parts = (force @ turn, point @ turn * point_scale, free @ turn)
    return {
        name.format(axis): values[:, i]
        for name, values in zip(NAMINGS[naming], parts, strict=True)
        for i, axis in enumerate("xyz")
    }


def _trial(tmp_path, *, unit="mm", mot="a.mot", ratio=1, start_s=0.0, n=N, **mot_options):
    markers, labels = standing_markers(n)
    time_s = start_s + np.arange(n) / 100.0
    write_trc(tmp_path / "a.trc", time_s, markers @ TURN, labels, unit=unit)
    force, moment = standing_wrench(n * ratio)
    if mot:
        times = start_s + np.arange(n * ratio) / (100.0 * ratio)
        write_mot(tmp_path / mot, times, _columns(force, moment, **mot_options))
    return read_recording(tmp_path / "a.trc"), markers, force, moment


@pytest.mark.parametrize("naming", NAMINGS)
@pytest.mark.parametrize("mot", ["a.mot", "a_grf.mot", "a_Forces.STO"])
def test_known_wrench_comes_back(tmp_path, naming, mot):
    recording, markers, force, moment = _trial(tmp_path, mot=mot, naming=naming)
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, moment, atol=1e-6)
    assert recording.plates[0].corners_m is None
    assert recording.forces_note == ""
    assert [f.check for f in recording.findings] == ["up_axis"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("\n", "\r\n"),
        ("PathFileType", "\ufeffPathFileType"),
        ("Frame#\tTime", "Frame#\tTimes"),
        ("Frame#", "frame #"),
        ("\n\n", "\n"),
        ("\t", " "),
        ("\t\t\t", "\t\t"),
        ("\tUnits", ""),
        ("\tmm\n", "\tMM\n"),
        ("\tmm\n", "\tm\n"),
    ],
)
def test_header_variants(tmp_path, old, new):
    _trial(tmp_path)
    path = tmp_path / "a.trc"
    path.write_text(path.read_text().replace(old, new))
    recording = read_recording(path)
    markers, labels = standing_markers(N)
    assert recording.labels == tuple(labels)
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)


def test_comma_separated_forces(tmp_path):
    _, _, force, _ = _trial(tmp_path)
    path = tmp_path / "a.mot"
    head, table = path.read_text().split("endheader")
    path.write_text(head + "endheader" + table.replace("\t", ","))
    recording = read_recording(tmp_path / "a.trc")
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=1e-6)


def _lines(tmp_path) -> list[str]:
    return (tmp_path / "a.trc").read_text().splitlines()


def _said(tmp_path, lines: list[str], end: str = "\n") -> list[str]:
    (tmp_path / "a.trc").write_text("\n".join(lines) + end)
    recording = read_recording(tmp_path / "a.trc")
    return [f.found for f in recording.findings if f.check in ("layout", "rate", "time", "points")]


def test_lost_rows_and_cells_are_said_or_refused(tmp_path):
    _trial(tmp_path, mot=None)
    lines = _lines(tmp_path)
    assert _said(tmp_path, lines) == []
    assert _said(tmp_path, lines[:-3]) == [f"the header counts {N} frames, the file has {N - 3}"]
    assert "the last row is cut" in _said(tmp_path, [*lines[:-1], lines[-1][:40]], end="")
    cells = lines[30].split("\t")

    def with_row(row: list[str]) -> list[str]:
        return _said(tmp_path, [*lines[:30], "\t".join(row), *lines[31:]])

    assert with_row([*cells[:5], "1.2.3", *cells[6:]])[0].startswith("1 cells that are no numbers")
    assert with_row([*cells[:5], "9e9", *cells[6:]])[0].startswith("1 positions more than")
    with pytest.raises(BadDataError, match="25 cells under 8 labels"):
        with_row(cells[:5] + cells[6:])
    extra = [line + "\tMORE" if line.startswith("Frame#") else line for line in lines]
    with pytest.raises(BadDataError, match="26 cells under 9 labels"):
        _said(tmp_path, extra)


def test_a_rate_that_the_times_deny(tmp_path):
    _trial(tmp_path, mot=None)
    lines = _lines(tmp_path)
    lines[2] = lines[2].replace("100.0", "250")
    (found,) = _said(tmp_path, lines)
    assert "250 Hz" in found and "100 Hz" in found


def test_spikes_and_short_forces_are_marked(tmp_path):
    _trial(tmp_path, ratio=10)
    path = tmp_path / "a.mot"
    rows = path.read_text().splitlines()
    cells = rows[200].split("\t")
    cells[2] = "1e7"
    path.write_text("\n".join([*rows[:200], "\t".join(cells), *rows[201:]]) + "\n")
    recording = read_recording(tmp_path / "a.trc")
    assert (~recording.plates[0].usable).sum() == 1
    assert "analog_spike" in [f.check for f in recording.findings]


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_units_and_faster_forces(tmp_path, unit):
    recording, markers, force, _ = _trial(tmp_path, unit=unit, ratio=10, start_s=1.5)
    assert recording.analog_rate_hz == pytest.approx(1000.0)
    assert recording.time0_s == pytest.approx(1.5)
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)
    n = len(recording.plates[0].force_N)
    assert n == (N - 1) * 10 + 1
    np.testing.assert_allclose(recording.plates[0].force_N, force[:n], atol=1e-6)


def test_points_in_mm(tmp_path):
    recording, _, _, moment = _trial(tmp_path, point_scale=1000.0)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, moment, atol=1e-5)
    (about,) = [f for f in recording.findings if f.check == "plate_cop"]
    assert about.level == "corrected" and "points of force in mm" in about.action


def test_action_on_the_ground_is_reversed(tmp_path):
    markers, labels = standing_markers(N)
    time_s = np.arange(N) / 100.0
    write_trc(tmp_path / "a.trc", time_s, markers @ TURN, labels)
    force, moment = standing_wrench(N)
    columns = _columns(force, moment)
    reversed_ = {name: x if "_p" in name else -x for name, x in columns.items()}
    write_mot(tmp_path / "a.mot", time_s, reversed_)
    recording = read_recording(tmp_path / "a.trc")
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, moment, atol=1e-6)
    assert "plate_sign" in [f.check for f in recording.findings]


def test_z_up_trc_is_left_alone(tmp_path):
    markers, labels = standing_markers(N)
    time_s = np.arange(N) / 100.0
    write_trc(tmp_path / "a.trc", time_s, markers, labels)
    force, moment = standing_wrench(N)
    write_mot(tmp_path / "a.mot", time_s, _columns(force, moment, y_up=False))
    recording = read_recording(tmp_path / "a.trc")
    np.testing.assert_array_equal(recording.rotation_world_lab, np.eye(3))
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=1e-6)


def test_without_mot(tmp_path):
    recording, *_ = _trial(tmp_path, mot="")
    assert recording.plates == () and ".mot" in recording.forces_note


def test_forces_shorter_than_the_markers(tmp_path):
    markers, labels = standing_markers(N)
    write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, markers @ TURN, labels)
    force, moment = standing_wrench(N - 20)
    write_mot(tmp_path / "a.mot", 0.1 + np.arange(N - 20) / 100.0, _columns(force, moment))
    plate = read_recording(tmp_path / "a.trc").plates[0]
    np.testing.assert_array_equal(np.flatnonzero(plate.usable), np.arange(10, N - 10))
    np.testing.assert_allclose(plate.force_N[plate.usable], force, atol=1e-6)


def test_missing_cells_and_header_with_empty_column(tmp_path):
    markers, labels = standing_markers(N)
    markers[5:9, 2] = np.nan
    path = write_trc(
        tmp_path / "a.trc",
        np.arange(N) / 100.0,
        markers @ TURN,
        labels,
        heading="Frame#\tTimes\t\t",
    )
    recording = read_recording(path)
    assert recording.labels == tuple(labels)
    assert np.isnan(recording.markers_m[5:9, 2]).all()
    assert np.isnan(recording.markers_m).sum() == 12


def test_uneven_stamps_are_resampled(tmp_path):
    markers, labels = standing_markers(N)
    true_s = np.arange(N) / 100.0
    stamps = true_s + 0.002 * np.random.default_rng(1).uniform(-1, 1, N)
    markers[:, 7, 0] = 0.2 + 0.5 * stamps
    path = write_trc(tmp_path / "a.trc", stamps, markers @ TURN, labels)
    recording = read_recording(path)
    assert [f.level for f in recording.findings if f.check == "time"] == ["corrected"]
    np.testing.assert_allclose(
        recording.markers_m[:, 7, 0], 0.2 + 0.5 * recording.time_s(), atol=1e-6
    )


def test_torn_stamps_keep_the_longest_stretch(tmp_path):
    markers, labels = standing_markers(N)
    stamps = np.arange(N) / 100.0
    stamps[10:] += 8.5
    recording = read_recording(write_trc(tmp_path / "a.trc", stamps, markers @ TURN, labels))
    assert recording.n_frames == N - 10
    assert recording.time0_s == pytest.approx(8.6)
    assert [f.level for f in recording.findings if f.check == "time"] == ["warning"]
    np.testing.assert_allclose(recording.markers_m, markers[10:], atol=1e-6)


@pytest.mark.parametrize("text", ["", "nothing", "PathFileType\nFrame#\tTime\tA\n\n1\t0\tx\n"])
def test_broken_trc_is_refused(tmp_path, text):
    path = tmp_path / "a.trc"
    path.write_text(text)
    with pytest.raises(BadDataError):
        read_recording(path)


@pytest.mark.parametrize("text", ["", "endheader\n", "endheader\ntime\tx\n0\t1\n0.1\tq\n"])
def test_broken_mot_is_refused(tmp_path, text):
    markers, labels = standing_markers(N)
    path = write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, markers @ TURN, labels)
    (tmp_path / "a.mot").write_text(text)
    with pytest.raises(BadDataError):
        read_recording(path)


@pytest.mark.parametrize("point_scale", [1.0, 1000.0])
@pytest.mark.parametrize("markers_y_up", [True, False])
def test_markers_and_forces_in_other_axes_are_turned_each_in_its_own_way(
    tmp_path, markers_y_up, point_scale
):
    """A conversion may turn a TRC and leave its MOT, or the other way round."""
    markers, labels = standing_markers(N)
    time_s, (force, moment) = np.arange(N) / 100.0, standing_wrench(N)
    write_trc(tmp_path / "a.trc", time_s, markers @ TURN if markers_y_up else markers, labels)
    write_mot(
        tmp_path / "a.mot",
        time_s,
        _columns(force, moment, "numbered", point_scale, not markers_y_up),
    )
    recording = read_recording(tmp_path / "a.trc")
    found = {f.check: f.level for f in recording.findings}
    expected = {"up_axis": "corrected"} | ({"plate_cop": "corrected"} if point_scale != 1 else {})
    assert found == expected
    np.testing.assert_allclose(recording.markers_m, markers, atol=1e-6)
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=1e-6 * force.max())


def test_who_lies_on_the_plates_keeps_the_forces_axes(tmp_path):
    """Head and feet along the laboratory's Z, forces along Y: no conversion."""
    markers, labels = standing_markers(N)
    lying = markers @ np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])
    write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, lying @ TURN, labels)
    force, _ = standing_wrench(N)
    under_the_back = np.cross([0.2, 0.9, 0.0], force)
    columns = _columns(force, under_the_back)
    write_mot(tmp_path / "a.mot", np.arange(N) / 100.0, columns)
    recording = read_recording(tmp_path / "a.trc")
    assert not any(f.check == "up_axis" and f.subject for f in recording.findings)
    np.testing.assert_allclose(recording.rotation_world_lab @ TURN.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("light_N", [12.0, 40.0])
def test_a_missing_point_is_the_nearest_known_one_under_a_light_force_only(tmp_path, light_N):
    markers, labels = standing_markers(N)
    time_s, (force, moment) = np.arange(N) / 100.0, standing_wrench(N)
    columns = _columns(force, moment)
    lifted = slice(50, 60)
    noise = np.random.default_rng(2).normal(0.0, 1.0, (3, 10))
    for axis, value in zip("xyz", noise + np.array([[0.0], [light_N], [0.0]]), strict=True):
        columns[f"ground_force_1_v{axis}"][lifted] = value
        for name in (f"ground_force_1_p{axis}", f"ground_force_1_m{axis}"):
            columns[name][lifted] = np.nan
    write_trc(tmp_path / "a.trc", time_s, markers @ TURN, labels)
    write_mot(tmp_path / "a.mot", time_s, columns)
    (plate,) = read_recording(tmp_path / "a.trc").plates
    if light_N > 20.0:
        assert not plate.usable[lifted].any()
        return
    assert plate.usable[lifted].all()
    held = [49] * 5 + [60] * 5
    np.testing.assert_allclose(plate.cop_m(0.0)[lifted], plate.cop_m(0.0)[held], atol=1e-9)


def test_a_load_without_a_point_is_marked_and_said(tmp_path):
    markers, labels = standing_markers(N)
    time_s, (force, moment) = np.arange(N) / 100.0, standing_wrench(N)
    columns = _columns(force, moment)
    for axis in "xyz":
        columns[f"ground_force_1_p{axis}"][50:60] = 0.0
    write_trc(tmp_path / "a.trc", time_s, markers @ TURN, labels)
    write_mot(tmp_path / "a.mot", time_s, columns)
    recording = read_recording(tmp_path / "a.trc")
    (plate,) = recording.plates
    assert np.flatnonzero(~plate.usable).tolist() == list(range(50, 60))
    assert any(
        f"10 of {N} samples have a force and no point" in f.found for f in recording.findings
    )


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
