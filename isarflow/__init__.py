"""From CAD meshes to radar target recognition: `isarflow.mesh`, `.scattering`, `.imaging`, `.learning`, `.report`.

The names in `__all__` are the face of the package. Each is imported when it is first asked for: every job imports this
package, and few of them need all of it.
"""

import importlib
from typing import Any

__version__ = "0.3.0"  # and in pyproject.toml and CITATION.cff

_MODULES = {
    "Images": "learning.data.exported",
    "InputError": "core.errors",
    "Sweep": "core.sweep",
    "apertures": "imaging.formation",
    "form_images": "imaging.formation",
    "load": "learning.data.exported",
    "mesh_file": "mesh.build",
    "score": "learning.evaluation.leaderboard",
    "solve": "scattering.solve",
}
__all__ = ["__version__", "benchmark", *_MODULES]


def __getattr__(name: str) -> Any:
    if name == "benchmark":  # a module: what the scores of one's own predictions need
        return importlib.import_module("isarflow.learning.evaluation.leaderboard")
    if name in _MODULES:
        return getattr(importlib.import_module(f"isarflow.{_MODULES[name]}"), name)
    raise AttributeError(f"module 'isarflow' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
