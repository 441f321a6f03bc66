"""Masses, contacts and tissue against mechanics written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.body.person import load_parameters
from bsip_cli.dynamics.joint_moments import Ground, Spread, joint_loads
from bsip_cli.effects.body import OUTWARD, Breathing, SegmentInertia, WobblingMass
from bsip_cli.effects.loads import RAMP_S, AddedMass, ReleasedObject, UnmeasuredContact
from tests.effects.moving_scene import RATE_HZ, moving, part_of, phi_with, rms, standing_still

G = 9.80665
UP = np.array([0.0, 0.0, G])
TIMES = moving().times_s


def place(scene, segment: str, offset=(0.0, 0.0, 0.0)) -> np.ndarray:
    """(N, 3) of a point ``offset`` from a segment's centre of mass."""
    i, body = scene.person.skeleton.index(segment), scene.phi[part_of(scene, segment)]
    local = body[1:4] / body[0] + offset
    return scene.motion.position_m[:, i] + scene.motion.rotation[:, i] @ local


def fall(path: np.ndarray) -> np.ndarray:
    """(N, 3) acceleration of a path less gravity, by differences."""
    speed = np.gradient(path, 1 / RATE_HZ, axis=0, edge_order=2)
    return np.gradient(speed, 1 / RATE_HZ, axis=0, edge_order=2) + UP


def carried(path: np.ndarray) -> np.ndarray:
    """(N, 6) ground wrench of 1 kg on a path."""
    return np.hstack([fall(path), np.cross(path, fall(path))])


def test_a_mass_that_moves_is_another_body_of_the_tree():
    """To first order in the place: its own inertia about the segment's centre is left out."""
    scene, offset = moving(), np.array([0.003, -0.01, 0.002])
    values = np.array([2.0, *(2.0 * offset)])
    place_m = scene.centre_of("thigh_r") + offset
    heavier = scene.phi + load_parameters([("thigh_r", 2.0, place_m)], scene.person)
    change = AddedMass().change(scene, "thigh_r", values)
    np.testing.assert_allclose(change, scene.wrench_of(heavier) - scene.predicted, atol=5e-3)
    assert np.abs(change - 2.0 * carried(place(scene, "thigh_r")))[20:-20, 3:].max() > 0.1
    reported = {name: value for name, _, value in AddedMass().reported(scene, "thigh_r", values)}
    told = [reported[f"position_{axis}"] for axis in "xyz"]
    np.testing.assert_allclose(told, place_m, atol=1e-12)
    assert reported["mass"] == 2.0


def test_an_object_weighs_until_it_is_let_go():
    scene = moving()
    change = ReleasedObject().change(scene, "hand_r", np.array([1.5, 3.0]))
    held = TIMES < 2.99
    expected = 1.5 * carried(place(scene, "hand_r"))
    assert rms(change[held] - expected[held]).max() < 0.02 * rms(expected[held]).max()
    assert not change[TIMES > 3.01].any()


def test_a_contact_takes_its_force_off_the_plates():
    scene, force = moving(), np.array([10.0, -20.0, 80.0])
    values = np.array([*force, 3.0, 2.0])
    change = UnmeasuredContact().change(scene, "hand_l", values)
    inside = np.abs(TIMES - 3.0) <= 1.0
    np.testing.assert_allclose(change[inside, :3].mean(axis=0), -force, rtol=0.02)
    full = np.abs(TIMES - 3.0) < 0.69
    assert np.ptp(change[full, :3], axis=0).max() < 1e-9
    moment = np.cross(place(scene, "hand_l"), change[:, :3])
    np.testing.assert_allclose(change[:, 3:], moment, atol=1e-9)
    assert not change[np.abs(TIMES - 3.0) > 1.02].any()
    reported = [(name, value) for name, _, value in UnmeasuredContact().reported(scene, "", values)]
    size = float(np.linalg.norm(force))
    assert reported[:3] == [("start", 2.0), ("end", 4.0), ("force", pytest.approx(size))]


@pytest.mark.parametrize(
    ("effect", "target", "values", "until_s", "possible"),
    [
        (AddedMass(), "head", [3.0, 0.0, 0.5, 0.0], 6.0, True),
        (AddedMass(), "head", [0.5, 0.0, 1.6, 0.0], 6.0, False),  # a moment out of reach
        (AddedMass(), "head", [-1.0, 0.0, 0.0, 0.0], 6.0, False),
        (ReleasedObject(), "hand_r", [1.5, 3.0], 6.0, True),
        (ReleasedObject(), "hand_r", [1.5, 0.8], 6.0, False),  # too short with or without it
        (ReleasedObject(), "hand_r", [1.5, 5.2], 6.0, False),
        (ReleasedObject(), "hand_r", [1.5, 3.0], 3.5, False),
        (UnmeasuredContact(), "hand_l", [0.0, 0.0, 50.0, 3.0, 1.0], 6.0, True),
        (UnmeasuredContact(), "hand_l", [0.0, 0.0, 50.0, 3.0, 0.5], 6.0, False),
        (UnmeasuredContact(), "hand_l", [0.0, 0.0, 50.0, 3.0, 1.0], 3.0, False),
        (WobblingMass(), "thigh_l", [2.0, 4.0, 0.2, 1.5], 6.0, True),
        (WobblingMass(), "thigh_l", [0.1, 4.0, 0.2, 1.5], 6.0, False),  # to the sides only
    ],
)
def test_what_is_possible(effect, target, values, until_s, possible):
    scene = replace(moving(), valid=until_s > TIMES)
    assert bool(effect.possible(scene, target, np.array(values))) is possible


def test_in_a_throw_less_than_a_second_is_enough():
    """Of 2.2 s a quarter on either side; every moment that is tried can be the one."""
    effect, scene = ReleasedObject(), moving()
    throw = replace(scene, valid=(TIMES >= 2.0) & (TIMES < 4.2))
    assert effect.possible(throw, "hand_r", np.array([0.3, 2.6]))
    assert not effect.possible(throw, "hand_r", np.array([0.3, 2.4]))
    for one in (throw, scene):
        moments = [moment for (moment,) in effect.scans(one, "hand_r")]
        assert len(moments) >= 3 and np.diff(moments).max() <= 0.5
        assert all(effect.possible(one, "hand_r", np.array([0.3, t])) for t in moments)


def test_a_contact_may_have_begun_while_nothing_was_measured():
    effect = UnmeasuredContact()
    scene = replace(moving(), valid=(TIMES < 1.0) | (TIMES >= 3.0))
    long = np.array([10.0, 0.0, 50.0, 3.25, 2.5])  # from 2.0 to 4.5 s
    windows = effect.alike(scene, "hand_l", long)
    starts, ends = (windows[:, 3] + side * windows[:, 4] / 2 for side in (-1, 1))
    np.testing.assert_allclose(ends, 4.5)
    assert starts[0] == pytest.approx(3.0 - RAMP_S, abs=0.02)
    assert starts[-1] == pytest.approx(1.0, abs=0.02)
    for one in windows:
        change = effect.change(scene, "hand_l", one) - effect.change(scene, "hand_l", long)
        assert np.abs(change[scene.valid]).max() < 1e-9


def test_a_contact_that_is_seen_to_begin_began_then():
    scene, seen = moving(), np.array([10.0, 0.0, 50.0, 3.25, 2.5])
    np.testing.assert_allclose(
        UnmeasuredContact().alike(scene, "hand_l", seen)[[0, -1]], [seen] * 2
    )


@pytest.mark.parametrize(
    ("rise_s", "peak", "is_impact"), [(0.03, 1.6, True), (0.4, 2.4, False), (0.03, 0.3, False)]
)
def test_an_impact_is_a_change_of_force_within_moments(rise_s, peak, is_impact):
    """Heels that drop push with less than a fast squat and within a tenth of the time. peak : of
    the vertical force above its least, body weights."""
    still = standing_still(2.0)
    weight = still.mass_kg * GRAVITY_M_S2
    wrench = np.zeros((len(still.times_s), 6))
    wrench[:, 2] = weight * peak * np.clip((still.times_s - 1.0) / rise_s, 0.0, 1.0)
    landed = replace(still, wrench=wrench)
    assert bool(WobblingMass().targets(landed)) is is_impact


@pytest.mark.parametrize(("frequency", "damping"), [(3.0, 0.1), (6.5, 0.3)])
def test_a_wobbling_mass_is_an_oscillator_on_a_moving_ground(frequency, damping):
    scene, pace = moving(), 2 * np.pi * frequency
    path = place(scene, "thigh_l")
    ground = scene.centre("thigh_l").acceleration_m_s2

    def rate(t, state):
        push = np.array([np.interp(t, TIMES, column) for column in ground.T]) - ground[0]
        u, du = state[:3], state[3:]
        return np.concatenate([du, -2 * damping * pace * du - pace**2 * u - push])

    found = solve_ivp(rate, (0, TIMES[-1]), np.zeros(6), t_eval=TIMES, rtol=1e-9, atol=1e-10)
    u, du = found.y[:3].T, found.y[3:].T
    swing = -2 * damping * pace * du - pace**2 * u - (ground - ground[0])
    own = ground + swing + UP
    both = np.hstack([own, np.cross(path + u, own)])
    stiff = np.hstack([ground + UP, np.cross(path, ground + UP)])
    change = WobblingMass().change(scene, "thigh_l", np.array([1.0, frequency, damping, 1.0]))
    np.testing.assert_allclose(change, both - stiff, atol=2e-3 * np.abs(change).max())
    upright = WobblingMass().change(scene, "thigh_l", np.array([1.0, frequency, damping, 0.0]))
    np.testing.assert_array_equal(upright[:, 2], change[:, 2])
    assert not upright[:, :2].any()


def test_breath_moves_a_mass_out_and_back():
    scene, tiny = moving(), 1e-6
    values = np.array([0.06, -0.08, 0.3])
    phase = 2 * np.pi * 0.3 * TIMES
    course = 0.06 * np.cos(phase) - 0.08 * np.sin(phase)
    i = scene.person.skeleton.index("upper_torso")
    out = scene.motion.rotation[:, i] @ OUTWARD
    still = place(scene, "upper_torso")
    moved = carried(still + tiny * course[:, None] * out)
    expected = (moved - carried(still)) / tiny
    change = Breathing().change(scene, "upper_torso", values)
    assert rms(change - expected).max() < 0.01 * rms(expected).max()
    amplitude, frequency = Breathing().reported(scene, "upper_torso", values)
    assert amplitude == ("amplitude", "kg m", pytest.approx(0.1))
    assert frequency == ("frequency", "Hz", 0.3)


TINY = 1e-4  # [kg, m, 1]


def heavier(x: Inertia) -> Inertia:
    share = 1 + TINY / x.mass_kg
    return Inertia(share * x.mass_kg, x.com_m, share * x.tensor_kgm2)


def lower(x: Inertia) -> Inertia:
    return replace(x, com_m=x.com_m - [0.0, 0.0, TINY])


def wider(x: Inertia) -> Inertia:
    return replace(x, tensor_kgm2=(1 + TINY) * x.tensor_kgm2)


@pytest.mark.parametrize("segment", ["upper_torso", "shank_r", "head"])
@pytest.mark.parametrize(
    ("values", "other"),
    [([1, 0, 0, 0, 0], heavier), ([0, 0, 0, -1, 0], lower), ([0, 0, 0, 0, 1], wider)],
)
def test_another_inertia_is_another_simulation(segment, values, other):
    scene = moving()
    usual = scene.phi[part_of(scene, segment)]
    phi = phi_with(scene, segment, other(from_phi(usual)).phi() - usual)
    expected = scene.wrench_of(phi) - scene.predicted
    change = SegmentInertia().change(scene, segment, TINY * np.array(values, dtype=float))
    assert rms(change - expected).max() < 0.01 * rms(expected).max()


def test_the_share_of_the_error_that_a_segment_makes():
    scene = moving()
    usual = scene.phi[part_of(scene, "thigh_r")]
    fast = replace(scene, phi=phi_with(scene, "thigh_r", 0.2 * usual))
    excess = np.array([-0.2 * usual[0], 0.0, 0.0, 0.0, 0.0])
    shares = SegmentInertia().reported(fast, "thigh_r", excess)
    assert [name for name, *_ in shares] == ["share", "cop_share"]
    np.testing.assert_allclose([value for *_, value in shares], 1, atol=1e-6)
    half = SegmentInertia().reported(fast, "thigh_r", 0.5 * excess)[0][2]
    assert half == pytest.approx(0.75)
    assert SegmentInertia().possible(fast, "thigh_r", excess)
    assert not SegmentInertia().possible(fast, "thigh_r", 7 * excess)


@pytest.mark.parametrize("target", ["hand_l", "thigh_r"])
def test_a_mass_loads_the_joints_on_its_way_to_the_pelvis_as_another_body_does(target):
    scene = moving()
    heavier = scene.phi + load_parameters([(target, 2.0, scene.centre_of(target))], scene.person)
    assert AddedMass.on_its_segment
    change = AddedMass().change(scene, target, np.array([2.0, 0.0, 0.0, 0.0]))
    silent = np.zeros_like(change)
    motion = (scene.person, scene.q, scene.v, scene.a)
    known = Spread((None,), 0.0)
    as_body = joint_loads(*motion, heavier[:, None], {}, known)
    as_force = joint_loads(
        *motion, scene.phi[:, None], {target: Ground(-change, silent, np.zeros(3))}, known
    )
    bare = joint_loads(*motion, scene.phi[:, None], {}, known)
    np.testing.assert_allclose(as_force.moment_Nm, as_body.moment_Nm, atol=1e-8)
    changed = np.abs(as_body.moment_Nm - bare.moment_Nm).max(axis=(0, 2, 3)) > 1e-6
    way = {"hand_l": {"wrist_l", "elbow_l", "shoulder_l", "waist"}, "thigh_r": {"hip_r"}}
    assert {j for j, yes in zip(bare.joints, changed, strict=True) if yes} == way[target]
