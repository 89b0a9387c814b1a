"""ISAR images: every target over azimuth, one over elevation and SNR, and what image formation does to a scatterer."""

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

BINS = 40  # of the histograms
PLACES = 13  # of scatterers, along each axis of the extent
# What is drawn of a scatterer: its measure's label, colour map, least and most, and the column of the CSV file.
RESPONSE = {
    "loss_db": ("peak loss [dB]", "viridis_r", 0, 8, "peak_loss_db"),
    "ghost_db": ("strongest ghost [dB]", "magma", -45, 0, "ghost_db"),
    "error": ("position error [pixels]", "cividis", 0, 0.5, "position_error_pixels"),
}


def section(results):
    shown = noise_target(results.settings["targets"])
    return Section(
        id="images",
        title="Images",
        text=(
            "Every image is divided by its own peak. Range is measured from the target's origin along the line of "
            "sight, negative towards the radar, which looks from the bottom of each image. Cross-range is at right "
            "angles to it, in the plane of the turn. A white line is the outline of the target's mesh, where it has "
            "one, as it lies in the image plane."
            + ("" if planned(results.settings)["coherent"] else " Only magnitudes are kept; there is no phase.")
            + channels_text(results),
        ),
        figures=(
            *(azimuth_gallery(results, name) for name in results.targets),
            elevation_gallery(results, shown),
            *channel_gallery(results, shown),
            noise_gallery(results, shown),
            *alike_figure(results),
            *definitions_figure(results),
            response_figure(results.images(shown, "clean"), results.scattering(shown), results.settings["imaging"]),
        ),
        tables=(images_table(results),),
    )


def channels_text(results):
    """How images of several polarizations are shown, a sentence; nothing of one."""
    first, *others = results.polarizations
    if not others:
        return ""
    return (
        f" An image has a channel for each of {', '.join(results.polarizations)} and one peak over all of them. Where "
        f"no polarization is named, {first} is shown; the SNR is that of {first}, and all channels have its noise."
    )


def images_table(results):
    """Per target: how many images, what they resolve, and by how much the two definitions of SNR differ."""
    rows, noise, megabytes = [], results.settings["noise"], planned(results.settings)["bytes"] / 1e6
    for name in results.targets:
        dataset = results.images(name, "clean")
        attrs, sizes = dataset.attrs, dataset.sizes
        rows.append(
            {
                "target": name,
                "images": sizes["elevation"] * sizes["azimuth"],
                "pixels": f"{sizes['range']} × {sizes['crossrange']}",
                "range_pixel_m": float(dataset.range[1] - dataset.range[0]),
                "crossrange_pixel_m": float(dataset.crossrange[1] - dataset.crossrange[0]),
                "aperture_deg": attrs["aperture_angle"],
                **{f"{axis}_resolution_m": attrs[f"{axis}_resolution"] for axis in ("range", "crossrange")},
                **{f"{axis}_extent_m": attrs[f"{axis}_extent"] for axis in ("range", "crossrange")},
                "clean_store_mb": megabytes,
                "snr_store_mb": noise["realizations"] * megabytes,
                "snr_definition_offset_db": attrs["snr_definition_offset_db"],
            }
        )
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
        "Noise-free images of each target, and the size of their stores. The last column says by how many dB, on "
        "average over the images, the same noise reads higher as SNR when signal power is the mean over samples within "
        "3 dB of the aperture's peak (peak_3db) than when it is the mean over the whole aperture (mean); this run uses "
        f"{noise['definition']}."
    )
    return table("images", pd.DataFrame(rows), shown, caption)


def azimuth_gallery(results, target):
    """Noise-free images of a target at evenly spread azimuths, elevation nearest 0."""
    cut = results.images(target, "clean").image.sel(elevation=0, method="nearest")
    cut = cut.isel(azimuth=around(cut.sizes["azimuth"], GALLERY_AZIMUTHS))
    at = f"elevation {float(cut.elevation):g}°"
    note = "At azimuth 0° the radar is on the x axis, before the nose of what has one."
    for line in results.published_galleries[results.published_galleries["target"] == target].to_dict("records"):
        note += f" The thesis's figure {line['figure']} is of a target of this kind: {line['shows']}."
    return angle_gallery(results, f"images_{target}", target, "azimuth", cut, at, note)


def elevation_gallery(results, target):
    """Noise-free images of a target at evenly spread elevations, azimuth an eighth of the way."""
    cut = results.images(target, "clean").image
    cut = cut.isel(azimuth=cut.sizes["azimuth"] // 8)
    cut = cut.sel(elevation=evenly(cut.elevation.values.tolist(), GALLERY_ELEVATIONS))
    at = f"azimuth {float(cut.azimuth):.0f}°"
    note = "Away from the horizon the image plane is inclined: cross-range shrinks with the cosine of the elevation."
    return angle_gallery(results, "gallery_elevation", target, "elevation", cut, at, note)


def channel_gallery(results, target):
    """One noise-free image of a target in each of its polarizations; nothing where there is but one."""
    if len(results.polarizations) == 1:
        return ()
    image = results.every_channel(target, "clean").image.sel(elevation=0, method="nearest")
    image = image.isel(azimuth=image.sizes["azimuth"] // 8).load()
    images = {name: image.sel(channel=name) for name in results.polarizations}
    names = ", ".join(images)
    alt = f"One noise-free ISAR image of {target} in {names}."
    caption = (
        f"{target} at azimuth {float(image.azimuth):.0f}°, elevation {float(image.elevation):g}°, noise-free, in "
        f"{names}: 0 to {FLOOR_DB} dB of the one peak over all of them."
    )
    return (gallery("gallery_polarization", target, images, results.surfaces.get(target), alt, caption),)


def angle_gallery(results, name, target, axis, cut, at, note):
    """A target's images over one angle. axis: its name; cut: the images; at: the other angle in words."""
    cut = cut.load()
    images = {f"{axis} {float(angle):.4g}°": cut.sel({axis: angle}) for angle in cut[axis].values}
    first, *_, last = [*images] * 2  # there may be only one
    alt = f"Noise-free ISAR images of {target} at {len(images)} {axis}s from {first} to {last}."
    caption = f"{target}: noise-free images over {axis} at {at}, 0 to {FLOOR_DB} dB of each image's peak. {note}"
    return gallery(name, target, images, results.surfaces.get(target), alt, caption)


def noise_gallery(results, target):
    """One aspect of one target, clean and at several SNRs."""
    clean = results.images(target, "clean").image.sel(elevation=0, method="nearest")
    clean = clean.isel(azimuth=clean.sizes["azimuth"] // 8)
    images, noise = {"no noise": clean.load()}, results.settings["noise"]
    snrs = noise_snrs(noise["snr_db"])
    for snr in reversed(snrs):
        noisy = results.images(target, snr_label(snr)).image.isel(realization=0)
        where = {"elevation": clean.elevation, "azimuth": clean.azimuth}
        images[f"SNR {snr:g} dB"] = noisy.sel(where, method="nearest").load()
    alt = f"One ISAR image of {target} with ever more noise, from none to an SNR of {snrs[0]:g} dB."
    caption = (
        f"{target} at azimuth {float(clean.azimuth):.0f}°, elevation {float(clean.elevation):g}°, with ever more "
        f"noise, one realization. Noise is added before the image is formed; SNR by "
        f"{noise_words(noise, noise['definition'])}."
    )
    return gallery("gallery_snr", target, images, None, alt, caption)


def alike_figure(results):
    """Of each unknown target the image that looks most like one of a known target, beside that one, without noise.

    Likeness is the zero-mean normalised cross-correlation of magnitudes, over all azimuths at the elevation nearest 0.
    Nothing without targets of both roles.
    """
    cuts = {
        name: results.images(name, "clean").image.sel(elevation=0, method="nearest").load()
        for name in results.of_role("known") + results.of_role("unknown")
    }
    rows = {name: standardized(cut.values) for name, cut in cuts.items()}
    images, said = {}, []
    for number, unknown in enumerate(results.of_role("unknown"), start=1):
        likeness = {known: rows[unknown] @ rows[known].T for known in results.of_role("known")}
        if not likeness:
            return ()
        known = max(likeness, key=lambda name: likeness[name].max())
        there, here = np.unravel_index(likeness[known].argmax(), likeness[known].shape)
        pair = {name: cuts[name].isel(azimuth=place) for name, place in ((unknown, there), (known, here))}
        named = {f"{name} {float(image.azimuth):.4g}°": image for name, image in pair.items()}
        images |= {f"{number}: {title}": image for title, image in named.items()}
        said.append(f"{' and '.join(named)}, {likeness[known].max():.2f}")
    if not images:
        return ()
    caption = (
        "Of each unknown target the noise-free image that looks most like one of a known target, and that one, over "
        f"all azimuths at elevation {float(next(iter(images.values())).elevation):g}°; with the zero-mean normalised "
        f"cross-correlation of their magnitudes: {'; '.join(said)}. Whoever has only seen the known targets may take "
        "one for the other."
    )
    alt = f"Pairs of ISAR images of unknown and known targets that look alike: {'; '.join(said)}."
    return (gallery("images_alike", "", images, None, alt, caption),)


def definitions_figure(results):
    """By how much the two definitions of SNR differ, image by image: a histogram for each target with its mean.

    Nothing where no image has a signal.
    """
    offsets = {name: results.images(name, "clean").snr_definition_offset.values.ravel() for name in results.targets}
    offsets = {name: of[np.isfinite(of)] for name, of in offsets.items() if np.isfinite(of).any()}
    if not offsets:
        return ()
    bins = np.linspace(0, max(max(of.max() for of in offsets.values()), 0.1), BINS + 1)
    rows = -(-len(offsets) // COLUMNS)
    drawing, grid = panels(rows, min(COLUMNS, len(offsets)), 1 + 2.1 * min(COLUMNS, len(offsets)), 0.6 + 1.7 * rows)
    tables = []
    for axes, (name, of) in zip(grid.flat, offsets.items(), strict=False):
        share = np.histogram(of, bins)[0] / len(of)
        axes.stairs(share, bins, fill=True, color=BLUE, alpha=0.6)
        axes.axvline(of.mean(), color=BLACK, ls="--", lw=1.2, label="mean")
        axes.set_title(f"{name}: {of.mean():.1f} dB on average")
        tables.append(pd.DataFrame({"target": name, "from_db": bins[:-1], "to_db": bins[1:], "share": share}))
    finish(drawing, grid, "peak_3db over mean [dB]", "share of the images")
    said = ", ".join(f"{name} {of.min():.1f} to {of.max():.1f}" for name, of in offsets.items())
    caption = (
        "By how many dB the SNR of an image is higher as peak_3db than as mean, over all noise-free images of a "
        f"target; the dashed line is their mean. It spans, in dB: {said}. So one number does not turn SNRs of "
        "one definition into the other's; scores by the other definition count each image at its own."
    )
    alt = f"Histograms of the difference between the two definitions of SNR, by target. It spans, in dB: {said}."
    return (figure("snr_definitions", drawing, pd.concat(tables), alt, caption, wide=True),)


def response_figure(dataset, scattering, imaging):
    """Peak loss, ghost level and position error of one scatterer over the extent, per way to form images."""
    sweep = scattering.frequency.values, scattering.azimuth.values
    imager = imager_of(*sweep, imaging)
    # Half a cell from the edges, where an echo lies on both sides of the image at once.
    places = (np.arange(PLACES) - PLACES // 2) / PLACES
    down, cross = (places * dataset.attrs[f"{axis}_extent"] for axis in ("range", "crossrange"))
    responses = {}
    for way, changes in (imager.compared or {imaging["imager"]: {}}).items():
        try:
            responses[way] = point_response(imager_of(*sweep, imaging | changes), down, cross)
        except InputError:  # this sweep's sector holds no rectangle
            continue
    drawing, grid = panels(len(responses), len(RESPONSE), 6.6, 0.5 + 1.75 * len(responses), layout="compressed")
    tables, worst = [], []
    for row, (way, response) in zip(grid, responses.items(), strict=True):
        for axes, (name, (_, colors, low, high, _)) in zip(row, RESPONSE.items(), strict=True):
            extent = (*edges(cross), *edges(down))
            picture = draw_pixels(axes, response[name], extent, cmap=colors, vmin=low, vmax=high)
            axes.xaxis.set_major_locator(MaxNLocator(4))
            drawing.colorbar(picture, ax=axes, shrink=0.85, extend="both" if name == "ghost_db" else "max")
        row[0].set_ylabel(f"{way}\nrange [m]")
        values = {column: response[name] for name, (*_, column) in RESPONSE.items()}
        tables.append(pixel_table(down, cross, values, imager=way))
        loss, error = max(response["loss_db"].max(), 0), response["error"].max()
        worst.append(f"{way}: up to {loss:.1f} dB and {error:.2f} pixels")
    for axes, (label, *_) in zip(grid[0], RESPONSE.values(), strict=True):
        axes.set_title(label)
    finish(drawing, grid, "cross-range [m]", legend=False)
    worst = "; ".join(worst)
    alt = f"Peak loss, strongest ghost and position error of a point scatterer over the image. {worst}."
    caption = (
        "What becomes of a single scatterer, wherever it stands in the unambiguous extent, for this sweep: by how much "
        "its peak is too low, the strongest echo outside its main lobe relative to that peak, and how far the peak is "
        f"off, read between the pixels. Worst loss and error - {worst}. This run's images: {imager.words()}. "
        f"{imager.compared_note}".rstrip()
    )
    return figure("point_response", drawing, pd.concat(tables).round(4), alt, caption)
