"""Computations for every pair of triangles or points, compiled by Numba: tiles of the matrix, and right sides.

Array by array, as XLA and NumPy work on a processor, a tile takes twenty passes over memory, which take most of the
time. Here all data of one field triangle and all source triangles of a tile stay in the cache, from distances to
entries between RWG functions. Every call is one thread's work, in a fixed order.

Work arrays are flat, with rows of ROW numbers at constant places: so the compiler can tell that it reads and writes
different numbers, and vectorizes the loops over sources. All kernels are in this one file, because Numba keeps a
compiled kernel until the kernel's own file changes.
"""

from math import factorial

import numpy as np
from numba import njit, types
from numba.extending import overload

from isarflow.scattering import jit
from isarflow.scattering.mom.green import COS, SIN

TILE_TRIANGLES = 384  # of a tile, also where functions reach beyond its block; or directions at once
ROW = TILE_TRIANGLES  # numbers in a row of a work array
kernel = jit.kernel(fastmath=True)
inner = njit(inline="always", fastmath=True, error_model="numpy")
# Where the rows of a work array begin. Those before NU are the points (b, x) of the sources.
NU = 9 * ROW  # nu' (b, x) of the sources
CORNERS = 18 * ROW  # corners (j, x) of the sources
HALVES = 27 * ROW  # entries between half functions (part, i, j)
SUMS = 45 * ROW  # sums over Green's function of `_electric`, later replaced by the sums of `_magnetic`
END = 73 * ROW
# Sums of `_electric`, each of both parts.
BY_COL = SUMS  # over field points, for each source point b
BY_NU = SUMS + 6 * ROW  # over field points, times nu_a . nu'_j, for each source corner j
WEIGHTED = SUMS + 12 * ROW  # over both, times nu_a . nu'_b
TOTAL = SUMS + 14 * ROW  # over both


def _cosine_sine(turns):
    """cos and sin of 2 pi turns, to the rounding of the argument."""


@overload(_cosine_sine, inline="always", jit_options={"fastmath": True})
def _of_type(turns):
    real, size = (np.float32, 4) if turns == types.float32 else (np.float64, 8)
    # Filled up with zeros, which the compiler drops.
    c, s = (tuple(real(c) for c in np.pad(series[size], (0, 12 - len(series[size])))) for series in (COS, SIN))

    def cosine_sine(turns):
        t = turns - np.floor(turns + real(0.5))
        x = t * t
        cos = c[6] + x * (c[7] + x * (c[8] + x * (c[9] + x * (c[10] + x * c[11]))))
        sin = s[6] + x * (s[7] + x * (s[8] + x * (s[9] + x * (s[10] + x * s[11]))))
        cos = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * (c[5] + x * cos)))))
        sin = s[0] + x * (s[1] + x * (s[2] + x * (s[3] + x * (s[4] + x * (s[5] + x * sin)))))
        return cos, t * sin

    return cosine_sine


@inner
def _vector(array):
    """The three numbers of an array, read once."""
    return array[0], array[1], array[2]


@inner
def _green(x, y, z, turns, tiny, one):
    """exp(-j k R) / R between points (x, y, z) apart, both parts, and R; 0 where R = 0, which operators correct."""
    square = max(x * x + y * y + z * z, tiny)
    inverse = one / np.sqrt(square)  # one instruction and a correction; R by division as well would take longer
    r = square * inverse
    cos, sin = _cosine_sine(r * turns)
    amplitude = inverse if square > tiny else one - one
    return cos * amplitude, -sin * amplitude, r


@inner
def _dots(w, row, s, x, y, z):
    """Products of (x, y, z) with three vectors of source s, stored from `row` on."""
    a = x * w[row + s] + y * w[row + ROW + s] + z * w[row + 2 * ROW + s]
    b = x * w[row + 3 * ROW + s] + y * w[row + 4 * ROW + s] + z * w[row + 5 * ROW + s]
    c = x * w[row + 6 * ROW + s] + y * w[row + 7 * ROW + s] + z * w[row + 8 * ROW + s]
    return a, b, c


@kernel
def _electric(w, count, point, nu, turns, tiny, one):
    """Add one field point's part to the sums of Green's function from which `_electric_halves` makes entries."""
    nu, (x, y, z) = _vector(nu), _vector(point)
    for s in range(count):
        r0, i0, _ = _green(x - w[s], y - w[ROW + s], z - w[2 * ROW + s], turns, tiny, one)
        r1, i1, _ = _green(x - w[3 * ROW + s], y - w[4 * ROW + s], z - w[5 * ROW + s], turns, tiny, one)
        r2, i2, _ = _green(x - w[6 * ROW + s], y - w[7 * ROW + s], z - w[8 * ROW + s], turns, tiny, one)
        d0, d1, d2 = _dots(w, NU, s, nu[0], nu[1], nu[2])
        w[BY_COL + s] += r0
        w[BY_COL + ROW + s] += i0
        w[BY_COL + 2 * ROW + s] += r1
        w[BY_COL + 3 * ROW + s] += i1
        w[BY_COL + 4 * ROW + s] += r2
        w[BY_COL + 5 * ROW + s] += i2
        w[WEIGHTED + s] += r0 * d0 + r1 * d1 + r2 * d2
        w[WEIGHTED + ROW + s] += i0 * d0 + i1 * d1 + i2 * d2
        r, i = r0 + r1 + r2, i0 + i1 + i2
        w[BY_NU + s] += r * d0
        w[BY_NU + ROW + s] += i * d0
        w[BY_NU + 2 * ROW + s] += r * d1
        w[BY_NU + 3 * ROW + s] += i * d1
        w[BY_NU + 4 * ROW + s] += r * d2
        w[BY_NU + 5 * ROW + s] += i * d2
        w[TOTAL + s] += r
        w[TOTAL + ROW + s] += i


@inner
def _electric_halves(w, count, nu, charge, half, out):
    """z between half function i of the field triangle and all of the sources, without their l / 6.

    The sum of `reference.electric` between two halves, by three points a triangle: a point has the area A / 3, and
    l / (2 A) A / 3 = l / 6, so that z_ij / (l_i l'_j / 36) is the sum over points a and b of

        G_ab [(r_a - v_i) . (r'_b - v'_j) - 4 / k^2].

    About the centroids corners are nu, and points rho_a = nu_a / 2: the barycentric coordinates are 2/3, 1/6, 1/6, and
    the three nu add up to 0. So (rho_a - nu_i) . (rho'_b - nu'_j) has four terms, whose sums are, in this order,
    WEIGHTED / 4, BY_COL . nu_i / 2, BY_NU_j / 2 and TOTAL nu_i . nu'_j.
    """
    x, y, z = _vector(nu)
    for s in range(count):
        d0, d1, d2 = _dots(w, NU, s, x, y, z)
        r, i = w[TOTAL + s], w[TOTAL + ROW + s]
        by_col = w[BY_COL + s] * d0 + w[BY_COL + 2 * ROW + s] * d1 + w[BY_COL + 4 * ROW + s] * d2
        first = half * (half * w[WEIGHTED + s] - by_col)
        w[out + s] = first - half * w[BY_NU + s] + (d0 - charge) * r
        w[out + ROW + s] = first - half * w[BY_NU + 2 * ROW + s] + (d1 - charge) * r
        w[out + 2 * ROW + s] = first - half * w[BY_NU + 4 * ROW + s] + (d2 - charge) * r
        by_col = w[BY_COL + ROW + s] * d0 + w[BY_COL + 3 * ROW + s] * d1 + w[BY_COL + 5 * ROW + s] * d2
        first = half * (half * w[WEIGHTED + ROW + s] - by_col)
        w[out + 9 * ROW + s] = first - half * w[BY_NU + ROW + s] + (d0 - charge) * i
        w[out + 10 * ROW + s] = first - half * w[BY_NU + 3 * ROW + s] + (d1 - charge) * i
        w[out + 11 * ROW + s] = first - half * w[BY_NU + 5 * ROW + s] + (d2 - charge) * i


@inner
def _sources(w, s, center, normal, nu, half, sixth):
    """Heights of the sources' corners above the field triangle and nu . (c - v'_j), at corners j and at points b."""
    n0, n1, n2 = _dots(w, CORNERS, s, normal[0], normal[1], normal[2])
    a0, a1, a2 = _dots(w, CORNERS, s, nu[0], nu[1], nu[2])
    n = center[0] * normal[0] + center[1] * normal[1] + center[2] * normal[2]
    a = center[0] * nu[0] + center[1] * nu[1] + center[2] * nu[2]
    h0, h1, h2, a0, a1, a2 = n0 - n, n1 - n, n2 - n, a - a0, a - a1, a - a2
    h, a = sixth * (h0 + h1 + h2), sixth * (a0 + a1 + a2)
    p0, p1, p2, q0, q1, q2 = h + half * h0, h + half * h1, h + half * h2, a + half * a0, a + half * a1, a + half * a2
    return h0, h1, h2, a0, a1, a2, p0, p1, p2, q0, q1, q2


@kernel
def _magnetic(w, count, point, nu, center, normal, corner_products, constants):
    """Add one field point's part to the sums from which half functions of m follow (see `operators.cfie`).

    The integrand of `reference.magnetic` is (r - v_i) . n x (g D x (r' - v'_j)), with D = r - r' and grad G = g D,
    g = -(1 + j k R) exp(-j k R) / R^3. D x (r' - v'_j) = D x w with w = r - v'_j, as both differ by D; and
    n x (D x w) = D (n . w) - w (n . D). On the field triangle, of centroid c, n . w = -zeta'_j, v'_j's height above it,
    and n . D = -n . (r' - c). So the integrand is g (r - v_i) . [w (n . (r' - c)) - D zeta'_j].
    corner_products: (rho_a - nu_i) . rho_a of this a. A sum's rows: of tangential parts for each i, of normal ones for
    each i, of nu_a . (c - v'_j) times heights for each j, of g for each b, of heights; of both parts.
    """
    turns, tiny, half, one = constants[0], constants[2], constants[3], constants[4]
    k, sixth = constants[5], constants[8]
    nu, center, normal, (x, y, z) = _vector(nu), _vector(center), _vector(normal), _vector(point)
    corner_products = _vector(corner_products)
    for s in range(count):
        r0, i0, d0 = _green(x - w[s], y - w[ROW + s], z - w[2 * ROW + s], turns, tiny, one)
        r1, i1, d1 = _green(x - w[3 * ROW + s], y - w[4 * ROW + s], z - w[5 * ROW + s], turns, tiny, one)
        r2, i2, d2 = _green(x - w[6 * ROW + s], y - w[7 * ROW + s], z - w[8 * ROW + s], turns, tiny, one)
        _, _, _, a0, a1, a2, h0, h1, h2, p0, p1, p2 = _sources(w, s, center, normal, nu, half, sixth)
        q0, q1, q2 = one / (d0 * d0), one / (d1 * d1), one / (d2 * d2)
        d0, d1, d2 = k * d0, k * d1, k * d2
        b0, b1, b2 = (d0 * i0 - r0) * q0, (d1 * i1 - r1) * q1, (d2 * i2 - r2) * q2
        across = half * (b0 * p0 + b1 * p1 + b2 * p2)
        _add_magnetic(w, s, SUMS, b0, b1, b2, h0, h1, h2, across, a0, a1, a2, corner_products, half)
        b0, b1, b2 = -(i0 + d0 * r0) * q0, -(i1 + d1 * r1) * q1, -(i2 + d2 * r2) * q2
        across = half * (b0 * p0 + b1 * p1 + b2 * p2)
        _add_magnetic(w, s, SUMS + 14 * ROW, b0, b1, b2, h0, h1, h2, across, a0, a1, a2, corner_products, half)


@inner
def _add_magnetic(w, s, begin, b0, b1, b2, h0, h1, h2, across, a0, a1, a2, corner_products, half):
    by_row, lifted = b0 + b1 + b2, b0 * h0 + b1 * h1 + b2 * h2
    w[begin + s] += by_row * corner_products[0] + across
    w[begin + ROW + s] += by_row * corner_products[1] + across
    w[begin + 2 * ROW + s] += by_row * corner_products[2] + across
    w[begin + 3 * ROW + s] += lifted * corner_products[0]
    w[begin + 4 * ROW + s] += lifted * corner_products[1]
    w[begin + 5 * ROW + s] += lifted * corner_products[2]
    w[begin + 6 * ROW + s] += half * lifted * a0
    w[begin + 7 * ROW + s] += half * lifted * a1
    w[begin + 8 * ROW + s] += half * lifted * a2
    w[begin + 9 * ROW + s] += b0
    w[begin + 10 * ROW + s] += b1
    w[begin + 11 * ROW + s] += b2
    w[begin + 12 * ROW + s] += lifted


@inner
def _combined_halves(w, count, i, nu, center, normal, constants, out):
    """Replace z between half function i and all of the sources by alpha z + (1 - alpha) m."""
    half, alpha, weight, sixth = constants[3], constants[6], constants[7], constants[8]
    nu, center, normal = _vector(nu), _vector(center), _vector(normal)
    for s in range(count):
        h0, h1, h2, a0, a1, a2, _, _, _, p0, p1, p2 = _sources(w, s, center, normal, nu, half, sixth)
        r0, r1, r2 = _magnetic_halves(w, s, SUMS, i * ROW, h0, h1, h2, a0, a1, a2, p0, p1, p2)
        i0, i1, i2 = _magnetic_halves(w, s, SUMS + 14 * ROW, i * ROW, h0, h1, h2, a0, a1, a2, p0, p1, p2)
        w[out + s] = alpha * w[out + s] - weight * i0
        w[out + ROW + s] = alpha * w[out + ROW + s] - weight * i1
        w[out + 2 * ROW + s] = alpha * w[out + 2 * ROW + s] - weight * i2
        w[out + 9 * ROW + s] = alpha * w[out + 9 * ROW + s] + weight * r0
        w[out + 10 * ROW + s] = alpha * w[out + 10 * ROW + s] + weight * r1
        w[out + 11 * ROW + s] = alpha * w[out + 11 * ROW + s] + weight * r2


@inner
def _magnetic_halves(w, s, begin, corner_row, h0, h1, h2, a0, a1, a2, p0, p1, p2):
    by_col = w[begin + 9 * ROW + s] * p0 + w[begin + 10 * ROW + s] * p1 + w[begin + 11 * ROW + s] * p2
    tangential = w[begin + corner_row + s] - by_col
    normal, lifted = w[begin + 3 * ROW + corner_row + s], w[begin + 12 * ROW + s]
    m0 = normal + w[begin + 6 * ROW + s] - lifted * a0 - h0 * tangential
    m1 = normal + w[begin + 7 * ROW + s] - lifted * a1 - h1 * tangential
    m2 = normal + w[begin + 8 * ROW + s] - lifted * a2 - h2 * tangential
    return m0, m1, m2


@kernel
def tile(out, rows, cols, near, characters, constants, combined):
    """Add the tile between functions of two blocks, in every parity, to `out`.

    out: flat, both parts of an entry beside each other; of each parity (rows, columns), one after the other.
    rows, cols: as `assembly` makes them of a block; near: corrections of near pairs, by `assembly`; characters: (G, G)
    constants: k / (2 pi), 4 / k^2, least R^2, 1/2, 1, k, alpha, (1 - alpha) / k, 1/6; combined: with the MFIE
    """
    triangles, points, nu, centers, normals, corner_products, starts, functions, weights, row_ends = rows
    (sources, col_triangles, halves, signs, col_ends), (begins, of_pairs, corrections) = cols, near
    turns, charge, tiny, half, one = constants[0], constants[1], constants[2], constants[3], constants[4]
    images, count = len(sources), len(col_triangles)
    w, z = np.empty((images, END), out.dtype), np.empty((images, SUMS - HALVES), out.dtype)
    place = np.full(begins.shape[1] + 1, -1, np.int64)
    place[col_triangles] = np.arange(count)
    w[:, :HALVES] = sources
    row = np.empty((6, col_ends[-1]), out.dtype)  # (part, i)
    for t in range(len(triangles)):
        z[:] = 0
        for g in range(images):
            v = w[g]
            v[SUMS:] = 0
            for a in range(3):
                _electric(v, count, points[t, a], nu[t, a], turns, tiny, one)
            _electric_halves(v, count, nu[t, 0], charge, half, HALVES)
            _electric_halves(v, count, nu[t, 1], charge, half, HALVES + 3 * ROW)
            _electric_halves(v, count, nu[t, 2], charge, half, HALVES + 6 * ROW)
            if combined:
                v[SUMS:] = 0
                for a in range(3):
                    _magnetic(
                        v, count, points[t, a], nu[t, a], centers[t], normals[t], corner_products[t, a], constants
                    )
                _combined_halves(v, count, 0, nu[t, 0], centers[t], normals[t], constants, HALVES)
                _combined_halves(v, count, 1, nu[t, 1], centers[t], normals[t], constants, HALVES + 3 * ROW)
                _combined_halves(v, count, 2, nu[t, 2], centers[t], normals[t], constants, HALVES + 6 * ROW)
            for pair in range(begins[g, triangles[t]], begins[g, triangles[t] + 1]):
                s = place[of_pairs[pair]]
                if s >= 0:
                    for entry in range(18):
                        v[HALVES + entry * ROW + s] += corrections[pair, entry]
            for p in range(images):
                character = characters[p, g]
                for n in range(SUMS - HALVES):
                    z[p, n] += character * v[HALVES + n]
        end = 0
        for p in range(images):
            first, width = col_ends[p], col_ends[p + 1] - col_ends[p]
            begin, end = end, end + 2 * width * (row_ends[p + 1] - row_ends[p])
            for i in range(6):
                _gather(row[i], z[p, 3 * i * ROW :], halves, signs, first, width)
            for i in range(3):
                for e in range(starts[p, 3 * t + i], starts[p, 3 * t + i + 1]):
                    entry_begin = begin + 2 * width * (functions[e] - row_ends[p])
                    _scatter(out[entry_begin : entry_begin + 2 * width], row[i], row[3 + i], weights[e], width)


@kernel
def _gather(row, z, halves, signs, first, width):
    """The row between one half function and functions, from the row between it and half functions."""
    for n in range(width):
        m = first + n
        row[n] = signs[0, m] * z[halves[0, m]] + signs[1, m] * z[halves[1, m]]


@kernel
def _gather_more(row, z, halves, signs, first, width):
    """What `_gather` lacks where functions are of more than two halves."""
    for h in range(2, len(halves)):
        for n in range(width):
            row[n] += signs[h, first + n] * z[halves[h, first + n]]


@kernel
def _scatter(out, real, imag, weight, width):
    for n in range(width):
        out[2 * n] += weight * real[n]
        out[2 * n + 1] += weight * imag[n]


# Of a dielectric body, beyond the sums of `_electric`: in `SUMS`, and what `_dielectric_halves` adds up in both media.
GRADIENT = SUMS + 16 * ROW  # over the mean of grad G on the source, three vectors' both parts; and of it times rho_a
CURRENTS = END  # entries between electric, between magnetic and between both currents, each as HALVES
DIELECTRIC_END = CURRENTS + 54 * ROW


def _decay(x):
    """exp(-x) for x >= 0, to the rounding of x."""


@overload(_decay, inline="always", jit_options={"fastmath": True})
def _decay_of_type(x):
    single = x == types.float32
    real, whole, bias, digits = (np.float32, np.int32, 127, 23) if single else (np.float64, np.int64, 1023, 52)
    # Filled up with zeros, which the compiler drops.
    c = tuple(real(1 / factorial(n) if n < (8 if single else 14) else 0) for n in range(14))
    octave, most = real(np.log(2)), real(bias - 1)

    def decay(x):
        y = min(x / octave, most)
        halvings = np.floor(y + real(0.5))
        t = (halvings - y) * octave
        e = c[7] + t * (c[8] + t * (c[9] + t * (c[10] + t * (c[11] + t * (c[12] + t * c[13])))))
        e = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * (c[5] + t * (c[6] + t * e))))))
        # A power of two is its exponent alone.
        return e * whole((whole(bias) - whole(halvings)) << whole(digits)).view(real)

    return decay


@inner
def _lossy(x, y, z, medium, tiny, one):
    """G = exp(-j k R) / R between points (x, y, z) apart and g of grad G = g (x, y, z), both parts; k is complex.

    g = -(1 + j k R) G / R^2; medium: see `tile_of_body`.
    """
    turns, k, loss = medium[0], medium[1], medium[2]
    r, i, distance = _green(x, y, z, turns, tiny, one)
    decay, a, b = _decay(loss * distance), one + loss * distance, k * distance
    r, i, square = r * decay, i * decay, one / (distance * distance)
    return r, i, (b * i - a * r) * square, -(a * i + b * r) * square


@kernel
def _dielectric(w, count, point, nu, medium, constants):
    """Add one field point's part to the sums of `_electric`, in a medium, and to those of GRADIENT."""
    tiny, half, one = constants[0], constants[1], constants[2]
    nu, (x, y, z), medium = _vector(nu), _vector(point), _vector(medium)
    for s in range(count):
        x0, y0, z0 = x - w[s], y - w[ROW + s], z - w[2 * ROW + s]
        x1, y1, z1 = x - w[3 * ROW + s], y - w[4 * ROW + s], z - w[5 * ROW + s]
        x2, y2, z2 = x - w[6 * ROW + s], y - w[7 * ROW + s], z - w[8 * ROW + s]
        r0, i0, a0, b0 = _lossy(x0, y0, z0, medium, tiny, one)
        r1, i1, a1, b1 = _lossy(x1, y1, z1, medium, tiny, one)
        r2, i2, a2, b2 = _lossy(x2, y2, z2, medium, tiny, one)
        d0, d1, d2 = _dots(w, NU, s, nu[0], nu[1], nu[2])
        _add_electric(w, s, 0, r0, r1, r2, d0, d1, d2)
        _add_electric(w, s, ROW, i0, i1, i2, d0, d1, d2)
        p, q, r = half * nu[0], half * nu[1], half * nu[2]
        u, v = a0 * x0 + a1 * x1 + a2 * x2, a0 * y0 + a1 * y1 + a2 * y2
        _add_gradient(w, s, 0, u, v, a0 * z0 + a1 * z1 + a2 * z2, p, q, r)
        u, v = b0 * x0 + b1 * x1 + b2 * x2, b0 * y0 + b1 * y1 + b2 * y2
        _add_gradient(w, s, ROW, u, v, b0 * z0 + b1 * z1 + b2 * z2, p, q, r)


@inner
def _add_electric(w, s, part, g0, g1, g2, d0, d1, d2):
    w[BY_COL + part + s] += g0
    w[BY_COL + 2 * ROW + part + s] += g1
    w[BY_COL + 4 * ROW + part + s] += g2
    total = g0 + g1 + g2
    w[BY_NU + part + s] += total * d0
    w[BY_NU + 2 * ROW + part + s] += total * d1
    w[BY_NU + 4 * ROW + part + s] += total * d2
    w[WEIGHTED + part + s] += g0 * d0 + g1 * d1 + g2 * d2
    w[TOTAL + part + s] += total


@inner
def _add_gradient(w, s, part, x, y, z, p, q, r):
    w[GRADIENT + part + s] += x
    w[GRADIENT + 2 * ROW + part + s] += y
    w[GRADIENT + 4 * ROW + part + s] += z
    w[GRADIENT + 6 * ROW + part + s] += y * r - z * q
    w[GRADIENT + 8 * ROW + part + s] += z * p - x * r
    w[GRADIENT + 10 * ROW + part + s] += x * q - y * p


@kernel
def _dielectric_halves(w, count, i, nu, center, medium, constants):
    """Add a medium's entries between half function i and all of the sources, from sums and `_electric_halves`.

    The terms of `mom.dielectric`, without their l / 6. With c the field triangle's centroid, H the sum of grad G and T
    that of grad G x rho_a, f . grad G x f' is -(T + nu_i x H) . (c - v'_j) - T . nu_i.
    """
    charge_r, charge_i, eps_r, eps_i = medium[3], medium[4], medium[5], medium[6]
    outer_charge, weight = constants[3], constants[4]
    nu, center = _vector(nu), _vector(center)
    row = CURRENTS + 3 * i * ROW
    for j in range(3):
        corner = CORNERS + 3 * j * ROW
        for s in range(count):
            r, i_, p, q = w[TOTAL + s], w[TOTAL + ROW + s], w[HALVES + j * ROW + s], w[HALVES + (9 + j) * ROW + s]
            out = row + j * ROW + s
            w[out] += p - (charge_r * r - charge_i * i_)
            w[out + 9 * ROW] += q - (charge_r * i_ + charge_i * r)
            w[out + 18 * ROW] -= eps_r * p - eps_i * q - outer_charge * r
            w[out + 27 * ROW] -= eps_r * q + eps_i * p - outer_charge * i_
            x, y, z = center[0] - w[corner + s], center[1] - w[corner + ROW + s], center[2] - w[corner + 2 * ROW + s]
            w[out + 36 * ROW] += weight * _turned(w, s, 1, nu, x, y, z)
            w[out + 45 * ROW] -= weight * _turned(w, s, 0, nu, x, y, z)


@inner
def _turned(w, s, part, nu, x, y, z):
    begin = GRADIENT + part * ROW + s
    a, b, c = w[begin], w[begin + 2 * ROW], w[begin + 4 * ROW]
    p, q, r = w[begin + 6 * ROW], w[begin + 8 * ROW], w[begin + 10 * ROW]
    along = p * nu[0] + q * nu[1] + r * nu[2]
    p, q, r = p + nu[1] * c - nu[2] * b, q + nu[2] * a - nu[0] * c, r + nu[0] * b - nu[1] * a
    return -(p * x + q * y + r * z) - along


@kernel
def tile_of_body(out, rows, cols, near, characters, media, constants):
    """Add the tile between functions of two blocks of a dielectric body, in every parity, to `out` (see `tile`).

    A triangle has six half functions: of electric currents, then of magnetic ones. characters: (2, G, G) of both kinds
    media: of each k' / (2 pi), k', k'', and both parts of 4 / k^2 and of the permittivity, with k = k' - j k''
    constants: least R^2, 1/2, 1, 4 / k^2 and 1 / k outside
    """
    triangles, points, nu, centers, _, _, starts, functions, weights, row_ends = rows
    (sources, col_triangles, halves, signs, col_ends), (begins, of_pairs, corrections) = cols, near
    half, zero = constants[1], constants[2] - constants[2]
    images, count = len(sources), len(col_triangles)
    w = np.empty((images, DIELECTRIC_END), out.dtype)
    z = np.empty((images, 2, 6, 6 * ROW), out.dtype)  # kind of the field function; part, i; kind of the source, j
    place = np.full(begins.shape[1] + 1, -1, np.int64)
    place[col_triangles] = np.arange(count)
    w[:, :HALVES] = sources
    row = np.empty((2, 6, col_ends[-1]), out.dtype)
    for t in range(len(triangles)):
        z[:] = 0
        for g in range(images):
            v = w[g]
            v[CURRENTS:] = 0
            for m in range(len(media)):
                v[SUMS:CURRENTS] = 0
                for a in range(3):
                    _dielectric(v, count, points[t, a], nu[t, a], media[m], constants)
                for i in range(3):
                    _electric_halves(v, count, nu[t, i], zero, half, HALVES)
                    _dielectric_halves(v, count, i, nu[t, i], centers[t], media[m], constants)
            for pair in range(begins[g, triangles[t]], begins[g, triangles[t] + 1]):
                s = place[of_pairs[pair]]
                if s >= 0:
                    for entry in range(54):
                        v[CURRENTS + entry * ROW + s] += corrections[pair, entry]
            for p in range(images):
                for kind in range(2):
                    for other in range(2):
                        begin = CURRENTS + (18 * kind if kind == other else 36) * ROW
                        _add_image(z[p, kind], v, begin, other, characters[other, p, g], count)
        end = 0
        for p in range(images):
            first, width = col_ends[p], col_ends[p + 1] - col_ends[p]
            begin, end = end, end + 2 * width * (row_ends[p + 1] - row_ends[p])
            for kind in range(2):
                for i in range(6):
                    _gather(row[kind, i], z[p, kind, i], halves, signs, first, width)
                    _gather_more(row[kind, i], z[p, kind, i], halves, signs, first, width)
                for i in range(3):
                    number = 6 * t + 3 * kind + i
                    for e in range(starts[p, number], starts[p, number + 1]):
                        to = begin + 2 * width * (functions[e] - row_ends[p])
                        _scatter(out[to : to + 2 * width], row[kind, i], row[kind, 3 + i], weights[e], width)


@kernel
def _add_image(z, v, begin, other, character, count):
    for i in range(6):
        for j in range(3):
            for s in range(count):
                z[i, (3 * other + j) * ROW + s] += character * v[begin + (3 * i + j) * ROW + s]


# Where the rows of the work array of `excite` begin. Those before TESTED are u.
TESTED = 3 * ROW  # the tested polarization
TURN = 6 * ROW  # the phase of the centroid, in turns
OF_HALVES = 7 * ROW  # the integrals of half functions, (part, i)
OF_WAVES = 13 * ROW  # the end
# Coefficients of the series in `_mean`, real and imaginary parts in turn.
SERIES = tuple((-1.0) ** (n // 2) * 2 / factorial(n + 3) for n in range(10))


@kernel
def excite(out, u, p, triangles, normals, starts, functions, weights, characters, turns, alpha, one):
    """Add int F . [alpha E + (1 - alpha) eta n x H] dS of plane waves to `out`, (N, 2 D): both parts side by side.

    u, p: (3, D), D <= ROW; triangles: (G, T, 3, 3) and normals: (G, T, 3) at each image; starts, functions, weights:
    for each parity and half function 3 t + i where, in which functions and by how much, l / 2, it takes part;
    turns: k / (2 pi); one: 1 of out's type. Phases are measured from a triangle's centroid, where single precision has
    enough digits.
    """
    images, count = len(triangles), u.shape[1]
    w, z = np.empty(OF_WAVES, out.dtype), np.empty((images, OF_WAVES - OF_HALVES), out.dtype)
    coefficients, k = np.array(SERIES).astype(out.dtype), out.dtype.type(2 * np.pi * turns)
    for s in range(count):
        w[s], w[ROW + s], w[2 * ROW + s] = u[0, s], u[1, s], u[2, s]
    for t in range(triangles.shape[1]):
        z[:] = 0
        for g in range(images):
            nu, center = np.empty((3, 3), out.dtype), np.empty(3)
            for x in range(3):
                center[x] = (triangles[g, t, 0, x] + triangles[g, t, 1, x] + triangles[g, t, 2, x]) / 3
                for i in range(3):
                    nu[i, x] = triangles[g, t, i, x] - center[x]
            _centroid(w, u, count, center[0] * turns, center[1] * turns, center[2] * turns)
            if alpha != 1 or t == g == 0:
                _tested(w, u, p, count, normals[g, t, 0], normals[g, t, 1], normals[g, t, 2], alpha)
            _wave(w, count, nu, k, coefficients, one)
            for parity in range(images):
                character = characters[parity, g]
                for n in range(OF_WAVES - OF_HALVES):
                    z[parity, n] += character * w[OF_HALVES + n]
        for parity in range(images):
            for i in range(3):
                for e in range(starts[parity, 3 * t + i], starts[parity, 3 * t + i + 1]):
                    _scatter(out[functions[e]], z[parity, i * ROW :], z[parity, (3 + i) * ROW :], weights[e], count)


@kernel
def _centroid(w, u, count, x, y, z):
    """The centroid's phase, reduced to one turn before it loses digits."""
    for s in range(count):
        phase = x * u[0, s] + y * u[1, s] + z * u[2, s]
        w[TURN + s] = phase - np.floor(phase + 0.5)


@kernel
def _tested(w, u, p, count, x, y, z, alpha):
    """alpha p + (1 - alpha) [(n . u) p - (n . p) u]: see `operators.cfie`."""
    for s in range(count):
        of_u, of_p = x * u[0, s] + y * u[1, s] + z * u[2, s], x * p[0, s] + y * p[1, s] + z * p[2, s]
        a, b = alpha + (1 - alpha) * of_u, (1 - alpha) * of_p
        w[TESTED + s] = a * p[0, s] - b * u[0, s]
        w[TESTED + ROW + s] = a * p[1, s] - b * u[1, s]
        w[TESTED + 2 * ROW + s] = a * p[2, s] - b * u[2, s]


@kernel
def _wave(w, count, nu, k, coefficients, one):
    """Means over a triangle with corners nu_i of (rho - nu_i) . p exp(j phase): the waves' integrals of half functions.

    At the corners the phases are x_i beyond the centroid's. The mean of lambda_i phase^n, lambda_i linear, 1 at corner
    i and 0 at the others, is 2 n! / (n + 3)! g_n, with g_n = h_n + x_i g_(n-1), and h_n the sum of all products of n of
    the x_i, which by Newton's identities is e_3 h_(n-3) - e_2 h_(n-2), as e_1 = 0 (elementary symmetric polynomials).
    """
    a, b, c, f = _vector(nu[0]), _vector(nu[1]), _vector(nu[2]), coefficients
    for s in range(count):
        x, y, z = k * w[s], k * w[ROW + s], k * w[2 * ROW + s]
        x0, x1, x2 = _dot(a, x, y, z), _dot(b, x, y, z), _dot(c, x, y, z)
        x, y, z = w[TESTED + s], w[TESTED + ROW + s], w[TESTED + 2 * ROW + s]
        p0, p1, p2 = _dot(a, x, y, z), _dot(b, x, y, z), _dot(c, x, y, z)
        h2, h3 = -(x0 * x1 + x1 * x2 + x2 * x0), x0 * x1 * x2
        h4, h5, h6 = h2 * h2, 2 * h2 * h3, h2 * h2 * h2 + h3 * h3
        h7, h8 = h2 * h5 + h3 * h4, h2 * h6 + h3 * h5
        h9 = h2 * h7 + h3 * h6
        h = h2, h3, h4, h5, h6, h7, h8, h9
        r0, i0 = _mean(x0, h, f, one)
        r1, i1 = _mean(x1, h, f, one)
        r2, i2 = _mean(x2, h, f, one)
        r, i = r0 + r1 + r2, i0 + i1 + i2
        along_r, along_i = r0 * p0 + r1 * p1 + r2 * p2, i0 * p0 + i1 * p1 + i2 * p2
        cos, sin = _cosine_sine(w[TURN + s])
        a_r, a_i = along_r * cos - along_i * sin, along_r * sin + along_i * cos
        r, i = r * cos - i * sin, r * sin + i * cos
        w[OF_HALVES + s] = a_r - p0 * r
        w[OF_HALVES + ROW + s] = a_r - p1 * r
        w[OF_HALVES + 2 * ROW + s] = a_r - p2 * r
        w[OF_HALVES + 3 * ROW + s] = a_i - p0 * i
        w[OF_HALVES + 4 * ROW + s] = a_i - p1 * i
        w[OF_HALVES + 5 * ROW + s] = a_i - p2 * i


@inner
def _dot(a, x, y, z):
    return a[0] * x + a[1] * y + a[2] * z


@inner
def _mean(x, h, f, one):
    """The mean of lambda_i exp(j phase), both parts, at phases small enough for ten terms of the series."""
    g2 = h[0] + x * x
    g3 = h[1] + x * g2
    g4 = h[2] + x * g3
    g5 = h[3] + x * g4
    g6 = h[4] + x * g5
    g7 = h[5] + x * g6
    g8 = h[6] + x * g7
    g9 = h[7] + x * g8
    real = f[0] * one + f[2] * g2 + f[4] * g4 + f[6] * g6 + f[8] * g8
    return real, f[1] * x + f[3] * g3 + f[5] * g5 + f[7] * g7 + f[9] * g9
