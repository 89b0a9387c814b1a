"""Chapter 5 of the thesis: the fully connected network and the capsule network, in the closed and in the open set."""

import numpy as np

from core.sweep import snr_label
from learning.classifier import OTHER
from report import thesis_anew as anew
from report import thesis_reasons as why
from report.layout import BLUE, VERMILION, number
from report.plots import draw_density, draw_pixels, finish, panels
from report.published import ADAPTATIONS, value_at
from report.section_capsule import plain
from report.selection import HIGH_SNR, LOW_SNR, around, evenly, nearest
from report.thesis_chapter4 import MODELS
from report.thesis_compare import (
    HARDER,
    SPLIT,
    WORDS,
    by_sector,
    judge_one,
    judged,
    named,
    ours,
    present,
    statement_table,
    value_text,
)
from report.thesis_markdown import NONE, Entry, anchor, picture, table
from report.thesis_networks import (
    FCNN,
    curves_of,
    effect_cells,
    f1_table,
    high_snr,
    judged_anew,
    matrices,
    network_entry,
    open_cells,
    own_reasons,
    threshold_effects,
    with_training,
)
from report.thesis_parts import images_picture, times_entry, tuning_effect
from report.vocabulary import ACCURACY, F1, select, training_noise, with_interval

CAPSULE = "capsule_open", "capsule"  # experiment and model
EXAMPLES = 5
BINS = 60
NOISY_SNR = 3  # dB, of figs. 5.12 and 5.13
TITLES = {"Fig. 5.3": "FCNN in the closed set", "Fig. 5.6": "capsule network in the closed set"}
# What other figures of the same network say of it.
AS_5_3, AS_5_6 = (
    f"The network and its training: as of [{name}](#{anchor(f'{name}: {title}')})." for name, title in TITLES.items()
)
TRIED = ("mse", "zncc", "length", "mixture")  # confidence scores of the capsule network, the last two given up


def fig_5_3(results):
    entry = network_entry(
        results,
        "Fig. 5.3",
        TITLES["Fig. 5.3"],
        "A network of 756 hidden units, trained for five epochs on the 6,460 images without noise of Fig. 4.12.",
        ("fcnn_open", "fcnn"),
        ACCURACY,
        (),
        "fcnn",
        (*own_reasons(results, "fcnn_open", "fcnn"), tuning_effect(results, "fcnn")),
    )
    return with_training(results, entry, "fcnn_open", "fcnn")


def table_5_1(results):
    return times_entry(
        results,
        "Table 5.1",
        "prediction times of FCNN, SVM and KNN",
        "Average milliseconds an image. By its numbers the FCNN is 29 times as fast as the SVM and 1,100 times as "
        "the KNN; its text says two and three orders of magnitude.",
        [("fcnn_open", "fcnn"), ("multi_elevation", "svm"), ("multi_elevation", "knn")],
    )


def fig_5_4(results):
    """Confusion matrices and weighted F1 of the three adaptations of the FCNN to the open set."""
    there, lacks = present(results, "fcnn_open", ["fcnn", "fcnn_other"], is_open=True)
    statements = select(results.published_scores, experiment="fcnn_open", metric="weighted_f1")
    found, shown = judged(results, statements, there), [name for name in FCNN if ADAPTATIONS[name][0] in there]
    blocks = [statement_table(found), f1_table(results, FCNN)]
    blocks += [matrices(results, "Fig. 5.4", "fcnn_open", shown)] if shown else []
    rejected = tuple(
        _rejected(results, line) for line in select(results.published_scores, metric="recall_ufo").to_dict("records")
    )
    return Entry(
        ("Fig. 5.4", "Table 5.2"),
        "three adaptations of the FCNN to the open set",
        "At 24 dB: softmax with a threshold (0.997), OpenMax (tail 5, alpha 1, threshold 0.996), and a class 'other' "
        "learned from a trihedral and pure noise, with a threshold as well; tested on two known and two unknown "
        "targets.",
        (*found, *rejected),
        lacks,
        tuple(filter(None, blocks)),
        (
            "Its matrices count all 242 azimuths x 19 elevations x 3 realizations of each target, images that "
            f"trained among them; what that makes here is in the table above and in {why.SLIPS}.",
            AS_5_3,
            *threshold_effects(results, ("fcnn_open", "fcnn"), {"softmax": HIGH_SNR, "openmax": HIGH_SNR}),
        ),
    )


def _rejected(results, line):
    """What the document says of the UFO's images that are rejected, as of `judge_one`."""
    (model, score), snr = ADAPTATIONS[line["model"]], high_snr(results)
    name, row = results.names.method(model, score), None
    if named(results, line["experiment"]):
        counts = select(open_cells(results, line["experiment"], model, score), target="ufo")
        if len(counts):
            share = select(counts, predicted=OTHER)["count"].sum() / counts["count"].sum()
            row = {"value": share, "low": np.nan, "high": np.nan}
    return judge_one(line, name, "share of the UFO's images rejected", row, snr)


def fig_5_6(results):
    entry = network_entry(
        results,
        "Fig. 5.6",
        TITLES["Fig. 5.6"],
        "256 filters, 32 channels of primary capsules, trained for 150 epochs on magnitudes of images without noise, "
        "32 x 32 pixels.",
        CAPSULE,
        F1,
        (),
        "capsule",
        own_reasons(results, *CAPSULE),
    )
    return with_training(results, entry, *CAPSULE)


def fig_5_7(results):
    """Images at the SNR of the low statement."""
    names, title = ("Fig. 5.7",), "images at -6 dB"
    did = "Images of the drone and of the missile at -6 dB, in which one hardly sees a target."
    known = results.of_role("known")
    if not results.images_are_made or not known:
        return Entry(names, title, did, missing="images of known targets")
    snr, lines = nearest(results.settings["noise"]["snr_db"], LOW_SNR), []
    for target in known:
        image = results.images(target, snr_label(snr)).image.isel(realization=0)
        elevations = evenly(image.elevation.values.tolist(), EXAMPLES)
        line = []
        for place, azimuth in enumerate(around(image.sizes["azimuth"], EXAMPLES)):
            one = image.sel(elevation=elevations[place % len(elevations)]).isel(azimuth=azimuth)
            line.append((f"{target}, {float(one.elevation):g}°, {float(one.azimuth):.0f}°", one))
        lines.append(line)
    alt = f"Images of {' and '.join(known)} at {snr:g} dB, headed by elevation and azimuth."
    words = f"At {snr:g} dB; headed by elevation and azimuth."
    return Entry(
        names, title, did, blocks=(images_picture(names[0], lines, alt), words), why=why.reasons(results, why.noise)
    )


def table_5_3(results):
    wanted = [CAPSULE, ("fcnn_open", "fcnn"), *(("multi_elevation", model) for model in MODELS[1:])]
    did = "Average milliseconds an image of the capsule network, 16 times those of the FCNN, beside those of Table 5.1."
    return times_entry(results, "Table 5.3", "prediction times of the capsule network", did, wanted)


def _decoded(results, name, title, did, snr, kinds):
    """Images and what the capsule network makes of them: a row for each target. kinds: variables and their words."""
    if not judged_anew(results, *CAPSULE) or CAPSULE not in results.decoders:
        words = "reconstructions of the capsule network in experiment `capsule_open`, split at random"
        return Entry((name,), title, did, missing=words)
    store = results.reconstructions(*CAPSULE)
    snr = nearest(store.snr.values.tolist(), snr)
    dataset = store.sel(snr=snr).load()
    order = [target for target in results.targets if target in dataset.target.values]
    size = 0.8 * len(kinds) * EXAMPLES + 0.5, 0.8 * len(order) + 0.4
    drawing, grid = panels(len(order), len(kinds) * EXAMPLES, *size, False, False, "compressed")
    for row, target in enumerate(order):
        for place, (kind, words) in enumerate(kinds.items()):
            for example in range(EXAMPLES):
                axes = grid[row, place * EXAMPLES + example]
                draw_pixels(axes, dataset[kind].sel(target=target).isel(example=example).values)
                axes.set(xticks=[], yticks=[], title=words if (row, example) == (0, EXAMPLES // 2) else "")
        grid[row, 0].set_ylabel(target)
    finish(drawing, grid, "", legend=False)
    alt = f"{name} here: five images of each of {', '.join(order)} at {snr:g} dB: {', '.join(kinds.values())}."
    rows = []
    for target in order:
        errors = {f"MSE, {words}": number(value) for words, value in _errors(dataset.sel(target=target)).items()}
        rows.append({"target": target} | errors)
    blocks = picture(name, drawing, alt), f"At {snr:g} dB, of these images:", table(rows)
    return Entry((name,), title, did, blocks=blocks, why=(AS_5_6,))


def _errors(images):
    """Mean squared errors of reconstructions: beside what the network sees, and beside the image without noise."""
    return {
        "reconstruction and input": float(((images.made - images.seen) ** 2).mean()),
        "reconstruction and image without noise": float(((images.made - images.truth) ** 2).mean()),
    }


def fig_5_8(results):
    did = "Five images of each of four targets at 24 dB and their reconstructions, worse for the unknown targets."
    kinds = {"seen": "input", "made": "reconstruction"}
    return _decoded(results, "Fig. 5.8", "reconstructions at 24 dB", did, HIGH_SNR, kinds)


def fig_5_12(results):
    did = "The same at 3 dB, with the images without noise: the network takes noise out."
    kinds = {"seen": "input", "made": "reconstruction", "truth": "without noise"}
    return _decoded(results, "Fig. 5.12", "reconstructions at 3 dB", did, NOISY_SNR, kinds)


def _histograms(results, name, title, did, snr, scores):
    """How confidence scores of known and unknown test images lie, with thresholds from validation and test images."""
    if not judged_anew(results, *CAPSULE):
        return Entry((name,), title, did, missing="the capsule network in experiment `capsule_open`, split at random")
    snr, rows = nearest(results.settings["noise"]["snr_db"], snr), []
    predictions = results.predictions(*CAPSULE, snr)
    test = select(predictions, side="test")
    drawing, grid = panels(1, len(scores), max(1 + 3.9 * len(scores), 6.6), 3.4, False, False)
    for axes, score in zip(grid.flat, scores, strict=True):
        values, label = plain(score, test[f"known_{score}"]), results.names.score(score).label
        edges = np.linspace(values.min(), max(values.max(), values.min() + 1e-9), BINS + 1)
        for role, color in (("known", BLUE), ("unknown", VERMILION)):
            draw_density(axes, values[test["role"] == role], edges, color, f"{role} targets")
        found = anew.effect(predictions, score, results.settings["seed"])
        for threshold, dash, words in (
            (found.chosen, "--", "validation images"),
            (found.by_errors, ":", "test images"),
        ):
            axes.axvline(plain(score, threshold), color="black", ls=dash, lw=1.2, label=f"threshold from {words}")
        axes.set_xlabel(label)
        case = {"experiment": CAPSULE[0], "split": SPLIT, "model": CAPSULE[1], "score": score, "metric": "auroc"}
        area = select(results.scores, **case, elevation="all", test_snr_db=snr)
        auroc = with_interval(area.iloc[0]) if len(area) else NONE
        rows.append({"score": label, "AUROC": auroc, **effect_cells(found, score)})
    finish(drawing, grid, "", "density")
    words = " and ".join(row["score"] for row in rows)
    alt = f"{name} here: histograms of {words} at {snr:g} dB, known and unknown targets."
    blocks = picture(name, drawing, alt), f"At {snr:g} dB, test images:", table(rows)
    return Entry((name,), title, did, blocks=blocks, why=(AS_5_6,))


def fig_5_9(results):
    did = "Histogram of the MSE of input and reconstruction at 24 dB, known and unknown targets."
    return _histograms(results, "Fig. 5.9", "MSE of known and unknown targets", did, HIGH_SNR, ("mse",))


def fig_5_13(results):
    did = "Histograms of MSE and ZNCC at 3 dB: by the ZNCC known and unknown targets lie further apart."
    return _histograms(results, "Fig. 5.13", "MSE beside ZNCC at 3 dB", did, NOISY_SNR, ("mse", "zncc"))


def fig_5_10(results):
    did = "What the network reconstructs with too large an MSE is rejected; the closed set beside."
    effects = AS_5_6, *threshold_effects(results, CAPSULE, {"mse": 15})
    title = "capsule network in the open set, by MSE"
    return network_entry(results, "Fig. 5.10", title, did, CAPSULE, F1, ("mse",), "capsule_mse", effects)


def fig_5_11(results):
    """Confusion matrix by MSE at 24 dB, and how many of the images are wrong."""
    there, lacks = present(results, CAPSULE[0], [CAPSULE[1]], is_open=True)
    line = select(results.published_scores, metric="misclassified_of_16872").iloc[0].to_dict()
    # As the share of the images: here there are others.
    line |= {"value": f"{float(line['value']) / 16872:.4f}", "stated": "54 of 16,872 images, 24 dB"}
    name, here, row = results.names.method("capsule", "mse"), None, None
    blocks = [f1_table(results, ("capsule_mse",))]
    if there:
        here, harder = (_wrong(results, rows_of) for rows_of in (ours, by_sector))
        row = here and {"value": here["ours"], "low": here["low"], "high": here["high"]}
        shares = {"published": f"{line['value']} ({line['stated']})"}
        shares[f"here, {WORDS[SPLIT]}, `thesis` thresholds"] = value_text(here, HIGH_SNR)
        shares[f"here, {WORDS[HARDER]}, `blind` thresholds"] = value_text(harder, HIGH_SNR)
        blocks += [
            table([{"": "share of wrong images"} | shares]),
            matrices(results, "Fig. 5.11", CAPSULE[0], ["capsule_mse"]),
        ]
    found = (judge_one(line, name, "share of wrong images", row, here and here["here_at_snr_db"]),)
    return Entry(
        ("Fig. 5.11",),
        "confusion matrix by MSE at 24 dB",
        "At 24 dB, 74 azimuths x 19 elevations x 3 realizations of four targets: 54 of 16,872 images are wrong.",
        found,
        lacks,
        tuple(blocks),
        (AS_5_6, *threshold_effects(results, CAPSULE, {"mse": HIGH_SNR})),
    )


def _wrong(results, rows_of):
    """The share of wrong images of the open set by MSE at 24 dB, as of `value_at`. rows_of: `ours` or `by_sector`."""
    value = value_at(results, rows_of(results, *CAPSULE, ACCURACY, "mse"), HIGH_SNR)
    return value and value | {"ours": 1 - value["ours"], "low": 1 - value["high"], "high": 1 - value["low"]}


def fig_5_14(results):
    did = (
        "The same with the ZNCC of input and reconstruction instead of the MSE: better, between -6 and 15 dB above all."
    )
    effects = AS_5_6, *threshold_effects(results, CAPSULE, {"zncc": 6})
    title = "capsule network in the open set, by ZNCC"
    return network_entry(results, "Fig. 5.14", title, did, CAPSULE, F1, ("mse", "zncc"), "capsule_zncc", effects)


def given_up(results):
    """What the document tried and gave up: the capsule's length, a mixture of Gaussians, and complex images."""
    there, lacks = present(results, CAPSULE[0], [CAPSULE[1]], is_open=True)
    blocks, missing = [], [lacks] if lacks else []
    if there:
        none = results.published_scores.iloc[:0]
        blocks += curves_of(results, "Sec. 5.4.4", CAPSULE, F1, TRIED, none, {})
    runs = (
        [run for run in results.runs.values() if "capsule_complex" in run["models"] and run["open"]]
        if results.learns
        else []
    )
    blocks += _complex(results, runs[0]) if runs else []
    missing += [] if runs else ["the model `capsule_complex` in the open set"]
    return Entry(
        ("Sec. 5.4.2", "Sec. 5.4.4"),
        "what the document tried and gave up",
        "Three attempts without numbers: rejecting by the length of the class capsule, rejecting by a mixture of "
        "Gaussians of the class capsules' outputs, and a network on complex images, which it could not make "
        "reconstruct them.",
        missing="; ".join(missing),
        blocks=tuple(filter(None, blocks)),
        why=(AS_5_6,),
    )


def _complex(results, run):
    """The complex network beside the others of its experiment: closed set, open set by each score, reconstruction."""
    experiment, rows = run["experiment"], []
    for model in run["models"]:
        scores = select(results.mean_scores, experiment=experiment, model=model, elevation="all", metric=F1)
        closed = value_at(results, select(scores, threshold=""), HIGH_SNR)
        row = {
            "model": results.names.model(model).label,
            "weighted F1 at 24 dB, closed set": value_text(closed, HIGH_SNR),
        }
        if (run["name"], model) in results.decoders:
            store = results.reconstructions(run["name"], model)
            snr = nearest(store.snr.values.tolist(), HIGH_SNR)
            known = [name for name in results.of_role("known") if name in store.target.values]
            error = _errors(store.sel(snr=snr, target=known))["reconstruction and image without noise"]
            row[f"MSE, reconstruction and image without noise at {snr:g} dB, known targets"] = number(error)
        opened = select(scores, threshold="thesis")
        for score in results.names.values(opened, "score") if len(opened) else ():
            value = value_at(results, select(opened, score=score), HIGH_SNR)
            row[f"open set, {results.names.score(score).label}"] = value_text(value, HIGH_SNR)
        rows.append(row)
    trained = training_noise(results.settings["learning"]["experiments"][experiment]["train"]["snr_db"])
    return (
        f"Complex images, in experiment `{experiment}`, trained {trained}, {WORDS[run['split']]}, `thesis` thresholds:",
        table(rows),
    )


ENTRIES = (
    fig_5_3,
    table_5_1,
    fig_5_4,
    fig_5_6,
    fig_5_7,
    table_5_3,
    fig_5_8,
    fig_5_9,
    fig_5_10,
    fig_5_11,
    fig_5_12,
    fig_5_13,
    fig_5_14,
    given_up,
)
