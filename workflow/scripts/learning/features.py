"""What models compute from complex images."""

import numpy as np


def real_imaginary(images, dtype=np.float32):
    """Real parts, then imaginary parts: images (n, range, crossrange) to features (n, 2 range crossrange)."""
    flat = images.reshape(len(images), -1)
    return np.concatenate([flat.real, flat.imag], axis=1).astype(dtype, copy=False)


def unit(features):
    """Features (n, d) scaled to length 1; a zero stays zero."""
    return features / np.maximum(np.linalg.norm(features, axis=1, keepdims=True), 1e-12)


def unit_rows(images):
    """Images (n, range, crossrange) as rows of length 1, complex64; a zero image stays zero."""
    return unit(images.reshape(len(images), -1).astype(np.complex64, copy=False))


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
    """Images (n, range, crossrange) on `pixels` a side of the same extent, divided by their new peak magnitude.

    The same as zero padding of the aperture before the Fourier transform (thesis section 4.4.5), but begun from the
    image. down: the ranges (range,) in m, uniform; carrier: the wavenumber in rad/m in the middle of the image's
    spectrum, about which the zeros are added.
    """
    shape, axes = images.shape[1:], (1, 2)
    step = (down[1] - down[0]) * shape[0] / pixels
    finer_down = (np.arange(pixels) - pixels // 2) * step
    base = images * np.exp(-2j * carrier * down).astype(np.complex64)[:, None]
    spectrum = np.fft.fftshift(np.fft.fft2(np.fft.ifftshift(base, axes), axes=axes), axes)
    padding = [(pixels // 2 - count // 2, -(-pixels // 2) - -(-count // 2)) for count in shape]
    spectrum = np.fft.ifftshift(np.pad(spectrum, [(0, 0), *padding]), axes)
    finer = np.fft.fftshift(np.fft.ifft2(spectrum, axes=axes), axes)
    finer *= np.exp(2j * carrier * finer_down).astype(np.complex64)[:, None]
    peak = np.abs(finer).max(axis=axes, keepdims=True)
    return (finer / np.where(peak > 0, peak, 1)).astype(np.complex64)
