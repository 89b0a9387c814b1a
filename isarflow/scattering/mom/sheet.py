"""The term that a thin sheet of finite impedance adds to the matrix of the EFIE.

The tangential field on a sheet is E = Z J: Z is the sheet's impedance, ohm a square, and J the current of both its
sides (Harrington, Mautz, IEEE Trans. AP-23, 1975). In the scale of `assembly` the matrix is

    z_mn + 4 pi Z / (j k eta) int f_m . f_n dS

which is as symmetric as z. Z = 0 is a perfect conductor. Each triangle may have a Z of its own: the current is
continuous across a seam, and the field along it is Z J on either side.
"""

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
