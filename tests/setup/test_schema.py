"""Every key of config/schema.yaml, of a wrong type, misspelt and left out: each is refused by its name."""

import copy

import pytest

from isarflow.core.errors import InputError
from isarflow.core.kinds import MODELS, available, kind, settings_of
from isarflow.setup.check import check, rules
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.families import expanded
from isarflow.setup.materials import written_out
from isarflow.setup.schema import check_schema, schema
from isarflow.setup.yaml_file import read_yaml

# Of mappings of names that the user gives, one that the default config, or OPTIONAL, has.
NAMED = {"targets": "drone", "models": "knn", "experiments": "fcnn_open", "vary": "arm", "parts": "shell"}
# Of mappings that the default config has not, one that is right.
OPTIONAL = {
    "great_circle": {"from": [0, 0], "through": [90, 0], "angle": {"count": 4}},
    "bistatic": {"receivers": [[0, 0]]},
    "test": {"snr_db": [0]},
    "motion": {},
    "family": {"kind": "quadcopter", "count": 1, "seed": 0},
    "vary": {"arm": [0.02, 0.022]},
    "material": {"resistance": 377},
    "calibrate": {"measured": "resources/fields/ufo.zarr", "computed": "resources/fields/ufo.zarr"},
    "parts": {"shell": {"mesh": "resources/cad/drone.stl"}},
}
WRONG = ("?!", -1e40, float("nan"), None, [{}])  # right for no key


def keys_of(rules, path=()):
    """Every key of a schema by its path in a config: whether it must be there."""
    for key, inner in rules.get("properties", {}).items():
        own = (*path, key)
        if "$ref" in inner:
            inner = schema()["$defs"][inner["$ref"].split("/")[-1]]
        yield own, key in rules.get("required", ())
        yield from keys_of(inner, own)
        if isinstance(inner.get("additionalProperties"), dict):
            yield (*own, NAMED[key]), False
            yield from keys_of(inner["additionalProperties"], (*own, NAMED[key]))


KEYS = dict(keys_of(schema()))
for name in available(MODELS):
    KEYS |= {
        ("learning", "models", name, key): "default" not in rule for key, rule in kind(MODELS, name).settings.items()
    }
KEYS |= {("imaging", key): True for key in settings_of("imaging", {"imager": "fourier"})}
KEYS |= {("scattering", key): True for key in settings_of("scattering", {"solver": "mom"})}


@pytest.fixture(scope="module")
def full():
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        yield load_config()


def refused(config, path, edit):
    """The message for a full config after `edit` was called with the mapping that holds the key."""
    config = copy.deepcopy(config)
    holder = config
    if {"family", "parts"} & {*path[:-1]}:
        del config["targets"]["drone"]["mesh"]
    if {"background", "calibrate", "gate"} & {*path}:
        config["targets"]["drone"] = {"field": "resources/fields/drone.zarr", "role": "known"}
    for key in path[:-1]:
        holder = holder.setdefault(key, copy.deepcopy(OPTIONAL.get(key)))
    edit(holder)
    with pytest.raises(InputError) as caught:
        check_schema(config, rules(config))
        config["targets"] = written_out(expanded(config["targets"]), read_yaml)
        check(config)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("path", KEYS, ids=".".join)
def test_every_key_is_held_to_the_schema(path, full):
    dotted, key = ".".join(path), path[-1]
    for value in WRONG:
        message = refused(full, path, lambda holder, value=value: holder.update({key: value}))
        assert f"'{dotted}" in message, (value, message)
    if key not in NAMED.values():
        misspelt = key + key[-1]
        message = refused(full, path, lambda holder: holder.update({misspelt: holder.pop(key, 1)}))
        assert f"'{dotted}{key[-1]}' is unknown; did you mean '{key}'?" in message
    if KEYS[path]:
        assert f"'{dotted}' is missing" in refused(full, path, lambda holder: holder.pop(key))


def test_the_keys_are_those_of_every_section():
    assert len(KEYS) > 60
    assert {path[0] for path in KEYS} == set(schema()["properties"])
