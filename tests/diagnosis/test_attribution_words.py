"""How the table's differences from what was identified are told, and how surely."""

from dataclasses import replace

import numpy as np

from bsip_cli.body.inertia import Inertia
from bsip_cli.diagnosis.attribution_words import Bodies, sentence, whose

TABLE = Inertia(11.0, np.array([-0.02, 0.1, 0.0]), 0.1 * np.eye(3))
FOUND = Inertia(10.6, np.array([0.001, 0.1, 0.004]), 0.1 * np.eye(3))
SURE = Bodies("lower_torso", TABLE, FOUND, 0.1, np.full(3, 0.002))
UNSURE = replace(SURE, mass_sd_kg=0.3, com_sd_m=np.full(3, 0.02))


def test_what_is_sure_is_too_much_or_too_far():
    centre = whose("centre_of_mass", SURE)
    assert centre == "lower torso's centre of mass, which the table puts 21 ± 4 mm too far back"
    assert whose("mass", SURE).endswith("of which the table has 0.40 ± 0.20 kg too much")


def test_what_is_not_sure_is_told_from_om_alone():
    centre = whose("centre_of_mass", UNSURE)
    assert centre.endswith("which the table puts 21 ± 39 mm farther back than OM")
    assert whose("mass", UNSURE).endswith("of which the table has 0.40 ± 0.59 kg more than OM")


def test_only_coordinates_that_are_sure_are_told_where_one_is():
    mixed = replace(SURE, found=replace(FOUND, com_m=TABLE.com_m + np.array([0.01, 0.02, 0.0])))
    mixed = replace(mixed, com_sd_m=np.array([0.002, 0.02, 0.002]))
    assert whose("centre_of_mass", mixed).endswith("the table puts 10 ± 4 mm too far back")


def test_sides_are_outward_and_inward():
    right = replace(TABLE, com_m=FOUND.com_m + np.array([0.0, -0.012, 0.02]))
    outward = whose("centre_of_mass", replace(SURE, segment="thigh_r", table=right))
    assert outward.endswith("20 ± 4 mm too far outward and 12 ± 4 mm too low")
    inward = whose("centre_of_mass", replace(SURE, segment="thigh_l", table=right))
    assert "20 ± 4 mm too far inward" in inward


def test_shares_of_the_error():
    said = sentence(0.683, "COP AP", "head's mass")
    assert said == "68 % of the squared error in COP AP comes from the head's mass"
    assert "adds 7 % to" in sentence(-0.07, "COP AP", "head's mass")
