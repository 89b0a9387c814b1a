"""What is recognised over how far targets are displaced, and drift, by search and by focus: `make bench-motion`.

The dataset at full size and at one SNR: drone and missile known, aircraft and ufo to be rejected, the first fold by
elevation. The likelihood takes each image as it is, searches the place, or the place and the drift; or the image is
focused first, and its place is searched. Thresholds keep 95 % of validation images that moved likewise. Tables go to
results/benchmarks/motion.csv, a figure to motion.png beside it.
"""

import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import xarray as xr
from runner import options_of, show
from sklearn.metrics import f1_score, roc_auc_score

from isarflow.imaging.formation import apertures
from isarflow.imaging.geometry import focus_of
from isarflow.imaging.motion import Motion, displaced, draw
from isarflow.imaging.noise import signal_power, white_noise
from isarflow.learning.classifier import OTHER, build_classifier
from isarflow.learning.data.features import of_peak_one
from isarflow.learning.data.moves import Moves
from isarflow.learning.data.split import Division, split
from isarflow.learning.evaluation.metrics import KEPT_SHARE

KNOWN, UNKNOWN = ("drone", "missile"), ("aircraft", "ufo")
IMAGING = {"imager": "fourier", "window": "hamming", "reformat": "polar", "upsample": "none", "focus": "none"}
IMAGING |= {"aperture": 21, "polarizations": ["VV", "HH", "HV"]}
LIKELIHOOD = {"candidates": 8, "mismatch": 0.03}  # as config/config.yaml
REJECTING = 1 / 3  # weighted F1 of half the images being unknown, and all rejected
SNR, NOISES = 12, 2000  # dB of the mean power of VV; images of noise alone
CELL = 0.05  # m, in range
PLACES = (0, 0.25, 0.5, 1, 2, 3, 4)  # cells
DRIFTS, PLACE = (0, 0.25, 0.5, 1, 1.5, 2), 0.1  # wavelengths; m, two cells, within which these targets are displaced
METHODS = {  # of the figure: which errors are searched, and how images are focused before
    "as it is": ((), "none"),
    "place searched": (("place",), "none"),
    "place and drift searched": (("place", "drift"), "none"),
    "focused by entropy, place searched": (("place",), "entropy"),
}


class Sweep:
    """Samples (n, channel, F * A) of views that train, random ones that validate and test, and their targets."""

    def __init__(self, count):
        parts, random = {}, np.random.default_rng(0)
        division = Division("elevation", 1, {"spacing": 0}, 0, IMAGING["aperture"])
        for target in (*KNOWN, *UNKNOWN):
            field = xr.open_zarr(Path("resources/fields", f"{target}.zarr")).field
            field = field.sel(polarization=IMAGING["polarizations"]).load()
            self.frequency, self.azimuth = field.frequency.values, field.azimuth.values
            sides = split(field.elevation.values, self.azimuth, ("xz",), division, target)
            for side in ("train", "validation", "test") if target in KNOWN else ("test",):
                of_elevations = field.isel(elevation=sides[side].elevation).transpose("elevation", ...).values
                made = np.concatenate([apertures(one, self.azimuth, IMAGING["aperture"]) for one in of_elevations])
                parts.setdefault(side, []).append(made if side == "train" else random.permutation(made)[:count])
                parts.setdefault(f"{side} targets", []).extend([target] * len(parts[side][-1]))
        self.samples = {side: np.concatenate(parts[side]) for side in ("train", "validation", "test")}
        self.targets = {side: np.array(parts[f"{side} targets"]) for side in self.samples}
        self.still = self.moves({})

    def moves(self, limits):
        """The `Moves` of the sweep, within the limits of a motion."""
        frequencies = [self.frequency[0], self.frequency[-1], len(self.frequency)]
        step = self.azimuth[1] - self.azimuth[0]
        return Moves({"limits": limits, "frequencies": frequencies, "step": step, "imaging": IMAGING})

    def moved(self, side, limits, focus):
        """Images of a side under a motion, with noise, focused."""
        samples, random = self.samples[side], np.random.default_rng(1)
        errors = draw(Motion(**limits), [(side, number) for number in range(len(samples))], IMAGING["aperture"])
        variance = signal_power(samples[:, 0], "mean") / 10 ** (SNR / 10)
        noise = [white_noise(variance, samples.shape[-1], random) for _ in IMAGING["polarizations"]]
        moved = displaced(samples, self.frequency, self.still.angle, errors) + np.stack(noise, axis=1)
        moved = focus_of(self.frequency, self.azimuth, IMAGING | {"focus": focus})(moved.astype(np.complex64))
        return of_peak_one(self.still.images(moved))

    def fitted(self):
        """The likelihood, of the views that train."""
        model, samples = build_classifier("likelihood", LIKELIHOOD, 0), self.samples["train"]
        _, channels, count = samples.shape
        noise = white_noise(np.ones(NOISES * channels), count, np.random.default_rng(2))
        model.noise = self.still.images(noise.reshape(NOISES, channels, count).astype(np.complex64))
        return model.fit(of_peak_one(self.still.images(samples)), self.targets["train"])


def row(sweep, model, limits, method):
    """What is recognised under a motion by a method of METHODS."""
    searched, focus = METHODS[method]
    model.moves = sweep.moves({name: limit for name, limit in limits.items() if name in searched}) if searched else None
    vars(model).pop("_search", None)  # within other limits
    outcomes = {}
    for side in ("validation", "test"):
        start, images = time.process_time(), sweep.moved(side, limits, focus)
        outcomes[side] = model.evaluate(images)
    seconds = time.process_time() - start
    threshold = np.quantile(outcomes["validation"].known["likelihood"], 1 - KEPT_SHARE)
    score, truth = outcomes["test"].known["likelihood"], sweep.targets["test"]
    known = np.isin(truth, KNOWN)
    named = np.where(score >= threshold, outcomes["test"].labels, OTHER)
    return {
        "method": method,
        **limits,
        "f1_weighted": f1_score(np.where(known, truth, OTHER), named, average="weighted"),
        "auroc": roc_auc_score(known, score),
        "accuracy": (outcomes["test"].labels == truth)[known].mean(),
        "ms_per_image": 1e3 * seconds / len(truth),
    }


def draw_table(table, path):
    """Draw F1 over displacement, and over drift."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.9), layout="constrained", sharey=True)
    panels = (table[table["drift"].isna()], "place", 1 / CELL), (table[table["drift"].notna()], "drift", 1)
    for ax, (rows, key, scale) in zip(axes, panels, strict=True):
        for number, method in enumerate(METHODS):
            own = rows[rows["method"] == method]
            if len(own):
                ax.plot(own[key] * scale, own["f1_weighted"], marker="os^D"[number], color=f"C{number}", label=method)
        ax.axhline(REJECTING, color="0.5", ls=":", lw=1)
        ax.grid(alpha=0.3)
    axes[0].text(PLACES[-1], REJECTING, "every image rejected", ha="right", va="bottom", color="0.4", fontsize="small")
    axes[0].set(xlabel="largest displacement each way [range cells]", ylabel="weighted F1, open set", ylim=(0.25, 1))
    axes[1].set(xlabel="largest drift [wavelengths], beside a displacement of two cells")
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=90)


def main():
    options = options_of(__doc__, count={"type": int, "default": 100, "help": "views of each target and side"})
    sweep = Sweep(options.count)
    model, table = sweep.fitted(), []
    cases = [({"place": CELL * cells}, method) for cells in PLACES for method in list(METHODS)[:2]]
    cases += [({"place": PLACE, "drift": drift}, method) for drift in DRIFTS for method in METHODS]
    for limits, method in cases:
        table.append(row(sweep, model, limits, method))
        show(table[-1])
    table = pd.DataFrame(table)
    table.to_csv(options.out / "motion.csv", index=False, float_format="%.4g")
    draw_table(table, options.out / "motion.png")


if __name__ == "__main__":
    main()
