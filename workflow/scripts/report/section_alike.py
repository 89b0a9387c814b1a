"""What looks alike: images of a target by the angle between them, and unknown targets beside known ones."""

import numpy as np
import pandas as pd

from isarflow.core import sweep
from isarflow.learning import features
from isarflow.report.draw_images import gallery
from isarflow.report.layout import GREY, PALETTE, Section, figure
from isarflow.report.plots import finish, panels
from isarflow.report.vocabulary import select

PLACE, NEEDS = ("recognition", 5), "learns"  # on the page, see page.py
FARTHEST = 45  # degrees that views are apart; or an aperture, if that is more


def section(results):
    """Return the section; nothing where no known target is told from another."""
    if len(results.classes) < 2:
        return ()
    text = "How much an image is like another is their zero-mean normalised cross-correlation (ZNCC) of magnitudes."
    return (Section("alike", "What looks alike", (text,), (angle_figure(results), *alike_figure(results))),)


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
    return figure("likeness_by_angle", drawing, data, caption, wide=True)


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


def alike_figure(results):
    """Draw of each unknown target, at the elevation nearest 0, the image most like one of a known target, and that."""
    known, unknown = results.of_role("known"), results.of_role("unknown")
    if not unknown:
        return ()
    images = {name: results.images(name, "clean").image.sel(elevation=0, method="nearest") for name in known + unknown}
    rows, shown, said = {name: standardized(image.values) for name, image in images.items()}, {}, []
    for number, name in enumerate(unknown, start=1):
        likeness = np.stack([rows[name] @ rows[other].T for other in known])
        other, there, here = np.unravel_index(likeness.argmax(), likeness.shape)
        pair = []
        for of, place in ((name, there), (known[other], here)):
            image = images[of][place].load()
            pair.append(f"{of} {float(image.azimuth):.4g}°")
            shown[f"{number}: {pair[-1]}"] = image
        said.append(f"{' and '.join(pair)}, {likeness.max():.2f}")
    caption = (
        "Of each unknown target the noise-free image that looks most like one of a known target, and that one, over "
        f"all azimuths at elevation {float(image.elevation):g}°; with their ZNCC: {'; '.join(said)}. Whoever has only "
        "seen the known targets may take one for the other."
    )
    return (gallery("images_alike", "", shown, None, caption),)
