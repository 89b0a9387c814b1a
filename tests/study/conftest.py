"""The page of the thesis of a made-up run that has all of it, drawn once for all tests."""

import fake_thesis
import pytest
from thesis_pages import ThesisPage


@pytest.fixture(scope="session")
def thesis(tmp_path_factory):
    run = tmp_path_factory.mktemp("thesis") / "fake"
    fake_thesis.make(run, fake_thesis.settings())
    return ThesisPage(run, fake_thesis.settings(), run / "report" / "thesis")
