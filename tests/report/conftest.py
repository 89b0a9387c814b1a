"""The report of a made-up run with all stages, drawn once for all tests of it."""

import fake
import pytest

from isarflow.report import layout, section_images, selection


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """The report's folder; the results lie in its parent."""
    return fake.write(tmp_path_factory.mktemp("whole") / "fake", fake.SETTINGS)


@pytest.fixture
def results(whole):
    """The results that the report shows, read anew for each test."""
    return fake.results(whole.parent)


@pytest.fixture
def few_pictures(monkeypatch):
    """Smaller galleries, for tests that look at something else."""
    for name in ("GALLERY_VIEWS", "PLACES"):
        monkeypatch.setattr(section_images, name, 2)
    monkeypatch.setattr(selection, "GALLERY_SNRS", 2)


@pytest.fixture(autouse=True)
def style():
    """Figures are drawn as on the page."""
    with layout.style():
        yield
