"""Check a mesh for the combined field integral equation, without JAX, which takes a second to load."""

import numpy as np
from scipy import sparse

from isarflow.core.errors import InputError


def check_closed(vertices, triangles):
    """Raise InputError unless every part of the mesh is closed, with normals that point outwards."""
    ends = np.stack([triangles, np.roll(triangles, -1, 1)], 2).reshape(-1, 2).astype(np.int64)
    upward = ends[:, 0] < ends[:, 1]
    key, edge = np.unique(np.sort(ends, 1), axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    unequal = np.bincount(edge, np.where(upward, 1, -1), len(key)) != 0
    remedy = "'formulation: cfie' needs closed surfaces with outward normals; use efie for this target."
    if unequal.any():
        raise InputError(f"the mesh is open or its triangles disagree at {unequal.sum()} of {len(key)} edges. {remedy}")
    owner = np.repeat(np.arange(len(triangles)), 3)
    joined = sparse.csr_array((np.ones(len(edge)), (owner, edge)), (len(triangles), len(key)))
    parts, part = sparse.csgraph.connected_components(joined @ joined.T, directed=False)
    corners = np.asarray(vertices, np.float64)[triangles]
    corners = corners - corners.mean((0, 1))
    volume = np.bincount(part, np.linalg.det(corners) / 6, parts)
    if not (volume > 0).all():
        raise InputError(f"normals point inwards on {(volume <= 0).sum()} of {parts} closed surfaces. {remedy}")
