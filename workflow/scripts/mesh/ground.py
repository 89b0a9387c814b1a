"""The surface that a mesh stands for: how far points are from it, where they belong on it, how near its walls are."""

import igl
import numpy as np
from scipy.spatial import cKDTree

from mesh import topology

SAME_SIDE = 0.3  # cosine of the angle between normals of a vertex and of the place it is put on
LOOK = 0.03, 0.1, 0.3  # of the farthest that a place may be: steps along the normal
OFF = 1e-9  # of the surface's size: where rays start, beside it


class Ground:
    """A surface (vertices, triangles) with its tree of boxes; `spacing` in metres is that of dots on its features."""

    def __init__(self, vertices, triangles, spacing):
        self.vertices, self.triangles = np.ascontiguousarray(vertices, float), triangles.astype(np.int64)
        self.tree = igl.AABB()
        self.tree.init(self.vertices, self.triangles)
        self.normal = topology.shape(vertices[triangles])[0]
        ends = topology.edges(triangles).ends[topology.features(vertices, triangles)]
        self.start, stop = vertices[ends].transpose(1, 0, 2)
        self.along = stop - self.start
        many = np.ceil(np.linalg.norm(self.along, axis=1) / spacing).astype(int) + 1
        self.owner = np.repeat(np.arange(len(ends)), many)
        count = np.arange(len(self.owner)) - np.repeat(np.cumsum(many) - many, many)
        share = count / np.maximum(np.repeat(many - 1, many), 1)
        self.dots = cKDTree(self.start[self.owner] + share[:, None] * self.along[self.owner]) if len(ends) else None

    def distance(self, points):
        """Metres from points (P, 3), (P,), and the triangle that is nearest to each, (P,)."""
        square, face, _ = self.tree.squared_distance(self.vertices, self.triangles, np.ascontiguousarray(points))
        return np.sqrt(square), face

    def nearest(self, points, normal, most):
        """The nearest places (P, 3) that face as the unit normals (P, 3) do, at most (P,) metres away; else NaN.

        Where the nearest wall faces away, the one behind or before it is looked for.
        """
        place = self._facing(points, normal)
        lost = np.flatnonzero(np.isnan(place[:, 0]))
        best = np.full(len(lost), np.inf)
        for share in (*LOOK, *(-share for share in LOOK)):
            other = self._facing(points[lost] + (share * most[lost])[:, None] * normal[lost], normal[lost])
            apart = np.linalg.norm(other - points[lost], axis=1)
            nearer = apart < best  # not where it is NaN
            best[nearer], place[lost[nearer]] = apart[nearer], other[nearer]
        far = ((place - points) ** 2).sum(axis=1) > most**2
        place[far] = np.nan
        return place

    def _facing(self, points, normal):
        _, face, place = self.tree.squared_distance(self.vertices, self.triangles, np.ascontiguousarray(points))
        place[(self.normal[face] * normal).sum(axis=1) < SAME_SIDE] = np.nan
        return place

    def on_line(self, points):
        """The nearest places (P, 3) on the surface's features; the points themselves if it has none."""
        if self.dots is None or len(points) == 0:
            return points
        owner = self.owner[self.dots.query(points, k=min(4, len(self.owner)))[1].reshape(len(points), -1)]
        start, along = self.start[owner], self.along[owner]
        square = np.maximum((along**2).sum(axis=2), np.finfo(float).tiny)
        share = np.clip(((points[:, None] - start) * along).sum(axis=2) / square, 0, 1)
        place = start + share[:, :, None] * along
        best = ((place - points[:, None]) ** 2).sum(axis=2).argmin(axis=1)
        return place[np.arange(len(points)), best]

    def clearance(self, points):
        """Metres of metal beneath points (P, 3) on a closed surface and of air above them, (P,) each, to the next wall.

        Infinite where there is no other wall. Measured along the normal, from the middle of the nearest triangle.
        """
        face = self.distance(points)[1]
        normal, middle = self.normal[face], self.vertices[self.triangles[face]].mean(axis=1)
        far = np.linalg.norm(np.ptp(self.vertices, axis=0))
        widths = []
        for side in (-1, 1):
            start = middle + side * OFF * far * normal
            width = self.tree.intersect_ray_first(self.vertices, self.triangles, start, side * normal)[1]
            widths.append(np.where(np.isfinite(width), width, np.inf))
        return tuple(widths)
