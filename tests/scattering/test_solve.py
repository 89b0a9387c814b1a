"""The solver against closed forms and against its own symmetries."""

import mie
import numpy as np
import pytest
from paths import both
from stored import unknowns

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.solve import MAX_RESIDUAL, _System, solve

path = both(__name__, 60)  # triangles, so that these small meshes have several patches
FREQUENCY = C0  # wavelength 1 m, so that lengths read in wavelengths
ELEVATION, AZIMUTH = np.array([-30.0, 0.0, 20.0]), np.arange(0.0, 360.0, 45.0)


def octasphere(count, semi_axes):
    """Ellipsoid from a subdivided octahedron: mirror-symmetric to the bit, edges along the mirror planes."""
    numbers, points, triangles = {}, [], []

    def number(point):
        if point not in numbers:
            numbers[point] = len(points)
            points.append(point)
        return numbers[point]

    for sx, sy, sz in np.ndindex(2, 2, 2):
        sx, sy, sz = 1 - 2 * sx, 1 - 2 * sy, 1 - 2 * sz

        def corner(i, j, s=(sx, sy, sz)):
            return number((s[0] * i, s[1] * j, s[2] * (count - i - j)))

        for i in range(count):
            for j in range(count - i):
                triangles.append((corner(i, j), corner(i + 1, j), corner(i, j + 1)))
                if i + j < count - 1:
                    triangles.append((corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)))
    points = np.array(points, float)
    return points / np.linalg.norm(points, axis=1, keepdims=True) * semi_axes, np.array(triangles)


def sheet(u, v, nu, nv):
    """Flat rectangle spanned by vectors u and v from the origin, as triangles."""
    i, j = np.meshgrid(np.arange(nu + 1), np.arange(nv + 1), indexing="ij")
    points = i.reshape(-1, 1) / nu * np.asarray(u, float) + j.reshape(-1, 1) / nv * np.asarray(v, float)
    a = (np.arange(nu)[:, None] * (nv + 1) + np.arange(nv)).reshape(-1)
    b, c, d = a + nv + 1, a + 1, a + nv + 2
    return points, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def weld(*parts):
    """Join meshes and merge equal points."""
    offsets = np.cumsum([0] + [len(points) for points, _ in parts])
    points = np.concatenate([points for points, _ in parts])
    triangles = np.concatenate([t + offset for (_, t), offset in zip(parts, offsets, strict=False)])
    _, first, place = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[first], place.reshape(-1)[triangles]


def decibel(ratio):
    return 20 * np.log10(np.abs(ratio))


@pytest.mark.parametrize(("radius", "bound"), [(0.25, 0.1), (0.5, 0.1), (1.0, 0.05)])
def test_sphere_agrees_with_mie(radius, bound):
    vertices, triangles = mie.icosphere(radius, 0.1)
    solution = solve(vertices, triangles, [FREQUENCY], [0.0, 35.0], [0.0, 100.0, 200.0], ["VV", "HH", "HV"])
    ratio = solution.field[:2] / mie.backscatter(2 * np.pi, radius)
    assert np.abs(decibel(ratio)).max() < bound
    assert np.abs(np.degrees(np.angle(ratio))).max() < 2
    # A sphere has no cross-polar backscatter; a faceted one has a little.
    assert np.abs(solution.field[2]).max() < 0.01 * np.abs(solution.field[:2]).max()
    assert solution.residual.max() < 1e-4


@pytest.fixture(scope="module")
def ellipsoid():
    return octasphere(7, [0.5, 0.35, 0.4])


@pytest.fixture(scope="module")
def plain(ellipsoid):
    return solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HH", "HV", "VH"])


@pytest.mark.parametrize("symmetry", [["xz"], ["yz"], ["xy"], ["xz", "yz"], ["xz", "xy"], ["xz", "yz", "xy"]])
def test_mirrored_solve_equals_plain_one(ellipsoid, plain, symmetry):
    mirrored = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HH", "HV", "VH"], symmetry)
    assert mirrored.unknowns == plain.unknowns
    assert np.abs(mirrored.field - plain.field).max() < 1e-5 * np.abs(plain.field).max()


def test_cross_polar_amplitudes_are_reciprocal(ellipsoid):
    field = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HV", "VH"], precision="double").field
    assert np.abs(field[1] - field[2]).max() < 1e-12 * np.abs(field[0]).max()
    assert np.abs(field[1]).max() > 0.01 * np.abs(field[0]).max()


def test_precisions_agree(ellipsoid, plain):
    double = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, ["VV"], precision="double")
    assert np.abs(double.field - plain.field[:1]).max() < 1e-5 * np.abs(plain.field).max()
    assert double.residual.max() < 1e-12


def test_rotation_about_z_shifts_azimuth(ellipsoid, plain):
    turn = np.radians(45.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    turned = solve(ellipsoid[0] @ rotation.T, ellipsoid[1], [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HH"])
    assert np.abs(turned.field - np.roll(plain.field[:2], 1, -1)).max() < 1e-4 * np.abs(plain.field).max()


def test_translation_changes_only_the_phase(ellipsoid, plain):
    shift = np.array([30.3, -20.7, 10.45])
    moved = solve(ellipsoid[0] + shift, ellipsoid[1], [FREQUENCY], ELEVATION, AZIMUTH, ["VV"])
    el, az = np.radians(ELEVATION)[:, None], np.radians(AZIMUTH)
    nearer = np.cos(el) * (np.cos(az) * shift[0] + np.sin(az) * shift[1]) + np.sin(el) * shift[2]
    assert np.allclose(
        moved.field, plain.field[:1] * np.exp(4j * np.pi * nearer), atol=1e-5 * np.abs(plain.field).max()
    )


def test_plate_at_broadside_agrees_with_physical_optics():
    side = 2.0
    points, triangles = sheet([0, side, 0], [0, 0, side], 20, 20)
    field = solve(points - points.mean(0), triangles, [FREQUENCY], [0.0], [0.0], ["VV", "HH"]).field
    # Physical optics: f = -j A / lambda, RCS = 4 pi A^2 / lambda^2. It leaves out the edges, whose share falls with the
    # size. Measured: an error of 0.047 of it here (0.33 dB), 0.028 at three wavelengths and 0.019 at four.
    assert np.abs(field / (-1j * side**2) - 1).max() < 0.06


def test_close_plates_are_as_exact_as_others():
    """Six plates a twentieth of a wavelength apart: what one takes of another is nearly what it has."""
    points, triangles = sheet([1.1, 0, 0], [0, 1.3, 0], 11, 13)
    stack = weld(*((points + np.array([0, 0, 0.05 * n]), triangles) for n in range(6)))
    solution = solve(*stack, [FREQUENCY], [0.0, 20.0], [0.0, 30.0], ["VV", "HH"])
    assert solution.residual.max() < 5e-5


def test_half_plate_with_mirror_plane_equals_whole_one():
    """Junctions across the plane, a sheet that lies in it, and one that crosses it at right angles."""
    flat = sheet([0.8, 0, 0], [0, 0.3, 0], 8, 3)
    other = (flat[0] * [1, -1, 1], flat[1])
    fin = sheet([0.8, 0, 0], [0, 0, 0.3], 8, 3)
    vertices, triangles = weld(flat, other, fin)
    surface = fundamental_domain(vertices, triangles, ())
    # Three triangles meet at each of the eight edges of the junction and carry two functions there.
    lone = unknowns(fundamental_domain(*weld(flat, other), ())) + unknowns(fundamental_domain(*fin, ()))
    assert unknowns(surface) == lone + 8
    whole = solve(vertices, triangles, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HH", "HV"])
    half = solve(vertices, triangles, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HH", "HV"], ["xz"])
    assert half.unknowns == whole.unknowns
    assert np.abs(half.field - whole.field).max() < 1e-4 * np.abs(whole.field).max()


def test_unsymmetric_mesh_is_refused():
    vertices, triangles = mie.icosphere(0.3, 0.2)
    with pytest.raises(InputError, match="not symmetric about the plane xz"):
        solve(vertices + np.array([0, 0.1, 0]), triangles, [FREQUENCY], [0.0], [0.0], symmetry=["xz"])


def test_single_triangle_is_refused():
    with pytest.raises(InputError, match="no inner edge"):
        solve(np.eye(3), np.array([[0, 1, 2]]), [FREQUENCY], [0.0], [0.0])


def test_every_edge_of_a_closed_surface_carries_one_function(ellipsoid):
    surface = fundamental_domain(*ellipsoid, ())
    basis = rwg(surface, surface.parities[0])
    assert len(basis) == 3 * len(ellipsoid[1]) // 2
    assert (np.sort(basis.halves.reshape(-1)) == np.arange(3 * len(ellipsoid[1]))).all()


def test_solution_that_fails_is_an_error(ellipsoid):
    # A thousandth of a wavelength: the EFIE's matrix is beyond single precision.
    with pytest.raises(InputError, match="residual"):
        solve(ellipsoid[0] / 1000, ellipsoid[1], [FREQUENCY], [0.0], [0.0])


@pytest.mark.parametrize("polarizations", [["VV", "HH"], ["HH", "VV"]])
def test_every_polarization_is_probed(polarizations):
    """V from the horizon finds nothing to excite on a horizontal plate; H does, on one far too small for its digits."""
    plate = sheet([6e-4, 0, 0], [0, 6e-4, 0], 8, 8)  # wavelengths
    with pytest.raises(InputError, match=r"residual is .*far smaller than the wavelength"):
        solve(*plate, [FREQUENCY], [0.0], [0.0, 45.0], polarizations)


@pytest.mark.parametrize("parity", [0, 1])
def test_a_solution_that_is_no_number_is_refused(ellipsoid, parity, monkeypatch):
    """Whichever parity it is in."""
    sound = _System._solve

    def broken(system, right):
        currents = sound(system, right)
        currents[parity][0] = np.nan
        return currents

    monkeypatch.setattr(_System, "_solve", broken)
    with pytest.raises(InputError, match="residual is nan"):
        solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, ["VV"], symmetry=["xz"])


def test_large_residual_is_refined(ellipsoid):
    # A twenty-fifth of a wavelength: single precision leaves a residual of 1.5e-3, and 2e-4 of the field.
    small = ellipsoid[0] / 25, ellipsoid[1]
    double = solve(*small, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HV"], precision="double")
    single = solve(*small, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HV"])
    assert single.residual[0] < MAX_RESIDUAL
    assert np.abs(single.field - double.field).max() < 3e-5 * np.abs(double.field).max()


@pytest.mark.parametrize("settings", [{"symmetry": ["xz"]}, {"symmetry": ["xz"], "formulation": "cfie"}])
def test_refined_solution_is_that_of_double_precision(path, ellipsoid, settings, monkeypatch):
    if path:
        pytest.skip("test_lowrank refines compressed solutions: patches this small leave other last bits")
    if "formulation" in settings:
        inward = np.linalg.det(ellipsoid[0][ellipsoid[1]]) < 0
        ellipsoid = ellipsoid[0], np.where(inward[:, None], ellipsoid[1][:, ::-1], ellipsoid[1])
    waves = ["VV", "HH", "HV"]
    double = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, waves, precision="double", **settings)
    monkeypatch.setattr("isarflow.scattering.solve.MAX_RESIDUAL", 5e-7)
    refined = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, waves, **settings)
    assert np.abs(refined.field - double.field).max() < 3e-7 * np.abs(double.field).max()
