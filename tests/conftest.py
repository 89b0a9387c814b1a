"""Running the workflow as a user does, in a copy of the repository."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
# What a user's folder holds; results, environments and tests stay behind.
PARTS = ("Snakefile", "config", "envs", "isarflow", "profiles", "pyproject.toml", "resources", "studies", "workflow")
# The jobs' interpreter is the one that runs the tests.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


# Runs of snakemake, two at a time, each a fork of a process that has loaded it: JSON in, [status, output] of each out.
FORKS = """
import json, os, sys, tempfile
sys.path.insert(0, ".")
import isarflow.setup.overview, isarflow.report.selection, isarflow.scattering.field_files, snakemake.api
from snakemake.cli import main

def begin(arguments, output):
    child = os.fork()
    if child:
        return child
    os.dup2(output.fileno(), 1), os.dup2(output.fileno(), 2)
    status = 99
    try:
        main(arguments)
    except SystemExit as end:
        status = int(end.code or 0)
    finally:
        sys.stdout.flush(), sys.stderr.flush()
        os._exit(status)

requests, statuses = json.load(sys.stdin), {}
outputs = [tempfile.TemporaryFile("w+") for _ in requests]
children = []
for request, output in zip(requests, outputs):
    if len(children) - len(statuses) == 2:
        statuses.update([os.wait()])
    children.append(begin(request, output))
while len(statuses) < len(children):
    statuses.update([os.wait()])
for output in outputs:
    output.seek(0)
print(json.dumps([[statuses[child], output.read()] for child, output in zip(children, outputs)]))
"""


def _counts(status, output):
    assert status == 0, output
    counts = dict(re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE))
    return {rule: int(count) for rule, count in counts.items() if rule not in ("all", "total")}


class Project:
    """A copy of the repository in a folder of its own."""

    def __init__(self, folder):
        self.folder = Path(folder)
        for part in PARTS:
            source = ROOT / part
            if source.is_symlink():
                (self.folder / part).symlink_to(source.readlink())
            elif source.is_dir():
                shutil.copytree(source, self.folder / part, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, self.folder / part)

    def start(self, *arguments, python=sys.executable, **options):
        """snakemake with these arguments as a running process, its output in one text stream."""
        command = [python, "-m", "snakemake", *map(str, arguments)]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "cwd": self.folder}
        return subprocess.Popen(command, env=ENVIRONMENT, **(streams | options))

    def run(self, *arguments, timeout=900, **options):
        """The same to its end: the finished process, its output in `stdout`."""
        process = self.start(*arguments, **options)
        output, _ = process.communicate(timeout=timeout)
        return subprocess.CompletedProcess(process.args, process.returncode, output)

    def planned(self, *arguments):
        """{rule: number of jobs} that a dry-run announces, the target rule `all` left out."""
        finished = self.run("--dry-run", *arguments)
        return _counts(finished.returncode, finished.stdout)

    def all_planned(self, *requests):
        """`planned` of each request, a list of arguments: faster, as Snakemake is loaded but once."""
        answer = subprocess.run(
            [sys.executable, "-c", FORKS],
            input=json.dumps([["--dry-run", *map(str, request)] for request in requests]),
            cwd=self.folder,
            env=ENVIRONMENT,
            capture_output=True,
            text=True,
            timeout=900,
        )
        assert answer.returncode == 0, answer.stderr
        return [_counts(*finished) for finished in json.loads(answer.stdout)]

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


def pytest_collection_modifyitems(items):
    """Whole runs, which are long, first: so that cores that share the tests end at about the same time."""
    items.sort(key=lambda item: item.path.parent.name != "workflow")
