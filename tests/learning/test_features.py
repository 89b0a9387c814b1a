"""Up-sampled images are those that imaging makes with `upsample`."""

import numpy as np
import pytest

from isarflow.imaging.formation import build_imager, form_images
from isarflow.learning.data.features import upsample


@pytest.mark.parametrize("reformat", ["none", "polar"])
@pytest.mark.parametrize(("samples", "aperture", "pixels"), [(27, 21, 64), (14, 11, 15), (6, 5, 9), (5, 5, 6)])
def test_it_is_what_imaging_makes(reformat, samples, aperture, pixels):
    frequency = np.linspace(4.05e9, 7.05e9, samples)
    angle = np.radians(1.5) * (np.arange(aperture) - aperture // 2)
    imaging = {"imager": "fourier", "aperture": aperture, "window": "hamming", "reformat": reformat, "upsample": "none"}
    random = np.random.default_rng(0)
    apertures = (random.standard_normal((4, samples * aperture, 2)) @ [1, 1j]).astype(np.complex64)

    def images(upsampled):
        imager = build_imager(frequency, angle, imaging | {"upsample": upsampled})
        return form_images(imager, apertures)[0], imager

    coarse, imager = images("none")
    finer, _ = images(pixels)
    np.testing.assert_allclose(upsample(coarse, imager.axes()[0], imager.carrier(), pixels), finer, atol=2e-5)


def test_as_many_pixels_as_there_are_change_nothing():
    random = np.random.default_rng(1)
    images = (random.standard_normal((2, 7, 7, 2)) @ [1, 1j]).astype(np.complex64)
    images /= np.abs(images).max(axis=(1, 2), keepdims=True)
    down = 0.1 * (np.arange(7) - 3)
    np.testing.assert_allclose(upsample(images, down, 55.0, 7), images, atol=1e-5)
