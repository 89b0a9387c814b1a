"""Why a run's values may differ from the thesis's: what applies to the run, in the sentences of thesis_page.yaml.

Each function yields sentences, or none where what it says does not apply. figure: as of `thesis_page.build`.
"""

from learning.experiments import training
from report import thesis
from report import thesis_anew as anew
from report.layout import signed
from report.section_learning import training_end
from report.selection import nearest
from report.thesis_markdown import NONE, PAGE, say
from report.thesis_statements import judged_anew, ours, own_run, shown_snrs
from report.vocabulary import ACCURACY, POWERS, select, training_noise


def targets(results, figure):
    known, unknown = (" and ".join(results.of_role(role)) for role in ("known", "unknown"))
    yield say("targets", known=known, opened=f", unknown {unknown}" if unknown else "")


def sweep(results, figure):
    """The sweep, where it is another one."""
    parts = []
    for words, theirs in PAGE["sweep"].items():
        here = results.settings
        for key in theirs["key"].split("."):
            here = here.get(key) if isinstance(here, dict) else None
        if here != theirs["value"]:
            scale, unit = theirs["scale"], theirs["unit"]
            own = "otherwise" if here is None else f"{here / scale:g}{unit}"
            parts.append(f"{words} {own} ({theirs['value'] / scale:g}{unit})")
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
    if not results.learns:
        return
    parts, tested = [], results.settings["learning"]["realizations"]
    if results.definition != thesis.DEFINITION:
        parts.append(say("noise_power", power=POWERS[results.definition]))
    count = results.settings["noise"]["realizations"]
    tested = count if tested == "all" else min(tested, count)
    if tested != thesis.REALIZATIONS:
        parts.append(say("noise_tested", count=f"{tested} realization{'s are' if tested > 1 else ' is'}"))
    yield " ".join(parts)


def split(results, figure):
    """Views and their mirror images, which the document's shuffle does not know of."""
    mirrored = [name for name in results.targets if results.settings["targets"][name].get("symmetry")]
    if results.learns and mirrored:
        yield say("split", mirrored=", ".join(mirrored))


def threshold(results, figure):
    if results.learns:
        yield say("threshold")


def parameters(results, figure):
    """Hyper-parameters of the figure's models that are not the document's."""
    parts = []
    for model in figure.models:
        own, kind = results.settings["learning"]["models"].get(model, {}), thesis.kind(model, results.settings)
        theirs = select(results.published_settings, model=kind).set_index("setting")["value"]
        differing = [name for name in theirs.index if name in own and _differs(own[name], theirs[name])]
        other = [f"{name} {own[name]} ({theirs[name]})" for name in differing]
        if other:
            parts.append(f"{results.names.model(model).label}: {', '.join(other)}")
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
    settings = results.settings
    for model in figure.models:
        if model in settings["learning"]["models"] and not thesis.full_size(model, settings):
            kind = thesis.kind(model, settings)
            if kind == "capsule":
                words = thesis.difference(model, settings)
            else:
                theirs = ", ".join(f"{size} {thesis.UNITS[kind][name]}" for name, size in thesis.SIZES[kind].items())
                words = f"{thesis.size(model, settings)}; the thesis's {theirs}"
            yield say("network", model=results.names.model(model).label, words=words)


def epochs(results, figure):
    """How a network's training went here."""
    (model,) = figure.models
    curve = results.curves.get((figure.experiment, model)) if results.learns else None
    if curve is None:
        return
    ended = training_end(curve, results.settings["learning"]["models"][model].get("epochs"))
    kind = thesis.kind(model, results.settings)
    theirs = select(results.published_settings, model=kind, setting="epochs")["value"]
    there = f"; the document's had {theirs.iloc[0]} epochs" if len(theirs) else ""
    yield say("epochs", model=results.names.model(model).words, ended=ended, there=there)


def trained_on(results, figure):
    """How many images trained, and at what SNR."""
    experiments = results.settings["learning"]["experiments"]
    if results.learns and figure.experiment in experiments:
        times = select(results.times, experiment=figure.experiment, model=list(figure.models))
        if counts := [f"{count:,}" for count in sorted(times["training_observations"].unique())]:
            snr = experiments[figure.experiment]["train"]["snr_db"]
            yield say("trained_on", counts=", ".join(counts), noise=training_noise(snr))


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
        ratio = figure.upsampled**2 / (sizes["range"] * sizes["crossrange"])
        yield say("pixels", ratio=ratio, scale=scale)


def tuning(results, figure):
    """What the choice of hyper-parameters changes on the test images, a sentence for each model that has one."""
    for model in figure.models:
        curves = {}
        for run in results.runs.values() if results.learns else ():
            clean = training(run) == "clean" and run["elevation"] == "all" and own_run(results, run["experiment"])
            for name in (model, f"{model}_tuned"):
                if clean and name in run["models"]:
                    rows = ours(results, run["experiment"], name, ACCURACY)
                    curves.setdefault(name, rows.set_index("test_snr_db")["value"])
        if len(curves) == 2:
            own, tuned = curves[model], curves[f"{model}_tuned"]
            snrs = [snr for snr in shown_snrs(own.index.intersection(tuned.index)) if snr >= 0]
            parts = ", ".join(f"{tuned[snr]:.3f} at {snr:g} dB ({own[snr]:.3f})" for snr in snrs)
            yield say("tuning", model=results.names.model(model).label, parts=parts)


def threshold_effects(results, figure):
    """What thresholds from the test images would add. figure.effects: an SNR in dB for each confidence score."""
    model = figure.models[0]
    if judged_anew(results, figure.experiment, model):
        for score, aim in figure.effects.items():
            snr = nearest(results.settings["noise"]["snr_db"], aim)
            predictions = results.predictions(figure.experiment, model, snr)
            found, method = (
                anew.effect(predictions, score, results.settings["seed"]),
                results.names.method(model, score),
            )
            yield say("threshold_effects", method=method, snr=snr, found=found, gain=gain_text(found.gain))


def gain_text(gain):
    """A difference with its interval, which it may lack. gain: value, low, high."""
    value, low, high = (signed(one, 4) for one in gain)
    return value if NONE in (low, high) else f"{value} [{low}, {high}]"
