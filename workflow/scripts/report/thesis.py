"""What the reference thesis did and how far a run is from it: sizes of networks, definition of SNR, frequency."""

from isarflow.learning import capsules
from isarflow.learning.experiments import REFERENCE

# The thesis's sizes, by kind of model (its chapter 5), and what they count. Other kinds have none.
SIZES = {"fcnn": {"width": 756}, "capsule": {"width": 256, "capsules": 32}}
UNITS = {"fcnn": {"width": "hidden units"}, "capsule": {"width": "filters", "capsules": "capsule channels"}}
DECODER = 512  # units of its capsule network's first decoder layer
PIXELS = 32  # a side, of the images that its capsule network sees
CENTER_FREQUENCY = 5.55e9  # Hz
DEFINITION = "mean"  # of SNR, in the listing that made its figures


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
    """The size of a network in words; empty for a model of a kind that has none."""
    return _size(kind(model, settings), settings["learning"]["models"].get(model, {}))


def _size(kind, sizes):
    return ", ".join(f"{sizes[name]} {unit}" for name, unit in UNITS.get(kind, {}).items() if name in sizes)


def ratio(model, settings):
    """How many times the weights of a capsule network the thesis's has, both without their decoders."""
    own = settings["learning"]["models"][model]
    return _weights(*SIZES["capsule"].values()) / _weights(own["width"], own["capsules"])


def difference(model, settings):
    """In words how a network differs from the thesis's; empty where it does not."""
    if full_size(model, settings):
        return ""
    if (of := kind(model, settings)) != "capsule":
        return f"{size(model, settings)}; the thesis's {_size(of, SIZES[of])}"
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
