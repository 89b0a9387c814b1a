"""Find the code that a script's result comes from: its own, and all modules that it imports, directly or not."""

import ast
import functools
import hashlib
from pathlib import Path

from isarflow.core.errors import InputError
from isarflow.core.folders import SCRIPTS


@functools.cache
def closure(script):
    """Sorted paths below SCRIPTS of a Python file and of the modules there that it imports, at any depth.

    The files are read, not run. A module that is imported by a name made at run time is not seen: the caller names its
    file beside the script (as `learning.classifier.build` does for models). InputError if one is not Python.
    """
    files, new = set(), {Path(script)}
    while new:
        files |= new
        new = {module for file in new for module in _read(file)[0]} - files
    return sorted(path.as_posix() for path in files)


@functools.cache
def digest(*scripts):
    """A hash of the code in the closures of scripts, independent of their comments, docstrings and layout."""
    files = sorted({file for script in scripts for file in closure(script)})
    return hashlib.sha256(repr([(file, _read(Path(file))[1]) for file in files]).encode()).hexdigest()


@functools.cache
def _read(file):
    """The files of the modules that a file imports, and its code as text."""
    try:
        tree = ast.parse((SCRIPTS / file).read_bytes())
    except (SyntaxError, ValueError) as error:
        where = f"workflow/scripts/{Path(file).as_posix()}"
        raise InputError(f"{where}, line {getattr(error, 'lineno', 1)}: not Python ({error}).") from None
    return _imported(file, tree), _code(tree)


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
    """The files of the modules that a file of this syntax tree imports, and of the packages that they are in."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            # A leading dot is the file's own folder; what is imported from a package may be a module of it.
            above = Path(file).parts[: -node.level] if node.level else ()
            package = ".".join([*above, *([node.module] if node.module else [])])
            names |= {package, *(f"{package}.{alias.name}" for alias in node.names)}
    files = set()
    for name in names:
        # A package's own file only passes names on; no result comes from it.
        parts = name.strip(".").removeprefix("isarflow.").split(".")
        files |= {Path(*parts[:depth], "__init__.py") for depth in range(1, len(parts) + 1)}
        files.add(Path(*parts).with_suffix(".py"))
    return {path for path in files if (SCRIPTS / path).is_file()}
