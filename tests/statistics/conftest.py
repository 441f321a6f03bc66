import warnings

import pytest


@pytest.fixture(autouse=True)
def no_warnings():
    """Degenerate data must be refused in words, never met with a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
