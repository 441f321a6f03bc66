import pytest

from tests.exports.exported_person import identified_person


@pytest.fixture(scope="session")
def identified():
    return identified_person()
