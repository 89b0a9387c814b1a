"""Solve a conducting sphere like a target and compare it with its closed form, for the report's check of the solver.

The closed form is the Mie series: Bohren, Huffman, Absorption and Scattering of Light by Small Particles, ch. 4, in the
limit of perfect conduction, with exp(+j omega t) and the amplitude E_s = f exp(-j k r) / r.
"""

import json
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull
from scipy.special import spherical_jn, spherical_yn

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep
from isarflow.scattering.solver import build_solver, check_solution

RADIUS = 0.35  # wavelengths: ka = 2.2, between the sphere's inner resonances, and solved in a second
DIRECTION = 20.0, 10.0  # azimuth and elevation in degrees, off the mesh's axes of symmetry


def check(path, scattering, edges_per_wavelength, threads):
    """Solve a sphere of RADIUS wavelengths with a config's settings and write the result beside Mie's, as JSON.

    residual and unknowns are None for a solver without a linear system; if a solver refuses the sphere, only the
    reason, `refused`, is written.
    """
    vertices, triangles = icosphere(RADIUS, 1 / edges_per_wavelength)
    azimuth, elevation = (np.array([angle]) for angle in DIRECTION)
    sweep = Sweep(np.array([C0]), elevation, azimuth, ["VV"])  # a wavelength of 1 m
    try:
        solution = build_solver(scattering).solve(vertices, triangles, sweep, [], threads, lambda *progress: None)
        check_solution(solution, sweep, scattering["solver"])
    except InputError as error:  # a user's own solver may accept no sphere
        Path(path).write_text(json.dumps({"refused": str(error)}, indent=1))
        return
    field, mie = complex(solution.field[0, 0, 0, 0]), complex(backscatter(2 * np.pi, RADIUS))
    ratio = field / mie
    result = {
        "radius_wavelengths": RADIUS,
        "edges_per_wavelength": edges_per_wavelength,
        "triangles": len(triangles),
        "unknowns": solution.unknowns,
        "rcs_db": 20 * np.log10(abs(field)) + 10 * np.log10(4 * np.pi),  # divided by the wavelength squared
        "mie_db": 20 * np.log10(abs(mie)) + 10 * np.log10(4 * np.pi),
        "error_db": 20 * np.log10(abs(ratio)),
        "phase_deg": np.degrees(np.angle(ratio)),
        "residual": None if solution.residual is None else float(solution.residual[0]),
    }
    apart = f"{result['error_db']:+.3f} dB and {result['phase_deg']:+.2f} degrees"
    print(f"sphere of {RADIUS:g} wavelengths: {apart} from Mie")
    Path(path).write_text(json.dumps(result, indent=1))


def backscatter(wavenumber, radius):
    """Amplitude f towards the source, m (complex), phase referred to the centre. wavenumber: rad/m; radius: m."""
    return to_source(wavenumber, *coefficients(wavenumber * radius))


def to_source(wavenumber, n, a, b):
    """`backscatter` of a body with these `coefficients`."""
    return np.sum((-1.0) ** n * (2 * n + 1) * (a - b)) * (1j / (2 * wavenumber))


def orders(x):
    """The orders n that matter of a sphere of size x = k radius."""
    return np.arange(1, int(x + 4 * x ** (1 / 3) + 10) + 1)


def coefficients(x):
    """Orders n and coefficients a_n (electric) and b_n (magnetic) of a sphere of size x = k radius."""
    n = orders(x)
    j, y = spherical_jn(n, x), spherical_yn(n, x)
    h = j - 1j * y  # outgoing wave for exp(+j omega t)
    dj, dh = spherical_jn(n, x, True), spherical_jn(n, x, True) - 1j * spherical_yn(n, x, True)
    return n, (j + x * dj) / (h + x * dh), j / h


def icosphere(radius, edge):
    """Faceted sphere with the volume of the true one, its mean edge length as near as possible to `edge`, in m.

    Returns vertices (V, 3) and triangles (T, 3), outward. Caspar, Klug, Cold Spring Harbor Symp. 27, 1962: a step of
    (b, c) in a triangular lattice is an icosahedron's edge, which gives 20 (b^2 + b c + c^2) triangles. Raises
    InputError for a radius or an edge that is not above 0.
    """
    for name, length in (("radius", radius), ("edge", edge)):
        if not 0 < length < np.inf:
            raise InputError(f"'{name}' of a sphere is {length}; it is a length above 0, in m.")
    wanted = (1.2035 * radius / edge) ** 2
    steps = [(b, c) for b in range(1, int(wanted**0.5) + 3) for c in range(b + 1)]
    b, c = min(steps, key=lambda step: (abs(step[0] ** 2 + step[0] * step[1] + step[1] ** 2 - wanted), step))
    i, j = (x.reshape(-1) for x in np.mgrid[-c : b + 1, 0 : b + c + 1])
    s, t = i * (b + c) + j * c, j * b - i * c
    inside = (s >= 0) & (t >= 0) & (s + t <= b * b + b * c + c * c)
    weights = np.stack([b * b + b * c + c * c - s - t, s, t], 1)[inside]

    phi = (1 + 5**0.5) / 2
    corners = np.array([[s * a, t * b, 0] for s in (-1, 1) for t in (-1, 1) for a, b in ((1, phi),)])
    corners = np.concatenate([np.roll(corners, k, 1) for k in range(3)])
    points = np.concatenate([weights @ corners[face] for face in _hull(corners)])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.unique(np.round(points, 9), axis=0, return_index=True)[1]]
    triangles = _hull(points)
    volume = np.linalg.det(points[triangles]).sum() / 6
    return points * radius * (4 / 3 * np.pi / volume) ** (1 / 3), triangles


def _hull(points):
    """Outward triangles of the convex hull of points about the origin."""
    triangles = ConvexHull(points).simplices
    inward = np.linalg.det(points[triangles]) < 0
    return np.where(inward[:, None], triangles[:, ::-1], triangles)
