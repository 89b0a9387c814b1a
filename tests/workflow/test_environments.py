"""What `make` installs, and what it asks of a machine before; the conda environments install what the lock pins."""

import ast
import importlib.util
import re
import shutil
import subprocess
import sys
from importlib.metadata import packages_distributions
from types import SimpleNamespace

import pytest

from isarflow.setup.closure import closure
from isarflow.setup.config import ROOT
from isarflow.setup.yaml_file import read_yaml

STAGES = ("mesh", "scattering", "imaging", "learning", "report")


@pytest.mark.parametrize("stage", STAGES)
def test_conda_pins_stand_in_the_lock(stage):
    lock = (ROOT / "envs/requirements.lock").read_text()
    pins = read_yaml(ROOT / f"envs/{stage}.yaml")["dependencies"][-1]["pip"]
    assert [pin for pin in pins if not re.search(rf"^{re.escape(pin)}[ ;]", lock, re.MULTILINE)] == []


PIN = re.compile(r"([\w-]+)==")
RULE = re.compile(r"^ *(?:use )?rule\b", re.MULTILINE)
# Files that jobs load by names from the config: what stands in a rule that does, and where they are.
BY_NAME = {
    "plan.model_files": "isarflow/learning/models",
    "plan.imager_file": "isarflow/imaging/imagers",
    "plan.focus_file": "isarflow/imaging/focus",
    "plan.solver_file": "isarflow/scattering/solvers",
    "*of_page": "isarflow/report",
}
# Imports that an environment goes without: STEP files and rays are extras; `check` asks a solver for its plan alone.
WITHOUT = {stage: {"OCP", "embreex"} for stage in STAGES} | {"mesh": {"OCP", "embreex", "jax", "numba"}}
# Of what reads targets these stages use units and sizes alone; models of families are united by the mesh stage.
for without in ("scattering", "report"):
    WITHOUT[without] = WITHOUT[without] | {"pymeshlab"}
UNSEEN = {"zarr"}  # xarray imports it where it opens a store


def imported(scripts):
    """The packages, by the names that they are imported by, of files of the repository and all their modules."""
    names = set()
    for file in set().union(*map(closure, scripts)):
        for node in ast.walk(ast.parse((ROOT / file).read_bytes())):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(node.module.partition(".")[0])
    return names - sys.stdlib_module_names - {"isarflow", "study"}


@pytest.mark.parametrize("stage", STAGES)
def test_conda_environment_has_what_its_jobs_import_and_nothing_else(stage):
    files = [*(ROOT / "workflow/rules").glob("*.smk"), *(ROOT / "studies").glob("*/*.smk")]
    text = "\nrule\n".join(path.read_text() for path in files)
    rules = [body for body in RULE.split(text) if f"envs/{stage}.yaml" in body]
    scripts = set(re.findall(r'"([\w/]+\.py)"', "".join(re.findall(r"\bcode\(([^)]*)\)", "".join(rules)))))
    assert len(scripts) >= len(rules) - 1 > 0  # two rules of learning share a script
    folders = [folder for word, folder in BY_NAME.items() if any(word in body for body in rules)]
    scripts = {script if "/" in script else f"workflow/scripts/{script}" for script in scripts}
    scripts |= {path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).glob("*.py")}
    if "STUDY_CODE" in "".join(rules):
        scripts |= {path.relative_to(ROOT) for path in (ROOT / "studies").glob("*/study/*.py")}
    there = packages_distributions()
    needed = {there[name][0].lower() for name in imported(scripts) - WITHOUT[stage]}
    pins = {PIN.match(pin)[1] for pin in read_yaml(ROOT / f"envs/{stage}.yaml")["dependencies"][-1]["pip"]}
    assert (needed - pins, pins - needed - UNSEEN) == (set(), set())


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("requirements.lock", 50),
        ("requirements-step.lock", 1),
        ("requirements-rays.lock", 1),
        ("requirements-browser.lock", 2),
        ("requirements-slurm.lock", 10),
    ],
)
def test_lock_names_no_index_and_hashes_everything(name, least):
    lock = (ROOT / "envs" / name).read_text()
    assert "http" not in lock
    requirements = re.findall(r"^[a-z0-9].*(?:\n .*)*", lock, re.MULTILINE)
    assert len(requirements) > least
    assert all("--hash=sha256:" in requirement for requirement in requirements)


@pytest.mark.parametrize("extra", ["step", "rays", "browser", "slurm"])
def test_extra_lock_changes_no_version(extra):
    locks = [(ROOT / "envs" / lock).read_text() for lock in ("requirements.lock", f"requirements-{extra}.lock")]
    main, extra = (set(re.findall(r"^([a-z0-9-]+)==([^ ]+)", lock, re.MULTILINE)) for lock in locks)
    assert extra - main
    assert {package for package, _ in extra - main}.isdisjoint(package for package, _ in main)


@pytest.fixture
def check():
    spec = importlib.util.spec_from_file_location("check", ROOT / "envs/check.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_machine_that_runs_the_tests_will_do(check, tmp_path):
    assert check.problems(str(tmp_path)) == ([], [])


def _no(*_):
    raise OSError("cannot open shared object file")


@pytest.mark.parametrize(
    ("place", "value", "problem", "package"),
    [
        ("check.ctypes.CDLL", _no, "libGL.so.1 is not there", "libgl1"),
        ("check.importlib.util.find_spec", lambda name: None if name == "ensurepip" else 1, "no venv module", "-venv"),
        ("check.sys.version_info", (3, 10, 4), "needs python 3.11 or later, and this is 3.10", None),
        ("check.shutil.disk_usage", lambda _: SimpleNamespace(free=1e9), "1 GB are free here", None),
    ],
)
def test_what_a_machine_lacks_is_said_before_anything_is_installed(
    check, place, value, problem, package, tmp_path, monkeypatch
):
    module, name = place.removeprefix("check.").rsplit(".", 1)
    there = check
    for part in module.split("."):
        there = getattr(there, part)
    with monkeypatch.context() as patch:  # pytest itself needs what is taken away
        patch.setattr(there, name, value)
        wrong, packages = check.problems(str(tmp_path))
    assert len(wrong) == 1 and problem in wrong[0]
    assert len(packages) == (package is not None) and all(name.endswith(package) for name in packages)


def test_path_with_a_colon_is_refused(check, tmp_path):
    (tmp_path / "a:b").mkdir()
    (wrong,), _ = check.problems(str(tmp_path / "a:b"))
    assert "has a ':' in it" in wrong


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
def test_environment_that_was_moved_is_made_anew(tmp_path):
    folder = tmp_path / "my project"
    (folder / "envs").mkdir(parents=True)
    (folder / ".venv/bin").mkdir(parents=True)
    for path in ("Makefile", "envs/requirements.lock"):
        shutil.copy(ROOT / path, folder / path)

    def steps():
        return subprocess.run(
            ["make", "-n", "environment"], cwd=folder, capture_output=True, text=True, check=True
        ).stdout

    assert "pip install" in steps()
    (folder / ".venv/bin/.installed").write_text(str(folder))
    assert "Nothing to be done" in steps()
    moved = folder.rename(tmp_path / "elsewhere")
    folder = moved
    assert "rm -rf .venv" in steps() and "pip install" in steps()


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
def test_make_says_that_there_is_no_such_python(tmp_path):
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs/requirements.lock").touch()
    finished = subprocess.run(
        ["make", "environment", "PYTHON=python3.99"], cwd=tmp_path, capture_output=True, text=True
    )
    assert finished.returncode != 0 and "There is no python3.99." in finished.stdout
    assert not (tmp_path / ".venv").exists()
