"""Spherical shells of thin materials beside their exact series, and how thick a sheet may be: `make bench-sheets`.

The shells' backscatter over their radius, in wavelengths, by the method of moments and by the sheet's series; that of
a dielectric's sheet beside that of the layer, which is polarized across, too; and sheets beside slabs. Writes
bench-sheets.csv, bench-thickness.csv and sheets.png.
"""

import time
from functools import partial

import matplotlib.pyplot as plt
import mie
import numpy as np
import pandas as pd
from runner import options_of

from isarflow.core.sweep import C0
from isarflow.scattering.materials import ETA, impedance
from isarflow.scattering.solve import solve

K = 2 * np.pi  # the wavelength is 1 m
EDGE = 0.1
SIZES = np.arange(0.1, 1.01, 0.1)
FINER = 0.5, 0.05  # a radius that is also solved with shorter edges, and these
RADII = np.linspace(0.5, 2.0, 151)  # of the comparison of series
THICKNESSES = np.geomspace(1 / 500, 1 / 20, 15)
TICKS = 1 / np.array([500, 200, 100, 50, 20])
SHELLS = {
    "100 ohm": {"resistance": 100.0},
    "377 ohm": {"resistance": 377.0},
    "ε 2.9, λ/100": {"permittivity": 2.9, "loss_tangent": 0.01, "thickness": 1 / 100},
    "ε 3, λ/30": {"permittivity": 3.0, "loss_tangent": 0.0, "thickness": 1 / 30},
}
AROUND = np.arange(0.0, 360.0, 5.0)


def sheet_of(material):
    return partial(mie.sheet, impedance=impedance(material, C0) / ETA)


def layer_of(material):
    permittivity = material["permittivity"] * (1 - 1j * material["loss_tangent"])
    return partial(mie.layer, permittivity=permittivity, thickness=K * material["thickness"])


def over_radii(series, radii):
    return np.array([mie.to_source(K, *series(K * radius)) for radius in radii])


def shells(threads):
    """Errors of every shell's backscatter and bistatic pattern, as shares of the largest of its series, by radius."""
    largest = {name: np.abs(over_radii(sheet_of(one), RADII)).max() for name, one in SHELLS.items()}
    ohm, rows = [impedance(material, C0) for material in SHELLS.values()], []
    for radius, edge in [*((radius, EDGE) for radius in SIZES), FINER]:
        mesh = mie.icosphere(radius, edge)
        how = {"receivers": (0 * AROUND, AROUND), "threads": threads, "impedance": ohm}
        field = solve(*mesh, [C0] * len(ohm), [0.0], [0.0], ["VV"], **how).field[0, :, 0, 0]
        for (name, material), pattern in zip(SHELLS.items(), field, strict=True):
            exact, (_, across) = (
                over_radii(sheet_of(material), [radius])[0],
                mie.bistatic(K, radius, np.radians(180 - AROUND), sheet_of(material)),
            )
            row = {"shell": name, "radius": radius, "edge": edge, "amplitude": abs(pattern[0]), "series": abs(exact)}
            row["error"] = abs(pattern[0] - exact) / largest[name]
            row["bistatic"] = np.abs(pattern - across).max() / np.abs(across).max()
            rows.append(row)
    return pd.DataFrame(rows)


def slab(permittivity, thickness, angle, is_magnetic):
    """Reflection and transmission of a slab about its middle by Airy's formula; is_magnetic: H is across the plane."""
    cosine, inside = np.cos(angle), np.sqrt(permittivity - np.sin(angle) ** 2 + 0j)
    outer, inner = (cosine, inside / permittivity) if is_magnetic else (1 / cosine, 1 / inside)
    step, turn = (inner - outer) / (inner + outer), np.exp(-2j * K * thickness * inside)
    both = np.array([step * (1 - turn), (1 - step**2) * turn**0.5]) / (1 - step**2 * turn)
    return both * np.exp(1j * K * thickness * cosine)


def of_sheet(ohm, angle, is_magnetic):
    """Reflection and transmission of a sheet."""
    outer = np.cos(angle) if is_magnetic else 1 / np.cos(angle)
    reflected = -outer / (outer + 2 * ohm / ETA)
    return np.array([reflected, 1 + reflected])


def thickness():
    """What a sheet lacks by the thickness of its dielectric: on spheres, and of slabs at 0 and 60 degrees."""
    rows = []
    for permittivity in (2.0, 3.0, 4.0):
        for t in THICKNESSES:
            material = {"permittivity": permittivity, "loss_tangent": 0.0, "thickness": t}
            thin, exact = (over_radii(of(material), RADII) for of in (sheet_of, layer_of))
            row = {"permittivity": permittivity, "thickness": t}
            row["sphere"] = np.abs(thin - exact).max() / np.abs(exact).max()
            for name, (angle, is_magnetic) in {"normal": (0, False), "E": (60, False), "H": (60, True)}.items():
                way = np.radians(angle), is_magnetic
                difference = slab(permittivity, t, *way) - of_sheet(impedance(material, C0), *way)
                row[name] = np.abs(difference).max()
            rows.append(row)
    return pd.DataFrame(rows)


def cost(threads):
    """Processor time of a resistive shell's solve over that of a metal one's, the least of four each."""
    mesh, seconds = mie.icosphere(0.5, 0.05), {0.0: [], 377.0: []}
    for _ in range(4):  # the first loads compiled code
        for ohm, times in seconds.items():
            start = time.process_time()
            solve(*mesh, [C0], [0.0], AROUND, threads=threads, impedance=ohm)
            times.append(time.process_time() - start)
    return min(seconds[377.0]) / min(seconds[0.0])


def draw(table, thick, path):
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    fine = np.linspace(SIZES[0], SIZES[-1], 200)
    usual = table[table.edge == EDGE]
    for color, (name, material) in zip(("C0", "C1", "C2", "C3"), SHELLS.items(), strict=True):
        rows = usual[usual.shell == name]
        axes[0].plot(fine, np.abs(over_radii(sheet_of(material), fine)), color, lw=1)
        if "permittivity" in material:
            axes[0].plot(fine, np.abs(over_radii(layer_of(material), fine)), color, lw=1, ls=":")
        axes[0].plot(rows.radius, rows.amplitude, color, ls="", marker="o", ms=4, fillstyle="none", label=name)
        axes[1].plot(rows.radius, 100 * rows.error, color, marker="o", ms=4, fillstyle="none", label=name)
    axes[0].set(xlabel="radius [wavelengths]", ylabel="|f| [wavelengths]", title="Shells: solver, sheet —, layer ···")
    axes[1].set(xlabel="radius [wavelengths]", ylabel="error [% of the largest]", title="Solver against the sheet")
    for color, (permittivity, rows) in zip(("C0", "C2", "C3"), thick.groupby("permittivity"), strict=True):
        axes[2].plot(rows.thickness, 100 * rows.sphere, color, label=f"shells, ε {permittivity:g}")
        axes[2].plot(rows.thickness, 100 * rows.H, color, ls=":", label=f"slab, 60°, ε {permittivity:g}")
        axes[2].plot(rows.thickness, 100 * rows.normal, color, ls="--", label=f"slab, 0°, ε {permittivity:g}")
    axes[2].axhline(5, color="k", lw=0.6)
    axes[2].set(xscale="log", yscale="log", ylim=(0.05, 30), xlabel="thickness [wavelengths]", ylabel="difference [%]")
    axes[2].set_xticks(TICKS, [f"1/{1 / tick:.0f}" for tick in TICKS])
    axes[2].set_xticks([], minor=True)
    axes[2].set_title("Sheet against dielectric")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.legend(fontsize="x-small")
    figure.savefig(path, dpi=80)


def main():
    options = options_of(__doc__, blas_threads=1)  # as in a job; the solver has threads of its own
    table, thick = shells(options.threads), thickness()
    print(table.round(5).to_string(index=False))
    print(thick.round(4).to_string(index=False))
    for permittivity, rows in thick.groupby("permittivity"):
        at = np.exp(np.interp(np.log(0.05), np.log(rows.sphere), np.log(rows.thickness)))
        print(f"permittivity {permittivity:g}: shells are off by 5 % of the largest at 1/{1 / at:.0f} wavelength")
    print(f"a resistive sheet takes {cost(options.threads):.3f} times the time of metal")
    draw(table, thick, options.out / "sheets.png")
    table.to_csv(options.out / "bench-sheets.csv", index=False)
    thick.to_csv(options.out / "bench-thickness.csv", index=False)


if __name__ == "__main__":
    main()
