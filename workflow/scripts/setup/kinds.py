"""The kinds of models, imagers and solvers: one file each, which states its abilities and its settings.

The files are read, not run: importing them would take longer than all other checks together.
"""

import ast
import functools
from typing import NamedTuple

from isarflow.core.errors import InputError
from isarflow.setup.closure import SCRIPTS
from isarflow.setup.schema import near


class Seam(NamedTuple):
    """The folder of kinds of one sort (below workflow/scripts), and the class and methods that each file defines."""

    folder: str
    class_name: str
    methods: frozenset


class Kind(NamedTuple):
    """A file's statements on itself: its class's methods, attributes that are literals, and the settings it takes.

    asked: settings that it reads as `self.settings["name"]` and nowhere tests for.
    Those of a base class from another file below workflow/scripts are its own, too.
    An attribute SETTINGS is a mapping of a setting's name to its JSON schema (type, bounds, description); without one
    any settings are taken.
    """

    file: str  # below workflow/scripts
    methods: frozenset
    stated: dict
    asked: frozenset

    @property
    def settings(self):
        return self.stated.get("SETTINGS")


MODELS = Seam("learning/models", "Model", frozenset({"fit", "evaluate"}))
IMAGERS = Seam("imaging/imagers", "Imager", frozenset({"axes", "at"}))
SOLVERS = Seam("scattering/solvers", "Solver", frozenset({"plan", "solve"}))
# The base classes in these files have the defaults for kinds that state nothing; their methods are not defined.
BASES = "learning/classifier.py", "scattering/solver.py"
# Sections of the config that name one kind, by this key, with its settings beside it; and the kind whose
# settings are shown where a section names none.
SECTIONS = {"imaging": ("imager", IMAGERS, "fourier"), "scattering": ("solver", SOLVERS, "mom")}


def settings_of(section, settings):
    """The JSON schemas of the settings of the kind that a section's mapping names; None if it takes any.

    Raises InputError if there is no such kind.
    """
    key, seam, default = SECTIONS[section]
    name = settings.get(key, default) if isinstance(settings, dict) else default
    check_kind(seam, name, f"config key '{section}.{key}'")
    return kind(seam, name).settings


def available(seam):
    """The names of all kinds of a seam, sorted."""
    return sorted(path.stem for path in (SCRIPTS / seam.folder).glob("*.py") if path.stem[0] != "_" and path.is_file())


def check_kind(seam, name, key, hint=None):
    """Raise InputError if there is no such kind, or its file has not the class and methods of its seam.

    key: the start of the message; hint: what it says instead of the nearest name.
    """
    names = available(seam)
    if name not in names:
        raise InputError(
            f"{key}: there is no {seam.class_name.lower()} '{name}'{hint or near(name, names)} There are: "
            f"{', '.join(names)}; one of your own is a file {name}.py in workflow/scripts/{seam.folder}."
        )
    try:
        methods = kind(seam, name).methods
    except SyntaxError as error:
        raise InputError(f"{key}: {name}.py, line {error.lineno or 1}: {error.msg}.") from None
    except (ValueError, OSError) as error:
        raise InputError(f"{key}: {name}.py is not a file of Python in UTF-8 ({error}).") from None
    if not seam.methods <= methods:
        wanted = " and ".join(sorted(seam.methods, reverse=True))
        raise InputError(f"{key}: {name}.py has no class {seam.class_name} with methods {wanted}.")


@functools.cache
def kind(seam, name):
    """The Kind of this name. Raises SyntaxError for a file that is not Python."""
    file = f"{seam.folder}/{name}.py"
    return Kind(file, *_said(file, seam.class_name))


def _said(file, name):
    """The parts of a `Kind` of a class in a file, with its bases from files below workflow/scripts."""
    tree = ast.parse((SCRIPTS / file).read_bytes(), file)
    found = next((node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name), None)
    if found is None:
        return frozenset(), {}, frozenset()
    methods, stated, asked = frozenset(), {}, _asked(found)
    imported = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module and not node.level]
    for base in reversed([base.id for base in found.bases if isinstance(base, ast.Name)]):
        for node in imported:
            module = f"{node.module.removeprefix('isarflow.').replace('.', '/')}.py"
            names = [alias.name for alias in node.names if not alias.asname]
            if base in names and module not in BASES and (SCRIPTS / module).is_file():
                inherited, literals, wanted = _said(module, base)
                methods, stated, asked = methods | inherited, stated | literals, asked | wanted
    for node in found.body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                try:
                    stated[target.id] = ast.literal_eval(node.value)
                except (AttributeError, ValueError):  # no plain name, no value, or none that is a literal
                    continue
    return methods | {node.name for node in found.body if isinstance(node, ast.FunctionDef)}, stated, asked


def _asked(found):
    """Names of the settings that a class cannot do without."""
    taken, sought = set(), set()
    for node in ast.walk(found):
        match node:
            case ast.Subscript(value=ast.Attribute(attr="settings"), slice=ast.Constant(value=str(name))):
                taken.add(name)
            case ast.Compare(left=ast.Constant(value=str(name))):  # "name" in self.settings
                sought.add(name)
    return frozenset(taken - sought)


def page_names(models):
    """The page's names for a config's models and their confidence scores: `models` and `scores`, mappings.

    models: the config's. A kind states it as LABELS, of each model's name its label, its name within a sentence and its
    place on the page, and SCORES, of each confidence score's name its label and place. Names not stated are left out.
    """
    stated = [kind(MODELS, settings.get("kind", name)).stated for name, settings in models.items()]
    every = {attribute: [names.get(attribute, {}) for names in stated] for attribute in ("LABELS", "SCORES")}
    # Sorted, as Snakemake compares params by their text.
    labels, scores = (dict(sorted(item for names in lists for item in names.items())) for lists in every.values())
    return {"models": labels, "scores": scores}
