"""Directions to the radar, and the few sampled ones from which a sweep over azimuth is interpolated.

    u = (cos el cos az, cos el sin az, sin el),   V = du/del,   H = (-sin az, cos az, 0)

On a ring of constant elevation the excitation of a function at cylindrical radius rho is exp(j x cos(az - phi)), with
x = k rho cos(el), times an entry of V or H. By Jacobi and Anger its Fourier coefficients of order m are Bessel
functions J_m(x), which vanish beyond m = x (Bucci, Franceschetti, IEEE Trans. AP-35, 1987, bound the field's degrees of
freedom in this way). Therefore the excitation at a few equally spaced azimuths determines that at all azimuths, to
rounding, and the matrix between the few, V_i^T z^-1 V_j, determines the amplitude, V(az)^T z^-1 V(az), at all azimuths.
"""

import functools
from dataclasses import dataclass
from itertools import islice, pairwise, product

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import zpstrf
from scipy.special import jv

from isarflow.core.sweep import unit_vectors

TOLERANCE = {np.dtype(np.complex64): 1e-6, np.dtype(np.complex128): 1e-13}  # of the excitation's largest value
ROWS_PER_COLUMN = 8  # rows of an excitation that choose its skeleton, for each column
LEAST_ROWS = 512  # that choose a skeleton
SKELETON_ERROR = 2e-7  # relative, of these rows: thrice the rounding
CHECK_ERROR = (
    1e-4  # relative, of an entry of other rows: a function at a target's tip is rarely among those that choose
)
COMMON_TOLERANCE = 1e-5  # of a matrix, down to which SKELETON_ERROR holds
LEAST_SKELETON_ERROR = 3e-8  # half the rounding


@dataclass(frozen=True)
class Samples:
    """The sampled directions, ring by ring, and the weights that interpolate the excitation to all azimuths."""

    u: np.ndarray  # (K, 3) directions to the radar
    polarizations: dict  # V and H, (K, 3) each
    rings: list  # for each elevation its slice of K
    weights: list  # for each elevation V and H, (G, A, k): for each parity, from the ring's k samples to all azimuths

    def parts(self, ways, columns=np.inf):
        """The rings in runs of about `columns` directions, each with every polarization of `ways`, V and H.

        Yields for each run its ring numbers, u (D, 3) and polarizations (D, 3), and for each of the rings its slice of
        D: all its directions with the first polarization, then with the next.
        """
        run, count = [], 0
        for number, ring in enumerate(self.rings):
            run.append(number)
            count += len(ways) * (ring.stop - ring.start)
            if count >= columns or number == len(self.rings) - 1:
                of_run = [self.rings[number] for number in run]
                u = np.concatenate([self.u[ring] for ring in of_run for _ in ways])
                polarization = np.concatenate([self.polarizations[way][ring] for ring in of_run for way in ways])
                ends = np.cumsum([0, *(len(ways) * (ring.stop - ring.start) for ring in of_run)]).tolist()
                yield run, u, polarization, [slice(*pair) for pair in pairwise(ends)]
                run, count = [], 0


def directions(elevation, azimuth):
    """Unit vectors u towards the radar, V and H, (E, A, 3) each, on a grid of elevations and azimuths in degrees."""
    return unit_vectors(np.asarray(elevation)[:, None], np.asarray(azimuth)[None, :])


def rings(elevation, azimuth):
    """Sort directions one by one, (D,) each in degrees, into rings of constant elevation, lowest first.

    A ring is its elevation, its azimuths (A,), ascending and each once, its directions' places in these, and their
    numbers.
    """
    result = []
    for angle in np.unique(elevation):
        numbers = np.flatnonzero(elevation == angle)
        azimuths, places = np.unique(azimuth[numbers], return_inverse=True)
        result.append((angle, azimuths, places, numbers))
    return result


def sample(surface, wavenumber, elevation, azimuth, dtype):
    """The Samples of a sweep: on each ring equally spaced azimuths or the given ones, whichever are fewer.

    surface: about the z axis (see `middle_of`); wavenumber: rad/m; elevation: (E,) degrees; azimuth: (A,) of all rings,
    or a list with the azimuths of each; dtype: to its rounding the weights are exact. Mirror images are sampled once.
    """
    radius = np.linalg.norm(surface.vertices[..., :2], axis=-1).max()
    of_rings = azimuth if np.ndim(azimuth[0]) else [azimuth] * len(elevation)
    waves, rings, weights, end, before = [], [], [], 0, None
    for angle, azimuth in zip(elevation, of_rings, strict=True):
        if before is None or not np.array_equal(azimuth, before):
            given, before = _fold(surface, azimuth), azimuth
        count = samples_of_ring(wavenumber * radius * np.cos(np.deg2rad(angle)), TOLERANCE[np.dtype(dtype)])
        spaced = _fold(surface, np.arange(count) * 360 / count)
        fewer = len(spaced[0]) < len(given[0])
        sampled, folds = spaced if fewer else given
        unfolded = _periodic(azimuth, count) if fewer else np.eye(len(azimuth))
        waves.append(np.stack([x[0] for x in directions([angle], sampled)]))
        rings.append(slice(end, end + len(sampled)))
        weights.append({letter: unfolded @ fold for letter, fold in folds.items()})
        end += len(sampled)
    u, v, h = np.concatenate(waves, 1)
    return Samples(u, {"V": v, "H": h}, rings, weights)


def skeletons(excitations, groups, pool, tolerance=None):
    """Keep some columns of each group (slice) of a list of excitations (N, D), of single precision: their `skeleton`.

    Yields for each excitation these, (N, d), the groups that they form, and the weights of each. pool: a `Pool`;
    tolerance: of the compressed matrix that they are solved with, None for a whole one. The weights sum that matrix's
    errors, some three times as large where few columns are kept: with a tolerance finer than COMMON_TOLERANCE more are.
    """
    chosen = max(SKELETON_ERROR * min(1, (tolerance or COMMON_TOLERANCE) / COMMON_TOLERANCE), LEAST_SKELETON_ERROR)
    chosen_columns = pool.map(lambda part: skeleton(part[0][:, part[1]], chosen), product(excitations, groups))
    for excitation in excitations:
        numbers, weights = zip(*islice(chosen_columns, len(groups)), strict=True)
        ends = np.cumsum([0, *map(len, numbers)]).tolist()
        columns = np.concatenate([group.start + place for group, place in zip(groups, numbers, strict=True)])
        yield np.take(excitation, columns, axis=1), [slice(*pair) for pair in pairwise(ends)], weights


def skeleton(excitation, chosen=SKELETON_ERROR):
    """Choose columns of an excitation (N, K) from which all follow: their numbers (k,), and the weights (k, K).

    chosen: the relative error at which no more are added.
    V and H of a ring span less than K dimensions. An interpolative decomposition of random rows (Cheng, Gimbutas,
    Martinsson, Rokhlin, SIAM J. Sci. Comput. 26, 2005). As many other rows check it; where these do not follow, twice
    as many are taken.
    """
    count, columns = excitation.shape
    order, size = np.random.default_rng(0).permutation(count), max(ROWS_PER_COLUMN * columns, LEAST_ROWS)
    while True:
        rows, checked = (excitation[part].astype(np.complex128) for part in (order[:size], order[size : 2 * size]))
        gram, largest = rows.conj().T @ rows, abs(rows).max(initial=0)
        if not np.isfinite(largest):  # its rank would be zero
            return np.arange(columns), np.eye(columns)
        upper, pivots, rank, _ = zpstrf(gram, tol=chosen**2 * gram.diagonal().real.max(initial=0))
        upper, numbers = np.triu(upper[:rank]), pivots - 1
        weights, ascending = np.empty((rank, columns), np.complex128), np.argsort(numbers[:rank])
        weights[:, numbers] = solve_triangular(upper[:, :rank], upper)[ascending]
        numbers = numbers[ascending]
        left = checked - checked[:, numbers] @ weights
        if abs(left).max(initial=0) <= CHECK_ERROR * largest:
            return numbers, weights
        size *= 2


def middle_of(surface):
    """The point (3,) in m, in the mirror planes, about which a Surface needs the fewest samples."""
    corners = surface.vertices.reshape(-1, 3)
    middle = (corners.min(0) + corners.max(0)) / 2
    middle[list(surface.axes)] = 0
    return middle


@functools.cache  # a plan asks for the same ones many times
def samples_of_ring(x, tolerance):
    """Even number of equally spaced azimuths that give an excitation of argument x = k rho cos(el) to `tolerance`."""
    orders = np.arange(int(x + 20 * np.cbrt(x) + 40))
    beyond = 2 * np.cumsum(np.abs(jv(orders, x))[::-1])[::-1]
    # One more order for the polarization's own cosine and sine; the highest is shared between +n/2 and -n/2.
    return 2 * (int(orders[beyond < tolerance][0]) + 2)


def _periodic(azimuth, count):
    """(A, count) weights of trigonometric interpolation from `count` (even) equally spaced azimuths; degrees."""
    x = np.deg2rad(np.asarray(azimuth)[:, None] - np.arange(count) * 360 / count)
    on_sample = np.abs(np.sin(x / 2)) < 1e-12
    sine = np.where(on_sample, 1, np.sin(x / 2))
    return np.where(on_sample, 1, np.sin(count * x / 2) * np.cos(x / 2) / (count * sine))


def _fold(surface, azimuth):
    """Azimuths (K,) in degrees that are not mirror images of each other, and the signs that lead back to all.

    Signs are (G, A, K) for V and for H: between a direction and its image the functions of a parity change by their
    character. A reflection in the plane xz or yz maps V to V and H to -H; one in xy leaves the ring and is not used.
    """
    angle = np.deg2rad(azimuth)
    points = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], 1)
    base = points.copy()
    base[:, surface.axes] = np.abs(base[:, surface.axes])
    _, first, place = np.unique(np.round(base, 9), axis=0, return_index=True, return_inverse=True)
    reflections = surface.reflections
    # The first that fits: a direction in a mirror plane is its own image.
    image = (np.abs(reflections[:, None] * base - points) < 1e-9).all(2).argmax(0)
    of_v = np.zeros((len(reflections), len(points), len(first)))
    of_v[:, np.arange(len(points)), place.reshape(-1)] = surface.parities[:, image]
    of_h = of_v * np.prod(reflections, 1)[image, None] + 0.0  # no negative zeros
    return np.rad2deg(np.arctan2(base[first, 1], base[first, 0])), {"V": of_v, "H": of_h}
