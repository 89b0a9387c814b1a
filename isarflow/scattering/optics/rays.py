"""Shooting and bouncing rays: physical optics of what the radar lights directly and by reflections, traced by Embree.

Parallel rays from the radar carry a plane wave's field by geometrical optics: at a perfect conductor E turns to
2 n (n . E) - E, and the direction d to d - 2 n (n . d). Where a ray hits, the current 2 n x H of its tube radiates back
(Ling, Chou, Lee, IEEE Trans. Antennas Propag. 37, 1989; here the currents of all hits count, not of the last alone):

    f_pq = -j k / (2 pi) sum p . (n x (d x E_q)) exp(j k (u . r - L)) dA / |n . d|    (m)

over hits r, with the length L of the way from the plane through the origin, and the tubes' section dA, times the mean
of the phase over the tube, two sinc functions. Tubes keep their section: curved walls are as many flat ones as the mesh
has triangles. First hits are `optics`, which has no tubes that are too wide where a wall is seen at grazing.
"""

import numpy as np

from isarflow.scattering.jit import kernel
from isarflow.scattering.optics.physical import Surface, axes_of

DENSITY = 10  # rays a wavelength, at the highest frequency
BOUNCES = 5
LIFT = 1e-6  # of the target's size, by which a reflected ray begins off the surface


class Scene:
    """A mesh for rays. vertices: (V, 3) m; triangles: (T, 3), of which both sides reflect. Errors: as of `Surface`."""

    def __init__(self, vertices, triangles):
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.surface, self.scene = Surface(vertices, triangles), EmbreeScene()
        self.vertices, triangles, _ = self.surface.arrays
        self.mesh = TriangleMesh(self.scene, self.vertices[triangles].astype(np.float32))
        self.size = float(np.ptp(self.vertices, axis=0).max())

    def backscatter(self, wavenumbers, elevation, azimuth):
        """Amplitudes f, m, of VV, VH, HV and HH, (4, D, F), at wavenumbers (F,) in rad/m; angles (D,) in degrees."""
        axes = axes_of(elevation, azimuth)
        wavenumbers = np.asarray(wavenumbers, float)
        field = np.zeros((len(axes), len(wavenumbers), 4), complex)
        for of_direction, unit_axes in zip(field, axes, strict=True):
            self._shoot(of_direction, wavenumbers, *unit_axes)
        field = field.transpose(2, 0, 1)
        field[[0, 3]] += self.surface.backscatter(wavenumbers, elevation, azimuth)
        return field

    def _shoot(self, field, wavenumbers, u, v, h):
        """Add to `field` (F, 4) what comes back to u after a reflection; v, h: unit vectors of the polarizations."""
        step = 2 * np.pi / wavenumbers.max() / DENSITY
        grid = [
            np.arange(extent.min() + step / 2, extent.max() + step / 2, step)
            for extent in (self.vertices @ v, self.vertices @ h)
        ]
        begin = (self.vertices @ u).max() + 0.01 * self.size
        first, second = (coordinate.ravel() for coordinate in np.meshgrid(*grid, indexing="ij"))
        origin = first[:, None] * v + second[:, None] * h + begin * u
        way, ahead = np.full(len(origin), begin), np.tile(-u, (len(origin), 1))  # u . r at the origin less the way
        waves = np.tile(np.stack([v, h]), (len(origin), 1, 1))  # of V and H, (R, 2, 3)
        sides = waves  # of the tube's section
        for bounce in range(BOUNCES):
            hits = self.scene.run(origin.astype(np.float32), ahead.astype(np.float32), output=True)
            hit = hits["primID"] >= 0
            if not hit.any():
                break
            origin, way, ahead, waves, sides = origin[hit], way[hit], ahead[hit], waves[hit], sides[hit]
            normal = hits["Ng"][hit].astype(float)
            normal /= np.linalg.norm(normal, axis=1)[:, None]
            normal *= -np.sign((normal * ahead).sum(1))[:, None]
            distance = hits["tfar"][hit].astype(float)
            place, way = origin + distance[:, None] * ahead, way - distance
            cosine = -(normal * ahead).sum(1)
            turned = (sides * normal[:, None]).sum(-1)
            if bounce:
                current = np.cross(normal[:, None], np.cross(ahead[:, None], waves))
                sent = np.stack([current @ v, current @ h], axis=1).reshape(-1, 4) * (step**2 / cosine)[:, None]
                # How much longer the way is a step aside, where the wall slopes.
                slopes = step * (sides @ u - turned * ((1 - ahead @ u) / cosine)[:, None])
                _add(field, wavenumbers, way + place @ u, slopes, sent)
            sides = sides - 2 * turned[..., None] * normal[:, None]
            waves = 2 * (waves * normal[:, None]).sum(-1)[..., None] * normal[:, None] - waves
            ahead = ahead + 2 * cosine[:, None] * normal
            origin = place + LIFT * self.size * normal
        field *= (-0.5j / np.pi * wavenumbers)[:, None]


@kernel
def _add(field, wavenumbers, ways, slopes, sent):
    """Add sent (R, 4) exp(j k way) of all rays, the mean over their tubes, to the field (F, 4). slopes: (R, 2)."""
    for ray in range(len(ways)):
        for f in range(len(wavenumbers)):
            k = wavenumbers[f]
            mean = np.sinc(k * slopes[ray, 0] / (2 * np.pi)) * np.sinc(k * slopes[ray, 1] / (2 * np.pi))
            phase = mean * np.exp(1j * k * ways[ray])
            for p in range(4):
                field[f, p] += sent[ray, p] * phase
