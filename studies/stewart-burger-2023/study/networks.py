"""Parts of the figures of the thesis's networks: confusion matrices, reconstructions, and thresholds chosen anew.

As of `figures`; among them what the slips of the document make in a run's values.
"""

import numpy as np

from isarflow.report.layout import BLACK, BLUE, VERMILION, number, signed
from isarflow.report.plots import draw_density, draw_matrix, draw_pixels, finish, matrix, panels
from isarflow.report.published import ADAPTATIONS, CLASSES, value_at
from isarflow.report.section_capsule import plain
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import ACCURACY, F1, POWERS, select, snr_axis, training_noise, with_interval
from study import anew
from study import statements as stated
from study.markdown import NONE, PAGE, NotHere, picture, say, table
from study.selection import HIGH_SNR, NETWORKS, everywhere_networks
from study.sentences import gain_text
from study.statements import SPLIT, WORDS, high_snr, judged_anew, ours, value_text

HEADINGS = PAGE["headings"]
EXAMPLES = 5  # reconstructions of a target
BINS = 60


def _everywhere(results, models):
    """(run, model, words) of the fully connected networks that classify images of all azimuths; how they trained."""
    networks = everywhere_networks(results.runs) if results.learns else ()
    return [(run, of, f"trained {stated.trained_words(results.runs[run])}") for run, of in networks if of in models]


def _printed_matrix(results, name):
    """A published confusion matrix (target, predicted)."""
    return select(results.published_confusion, model=name).set_index("true")[CLASSES]


def f1_table(results, figure):
    """Weighted F1 at 24 dB: printed, of the printed matrix, and here by what trained and what is counted."""
    rows = []
    for name in figure.adaptations:
        model, score = ADAPTATIONS[name]
        line = select(results.published_scores, model=name, metric="weighted_f1", snr_db=float(HIGH_SNR))
        row = {"weighted F1 at 24 dB": HEADINGS[name], "printed": line["value"].iloc[0] if len(line) else NONE}
        row["of the printed matrix"] = f"{anew.printed_f1(_printed_matrix(results, name)):.4f}"
        for run, _, words in _everywhere(results, [model]):
            tested = value_at(results, ours(results, run, model, F1, score), HIGH_SNR)
            row[f"here, {words}, test images"] = value_text(tested, HIGH_SNR)
            every = anew.weighted_f1(anew.at_all_azimuths(results, run, model, score, high_snr(results)))
            row[f"here, {words}, all azimuths"] = f"{every:.4f}"
        rows.append(row)
    yield table(rows)


def matrices(results, figure):
    """Confusion matrices, a column for each adaptation: published, ours, and ours of all azimuths."""
    shown = [name for name in figure.adaptations if ADAPTATIONS[name][0] in figure.there]
    if not shown:
        return
    snr, order, columns = high_snr(results), [*results.of_role("known"), *results.of_role("unknown")], []
    for name in shown:
        model, score = ADAPTATIONS[name]
        column = [(f"{HEADINGS[name]},\npublished", _printed_matrix(results, name))]
        cells = stated.open_cells(results, figure.experiment, model, score)
        column += [(f"here at {snr:g} dB, test images", matrix(cells).reindex(order))] if len(cells) else []
        for run, _, words in _everywhere(results, [model]):
            counts = anew.counts(anew.at_all_azimuths(results, run, model, score, high_snr(results)))
            column.append((f"here, all azimuths,\n{words}", counts.reindex(order)))
        columns.append(column)
    rows = max(map(len, columns))
    drawing, grid = panels(rows, len(columns), 0.6 + 3.2 * len(columns), 0.3 + 2.8 * rows, False, False)
    for place, column in enumerate(columns):
        for axes, (text, counts) in zip(grid[:, place], column, strict=False):
            draw_matrix(axes, counts.fillna(0), text)
    finish(drawing, grid, "predicted class", "target", legend=False)
    words = f"confusion matrices of {', '.join(HEADINGS[name] for name in shown)}, as published and here."
    yield picture(figure.picture, drawing, f"{figure.picture}: {words}")


def reconstructions(results, figure):
    """Images and what a network makes of them, a row for each target. figure.kinds: variables and their words."""
    network, kinds = (figure.experiment, figure.models[0]), figure.kinds
    if not judged_anew(results, *network) or network not in results.decoders:
        raise NotHere(f"reconstructions of the capsule network in experiment `{figure.experiment}`, split at random")
    store = results.reconstructions(*network)
    snr = nearest(store.snr.values.tolist(), figure.snr)
    dataset, rows = store.sel(snr=snr).load(), []
    order = [target for target in results.targets if target in dataset.target.values]
    size = 0.8 * len(kinds) * EXAMPLES + 0.5, 0.8 * len(order) + 0.4
    drawing, grid = panels(len(order), len(kinds) * EXAMPLES, *size, False, False, "compressed")
    for row, target in enumerate(order):
        images = dataset.sel(target=target)
        for place, axes in enumerate(grid[row]):
            kind, example = [*kinds][place // EXAMPLES], place % EXAMPLES
            draw_pixels(axes, images[kind].isel(example=example).values)
            axes.set(xticks=[], yticks=[], title=kinds[kind] if (row, example) == (0, EXAMPLES // 2) else "")
        grid[row, 0].set_ylabel(target)
        rows.append({"target": target, **{f"MSE, {words}": number(value) for words, value in _errors(images).items()}})
    finish(drawing, grid, "", legend=False)
    shown = f"five images of each of {', '.join(order)} at {snr:g} dB: {', '.join(kinds.values())}."
    yield picture(figure.picture, drawing, f"{figure.picture} here: {shown}")
    yield f"At {snr:g} dB, of these images:"
    yield table(rows)


def _errors(images):
    """Mean squared errors of reconstructions: beside what the network sees, and beside the image without noise."""
    others = {"input": images.seen, "image without noise": images.truth}
    return {f"reconstruction and {words}": float(((images.made - of) ** 2).mean()) for words, of in others.items()}


def histograms(results, figure):
    """How confidence scores of known and unknown test images lie, with thresholds from validation and test images."""
    network = experiment, model = figure.experiment, figure.models[0]
    if not judged_anew(results, *network):
        raise NotHere(f"the capsule network in experiment `{experiment}`, split at random")
    snr, rows = nearest(results.settings["noise"]["snr_db"], figure.snr), []
    predictions = results.predictions(*network, snr)
    test = select(predictions, side="test")
    drawing, grid = panels(1, len(figure.scores), max(1 + 3.9 * len(figure.scores), 6.6), 3.4, False, False)
    for axes, score in zip(grid.flat, figure.scores, strict=True):
        values, label = plain(score, test[f"known_{score}"]), results.names.score(score).label
        edges = np.linspace(values.min(), max(values.max(), values.min() + 1e-9), BINS + 1)
        for role, color in (("known", BLUE), ("unknown", VERMILION)):
            draw_density(axes, values[test["role"] == role], edges, color, f"{role} targets")
        found = anew.effect(predictions, score, results.settings["seed"])
        for threshold, dash, side in ((found.chosen, "--", "validation"), (found.by_errors, ":", "test")):
            look = {"color": "black", "ls": dash, "lw": 1.2, "label": f"threshold from {side} images"}
            axes.axvline(plain(score, threshold), **look)
        axes.set_xlabel(label)
        case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "metric": "auroc"}
        area = select(results.scores, **case, elevation="all", test_snr_db=snr)
        auroc = with_interval(area.iloc[0]) if len(area) else NONE
        rows.append({"score": label, "AUROC": auroc, **_effect_cells(found, score)})
    finish(drawing, grid, "", "density")
    words = f"histograms of {' and '.join(row['score'] for row in rows)} at {snr:g} dB, known and unknown targets."
    yield picture(figure.picture, drawing, f"{figure.picture} here: {words}")
    yield f"At {snr:g} dB, test images:"
    yield table(rows)


def _effect_cells(found, score):
    """A `anew.Effect` as cells of a table."""
    return {
        "threshold from validation images": number(plain(score, found.chosen)),
        "weighted F1": f"{found.f1:.4f}",
        "threshold from test images, by errors": number(plain(score, found.by_errors)),
        "its weighted F1": f"{found.f1_by_errors:.4f}",
        "what that adds": gain_text(found.gain),
    }


def complex_images(results, figure):
    """A complex network beside the others of its experiment: closed set, open set by each score, reconstruction."""
    every = results.runs.values() if results.learns else ()
    run = next((run for run in every if "capsule_complex" in run["models"] and run["open"]), None)
    if run is None:
        figure.lacks.append("the model `capsule_complex` in the open set")
        return
    experiment, rows = run["experiment"], []
    for model in run["models"]:
        scores = select(results.mean_scores, experiment=experiment, model=model, elevation="all", metric=F1)
        closed, opened = select(scores, threshold=""), select(scores, threshold="thesis")
        row = {"model": results.names.model(model).label}
        row["weighted F1 at 24 dB, closed set"] = value_text(value_at(results, closed, HIGH_SNR), HIGH_SNR)
        if (run["name"], model) in results.decoders:
            store = results.reconstructions(run["name"], model)
            snr = nearest(store.snr.values.tolist(), HIGH_SNR)
            known = [name for name in results.of_role("known") if name in store.target.values]
            for words, error in [*_errors(store.sel(snr=snr, target=known)).items()][1:]:
                row[f"MSE, {words} at {snr:g} dB, known targets"] = number(error)
        for score in results.names.values(opened, "score") if len(opened) else ():
            value = value_at(results, select(opened, score=score), HIGH_SNR)
            row[f"open set, {results.names.score(score).label}"] = value_text(value, HIGH_SNR)
        rows.append(row)
    trained = training_noise(results.settings["learning"]["experiments"][experiment]["train"]["snr_db"])
    yield say("complex_images", experiment=experiment, trained=trained, split=WORDS[run["split"]])
    yield table(rows)


def trained_with_noise(results, figure):
    """(a) Training images at 24 dB instead of without noise."""
    if not judged_anew(results, "fcnn_listing", "fcnn"):
        raise NotHere("experiment `fcnn_listing`")
    listed = []
    for name in (None, *figure.adaptations):
        model, score = ADAPTATIONS.get(name, ("fcnn", ""))
        label = f"open set, weighted F1, {HEADINGS[name]}" if score else "closed set, accuracy"
        for run, _, words in _everywhere(results, [model]):
            listed.append((f"{label}, {words}", ours(results, run, model, F1 if score else ACCURACY, score)))
    yield stated.values_table(listed)


def all_azimuths_counted(results, figure):
    """(b) All azimuths in Fig. 5.4."""
    snr, rows = high_snr(results), []
    for run, model, words in _everywhere(results, ["fcnn", "fcnn_other"]):
        predictions = results.predictions(run, model, snr)
        tested = select(predictions, side="test", role=["known", "unknown"])
        for name in (name for name in figure.adaptations if ADAPTATIONS[name][0] == model):
            score = ADAPTATIONS[name][1]
            every = anew.at_all_azimuths(results, run, model, score, high_snr(results))
            own = anew.weighted_f1(anew.rejecting(tested, score, anew.chosen(predictions, score)))
            f1 = anew.weighted_f1(every)
            row = {"FCNN": f"{HEADINGS[name]}, {words}", "test images": f"{len(tested):,}", "weighted F1": f"{own:.4f}"}
            row |= {"all images": f"{len(every):,}", "their weighted F1": f"{f1:.4f}"}
            rows.append(row | {"what that adds": signed(f1 - own, 4)})
    if not rows:
        raise NotHere("a fully connected network in the open set, split at random")
    yield f"At {snr:g} dB, with the thresholds that the validation images choose:"
    yield table(rows)


def threshold_on_test_images(results, figure):
    """(c) Thresholds from the test images. figure.thresholds: networks, and scores whose thresholds are chosen anew."""
    there = [of for of in figure.thresholds if judged_anew(results, of["experiment"], of["model"])]
    if not there:
        raise NotHere("networks in the open set, split at random")
    snrs, rows, said = sorted(results.settings["noise"]["snr_db"]), [], []
    drawing, grid = panels(1, len(there), max(1 + 3.9 * len(there), 6.6), 3.6)
    for axes, network in zip(grid.flat, there, strict=True):
        tables = [results.predictions(network["experiment"], network["model"], snr) for snr in snrs]
        for score in network["scores"]:
            effects = [anew.effect(predictions, score, results.settings["seed"]) for predictions in tables]
            label, look = results.names.method(network["model"], score), results.names.score(score)
            axes.plot(snrs, [found.f1 for found in effects], color=look.color, marker=look.marker, label=look.label)
            axes.plot(snrs, [found.f1_by_errors for found in effects], color=look.color, ls="--")
            rows.append({"": label, **_effect_cells(effects[snrs.index(high_snr(results))], score)})
            gains = [found.f1_by_errors - found.f1 for found in effects]
            said.append(f"{label} {signed(min(gains), 4)} to {signed(max(gains), 4)}")
        axes.set_title(results.names.model(network["model"]).label)
    grid[0, 0].plot([], [], color=BLACK, ls="--", label="threshold from the test images, by errors")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    alt = "Weighted F1 against the test SNR with thresholds from validation images, and by errors from test images."
    yield f"At {high_snr(results):g} dB, split at random:"
    yield table(rows)
    yield picture("Slips, threshold", drawing, alt)
    yield f"What it adds over all SNRs: {'; '.join(said)}."


def by_both_powers(results, figure):
    """(d) The definition of SNR. figure.by_power: curves that are shown by both."""
    if not results.images_are_made:
        raise NotHere("images")
    targets, listed = [*results.of_role("known"), *results.of_role("unknown")], []
    attrs = {name: results.images(name, "clean").attrs for name in targets}
    offsets = [f"{name} {of['snr_definition_offset_db']:.1f} dB" for name, of in attrs.items()]
    for case in (case for case in figure.by_power if stated.own_run(results, case["experiment"])):
        method = results.names.method(case["model"], case["score"])
        words = f"{method}, {'weighted F1' if case['score'] else 'accuracy'}, SNR by"
        for definition, scores in results.by_definition.items():
            listed.append((f"{words} {POWERS[definition]}", select(scores, **case, split=SPLIT, elevation="all")))
    if offsets:
        yield say("by_both_powers", offsets=", ".join(offsets))
    yield stated.values_table(listed)


def reconstruction_weight(results, figure):
    """(e) The weight of the reconstruction."""
    own = results.settings["learning"]["models"].get("capsule", {}).get("reconstruction")
    yield say("reconstruction_weight", here=f" Here it is {own:g} times the mean." if own is not None else "")


def matrix_and_table(results, figure):
    """(f) What Table 5.2 prints is not what Fig. 5.4 has."""
    parts = []
    for name in figure.adaptations:
        printed = select(results.published_scores, model=name, metric="weighted_f1")["value"].iloc[0]
        computed = anew.printed_f1(_printed_matrix(results, name))
        parts.append(f"{HEADINGS[name]} {printed} printed, {computed:.4f} from the matrix")
    yield say("matrix_and_table", parts="; ".join(parts))


def lacking_networks(results, figure):
    """Nothing to show: only which of the thesis's networks are not there."""
    networks = [(run, model) for run, model in NETWORKS if model != "fcnn_other"]
    lacking = [f"`{run}`" for run, model in networks if not judged_anew(results, run, model)]
    figure.lacks += [f"experiments in the open set, split at random: {', '.join(lacking)}"] if lacking else []
    return ()
