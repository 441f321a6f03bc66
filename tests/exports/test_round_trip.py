"""A fault that is hidden, diagnosed and corrected is not found again."""

from __future__ import annotations

import pytest

from benchmarks.corrected_recordings import OPENCAP, Case, run_case
from tests.real.test_real_studies import DATA

pytestmark = pytest.mark.long


@pytest.mark.parametrize(
    "case",
    [
        Case(5103, "plate_translation", 0.03, "y,plate=2"),
        pytest.param(Case(OPENCAP, "sync_offset", 0.015, "-"), marks=pytest.mark.real),
    ],
    ids=Case.words,
)
def test_a_corrected_recording_is_free_of_what_was_corrected(case, tmp_path):
    found = run_case(case, DATA, tmp_path)
    if found is None:
        pytest.skip("the real recordings (../shared/data) are missing")
    assert found.is_corrected(case), found
    assert found.is_free(), found
