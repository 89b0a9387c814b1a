"""Likelihood: the library of training views is the model. Magnitudes by the Rice density, coherence after whitening."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.linalg import block_diag, eigh
from scipy.ndimage import uniform_filter
from scipy.stats import norm

from learning.classifier import OTHER, Classifier, Outcome
from learning.features import by_channel, standardized, unit, unit_rows

BLOCK = 64  # images at a time, always: the last bits of a product depend on how many rows it has
SHARES = 1 / (1 + np.exp(np.linspace(5, -4, 37)))  # of noise in an image's energy, at which scores are calibrated
SMOOTH = 1.5  # of SHARES, over which the calibration is averaged
STEPS = 3  # of expectation and maximisation for the scale of a template: more changes no label
SNRS = np.arange(-12.0, 25.0, 3.0)  # dB, at which known views are scored for the calibration
KEPT = 0.95  # of known views, above a fused score of -1
LOADING = 0.01  # of the mean noise power of a pixel: what its covariance, of few images, is not sure of
FLOOR = 0.3  # of the energy: coherence takes at least so much noise, as no template is the view itself
FAINT = 0.25  # of an image's pixels, the faintest, are taken to hold nothing but noise
LEAST = 1e-6  # of a template's largest power: the least that mismatch is in proportion to
SPREAD = (1, 1, 3, 3)  # pixels over which a template's power is averaged


class Model(Classifier):
    """The class of the likeliest view of the library, and how likely it is that a known view looks no better.

    An image x of unit energy holds a share n of noise, whose covariance Q over the pixels, of trace 1, images of pure
    noise show. The share follows from the image's faint pixels: |x_p|^2 / Q_pp of noise alone has an exponential
    distribution, of which FAINT is the quantile -log(1 - FAINT).

    Rice (Rician likelihood, Rice 1944): a pixel of magnitude r has the density 2 r / v exp(-(r^2 + s^2 a^2) / v)
    I0(2 r s a / v) under a template of magnitudes a, at the likeliest scale s. Its variance v is the noise's, n Q_pp,
    and s^2 `mismatch` b: b is the template's power around the pixel, and a share of it is what a view between the
    library's differs by. The score is the log-likelihood less the largest that any magnitudes could have.
    `between` adds templates with the mean power of training views that are neighbours in elevation.

    Coherence (Kraut, Scharf and McWhorter 2001): |t^H S^-1 x|^2 / ((t^H S^-1 t) (x^H S^-1 x)), as a log-likelihood
    ratio -log(1 - it), with S = (1 - n) R + n Q, R being the covariance of the training images.

    Both are standardised by those of known validation views with fresh noise of the same share, so that one threshold
    serves all SNRs. Scores of a class are their sums for its best template. Confidence scores: `rice`, `coherence`,
    and `fused`, the log-probability that a known view has less of the first and, by itself, less of the second; at -1
    it keeps KEPT of the known views, and half of them at 0.
    templates_: (templates, pixels), complex64, of unit energy, grouped by class; starts_: (classes + 1,), where each
    class's begin, and their number; neighbours_: (pairs, 2) templates; basis_: (pixels, pixels) complex64 B with
    B^H Q B = 1 and B^H R B = diag(powers_); noise_: (pixels,), Q_pp; shape_: (channels, range, crossrange);
    usual_, spread_: (classes, 2, shares), mean and deviation of both scores of known views; fused_: (classes, 2, shares),
    the quantiles 1 - KEPT and 0.5 of their fused score.
    """

    LABELS = {"likelihood": ("likelihood", "the likelihood of the library", 10)}
    SCORES = {"fused": ("likelihood", 17), "rice": ("Rician likelihood", 18), "coherence": ("coherence", 16)}
    SETTINGS = {
        "candidates": {
            "type": "integer",
            "minimum": 1,
            "description": "templates of each class, those with the largest correlation of magnitudes and those with "
            "that of powers, whose likelihood is computed",
        },
        "mismatch": {
            "type": "number",
            "minimum": 0,
            "description": "variance of a view about its template, in units of the template's power around each pixel",
        },
        "between": {"type": "boolean", "description": "whether neighbours in elevation make templates between them"},
    }
    covariances = True
    learns_noise = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        order = np.flatnonzero(labels != OTHER)
        order = order[np.argsort(labels[order], kind="stable")]
        self.classes_, starts = np.unique(labels[order], return_index=True)
        self.starts_ = np.append(starts, len(order))
        self.shape_ = np.array(by_channel(images[:1]).shape[1:])
        self.templates_ = unit_rows(images[order])
        self.neighbours_ = _neighbours(views[order]) if self.settings["between"] else np.zeros((0, 2), int)
        noise = unit(by_channel(self.noise).reshape(-1, np.prod(self.shape_[1:])))  # each channel's by itself
        of_channel = noise.T @ noise.conj() / len(noise)
        covariance = block_diag(*[of_channel] * self.shape_[0]) / self.shape_[0]
        self.noise_ = np.diag(covariance).real.astype(np.float32)
        covariance[np.diag_indices(len(covariance))] += LOADING / len(covariance)
        spread = self.templates_.T @ self.templates_.conj() / len(order)
        powers, basis = eigh(spread.astype(np.complex128), covariance.astype(np.complex128))
        self.powers_, self.basis_ = np.maximum(powers, 0).astype(np.float32), basis.astype(np.complex64)
        held_out = (images, labels) if validation is None else (validation.images, validation.labels)
        self._calibrate(*(of[held_out[1] != OTHER] for of in held_out))
        return self

    def _calibrate(self, views, labels):
        """Learn what scores the known views (n, ...) of each class have at each share of noise. They hold no noise."""
        self.usual_ = np.zeros((len(self.classes_), 2, len(SHARES)))
        self.spread_, self.fused_ = np.ones_like(self.usual_), np.zeros_like(self.usual_)
        random, rows = np.random.default_rng(self.seed), unit_rows(views)
        channels, pixels = self.shape_[0], np.prod(self.shape_[1:])
        noise, scores = unit(by_channel(self.noise).reshape(-1, pixels)), []
        for snr in SNRS:
            drawn = noise[random.integers(len(noise), size=(len(rows), channels))]
            drawn *= np.exp(2j * np.pi * random.random((len(rows), channels, 1))) / np.sqrt(channels)
            noisy = rows + 10 ** (-snr / 20) * drawn.reshape(rows.shape).astype(np.complex64)
            scores.append(self._scored(noisy))
        places = np.concatenate([place for _, place in scores])
        number = np.tile(np.searchsorted(self.classes_, labels), len(SNRS))
        for k in range(len(self.classes_)):
            both = np.concatenate([of[:, :, k] for of, _ in scores]).T[:, number == k]
            near = np.exp(-0.5 * ((np.arange(len(SHARES))[:, None] - places[number == k]) / SMOOTH) ** 2)
            near /= np.maximum(near.sum(axis=1, keepdims=True), 1e-12)
            self.usual_[k] = both @ near.T
            self.spread_[k] = np.sqrt(np.maximum(both**2 @ near.T - self.usual_[k] ** 2, 1e-9))
            place = places[number == k]
            fused = norm.logcdf((both - self.usual_[k][:, place]) / self.spread_[k][:, place]).sum(axis=0)
            self.fused_[k] = [_quantile(fused, near, level) for level in (1 - KEPT, 0.5)]

    def evaluate(self, images):
        scores, place = self._scored(unit_rows(images))
        standard = (scores - self.usual_[:, :, place].T) / self.spread_[:, :, place].T
        low, middle = self.fused_[:, :, place].transpose(1, 2, 0)
        fused = (norm.logcdf(standard).sum(axis=1) - middle) / (middle - low)
        rice, coherence = standard.max(axis=2).T
        known = {"fused": fused.max(axis=1), "rice": rice, "coherence": coherence}
        of_class = standard.sum(axis=1)
        return Outcome(self.classes_[of_class.argmax(axis=1)], of_class, known)

    def _scored(self, rows):
        """Rice and coherence of the best template of each class, (n, 2, classes), and which share of SHARES (n,)."""
        parts = []
        for start in range(0, len(rows), BLOCK):
            block = rows[start : start + BLOCK]
            count = len(block)
            filled = unit(np.concatenate([block, np.repeat(block[:1], BLOCK - count, axis=0)]))
            magnitudes = np.abs(filled)
            share = np.quantile(magnitudes**2 / self.noise_, FAINT, axis=1) / -np.log(1 - FAINT)
            share = np.clip(share, SHARES[0], SHARES[-1]).astype(np.float32)
            place = np.abs(np.log(share[:, None] / SHARES)).argmin(axis=1)
            scores = self._rice(magnitudes, share), self._coherence(filled, np.maximum(place, np.searchsorted(SHARES, FLOOR)))
            parts.append((np.stack(scores, axis=1)[:count], place[:count]))
        scores, places = zip(*parts, strict=True)
        return np.concatenate(scores), np.concatenate(places)

    def _coherence(self, rows, place):
        """The log-likelihood ratio of coherence with each class, (n, classes); the share of noise is SHARES[place]."""
        white, squared = self._white
        x, weights = rows @ self.basis_.conj(), self._inverse[place]
        energy = (np.abs(x) ** 2 * weights).sum(axis=1, keepdims=True)
        coherence = np.abs((x * weights) @ white.conj().T) ** 2 / np.maximum(weights @ squared.T * energy, 1e-30)
        return -np.log(np.maximum(1 - np.maximum.reduceat(coherence, self.starts_[:-1], axis=1), 1e-6))

    def _rice(self, magnitudes, share):
        """The Rician score of the best template of each class, (n, classes)."""
        of_power, of_magnitude, templates, around = self._banks
        near = [standardized(magnitudes) @ of_magnitude.T, standardized(magnitudes**2) @ of_power.T]
        noise, scale, found = share[:, None] * self.noise_, np.sqrt(1 - share), []
        for mine in self._owned:
            half = min(-(-self.settings["candidates"] // 2), len(mine))
            chosen = [mine[np.argpartition(-of[:, mine], half - 1, axis=1)[:, :half]] for of in near]
            chosen = np.concatenate(chosen, axis=1)
            found.append(
                _rician(magnitudes, noise, scale, templates[chosen], self.settings["mismatch"] * around[chosen])
            )
        return np.stack(found, axis=1)

    @functools.cached_property
    def _inverse(self):
        """Of each of SHARES the diagonal of S^-1 in the basis, (shares, pixels)."""
        return (1 / ((1 - SHARES[:, None]) * self.powers_ + SHARES[:, None])).astype(np.float32)

    @functools.cached_property
    def _white(self):
        white = self.templates_ @ self.basis_.conj()
        return white, np.abs(white) ** 2

    @functools.cached_property
    def _banks(self):
        """Of all templates the powers and magnitudes as ZNCC takes them, the magnitudes, and the power around pixels."""
        magnitudes = np.abs(self.templates_)
        first, second = self.neighbours_.T
        between = np.sqrt((magnitudes[first] ** 2 + magnitudes[second] ** 2) / 2)
        magnitudes = np.concatenate([magnitudes, between])
        power = magnitudes**2
        around = uniform_filter(power.reshape(-1, *self.shape_), SPREAD, mode="nearest").reshape(power.shape)
        around = np.maximum(around, LEAST * power.max(axis=1, keepdims=True))
        return standardized(power), standardized(magnitudes), magnitudes, around

    @functools.cached_property
    def _owned(self):
        """Of each class its templates, those between neighbours too."""
        owner = np.repeat(np.arange(len(self.classes_)), np.diff(self.starts_))
        owner = np.concatenate([owner, owner[self.neighbours_[:, 0]]])
        return [np.flatnonzero(owner == number) for number in range(len(self.classes_))]


def _neighbours(views):
    """Pairs (P, 2) of views that are neighbours in elevation: of one target, at one azimuth, no other between.

    views: (n,) structured, with target, elevation and azimuth.
    """
    order = np.lexsort([views["elevation"], views["azimuth"], views["target"]])
    first, second = views[order[:-1]], views[order[1:]]
    same = (first["target"] == second["target"]) & (first["azimuth"] == second["azimuth"])
    same &= first["elevation"] != second["elevation"]
    return np.stack([order[:-1][same], order[1:][same]], axis=1)


def _quantile(values, weights, level):
    """The quantile at a level of values (n,) under each row of weights (shares, n): (shares,)."""
    order = np.argsort(values)
    below = np.cumsum(weights[:, order], axis=1)
    return values[order][np.minimum((below < level).sum(axis=1), len(values) - 1)]


@jax.jit
def _rician(magnitudes, noise, scale, templates, mismatch):
    """The largest Rician log-likelihood of templates (n, K, P), less that of the best magnitudes: (n,).

    magnitudes, noise: (n, P), and the noise's variance; scale: (n,), of the templates, to begin with; mismatch:
    (n, K, P), the variance besides at scale 1.
    """
    r, s = magnitudes[:, None], jnp.broadcast_to(scale[:, None], templates.shape[:2])
    inverse = 1 / (noise[:, None] + s[..., None] ** 2 * mismatch)
    size = (templates**2 * inverse).sum(axis=-1)
    for _ in range(STEPS):
        s = (r * templates * inverse * _bend(2 * r * templates * inverse * s[..., None])).sum(axis=-1) / size
    level = _log_density(r, s[..., None] * templates, inverse)
    best = jnp.sqrt(jnp.maximum(r**2 - 1 / inverse, 0))
    for _ in range(STEPS):
        best = r * _bend(2 * r * best * inverse)
    return (level - _log_density(r, best, inverse)).max(axis=1)


def _log_density(r, a, inverse):
    """Sum over pixels of what the log of the Rice density of magnitudes r has of a, up to a constant."""
    return (_log_i0(2 * r * a * inverse) - a**2 * inverse).sum(axis=-1)


# Polynomials of Abramowitz and Stegun (1964), 9.8.1 to 9.8.4: within 2e-7 of I0 and I1, and six times as fast as
# jax.scipy.special.
_I0 = (1, 3.5156229, 3.0899424, 1.2067492, 0.2659732, 0.0360768, 0.0045813)
_I1 = (0.5, 0.87890594, 0.51498869, 0.15084934, 0.02658733, 0.00301532, 0.00032411)
_FAR_I0 = (
    0.39894228,
    0.01328592,
    0.00225319,
    -0.00157565,
    0.00916281,
    -0.02057706,
    0.02635537,
    -0.01647633,
    0.00392377,
)
_FAR_I1 = (
    0.39894228,
    -0.03988024,
    -0.00362018,
    0.00163801,
    -0.01031555,
    0.02282967,
    -0.02895312,
    0.01787654,
    -0.00420059,
)
_FAR = 3.75


def _log_i0(z):
    near, far = jnp.minimum(z / _FAR, 1) ** 2, _FAR / jnp.maximum(z, _FAR)
    beyond = z - 0.5 * jnp.log(jnp.maximum(z, _FAR)) + jnp.log(_polynomial(_FAR_I0, far))
    return jnp.where(z < _FAR, jnp.log(_polynomial(_I0, near)), beyond)


def _bend(z):
    """I1(z) / I0(z): the expected cosine of the phase."""
    near, far = jnp.minimum(z / _FAR, 1) ** 2, _FAR / jnp.maximum(z, _FAR)
    beyond = _polynomial(_FAR_I1, far) / _polynomial(_FAR_I0, far)
    return jnp.where(z < _FAR, z * _polynomial(_I1, near) / _polynomial(_I0, near), beyond)


def _polynomial(coefficients, x):
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value
