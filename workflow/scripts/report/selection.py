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
MISTAKEN = (
    "likelihood",
    "adaptive_filter",
    "matched_filter",
    "capsule",
    "fcnn",
    "knn",
)  # whose mistakes are shown, the first it has


def target_order(targets):
    """Target names in the order of the page: by role, then by name."""
    return sorted(targets, key=lambda name: (ROLES.index(targets[name]["role"]), name))


def noise_target(targets):
    """The one target that is shown at several SNRs."""
    return target_order(targets)[0]


def noisy_targets(targets, runs):
    """Names of the targets that are shown at several SNRs: those that a run is tested on, and the one above.

    runs: what `learning.experiments.runs` gives.
    """
    roles = {role for run in runs.values() for role in (ROLES if run["open"] else ("known",))}
    return [name for name in target_order(targets) if targets[name]["role"] in roles or name == noise_target(targets)]


def evenly(values, count):
    """At most `count` of the sorted values, evenly spread, the first and the last among them."""
    values = sorted(values)
    picks = np.unique(np.linspace(0, len(values) - 1, min(count, len(values))).round().astype(int))
    return [values[pick] for pick in picks]


def around(size, count):
    """At most `count` of `size` azimuths by number, evenly spread as on a circle: the last is not the first again."""
    return np.unique(np.arange(count) * size // count)


def nearest(snr_db, aim):
    """Of these SNRs in dB that nearest to another, the lower of two."""
    return min(snr_db, key=lambda snr: (abs(snr - aim), snr))


def decoded_snrs(snr_db):
    """The SNRs in dB at which reconstructions and the scores that follow from them are shown: near 24 and near 3 dB."""
    return sorted({nearest(snr_db, aim) for aim in DECODED_SNRS})


def noise_snrs(snr_db):
    """The SNRs in dB at which the one target is shown, as they are written in the config."""
    return evenly(snr_db, GALLERY_SNRS)


def mistaken(runs):
    """(run, model) of which the page shows what was mistaken: an open run, of those the first of SPLITS that there is.

    runs: what `learning.experiments.runs` gives. The first of its experiment; of its models the best that is known.
    """
    first = [name for name, run in sorted(runs.items()) if run["first"]]

    def place(name):
        asked = [number for number, model in enumerate(MISTAKEN) if model in runs[name]["models"]]
        return not runs[name]["open"], SPLITS.index(runs[name]["split"]), *(asked or [len(MISTAKEN)])

    run = min(first, key=place)
    models = runs[run]["models"]
    return run, next((model for model in MISTAKEN if model in models), models[0])


def mistaken_snr(snr_db):
    """The SNR in dB of the same: of those that have images on the page that nearest 3 dB."""
    return nearest(noise_snrs(snr_db), DECODED_SNRS[0])


def images_shown(settings, runs):
    """(target, store) of the images that the page shows: all targets without noise, those with some at some SNRs.

    settings: the config's sections; runs: what `learning.experiments.runs` gives.
    """
    shown = [(target, "clean") for target in settings["targets"]]
    for target in noisy_targets(settings["targets"], runs):
        shown += [(target, snr_label(snr)) for snr in noise_snrs(settings["noise"]["snr_db"])]
    return shown


def predictions_shown(settings, runs, decoders):
    """(run/model, SNR's label) of the predictions that the page shows something of, image by image.

    decoders: the models with a decoder, <run>/<model>.
    """
    snrs = settings["noise"]["snr_db"]
    shown = {(fitted, snr_label(snr)) for fitted in decoders for snr in decoded_snrs(snrs)}
    if runs:
        run, model = mistaken(runs)
        shown.add((f"{run}/{model}", snr_label(mistaken_snr(snrs))))
    return sorted(shown)
