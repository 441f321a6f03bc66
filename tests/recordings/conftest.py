"""Small recordings written on the fly, and the folder of real ones."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real recordings beside the repository; skips where there is none."""
    path = Path(__file__).parents[2].parent / "shared" / "data"
    if not path.is_dir():
        pytest.skip("the real recordings (shared/data beside the repository) are not here")
    return path
