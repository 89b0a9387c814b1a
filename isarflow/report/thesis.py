"""What the reference thesis did and how far a run is from it: sizes of networks, definition of SNR, frequency."""

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
    units, own = UNITS.get(kind(model, settings), {}), settings["learning"]["models"].get(model, {})
    return ", ".join(f"{own[name]} {unit}" for name, unit in units.items() if name in own)
