"""Write out the poses of a config's targets with moving parts: each but the first becomes a target of its own.

The first is the target itself. Each is meshed and solved as any target is, so they run beside each other, and one more
is one job more.
"""

from isarflow.core.errors import InputError
from isarflow.mesh.families import period

ROLE = "pose"  # of targets that are solved alone: a target's further poses, which have no images of their own
LEARNED = "class", "kind", "reference"  # what is said of a target, and not of each of its poses


def posed(targets):
    """Return a config's targets with the first pose in each one's place, and <name>_pose_01, ... as further targets.

    `poses` of a target is then the list of these names. Of a family, whose models have `poses`, their number, they
    stand evenly over a turn, or a beat, or as much of it as repeats. Raises InputError where parts have different
    numbers of poses, and for a pose with the name of another target.
    """
    written = {}
    for name, target in targets.items():
        first, *others = _poses(f"targets.{name}", target)
        numbers = [f"{number:0{max(2, len(str(len(others))))}}" for number in range(1, len(others) + 1)]
        further = {f"{name}_pose_{number}": other for number, other in zip(numbers, others, strict=True)}
        written[name] = first | ({"poses": list(further)} if further else {})
        for pose, other in further.items():
            if pose in targets:
                raise InputError(f"config key 'targets': {pose} is also a pose of {name}; rename it.")
            written[pose] = {key: value for key, value in other.items() if key not in LEARNED} | {"role": ROLE}
    return written


def _poses(key, target):
    """The mapping of each pose of a target, without poses in it; that of a still one alone."""
    bare = {name: value for name, value in target.items() if name != "poses"}
    if "family" in target:
        count = target.get("poses", 1)
        step = period(target["family"]) / count
        turned = [{"pose": number * step} if number else {} for number in range(count)]
        return [bare | {"family": target["family"] | pose} for pose in turned]
    if "poses" in target:
        return [bare | {"mesh": path} for path in target["poses"]]
    parts = target.get("parts", {})
    moving = {name: len(part["poses"]) for name, part in parts.items() if "poses" in part}
    if len(set(moving.values())) > 1:
        said = ", ".join(f"{name} has {count}" for name, count in moving.items())
        raise InputError(f"config key '{key}.parts': parts move together, with as many poses each; {said}.")
    count = max(moving.values(), default=0)
    return [bare | {"parts": _at(parts, number)} for number in range(count)] or [bare]


def _at(parts, number):
    """The parts of a target in one of its poses."""
    return {
        name: {key: value for key, value in part.items() if key != "poses"}
        | ({"mesh": part["poses"][number]} if "poses" in part else {})
        for name, part in parts.items()
    }
