"""Scattering by a perfectly conducting sphere in closed form, the truth for the solver's tests.

The backscatter and the mesh are those that a run checks its solver with; the bistatic pattern is only asked for here.
"""

import numpy as np

from isarflow.scattering.sphere import backscatter, coefficients, icosphere

__all__ = ["backscatter", "bistatic", "icosphere"]


def bistatic(wavenumber, radius, angle):
    """Amplitudes (f_theta, f_phi), m, at `angle` (rad) from the direction in which the incident wave travels.

    angle: (D,). The incident field has unit strength along theta (in the plane of scattering) or phi (across it); the
    unit vectors are those of spherical coordinates about the direction of travel. Sec. 4.4.4: S_2 and S_1, with
    f = S / (j k).
    """
    n, a, b = coefficients(wavenumber * radius)
    cosine, pi, tau = np.cos(angle), [np.zeros(len(angle)), np.ones(len(angle))], [np.zeros(len(angle))]
    for m in n:
        tau.append(m * cosine * pi[m] - (m + 1) * pi[m - 1])
        pi.append(((2 * m + 1) * cosine * pi[m] - (m + 1) * pi[m - 1]) / m)
    pi, tau = np.array(pi[1 : len(n) + 1]).T, np.array(tau[1:]).T
    weight = (2 * n + 1) / (n * (n + 1))
    along, across = tau @ (weight * a) + pi @ (weight * b), pi @ (weight * a) + tau @ (weight * b)
    return along / (1j * wavenumber), across / (1j * wavenumber)
