"""Small recordings written on the fly, and the folders of those that others made."""

from __future__ import annotations

from pathlib import Path

import pytest


def _beside_the_repository(name: str) -> Path:
    places = [folder / "shared" / name for folder in Path(__file__).parents[3:]]
    found = next((path for path in places if path.is_dir()), None)
    if found is None:
        pytest.skip(f"shared/{name} beside the repository is not here")
    return found


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real recordings beside the repository; skips where there is none."""
    return _beside_the_repository("data")


@pytest.fixture(scope="session")
def shared_cases() -> Path:
    """The folder of small recordings with one circumstance each; skips where there is none."""
    return _beside_the_repository("cases")
