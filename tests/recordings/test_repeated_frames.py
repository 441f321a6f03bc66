"""Frames that repeat the one before are found where people move, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bsip_cli.recordings.gaps import fill_gaps, repeated_frames, without_repeats
from bsip_cli.recordings.read import read_recording
from bsip_cli.simulate.effects.base import Target
from bsip_cli.simulate.study import inject_recording
from tests.blind.outside_effects import RepeatedFrames

SAMPLE = Path(__file__).parents[2] / "sample_data" / "sub-01"
N, K = 200, 12


def _walking(noise_m: float = 2e-4) -> np.ndarray:
    rng = np.random.default_rng(1)
    path = np.arange(N)[:, None, None] * 0.01 * np.array([1.0, 0.1, 0.05])
    return path + rng.normal(0, 1, (K, 3)) + rng.normal(0, noise_m, (N, K, 3))


def _standing(quantum_m: float, noise_m: float) -> np.ndarray:
    rng = np.random.default_rng(2)
    markers = rng.normal(0, 1, (K, 3)) + rng.normal(0, noise_m, (N, K, 3))
    return np.round(markers / quantum_m) * quantum_m


def test_bursts_are_found_to_the_frame():
    markers = _walking()
    lost = np.zeros(N, bool)
    for start, stop in ((20, 21), (40, 47), (120, 180)):
        markers[start:stop] = markers[start - 1]
        lost[start:stop] = True
    found = repeated_frames(markers)
    np.testing.assert_array_equal(found.all(axis=1), lost)
    np.testing.assert_array_equal(found.any(axis=1), lost)


def test_a_frozen_end_and_a_halved_rate():
    markers = _walking()
    markers[150:] = markers[149]
    assert repeated_frames(markers).all(axis=1).sum() == N - 150
    twice = np.repeat(_walking(), 2, axis=0)
    np.testing.assert_array_equal(repeated_frames(twice).all(axis=1), np.arange(2 * N) % 2 == 1)


@pytest.mark.parametrize("quantum_m", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("noise_m", [1e-5, 1e-4, 5e-4])
def test_still_quantised_markers_are_no_repeats(quantum_m, noise_m):
    assert not repeated_frames(_standing(quantum_m, noise_m)).any()


def test_a_person_who_starts_from_still_quantised_standing():
    still, moving = _standing(1e-3, 1e-5), _walking()
    markers = np.concatenate([still, still[-1] + moving - moving[0]])
    assert not repeated_frames(markers).any()


def test_one_frozen_marker_and_few_markers_are_left_alone():
    markers = _walking()
    markers[50:60, 3] = markers[49, 3]
    assert not repeated_frames(markers).any()
    markers[50:60] = markers[49]
    assert not repeated_frames(markers[:, :3]).any()


def test_the_one_marker_that_was_seen_anew_stays():
    markers = _walking()
    markers[50:60, 1:] = markers[49, 1:]
    markers[:, 5] = np.nan
    found = repeated_frames(markers)
    assert not found[:, [0, 5]].any()
    assert found[50:60, 1:5].all() and found.sum() == 10 * (K - 2)


@pytest.mark.parametrize("name", ["squat_run-1", "sequence_run-1", "walking_run-1"])
def test_repeats_hidden_in_a_simulated_recording(tmp_path, name):
    source = SAMPLE / f"sub-01_task-{name}.c3d"
    effect = RepeatedFrames.draw(0.2, Target(), np.random.default_rng(2))
    inject_recording(source, tmp_path / source.name, [effect])
    sound, stalled = read_recording(source), read_recording(tmp_path / source.name)
    assert without_repeats(sound) == (sound, [])
    changed = np.nanmax(np.abs(stalled.markers_m - sound.markers_m), axis=(1, 2)) > 1e-6
    marked, (finding,) = without_repeats(stalled)
    gaps = np.isnan(marked.markers_m).all(axis=(1, 2))
    assert changed.mean() > 0.15 and (gaps & changed).sum() > 0.9 * changed.sum()
    assert (gaps & ~changed).sum() == 0
    assert finding.level == "corrected" and f"{gaps.sum()} of {len(gaps)} frames" in finding.found
    first_s = sound.time_s()[np.flatnonzero(gaps)[0]]
    assert f"at {first_s:.2f}" in finding.found
    filled = fill_gaps(marked.markers_m, sound.marker_rate_hz, [], 0.1, 0.0).markers_m
    short = np.isfinite(filled).all(axis=-1) & gaps[:, None]
    error = np.linalg.norm(filled - sound.markers_m, axis=-1)[short]
    before = np.linalg.norm(stalled.markers_m - sound.markers_m, axis=-1)[short]
    assert short.any() and np.nanmean(error) < 0.5 * np.nanmean(before)


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "n_frames"),
    [
        ("edge_btk/badParameterOffset.c3d", 45),
        ("pycgm/Sample_Static.c3d", 0),
        ("btk_functional_ll/FunctionalStatic.c3d", 0),
        ("edge_ezc3d/FP_Type1.c3d", 0),
        ("type3_qualisys_c3dorg26/Capture0008_Standing.c3d", 0),
    ],
)
def test_repeats_in_real_recordings(real_data, name, n_frames):
    repeated = repeated_frames(read_recording(real_data / name).markers_m)
    assert repeated.any(axis=1).sum() == n_frames
