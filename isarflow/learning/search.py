"""Find a target's place and drift in an image, with a library whose templates have neither.

A first stage compares what no displacement changes, the magnitude of the power image's Fourier transform, and leaves
some templates of each class, for each of several drifts. A second one correlates the magnitudes of these with the
image's over all places that motion allows. The largest correlations are hypotheses: for each the image is moved back by
exact phases. Magnitudes are up-sampled by two before, as a magnitude has twice the band of its image, and of their
transforms the inner half is kept.
"""

import functools
import itertools
from typing import NamedTuple

import numpy as np
import scipy.fft

from isarflow.learning.data.features import by_channel, standardized

BLOCK = 64  # images at a time, always: the last bits of a product depend on how many rows it has
TEMPLATES = 80  # of each class, and drift, that the first stage leaves
HYPOTHESES = 3  # of an image, with distinct places or drifts
DRIFT = 0.25  # wavelengths at the ends of the aperture, from one drift to the next
APART = 0.25  # cells: nearer places are the same
EXCLUDED = -1.0  # likeness and correlation of a template that an image is judged without
MARGIN = 1  # half cells beyond the largest displacement, so that a parabola finds places up to it
RETRIEVALS = 3  # steps towards the phases of pulses; more change no score


class Hypotheses(NamedTuple):
    """HYPOTHESES for each of n images, image by image: m in all."""

    images: np.ndarray  # (m, channel, R, X), moved back
    range: np.ndarray  # (m,), m
    crossrange: np.ndarray  # (m,), m
    drift: np.ndarray  # (m,), wavelengths
    received: np.ndarray | None  # (m, A), pulses; None if all were received


class Candidate(NamedTuple):
    """A template that may be in an image, at a place."""

    correlation: float
    template: int  # its number
    range: float  # m
    crossrange: float  # m
    drift: float  # wavelengths


class Search:
    """A library that is ready to be searched.

    moves: the run's `Moves`; templates: (t, channel, R, X), grouped by class; starts: (classes,), each one's first.
    aspects: (t,) as text, by which an image may be judged without some templates.
    """

    def __init__(self, moves, templates, starts, aspects):
        self.moves, self.templates, self.aspects = moves, templates, aspects
        self.bounds = [*itertools.pairwise([*starts, len(templates)])]
        self.counts = [min(TEMPLATES, end - first) for first, end in self.bounds]
        limits = moves.limits
        drifts = int(np.ceil(limits.drift / DRIFT - 1e-9))
        self.drifts = np.linspace(-limits.drift, limits.drift, 2 * drifts + 1)
        # For each drift the matrix that removes it from an image; None for no drift.
        self.undo_drift = [
            moves.to_samples * moves.phases(drift=-drift).ravel() @ moves.to_image if drift else None
            for drift in self.drifts
        ]
        # Half cells are the places: (lines of a spectrum, places) in range, and (2 lines, places) in cross-range, where
        # the product with a spectrum's real and imaginary parts is the real part.
        self.sizes = [2 * count for count in moves.shape]
        self.steps = [(axis[1] - axis[0]) / 2 for axis in moves.imager.axes()]
        # Beyond half the extent an image has the same places again.
        self.largest_offsets = [
            min(int(np.ceil(limits.place / step - 1e-9)) + MARGIN, count)
            for step, count in zip(self.steps, moves.shape, strict=True)
        ]
        self.lines = [_inner_lines(size) for size in self.sizes]
        rows, columns = (
            np.exp(2j * np.pi * np.outer(np.arange(-most, most + 1), lines) / size).astype(np.complex64)
            for most, lines, size in zip(
                self.largest_offsets, (self.lines[0], _not_negative(self.lines[1])), self.sizes, strict=True
            )
        )
        self.to_places = rows.T, columns.conj().view(np.float32).T
        parts = [self._compared(templates[start : start + BLOCK]) for start in range(0, len(templates), BLOCK)]
        self.invariants, spectra = (np.concatenate(part) for part in zip(*parts, strict=True))
        # (t, columns, channel times lines), as `_candidates` multiplies them.
        spectra = np.conj(spectra) * self._weights()
        self.spectra = spectra.transpose(0, 3, 1, 2).reshape(len(spectra), spectra.shape[3], -1)

    def _weights(self):
        """How often each column of half a spectrum stands in the whole one."""
        return np.where(_not_negative(self.lines[1]) == 0, 1, 2).astype(np.float32)

    def _compared(self, images):
        """Invariants (n, d) and spectra (n, channel, lines, columns) of images, each of norm 1 and without its mean."""
        down, carrier = self.moves.imager.axes()[0], self.moves.imager.carrier()
        base = images * np.exp(-2j * carrier * down).astype(np.complex64)[:, None]
        spectrum = scipy.fft.fftshift(scipy.fft.fft2(scipy.fft.ifftshift(base, (-2, -1))), (-2, -1))
        padding = [(count - count // 2, count - -(-count // 2)) for count in self.moves.shape]
        finer = scipy.fft.ifft2(scipy.fft.ifftshift(np.pad(spectrum, [(0, 0), (0, 0), *padding]), (-2, -1)))
        magnitudes = np.abs(scipy.fft.fftshift(finer, (-2, -1)))
        transforms = []
        for features in (magnitudes**2, magnitudes):
            inner = scipy.fft.rfft2(features)[..., self.lines[0], : len(_not_negative(self.lines[1]))]
            inner[..., 0, 0] = 0
            size = np.sqrt((np.abs(inner) ** 2 * self._weights()).sum(axis=(1, 2, 3), keepdims=True))
            transforms.append(inner / np.maximum(size, 1e-30))
        invariants = np.abs(transforms[0]) * np.sqrt(self._weights())
        return invariants.reshape(len(images), -1).astype(np.float32), transforms[1].astype(np.complex64)

    def hypotheses(self, images, without=None, received=None):
        """The Hypotheses of exactly BLOCK images.

        without: None, or the aspects (n,) whose templates each image is judged without; received: None, or the pulses
        that were received, (n, A) booleans.
        """
        images, candidates = by_channel(images), [[] for _ in images]
        for drift, undo in zip(self.drifts, self.undo_drift, strict=True):
            without_drift = images
            if undo is not None:
                without_drift = (images.reshape(-1, len(undo)) @ undo).reshape(images.shape)
            invariants, spectra = self._compared(without_drift)
            likeness = invariants @ self.invariants.T
            if without is not None:
                likeness[np.asarray(without)[:, None] == self.aspects] = EXCLUDED
            for image, spectrum in enumerate(spectra):
                candidates[image] += self._candidates(likeness[image], spectrum, drift)
        chosen = [candidate for of_image in candidates for candidate in self._distinct(of_image)]
        _, template, down, cross, drifts = (np.array(part) for part in zip(*chosen, strict=True))
        image_of = np.repeat(np.arange(len(images)), HYPOTHESES)
        samples = self.moves.samples(images)[image_of] * self.moves.phases(-down, -cross, -drifts)[:, None]
        pulses = None if received is None or received.all() else received[image_of]
        if self.moves.limits.jitter:
            samples *= self._jitter_correction(samples, self.templates[template], pulses)
            # With these phases the nearest of all templates is a better one than that of the hypothesis.
            nearest = self._nearest(
                self.moves.images(samples), None if without is None else np.asarray(without)[image_of]
            )
            samples *= self._jitter_correction(samples, self.templates[nearest], pulses)
        if pulses is not None:
            samples *= pulses[:, None, None]
        return Hypotheses(self.moves.images(samples), down, cross, drifts, pulses)

    def _candidates(self, likeness, spectrum, drift):
        """The best `Candidate`s of an image at one drift."""
        classes = zip(self.bounds, self.counts, strict=True)
        chosen = [first + np.argpartition(-likeness[first:end], count - 1)[:count] for (first, end), count in classes]
        chosen = np.concatenate(chosen)
        rows, columns = self.to_places
        # A few large products, as one for each template takes twice as long; the last of real numbers.
        there = spectrum.transpose(2, 0, 1)[..., None] * rows
        down = self.spectra[chosen].swapaxes(0, 1) @ there.reshape(len(there), -1, rows.shape[1])
        down = np.ascontiguousarray(down.transpose(1, 2, 0)).view(np.float32)
        correlation = (down.reshape(-1, len(columns)) @ columns).reshape(*down.shape[:2], -1)
        correlation[likeness[chosen] <= EXCLUDED] = EXCLUDED
        each, shape = np.arange(len(chosen)), correlation.shape[1:]
        row, column = np.unravel_index(correlation.reshape(len(chosen), -1).argmax(axis=1), shape)
        row, column = np.clip(row, 1, shape[0] - 2), np.clip(column, 1, shape[1] - 2)
        # Between half cells the place is refined by a parabola.
        peak, shifts = correlation[each, row, column].copy(), []
        for before, after in (
            (correlation[each, row - 1, column], correlation[each, row + 1, column]),
            (correlation[each, row, column - 1], correlation[each, row, column + 1]),
        ):
            curvature = np.minimum(before - 2 * correlation[each, row, column] + after, -1e-9)
            shifts.append(np.clip((before - after) / (2 * curvature), -0.6, 0.6))
            peak -= (before - after) * shifts[-1] / 4
        down = (row - self.largest_offsets[0] + shifts[0]) * self.steps[0]
        cross = (column - self.largest_offsets[1] + shifts[1]) * self.steps[1]
        best = np.argsort(-peak)[:HYPOTHESES]
        return [Candidate(peak[number], chosen[number], down[number], cross[number], drift) for number in best]

    def _distinct(self, candidates):
        """HYPOTHESES of an image's candidates, by correlation; if fewer are distinct, the first is repeated."""
        kept = []
        for candidate in sorted(candidates, key=lambda each: -each.correlation):
            if not any(self._same(candidate, other) for other in kept):
                kept.append(candidate)
        return (kept + [kept[0]] * HYPOTHESES)[:HYPOTHESES]

    def _same(self, one, other):
        apart = abs(one.range - other.range), abs(one.crossrange - other.crossrange)
        near = all(metres < APART * cell for metres, cell in zip(apart, self.moves.cells, strict=True))
        return near and one.drift == other.drift

    @functools.cached_property
    def _magnitudes(self):
        return standardized(np.abs(self.templates).reshape(len(self.templates), -1))

    def _nearest(self, images, without):
        """The template (m,) with whose magnitudes those of each image (m, channel, R, X) correlate best."""
        alike = standardized(np.abs(images).reshape(len(images), -1)) @ self._magnitudes.T
        if without is not None:
            alike[without[:, None] == self.aspects] = -2
        return alike.argmax(axis=1)

    def _jitter_correction(self, samples, templates, received):
        """Factors (m, 1, 1, A) of magnitude 1 that undo the jitter of pulses: phases are retrieved (Fienup 1982).

        In turns the image takes its template's magnitudes, and each pulse the phase that fits best what that makes.
        """
        magnitudes = np.abs(self.templates_received(templates[:, None], received)[:, 0])
        factor = np.ones((len(samples), 1, 1, samples.shape[-1]), np.complex64)
        for _ in range(RETRIEVALS):
            image = self.moves.images(samples * factor)
            aim = self.moves.samples(image * (magnitudes / np.maximum(np.abs(image), 1e-12)))
            fit = (aim * samples.conj()).sum(axis=(1, 2), keepdims=True)
            factor = np.where(np.abs(fit) > 0, fit / np.maximum(np.abs(fit), 1e-30), 1)
        return factor

    def templates_received(self, templates, received):
        """Templates (m, k, channel, R, X) as images of the pulses (m, A) that each row's image has; None for all."""
        if received is None or received.all():
            return templates
        lost, rows = np.tile(~received, (1, len(self.moves.frequency))), []
        for each, gone in zip(templates, lost, strict=True):
            flat = each.reshape(-1, len(self.moves.to_samples))
            rows.append(flat - flat @ self.moves.to_samples[:, gone] @ self.moves.to_image[gone])
        return np.reshape(rows, templates.shape).astype(np.complex64)


def _inner_lines(size):
    """Numbers of the lines in the inner half of a spectrum that has `size` lines, negative ones last."""
    half = size // 4
    return np.concatenate([np.arange(half + 1), np.arange(-half, 0)])


def _not_negative(lines):
    """The lines that a real image's spectrum stores: the others follow from these."""
    return lines[lines >= 0]
