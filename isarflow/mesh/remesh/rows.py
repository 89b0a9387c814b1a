"""Rows of narrow triangles along open borders, where the current has no limit."""

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.remesh.edits import lines

STILL = 0.8  # cosine of the angle by which a moved vertex may turn a triangle
NARROW = 0.25  # wanted edges: width of the row of triangles on open borders
NARROWER = 1, 0.7, 0.5, 0  # shares of that, tried where it leaves the triangles behind too little
LEFT = 0.35  # of the height of a triangle: the least that the row may leave
MITRE = 2.0  # widths of the row: the most that a corner moves
ROOM, MOST_ROOM = 0.6, 1.13  # factor of the aim for rows: its growth with the borders over the area in edges, its most
STRIP = 0.5  # edges of borders over the area in edges: on narrower faces a row costs a third more unknowns


def room(vertices, triangles, wanted, axes):
    """Factor by which edges may be longer than `wanted` (V,) where rows add short ones, for as many in all.

    It is 1 where there shall be no rows: where most borders are of faces, between creases, that are too narrow.
    """
    borders, owner = open_borders(vertices, triangles, axes)
    pairs = topology.side_pairs(topology.edges(triangles), ~topology.features(vertices, triangles)) // 3
    count, face = topology.groups(pairs, len(triangles))
    length = topology.lengths(vertices, borders) / wanted[borders].mean(axis=1)
    area = topology.areas(vertices, triangles) / wanted[triangles].mean(axis=1) ** 2
    rim, most = np.bincount(face[owner], length, count), STRIP * np.bincount(face, area, count)
    rows = rim[rim <= most].sum() >= rim.sum() / 2
    return min(1 + ROOM * length.sum() / area.sum(), MOST_ROOM) if rows else 1.0


def open_borders(vertices, triangles, axes):
    """Edges with one triangle, (R, 2), as this runs, and that, (R,), except those in the mirror planes `axes`."""
    _, owner, side = topology.rims(triangles)
    borders = np.stack([triangles[owner, side], triangles[owner, (side + 1) % 3]], axis=1)
    for axis in axes:
        beside = vertices[:, axis] != 0
        is_open = beside[borders].any(axis=1) | ~beside[triangles[owner]].any(axis=1)
        borders, owner = borders[is_open], owner[is_open]
    return borders, owner


def made_room(vertices, triangles, wanted, ground, borders, owner):
    """Places of the vertices (V, 3), on `borders` a row's width inwards, and which of these are corners."""
    step, on_line = _inwards(vertices, triangles, borders, owner)
    corner = on_line | lines(vertices, triangles).fixed
    normal, height, _ = topology.shape(vertices[triangles])
    up, goes = topology.vertex_normals(vertices, triangles), (step != 0).any(axis=1)
    level = np.zeros(len(vertices), dtype=int)
    while True:
        width = NARROW * np.array(NARROWER)[level] * wanted
        points = ground.put(vertices + width[:, None] * step, up, on_line, wanted)
        stays = ~goes | (width == 0)
        points[stays] = vertices[stays]
        new, left, _ = topology.shape(points[triangles])
        bad = ((new * normal).sum(axis=1) < STILL) | (left < LEFT * height)
        back = topology.used(triangles[bad])
        back = back[~stays[back]]
        if len(back) == 0:
            return points, corner
        level[back] += 1


def _inwards(vertices, triangles, borders, owner):
    """Steps (V, 3) of vertices of `borders` to be one metre from all of these, and whether they go along a feature.

    Vertices that are not of borders, or where several sheets or creases meet there, stay.
    """
    size, edges = len(vertices), topology.edges(triangles)
    other = ~np.isin(edges.ends @ [size, 1], np.sort(borders) @ [size, 1]) & topology.features(vertices, triangles)
    courses = edges.ends[other]
    along = vertices[borders[:, 1]] - vertices[borders[:, 0]]
    inward = topology.unit(np.cross(topology.shape(vertices[triangles[owner]])[0], along))
    inward = topology.gathered(borders, np.repeat(inward[:, None], 2, axis=1), size)
    course = topology.gathered(courses, vertices[courses[:, ::-1]] - vertices[courses], size)
    many, creases = (np.bincount(ends.ravel(), minlength=size) for ends in (borders, courses))
    way = topology.unit(np.where((creases == 1)[:, None], course, inward))
    far = many / np.maximum((inward * way).sum(axis=1), many / MITRE + topology.TINY)
    goes = (many > 0) & ((creases == 1) | ((creases == 0) & (many == 2)))
    return np.where(goes, far, 0.0)[:, None] * way, creases == 1


def with_row(points, triangles, vertices, borders, moved, corner, ground):
    """Close the gap between `borders` (R, 2) and where they were, in `vertices`, by two triangles each."""
    span, corner = topology.lengths(vertices, borders) / 3, np.flatnonzero(moved & corner)
    middle = vertices[borders].mean(axis=1)
    middle = ground.put(middle, np.zeros_like(middle), span > 0, span)
    (a, b), number = borders.T, len(points) + np.arange(len(borders))
    at = np.full((3, len(vertices)), -1)  # of each vertex: the middles before and after it, and the corner
    at[0, b], at[1, a], at[2, corner] = number, number, len(points) + len(borders) + np.arange(len(corner))
    along = np.flatnonzero(moved & (at[2] < 0))
    corners = (b, a, number), (at[1, along], along, at[0, along]), (number, a, at[2, a]), (at[2, b], b, number)
    row = np.concatenate([np.stack(three, axis=1) for three in corners])
    points = np.concatenate([points, middle, vertices[corner]])
    return points, np.concatenate([triangles, row[(row >= 0).all(axis=1)]]).astype(np.int32)
