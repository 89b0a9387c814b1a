"""Write the fifteen targets as STL beside this file: python resources/cad/make.py"""

from pathlib import Path

import numpy as np

from isarflow.mesh.shapes import bar, blade, box, ellipse, hull, place, revolve, ring, symmetric, union, write_stl


def propeller(x, y, radius, turn):
    """A motor and two blades of a radius, turned by degrees about its axis, as a list of parts; left ones mirrored."""
    scale = radius / 0.105
    leading = [(0.0, -0.012), (0.035, -0.018), (0.08, -0.017), (0.105, -0.012)]
    trailing = [(0.105, 0.012), (0.035, 0.017), (0.0, 0.012)]
    motor = [(-0.012 * scale, 0.02 * scale), (0.052 * scale, 0.02 * scale)]
    parts = [place(revolve(motor, 16), rotate=(0, -90, 0), move=(x, y, 0.0))]
    for half in (0, 180):
        # Mirrored with its motor, so that the left and right propellers turn against each other.
        outline = scale * np.array(leading + trailing)
        wing = place(blade(outline, 0.007 * scale, 0.009 * scale), rotate=(14, 0, half + turn))
        if y < 0:
            wing = (wing[0] * [1, -1, 1], wing[1][:, ::-1])
        parts.append(place(wing, move=(x, y, 0.04 * scale)))
    return parts


def drone():
    """Quadrotor, 0.25 m between neighbouring motors: body, four arms, motors, two-blade propellers, two skids."""
    deck = np.array([(0.08, 0.027), (0.053, 0.049), (-0.055, 0.049), (-0.08, 0.03)])
    deck = np.concatenate([deck, deck * [1, -1]])
    levels = ((-0.026, 0.85), (-0.012, 1.0), (0.034, 0.75))
    parts = [hull([(x * scale, y * scale, z) for z, scale in levels for x, y in deck])]
    for side in (-1, 1):
        for front, turn in ((1, 75), (-1, 110)):
            x, y = 0.125 * front, 0.125 * side
            parts.append(bar((0.03 * front, 0.03 * side, 0.005), (x, y, 0.005), 0.024, 0.018))
            parts += propeller(x, y, 0.105, turn)
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


def drone_hexa():
    """Hexacopter, motors on a circle of 0.36 m: six-sided body, arms, motors, propellers, two skids on four legs."""
    corners = [(np.cos(a), np.sin(a)) for a in np.radians(range(0, 360, 60))]
    levels = ((-0.03, 0.05), (-0.01, 0.075), (0.025, 0.06))
    parts = [hull([(x * r, y * r, z) for z, r in levels for x, y in corners])]
    for angle, turn in ((30, 75), (90, 20), (150, 110)):
        x, y = 0.18 * np.cos(np.radians(angle)), 0.18 * np.sin(np.radians(angle))
        for side in (1, -1):
            parts.append(bar((0.2 * x, 0.2 * y * side, 0), (x, y * side, 0), 0.022, 0.018))
            parts += propeller(x, y * side, 0.085, turn)
    for side in (1, -1):
        parts.append(bar((-0.09, 0.08 * side, -0.11), (0.09, 0.08 * side, -0.11), 0.02, 0.018))
        parts += [bar((x, 0.03 * side, -0.01), (x, 0.08 * side, -0.11), 0.016, 0.014) for x in (-0.045, 0.045)]
    return symmetric(union(*parts))


def drone_guarded():
    """Quadrotor, 0.28 m between neighbouring motors, each propeller in a ring that guards it; four straight legs."""
    levels, corners = ((-0.025, 0.8), (0, 1), (0.03, 0.7)), [(x, y) for x in (-0.09, 0.09) for y in (-0.055, 0.055)]
    parts = [hull([(x * scale, y * scale, z) for z, scale in levels for x, y in corners])]
    section = [(0.098, -0.01), (0.109, -0.01), (0.109, 0.012), (0.098, 0.012)]
    for front, turn in ((1, 50), (-1, 130)):
        for side in (1, -1):
            x, y = 0.14 * front, 0.14 * side
            out = 1 + 0.103 / np.hypot(x, y)
            parts.append(bar((0.05 * front, 0.04 * side, 0), (out * x, out * y, 0), 0.022, 0.016))
            parts += propeller(x, y, 0.08, turn)
            parts.append(place(ring(section), move=(x, y, 0)))
            leg_x, leg_y = 0.05 * front, 0.035 * side
            parts.append(box((leg_x - 0.008, leg_y - 0.008, -0.09), (leg_x + 0.008, leg_y + 0.008, 0)))
    return symmetric(union(*parts))


def missile_plain():
    """Rocket of 0.85 m without wings: round body, long ogive nose, boat tail, four small tail fins in a plus."""
    body = [(-0.425, 0.035), (-0.36, 0.05), (-0.1, 0.05), (0.1, 0.05), *ellipse(0.1, 0.425, 0.05, 15, 0.8)]
    fin = [(-0.33, 0.0), (-0.385, 0.11), (-0.415, 0.11), (-0.415, 0.0)]
    parts = [revolve(body)]
    parts += [place(blade(fin, 0.007, 0.012), rotate=(roll, 0, 0)) for roll in (0, 90, 180, 270)]
    return symmetric(union(*parts))


def missile_cruciform():
    """Air-to-air missile of 0.9 m: slim round body, four long strakes amidships and four tail fins, both in an X."""
    body = [(-0.45, 0.036), (-0.2, 0.036), (0.1, 0.036), *ellipse(0.27, 0.45, 0.036, 13, 0.7)]
    strake = [(0.14, 0.0), (-0.06, 0.12), (-0.1, 0.12), (-0.1, 0.0)]
    fin = [(-0.34, 0.0), (-0.39, 0.105), (-0.44, 0.105), (-0.44, 0.0)]
    parts = [revolve(body)]
    for outline in (strake, fin):
        parts += [place(blade(outline, 0.006, 0.012), rotate=(roll, 0, 0)) for roll in (45, 135, 225, 315)]
    return symmetric(union(*parts))


def twin_boom():
    """Unmanned aeroplane with a pusher propeller: pod, straight wing, two booms, a tailplane between two fins."""
    pod = [
        *[(-x, r) for x, r in ellipse(0.06, 0.1, 0.045, 7)][::-1],
        (0.1, 0.045),
        *ellipse(0.12, 0.25, 0.045, 11, 0.6),
    ]
    wing = [(0.08, 0.0), (0.05, 0.36), (-0.01, 0.36), (-0.03, 0.0)]
    fin = [(-0.32, 0.0), (-0.36, 0.1), (-0.41, 0.1), (-0.41, 0.0)]
    tail = [(-0.34, -0.13), (-0.34, 0.13), (-0.405, 0.13), (-0.405, -0.13)]
    screw = [(0.011, -0.085), (0.011, 0.085), (-0.011, 0.085), (-0.011, -0.085)]
    parts = [revolve(pod), place(blade(tail, 0.007, 0.012), move=(0, 0, 0.01))]
    parts.append(place(blade(screw, 0.008, 0.008), rotate=(0, 90, 0), move=(-0.09, 0, 0)))
    for side in (1, -1):
        turned = 0 if side > 0 else 180
        parts.append(place(blade(wing, 0.011, 0.02), rotate=(turned, 0, 0), move=(0, 0, 0.01)))
        parts.append(bar((0.05, 0.13 * side, 0.01), (-0.42, 0.13 * side, 0.01), 0.022, 0.022))
        parts.append(place(blade(fin, 0.007, 0.012), rotate=(90, 0, 0), move=(0, 0.13 * side, 0.01)))
    return symmetric(union(*parts))


def delta_wing():
    """Flying wing: swept delta with a flat body that rises in the middle, and two canted fins."""
    wing = [(0.2, 0.0), (-0.11, 0.32), (-0.17, 0.32), (-0.15, 0.0)]
    fin = [(-0.04, 0.0), (-0.11, 0.1), (-0.15, 0.1), (-0.15, 0.0)]
    ridge = [(0.235, 0, 0), (-0.17, 0, 0.005), (0.05, 0, 0.045), (-0.08, 0, 0.04), (0.05, 0, -0.03), (-0.1, 0, -0.027)]
    ridge += [(0.07, 0.06, 0), (0.07, -0.06, 0), (-0.12, 0.07, 0), (-0.12, -0.07, 0)]
    parts = [hull(ridge)]
    for side in (1, -1):
        parts.append(place(blade(wing, 0.014, 0.03), rotate=(0 if side > 0 else 180, 0, 0)))
        parts.append(place(blade(fin, 0.006, 0.012), rotate=(90 - 20 * side, 0, 0), move=(0, 0.1 * side, 0)))
    return symmetric(union(*parts))


def helicopter():
    """Helicopter: egg-shaped cabin, tail boom, fin, four-blade rotor on a mast, skids on four legs."""
    cabin = [*[(-x, r) for x, r in ellipse(0.0, 0.13, 0.065, 9)][::-1], *ellipse(0.03, 0.19, 0.065, 9)]
    boom = [(-0.36, 0.012), (-0.1, 0.024), (0.0, 0.024)]
    fin = [(-0.31, 0.0), (-0.35, 0.09), (-0.39, 0.09), (-0.37, 0.0)]
    rotor = [(0.0, -0.012), (0.25, -0.014), (0.25, 0.014), (0.0, 0.012)]
    parts = [revolve(cabin, 40), place(revolve(boom, 16), move=(0, 0, 0.015))]
    parts.append(place(blade(fin, 0.007, 0.01), rotate=(90, 0, 0), move=(0, 0, 0.01)))
    parts.append(place(revolve([(0.0, 0.014), (0.115, 0.014)], 16), rotate=(0, -90, 0)))
    parts += [place(blade(rotor, 0.008, 0.009), rotate=(0, 0, turn), move=(0, 0, 0.1)) for turn in (0, 90, 180, 270)]
    for side in (1, -1):
        parts.append(bar((-0.1, 0.075 * side, -0.11), (0.13, 0.075 * side, -0.11), 0.016, 0.016))
        parts += [bar((x, 0.03 * side, -0.03), (x, 0.075 * side, -0.11), 0.014, 0.014) for x in (-0.04, 0.08)]
    return symmetric(union(*parts))


def bird():
    """Soaring bird: body with head, wings of an inner part that rises and an outer one that falls, fanned tail."""
    body = [*[(-x, r) for x, r in ellipse(0.0, 0.17, 0.045, 9, 0.8)][::-1], *ellipse(0.02, 0.13, 0.045, 9)]
    head = [*[(-x, r) for x, r in ellipse(0.0, 0.03, 0.026, 7)][::-1], *ellipse(0.0, 0.03, 0.026, 7)[:-1], (0.065, 0.0)]
    inner = [(0.07, 0.0), (0.085, 0.2), (-0.035, 0.2), (-0.06, 0.0)]
    outer = [(0.085, 0.0), (0.03, 0.2), (-0.01, 0.2), (-0.035, 0.0)]
    tail = [(-0.1, -0.025), (-0.1, 0.025), (-0.26, 0.065), (-0.26, -0.065)]
    rise = np.radians(14)
    parts = [revolve(body, 32), place(revolve(head, 24), move=(0.135, 0, 0.02)), blade(tail, 0.008, 0.012)]
    tip = np.array([0, 0.19 * np.cos(rise), 0.19 * np.sin(rise)])
    for side in (1, -1):
        turned = 0 if side > 0 else 180
        parts.append(place(blade(inner, 0.012, 0.02), rotate=(turned + 14 * side, 0, 0)))
        move = tip * [1, side, 1]
        parts.append(place(blade(outer, 0.01, 0.016), rotate=(turned - 8 * side, 0, 0), move=move))
    return symmetric(union(*parts))


def balloon():
    """Balloon, a ball of 0.28 m that narrows below, with a box hung under it on a rod."""
    ball = [(z, 0.14 * np.sqrt(max(1 - (z / 0.14) ** 2, 0))) for z in 0.14 * np.sin(np.linspace(-0.7, np.pi / 2, 17))]
    profile = [(-0.19, 0.012), *ball[:-1], (0.14, 0.0)]
    parts = [place(revolve(profile, 48), rotate=(0, -90, 0), move=(0, 0, 0.08))]
    parts.append(box((-0.007, -0.007, -0.22), (0.007, 0.007, -0.1)))
    parts.append(box((-0.04, -0.03, -0.27), (0.04, 0.03, -0.2)))
    return symmetric(union(*parts))


def satellite():
    """Box with two solar panels on stubs: half a metre across, with three mirror planes."""
    panel = [(0.09, 0.0), (0.09, 0.2), (-0.09, 0.2), (-0.09, 0.0)]
    parts = [box((-0.08, -0.07, -0.09), (0.08, 0.07, 0.09))]
    for side in (1, -1):
        parts.append(bar((0, 0.05 * side, 0), (0, 0.13 * side, 0), 0.024, 0.014))
        parts.append(place(blade(panel, 0.009, 0.012), rotate=(0 if side > 0 else 180, 0, 0), move=(0, 0.1 * side, 0)))
    return symmetric(union(*parts))


TARGETS = (drone, missile, aircraft, ufo, trihedral)
TARGETS += drone_hexa, drone_guarded, missile_plain, missile_cruciform
TARGETS += twin_boom, delta_wing, helicopter, bird, balloon, satellite

if __name__ == "__main__":
    folder = Path(__file__).parent
    for make in TARGETS:
        write_stl(folder / f"{make.__name__}.stl", make())
