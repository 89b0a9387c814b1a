"""Compute features of complex images, which are (n, range, crossrange), or (n, channel, range, crossrange)."""

import numpy as np

from isarflow.core.errors import InputError

KINDS = ("parts", "magnitude", "power", "log")  # of features; config/schema.yaml says what they are
FLOOR_DB = -60  # below an image's peak: fainter pixels are set to this in `log`


def by_channel(images):
    """The images as (n, channel, range, crossrange), also if there is one channel without an axis."""
    return images.reshape(len(images), -1, *images.shape[-2:])


def of(images, kind, dtype=np.float32):
    """Compute a model's features by its setting `features`: rows of real numbers (n, d), all channels in one.

    parts: real parts of all pixels, then imaginary ones; log: 1 + log10(|x| / peak) / 3, so from 0 at -60 dB to 1 at
    the image's peak. InputError for an unknown kind.
    """
    if kind not in KINDS:
        raise InputError(f"a model's setting 'features' is {kind!r}; it must be one of {', '.join(KINDS)}.")
    rows = images.reshape(len(images), -1)
    if kind == "parts":
        return np.concatenate([rows.real, rows.imag], axis=1).astype(dtype, copy=False)
    rows = np.abs(rows).astype(dtype, copy=False)
    if kind == "power":
        return rows**2
    if kind == "log":
        peak = rows.max(axis=1, keepdims=True)
        rows = np.maximum(rows / np.where(peak > 0, peak, 1), 10 ** (FLOOR_DB / 20))
        return 1 - 20 * np.log10(rows) / FLOOR_DB
    return rows


def unit(features):
    """Features (n, d) scaled to length 1; a zero stays zero."""
    return features / np.maximum(np.linalg.norm(features, axis=1, keepdims=True), 1e-12)


def unit_rows(images):
    """Images as rows of length 1, complex64; a zero image stays zero."""
    return unit(images.reshape(len(images), -1).astype(np.complex64, copy=False))


def standardized(features):
    """Features (n, d) without their means and of length 1: products are their ZNCC. A constant row is zero."""
    return unit(features - features.mean(axis=1, keepdims=True))


def of_peak_one(images):
    """Images divided by their peak magnitude over all channels, complex64; a zero image stays zero."""
    peak = np.abs(images).max(axis=tuple(range(1, images.ndim)), keepdims=True)
    return (images / np.where(peak > 0, peak, 1)).astype(np.complex64)


def squared_distances(x, references, squared_norms):
    """Squared Euclidean distances between x (n, features) and references (m, features), shape (n, m).

    One matrix product, |x|^2 - 2 x.r + |r|^2; `squared_norms` are the references' |r|^2, shape (m,).
    """
    distances = x @ references.T
    distances *= -2
    distances += squared_norms
    distances += np.einsum("ij,ij->i", x, x)[:, None]
    # Rounding can take the distance between equal points below zero.
    return np.maximum(distances, 0, out=distances)


def upsample(images, down, carrier, pixels):
    """Images on `pixels` a side of the same extent, divided by their new peak magnitude.

    As zero padding of the aperture before the Fourier transform (thesis section 4.4.5), but from the image. down: the
    ranges (range,) in m, uniform; carrier: the wavenumber in rad/m in the middle of the image's spectrum.
    """
    shape, axes = images.shape[-2:], (-2, -1)
    step = (down[1] - down[0]) * shape[0] / pixels
    finer_down = (np.arange(pixels) - pixels // 2) * step
    base = images * np.exp(-2j * carrier * down).astype(np.complex64)[:, None]
    spectrum = np.fft.fftshift(np.fft.fft2(np.fft.ifftshift(base, axes), axes=axes), axes)
    padding = [(pixels // 2 - count // 2, -(-pixels // 2) - -(-count // 2)) for count in shape]
    spectrum = np.fft.ifftshift(np.pad(spectrum, [(0, 0)] * (images.ndim - 2) + padding), axes)
    finer = np.fft.fftshift(np.fft.ifft2(spectrum, axes=axes), axes)
    finer *= np.exp(2j * carrier * finer_down).astype(np.complex64)[:, None]
    return of_peak_one(finer)
