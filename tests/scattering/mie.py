"""Scattering by spheres and spherical shells in closed form, the truth for the solver's tests.

The conducting sphere's backscatter and the mesh are those that a run checks its solver with; the bistatic pattern and
the shells are only asked for here. With Riccati's Bessel functions psi = x j(x), chi = x y(x) and zeta = psi - j chi, a
wave outside a body of size x = k radius has the radial part psi - a zeta (electric) or psi - b zeta (magnetic).
"""

import numpy as np
from scipy.special import spherical_jn, spherical_yn

from isarflow.scattering.sphere import backscatter, coefficients, icosphere, orders, to_source

__all__ = [
    "backscatter",
    "bistatic",
    "coated",
    "dielectric_sheet",
    "icosphere",
    "layer",
    "opaque",
    "sheet",
    "solid",
    "to_source",
]


def sheet(x, impedance, core=None):
    """`coefficients` of a spherical sheet of size x; impedance: divided by that of vacuum; core: as of `_within`.

    The tangential E of an electric wave is psi' - a zeta' outside and c u' inside, that of H psi - a zeta and c u with
    u = psi - q zeta. E is continuous, and the jump of H is the current E / Z; with psi zeta' - psi' zeta = -j that is
    a (Z / eta + u' zeta') = u' psi' + q Z / eta. In a magnetic wave E and H change places: b (Z / eta + u zeta) = u psi
    + q Z / eta.
    """
    n = orders(x)
    psi, d_psi, chi, d_chi = _riccati(n, x)
    zeta, d_zeta = psi - 1j * chi, d_psi - 1j * d_chi
    (q, _, d_u), (p, u, _) = _within(n, x, core)
    electric = (d_u * d_psi + q * impedance) / (impedance + d_u * d_zeta)
    return n, electric, (u * psi + p * impedance) / (impedance + u * zeta)


def dielectric_sheet(x, permittivity, thickness, core=None):
    """`coefficients` of a sheet with a current across it, in place of a `layer` of the same arguments.

    Of an electric wave u steps over it by (eps_r - 1) k t mean u', as of a `sheet`, and u' by the normal polarization,
    -(eps_r - 1) / eps_r k t n (n + 1) / x^2 mean u; of a magnetic one u' alone, by -(eps_r - 1) k t mean u. This is the
    layer to the second order of its thickness, as u and u' are means of both sides.
    """
    n, step = orders(x), (permittivity - 1) * thickness
    psi, d_psi, chi, d_chi = _riccati(n, x)
    zeta, d_zeta = psi - 1j * chi, d_psi - 1j * d_chi

    def outer(of_u, of_slope, within):
        _, u, d_u = within
        # u: psi - a zeta - c u = of_u / 2 (psi' - a zeta' + c u'); and so with the slopes. By Cramer's rule:
        a, b, right = -zeta + of_u / 2 * d_zeta, -u - of_u / 2 * d_u, of_u / 2 * d_psi - psi
        d_a, d_b, d_right = -d_zeta + of_slope / 2 * zeta, -d_u - of_slope / 2 * u, of_slope / 2 * psi - d_psi
        return (right * d_b - d_right * b) / (a * d_b - d_a * b)

    of_electric, of_magnetic = _within(n, x, core)
    return n, outer(step, -step / permittivity * n * (n + 1) / x**2, of_electric), outer(0.0, -step, of_magnetic)


def _within(n, x, core):
    """What a metal ball of size `core`, None for none, scatters, q, and u = psi - q zeta and u' at x; both waves."""
    psi, d_psi, chi, d_chi = _riccati(n, x)
    electric = magnetic = np.zeros(len(n))
    if core is not None:
        own, d_own, other, d_other = _riccati(n, core)
        electric, magnetic = d_own / (d_own - 1j * d_other), own / (own - 1j * other)
    return [(q, psi - q * (psi - 1j * chi), d_psi - q * (d_psi - 1j * d_chi)) for q in (electric, magnetic)]


def layer(x, permittivity, thickness, core=None):
    """`coefficients` of a dielectric shell about the size x, from x - thickness / 2 to x + thickness / 2.

    permittivity: relative, complex, of a loss that lets waves through k radius of it; thickness: times k; core: as of
    `_within`. At its faces the radial part f of an electric wave and f' / eps_r are continuous, and f and f' of a
    magnetic one.
    """
    n, inside, outside, index = orders(x), x - thickness / 2, x + thickness / 2, np.sqrt(complex(permittivity))
    of_electric, of_magnetic = _within(n, inside, core)
    inner_psi, inner_d_psi, inner_chi, inner_d_chi = _riccati(n, index * inside)
    outer_psi, outer_d_psi, outer_chi, outer_d_chi = _riccati(n, index * outside)
    incident, d_incident, chi, d_chi = _riccati(n, outside)
    outgoing, d_outgoing = incident - 1j * chi, d_incident - 1j * d_chi

    def outer(weight, within):
        _, psi, d_psi = within
        # f = A psi + B chi in the shell; psi chi' - psi' chi = 1.
        slope = weight * d_psi / index
        a, b = psi * inner_d_chi - slope * inner_chi, slope * inner_psi - psi * inner_d_psi
        f, d_f = weight * (a * outer_psi + b * outer_chi), index * (a * outer_d_psi + b * outer_d_chi)
        return (f * d_incident - d_f * incident) / (f * d_outgoing - d_f * outgoing)

    return n, outer(permittivity, of_electric), outer(1.0, of_magnetic)


def solid(x, permittivity):
    """`coefficients` of a homogeneous sphere of size x; permittivity: relative, complex.

    psi(m x) inside, with m the refractive index: f and f' / eps_r of an electric wave are continuous, as in `layer`.
    """
    n, index = orders(x), np.sqrt(complex(permittivity))
    psi, d_psi, chi, d_chi = _riccati(n, x)
    zeta, d_zeta = psi - 1j * chi, d_psi - 1j * d_chi
    j = spherical_jn(n, index * x)
    inside, d_inside = index * x * j, j + index * x * spherical_jn(n, index * x, True)
    a = (index * inside * d_psi - psi * d_inside) / (index * inside * d_zeta - zeta * d_inside)
    return n, a, (inside * d_psi - index * psi * d_inside) / (inside * d_zeta - index * zeta * d_inside)


def opaque(x, impedance):
    """`coefficients` of a sphere of size x on which E_tan = Z n x H; impedance: Z, divided by that of vacuum.

    With u = psi - a zeta of an electric wave u' = j Z u, and of a magnetic one u = -j Z u': the limits of `solid` where
    what enters does not come back, with Z = 1 / m.
    """
    n = orders(x)
    psi, d_psi, chi, d_chi = _riccati(n, x)
    zeta, d_zeta, turned = psi - 1j * chi, d_psi - 1j * d_chi, 1j * impedance
    return n, (d_psi - turned * psi) / (d_zeta - turned * zeta), (psi + turned * d_psi) / (zeta + turned * d_zeta)


def coated(x, permittivity, thickness):
    """`coefficients` of a metal sphere with a dielectric coating, of size x with it; thickness: times k."""
    return layer(x - thickness / 2, permittivity, thickness, core=x - thickness)


def _riccati(n, x):
    """psi, psi', chi and chi' of orders n at x."""
    j, y = spherical_jn(n, x), spherical_yn(n, x)
    return x * j, j + x * spherical_jn(n, x, True), x * y, y + x * spherical_yn(n, x, True)


def bistatic(wavenumber, radius, angle, series=coefficients):
    """Amplitudes (f_theta, f_phi), m, at `angle` (rad) from the direction in which the incident wave travels.

    angle: (D,). The incident field has unit strength along theta (in the plane of scattering) or phi (across it); the
    unit vectors are those of spherical coordinates about the direction of travel. Sec. 4.4.4: S_2 and S_1, with
    f = S / (j k). series: of the size k radius, as `coefficients`.
    """
    n, a, b = series(wavenumber * radius)
    cosine, pi, tau = np.cos(angle), [np.zeros(len(angle)), np.ones(len(angle))], [np.zeros(len(angle))]
    for m in n:
        tau.append(m * cosine * pi[m] - (m + 1) * pi[m - 1])
        pi.append(((2 * m + 1) * cosine * pi[m] - (m + 1) * pi[m - 1]) / m)
    pi, tau = np.array(pi[1 : len(n) + 1]).T, np.array(tau[1:]).T
    weight = (2 * n + 1) / (n * (n + 1))
    along, across = tau @ (weight * a) + pi @ (weight * b), pi @ (weight * a) + tau @ (weight * b)
    return along / (1j * wavenumber), across / (1j * wavenumber)
