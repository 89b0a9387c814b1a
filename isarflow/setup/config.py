"""Load a config and lay overlays over it, before any work is done."""

import functools
import os
import re
import unicodedata
from pathlib import Path

import yaml

from isarflow.core.errors import InputError, refusal
from isarflow.core.folders import ROOT
from isarflow.core.sweep import frequencies, images_are_made
from isarflow.learning.experiments import CLEAN
from isarflow.mesh.read.target import REST
from isarflow.setup import materials, overlay, ranges
from isarflow.setup.check import check, check_experiments, check_fewest, rules
from isarflow.setup.families import expanded
from isarflow.setup.overlay import ALL, EXPERIMENTS
from isarflow.setup.poses import posed
from isarflow.setup.schema import check_schema, schema
from isarflow.setup.yaml_file import read_yaml

BASE = ROOT / "config" / "config.yaml"

# YAML 1.1 reads 2.775e9 (no sign in the exponent) as text; everyone means the number.
EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")
LONGEST_NAME = 96  # characters of a file's name in that of its run: four more may come before it


def load_config(*overlays):
    """The full, checked config: config/config.yaml with each of the overlays, mappings, laid over it in turn.

    `seed` is the first of its seeds, where it has several; the others are noted as `further_seeds`.
    Raises InputError with one message that names the key, its value and what would be right.
    """
    config = _changed(functools.reduce(overlay.merge, overlays, read_yaml(BASE)), _number)
    check_schema(config, rules(config))
    config["radar"] = ranges.with_band(config["radar"])
    config["imaging"].setdefault("polarizations", list(config["radar"]["polarizations"]))
    ranges.write_out_snrs(config)
    for motion in [config["motion"], *(one.get("motion", {}) for one in config["learning"]["experiments"].values())]:
        motion |= {"poses": 0} if motion.get("poses") == "still" else {}  # none a pulse
    if isinstance(config["seed"], list):
        config["seed"], *config["further_seeds"] = config["seed"]
    config["targets"] = materials.written_out(
        posed(expanded(config["targets"])), lambda path: _changed(read_yaml(path), _number)
    )
    for target in config["targets"].values():
        keys = {"mesh", "field", "reference", "background", "calibrate"} & target.keys()
        target |= {key: _changed(target[key], _from_here) for key in keys}
        if {"mesh", "parts"} <= target.keys():
            target["parts"] = {REST: {}} | target["parts"]
        for part in target.get("parts", {}).values():
            part |= {key: _from_here(part[key]) for key in ("mesh",) if key in part}
    learning = config["learning"]
    # A model whose `kind` is another model has that one's settings where it has none of its own.
    learning["models"] = {
        name: {**learning["models"].get(settings.get("kind"), {}), **settings}
        for name, settings in learning["models"].items()
    }
    check(config)
    _leave_out(config, overlay.named(overlays, EXPERIMENTS))
    check_fewest(config)
    # More bands than frequencies would leave some empty; the order of SNRs has no meaning.
    config["mesh"]["bands"] = min(config["mesh"]["bands"], len(frequencies(config["radar"])))
    config["noise"]["snr_db"] = sorted(config["noise"]["snr_db"])
    # Nor has the order of choices.
    for settings in learning["models"].values():
        settings |= {key: sorted(value) for key, value in settings.items() if isinstance(value, list)}
    return config


def of_command_line(settings):
    """Return what --config says, with the text in its mappings and lists read as YAML: Snakemake leaves it as text.

    `cad`, the path of a CAD file, means a run of that target alone, which learns nothing, under the file's name;
    `unit` beside it is the file's unit.
    """

    def read(text):
        return yaml.load(text, yaml.CSafeLoader) if isinstance(text, str) else text

    said = {key: _changed(value, read) if isinstance(value, dict | list) else value for key, value in settings.items()}
    if "cad" not in said:
        return said
    path = str(said.pop("cad"))
    name = _name_of(path)
    unit = {"unit": said.pop("unit")} if "unit" in said else {}
    targets = {ALL: None, name: {"mesh": path, "role": "other"} | unit}
    return overlay.merge({"name": name, "targets": targets, "learning": {"experiments": {ALL: None}}}, said)


def _name_of(path):
    """A name that a target and a run may have, from that of a file."""
    stem = unicodedata.normalize("NFKD", Path(path).stem).encode("ascii", "ignore").decode().lower()
    name = re.sub("[^a-z0-9]+", "_", stem).strip("_")[:LONGEST_NAME] or "cad"
    rules = schema()["$defs"]
    return f"cad_{name}" if refusal(check_schema, name, rules["free_name"] | {"$defs": rules}) else name


def unnamed(config, *overlays):
    """Lines of text: targets and experiments of config/config.yaml that run in addition to those an overlay names.

    A map in which the overlays name nothing gives no line.
    """
    default, lines = read_yaml(BASE), []
    for path in ("targets", EXPERIMENTS) if images_are_made(config) else ("targets",):
        mine, known = overlay.named(overlays, path), _at(default, path)
        rest = [name for name in _at(config, path) if name in known and name not in mine]
        if mine and rest:
            remain = f"beside the {path.split('.')[-1]} that your config names, these of config/config.yaml remain"
            remove = f"'{path}.{rest[0]}: null' removes one, '{path}.\"{ALL}\": null' all of them"
            lines.append(f"Note: {remain}: {', '.join(rest)}. {remove}.")
    return lines


def section(config, *keys):
    """The named parts of the config as one plain mapping with sorted keys, for a rule's params.

    Keys may be dotted. Snakemake compares params by their text, so the order in the file must not matter.
    """
    return {key: _sorted(_at(config, key)) for key in sorted(keys)}


def unfocused(config):
    """The config for clean images and those of noise alone, which are formed without `imaging.focus`."""
    return config | {"imaging": {key: value for key, value in config["imaging"].items() if key != "focus"}}


def _leave_out(config, asked):
    """Remove default experiments that the config's sweep or SNRs do not allow; the reason is noted as `left_out`.

    Those that train over a range of SNRs do so at those of it that noise.snr_db has, if two or more; those whose `test`
    has none of noise.snr_db are tested at all of it.
    asked: the experiments that the user's config names. One of these is refused instead, and kept as it is.
    """
    experiments, kept, left_out = config["learning"]["experiments"], {}, {}
    refused = refusal(check_experiments, config, experiments)
    if not refused:
        return
    mine = {name: experiment for name, experiment in experiments.items() if name in asked}
    check_experiments(config, mine)
    for name, experiment in experiments.items():
        shortened = experiment if name in mine else _at_snrs(experiment, config["noise"]["snr_db"])
        why = refusal(check_experiments, config, {**mine, name: shortened})
        if why:
            left_out[name] = why
        else:
            kept[name] = shortened
    if not kept:
        raise InputError(refused)
    check_experiments(config, kept)
    config["learning"] |= {"experiments": kept} | ({"left_out": left_out} if left_out else {})


def _at_snrs(experiment, snr_db):
    """An experiment over a range of SNRs at those of it that are in snr_db, as `_leave_out` says."""
    train, tested = experiment["train"], experiment.get("test", {"snr_db": []})["snr_db"]
    if not {*tested} & {*snr_db}:
        experiment = {key: value for key, value in experiment.items() if key != "test"}
    if isinstance(train["snr_db"], dict):
        ((way, snrs),) = train["snr_db"].items()
        kept = [snr for snr in snrs if snr == CLEAN or snr in snr_db]
        if len(set(kept) - {CLEAN}) > 1:
            return {**experiment, "train": {**train, "snr_db": {way: kept}}}
    return experiment


def _changed(value, change):
    """A value with `change` applied to everything in its mappings and lists."""
    if isinstance(value, dict):
        return {key: _changed(item, change) for key, item in value.items()}
    return [_changed(item, change) for item in value] if isinstance(value, list) else change(value)


def _number(value):
    if isinstance(value, str) and EXPONENT.fullmatch(value):
        value = float(value)
    # 2.0 counts as a whole number, and is one from here on; frequencies in Hz stay what they are.
    return int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 1e6 else value


def _from_here(path):
    """Resolve a path of the config: from the working folder, or else from the repository."""
    return path if os.path.exists(path) or not os.path.exists(ROOT / path) else os.path.relpath(ROOT / path)


def _sorted(value):
    return {key: _sorted(value[key]) for key in sorted(value)} if isinstance(value, dict) else value


def _at(config, path):
    """The value in a config at a dotted path."""
    return functools.reduce(dict.__getitem__, path.split("."), config)
