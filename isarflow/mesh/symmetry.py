"""Mirror planes: cut a target there, and put the parts together so that they agree to the last bit."""

import itertools

import numpy as np

from isarflow.core import sweep
from isarflow.mesh import topology

AXES = {"yz": 0, "xz": 1, "xy": 2}  # mirror plane -> the coordinate that is zero there, by which a plane is given
PLANES = tuple(AXES)  # of the coordinates
ASYMMETRY = 1 / 100  # wavelengths at the top frequency between a target and its mirror image


def allowed(radar):
    """Largest allowed distance of a target from its mirror image, in metres."""
    return ASYMMETRY * sweep.C0 / sweep.frequencies(radar)[-1]


def axes(planes):
    """The coordinates, ascending, that mirror planes like ['xz', 'yz'] set to zero."""
    return sorted(AXES[plane] for plane in planes)


def mirrored(points, axis):
    """Points (..., 3) on the other side of a plane."""
    return points * np.where(np.arange(3) == axis, -1.0, 1.0)


def positive_half(vertices, triangles, tolerance, axis):
    """The part on the plane's positive side, with faces in it; vertices within `tolerance` metres are put onto it."""
    vertices = vertices.copy()
    vertices[np.abs(vertices[:, axis]) <= tolerance, axis] = 0.0
    y = vertices[triangles][:, :, axis]
    whole = triangles[(y >= 0).all(axis=1)]
    crossing = triangles[(y < 0).any(axis=1) & (y > 0).any(axis=1)]
    if len(crossing) == 0:
        return topology.compact(vertices, whole)
    # One new vertex for each edge that crosses the plane, shared by the triangles at that edge.
    ends, sides, _ = topology.edges(crossing)
    start, stop = vertices[ends].transpose(1, 0, 2)
    cut = start[:, axis] * stop[:, axis] < 0
    share = np.divide(start[:, axis], start[:, axis] - stop[:, axis], where=cut, out=np.zeros(len(ends)))
    points = start + share[:, None] * (stop - start)
    points[:, axis] = 0.0
    pieces = []
    for corners, edges in zip(crossing, sides, strict=True):
        polygon = []
        for corner, edge in zip(corners, edges, strict=True):
            if vertices[corner, axis] >= 0:
                polygon.append(corner)
            if cut[edge]:
                polygon.append(len(vertices) + edge)
        pieces += [(polygon[0], *pair) for pair in itertools.pairwise(polygon[1:])]
    return topology.compact(np.concatenate([vertices, points]), np.concatenate([whole, np.array(pieces)]))


def with_mirror(vertices, triangles, axis):
    """Both halves as one mesh: the given one first, then its mirror image; parts in the plane occur once."""
    on_plane = vertices[:, axis] == 0
    image = np.where(on_plane, np.arange(len(vertices)), len(vertices) + np.cumsum(~on_plane) - 1)
    both = np.concatenate([vertices, mirrored(vertices[~on_plane], axis)])
    beside = ~on_plane[triangles].all(axis=1)
    return both, np.concatenate([triangles, image[triangles[beside]][:, ::-1]]).astype(np.int32)
