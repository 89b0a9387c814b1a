"""Physical optics and shooting rays beside the method of moments, on the dataset's targets: `make bench-optics`.

Each target's sweep of resources/fields is computed anew by the solvers `po` and `sbr`, on a mesh of ten edges a
wavelength at the highest frequency, and kept in results/optics/<solver>; delete a store to time it again. Then the
tables say how far these fields are off, over frequency and over elevation, how like their ISAR images are, and, of the
reference experiment's five targets, what the model `likelihood` recognises when one solver made its library and another
what it is tested on. They go to results/benchmarks/, with figures of the five.

    bench_optics.py --only aircraft    makes and times the fields of this target, and no table
"""

import itertools
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import xarray as xr
from imaged import TARGETS, Imaged, recognised
from runner import options_of

from isarflow.core.sweep import Sweep
from isarflow.imaging.outline import OUTLINE, outline
from isarflow.learning.confidence import zncc
from isarflow.mesh.io import read_ply
from isarflow.scattering.fields.store import write_field
from isarflow.scattering.solver import build_solver

FIELDS, RESULTS = Path("resources/fields"), Path("results/optics")
ALL = [*TARGETS, *sorted({path.stem for path in FIELDS.glob("*.zarr")} - {*TARGETS})]
SOLVERS = ("po", "sbr")
MADE_BY = {"mom": "method of moments", "po": "physical optics", "sbr": "rays"}
ASKED = "frequency", "elevation", "azimuth", "polarization"
CHANNELS = ["VV", "HH"]  # what physical optics has
IMAGING = {"imager": "fourier", "window": "hamming", "reformat": "polar", "upsample": "none"}
IMAGING |= {"aperture": 21, "polarizations": CHANNELS}
MODELS = {"likelihood": ("likelihood", {"candidates": 8, "mismatch": 0.03})}  # as config/config.yaml
SHOWN = 30  # dB below a polarization's peak, down to which levels are compared
VIEWS = 25  # random azimuths of each elevation and target, whose images are compared
SNRS = [24, 12, 6, 0, -6]  # dB, of the mean power of VV in the aperture
SHOWN_VIEW = 25.0, 15.0  # azimuth and elevation of the images drawn, degrees
FLOOR = -40.0  # dB


def truth(target):
    """The dataset's field of a target: (polarization, frequency, elevation, azimuth), m."""
    return xr.open_zarr(FIELDS / f"{target}.zarr").field.load()


def computed(solver, target, threads):
    """The store of a target's field by a solver, made if it is not there yet; its attributes say what that took."""
    path = RESULTS / solver / f"{target}.zarr"
    if not path.exists():
        field = truth(target)
        sweep = Sweep(*(field[name].values for name in ASKED))
        mesh = read_ply(RESULTS / "mesh" / f"{target}-0.ply")
        begun, processor = time.perf_counter(), time.process_time()
        solution = build_solver({"solver": solver}).solve(*mesh, sweep, [], threads, lambda *of: None)
        took = {"seconds": time.perf_counter() - begun, "processor_s": time.process_time() - processor}
        attrs = {"solver": solver, "triangles": len(mesh[1]), "threads": threads, **took}
        axes = sweep.polarizations, sweep.frequency, sweep.elevation, sweep.azimuth
        write_field(path, solution.field.astype(np.complex64), *axes, attrs)
        print(f"{target} by {solver}: {took['seconds']:.0f} s on {threads} threads", flush=True)
    return xr.open_zarr(path).load()


def errors(fields, axis=None):
    """How far fields are off: a row for each solver, target, polarization and value of an axis, or of all together.

    error: root mean square over root mean square; level_db: the median difference where the truth is near its peak;
    power_db: of the mean powers.
    """
    rows = []
    for solver, (target, true) in itertools.product(SOLVERS, fields["mom"].items()):
        for way in true.polarization.values:
            exact, found = (of.sel(polarization=way) for of in (true, fields[solver][target]))
            least = float(abs(exact).max()) * 10 ** (-SHOWN / 20)
            for at in [{axis: value} for value in true[axis].values] if axis else [{}]:
                one, two = (of.sel(at).values.ravel() for of in (exact, found))
                rows.append({"solver": solver, "target": target, "polarization": str(way)} | at | off(one, two, least))
    return pd.DataFrame(rows)


def off(exact, found, least):
    """The errors of fields (n,), see `errors`; levels are compared where the exact one is above `least`, m."""
    power, strong = (np.abs(exact) ** 2).mean(), np.abs(exact) > least
    if not found.any() or not strong.any():
        return {"error": np.nan, "level_db": np.nan, "power_db": np.nan}
    level = 20 * np.log10(np.maximum(np.abs(found[strong]), 1e-9) / np.abs(exact[strong]))
    return {
        "error": np.sqrt((np.abs(found - exact) ** 2).mean() / power),
        "level_db": np.median(np.abs(level)),
        "power_db": 10 * np.log10((np.abs(found) ** 2).mean() / power),
    }


def likeness(imaged):
    """ZNCC of the magnitudes of each solver's images with the true ones, at random views; one row for each image.

    For comparison the true images of the next target in the list, `another target`, and of the same 5 degrees above.
    """
    rows, true = [], imaged["mom"]
    elevations = np.arange(len(true.elevation) - 1)
    azimuths = np.random.default_rng(0).integers(0, len(true.azimuth), (len(elevations), VIEWS))

    def seen(by, target, above=0):
        return np.abs(by.of(target, elevations + above, azimuths))

    for target, other in zip(ALL, ALL[1:] + ALL[:1], strict=True):
        exact = seen(true, target)
        beside = {MADE_BY[solver]: seen(imaged[solver], target) for solver in SOLVERS}
        beside |= {"5° above": seen(true, target, 1), "another target": seen(true, other)}
        for (name, images), (number, way) in itertools.product(beside.items(), enumerate(CHANNELS)):
            values = zncc(*(of[:, number].reshape(len(of), -1) for of in (exact, images)))
            rows += [{"target": target, "of": name, "polarization": way, "zncc": value} for value in values]
    return pd.DataFrame(rows)


def draw(by_frequency, by_elevation, alike, shares, path):
    """Draw the errors over frequency and elevation, how like images are, and what is recognised."""
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.9), layout="constrained", width_ratios=[1, 1, 1.1, 1])
    lines = {"po": "--", "sbr": "-"}
    for number, target in enumerate(TARGETS):
        for solver, line in lines.items():
            look = {"color": f"C{number}", "ls": line, "lw": 1.3}
            for ax, table, axis, scale in (
                (axes[0], by_frequency, "frequency", 1e9),
                (axes[1], by_elevation, "elevation", 1),
            ):
                own = table[(table.solver == solver) & (table.target == target) & table.polarization.isin(CHANNELS)]
                mean = own.groupby(axis)["error"].mean()
                ax.plot(mean.index / scale, 100 * mean, **look)
        axes[0].plot([], [], color=f"C{number}", label=target)
    for solver, line in lines.items():
        axes[0].plot([], [], "k", ls=line, label=MADE_BY[solver])
    axes[0].set(xlabel="frequency [GHz]", ylabel="RMS error / RMS field [%]", title="Error of VV and HH, mean")
    axes[1].set(xlabel="elevation [degrees]", title="The same over elevation")
    names = list(dict.fromkeys(alike.of))
    for number, target in enumerate(TARGETS):
        rows = alike[alike.target == target]
        low, middle, high = rows.groupby("of")["zncc"].quantile([0.1, 0.5, 0.9]).unstack().loc[names].to_numpy().T
        place = np.arange(len(names)) + 0.13 * (number - 2)
        axes[2].errorbar(place, middle, [middle - low, high - middle], fmt="o", ms=4, color=f"C{number}", lw=1)
    axes[2].set_xticks(range(len(names)), [name.replace(" ", "\n") for name in names])
    axes[2].set(ylabel="ZNCC with the true image", title="Images: median, 10 to 90 %", ylim=(None, 1.02))
    of_true = shares[shares.tested == "mom"]
    for marker, (own, line) in zip("osD", ({"mom": ":"} | lines).items(), strict=True):
        rows = of_true[of_true.library == own]
        look = {"marker": marker, "color": "k", "mfc": "w", "ls": line, "lw": 1.2, "label": MADE_BY[own]}
        axes[3].plot(rows.snr_db, 100 * rows.accuracy, **look)
    axes[3].set(xlabel="SNR [dB]", ylabel="named rightly [%]", title="True images recognised", ylim=(70, 101))
    axes[3].legend(fontsize="small", title="library by", loc="lower right")
    for ax in axes:
        ax.grid(alpha=0.3)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=7)
    figure.savefig(path, dpi=90)


def draw_images(imaged, path):
    """Draw one view of every target by every solver, each image relative to its own peak."""
    figure, grid = plt.subplots(
        len(imaged), len(TARGETS), figsize=(11, 6.2), layout="constrained", sharex=True, sharey=True
    )
    true = imaged["mom"]
    azimuth, elevation = (
        np.abs(of - at).argmin() for of, at in zip((true.azimuth, true.elevation), SHOWN_VIEW, strict=True)
    )
    view = float(true.elevation[elevation]), float(true.azimuth[azimuth])
    down, cross = true.imager.axes()
    half = (down[1] - down[0]) / 2, (cross[1] - cross[0]) / 2
    extent = cross[0] - half[1], cross[-1] + half[1], down[0] - half[0], down[-1] + half[0]
    for row, (solver, made) in zip(grid, imaged.items(), strict=True):
        row[0].set_ylabel(f"{MADE_BY[solver]}\nrange [m]")
        for ax, target in zip(row, TARGETS, strict=True):
            image = np.abs(made.of(target, [elevation], np.array([[azimuth]]))[0, 0])
            level = np.maximum(20 * np.log10(np.maximum(image, 1e-6)), FLOOR)
            shown = ax.imshow(level, vmin=FLOOR, vmax=0, origin="lower", extent=extent, cmap="viridis")
            mesh = read_ply(RESULTS / "mesh" / f"{target}-0.ply")
            ax.contour(*outline(*mesh, *view), levels=[OUTLINE], colors="w", linewidths=0.7)
    for ax, target in zip(grid[0], TARGETS, strict=True):
        ax.set_title(target)
    for ax in grid[-1]:
        ax.set_xlabel("cross-range [m]")
    figure.colorbar(shown, ax=grid, shrink=0.6, label="VV, |image| [dB]")
    figure.savefig(path, dpi=80)


def main():
    only = {"choices": ALL, "help": "make the fields of this target alone, and no table"}
    options = options_of(__doc__, only=only)
    stores = {
        (solver, target): computed(solver, target, options.threads)
        for target in ([options.only] if options.only else ALL)
        for solver in SOLVERS
    }
    times = [{"target": target, **store.attrs} for (_, target), store in stores.items()]
    times = pd.DataFrame(times)[["target", "solver", "triangles", "threads", "seconds", "processor_s"]]
    print(times.round(1).to_string(index=False), flush=True)
    if options.only:
        return
    fields = {"mom": {target: truth(target) for target in ALL}}
    fields |= {solver: {target: stores[solver, target].field for target in ALL} for solver in SOLVERS}
    tables = {"times": times, "whole": errors(fields)}
    tables |= {axis: errors(fields, axis) for axis in ("frequency", "elevation")}
    for axis in ("frequency", "elevation"):
        print(f"By {axis}, all targets, mean of {' and '.join(CHANNELS)}:")
        own = tables[axis][tables[axis].polarization.isin(CHANNELS)]
        print(own.groupby(["solver", axis])[["error", "level_db", "power_db"]].mean().unstack(0).round(2))
    print(tables["whole"].round(2).to_string(index=False))
    imaged = {solver: Imaged(made, IMAGING) for solver, made in fields.items()}
    draw_images(imaged, options.out / "optics-images.png")
    tables["likeness"] = likeness(imaged)
    print(tables["likeness"].groupby(["target", "of"], sort=False)["zncc"].quantile([0.1, 0.5, 0.9]).unstack().round(2))
    imaged = {solver: Imaged({name: made[name] for name in TARGETS}, IMAGING) for solver, made in fields.items()}
    shares = []
    for solver, made in imaged.items():
        shares.append(recognised(made, imaged, MODELS, SNRS, step=2, drawn=10).assign(library=solver))
        print(shares[-1].round(3).to_string(index=False), flush=True)
    tables["recognition"] = pd.concat(shares)
    for name, table in tables.items():
        table.to_csv(options.out / f"optics-{name}.csv", index=False, float_format="%.5g")
    draw(*(tables[name] for name in ("frequency", "elevation", "likeness", "recognition")), options.out / "optics.png")


if __name__ == "__main__":
    main()
