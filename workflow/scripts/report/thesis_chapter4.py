"""Chapter 4 of the thesis: logistic regression, support vector machine and nearest neighbours in the closed set."""

import numpy as np

from learning import images
from learning.experiments import training
from report import thesis_reasons as why
from report.layout import BLACK, signed
from report.plots import draw_curve, draw_trainings, finish, panels
from report.published import CLOSED
from report.section_times import CONDITIONS
from report.selection import around, evenly
from report.thesis_compare import (
    HARDER,
    SPLIT,
    WORDS,
    Panel,
    by_sector,
    curves_picture,
    judge_one,
    judged,
    kept_text,
    named,
    ours,
    present,
    shown_snrs,
    statement_table,
    value_text,
    values_table,
)
from report.thesis_markdown import NONE, Entry, picture, table
from report.thesis_parts import TUNED, images_picture, times_entry, tuning_effect
from report.vocabulary import ACCURACY, at_snrs, select, snr_axis

MODELS = ("lr", "svm", "knn")
SCORES = {"softmax threshold": "softmax", "OpenMax threshold": "openmax"}  # of the FCNN's published thresholds
ELEVATIONS = 7  # images of fig. 4.9
UPSAMPLED = 64  # pixels a side
NEARLY = 0.1  # relative: a setting tried that is so near to the published one stands for it


def table_4_1(results):
    """Hyper-parameters, and what searches on validation images choose among."""
    rows, missing = [], []
    for model, tuned in TUNED.items():
        search = _search(results, tuned)
        missing += [f"`{tuned}`"] if search is None else []
        for line in select(results.published_settings, model=model).to_dict("records"):
            rows.append(_setting(results, line, search))
    effects = [tuning_effect(results, model) for model in TUNED]
    return Entry(
        ("Table 4.1",),
        "hyper-parameters",
        "λ of LR and k of KNN were read off plots of the accuracy on a small validation set without noise; the SVM's "
        "came from MATLAB's grid search. Those of the FCNN stand in chapter 5.",
        missing=f"searches by {', '.join(missing)}" if missing else "",
        blocks=(table(rows), *(effect for effect in effects if effect)),
        why=(
            "The document does not say among which values it searched; here every combination of the config's lists is "
            "tried, and the most accurate on the images at the validation azimuths is taken, the first of equals.",
        ),
    )


def _setting(results, line, search):
    """A published setting beside ours, and beside what a search chose. search: the settings tried, or None."""
    name, own = line["setting"], results.settings["learning"]["models"].get(line["model"], {})
    row = {"model": results.names.model(line["model"]).label, "setting": name}
    row |= {"published": f"{line['value']} ({line['source']})", "here": own.get(name, NONE)}
    if name in SCORES and named(results, "fcnn_open"):
        case = {"experiment": "fcnn_open", "model": line["model"], "split": SPLIT, "score": SCORES[name]}
        chosen = select(results.scores, **case, threshold="thesis", metric="threshold", elevation="all")
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


def _search(results, tuned):
    """The settings tried of a model that has a choice, where it is split at random and learns what is without noise."""
    for (run, model), search in results.searches.items() if results.learns else ():
        own = results.runs[run]
        if model == tuned and own["split"] == SPLIT and training(own) == "clean" and own["elevation"] == "all":
            return search
    return None


def _closed(results, name, title, did, experiment, condition, elevation, reasons):
    """A figure of accuracy against the SNR of the models trained at one set of images.

    condition: of its published statements; elevation: 'trained' or 'all', those tested.
    """
    models, lacks = present(results, experiment, MODELS)
    random = {model: ours(results, experiment, model, ACCURACY, elevation=elevation) for model in models}
    if models and not any(map(len, random.values())):
        models, lacks = [], f"scores of experiment `{experiment}` by mean power at these elevations"
    statements = select(results.published_scores, experiment=experiment, condition=condition, metric=list(CLOSED))
    found = judged(results, statements, models)
    blocks = [statement_table(found)]
    if models:
        looks = {model: results.names.model(model) for model in models}
        harder = (
            {model: by_sector(results, experiment, model, ACCURACY) for model in models} if elevation == "all" else {}
        )
        shown, listed = [], []
        for split, curves in ((SPLIT, random), (HARDER, {model: rows for model, rows in harder.items() if len(rows)})):
            lines = [
                (rows, {"color": looks[model].color, "marker": looks[model].marker, "label": looks[model].label})
                for model, rows in curves.items()
            ]
            drawn = statements if split == SPLIT else None
            shown += [Panel(WORDS[split], lines, drawn, {m: look.color for m, look in looks.items()})] if lines else []
            listed += [(f"{looks[model].label}, {WORDS[split]}", rows) for model, rows in curves.items()]
        shown[0] = shown[0]._replace(statements=select(statements, model=models))
        words = ", ".join(look.label for look in looks.values())
        alt = f"{name} here: accuracy of {words} against the test SNR."
        blocks += [curves_picture(name, shown, "accuracy", alt), values_table(listed)]
    topics = (why.trained_on, experiment, *MODELS), (why.parameters, *MODELS)
    return Entry((name,), title, did, found, lacks, tuple(blocks), (*why.reasons(results, *topics), *reasons))


def fig_4_7(results):
    return _closed(
        results,
        "Fig. 4.7",
        "trained and tested at one elevation",
        "LR, SVM and KNN learned 340 images without noise of two targets at elevation 0, 70 % of the azimuths; "
        "tested on the others at the same elevation.",
        "single_elevation",
        "test at elevation 0",
        "trained",
        why.reasons(results, why.penalty),
    )


def fig_4_9(results):
    """Figs. 4.8 and 4.9: one known target at one azimuth over elevation."""
    names, title = ("Fig. 4.8", "Fig. 4.9"), "a target at one azimuth, over elevation"
    did = "Images of the drone at azimuth 0, at elevation 0 and at others from -45 to 45 degrees."
    if not results.images_are_made or not results.of_role("known"):
        return Entry(names, title, did, missing="images of a known target")
    target = results.of_role("known")[0]
    image = results.images(target, "clean").image.isel(azimuth=0)
    shown = evenly(image.elevation.values.tolist(), ELEVATIONS)
    line = [(f"{elevation:g}°", image.sel(elevation=elevation)) for elevation in shown]
    alt = f"Images of {target} at azimuth {float(image.azimuth):g}° and {len(shown)} elevations."
    return Entry(names, title, did, blocks=(images_picture(names[1], [line], alt),))


def fig_4_10(results):
    return _closed(
        results,
        "Fig. 4.10",
        "trained at one elevation, tested at all",
        "The models of Fig. 4.7, tested on images at all 19 elevations from -45 to 45 degrees.",
        "single_elevation",
        "test at all elevations",
        "all",
        why.reasons(results, why.penalty),
    )


def fig_4_12(results):
    return _closed(
        results,
        "Fig. 4.12",
        "trained and tested at all elevations",
        "LR, SVM and KNN learned 6,460 images without noise at all 19 elevations, 70 % of the azimuths. The SVM fits "
        "all of them, which this run does not record.",
        "multi_elevation",
        "",
        "all",
        (*why.reasons(results, why.penalty), *(tuning_effect(results, model) for model in MODELS)),
    )


def table_4_2(results):
    experiments = "single_elevation", "multi_elevation"
    entry = times_entry(
        results,
        "Table 4.2",
        "prediction times of LR, SVM and KNN",
        "Average milliseconds an image, for 340 and for 6,460 training images.",
        [(experiment, model) for experiment in experiments for model in MODELS],
    )
    grown = [words for model in MODELS if (words := _growth(results, model, experiments))]
    words = f"From one elevation to all, times grow (published in brackets): {', '.join(grown)}." if grown else ""
    return entry._replace(blocks=(*entry.blocks, words) if words else entry.blocks)


def _growth(results, model, experiments):
    """By what a model's prediction time grows from the one experiment to the other, in words; here in batches."""
    if not all(named(results, experiment) for experiment in experiments):
        return ""
    times = [select(results.times, experiment=name, model=model) for name in experiments]
    if not all(map(len, times)):
        return ""
    few, many = (rows["batch_ms"].iloc[0] for rows in times)
    printed = select(results.published_times, model=model).set_index("condition")["milliseconds_per_observation"]
    theirs = printed[CONDITIONS[experiments[1]]] / printed[CONDITIONS[experiments[0]]]
    return f"{results.names.model(model).label} {many / few:.3g} times ({theirs:.3g})"


def fig_4_13(results):
    return _trained_at_each(
        results,
        "Fig. 4.13",
        "lr",
        "noisy_training",
        "LR learned images at one SNR, three noise realizations of each, at SNRs from 24 to -24 dB. Training at 24 "
        "to 0 dB costs little at 24 dB and helps at lower test SNRs; training below 0 dB harms.",
    )


def fig_4_14(results):
    return _trained_at_each(
        results,
        "Fig. 4.14",
        "svm",
        "noisy_training",
        "The same of the SVM: trained at 24 to 0 dB it loses a little above 3 dB, trained below -3 dB much; training "
        "without noise is best overall.",
    )


def fig_4_16(results):
    return _trained_at_each(
        results,
        "Fig. 4.16",
        "lr",
        "upsampling",
        "LR as in Fig. 4.13 on images up-sampled to 64 x 64: worse at moderate to high SNRs, better for low ones.",
    )


def fig_4_17(results):
    return _trained_at_each(
        results,
        "Fig. 4.17",
        "svm",
        "upsampling",
        "The SVM as in Fig. 4.14 on images up-sampled to 64 x 64: less than 70 % everywhere; the document suspects its "
        "hyper-parameters, which were chosen with an eye on time.",
    )


def _trained_at_each(results, name, model, experiment, did):
    """Accuracy of a model trained at each of several SNRs, against the test SNR."""
    label, finer = results.names.model(model).label, experiment == "upsampling"
    title = f"{label} trained at several SNRs{', up-sampled images' if finer else ''}"
    rows = ours(results, experiment, model, ACCURACY) if results.learns else ()
    lines = select(results.published_scores, experiment=experiment, model=model, metric=ACCURACY).to_dict("records")
    found = tuple(_at_trainings(line, label, rows) for line in lines)
    statements = table([_said_at_trainings(line) for line in found])
    if not len(rows):
        words = f"experiment `{experiment}` with {label}, split at random"
        return Entry((name,), title, did, found, words, (statements,) if statements else ())
    curves = [(trained, curve) for (trained,), curve in results.names.groups(rows, "training")]
    drawing, grid = panels(1, 1, 6.6, 4.2)
    draw_trainings(grid[0, 0], curves, [trained for trained, _ in curves])
    clean = () if finer else ours(results, "multi_elevation", model, ACCURACY)
    if len(clean):
        draw_curve(grid[0, 0], clean, BLACK, band=False, ls="--", label="trained without noise (Fig. 4.12)")
        curves.append(("without noise", clean))
    finish(drawing, grid, snr_axis("mean"), "accuracy")
    alt = f"{name} here: accuracy of {label} against the test SNR, a curve for each training SNR."
    blocks = [statements, picture(name, drawing, alt), values_table(curves, "trained at"), _best_trainings(curves)]
    reasons = why.reasons(results, (why.trained_on, experiment, model), (why.parameters, model))
    if finer:
        blocks.append(_upsampling_effect(results, model, rows))
        scale = results.settings["learning"]["models"][model].get("scale")
        reasons += why.reasons(results, (why.pixels, UPSAMPLED, scale)) if scale else ()
    return Entry((name,), title, did, found, "", tuple(filter(None, blocks)), reasons)


def _best_trainings(curves):
    """Which training SNR is best at each of some test SNRs, in a sentence. curves: (training, rows by SNR)."""
    values = {trained: rows.set_index("test_snr_db")["value"] for trained, rows in curves}
    best = []
    for snr in shown_snrs(snr for of in values.values() for snr in of.index):
        at = {trained: of.get(snr, np.nan) for trained, of in values.items()}
        top = [trained for trained, value in at.items() if value == np.nanmax(list(at.values()))]
        best.append(f"at {snr:g} dB {' and '.join(top) if len(top) < 3 else f'{len(top)} alike'}")
    return f"Best training on the test images: {', '.join(best)}."


def _at_trainings(line, label, rows):
    """A published statement on several training SNRs as of `judge_one`. rows: ours, of all of them."""
    if not len(rows):
        return judge_one(line, label, "accuracy", None)
    if line["condition"] == "any training SNR":
        here = rows.loc[rows["value"].idxmax()]
    else:  # trained below a level: the noisiest training of the run, at the highest test SNR
        noisiest = rows[rows["train_snr_db"] == rows["train_snr_db"].min()]
        here = noisiest.loc[noisiest["test_snr_db"].idxmax()]
    return judge_one(line, f"{label} trained at {here['training']}", "accuracy", here, here["test_snr_db"])


def _said_at_trainings(line):
    """A row of a table of such a statement."""
    here = line["here"]
    return {
        "stated": line["stated"],
        "published": line["published"],
        "here": f"{line['name']}, at {here['here_at_snr_db']:g} dB: {value_text(here, here['here_at_snr_db'])}"
        if here
        else NONE,
        "as published": kept_text(line["holds"]),
    }


def _upsampling_effect(results, model, finer):
    """Accuracy with up-sampling less that without, at the same training and test SNRs, as a table."""
    plain = ours(results, "noisy_training", model, ACCURACY)[["training", "test_snr_db", "value"]]
    both = finer.merge(plain, on=["training", "test_snr_db"], suffixes=("", "_plain"))
    if not len(both):
        return ""
    snrs = shown_snrs(both["test_snr_db"])
    rows = [
        {"trained at": trained} | at_snrs(curve, snrs, lambda row: signed(row["value"] - row["value_plain"]))
        for (trained,), curve in results.names.groups(both, "training")
    ]
    return f"Accuracy with up-sampling less that without, same training and test SNRs:\n\n{table(rows)}"


def fig_4_15(results):
    """An image of each of two known targets, as it is and up-sampled."""
    names, title = ("Fig. 4.15",), "images and their up-sampling"
    did = "An image of the drone and one of the missile, 27 x 21 pixels, and both by a Fourier transform of 64 points."
    known = results.of_role("known")[:2]
    if not results.images_are_made or not known:
        return Entry(names, title, did, missing="images of known targets")
    dataset = results.images(known[0], "clean")
    if "range_wavenumber" not in dataset.attrs or max(dataset.sizes["range"], dataset.sizes["crossrange"]) > UPSAMPLED:
        return Entry(names, title, did, missing=f"images that can be up-sampled to {UPSAMPLED} pixels a side")
    line = []
    for target in known:
        store = results.folder / "imaging" / target / "clean.zarr"
        azimuths = images.azimuths(store)
        elevation = float(results.images(target, "clean").elevation.sel(elevation=0, method="nearest"))
        where = {target: azimuths[around(len(azimuths), 8)[1:2]]}
        for pixels in ("none", UPSAMPLED):
            (image,), _ = images.read([store], where, [elevation], pixels, channels=results.polarizations[:1])
            line.append((f"{target}, {image.shape[0]} × {image.shape[1]}", image))
    alt = f"Images of {' and '.join(known)} as they are and up-sampled to {UPSAMPLED} pixels a side."
    return Entry(names, title, did, blocks=(images_picture(names[0], [line], alt),))


def table_4_3(results):
    return times_entry(
        results,
        "Table 4.3",
        "prediction times with up-sampling",
        "Average milliseconds an image of the models of Figs. 4.13 to 4.17. Its time of LR without up-sampling, "
        "0.0056 ms, is a seventh of that in Table 4.2, which is of a model of the same kind and size.",
        [(experiment, model) for experiment in ("noisy_training", "upsampling") for model in MODELS[:2]],
    )


ENTRIES = (
    table_4_1,
    fig_4_7,
    fig_4_9,
    fig_4_10,
    fig_4_12,
    table_4_2,
    fig_4_13,
    fig_4_14,
    fig_4_15,
    fig_4_16,
    fig_4_17,
    table_4_3,
)
