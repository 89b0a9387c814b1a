"""The mirror plane y = 0: cut a target there, and put two halves together so that they agree to the last bit."""

import numpy as np

from common.errors import InputError
from mesh import topology
from mesh.distance import distances, samples

MIRROR = np.array([1.0, -1.0, 1.0])


def deviation(vertices, triangles, spacing):
    """Largest distance in metres between a target and its mirror image in y = 0, sampled every `spacing` metres."""
    return float(distances(samples(vertices, triangles, spacing) * MIRROR, vertices, triangles).max())


def left_half(vertices, triangles, tolerance, name):
    """The part with y >= 0, open along the plane, whose vertices there have y = 0 exactly.

    Vertices within `tolerance` metres of the plane are put on it. Raises InputError for faces in the plane:
    they belong to neither half.
    """
    vertices = np.where((np.abs(vertices[:, 1]) <= tolerance)[:, None], vertices * [1, 0, 1], vertices)
    y = vertices[triangles][:, :, 1]
    if (y == 0).all(axis=1).any():
        place = vertices[triangles[(y == 0).all(axis=1)][0]].mean(axis=0)
        raise InputError(
            f"{name} has faces in its mirror plane y = 0, near ({', '.join(f'{x:.4g}' for x in place)}) m. "
            "Give that part a thickness, or leave out 'symmetry' for this target."
        )
    whole = triangles[(y >= 0).all(axis=1)]
    crossing = triangles[(y < 0).any(axis=1) & (y > 0).any(axis=1)]
    if len(crossing) == 0:
        return topology.compact(vertices, whole)
    # One new vertex for each edge that crosses the plane, shared by the triangles at that edge.
    unique, index = topology.edges(crossing)
    start, stop = vertices[unique].transpose(1, 0, 2)
    cut = start[:, 1] * stop[:, 1] < 0
    share = np.divide(start[:, 1], start[:, 1] - stop[:, 1], where=cut, out=np.zeros(len(unique)))
    points = start + share[:, None] * (stop - start)
    points[:, 1] = 0.0
    pieces = []
    for corners, sides in zip(crossing, index, strict=True):
        polygon = []
        for k in range(3):
            if vertices[corners[k], 1] >= 0:
                polygon.append(corners[k])
            if cut[sides[k]]:
                polygon.append(len(vertices) + sides[k])
        pieces += [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1)]
    return topology.compact(np.concatenate([vertices, points]), np.concatenate([whole, np.array(pieces)]))


def with_mirror(vertices, triangles):
    """Both halves as one mesh: the given one first, then its mirror image; vertices with y = 0 are shared."""
    on_plane = vertices[:, 1] == 0
    image = np.where(on_plane, np.arange(len(vertices)), len(vertices) + np.cumsum(~on_plane) - 1)
    both = np.concatenate([vertices, vertices[~on_plane] * MIRROR])
    return both, np.concatenate([triangles, image[triangles][:, ::-1]]).astype(np.int32)
