"""The solved fields: RCS against angle, range profiles, and how well the equations were solved."""

import matplotlib
import numpy as np
import pandas as pd

from core.sweep import C0
from report.layout import Figure, Section, Table, canvas, circle_ticks, number, style, to_svg
from report.selection import evenly
from scattering.solver import build

DYNAMIC_RANGE = 40  # dB, of range profiles
CURVES = 5  # elevations in one plot at most
AXES = {  # what RCS may be drawn against: scale from the store's unit, label
    "azimuth": (1.0, "azimuth [°]"),
    "elevation": (1.0, "elevation [°]"),
    "frequency": (1e-9, "frequency [GHz]"),
}


def section(results):
    targets = results.targets
    figures = []
    for name in targets:
        figures.append(rcs_figure(name, results.scattering(name), results.images_are_made))
        if results.images_are_made:
            figures.append(profile_figure(name, results.scattering(name)))
    scattering = results.settings["scattering"]
    solver = getattr(build(scattering), "name", f"solver '{scattering['solver']}'")
    solved = f"The {solver} gives the scattered field for every frequency and direction. "
    return Section(
        id="scattering",
        title="Scattering",
        text=(
            (solved if results.meshed else "")
            + "Radar cross section (RCS) is 4π|f|² of the scattering amplitude f, in decibels over one square metre "
            "(dBsm).",
            *(_origin(name, results.scattering(name)) for name in targets if name not in results.meshed),
        ),
        figures=tuple(figures),
        tables=(solution_table(targets, results),),
    )


def _origin(target, dataset):
    """Where a field that was not solved here comes from."""
    files = ", ".join(f"{path} (SHA-256 {digest[:12]}…)" for path, digest in dataset.attrs["origin"].items())
    return f"The field of {target} was not solved here; it comes from {files}."


def rcs_dbsm(field):
    """Radar cross section in dBsm of scattering amplitudes in m; -200 dBsm where there is no field at all."""
    return 10 * np.log10(np.maximum(4 * np.pi * np.abs(field) ** 2, 1e-20))


def nearest(dataset, **where):
    """The dataset at the samples nearest to the given coordinates."""
    return dataset.sel(**where, method="nearest")


def center_frequency(dataset):
    """The frequency sample in Hz nearest to the middle of the sweep."""
    frequency = dataset.frequency.values
    return float(frequency[np.argmin(np.abs(frequency - (frequency[0] + frequency[-1]) / 2))])


def rcs_figure(target, dataset, images_are_made):
    """RCS against azimuth, one panel per polarization.

    With images the curve at the elevation nearest 0 is enough; for a pure RCS run every elevation counts (or
    CURVES of them). A sweep with a single azimuth is drawn against elevation, or else against frequency.
    """
    across = next((name for name in AXES if dataset.sizes[name] > 1), "azimuth")
    field = dataset.field
    if across != "frequency":
        field = nearest(field, frequency=center_frequency(dataset))
    if across == "azimuth":
        elevations = evenly(dataset.elevation.values.tolist(), CURVES)
        if images_are_made:
            elevations = [float(nearest(dataset, elevation=0).elevation)]
        field = field.sel(elevation=elevations)
    scale, label = AXES[across]
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    frame.insert(0, "target", target)
    polarizations = dataset.polarization.values.tolist()
    with style():
        figure = canvas(5.4, 0.8 + 2.1 * len(polarizations))
        panels = figure.subplots(len(polarizations), 1, squeeze=False, sharex=True)[:, 0]
        angles = sorted(frame["elevation"].unique()) if across == "azimuth" else [None]
        colors = matplotlib.colormaps["viridis"](np.linspace(0, 0.8, len(angles)))
        for axes, polarization in zip(panels, polarizations, strict=True):
            part = frame[frame["polarization"] == polarization]
            for angle, color in zip(angles, colors, strict=True):
                curve = part if angle is None else part[part["elevation"] == angle]
                marker = "o" if len(curve) < 3 else None
                text = None if angle is None else f"elevation {angle:g}°"
                axes.plot(scale * curve[across], curve["rcs_dbsm"], color=color, marker=marker, label=text)
            axes.set(ylabel=f"{polarization} RCS [dBsm]")
            axes.margins(x=0.01)
            floor = part["rcs_dbsm"].max() - 50  # deep nulls would flatten the rest
            axes.set_ylim(bottom=max(part["rcs_dbsm"].min() - 2, floor))
        panels[-1].set_xlabel(label)
        if across != "frequency":
            circle_ticks(panels[-1].xaxis, frame[across])
        if len(angles) > 1:
            figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=min(len(angles), 5))
        svg = to_svg(figure)
    peak = frame.loc[frame["rcs_dbsm"].idxmax()]
    ghz = center_frequency(dataset) / 1e9
    at = "" if across == "frequency" else f" at {ghz:.4g} GHz"
    if frame["elevation"].nunique() == 1:
        at += f", elevation {frame['elevation'].iloc[0]:g}°"
    return Figure(
        name=f"rcs_{target}",
        svg=svg,
        data=frame,
        alt=f"RCS of {target} against {across}{at}, from {frame['rcs_dbsm'].min():.0f} to {peak['rcs_dbsm']:.0f} dBsm.",
        caption=(
            f"{target}: backscatter RCS{at}. The largest is {peak['rcs_dbsm']:.1f} dBsm, "
            f"at azimuth {peak['azimuth']:.1f}°, elevation {peak['elevation']:.1f}°; "
            f"the median is {frame['rcs_dbsm'].median():.1f} dBsm."
        ),
    )


def range_profiles(field, frequency, oversampling=8):
    """Range profiles of a stepped-frequency sweep: Hamming window, then the sum over frequencies.

    field: (frequency, azimuth) in m, frequency in Hz. Returns range in m, shape (ranges,), negative towards the
    radar and one unambiguous length long, and the complex profile (ranges, azimuth).
    """
    count = oversampling * len(frequency)
    span = C0 / (2 * (frequency[1] - frequency[0]))
    distance = (np.arange(count) - count // 2) * span / count
    # A scatterer at range r has phase exp(-2jkr), k = 2 pi f / c: the conjugate brings it back into phase.
    steering = np.exp(4j * np.pi / C0 * np.outer(distance, frequency - frequency.mean()))
    window = np.hamming(len(frequency))
    return distance, steering @ (window[:, None] / window.sum() * field)


def profile_figure(target, dataset):
    """Range profile at every azimuth, elevation nearest 0, first polarization."""
    cut = nearest(dataset, elevation=0).isel(polarization=0)
    distance, profile = range_profiles(cut.field.values, dataset.frequency.values)
    level = 20 * np.log10(np.maximum(np.abs(profile) / np.abs(profile).max(), 1e-10))
    azimuth = dataset.azimuth.values
    with style():
        figure = canvas(5.4, 2.9)
        axes = figure.add_subplot()
        picture = axes.pcolormesh(
            azimuth, distance, level, cmap="viridis", vmin=-DYNAMIC_RANGE, vmax=0, shading="nearest", rasterized=True
        )
        axes.grid(False)
        axes.set(xlabel="azimuth [°]", ylabel="range [m]")
        circle_ticks(axes.xaxis, azimuth)
        figure.colorbar(picture, label="level [dB]", pad=0.02)
        svg = to_svg(figure)
    frame = pd.DataFrame(
        {
            "target": target,
            "range_m": np.repeat(distance, len(azimuth)),
            "azimuth_deg": np.tile(azimuth, len(distance)),
            "level_db": level.ravel().round(2),
        }
    )
    return Figure(
        name=f"range_profiles_{target}",
        svg=svg,
        data=frame,
        alt=f"Range profiles of {target} over azimuth: bright lines are scattering centres that move with the angle.",
        caption=(
            f"{target}: range profiles over azimuth at elevation {float(cut.elevation):g}°, "
            f"{cut.polarization.item()}, relative to the strongest. Negative range is towards the radar; "
            "a scattering centre seen from all round draws a sine."
        ),
    )


def solution_table(targets, results):
    """Per target: how large the systems were, how well they were solved, and the spread of RCS."""
    rows, shown = [], []
    for name in targets:
        dataset = results.scattering(name)
        level = rcs_dbsm(dataset.field.values)
        residuals, unknowns = (
            [value for value in dataset.attrs[key] or () if value is not None] for key in ("residual", "unknowns")
        )
        residual, unknowns = max(residuals, default=None), np.unique(unknowns).astype(int)
        row = {
            "target": name,
            "formulation": dataset.attrs.get("formulation", dataset.attrs.get("solver")),
            "unknowns_min": unknowns.min() if len(unknowns) else None,
            "unknowns_max": unknowns.max() if len(unknowns) else None,
            "residual_max": residual,
            "frequencies": dataset.sizes["frequency"],
            "directions": dataset.sizes["elevation"] * dataset.sizes["azimuth"],
            "rcs_median_dbsm": np.median(level),
            "rcs_max_dbsm": level.max(),
        }
        rows.append(row)
        shown.append(
            {
                "target": name,
                "formulation": row["formulation"].upper() if len(unknowns) else row["formulation"],
                "unknowns": " to ".join(f"{count:,}" for count in unknowns[[0, -1][: len(unknowns)]]) or "–",
                "largest residual": number(residual, 2),
                "frequencies": str(row["frequencies"]),
                "directions": f"{row['directions']:,}",
                "median RCS [dBsm]": f"{row['rcs_median_dbsm']:.1f}",
                "largest RCS [dBsm]": f"{row['rcs_max_dbsm']:.1f}",
            }
        )
    return Table(
        name="scattering",
        shown=pd.DataFrame(shown),
        data=pd.DataFrame(rows).astype({"unknowns_min": "Int64", "unknowns_max": "Int64"}),
        caption=(
            "The linear systems, one per frequency: unknowns in the lowest and the highest band, and the largest "
            "relative residual. RCS over all frequencies, directions and polarizations."
        ),
    )
