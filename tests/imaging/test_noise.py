"""The noise is as strong as asked for, white, circular, and follows from names and values alone."""

import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.core.sweep import snr_label, snr_of_label
from isarflow.imaging.noise import definition_offset, generator, signal_power, variances, white_noise


@pytest.fixture
def samples():
    """1,000 apertures of 77 samples whose strength differs from one to the next and within each."""
    random = np.random.default_rng(5)
    values = random.standard_normal((1000, 77, 2)) @ [1, 1j]
    return (values * 10 ** random.uniform(-3, 1, (1000, 1))).astype(np.complex64)


def noise_for(samples, snr_db, definition, per="image"):
    """Noise for apertures (images, S), drawn as that of the drone."""
    variance = variances(signal_power(samples, definition), snr_db, per)
    return white_noise(variance, samples.shape[1], generator(0, "drone", snr_db, 0))


@pytest.mark.parametrize("definition", ["peak_3db", "mean"])
@pytest.mark.parametrize("snr_db", [-24, 0, 7.5])
def test_measured_snr(samples, definition, snr_db):
    noise = noise_for(samples, snr_db, definition)
    ratios = []
    for signal, added in zip(samples.astype(complex), noise, strict=True):
        power = np.abs(signal) ** 2
        if definition == "peak_3db":
            power = power[power >= power.max() / 2]
        ratios.append(np.mean(np.abs(added) ** 2) / power.mean())
    assert -10 * np.log10(np.mean(ratios)) == pytest.approx(snr_db, abs=0.1)


def test_noise_is_circular_and_white(samples):
    noise = noise_for(samples, 0, "mean").astype(complex)
    noise /= np.sqrt(signal_power(samples, "mean"))[:, None]
    spread = 5 / np.sqrt(len(noise))  # five standard deviations of an average over the apertures
    covariance = noise.T @ noise.conj() / len(noise)
    np.testing.assert_allclose(covariance, np.eye(77), atol=spread)
    np.testing.assert_allclose(noise.T @ noise / len(noise), 0, atol=1.5 * spread)
    assert abs(noise.mean()) < 5 / np.sqrt(noise.size)
    neighbours = np.mean(noise[1:] * noise[:-1].conj())
    assert abs(neighbours) < 5 / np.sqrt(noise.size)
    assert np.mean(np.abs(noise) ** 4) == pytest.approx(2, abs=0.05)  # Gaussian


def test_streams_are_independent():
    names = [(0, "drone", 6, 0), (1, "drone", 6, 0), (0, "ufo", 6, 0), (0, "drone", 9, 0), (0, "drone", 6, 1)]
    draws = np.array([generator(*name).standard_normal(20_000) for name in names])
    np.testing.assert_allclose(np.corrcoef(draws), np.eye(len(names)), atol=5 / np.sqrt(20_000))


def test_stream_follows_from_the_value_not_its_type():
    first, second = generator(0, "drone", -6, 0), generator(0, "drone", -6.0, 0)
    assert first.integers(2**60) == second.integers(2**60)


def test_definition_offset():
    signal = np.array([[1, 1, 0.1, 0.1], [1, 1, 1, 1], [0, 0, 0, 0]], np.complex64)
    assert definition_offset(signal)[:2] == pytest.approx([10 * np.log10(1 / 0.505), 0], abs=1e-5)
    assert np.isnan(definition_offset(signal)[2])
    assert not noise_for(signal, 0, "mean")[2].any()


def test_the_noise_of_a_sweep_is_as_strong_in_all_its_images(samples):
    variance = variances(signal_power(samples, "mean"), 6, "sweep")
    assert np.ptp(variance) == 0
    assert 10 * np.log10(signal_power(samples, "mean").mean() / variance[0]) == pytest.approx(6)


def test_labels():
    for snr in (-24, 0, 2.5, 100):
        assert snr_of_label(snr_label(snr)) == snr
    with pytest.raises(InputError, match="snr_1-2dB"):
        snr_of_label("snr_1-2dB")
