"""Triangles that are much smaller than needed pulled together, where the surface stays what it is."""

import numpy as np

from mesh import topology
from mesh.arrange import crossings
from mesh.distance import samples
from mesh.edits import Limits, collapse
from mesh.ground import Ground
from mesh.progress import say
from mesh.remesh import Size

MANY = 20_000  # triangles; fewer are not worth the time
FINE = 1 / 100  # wanted edges: what the edits take for an edge, or slivers as wide as a pointed nose could turn over
SHORT, LONG = 1 / 2 / FINE, 1 / FINE  # of these: shorter ones are collapsed, none longer is made
DEVIATION = 1 / 200 / FINE  # of these: how far one collapse may move the surface
OFF, LOST = 1 / 40, 2e-3  # wanted edges, and share of the area: a surface that comes out farther off stays as it was


def thin(vertices, triangles, edge):
    """A surface that needs no triangles much smaller than `edge` metres with fewer, and how far it moves, in metres.

    Corners and tips stay; creases, borders and what is curved keep to a small fraction of `edge`. What has few
    triangles, or would change more than that, or cross itself, stays as it is.
    """
    if len(triangles) <= MANY:
        return vertices, triangles, 0.0
    say(f"thin {len(triangles)} triangles")
    limits = Limits(Size(FINE * edge), SHORT, LONG, DEVIATION, thickness=lambda points: np.zeros(len(points)))
    made = collapse(vertices, triangles, limits)
    off = max(_apart((vertices, triangles), made, edge), _apart(made, (vertices, triangles), edge))
    area = topology.areas(vertices, triangles).sum()
    changed = off > OFF * edge or abs(topology.areas(*made).sum() - area) > LOST * area
    crossed = 0 if changed else _crosses_itself(*made)
    if changed or (crossed and crossed > _crosses_itself(vertices, triangles)):
        return vertices, triangles, 0.0
    return *made, off


def _apart(surface, other, edge):
    """Largest distance in metres from a surface to another, both (vertices, triangles)."""
    return float(Ground(*other).distance(samples(*surface, edge / 2)[0])[0].max())


def _crosses_itself(vertices, triangles):
    """How many pairs of triangles of one piece cross; those of solids that overlap do not count."""
    pairs, piece = crossings(vertices, triangles), topology.components(triangles)[1]
    return int((piece[pairs[:, 0]] == piece[pairs[:, 1]]).sum()) if len(pairs) else 0
