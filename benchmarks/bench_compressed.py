"""Compressed matrices beside whole ones: `make bench-compressed`.

Time and memory over the number of unknowns (spheres, every solve in a process of its own), beside what the plan says;
shapes that compress badly, as all in them is near something else; error, memory and time over the tolerance (a target
of the default experiment at its highest frequency); and, with --sphere, the bistatic pattern of a large sphere without
mirror planes beside the Mie series. Tables (CSV) and figures go to results/benchmarks/; rows that a table holds already
are not measured again.
"""

import json
import time
from pathlib import Path

import matplotlib
import mie
import numpy as np
import pandas as pd
import threadpoolctl
from bench_scattering import PLANES, octasphere
from runner import in_process, options_of, peak_mb, show
from test_solve import sheet, weld

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep
from isarflow.mesh.io import read_ply
from isarflow.scattering.costs import planned
from isarflow.scattering.mom.assembly import Entries
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.mom.cross import fill
from isarflow.scattering.mom.farfield import Excitation
from isarflow.scattering.mom.lowrank import LowRankMatrix
from isarflow.scattering.mom.operators import efie
from isarflow.scattering.solve import PARTS, TILE_SHARE, _residual, solve

matplotlib.use("Agg")
import matplotlib.pyplot as plt

K = 2 * np.pi  # wavelength 1 m
ELEVATION, AZIMUTH = np.arange(-45, 46, 5.0), np.arange(242) * 360 / 242  # 4,598 directions
COUNTS = {"none": [13, 18, 25, 32, 40], "xz": [18, 25, 36, 50], "xz+yz": [25, 36, 50, 71, 100]}
LARGEST_WHOLE = {"none": 20_000, "xz": 31_000, "xz+yz": 61_000}  # unknowns up to which whole matrices are measured
TOLERANCES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
TOLERANCE = 1e-5
OF_SPHERE = 1e-4  # of the large sphere: at 1e-5 the factors of 200,000 unknowns take more than 24 GB


def measured(vertices, triangles, frequency, symmetry, tolerance, threads, polarizations=("VV",)):
    """A row of what one solve takes and was planned to take; and its field."""
    threadpoolctl.threadpool_limits(1)
    # What is compiled for one target serves the next.
    solve(*octasphere(8, 0.1), [C0], [0.0], [0.0, 90.0], polarizations, symmetry, threads=threads)
    start = time.perf_counter()
    asked = [frequency], ELEVATION, AZIMUTH, polarizations
    solution = solve(vertices, triangles, *asked, symmetry, threads=threads, tolerance=tolerance)
    seconds = time.perf_counter() - start
    sweep = Sweep(np.array([frequency]), ELEVATION, AZIMUTH, list(polarizations))
    measures = {"unknowns": solution.unknowns, "triangles": len(triangles), "box": np.ptp(vertices, axis=0)}
    megabytes, expected = planned(measures, len(symmetry), sweep, "efie", "single", tolerance)
    row = {"unknowns": solution.unknowns, "tolerance": tolerance or 0.0, "seconds": seconds}
    row |= {part: float(solution.seconds[part][0]) for part in PARTS}
    row |= {"planned_s": expected, "peak_mb": peak_mb(), "planned_mb": megabytes, "residual": solution.residual[0]}
    return row, solution.field


def of_sphere(count, planes, tolerance, threads):
    vertices, triangles = octasphere(count, 0.1)
    return measured(vertices, triangles, C0, PLANES[planes], tolerance, threads)[0]


def hard_shapes():
    """A cavity open to one side, an open duct, and a stack of close plates: {name: vertices and triangles}, m."""
    side, radius = 3.2, 5 / (2 * np.pi)
    sides = [sheet(*vectors, 32, 32) for vectors in side * np.eye(3)[[[0, 1], [1, 2], [0, 2]]]]
    opposite = [(sides[n][0] + shift, sides[n][1]) for n, shift in ((1, [side, 0, 0]), (2, [0, side, 0]))]
    unrolled, faces = sheet([5, 0, 0], [0, 10, 0], 50, 100)
    angle = unrolled[:, 0] / radius
    duct = np.stack([unrolled[:, 1], radius * np.cos(angle), radius * np.sin(angle)], 1), faces
    plate = sheet([4.3, 0, 0], [0, 2.7, 0], 43, 27)
    stack = [(plate[0] + [0, 0, 0.1 * n], plate[1]) for n in range(4)]
    return {"cavity": weld(*sides, *opposite), "duct": weld(duct), "stack": weld(*stack)}


def of_hard_shape(name, tolerance, threads):
    return measured(*hard_shapes()[name], C0, [], tolerance, threads)


def of_large_sphere(unknowns, threads):
    """Bistatic pattern of a sphere of ten edges a wavelength, no mirror planes, over 360 azimuths; its row."""
    threadpoolctl.threadpool_limits(1)
    edge = 0.1
    radius = edge * (unknowns / 30 / 1.2035**2) ** 0.5
    vertices, triangles = mie.icosphere(radius, edge)
    start = time.perf_counter()
    surface = fundamental_domain(vertices, triangles, [])
    bases = [rwg(surface, surface.parities[0])]
    entries = Entries(efie, surface, bases, K, efie.near_terms(surface), np.complex64)
    matrix = LowRankMatrix([block.spans[0] for block in entries.blocks])
    said = {"at": 0.0}

    def progress(part):
        def say(done):
            if time.perf_counter() - said["at"] > 60:
                said["at"] = time.perf_counter()
                print(f"  {said['at'] - start:6.0f} s, {peak_mb():.0f} MB: {part} {100 * done:.0f} %", flush=True)

        return say

    fill(entries, [matrix], TILE_SHARE * OF_SPHERE, threads, progress("assembly"))
    numbers = np.linspace(0, len(bases[0]) - 1, 128).astype(int)
    (rows,) = entries.rows([numbers])
    assembled = time.perf_counter()
    matrix.factorize(threads, progress("factorization"))
    factorized = time.perf_counter()
    angle = np.deg2rad(np.arange(360.0))
    travel, along, across = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]  # off the mesh's axes
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    # Receivers in the plane of travel and along, with both polarizations; two waves that come from -travel.
    u = np.concatenate([cos * travel + sin * along] * 2 + [-travel[None]] * 2)
    waves = np.concatenate([cos * along - sin * travel, np.tile(across, (360, 1)), [along, across]])
    right = Excitation(surface, bases, np.complex64)(K, u, waves, threads=threads)[0]
    between = -matrix.between(right, right, [slice(0, len(u))], threads)[0]
    residual = _residual(rows, numbers, right[:, -2:], matrix.solve(right[:, -2:], threads))
    done = time.perf_counter()
    fields = between[:360, -2], between[360:720, -1]
    table = pd.DataFrame({"angle_deg": np.arange(360)})
    for name, field, truth in zip(("along", "across"), fields, mie.bistatic(K, radius, angle), strict=True):
        table[f"{name}_db"], table[f"{name}_mie_db"] = 20 * np.log10(np.abs(field)), 20 * np.log10(np.abs(truth))
    error = np.abs(table[["along_db", "across_db"]].to_numpy() - table[["along_mie_db", "across_mie_db"]].to_numpy())
    row = {"unknowns": len(bases[0]), "radius_wavelengths": radius, "tolerance": OF_SPHERE}
    row |= {"assembly": assembled - start, "factorization": factorized - assembled, "directions": done - factorized}
    row |= {"seconds": done - start, "peak_mb": peak_mb(), "residual": residual, "mean_error_db": error.mean()}
    return row | {"largest_error_db": error.max()}, table


def errors(field, truth):
    """The largest error relative to the peak in dB, and of the level within 30 dB of it."""
    peak = np.abs(truth).max()
    shown = np.abs(truth) > peak * 10**-1.5
    level = np.abs(20 * np.log10(np.abs(field[shown]) / np.abs(truth[shown]))).max()
    return 20 * np.log10(np.abs(field - truth).max() / peak), level


def over_unknowns(path, threads):
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    known = {(row["planes"], row["count"], row["tolerance"]) for row in rows}
    for planes, counts in COUNTS.items():
        for count in counts:
            for tolerance in (None, TOLERANCE):
                if (planes, count, tolerance or 0.0) in known or (
                    tolerance is None and 12 * count**2 > LARGEST_WHOLE[planes]
                ):
                    continue
                row = {"planes": planes, "count": count} | in_process(of_sphere, count, planes, tolerance, threads)
                show(row)
                rows.append(row)
                pd.DataFrame(rows).to_csv(path, index=False)
    return pd.DataFrame(rows)


def over_tolerance(path, figures, target, band, threads):
    mesh = read_ply(Path(figures).with_name(f"{target}-{band}.ply"))
    top = json.loads(Path(figures).read_text())["bands"][band]["frequencies"]["last"]
    whole, truth = in_process(measured, *mesh, top, ["xz"], None, threads)
    rows = [whole]
    for tolerance in TOLERANCES:
        try:
            row, field = in_process(measured, *mesh, top, ["xz"], tolerance, threads)
        except InputError as error:  # even the refined solution's residual is above 1e-3
            print(f"tolerance {tolerance:g}: {error}", flush=True)
            continue
        relative, level = errors(field, truth)
        rows.append(row | {"error_to_peak_db": relative, "level_error_db": level})
        show(rows[-1])
        pd.DataFrame(rows).to_csv(path, index=False)
    return pd.DataFrame(rows)


def over_shapes(path, threads):
    rows = []
    for name in hard_shapes():
        whole, truth = in_process(of_hard_shape, name, None, threads)
        row, field = in_process(of_hard_shape, name, TOLERANCE, threads)
        relative, level = errors(field, truth)
        rows.append(
            {"shape": name, "unknowns": row["unknowns"], "whole_s": whole["seconds"], "whole_mb": whole["peak_mb"]}
        )
        rows[-1] |= {key: row[key] for key in ("seconds", "peak_mb", "residual")}
        rows[-1] |= {"error_to_peak_db": relative, "level_error_db": level}
        show(rows[-1])
    pd.DataFrame(rows).to_csv(path, index=False)


def draw_unknowns(table, large, path):
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
    for color, (planes, of_planes) in zip(("C0", "C1", "C2"), table.groupby("planes", sort=False), strict=False):
        for whole, rows in of_planes.sort_values("unknowns").groupby(of_planes.tolerance == 0):
            line = {"color": color, "marker": "o", "markersize": 4, "ls": ":" if whole else "-"}
            axes[0].plot(rows.unknowns, rows.seconds, **line)
            axes[1].plot(rows.unknowns, rows.peak_mb / 1000, **line)
        axes[0].plot([], [], color=color, marker="o", markersize=4, label=f"mirror planes: {planes}")
    for ax, column, scale in ((axes[0], "seconds", 1), (axes[1], "peak_mb", 1000)):
        if len(large):
            label = f"no planes, one bistatic pattern, tolerance {OF_SPHERE:g}"
            ax.plot(large.unknowns, large[column] / scale, "C3*", markersize=10, label=label)
        ax.plot([], [], "-", color="grey", label="compressed, tolerance 1e-5")
        ax.plot([], [], ":", color="grey", label="whole matrices")
    axes[0].set(xlabel="unknowns N", ylabel="time [s]: 4,598 directions, VV")
    axes[1].set(xlabel="unknowns N", ylabel="peak memory of the process [GB]")
    ticks = [2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000]
    for ax in axes:
        ax.set(xscale="log", yscale="log")
        ax.set_xticks(ticks, [f"{n // 1000}k" for n in ticks])
        ax.set_xticks([], minor=True)
        ax.set_yticks([], minor=True)
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    for ax, values in zip(axes, ([2, 5, 10, 20, 50, 100, 200, 500, 1000], [0.5, 1, 2, 5, 10, 20]), strict=True):
        ax.set_yticks(values, [f"{value:g}" for value in values])
    figure.savefig(path, dpi=120)


def draw_tolerance(table, path):
    whole, rows = table[table.tolerance == 0].iloc[0], table[table.tolerance > 0]
    figure, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
    axes[0].semilogx(rows.tolerance, rows.error_to_peak_db, "o-", label="largest, relative to the peak")
    axes[0].set(ylabel="error of the field [dB]")
    axes[1].semilogx(rows.tolerance, rows.peak_mb / 1000, "o-", label="compressed")
    axes[1].axhline(whole.peak_mb / 1000, color="grey", ls=":", label="whole matrices")
    axes[1].set(ylabel="peak memory of the process [GB]", ylim=(0, None))
    axes[2].semilogx(rows.tolerance, rows.seconds, "o-", label="compressed")
    axes[2].axhline(whole.seconds, color="grey", ls=":", label="whole matrices")
    axes[2].set(ylabel="time [s]", ylim=(0, None))
    # Above ten tolerances of residual a solve is refined: what it takes is the refinement's then, and so is its error.
    refined = rows[rows.directions > 3 * rows.directions.median()]
    for ax, column, scale in zip(axes, ("error_to_peak_db", "peak_mb", "seconds"), (1, 1000, 1), strict=True):
        ax.plot(refined.tolerance, refined[column] / scale, "o", color="white", markeredgecolor="C0", label="refined")
        ax.set(xlabel="scattering.tolerance")
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    figure.savefig(path, dpi=120)


def main():
    sphere = {"type": int, "help": "unknowns of the large sphere: 200000 take half an hour and 20 GB"}
    mesh = {"default": "results/quick/mesh/aircraft.json", "help": "figures of the target's meshes"}
    options = options_of(__doc__, sphere=sphere, mesh=mesh)
    out = options.out
    large = out / "compressed-sphere.csv"
    if options.sphere:
        row, pattern = in_process(of_large_sphere, options.sphere, options.threads)
        print(row, flush=True)
        pd.DataFrame([row]).to_csv(large, index=False)
        pattern.to_csv(out / "compressed-pattern.csv", index=False)
        return
    spheres = over_unknowns(out / "compressed-unknowns.csv", options.threads)
    spheres = spheres.sort_values(["planes", "unknowns"])
    known = pd.read_csv(large) if large.exists() else pd.DataFrame(columns=["unknowns", "seconds", "peak_mb"])
    draw_unknowns(spheres, known, out / "compressed-unknowns.png")
    over_shapes(out / "compressed-shapes.csv", options.threads)
    target, band = Path(options.mesh).stem, 2
    over = over_tolerance(out / "compressed-tolerance.csv", options.mesh, target, band, options.threads)
    draw_tolerance(over, out / "compressed-tolerance.png")


if __name__ == "__main__":
    main()
