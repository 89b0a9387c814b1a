"""Isotropic remeshing to one edge length, features and boundaries kept."""

import numpy as np
import pymeshlab

from mesh import topology
from mesh.distance import distances, thickness
from mesh.patches import remesh_patches
from mesh.tidy import collapse_short_edges, flip_slivers, lift_chords, split_long_edges

SHORTEST, LONGEST = 0.5, 1.45  # wanted edges; those outside are pulled together or split afterwards
P99 = 1.345  # wanted edges: 99 % of all edges are to be shorter than 1.35, after the volume is restored too
MEAN = 0.965, 0.994  # wanted edges: a mean in this range needs no other try
FIRST_AIM = 0.98  # wanted edges: the remesher makes longer edges than it is told
LARGER = 1.03  # the most that the aim grows from one try to the next
TRIES = 4
DEEP = 0.2  # wanted edges: where a solid is thicker, collapses are bounded by the deviation alone
FLAT = 1e-6  # wanted edges that a flip may move a flat patch; and degrees that it must gain
ITERATIONS = 10
LEAST_SLOPE = 1e-12  # of the volume
ON_PLANE = 0.1  # wanted edges: the remesher leaves boundary vertices this near to the plane that they started in


def remesh(vertices, triangles, edge, deviation, axes, solid=None):
    """Triangles of at most `edge` metres on average on the same surface, moved by at most `deviation` metres a step.

    A boundary in one of the mirror planes `axes` stays in it exactly. The coarsest of a few tries that keeps to the
    lengths is taken: thin parts bring the mean down, and a regular start is only ever halved. With the whole `solid`
    (vertices, triangles) no part of it is lost that is thinner than an edge, at the price of shorter edges.
    """
    shortest, longest, little = SHORTEST * edge, LONGEST * edge, deviation / 2
    if solid is None:
        start = vertices, flip_slivers(vertices, triangles, little, axes)
        start = collapse_short_edges(*start, shortest, np.inf, little, axes)
    else:
        depth = thickness(vertices, triangles, solid, DEEP * edge)
        start = collapse_short_edges(vertices, triangles, shortest, np.inf, little, axes, depth)
        start = split_long_edges(*start, edge, longest, features=True)
        # Or the next step would put vertices into narrow strips, where diagonals run from end to end.
        start = start[0], flip_slivers(*start, FLAT * edge, axes, least=FLAT)
    start = split_long_edges(*start, edge, longest)
    best, fewest, aim = None, np.inf, FIRST_AIM
    for _ in range(TRIES):
        if solid is None:
            vertices, triangles = _isotropic(*start, aim * edge, deviation)
            vertices, triangles = _to_planes(vertices, triangles, start, ON_PLANE * edge, axes)
        else:
            vertices, triangles = remesh_patches(*start, aim * edge, deviation)
        for axis in axes:
            vertices, triangles = lift_chords(vertices, triangles, start, axis)
        if solid is None:  # these know nothing of patches, and would fold a thin part
            vertices, triangles = collapse_short_edges(vertices, triangles, shortest, P99 * edge, little, axes)
        vertices, triangles = split_long_edges(vertices, triangles, edge, longest)
        if solid is None:
            triangles = flip_slivers(vertices, triangles, little, axes)
        lengths = topology.edge_lengths(vertices, triangles) / edge
        many = int(np.ceil((lengths > P99).sum() - 0.008 * len(lengths)))
        if many > 0 and np.percentile(lengths, 99) > P99:  # cut no more than needed
            vertices, triangles = split_long_edges(vertices, triangles, edge, np.sort(lengths)[-1 - many] * edge)
            if solid is None:
                triangles = flip_slivers(vertices, triangles, little, axes)
            lengths = topology.edge_lengths(vertices, triangles) / edge
        mean = lengths.mean()
        fits = mean <= MEAN[1] and np.percentile(lengths, 99) <= P99
        if best is None or (fits and len(triangles) < fewest):
            best, fewest = (vertices, triangles), len(triangles) if fits else np.inf
        if fits and mean >= MEAN[0]:
            break
        # Where thin parts hold the mean down, a much larger aim only tears at the rest.
        aim *= min(sum(MEAN) / 2 / mean, LARGER if fits else MEAN[0])
    return best


def _to_planes(vertices, triangles, source, near, axes):
    """Boundary vertices within `near` metres of the mirror planes put on them; faces that then lie in one dropped."""
    if len(axes) == 0:
        return vertices, triangles
    boundary = topology.rim(triangles)
    for axis in axes:
        vertices[boundary[np.abs(vertices[boundary, axis]) <= near], axis] = 0.0
    if len(axes) == 2:
        # Where the surface meets both planes, the remesher may have cut the corner between its two boundaries.
        corners = source[0][topology.rim(source[1])]
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


def _isotropic(vertices, triangles, edge, deviation):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, np.asarray(triangles, np.int32)))
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=ITERATIONS,
        targetlen=pymeshlab.PureValue(edge),
        featuredeg=topology.FEATURE_ANGLE,
        checksurfdist=True,
        maxsurfdist=pymeshlab.PureValue(deviation),
        selectedonly=False,  # or the library takes what it was last told, for patches
    )
    mesh = meshes.current_mesh()
    return topology.compact(mesh.vertex_matrix(), mesh.face_matrix())


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
