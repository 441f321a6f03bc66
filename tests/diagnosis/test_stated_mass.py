"""What quiet standing says of the stated mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.support import (
    CLASS,
    agreed_share,
    loaded_plate,
    stated_mass_findings,
    weight_share,
)
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import noisy, part_of_moving, with_effect
from tests.effects.moving_scene import MASS_KG, standing_still

MASS_SD = 0.008


@pytest.mark.parametrize("share", [0.06, -0.04])
def test_plates_that_read_otherwise_make_a_class(share):
    scene = standing_still()
    scene = replace(scene, wrench=(1 + share) * scene.predicted)
    found = stated_mass_findings(
        weight_share(scene), scene.mass_kg, MASS_SD, None, ("standing",), "in quiet stance"
    )
    sizes = {one.effect: one.numbers[0].value for one in found}
    assert abs(sizes["plate_gain"] - share) < 1e-9
    assert abs(sizes["plate_zero"] - share * MASS_KG * 9.81) < 0.05
    if share > 0:
        assert abs(sizes["added_mass"] - share * MASS_KG) < 1e-6
    else:
        assert "added_mass" not in sizes  # nobody wears a negative mass
    assert all((one.verdict, one.class_id) == ("ambiguous", CLASS) for one in found)
    assert all(one.p_value < 1e-5 and np.isnan(one.gain[0]) for one in found)
    assert all("the stated mass is wrong" in one.sentence for one in found)


def test_plates_that_agree_say_nothing():
    scene = standing_still()
    scene = replace(scene, wrench=1.01 * scene.predicted)
    share = weight_share(scene)
    said = (None, ("standing",), "in quiet stance")
    assert stated_mass_findings(share, scene.mass_kg, MASS_SD, *said) == ()


def test_only_one_plate_carries_the_person_or_none_does_alone():
    scene = standing_still()
    assert loaded_plate([scene]) is None
    first, second = scene.plates
    alone = replace(second, wrench=0 * second.wrench)
    on_one = replace(scene, plates=(first, alone))
    assert loaded_plate([on_one, on_one]) == "1"
    assert loaded_plate([on_one, scene]) is None


def on_one_plate(gain: float, first_s: float) -> Scene:
    """A moving trial on the first of two plates, whose vertical channel is off."""
    scene = part_of_moving(first_s, 4.0)
    first, second = scene.plates
    plates = (
        replace(first, wrench=scene.predicted),
        replace(second, wrench=0 * scene.predicted),
    )
    alone = replace(scene, plates=plates)
    return noisy(with_effect(alone, EFFECTS["plate_gain"], "1 fz", gain), round(first_s))


def test_moving_trials_that_agree_tell_what_the_plates_read():
    scenes = [on_one_plate(0.05, 0), on_one_plate(0.05, 4)]
    assert agreed_share(scenes, MASS_SD) == pytest.approx(0.05 / 1.05, abs=0.003)


@pytest.mark.parametrize("gains", [(0.05, -0.05), (0.01, 0.01)])
def test_moving_trials_that_disagree_or_are_near_say_nothing(gains):
    assert agreed_share([on_one_plate(gains[0], 0), on_one_plate(gains[1], 4)], MASS_SD) is None


def test_a_scale_that_errs_more_says_less():
    scene = standing_still()
    share = weight_share(replace(scene, wrench=1.03 * scene.predicted))
    said = (None, ("standing",), "in quiet stance")
    good = stated_mass_findings(share, scene.mass_kg, MASS_SD, *said)
    assert stated_mass_findings(share, scene.mass_kg, 2 * MASS_SD, *said) == ()
    assert good[0].numbers[0].high < share * MASS_KG + 2 * MASS_SD * MASS_KG
    scenes = [on_one_plate(0.03, 0), on_one_plate(0.03, 4)]
    assert agreed_share(scenes, MASS_SD) == pytest.approx(0.03 / 1.03, abs=0.003)
    assert agreed_share(scenes, 2 * MASS_SD) is None
