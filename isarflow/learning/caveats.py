"""Warnings of what may surprise in a run, from its config and the sizes of its targets."""

from isarflow.imaging import geometry
from isarflow.learning.experiments import imaged, rejected_roles, split_settings

LEARNING = "learning"  # in place of a target, for a warning about none


def warnings(config, reaches):
    """(target, or LEARNING, and sentence) for everything that may surprise: images that fold over, unused settings.

    reaches: the largest distance of a point of each target from the origin in m; None where it is not known.
    """
    figures = geometry.planned(config)
    place = max(of.get("place", 0) for of in [config["motion"], *_motions(config)])
    for name in imaged(config):
        reach = reaches.get(name) or 0.0
        yield from ((name, text) for text in geometry.warnings(figures, reach))
        least = min(figures["range_extent"], figures["crossrange_extent"])
        if place and least < 2 * (reach + place):
            yield (
                name,
                (
                    f"displaced by up to {place:g} m it reaches {reach + place:.2f} m from the image's centre, and the "
                    f"unambiguous extent is only {least / 2:.2f} m to either side: what lies outside folds over."
                ),
            )
    yield from ((LEARNING, text) for text in _unused(config))


def _motions(config):
    return [experiment.get("motion", {}) for experiment in config["learning"]["experiments"].values()]


def _unused(config):
    """Lines of text: settings of the learning stage that have no effect, and images that no model uses."""
    learning, experiments = config["learning"], config["learning"]["experiments"]
    for name, reason in learning.get("left_out", {}).items():
        yield f"the default experiment '{name}' is left out. {reason}"
    unknown, other = (
        ", ".join(name for name, target in config["targets"].items() if target["role"] == role)
        for role in ("unknown", "other")
    )
    opened = [name for name, experiment in experiments.items() if experiment.get("open", False)]
    for name in opened:
        roles = rejected_roles(split_settings(learning, experiments[name])["scheme"])
        if not any(target["role"] in roles for target in config["targets"].values()):
            yield f"experiment '{name}' is open, but no target has role {' or '.join(roles)}: it is a closed one."
    if not experiments:
        return
    named = {model for experiment in experiments.values() for model in experiment["models"]}
    learners = ", ".join(sorted(model for model in named if learning["models"][model].get("other", False)))
    if unknown and not opened:
        yield f"no experiment has 'open: true': nothing is tested on the targets of role unknown ({unknown})."
    if other and not learners and not (opened and unknown):
        yield f"no experiment is open and none of their models has 'other: true': role other ({other}) is not used."
    if learners and not other:
        yield f"no target has role other: {learners} learns the class 'other' from pure noise alone."
