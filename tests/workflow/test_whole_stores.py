"""A store that is not as it was written is refused by every reader, in whatever way it was spoilt."""

import shutil
import subprocess

import numpy as np
import pytest
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.store import SUMS, open_store, write
from isarflow.imaging.store import make_clean, make_noisy, make_pure_noise
from isarflow.learning.data import images
from isarflow.report.results import Results
from isarflow.scattering.fields.external import write_external
from isarflow.scattering.fields.store import join_bands, write_field

RADAR = {"center_frequency": 1e9, "bandwidth": 0.4e9, "frequencies": 6, "polarizations": ["VV"]}
ASPECT = {"elevation": {"start": 0, "stop": 10, "step": 10}, "azimuth": {"count": 12}}
IMAGING = {"imager": "fourier", "aperture": 3, "window": "hamming", "reformat": "polar", "upsample": "none"}
IMAGING |= {"polarizations": ["VV"]}
NOISE = {"seed": 1, "realizations": 2, "definition": "mean", "per": "image"}
FREQUENCY, ELEVATION, AZIMUTH = np.linspace(0.8e9, 1.2e9, 6), np.array([0.0, 10.0]), np.arange(12) * 30.0
EVERY = {"a": AZIMUTH, "pure-noise": AZIMUTH}  # of each target
SETTINGS = {
    "targets": {"a": {"mesh": "a.stl", "role": "known"}},
    "radar": RADAR,
    "aspect": ASPECT,
    "learning": {"experiments": {}},
}
STATED = {"models": {}, "scores": {}}  # no model says what the page calls it


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """results/x with a store of every kind, written by the code that writes them in a run."""
    folder = tmp_path_factory.mktemp("whole") / "x"
    random = np.random.default_rng(0)
    field = (random.normal(size=(1, 6, 2, 12, 2)) @ [1, 1j]).astype(np.complex64)
    parts = {"a-0": slice(0, 3), "a-1": slice(3, 6)}
    for name, part in parts.items():
        attrs = {"unknowns": [9] * 3, "residual": [1e-6] * 3}
        path = folder / f"scattering/bands/{name}.zarr"
        write_field(path, field[:, part], ["VV"], FREQUENCY[part], ELEVATION, AZIMUTH, attrs)
    join_bands([folder / f"scattering/bands/{name}.zarr" for name in parts], folder / "scattering/a.zarr")
    make_clean(folder / "scattering/a.zarr", folder / "imaging/a/clean.zarr", IMAGING)
    make_noisy(folder / "scattering/a.zarr", [folder / "imaging/a/snr_3dB.zarr"], IMAGING, "a", NOISE)
    make_pure_noise(RADAR, ASPECT, folder / "imaging/pure-noise/clean.zarr", IMAGING, 1)
    magnitudes = xr.Dataset(
        {"truth": (("target", "range"), np.ones((1, 6), np.float32)), "predicted": ("target", ["a"])}
    )
    write(magnitudes, folder / "learning/reconstructions/e/capsule.zarr")
    return folder


def _bands(folder):
    join_bands([folder / "scattering/bands/a-0.zarr", folder / "scattering/bands/a-1.zarr"], folder / "again.zarr")


def _given(folder):
    write_external(str(folder / "scattering/a.zarr"), folder / "again.zarr", RADAR, ASPECT)


# Who reads a store of each kind, and which.
READERS = {
    "bands, to join them": ("scattering/bands/a-1.zarr", _bands),
    "a field, to image it": (
        "scattering/a.zarr",
        lambda folder: make_clean(folder / "scattering/a.zarr", folder / "again.zarr", IMAGING),
    ),
    "a field, to image it with noise": (
        "scattering/a.zarr",
        lambda folder: make_noisy(folder / "scattering/a.zarr", [folder / "snr_3dB.zarr"], IMAGING, "a", NOISE),
    ),
    "a field, to show it": (
        "scattering/a.zarr",
        lambda folder: Results(folder, SETTINGS, STATED).scattering("a").load(),
    ),
    "another run's field": ("scattering/a.zarr", _given),
    "images, to learn from": (
        "imaging/a/clean.zarr",
        lambda folder: images.read([folder / "imaging/a/clean.zarr"], EVERY),
    ),
    "images, for their azimuths": (
        "imaging/a/clean.zarr",
        lambda folder: images.azimuths(folder / "imaging/a/clean.zarr"),
    ),
    "noisy images": ("imaging/a/snr_3dB.zarr", lambda folder: images.read([folder / "imaging/a/snr_3dB.zarr"], EVERY)),
    "images of noise": (
        "imaging/pure-noise/clean.zarr",
        lambda folder: images.read([folder / "imaging/pure-noise/clean.zarr"], EVERY),
    ),
    "images, to show them": (
        "imaging/a/clean.zarr",
        lambda folder: Results(folder, SETTINGS, STATED).images("a", "clean").load(),
    ),
    "reconstructions": (
        "learning/reconstructions/e/capsule.zarr",
        lambda folder: Results(folder, SETTINGS, STATED).reconstructions("e", "capsule").load(),
    ),
}


def _chunk(store):
    """The largest chunk of the largest variable: one of data."""
    return max((path for path in store.rglob("*") if path.name[0].isdigit()), key=lambda path: path.stat().st_size)


def _truncate(store):
    chunk = _chunk(store)
    chunk.write_bytes(chunk.read_bytes()[:-4])


def _flip(store):
    chunk = _chunk(store)
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 1
    chunk.write_bytes(content)


def _edit(store):
    text = (store / ".zattrs").read_text()
    (store / ".zattrs").write_text(text[:-2] + " " + text[-2:])


def _add(store):
    chunk = _chunk(store)
    shutil.copy(chunk, chunk.with_name("9" + chunk.name))


SPOILT = {
    "chunk truncated": (_truncate, "is not what was written"),
    "chunk deleted": (lambda store: _chunk(store).unlink(), "is missing"),
    "bit flipped": (_flip, "is not what was written"),
    "attributes edited": (_edit, ".zattrs is not what was written"),
    "chunk added": (_add, "is none that was written"),
    "variable deleted": (lambda store: shutil.rmtree(_chunk(store).parent), "is missing"),
}


# Who reads none of the data, but refuses a store with missing files and wrong attributes all the same.
NO_DATA = {"images, for their azimuths": {"chunk truncated", "bit flipped"}}


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_refuses_a_spoilt_store(whole, tmp_path, reader):
    name, read = READERS[reader]
    folder = shutil.copytree(whole, tmp_path / "x")
    read(folder)  # whole it is taken
    for spoil, problem in (SPOILT[how] for how in SPOILT if how not in NO_DATA.get(reader, ())):
        shutil.rmtree(folder / name)
        shutil.copytree(whole / name, folder / name)
        spoil(folder / name)
        with pytest.raises(InputError, match=problem) as refused:
            read(folder)
        assert str(refused.value).startswith(f"{folder / name}: ")


def test_data_are_compared_when_they_are_read(whole, tmp_path):
    store = shutil.copytree(whole / "imaging/a/snr_3dB.zarr", tmp_path / "imaging/a/snr_3dB.zarr")
    whole_images, _ = images.read([store], EVERY, realizations=1)
    other, opened = store / "image/1.0.0.0.0", open_store(store)
    other.write_bytes(bytes(other.stat().st_size))  # of the second realization
    assert np.array_equal(images.read([store], EVERY, realizations=1)[0], whole_images)
    with pytest.raises(InputError, match=r"file image/1\.0\.0\.0\.0 is not what was written"):
        images.read([store], EVERY)
    (store / "image/0.0.0.0.0").unlink()  # zarr itself would read zeros
    with pytest.raises(InputError, match=r"file image/0\.0\.0\.0\.0 is not what was written"):
        opened.isel(realization=0).load()


def test_a_store_that_was_not_finished_is_refused(whole, tmp_path):
    store = shutil.copytree(whole / "imaging/a/clean.zarr", tmp_path / "clean.zarr")
    (store / SUMS).unlink()
    with pytest.raises(InputError, match="not whole"):
        open_store(store)
    with pytest.raises(InputError, match="no such store"):
        open_store(tmp_path / "none.zarr")


@pytest.mark.filterwarnings("error")
def test_stores_open_with_xarray_alone_and_check_with_sha256sum(whole):
    stores = list(whole.rglob("*.zarr"))
    assert len(stores) == 7
    for path in stores:
        xr.testing.assert_identical(xr.open_zarr(path).load(), open_store(path).load())
        assert subprocess.run(["sha256sum", "--quiet", "-c", SUMS], cwd=path).returncode == 0


@pytest.mark.filterwarnings("ignore:Object at SHA256SUMS")  # zarr says that it passes over it
def test_stores_open_without_consolidated_metadata(whole):
    path = whole / "imaging/a/clean.zarr"
    xr.testing.assert_identical(xr.open_zarr(path, consolidated=False).load(), open_store(path).load())


def test_what_snakemake_and_desktops_leave_in_a_folder_does_no_harm(whole, tmp_path):
    store = shutil.copytree(whole / "imaging/a/clean.zarr", tmp_path / "clean.zarr")
    for name in (".snakemake_timestamp", ".DS_Store"):
        (store / name).touch()
    open_store(store)


def test_a_store_that_is_written_twice_has_the_same_bytes(whole, tmp_path):
    make_clean(whole / "scattering/a.zarr", tmp_path / "clean.zarr", IMAGING)
    first = whole / "imaging/a/clean.zarr"
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert all((first / file).read_bytes() == (tmp_path / "clean.zarr" / file).read_bytes() for file in files)


def test_a_given_store_without_a_list_is_taken_as_it_is(whole, tmp_path):
    store = shutil.copytree(whole / "scattering/a.zarr", tmp_path / "mine.zarr")
    data = xr.open_zarr(store).load()
    data["field"] = 2 * data["field"]
    shutil.rmtree(store)
    data.to_zarr(store, zarr_format=2)
    write_external(str(store), tmp_path / "out.zarr", RADAR, ASPECT)
    np.testing.assert_array_equal(open_store(tmp_path / "out.zarr").field, data.field)
