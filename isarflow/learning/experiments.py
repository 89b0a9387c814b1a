"""The experiments of a config, one by one: training and test images of each run."""

import itertools
from dataclasses import asdict

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.kinds import of_model
from isarflow.core.sweep import snr_label, snr_of_label
from isarflow.learning.classifier import PLUS
from isarflow.learning.data.split import divisions

CLEAN = "clean"
MOVED = ", moved"  # after the name of a split
ROLES = "known", "unknown", "other"  # of targets that have images; further poses of one are solved alone
TOLERANCE = 1e-4  # degrees: two angles nearer than this are the same one
# The parts of a run that its models depend on. The rest (its models, whether it is open) may change without a new fit.
LEARNED = "channels", "division", "elevation", "experiment", "motion", "name", "random_snr"
LEARNED += "snrs", "split", "upsample", "without"

# The reference thesis's method of the open set: model, training SNR, confidence score. Others are compared with it.
REFERENCE = ("capsule", "clean", "zncc")


def runs(config):
    """Every run of a config's experiments: a mapping of its name, also its folder's, to its description.

    An experiment is one run. Exceptions: `snr_db: {each: [...]}` is a run for each SNR: <experiment>_<label>; a split
    with folds is a run for each: <experiment>_fold<number>.
    A run is a mapping of its name, experiment (that one's name), models, elevation (a list of degrees, or all), snrs
    (those of the training images, numbers or 'clean'), tested (SNRs in dB that it is tested at if there are images, or
    all), random_snr (whether each batch is drawn from one of them), open (whether unknown targets are tested, as there
    are some), split (a scheme, by family with what others are), division (the fields of its `Division`), first
    (whether its fold is the experiment's first), upsample (pixels a side, or none), channels (a list of polarizations,
    or all), without (the known targets that do not train) and motion (as of `motion_of`).
    InputError for two runs of one name.
    """
    every, learning = {}, config["learning"]
    targets = {name: _family(config["targets"], name) for name in imaged(config)}
    for name, experiment in learning["experiments"].items():
        elevation, snr = (experiment["train"][key] for key in ("elevation", "snr_db"))
        split = split_settings(learning, experiment)
        kind, values = next(iter(snr.items())) if isinstance(snr, dict) else ("all", snr)
        values = sorted(values, key=lambda snr: (snr != CLEAN, snr)) if isinstance(values, list) else [values]
        shared = {
            "experiment": name,
            "models": experiment["models"],
            "elevation": elevation if elevation == "all" else sorted(elevation),
            "tested": sorted(experiment["test"]["snr_db"]) if "test" in experiment else "all",
            "random_snr": kind == "random",
            "open": experiment.get("open", False)
            and any(target["role"] in rejected_roles(split["scheme"]) for target in targets.values()),
            "split": split["scheme"] + (f", {split['others']} others" if split["scheme"] == "family" else ""),
            "upsample": experiment.get("upsample", "none"),
            "channels": sorted(experiment["channels"]) if "channels" in experiment else "all",
            "without": sorted(experiment.get("without", [])),
            "motion": motion_of(config, experiment),
        }
        trainings = {f"{name}_{label(snr)}": [snr] for snr in values} if kind == "each" else {name: values}
        every_fold = divisions(split["scheme"], split, config["seed"], config["imaging"]["aperture"], targets)
        tested = [division for division in every_fold if division.fold in experiment.get("folds", [division.fold])]
        for (trained, snrs), division in itertools.product(trainings.items(), tested):
            run = f"{trained}_fold{division.fold}" if division.fold else trained
            if run in every:
                also = f"its run {run} is also one of '{every[run]['experiment']}'"
                raise InputError(f"config key 'learning.experiments.{name}': {also}; give one another name.")
            own = {"name": run, "snrs": snrs, "division": asdict(division), "first": division is tested[0]}
            every[run] = shared | own
    return every


def imaged(config):
    """The names of a config's targets but the further poses of those that move."""
    return [name for name, target in config["targets"].items() if target["role"] in ROLES]


def members(models, name):
    """The names of the models of the same run that a model combines; [] of any other. models: `learning.models`."""
    return models[name]["of"].split(PLUS) if of_model(models, name).stated.get("combines", False) else []


def split_settings(learning, experiment):
    """The settings of an experiment's split: those of `learning.split`, and what it says of its own."""
    own = experiment.get("split", {})
    return learning["split"] | (own if isinstance(own, dict) else {"scheme": own})


def _family(targets, name):
    return {"role": targets[name]["role"], "class": class_of(targets, name), "kind": kind_of(targets, name)}


def rejected_roles(scheme):
    """The roles of targets that a test by this scheme is to reject."""
    return ("unknown", "other") if scheme == "family" else ("unknown",)


def motion_of(config, experiment):
    """The motion of an experiment's noisy images, a mapping; {} if nothing in the config moves.

    folder: of these images, `imaging` for those that move as the config's section says; limits: those that are not 0,
    by name; frequencies: the first and the last in Hz, and their number; step: of the azimuths, in degrees; imaging:
    the config's section.
    """
    shared = {key: limit for key, limit in sorted(config["motion"].items()) if limit}
    limits = {key: limit for key, limit in sorted((shared | experiment.get("motion", {})).items()) if limit}
    if not (shared or limits):
        return {}
    named = [f"{key}_{limit if isinstance(limit, str) else f'{limit:g}'}" for key, limit in limits.items()]
    label = "_".join(named) or "still"
    frequencies, azimuths = sweep.frequencies(config["radar"]), sweep.azimuths(config["aspect"])
    return {
        "folder": "imaging" if limits == shared else f"moved/{label}",
        "limits": limits,
        "frequencies": [float(frequencies[0]), float(frequencies[-1]), len(frequencies)],
        "step": float(azimuths[1] - azimuths[0]),
        "imaging": dict(sorted(config["imaging"].items())),
    }


def is_by_family(run):
    """Tell whether whole models are on one side of a run's split."""
    return run["split"].startswith("family")


def split_of(run):
    """The split of a run as tables name it, with MOVED where its targets move."""
    return run["split"] + (MOVED if run["motion"].get("limits") else "")


def class_of(targets, name):
    """The class that models learn of a known target, of the config's `targets`: that which it states, or its name."""
    return targets[name].get("class", name)


def kind_of(targets, name):
    """The kind of a target of the config's `targets`: that which it states, as models of families do, or its class."""
    return targets[name].get("kind", class_of(targets, name))


def channels_of(run, every):
    """Number of channels of a run's images, of `every` channels that there are."""
    return every if run["channels"] == "all" else len(run["channels"])


def label(snr):
    """The name of the store of images at an SNR in dB, or without noise ('clean')."""
    return CLEAN if snr == CLEAN else snr_label(snr)


def cleanest(labels):
    """The name with the least noise, of names of SNRs as `label` gives them; any other name counts as most noise."""
    levels = {name: snr_of_label(name) if name.startswith("snr_") else -np.inf for name in set(labels)}
    return CLEAN if CLEAN in levels else max(levels, key=levels.get)


def training(run):
    """The SNRs that a run trains at, in words that tell the runs of an experiment apart.

    '6 dB'; of several at once 'all: clean, -24 to 24 dB by 3', or 'random: ...' where each batch has one.
    """
    words = snrs_in_words(run["snrs"])
    if run["random_snr"]:
        return f"random: {words}"
    return f"all: {words}" if len(run["snrs"]) > 1 else words


def train_snr_db(run):
    """The one SNR in dB that a run trains at; NaN for images without noise, and for several SNRs."""
    return np.nan if len(run["snrs"]) > 1 or CLEAN in run["snrs"] else float(run["snrs"][0])


def snrs_in_words(snrs):
    """SNRs in dB, or 'clean', in words: three or more in equal steps as a range, '-24 to 24 dB by 3'."""
    rest = sorted(snr + 0.0 for snr in snrs if snr != CLEAN)  # + 0.0: no minus before a zero
    words = [CLEAN] if CLEAN in snrs else []
    while rest:
        steps = np.diff(rest)
        # Number of equal steps from the first SNR on.
        equal = int(np.argmin(np.append(np.isclose(steps, steps[:1]), False)))
        equal = equal if equal > 1 else 0
        words.append(f"{rest[0]:g} to {rest[equal]:g} dB by {steps[0]:g}" if equal else f"{rest[0]:g} dB")
        rest = rest[equal + 1 :]
    return ", ".join(words)


def labels_in_words(labels):
    """Names of SNRs, as `label` gives them, in words as of `snrs_in_words`."""
    return snrs_in_words([CLEAN if name == CLEAN else snr_of_label(name) for name in labels])


def megabytes(images, pixels, covariances, pairs):
    """Memory of a job of a model, in MB: 1000 for the libraries, and its images of so many pixels in all channels.

    Of each image there are complex64 pixels and three copies of its real and imaginary parts in double precision, as
    libraries make them. pairs: True if the model keeps a number in double precision for each pair of images, and
    500 MB of them in another form. covariances: number of SNRs with a matrix of pixels by pixels in the model, 0 for
    none. Of each of these there are two in single precision, and four in double of the one that is being learned.
    """
    matrices = 4 * 16 + 2 * 8 * covariances if covariances else 0
    kernel = 500 + 8 * images**2 / 1e6 if pairs else 0
    return 1000 + kernel + (images * pixels * (8 + 3 * 16) + matrices * pixels**2) / 1e6


def training_noise(snr_db):
    """Return the training SNRs of an experiment's config in words."""
    if not isinstance(snr_db, dict | list):
        return "without noise" if snr_db == "clean" else f"at an SNR of {snr_db:g} dB"
    (kind, values), *_ = snr_db.items() if isinstance(snr_db, dict) else [("all", snr_db)]
    how = {"each": "at each of several SNRs, a model for each", "random": "at an SNR drawn for each batch"}
    return f"{how.get(kind, 'at several SNRs at once')} ({snrs_in_words(values)})"
