"""Find the code that a script's result comes from: its own, and all modules that it imports, directly or not."""

import ast
import contextlib
import functools
import hashlib
import importlib.util
import itertools
import json
import os
import zlib
from pathlib import Path

from isarflow.core.errors import InputError
from isarflow.core.folders import PACKAGE

OWN_CODE = Path(__file__).read_bytes()  # what was kept by other code than this is not taken
HERE = PACKAGE.parent  # paths are below it, or whole
FACE = Path(PACKAGE.name, "__init__.py")


@functools.cache
def closure(script):
    """Sorted paths below HERE of a Python file and of the modules that it imports, at any depth.

    Modules of other packages do not count, but those beside a file that is not in the package do. The files are read,
    not run. A module that is imported by a name made at run time is not seen: the caller names its file beside the
    script (as `learning.classifier.build_classifier` does for models). InputError if one is not Python.
    """
    files, new = set(), {Path(script)}
    while new:
        files |= new
        new = {module for file in new for module in _read(file)[0]} - files
    return sorted(path.as_posix() for path in files)


@functools.cache
def digest(*scripts):
    """A hash of the code in the closures of scripts, independent of their comments, docstrings and layout."""
    files = {file for script in scripts for file in closure(script)}
    code = sorted((_named(HERE / file), _read(Path(file))[1]) for file in files)
    return hashlib.sha256(repr(code).encode()).hexdigest()


def _named(path):
    """The name that a file counts by: from HERE, or its last part elsewhere, so that a moved folder reruns nothing."""
    return path.relative_to(HERE).as_posix() if path.is_relative_to(HERE) else path.name


@functools.cache
def _read(file):
    """The files of the modules that a file imports, and its code as text.

    To read all files takes a second or two, at each start of Snakemake. So what was read is kept beside Python's own
    compiled code, and taken where the file's content is the same.
    """
    content = (HERE / file).read_bytes()
    path = Path(importlib.util.cache_from_source(HERE / file)).with_suffix(".code")
    kept, checksum = _kept(path), hashlib.sha256(OWN_CODE + content).hexdigest()
    if kept.get("checksum") != checksum:
        try:
            tree = ast.parse(content)
        except (SyntaxError, ValueError) as error:
            where = Path(file).as_posix()
            raise InputError(f"{where}, line {getattr(error, 'lineno', 1)}: not Python ({error}).") from None
        names = sorted(module.as_posix() for module in _imported(file, tree))
        kept = {"checksum": checksum, "imported": names, "code": _code(tree)}
        with contextlib.suppress(OSError):  # where nobody may write, each start reads all
            path.parent.mkdir(exist_ok=True)
            new = path.with_suffix(f".code.{os.getpid()}")
            new.write_bytes(zlib.compress(json.dumps(kept).encode()))
            new.replace(path)
    return {module for module in map(Path, kept["imported"]) if (HERE / module).is_file()}, kept["code"]


def _kept(path):
    """What was kept in a file; nothing if there is none, or one that was cut short."""
    try:
        return json.loads(zlib.decompress(path.read_bytes()))
    except (OSError, ValueError, zlib.error):
        return {}


def _code(tree):
    """A syntax tree without docstrings, as text."""
    for node in ast.walk(tree):
        may_have_one = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        if may_have_one and ast.get_docstring(node, clean=False) is not None:
            del node.body[0]
    return repr(_plain(tree))


def _plain(node):
    """A syntax tree as nested lists, without empty fields, which not every version of Python has."""
    if isinstance(node, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(node) if name != "ctx" and value not in (None, []))
        return [type(node).__name__, *([name, _plain(value)] for name, value in fields)]
    return list(map(_plain, node)) if isinstance(node, list) else repr(node)


def _imported(file, tree):
    """Where the modules that a file of this syntax tree imports may be, and the packages that they are in."""
    # Files of the package name its modules in full; others have neighbours, too.
    files, roots = set(), {Path()} if Path(file).parts[0] == PACKAGE.name else {Path(), Path(file).parent}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            places, names = roots, [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            # A leading dot is the file's own folder; what is imported from a package may be a module of it.
            places = {(Path(file), *Path(file).parents)[node.level]} if node.level else roots
            module = [node.module] if node.module else []
            names = [".".join(module), *(".".join([*module, alias.name]) for alias in node.names)]
        else:
            continue
        for place, parts in itertools.product(places, (name.split(".") for name in names if name)):
            # A package's own file counts, as it runs before its modules; the face of all only passes names on.
            files |= {Path(place, *parts[:depth], "__init__.py") for depth in range(1, len(parts) + 1)} - {FACE}
            files.add(Path(place, *parts).with_suffix(".py"))
    return files
