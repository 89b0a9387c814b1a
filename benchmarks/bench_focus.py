"""Focus methods on point scatterers and on the dataset's targets, over motion: `make bench-focus`.

Points: some in each image, in one channel, at random places of the middle 60 % of the extent, 0.5 to 1 strong. Targets:
the samples of resources/fields at an elevation, three polarizations. All are moved by known range errors, with noise.
Counted is how many images are sharp, i.e. have the peak of the same image without motion to 0.5 dB and its entropy to
5 %; and how alike an image is to that without motion and noise: the median correlation of their magnitudes, of which a
displacement takes its share, too. Tables go to results/benchmarks/focus-*.csv, a picture to focus.png beside them.
"""

import argparse
import os
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import threadpoolctl
import xarray as xr

from isarflow.core.sweep import C0
from isarflow.imaging import focusing
from isarflow.imaging.formation import apertures, build_imager
from isarflow.imaging.scatterers import Scatterers, waves

SWEEPS = {  # Hz, rad: of config/thesis.yaml and config/config.yaml
    "full size": (np.linspace(4.05e9, 7.05e9, 27), np.radians(360 / 242) * np.arange(-10, 11)),
    "default": (np.linspace(2.025e9, 3.525e9, 14), np.radians(360 / 121) * np.arange(-5, 6)),
}
METHODS = {
    "none": "none",
    "entropy, drift": "entropy",
    "entropy, pulse": {"method": "entropy", "error": "pulse"},
    "phase_gradient": "phase_gradient",
}
POINTS = (1, 5, 20)
# Drift: at most, in wavelengths at the ends of the aperture; jitter: rms, in wavelengths; share of the pulses lost.
MOTIONS = (
    (0, 0, 0),
    (0.5, 0, 0),
    (1, 0, 0),
    (5, 0, 0),
    (0, 1 / 30, 0),
    (0, 1 / 10, 0),
    (1, 1 / 30, 0),
    (1, 1 / 30, 0.1),
    (1, 1 / 30, 0.3),
)
TARGETS, ELEVATION = ("drone", "missile", "aircraft", "ufo"), 15  # degrees
FINE = {"imager": "fourier", "window": "hamming", "reformat": "exact", "upsample": 64}
SHOWN = "drone", 40, (0.7, 1 / 30, 0.1)  # in the picture: a target, its image, the motion


def points(frequency, angle, count, draws, random):
    """Samples (draws, 1, F, A) of so many points an image."""
    cells = Scatterers(frequency, angle, {"pixels": 1})
    reach = 0.3 * np.array([len(frequency), len(angle)]) * cells.cell
    amplitudes = random.uniform(0.5, 1, (draws, count)) * np.exp(2j * np.pi * random.random((draws, count)))
    places = random.uniform(-reach, reach, (draws, count, 2))
    samples = [waves(cells.wavevectors, place) @ f for place, f in zip(places, amplitudes, strict=True)]
    return np.reshape(samples, (draws, 1, len(frequency), len(angle)))


def of_target(target, draws):
    """Samples (draws, 3, F, A) of a target of the dataset, at azimuths evenly around it."""
    field = xr.open_zarr(f"resources/fields/{target}.zarr").field.sel(elevation=ELEVATION)
    field = field.transpose("polarization", "frequency", "azimuth").load()
    samples = apertures(field.values, field.azimuth.values, 21)
    samples = samples[np.linspace(0, len(samples), draws, endpoint=False).astype(int)]
    return samples.reshape(*samples.shape[:2], field.sizes["frequency"], 21)


def noisy(samples, snr_db):
    """Samples with noise, the same in each call, by the mean power of all channels."""
    random = np.random.default_rng(1)
    power = (np.abs(samples) ** 2).mean(axis=(1, 2, 3), keepdims=True) / 10 ** (snr_db / 10)
    return (samples + random.standard_normal((*samples.shape, 2)) @ [1, 1j] * np.sqrt(power / 2)).astype(np.complex64)


def moved(samples, frequency, angle, motion, snr_db, random):
    """Samples with motion and noise, those with noise alone, (images, channels, F, A), and the pulses there."""
    drift, jitter, lost = motion
    k, shape = 2 * np.pi * frequency / C0, (len(samples), len(angle))
    errors = random.uniform(-drift, drift, (len(samples), 1)) * (angle / angle[-1]) ** 2 + random.normal(
        0, jitter, shape
    )
    errors *= 2 * np.pi / k.mean()
    present = random.random(shape) >= lost
    turned = samples * np.exp(2j * k[:, None] * errors[:, None, None])
    return *(noisy(of, snr_db) * present[:, None, None] for of in (turned, samples)), present


def magnitudes(samples, frequency, angle):
    """Magnitudes of fine images, (images, channels * pixels)."""
    image = build_imager(frequency, angle, FINE).on_axes(
        samples.reshape(-1, len(frequency), len(angle)).astype(np.complex64)
    )
    return np.abs(image).reshape(len(samples), -1)


def judged(image, still, truth):
    """Which images are sharp, and how alike they are to the truth. All are magnitudes (images, pixels)."""
    powers = [of**2 / (of**2).sum(axis=1, keepdims=True) for of in (image, still)]
    entropy, least = (-(power * np.log(power + 1e-30)).sum(axis=1) for power in powers)
    peaks = 20 * np.log10(image.max(axis=1) / still.max(axis=1))
    image, truth = (of - of.mean(axis=1, keepdims=True) for of in (image, truth))
    alike = (image * truth).sum(axis=1) / np.sqrt((image**2).sum(axis=1) * (truth**2).sum(axis=1))
    return (np.abs(peaks) <= 0.5) & (np.abs(entropy / least - 1) <= 0.05), alike


def rows(case, samples, sweep, motions, snr_db):
    """Rows of a table: every motion by every method."""
    truth = magnitudes(samples, *sweep)
    for motion in motions:
        with_errors, without, present = moved(samples, *sweep, motion, snr_db, np.random.default_rng(2))
        still = magnitudes(without, *sweep)
        stated = dict(zip(("drift", "jitter", "lost"), motion, strict=True))
        for name, focus in METHODS.items():
            start = time.process_time()
            focused = focusing.build_focusing(*sweep, {"focus": focus}).focus(with_errors, present)
            rate = len(samples) / max(time.process_time() - start, 1e-3)
            sharp, alike = judged(magnitudes(focused, *sweep), still, truth)
            found = {"sharp": sharp.mean(), "alike": np.median(alike), "rate": rate if name != "none" else np.nan}
            yield case | {"snr_db": snr_db} | stated | {"method": name} | found


def draw(draws, path):
    """Draw an image without motion, with motion, and after each method."""
    target, number, motion = SHOWN
    sweep, samples = SWEEPS["full size"], of_target(target, draws)
    with_errors, without, present = moved(samples, *sweep, motion, 12, np.random.default_rng(3))
    shown = {"without motion": without} | {
        {"none": "with motion"}.get(name, name): focusing.build_focusing(*sweep, {"focus": focus}).focus(
            with_errors, present
        )
        for name, focus in METHODS.items()
    }
    imager = build_imager(*sweep, FINE)
    down, cross = imager.axes()
    figure, axes = plt.subplots(1, len(shown), figsize=(13, 3.1), layout="constrained", sharey=True)
    for ax, (title, of) in zip(axes, shown.items(), strict=True):
        image = np.abs(imager.on_axes(of[number % draws, :1]))[0]
        level = 20 * np.log10(image / image.max())
        ax.imshow(
            level, vmin=-30, vmax=0, origin="lower", extent=(cross[0], cross[-1], down[0], down[-1]), cmap="magma"
        )
        ax.set(title=title, xlabel="cross-range [m]")
    axes[0].set_ylabel("range [m]")
    figure.savefig(path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    threadpoolctl.threadpool_limits(options.threads)
    tables = {"points": [], "targets": []}
    for size, sweep in SWEEPS.items():
        for count in POINTS:
            samples = points(*sweep, count, options.draws, np.random.default_rng(0))
            tables["points"] += rows({"sweep": size, "points": count}, samples, sweep, MOTIONS, 15)
    for target in TARGETS:
        for snr in (12, 0):
            samples = of_target(target, options.draws)
            tables["targets"] += rows({"target": target}, samples, SWEEPS["full size"], MOTIONS, snr)
    for name, table in tables.items():
        table = pd.DataFrame(table).round(3)
        table.to_csv(options.out / f"focus-{name}.csv", index=False)
        place = [key for key in table.columns if key not in ("method", "sharp", "alike", "rate")]
        print(table.pivot(index=place, columns="method", values=["sharp", "alike"]).to_string(), flush=True)
        print(table.groupby([place[0], "method"]).rate.median().round(-1))
    draw(options.draws, options.out / "focus.png")


if __name__ == "__main__":
    main()
