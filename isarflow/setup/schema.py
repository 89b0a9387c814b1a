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
        raise InputError(_message(_at_fault(errors), rules, path))


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


def _at_fault(errors):
    """The error to show: of a misspelt key, the cause of what is missing elsewhere; else the outermost.

    Of a oneOf it is within the branch whose form the value has: of several that with the fewest errors.
    """
    error = min(errors, key=lambda error: (error.validator != "additionalProperties", len(error.absolute_path)))
    branches = {}
    for inner in error.context:
        branches.setdefault(inner.schema_path[0], []).append(inner)
    fitting = [inside for inside in branches.values() if not any(map(_is_of_another_form, inside))]
    return _at_fault(min(fitting, key=len)) if fitting else error


def _is_of_another_form(error):
    return not error.path and error.validator in ("type", "const", "oneOf")


def _message(error, rules, above=()):
    """One error of jsonschema in words. above: the place in the config of the value that was checked."""
    value, validator, rule = error.instance, error.validator, _rule(error)
    parts, is_name = [*above, *error.absolute_path], "propertyNames" in error.absolute_schema_path
    path = ".".join(map(str, [*parts, value] if is_name else parts))
    if validator == "additionalProperties":
        return _unknown_key(error, rules, path) + _expected(_rule(error.parent) if error.parent else "")
    if validator == "required":
        missing = next(key for key in error.validator_value if key not in value)
        rule = error.schema.get("properties", {}).get(missing, {}).get("description", "")
        return f"config key '{path}{'.' if path else ''}{missing}' is missing.{_expected(rule)}"
    problem = error.message.replace(repr(value), shown(value), 1)
    if is_name and not isinstance(value, str):
        problem, rule = f"{shown(value)} is not text; put it in quotes", ""
    elif validator in ("oneOf", "not", "pattern"):
        problem = f"{shown(value)} is not allowed"
    elif validator == "enum":
        problem += near(value, error.validator_value).removesuffix(".")
    elif validator == "uniqueItems":
        problem = f"{shown(repeated(value))} stands twice in the list"
    elif parts[:1] == ["radar"] and validator == "minimum" and 0 < value < error.validator_value <= 1e9 * value:
        problem += f" Hz; did you mean {value:g}e9?"
    where = f"config key '{path}'" if path else "config"
    return f"{where}: {problem}{'' if problem.endswith('?') else '.'}{_expected(rule)}"


def _rule(error):
    """What the schema says of the value, or of the nearest one around it of which it says something."""
    keys = error.schema.get("properties") if error.validator == "type" else None
    rule = error.schema.get("description") or (f"keys {', '.join(keys)}" if keys else "")
    return rule or (_rule(error.parent) if error.parent else "")


def _expected(rule):
    return f" Expected: {rule.rstrip('.')}." if rule else ""


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
