"""What `import isarflow` offers, and that it leaves the process as it was."""

import doctest
import importlib
import subprocess
import sys
import tomllib

import pytest

import isarflow
from isarflow.core.errors import InputError
from isarflow.core.folders import ROOT

EXAMPLES = "core.sweep", "imaging.formation", "mesh.build", "scattering.solve"


def test_every_name_of_the_face_is_there():
    assert all(getattr(isarflow, name) is not None for name in isarflow.__all__)
    assert set(isarflow.__all__) <= set(dir(isarflow))
    assert {"solve", "Sweep", "form_images", "load", "score", "__version__"} <= set(isarflow.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'slove'"):
        isarflow.slove  # noqa: B018


def test_the_version_is_the_project_s():
    assert isarflow.__version__ == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert (ROOT / "isarflow/py.typed").exists()


@pytest.mark.parametrize("module", EXAMPLES)
def test_the_examples_of_docstrings_run(module, monkeypatch):
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(importlib.import_module(f"isarflow.{module}"))
    assert found.attempted and not found.failed


def test_a_wrong_word_is_refused_by_its_name():
    with pytest.raises(InputError, match=r"formulation.*mfie.*efie"):
        isarflow.solve([[0, 0, 0]], [[0, 0, 0]], [1e9], [0], [0], formulation="mfie")


def test_the_package_alone_imports_little():
    """Each of the solver's dependencies is imported where it is used, not with the package."""
    code = "import sys, isarflow; print(sorted({'jax', 'numba', 'pandas', 'h5py', 'xarray'} & set(sys.modules)))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout == "[]\n"
