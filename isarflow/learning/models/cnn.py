"""Convolutional network of magnitudes and polarization phases, trained on images with noise, mirrored and stretched."""

import functools

import numpy as np

from isarflow.learning import confidence
from isarflow.learning.classifier import Classifier, Outcome, best_known
from isarflow.learning.data.features import by_channel
from isarflow.learning.models.invariants import NOISE
from isarflow.learning.networks.training_loop import Batches, minimize

STAGES = 3  # of two convolutions each, then half the rows and columns
BATCH = 512  # images at a time in predictions
SHIFT, STRETCH = 3.0, 0.12  # pixels of the finer grid, and share, by which training images are moved and stretched
SMOOTH = 0.05  # of the truth, spread over the classes
DECAY = 3e-5  # weight of half the sum of squared weights in the loss
WARM_UP = 200  # steps in which the rate rises, at most, and a tenth of all


class Model(Classifier):
    """Convolutions of 3 x 3 pixels in three stages of `width`, 2 and 4 `width` filters, a mean and a maximum of each.

    The network sees square roots of magnitudes, up-sampled by two as a magnitude has twice the band of its image, and
    of the first two polarizations the phase between them. In every batch images get noise of their own, an energy drawn
    from NOISE, are mirrored, moved and stretched, so that models of a class that nobody has shown are not too far from
    those that are. All classes weigh the same in the loss. The learning rate falls to nothing along a cosine.
    A class OTHER is learned where there is one; the confidence score `margin` is the best known logit less OTHER's.
    centre_: (2,), where the spectrum of images has its middle; weights <layer>_, (9 inputs, filters), and offsets.
    """

    LABELS = {"cnn": ("CNN", "the convolutional network (CNN)", 23)}
    SCORES = {"margin": ("margin", 19)}
    SETTINGS = {
        "width": {"type": "integer", "minimum": 1, "description": "filters of the first stage"},
        "epochs": {"type": "integer", "minimum": 1, "description": "passes over the training images"},
        "batch": {"type": "integer", "minimum": 1, "description": "images a batch"},
        "learning_rate": {"type": "number", "exclusiveMinimum": 0, "description": "Adam's largest"},
        "dropout": {"type": "number", "minimum": 0, "exclusiveMaximum": 1, "description": "share of features left out"},
    }
    learns_noise = True
    additive = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        import jax  # predictions alone would do without the gradient, but need its convolutions, too
        import optax

        x = by_channel(images).astype(np.complex64)
        x /= np.maximum(np.sqrt((np.abs(x) ** 2).sum(axis=(1, 2, 3), keepdims=True)), 1e-30)
        noise = by_channel(self.noise).astype(np.complex64)
        self.classes_, y = np.unique(labels, return_inverse=True)
        self.centre_ = _centre(x)
        random = np.random.default_rng(self.seed)
        inputs = _features(x[:1], self.centre_).shape[-1]
        class_weights = jax.numpy.asarray(len(y) / (len(self.classes_) * np.bincount(y)), np.float32)
        keep, smooth = 1 - self.settings["dropout"], SMOOTH / len(self.classes_)
        centre = self.centre_

        def loss(weights, x, noise, y, drawn):
            features = _stretched(_features(_noisy(x, noise, drawn), centre), drawn)
            pooled = _pooled(weights, features)
            pooled = pooled * (_uniform(drawn, pooled.shape) < keep) / keep
            logits = pooled @ weights["output"] + weights["output_offset"]
            aims = jax.nn.one_hot(y, len(class_weights)) * (1 - SMOOTH) + smooth
            costs = optax.softmax_cross_entropy(logits, aims) * class_weights[y]
            size = sum((of**2).sum() for name, of in weights.items() if not name.endswith("offset"))
            return costs + DECAY / 2 * size, logits.argmax(axis=1) == y, jax.numpy.ones(len(y))

        def batch(rows):
            mine = random.integers(len(noise), size=(len(rows), x.shape[1]))
            channels = np.arange(x.shape[1]) % noise.shape[1]
            return x[rows], noise[mine, channels], y[rows], random.random((len(rows), 8), np.float32)

        epochs, rate = self.settings["epochs"], self.settings["learning_rate"]
        how = {"rate": lambda epoch: rate * (1 + np.cos(np.pi * epoch / epochs)) / 2, "epochs": epochs}
        batches = Batches(len(x), self.settings["batch"], random)
        how["warm_up"] = min(WARM_UP, batches.count * epochs // 10)
        learned, self.curve_ = minimize(loss, self._initial(random, inputs), batches, batch, **how)
        self._keep(learned)
        return self

    def _initial(self, random, inputs):
        weights, width = {}, self.settings["width"]
        for stage in range(STAGES):
            for part in "ab":
                filters = width * 2**stage
                scale = np.sqrt(2 / (9 * inputs))
                weights[f"{part}{stage}"] = (scale * random.standard_normal((9 * inputs, filters))).astype(np.float32)
                weights[f"{part}{stage}_offset"] = np.zeros(filters, np.float32)
                inputs = filters
        weights["output"] = np.zeros((2 * inputs, len(self.classes_)), np.float32)
        weights["output_offset"] = np.zeros(len(self.classes_), np.float32)
        return weights

    def evaluate(self, images):
        logits = np.concatenate([self._logits(images[start : start + BATCH]) for start in range(0, len(images), BATCH)])
        margin = confidence.margin(logits, self.classes_)
        return Outcome(best_known(logits, self.classes_), logits, {"margin": margin})

    def _logits(self, images):
        """Logits (n, classes): of an image and its mirror image, the mean."""
        layers = [f"{part}{stage}" for stage in range(STAGES) for part in "ab"]
        weights = {name: getattr(self, f"{name}_") for layer in layers for name in (layer, f"{layer}_offset")}
        x = np.zeros((BATCH, *by_channel(images).shape[1:]), np.complex64)
        x[: len(images)] = by_channel(images)
        features = _features(x, self.centre_)
        pooled = _compiled()(weights, features) + _compiled()(weights, features[:, :, ::-1])
        logits = np.asarray(pooled, float) / 2 @ self.output_ + self.output_offset_
        return logits[: len(images)]


def _centre(x):
    """The row and column in which the spectra of images have most power, as their circular mean: integers (2,)."""
    power = (np.abs(np.fft.fft2(x)) ** 2).sum(axis=(0, 1))
    angles = [2 * np.pi * np.arange(size) / size for size in power.shape]
    sums = [(power.sum(axis=1 - axis) * np.exp(1j * angle)).sum() for axis, angle in enumerate(angles)]
    return np.array([round(np.angle(of) / (2 * np.pi) * size) for of, size in zip(sums, power.shape, strict=True)])


def _features(x, centre):
    """Channels (n, 2 rows, 2 columns, features) of images (n, channel, rows, columns), of power 1 on average."""
    import jax.numpy as jnp

    rows, columns = x.shape[2:]
    spectrum = jnp.fft.fftshift(jnp.fft.fft2(jnp.asarray(x)), (-2, -1))
    spectrum = jnp.roll(spectrum, (-int(centre[0]), -int(centre[1])), (-2, -1))
    around = [(0, 0), (0, 0), (rows // 2, rows - rows // 2), (columns // 2, columns - columns // 2)]
    finer = jnp.fft.ifft2(jnp.fft.ifftshift(jnp.pad(spectrum, around), (-2, -1)))
    power = (jnp.abs(finer) ** 2).mean(axis=(1, 2, 3), keepdims=True)
    finer = finer / jnp.sqrt(jnp.maximum(power, 1e-30))
    found = jnp.sqrt(jnp.maximum(jnp.abs(finer), 1e-12))
    if x.shape[1] > 1:
        both = finer[:, 0] * finer[:, 1].conj()
        both = both / jnp.maximum(jnp.abs(both), 1e-12) ** 0.75
        found = jnp.concatenate([found, both.real[:, None], both.imag[:, None]], axis=1)
    return jnp.moveaxis(found, 1, -1).astype(jnp.float32)


def _noisy(x, noise, drawn):
    """Images of energy 1 with noise, its share of the energy by the first random number of each."""
    import jax.numpy as jnp

    low, high = np.log(NOISE)
    share = jnp.exp(low + (high - low) * drawn[:, 0])[:, None, None, None]
    noise = noise / jnp.sqrt(jnp.maximum((jnp.abs(noise) ** 2).sum(axis=(1, 2, 3), keepdims=True), 1e-30))
    return jnp.sqrt(1 - share) * x + jnp.sqrt(share) * noise * jnp.exp(2j * np.pi * drawn[:, 1])[:, None, None, None]


def _stretched(features, drawn):
    """Features mirrored, moved and stretched, by random numbers (n, 8) of each."""
    import jax
    import jax.numpy as jnp

    features = jnp.where((drawn[:, 2] < 0.5)[:, None, None, None], features[:, :, ::-1], features)
    size = jnp.array(features.shape[1:3])
    scale = 1 + STRETCH * (2 * drawn[:, 3:4] - 1) + STRETCH / 3 * (2 * drawn[:, 4:6] - 1)
    moved = (1 - scale) * (size - 1) / 2 + SHIFT * (2 * drawn[:, 6:8] - 1)

    def one(image, scale, moved):
        places = [(jnp.arange(count) - shift) / by for count, shift, by in zip(image.shape, moved, scale, strict=False)]
        grid = jnp.meshgrid(*places, indexing="ij")

        def of_channel(channel):
            return jax.scipy.ndimage.map_coordinates(channel, grid, order=1, mode="wrap")

        return jax.vmap(of_channel, in_axes=-1, out_axes=-1)(image)

    return jax.vmap(one)(features, scale, moved)


def _uniform(drawn, shape):
    """Random numbers of a shape that follow from those drawn."""
    import jax

    key = jax.random.fold_in(jax.random.key(0), (drawn[0, 0] * 2**30).astype("uint32"))
    return jax.random.uniform(key, shape)


def _pooled(weights, features):
    """The mean and the maximum of each last filter over the image, (n, 8 width)."""
    import jax
    import jax.numpy as jnp

    how = {"window_strides": (1, 1), "padding": "SAME", "dimension_numbers": ("NHWC", "HWIO", "NHWC")}
    for stage in range(STAGES):
        for part in "ab":
            kernel = weights[f"{part}{stage}"].reshape(3, 3, features.shape[-1], -1)
            features = jax.lax.conv_general_dilated(features, kernel, **how) + weights[f"{part}{stage}_offset"]
            spread = jnp.sqrt((features**2).mean(axis=(1, 2, 3), keepdims=True) + 1e-6)
            features = jax.nn.relu(features / spread)
        if stage < STAGES - 1:
            rows, columns = (size // 2 * 2 for size in features.shape[1:3])
            halves = features[:, :rows, :columns].reshape(len(features), rows // 2, 2, columns // 2, 2, -1)
            features = halves.mean(axis=(2, 4))
    return jnp.concatenate([features.mean(axis=(1, 2)), features.max(axis=(1, 2))], axis=1)


@functools.cache
def _compiled():
    import jax

    return jax.jit(_pooled)
