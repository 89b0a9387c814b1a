"""From a CAD file to an image: what scatters shows where the mesh has it."""

import numpy as np

from isarflow.imaging.formation import apertures
from isarflow.imaging.geometry import imager_of, project
from isarflow.mesh.build import build_meshes
from isarflow.scattering.solve import solve

RADAR = {"center_frequency": 1.5e9, "bandwidth": 1.0e9, "frequencies": 9, "polarizations": ["VV"]}
AXIS = np.degrees(np.arctan(0.5**0.5))  # elevation at which a corner looks back along its axis of symmetry


def test_the_corner_of_the_trihedral_is_where_it_was_put():
    """Three bounces take as long as one at the corner itself: the image's peak lies there."""
    turn = 30.0  # degrees, of the target and of the aperture
    (mesh,), _ = build_meshes("resources/cad/trihedral.stl", {}, {"edges_per_wavelength": 7, "bands": 1}, RADAR)
    angle = np.radians(turn)
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    corner = np.array([0.16, -0.22, 0.05])  # m; in the CAD file it is the origin
    vertices, triangles = mesh
    frequency = np.linspace(1e9, 2e9, 9)
    azimuth = turn + np.linspace(-15, 15, 9)
    solution = solve(vertices @ rotation.T + corner, triangles, frequency, [AXIS], azimuth, ["VV"], [], threads=2)
    imaging = {"imager": "fourier", "aperture": 9, "window": "hamming", "reformat": "exact", "upsample": 128}
    imager = imager_of(frequency, azimuth, imaging)
    down, cross = imager.axes()
    image = imager.matrix(down, cross) @ apertures(solution.field[0, :, 0], azimuth, 9)[0]
    row, column = np.unravel_index(np.abs(image).argmax(), (128, 128))
    found, truth = np.array([down[row], cross[column]]), np.array(project(corner, AXIS, turn))
    assert np.abs(truth).min() > 0.05  # neither sign can be wrong unseen
    assert (np.abs(found - truth) < 0.25 * np.array([np.ptp(down), np.ptp(cross)]) / 9).all()
