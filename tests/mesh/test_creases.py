"""Creases of a body neither flip nor move."""

import numpy as np
import pytest
from shapes_made import lofted, save

from isarflow.core.sweep import C0
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.ground import Ground, samples
from isarflow.mesh.remesh.edits import flip

RADAR = {"center_frequency": 10 * C0, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}  # wavelength 0.1 m


def meshed(path, shape):
    source, mesh = save(path / "shape.ply", *shape), {"edges_per_wavelength": 10, "bands": 1}
    (made,), measures = build_meshes(source, {"unit": "m"}, mesh, RADAR)
    return made, measures["bands"][0]


def prism(corners, inner, rings=((1, 0.0), (1, 0.2))):
    """A solid of an outline of `corners`, every second one `inner` times as far out, through (scale, z) of rings."""
    angle = 2 * np.pi * np.arange(corners) / corners
    far = 0.05 * np.where(np.arange(corners) % 2, inner, 1.0)
    outline = np.stack([far * np.cos(angle), far * np.sin(angle), 0 * angle], axis=1)
    return lofted([outline * [scale, scale, 1] + [0, 0, z] for scale, z in rings])


BODIES = {
    "prism of 7": prism(7, 1),
    "prism of 8": prism(8, 1),
    "star": prism(10, 0.5),
    "stepped": prism(8, 1, ((1, 0.0), (1, 0.1), (0.6, 0.1), (0.6, 0.2))),
}


@pytest.mark.parametrize("name", BODIES)
def test_creases_neither_flip_nor_move(tmp_path, name):
    """1.5 to 2.4 mm where edges at creases are flipped; a micrometre is the bound of rounding and welding."""
    made, _ = meshed(tmp_path, BODIES[name])
    for one, other in ((made, BODIES[name]), (BODIES[name], made)):
        assert Ground(*other).distance(samples(*one, 1e-3)[0])[0].max() < 1e-6


@pytest.mark.parametrize("degrees", [30, 45, 60])
def test_a_crease_is_no_diagonal_to_flip(degrees):
    """Two flat triangles over a long edge, then folded along it."""
    turn = np.radians(degrees)
    vertices = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, -0.5 * np.cos(turn), 0.5 * np.sin(turn)]])
    made = flip(vertices, np.array([[0, 1, 2], [1, 0, 3]], dtype=np.int32), np.ones(4), 1.0)
    assert ([0, 1] in topology.edges(made).ends[topology.edges(made).count == 2].tolist()) == (degrees > 40)
