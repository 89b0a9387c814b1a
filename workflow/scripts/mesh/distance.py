"""Distances between surfaces, by MeshLab's library on samples that are the same in every run."""

import numpy as np
import pymeshlab

from isarflow.mesh import topology
from isarflow.mesh.symmetry import mirrored


def loaded(vertices, triangles):
    """A MeshSet of MeshLab's library that holds one surface."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int32)))
    return meshes


def samples(vertices, triangles, spacing):
    """Corners and centres, (P, 3), of triangles halved until `spacing` metres; also areas (0 of corners) and owners."""
    corners, owner = vertices[triangles], np.arange(len(triangles))
    used, first = np.unique(triangles, return_index=True)
    points, area, owners = [vertices[used]], [np.zeros(len(used))], [first // 3]
    while len(corners):
        side = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        small = side.max(axis=1) <= spacing
        points.append(corners[small].mean(axis=1))
        area.append(np.linalg.norm(topology.normals(corners[small]), axis=1) / 2)
        owners.append(owner[small])
        # The others are cut across their longest side, which runs from corner k to k + 1.
        corners, owner, k = corners[~small], owner[~small], side[~small].argmax(axis=1)
        a, b, c = np.take_along_axis(corners, ((k[:, None] + np.arange(3)) % 3)[:, :, None], axis=1).transpose(1, 0, 2)
        middle = (a + b) / 2
        points.append(middle)
        area.append(np.zeros(len(middle)))
        owners.append(owner)
        owner = np.concatenate([owner, owner])
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(points), np.concatenate(area), np.concatenate(owners)


def distances(points, vertices, triangles, signed=False):
    """Distance in metres of each of the points (P, 3) from a mesh, (P,); negative inside a closed one if `signed`."""
    meshes = loaded(vertices, triangles)
    meshes.add_mesh(pymeshlab.Mesh(points))
    far = np.linalg.norm(np.ptp(np.concatenate([points, vertices]), axis=0))
    meshes.compute_scalar_by_distance_from_another_mesh_per_vertex(
        measuremesh=1, refmesh=0, signeddist=signed, maxdist=pymeshlab.PureValue(float(far))
    )
    return meshes.current_mesh().vertex_scalar_array()


def from_mirror_image(vertices, triangles, spacing, axis):
    """Largest distance in m between a target and its mirror image, sampled every `spacing` metres, with its place."""
    points = samples(vertices, triangles, spacing)[0]
    apart = distances(mirrored(points, axis), vertices, triangles)
    return float(apart.max()), points[apart.argmax()]
