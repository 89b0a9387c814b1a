"""Open rims of wide sheets have a narrow row of triangles of one width."""

import igl
import numpy as np
import pytest
from fine_made import OPEN, sheet
from shapes_made import save

from isarflow.core.sweep import C0
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.remesh.rows import room

RADAR = {"center_frequency": 10 * C0, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}  # wavelength 0.1 m
TURN = 2 * np.pi * np.arange(72) / 72
SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
SHEETS = {
    "rectangle": np.array([(-0.15, -0.05), (0.15, -0.05), (0.15, 0.05), (-0.15, 0.05)]),
    "disc": 0.085 * np.stack([np.cos(TURN), np.sin(TURN)], axis=1),
    "delta": np.array([(0.12, 0), (-0.08, 0.07), (-0.08, -0.07)]),
}


def meshed(path, shape):
    source, mesh = save(path / "shape.ply", *shape), {"edges_per_wavelength": 10, "bands": 1}
    (made,), measures = build_meshes(source, {"unit": "m"}, mesh, RADAR)
    return made, measures["bands"][0]


@pytest.mark.parametrize("name", SHEETS)
def test_the_row_along_open_rims_is_a_quarter_of_an_edge_wide(tmp_path, name):
    """Measured: 0.25 +- 0.00 (rectangle, disc) and 0.01 (delta, whose tip has less); 0.5 +- 0.1 where it is relaxed."""
    (vertices, triangles), band = meshed(tmp_path, sheet(SHEETS[name]))
    rims = np.ascontiguousarray(topology.rims(triangles)[0])
    inner = np.setdiff1d(triangles[np.isin(triangles, rims).any(axis=1)], rims)
    apart = np.sqrt(igl.point_mesh_squared_distance(vertices[inner], vertices, rims)[0]) / band["wanted_edge"]
    row = apart[apart < 0.5]
    assert len(row) > 0.8 * len(rims) and not ((apart > 0.3) & (apart < 0.5)).any()
    assert row.mean() == pytest.approx(0.25, abs=0.02) and row.std() < 0.02
    assert band["edge"]["mean"] <= band["wanted_edge"] and band["edge"]["p99"] <= 1.35 * band["wanted_edge"]


STRIP = 0.01 * np.array([(0, 0), (30, 0), (30, 3), (0, 3)])
FACES = {
    "square of 9 edges": (sheet(0.09 * SQUARE), True),
    "square of 7 edges": (sheet(0.07 * SQUARE), False),
    "strip of 3 edges": (sheet(STRIP), False),
    "pipe": (OPEN["pipe"], True),
    "lips of 1.5 edges": (OPEN["lips"], False),
}


@pytest.mark.parametrize("name", FACES)
def test_narrow_faces_make_no_room_for_a_row(name):
    """On them it would cost a third more unknowns, or on lips all other edges would be longer."""
    (vertices, triangles), wide = FACES[name]
    assert (room(vertices, triangles, np.full(len(vertices), 0.01), ()) > 1) == wide
