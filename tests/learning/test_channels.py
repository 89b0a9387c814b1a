"""Images of several polarizations: how they are read, that every model takes them, and one of them alone."""

import h5py
import numpy as np
import pandas as pd
import pytest
from scenes import APERTURE, PLANES, ROLES, SPLIT, aspects, fitted, noisy, scene, tables_of, write

import isarflow
from isarflow.learning.classifier import build_classifier
from isarflow.learning.data import images
from isarflow.learning.data.export import export
from isarflow.learning.models import capsule

NAMES = ("VV", "HH", "HV")
FCNN = {"width": 24, "epochs": 5, "batch": 8, "learning_rate": 0.01, "openmax_tail": 5, "openmax_alpha": 1}
CAPSULE = {"width": 4, "capsules": 1, "routings": 2, "decoder": 8, "epochs": 1, "patience": 1, "batch": 8}
CAPSULE |= {"learning_rate": 0.001, "decay": 1, "reconstruction": 0.5, "denoise": False, "complex": False}
FLAT = {
    "lr": {"penalty": 0.1},
    "svm": {"C": 930.66, "scale": 2.75},
    "knn": {"k": 1},
    "matched_filter": {},
    "adaptive_filter": {"loading": 0.001},
}
EVERY = {**FLAT, "fcnn": FCNN}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The folders of stores of three polarizations, and of the first of them alone."""
    both = [tmp_path_factory.mktemp(name) for name in ("three", "one")]
    for target in ROLES:
        plain = scene(target)
        channels = np.stack([plain, 2 * np.roll(plain, 1, axis=-2), 0.3j * plain[..., ::-1, :]], axis=-3)
        random = np.random.default_rng([8, *target.encode()])
        noise = random.standard_normal((2, *channels.shape, 2)) @ [1, 1j] / np.sqrt(2)
        for label, first, three in (("clean", plain, channels), ("snr_6dB", noisy(target, 6), channels + noise / 2)):
            three[..., 0, :, :] = first
            for folder, some, names in zip(both, (three, first), (NAMES, ()), strict=True):
                axes = (-3, -2, -1) if names else (-2, -1)
                peak = np.abs(some).max(axis=axes, keepdims=True)
                write(folder / target / f"{label}.zarr", some / peak, aspects(), names)
    return both


def stores(folder, label="snr_6dB", targets=("dart", "disc")):
    return [str(folder / target / f"{label}.zarr") for target in targets]


def read(folder, **how):
    return images.read(stores(folder), dict.fromkeys(ROLES, aspects()), **how)[0]


def test_images_have_an_axis_of_channels_where_there_are_several(folders):
    three, one = folders
    every = read(three)
    assert every.shape[1:] == (3, 6, 5) and every.dtype == np.complex64 and read(one).shape[1:] == (6, 5)
    np.testing.assert_array_equal(read(three, channels=list(NAMES)), every)
    # In the order of the store, whatever that of the list.
    two = read(three, channels=["HH", "VV"])
    np.testing.assert_allclose(np.abs(two).max(axis=(1, 2, 3)), 1, rtol=1e-6)
    np.testing.assert_allclose(two[:, 0] / np.abs(every[:, 0]).max(), two[:, 0] / np.abs(every[:, 0]).max())
    peak = np.abs(every[:, :2]).max(axis=(1, 2, 3), keepdims=True)
    np.testing.assert_allclose(two, every[:, :2] / peak, atol=1e-6)


@pytest.mark.parametrize("pixels", ["none", 12])
def test_one_channel_alone_is_the_image_of_that_polarization(folders, pixels):
    three, one = folders
    alone = read(three, channels=["VV"], pixels=pixels)
    np.testing.assert_allclose(alone, read(one, pixels=pixels), atol=1e-6)
    np.testing.assert_array_equal(read(one, channels=["VV"], pixels=pixels), read(one, pixels=pixels))
    assert alone.shape[1:] == ((6, 5) if pixels == "none" else (12, 12))


def test_up_sampled_images_have_one_peak_over_their_channels(folders):
    finer = read(folders[0], pixels=12)
    assert finer.shape[1:] == (3, 12, 12)
    np.testing.assert_allclose(np.abs(finer).max(axis=(1, 2, 3)), 1, rtol=1e-6)
    assert np.abs(finer).max(axis=(2, 3)).min() < 0.5


def test_a_run_on_one_channel_is_that_of_the_one_polarization(folders, tmp_path):
    tables = []
    for number, (folder, more) in enumerate(zip(folders, ({"channels": ["VV"]}, {}), strict=True)):
        model = fitted(stores(folder), tmp_path / f"m{number}", "lr", settings=EVERY["lr"], **more)
        some = stores(folder, targets=sorted(ROLES))
        tables.append(tables_of(some, model, tmp_path / f"t{number}", is_open=True)["snr_6dB"])
    assert (tables[0]["predicted"] == tables[1]["predicted"]).all()
    scores = [table.filter(regex="^(score|known)_") for table in tables]
    pd.testing.assert_frame_equal(*scores, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("name", EVERY)
def test_every_model_learns_from_all_channels(name, folders, tmp_path):
    """At 6 dB one channel leaves errors; three, of which one is twice as strong, leave fewer."""
    right = []
    for number, folder in enumerate(folders):
        both = stores(folder, "clean") + stores(folder)
        snr_db = {"random": ["clean", 6]} if name == "adaptive_filter" else ["clean", 6]
        selection = {"elevation": "all", "snr_db": snr_db}
        model = fitted(both, tmp_path / f"m{number}", name, selection, settings=EVERY[name])
        table = tables_of(stores(folder), model, tmp_path / f"t{number}")["snr_6dB"]
        right.append((table["truth"] == table["predicted"]).mean())
    assert right[0] > 0.95 and right[0] > right[1] + 0.02


@pytest.mark.parametrize("name", FLAT)
def test_the_order_of_channels_means_nothing(name, folders):
    three, labels = read(folders[0]), np.repeat(["dart", "disc"], 144)
    learned, asked = np.arange(288) % 3 > 0, np.arange(288) % 3 == 0
    outcomes = []
    for order in ([0, 1, 2], [2, 0, 1]):
        x = np.ascontiguousarray(three[:, order])
        model = build_classifier(name, FLAT[name], seed=1).fit(x[learned], labels[learned])
        outcomes.append(model.evaluate(x[asked]))
    first, second = outcomes
    assert (first.labels == second.labels).mean() > 0.98
    np.testing.assert_allclose(first.scores, second.scores, rtol=0.02, atol=0.02 * np.abs(first.scores).max())


@pytest.mark.parametrize("is_complex", [False, True])
def test_a_capsule_network_has_a_channel_for_each(is_complex):
    random = np.random.default_rng(0)
    x = (random.standard_normal((16, 3, 18, 17)) + 1j * random.standard_normal((16, 3, 18, 17))).astype(np.complex64)
    x /= np.abs(x).max(axis=(1, 2, 3), keepdims=True)
    model = build_classifier("capsule", CAPSULE | {"complex": is_complex}, seed=1).fit(x, np.repeat(["a", "b"], 8))
    inputs = model._inputs(x)
    assert inputs.shape == (16, 18, 17, 6 if is_complex else 3)
    if is_complex:
        np.testing.assert_array_equal(inputs[..., ::2] + 1j * inputs[..., 1::2], np.moveaxis(x, 1, -1))
    else:
        np.testing.assert_array_equal(inputs, np.moveaxis(np.abs(x), 1, -1))
    seen, made, _ = model.reconstruct(x)
    np.testing.assert_allclose(seen, np.abs(x[:, 0]), rtol=1e-5)
    assert made.shape == seen.shape
    if is_complex:  # all channels of an image turn by one phase
        (turned,) = capsule._turned((inputs,), np.full(16, 0.7))
        expected = np.moveaxis(x * np.exp(0.7j), 1, -1)
        np.testing.assert_allclose(turned[..., ::2] + 1j * turned[..., 1::2], expected, atol=1e-6)


def test_a_network_of_pytorch_is_told_how_many_channels_there_are(folders):
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    from isarflow.learning.pytorch import PyTorch

    class Model(PyTorch):
        def network(self, pixels, classes):
            count = self.channels * pixels[0] * pixels[1]
            return torch.nn.Sequential(torch.nn.Flatten(), torch.nn.Linear(count, classes))

    labels, settings = np.repeat(["dart", "disc"], 144), {"epochs": 3, "batch": 16, "learning_rate": 0.05}
    for folder, channels in zip(folders, (6, 2), strict=True):
        model = Model(settings, 0).fit(read(folder), labels)
        assert model.channels == channels and (model.predict(read(folder)) == labels).mean() > 0.8


def test_exported_images_keep_their_channels(folders, tmp_path):
    path = tmp_path / "snr_6dB.h5"
    export(stores(folders[0], targets=sorted(ROLES)), path, ROLES, PLANES, SPLIT, 3, APERTURE)
    with h5py.File(path) as file:
        assert file["channel"].asstr()[:].tolist() == list(NAMES) and file["image"].shape[1:] == (3, 6, 5)
    np.testing.assert_array_equal(isarflow.load(path).x, read(folders[0]))
