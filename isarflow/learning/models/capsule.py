"""Capsule network with a decoder, by JAX: an image that it cannot reconstruct is of no known class."""

from pathlib import Path

import numpy as np
from scipy.special import logsumexp

from isarflow.learning import confidence
from isarflow.learning.classifier import OTHER, Classifier, Outcome
from isarflow.learning.data.features import by_channel
from isarflow.learning.experiments import cleanest
from isarflow.learning.networks import capsules, convolution
from isarflow.learning.networks.training_loop import Batches, Checkpoint, minimize

CODE = [Path(file) for file in (capsules.__file__, convolution.__file__, __file__)]  # on which a training depends
CHUNK = 16  # images at a time: the inputs of a convolution then fit in the processor's cache
VALIDATED = 1024  # validation images that judge an epoch, at most
GAUSSIANS, IMAGES = 8, 40  # Gaussians a class, at most, and images that each of them needs


class Model(Classifier):
    """The reference thesis's network (section 5.4, appendix D) on the magnitude of images, for example 32 x 32.

    width, capsules, decoder: sizes, as of `capsules.initial_weights`; routings: iterations of the routing by agreement.
    Trained by Adam at learning_rate x decay^epoch. The loss is the margin loss plus `reconstruction` times the mean
    squared error of the image that the decoder makes of the true class's activation vector. Training ends after
    `epochs`, or when the validation loss has not fallen for `patience` of them; the weights with the smallest are kept.
    denoise: the decoder's aim is the view's image without noise, not the noisy one that the network sees.
    complex: real and imaginary parts as two channels in and out instead of magnitudes, random phases in each batch.
    Of images of several polarizations each is a channel, or a pair of them, in and out.
    An image labelled OTHER is of no class: all capsules are to be short, and nothing is reconstructed.

    Scores are the lengths of the class capsules. Confidence scores, from the reconstruction by the predicted class:
    mse: minus the mean squared error. zncc: the zero-mean normalised cross-correlation, noise_zncc the same with the
    noise's share, estimated from the image, taken out; of complex images coherence: |r^H x| / (|r| |x|).
    length: of the predicted class's capsule. mixture: the log-density of its activation vector under a mixture of
    Gaussians fitted to the class's training images.
    """

    LABELS = {
        "capsule": ("capsule", "the capsule network", 7),
        "capsule_denoise": ("capsule, denoising", "the capsule network that takes out noise", 8),
        "capsule_other": ("capsule, other class", "the capsule network with a class 'other'", 9),
        "capsule_complex": ("capsule, complex", "the complex capsule network", 10),
        "capsule_long": ("capsule, 25,000 steps", "the capsule network of 25,000 steps", 19),
        "capsule_listing": ("capsule, listing", "the capsule network trained as by the thesis's listing", 20),
    }
    SCORES = {
        "zncc": ("ZNCC", 12),
        "mse": ("MSE", 11),
        "noise_zncc": ("ZNCC, noise taken out", 13),
        "length": ("capsule length", 14),
        "mixture": ("Gaussian mixture", 15),
        "coherence": ("coherence", 16),
    }
    SETTINGS = {
        "width": {"type": "integer", "minimum": 1, "description": "filters of the first convolution"},
        "capsules": {"type": "integer", "minimum": 1, "description": "channels of primary capsules"},
        "routings": {"type": "integer", "minimum": 1, "maximum": 20, "description": "iterations of the routing"},
        "decoder": {"type": "integer", "minimum": 1, "description": "outputs of its first layer; the second has twice"},
        "epochs": {"type": "integer", "minimum": 1, "description": "passes over the training images, at most"},
        "patience": {"type": "integer", "minimum": 1, "description": "epochs without a smaller validation loss"},
        "batch": {"type": "integer", "minimum": 1, "description": "images a batch"},
        "learning_rate": {"type": "number", "exclusiveMinimum": 0, "description": "Adam's in the first epoch"},
        "decay": {
            "type": "number",
            "exclusiveMinimum": 0,
            "maximum": 1,
            "description": "of the learning rate, an epoch",
        },
        "reconstruction": {"type": "number", "minimum": 0, "description": "weight of its mean squared error"},
        "denoise": {"type": "boolean", "description": "true: the decoder's aim is the image without noise"},
        "complex": {"type": "boolean", "description": "true: real and imaginary parts, instead of magnitudes"},
    }
    network, code = capsules, CODE  # its layers as functions; the files on which a training depends
    certainty = "length"  # the confidence score that the predicted class's capsule has by itself
    by_snr = True
    smallest = 17  # 2 KERNEL - 1 leave one primary capsule; a number, as it is read and not run

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        self.classes_ = np.unique(labels[labels != OTHER])
        x, sources, y = self._prepared(images, labels, snrs, views)
        held_out = None
        if validation is not None:
            pool, aims, truth = self._prepared(*validation)
            rows = np.unique(np.linspace(0, len(pool) - 1, VALIDATED).astype(int))
            held_out = pool[rows], pool[aims[rows]], truth[rows]
        self._train(x, sources, y, held_out, snrs)

        known = y.any(axis=1) & (True if snrs is None else snrs == cleanest(snrs))
        self._fit_mixtures(self._vectors(x[known])[y[known] > 0], y[known].argmax(axis=1))
        return self

    def _prepared(self, images, labels, snrs=None, views=None):
        """Inputs (n, rows, columns, channels), aims (n,) and truth (n, classes), 1 for the class of an image.

        aims: for each image the row number of the input that the decoder is to make. Arguments as of `fit`.
        """
        x = self._inputs(images)
        y = (labels[:, None] == self.classes_).astype(np.float32)
        if not self.settings["denoise"]:
            return x, np.arange(len(x)), y
        rows = np.flatnonzero(snrs == "clean")
        # An image of no class has no view without noise, and nothing is reconstructed.
        place = dict(zip(views[rows].tolist(), rows.tolist(), strict=True))
        return x, np.array([place.get(view, row) for row, view in enumerate(views.tolist())]), y

    def _inputs(self, images):
        """Channels (n, rows, columns, channels), float32, in the order of the images' polarizations.

        Magnitudes, or for complex images real and imaginary parts of each polarization.
        """
        last = np.moveaxis(by_channel(images), 1, -1)
        channels = [last.real, last.imag] if self.settings["complex"] else [np.abs(last)]
        stacked = np.stack(channels, axis=-1).reshape(*last.shape[:3], -1)
        return stacked.astype(np.float32, order="C", copy=False)  # NumPy has kept the images' order in memory

    def _train(self, x, sources, y, held_out, snrs):
        settings, random = self.settings, np.random.default_rng(self.seed)

        def loss(weights, x, aims, y, made):
            vectors = self.network.activations(weights, x, settings["routings"])
            error = ((self._decode(weights, vectors, y) - aims.reshape(len(x), -1)) ** 2).mean(-1)
            of_class = y.sum(-1)
            costs = self.network.margin_loss(vectors, y, made) + settings["reconstruction"] * of_class * error
            return costs, (self.network.lengths(vectors).argmax(-1) == y.argmax(-1)) * of_class, of_class

        def inputs(rows):
            seen, aims = x[rows], x[sources[rows]]
            if settings["complex"]:
                seen, aims = _turned((seen, aims), random.uniform(0, 2 * np.pi, len(rows)))
            return seen, aims, y[rows], np.full(len(rows), batches.epochs / settings["epochs"], np.float32)

        def validate(weights):
            weights = capsules.prepared(weights, held_out[0].shape)
            starts = range(0, len(held_out[0]), CHUNK)
            chunks = [[array[start : start + CHUNK] for array in held_out] for start in starts]
            costs, right, of_class = np.concatenate([loss(weights, *chunk, 1) for chunk in chunks], axis=1, dtype=float)
            return costs.mean(), right.sum() / max(of_class.sum(), 1)

        batches = Batches(len(x), settings["batch"], random, snrs)
        checkpoint = None
        if self.checkpoints is not None:
            shown = x, sources, y, np.array(snrs, str), *(held_out or ())
            checkpoint = Checkpoint(self.checkpoints, *self.code, settings, self.seed, *shown)
        sizes = settings["width"], settings["capsules"], settings["decoder"]
        weights = self.network.initial_weights(random, x.shape[1:], y.shape[1], *sizes)
        # A step of Adam moves the input of a class capsule by the rate times as many as there are primary capsules.
        # At the full rate at once, all lengths of a large network may become 1, where they have no gradient, for
        # thousands of steps.
        warm_up = len(weights["votes"]) // 2
        how = {"rate": lambda epochs: settings["learning_rate"] * settings["decay"] ** epochs}
        how |= {"epochs": settings["epochs"], "patience": settings["patience"], "validate": held_out and validate}
        how |= {"checkpoint": checkpoint, "warm_up": warm_up}
        learned, self.curve_ = minimize(loss, weights, batches, inputs, **how)
        self._keep(learned)

    def _fit_mixtures(self, vectors, y):
        """A mixture of Gaussians for each class, of activation vectors (n, CLASS) of the classes' numbers y (n,)."""
        from sklearn.mixture import GaussianMixture  # predictions do without scikit-learn

        count = max(1, min(GAUSSIANS, np.bincount(y).min() // IMAGES))
        # Each twice, as scikit-learn fits no Gaussian to a class with a single image.
        by_class = [np.repeat(vectors[y == index], 2, axis=0) for index in range(len(self.classes_))]
        mixtures = [GaussianMixture(count, reg_covar=1e-5, random_state=self.seed).fit(part) for part in by_class]
        self.mixture_logits_ = np.log([mixture.weights_ for mixture in mixtures])
        self.mixture_means_ = np.array([mixture.means_ for mixture in mixtures])
        self.mixture_whitening_ = np.array([mixture.precisions_cholesky_ for mixture in mixtures])

    def _weights(self):
        return {name: getattr(self, f"{name}_") for name in self.network.WEIGHTS}

    def _decode(self, weights, vectors, mask):
        return capsules.reconstruct(weights, vectors, mask, not self.settings["complex"])

    def _vectors(self, x):
        """Activation vectors (n, classes, CLASS) of inputs (n, rows, columns, channels)."""
        weights, routings = capsules.prepared(self._weights(), x.shape), self.settings["routings"]
        parts = [self.network.activations(weights, x[i : i + CHUNK], routings) for i in range(0, len(x), CHUNK)]
        return np.concatenate(parts)

    def _decoded(self, images):
        """Inputs, activation vectors, their lengths, 1 for the longest of each image, and the decoded images."""
        x = self._inputs(images)
        vectors = self._vectors(x)
        scores = self.network.lengths(vectors)
        mask = (scores.argmax(axis=1)[:, None] == np.arange(scores.shape[1])).astype(np.float32)
        return x, vectors, scores, mask, self._decode(self._weights(), vectors, mask)

    def reconstruct(self, images):
        """Images as the network sees them, their reconstructions, both of the first polarization, and their classes.

        The first two are magnitudes (n, rows, columns).
        """
        x, _, scores, _, made = self._decoded(images)
        first = slice(2 if self.settings["complex"] else 1)
        magnitude = [np.sqrt((channels[..., first] ** 2).sum(axis=-1)) for channels in (x, made.reshape(x.shape))]
        return *magnitude, self.classes_[scores.argmax(axis=1)]

    def evaluate(self, images):
        x, vectors, scores, mask, made = self._decoded(images)
        seen, predicted = x.reshape(len(x), -1), scores.argmax(axis=1)
        known = {"mse": -((seen - made) ** 2).mean(axis=1), self.certainty: scores.max(axis=1)}
        if self.settings["complex"]:
            # The imaginary part of each pixel follows its real part.
            known["coherence"] = confidence.coherence(seen.view(np.complex64), made.view(np.complex64))
        else:
            known["zncc"] = confidence.zncc(seen, made)
            known["noise_zncc"] = confidence.zncc(seen, made, confidence.noise_variance(seen))
        known["mixture"] = self._mixture_score(vectors[mask > 0], predicted)
        return Outcome(self.classes_[predicted], scores, known)

    def _mixture_score(self, vectors, y):
        """Log-densities (n,), up to a constant, of vectors (n, CLASS) under the mixtures of classes y (n,)."""
        score = np.zeros(len(vectors))
        for index in range(len(self.classes_)):
            means, whitening = self.mixture_means_[index], self.mixture_whitening_[index]
            white = np.einsum("nkd,kde->nke", vectors[y == index, None].astype(float) - means, whitening)
            volume = np.log(np.einsum("kdd->kd", whitening)).sum(axis=1)
            logs = self.mixture_logits_[index] + volume - 0.5 * (white**2).sum(axis=-1)
            score[y == index] = logsumexp(logs, axis=1)
        return score


def _turned(images, phases):
    """Turn images (n, rows, columns, channels), pairs of real and imaginary parts, by their phases (n,) in rad."""
    cosine, sine = (function(phases).astype(np.float32)[:, None, None, None] for function in (np.cos, np.sin))
    pairs = [(x[..., ::2], x[..., 1::2]) for x in images]
    turned = [np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1) for x, y in pairs]
    return [both.reshape(x.shape) for both, x in zip(turned, images, strict=True)]
