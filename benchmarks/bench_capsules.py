"""What the capsule network costs: `make bench-capsules`.

A step of its training as it is, with slices for each convolution, and with XLA's own; an epoch of the reference
experiment; a prediction, alone and in batches. The images are noise: neither takes longer or shorter for what they
show. Run nothing beside it.
"""

import time

import jax
import numpy as np
import optax
from runner import options_of

from isarflow.learning.classifier import build_classifier
from isarflow.learning.evaluation.timing import BATCH_IMAGES, cpu, time_batches
from isarflow.learning.networks import capsules, convolution
from isarflow.setup.config import load_config

SIDE, IMAGES, STEP = 32, 6460, 114  # pixels a side, training images of the reference experiment, and of its batches
FEW = 8  # images of a step with XLA's convolution, which takes as long for each of more
PUBLISHED = 0.6934  # ms, the thesis's table 5.3


def xla(images, weights, offset, stride):
    """The same as convolution.convolve, by XLA's."""
    kernel = weights.reshape(convolution.KERNEL, convolution.KERNEL, images.shape[-1], -1)
    layout = ("NHWC", "HWIO", "NHWC")
    return jax.lax.conv_general_dilated(images, kernel, (stride, stride), "VALID", dimension_numbers=layout) + offset


def step_of(settings, convolve, count):
    """A function that trains one batch of `count` images and gives the seconds an image."""
    random = np.random.default_rng(0)
    sizes = (settings[name] for name in ("width", "capsules", "decoder"))
    weights = jax.tree.map(jax.numpy.asarray, capsules.initial_weights(random, (SIDE, SIDE, 1), 2, *sizes))
    x = jax.numpy.asarray(random.random((count, SIDE, SIDE, 1)), np.float32)
    y = jax.numpy.asarray(np.eye(2, dtype=np.float32)[random.integers(2, size=count)])
    optimizer = optax.adam(1e-3)
    state = optimizer.init(weights)

    def loss(weights, x, y):
        capsules.convolve = convolve
        vectors = capsules.activations(weights, x, settings["routings"])
        error = (capsules.reconstruct(weights, vectors, y, True) - x.reshape(count, -1)) ** 2
        return (capsules.margin_loss(vectors, y) + settings["reconstruction"] * error.mean(-1)).mean()

    @jax.jit
    def step(weights, state, x, y):
        value, gradient = jax.value_and_grad(loss)(weights, x, y)
        change, state = optimizer.update(gradient, state)
        return optax.apply_updates(weights, change), state, value

    def timed():
        start = time.perf_counter()
        jax.block_until_ready(step(weights, state, x, y))
        return (time.perf_counter() - start) / count

    timed()  # compiles
    capsules.convolve = convolution.convolve
    return timed


def main():
    options = options_of(__doc__, repeats={"type": int, "default": 5})
    small = load_config()["learning"]["models"]["capsule"]
    full = small | {"width": 256, "capsules": 32, "decoder": 512}
    print(f"{cpu()}, {options.threads} threads; images of {SIDE} x {SIDE}; milliseconds an image, medians")
    titles = ("network", "weights", "train", "slices", "XLA", "epoch", "alone", f"in {BATCH_IMAGES}")
    print(" ".join(f"{title:>10}" for title in titles))
    random = np.random.default_rng(0)
    parts = random.standard_normal((IMAGES, SIDE, SIDE, 2), dtype=np.float32)
    images = parts.view(np.complex64)[..., 0]
    images /= np.abs(images).max(axis=(1, 2), keepdims=True)
    labels = np.where(np.arange(IMAGES) % 2, "drone", "missile")
    for name, settings in (("full", full), ("small", small)):
        ways = (convolution.convolve, STEP), (convolution.by_slices, STEP), (xla, FEW)
        steps = [step_of(settings, *way) for way in ways]
        ours, slices, theirs = np.median([[step() for step in steps] for _ in range(options.repeats)], axis=0) * 1e3
        model = build_classifier("capsule", settings | {"epochs": 1, "batch": 114}, 0).fit(images[:256], labels[:256])
        size = sum(value.size for value in model._weights().values())
        times = [time_batches(model.predict, images, count) for count in (1, BATCH_IMAGES)]
        alone, batch = (one["milliseconds_per_observation"] for one in times)
        row = name, f"{size:,}", f"{ours:.2f}", f"{slices:.2f}", f"{theirs:.2f}", f"{ours * IMAGES / 1e3:.0f} s"
        print(" ".join(f"{cell:>10}" for cell in (*row, f"{alone:.2f}", f"{batch:.3f}")))
    print(f"epoch: {IMAGES:,} images, the reference experiment's. The thesis's prediction took {PUBLISHED} ms.")


if __name__ == "__main__":
    main()
