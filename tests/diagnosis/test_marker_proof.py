"""What markers prove by themselves, in residuals of skin that slides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.marker_proof import Proof, Slip, bend_of, slips_of
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import noisy
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
    return slips_of(scene, slips, 0.95, np.random.default_rng(0))


def numbers(scene: Scene, proof: Proof) -> dict[str, tuple[float, float, float]]:
    finding = proof.finding(scene, "a", None)
    assert finding.trials == ("a",) and "the forces do not show it" in finding.sentence
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


def test_a_slide_is_no_slip():
    """From 3 to 9 s; what looks for slips finds one in it."""
    scene = seen("marker_slide", SLIP.marker, 0.02, 0.0, -0.015, 6.0, 6.0, 0.0, skin_m=0.0015)
    (found,) = proofs(scene, SLIP)
    assert (found.effect.name, found.target) == ("marker_slide", "LKNEL")
    low, size, high = numbers(scene, found)["way"]
    assert low < 0.025 < high and size == pytest.approx(0.025, abs=0.004)
    assert numbers(scene, found)["start"][1] == pytest.approx(3.0, abs=0.8)
    assert numbers(scene, found)["end"][1] == pytest.approx(9.0, abs=0.8)


def test_a_marker_that_sits_wrong_throughout_has_its_size():
    before = Slip(SLIP.marker, -1.0, 5.0)
    scene = seen("marker_shift", before.marker, 0.02, 0.0, -0.015, before.start_s, 0.0)
    misplaced = 0.001 * np.random.default_rng(7).standard_normal(scene.residual_m.shape[1:])
    scene = replace(scene, residual_m=scene.residual_m + misplaced)
    (found,) = proofs(scene, before)
    low, size, high = numbers(scene, found)["shift"]
    assert low < 0.025 < high and size == pytest.approx(0.025, abs=0.004)
    assert "throughout" in found.effect.words(scene, found.target, found.values).what
    assert len(proofs(scene, replace(before, least_m=0.018))) == 1
    assert proofs(scene, replace(before, least_m=0.032)) == ()


def test_places_as_usual_are_no_marker_that_sits_wrong():
    assert proofs(seen(), Slip(SLIP.marker, -1.0, 5.0)) == ()


def bends(scene: Scene, *slips: Proof) -> tuple[Finding, ...]:
    return bend_of(scene, slips, "a", "M1", np.random.default_rng(0))


def test_a_bend_of_the_trunk_and_soft_tissue_are_not_told_apart():
    scene = seen("missing_joint", "upper_torso", 0.8, 0.8, 0.8)
    bend, tissue = bends(scene)
    assert (bend.effect, tissue.effect) == ("missing_joint", "soft_tissue")
    assert {(one.verdict, one.class_id) for one in (bend, tissue)} == {("ambiguous", "M1")}
    true = EFFECTS["missing_joint"].reported(scene, "upper_torso", np.array([0.8, 0.8, 0.8]))
    first = bend.numbers[0]
    assert first.name == "flexion" and first.low < true[0][2] < first.high
    assert "of all markers' squared residual" in bend.sentence
    assert "to distinguish them" in bend.sentence and "to distinguish them" in tissue.sentence


@pytest.mark.parametrize("joint", ["knee_l", "waist"])
def test_a_joint_that_lies_elsewhere_is_no_bend(joint):
    assert bends(seen("joint_centre", joint, 0.02, 0.03, 0.0, skin_m=0.001)) == ()


def test_skin_alone_is_no_bend():
    assert bends(seen()) == ()
