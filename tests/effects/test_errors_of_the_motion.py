"""Linear answers to wrong markers and trees against inverse kinematics done again.

Everywhere ``change`` must lead from the wrench simulated with the poses that the model finds to
the true one.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.body.person import Person
from bsip_cli.dynamics.ground_wrench import pinocchio_model, predicted_wrench
from bsip_cli.effects.body import BELOW, JointCentre, MissingJoint
from bsip_cli.effects.markers import CORNER, MarkerShift, MarkerSwap, OverSmoothing, step
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.inverse_kinematics import posed, solve_trial
from tests.body.standing_person import markers_of, standing
from tests.effects.moving_scene import (
    RATE_HZ,
    continuous,
    derivatives,
    moving,
    phi,
    quaternions,
    rms,
    scene_of,
)

PERSON = standing().person
LIMIT_M = 0.025
OPTIONS = {"marker_sd_m": 0.005, "posture_sd_rad": 5.0, "iterations": 60}


def wrench(person: Person, parameters: np.ndarray, q, v, a) -> np.ndarray:
    found = predicted_wrench(pinocchio_model(person), q, v, a, parameters[:, None], np.zeros(3))
    return found[..., 0]


def followed(markers: np.ndarray, limit_m: float = 1.0, smooth_s: float = 0.0) -> Scene:
    """The scene of the poses that the model finds for markers."""
    q = solve_trial(PERSON, markers, robust_limit_m=limit_m, **OPTIONS).q
    if smooth_s:
        q = smoothed(q, smooth_s)
    residual = posed(PERSON, q).residuals(markers)
    return scene_of(q, *derivatives(q), residual_m=residual, robust_limit_m=limit_m)


def smoothed(q: np.ndarray, sd_s: float) -> np.ndarray:
    q = gaussian_filter1d(continuous(q, PERSON), sd_s * RATE_HZ, axis=0)
    for at in quaternions(PERSON):
        q[:, at] /= np.linalg.norm(q[:, at], axis=1, keepdims=True)
    return q


def explained(change: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(6,) part of the true change that is left, root mean square."""
    return rms(change - truth) / np.maximum(rms(truth), 0.1 * rms(truth).max())


@cache
def true_scene() -> Scene:
    scene = moving()
    return scene_of(scene.q, *derivatives(scene.q))


@pytest.mark.parametrize("marker", ["RELB", "LASIS", "FHEAD", "LMALL"])
def test_a_shifted_marker(marker):
    true = true_scene()
    m = PERSON.markers.index(marker)
    shift, start = np.array([0.004, -0.003, 0.005]), 3.0
    slipped = step(true.times_s, start)[0]
    markers = markers_of(PERSON, true.q)
    along = true.motion.rotation[:, PERSON.marker_segments[m]] @ shift
    markers[:, m] += slipped[:, None] * along
    seen = followed(markers)
    effect, values = MarkerShift(), np.array([*shift, start, 0.0])
    change = effect.change(seen, marker, values)
    assert explained(change, true.predicted - seen.predicted).max() < 0.15
    moved = effect.marker_change(seen, marker, values)
    np.testing.assert_allclose(moved, seen.residual_m, atol=2e-4)
    assert np.linalg.norm(seen.residual_m, axis=2).max() > 2e-3
    assert effect.parameters(seen, marker)[3].scan[-1] == pytest.approx(start, abs=0.1)


def test_a_shift_is_throughout_on_every_clock():
    for first_s in (0.0, 5.0, -5.0):
        scene = replace(moving(), times_s=moving().times_s + first_s)
        throughout = MarkerShift().parameters(scene, "RKNEL")[3].scan[0]
        said = [
            MarkerShift().words(scene, "RKNEL", np.array([0.02, 0.0, 0.0, start, 0.0])).what
            for start in (throughout, first_s + 2.0)
        ]
        assert said[0].endswith("throughout")
        assert said[1].endswith(f"from {first_s + 2.0:.1f} s on")


def test_a_shift_that_scaling_has_taken_half():
    """Half a shift throughout, less than the whole one from a moment on."""
    scene, shift = moving(), np.array([0.01, 0.0, 0.02])
    effect = MarkerShift()
    parts = [
        weight * effect.change(scene, "RKNEL", np.array([*shift, start, 0.0]))
        for weight, start in ((1.0, 3.0), (-0.5, -1.0))
    ]
    whole = effect.change(scene, "RKNEL", np.array([*shift, 3.0, 0.5]))
    np.testing.assert_allclose(whole, sum(parts), atol=1e-9)
    moved = effect.marker_change(scene, "RKNEL", np.array([*shift, 3.0, 0.5]))
    np.testing.assert_allclose(moved[100], -moved[500], atol=0.3 * np.abs(moved).max())


def test_swapped_markers():
    true = true_scene()
    pair = [PERSON.markers.index(name) for name in ("RKNEM", "LKNEM")]
    markers = markers_of(PERSON, true.q)
    markers[200:320, pair] = markers[200:320, pair[::-1]]
    seen = followed(markers, LIMIT_M, smooth_s=0.04)
    truth = scene_of(*(lambda q: (q, *derivatives(q)))(smoothed(true.q, 0.04)))
    effect = MarkerSwap()
    assert effect.targets(seen) == ("RKNEM+LKNEM",)
    share, start, end = effect.parameters(seen, "RKNEM+LKNEM")
    assert (start.scan[0], end.scan[0]) == pytest.approx((2.0, 3.19), abs=0.03)
    values = np.array([share.typical, start.scan[0], end.scan[0]])
    change, gone = effect.change(seen, "RKNEM+LKNEM", values), truth.predicted - seen.predicted
    assert rms(change - gone).max() < 0.5 * rms(gone).max()
    inside = slice(210, 310)
    moved = effect.marker_change(seen, "RKNEM+LKNEM", values)[inside]
    np.testing.assert_allclose(moved[:, pair], seen.residual_m[inside][:, pair], atol=0.01)


def test_only_a_marker_whose_own_residual_asks_for_it_has_shifted():
    """By a residual that lasts or jumps; what comes and goes is none. And the shift must fit it."""
    scene, names = moving(), PERSON.markers
    residual = np.zeros_like(scene.markers_m)
    jumping, lasting, shaking = (names.index(name) for name in ("RELB", "LASIS", "FHEAD"))
    residual[300:, jumping, 1] = 0.012
    residual[:, lasting, 0] = 0.008
    residual[:, shaking, 2] = 0.02 * np.sin(2 * np.pi * 3.0 * scene.times_s)
    effect, seen = MarkerShift(), replace(scene, residual_m=residual)
    assert set(effect.targets(seen)) == {"RELB", "LASIS"}
    assert set(effect.targets(scene)) == set(names)
    fitting, contrary = (np.array([0.0, y, 0.0, 3.0, 0.0]) for y in (0.015, -0.015))
    assert effect.agrees(seen, "RELB", fitting)
    assert not effect.agrees(seen, "RELB", contrary)
    assert not effect.agrees(seen, "FHEAD", fitting)


@pytest.mark.parametrize("joint", ["hip_r", "knee_l", "shoulder_l", "waist"])
def test_a_wrong_joint_centre(joint):
    true, shift = true_scene(), np.array([0.01, -0.008, 0.012])
    person, parameters = with_centre_at(joint, shift)
    seen = followed(markers_of(person, true.q))
    truth = wrench(person, parameters, true.q, true.v, true.a)
    effect = JointCentre()
    change = effect.change(seen, joint, shift)
    assert explained(change, truth - seen.predicted).max() < 0.12
    moved = effect.marker_change(seen, joint, shift)
    assert np.abs(seen.residual_m).max() > 1e-3
    np.testing.assert_allclose(moved, seen.residual_m, atol=6e-4)


def with_centre_at(joint: str, shift: np.ndarray) -> tuple[Person, np.ndarray]:
    """The person whose joint lies off, and all beyond it where it stood."""
    i = PERSON.skeleton.joints.index(joint)
    own = PERSON.joint_rotations()[i].T @ shift
    joints, places = PERSON.joint_in_parent_m.copy(), PERSON.marker_positions_m.copy()
    joints[i] += shift
    joints[np.array(PERSON.skeleton.parents) == i] -= own
    places[PERSON.marker_segments == i] -= own
    body = from_phi(phi()[10 * i : 10 * i + 10])
    parameters = phi().copy()
    parameters[10 * i : 10 * i + 10] = body.moved(own).phi()
    return replace(PERSON, joint_in_parent_m=joints, marker_positions_m=places), parameters


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_a_missing_joint(share):
    """What is left of the wrench is a tenth of what body and pose change one by one."""
    true = true_scene()
    person, parameters = two_part_trunk()
    q = bent_twice(true.q, share)
    v, a = derivatives(q, person)
    truth = wrench(person, parameters, q, v, a)
    seen = followed(markers_of(person, q))
    effect, values = MissingJoint(), np.full(3, share)
    change = effect.change(seen, "upper_torso", values)
    assert explained(change, truth - seen.predicted)[:5].max() < 0.4
    moved = effect.marker_change(seen, "upper_torso", values)
    assert rms3(seen.residual_m) > 4e-3 * share
    assert rms3(moved - seen.residual_m) < 0.25 * rms3(seen.residual_m)
    ranges = np.ptp(Rotation.from_quat(true.q[:, 7:11]).as_rotvec(), axis=0)[[2, 0, 1]] * share
    reported = effect.reported(seen, "upper_torso", values)
    np.testing.assert_allclose([x for *_, x in reported], ranges, rtol=0.2)


def rms3(residual: np.ndarray) -> float:
    return float(np.sqrt((residual**2).mean()))


def two_part_trunk() -> tuple[Person, np.ndarray]:
    """The person with an abdomen below T12/L1; what is above keeps the markers."""
    s = PERSON.skeleton
    i = s.index("upper_torso")
    later = [p + (p >= i) for p in s.parents]
    skeleton = replace(
        s,
        segments=(*s.segments[:i], "abdomen", *s.segments[i:]),
        parents=(*s.parents[: i + 1], i, *later[i + 1 :]),
        joints=(*s.joints[: i + 1], "spine", *s.joints[i + 1 :]),
        joint_types=(*s.joint_types[: i + 1], "spherical", *s.joint_types[i + 1 :]),
        table_rows=(*s.table_rows[:i], "torso", *s.table_rows[i:]),
    )
    up = BELOW * PERSON.origin_in_joint_m[i]

    def doubled(values):
        return np.insert(values, i, values[i], axis=0)

    joints, origins = doubled(PERSON.joint_in_parent_m), doubled(PERSON.origin_in_joint_m)
    joints[i + 1], origins[i], origins[i + 1] = up, 0.0, PERSON.origin_in_joint_m[i] - up
    on = PERSON.marker_segments
    person = replace(
        PERSON,
        skeleton=skeleton,
        joint_in_parent_m=joints,
        origin_in_joint_m=origins,
        parent_tilt_rad=doubled(PERSON.parent_tilt_rad),
        child_tilt_rad=doubled(PERSON.child_tilt_rad),
        lengths_m=doubled(PERSON.lengths_m),
        held=doubled(PERSON.held),
        marker_segments=on + (on >= i),
    )
    whole = from_phi(phi()[10 * i : 10 * i + 10])
    mass = BELOW * whole.mass_kg
    abdomen = Inertia(mass, 0.5 * up, mass * 0.01 * np.eye(3))
    rest = from_phi(whole.phi() - abdomen.phi()).moved(up)
    parts = np.concatenate([abdomen.phi(), rest.phi()])
    return person, np.concatenate([phi()[: 10 * i], parts, phi()[10 * i + 10 :]])


def bent_twice(q: np.ndarray, share: float) -> np.ndarray:
    turn = Rotation.from_quat(q[:, 7:11]).as_rotvec()
    parts = [Rotation.from_rotvec(x * turn).as_quat() for x in (1 - share, share)]
    return np.hstack([q[:, :7], *parts, q[:, 11:]])


@pytest.mark.parametrize(("cutoff", "left"), [(2.0, 0.6), (3.0, 0.3), (4.5, 0.1)])
def test_smoothed_markers(cutoff, left):
    """The nearer the cut-off comes to the motion's own frequencies, the less can be restored."""
    true = true_scene()
    sections = butter(2, CORNER * cutoff, fs=RATE_HZ, output="sos")
    seen = followed(sosfiltfilt(sections, markers_of(PERSON, true.q), axis=0))
    values = np.array([1.0, cutoff])
    effect, gone = OverSmoothing(), true.predicted - seen.predicted
    assert rms(effect.change(seen, "", values) - gone, 50).max() < left * rms(gone, 50).max()
    moved = effect.marker_change(seen, "", values)[50:-50]
    assert rms3(moved - seen.residual_m[50:-50]) < left * rms3(seen.residual_m[50:-50])
    name, unit, told = effect.reported(seen, "", values)[0]
    assert (name, unit) == ("cutoff", "Hz") and told == pytest.approx(cutoff)


def test_the_share_turns_into_the_cutoff_that_loses_as_much():
    """Below the cut-off the loss falls like its fourth power."""
    seen = true_scene()
    name, _, cutoff = OverSmoothing().reported(seen, "", np.array([0.5, 6.0]))[0]
    assert name == "cutoff" and cutoff == pytest.approx(6.0 * 2**0.25)
    right = OverSmoothing().change(seen, "", np.array([1.0, cutoff]))
    scaled = OverSmoothing().change(seen, "", np.array([0.5, 6.0]))
    assert rms(right - scaled, 50).max() < 0.2 * rms(right, 50).max()
