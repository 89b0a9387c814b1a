"""Running the workflow as a user does, in a copy of the repository."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
# What a user's folder holds; results, environments and tests stay behind.
PARTS = ("Snakefile", "config", "envs", "profiles", "pyproject.toml", "resources", "workflow")
# The jobs' interpreter is the one that runs the tests.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


class Project:
    """A copy of the repository in a folder of its own."""

    def __init__(self, folder):
        self.folder = Path(folder)
        for part in PARTS:
            source = ROOT / part
            if source.is_dir():
                shutil.copytree(source, self.folder / part, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, self.folder / part)

    def start(self, *arguments, **options):
        """snakemake with these arguments as a running process, its output in one text stream."""
        command = [sys.executable, "-m", "snakemake", *map(str, arguments)]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        return subprocess.Popen(command, cwd=self.folder, env=ENVIRONMENT, **(streams | options))

    def run(self, *arguments, timeout=900):
        """The same to its end: the finished process, its output in `stdout`."""
        process = self.start(*arguments)
        output, _ = process.communicate(timeout=timeout)
        return subprocess.CompletedProcess(process.args, process.returncode, output)

    def planned(self, *arguments):
        """{rule: number of jobs} that a dry-run announces, the target rule `all` left out."""
        finished = self.run("--dry-run", *arguments)
        assert finished.returncode == 0, finished.stdout
        counts = dict(re.findall(r"^(\w+) +(\d+)$", finished.stdout, re.MULTILINE))
        return {rule: int(count) for rule, count in counts.items() if rule not in ("all", "total")}

    def write(self, path, text):
        (self.folder / path).write_text(text)
        return path

    def edit(self, path, old, new):
        """Replace one piece of text in a file; fails if it is not there exactly once."""
        text = (self.folder / path).read_text()
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {path}"
        (self.folder / path).write_text(text.replace(old, new))


@pytest.fixture(scope="session")
def project_of(tmp_path_factory):
    """Makes copies of the repository: project_of(name)."""
    return lambda name: Project(tmp_path_factory.mktemp(name))
