"""The current across a thin dielectric sheet (TDS).

A field E_n along the normal n polarizes the sheet across. As D_n is continuous, its whole thickness t has a current
J_n = j omega eps_0 (eps_r - 1) t E_n / eps_r in A/m (Chiang, Chew, IEEE Trans. AP-54, 2006). A layer of normal dipoles
is a layer of magnetic current M = n x grad J_n / (j omega eps_0) (Mayes, Proc. IRE 46, 1958), so that the operators of
`dielectric` serve. With J_n linear between vertices, M / eta is a sum of b_v g_v over the vertices, of loops

    g_v = n x grad lambda_v;   n x grad lambda_i = h_k / l_k - h_j / l_j

of half RWG functions on a triangle of corners i, j, k, counter-clockwise about n. Then J_n is the sum of j k b_v
lambda_v, and by parts int lambda_v E_n dS = (j eta / k) int g_v . H dS. In the scale of `dielectric` loops have

    -(z_vw + 4 pi k / (j eta) int Z_n lambda_v lambda_w dS),    Z_n = E_n / J_n = eps_r Z

with Z of `sheet`. J_n is 0 where the sheet ends, at a junction and at a seam with what is no dielectric: there is no
loop. It is continuous across a seam of two dielectrics. Normals of neighbours must be on one side.
"""

import numpy as np
from scipy import sparse

from isarflow.mesh import topology
from isarflow.scattering.materials import ETA
from isarflow.scattering.mom.basis import Basis

MOST_TRIANGLES = 32  # of a loop: a vertex of more has none, as tiles of the matrix have room for few such functions


def loops(surface, characters, chosen):
    """Return the Basis of loops of one parity on `chosen` triangles, (T,); characters: (G,), of M.

    Its `vertices` are numbers of `_fans`. Functions are times the mean edge, so that they are as large as RWG's.
    """
    fans, at_edge, goes_on = _fans(surface.corners)
    across = np.zeros(goes_on.shape, int)  # planes that a sheet meets at an edge, and crosses with its image
    has_loop = np.bincount(fans.reshape(-1)) <= MOST_TRIANGLES
    has_loop[fans[~chosen]] = False
    negative = surface.negative_axes(characters)
    for axis in surface.axes:
        on_plane = surface.vertices[:, :, axis] == 0
        lies_in = on_plane.all(1)[:, None]
        across += on_plane & np.roll(on_plane, -1, 1) & ~lies_in
        # J_n is the same at the image if M, an axial vector, changes sign; if not, it is 0 in the plane. A triangle in
        # the plane is its own image.
        has_loop[fans[lies_in & on_plane if axis in negative else on_plane & ~lies_in]] = False
    goes_on = np.where(across > 0, (across == 1) & (at_edge == 1), goes_on)
    has_loop[np.stack([fans, np.roll(fans, -1, 1)], 2)[~goes_on]] = False

    triangle, corner = np.nonzero(has_loop[fans])
    order = np.argsort(fans[triangle, corner], kind="stable")
    triangle, corner = triangle[order], corner[order]
    vertices, starts, many = np.unique(fans[triangle, corner], return_index=True, return_counts=True)
    of_loop = np.repeat(np.arange(len(vertices)), many)
    place = np.arange(len(triangle)) - starts[of_loop]
    halves = np.tile((3 * triangle[starts] + corner[starts])[:, None], 2 * many.max(initial=1))
    signs, lengths = np.zeros(halves.shape), surface.lengths
    for step, sign in ((2, 1.0), (1, -1.0)):
        opposite = (corner + step) % 3
        column = 2 * place + step - 1
        halves[of_loop, column] = 3 * triangle + opposite
        signs[of_loop, column] = sign * lengths.mean() / lengths[triangle, opposite]
    return Basis(halves, signs, vertices=vertices)


def _fans(corners):
    """Return the fan of triangles round a vertex that each corner is of, (T, 3), and of each triangle's sides, (T, 3):

    of how many triangles its edge is, and whether it is of two whose normals are on one side. Fans that have no such
    edge in common, as of two cones that touch in their tips, are apart.
    """
    edges = topology.edges(corners)
    is_whole = (edges.count == 2) & ~topology.turned(corners, edges)
    one, other = topology.side_pairs(edges, is_whole).T  # side k is from corner k to the next one
    after = [side // 3 * 3 + (side + 1) % 3 for side in (one, other)]
    pairs = np.concatenate([np.stack([one, after[1]], 1), np.stack([after[0], other], 1)])
    _, fans = topology.groups(pairs, corners.size)
    return fans.reshape(corners.shape), edges.count[edges.sides], is_whole[edges.sides]


def terms(entries, impedance):
    """Return for each parity the sparse matrix that Z_n adds, in the scale of `dielectric`.

    entries: of the operator; impedance: Z_n, (T,), ohm a square, 0 where there is no normal current.
    """
    surface = entries.surface
    area = np.linalg.norm(topology.normals(surface.vertices), axis=1) / 2
    weight = -4 * np.pi * entries.wavenumber / (1j * ETA) * impedance * area / 12
    for axis in surface.axes:  # a triangle in a mirror plane is its own image: its functions count twice
        weight = weight * np.where((surface.vertices[:, :, axis] == 0).all(1), 2, 1)
    shares, result, lengths = weight[:, None, None] * (1 + np.eye(3)), [], surface.lengths
    fans, *_ = _fans(surface.corners)
    for basis in entries.bases:
        triangle, half = np.divmod(basis.halves[:, 0], basis.per_triangle)
        scale = np.abs(basis.signs[:, 0]) * lengths[triangle, half % 3]  # of a loop
        of_vertex = np.full(fans.max() + 1, -1)
        is_loop = basis.vertices >= 0
        of_vertex[basis.vertices[is_loop]] = np.flatnonzero(is_loop)
        numbers = of_vertex[fans]
        rows, cols = np.broadcast_arrays(numbers[:, :, None], numbers[:, None])
        there = (rows >= 0) & (cols >= 0)
        rows, cols = rows[there], cols[there]
        values = shares[there] * scale[rows] * scale[cols]
        result.append(sparse.csr_array((values, (rows, cols)), 2 * (len(basis),)))
    return result
