"""Find narrow gaps of air between walls that face each other: the field in them may resonate."""

import numpy as np
from scipy.spatial import cKDTree

from isarflow.mesh import topology
from isarflow.mesh.ground import OFF, Ground, samples

NARROW = 1 / 4  # wanted edges: across 0.2 of an edge the field of two plates was off by 0.6 dB where they resonate
LONG = 1 / 2  # wavelengths: a shorter gap does not resonate
FACING = -0.95  # cosine between the normals of walls that face each other; between others a wedge of air opens
NEXT = 1.5  # wanted edges between samples of one gap, at most


def sentences(vertices, triangles, edge, coarse, wavelength):
    """Sentence on the longest narrow gap of a surface whose coarsest mesh has `edge` m at `coarse` m of wavelength.

    `wavelength`: the shortest, in metres.
    """
    places, width = _gaps(vertices, triangles, edge)
    # One place a cell is enough: a file's needles have very many.
    some = np.unique(np.rint(places / (edge / 2)), axis=0, return_index=True)[1]
    places, width = places[some], width[some]
    count, gap = topology.groups(cKDTree(places).query_pairs(NEXT * edge, output_type="ndarray"), len(places))
    # The largest extents, along the axes of inertia.
    off = [places[gap == number] - places[gap == number].mean(axis=0) for number in range(count)]
    extent = [np.ptp(each @ np.linalg.svd(each, full_matrices=False)[2].T, axis=0).max() for each in off]
    longest = int(np.argmax(extent)) if count else 0
    if count and extent[longest] > LONG * wavelength:
        middle = places[gap == longest][(off[longest] ** 2).sum(axis=1).argmin()]
        across = np.median(width[gap == longest]) * 1000
        yield (
            f"Near {topology.place(middle)} two walls face each other across {across:.2g} mm of air, over "
            f"{extent[longest]:.2g} m (wavelengths down to {wavelength:.2g} m): it may resonate, and with edges of "
            f"{edge * 1000:.2g} mm the field may then be off by about 1 dB. See what "
            f"'mesh.edges_per_wavelength: {2 * coarse / edge:.0f}' changes."
        )


def _gaps(vertices, triangles, edge):
    """Places (P, 3) that another wall faces across less than NARROW of an `edge` of air, and the width there, (P,)."""
    ground, far = Ground(vertices, triangles), np.linalg.norm(np.ptp(vertices, axis=0))
    points, area, owner = samples(vertices, triangles, edge)
    piece, closed = topology.closed_pieces(triangles)
    found = []
    for side, seen in ((1, area > 0), (-1, (area > 0) & ~closed[piece[owner]])):  # an open sheet has no inside
        way = side * ground.normal[owner[seen]]
        start = points[seen] + OFF * far * way
        hit, width = ground.tree.intersect_ray_first(ground.vertices, ground.triangles, start, way)[:2]
        cosine = (ground.normal[hit] * way).sum(axis=1)
        facing = np.where(closed[piece[hit]], cosine, -np.abs(cosine)) < FACING
        facing &= (hit >= 0) & (width < NARROW * edge)
        found.append((start[facing], width[facing]))
    return tuple(np.concatenate(each) for each in zip(*found, strict=True))
