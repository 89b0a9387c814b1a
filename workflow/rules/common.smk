# What all rules share: the checked config, names of artefacts, and functions of wildcards.

import contextlib
import json
import os
import re
import sys
import time
from errno import ENOENT
from math import ceil

from snakemake.logging import logger
from snakemake.settings.enums import Quietness

SCRIPTS = os.path.join(workflow.basedir, "workflow", "scripts")
sys.path.insert(0, workflow.basedir)  # where the package isarflow is, a link to SCRIPTS
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

from isarflow.setup import disk, lock, together
from isarflow.core import folders, sweep
from isarflow.setup.check import model_kind
from isarflow.setup.kinds import IMAGERS, SOLVERS, kind, page_names
from isarflow.setup.closure import digest
from isarflow.setup.config import load, of_command_line, section, unnamed
from isarflow.core.errors import InputError
from isarflow.setup.overview import overview
from isarflow.setup.yaml_file import read_yaml
from isarflow.core.sweep import images_are_made, why_no_images
from isarflow.imaging.geometry import PURE_NOISE, megabytes, planned
from isarflow.learning import experiments
from isarflow.report.selection import decoded_snrs, mistaken, mistaken_snr, noise_snrs, noisy_targets
from isarflow.scattering import field_files, needs


def or_exit(function, *arguments):
    """What the function gives. An InputError ends the run with its message, and not with one of Snakemake's around it."""
    try:
        return function(*arguments)
    except InputError as error:
        sys.exit(str(error))


# One after the other, as null in one of them removes what those before it name; Snakemake's own merge knows no null.
OVERLAYS = [or_exit(read_yaml, path) for path in workflow.configfiles]
OVERLAYS.append(of_command_line(workflow.config_settings.config))
config = or_exit(load, *OVERLAYS)
RESULTS = f"results/{config['name']}"
# Meshes and fields are this run's own, or those of the run that it takes them from.
FIELDS = folders.of_fields(RESULTS, config).as_posix()
if workflow.is_main_process:  # a job runs under the lock of the run that sent it
    or_exit(disk.check_writable, ".", RESULTS, FIELDS)
    for line in lock.release_stale():
        logger.warning(line)

# On a cluster a job's memory also holds the two Snakemakes that start it, 190 MB each; in part they share it.
STARTING = 400  # MB
SHORT = 180  # s by plan on two cores: a solve that takes no longer is a short one
TARGETS = list(config["targets"])
# A target is a mesh, which is solved, or a field from elsewhere.
MESHED = [target for target in TARGETS if "mesh" in config["targets"][target]]
GIVEN = [target for target in TARGETS if target not in MESHED]
BANDS = range(config["mesh"]["bands"])
# The config for each of its seeds, by the folder of what follows from the seed. Of further seeds that is a folder in the
# run's own, and what does not follow from it is the run's.
SEEDED = {f"{RESULTS}/seed_{seed}": {**config, "seed": seed} for seed in config.pop("further_seeds", [])}
SEEDED = {RESULTS: config, **SEEDED}
COMPARED = config.pop("compare", [])  # other runs, by name
# The learning stage's runs by name, in one order whatever the config's; of every seed, and of the first.
RUNS_OF = {
    root: dict(sorted(experiments.runs(seeded).items())) if images_are_made(config) else {}
    for root, seeded in SEEDED.items()
}
RUNS = RUNS_OF[RESULTS]
MODELS = config["learning"]["models"]
# Run and model, as their folders are called; those that times are measured of and pictures made are of the first fold.
FITTED = sorted(f"{run}/{model}" for run in RUNS for model in RUNS[run]["models"])
TIMED = sorted(f"{run}/{model}" for run in RUNS if RUNS[run]["first"] for model in RUNS[run]["models"])
KNOWN = sorted(name for name in TARGETS if config["targets"][name]["role"] == "known")
UNKNOWN = sorted(name for name in TARGETS if config["targets"][name]["role"] == "unknown")
SNRS = [sweep.snr_label(snr) for snr in config["noise"]["snr_db"]]
# Those of which a target's images, and a model's predictions, are one job.
SNR_SETS = together.sets(RESULTS, SNRS, workflow.is_main_process)
# At which SNRs the page shows what models with a decoder make of images.
DECODED_SNRS = [sweep.snr_label(snr) for snr in decoded_snrs(config["noise"]["snr_db"])]


def in_repository(*parts):
    """The path of a file of the repository, from the folder that Snakemake runs in."""
    return os.path.relpath(os.path.join(workflow.basedir, *parts))


def code(*scripts):
    """A hash of the code that a job's results come from: of these scripts and every module that they import.

    As a param it reruns the job when what the code does changes; an edited comment or docstring changes nothing.
    """
    return or_exit(digest, *scripts)


def page_files():
    """What the page is put together from besides modules: its templates, style and scripts."""
    names = sorted(os.listdir(os.path.join(SCRIPTS, "report")))
    return [in_repository("workflow/scripts/report", name) for name in names if name.endswith((".html", ".css", ".js"))]


def end_if_refused(report):
    """End the run with an error if the report of `check` names targets that are refused: it has done its job, and stays."""
    with open(report) as file:
        *_, last = file
    if last.startswith("Error:"):
        sys.exit(f"{last.strip()} ({report} says why)")


def expected(refuse):
    """What is said before anything runs (see `overview`)."""
    return unnamed(config, *OVERLAYS) + or_exit(overview, config, RESULTS, refuse, len(SEEDED))


def numbered(number, mark):
    """What the names of a later set of SNRs end with: its number, after a mark. The first set's end with nothing."""
    return f"{mark}{number}" if number > 1 else ""


def watched(path):
    """A file that the user chose, as an input; none if Snakemake would take braces in its path for wildcards."""
    return [] if "{" in path else path


def unwatched_digest(path):
    """For the params, the checksum of a file that is no input, so that its job runs again when the file changes."""
    return "" if watched(path) else field_files.digest(path)


def one_of(names):
    """A wildcard's constraint to these names; to nothing if there are none."""
    return "|".join(map(re.escape, names)) or "(?!)"


def symmetry(target):
    return config["targets"][target].get("symmetry", [])


def method(target):
    """How a target is solved, for params."""
    settings = needs.method(config, target)
    return section(settings, *settings)


def learned_first(wildcards):
    """A target's priority: models train on those that have one while the others are still solved."""
    return int(wildcards.target in KNOWN)


def planned_solve(wildcards, input):
    """What a solve needs, known once the mesh is there: its `megabytes` and `seconds`."""
    with open(input.measures) as file:
        bands = json.load(file)["bands"]
    if int(wildcards.band) >= len(bands):
        # The mesh is yet to be made anew: for Snakemake as if there were none.
        raise FileNotFoundError(ENOENT, "no such band", input.measures)
    target, band = wildcards.target, int(wildcards.band)
    asked = sweep.sweeps(config["radar"], config["aspect"], config["mesh"]["bands"], config["scattering"])[band]
    return needs.need(bands[band], len(symmetry(target)), asked, needs.method(config, target))


def solve_threads(wildcards, input):
    """All cores for a solve, but one for each of many short ones: two side by side are faster than one after the other.

    The field is the same, bit for bit. On a cluster, where there are no cores to share, each has a node's.
    """
    cores, is_short = None if workflow.remote_exec else workflow.resource_settings.cores, False
    if cores and len(MESHED) * len(BANDS) >= 4 * cores:
        with contextlib.suppress(FileNotFoundError):  # asked again once the mesh is there
            is_short = planned_solve(wildcards, input)["seconds"] < SHORT
    return 1 if is_short else 16


def solve_megabytes(wildcards, input):
    return STARTING + planned_solve(wildcards, input)["megabytes"]


def solve_minutes(wildcards, input, attempt):
    """The time a cluster gives a solve: four times the plan, which nodes were seen to exceed by 2.5 times."""
    return max(10, ceil(4 * planned_solve(wildcards, input)["seconds"] / 60)) * attempt


def image_megabytes(copies):
    """The memory of a job that makes so many copies of a target's images."""
    return STARTING + int(megabytes(planned(config), copies))


def for_images(path):
    """A path that images are made of; ends the run where the config's sweep makes none."""
    if not images_are_made(config):
        sys.exit(f"There are no images: config key {why_no_images(config)} Ask for `rcs` or `report` instead.")
    return path


def images_shown():
    """The stores of images that the page shows pictures of: all targets without noise, those with some at some SNRs."""
    if not images_are_made(config):
        return []
    noisy = [sweep.snr_label(snr) for snr in noise_snrs(config["noise"]["snr_db"])]
    return [
        *expand(f"{RESULTS}/imaging/{{target}}/clean.zarr", target=TARGETS),
        *expand(f"{RESULTS}/imaging/{{target}}/{{snr}}.zarr", target=noisy_targets(config["targets"], RUNS), snr=noisy),
    ]


def published(*tables):
    """What the reference thesis states, by the names of its tables."""
    return [in_repository(f"resources/reference/thesis_{table}.csv") for table in tables]


def full_size_scores():
    """The scores of the full-size run that the repository keeps; none until it does."""
    paths = [in_repository(f"resources/results/{table}.csv.xz") for table in ("scores", "validation")]
    return [path for path in paths if os.path.exists(path)]


def predictions_shown():
    """The predictions, image by image, that the page shows something of."""
    shown = {(fitted, snr) for fitted in decoders() for snr in DECODED_SNRS}
    if RUNS:
        run, model = mistaken(RUNS)
        shown.add((f"{run}/{model}", sweep.snr_label(mistaken_snr(config["noise"]["snr_db"]))))
    return [f"{RESULTS}/learning/predictions/{fitted}/{snr}.csv" for fitted, snr in sorted(shown)]


def imager_code():
    """The file of the config's imager, which jobs load by name."""
    return [kind(IMAGERS, config["imaging"]["imager"]).file]


def model_code(*models):
    """The files of these models of the config, which jobs load by name."""
    return [model_kind(MODELS, model).file for model in models]


def solver_code():
    """The file of the config's solver, which jobs load by name."""
    return [kind(SOLVERS, config["scattering"]["solver"]).file]


def trained_targets(model):
    """The targets that a model learns: the known ones, and those of role other for one with such a class."""
    roles = {"known", "other"} if MODELS[model].get("other", False) else {"known"}
    return [name for name in TARGETS if config["targets"][name]["role"] in roles]


def training_stores(wildcards):
    labels = [experiments.label(snr) for snr in RUNS[wildcards.run]["snrs"]]
    # Of another seed are only those with noise.
    roots = {label: RESULTS if label == experiments.CLEAN else wildcards.root for label in labels}
    targets = trained_targets(wildcards.model)
    stores = [f"{roots[label]}/imaging/{target}/{label}.zarr" for target in targets for label in labels]
    model = MODELS[wildcards.model]
    learns_noise = model.get("other", False) or model_kind(MODELS, wildcards.model).stated.get("learns_noise", False)
    return stores + ([f"{wildcards.root}/imaging/{PURE_NOISE}/clean.zarr"] if learns_noise else [])


def compared():
    """The folders of the runs that stand beside each other, by name: this one, its other seeds, and other runs."""
    roots = {config["name"]: RESULTS} | {os.path.basename(root): root for root in SEEDED if root != RESULTS}
    return roots | or_exit(folders.of_others, COMPARED, len(roots))


def judged_of(root):
    """What a run's differences to another come from: its scores, predictions, and what its models are."""
    if root not in SEEDED:
        return folders.judged(root)
    models = expand("{root}/learning/models/{fitted}", root=root, fitted=FITTED)
    predictions = expand("{root}/learning/predictions/{fitted}/{snr}.csv", root=root, fitted=FITTED, snr=SNRS)
    return [f"{root}/learning/scores.csv", *models, *predictions]


def tested_targets(run):
    """The targets that a run is tested on, or chooses thresholds with."""
    return TARGETS if RUNS[run]["open"] else KNOWN


def decoders():
    """The models with a decoder, <run>/<model>, in runs that are tested on unknown targets."""
    opened = [run for run in RUNS if RUNS[run]["open"] and RUNS[run]["first"]]
    fitted = [(run, model) for run in opened for model in RUNS[run]["models"]]
    return sorted(f"{run}/{model}" for run, model in fitted if "reconstruct" in model_kind(MODELS, model).methods)


def of_targets(targets):
    """Roles and mirror planes of these targets, for params."""
    names = sorted(targets)
    return {
        "roles": {name: config["targets"][name]["role"] for name in names},
        "planes": {name: sorted(symmetry(name)) for name in names},
    }


def track():
    """The models whose scores add up over looks, degrees between azimuths, and azimuths of an aperture."""
    named = sorted({model for run in RUNS.values() for model in run["models"]})
    additive = [model for model in named if model_kind(MODELS, model).stated.get("additive", False)]
    first, second, *_ = sweep.azimuths(config["aspect"])
    return [additive, float(second - first), config["imaging"]["aperture"]]


def tested_realizations():
    """How many realizations of each view's noise are tested."""
    tested, every = config["learning"]["realizations"], config["noise"]["realizations"]
    return every if tested == "all" else min(tested, every)


def megabytes_of(run, model):
    """The memory of a job of a model, in MB."""
    run, plan, copies = RUNS[run], planned(config), config["noise"]["realizations"]
    sampled = plan["range_pixels"] * plan["crossrange_pixels"]
    pixels = sampled if run["upsample"] == "none" else run["upsample"] ** 2
    pixels *= experiments.channels_of(run, plan["channels"])
    sets = len(trained_targets(model)) * sum(1 if snr == experiments.CLEAN else copies for snr in run["snrs"])
    sets = max(sets, copies)  # a prediction reads the noisy images of a target at a time
    stated = model_kind(MODELS, model).stated
    covariances = len(run["snrs"]) if stated.get("covariances", False) else 0
    return int(experiments.megabytes(plan["images"] * sets, pixels, covariances, stated.get("pairs", False)))
