"""The person that stands in tests/body serves here too."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "body"))


@pytest.fixture(scope="session")
def identified():
    from exported_person import identified_person

    return identified_person()
