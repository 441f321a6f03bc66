"""What quiet standing says of the stated mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from moving_scene import MASS_KG, standing_still

from bsip_cli.diagnosis.scale_mass import weight_share
from bsip_cli.diagnosis.stated_mass import (
    CLASS,
    loaded_channel,
    stated_mass_findings,
)


@pytest.mark.parametrize("share", [0.06, -0.04])
def test_plates_that_read_otherwise_make_a_class(share):
    scene = standing_still()
    scene = replace(scene, wrench=(1 + share) * scene.predicted)
    found = stated_mass_findings(weight_share(scene), scene.mass_kg, "all fz", "standing")
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
    assert stated_mass_findings(share, scene.mass_kg, "all fz", "standing") == ()


def test_the_channel_is_that_of_the_plates_stood_upon():
    scene = standing_still()
    assert loaded_channel(scene) == "all fz"
    first, second = scene.plates
    alone = replace(second, wrench=0 * second.wrench)
    assert loaded_channel(replace(scene, plates=(first, alone))) == "1 fz"
