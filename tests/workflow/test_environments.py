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


def test_lock_names_no_index_and_hashes_everything():
    lock = (ROOT / "envs/requirements.lock").read_text()
    assert "http" not in lock
    requirements = re.findall(r"^[a-z0-9].*(?:\n .*)*", lock, re.MULTILINE)
    assert len(requirements) > 50
    assert all("--hash=sha256:" in requirement for requirement in requirements)
