"""CAD files of many makers' habits: fans, fine exports, capped halves, rivets, lofts with slivers, patches, odd shells.

`HABITS` maps a name to a Habit: a function that makes (vertices (V, 3) in metres, triangles (T, 3)), the highest
frequency, mirror planes, and the volume in m^3 that the solid really has, where that is known.
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, Delaunay
from shapes_made import cone, cube, fine_cube, lofted, soup, sphere, together, torus, tube
from vehicles_made import body, drawn, moved, plan_wing, uav

from isarflow.mesh import topology


class Habit(NamedTuple):
    """A CAD file and what is known of it."""

    make: object  # () -> vertices, triangles
    frequency: float = 1.0  # GHz
    symmetry: tuple = ()
    volume: float | None = None  # m^3


def revolved(profile, sectors):
    """A closed body about the x axis of a profile (N, 2) of x and radius; its ends, on the axis, are polar fans."""
    angle = 2 * np.pi * np.arange(sectors) / sectors
    x, radius = np.asarray(profile, float)[1:-1].T
    rings = np.stack(
        [np.repeat(x[:, None], sectors, 1), radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)], -1
    )
    k, after, size = np.arange(sectors), (np.arange(sectors) + 1) % sectors, len(x) * sectors
    faces = []
    for start in range(0, size - sectors, sectors):
        a, b, c, d = start + k, start + after, start + sectors + k, start + sectors + after
        faces += [np.stack([a, b, d], 1), np.stack([a, d, c], 1)]
    faces.append(np.stack([0 * k + size, after, k], 1))
    faces.append(np.stack([0 * k + size + 1, size - sectors + k, size - sectors + after], 1))
    tips = [[profile[0][0], 0, 0], [profile[-1][0], 0, 0]]
    vertices, triangles = np.concatenate([rings.reshape(-1, 3), tips]), np.concatenate(faces)
    return vertices, triangles if topology.tetrahedra(vertices, triangles).sum() > 0 else triangles[:, ::-1]


def ogive(count, length=0.3, radius=0.04):
    """The profile of a tangent ogive with a flat base."""
    x, circle = np.linspace(0, length, count), (radius**2 + length**2) / (2 * radius)
    return [(0.0, 0.0), *zip(x[:-1], np.sqrt(circle**2 - x[:-1] ** 2) + radius - circle, strict=True), (length, 0.0)]


def lens(count, radius=0.12, height=0.03):
    """The profile of a lens with a sharp rim: two caps, x is its axis."""
    r = radius * np.sin(np.linspace(0, np.pi / 2, count // 2))
    x = height * (1 - (r / radius) ** 2)
    return [*zip(-x, r, strict=True), *zip(x[-2::-1], r[-2::-1], strict=True)]


def ellipsoid(count, length=0.2, radius=0.08):
    angle = np.linspace(0, np.pi, count)
    return np.stack([-length / 2 * np.cos(angle), radius * np.sin(angle)], axis=1)


def capped(points, grid):
    """The part of a convex body's vertices above z = 0, closed by a flat cap with a point every `grid` metres."""
    hull = ConvexHull(points).simplices
    edges = np.unique(np.sort(hull[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0)
    height = points[:, 2]
    edges = edges[height[edges[:, 0]] * height[edges[:, 1]] < 0]
    share = height[edges[:, 0]] / (height[edges[:, 0]] - height[edges[:, 1]])
    rim = points[edges[:, 0]] + share[:, None] * (points[edges[:, 1]] - points[edges[:, 0]])
    rim[:, 2] = 0
    solid = np.concatenate([rim, points[height > 0]])
    shell = ConvexHull(solid)
    outward = np.linalg.det(solid[shell.simplices] - solid.mean(axis=0)) > 0
    faces = np.where(outward[:, None], shell.simplices, shell.simplices[:, ::-1])
    faces = faces[shell.equations[:, 2] > -1 + 1e-9]
    steps = np.arange(-np.abs(rim).max(), np.abs(rim).max(), grid)
    inner = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    inner = inner[np.linalg.norm(inner, axis=1) < np.linalg.norm(rim, axis=1).min() - grid / 2]
    cap = np.arange(len(rim))
    flat = Delaunay(np.concatenate([rim[:, :2], inner]))
    cap = np.concatenate([cap, len(solid) + np.arange(len(inner))])[flat.simplices]
    vertices = np.concatenate([solid, np.column_stack([inner, np.zeros(len(inner))])])
    up = np.linalg.det(vertices[cap][:, :, :2][:, 1:] - vertices[cap][:, :1, :2]) > 0
    return vertices, np.concatenate([faces, np.where(up[:, None], cap[:, ::-1], cap)])


def halves(subdivisions, grid, gap=0.0, turn=0.0):
    """A sphere of 0.15 m cut in two closed halves with finely triangulated caps, the second turned about the axis."""
    points = sphere(0.15, subdivisions)[0] + [0, 0, 1e-4]
    upper, lower = capped(points, grid), capped(points * [1, -1, -1], grid)
    c, s = np.cos(turn), np.sin(turn)
    down = np.array([[c, s, 0], [s, -c, 0], [0, 0, -1]])
    return together(upper, (lower[0] @ down - [0, 0, gap], lower[1]))


def brick(lengths, at=(0, 0, 0)):
    vertices, triangles = cube()
    return vertices * lengths + at, triangles


def strewn(part, count, base=(0.2, 0.2, 0.2), seed=0):
    """A box with `count` copies of a part (its origin on the surface, z outward) on its six faces."""
    random, parts = np.random.default_rng(seed), [brick(base)]
    for k in range(count):
        axis, side = k % 3, 1 - 2 * (k // 3 % 2)
        at = random.uniform(-0.45, 0.45, 3) * base
        shape = np.roll(part[0], axis + 1, axis=1) * np.where(np.arange(3) == axis, side, 1)
        at[axis] = side * base[axis] / 2
        parts.append((shape + at, part[1] if side > 0 else part[1][:, ::-1]))
    return together(*parts)


def prism(radius, low, high, count):
    """An upright prism of `count` sides."""
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return lofted([np.column_stack([ring, np.full(count, z)]) for z in (low, high)])


def stack(lengths, parts, cuts):
    """A box of `parts` (3,) equal closed boxes side by side, each finely triangulated."""
    lengths, parts = np.asarray(lengths, float), np.asarray(parts)
    vertices, triangles = fine_cube(1.0, cuts)
    places = [(np.array(k) - (parts - 1) / 2) * lengths / parts for k in np.ndindex(*parts)]
    return together(*[(vertices * lengths / parts + place, triangles) for place in places])


def grid_patch(corners, n, m):
    """A flat patch between four corners of n x m cells, every triangle with corners of its own."""
    a, b, c, d = map(np.asarray, corners)
    u, w = np.linspace(0, 1, n + 1)[:, None, None], np.linspace(0, 1, m + 1)[None, :, None]
    points = (1 - u) * (1 - w) * a + u * (1 - w) * b + u * w * c + (1 - u) * w * d
    low = [points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]]
    triangles = [np.stack([low[0], low[1], low[2]], 2), np.stack([low[0], low[2], low[3]], 2)]
    triangles = np.concatenate([t.reshape(-1, 3, 3) for t in triangles])
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def patched_box(lengths, divisions):
    """A box of six patches, each divided its own way."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * lengths
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return together(*[grid_patch(corners[list(q)], *cells) for q, cells in zip(quads, divisions, strict=True)])


def octants(counts, radius=0.15):
    """A sphere of eight octants, each sampled apart, every triangle with corners of its own."""
    parts = []
    for signs, n in zip(itertools.product((1, -1), repeat=3), counts, strict=True):
        at = {(i, j): k for k, (i, j) in enumerate((i, j) for i in range(n + 1) for j in range(n + 1 - i))}
        points = np.sin(np.array([[i, j, n - i - j] for i, j in at]) / n * np.pi / 2)
        points *= radius * np.array(signs) / np.linalg.norm(points, axis=1)[:, None]
        faces = [(at[i, j], at[i + 1, j], at[i, j + 1]) for i in range(n) for j in range(n - i)]
        faces += [(at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i in range(n) for j in range(n - i - 1)]
        faces = np.array(faces)
        parts.append(soup(points, faces if np.prod(signs) > 0 else faces[:, ::-1]))
    return together(*parts)


def rounded(shape, digits=6):
    """As text with so many digits after the point holds it."""
    return np.round(shape[0], digits), shape[1]


def twisted(count, sections):
    """A blade through ellipses that turn by 60 degrees."""
    angle = 2 * np.pi * np.arange(count) / count
    rings = []
    for share in np.linspace(0, 1, sections):
        turn = np.radians(60 * share)
        x, z = 0.03 * (1 - 0.4 * share) * np.cos(angle), 0.003 * np.sin(angle)
        rings.append(np.stack([x * np.cos(turn) - z * np.sin(turn), 0 * x + 0.25 * share,
                               x * np.sin(turn) + z * np.cos(turn)], axis=1))  # fmt: skip
    vertices, triangles = lofted(rings)
    return vertices, triangles if topology.tetrahedra(vertices, triangles).sum() > 0 else triangles[:, ::-1]


def corner_fan(radius, thickness, count):
    """A flat disc whose faces are fans from one vertex of their rim, as ear clipping leaves them."""
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(count, z)]) for z in (-thickness / 2, thickness / 2)])
    k = np.arange(count)
    sides = [np.stack([k, (k + 1) % count, count + (k + 1) % count], 1),
             np.stack([k, count + (k + 1) % count, count + k], 1)]  # fmt: skip
    fan = np.stack([0 * k[1:-1], k[1:-1], k[2:]], axis=1)
    return vertices, np.concatenate([*sides, fan[:, ::-1], fan + count])


def turned_at_random(shape, seed=0):
    flip = np.random.default_rng(seed).random(len(shape[1])) < 0.5
    return shape[0], np.where(flip[:, None], shape[1][:, ::-1], shape[1])


def halved(shape, times):
    """Each triangle cut in four, `times` times, on its own plane."""
    for _ in range(times):
        ends, sides, _ = topology.edges(shape[1])
        middle = len(shape[0]) + sides
        a, b, c = shape[1].T
        ab, bc, ca = middle.T
        faces = [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        shape = np.concatenate([shape[0], shape[0][ends].mean(axis=1)]), np.concatenate(faces)
    return shape


def bolt_in_hole(sides, turn, gap):
    """A plate with a round hole and a bolt in it, both as prisms of so many sides, the bolt's turned by a share."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = 0.005 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    side = np.maximum(np.abs(ring).max(axis=1), 1e-9)[:, None]
    outer = ring / side * 0.04
    rings = [(outer, 0.0), (outer, 0.02), (ring, 0.02), (ring, 0.0)]
    vertices = np.concatenate([np.column_stack([points, np.full(sides, z)]) for points, z in rings])
    here = np.arange(4 * sides).reshape(4, sides)
    quads = np.stack([here, np.roll(here, -1, 1), np.roll(np.roll(here, -1, 1), -1, 0), np.roll(here, -1, 0)], -1)
    quads = quads.reshape(-1, 4)
    plate = vertices, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    if topology.tetrahedra(*plate).sum() < 0:
        plate = plate[0], plate[1][:, ::-1]
    shaft, head = prism(0.005 - gap, -0.01, 0.02, sides), prism(0.008, 0.02, 0.026, sides)
    c, s = np.cos(2 * np.pi * turn / sides), np.sin(2 * np.pi * turn / sides)
    turned = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return together(plate, (shaft[0] @ turned, shaft[1]), (head[0] @ turned, head[1]))


def volume(shape):
    return float(topology.tetrahedra(*shape).sum())


_needles = plan_wing(0.5, 0.12, 0.06, 0.03, (0.0, 0.0), 0.12, 0.0, 3e-4, count=200, cuts=1)
_ball = 4 / 3 * np.pi * 0.15**3
_xz, _xzxy = ("xz",), ("xz", "xy")

HABITS = {
    # Surfaces of revolution with polar fans.
    "fan of 64 sectors": Habit(lambda: revolved(ogive(40), 64), 2.0, _xzxy),
    "fan of 240 sectors, 175,000 triangles": Habit(lambda: revolved(ogive(366), 240), 2.0, _xz),
    "ellipsoid of 120 x 60": Habit(lambda: revolved(ellipsoid(60), 120), 2.0, _xz),
    "cone of 360 sectors": Habit(lambda: cone(0.04, 0.3, 360), 2.0),
    "cylinder with lids of 720 sectors": Habit(lambda: prism(0.05, -0.1, 0.1, 720), 2.0),
    "lens of 400 sectors": Habit(lambda: revolved(lens(60), 400), 2.0, _xz),
    # Fine exports.
    "UAV of 116,000 triangles": Habit(lambda: uav(fine=4), 1.0),
    "lens of 80,000 triangles": Habit(lambda: revolved(lens(200), 200), 3.0),
    "ogive of 160,000 triangles": Habit(lambda: revolved(ogive(400), 200), 3.0),
    "ring of 100,000 triangles": Habit(lambda: torus(0.12, 0.03, 400, 125), 2.0, _xzxy),
    "box of 100,000 flat triangles": Habit(lambda: (fine_cube(0.2, 7)), 1.5, _xz, 0.008),
    "missile of small flat triangles": Habit(lambda: halved(drawn(2), 3), 1.0),
    "plate of 1 mm of 50,000 triangles": Habit(lambda: halved(brick((0.3, 0.2, 0.001)), 6), 1.0, _xz, 6e-5),
    # Closed parts that touch on finely triangulated faces.
    "capped halves of 8,500 triangles": Habit(lambda: halves(4, 0.01), 1.0, (), _ball),
    "capped halves of 39,000 triangles": Habit(lambda: halves(5, 0.004), 1.0, (), _ball),
    "capped halves, one turned": Habit(lambda: halves(4, 0.01, turn=0.3), 1.0),
    "capped halves 1e-8 m apart": Habit(lambda: halves(4, 0.01, gap=1e-8), 1.0, (), _ball),
    "slices of a cylinder": Habit(
        lambda: together(*[prism(0.05, z, z + 0.06, 180) for z in (-0.09, -0.03, 0.03)]), 1.0, (),
    ),
    "box of eight fine boxes": Habit(lambda: stack((0.2, 0.2, 0.1), (2, 2, 2), 4), 1.0, (), 0.004),
    "box of 27 boxes": Habit(lambda: stack((0.21, 0.21, 0.21), (3, 3, 3), 2), 1.0, (), 0.21**3),
    # Rivets and other details.
    "600 boxes of 2 mm on a box": Habit(lambda: strewn(brick((0.002,) * 3), 600), 1.0, (), 0.008),
    "200 rivet heads of 3 mm": Habit(lambda: strewn(prism(0.003, -0.001, 0.0012, 12), 200), 1.0, (), 0.008),
    "60 knobs of 4 mm": Habit(lambda: strewn(moved(sphere(0.004, 2), 0, 0, 0.001), 60), 1.0, (), 0.008),
    "panels of 0.5 mm on a box": Habit(lambda: strewn(brick((0.05, 0.03, 0.001)), 12), 1.0, (), 0.008),
    # Lofts with slivers and needles.
    "wing of 400 points a section": Habit(lambda: _needles, 1.0, _xz, volume(_needles)),
    "twisted blade of 60 x 4": Habit(lambda: twisted(60, 4), 1.0, (), volume(twisted(60, 4))),
    "twisted blade of 20 x 120": Habit(lambda: twisted(20, 120), 1.0, (), volume(twisted(20, 120))),
    "fuselage of 500 points, six rings": Habit(
        lambda: body([(-0.3, 0.02), (-0.2, 0.05), (0, 0.06), (0.15, 0.05), (0.25, 0.03), (0.3, 0.01)], 500), 1.0
    ),
    "disc of two fans from its rim": Habit(lambda: corner_fan(0.12, 0.004, 300), 1.0),
    # Patches that meet along common lines, each divided its own way.
    "box of six patches": Habit(
        lambda: patched_box((0.2, 0.12, 0.08), [(2, 3), (5, 4), (7, 3), (3, 3), (4, 6), (2, 9)]), 1.0, (), 0.00192
    ),
    "thin box of six patches": Habit(
        lambda: rounded(patched_box((0.2, 0.12, 0.0004), [(1, 3), (1, 4), (7, 1), (1, 3), (4, 6), (2, 9)])), 1.0, (),
        9.6e-6,
    ),
    "sphere of eight unsewn octants": Habit(
        lambda: rounded(octants((12, 17, 13, 19, 15, 11, 18, 14))), 1.0, (), _ball
    ),
    # Odd shells.
    "triangles turned at random": Habit(lambda: turned_at_random(sphere()), 1.0, (), volume(sphere())),
    "one body drawn twice": Habit(lambda: together(sphere(), sphere()), 1.0, (), volume(sphere())),
    "bulkheads in a tube": Habit(
        lambda: together(prism(0.05, -0.15, 0.15, 48), *[prism(0.05, z, z + 0.002, 48) for z in (-0.08, 0, 0.08)]),
        1.0, (), volume(prism(0.05, -0.15, 0.15, 48)),
    ),
    "ball in a ball": Habit(lambda: together(sphere(0.15), sphere(0.1)), 1.0, (), volume(sphere(0.15))),
    "tube with lips": Habit(
        lambda: together(tube(0.05, 0.001, 0.2, 96), moved(tube(0.06, 0.0105, 0.001, 96), 0.0995, 0, 0)), 2.0
    ),
    "fin without thickness": Habit(
        lambda: together(
            brick((0.2, 0.06, 0.04)), grid_patch([(-0.1, 0, 0.02), (0, 0, 0.02), (0, 0, 0.1), (-0.1, 0, 0.1)], 1, 1)
        ), 2.0, _xz,
    ),
    # Bolts in holes that fit.
    "bolt that fits its hole": Habit(lambda: bolt_in_hole(48, 0.0, 0.0), 2.0),
    "bolt turned by half a side": Habit(lambda: bolt_in_hole(48, 0.5, 0.0), 2.0),
    "bolt with a gap of 0.05 mm": Habit(lambda: bolt_in_hole(48, 0.0, 5e-5), 2.0),
}  # fmt: skip
