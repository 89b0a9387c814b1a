"""Analytic fields of point scatterers, and stores of them."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from isarflow.core.store import write
from isarflow.core.sweep import C0

FOURIER = {"imager": "fourier", "polarizations": ["VV"], "window": "hamming", "upsample": "none"}


def point_field(points, amplitudes, frequency, elevation, azimuth):
    """f = sum of a exp(2jk u.p) over scatterers at points (P, 3): shape (frequency, elevation, azimuth)."""
    el, az = np.meshgrid(np.radians(elevation), np.radians(azimuth), indexing="ij")
    direction = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)
    nearer = np.einsum("eax,px->pea", direction, np.asarray(points, float))
    k = 2 * np.pi * np.asarray(frequency) / C0
    return np.einsum("p,pfea->fea", amplitudes, np.exp(2j * k[:, None, None] * nearer[:, None]))


def write_field(path, field, frequency, elevation, azimuth):
    """A scattering store with VV as given and, to be left alone, HH of ones."""
    field = np.stack([field, np.ones_like(field)]).astype(np.complex64)
    axes = {"frequency": (frequency, "Hz"), "elevation": (elevation, "degrees"), "azimuth": (azimuth, "degrees")}
    dataset = xr.Dataset(
        {"field": (("polarization", *axes), field, {"units": "m", "long_name": "scattering amplitude"})},
        {name: (name, values, {"units": units, "long_name": name}) for name, (values, units) in axes.items()}
        | {"polarization": ("polarization", ["VV", "HH"])},
    )
    write(dataset, path)
    return path


@pytest.fixture
def wide():
    """The thesis's sweep: 54 % bandwidth, 21 of 242 azimuths (31 degrees)."""
    return SimpleNamespace(
        frequency=np.linspace(4.05e9, 7.05e9, 27),
        azimuth=np.arange(242) * 360 / 242,
        imaging=FOURIER | {"aperture": 21, "reformat": "polar"},
    )


@pytest.fixture
def narrow():
    """A sweep for which the plain FFT holds: 1.5 % bandwidth, 1.5 degrees."""
    return SimpleNamespace(
        frequency=np.linspace(9.925e9, 10.075e9, 31),
        azimuth=100 + 0.05 * np.arange(31),
        imaging=FOURIER | {"aperture": 31, "reformat": "none"},
    )


@pytest.fixture
def store(tmp_path):
    """A field of a few random scatterers over a small circle of azimuths and three elevations, as a store."""
    random = np.random.default_rng(1)
    sweep = SimpleNamespace(
        frequency=np.linspace(2e9, 3.5e9, 8),
        elevation=np.array([-30.0, 0.0, 30.0]),
        azimuth=np.arange(60) * 6.0,
        imaging=FOURIER | {"aperture": 5, "reformat": "polar"},
        noise={"seed": 3, "realizations": 2, "definition": "peak_3db", "per": "image"},
        folder=tmp_path,
        write=write_field,
    )
    points, amplitudes = random.uniform(-0.25, 0.25, (6, 3)), random.uniform(0.2, 1, 6)
    sweep.field = point_field(points, amplitudes, sweep.frequency, sweep.elevation, sweep.azimuth)
    sweep.path = write_field(tmp_path / "field.zarr", sweep.field, sweep.frequency, sweep.elevation, sweep.azimuth)
    return sweep


@pytest.fixture
def points_field():
    """The function `point_field`."""
    return point_field


@pytest.fixture
def image_of():
    """A function that images point scatterers: (points, sweep, azimuth index, ...) -> one image that can be refined."""
    return _image_of


def _image_of(points, sweep, centre=None, elevation=0.0, amplitudes=None):
    from isarflow.imaging import formation, geometry

    amplitudes = np.ones(len(points)) if amplitudes is None else amplitudes
    field = point_field(points, amplitudes, sweep.frequency, [elevation], sweep.azimuth)[:, 0]
    count = sweep.imaging["aperture"]
    imager = geometry.imager_of(sweep.frequency, sweep.azimuth, sweep.imaging)
    centres = geometry.centres(sweep.azimuth, count)
    index = len(centres) // 2 if centre is None else centre
    samples = formation.apertures(field, sweep.azimuth, count)[index : index + 1]
    image, peak = formation.form_images(imager, samples)
    return Image(image[0] * peak[0], imager, centres[index], samples[0])


class Image:
    """One image, not normalised, with its axes; `at` evaluates it between its pixels too."""

    def __init__(self, values, imager, azimuth, samples):
        self.values, self.imager, self.azimuth = values, imager, azimuth
        self.samples = samples.reshape(1, len(imager.frequency), -1)
        self.range, self.crossrange = imager.axes()
        self.pixel = np.array([axis[1] - axis[0] for axis in imager.axes()])

    def at(self, down, cross):
        """Image at ranges (R,) x crossranges (C,): shape (R, C)."""
        return self.imager.at(np.asarray(down), np.asarray(cross))(self.samples)[0]

    def peak(self):
        """Position (range, crossrange) in m of the strongest point, to a sixteenth of a pixel, and its value."""
        row, column = np.unravel_index(np.abs(self.values).argmax(), self.values.shape)
        near = np.arange(-16, 17) / 16
        down = self.range[row] + near * self.pixel[0]
        cross = self.crossrange[column] + near * self.pixel[1]
        fine = self.at(down, cross)
        row, column = np.unravel_index(np.abs(fine).argmax(), fine.shape)
        return np.array([down[row], cross[column]]), fine[row, column]
