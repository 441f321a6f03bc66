"""Velocities and accelerations of a known trajectory, and where coloured noise begins."""

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.errors import BadDataError
from bsip_cli.motion.inverse_kinematics import solve_poses
from bsip_cli.motion.smoothing import _angular, skin_corner_hz, smooth_motion
from bsip_cli.motion.splines import SmoothSignal
from tests.body.standing_person import Swing, markers_of, standing

RATE_HZ = 100.0
OPTIONS = {
    "method": "spline",
    "butterworth_cutoff_hz": 6.0,
    "pace_window_s": 0.5,
    "skin_factor": 1.0,
    "skin_from_hz": 5.0,
    "robust_limit_m": 0.025,
    "edge_s": 0.1,
}


@pytest.fixture(scope="module")
def swing():
    person = standing().person
    model = pinocchio_model(person)
    return person, model, Swing(model, standing().q, seed=1).sampled(6.0, RATE_HZ)


def smoothed(person, q, **changes):
    """Where no ``markers`` are given, they lie where the poses put them."""
    return smoothed_where(person, q, np.ones(len(q), dtype=bool), **changes)


def smoothed_where(person, q, determined, **changes):
    given = {"markers": markers_of(person, q)} | OPTIONS | changes
    return smooth_motion(person, q, determined, RATE_HZ, **given)


def relative(found, true):
    inner = slice(30, -30)
    return np.sqrt(((found - true)[inner] ** 2).mean() / (true[inner] ** 2).mean())


def test_velocities_and_accelerations(swing):
    person, _, (_, q, v, a) = swing
    motion = smoothed(person, q)
    for part in (slice(0, 40), slice(0, 3), slice(3, 6), slice(6, 40)):  # base, turning, joints
        assert relative(motion.v[:, part], v[:, part]) < 1e-3
        assert relative(motion.a[:, part], a[:, part]) < 1e-3


def test_quaternions_stay_units_and_their_signs_do_not_matter(swing):
    person, _, (_, q, _, _) = swing
    motion = smoothed(person, q)
    flipped = q.copy()
    flipped[::3, 3:7] *= -1
    again = smoothed(person, flipped)
    np.testing.assert_allclose(again.v, motion.v, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(motion.q[:, 3:7], axis=1), 1.0, atol=1e-12)


def test_a_joint_that_spins_at_a_constant_rate():
    """Three turns about an oblique axis: omega in body axes is constant, its derivative zero."""
    person = standing().person
    model = pinocchio_model(person)
    omega = np.array([1.0, -3.0, 2.0])
    v = np.zeros(model.nv)
    at = model.joints[model.getJointId("shoulder_r")].idx_v
    v[at : at + 3] = omega
    times = np.arange(500) / RATE_HZ
    motion = smoothed(person, np.stack([pin.integrate(model, standing().q, v * t) for t in times]))
    spin = motion.v[30:-30, at : at + 3]
    np.testing.assert_allclose(spin, np.broadcast_to(omega, spin.shape), atol=1e-5)
    np.testing.assert_allclose(motion.a[30:-30, at : at + 3], 0.0, atol=1e-3)
    rest = np.delete(motion.v[30:-30], np.s_[at : at + 3], axis=1)
    np.testing.assert_allclose(rest, 0.0, atol=1e-6)


def test_a_turning_base_that_moves_straight_has_pinocchios_spatial_acceleration():
    """In body axes the velocity turns though the body does not accelerate: a = -omega x v."""
    person = standing().person
    model = pinocchio_model(person)
    omega, speed = np.array([0.5, 1.5, -1.0]), np.array([0.8, -0.2, 0.1])
    q = np.repeat(standing().q[None], 400, axis=0)
    for k in range(400):
        turn = pin.exp3(omega * k / RATE_HZ)
        q[k, 3:7] = pin.Quaternion(
            pin.Quaternion(standing().q[3:7]).toRotationMatrix() @ turn
        ).coeffs()
        q[k, :3] += speed * k / RATE_HZ
    motion = smoothed(person, q)
    data = model.createData()
    for k in (100, 200, 300):
        pin.forwardKinematics(model, data, motion.q[k], motion.v[k], motion.a[k])
        classical = pin.getClassicalAcceleration(model, data, 1, pin.LOCAL_WORLD_ALIGNED)
        velocity = pin.getVelocity(model, data, 1, pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(velocity.linear, speed, atol=1e-5)
        np.testing.assert_allclose(classical.linear, 0.0, atol=1e-3)
        np.testing.assert_allclose(motion.v[k, 3:6], omega, atol=1e-5)
        assert np.linalg.norm(motion.a[k, :3]) > 0.5


def test_a_curve_off_the_unit_sphere_turns_as_the_one_on_it():
    """Smoothing shrinks quaternions, and not evenly: omega and its rate must not notice."""
    omega, alpha = np.array([0.4, -1.1, 0.7]), np.array([0.9, 0.2, -0.5])
    h = 1e-3
    times = h * np.arange(-3, 4)

    def curve(t):
        """A turn about a fixed axis would hide an error across it: two turns, one after another."""
        turn = pin.exp3(omega * t) @ pin.exp3(0.5 * alpha * t**2)
        return (1.0 + 0.3 * np.sin(2 * t + 0.5)) * pin.Quaternion(turn).coeffs()

    x = np.array([curve(t) for t in times])
    first = (45 * (x[4] - x[2]) - 9 * (x[5] - x[1]) + x[6] - x[0]) / (60 * h)
    second = (270 * (x[4] + x[2]) - 27 * (x[5] + x[1]) + 2 * (x[6] + x[0]) - 490 * x[3]) / (
        180 * h**2
    )
    signal = SmoothSignal(
        *(part[None] for part in (x[3], first, second, np.zeros(4), np.zeros(())))
    )
    unit, found_omega, found_alpha, _ = _angular(signal, slice(0, 4))
    np.testing.assert_allclose(unit[0], [0, 0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(found_omega[0], omega, atol=1e-8)
    np.testing.assert_allclose(found_alpha[0], alpha, atol=1e-6)


def noisy(person, q, sd_m, seed):
    """Poses solved from shaken markers."""
    markers = markers_of(person, q)
    markers = markers + np.random.default_rng(seed).normal(0, sd_m, markers.shape)
    options = {"marker_sd_m": 0.005, "robust_limit_m": 0.025, "posture_sd_rad": 3.0}
    return solve_poses(person, markers, q[0], iterations=50, **options).q


def test_the_markers_noise_is_found_and_the_stated_sd_holds(swing):
    person, _, (_, q, _, a) = swing
    motion = smoothed(person, noisy(person, q, 0.0005, seed=2))
    assert motion.marker_noise_m == pytest.approx(0.0005, rel=0.25)
    starts = [0, 3, *person.skeleton.v_starts[1:], 40]  # one noise for the axes of a joint
    for start, stop in pairwise(starts):
        part = np.s_[30:-30, start:stop]
        error = np.sqrt(((motion.a - a)[part] ** 2).mean())
        stated = np.sqrt((motion.a_sd[part] ** 2).mean())
        assert 0.5 < stated / error < 2, person.skeleton.v_names[start]


def test_butterworth(swing):
    person, _, (_, q, v, a) = swing
    motion = smoothed(person, q, method="butterworth", butterworth_cutoff_hz=10.0)
    assert relative(motion.v, v) < 0.02
    assert relative(motion.a, a) < 0.05
    slow = smoothed(person, q, method="butterworth", butterworth_cutoff_hz=1.0)
    assert relative(slow.a, a) > 0.3  # the cut-off bites


@pytest.mark.parametrize(("at_its_own", "gain"), [(True, np.sqrt(0.5)), (False, 0.5)])
def test_butterworth_halves_power_at_its_cutoff_and_amplitude_at_the_stated_one(at_its_own, gain):
    person = standing().person
    q = np.repeat(standing().q[None], 1000, axis=0)
    stated = smoothed(person, q, method="butterworth", butterworth_cutoff_hz=5.0).cutoff_hz
    hz = 5.0 if at_its_own else stated[0]
    q[:, 0] += 0.1 * np.sin(2 * np.pi * hz * np.arange(1000) / RATE_HZ)
    motion = smoothed(person, q, method="butterworth", butterworth_cutoff_hz=5.0)
    left = np.std(motion.q[200:-200, 0]) / np.std(q[200:-200, 0])
    assert left == pytest.approx(gain, rel=0.02)


def test_swinging_skin_lowers_the_cutoff(swing):
    """Markers that swing about their places: the poses are smoothed more."""
    person, _, (times, q, _, _) = swing
    shaken = q + np.random.default_rng(4).normal(0, 2e-4, q.shape)
    still = markers_of(person, shaken)
    hz = np.arange(2.0, 10.0)
    phase = np.random.default_rng(3).uniform(0, 2 * np.pi, (len(hz), *still.shape[1:]))
    waves = np.sin(2 * np.pi * hz[:, None, None] * times[:, None, None, None] + phase)
    skin = (0.02 / hz[:, None, None] ** 2 * waves).sum(axis=1)
    plain, soft = (smoothed(person, shaken, markers=m) for m in (still, still + skin))
    assert np.median(soft.cutoff_hz) < 0.9 * np.median(plain.cutoff_hz)
    unmoved, moved = (
        smoothed(person, shaken, markers=m, skin_factor=0.0) for m in (still, still + skin)
    )
    np.testing.assert_array_equal(moved.a, unmoved.a)


@pytest.mark.parametrize("method", ["spline", "butterworth"])
def test_undetermined_frames_are_bridged(swing, method):
    person, _, (_, q, v, _) = swing
    determined = np.ones(len(q), dtype=bool)
    determined[300:306] = False
    wild = q.copy()
    wild[300:306] = wild[0]
    motion = smoothed_where(person, wild, determined, method=method)
    assert np.isfinite(motion.a).all()
    if method == "spline":
        assert relative(motion.v[270:336], v[270:336]) < 0.02


def test_a_joint_without_a_pose_leaves_the_others_alone(swing):
    """A hand lost for a third of a second must not shake the pelvis."""
    person, _, (_, q, _, a) = swing
    skeleton = person.skeleton
    wrist = skeleton.joints.index("wrist_l")
    known = np.ones((len(q), len(skeleton.joints)), dtype=bool)
    known[250:284, wrist] = False
    noisy = q + np.random.default_rng(7).normal(0, 2e-4, q.shape)
    holed = smoothed_where(person, noisy, known)
    whole = smoothed(person, noisy)
    own = slice(skeleton.v_starts[wrist], skeleton.v_starts[wrist] + 3)
    others = np.delete(np.arange(a.shape[1]), range(own.start, own.stop))
    error, before = ((motion.a - a)[200:334][:, others].std() for motion in (holed, whole))
    assert error < 1.3 * before
    assert not holed.inner[240:294].any()
    assert holed.inner[200:239].all()


def test_inner_frames_keep_away_from_the_ends(swing):
    person, _, (_, q, _, _) = swing
    inner = smoothed(person, q, edge_s=0.25).inner
    assert np.flatnonzero(inner)[[0, -1]].tolist() == [25, len(q) - 26]
    assert smoothed(person, q, edge_s=0.0).inner.all()


def test_too_few_frames(swing):
    person, _, (_, q, _, _) = swing
    determined = np.zeros(len(q), dtype=bool)
    determined[:11] = True
    with pytest.raises(BadDataError, match="11 of 600 frames with a pose"):
        smoothed_where(person, q, determined)


FRAMES, WHITE_M = 2000, 3e-4


def corner(markers, q, white_m=WHITE_M):
    person = standing().person
    return skin_corner_hz(person, q, markers, RATE_HZ, white_m=white_m, robust_limit_m=0.025)


def swinging(corner_hz, seed):
    """Poses that stand, and markers with white noise and noise that falls like 1 / f^4.

    The poses follow no noise, so the residuals hold all of it; the estimate raises them by the
    share that fitted poses take.
    """
    person = standing().person
    q = np.repeat(standing().q[None], FRAMES, axis=0)
    rng = np.random.default_rng(seed)
    places = markers_of(person, q)
    white, skin = rng.normal(0, WHITE_M, (2, *places.shape))
    f = np.fft.rfftfreq(FRAMES, 1 / RATE_HZ)
    f[f < 1.0] = np.inf
    spectrum = np.fft.rfft(skin, axis=0) * ((corner_hz / f) ** 2)[:, None, None]
    return q, places + white + np.fft.irfft(spectrum, FRAMES, axis=0)


def test_the_corner_is_found():
    q, markers = swinging(8.0, seed=1)
    coordinates, taken = 3 * markers.shape[1], len(standing().person.skeleton.v_names)
    raised = (coordinates / (coordinates - taken)) ** 0.25
    assert corner(markers, q) == pytest.approx(8.0 * raised, rel=0.1)


def test_white_noise_alone_begins_low():
    q, markers = swinging(0.0, seed=2)
    taken = 1 - len(standing().person.skeleton.v_names) / (3 * markers.shape[1])
    shrunk = markers_of(standing().person, q)
    assert corner(shrunk + np.sqrt(taken) * (markers - shrunk), q) < 4.0


def test_an_exchanged_pair_and_gaps_change_little():
    q, markers = swinging(8.0, seed=3)
    before = corner(markers, q)
    swapped = markers.copy()
    swapped[500:700, [0, 5]] = markers[500:700, [5, 0]]
    swapped[900:950, 7] = np.nan
    swapped[1200:1230] = np.nan  # frames without a pose
    assert corner(swapped, q) == pytest.approx(before, rel=0.1)


def test_misplaced_markers_of_a_turning_body_are_no_skin():
    """A constant error in the segment's axes, not in the world's."""
    person = standing().person
    turn = 0.5 * np.sin(2 * np.pi * 2.5 * np.arange(FRAMES) / RATE_HZ)
    q = np.repeat(standing().q[None], FRAMES, axis=0)
    turned = Rotation.from_rotvec(turn[:, None] * [0, 0, 1]) * Rotation.from_quat(q[0, 3:7])
    q[:, 3:7] = turned.as_quat()
    places = markers_of(person, q)
    right = places + np.random.default_rng(4).normal(0, WHITE_M, places.shape)
    wrong = right.copy()
    wrong[:, np.flatnonzero(person.marker_segments == 0)[0]] += turned.apply([0.01, 0.0, 0.0])
    assert corner(wrong, q) == pytest.approx(corner(right, q), rel=0.05)


def test_too_few_markers_leave_no_residuals():
    q, markers = swinging(8.0, seed=5)
    markers[:, 10:] = np.nan
    assert corner(markers, q) == 0.0


def test_a_dozen_frames_suffice():
    q, markers = swinging(8.0, seed=6)
    assert np.isfinite(corner(markers[:12], q[:12]))
