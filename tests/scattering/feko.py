"""The far-field files that FEKO would write of small scatterers, in closed form."""

import numpy as np

from isarflow.core.sweep import C0

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)", "RCS(Theta)", "RCS(Phi)", "RCS(Total)")
POINTS = np.array([[0.3, -0.1, 0.2], [-0.25, 0.05, -0.1]])  # m
TENSORS = np.array(  # complex symmetric (reciprocal) and not diagonal, in m
    [
        [[1.0, 0.2j, -0.3], [0.2j, 0.5, 0.1 + 0.1j], [-0.3, 0.1 + 0.1j, 0.8j]],
        [[0.2, 0.1, 0.4j], [0.1, -0.6j, 0.3], [0.4j, 0.3, 0.4]],
    ]
)


def amplitudes(frequency, elevation, azimuth):
    """{VV, HH, HV, VH}: field of the scatterers as the contract has it, (frequency, elevation, azimuth), in m.

    f = sum of p . T q exp(2jk u . r), with u towards the radar, p and q the received and transmitted direction.
    """
    el, az = np.meshgrid(np.radians(elevation), np.radians(azimuth), indexing="ij")
    u = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], -1)
    ways = {
        "V": np.stack([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), np.cos(el)], -1),
        "H": np.stack([-np.sin(az), np.cos(az), np.zeros_like(az)], -1),
    }
    k = 2 * np.pi * np.asarray(frequency) / C0
    phase = np.exp(2j * k[:, None, None, None] * np.einsum("eax,nx->ean", u, POINTS))
    return {p + q: np.einsum("fean,eax,nxy,eay->fea", phase, ways[p], TENSORS, ways[q]) for p in "VH" for q in "VH"}


def solve(frequency, theta, phi, eta, strength=1.0):
    """(E_theta, E_phi) in V that FEKO finds looking back along a plane wave from (theta, phi) degrees.

    eta: FEKO's polarization angle in degrees, right-handed about the direction of propagation, 0 along -theta.
    """
    t, p = np.radians([theta, phi])
    r = np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    along_theta = np.array([np.cos(t) * np.cos(p), np.cos(t) * np.sin(p), -np.sin(t)])
    along_phi = np.array([-np.sin(p), np.cos(p), 0.0])
    start, turn = -along_theta, np.radians(eta)
    incident = strength * (np.cos(turn) * start + np.sin(turn) * np.cross(-r, start))
    k = 2 * np.pi * frequency / C0
    far = np.einsum("n,nxy,y->x", np.exp(2j * k * POINTS @ r), TENSORS, incident)
    return far @ along_theta, far @ along_phi


def block(frequency, theta, phi, rows, strength=1.0):
    """One block as FEKO prints it. rows: (theta, phi, E_theta, E_phi)."""
    lines = [
        "#Configuration Name: StandardConfiguration1",
        "#Request Name: FarField1",
        f"#Frequency:   {frequency:.8E}",
        "#Coordinate System: Spherical",
        f"#No. of Theta Samples: {len(rows)}",
        "#No. of Phi Samples: 1",
        "#Result Type: RCS",
        f"#Incident Wave Direction: ({theta:17.8E},{phi:17.8E})",
        "#No. of Header Lines: 1",
        "#     " + "   ".join(f'"{name}"' for name in COLUMNS),
    ]
    for row_theta, row_phi, e_theta, e_phi in rows:
        rcs = 4 * np.pi * np.abs([e_theta, e_phi]) ** 2 / strength**2
        numbers = [row_theta, row_phi, e_theta.real, e_theta.imag, e_phi.real, e_phi.imag, *rcs, rcs.sum()]
        lines.append("".join(f"{number:19.8E}" for number in numbers))
    return "\n".join([*lines, "", ""])


HEAD = (
    "##File Type: Far field\n##File Format: 4\n##Source: points\n** File exported by FEKO kernel version 2017.1\n\n\n"
)


def sweep(frequency, elevation, azimuth, eta=0, strength=1.0):
    """A file of monostatic blocks over the sweep."""
    blocks = []
    for f in frequency:
        for el in elevation:
            for az in azimuth:
                theta, phi = 90 - el, az % 360
                blocks.append(block(f, theta, phi, [(theta, phi, *solve(f, theta, phi, eta, strength))], strength))
    return HEAD + "".join(blocks)
