"""Where time is limited, long tests that have not begun by then are skipped, and say so."""

from __future__ import annotations

import os
import time

import pytest

UNTIL = "BSIP_TESTS_UNTIL"


@pytest.hookimpl(tryfirst=True)  # before any fixture
def pytest_runtest_setup(item: pytest.Item) -> None:
    """UNTIL : seconds since 1970, as `.ci/run` sets it; without it nothing is skipped."""
    until = float(os.environ.get(UNTIL, "inf"))
    if item.get_closest_marker("long") and time.time() > until:
        pytest.skip(f"no time was left when its turn came ({UNTIL}); `make test-long` has no limit")
