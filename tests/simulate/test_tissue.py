"""Soft tissue as measured on people: larger, curved in the pose, swinging with mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import Person, draw_person
from bsip_cli.simulate.recording import Trial, marker_paths, rigid_paths, simulate_trial
from bsip_cli.simulate.study import wobbling

LIGHT = replace(Richness(), marker_noise_m=0.0, marker_drift_m=0.0, gaps=False)
MEASURED = replace(LIGHT, measured_tissue=True)


def person_with(richness: Richness, seed: int = 3) -> Person:
    return draw_person(np.random.default_rng(seed), richness, "M")


def travel_mm(richness: Richness, trial, body: str) -> float:
    """Mean range of the markers on a body against the bone."""
    person = person_with(richness)
    poses = trial("squat").poses.part(slice(None, None, 10))
    seen = marker_paths(person, poses, 100.0, richness, np.random.default_rng(0))
    bone = rigid_paths(person, poses)
    own = np.swapaxes(poses.rotation[body], 1, 2)
    moved = [
        np.einsum("tij,tj->ti", own, seen[label] - bone[label])
        for label, marker in person.markers.items()
        if marker.body == body
    ]
    return 1000.0 * float(np.mean([np.linalg.norm(np.ptp(path, axis=0)) for path in moved]))


@pytest.mark.parametrize("body", ["lower_torso", "thorax", "thigh_r"])
def test_it_is_larger_on_trunk_and_thighs(trial, body):
    assert travel_mm(MEASURED, trial, body) > 1.3 * travel_mm(LIGHT, trial, body)


def test_it_is_curved_in_the_pose_and_light_skin_is_not():
    for richness, curved in ((LIGHT, False), (MEASURED, True)):
        gain = person_with(richness).markers["RKNEL"].skin_gain_m
        assert (np.abs(gain[:, 6:]).max() > 0.001) == curved


def test_only_its_own_markers_and_mass_tell_the_two_apart():
    light, measured = person_with(LIGHT), person_with(MEASURED)
    assert not light.tissue
    assert measured.tissue
    for body, part in light.inertias.items():
        assert np.array_equal(part.com_m, measured.inertias[body].com_m)
    for label, marker in light.markers.items():
        assert np.array_equal(marker.position_m, measured.markers[label].position_m)


def test_what_swings_keeps_the_weight_and_changes_the_landing():
    person = person_with(MEASURED)

    def simulated(task: str, length_s: float, effects=()) -> Trial:
        return simulate_trial(person, task, np.random.default_rng(5), length_s, effects=effects)

    swinging = wobbling(person)
    stiff, loose = simulated("walking", 1.2), simulated("walking", 1.2, swinging)
    change = loose.force_n[:, 1] - stiff.force_n[:, 1]
    assert np.sqrt(np.mean(change**2)) > 3.0
    quiet = simulated("static", 1.0, swinging)
    assert quiet.force_n[:, 1].mean() == pytest.approx(9.81 * person.mass_kg, rel=1e-3)
