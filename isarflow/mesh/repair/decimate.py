"""Reduce a CAD file's triangles where they are much smaller than needed, without moving the surface."""

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.distance import loaded
from isarflow.mesh.ground import Ground, samples
from isarflow.mesh.progress import say
from isarflow.mesh.repair.arrange import crossings

FEW = 20_000  # triangles; no surface is thinned to fewer
SHARES = 1 / 2, 1 / 3, 1 / 5, 1 / 8  # wanted edges: length that a surface is thinned to, or else less
FLAT = 1e-6  # MeshLab's weight of round triangles against the surface's place; at its default 1e-3 tips are cut off
OFF, LOST = 1 / 40, 2e-3  # wanted edges, and share of the area, by which a thinned surface may differ


def thin(vertices, triangles, edge):
    """Thin a surface to the triangles that edges of a share of `edge` metres need, or more; also metres it moved by."""
    whole, area = (vertices, triangles), topology.areas(vertices, triangles).sum()
    for share in SHARES:
        enough = max(int(area / (np.sqrt(3) / 4 * (share * edge) ** 2)), FEW)
        if len(triangles) <= 2 * enough:
            break
        say(f"thin {len(triangles)} triangles to {enough}")
        made = _decimated(vertices, triangles, enough)
        pairs = (whole, made), (made, whole)
        off = max(float(Ground(*to).distance(samples(*of, edge / 2)[0])[0].max()) for of, to in pairs)
        if off > OFF * edge or abs(topology.areas(*made).sum() - area) > LOST * area:
            continue
        crossed = _crosses_itself(*made)  # solids would open when they are united
        if crossed == 0 or crossed <= _crosses_itself(*whole):
            return *made, off
    return vertices, triangles, 0.0


def _decimated(vertices, triangles, count):
    """The surface with `count` triangles, or more where its topology asks for them."""
    meshes = loaded(vertices, triangles)
    kept = dict.fromkeys(("preserveboundary", "preservenormal", "preservetopology", "planarquadric"), True)
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=count, planarweight=FLAT, autoclean=False, **kept)
    mesh = meshes.current_mesh()
    return topology.compact(mesh.vertex_matrix(), mesh.face_matrix())


def _crosses_itself(vertices, triangles):
    """Number of pairs of triangles of one piece that cross; those of solids that overlap do not count."""
    pairs, piece = crossings(vertices, triangles), topology.components(triangles)[1]
    return int((piece[pairs[:, 0]] == piece[pairs[:, 1]]).sum()) if len(pairs) else 0
