"""Isotropic remeshing to one edge length, features and boundaries kept."""

from typing import NamedTuple

import numpy as np

from mesh import topology
from mesh.distance import distances, thickness
from mesh.meshlab import loaded, remesh_isotropic
from mesh.patches import remesh_patches
from mesh.tidy import Limits, collapse_short_edges, flip_slivers, lift_chords, split_long_edges

SHORTEST, LONGEST = 0.5, 1.45  # wanted edges; those outside are pulled together or split afterwards
P99 = 1.345  # wanted edges: 99 % of all edges are to be shorter than 1.35, after the volume is restored too
MEAN = 0.965, 0.994  # wanted edges: a mean in this range needs no other try
FIRST_AIM = 0.98  # wanted edges: the remesher makes longer edges than it is told
LARGER = 1.03  # the most that the aim grows from one try to the next
TRIES = 4
DEEP = 0.2  # wanted edges: where a solid is thicker, collapses are bounded by the deviation alone
FLAT = 1e-6  # wanted edges that a flip may move a flat patch; and degrees that it must gain
LEAST_SLOPE = 1e-12  # of the volume
ON_PLANE = 0.1  # wanted edges: the remesher leaves boundary vertices this near to the plane that they started in


class Wanted(NamedTuple):
    """What the mesh of a band is to be; lengths in metres."""

    edge: float  # mean length of its edges
    deviation: float  # how far one step of remeshing may move the surface
    axes: tuple = ()  # mirror planes


def remesh(vertices, triangles, wanted, solid=None):
    """Triangles with the Wanted edges, or shorter ones on average, on the same surface.

    A boundary in one of the mirror planes stays in it exactly. The coarsest of a few tries that keeps to the lengths is
    taken: thin parts bring the mean down, and a regular start is only ever halved. With the whole `solid`
    (vertices, triangles) no part of it is lost that is thinner than an edge, at the price of shorter edges.
    """
    edge, longest = wanted.edge, LONGEST * wanted.edge
    start = _start(vertices, triangles, wanted, solid)
    best, fewest, aim = None, np.inf, FIRST_AIM
    for _ in range(TRIES):
        mesh = _remeshed(start, wanted, aim * edge, solid is not None)
        mesh = _split(*mesh, wanted, longest, solid is not None)
        lengths = topology.edge_lengths(*mesh) / edge
        too_long = int(np.ceil((lengths > P99).sum() - 0.008 * len(lengths)))
        if too_long > 0 and np.percentile(lengths, 99) > P99:  # cut no more than needed
            mesh = _split(*mesh, wanted, np.sort(lengths)[-1 - too_long] * edge, solid is not None)
            lengths = topology.edge_lengths(*mesh) / edge
        mean = lengths.mean()
        fits = mean <= MEAN[1] and np.percentile(lengths, 99) <= P99
        if best is None or (fits and len(mesh[1]) < fewest):
            best, fewest = mesh, len(mesh[1]) if fits else np.inf
        if fits and mean >= MEAN[0]:
            break
        # Where thin parts hold the mean down, a much larger aim only tears at the rest.
        aim *= min(sum(MEAN) / 2 / mean, LARGER if fits else MEAN[0])
    return best


def _start(vertices, triangles, wanted, solid):
    """The surface without edges that are far too short or too long."""
    edge, deviation, axes = wanted
    if solid is None:
        triangles = flip_slivers(vertices, triangles, deviation / 2, axes)
        depth = None
    else:
        depth = thickness(vertices, triangles, solid, DEEP * edge)
    limits = Limits(np.inf, deviation / 2, axes, depth)
    vertices, triangles = collapse_short_edges(vertices, triangles, SHORTEST * edge, limits)
    if solid is not None:
        vertices, triangles = split_long_edges(vertices, triangles, edge, LONGEST * edge, features=True)
        # Or the next step would put vertices into narrow strips, where diagonals run from end to end.
        triangles = flip_slivers(vertices, triangles, FLAT * edge, axes, least=FLAT)
    return split_long_edges(vertices, triangles, edge, LONGEST * edge)


def _remeshed(start, wanted, aim, thin):
    """One try with edges of about `aim` metres; `thin` if parts thinner than an edge are to be kept."""
    edge, deviation, axes = wanted
    if thin:
        mesh = remesh_patches(*start, aim, deviation)
    else:
        mesh = remesh_isotropic(loaded(*start), aim, deviation)
        mesh = _to_planes(*mesh, start, ON_PLANE * edge, axes)
    for axis in axes:
        mesh = lift_chords(*mesh, start, axis)
    if not thin:  # a collapse knows nothing of patches, and would fold a thin part, as would a flip
        mesh = collapse_short_edges(*mesh, SHORTEST * edge, Limits(P99 * edge, deviation / 2, axes))
    return mesh


def _split(vertices, triangles, wanted, longest, thin):
    """The mesh with its edges above `longest` metres cut."""
    vertices, triangles = split_long_edges(vertices, triangles, wanted.edge, longest)
    return vertices, triangles if thin else flip_slivers(vertices, triangles, wanted.deviation / 2, wanted.axes)


def _to_planes(vertices, triangles, source, near, axes):
    """Boundary vertices within `near` metres of the mirror planes put on them; faces that then lie in one dropped."""
    if len(axes) == 0:
        return vertices, triangles
    boundary = np.unique(topology.rims(triangles)[0])
    for axis in axes:
        vertices[boundary[np.abs(vertices[boundary, axis]) <= near], axis] = 0.0
    if len(axes) == 2:
        # Where the surface meets both planes, the remesher may have cut the corner between its two boundaries.
        corners = source[0][np.unique(topology.rims(source[1])[0])]
        for corner in corners[(corners[:, axes] == 0).all(axis=1)]:
            vertices[boundary[np.linalg.norm(vertices[boundary] - corner, axis=1).argmin()]] = corner
    lying = (vertices[triangles][:, :, list(axes)] == 0).all(axis=1)
    for k, axis in enumerate(axes):  # but not those of the source
        flat = source[1][(source[0][source[1]][:, :, axis] == 0).all(axis=1)]
        if len(flat) and lying[:, k].any():
            centres = vertices[triangles[lying[:, k]]].mean(axis=1)
            lying[lying[:, k], k] = distances(centres, source[0], flat) > near
    lying = lying.any(axis=1)
    return topology.compact(vertices, triangles[~lying])


def restore_volume(vertices, triangles, source, volume, axes):
    """Vertices moved outwards so that the mesh has `volume` m^3: chords of a convex surface lie inside it.

    Each vertex moves in proportion to the distances of its faces' centres from the closed `source`
    (vertices, triangles), along those faces' normals: flat parts stay as they are. Vertices in the mirror planes
    `axes` stay there.
    """
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # twice the area long
    depth = -distances(corners.mean(axis=1), *source, signed=True)
    push, weight = np.zeros_like(vertices), np.zeros(len(vertices))
    for k in range(3):
        np.add.at(push, triangles[:, k], depth[:, None] * normal)
        np.add.at(weight, triangles[:, k], np.linalg.norm(normal, axis=1))
    push /= weight[:, None]
    for axis in axes:
        push[vertices[:, axis] == 0, axis] = 0.0
    scale = 0.0
    for _ in range(3):  # Newton's method on the volume, which is nearly linear in the scale
        slope = (topology.tetrahedra(vertices + push, triangles) - topology.tetrahedra(vertices, triangles)).sum()
        missing = volume - topology.tetrahedra(vertices + scale * push, triangles).sum()
        if abs(slope) < LEAST_SLOPE * abs(volume):
            break  # the mesh lies on the source everywhere
        scale += missing / slope
    return vertices + scale * push
