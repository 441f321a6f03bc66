"""What must hold of every effect: nothing at the null, right derivatives, words for people."""

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.effects.body import WobblingMass
from bsip_cli.effects.catalogue import CATALOGUE, EFFECTS
from bsip_cli.effects.effect import ABOUT, Effect
from bsip_cli.effects.nameless import NAMELESS
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.inverse_kinematics import posed
from tests.body.standing_person import standing
from tests.effects.moving_scene import moving, some, values_of

VOCABULARY = """
sync_offset clock_drift frame_rate plate_translation plate_rotation plate_gain plate_crosstalk
plate_zero plate_drift gravity_tilt added_mass released_object wobbling_mass breathing
unmeasured_contact joint_centre missing_joint marker_shift marker_swap over_smoothing
segment_inertia implement camera_frame external_force object_handled marker_slide
"""
UNITS = {"m", "rad", "1", "s", "Hz", "kg", "kg m", "kg m2", "N", "N m", "N/s", "N m/s"}
EVERY = [pytest.param(effect, id=effect.name) for effect in CATALOGUE]
NAMELESS_TOO = [*EVERY, *(pytest.param(one, id=type(one).__name__) for one in NAMELESS)]


def scene_with_swapped_markers() -> Scene:
    """Residuals as exchanged labels leave them if the pose does not follow; and an impact."""
    scene, names = landing(), standing().person.markers
    seen = scene.markers_m.copy()
    a, b = names.index("RKNEM"), names.index("LKNEM")
    seen[200:320, [a, b]] = seen[200:320, [b, a]]
    residual = posed(scene.person, scene.q).residuals(seen)
    return replace(scene, residual_m=residual, robust_limit_m=0.025)


def landing() -> Scene:
    """The moving person, on the first of whose plates twice the body weight lands for a moment."""
    scene = moving()
    first, *others = scene.plates
    push = 2 * scene.predicted[:, 2].mean() * np.exp(-0.5 * ((scene.times_s - 2.5) / 0.05) ** 2)
    shown = first.wrench + push[:, None] * [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    return replace(scene, plates=(replace(first, wrench=shown), *others))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_with_swapped_markers()


def test_the_catalogue_is_the_vocabulary():
    assert [effect.name for effect in CATALOGUE] == VOCABULARY.split() == list(EFFECTS)


def test_the_table_says_only_what_an_effect_has():
    attributes = Effect.__annotations__.keys()
    assert all(about.keys() <= attributes for about in ABOUT.values())
    assert all(type(effect).name == name for name, effect in zip(ABOUT, CATALOGUE, strict=True))


@pytest.mark.parametrize("effect", NAMELESS_TOO)
def test_nothing_changes_at_the_null(effect, scene):
    for target in some(effect, scene):
        values = values_of(effect, scene, target, 0.0)
        change = effect.change(scene, target, values)
        assert change.shape == scene.predicted.shape
        np.testing.assert_allclose(change, 0, atol=1e-8)
        moved = effect.marker_change(scene, target, values)
        assert moved is None or (moved.shape == scene.markers_m.shape and not moved.any())


@pytest.mark.parametrize("effect", NAMELESS_TOO)
@pytest.mark.parametrize("size", [0.0, 1.0])
def test_the_tangent_is_the_derivative(effect, scene, size):
    """By differences of fourth order, at ``size`` times typical."""
    for target in some(effect, scene):
        values = values_of(effect, scene, target, size)
        tangent = effect.tangent(scene, target, values)
        at = [k for k, p in enumerate(effect.parameters(scene, target)) if not p.scan]
        assert tangent.shape == (*scene.predicted.shape, len(at))
        for column, k in enumerate(at):
            step = np.zeros(len(values))
            step[k] = 1e-2 * effect.parameters(scene, target)[k].typical

            def moved(n, target=target, values=values, step=step):
                return effect.change(scene, target, values + n * step)

            far, near = moved(2) - moved(-2), moved(1) - moved(-1)
            expected = (8 * near - far) / (12 * step[k])
            scale = max(float(np.abs(expected).max()), 1e-9)
            np.testing.assert_allclose(tangent[..., column], expected, atol=1e-4 * scale)


@pytest.mark.parametrize("effect", EVERY)
def test_a_typical_size_is_possible_visible_and_in_words(effect, scene):
    target = effect.targets(scene)[0]
    values = values_of(effect, scene, target, 1.0)
    if effect.name == "added_mass":
        values[1:] /= 10  # of 0.5 kg, not of 5
    if effect.name == "segment_inertia":
        values[4:] = 0
        values[1:4] = 0
    values.setflags(write=False)  # as those of a table are
    assert effect.change(scene, target, values).any()
    assert effect.possible(scene, target, values)
    assert np.abs(effect.change(scene, target, values)).max() > 0.1
    words = effect.words(scene, target, values)
    sentence = words.what
    assert sentence.startswith(words.short) and len(words.short) < len(sentence)
    assert "_" not in sentence and not sentence.endswith(".") and len(sentence) > 20
    assert effect.remedy and "_" not in effect.remedy


@pytest.mark.parametrize("effect", EVERY)
def test_reports_numbers_with_units(effect, scene):
    for target in some(effect, scene):
        reported = effect.reported(scene, target, values_of(effect, scene, target, 1.0))
        assert reported
        for name, unit, value in reported:
            assert name.isidentifier() and unit in UNITS and isinstance(value, float)
            assert np.isfinite(value) or effect.name == "segment_inertia"


@pytest.mark.parametrize("effect", EVERY)
def test_scans_lie_within_the_bounds(effect, scene):
    for target in some(effect, scene):
        for p in effect.parameters(scene, target):
            assert p.unit in UNITS and p.typical > 0 and p.least < p.most
            assert all(p.least <= x <= p.most for x in p.scan)
            assert p.scan or p.least <= 0 <= p.most
        scanned = [p for p in effect.parameters(scene, target) if p.scan]
        for values in effect.scans(scene, target):
            assert all(p.least <= x <= p.most for p, x in zip(scanned, values, strict=True))


@pytest.mark.parametrize("effect", EVERY)
def test_beyond_the_bounds_nothing_is_possible(effect, scene):
    target = effect.targets(scene)[0]
    far = [2 * p.most + 1 for p in effect.parameters(scene, target)]
    assert not effect.possible(scene, target, np.array(far))


@pytest.mark.parametrize("effect", [e for e in CATALOGUE if e.name != "segment_inertia"])
def test_at_a_bound_it_would_go_beyond(effect, scene):
    """On either side: what a fit has clipped is no estimate. A segment's bounds are a body's."""
    target = effect.targets(scene)[0]
    for k, p in enumerate(effect.parameters(scene, target)):
        for bound in () if p.scan else (p.least, p.most):
            values = values_of(effect, scene, target, 0.01)
            values[k] = bound
            assert not effect.possible(scene, target, values)


def test_what_can_last():
    """Faults of the lab and facts of the person are the same in all trials; an event is not."""
    assert {effect.scope for effect in CATALOGUE} == {"laboratory", "person", "trial"}
    shared = {name for name, effect in EFFECTS.items() if effect.is_shared}
    assert {"sync_offset", "plate_gain", "joint_centre"} <= shared
    events = {"added_mass", "released_object", "unmeasured_contact", "marker_shift"}
    assert shared.isdisjoint(events)


def test_soft_tissue_is_looked_for_only_after_an_impact(scene):
    assert WobblingMass().targets(moving()) == ()
    assert "thigh_l" in WobblingMass().targets(scene)
    unseen = replace(scene, valid=np.abs(scene.times_s - 2.5) > 0.5)
    assert WobblingMass().targets(unseen) == ()
