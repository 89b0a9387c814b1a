"""Distances between surfaces, on samples that are the same in every run."""

import numpy as np
import pymeshlab

from mesh import topology


def samples(vertices, triangles, spacing):
    """Points on a mesh at most about `spacing` metres apart: vertices midpoint subdivisions."""
    corners = vertices[triangles]
    points = [corners.reshape(-1, 3), corners.mean(axis=1)]
    while len(corners):
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        corners = corners[sides.max(axis=1) > spacing]
        middle = (corners + np.roll(corners, -1, axis=1)) / 2
        points.append(middle.reshape(-1, 3))
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = middle.transpose(1, 0, 2)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    return np.unique(np.concatenate(points), axis=0)


def one_way(points, vertices, triangles):
    """Largest distance in metres from points (P, 3) to a mesh."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points))
    meshes.add_mesh(pymeshlab.Mesh(vertices, np.asarray(triangles, np.int32)))
    far = np.linalg.norm(np.ptp(np.concatenate([points, vertices]), axis=0))
    result = meshes.get_hausdorff_distance(
        sampledmesh=0, targetmesh=1, samplenum=len(points), maxdist=pymeshlab.PureValue(float(far))
    )
    return float(result["max"])


def hausdorff(mesh, source, spacing):
    """Largest distance in metres from mesh to source and from source to mesh, each (vertices, triangles)."""
    middles = mesh[0][topology.edges(mesh[1])[0]].mean(axis=1)
    points = np.concatenate([mesh[0], middles, mesh[0][mesh[1]].mean(axis=1)])
    return one_way(points, *source), one_way(samples(*source, spacing), *mesh)
