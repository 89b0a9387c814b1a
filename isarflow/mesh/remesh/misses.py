"""Find places where a mesh is off its source by too much, and the shorter edges to use there."""

import numpy as np
from scipy.spatial import cKDTree

from isarflow.mesh import topology
from isarflow.mesh.ground import Ground, samples
from isarflow.mesh.repair.arrange import crossings

GOAL = 1 / 40, 0.01  # wavelengths from the source, and share of its area or volume: goals of a mesh
WELL = 0.8, 0.6  # of the goals: for each place, and for the whole area
SHARE = 0.25, 0.7  # the least and the largest factor by which edges are shortened at once
CROSSED, TURNED = 0.5, 0.6  # the share of edges that cross, and of those that cut corners off
AROUND = 0.25, 0.25  # shares of the area: normals of rods add up to less, and have more along a second axis
NEAR = 40  # triangles: among more, a rod is not of few sides
ON = 1e-3  # wanted edges: a place nearer to the mesh is on it, for any normals at a crease


class Followed:
    """A source surface (vertices, triangles), sampled so that meshes with edges of `edge` metres can be held to it."""

    def __init__(self, vertices, triangles, edge):
        self.edge, self.ground = edge, Ground(vertices, triangles)
        self.points, self.area, owner = samples(vertices, triangles, edge / 2)
        self.normal = self.ground.normal[owner]

    def apart(self, mesh):
        """Distances between a mesh (vertices, triangles) and the source: points (P, 3) and metres (P,) of each.

        First the mesh's corners and middles, from the source, then the source's samples, from the mesh; then the mesh's
        triangle nearest to each of these, and the area in m^2 that thin rods gain: they scatter by their volume.
        """
        vertices, triangles = mesh
        ends = topology.edges(triangles).ends
        probes = np.concatenate([vertices, vertices[ends].mean(axis=1), vertices[triangles].mean(axis=1)])
        from_source, nearest = Ground(vertices, triangles).distance(self.points)
        rod = rods(vertices, triangles, self.edge)
        gained = max(float(topology.areas(vertices, triangles)[rod].sum() - self.area[rod[nearest]].sum()), 0.0)
        return (probes, self.ground.distance(probes)[0]), (self.points, from_source), nearest, gained

    def strays(self, mesh, apart, wavelength):
        """Places (P, 3) where a mesh strays or crosses itself, and the share of their length for edges there, (P,)."""
        vertices, triangles = mesh
        limit, places, shares = WELL[0] * GOAL[0] * wavelength, [], []
        for points, distance in apart[:2]:
            far = distance > limit
            places.append(points[far])
            shares.append(np.clip(np.sqrt(limit / distance[far] / 2), *SHARE))  # chords are as deep as length^2
        crossed = np.unique(crossings(vertices, triangles))
        places.append(vertices[triangles[crossed]].mean(axis=1))
        shares.append(np.full(len(crossed), CROSSED))
        return np.concatenate(places), np.concatenate(shares)

    def lost(self, mesh, apart, area):
        """Places and shares as in `strays` where a mesh loses or gains area, if too much of the `area` in m^2."""
        _, (_, distance), nearest, gained = apart
        asked = WELL[1] * GOAL[1] * area
        if abs(area - topology.areas(*mesh).sum() + gained) <= asked:
            return np.zeros((0, 3)), np.zeros(0)
        turned = 1 - np.abs((topology.shape(mesh[0][mesh[1]])[0][nearest] * self.normal).sum(axis=1))
        turned[(distance <= ON * self.edge) | (self.area == 0)] = 0
        order = np.argsort(-turned, kind="stable")
        left = np.cumsum((turned * self.area)[order][::-1])[::-1]
        worst = order[(left > asked / 2) & (turned[order] > 0)]
        return self.points[worst], np.full(len(worst), TURNED)


def rods(vertices, triangles, edge):
    """True for triangles of rods thinner than `edge` metres, (T,): normals within that distance point to all sides."""
    corners = vertices[triangles]
    normal = topology.normals(corners)
    area = np.maximum(np.linalg.norm(normal, axis=1), topology.TINY)[:, None]
    square = (normal[:, :, None] * (normal / area)[:, None]).reshape(-1, 9)
    middle = corners.mean(axis=1)
    near = cKDTree(middle).query(middle, NEAR, distance_upper_bound=edge)[1]  # the number of triangles is no triangle
    of_face = np.concatenate([np.concatenate([area, normal, square], axis=1), np.zeros((1, 13))])
    total = np.stack([column[near].sum(axis=1) for column in of_face.T], axis=1)
    normal, square = total[:, 1:4] / total[:, :1], (total[:, 4:] / total[:, :1]).reshape(-1, 3, 3)
    return (np.linalg.norm(normal, axis=1) < AROUND[0]) & (np.linalg.eigvalsh(square)[:, 1] > AROUND[1])
