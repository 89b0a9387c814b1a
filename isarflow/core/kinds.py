"""The kinds of models, imagers and solvers: one file each, with its abilities and settings.

A kind is found by its name, which its file in the seam's folder has, or an installed package's entry point, or
by the path of its file. `load_class` imports a file for a job that uses it. What a file states before that is read from
its text: to import it may take longer than all other checks together.
"""

import ast
import contextlib
import functools
import hashlib
import importlib
import importlib.metadata
import importlib.util
import os
import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

from isarflow.core.errors import InputError
from isarflow.core.folders import PACKAGE, ROOT
from isarflow.core.words import near


class Seam(NamedTuple):
    """The folder of kinds of one sort of the repository, and the class and methods that each file defines.

    Entry points of installed packages are of the group isarflow.<name>.
    """

    folder: str
    class_name: str
    methods: frozenset[str]


class Kind(NamedTuple):
    """A file's statements on itself: the methods of its class, and the attributes of it that are literals.

    Those of a base class from another file of the package are its own, too.
    """

    file: str  # isarflow/..., or the path of a file elsewhere
    methods: set[str]
    stated: dict[str, Any]

    @property
    def settings(self) -> Any:
        """SETTINGS, a mapping of a setting's name to its JSON schema (type, bounds, description); None takes any."""
        return self.stated.get("SETTINGS")


MODELS = Seam("isarflow/learning/models", "Model", frozenset({"fit", "evaluate"}))
IMAGERS = Seam("isarflow/imaging/imagers", "Imager", frozenset({"axes", "at"}))
FOCUS = Seam("isarflow/imaging/focus", "Focus", frozenset({"focus"}))
SOLVERS = Seam("isarflow/scattering/solvers", "Solver", frozenset({"plan", "solve"}))
FAMILIES = Seam("resources/cad/families", "Family", frozenset({"parts"}))
# The base classes in these files have the defaults for kinds that state nothing; their methods are not defined.
BASES = tuple(
    f"isarflow/{path}.py"
    for path in ("learning/classifier", "scattering/solver", "imaging/formation", "imaging/focusing", "mesh/families")
)
# Sections of the config that name one kind, by this key, with its settings beside it; and the kind whose
# settings are shown where a section names none.
SECTIONS = {"imaging": ("imager", IMAGERS, "fourier"), "scattering": ("solver", SOLVERS, "mom")}


def is_path(name: Any) -> bool:
    """Tell the path of a file from the name of a kind."""
    return isinstance(name, str) and name.endswith(".py")


def file_of(seam: Seam, name: str) -> str:
    """The file of the kind of this name, or path, as a message names it: isarflow/..., or the path of a file elsewhere.

    Of a name that there is not it is the file that would have it.
    """
    if is_path(name):
        return os.path.abspath(name if os.path.isfile(name) else ROOT / name)
    package_file = f"{seam.folder}/{name}.py"
    module = None if (PACKAGE.parent / package_file).is_file() else _entry_points(seam).get(name)
    spec = importlib.util.find_spec(module) if module else None
    return spec.origin if spec and spec.origin else package_file


def file_of_object(kind: Any) -> str:
    """The file of an object of a kind's class, as `file_of` names it."""
    module = type(kind).__module__
    if module.startswith("isarflow."):
        return f"{module.replace('.', '/')}.py"
    return sys.modules[module].__file__ or module


@functools.cache
def _installed() -> Any:
    """All entry points of installed packages. To look for them takes 15 ms, so once for all seams."""
    return importlib.metadata.entry_points()


def _entry_points(seam: Seam) -> dict[str, str]:
    """The modules of installed packages that have a kind, by its name."""
    group = f"isarflow.{seam.folder.split('/')[-1]}"
    return {point.name: point.module for point in _installed().select(group=group)}


def load_class(seam: Seam, name: str, base: type) -> Any:
    """The class of the kind of this name, or of a file of this path, which imports from its own folder, too.

    Raises InputError where its file imports what is not installed, and where its class is none of `base`.
    """
    file = file_of(seam, name)
    try:
        loaded = getattr(_module(seam, name, file), seam.class_name)
    except ImportError as error:
        hint = " `pip install -r envs/requirements-torch.txt` installs it." if error.name == "torch" else ""
        raise InputError(f"{file} cannot be imported: {error}.{hint}") from None
    if not issubclass(loaded, base):
        raise InputError(f"{file}: its class {seam.class_name} must be one of {base.__module__}.{base.__qualname__}.")
    return loaded


def _module(seam: Seam, name: str, file: str) -> Any:
    if not is_path(name) and os.path.isabs(file):
        return importlib.import_module(_entry_points(seam)[name])
    if file.startswith("isarflow/"):
        return importlib.import_module(f"{seam.folder.replace('/', '.')}.{name}")
    file = str(PACKAGE.parent / file)
    folder, module = os.path.dirname(file), f"isarflow_plugin_{hashlib.sha256(file.encode()).hexdigest()[:16]}"
    if module not in sys.modules:
        if folder not in sys.path:
            sys.path.append(folder)
        spec = importlib.util.spec_from_file_location(module, file)
        if spec is None or spec.loader is None:
            raise InputError(f"{file} is no file of Python.")
        sys.modules[module] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[module])
    return sys.modules[module]


def available(seam: Seam) -> list[str]:
    """The names of all kinds of a seam, sorted."""
    files = [path for path in (PACKAGE.parent / seam.folder).glob("*.py") if path.is_file()]
    return sorted({*(path.stem for path in files if path.stem[0] != "_"), *_entry_points(seam)})


def settings_of(section: str, settings: Any) -> Any:
    """The JSON schemas of the settings of the kind that a section's mapping names; None if it takes any.

    Raises InputError if there is no such kind.
    """
    key, seam, default = SECTIONS[section]
    name = settings.get(key, default) if isinstance(settings, dict) else default
    check_kind(seam, name, f"config key '{section}.{key}'")
    return kind(seam, name).settings


def check_kind(seam: Seam, name: Any, key: str) -> None:
    """Raise InputError, its message beginning with `key`, if there is no such kind, or it is not as its seam says."""
    names = available(seam)
    if is_path(name) and not os.path.isfile(file_of(seam, name)):
        raise InputError(f"{key}: there is no file {name}.")
    if not is_path(name) and name not in names:
        alternative = ", and one of another name has one of these as its 'kind'" if seam.class_name == "Model" else ""
        missing = f"there is no {seam.class_name.lower()} '{name}'{near(name, names)} There are: {', '.join(names)}"
        raise InputError(f"{key}: {missing}; one of your own is a file, path/to/{name}.py{alternative}.")
    file = name if is_path(name) else f"{name}.py"
    try:
        methods = kind(seam, name).methods
    except SyntaxError as error:
        raise InputError(f"{key}: {file}, line {error.lineno or 1}: {error.msg}.") from None
    except (ValueError, OSError) as error:
        raise InputError(f"{key}: {file} is not a file of Python in UTF-8 ({error}).") from None
    if not seam.methods <= methods:
        wanted = f"method{'s' * (len(seam.methods) > 1)} {' and '.join(sorted(seam.methods, reverse=True))}"
        raise InputError(f"{key}: {file} has no class {seam.class_name} with {wanted}.")


@functools.cache
def kind(seam: Seam, name: str) -> Kind:
    """The Kind of this name or path. Raises SyntaxError for a file that is not Python."""
    return _said(file_of(seam, name), seam.class_name)


def of_model(models: Mapping[str, Any], name: str) -> Kind:
    """The Kind of a model of the config's `learning.models`: the one of its own name, unless it says another."""
    return kind(MODELS, models[name].get("kind", name))


def _said(file: str, name: str) -> Kind:
    """What a class in a file says of itself, with its bases from files of the package."""
    tree = ast.parse((PACKAGE.parent / file).read_bytes(), file)
    definition = next((node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name), None)
    if definition is None:
        return Kind(file, set(), {})
    methods = {node.name for node in definition.body if isinstance(node, ast.FunctionDef)}
    stated: dict[str, Any] = {}
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom) and not node.level]
    origins = {alias.asname or alias.name: (node.module or "", alias.name) for node in imports for alias in node.names}
    for base in reversed([base.id for base in definition.bases if isinstance(base, ast.Name)]):
        module, base = origins.get(base, ("", ""))
        source = f"{module.replace('.', '/')}.py"
        if source not in BASES and (PACKAGE.parent / source).is_file():
            inherited = _said(source, base)
            methods, stated = methods | inherited.methods, stated | inherited.stated
    for node in definition.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value:
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            with contextlib.suppress(ValueError):  # none that is a literal
                stated[ast.unparse(target)] = ast.literal_eval(node.value)
    return Kind(file, methods, stated)


def of_focus(imaging: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    """The focus method of a config's section `imaging`, a name or a path, and its settings."""
    focus = imaging.get("focus", "none")
    settings = dict(focus) if isinstance(focus, dict) else {"method": focus}
    return settings.pop("method"), settings


def page_names(models: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The page's names for a config's models and their confidence scores: `models`, `scores` and `main`, mappings.

    models: the config's. A kind states it as LABELS, of each model's name its label, its name within a sentence and its
    place on the page, and SCORES, of each confidence score's name its label and place. The first of SCORES is the
    model's main one: `main` has it by the model's name in the config. Names not stated are left out.
    """
    labels: dict[str, Any] = {}
    scores: dict[str, Any] = {}
    main: dict[str, str] = {}
    for name in models:
        stated = of_model(models, name).stated
        labels |= stated.get("LABELS", {})
        scores |= stated.get("SCORES", {})
        if "SCORES" in stated:
            main[name] = next(iter(stated["SCORES"]))
    # Sorted, as Snakemake compares params by their text.
    page = {"models": labels, "scores": scores, "main": main}
    return {kind: dict(sorted(names.items())) for kind, names in page.items()}
