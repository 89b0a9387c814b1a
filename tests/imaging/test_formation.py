"""Images of point scatterers: where they lie, how high and how wide they are."""

import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.imaging.formation import Formation, apertures, build_imager, form_images
from isarflow.imaging.geometry import imager_of, project
from isarflow.imaging.imagers import fourier

# Inside the inner half of the unambiguous region (1.30 m x 1.04 m), where bilinear interpolation holds.
INNER = [(0, 0), (0.31, 0), (-0.31, 0), (0, 0.25), (0, -0.25), (0.2, 0.15), (-0.27, 0.21), (0.13, -0.24)]


@pytest.mark.parametrize("x, y", INNER)
@pytest.mark.parametrize("centre", [0, 5, 121, 200])
def test_polar_focuses_at_the_true_place(image_of, wide, x, y, centre):
    turn = np.radians(wide.azimuth[centre])
    # The scatterer turned with the radar, so that it stays within the inner half of the image.
    point = np.array([[x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), 0.0]])
    image = image_of(point, wide, centre)
    place, value = image.peak()
    truth = np.array([-x, y])
    np.testing.assert_allclose(np.ravel(project(point, 0.0, image.azimuth)), truth, atol=1e-12)
    assert (np.abs(place - truth) < 0.25 * image.pixel).all()
    assert 0.4 < abs(value) < 1.01


def test_exact_focuses_everywhere(image_of, wide):
    """Anywhere in the unambiguous extent of 1.30 m x 1.04 m: within a quarter of a pixel, less than 0.2 dB lost."""
    wide.imaging["reformat"] = "exact"
    extent = np.array([C0 / (2 * 3e9 / 26), C0 / 5.55e9 / (2 * 2 * np.pi / 242)])  # eqs. 3.11, 3.13
    places = np.random.default_rng(0).uniform(-0.49, 0.49, (40, 2)) * extent
    corners = 0.49 * extent * [[1, 1], [1, -1], [-1, 1], [-1, -1]]
    for x, y in [*places, *corners]:
        image = image_of([[x, y, 0.0]], wide, 0)
        place, value = image.peak()
        assert (np.abs(place - [-x, y]) < 0.25 * image.pixel).all()
        assert abs(20 * np.log10(abs(value))) < 0.2
        assert np.angle(image.at([-x], [y])[0, 0]) == pytest.approx(0, abs=1e-3)


def test_exact_is_the_back_projection_sum(wide):
    """Eq. 3.14 written out, at one pixel, for samples of no meaning."""
    wide.imaging["reformat"] = "exact"
    imager = imager_of(wide.frequency, wide.azimuth, wide.imaging)
    samples = np.random.default_rng(0).standard_normal((27, 21, 2)) @ [1, 1j]
    down, cross = imager.axes()
    image = imager.matrix(down, cross) @ samples.ravel()
    total = weights = 0
    for i, frequency in enumerate(wide.frequency):
        for j, phi in enumerate(imager.angle):
            k = 2 * np.pi * frequency / C0
            weight = k * (0.54 - 0.46 * np.cos(2 * np.pi * i / 26)) * (0.54 - 0.46 * np.cos(2 * np.pi * j / 20))
            weights += weight
            total += weight * samples[i, j] * np.exp(2j * k * (np.cos(phi) * down[3] - np.sin(phi) * cross[17]))
    assert image[3 * 21 + 17] == pytest.approx(total / weights, rel=1e-4)


@pytest.mark.parametrize("reformat", ["polar", "exact", "none"])
def test_upsampling_shows_the_same_image_in_more_pixels(image_of, wide, reformat):
    """Zero padding of the DFT: what lies at the coarse pixels stays, and the extent."""
    wide.imaging.update(reformat=reformat)
    points, amplitudes = [[0.2, 0.1, 0], [-0.1, -0.22, 0]], [1, 0.5j]
    coarse = image_of(points, wide, 7, amplitudes=amplitudes)
    wide.imaging["upsample"] = 64
    fine = image_of(points, wide, 7, amplitudes=amplitudes)
    assert fine.values.shape == (64, 64)
    np.testing.assert_allclose(fine.pixel * 64, coarse.pixel * [27, 21])
    np.testing.assert_allclose(coarse.values[13, 10], fine.values[32, 32], atol=1e-5)  # the origin is a pixel of both
    np.testing.assert_allclose(fine.at(coarse.range, coarse.crossrange), coarse.values, atol=1e-5)
    assert np.abs(fine.values).max() >= np.abs(coarse.values).max() - 1e-6


def test_plain_upsampling_is_a_zero_padded_fft(wide):
    wide.imaging.update(reformat="none", upsample=64)
    imager = imager_of(wide.frequency, wide.azimuth, wide.imaging)
    matrix = imager.matrix(*imager.axes())
    samples = np.random.default_rng(0).standard_normal((27, 21, 2)) @ [1, 1j]
    window = np.outer(np.hamming(27), np.hamming(21))
    reference = np.fft.fftshift(np.fft.fft(np.fft.ifft(window * samples, 64, axis=0), 64, axis=1)) * 64 / window.sum()
    np.testing.assert_allclose(np.abs(matrix @ samples.ravel()), np.abs(reference).ravel(), atol=1e-6)


def test_fewer_pixels_than_samples_are_refused(wide):
    with pytest.raises(InputError, match=r"imaging\.upsample.*24 pixels.* 27 samples"):
        imager_of(wide.frequency, wide.azimuth, wide.imaging | {"upsample": 24}).axes()


@pytest.mark.parametrize("elevation", [-45, 30])
@pytest.mark.parametrize("z", [0.0, 0.15])
def test_polar_off_the_horizon(image_of, wide, elevation, z):
    point = np.array([[0.2, 0.24, z]])
    image = image_of(point, wide, 10, elevation)
    place, _ = image.peak()
    assert (np.abs(place - np.ravel(project(point, elevation, image.azimuth))) < 0.5 * image.pixel).all()


@pytest.mark.parametrize("d, c", [(0, 0), (8, 0), (-8, 0), (0, 4), (0, -4), (5, 3), (-7, -2)])
def test_plain_fft_focuses_at_the_true_place(image_of, narrow, d, c):
    turn = np.radians(narrow.azimuth[15])
    image = image_of([[d * np.cos(turn) - c * np.sin(turn), d * np.sin(turn) + c * np.cos(turn), 0]], narrow)
    place, value = image.peak()
    assert (np.abs(place - [-d, c]) < 0.5 * image.pixel).all()
    assert abs(value) == pytest.approx(1, abs=0.1)


def test_signs_of_the_axes(image_of, wide):
    """Radar on +x: the nose (+x) is at negative range; +y (increasing azimuth) at positive crossrange."""
    nose, _ = image_of([[0.3, 0, 0]], wide, 0).peak()
    left, _ = image_of([[0, 0.25, 0]], wide, 0).peak()
    top, _ = image_of([[0, 0, 0.3]], wide, 0, elevation=45).peak()
    assert nose[0] < -0.25 and abs(nose[1]) < 0.02
    assert left[1] > 0.2 and abs(left[0]) < 0.02
    assert top[0] < -0.15  # above the origin is nearer to a radar above the horizon


def test_two_scatterers_keep_their_amplitudes_and_phases(image_of, narrow):
    turn = np.radians(narrow.azimuth[15])
    pixel = C0 / (2 * 31 * (narrow.frequency[1] - narrow.frequency[0]))
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    amplitudes = [0.5, 2j]
    image = image_of([0 * along, 8 * pixel * along], narrow, amplitudes=amplitudes)
    assert image.values[15, 15] == pytest.approx(0.5, abs=0.01)
    assert image.at([-8 * pixel], [0.0])[0, 0] == pytest.approx(2j, abs=0.2)


@pytest.mark.parametrize("reformat", ["polar", "exact", "none"])
@pytest.mark.parametrize("window", sorted(fourier.WINDOWS))
def test_peak_at_the_centre_is_the_amplitude(image_of, wide, reformat, window):
    wide.imaging.update(reformat=reformat, window=window)
    image = image_of([[0, 0, 0]], wide, amplitudes=[0.3 - 0.4j])
    assert image.values[13, 10] == pytest.approx(0.3 - 0.4j, abs=1e-6)
    assert np.abs(image.values).argmax() == 13 * 21 + 10


def test_plain_fft_is_numpys(wide):
    """`none` is a shifted FFT of the windowed samples, up to the carrier's phase and the window's sum."""
    wide.imaging["reformat"] = "none"
    imager = imager_of(wide.frequency, wide.azimuth, wide.imaging)
    matrix = imager.matrix(*imager.axes())
    samples = np.random.default_rng(0).standard_normal((27, 21, 2)) @ [1, 1j]
    window = np.outer(np.hamming(27), np.hamming(21))
    reference = np.fft.fftshift(np.fft.fft(np.fft.ifft(window * samples, axis=0), axis=1)) * 27 / window.sum()
    np.testing.assert_allclose(np.abs(matrix @ samples.ravel()), np.abs(reference).ravel(), atol=1e-6)


def test_polar_grid_is_inscribed_and_interpolates_linear_functions_exactly(wide):
    angle = np.radians(360 / 242) * (np.arange(21) - 10)
    kx, ky = fourier.wavenumber_grid(wide.frequency, angle, "polar")
    k = np.hypot(*np.meshgrid(kx, ky, indexing="ij")).ravel()
    phi = np.arctan2(*np.meshgrid(kx, ky, indexing="ij")[::-1]).ravel()
    sampled = 2 * np.pi * wide.frequency / C0
    assert k.min() >= sampled[0] - 1e-9 and k.max() == pytest.approx(sampled[-1])
    assert np.abs(phi).max() == pytest.approx(angle[-1])
    np.testing.assert_allclose([np.ptp(np.diff(kx)), np.ptp(np.diff(ky))], 0, atol=1e-9)
    weights = fourier.bilinear_weights(wide.frequency, angle, kx, ky)
    samples = (2 + 3 * sampled[:, None] - 5 * angle + 0.7 * sampled[:, None] * angle).ravel()
    np.testing.assert_allclose(weights @ samples, 2 + 3 * k - 5 * phi + 0.7 * k * phi, rtol=1e-10)
    assert weights.min() >= 0


@pytest.mark.parametrize("frequencies, aperture, axis", [(101, 3, 0), (3, 101, 1)])
def test_hamming_sidelobes(image_of, wide, frequencies, aperture, axis):
    wide.frequency = np.linspace(4.05e9, 7.05e9, frequencies)
    wide.azimuth = np.linspace(-15, 15, aperture)
    wide.imaging["aperture"] = aperture
    image = image_of([[0, 0, 0]], wide)
    offset = np.linspace(2.2, 20, 2000) * image.pixel[axis]  # the main lobe ends at two pixels
    cut = image.at(offset, [0.0])[:, 0] if axis == 0 else image.at([0.0], offset)[0]
    assert 20 * np.log10(np.abs(cut).max()) == pytest.approx(-42.4, abs=0.4)


def test_resolution_is_the_distance_to_the_first_null(image_of, narrow):
    """Rayleigh: what a scatterer one resolution away (eqs. 3.4, 3.9) leaves at the origin is zero."""
    narrow.imaging["window"] = "boxcar"
    step, turn = narrow.frequency[1] - narrow.frequency[0], np.radians(0.05)
    centre = np.radians(narrow.azimuth[15])
    along = np.array([np.cos(centre), np.sin(centre), 0])
    across = np.array([-np.sin(centre), np.cos(centre), 0])
    for direction, resolution in ((along, C0 / (2 * 31 * step)), (across, C0 / 10e9 / (2 * 31 * turn))):
        at_origin = [abs(image_of([r * resolution * direction], narrow).values[15, 15]) for r in (0.5, 1.0, 2.0)]
        assert at_origin == pytest.approx([2 / np.pi, 0, 0], abs=0.01)


def test_beyond_the_unambiguous_extent_folds_over(image_of, narrow):
    step, turn = narrow.frequency[1] - narrow.frequency[0], np.radians(0.05)
    extent = np.array([C0 / (2 * step), C0 / 10e9 / (2 * turn)])  # eqs. 3.11, 3.13
    centre = np.radians(narrow.azimuth[15])
    along = np.array([np.cos(centre), np.sin(centre), 0])
    across = np.array([-np.sin(centre), np.cos(centre), 0])
    for axis, direction in ((0, -along), (1, across)):
        for part, seen in ((0.45, 0.45), (0.6, -0.4), (-0.7, 0.3)):
            image = image_of([part * extent[axis] * direction], narrow)
            place, _ = image.peak()
            assert place[axis] == pytest.approx(seen * extent[axis], abs=0.5 * image.pixel[axis])


def test_impossible_geometry_is_refused():
    imaging = {"imager": "fourier", "aperture": 5, "window": "hamming", "reformat": "polar", "upsample": "none"}
    with pytest.raises(InputError, match=r"imaging\.reformat"):
        build_imager(np.array([1e9, 1.01e9]), np.radians([-20, -10, 0, 10, 20]), imaging).axes()
    with pytest.raises(InputError, match=r"imaging\.window"):
        build_imager(np.array([1e9, 2e9]), np.radians([-1, 0, 1]), imaging | {"aperture": 3, "window": "hann"})


def test_apertures_wrap_round_the_circle():
    field = np.arange(20).reshape(2, 10)
    cut = apertures(field, np.arange(10) * 36.0, 3)
    assert cut.shape == (10, 6)
    assert cut[0].tolist() == [9, 0, 1, 19, 10, 11]
    assert cut[9].tolist() == [8, 9, 0, 18, 19, 10]
    part = apertures(field, np.arange(10) * 3.0, 3)
    np.testing.assert_array_equal(part, cut[1:9])


class Made(Formation):
    """Says of every aperture what it is told to."""

    coherent, image = True, None

    def axes(self):
        return np.arange(2.0), np.arange(3.0)

    def at(self, down, cross):
        return lambda samples: self.image


@pytest.fixture
def made():
    return Made(np.array([1e9, 2e9]), np.radians([-1, 0, 1]), {})


def test_zero_field_gives_zero_images(made):
    made.image = np.zeros((4, 2, 3), np.complex64)
    image, peak = form_images(made, np.zeros((4, 6), np.complex64))
    assert not image.any() and not peak.any()


def test_an_imager_without_a_phase_gives_magnitudes(made):
    made.image, samples = np.full((4, 2, 3), 3 + 4j), np.ones((4, 6), np.complex64)
    image, peak = form_images(made, samples)
    np.testing.assert_allclose(image, 0.6 + 0.8j, rtol=1e-6)
    made.coherent = False
    image, _ = form_images(made, samples)
    assert image.dtype == np.complex64 and (image == 1).all() and peak.tolist() == [5] * 4


@pytest.mark.parametrize(("shape", "value"), [((4, 3, 2), 1), ((3, 2, 3), 1), ((4, 2, 3), np.nan)])
def test_images_that_do_not_fit_the_axes_are_refused(made, shape, value):
    made.image = np.full(shape, value)
    with pytest.raises(InputError, match=r"tests/imaging/test_formation\.py.*of shape \(4, 2, 3\)"):
        form_images(made, np.ones((4, 6), np.complex64))
