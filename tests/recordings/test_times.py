"""Time stamps as files print them: coarse, in other units, counted, of another clock."""

from __future__ import annotations

import tracemalloc

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

N = 400
FORCE = [f"ground_force_{what}{axis}" for what in "vpm" for axis in "xyz"]


def _trc(tmp_path, stamps, stated_hz=100.0, header=lambda text: text):
    """Markers whose last one has moved by its frame's number in mm; ``stamps`` are cells."""
    markers, labels = standing_markers(N)
    markers[:, 7, 0] = 1e-3 * np.arange(N)
    markers = markers @ Y_UP_FROM_Z_UP.T
    path = write_trc(tmp_path / "a.trc", stamps, markers, labels, rate_hz=stated_hz)
    path.write_text(header(path.read_text()))
    return path


def _mot(tmp_path, stamps):
    force, _ = standing_wrench(len(stamps))
    point = np.array([0.2, 0.0, -0.3])  # between the feet, Y up
    columns = np.hstack([force[:, [0, 2, 1]], point + 0 * force, 0 * force])
    return write_mot(tmp_path / "a.mot", stamps, dict(zip(FORCE, columns.T, strict=True)))


def _said(recording) -> list[tuple[str, str]]:
    return [(f.found, f.action) for f in recording.findings if f.check in ("time", "rate")]


def _is_whole(recording, rate_hz, start_s, within_s):
    """All frames, each once, at this rate from this time on."""
    assert recording.n_frames == N
    assert recording.marker_rate_hz == pytest.approx(rate_hz, rel=1e-5)
    assert recording.time0_s == pytest.approx(start_s, abs=within_s)
    np.testing.assert_allclose(recording.markers_m[:, 7, 0], 1e-3 * np.arange(N), atol=1e-9)


@pytest.mark.parametrize(
    ("rate_hz", "digits"),
    [
        (120, 2),
        (240, 2),
        (240, 3),
        (1000 / 3, 3),
        (59.94, 2),
        (59.94, 3),
        (60, 2),
        (500, 2),
        (85, 3),
        (100, 6),
        (250, 4),
        (119.88, 2),
    ],
)
@pytest.mark.parametrize("start_s", [0.0, 12.34, 43_217.508])
@pytest.mark.parametrize("is_cut", [False, True])
def test_stamps_within_their_last_digit_are_even(tmp_path, rate_hz, digits, start_s, is_cut):
    times = start_s + np.arange(N) / rate_hz
    if is_cut:
        times = np.floor(times * 10**digits + 1e-6) / 10**digits
    recording = read_recording(_trc(tmp_path, [f"{t:.{digits}f}" for t in times], rate_hz))
    _is_whole(recording, rate_hz, start_s, 10.0**-digits)
    assert _said(recording) == []


@pytest.mark.parametrize(("true_hz", "stated_hz"), [(59.94, 60), (100, 120), (1000 / 3, 300)])
def test_the_stamps_own_rate_where_the_stated_one_cannot_be(tmp_path, true_hz, stated_hz):
    stamps = [f"{k / true_hz:.4f}" for k in range(N)]
    recording = read_recording(_trc(tmp_path, stamps, stated_hz))
    _is_whole(recording, true_hz, 0.0, 1e-3)
    ((found, action),) = _said(recording)
    assert f"the header says {stated_hz} Hz" in found and action == "took the time stamps"


@pytest.mark.parametrize("stated", ["", "0", "unknown"])
def test_without_a_stated_rate(tmp_path, stated):
    stamps = [f"{k / 120:.2f}" for k in range(N)]
    path = _trc(
        tmp_path, stamps, 120.0, lambda text: text.replace("120\t120", f"{stated}\t{stated}")
    )
    _is_whole(read_recording(path), 120.0, 0.0, 0.01)


def test_single_precision_of_a_time_of_day(tmp_path):
    stamps = [f"{np.float32(43_200 + k / 100):.6f}" for k in range(N)]
    recording = read_recording(_trc(tmp_path, stamps, 100.0))
    _is_whole(recording, 100.0, 43_200.0, 0.01)
    assert _said(recording) == []


@pytest.mark.parametrize("digits", [2, 3])
def test_coarse_stamps_that_are_torn(tmp_path, digits):
    times = np.arange(N) / 240 + np.where(np.arange(N) < 100, 0, 5.0)
    recording = read_recording(_trc(tmp_path, [f"{t:.{digits}f}" for t in times], 240.0))
    assert recording.n_frames == N - 100 and recording.marker_rate_hz == 240.0
    assert recording.time0_s == pytest.approx(times[100], abs=10.0**-digits)
    np.testing.assert_allclose(recording.markers_m[:, 7, 0], 1e-3 * np.arange(100, N), atol=1e-6)
    assert [f.level for f in recording.findings if f.check == "time"] == ["warning"]


UNITS = {
    "ms": (1e3, "in ms", 3),
    "microseconds": (1e6, "in microseconds", 0),
    "whole ms": (1e3, "in ms", 0),
}


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("rate_hz", [100.0, 120.0, 250.0, 59.94])
@pytest.mark.parametrize("start_s", [0.0, 3.25])
def test_ms_and_microseconds(tmp_path, unit, rate_hz, start_s):
    size, said, digits = UNITS[unit]
    stamps = [f"{size * (start_s + k / rate_hz):.{digits}f}" for k in range(N)]
    recording = read_recording(_trc(tmp_path, stamps, rate_hz))
    _is_whole(recording, rate_hz, start_s, 1e-3)
    assert [found for found, _ in _said(recording)] == [f"time stamps {said}"]


@pytest.mark.parametrize(("first", "start_s"), [(0, 0.0), (1, 0.0), (251, 2.5)])
def test_numbers_of_frames(tmp_path, first, start_s):
    recording = read_recording(_trc(tmp_path, [f"{first + k}" for k in range(N)]))
    _is_whole(recording, 100.0, start_s, 1e-9)
    assert [found for found, _ in _said(recording)] == ["time stamps that count frames"]


def test_every_second_frame_of_an_original_rate(tmp_path):
    def with_original(text):
        text = text.replace("Units\n", "Units\tOrigDataRate\n", 1)
        return text.replace("\tmm\n", "\tmm\t200\n", 1)

    recording = read_recording(
        _trc(tmp_path, [f"{1 + 2 * k}" for k in range(N)], 100.0, with_original)
    )
    _is_whole(recording, 100.0, 0.0, 1e-9)
    sound = read_recording(
        _trc(tmp_path, [f"{k / 100:.2f}" for k in range(N)], 100.0, with_original)
    )
    assert _said(sound) == []


def test_numbers_of_frames_without_a_rate_are_refused(tmp_path):
    path = _trc(tmp_path, [f"{k}" for k in range(N)], 0.0)
    with pytest.raises(BadDataError, match="times that count frames, and no DataRate"):
        read_recording(path)


def test_stamps_that_are_all_alike(tmp_path):
    recording = read_recording(_trc(tmp_path, ["0.00"] * N, 120.0))
    _is_whole(recording, 120.0, 0.0, 1e-9)
    assert _said(recording) == [
        (f"all {N} time stamps are 0", "took 120 Hz, as the header says, and its number of frames")
    ]
    path = _trc(tmp_path, ["0.00"] * N, 120.0, lambda text: text.replace(f"\t{N}\t", "\t999\t", 1))
    with pytest.raises(BadDataError, match="do not increase evenly"):
        read_recording(path)


def _pair(tmp_path, force_stamps, start_s=0.0):
    _mot(tmp_path, force_stamps)
    return read_recording(_trc(tmp_path, [f"{start_s + k / 100:.2f}" for k in range(N)]))


def _height(recording) -> np.ndarray:
    return recording.plates[0].force_N[:, 2]


@pytest.mark.parametrize(
    ("stamp", "said"),
    [
        (lambda k: f"{k:.1f}", "that count rows"),  # ms of 1000 Hz are rows too
        (lambda k: f"{k}", "that count rows"),
        (lambda k: f"{k + 1}", "that count rows"),
        (lambda k: f"{1000 * k}", "in microseconds: 1000 from row to row"),
    ],
)
@pytest.mark.parametrize("start_s", [0.0, 12.3])
def test_other_units_of_the_forces_times(tmp_path, stamp, said, start_s):
    recording = _pair(tmp_path, [stamp(k) for k in range(10 * N)], start_s)
    force, _ = standing_wrench(10 * N)
    assert recording.analog_rate_hz == pytest.approx(1000.0)
    np.testing.assert_allclose(_height(recording), force[: 10 * N - 9, 2], atol=1e-6)
    assert f"times of the forces {said}" in [found for found, _ in _said(recording)]


@pytest.mark.parametrize("rate_hz", [200.0, 500.0, 2000.0, 1500.0])
def test_forces_in_ms_at_any_rate(tmp_path, rate_hz):
    n = int(rate_hz * N / 100)
    recording = _pair(tmp_path, [f"{1000 * k / rate_hz:.4f}" for k in range(n)])
    assert recording.analog_rate_hz == pytest.approx(rate_hz)
    assert recording.plates[0].usable.all()
    assert _said(recording)[0][1] == "read them in ms"


@pytest.mark.parametrize(("first", "n_rows"), [(0, 3500), (1, 4300), (0, 700)])
def test_rows_counted_at_no_rate_are_no_times(tmp_path, first, n_rows):
    recording = _pair(tmp_path, [f"{first + k}" for k in range(n_rows)])
    assert recording.plates == () and f"count {n_rows} rows" in recording.forces_note


def test_whole_ms_that_begin_with_the_markers(tmp_path):
    recording = _pair(tmp_path, [f"{12_300 + k}" for k in range(3500)], 12.3)
    assert recording.analog_rate_hz == 1000.0
    assert recording.plates[0].usable.mean() == pytest.approx(3500 / 3991, abs=0.01)


@pytest.mark.parametrize("digits", [2, 3])
def test_coarse_stamps_of_the_forces(tmp_path, digits):
    recording = _pair(tmp_path, [f"{k / 1200:.{digits}f}" for k in range(12 * N)])
    force, _ = standing_wrench(12 * N)
    assert recording.analog_rate_hz == pytest.approx(1200.0)
    np.testing.assert_allclose(_height(recording), force[: 12 * N - 11, 2], atol=0.05)
    assert _said(recording) == []


def test_another_zero_of_the_forces_is_corrected_where_it_is_certain(tmp_path):
    recording = _pair(tmp_path, [f"{k / 1000:.3f}" for k in range(10 * N)], 12.3)
    assert recording.plates[0].usable.all()
    ((found, action),) = _said(recording)
    assert (
        found == "forces at 0 to 3.999 s and markers at 12.3 to 16.29 s: as long, and never at once"
    )
    assert action == "took their first samples as simultaneous"


def test_torn_forces_from_another_zero_keep_their_place(tmp_path):
    times = np.arange(3500) / 1000 + np.where(np.arange(3500) < 1000, 0, 0.5)
    plate = _pair(tmp_path, [f"{t:.3f}" for t in times], 12.3).plates[0]
    force, _ = standing_wrench(3500)
    np.testing.assert_array_equal(np.flatnonzero(plate.usable), np.arange(1500, 3991))
    np.testing.assert_allclose(plate.force_N[1500:, 2], force[1000:3491, 2], atol=1e-6)


@pytest.mark.parametrize(("n_rows", "start_s"), [(2000, 12.3), (9000, 12.3)])
def test_another_zero_that_is_not_certain_is_said(tmp_path, n_rows, start_s):
    recording = _pair(tmp_path, [f"{k / 1000:.3f}" for k in range(n_rows)], start_s)
    assert recording.plates == ()
    assert "and markers at 12.3 to 16.29 s" in recording.forces_note


@pytest.mark.parametrize("start_s", [0.5, 1.0, 3.2])
def test_files_cut_alike_whose_stamps_were_not_zeroed_alike(tmp_path, start_s):
    """As long to a row, and partly at once: cut together, so the first samples belong together."""
    recording = _pair(tmp_path, [f"{k / 1000:.3f}" for k in range(10 * N)], start_s)
    force, _ = standing_wrench(10 * N)
    assert recording.plates[0].usable.all()
    np.testing.assert_allclose(_height(recording), force[: 10 * N - 9, 2], atol=1e-6)
    ((found, action),) = _said(recording)
    times = f"forces at 0 to 3.999 s and markers at {start_s:g} to {start_s + 3.99:g} s"
    assert found == f"{times}: as long, but not from one zero"
    assert action.startswith("took their first samples as simultaneous")


@pytest.mark.parametrize("n_rows", [3500, 4500])
def test_forces_that_cover_a_part_are_said_with_both_times(tmp_path, n_rows):
    recording = _pair(tmp_path, [f"{k / 1000:.3f}" for k in range(n_rows)], 1.0)
    assert recording.plates[0].usable.mean() == pytest.approx((n_rows - 1000) / 3991, abs=0.01)
    (finding,) = [f for f in recording.findings if f.check == "analog_nan"]
    assert f"1 to 4.99 s (the file has 0 to {(n_rows - 1) / 1000:g} s)" in finding.expected


@pytest.mark.parametrize(
    "stamp", [lambda k: f"{20 * k}", lambda k: f"{20_000 * k}", lambda k: f"{k}"]
)
def test_no_grid_is_longer_than_both_files(tmp_path, stamp):
    """8 s of markers ask for eight times the forces' rows, and each is held in some readings: 25
    times the files, however long they are. Twice as long a grid would go beyond 30."""
    _mot(tmp_path, [f"{k / 2000:.4f}" for k in range(2000)])
    path = _trc(tmp_path, [stamp(k) for k in range(N)], 50.0)
    read_recording(path)
    tracemalloc.start()
    try:
        recording = read_recording(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert recording.marker_rate_hz == 50.0
    assert recording.plates
    assert peak < 30 * (path.stat().st_size + (tmp_path / "a.mot").stat().st_size)


@pytest.mark.parametrize(
    ("case", "task", "rate_hz", "n_frames"),
    [
        ("10a-trc-time-2-decimals-120Hz", "squat_run-1", 120.0, 406),
        ("10h-trc-time-3-decimals-240Hz", "squat_run-1", 240.0, 360),
        ("10g-trc-time-in-ms-long", "static", 50.0, 600),
    ],
)
def test_the_cases_of_stamps(shared_cases, case, task, rate_hz, n_frames):
    recording = read_recording(shared_cases / case / f"study/sub-01/sub-01_task-{task}.trc")
    assert (recording.marker_rate_hz, recording.n_frames) == (rate_hz, n_frames)
    assert len(recording.plates[0].force_N) < 24_000
