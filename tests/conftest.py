"""Where time is limited, long tests that may not end by then are skipped, and say so."""

from __future__ import annotations

import os
import time

import pytest

END = "BSIP_TESTS_END"
MINUTES = 12.0  # of a long test on a slow machine, its fixtures included, unless its mark says more
_begun: set[str] = set()  # files whose mark says how long they take as a whole


@pytest.hookimpl(tryfirst=True)  # before any fixture
def pytest_runtest_setup(item: pytest.Item) -> None:
    """END : seconds since 1970, as `.ci/run` sets it; without it nothing is skipped."""
    end, mark = float(os.environ.get(END, "inf")), item.get_closest_marker("long")
    if mark is None or str(item.path) in _begun:
        return
    if time.time() + 60.0 * mark.kwargs.get("minutes", MINUTES) > end:
        pytest.skip(f"it might not end in time ({END}); `make test-long` has no limit")
    if "minutes" in mark.kwargs:
        _begun.add(str(item.path))
