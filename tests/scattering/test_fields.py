"""From a CAD file to the field: fine features cost little at the default density (all shapes: `make bench-shapes`)."""

import pytest
from fine_made import REFERENCE, apart, field


@pytest.mark.parametrize("name", ["wing", "fins", "plate", "rod", "sleeve", "duct"])
def test_meshes_have_the_field_of_finer_ones(tmp_path, name):
    reference, _ = field(tmp_path, name, REFERENCE, threads=1)
    for density, decibel in ((10, 0.3), (14, 0.1)):
        found, band = field(tmp_path, name, density, threads=1)
        mean, _ = apart(found, reference)
        assert mean <= decibel
        assert max(band["hausdorff"].values()) <= band["wavelength"] / 40
