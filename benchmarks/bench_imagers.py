"""Imagers at and below the Fourier limit: `make bench-imagers`.

Two point scatterers of equal strength and random phases stand at random places of the reference sweep (27 frequencies,
21 azimuths, config/thesis.yaml), 0.3 to 2 resolution cells apart in a random direction, at 0 to 30 dB. The tables say
how often each imager resolves them, how far its peaks are off beside the Cramer-Rao bound, its strongest ghost, and the
time of 512 images; then the same with missing frequencies or azimuths. They go to results/benchmarks/, with a figure.
"""

import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from runner import options_of
from scipy.ndimage import map_coordinates, maximum_filter

from isarflow.imaging.formation import build_imager
from isarflow.imaging.scatterers import Scatterers, slopes, waves

FREQUENCY, ANGLE = np.linspace(4.05e9, 7.05e9, 27), np.radians(360 / 242) * (np.arange(21) - 10)
IMAGERS = {
    "Fourier, hamming": {"imager": "fourier", "window": "hamming", "reformat": "exact", "upsample": 128},
    "Fourier, boxcar": {"imager": "fourier", "window": "boxcar", "reformat": "exact", "upsample": 128},
    "sparse": {"imager": "sparse", "pixels": 3, "sparsity": 0.05, "iterations": 100},
    "esprit": {"imager": "esprit", "pixels": 6, "scatterers": 20},
    "centres": {"imager": "centres", "pixels": 6, "centres": 8},
}
APART, SNRS = (0.3, 0.5, 0.75, 1, 2), (0, 10, 20, 30)  # cells; dB, of the mean power of a sample
INNER = 0.6  # of the unambiguous extent, in which pairs lie
NEAR = 1 / 3  # cells from the truth
DIP = 10 ** (-1 / 20)  # of the weaker peak, to which the image falls between two
GAPS_APART, GAPS_SNR = 1, 20
TIMED = 512
FLOOR = -60.0  # dB

SWEEP = Scatterers(FREQUENCY, ANGLE, {"pixels": 1})
CELL, Q = SWEEP.cell, SWEEP.wavevectors
COUNTS = np.array([len(FREQUENCY), len(ANGLE)])


def gaps():
    """Which samples are there (F, A), by the words of a gap."""
    random = np.random.default_rng(1)
    there = {}
    for axis, name in enumerate(("frequencies", "azimuths")):
        count = COUNTS[axis]
        missing = {
            f"a third of the {name}, at random": random.choice(count, count // 3, replace=False),
            f"the middle third of the {name}": np.arange(count // 3, count // 3 + count // 3),
        }
        for words, numbers in missing.items():
            kept = np.ones(COUNTS, bool)
            kept[(numbers, slice(None)) if axis == 0 else (slice(None), numbers)] = False
            there[words] = kept
    return {"none": np.ones(COUNTS, bool)} | there


def pairs(count, apart, snr_db, random):
    """Pairs: places (count, 2, 2) in m, amplitudes (count, 2), samples (count, F * A), and noise powers (count,)."""
    direction = random.uniform(0, np.pi, count)
    half = apart / 2 * CELL * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    middle = random.uniform(-INNER / 2, INNER / 2, (count, 2)) * COUNTS * CELL
    places = np.stack([middle + half, middle - half], axis=1)
    amplitudes = np.exp(2j * np.pi * random.random((count, 2)))
    samples = np.stack([waves(Q, place) @ f for place, f in zip(places, amplitudes, strict=True)])
    power = (np.abs(samples) ** 2).mean(axis=1) / 10 ** (snr_db / 10)
    noise = random.standard_normal((*samples.shape, 2)) @ [1, 1j] * np.sqrt(power / 2)[:, None]
    return places, amplitudes, samples + noise, power


def bound(places, amplitudes, power, there):
    """The Cramer-Rao bound of a pair: the mean squared distance of an estimate from its scatterer, in cells."""
    by_unknown = slopes(Q, places, amplitudes, CELL)[there.ravel()]
    variance = np.diag(np.linalg.inv(2 / power * (by_unknown.conj().T @ by_unknown).real))
    return variance[:4].sum() / 2


def peaks(image, axes):
    """Peaks of an image, strongest first: places (P, 2) in cells, by parabolas of its logarithm, and heights (P,)."""
    at = np.argwhere((image == maximum_filter(image, 3)) & (image > 0))
    at = at[np.argsort(-image[tuple(at.T)], kind="stable")][:20]
    level = np.log(np.maximum(image, 1e-12 * image.max()))
    places = []
    for row, column in at:
        place = []
        for axis, (number, line) in enumerate(((row, level[:, column]), (column, level[row]))):
            shift = 0.0
            if 0 < number < len(line) - 1:
                before, middle, after = line[number - 1 : number + 2]
                bend = before - 2 * middle + after
                shift = float(np.clip((before - after) / (2 * bend), -0.5, 0.5)) if bend < 0 else 0.0
            place.append((axes[axis][number] + shift * (axes[axis][1] - axes[axis][0])) / CELL[axis])
        places.append(place)
    return np.array(places).reshape(-1, 2), image[tuple(at.T)]


def judged(image, axes, truth):
    """Of one image: whether its pair is resolved, the mean squared distance in cells if so, and its ghost in dB."""
    truth = truth / CELL
    places, heights = peaks(image, axes)
    far = np.linalg.norm(places[:, None] - truth, axis=-1).min(axis=1) > 1
    ghost = max(20 * np.log10(heights[far].max() / heights[0]), FLOOR) if far.any() else FLOOR
    if len(places) < 2:
        return False, np.nan, ghost
    both = min((places[:2], places[1::-1]), key=lambda two: np.linalg.norm(two - truth, axis=1).sum())
    off = np.linalg.norm(both - truth, axis=1)
    steps = np.array([axis[1] - axis[0] for axis in axes]) / CELL
    start, stop = ((place - [axis[0] for axis in axes] / CELL) / steps for place in places[:2])
    between = map_coordinates(image, np.linspace(start, stop, 33).T, order=1)
    resolved = bool((off < NEAR).all() and between.min() < DIP * heights[:2].min())
    return resolved, (off**2).mean() if resolved else np.nan, ghost


def row(imager, truth, amplitudes, samples, power, there):
    """What an imager makes of pairs, one row of a table."""
    images = np.abs(imager.on_axes((samples * there.ravel()).astype(np.complex64).reshape(-1, *COUNTS)))
    rows = [judged(image, imager.axes(), places) for image, places in zip(images, truth, strict=True)]
    resolved, error, ghost = map(np.array, zip(*rows, strict=True))
    least = np.array([bound(*pair, there) for pair in zip(truth, amplitudes, power, strict=True)])
    found = resolved.any()
    return {
        "resolved": resolved.mean(),
        "error_cells": np.sqrt(error[resolved].mean()) if found else np.nan,
        "bound_cells": np.sqrt(least[resolved].mean()) if found else np.sqrt(least.mean()),
        "ghost_db": np.median(ghost),
    }


def seconds(imager, random):
    """The time of 512 images of eight scatterers at 20 dB, from an eighth of them."""
    places = random.uniform(-INNER / 2, INNER / 2, (TIMED // 8, 8, 2)) * COUNTS * CELL
    clean = np.stack([waves(Q, place) @ np.exp(2j * np.pi * random.random(8)) for place in places])
    noise = random.standard_normal((*clean.shape, 2)) @ [1, 1j] * np.sqrt(8 / 100 / 2)
    samples = (clean + noise).astype(np.complex64).reshape(-1, *COUNTS)
    imager.on_axes(samples[:1])
    start = time.perf_counter()
    imager.on_axes(samples)
    return 8 * (time.perf_counter() - start)


def draw(table, missing, path):
    """Draw how often pairs are resolved, over their distance, and with gaps."""
    figure, axes = plt.subplots(1, len(SNRS) + 1, figsize=(14, 3.6), layout="constrained", width_ratios=[1] * 4 + [1.7])
    for ax, snr in zip(axes, SNRS, strict=False):
        for number, (name, rows) in enumerate(table[table.snr_db == snr].groupby("imager", sort=False)):
            style = {"color": f"C{number}", "marker": "osD^v"[number], "ms": 4, "label": name}
            ax.plot(rows.apart_cells, 100 * rows.resolved, **style)
        ax.set(title=f"{snr} dB", xlabel="distance [cells]", ylim=(-4, 104), xlim=(0.2, 2.1))
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("pairs resolved [%]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(IMAGERS))
    shown = missing.pivot(index="gap", columns="imager", values="resolved").loc[list(gaps()), list(IMAGERS)]
    last = axes[-1]
    last.imshow(shown, vmin=0, vmax=1, cmap="Blues", aspect="auto")
    for (line, column), value in np.ndenumerate(shown.to_numpy()):
        color = "white" if value > 0.6 else "black"
        last.text(column, line, f"{100 * value:.0f}", ha="center", va="center", color=color)
    last.set_xticks(range(len(IMAGERS)), [name.replace(", ", "\n") for name in IMAGERS], fontsize="x-small")
    rows = [name.replace(" of the ", "\nof the ") for name in shown.index]
    last.set_yticks(range(len(shown)), rows, fontsize="x-small")
    last.set_title(f"[%], samples missing ({GAPS_APART} cell, {GAPS_SNR} dB)", fontsize="medium")
    figure.savefig(path, dpi=90)


def main():
    options = options_of(__doc__, draws={"type": int, "default": 100})
    table, missing, times = [], [], []
    for name, settings in IMAGERS.items():
        imager = build_imager(FREQUENCY, ANGLE, {"aperture": len(ANGLE), **settings})
        times.append({"imager": name, "seconds": seconds(imager, np.random.default_rng(2))})
        random = np.random.default_rng(0)  # the same pairs for every imager
        for snr in SNRS:
            for apart in APART:
                case = {"imager": name, "snr_db": snr, "apart_cells": apart}
                table.append(case | row(imager, *pairs(options.draws, apart, snr, random), gaps()["none"]))
        for words, there in gaps().items():
            drawn = pairs(options.draws, GAPS_APART, GAPS_SNR, np.random.default_rng(3))
            missing.append({"imager": name, "gap": words} | row(imager, *drawn, there))
        print(f"{name}: {TIMED} images in {times[-1]['seconds']:.1f} s on {options.threads} threads", flush=True)
    table, missing, times = map(pd.DataFrame, (table, missing, times))
    for name, rows in {"pairs": table, "gaps": missing, "times": times}.items():
        rows.to_csv(options.out / f"imagers-{name}.csv", index=False)
        print(rows.round(3).to_string(index=False))
    draw(table, missing, options.out / "imagers.png")


if __name__ == "__main__":
    main()
