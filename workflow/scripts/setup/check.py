"""Check a config, before any work is done: against the schema, and one key against another."""

import os
from pathlib import Path

import numpy as np

from core import sweep
from core.errors import InputError
from core.folders import of_fields
from core.sweep import images_are_made
from imaging.geometry import PURE_NOISE, centres, planned
from learning.classifier import NOT_HYPER, OTHER, choices
from learning.experiments import CLEAN, TOLERANCE, runs
from learning.split import split
from mesh import cad_kernel
from scattering import needs, origin
from setup.kinds import MODELS, SECTIONS, check_kind, kind, settings_of
from setup.schema import check_schema, near, schema

ROOT = Path(__file__).resolve().parents[3]
FIELD_FORMATS = (".ffe", ".zarr")
WHERE = " (paths start at the folder you run snakemake in, or at the repository's)"
MESH_FORMATS = (".stl", ".obj", ".ply", ".off", *cad_kernel.FORMATS)
MOST_ANGLES = 100_000
MOST_PIXELS = 4096  # of an image, for a model with covariances: one of 64 x 64 pixels takes 270 MB, of 128 x 128 4.3 GB


def rules(config):
    """The schema with the settings of the config's imager and solver. InputError if there are no such kinds."""
    whole = schema()
    for name in SECTIONS:
        part, own = whole["properties"][name], settings_of(name, config.get(name) if isinstance(config, dict) else None)
        if own is not None:
            own = {"properties": part["properties"] | own, "required": [*part["required"], *own]}
            part = part | own | {"additionalProperties": False}
        whole = whole | {"properties": whole["properties"] | {name: part}}
    return whole


def check(config):
    """Raise InputError for the first thing wrong with a full config that `check_schema` has nothing against."""
    _check_finite(config)
    if config.get("from") == config["name"]:
        raise InputError(
            f"config key 'from': '{config['from']}' is this run's own 'name'; give it the name of another run, whose "
            "meshes and fields it takes, or leave it out."
        )
    _check_sweep(config)
    _check_own_settings(config)
    _check_targets(config)
    _check_snrs(config)
    _check_models(config["learning"])
    _check_experiments(config)


def _check_finite(value, path=""):
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            _check_finite(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, float) and not np.isfinite(value):
        raise InputError(f"config key '{path}': {value} is not a finite number.")


def _check_sweep(config):
    radar, aspect, imaging = config["radar"], config["aspect"], config["imaging"]
    if radar["frequencies"] == 1 and radar["bandwidth"] != 0:
        raise InputError(
            f"config key 'radar.bandwidth': {radar['bandwidth']:g} Hz, but 'radar.frequencies' is 1; then it must be 0."
        )
    if radar["frequencies"] > 1 and radar["bandwidth"] == 0:
        raise InputError(
            f"config key 'radar.bandwidth': 0 Hz, but 'radar.frequencies' is {radar['frequencies']}; it must be more "
            "than 0, or 'radar.frequencies' 1."
        )
    if radar["bandwidth"] >= 2 * radar["center_frequency"]:
        raise InputError(
            f"config key 'radar.bandwidth': {radar['bandwidth']:g} Hz reaches below 0 Hz; "
            f"it must be less than twice 'radar.center_frequency' ({radar['center_frequency']:g} Hz)."
        )
    azimuth = aspect["azimuth"]
    if set(azimuth) not in ({"count"}, {"start", "stop", "step"}):
        raise InputError(
            "config key 'aspect.azimuth' must have either 'count', or all of 'start', 'stop' and 'step'; "
            f"it has {', '.join(sorted(azimuth)) or 'nothing'}."
        )
    for name, limit in (("elevation", 90), ("azimuth", 360)):
        _check_steps(f"aspect.{name}", aspect[name], limit)
    azimuths = sweep.azimuths(aspect)
    if azimuths[-1] - azimuths[0] >= 360:
        raise InputError("config key 'aspect.azimuth' covers 360 degrees or more; write {count: ...} for a circle.")
    if images_are_made(config) and imaging["aperture"] > len(azimuths):
        raise InputError(
            f"config key 'imaging.aperture': {imaging['aperture']} samples are more than the sweep's "
            f"{len(azimuths)} azimuths ('aspect.azimuth')."
        )
    if images_are_made(config):
        planned(config)


def _check_steps(key, angles, limit):
    if "count" in angles:
        return
    start, stop, step = angles["start"], angles["stop"], angles["step"]
    if not -limit <= start <= stop <= limit:
        raise InputError(
            f"config key '{key}': start {start} to stop {stop} must ascend within -{limit} to {limit} degrees."
        )
    if (stop - start) / step > MOST_ANGLES:
        raise InputError(f"config key '{key}.step': {step:g} degrees make more than {MOST_ANGLES} angles.")
    last = sweep.stepped(start, stop, step)[-1]
    if not np.isclose(last, stop):
        raise InputError(
            f"config key '{key}': steps of {step} degrees from {start} do not end at stop {stop}, but at {last:g}."
        )


def _check_targets(config):
    _check_cases("targets", config["targets"])
    for name, target in config["targets"].items():
        if name == OTHER:
            raise InputError(
                f"config key 'targets.{name}': '{OTHER}' is what images of no known class are called; "
                "take another name."
            )
        if name == PURE_NOISE:
            raise InputError(
                f"config key 'targets.{name}': images of noise alone are kept under this name; take another one."
            )
        if "field" in target:
            _check_field(f"config key 'targets.{name}.field'", target["field"], config)
            continue
        mesh = Path(target["mesh"])
        key = f"config key 'targets.{name}.mesh'"
        if mesh.suffix.lower() not in MESH_FORMATS:
            raise InputError(f"{key}: {mesh} is not one of {', '.join(MESH_FORMATS)}.")
        if not os.path.isfile(mesh):  # False also for a path that is too long, or in a folder that may not be read
            raise InputError(f"{key}: there is no file {mesh}{WHERE}.")
        if mesh.suffix.lower() in cad_kernel.FORMATS:
            cad_kernel.check_installed(f"{key}: {mesh}")
            if "unit" in target:
                raise InputError(
                    f"config key 'targets.{name}.unit': {mesh} states its own unit, from which it is converted; "
                    "leave 'unit' out. If the file's is wrong, export it anew."
                )


def _check_own_settings(config):
    """What targets set of the solver themselves, against what it says it has."""
    solver, own = config["scattering"]["solver"], settings_of("scattering", config["scattering"])
    described = schema()["properties"]["targets"]["additionalProperties"]["properties"]
    for name, target in config["targets"].items() if own is not None else ():
        for key in (key for key in needs.OWN if key in target):
            if key not in own:
                raise InputError(
                    f"config key 'targets.{name}.{key}': the solver '{solver}' has no such setting; leave it out."
                )
            rule = own[key] | {"description": described[key]["description"]}
            check_schema({key: target[key]}, {"properties": {key: rule}}, ("targets", name))


def _check_cases(key, names):
    """Raise InputError for two names that differ in case alone: some file systems would keep one folder for both."""
    found = {}
    for name in names:
        if found.setdefault(name.lower(), name) != name:
            raise InputError(
                f"config key '{key}.{name}' differs from '{found[name.lower()]}' in capital letters alone; "
                "take another name."
            )


def _check_field(key, field, config):
    results = of_fields(Path("results", config["name"]), config)
    for path in map(Path, origin.paths(field)):
        if path.suffix.lower() == ".zarr" and not origin.is_store(field):
            raise InputError(f"{key}: {path} is a store, which is named alone; it holds all polarizations.")
        if path.suffix.lower() not in FIELD_FORMATS:
            raise InputError(f"{key}: {path} is not one of {', '.join(FIELD_FORMATS)}.")
        if not (os.path.isdir(path) if origin.is_store(field) else os.path.isfile(path)):
            raise InputError(f"{key}: there is no {'store' if origin.is_store(field) else 'file'} {path}{WHERE}.")
        if path.resolve().is_relative_to(results.resolve()):
            raise InputError(f"{key}: {path} lies in {results}, where this run writes; copy it elsewhere.")
    if not origin.is_store(field):
        try:
            origin.by_transmission(field, config["radar"]["polarizations"])
        except InputError as error:
            raise InputError(f"{key}: {error}") from None


def _check_snrs(config):
    labels = {}
    for snr in config["noise"]["snr_db"]:
        if labels.setdefault(sweep.snr_label(snr), snr) != snr:
            raise InputError(
                f"config key 'noise.snr_db': {labels[sweep.snr_label(snr)]!r} and {snr!r} dB would both be called "
                f"{sweep.snr_label(snr)}; take values that differ in six digits."
            )


# How many texts a model's file states for the page of each name, and how: a number may follow, the place on the page.
NAMED = {"LABELS": (2, "(label, words in a sentence)"), "SCORES": (1, "(label,)")}


def _check_models(learning):
    """Every model's settings, against those that its kind says it has. A list stands for each of its values."""
    shared = schema()["properties"]["learning"]["properties"]["models"]["additionalProperties"]["properties"]
    for name, settings in learning["models"].items():
        key, which = f"config key 'learning.models.{name}", settings.get("kind", name)
        misspelt = [] if "kind" in settings else [one for one in settings if near(one, ["kind"]) != "."]
        check_kind(
            MODELS,
            which,
            f"{key}{'.kind' if 'kind' in settings else ''}'",
            f"; did you mean 'kind' by '{misspelt[0]}'?" if misspelt else None,
        )
        for one, value in settings.items():
            if one not in NOT_HYPER and value == []:
                raise InputError(f"{key}.{one}': an empty list leaves nothing to choose from.")
        smallest = kind(MODELS, which).stated.get("smallest", 1)
        if not isinstance(smallest, int):
            raise InputError(f"{key}': {which}.py says smallest = {smallest!r}; it is a whole number of pixels a side.")
        for attribute, (texts, entries) in NAMED.items():
            names = kind(MODELS, which).stated.get(attribute, {})
            if not isinstance(names, dict) or not all(
                isinstance(words, tuple | list) and [*map(type, words)] in ([str] * texts, [*[str] * texts, int])
                for words in names.values()
            ):
                raise InputError(
                    f"{key}': {which}.py says {attribute} = {names!r}; it is a mapping of names to {entries}."
                )
        own = kind(MODELS, which).settings
        if own is not None:
            rules = {
                "additionalProperties": False,
                "required": list(own),
                "properties": shared | own,
                "$defs": schema()["$defs"],
            }
            for choice in choices(settings):
                check_schema(choice, rules, ("learning", "models", name))


def model_kind(models, name):
    """The Kind of a model of the config: that of its own name, unless it says another."""
    return kind(MODELS, models[name].get("kind", name))


def _check_experiments(config):
    learning = config["learning"]
    experiments = learning["experiments"] if images_are_made(config) else {}
    roles = [target["role"] for target in config["targets"].values()]
    elevations = sweep.elevations(config["aspect"])
    _check_cases("learning.experiments", experiments)
    found = runs(config) if experiments else {}
    for name, experiment in experiments.items():
        key = f"config key 'learning.experiments.{name}"
        if roles.count("known") < 2:
            raise InputError(
                f"{key}' needs at least two targets with role known; there are {roles.count('known')}. "
                "Write 'learning: {experiments: {}}' to stop after the images."
            )
        train = experiment["train"]
        for model in experiment["models"]:
            if model not in learning["models"]:
                raise InputError(
                    f"{key}.models': there is no '{model}' in 'learning.models'{near(model, learning['models'])} "
                    f"There are: {', '.join(learning['models'])}."
                )
        if train["elevation"] != "all":
            for angle in train["elevation"]:
                if np.abs(elevations - angle).min() >= TOLERANCE:
                    raise InputError(
                        f"{key}.train.elevation': {angle} degrees is not one of the sweep's elevations "
                        f"({', '.join(f'{e:g}' for e in elevations)})."
                    )
    if not found:
        return
    images = centres(sweep.azimuths(config["aspect"]), config["imaging"]["aperture"])
    figures = planned(config)
    sides = figures["range_pixels"], figures["crossrange_pixels"]
    for run in found.values():
        key = f"config key 'learning.experiments.{run['experiment']}"
        for snr in run["snrs"]:
            if snr != CLEAN and snr not in config["noise"]["snr_db"]:
                have = ", ".join(f"{one:g}" for one in sorted(config["noise"]["snr_db"]))
                raise InputError(f"{key}.train.snr_db': {snr} is not in noise.snr_db ({have}).")
        stated = {model: model_kind(learning["models"], model).stated for model in run["models"]}
        for model in run["models"] if run["random_snr"] else ():
            if not stated[model].get("by_snr", False):
                raise InputError(f"{key}.train.snr_db': {model} does not keep the SNRs of its images apart.")
        if run["upsample"] != "none" and run["upsample"] < max(sides):
            raise InputError(
                f"{key}.upsample': {run['upsample']} pixels a side are fewer than the images' {sides[0]} x {sides[1]}."
            )
        pixels = min(sides) if run["upsample"] == "none" else run["upsample"]
        for model in run["models"]:
            smallest = stated[model].get("smallest", 1)
            if pixels < smallest:
                raise InputError(
                    f"{key}.upsample': {model} needs {smallest} pixels a side or more, these images "
                    f"have {pixels}; 32 is usual."
                )
            count = np.prod(sides) if run["upsample"] == "none" else run["upsample"] ** 2
            if stated[model].get("covariances", False) and count > MOST_PIXELS:
                raise InputError(
                    f"{key}.upsample': {model} keeps covariances of all pixels, and these images have {count}; "
                    f"{MOST_PIXELS} (64 a side) are the most it takes."
                )
            denoises = True in np.atleast_1d(learning["models"][model].get("denoise", False))
            if denoises and not (run["random_snr"] and CLEAN in run["snrs"]):
                raise InputError(
                    f"{key}.train.snr_db': {model} with 'denoise' learns what an image is without its noise; give it "
                    "{random: [clean, ...]}."
                )
        split(images, learning["split"], config["seed"], config["imaging"]["aperture"], run["split"])
