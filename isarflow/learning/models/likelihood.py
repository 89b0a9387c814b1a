"""Likelihood: the library of training views is the model. Magnitudes by the Rice density, coherence after whitening."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import uniform_filter

from isarflow.learning import confidence, noise
from isarflow.learning.classifier import Outcome, best_known
from isarflow.learning.data.features import by_channel, standardized, unit, unit_rows
from isarflow.learning.library import Library

BLOCK = 64  # images at a time, always: the last bits of a product depend on how many rows it has
WEAK = 0.03  # of the noise's power: directions in which the library has less say nothing, and cost time
LEAST_NOISE = 0.3  # of the energy: coherence assumes at least this share, as no template is the view itself
LEAST = 1e-6  # of a template's largest power: mismatch is in proportion to at least this power
COHERENCE = 1.5  # weight beside magnitudes: a larger one helps below 0 dB and harms above
MANY, SIFTED = 8192, 256  # of a class with more templates only so many, of largest ZNCC, are tried for coherence
AROUND = (1, 1, 3, 3)  # pixels over which a template's power is averaged
# Polynomials of `_log_i0`, from the largest power.
NEAR_I0 = (0.0045813, 0.0360768, 0.2659732, 1.2067492, 3.0899424, 3.5156229, 1.0)
FAR_I0 = (0.00392377, -0.01647633, 0.02635537, -0.02057706, 0.00916281, -0.00157565, 0.00225319, 0.01328592, 0.39894228)


class Model(Library):
    """The class of the likeliest view of the library, and its likelihood; docs/recognition.md has the equations.

    An image of unit energy and N pixels over all channels holds a share n of noise, whose covariance over the pixels is
    n Q, with Q of trace 1 from images of noise alone. n follows from the image's faint pixels (`noise.share`).
    A class's score is that of magnitudes (Rice 1945) plus COHERENCE times that of coherence (Kraut, Scharf and
    McWhorter 2001), each of its best template. Confidence scores are the largest of a known class: `likelihood`, and of
    its parts alone `rice` and `coherence`; with a class OTHER, which has templates of its own, less the score of that.
    templates_: (templates, N), complex64, of unit energy, grouped by class; starts_: (classes + 1,), where each class's
    begin, and their number; basis_: (N, directions) complex64 B with B^H Q B = 1 and B^H R B = diag(powers_), R being
    the covariance of the training images; noise_: (N,), the diagonal of Q; shape_: (channels, range, crossrange).
    """

    LABELS = {"likelihood": ("likelihood", "the likelihood of the library", 12)}
    SCORES = {"likelihood": ("likelihood", 17), "rice": ("Rician likelihood", 18), "coherence": ("coherence", 16)}
    SETTINGS = {
        "candidates": {"type": "integer", "minimum": 1, "description": "templates of a class tried, of largest ZNCC"},
        "mismatch": {"type": "number", "minimum": 0, "description": "a view's variance, in its template's local power"},
        "place": {"$ref": "#/$defs/place", "default": "search"},
    }
    covariances = True
    learns_noise = True
    additive = True
    leaves_out = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        for made in ("_white", "_bank", "_search"):  # of templates of an earlier fit
            vars(self).pop(made, None)
        order = np.argsort(labels, kind="stable")
        self.classes_, starts = np.unique(labels[order], return_index=True)
        self.starts_ = np.append(starts, len(order))
        self.shape_ = np.array(by_channel(images[:1]).shape[1:])
        self.templates_, self.aspects_ = unit_rows(images[order]), self._aspects(order)
        covariance = noise.covariance(self.noise, self.shape_, "likelihood")
        self.noise_ = noise.powers(covariance)
        powers, basis = noise.whitened(self.templates_, noise.loaded(covariance), WEAK)
        self.powers_, self.basis_ = powers.astype(np.float32), basis.astype(np.complex64)
        return self

    def _library(self):
        return self.templates_.reshape(-1, *self.shape_)

    def judge(self, images, without=None, received=None):
        parts = self._scored(images.reshape(len(images), -1), without, received)
        scores = parts[:, 0] + COHERENCE * parts[:, 1]
        known = confidence.margin(np.concatenate([scores[:, None], parts], axis=1), self.classes_)
        known = dict(zip(("likelihood", "rice", "coherence"), known.T, strict=True))
        return Outcome(self.labels_of(scores), scores, known)

    def labels_of(self, scores):
        return best_known(scores, self.classes_)

    def _scored(self, rows, without, received):
        """Rice and coherence of the best template of each class, (n, 2, classes), of images as rows (n, N)."""
        found = []
        for start in range(0, len(rows), BLOCK):
            block = rows[start : start + BLOCK]
            filled = unit(np.concatenate([block, np.repeat(block[:1], BLOCK - len(block), axis=0)]))
            magnitudes = np.abs(filled)
            share = noise.share(magnitudes, self.noise_)
            apart, pulses = (
                None if each is None else np.resize(each[start : start + BLOCK], (BLOCK, *each.shape[1:]))
                for each in (without, received)
            )
            near = self._masked(_products(standardized(magnitudes), self._bank[2]), apart, -2)
            coherence = self._coherence(filled, np.maximum(share, LEAST_NOISE), apart, near)
            found.append(np.stack([self._rice(magnitudes, share, near, pulses), coherence], axis=1)[: len(block)])
        return np.concatenate(found)

    def _coherence(self, rows, share, without, near):
        """The log-likelihood ratio of coherence with each class, (n, classes); share: of noise, (n,).

        near: ZNCC with all templates, by which those of large classes are sifted.
        """
        x, weights = _products(rows, self.basis_.conj().T), 1 / ((1 - share[:, None]) * self.powers_ + share[:, None])
        energy = (np.abs(x) ** 2 * weights).sum(axis=1, keepdims=True)
        if np.diff(self.starts_).max() > MANY:
            best = self._of_sifted(x * weights, weights, near) / np.maximum(energy, 1e-30)
        else:
            white, squared = self._white
            along = np.abs(_products(x * weights, white.conj())) ** 2
            coherence = along / np.maximum(_products(weights, squared) * energy, 1e-30)
            best = np.maximum.reduceat(self._masked(coherence, without, 0), self.starts_[:-1], axis=1)
        return -rows.shape[1] * np.log(np.maximum(1 - best, 1e-6))

    def _of_sifted(self, x, weights, near):
        """Energies (n, classes) of weighted rows x (n, directions) along the best of the SIFTED nearest templates."""
        white, best = self._white[0], np.zeros((len(x), len(self.classes_)))
        for number, (first, end) in enumerate(itertools.pairwise(self.starts_)):
            count = min(SIFTED, end - first)
            chosen = first + np.argpartition(-near[:, first:end], count - 1, axis=1)[:, :count]
            for row, templates in enumerate(chosen):
                seen, there = white[templates], near[row, templates] > -1.5
                # NumPy's magnitude of complex numbers, and their conjugates, take longer than all the rest.
                squared = seen.view(np.float32) ** 2 @ np.repeat(weights[row], 2)
                energies = np.abs(seen @ x[row].conj()) ** 2 / np.maximum(squared, 1e-30)
                best[row, number] = (energies * there).max()
        return best

    def _rice(self, magnitudes, share, near, received=None):
        """The Rician score of the best template of each class, (n, classes); share: of noise, (n,).

        near: ZNCC with all templates, masked; received: None, or pulses (n, A), of which templates are then images.
        """
        templates, around, _ = self._bank
        of_noise, scale, found = share[:, None] * self.noise_, np.sqrt(1 - share), []
        for first, end in itertools.pairwise(self.starts_):
            count = min(self.settings["candidates"], end - first)
            chosen = first + np.argpartition(-near[:, first:end], count - 1, axis=1)[:, :count]
            nearest = first + near[:, first:end].argmax(axis=1)[:, None]  # in place of what is left out
            chosen = np.where(np.take_along_axis(near, chosen, axis=1) < -1.5, nearest, chosen)
            bank = templates[chosen], around[chosen]
            if received is not None:
                shown = self.templates_[chosen].reshape(*chosen.shape, *self.shape_)
                shown = unit_rows(self._search.templates_received(shown, received).reshape(chosen.size, -1))
                bank = (part.reshape(*chosen.shape, -1) for part in self._around(shown))
            found.append(_rician(magnitudes, of_noise, scale, *bank, self.settings["mismatch"]))
        return np.stack(found, axis=1)

    @functools.cached_property
    def _white(self):
        white = self.templates_ @ self.basis_.conj()
        return white, (np.abs(white) ** 2).astype(float) if np.diff(self.starts_).max() <= MANY else None

    @functools.cached_property
    def _bank(self):
        """Magnitudes of all templates, their power around pixels, and the magnitudes as ZNCC takes them."""
        magnitudes, around = self._around(self.templates_)
        return magnitudes, around, standardized(magnitudes).astype(float)

    def _around(self, templates):
        """Magnitudes of templates (t, N), and their power around pixels."""
        magnitudes = np.abs(templates)
        power = magnitudes**2
        around = uniform_filter(power.reshape(-1, *self.shape_), AROUND, mode="nearest").reshape(power.shape)
        return magnitudes, np.maximum(around, LEAST * power.max(axis=1, keepdims=True))


def _products(rows, others):
    """Products of rows (n, N) with `others` (m, N), (n, m), whose bits do not depend on a row's place among the others.

    On some processors BLAS adds real numbers up in another order at another place: `others` have twice the digits.
    """
    return (others @ rows.T.astype(others.dtype)).T.astype(rows.dtype)


@jax.jit
def _rician(magnitudes, noise, scale, templates, around, mismatch):
    """The largest Rician log-likelihood of templates, less that of the best magnitudes: (n,).

    magnitudes, noise: (n, N), and the noise's variance; scale: (n,), of the templates, to begin with;
    templates, around: (n, K, N), and their power around each pixel.
    """
    r, s = magnitudes[:, None], jnp.broadcast_to(scale[:, None], templates.shape[:2])
    inverse = 1 / (noise[:, None] + s[..., None] ** 2 * mismatch * around)
    weighted, size = r * templates * inverse, (templates**2 * inverse).sum(axis=-1)
    # One step: more steps change a score by less than a fifth of the difference between scores of equal views.
    s = (weighted * _cosine(2 * s[..., None] * weighted)).sum(axis=-1) / jnp.maximum(size, 1e-30)
    best = jnp.sqrt(jnp.maximum(r**2 - 1 / inverse, 0))
    best = r * _cosine(2 * r * best * inverse)
    level = _log_i0(2 * s[..., None] * weighted) - _log_i0(2 * r * best * inverse) + best**2 * inverse
    return (level.sum(axis=-1) - s**2 * size).max(axis=1)


def _cosine(z):
    """I1(z) / I0(z), the expected cosine of a pixel's phase: the lower bound of Amos (1974), 5 % below it at most."""
    return z / (0.5 + jnp.sqrt(2.25 + z**2))


def _log_i0(z):
    """log I0(z): Abramowitz and Stegun (1964), 9.8.1 and 9.8.2, within 2e-7, and six times as fast as jax.scipy's."""
    near, far = jnp.minimum(z / 3.75, 1) ** 2, 3.75 / jnp.maximum(z, 3.75)
    beyond = z - 0.5 * jnp.log(jnp.maximum(z, 3.75)) + jnp.log(_polynomial(FAR_I0, far))
    return jnp.where(z < 3.75, jnp.log(_polynomial(NEAR_I0, near)), beyond)


def _polynomial(coefficients, x):
    return functools.reduce(lambda value, coefficient: value * x + coefficient, coefficients)
