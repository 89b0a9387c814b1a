"""The conda environments install what the lock pins."""

import re

import pytest

from common.config import ROOT, read_yaml

STAGES = ("mesh", "scattering", "imaging", "learning", "report")


@pytest.mark.parametrize("stage", STAGES)
def test_conda_pins_stand_in_the_lock(stage):
    lock = (ROOT / "envs/requirements.lock").read_text()
    pins = read_yaml(ROOT / f"envs/{stage}.yaml")["dependencies"][-1]["pip"]
    assert [pin for pin in pins if not re.search(rf"^{re.escape(pin)}[ ;]", lock, re.MULTILINE)] == []


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("requirements.lock", 50),
        ("requirements-step.lock", 1),
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


@pytest.mark.parametrize("name", ["requirements-step.lock", "requirements-browser.lock", "requirements-slurm.lock"])
def test_extra_lock_changes_no_version(name):
    locks = [(ROOT / "envs" / lock).read_text() for lock in ("requirements.lock", name)]
    main, extra = (set(re.findall(r"^([a-z0-9-]+)==([^ ]+)", lock, re.MULTILINE)) for lock in locks)
    assert extra - main
    assert {package for package, _ in extra - main}.isdisjoint(package for package, _ in main)
