"""Remesh isotropically to a length that may change from place to place; features and boundaries are kept."""

from typing import NamedTuple

import igl
import numpy as np
from scipy.spatial import cKDTree

from isarflow.mesh import topology
from isarflow.mesh.distance import distances
from isarflow.mesh.ground import SAME_SIDE, Ground
from isarflow.mesh.progress import going
from isarflow.mesh.remesh.edits import Limits, collapse, cut_edges, flip, lines
from isarflow.mesh.remesh.misses import GOAL
from isarflow.mesh.remesh.rows import STILL, made_room, open_borders, room, with_row
from isarflow.mesh.repair.arrange import crossings

GRADE = 0.35  # metres by which edges grow for each metre away from where they are short
STEP = 0.7  # from one length of short edges to the next
PASSES = 8
AIM = 1.06  # wanted edges that the edits aim at: the resulting mean is shorter
STEPS = 0.95, 1.06  # the least and the largest factor by which the aim changes if it was missed
MORE = 4  # passes for that
COARSE = 1.4  # of the aim: length to which the first of these passes collapses
SHORT, LONG = 0.8, 1.33  # of the aim: edges outside are collapsed or cut
DEVIATION = 0.2  # wanted edges that one edit may move the surface, seen from a vertex; chords move a quarter of it
TOO_SHORT, STAY = 0.3, 0.05  # wanted edges: shortest edge, and largest move of the surface, while long edges are halved
LEAST_ANGLE = 20.0  # degrees; no vertex moves to make a smaller one
RELAX, SLOW = 0.7, 0.35  # of the way to its neighbours' middle that a vertex moves; behind rows on open borders
EVEN = 5  # moves of the vertices before a row is added
NARROW, WIDER = 0.2, 0.4  # wanted edges: width of the first triangles where no row is, and increase per row
SETTLE = 10  # moves of the vertices behind the row, or to that
P99, LONGEST = 1.345, 1.45  # wanted edges, for 99 % shorter than P99_LIMIT in the end, and all than 1.6
P99_LIMIT = 1.35
# Wanted edges: a mean in this range needs no more passes; power of its error in the aim's; what else shortens P99.
MEAN = 0.965, 0.994, 1, 0.97
ROOMY = 0.99, 0.998, 2, 0.99  # the same of meshes with rows
LEAST_SLOPE = 1e-12  # of the volume
SAG = 3 / 4  # of the distance of a face's centre from a curved surface: mean distance of all its points
OTHER_SIDE = 10  # times the distance of the other side's wall: largest distance of this side's wall
CANCELLED = 0.2  # of the volumes that one side gains and the other loses: a tube's thin wall gains less
ON, STIFF = 1e-6, 1e3  # of its size: a face this near to the source lies on it, and has this weight to stay there
GAIN = 0.7  # of the goal for the area: the most that noses may gain
BLUNT = 0.03, 0.06, 0.1, 0.2, 0.4, 1e3  # values tried for noses: from all the way ahead to none
BORDER_SAG = 2 / 3  # of the distance of an edge's middle from a curved border: mean distance of its points
WAYS = 1, 0.8, 0.6, 0.4, 0.2  # shares tried of the steps that an open surface's chords ask for
NO_LOSS = 1e-4  # of the volume: so little need not be restored, and flat faces do not move


class Size(NamedTuple):
    """Wanted lengths of edges: `edge` metres, and near some places less."""

    edge: float
    finer: tuple = ()  # of (power of STEP, KD tree of the places where edges shall be that much shorter)

    def __call__(self, points):
        """The wanted edge in metres at each of the points (P, 3), (P,)."""
        wanted = np.full(len(points), self.edge)
        for power, tree in self.finer:
            length = self.edge * STEP**power
            reach = (self.edge - length) / GRADE
            apart = tree.query(points, distance_upper_bound=reach)[0]
            wanted = np.minimum(wanted, length + GRADE * np.minimum(apart, reach))
        return wanted

    def shortened(self, points, share):
        """The Size with wanted edges multiplied by `share` (P,) at points (P, 3)."""
        power = np.ceil(np.log(self(points) / self.edge * share) / np.log(STEP) - 1e-9).astype(int)
        finer = {power: tree.data for power, tree in self.finer}
        for number in np.unique(power).tolist():
            finer[number] = np.concatenate([finer.get(number, np.zeros((0, 3))), points[power == number]])
        return Size(self.edge, tuple((number, cKDTree(places)) for number, places in sorted(finer.items())))

    def scaled(self, factor):
        """The Size with all lengths `factor` times as long."""
        return Size(self.edge * factor, self.finer)


def remesh(vertices, triangles, size, solid, axes=(), seamed=False):
    """Remesh a surface, part of a whole `solid`, with edges of the Size, or shorter on average; rims in `axes` stay.

    seamed: it is of several parts; seams between these stay where they are to half an edge, which rows would lengthen.
    """
    ground, whole = Ground(vertices, triangles, axes), Ground(*solid)
    source, aim = (vertices, triangles), AIM * (1.0 if seamed else room(vertices, triangles, size(vertices), axes))
    rows = aim > AIM
    low, high, power, shorter = ROOMY if rows else MEAN
    vertices, triangles = halved(vertices, triangles, size.scaled(aim), axes)
    best, fewest = None, np.inf
    for number in range(PASSES + MORE):
        wanted = size.scaled(aim)
        coarse = size.scaled(aim * COARSE) if number == PASSES else wanted  # a regular start is else only ever halved
        limits = Limits(coarse, SHORT, LONG, DEVIATION, axes, lambda points: whole.clearance(points)[0])
        vertices, triangles = collapse(vertices, triangles, limits)
        vertices, triangles = split(vertices, triangles, wanted, LONG, ground)
        triangles = flip(vertices, triangles, wanted(vertices), DEVIATION, axes)
        vertices = relax(vertices, triangles, wanted(vertices), ground)
        if number < PASSES - 1:
            continue
        made = _finished(vertices, triangles, size, ground, axes, rows)
        mean, most = _ratios(*made, size).mean(), P99
        while number == PASSES + MORE - 1 and mean > high:  # its longest edges are cut where no edit changes it
            most *= shorter
            made = _finished(vertices, triangles, size, ground, axes, rows, most)
            mean = _ratios(*made, size).mean()
        fits = mean <= high
        if best is None or (fits and len(made[1]) < fewest):
            best, fewest = made, len(made[1]) if fits else np.inf
        if fits and mean >= low:
            break
        aim *= np.clip(((low + high) / 2 / mean) ** power, *STEPS) if number > PASSES else 1.0
    vertices, triangles = best
    for axis in axes:
        vertices, triangles = lift_chords(vertices, triangles, source, axis)
    return vertices, triangles


def halved(vertices, triangles, size, axes=()):
    """Halve long edges down to the Size, collapsing short ones each time; needles cut in one go become far too many."""
    triangles, longest = flip(vertices, triangles, size(vertices), STAY, axes), _ratios(vertices, triangles, size).max()
    while longest > 2:
        longest /= 2
        vertices, triangles = split(vertices, triangles, size, max(longest, LONG))
        triangles = flip(vertices, triangles, size(vertices), STAY, axes)
        limits = Limits(size, TOO_SHORT, LONG * longest, STAY, axes, lambda points: np.zeros(len(points)))
        vertices, triangles = collapse(vertices, triangles, limits)
        triangles = flip(vertices, triangles, size(vertices), STAY, axes)
    return vertices, triangles


def fitting(vertices, triangles, size, ground, axes, most=P99, rims=None):
    """Cut edges until few are longer than `most` wanted lengths, and no more than needed; without `rims` inner ones."""
    ratio = np.sort(_ratios(vertices, triangles, size))
    too_long = max(int(np.ceil((ratio > most).sum() - 0.008 * len(ratio))), 0)
    longest = min(LONGEST, ratio[-1 - too_long]) if too_long else LONGEST
    vertices, triangles = split(vertices, triangles, size, longest, ground, rims)
    return vertices, flip(vertices, triangles, size(vertices), DEVIATION, axes)


def _ratios(vertices, triangles, size):
    """Lengths of the edges divided by the wanted ones, (E,)."""
    ends = topology.edges(triangles).ends
    return topology.lengths(vertices, ends) / size(vertices)[ends].mean(axis=1)


def split(vertices, triangles, size, longest, ground=None, rims=None):
    """Cut edges above `longest` wanted lengths, `rims` too; put the cuts on the ground, if one is given."""
    while True:
        going(f"cut long edges of {len(triangles)} triangles")
        ends, sides, count = topology.edges(triangles)
        span = topology.lengths(vertices, ends)
        ratio = span / size(vertices)[ends].mean(axis=1)
        cut = (ratio > longest) & (True if rims is None else (count == 1) == rims)
        if not cut.any():
            return vertices, triangles
        start, stop = vertices[ends].transpose(1, 0, 2)
        # Whole numbers of equal parts on both sides: halving alone would end at any length.
        parts = np.maximum(np.rint(ratio), 2)
        points, feature = start + (parts // 2 / parts)[:, None] * (stop - start), topology.features(vertices, triangles)
        if ground is not None:
            normal = topology.unit(topology.vertex_normals(vertices, triangles)[ends[cut]].sum(axis=1))
            points[cut] = ground.put(points[cut], normal, feature[cut], span[cut] / 3)
        vertices, triangles = cut_edges(vertices, triangles, sides, np.where(cut, ratio, 0), points)


def relax(vertices, triangles, wanted, ground, way=RELAX, longest=np.inf, held=slice(0)):
    """Move vertices of `wanted` (V,) edges on the ground, part of the way to the middle of triangles or features.

    The vertices `held` stay.
    """
    seen = lines(vertices, triangles)
    normal, _, angle = topology.shape(vertices[triangles])
    weight = topology.areas(vertices, triangles) / wanted[triangles].mean(axis=1) ** 2
    middle = vertices[triangles].mean(axis=1)
    moment = np.repeat(np.column_stack([weight[:, None] * middle, weight])[:, None], 3, axis=1)
    total = topology.gathered(triangles, moment, len(vertices))
    target = total[:, :3] / np.maximum(total[:, 3:], topology.TINY)
    line = (seen.count == 2) & ~seen.fixed
    ends = seen.edges.ends[seen.feature]
    target[line] = (topology.gathered(ends, vertices[ends[:, ::-1]], len(vertices)) / 2)[line]
    move, up = way * (target - vertices), topology.vertex_normals(vertices, triangles)
    move[~line] -= ((move * up).sum(axis=1)[:, None] * up)[~line]
    points = ground.put(vertices + move, up, line, wanted)
    points[seen.fixed] = vertices[seen.fixed]
    points[held] = vertices[held]
    ends = seen.edges.ends
    most = np.maximum(longest, (1 + 1e-9) * topology.lengths(vertices, ends))
    for _ in range(10):  # a vertex that would turn or flatten a triangle, or make an edge too long, stays
        new, _, new_angle = topology.shape(points[triangles])
        bad = (new * normal).sum(axis=1) < STILL
        bad |= new_angle < np.minimum(angle, LEAST_ANGLE) - 1e-9
        back = np.unique(np.concatenate([triangles[bad].ravel(), ends[topology.lengths(points, ends) > most].ravel()]))
        if len(back) == 0:
            break
        points[back] = vertices[back]
    return points


def narrowed(vertices, triangles, size, ground, axes):
    """Move vertices so that triangles along open borders, where the current has no limit, are narrow, not shorter."""
    borders = np.sort(open_borders(vertices, triangles, axes)[0], axis=1)
    for _ in range(SETTLE if len(borders) else 0):
        tree, wanted, ends = igl.AABB(), size(vertices), topology.edges(triangles).ends
        tree.init(vertices, borders)
        apart = np.sqrt(tree.squared_distance(vertices, borders, vertices)[0])
        narrow = np.minimum(wanted, NARROW * wanted + WIDER * apart)
        vertices = relax(vertices, triangles, narrow, ground, SLOW, P99 * wanted[ends].mean(axis=1))
        triangles = flip(vertices, triangles, wanted, DEVIATION, axes)
    return vertices, triangles


def _finished(vertices, triangles, size, ground, axes, rows, most=P99):
    """A mesh of few long edges, narrow triangles along open borders: in `rows` of one width, or as far as they move."""
    if not rows:
        return narrowed(*fitting(vertices, triangles, size, ground, axes, most), size, ground, axes)
    borders, _ = open_borders(vertices, triangles, axes)
    ratio = np.sort(topology.lengths(vertices, borders) / size(vertices)[borders].mean(axis=1))
    few = int(ratio.sum()) - len(ratio)  # so many more fit along the borders
    if few > 0:
        vertices, triangles = split(vertices, triangles, size, ratio[-1 - few], ground, rims=True)
    for _ in range(EVEN):
        vertices = relax(vertices, triangles, size(vertices), ground)
        triangles = flip(vertices, triangles, size(vertices), DEVIATION, axes)
    borders, owner = open_borders(vertices, triangles, axes)
    points, corner = made_room(vertices, triangles, size(vertices), ground, borders, owner)
    held, moved = topology.used(borders), (points != vertices).any(axis=1)
    for cuts in (False, True):
        if cuts:
            points, triangles = fitting(points, triangles, size, ground, axes, most, rims=False)
        for _ in range(SETTLE):
            wanted, ends = size(points), topology.edges(triangles).ends
            points = relax(points, triangles, wanted, ground, SLOW, P99 * wanted[ends].mean(axis=1), held)
            triangles = flip(points, triangles, size(points), DEVIATION, axes)
    return with_row(points, triangles, vertices, borders[moved[borders].any(axis=1)], moved, corner, ground)


def lift_chords(vertices, triangles, source, axis):
    """Put middles of inner edges that lie in the mirror plane `axis` where the half `source` passes over them."""
    while True:
        ends, sides, count = topology.edges(triangles)
        chord = (vertices[ends][:, :, axis] == 0).all(axis=1) & (count > 1)
        chord[sides[(vertices[triangles][:, :, axis] == 0).all(axis=1)]] = False  # sides of triangles in the plane
        if not chord.any():
            return vertices, triangles
        points = vertices[ends].mean(axis=1)
        points[chord, axis] += distances(points[chord], *source)
        if (points[chord, axis] == 0).any():
            return vertices, triangles  # the source itself touches its mirror image
        vertices, triangles = cut_edges(vertices, triangles, sides, chord, points)


def restore_volume(vertices, triangles, source, volume, edge, axes):
    """Move vertices outwards so that the mesh has `volume` m^3: chords of a convex surface lie inside it.

    Each vertex moves as the distances of its faces' centres from the closed `source` (vertices, triangles) ask for, and
    noses as far ahead as area, walls and edges (`edge` metres are wanted) allow. Vertices in the planes `axes` stay.
    """
    now = topology.tetrahedra(vertices, triangles).sum()
    if abs(now - volume) < NO_LOSS * abs(volume):
        return vertices
    corners = vertices[triangles]
    depth = -distances(corners.mean(axis=1), *source, signed=True)
    depths, normal = (_own_depth(corners, Ground(*source), depth), depth), topology.normals(corners)
    (own, area), (nearest, _) = (_pushes(vertices, triangles, each, normal, axes) for each in depths)
    for blunt in BLUNT:
        restored = _restored(vertices, triangles, own(blunt), nearest(blunt), area, volume)
        if _is_sound(restored, (vertices, triangles), source, GAIN * GOAL[1], edge, axes):
            break
    return restored


def restore_chords(vertices, triangles, source, edge, axes):
    """Move vertices of an open mesh so that chords are equally inside and outside: see `restore_volume`."""
    corners, ground = vertices[triangles], Ground(*source)
    push, _ = _pushes(vertices, triangles, _own_depth(corners, ground), topology.normals(corners), axes)
    borders, owner = open_borders(vertices, triangles, axes)
    middle = vertices[borders].mean(axis=1)
    along = vertices[borders[:, 1]] - vertices[borders[:, 0]]
    out = np.cross(along, ground.normal[ground.distance(middle)[1]])  # about as long as the edge
    out *= np.sign((out * (middle - corners[owner].mean(axis=1))).sum(axis=1))[:, None]
    away = ((ground.on_line(middle) - middle) * out).sum(axis=1) / np.linalg.norm(along, axis=1)
    ends = np.concatenate([borders[:, [0, 0, 1]], borders[:, [0, 1, 1]]])  # as triangles, for both ends alike
    aside, area = _pushes(vertices, ends, np.tile(away, 2), np.tile(out, (2, 1)), axes)
    step, out = SAG * push(BLUNT[0]), topology.unit(area)
    step += BORDER_SAG * aside(BLUNT[0]) - (step * out).sum(axis=1)[:, None] * out  # tilted faces' part
    for way in WAYS:
        restored = vertices + way * step
        if _is_sound(restored, (vertices, triangles), source, GOAL[1], edge, axes):
            return restored
    return vertices


def _is_sound(vertices, mesh, source, gain, edge, axes):
    """True if moved to `vertices` a mesh gains little area, most edges stay short, and it does not cross itself."""
    triangles, longest = mesh[1], max(P99 * edge, np.percentile(topology.edge_lengths(*mesh), 99))
    kept = topology.areas(vertices, triangles).sum() <= (1 + gain) * topology.areas(*source).sum() / 2 ** len(axes)
    kept &= np.percentile(topology.edge_lengths(vertices, triangles), 99) <= longest
    return kept and not len(crossings(vertices, triangles))


def _restored(vertices, triangles, push, nearest, area, volume):
    """The vertices of `restore_volume`, by steps (V, 3) to the faces' own sides of walls or to the nearest sides."""
    now = topology.tetrahedra(vertices, triangles).sum()
    lost = (push * area).sum(axis=1) < 0

    def volume_at(gaining, losing):
        return topology.tetrahedra(vertices + np.where(lost, losing, gaining)[:, None] * push, triangles).sum()

    slopes = np.array([volume_at(1, 0), volume_at(0, 1)]) - now
    # A thin tube gains outside what it loses inside: its sides move by their mean distance from their own walls.
    if lost.any() and abs(slopes.sum()) < CANCELLED * abs(slopes).sum():
        scales, slope = np.full(2, SAG), 2 * slopes  # both sides take half of what is missing
    else:  # a blade would grow for volume missing elsewhere, if its sides moved by more than its thickness
        push, lost = nearest, (nearest * area).sum(axis=1) < 0
        scales, slope = np.zeros(2), volume_at(1, 1) - now
    if np.abs(slope).min() < LEAST_SLOPE * abs(volume):
        return vertices  # the mesh lies on the source everywhere
    for _ in range(3):  # Newton's method on the volume, which is nearly linear in the scales
        scales = scales + (volume - volume_at(*scales)) / slope
    return vertices + np.where(lost, scales[1], scales[0])[:, None] * push


def _pushes(vertices, triangles, depth, normal, axes):
    """Steps (V, 3) of vertices for faces of twice the area `normal` (T, 3) to go `depth` (T,) m outwards.

    They are a function: at noses by least squares, less for larger `blunt`; planes `axes` hold theirs. Also the sum of
    the normals about each vertex, (V, 3).
    """
    size = np.maximum(np.linalg.norm(normal, axis=1), topology.TINY)[:, None]
    square = ((normal / size)[:, :, None] * normal[:, None]).reshape(-1, 9)
    stiff = np.where(np.abs(depth)[:, None] < ON * np.sqrt(size), STIFF, 1.0)
    of_face = np.concatenate([size, depth[:, None] * normal, square, stiff * square, normal], axis=1)
    around = topology.gathered(triangles, np.repeat(of_face[:, None], 3, axis=1), len(vertices))
    around[:, 1:22] /= np.maximum(around[:, :1], topology.TINY)
    mean, square, matrix = around[:, 1:4], around[:, 4:13].reshape(-1, 3, 3), around[:, 13:22].reshape(-1, 3, 3)
    missing, area = mean - (square @ mean[:, :, None])[:, :, 0], around[:, 22:]
    for axis in axes:
        held = vertices[:, axis] == 0
        mean[held, axis], missing[held], area[held, axis] = 0.0, 0.0, 0.0

    def push(blunt):
        return mean + np.linalg.solve(matrix + blunt * np.eye(3), missing[:, :, None])[:, :, 0]

    return push, area


def _own_depth(corners, ground, depth=None):
    """Depths of triangles' centres beneath the wall of their side, (T,): `depth`, of the nearest, if that is theirs."""
    points, normal = corners.mean(axis=1), topology.shape(corners)[0]
    apart, face = ground.distance(points)
    other = np.arange(len(points))
    if depth is not None:
        other = np.flatnonzero((ground.normal[face] * normal).sum(axis=1) < SAME_SIDE)
    depth = np.zeros(len(points)) if depth is None else depth.copy()
    place = ground.nearest(points[other], normal[other], OTHER_SIDE * apart[other])
    found = np.isfinite(place[:, 0])
    depth[other[found]] = ((place - points[other]) * normal[other]).sum(axis=1)[found]
    return depth
