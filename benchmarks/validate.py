"""The solver and the image formation beside closed forms, as figures: `make validate`.

Backscatter of a conducting sphere over its size, by both integral equations, and at an interior resonance; the
bistatic pattern; the error over the edge length; and what the three ways to form images make of a point scatterer.
Truth for the sphere: the Mie series of tests/scattering/mie.py. Tables and figures go to results/benchmarks/.
"""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mie
import numpy as np
import pandas as pd
from runner import options_of
from stored import dense
from test_truth import ANGLES, pattern

from isarflow.core.sweep import C0
from isarflow.imaging.formation import build_imager
from isarflow.imaging.point_response import point_response
from isarflow.scattering.directions import directions
from isarflow.scattering.mom.assembly import Entries, assemble
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.mom.factorization import GeneralMatrix, SymmetricMatrix
from isarflow.scattering.mom.farfield import Excitation
from isarflow.scattering.solve import OPERATORS, solve

K = 2 * np.pi  # wavelength 1 m
EDGE = 0.1  # m
SIZES = np.concatenate([np.linspace(0.3, 3.0, 19), np.linspace(3.25, 6.5, 14)])  # ka
RESONANCE = 2.744  # ka of a spherical cavity: the first zero of (x j_1)'
EDGES = (0.2, 0.14, 0.1, 0.07, 0.05)  # wavelengths, for the sphere of radius CONVERGED
CONVERGED = 0.3  # wavelengths
STYLES = {"efie": ("C0", "o"), "cfie": ("C1", "s")}
PLACES = {"beside the origin": (0.15, 0.1), "far from it": (0.45, -0.25)}  # range and cross-range in m


def decibel(ratio):
    return 20 * np.log10(np.abs(ratio))


def backscatter(threads):
    """The error of both equations over ka, at ten edges a wavelength or six a radius, whichever is finer."""
    rows = []
    for size in SIZES:
        radius = size / K
        vertices, triangles = mie.icosphere(radius, min(EDGE, radius / 6))
        for formulation in STYLES:
            # Off the mesh's axes of symmetry.
            solution = solve(
                vertices, triangles, [C0], [20.0], [10.0], ["VV"], threads=threads, formulation=formulation
            )
            ratio = solution.field[0, 0, 0, 0] / mie.backscatter(K, radius)
            rows.append(
                {
                    "ka": size,
                    "formulation": formulation,
                    "unknowns": solution.unknowns,
                    "rcs_over_area": 4 * abs(solution.field[0, 0, 0, 0]) ** 2 / radius**2,
                    "error_db": decibel(ratio),
                    "phase_deg": np.degrees(np.angle(ratio)),
                    "residual": solution.residual[0],
                }
            )
    return pd.DataFrame(rows)


def resonance():
    """Condition number and error of both equations on one mesh, at wavenumbers about its interior resonance."""
    radius = RESONANCE / K
    vertices, triangles = mie.icosphere(radius, EDGE)
    surface = fundamental_domain(vertices, triangles, ())
    bases = [rwg(surface, surface.parities[0])]
    near = {formulation: operator.near_terms(surface) for formulation, operator in OPERATORS.items()}
    u, _, h = (x.reshape(1, 3) for x in directions([20.0], [10.0]))
    rows = []
    for size in np.unique(np.concatenate([np.linspace(2.70, 2.79, 10), np.linspace(2.7420, 2.7456, 13)])):
        k = size / radius
        for formulation, operator in OPERATORS.items():
            stored = (SymmetricMatrix if operator.SYMMETRIC else GeneralMatrix)(len(bases[0]), np.complex128)
            assemble(Entries(operator, surface, bases, k, near[formulation], np.complex128), [stored])
            matrix = dense(stored)
            received, excited = (
                Excitation(surface, bases, np.complex128)(k, u, h, alpha)[0] for alpha in (1, operator.ALPHA)
            )
            field = -(received.T @ np.linalg.solve(matrix, excited))[0, 0]
            error = decibel(field / mie.backscatter(k, radius))
            condition = np.linalg.cond(matrix)
            rows.append({"ka": size, "formulation": formulation, "condition": condition, "error_db": error})
    return pd.DataFrame(rows)


def bistatic():
    """Amplitudes of a sphere of one wavelength's radius in both planes, computed and by Mie, over ANGLES."""
    travel = np.array([np.sin(0.5) * np.cos(0.3), np.sin(0.5) * np.sin(0.3), np.cos(0.5)])
    across = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    computed = pattern(*mie.icosphere(1.0, EDGE), travel, across)
    truth = mie.bistatic(K, 1.0, ANGLES)
    table = pd.DataFrame({"angle": np.degrees(ANGLES)})
    for plane, field, exact in zip(("theta", "phi"), computed, truth, strict=True):
        table[f"rcs_{plane}_db"], table[f"mie_{plane}_db"] = (
            decibel(f) + 10 * np.log10(4 * np.pi) for f in (field, exact)
        )
        table[f"error_{plane}"] = np.abs(field - exact) / np.abs(exact).max()
    return table


def convergence(threads):
    """The largest relative error of the backscatter over directions and polarizations, by the mean edge."""
    rows = []
    for wanted in EDGES:
        vertices, triangles = mie.icosphere(CONVERGED, wanted)
        edge = np.linalg.norm(vertices[triangles[:, 0]] - vertices[triangles[:, 1]], axis=1).mean()
        for formulation in STYLES:
            solution = solve(
                vertices,
                triangles,
                [C0],
                [0.0, 35.0],
                np.arange(0.0, 360.0, 45.0),
                ["VV", "HH"],
                precision="double",
                threads=threads,
                formulation=formulation,
            )
            error = np.abs(solution.field / mie.backscatter(K, CONVERGED) - 1).max()
            rows.append({"edge": edge, "formulation": formulation, "unknowns": solution.unknowns, "error": error})
    return pd.DataFrame(rows)


def draw_sphere(table, near, path):
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    size = np.linspace(SIZES[0], SIZES[-1], 600)
    exact = [4 * abs(mie.backscatter(K, x / K)) ** 2 / (x / K) ** 2 for x in size]
    axes[0].plot(size, exact, "k", lw=1, label="Mie")
    for formulation, (color, marker) in STYLES.items():
        rows, close = (one[one.formulation == formulation] for one in (table, near))
        style = {"color": color, "marker": marker, "markersize": 4, "fillstyle": "none", "label": formulation}
        axes[0].plot(rows.ka, rows.rcs_over_area, linestyle="", **style)
        axes[1].plot(rows.ka, rows.error_db, lw=1, **style)
        axes[2].plot(close.ka, close.condition, lw=1, **style)
    axes[0].set(xlabel="ka", ylabel="RCS / (π a²)", yscale="log", title="Backscatter of a PEC sphere")
    axes[1].set(xlabel="ka", ylabel="error against Mie [dB]", title="Error of the backscatter")
    axes[2].set(xlabel="ka", ylabel="condition number", yscale="log", title="At an interior resonance")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    figure.savefig(path, dpi=100)


def draw_pattern(pattern_table, convergence_table, path):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained", width_ratios=[1.6, 1])
    for color, plane, words in (("C0", "theta", "E in the plane"), ("C3", "phi", "E across the plane")):
        axes[0].plot(pattern_table.angle, pattern_table[f"mie_{plane}_db"], "k", lw=1)
        axes[0].plot(
            pattern_table.angle[::3],
            pattern_table[f"rcs_{plane}_db"][::3],
            f"{color}",
            ls="",
            marker="o",
            ms=3,
            label=words,
        )
    axes[0].plot([], [], "k", lw=1, label="Mie")
    axes[0].set(xlabel="angle from the direction of travel [degrees]", ylabel="bistatic RCS [dBsm]")
    axes[0].set_title("Sphere of one wavelength's radius (wavelength 1 m)")
    for formulation, (color, marker) in STYLES.items():
        rows = convergence_table[convergence_table.formulation == formulation]
        axes[1].plot(rows.edge, 100 * rows.error, color=color, marker=marker, fillstyle="none", label=formulation)
    edge = np.array([0.05, 0.2])
    first = convergence_table[convergence_table.formulation == "efie"].iloc[0]
    axes[1].plot(edge, 100 * first.error * (edge / first.edge) ** 2, "k:", label="second order")
    axes[1].set(xscale="log", yscale="log", xlabel="mean edge [wavelengths]", ylabel="error of the amplitude [%]")
    axes[1].set_xticks(EDGES, [f"{e:g}" for e in EDGES])
    axes[1].set_xticks([], minor=True)
    axes[1].set_yticks([0.2, 0.5, 1, 2, 4], ["0.2", "0.5", "1", "2", "4"])
    axes[1].set_yticks([], minor=True)
    axes[1].set_title("Radius 0.3 wavelengths, refined")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    figure.savefig(path, dpi=100)


def point(path):
    """Images of two scatterers of amplitude 1 by all three ways, and their figures of merit, as a table."""
    frequency, angle = np.linspace(4.05e9, 7.05e9, 27), np.radians(360 / 242) * (np.arange(21) - 10)
    imaging = {"imager": "fourier", "aperture": 21, "window": "hamming", "upsample": "none"}
    k = 2 * np.pi * frequency / C0
    figure, axes = plt.subplots(2, 3, figsize=(9.5, 6.5), layout="constrained", sharex=True, sharey=True)
    rows = []
    for column, reformat in enumerate(("none", "polar", "exact")):
        imager = build_imager(frequency, angle, imaging | {"reformat": reformat})
        down, cross = (np.linspace(axis[0], -axis[0], 161) for axis in imager.axes())
        form = imager.at(down, cross)
        for ax, (words, (r, c)) in zip(axes[:, column], PLACES.items(), strict=True):
            echo = np.exp(2j * np.outer(k, -np.cos(angle) * r + np.sin(angle) * c)).astype(np.complex64)
            image = decibel(form(echo[None])[0] + 1e-6)
            shown = ax.imshow(image, vmin=-40, vmax=0, origin="lower", extent=(cross[0], cross[-1], down[0], down[-1]))
            ax.plot(c, r, "o", ms=14, mfc="none", mec="w", mew=0.8)
            ax.set_title(f"{reformat}, {words}", fontsize="medium")
            figures = point_response(imager, [r], [c])
            rows.append({"reformat": reformat, "place": words, **{name: v[0, 0] for name, v in figures.items()}})
    for ax in axes[-1]:
        ax.set_xlabel("cross-range [m]")
    for ax in axes[:, 0]:
        ax.set_ylabel("range [m]")
    figure.colorbar(shown, ax=axes, shrink=0.7, label="dB of the scatterer's amplitude")
    figure.savefig(path, dpi=80)
    return pd.DataFrame(rows)


def main():
    options = options_of(__doc__, blas_threads=1)  # as in a job; the solver has threads of its own

    points = point(options.out / "validate-point.png")
    print("A point scatterer at the reference sweep:\n", points.round(2).to_string(index=False), sep="")
    refined = convergence(options.threads)
    print(f"Sphere, radius {CONVERGED} wavelengths:\n", refined.round(4).to_string(index=False), sep="")
    for formulation, rows in refined.groupby("formulation"):
        print(f"{formulation}: order {np.polyfit(np.log(rows.edge), np.log(rows.error), 1)[0]:.2f}")
    angles = bistatic()
    for plane in ("theta", "phi"):
        strong = angles[f"mie_{plane}_db"] > angles[f"mie_{plane}_db"].max() - 20
        off = (angles[f"rcs_{plane}_db"] - angles[f"mie_{plane}_db"])[strong].abs().max()
        print(
            f"pattern, E along {plane}: {off:.3f} dB within 20 dB of the peak, "
            f"{100 * angles[f'error_{plane}'].max():.3f} % of the peak anywhere"
        )
    draw_pattern(angles, refined, options.out / "validate-pattern.png")
    table = backscatter(options.threads)
    for formulation, rows in table.groupby("formulation"):
        worst = rows.loc[rows.error_db.abs().idxmax()]
        print(
            f"backscatter, {formulation}: {len(rows)} sizes from ka {SIZES[0]:g} to {SIZES[-1]:g}, at most "
            f"{rows.unknowns.max()} unknowns; error {rows.error_db.abs().median():.3f} dB at the median, "
            f"{abs(worst.error_db):.3f} dB at most (ka {worst.ka:.3g}); phase {rows.phase_deg.abs().max():.2f} degrees"
        )
    close = resonance()
    for formulation, rows in close.groupby("formulation"):
        top = rows.loc[rows.condition.idxmax()]
        print(
            f"resonance, {formulation}: condition number {rows.condition.min():.3g} to {top.condition:.3g} "
            f"(ka {top.ka:.4f}); error {rows.error_db.abs().max():.3f} dB at most"
        )
    draw_sphere(table, close, options.out / "validate-sphere.png")
    found = {"point": points, "refinement": refined, "pattern": angles, "sphere": table, "resonance": close}
    for name, rows in found.items():
        rows.to_csv(options.out / f"validate-{name}.csv", index=False)


if __name__ == "__main__":
    main()
