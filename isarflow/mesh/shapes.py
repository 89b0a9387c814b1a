"""Closed parts as (vertices, triangles), their exact union, and binary STL. Metres, x forward, y to the left, z up.

For generators of families, in files of resources/cad/families or of one's own.
"""

import itertools
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

GRID = 2.0**-24  # m; STL stores float32, so vertices are put on a grid that float32 holds exactly below 1 m


def revolve(profile, segments=48, stretch=(1.0, 1.0)):
    """Body of revolution about x from `profile` [(x, radius), ...], nose last; the end radii may be 0.

    `stretch` scales the section along y and z.
    """
    angle = 2 * np.pi * (np.arange(segments) + 0.5) / segments
    ring = np.stack([np.cos(angle) * stretch[0], np.sin(angle) * stretch[1]], axis=1)
    profile = [(profile[0][0], 0.0)] * int(profile[0][1] > 0) + list(profile)
    profile += [(profile[-1][0], 0.0)] * int(profile[-1][1] > 0)
    vertices, rings = [], []
    for x, radius in profile:
        section = ring * radius if radius else np.zeros((1, 2))
        rings.append(len(vertices) + np.arange(len(section)))
        vertices += [(x, *point) for point in section]
    faces = []
    for low, high in itertools.pairwise(rings):
        for k in range(segments):
            a, b = low[k % len(low)], low[(k + 1) % len(low)]
            c, d = high[k % len(high)], high[(k + 1) % len(high)]
            faces += [(a, b, d)] * (len(low) > 1) + [(a, d, c)] * (len(high) > 1)
    return np.array(vertices), np.array(faces)


def ring(section, segments=48):
    """Ring about z from its section [(radius, z), ...], anticlockwise in the half plane of positive radius."""
    angle, count = 2 * np.pi * (np.arange(segments) + 0.5) / segments, len(section)
    vertices = [(r * np.cos(a), r * np.sin(a), z) for a in angle for r, z in section]
    faces = []
    for k, place in itertools.product(range(segments), range(count)):
        here, there = k * count, (k + 1) % segments * count
        a, b = here + place, here + (place + 1) % count
        c, d = there + place, there + (place + 1) % count
        faces += [(a, c, d), (a, d, b)]
    return np.array(vertices), np.array(faces)


def ellipse(x0, x1, radius, count, power=0.5):
    """Profile points of a nose from (x0, radius) to the tip (x1, 0); power 0.5 is an ellipse, 1 closer to a cone."""
    t = np.sin(np.linspace(0, np.pi / 2, count))
    return [(x0 + (x1 - x0) * s, radius * (1 - s**2) ** power) for s in t[:-1]] + [(x1, 0.0)]


def hull(points):
    """The convex hull of points as an outward-oriented solid."""
    points = np.asarray(points, float)
    solid = ConvexHull(points)
    corner = points[solid.simplices]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    faces = np.where((normal * solid.equations[:, :3]).sum(1)[:, None] < 0, solid.simplices[:, ::-1], solid.simplices)
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3)


def blade(outline, thickness, bevel):
    """A wing, fin or propeller blade in the xy plane: a convex outline with a sharp edge all round.

    The outline's points are drawn in by `bevel` towards its centre, to the full thickness.
    """
    outline = np.asarray(outline, float)
    centre = outline.mean(axis=0)
    # Each side moves in by `bevel`, so the edge has the same angle all round.
    side = np.roll(outline, -1, axis=0) - outline
    inward = np.stack([-side[:, 1], side[:, 0]], axis=1) / np.linalg.norm(side, axis=1)[:, None]
    inward *= np.sign(((centre - outline) * inward).sum(1))[:, None]
    offset = (outline * inward).sum(1) + bevel
    inner = [np.linalg.solve([inward[k - 1], inward[k]], [offset[k - 1], offset[k]]) for k in range(len(outline))]
    flat = [(x, y, 0.0) for x, y in outline]
    return hull(flat + [(x, y, z) for x, y in inner for z in (-thickness / 2, thickness / 2)])


def sheet(outline):
    """A flat sheet without thickness in the xy plane from its convex outline, anticlockwise [(x, y), ...]."""
    outline = np.asarray(outline, float)
    fan = [(0, corner, corner + 1) for corner in range(1, len(outline) - 1)]
    return np.column_stack([outline, np.zeros(len(outline))]), np.array(fan)


def bar(start, stop, width, height):
    """A straight bar from start to stop; `width` is across, horizontally, `height` in the vertical plane of the bar."""
    start, stop = np.asarray(start, float), np.asarray(stop, float)
    along = (stop - start) / np.linalg.norm(stop - start)
    across = np.cross([0.0, 0.0, 1.0], along)
    across /= np.linalg.norm(across)
    up = np.cross(along, across)
    section = [across * width / 2 * s + up * height / 2 * t for s in (-1, 1) for t in (-1, 1)]
    return hull([end + corner for end in (start, stop) for corner in section])


def box(low, high):
    """The box between two corners."""
    return hull([[(low, high)[(n >> axis) & 1][axis] for axis in range(3)] for n in range(8)])


def place(part, rotate=(0, 0, 0), move=(0, 0, 0)):
    """Turn a part by degrees about x, then y, then z, then move it."""
    vertices, faces = part
    for axis, angle in enumerate(np.radians(rotate)):
        matrix = np.eye(3)
        j, k = (axis + 1) % 3, (axis + 2) % 3
        matrix[[j, j, k, k], [j, k, j, k]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        vertices = vertices @ matrix.T
    return vertices + np.asarray(move, float), faces


def mirrored(part):
    """The mirror image of a part, left for right."""
    return part[0] * [1, -1, 1], part[1][:, ::-1]


def pair(name, part):
    """A part on the left and its mirror image, by their names: {name_left: part, name_right: part}."""
    return {f"{name}_left": part, f"{name}_right": mirrored(part)}


def joined(parts):
    """All parts as one list of vertices and one of triangles, which cross each other where the parts do."""
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    triangles = [triangles + first for (_, triangles), first in zip(parts, firsts, strict=False)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(triangles)


def body(length, radius, nose=0.35, tail=0.15, tail_radius=0.7, power=0.6, segments=40, stretch=(1.0, 1.0)):
    """Body of revolution about x from -length / 2 to length / 2, with a nose and a tail that narrows.

    nose, tail: their shares of the length; tail_radius: of the radius, at the end; power: of the nose, as of `ellipse`.
    """
    half = length / 2
    profile = [(-half, radius * tail_radius), (-half + tail * length, radius)]
    profile += ellipse(half - nose * length, half, radius, 12, power)
    return revolve(profile, segments, stretch)


def panel(root, tip, span, sweep, thickness, inside=0.02, edge=0.3):
    """The left half of a wing in the xy plane: chords `root` about x = 0, and `tip` at y = `span`.

    sweep: degrees of the leading edge; inside: metres that the root lies beyond y = 0, in what it is fixed to, so that
    no edges meet in a mirror plane; edge: the share of the smaller chord over which leading and trailing edges
    are drawn to a point.
    """
    back = root / 2 - span * np.tan(np.radians(sweep))
    outline = [(root / 2, -inside), (back, span), (back - tip, span), (-root / 2, -inside)]
    return blade(outline, thickness, edge * min(root, tip))


def union(*parts):
    """One closed solid of all parts (exact boolean)."""
    import pymeshlab  # takes long to load

    meshes = pymeshlab.MeshSet()
    for vertices, faces in parts:
        meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(faces, np.int32)))
    total = 0
    for part in range(1, len(parts)):
        meshes.generate_boolean_union(first_mesh=total, second_mesh=part)
        total = meshes.current_mesh_id()
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def left_half(solid):
    """The part of a solid with y >= 0, closed by a cap in the plane y = 0 (which the mirror image then removes)."""
    size = 2 * np.abs(solid[0]).max()
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    for vertices, faces in (solid, box((-size, 0.0, -size), (size, size, size))):
        meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(faces, np.int32)))
    meshes.generate_boolean_intersection(first_mesh=0, second_mesh=1)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def symmetric(solid):
    """The left half (y >= 0) of a solid and its mirror image, welded in the plane y = 0: exactly symmetric."""
    vertices, faces = left_half(solid)
    vertices = np.round(vertices / GRID) * GRID
    vertices, index = np.unique(vertices, axis=0, return_inverse=True)
    faces = drop_degenerate(index.reshape(-1)[faces])
    faces = faces[(vertices[faces][:, :, 1] != 0).any(axis=1)]
    both = np.concatenate([vertices, vertices * [1, -1, 1]])
    faces = np.concatenate([faces, faces[:, ::-1] + len(vertices)])
    both, index = np.unique(both + 0.0, axis=0, return_inverse=True)
    return both, drop_degenerate(index.reshape(-1)[faces])


def drop_degenerate(faces):
    """Faces with three different corners."""
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def write_stl(path, mesh):
    """Write (vertices, faces) as binary STL."""
    corner = mesh[0][mesh[1]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    record = np.zeros(len(corner), dtype=[("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
    record["normal"] = normal / np.maximum(length, 1e-30)
    record["corner"] = corner
    header = b"isarflow target, metres, x forward, z up".ljust(80)
    Path(path).write_bytes(header + np.uint32(len(corner)).tobytes() + record.tobytes())
