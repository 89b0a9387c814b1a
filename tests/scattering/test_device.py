"""The path for a GPU, on whatever device JAX has here."""

import jax
import numpy as np
import pytest
from stored import dense
from test_magnetic import general, outward
from test_matrix import filled, symmetric
from test_solve import AZIMUTH, ELEVATION, FREQUENCY, octasphere

from isarflow.core.errors import InputError
from isarflow.scattering import solve as solver
from isarflow.scattering.mom.device import OnDevice, holds
from isarflow.scattering.mom.factorization import GeneralMatrix, SymmetricMatrix


@pytest.mark.parametrize(("dtype", "bound"), [(np.complex64, 1e-4), (np.complex128, 1e-12)])
@pytest.mark.parametrize("kind", [SymmetricMatrix, GeneralMatrix])
def test_factorization_solves(kind, dtype, bound):
    if kind is GeneralMatrix:
        a, matrix = general(201, dtype, 64)
    else:
        a = symmetric(201)
        matrix = filled(a, dtype, 64)
    left, right = np.random.default_rng(1).normal(size=(2, 201, 5)).astype(dtype)
    numbers = np.array([0, 63, 64, 200])
    assert np.allclose(dense(matrix)[numbers], a[numbers], rtol=1e-6)
    matrix = OnDevice(matrix)
    matrix.factorize()
    truth = np.linalg.solve(a, right)
    assert np.abs(matrix.solve(right) - truth).max() < bound * np.abs(truth).max()
    groups = [slice(0, 2), slice(2, 5)]
    for group, between in zip(groups, matrix.between(left, right, groups), strict=True):
        assert np.allclose(between, left[:, group].T @ truth[:, group], atol=bound)


@pytest.mark.parametrize("formulation", ["efie", "cfie"])
def test_solution_is_that_of_the_processor(formulation, monkeypatch):
    arguments = [*outward(*octasphere(7, [0.5, 0.35, 0.4])), [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HV"], ["xz"]]
    here = solver.solve(*arguments, formulation=formulation)
    monkeypatch.setattr(solver.jax, "default_backend", lambda: "gpu")
    there = solver.solve(*arguments, formulation=formulation)
    assert there.residual[0] < 1e-5
    assert np.abs(there.field - here.field).max() < 1e-5 * np.abs(here.field).max()


def test_matrix_that_does_not_fit_is_an_error_with_a_remedy(monkeypatch):
    def exhausted(*arguments, **settings):
        raise jax.errors.JaxRuntimeError("RESOURCE_EXHAUSTED: Out of memory")

    monkeypatch.setattr("isarflow.scattering.mom.device.jax.scipy.linalg.lu_factor", exhausted)
    matrix = OnDevice(SymmetricMatrix(10, np.complex64))
    with pytest.raises(InputError, match="JAX_PLATFORMS=cpu"):
        matrix.factorize()


@pytest.mark.parametrize(
    ("backend", "unknowns", "parities", "expected"),
    [
        ("gpu", 9_000, 1, True),
        ("gpu", 11_000, 1, False),
        ("gpu", 16_000, 2, True),
        ("gpu", 18_000, 2, False),
        ("cpu", 9_000, 1, False),
    ],
)
def test_whole_matrices_are_for_a_gpu_that_holds_them(backend, unknowns, parities, expected, monkeypatch):
    class Device:
        def memory_stats(self):
            return {"bytes_limit": 3.2e9}  # 4 x 8 bytes x 10,000 x 10,000

    monkeypatch.setattr(jax, "default_backend", lambda: backend)
    monkeypatch.setattr(jax, "devices", lambda: [Device()])
    assert holds(unknowns, parities) is expected
