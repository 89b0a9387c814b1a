"""Targets with fine features, and how far their fields on default meshes are from those on meshes twice as fine.

Each is one to three wavelengths long at `WAVELENGTH`: (vertices (V, 3) in metres, triangles (T, 3)), mirror planes.
"""

from pathlib import Path

import numpy as np
from habits_made import lens
from habits_made import revolved as closed_revolved
from pointed_made import karman
from scipy.spatial import Delaunay
from shapes_made import cube, lofted, save, together, tube
from vehicles_made import fin, fuselage, plan_wing

from isarflow.core.sweep import C0
from isarflow.mesh.build import build_meshes
from isarflow.scattering.solve import solve

WAVELENGTH = 0.1  # m
REFERENCE = 20  # edges a wavelength
SHOWN = 30  # dB below the peak of all directions, down to which levels are compared
ELEVATION, AZIMUTH = np.arange(-75.0, 76.0, 15.0), np.arange(0.0, 360.0, 3.0)


def rod(radius, length, count=24):
    """A round rod along x."""
    angle = 2 * np.pi * np.arange(count) / count
    return lofted([np.stack([0 * angle + x, radius * np.cos(angle), radius * np.sin(angle)], 1)
                   for x in (-length / 2, length / 2)])  # fmt: skip


def _finned():
    """A body with four swept fins of sharp tips, their trailing edges 0.3 mm."""
    vertices, triangles = fin(0.07, 0.08, 0.02, 0.06, (-0.13, 0, 0), 0.06, 3e-4)
    turns = [np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    return together(fuselage(0.3, 0.03), *[(vertices @ turn.T, triangles) for turn in turns])


def sheet(points, places=None):
    """The convex hull of points (P, 2) in triangles, without thickness, its corners put at `places` (P, 2)."""
    triangles, places = Delaunay(points).simplices, points if places is None else places
    first, second = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    turned = np.linalg.det(np.stack([first, second], axis=1)) < 0
    triangles[turned] = triangles[turned, ::-1]
    return np.column_stack([places, np.zeros(len(places))]), triangles


def graded_square(side, count):
    """A square of `count` rows each way, narrow at its border as the current is singular there."""
    along = np.linspace(-1, 1, count + 1)
    points = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    return sheet(points, side / 2 * np.sin(np.pi / 2 * points))


def graded_disc(radius, count):
    """A disc of `count` rings, as `graded_square`."""
    ring, number = np.array([(k, n) for k in range(count + 1) for n in range(max(6 * k, 1))]).T
    turn = 2 * np.pi * number / np.maximum(6 * ring, 1)
    way = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return sheet((ring / count)[:, None] * way, radius * np.sin(np.pi / 2 * ring / count)[:, None] * way)


def revolved(profile, count):
    """An open surface: a `profile` of points (x, radius) turned about the x axis, in `count` sides."""
    turn = 2 * np.pi * np.arange(count) / count
    vertices = np.concatenate([np.stack([0 * turn + x, r * np.cos(turn), r * np.sin(turn)], 1) for x, r in profile])
    here = np.arange(len(vertices)).reshape(-1, count)
    there = np.roll(here, -1, axis=1)
    quads = np.stack([here[:-1], there[:-1], there[1:], here[1:]], axis=-1).reshape(-1, 4)
    return vertices, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


OPEN = {  # without thickness
    "lips": revolved([(-0.12, 0.035), (-0.12, 0.02), (0.12, 0.02), (0.12, 0.035)], 48),
    "pipe": revolved([(-0.1, 0.03), (0.1, 0.03)], 96),  # just wide enough for a wave to pass
}
WITHOUT_THICKNESS = {  # and a mesh of each that is graded towards its border by construction
    "sheet": (sheet(0.085 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1.0)])), graded_square(0.17, 20)),
    "disc": (graded_disc(0.085, 16), graded_disc(0.085, 12)),
}
SHAPES = {
    "sleeve": (together(rod(0.02, 0.12, 64), tube(0.0215, 0.001, 0.06, 64)), ["xz", "xy"]),  # a gap of 0.5 mm
    "wing": (plan_wing(0.24, 0.09, 0.06, 0.03, (-0.045, 0.0), 0.12, 0.0, 3e-4, count=32), ["xz"]),
    "fins": (_finned(), []),
    "duct": (tube(0.03, 0.001, 0.12, 96), ["xz", "xy"]),
    "plate": ((cube()[0] * [0.2, 0.15, WAVELENGTH / 100], cube()[1]), ["xz", "xy"]),
    "rod": (rod(WAVELENGTH / 100, 0.15), []),
    "lens": (closed_revolved(lens(40, 0.07, 0.0175), 96), ["xz", "xy"]),  # of a sharp rim
    "nose": (karman(60, 96), ["xz", "xy"]),  # a tip, and a flat base
    **{name: (shape, ["xz", "xy", "yz"]) for name, shape in OPEN.items()},
    **{name: (shape, []) for name, (shape, _) in WITHOUT_THICKNESS.items()},
}


def field(path, name, density, threads):
    """Backscatter (polarization, direction) of a shape on a mesh of `density` edges a wavelength, and its measures."""
    return field_of(path, *SHAPES[name], density, threads)


def field_of(path, shape, planes, density, threads):
    """`field` of a shape (vertices, triangles) with its mirror planes."""
    radar = {"center_frequency": C0 / WAVELENGTH, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV", "HH"]}
    source = save(Path(path) / "shape.ply", *shape)
    target = {"unit": "m", "symmetry": planes}
    (mesh,), measures = build_meshes(source, target, {"edges_per_wavelength": density, "bands": 1}, radar)
    given = [C0 / WAVELENGTH], ELEVATION, AZIMUTH, radar["polarizations"], planes
    solution = solve(*mesh, *given, precision="single", threads=threads)
    return solution.field[:, 0].reshape(2, -1), measures["bands"][0]


def apart(found, reference):
    """Mean and largest difference in dB where the reference is within SHOWN of its peak, of the worse polarization."""
    level, of_reference = (20 * np.log10(np.maximum(np.abs(of), np.finfo(float).tiny)) for of in (found, reference))
    pairs = zip(np.abs(level - of_reference), of_reference > of_reference.max() - SHOWN, strict=True)
    return np.max([(off[shown].mean(), off[shown].max()) for off, shown in pairs], axis=0)
