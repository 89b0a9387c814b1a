"""Imagers that look for scatterers: where they are and how strong, in closed form, and what noise and gaps do."""

import numpy as np
import pytest
import xarray as xr

from isarflow.imaging.formation import build_imager, form_images
from isarflow.imaging.imagers.centres import fit
from isarflow.imaging.imagers.sparse import fista
from isarflow.imaging.scatterers import waves
from isarflow.imaging.target_centres import near, target_centres

FREQUENCY, ANGLE = np.linspace(2.025e9, 3.525e9, 14), np.radians(3.0) * (np.arange(11) - 5)
SETTINGS = {
    "sparse": {"pixels": 4, "sparsity": 0.02, "iterations": 400},
    "esprit": {"pixels": 4, "scatterers": 10},
    "centres": {"pixels": 4, "centres": 10},
}
OFF = {"sparse": 0.25, "esprit": 0.03, "centres": 1e-4}  # cells by which a lone scatterer is off at most: a pixel; 1 %
LOUDNESS = {"sparse": 0.03, "esprit": 0.01, "centres": 1e-4}  # relative error of its amplitude, where it is on a pixel
PLACES = [(0, 0), (0.3, -0.4), (-3.25, 2.5), (2.5, 1.75)]  # cells


@pytest.fixture(params=SETTINGS)
def imager(request):
    built = build_imager(FREQUENCY, ANGLE, {"imager": request.param, "aperture": len(ANGLE), **SETTINGS[request.param]})
    built.name = request.param
    return built


def samples_of(imager, places, amplitudes, snr_db=None, seed=0):
    """Samples (1, F * A) of scatterers at places (M, 2) in cells."""
    clean = waves(imager.wavevectors, np.asarray(places) * imager.cell) @ np.asarray(amplitudes, complex)
    if snr_db is not None:
        power = (np.abs(clean) ** 2).mean() / 10 ** (snr_db / 10)
        clean = clean + np.random.default_rng(seed).standard_normal((len(clean), 2)) @ [1, 1j] * np.sqrt(power / 2)
    return clean[None].astype(np.complex64)


def strongest(imager, samples, count=1):
    """Places (count, 2) in cells, from near range to far, and amplitudes of the strongest scatterers of one image."""
    ((places, amplitudes),) = imager.find(samples)
    kept = np.argsort(-np.abs(amplitudes))[:count]
    kept = kept[np.argsort(places[kept, 0])]
    return places[kept] / imager.cell, amplitudes[kept]


@pytest.mark.parametrize("place", PLACES)
def test_a_lone_scatterer_is_where_it_is(imager, place):
    found, _ = strongest(imager, samples_of(imager, [place], [0.3 - 0.4j]))
    assert np.abs(found[0] - place).max() <= OFF[imager.name]


@pytest.mark.parametrize("place", [(0, 0), (-3.25, 2.5), (2.5, 1.75)])  # pixels
def test_its_spot_has_its_amplitude_and_phase(imager, place):
    down, cross = np.asarray(place) * imager.cell
    spot = imager.at(np.array([down]), np.array([cross]))(samples_of(imager, [place], [0.3 - 0.4j]))
    assert spot.shape == (1, 1, 1) and spot[0, 0, 0] == pytest.approx(0.3 - 0.4j, abs=LOUDNESS[imager.name])
    image = np.abs(imager.on_axes(samples_of(imager, [place], [0.3 - 0.4j]))[0])
    row, column = np.unravel_index(image.argmax(), image.shape)
    assert imager.axes()[0][row] == pytest.approx(down) and imager.axes()[1][column] == pytest.approx(cross)


def test_there_is_nothing_else_beside_it(imager):
    image = np.abs(imager.on_axes(samples_of(imager, [(1.5, -2)], [1]))[0])
    off = [np.abs(axis / cell - at) for axis, cell, at in zip(imager.axes(), imager.cell, (1.5, -2), strict=True)]
    away = np.maximum.outer(*off)
    assert image[away > 1].max() < 0.01


def test_two_scatterers_nearer_than_a_cell_are_two(imager):
    """In phase and half a cell apart (sparse: three quarters), 30 dB."""
    half = 0.375 if imager.name == "sparse" else 0.25
    found, amplitudes = strongest(imager, samples_of(imager, [(-half, 0), (half, 0)], [1, 1j], 30), 2)
    assert np.abs(found - [(-half, 0), (half, 0)]).max() < 0.26
    if imager.name != "sparse":  # of which some pixels share an amplitude
        assert amplitudes == pytest.approx(np.array([1, 1j]), abs={"esprit": 0.3, "centres": 0.1}[imager.name])


def test_a_shifted_target_is_a_shifted_image(imager):
    """Samples times exp(1j q . shift) are those of a target that is moved, here by whole pixels."""
    places, amplitudes = np.array([(-2, 1), (0.25, -0.5), (1.5, 1.5)]), [1, 0.6j, -0.8]
    shift = np.array([3, -2])
    image, moved = (
        imager.on_axes(samples_of(imager, places + by / imager.settings["pixels"], amplitudes))[0] for by in (0, shift)
    )
    difference = np.abs(np.roll(image, shift, axis=(0, 1)) - moved).max()
    assert difference < {"sparse": 0.02, "esprit": 0.05, "centres": 1e-3}[imager.name]


def test_the_image_turns_with_the_phase_and_grows_with_the_field(imager):
    samples = samples_of(imager, [(-1, 0.5), (1.25, 0)], [1, 0.7j], 20)
    once, turned = (imager.on_axes(factor * samples)[0] for factor in (1, -0.25j))
    np.testing.assert_allclose(turned, -0.25j * once, atol=2e-4 * np.abs(once).max())


def test_polarizations_do_not_see_each_other(imager):
    first, second = (samples_of(imager, [place], [1], 20, seed) for seed, place in enumerate(((1, 1), (-2, 0.5))))
    both, peak = form_images(imager, np.stack([first, 5 * second], axis=1))
    alone, own = form_images(imager, first)
    assert both.shape[:2] == (1, 2)
    np.testing.assert_allclose(both[0, 0] * peak[0], alone[0] * own[0], atol=1e-3)


def test_noise_alone_makes_no_target(imager):
    """Of unit variance: the largest peak of a Fourier image is about sqrt(ln(pixels) / samples)."""
    noise = (np.random.default_rng(0).standard_normal((40, FREQUENCY.size * ANGLE.size, 2)) @ [1, 1j]) / np.sqrt(2)
    image = np.abs(imager.on_axes(noise.astype(np.complex64)))
    assert np.isfinite(image).all()
    peaks = image.max(axis=(1, 2))
    assert peaks.max() < 1.5 * np.sqrt(np.log(FREQUENCY.size * ANGLE.size * 4) / (FREQUENCY.size * ANGLE.size))
    if imager.name != "sparse":  # which finds pixels in anything
        assert (peaks == 0).mean() >= 0.8


def test_a_zero_field_makes_a_zero_image(imager):
    assert not imager.on_axes(np.zeros((2, FREQUENCY.size * ANGLE.size), np.complex64)).any()


@pytest.mark.parametrize("missing", [np.s_[:, [2, 3, 7, 9, 12]], np.s_[:, :, [1, 4, 8]]], ids=["frequencies", "pulses"])
def test_missing_samples_are_left_out(imager, missing):
    """A third of them is missing: an imager that leaves them out finds place and amplitude all the same."""
    samples = samples_of(imager, [(1.25, -0.75)], [1]).reshape(1, len(FREQUENCY), -1)
    samples[missing] = 0
    found, _ = strongest(imager, samples.reshape(1, -1))
    down, cross = np.array([1.25, -0.75]) * imager.cell
    spot = abs(imager.at(np.array([down]), np.array([cross]))(samples)[0, 0, 0])
    survives = imager.name != "esprit"  # which takes them for zeros, as its page says
    assert (np.abs(found[0] - (1.25, -0.75)).max() < 0.1 and spot == pytest.approx(1, abs=0.04)) == survives


def test_fista_finds_the_least_sum():
    """There the gradient of every pixel that is not zero has the size of the weight, and that of the others is less."""
    random = np.random.default_rng(0)
    matrix, samples = (random.standard_normal((*shape, 2)) @ [1, 1j] for shape in ((60, 40), (3, 40)))
    matrix, samples = matrix.astype(np.complex64), samples.astype(np.complex64)
    there = random.random(samples.shape) > 0.2
    samples = samples * there
    image = fista(matrix, samples, there, 0.3, 1000)
    gradient = ((samples - image @ matrix) * there) @ matrix.conj().T
    weight = 0.3 * np.abs(samples @ matrix.conj().T).max(axis=1, keepdims=True)
    shown = np.abs(image) > 1e-4 * np.abs(image).max()
    assert 0.05 < shown.mean() < 0.6
    np.testing.assert_allclose((gradient / weight)[shown], (image / np.maximum(np.abs(image), 1e-9))[shown], atol=0.02)
    assert (np.abs(gradient) <= 1.01 * weight).all()


def test_centres_reach_the_cramer_rao_bound():
    """The mean error of a lone scatterer's range is that of the bound, within the spread of so many draws."""
    imager = build_imager(FREQUENCY, ANGLE, {"imager": "centres", "aperture": len(ANGLE), **SETTINGS["centres"]})
    q = imager.wavevectors
    shape = waves(q, np.zeros((1, 2)))
    slopes = np.hstack([1j * q * shape, shape, 1j * shape])
    bound = np.sqrt(np.diag(np.linalg.inv(2 / 0.1 * (slopes.conj().T @ slopes).real))[:2])  # 10 dB
    off = [
        strongest(imager, samples_of(imager, [(0, 0)], [1], 10, seed))[0][0] * imager.cell / bound for seed in range(60)
    ]
    assert np.sqrt(np.square(off).mean(axis=0)) == pytest.approx([1, 1], abs=0.3)


def test_centres_of_a_sweep_stand_on_the_target():
    """Three scatterers in space, seen over azimuth and elevation: within a hundredth of the resolution."""
    frequency, elevation, azimuth = FREQUENCY, np.arange(-22.5, 23, 7.5), np.arange(121) * 360 / 121
    truth, amplitudes = np.array([(0.3, 0.1, 0.05), (-0.2, 0.2, -0.05), (0.05, -0.25, 0.0)]), [1, 0.5j, -0.7]
    el, az = np.meshgrid(np.radians(elevation), np.radians(azimuth), indexing="ij")
    towards = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)
    wavevectors = 4 * np.pi * frequency[:, None, None, None] / 299792458 * towards
    field = (np.exp(1j * wavevectors @ truth.T) @ amplitudes).astype(np.complex64)
    axes = {"frequency": frequency, "elevation": elevation, "azimuth": azimuth}
    field = xr.DataArray(field, axes, list(axes))
    box = np.array([(-0.4, -0.4, -0.1), (0.4, 0.4, 0.1)])
    seen = near(field, 11, 0.0, azimuth[15])
    assert dict(seen.sizes) == {"frequency": 14, "elevation": 3, "azimuth": 11}
    assert near(field, 11, 0.0, 0.0).azimuth.values[[0, -1]] == pytest.approx([0, 357.0], abs=0.1)  # round the circle
    places, found = target_centres(seen, box)
    order = [np.linalg.norm(places - place, axis=1).argmin() for place in truth]
    assert len(places) == 3
    np.testing.assert_allclose(places[order], truth, atol=1e-3)
    np.testing.assert_allclose(found[order], amplitudes, atol=1e-2)


def test_no_more_centres_than_asked_for():
    places = np.random.default_rng(0).uniform(-3, 3, (12, 2))
    imager = build_imager(FREQUENCY, ANGLE, {"imager": "centres", "aperture": 11, "pixels": 4, "centres": 5})
    found, _ = fit(samples_of(imager, places, np.ones(12))[0], imager.wavevectors, *imager.searched, imager.cell, 5)
    assert len(found) == 5
