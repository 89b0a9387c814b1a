"""From a CAD file to the field: fine features cost little at the default density (all shapes: `make bench-shapes`)."""

import pytest
from fine_made import REFERENCE, apart, field


@pytest.mark.parametrize("name", ["wing", "plate", "rod"])
def test_a_default_mesh_has_the_field_of_one_twice_as_fine(tmp_path, name):
    found, band = field(tmp_path, name, 10, threads=1)
    mean, _ = apart(found, field(tmp_path, name, REFERENCE, threads=1)[0])
    assert mean <= 0.3  # dB
    assert max(band["hausdorff"].values()) <= band["wavelength"] / 40
