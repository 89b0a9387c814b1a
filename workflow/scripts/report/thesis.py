"""What the reference thesis did and how far a run is from it: sizes of networks, definition of SNR, frequency."""

import pandas as pd

from learning import capsules
from learning.experiments import REFERENCE
from report.layout import figure
from report.plots import draw_matrix, finish, matrix, panels
from report.vocabulary import COUNTED, heading, select, split_text, title

# The thesis's sizes, by kind of model (its chapter 5). Other kinds have none.
SIZES = {"fcnn": {"width": 756}, "capsule": {"width": 256, "capsules": 32}}
DECODER = 512  # units of its capsule network's first decoder layer
PIXELS = 32  # a side, of the images that its capsule network sees
CENTER_FREQUENCY = 5.55e9  # Hz
DEFINITION = "mean"  # of SNR, in the listing that made its figures
MARKERS = "▲ at least, ▼ at most, ● equal to"
FULL_SIZE = "thesis, full-size network, 5.55 GHz"
CLASSES = ["drone", "missile", "other"]  # of its confusion matrices


def kind(model, settings):
    """The kind of a model: the name of its file. settings: the config's sections."""
    return settings["learning"]["models"].get(model, {}).get("kind", model)


def full_size(model, settings):
    """Whether a model has the thesis's sizes; one of a kind that has no sizes always has."""
    own = settings["learning"]["models"].get(model, {})
    return all(own.get(name) == size for name, size in SIZES.get(kind(model, settings), {}).items())


def network(model, results):
    """A model in words for prose; a capsule network that is not of the thesis's size with its own."""
    settings, name = results.settings, results.names.model(model).words
    if kind(model, settings) != "capsule" or model not in settings["learning"]["models"]:
        return name
    name = name if "capsule network" in name else f"the capsule network {name}"
    if full_size(model, settings):
        return name.replace("the capsule network", "the thesis's capsule network") if model == REFERENCE[0] else name
    name = name.replace("capsule network", f"{_compared(model, settings)} capsule network")
    return f"{name} ({size(model, settings)})"


def size(model, settings):
    """The size of a capsule network in words."""
    own = settings["learning"]["models"][model]
    return f"{own['width']} filters, {own['capsules']} capsule channels"


def ratio(model, settings):
    """How many times the weights of a capsule network the thesis's has, both without their decoders."""
    own = settings["learning"]["models"][model]
    return _weights(*SIZES["capsule"].values()) / _weights(own["width"], own["capsules"])


def difference(model, settings):
    """In words how a capsule network differs from the thesis's; empty where it does not."""
    if full_size(model, settings):
        return ""
    times = ratio(model, settings)
    same = settings["radar"]["center_frequency"] == CENTER_FREQUENCY
    frequency = "" if same else f", and saw images at {CENTER_FREQUENCY / 1e9:g} GHz"
    return (
        f"{_compared(model, settings)}: {size(model, settings)}; the thesis's has {SIZES['capsule']['width']} and "
        f"{SIZES['capsule']['capsules']}, {f'{times:.0f}' if times >= 10 else f'{times:.2g}'} times the weights before "
        f"the decoder{frequency}"
    )


def _compared(model, settings):
    return "reduced" if ratio(model, settings) > 1 else "resized"


def _weights(width, channels):
    """Weights and offsets of a capsule network of two classes before its decoder."""
    layers = capsules.layers((PIXELS, PIXELS, 1), 2, width, channels, DECODER)
    return sum(layer.count for name, layer in layers.items() if not name.startswith("decoder"))


def offset(results, opens):
    """By how many dB the thesis's SNRs are larger by this run's definition: the mean over the targets that count.

    opens: whether scores of the open set are meant. 0 where both define it alike; None where the images do not say it.
    """
    settings = results.settings
    if settings["noise"]["definition"] == DEFINITION:
        return 0.0
    names = [name for name in results.targets if settings["targets"][name]["role"] in COUNTED[opens]]
    shifts = [results.images(name, "clean").attrs.get("snr_definition_offset_db") for name in names]
    return float(sum(shifts) / len(shifts)) if shifts and not any(map(pd.isna, shifts)) else None


def moved(published, shift):
    """Published values with `snr_db` by this run's definition and `printed_snr_db` as printed; none for shift None."""
    table = published.assign(printed_snr_db=published["snr_db"], snr_db=published["snr_db"] + (shift or 0.0))
    return table if shift is not None else table.iloc[:0]


def statements(results, opens):
    """The published scores, moved onto the SNR axis of this run for scores of the open or the closed set."""
    return moved(results.published_scores, offset(results, opens))


def marked(shifts, drawn, network=False):
    """A sentence for a caption on published markers: what they are and by how much they were moved.

    shifts: what `offset` gives, by the set of test images, or '' where the figure has only one. drawn: whether there
    are any; network: whether they are of the capsule network.
    """
    if None in shifts.values():
        return (
            " Published values are left out: their SNR is defined otherwise, and these images do not say by how much."
        )
    if not drawn:
        return ""
    whose = FULL_SIZE if network else f"thesis, {CENTER_FREQUENCY / 1e9:g} GHz"
    parts = [f"{shift:+.1f} dB{f' ({name})' if name else ''}" for name, shift in shifts.items()]
    moved_by = (
        f", moved by {' and '.join(parts)}: their SNR counts an aperture's mean power, this run's that within 3 dB of "
        "its peak"
    )
    return f" Open markers: {whose} ({MARKERS}){moved_by if any(shifts.values()) else ''}."


def confusion_figure(results, name, ours, adaptations):
    """The thesis's confusion matrices of its networks on the open set, beside ours at the nearest SNR.

    name: the figure's; ours: rows of confusion.csv of one experiment. adaptations: what the thesis calls its networks,
    and the model and confidence score here that are the same. Nothing where nothing here is the same, or where the
    experiment trains each model several times.
    """
    theirs = select(moved(results.published_confusion, offset(results, True)), model=list(adaptations))
    ours = select(ours, elevation="all", threshold="thesis")
    aim = theirs["snr_db"].iloc[0] if len(theirs) else ours["test_snr_db"].max()
    ours = select(ours, test_snr_db=min(ours["test_snr_db"], key=lambda snr: abs(snr - aim), default=aim))
    place = results.targets.index
    names, shown = [], []
    for adaptation, (model, score) in adaptations.items():
        cells = select(ours, model=model, score=score)
        if cells["training"].nunique() != 1:
            continue
        names.append(adaptation)
        shown.append((f"{heading(adaptation)}, here", matrix(cells).sort_index(key=lambda index: index.map(place))))
        printed = select(theirs, model=adaptation).set_index("true")[CLASSES]
        if len(printed):
            order = sorted(printed.index, key=lambda target: place(target) if target in results.targets else -1)
            shown.append((f"{heading(adaptation)}, thesis, full size", printed.loc[order]))
    if not names:
        return ()
    snr = ours["test_snr_db"].iloc[0]
    # Below each other where each of ours has a published one.
    rows = 2 if len(shown) == 2 * len(names) else 1
    columns = len(shown) // rows
    drawing, grid = panels(rows, columns, 0.6 + 3 * columns, 3.5 * rows, sharex=False, sharey=False)
    for axes, (text, counts) in zip(grid.T.flat, shown, strict=True):
        draw_matrix(axes, counts, text)
    finish(drawing, grid, "predicted class", "target", legend=False)
    words = ", ".join(map(title, names))
    caption = (
        f"{heading(words)} at {snr:g} dB, {split_text(ours['split'].iloc[0])}, with thesis thresholds: share of each "
        f"target's images and their number.{_beside(theirs) if len(shown) > len(names) else ''}"
    )
    alt = f"Confusion matrices of {words} at {snr:g} dB, with those that were published."
    return (figure(name, drawing, ours, alt, caption, wide=columns > 2),)


def _beside(theirs):
    printed, snr = theirs[["printed_snr_db", "snr_db"]].iloc[0]
    here = f" of its definition, which are {snr:.1f} dB here" if snr != printed else ""
    return (
        f" Beside ours, those of the thesis, of a full-size network at {CENTER_FREQUENCY / 1e9:g} GHz and "
        f"{printed:g} dB{here}; its targets are other models of the same kinds, so agreement is expected in kind only."
    )
