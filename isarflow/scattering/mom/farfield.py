"""Plane-wave excitation of the RWG functions and the scattered far field.

Time convention exp(+j omega t), phase referred to the origin. The radar is in direction u, its polarizations are
V and H (see `directions`). A unit plane wave from the radar is E = p exp(+j k u . r). With V_m = int f_m . E dS and the
matrix z of `assembly`, the scattering amplitude for receiving p and transmitting q is (reciprocity; Harrington 1968,
sec. 7-3)

    f_pq = -V_p^T z^-1 V_q   (m),   E_s = f exp(-j k r) / r,   RCS = 4 pi |f|^2.

For an operator other than the EFIE, z is its matrix and V_q, but not V_p, is its right side (see `operators.cfie`).
"""

import numpy as np

from isarflow.scattering.checks import finite
from isarflow.scattering.mom.basis import by_half
from isarflow.scattering.mom.factorization import even_runs
from isarflow.scattering.mom.tiles import TILE_TRIANGLES, excite
from isarflow.scattering.threads import Pool

CHUNK_DIRECTIONS = TILE_TRIANGLES // 2  # directions of a task, at most


class Excitation:
    """int F . E dS of E = p exp(+j k u . r), for functions and directions, in m^2; F is the sum over mirror images."""

    def __init__(self, surface, bases, dtype, characters=None):
        self.dtype, self.real = np.dtype(dtype), np.dtype(dtype).type(0).real.dtype
        flips = surface.reflections[:, None]
        self.triangles, self.normals = surface.vertices * flips[:, None], surface.normals * flips
        characters = surface.parities if characters is None else characters
        self.characters, self.ends = characters.astype(self.real), np.cumsum([0, *map(len, bases)]).tolist()
        lengths, halves = surface.lengths.reshape(-1), np.concatenate([basis.halves for basis in bases])
        weights = np.concatenate([basis.signs for basis in bases]) * lengths[halves] / 2
        starts, functions, weights = by_half(halves, weights, np.diff(self.ends), len(lengths))
        self.places = starts, functions, weights.astype(self.real)

    def __call__(self, wavenumber, u, polarization, alpha=1.0, threads=1):
        """Compute (N, D) for each parity; wavenumber: rad/m; u, polarization: (D, 3); alpha: an operator's ALPHA."""
        whole = np.zeros((self.ends[-1], len(u)), self.dtype)
        scales = self.characters, wavenumber / (2 * np.pi), float(alpha), self.real.type(1)

        def work(part):
            waves = (np.ascontiguousarray(x[part].T, float) for x in (u, polarization))
            out = whole.view(self.real)[:, 2 * part.start : 2 * part.stop]
            excite(out, *waves, self.triangles, self.normals, *self.places, *scales)

        with Pool(threads) as pool:
            list(pool.map(work, even_runs(len(u), CHUNK_DIRECTIONS)))
        return np.split(finite(whole, "the excitation", wavenumber), self.ends[1:-1])
