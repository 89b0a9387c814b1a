"""CAD files of makers' habits become one sound body each; all of them: `make bench-habits`."""

import pytest
from habits_made import HABITS
from shapes_made import save

from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.repair.arrange import first_crossing

MESH = {"edges_per_wavelength": 10, "bands": 1}
QUICK = {  # what must have been repaired
    "cone of 360 sectors": {},
    "disc of two fans from its rim": {},
    "twisted blade of 20 x 120": {},
    "thin box of six patches": {"split_t_junctions": 52},
    "fin without thickness": {},
    "bolt that fits its hole": {},
    "slices of a cylinder": {},
    "panels of 0.5 mm on a box": {"united_solids": 12},
    "bulkheads in a tube": {"united_solids": 3},
}


@pytest.mark.parametrize("name", QUICK)
def test_files_of_makers_habits_become_one_sound_body(tmp_path, name):
    habit = HABITS[name]
    shape = habit.make()
    radar = {"center_frequency": habit.frequency * 1e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
    target = {"unit": "m", "symmetry": list(habit.symmetry)}
    (mesh,), measures = build_meshes(save(tmp_path / "part.ply", *shape), target, MESH, radar)
    (band,) = measures["bands"]
    assert band["components"] == 1 and band["missed"] is None and first_crossing(*mesh) is None
    assert band["watertight"] == (name != "fin without thickness")
    assert band["unknowns"] <= 1.25 * band["ideal_unknowns"]  # 1.15 when this was set
    if habit.volume:
        assert topology.tetrahedra(*mesh).sum() == pytest.approx(habit.volume, rel=0.002)  # 0.0011, of the panels
    assert {key: measures["repairs"][key] for key in QUICK[name]} == QUICK[name]
