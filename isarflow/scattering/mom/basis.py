"""RWG basis functions on a surface, its junctions and its mirror planes.

Half an RWG function lives on one triangle t, beside the edge opposite its local vertex i:

    h_ti(r) = l_ti / (2 A_t) (r - v_ti),    div h_ti = l_ti / A_t

with edge length l (m), area A (m^2) and vertex v. An RWG function is the difference of the two halves at an edge
(Rao, Wilton, Glisson, IEEE Trans. AP-30, 1982, eqs. 1-4, up to the sign of the second half). An edge of n triangles
carries n - 1 such differences, which keeps the current continuous at a junction; a free edge carries none.

With mirror planes only one side (the fundamental domain) is meshed. The group G of the planes' reflections splits
the current into parities: for a character chi of G the functions are

    F = sum over g in G of chi(g) g h

and functions of different parities do not couple, so each parity is a system of its own. At an edge in a plane with
chi = -1 a single half is already continuous with its own image; with chi = +1 the current through it must vanish.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from isarflow.core.errors import InputError
from isarflow.mesh import topology

PATCH_TRIANGLES = 330  # triangles of a patch: with its neighbours it fills a tile of the matrix (see `assembly`)
MIRRORED_EDGES = 1e-3  # mean edges between a triangle's middle and its mirror image's, at most
AXES = {"yz": 0, "xz": 1, "xy": 2}  # mirror plane -> the coordinate that changes sign


@dataclass(frozen=True)
class Surface:
    """The triangles of the fundamental domain, ordered in compact patches."""

    vertices: np.ndarray  # (T, 3, 3) float64, m: corner positions of every triangle
    corners: np.ndarray  # (T, 3) int64: corner numbers, equal where triangles touch
    axes: tuple  # coordinates that a reflection of the symmetry group changes, e.g. (1,) for the plane xz
    patches: tuple  # where the patches begin, and T
    numbers: np.ndarray  # (T,) of the triangles in the whole mesh

    @property
    def lengths(self):
        """(T, 3) m: length of the edge opposite each corner."""
        return np.linalg.norm(np.roll(self.vertices, -1, 1) - np.roll(self.vertices, -2, 1), axis=2)

    @property
    def normals(self):
        """(T, 3) unit normals, outward if the mesh is."""
        return topology.unit(topology.normals(self.vertices))

    @property
    def reflections(self):
        """(G, 3) signs of x, y, z under every element of the symmetry group, identity first."""
        signs = np.ones((2 ** len(self.axes), 3))
        signs[:, list(self.axes)] = list(product([1.0, -1.0], repeat=len(self.axes)))
        return signs

    @property
    def parities(self):
        """(G, G) characters: row = parity, column = group element; the even parity first."""
        flips = np.array(list(product([0, 1], repeat=len(self.axes))), int).reshape(2 ** len(self.axes), -1)
        return (-1.0) ** (flips @ flips.T)

    def negative_axes(self, characters):
        """The axes whose reflection alone has a negative character; characters: (G,), of a parity, or of its M."""
        # The reflections in one plane alone are numbers 1, 2 and 4 of the group, the last axis first.
        return [axis for place, axis in enumerate(reversed(self.axes)) if characters[2**place] < 0]


@dataclass(frozen=True)
class Basis:
    """RWG functions of one parity, each as the difference of two half functions, ordered by the smaller triangle.

    Loops (see `normal`) are of more halves: K of them is twice the largest number of triangles at a vertex, and else 2.
    """

    halves: np.ndarray  # (N, K) int64: numbers 3 t + i of the half functions
    signs: np.ndarray  # (N, K): +1, -1, or 0 for no further half; of a loop others
    per_triangle: int = 3  # half functions; 6 where there are magnetic currents, too (see `dielectric`)
    vertices: np.ndarray | None = None  # (N,): number of a loop's vertex, -1 of other functions; None without loops

    def __len__(self):
        return len(self.halves)


def fundamental_domain(vertices, triangles, symmetry, impedances=None):
    """The Surface on the non-negative side of each plane in `symmetry`, e.g. ['xz'].

    vertices: (V, 3) m; triangles: (T, 3); impedances: None or (F, T). Raises InputError if the mesh is not one side and
    its mirror image, or if an image's impedance is another.
    """
    corners = np.asarray(vertices, np.float64)[triangles]
    kept = np.ones(len(triangles), bool)
    for plane in symmetry:
        side = corners[:, :, AXES[plane]]
        upper, lower, inside = (side >= 0).all(1), (side <= 0).all(1), (side == 0).all(1)
        kept &= upper
        if not (upper | lower).all() or upper.sum() != lower.sum():
            raise InputError(
                f"the mesh is not symmetric about the plane {plane}: {upper.sum() - inside.sum()} triangles on one "
                f"side, {lower.sum() - inside.sum()} on the other, {(~(upper | lower)).sum()} across it."
            )
        images = _images(corners[upper & ~inside], corners[lower & ~inside], plane)
        if impedances is not None:
            of_upper, of_lower = impedances[:, upper & ~inside], impedances[:, lower & ~inside]
            differs = (of_upper != of_lower[:, images]).any(0)
            if differs.any():
                place = topology.place(corners[upper & ~inside][differs.argmax()].mean(0))
                raise InputError(
                    f"the materials are not symmetric about the plane {plane}: near {place} the impedance is not that "
                    "of the mirror image; leave the plane out of 'symmetry'."
                )
    patches = _patches(corners[kept].mean(1), -(-kept.sum() // PATCH_TRIANGLES))
    order = np.flatnonzero(kept)[np.concatenate(patches)]
    axes, bounds = sorted({AXES[plane] for plane in symmetry}), np.cumsum([0, *map(len, patches)]).tolist()
    return Surface(corners[order], np.asarray(triangles, np.int64)[order], tuple(axes), tuple(bounds), order)


def _images(upper, lower, plane):
    """Number of each upper triangle's mirror image among the lower ones, (T,). Raises InputError if one has none."""
    middles, images = upper.mean(1), lower.mean(1) * np.where(np.arange(3) == AXES[plane], -1.0, 1.0)
    if len(upper) == 0:
        return np.zeros(0, int)
    limit = MIRRORED_EDGES * np.linalg.norm(upper - np.roll(upper, 1, axis=1), axis=2).mean()
    found = [cKDTree(candidates).query(queried) for queried, candidates in ((middles, images), (images, middles))]
    for apart, _ in found:
        if apart.max() > limit:
            raise InputError(
                f"the mesh is not symmetric about the plane {plane}: the mirror image of its triangle near "
                f"{topology.place(middles[apart.argmax()])} is {apart.max():.3g} m off (at most {limit:.3g} m)."
            )
    return found[0][1]


def rwg(surface, parity, chosen=None):
    """The Basis of one parity, (G,), a row of `surface.parities`; chosen: (T,), its triangles, or None for all."""
    count = len(surface.vertices)
    negative = surface.negative_axes(parity)
    alive, single = np.ones(count, bool) if chosen is None else chosen.copy(), np.zeros((count, 3), bool)
    for axis in negative:
        on_plane = surface.vertices[:, :, axis] == 0
        # A triangle that lies in a plane of negative parity is its own image and cancels.
        alive &= ~on_plane.all(1)
        single |= np.roll(on_plane, -1, 1) & np.roll(on_plane, -2, 1)

    halves = np.flatnonzero(np.repeat(alive, 3))
    edge = np.roll(topology.edges(surface.corners).sides, -1, 1).reshape(-1)  # opposite each corner
    halves = halves[np.argsort(edge[halves], kind="stable")]
    first = np.diff(edge[halves], prepend=-1) != 0
    leader = halves[np.maximum.accumulate(np.where(first, np.arange(len(halves)), 0))]

    alone = single.reshape(-1)[halves]
    pair = ~first & ~alone
    functions = np.concatenate([np.stack([leader[pair], halves[pair]], 1), np.stack([halves[alone]] * 2, 1)])
    signs = np.concatenate([np.tile([1.0, -1.0], (pair.sum(), 1)), np.tile([1.0, 0.0], (alone.sum(), 1))])
    order = np.argsort(functions.min(1), kind="stable")
    return Basis(functions[order], signs[order])


def gram(surface):
    """int h . h' dS between the half functions of each triangle, without their l / 6: (T, 3, 3)."""
    nu = surface.vertices - surface.vertices.mean(1, keepdims=True)
    area = np.linalg.norm(np.cross(nu[:, 1] - nu[:, 0], nu[:, 2] - nu[:, 0]), axis=1) / 2
    mean_square = (nu**2).sum((1, 2)) / 12
    value = mean_square[:, None, None] + np.einsum("tix,tjx->tij", nu, nu)
    return 9 * value / area[:, None, None]


def _patches(points, parts):
    """Points (P, 3) in `parts` compact patches, equal to one point: bisection along the longest side."""

    def bisect(numbers, parts):
        if parts == 1:
            return [numbers]
        part = points[numbers]
        axis = np.argmax(np.ptp(part, axis=0))
        numbers = numbers[np.argsort(part[:, axis], kind="stable")]
        cut = len(numbers) * (parts // 2) // parts
        return bisect(numbers[:cut], parts // 2) + bisect(numbers[cut:], parts - parts // 2)

    return bisect(np.arange(len(points)), parts)


def by_half(places, weights, sizes, count):
    """Functions in which each of `count` half functions takes part, and the weights.

    places: half functions of all parities' functions, (N, K), `sizes` of each parity; weights: also (N, K), 0 for no
    part. Returns where each half function's functions begin, (parities, count + 1), these functions, numbers among the
    N, and their weights.
    """
    first, each = count * np.arange(len(sizes))[:, None], places.shape[1]
    places = (places + np.repeat(first, sizes, axis=0)).reshape(-1)
    order = np.argsort(places, kind="stable")
    order = order[weights.reshape(-1)[order] != 0]
    return np.searchsorted(places[order], first + np.arange(count + 1)), order // each, weights.reshape(-1)[order]
