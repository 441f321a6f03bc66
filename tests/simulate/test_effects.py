"""Every effect is refused or recorded; those of clocks and markers as they say.

What plates do wrong is held against the catalogue's effects in ``tests/blind/test_blind_truth.py``.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import Instruments, SensingPlate, interpolated
from bsip_cli.simulate.effects import EFFECTS, effects_of, pair_up, touches
from bsip_cli.simulate.options import Asked, StudyOptions
from bsip_cli.simulate.study import simulate_study
from tests.blind.blind_cases import CATALOGUE
from tests.blind.outside_effects import OUTSIDE
from tests.simulate.conftest import person_of
from tests.simulate.effect_trials import (
    PERSON_SEED,
    SIZES,
    effect_of,
    measured,
    measured_with,
    readings,
    trial_with,
)


def test_the_vocabulary_is_that_of_the_blind_suite():
    assert [name for name in EFFECTS if name not in OUTSIDE] == list(CATALOGUE)
    assert len(OUTSIDE) >= 12
    assert all(name.startswith("outside_") for name in OUTSIDE)
    assert set(SIZES) == set(EFFECTS)
    for effect in EFFECTS.values():
        assert effect.unit
        assert effect.__doc__


@pytest.mark.parametrize(
    ("names", "sizes", "targets", "words"),
    [
        (["sync_ofset"], [0.1], [], "did you mean 'sync_offset'"),
        (["sync_offset"], [], [], "one --size per --effect"),
        (["sync_offset"], [0.6], [], "-0.5 to 0.5 s"),
        (["sync_offset"], [0.0], [], "not 0"),
        (["sync_offset", "added_mass"], [0.1, 1.0], ["hand_r"], "- for none"),
        (["added_mass"], [1.0], ["nose"], "a segment"),
        (["plate_zero"], [1.0], ["fz,plait=2"], "plate=NUMBER"),
        (["plate_zero"], [1.0], ["fz,plate=two"], "plate=NUMBER"),
        (["sync_offset"], [0.1], ["head"], "none"),
        (["wobbling_mass"], [1.0], ["thigh_l,frequency=90"], "0.5 to 20 Hz"),
    ],
)
def test_what_cannot_be_hidden_is_refused_in_a_sentence(names, sizes, targets, words):
    with pytest.raises(UsageError, match=words):
        pair_up(names, sizes, targets)


def test_sizes_and_targets_follow_the_order_of_the_effects():
    pairs = pair_up(["added_mass", "sync_offset"], [1.0, 0.1], ["hand_r", "-"])
    assert pairs == (Asked("added_mass", 1.0, "hand_r"), Asked("sync_offset", 0.1, "-"))
    assert effect_of("plate_gain").record()["channel"] == "fz"  # unless told


def test_effects_are_drawn_from_the_seed_and_labs_are_shared():
    asked = (Asked("added_mass", 1.0), Asked("plate_translation", 0.01))
    options = StudyOptions(seed=4, effects=asked)
    first, again, other = (effects_of(options, n) for n in (1, 1, 2))
    assert [e.record() for e in first] == [e.record() for e in again]
    assert first[0].record() != other[0].record()
    assert first[1].record() == other[1].record()
    moved = effects_of(StudyOptions(seed=5, effects=asked), 1)
    assert moved[1].record() != first[1].record()


def test_some_effects_spare_the_static_trial_unless_told_otherwise():
    contact, mass = effect_of("unmeasured_contact"), effect_of("added_mass")
    assert not touches(contact, "static", ())
    assert touches(contact, "squat", ())
    assert touches(contact, "static", ("static",))
    assert touches(mass, "static", ())
    assert not touches(mass, "static", ("squat",))


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_seen_in_a_recording(name):
    """In forces, markers or their rate, well above rounding, and with the effect's own size."""
    asked = (name, SIZES[name], "")
    effect = effect_of(*asked)
    person = effect.person(person_of(PERSON_SEED))
    got = measured(trial_with("squat", asked), person, [effect])
    null = measured_with("squat")
    frames = min(len(got.points_m), len(null.points_m))
    force = readings(got)[: 10 * frames] - readings(null)[: 10 * frames]
    markers = np.nan_to_num(got.points_m[:frames] - null.points_m[:frames])
    other_rate = got.marker_hz != null.marker_hz
    assert np.abs(force).max() > 0.1 or np.abs(markers).max() > 1e-3 or other_rate
    assert np.isfinite(force).all()
    assert effect.record()["effect"] == name


def test_a_study_keeps_the_truth_about_two_effects_and_is_the_same_again(tmp_path):
    options = StudyOptions(
        participants=1,
        tasks=("static", "squat"),
        durations_s={"static": 1.0, "squat": 3.0},
        effects=(Asked("added_mass", 2.0, "hand_l"), Asked("sync_offset", 0.02)),
        effect_tasks=("squat",),
    )
    for name in ("a", "b"):
        simulate_study(tmp_path / name, options)
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*")]
    assert len(files) == 5
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    truth = json.loads((tmp_path / "a" / "truth" / "sub-01_truth.json").read_text())
    mass, delay = truth["effects"]
    assert (mass["effect"], mass["target"], mass["size"]) == ("added_mass", "hand_l", 2.0)
    assert len(mass["position_m"]) == 3
    assert (delay["effect"], delay["size"], delay["unit"]) == ("sync_offset", 0.02, "s")
    static, squat = (truth["trials"][f"sub-01_task-{t}"] for t in ("static", "squat_run-1"))
    assert static["effects"] == []
    assert static["recorded_from_s"] == 0.0
    assert squat["effects"] == ["added_mass", "sync_offset"]
    assert squat["recorded_from_s"] == 0.02
    assert squat["duration_s"] == pytest.approx(2.98)
    segments = sum(s["mass_kg"] for s in truth["person"]["segments"].values())
    assert segments == pytest.approx(truth["person"]["mass_kg"])  # the scale saw no added mass


def test_effects_in_tasks_that_the_study_lacks_are_refused(tmp_path):
    options = StudyOptions(tasks=("static",), effect_tasks=("hops",))
    with pytest.raises(UsageError, match="no trials"):
        simulate_study(tmp_path, options)


@pytest.mark.parametrize("delay", [0.037, -0.05])
def test_a_delayed_force_is_the_force_of_earlier(delay):
    null = readings(measured_with("squat"))
    late = measured_with("squat", ("sync_offset", delay, ""))
    got, start = readings(late), round(1000 * late.start_s)
    shift = round(1000 * delay)
    assert np.abs(got - null[start - shift : start - shift + len(got)]).max() < 1e-9
    assert np.array_equal(
        late.points_m, measured_with("squat").points_m[start // 10 :][: len(late.points_m)]
    )
    assert len(null) - len(got) == 10 * np.ceil(abs(shift) / 10)


def test_a_drifting_clock_loses_its_rate_times_the_time():
    rate = 0.01
    null = readings(measured_with("squat"))
    drift = measured_with("squat", ("clock_drift", rate, ""))
    times = np.arange(len(readings(drift))) / 1000.0 + drift.start_s
    expected = np.interp(times * (1.0 - rate), np.arange(len(null)) / 1000.0, null[:, 2])
    assert drift.start_s == 0.0
    assert np.abs(readings(drift)[:, 2] - expected).max() < 0.01


def test_another_rate_is_stated_of_the_same_samples():
    null, other = measured_with("squat"), measured_with("squat", ("frame_rate", 0.25, ""))
    np.testing.assert_array_equal(other.points_m, null.points_m)
    np.testing.assert_array_equal(readings(other), readings(null))
    assert (other.marker_hz, other.analog_hz) == (0.8 * null.marker_hz, 0.8 * null.analog_hz)


def test_interpolation_is_exact_for_cubics_and_keeps_losses_local():
    x = np.arange(50.0)
    values = np.stack([0.01 * x**3 - x, x**2], axis=1)
    at = np.array([0.0, 0.3, 10.5, 47.9, 49.0])
    expected = np.stack([0.01 * at**3 - at, at**2], axis=1)
    assert np.abs(interpolated(values, at) - expected).max() < 1e-9
    values[20] = np.nan
    lost = np.isnan(interpolated(values, x + 0.5)[:, 0])
    assert set(np.flatnonzero(lost)) == {18, 19, 20, 21}


def test_a_plate_that_is_not_there_is_refused():
    with pytest.raises(UsageError, match="no plate 2"):
        measured_with("squat", ("plate_gain", 0.05, "fz,plate=2"))


def test_a_tilted_lab_sees_the_weight_aslant_and_bodies_unchanged():
    null, tilted = measured_with("static"), measured_with("static", ("gravity_tilt", 0.03, "y"))
    axes = null.plates[0].axes
    force = (readings(tilted)[:, :3] @ axes.T).mean(axis=0)
    upright = (readings(null)[:, :3] @ axes.T).mean(axis=0)
    assert np.linalg.norm(force) == pytest.approx(np.linalg.norm(upright))
    cosine = force @ upright / np.linalg.norm(force) / np.linalg.norm(upright)
    assert np.arccos(cosine) == pytest.approx(0.03, abs=1e-6)
    between = [np.linalg.norm(m.points_m[:, 0] - m.points_m[:, 9], axis=1) for m in (null, tilted)]
    assert np.abs(between[0] - between[1]).max() < 1e-12


def test_cameras_that_are_turned_turn_the_markers_and_leave_the_forces():
    plain, turned = measured_with("static"), measured_with("static", ("camera_frame", 0.02, "x"))
    np.testing.assert_array_equal(plain.channels, turned.channels)
    a, b = plain.points_m, turned.points_m
    np.testing.assert_allclose(b[..., 0], a[..., 0], atol=1e-9)
    np.testing.assert_allclose(b[..., 1], np.cos(0.02) * a[..., 1] - np.sin(0.02) * a[..., 2])


def test_a_marker_slides_within_its_window_and_stays_on_its_segment():
    sliding = ("marker_slide", 0.03, "RELB")
    plain, slid = measured_with("squat"), measured_with("squat", sliding)
    column = plain.labels.index("RELB")
    off = np.linalg.norm(slid.points_m - plain.points_m, axis=2)
    times = np.arange(len(off)) / plain.marker_hz
    start, end = (share * times[-1] for share in effect_of(*sliding).window_share)
    assert not np.delete(off, column, axis=1).any()
    assert off[times < start, column].max() < 1e-9
    np.testing.assert_allclose(off[times > end, column], 0.03)
    middle = off[np.argmin(np.abs(times - 0.5 * (start + end))), column]
    assert middle == pytest.approx(0.015, abs=0.001)


def test_a_slipped_marker_keeps_its_new_place_on_the_segment():
    null = measured_with("squat")
    slipped = measured_with("squat", ("marker_shift", 0.03, "RKNEL,from_s=2"))
    label = null.labels.index("RKNEL")
    travel = np.linalg.norm(slipped.points_m - null.points_m, axis=2)
    assert travel[:200].max() == 0.0
    assert np.abs(travel[206:, label] - 0.03).max() < 1e-9
    assert np.delete(travel, label, axis=1).max() == 0.0
    knee = null.labels.index("RKNEM")
    apart = np.linalg.norm(slipped.points_m[206:, label] - slipped.points_m[206:, knee], axis=1)
    assert np.ptp(apart) < 0.01


def test_swapped_markers_carry_each_others_label_for_a_while():
    null = measured_with("squat")
    swapped = measured_with("squat", ("marker_swap", 1.0, "RWRR+RWRU,start_s=1.5"))
    a, b = (null.labels.index(label) for label in ("RWRR", "RWRU"))
    inside = slice(150, 250)
    assert np.array_equal(swapped.points_m[inside, a], null.points_m[inside, b])
    assert np.array_equal(swapped.points_m[inside, b], null.points_m[inside, a])
    assert np.array_equal(swapped.points_m[:150], null.points_m[:150])
    assert np.array_equal(swapped.points_m[250:], null.points_m[250:])


def test_smoothing_halves_the_power_at_its_cut_off():
    frames, rate = 2000, 100.0
    t = np.arange(frames) / rate
    points = np.zeros((frames, 1, 3))
    points[:, 0, 0] = np.sin(2.0 * np.pi * 4.0 * t)
    points[:, 0, 1] = np.sin(2.0 * np.pi * 0.2 * t)
    points[1500:1510] = np.nan
    plate = SensingPlate(np.eye(3), np.zeros(3), np.zeros(3))
    up = np.array([0.0, 0.0, 1.0])
    here = Instruments(("A",), points, rate, (plate,), np.zeros((1, frames, 6)), rate, up)
    got = effect_of("over_smoothing", 4.0).measured(here).points_m
    ratio = got[300:1200, 0, 0].std() / points[300:1200, 0, 0].std()
    assert ratio == pytest.approx(np.sqrt(0.5), rel=0.02)
    assert np.abs(got[300:1200, 0, 1] - points[300:1200, 0, 1]).max() < 1e-3
    assert np.array_equal(np.isnan(got), np.isnan(points))
