"""Parts of the figures of the thesis's networks: confusion matrices, reconstructions, and thresholds chosen anew.

As of `figures`; among them what the slips of the document make in a run's values.
"""

import numpy as np
import pandas as pd

from isarflow.learning.experiments import training
from isarflow.report.layout import BLACK, BLUE, VERMILION, number, signed
from isarflow.report.plots import draw_matrix, draw_pixels, finish, panels
from isarflow.report.published import ADAPTATIONS, value_at
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import ACCURACY, F1, POWERS, select, snr_axis, training_noise, with_interval
from study import anew
from study import statements as stated
from study.anew import nearest_snr, plain
from study.markdown import NONE, NotHere, picture, say, table
from study.selection import HIGH_SNR, PAGE, everywhere_networks
from study.statements import SPLIT, WORDS, judged_anew, ours, value_text

HEADINGS = PAGE["headings"]
EXAMPLES = 5  # reconstructions of a target
BINS = 60


def _everywhere(results, *models):
    """Return (run, model, words) of the networks that classify images of all azimuths; words: how they trained."""
    found = [(run, model, training(results.runs[run])) for run, model in everywhere_networks(results.runs)]
    return [(run, of, f"trained at {at}".replace("at clean", "without noise")) for run, of, at in found if of in models]


def f1_table(results, figure):
    """List the weighted F1 at 24 dB: printed, of the printed matrix, and here by what trained and what is counted."""
    rows = []
    for name in figure.adaptations:
        model, score = ADAPTATIONS[name]
        line = select(results.published_scores, model=name, metric="weighted_f1", snr_db=float(HIGH_SNR))
        row = {"weighted F1 at 24 dB": HEADINGS[name], "printed": line["value"].iloc[0] if len(line) else NONE}
        row["of the printed matrix"] = f"{anew.printed_matrix(results, name)[1]:.4f}"
        for run, _, words in _everywhere(results, model):
            tested = value_at(results, ours(results, run, model, F1, score), HIGH_SNR)
            row[f"here, {words}, test images"] = value_text(tested, HIGH_SNR)
            every = anew.weighted_f1(anew.at_all_azimuths(results, run, model, score))
            row[f"here, {words}, all azimuths"] = f"{every:.4f}"
        rows.append(row)
    yield table(rows)


def matrices(results, figure):
    """Draw confusion matrices, a column for each adaptation: published, ours, and ours of all azimuths."""
    if not figure.there:
        return
    order, columns = results.of_role("known") + results.of_role("unknown"), []
    for name in figure.adaptations:
        model, score = ADAPTATIONS[name]
        column = [(f"{HEADINGS[name]},\npublished", anew.printed_matrix(results, name)[0])]
        counts = stated.open_counts(results, figure.experiment, model, score)
        if len(counts):
            column.append((f"here at {nearest_snr(results):g} dB, test images", counts.reindex(order)))
        for run, _, words in _everywhere(results, model):
            every = anew.at_all_azimuths(results, run, model, score)
            counts = pd.crosstab(every["target"], every["predicted"])
            column.append((f"here, all azimuths,\n{words}", counts.reindex(order)))
        columns.append(column)
    rows = max(map(len, columns))
    drawing, grid = panels(rows, len(columns), 0.6 + 3.2 * len(columns), 0.3 + 2.8 * rows, False, False)
    for place, column in enumerate(columns):
        for axes, (text, counts) in zip(grid[:, place], column, strict=False):
            draw_matrix(axes, counts.fillna(0), text)
    finish(drawing, grid, "predicted class", "target", legend=False)
    words = f"confusion matrices of {', '.join(HEADINGS[name] for name in figure.adaptations)}, as published and here."
    yield picture(figure.picture, drawing, f"{figure.picture}: {words}")


def reconstructions(results, figure):
    """Draw images and what a network makes of them, a row for each target. figure.kinds: variables and their words."""
    if not figure.there:
        return
    store, kinds = results.reconstructions(figure.experiment, figure.models[0]), figure.kinds
    snr = nearest(store.snr.values.tolist(), figure.snr)
    dataset, rows = store.sel(snr=snr).load(), []
    order = [target for target in results.targets if target in dataset.target.values]
    size = 0.8 * len(kinds) * EXAMPLES + 0.5, 0.8 * len(order) + 0.4
    drawing, grid = panels(len(order), len(kinds) * EXAMPLES, *size, False, False, "compressed")
    for row, target in enumerate(order):
        images = dataset.sel(target=target)
        for axes, image in zip(grid[row], (image for kind in kinds for image in images[kind].values), strict=True):
            draw_pixels(axes, image)
            axes.set(xticks=[], yticks=[])
        grid[row, 0].set_ylabel(target)
        rows.append({"target": target, **{f"MSE, {words}": number(value) for words, value in _errors(images).items()}})
    for axes, words in zip(grid[0, EXAMPLES // 2 :: EXAMPLES], kinds.values(), strict=True):
        axes.set_title(words)
    finish(drawing, grid, "", legend=False)
    shown = f"five images of each of {', '.join(order)} at {snr:g} dB: {', '.join(kinds.values())}."
    yield picture(figure.picture, drawing, f"{figure.picture} here: {shown}")
    yield f"At {snr:g} dB, of these images:"
    yield table(rows)


def _errors(images):
    """Return mean squared errors of reconstructions: beside what the network sees, and beside the noiseless image."""
    others = {"input": images.seen, "image without noise": images.truth}
    return {f"reconstruction and {words}": float(((images.made - of) ** 2).mean()) for words, of in others.items()}


def histograms(results, figure):
    """Draw the confidence scores of known and unknown test images, with thresholds from validation and test images."""
    if not figure.there:
        return
    network = experiment, model = figure.experiment, figure.models[0]
    snr, rows = nearest_snr(results, figure.snr), []
    test = select(results.predictions(*network, snr), side="test")
    drawing, grid = panels(1, len(figure.scores), max(1 + 3.9 * len(figure.scores), 6.6), 3.4, False, False)
    for axes, score in zip(grid.flat, figure.scores, strict=True):
        values, label = plain(score, test[f"known_{score}"]), results.names.score(score).label
        edges = np.linspace(values.min(), max(values.max(), values.min() + 1e-9), BINS + 1)
        for role, color in (("known", BLUE), ("unknown", VERMILION)):
            draw_density(axes, values[test["role"] == role], edges, color, f"{role} targets")
        found = anew.judged(results, *network, score, snr)
        for name, dash, side in (("validation", "--", "validation"), ("errors", ":", "test")):
            look = {"color": "black", "ls": dash, "lw": 1.2, "label": f"threshold from {side} images"}
            axes.axvline(plain(score, found.thresholds[name]), **look)
        axes.set_xlabel(label)
        case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "metric": "auroc"}
        area = select(results.scores, **case, elevation="all", test_snr_db=snr).to_dict("records")
        rows.append({"score": label, "AUROC": with_interval(area[0]) if area else NONE, **found.cells(score)})
    finish(drawing, grid, "", "density")
    words = f"histograms of {' and '.join(row['score'] for row in rows)} at {snr:g} dB, known and unknown targets."
    yield picture(figure.picture, drawing, f"{figure.picture} here: {words}")
    yield f"At {snr:g} dB, test images:"
    yield table(rows)


def draw_density(axes, values, edges, color, label):
    """Draw a histogram of values as a density."""
    counts = np.histogram(values, edges)[0]
    density = counts / max(counts.sum(), 1) / np.diff(edges)
    axes.stairs(density, edges, fill=True, alpha=0.45, color=color, label=label)
    axes.stairs(density, edges, color=color)


def complex_images(results, figure):
    """List a complex network beside the others of its experiment: closed set, open set, reconstruction."""
    run = next((run for run in results.runs.values() if "capsule_complex" in run["models"] and run["open"]), None)
    if run is None:
        figure.lacks.append("the model `capsule_complex` in the open set")
        return
    experiment, rows = run["experiment"], []
    for model in run["models"]:
        scores = select(results.mean_scores, experiment=experiment, model=model, elevation="all", metric=F1)
        closed, opened = select(scores, threshold=""), select(scores, threshold="thesis")
        row = {"model": results.names.model(model).label}
        row["weighted F1 at 24 dB, closed set"] = value_text(value_at(results, closed, HIGH_SNR), HIGH_SNR)
        store = results.reconstructions(run["name"], model)
        snr = nearest(store.snr.values.tolist(), HIGH_SNR)
        *_, (words, error) = _errors(store.sel(snr=snr, target=results.of_role("known"))).items()
        row[f"MSE, {words} at {snr:g} dB, known targets"] = number(error)
        for (score,), curve in results.names.groups(opened, "score"):
            value = value_at(results, curve, HIGH_SNR)
            row[f"open set, {results.names.score(score).label}"] = value_text(value, HIGH_SNR)
        rows.append(row)
    trained = training_noise(results.settings["learning"]["experiments"][experiment]["train"]["snr_db"])
    yield say("complex_images", experiment=experiment, trained=trained, split=WORDS[run["split"]])
    yield table(rows)


def trained_with_noise(results, figure):
    """(a) List training images at 24 dB instead of without noise."""
    if not judged_anew(results, "fcnn_listing", "fcnn"):
        raise NotHere("experiment `fcnn_listing`")
    cases = {"closed set, accuracy": ("fcnn", "", ACCURACY)}
    cases |= {f"open set, weighted F1, {HEADINGS[name]}": (*ADAPTATIONS[name], F1) for name in figure.adaptations}
    curves = (
        (f"{label}, {words}", ours(results, run, model, metric, score))
        for label, (model, score, metric) in cases.items()
        for run, _, words in _everywhere(results, model)
    )
    yield stated.values_table([*curves])


def all_azimuths_counted(results, figure):
    """(b) List all azimuths in Fig. 5.4."""
    snr, rows = nearest_snr(results), []
    for run, model, words in _everywhere(results, "fcnn", "fcnn_other"):
        for name in (name for name in figure.adaptations if ADAPTATIONS[name][0] == model):
            network = results, run, model, ADAPTATIONS[name][1]
            tested, every = anew.judged(*network, snr), anew.at_all_azimuths(*network)
            own, f1 = tested.metrics["validation"][F1], anew.weighted_f1(every)
            row = {"FCNN": f"{HEADINGS[name]}, {words}", "test images": f"{tested.images:,}"}
            row |= {"weighted F1": f"{own:.4f}", "all images": f"{len(every):,}"}
            rows.append(row | {"their weighted F1": f"{f1:.4f}", "what that adds": signed(f1 - own, 4)})
    if not rows:
        raise NotHere("a fully connected network in the open set, split at random")
    yield f"At {snr:g} dB, with the thresholds that the validation images choose:"
    yield table(rows)


def threshold_on_test_images(results, figure):
    """(c) Draw and list thresholds from the test images. figure.thresholds: networks and scores that are shown."""
    there = [of for of in figure.thresholds if judged_anew(results, of["experiment"], of["model"])]
    if not there:
        raise NotHere("networks in the open set, split at random")
    snrs, rows, said = sorted(results.settings["noise"]["snr_db"]), [], []
    drawing, grid = panels(1, len(there), max(1 + 3.9 * len(there), 6.6), 3.6)
    for axes, network in zip(grid.flat, there, strict=True):
        experiment, model = network["experiment"], network["model"]
        for score in network["scores"]:
            found = {snr: anew.judged(results, experiment, model, score, snr) for snr in snrs}
            own, by_errors = ([of.metrics[name][F1] for of in found.values()] for name in ("validation", "errors"))
            label, look = results.names.method(model, score), results.names.score(score)
            axes.plot(snrs, own, color=look.color, marker=look.marker, label=look.label)
            axes.plot(snrs, by_errors, color=look.color, ls="--")
            rows.append({"": label, **found[nearest_snr(results)].cells(score)})
            gains = np.subtract(by_errors, own)
            said.append(f"{label} {signed(gains.min(), 4)} to {signed(gains.max(), 4)}")
        axes.set_title(results.names.model(model).label)
    grid[0, 0].plot([], [], color=BLACK, ls="--", label="threshold from the test images, by errors")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    alt = "Weighted F1 against the test SNR with thresholds from validation images, and by errors from test images."
    yield f"At {nearest_snr(results):g} dB, split at random:"
    yield table(rows)
    yield picture("Slips, threshold", drawing, alt)
    yield f"What it adds over all SNRs: {'; '.join(said)}."


def by_both_powers(results, figure):
    """(d) List curves by both definitions of SNR. figure.by_power: which."""
    listed = []
    for words, case in figure.by_power.items():
        for definition, scores in results.by_definition.items() if stated.own_run(results, case["experiment"]) else ():
            curve = select(scores, **case, split=SPLIT, elevation="all")
            listed.append((f"{words}, SNR by {POWERS[definition]}", curve))
    yield stated.values_table(listed)


def lacking_networks(results, figure):
    """Name those of the thesis's networks that are not there; show nothing."""
    networks = [name.split("/") for name in PAGE["networks"] if not name.endswith("_other")]
    lacking = [f"`{run}`" for run, model in networks if not judged_anew(results, run, model)]
    figure.lacks += [f"experiments in the open set, split at random: {', '.join(lacking)}"] if lacking else []
    return ()
