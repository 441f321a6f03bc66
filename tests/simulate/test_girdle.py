"""Shoulders that move against the thorax, with the arms and by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.simulate.numerics import euler_zxy, rotate, transpose
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import draw_person
from bsip_cli.simulate.plan import RHYTHM_RAD, clavicle_turn
from bsip_cli.simulate.recording import simulate_trial

PLAIN = Richness()
GIRDLE = replace(PLAIN, girdle=True)


def person_with(richness: Richness):
    return draw_person(np.random.default_rng(4), richness, "F")


def test_51_markers_and_the_same_body():
    plain, girdle = person_with(PLAIN), person_with(GIRDLE)
    assert set(girdle.markers) == {m.label for m in load_marker_set("robert17").markers}
    assert set(plain.markers) == {m.label for m in load_marker_set("hansen2017").markers}
    for body, part in plain.inertias.items():
        assert part.mass_kg == girdle.inertias[body].mass_kg
    for label, marker in plain.markers.items():
        own = girdle.markers[label]
        if own.body.startswith("clavicle"):
            at = own.position_m + girdle.joints_m[f"sternoclavicular_{own.body[-1]}"]
            assert at == pytest.approx(marker.position_m)
        else:
            assert np.array_equal(own.position_m, marker.position_m)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_raised_arm_takes_the_clavicle_along(sign):
    """By 120 degrees to the side: raised and drawn back on either side, not at all at rest."""
    raised = euler_zxy(np.array([[0.0, 0.0, 0.0], [0.0, sign * np.deg2rad(120), 0.0]]))
    tip = rotate(clavicle_turn(raised, np.zeros((2, 2)), sign), np.array([0.0, 0.0, sign]))
    assert tip[0] == pytest.approx([0.0, 0.0, sign])
    up, back = np.sin(RHYTHM_RAD[:2])
    assert tip[1, 1] == pytest.approx(up, abs=0.1)
    assert -tip[1, 0] == pytest.approx(back, abs=0.1)
    own = rotate(clavicle_turn(raised, np.full((2, 2), 0.1), sign), np.array([0.0, 0.0, sign]))
    assert (own[:, 1] > tip[:, 1]).all() and (own[:, 0] > tip[:, 0]).all()


def shoulder_travel_m(richness: Richness) -> float:
    """Range of the right shoulder in the thorax."""
    person = person_with(richness)
    poses = simulate_trial(person, "sequence", np.random.default_rng(5), 8.0).poses
    apart = poses.origin_m["upper_arm_r"] - poses.origin_m["thorax"]
    inside = np.einsum("tij,tj->ti", transpose(poses.rotation["thorax"]), apart)
    return float(np.linalg.norm(np.ptp(inside, axis=0)))


def test_the_shoulder_moves_by_centimetres_where_it_is_asked_for():
    assert shoulder_travel_m(PLAIN) < 1e-9
    assert 0.04 < shoulder_travel_m(GIRDLE) < 0.25
