"""Load a model, an imager or a solver by the name that a config gives it."""

import importlib
from typing import Any

from isarflow.core.errors import InputError


def file_of(folder: str, kind: str) -> str:
    """The file of a kind as a message names it. folder: below workflow/scripts, as 'learning/models'."""
    return f"workflow/scripts/{folder}/{kind}.py"


def load_class(folder: str, kind: str, name: str, base: type | None = None) -> Any:
    """The class of this name in the file of a kind.

    Raises InputError where the file imports what is not installed, and where its class is none of `base`.
    """
    file = file_of(folder, kind)
    try:
        loaded = getattr(importlib.import_module(f"isarflow.{folder.replace('/', '.')}.{kind}"), name)
    except ImportError as error:
        hint = " `pip install -r envs/requirements-torch.txt` installs it." if error.name == "torch" else ""
        raise InputError(f"{file} cannot be imported: {error}.{hint}") from None
    if base is not None and not issubclass(loaded, base):
        raise InputError(f"{file}: its class {name} must be one of {base.__module__}.{base.__qualname__}.")
    return loaded
