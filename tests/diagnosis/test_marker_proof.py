"""What markers prove by themselves, in residuals of skin that slides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from bsip_cli.diagnosis import marker_proof
from bsip_cli.diagnosis.findings import Finding, interval_words
from bsip_cli.diagnosis.marker_proof import CLEAR, PROVEN, Proof, Slip, proofs_of
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import all_of, noisy
from tests.effects.moving_scene import moving

SKIN_M, SLOW_S, DURATION_S = 0.003, 0.4, 12.0
SLIP = Slip("LKNEL", 5.0, 12.0)


def skin(scene: Scene, size_m: float) -> np.ndarray:
    """(N, m, 3) errors of this size that come and go within SLOW_S."""
    shape = (len(scene.times_s), len(scene.person.markers), 3)
    drawn = np.random.default_rng(5).standard_normal(shape)
    slow = gaussian_filter1d(drawn, SLOW_S * scene.rate_hz, axis=0)
    return size_m * slow / slow.std()


def seen(name: str = "", target: str = "", *values: float, skin_m: float = SKIN_M) -> Scene:
    """The moving person whose markers slide, and leave what an effect makes of them."""
    scene = noisy(moving(DURATION_S), 3)
    residual = skin(scene, skin_m)
    if name:
        known = replace(scene, residual_m=residual)
        residual = residual + EFFECTS[name].marker_change(known, target, np.array(values))
    return replace(scene, residual_m=residual)


def proofs(scene: Scene, *slips: Slip) -> tuple[Proof, ...]:
    return proofs_of(scene, slips, np.random.default_rng(0))


def told(proof: Proof, scene: Scene, is_taken_up: bool = False) -> Finding:
    return proof.finding(scene, "a", "M1", proof.gain(all_of(scene)), is_taken_up)


def numbers(scene: Scene, proof: Proof) -> dict[str, tuple[float, float, float]]:
    (alone,) = all_of(scene).trials
    finding = told(proof, scene)
    assert alone.name == "a" and finding.trials == ("a",)
    return {one.name: (one.low, one.value, one.high) for one in finding.numbers}


def test_skin_that_slides_proves_nothing():
    assert proofs(seen(), SLIP) == ()


def test_a_slip_has_the_size_that_the_markers_show():
    scene = seen("marker_shift", SLIP.marker, 0.02, 0.0, -0.015, SLIP.start_s, 0.0)
    (found,) = proofs(scene, SLIP)
    assert (found.effect.name, found.target) == ("marker_shift", "LKNEL")
    low, size, high = numbers(scene, found)["shift"]
    assert low < 0.025 < high and size == pytest.approx(0.025, abs=0.003)
    low, moment, high = numbers(scene, found)["from_time"]
    assert moment == 5.0 and high - low == pytest.approx(0.12, abs=0.06)
    assert found.p_value < 1e-12


def test_a_marker_that_sits_wrong_throughout_has_its_size():
    before = Slip(SLIP.marker, -1.0, 5.0)
    scene = seen("marker_shift", before.marker, 0.02, 0.0, -0.015, before.start_s, 0.0)
    misplaced = 0.001 * np.random.default_rng(7).standard_normal(scene.residual_m.shape[1:])
    scene = replace(scene, residual_m=scene.residual_m + misplaced)
    (found,) = proofs(scene, before)
    low, size, high = numbers(scene, found)["shift"]
    assert low < 0.025 < high and size == pytest.approx(0.025, abs=0.004)
    assert "throughout" in found.effect.sentence(scene, found.target, found.values)
    assert len(proofs(scene, replace(before, least_m=0.018))) == 1
    assert proofs(scene, replace(before, least_m=0.032)) == ()


def test_places_as_usual_are_no_marker_that_sits_wrong():
    assert proofs(seen(), Slip(SLIP.marker, -1.0, 5.0)) == ()


def test_a_second_bend_of_the_trunk_is_no_joint_centre():
    scene = bent()
    (found,) = proofs(scene)
    assert (found.effect.name, found.is_alone) == ("missing_joint", True)
    np.testing.assert_allclose(found.values, 0.8, atol=0.15)
    low, _, high = numbers(scene, found)["flexion"]
    true = EFFECTS["missing_joint"].reported(scene, "upper_torso", np.array([0.8, 0.8, 0.8]))
    assert low < true[0][2] < high


def test_a_bend_of_several_trials_may_be_twice_as_large():
    scene = bent()
    (found,) = proofs(scene)
    alone, among_others = (told(found, scene, is_taken_up=several) for several in (False, True))
    for one, wider in zip(alone.numbers, among_others.numbers, strict=True):
        assert (wider.value, wider.high) == (one.value, 2 * one.high)
        assert wider.low == min(one.low, 2 * one.low)
    assert interval_words(among_others.numbers) in among_others.sentence
    assert interval_words(alone.numbers) not in among_others.sentence
    assert "the bend may be twice as large" in among_others.sentence


@pytest.mark.parametrize(("size", "names"), [(0.4, ["missing_joint"]), (0.3, [])])
def test_a_slight_bend_is_proven_where_no_centre_explains_as_much(size, names):
    """Beside skin that slides twice as far: 8 % of the residuals, and 4 %, as much as a waist."""
    scene = seen("missing_joint", "upper_torso", size, size, size, skin_m=2 * SKIN_M)
    found = proofs(scene)
    assert [one.effect.name for one in found] == names
    assert all(CLEAR < one.share < PROVEN for one in found)


def bent() -> Scene:
    return seen("missing_joint", "upper_torso", 0.8, 0.8, 0.8)


def test_a_joint_that_lies_elsewhere_is_no_proof():
    """By how much scaling errs at a knee is not known to the markers alone."""
    assert proofs(seen("joint_centre", "knee_l", 0.04, 0.02, 0.0, skin_m=0.001)) == ()


def test_a_waist_that_lies_elsewhere_is_no_second_bend():
    assert proofs(seen("joint_centre", "waist", 0.02, 0.03, 0.0, skin_m=0.001)) == ()


def test_a_sentence_says_how_much_of_the_residuals_it_is():
    scene = bent()
    (found,) = proofs(scene)
    said = told(found, scene).sentence
    assert (
        "second joint" in said
        and f"{100 * found.share:.0f} % of all markers' squared residual" in said
    )


def test_what_explains_as_much_makes_a_class():
    scene = bent()
    (found,) = proofs(scene)
    rival = told(replace(found, is_alone=False), scene)
    assert (rival.verdict, rival.class_id) == ("ambiguous", "M1")
    assert "to tell them apart" in rival.sentence


def test_rivals_of_a_bend_stand_in_its_place_and_not_beside_it(monkeypatch):
    monkeypatch.setattr(marker_proof, "RIVAL", 0.1)
    monkeypatch.setattr(marker_proof, "_possible", with_rival(marker_proof._possible))
    first, *others = proofs(bent())
    assert (first.effect.name, first.is_alone, first.is_rival) == ("missing_joint", False, False)
    assert others and all(one.effect.name == "joint_centre" for one in others)
    assert all(one.is_rival and not one.is_alone for one in others)


def with_rival(possible):
    """What is possible, none of it explaining more than the bend."""

    def found(scene, residual_m, effect, rng):
        for one in possible(scene, residual_m, effect, rng):
            yield one if effect.name == "missing_joint" else replace(one, share=0.2)

    return found


def test_columns_are_what_the_sizes_do_to_the_wrench():
    scene = bent()
    (found,) = proofs(scene)
    columns = found.columns(scene)
    assert columns.shape == (len(scene.times_s), 6, 3)
    change = found.effect.change(scene, "upper_torso", np.array([0.0, 0.0, 0.1]))
    size = 0.3 + abs(found.values[2])
    np.testing.assert_allclose(columns[..., 2] / size * 0.1, change, atol=1e-9)
