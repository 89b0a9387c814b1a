"""What a solve costs against what the machine can do: `make bench-scattering`.

Spheres at ten edges a wavelength, single precision. Everything in one row is measured in one process of its own, one
part after the other, so that the ratios hold whatever the machine is doing; keep it quiet all the same. Writes a table
(CSV) and a plot beside each other and prints the table and the ratios that count.
"""

import itertools
import time
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import psutil
import scipy.linalg
import threadpoolctl
from runner import in_process, options_of, peak_mb
from stored import dense

from isarflow.scattering.directions import sample
from isarflow.scattering.mom.assembly import Entries, assemble
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.mom.factorization import SymmetricMatrix
from isarflow.scattering.mom.farfield import Excitation
from isarflow.scattering.mom.operators import efie

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PLANES = {"none": [], "xz": ["xz"], "xz+yz": ["xz", "yz"]}
ELEVATION, AZIMUTH = np.arange(-45, 46, 5.0), np.arange(242) * 360 / 242  # 4,598 directions
SHOWN = (
    *("planes", "unknowns", "assembly_s", "factorization_s", "directions_s", "scipy_lu_s"),
    *("peak_mb", "matrix_mb", "residual", "scipy_residual"),
)
LARGEST_LU = 16_000  # unknowns up to which the full matrix and its LU are measured too


def octasphere(count, edge):
    """A sphere of 8 count^2 triangles with mean edge `edge`, symmetric about all coordinate planes."""
    numbers, points, triangles = {}, [], []

    def corner(sign, i, j):
        return numbers.setdefault(tuple(sign * (i, j, count - i - j)), len(numbers))

    for sign in 1 - 2 * np.array(list(np.ndindex(2, 2, 2))):
        for i, j in np.ndindex(count, count):
            if i + j < count:
                triangles.append([corner(sign, i, j), corner(sign, i + 1, j), corner(sign, i, j + 1)])
            if i + j < count - 1:
                triangles.append([corner(sign, i + 1, j), corner(sign, i + 1, j + 1), corner(sign, i, j + 1)])
    points, triangles = np.array(list(numbers), float), np.array(triangles)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    corners = points[triangles]
    return points * edge / np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).mean(), triangles


def seconds(function):
    start = time.perf_counter()
    result = function()
    return time.perf_counter() - start, result


def gemm(size, threads):
    """Gflop/s of numpy's complex64 product."""
    a = np.random.default_rng(0).random((size, size)).astype(np.complex64)
    with threadpoolctl.threadpool_limits(threads):
        a @ a
        return 8e-9 * size**3 / min(seconds(lambda: a @ a)[0] for _ in range(3))


def measure(count, planes, threads):
    """One row of the table; in a process of its own, for its peak of memory."""
    threadpoolctl.threadpool_limits(1)
    if count > 8:
        measure(8, planes, threads)  # compiles
    vertices, triangles = octasphere(count, 0.1)
    surface = fundamental_domain(vertices, triangles, PLANES[planes])
    bases = [rwg(surface, parity) for parity in surface.parities]
    k = 2 * np.pi
    row = {"planes": planes, "unknowns": sum(map(len, bases)), "directions": len(ELEVATION) * len(AZIMUTH)}

    def matrices():
        return [SymmetricMatrix(len(basis), np.complex64) for basis in bases]

    def assembled(matrices):
        entries = Entries(efie, surface, bases, k, near, np.complex64)
        assemble(entries, matrices, threads)
        return entries

    # The peak of this row alone, above what the process holds anyway.
    Path("/proc/self/clear_refs").write_text("5")
    held = psutil.Process().memory_info().rss
    row["near_pairs_s"], near = seconds(lambda: efie.near_terms(surface))
    system = matrices()
    row["assembly_s"], entries = seconds(lambda: assembled(system))
    samples = sample(surface, k, ELEVATION, AZIMUTH, np.complex64)
    excitation = Excitation(surface, bases, np.complex64)
    few = excitation(k, samples.u[:4], samples.polarizations["V"][:4])
    probed = np.linspace(0, len(bases[0]) - 1, 128).astype(int)
    probe, *_ = entries.rows([probed, *[probed[:0]] * (len(bases) - 1)])
    del entries

    def residual(x):
        return np.linalg.norm(probe @ x - few[0][probed]) / np.linalg.norm(few[0][probed])

    row["factorization_s"], _ = seconds(lambda: [matrix.factorize(threads) for matrix in system])
    row["sampled"] = len(samples.u)
    row["excitation_s"], waves = seconds(lambda: excitation(k, samples.u, samples.polarizations["V"], threads=threads))
    row["directions_s"], _ = seconds(
        lambda: [matrix.between(wave, wave, samples.rings, threads) for matrix, wave in zip(system, waves, strict=True)]
    )
    row["peak_mb"] = peak_mb() - held / 1e6
    row["matrix_mb"] = sum(block.nbytes for matrix in system for block in matrix.blocks) / 1e6
    row["right_sides_mb"] = sum(wave.nbytes for wave in waves) / 1e6
    row["residual"] = residual(system[0].solve(few[0], threads))
    row["factorization_gflops"] = 4 / 3e9 * sum(len(basis) ** 3 for basis in bases) / row["factorization_s"]
    if planes == "none" and row["unknowns"] <= LARGEST_LU:
        del system[:], waves
        refilled = matrices()
        assembled(refilled)
        full = dense(refilled.pop())
        with threadpoolctl.threadpool_limits(threads):
            row["scipy_lu_s"], lu = seconds(
                lambda: scipy.linalg.lu_factor(full.T, overwrite_a=True, check_finite=False)
            )
        row["scipy_residual"] = residual(scipy.linalg.lu_solve(lu, few[0]))
    return row


def ratios(table):
    """Per number of unknowns: parts of a solve beside scipy's LU and each other, and what mirror planes save."""
    none = table[table.planes == "none"].set_index("unknowns")
    found = {
        "assembly / LU": (none.near_pairs_s + none.assembly_s) / none.scipy_lu_s if "scipy_lu_s" in none else None,
        "factorization / LU": none.factorization_s / none.scipy_lu_s if "scipy_lu_s" in none else None,
        "directions / factorization": (none.excitation_s + none.directions_s) / none.factorization_s,
        "peak / (matrix + right sides)": none.peak_mb / (none.matrix_mb + none.right_sides_mb),
    }
    for planes, rows in table[table.planes != "none"].groupby("planes"):
        rows = rows.set_index("unknowns")
        found[f"factorization saved by {planes}"] = none.factorization_s / rows.factorization_s
        found[f"matrix of {planes}"] = rows.matrix_mb / none.matrix_mb
    return pd.DataFrame({name: values for name, values in found.items() if values is not None}).round(2)


def _text(value):
    return "" if value is None else value if isinstance(value, str) else f"{value:.4g}"


def plot(table, limit, path):
    parts = {"assembly": ["near_pairs_s", "assembly_s"], "factorization": ["factorization_s"]}
    parts["directions"] = ["excitation_s", "directions_s"]
    lines = dict(zip(parts, ("--", "-", ":"), strict=True))
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
    for color, (planes, rows) in zip(("C0", "C1", "C2"), table.groupby("planes", sort=False), strict=False):
        for part, columns in parts.items():
            axes[0].plot(rows.unknowns, rows[columns].sum(axis=1), lines[part], color=color, marker="o", markersize=4)
        axes[1].plot(rows.unknowns, rows.matrix_mb, color=color, marker="o", markersize=4)
        axes[1].plot(rows.unknowns, rows.peak_mb, ":", color=color)
        axes[1].plot([], [], color=color, marker="o", markersize=4, label=f"mirror planes: {planes}")
    if "scipy_lu_s" in table:
        axes[0].plot(table.unknowns, table.scipy_lu_s, "kx", label="scipy's LU, no mirror planes")
    n = np.array([table.unknowns.min(), table.unknowns.max()], float)
    axes[0].plot(n, 4 / 3e9 * n**3 / limit, "k", lw=1, label="4/3 N³ at the speed of products")
    for part, line in lines.items():
        axes[0].plot([], [], line, color="grey", label=part)
    axes[1].plot([], [], "-", color="grey", label="stored matrix")
    axes[1].plot([], [], ":", color="grey", label="peak of the process, less what it held before")
    axes[0].set(xlabel="unknowns N", ylabel="time [s]")
    axes[1].set(xlabel="unknowns N", ylabel="memory [MB]")
    for ax in axes:
        ax.set(xscale="log", yscale="log")
        ax.set_xticks([2000, 5000, 10_000, 20_000, 30_000], ["2,000", "5,000", "10,000", "20,000", "30,000"])
        ax.set_xticks([], minor=True)
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    figure.savefig(path, dpi=120)


def main():
    counts = {"type": int, "nargs": "+", "default": [13, 20, 28, 32, 38, 45, 50], "help": "8 count^2 triangles each"}
    planes = {"nargs": "+", "choices": PLANES, "default": list(PLANES)}
    options = options_of(__doc__, blas_threads=1, counts=counts, planes=planes)
    limit = gemm(4096, options.threads)
    print(f"complex64 product, {options.threads} threads: {limit:.0f} Gflop/s")
    print(" ".join(f"{name:>16}" for name in SHOWN))
    rows = []
    for count, planes in itertools.product(options.counts, options.planes):
        rows.append(in_process(measure, count, planes, options.threads) | {"product_gflops": limit})
        print(" ".join(f"{_text(rows[-1].get(name)):>16}" for name in SHOWN), flush=True)
    table = pd.DataFrame(rows)
    print(ratios(table).to_string())
    table.to_csv(options.out / "scattering.csv", index=False)
    plot(table, limit, options.out / "scattering.png")


if __name__ == "__main__":
    main()
