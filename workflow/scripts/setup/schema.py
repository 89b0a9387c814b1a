"""What config/schema.yaml says of a config, in messages that a user can act on."""

import datetime
import difflib
import functools
import re
from pathlib import Path

import jsonschema
import yaml

from core.errors import InputError

SCHEMA = Path(__file__).resolve().parents[3] / "config" / "schema.yaml"
LONGEST = 100  # characters of a value that a message shows
TYPES = {
    "object": "a mapping of keys to values",
    "array": "a list",
    "string": "text",
    "integer": "a whole number",
    "number": "a number",
    "boolean": "true or false",
}
BOUNDS = {
    "minimum": "is less than {:.10g}",
    "maximum": "is more than {:.10g}",
    "exclusiveMinimum": "is not more than {:.10g}",
    "exclusiveMaximum": "is not less than {:.10g}",
    "minItems": "has fewer than {} entries",
    "maxItems": "has more than {} entries",
    "minProperties": "has fewer than {} keys",
    "maxProperties": "has more than {} keys",
}


@functools.cache
def schema():
    return yaml.load(SCHEMA.read_text(), yaml.CSafeLoader)


def check_schema(value, rules=None, path=()):
    """Raise InputError for the first thing in a value, which stands at `path` in the config, that is not allowed.

    rules: the whole schema, unless others are given.
    """
    rules = rules or schema()
    errors = list(jsonschema.Draft202012Validator(rules).iter_errors(value))
    if errors:
        raise InputError(_message(_first(errors), rules, path))


def near(name, names):
    """'; did you mean ...?' with the name that is nearest, whatever its case, or a full stop."""
    spelt = {other.lower(): other for other in names}
    found = difflib.get_close_matches(str(name).lower(), spelt, n=1)
    return f"; did you mean '{spelt[found[0]]}'?" if found else "."


def shown(value):
    """A value as the user wrote it, near enough."""
    words = {None: "nothing", True: "true", False: "false"}
    if isinstance(value, datetime.date):
        return f"{value} (to YAML a date; in quotes it is text)"
    if isinstance(value, bytes | set):
        return f"a value with a tag of YAML's own (!!{'binary' if isinstance(value, bytes) else 'set'})"
    text = words[value] if value is None or isinstance(value, bool) else repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _first(errors):
    # A misspelt key first: it is the cause of what is missing elsewhere. Then the outermost.
    return min(errors, key=lambda e: (e.validator != "additionalProperties", len(e.absolute_path)))


def _message(error, rules, above=()):
    parts = [*above, *error.absolute_path]
    if "propertyNames" in error.absolute_schema_path:
        parts.append(error.instance)
        if not isinstance(error.instance, str):
            return f"config key '{'.'.join(map(str, parts))}': {shown(error.instance)} is not text; put it in quotes."
    path = ".".join(map(str, parts))
    where = f"config key '{path}'" if path else "config"
    rule = error.schema.get("description", "")
    if error.validator == "additionalProperties":
        return _unknown_key(error, rules, path)
    if error.validator == "required":
        missing = next(key for key in error.validator_value if key not in error.instance)
        rule = error.schema.get("properties", {}).get(missing, {}).get("description", "")
        path = f"{path}.{missing}" if path else missing
        return f"config key '{path}' is missing." + _expected(rule)
    if error.validator == "oneOf" and len(parts) == 2 and parts[0] == "targets":
        return _mesh_or_field(path, error.instance)
    if error.validator == "oneOf":
        # Of several forms the one that the value has: what is wrong is within it.
        inside = [_first(errors) for errors in _branches(error).values() if all(map(_not_of_form, errors))]
        messages = [_message(one, rules, above) for one in inside]
        # Of several forms that may be meant, the one that has a key like a misspelt one.
        meant = messages if len(messages) == 1 else [text for text in messages if "did you mean" in text]
        if meant:
            return meant[0] + _expected(rule)
    problem = f"{shown(error.instance)} is not allowed"
    if error.validator == "type":
        problem = f"{shown(error.instance)} is not {TYPES[error.validator_value]}"
        rule = rule or (f"keys {', '.join(error.schema['properties'])}" if "properties" in error.schema else "")
    elif error.validator == "enum":
        hint = near(error.instance, error.validator_value).removesuffix(".")
        problem = f"{shown(error.instance)} is not one of {', '.join(error.validator_value)}{hint}"
    elif error.validator == "uniqueItems":
        repeated = next(one for place, one in enumerate(error.instance) if one in error.instance[:place])
        problem = f"{shown(repeated)} stands twice in the list"
    elif error.validator in BOUNDS:
        problem = f"{shown(error.instance)} {BOUNDS[error.validator].format(error.validator_value)}"
    elif error.validator not in ("oneOf", "not", "pattern"):
        problem = error.message
    return f"{where}: {problem}{'' if problem.endswith('?') else '.'}" + _expected(rule)


def _expected(rule):
    return f" Expected: {rule.rstrip('.')}." if rule else ""


def _branches(error):
    """The errors of each branch of a oneOf, by the branch's number."""
    found = {}
    for inner in error.context:
        found.setdefault(inner.schema_path[0], []).append(inner)
    return found


def _not_of_form(error):
    """Whether an error of a branch of a oneOf is within the branch's form, and not that the value has another."""
    within = [part for part in error.schema_path if part != "$ref"]
    return len(within) > 2 or error.validator not in ("type", "const", "oneOf")


def _unknown_key(error, rules, path):
    known = sorted(error.schema.get("properties", {}))
    unknown = next(key for key in error.instance if key not in known)
    hint = near(unknown, known)
    sections = {**schema()["properties"], **rules["properties"]}
    elsewhere = [name for name, section in sections.items() if unknown in section.get("properties", {})]
    if hint == "." and elsewhere:
        hint = f"; did you mean '{elsewhere[0]}.{unknown}'?"
    outer, _, inner = str(unknown).partition(".")
    if inner and outer in known:
        hint = f"; did you mean '{outer}: {{{inner}: ...}}'?"
    elif re.fullmatch(r"[\d.]+(e[+-]?\d+)?", str(unknown), re.IGNORECASE):
        hint = "; did you mean a decimal point by the comma before it?"
    path = f"{path}.{unknown}" if path else str(unknown)
    return f"config key '{path}' is unknown{hint} Known keys here: {', '.join(known) or 'none'}."


def _mesh_or_field(path, target):
    """What is wrong with a target that is not exactly one of a mesh and a field."""
    either = "a target is either a 'mesh' (a CAD file) or a 'field' (.ffe, .zarr)"
    if "field" not in target:
        return f"config key '{path}.mesh' is missing: {either}."
    if "mesh" in target:
        return f"config key '{path}.field' stands beside 'mesh': {either}."
    extra = next(key for key in target if key not in ("field", "role"))
    return f"config key '{path}.{extra}' says something about a mesh, and this target is a 'field'; leave it out."
