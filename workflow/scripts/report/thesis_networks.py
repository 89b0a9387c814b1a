"""What figures of the thesis's networks have in common: curves, confusion matrices, and thresholds chosen anew."""

import numpy as np

from report import thesis_anew as anew
from report import thesis_reasons as why
from report.layout import number, signed
from report.plots import draw_matrix, finish, matrix, panels
from report.published import ADAPTATIONS, CLASSES, value_at
from report.section_capsule import plain
from report.selection import HIGH_SNR, everywhere_networks, nearest, thesis_networks
from report.thesis_compare import (
    HARDER,
    PROTOCOLS,
    SPLIT,
    WORDS,
    Panel,
    by_sector,
    curves_picture,
    judge_one,
    judged,
    ours,
    present,
    statement_table,
    trained_words,
    value_text,
    values_table,
)
from report.thesis_markdown import NONE, Entry, picture, table
from report.vocabulary import ACCURACY, F1, select

FCNN = ("softmax_threshold", "openmax", "other_class")  # its adaptations, as the published tables call them
HEADINGS = {
    "softmax_threshold": "softmax with a threshold",
    "openmax": "OpenMax",
    "other_class": "class 'other'",
    "capsule_mse": "capsule network, MSE",
}
RUNS = (
    "fcnn_open",
    "fcnn_listing",
)  # of the FCNN, trained without noise and as the one listing that loads images has it


def high_snr(results):
    """The run's SNR in dB that is nearest to 24 dB."""
    return nearest(results.settings["noise"]["snr_db"], HIGH_SNR)


def judged_anew(results, experiment, model):
    """Whether the page has the predictions of a network at the document's conditions."""
    return results.learns and (experiment, model) in thesis_networks(results.runs)


def own_reasons(results, experiment, model, *more):
    """Reasons that are a network's own."""
    topics = (why.network, model), (why.epochs, experiment, model), (why.parameters, model)
    return why.reasons(results, *topics, (why.trained_on, experiment, model), *more)


def network_entry(results, name, title, did, network, metric, scores, stated, reasons):
    """A figure of F1 or accuracy against the SNR, of the closed set, and of the open set by confidence score.

    At the document's conditions with its statements, and beside by sector with blind thresholds. network: experiment
    and model; scores: confidence scores; stated: how the published table calls what this figure states first.
    """
    experiment, model = network
    there, lacks = present(results, experiment, [model], bool(scores))
    keys = {model: "", **{name: score for name, (of, score) in ADAPTATIONS.items() if of == model and score in scores}}
    drawn = select(
        results.published_scores, experiment=experiment, condition="", model=list(keys), snr_db=_finite(results)
    )
    drawn = drawn[drawn["metric"].isin(["accuracy", "f1", "weighted_f1"])]
    found = judged(results, select(drawn, model=stated), there)
    blocks = [
        statement_table(found),
        *(curves_of(results, name, network, metric, scores, drawn, keys) if there else ()),
    ]
    return Entry((name,), title, did, found, lacks, tuple(filter(None, blocks)), reasons)


def _finite(results):
    return [snr for snr in results.published_scores["snr_db"].unique().tolist() if np.isfinite(snr)]


def curves_of(results, name, network, metric, scores, statements, keys):
    """The Picture and the table of `network_entry`. statements: published ones; keys: their scores, by model."""
    own, words = results.names.model(network[1]), "accuracy" if metric == ACCURACY else "weighted F1"
    looks = {"": {"color": own.color, "marker": own.marker, "label": "closed set"}}
    for look, score in ((results.names.score(score), score) for score in scores):
        looks[score] = {"color": look.color, "marker": look.marker, "label": f"open set, {look.label}"}
    colors, shown, listed = {name: looks[score]["color"] for name, score in keys.items()}, [], []
    for split, rows_of in ((SPLIT, ours), (HARDER, by_sector)):
        curves = {score: rows_of(results, *network, metric, score) for score in looks}
        curves = {score: rows for score, rows in curves.items() if len(rows)}
        if not curves:
            continue
        protocol = f", {PROTOCOLS[split]} thresholds" if scores else ""
        opened = {rows["experiment"].iloc[0] for score, rows in curves.items() if score}
        panel = Panel(f"{WORDS[split]}{protocol}", [(rows, looks[score]) for score, rows in curves.items()])
        panel = panel._replace(rejecting=results.rejecting(opened) if opened else ())
        shown.append(panel._replace(statements=statements, colors=colors) if split == SPLIT else panel)
        for score, rows in curves.items():
            listed.append((f"{looks[score]['label']}, {WORDS[split]}{protocol if score else ''}", rows))
    if not shown:
        return ()
    alt = f"{name} here: {words} of {own.words} against the test SNR."
    return curves_picture(name, shown, words, alt), values_table(listed)


def fitted_to(results, experiment, model):
    """What the document says of accuracy on the training images: as of `judge_one`, and a sentence."""
    lines = select(results.published_scores, experiment=experiment, model=model, metric="training_accuracy")
    curve = results.curves.get((experiment, model)) if results.learns else None
    label, line = results.names.model(model).label, lines.iloc[0].to_dict()
    if curve is None:
        return (judge_one(line, label, "accuracy on training images", None),), ""
    accuracy = curve["accuracy"]
    last = {"value": accuracy.iloc[-1], "low": np.nan, "high": np.nan}
    first = curve["epoch"][accuracy >= 0.99995]
    reached = f", and 1.0000 first after epoch {first.iloc[0]:g}" if len(first) else ""
    words = (
        f"Accuracy on the training images: published {line['value']} ({line['stated']}); here {accuracy.iloc[-1]:.4f} "
        f"in the last of {len(curve)} epochs{reached}."
    )
    return (judge_one(line, label, "accuracy on training images", last),), words


def with_training(results, entry, experiment, model):
    """The Entry with what the document says of the training images."""
    found, words = fitted_to(results, experiment, model)
    return entry._replace(judged=(*entry.judged, *found), blocks=(*entry.blocks, words) if words else entry.blocks)


def open_cells(results, experiment, model, score):
    """Rows of confusion.csv of the open set at the document's conditions and the high SNR."""
    case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "threshold": PROTOCOLS[SPLIT]}
    return select(results.confusion, **case, elevation="all", test_snr_db=high_snr(results))


def f1_table(results, adaptations):
    """Weighted F1 at 24 dB: printed, of the printed matrix, and here by what trained and what is counted."""
    rows = []
    for name in adaptations:
        model, score = ADAPTATIONS[name]
        line = select(results.published_scores, model=name, metric="weighted_f1", snr_db=float(HIGH_SNR))
        row = {"weighted F1 at 24 dB": HEADINGS[name], "printed": line["value"].iloc[0] if len(line) else NONE}
        row["of the printed matrix"] = f"{anew.printed_f1(printed_matrix(results, name)):.4f}"
        for run in (run for run in RUNS if judged_anew(results, run, model)):
            words, here = (
                trained_words(results.runs[run]),
                value_at(results, ours(results, run, model, F1, score), HIGH_SNR),
            )
            row[f"here, trained {words}, test images"] = value_text(here, HIGH_SNR)
            row[f"here, trained {words}, all azimuths"] = (
                f"{anew.weighted_f1(all_azimuths(results, run, model, score)):.4f}"
            )
        rows.append(row)
    return table(rows)


def printed_matrix(results, name):
    """A published confusion matrix (target, predicted)."""
    return select(results.published_confusion, model=name).set_index("true")[CLASSES]


def all_azimuths(results, run, model, score):
    """Every image of the open set, predicted by a fitted network and rejected below its threshold, at the high SNR."""
    snr = high_snr(results)
    chosen = anew.chosen(results.predictions(run, model, snr), score)
    return anew.rejecting(anew.everywhere(results, run, model, snr), score, chosen)


def matrices(results, name, experiment, shown):
    """A Picture of confusion matrices, a column for each adaptation: published, ours, and ours of all azimuths."""
    snr, order = high_snr(results), [*results.of_role("known"), *results.of_role("unknown")]
    columns = []
    for adaptation in shown:
        model, score = ADAPTATIONS[adaptation]
        column = [(f"{HEADINGS[adaptation]},\npublished", printed_matrix(results, adaptation))]
        cells = open_cells(results, experiment, model, score)
        column += [(f"here at {snr:g} dB, test images", matrix(cells).reindex(order))] if len(cells) else []
        for run in (run for run in RUNS if (run, model) in everywhere_networks(results.runs)):
            counts = anew.counts(all_azimuths(results, run, model, score)).reindex(order)
            column.append((f"here, all azimuths,\ntrained {trained_words(results.runs[run])}", counts))
        columns.append(column)
    rows = max(map(len, columns))
    drawing, grid = panels(rows, len(columns), 0.6 + 3.2 * len(columns), 0.3 + 2.8 * rows, False, False)
    for place, column in enumerate(columns):
        for axes, (text, counts) in zip(grid[:, place], column, strict=False):
            draw_matrix(axes, counts.fillna(0), text)
    finish(drawing, grid, "predicted class", "target", legend=False)
    words = ", ".join(HEADINGS[adaptation] for adaptation in shown)
    return picture(name, drawing, f"{name}: confusion matrices of {words}, as published and here.")


def threshold_effects(results, network, at):
    """What thresholds from the test images would add, a sentence for each confidence score. at: its SNR in dB."""
    if not judged_anew(results, *network):
        return ()
    sentences = []
    for score, aim in at.items():
        snr = nearest(results.settings["noise"]["snr_db"], aim)
        found = anew.effect(results.predictions(*network, snr), score, results.settings["seed"])
        sentences.append(
            f"{results.names.method(network[1], score)} at {snr:g} dB: with the threshold of the fewest errors on the "
            f"test images the weighted F1 is {found.f1_by_errors:.4f}, with that of the validation images "
            f"{found.f1:.4f} ({gain_text(found.gain)})."
        )
    return tuple(sentences)


def gain_text(gain):
    """A difference with its interval, which it may lack. gain: value, low, high."""
    value, low, high = (signed(one, 4) for one in gain)
    return value if NONE in (low, high) else f"{value} [{low}, {high}]"


def effect_cells(found, score):
    """An `Effect` as cells of a table."""
    return {
        "threshold from validation images": number(plain(score, found.chosen)),
        "weighted F1": f"{found.f1:.4f}",
        "threshold from test images, by errors": number(plain(score, found.by_errors)),
        "its weighted F1": f"{found.f1_by_errors:.4f}",
        "what that adds": gain_text(found.gain),
    }
