"""A fault that is hidden, diagnosed and corrected is not found again."""

from __future__ import annotations

import pytest

from benchmarks.corrected_recordings import Case, run_case
from tests.real.test_real_studies import DATA

pytestmark = pytest.mark.long


@pytest.mark.parametrize(
    "case",
    [
        Case(5103, "plate_translation", 0.03, "y,plate=2"),
        Case(5104, "sync_offset", 0.015, "-"),
    ],
    ids=Case.words,
)
def test_a_corrected_recording_is_free_of_what_was_corrected(case, tmp_path):
    found = run_case(case, DATA, tmp_path)
    assert found is not None
    assert found.is_corrected(case), found
    assert found.is_free(), found
