"""The solved fields: RCS against angle, range profiles, and how well the equations were solved."""

import numpy as np
import pandas as pd

from isarflow.core.sweep import C0
from isarflow.report.layout import Section, canvas, figure, number, signed
from isarflow.report.rcs_figures import by_transmitter, cut_figure, draw_map
from isarflow.scattering.solver import build

PLACE, NEEDS = ("fields", 2), "targets"  # on the page, see page.py
CURVES = 7  # elevations in one plot at most
DYNAMIC_RANGE = 40  # dB, of range profiles
OVERSAMPLING = 8  # of the same


def section(results):
    """Return the Section of the fields: how they were solved or where they come from, RCS and range profiles."""
    figures, text = [], [_method(results)] if results.meshed else []
    for name in results.targets:
        dataset = results.scattering(name)
        text.append(_origin(name, dataset.attrs, name in results.meshed))
        for title, part in by_transmitter(name, dataset, CURVES):
            drawn = title, part, results.reach(name), CURVES
            figures.append(cut_figure(*drawn, polar=True) or cut_figure(*drawn))
        if results.images_are_made:
            figures.append(profile_figure(name, dataset))
    return Section(id="scattering", title="Scattering", text=tuple(text), figures=tuple(figures))


def _method(results):
    """Return sentences on the solver and its sphere."""
    settings, sphere = results.settings["scattering"], results.sphere
    solver = getattr(build(settings), "name", f"solver '{settings['solver']}'")
    text = f"The {solver} gives the scattered field for every frequency and direction."
    if "error_db" in sphere:
        text += (
            f" A sphere of {sphere['radius_wavelengths']:g} wavelengths' radius, solved in this run with the same "
            f"settings at {sphere['edges_per_wavelength']:g} edges a wavelength, has a backscatter "
            f"{signed(sphere['error_db'])} dB and {signed(sphere['phase_deg'], 2)}° from the Mie series."
        )
    return text


def _origin(name, attrs, solved):
    """Return how large a target's systems were and how well solved, or which files its store, of `attrs`, is from."""
    if not solved:
        files = ", ".join(f"{path} (SHA-256 {digest[:12]}…)" for path, digest in attrs["origin"].items())
        return f"The field of {name} was not solved here; it comes from {files}."
    counts, residuals = ([one for one in attrs[key] or () if one is not None] for key in ("unknowns", "residual"))
    words = [attrs.get("formulation", attrs.get("solver"))]
    if counts:
        ends = dict.fromkeys((min(counts), max(counts)))
        words = [words[0].upper(), f"{' to '.join(f'{count:,}' for count in ends)} unknowns"]
    if residuals:
        words.append(f"largest relative residual {number(max(residuals), 2)}")
    return f"{name}: {', '.join(words)}."


def range_profiles(field, frequency):
    """Return range (ranges,) in m, one unambiguous length, negative towards the radar, and profiles (ranges, azimuth).

    field: (frequency, azimuth) in m; frequency: Hz. A Hamming window, then the sum over frequencies.
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
    picture = draw_map(axes, azimuth, distance, level, 0, DYNAMIC_RANGE)
    axes.set(xlabel="azimuth [°]", ylabel="range [m]")
    drawing.colorbar(picture, label="level [dB]", pad=0.02)
    places = {"range_m": np.repeat(distance, len(azimuth)), "azimuth_deg": np.tile(azimuth, len(distance))}
    data = pd.DataFrame({"target": target, **places, "level_db": level.ravel().round(1)})
    caption = (
        f"{target}: range profiles over azimuth at elevation {float(cut.elevation):g}°, {cut.polarization.item()}, "
        "relative to the strongest. Negative range is towards the radar; a scattering centre seen from all round draws "
        "a sine."
    )
    return figure(f"range_profiles_{target}", drawing, data, caption)
