"""What looks alike: likeness of images, and of each unknown target the image most like one of a known target."""

from types import SimpleNamespace

import numpy as np
import xarray as xr

from isarflow.report import section_alike
from isarflow.report.layout import style


def test_the_images_that_look_alike_are_those_with_the_largest_correlation():
    """Noise of four targets, one image of an unknown one nearly the same as one of a known target."""
    random = np.random.default_rng(4)
    images = {name: random.standard_normal((2, 8, 6, 5, 2)) @ [1, 1j] for name in "abuv"}
    images["v"][1, 5] = images["b"][1, 2] * 1.3j + 0.05  # the phase counts for nothing, nor does the size
    images["u"][0, 0] = images["a"][0, 0]  # far from the horizon
    coords = {"elevation": [-30.0, 2.0], "azimuth": np.arange(8) * 45.0}
    coords |= {"range": np.arange(6) * 0.1, "crossrange": np.arange(5) * 0.1}
    stores = {name: xr.Dataset({"image": ([*coords], of.astype(np.complex64))}, coords) for name, of in images.items()}
    roles = {"known": ["a", "b"], "unknown": ["u", "v"]}
    with style():
        (figure,) = section_alike.alike_figure(SimpleNamespace(of_role=roles.get, images=lambda name, _: stores[name]))
    assert "v 225° and b 90°, 1.00." in figure.caption
    shown = figure.data["image"].unique().tolist()
    assert shown[2:] == ["2: v 225°", "2: b 90°"] and shown[0].startswith("1: u ")
    assert "elevation 2°" in figure.caption and "u 0° and a 0°" not in figure.caption


def test_likeness_is_one_for_the_same_image_and_none_without_contrast():
    images = np.random.default_rng(3).normal(size=(4, 5, 6, 2)) @ [1, 1j]
    rows = section_alike.standardized(images)
    same = section_alike.standardized((3 * np.abs(images) + 2).astype(complex))
    np.testing.assert_allclose(np.diag(rows @ same.T), 1)
    assert np.abs(rows @ rows.T - np.eye(4)).max() <= 1
    assert not section_alike.standardized(np.ones((1, 5, 6))).any()
