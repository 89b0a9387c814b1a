"""The same body exported with few, more and very many triangles gives the same field, that of a mesh twice as fine."""

import numpy as np
import pytest
from fine_made import SHOWN
from pointed_made import karman, rimmed
from shapes_made import save, together
from vehicles_made import fin, fuselage, plan_wing

from isarflow.mesh.build import build_meshes
from isarflow.scattering.solve import solve

MESHES = 3  # of each export
ELEVATION, AZIMUTH = np.arange(-75.0, 76.0, 15.0), np.arange(0.0, 360.0, 3.0)


def aircraft(fine):
    """A body of 0.25 m with a wing and a fin of 0.3 mm at their trailing edges."""
    return together(
        fuselage(0.25, 0.02, rings=20 * fine, around=24 * fine),
        plan_wing(0.2, 0.06, 0.03, 0.04, (-0.03, 0.001), 0.06, 0.0, 3e-4, 0.0, 16 * fine, 4 * fine),
        fin(0.05, 0.04, 0.02, 0.02, (-0.12, 0, 0), 0.06, 3e-4, 16 * fine, 3 * fine),
    )


EXPORTS = {  # name -> Hz and exports; 2.5 and 3 wavelengths long
    "karman": (3.0e9, lambda: (karman(66, 66), karman(132, 132), karman(290, 240))),  # the last: a fan of 240 needles
    "rimmed": (3.5e9, lambda: (rimmed(64, 80), rimmed(180, 228))),
}


def field(path, shape, frequency, planes, density):
    radar = {"center_frequency": frequency, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV", "HH"]}
    source = save(path / "body.ply", *shape)
    (mesh,), measures = build_meshes(source, {"symmetry": planes}, {"edges_per_wavelength": density, "bands": 1}, radar)
    given = [frequency], ELEVATION, AZIMUTH, radar["polarizations"], planes
    return solve(*mesh, *given, precision="single", threads=2).field[:, 0].reshape(2, -1), measures["bands"][0]


def level(*fields):
    """The mean of fields' levels in dB."""
    return np.mean([20 * np.log10(np.abs(of)) for of in fields], axis=0)


def levels(path, shape, *given):
    """The mean level of MESHES meshes of a shape whose vertices differ by rounding alone, and what the meshes say.

    These are other meshes each: by the rounding of one more or less the same processor's fields of one of them lie 0.05
    to 0.17 dB from the finer mesh's, and so do those of two processors.
    """
    random = np.random.default_rng(0)
    rounded = [(shape[0] * (1 + random.uniform(-1, 1, np.shape(shape[0])) * 2e-16), shape[1]) for _ in range(MESHES)]
    fields, measures = zip(*(field(path, one, *given) for one in rounded), strict=True)
    return level(*fields), measures


def apart(one, other):
    """Mean difference in dB of either polarization where the second level is within SHOWN of its peak; the larger."""
    return max(np.abs(a - b)[b > b.max() - SHOWN].mean() for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("name", EXPORTS)
def test_finer_exports_have_the_same_field(tmp_path, name):
    """Measured, of four meshes each: 0.06 to 0.09 dB from the finer mesh, and 0.03 to 0.09 dB from each other."""
    frequency, exports = EXPORTS[name]
    shapes, given = exports(), (frequency, ["xz", "xy"])
    reference = level(field(tmp_path, shapes[0], *given, 20)[0])
    made = [levels(tmp_path, shape, *given, 10) for shape in shapes]
    for found, measures in made:
        assert apart(found, reference) < 0.12
        assert apart(found, made[0][0]) < 0.1
        for one in measures:
            assert one["missed"] is None
            assert one["unknowns"] == pytest.approx(made[0][1][0]["unknowns"], rel=0.1)


def test_a_fine_export_with_thin_fins_has_the_field_of_a_finer_mesh(tmp_path):
    """Measured: 0.21 dB; coarse exports of the same are as far off."""
    given = 3.2e9, ["xz"]
    reference = level(field(tmp_path, aircraft(2), *given, 20)[0])
    found, measures = levels(tmp_path, aircraft(5), *given, 10)
    assert apart(found, reference) < 0.3 and {one["missed"] for one in measures} == {None}
