"""ISAR images: every target over azimuth, one over elevation and SNR, and what image formation does to a scatterer."""

from contextlib import suppress

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.core.errors import InputError
from isarflow.core.sweep import snr_label
from isarflow.imaging.geometry import imager_of, planned
from isarflow.imaging.point_response import point_response
from isarflow.report.conditions import noise_words
from isarflow.report.draw_images import COLUMNS, FLOOR_DB, edges, gallery, pixel_table
from isarflow.report.layout import BLACK, BLUE, Section, figure, table
from isarflow.report.plots import draw_pixels, finish, panels
from isarflow.report.section_alike import standardized
from isarflow.report.selection import GALLERY_AZIMUTHS, GALLERY_ELEVATIONS, around, evenly, noise_snrs, noise_target

PLACE, NEEDS = ("imaging", 1), "images_are_made"  # on the page, see page.py
BINS = 40  # of the histograms
PLACES = 13  # of scatterers, along each axis of the extent
AXES = ("range", "crossrange")
# What is drawn of a scatterer, by the CSV file's column: measure, label, colour map, bounds, and which may be exceeded.
RESPONSE = {
    "peak_loss_db": ("loss_db", "peak loss [dB]", "viridis_r", 0, 8, "max"),
    "ghost_db": ("ghost_db", "strongest ghost [dB]", "magma", -45, 0, "both"),
    "position_error_pixels": ("error", "position error [pixels]", "cividis", 0, 0.5, "max"),
}


def section(results):
    """Return the Section of the images."""
    shown = noise_target(results.settings["targets"])
    text = (
        f"Every image is divided by its own peak and shown from 0 to {FLOOR_DB} dB of it. Range is measured from the "
        "target's origin along the line of sight, negative towards the radar, which looks from the bottom of each "
        "image. Cross-range is at right angles to it, in the plane of the turn. A white line is the outline of the "
        "target's mesh, where it has one, as it lies in the image plane."
    )
    text += "" if planned(results.settings)["coherent"] else " Only magnitudes are kept; there is no phase."
    figures = [azimuth_gallery(results, name) for name in results.targets]
    figures += [elevation_gallery(results, shown), *channel_gallery(results, shown), noise_gallery(results, shown)]
    figures += [*alike_figure(results), *definitions_figure(results), response_figure(results, shown)]
    text, tables = (text + channels_text(results),), (images_table(results),)
    return Section(id="images", title="Images", text=text, figures=tuple(figures), tables=tables)


def channels_text(results):
    """Return sentences on how images of several polarizations are shown; nothing of one."""
    first, *others = results.polarizations
    text = (
        f" An image has a channel for each of {', '.join([first, *others])} and one peak over all of them. Where no "
        f"polarization is named, {first} is shown; the SNR is that of {first}, and all channels have its noise."
    )
    return text if others else ""


def images_table(results):
    """Return the Table, by target, of how many images there are, what they resolve, and the two definitions of SNR."""
    rows, noise, megabytes = [], results.settings["noise"], planned(results.settings)["bytes"] / 1e6
    for name in results.targets:
        dataset = results.images(name, "clean")
        attrs, sizes = dataset.attrs, dataset.sizes
        row = {"target": name, "images": sizes["elevation"] * sizes["azimuth"]}
        row["pixels"] = " × ".join(str(sizes[axis]) for axis in AXES)
        row |= {f"{axis}_pixel_m": float(dataset[axis][1] - dataset[axis][0]) for axis in AXES}
        row["aperture_deg"] = attrs["aperture_angle"]
        row |= {f"{axis}_{what}_m": attrs[f"{axis}_{what}"] for what in ("resolution", "extent") for axis in AXES}
        row |= {"clean_store_mb": megabytes, "snr_store_mb": noise["realizations"] * megabytes}
        rows.append(row | {"snr_definition_offset_db": attrs["snr_definition_offset_db"]})
    shown = {
        "target": "{target}",
        "images": "{images:,}",
        "pixels": "{pixels}",
        "of [m]": "{range_pixel_m:.3f} × {crossrange_pixel_m:.3f}",
        "aperture [°]": "{aperture_deg:.1f}",
        "resolution, range × cross-range [m]": "{range_resolution_m:.3f} × {crossrange_resolution_m:.3f}",
        "extent, range × cross-range [m]": "{range_extent_m:.2f} × {crossrange_extent_m:.2f}",
        "stores: clean, each SNR [MB]": "{clean_store_mb:.3g}, {snr_store_mb:.3g}",
        "peak_3db over mean [dB]": "{snr_definition_offset_db:.2f}",
    }
    caption = (
        "Noise-free images of each target, and the size of their stores. The same noise reads higher as SNR by the "
        "mean power of samples within 3 dB of the aperture's peak (peak_3db) than by that of the whole aperture "
        f"(mean): by the last column on average. This run uses {noise['definition']}."
    )
    return table("images", pd.DataFrame(rows), shown, caption)


def azimuth_gallery(results, target):
    """Draw noise-free images of a target at evenly spread azimuths, elevation nearest 0."""
    cut = results.images(target, "clean").image.sel(elevation=0, method="nearest")
    cut = cut.isel(azimuth=around(cut.sizes["azimuth"], GALLERY_AZIMUTHS))
    note = "At azimuth 0° the radar is on the x axis, before the nose of what has one."
    for line in results.published_galleries.query("target == @target").to_dict("records"):
        note += f" The thesis's figure {line['figure']} is of a target of this kind: {line['shows']}."
    return _over(results, f"images_{target}", target, cut, "azimuth", f"elevation {float(cut.elevation):g}°", note)


def elevation_gallery(results, target):
    """Draw noise-free images of a target at evenly spread elevations, azimuth an eighth of the way."""
    cut = results.images(target, "clean").image
    cut = cut.sel(elevation=evenly(cut.elevation.values.tolist(), GALLERY_ELEVATIONS))
    cut = cut.isel(azimuth=cut.sizes["azimuth"] // 8)
    note = "Away from the horizon the image plane is inclined: cross-range shrinks with the cosine of the elevation."
    return _over(results, "gallery_elevation", target, cut, "elevation", f"azimuth {float(cut.azimuth):.0f}°", note)


def _over(results, name, target, cut, axis, at, note):
    """Draw a target's noise-free images over an angle, by its name. cut: the images; at: the other angle in words."""
    images = {f"{axis} {image[axis]:.4g}°": image for image in cut.transpose(axis, ...).load()}
    shown = f"{target}: noise-free images over {axis} at {at}."
    return gallery(name, target, images, results.surfaces.get(target), shown, f"{shown} {note}")


def _aspect(image):
    """Return the first image an eighth of the way round at the elevation nearest 0, and that aspect in words."""
    image = image.sel(elevation=0, method="nearest").isel(realization=0, missing_dims="ignore")
    image = image.isel(azimuth=image.sizes["azimuth"] // 8).load()
    return image, f"at azimuth {float(image.azimuth):.0f}°, elevation {float(image.elevation):g}°"


def channel_gallery(results, target):
    """Draw one noise-free image of a target in each of its polarizations; nothing where there is but one."""
    if len(results.polarizations) == 1:
        return ()
    image, at = _aspect(results.every_channel(target, "clean").image)
    images = {name: image.sel(channel=name) for name in results.polarizations}
    shown = f"{target} {at}, noise-free, in {', '.join(images)}."
    caption = f"{shown} Levels are relative to the one peak over all of them."
    return (gallery("gallery_polarization", target, images, results.surfaces.get(target), shown, caption),)


def noise_gallery(results, target):
    """Draw one aspect of one target, clean and at several SNRs."""
    noise, images = results.settings["noise"], {}
    stores = {"no noise": "clean"} | {f"SNR {snr:g} dB": snr_label(snr) for snr in noise_snrs(noise["snr_db"])[::-1]}
    for title, store in stores.items():
        images[title], at = _aspect(results.images(target, store).image)
    shown = f"{target} {at}, with ever more noise, one realization."
    caption = f"{shown} Noise is added before the image is formed; SNR by {noise_words(noise, noise['definition'])}."
    return gallery("gallery_snr", target, images, None, shown, caption)


def alike_figure(results):
    """Draw of each unknown target the noise-free image most like one of a known target, beside that one.

    Likeness is the zero-mean normalised cross-correlation of magnitudes, over all azimuths at the elevation nearest 0.
    Nothing without targets of both roles.
    """
    known, unknown = results.of_role("known"), results.of_role("unknown")
    if not (known and unknown):
        return ()
    images = {name: results.images(name, "clean").image.sel(elevation=0, method="nearest") for name in known + unknown}
    rows, shown, said = {name: standardized(image.values) for name, image in images.items()}, {}, []
    for number, name in enumerate(unknown, start=1):
        likeness = np.stack([rows[name] @ rows[other].T for other in known])
        other, there, here = np.unravel_index(likeness.argmax(), likeness.shape)
        pair = []
        for of, place in ((name, there), (known[other], here)):
            image = images[of][place].load()
            pair.append(f"{of} {float(image.azimuth):.4g}°")
            shown[f"{number}: {pair[-1]}"] = image
        said.append(f"{' and '.join(pair)}, {likeness.max():.2f}")
    alt = "Pairs of ISAR images of unknown and known targets that look alike."
    caption = (
        "Of each unknown target the noise-free image that looks most like one of a known target, and that one, over "
        f"all azimuths at elevation {float(image.elevation):g}°; with the zero-mean normalised cross-correlation of "
        f"their magnitudes: {'; '.join(said)}. Whoever has only seen the known targets may take one for the other."
    )
    return (gallery("images_alike", "", shown, None, alt, caption),)


def definitions_figure(results):
    """Draw by how much the two definitions of SNR differ, image by image: a histogram for each target with its mean.

    Return nothing where no image has a signal.
    """
    offsets = {name: results.images(name, "clean").snr_definition_offset.values.ravel() for name in results.targets}
    offsets = {name: of[np.isfinite(of)] for name, of in offsets.items() if np.isfinite(of).any()}
    if not offsets:
        return ()
    bins = np.linspace(0, max(0.1, *(of.max() for of in offsets.values())), BINS + 1)
    rows, columns = -(-len(offsets) // COLUMNS), min(COLUMNS, len(offsets))
    drawing, grid = panels(rows, columns, 1 + 2.1 * columns, 0.6 + 1.7 * rows)
    tables = []
    for axes, (name, of) in zip(grid.flat, offsets.items(), strict=False):
        share = np.histogram(of, bins)[0] / len(of)
        axes.stairs(share, bins, fill=True, color=BLUE, alpha=0.6)
        axes.axvline(of.mean(), color=BLACK, ls="--", lw=1.2, label="mean")
        axes.set_title(f"{name}: {of.mean():.1f} dB on average")
        tables.append(pd.DataFrame({"target": name, "from_db": bins[:-1], "to_db": bins[1:], "share": share}))
    finish(drawing, grid, "peak_3db over mean [dB]", "share of the images")
    caption = (
        "By how many dB the SNR of an image is higher as peak_3db than as mean, over all noise-free images of a "
        "target; the dashed line is their mean. One number does not turn SNRs of one definition into the other's; "
        "scores by the other definition count each image at its own."
    )
    alt = "Histograms of the difference between the two definitions of SNR, by target."
    return (figure("snr_definitions", drawing, pd.concat(tables), alt, caption, wide=True),)


def response_figure(results, target):
    """Draw peak loss, ghost level and position error of a scatterer over a target's extent, by way to form images."""
    scattering, imaging = results.scattering(target), results.settings["imaging"]
    sweep = scattering.frequency.values, scattering.azimuth.values
    imager, attrs = imager_of(*sweep, imaging), results.images(target, "clean").attrs
    # Half a cell from the edges, where an echo lies on both sides of the image at once.
    places = (np.arange(PLACES) - PLACES // 2) / PLACES
    down, cross = (places * attrs[f"{axis}_extent"] for axis in AXES)
    responses = {}
    for way, changes in (imager.compared or {imaging["imager"]: {}}).items():
        with suppress(InputError):  # this sweep's sector holds no rectangle
            responses[way] = point_response(imager_of(*sweep, imaging | changes), down, cross)
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
    alt = "Peak loss, strongest ghost and position error of a point scatterer over the image."
    caption = (
        "What becomes of a single scatterer, wherever it stands in the unambiguous extent, for this sweep: by how much "
        "its peak is too low, the strongest echo outside its main lobe relative to that peak, and how far the peak is "
        f"off, read between the pixels. This run's images: {imager.words()}. {imager.compared_note}".rstrip()
    )
    return figure("point_response", drawing, pd.concat(tables).round(4), alt, caption)
