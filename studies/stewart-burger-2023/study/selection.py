"""Which results of a run the page needs. Its rule reads it too, so that only these files are the job's inputs."""

from isarflow.core.sweep import snr_label
from isarflow.report.selection import nearest, target_order

# Its networks in the open set, by run and model.
NETWORKS = (
    *((run, model) for run in ("fcnn_open", "fcnn_listing") for model in ("fcnn", "fcnn_other")),
    ("capsule_open", "capsule"),
    ("capsule_open", "capsule_long"),
    ("capsule_listing", "capsule_listing"),
)
HIGH_SNR, LOW_SNR = 24, -6  # dB, of its figures
ROLES_OPENED = (("known",), ("known", "unknown"))  # of the closed and of the open set


def networks_of(runs):
    """(run, model) of the networks whose predictions the page of the thesis judges anew: open ones, split at random.

    runs: what `learning.experiments.runs` gives.
    """
    return [
        (run, model)
        for run, model in NETWORKS
        if run in runs and model in runs[run]["models"] and runs[run]["open"] and runs[run]["split"] == "random"
    ]


def images_of(settings, runs):
    """(target, label of the SNR) of the stores of images that the page of the thesis takes pictures and facts from.

    Those of known and unknown targets without noise; of the known ones near -6 dB; and near 24 dB of both, if a fully
    connected network is there to classify them all. settings: the config's sections.
    """
    roles = {name: target["role"] for name, target in settings["targets"].items()}
    known, opened = ([name for name in target_order(settings["targets"]) if roles[name] in of] for of in ROLES_OPENED)
    snrs = settings["noise"]["snr_db"]
    stores = [(name, "clean") for name in opened]
    stores += [(name, snr_label(nearest(snrs, LOW_SNR))) for name in known]
    if everywhere_networks(runs):
        stores += [(name, snr_label(nearest(snrs, HIGH_SNR))) for name in opened]
    return list(dict.fromkeys(stores))


def everywhere_networks(runs):
    """Of `networks_of` those that classify the images of all azimuths, too: the fully connected ones."""
    return [(run, model) for run, model in networks_of(runs) if model.startswith("fcnn")]
