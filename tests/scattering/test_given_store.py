"""Stores of other programs: chunks that are not there, places that are given twice, and forms that programs write."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import zarr

from isarflow.core.errors import InputError
from isarflow.core.store import SUMS, open_store, write
from isarflow.scattering.fields.external import write_external
from isarflow.scattering.fields.given_store import check_polarizations
from isarflow.scattering.fields.store import COORDINATES

RADAR = {"frequencies": [1.0e9, 1.1e9, 1.2e9], "polarizations": ["VV", "HV"]}
ASPECT = {"elevation": [0, 10], "azimuth": {"count": 4}}
AXES = {"polarization": ["HV", "VV"], "frequency": [1e9, 1.1e9, 1.2e9, 2e9], "elevation": [0.0, 10.0]}
AXES |= {"azimuth": [0.0, 90.0, 180.0, 270.0]}
FIELD = np.exp(1j * np.arange(64)).reshape(2, 4, 2, 4).astype(np.complex64)
WANTED = FIELD[::-1, :3]
FORMS = {  # what `to_zarr` takes, and the encoding of the field
    "2": ({"zarr_format": 2}, {}),
    "3": ({"zarr_format": 3}, {}),
    "shards": ({"zarr_format": 3}, {"shards": (2, 4, 2, 4)}),
}


def data(field=FIELD, **axes):
    return xr.Dataset({"field": ([*AXES], field)}, AXES | axes)


@pytest.fixture
def taken(tmp_path, monkeypatch):
    """Takes the field of given.zarr, which it writes if it is given a dataset, as a store, loaded."""
    monkeypatch.chdir(tmp_path)

    def take(dataset=None, radar=RADAR, aspect=ASPECT):
        if dataset is not None:
            dataset.to_zarr("given.zarr", mode="w", zarr_format=2)
        write_external("given.zarr", "out.zarr", radar, aspect)
        return open_store("out.zarr").load()

    return take


def store(form, chunks, field=FIELD, **axes):
    """Write given.zarr in a form and return its folder."""
    how, encoding = FORMS[form]
    data(field, **axes).to_zarr("given.zarr", mode="w", encoding={"field": {"chunks": chunks} | encoding}, **how)
    return Path("given.zarr")


LOST = {  # form, chunks, file that is lost, what is said of it
    "polarization": (
        "2",
        (1, 4, 2, 4),
        "field/1.0.0.0",
        "with VV at frequency 1e.09, .* in all 24 of the sweep's 24 co-",
    ),
    "frequency": (
        "3",
        (2, 1, 2, 4),
        "field/c/0/1/0/0",
        "with VV at frequency 1.1e.09 Hz, elevation 0, 10 degrees, .* 8 of",
    ),
    "elevation": (
        "2",
        (2, 4, 1, 4),
        "field/0.0.1.0",
        "elevation 10 degrees, azimuth 0, 90, 180, 270 degrees; in all 12",
    ),
    "azimuth": ("3", (2, 4, 2, 2), "field/c/0/0/0/1", "azimuth 180, 270 degrees; in all 12 of"),
    "a shard": (
        "shards",
        (1, 1, 1, 4),
        "field/c/0/0/0/0",
        "with VV at frequency 1e.09 Hz, elevation 0 degrees, .* 24 of",
    ),
}


@pytest.mark.parametrize("case", LOST)
def test_lost_copolarized_samples_are_refused_with_their_place(taken, case):
    form, chunks, lost, said = LOST[case]
    folder = store(form, chunks)
    np.testing.assert_array_equal(taken().field, WANTED)
    (folder / lost).unlink()
    with pytest.raises(InputError, match=rf"^given\.zarr: a chunk of {lost} is absent, .*{said}"):
        taken()


@pytest.mark.parametrize("form", FORMS)
def test_absent_cross_polarized_samples_are_warned_of_and_zero(taken, form, capsys):
    field = FIELD.copy()
    field[0] = 0  # zarr leaves these chunks out
    store(form, (1, 4, 1, 4), field)
    got = taken()
    np.testing.assert_array_equal(got.field, field[::-1, :3])
    (said,) = got.attrs["warnings"]
    assert "is absent, with HV at" in said and "in all 24 of the sweep's 24 cross-polarized samples" in said
    assert f"Warning: {said}" in capsys.readouterr().out
    field[1, 1, 0] = 0  # and this, of VV
    store(form, (1, 1, 1, 4), field)
    with pytest.raises(InputError, match=r"with VV at frequency 1.1e\+09 Hz, elevation 0 degrees"):
        taken()


def test_zeros_that_zarr_itself_wrote_are_zeros(taken):
    """Its format 2 has 0 for what was never written: no angle and no field is missing for that. Folders are nested."""
    group = zarr.open_group("given.zarr", mode="w", zarr_format=2)
    for name, values in {"field": FIELD * [[[[0]]], [[[1]]]], **AXES}.items():
        values, dims = np.asarray(values), [*AXES] if name == "field" else [name]
        given = {"chunk_key_encoding": {"name": "v2", "separator": "/"}, "attributes": {"_ARRAY_DIMENSIONS": dims}}
        given["chunks"] = (1, 4, 2, 4) if name == "field" else values.shape
        group.create_array(name, shape=values.shape, dtype=values.dtype, **given)[...] = values
    got = taken()
    np.testing.assert_array_equal(got.field, WANTED * [[[[1]]], [[[0]]]])
    assert "a chunk of field/0/0/0/0 is absent, with HV at" in got.attrs["warnings"][0]


def test_a_store_with_a_list_of_its_files_is_taken_at_its_word(taken):
    store("2", (1, 4, 2, 4), FIELD * [[[[0]]], [[[1]]]])
    assert "warnings" in taken().attrs
    names = sorted(path for path in Path("given.zarr").rglob("*") if path.is_file())
    sums = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to('given.zarr')}\n" for path in names]
    Path("given.zarr", SUMS).write_text("".join(sums))
    assert "warnings" not in taken().attrs


@pytest.mark.parametrize("form", ["2", "3"])
def test_a_lost_chunk_that_the_sweep_does_not_ask_for_is_said(taken, form, capsys):
    (store(form, (2, 1, 2, 4)) / {"2": "field/0.3.0.0", "3": "field/c/0/3/0/0"}[form]).unlink()
    got = taken()
    np.testing.assert_array_equal(got.field, WANTED)
    assert "warnings" not in got.attrs
    assert "1 chunk(s) of the field are absent, none with samples of this sweep" in capsys.readouterr().out


@pytest.mark.parametrize("name", AXES)
@pytest.mark.parametrize("form", ["2", "3"])
def test_a_lost_coordinate_is_refused(taken, form, name):
    folder = store(form, FIELD.shape, elevation=[0, 10])
    (folder / name / {"2": "0", "3": "c/0"}[form]).unlink()
    for read in (taken, lambda: check_polarizations("given.zarr", ["VV"])):  # the latter before any work is done
        with pytest.raises(InputError, match=rf"^given\.zarr: 1 chunk\(s\) of the coordinate '{name}' are absent"):
            read()


def test_one_place_of_zero_may_be_without_a_chunk(taken):
    """Zarr leaves out the chunk of the whole number 0, too."""
    data(FIELD[:, :, :1], elevation=[0]).to_zarr("given.zarr", zarr_format=3)
    assert not Path("given.zarr/elevation/c").exists()
    got = taken(aspect=ASPECT | {"elevation": [0]})
    np.testing.assert_array_equal(got.field, WANTED[:, :, :1])
    assert got.attrs["warnings"][0].startswith("given.zarr: the chunk of its one elevation is absent")


def test_our_stores_have_all_chunks(tmp_path):
    field = FIELD.copy()
    field[0] = 0
    write(data(field, elevation=[0, 0]), tmp_path / "a.zarr", {"field": {"chunks": (1, 1, 1, 4)}})
    arrays = dict(zarr.open_group(tmp_path / "a.zarr", mode="r").arrays())
    assert {name: array.nchunks_initialized for name, array in arrays.items()} == {
        name: array.nchunks for name, array in arrays.items()
    }
    np.testing.assert_array_equal(open_store(tmp_path / "a.zarr").field, field)


CIRCLES = {"0 and 360": [0.0, 90.0, 180.0, 270.0, 360.0], "-180 and 180": [180.0, -90.0, -180.0, 90.0, 0.0]}


@pytest.mark.parametrize("circle", CIRCLES)
def test_both_ends_of_a_circle_are_one_if_they_agree(taken, circle):
    azimuth = np.array(CIRCLES[circle])
    order = (azimuth % 360 / 90).astype(int)
    np.testing.assert_array_equal(taken(data(FIELD[..., order], azimuth=azimuth)).field, WANTED)
    aspect = ASPECT | {"azimuth": [0, 90, 360]}  # the sweep may have both, too
    np.testing.assert_array_equal(taken(None, aspect=aspect).field, WANTED[..., [0, 1, 0]])
    field = FIELD[..., order]
    last = max(np.flatnonzero(azimuth % 180 == 0), key=lambda place: abs(azimuth[place]))
    field[1, 0, 0, last] *= 1.001
    both = {"0 and 360": "azimuth 0, 360", "-180 and 180": "azimuth 180, -180"}[circle]
    with pytest.raises(InputError, match=rf"^given\.zarr: {both} degrees are one place, .* differ by 0\.0\d+ %"):
        taken(data(field, azimuth=azimuth))


@pytest.mark.parametrize("name", ["polarization", "frequency", "elevation"])
def test_other_places_may_be_given_twice_if_they_agree(taken, name):
    twice = xr.concat([data(), data().isel({name: [1]})], name)
    np.testing.assert_array_equal(taken(twice).field, WANTED)
    twice["field"] = (
        twice.field
        * np.where(np.arange(twice.sizes[name]) < data().sizes[name], 1, 2)[
            tuple(slice(None) if axis == name else None for axis in AXES)
        ]
    )
    with pytest.raises(
        InputError, match=rf"^given\.zarr: {name} .* are one place, and the fields there differ by 100 %"
    ):
        taken(twice)


@pytest.mark.parametrize("name", AXES)
def test_an_axis_of_one_value_may_be_a_scalar(taken, name):
    one = data().isel({name: 1})
    radar = RADAR | {"polarization": {"polarizations": ["VV"]}, "frequency": {"frequencies": [1.1e9]}}.get(name, {})
    aspect = ASPECT | {"elevation": {"elevation": [10]}, "azimuth": {"azimuth": [90]}}.get(name, {})
    expected = np.take(WANTED, [[*COORDINATES].index(name) and 1], [*COORDINATES].index(name))
    np.testing.assert_array_equal(taken(one, radar, aspect).field, expected)


REFUSED = {
    "theta": (
        lambda d: d.assign_coords(elevation=[0, 110]),
        "elevation 110 degrees is beyond -90 to 90 degrees. If this is theta",
    ),
    "no azimuths": (lambda d: d.drop_vars("azimuth"), "not a store with .*it has no azimuth"),
    "directions": (
        lambda d: d.assign_coords(elevation=("azimuth", [0.0] * 4)).isel(elevation=0, missing_dims="ignore"),
        "not a store with",
    ),
    "GHz": (lambda d: d.assign_coords(frequency=d.frequency / 1e9), "no frequency .* They look like GHz"),
    "radians": (lambda d: d.assign_coords(azimuth=np.radians(d.azimuth)), "no azimuth .* They look like radians"),
    "whole numbers": (
        lambda d: d.assign(field=d.field.real.round().astype(int)),
        "the field is int64; wanted are complex",
    ),
    "not a number": (
        lambda d: d.where(d.azimuth != 90),
        r"12 of 48 samples are not finite; the first is VV at .* azimuth 90",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_store_only_seems_to_hold_is_refused(taken, case):
    change, said = REFUSED[case]
    with pytest.raises(InputError, match=r"^given\.zarr: .*" + said):
        taken(change(data()))


def test_units_have_several_words(taken):
    dataset = data()
    for name, unit in {"field": "metres", "frequency": "hz", "elevation": "deg", "azimuth": "Degree"}.items():
        dataset[name].attrs["units"] = unit
    np.testing.assert_array_equal(taken(dataset).field, WANTED)


@pytest.mark.parametrize(("kind", "form"), [(object, 3), ("S2", 2)])
def test_polarizations_may_be_any_kind_of_text(taken, kind, form):
    data(polarization=np.array(AXES["polarization"], kind)).to_zarr("given.zarr", zarr_format=form)
    np.testing.assert_array_equal(taken().field, WANTED)


def test_axes_may_be_in_any_order(taken):
    mixed = data().isel(frequency=[2, 0, 3, 1], azimuth=[3, 1, 0, 2], elevation=[1, 0])
    np.testing.assert_array_equal(taken(mixed).field, WANTED)
