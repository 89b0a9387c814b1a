"""Which of the results the report shows. The rule reads it too, so that only these files are the job's inputs."""

import numpy as np

from isarflow.core.sweep import snr_label

ROLES = ("known", "unknown", "other")
SPLITS = ("elevation", "sector", "random", "shuffled")  # in the order of the page
GALLERY_AZIMUTHS = 8  # images of each target
GALLERY_ELEVATIONS = 8  # images of one target
DECODED_SNRS = (3, 24)  # dB
GALLERY_SNRS = 7  # noisy images of one target, beside the clean one
TABLE_SNRS = 7  # columns of the accuracy table
# Models whose mistakes are shown, the first that a run has.
MISTAKEN = ("likelihood", "adaptive_filter", "matched_filter", "capsule", "fcnn", "knn")


def target_order(targets):
    """Return target names in the order of the page: by role, then by name."""
    return sorted(targets, key=lambda name: (ROLES.index(targets[name]["role"]), name))


def noise_target(targets):
    """Return the one target that is shown at several SNRs."""
    return target_order(targets)[0]


def noisy_targets(targets, runs):
    """Return names of the targets that have images with noise: those that a run is tested on, and the one above.

    runs: what `learning.experiments.runs` gives.
    """
    roles = {role for run in runs.values() for role in (ROLES if run["open"] else ("known",))}
    return [name for name in target_order(targets) if targets[name]["role"] in roles or name == noise_target(targets)]


def evenly(values, count):
    """Return at most `count` of the sorted values, evenly spread, the first and the last among them."""
    values = sorted(values)
    picks = np.unique(np.linspace(0, len(values) - 1, min(count, len(values))).round().astype(int))
    return [values[pick] for pick in picks]


def around(size, count):
    """Return at most `count` of `size` azimuths by number, evenly spread on a circle: the last is not the first."""
    return np.unique(np.arange(count) * size // count)


def nearest(snr_db, aim):
    """Return of these SNRs in dB that nearest to another, the lower of two."""
    return min(snr_db, key=lambda snr: (abs(snr - aim), snr))


def decoded_snrs(snr_db):
    """Return the SNRs in dB at which reconstructions are shown: near 24 and near 3 dB."""
    return sorted({nearest(snr_db, aim) for aim in DECODED_SNRS})


def noise_snrs(snr_db):
    """Return the SNRs in dB at which the one target is shown, as they are written in the config."""
    return evenly(snr_db, GALLERY_SNRS)


def mistaken(runs):
    """Return (run, model) of which the page shows what was mistaken.

    runs: what `learning.experiments.runs` gives. An open run, if there is one, of those the first of SPLITS that there
    is, and the first of its experiment; of its models the best that is known.
    """

    def rank(model):
        return MISTAKEN.index(model) if model in MISTAKEN else len(MISTAKEN)

    def place(name):
        run = runs[name]
        return not run["first"], not run["open"], SPLITS.index(run["split"]), min(map(rank, run["models"])), name

    run = min(runs, key=place)
    return run, min(runs[run]["models"], key=rank)


def mistaken_snr(snr_db):
    """Return the SNR in dB of the same: of those that have images on the page that nearest 3 dB."""
    return nearest(noise_snrs(snr_db), DECODED_SNRS[0])


def images_shown(settings, runs):
    """Return (target, store) of the images on the page: all targets without noise, those with some at some SNRs.

    settings: the config's sections; runs: what `learning.experiments.runs` gives.
    """
    shown = [(target, "clean") for target in settings["targets"]]
    for target in noisy_targets(settings["targets"], runs):
        shown += [(target, snr_label(snr)) for snr in noise_snrs(settings["noise"]["snr_db"])]
    return shown


def predictions_shown(settings, runs):
    """Return (run/model, SNR's label) of the predictions that the page shows something of, image by image."""
    return [("/".join(mistaken(runs)), snr_label(mistaken_snr(settings["noise"]["snr_db"])))] if runs else []
