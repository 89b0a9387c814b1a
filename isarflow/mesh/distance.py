"""Surfaces in MeshLab's library, and its distances, which are negative inside."""

import numpy as np
import pymeshlab


def loaded(vertices, triangles):
    """A MeshSet of MeshLab's library that holds one surface."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int32)))
    return meshes


def distances(points, vertices, triangles, signed=False):
    """Distance in metres of each of the points (P, 3) from a mesh, (P,); negative inside a closed one if `signed`."""
    meshes = loaded(vertices, triangles)
    meshes.add_mesh(pymeshlab.Mesh(points))
    far = np.linalg.norm(np.ptp(np.concatenate([points, vertices]), axis=0))
    meshes.compute_scalar_by_distance_from_another_mesh_per_vertex(
        measuremesh=1, refmesh=0, signeddist=signed, maxdist=pymeshlab.PureValue(float(far))
    )
    return meshes.current_mesh().vertex_scalar_array()
