"""Join rims that face each other across a crack; close the rest of cracks and small holes."""

import itertools
from typing import NamedTuple

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.progress import going
from isarflow.mesh.repair.boxes import around, near_boxes
from isarflow.mesh.repair.contact import APART
from isarflow.mesh.repair.openings import across, close_holes, middles, once, openings, pinched

SMALL = 3.0  # wanted edges: openings with a rim up to this are closed; a slot resonates at ten, a wavelength
NARROW = 1 / 10  # wanted edges: the largest width of such a small opening that is closed by joining its sides
WARNED = 1 / 15  # wanted edges: rims that face each other across less, but stay apart, are reported
SHUT = 1 / 10  # of its area: a surface whose openings are smaller is reported as one that is nearly closed
LOOKED_AT = 100  # the largest openings; the width of others follows from their area
ROUNDS = 100  # rounds of joins, each at distances up to twice the smallest that is left nearby


class Facing(NamedTuple):
    """Rim vertices and rim edges that face each other."""

    vertex: np.ndarray  # (F,)
    ends: np.ndarray  # (F, 2) of the edge, the nearer one first
    side: np.ndarray  # (F,) the edge as a side of a triangle: side k of triangle t is 3 t + k
    share: np.ndarray  # (F,) of the edge between its nearer end and the vertex's foot on it
    width: np.ndarray  # (F,) metres between vertex and foot
    apart: np.ndarray  # (F,) metres between vertex and nearer end
    alike: np.ndarray  # (F,) True if these two become one, False if the edge is tied to the vertex


def join(vertices, triangles, reach, close, name, small=np.inf, barred=None):
    """Join rims that face each other within `reach` metres, each vertex to the nearest rim, the nearest first nearby.

    A vertex meets the near end of the edge that it faces in their middle, or else the edge is tied to it, and bends.
    Distances that differ by `close` metres are alike. `small`, `barred`: see `facing`. Returns vertices, triangles, the
    vertex that each became, (V,), the number of those that edges were tied to, and the widest gap's width in metres.
    """
    source, size = vertices, len(vertices)
    label, tied, widest, barred = np.arange(size), 0, 0.0, np.zeros(size, dtype=bool) if barred is None else barred
    for _ in range(ROUNDS):
        faced = facing(vertices, triangles, reach, name, barred, small)
        if len(faced.vertex) == 0:
            break
        going(f"join rims at {len(faced.vertex)} places")
        members, least = np.column_stack([faced.vertex, faced.ends]), np.full(size, np.inf)
        np.minimum.at(least, members, faced.width[:, None])
        now = faced.width <= _least(faced, size)[faced.vertex] + close
        now &= faced.width <= np.maximum(close, 2 * least[members].min(axis=1))
        faced = Facing(*(field[now] for field in faced))
        alike = faced.alike
        if alike.any():
            pairs = np.stack([faced.vertex, faced.ends[:, 0]], axis=1)[alike]
            triangles, became = _welded(triangles, pairs[np.argsort(faced.apart[alike], kind="stable")], barred)
            label = became[label]
            vertices = middles(source, label)
        else:
            triangles, count = _tied(triangles, faced)
            tied += count
        widest = max(widest, float(faced.width[alike if alike.any() else slice(None)].max()))
    return vertices, triangles, label, tied, widest


def join_exactly(vertices, triangles, tolerance, close, name):
    """Join rims within `close` metres, but no vertex also within `tolerance`: vertices, triangles, number tied in."""
    faced = facing(vertices, triangles, tolerance, name, np.zeros(len(vertices), dtype=bool))
    least = _least(faced, len(vertices))
    made = join(vertices, triangles, close, close, name, barred=np.isfinite(least) & (least > close))
    return *made[:2], made[3]


def _least(faced, size):
    """Metres from each vertex to the nearest rim that it faces, (size,); infinite if it faces none."""
    least = np.full(size, np.inf)
    np.minimum.at(least, faced.vertex, faced.width)
    return least


def facing(vertices, triangles, reach, name, barred, small=np.inf):
    """The Facing of a surface's rims within `reach` metres, without `barred` vertices (a mask, (V,)).

    Points near along the rim, or through the surface, do not face each other. An opening at most `reach` metres wide
    closes on its own, or with `small` those alone that have rims of at most so many metres.
    """
    rims, owner, side = topology.rims(triangles)
    if len(rims) == 0:
        return Facing(*(np.zeros(shape, dtype=int) for shape in (0, (0, 2), 0)), *np.zeros((3, 0)), np.zeros(0, bool))
    free, opened = ~barred[rims].any(axis=1), openings(vertices, triangles)
    alone = opened.hole & (2 * opened.area <= reach * opened.length)
    if small < np.inf:
        alone = opened.hole & (opened.length <= small)
        free &= alone[opened.number]
    number, loose = opened.number[free], np.unique(opened.rims[~alone[opened.number]])
    rims, owner, side = rims[free], owner[free], side[free]
    border = np.unique(rims)
    pairs = near_boxes(around(vertices[rims], reach), around(vertices[border][:, None]), name)
    edge, vertex = pairs[:, 0], border[pairs[:, 1]]
    size = len(vertices)
    together = np.isin(number[edge] * size + vertex, number[:, None] * size + rims)
    together |= ~alone[number[edge]] | np.isin(vertex, loose)
    edge, vertex = edge[together], vertex[together]
    start, along = vertices[rims[edge, 0]], vertices[rims[edge, 1]] - vertices[rims[edge, 0]]
    share = _foot(vertices[vertex] - start, along)
    width = np.linalg.norm(vertices[vertex] - start - share[:, None] * along, axis=1)
    ends = np.where((share > 0.5)[:, None], rims[edge, ::-1], rims[edge])
    share = np.minimum(share, 1 - share)
    apart = np.linalg.norm(vertices[vertex] - vertices[ends[:, 0]], axis=1)
    shortest = topology.shortest_edges(vertices, triangles)
    around_both = np.minimum(shortest[vertex], shortest[ends[:, 0]])
    alike = apart <= np.minimum(2 * reach, np.maximum(width / APART, APART * around_both))
    alike = (alike | (share == 0)) & (apart <= 2 * reach)
    # Points near through the surface, as along a rim and across a ribbon, do not face each other across a gap.
    mesh_edges = topology.edges(triangles)
    names, inner = mesh_edges.ends @ [size, 1], mesh_edges.count > 1
    to_near, to_far = (np.minimum(vertex, end) * size + np.maximum(vertex, end) for end in ends.T)
    alike &= (width <= reach) & ~np.isin(to_near, names)
    _part(alike, vertices, triangles, owner[edge], vertex, apart / APART / 2)
    good = (width <= reach) & (alike | (share > 0))
    good &= ~np.isin(to_near, names[inner]) & ~np.isin(to_far, names[inner])
    _part(good, vertices, triangles, owner[edge], vertex, width / APART / 2)
    return Facing(*(field[good] for field in (vertex, ends, 3 * owner[edge] + side[edge], share, width, apart, alike)))


def _foot(points, along):
    """Shares of segments `along` (P, 3) up to what is nearest to points (P, 3), both seen from their starts, (P,)."""
    return np.clip((points * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), topology.TINY), 0, 1)


def _part(chosen, vertices, triangles, start, vertex, reach):
    """Unset `chosen` (P,) where a way leads from triangles (P,) to vertices (P,) across edges within reach (P,)."""
    few = np.flatnonzero(chosen)
    start, vertex, reach = start[few], vertex[few], reach[few]
    mesh_edges, size = topology.edges(triangles), len(triangles)
    at_edge, first = np.argsort(mesh_edges.sides, axis=None, kind="stable") // 3, np.cumsum(mesh_edges.count)
    met, new, last = np.zeros(len(start), dtype=bool), np.arange(len(start)) * size + start, np.zeros(0, dtype=np.int64)
    while len(new):  # a round's triangles lead to those of the next or the last round, or to themselves
        pair, triangle = np.divmod(new, size)
        met[pair[(triangles[triangle] == vertex[pair][:, None]).any(axis=1)]] = True
        pair, triangle = pair[~met[pair]], triangle[~met[pair]]
        pair, edge = np.repeat(pair, 3), mesh_edges.sides[triangle].ravel()
        begin, end = vertices[mesh_edges.ends[edge]].transpose(1, 0, 2)
        along, off = end - begin, vertices[vertex[pair]] - begin
        near = np.linalg.norm(off - _foot(off, along)[:, None] * along, axis=1) <= reach[pair]
        pair, edge = pair[near], edge[near]
        count = mesh_edges.count[edge]
        beyond = at_edge[np.arange(count.sum()) + np.repeat(first[edge] - np.cumsum(count), count)]
        last, new = new, np.setdiff1d(np.repeat(pair, count) * size + beyond, np.concatenate([last, new]))
    chosen[few[met]] = False


def _welded(triangles, pairs, barred):
    """Merge the vertices of pairs (P, 2), the first first, each vertex once: triangles, and what each vertex became."""
    size, busy, kept = len(barred), set(), []
    for pair in pairs.tolist():
        if busy.isdisjoint(pair):
            busy.update(pair)
            kept.append(sorted(pair))
    while True:
        became = np.arange(size)
        for low, high in kept:
            became[high] = low
        joined = became[triangles]
        twice = np.isin(topology.triple(joined, size), topology.triple(joined, size)[~topology.first_of_each(joined)])
        if not twice.any():
            return joined.astype(triangles.dtype), became
        torn = [pair for pair in kept if np.isin(pair, triangles[twice]).any()]  # two sheets, one on the other
        barred[np.array(torn).ravel()] = True
        kept = [pair for pair in kept if pair not in torn]


def _tied(triangles, faced):
    """Cut triangles, each along one side, at the vertices that face it: triangles, and the number of these vertices."""
    owner, side = np.divmod(faced.side, 3)
    nearest = np.argsort(faced.width, kind="stable")
    first = faced.side[nearest[np.unique(owner[nearest], return_index=True)[1]]]
    share = np.where(faced.ends[:, 0] == triangles[owner, side], faced.share, 1 - faced.share)
    chains = {}
    for k in np.lexsort((share, faced.side)):
        chains.setdefault(int(faced.side[k]), []).append(int(faced.vertex[k]))
    pieces = []
    for cut in first.tolist():
        a, b, c = np.roll(triangles[cut // 3], -(cut % 3)).tolist()
        pieces += [(*pair, c) for pair in itertools.pairwise([a, *chains[cut], b])]
    whole = np.delete(triangles, first // 3, axis=0)
    return once(np.concatenate([whole, np.array(pieces, dtype=triangles.dtype)])), len(pieces) - len(first)


def close_gaps(vertices, triangles, edge, tolerance, close, name):
    """Close cracks up to `tolerance` metres and small holes: vertices, triangles, numbers of repairs, widest gap."""
    before = topology.rims(triangles)[0]
    counts = dict.fromkeys(("welded_vertices", "split_t_junctions", "closed_cracks", "closed_holes"), 0)
    if len(before) == 0:
        return *topology.compact(vertices, triangles), counts, 0.0
    label, widest = np.arange(len(vertices)), 0.0
    for reach, small in ((tolerance, np.inf), (NARROW * edge, SMALL * edge)):
        vertices, triangles, became, tied, width = join(vertices, triangles, reach, close, name, small)
        label, widest = became[label], max(widest, width)
        vertices, triangles, became, width = pinched(vertices, triangles, reach, small)
        label, widest = became[label], max(widest, width)
        counts["split_t_junctions"] += tied
    counts["welded_vertices"] = len(np.unique(before)) - len(np.unique(label[before]))
    vertices, triangles, counts["closed_holes"] = close_holes(vertices, triangles, SMALL * edge, tolerance)
    before = label[before]
    gone = ~np.isin(before, topology.rims(triangles)[0])
    nodes, index = np.unique(before, return_inverse=True)
    index = index.reshape(-1, 2)
    pieces = topology.groups(index[gone.all(axis=1)], len(nodes))[1]
    counts["closed_cracks"] = max(0, len(np.unique(pieces[index[gone]])) - counts["closed_holes"])
    return *topology.compact(vertices, triangles), counts, widest


def left_open(vertices, triangles, edge, tolerance, name):
    """Sentences that name the openings of a surface that may be meant to be closed: narrow or small ones."""
    border = np.unique(topology.rims(triangles)[0])
    if len(border) == 0:
        return []
    sentences = []
    faced = facing(vertices, triangles, WARNED * edge, name, np.zeros(len(vertices), dtype=bool))
    least = _least(faced, len(vertices))
    near = np.flatnonzero(np.isfinite(least))
    if len(near) > len(border) / 5:
        widest, middle = near[least[near].argmax()], near[np.argsort(least[near])[len(near) // 2]]
        where = f"near {topology.place(vertices[middle])}, and at {len(near)} of {len(border)} vertices of its rims"
        away = f"{least[middle] * 1000:.2g} mm away (at most {least[widest] * 1000:.2g} mm)"
        more = f"more than the {tolerance * 1000:.2g} mm within which they are joined; sew it if it is to be closed"
        sentences.append(f"Its patches do not meet: {where}, another rim is {away}, {more}.")
    opened, area = openings(vertices, triangles), topology.areas(vertices, triangles).sum()
    width = 2 * opened.area / opened.length
    for k in np.argsort(-opened.area, kind="stable")[:LOOKED_AT]:
        apart = across(vertices, opened.rims[opened.number == k])
        width[k] = apart if np.isfinite(apart) else width[k]  # of a rim that has no other side
    spanned = np.minimum(opened.area, width * opened.length / 2)  # for a bent slit the fan of triangles is much larger
    if spanned.sum() < SHUT * area:
        largest = spanned.argmax()
        rims = vertices[opened.rims[opened.number == largest]].mean(axis=1)
        place = rims[np.linalg.norm(rims - opened.centre[largest], axis=1).argmin()]
        which = f"the largest of {len(opened.area)} openings, near {topology.place(place)}"
        wide = f"is about {width[largest] * 1000:.2g} mm wide and has a rim of {opened.length[largest] * 1000:.3g} mm"
        sentences.append(f"It is nearly closed, but open: {which}, {wide}. If it is a solid, close it.")
    return sentences
