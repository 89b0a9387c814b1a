"""What looks alike: images by the angle between them, and those taken for another target beside what they resemble."""

import numpy as np
import pandas as pd

from isarflow.core import sweep
from isarflow.learning import features, thresholds
from isarflow.learning.classifier import OTHER
from isarflow.learning.experiments import training
from isarflow.learning.split import Division, Views, split
from isarflow.report.draw_images import gallery
from isarflow.report.layout import GREY, PALETTE, Section, figure
from isarflow.report.plots import finish, panels
from isarflow.report.selection import mistaken, mistaken_snr
from isarflow.report.vocabulary import F1, SPLITS, ranked, run_title, select

PLACE, NEEDS = ("recognition", 5), "learns"  # on the page, see page.py
PAIRS = 4  # kinds of mistake that are shown, the most frequent first
EXAMPLES = 2  # of each
FARTHEST = 45  # degrees that views are apart; or an aperture, if that is more


def section(results):
    """Return the section; nothing where no known target is told from another."""
    if len(results.of_role("known")) < 2:
        return ()
    text = (
        "How much an image is like another is their zero-mean normalised cross-correlation (ZNCC) of magnitudes. "
        "Training images are those without noise of the views that the run trains on."
    )
    return (Section("alike", "What looks alike", (text,), (angle_figure(results), *mistakes_figure(results))),)


def standardized(images):
    """Return magnitudes of images (n, ...) as rows (n, d) of mean 0 and length 1; a constant one stays zero."""
    return features.standardized(np.abs(images).reshape(len(images), -1))


def angle_figure(results):
    """Draw how much two views of a known target are alike by the angle between them, along azimuth and elevation."""
    step = np.diff(sweep.azimuths(results.settings["aspect"])[:2])[0]
    aperture = results.settings["imaging"]["aperture"] * step
    data = [likeness_by_angle(results, target, max(FARTHEST, aperture)) for target in results.of_role("known")]
    data = pd.concat(data, ignore_index=True)
    shown = data["along"].unique()
    drawing, grid = panels(1, len(shown), 1 + 4.2 * len(shown), 3.4, sharex=False)
    for axes, along in zip(grid.flat, shown, strict=True):
        for place, (target, line) in enumerate(select(data, along=along).groupby("target", sort=False)):
            color, marker = PALETTE[-1 - place % len(PALETTE)], "osD^vPX*"[place % 8]  # the first are of models
            axes.plot(line["degrees"], line["mean"], ms=3, label=target, color=color, marker=marker)
            axes.fill_between(line["degrees"], line["low"], line["high"], color=color, alpha=0.15, lw=0)
        axes.set_xlabel(f"apart in {along} [degrees]")
    grid[0, 0].axvline(aperture, color=GREY, lw=0.8, ls="--", label="an aperture apart")
    finish(drawing, grid, "", "ZNCC of magnitudes")
    caption = (
        "How much the images of two views of one target are alike, without noise, by the angle between the views: mean "
        "and, shaded, from the 10th to the 90th of 100 pairs, over all views. It is why splits differ: at random the "
        "nearest training image is a step of azimuth away, by elevation the step between elevations, by sector an "
        f"aperture of azimuth (dashed, {aperture:.3g}°) or more."
    )
    alt = "ZNCC of images of one target against the angle between their views, along azimuth and along elevation."
    return figure("likeness_by_angle", drawing, data, alt, caption, wide=True)


def likeness_by_angle(results, target, farthest):
    """Return the ZNCC of pairs of a target's clean images, at most `farthest` degrees apart: mean, 10 and 90 %."""
    image = results.images(target, "clean").image.transpose("elevation", "azimuth", ...).load()
    azimuth, elevation = image.azimuth.values, image.elevation.values
    rows = standardized(image.stack(view=["elevation", "azimuth"]).transpose("view", ...).values)
    rows, found = rows.reshape(len(elevation), len(azimuth), -1), []
    step = azimuth[1] - azimuth[0]
    for lag in range(1, min(int(farthest / step + 1e-6), len(azimuth) - 1) + 1):
        there = np.roll(rows, -lag, axis=1) if sweep.closes_circle(azimuth) else rows[:, lag:]
        found.append(("azimuth", lag * step, np.einsum("eap,eap->ea", rows[:, : there.shape[1]], there)))
    apart = (elevation - elevation[:, None]).round(4)
    for degrees in np.unique(apart[(apart > 0) & (apart <= farthest)]):
        low, high = np.nonzero(apart == degrees)
        found.append(("elevation", degrees, np.einsum("eap,eap->ea", rows[low], rows[high])))
    table = [(target, along, degrees, x.mean(), *np.quantile(x, (0.1, 0.9))) for along, degrees, x in found]
    return pd.DataFrame(table, columns=["target", "along", "degrees", "mean", "low", "high"])


def _stacked(results, run, target, side):
    """Return a target's clean images of one side of a run's division: (view, ...)."""
    image = results.images(target, "clean").image
    planes = results.settings["targets"][target].get("symmetry", [])
    angles = (image[name].values.astype(float) for name in Views._fields)
    views = split(*angles, planes, Division(**results.runs[run]["division"]))[side]
    return image.isel(views._asdict()).stack(view=Views._fields).transpose("view", ...).load()


def mistakes_figure(results):
    """Draw images that were taken for another target, each beside that target's training image that is most like it."""
    run, model = mistaken(results.runs)
    snr = mistaken_snr(results.settings["noise"]["snr_db"])
    table, score = _judged(results, run, model, snr)
    wrong = table[(table["taken_for"] != table["target"]) & (table["taken_for"] != OTHER)]
    counts = wrong.groupby(["target", "taken_for"]).size().sort_values(ascending=False, kind="stable").head(PAIRS)
    images = {}
    for target, taken in counts.index:
        training = _stacked(results, run, taken, "train")
        rows = standardized(training.values)
        cases = select(wrong, target=target, taken_for=taken)
        cases = cases.sort_values(f"score_{taken}", ascending=False, kind="stable")
        for case in cases.drop_duplicates(["elevation", "azimuth"]).head(EXAMPLES).itertuples():
            seen = results.images(target, sweep.snr_label(snr)).image.isel(realization=case.realization)
            seen = seen.sel(elevation=case.elevation, azimuth=case.azimuth, method="nearest").load()
            likeness = rows @ standardized(seen.values[None])[0]
            near = training.isel(view=int(likeness.argmax()))
            number = len(images) // 2 + 1
            images[f"{number}: {target}\n{case.elevation:g}°, {case.azimuth:.4g}°"] = seen
            where = f"{float(near.elevation):g}°, {float(near.azimuth):.4g}°"
            images[f"{number}: {taken}, {likeness.max():.2f}\n{where}"] = near
    if not images:
        return ()
    what = f"{results.names.model(model).words} in {run_title(results.runs[run], fold=True)}"
    rejected = f" and not rejected by {results.names.score(score).label} with the blind threshold" if score else ""
    caption = (
        f"What {what}, {SPLITS[results.runs[run]['split']]}, took for another target at {snr:g} dB{rejected}, each "
        "beside the training image of that target that is most like it, with their ZNCC: of the most frequent mistakes "
        "the most certain. At elevation and azimuth."
    )
    alt = "Pairs of images: one that was taken for another target, and the training image that is most like it."
    return (gallery("mistaken", "", images, None, alt, caption),)


def _judged(results, run, model, snr):
    """Return the test rows of a model's predictions, with a column taken_for, and the score by which it rejects.

    Of several scores that which is best on the validation images; empty for a run without unknown targets.
    """
    table, score = results.predictions(run, model, snr), ""
    table["taken_for"] = table["predicted"]
    if results.runs[run]["open"]:
        own = {"experiment": results.runs[run]["experiment"], "training": training(results.runs[run]), "model": model}
        validation = select(results.validation, **own, metric=F1, threshold="blind", elevation="all")
        score = ranked(validation).iloc[0]["score"]
        least = thresholds.choose(table, f"known_{score}", "blind", results.settings["learning"]["kept"])
        table["taken_for"] = thresholds.apply(table[f"known_{score}"], table["predicted"], least)
    return select(table, side="test", role=["known", "unknown"]), score
