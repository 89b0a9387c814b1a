"""Families of targets: models of a kind, each made from numbers that are drawn between its generator's bounds."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import FAMILIES, kind, load_class
from isarflow.mesh import shapes, topology

Part = tuple[np.ndarray, np.ndarray]  # vertices (V, 3) in m, triangles (T, 3), outwards


class Generator:
    """The interface of every generator, a class `Family` in a file of its own, resources/cad/families/<kind>.py.

    PARAMETERS: by name the `minimum` and `maximum` of a parameter, its `unit` and a `description`; with `whole: True`
    it is a whole number. SYMMETRY: mirror planes of every model, xz among them; MOVED: those that are left where `pose`
    is not 0. REPEATS: the parameter that says how often a turn looks the same, as blades of a propeller. PARTS: by
    name, {} or the `material` of a model's parts, as of a target's `parts`; without it a model is one body of metal.
    All are literals.
    """

    PARAMETERS: Mapping[str, Mapping[str, Any]] = {}
    PARTS: Mapping[str, Mapping[str, Any]] = {}
    SYMMETRY = ("xz",)
    MOVED = ("xz",)
    REPEATS = ""

    def parts(self, values: Mapping[str, float], pose: float = 0.0) -> dict[str, Part]:
        """Return the closed parts of a model by name, which may cross each other.

        Of a kind with PARTS a name begins with that of such a part and a slash, as "shell/arm", and a part of those may
        be open.
        values: of PARAMETERS, by name; pose: turns of a rotor, or beats of a wing, of which 0 and 1 are the same.
        """
        raise NotImplementedError


def values_of(name: str, seed: int, number: int, vary: Mapping[str, Any]) -> dict[str, float]:
    """Return the parameters of a model of a kind, by name, from its number and the family's seed alone.

    vary: the bounds (low, high) of parameters that are narrower than the generator's.
    """
    values = {}
    for parameter, rule in kind(FAMILIES, name).stated.get("PARAMETERS", {}).items():
        low, high = vary.get(parameter, (rule["minimum"], rule["maximum"]))
        text = f"{seed} {Path(name).stem} {number} {parameter}"
        share = int.from_bytes(hashlib.sha256(text.encode()).digest()[:6]) / 2**48  # below 1
        values[parameter] = int(low + share * (high - low + 1)) if is_whole(rule) else low + share * (high - low)
    return {parameter: value if isinstance(value, int) else round(value, 6) for parameter, value in values.items()}


def is_whole(rule: Mapping[str, Any]) -> bool:
    """Tell whether a parameter is a whole number."""
    return bool(rule.get("whole", False))


def stated_values(family: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the parameters of a model by name, each with its `value` and `unit`."""
    stated = kind(FAMILIES, family["kind"]).stated.get("PARAMETERS", {})
    values = values_of(**_drawn(family))
    return {name: {"value": value, "unit": stated[name]["unit"]} for name, value in values.items()}


def parts_of(family: Mapping[str, Any], pose: float = 0.0) -> dict[str, Part]:
    """Return the parts of a model by name. family: kind, seed, number and vary, as a target of the config has it."""
    generator = load_class(FAMILIES, family["kind"], Generator)()
    return generator.parts(values_of(**_drawn(family)), pose)


def joined(family: Mapping[str, Any]) -> Part:
    """Return the surfaces of all parts of a model, which cross each other; to unite them takes far longer."""
    return shapes.joined(list(parts_of(family).values()))


def materials_of(name: str) -> dict[str, dict[str, Any]]:
    """Return the PARTS of a kind: {} of one body of metal."""
    return {part: dict(own) for part, own in kind(FAMILIES, name).stated.get("PARTS", {}).items()}


def surfaces(family: Mapping[str, Any], pose: float = 0.0) -> dict[str, Part]:
    """Return the surface of each of the PARTS of a model by name: the union of its closed parts, and its open ones.

    InputError for a part of the generator's without a surface, and for a surface that is of none of them.
    """
    made = parts_of(family, pose)
    groups: dict[str, dict[str, Part]] = {name: {} for name in materials_of(family["kind"])}
    for name, part in made.items():
        group = name.partition("/")[0]
        if group not in groups:
            raise InputError(f"{family['kind']}: '{name}' begins with none of its PARTS, {', '.join(groups)}.")
        groups[group][name] = part
    for group, own in groups.items():
        if not own:
            raise InputError(f"{family['kind']}: its part '{group}' has no surface; leave it out of PARTS.")
    planes = mirror_planes(family["kind"], pose)
    return {group: _surface(own, planes) for group, own in groups.items()}


def _surface(parts: Mapping[str, Part], planes: Any) -> Part:
    closed = {name: part for name, part in parts.items() if topology.closed_pieces(part[1])[1].all()}
    sheets = [part for name, part in parts.items() if name not in closed]
    return shapes.joined(([united(closed, planes)] if closed else []) + sheets)


def solid(family: Mapping[str, Any], pose: float = 0.0) -> Part:
    """Return the surface of a model, as `parts_of`: the union of its parts, and exactly symmetric if its kind is."""
    return united(parts_of(family, pose), mirror_planes(family["kind"], pose))


def united(parts: Mapping[str, Part], planes: Any = ()) -> Part:
    """Return the union of parts; with the plane xz it is that of the left half and its mirror image."""
    if "xz" in planes:
        left = [part for part in parts.values() if part[0][:, 1].max() > 0]
        vertices, triangles = shapes.symmetric(shapes.joined(left))
    else:
        first, *others = parts.values()
        vertices, triangles = shapes.union(first, shapes.joined(others or [first]))
    # The union gives its triangles in another order each time.
    first = triangles.argmin(axis=1)[:, None]
    triangles = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    return vertices, triangles[np.lexsort(triangles.T[::-1])]


def mirror_planes(name: str, pose: float = 0.0) -> list[str]:
    """Return the mirror planes of all models of a kind in a pose."""
    return list(kind(FAMILIES, name).stated.get("SYMMETRY" if pose % 1 == 0 else "MOVED", ("xz",)))


def period(family: Mapping[str, Any]) -> float:
    """Return after which pose a model looks the same: a turn, or a beat, or its part between two blades."""
    repeats = kind(FAMILIES, family["kind"]).stated.get("REPEATS", "")
    return 1 / values_of(**_drawn(family))[repeats] if repeats else 1.0


def _drawn(family: Mapping[str, Any]) -> dict[str, Any]:
    return {"name": family["kind"], **{key: family[key] for key in ("seed", "number", "vary")}}
