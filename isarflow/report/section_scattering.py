"""The solved fields: RCS against angle, range profiles, and how well the equations were solved."""

import numpy as np
import pandas as pd

from isarflow.core.words import number, signed
from isarflow.imaging.range_profiles import range_profiles
from isarflow.mesh.read.target import is_metal
from isarflow.report.layout import Section, canvas, figure
from isarflow.report.rcs_figures import cut_figure, draw_map
from isarflow.scattering.fields.cuts import by_transmitter
from isarflow.scattering.materials import described
from isarflow.scattering.solver import build_solver

PLACE, NEEDS = ("fields", 2), "targets"  # on the page, see page.py
CURVES = 7  # elevations in one plot at most
DYNAMIC_RANGE = 40  # dB, of range profiles


def section(results):
    figures, text = [], [_method(results)] if results.meshed else []
    for name in results.drawn:
        dataset = results.scattering(name)
        text.append(origin(name, dataset.attrs, name in results.meshed))
        for title, part in by_transmitter(name, dataset, CURVES):
            drawn = title, part, results.reach(name), CURVES
            figures.append(cut_figure(*drawn, polar=True) or cut_figure(*drawn))
        if results.images_are_made:
            figures.append(profile_figure(name, dataset))
    return Section(id="scattering", title="Scattering", text=tuple(text), figures=tuple(figures))


def _method(results):
    settings, sphere = results.settings["scattering"], results.sphere
    solver = getattr(build_solver(settings), "name", f"solver '{settings['solver']}'")
    text = f"The {solver} gives the scattered field for every frequency and direction."
    if "error_db" not in sphere:
        return text
    return (
        f"{text} A sphere of {sphere['radius_wavelengths']:g} wavelengths' radius, solved in this run with the same "
        f"settings at {sphere['edges_per_wavelength']:g} edges a wavelength, has a backscatter "
        f"{signed(sphere['error_db'])} dB and {signed(sphere['phase_deg'], 2)}° from the Mie series."
    )


def origin(name, attrs, solved):
    """Return how large a target's systems were and how well solved, or which files its store, of `attrs`, is from."""
    if not solved:
        files = ", ".join(f"{path} (SHA-256 {digest[:12]}…)" for path, digest in attrs["origin"].items())
        return f"The field of {name} was not solved here; it comes from {files}."
    counts, residuals = ([one for one in attrs[key] or () if one is not None] for key in ("unknowns", "residual"))
    words = [attrs.get("formulation", attrs.get("solver"))]
    if counts:
        ends = dict.fromkeys((min(counts), max(counts)))
        words = [words[0].upper(), f"{' to '.join(f'{count:,}' for count in ends)} unknowns"]
    if "material" in attrs:
        words.insert(1, _made_of(attrs))
    for part, own in sorted(attrs.get("parts", {}).items(), reverse=True):
        words.insert(1, f"{part}: {_made_of(own)}")
    if residuals:
        words.append(f"largest relative residual {number(max(residuals), 2)}")
    return f"{name}: {', '.join(words)}."


def _made_of(own):
    """Say what a target, or a part of one, is made of."""
    return "metal" if is_metal(own) else described(own["material"])


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
        "relative to the strongest. Negative range is towards the radar; a centre seen from all round draws a sine."
    )
    return figure(f"range_profiles_{target}", drawing, data, caption)
