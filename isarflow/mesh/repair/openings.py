"""Find the openings of a surface, and close small and narrow ones."""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from isarflow.mesh import topology

PARTS = 200  # parts of an opening's rim, at least, whose distance to the rim that they face is measured
LONGER = 1.5  # times the straight distance: way along the rim to a part that faces it; 1.4 around a corner of a square
TINY = 1e-30  # metres: two vertices at one place are a rim, too


class Openings(NamedTuple):
    """The openings of a surface: closed lines of rims. At a vertex of several, rims that face each other are joined."""

    rims: np.ndarray  # (R, 2)
    owner: np.ndarray  # (R,) the triangle of each rim
    number: np.ndarray  # (R,) the opening of each rim
    length: np.ndarray  # (O,) of an opening's rims, in metres
    centre: np.ndarray  # (O, 3)
    area: np.ndarray  # (O,) of the triangles between rims and centre, in m^2
    hole: np.ndarray  # (O,) True where the surface lies around the rims, not between them


def openings(vertices, triangles):
    """The Openings of a surface."""
    rims, owner, side = topology.rims(triangles)
    order = np.argsort(rims, axis=None, kind="stable")
    first, count = np.unique(rims.ravel()[order], return_index=True, return_counts=True)[1:]
    pairs = list(zip(order[first[count == 2]] // 2, order[first[count == 2] + 1] // 2, strict=True))
    for group in (order[k : k + n] for k, n in zip(first[count > 2], count[count > 2], strict=True)):  # at one vertex
        away = vertices[rims.ravel()[group ^ 1]] - vertices[rims.ravel()[group]]
        away /= np.maximum(np.linalg.norm(away, axis=1), TINY)[:, None]
        alike = np.triu(away @ away.T + 2, 1)  # positive for a pair
        while alike.any():
            i, j = np.unravel_index(alike.argmax(), alike.shape)
            pairs.append((group[i] // 2, group[j] // 2))
            alike[[i, j]] = alike[:, [i, j]] = 0
    count, number = topology.groups(np.reshape(pairs, (-1, 2)).astype(int), len(rims))
    start, stop = vertices[rims].transpose(1, 0, 2)
    middle, length = (start + stop) / 2, np.maximum(np.linalg.norm(stop - start, axis=1), TINY)
    total = np.bincount(number, length, count)
    centre = topology.gathered(number[:, None], (middle * length[:, None])[:, None], count) / total[:, None]
    area = np.linalg.norm(np.cross(start - centre[number], stop - centre[number]), axis=1) / 2
    inward = vertices[triangles[owner, side - 1]] - start
    along = (stop - start) / length[:, None]
    inward -= (inward * along).sum(axis=1)[:, None] * along
    inward /= np.maximum(np.linalg.norm(inward, axis=1), TINY)[:, None]
    outward = np.linalg.norm(centre[number] - middle, axis=1) / 2 - ((centre[number] - middle) * inward).sum(axis=1)
    hole = np.bincount(number, outward * length, count) > 0
    return Openings(rims, owner, number, total, centre, np.bincount(number, area, count), hole)


def across(vertices, rims):
    """Median width in metres of an opening with these rims (R, 2), to the nearest places that are LONGER along them."""
    start, stop = vertices[rims].transpose(1, 0, 2)
    length = np.maximum(np.linalg.norm(stop - start, axis=1), TINY)
    parts = np.maximum(np.ceil(length / length.sum() * PARTS), 1).astype(int)
    last = np.cumsum(parts) - 1
    rim, first, count = np.repeat(np.arange(len(rims)), parts), last - parts + 1, last[-1] + 1
    share = (np.arange(count) - first[rim] + 0.5) / parts[rim]
    middle, half = start[rim] + share[:, None] * (stop - start)[rim], (length / parts / 2)[rim]
    way = ((stop - start) / length[:, None])[rim]
    inner = np.flatnonzero(rim[1:] == rim[:-1])  # steps from these parts to the next, and from others to vertices
    names, ends = np.unique(rims, return_inverse=True)
    ends = count + ends.reshape(-1, 2)
    here, there = np.concatenate([inner, first, last]), np.concatenate([inner + 1, *ends.T])
    steps = coo_array((np.concatenate([2 * half[inner], half[first], half[last]]), (here, there)),
                      shape=2 * (count + len(names),)).tocsr()  # fmt: skip
    some = np.arange(0, count, -(-count // (2 * PARTS)))
    width = np.full(len(some), np.inf)
    for k, along in enumerate(dijkstra(steps, directed=False, indices=some)[:, :count]):
        off = middle[some[k]] - middle
        off -= np.clip((off * way).sum(axis=1), -half, half)[:, None] * way
        apart = np.linalg.norm(off, axis=1)
        width[k] = apart[(along - half >= LONGER * apart) & (along > 0)].min(initial=np.inf)
    order = np.argsort(width, kind="stable")  # most of the rim, without its ends, which face each other from far away
    reached = np.cumsum(half[some][order])
    return float(width[order[np.searchsorted(reached, reached[-1] / 2)]])


def pinched(vertices, triangles, narrow, longest):
    """Merge ends of openings up to `narrow` metres wide, with two long edges, rims up to `longest`: as `joins.join`."""
    opened, size = openings(vertices, triangles), len(vertices)
    short = topology.lengths(vertices, opened.rims) <= narrow
    width = 2 * opened.area / opened.length
    slim = (width <= narrow) & (opened.length <= longest) & (np.bincount(opened.number, ~short, len(width)) == 2)
    mesh_edges = topology.edges(triangles)
    inner = mesh_edges.ends[mesh_edges.count > 1] @ [size, 1]
    pairs, widest = [], 0.0
    for opening in np.flatnonzero(slim):
        mine = opened.number == opening
        members = np.unique(opened.rims[mine])
        between = np.isin((members[:, None] * size + members).ravel(), inner).any()
        if not between and len(np.unique(opened.owner[mine])) > 1:  # else a ribbon spans it
            pairs.append(opened.rims[mine & short])
            widest = max(widest, float(width[opening]))
    if not pairs:
        return vertices, triangles, np.arange(size), 0.0
    label = topology.groups(np.concatenate(pairs), size)[1]
    became = np.unique(label, return_index=True)[1][label]
    triangles = became[triangles].astype(triangles.dtype)
    return middles(vertices, became), once(triangles[topology.have_three_corners(triangles)]), became, widest


def close_holes(vertices, triangles, longest, narrow):
    """Close openings with a rim of at most `longest` metres in much larger pieces; count those wider than `narrow`."""
    opened = openings(vertices, triangles)
    piece = topology.components(triangles)[1]
    piece_of = np.zeros(len(vertices), dtype=int)
    piece_of[triangles] = piece[:, None]
    centres, lids, closed = [], [], 0
    for opening in np.flatnonzero(opened.hole & (opened.length <= longest)):
        edges = opened.rims[opened.number == opening]
        members, count = np.unique(edges, return_counts=True)
        of_piece = np.unique(triangles[piece == piece_of[members[0]]])
        width, size = (np.linalg.norm(np.ptp(vertices[some], axis=0)) for some in (members, of_piece))
        if (count != 2).any() or size < 3 * width:
            continue  # the rim of a small sheet, not a hole in a large one
        closed += int(2 * opened.area[opening] > narrow * opened.length[opening])
        if len(edges) == 3:
            lids.append(members)
        else:
            lids += [(*ends, len(vertices) + len(centres)) for ends in edges]
            centres.append(vertices[members].mean(axis=0))
    lids = np.reshape(lids, (-1, 3)).astype(triangles.dtype)
    return np.concatenate([vertices, np.reshape(centres, (-1, 3))]), np.concatenate([triangles, lids]), closed


def once(triangles):
    """Triangles without duplicates, and without both of a pair of duplicates, if that opens nothing."""
    first, (_, sides, count) = topology.first_of_each(triangles), topology.edges(triangles)
    names = topology.triple(triangles, int(triangles.max()) + 1)
    fold = np.isin(names, names[~first]) & (count[sides] % 2 == 0).all(axis=1)
    return triangles[first & ~fold]


def middles(vertices, label):
    """Places of vertices, (V, 3), if each is in the middle of those with its label, (V,)."""
    members = np.maximum(np.bincount(label, minlength=len(vertices)), 1)
    return topology.gathered(label[:, None], vertices[:, None], len(vertices)) / members[:, None]
