"""Assembly and solution of a sphere's EFIE by bempp-cl: `bench_bempp.py` runs this in the peer's own environment.

usage: python peer_bempp.py SPHERE.npz RESULT.json
"""

import json
import sys
import time

import bempp_cl.api as bempp
import numpy as np


def main(sphere, result):
    mesh = np.load(sphere)
    k = float(mesh["wavenumber"])
    grid = bempp.Grid(mesh["vertices"].T.copy(), mesh["triangles"].T.astype(np.uint32))
    rwg, snc = bempp.function_space(grid, "RWG", 0), bempp.function_space(grid, "SNC", 0)
    times = []
    for _ in range(2):  # the second without compilation
        start = time.perf_counter()
        operator = bempp.operators.boundary.maxwell.electric_field(rwg, rwg, snc, k)
        matrix = bempp.as_matrix(operator.weak_form())
        times.append(time.perf_counter() - start)

    @bempp.complex_callable
    def trace(x, n, domain_index, value):
        # x-polarized wave that travels along -z
        value[:] = np.cross([np.exp(-1j * k * x[2]), 0, 0], n)

    right = bempp.GridFunction(rwg, fun=trace, dual_space=snc).projections(snc)
    start = time.perf_counter()
    current = bempp.GridFunction(rwg, coefficients=np.linalg.solve(matrix, right))
    solution = time.perf_counter() - start
    towards = np.array([[0.0], [0.0], [1.0]])
    field = bempp.operators.far_field.maxwell.electric_field(rwg, towards, k) * current
    report = {
        "unknowns": rwg.global_dof_count,
        "assembly_cold_s": times[0],
        "assembly_s": times[1],
        "solution_s": solution,
        "amplitude_m": float(np.linalg.norm(field)),
    }
    with open(result, "w") as file:
        json.dump(report, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
