"""What a job writes to its log."""

import io

import pytest
from tqdm import tqdm

from common import job
from scattering.store import _Progress


class Terminal(io.StringIO):
    def __init__(self, tty):
        super().__init__()
        self.isatty = lambda: tty


@pytest.mark.parametrize(("tty", "quiet"), [(True, False), (True, True), (False, False)])
def test_progress_bar_becomes_lines_in_the_log(tty, quiet, monkeypatch):
    monkeypatch.setattr(job, "SECONDS", 0)
    if quiet:
        monkeypatch.setenv("ISARFLOW_QUIET", "yes")
    terminal, log = Terminal(tty), io.StringIO()
    stream = job._Tee(terminal, log)
    print("begun", file=stream)
    with tqdm(total=4, bar_format="{desc}: {percentage:.0f} %", file=stream, mininterval=0) as bar:
        progress = _Progress(bar, [1e9, 2e9, 3e9, 4e9])
        progress(1, "factorization", 0.5)
        progress(3, "done", 1.0)
    lines = log.getvalue().strip().splitlines()
    assert lines[0] == "begun"
    assert "2.0000 GHz (2 of 4), factorization 50 %: 40 %" in lines
    assert lines[-1] == "4.0000 GHz (4 of 4), done: 100 %"
    assert not any("\r" in line for line in lines)
    assert ("\r" in terminal.getvalue()) == (tty and not quiet)


def test_log_is_not_flooded(monkeypatch):
    monkeypatch.setattr(job, "SECONDS", 1000)
    log = io.StringIO()
    for _ in tqdm(range(100), file=job._Tee(Terminal(False), log), mininterval=0):
        pass
    assert log.getvalue().count("%") <= 1
