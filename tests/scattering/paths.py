"""The same tests with whole matrices and with compressed ones."""

import pytest

from isarflow.scattering.solve import solve


def both(module, patch):
    """A fixture that runs a module's tests once more with compressed matrices, of patches of so many triangles."""

    def compressed(*arguments, **settings):
        whole = settings.get("formulation") == "cfie" or settings.get("precision") == "double"
        return solve(*arguments, **settings, tolerance=None if whole else 1e-6)

    @pytest.fixture(scope="module", autouse=True, params=[False, True], ids=["whole", "compressed"])
    def path(request):
        with pytest.MonkeyPatch.context() as change:
            if request.param:
                change.setattr(f"{module}.solve", compressed)
                change.setattr("isarflow.scattering.mom.basis.PATCH_TRIANGLES", patch)
            yield request.param

    return path
