"""Physical optics: the backscatter of the surface that the radar sees, compiled by Numba.

A lit triangle carries the current of a plane mirror, 2 n x H. For exp(+j omega t) and a radar in direction u, at a
wavenumber k, the amplitude (see `farfield`) of both co-polarizations is

    f = -j k / (2 pi) int |n . u| exp(2 j k u . r) dS    (m)

over what is lit; there is no cross-polarization. The integral over a flat triangle is exact (Gordon, IEEE Trans.
Antennas Propag. 23, 1975): with t_i = 2 k u . r_i at its corners -2 A times the divided difference of exp(j t) at t_1,
t_2, t_3. So each corner has a weight that does not depend on frequency, and triangles share their corners' phases. Only
where an edge is nearly at right angles to u, the corners' weights become large, and the triangle is computed by itself.

What is lit is found in a depth buffer across the line of sight, at four points of each triangle.
"""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, unit_vectors
from isarflow.mesh import topology
from isarflow.scattering.checks import checked_mesh, checked_sweep
from isarflow.scattering.jit import kernel
from isarflow.scattering.solver import Solution

CHUNK = 16  # directions of a task
ACROSS = 400  # cells of the depth buffer along the target, at least
FINE = 3  # cells along an edge of mean length, at least
NEAR = 0.01  # rad: corners whose phases differ by less are computed together
SAME = 1e-12  # of a wavenumber: steps between frequencies that differ by less are the same
STEEP = 0.1  # cosine of incidence, below which a cell's depth may differ no more from its neighbours'
# Barycentric coordinates of the points where a triangle is asked whether it is lit.
POINTS = np.array([(1, 1, 1), (4, 1, 1), (1, 4, 1), (1, 1, 4)]) / np.array([[3], [6], [6], [6]])


class Surface:
    """A mesh as the kernels read it. vertices: (V, 3) m; triangles: (T, 3), both of whose sides count if it is open.

    Raises InputError for a mesh with NaN, vertices that do not exist, or triangles without area or doubled.
    """

    def __init__(self, vertices, triangles):
        vertices, triangles = checked_mesh(vertices, triangles)
        normals = topology.normals(vertices[triangles])  # of length 2 A
        size = np.ptp(vertices, axis=0).max()
        edge = topology.edge_lengths(vertices, triangles).mean()
        self.cell = max(min(edge / FINE, size / ACROSS), size / 4000)
        self.arrays = np.ascontiguousarray(vertices), np.ascontiguousarray(triangles), normals
        self.is_closed = topology.is_watertight(triangles)

    def backscatter(self, wavenumbers, elevation, azimuth):
        """Amplitudes f, m, of VV and HH, (2, D, F), at wavenumbers (F,) in rad/m; angles (D,) in degrees."""
        axes = axes_of(elevation, azimuth)
        field = np.zeros((len(axes), len(wavenumbers)), complex)
        _backscatter(field, axes, *self.arrays, self.is_closed, np.asarray(wavenumbers, float), self.cell, POINTS)
        return np.stack([field, field])


def axes_of(elevation, azimuth):
    """Unit vectors u to the radar, V and H of directions, (D, 3, 3). elevation, azimuth: (D,) in degrees."""
    return np.stack(unit_vectors(np.asarray(elevation, float), np.asarray(azimuth, float)), axis=1)


def over_directions(backscatter, ways, sweep, threads, progress, name):
    """Return the Solution of a Sweep by a function of wavenumbers (F,), elevations and azimuths (D,), as above.

    ways: the polarizations that it gives, (W, D, F); others are zero. name: the solver's. Raises InputError for what is
    no sweep, and for one with separate receivers.
    """
    sweep = checked_sweep(sweep)
    if sweep.receivers:
        raise InputError(f"the solver '{name}' is of backscatter alone; leave out 'scattering.bistatic'.")
    begun, wavenumbers = time.perf_counter(), 2 * np.pi * sweep.frequency / C0
    elevation, azimuth = sweep.each
    parts, amplitudes = [slice(begin, begin + CHUNK) for begin in range(0, len(azimuth), CHUNK)], []
    with ThreadPoolExecutor(threads) as pool:
        for part in pool.map(lambda run: backscatter(wavenumbers, elevation[run], azimuth[run]), parts):
            amplitudes.append(part)
            done = len(amplitudes) / len(parts)
            progress(0, "directions", done, done * len(wavenumbers))  # of all frequencies at once
    by_way = dict(zip(ways, np.concatenate(amplitudes, axis=1).transpose(0, 2, 1), strict=True))
    field = np.stack([by_way.get(way, np.zeros_like(by_way[ways[0]])) for way in sweep.polarizations])
    seconds = np.full(len(wavenumbers), (time.perf_counter() - begun) / len(wavenumbers))
    return Solution(field.reshape(*field.shape[:2], *sweep.shape), None, {"directions": seconds}, None)


@kernel
def _backscatter(field, axes, vertices, triangles, normals, is_closed, wavenumbers, cell, points):
    """Fill `field` (D, F). axes: (D, 3, 3), towards the radar and two across; normals: of length 2 A."""
    alone, weights = np.empty(len(triangles)), np.empty(len(vertices))
    sizes = np.sqrt((normals**2).sum(1))
    for d in range(len(field)):
        # Towards the radar, and across: rows and columns of the depth buffer.
        depth, y, x = vertices @ axes[d, 0], vertices @ axes[d, 1], vertices @ axes[d, 2]
        x, y = (x - x.min()) / cell, (y - y.min()) / cell
        facing = normals @ axes[d, 0]
        if not is_closed:
            facing = np.abs(facing)
        buffer = _buffer(depth, x, y, triangles, facing)
        weights[:], alone[:] = 0, 0
        for t in range(len(triangles)):
            if facing[t] <= 0:
                continue
            a, b, c = triangles[t]
            cosine = facing[t] / sizes[t]
            # A cell has the depth at its middle, and a sloping triangle's changes within the cell.
            spare = cell * (1 + np.sqrt(1 - min(cosine, 1.0) ** 2) / max(cosine, STEEP))
            strength = facing[t] * _seen(buffer, depth, x, y, a, b, c, spare, points)
            ab, bc, ca = 2 * (depth[a] - depth[b]), 2 * (depth[b] - depth[c]), 2 * (depth[c] - depth[a])
            if min(abs(ab), abs(bc), abs(ca)) * wavenumbers[-1] < NEAR:
                alone[t] = strength
            else:
                weights[a] -= strength / (ab * ca)
                weights[b] -= strength / (bc * ab)
                weights[c] -= strength / (ca * bc)
        lit, by_themselves = np.flatnonzero(weights), np.flatnonzero(alone)
        phases, turns, step = weights[lit] + 0j, np.ones(len(lit), np.complex128), 0.0
        for f in range(len(wavenumbers)):
            k = wavenumbers[f]
            # Frequencies are mostly evenly spaced: then a corner's phase always turns by the same angle.
            now = k - wavenumbers[f - 1] if f else k
            if abs(now - step) > SAME * k:
                step = now
                for n in range(len(lit)):
                    turns[n] = np.exp(2j * step * depth[lit[n]])
            total = 0j
            for n in range(len(lit)):
                phases[n] *= turns[n]
                total += phases[n]
            total /= k * k
            for t in by_themselves:
                a, b, c = triangles[t]
                total += alone[t] * _difference(2 * k * depth[a], 2 * k * depth[b], 2 * k * depth[c])
            field[d, f] = 1j * k / (2 * np.pi) * total


@kernel
def _buffer(depth, x, y, triangles, facing):
    """Return the largest depth in each cell, (rows, columns), of triangles that face the radar; x, y: in cells."""
    buffer = np.full((int(y.max()) + 1, int(x.max()) + 1), -np.inf)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x1, y1, x2, y2 = x[b] - x[a], y[b] - y[a], x[c] - x[a], y[c] - y[a]
        area = x1 * y2 - x2 * y1
        if facing[t] <= 0 or area == 0:
            continue
        # Of cells whose middles are within the triangle.
        x0, y0 = x[a] - 0.5, y[a] - 0.5
        first, last = int(np.ceil(x0 + min(0.0, x1, x2))), int(np.floor(x0 + max(0.0, x1, x2)))
        for row in range(int(np.ceil(y0 + min(0.0, y1, y2))), int(np.floor(y0 + max(0.0, y1, y2))) + 1):
            for column in range(first, last + 1):
                s = ((column - x0) * y2 - (row - y0) * x2) / area
                r = ((row - y0) * x1 - (column - x0) * y1) / area
                if s >= 0 and r >= 0 and s + r <= 1:
                    height = depth[a] + s * (depth[b] - depth[a]) + r * (depth[c] - depth[a])
                    buffer[row, column] = max(buffer[row, column], height)
    return buffer


@kernel
def _seen(buffer, depth, x, y, a, b, c, spare, points):
    """Return the share of a triangle's points that no other triangle hides. spare: m, as of the buffer's cells."""
    count = 0
    for p, q, r in points:
        row, column = int(p * y[a] + q * y[b] + r * y[c]), int(p * x[a] + q * x[b] + r * x[c])
        count += p * depth[a] + q * depth[b] + r * depth[c] >= buffer[row, column] - spare
    return count / len(points)


@kernel
def _difference(x, y, z):
    """Return the divided difference of exp(j t) at t = x, y and z: -1/2 exp(j t) where they are the same."""
    # Those that are farthest apart are x and y.
    if abs(z - x) > max(abs(y - x), abs(z - y)):
        y, z = z, y
    elif abs(z - y) > abs(y - x):
        x, z = z, x
    if abs(y - x) < 1e-3:
        mean = (x + y + z) / 3
        return np.exp(1j * mean) * (((x - mean) ** 2 + (y - mean) ** 2 + (z - mean) ** 2) / 48 - 0.5)
    return (_slope(x, z) - _slope(z, y)) / (x - y)


@kernel
def _slope(x, y):
    """Return the divided difference of exp(j t) at t = x and y."""
    return 1j * np.exp(0.5j * (x + y)) * np.sinc((x - y) / (2 * np.pi))
