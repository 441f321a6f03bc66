"""Where coloured noise of the residuals begins, on markers whose noise is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.motion.smoothing import skin_corner_hz
from tests.body.standing_person import markers_of, standing

RATE_HZ, FRAMES, WHITE_M = 100.0, 2000, 3e-4


def corner(markers, q, white_m=WHITE_M):
    person = standing().person
    return skin_corner_hz(person, q, markers, RATE_HZ, white_m=white_m, robust_limit_m=0.025)


def swinging(corner_hz, seed):
    """Poses that stand, and markers with white noise and noise that falls like 1 / f^4.

    The poses follow no noise, so the residuals hold all of it; the estimate raises them by the
    share that fitted poses take.
    """
    person = standing().person
    q = np.repeat(standing().q[None], FRAMES, axis=0)
    rng = np.random.default_rng(seed)
    places = markers_of(person, q)
    white, skin = rng.normal(0, WHITE_M, (2, *places.shape))
    f = np.fft.rfftfreq(FRAMES, 1 / RATE_HZ)
    f[f < 1.0] = np.inf
    spectrum = np.fft.rfft(skin, axis=0) * ((corner_hz / f) ** 2)[:, None, None]
    return q, places + white + np.fft.irfft(spectrum, FRAMES, axis=0)


def test_the_corner_is_found():
    q, markers = swinging(8.0, seed=1)
    coordinates, taken = 3 * markers.shape[1], len(standing().person.skeleton.v_names)
    raised = (coordinates / (coordinates - taken)) ** 0.25
    assert corner(markers, q) == pytest.approx(8.0 * raised, rel=0.1)


def test_white_noise_alone_begins_low():
    q, markers = swinging(0.0, seed=2)
    taken = 1 - len(standing().person.skeleton.v_names) / (3 * markers.shape[1])
    shrunk = markers_of(standing().person, q)
    assert corner(shrunk + np.sqrt(taken) * (markers - shrunk), q) < 4.0


def test_an_exchanged_pair_and_gaps_change_little():
    q, markers = swinging(8.0, seed=3)
    before = corner(markers, q)
    swapped = markers.copy()
    swapped[500:700, [0, 5]] = markers[500:700, [5, 0]]
    swapped[900:950, 7] = np.nan
    swapped[1200:1230] = np.nan  # frames without a pose
    assert corner(swapped, q) == pytest.approx(before, rel=0.1)


def test_misplaced_markers_of_a_turning_body_are_no_skin():
    """A constant error in the segment's axes, not in the world's."""
    person = standing().person
    turn = 0.5 * np.sin(2 * np.pi * 2.5 * np.arange(FRAMES) / RATE_HZ)
    q = np.repeat(standing().q[None], FRAMES, axis=0)
    turned = Rotation.from_rotvec(turn[:, None] * [0, 0, 1]) * Rotation.from_quat(q[0, 3:7])
    q[:, 3:7] = turned.as_quat()
    places = markers_of(person, q)
    right = places + np.random.default_rng(4).normal(0, WHITE_M, places.shape)
    wrong = right.copy()
    wrong[:, np.flatnonzero(person.marker_segments == 0)[0]] += turned.apply([0.01, 0.0, 0.0])
    assert corner(wrong, q) == pytest.approx(corner(right, q), rel=0.05)


def test_too_few_markers_leave_no_residuals():
    q, markers = swinging(8.0, seed=5)
    markers[:, 10:] = np.nan
    assert corner(markers, q) == 0.0


def test_a_dozen_frames_suffice():
    q, markers = swinging(8.0, seed=6)
    assert np.isfinite(corner(markers[:12], q[:12]))
