"""A load is a point on its segment, seen from the joint."""

import numpy as np
import pytest

from bsip_cli.body.person import load_parameters
from tests.body.standing_person import standing


@pytest.mark.parametrize("segment", ["shank_r", "upper_torso"])
def test_parameters_of_a_point_about_the_joint(segment):
    person = standing().person
    i = person.skeleton.index(segment)
    position_m = np.array([0.02, -0.15, 0.03])
    phi = load_parameters([(segment, 1.5, position_m)], person).reshape(-1, 10)
    x, y, z = r = position_m + person.origin_in_joint_m[i]
    moments = [y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y]
    np.testing.assert_allclose(phi[i], 1.5 * np.array([1.0, *r, *moments]), rtol=1e-12)
    assert not np.delete(phi, i, axis=0).any()


def test_origin_of_the_upper_torso_is_not_its_joint():
    """Else the test above would not see the difference."""
    person = standing().person
    assert np.linalg.norm(person.origin_in_joint_m[person.skeleton.index("upper_torso")]) > 0.3


def test_loads_add_up():
    person = standing().person
    one = ("hand_l", 0.5, (0.0, -0.05, 0.0))
    two = ("hand_l", 0.3, (0.02, -0.07, 0.01))
    both = load_parameters([one, two], person)
    np.testing.assert_allclose(
        both, load_parameters([one], person) + load_parameters([two], person)
    )
    assert not load_parameters([], person).any()
