"""Lay a config over another, key by key; things that the user names are merged one by one."""

from fnmatch import fnmatchcase

from isarflow.core.errors import InputError
from isarflow.core.kinds import SECTIONS, settings_of
from isarflow.core.words import near
from isarflow.setup.schema import schema

# Maps of things that the user names: an overlay adds, changes and, with null, removes single ones.
EXPERIMENTS = "learning.experiments"
NAMED = ("targets", "learning.models", EXPERIMENTS)
ALL = "*"  # `'*': null` removes every one that the overlay itself does not name, `'drone_*': null` those of such names
# Here an overlay's form may differ from the base's: {count} or {start, stop, step}; a grid or single directions.
ALTERNATIVES = ("aspect", "aspect.azimuth", "aspect.great_circle.angle")


def merge(base, overlay, path=""):
    """`base` with `overlay` laid over it; neither is changed.

    Raises InputError for an overlay that removes something the base does not have.
    """
    if not isinstance(base, dict) or not isinstance(overlay, dict):
        return overlay
    if path == "imaging.focus":
        return overlay  # settings of one method do not hold for another
    if path in NAMED:
        return _named(base, overlay, path)
    if path in ALTERNATIVES and not set(overlay) <= set(base):
        return overlay
    if path == "radar" and isinstance(overlay.get("frequencies"), list):
        # A list replaces these two.
        base = {key: value for key, value in base.items() if key not in ("center_frequency", "bandwidth")}
    if path in SECTIONS:
        key, *_ = SECTIONS[path]
        if overlay.get(key, base.get(key)) != base.get(key):
            # Settings of the imager or solver that is replaced do not hold for another.
            kept = {*schema()["properties"][path]["properties"], *(settings_of(path, overlay) or ())}
            base = {name: value for name, value in base.items() if name in kept}
    return base | {
        key: merge(base.get(key, {}), value, f"{path}.{key}" if path else str(key)) for key, value in overlay.items()
    }


def named(overlays, path):
    """Names to which any of the overlays gives a value other than null in one of the maps NAMED."""
    names = set()
    for value in overlays:
        for key in path.split("."):
            value = value.get(key) if isinstance(value, dict) else None
        if isinstance(value, dict):
            names |= {name for name, item in value.items() if item is not None}
    return names


def _named(base, overlay, path):
    if not overlay:
        return {}  # `{}` means none at all; without this line it would change nothing
    patterns = [name for name in overlay if ALL in str(name)]
    merged = {name: value for name, value in base.items() if not any(fnmatchcase(name, of) for of in patterns)}
    for name, value in overlay.items():
        key = f"{path}.{name}"
        if name in patterns:
            if value is not None:
                raise InputError(f"config key '{key}': it takes null alone, which removes all not named here.")
            if name != ALL and not any(fnmatchcase(other, name) for other in base):
                raise InputError(f"config key '{key}': null removes, and no name here is like '{name}'.")
        elif value is not None:
            merged[name] = _entry(base.get(name, {}), value, path, key)
        else:
            _remove(merged, base, name, key)
    return merged


def _entry(base, overlay, path, key):
    """One target, model or experiment. null removes a key of it; to a model it is a value like others."""
    if not isinstance(base, dict) or not isinstance(overlay, dict):
        return overlay
    if path == "targets" and _is_another(base, overlay):
        # Settings of one file or kind do not hold for another.
        base = {name: value for name, value in base.items() if name == "role"}
    merged = dict(base)
    for name, value in overlay.items():
        if value is None and path != "learning.models":
            _remove(merged, base, name, f"{key}.{name}")
        elif name in ("train", "family") and isinstance(value, dict) and isinstance(base.get(name), dict):
            merged[name] = base[name] | value
        else:
            merged[name] = value
    return merged


def _is_another(base, target):
    """Tell whether an overlay makes a target of another file or kind."""
    kind = target["family"].get("kind") if isinstance(target.get("family"), dict) else None
    if kind and kind != base.get("family", {}).get("kind"):
        return True
    said = {form: target[form] for form in ("mesh", "parts", "field", "poses") if target.get(form) is not None}
    return any(_files(own) != _files(base.get(form)) for form, own in said.items() if not isinstance(own, int))


def _files(said):
    """The files that a target says: of parts without their materials, and None of a family's, which have no files."""
    if not isinstance(said, dict):
        return said
    parts = {name: part if isinstance(part, dict) else {"mesh": part} for name, part in said.items()}
    files = {name: part.get("mesh", part.get("poses")) for name, part in parts.items()}
    return files if any(files.values()) else None


def _remove(merged, base, name, key):
    if name not in base:
        raise InputError(f"config key '{key}': null removes, and there is no '{name}' here{near(name, base)}")
    merged.pop(name, None)
