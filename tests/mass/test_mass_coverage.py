"""Simulated trials of every kind: what is told is true, what nothing shows is not told."""

from __future__ import annotations

import pytest

from benchmarks.mass_coverage import KINDS, answer

pytestmark = pytest.mark.long


@pytest.mark.parametrize("kind", KINDS)
def test_measured_masses_are_true(kind):
    found = answer(kind, 4)
    assert not found.told.is_known or found.is_covered
    if kind in ("static", "squats", "steps", "walking, two plates", "jumps"):
        assert found.told.half_width_percent < 3
    if kind == "one foot beside":
        assert not found.told.is_known
