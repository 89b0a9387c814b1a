"""Imagers beside each other: every target in one view by each of them, and its scattering centres on its mesh."""

import numpy as np
import pandas as pd

from isarflow.imaging.formation import apertures, with_imager
from isarflow.imaging.geometry import centres, imager_of
from isarflow.imaging.outline import OUTLINE, outline
from isarflow.imaging.target_centres import MOST, near, target_centres
from isarflow.report import plots
from isarflow.report.layout import ON_DARK, VERMILION, Section, figure
from isarflow.report.plots import FLOOR_DB, decibels, draw_pixels, edges, finish, panels, pixel_table

PLACE, NEEDS = ("imaging", 2), "compares_imagers"  # on the page, see page.py
VIEWS = {"from above": plots.TOP, "from the right": plots.SIDE}
LARGEST = 60  # square points of the strongest centre


def section(results):
    """Return the Section of the imagers that the config compares."""
    imaging, first = results.settings["imaging"], results.scattering(results.targets[0])
    sweep = first.frequency.values, first.azimuth.values
    named = results.settings["imagers"].items()
    made = {name: imager_of(*sweep, with_imager(imaging, settings)) for name, settings in named}
    elevation = float(first.elevation.sel(elevation=0, method="nearest"))
    whole = centres(first.azimuth.values, imaging["aperture"])
    number, channel = len(whole) // 8, results.polarizations[0]  # an eighth of the way round
    fields = {name: results.scattering(name).field.sel(polarization=channel) for name in results.drawn}
    text = (
        f"{channel} without noise, azimuth {whole[number]:.0f}°, elevation {elevation:g}°: the same "
        f"samples by each imager. {'; '.join(f'{name}: {imager.words()}' for name, imager in made.items())}."
    )
    figures = [images_figure(results, made, fields, number, (elevation, float(whole[number])))]
    if results.meshed and len(near(first, imaging["aperture"], elevation, whole[number]).elevation) > 1:
        figures.append(centres_figure(results, fields, elevation, whole[number]))
    return Section("imagers", "Imagers beside each other", (text,), tuple(figures))


def images_figure(results, made, fields, number, view):
    """Draw image `number` of every target, a row each, by the imagers `made`, a column each. view: its direction."""
    first, *_ = made.values()
    # Imagers do not span quite the same: what all of them show.
    ylim, xlim = (min((edges(imager.axes()[axis]) for imager in made.values()), key=np.ptp) for axis in (0, 1))
    shape = np.ptp(ylim) / np.ptp(xlim)
    side = max(1.3, 3.8 / max(len(made), len(fields)))
    inches = 1.6 + side * len(made), 0.6 + ((side - 0.1) * shape + 0.1) * len(fields)
    drawing, grid = panels(len(fields), len(made), *inches, layout="compressed")
    tables = []
    for row, (target, field) in zip(grid, fields.items(), strict=True):
        field = field.sel(elevation=view[0]).transpose("frequency", "azimuth")
        samples = apertures(field.values, field.azimuth.values, len(first.angle))[number : number + 1]
        for axes, top, (name, imager) in zip(row, grid[0], made.items(), strict=True):
            down, cross = imager.axes()
            image = np.abs(imager.on_axes(samples.reshape(1, len(field), -1))[0])
            level = decibels(image / (image.max() or 1))
            picture = draw_pixels(axes, level, (*edges(cross), *edges(down)), vmin=FLOOR_DB, vmax=0)
            if target in results.surfaces:
                shadow = outline(*results.surfaces[target], *view)
                axes.contour(*shadow, levels=[OUTLINE], colors=ON_DARK, linewidths=0.7)
            axes.set(xlim=xlim, ylim=ylim)
            top.set_title(name)
            tables.append(pixel_table(down, cross, {"level_db": level.round(2)}, target=target, imager=name))
        row[0].set_ylabel(f"{target}\nrange [m]")
    finish(drawing, grid, "cross-range [m]", legend=False)
    drawing.colorbar(picture, ax=grid, label="|image| [dB]", shrink=0.6, aspect=30, pad=0.02)
    caption = "Every target by each imager, each image relative to its own peak. White: the outline of the mesh."
    return figure("imagers", drawing, pd.concat(tables), caption, wide=len(made) > 2)


def centres_figure(results, fields, elevation, azimuth):
    """Draw each target's scattering centres, as seen from one direction, on its mesh."""
    columns, aperture = len(results.drawn_meshes), results.settings["imaging"]["aperture"]
    drawing, grid = panels(len(VIEWS), columns, 1 + 2.1 * columns, 4.2, sharex=False, sharey=False)
    drawing.draw_without_rendering()
    tables = []
    for column, target in zip(grid.T, results.drawn_meshes, strict=True):
        vertices, triangles = results.surfaces[target]
        places, amplitudes = target_centres(near(fields[target], aperture, elevation, azimuth), vertices)
        strength = np.abs(amplitudes)
        for axes, view in zip(column, VIEWS.values(), strict=True):
            plots.draw_mesh(axes, vertices, triangles, view, edges=False)
            right, up, _ = plots.project(places, *view)
            size = LARGEST * np.sqrt(strength / strength.max(initial=1e-30))
            axes.scatter(right, up, size, color=VERMILION, edgecolors="white", linewidths=0.6, alpha=0.8, zorder=3)
        column[0].set_title(f"{target}: {len(places)}")
        found = dict(zip(("x_m", "y_m", "z_m"), places.T, strict=True)) | {"amplitude_m": strength}
        tables.append(pd.DataFrame({"target": target, **found}))
    for row, name in zip(grid, VIEWS, strict=True):
        row[0].set_ylabel(f"{name} [m]")
    caption = (
        "Scattering centres on the targets' meshes, seen through them, with their number: points of a constant "
        f"amplitude, as few as the Bayesian criterion asks for, {MOST} at most, fitted to all samples within an "
        f"aperture of azimuth {azimuth:.0f}°, elevation {elevation:g}°. A circle's area is the root of its amplitude."
    )
    return figure("scattering_centres", drawing, pd.concat(tables).round(5), caption, wide=columns > 2)
