"""Write the five targets as STL beside this file: python resources/cad/make.py"""

from pathlib import Path

import numpy as np
from shapes import bar, blade, ellipse, hull, place, revolve, symmetric, union, write_stl


def drone():
    """Quadrotor, 0.25 m between neighbouring motors: body, four arms, motors, two-blade propellers, two skids."""
    deck = np.array([(0.08, 0.03), (0.055, 0.05), (-0.065, 0.05), (-0.08, 0.035)])
    deck = np.concatenate([deck, deck * [1, -1]])
    levels = ((-0.022, 0.8), (0.0, 1.0), (0.012, 1.0), (0.03, 0.7))
    parts = [hull([(x * scale, y * scale, z) for z, scale in levels for x, y in deck])]
    blade_outline = [
        (0.0, -0.006),
        (0.035, -0.013),
        (0.075, -0.011),
        (0.1, -0.005),
        (0.1, 0.004),
        (0.035, 0.011),
        (0.0, 0.006),
    ]
    for side in (-1, 1):
        for front, turn in ((1, 75), (-1, 110)):
            x, y = 0.125 * front, 0.125 * side
            parts.append(bar((0.03 * front, 0.03 * side, 0.005), (x, y, 0.005), 0.014, 0.012))
            motor = [(-0.010, 0.012), (0.022, 0.012), (0.03, 0.006), (0.044, 0.006)]
            parts.append(place(revolve(motor, 24), rotate=(0, -90, 0), move=(x, y, 0.0)))
            for half in (0, 180):
                # Mirrored with its motor, so that the left and right propellers turn against each other.
                wing = place(blade(blade_outline, 0.0044, 0.0045), rotate=(14, 0, half + turn))
                if side < 0:
                    wing = (wing[0] * [1, -1, 1], wing[1][:, ::-1])
                parts.append(place(wing, move=(x, y, 0.036)))
        parts.append(bar((-0.085, 0.065 * side, -0.075), (0.085, 0.065 * side, -0.075), 0.009, 0.009))
        for x in (-0.045, 0.045):
            parts.append(bar((x, 0.025 * side, -0.01), (x, 0.065 * side, -0.0745), 0.009, 0.009))
    return symmetric(union(*parts))


def missile():
    """Generic cruise missile, 1 m: round body, ogive nose, boat tail, two straight wings, four tail fins in an X."""
    body = [(-0.5, 0.03), (-0.43, 0.045), (-0.2, 0.045), (0.1, 0.045), *ellipse(0.3, 0.5, 0.045, 13, 0.7)]
    wing = [(0.075, 0.0), (0.025, 0.24), (-0.045, 0.24), (-0.035, 0.0)]
    fin = [(-0.385, 0.0), (-0.42, 0.125), (-0.47, 0.125), (-0.475, 0.0)]
    parts = [revolve(body)]
    parts += [place(blade(wing, 0.009, 0.018), rotate=(roll, 0, 0)) for roll in (0, 180)]
    parts += [place(blade(fin, 0.006, 0.012), rotate=(roll, 0, 0)) for roll in (45, 135, 225, 315)]
    return symmetric(union(*parts))


def aircraft():
    """Model aeroplane, 1 m: tapered fuselage, low-mounted tapered wing, tailplane and fin."""
    body = [*[(-x, r) for x, r in ellipse(0.42, 0.5, 0.02, 5)][::-1], (-0.15, 0.045), (0.0, 0.05)]
    body += [(0.15, 0.05), *ellipse(0.25, 0.5, 0.05, 13, 0.6)]
    wing = [(0.13, 0.0), (0.055, 0.42), (-0.005, 0.42), (-0.01, 0.0)]
    tail = [(-0.375, 0.0), (-0.415, 0.165), (-0.465, 0.165), (-0.47, 0.0)]
    fin = [(-0.35, 0.0), (-0.42, 0.155), (-0.475, 0.155), (-0.475, 0.0)]
    parts = [revolve(body)]
    parts += [place(blade(wing, 0.011, 0.02), rotate=(roll, 0, 0), move=(0, 0, -0.015)) for roll in (6, 174)]
    parts += [place(blade(tail, 0.006, 0.012), rotate=(roll, 0, 0)) for roll in (0, 180)]
    parts += [place(blade(fin, 0.006, 0.012), rotate=(90, 0, 0))]
    return symmetric(union(*parts))


def ufo():
    """Flying saucer, 0.47 m: two shallow bowls with a sharp rim, a dome, four splayed legs with round feet."""
    bowl = np.linspace(0, 1, 9)[1:-1]
    profile = [(-0.055, 0.06), *[(-0.055 * (1 - t**2.2), 0.06 + 0.176 * t) for t in bowl], (0.0, 0.236)]
    profile += [(0.05 * (1 - t**2.2), 0.1 + 0.136 * t) for t in bowl[::-1]]
    profile += [(0.05 + 0.07 * np.sin(a), 0.1 * np.cos(a)) for a in np.linspace(0, np.pi / 2, 9)[:-1]] + [(0.12, 0.0)]
    parts = [place(revolve(profile, 64), rotate=(0, -90, 0))]
    for azimuth in (45, 135, 225, 315):
        leg = bar((0.09, 0, -0.03), (0.185, 0, -0.132), 0.014, 0.014)
        foot = place(
            revolve([(-0.14, 0.024), (-0.128, 0.024), (-0.122, 0.012)], 24), rotate=(0, -90, 0), move=(0.185, 0, 0)
        )
        parts += [place(part, rotate=(0, 0, azimuth)) for part in (leg, foot)]
    return symmetric(union(*parts))


def trihedral(edge=0.5):
    """Triangular trihedral corner reflector, open sheet: apex at origin, boresight azimuth 0, elevation 35.26 deg."""
    side = edge / np.sqrt(2)
    vertices = np.array([(0, 0, 0), (side, -side, 0), (side, 0, 0), (side, side, 0), (0, 0, edge)])
    return vertices, np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)])


if __name__ == "__main__":
    folder = Path(__file__).parent
    for make in (drone, missile, aircraft, ufo, trihedral):
        write_stl(folder / f"{make.__name__}.stl", make())
