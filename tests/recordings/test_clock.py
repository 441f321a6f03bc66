"""Forces go with the momentum of the body that they drive: of another clock they are moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.body_motion import USUAL, Balance, Body, turn_of_forces
from bsip_cli.recordings.plate_reading import FrameChange, Opened
from bsip_cli.recordings.read import assemble, open_recording
from bsip_cli.recordings.session_reading import session_reading
from bsip_cli.recordings.trial_samples import Delay, Lags, TrialSamples, lags, surest
from tests.recordings.standing_on_two_plates import RATE_HZ, N, motion, of_c3d, of_table, opened

BODY_HZ, N_BODY, MASS_KG = 100.0, 300, 70.0
FRAMES = np.arange(N_BODY)


def _trunk() -> dict[str, np.ndarray]:
    """A trunk that sways and turns about the vertical; one segment that holds all of the mass."""
    t = FRAMES / BODY_HZ
    arms = np.array([[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, -0.2, 0.0]])
    turned = [Rotation.from_euler("z", 0.4 * np.sin(5.0 * t)[:, None]).apply(arm) for arm in arms]
    path = np.column_stack([0.05 * np.sin(4.0 * t), 0.03 * np.cos(6.0 * t), np.ones_like(t)])
    return {"lower_torso": np.stack([arm + path for arm in turned], axis=1)}


def _wrench(body: Body) -> np.ndarray:
    """What Newton and Euler ask for, about the world's origin."""
    force = MASS_KG * (body.rate[:, :3] + np.array([0.0, 0.0, GRAVITY_M_S2]))
    moment = MASS_KG * body.rate[:, 3:] + np.cross(body.place_m, force)
    return np.nan_to_num(np.hstack([force, moment]))


@pytest.fixture(scope="module")
def body():
    return Body.of(_trunk(), BODY_HZ, FRAMES)


def test_its_own_wrench_balances_and_drives_it(body):
    found = Balance.of(body, _wrench(body), USUAL)
    assert max(found.gaps_m) < 1e-6
    assert all(found.correlations[kind] > 0.95 for kind in ("force", "vertical"))
    assert found.drive_log_likelihood() > 10.0


@pytest.mark.parametrize(("columns", "kind"), [([0, 1], "force"), ([5], "vertical")])
def test_a_reversed_part_goes_against_the_motion(body, columns, kind):
    about_centre = _wrench(body)
    about_centre[:, 3:] -= np.cross(body.place_m, about_centre[:, :3])
    about_centre[:, columns] *= -1.0
    about_centre[:, 3:] += np.cross(body.place_m, about_centre[:, :3])
    assert Balance.of(body, about_centre, USUAL).correlations[kind] < -0.95


def test_other_axes_change_nothing(body):
    mirror = np.diag([1.0, -1.0, 1.0])
    wrench = _wrench(body)
    seen = np.hstack([wrench[:, :3] @ mirror, -wrench[:, 3:] @ mirror])
    one = Balance.of(body, wrench, USUAL)
    other = Balance.of(body.moved(mirror), seen, USUAL)
    assert one.numbers == other.numbers
    assert one.correlations == pytest.approx(other.correlations)


@pytest.mark.parametrize(
    "change", [np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, -1.0, 1.0]), np.eye(3)[[1, 0, 2]]]
)
def test_the_force_alone_goes_with_the_body_in_whatever_axes(body, change):
    """And whatever its moments are."""
    wrench = _wrench(body)
    one = Balance.of(body, wrench, USUAL)
    other = Balance.of(body, np.hstack([wrench[:, :3] @ change.T, 0.0 * wrench[:, 3:]]), USUAL)
    assert other.level_log_likelihood() == pytest.approx(one.level_log_likelihood(), rel=1e-3)
    assert one.level_log_likelihood() > 10.0
    assert other.drive_log_likelihood() < 0.5 * one.drive_log_likelihood()


def test_a_body_of_which_little_is_seen_says_nothing():
    little = Body.of({"foot_l": _trunk()["lower_torso"]}, BODY_HZ, FRAMES)
    found = Balance.of(little, np.ones((N_BODY, 6)), USUAL)
    assert found.gaps_m == () and found.log_likelihood(USUAL) == 0.0


def test_each_trial_counts_with_its_own_means(body):
    """A force that is offset in one of two trials goes with the motion no less."""
    offset = _wrench(body)
    offset[:, 0] += 30.0
    one = Balance.of(body, _wrench(body), USUAL)
    both = Balance.of(Body.of_all([body, body]), np.vstack([_wrench(body), offset]), USUAL)
    assert len(both.gaps_m) == 2
    assert both.correlations["force"] == pytest.approx(one.correlations["force"], abs=1e-3)


def test_a_centre_of_mass_that_is_thought_to_be_elsewhere_is_a_gap_and_no_motion(body):
    wrench = _wrench(body)
    aside = replace(body, place_m=body.place_m + np.array([0.03, -0.02, 0.0]))
    one, other = (Balance.of(each, wrench, USUAL) for each in (body, aside))
    assert max(other.gaps_m) == pytest.approx(np.hypot(0.03, 0.02), rel=0.05)
    assert other.correlations["level"] == pytest.approx(one.correlations["level"], abs=0.02)


def test_noise_is_that_of_markers_seen_to_a_millimetre():
    """White noise on markers at rest, against what is said of its momentum's rate."""
    rng = np.random.default_rng(3)
    still = np.repeat(_trunk()["lower_torso"][:1], 4000, axis=0)
    noisy = {"lower_torso": still + rng.normal(0.0, 1e-3, still.shape)}
    body = Body.of(noisy, BODY_HZ, np.arange(4000))
    expected = 1e-6 * body.noise[0]
    np.testing.assert_allclose(np.nanvar(body.rate, axis=0), expected, rtol=0.25)


@pytest.mark.parametrize("turn_deg", [-125.0, 0.0, 31.0])
def test_the_turn_of_forces_is_found(body, turn_deg):
    turn = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    noise = np.random.default_rng(1).normal(0.0, 5.0, (N_BODY, 6))
    angle, sd = turn_of_forces(body, _wrench(body) @ np.kron(np.eye(2), turn) + noise, USUAL)
    assert np.rad2deg(sd) < 5.0
    assert np.rad2deg(angle) == pytest.approx(turn_deg, abs=3 * np.rad2deg(sd))


MOVING = (  # walks, a jump, sitting down: each alone tells that its rate is twice the cameras'
    "zoo_children/HC031A-straight.c3d",
    "opencap_subject4/STS1.trc",
    "opencap_subject4/walking1.trc",
    "motionanalysis_helenhayes/Sample_Jump2.c3d",
)
REAL = {  # one of each: quiet on one leg, squats, gait, golf, jump, sitting down, running
    "biobuddy_ech/right_knee.c3d": True,
    "opencap_subject4/squats1.trc": True,
    "zoo_children/HC031A-straight.c3d": False,
    "ktk_walk_and_serve/walk.c3d": True,
    "golf_french/swing3.c3d": True,
    "motionanalysis_helenhayes/Sample_Jump2.c3d": True,
    "opencap_subject4/STS1.trc": True,
    "hamner_other/run200.trc": False,
    "golf_french/static.c3d": False,
}


def session_of(trial: Opened, *others: Opened):
    return session_reading([TrialSamples.of(one) for one in (trial, *others)])


def test_where_another_trial_is_late_a_quiet_one_says_that_it_shows_nothing():
    quiet = opened(of_c3d())
    session = replace(session_of(quiet), delays_s={"b": -0.95})
    (said,) = (f for f in assemble(quiet, session).findings if f.check == "delay")
    assert said.level == "warning" and "in b the forces come 0.95 s earlier" in said.found


@pytest.mark.parametrize(
    ("make", "delay_s"),
    [(of_c3d, -0.65), (of_table, -0.5), (of_c3d, 0.55), (of_table, 0.8), (of_c3d, 1.3)],
)
def test_a_delay_is_found_and_taken_off(make, delay_s):
    sound = opened(make())
    late = sound.with_forces_from(-delay_s)
    session = session_of(late)
    assert session.delays_s == {"a": pytest.approx(delay_s, abs=0.015)}
    read = assemble(late, session)
    (said,) = (f for f in read.findings if f.check == "delay")
    assert said.level == "warning" and f"{abs(session.delays_s['a']):.2f} s" in said.found
    by = round(session.delays_s["a"] * RATE_HZ)
    whole = slice(max(-by, 0), N - max(by, 0))
    assert all(plate.usable[whole].all() for plate in read.plates)
    lost = np.ones(N, bool)
    lost[whole] = False
    assert not any(plate.usable[lost].any() for plate in read.plates)
    truth = assemble(sound, session_of(sound))
    for found, true in zip(read.plates, truth.plates, strict=True):
        off = np.abs(found.force_N - true.force_N)[whole][abs(by) : -abs(by)]
        assert off.max() < 0.05 * true.force_N[:, 2].max()


def test_small_delays_and_sound_trials_are_left_alone():
    for delay_s in (-0.06, 0.0, 0.06):
        assert session_of(opened(of_c3d()).with_forces_from(delay_s)).delays_s == {}


def test_quiet_stance_tells_no_delay():
    still = np.repeat(motion()[0][:1], N, axis=0)
    still += np.random.default_rng(5).normal(0.0, 2e-4, still.shape)
    assert session_of(opened(of_c3d(), still).with_forces_from(0.4)).delays_s == {}


def test_side_forces_of_the_other_sign_are_no_delay():
    """Half a period later they would go with the motion; a repair explains them better."""
    signs = np.array([-1.0, -1.0, 1.0, -1.0, -1.0, 1.0])
    wrong = [replace(one, measured=one.measured * signs) for one in of_c3d()]
    assert session_of(opened(wrong)).delays_s == {}


@pytest.mark.parametrize("axis", [0, 1])
def test_a_delay_is_found_in_forces_of_a_mirrored_frame(axis):
    late = opened(of_c3d()).in_frame(FrameChange("forces", axis)).with_forces_from(-0.6)
    session = session_of(late)
    assert list(session.delays_s.values()) == [pytest.approx(0.6, abs=0.03)]
    assert session.frame == FrameChange("forces", axis)


@pytest.mark.parametrize(
    ("make", "delay_s", "fault"),
    [
        (of_table, -0.5, {"about": "origin"}),
        (of_table, 0.8, {"moment_scale": 1e3}),
        (of_c3d, -0.5, {"turn": 1}),
        (of_c3d, 0.8, {"moment_scale": 1e-3}),
    ],
)
def test_a_delay_is_found_in_forces_whose_moments_or_axes_are_wrong_too(make, delay_s, fault):
    wrong = opened(make(**fault))
    late = session_of(wrong.with_forces_from(-delay_s))
    assert list(late.delays_s.values()) == [pytest.approx(delay_s, abs=0.03)]
    assert [one.reading.words() for one in late.plates.values()] == [
        one.reading.words() for one in session_of(wrong).plates.values()
    ]


def of_lags(**peaks: dict[float, float]) -> Lags:
    """Narrow peaks, by their seconds, of each likelihood."""
    seconds = np.round(np.arange(-2.0, 2.001, 0.02), 2)
    found = {
        name: sum(
            (high * np.exp(-(((seconds - at) / 0.04) ** 2)) for at, high in highs.items()),
            np.zeros_like(seconds),
        )
        for name, highs in ({"as_stated": {}, "of_force": {}, "of_lift": {}} | peaks).items()
    }
    return Lags(seconds, 1.0 - np.abs(seconds) / 4.0, **found)


def test_each_cycle_of_a_motion_may_be_the_right_one():
    cycles = {-0.85: 9.0, 0.35: 10.0, 1.55: 3.0}
    none, *late = of_lags(of_force=cycles, of_lift=cycles).delays()
    assert none.seconds == 0.0
    assert [one.seconds for one in late] == [pytest.approx(x, abs=0.005) for x in (-0.85, 0.35)]
    near, far = (next(x for x in late if (x.seconds > 0) == ahead) for ahead in (True, False))
    rarer = np.log(0.85 / 0.35)
    assert near.log_posterior - far.log_posterior == pytest.approx(1.0 + rarer, abs=0.1)
    assert near.kept > far.kept


def test_no_delay_is_tried_where_none_suits_as_well():
    assert len(of_lags(of_force={0.0: 9.0, 0.5: 10.0}).delays()) == 1
    assert len(of_lags(of_force={0.5: 2.0}).delays()) == 1
    assert len(of_lags(as_stated={0.5: 9.0}, of_lift={0.0: 9.0}).delays()) == 2


def test_the_likeliest_delay_is_taken_if_it_or_one_near_it_is_sure():
    one, near, other = (Delay(seconds) for seconds in (0.3, 0.32, 1.1))
    assert surest({}, 0.0, USUAL) is None
    assert surest({one: 9.0, near: 8.5, other: 2.0}, 0.0, USUAL) == one
    assert surest({one: 9.0, other: 8.5}, 0.0, USUAL) is None
    assert surest({one: 9.0}, 8.5, USUAL) is None


def test_only_the_trial_that_is_late_is_moved():
    sound, late = opened(of_c3d()), opened(of_c3d()).with_forces_from(-0.6)
    assert len(session_of(sound, sound, late).delays_s) == 1


def test_without_forces_or_at_two_frames_a_second_nothing_is_asked():
    assert lags(opened([])) is None
    slow = opened(of_c3d())
    recording = replace(slow.recording, marker_rate_hz=2.0, analog_rate_hz=2.0)
    assert lags(replace(slow, recording=recording)) is None


@pytest.mark.parametrize("name", REAL)
def test_real_recordings_have_no_delay_and_a_hidden_one_is_found(real_data, name):
    sound = open_recording(real_data / name)
    session = session_of(sound)
    assert session.delays_s == {} and session.drifts_s == {}
    hidden = session_of(sound.with_forces_from(-0.37)).delays_s
    if REAL[name]:
        assert list(hidden.values()) == [pytest.approx(0.37, abs=0.04)]
    else:
        assert all(abs(found - 0.37) < 0.04 for found in hidden.values())


@pytest.mark.parametrize("n", [8, 20])
def test_rows_that_are_lost_where_the_rest_is_numbered_without_gaps_are_said(real_data, n):
    sound = open_recording(real_data / "opencap_subject4/squats1.trc")
    rows = np.arange(len(sound.sources[0].usable))
    starts = np.linspace(0.1, 0.9, 5) * len(rows)
    kept = np.setdiff1d(rows, [int(start) + k for start in starts for k in range(n)])
    kept = np.pad(kept, (0, len(rows) - len(kept)), mode="edge")
    torn = replace(sound, sources=tuple(one.at(kept) for one in sound.sources))
    session = session_of(torn)
    lost_s = 5 * n / sound.recording.analog_rate_hz
    assert session.drifts_s["squats1"] == pytest.approx(-lost_s, abs=0.3 * lost_s + 0.05)
    said = [f for f in assemble(torn, session).findings if "drift apart" in f.found]
    assert [f.level for f in said] == ["warning"] and "further ahead" in said[0].found


@pytest.mark.parametrize("times", [0.94, 1.05, 1.09])
def test_a_clock_that_runs_faster_is_said(real_data, times):
    sound = open_recording(real_data / "opencap_subject4/squats1.trc")
    rows = np.arange(len(sound.sources[0].usable))
    read = (rows / times).round().astype(int).clip(0, rows[-1])
    drifts = session_of(replace(sound, sources=tuple(s.at(read) for s in sound.sources))).drifts_s
    assert np.sign(drifts["squats1"]) == np.sign(times - 1.0)


def test_a_small_delay_is_found_where_the_body_moves_fast(real_data):
    jump = open_recording(real_data / "motionanalysis_helenhayes/Sample_Jump2.c3d")
    late = session_of(jump.with_forces_from(-0.07))
    assert list(late.delays_s.values()) == [pytest.approx(0.07, abs=0.02)]


def at_rate(trial: Opened, times: float) -> Opened:
    """The same, of a file that states so many times its rate."""
    one = trial.recording
    rates = {
        "marker_rate_hz": times * one.marker_rate_hz,
        "analog_rate_hz": times * one.analog_rate_hz,
    }
    return replace(trial, recording=replace(one, **rates))


@pytest.mark.parametrize("name", MOVING)
def test_a_body_that_moves_at_another_pace_than_its_forces_say(real_data, name):
    sound = open_recording(real_data / name)
    assert session_of(sound).maybe_paces == {}
    for times in (0.5, 2.0):
        session = session_of(wrong := at_rate(sound, times))
        assert list(session.paces.values()) == [pytest.approx(1 / times, rel=0.25)]
        read = assemble(wrong, session)
        assert not read.plates and f"{wrong.recording.marker_rate_hz:g} Hz" in read.forces_note


def test_all_trials_of_a_session_together_tell_a_pace_that_none_tells_alone(real_data):
    walks = [
        at_rate(open_recording(real_data / f"opencap_subject4/{name}.trc"), 0.8)
        for name in ("walking1", "walking2", "STS1", "squats1", "static1")
    ]
    assert not any(session_of(walk).paces for walk in walks)
    found = session_of(*walks).paces
    assert len(found) == 5 and set(found.values()) < {1.2, 1.25, 1.5}


def test_a_rate_that_is_not_believed_is_said_and_taken(real_data):
    """Slow squats hardly move their plates: half the rate is not sure."""
    wrong = at_rate(open_recording(real_data / "opencap_subject4/squats1.trc"), 0.5)
    session = session_of(wrong)
    assert not session.paces and list(session.maybe_paces.values()) == [2.0]
    read = assemble(wrong, session)
    (said,) = (f for f in read.findings if f.check == "rate")
    assert (
        read.plates and said.level == "warning" and "perhaps the body moves about 2" in said.found
    )


def test_no_pace_is_told_of_who_stands_still_or_is_held_by_others():
    still = np.repeat(motion()[0][:1], N, axis=0)
    assert session_of(opened(of_c3d(), still)).maybe_paces == {}
    half = [replace(one, usable=one.usable & (k > 0)) for k, one in enumerate(of_c3d())]
    assert session_of(opened(half)).maybe_paces == {}
