"""Aircraft, quadrotors and missiles as CAD programs export them: closed solids that overlap, with thin trailing edges.

All are in metres, nose along x, z up: vertices (V, 3) and triangles (T, 3). `drawn` draws one at random.
"""

import itertools

import numpy as np
from shapes_made import lofted, together

NACA = 0.2969, -0.1260, -0.3516, 0.2843, -0.1015  # of sqrt(x), x, ..., x^4: the half thickness over 5 t


def aerofoil(thickness, camber=0.0, trailing=0.0, count=24):
    """A NACA four-digit section of chord 1, (2 count, 2): x from 1 (nose) to 0 along the top and back below.

    `trailing` is how thick its end is, more than the closed section's 0.2 % of `thickness`.
    """
    x = (1 - np.cos(np.linspace(0, np.pi, count))) / 2
    half = 5 * thickness * (NACA[0] * np.sqrt(x) + sum(a * x**k for k, a in enumerate(NACA[1:], 1)))
    half = half + x * max(trailing / 2 - half[-1], -half[-1])
    line = np.where(x < 0.4, camber / 0.16 * (0.8 * x - x**2), camber / 0.36 * (0.2 + 0.8 * x - x**2))
    top, bottom = line + half, line - half
    return np.concatenate([np.stack([1 - x, top], 1), np.stack([1 - x, bottom], 1)[:0:-1]])


def wing(sections, upright=False):
    """A lofted solid through sections ((x, y, z) of the trailing edge, chord, aerofoil), each across y (z: `upright`).

    The ends are closed by strips from top to bottom, as an aerofoil with camber does not see all of itself.
    """
    rings = []
    for (x, y, z), chord, shape in sections:
        flat = chord * shape
        offset = np.zeros(len(flat))
        ring = [x + flat[:, 0], y + (flat[:, 1] if upright else offset), z + (offset if upright else flat[:, 1])]
        rings.append(np.stack(ring, axis=1))
    vertices, triangles = lofted(rings)
    size, last = len(rings[0]), (len(rings) - 1) * len(rings[0])
    vertices, triangles = vertices[:-2], triangles[(triangles < last + size).all(axis=1)]
    half = size // 2
    pairs = [(k, size - k) for k in range(1, half)]
    lid = [(0, pairs[0][0], pairs[0][1])]
    for (a, b), (c, d) in itertools.pairwise(pairs):
        lid += [(a, c, b), (c, d, b)]
    lid.append((pairs[-1][0], half, pairs[-1][1]))
    lid = np.array(lid)
    triangles = np.concatenate([triangles, lid[:, ::-1], lid + last])
    return vertices, triangles if upright else triangles[:, ::-1]


def body(stations, around=32, aspect=1.0, power=1.0):
    """A body along x through stations (x, radius), its section a circle or a superellipse `aspect` times as high."""
    angle = 2 * np.pi * np.arange(around) / around
    y, z = (np.sign(f(angle)) * np.abs(f(angle)) ** power for f in (np.cos, np.sin))
    return lofted([np.stack([0 * y + x, r * y, aspect * r * z], 1) for x, r in stations])


def fuselage(length, radius, nose=0.25, tail=0.4, tip=0.1, rings=24, **section):
    """A round body from x = length / 2 to - length / 2, blunt at its nose, its tail as thin as `tip` of its radius."""
    s = (1 - np.cos(np.linspace(0, np.pi, rings))) / 2
    r = np.where(s < nose, np.sqrt(np.maximum(1 - ((nose - s) / nose) ** 2, 1e-3)), 1.0)
    r *= 1 - (1 - tip) * np.maximum((s - 1 + tail) / tail, 0) ** 1.5
    return body(np.stack([length / 2 - length * s, radius * r], 1)[::-1], **section)


def moved(shape, *shift):
    return shape[0] + np.array(shift), shape[1]


def plan_wing(span, root, tip, sweep, at, thickness, camber=0.0, trailing=2.5e-4, dihedral=0.0, count=24, cuts=4):
    """A wing over both sides, in metres: `sweep` of its tips behind `at`, its trailing edge `trailing` thick."""
    share = np.linspace(-1, 1, 2 * cuts + 1)
    chord = root + (tip - root) * np.abs(share)
    sections = []
    for s, c in zip(share, chord, strict=True):
        place = (at[0] - sweep * abs(s), s * span / 2, at[1] + dihedral * abs(s))
        sections.append((place, c, aerofoil(thickness, camber, trailing / c, count)))
    return wing(sections)


def fin(height, root, tip, sweep, at, thickness, trailing=2.5e-4, count=24, cuts=3):
    """An upright aerofoil from `at` (x, y, z) of the trailing foot."""
    sections = []
    for s in np.linspace(0, 1, cuts + 1):
        chord = root + (tip - root) * s
        place = (at[0] - sweep * s, at[1], at[2] + height * s)
        sections.append((place, chord, aerofoil(thickness, 0.0, trailing / chord, count)))
    return wing(sections, upright=True)


def uav(trailing=2.5e-4, fine=1):
    """An ordinary UAV of 1.24 m: fuselage, NACA wing, tailplane, fin, two nacelles; trailing edges in metres."""
    count = 24 * fine
    return together(
        fuselage(1.24, 0.06, rings=30 * fine, around=40 * fine),
        plan_wing(1.2, 0.2, 0.11, 0.02, (-0.05, 0.02), 0.12, 0.02, trailing, 0.03, count, 8 * fine),
        plan_wing(0.42, 0.11, 0.07, 0.02, (-0.6, 0.005), 0.09, 0.0, trailing, 0.0, count, 6 * fine),
        fin(0.17, 0.13, 0.07, 0.04, (-0.6, 0.0, 0.0), 0.09, trailing, count, 6 * fine),
        *[moved(fuselage(0.22, 0.025, rings=16 * fine, around=24 * fine), 0.1, y, 0.04) for y in (-0.28, 0.28)],
    )


def aircraft(random):
    """A random aircraft: fuselage, tapered and swept NACA wing, tailplane, one or two fins, perhaps nacelles."""
    u = random.uniform
    length = u(0.5, 1.5)
    radius = length * u(0.04, 0.09)
    trailing = 10 ** u(-4, -2.9)
    parts = [fuselage(length, radius, u(0.15, 0.35), u(0.3, 0.5), u(0.05, 0.3), aspect=u(0.8, 1.2), power=u(0.6, 1))]
    span, root = length * u(0.6, 1.4), length * u(0.12, 0.3)
    parts.append(
        plan_wing(
            span,
            root,
            root * u(0.3, 1),
            length * u(-0.05, 0.25),
            (length * u(-0.2, 0), radius * u(-0.6, 0.6)),
            u(0.08, 0.16),
            u(0, 0.04),
            trailing,
            span * u(-0.03, 0.06),
        )
    )
    tail, back = root * u(0.4, 0.7), -length * u(0.44, 0.5)
    parts.append(
        plan_wing(
            span * u(0.25, 0.45),
            tail,
            tail * u(0.5, 1),
            length * u(0, 0.08),
            (back, radius * u(-0.2, 0.3)),
            u(0.06, 0.1),
            0,
            trailing,
        )
    )
    side = u(0, 0.05) * length if u(0, 1) < 0.4 else 0.0
    for y in sorted({-side, side}):
        parts.append(
            fin(
                length * u(0.1, 0.2), tail, tail * u(0.4, 0.9), length * u(0, 0.1), (back, y, 0), u(0.06, 0.1), trailing
            )
        )
    if u(0, 1) < 0.5:
        place, size = (length * u(-0.1, 0.1), span * u(0.15, 0.3), parts[1][0][:, 2].mean()), radius * u(0.3, 0.5)
        parts += [
            moved(fuselage(size * u(6, 9), size, rings=14, around=20), place[0], y, place[2])
            for y in (-place[1], place[1])
        ]
    return together(*parts)


def quadrotor(random):
    """A random quadrotor: a body, crossed arms, motors at their ends and blades upon them."""
    u = random.uniform
    reach, arm = u(0.12, 0.3), u(0.004, 0.012)
    parts = [
        fuselage(reach * u(0.8, 1.2), reach * u(0.15, 0.3), 0.3, 0.3, 0.4, rings=14, around=24, aspect=u(0.4, 0.8))
    ]
    angle, blade = np.radians(u(35, 55)), reach * u(0.4, 0.65)
    for k, turn in enumerate((angle, np.pi - angle, np.pi + angle, -angle)):
        along = np.array([np.cos(turn), np.sin(turn), 0])
        parts.append(_placed(body([(0, arm), (reach, arm * 0.8)], 12), turn, (0, 0, 0)))
        x, y, _ = reach * along
        motor, _ = body([(-1.6 * arm, 1.5 * arm), (1.6 * arm, 1.5 * arm)], 20)
        parts.append((motor[:, [1, 2, 0]] + [x, y, 0], _))
        section = aerofoil(u(0.08, 0.14), 0.03, 2e-4 / (0.15 * blade), 12)
        sections = [
            ((-0.05 * blade, s * blade, 0), blade * 0.15 * (1 - 0.5 * abs(s)), section) for s in np.linspace(-1, 1, 7)
        ]
        parts.append(_placed(wing(sections), turn + k, (x, y, 1.5 * arm)))
    return together(*parts)


def missile(random):
    """A random missile: an ogive on a tube, wings and tail fins in a cross, their tips thin."""
    u = random.uniform
    length = u(0.5, 1.5)
    radius, nose = length * u(0.03, 0.06), u(0.15, 0.3)
    s = np.linspace(0, 1, 14)[:-1]
    stations = [(-length / 2, radius * u(0.6, 1)), (-length * 0.45, radius)]
    stations += [(length * (0.5 - nose + nose * a), radius * (1 - a**2)) for a in s]
    parts = [body(stations, 28)]
    trailing = 10 ** u(-4, -3)
    for place, size in ((u(-0.1, 0.1), u(0.08, 0.2)), (-0.48, u(0.06, 0.12))):
        root, turn = length * u(0.08, 0.16), u(0, np.pi / 4)
        blade = fin(length * size, root, root * u(0.2, 0.8), length * u(0, 0.05), (0, 0, 0), u(0.04, 0.08), trailing)
        for k in range(4):
            parts.append(_placed(blade, turn + k * np.pi / 2, (length * place, 0, 0), about=0))
    return together(*parts)


def _placed(shape, turn, shift, about=2):
    """A shape turned by `turn` radians about an axis and moved."""
    j, k = (about + 1) % 3, (about + 2) % 3
    matrix = np.eye(3)
    matrix[[j, j, k, k], [j, k, j, k]] = np.cos(turn), -np.sin(turn), np.sin(turn), np.cos(turn)
    return shape[0] @ matrix.T + np.array(shift), shape[1]


def drawn(number):
    """The `number`th random vehicle, an aircraft, a quadrotor or a missile in turn, in single precision as in STL."""
    kind = (aircraft, quadrotor, missile)[number % 3]
    vertices, triangles = kind(np.random.default_rng(number))
    return vertices.astype(np.float32).astype(float), triangles
