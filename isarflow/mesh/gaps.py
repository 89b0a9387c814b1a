"""Find narrow gaps of air between walls that face each other: the field in them may resonate."""

import numpy as np
from scipy.spatial import cKDTree

from isarflow.mesh import topology
from isarflow.mesh.ground import OFF, Ground, samples

NARROW = 1 / 4  # wanted edges: across 0.2 of an edge the field of two plates was off by 0.6 dB where they resonate
LONG = 1 / 2  # wavelengths: a shorter gap does not resonate
FACING = -0.95  # cosine between the normals of walls that face each other; between others a wedge of air opens
NEXT = 1.5  # wanted edges between samples of one gap, at most


def sentences(vertices, triangles, edges, wavelengths):
    """Sentence on the longest gap of a surface that is narrow and long in a band. Edges and wavelengths: m, of each."""
    places, width = _gaps(vertices, triangles, edges[0])
    # One place a cell is enough: a file's needles have very many.
    some = np.unique(np.rint(places / (edges[0] / 2)), axis=0, return_index=True)[1]
    places, width = places[some], width[some]
    count, gap = topology.groups(cKDTree(places).query_pairs(NEXT * edges[0], output_type="ndarray"), len(places))
    found = []
    for number in range(count):
        own, across = places[gap == number], np.median(width[gap == number])
        off = own - own.mean(axis=0)
        # The largest extent, along the axes of inertia.
        extent = np.ptp(off @ np.linalg.svd(off, full_matrices=False)[2].T, axis=0).max()
        for edge, wavelength in zip(edges, wavelengths, strict=True):
            if across < NARROW * edge and extent > LONG * wavelength:
                middle = own[(off**2).sum(axis=1).argmin()]
                found.append((extent, edge, wavelength, across, topology.place(middle)))
    if found:
        extent, edge, wavelength, across, place = max(found)
        yield (
            f"Near {place} two walls face each other across {across * 1000:.2g} mm of air, over {extent:.2g} m: at "
            f"{wavelength:.2g} m of wavelength it may resonate, and with edges of {edge * 1000:.2g} mm the field may "
            f"then be off by half a decibel and more. See what 'mesh.edges_per_wavelength: "
            f"{2 * wavelength / edge:.0f}' changes."
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
