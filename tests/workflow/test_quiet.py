"""With --quiet, also on a terminal, and in logs there is text alone: no colours, no progress bars that move."""

import os
import pty
import re

CONFIG = """
name: quiet
targets: {'*': null, trihedral: {mesh: resources/cad/trihedral.stl, role: other, symmetry: [xz]}}
mesh: {bands: 1}
radar: {center_frequency: 0.5e9, bandwidth: 0, frequencies: 1, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {count: 4}}
"""
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


def on_terminal(project, *arguments):
    """What a terminal shows of a run, its line ends apart."""
    ours, its = pty.openpty()
    process = project.start("--cores", 2, *arguments, stdout=its, stderr=its)
    os.close(its)
    shown = b""
    try:
        while piece := os.read(ours, 65536):
            shown += piece
    except OSError:  # Linux's way to say that nobody writes any more
        pass
    os.close(ours)
    assert process.wait() == 0, shown.decode()
    return shown.decode().replace("\r\n", "\n")


def test_quiet_runs_and_logs_are_text_alone(project_of):
    project = project_of("quiet")
    project.write("config/quiet.yaml", CONFIG)
    solved = "results/quiet/scattering/bands/trihedral-0.zarr"
    quiet = on_terminal(project, solved, "--quiet", "--configfile", "config/quiet.yaml")
    assert "1 frequencies from 0.5" in quiet and not CONTROL.search(quiet)
    logs = [path for path in (project.folder / "results/quiet/logs").rglob("*") if path.is_file()]
    assert len(logs) == 2
    assert not any(CONTROL.search(path.read_text()) for path in logs)
