"""Write the five targets as STL beside this file: python resources/cad/make.py"""

from pathlib import Path

import numpy as np
from shapes import bar, blade, ellipse, hull, place, revolve, symmetric, union, write_stl


def drone():
    """Quadrotor, 0.25 m between neighbouring motors: body, four arms, motors, two-blade propellers, two skids."""
    deck = np.array([(0.08, 0.027), (0.053, 0.049), (-0.055, 0.049), (-0.08, 0.03)])
    deck = np.concatenate([deck, deck * [1, -1]])
    levels = ((-0.026, 0.85), (-0.012, 1.0), (0.034, 0.75))
    parts = [hull([(x * scale, y * scale, z) for z, scale in levels for x, y in deck])]
    leading = [(0.0, -0.012), (0.035, -0.018), (0.08, -0.017), (0.105, -0.012)]
    trailing = [(0.105, 0.012), (0.035, 0.017), (0.0, 0.012)]
    for side in (-1, 1):
        for front, turn in ((1, 75), (-1, 110)):
            x, y = 0.125 * front, 0.125 * side
            parts.append(bar((0.03 * front, 0.03 * side, 0.005), (x, y, 0.005), 0.024, 0.018))
            motor = [(-0.012, 0.02), (0.052, 0.02)]
            parts.append(place(revolve(motor, 16), rotate=(0, -90, 0), move=(x, y, 0.0)))
            for half in (0, 180):
                # Mirrored with its motor, so that the left and right propellers turn against each other.
                wing = place(blade(leading + trailing, 0.007, 0.009), rotate=(14, 0, half + turn))
                if side < 0:
                    wing = (wing[0] * [1, -1, 1], wing[1][:, ::-1])
                parts.append(place(wing, move=(x, y, 0.04)))
        parts.append(bar((-0.07, 0.065 * side, -0.075), (0.07, 0.065 * side, -0.075), 0.022, 0.018))
        for x in (-0.04, 0.04):
            parts.append(bar((x, 0.008 * side, -0.01), (x, 0.065 * side, -0.075), 0.016, 0.014))
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
    """Flying saucer, 0.50 m: two shallow bowls with a sharp rim, a dome, four splayed legs with round feet."""
    bowl = np.linspace(0, 1, 9)[1:-1]
    profile = [(-0.055, 0.06), *[(-0.055 * (1 - t**2.2), 0.06 + 0.192 * t) for t in bowl], (0.0, 0.252)]
    profile += [(0.05 * (1 - t**2.2), 0.1 + 0.152 * t) for t in bowl[::-1]]
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
