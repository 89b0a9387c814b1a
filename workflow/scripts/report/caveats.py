"""What may surprise in a run: warnings that follow from its config and the sizes of its targets."""

from imaging import geometry


def warnings(config, reaches):
    """(what it is about, sentence) of everything that may surprise: images that fold over, experiments left out.

    config: its sections. reaches: the largest distance of a point of each target from the origin in m; None where
    nothing says it.
    """
    found = []
    figures = geometry.planned(config)
    for name in config["targets"]:
        found += [(name, text) for text in geometry.warnings(figures, config["imaging"], reaches.get(name) or 0.0)]
    learning, roles = config["learning"], {target["role"] for target in config["targets"].values()}
    for name, reason in learning.get("left_out", {}).items():
        found.append((name, f"the default experiment '{name}' is left out. {reason}"))
    for name, experiment in learning["experiments"].items():
        if experiment.get("open", False) and "unknown" not in roles:
            found.append((name, f"experiment '{name}' is open, but no target has role unknown: it is a closed one."))
    return found
