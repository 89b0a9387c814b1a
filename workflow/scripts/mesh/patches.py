"""Remeshing in patches between frozen feature lines, for parts thinner than an edge.

The usual remesher takes a crease sharper than 168 degrees for a fold, and smooths away a rim that is narrower than its
steps: the two faces of a plate then run into each other. Here the surface is cut open along its features, each patch
is remeshed with its rim held fast, and the patches are put together again, so that no part can be lost.
"""

import numpy as np
from scipy.spatial import cKDTree

from mesh import topology
from mesh.distance import distances
from mesh.meshlab import loaded, remesh_isotropic
from mesh.tidy import cut_edges

TIP = 0.7  # of a full turn: a vertex whose faces make less in all is a tip and stays


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
    size = len(triangles)
    sides = topology.side_pairs(topology.edges(triangles), ~_features(vertices, triangles))
    first, second = sides.T // 3
    patch = topology.groups(sides // 3, size)[1]
    pairs = []
    for k in (0, 1):  # both ends of the edge between two triangles of a patch
        here = 3 * first + (sides[:, 0] + k) % 3
        there = 3 * second + (triangles[second] == triangles.ravel()[here][:, None]).argmax(axis=1)
        pairs.append(np.stack([here, there], axis=1))
    return patch, topology.groups(np.concatenate(pairs), 3 * size)[1].reshape(-1, 3)


def _features(vertices, triangles):
    """True for each edge to keep, (E,): creases, boundaries, junctions, and the edges at a tip."""
    ends = topology.edges(triangles).ends
    feature = topology.features(vertices, triangles)
    turn = np.bincount(triangles.ravel(), weights=topology.angles(vertices[triangles]).ravel())
    tip = turn < TIP * 360
    tip[ends[feature]] = False
    return feature | tip[ends].any(axis=1)


def _remesh_patch(vertices, triangles, edge, deviation):
    """One patch, its rim as it was but for rounding, which is undone: triangles that are not selected hold it fast."""
    _, owner, side = topology.rims(triangles)
    start, stop = triangles[owner, side], triangles[owner, (side + 1) % 3]
    length = np.linalg.norm(vertices[stop] - vertices[start], axis=1, keepdims=True)
    upright = length * topology.shape(vertices[triangles])[0][owner]  # so that the rim is a crease, too
    points = np.concatenate([vertices, (vertices[start] + vertices[stop]) / 2 + upright])
    skirt = np.stack([stop, start, len(vertices) + np.arange(len(start))], axis=1)
    meshes = loaded(points, np.concatenate([triangles, skirt]))
    meshes.compute_selection_by_condition_per_face(condselect=f"fi < {len(triangles)}")
    points, faces = remesh_isotropic(meshes, edge, deviation, selected=True)
    rim = np.unique([start, stop])
    points[cKDTree(points).query(vertices[rim])[1]] = vertices[rim]
    before, after = _lines(vertices, triangles), _lines(points, faces)
    # In a strip much narrower than an edge it may fail. (The library joins both sides of a crease that ends inside.)
    return (points, faces) if before[0] <= after[1] and after[0] <= before[0] else (vertices, triangles)


def _lines(vertices, triangles):
    """The boundary edges of a patch, and all of its edges, each a set of pairs of points."""
    ends, _, count = topology.edges(triangles)
    pairs = [frozenset(map(tuple, pair)) for pair in vertices[ends].tolist()]
    return {pair for pair, triangles_there in zip(pairs, count, strict=True) if triangles_there == 1}, set(pairs)


def _put_together(patches, sources):
    """The patches as one mesh: rim vertices did not move, so that copies of one agree to the last bit.

    Two patches may both have an edge between the same two rim vertices, as at the corners of a knife edge; four
    triangles would meet there. Its middle then goes where its own patch's source is.
    """
    patches = list(patches)
    while True:
        vertices, number = np.unique(np.concatenate([points for points, _ in patches]), axis=0, return_inverse=True)
        numbers = np.split(number.reshape(-1), np.cumsum([len(points) for points, _ in patches])[:-1])
        edges = [topology.edges(faces) for _, faces in patches]
        pairs = [np.sort(number[ends], axis=1) for number, (ends, _, _) in zip(numbers, edges, strict=True)]
        _, name, count = np.unique(np.concatenate(pairs), axis=0, return_inverse=True, return_counts=True)
        shared = np.split(count[name.reshape(-1)] > 1, np.cumsum([len(pair) for pair in pairs])[:-1])
        cuts = [here & (edge.count == 2) for here, edge in zip(shared, edges, strict=True)]
        if not any(cut.any() for cut in cuts):
            faces = np.concatenate([number[faces] for number, (_, faces) in zip(numbers, patches, strict=True)])
            return vertices, faces.astype(np.int32)
        for k, (points, faces) in enumerate(patches):
            if not cuts[k].any():
                continue
            ends, sides, _ = edges[k]
            middles = points[ends].mean(axis=1)
            normal = np.zeros_like(middles)
            np.add.at(normal, sides.ravel(), np.repeat(topology.shape(points[faces])[0], 3, axis=0))
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            middles[cuts[k]] -= distances(middles[cuts[k]], *sources[k], signed=True)[:, None] * normal[cuts[k]]
            patches[k] = cut_edges(points, faces, sides, cuts[k].astype(float), middles)
