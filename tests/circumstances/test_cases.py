"""The recordings of ../shared/cases: what each right.md asks for."""

import pytest

from tests.circumstances.cases import CASES, CHECKS, complaint

# What is not right yet, and what is complained of. A case that becomes right leaves this table;
# the test says so.
NOT_YET: dict[str, str] = {}


@pytest.mark.long
@pytest.mark.parametrize("name", CHECKS)
def test_case(name):
    if not (CASES / name).is_dir():
        pytest.skip(f"{CASES / name} is missing")
    found = complaint(name)
    if name in NOT_YET:
        assert found, f"{name} is right now: take it out of NOT_YET"
    else:
        assert not found, found


def test_every_case_has_a_check():
    if not CASES.is_dir():
        pytest.skip(f"{CASES} is missing")
    assert {folder.name for folder in CASES.iterdir() if folder.is_dir()} == set(CHECKS)
