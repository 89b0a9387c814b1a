"""The surface that a mesh represents: distances of points from it, their places on it, distances of its walls."""

import igl
import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.symmetry import mirrored

SAME_SIDE = 0.3  # cosine of the angle between normals of a vertex and of the place it is put on
ON = 1e-6  # of the largest distance of a place: a point nearer to the surface is on it, with any normal
LOOK = 0.03, 0.1, 0.3  # of the largest distance of a place: steps along the normal
OFF = 1e-9  # of the surface's size: distance of the rays' start from it


class Ground:
    """A surface (vertices, triangles) with the trees of its boxes and of its features; axes: its mirror planes."""

    def __init__(self, vertices, triangles, axes=()):
        self.vertices, self.triangles = np.ascontiguousarray(vertices, float), triangles.astype(np.int64)
        self.tree = igl.AABB()
        self.tree.init(self.vertices, self.triangles)
        self.normal = topology.shape(vertices[triangles])[0]
        self.axes = list(axes)
        lines = topology.edges(triangles).ends[topology.features(vertices, triangles)]
        planes = self._planes(self.vertices[lines[:, 0]]) & self._planes(self.vertices[lines[:, 1]])
        # For each set of planes the tree and ends of features in these: a thin fin's other features may be very near.
        self.lines = {}
        for which in np.unique(planes):
            ends, tree = np.ascontiguousarray(lines[planes == which]), igl.AABB()
            tree.init(self.vertices, ends)
            self.lines[which] = tree, ends

    def distance(self, points):
        """Metres from points (P, 3), (P,), and the triangle that is nearest to each, (P,)."""
        square, face, _ = self.tree.squared_distance(self.vertices, self.triangles, np.ascontiguousarray(points))
        return np.sqrt(square), face

    def nearest(self, points, normal, most):
        """The nearest places (P, 3) that face as the unit normals (P, 3) do, at most (P,) metres away; else NaN."""
        place = self._facing(points, normal, ON * most)
        lost = np.flatnonzero(np.isnan(place[:, 0]))  # the nearest wall faces away
        best = np.full(len(lost), np.inf)
        for share in (*LOOK, *(-share for share in LOOK)):
            other = self._facing(points[lost] + (share * most[lost])[:, None] * normal[lost], normal[lost], 0.0)
            apart = np.linalg.norm(other - points[lost], axis=1)
            nearer = apart < best  # not where it is NaN
            best[nearer], place[lost[nearer]] = apart[nearer], other[nearer]
        far = ((place - points) ** 2).sum(axis=1) > most**2
        place[far] = np.nan
        return place

    def _facing(self, points, normal, near):
        square, face, place = self.tree.squared_distance(self.vertices, self.triangles, np.ascontiguousarray(points))
        place[((self.normal[face] * normal).sum(axis=1) < SAME_SIDE) & (square > near**2)] = np.nan
        return place

    def on_line(self, points):
        """The nearest places (P, 3) on features in the mirror planes that the points are in; else themselves."""
        place, planes = points.copy(), self._planes(points)
        for which in np.intersect1d(planes, list(self.lines)):
            tree, ends = self.lines[which]
            mine = planes == which
            place[mine] = tree.squared_distance(self.vertices, ends, np.ascontiguousarray(points[mine]))[2]
        return place

    def put(self, points, normal, on_line, most):
        """Places of points (P, 3) on the surface, `on_line` on features; points farther than `most` metres stay."""
        place = np.empty_like(points)
        place[~on_line] = self.nearest(points[~on_line], normal[~on_line], most[~on_line])
        place[on_line] = self.on_line(points[on_line])
        near = ((place - points) ** 2).sum(axis=1) <= most**2
        return np.where(near[:, None], place, points)

    def _planes(self, points):
        """Mirror planes in which points (P, 3) lie: a number with a bit for each plane, (P,)."""
        return (points[:, self.axes] == 0) @ (1 << np.arange(len(self.axes)))

    def clearance(self, points):
        """Metres of metal beneath points (P, 3) on a closed surface, and of air above them, to the next wall or inf."""
        face = self.distance(points)[1]
        normal, middle = self.normal[face], self.vertices[self.triangles[face]].mean(axis=1)
        far = np.linalg.norm(np.ptp(self.vertices, axis=0))
        widths = []
        for side in (-1, 1):
            start = middle + side * OFF * far * normal
            width = self.tree.intersect_ray_first(self.vertices, self.triangles, start, side * normal)[1]
            widths.append(np.where(np.isfinite(width), width, np.inf))
        return tuple(widths)


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


def from_mirror_image(vertices, triangles, spacing, axis):
    """Largest distance in m between a target and its mirror image, sampled every `spacing` metres, with its place."""
    points = samples(vertices, triangles, spacing)[0]
    apart = Ground(vertices, triangles).distance(mirrored(points, axis))[0]
    return float(apart.max()), points[apart.argmax()]
