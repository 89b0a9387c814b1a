"""Check a config against config/schema.yaml, with messages that a user can act on."""

import datetime
import functools

import jsonschema
import yaml

from isarflow.core.errors import InputError
from isarflow.core.folders import ROOT
from isarflow.core.words import near

SCHEMA = ROOT / "config" / "schema.yaml"
LONGEST = 100  # characters of a value that a message shows
TYPES = {
    "object": "a mapping of keys to values",
    "array": "a list",
    "string": "text",
    "integer": "a whole number",
    "number": "a finite number",
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
# A number with a fraction of zero (2.2e9 is one to YAML) is not a whole one; infinity and NaN are no numbers.
BASE = jsonschema.Draft202012Validator
NUMBERS = {
    "integer": lambda _, value: type(value) is int,
    "number": lambda _, value: type(value) in (int, float) and value - value == 0,
}
VALIDATOR = jsonschema.validators.extend(BASE, type_checker=BASE.TYPE_CHECKER.redefine_many(NUMBERS))


@functools.cache
def schema():
    return yaml.load(SCHEMA.read_text(), yaml.CSafeLoader)


def check_schema(value, rules=None, path=()):
    """Raise InputError for the first thing in a value, found at `path` in the config, that is not allowed.

    rules: the whole schema by default.
    """
    rules = rules or schema()
    errors = list(VALIDATOR(rules).iter_errors(value))
    if errors:
        raise InputError(_message(_first(errors), rules, path))


def repeated(values):
    """The first value that occurs a second time; None if each occurs once."""
    return next((value for place, value in enumerate(values) if value in values[:place]), None)


def shown(value):
    """A value about as the user wrote it."""
    if isinstance(value, datetime.date):
        return f"{value} (to YAML a date; in quotes it is text)"
    if value is None or isinstance(value, bool):
        return {None: "nothing", True: "true", False: "false"}[value]
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _first(errors):
    # A misspelt key first: it is the cause of what is missing elsewhere. Then the outermost.
    return min(errors, key=lambda error: (error.validator != "additionalProperties", len(error.absolute_path)))


def _message(error, rules, above=()):
    """One error of jsonschema in words. above: the place in the config of the value that was checked."""
    value, validator, rule = error.instance, error.validator, error.schema.get("description", "")
    parts = [*above, *error.absolute_path]
    if "propertyNames" in error.absolute_schema_path:
        parts.append(value)
    path = ".".join(map(str, parts))
    if validator == "additionalProperties":
        return _unknown_key(error, rules, path)
    if validator == "required":
        missing = next(key for key in error.validator_value if key not in value)
        rule = error.schema.get("properties", {}).get(missing, {}).get("description", "")
        return f"config key '{path}{'.' if path else ''}{missing}' is missing.{_expected(rule)}"
    if validator == "oneOf" and len(parts) == 2 and parts[0] == "targets":
        return _mesh_or_field(path, value)
    if validator == "oneOf":
        inside = [_message(inner, rules, above) for inner in _of_its_form(error)]
        # Of several forms that may be meant, the one that has a key like a misspelt one.
        meant = inside if len(inside) == 1 else [text for text in inside if "did you mean" in text]
        if meant:
            return meant[0] + _expected(rule)
    problem = f"{shown(value)} is not allowed"
    if "propertyNames" in error.absolute_schema_path and not isinstance(value, str):
        problem, rule = f"{shown(value)} is not text; put it in quotes", ""
    elif validator == "type":
        problem = f"{shown(value)} is not {TYPES[error.validator_value]}"
        rule = rule or (f"keys {', '.join(error.schema['properties'])}" if "properties" in error.schema else "")
    elif validator == "enum":
        hint = near(value, error.validator_value).removesuffix(".")
        problem = f"{shown(value)} is not one of {', '.join(error.validator_value)}{hint}"
    elif validator == "uniqueItems":
        problem = f"{shown(repeated(value))} stands twice in the list"
    elif validator in BOUNDS:
        problem = f"{shown(value)} {BOUNDS[validator].format(error.validator_value)}"
        if parts[0] == "radar" and validator == "minimum" and 0 < value < error.validator_value <= 1e9 * value:
            problem += f" Hz; did you mean {value:g}e9?"
    elif validator not in ("oneOf", "not", "pattern"):
        problem = error.message
    where = f"config key '{path}'" if path else "config"
    return f"{where}: {problem}{'' if problem.endswith('?') else '.'}{_expected(rule)}"


def _expected(rule):
    return f" Expected: {rule.rstrip('.')}." if rule else ""


def _of_its_form(error):
    """The first error of each branch of a oneOf that has the value's form: the fault is within the form."""
    branches = {}
    for inner in error.context:
        branches.setdefault(inner.schema_path[0], []).append(inner)
    return [_first(errors) for errors in branches.values() if all(map(_within_form, errors))]


def _within_form(error):
    """Tell whether an error of a branch of a oneOf is within the branch's form, not that the value has another form."""
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
    keys = f"Known keys here: {', '.join(known) or 'none'}."
    return f"config key '{path}{'.' if path else ''}{unknown}' is unknown{hint} {keys}"


def _mesh_or_field(path, target):
    """Say what is wrong with a target that is not exactly one of a mesh and a field."""
    either = "a target is either a 'mesh' (a CAD file) or a 'field' (.ffe, .zarr)"
    if "field" not in target:
        return f"config key '{path}.mesh' is missing: {either}."
    if "mesh" in target:
        return f"config key '{path}.field' stands beside 'mesh': {either}."
    extra = next(key for key in target if key not in ("field", "role"))
    return f"config key '{path}.{extra}' says something about a mesh, and this target is a 'field'; leave it out."
