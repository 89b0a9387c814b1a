"""The term that a thin sheet of finite impedance adds to the matrix of the EFIE.

The tangential field on a sheet is E = Z J: Z is the sheet's impedance, ohm a square, and J the current of both its
sides (Harrington, Mautz, IEEE Trans. AP-23, 1975). In the scale of `assembly` the matrix is

    z_mn + 4 pi Z / (j k eta) int f_m . f_n dS

which is as symmetric as z. Z = 0 is a perfect conductor. Each triangle may have a Z of its own: the current is
continuous across a seam, and the field along it is Z J on either side.
"""

from dataclasses import replace

import numpy as np

from isarflow.scattering.materials import ETA
from isarflow.scattering.mom.basis import gram


def add_sheet(corrections, pairs, surface, wavenumber, impedance):
    """Add the term to an operator's `corrections` of near `pairs`, lists over the reflections of a Surface, in place.

    wavenumber: rad/m; impedance: ohm a square, complex, one or (T,).
    """
    term = (4 * np.pi * np.asarray(impedance) / (1j * wavenumber * ETA))[..., None, None] * gram(surface)
    for values, of_image, signs in zip(corrections, pairs, surface.reflections, strict=True):
        # A triangle in a mirror plane is its own image: its functions count twice.
        unchanged = (surface.vertices == surface.vertices * signs).all((1, 2))
        own = (of_image[:, 0] == of_image[:, 1]) & unchanged[of_image[:, 0]]
        values[own] += term[of_image[own, 0]]


def balanced(bases, impedances):
    """Return the bases with functions scaled so that all have about the same term of the matrix with themselves.

    A compressed matrix leaves out as much everywhere. Terms of weak sheets and of opaque bodies, which are far larger
    than metal's, would cost the others' digits. Fields do not depend on the scale, and metal alone keeps its own.
    impedances: ohm, (3, T), of sheets, of opaque surfaces and across sheets (see `opaque`), 0 for none.
    """
    sheet, opaque, across = np.abs(impedances) / ETA
    # With edges of a tenth of a wavelength, over that of z: of J, and of M of bodies or of loops.
    terms = np.stack([sheet / 2 + opaque / 4, np.where(opaque > 0, 0.5 / np.maximum(opaque, 1e-30), across / 8)])
    result = []
    for basis in bases:
        triangles, halves = np.divmod(basis.halves, basis.per_triangle)
        own = np.average(1 + terms[halves // 3, triangles], axis=1, weights=basis.signs != 0)
        result.append(replace(basis, signs=basis.signs / np.sqrt(own)[:, None]))
    return result
