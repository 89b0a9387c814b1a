"""The open set: unknown targets among the test images, and what each known score and threshold makes of them."""

import itertools

import numpy as np
import pandas as pd

from learning.classifier import OTHER
from learning.metrics import metrics_of
from report import thesis
from report.draw_learning import (
    draw_confusion,
    draw_legend,
    draw_rejecting,
    experiments,
    heading,
    interval_text,
    split_text,
    title,
    training_order,
)
from report.layout import PALETTE, Figure, Section, Table, canvas, model_order, model_style, style, to_svg

PROTOCOLS = ("blind", "thesis")  # the harder first
COUNTED = {False: ("known",), True: ("known", "unknown")}  # roles of the targets in a closed and an open set's scores
COLUMNS = 4  # models side by side
# Known scores in the order of the page, and what the page calls them.
NAMES = {
    "softmax": "softmax",
    "openmax": "OpenMax",
    "openmax_shifted": "OpenMax, shifted logits",
    "max_logit": "maximum logit",
    "energy": "energy",
    "neighbour": "5th nearest neighbour",
    "mahalanobis": "Mahalanobis",
    "relative_mahalanobis": "relative Mahalanobis",
    "correlation": "correlation",
    "distance": "nearest distance",
    "margin": "margin",
    "mse": "MSE",
    "zncc": "ZNCC",
    "noise_zncc": "ZNCC, noise taken out",
    "length": "capsule length",
    "mixture": "Gaussian mixture",
    "coherence": "coherence",
}
STYLES = {name: (PALETTE[place % len(PALETTE)], "osD^v<>x+*PXphd8"[place % 16]) for place, name in enumerate(NAMES)}
# The reference thesis's adaptations of its network: the model and known score here that are the same.
PUBLISHED = {
    "softmax_threshold": ("fcnn", "softmax"),
    "openmax": ("fcnn", "openmax"),
    "other_class": ("fcnn_other", "softmax"),
}
PUBLISHED_CLASSES = ["drone", "missile", "other"]
SEPARATION = {"auroc": "AUROC", "fpr95": "FPR at 95 % TPR", "oscr": "OSCR"}


def section(results):
    scores = results.scores[(results.scores["score"] != "") & (results.scores["elevation"] == "all")]
    confusion = results.confusion[(results.confusion["score"] != "") & (results.confusion["elevation"] == "all")]
    shift = thesis.offset(results, COUNTED[True])
    published = thesis.statements(results, COUNTED[True])
    published = published[published["metric"] == "weighted_f1"]
    known = _targets(results, "known")
    return Section(
        id="open",
        title="Open set",
        text=(
            f"The test images are those of {known} and of {_targets(results, 'unknown')}, which no model has seen. An "
            "image whose known score is below a threshold is rejected as 'other'. Thresholds are chosen on images at "
            "the validation azimuths, for each SNR by itself, for the largest weighted F1. Under the thesis protocol "
            "these hold the unknown targets too, under the blind protocol only the known ones and those of role other"
            f"{_others(results)}. Scores that put the images in the same order, as softmax, maximum logit and energy "
            "of a linear model of two classes do, lie on each other. OpenMax's score is its largest probability of a "
            f"known class. Rejecting everything gives a weighted F1 of {_rejecting_text(results)}: the dotted line.",
        ),
        figures=(
            *(open_figure(name, scores, results.validation, rejecting(results)) for name in experiments(scores)),
            *published_confusion(
                "published_confusion",
                confusion[confusion["experiment"] == "fcnn_open"],
                PUBLISHED,
                thesis.moved(results.published_confusion, shift),
                results.targets,
            ),
        ),
        tables=tuple(open_table(name, scores, published) for name in experiments(scores)),
    )


def rejecting(results):
    """The weighted F1 of rejecting every test image of the open set, by split: from how many images each target has."""
    found = {}
    counts = results.confusion[(results.confusion["threshold"] != "") & (results.confusion["elevation"] == "all")]
    for split, rows in counts.groupby("split"):
        # Every model and known score is judged on the same images.
        case = ["experiment", "model", "training", "test_snr_db", "score", "threshold"]
        one = rows.merge(rows[case].iloc[:1], on=case)
        found[split] = rejecting_f1(one.groupby("target")["count"].sum(), results.settings["targets"])
    return found


def rejecting_f1(images, targets):
    """The weighted F1 of rejecting everything. images: how many each target has; targets: the config's."""
    labels = [*(name for name in images.index if targets[name]["role"] == "known"), OTHER]
    counts = np.zeros((len(labels), len(labels)))
    for name, count in images.items():
        counts[labels.index(name) if name in labels else -1, -1] += count
    return float(metrics_of(counts, labels, labels)["f1_weighted"])


def _rejecting_text(results):
    return " and ".join(sorted({f"{value:.3f}" for value in rejecting(results).values()}))


def _targets(results, role):
    return " and ".join(name for name in results.targets if results.settings["targets"][name]["role"] == role)


def _others(results):
    return f" ({_targets(results, 'other')})" if _targets(results, "other") else ""


def open_figure(name, scores, validation, rejected):
    """Weighted F1 of the open set against the test SNR: a panel per model, a colour per known score.

    scores, validation: of the test and the validation images; rejected: what `rejecting` gives.
    """
    part = scores[(scores["experiment"] == name) & (scores["metric"] == "f1_weighted")]
    split = part["split"].iloc[0]
    models = sorted(part["model"].unique(), key=model_order)
    columns = min(COLUMNS, len(models))
    blocks = -(-len(models) // columns)
    rows = blocks * len(PROTOCOLS)
    with style():
        figure = canvas(max(1 + 2.6 * columns, 6), 1 + 2.2 * rows)
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for (place, model), (row, protocol) in itertools.product(enumerate(models), enumerate(PROTOCOLS)):
            row += len(PROTOCOLS) * (place // columns)
            axes = grid[row, place % columns]
            axes.set_axis_on()
            own = part[(part["model"] == model) & (part["threshold"] == protocol)]
            for score, train in itertools.product(known_scores(own["score"].unique()), own["training"].unique()):
                curve = own[(own["score"] == score) & (own["training"] == train)].sort_values("test_snr_db")
                color, marker = score_style(score)
                look = {"color": color, "marker": marker, "lw": 1, "label": score_name(score)}
                axes.plot(curve["test_snr_db"], curve["value"], **look)
            draw_rejecting(axes, [rejected[split]])
            axes.set(title=f"{model_style(model)[2]}, {protocol}", ylabel="weighted F1")
            if row % len(PROTOCOLS) == len(PROTOCOLS) - 1:
                axes.set_xlabel("test SNR [dB]")
                axes.tick_params(labelbottom=True)
        draw_legend(figure, grid.flat)
        svg = to_svg(figure)
    top, held_out = (
        rows[
            (rows["experiment"] == name)
            & (rows["elevation"] == "all")
            & (rows["metric"] == "f1_weighted")
            & (rows["threshold"] == PROTOCOLS[0])
            & (rows["test_snr_db"] == part["test_snr_db"].max())
        ].set_index(["model", "training", "score"])["value"]
        for rows in (scores, validation)
    )
    model, _, score = best = held_out.idxmax()
    return Figure(
        name=f"open_{name}",
        svg=svg,
        data=scores[scores["experiment"] == name],
        alt=f"Open-set weighted F1 of {title(name)} against test SNR, for each model, known score and threshold.",
        caption=(
            f"{heading(name)}, {split_text(split)}: weighted F1 over the classes and 'other', unknown targets among "
            f"the test images, with {PROTOCOLS[0]} thresholds and with {PROTOCOLS[1]} thresholds. Best at "
            f"{part['test_snr_db'].max():g} dB on the validation images with {PROTOCOLS[0]} thresholds: "
            f"{model_style(model)[2]} with {score_name(score)}, which has {top[best]:.3f} on the test images."
        ),
        wide=True,
    )


def published_confusion(name, confusion, adaptations, published, targets):
    """The reference thesis's confusion matrices of its networks on the open set, beside ours at the nearest SNR.

    name: the figure's. confusion: ours, of one experiment; published: the thesis's, `thesis.moved`. adaptations: what
    it calls them, and the model and known score here that are the same. targets: names in the order of the page.
    Nothing where nothing here is the same, or where the experiment trains each model several times.
    """
    theirs = published[published["model"].isin(adaptations)]
    ours = confusion[confusion["threshold"] == "thesis"]
    aim = theirs["snr_db"].iloc[0] if len(theirs) else ours["test_snr_db"].max()
    ours = ours[ours["test_snr_db"] == min(ours["test_snr_db"], key=lambda snr: abs(snr - aim), default=aim)]
    pairs = {}
    for adaptation, (model, score) in adaptations.items():
        cells = ours[(ours["model"] == model) & (ours["score"] == score)]
        if cells["training"].nunique() == 1:
            pairs[adaptation] = (
                cells.pivot(index="target", columns="predicted", values="count").reindex(
                    [name for name in targets if name in set(cells["target"])]
                ),
                theirs[theirs["model"] == adaptation]
                .set_index("true")[PUBLISHED_CLASSES]
                .sort_index(key=lambda names: [targets.index(name) if name in targets else -1 for name in names]),
            )
    if not pairs:
        return ()
    snr = ours["test_snr_db"].iloc[0]
    panels = [
        (f"{heading(adaptation)}, {whose}", matrix)
        for adaptation, matrices in pairs.items()
        for matrix, whose in zip(matrices, ("here", "thesis, full size"), strict=True)
        if len(matrix)
    ]
    # Below each other where each of ours has a published one.
    rows = 2 if len(panels) == 2 * len(pairs) else 1
    columns = len(panels) // rows
    with style():
        figure = canvas(0.6 + 3 * columns, 3.5 * rows)
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, (text, matrix) in zip(grid.T.flat, panels, strict=True):
            draw_confusion(axes, matrix)
            axes.set(title=text, xlabel="predicted class")
        for axes in grid[:, 0]:
            axes.set_ylabel("target")
        svg = to_svg(figure)
    return (
        Figure(
            name=name,
            svg=svg,
            data=ours,
            alt=f"Confusion matrices of {', '.join(map(title, pairs))} at {snr:g} dB, with those that were published.",
            caption=(
                f"{heading(', '.join(map(title, pairs)))} at {snr:g} dB, {split_text(ours['split'].iloc[0])}, with "
                "thesis thresholds: share of each target's images and their number."
                f"{_beside(theirs) if len(panels) > len(pairs) else ''}"
            ),
            wide=columns > 2,
        ),
    )


def _beside(theirs):
    printed, snr = theirs[["printed_snr_db", "snr_db"]].iloc[0]
    here = f" of its definition, which are {snr:.1f} dB here" if snr != printed else ""
    return (
        f" Beside ours, those of the thesis, of a full-size network at {thesis.CENTER_FREQUENCY / 1e9:g} GHz and "
        f"{printed:g} dB{here}; its targets are other models of the same kinds, so agreement is expected in kind only."
    )


def open_table(name, scores, published):
    """Every model and known score of an experiment at the highest SNR: F1 under both protocols, and separation."""
    part = scores[scores["experiment"] == name]
    top = part[part["test_snr_db"] == part["test_snr_db"].max()]
    shown = []
    order = known_scores(top["score"].unique())
    groups = top.groupby(["model", "training", "score"])
    for (model, train, score), rows in sorted(
        groups, key=lambda group: (model_order(group[0][0]), training_order(group[1]), order.index(group[0][2]))
    ):
        rows = rows.set_index(["threshold", "metric"])
        line = {"model": model_style(model)[2], "training SNR": train, "known score": score_name(score)}
        for protocol in PROTOCOLS:
            line[f"weighted F1, {protocol}"] = interval_text(rows.loc[protocol, "f1_weighted"])
        for metric, text in SEPARATION.items():
            line[text] = f"{rows.loc['', metric]['value']:.3f}"
        printed = [
            line.value
            for line in published[
                (published["experiment"] == name) & (published["printed_snr_db"] == top["test_snr_db"].max())
            ].itertuples()
            if PUBLISHED.get(line.model) == (model, score)
        ]
        line[f"{thesis.FULL_SIZE}: F1"] = printed[0] if printed else "–"
        shown.append(line)
    shown = pd.DataFrame(shown)
    if shown["training SNR"].nunique() == 1:
        shown = shown.drop(columns="training SNR")
    theirs = ""
    if (shown[f"{thesis.FULL_SIZE}: F1"] == "–").all():
        shown = shown.drop(columns=f"{thesis.FULL_SIZE}: F1")
    else:
        shift = (published["snr_db"] - published["printed_snr_db"]).iloc[0]
        theirs = f" The thesis's are at {shift:+.1f} dB, as its SNR is defined otherwise." if shift else ""
    return Table(
        name=f"open_{name}",
        shown=shown,
        data=part,
        caption=(
            f"{heading(name)}, {split_text(top['split'].iloc[0])}, at {top['test_snr_db'].max():g} dB: weighted F1 "
            f"with its 95 % interval with {PROTOCOLS[0]} and with {PROTOCOLS[1]} thresholds. AUROC: the probability "
            "that an image of a known target scores higher than one of an unknown target; FPR: the share of unknown "
            "images kept by the threshold that keeps 95 % of the known ones; OSCR: the area under correct "
            "classification against false positives. The CSV file holds all SNRs."
            f"{theirs}"
        ),
    )


def known_scores(scores):
    """Known scores without repeats in the order of the page, those of a user's own model last."""
    return sorted(set(scores), key=lambda score: (list(NAMES).index(score) if score in NAMES else len(NAMES), score))


def score_name(score):
    return NAMES.get(score, score.replace("_", " "))


def score_style(score):
    """Colour and marker of a known score."""
    return STYLES.get(score, (PALETTE[sum(score.encode()) % len(PALETTE)], "h"))
