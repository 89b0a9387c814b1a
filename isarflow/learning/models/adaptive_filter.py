"""Adaptive matched filter: correlations with templates, in which features common to all images count little."""

import numpy as np

from isarflow.learning.classifier import ANY_SNR, OTHER, Outcome
from isarflow.learning.data.features import unit_rows
from isarflow.learning.experiments import cleanest
from isarflow.learning.library import Library


class Model(Library):
    """The class of the template with the largest adaptive coherence with the image.

    |t^H S^-1 x|^2 / ((t^H S^-1 t) (x^H S^-1 x)) for a template t and an image x (Kraut, Scharf and McWhorter 2001,
    Adaptive subspace detectors): the matched filter after S has been made white. Here S is the covariance of all
    training images at one SNR, with `loading` times its mean eigenvalue on the diagonal: what known targets have in
    common, and the noise. An image gets the S of that SNR under which it is likeliest, up to an unknown amplitude
    (complex angular central Gaussian, Kent 1997). Templates are the training images with the least noise. None is left
    out for a threshold, as a training image's own noise is in S.
    Scores are the roots of the largest coherence with each class, 0 to 1. Confidence score: `coherence`, the largest of
    a known class. templates_: (pixels, templates), complex64, conjugate, grouped by class; starts_: (classes,), each
    class's first; inverses_: (SNRs, pixels, pixels), the S^-1, and volumes_ (SNRs,) the log det S; sizes_:
    (SNRs, templates), the roots of t^H S^-1 t.
    """

    LABELS = {"adaptive_filter": ("adaptive filter", "the adaptive matched filter", 11)}
    SCORES = {"coherence": ("coherence", 16)}
    SETTINGS = {
        "loading": {"type": "number", "exclusiveMinimum": 0, "description": "diagonal, in mean eigenvalues"},
        "place": {"$ref": "#/$defs/place", "default": "search"},
    }
    by_snr = True
    covariances = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        x = unit_rows(images)
        snrs = np.full(len(x), "all") if snrs is None else snrs
        clean = np.flatnonzero((snrs == cleanest(snrs)) | (snrs == ANY_SNR))
        order = clean[np.argsort(labels[clean], kind="stable")]
        self.classes_, self.starts_ = np.unique(labels[order], return_index=True)
        templates = x[order]
        self.templates_ = np.ascontiguousarray(templates.conj().T)
        inverses, volumes, sizes = [], [], []
        for name in np.unique(snrs[labels != OTHER]):
            known = x[(snrs == name) & (labels != OTHER)]
            covariance = (known.T @ known.conj()).astype(np.complex128) / len(known)
            load = self.settings["loading"] * np.trace(covariance).real / len(covariance)
            covariance += max(load, 1e-12) * np.eye(len(covariance))
            inverse = np.linalg.inv(covariance)
            inverses.append(inverse.astype(np.complex64))
            volumes.append(np.linalg.slogdet(covariance)[1])
            sizes.append(np.sqrt(np.einsum("ni,ij,nj->n", templates.conj(), inverse, templates, optimize=True).real))
        self.inverses_, self.volumes_ = np.array(inverses), np.array(volumes)
        self.sizes_ = np.maximum(sizes, 1e-12).astype(np.float32)  # a zero template correlates with nothing
        self._keep_library(images[order])
        return self

    def judge(self, images, without=None, received=None):
        x = unit_rows(images)
        white = np.stack([x @ inverse.T for inverse in self.inverses_])
        powers = np.einsum("sni,ni->sn", white, x.conj()).real
        # Minus the log-density, up to a constant.
        costs = self.volumes_[:, None] + x.shape[1] * np.log(np.maximum(powers, 1e-30))
        likeliest, rows = costs.argmin(axis=0), np.arange(len(x))
        coherence = np.abs(white[likeliest, rows] @ self.templates_) / self.sizes_[likeliest]
        coherence /= np.sqrt(np.maximum(powers[likeliest, rows], 1e-30))[:, None]
        scores = np.maximum.reduceat(coherence, self.starts_, axis=1)
        known = scores[:, self.classes_ != OTHER].max(axis=1)
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, {"coherence": known})
