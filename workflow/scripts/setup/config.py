"""Load a config and lay overlays over it, before any work is done."""

import os
import re
from pathlib import Path

from core.errors import InputError
from learning.experiments import CLEAN
from setup.check import check
from setup.schema import check_schema
from setup.yaml_file import read_yaml

ROOT = Path(__file__).resolve().parents[3]
BASE = ROOT / "config" / "config.yaml"

# An overlay that names one of these replaces all of it: it holds things that the user names.
COLLECTIONS = ("targets", "learning.experiments")
# Of these an overlay's form may differ from the base's ({count} or {start, stop, step}).
ALTERNATIVES = ("aspect.azimuth",)
# YAML 1.1 reads 2.775e9 (no sign in the exponent) as text; everyone means the number.
EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")


def load(overlay=None, files=()):
    """The full, checked config: config/config.yaml with `overlay` (a mapping) laid over it.

    files: where the overlay was read from; they are read once more for what YAML readers pass over in silence.
    Raises InputError with one message that names the key, its value and what would be right.
    """
    for path in files:
        read_yaml(path)
    config = _numbers(_merge(read_yaml(BASE), overlay or {}))
    check_schema(config)
    for target in config["targets"].values():
        target |= {key: _found(target[key]) for key in ("mesh", "field") if key in target}
    _inherit(config)
    config = _checked(config, overlay or {})
    # More bands than frequencies would leave some empty; the order of SNRs has no meaning.
    config["mesh"]["bands"] = min(config["mesh"]["bands"], config["radar"]["frequencies"])
    config["noise"]["snr_db"] = sorted(config["noise"]["snr_db"])
    # Nor has the order of choices.
    for settings in config["learning"]["models"].values():
        settings |= {key: sorted(value) for key, value in settings.items() if isinstance(value, list)}
    return config


def section(config, *keys):
    """The named parts of the config as one plain mapping with sorted keys, for a rule's params.

    Keys may be dotted. Snakemake compares params by their text, so the order in the file must not matter.
    """
    return {key: _sorted(_get(config, key)) for key in sorted(keys)}


def _found(path):
    """Where a path of the config leads (or each of several): from the working folder, or else from the repository."""
    if isinstance(path, dict):
        return {key: _found(one) for key, one in path.items()}
    if isinstance(path, list):
        return [_found(one) for one in path]
    return path if Path(path).exists() or not (ROOT / path).exists() else os.path.relpath(ROOT / path)


def _merge(base, overlay, path=""):
    if not isinstance(base, dict) or not isinstance(overlay, dict) or path in COLLECTIONS:
        return overlay
    if path in ALTERNATIVES and not set(overlay) <= set(base):
        return overlay
    if path == "scattering" and overlay.get("solver", base["solver"]) != base["solver"]:
        return overlay  # another solver has other settings
    merged = dict(base)
    for key, value in overlay.items():
        merged[key] = _merge(base.get(key), value, f"{path}.{key}" if path else str(key))
    return merged


def _checked(config, overlay):
    """Check the config; gives it back, without those of the default experiments that its sweep or SNRs do not allow.

    Nobody asked for those; one that the user's config names is refused instead.
    """
    try:
        check(config)
        return config
    except InputError as error:
        if "experiments" in overlay.get("learning", {}):
            raise
        left_out, experiments = {}, _spread(config["learning"]["experiments"], config["noise"]["snr_db"])
        for name in experiments:
            try:
                check(_with_experiments(config, {name: experiments[name]}))
            except InputError as reason:
                left_out[name] = str(reason)
        if len(left_out) == len(experiments):
            raise error from None
        reduced = _with_experiments(config, {name: experiments[name] for name in experiments if name not in left_out})
        check(reduced)
        if left_out:
            reduced["learning"]["left_out"] = left_out
        return reduced


def _with_experiments(config, experiments):
    return {**config, "learning": {**config["learning"], "experiments": experiments}}


def _spread(experiments, snr_db):
    """The default experiments: those over a range of SNRs at those of it that noise.snr_db has, if two or more."""
    spread = {name: {**what, "train": dict(what["train"])} for name, what in experiments.items()}
    for experiment in spread.values():
        wanted = experiment["train"]["snr_db"]
        if isinstance(wanted, dict):
            kept = {kind: [snr for snr in snrs if snr == CLEAN or snr in snr_db] for kind, snrs in wanted.items()}
            if all(len(set(snrs) - {CLEAN}) > 1 for snrs in kept.values()):
                experiment["train"]["snr_db"] = kept
    return spread


def _inherit(config):
    """Give a model whose `kind` is another model that one's settings where it has none of its own."""
    models = config["learning"]["models"]
    config["learning"]["models"] = {
        name: {**models.get(settings.get("kind"), {}), **settings} for name, settings in models.items()
    }


def _numbers(value):
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_numbers(item) for item in value]
    if isinstance(value, str) and EXPONENT.fullmatch(value):
        value = float(value)
    # 2.0 counts as a whole number, and is one from here on; frequencies in Hz stay what they are.
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e6:
        return int(value)
    return value


def _sorted(value):
    if isinstance(value, dict):
        return {key: _sorted(value[key]) for key in sorted(value)}
    return value


def _get(config, dotted):
    for key in dotted.split("."):
        config = config[key]
    return config
