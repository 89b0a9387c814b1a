"""Bad input stops the workflow within seconds, with one message and no traceback."""

import time

import pytest

CASES = {
    "missing mesh": ("targets: {a: {mesh: nowhere/a.stl, role: known}}", ["targets.a.mesh", "nowhere/a.stl"]),
    "unknown key": ("radar: {bandwith: 1.0e+9}", ["radar.bandwith", "bandwidth"]),
    "negative bandwidth": ("radar: {bandwidth: -1.5e9}", ["radar.bandwidth"]),
    "section is a number": ("noise: 5", ["'noise': 5 is not of type 'object'"]),
    "SNR as text": ("noise: {snr_db: [0, three]}", ["noise.snr_db", "three"]),
}


@pytest.fixture(scope="module")
def project(project_of):
    return project_of("bad_input")


@pytest.mark.parametrize("case", CASES)
def test_message_names_the_key(project, case):
    overlay, expected = CASES[case]
    project.write("config/mine.yaml", overlay + "\n")
    start = time.monotonic()
    finished = project.run("--cores", 1, "report", "--configfile", "config/mine.yaml")
    assert time.monotonic() - start < 30
    assert finished.returncode != 0
    for text in expected:
        assert text in finished.stdout
    assert "Traceback" not in finished.stdout
    # One message, which begins with the key, after the line that says which profile is in use.
    (message,) = [
        line for line in finished.stdout.splitlines() if not line.startswith("Using workflow specific profile")
    ]
    assert message.startswith("config key '")
    assert not (project.folder / "results").exists()


def test_what_shows_when_a_run_begins_is_one_message_too(project):
    """Solves that no machine has the memory for, and a mesh that is none; neither leaves the folder locked."""
    page = project.write("page.stl", "<!DOCTYPE html>" + 100 * " ")
    large = "radar: {center_frequency: 2.8e+10, bandwidth: 1.0e+10}"
    for overlay, expected in (
        (large, "config key 'targets.drone': resources/cad/drone.stl would need about"),
        (f"targets: {{drone: {{mesh: {page}}}}}", "config key 'targets.drone.mesh': page.stl is no CAD file,"),
    ):
        project.write("config/mine.yaml", f"name: mine\n{overlay}\n")
        finished = project.run("--cores", 1, "report", "--configfile", "config/mine.yaml")
        assert finished.returncode != 0
        assert [line for line in finished.stdout.splitlines() if line.startswith(expected)], finished.stdout
        assert "Error" not in finished.stdout and "Traceback" not in finished.stdout
        assert not list((project.folder / ".snakemake/locks").glob("*"))


def test_numbers_within_mappings_of_the_command_line(project_of):
    """Snakemake gives what stands within them as text."""
    project = project_of("settings")
    settings = ("--config", "name=b", "noise={snr_db: [1, 2.5]}", "learning={experiments: {}}")
    assert project.planned("results/b/imaging/ufo/snr_2.5dB.zarr", *settings)["noise"] == 1


@pytest.mark.parametrize("option", ["--configfile", "--configfiles"])
def test_snakemake_says_it_before_it_reads_the_files_itself(option, project_of):
    """Its own words for the same: a traceback, or that the file is 'not valid JSON or YAML', without a place."""
    project = project_of("slip")
    project.write("config/good.yaml", "name: good\n")
    project.write("config/bad.yaml", "name: bad\nradar: &a {b: *a}\n")
    finished = project.run("--cores", 1, "--dry-run", "report", option, "config/good.yaml", "config/bad.yaml")
    assert finished.returncode == 1
    (line,) = [line for line in finished.stdout.splitlines() if not line.startswith("Using workflow specific profile")]
    assert line.startswith("config/bad.yaml, line 2, column 8: found unconstructable")
