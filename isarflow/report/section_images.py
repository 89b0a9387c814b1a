"""ISAR images: every target over azimuth, one over elevation and SNR, and what image formation does to a scatterer."""

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.core.sweep import snr_label
from isarflow.imaging.geometry import imager_of, planned
from isarflow.imaging.point_response import by_way
from isarflow.report.conditions import noise_words
from isarflow.report.layout import Section, figure
from isarflow.report.plots import FLOOR_DB, draw_pixels, edges, finish, gallery, panels, pixel_table
from isarflow.report.selection import GALLERY_VIEWS, evenly, noise_snrs

PLACE, NEEDS = ("imaging", 1), "images_are_made"  # on the page, see page.py
PLACES = 13  # of scatterers, along each axis of the extent
# What is drawn of a scatterer, by the CSV file's column: measure, label, colour map, bounds, and which may be exceeded.
RESPONSE = {
    "peak_loss_db": ("loss_db", "peak loss [dB]", "viridis_r", 0, 8, "max"),
    "ghost_db": ("ghost_db", "strongest ghost [dB]", "magma", -45, 0, "both"),
    "position_error_pixels": ("error", "position error [pixels]", "cividis", 0, 0.5, "max"),
}


def section(results):
    figures = *galleries(results), response_figure(results, results.targets[0])
    return Section("images", "Images", images_text(results), figures)


def images_text(results):
    """Return paragraphs: how many images there are and what they resolve, the definitions of SNR, how all is shown."""
    plan, copies = planned(results.settings), results.settings["noise"]["realizations"]
    made = (
        f"Of each target there are {plan['images']:,} noise-free images, of {plan['range_pixels']} × "
        f"{plan['crossrange_pixels']} pixels of {plan['range_pixel']:.3f} × {plan['crossrange_pixel']:.3f} m (range × "
        f"cross-range), each from an aperture of {plan['aperture_angle']:.1f}°. They resolve "
        f"{plan['range_resolution']:.3f} × {plan['crossrange_resolution']:.3f} m and are unambiguous over "
        f"{plan['range_extent']:.2f} × {plan['crossrange_extent']:.2f} m. Their store has {plan['bytes'] / 1e6:.3g} "
        f"MB, the store of each SNR {copies * plan['bytes'] / 1e6:.3g} MB."
    )
    apart = []
    for name in results.drawn:
        offset = results.images(name, "clean").snr_definition_offset.values
        if np.isfinite(offset).any():  # it is NaN of an image without a signal
            between = f"{np.nanmin(offset):.1f} to {np.nanmax(offset):.1f} dB"
            apart.append(f"{np.nanmean(offset):.1f} dB for {name} ({between})")
    snr = (
        "The same noise reads higher as SNR by peak_3db power than by mean power, on average (and image by image) by "
        f"{'; '.join(apart)}. Scores by the other definition count each image at its own."
    )
    text = (
        f"Every image is divided by its own peak and shown from 0 to {FLOOR_DB} dB of it. Range is measured from the "
        "target's origin along the line of sight, negative towards the radar, which looks from the bottom of each "
        "image. A white line is the outline of the target's mesh, where it has one, as it lies in the image plane."
    )
    if not plan["coherent"]:
        text += " Only magnitudes are kept; there is no phase."
    if len(results.polarizations) > 1:
        text += (
            f" An image has a channel for each of {', '.join(results.polarizations)} and one peak over all of them; "
            "the first is shown where none is named. The SNR is its, and all channels have its noise."
        )
    return (made, snr, text) if apart else (made, text)


def galleries(results):
    """Yield the figures of noise-free images over the angles, of every target over azimuth, and of ever more noise."""
    for target in results.drawn:
        image = results.images(target, "clean").image.sel(elevation=0, method="nearest")
        # Evenly spread on a circle: the last is not the first.
        image = image.isel(azimuth=np.unique(np.arange(GALLERY_VIEWS) * image.sizes["azimuth"] // GALLERY_VIEWS))
        note = "At azimuth 0° the radar is on the x axis, before the nose of what has one."
        yield _over(results, f"images_{target}", target, image, "azimuth", "elevation", note)
    target, noise = results.targets[0], results.settings["noise"]
    image = results.images(target, "clean").image
    image = image.sel(elevation=evenly(image.elevation.values.tolist(), GALLERY_VIEWS))
    image = image.isel(azimuth=image.sizes["azimuth"] // 8)
    note = "Away from the horizon the image plane is inclined: cross-range shrinks with the cosine of the elevation."
    yield _over(results, "gallery_elevation", target, image, "elevation", "azimuth", note)
    if len(results.polarizations) > 1:
        image, at = _aspect(results.every_channel(target, "clean"))
        images = {name: image.sel(channel=name) for name in results.polarizations}
        caption = f"{target} {at}, noise-free, in {', '.join(images)}. Levels are relative to the one peak of them all."
        yield gallery("gallery_polarization", target, images, results.surfaces.get(target), caption)
    images = {"no noise": _aspect(results.images(target, "clean"))[0]}
    for snr in noise_snrs(noise["snr_db"])[::-1]:
        images[f"SNR {snr:g} dB"], at = _aspect(results.images(target, snr_label(snr)))
    caption = f"{target} {at}, with ever more noise, which is added before the image is formed. SNR by "
    yield gallery("gallery_snr", target, images, None, f"{caption}{noise_words(noise, noise['definition'])}.")


def _over(results, name, target, image, axis, other, note):
    images = {f"{axis} {one[axis]:.4g}°": one for one in image.transpose(axis, ...).load()}
    shown = f"{target}: noise-free images over {axis} at {other} {float(image[other]):.4g}°."
    return gallery(name, target, images, results.surfaces.get(target), f"{shown} {note}")


def _aspect(dataset):
    """Return the first image an eighth of the way round at the elevation nearest 0, and that aspect in words."""
    image = dataset.image.sel(elevation=0, method="nearest").isel(realization=0, missing_dims="ignore")
    image = image.isel(azimuth=image.sizes["azimuth"] // 8).load()
    return image, f"at azimuth {float(image.azimuth):.0f}°, elevation {float(image.elevation):g}°"


def response_figure(results, target):
    """Draw peak loss, ghost level and position error of a scatterer over a target's extent, by way to form images."""
    scattering, imaging = results.scattering(target), results.settings["imaging"]
    sweep = scattering.frequency.values, scattering.azimuth.values
    imager, attrs = imager_of(*sweep, imaging), results.images(target, "clean").attrs
    # Half a cell from the edges, where an echo lies on both sides of the image at once.
    places = (np.arange(PLACES) - PLACES // 2) / PLACES
    down, cross = (places * attrs[f"{axis}_extent"] for axis in ("range", "crossrange"))
    responses = by_way(*sweep, imaging, down, cross)
    drawing, grid = panels(len(responses), len(RESPONSE), 6.6, 0.5 + 1.75 * len(responses), layout="compressed")
    tables, extent = [], (*edges(cross), *edges(down))
    for row, (way, response) in zip(grid, responses.items(), strict=True):
        values = {column: response[name] for column, (name, *_) in RESPONSE.items()}
        tables.append(pixel_table(down, cross, values, imager=way))
        for axes, top, (name, label, colors, low, high, extend) in zip(row, grid[0], RESPONSE.values(), strict=True):
            picture = draw_pixels(axes, response[name], extent, cmap=colors, vmin=low, vmax=high)
            drawing.colorbar(picture, ax=axes, shrink=0.85, extend=extend)
            axes.xaxis.set_major_locator(MaxNLocator(4))
            top.set_title(label)
        row[0].set_ylabel(f"{way}\nrange [m]")
    finish(drawing, grid, "cross-range [m]", legend=False)
    caption = (
        "What becomes of a single scatterer, wherever it stands in the unambiguous extent, for this sweep: by how much "
        "its peak is too low, the strongest echo outside its main lobe relative to that peak, and how far the peak is "
        f"off, read between the pixels. This run's images: {imager.words()}. {imager.compared_note}".rstrip()
    )
    return figure("point_response", drawing, pd.concat(tables).round(4), caption)
