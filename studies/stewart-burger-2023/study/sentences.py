"""Why a run's values may differ from the thesis's: what applies to the run, in the sentences of page.yaml.

Each function yields sentences, or none where what it says does not apply. figure: as of `page.build`.
"""

from functools import reduce

from isarflow.core.sweep import elevations as sweep_elevations
from isarflow.learning.experiments import training
from isarflow.report import thesis
from isarflow.report.layout import signed
from isarflow.report.section_learning import training_end
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import ACCURACY, POWERS, select, training_noise
from study import anew
from study import statements as stated
from study.markdown import NONE, PAGE, say


def targets(results, figure):
    known, unknown = (" and ".join(results.of_role(role)) for role in ("known", "unknown"))
    yield say("targets", known=known, opened=f", unknown {unknown}" if unknown else "")


def sweep(results, figure):
    """The sweep, where it is another one."""
    parts = []
    for words, (key, theirs, scale, unit) in PAGE["sweep"].items():
        here = reduce(lambda part, name: part.get(name, {}), key.split("."), results.settings)
        if here != theirs:
            own = f"{here / scale:g}{unit}" if here != {} else "otherwise"
            parts.append(f"{words} {own} ({theirs / scale:g}{unit})")
    if parts:
        yield say("sweep", parts=", ".join(parts))


def imager(results, figure):
    """The way that images are formed."""
    imaging = results.settings["imaging"]
    if results.images_are_made:
        how = imaging["reformat"] if imaging["imager"] == "fourier" else "other"
        yield say(f"imager_{how}", imager=imaging["imager"])


def noise(results, figure):
    """The definition of SNR, and how many realizations of the noise are tested: one sentence or two, in one text."""
    every, tested = results.settings["noise"]["realizations"], results.settings["learning"]["realizations"]
    tested, parts = every if tested == "all" else min(tested, every), []
    if results.definition != thesis.DEFINITION:
        parts.append(say("noise_power", power=POWERS[results.definition]))
    if tested != PAGE["realizations"]:
        parts.append(say("noise_tested", count=f"{tested} realization{'s are' if tested > 1 else ' is'}"))
    yield " ".join(parts)


def split(results, figure):
    """Views and their mirror images, which the document's shuffle does not know of."""
    mirrored = [name for name in results.targets if results.settings["targets"][name].get("symmetry")]
    if mirrored:
        yield say("split", mirrored=", ".join(mirrored))


def parameters(results, figure):
    """Hyper-parameters of the figure's models that are not the document's."""
    parts = []
    for model in figure.models:
        own, kind = results.settings["learning"]["models"].get(model, {}), thesis.kind(model, results.settings)
        theirs = select(results.published_settings, model=kind).set_index("setting")["value"]
        other = [
            f"{name} {own[name]} ({value})"
            for name, value in theirs.items()
            if name in own and _differs(own[name], value)
        ]
        parts += [f"{results.names.model(model).label}: {', '.join(other)}"] if other else []
    if parts:
        yield say("parameters", parts="; ".join(parts))


def _differs(own, printed):
    """Whether a setting is another than the printed one, which is text."""
    try:
        return float(own) != float(printed)
    except (TypeError, ValueError):
        return str(own) != printed


def network(results, figure):
    """The sizes of the figure's networks, where they are not the thesis's."""
    for model in figure.models:
        if model in results.settings["learning"]["models"] and not thesis.full_size(model, results.settings):
            words = thesis.difference(model, results.settings)
            yield say("network", model=results.names.model(model).label, words=words)


def epochs(results, figure):
    """How a network's training went here."""
    (model,), settings = figure.models, results.settings
    curve = results.curves.get((figure.experiment, model)) if results.learns else None
    if curve is not None:
        ended = training_end(curve, settings["learning"]["models"][model].get("epochs"))
        kind = thesis.kind(model, settings)
        theirs = select(results.published_settings, model=kind, setting="epochs")["value"]
        there = f"; the document's had {theirs.iloc[0]} epochs" if len(theirs) else ""
        yield say("epochs", model=results.names.model(model).words, ended=ended, there=there)


def trained_on(results, figure):
    """How many images trained, and at what SNR."""
    experiment = results.settings["learning"]["experiments"].get(figure.experiment)
    times = select(results.times, experiment=figure.experiment, model=figure.models) if results.learns else ()
    if experiment and len(times):
        counts = ", ".join(f"{count:,}" for count in sorted(times["training_observations"].unique()))
        yield say("trained_on", counts=counts, noise=training_noise(experiment["train"]["snr_db"]))


def other_elevations(results, figure):
    """How accuracy differs between the elevation that trained and the others, of KNN by all its features."""
    run = stated.own_run(results, figure.experiment)
    count = len(sweep_elevations(results.settings["aspect"]))
    for model in run["models"] if run and run["elevation"] != "all" else ():
        if thesis.kind(model, results.settings) != "knn":
            continue
        every, own = (
            stated.ours(results, figure.experiment, model, ACCURACY, elevation=at).set_index("test_snr_db")["value"]
            for at in ("all", "trained")
        )
        trained, both = len(run["elevation"]), own.index.intersection(every.index)
        if len(both) and count > trained:
            snr, label = both.max(), results.names.model(model).label
            others = (count * every[snr] - trained * own[snr]) / (count - trained)
            yield say("other_elevations", model=label, snr=snr, own=own[snr], others=others, count=count - trained)


def own_noise(results, figure):
    """What training at the test images' SNR changes. figure.noisy: an experiment that trains at each of several."""
    for model in figure.models:
        noisy = stated.ours(results, figure.noisy, model, ACCURACY)
        noisy = noisy[noisy["train_snr_db"] == noisy["test_snr_db"]].set_index("test_snr_db")["value"]
        clean = stated.ours(results, figure.experiment, model, ACCURACY).set_index("test_snr_db")["value"]
        if len(noisy) and 0.0 in noisy.index and 0.0 in clean.index:
            label = results.names.model(model).label
            yield say("own_noise", model=label, snr=0.0, trained=noisy[0.0], clean=clean[0.0])


def penalty(results, figure):
    """What the penalty of logistic regression means."""
    own = results.settings["learning"]["models"].get("lr", {}).get("penalty")
    if own is not None:
        yield say("penalty", own=own, inverse=1 / own)


def machine(results, figure):
    """The processor that times are of."""
    if results.learns and len(results.times):
        names, count = ", ".join(sorted(results.times["machine"].unique())), results.times["threads"].max()
        yield say("machine", names=names, threads=f"{count} thread{'s' if count > 1 else ''}")


def pixels(results, figure):
    """What up-sampling makes of distances between images at a kernel of the same scale."""
    scale = results.settings["learning"]["models"][figure.models[0]].get("scale")
    if scale:
        sizes = results.images(results.targets[0], "clean").sizes
        yield say("pixels", ratio=figure.upsampled**2 / (sizes["range"] * sizes["crossrange"]), scale=scale)


def tuning(results, figure):
    """What the choice of hyper-parameters changes on the test images, a sentence for each model that has one."""
    runs = [run for run in results.runs.values() if training(run) == "clean" and run["elevation"] == "all"]
    runs = [run for run in runs if run["split"] == stated.SPLIT and stated.own_run(results, run["experiment"])]
    for model in figure.models:
        curves = []
        for name in (model, f"{model}_tuned"):
            own = [run["experiment"] for run in runs if name in run["models"]][:1]
            rows = [stated.ours(results, experiment, name, ACCURACY) for experiment in own]
            curves += [of.set_index("test_snr_db")["value"] for of in rows]
        if len(curves) == 2:
            own, tuned = curves
            snrs = [snr for snr in stated.shown_snrs(own.index.intersection(tuned.index)) if snr >= 0]
            parts = ", ".join(f"{tuned[snr]:.3f} at {snr:g} dB ({own[snr]:.3f})" for snr in snrs)
            yield say("tuning", model=results.names.model(model).label, parts=parts)


def threshold_effects(results, figure):
    """What thresholds from the test images would add. figure.effects: an SNR in dB for each confidence score."""
    experiment, model, seed = figure.experiment, figure.models[0], results.settings["seed"]
    for score, aim in figure.effects.items() if stated.judged_anew(results, experiment, model) else ():
        snr = nearest(results.settings["noise"]["snr_db"], aim)
        found = anew.effect(results.predictions(experiment, model, snr), score, seed)
        method = results.names.method(model, score)
        yield say("threshold_effects", method=method, snr=snr, found=found, gain=gain_text(found.gain))


def gain_text(gain):
    """A difference with its interval, which it may lack. gain: value, low, high."""
    value, low, high = (signed(one, 4) for one in gain)
    return value if NONE in (low, high) else f"{value} [{low}, {high}]"
