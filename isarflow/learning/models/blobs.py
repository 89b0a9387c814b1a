"""Blobs: the scatterers that stand out of an image, matched one to one with those of the library, wherever they are."""

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import gamma

from isarflow.learning.classifier import OTHER, Classifier, Outcome
from isarflow.learning.data.features import by_channel, unit
from isarflow.learning.noise import FAINT

FALSE = 0.003  # share of the pixels of noise alone that pass for scatterers, before only maxima are kept
DYNAMIC = 1e-3  # of the strongest scatterer's power: fainter ones are sidelobes of the window
TINY = 1e-6  # of the strongest pixel's power, the least of which a logarithm is taken
PAIRS = 12  # of scatterers, the likest, whose displacement is tried


class Model(Classifier):
    """The class of the template whose scatterers fit the image's best after both sets lie upon each other.

    An image's scatterers are the strongest local maxima of the power of all channels above the noise, at most
    `scatterers` of them. Two sets are as like as their best assignment (Kuhn 1955): the largest sum over pairs of
    |a^H b| exp(-|p - q - d|^2 / (2 s^2)), over the sets' lengths, for amplitudes a and b in all channels at places p
    and q, with s the setting `spread` and d the displacement between the sets. By Cauchy and Schwarz it is 0 to 1, and
    1 for the same set at any place, level and phase. Of each class the `candidates` whose sets have the likest
    magnitudes of their Fourier transform, which no displacement changes either, are assigned.
    Scores are the largest of each class. Confidence score: `assignment`, the largest of a known class.
    places_: (templates, scatterers, 2) in pixels, amplitudes_: (templates, scatterers, channels) of unit length, both
    grouped by class; invariants_: (templates, d); starts_: (classes,), each one's first; extent_: (2,), of an image.
    """

    LABELS = {"blobs": ("blobs", "the assignment of scatterers", 26)}
    SCORES = {"assignment": ("assignment", 21)}
    SETTINGS = {
        "scatterers": {"type": "integer", "minimum": 1, "maximum": 64, "description": "of an image, at most"},
        "spread": {"type": "number", "exclusiveMinimum": 0, "description": "pixels: the error of a scatterer's place"},
        "candidates": {"type": "integer", "minimum": 1, "description": "templates of a class that are assigned"},
    }
    leaves_out = True
    searches = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        order = np.argsort(labels, kind="stable")
        self.classes_, self.starts_ = np.unique(labels[order], return_index=True)
        self.aspects_ = self._aspects(order)
        self.extent_ = np.array(images.shape[-2:], np.float32)
        self.places_, self.amplitudes_ = scatterers(images[order], self.settings["scatterers"])
        self.invariants_ = self._invariants(self.places_, self.amplitudes_)
        return self

    def evaluate(self, images, without=None, received=None):
        places, amplitudes = scatterers(images, self.settings["scatterers"])
        likeness = self._masked(self._invariants(places, amplitudes) @ self.invariants_.T, without, -1)
        scores, best = np.zeros((len(images), len(self.classes_))), np.zeros((len(images), len(self.classes_), 2))
        bounds = [*zip(self.starts_, [*self.starts_[1:], len(self.places_)], strict=True)]
        counts = [min(self.settings["candidates"], end - first) for first, end in bounds]
        for image, alike in enumerate(likeness):
            chosen = [
                first + np.argpartition(-alike[first:end], count - 1)[:count]
                for (first, end), count in zip(bounds, counts, strict=True)
            ]
            every = np.concatenate(chosen)
            fits, apart = assigned(
                (places[image], amplitudes[image]),
                (self.places_[every], self.amplitudes_[every]),
                self.extent_,
                self.settings["spread"],
            )
            fits[alike[every] <= -1] = 0
            for owner, end in enumerate(np.cumsum(counts)):
                at = end - counts[owner] + fits[end - counts[owner] : end].argmax()
                scores[image, owner], best[image, owner] = fits[at], apart[at]
        known = np.flatnonzero(self.classes_ != OTHER)
        nearest = known[scores[:, known].argmax(axis=1)]
        found = self._in_metres(best[np.arange(len(images)), nearest]) if self.is_searched else {}
        confidence = {"assignment": scores[:, known].max(axis=1)}
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, confidence, found)

    def _invariants(self, places, amplitudes):
        """What no displacement changes, (n, d), of unit length: magnitudes of the sets' transform, each channel's own.

        Every scatterer is blurred by `spread`, as in the assignment.
        """
        # A real set's transform is symmetric: half of the lines in range are enough.
        ends = (self.extent_ / 2).astype(int)
        lines = np.stack(np.meshgrid(np.arange(ends[0] + 1), np.arange(-ends[1], ends[1] + 1), indexing="ij"), -1)
        lines = (lines.reshape(-1, 2) / self.extent_).astype(np.float32)
        blur = np.exp(-((np.pi * self.settings["spread"]) ** 2) * (lines**2).sum(axis=1)) * lines.any(axis=1)
        waves = np.exp(-2j * np.pi * (places @ lines.T).astype(np.float32))
        transform = np.swapaxes(np.abs(amplitudes), 1, 2) @ waves * blur
        return unit(np.abs(transform).reshape(len(places), -1).astype(np.float32))

    def _in_metres(self, displacements):
        steps = [axis[1] - axis[0] for axis in self.moves.imager.axes()]
        return dict(zip(("range", "crossrange"), displacements.T * np.array(steps)[:, None], strict=True))


def scatterers(images, count):
    """Places (n, count, 2) in pixels and amplitudes (n, count, channels) of the strongest maxima of images.

    images: (n, [channel,] range, crossrange). Amplitudes of all of an image's scatterers together have length 1, and
    are 0 where an image has fewer. Between pixels a place follows from a parabola of the logarithm of the power, as the
    main lobe of a window is nearly a Gaussian. An image goes on at its other end, as a Fourier transform does. The
    power of noise alone, over all channels, has a gamma distribution, whose scale the faintest pixels tell.
    """
    images = by_channel(images)
    power = (np.abs(images) ** 2).sum(axis=1)
    n, rows, columns = power.shape
    around = [np.roll(power, (down, across), (1, 2)) for down in (-1, 0, 1) for across in (-1, 0, 1) if down or across]
    flat = power.reshape(n, -1)
    level = np.quantile(flat, FAINT, axis=1) / gamma.ppf(FAINT, images.shape[1]) * gamma.isf(FALSE, images.shape[1])
    level = np.maximum(level, DYNAMIC * flat.max(axis=1))
    peaks = np.where(power > np.max(around, axis=0), power, 0).reshape(n, -1)
    peaks[peaks <= level[:, None]] = 0
    count = min(count, peaks.shape[1])
    strongest = np.argsort(-peaks, axis=1, kind="stable")[:, :count]
    is_there = np.take_along_axis(peaks, strongest, axis=1) > 0
    place = np.stack(np.divmod(strongest, columns), axis=-1).astype(np.float32)
    logs = np.log(np.maximum(power, TINY * np.maximum(flat.max(axis=1), 1e-30)[:, None, None]))
    each, row, column = np.arange(n)[:, None], *np.divmod(strongest, columns)
    gain = np.zeros(strongest.shape)
    for axis, (down, across) in enumerate(((1, 0), (0, 1))):
        before = logs[each, (row - down) % rows, (column - across) % columns]
        after = logs[each, (row + down) % rows, (column + across) % columns]
        curvature = np.minimum(before - 2 * logs[each, row, column] + after, -1e-9)
        shift = np.clip((before - after) / (2 * curvature), -0.5, 0.5)
        place[..., axis] += shift
        gain -= (before - after) * shift / 8  # of the amplitude: half of the power's
    amplitudes = images[each, :, row, column] * (np.exp(gain) * is_there)[..., None]
    amplitudes = unit(amplitudes.reshape(n, -1)).reshape(amplitudes.shape)
    return place * is_there[..., None], amplitudes.astype(np.complex64)


def assigned(one, others, extent, spread):
    """How well a set of scatterers fits each of t others, (t,), and how far it is displaced from these, (t, 2).

    one: places (k, 2) and amplitudes (k, channels); others: (t, m, 2) and (t, m, channels), as of `scatterers`; extent:
    (2,), pixels after which an image repeats. The displacement is that of one of the PAIRS of largest |a^H b|, under
    which most scatterers meet others, moved to the mean of those that meet.
    """
    strength = np.abs(one[1].conj() @ np.swapaxes(others[1], 1, 2))  # (t, k, m)
    apart = one[0][:, None] - others[0][:, None]  # (t, k, m, 2)
    each = np.arange(len(strength))
    count = min(PAIRS, strength[0].size)
    pairs = np.argpartition(-strength.reshape(len(each), -1), count - 1, axis=1)[:, :count]
    tried = apart.reshape(len(each), -1, 2)[each[:, None], pairs]
    rest = _wrapped(apart[:, None] - tried[:, :, None, None], extent)
    meeting = strength[:, None] * np.exp((rest**2).sum(axis=-1) / (-2 * spread**2))
    best = meeting.sum(axis=(2, 3)).argmax(axis=1)
    meeting, rest = meeting[each, best], rest[each, best]
    total = np.maximum(meeting.sum(axis=(1, 2)), 1e-30)
    mean = (meeting[..., None] * rest).sum(axis=(1, 2)) / total[:, None]
    weights = strength * np.exp(((rest - mean[:, None, None]) ** 2).sum(axis=-1) / (-2 * spread**2))
    fits = np.array([of[linear_sum_assignment(of, maximize=True)].sum() for of in weights])
    return fits, _wrapped(tried[each, best] + mean, extent)


def _wrapped(displacement, extent):
    """A displacement (..., 2) to within half an extent, beyond which an image repeats."""
    return displacement - extent * np.round(displacement / extent)
