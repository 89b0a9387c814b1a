"""Parts of the thesis's figures: scores over the SNR, prediction times, hyper-parameters, and pictures of images.

A part is named in page.yaml and yields blocks: Markdown and Pictures. figure: as of `page.build`; a part
appends to its `lacks` what the run does not have of it.
"""

from itertools import cycle

import numpy as np

from isarflow.core.sweep import snr_label
from isarflow.core.words import number, signed
from isarflow.learning import images
from isarflow.learning.experiments import training
from isarflow.report.layout import BLACK
from isarflow.report.plots import (
    draw_curve,
    draw_pixels,
    draw_published,
    draw_rejecting,
    finish,
    panels,
    training_look,
)
from isarflow.report.published import ADAPTATIONS
from isarflow.report.selection import around, evenly
from isarflow.report.vocabulary import ACCURACY, at_snrs, select, snr_axis, title
from study import statements as stated
from study.anew import nearest_snr
from study.markdown import NONE, picture, table
from study.selection import at_highest
from study.statements import HARDER, PROTOCOLS, SPLIT, WORDS, by_sector, ours, value_text

NEARLY = 0.1  # relative: a setting tried that is so near to the published one stands for it


def statements(results, figure):
    """Say what the document states in numbers and what this run has: a row for each statement."""
    opened, harder = (any(line[key] for line in figure.found) for key in ("score", "sector"))
    heads = {split: f"here, {WORDS[split]}{f', `{name}` thresholds' * opened}" for split, name in PROTOCOLS.items()}
    rows = []
    for line in figure.found:
        snr = line["snr_db"]
        row = {"model": line["name"], "measure": line["words"], "stated": line["stated"]}
        row |= {"SNR [dB]": "∞" if np.isinf(snr) else f"{snr:g}", "published": line["published"]}
        row |= {heads[SPLIT]: value_text(line["here"], snr), "as published": stated.KEPT[line["holds"]]}
        row |= {"the same, `blind` thresholds": value_text(line["blind"], snr)} if opened else {}
        rows.append(row | ({heads[HARDER]: value_text(line["sector"], snr)} if harder else {}))
    yield table(rows)


def curves(results, figure):
    """Draw curves over the SNR, at random with published statements and by sector, and list their values.

    Of each model the closed set, and the open set by each of figure.scores. figure.marked: with statements.
    """
    names, several, looks, every = results.names, len(figure.models) > 1, {}, {SPLIT: {}, HARDER: {}}
    for model, score in ((model, score) for model in figure.there for score in ("", *figure.scores)):
        look = names.score(score) if score else names.model(model)
        label = look.label if several else f"open set, {look.label}" if score else "closed set"
        looks[model, score] = look.curve | {"label": label}
        case = results, figure.experiment, model, figure.metric, score
        every[SPLIT][model, score] = ours(*case, figure.elevation)
        every[HARDER][model, score] = by_sector(*case)
    every = {split: {case: rows for case, rows in of.items() if len(rows)} for split, of in every.items()}
    if not every[SPLIT]:
        words = f"scores of experiment `{figure.experiment}` by mean power at these elevations"
        figure.lacks += [words] if looks else []
        return
    shown, listed = {split: of for split, of in every.items() if of}, []
    drawing, grid = panels(1, len(shown), max(1 + 3.9 * len(shown), 6.6), 3.6)
    for axes, (split, of) in zip(grid.flat, shown.items(), strict=True):
        protocol = f", {PROTOCOLS[split]} thresholds" if figure.scores else ""
        for (model, score), rows in of.items():
            draw_curve(axes, rows, **looks[model, score])
            listed.append((f"{looks[model, score]['label']}, {WORDS[split]}{protocol if score else ''}", rows))
        opened = {rows["experiment"].iloc[0] for (_, score), rows in of.items() if score}
        draw_rejecting(axes, results.rejecting(opened))
        axes.set_title(f"{WORDS[split]}{protocol}")
    if figure.marked:
        lines = select(results.published_scores, experiment=figure.experiment, elevation=figure.elevation)
        lines = select(lines, reading=["", "maximum"])
        own = {model: ADAPTATIONS.get(model, (model, "")) for model in lines["model"]}
        colors = {model: looks[of]["color"] for model, of in own.items() if of in looks}
        draw_published(grid[0, 0], select(lines, model=list(colors)), colors)
    words = "accuracy" if figure.metric == ACCURACY else "weighted F1"
    finish(drawing, grid, snr_axis("mean"), words)
    whose = ", ".join(look["label"] for look in looks.values()) if several else names.model(figure.there[0]).words
    yield picture(figure.picture, drawing, f"{figure.picture} here: {words} of {whose} against the test SNR.")
    yield stated.values_table(listed)


def trainings(results, figure):
    """Draw the accuracy of a model trained at each of several SNRs, and list its values.

    figure.beside: an experiment trained without noise.
    """
    (model,), experiment = figure.models, figure.experiment
    label, rows = results.names.model(model).label, ours(results, experiment, model, ACCURACY)
    if not len(rows):
        figure.lacks.append(f"experiment `{experiment}` with {label}, split at random")
        return
    shown = [(trained, curve) for (trained,), curve in results.names.groups(rows, "training")]
    drawing, grid = panels(1, 1, 6.6, 4.2)
    for trained, curve in shown:
        draw_curve(grid[0, 0], curve, **training_look(trained, [of for of, _ in shown]))
    clean = ours(results, figure.beside, model, ACCURACY)
    if len(clean):
        draw_curve(grid[0, 0], clean, BLACK, band=False, ls="--", label="trained without noise (Fig. 4.12)")
        shown.append(("without noise", clean))
    finish(drawing, grid, snr_axis("mean"), "accuracy")
    alt = f"{figure.picture} here: accuracy of {label} against the test SNR, a curve for each training SNR."
    yield picture(figure.picture, drawing, alt)
    yield stated.values_table(shown, "trained at")


def upsampling_effect(results, figure):
    """List accuracy with up-sampling less that of the experiment figure.plain, at the same training and test SNRs."""
    finer, plain = (ours(results, name, figure.models[0], ACCURACY) for name in (figure.experiment, figure.plain))
    if figure.lacks:
        return
    on = ["training", "test_snr_db"]
    both = finer.merge(plain[[*on, "value"]], on=on, suffixes=("", "_plain"))
    snrs = stated.shown_snrs(both["test_snr_db"])
    rows = [
        {"trained at": trained} | at_snrs(curve, snrs, lambda row: signed(row["value"] - row["value_plain"]))
        for (trained,), curve in results.names.groups(both, "training")
    ]
    if rows:
        yield f"Accuracy with up-sampling less that without, same training and test SNRs:\n\n{table(rows)}"


def times(results, figure):
    """List published prediction times beside ours. figure.timed: models of each experiment."""
    rows, lacks = [], []
    for experiment, model in ((name, model) for name, models in figure.timed.items() for model in models):
        printed = select(results.published_times, model=model, experiment=experiment).iloc[0]
        there, images_there = printed["milliseconds_per_observation"], printed["training_observations"]
        row = {"model": results.names.model(model).label, "experiment": title(experiment)}
        row |= {"published [ms]": number(there, 5), "training images there": number(images_there, 6)}
        here = stated.rows(results, "times", experiment=experiment, model=model)
        if len(here):  # of an experiment that trains at each of several SNRs all, which are of one size
            row["training images here"] = f"{here['training_observations'].iloc[0]}"
            row["here, one at a time [ms]"] = number(here["single_ms"].mean())
            row["here, in batches [ms]"] = number(here["batch_ms"].mean())
            row["published / here in batches"] = number(there / here["batch_ms"].mean(), 2)
        else:
            lacks.append(f"{row['model']} in experiment `{experiment}`")
        rows.append(row)
    figure.lacks += [", ".join(lacks)] if lacks else []
    yield table(rows)


def hyper_parameters(results, figure):
    """List published settings beside ours, and beside those that searches on validation images choose.

    figure.thresholds: of the settings that are thresholds, the experiment and confidence score here.
    """
    searches, rows, lacking = {}, [], []  # searches split at random, of models that learn what is without noise
    for (run, model), search in results.searches.items():
        own = results.runs[run]
        if own["split"] == SPLIT and training(own) == "clean" and own["elevation"] == "all":
            searches.setdefault(model.removesuffix("_tuned"), search)
    for model in figure.models:
        lacking += [] if model in searches else [f"`{model}_tuned`"]
        for line in select(results.published_settings, model=model).to_dict("records"):
            rows.append(_setting(results, line, searches.get(model, ()), figure.thresholds.get(line["setting"])))
    figure.lacks += [f"searches by {', '.join(lacking)}"] if lacking else []
    yield table(rows)


def _setting(results, line, search, case):
    """Return a published setting beside ours, and beside what a search chose, as cells of a table.

    line: of thesis_settings.csv; search: the settings tried; case: of a threshold its experiment and score.
    """
    name, own = line["setting"], results.settings["learning"]["models"].get(line["model"], {})
    row = {"model": results.names.model(line["model"]).label, "setting": name}
    row |= {"published": f"{line['value']} ({line['source']})", "here": own.get(name, NONE)}
    if case:
        case = case | {"model": line["model"], "split": SPLIT, "threshold": "thesis", "elevation": "all"}
        for top in at_highest(stated.rows(results, "scores", **case, metric="threshold")).to_dict("records"):
            row["here"] = f"{top['value']:.3f} at {top['test_snr_db']:g} dB"
    if name in search:
        best = search.loc[search["validation_accuracy"].idxmax()]
        tried = ", ".join(f"{value:g}" for value in sorted(search[name].unique()))
        alike = search[np.isclose(search[name], float(line["value"]), rtol=NEARLY)]["validation_accuracy"]
        row["chosen on validation images"] = f"{best[name]:g} of {tried}"
        row["accuracy there"] = f"{best['validation_accuracy']:.4f}"
        row["at most with the published value"] = f"{alike.max():.4f}" if len(alike) else NONE
    return row


def images_shown(results, figure):
    """Draw a row of images of each of the first figure.targets known targets, over elevation at figure.snr, or clean.

    figure.count: of a row; figure.around: whether they are at other azimuths, too; figure.headed, figure.alt and
    figure.caption: texts.
    """
    known, lines = results.of_role("known")[: figure.targets], []
    snr = figure.snr if figure.snr == "clean" else nearest_snr(results, figure.snr)
    for target in known:
        image = results.images(target, "clean" if snr == "clean" else snr_label(snr)).image
        image = image.isel(realization=0, missing_dims="ignore")
        elevations = evenly(image.elevation.values.tolist(), figure.count)
        azimuths = around(image.sizes["azimuth"], figure.count) if figure.around else [0] * len(elevations)
        places = zip(cycle(elevations), azimuths, strict=False)
        picked = [image.sel(elevation=elevation).isel(azimuth=azimuth) for elevation, azimuth in places]
        where = [{"elevation": float(one.elevation), "azimuth": float(one.azimuth)} for one in picked]
        heads = [figure.headed.format(target=target, **of) for of in where]
        lines.append([*zip(heads, (one.values for one in picked), strict=True)])
    words = {"targets": " and ".join(known), "snr": snr, "count": len(lines[0]), **where[0]}
    yield _pictures(figure, lines, figure.alt.format(**words))
    yield figure.caption.format(**words)


def images_upsampled(results, figure):
    """Draw an image of each of two known targets, as it is and with figure.upsampled pixels a side."""
    known, side, line = results.of_role("known")[:2], figure.upsampled, []
    dataset = results.images(known[0], "clean")
    if "range_wavenumber" not in dataset.attrs or max(dataset.sizes["range"], dataset.sizes["crossrange"]) > side:
        figure.lacks.append(f"images that can be up-sampled to {side} pixels a side")
        return
    for target in known:
        store = results.folder / "imaging" / target / "clean.zarr"
        azimuths = images.azimuths(store)
        elevation = float(dataset.elevation.sel(elevation=0, method="nearest"))
        where = {target: azimuths[around(len(azimuths), 8)[1:2]]}
        for pixels in ("none", side):
            (image,), _ = images.read([store], where, [elevation], pixels, channels=results.polarizations[:1])
            line.append((f"{target}, {image.shape[0]} × {image.shape[1]}", image))
    alt = f"Images of {' and '.join(known)} as they are and up-sampled to {side} pixels a side."
    yield _pictures(figure, [line], alt)


def _pictures(figure, lines, alt):
    """Return a Picture of magnitudes, each of its peak: rows of (title, image), images over (range, crossrange)."""
    rows, columns = len(lines), len(lines[0])
    drawing, grid = panels(rows, columns, 1.3 * columns + 0.4, 1.5 * rows, False, False, "compressed")
    for axes, (text, image) in zip(grid.flat, (one for line in lines for one in line), strict=True):
        draw_pixels(axes, np.abs(image) / max(np.abs(image).max(), 1e-12))
        axes.set(xticks=[], yticks=[])
        axes.set_title(text, fontsize=8)
    finish(drawing, grid, "", legend=False)
    return picture(figure.picture, drawing, alt)
