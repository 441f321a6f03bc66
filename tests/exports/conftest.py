import pytest

from tests.exports.exported_person import identified_person


@pytest.fixture(scope="session", params=["15 segments", "17 segments"])
def identified(request):
    return identified_person(girdle=request.param == "17 segments")
