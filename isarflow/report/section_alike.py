"""What looks alike: images of a target by the angle between them, and unknown targets beside known ones."""

import numpy as np
import pandas as pd

from isarflow.core import sweep
from isarflow.learning.data import likeness
from isarflow.report.layout import GREY, PALETTE, Section, figure
from isarflow.report.plots import finish, gallery, panels
from isarflow.report.vocabulary import select

PLACE, NEEDS = ("recognition", 5), "learns"  # on the page, see page.py
FARTHEST = 45  # degrees that views are apart; or an aperture, if that is more


def section(results):
    """Return the section; nothing where no known target is told from another."""
    if len(results.classes) < 2:
        return ()
    text = "How much an image is like another is their zero-mean normalised cross-correlation (ZNCC) of magnitudes."
    return (Section("alike", "What looks alike", (text,), (angle_figure(results), *alike_figure(results))),)


def angle_figure(results):
    """Draw how much two views of a known target are alike by the angle between them, along azimuth and elevation."""
    step = np.diff(sweep.azimuths(results.settings["aspect"])[:2])[0]
    aperture = results.settings["imaging"]["aperture"] * step
    images = {target: results.images(target, "clean").image for target in results.of_role("known")}
    data = {target: likeness.by_angle(image, max(FARTHEST, aperture)) for target, image in images.items()}
    data = pd.concat(data, names=["target"]).reset_index("target")
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
        "How much two views of one target are alike, without noise, by the angle between them: mean and, shaded, from "
        "the 10th to the 90th of 100 pairs. The nearest training image is, at random, a step of azimuth away, by "
        f"elevation a step of elevation, by sector an aperture of azimuth (dashed, {aperture:.3g}°) or more."
    )
    return figure("likeness_by_angle", drawing, data, caption, wide=True)


def alike_figure(results):
    """Draw of each unknown target, at the elevation nearest 0, the image most like one of a known target, and that."""
    known, unknown = results.of_role("known"), results.of_role("unknown")
    if not unknown:
        return ()
    images = {name: results.images(name, "clean").image.sel(elevation=0, method="nearest") for name in known + unknown}
    rows, shown, said = {name: likeness.standardized(image.values) for name, image in images.items()}, {}, []
    for number, name in enumerate(unknown, start=1):
        other, there, here, most = likeness.most_alike(rows[name], [rows[other] for other in known])
        pair = []
        for of, place in ((name, there), (known[other], here)):
            image = images[of][place].load()
            pair.append(f"{of} {float(image.azimuth):.4g}°")
            shown[f"{number}: {pair[-1]}"] = image
        said.append(f"{' and '.join(pair)}, {most:.2f}")
    caption = (
        "Of each unknown target the noise-free image that looks most like one of a known target, and that one, over "
        f"all azimuths at elevation {float(image.elevation):g}°; with their ZNCC: {'; '.join(said)}."
    )
    return (gallery("images_alike", "", shown, None, caption),)
