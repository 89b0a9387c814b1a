"""Check a config that keeps to the schema, before any work is done: one key against another.

Generators find what is wrong and give sentences that begin with the key. Only the first sentence is used, so each
generator may rely on the checks before it.
"""

import os
from pathlib import Path

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError, refusal
from isarflow.core.folders import of_fields
from isarflow.core.kinds import FOCUS, IMAGERS, MODELS, SECTIONS, check_kind, kind, of_focus, of_model, settings_of
from isarflow.core.sweep import images_are_made
from isarflow.core.words import near
from isarflow.imaging.formation import with_imager
from isarflow.imaging.geometry import centres, planned
from isarflow.learning.classifier import OTHER, choices
from isarflow.learning.data.split import FAMILY_FOLDS, Division, folds, split
from isarflow.learning.data.split import check as check_sides
from isarflow.learning.experiments import (
    CLEAN,
    TOLERANCE,
    channels_of,
    class_of,
    is_by_family,
    kind_of,
    members,
    runs,
    split_settings,
)
from isarflow.mesh.read import cad_kernel
from isarflow.mesh.read.target import files_of, states_unit
from isarflow.scattering import needs
from isarflow.scattering.fields import field_files
from isarflow.scattering.fields.reference import check_columns, check_frequencies, is_csv, several
from isarflow.setup import materials, ranges
from isarflow.setup.schema import check_schema, schema

# Of the files that a target names; those that are one file, not a list.
FORMATS = {
    "mesh": (".stl", ".obj", ".ply", ".off", *cad_kernel.FORMATS),
    "field": (".ffe", ".zarr"),
    "reference": (".csv", ".ffe"),
    "background": (".zarr",),
}
ALONE = (".zarr", ".csv")
WHERE = " (paths start at the folder you run snakemake in, or at the repository's)"
MOST_PIXELS = 4096  # of an image, for a model with covariances: one of 64 x 64 pixels takes 270 MB, of 128 x 128 4.3 GB


def rules(config):
    """The schema with the settings of the config's imager and solver. InputError if there are no such kinds."""
    sections = dict(schema()["properties"])
    for name in SECTIONS:
        settings = settings_of(name, config.get(name) if isinstance(config, dict) else None)
        if settings is not None:
            properties, required = sections[name]["properties"] | settings, [*sections[name]["required"], *settings]
            own = {"properties": properties, "required": required, "additionalProperties": False}
            sections[name] = sections[name] | own
    return schema() | {"properties": sections}


def check(config):
    """Raise InputError for the first thing wrong with a full config, its experiments left out."""
    for problem in _problems(config):
        raise InputError(f"config key {problem}")


def check_experiments(config, experiments):
    """Raise InputError for the first thing wrong with these experiments in a config that `check` lets pass."""
    if experiments and images_are_made(config):
        for problem in _of_experiments(config, experiments):
            raise InputError(f"config key {problem}")


def check_fewest(config):
    """Raise InputError for a model that is set to ask for more training images than a run of its experiments has."""
    models = config["learning"]["models"]
    asking = {model: of_model(models, model).stated.get("fewest") for model in models}
    for run in runs(config).values() if images_are_made(config) else ():
        for model in filter(asking.get, run["models"]):
            key, most = f"learning.models.{model}.{asking[model]}", np.max(models[model][asking[model]])
            if most > (there := training_images(config, run, models[model])):
                of_run = f"the {there} images that the run '{run['name']}' trains on"
                raise InputError(f"config key '{key}': {most} is more than {of_run}; take {there} at most.")


def _problems(config):
    if config.get("from") == config["name"]:
        yield f"'from': '{config['from']}' is this run's own 'name'; give it that of another run, or leave it out."
    if config["name"] in config.get("compare", ()):
        yield f"'compare': '{config['name']}' is this run's own 'name'; give it the names of others."
    yield from ranges.problems(config)
    channels, waves = (config[section]["polarizations"] for section in ("imaging", "radar"))
    yield from _absent("imaging.polarizations", channels, "radar.polarizations", waves)
    if images_are_made(config):
        planned(config)
        yield from _of_imagers(config)
        _check_focus(config["imaging"])
    yield from _of_targets_solver(config)
    yield from materials.problems(config)
    if config["scattering"]["solver"] == "mom" and not config["mesh"]["remesh"]:
        yield "'mesh.remesh': the solver 'mom' needs edges far below the wavelength; leave it true, or take po or sbr."
    yield from _of_names("targets", config["targets"])
    for name, target in config["targets"].items():
        yield from _of_files(name, target, config)
    yield from _of_motion("motion", config["motion"], config)
    labels = {}
    for snr in config["noise"]["snr_db"]:
        label = sweep.snr_label(snr)
        if labels.setdefault(label, snr) != snr:
            yield f"'noise.snr_db': {labels[label]!r} and {snr!r} dB are both {label} in six digits; take one of them."
    yield from _of_models(config["learning"]["models"])


def _of_motion(key, motion, config):
    """Check a section `motion` against the sweep and the aperture."""
    if not any(motion.values()):
        return
    if motion.get("poses") and not any({"poses", "field"} & target.keys() for target in config["targets"].values()):
        yield f"'{key}.poses' is {motion['poses']}, and no target has several 'poses'; leave it still."
    if not images_are_made(config):
        yield f"'{key}' moves images, and there are none: {sweep.why_no_images(config)}"
    if motion.get("turn") and not sweep.closes_circle(sweep.azimuths(config["aspect"])):
        yield f"'{key}.turn' takes a sweep over a whole circle ('aspect.azimuth': {{count: ...}}); leave it 0."
    if (lost := motion.get("missing", 0) * config["imaging"]["aperture"]) > (most := config["imaging"]["aperture"] - 3):
        yield f"'{key}.missing' loses {lost:.1f} of {most + 3} pulses; three at least must remain."


def _of_imagers(config):
    """Check the imagers that the page shows beside each other as the config's own is checked."""

    def check_it(settings):
        whole = config | {"imaging": with_imager(config["imaging"], settings)}
        its_rules = rules(whole)["properties"]["imaging"] | {"$defs": schema()["$defs"]}
        check_schema(whole["imaging"], its_rules, ("imaging",))
        planned(whole)

    for name, settings in config.get("imagers", {}).items():
        if not isinstance(settings, dict) or "imager" not in settings:
            yield f"'imagers.{name}': it names an 'imager' and its settings, as the section 'imaging' does."
        if why := refusal(check_it, settings):
            yield f"'imagers.{name}': {why.removeprefix('config key ')}"


def _check_focus(imaging):
    """Raise InputError where there is no such focus method, or one of its settings is not as its file states."""
    method, settings = of_focus(imaging)
    check_kind(FOCUS, method, "config key 'imaging.focus'")
    stated = kind(FOCUS, method).settings
    if stated is not None:
        required = [setting for setting, rule in stated.items() if "default" not in rule]
        allowed = {"additionalProperties": False, "required": required, "properties": stated | {"method": {}}}
        check_schema({"method": method, **settings}, allowed, ("imaging", "focus"))


def _absent(key, names, source, there):
    """Find names, or SNRs, that a key has but its source, another key, has not. there: those that it has."""
    for name in names:
        if name not in there:
            hint = near(name, there) if isinstance(name, str) else "."
            yield f"'{key}': {name} is none of '{source}' ({', '.join(map(str, there))}){hint}"


def _of_names(key, names):
    """Find two names that differ in case alone: some file systems would keep one folder for both."""
    before = {}
    for name in names:
        other = before.setdefault(name.lower(), name)
        if other != name:
            yield f"'{key}.{name}' differs from '{other}' in capital letters alone; take another name."


def _of_files(name, target, config):
    """Check the files that a target names: where they are, their formats, and what they are for."""
    results = Path("results", config["name"])
    said = [(what, f"targets.{name}.{what}", target[what]) for what in FORMATS if what in target]
    references = target.get("calibrate", {}).items()
    said += [("background", f"targets.{name}.calibrate.{key}", path) for key, path in references]
    parts = target.get("parts", {}).items()
    said += [("mesh", f"targets.{name}.parts.{part}.mesh", own["mesh"]) for part, own in parts if "mesh" in own]
    for what, where, files in said:
        key, written = f"'{where}'", results if what == "reference" else of_fields(results, config)
        for path in map(Path, field_files.paths(files)):
            suffix, kind = path.suffix.lower(), "store" if path.suffix.lower() == ".zarr" else "file"
            if suffix not in FORMATS[what]:
                yield f"{key}: {path} is not one of {', '.join(FORMATS[what])}."
            if suffix in ALONE and not isinstance(files, str):
                yield f"{key}: {path} is named alone; it holds all polarizations."
            # Neither asks more of a path that is too long, or in a folder that may not be read.
            if not (os.path.isdir(path) if kind == "store" else os.path.isfile(path)):
                yield f"{key}: there is no {kind} {path}{WHERE}."
            if path.resolve().is_relative_to(written.resolve()):
                yield f"{key}: {path} lies in {written}, where this run writes; copy it elsewhere."
        if what == "mesh" and suffix in cad_kernel.FORMATS:
            cad_kernel.check_installed(f"config key {key}: {files}")
            if "unit" in target and all(map(states_unit, files_of(target))):
                why = "states its own unit; leave 'unit' out. If that is wrong, export the file anew"
                yield f"'targets.{name}.unit': {files} {why}."
    field, reference = (target.get(what, "") for what in ("field", "reference"))
    waves = config["radar"]["polarizations"]
    steps = [key for key in field_files.STEPS if key in target]
    if steps and not field_files.is_store(field):
        yield f"'targets.{name}.{steps[0]}' is for a 'field' of one store (.zarr); leave it out."
    if field and not field_files.is_store(field) and (why := refusal(field_files.by_transmission, field, waves)):
        yield f"'targets.{name}.field': {why}"
    if is_csv(reference):
        (swept,) = sweep.sweeps(config["radar"], config["aspect"], 1)
        columns = several(swept.frequency, swept.elevation, swept.azimuth, swept.polarizations)
        if why := refusal(check_columns, reference, columns) or refusal(check_frequencies, reference, swept.frequency):
            yield f"'targets.{name}.reference': {why}"


def _of_targets_solver(config):
    """Check the solver settings that targets have of their own against those that the solver states."""
    solver, settings = config["scattering"]["solver"], settings_of("scattering", config["scattering"])
    described = schema()["properties"]["targets"]["additionalProperties"]["properties"]
    for name, target in config["targets"].items() if settings is not None else ():
        for key in needs.OWN & target.keys():
            if key not in settings:
                yield f"'targets.{name}.{key}': the solver '{solver}' has no such setting; leave it out."
            rule = settings[key] | {"description": described[key]["description"]}
            check_schema({key: target[key]}, {"properties": {key: rule}}, ("targets", name))


# Number of texts that a model's file states for the page for each name; a number may follow, the place on the page.
NAMED = {"LABELS": (2, "(label, words in a sentence)"), "SCORES": (1, "(label,)")}


def _of_models(models):
    """Check every model's settings against those that its kind states. A list means each of its values in turn."""
    shared = schema()["properties"]["learning"]["properties"]["models"]["additionalProperties"]["properties"]
    for name, settings in models.items():
        key, file = f"learning.models.{name}", settings.get("kind", name)
        check_kind(MODELS, file, f"config key '{key}{'.kind' if 'kind' in settings else ''}'")
        its = of_model(models, name)
        smallest = its.stated.get("smallest", 1)
        if not isinstance(smallest, int):
            yield f"'{key}': {file}.py says smallest = {smallest!r}; it is a whole number of pixels a side."
        for attribute, (texts, entries) in NAMED.items():
            names = its.stated.get(attribute, {})
            if not isinstance(names, dict) or not all(
                isinstance(words, tuple | list) and [*map(type, words)] in ([str] * texts, [*[str] * texts, int])
                for words in names.values()
            ):
                yield f"'{key}': {file}.py says {attribute} = {names!r}; it is a mapping of names to {entries}."
        if its.settings is not None:
            required = [setting for setting, rule in its.settings.items() if "default" not in rule]
            allowed = {"additionalProperties": False, "required": required, "properties": shared | its.settings}
            for choice in choices(settings):
                check_schema(choice, allowed | {"$defs": schema()["$defs"]}, ("learning", "models", name))


def _of_experiments(config, experiments):
    learning, imaging, noise = config["learning"], config["imaging"], config["noise"]["snr_db"]
    targets = {name: target for name, target in config["targets"].items() if target["role"] == "known"}
    elevations = sweep.elevations(config["aspect"])
    yield from _of_names("learning.experiments", experiments)
    every = runs({**config, "learning": {**learning, "experiments": experiments}})
    for name, experiment in experiments.items():
        key, trained = f"learning.experiments.{name}", experiment["train"]["elevation"]
        moved = config["motion"] | experiment.get("motion", {})
        moving = f"{key}.motion" if "motion" in experiment else "motion"
        yield from _of_motion(moving, moved, config)
        if any(moved.values()) and not kind(IMAGERS, imaging["imager"]).stated.get("linear", False):
            how = f"in images of '{imaging['imager']}', which are not linear in the samples; take 'imager: fourier'"
            yield f"'{moving}': models cannot follow a target that moves {how}, or leave its motion 0."
        scheme = split_settings(learning, experiment)["scheme"]
        count = len(folds(scheme, learning["split"]))
        if "folds" in experiment and count == 1:
            yield f"'{key}.folds': only the splits by sector, by elevation and by family have folds; leave it out."
        for fold in experiment.get("folds", ()):
            if fold > count:
                of_config = " ('learning.split.folds')" if scheme == "sector" else ""
                yield f"'{key}.folds': fold {fold} is none of {count}{of_config}."
        if scheme == "elevation" and trained != "all":
            yield f"'{key}.train.elevation': the split by elevation says at which elevations it trains; write all."
        channels = experiment.get("channels", ())
        yield from _absent(f"{key}.channels", channels, "imaging.polarizations", imaging["polarizations"])
        known = {class_of(targets, target) for target in targets}
        if len(known) < 2:
            stop = "'learning: {experiments: {}}' stops after the images"
            several = f" of one class, {', '.join(known)}" if len(targets) > 1 else ""
            yield f"'{key}' needs at least two targets with role known; there are {len(targets)}{several} ({stop})."
        without = experiment.get("without", ())
        yield from _absent(f"{key}.without", without, "targets of role known", targets)
        for name_of_class in sorted(known - {class_of(targets, target) for target in targets if target not in without}):
            yield f"'{key}.without' leaves no target of the class {name_of_class} to train on; name fewer of them."
        yield from _absent(f"{key}.models", experiment["models"], "learning.models", learning["models"])
        for angle in trained if trained != "all" else ():
            if np.abs(elevations - angle).min() >= TOLERANCE:
                have = ", ".join(f"{elevation:g}" for elevation in elevations)
                yield f"'{key}.train.elevation': {angle} degrees is not one of the sweep's elevations ({have})."
    images, plan = centres(sweep.azimuths(config["aspect"]), imaging["aperture"]), planned(config)
    for run in every.values():
        key = f"learning.experiments.{run['experiment']}"
        yield from _absent(f"{key}.train.snr_db", sorted(set(run["snrs"]) - {CLEAN}), "noise.snr_db", sorted(noise))
        if run["tested"] != "all" and not {*run["tested"]} & {*noise}:
            yield from _absent(f"{key}.test.snr_db", run["tested"], "noise.snr_db", sorted(noise))
        stated = {model: of_model(learning["models"], model).stated for model in run["models"]}
        for model in run["models"] if run["random_snr"] else ():
            if not stated[model].get("by_snr", False):
                yield f"'{key}.train.snr_db': {model} does not keep the SNRs of its images apart."
        yield from _of_pixels(f"'{key}.upsample'", run, stated, plan)
        for model in run["models"]:
            yield from _of_members(f"'{key}.models'", model, run["models"], learning["models"])
            denoises = True in np.atleast_1d(learning["models"][model].get("denoise", False))
            if denoises and not (run["random_snr"] and CLEAN in run["snrs"]):
                yield f"'{key}.train.snr_db': {model} has 'denoise', and learns at {{random: [clean, ...]}} alone."
        division = Division(**run["division"])
        if is_by_family(run):
            yield from _of_sides(f"'{key}.split'", config["targets"], division.settings)
            continue
        for name, target in config["targets"].items():
            if target["role"] == "known":
                sides = split(elevations, images, target.get("symmetry", ()), division)
                check_sides(sides, division, name, len(images))


def _of_sides(key, targets, settings):
    """Check that a split by family has models of all classes, and kinds of others, on all sides."""
    groups = {}
    for name, target in targets.items():
        by_kind = target["role"] == "other" and settings["others"] == "novel"
        group = {"known": f"of the class {class_of(targets, name)}", "other": "of role other"}.get(target["role"])
        groups.setdefault(group, set()).add(kind_of(targets, name) if by_kind else name)
    for group, units in groups.items():
        if group and len(units) < FAMILY_FOLDS:
            what = "kinds" if group == "of role other" and settings["others"] == "novel" else "models"
            yield f"{key}: the split by family takes {FAMILY_FOLDS} {what} {group} at least; there are {len(units)}."


def training_images(config, run, settings):
    """Number of images that a model with these settings learns from in one of the config's runs."""
    azimuths = centres(sweep.azimuths(config["aspect"]), config["imaging"]["aperture"])
    elevations = sweep.elevations(config["aspect"]) if run["elevation"] == "all" else np.sort(run["elevation"])
    roles = ("known", OTHER) if settings.get("other", False) else ("known",)
    targets = {name: target for name, target in config["targets"].items() if name not in run["without"]}
    planes = [(name, target.get("symmetry", ())) for name, target in targets.items() if target["role"] in roles]
    copies = sum(1 if snr == CLEAN else config["noise"]["realizations"] for snr in run["snrs"])
    sets = [*planes * copies, *([("", ())] if OTHER in roles else [])]  # and pure noise, once
    division = Division(**run["division"])
    return sum(split(elevations, azimuths, planes, division, name)["train"].count for name, planes in sets)


def _of_members(key, model, named, models):
    """Check that models whose scores others take are fitted in the same run, and learn the same classes."""
    for member in members(models, model):
        if member not in named:
            yield f"{key}: {model} takes the scores of {member}; name {member} among them, too."
        elif bool(models[member].get("other", False)) != bool(models[model].get("other", False)):
            yield f"{key}: {model} takes the scores of {member}; both or neither must have 'other: true'."
        elif members(models, member):
            yield f"{key}: {model} takes the scores of {member}, which takes others' itself; name what {member} is of."


def _of_pixels(key, run, models, plan):
    """Check that a run's images have the pixels that its models can take. models: what each one's file states."""
    sides, upsample = (plan["range_pixels"], plan["crossrange_pixels"]), run["upsample"]
    if upsample != "none":
        if upsample < max(sides):
            yield f"{key}: {upsample} pixels a side are fewer than the images' {sides[0]} x {sides[1]}."
        sides = upsample, upsample
    for model, stated in models.items():
        smallest = stated.get("smallest", 1)
        if min(sides) < smallest:
            yield f"{key}: {model} needs {smallest} pixels a side or more, these images have {min(sides)}; 32 is usual."
        pixels = sides[0] * sides[1] * channels_of(run, plan["channels"])
        if stated.get("covariances", False) and pixels > MOST_PIXELS:
            most = f"{MOST_PIXELS} (64 a side) are the most"
            yield f"{key}: {model} keeps covariances of all channels' pixels, and these images have {pixels}; {most}."
