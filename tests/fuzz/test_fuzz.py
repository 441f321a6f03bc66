"""Damaged files of every kind: refused or read with a word about it, never a crash.

`benchmarks/fuzz.py` runs the same in thousands.
"""

from __future__ import annotations

import pytest

from tests.fuzz.fuzz_run import run_cases
from tests.fuzz.fuzz_study import TARGETS

N_CASES = {"c3d": 70, "trc": 35, "mot": 25, "participants": 25, "options": 25, "markerset": 20}
_MOST_S = 15.0
_MOST_MB = 600.0


@pytest.mark.long
@pytest.mark.parametrize("target", TARGETS)
def test_damaged_files(tmp_path, target):
    results = run_cases(target, 0, N_CASES[target], tmp_path / "fuzz")
    assert len(results) == N_CASES[target]
    assert [result for result in results if result.is_failure()] == []
    assert {result.state for result in results} >= {"refused", "unchanged"}
    assert max(result.seconds for result in results) < _MOST_S
    assert max(result.peak_MB for result in results) < _MOST_MB
