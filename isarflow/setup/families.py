"""Write out the families of a config: each becomes targets of its own, one for each model."""

from pathlib import Path

from isarflow.core.errors import InputError
from isarflow.core.kinds import FAMILIES, check_kind, kind
from isarflow.core.words import near
from isarflow.mesh.families import is_whole, materials_of, mirror_planes


def expanded(targets):
    """Return a config's targets with <name>_01, <name>_02, ... in place of each family of `count` models.

    A family without a count is one model, the first, of the target's own name. A model's `family` has kind, seed,
    number and vary. Where the config says nothing else, its kind is the family's, its class the family's name, and its
    mirror planes, and the materials of its parts, are those that the generator states.
    Raises InputError for a family that cannot be made, and for a model with the name of another target.
    """
    models = {}
    for name, target in targets.items():
        if "family" not in target:
            _add(models, name, target, targets)
            continue
        family, key = target["family"], f"targets.{name}.family"
        check_kind(FAMILIES, family["kind"], f"config key '{key}.kind'")
        _check_vary(f"{key}.vary", family["kind"], family.get("vary", {}))
        # Of several poses all have the planes that are left where the parts have moved.
        planes = mirror_planes(family["kind"], 0.5 if "poses" in target else 0.0)
        said = {"kind": Path(family["kind"]).stem, "symmetry": planes}
        said |= {"class": name} if target["role"] == "known" else {}
        if parts := _parts(f"targets.{name}", family["kind"], target):
            target = target | {"parts": parts}
        digits = max(2, len(str(family.get("count", 1))))
        for number in range(1, family.get("count", 1) + 1):
            own = {"kind": family["kind"], "seed": family["seed"], "number": number, "vary": family.get("vary", {})}
            model = f"{name}_{number:0{digits}}" if "count" in family else name
            _add(models, model, {**said, **target, "family": own}, {} if model == name else targets)
    return models


def _parts(key, name, target):
    """The parts of a family's models: those that the generator states, with the materials that the target says."""
    stated, said = materials_of(name), target.get("parts", {})
    for part in said:
        if part not in stated:
            there = f"There are: {', '.join(stated)}." if stated else "Its models are one body of metal."
            raise InputError(f"config key '{key}.parts.{part}': {name} has no such part{near(part, stated)} {there}")
    if stated and "material" in target:
        raise InputError(f"config key '{key}.material': {name} has parts, each of its own: {', '.join(stated)}.")
    return stated | said


def _add(models, name, target, targets):
    if name in models or ("family" in target and name in targets):
        raise InputError(f"config key 'targets': there are two targets {name}, one of them a family's; rename one.")
    models[name] = target


def _check_vary(key, name, vary):
    """Raise InputError for bounds of a parameter that the generator does not have, or that leave the generator's."""
    stated = kind(FAMILIES, name).stated.get("PARAMETERS", {})
    for parameter, bounds in vary.items():
        if parameter not in stated:
            raise InputError(
                f"config key '{key}.{parameter}': {name} has no such parameter{near(parameter, stated)} "
                f"There are: {', '.join(stated)}."
            )
        rule, (low, high) = stated[parameter], bounds
        least, most = rule["minimum"], rule["maximum"]
        whole = is_whole(rule) and not all(isinstance(bound, int) for bound in bounds)
        if not least <= low <= high <= most or whole:
            said = f"{low:g} to {high:g} must ascend within {least:g} to {most:g} {rule['unit']}".rstrip()
            numbers = ", in whole numbers" if is_whole(rule) else ""
            raise InputError(f"config key '{key}.{parameter}': {said}{numbers} ({rule['description']}).")
