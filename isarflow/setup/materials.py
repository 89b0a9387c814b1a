"""Write out and check the materials of a config's targets, before any work is done."""

from isarflow.core.errors import InputError
from isarflow.core.folders import ROOT
from isarflow.core.kinds import SOLVERS, kind
from isarflow.core.sweep import frequencies
from isarflow.core.words import near
from isarflow.scattering import needs
from isarflow.scattering.materials import FORMS, is_opaque, is_solid, why_not
from isarflow.setup.schema import check_schema, schema

CATALOGUE = ROOT / "config" / "materials.yaml"


def written_out(targets, read):
    """Return a config's targets with the numbers of their materials that have a name, the target's own beside them.

    read: the function that reads a config's file.
    Raises InputError for a name that config/materials.yaml does not have, and for numbers there that are none.
    """
    written = {}
    for name, target in targets.items():
        written[name] = target | _written_out(("targets", name, "material"), target, read)
        if "parts" in target:
            written[name]["parts"] = {
                part: own | _written_out(("targets", name, "parts", part, "material"), own, read)
                for part, own in target["parts"].items()
            }
    return written


def _of_all(targets):
    """Yield all materials of a config's targets and of their parts: the target's name, the key, and the material."""
    for name, target in targets.items():
        parts = {f".parts.{part}": own for part, own in target.get("parts", {}).items()}
        for where, own in ({"": target} | parts).items():
            if "material" in own:
                yield name, f"targets.{name}{where}.material", own["material"]


def _written_out(path, own, read):
    """The `material` of a target or a part with its numbers, a mapping of that key alone; {} where it says all."""
    said = own.get("material", {})
    said = {"name": said} if isinstance(said, str) else said
    if "name" not in said:
        return {}
    known, name = read(CATALOGUE), said["name"]
    if name not in known:
        there = f"config/materials.yaml has {', '.join(known)}"
        raise InputError(f"config key '{'.'.join(path)}': there is no material '{name}'{near(name, known)} {there}.")
    whole = {**known[name], **said}
    rule = schema()["properties"]["targets"]["additionalProperties"]["properties"]["material"]
    check_schema(whole, rule | {"$defs": schema()["$defs"]}, path)
    return {"material": whole}


def problems(config):
    """Yield sentences, beginning with the key, that say what is wrong with the materials of a config's targets."""
    solver = config["scattering"]["solver"]
    for name, key, material in _of_all(config["targets"]):
        is_metal, body = material.get("resistance") == 0, is_solid(material)  # metal is what all solve
        is_body = body or is_opaque(material)
        if body and "parts" in config["targets"][name]:
            alone = "a solid body is a target of its own, with 'mesh' and 'material' in place of 'parts'"
            yield f"'{key}.thickness' is missing: {alone}."
            continue
        if not is_metal and not (stated := kind(SOLVERS, solver).stated).get("solids" if is_body else "sheets", False):
            alone = "thin sheets" if stated.get("sheets", False) else "perfect conductors"
            yield f"'{key}': the solver '{solver}' has {alone} alone; take mom, or leave it out."
        if not (is_metal or body) and needs.method(config, name).get("formulation") == "cfie":
            what = "surface impedances" if is_body else "sheets"
            yield f"'{key}': {what} are solved by 'formulation: efie' alone; write it for this target, or leave it out."
        yield from _of_form(key, material)
        if why := why_not(material, frequencies(config["radar"])[-1]):
            yield f"'{key}{why}"


def _of_form(key, material):
    """Find what a material, a mapping, has too much or lacks of the form that it is nearest to."""
    said = material.keys() - {"name"}
    form = min(FORMS, key=lambda form: (-len(said & set(form)), len(said ^ set(form))))
    for more in sorted(said - set(form)):
        has = " and ".join(number for number in form if number in said)
        yield f"'{key}.{more}': a material with {has} has none; leave it out."
    for missing in (number for number in form if number not in said):
        why = f"a material has {', or '.join('{' + ', '.join(form) + '}' for form in FORMS)}"
        if missing == "thickness":
            film = "; leave 'material' out for solid metal" if "conductivity" in said else ""
            why = f"that of the {'film' if film else 'coating'}, in metres{film}"
        yield f"'{key}.{missing}' is missing: {why}."
