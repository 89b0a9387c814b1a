"""The report, and the page of the thesis, of made-up runs with all stages, each drawn once for all tests of it."""

import fake
import fake_thesis
import pytest

from isarflow.report import section_images, selection
from isarflow.report.results import Results


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """The report's folder; the results lie in its parent."""
    return fake.write(tmp_path_factory.mktemp("whole") / "fake", fake.SETTINGS)


@pytest.fixture
def results(whole):
    """The results that the report shows, read anew for each test."""
    return Results(whole.parent, fake.SETTINGS, fake.names(fake.SETTINGS))


@pytest.fixture
def few_pictures(monkeypatch):
    """Smaller galleries, for tests that look at something else."""
    for name in ("GALLERY_AZIMUTHS", "GALLERY_ELEVATIONS", "PLACES"):
        monkeypatch.setattr(section_images, name, 2)
    monkeypatch.setattr(selection, "GALLERY_SNRS", 2)


@pytest.fixture(scope="session")
def thesis_page(tmp_path_factory):
    """The folder of the page of the thesis of a run that has all of it; the results lie two levels above."""
    return fake_thesis.write(tmp_path_factory.mktemp("thesis") / "fake", fake_thesis.settings())
