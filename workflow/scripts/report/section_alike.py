"""What looks alike: images taken for another target beside their nearest training images, and a map of all."""

import numpy as np
import pandas as pd

from isarflow.core import sweep
from isarflow.learning import features, thresholds
from isarflow.learning.split import Division, Views, split
from isarflow.report.draw_images import gallery
from isarflow.report.layout import GREY, PALETTE, Section, figure
from isarflow.report.plots import finish, panels
from isarflow.report.selection import mistaken, mistaken_snr
from isarflow.report.vocabulary import of_run, ranked, run_title, select, split_text

PAIRS = 4  # kinds of mistake that are shown, the most frequent first
EXAMPLES = 2  # of each
FARTHEST = 45  # degrees that views are apart; or an aperture, if that is more
MOST_POINTS = 150  # of a target in the map
# The last of the palette: models have the first.
COLORS, MARKERS = PALETTE[::-1], "osD^vPX*"


def section(results):
    """Nothing where no known target is told from another."""
    if len(results.of_role("known")) < 2:
        return ()
    figures = (angle_figure(results), *mistakes_figure(results), *map_figure(results))
    text = (
        "How much an image is like another is their zero-mean normalised cross-correlation (ZNCC) of magnitudes. "
        "Training images are those without noise of the views that the run trains on."
    )
    return (Section(id="alike", title="What looks alike", text=(text,), figures=figures),)


def standardized(images):
    """Magnitudes of images (n, ...) as rows (n, d) without their means and of length 1; a constant one stays zero."""
    return features.standardized(np.abs(images).reshape(len(images), -1))


def angle_figure(results):
    """How much two views of a known target are alike by the angle between them, along azimuth and along elevation."""
    step = np.diff(sweep.azimuths(results.settings["aspect"])[:2])[0]
    aperture = results.settings["imaging"]["aperture"] * step
    data = [likeness_by_angle(results, target, max(FARTHEST, aperture)) for target in results.of_role("known")]
    data = pd.concat(data, ignore_index=True)
    shown = data["along"].unique()
    drawing, grid = panels(1, len(shown), 1 + 4.2 * len(shown), 3.4, sharex=False)
    for axes, along in zip(grid.flat, shown, strict=True):
        for place, (target, line) in enumerate(select(data, along=along).groupby("target", sort=False)):
            look = {"color": COLORS[place % 8], "marker": MARKERS[place % 8]}
            axes.plot(line["degrees"], line["mean"], ms=3, label=target, **look)
            axes.fill_between(line["degrees"], line["low"], line["high"], color=look["color"], alpha=0.15, lw=0)
        axes.set_xlabel(f"apart in {along} [degrees]")
    grid[0, 0].axvline(aperture, color=GREY, lw=0.8, ls="--", label="an aperture apart")
    finish(drawing, grid, "", "ZNCC of magnitudes")
    said, near = {}, data["degrees"].sub(aperture).abs() < 1e-3
    first = data.drop_duplicates(["target", "along"])  # a step apart
    for row in pd.concat([first, data[near & (data["along"] == "azimuth")]]).itertuples():
        said.setdefault(row.target, []).append(f"{row.mean:.2f} at {row.degrees:.3g}° of {row.along}")
    said = "; ".join(f"{target} {', '.join(dict.fromkeys(parts))}" for target, parts in said.items())
    caption = (
        "How much the images of two views of one target are alike, without noise, by the angle between the views: mean "
        "and, shaded, from the 10th to the 90th of 100 pairs, over all views. It is why splits differ: at random the "
        "nearest training image is a step of azimuth away, by elevation the step between elevations, by sector an "
        f"aperture of azimuth (dashed, {aperture:.3g}°) or more. Means: {said}."
    )
    alt = f"ZNCC of images of one target against the angle between their views: {said}."
    return figure("likeness_by_angle", drawing, data, alt, caption, wide=True)


def likeness_by_angle(results, target, farthest):
    """ZNCC of pairs of a target's clean images: rows of target, along, degrees, mean, low and high (10 and 90 %).

    farthest: degrees that two of them are apart, at most.
    """
    image = results.images(target, "clean").image.transpose("elevation", "azimuth", ...).load()
    shape = image.shape[:2]
    rows = standardized(image.values.reshape(np.prod(shape), -1)).reshape(*shape, -1)
    found, azimuth, elevation = [], image.azimuth.values, image.elevation.values
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


def _stacked(results, run, target, side, store="clean"):
    """A target's images of one side of a run's division, first realization, one after the other: (view, ...)."""
    image = results.images(target, store).image
    image = image.isel(realization=0) if "realization" in image.dims else image
    planes = results.settings["targets"][target].get("symmetry", [])
    angles = (image[name].values.astype(float) for name in Views._fields)
    views = split(*angles, planes, Division(**results.runs[run]["division"]))[side]
    return image.isel(views._asdict()).stack(view=Views._fields).transpose("view", ...).load()


def _training(results, run):
    """The clean training images of each known target, and their rows: by target."""
    images = {target: _stacked(results, run, target, "train") for target in results.of_role("known")}
    return images, {target: standardized(stack.values) for target, stack in images.items()}


def mistakes_figure(results):
    """Images that were taken for another target, each beside the training image of that target that is most like it.

    The most frequent mistakes, of each those with the most certain class. Nothing where nothing was mistaken, or no
    model was asked.
    """
    run, model = mistaken(results.runs)
    snr = mistaken_snr(results.settings["noise"]["snr_db"])
    table, score = _judged(results, run, model, snr)
    wrong = table[(table["taken_for"] != table["target"]) & (table["taken_for"] != "other")]
    counts = wrong.groupby(["target", "taken_for"]).size().sort_values(ascending=False, kind="stable").head(PAIRS)
    if not len(counts):
        return ()
    training, rows = _training(results, run)
    images, said, tested = {}, [], table.groupby("target").size()
    for (target, taken), count in counts.items():
        said.append(f"{count:,} of {tested[target]:,} of {target} for {taken}")
        cases = select(wrong, target=target, taken_for=taken)
        cases = cases.sort_values(f"score_{taken}", ascending=False, kind="stable")
        for case in cases.drop_duplicates(["elevation", "azimuth"]).head(EXAMPLES).itertuples():
            seen = results.images(target, sweep.snr_label(snr)).image.isel(realization=case.realization)
            seen = seen.sel(elevation=case.elevation, azimuth=case.azimuth, method="nearest").load()
            likeness = rows[taken] @ standardized(seen.values[None])[0]
            near = training[taken].isel(view=int(likeness.argmax()))
            number = len(images) // 2 + 1
            images[f"{number}: {target}\n{case.elevation:g}°, {case.azimuth:.4g}°"] = seen
            where = f"{float(near.elevation):g}°, {float(near.azimuth):.4g}°"
            images[f"{number}: {taken}, {likeness.max():.2f}\n{where}"] = near
    what = f"{results.names.model(model).words} in {run_title(results.runs[run], fold=True)}"
    rejected = f" and not rejected by {results.names.score(score).label} with the blind threshold" if score else ""
    caption = (
        f"What {what}, {split_text(results.runs[run]['split'])}, took for another target at {snr:g} dB{rejected}, each "
        "beside the training image of that target that is most like it, with their ZNCC: of the most frequent mistakes "
        f"the most certain. At elevation and azimuth. Test images taken for another: {'; '.join(said)}."
    )
    alt = f"Pairs of images that {what} mistook at {snr:g} dB: {'; '.join(said)}."
    return (gallery("mistaken", "", images, None, alt, caption),)


def _judged(results, run, model, snr):
    """The test rows of a model's predictions with a column taken_for, and the score by which it rejects, if it does.

    Of several scores that which is best on the validation images.
    """
    table, score = results.predictions(run, model, snr), ""
    if results.runs[run]["open"]:
        validation = of_run(results.validation, results.runs[run], model)
        score = ranked(select(validation, metric="f1_weighted", threshold="blind", elevation="all")).iloc[0]["score"]
        least = thresholds.choose(table, f"known_{score}", "blind", results.settings["learning"]["kept"])
        table["taken_for"] = thresholds.apply(table[f"known_{score}"], table["predicted"], least)
    else:
        table["taken_for"] = table["predicted"]
    shown = select(table, side="test", role=["known", "unknown"])
    return shown, score


def _own_side(data, known):
    """How many images of each of two known targets are more like its own training images than the other's, in words."""
    nearest = data[[f"like_{name}" for name in known]].idxmax(axis=1).str.removeprefix("like_")
    right = (nearest == data["target"]).groupby([data["target"], data["images"]], sort=False).mean()
    shares = {name: " and ".join(f"{share:.0%} ({words})" for words, share in right[name].items()) for name in known}
    return ", ".join(f"of {name} {words}" for name, words in shares.items())


def map_figure(results):
    """Every test image by how much it is like the training images of the known targets: without noise and with it.

    With two known targets the axes are the likenesses to either; of more the first two principal components of the
    likenesses to all of them.
    """
    run, _ = mistaken(results.runs)
    known = results.of_role("known")
    _, rows = _training(results, run)
    snr = mistaken_snr(results.settings["noise"]["snr_db"])
    tables = []
    for store, words in (("clean", "no noise"), (sweep.snr_label(snr), f"{snr:g} dB")):
        for target in known + results.of_role("unknown"):
            if store != "clean" and not results.runs[run]["open"] and target not in known:
                continue  # has no images with noise
            stack = _stacked(results, run, target, "test", store)
            stack = stack.isel(view=np.unique(np.linspace(0, stack.sizes["view"] - 1, MOST_POINTS).round().astype(int)))
            own = standardized(stack.values)
            likeness = {f"like_{name}": (own @ rows[name].T).max(axis=1) for name in known}
            where = {"elevation": stack.elevation.values, "azimuth": stack.azimuth.values}
            tables.append(pd.DataFrame({"images": words, "target": target, **where, **likeness}))
    data = pd.concat(tables, ignore_index=True)
    values = data[[f"like_{name}" for name in known]].to_numpy()
    labels = [f"ZNCC with the nearest image of {name}" for name in known]
    if len(known) > 2:
        centred = values - values.mean(axis=0)
        values = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
        labels = ["first component of the ZNCC with all", "second component"]
    data["x"], data["y"] = values.T
    shown = data["images"].unique()
    drawing, grid = panels(1, len(shown), 1 + 4.2 * len(shown), 4.6)
    for axes, words in zip(grid.flat, shown, strict=True):
        for place, (target, points) in enumerate(select(data, images=words).groupby("target", sort=False)):
            role = results.settings["targets"][target]["role"]
            look = {"mfc": "none"} if role == "unknown" else {"mec": "none"}
            look |= {"color": COLORS[place % 8], "marker": MARKERS[place % 8], "ls": "", "alpha": 0.7}
            axes.plot(points["x"], points["y"], label=f"{target} ({role})", **look)
        axes.set_title(words)
        if len(known) == 2:
            axes.axline((0.5, 0.5), slope=1, color=GREY, lw=0.8, ls=":")
    finish(drawing, grid, labels[0], labels[1])
    sides = f" On its own side of the dotted line lies {_own_side(data, known)}." if len(known) == 2 else ""
    apart = "lie apart from both, towards the lower left" if sides else "lie apart from all"
    caption = (
        f"Every test image of {run_title(results.runs[run], fold=True)} by its largest ZNCC with the training images "
        f"of {' and of '.join(known)}: what a nearest neighbour sees.{sides} Unknown targets (open markers) can be "
        f"rejected where they {apart}. At most {MOST_POINTS} images of each target."
    )
    alt = f"Test images of {', '.join(data['target'].unique())} by how like they are to the known targets."
    return (figure("map", drawing, data, alt, caption, wide=True),)
