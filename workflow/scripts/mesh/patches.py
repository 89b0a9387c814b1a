"""Remeshing in patches between frozen feature lines, for parts thinner than an edge.

The usual remesher takes a crease sharper than 168 degrees for a fold, and smooths away a rim that is narrower than its
steps: the two faces of a plate then run into each other. Here the surface is cut open along its features, each patch
is remeshed with its rim held fast, and the patches are put together again, so that no part can be lost.
"""

import numpy as np
import pymeshlab
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mesh import topology
from mesh.distance import distances
from mesh.tidy import cut_edges

TIP = 0.7  # of a full turn: a vertex whose faces make less in all is a tip and stays
ITERATIONS = 10


def remesh_patches(vertices, triangles, edge, deviation):
    """Triangles of about `edge` metres between the features of the given ones; the vertices on those stay.

    Moves the surface by at most `deviation` metres.
    """
    patch, corner = _cut_open(vertices, triangles)
    parts = []
    for number in range(patch.max() + 1):
        mine = patch == number
        _, first, faces = np.unique(corner[mine], return_index=True, return_inverse=True)
        parts.append((vertices[triangles[mine].ravel()[first]], faces.reshape(-1, 3)))
    return _put_together([_remesh_patch(*part, edge, deviation) for part in parts], parts)


def _cut_open(vertices, triangles):
    """The patch of each triangle, (T,), and a number for each of its corners, (T, 3): no two across a feature agree."""
    index = topology.edges(triangles)[1].ravel()
    feature = _features(vertices, triangles)
    size = len(triangles)
    order = np.argsort(index, kind="stable")
    order = order[~feature[index[order]]].reshape(-1, 2)
    one, other = order.T // 3
    patch = connected_components(coo_array((np.ones(len(one)), (one, other)), shape=(size, size)), False)[1]
    pairs = []
    for k in (0, 1):  # both ends of the edge between two triangles of a patch
        here = 3 * one + (order[:, 0] + k) % 3
        there = 3 * other + (triangles[other] == triangles.ravel()[here][:, None]).argmax(axis=1)
        pairs.append((here, there))
    ends = np.concatenate(pairs, axis=1)
    corner = connected_components(coo_array((np.ones(len(ends[0])), ends), shape=(3 * size,) * 2), False)[1]
    return patch, corner.reshape(-1, 3)


def _features(vertices, triangles):
    """True for each edge to keep, (E,): creases, boundaries, junctions, and the edges at a tip."""
    unique = topology.edges(triangles)[0]
    feature = topology.features(vertices, triangles)
    turn = np.bincount(triangles.ravel(), weights=topology.angles(vertices[triangles]).ravel())
    tip = turn < TIP * 360
    tip[unique[feature]] = False
    return feature | tip[unique].any(axis=1)


def _remesh_patch(vertices, triangles, edge, deviation):
    """One patch, its rim as it was but for rounding, which is undone: triangles that are not selected hold it fast."""
    owner, side = np.nonzero(topology.triangles_at_edges(triangles)[topology.edges(triangles)[1]] == 1)
    start, stop = triangles[owner, side], triangles[owner, (side + 1) % 3]
    length = np.linalg.norm(vertices[stop] - vertices[start], axis=1, keepdims=True)
    upright = length * topology.shape(vertices[triangles])[0][owner]  # so that the rim is a crease, too
    points = np.concatenate([vertices, (vertices[start] + vertices[stop]) / 2 + upright])
    skirt = np.stack([stop, start, len(vertices) + np.arange(len(start))], axis=1)
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, np.concatenate([triangles, skirt]).astype(np.int32)))
    meshes.compute_selection_by_condition_per_face(condselect=f"fi < {len(triangles)}")
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=ITERATIONS,
        targetlen=pymeshlab.PureValue(edge),
        featuredeg=topology.FEATURE_ANGLE,
        checksurfdist=True,
        maxsurfdist=pymeshlab.PureValue(deviation),
        selectedonly=True,
    )
    mesh = meshes.current_mesh()
    points, faces = topology.compact(mesh.vertex_matrix(), mesh.face_matrix()[mesh.face_selection_array()])
    held = np.unique(triangles[owner, [side, (side + 1) % 3]])
    points[cKDTree(points).query(vertices[held])[1]] = vertices[held]
    before, after = _lines(vertices, triangles), _lines(points, faces)
    # In a strip much narrower than an edge it may fail. (The library joins both sides of a crease that ends inside.)
    return (points, faces) if before[0] <= after[1] and after[0] <= before[0] else (vertices, triangles)


def _lines(vertices, triangles):
    """The boundary edges of a patch, and all of its edges, each a set of pairs of points."""
    ends, count = topology.edges(triangles)[0], topology.triangles_at_edges(triangles)
    pairs = [frozenset(map(tuple, pair)) for pair in vertices[ends].tolist()]
    return {pair for pair, many in zip(pairs, count, strict=True) if many == 1}, set(pairs)


def _put_together(made, sources):
    """The patches as one mesh: rim vertices did not move, so that copies of one agree to the last bit.

    Two patches may both have an edge between the same two rim vertices, as at the corners of a knife edge; four
    triangles would meet there. Its middle then goes where its own patch's source is.
    """
    made = list(made)
    while True:
        points = np.concatenate([points for points, _ in made])
        vertices, place = np.unique(points, axis=0, return_inverse=True)
        places = np.split(place.reshape(-1), np.cumsum([len(points) for points, _ in made])[:-1])
        edges = [topology.edges(faces) for _, faces in made]
        inner = [np.bincount(index.ravel()) == 2 for _, index in edges]
        pairs = [np.sort(place[unique], axis=1) for place, (unique, _) in zip(places, edges, strict=True)]
        _, name, count = np.unique(np.concatenate(pairs), axis=0, return_inverse=True, return_counts=True)
        shared = np.split(count[name.reshape(-1)] > 1, np.cumsum([len(pair) for pair in pairs])[:-1])
        if not any((one & other).any() for one, other in zip(shared, inner, strict=True)):
            faces = np.concatenate([place[faces] for place, (_, faces) in zip(places, made, strict=True)])
            return vertices, faces.astype(np.int32)
        for k, (points, faces) in enumerate(made):
            cut, (unique, index) = shared[k] & inner[k], edges[k]
            if not cut.any():
                continue
            middles = points[unique].mean(axis=1)
            normal = np.zeros_like(middles)
            np.add.at(normal, index.ravel(), np.repeat(topology.shape(points[faces])[0], 3, axis=0))
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            middles[cut] -= distances(middles[cut], *sources[k], signed=True)[:, None] * normal[cut]
            made[k] = cut_edges(points, faces, index, cut.astype(float), middles)
