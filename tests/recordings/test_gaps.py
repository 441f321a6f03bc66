"""Points that were not seen, as files write them; frames that repeat; gaps that are filled."""

from __future__ import annotations

import ezc3d
import numpy as np
import pytest
from scipy.signal import butter, filtfilt
from scipy.spatial.transform import Rotation

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.gaps import (
    fill_gaps,
    held_markers,
    repeated_frames,
    without_absurd,
    without_repeats,
    without_sentinels,
)
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.read import read_recording
from tests.recordings.recording_writers import standing_markers, write_c3d, write_trc

N, K = 240, 12


def _walking(noise_m=2e-4, digit_m=0.0, seed=1) -> np.ndarray:
    """A person of 12 markers who walks 2.4 m/s forward and up and down; (N, K, 3)."""
    rng = np.random.default_rng(seed)
    frame = np.arange(N)[:, None, None]
    body = rng.uniform([0, 0, 0], [0.5, 0.5, 1.7], (K, 3))
    path = frame * [0.01, 0, 0] + 0.03 * np.sin(frame / 15) * np.array([0, 0.3, 1])
    markers = body + path + rng.normal(0, noise_m, (N, K, 3))
    return np.round(markers / digit_m) * digit_m if digit_m else markers


SIGNS = {
    "-16512": (-16512,) * 3,
    "-9999": (-9999,) * 3,
    "9999999": (9999999,) * 3,
    "1e7": (1e7,) * 3,
    "-32768 counts of 0.1": (-3276.8,) * 3,
    "one axis": (0, 0, -16512),
    "two axes": (1e7, 1e7, 0),
}


@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize("share", [0.002, 0.1, 0.6])
def test_signs_for_a_missing_point_are_gaps(sign, share):
    markers = 1000 * _walking()
    lost = np.random.default_rng(3).random(markers.shape[:2]) < share
    lost[5, :2] = True
    written = np.where(lost[..., None], SIGNS[sign], markers)
    (finding,) = without_sentinels(written)
    np.testing.assert_array_equal(np.isnan(written).all(axis=-1), lost)
    np.testing.assert_array_equal(written[~lost], markers[~lost])
    assert f"{lost.sum()} positions of" in finding.found and finding.level == "corrected"


def test_a_marker_that_is_never_seen():
    markers = 1000 * _walking()
    markers[:, 3] = -9999
    without_sentinels(markers)
    assert np.isnan(markers[:, 3]).all() and np.isnan(markers).sum() == 3 * N


@pytest.mark.parametrize("unit", [1.0, 1000.0])
@pytest.mark.parametrize("digit", [0.0, 1e-3, 1e-2])
def test_markers_of_a_person_are_no_signs(unit, digit):
    """Not if coordinates are coarse, alike by chance, far away, or a marker is listed twice."""
    markers = _walking(digit_m=digit)
    markers[:, 4] = markers[:, 5]
    markers[10, 2] = 0.7
    markers[30, 2] = [12.0, 3.0, 5.5]
    written = unit * markers
    assert without_sentinels(written) == []
    np.testing.assert_array_equal(written, unit * markers)


@pytest.mark.parametrize("sign", [-16512.0, -9999.0, 9999999.0])
def test_signs_in_a_trc_do_not_spoil_the_unit(tmp_path, sign):
    markers, labels = standing_markers(N)
    written = markers.copy()
    written[:, 2] = written[40:50, 5] = 1e-3 * sign
    path = write_trc(tmp_path / "a.trc", np.arange(N) / 100.0, written, labels)
    path.write_text(path.read_text().replace("\tmm\n", "\t\n"))
    recording = read_recording(path)
    kept = np.isfinite(recording.markers_m).all(axis=-1)
    assert not kept[:, 2].any() and not kept[40:50, 5].any() and kept.sum() == 7 * N - 10
    np.testing.assert_allclose(recording.markers_m[kept], markers[kept], atol=1e-6)


def test_a_sign_among_model_outputs_in_a_c3d(tmp_path):
    """Moments in N mm are no places: they do not make the laboratory larger."""
    markers, labels = standing_markers(N)
    outputs = np.tile([800.0, -300.0, 55.0], (N, 1, 1))
    points = np.concatenate([markers, outputs], axis=1)
    points[60:70, 1] = -16.512
    recording = read_recording(write_c3d(tmp_path / "a.c3d", points, [*labels, "LHipMoment"]))
    np.testing.assert_array_equal(
        np.isnan(recording.markers_m[..., 0]).nonzero()[0], np.arange(60, 70)
    )


@pytest.mark.parametrize("at", [0.0, -1.0, 5.0])
@pytest.mark.parametrize("hz", [3.0, 6.0, 100.0])
@pytest.mark.parametrize("away", [(3,), (3, 7)])
def test_gaps_that_were_filled_and_filtered_are_gaps(at, hz, away):
    markers = _walking()
    written = markers.copy()
    written[100:115, away] = at
    if hz < 50:
        written[:, away] = filtfilt(*butter(2, hz / 50), written[:, away], axis=0)
    wrong_m = np.linalg.norm(written - markers, axis=-1)
    (finding,) = without_absurd(written)
    lost = np.isnan(written).all(axis=-1)
    assert np.isnan(written).sum() == 3 * lost.sum() and wrong_m[~lost].max() < 0.1
    assert lost[100:115, away].all() and not lost[:70].any() and not lost[145:].any()
    assert f"{lost.sum()} positions of {len(away)} markers" in finding.found


def test_who_only_bears_another_ones_label_or_rises_after_long_rest_is_on_the_body():
    markers = _walking()
    markers[100:115, [3, 7]] = markers[100:115, [7, 3]]
    assert without_absurd(markers) == []
    still = np.repeat(_walking()[:1], 1200, axis=0)
    still += np.random.default_rng(1).normal(0, 2e-4, still.shape)
    legs = still[1150:, 6:]
    legs += np.linspace(0, 0.4, 50)[:, None, None] * [0, 0, 1]
    assert without_absurd(still) == []


def _held(markers, marker, start, stop):
    markers[start:stop, marker] = markers[start - 1, marker]
    wanted = np.zeros(markers.shape[:2], bool)
    wanted[start:stop, marker] = True
    return wanted


@pytest.mark.parametrize("digit_m", [0.0, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize(("start", "stop"), [(50, 53), (50, 80), (100, 200)])
def test_a_held_marker_among_moving_ones(digit_m, start, stop):
    markers = _walking(digit_m=digit_m)
    wanted = _held(markers, 4, start, stop)
    np.testing.assert_array_equal(held_markers(markers), wanted)


def test_two_that_are_held_at_once_one_into_a_gap_and_one_to_the_end():
    markers = _walking()
    wanted = _held(markers, 4, 60, 90) | _held(markers, 7, 70, 100) | _held(markers, 9, 200, N)
    markers[90:95, 4] = np.nan
    np.testing.assert_array_equal(held_markers(markers), wanted)


@pytest.mark.parametrize("digit_m", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("noise_m", [0.0, 2e-5, 2e-4])
def test_a_foot_on_the_ground_is_not_held(digit_m, noise_m):
    """It stands while the body moves on, and then leaves smoothly: also in coarse numbers."""
    markers = _walking(noise_m=noise_m)
    frame = np.arange(N)
    swing = np.clip(frame - 100, 0, 40) / 40
    foot = 0.6 * (1 - np.cos(np.pi * swing)) / 2
    noise = np.random.default_rng(5).normal(0, noise_m, (N, 3, 3))
    for k, place in enumerate(([0.2, 0, 0.05], [0.3, 0, 0.03], [0.2, 0.1, 0.1])):
        markers[:, k] = place + np.outer(foot, [1, 0, 0]) + noise[:, k]
    markers = np.round(markers / digit_m) * digit_m
    assert not held_markers(markers).any()


def test_a_marker_that_never_moves_is_left_alone_where_it_is_no_float():
    markers = _walking(digit_m=1e-3)
    markers[:, 6] = markers[0, 6]
    assert not held_markers(markers).any()


def test_held_markers_are_gaps_and_named(tmp_path):
    markers = _walking()
    _held(markers, 4, 60, 90)
    recording = read_recording(write_c3d(tmp_path / "a.c3d", markers, [f"M{k}" for k in range(K)]))
    marked, (finding,) = without_repeats(recording)
    assert finding.check == "held_markers" and "M4 at 0.60 to 0.89 s" in finding.found
    assert np.isnan(marked.markers_m[..., 0]).sum() == 30


def _all_invalid(path, points):
    """The file written anew with residual -1 everywhere: ezc3d itself would leave values out."""
    write_c3d(path, points, [f"M{k}" for k in range(points.shape[1])])
    content = bytearray(path.read_bytes())
    start = (int.from_bytes(content[16:18], "little") - 1) * 512
    words = np.frombuffer(bytes(content[start:]), "<f4").copy()
    n = points.shape[0] * points.shape[1] * 4
    words[3:n:4] = -1
    content[start:] = words.tobytes()
    path.write_bytes(bytes(content))
    assert np.isnan(ezc3d.c3d(str(path))["data"]["points"][:3]).all()
    return path


@pytest.mark.parametrize("points", ["standing", "walking", "coarse", "with gaps"])
def test_all_points_invalid_but_those_of_a_person(tmp_path, points):
    markers = {
        "standing": 0.3 + 1e-2 * _walking()[:1] + _walking() * [0, 0, 1],
        "walking": _walking(),
        "coarse": _walking(digit_m=1e-3),
        "with gaps": np.where(np.arange(N)[:, None, None] % 50 < 5, 0.0, _walking()),
    }[points]
    recording = read_recording(_all_invalid(tmp_path / "a.c3d", markers))
    seen = (markers != 0).any(axis=-1)
    np.testing.assert_allclose(recording.markers_m[seen], markers[seen], atol=1e-6)
    assert np.isnan(recording.markers_m[~seen]).all()
    (finding,) = [f for f in recording.findings if f.check == "points"]
    assert finding.level == "warning" and "all 12 points are marked invalid" in finding.found


@pytest.mark.parametrize("points", ["constant", "noise", "one place", "too large"])
def test_all_points_invalid_and_no_person(tmp_path, points):
    rng = np.random.default_rng(4)
    markers = {
        "constant": np.tile(_walking()[:1], (N, 1, 1)),
        "noise": rng.uniform(0, 1.7, (N, K, 3)),
        "one place": np.tile(_walking()[:, :1], (1, K, 1)),
        "too large": 15 * _walking(),
    }[points]
    with pytest.raises(BadDataError, match=r"all 12 points are marked invalid \(residual -1\)"):
        read_recording(_all_invalid(tmp_path / "a.c3d", markers))


def test_the_case_of_minus_16512(shared_cases):
    folder = shared_cases / "12-missing-as-minus-16512/study/sub-01"
    recording = read_recording(folder / "sub-01_task-squat_run-1.c3d")
    assert np.nanmin(recording.markers_m) > -1
    assert any("(-16512, -16512, -16512)" in f.found for f in recording.findings)


def test_the_case_of_residuals(shared_cases):
    folder = shared_cases / "23-all-residuals-minus-one/study/sub-01"
    recording = read_recording(folder / "sub-01_task-squat_run-1.c3d")
    assert np.isfinite(recording.markers_m).all(axis=-1).mean() > 0.99
    assert any("marked invalid (residual -1)" in f.found for f in recording.findings)


def _standing(quantum_m: float, noise_m: float) -> np.ndarray:
    rng = np.random.default_rng(2)
    markers = rng.normal(0, 1, (K, 3)) + rng.normal(0, noise_m, (N, K, 3))
    return np.round(markers / quantum_m) * quantum_m


def test_bursts_are_found_to_the_frame():
    markers = _walking()
    lost = np.zeros(N, bool)
    for start, stop in ((20, 21), (40, 47), (120, 180)):
        markers[start:stop] = markers[start - 1]
        lost[start:stop] = True
    found = repeated_frames(markers)
    np.testing.assert_array_equal(found.all(axis=1), lost)
    np.testing.assert_array_equal(found.any(axis=1), lost)


def test_a_frozen_end_and_a_halved_rate():
    markers = _walking()
    markers[150:] = markers[149]
    assert repeated_frames(markers).all(axis=1).sum() == N - 150
    twice = np.repeat(_walking(), 2, axis=0)
    np.testing.assert_array_equal(repeated_frames(twice).all(axis=1), np.arange(2 * N) % 2 == 1)


@pytest.mark.parametrize("quantum_m", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("noise_m", [1e-5, 1e-4, 5e-4])
def test_still_quantised_markers_are_no_repeats(quantum_m, noise_m):
    assert not repeated_frames(_standing(quantum_m, noise_m)).any()


def test_a_person_who_starts_from_still_quantised_standing():
    still, moving = _standing(1e-3, 1e-5), _walking()
    markers = np.concatenate([still, still[-1] + moving - moving[0]])
    assert not repeated_frames(markers).any()


def test_one_frozen_marker_and_few_markers_are_left_alone():
    markers = _walking()
    markers[50:60, 3] = markers[49, 3]
    assert not repeated_frames(markers).any()
    markers[50:60] = markers[49]
    assert not repeated_frames(markers[:, :3]).any()


def test_the_one_marker_that_was_seen_anew_stays():
    markers = _walking()
    markers[50:60, 1:] = markers[49, 1:]
    markers[:, 5] = np.nan
    found = repeated_frames(markers)
    assert not found[:, [0, 5]].any()
    assert found[50:60, 1:5].all() and found.sum() == 10 * (K - 2)


def test_repeats_are_gaps_and_said(tmp_path):
    markers = _walking()
    labels = [f"M{k}" for k in range(K)]
    sound = read_recording(write_c3d(tmp_path / "sound.c3d", markers, labels))
    assert without_repeats(sound) == (sound, [])
    for start, stop in ((20, 27), (120, 160)):
        markers[start:stop] = markers[start - 1]
    stalled = read_recording(write_c3d(tmp_path / "stalled.c3d", markers, labels))
    marked, (finding,) = without_repeats(stalled)
    gaps = np.isnan(marked.markers_m).all(axis=(1, 2))
    assert np.flatnonzero(gaps).tolist() == [*range(20, 27), *range(120, 160)]
    assert finding.level == "corrected" and f"47 of {N} frames" in finding.found
    assert "at 0.20" in finding.found


@pytest.mark.parametrize("outputs", [0, 3])
def test_markers_that_are_held_all_through_a_walk(outputs):
    """Beside numbers that are no places and hardly change, and that lie nearest to them."""
    way = np.array([0.01, 0.0, 0.0]) * np.arange(N)[:, None, None]
    scalars = np.random.default_rng(3).normal(0.0, 1e-4, (N, outputs, 3))
    markers = np.concatenate([_walking() + way, scalars], axis=1)
    markers[:, :2] = markers[0, :2]
    held = held_markers(markers)
    assert held[1:, :2].all() and not held[:, 2:].any()


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "n_frames"),
    [
        ("edge_btk/badParameterOffset.c3d", 45),
        ("pycgm/Sample_Static.c3d", 0),
        ("btk_functional_ll/FunctionalStatic.c3d", 0),
        ("edge_ezc3d/FP_Type1.c3d", 0),
        ("type3_qualisys_c3dorg26/Capture0008_Standing.c3d", 0),
    ],
)
def test_repeats_in_real_recordings(real_data, name, n_frames):
    repeated = repeated_frames(read_recording(real_data / name).markers_m)
    assert repeated.any(axis=1).sum() == n_frames


RATE_HZ = 100.0


def _rigid_body(n: int = 200) -> np.ndarray:
    """Four markers of one rigid body in fast motion, (n, 4, 3)."""
    t = np.arange(n) / RATE_HZ
    local = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0.05, 0.05, 0.1]])
    turn = Rotation.from_rotvec(np.column_stack([np.sin(5 * t), 2 * np.sin(3 * t), t]))
    path = np.column_stack([0.5 * np.sin(4 * t), t, 1 + 0.1 * np.cos(9 * t)])
    return np.einsum("nij,kj->nki", turn.as_matrix(), local) + path[:, None]


def test_rigid_segment_is_exact():
    truth = _rigid_body()
    holed = truth.copy()
    holed[50:80, 3] = np.nan
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.0, max_rigid_gap_s=0.5)
    np.testing.assert_allclose(result.markers_m, truth, atol=1e-12)
    assert result.filled.sum() == 30 and result.rigid.sum() == 30
    assert result.filled[50:80, 3].all()


def test_spline_where_the_segment_cannot_help():
    truth = _rigid_body()
    holed = truth.copy()
    holed[50:58, 3] = holed[50:58, 2] = np.nan
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.2, max_rigid_gap_s=0.2)
    assert not result.rigid.any() and result.filled.sum() == 16
    assert np.abs(result.markers_m - truth).max() < 5e-4


def test_the_segment_bridges_what_the_spline_must_leave():
    holed = _rigid_body()
    holed[50:70, 3] = np.nan  # its mates are seen
    holed[100:120, :] = np.nan  # nothing is
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.1, max_rigid_gap_s=0.3)
    assert result.rigid[50:70, 3].all() and result.rigid.sum() == result.filled.sum() == 20
    assert np.isnan(result.markers_m[100:120]).all()


def test_limits_hold_to_the_frame():
    for frames, expected in ((10, True), (11, False)):
        holed = _rigid_body()
        holed[50 : 50 + frames, 3] = np.nan
        result = fill_gaps(holed, RATE_HZ, [], max_gap_s=0.1, max_rigid_gap_s=0.5)
        assert result.filled.any() == expected


def test_markers_on_a_line_give_no_orientation():
    truth = _rigid_body()
    truth[:, 2] = 2 * truth[:, 1] - truth[:, 0]
    holed = truth.copy()
    holed[50:55, 3] = np.nan
    result = fill_gaps(holed, RATE_HZ, [[0, 1, 2, 3]], max_gap_s=0.2, max_rigid_gap_s=0.2)
    assert not result.rigid.any() and result.filled.sum() == 5


def test_long_gaps_and_ends_stay():
    holed = _rigid_body()
    holed[:10, 0] = holed[-10:, 1] = holed[60:90, 2] = np.nan
    result = fill_gaps(holed, RATE_HZ, [], max_gap_s=0.2, max_rigid_gap_s=0.2)
    assert not result.filled.any()
    np.testing.assert_array_equal(result.markers_m, holed)


def _worst_mm(path, length_s: float, by_segment: bool) -> float:
    """Median over 40 gaps of the largest error within each."""
    recording, marker_set = read_recording(path), load_marker_set("opencap_subject4")
    match = match_labels(recording.labels, marker_set.wanted())
    members = [m for m in marker_set.markers if m.label in match.index]
    truth = recording.markers_m[:, [match.index[m.label] for m in members]]
    groups = [
        [k for k, m in enumerate(members) if m.segment == segment]
        for segment in dict.fromkeys(m.segment for m in members)
    ]
    mated = [k for group in groups if len(group) > 3 for k in group]
    rng, frames = np.random.default_rng(3), round(length_s * recording.marker_rate_hz)
    errors = []
    for _ in range(40):
        k, start = rng.choice(mated), rng.integers(20, len(truth) - frames - 20)
        part = slice(start, start + frames)
        holed = truth.copy()
        holed[part, k] = np.nan
        limits = (0.0, 1.0) if by_segment else (1.0, 0.0)
        filled = fill_gaps(holed, recording.marker_rate_hz, groups, *limits)
        if filled.filled[part, k].all():
            errors.append(1000 * np.linalg.norm(filled.markers_m - truth, axis=-1)[part, k].max())
    assert len(errors) > 10
    return float(np.median(errors))


@pytest.mark.real
@pytest.mark.parametrize(
    ("trial", "length_s", "by_segment", "least_mm", "most_mm"),
    [
        ("squats1", 0.1, False, 0, 2),
        ("squats1", 0.5, True, 0, 5),
        ("DJ1", 0.5, False, 20, np.inf),  # beyond a spline, not beyond the segment
        ("DJ1", 0.5, True, 0, 8),
    ],
)
def test_gaps_cut_into_real_recordings(real_data, trial, length_s, by_segment, least_mm, most_mm):
    worst_mm = _worst_mm(real_data / f"opencap_subject4/{trial}.trc", length_s, by_segment)
    assert least_mm < worst_mm < most_mm


def test_a_hand_that_long_rests_at_the_trunk_keeps_its_only_marker():
    """Nine of the trunk lie nearer than the elbow, from which alone it stays as far."""
    t = np.arange(2000) / 100.0
    trunk = np.array([[0.05 * (k % 3), 0.05 * (k // 3), 1.2] for k in range(9)])
    raised = np.clip((t - 17.0) / 0.5, 0.0, 1.0)[:, None] * np.array([0.0, 0.4, 0.5])
    elbow = np.array([0.2, -0.2, 1.1]) + raised
    wrist = np.array([0.05, 0.05, 1.1]) + raised
    markers = np.concatenate([np.tile(trunk, (2000, 1, 1)), elbow[:, None], wrist[:, None]], axis=1)
    markers[..., 0] += 0.3 * np.sin(t)[:, None]
    before = markers.copy()
    assert without_absurd(markers) == []
    np.testing.assert_array_equal(markers, before)


def test_a_marker_that_falls_off_costs_no_frames_before():
    walked = np.arange(900)[:, None, None] * np.array([0.01, 0.0, 0.0])
    markers = _walking()[:1] + walked + 0.002 * np.sin(np.arange(900))[:, None, None]
    fell = 800
    markers[fell:, 5] = markers[fell, 5] - [0.0, 0.0, 0.5]
    without_absurd(markers)
    assert not np.isnan(markers[:fell]).any()
