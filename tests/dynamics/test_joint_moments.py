"""Joint moments against Newton and Euler for each body, from where it moves in the world.

Nothing of the product enters the truth: segments' places come from Pinocchio's forward kinematics,
momenta from differences of them over time, sums over bodies one by one.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.dynamics.ground_wrench import pinocchio_model, predicted_wrench
from bsip_cli.dynamics.joint_moments import Ground, Spread, axes_of, joint_loads, of_accelerations
from tests.body.standing_person import Swing, joint_frames, parameters_of, standing, with_girdle
from tests.dynamics.newton_euler import driving_wrench, joint_axes
from tests.exports.exported_person import identified_person

STEP_S = 1e-3
G = np.array([0.0, 0.0, -9.80665])
CHECKED = ("ankle", "knee", "hip", "shoulder", "elbow", "wrist", "waist", "neck")
KNOWN = Spread((None,), 0.0)


@cache
def motion(girdle: bool = False, seed: int = 3):
    """A second at 1 kHz: person, bodies, q, v, a."""
    body = identified_person(girdle)
    start = (with_girdle() if girdle else standing()).q
    swing = Swing(pinocchio_model(body.person), start, seed, 0.4)
    return body, *swing.sampled(1.0, 1 / STEP_S)[1:]


def newton_euler(body, q):
    """By segment: (N, 6) force and moment about the world's origin that drive its body."""
    person = body.person
    R, p = joint_frames(person, q)
    wrenches = {}
    for i, inertia in zip(person.skeleton.bodies, body.inertias, strict=True):
        com = p[:, i] + R[:, i] @ (inertia.com_m + person.origin_in_joint_m[i])
        wrenches[person.skeleton.segments[i]] = driving_wrench(
            R[:, i], com, inertia.mass_kg, inertia.tensor_kgm2, G, STEP_S
        )
    return R, p, wrenches


def beyond(skeleton, segment):
    found = [segment]
    for name, parent in zip(skeleton.segments, skeleton.parents, strict=True):
        if parent >= 0 and skeleton.segments[parent] in found:
            found.append(name)
    return found


def feet(count: int) -> dict[str, Ground]:
    """Something under each foot that varies, right more than left."""
    t = np.arange(count) * STEP_S
    course = np.stack([50 * np.sin(7 * t), 40 * np.cos(5 * t), 500 + 300 * np.sin(9 * t)], axis=1)
    at = np.array([[0.1, -0.1, 0.0]])
    right = np.hstack([course, np.cross(at, course)])
    none = np.zeros((count, 6))
    return {
        "foot_r": Ground(right, none, np.zeros(3)),
        "foot_l": Ground(0.6 * right, none, np.zeros(3)),
    }


def phi_of(body) -> np.ndarray:
    return parameters_of(body.person, body.inertias)[:, None]


def at_rest(person, q, phi, ground, spread=KNOWN):
    """Joint loads of one still pose (nq,)."""
    still = np.zeros((1, len(person.skeleton.v_names)))
    return joint_loads(person, q[None], still, still, phi, ground, spread)


def pushed(wrench: np.ndarray) -> dict[str, Ground]:
    """By a known wrench (6,) under the right foot."""
    return {"foot_r": Ground(wrench[None], np.zeros((1, 6)), np.zeros(3))}


NO_MASS = np.zeros((150, 1))


@pytest.mark.parametrize("girdle", [False, True])
def test_net_moments_are_those_of_newton_and_euler(girdle):
    body, q, v, a = motion(girdle)
    skeleton, ground = body.person.skeleton, feet(len(q))
    found = joint_loads(body.person, q, v, a, phi_of(body), ground, KNOWN, block=300)
    R, p, wrenches = newton_euler(body, q)
    inner = slice(8, -8)
    for j, joint in enumerate(found.joints):
        i = j + 1
        segments, parent = beyond(skeleton, skeleton.segments[i]), skeleton.parents[i]
        total = sum(wrenches[s] for s in segments if s in wrenches)
        total = total - sum(ground[s].wrench for s in segments if s in ground)
        force, moment = total[:, :3], total[:, 3:] - np.cross(p[:, i], total[:, :3])
        axes = joint_axes(R[:, parent], R[:, i], -1.0 if joint.endswith("_l") else 1.0)
        for axis, e in enumerate(axes.swapaxes(0, 1)):
            expected_moment = (moment * e).sum(axis=1)[inner]
            expected_force = (force * e).sum(axis=1)[inner]
            limit = max(0.01 * np.abs(moment[inner]).max(), 0.1)
            assert np.abs(found.moment_Nm[inner, j, axis, 0] - expected_moment).max() < 0.01 * limit
            assert np.abs(found.force_N[inner, j, axis, 0] - expected_force).max() < 0.1
    assert {j.removesuffix("_l").removesuffix("_r") for j in found.joints} >= set(CHECKED)


def test_powers_of_all_axes_are_the_power_of_the_joint():
    """A hinge's moment about its own axis by Pinocchio, times its rate; all joints together the
    work of the actuators."""
    body, q, v, a = motion()
    model, person = pinocchio_model(body.person), body.person
    for joint, part in zip(person.skeleton.bodies, phi_of(body).reshape(-1, 10), strict=True):
        model.inertias[joint + 1] = pin.Inertia.FromDynamicParameters(part)
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])
    found = joint_loads(person, q, v, a, phi_of(body), {}, KNOWN)
    power = np.einsum("njxk->nj", found.power_W)
    for j in range(len(found.joints)):
        start = person.skeleton.v_starts[j + 1]
        width = 1 if person.skeleton.joint_types[j + 1] == "revolute" else 3
        own = slice(start, start + width)
        np.testing.assert_allclose(power[:, j], (torque[:, own] * v[:, own]).sum(axis=1), atol=1e-8)


def test_the_pelvis_lacks_the_residual_of_the_whole_body():
    body, q, v, a = motion()
    person, ground = body.person, feet(len(q))
    _, _, wrenches = newton_euler(body, q)
    whole = predicted_wrench(pinocchio_model(person), q, v, a, phi_of(body), np.zeros(3))[..., 0]
    residual = sum(g.wrench for g in ground.values()) - whole
    found = joint_loads(person, q, v, a, phi_of(body), ground, KNOWN)
    R, p, _ = newton_euler(body, q)
    missing = -wrenches["lower_torso"]
    for joint in ("hip_l", "hip_r", "waist"):
        j = found.joints.index(joint)
        i = j + 1
        axes = joint_axes(R[:, 0], R[:, i], -1.0 if joint.endswith("_l") else 1.0)
        force = np.linalg.solve(axes, found.force_N[:, j])[..., 0]
        moment = np.linalg.solve(axes, found.moment_Nm[:, j])[..., 0]
        missing = missing - np.hstack([force, moment + np.cross(p[:, i], force)])
    inner = slice(8, -8)
    np.testing.assert_allclose(missing[inner], residual[inner], atol=0.05)


def test_both_sides_mean_the_same():
    """Mirrored hips: the same flexion, adduction and rotation moments under mirrored forces."""
    person = identified_person().person
    i, j = (person.skeleton.index(f"thigh_{side}") for side in "lr")
    joints, place = person.joint_in_parent_m.copy(), person.joint_in_parent_m[j]
    joints[i] = place * [1, 1, -1]
    zero = np.zeros_like(person.parent_tilt_rad)
    same = replace(person, joint_in_parent_m=joints, parent_tilt_rad=zero, child_tilt_rad=zero)
    push, none = np.array([30.0, 70.0, 20.0]), np.zeros((1, 6))
    at = same.joint_positions_m()[j] + [0.05, -0.8, 0.03]
    ground = {}
    for side, sign in (("r", 1.0), ("l", -1.0)):
        force = push * [1, 1, sign]
        wrench = np.hstack([force, np.cross(at * [1, 1, sign], force)])[None]
        ground[f"foot_{side}"] = Ground(wrench, none, np.zeros(3))
    found = at_rest(same, pin.neutral(pinocchio_model(same)), NO_MASS, ground)
    left, right = (found.moment_Nm[0, found.joints.index(f"hip_{s}"), :, 0] for s in "lr")
    np.testing.assert_allclose(left, right, atol=1e-9)
    assert np.abs(right).min() > 0.05


def test_a_force_ahead_of_the_ankle_asks_for_plantarflexion():
    """Standing on the toes of the right foot: plantarflexion, knee and hip as textbooks have it."""
    person, q = standing().person, standing().q
    (R,), (p,) = joint_frames(person, q[None])
    force = np.array([0.0, 0.0, 700.0])
    place = p[person.skeleton.index("foot_r")] + 0.12 * R[0] @ [1.0, 0, 0]
    ground = pushed(np.hstack([force, np.cross(place, force)]))
    found = at_rest(person, q, NO_MASS, ground)
    j = found.joints.index("ankle_r")
    assert axes_of("ankle_r")[0] == "dorsiflexion"
    assert found.moment_Nm[0, j, 0, 0] == pytest.approx(-0.12 * 700, rel=0.05)


def test_an_axis_without_direction_is_no_number():
    """An arm raised to the side: first and third axis of the shoulder are one line."""
    person = standing().person
    q = pin.neutral(pinocchio_model(person))
    at = person.skeleton.q_starts[person.skeleton.index("upper_arm_r")]
    q[at : at + 4] = pin.Quaternion(pin.exp3(np.array([-np.pi / 2, 0.0, 0.0]))).coeffs()
    found = at_rest(person, q, np.ones((150, 1)), {})
    j = found.joints.index("shoulder_r")
    np.testing.assert_array_equal(np.isfinite(found.moment_Nm[0, j, :, 0]), [True, False, True])
    assert not np.isfinite(found.power_W[0, j]).any()


# --- standard deviations ----------------------------------------------------------------------


def drawn(change, count=400):
    """Root mean square of differences that a draw makes, over draws."""
    rng = np.random.default_rng(11)
    return np.sqrt(np.mean([change(rng) ** 2 for _ in range(count)], axis=0))


def few():
    body, q, v, a = motion()
    return body, *(x[::250] for x in (q, v, a))


def test_parameters_spread_as_drawn_bodies_do():
    body, q, v, a = few()
    phi, rng = phi_of(body), np.random.default_rng(4)
    root = 0.05 * np.abs(phi) * rng.normal(size=(len(phi), 20))
    draws = phi + root @ rng.normal(size=(20, 4000))
    spread = Spread((root @ root.T,), 0.0)
    found = joint_loads(body.person, q, v, a, phi, {}, spread)
    many = joint_loads(body.person, q, v, a, draws, {}, Spread((None,) * 4000, 0.0))
    np.testing.assert_allclose(found.moment_sd_Nm[..., 0], many.moment_Nm.std(axis=3), rtol=0.06)
    np.testing.assert_allclose(found.force_sd_N[..., 0], many.force_N.std(axis=3), rtol=0.06)


def test_plates_and_centres_spread_as_drawn_ones_do():
    body, q, v, a = few()
    person, phi, at = body.person, phi_of(body), np.array([0.2, 0.1, 0.0])
    noise = np.array([2.0, 3.0, 4.0, 0.5, 0.6, 0.7])
    ground = {
        s: Ground(g.wrench[: len(q)], np.tile(noise, (len(q), 1)), at) for s, g in feet(900).items()
    }
    found = joint_loads(person, q, v, a, phi, ground, KNOWN)
    plain = joint_loads(person, q, v, a, phi, ground, KNOWN).moment_Nm

    def change(rng):
        draw = noise * rng.normal(size=(len(q), 6))
        draw[:, 3:] += np.cross(at, draw[:, :3])
        moved = {s: replace(g, wrench=g.wrench + draw) for s, g in ground.items()}
        return joint_loads(person, q, v, a, phi, moved, KNOWN).moment_Nm - plain

    legs = [j for j, name in enumerate(found.joints) if name[:-2] in ("hip", "knee", "ankle")]
    np.testing.assert_allclose(found.moment_sd_Nm[:, legs], drawn(change)[:, legs], rtol=0.2)


def test_a_centre_that_is_off_is_a_lever_of_the_joints_force():
    """A foot without mass under which something pushes: the moment errs by force times way."""
    person, q = standing().person, standing().q
    wrench = np.array([30.0, 40.0, 700.0, 5.0, 6.0, 7.0])
    found = at_rest(person, q, NO_MASS, pushed(wrench), Spread((None,), 0.01))
    j = found.joints.index("hip_r")
    first = joint_frames(person, q[None])[0][0, 0] @ [0, 0, 1]
    expected = 0.01 * np.linalg.norm(np.cross(wrench[:3], first))
    assert found.moment_sd_Nm[0, j, 0, 0] == pytest.approx(expected)


def test_frames_that_are_turned_show_what_lies_across():
    """Drawn turns of pelvis and thigh in their own axes, of a moment known in the world."""
    person, q = standing().person, standing().q
    wrench = np.array([30.0, 40.0, 700.0, 50.0, 60.0, 70.0])
    rng = np.random.default_rng(1)
    roots = rng.normal(0, 0.01, (len(person.skeleton.segments), 3, 3))
    turns = roots @ roots.swapaxes(1, 2)
    found = at_rest(person, q, NO_MASS, pushed(wrench), Spread((None,), 0.0, turns))
    j = found.joints.index("hip_r")
    (R,), (p,) = joint_frames(person, q[None])
    moment = -(wrench[3:] - np.cross(p[j + 1], wrench[:3]))
    pelvis, thigh = (
        R[i] @ Rotation.from_rotvec(rng.normal(size=(20000, 3)) @ roots[i].T).as_matrix()
        for i in (0, j + 1)
    )
    shown = [(e @ moment).std() for e in joint_axes(pelvis, thigh, 1.0).swapaxes(0, 1)]
    np.testing.assert_allclose(found.moment_sd_Nm[0, j, :, 0], shown, rtol=0.03)


def test_accelerations_spread_as_drawn_ones_do():
    body, q, v, a = few()
    person, phi, rng = body.person, phi_of(body), np.random.default_rng(8)
    root = rng.normal(size=(a.shape[1], a.shape[1])) * 0.1
    covariance = np.tile(root @ root.T, (len(q), 1, 1))
    force, moment = of_accelerations(person, q, phi[:, 0], covariance)
    plain = joint_loads(person, q, v, a, phi, {}, KNOWN)

    def change(rng):
        other = a + rng.normal(size=a.shape) @ root.T
        return (
            joint_loads(person, q, v, other, phi, {}, KNOWN).moment_Nm[..., 0]
            - plain.moment_Nm[..., 0]
        )

    np.testing.assert_allclose(moment, drawn(change), rtol=0.2)
    assert (force > 0).all()


def test_errors_between_computed_frames_lie_on_lines():
    body, q, v, a = motion()
    few = slice(0, 200)
    count = len(phi := np.concatenate([i.phi() for i in body.inertias]))
    spread = Spread((1e-4 * np.eye(count),), 0.0)
    each, thin = (
        joint_loads(body.person, q[few], v[few], a[few], phi[:, None], {}, spread, every=n)
        for n in (1, 10)
    )
    np.testing.assert_array_equal(thin.moment_sd_Nm[:200:10], each.moment_sd_Nm[:200:10])
    np.testing.assert_allclose(thin.moment_sd_Nm, each.moment_sd_Nm, rtol=0.02)
    np.testing.assert_array_equal(thin.moment_Nm, each.moment_Nm)
