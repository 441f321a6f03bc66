"""Every effect changes forces and markers as first principles say, and nothing else."""

from __future__ import annotations

import json
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import Instruments, SensingPlate, interpolated
from bsip_cli.simulate.balance import Mixer
from bsip_cli.simulate.effects import (
    EFFECTS,
    drawn,
    effects_of,
    pair_up,
    touches,
)
from bsip_cli.simulate.effects.loads import ChestMotion, Swinging
from bsip_cli.simulate.numerics import about_z, derivative
from bsip_cli.simulate.options import Asked, Laboratory, Rates, StudyOptions
from bsip_cli.simulate.plan import GRAVITY, Poses
from bsip_cli.simulate.recording import MM, Measurement, Trial, measure_trial, simulate_trial
from bsip_cli.simulate.study import simulate_study
from tests.blind.outside_effects import OUTSIDE, play
from tests.simulate.conftest import NOTHING_RICH, is_physical, person_of

G = 9.81
PERSON_SEED = 3
DURATION_S = {"static": 3.0, "squat": 4.0, "hops": 4.0, "stepon": 9.0}
SIZES_OF_EFFECTS = """
sync_offset 0.02, clock_drift 0.002, frame_rate 0.2, plate_translation 0.01, plate_rotation 0.03,
plate_gain 0.03, plate_crosstalk 0.02, plate_zero 10.0, plate_drift 1.0, gravity_tilt 0.02,
added_mass 3.0,
released_object 2.0, wobbling_mass 3.0, breathing 0.05, unmeasured_contact 60.0,
joint_centre 0.03, missing_joint 0.3, marker_shift 0.03, marker_swap 1.0, over_smoothing 2.0,
segment_inertia 0.4, implement 0.5, camera_frame 0.02, external_force 60.0, object_handled 2.0,
marker_slide 0.03,
outside_belt_vibration 20.0, outside_plate_hysteresis 8.0, outside_plate_saturation 0.05,
outside_repeated_frames 0.2, outside_elastic_tether 120.0, outside_late_channel 0.02,
outside_loose_connector 0.03, outside_clock_jump 0.05, outside_plate_creep 0.05,
outside_plate_ringing 0.4, outside_slow_forces 3.0, outside_uneven_plate 0.4,
outside_held_samples 0.2, outside_coarse_steps 30.0, outside_water 100.0, outside_camera_bump 0.02
"""  # the contract's vocabulary in its order, and effects outside of it
SIZES = {n: float(x) for n, x in (pair.split() for pair in SIZES_OF_EFFECTS.split(","))}


def effect_of(name: str, size: float | None = None, target: str = "", seed: int = 1):
    asked = Asked(name, SIZES[name] if size is None else size, target)
    return drawn(asked, np.random.default_rng(seed))


@cache
def trial_with(task: str, *asked: tuple[str, float, str]) -> Trial:
    person = person_of(PERSON_SEED)
    rng = np.random.default_rng([PERSON_SEED, 7])
    effects = [effect_of(*one) for one in asked]
    for effect in effects:
        person = effect.person(person)
    return simulate_trial(person, task, rng, DURATION_S[task], effects=effects)


@cache
def measured_with(task: str, *asked: tuple[str, float, str]) -> Measurement:
    """Noise-free, with effects of the instruments only."""
    effects = [effect_of(*one) for one in asked]
    rng = np.random.default_rng(5)
    return measure_trial(
        trial_with(task),
        person_of(PERSON_SEED),
        Rates(),
        Laboratory(),
        NOTHING_RICH,
        rng,
        effects=effects,
    )


def readings(measurement: Measurement) -> np.ndarray:
    """(N, 6) of the first plate in N and N m."""
    return measurement.channels[:, :6] / np.repeat([1.0, MM], 3)


def cop_of(measurement: Measurement) -> np.ndarray:
    """(N, 2) lab, where the file says that the plate lies."""
    plate = measurement.plates[0]
    force, moment = plate.lab_wrench(readings(measurement), plate.centre_m)
    return plate.centre_m[:2] + np.stack([-moment[:, 1], moment[:, 0]], axis=1) / force[:, 2:]


# --- the vocabulary ---------------------------------------------------------------------------


def test_the_vocabulary_is_the_contracts():
    assert [name for name in EFFECTS if name not in OUTSIDE] == [
        name for name in SIZES if not name.startswith("outside_")
    ]
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
    person = person_of(PERSON_SEED)
    effect = effect_of(name)
    rng = np.random.default_rng([PERSON_SEED, 7])
    trial = simulate_trial(effect.person(person), "squat", rng, 4.0, effects=[effect])
    quiet = NOTHING_RICH
    rng = np.random.default_rng(5)
    got = measure_trial(
        trial, effect.person(person), Rates(), Laboratory(), quiet, rng, effects=[effect]
    )
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


def test_mixing_solves_an_iteration_that_alone_would_explode():
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.standard_normal((6, 6)))[0]
    growth = axes @ np.diag([-1.6, -1.2, 0.2, 0.5, 0.9, 0.97]) @ axes.T
    aim, x, mixer = rng.standard_normal(6), np.zeros(6), Mixer()
    for _ in range(30):
        x = x + mixer.step(x, growth @ (x - aim) + aim - x)
    assert np.abs(x - aim).max() < 1e-8


# --- clocks -----------------------------------------------------------------------------------


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


def test_cross_correlation_finds_the_delay():
    late = measured_with("squat", ("sync_offset", 0.0125, ""))
    start = round(1000 * late.start_s)
    here = readings(late)[:, 2] - readings(late)[:, 2].mean()
    null = readings(measured_with("squat"))[start : start + len(here), 2]
    null = null - null.mean()
    lags = np.arange(-30, 31)
    scores = [here[50:-50] @ np.roll(null, lag)[50:-50] for lag in lags]
    assert lags[np.argmax(scores)] in (12, 13)


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


# --- plates -----------------------------------------------------------------------------------


def test_a_plate_that_lies_elsewhere_puts_the_cop_the_other_way():
    shifted = measured_with("squat", ("plate_translation", 0.02, "x"))
    moved = cop_of(shifted) - cop_of(measured_with("squat"))
    assert np.abs(moved - [-0.02, 0.0]).max() < 1e-9
    assert np.array_equal(readings(shifted)[:, :3], readings(measured_with("squat"))[:, :3])


def test_a_turned_plate_turns_force_and_cop_about_its_centre():
    angle = 0.1
    null, turned = measured_with("squat"), measured_with("squat", ("plate_rotation", angle, "yaw"))
    c, s = np.cos(angle), np.sin(angle)
    back = np.array([[c, s], [-s, c]])  # the plate's axes went one way, what it shows the other
    centre = null.plates[0].centre_m[:2]
    expected = (cop_of(null) - centre) @ back.T
    assert np.abs(cop_of(turned) - centre - expected).max() < 1e-9
    axes = null.plates[0].axes
    force, shown = (readings(m)[:, :3] @ axes.T for m in (null, turned))
    assert np.abs(shown[:, :2] - force[:, :2] @ back.T).max() < 1e-9


def test_a_tilted_plate_shows_a_part_of_the_weight_as_horizontal():
    tilted = measured_with("static", ("plate_rotation", 0.02, "tilt_x"))
    axes = tilted.plates[0].axes
    force = readings(tilted)[:, :3] @ axes.T
    null = readings(measured_with("static"))[:, :3] @ axes.T
    expected = null[:, 1].mean() * np.cos(0.02) + np.sin(0.02) * null[:, 2].mean()
    assert force[:, 1].mean() == pytest.approx(expected, abs=1e-9)


def test_channel_errors_are_what_they_say():
    null = readings(measured_with("squat"))
    t = np.arange(len(null)) / 1000.0
    for asked, column, expected in (
        (("plate_gain", 0.05, "fx"), 0, 1.05 * null[:, 0]),
        (("plate_gain", 0.05, ""), 2, 1.05 * null[:, 2]),
        (("plate_zero", -7.0, "my"), 4, null[:, 4] - 7.0),
        (("plate_drift", 0.5, "mz"), 5, null[:, 5] + 0.5 * t),
        (("plate_crosstalk", 0.03, "fz:fy"), 1, null[:, 1] + 0.03 * null[:, 2]),
    ):
        got = readings(measured_with("squat", asked))
        assert np.abs(got[:, column] - expected).max() < 1e-9, asked
        others = np.delete(np.arange(6), column)
        assert np.abs(got[:, others] - null[:, others]).max() < 1e-9, asked


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


# --- what the body carries --------------------------------------------------------------------


def test_an_added_mass_weighs_and_keeps_flight_free():
    person = person_of(PERSON_SEED)
    asked = ("added_mass", 4.0, "forearm_r")
    standing = trial_with("static", asked).force_n[:, 1].mean()
    assert standing == pytest.approx((person.mass_kg + 4.0) * G, rel=1e-4)
    assert air_force(trial_with("hops", asked)) < 0.05


@pytest.mark.parametrize(
    "asked",
    [
        ("wobbling_mass", 6.0, "upper_torso"),
        ("released_object", 1.5, "hand_r"),
        ("breathing", 0.05, ""),
        ("unmeasured_contact", 40.0, "hand_l"),
        ("implement", 0.5, "hand_r"),
        ("external_force", 60.0, "upper_torso"),
        ("object_handled", 1.5, "hand_l"),
    ],
)
def test_flight_stays_free_of_ground_force(asked):
    hops = trial_with("hops", asked)
    assert len(hops.plan.flights) >= 3
    assert air_force(hops) < 1.0
    assert hops.force_n[:, 1].min() > -8.0


def air_force(trial: Trial) -> float:
    """Largest ground force in flight, 5 samples away from its ends."""
    start = trial.plan.keep.start
    return max(
        np.abs(trial.force_n[a - start + 5 : b - start - 4]).max() for a, b in trial.plan.flights
    )


def test_a_released_object_leaves_the_plate_at_its_time():
    trial = trial_with("static", ("released_object", 2.0, "hand_r,release_s=1.5"))
    weight = person_of(PERSON_SEED).mass_kg * G
    held, gone = trial.force_n[200:1400, 1], trial.force_n[1600:2800, 1]
    assert held.mean() == pytest.approx(weight + 2.0 * G, abs=0.5)
    assert gone.mean() == pytest.approx(weight, abs=0.5)
    half = weight + G
    assert np.argmax(trial.force_n[:, 1] < half) == pytest.approx(1500, abs=5)


def test_an_unmeasured_contact_takes_its_mean_force_off_the_plate():
    target = "hand_l,start_s=0.8,end_s=2.4"
    trial = trial_with("static", ("unmeasured_contact", 80.0, target))
    weight = person_of(PERSON_SEED).mass_kg * G
    assert trial.force_n[800:2400, 1].mean() == pytest.approx(weight - 80.0, abs=1.0)
    assert trial.force_n[2450:2900, 1].mean() == pytest.approx(weight, abs=1.0)


def test_a_constant_force_takes_itself_off_the_plate():
    trial = trial_with("static", ("external_force", 60.0, "upper_torso"))
    effect = effect_of("external_force", 60.0, "upper_torso")
    expected = [0.0, person_of(PERSON_SEED).mass_kg * G, 0.0] - 60.0 * effect.direction
    np.testing.assert_allclose(trial.force_n.mean(axis=0), expected, atol=1.0)
    assert effect.facts(person_of(PERSON_SEED))["upwards_n"] > 57.0


def test_an_object_weighs_from_picking_up_to_putting_down():
    trial = trial_with("static", ("object_handled", 2.0, "hand_l"))
    effect = effect_of("object_handled", 2.0, "hand_l")
    start, end = (round(1000 * t) for t in effect.window_s(DURATION_S["static"]))
    weight, force = person_of(PERSON_SEED).mass_kg * G, trial.force_n[:, 1]
    assert force[start + 60 : end - 60].mean() == pytest.approx(weight + 2.0 * G, abs=0.5)
    for part in (slice(20, start - 60), slice(end + 60, -20)):
        assert force[part].mean() == pytest.approx(weight, abs=1.0)


def test_an_implement_weighs_where_its_centre_is():
    """The person leans to balance it: the moment is that of all weights where they are."""
    trial, person = trial_with("static", ("implement", 0.5, "hand_r")), person_of(PERSON_SEED)
    effect, poses = effect_of("implement", 0.5, "hand_r"), trial.poses
    held = person.segment_inertias()["hand_r"].com_m + effect.centre_m
    parts = [(body, one.mass_kg, one.com_m) for body, one in person.inertias.items()]
    expected = np.zeros((2, 3))
    for body, mass_kg, place in (*parts, ("hand_r", 0.5, held)):
        weight = np.array([0.0, mass_kg * G, 0.0])
        at = poses.point(body, place)[trial.plan.keep].mean(axis=0)
        expected += weight, np.cross(at, weight)
    np.testing.assert_allclose(trial.force_n.mean(axis=0), expected[0], atol=0.3)
    np.testing.assert_allclose(trial.moment_nm.mean(axis=0), expected[1], atol=0.3)
    assert 0.3 <= effect.facts(person)["distance_m"] <= 0.9


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


def test_a_body_with_loads_still_obeys_newton_and_euler():
    """The whole person and all that is carried, by momenta of single masses."""
    trial = trial_with("squat", ("released_object", 3.0, "hand_l,release_s=9"))
    person = person_of(PERSON_SEED)
    poses, (ball,) = trial.poses, trial.plan.loads
    carried = poses.point(ball.body, ball.position_m)
    masses = [part.mass_kg for part in person.inertias.values()] + [3.0]
    points = [poses.point(body, part.com_m) for body, part in person.inertias.items()] + [carried]
    momentum = sum(m * derivative(r, 0.001) for m, r in zip(masses, points, strict=True))
    expected = derivative(momentum, 0.001) - sum(masses) * GRAVITY
    assert np.abs(trial.force_n - expected)[20:-20].max() < 1e-3


def test_a_wobbling_mass_rings_at_its_frequency_and_hangs_still_at_rest():
    t = np.arange(4000) * 0.001
    place = np.zeros((4000, 3))
    place[:, 1] = 0.01 * np.clip((t - 0.5) / 0.05, 0.0, 1.0) ** 2 * (t < 0.55) + 0.01 * (t >= 0.55)
    poses = Poses({"b": np.broadcast_to(np.eye(3), (4000, 3, 3))}, {"b": place}, np.zeros(4000))
    swing = Swinging("b", 2.0, np.zeros(3), 5.0, 0.1)
    force, moment = swing.wrench(poses, 0.001)
    assert np.abs(force[:450] - [0.0, 2.0 * G, 0.0]).max() < 1e-6
    ring = force[600:, 1] - 2.0 * G
    crossings = np.flatnonzero(np.diff(np.sign(ring)))[:6]
    period = 2.0 * np.diff(crossings).mean() * 0.001
    assert 1.0 / period == pytest.approx(5.0 * np.sqrt(1.0 - 0.1**2), rel=0.01)
    peaks = [np.abs(ring[a:b]).max() for a, b in pairwise(crossings)]
    decay = np.log(peaks[0] / peaks[2]) / (2.0 * np.pi)
    assert decay == pytest.approx(0.1 / np.sqrt(1.0 - 0.1**2), rel=0.05)
    assert np.abs(moment).max() < 1e-9


def test_a_wobbling_mass_is_part_of_the_segment():
    asked = ("wobbling_mass", 3.0, "upper_torso,frequency=5,damping=0.2")
    person = person_of(PERSON_SEED)
    still = trial_with("static", asked)
    assert still.force_n[:, 1].mean() == pytest.approx(person.mass_kg * G, rel=1e-3)
    slow = trial_with("squat", asked).force_n - trial_with("squat").force_n
    quick = trial_with("hops", asked).force_n - trial_with("hops").force_n
    assert np.abs(quick).max() > 5.0 * np.abs(slow).max()
    with pytest.raises(UsageError, match="cannot wobble"):
        trial_with("squat", ("wobbling_mass", 20.0, "thigh_r"))


def test_breath_moves_as_much_mass_as_a_real_mass_would():
    """The dipole against a 5 kg mass that moves, less the same mass at rest."""
    t = np.arange(3000) * 0.001
    turning = about_z(0.3 * np.sin(2.0 * t))
    place = np.stack([0.1 * np.sin(3.0 * t), 1.2 + 0.05 * np.cos(2.0 * t), 0 * t], axis=1)
    poses = Poses({"thorax": turning}, {"thorax": place}, np.zeros(3000))
    com, mass = np.array([0.02, -0.2, 0.0]), 5.0
    dipole = 0.02 * np.sin(2.0 * np.pi * 0.25 * t)[:, None] * np.array([0.8, 0.6, 0.0])
    force, moment = ChestMotion("thorax", com, dipole).wrench(poses, 0.001)
    both = []
    for moved in (1.0, 0.0):
        r = place + np.einsum("tij,tj->ti", turning, com + moved * dipole / mass)
        pull = mass * (derivative(derivative(r, 0.001), 0.001) - GRAVITY)
        both.append((pull, np.cross(r, pull)))
    inner = slice(20, -20)
    assert np.abs(force - (both[0][0] - both[1][0]))[inner].max() < 1e-6
    assert np.abs(moment - (both[0][1] - both[1][1]))[inner].max() < 2e-3
    assert np.abs(moment)[inner].max() > 0.1


def test_a_tether_pulls_the_more_the_farther():
    trial = trial_with("squat", ("outside_elastic_tether", 200.0, ""))
    (band,) = trial.plan.loads
    pull = -band.wrench(trial.poses, 0.001)[0]
    length = np.linalg.norm(trial.poses.origin_m["lower_torso"] - band.fastened_m, axis=1)
    slope = np.polyfit(length, np.linalg.norm(pull, axis=1), 1)[0]
    assert slope == pytest.approx(200.0, rel=1e-6)
    assert trial.force_n[:, 0].mean() == pytest.approx(-pull[:, 0].mean(), abs=1.0)


# --- the person -------------------------------------------------------------------------------


def test_the_trunk_is_stiff_unless_it_bends_by_the_asked_range():
    stiff = trial_with("squat").poses.rotation
    assert np.array_equal(stiff["abdomen"], stiff["thorax"])
    bent = trial_with("squat", ("missing_joint", 0.25, ""))
    spine = bent.plan.angles_rad["spine"][bent.plan.keep, 0]
    assert np.ptp(spine) == pytest.approx(0.25, rel=1e-6)
    between = np.swapaxes(bent.poses.rotation["abdomen"], 1, 2) @ bent.poses.rotation["thorax"]
    assert np.abs(between - np.eye(3)).max() > 0.2
    assert bent.plan.notes["missing_joint_range_rad"] == pytest.approx(0.25)


def test_a_segment_far_from_the_table_keeps_the_persons_mass():
    person = person_of(PERSON_SEED)
    heavy = effect_of("segment_inertia", 0.4, "thigh_l").person(person)
    total = sum(part.mass_kg for part in heavy.inertias.values())
    assert total == pytest.approx(person.mass_kg)
    ratio = heavy.inertias["thigh_l"].mass_kg / person.inertias["thigh_l"].mass_kg
    assert ratio == pytest.approx(1.4)
    assert all(is_physical(part) for part in heavy.segment_inertias().values())


@pytest.mark.parametrize("joint", ["hip_r", "shoulder_l", "knee_l", "ankle_r", "elbow_r"])
def test_a_joint_centre_lies_elsewhere_than_its_landmarks_say(joint):
    person = person_of(PERSON_SEED)
    effect = effect_of("joint_centre", 0.03, joint)
    moved = effect.person(person)
    assert np.linalg.norm(effect.shift_m) == pytest.approx(0.03)
    if joint in ("hip_r", "shoulder_l"):
        assert np.allclose(moved.joints_m[joint] - person.joints_m[joint], effect.shift_m)
        assert moved.markers == person.markers
    else:
        changed = [m for m in person.markers if moved.markers[m] is not person.markers[m]]
        assert changed
        for label in changed:
            shift = moved.markers[label].position_m - person.markers[label].position_m
            assert np.allclose(shift, -effect.shift_m)


# --- markers ----------------------------------------------------------------------------------


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


# --- outside the catalogue --------------------------------------------------------------------


def test_a_backlash_follows_at_half_its_width():
    t = np.linspace(0.0, 4.0 * np.pi, 2000)
    shown = play(10.0 * np.sin(t), 4.0)
    assert shown[500:].max() == pytest.approx(8.0, abs=1e-3)
    assert np.abs(shown - 10.0 * np.sin(t)).max() <= 2.0 + 1e-9


def test_repeated_frames_have_the_asked_share():
    stalled = measured_with("squat", ("outside_repeated_frames", 0.25, ""))
    still = np.all(np.diff(stalled.points_m, axis=0) == 0.0, axis=(1, 2))
    assert 0.2 < still.mean() < 0.35


def channel_of(name: str, size: float, column: int, target: str = "") -> tuple[np.ndarray, ...]:
    """A channel (N,) without and with an effect, and the times of its samples."""
    plain, other = measured_with("squat"), measured_with("squat", (name, size, target))
    rest = [c for c in range(6) if c != column]
    if name != "outside_clock_jump":
        np.testing.assert_allclose(plain.channels[:, rest], other.channels[:, rest], atol=1e-6)
    times = np.arange(len(plain.channels)) / plain.analog_hz
    return plain.channels[:, column], other.channels[:, column], times


def test_a_late_channel_is_the_channel_of_a_moment_ago():
    plain, late, times = channel_of("outside_late_channel", 0.02, 0, "fx")
    lag = round(0.02 / (times[1] - times[0]))
    np.testing.assert_allclose(late[lag:], plain[:-lag], atol=1e-6)


def test_a_loose_connector_changes_the_gain_of_the_vertical_channel():
    plain, other, _ = channel_of("outside_loose_connector", 0.03, 2)
    gain = other / plain - 1.0
    assert 0.005 < gain.std() < 0.06
    assert np.abs(np.diff(gain)).max() < 1e-3


def test_a_clock_that_jumps_is_right_before_and_late_after():
    plain, other, times = channel_of("outside_clock_jump", 0.05, 2)
    before, after = times < 0.3 * times[-1], times > 0.7 * times[-1]
    np.testing.assert_allclose(other[before], plain[before], atol=1e-6)
    lag = round(0.05 / (times[1] - times[0]))
    shifted = np.roll(plain, lag)
    np.testing.assert_allclose(other[after], shifted[after], atol=1e-6)
