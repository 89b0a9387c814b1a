# What all rules share: the checked config, names of artefacts, and functions of wildcards.

import contextlib
import hashlib
import os
import re
import sys
import time
from math import ceil
from pathlib import Path

from snakemake.logging import logger
from snakemake.settings.enums import Quietness

sys.path.insert(0, workflow.basedir)  # where the package isarflow is
# Snakemake writes its interpreter's path into shell commands as it stands: spaces in it are escaped here.
if "\\" not in sys.executable:
    sys.executable = re.sub(r"([^\w@%+=:,./-])", r"\\\1", sys.executable)
# Jobs are processes of their own, here and on a cluster: each parses this file and inherits the path.
os.environ.update(PYTHONPATH=workflow.basedir)
# On Linux a job keeps memory that it has freed, in large pages: a step of training takes and gives back gigabytes, and
# 15 to 30 % of its time went into pages that the system had to clear each time.
KEEP_HEAP = "arena_max=1", "hugetlb=1", "mmap_threshold=17179869184", "trim_threshold=17179869184"
os.environ.setdefault("GLIBC_TUNABLES", ":".join(f"glibc.malloc.{setting}" for setting in KEEP_HEAP))
if {Quietness.PROGRESS, Quietness.ALL} & set(workflow.output_settings.quiet or ()):
    os.environ.update(ISARFLOW_QUIET="yes")  # jobs draw no progress bars

from isarflow.core.errors import InputError
from isarflow.core.kinds import page_names
from isarflow.core.sweep import images_are_made, snr_label, why_no_images
from isarflow.imaging.geometry import PURE_NOISE
from isarflow.learning import experiments
from isarflow.mesh.read.target import meshed
from isarflow.mesh.read.target import cad_of, files_of
from isarflow.report import selection
from isarflow.scattering import needs
from isarflow.scattering.fields import field_files
from isarflow.setup import contents, disk, lock, snr_sets
from isarflow.setup.artefacts import STARTING, Plan
from isarflow.setup.closure import digest
from isarflow.setup.config import load_config, of_command_line, section, unfocused, unnamed
from isarflow.setup.overview import overview
from isarflow.setup.yaml_file import read_yaml


def or_exit(function, *arguments):
    """Return what the function gives. An InputError ends the run with its message, not with one of Snakemake's around it."""
    try:
        return function(*arguments)
    except InputError as error:
        sys.exit(str(error))


# One after the other, as null in one of them removes what those before it name; Snakemake's own merge knows no null.
OVERLAYS = [or_exit(read_yaml, path) for path in workflow.configfiles]
OVERLAYS.append(of_command_line(workflow.config_settings.config))
config = or_exit(load_config, *OVERLAYS)
plan = Plan(config)
RESULTS, FIELDS = plan.results, plan.fields
if workflow.is_main_process:  # a job runs under the lock of the run that sent it
    or_exit(disk.check_writable, ".", RESULTS, FIELDS)
    for line in lock.release_stale():
        logger.warning(line)

SHORT = 180  # s by plan on two cores: a solve that takes no longer is a short one
# Those of which a target's images, and a model's predictions, are one job.
SNR_SETS = snr_sets.sets(RESULTS, plan.snrs, workflow.is_main_process)


def in_repository(*parts):
    """The path of a file of the repository, from the folder that Snakemake runs in."""
    return os.path.relpath(os.path.join(workflow.basedir, *parts))


def code(*files):
    """A hash of the code that a job's results come from: of these files and every module that they import.

    files: names of scripts in workflow/scripts, and paths from the repository. As a param it reruns the job when what the
    code does changes; an edited comment or docstring changes nothing.
    """
    return or_exit(digest, *(file if os.path.dirname(file) else f"workflow/scripts/{file}" for file in files))


def of_page(*names):
    """The files of the page of these names, patterns with a `*`."""
    folder = Path(workflow.basedir, "isarflow/report")
    return sorted(f"isarflow/report/{path.name}" for name in names for path in folder.glob(name))


def in_report(path, category, *patterns, **labels):
    """An artefact that Snakemake's own report shows."""
    return report(path, category=category, labels=labels, patterns=list(patterns))


def say_what_is_expected(refuse):
    """Say before anything runs what the config makes (see `overview`)."""
    lines = unnamed(config, *OVERLAYS) + or_exit(overview, config, RESULTS, refuse, len(plan.seeded))
    logger.info("\n".join(lines))


def numbered(number, mark):
    """What the names of a later set of SNRs end with: its number, after a mark. The first set's end with nothing."""
    return f"{mark}{number}" if number > 1 else ""


def contents_of(*paths):
    """{path: SHA-256} of files that are not made here, for params. What they hold reruns a job, their dates do not.

    They are no inputs: Snakemake would look at their dates alone, and take braces in their paths for wildcards.
    """
    return {path: or_exit(contents.sha256, path) for path in paths}


def source_of(target):
    """What a target's surface comes from, for params: the contents of its CAD files, or the code of its generator."""
    said = config["targets"][target]
    return {"generator": code(plan.generator_file(target))} if "family" in said else contents_of(*files_of(said))


def parts_of(target):
    """What the mesh of a target of several parts depends on, for params: {parts: ...}; {} of another target."""
    parts = meshed(config["targets"][target].get("parts", {}))
    return section({"parts": parts}, "parts") if parts else {}


def judged(is_seed):
    """The tables that are compared: of this run's seeds, which rules make, or of other runs."""
    roots = [root for root in or_exit(plan.roots).values() if (root in plan.seeded) == is_seed]
    return [table for root in roots for table in plan.judged(root)]


def one_of(names):
    """A wildcard's constraint to these names; to nothing if there are none."""
    return "|".join(map(re.escape, names)) or "(?!)"


def method(target):
    """Return how a target is solved, for params."""
    settings = needs.method(config, target)
    return section(settings, *settings)


def learned_first(wildcards):
    """Return a target's priority: models train on those that have one while the others are still solved."""
    return int(wildcards.target in plan.known)


def planned_solve(wildcards, input):
    """Return what a solve needs, known once the mesh is there: its `megabytes` and `seconds`."""
    return plan.cost_of_solve(wildcards.target, int(wildcards.band), input.measures)


def solve_threads(wildcards, input):
    """All cores for a solve, but one for each of many short ones: two side by side are faster than one after the other.

    The field is the same, bit for bit. On a cluster, where there are no cores to share, each has a node's.
    """
    cores, is_short = None if workflow.remote_exec else workflow.resource_settings.cores, False
    if cores and len(plan.meshed) * len(plan.bands) >= 4 * cores:
        with contextlib.suppress(FileNotFoundError):  # asked again once the mesh is there
            is_short = planned_solve(wildcards, input)["seconds"] < SHORT
    return 1 if is_short else 16


def solve_minutes(wildcards, input, attempt):
    """The time a cluster gives a solve: four times the plan, which nodes were seen to exceed by 2.5 times."""
    return max(10, ceil(4 * planned_solve(wildcards, input)["seconds"] / 60)) * attempt


def for_images(path):
    """A path that images are made of; ends the run where the config's sweep makes none."""
    if not images_are_made(config):
        sys.exit(f"There are no images: config key {why_no_images(config)} Ask for `rcs` or `report` instead.")
    return path


def published(*tables):
    """What the reference thesis states, by the names of its tables."""
    return [in_repository(f"resources/reference/thesis_{table}.csv") for table in tables]
