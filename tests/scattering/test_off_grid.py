"""Measured fields off the sweep's places: kept fields and points sampled elsewhere, and the steps before."""

import numpy as np
import pytest
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.store import open_store, write
from isarflow.core.sweep import C0, unit_vectors
from isarflow.scattering.fields.external import write_external
from isarflow.setup.config import ROOT

RADAR = {"center_frequency": 3e9, "bandwidth": 1.5e9, "frequencies": 16, "polarizations": ["VV", "HH", "HV"]}
ASPECT = {"elevation": [0, 20], "azimuth": {"count": 60}}
FREQUENCY, AZIMUTH = np.linspace(2.25e9, 3.75e9, 16), np.arange(60) * 6.0
STORED = np.linspace(2.2e9, 3.8e9, 25)  # Hz, of the measured stores: unambiguous over 2.25 m
POINTS = [(0.15, 0.05, 0, 1), (-0.1, -0.15, 0.05, 0.7j), (0.02, 0.18, -0.05, -0.5)]  # x, y, z in m, amplitude in m
WAYS = np.array([1, 0.6 - 0.3j, 0.2j])[:, None, None]  # of VV, HH, HV, over VV


def of_points(frequency, elevation, azimuth, points=POINTS):
    """The field (polarization, frequency, pulse) of points at pulses."""
    u, *_ = unit_vectors(elevation, azimuth)
    k = 2 * np.pi / C0 * np.asarray(frequency)[:, None]
    return WAYS * sum(a * np.exp(2j * k * (u @ place)) for *place, a in points)


def pulses(path, frequency, elevation, azimuth, field):
    """Write a store of pulses; returns its path."""
    coordinates = {"polarization": RADAR["polarizations"][: len(field)], "frequency": frequency}
    coordinates |= {"elevation": ("pulse", elevation), "azimuth": ("pulse", azimuth)}
    coordinates |= {"time": ("pulse", np.arange(len(azimuth)) * 1e-3)}
    data = {"field": (("polarization", "frequency", "pulse"), field.astype(np.complex64))}
    xr.Dataset(data, coordinates).to_zarr(path, mode="w", zarr_format=2)
    return path


def shuffled(count=200, seed=0):
    """Elevation and azimuth of pulses around both rings, unevenly and in random order."""
    rng = np.random.default_rng(seed)
    azimuth = (np.arange(count) + rng.uniform(-0.2, 0.2, (2, count))) * 360 / count
    order = rng.permutation(2 * count)
    return np.repeat([0.0, 20.0], count)[order], azimuth.ravel()[order]


def taken(path="given.zarr", radar=RADAR, aspect=ASPECT, symmetry=(), **steps):
    write_external(path, "out.zarr", radar, aspect, symmetry, None, steps)
    return open_store("out.zarr").load()


def decibels(field, expected):
    return 20 * np.log10(np.linalg.norm(field - expected) / np.linalg.norm(expected))


def on_grid(points=POINTS):
    directions = np.meshgrid([0.0, 20.0], AZIMUTH, indexing="ij")
    field = of_points(FREQUENCY, *map(np.ravel, directions), points)
    return field.reshape(3, 16, 2, 60)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def kept():
    """The balloon's kept field at two elevations."""
    with xr.open_zarr(ROOT / "resources/fields/balloon.zarr") as store:
        return store[["field"]].sel(elevation=[-10, 20]).load()


def settings(kept):
    aspect = {"elevation": kept.elevation.values.tolist(), "azimuth": kept.azimuth.values.tolist()}
    return {"frequencies": kept.frequency.values.tolist(), "polarizations": RADAR["polarizations"]}, aspect


def test_a_kept_field_follows_from_half_of_its_frequencies(kept, capsys):
    """Of every second frequency; the others, held out, are 13 of 27."""
    kept.isel(frequency=slice(None, None, 2)).drop_encoding().to_zarr("given.zarr", zarr_format=2)
    store = taken("given.zarr", *settings(kept))
    assert decibels(store.field.values, kept.field.values) < -35  # -44
    (said,) = store.attrs["warnings"]
    assert (
        "interpolated, of an extent of 0.51 m" in said and "of the unambiguous 0.65 m; orders in azimuth up to" in said
    )
    assert said in capsys.readouterr().out
    np.testing.assert_allclose(store.field.values[:, ::2], kept.field.values[:, ::2], atol=2e-4)


def test_a_kept_field_follows_from_pulses_around_it(kept):
    """The pulses' samples are those of the Fourier series over the circle of the kept ones, 242 of its azimuths."""
    elevation, azimuth = shuffled(270)
    elevation = np.where(elevation == 0, -10, 20)
    numbers = np.fft.fftfreq(242, 1 / 242)
    series = np.fft.fft(kept.field.values, axis=-1) / 242
    waves = np.exp(1j * np.outer(numbers, np.radians(azimuth)))
    rings = np.where(elevation == -10, *(np.moveaxis(series @ waves, 2, 0)))
    pulses("given.zarr", kept.frequency.values, elevation, azimuth, rings)
    assert decibels(taken("given.zarr", *settings(kept)).field.values, kept.field.values) < -100  # -143


def test_points_follow_from_pulses_of_other_frequencies_and_azimuths():
    directions = shuffled()
    pulses("given.zarr", STORED, *directions, of_points(STORED, *directions))
    assert decibels(taken().field.values, on_grid()) < -60  # -81
    uneven = STORED + np.random.default_rng(1).uniform(-5e5, 5e5, 25)
    pulses("given.zarr", uneven[::-1], *directions, of_points(uneven[::-1], *directions))
    assert decibels(taken().field.values, on_grid()) < -35


def test_an_arc_and_half_of_a_symmetric_circle_are_enough():
    azimuth = np.arange(-62, 63, 2.6)
    elevation = np.repeat([0.0, 20.0], len(azimuth))
    directions = elevation, np.tile(azimuth, 2)
    pulses("given.zarr", FREQUENCY, *directions, of_points(FREQUENCY, *directions))
    arc = ASPECT | {"azimuth": {"start": -60, "stop": 60, "step": 6}}
    expected = np.roll(on_grid(), 10, axis=-1)[..., :21]
    assert decibels(taken(aspect=arc).field.values, expected) < -45  # -53
    with pytest.raises(InputError, match=r"list of pulses .* azimuths .* degrees apart are needed, not [\d.]+\.$"):
        taken()
    twins = [(0.15, 0, 0.05, 1), (-0.05, 0.15, 0, 1), (-0.05, -0.15, 0, 1)]
    half = np.repeat([0.0, 20.0], 72), np.tile(1.25 + np.arange(72) * 2.5, 2)
    co = {"polarizations": ["VV", "HH"]}
    pulses("given.zarr", FREQUENCY, *half, of_points(FREQUENCY, *half, twins)[:2])
    assert decibels(taken("given.zarr", RADAR | co, symmetry=["xz"]).field.values, on_grid(twins)[:2]) < -100  # -149


def test_a_store_on_the_grid_keeps_its_bits():
    axes = dict(polarization=RADAR["polarizations"], frequency=FREQUENCY, elevation=[0.0, 20.0], azimuth=AZIMUTH)
    field = on_grid().astype(np.complex64)
    xr.Dataset({"field": ([*axes], field)}, axes).to_zarr("given.zarr", zarr_format=2)
    store = taken()
    np.testing.assert_array_equal(store.field.values, field)
    assert "warnings" not in store.attrs
    elevation, azimuth = map(np.ravel, np.meshgrid([0.0, 20.0], AZIMUTH, indexing="ij"))
    order = np.random.default_rng(2).permutation(120)
    pulses("given.zarr", FREQUENCY, elevation[order], azimuth[order], field.reshape(3, 16, -1)[..., order])
    np.testing.assert_array_equal(taken().field.values, field)


REFUSED = {
    "steps of frequency": (
        lambda f, e, a: (f[::4], e, a),
        r"the extent must be below 0\.8 of the unambiguous: it is 0\.\d+ m in range, .* of the unambiguous 0\.562 m",
    ),
    "band": (
        lambda f, e, a: (f[1:], e, a),
        r"no frequency 2250000000,.* there is 2266666667|no frequency 2\.25e\+09, ",
    ),
    "steps of azimuth": (
        lambda f, e, a: (f, e[::3], a[::3]),
        r"To interpolate, azimuths [\d.]+ degrees apart are needed, not ",
    ),
    "elevation": (lambda f, e, a: (f, e + 1, a), r"no elevation 0, 20 degrees, .* there is 1, 21 degrees"),
    "one frequency": (lambda f, e, a: (f[:1], e, a), r"no frequency"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_interpolated_is_refused_with_the_figure(case):
    change, said = REFUSED[case]
    places = change(STORED, *shuffled())
    pulses("given.zarr", *places, of_points(*places))
    with pytest.raises(InputError, match=rf"^given\.zarr: .*{said}"):
        taken()


def test_a_reference_undoes_gain_and_delay():
    """Of the receiver's VV and HH; HV's factor is their geometric mean, of a phase that turns many times."""
    delay = np.exp(-2j * np.pi * STORED * 23e-9)[:, None]  # 37 turns over the band
    gains = np.stack([2 * delay, 0.5j * delay * np.exp(2j * np.pi * STORED * 0.4e-9)[:, None]])
    third = np.exp(0.5j * np.angle(gains[1] / gains[0])[:1] + 1j * np.pi * (STORED - STORED[0])[:, None] * 0.4e-9)
    gains = np.concatenate([gains, (gains[0] * 0.5 * third)[None]])
    directions, few = shuffled(), (np.array([0.0, 0.0, 20.0]), np.array([10.0, 40.0, 10.0]))
    sphere = [(0, 0, 0.02, 0.3)]
    pulses("given.zarr", STORED, *directions, of_points(STORED, *directions) / gains)
    pulses("measured.zarr", STORED, *few, of_points(STORED, *few, sphere) / gains)
    pulses("computed.zarr", STORED, *(one[:2] for one in few), of_points(STORED, *(one[:2] for one in few), sphere))
    pair = {"measured": "measured.zarr", "computed": "computed.zarr"}
    store = taken(calibrate=pair)
    assert decibels(store.field.values, on_grid()) < -60  # -81
    assert any("calibrate" in sentence for sentence in store.attrs["warnings"])
    pulses("computed.zarr", STORED, few[0] + 5, few[1], of_points(STORED, few[0] + 5, few[1], sphere))
    with pytest.raises(
        InputError, match=r"^measured\.zarr: it has not all frequencies of given\.zarr, and a direction"
    ):
        taken(calibrate=pair)


def test_background_is_subtracted_and_a_gate_takes_out_what_is_beyond():
    directions = shuffled()
    room = of_points(STORED, *(0 * angle for angle in directions), [(0.9, 0, 0, 5), (-0.95, 0, 0, 3)])
    room = room * np.ones(len(directions[0]))
    field = of_points(STORED, *directions)
    pulses("given.zarr", STORED, *directions, field + room)
    pulses("empty.zarr", STORED, *directions, room)
    assert decibels(taken(background="empty.zarr").field.values, on_grid()) < -60  # -81
    with pytest.raises(InputError, match=r"extent must be below"):
        taken()
    assert decibels(taken(gate=[-0.6, 0.6]).field.values, on_grid()) < -40  # -49
    pulses("empty.zarr", STORED, directions[0], directions[1] + 1, room)
    with pytest.raises(InputError, match=r"^empty\.zarr: its azimuth is not that of given\.zarr"):
        taken(background="empty.zarr")


def test_each_pose_is_interpolated_as_a_store_of_its_own():
    directions, fields = shuffled(), []
    for points in (POINTS, POINTS[:2]):
        pulses("given.zarr", STORED, *directions, of_points(STORED, *directions, points))
        fields.append(taken().field.values)
    with xr.open_zarr("given.zarr") as store:
        one = store.load()
    whole = np.stack([of_points(STORED, *directions, points) for points in (POINTS, POINTS[:2])])
    both = one.drop_encoding().assign(field=(("pose", *one.field.dims), whole.astype(np.complex64)))
    write(both.assign_coords(pose=[0, 1]), "poses.zarr", {})
    store = taken("poses.zarr")
    assert store.field.dims[0] == "pose" and decibels(store.field.values[1], on_grid(POINTS[:2])) < -60
    np.testing.assert_allclose(store.field.values, fields, atol=1e-3)  # the second within the extent of the first
