"""From CAD meshes to radar target recognition: `isarflow.mesh`, `.scattering`, `.imaging`, `.learning`, `.report`.

The folder `isarflow` of the repository is a link to workflow/scripts. `isarflow.load` reads exported images;
`isarflow.benchmark` scores predictions of one's own.
"""

import importlib


def __getattr__(name):
    # Not at the top: every job imports this package, and few of them need h5py or these.
    if name == "benchmark":
        return importlib.import_module("isarflow.learning.benchmark")
    if name in ("Images", "load"):
        from isarflow.learning import exported

        return getattr(exported, name)
    raise AttributeError(f"module 'isarflow' has no attribute '{name}'")
