"""Bad input stops the workflow within seconds, with one message and no traceback."""

import time

import pytest

CASES = {
    "missing mesh": ("targets: {a: {mesh: nowhere/a.stl, role: known}}", ["targets.a.mesh", "nowhere/a.stl"]),
    "unknown key": ("radar: {bandwith: 1.0e+9}", ["radar.bandwith", "bandwidth"]),
    "negative bandwidth": ("radar: {bandwidth: -1.5e9}", ["radar.bandwidth"]),
    "section is a number": ("noise: 5", ["'noise': 5 is not a mapping"]),
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
