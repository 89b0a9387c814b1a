"""What the reference thesis did and how far a run is from it: sizes of networks, definition of SNR, frequency."""

from isarflow.learning import capsules

# The thesis's sizes, by kind of model (its chapter 5), and what they count. Other kinds have none.
SIZES = {"fcnn": {"width": 756}, "capsule": {"width": 256, "capsules": 32}}
UNITS = {"fcnn": {"width": "hidden units"}, "capsule": {"width": "filters", "capsules": "capsule channels"}}
CENTER_FREQUENCY = 5.55e9  # Hz
DEFINITION = "mean"  # of SNR, in the listing that made its figures


def kind(model, settings):
    """Return the kind of a model: the name of its file. settings: the config's sections."""
    return settings["learning"]["models"].get(model, {}).get("kind", model)


def full_size(model, settings):
    """Return whether a model has the thesis's sizes; one of a kind that has no sizes always has."""
    own = settings["learning"]["models"].get(model, {})
    return all(own.get(name) == size for name, size in SIZES.get(kind(model, settings), {}).items())


def size(model, settings):
    """Return the size of a network in words; empty for a model of a kind that has none."""
    return _size(kind(model, settings), settings["learning"]["models"].get(model, {}))


def _size(kind, sizes):
    return ", ".join(f"{sizes[name]} {unit}" for name, unit in UNITS.get(kind, {}).items() if name in sizes)


def ratio(model, settings):
    """Return how many times the weights of a capsule network the thesis's has, both before their decoders."""

    def weights(of):
        # Two classes, images of 32 x 32 pixels; the decoder's 512 units do not count.
        layers = capsules.layers((32, 32, 1), 2, of["width"], of["capsules"], 512)
        return sum(layer.count for name, layer in layers.items() if not name.startswith("decoder"))

    return weights(SIZES["capsule"]) / weights(settings["learning"]["models"][model])


def difference(model, settings):
    """Return in words how a network differs from the thesis's; empty where it does not."""
    if full_size(model, settings):
        return ""
    if (of := kind(model, settings)) != "capsule":
        return f"{size(model, settings)}; the thesis's {_size(of, SIZES[of])}"
    times = ratio(model, settings)
    compared = "reduced" if times > 1 else "resized"
    same = settings["radar"]["center_frequency"] == CENTER_FREQUENCY
    frequency = "" if same else f", and saw images at {CENTER_FREQUENCY / 1e9:g} GHz"
    return (
        f"{compared}: {size(model, settings)}; the thesis's has "
        f"{' and '.join(map(str, SIZES[of].values()))}, {f'{times:.0f}' if times >= 10 else f'{times:.2g}'} times the "
        f"weights before the decoder{frequency}"
    )
