"""The solved fields: RCS against angle, range profiles, and how well the equations were solved."""

import numpy as np
import pandas as pd

from isarflow.core.sweep import C0
from isarflow.report.layout import Section, canvas, circle_ticks, figure, number, signed, table
from isarflow.report.rcs_figures import by_transmitter, cut_figure, polar_figure, rcs_dbsm
from isarflow.scattering.solver import build

PLACE, NEEDS = ("fields", 2), "targets"  # on the page, see page.py
CURVES = 7  # elevations in one plot at most
DYNAMIC_RANGE = 40  # dB, of range profiles
OVERSAMPLING = 8  # of the same


def section(results):
    """Return the Section of the fields: how they were solved or where they come from, RCS and range profiles."""
    settings, sphere, text, figures, origins = results.settings["scattering"], results.sphere or {}, "", [], []
    if results.meshed:
        solver = getattr(build(settings), "name", f"solver '{settings['solver']}'")
        text = f"The {solver} gives the scattered field for every frequency and direction. "
    if "error_db" in sphere:
        text += (
            f"A sphere of {sphere['radius_wavelengths']:g} wavelengths' radius, solved in this run with the same "
            f"settings at {sphere['edges_per_wavelength']:g} edges a wavelength, has a backscatter "
            f"{signed(sphere['error_db'])} dB and {signed(sphere['phase_deg'], 2)}° from the Mie series. "
        )
    text += (
        "Radar cross section (RCS) is 4π|f|² of the scattering amplitude f, in decibels over one square metre (dBsm)."
    )
    for name in results.targets:
        dataset = results.scattering(name)
        for title, part in by_transmitter(name, dataset, CURVES):
            drawn = title, part, results.reach(name), CURVES
            figures.append(polar_figure(*drawn, name="rcs") or cut_figure(*drawn))
        if results.images_are_made:
            figures.append(profile_figure(name, dataset))
        if name not in results.meshed:
            files = ", ".join(f"{path} (SHA-256 {digest[:12]}…)" for path, digest in dataset.attrs["origin"].items())
            origins.append(f"The field of {name} was not solved here; it comes from {files}.")
    tables = (solution_table(results),)
    return Section(id="scattering", title="Scattering", text=(text, *origins), figures=tuple(figures), tables=tables)


def range_profiles(field, frequency):
    """Return the range profiles of a stepped-frequency sweep: Hamming window, then the sum over frequencies.

    field: (frequency, azimuth) in m, frequency in Hz. Returns range in m, shape (ranges,), negative towards the
    radar and one unambiguous length long, and the complex profile (ranges, azimuth).
    """
    count = OVERSAMPLING * len(frequency)
    distance = (np.arange(count) - count // 2) * (C0 / (2 * (frequency[1] - frequency[0]))) / count
    # A scatterer at range r has phase exp(-2jkr), k = 2 pi f / c: the conjugate brings it back into phase.
    steering = np.exp(4j * np.pi / C0 * np.outer(distance, frequency - frequency.mean()))
    window = np.hamming(len(frequency))
    return distance, steering @ (window[:, None] / window.sum() * field)


def profile_figure(target, dataset):
    """Draw the range profile at every azimuth, elevation nearest 0, first polarization."""
    cut = dataset.sel(elevation=0, method="nearest").isel(polarization=0)
    azimuth, (distance, profile) = cut.azimuth.values, range_profiles(cut.field.values, cut.frequency.values)
    level = 20 * np.log10(np.maximum(np.abs(profile) / np.abs(profile).max(), 1e-10))
    drawing = canvas(5.4, 2.9)
    axes = drawing.add_subplot()
    look = {"cmap": "viridis", "vmin": -DYNAMIC_RANGE, "vmax": 0, "shading": "nearest", "rasterized": True}
    picture = axes.pcolormesh(azimuth, distance, level, **look)
    axes.grid(False)
    axes.set(xlabel="azimuth [°]", ylabel="range [m]")
    circle_ticks(axes.xaxis, azimuth)
    drawing.colorbar(picture, label="level [dB]", pad=0.02)
    places = {"range_m": np.repeat(distance, len(azimuth)), "azimuth_deg": np.tile(azimuth, len(distance))}
    data = pd.DataFrame({"target": target, **places, "level_db": level.ravel().round(1)})
    alt = f"Range profiles of {target} over azimuth: bright lines are scattering centres that move with the angle."
    caption = (
        f"{target}: range profiles over azimuth at elevation {float(cut.elevation):g}°, {cut.polarization.item()}, "
        "relative to the strongest. Negative range is towards the radar; a scattering centre seen from all round draws "
        "a sine."
    )
    return figure(f"range_profiles_{target}", drawing, data, alt, caption)


def solution_table(results):
    """Return the Table of how large the systems were, how well they were solved, and the spread of RCS, by target."""
    rows = []
    for name in results.targets:
        dataset = results.scattering(name)
        level, attrs = rcs_dbsm(dataset.field.values), dataset.attrs
        counts, residuals = (pd.Series(attrs[key] or (), dtype=float) for key in ("unknowns", "residual"))
        row = {"target": name, "formulation": attrs.get("formulation", attrs.get("solver"))}
        row |= {"unknowns_min": counts.min(), "unknowns_max": counts.max(), "residual_max": residuals.max()}
        row |= {"frequencies": dataset.sizes["frequency"], "directions": dataset.field[0, 0].size}
        rows.append(row | {"rcs_median_dbsm": np.median(level), "rcs_max_dbsm": level.max()})

    def unknowns(row):
        ends = dict.fromkeys((row["unknowns_min"], row["unknowns_max"]))
        return "–" if pd.isna(row["unknowns_min"]) else " to ".join(f"{count:,}" for count in ends)

    shown = {
        "target": "{target}",
        "formulation": lambda row: row["formulation"] if pd.isna(row["unknowns_min"]) else row["formulation"].upper(),
        "unknowns": unknowns,
        "largest residual": lambda row: number(row["residual_max"], 2),
        "frequencies": "{frequencies}",
        "directions": "{directions:,}",
        "median RCS [dBsm]": "{rcs_median_dbsm:.1f}",
        "largest RCS [dBsm]": "{rcs_max_dbsm:.1f}",
    }
    caption = (
        "The linear systems, one per frequency: unknowns in the lowest and the highest band, and the largest relative "
        "residual. RCS over all frequencies, directions and polarizations."
    )
    data = pd.DataFrame(rows).astype({"unknowns_min": "Int64", "unknowns_max": "Int64"})
    return table("scattering", data, shown, caption)
