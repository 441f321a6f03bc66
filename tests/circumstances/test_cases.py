"""The recordings of ../shared/cases: what each right.md asks for."""

import pytest

from tests.circumstances.cases import CASES, CHECKS, run

# What is not right yet, and what is complained of. A case that becomes right leaves this table;
# the test says so.
NOT_YET = {
    "01-mot-cop-beside-plate-moments": "centre of pressure off by 19 mm, no word",
    "02a-adapter-mm-Nmm-cop": "free torque off by 357 N m",
    "03-mot-nan-cop-when-unloaded": "steps: 23 % of the frames valid, 58 % in the reference",
    "05a-type2-Nm-blank-units": "centre of pressure off by 0.19 m",
    "07-combined-virtual-plate": "all frames left out, no word of the sum",
    "09-cortex-unnamed-trajectories": "refused",
    "10a-trc-time-2-decimals-120Hz": "100 Hz",
    "10g-trc-time-in-ms-long": "0.05 Hz",
    "10h-trc-time-3-decimals-240Hz": "250 Hz",
    "12-missing-as-minus-16512": "points off by up to 30 m",
    "13-left-handed-export": "mirrored, no word",
    "14b-trc-inches": "lengths times 0.39, no word",
    "15g-mass-lb": "told as a contact that the plates miss",
    "15i-sex-female": "refused",
    "15l-trailing-empty-lines": "exit code 3",
    "19d-mot-forces-only-person-at-lab-origin": "no word of the missing points",
    "23-all-residuals-minus-one": "told as labels that do not fit",
    "25-origin-is-place-in-lab": "plates left out, ORIGIN not named",
    "26b-corners-turned-180": "centre of pressure off by 0.2 m",
    "27-underscore-prefix": "refused",
}


@pytest.mark.long
@pytest.mark.parametrize("name", CHECKS)
def test_case(name):
    if not (CASES / name).is_dir():
        pytest.skip(f"{CASES / name} is missing")
    complaint = CHECKS[name](run(name))
    if name in NOT_YET:
        assert complaint, f"{name} is right now: take it out of NOT_YET"
    else:
        assert not complaint, complaint


def test_every_case_has_a_check():
    if not CASES.is_dir():
        pytest.skip(f"{CASES} is missing")
    assert {folder.name for folder in CASES.iterdir() if folder.is_dir()} == set(CHECKS)
