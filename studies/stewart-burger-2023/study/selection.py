"""Which results of a run the page needs. Its rule reads it too, so that only these files are the job's inputs."""

from pathlib import Path

import yaml

from isarflow.core.sweep import snr_label
from isarflow.report.selection import nearest, target_order

PAGE = yaml.safe_load((Path(__file__).parents[1] / "page.yaml").read_text())  # its head says what it has
HIGH_SNR, LOW_SNR = 24, -6  # dB, of its figures


def networks_of(runs):
    """Return (run, model) of the networks of `experiments.runs` that are judged anew: open ones, split at random."""
    alike = [name for name, run in runs.items() if run["open"] and run["split"] == "random"]
    named = [tuple(name.split("/")) for name in PAGE["networks"]]
    return [(run, model) for run, model in named if run in alike and model in runs[run]["models"]]


def images_of(settings, runs):
    """Return (target, label of the SNR) of the stores of images that the page takes pictures and facts from.

    Those of known and unknown targets without noise; of the known ones near -6 dB; and near 24 dB of both, if a fully
    connected network is there to classify them all. settings: the config's sections.
    """
    targets, snrs = settings["targets"], settings["noise"]["snr_db"]
    opened = [name for name in target_order(targets) if targets[name]["role"] in ("known", "unknown")]
    stores = [(name, "clean") for name in opened]
    stores += [(name, snr_label(nearest(snrs, LOW_SNR))) for name in opened if targets[name]["role"] == "known"]
    if any(model.startswith("fcnn") for _, model in networks_of(runs)):
        stores += [(name, snr_label(nearest(snrs, HIGH_SNR))) for name in opened]
    return list(dict.fromkeys(stores))
