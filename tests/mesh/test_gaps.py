"""Narrow gaps of air are named before a solve: a field that resonates in them depends on the mesh."""

import numpy as np
import pytest
from shapes_made import cube, save, together, tube

from isarflow.core.sweep import C0
from isarflow.mesh.build import load_source
from isarflow.mesh.measures import warnings

WAVELENGTH, EDGE = 0.1, 0.01  # m
RADAR = {"center_frequency": C0 / WAVELENGTH, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}


def sheets(gap, length=0.3):
    """Two sheets without thickness, above each other; the lower one looks up and the upper one, too."""
    corners = np.array([[x, y, 0] for x in (-0.5, 0.5) for y in (-0.5, 0.5)]) * [length, length / 2, 0]
    faces = np.array([[0, 2, 1], [1, 2, 3]])
    return together((corners, faces), (corners + np.array([0, 0, gap]), faces))


def slabs(gap, length=0.3, thickness=0.002):
    """Two thick plates, which are a body each."""
    one = cube()[0] * [length, length / 2, thickness]
    return together((one, cube()[1]), (one + np.array([0, 0, gap + thickness]), cube()[1]))


def sleeves(gap, length=0.1):
    """A tube in another one."""
    return together(tube(0.03, 0.004, length, 36), tube(0.03 + gap + 0.004, 0.004, length, 36))


def wedge():
    """Two plates that nearly touch along a line, at an angle of 37 degrees: narrow there, and open at once."""
    (lower, faces), turn = slabs(0.0), np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
    lower, faces = lower[:8], faces[:12]
    raised = lower @ turn
    return together((lower, faces), (raised - [0, 0, raised[:, 2].min() - 0.0015], faces))


def said(tmp_path, shape):
    """The sentences on gaps that a file gets."""
    measures = load_source(save(tmp_path / "gap.ply", *shape), {"unit": "m"}, MESH, RADAR).measures
    return [each for each in warnings({"source": measures, "bands": []}) if "walls face each other" in each]


@pytest.mark.parametrize("shape", [sheets, slabs])
def test_a_narrow_gap_is_named_with_its_place_width_and_length(tmp_path, shape):
    (sentence,) = said(tmp_path, shape(5e-4))
    assert "two walls face each other across 0.5 mm of air, over 0.3 m: at 0.1 m of wavelength it may" in sentence
    assert sentence.endswith("See what 'mesh.edges_per_wavelength: 20' changes.")
    place = np.array(sentence.split("(")[1].split(")")[0].split(","), float)
    assert np.abs(place - [0, 0, 5e-4 if shape is sheets else 1e-3]).max() < EDGE


def test_a_gap_between_round_walls_is_named(tmp_path):
    (sentence,) = said(tmp_path, sleeves(5e-4))
    assert "mm of air, over 0.096 m" in sentence


WIDE, SHORT = 0.4 * EDGE, 0.4 * WAVELENGTH
NONE = {
    "wide sheets": sheets(WIDE),
    "wide slabs": slabs(WIDE),
    "wide sleeves": sleeves(WIDE),
    "short sheets": sheets(5e-4, SHORT),
    "one thin plate": (cube()[0] * [0.3, 0.15, 5e-4], cube()[1]),
    "a wedge of air": wedge(),
}


@pytest.mark.parametrize("name", NONE)
def test_wide_and_short_gaps_and_thin_metal_are_none(tmp_path, name):
    assert said(tmp_path, NONE[name]) == []
