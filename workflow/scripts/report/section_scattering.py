"""The solved fields: RCS against angle, range profiles, and how well the equations were solved."""

import numpy as np
import pandas as pd

from isarflow.core.sweep import C0
from isarflow.report.layout import Section, canvas, circle_ticks, figure, number, table
from isarflow.report.rcs_figures import by_transmitter, cut_figure, polar_figure, rcs_dbsm
from isarflow.scattering.solver import build

CURVES = 7  # elevations in one plot at most
DYNAMIC_RANGE = 40  # dB, of range profiles


def section(results):
    figures, origins = [], []
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
    scattering = results.settings["scattering"]
    solver = getattr(build(scattering), "name", f"solver '{scattering['solver']}'")
    solved = f"The {solver} gives the scattered field for every frequency and direction. " if results.meshed else ""
    return Section(
        id="scattering",
        title="Scattering",
        text=(
            f"{solved}{_sphere(results)}Radar cross section (RCS) is 4π|f|² of the scattering amplitude f, in decibels "
            "over one square metre (dBsm).",
            *origins,
        ),
        figures=tuple(figures),
        tables=(solution_table(results),),
    )


def _sphere(results):
    """How the run's solver does on a sphere, in a sentence."""
    if not results.sphere or "refused" in results.sphere:
        return ""
    found = results.sphere
    return (
        f"A sphere of {found['radius_wavelengths']:g} wavelengths' radius, solved in this run with the same settings "
        f"at {found['edges_per_wavelength']:g} edges a wavelength, has a backscatter {found['error_db']:+.3f} dB and "
        f"{found['phase_deg']:+.2f}° from the Mie series ({found['rcs_db']:.3f} and {found['mie_db']:.3f} dB over the "
        "square wavelength). "
    ).replace("-", "−")


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
    cut = dataset.sel(elevation=0, method="nearest").isel(polarization=0)
    distance, profile = range_profiles(cut.field.values, dataset.frequency.values)
    level = 20 * np.log10(np.maximum(np.abs(profile) / np.abs(profile).max(), 1e-10))
    azimuth = dataset.azimuth.values
    drawing = canvas(5.4, 2.9)
    axes = drawing.add_subplot()
    picture = axes.pcolormesh(
        azimuth, distance, level, cmap="viridis", vmin=-DYNAMIC_RANGE, vmax=0, shading="nearest", rasterized=True
    )
    axes.grid(False)
    axes.set(xlabel="azimuth [°]", ylabel="range [m]")
    circle_ticks(axes.xaxis, azimuth)
    drawing.colorbar(picture, label="level [dB]", pad=0.02)
    places = {"range_m": np.repeat(distance, len(azimuth)), "azimuth_deg": np.tile(azimuth, len(distance))}
    frame = pd.DataFrame({"target": target, **places, "level_db": level.ravel().round(1)})
    alt = f"Range profiles of {target} over azimuth: bright lines are scattering centres that move with the angle."
    caption = (
        f"{target}: range profiles over azimuth at elevation {float(cut.elevation):g}°, {cut.polarization.item()}, "
        "relative to the strongest. Negative range is towards the radar; a scattering centre seen from all round draws "
        "a sine."
    )
    return figure(f"range_profiles_{target}", drawing, frame, alt, caption)


def solution_table(results):
    """Per target: how large the systems were, how well they were solved, and the spread of RCS."""
    rows = []
    for name in results.targets:
        dataset = results.scattering(name)
        level = rcs_dbsm(dataset.field.values)
        residuals, unknowns = (
            [value for value in dataset.attrs[key] or () if value is not None] for key in ("residual", "unknowns")
        )
        rows.append(
            {
                "target": name,
                "formulation": dataset.attrs.get("formulation", dataset.attrs.get("solver")),
                "unknowns_min": int(min(unknowns)) if unknowns else None,
                "unknowns_max": int(max(unknowns)) if unknowns else None,
                "residual_max": max(residuals, default=None),
                "frequencies": dataset.sizes["frequency"],
                "directions": dataset.field[0, 0].size,
                "rcs_median_dbsm": np.median(level),
                "rcs_max_dbsm": level.max(),
            }
        )

    def unknowns_text(row):
        ends = dict.fromkeys((row["unknowns_min"], row["unknowns_max"]))
        return "–" if pd.isna(row["unknowns_min"]) else " to ".join(f"{count:,}" for count in ends)

    shown = {
        "target": "{target}",
        "formulation": lambda row: row["formulation"] if pd.isna(row["unknowns_min"]) else row["formulation"].upper(),
        "unknowns": unknowns_text,
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
