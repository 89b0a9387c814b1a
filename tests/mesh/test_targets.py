"""The five targets at the default experiment's sizes: the measures that the method of moments relies on."""

import numpy as np
import pytest

from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.read.target import read_cad
from isarflow.setup.config import load_config

CONFIG = load_config()
CLOSED = ("drone", "missile", "aircraft", "ufo")
TARGETS = (*CLOSED, "trihedral")
HIGHER = {"center_frequency": 2.775e9, "bandwidth": 1.5e9, "frequencies": 14}  # to 3.525 GHz


@pytest.fixture(scope="module")
def built():
    def one(name, radar):
        target = CONFIG["targets"][name]
        return build_meshes(target["mesh"], target, CONFIG["mesh"], CONFIG["radar"] | radar)

    return {name: one(name, {}) for name in TARGETS} | {"drone, higher": one("drone", HIGHER)}


CASES = [(name, band) for name in (*TARGETS, "drone, higher") for band in range(3)]


@pytest.fixture(params=CASES, ids=lambda p: f"{p[0]}-{p[1]}")
def case(request, built):
    name, band = request.param
    meshes, measures = built[name]
    return name.split(",")[0], *meshes[band], measures["bands"][band]


def test_edges_are_a_tenth_of_the_wavelength(case):
    _, vertices, triangles, measures = case
    edge = measures["wavelength"] / 10
    length = topology.edge_lengths(vertices, triangles)
    assert length.mean() <= edge
    assert np.percentile(length, 99) <= 1.35 * edge
    assert length.max() <= 1.6 * edge
    assert measures["edge"]["mean"] == pytest.approx(length.mean())
    assert measures["edge_wavelengths"]["max"] == pytest.approx(length.max() / measures["wavelength"])


def test_unknowns_are_near_the_ideal_number(case):
    _, _, triangles, measures = case
    assert measures["unknowns"] == topology.unknowns(triangles)
    assert 0.8 <= measures["unknowns"] / measures["ideal_unknowns"] <= 1.2


def test_triangles_are_well_shaped(case):
    _, _, _, measures = case
    assert measures["smallest_angle"]["median"] >= 40
    assert measures["smallest_angle"]["p1"] >= 15


def test_surface_is_kept(case):
    name, vertices, triangles, measures = case
    assert max(measures["hausdorff"].values()) <= measures["wavelength"] / 40
    assert topology.areas(vertices, triangles).sum() == pytest.approx(measures["area"]["before"], rel=0.01)
    if name in CLOSED:
        assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(measures["volume"]["before"], rel=0.01)
        assert topology.tetrahedra(vertices, triangles).sum() > 0  # outward
        assert topology.is_watertight(triangles)
        assert measures["components"] == 1
    assert measures["junction_edges"] == 0


def test_mirror_image_is_the_same_to_the_last_bit(case):
    _, vertices, triangles, _ = case
    table = {tuple(point): number for number, point in enumerate((vertices + 0.0).tolist())}
    image = np.array([table[x, 0.0 - y, z] for x, y, z in vertices.tolist()])
    faces = {frozenset(corners) for corners in triangles.tolist()}
    assert {frozenset(corners) for corners in image[triangles].tolist()} == faces
    y = vertices[triangles][:, :, 1]
    assert ((y >= 0).all(axis=1) ^ (y <= 0).all(axis=1)).all()  # no triangle crosses the plane or lies in it


def test_bands_go_up_in_frequency(built):
    for name in TARGETS:
        measures = built[name][1]
        edges = [band["wanted_edge"] for band in measures["bands"]]
        assert edges == sorted(edges, reverse=True)
        assert sum(band["frequencies"]["count"] for band in measures["bands"]) == CONFIG["radar"]["frequencies"]


def test_second_run_gives_the_same_bytes(built):
    target = CONFIG["targets"]["drone"]
    meshes, measures = build_meshes(target["mesh"], target, CONFIG["mesh"], CONFIG["radar"])
    assert measures == built["drone"][1]
    for again, first in zip(meshes, built["drone"][0], strict=True):
        assert again[0].tobytes() == first[0].tobytes()
        assert again[1].tobytes() == first[1].tobytes()


@pytest.mark.parametrize("name", TARGETS)
def test_cad_file_fits_the_project(name):
    vertices, triangles, _ = read_cad(CONFIG["targets"][name]["mesh"])
    assert 0.45 < np.ptp(vertices, axis=0).max() <= 1.0 + 1e-6  # metres
    assert topology.areas(vertices, triangles).sum() < 0.5  # m^2: unknowns go with the area
    assert len(triangles) * 50 < 300_000


def test_trihedral_looks_along_its_boresight():
    vertices, triangles, _ = read_cad(CONFIG["targets"]["trihedral"]["mesh"])
    assert topology.areas(vertices, triangles).sum() == pytest.approx(3 * 0.5**2 / 2)
    elevation = np.arctan(1 / np.sqrt(2))
    boresight = np.array([np.cos(elevation), 0, np.sin(elevation)])
    corners = vertices[np.linalg.norm(vertices, axis=1) > 0.49]
    assert corners @ boresight == pytest.approx([0.5 / np.sqrt(3)] * len(corners), abs=1e-6)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) @ boresight > 0).all()
