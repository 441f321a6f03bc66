"""Valid windows on constructed steps: on and off plates, chair, flight, belt, no outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2 as GRAVITY
from bsip_cli.recordings.contacts import PlateLoad, contact_windows, foot_contacts

RATE_HZ = 100.0
N = 300
MASS_KG = 70.0
WEIGHT_N = MASS_KG * GRAVITY
CORNERS = np.array([[0.0, 0.5, 0], [0.5, 0.5, 0], [0.5, 0, 0], [0, 0, 0.0]])
HEIGHT0 = np.array([0.04, 0.03])


def _foot(x: np.ndarray | float, lift: np.ndarray | float = 0.0) -> np.ndarray:
    """Heel and toe at x, (n, 2, 3)."""
    foot = np.zeros((N, 2, 3))
    foot[..., 0] = np.broadcast_to(np.asarray(x, float), (N,))[:, None]
    foot[..., 1] = [0.15, 0.35]
    foot[..., 2] = HEIGHT0 + np.broadcast_to(np.asarray(lift, float), (N,))[:, None]
    return foot


def _trunk(height: np.ndarray | float = 1.0) -> np.ndarray:
    trunk = np.zeros((N, 3, 3))
    trunk[..., 2] = np.broadcast_to(np.asarray(height, float), (N,))[:, None]
    return trunk


def _plate(force_N: np.ndarray | float, corners=CORNERS, x: float = 0.25) -> PlateLoad:
    force = np.broadcast_to(np.asarray(force_N, float), (N,)).copy()
    cop = np.where(force[:, None] > 20, [[x, 0.25]], np.nan)
    return PlateLoad("1", corners, force, cop, np.ones(N, bool))


def _windows(left, right, plates, trunk=None, mass_kg=MASS_KG, stands_kg=None):
    feet = foot_contacts({"l": left, "r": right}, RATE_HZ, plates, N)
    trunk = _trunk() if trunk is None else trunk
    return contact_windows(feet, trunk, mass_kg, RATE_HZ, stands_kg)


def test_standing_on_the_plate_is_valid():
    result = _windows(_foot(0.1), _foot(0.4), [_plate(WEIGHT_N)])
    assert result.valid.all() and not result.reasons
    assert result.on_plate["l"].all() and result.on_ground["r"].all()


def test_a_foot_beside_the_plate_is_not():
    lift = np.where(np.arange(N) < 100, 0.0, 0.2)  # right foot stands beside, then lifts
    force = np.where(np.arange(N) < 100, 0.8 * WEIGHT_N, WEIGHT_N)
    result = _windows(_foot(0.1), _foot(0.8, lift), [_plate(force)])
    assert not result.valid[:95].any() and result.valid[105:].all()
    assert any("right foot" in finding.subject for finding in result.reasons)
    assert result.on_ground["r"][:95].all() and not result.on_plate["r"].any()


def test_a_foot_beside_the_plate_rolls_over_its_toes_before_it_leaves():
    """The heel marker rises first, then the toe marker, and the toes push on; a swing is faster."""
    frames = np.arange(N)
    rolling = _foot(0.8)
    rolling[..., 0, 2] += np.clip((frames - 80) * 0.01, 0.0, 0.3)
    rolling[..., 1, 2] += np.clip((frames - 95) * 0.004, 0.0, 0.2)
    slow = _windows(_foot(0.1), rolling, [_plate(WEIGHT_N)])
    assert not slow.valid[:110].any() and slow.valid[125:].all()
    rolling[100:, :, 0] += 0.02 * (frames[100:] - 100)[:, None]  # 2 m/s forwards
    fast = _windows(_foot(0.1), rolling, [_plate(WEIGHT_N)])
    assert 0.05 <= (slow.valid.argmax() - fast.valid.argmax()) / RATE_HZ <= 0.2


def test_a_foot_that_steps_onto_the_plate_is_measured_at_once():
    """It slides over the edge within a tenth of a second and stands there."""
    x = np.interp(np.arange(N), [0, 60, 66, N], [0.6, 0.6, 0.4, 0.4])
    result = _windows(_foot(0.1), _foot(x), [_plate(WEIGHT_N)])
    assert not result.valid[:58].any()
    assert result.valid[70:].all()


def test_outline_has_a_tolerance():
    assert _windows(_foot(0.1), _foot(0.52), [_plate(WEIGHT_N)]).valid.all()
    assert not _windows(_foot(0.1), _foot(0.54), [_plate(WEIGHT_N)]).valid.any()


def test_a_foot_across_two_plates_is_measured():
    second = PlateLoad(
        "2", CORNERS + np.array([0, 0.5, 0]), np.zeros(N), np.full((N, 2), np.nan), np.ones(N, bool)
    )
    across = _foot(0.1)
    across[..., 1] = [0.45, 0.6]
    assert _windows(across, _foot(0.4), [_plate(WEIGHT_N), second]).valid.all()
    assert not _windows(across, _foot(0.4), [_plate(WEIGHT_N)]).valid.any()


def test_a_chair_is_named():
    seated = np.arange(N) < 120
    force = np.where(seated, 0.2 * WEIGHT_N, WEIGHT_N)
    result = _windows(_foot(0.1), _foot(0.4), [_plate(force)])
    assert not result.valid[:115].any() and result.valid[135:].all()
    assert any("seat" in finding.found for finding in result.reasons)


def test_flight_is_valid():
    t = np.arange(N) / RATE_HZ
    flying = (t > 1.0) & (t < 1.4)
    since = np.clip(t - 1.0, 0, 0.4)
    height = 1.0 + 0.2 * GRAVITY * since - GRAVITY * since**2 / 2
    force = np.where(flying, 0.0, WEIGHT_N)
    push = (np.abs(t - 0.9) < 0.1) | (np.abs(t - 1.5) < 0.1)
    height[push & (t < 1)] += 0.0
    result = _windows(
        _foot(0.1, np.where(flying, 0.2, 0)),
        _foot(0.4, np.where(flying, 0.2, 0)),
        [_plate(force + push * 0.98 * WEIGHT_N)],
        _trunk(_pushed(t, force + push * 0.98 * WEIGHT_N)),
    )
    assert result.valid[105:135].all()
    assert not result.on_ground["l"][105:135].any()


def _pushed(t: np.ndarray, force_N: np.ndarray) -> np.ndarray:
    """Height of a mass under this force."""
    speed = np.cumsum(force_N / MASS_KG - GRAVITY) / RATE_HZ
    return 1.0 + np.cumsum(speed) / RATE_HZ


def test_a_box_before_a_landing_is_no_flight():
    force = np.where(np.arange(N) < 120, 0.0, WEIGHT_N)
    lift = np.where(np.arange(N) < 120, 0.3, 0.0)
    result = _windows(_foot(0.1, lift), _foot(0.4, lift), [_plate(force)])
    assert not result.valid[:110].any()


def test_a_belt_moves_the_foot():
    x = 0.05 + 0.4 * (np.arange(N) % 20) / 20  # 2 m/s
    result = _windows(_foot(x), _foot(0.4, 0.2), [_plate(WEIGHT_N)])
    assert result.on_plate["l"].mean() > 0.9


def test_without_outline_the_load_must_be_near():
    near = _windows(_foot(0.1), _foot(0.4), [_plate(WEIGHT_N, corners=None)])
    assert near.valid.all()
    far = _windows(_foot(0.1), _foot(1.4), [_plate(WEIGHT_N, corners=None)])
    assert not far.valid.any()


def test_unusable_samples_and_unseen_feet_are_left_out():
    plate = _plate(WEIGHT_N)
    plate.usable[50:60] = False
    left = _foot(0.1)
    left[100:120] = np.nan
    result = _windows(left, _foot(0.4), [plate])
    expected = np.ones(N, bool)
    expected[50:60] = expected[100:120] = False
    np.testing.assert_array_equal(result.valid, expected)
    assert len(result.reasons) == 2


def test_samples_that_the_table_lacks_put_no_foot_beside_the_plates():
    there = np.arange(N) >= 100
    plate = replace(_plate(np.where(there, WEIGHT_N, 0.0), corners=None), usable=there)
    result = _windows(_foot(0.1), _foot(0.4), [plate])
    assert ["force samples unusable" in one.found for one in result.reasons] == [True]


def test_windows_shorter_than_a_tenth_of_a_second_are_dropped():
    plate = _plate(WEIGHT_N)
    plate.usable[50:60] = plate.usable[65:80] = False
    assert not _windows(_foot(0.1), _foot(0.4), [plate]).valid[50:80].any()


def test_no_plates_no_windows():
    assert not _windows(_foot(0.1), _foot(0.4), []).valid.any()


def test_half_a_squat_on_a_plate_that_the_table_lacks():
    """While the body sinks, one foot's force would nearly do: together these frames tell."""
    time_s = np.arange(N) / RATE_HZ
    depth = 0.15 * np.cos(2 * np.pi * 0.7 * time_s)
    needed = MASS_KG * (GRAVITY - (2 * np.pi * 0.7) ** 2 * depth)
    both, trunk = _foot(0.1), _trunk(1.0 + depth)
    sound = _windows(both, _foot(0.3), [_plate(needed, corners=None)], trunk)
    assert sound.valid.all() and not sound.reasons
    half = _windows(both, _foot(0.3), [_plate(needed / 2, corners=None)], trunk)
    assert not half.valid.any()
    assert "a plate that is not in the file" in half.reasons[-1].found
    a_little = _windows(both, _foot(0.3), [_plate(0.9 * needed, corners=None)], trunk)
    assert a_little.valid.all()


def test_plates_that_read_less_of_a_quiet_stance_too_are_no_missing_plate():
    """A gain or a stated mass that is wrong by a quarter: the frames stay, for what comes after."""
    feet, plate = (_foot(0.1), _foot(0.4)), _plate(0.75 * WEIGHT_N)
    assert not _windows(*feet, [plate]).valid.any()
    assert _windows(*feet, [plate], stands_kg=0.75 * MASS_KG).valid.all()


def test_a_wrong_mass_is_no_seat():
    """Pounds taken for kilograms: nothing fits, and no seat is invented."""
    result = _windows(_foot(0.1), _foot(0.4), [_plate(WEIGHT_N)], mass_kg=2.2046 * MASS_KG)
    (reason,) = result.reasons
    assert "154.3 kg, is wrong" in reason.found and "seat" not in reason.found


def test_without_a_mass_nothing_is_valid_and_the_reason_is_said():
    result = _windows(_foot(0.1), _foot(0.4), [_plate(WEIGHT_N)], mass_kg=None)
    assert not result.valid.any() and result.on_plate["l"].all()
    assert any("neither a stated mass" in reason.found for reason in result.reasons)
