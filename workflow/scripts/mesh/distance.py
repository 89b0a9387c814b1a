"""Distances between surfaces, on samples that are the same in every run."""

import numpy as np
import pymeshlab

from mesh import topology
from mesh.meshlab import loaded

THROUGH = np.geomspace(1 / 200, 1, 24)  # of the largest thickness looked for: where the solid is probed


def samples(vertices, triangles, spacing):
    """Points on a mesh, (P, 3), at most `spacing` metres apart: corners and centres of triangles halved until small."""
    corners = vertices[triangles]
    points = [vertices[topology.used(triangles)]]
    while len(corners):
        side = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        small = side.max(axis=1) <= spacing
        points.append(corners[small].mean(axis=1))
        # The others are cut across their longest side, which runs from corner k to k + 1.
        corners, k = corners[~small], side[~small].argmax(axis=1)
        a, b, c = np.take_along_axis(corners, ((k[:, None] + np.arange(3)) % 3)[:, :, None], axis=1).transpose(1, 0, 2)
        middle = (a + b) / 2
        points.append(middle)
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(points)


def distances(points, vertices, triangles, signed=False):
    """Distance in metres of each of the points (P, 3) from a mesh, (P,); negative inside a closed one if `signed`."""
    meshes = loaded(vertices, triangles)
    meshes.add_mesh(pymeshlab.Mesh(points))
    far = np.linalg.norm(np.ptp(np.concatenate([points, vertices]), axis=0))
    meshes.compute_scalar_by_distance_from_another_mesh_per_vertex(
        measuremesh=1, refmesh=0, signeddist=signed, maxdist=pymeshlab.PureValue(float(far))
    )
    return meshes.current_mesh().vertex_scalar_array()


def hausdorff(mesh, source, spacing):
    """Largest distance from mesh to source and from source to mesh, each (vertices, triangles), and where.

    Returns ((metres, point), (metres, point)), the point on the surface that the distance is measured from.
    """
    middles = mesh[0][topology.edges(mesh[1]).ends].mean(axis=1)
    points = np.concatenate([mesh[0], middles, mesh[0][mesh[1]].mean(axis=1)])
    return _farthest(points, source), _farthest(samples(*source, spacing), mesh)


def _farthest(points, surface):
    apart = distances(points, *surface)
    return float(apart.max()), points[apart.argmax()]


def thickness(vertices, triangles, solid, most):
    """Metres through the `solid` (vertices, triangles) from each triangle's centre inwards, (T,), at most `most`.

    Rounded up to one of the depths `most` * THROUGH. A sheet is as thick as `most`.
    """
    centres, normal = vertices[triangles].mean(axis=1), topology.shape(vertices[triangles])[0]
    thick = np.full(len(triangles), most)
    for depth in most * THROUGH[::-1]:
        outside = distances(centres - depth * normal, *solid, signed=True) > 0
        thick[outside] = depth
    return thick
