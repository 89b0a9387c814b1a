"""The solver that docs/adding-a-solver.md prints: a file and a line of the config, and nothing else."""

import numpy as np
import pytest
import xarray as xr
from test_docs import blocks

import isarflow.scattering.solvers
from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep
from isarflow.mesh.io import write_ply
from isarflow.scattering.band import solve_band
from isarflow.scattering.solver import Solution, build_solver
from isarflow.setup.config import load_config

PLATE = ("--configfile", "config/plate.yaml")
STORE = "results/plate/scattering/plate.zarr"
SOLVER = "mine/physical_optics.py"
(CODE,) = blocks("adding-a-solver.md", "python")
(LINES,) = blocks("adding-a-solver.md", "yaml")
SIDE = 0.5  # m, two wavelengths
CONFIG = """
name: plate
targets: {'*': null, plate: {mesh: plate.ply, role: known, symmetry: [xz]}}
mesh: {bands: 2}
radar: {center_frequency: 1.1e+9, bandwidth: 0.2e+9, frequencies: 2, polarizations: [VV, HV]}
aspect: {elevation: {start: 90, stop: 90, step: 1}, azimuth: {start: 0, stop: 20, step: 10}}
imaging: {aperture: 3}
learning: {experiments: {}}
"""
KNOWN = {"mesh": "resources/cad/drone.stl", "role": "known"}
OPTICS = {"solver": SOLVER, "points": "middles"}


@pytest.fixture(scope="module")
def project(project_of):
    """A plate in the plane z = 0 that was solved as the page says."""
    project = project_of("solver")
    corners = SIDE / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    write_ply(project.folder / "plate.ply", corners, np.array([[0, 1, 2], [0, 2, 3]]))
    project.write(SOLVER, CODE.replace("C0\n", "C0\nfrom phases import phases_of\n", 1))
    project.write("mine/phases.py", "def phases_of():\n    pass\n")
    project.write("config/plate.yaml", CONFIG + LINES)
    finished = project.run("--cores", 2, STORE, *PLATE)
    assert finished.returncode == 0, finished.stdout
    return project


def test_a_plate_at_normal_incidence(project):
    """sigma = 4 pi A^2 / lambda^2"""
    store = xr.open_zarr(project.folder / STORE)
    wavelength = C0 / store.frequency.values
    sigma = 4 * np.pi * np.abs(store.field.sel(polarization="VV").values) ** 2
    np.testing.assert_allclose(sigma[:, 0, 0], 4 * np.pi * SIDE**4 / wavelength**2, rtol=1e-4)
    assert (store.field.sel(polarization="HV") == 0).all()
    assert store.attrs["solver"] == SOLVER and store.attrs["points"] == "middles"
    assert store.attrs["residual"] == [None, None] and store.attrs["unknowns"] == [None, None]


def test_what_reruns(project):
    again = {"solve": 2, "scattering": 1}
    assert project.planned(STORE, *PLATE) == {}
    for path in (project.folder / SOLVER, project.folder / "mine/phases.py"):
        text = path.read_text()
        path.write_text(text + "\nADDED = 1\n")
        assert project.planned(STORE, *PLATE) == again
        path.write_text(text)
    # What another solver alone imports is none of this one's code.
    other = project.folder / "isarflow/scattering/mom/factorization.py"
    other.write_bytes(other.read_bytes() + b"\nADDED = 1\n")
    assert project.planned(STORE, *PLATE) == {}
    project.edit("config/plate.yaml", "points: middles", "points: centroid")
    assert project.planned(STORE, *PLATE) == again
    project.edit("config/plate.yaml", "points: centroid", "points: middles")


def test_the_report_follows(project):
    finished = project.run("--cores", 2, "report", *PLATE)
    assert finished.returncode == 0, finished.stdout
    page = (project.folder / "results/plate/report/index.html").read_text()
    assert "The physical optics gives" in page


def test_the_example_agrees_with_the_closed_form_off_normal():
    """f = -j cos(theta) A / lambda sinc(2 d sin(theta) / lambda) in a plane along a side d; from behind it is dark."""
    space = {}
    exec(compile(CODE, "adding-a-solver.md", "exec"), space)
    steps = np.linspace(-SIDE / 2, SIDE / 2, 21)
    x, y = (axis.reshape(-1) for axis in np.meshgrid(steps, steps, indexing="ij"))
    first = (21 * np.arange(20)[:, None] + np.arange(20)).reshape(-1)
    a, b, c, d = first, first + 21, first + 22, first + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    frequency, theta = np.array([1.2e9]), np.radians([0.0, 5.0, 20.0, 40.0])
    sweep = Sweep(frequency, 90 - np.degrees(theta), np.array([0.0]), ["VV"])
    plate = np.stack([x, y, 0 * x], 1), triangles
    solver = space["Solver"]({"points": "middles"})
    field = solver.solve(*plate, sweep, [], 1, lambda *state: None).field[0, 0, :, 0]
    wavelength = C0 / frequency[0]
    truth = -1j * np.cos(theta) * SIDE**2 / wavelength * np.sinc(2 * SIDE * np.sin(theta) / wavelength)
    np.testing.assert_allclose(field, truth, atol=1e-3 * SIDE**2 / wavelength)
    sweep = Sweep(frequency, np.array([-60.0]), np.array([0.0]), ["VV"])
    assert np.abs(solver.solve(*plate, sweep, [], 1, lambda *state: None).field).max() < 1e-12


# What is written under `scattering` (and of a target), and what the message says.
BAD = {
    "another name": ({"solver": "mon"}, {}, "'scattering.solver': there is no solver 'mon'.*'mom'.*path/to/mon.py"),
    "another path": ({"solver": "mine/optics.py"}, {}, "'scattering.solver': there is no file mine/optics.py"),
    "another's setting": ({**OPTICS, "precision": "single"}, {}, "'scattering.precision' is unknown.*points, solver"),
    "a setting left out": ({"solver": SOLVER}, {}, "'scattering.points' is missing.*phase is taken"),
    "a value": ({**OPTICS, "points": "middle"}, {}, "'scattering.points': 'middle' is not one of.*mean 'middles'"),
    "a target's own": (
        OPTICS,
        {"formulation": "cfie"},
        f"'targets.a.formulation': the solver '{SOLVER}' has no",
    ),
    "no class": ({"solver": "mine/empty.py"}, {}, "mine/empty.py has no class Solver with methods solve and plan"),
    "the default's": ({"precision": "half"}, {}, "'scattering.precision': 'half' is not one of ..single', 'double'"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The page's solver and an empty one, in the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / SOLVER).write_text(CODE)
    (tmp_path / "mine/empty.py").write_text("")


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said(case, folder):
    scattering, target, said = BAD[case]
    with pytest.raises(InputError, match=said) as error:
        load_config({"scattering": scattering, "targets": {"a": {**KNOWN, **target}}, "learning": {"experiments": {}}})
    assert "\n" not in str(error.value)


def test_settings_of_the_default_solver_are_not_taken_over(folder):
    config = load_config({"scattering": OPTICS, "targets": {"a": KNOWN}, "learning": {"experiments": {}}})
    assert config["scattering"] == OPTICS
    same = load_config({"scattering": {"solver": "mom", "precision": "double"}})
    defaults = {"formulation": "efie", "tolerance": 1e-5, "normal_current": True}
    assert same["scattering"] == {"solver": "mom", "precision": "double"} | defaults


def test_what_is_not_installed_is_named(tmp_path, monkeypatch):
    (tmp_path / "fast.py").write_text("import no_such_library\n")
    monkeypatch.setattr(isarflow.scattering.solvers, "__path__", [str(tmp_path)])
    with pytest.raises(InputError, match=r"solvers/fast.py cannot be imported: No module named 'no_such_library'"):
        build_solver({"solver": "fast"})


def test_a_field_of_another_shape_than_the_sweep_asks_for_is_refused(tmp_path, monkeypatch):
    class Grid:
        def solve(self, *_):
            return Solution(np.ones((1, 1, 2, 2), complex), None, {"all": np.zeros(1)}, None)

    write_ply(
        tmp_path / "plate.ply",
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    monkeypatch.setattr("isarflow.scattering.band.build_solver", lambda _: Grid())
    two = np.array([0.0, 10.0])
    sweep = Sweep(np.array([1e8]), two, two, ["VV"], paired=True, receivers=(np.zeros(3), np.zeros(3)))
    told = r"\(1, 1, 2, 2\), where \(1, 1, 2, 3\) is asked for \(polarization, frequency, direction, receiver\)"
    with pytest.raises(InputError, match=told):
        solve_band(tmp_path / "plate.ply", tmp_path / "f.zarr", sweep, load_config({})["scattering"], [], 1, "plate")
