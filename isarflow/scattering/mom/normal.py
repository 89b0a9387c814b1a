"""The current across a thin dielectric sheet (TDS).

A field E_n along the normal n polarizes the sheet across. As D_n is continuous, its whole thickness t has a current
J_n = j omega eps_0 (eps_r - 1) t E_n / eps_r in A/m (Chiang, Chew, IEEE Trans. AP-54, 2006). A layer of normal dipoles
is a layer of magnetic current M = n x grad J_n / (j omega eps_0) (Mayes, Proc. IRE 46, 1958), so that the operators of
`dielectric` serve. With J_n linear between vertices, M / eta is a sum of b_v g_v over the vertices, of loops

    g_v = n x grad lambda_v;   n x grad lambda_i = h_k / l_k - h_j / l_j

of half RWG functions on a triangle of corners i, j, k, counter-clockwise about n. Then J_n is the sum of j k b_v
lambda_v, and by parts int lambda_v E_n dS = (j eta / k) int g_v . H dS. In the scale of `dielectric` loops have

    -(z_vw + 4 pi k / (j eta) int Z_n lambda_v lambda_w dS),    Z_n = E_n / J_n = eps_r Z

with Z of `sheet`. J_n is 0 where the sheet ends, at a junction and at a seam with anything else: there is no loop.
"""

import numpy as np
from scipy import sparse

from isarflow.mesh import topology
from isarflow.scattering.materials import ETA
from isarflow.scattering.mom.basis import Basis


def loops(surface, characters, chosen):
    """Return the Basis of loops of one parity on `chosen` triangles, (T,); characters: (G,), of M.

    Its `vertices` are the corner numbers; functions are times the mean edge, so that they are as large as RWG's.
    """
    corners = surface.corners
    inner = np.ones(corners.max() + 1, bool)
    # The reflections in one plane alone are numbers 1, 2 and 4 of the group, the last axis first.
    planes = {axis: characters[2**place] < 0 for place, axis in enumerate(reversed(surface.axes))}
    sides = topology.edges(corners).sides
    at_edge = np.bincount(sides.reshape(-1))
    # Both triangles of an edge go along it in opposite directions if their normals are on one side.
    turn = np.zeros(len(at_edge))
    np.add.at(turn, sides, np.sign(np.roll(corners, -1, 1) - corners))
    whole = (at_edge == 2) & (turn == 0)
    inner[corners[~chosen]] = False
    ends = np.stack([corners, np.roll(corners, -1, 1)], 2)
    closed = whole[sides]  # edges beyond which the sheet goes on, (T, 3)
    for axis, is_negative in planes.items():
        on_plane = surface.vertices[:, :, axis] == 0
        lies_in, along = on_plane.all(1), on_plane & np.roll(on_plane, -1, 1)
        if is_negative:  # the normal component of a loop's current crosses the plane
            closed = np.where(along & ~lies_in[:, None], at_edge[sides] == 1, closed)
            inner[corners[lies_in]] = False
        else:
            inner[corners[on_plane & ~lies_in[:, None]]] = False
    inner[ends[~closed]] = False

    triangle, corner = np.nonzero(inner[corners])
    order = np.argsort(corners[triangle, corner], kind="stable")
    triangle, corner = triangle[order], corner[order]
    vertices, starts, many = np.unique(corners[triangle, corner], return_index=True, return_counts=True)
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
    for basis in entries.bases:
        triangle, half = np.divmod(basis.halves[:, 0], basis.per_triangle)
        scale = np.abs(basis.signs[:, 0]) * lengths[triangle, half % 3]  # of a loop
        of_vertex = np.full(surface.corners.max() + 1, -1)
        is_loop = basis.vertices >= 0
        of_vertex[basis.vertices[is_loop]] = np.flatnonzero(is_loop)
        numbers = of_vertex[surface.corners]
        rows, cols = np.broadcast_arrays(numbers[:, :, None], numbers[:, None])
        there = (rows >= 0) & (cols >= 0)
        rows, cols = rows[there], cols[there]
        values = shares[there] * scale[rows] * scale[cols]
        result.append(sparse.csr_array((values, (rows, cols)), 2 * (len(basis),)))
    return result
