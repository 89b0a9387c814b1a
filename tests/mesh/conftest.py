"""Shapes of a wavelength stand for larger ones here: they are meshed by the wavelength alone, and not by their size."""

import pytest


@pytest.fixture(autouse=True)
def by_the_wavelength(request, monkeypatch):
    if request.module.__name__ not in ("test_resolution", "test_makers"):
        monkeypatch.setattr("isarflow.mesh.resolution.ACROSS", 2)
