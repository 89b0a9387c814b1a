"""Load a config, lay overlays over it and check it, before any work is done."""

import difflib
import re
from pathlib import Path

import jsonschema
import numpy as np
import yaml

from common import radar as sweep
from common.errors import InputError

ROOT = Path(__file__).resolve().parents[3]
BASE = ROOT / "config" / "config.yaml"
SCHEMA = ROOT / "config" / "schema.yaml"

# An overlay that names one of these replaces all of it: it holds things that the user names.
COLLECTIONS = ("targets", "learning.experiments")
# Of these an overlay's form may differ from the base's ({count} or {start, stop, step}).
ALTERNATIVES = ("aspect.azimuth",)
# YAML 1.1 reads 2.775e9 (no sign in the exponent) as text; everyone means the number.
EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")
MESH_FORMATS = (".stl", ".obj", ".ply", ".off")


def load(overlay=None):
    """The full, checked config: config/config.yaml with `overlay` (a mapping) laid over it.

    Raises InputError with one message that names the key, its value and what would be right.
    """
    config = _numbers(_merge(yaml.safe_load(BASE.read_text()), overlay or {}))
    check(config)
    return config


def check(config):
    """Raise InputError for the first thing wrong with a full config."""
    schema = yaml.safe_load(SCHEMA.read_text())
    errors = jsonschema.Draft202012Validator(schema).iter_errors(config)
    error = min(errors, key=lambda e: (_is_unknown_key(e) is False, len(e.absolute_path)), default=None)
    if error is not None:
        raise InputError(_message(error))
    _check_sweep(config)
    _check_targets(config["targets"])
    _check_experiments(config)


def section(config, *keys):
    """The named parts of the config as one plain mapping with sorted keys, for a rule's params.

    Keys may be dotted. Snakemake compares params by their text, so the order in the file must not matter.
    """
    return {key: _sorted(_get(config, key)) for key in sorted(keys)}


def images_are_made(config):
    """False for a sweep that cannot make an image (one frequency): then scattering is an RCS solver."""
    return config["radar"]["frequencies"] > 1


def _merge(base, overlay, path=""):
    if not isinstance(base, dict) or not isinstance(overlay, dict) or path in COLLECTIONS:
        return overlay
    if path in ALTERNATIVES and not set(overlay) <= set(base):
        return overlay
    merged = dict(base)
    for key, value in overlay.items():
        merged[key] = _merge(base.get(key), value, f"{path}.{key}" if path else str(key))
    return merged


def _numbers(value):
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_numbers(item) for item in value]
    if isinstance(value, str) and EXPONENT.fullmatch(value):
        return float(value)
    return value


def _sorted(value):
    if isinstance(value, dict):
        return {key: _sorted(value[key]) for key in sorted(value)}
    return value


def _get(config, dotted):
    for key in dotted.split("."):
        config = config[key]
    return config


def _is_unknown_key(error):
    return error.validator == "additionalProperties"


def _message(error):
    path = ".".join(str(part) for part in error.absolute_path)
    where = f"config key '{path}'" if path else "config"
    rule = error.schema.get("description", "") if isinstance(error.schema, dict) else ""
    if error.validator == "additionalProperties":
        known = sorted(error.schema.get("properties", {}))
        unknown = next(key for key in error.instance if key not in known)
        path = f"{path}.{unknown}" if path else str(unknown)
        near = difflib.get_close_matches(str(unknown), known, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        return f"config key '{path}' is unknown{hint} Known keys here: {', '.join(known)}."
    if error.validator == "required":
        missing = next(key for key in error.validator_value if key not in error.instance)
        path = f"{path}.{missing}" if path else missing
        return f"config key '{path}' is missing."
    if error.validator in ("oneOf", "not") or not error.message:
        problem = f"{error.instance!r} is not allowed"
    else:
        problem = error.message
    return f"{where}: {problem}." + (f" Expected: {rule}." if rule else "")


def _check_sweep(config):
    radar, aspect, imaging = config["radar"], config["aspect"], config["imaging"]
    if radar["frequencies"] == 1 and radar["bandwidth"] != 0:
        raise InputError("config key 'radar.bandwidth' must be 0 when 'radar.frequencies' is 1.")
    if radar["frequencies"] > 1 and radar["bandwidth"] == 0:
        raise InputError("config key 'radar.bandwidth' is 0 but 'radar.frequencies' is more than 1.")
    if radar["bandwidth"] >= 2 * radar["center_frequency"]:
        raise InputError(
            f"config key 'radar.bandwidth': {radar['bandwidth']:g} Hz reaches below 0 Hz; "
            f"it must be less than twice 'radar.center_frequency' ({radar['center_frequency']:g} Hz)."
        )
    if config["mesh"]["bands"] > radar["frequencies"]:
        config["mesh"]["bands"] = radar["frequencies"]
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
        raise InputError("config key 'aspect.azimuth' covers more than 360 degrees; write {count: ...} for a circle.")
    if images_are_made(config) and imaging["aperture"] > len(azimuths):
        raise InputError(
            f"config key 'imaging.aperture': {imaging['aperture']} samples are more than the sweep's "
            f"{len(azimuths)} azimuths ('aspect.azimuth')."
        )


def _check_steps(key, angles, limit):
    if "count" in angles:
        return
    start, stop, step = angles["start"], angles["stop"], angles["step"]
    if not -limit <= start <= stop <= limit:
        raise InputError(
            f"config key '{key}': start {start} to stop {stop} must ascend within -{limit} to {limit} degrees."
        )
    last = sweep.stepped(start, stop, step)[-1]
    if not np.isclose(last, stop):
        raise InputError(
            f"config key '{key}': steps of {step} degrees from {start} do not end at stop {stop}, but at {last:g}."
        )


def _check_targets(targets):
    for name, target in targets.items():
        mesh = Path(target["mesh"])
        key = f"config key 'targets.{name}.mesh'"
        if mesh.suffix.lower() not in MESH_FORMATS:
            raise InputError(f"{key}: {mesh} is not one of {', '.join(MESH_FORMATS)}.")
        if not mesh.is_file():
            raise InputError(f"{key}: there is no file {mesh} (paths start at the folder you run snakemake in).")


def _check_experiments(config):
    experiments = config["learning"]["experiments"] if images_are_made(config) else {}
    known = [name for name, target in config["targets"].items() if target["role"] == "known"]
    elevations = sweep.elevations(config["aspect"])
    for name, experiment in experiments.items():
        key = f"config key 'learning.experiments.{name}"
        if len(known) < 2:
            raise InputError(
                f"{key}' needs at least two targets with role known; there are {len(known)}. "
                "Write 'learning: {experiments: {}}' to stop after the images."
            )
        train = experiment["train"]
        if train["snr_db"] != "clean" and train["snr_db"] not in config["noise"]["snr_db"]:
            raise InputError(f"{key}.train.snr_db': {train['snr_db']} is not in noise.snr_db.")
        if train["elevation"] != "all":
            for angle in train["elevation"]:
                if not np.isclose(elevations, angle).any():
                    raise InputError(
                        f"{key}.train.elevation': {angle} degrees is not one of the sweep's elevations "
                        f"({', '.join(f'{e:g}' for e in elevations)})."
                    )
