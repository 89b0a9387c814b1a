"""Running the workflow as a user does, in a copy of the repository."""

import functools
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import threadpoolctl

ROOT = Path(__file__).resolve().parents[1]
# What a user's folder holds; results, environments and tests stay behind.
PARTS = ("Snakefile", "config", "envs", "isarflow", "profiles", "pyproject.toml", "resources", "studies", "workflow")
# The jobs' interpreter is the one that runs the tests.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


# Forks for each run of snakemake, two at a time, as what Snakemake and the repository import takes two seconds to load;
# of the repository's own code it has loaded none. A line of JSON in: [folder, [a run's arguments, ...]]; one out:
# [[status, output], ...].
SERVER = """
import json, os, signal, sys, tempfile
import igl, jsonschema, nbformat, requests, scipy.constants, scipy.spatial, smart_open, xarray, zarr
import snakemake.api, snakemake.profiles, snakemake.report
from snakemake.cli import main

def wait():
    child, status = os.wait()
    statuses[child] = os.waitstatus_to_exitcode(status)

for line in sys.stdin:
    folder, runs = json.loads(line)
    outputs, children, statuses = [tempfile.TemporaryFile("w+") for _ in runs], [], {}
    for arguments, output in zip(runs, outputs):
        if len(children) - len(statuses) == 2:
            wait()
        children.append(os.fork())
        if not children[-1]:
            for file, own in ((open(os.devnull), 0), (output, 1), (output, 2)):
                os.dup2(file.fileno(), own)
            os.chdir(folder)
            signal.alarm(900)
            sys.argv = ["snakemake", *arguments]
            sys.exit(main(arguments))
    while len(statuses) < len(children):
        wait()
    for output in outputs:
        output.seek(0)
    print(json.dumps([[statuses[child], output.read()] for child, output in zip(children, outputs)]), flush=True)
"""


@functools.cache
def _server():
    command = [sys.executable, "-c", SERVER]
    return subprocess.Popen(command, env=ENVIRONMENT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _counts(status, output):
    assert status == 0, output
    counts = dict(re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE))
    return {rule: int(count) for rule, count in counts.items() if rule not in ("all", "total")}


class Project:
    """A copy of the repository, or of another copy, in a folder of its own."""

    def __init__(self, folder, of=ROOT):
        self.folder = Path(folder)
        for part in PARTS:
            source = of / part
            if source.is_dir():
                unless = shutil.ignore_patterns("__pycache__") if of == ROOT else None
                shutil.copytree(source, self.folder / part, ignore=unless)
            else:
                shutil.copy2(source, self.folder / part)

    def start(self, *arguments, python=sys.executable, **options):
        """snakemake with these arguments as a running process, its output in one text stream."""
        command = [python, "-m", "snakemake", *map(str, arguments)]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "cwd": self.folder}
        return subprocess.Popen(command, env=ENVIRONMENT, **(streams | options))

    def run(self, *arguments, **options):
        """The same to its end: the finished process, its output in `stdout`."""
        if options:
            process = self.start(*arguments, **options)
            output, _ = process.communicate(timeout=900)
            return subprocess.CompletedProcess(process.args, process.returncode, output)
        ((status, output),) = self._forked([arguments])
        return subprocess.CompletedProcess(arguments, status, output)

    def planned(self, *arguments):
        """{rule: number of jobs} that a dry-run announces, the target rule `all` left out."""
        (counts,) = self.all_planned(arguments)
        return counts

    def all_planned(self, *requests):
        """`planned` of each request, a list of arguments."""
        return [_counts(*finished) for finished in self._forked([["--dry-run", *request] for request in requests])]

    def _forked(self, runs):
        """[status, output] of each run, a list of arguments."""
        server = _server()
        print(json.dumps([str(self.folder), [[*map(str, run)] for run in runs]]), file=server.stdin, flush=True)
        return json.loads(server.stdout.readline())

    def write(self, path, text):
        (self.folder / path).parent.mkdir(exist_ok=True)
        (self.folder / path).write_text(text)
        return path

    def edit(self, path, old, new):
        """Replace one piece of text in a file; fails if it is not there exactly once."""
        text = (self.folder / path).read_text()
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {path}"
        (self.folder / path).write_text(text.replace(old, new))


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """One thread for each product of matrices, as in a job: those of two processes wait for each other's cores."""
    with threadpoolctl.threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def project_of(tmp_path_factory):
    """Makes copies of the repository: project_of(name).

    What Python, Snakemake's first start and Numba compile and keep of the code is made once for all copies.
    """
    from numba.core.caching import _CacheLocator

    from isarflow.core import compiled

    def kept_kernels(of):  # in a folder that is named after the path of their code
        return _CacheLocator.get_suitable_cache_subpath(str(of / "isarflow/scattering/mom/tiles.py"))

    def made(name, of):
        project = Project(tmp_path_factory.mktemp(name), of)
        (kernels / kept_kernels(project.folder)).symlink_to(of_all)
        return project

    kernels = tmp_path_factory.mktemp("kernels")
    ENVIRONMENT["NUMBA_CACHE_DIR"] = str(kernels)
    of_all = Path(compiled.folder()) / kept_kernels(ROOT)
    of_all.mkdir(exist_ok=True)
    first = made("first", ROOT)
    first.planned("report")
    yield lambda name: made(name, first.folder)
    _server().stdin.close()
    _server().wait()


def pytest_collection_modifyitems(items):
    """Whole runs, which are long, first: so that cores that share the tests end at about the same time."""
    items.sort(key=lambda item: item.path.parent.name != "workflow")
