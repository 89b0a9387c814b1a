"""The solved fields: RCS against angle, range profiles, and how well the equations were solved."""

import itertools

import matplotlib
import numpy as np
import pandas as pd

from core.sweep import C0, closes_circle
from report.layout import PALETTE, Section, canvas, circle_ticks, figure, number, table
from report.plots import draw_legend, panels
from report.selection import evenly
from scattering.solver import build

DYNAMIC_RANGE = 40  # dB, of range profiles
CURVES = 7  # elevations in one plot at most, of a run that makes images
ACROSS, WIDE = 4, 6  # polar plots side by side; inches above which a figure takes the whole page
DEEP = 40  # dB below the largest RCS that are drawn
SMOOTH = 5  # points drawn for each sample of a circle
QUIET = 1e-4  # of a field's power: what its highest harmonics hold at most where its samples tell all of it
AXES = {  # what RCS may be drawn against: scale from the store's unit, label
    "azimuth": (1.0, "azimuth [°]"),
    "elevation": (1.0, "elevation [°]"),
    "frequency": (1e-9, "frequency [GHz]"),
}


def section(results):
    figures, origins = [], []
    for name in results.targets:
        dataset = results.scattering(name)
        figures.append(rcs_figure(name, dataset, results.images_are_made))
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


def rcs_dbsm(field):
    """Radar cross section in dBsm of scattering amplitudes in m; -200 dBsm where there is no field at all."""
    return 10 * np.log10(np.maximum(4 * np.pi * np.abs(field) ** 2, 1e-20))


def center_frequency(dataset):
    """The frequency sample in Hz nearest to the middle of the sweep."""
    frequency = dataset.frequency.values
    return float(frequency[np.argmin(np.abs(frequency - (frequency[0] + frequency[-1]) / 2))])


def rcs_figure(target, dataset, images_are_made):
    """RCS over azimuth: round, with a panel per elevation, where the sweep closes a circle, else one per polarization.

    With images CURVES elevations are enough; for a pure RCS run every elevation counts. A sweep with a single azimuth
    is drawn against elevation, or else against frequency.
    """
    across = next((name for name in AXES if dataset.sizes[name] > 1), "azimuth")
    field = dataset.field
    if across != "frequency":
        field = field.sel(frequency=center_frequency(dataset))
    if across == "azimuth":
        elevations = dataset.elevation.values.tolist()
        field = field.sel(elevation=evenly(elevations, CURVES if images_are_made else len(elevations)))
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    frame.insert(0, "target", target)
    angles = sorted(frame["elevation"].unique()) if across == "azimuth" else [None]
    looks = dict(zip(angles, matplotlib.colormaps["viridis"](np.linspace(0, 0.85, len(angles))), strict=True))
    note = ""
    if across == "azimuth" and closes_circle(dataset.azimuth.values):
        drawing, smooth = _rcs_round(field)
        note = "" if smooth else " Straight lines join the samples: they are too few to say what lies between them."
    else:
        drawing = _rcs_over(across, frame, looks)
    peak = frame.loc[frame["rcs_dbsm"].idxmax()]
    at = "" if across == "frequency" else f" at {center_frequency(dataset) / 1e9:.4g} GHz"
    if frame["elevation"].nunique() == 1:
        at += f", elevation {frame['elevation'].iloc[0]:g}°"
    alt = f"RCS of {target} against {across}{at}, from {frame['rcs_dbsm'].min():.0f} to {peak['rcs_dbsm']:.0f} dBsm."
    caption = (
        f"{target}: backscatter RCS{at}. The largest is {peak['rcs_dbsm']:.1f} dBsm, at azimuth "
        f"{peak['azimuth']:.1f}°, elevation {peak['elevation']:.1f}°; the median is "
        f"{frame['rcs_dbsm'].median():.1f} dBsm.{note}"
    )
    return figure(f"rcs_{target}", drawing, frame, alt, caption, wide=drawing.get_figwidth() > WIDE)


def _rcs_round(field):
    """Polar plots of RCS, a panel per elevation and a colour per polarization, and whether the curves are smooth.

    0° is to the right, as x is. field: (P, E, A) with its axes.
    """
    field = field.transpose("polarization", "elevation", "azimuth")
    azimuth, values = between(field.values, field.azimuth.values)
    level, turn = rcs_dbsm(values), np.radians(np.append(azimuth, azimuth[0] + 360))
    count = field.sizes["elevation"]
    columns = min(count, ACROSS)
    rows = -(-count // columns)
    drawing = canvas(max(2.7 * columns, 4.2), 0.5 + (2.9 if count > 1 else 3.9) * rows)
    grid = drawing.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "polar"})
    low, high = _levels(level)
    for place, axes in enumerate(grid.flat):
        axes.set_visible(place < count)
        if place >= count:
            continue
        for name, color, curves in zip(field.polarization.values, itertools.cycle(PALETTE), level):
            curve = np.append(curves[place], curves[place, 0])
            axes.plot(turn, np.maximum(curve, low), color=color, lw=1, label=f"{name} [dBsm]")
        axes.set_title(f"elevation {field.elevation.values[place]:g}°".replace("-", "−"))
        axes.set_ylim(low, high)
        axes.set_xticks(np.radians(np.arange(0, 360, 45)))
        axes.yaxis.set_major_locator(matplotlib.ticker.MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes.set_rlabel_position(67.5)
        axes.tick_params(labelsize=7, pad=0)
    draw_legend(drawing, grid.flat)
    return drawing, len(azimuth) > field.sizes["azimuth"]


def _levels(level):
    """The least and the most dBsm of a plot: deep nulls would flatten the rest."""
    top = float(level.max())
    return max(float(level.min()) - 2, top - DEEP), top + 1


def between(field, azimuth):
    """A field over a closed circle between its samples, where these tell it: finer azimuths, and the field there.

    field: (..., A); azimuth: (A,) degrees. What turns is band-limited (its harmonics end near 2 k times its radius): if
    the highest tenth of the harmonics that the samples tell apart is empty, the sum of all of them is the field
    everywhere. Else both are given back as they are.
    """
    count = len(azimuth)
    harmonics = np.fft.fftshift(np.fft.fft(field, axis=-1), axes=-1)
    order = np.abs(np.arange(count) - count // 2)
    power = np.abs(harmonics) ** 2
    if power[..., order > 0.45 * count].sum() > QUIET * power.sum():
        return azimuth, field
    finer = SMOOTH * count
    padded = np.zeros((*field.shape[:-1], finer), complex)
    first = finer // 2 - count // 2
    padded[..., first : first + count] = harmonics
    values = np.fft.ifft(np.fft.ifftshift(padded, axes=-1), axis=-1) * SMOOTH
    return azimuth[0] + np.arange(finer) * 360 / finer, values


def _rcs_over(across, frame, looks):
    """RCS over what is no closed circle: a panel per polarization."""
    polarizations = frame["polarization"].unique()
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.8 + 2.1 * len(polarizations), sharey=False)
    scale, label = AXES[across]
    for axes, polarization in zip(grid[:, 0], polarizations, strict=True):
        part = frame[frame["polarization"] == polarization]
        for angle, color in looks.items():
            curve = part if angle is None else part[part["elevation"] == angle]
            look = {"color": color, "marker": "o" if len(curve) < 3 else None}
            if len(looks) > 1:
                look["label"] = f"elevation {angle:g}°"
            axes.plot(scale * curve[across], curve["rcs_dbsm"], **look)
        axes.set(ylabel=f"{polarization} RCS [dBsm]")
        axes.margins(x=0.01)
        axes.set_ylim(bottom=_levels(part["rcs_dbsm"])[0])
    axes.set_xlabel(label)
    draw_legend(drawing, grid.flat)
    return drawing


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
    frame = pd.DataFrame({"target": target, **places, "level_db": level.ravel().round(2)})
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
                "directions": dataset.sizes["elevation"] * dataset.sizes["azimuth"],
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
