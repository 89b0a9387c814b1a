"""Focus methods against point scatterers whose range errors are known, and the seam that they are plugged into."""

import numpy as np
import pytest
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.imaging import focusing, formation
from isarflow.imaging.scatterers import Scatterers, waves
from isarflow.imaging.store import make_clean, make_noisy

# Frequencies (Hz) and azimuths (rad) of an image of the full-size sweep and of the default one.
SWEEPS = {
    "full": (np.linspace(4.05e9, 7.05e9, 27), np.radians(360 / 242) * np.arange(-10, 11)),
    "small": (np.linspace(2.025e9, 3.525e9, 14), np.radians(360 / 121) * np.arange(-5, 6)),
}
PULSE = {"method": "entropy", "error": "pulse"}
FINE = {"imager": "fourier", "window": "hamming", "reformat": "exact", "upsample": 64}
IMAGES = 20


class Scene:
    """Samples of `count` point scatterers an image, in two channels, within the middle 60 % of the extent.

    Amplitudes are 0.5 to 1 with random phases; every image is displaced by up to two cells.
    """

    def __init__(self, size, count, seed=0):
        self.frequency, self.angle = SWEEPS[size]
        self.k, self.time = 2 * np.pi * self.frequency / C0, self.angle / self.angle[-1]
        self.wavelength, self.random = 2 * np.pi / self.k.mean(), np.random.default_rng(seed)
        self.cells = Scatterers(self.frequency, self.angle, {"pixels": 1})
        reach = 0.3 * np.array([len(self.frequency), len(self.angle)])
        places = self.random.uniform(-reach, reach, (IMAGES, count, 2)) + self.random.uniform(-2, 2, (IMAGES, 1, 2))
        self.samples = np.stack([self.echo(of) for of in places]).astype(np.complex64)

    def echo(self, places):
        """Samples (channels, F, A) of scatterers at places in cells."""
        amplitudes = self.random.uniform(0.5, 1, (2, len(places)))
        amplitudes = amplitudes * np.exp(2j * np.pi * self.random.random(amplitudes.shape))
        shapes = waves(self.cells.wavevectors, places * self.cells.cell)
        return (shapes @ amplitudes.T).T.reshape(2, len(self.frequency), len(self.angle))

    def drift(self, most):
        """Errors quadratic in time, up to so many wavelengths at the ends of the aperture."""
        return np.outer(self.random.uniform(-most, most, IMAGES) * self.wavelength, self.time**2)

    def jitter(self, rms):
        return self.random.normal(0, rms * self.wavelength, (IMAGES, len(self.angle)))

    def moved(self, errors):
        return (self.samples * np.exp(2j * self.k[:, None] * errors[:, None, None])).astype(np.complex64)

    def noisy(self, samples, snr_db):
        """Samples with the same noise in each call."""
        random = np.random.default_rng(1)
        power = (np.abs(samples) ** 2).mean(axis=(1, 2, 3), keepdims=True) / 10 ** (snr_db / 10)
        noise = random.normal(size=samples.shape) + 1j * random.normal(size=samples.shape)
        return (samples + np.sqrt(power / 2) * noise).astype(np.complex64)

    def focused(self, focus, samples, present=None):
        return focusing.build_focusing(self.frequency, self.angle, {"focus": focus}).focus(samples, present)

    def judged(self, samples):
        """The peak in dB and the entropy of each image, all channels together, on a fine grid."""
        imager = formation.build_imager(self.frequency, self.angle, FINE)
        power = np.abs(imager.on_axes(samples.reshape(-1, len(self.frequency), len(self.angle)))) ** 2
        power = power.reshape(IMAGES, -1)
        share = power / power.sum(axis=1, keepdims=True)
        return 10 * np.log10(power.max(axis=1)), -(share * np.log(share + 1e-30)).sum(axis=1)

    def sharp(self, samples, truth):
        """Whether each image has the peak of the true one to 0.5 dB, and its entropy to 5 %."""
        (peak, entropy), (true_peak, true_entropy) = self.judged(samples), self.judged(truth)
        return (np.abs(peak - true_peak) <= 0.5) & (np.abs(entropy / true_entropy - 1) <= 0.05)


# Of each the images that are sharp before it: at most 6 of the 20.
CASES = [
    ("full", "entropy", 1.0, 0, 15),
    ("full", "entropy", 1.0, 0, 25),
    ("small", "entropy", 1.0, 0, 15),
    ("full", PULSE, 0, 1 / 30, 15),
    ("full", PULSE, 0, 1 / 10, 15),
    ("full", PULSE, 1.0, 1 / 30, 15),
    ("full", PULSE, 1.0, 1 / 30, 25),
    ("small", PULSE, 1.0, 1 / 30, 15),
    ("full", "phase_gradient", 0, 1 / 30, 15),
    ("full", "phase_gradient", 0.5, 0, 15),
]


@pytest.mark.parametrize(("size", "focus", "drift", "jitter", "snr_db"), CASES)
def test_known_errors_are_undone(size, focus, drift, jitter, snr_db):
    scene = Scene(size, 4)
    moved = scene.noisy(scene.moved(scene.drift(drift) + scene.jitter(jitter)), snr_db)
    truth = scene.noisy(scene.samples, snr_db)
    assert scene.sharp(moved, truth).sum() <= 6
    assert scene.sharp(scene.focused(focus, moved), truth).all()


def test_a_drift_of_many_cells_is_undone_after_alignment():
    scene = Scene("full", 1)
    errors = np.outer(np.linspace(-5, 5, IMAGES) * scene.cells.cell[0], scene.time**2)
    moved, truth = (scene.noisy(samples, 15) for samples in (scene.moved(errors), scene.samples))
    for focus in ("entropy", PULSE):
        assert scene.sharp(scene.focused(focus, moved), truth).all()


@pytest.mark.parametrize("size", SWEEPS)
def test_range_profiles_are_aligned_to_a_tenth_of_a_cell(size):
    scene = Scene(size, 1)
    errors = scene.random.uniform(-2, 2, (IMAGES, len(scene.angle))) * scene.cells.cell[0]
    method = focusing.build_focusing(scene.frequency, scene.angle, {"focus": "entropy"})
    present = np.ones(errors.shape, bool)
    rest = (method.aligned(scene.noisy(scene.moved(errors), 15), present) - errors) / scene.cells.cell[0]
    # Profiles are aligned with each other: a constant is open, and what is a displacement.
    alike, _ = np.linalg.qr(np.stack([np.ones_like(scene.angle), np.cos(scene.angle), np.sin(scene.angle)], axis=1))
    rest -= rest @ alike @ alike.T
    assert np.abs(rest).max() < 0.1  # 0.026 and 0.031 cells


@pytest.mark.parametrize("focus", ["entropy", PULSE, "phase_gradient"])
def test_an_image_that_did_not_move_stays_in_its_place(focus):
    scene = Scene("full", 4)
    scene.samples[:, 1] *= 0.1  # a weak channel
    focused = scene.focused(focus, scene.noisy(scene.samples, 30))
    alike = np.abs((focused.conj() * scene.samples).sum(axis=(1, 2, 3)))
    alike /= np.sqrt((np.abs(focused) ** 2).sum(axis=(1, 2, 3)) * (np.abs(scene.samples) ** 2).sum(axis=(1, 2, 3)))
    assert alike.min() > 0.99  # 0.9982, 0.9929, 0.9924; an error of a pulse that was not there takes its share


@pytest.mark.parametrize("focus", ["entropy", PULSE, "phase_gradient"])
def test_all_channels_are_turned_alike_and_lost_pulses_stay_so(focus):
    scene = Scene("full", 4)
    present = scene.random.random((IMAGES, len(scene.angle))) > 0.2
    there = present[:, None, None]
    moved = scene.noisy(scene.moved(scene.drift(0.5) + scene.jitter(1 / 30)), 15) * there
    focused = scene.focused(focus, moved, present)
    assert focused.dtype == np.complex64 and focused.shape == moved.shape
    assert not focused[~np.broadcast_to(there, focused.shape)].any()
    turned = np.divide(focused, moved, out=np.ones_like(moved), where=there)
    np.testing.assert_allclose(np.abs(turned), 1, atol=1e-5)
    np.testing.assert_allclose(turned[:, 0], turned[:, 1], atol=1e-4)
    truth = scene.noisy(scene.samples, 15) * there
    least = {"entropy": 0, "phase_gradient": 20}.get(str(focus), 19)  # 6, 20, 19; a drift leaves the jitter
    assert scene.sharp(focused, truth).sum() >= least and not scene.sharp(moved, truth).any()


def test_zeros_stay_zeros():
    """A symmetric target has none of the cross-polarized echoes."""
    scene = Scene("small", 1)
    scene.samples[:] = 0
    for focus in ("none", "entropy", PULSE, "phase_gradient"):
        assert not scene.focused(focus, scene.samples).any()


def test_without_focus_the_samples_are_not_touched():
    scene = Scene("small", 1)
    assert scene.focused("none", scene.samples) is scene.samples


def noisy(store, **imaging):
    make_noisy(store.path, [store.folder / "snr_6dB.zarr"], store.imaging | imaging, "drone", store.noise)
    return xr.open_zarr(store.folder / "snr_6dB.zarr").load()


def test_images_with_noise_are_focused_and_others_are_not(store):
    default, none, focused = noisy(store), noisy(store, focus="none"), noisy(store, focus="entropy")
    assert default.identical(none) and "focus" not in default.attrs
    assert focused.attrs["focus"] == "entropy" and (focused.image != default.image).any()
    assert noisy(store, focus=PULSE).attrs["focus"] == PULSE
    clean = []
    for imaging in (store.imaging, store.imaging | {"focus": "entropy"}):
        make_clean(store.path, store.folder / "clean.zarr", imaging)
        clean.append(xr.open_zarr(store.folder / "clean.zarr").load())
    assert clean[0].identical(clean[1])


def test_a_method_of_ones_own_is_a_file(store):
    """It gets the samples of each elevation's images, and its settings, those with a default filled in."""
    text = """from isarflow.imaging.focusing import Focusing
class Focus(Focusing):
    SETTINGS = {"factor": {"type": "number"}, "turn": {"type": "number", "default": 0.5}}
    def focus(self, samples, present=None):
        assert samples.shape == (60, 1, 8, 5) and present is None
        return self.settings["factor"] * self.settings["turn"] * samples
"""
    path = store.folder / "mine.py"
    path.write_text(text)
    own, default = noisy(store, focus={"method": str(path), "factor": 4}), noisy(store)
    np.testing.assert_allclose(own.peak, 2 * default.peak, rtol=1e-6)
    path = store.folder / "wrong.py"
    path.write_text("class Focus:\n    def focus(self, samples, present=None): pass\n")
    with pytest.raises(InputError, match=r"its class Focus must be one of isarflow\.imaging\.focusing\.Focusing"):
        noisy(store, focus=str(path))
