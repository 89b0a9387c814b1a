"""Spherical shells of thin materials beside their exact series, and how thick a sheet may be: `make bench-sheets`.

The shells' backscatter over their radius, in wavelengths, by the method of moments and by the series of the resistive
sheet or of the dielectric layer; by series alone sheets with and without a current across them beside layers and slabs.
Writes bench-sheets.csv, bench-thickness.csv and sheets.png.
"""

import time
from functools import partial

import matplotlib.pyplot as plt
import mie
import numpy as np
import pandas as pd
from runner import options_of

from isarflow.core.sweep import C0
from isarflow.scattering.materials import ETA, impedance, normal_impedance, permittivity
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


def layer_of(material, series=mie.layer):
    return partial(series, permittivity=permittivity(material), thickness=K * material["thickness"])


def exact(material):
    return layer_of(material) if "permittivity" in material else sheet_of(material)


def over_radii(series, radii):
    return np.array([mie.to_source(K, *series(K * radius)) for radius in radii])


def shells(threads):
    """Errors of every shell's backscatter and bistatic pattern, as shares of the largest of its series, by radius.

    `tangential`: of a dielectric's sheet without the current across it.
    """
    largest, rows = {name: np.abs(over_radii(exact(one), RADII)).max() for name, one in SHELLS.items()}, []
    for radius, edge in [*((radius, EDGE) for radius in SIZES), FINER]:
        mesh = mie.icosphere(radius, edge)
        for name, material in SHELLS.items():
            (truth,) = over_radii(exact(material), [radius])
            _, across = mie.bistatic(K, radius, np.radians(180 - AROUND), exact(material))

            def pattern(material, normal, mesh=mesh):
                how = {"receivers": (0 * AROUND, AROUND), "threads": threads, "impedance": impedance(material, C0)}
                return solve(*mesh, [C0], [0.0], [0.0], ["VV"], normal_impedance=normal, **how).field[0, 0, 0, 0]

            found = pattern(material, normal_impedance(material, C0))
            row = {"shell": name, "radius": radius, "edge": edge, "amplitude": abs(found[0]), "series": abs(truth)}
            row["error"] = abs(found[0] - truth) / largest[name]
            row["bistatic"] = np.abs(found - across).max() / np.abs(across).max()
            if "permittivity" in material:
                row["tangential"] = abs(pattern(material, 0)[0] - truth) / largest[name]
            rows.append(row)
    return pd.DataFrame(rows)


def slab(permittivity, thickness, angle, is_magnetic):
    """Reflection and transmission of a slab about its middle by Airy's formula; is_magnetic: H is across the plane."""
    cosine, inside = np.cos(angle), np.sqrt(permittivity - np.sin(angle) ** 2 + 0j)
    outer, inner = (cosine, inside / permittivity) if is_magnetic else (1 / cosine, 1 / inside)
    step, turn = (inner - outer) / (inner + outer), np.exp(-2j * K * thickness * inside)
    both = np.array([step * (1 - turn), (1 - step**2) * turn**0.5]) / (1 - step**2 * turn)
    return both * np.exp(1j * K * thickness * cosine)


def of_sheet(material, angle, is_magnetic, has_normal):
    """Reflection and transmission of a dielectric's sheet, with or without a current across it.

    That current is a layer of magnetic current, the dual of a sheet's: it scatters the other field evenly.
    """
    outer = np.cos(angle) if is_magnetic else 1 / np.cos(angle)
    even = outer / (outer + 2 * impedance(material, C0) / ETA)
    across = normal_impedance(material, C0) / ETA * np.cos(angle) / np.sin(angle) ** 2 if angle else np.inf
    odd = 1 / (1 + 2 * across) if is_magnetic and has_normal else 0.0
    return np.array([odd - even, 1 - odd - even])


def thickness():
    """What a sheet lacks by the thickness of its dielectric: on spheres, and of slabs at 0 and 60 degrees."""
    rows = []
    for eps in (2.0, 3.0, 4.0):
        for t in THICKNESSES:
            material = {"permittivity": eps, "loss_tangent": 0.0, "thickness": t}
            layer, thin, whole = (
                over_radii(series, RADII)
                for series in (layer_of(material), sheet_of(material), layer_of(material, mie.dielectric_sheet))
            )
            row = {"permittivity": eps, "thickness": t}
            row["tangential"], row["sphere"] = (np.abs(of - layer).max() / np.abs(layer).max() for of in (thin, whole))
            for name, (angle, is_magnetic) in {"slab": (0, False), "E": (60, False), "H": (60, True)}.items():
                way = np.radians(angle), is_magnetic
                row[name] = np.abs(slab(eps, t, *way) - of_sheet(material, *way, True)).max()
            row["tangential_H"] = np.abs(slab(eps, t, *way) - of_sheet(material, *way, False)).max()
            rows.append(row)
    return pd.DataFrame(rows)


def cost(threads):
    """Processor time of resistive and dielectric shells' solves over that of metal's, the least of four each."""
    mesh, plastic = mie.icosphere(0.5, 0.05), SHELLS["ε 2.9, λ/100"]
    kinds = {
        "metal": {},
        "a resistive sheet": {"impedance": 377.0},
        "a dielectric sheet": {"impedance": impedance(plastic, C0), "normal_impedance": normal_impedance(plastic, C0)},
    }
    seconds = {name: [] for name in kinds}
    for _ in range(4):  # the first loads compiled code
        for name, material in kinds.items():
            start = time.process_time()
            solve(*mesh, [C0], [0.0], AROUND, threads=threads, **material)
            seconds[name].append(time.process_time() - start)
    return {name: min(times) / min(seconds["metal"]) for name, times in seconds.items()}


def draw(table, thick, path):
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    fine = np.linspace(SIZES[0], SIZES[-1], 200)
    usual = table[table.edge == EDGE]
    for color, (name, material) in zip(("C0", "C1", "C2", "C3"), SHELLS.items(), strict=True):
        rows = usual[usual.shell == name]
        axes[0].plot(fine, np.abs(over_radii(exact(material), fine)), color, lw=1)
        axes[0].plot(rows.radius, rows.amplitude, color, ls="", marker="o", ms=4, fillstyle="none", label=name)
        axes[1].plot(rows.radius, 100 * rows.error, color, marker="o", ms=4, fillstyle="none", label=name)
        if "permittivity" in material:
            axes[1].plot(rows.radius, 100 * rows.tangential, color, ls=":")
    axes[0].set(xlabel="radius [wavelengths]", ylabel="|f| [wavelengths]", title="Shells: solver, and exact series —")
    axes[1].set(xlabel="radius [wavelengths]", ylabel="error [% of the largest]", yscale="log", title="Solver's error")
    for color, (eps, rows) in zip(("C0", "C2", "C3"), thick.groupby("permittivity"), strict=True):
        axes[2].plot(rows.thickness, 100 * rows.sphere, color, label=f"shells, ε {eps:g}")
        axes[2].plot(rows.thickness, 100 * rows.tangential, color, ls=":")
        axes[2].plot(rows.thickness, 100 * rows.H, color, ls="--")
    axes[2].axhline(5, color="k", lw=0.6)
    axes[2].plot([], [], "k--", label="slabs, at 60°")
    for ax in axes[1:]:
        ax.plot([], [], "k:", label="without the current across")
    axes[2].set(xscale="log", yscale="log", ylim=(0.01, 40), xlabel="thickness [wavelengths]", ylabel="difference [%]")
    axes[2].set_xticks(TICKS, [f"1/{1 / tick:.0f}" for tick in TICKS])
    axes[2].set_xticks([], minor=True)
    axes[2].set_title("Sheet against dielectric, by series")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.legend(fontsize="x-small")
    figure.savefig(path, dpi=80)


def main():
    options = options_of(__doc__, blas_threads=1)  # as in a job; the solver has threads of its own
    table, thick = shells(options.threads), thickness()
    print(table.round(5).to_string(index=False))
    print(thick.round(4).to_string(index=False))
    for eps, rows in thick.groupby("permittivity"):
        for how in ("tangential", "sphere"):
            at = np.exp(np.interp(np.log(0.05), np.log(rows[how]), np.log(rows.thickness)))
            print(f"permittivity {eps:g}: {how} shells are off by 5 % of the largest at 1/{1 / at:.0f} wavelength")
    for name, ratio in cost(options.threads).items():
        print(f"{name} takes {ratio:.3f} times the time of metal")
    draw(table, thick, options.out / "sheets.png")
    table.to_csv(options.out / "bench-sheets.csv", index=False)
    thick.to_csv(options.out / "bench-thickness.csv", index=False)


if __name__ == "__main__":
    main()
