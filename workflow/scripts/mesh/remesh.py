"""Isotropic remeshing to one edge length, features and boundaries kept."""

import numpy as np
import pymeshlab

from mesh import topology

FEATURE_ANGLE = 40.0  # degrees between face normals; sharper edges are features and stay
AIM = 0.95  # target edge over wanted mean edge: the remesher's mean comes out some per cent above its target
LONGEST = 1.5  # edges longer than this many wanted edges are split afterwards
ITERATIONS = 10


def remesh(vertices, triangles, edge, deviation):
    """Triangles of about `edge` metres on the same surface, moved from it by at most `deviation` metres a step."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, np.asarray(triangles, np.int32)))
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=ITERATIONS,
        targetlen=pymeshlab.PureValue(AIM * edge),
        featuredeg=FEATURE_ANGLE,
        checksurfdist=True,
        maxsurfdist=pymeshlab.PureValue(deviation),
    )
    mesh = meshes.current_mesh()
    return split_long_edges(*topology.compact(mesh.vertex_matrix(), mesh.face_matrix()), LONGEST * edge)


def split_long_edges(vertices, triangles, longest):
    """Cut every edge above `longest` metres at its middle, the longest of each neighbourhood first."""
    while True:
        unique, index = topology.edges(triangles)
        length = np.linalg.norm(vertices[unique[:, 0]] - vertices[unique[:, 1]], axis=1)
        # An edge is cut if no side of its triangles is longer: then each triangle has one cut at most.
        rank = np.empty(len(unique), dtype=int)
        rank[np.argsort(length, kind="stable")] = np.arange(len(unique))
        best = index[np.arange(len(index)), rank[index].argmax(axis=1)]
        wins = np.bincount(best, minlength=len(unique)) == np.bincount(index.ravel())
        cut = wins & (length > longest)
        if not cut.any():
            return vertices, triangles
        number = np.full(len(unique), -1)
        number[cut] = len(vertices) + np.arange(cut.sum())
        vertices = np.concatenate([vertices, vertices[unique[cut]].mean(axis=1)])
        hit = cut[best]
        side = (index[hit] == best[hit, None]).argmax(axis=1)
        turned = triangles[hit][np.arange(hit.sum())[:, None], (side[:, None] + np.arange(3)) % 3]
        middle = number[best[hit]]
        first = np.stack([turned[:, 0], middle, turned[:, 2]], axis=1)
        second = np.stack([middle, turned[:, 1], turned[:, 2]], axis=1)
        triangles = np.concatenate([triangles[~hit], first, second]).astype(np.int32)
