"""Kinds that installed packages offer as entry points."""

import importlib.metadata

import pytest

from isarflow.core import kinds
from isarflow.core.errors import InputError
from isarflow.core.kinds import IMAGERS, MODELS, SOLVERS
from isarflow.imaging.formation import Formation
from isarflow.learning.classifier import Classifier
from isarflow.scattering import solver

GUEST = """
from isarflow.imaging.formation import Formation
from isarflow.learning.classifier import Classifier
from isarflow.scattering.solver import FieldSolver


class Solver(FieldSolver):
    SETTINGS = {"points": {"type": "integer", "description": "of a triangle"}}

    def plan(self, measures, planes, sweep):
        return 1.0, 2.0 * self.settings["points"]

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress):
        raise NotImplementedError


class Imager(Formation):
    def axes(self): ...


class Model(Classifier):
    def fit(self, images, labels, validation=None, snrs=None, views=None): ...
    def evaluate(self, images): ...
"""
ENTRY_POINTS = """[isarflow.solvers]
guest_solver = guests.kinds
[isarflow.imagers]
guest_imager = guests.kinds
[isarflow.models]
guest_model = guests.kinds
[other.solvers]
stranger = guests.kinds
"""


@pytest.fixture
def looked_up(tmp_path, monkeypatch):
    """A package `guests`, installed in a folder of its own; a list that grows with each look at what is installed."""
    package, made = tmp_path / "guests", tmp_path / "guests-1.0.dist-info"
    for folder, files in (
        (package, {"__init__.py": "", "kinds.py": GUEST}),
        (made, {"METADATA": "Metadata-Version: 2.1\nName: guests\nVersion: 1.0\n", "entry_points.txt": ENTRY_POINTS}),
    ):
        folder.mkdir()
        for name, text in files.items():
            (folder / name).write_text(text)
    calls, entry_points = [], importlib.metadata.entry_points
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda **group: calls.append(1) or entry_points(**group))
    monkeypatch.syspath_prepend(tmp_path)
    caches = kinds._installed, kinds.kind
    for cache in caches:
        cache.cache_clear()
    yield calls
    for cache in caches:
        cache.cache_clear()


def test_an_installed_package_offers_kinds_by_name(looked_up, tmp_path):
    names = {seam: set(kinds.available(seam)) for seam in (SOLVERS, IMAGERS, MODELS)}
    assert {"guest_solver", "mom"} <= names[SOLVERS] and {"guest_imager", "fourier"} <= names[IMAGERS]
    assert {"guest_model", "likelihood"} <= names[MODELS] and not any("stranger" in found for found in names.values())
    assert kinds.file_of(SOLVERS, "guest_solver") == str(tmp_path / "guests/kinds.py")
    schema = kinds.settings_of("scattering", {"solver": "guest_solver"})
    assert schema == {"points": {"type": "integer", "description": "of a triangle"}}
    assert solver.build_solver({"solver": "guest_solver", "points": 3}).plan({}, 0, None) == (1.0, 6.0)
    assert issubclass(kinds.load_class(MODELS, "guest_model", Classifier), Classifier)
    assert issubclass(kinds.load_class(IMAGERS, "guest_imager", Formation), Formation)
    assert len(looked_up) == 1  # at installed packages, for all three


def test_an_entry_point_is_checked_like_a_file(looked_up):
    kinds.check_kind(MODELS, "guest_model", "key")
    with pytest.raises(
        InputError, match=r"'imaging.imager'.*guest_imager.py has no class Imager with methods axes and at"
    ):
        kinds.check_kind(IMAGERS, "guest_imager", "config key 'imaging.imager'")
    with pytest.raises(InputError, match=r"there is no solver 'guest_solver_2'; did you mean 'guest_solver'.*mom"):
        kinds.check_kind(SOLVERS, "guest_solver_2", "key")
