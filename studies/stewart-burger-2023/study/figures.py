"""Parts of the thesis's figures: scores over the SNR, prediction times, hyper-parameters, and pictures of images.

A part is named in page.yaml and yields blocks: Markdown and Pictures. figure: as of `page.build`; a part
appends to its `lacks` what the run does not have of it.
"""

import numpy as np

from isarflow.core.sweep import snr_label
from isarflow.learning import images
from isarflow.learning.experiments import training
from isarflow.report.layout import BLACK, number, signed
from isarflow.report.plots import (
    draw_curve,
    draw_pixels,
    draw_published,
    draw_rejecting,
    draw_trainings,
    finish,
    panels,
)
from isarflow.report.published import ADAPTATIONS
from isarflow.report.selection import around, evenly, nearest
from isarflow.report.vocabulary import ACCURACY, at_snrs, select, snr_axis, title
from study import statements as stated
from study.markdown import NONE, NotHere, picture, say, table
from study.statements import HARDER, PROTOCOLS, SPLIT, WORDS, by_sector, ours, value_text

NEARLY = 0.1  # relative: a setting tried that is so near to the published one stands for it


def statements(results, figure):
    """What the document states in numbers and what this run has: a row for each statement."""
    opened, harder = (any(line[key] for line in figure.found) for key in ("score", "sector"))
    heads = {split: f"here, {WORDS[split]}{f', `{name}` thresholds' * opened}" for split, name in PROTOCOLS.items()}
    rows = []
    for line in figure.found:
        snr = line["snr_db"]
        row = {"model": line["name"], "measure": line["words"], "stated": line["stated"]}
        row["SNR [dB]"] = "∞" if np.isinf(snr) else f"{snr:g}"
        row |= {"published": line["published"], heads[SPLIT]: value_text(line["here"], snr)}
        row |= {"as published": stated.KEPT[line["holds"]]}
        row |= {"the same, `blind` thresholds": value_text(line["blind"], snr)} if opened else {}
        rows.append(row | ({heads[HARDER]: value_text(line["sector"], snr)} if harder else {}))
    yield table(rows)


def curves(results, figure):
    """Curves over the SNR, at random with published statements and by sector, and their values.

    Of each model the closed set, and the open set by each of figure.scores. figure.marked: with statements.
    """
    names, metric, experiment, looks = results.names, figure.metric, figure.experiment, {}
    several = len(figure.models) > 1
    for model in figure.there:
        for score in ("", *figure.scores):
            look = names.score(score) if score else names.model(model)
            label = look.label if several else f"open set, {look.label}" if score else "closed set"
            looks[model, score] = {"color": look.color, "marker": look.marker, "label": label}
    every = {
        SPLIT: {case: ours(results, experiment, case[0], metric, case[1], figure.elevation) for case in looks},
        HARDER: {case: by_sector(results, experiment, case[0], metric, case[1]) for case in looks},
    }
    every = {split: {case: rows for case, rows in of.items() if len(rows)} for split, of in every.items()}
    if not every[SPLIT]:
        words = f"scores of experiment `{experiment}` by mean power at these elevations"
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
        draw_rejecting(axes, results.rejecting(opened) if opened else ())
        if split == SPLIT and figure.marked:
            _draw_statements(axes, results, figure, looks)
        axes.set_title(f"{WORDS[split]}{protocol}")
    words = "accuracy" if metric == ACCURACY else "weighted F1"
    finish(drawing, grid, snr_axis("mean"), words)
    whose = ", ".join(look["label"] for look in looks.values()) if several else names.model(figure.there[0]).words
    yield picture(figure.picture, drawing, f"{figure.picture} here: {words} of {whose} against the test SNR.")
    yield stated.values_table(listed)


def _draw_statements(axes, results, figure, looks):
    """Draw the published statements on these curves. looks: of each curve, by model and confidence score."""
    case = {"experiment": figure.experiment, "elevation": figure.elevation, "reading": ["", "maximum"]}
    lines = select(results.published_scores, **case)
    curve = {model: ADAPTATIONS.get(model, (model, "")) for model in lines["model"]}
    colors = {model: looks[of]["color"] for model, of in curve.items() if of in looks}
    draw_published(axes, select(lines, model=list(colors)), colors)


def fitted(results, figure):
    """What the document says of accuracy on the training images, beside ours."""
    for line in figure.found:
        if line["reading"] == "last epoch" and line["here"]:
            curve = results.curves[figure.experiment, line["model"]]
            first = curve["epoch"][curve["accuracy"] >= 0.99995]
            reached = f", and 1.0000 first after epoch {first.iloc[0]:g}" if len(first) else ""
            yield say("fitted", **line, last=line["here"]["ours"], count=len(curve), reached=reached)


def trainings(results, figure):
    """Accuracy of a model trained at each of several SNRs. figure.beside: an experiment trained without noise."""
    (model,), experiment = figure.models, figure.experiment
    label, rows = results.names.model(model).label, ours(results, experiment, model, ACCURACY) if results.learns else ()
    if not len(rows):
        raise NotHere(f"experiment `{experiment}` with {label}, split at random")
    shown = [(trained, curve) for (trained,), curve in results.names.groups(rows, "training")]
    drawing, grid = panels(1, 1, 6.6, 4.2)
    draw_trainings(grid[0, 0], shown, [trained for trained, _ in shown])
    clean = ours(results, figure.beside, model, ACCURACY)
    if len(clean):
        draw_curve(grid[0, 0], clean, BLACK, band=False, ls="--", label="trained without noise (Fig. 4.12)")
        shown.append(("without noise", clean))
    finish(drawing, grid, snr_axis("mean"), "accuracy")
    alt = f"{figure.picture} here: accuracy of {label} against the test SNR, a curve for each training SNR."
    yield picture(figure.picture, drawing, alt)
    yield stated.values_table(shown, "trained at")
    values = {trained: rows.set_index("test_snr_db")["value"] for trained, rows in shown}
    best = []
    for snr in stated.shown_snrs(snr for of in values.values() for snr in of.index):
        at = {trained: of.get(snr, np.nan) for trained, of in values.items()}
        top = [trained for trained, value in at.items() if value == np.nanmax(list(at.values()))]
        best.append(f"at {snr:g} dB {' and '.join(top) if len(top) < 3 else f'{len(top)} alike'}")
    yield f"Best training on the test images: {', '.join(best)}."


def upsampling_effect(results, figure):
    """Accuracy with up-sampling less that of the experiment figure.plain, at the same training and test SNRs."""
    finer, plain = (ours(results, name, figure.models[0], ACCURACY) for name in (figure.experiment, figure.plain))
    on = ["training", "test_snr_db"]
    both = finer.merge(plain[[*on, "value"]], on=on, suffixes=("", "_plain"))
    if len(both):
        snrs = stated.shown_snrs(both["test_snr_db"])
        rows = [
            {"trained at": trained} | at_snrs(curve, snrs, lambda row: signed(row["value"] - row["value_plain"]))
            for (trained,), curve in results.names.groups(both, "training")
        ]
        yield f"Accuracy with up-sampling less that without, same training and test SNRs:\n\n{table(rows)}"


def times(results, figure):
    """Published prediction times beside ours. figure.timed: models of each experiment."""
    rows, lacks = [], []
    for experiment, model in ((name, model) for name, models in figure.timed.items() for model in models):
        printed = select(results.published_times, model=model, experiment=experiment)
        there, count = (
            printed[key].iloc[0] if len(printed) else np.nan
            for key in ("milliseconds_per_observation", "training_observations")
        )
        row = {"model": results.names.model(model).label, "experiment": title(experiment)}
        row |= {"published [ms]": number(there, 5), "training images there": number(count, 6)}
        here = select(results.times, experiment=experiment, model=model) if stated.named(results, experiment) else ()
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


def growth(results, figure):
    """By what prediction times grow from the first experiment of figure.timed to the second; here in batches."""
    few, many = figure.timed
    parts = []
    for model in figure.models:
        named = [name for name in (few, many) if stated.named(results, name)]
        here = [rows for name in named if len(rows := select(results.times, experiment=name, model=model))]
        if len(here) == 2:
            first, second = (rows["batch_ms"].iloc[0] for rows in here)
            there = select(results.published_times, model=model).set_index("experiment")["milliseconds_per_observation"]
            words = f"{second / first:.3g} times ({there[many] / there[few]:.3g})"
            parts.append(f"{results.names.model(model).label} {words}")
    if parts:
        yield say("growth", parts=", ".join(parts))


def hyper_parameters(results, figure):
    """Published settings beside ours, and beside those that searches on validation images choose."""
    searches = {}  # split at random, of models that learn what is without noise
    for (run, model), search in results.searches.items() if results.learns else ():
        own = results.runs[run]
        if own["split"] == SPLIT and training(own) == "clean" and own["elevation"] == "all":
            searches.setdefault(model, search)
    lacking = [f"`{model}_tuned`" for model in figure.models if f"{model}_tuned" not in searches]
    figure.lacks += [f"searches by {', '.join(lacking)}"] if lacking else []
    lines = [
        line for model in figure.models for line in select(results.published_settings, model=model).to_dict("records")
    ]
    yield table([_setting(results, figure, line, searches.get(f"{line['model']}_tuned")) for line in lines])


def _setting(results, figure, line, search):
    """A published setting beside ours, and beside what a search chose. search: the settings tried, or None.

    figure.thresholds: of the settings that are thresholds, the experiment and confidence score here.
    """
    name, own = line["setting"], results.settings["learning"]["models"].get(line["model"], {})
    row = {"model": results.names.model(line["model"]).label, "setting": name}
    row |= {"published": f"{line['value']} ({line['source']})", "here": own.get(name, NONE)}
    case = figure.thresholds.get(name)
    if case and stated.named(results, case["experiment"]):
        case = case | {"model": line["model"], "split": SPLIT, "threshold": "thesis", "elevation": "all"}
        chosen = select(results.scores, **case, metric="threshold")
        if len(chosen):
            top = chosen.loc[chosen["test_snr_db"].idxmax()]
            row["here"] = f"{top['value']:.3f} at {top['test_snr_db']:g} dB"
    if search is not None and name in search:
        best = search.loc[search["validation_accuracy"].idxmax()]
        tried = ", ".join(f"{value:g}" for value in sorted(search[name].unique()))
        alike = search[np.isclose(search[name], float(line["value"]), rtol=NEARLY)]["validation_accuracy"]
        row["chosen on validation images"] = f"{best[name]:g} of {tried}"
        row["accuracy there"] = f"{best['validation_accuracy']:.4f}"
        row["at most with the published value"] = f"{alike.max():.4f}" if len(alike) else NONE
    return row


def images_shown(results, figure):
    """A row of images of each of the first figure.targets known targets, over elevation at figure.snr, or clean.

    figure.count: of a row; figure.around: whether they are at other azimuths, too; figure.headed, figure.alt and
    figure.caption: texts.
    """
    known, lines = _known(results)[: figure.targets], []
    snr = figure.snr if figure.snr == "clean" else nearest(results.settings["noise"]["snr_db"], figure.snr)
    for target in known:
        image = results.images(target, "clean" if snr == "clean" else snr_label(snr)).image
        image = image.isel(realization=0) if "realization" in image.dims else image
        elevations = evenly(image.elevation.values.tolist(), figure.count)
        azimuths = around(image.sizes["azimuth"], figure.count) if figure.around else [0] * len(elevations)
        picked = [
            image.sel(elevation=elevations[place % len(elevations)]).isel(azimuth=azimuth)
            for place, azimuth in enumerate(azimuths)
        ]
        where = [{"elevation": float(one.elevation), "azimuth": float(one.azimuth)} for one in picked]
        heads = [figure.headed.format(target=target, **place) for place in where]
        lines.append([*zip(heads, picked, strict=True)])
    words = {"targets": " and ".join(known), "snr": snr, "count": len(lines[0]), **where[0]}
    yield _pictures(figure, lines, figure.alt.format(**words))
    yield figure.caption.format(**words)


def images_upsampled(results, figure):
    """An image of each of two known targets, as it is and with figure.upsampled pixels a side."""
    known, side, line = _known(results)[:2], figure.upsampled, []
    dataset = results.images(known[0], "clean")
    if "range_wavenumber" not in dataset.attrs or max(dataset.sizes["range"], dataset.sizes["crossrange"]) > side:
        raise NotHere(f"images that can be up-sampled to {side} pixels a side")
    for target in known:
        store = results.folder / "imaging" / target / "clean.zarr"
        azimuths = images.azimuths(store)
        elevation = float(results.images(target, "clean").elevation.sel(elevation=0, method="nearest"))
        where = {target: azimuths[around(len(azimuths), 8)[1:2]]}
        for pixels in ("none", side):
            (image,), _ = images.read([store], where, [elevation], pixels, channels=results.polarizations[:1])
            line.append((f"{target}, {image.shape[0]} × {image.shape[1]}", image))
    alt = f"Images of {' and '.join(known)} as they are and up-sampled to {side} pixels a side."
    yield _pictures(figure, [line], alt)


def _known(results):
    """The known targets. Raises NotHere where there are no images of any."""
    if not results.images_are_made or not results.of_role("known"):
        raise NotHere("images of known targets")
    return results.of_role("known")


def _pictures(figure, lines, alt):
    """A Picture of magnitudes, each of its peak: rows of (title, image), images over (range, crossrange)."""
    count = max(map(len, lines))
    drawing, grid = panels(len(lines), count, 1.3 * count + 0.4, 1.5 * len(lines), False, False, "compressed")
    for places, line in zip(grid, lines, strict=True):
        for axes, (text, image) in zip(places, line, strict=False):
            level = np.abs(image.transpose("range", "crossrange").values if hasattr(image, "dims") else image)
            draw_pixels(axes, level / max(level.max(), 1e-12))
            axes.set(xticks=[], yticks=[])
            axes.set_title(text, fontsize=8)
    finish(drawing, grid, "", legend=False)
    return picture(figure.picture, drawing, alt)
