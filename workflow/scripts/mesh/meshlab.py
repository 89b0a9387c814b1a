"""Pass surfaces to MeshLab's library."""

import numpy as np
import pymeshlab


def loaded(vertices, triangles):
    """A MeshSet that holds one surface."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int32)))
    return meshes
