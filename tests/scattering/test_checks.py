"""Meshes, sweeps and words that solvers refuse or warn of, and computed numbers that are not finite."""

import json
import re
import warnings

import numpy as np
import pytest
from mie import icosphere
from test_magnetic import outward
from test_solve import FREQUENCY, octasphere, sheet, weld

from isarflow.core.errors import InputError
from isarflow.core.store import write
from isarflow.core.sweep import Sweep
from isarflow.mesh.io import write_ply
from isarflow.scattering import needs, sphere
from isarflow.scattering import solve as solver
from isarflow.scattering.band import solve_band
from isarflow.scattering.fields import store
from isarflow.scattering.mom import assembly, farfield
from isarflow.scattering.optics.physical import Surface
from isarflow.scattering.solve import solve
from isarflow.scattering.solver import Solution, build_solver, check_solution

BODY = outward(*octasphere(4, [0.25, 0.2, 0.15]))  # of edges of a tenth of the wavelength
ONE = [FREQUENCY], [0.0], [0.0]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
CUBE = np.array(list(np.ndindex(2, 2, 2)), float), np.array([(a, *of) for a, *b in QUADS for of in (b[:2], b[1:])])


def changed(vertex=None, corner=None):
    """BODY with another first vertex, or another first corner of its last triangle."""
    vertices, triangles = BODY[0].copy(), BODY[1].copy()
    if vertex is not None:
        vertices[triangles[0, 0]] = vertex
    if corner is not None:
        triangles[-1, 0] = corner
    return vertices, triangles


def apart(*triangles):
    """BODY with more triangles, at the places of some of its own but of vertices of their own."""
    corners = BODY[0][BODY[1][list(triangles)]].reshape(-1, 3)
    more = len(BODY[0]) + np.arange(len(corners)).reshape(-1, 3)
    return np.concatenate([BODY[0], corners]), np.concatenate([BODY[1], more])


LAST = len(BODY[1]) - 1
MESHES = {
    "NaN": (changed(np.nan), r"4 of 128 triangles \(the first is number 0\) have corners that are not finite"),
    "infinite": (changed(np.inf), "not finite"),
    "beyond the vertices": (changed(corner=66), rf"1 of 128 .* number {LAST}\) have a vertex number 66; there are 66"),
    "negative": (changed(corner=-1), "have a vertex number -1"),
    "two corners alike": (changed(corner=BODY[1][-1, 1]), rf"number {LAST}\) have no area, as near \("),
    "corners in a line": (changed((BODY[0][BODY[1][0, 1]] + BODY[0][BODY[1][0, 2]]) / 2), "1 of 128 .* have no area"),
    "doubled": (
        (BODY[0], np.concatenate([BODY[1], BODY[1][5:6, ::-1]])),
        "1 of 129 .* number 128.* corners of another",
    ),
    "doubled elsewhere": (apart(7), "1 of 129 .* have the corners of another"),
    "no triangles": ((BODY[0], BODY[1][:0]), "no triangles"),
    "whole numbers as floats": ((BODY[0], BODY[1].astype(float)), r"'triangles' are whole numbers .* not float64"),
    "quadrilaterals": ((BODY[0], np.ones((5, 4), int)), r"'triangles'.* not int64 of shape \(5, 4\)"),
    "two coordinates": (
        (BODY[0][:, :2], BODY[1]),
        r"'vertices' are numbers \(V, 3\) in metres, not float64 of .*66, 2",
    ),
    "complex": ((BODY[0] + 0j, BODY[1]), "'vertices'.* not complex128"),
    "ragged": (([[0.0, 1.0], [2.0]], BODY[1]), "'vertices'.*several lengths"),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_wrong_mesh_is_refused_by_every_solver(name):
    mesh, said = MESHES[name]
    for take in (lambda mesh: solve(*mesh, *ONE), lambda mesh: Surface(*mesh)):
        with pytest.raises(InputError, match=said):
            take(mesh)


def test_vertices_without_triangles_change_nothing():
    """Not even if they are NaN: neither for a solve nor for physical optics."""
    spare = np.concatenate([[[np.nan] * 3], BODY[0], [[1e9, 0, 0]]]), BODY[1] + 1
    assert np.array_equal(solve(*spare, *ONE).field, solve(*BODY, *ONE).field)
    there, here = (Surface(*mesh).backscatter([6.0], [0, 20], [10, 40]) for mesh in (spare, BODY))
    assert np.array_equal(there, here) and np.abs(here).max() > 0


SWEEPS = {
    "frequency": ({"frequencies": [0.0]}, "'frequencies': 0 Hz"),
    "NaN": ({"frequencies": [1e9, np.nan]}, "'frequencies': number 1 is nan"),
    "no list": ({"frequencies": 1e9}, r"'frequencies' is a list .* not float64 of shape \(\)"),
    "none": ({"azimuth": []}, "'azimuth' is a list of one or more numbers"),
    "text": ({"azimuth": ["east"]}, "'azimuth' is a list"),
    "elevation": ({"elevation": [0.0, 95.0]}, "'elevation': 95 degrees; .* from -90 to 90"),
    "pairs": ({"elevation": [0.0, 1.0], "paired": True}, "one direction each: 2 and 1"),
    "receivers": ({"receivers": ([0.0], [0.0, 1.0])}, "'receivers: elevation' and 'azimuth'.*1 and 2"),
    "receiver below": ({"receivers": ([-91.0], [0.0])}, "'receivers: elevation': -91 degrees"),
    "three receivers": ({"receivers": ([0.0], [0.0], [0.0])}, "'receivers' are .* two lists; here are 3"),
    "polarization": ({"polarizations": ["VV", "VX"]}, "'polarizations': 'VX' is none of VV, VH, HV, HH"),
    "a text": ({"polarizations": "VV"}, r"'polarizations' is a list of names, as \['VV'\], not the text 'VV'"),
    "no polarization": ({"polarizations": []}, "'polarizations' names none"),
    "plane": ({"symmetry": ["zx"]}, "'symmetry': 'zx' is none of yz, xz, xy"),
    "plane as text": ({"symmetry": "xz"}, "'symmetry' is a list"),
    "formulation": ({"formulation": "mfie"}, "'formulation': 'mfie' is none of efie, cfie; did you mean"),
    "precision": ({"precision": "half"}, "'precision': 'half' is none of single, double"),
    "tolerance": ({"tolerance": np.nan}, "'tolerance' is a number between 0 and 1"),
    "impedance": ({"impedance": [1.0, 2.0]}, "'impedance' is a finite number, or one for each of 1 frequencies"),
    "impedances of triangles": ({"impedance": np.ones((1, 9))}, "1 frequencies and .* triangles, not float64 of shape"),
    "impedance that is none": ({"impedance": np.inf}, "'impedance' is a finite number"),
    "impedance that gives power": ({"impedance": -1 + 5j}, "'impedance': -1 ohm; .* a real part of 0 or more"),
    "impedance by cfie": (
        {"impedance": 5.0, "formulation": "cfie"},
        "'impedance' is solved by 'formulation' efie alone",
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_a_wrong_argument_is_refused_by_its_name(name):
    other, said = SWEEPS[name]
    asked = {"frequencies": [FREQUENCY], "elevation": [0.0], "azimuth": [0.0]} | other
    with pytest.raises(InputError, match=said):
        solve(*BODY, **asked)


def test_physical_optics_checks_its_sweep():
    wrong = Sweep(np.array([FREQUENCY]), np.array([91.0]), np.array([0.0]), ["VV"])
    with pytest.raises(InputError, match="'elevation': 91 degrees"):
        build_solver({"solver": "po"}).solve(*BODY, wrong, [], 1, lambda *state: None)


def test_frequencies_may_come_in_any_order():
    rising, falling = (solve(*BODY, f, [10.0], [20.0]).field[0, :, 0, 0] for f in ([2e8, 3e8, 3e8], [3e8, 3e8, 2e8]))
    assert np.array_equal(rising, falling[::-1])


def test_a_plane_named_twice_is_one_plane():
    once, twice = (solve(*BODY, *ONE, symmetry=planes).field for planes in (["xz"], ["xz", "xz"]))
    assert np.array_equal(once, twice)


def test_as_many_triangles_on_both_sides_must_be_mirror_images():
    """A vertex beside the plane is moved by a tenth of an edge."""
    beside = np.flatnonzero(BODY[0][:, 1] > 0.05)[0]
    moved = BODY[0].copy()
    moved[beside, 1] += 0.01
    with pytest.raises(InputError, match=r"not symmetric about the plane xz: the mirror image of its triangle near \("):
        solve(moved, BODY[1], *ONE, symmetry=["xz"])


def test_a_cube_of_twelve_triangles_is_refused_and_has_its_level_with_short_edges():
    """1 m, two wavelengths: physical optics gives 4 pi A^2 / lambda^2, 17.0 dBsm. Twelve triangles gave 2.96."""
    said = r"at 0\.6 GHz the mesh has 0\.44 edges in a wavelength .* longest of 1\.41 m \(2\.8 wavelengths\): too few"
    with pytest.raises(InputError, match=said):
        solve(*CUBE, [0.6e9], [0.0], [0.0])
    x, y, z = np.eye(3)
    sides = [sheet(u, v, 9, 9) for u, v in ((x, y), (y, z), (z, x))]
    sides += [(points + way, triangles) for (points, triangles), way in zip(sides, (z, x, y), strict=True)]
    field = solve(*weld(*sides), [0.6e9], [0.0], [0.0]).field
    # Measured: 16.93 dBsm, with sides in nine edges.
    assert 10 * np.log10(4 * np.pi * abs(field[0, 0, 0, 0]) ** 2) == pytest.approx(17.0, abs=0.3)


def test_a_mesh_in_millimetres_is_asked_for_its_unit():
    ball = icosphere(0.2, 0.03)
    said = r"It is 401\.2 m \(1338 wavelengths\) long: is this in metres\? With 10 edges .* unknowns, .* GB\."
    with pytest.raises(InputError, match=said):
        solve(1000 * ball[0], ball[1], [1e9], [0.0], [0.0])


def test_edges_of_a_third_of_a_wavelength_are_warned_of():
    """Once, with the number, where `solve` is called. With ten edges in a wavelength nobody is warned."""
    coarse, usual = icosphere(1.0, 0.4), icosphere(0.25, 0.1)
    with pytest.warns(
        UserWarning, match=r"2\.5 edges in a wavelength .*\(0\.42 wavelengths\): .* errs by a decibel"
    ) as told:
        solve(*coarse, *ONE)
    assert len(told) == 1 and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        solve(*usual, *ONE)


def test_a_mesh_of_an_unusual_size_is_warned_of():
    """A hundredth of a wavelength, as of metres where millimetres were meant."""
    with pytest.warns(UserWarning, match=r"the mesh is 0\.01 m \(0\.01 wavelengths\) long: is this in metres\?"):
        solve(BODY[0] / 50, BODY[1], *ONE, precision="double")


def test_seams_without_common_vertices_are_warned_of():
    """Two halves of a plate: their edges lie on each other, but no current crosses."""
    half = sheet([0, 0.2, 0], [0, 0, 0.4], 2, 4)
    beside = half[0] + [0, 0.2, 0], half[1] + len(half[0])
    whole = np.concatenate([half[0], beside[0]]), np.concatenate([half[1], beside[1]])
    with pytest.warns(UserWarning, match="at 4 places rims of the mesh lie on each other"):
        torn = solve(*whole, *ONE, polarizations=["HH"])
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        joined = solve(*weld(half, (beside[0], half[1])), *ONE, polarizations=["HH"])
    assert joined.unknowns == torn.unknowns + 4
    assert abs(torn.field[0, 0, 0, 0]) < 0.6 * abs(joined.field[0, 0, 0, 0])  # measured: 0.41


def test_a_solve_without_memory_is_refused(monkeypatch):
    monkeypatch.setattr(needs, "memory_megabytes", lambda: 100.0)
    with pytest.raises(InputError, match=r"takes about 192 unknowns and 0\.5 GB; this machine has 0\.1 GB"):
        solve(*BODY, *ONE)


# Ways through a solve; azimuths are so dense that few of them are computed.
PATHS = {
    "whole": {},
    "compressed": {"tolerance": 1e-5},
    "double": {"precision": "double"},
    "mirrored": {"symmetry": ["xz"]},
    "cfie": {"formulation": "cfie"},
    "bistatic": {"receivers": ([0.0, 10.0], [30.0, 50.0])},
}
DENSE = [FREQUENCY], [0.0, 25.0], np.arange(0.0, 360.0, 4.0)
FAULTS = {
    "the excitation": (farfield, "excite", np.nan),
    "the matrix": (assembly, "tile", np.nan),
    # The inverse of a block may be finite and wrong with it.
    "the matrix's infinity": (assembly, "tile", np.inf),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("path", PATHS)
def test_what_a_kernel_gives_must_be_finite(path, fault, monkeypatch):
    module, name, value = FAULTS[fault]
    kernel = getattr(module, name)

    def broken(out, *arguments):
        kernel(out, *arguments)
        out.flat[out.size // 2] = value

    monkeypatch.setattr(module, name, broken)
    monkeypatch.setattr("isarflow.scattering.mom.basis.PATCH_TRIANGLES", 40)
    said = re.escape(fault.removesuffix("'s infinity"))
    with pytest.raises(InputError, match=f"at 0.299792 GHz {said} holds numbers that are not finite"):
        solve(*BODY, *DENSE, **PATHS[path])


@pytest.mark.parametrize("path", PATHS)
def test_right_sides_and_currents_must_be_finite(path, monkeypatch):
    """A right side of any direction, also if none of those that are probed; and currents behind a good residual."""
    sound = solver.Excitation.__call__
    for columns in (slice(0, 1), slice(-1, None)):

        def broken(self, *arguments, columns=columns, **settings):
            parts = [part.copy() for part in sound(self, *arguments, **settings)]
            parts[0][3, columns] = np.nan
            return parts

        with monkeypatch.context() as change:
            change.setattr(solver.Excitation, "__call__", broken)
            with pytest.raises(InputError, match="residual is nan"):
                solve(*BODY, *DENSE, **PATHS[path])
    between, currents = solver._System._between, solver._System.currents

    def lost(system, *arguments):
        return [[np.full_like(of_group, np.nan) for of_group in part] for part in between(system, *arguments)]

    monkeypatch.setattr(solver._System, "_between", lost)
    monkeypatch.setattr(solver._System, "currents", lambda *given: [np.inf * part for part in currents(*given)])
    with pytest.raises(InputError, match="the field holds numbers that are not finite"):
        solve(*BODY, *DENSE, **PATHS[path])


def test_a_right_side_with_nan_counts_as_excited():
    rows, right = np.eye(3), np.ones((3, 2))
    right[1, 1] = np.nan
    assert np.isnan(solver._residual(rows, np.arange(3), right, np.ones((3, 2))))
    assert solver._residual(rows, np.arange(3), np.zeros((3, 2)), np.ones((3, 2))) == 0


SWEEP = Sweep(np.array([1e9, 2e9]), np.array([0.0]), np.array([0.0, 5.0, 10.0]), ["VV"])
GOOD = np.ones((1, 2, 1, 3), complex)
WRONG = np.where(np.arange(3) == 1, np.nan, GOOD)
RESULTS = {
    "nothing": (None, "a NoneType, where a Solution is asked for"),
    "a shape": (Solution(GOOD[..., 0], None, {}, None), r"a field of shape \(1, 2, 1\), where \(1, 2, 1, 3\)"),
    "real numbers": (Solution(GOOD.real, None, {}, None), "a field of float64, where complex"),
    "NaN": (
        Solution(WRONG, None, {}, None),
        "a field of which 2 of 6 numbers are not finite .* polarization 0, frequency 0, elevation 0, azimuth 1,",
    ),
    "a residual": (Solution(GOOD, np.zeros(3), {}, 5), r"'residual' of shape \(3,\), where \(2,\)"),
    "a NaN residual": (Solution(GOOD, np.full(2, np.nan), {}, 5), "a residual that is not finite"),
    "seconds": (Solution(GOOD, None, {"all": np.zeros(())}, None), r"'all' of shape \(\), where \(2,\)"),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_wrong_result_is_refused_with_the_solver_s_name(name):
    result, said = RESULTS[name]
    with pytest.raises(InputError, match=f"'scattering.solver': 'mine' gives {said}"):
        check_solution(result, SWEEP, "mine")
    check_solution(Solution(GOOD, np.zeros(2), {"all": np.zeros(2)}, 5), SWEEP, "mine")


@pytest.mark.parametrize("name", ["po", "sbr"])
def test_nan_of_physical_optics_and_rays_is_refused(name, tmp_path, monkeypatch):
    if name == "sbr":
        pytest.importorskip("embreex")
    sound = Surface.backscatter
    monkeypatch.setattr(Surface, "backscatter", lambda *given: np.nan * sound(*given))
    write_ply(tmp_path / "a.ply", *BODY)
    with pytest.raises(InputError, match=f"'{name}' gives a field of which 6 of 6 numbers are not finite"):
        solve_band(tmp_path / "a.ply", tmp_path / "a.zarr", SWEEP, {"solver": name}, [], 1, "a")
    assert not (tmp_path / "a.zarr").exists()


def test_no_store_of_a_field_with_nan_is_written(tmp_path):
    """Also not by the join of bands that an earlier version wrote."""
    axes = SWEEP.polarizations, SWEEP.frequency, SWEEP.elevation, SWEEP.azimuth
    with pytest.raises(InputError, match=r"a\.zarr: the field holds numbers that are not finite"):
        store.write_field(tmp_path / "a.zarr", WRONG.astype(np.complex64), *axes, {})
    assert not (tmp_path / "a.zarr").exists()
    attrs = {"unknowns": [None] * 2, "residual": [None] * 2}
    store.write_field(tmp_path / "band.zarr", GOOD.astype(np.complex64), *axes, attrs)
    write(store.open_store(tmp_path / "band.zarr").load() * np.nan, tmp_path / "old.zarr")
    with pytest.raises(InputError, match=r"a\.zarr: the field holds numbers that are not finite"):
        store.join_bands([tmp_path / "old.zarr"], tmp_path / "a.zarr", attrs)
    assert not (tmp_path / "a.zarr").exists()


def test_the_sphere_s_check_says_which_solver_gave_nan(tmp_path, monkeypatch):
    class Broken:
        def solve(self, vertices, triangles, sweep, *_):
            return Solution(np.full((1, 1, 1, 1), np.nan + 0j), None, {}, None)

    monkeypatch.setattr(sphere, "build_solver", lambda settings: Broken())
    sphere.check(tmp_path / "sphere.json", {"solver": "mine"}, 10, 1)
    assert "'mine' gives a field of which 1 of 1" in json.loads((tmp_path / "sphere.json").read_text())["refused"]
    with pytest.raises(InputError, match="'edge' of a sphere is 0"):
        icosphere(0.2, 0)
