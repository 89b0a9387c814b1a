"""Which of the results the report shows. The rule reads it too, so that only these files are the job's inputs."""

from isarflow.core.sweep import evenly, snr_label
from isarflow.learning.experiments import ROLES, imaged

GALLERY_VIEWS = 8  # images of each target over azimuth, and of one over elevation
DECODED_SNRS = (3, 24)  # dB
GALLERY_SNRS = 7  # noisy images of one target, beside the clean one
TABLE_SNRS = 7  # columns of the accuracy table
# The runs of full size whose scores the repository keeps, by name, and the folder of each.
FULL_SIZE = {"thesis": "resources/results", "recognition": "resources/results/recognition"}
KINDS = "resources/results/kinds/scores.csv.xz"  # of the run by family


def full_size(name):
    """Return the scores of the full-size runs other than that of this name: by run, their paths in the repository."""
    return {run: f"{folder}/scores.csv.xz" for run, folder in FULL_SIZE.items() if run != name}


def target_order(targets):
    """Return target names in the order of the page: by role, then by name. The first is shown at several SNRs."""
    return sorted(imaged({"targets": targets}), key=lambda name: (ROLES.index(targets[name]["role"]), name))


def drawn(targets):
    """Return the targets that are drawn, in the page's order: of those of a role that state one kind, the first."""
    first = {}
    for name in target_order(targets):
        first.setdefault((targets[name]["role"], targets[name].get("kind", f"{name} alone")), name)
    return list(first.values())


def in_full(targets):
    """Return the targets that a table has row by row: all but the further models of a family."""
    first = drawn(targets)
    return [name for name in targets if "family" not in targets[name] or name in first]


def nearest(values, aim):
    """Return of these values that nearest to another, the lower of two."""
    return min(values, key=lambda value: (abs(value - aim), value))


def decoded_snrs(snr_db):
    """Return the SNRs in dB at which reconstructions are shown: near 24 and near 3 dB."""
    return sorted({nearest(snr_db, aim) for aim in DECODED_SNRS})


def noise_snrs(snr_db):
    """Return the SNRs in dB at which one target is shown, as they are written in the config."""
    return evenly(snr_db, GALLERY_SNRS)


def images_shown(settings):
    """Return (target, store) of the images on the page: of targets that are drawn, of the first with noise, too."""
    first, snrs = target_order(settings["targets"])[0], noise_snrs(settings["noise"]["snr_db"])
    return [(target, "clean") for target in drawn(settings["targets"])] + [(first, snr_label(snr)) for snr in snrs]
