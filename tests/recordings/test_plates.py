"""What feet, weight and unloaded stretches say about plates, and the wrench at marker times."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.model import Plate, Recording
from bsip_cli.recordings.plate_reading import AS_STATED
from bsip_cli.recordings.plate_wrench import (
    lost_baseline,
    nobody_near,
    plates_at_marker_rate,
    sample_at_frames,
    silent_frames,
    subtract_zero,
    unloaded_samples,
    without_zeros,
)
from bsip_cli.recordings.plates import PlateDescription, wrench_matrix
from bsip_cli.recordings.plates_of_files import C3dPlate
from bsip_cli.recordings.read import lost_zeros, read_recording, sign_doubts
from bsip_cli.recordings.trunk_motion import in_flight
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


def _found(recording: Recording) -> list[tuple[str, str]]:
    """What is said of centres of pressure."""
    return [(f.level, f.action) for f in recording.findings if f.check == "plate_cop"]


def _swaying(place_m: list[float]) -> np.ndarray:
    """A centre of pressure that moves as a standing person's does, (n, 3)."""
    t = np.linspace(0, 6, N * RATIO)
    return place_m + 0.006 * np.column_stack([np.sin(t), np.cos(1.3 * t), 0 * t])


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_raised_and_tilted_plates_keep_the_wrench(tmp_path, kind):
    force, moment = standing_wrench(N * RATIO)
    corners = Rotation.from_euler("x", 0.05).apply(CORNERS_M) + np.array([0, 0, 0.02])
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
    t = np.linspace(0, 9, N * RATIO)[:, None]
    shares = np.array([1.5 + np.sin((1 + 0.3 * k) * t) for k in range(n_plates)])
    shares = shares / shares.sum(axis=0) if n_plates else shares
    # No two are loaded at one place, and none between others: in a ring.
    angles = 2 * np.pi * np.arange(n_plates) / max(n_plates, 1)
    places = [[0.2 + 0.08 * np.cos(a), 0.3 + 0.08 * np.sin(a), 0.0] for a in angles]
    forces = [share * force for share in shares]
    moments = [np.cross(_swaying(p), f) for p, f in zip(places, forces, strict=True)]
    shifts = np.linspace(0, 0.02, max(n_plates, 1))
    specs = [
        PlateSpec(f, m, corners_m=CORNERS_M + np.array([x, 0, 0]))
        for f, m, x in zip(forces, moments, shifts, strict=False)
    ]
    recording = _read(tmp_path, *specs)
    assert len(recording.plates) == n_plates
    if n_plates:
        total = np.sum([plate.wrench for plate in recording.plates], axis=0)
        stated = np.hstack([np.sum(forces, axis=0), np.sum(moments, axis=0)])
        np.testing.assert_allclose(total, stated, atol=0.1)


def test_an_outline_too_small_is_widened(tmp_path):
    force, _ = standing_wrench(N * RATIO)
    centre = CORNERS_M.mean(axis=0)
    small = centre + np.array([0.25, 0.18, 0.0]) + 0.3 * (CORNERS_M - centre)
    point = _swaying([0.1, 0.2, 0.0])  # under the left foot, beside the outline
    spec = PlateSpec(force, np.cross(point, force), corners_m=small)
    recording = _read(tmp_path, spec)
    assert [level for level, _ in _found(recording)][-1] == "corrected"
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
    (level, action), *_ = _found(recording)
    assert level == "corrected" and "180 degrees" in action
    np.testing.assert_allclose(recording.plates[0].force_N, force, atol=0.01)


def test_a_plate_whose_load_lies_nowhere_is_left_out(tmp_path):
    force, _ = standing_wrench(N * RATIO)
    spec = PlateSpec(force, np.cross(_swaying([3.0, -2.0, 0.0]), force))
    recording = _read(tmp_path, spec)
    assert recording.plates == ()
    ((level, action),) = _found(recording)
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
    return Plate(name, np.hstack([force, 0 * force]), corners_m, np.ones(len(force), bool))


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


def zero_of(plate: Plate, unloaded: np.ndarray) -> np.ndarray:
    zeroed, _ = subtract_zero(plate, unloaded, RATE_HZ)
    return (plate.wrench - zeroed.wrench)[0]


def test_a_large_zero_counts_where_nobody_is_near():
    markers, labels = standing_markers(400)
    plate = _plate(np.full(4000, 300.0), corners_m=CORNERS_M + np.array([5.0, 0, 0]))
    recording = Recording(
        None, 100.0, tuple(labels), markers, RATE_HZ, (plate,), (), np.eye(3), "", 0.0
    )
    free = nobody_near(recording, plate)
    assert free.mean() > 0.9
    assert not unloaded_samples(plate, RATE_HZ).any()
    unloaded = unloaded_samples(plate, RATE_HZ, surely_free=free)
    assert zero_of(plate, unloaded)[2] == pytest.approx(300.0)
    under = _plate(np.full(4000, 300.0))
    assert not nobody_near(recording, under).any()


@pytest.mark.parametrize("ring_N", [0.0, 40.0])
def test_a_plate_that_is_unloaded_only_in_flight_gets_its_zero_there(ring_N):
    """A jump of 0.5 s; one whose plate still rings tells nothing, nor does a fall of 0.1 s."""
    markers, labels = standing_markers(200)
    for seconds in (0.5, 0.1):
        n = round(100 * seconds)
        t_s = np.arange(n) / 100.0
        jump = markers.copy()
        jump[80 : 80 + n, :, 2] += (0.5 * GRAVITY_M_S2 * t_s * (seconds - t_s))[:, None]
        load = np.full(2000, 700.0)
        load[800 : 800 + 10 * n] = 60.0 + ring_N * np.sin(np.arange(10 * n) / 30.0)
        plate = _plate(load)
        recording = Recording(
            None, 100.0, tuple(labels), jump, RATE_HZ, (plate,), (), np.eye(3), "", 0.0
        )
        unloaded = unloaded_samples(plate, RATE_HZ, flight=in_flight(recording, len(load)))
        assert unloaded.any() == (seconds == 0.5 and ring_N == 0.0)
        assert not unloaded.any() or zero_of(plate, unloaded)[2] == pytest.approx(60.0)
    assert not unloaded_samples(plate, RATE_HZ).any()


OFFSET = np.array([3.0, -2.0, 12.0, 0.5, -0.4, 0.1])


def _offset_plate(load_N: np.ndarray) -> Plate:
    noise = np.random.default_rng(2).normal(0, 1.0, (len(load_N), 6))
    wrench = OFFSET + noise
    wrench[:, 2] += load_N
    return Plate("1", wrench, None, np.ones(len(load_N), bool))


def _step() -> np.ndarray:
    load = np.zeros(4000)
    load[1000:3000] = 700 * np.sin(np.linspace(0, np.pi, 2000))
    return load


def test_offset_is_found_and_subtracted():
    plate = _offset_plate(_step())
    unloaded = unloaded_samples(plate, RATE_HZ)
    assert 1500 < unloaded.sum() < 2100 and len(runs(unloaded)) == 2
    np.testing.assert_allclose(zero_of(plate, unloaded), OFFSET, atol=0.3)
    corrected, finding = subtract_zero(plate, unloaded, RATE_HZ)
    assert finding.level == "corrected"
    assert abs(np.median(corrected.lift_N[:900])) < 0.3


def _silent_where(mask: np.ndarray, plate: Plate) -> Plate:
    return replace(plate, wrench=np.where(mask[:, None], 0.0, plate.wrench))


def test_zeros_that_software_wrote_are_no_reading():
    plate = _silent_where(_step() == 0, _offset_plate(_step()))
    unloaded = unloaded_samples(plate, RATE_HZ)
    assert not unloaded.any()
    assert subtract_zero(plate, unloaded, RATE_HZ)[1].found.startswith("exactly 0 without load")


def test_zeros_that_do_not_last_are_noise_about_a_threshold():
    """Software sets to 0 what is below 9 N; the plate reads 12 N with noise of 5 N."""
    plate = _offset_plate(np.random.default_rng(5).normal(0, 5.0, 4000))
    low = np.abs(plate.lift_N) < 9
    assert 0.15 < low.mean() < 0.5
    some = _silent_where(low, plate)
    unloaded = unloaded_samples(some, RATE_HZ)
    assert unloaded.sum() > 3500
    np.testing.assert_allclose(zero_of(some, unloaded)[:3], OFFSET[:3], atol=2.5)


def test_a_plate_that_is_never_unloaded_keeps_its_zero():
    plate = _offset_plate(np.full(3000, 350.0))
    unloaded = unloaded_samples(plate, RATE_HZ)
    assert not unloaded.any()
    same, finding = subtract_zero(plate, unloaded, RATE_HZ)
    assert same is plate and finding.level == "info"


BESIDE = np.array([0.0, -0.61, 0.0])  # the next plate, on which nobody stands


@pytest.mark.parametrize(
    ("has_outline", "at", "lifted_m", "is_zero"),
    [
        (True, [0, 0, 0], 0.0, False),  # who sits, or stands on the other leg
        (False, [0, 0, 0], 0.0, False),
        (True, BESIDE, 0.0, True),
        (False, [0.2, 0.5, 0], 0.0, True),  # so far from the feet is no pressure of theirs
        (True, [0, 0, 0], 0.06, True),  # a foot that swings over a belt, heel up
        (False, [0, 0, 0], 0.06, True),
    ],
)
def test_a_light_load_under_a_foot_that_rests_is_no_zero(has_outline, at, lifted_m, is_zero):
    """30 N for 3 s, with a hundredth more of noise."""
    markers, labels = standing_markers(300)
    markers[150:, [0, 2], 2] += lifted_m
    place = np.array([0.2, 0.3, 0.0]) + at
    force = np.column_stack([np.zeros((3000, 2)), np.full(3000, 30.0)])
    force += np.random.default_rng(4).normal(0, 0.3, force.shape)
    wrench = np.hstack([force, np.cross(place, force)])
    corners = CORNERS_M + at if has_outline else None
    plate = Plate("1", wrench, corners, np.ones(3000, bool))
    recording = Recording(
        None, 100.0, tuple(labels), markers, RATE_HZ, (plate,), (), np.eye(3), "", 0.0
    )
    less, (finding,), zeros = without_zeros(recording)
    assert bool(zeros) == is_zero and (finding.level == "corrected") == is_zero
    assert np.median(less.plates[0].lift_N) == pytest.approx(0.0 if is_zero else 30.0, abs=0.1)


N_LIFT, ZERO = 400, slice(0, 50)


def without_baseline(lift_N: np.ndarray):
    said = lost_baseline(lift_N, "1", np.ones(N_LIFT, bool), ZERO)
    return lift_N if said is None else lift_N - lift_N[ZERO].mean(), said


def lift_step(first_N: float, then_N: float) -> np.ndarray:
    ramp = np.clip((np.arange(N_LIFT) - 100.0) / 50.0, 0.0, 1.0)
    return first_N + (then_N - first_N) * ramp


@pytest.mark.parametrize(("first_N", "then_N"), [(-250.0, 0.0), (-700.0, -350.0), (-700.0, 4.0)])
def test_who_steps_off_a_plate_of_the_other_sign_was_no_baseline(first_N, then_N):
    lift, said = without_baseline(lift_step(first_N, then_N))
    assert said is None
    np.testing.assert_array_equal(lift, lift_step(first_N, then_N))


@pytest.mark.parametrize(("level_N", "load_N"), [(-2880.0, 800.0), (-300.0, 600.0)])
def test_a_pull_that_no_person_makes_is_subtracted(level_N, load_N):
    lift, said = without_baseline(lift_step(level_N, level_N + load_N))
    assert said.level == "corrected"
    np.testing.assert_allclose(lift, lift_step(0.0, load_N))


FRAMES = 200
RATES = [(1000.0, 100.0), (2000.0, 120.0), (1000.0, 100.5), (100.0, 100.0), (240.0, 200.0)]


def _signal(rate_hz: float, f_hz: float, n: int) -> np.ndarray:
    return np.sin(2 * np.pi * f_hz * np.arange(n) / rate_hz)[:, None]


@pytest.mark.parametrize(("rate", "frame_rate"), RATES)
def test_constants_pass_exactly_and_slow_signals_without_delay(rate, frame_rate):
    n = int(FRAMES * rate / frame_rate)
    signal = np.hstack([np.full((n, 1), 7.5), _signal(rate, 5.0, n)])
    values, usable = sample_at_frames(signal, np.ones(n, bool), rate, frame_rate, FRAMES)
    assert usable.all()
    np.testing.assert_allclose(values[:, 0], 7.5, rtol=1e-12)
    expected = np.sin(2 * np.pi * 5.0 * np.arange(FRAMES) / frame_rate)
    np.testing.assert_allclose(values[15:-15, 1], expected[15:-15], atol=0.003)


@pytest.mark.parametrize(("rate", "frame_rate"), RATES)
def test_frames_in_which_software_wrote_zeros(rate, frame_rate):
    n = int(FRAMES * rate / frame_rate)
    signal = np.full((n, 6), 300.0)
    signal[: n // 2] = 0.0
    values, _ = sample_at_frames(signal, np.ones(n, bool), rate, frame_rate, FRAMES)
    silent = silent_frames(values, resampled=rate != frame_rate)
    assert abs(silent.sum() - FRAMES / 2) <= 1 and silent[: FRAMES // 2 - 1].all()


def test_what_would_alias_is_gone():
    values, _ = sample_at_frames(_signal(1000, 93.0, 2000), np.ones(2000, bool), 1000, 100, FRAMES)
    assert np.abs(values[15:-15]).max() < 0.005


def test_slower_forces_are_interpolated():
    n = FRAMES // 2
    values, _ = sample_at_frames(_signal(50, 3.0, n), np.ones(n, bool), 50, 100, FRAMES)
    expected = np.sin(2 * np.pi * 3.0 * np.arange(FRAMES) / 100)
    np.testing.assert_allclose(values[30:-30, 0], expected[30:-30], atol=0.01)


def test_unusable_samples_mark_frames_and_do_not_leak():
    signal, usable = np.full((2000, 1), 3.0), np.ones(2000, bool)
    signal[1000:1100], usable[1000:1100] = np.nan, False
    values, good = sample_at_frames(signal, usable, 1000, 100, FRAMES)
    assert np.isfinite(values).all()
    assert not good[100:110].any()
    assert good[:90].all() and good[120:].all()
    np.testing.assert_allclose(values[good], 3.0, rtol=1e-12)


def test_plates_at_the_marker_rate():
    plate = Plate("1", np.full((1000, 6), [3.0] * 3 + [-3.0] * 3), None, np.ones(1000, bool))
    markers = np.zeros((100, 1, 3))
    recording = Recording(
        Path("a"), 100.0, ("A",), markers, 1000.0, (plate,), (), np.eye(3), "", 0.5
    )
    (found,) = plates_at_marker_rate(recording)
    np.testing.assert_allclose(found.wrench, plate.wrench[:100])
    assert found.usable.all()
