"""A cause's change frame by frame, with the sizes that the frame did not help to find."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.diagnosis.cause import Blocks, Cause, change_by, method_of, unseen_change_by
from bsip_cli.effects.plates import PlateZero, SyncOffset
from tests.effects.moving_scene import moving

BLOCKS = Blocks(first=3, start_s=0.1, block_s=2.0, folds=5)
FOLDS = np.array([[10.0], [20.0], [30.0], [40.0], [50.0]])
OFFSET = Cause(PlateZero(), "1 fz", ("a",), np.array([25.0]), FOLDS)


def test_block_and_fold_of_a_time():
    times = np.array([0.0, 0.1, 2.09, 2.11, 4.2, 9.0])
    assert BLOCKS.of(times).tolist() == [3, 3, 3, 4, 5, 7]
    assert BLOCKS.fold_of(times).tolist() == [3, 3, 3, 4, 0, 2]


def test_every_frame_has_the_sizes_of_its_own_fold():
    scene = moving()
    fold = BLOCKS.fold_of(scene.times_s)
    change = unseen_change_by([OFFSET], scene, fold)
    assert change[:, 2] == pytest.approx(FOLDS[fold, 0])
    assert change_by([OFFSET], scene)[:, 2] == pytest.approx(25.0)


def test_name_of_the_extended_model():
    delay = Cause(SyncOffset(), "", ("a",), np.array([0.01]), np.full((5, 1), 0.01))
    assert method_of([delay]) == "OM+sync_offset"
    assert method_of([delay, OFFSET]) == "OM+sync_offset+plate_zero"
