"""Opaque bodies and coated metal: the impedance boundary condition (IBC). Dielectric sheets are solved here, too.

Where waves that enter a body do not come back, the field on its surface is E_tan = Z n x H, with the normal n outward
and an impedance Z of the material (Leontovich; Senior, Volakis, Approximate Boundary Conditions in Electromagnetics,
1995, ch. 2). Of both currents J = n x H and M = E x n then E_tan = Z J and H_tan = M / Z. On the surface the field of
the currents' integrals is the mean of both sides, from which the outer one differs by n x M / 2 and n x J / 2; so that
the means are Z J / 2 and M / (2 Z). Tested with f_m, in the scale of `dielectric`,

    [ z + (Z / eta) g      -(j / k) kappa     ] [ J       ]
    [ -(j / k) kappa    -(z + (eta / Z) g)    ] [ M / eta ] ,    g_mn = 2 pi / (j k) int f_m . f_n dS

(self-dual: Yan, Jin, IEEE Trans. AP-61, 2013). The matrix is complex symmetric, and the right side and the far field
are those of `dielectric`. Inside, the fields of currents that solve it meet walls of the same Z, which take power: with
losses there are no interior resonances. With M = Z J x n in the EFIE, of half the unknowns, E_tan = 0 inside, and
at the resonances of that cavity spheres of water erred by 15 %.

There is M on triangles with Z alone: the others are metal, or sheets (see `sheet`), and its functions lie on pairs of
the former. A thin dielectric sheet (TDS) has loops of M, for the current across it (see `normal`).
"""

import numpy as np

from isarflow.scattering.materials import ETA
from isarflow.scattering.mom import dielectric, normal
from isarflow.scattering.mom.sheet import add_sheet

ALPHA = 1  # as of `efie`
SYMMETRIC = True

near_terms = dielectric.near_terms


class Entries(dielectric.Entries):
    """`dielectric.Entries`; material: (3, T), impedances of sheets, opaque surfaces and across sheets in ohm, or 0."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.across = normal.terms(self, self.material[2]) if self.material[2].any() else None

    def _media(self, wavenumber, material):
        return ((complex(wavenumber), 1.0),)

    def _near(self, threads):
        electric, magnetic, kappa = super()._near(threads)
        sheet, opaque, _ = self.material
        admittance = np.divide(ETA**2, opaque, out=np.zeros_like(opaque), where=opaque != 0)
        for values, impedance in ((electric, sheet + opaque / 2), (magnetic, -admittance / 2)):
            add_sheet(values, self.near.pairs, self.surface, self.wavenumber, impedance)
        return [electric, magnetic, kappa]

    def between(self, row, col):
        tiles = super().between(row, col)
        if self.across is not None and np.isin(row.triangles, col.triangles).any():
            for tile, term, rows, cols in zip(tiles, self.across, row.numbers, col.numbers, strict=True):
                tile += term[rows][:, cols].toarray()
        return tiles
