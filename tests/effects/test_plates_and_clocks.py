"""What plates and clocks get wrong, against readings spoilt by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.dynamics.ground_wrench import centre_of_pressure, pinocchio_model, predicted_wrench
from bsip_cli.effects.plates import (
    ClockDrift,
    FrameRate,
    GravityTilt,
    PlateCrosstalk,
    PlateDrift,
    PlateGain,
    PlateRotation,
    PlateTranslation,
    PlateZero,
    SyncOffset,
)
from bsip_cli.effects.scene import Plate, Scene
from tests.body.standing_person import Swing, standing
from tests.effects.moving_scene import RATE_HZ, moving, phi, rms, scene_of, standing_still

# A plate as files have it: turned by 30 degrees, x from the second corner to the first, y from the
# fourth to the first, z into the floor, moments about a sensor below the surface.
X = np.array([np.cos(0.5), np.sin(0.5), 0.0])
Y = np.array([np.sin(0.5), -np.cos(0.5), 0.0])
OWN = np.stack([X, Y, np.cross(X, Y)])
CENTRE = np.array([0.2, -0.1, 0.01])
SENSOR = CENTRE - np.array([0.0, 0.0, 0.04])
CORNERS = CENTRE + np.array(
    [0.3 * X * i + 0.2 * Y * j for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
)

CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")


def reading_of(wrench: np.ndarray) -> np.ndarray:
    """(N, 6) channels on the body in the plate's own axes, z down, about the sensor."""
    force = wrench[:, :3]
    return np.hstack([force @ OWN.T, (wrench[:, 3:] - np.cross(SENSOR, force)) @ OWN.T])


def wrench_of(reading: np.ndarray) -> np.ndarray:
    force = reading[:, :3] @ OWN
    return np.hstack([force, reading[:, 3:] @ OWN + np.cross(SENSOR, force)])


def scene_with(spoil) -> tuple[Scene, np.ndarray]:
    """One plate that carries all and shows ``spoil(its true reading)``, under a person who is
    simulated too light; and what it shows too much.

    The spoiling function takes channels in the plate's own axes turned until z points up.
    """
    scene, turned = moving(), np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    shown = wrench_of(turned * spoil(turned * reading_of(scene.predicted)))
    plates = (Plate("1", CORNERS, shown, SENSOR),)
    return replace(scene, plates=plates, phi=0.9 * scene.phi), shown - scene.predicted


def test_an_offset_is_not_shared_by_a_trial_whose_zero_was_taken_off():
    scene = moving()
    first, *others = scene.plates
    zeroed = replace(scene, plates=(replace(first, zeroed=True), *others))
    target = f"{first.name} fz"
    assert PlateZero().is_shared_at(scene, target) and not PlateZero().is_shared_at(zeroed, target)
    assert PlateZero().is_shared_at(zeroed, f"{others[0].name} fz")
    assert PlateGain().is_shared_at(zeroed, target)
    assert target in PlateZero().targets(zeroed)  # it may be wrong there for reasons of its own


def test_a_plate_that_software_set_to_zero_shows_no_offset_there():
    scene = moving()
    first, *others = scene.plates
    silent = np.arange(len(scene.times_s)) < 10
    quiet = replace(scene, plates=(replace(first, silent=silent), *others))
    change = PlateZero().change(quiet, f"{first.name} fz", np.array([10.0]))
    assert not change[silent].any() and (change[~silent, 2] == 10.0).all()


def test_the_plates_axes_are_its_own_with_z_up():
    plate = Plate("1", CORNERS, np.zeros((1, 6)))
    np.testing.assert_allclose(plate.axes(), [X, -Y, [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(plate.axes()), 1)


@pytest.mark.parametrize("channel", CHANNELS)
def test_errors_of_one_channel_whatever_the_simulation_is(channel):
    k = CHANNELS.index(channel)
    unit = np.eye(6)[k]
    times = moving().times_s[:, None]
    cases = [
        (PlateGain(), 0.05, lambda r: r * (1 + 0.05 * unit)),
        (PlateZero(), -7.0, lambda r: r - 7.0 * unit),
        (PlateDrift(), 0.3, lambda r: r + 0.3 * times * unit),
    ]
    for effect, size, spoil in cases:
        scene, too_much = scene_with(spoil)
        change = effect.change(scene, f"1 {channel}", np.array([size]))
        np.testing.assert_allclose(change, too_much, atol=1e-8, err_msg=effect.name)


@pytest.mark.parametrize(("source", "sink"), [("fz", "fx"), ("fx", "fy"), ("fy", "fz")])
def test_crosstalk(source, sink):
    names = ("fx", "fy", "fz")

    def spoil(reading):
        spoilt = reading.copy()
        spoilt[:, names.index(sink)] += 0.03 * reading[:, names.index(source)]
        return spoilt

    scene, too_much = scene_with(spoil)
    change = PlateCrosstalk().change(scene, f"1 {source}>{sink}", np.array([0.03]))
    np.testing.assert_allclose(change, too_much, atol=1e-8)


@pytest.mark.parametrize(
    ("effect", "target"),
    [
        (PlateZero(), "1 fx"),
        (PlateZero(), "1 fy"),
        (PlateZero(), "1 fz"),
        (PlateDrift(), "1 fz"),
        (PlateGain(), "1 fz"),
        (PlateCrosstalk(), "1 fx>fy"),
    ],
)
def test_of_a_plate_without_a_place_every_place_is_possible(effect, target):
    """Moved along the floor by any distance, it is the same fault with other moments."""
    scene = scene_with(lambda r: r)[0]
    (plate,) = scene.plates
    moved = replace(plate, sensor_m=plate.sensor_m + 0.12 * X - 0.2 * Y)
    change = effect.change(replace(scene, plates=(moved,)), target, np.array([0.04]))
    unplaced = replace(scene, plates=(replace(plate, is_placed=False),))
    numbers = effect.parameters(unplaced, target)
    assert len(numbers) == (3 if target.endswith("fz") else 2)
    tangent = effect.tangent(unplaced, target, np.zeros(len(numbers)))
    found, *_ = np.linalg.lstsq(tangent.reshape(-1, len(numbers)), change.ravel(), rcond=None)
    np.testing.assert_allclose(tangent @ found, change, atol=1e-6 * np.abs(change).max())
    assert found[0] == pytest.approx(0.04, rel=0.05)
    assert len(effect.reported(unplaced, target, found)) == 1
    assert effect.possible(unplaced, target, found)
    far = np.full(len(found), numbers[0].typical)  # of a middle one metre aside
    assert not effect.possible(unplaced, target, far)


def test_an_offset_in_fz_makes_everybody_heavier():
    scene = scene_with(lambda r: r)[0]
    change = PlateZero().change(scene, "1 fz", np.array([9.80665]))
    np.testing.assert_allclose(change[:, 2], 9.80665)
    assert "+9.8 N" in PlateZero().words(scene, "1 fz", np.array([9.80665])).what


def test_a_shifted_plate_shows_the_pressure_short_of_the_shift():
    scene = standing_still()
    shift = np.array([0.03, -0.02, 0.0])
    plate = Plate("1", scene.plates[0].corners_m, scene.predicted)
    alone = replace(scene, plates=(plate,))
    shown = scene.predicted + PlateTranslation().change(alone, "1", shift)
    before, after = (centre_of_pressure(w, 0.0, 50.0) for w in (scene.predicted, shown))
    np.testing.assert_allclose(after - before, np.tile(-shift[:2], (len(before), 1)), atol=1e-9)


def test_a_turned_plate_shows_the_wrench_turned_back():
    true, values = moving().predicted, np.array([0.02, -0.03, 0.1])
    back = Rotation.from_rotvec(values).inv()
    moment = true[:, 3:] - np.cross(CENTRE, true[:, :3])
    force = back.apply(true[:, :3])
    shown = np.hstack([force, back.apply(moment) + np.cross(CENTRE, force)])
    scene = replace(moving(), plates=(Plate("1", CORNERS, shown, SENSOR),))
    change = PlateRotation().change(scene, "1", values)
    np.testing.assert_allclose(change, shown - true, atol=1e-8)


def test_an_unloaded_plate_is_no_candidate():
    scene = moving()
    idle = replace(scene.plates[1], wrench=np.zeros_like(scene.predicted))
    alone = replace(scene, plates=(scene.plates[0], idle))
    assert PlateTranslation().targets(alone) == ("1",)
    assert set(PlateGain().targets(alone)) == {"1 fx", "1 fy", "1 fz"}


@pytest.mark.parametrize(
    ("effect", "values"),
    [(PlateTranslation(), [0.02, -0.01, 0.0]), (PlateRotation(), [0.0, 0.0, 0.03])],
    ids=lambda one: getattr(one, "name", None),
)
def test_two_plates_err_together_as_one_plate_under_both_feet(effect, values):
    scene = moving()
    centre = np.mean([plate.centre_m() for plate in scene.plates], axis=0)
    whole = sum(np.nan_to_num(plate.wrench) for plate in scene.plates)
    corners = scene.plates[0].corners_m
    one = Plate("1", corners - corners.mean(axis=0) + centre, whole)
    alone = replace(scene, plates=(one,))
    together = effect.change(scene, "all", np.array(values))
    np.testing.assert_allclose(together, effect.change(alone, "1", np.array(values)), atol=1e-8)
    assert effect.words(scene, "all", np.array(values)).what.startswith("all plates ")
    assert "all" in effect.targets(scene) and "all" not in effect.targets(alone)


@pytest.mark.parametrize(
    ("effect", "channel", "said"),
    [
        (PlateGain(), "fz", "all plates read the vertical force 3.0 % too large"),
        (PlateCrosstalk(), "fz>fx", "of all plates leaks"),
    ],
)
def test_channels_of_all_plates_err_as_those_of_each(effect, channel, said):
    scene, size = moving(), np.array([0.03])
    assert f"all {channel}" in effect.targets(scene)
    each = [effect.change(scene, f"{plate.name} {channel}", size) for plate in scene.plates]
    together = effect.change(scene, f"all {channel}", size)
    np.testing.assert_allclose(together, sum(each), atol=1e-8)
    assert said in effect.words(scene, f"all {channel}", size).what


@pytest.mark.parametrize("tilt", [[0.02, 0.0], [-0.05, 0.1]])
def test_a_tilted_lab_is_a_simulation_with_another_gravity(tilt):
    scene = moving()
    model = pinocchio_model(standing().person)
    turn = Rotation.from_rotvec([*tilt, 0.0])
    model.gravity = pin.Motion(turn.apply(model.gravity.linear), np.zeros(3))
    other = predicted_wrench(model, scene.q, scene.v, scene.a, phi()[:, None], np.zeros(3))[..., 0]
    change = GravityTilt().change(scene, "", np.array(tilt))
    np.testing.assert_allclose(change, other - scene.predicted, atol=1e-7)
    name, unit, angle = GravityTilt().reported(scene, "", np.array(tilt))[0]
    assert (name, unit) == ("angle", "rad") and angle == pytest.approx(np.hypot(*tilt))


@pytest.mark.parametrize("effect", [SyncOffset(), ClockDrift()])
def test_forces_that_come_late(effect):
    """The same person recorded by plates whose clock is another; its motion does not count.

    A clock's rate is wrong by the delay's own delay more, here 0.4 %.
    """
    swing = Swing(pinocchio_model(standing().person), standing().q, 3, 0.4)
    times = np.arange(400) / RATE_HZ
    size = {"sync_offset": 0.015, "clock_drift": 0.004}[effect.name]
    late = np.full(400, size) if effect.name == "sync_offset" else size * times

    def wrench_at(moments):
        return scene_of(*(np.stack([f(t) for t in moments]) for f in (swing.q, swing.v, swing.a)))

    seen = replace(wrench_at(times + 0.3), plates=wrench_at(times - late).plates)
    change = effect.change(seen, "", np.array([size]))
    expected = seen.measured - wrench_at(times).predicted
    tolerance = {"sync_offset": 1e-3, "clock_drift": 5e-3}[effect.name]
    assert rms(change - expected).max() < tolerance * rms(expected).max()
    assert rms(expected).max() > 1.0


@pytest.mark.parametrize("faster", [-0.3, 0.25])
def test_a_file_that_states_another_rate(faster):
    """Positions are right; speeds and accelerations are those of another pace."""
    swing, times = Swing(pinocchio_model(standing().person), standing().q, 3, 0.4), 0.3
    q, v, a = (
        np.stack([f(t) for t in times + np.arange(200) / RATE_HZ])
        for f in (swing.q, swing.v, swing.a)
    )
    true, seen = scene_of(q, v, a), scene_of(q, v / (1 + faster), a / (1 + faster) ** 2)
    change = FrameRate().change(seen, "", np.array([faster]))
    np.testing.assert_allclose(seen.predicted + change, true.predicted, atol=1e-6)
    assert rms(change).max() > 1.0
    assert not FrameRate().possible(seen, "", np.array([0.02 * np.sign(faster)]))
    assert FrameRate().possible(seen, "", np.array([faster]))


def test_what_the_motion_does_wrong_makes_no_delay_smaller():
    """A spline through so few samples would draw half a frame's delay towards none."""
    scene = moving()
    swing = np.sin(2 * np.pi * 20.0 * scene.times_s)[:, None] * np.ones(6)
    plate = Plate("1", CORNERS, swing)
    change = SyncOffset().change(replace(scene, plates=(plate,)), "", np.array([0.005]))
    ahead = np.sin(2 * np.pi * 20.0 * (scene.times_s + 0.005))[:, None] * np.ones(6)
    assert rms(change - (swing - ahead)).max() < 0.02 * rms(swing - ahead).max()


def test_words_for_the_order_of_clocks():
    scene, delay = standing_still(), SyncOffset()
    assert delay.words(scene, "", np.array([0.01])).what.endswith("10.0 ms after the markers")
    assert delay.words(scene, "", np.array([-0.01])).what.endswith("10.0 ms before the markers")
    assert "at 0.833 times" in FrameRate().words(scene, "", np.array([1 / 1.2 - 1])).what
    assert "1000 ppm slower" in ClockDrift().words(scene, "", np.array([1e-3])).what
