"""A cause's change frame by frame, with sizes that the frame did not help to find; and forces put
right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from bsip_cli.diagnosis.cause import (
    Blocks,
    Cause,
    change_by,
    corrected_plates,
    corrected_wrench,
    method_of,
    unseen_change_by,
)
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.loads import AddedMass
from bsip_cli.effects.plates import (
    ClockDrift,
    Delay,
    PlateRotation,
    PlateTranslation,
    PlateZero,
    SyncOffset,
)
from bsip_cli.effects.scene import Scene
from tests.effects.moving_scene import moving


def cause_of(effect: Effect, target: str, *values: float) -> Cause:
    return Cause(effect, target, ("a",), np.array(values), np.array([values] * 5))


OFFSET = cause_of(PlateZero(), "1 fz", 30.0)
LATE = cause_of(SyncOffset(), "", 0.034)
SLOW = cause_of(ClockDrift(), "", 0.004)
BLOCKS = Blocks(first=3, start_s=0.1, block_s=2.0, folds=5)


def largest(wrench: np.ndarray) -> np.ndarray:
    """(6,)."""
    return np.abs(wrench).max(axis=0)


def late(scene: Scene, *causes: Cause) -> np.ndarray:
    """(N, 6) true wrench as it is recorded late."""
    late_s = np.zeros(len(scene.times_s))
    for cause in causes:
        assert isinstance(cause.effect, Delay)
        late_s += cause.effect.late_s(scene, cause.values)
    return CubicSpline(scene.times_s, scene.predicted)(scene.times_s - late_s)


def test_block_and_fold_of_a_time():
    times = np.array([0.0, 0.1, 2.09, 2.11, 4.2, 9.0])
    assert BLOCKS.of(times).tolist() == [3, 3, 3, 4, 5, 7]
    assert BLOCKS.fold_of(times).tolist() == [3, 3, 3, 4, 0, 2]


def test_every_frame_has_the_sizes_of_its_own_fold():
    scene, sizes = moving(), np.array([[10.0], [20.0], [30.0], [40.0], [50.0]])
    fold = BLOCKS.fold_of(scene.times_s)
    change = unseen_change_by([replace(OFFSET, folds=sizes)], scene, fold)
    assert change[:, 2] == pytest.approx(sizes[fold, 0])
    assert change_by([OFFSET], scene)[:, 2] == pytest.approx(30.0)


def test_name_of_the_extended_model():
    assert method_of([LATE]) == "OM+sync_offset"
    assert method_of([LATE, OFFSET]) == "OM+sync_offset+plate_zero"


def test_a_plate_is_put_right_exactly():
    scene = moving()
    measured = scene.predicted + change_by([OFFSET], scene)
    wrench, valid = corrected_wrench(scene, measured, [OFFSET])
    assert wrench == pytest.approx(scene.predicted, abs=1e-9)
    assert valid.all()


@pytest.mark.parametrize("causes", [(LATE,), (SLOW,), (LATE, SLOW), (OFFSET, LATE)])
def test_a_late_clock_is_put_right(causes):
    scene = moving()
    clocks = [cause for cause in causes if cause is not OFFSET]
    measured = late(scene, *clocks)
    if OFFSET in causes:
        measured = measured + change_by([OFFSET], scene)
    wrench, valid = corrected_wrench(scene, measured, causes)
    left, before = (largest((x - scene.predicted)[valid]) for x in (wrench, measured))
    assert (left < 5e-3 * before).all()
    assert 0.95 < valid.mean() < 1  # what was recorded after the end is not there


def test_frames_beside_a_gap_are_not_valid_after_the_shift():
    scene = moving()
    valid = np.ones(len(scene.times_s), dtype=bool)
    valid[300:320] = False
    measured = np.where(valid[:, None], late(scene, LATE), 0.0)
    wrench, kept = corrected_wrench(replace(scene, valid=valid), measured, [LATE])
    moved = round(0.034 * scene.rate_hz)
    assert not kept[300 - moved : 318 - moved].any()
    assert kept[200:290].all()
    left, before = (largest((x - scene.predicted)[210:280]) for x in (wrench, measured))
    assert (left < 5e-3 * before).all()


def test_only_forces_are_put_right():
    """What a person carries is truly on the plate."""
    carried = cause_of(AddedMass(), "hand_r", 1.0, 0.0, 0.0, 0.0)
    assert not carried.effect.of_the_forces
    assert all(cause.effect.of_the_forces for cause in (OFFSET, LATE, SLOW))


def test_plates_that_turned_together_turn_about_the_middle_of_all():
    scene = moving()
    turned = cause_of(PlateRotation(), "all", 0.0, 0.02, 0.1)
    found = corrected_plates(scene, [turned])
    whole, _ = corrected_wrench(scene, scene.measured, [turned])
    assert sum(found.values()) == pytest.approx(whole, abs=1e-9)
    middle = np.mean([plate.centre_m() for plate in scene.plates], axis=0)
    for plate in scene.plates:
        turn = Rotation.from_rotvec([0.0, 0.02, 0.1]).as_matrix().T
        force = plate.wrench[:, :3] @ turn
        moment = (plate.wrench[:, 3:] - np.cross(middle, plate.wrench[:, :3])) @ turn
        assert found[plate.name][:, :3] == pytest.approx(force, abs=1e-9)
        assert found[plate.name][:, 3:] == pytest.approx(moment + np.cross(middle, force), abs=1e-9)


def test_a_plate_is_freed_of_its_own_faults_only():
    scene = moving()
    first, second = scene.plates
    lost = first.wrench.copy()
    lost[5] = np.nan
    scene = replace(scene, plates=(replace(first, wrench=lost), second))
    found = corrected_plates(scene, [OFFSET])
    assert np.isnan(found["1"][5]).all()
    change = np.delete(found["1"] - first.wrench, 5, axis=0)
    assert change[:, 2] == pytest.approx(-30.0, abs=1e-9)
    assert np.array_equal(found[second.name], second.wrench)


# --- several at once ----------------------------------------------------------------------------


def test_delays_are_one_delay_and_the_rest_adds_up():
    scene, early = moving(), cause_of(SyncOffset(), "", -0.034)
    assert not change_by([LATE, early], scene).any()
    added = change_by([LATE], scene) + change_by([early], scene)
    assert np.abs(added[20:-20]).max() > 1.0
    together = change_by([LATE, OFFSET], scene)
    parts = change_by([LATE], scene) + change_by([OFFSET], scene)
    np.testing.assert_allclose(together, parts, atol=1e-9)


def test_what_plates_do_wrong_comes_as_late_as_their_forces():
    scene, shift = moving(), cause_of(PlateTranslation(), "1", 0.02, 0.0, 0.0)
    wrong = change_by([shift], scene)
    at = np.minimum(scene.times_s + LATE.values[0], scene.times_s[-1])
    later = CubicSpline(scene.times_s, wrong)(at)
    together, expected = change_by([LATE, shift], scene), change_by([LATE], scene) + later
    np.testing.assert_allclose(together, expected, atol=1e-9)
    assert np.abs(later - wrong).max() > 0.1
