"""Valid windows of steps on and off plates, the plate that bears each foot, and real trials."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.body.gravity import GRAVITY_M_S2 as GRAVITY
from bsip_cli.recordings.contacts import (
    Contacts,
    contact_windows,
    foot_contacts,
    foot_forces,
    plate_noise,
)
from bsip_cli.recordings.model import Plate, Recording
from bsip_cli.recordings.plate_wrench import plates_at_marker_rate, subtract_zero, unloaded_samples
from bsip_cli.recordings.read import read_recording

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


def _plate(force_N: np.ndarray | float, corners=CORNERS, x: float = 0.25) -> Plate:
    return _read_as(np.multiply.outer(np.broadcast_to(force_N, N), _push_at([x, 0.25, 0])), corners)


def _push_at(place_m) -> np.ndarray:
    """A wrench of 1 N upwards there, (6,)."""
    return np.append([0.0, 0.0, 1.0], np.cross(place_m, [0.0, 0.0, 1.0]))


def _read_as(wrench: np.ndarray, corners: np.ndarray | None) -> Plate:
    return Plate("1", wrench, corners, np.isfinite(wrench).all(axis=1))


def _windows(
    left, right, plates, trunk=None, mass_kg=MASS_KG, stands_kg=None, time0_s=0.0, body=None
):
    feet = foot_contacts({"l": left, "r": right}, RATE_HZ, plates, N, time0_s)
    trunk = _trunk() if trunk is None else trunk
    return contact_windows(feet, trunk, mass_kg, RATE_HZ, stands_kg, body)


def test_standing_on_the_plate_is_valid():
    result = _windows(_foot(0.1), _foot(0.4), [_plate(WEIGHT_N)])
    assert result.valid.all() and not result.reasons
    assert result.on_plate["l"].all() and result.on_ground["r"].all()


def test_a_foot_beside_the_plate_is_not():
    lift = np.where(np.arange(N) < 100, 0.0, 0.2)  # right foot stands beside, then lifts
    force = np.where(np.arange(N) < 100, 0.8 * WEIGHT_N, WEIGHT_N)
    result = _windows(_foot(0.1), _foot(0.8, lift), [_plate(force)])
    assert not result.valid[:95].any() and result.valid[105:].all()
    (reason,) = (one for one in result.reasons if "right foot" in one.subject)
    assert reason.found.endswith(": 0.00 to 0.98 s")
    late = _windows(_foot(0.1), _foot(0.8, lift), [_plate(force)], time0_s=1.24)
    assert [one.found[-15:] for one in late.reasons] == [" 1.24 to 2.22 s"]  # the file's clock
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


def test_a_foot_on_a_step_touches_it():
    """From one plate onto another, 0.3 m high, whose load it then bears."""
    x = np.interp(np.arange(N), [0, 100, 140, N], [0.4, 0.4, 0.75, 0.75])
    lift = np.interp(np.arange(N), [0, 100, 120, 135, 140, N], [0.0, 0.0, 0.4, 0.35, 0.3, 0.3])
    share = np.interp(np.arange(N), [0, 140, 150, N], [0.0, 0.0, 0.8, 0.8])
    step = replace(_plate(share * WEIGHT_N, CORNERS + np.array([0.5, 0.0, 0.3]), x=0.75), name="2")
    result = _windows(_foot(0.1), _foot(x, lift), [_plate((1.0 - share) * WEIGHT_N), step])
    assert result.valid.all()
    assert result.on_plate["r"][:95].all() and result.on_plate["r"][150:].all()
    assert not result.on_ground["r"][105:135].any()


def test_outline_has_a_tolerance():
    assert _windows(_foot(0.1), _foot(0.52), [_plate(WEIGHT_N)]).valid.all()
    assert not _windows(_foot(0.1), _foot(0.54), [_plate(WEIGHT_N)]).valid.any()


def test_a_foot_across_two_plates_is_measured():
    second = replace(_plate(0.0, CORNERS + np.array([0, 0.5, 0])), name="2")
    across = _foot(0.1)
    across[..., 1] = [0.45, 0.6]
    assert _windows(across, _foot(0.4), [_plate(WEIGHT_N), second]).valid.all()
    assert not _windows(across, _foot(0.4), [_plate(WEIGHT_N)]).valid.any()


def test_a_chair_bears_from_the_first_touch_on():
    """It bears a third of the weight, which is clear, long after it is touched. A swing of the arms
    that the trunk does not show is no touch."""
    rng = np.random.default_rng(3)
    weight = np.interp(np.arange(N), [120, 180, 220, 280], [1.0, 0.2, 0.2, 1.0])
    arms = 0.1 * np.sin(2 * np.pi * 1.5 * np.arange(N) / RATE_HZ) * (np.arange(N) < 90)
    force = WEIGHT_N * (weight + arms + 0.01 * rng.standard_normal(N))
    body = GRAVITY * (1 + arms)
    result = _windows(_foot(0.1), _foot(0.4), [_plate(force)], body=body)
    assert result.valid[:115].all() and not result.valid[130:270].any() and result.valid[285:].all()
    by_trunk = _windows(_foot(0.1), _foot(0.4), [_plate(force)])
    assert by_trunk.valid[:140].all()


def test_a_chair_is_named():
    seated = np.arange(N) < 120
    force = np.where(seated, 0.2 * WEIGHT_N, WEIGHT_N)
    result = _windows(_foot(0.1), _foot(0.4), [_plate(force)])
    assert not result.valid[:115].any() and result.valid[135:].all()
    assert any("seat" in finding.found for finding in result.reasons)


def test_flight_is_valid():
    t = np.arange(N) / RATE_HZ
    flying = (t > 1.0) & (t < 1.4)
    push = (np.abs(t - 0.9) < 0.1) | (np.abs(t - 1.5) < 0.1)
    force = np.where(flying, 0.0, WEIGHT_N) + push * 0.98 * WEIGHT_N
    speed = np.cumsum(force / MASS_KG - GRAVITY) / RATE_HZ
    height = 1.0 + np.cumsum(speed) / RATE_HZ
    feet = (_foot(x, np.where(flying, 0.2, 0)) for x in (0.1, 0.4))
    result = _windows(*feet, [_plate(force)], _trunk(height))
    assert result.valid[105:135].all()
    assert not result.on_ground["l"][105:135].any()


def test_a_box_before_a_landing_is_no_flight():
    on_box = np.arange(N) < 120
    feet = (_foot(x, np.where(on_box, 0.3, 0.0)) for x in (0.1, 0.4))
    assert not _windows(*feet, [_plate(np.where(on_box, 0.0, WEIGHT_N))]).valid[:110].any()


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


LEFT, RIGHT = np.array([0.0, 0.1, 0.0]), np.array([0.0, -0.1, 0.0])
OUTLINE = np.array([[0.3, 0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0.0], [0.3, -0.2, 0.0]])
ASIDE, AHEAD = np.array([0.0, 0.2, 0.0]), np.array([1.0, 0.0, 0.0])
YES = np.ones(N, bool)


def still_foot(at: np.ndarray) -> np.ndarray:
    """Heel, toe and ankle (N, 3, 3)."""
    points = at + np.array([[-0.08, 0.0, 0.02], [0.12, 0.0, 0.02], [-0.04, 0.0, 0.08]])
    return np.tile(points, (N, 1, 1))


def steady_load(at: np.ndarray, newton=300.0) -> np.ndarray:
    return np.tile(newton * _push_at(at), (N, 1))


FEET = {"l": still_foot(LEFT), "r": still_foot(RIGHT)}
BOTH = {"l": YES, "r": YES}


def told(plates, on_ground=BOTH, on_plate=BOTH):
    return foot_forces(plates, FEET, on_ground, on_plate, RATE_HZ)


@pytest.mark.parametrize("has_outlines", [True, False])
def test_each_foot_gets_the_wrench_of_its_own_plate(has_outlines):
    """Told by the outlines, or by the loads alone."""
    left, right = steady_load(LEFT, 400.0), steady_load(RIGHT, 300.0)
    outlines = (OUTLINE - ASIDE, OUTLINE + ASIDE) if has_outlines else (None, None)
    found = told([_read_as(right, outlines[0]), _read_as(left, outlines[1])])
    np.testing.assert_allclose(found.wrench["l"], left)
    np.testing.assert_allclose(found.wrench["r"], right)


def test_a_foot_on_two_plates_gets_both():
    halves = [
        _read_as(steady_load(LEFT + x * AHEAD, 200.0), OUTLINE + ASIDE + y * AHEAD)
        for x, y in ((-0.05, -0.3), (0.05, 0.3))
    ]
    found = told([*halves, _read_as(steady_load(RIGHT), OUTLINE - ASIDE)])
    np.testing.assert_allclose(found.wrench["l"][:, 2], 400.0)
    np.testing.assert_allclose(found.wrench["r"][:, 2], 300.0)


@pytest.mark.parametrize("outline", [OUTLINE, None])
def test_a_plate_under_both_feet_tells_of_neither(outline):
    found = told([_read_as(steady_load((LEFT + RIGHT) / 2, 700.0), outline)])
    assert np.isnan(found.wrench["l"]).all() and np.isnan(found.wrench["r"]).all()
    words = (
        "both feet are on one plate"
        if outline is not None
        else ("no foot is clearly under a plate's load")
    )
    assert found.unknown["l"][words].all()


def test_weight_that_shifts_over_a_plate_without_outline_is_no_foots():
    """Now over the left foot, now over the right one: both stand on it."""
    course = steady_load(LEFT, 700.0)
    course[N // 2 :] = steady_load(RIGHT, 700.0)[N // 2 :]
    found = told([_read_as(course, None)])
    assert np.isnan(found.wrench["l"]).all() and np.isnan(found.wrench["r"]).all()


def test_who_hardly_loads_a_plate_does_not_show_under_which_foot():
    """A third of a contact with 25 N between the feet, as of one who sits, the rest under the left
    foot."""
    course = steady_load(LEFT, 400.0)
    course[: N // 3] = steady_load((LEFT + RIGHT) / 2, 25.0)[: N // 3]
    found = told([_read_as(course, None), _read_as(steady_load(RIGHT, 400.0), None)])
    np.testing.assert_allclose(found.wrench["l"], course)
    assert np.isfinite(found.wrench["r"]).all()


def test_a_foot_in_the_air_bears_nothing_and_one_beside_is_unknown():
    air = {"l": YES, "r": ~YES}
    plate = _read_as(steady_load(LEFT, 700.0), OUTLINE + ASIDE)
    found = told([plate], air, air)
    assert (found.wrench["r"] == 0.0).all() and np.isfinite(found.wrench["l"]).all()
    beside = told([plate], BOTH, air)
    assert np.isnan(beside.wrench["r"]).all() and np.isfinite(beside.wrench["l"]).all()
    assert np.isnan(told([], BOTH, BOTH).wrench["l"]).all()


def test_a_broken_sample_is_not_zero():
    wrench = steady_load(LEFT, 700.0)
    wrench[50] = np.nan
    found = told([_read_as(wrench, OUTLINE + ASIDE)], {"l": YES, "r": ~YES}, BOTH)
    assert np.isnan(found.wrench["l"][50]).all() and np.isfinite(found.wrench["l"][60]).all()


def test_noise_of_a_loaded_plate_is_its_white_noise():
    sd = np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    at = np.array([0.5, 0.4, 0.0])
    t = np.arange(20000) / 1000.0
    wrench = np.random.default_rng(2).normal(size=(len(t), 6)) * sd
    wrench[:, 2] += 700 + 100 * np.sin(2 * np.pi * t)
    wrench[:, 3:] += np.cross(at, wrench[:, :3])
    np.testing.assert_allclose(plate_noise(_read_as(wrench, None), at), sd, rtol=0.05)


OPENCAP = (r"L_(calc|toe|5meta)", r"r_(calc|toe|5meta)", r"C7|[Lr]\.(ASIS|PSIS)|[LR]_Shoulder")
HAMNER = (r"L(CAL|TOE|MT5)", r"R(CAL|TOE|MT5)", r"C7|CLAV|.ACR|.ASI|.PSI")
BIOBUDDY = (r"L(CAL|MFH5|MFH1|TT2)", r"R(CAL|MFH5|MFH1|TT2)", r"C7|T10|SUP|[LR](ASIS|PSIS)")
PIG = (r"L(HEE|TOE|ANK)", r"R(HEE|TOE|ANK)", r"C7|T10|CLAV|STRN|[LR](ASI|PSI)|SACR")


def _columns(recording: Recording, pattern: str) -> list[int]:
    return [i for i, label in enumerate(recording.labels) if re.fullmatch(pattern, label)]


def _real_windows(path: Path, names: tuple[str, str, str], mass_kg: float) -> Contacts:
    recording = read_recording(path)
    left, right, trunk = (recording.markers_m[:, _columns(recording, name)] for name in names)
    plates, rate_hz = plates_at_marker_rate(recording), recording.marker_rate_hz
    feet = foot_contacts({"l": left, "r": right}, rate_hz, plates, recording.n_frames)
    return contact_windows(feet, trunk, mass_kg, rate_hz)


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "markers", "mass_kg", "least"),
    [
        ("opencap_subject4/static1.trc", OPENCAP, 60.0, 1.0),
        ("opencap_subject4/squats1.trc", OPENCAP, 60.0, 1.0),
        ("hamner_other/run200.trc", HAMNER, 72.6, 0.98),
        ("biobuddy_ech/anat_pose_ECH.c3d", BIOBUDDY, 66.0, 0.98),
        ("biobuddy_ech/right_knee.c3d", BIOBUDDY, 66.0, 0.98),
    ],
)
def test_all_contacts_on_plates(real_data, name, markers, mass_kg, least):
    assert _real_windows(real_data / name, markers, mass_kg).valid.mean() >= least


@pytest.mark.real
def test_chair_is_named(real_data):
    windows = _real_windows(real_data / "opencap_subject4/STS1.trc", OPENCAP, 60.0)
    assert 0.4 < windows.valid.mean() < 0.7
    assert any("seat" in finding.found for finding in windows.reasons)


@pytest.mark.real
@pytest.mark.parametrize("name", ["DJ1", "DJ2"])
def test_box_before_the_drop_is_left_out_and_the_landing_kept(real_data, name):
    windows = _real_windows(real_data / f"opencap_subject4/{name}.trc", OPENCAP, 60.0)
    assert not windows.valid[:100].any()
    assert windows.valid[125:].all()


@pytest.mark.real
def test_first_and_last_steps_of_gait_are_left_out(real_data):
    path = real_data / "btk_pig/PiG_Motion-FlatFoot-Full.c3d"
    windows = _real_windows(path, PIG, 46.3)
    assert 0.1 < windows.valid.mean() < 0.3
    assert not windows.valid[:80].any() and not windows.valid[-80:].any()


@pytest.mark.real
def test_unloaded_belt_has_its_offset(real_data):
    recording = read_recording(real_data / "biobuddy_ech/right_knee.c3d")
    rate_hz, (loaded, belt) = recording.analog_rate_hz, recording.plates
    assert not unloaded_samples(loaded, rate_hz).any()
    zeroed, _ = subtract_zero(belt, unloaded_samples(belt, rate_hz), rate_hz)
    np.testing.assert_allclose((belt.force_N - zeroed.force_N)[:, 2], 9.0, atol=0.2)
