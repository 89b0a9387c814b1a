"""What fills the {places} of sentences in page.yaml: those of the run in one mapping, those of a figure by functions.

A function has its sentence's name and yields the values of each sentence, none where what it says does not apply.
figure: as of `page.build`.
"""

from functools import cache, reduce

from sklearn.metrics import roc_auc_score

from isarflow.core.sweep import elevations
from isarflow.core.words import duration, number
from isarflow.learning import capsules
from isarflow.learning.experiments import training, training_noise
from isarflow.report import thesis
from isarflow.report.vocabulary import ACCURACY, POWERS, select
from study import anew
from study import statements as stated
from study.selection import LOW_SNR, PAGE


@cache
def of_run(results):
    """Return what fills the sentences that are the same for every figure: by name, None where one does not apply."""
    settings, known, unknown = results.settings, results.of_role("known"), results.of_role("unknown")
    models, imaging = settings["learning"]["models"], settings["imaging"]
    tested, every = settings["learning"]["realizations"], settings["noise"]["realizations"]
    tested = every if tested == "all" else min(tested, every)
    count = f"{tested} realization{'s are' if tested > 1 else ' is'}"
    mirrored = ", ".join(name for name in results.targets if settings["targets"][name].get("symmetry"))
    penalty, weight = models.get("lr", {}).get("penalty"), models.get("capsule", {}).get("reconstruction")
    found = {
        "targets": {"known": " and ".join(known), "opened": f", unknown {' and '.join(unknown)}" if unknown else ""},
        "imager": None,
        "noise_power": {"power": POWERS[results.definition]} if results.definition != thesis.DEFINITION else None,
        "noise_tested": {"count": count} if tested != PAGE["realizations"] else None,
        "split": {"mirrored": mirrored} if mirrored else None,
        "penalty": {"own": penalty, "inverse": 1 / penalty} if penalty else None,
        "machine": None,
        "power_offsets": None,
        "reconstruction_weight": {"here": f" Here it is {weight:g} times the mean." if weight is not None else ""},
    }
    if results.images_are_made:
        how = imaging["reformat"] if imaging["imager"] == "fourier" else "other"
        attrs = {name: results.images(name, "clean").attrs for name in known + unknown}
        offsets = (f"{name} {of['snr_definition_offset_db']:.1f} dB" for name, of in attrs.items())
        found |= {"imager": {"formed": PAGE["imagers"][how].format(**imaging)}}
        found |= {"power_offsets": {"offsets": ", ".join(offsets)}}
    if results.runs:
        names, count = ", ".join(sorted(results.times["machine"].unique())), results.times["threads"].max()
        found["machine"] = {"names": names, "threads": f"{count} thread{'s' if count > 1 else ''}"}
    return found


def sweep(results, figure):
    """Name the parts of the sweep that are not the document's."""
    parts = []
    for words, (key, theirs, scale, unit) in PAGE["sweep"].items():
        here = reduce(lambda part, name: part.get(name, {}), key.split("."), results.settings)
        if here != theirs:
            own = f"{here / scale:g}{unit}" if here != {} else "otherwise"
            parts.append(f"{words} {own} ({theirs / scale:g}{unit})")
    if parts:
        yield {"parts": ", ".join(parts)}


def parameters(results, figure):
    """Name hyper-parameters of the figure's models that are not the document's."""
    parts = []
    for model in figure.models:
        own, kind = results.settings["learning"]["models"].get(model, {}), thesis.kind(model, results.settings)
        theirs = select(results.published_settings, model=kind).set_index("setting")["value"].items()
        other = [f"{name} {own[name]} ({value})" for name, value in theirs if str(own.get(name, value)) != value]
        parts += [f"{results.names.model(model).label}: {', '.join(other)}"] if other else []
    if parts:
        yield {"parts": "; ".join(parts)}


def network(results, figure):
    """Say how the sizes of the figure's networks differ from the thesis's."""
    for model in figure.models:
        if model in results.settings["learning"]["models"] and (words := difference(model, results.settings)):
            yield {"model": results.names.model(model).label, "words": words}


def difference(model, settings):
    """Return in words how a network differs from the thesis's; empty where it does not."""
    if thesis.full_size(model, settings):
        return ""
    own, kind = thesis.size(model, settings), thesis.kind(model, settings)
    theirs = thesis.SIZES[kind]
    if kind != "capsule":
        return f"{own}; the thesis's {', '.join(f'{theirs[name]} {unit}' for name, unit in thesis.UNITS[kind].items())}"
    times = weight_ratio(model, settings)
    same = settings["radar"]["center_frequency"] == thesis.CENTER_FREQUENCY
    frequency = "" if same else f", and saw images at {thesis.CENTER_FREQUENCY / 1e9:g} GHz"
    return (
        f"{'reduced' if times > 1 else 'resized'}: {own}; the thesis's has {' and '.join(map(str, theirs.values()))}, "
        f"{f'{times:.0f}' if times >= 10 else f'{times:.2g}'} times the weights before the decoder{frequency}"
    )


def weight_ratio(model, settings):
    """Return how many times the weights of a capsule network the thesis's has, both before their decoders."""

    def weights(of):
        # Two classes, images of 32 x 32 pixels; the decoder's 512 units do not count.
        layers = capsules.layers((32, 32, 1), 2, of["width"], of["capsules"], 512)
        return sum(layer.count for name, layer in layers.items() if not name.startswith("decoder"))

    return weights(thesis.SIZES["capsule"]) / weights(settings["learning"]["models"][model])


def capsule_networks(results):
    """Return how the run's capsule networks differ from the thesis's, each difference once."""
    settings, models = results.settings, dict.fromkeys(name for run in results.runs.values() for name in run["models"])
    texts = [difference(model, settings) for model in models if thesis.kind(model, settings) == "capsule"]
    return [text for text in dict.fromkeys(texts) if text]


def epochs(results, figure):
    """Say how a network's training went here."""
    (model,), settings = figure.models, results.settings
    curve = results.curves.get((figure.experiment, model))
    if curve is not None:
        ended = training_end(curve, settings["learning"]["models"][model].get("epochs"))
        theirs = select(results.published_settings, model=thesis.kind(model, settings), setting="epochs")["value"]
        there = f"; the document's had {theirs.iloc[0]} epochs" if len(theirs) else ""
        yield {"model": results.names.model(model).words, "ended": ended, "there": there}


def training_end(curve, planned):
    """Return in words how a training ended. planned: how many epochs it may have at most, where that is one number."""
    last = curve.iloc[-1]
    words = [f"after {last['epoch']:g}{f' of {planned}' if isinstance(planned, int) else ''} epochs"]
    if "learning_rate" in curve:
        words.append(f"at {number(last['learning_rate'] / curve['learning_rate'].max(), 2)} of its learning rate")
    if "seconds" in curve:
        words.append(f"in {duration(last['seconds'])}")
    return " ".join(words)


def fitted(results, figure):
    """Say what the document has of accuracy on the training images, and this run."""
    for line in figure.found:
        if line["reading"] == "last epoch" and line["here"]:
            curve = results.curves[figure.experiment, line["model"]]
            first = curve["epoch"][curve["accuracy"] >= 0.99995]
            reached = f", and 1.0000 first after epoch {first.iloc[0]:g}" if len(first) else ""
            yield {**line, "last": line["here"]["ours"], "count": len(curve), "reached": reached}


def trained_on(results, figure):
    """Say how many images trained, and at what SNR."""
    times = stated.rows(results, "times", experiment=figure.experiment, model=figure.models)
    if len(times):
        counts = ", ".join(f"{count:,}" for count in sorted(times["training_observations"].unique()))
        trained = results.settings["learning"]["experiments"][figure.experiment]["train"]
        yield {"counts": counts, "noise": training_noise(trained["snr_db"])}


def _accuracy(results, experiment, model, **case):
    """Return the accuracy of a model at the thesis's conditions: a Series by SNR."""
    return stated.ours(results, experiment, model, ACCURACY, **case).set_index("test_snr_db")["value"]


def other_elevations(results, figure):
    """Say how accuracy differs between the elevation that trained and the others, of KNN by all its features."""
    run, count = stated.own_run(results, figure.experiment), len(elevations(results.settings["aspect"]))
    for model in run["models"] if run and run["elevation"] != "all" else ():
        every, own = (_accuracy(results, figure.experiment, model, elevation=at) for at in ("all", "trained"))
        trained, both = len(run["elevation"]), own.index.intersection(every.index)
        if thesis.kind(model, results.settings) == "knn" and len(both) and count > trained:
            snr, label = both.max(), results.names.model(model).label
            others = (count * every[snr] - trained * own[snr]) / (count - trained)
            yield {"model": label, "snr": snr, "own": own[snr], "others": others, "count": count - trained}


def pixels(results, figure):
    """Say what up-sampling makes of distances between images at a kernel of the same scale."""
    scale = results.settings["learning"]["models"][figure.models[0]].get("scale")
    if scale:
        sizes = results.images(results.targets[0], "clean").sizes
        yield {"ratio": figure.upsampled**2 / (sizes["range"] * sizes["crossrange"]), "scale": scale}


def growth(results, figure):
    """Say by what prediction times grow from the first experiment of figure.timed to the second; here in batches."""
    few, many = figure.timed
    parts = []
    for model in figure.models:
        here = [stated.rows(results, "times", experiment=name, model=model) for name in (few, many)]
        if all(map(len, here)):
            first, second = (rows["batch_ms"].iloc[0] for rows in here)
            there = select(results.published_times, model=model).set_index("experiment")["milliseconds_per_observation"]
            label = results.names.model(model).label
            parts.append(f"{label} {second / first:.3g} times ({there[many] / there[few]:.3g})")
    if parts:
        yield {"parts": ", ".join(parts)}


def tuning(results, figure):
    """Say what the choice of hyper-parameters changes on the test images, once for each model that has one."""
    runs = [run for run in results.runs.values() if training(run) == "clean" and run["elevation"] == "all"]
    runs = [run for run in runs if run["split"] == stated.SPLIT and stated.own_run(results, run["experiment"])]
    for model in figure.models:
        first = [[run["experiment"] for run in runs if of in run["models"]][:1] for of in (model, f"{model}_tuned")]
        if all(first):
            own, tuned = (
                _accuracy(results, *of, name) for of, name in zip(first, (model, f"{model}_tuned"), strict=True)
            )
            snrs = [snr for snr in stated.shown_snrs(own.index.intersection(tuned.index)) if snr >= 0]
            parts = ", ".join(f"{tuned[snr]:.3f} at {snr:g} dB ({own[snr]:.3f})" for snr in snrs)
            yield {"model": results.names.model(model).label, "parts": parts}


def threshold_effects(results, figure):
    """Say what thresholds from the test images would add. figure.effects: an SNR in dB for each confidence score."""
    network = figure.experiment, figure.models[0]
    for score, aim in figure.effects.items() if stated.judged_anew(results, *network) else ():
        snr = anew.nearest_snr(results, aim)
        found = anew.judged(results, *network, score, snr)
        yield {"method": results.names.method(network[1], score), "snr": snr, **found._asdict()}


def class_bias(results, figure):
    """Say how well the scores of two classes rank their images at -6 dB, and how many lie on the right side of zero."""
    known, (model, *_) = results.of_role("known"), figure.models
    if len(known) != 2 or not stated.judged_anew(results, figure.experiment, model):
        return
    snr = anew.nearest_snr(results, LOW_SNR)
    test = select(results.predictions(figure.experiment, model, snr), side="test", target=known)
    first, difference = test["target"] == known[0], test[f"score_{known[0]}"] - test[f"score_{known[1]}"]
    yield {
        "model": results.names.model(model).words,
        "snr": snr,
        "auroc": roc_auc_score(first, difference),
        "right": ((difference > 0) == first).mean(),
        "named": known[0],
        "share": (difference > 0).mean(),
    }


def matrix_and_table(results, figure):
    """Put what Table 5.2 prints beside the same of Fig. 5.4."""
    parts = []
    for name in figure.adaptations:
        printed = select(results.published_scores, model=name, metric="weighted_f1")["value"].iloc[0]
        computed = anew.printed_matrix(results, name)[1]
        parts.append(f"{PAGE['headings'][name]} {printed} printed, {computed:.4f} from the matrix")
    yield {"parts": "; ".join(parts)}
