"""Why a run's values may differ from the thesis's: what it did otherwise, read off the run. Sentences, or nothing."""

from report import thesis
from report.section_learning import training_end
from report.vocabulary import POWERS, select, training_noise

# Where the page says more.
SLIPS = "[Slips of the document](#slips-of-the-document)"


def everywhere(results):
    """What differs in every figure."""
    made = (imager,) if results.images_are_made else ()
    return reasons(results, targets, sweep, *made, *((noise, split, threshold) if results.learns else ()))


def reasons(results, *topics):
    """Sentences on these topics that apply to the run. A topic is a function below, or it and its arguments."""
    calls = (topic if isinstance(topic, tuple) else (topic,) for topic in topics)
    return tuple(words for function, *arguments in calls if (words := function(results, *arguments)))


def targets(results):
    known, unknown = (" and ".join(results.of_role(role)) for role in ("known", "unknown"))
    opened = f", unknown {unknown}" if unknown else ""
    return (
        f"Targets: known {known}{opened}; the document's are other models of the same kinds, so that agreement is to "
        "be expected in kind only."
    )


def sweep(results):
    """The sweep, where it is another one."""
    parts = []
    for words, (keys, theirs, scale, unit) in thesis.SWEEP.items():
        here = results.settings
        for key in keys:
            here = here.get(key) if isinstance(here, dict) else None
        if here != theirs:
            own = "otherwise" if here is None else f"{here / scale:g}{unit}"
            parts.append(f"{words} {own} ({theirs / scale:g}{unit})")
    return f"Sweep, with the document's in brackets: {', '.join(parts)}." if parts else ""


def imager(results):
    """The way that images are formed."""
    imaging = results.settings["imaging"]
    if imaging["imager"] != "fourier":
        return f"Images are formed by `{imaging['imager']}`; the document's by a Fourier transform."
    words = {
        "polar": "are interpolated onto a Cartesian grid, as its text says; its listing B.1 prepares that grid and "
        "does not use it",
        "none": "are Fourier transforms of the samples as they are, as its listing B.1 has it; its text interpolates "
        "onto a Cartesian grid first",
        "exact": "are back-projected; its text interpolates onto a Cartesian grid, its listing B.1 does not",
    }
    return f"Images {words[imaging['reformat']]}."


def noise(results):
    """The definition of SNR, and how many realizations of the noise are tested."""
    definition, tested = results.definition, results.settings["learning"]["realizations"]
    parts = []
    if definition != thesis.DEFINITION:
        parts.append(
            f"This run's SNRs are by {POWERS[definition]}; its values here count every image at the SNR that it has by "
            "mean power, as in the document's listing."
        )
    count = results.settings["noise"]["realizations"]
    tested = count if tested == "all" else min(tested, count)
    if tested != thesis.REALIZATIONS:
        parts.append(f"Of the noise {tested} realization{'s are' if tested > 1 else ' is'} tested here, three there.")
    return " ".join(parts)


def split(results):
    """Views and their mirror images, which the document's shuffle does not know of."""
    planes = results.settings["targets"]
    mirrored = [name for name in results.targets if planes[name].get("symmetry")]
    if not mirrored:
        return ""
    return (
        f"Split at random: here a view and its mirror image ({', '.join(mirrored)} have mirror planes) are on one "
        "side; its listing shuffles azimuths, so that of a symmetric target the mirror image of a test image may "
        "train."
    )


def threshold(results):
    return (
        "Thresholds of the open set: here chosen on images at validation azimuths, for each SNR by itself, for the "
        f"largest weighted F1; its listing D.1 takes the test images and counts errors ({SLIPS} says what that makes "
        "here)."
    )


def parameters(results, *models):
    """Hyper-parameters that are not the document's, of these models."""
    parts = []
    for model in models:
        own, kind = results.settings["learning"]["models"].get(model, {}), thesis.kind(model, results.settings)
        theirs = select(results.published_settings, model=kind).set_index("setting")["value"]
        other = [
            f"{name} {own[name]} ({value})"
            for name, value in theirs.items()
            if name in own and differs(own[name], value)
        ]
        if other:
            parts.append(f"{results.names.model(model).label}: {', '.join(other)}")
    return f"Settings, with the document's in brackets: {'; '.join(parts)}." if parts else ""


def differs(own, printed):
    """Whether a setting is another than the printed one, which is text."""
    try:
        return float(own) != float(printed)
    except (TypeError, ValueError):
        return str(own) != printed


def network(results, model):
    """The size of a network, where it is not the thesis's."""
    if model not in results.settings["learning"]["models"] or thesis.full_size(model, results.settings):
        return ""
    if thesis.kind(model, results.settings) == "capsule":
        words = thesis.difference(model, results.settings)
    else:
        kind = thesis.kind(model, results.settings)
        theirs = ", ".join(f"{size} {thesis.UNITS[kind][name]}" for name, size in thesis.SIZES[kind].items())
        words = f"{thesis.size(model, results.settings)}; the thesis's {theirs}"
    return f"Network: {results.names.model(model).label}, {words}."


def epochs(results, run, model):
    """How a network's training went here."""
    curve = results.curves.get((run, model)) if results.learns else None
    if curve is None:
        return ""
    planned_epochs = results.settings["learning"]["models"][model].get("epochs")
    theirs = select(results.published_settings, model=thesis.kind(model, results.settings), setting="epochs")["value"]
    there = f"; the document's had {theirs.iloc[0]} epochs" if len(theirs) else ""
    return f"Training of {results.names.model(model).words} ended {training_end(curve, planned_epochs)}{there}."


def trained_on(results, experiment, *models):
    """How many images trained, and at what SNR."""
    experiments = results.settings["learning"]["experiments"]
    if not results.learns or experiment not in experiments:
        return ""
    times = select(results.times, experiment=experiment, model=list(models))
    counts = sorted(times["training_observations"].unique())
    if not counts:
        return ""
    train = experiments[experiment]["train"]
    return f"Training images here: {', '.join(f'{count:,}' for count in counts)}, {training_noise(train['snr_db'])}."


def penalty(results):
    """What the penalty of logistic regression means."""
    own = results.settings["learning"]["models"].get("lr", {}).get("penalty")
    if own is None:
        return ""
    return (
        f"LR: by the document's eq. 4.10 the penalty is w'w / (2 λ), with λ = {own:g} here; were its program's λ a "
        f"factor of w'w / 2 instead, its penalty would be the weaker one that λ = {1 / own:g} is here."
    )


def machine(results):
    """The processor that times are of."""
    if not results.learns or not len(results.times):
        return ""
    names, threads = ", ".join(sorted(results.times["machine"].unique())), results.times["threads"].max()
    return (
        f"Processor: {names}, {threads} thread{'s' if threads > 1 else ''}, other libraries; the document's "
        f"{thesis.MACHINE}, and it does not say whether images were classified alone or in batches."
    )


def pixels(results, upsample, scale):
    """What up-sampling makes of distances between images at a kernel of the same scale."""
    sizes = results.images(results.targets[0], "clean").sizes
    ratio = upsample**2 / (sizes["range"] * sizes["crossrange"])
    return (
        f"Up-sampled images of the same peak have {ratio:.1f} times the pixels, and about so many times the squared "
        f"distance, beside which the kernel's scale stays {scale:g}."
    )
