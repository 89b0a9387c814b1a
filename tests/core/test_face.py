"""What `import isarflow` offers, and that it leaves the process as it was."""

import doctest
import importlib
import os
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor

import pytest
import threadpoolctl

import isarflow
from isarflow.core.errors import InputError
from isarflow.core.folders import ROOT
from isarflow.scattering.threads import Pool

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


@pytest.mark.parametrize(
    ("function", "argument", "word", "said"),
    [
        ("solve", "formulation", "mfie", "'mfie' is none of efie, cfie"),
        ("solve", "precision", "half", "'half' is none of single, double"),
        ("solve", "symmetry", ["zx"], "'zx' is none of yz, xz, xy"),
        ("solve", "polarizations", ["RR"], "'RR' is none of VV, VH, HV, HH"),
        ("mesh_file", "symmetry", ["zx"], "'zx' is none of yz, xz, xy"),
        ("mesh_file", "symmetry", "xz", r"is a list of names, as \['yz'\], not the text 'xz'"),
        ("mesh_file", "unit", "km", "'km' is none of m, cm, mm, in"),
    ],
)
def test_a_wrong_word_is_refused_by_its_name_with_what_there_is(function, argument, word, said):
    arguments = {"solve": ([[0, 0, 0]], [[0, 0, 0]], [1e9], [0], [0]), "mesh_file": ("none.stl", 1e9)}[function]
    with pytest.raises(InputError, match=f"'{argument}'.*{said}"):
        getattr(isarflow, function)(*arguments, **{argument: word})


PROCESS = """
from concurrent.futures import ThreadPoolExecutor
import jax, numba, numpy as np, scipy.linalg, threadpoolctl

def state():
    threads = {library["filepath"]: library["num_threads"] for library in threadpoolctl.threadpool_info()}
    return jax.config.jax_enable_x64, numba.config.CACHE_DIR, {path: threads[path] for path in blas}

def bits(settings):
    return solve(*sphere, [0.5e9], [0.0], np.arange(0.0, 180.0, 10.0), threads=2, **settings).field.tobytes()

blas = {library["filepath"] for library in threadpoolctl.threadpool_info()}
before = state()
assert before[1:] == ("", dict.fromkeys(blas, 2)) and not before[0]
import isarflow
from isarflow import *
from isarflow.scattering.solvers import mom, po, sbr
from isarflow.scattering.optics import physical
from isarflow.scattering.sphere import icosphere
assert state() == before, ("import", state())
sphere = icosphere(radius=0.2, edge=0.05)
settings = {}, {"tolerance": 1e-4}, {"precision": "double"}
alone = [bits(each) for each in settings]
assert state() == before, ("solve", state())
with ThreadPoolExecutor(len(settings)) as pool:
    assert list(pool.map(bits, settings)) == alone
assert state() == before, ("threads", state())
"""


def test_imports_and_solves_leave_the_process_as_it_was():
    """JAX's precision, Numba's cache folder and BLAS's threads; and solves at once give the bits of each alone."""
    environment = {key: value for key, value in os.environ.items() if key not in ("NUMBA_CACHE_DIR", "JAX_ENABLE_X64")}
    environment["OPENBLAS_NUM_THREADS"] = "2"
    done = subprocess.run([sys.executable, "-c", PROCESS], capture_output=True, text=True, cwd=ROOT, env=environment)
    assert done.returncode == 0, done.stderr


def test_the_last_user_restores_the_threads_of_blas():
    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        first, second = Pool(1), Pool(1)
        with first:
            second.__enter__()
        assert blas_threads() == {1}  # the first to leave restores nothing
        second.__exit__(None, None, None)
        assert blas_threads() == {2}
        with ThreadPoolExecutor(1) as other:  # threadpoolctl lets one thread alone set OpenBLAS's
            assert other.submit(lambda: Pool(1).__enter__() and blas_threads()).result() == {1}
            Pool(1).__exit__(None, None, None)
        assert blas_threads() == {2}


def blas_threads():
    return {library["num_threads"] for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"}


def test_the_package_alone_imports_little():
    """Each of the solver's dependencies is imported where it is used, not with the package."""
    code = "import sys, isarflow; print(sorted({'jax', 'numba', 'pandas', 'h5py', 'xarray'} & set(sys.modules)))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout == "[]\n"
