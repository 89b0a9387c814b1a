"""Where a surface passes through itself without a common edge."""

import numpy as np
import pymeshlab
from scipy.spatial import cKDTree

MARGIN = 1e-6  # of a triangle: what merely touches does not cross


def first_crossing(vertices, triangles):
    """The point (3,) in metres where two triangles without a common corner cross or lie in each other; None if none.

    Triangles are taken in their order, so the point is the same in every run.
    """
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int32)))
    meshes.compute_selection_by_self_intersections_per_face()
    # The library also selects flat neighbours: a triangle is asked again, against those that it shares no corner with.
    number = np.flatnonzero(meshes.current_mesh().face_selection_array())
    corners, names = vertices[triangles[number]], triangles[number]
    if len(number) == 0:
        return None
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    tree = cKDTree(centre)
    for k in range(len(number)):
        near = np.array(sorted(tree.query_ball_point(centre[k], radius[k] + radius.max())))
        apart = (names[near][:, :, None] != names[k]).all(axis=(1, 2))
        near = near[apart]
        for points in (_pierced(corners[[k]].repeat(len(near), 0), corners[near]), _lying_in(centre[near], corners[k])):
            if len(points):
                return points[0]
    return None


def _pierced(first, second):
    """Points where the sides of the first triangles (N, 3, 3) pass through the second ones (N, 3, 3), (P, 3)."""
    found = []
    for k in range(3):
        start, along = first[:, k], first[:, (k + 1) % 3] - first[:, k]
        u, v = second[:, 1] - second[:, 0], second[:, 2] - second[:, 0]
        # Moeller, Trumbore, J. Graphics Tools 2, 1997.
        p = np.cross(along, v)
        det = (u * p).sum(axis=1)
        size = np.linalg.norm(along, axis=1) * np.linalg.norm(np.cross(u, v), axis=1)
        steep = np.abs(det) > 1e-6 * size
        det = np.where(steep, det, 1.0)
        s = start - second[:, 0]
        q = np.cross(s, u)
        a, b, t = (s * p).sum(axis=1) / det, (along * q).sum(axis=1) / det, (v * q).sum(axis=1) / det
        inside = steep & (np.minimum(np.minimum(a, b), 1 - a - b) > MARGIN) & (t > MARGIN) & (t < 1 - MARGIN)
        found.append((start + t[:, None] * along)[inside])
    return np.concatenate(found)


def _lying_in(points, corners):
    """Those of the points (N, 3) that lie in a triangle's plane (3, 3), inside it."""
    u, v = corners[1] - corners[0], corners[2] - corners[0]
    normal = np.cross(u, v)
    area = np.linalg.norm(normal)
    s = points - corners[0]
    off = np.abs(s @ normal) / area
    a, b = np.cross(s, v) @ normal / area**2, np.cross(u, s) @ normal / area**2
    return points[(off < MARGIN * np.sqrt(area)) & (np.minimum(np.minimum(a, b), 1 - a - b) > MARGIN)]
