"""One report of a made-up run with all stages, drawn once for all tests that look at it."""

import fake
import pytest


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """The report's folder; the results lie in its parent."""
    return fake.write(tmp_path_factory.mktemp("whole") / "fake", fake.SETTINGS)
