"""Effects on the body: what it carries, and how it is built, as first principles say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bsip_cli.errors import UsageError
from bsip_cli.simulate.balance import Mixer
from bsip_cli.simulate.effects.loads import ChestMotion, Swinging
from bsip_cli.simulate.numerics import about_z, derivative
from bsip_cli.simulate.plan import GRAVITY, Poses
from bsip_cli.simulate.recording import Trial
from tests.simulate.conftest import is_physical, person_of
from tests.simulate.effect_trials import (
    DURATION_S,
    PERSON_SEED,
    G,
    effect_of,
    trial_with,
    weight_n,
)


def test_mixing_solves_an_iteration_that_alone_would_explode():
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.standard_normal((6, 6)))[0]
    growth = axes @ np.diag([-1.6, -1.2, 0.2, 0.5, 0.9, 0.97]) @ axes.T
    aim, x, mixer = rng.standard_normal(6), np.zeros(6), Mixer()
    for _ in range(30):
        x = x + mixer.step(x, growth @ (x - aim) + aim - x)
    assert np.abs(x - aim).max() < 1e-8


def test_an_added_mass_weighs_and_keeps_flight_free():
    asked = ("added_mass", 4.0, "forearm_r")
    standing = trial_with("static", asked).force_n[:, 1].mean()
    assert standing == pytest.approx(weight_n() + 4.0 * G, rel=1e-4)
    assert air_force(trial_with("hops", asked)) < 0.05


@pytest.mark.parametrize(
    "asked",
    [
        ("wobbling_mass", 6.0, "upper_torso"),
        ("released_object", 1.5, "hand_r"),
        ("breathing", 0.05, ""),
        ("unmeasured_contact", 40.0, "hand_l"),
        ("implement", 0.5, "hand_r"),
        ("external_force", 60.0, "upper_torso"),
        ("object_handled", 1.5, "hand_l"),
    ],
)
def test_flight_stays_free_of_ground_force(asked):
    hops = trial_with("hops", asked)
    assert len(hops.plan.flights) >= 3
    assert air_force(hops) < 1.0
    assert hops.force_n[:, 1].min() > -8.0


def air_force(trial: Trial) -> float:
    """Largest ground force in flight, 5 samples away from its ends."""
    start = trial.plan.keep.start
    return max(
        np.abs(trial.force_n[a - start + 5 : b - start - 4]).max() for a, b in trial.plan.flights
    )


def test_a_released_object_leaves_the_plate_at_its_time():
    trial = trial_with("static", ("released_object", 2.0, "hand_r,release_s=1.5"))
    weight = weight_n()
    held, gone = trial.force_n[200:1400, 1], trial.force_n[1600:2800, 1]
    assert held.mean() == pytest.approx(weight + 2.0 * G, abs=0.5)
    assert gone.mean() == pytest.approx(weight, abs=0.5)
    half = weight + G
    assert np.argmax(trial.force_n[:, 1] < half) == pytest.approx(1500, abs=5)


def test_an_unmeasured_contact_takes_its_mean_force_off_the_plate():
    target = "hand_l,start_s=0.8,end_s=2.4"
    trial = trial_with("static", ("unmeasured_contact", 80.0, target))
    weight = weight_n()
    assert trial.force_n[800:2400, 1].mean() == pytest.approx(weight - 80.0, abs=1.0)
    assert trial.force_n[2450:2900, 1].mean() == pytest.approx(weight, abs=1.0)


def test_a_constant_force_takes_itself_off_the_plate():
    trial = trial_with("static", ("external_force", 60.0, "upper_torso"))
    effect = effect_of("external_force", 60.0, "upper_torso")
    expected = [0.0, weight_n(), 0.0] - 60.0 * effect.direction
    np.testing.assert_allclose(trial.force_n.mean(axis=0), expected, atol=1.0)
    assert effect.facts(person_of(PERSON_SEED))["upwards_n"] > 57.0


def test_an_object_weighs_from_picking_up_to_putting_down():
    trial = trial_with("static", ("object_handled", 2.0, "hand_l"))
    effect = effect_of("object_handled", 2.0, "hand_l")
    start, end = (round(1000 * share * DURATION_S["static"]) for share in effect.window_share)
    weight, force = weight_n(), trial.force_n[:, 1]
    assert force[start + 60 : end - 60].mean() == pytest.approx(weight + 2.0 * G, abs=0.5)
    for part in (slice(20, start - 60), slice(end + 60, -20)):
        assert force[part].mean() == pytest.approx(weight, abs=1.0)


def test_an_implement_weighs_where_its_centre_is():
    """The person leans to balance it: the moment is that of all weights where they are."""
    trial, person = trial_with("static", ("implement", 0.5, "hand_r")), person_of(PERSON_SEED)
    effect, poses = effect_of("implement", 0.5, "hand_r"), trial.poses
    held = person.segment_inertias()["hand_r"].com_m + effect.centre_m
    parts = [(body, one.mass_kg, one.com_m) for body, one in person.inertias.items()]
    expected = np.zeros((2, 3))
    for body, mass_kg, place in (*parts, ("hand_r", 0.5, held)):
        weight = np.array([0.0, mass_kg * G, 0.0])
        at = poses.point(body, place)[trial.plan.keep].mean(axis=0)
        expected += weight, np.cross(at, weight)
    np.testing.assert_allclose(trial.force_n.mean(axis=0), expected[0], atol=0.3)
    np.testing.assert_allclose(trial.moment_nm.mean(axis=0), expected[1], atol=0.3)
    assert 0.3 <= effect.facts(person)["distance_m"] <= 0.9


def test_a_body_with_loads_still_obeys_newton_and_euler():
    """The whole person and all that is carried, by momenta of single masses."""
    trial = trial_with("squat", ("released_object", 3.0, "hand_l,release_s=9"))
    person = person_of(PERSON_SEED)
    poses, (ball,) = trial.poses, trial.plan.loads
    carried = poses.point(ball.body, ball.position_m)
    masses = [part.mass_kg for part in person.inertias.values()] + [3.0]
    points = [poses.point(body, part.com_m) for body, part in person.inertias.items()] + [carried]
    momentum = sum(m * derivative(r, 0.001) for m, r in zip(masses, points, strict=True))
    expected = derivative(momentum, 0.001) - sum(masses) * GRAVITY
    assert np.abs(trial.force_n - expected)[20:-20].max() < 1e-3


def test_a_wobbling_mass_rings_at_its_frequency_and_hangs_still_at_rest():
    t = np.arange(4000) * 0.001
    place = np.zeros((4000, 3))
    place[:, 1] = 0.01 * np.clip((t - 0.5) / 0.05, 0.0, 1.0) ** 2 * (t < 0.55) + 0.01 * (t >= 0.55)
    poses = Poses({"b": np.broadcast_to(np.eye(3), (4000, 3, 3))}, {"b": place}, np.zeros(4000))
    swing = Swinging("b", np.zeros(3), 2.0, 5.0, 0.1)
    force, moment = swing.wrench(poses, 0.001)
    assert np.abs(force[:450] - [0.0, 2.0 * G, 0.0]).max() < 1e-6
    ring = force[600:, 1] - 2.0 * G
    crossings = np.flatnonzero(np.diff(np.sign(ring)))[:6]
    period = 2.0 * np.diff(crossings).mean() * 0.001
    assert 1.0 / period == pytest.approx(5.0 * np.sqrt(1.0 - 0.1**2), rel=0.01)
    peaks = [np.abs(ring[a:b]).max() for a, b in pairwise(crossings)]
    decay = np.log(peaks[0] / peaks[2]) / (2.0 * np.pi)
    assert decay == pytest.approx(0.1 / np.sqrt(1.0 - 0.1**2), rel=0.05)
    assert np.abs(moment).max() < 1e-9


def test_a_wobbling_mass_is_part_of_the_segment():
    asked = ("wobbling_mass", 3.0, "upper_torso,frequency=5,damping=0.2")
    still = trial_with("static", asked)
    assert still.force_n[:, 1].mean() == pytest.approx(weight_n(), rel=1e-3)
    slow = trial_with("squat", asked).force_n - trial_with("squat").force_n
    quick = trial_with("hops", asked).force_n - trial_with("hops").force_n
    assert np.abs(quick).max() > 5.0 * np.abs(slow).max()
    with pytest.raises(UsageError, match="cannot wobble"):
        trial_with("squat", ("wobbling_mass", 20.0, "thigh_r"))


def test_breath_moves_as_much_mass_as_a_real_mass_would():
    """The dipole against a 5 kg mass that moves, less the same mass at rest."""
    t = np.arange(3000) * 0.001
    turning = about_z(0.3 * np.sin(2.0 * t))
    place = np.stack([0.1 * np.sin(3.0 * t), 1.2 + 0.05 * np.cos(2.0 * t), 0 * t], axis=1)
    poses = Poses({"thorax": turning}, {"thorax": place}, np.zeros(3000))
    com, mass = np.array([0.02, -0.2, 0.0]), 5.0
    dipole = 0.02 * np.sin(2.0 * np.pi * 0.25 * t)[:, None] * np.array([0.8, 0.6, 0.0])
    force, moment = ChestMotion("thorax", com, dipole).wrench(poses, 0.001)
    both = []
    for moved in (1.0, 0.0):
        r = place + np.einsum("tij,tj->ti", turning, com + moved * dipole / mass)
        pull = mass * (derivative(derivative(r, 0.001), 0.001) - GRAVITY)
        both.append((pull, np.cross(r, pull)))
    inner = slice(20, -20)
    assert np.abs(force - (both[0][0] - both[1][0]))[inner].max() < 1e-6
    assert np.abs(moment - (both[0][1] - both[1][1]))[inner].max() < 2e-3
    assert np.abs(moment)[inner].max() > 0.1


def test_the_trunk_is_stiff_unless_it_bends_by_the_asked_range():
    stiff = trial_with("squat").poses.rotation
    assert np.array_equal(stiff["abdomen"], stiff["thorax"])
    bent = trial_with("squat", ("missing_joint", 0.25, ""))
    spine = bent.plan.angles_rad["spine"][bent.plan.keep, 0]
    assert np.ptp(spine) == pytest.approx(0.25, rel=1e-6)
    between = np.swapaxes(bent.poses.rotation["abdomen"], 1, 2) @ bent.poses.rotation["thorax"]
    assert np.abs(between - np.eye(3)).max() > 0.2
    assert bent.plan.notes["missing_joint_range_rad"] == pytest.approx(0.25)


def test_a_segment_far_from_the_table_keeps_the_persons_mass():
    person = person_of(PERSON_SEED)
    heavy = effect_of("segment_inertia", 0.4, "thigh_l").person(person)
    total = sum(part.mass_kg for part in heavy.inertias.values())
    assert total == pytest.approx(person.mass_kg)
    ratio = heavy.inertias["thigh_l"].mass_kg / person.inertias["thigh_l"].mass_kg
    assert ratio == pytest.approx(1.4)
    assert all(is_physical(part) for part in heavy.segment_inertias().values())


@pytest.mark.parametrize("joint", ["hip_r", "shoulder_l", "knee_l", "ankle_r", "elbow_r"])
def test_a_joint_centre_lies_elsewhere_than_its_landmarks_say(joint):
    person = person_of(PERSON_SEED)
    effect = effect_of("joint_centre", 0.03, joint)
    moved = effect.person(person)
    assert np.linalg.norm(effect.shift_m) == pytest.approx(0.03)
    if joint in ("hip_r", "shoulder_l"):
        assert np.allclose(moved.joints_m[joint] - person.joints_m[joint], effect.shift_m)
        assert moved.markers == person.markers
    else:
        changed = [m for m in person.markers if moved.markers[m] is not person.markers[m]]
        assert changed
        for label in changed:
            shift = moved.markers[label].position_m - person.markers[label].position_m
            assert np.allclose(shift, -effect.shift_m)
