"""One true run of config/smoke.yaml for all tests that look at it."""

import pytest

SMOKE = ("--configfile", "config/smoke.yaml")


@pytest.fixture(scope="session")
def smoke(project_of):
    """A project in which the report of config/smoke.yaml was made, from CAD on; tests leave it as it was."""
    project = project_of("smoke")
    finished = project.run("--cores", 2, "report", *SMOKE)
    assert finished.returncode == 0, finished.stdout
    return project
