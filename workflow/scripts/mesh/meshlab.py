"""How surfaces are given to MeshLab's library, and its isotropic remesher as both ways of remeshing use it."""

import numpy as np
import pymeshlab

from mesh import topology

ITERATIONS = 10


def loaded(vertices, triangles):
    """A MeshSet that holds one surface."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int32)))
    return meshes


def remesh_isotropic(meshes, edge, deviation, selected=False):
    """Vertices and triangles of about `edge` metres on the current mesh of a MeshSet; its features stay.

    The surface moves by at most `deviation` metres. With `selected` only the triangles that are selected are remeshed,
    and returned.
    """
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=ITERATIONS,
        targetlen=pymeshlab.PureValue(edge),
        featuredeg=topology.FEATURE_ANGLE,
        checksurfdist=True,
        maxsurfdist=pymeshlab.PureValue(deviation),
        selectedonly=selected,  # said each time: the library would take what it was last told
    )
    mesh = meshes.current_mesh()
    triangles = mesh.face_matrix()
    return topology.compact(mesh.vertex_matrix(), triangles[mesh.face_selection_array()] if selected else triangles)
