"""The amplitudes of a sweep's directions from a factorized system: of backscatter, and of separate receivers."""

from itertools import product

import numpy as np

from isarflow.core.sweep import unit_vectors
from isarflow.scattering.costs import COLUMNS
from isarflow.scattering.directions import rings, sample
from isarflow.scattering.mom.factorization import runs

PROBED_DIRECTIONS = 4  # for which the residual is measured


class Monostatic:
    """Directions of a radar that also receives, (D,), about the `middle` of a target."""

    def __init__(self, surface, middle, sweep, operator):
        self.surface, self.operator, self.polarizations = surface, operator, sweep.polarizations
        self.ways = sorted(set("".join(sweep.polarizations)))
        elevations, azimuths = sweep.each
        self.path = 2 * unit_vectors(elevations, azimuths)[0] @ middle
        self.shape = self.path.shape
        # The mirror image of a direction in the plane xy has the same field, except for the sign of V.
        self.mirrored = (2 in surface.axes) & (elevations < 0)
        self.rings = rings(np.where(self.mirrored, -elevations, elevations), azimuths)

    def amplitudes(self, system, wavenumber, of_waves, progress):
        """f (P, D) at one wavenumber; of_waves: the `Excitation` there."""
        samples = self.probe(system, wavenumber, of_waves)
        field = np.empty((len(self.polarizations), *self.shape), np.complex128)
        for numbers, u, polarization, groups in samples.parts(self.ways, system.columns):
            progress(numbers[0] / len(samples.rings))
            received = of_waves(u, polarization)
            alpha = self.operator.ALPHA
            excited = received if self.operator.SYMMETRIC else of_waves(u, polarization, alpha=alpha)
            between = system.between(received, excited, groups)
            for place, ring in enumerate(numbers):
                of_ring = [of_parity[place] for of_parity in between]
                *_, azimuths, direction_numbers = self.rings[ring]
                field[:, direction_numbers] = self._of_ring(of_ring, samples.weights[ring])[:, azimuths]
        for row, (receive, transmit) in zip(field, self.polarizations, strict=True):
            sign = np.where(self.mirrored & (receive != transmit), -1, 1)
            row *= sign * np.exp(1j * wavenumber * self.path)
        return field

    def probe(self, system, wavenumber, of_waves):
        """The samples of all directions; a few of them show whether the solution is good without refinement."""
        elevations, azimuths = zip(*(ring[:2] for ring in self.rings), strict=True)
        samples = sample(self.surface, wavenumber, elevations, azimuths, system.dtype)
        probed = slice(None, None, -(-len(samples.u) // PROBED_DIRECTIONS))
        u = np.concatenate([samples.u[probed]] * len(self.ways))
        polarization = np.concatenate([samples.polarizations[way][probed] for way in self.ways])
        system.probe(of_waves(u, polarization, alpha=self.operator.ALPHA))
        return samples

    def _of_ring(self, between, weights):
        """f = -V_p^T z^-1 V_q, (P, A), on a ring, from its values between samples by all `ways`, (K, K) per parity."""
        result = []
        for receive, transmit in self.polarizations:
            total = 0
            for parity, ring in enumerate(between):
                count = len(ring) // len(self.ways)
                left, right = (slice(w * count, (w + 1) * count) for w in map(self.ways.index, (receive, transmit)))
                of_left, of_right = weights[receive][parity], weights[transmit][parity]
                total += np.einsum("ai,ij,aj->a", of_left, ring[left, right], of_right, optimize=True)
            # F = sum over the group of chi(g) g h makes a parity's matrix |G| times the one that is stored.
            result.append(-total / len(between))
        return np.stack(result)


class Bistatic(Monostatic):
    """Directions of a radar that transmits, (D,), and of receivers, (R,)."""

    def __init__(self, surface, middle, sweep, operator):
        super().__init__(surface, middle, sweep, operator)
        ends = unit_vectors(*sweep.each), unit_vectors(*sweep.receivers)
        self.transmitters, self.receivers = (dict(zip("uVH", end, strict=True)) for end in ends)
        self.path = (ends[0][0] @ middle)[:, None] + ends[1][0] @ middle
        self.shape = self.path.shape

    def amplitudes(self, system, wavenumber, of_waves, progress):
        """f = -V_p(u_r)^T z^-1 V_q(u_t), (P, D, R); arguments as of `Monostatic`."""
        self.probe(system, wavenumber, of_waves)
        field = np.empty((len(self.polarizations), *self.shape), np.complex128)
        sent_runs, received_runs = runs(self.shape[0], system.columns), runs(self.shape[1], COLUMNS)
        transmitted = sorted({way[1] for way in self.polarizations})
        for number, (letter, sent) in enumerate(product(transmitted, sent_runs)):
            progress(number / (len(transmitted) * len(sent_runs)))
            waves = self.transmitters["u"][sent], self.transmitters[letter][sent]
            currents = system.currents(of_waves(*waves, alpha=self.operator.ALPHA))
            rows = [row for row, way in enumerate(self.polarizations) if way[1] == letter]
            for row, part in product(rows, received_runs):
                received = of_waves(self.receivers["u"][part], self.receivers[self.polarizations[row][0]][part])
                total = sum(x.T @ y for x, y in zip(currents, received, strict=True))
                field[row, sent, part] = -total / len(currents)  # as in `_of_ring`
        return field * np.exp(1j * wavenumber * self.path)
