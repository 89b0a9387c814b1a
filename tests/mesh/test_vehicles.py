"""Vehicles as CAD programs export them, of overlapping solids with trailing edges far thinner than an edge."""

from shapes_made import save
from vehicles_made import uav

from mesh.arrange import first_crossing
from mesh.build import build

MESH = {"edges_per_wavelength": 10, "bands": 1}


def test_a_uav_with_trailing_edges_of_a_quarter_millimetre_keeps_to_its_source(tmp_path):
    radar = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
    (mesh,), measures = build(save(tmp_path / "uav.ply", *uav()), {"unit": "m"}, MESH, radar)
    (band,) = measures["bands"]
    assert measures["repairs"]["united_solids"] == 5 and band["components"] == 1 and band["watertight"]
    assert band["missed"] is None and first_crossing(*mesh) is None
    assert band["unknowns"] <= 1.4 * band["ideal_unknowns"]
