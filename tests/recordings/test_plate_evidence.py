"""What the feet, the weight and the neighbours of a sample say about plates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.recordings.analog import check_samples, spike_samples
from bsip_cli.recordings.model import Plate, Recording
from bsip_cli.recordings.plate_reading import AS_STATED
from bsip_cli.recordings.plate_wrench import nobody_near, plate_zero
from bsip_cli.recordings.plates import PlateDescription, wrench_matrix
from bsip_cli.recordings.plates_of_files import C3dPlate
from bsip_cli.recordings.read import lost_zeros, read_recording, sign_doubts
from tests.circumstances.sound import sound_session
from tests.recordings import standing_on_two_plates as trials
from tests.recordings.recording_writers import (
    CORNERS_M,
    PlateSpec,
    standing_markers,
    standing_wrench,
    write_c3d,
)

N, RATIO = 60, 10
RATE_HZ = 1000.0


def _read(tmp_path, *specs: PlateSpec, **options) -> Recording:
    markers, labels = standing_markers(N)
    return read_recording(write_c3d(tmp_path / "a.c3d", markers, labels, specs, **options))


def _found(recording: Recording, check: str) -> list[tuple[str, str]]:
    return [(f.level, f.action) for f in recording.findings if f.check == check]


def _swaying(place_m: list[float]) -> np.ndarray:
    """A centre of pressure that moves as a standing person's does, (n, 3)."""
    t = np.linspace(0, 6, N * RATIO)
    return place_m + 0.006 * np.column_stack([np.sin(t), np.cos(1.3 * t), 0 * t])


def _rotated(points: np.ndarray, axis: int, angle_rad: float) -> np.ndarray:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned = points.copy()
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    turned[..., i], turned[..., j] = (
        c * points[..., i] - s * points[..., j],
        s * points[..., i] + c * points[..., j],
    )
    return turned


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_raised_and_tilted_plates_keep_the_wrench(tmp_path, kind):
    force, moment = standing_wrench(N * RATIO)
    corners = _rotated(CORNERS_M, 0, 0.05) + np.array([0, 0, 0.02])
    origin = np.array([0.12, 0.2, -0.05]) if kind == 3 else np.array([0.0, 0.0, -0.04])
    if kind == 1:  # knows a free moment about its own normal only
        corners = CORNERS_M + np.array([0, 0, 0.02])
    spec = PlateSpec(force, moment, kind=kind, corners_m=corners, origin_m=origin)
    plate = _read(tmp_path, spec).plates[0]
    np.testing.assert_allclose(plate.force_N, force, atol=0.01)
    np.testing.assert_allclose(plate.moment_Nm, moment, atol=0.02)


@pytest.mark.parametrize("n_plates", [0, 1, 3, 10])
def test_any_number_of_plates_overlapping_or_not(tmp_path, n_plates):
    force, _ = standing_wrench(N * RATIO)
    force[:, :2] = 0.0  # which would lean away from the body under one foot or the other
    moment = np.cross(_swaying([0.2, 0.3, 0.0]), force)
    t = np.linspace(0, 9, N * RATIO)[:, None]
    shares = np.array([1.5 + np.sin(t + k * k) for k in range(n_plates)])
    shares = shares / shares.sum(axis=0) if n_plates else shares
    specs = [
        PlateSpec(share * force, share * moment, corners_m=CORNERS_M + np.array([x, 0, 0]))
        for share, x in zip(shares, np.linspace(0, 0.02, max(n_plates, 1)), strict=False)
    ]
    recording = _read(tmp_path, *specs)
    assert len(recording.plates) == n_plates
    if n_plates:
        total = np.sum([plate.wrench() for plate in recording.plates], axis=0)
        np.testing.assert_allclose(total, np.hstack([force, moment]), atol=0.1)


def test_an_outline_too_small_is_widened(tmp_path):
    force, _ = standing_wrench(N * RATIO)
    centre = CORNERS_M.mean(axis=0)
    small = centre + np.array([0.25, 0.18, 0.0]) + 0.3 * (CORNERS_M - centre)
    point = _swaying([0.1, 0.2, 0.0])  # under the left foot, beside the outline
    spec = PlateSpec(force, np.cross(point, force), corners_m=small)
    recording = _read(tmp_path, spec)
    assert [level for level, _ in _found(recording, "plate_cop")][-1] == "corrected"
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=0.01)
    np.testing.assert_allclose(recording.plates[0].moment_Nm, np.cross(point, force), atol=0.02)
    low, high = recording.plates[0].corners_m.min(axis=0), recording.plates[0].corners_m.max(axis=0)
    assert (low[:2] < point[:, :2]).all() and (point[:, :2] < high[:2]).all()


def test_corners_in_another_order_are_turned_under_the_feet(tmp_path):
    force, _ = standing_wrench(N * RATIO)
    force[:, :2] = 0.0  # which would have to go with the body's acceleration
    large = 2.5 * (CORNERS_M - CORNERS_M.mean(axis=0)) + [0.5, 0.9, 0.0]
    point = _swaying([0.2, 0.3, 0.0])
    spec = PlateSpec(force, np.cross(point, force), corners_m=large)
    spec.channels = PlateSpec(spec.force_N, spec.moment_Nm, corners_m=large).channels
    spec.corners_m = np.roll(large, 2, axis=0)
    recording = _read(tmp_path, spec)
    (level, action), *_ = _found(recording, "plate_cop")
    assert level == "corrected" and "180 degrees" in action
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=0.01)


def test_a_plate_whose_load_lies_nowhere_is_left_out(tmp_path):
    force, _ = standing_wrench(N * RATIO)
    spec = PlateSpec(force, np.cross(_swaying([3.0, -2.0, 0.0]), force))
    recording = _read(tmp_path, spec)
    assert recording.plates == ()
    ((level, action),) = _found(recording, "plate_cop")
    assert level == "excluded" and action.startswith("left the plate out")


def test_x_up_laboratory_with_a_plate(tmp_path):
    force, moment = standing_wrench(N * RATIO)
    markers, labels = standing_markers(N)
    order = [2, 0, 1]
    spec = PlateSpec(force[:, order], moment[:, order], corners_m=CORNERS_M[:, order])
    recording = read_recording(
        write_c3d(tmp_path / "a.c3d", markers[..., order], labels, [spec], ratio=RATIO)
    )
    assert [f.action for f in recording.findings] == ["turned the lab frame Z-up"]
    np.testing.assert_allclose(recording.plates[0].force_N[:, 2], force[:, 2], atol=0.01)
    np.testing.assert_allclose(recording.markers_m[..., 2], markers[..., 2], atol=1e-6)


def test_analog_at_the_marker_rate(tmp_path):
    force, moment = standing_wrench(N)
    plate = _read(tmp_path, PlateSpec(force, moment), ratio=1).plates[0]
    np.testing.assert_allclose(plate.force_N, force, atol=0.01)


def _plate(force_z_N: np.ndarray, name: str = "1", corners_m: np.ndarray = CORNERS_M) -> Plate:
    force = np.column_stack([0 * force_z_N, 0 * force_z_N, force_z_N])
    return Plate(name, force, 0 * force, corners_m, np.ones(len(force), bool))


def test_weight_that_does_not_shift_tells_a_lost_zero():
    sway = 8 * np.sin(np.linspace(0, 20, 4000))
    right, left = _plate(380 + sway, "2"), _plate(333 - sway, "1")
    assert sign_doubts([left, right], ["1"], RATE_HZ) == []
    (doubt,) = sign_doubts([_plate(713 + sway, "1"), right], ["1"], RATE_HZ)
    assert doubt.level == "warning" and "r = 1.00" in doubt.found
    assert sign_doubts([_plate(713 + sway, "1"), right], [], RATE_HZ) == []


def test_a_plate_that_was_zeroed_under_the_person_is_no_reversed_one():
    """One foot is lifted for a second: what its plate reads then, the other one reads more."""
    lifted = np.where(np.arange(trials.N) // 100 == 2, 350.0, 0.0)
    recording = trials.opened([]).recording
    tared = [_plate(lifted, "1"), _plate(lifted, "2")]  # the first as it is after a reversal
    assert "set to zero under the person" in lost_zeros(tared, ["1"], recording)
    assert lost_zeros(tared, [], recording) == ""
    sound = [_plate(350 - lifted, "1"), _plate(350 + lifted, "2")]
    assert lost_zeros(sound, ["1"], recording) == ""


def test_spikes_and_lost_samples_are_marked():
    force, _ = standing_wrench(2000)
    channels = force + np.random.default_rng(1).normal(0, 1, force.shape)
    channels[700, 1] += 1e4
    load = channels[:, 2]
    assert np.flatnonzero(spike_samples(channels, load)).tolist() == [700]
    channels[300:330] = 0.0
    lost = check_samples(channels, channels, load, RATE_HZ).lost
    assert np.flatnonzero(lost).tolist() == list(range(299, 331))


@pytest.mark.parametrize("per_frame", [1, 4, 10])
@pytest.mark.parametrize("weights", [0.1, 0.5])
def test_a_spike_of_one_sample_is_found_in_any_movement(per_frame, weights):
    rng = np.random.default_rng(7)
    found = []
    for laboratory in ("walkway", "side-by-side"):
        session = sound_session(laboratory, 0)
        for trial in session.trials:
            force = trial.sampled(100.0, per_frame).force_N[:, 0]
            force = force + rng.normal(0.0, 0.5, force.shape)
            for _ in range(5):
                k, channel = rng.integers(3, len(force) - 3), rng.integers(3)
                hit = force.copy()
                hit[k, channel] += weights * 9.81 * session.mass_kg * rng.choice([-1, 1])
                found.append(np.flatnonzero(spike_samples(hit, hit[:, 2])).tolist() == [k])
    # At the markers' rate a step may look like one.
    assert np.mean(found) >= (0.75 if per_frame == 1 else 0.95)


def test_a_foot_that_touches_down_is_no_spike():
    """300 Hz; as a plate of a public recording has it, an impact of one sample's length."""
    load = np.zeros(300)
    load[100:] = 600.0 + 50.0 * np.sin(np.arange(200) / 10.0)
    impact = np.zeros(300)
    impact[99:106] = [7.7, 35.8, 12.0, -8.2, -25.1, -30.0, -15.0]
    assert not spike_samples(np.column_stack([impact, load]), load).any()


def test_flight_on_a_plate_set_to_zero_is_not_lost():
    """Down in 50 ms and up in 10."""
    load = np.interp(np.arange(3000), [950, 1000, 2000, 2010], [700.0, 0.0, 0.0, 700.0])
    channels = np.column_stack([0 * load, 0 * load, load])
    assert not check_samples(channels, channels, load, RATE_HZ).lost.any()
    assert not spike_samples(channels, load).any()


def test_kistlers_polynomial_moves_the_centre_of_pressure():
    polynomial = np.zeros((2, 6))
    polynomial[0, 5], polynomial[1, 2] = 0.1, 1e-6
    stated = PlateDescription("1", 3, CORNERS_M, np.array([0.1, 0.2, 0.0]), polynomial)
    force = np.array([[5.0, 3.0, -500.0]])
    x, y = 0.05, 0.10
    moment = np.array([[y * -500.0, -x * -500.0, 2.0]])
    channels = np.hstack([force, moment]) @ np.linalg.pinv(wrench_matrix(stated)).T
    source = C3dPlate(stated, channels, np.ones(1, bool), np.eye(3))
    bare = replace(source, description=replace(stated, cop_polynomial=None))
    (finding,) = source.findings(AS_STATED)
    corrected, as_written = source.plate(AS_STATED), bare.plate(AS_STATED)
    height_m = float(CORNERS_M[0, 2])
    moved = corrected.cop_m(height_m) - as_written.cop_m(height_m)
    axes = stated.rotation_lab_plate()
    np.testing.assert_allclose(moved @ axes[:2, :2], [[-0.1 * x, -1e-3]], atol=1e-12)
    np.testing.assert_allclose(corrected.force_N, as_written.force_N)
    assert not bare.findings(AS_STATED)
    assert finding.level == "info" and "5.1 mm" in finding.action


def test_a_large_zero_counts_where_nobody_is_near():
    markers, labels = standing_markers(400)
    plate = _plate(np.full(4000, 300.0), corners_m=CORNERS_M + np.array([5.0, 0, 0]))
    recording = Recording(
        None, 100.0, tuple(labels), markers, RATE_HZ, (plate,), (), np.eye(3), "", 0.0
    )
    free = nobody_near(recording, plate)
    assert free.mean() > 0.9
    assert not plate_zero(plate, RATE_HZ).is_known()
    zero = plate_zero(plate, RATE_HZ, surely_free=free)
    assert zero.offset[2] == pytest.approx(300.0)
    under = _plate(np.full(4000, 300.0))
    assert not nobody_near(recording, under).any()
