"""Where a surface impedance stands for an opaque body or a coating, by exact series: `make bench-surfaces`.

Spheres of a material and coated metal ones beside spheres of the impedance, over contrast, radius and thickness; and
the method of moments beside both. Writes bench-surfaces.csv and surfaces.png.
"""

from functools import partial

import matplotlib.pyplot as plt
import mie
import numpy as np
import pandas as pd
from runner import options_of
from test_dielectric import PLANES, sphere

from isarflow.core.sweep import C0
from isarflow.scattering.materials import ETA, SKIN_DEPTHS, skin_depth, surface_impedance
from isarflow.scattering.solve import solve

K = 2 * np.pi  # the wavelength is 1 m
RADII = np.linspace(0.5, 2.0, 151)
INDICES = np.linspace(1.5, 10, 35)
TANGENTS = 0.25, 0.5, 1.0
DEPTHS = np.geomspace(0.3, 6, 40)  # a sphere's radius over the skin depth
TISSUES = {"muscle": (42.8, 0.446), "skin": (31.3, 0.46), "water": (62.8, 0.477)}
COATINGS = 2.0, 3.0, 4.0, 10.0
THICKNESSES = np.geomspace(1 / 500, 1 / 20, 20)
TICKS = 1 / np.array([500, 200, 100, 50, 20])
BODIES = {
    "water, 70 - 20j": {"permittivity": 70.0, "loss_tangent": 2 / 7, "surface": "leontovich"},
    "coating, 10 - 1j, 1/100": {"permittivity": 10.0, "loss_tangent": 0.1, "thickness": 0.01, "backing": "metal"},
    "coating, 4 - 0.4j, 1/100": {"permittivity": 4.0, "loss_tangent": 0.1, "thickness": 0.01, "backing": "metal"},
}
SIZES = 0.5, 1.0, 1.5, 2.0
AROUND = np.arange(0.0, 360.0, 5.0)


def permittivity_of(material):
    return material["permittivity"] * (1 - 1j * material["loss_tangent"])


def true_of(material):
    if "surface" in material:
        return partial(mie.solid, permittivity=permittivity_of(material))
    return partial(mie.coated, permittivity=permittivity_of(material), thickness=K * material["thickness"])


def model_of(material):
    return partial(mie.opaque, impedance=surface_impedance(material, C0) / ETA)


def over(series, radii=RADII):
    return np.array([mie.to_source(K, *series(K * radius)) for radius in radii])


def off(material):
    """The largest difference over RADII, as a share of the largest of the series of what it is."""
    truth = over(true_of(material))
    return np.abs(over(model_of(material)) - truth).max() / np.abs(truth).max()


def limits():
    rows = []
    for tangent in TANGENTS:
        for index in INDICES:
            material = {
                "permittivity": index**2 / abs(1 - 1j * tangent),
                "loss_tangent": tangent,
                "surface": "leontovich",
            }
            rows.append({"what": f"tan δ {tangent:g}", "axis": "index", "x": index, "off": off(material)})
    for name, (permittivity, tangent) in TISSUES.items():
        material = {"permittivity": permittivity, "loss_tangent": tangent, "surface": "leontovich"}
        radii = DEPTHS * skin_depth(material, C0)
        truth, model = over(true_of(material), radii), over(model_of(material), radii)
        for depth, share in zip(DEPTHS, np.abs(model / truth - 1), strict=True):
            rows.append({"what": name, "axis": "depth", "x": depth, "off": share})
    for permittivity in COATINGS:
        for thickness in THICKNESSES:
            material = {"permittivity": permittivity, "loss_tangent": 0.01, "thickness": thickness, "backing": "metal"}
            rows.append({"what": f"ε {permittivity:g}", "axis": "thickness", "x": thickness, "off": off(material)})
    return pd.DataFrame(rows)


def bodies(threads):
    """Errors of the method of moments, in % of the largest backscatter or of the pattern's peak, beside both series."""
    rows, ohm = [], [surface_impedance(material, C0) for material in BODIES.values()]
    for radius in SIZES:
        how = {"receivers": (0 * AROUND, AROUND), "threads": threads, "surface_impedance": ohm, "symmetry": PLANES}
        solution = solve(*sphere(radius, 1.0), [C0] * len(ohm), [0.0], [0.0], ["VV"], **how)
        for (name, material), pattern in zip(BODIES.items(), solution.field[0, :, 0, 0], strict=True):
            _, across = mie.bistatic(K, radius, np.radians(180 - AROUND), model_of(material))
            row = {"body": name, "radius": radius, "unknowns": solution.unknowns}
            for of, series in (("series", model_of), ("material", true_of)):
                exact, largest = over(series(material), [radius])[0], np.abs(over(true_of(material))).max()
                row[of] = 100 * abs(pattern[0] - exact) / largest
            rows.append(row | {"bistatic": 100 * np.abs(pattern - across).max() / np.abs(across).max()})
    return pd.DataFrame(rows)


def draw(table, path):
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    said = {
        "index": ("refractive index", "Opaque spheres of radius 0.5 to 2 λ"),
        "depth": ("radius [skin depths]", "Small opaque spheres"),
        "thickness": ("thickness [wavelengths]", "Coated metal spheres of radius 0.5 to 2 λ"),
    }
    for ax, (axis, (label, title)) in zip(axes, said.items(), strict=True):
        for what, rows in table[table.axis == axis].groupby("what", sort=False):
            ax.plot(rows.x, 100 * rows.off, label=what)
        ax.axhline(5, color="k", lw=0.6)
        ax.set(xlabel=label, ylabel="difference [%]", title=title, yscale="log", ylim=(0.02, 100))
        ax.grid(alpha=0.3)
        ax.legend(fontsize="x-small")
    axes[1].axvline(SKIN_DEPTHS / 2, color="k", lw=0.6, ls=":")
    axes[2].set(xscale="log")
    axes[2].set_xticks(TICKS, [f"1/{1 / tick:.0f}" for tick in TICKS])
    axes[2].set_xticks([], minor=True)
    figure.savefig(path, dpi=80)


def main():
    options = options_of(__doc__, blas_threads=1)  # as in a job; the solver has threads of its own
    table = limits()
    table.to_csv(options.out / "bench-surfaces.csv", index=False)
    draw(table, options.out / "surfaces.png")
    for (axis, what), rows in table.groupby(["axis", "what"], sort=False):
        x, share = (rows.x, rows.off) if axis == "thickness" else (rows.x[::-1], rows.off[::-1])
        print(f"{axis}, {what}: off by 5 % at {x.to_numpy()[np.argmax(share.to_numpy() > 0.05)]:.4g}")
    print(bodies(options.threads).round(2).to_string(index=False))


if __name__ == "__main__":
    main()
