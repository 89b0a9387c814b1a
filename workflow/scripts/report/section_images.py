"""ISAR images: every target over azimuth, one over elevation and SNR, and what image formation does to a scatterer."""

import numpy as np
import pandas as pd

from core.errors import InputError
from core.sweep import snr_label
from imaging.geometry import imager_of, planned
from imaging.point_response import point_response
from report.draw_images import FLOOR_DB, edges, gallery
from report.layout import Figure, Section, Table, canvas, style, to_svg
from report.selection import GALLERY_AZIMUTHS, GALLERY_ELEVATIONS, around, evenly, noise_snrs, noise_target

PLACES = 13  # of scatterers, along each axis of the extent


def section(results):
    noise, shown = results.settings["noise"], noise_target(results.settings["targets"])
    return Section(
        id="images",
        title="Images",
        text=(
            "Every image is divided by its own peak. Range is measured from the target's origin along the line of "
            "sight, negative towards the radar, which looks from the bottom of each image. Cross-range is at right "
            "angles to it, in the plane of the turn. A white line is the outline of the target's mesh, where it has "
            "one, as it lies in the image plane."
            + ("" if planned(results.settings)["coherent"] else " Only magnitudes are kept; there is no phase."),
        ),
        figures=(
            *(
                azimuth_gallery(name, results.images(name, "clean"), results.surfaces.get(name))
                for name in results.targets
            ),
            elevation_gallery(shown, results.images(shown, "clean"), results.surfaces.get(shown)),
            noise_gallery(
                shown,
                lambda target, store: results.images(target, store),
                noise_snrs(noise["snr_db"]),
                noise["definition"],
            ),
            response_figure(results.images(shown, "clean"), results.scattering(shown), results.settings["imaging"]),
        ),
        tables=(images_table(results),),
    )


def images_table(results):
    """Per target: how many images, what they resolve, and by how much the two definitions of SNR differ."""
    rows = []
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
                "range_resolution_m": attrs["range_resolution"],
                "crossrange_resolution_m": attrs["crossrange_resolution"],
                "range_extent_m": attrs["range_extent"],
                "crossrange_extent_m": attrs["crossrange_extent"],
                "clean_store_mb": dataset.image.nbytes / 1e6,
                "snr_store_mb": results.settings["noise"]["realizations"] * dataset.image.nbytes / 1e6,
                "snr_definition_offset_db": attrs["snr_definition_offset_db"],
            }
        )
    shown = [
        {
            "target": row["target"],
            "images": f"{row['images']:,}",
            "pixels": row["pixels"],
            "of [m]": f"{row['range_pixel_m']:.3f} × {row['crossrange_pixel_m']:.3f}",
            "aperture [°]": f"{row['aperture_deg']:.1f}",
            "resolution, range × cross-range [m]": (
                f"{row['range_resolution_m']:.3f} × {row['crossrange_resolution_m']:.3f}"
            ),
            "extent, range × cross-range [m]": f"{row['range_extent_m']:.2f} × {row['crossrange_extent_m']:.2f}",
            "stores: clean, each SNR [MB]": f"{row['clean_store_mb']:.3g}, {row['snr_store_mb']:.3g}",
            "peak_3db over mean [dB]": f"{row['snr_definition_offset_db']:.2f}",
        }
        for row in rows
    ]
    return Table(
        name="images",
        shown=pd.DataFrame(shown),
        data=pd.DataFrame(rows),
        caption=(
            "Noise-free images of each target, and the size of their stores. The last column says by how many dB the "
            "same noise reads higher as SNR when signal power is the mean over samples within 3 dB of the aperture's "
            "peak (peak_3db) than when it is the mean over the whole aperture (mean); this run uses "
            f"{results.settings['noise']['definition']}."
        ),
    )


def azimuth_gallery(target, dataset, surface):
    """Noise-free images of a target at evenly spread azimuths, elevation nearest 0."""
    cut = dataset.image.sel(elevation=0, method="nearest")
    cut = cut.isel(azimuth=around(cut.sizes["azimuth"], GALLERY_AZIMUTHS)).load()
    panels = [(f"azimuth {float(azimuth):.4g}°", cut.sel(azimuth=azimuth)) for azimuth in cut.azimuth.values]
    svg, frame = gallery(panels, surface)
    frame.insert(0, "target", target)
    return Figure(
        name=f"images_{target}",
        svg=svg,
        data=frame,
        alt=f"Noise-free ISAR images of {target} at {len(panels)} azimuths from {panels[0][0]} to {panels[-1][0]}.",
        caption=(
            f"{target}: noise-free images over azimuth at elevation {float(cut.elevation):g}°, "
            f"0 to {FLOOR_DB} dB of each image's peak. At azimuth 0° the radar is on the x axis, before the nose of "
            "what has one."
        ),
    )


def elevation_gallery(target, dataset, surface):
    """Noise-free images of a target at evenly spread elevations, azimuth an eighth of the way."""
    cut = dataset.image.isel(azimuth=dataset.sizes["azimuth"] // 8)
    cut = cut.sel(elevation=evenly(cut.elevation.values.tolist(), GALLERY_ELEVATIONS)).load()
    panels = [(f"elevation {float(angle):.4g}°", cut.sel(elevation=angle)) for angle in cut.elevation.values]
    svg, frame = gallery(panels, surface)
    frame.insert(0, "target", target)
    return Figure(
        name="gallery_elevation",
        svg=svg,
        data=frame,
        alt=f"Noise-free ISAR images of {target} at {len(panels)} elevations from {panels[0][0]} to {panels[-1][0]}.",
        caption=(
            f"{target}: noise-free images over elevation at azimuth {float(cut.azimuth):.0f}°, 0 to {FLOOR_DB} dB of "
            "each image's peak. Away from the horizon the image plane is inclined: cross-range shrinks with the cosine "
            "of the elevation."
        ),
    )


def noise_gallery(target, read, snrs, definition):
    """One aspect of one target, clean and at several SNRs. `read(target, store)` opens a store of images."""
    clean = read(target, "clean").image.sel(elevation=0, method="nearest")
    clean = clean.isel(azimuth=clean.sizes["azimuth"] // 8)
    panels = [("no noise", clean.load())]
    for snr in reversed(snrs):
        noisy = read(target, snr_label(snr)).image.isel(realization=0)
        where = {"elevation": clean.elevation, "azimuth": clean.azimuth}
        panels.append((f"SNR {snr:g} dB", noisy.sel(where, method="nearest").load()))
    svg, frame = gallery(panels)
    frame.insert(0, "target", target)
    return Figure(
        name="gallery_snr",
        svg=svg,
        data=frame,
        alt=f"One ISAR image of {target} with ever more noise, from none to an SNR of {snrs[0]:g} dB.",
        caption=(
            f"{target} at azimuth {float(clean.azimuth):.0f}°, elevation {float(clean.elevation):g}°, with ever more "
            f"noise, one realization. Noise is added before the image is formed; SNR definition: {definition}."
        ),
    )


def response_figure(dataset, scattering, imaging):
    """Peak loss, ghost level and position error of one scatterer over the extent, per way to form images."""
    sweep = scattering.frequency.values, scattering.azimuth.values
    own = imager_of(*sweep, imaging)
    # Half a cell from the edges, where an echo lies on both sides of the image at once.
    places = (np.arange(PLACES) - PLACES // 2) / PLACES
    down, cross = (places * dataset.attrs[f"{axis}_extent"] for axis in ("range", "crossrange"))
    found = {}
    for way, changes in (own.compared or {imaging["imager"]: {}}).items():
        try:
            found[way] = point_response(imager_of(*sweep, imaging | changes), down, cross)
        except InputError:  # this sweep's sector holds no rectangle
            continue
    columns = (
        ("loss_db", "peak loss [dB]", "viridis_r", 0, 8),
        ("ghost_db", "strongest ghost [dB]", "magma", -45, 0),
        ("error", "position error [pixels]", "cividis", 0, 0.5),
    )
    with style():
        figure = canvas(6.6, 0.5 + 1.75 * len(found), layout="compressed")
        grid = figure.subplots(len(found), len(columns), squeeze=False, sharex=True, sharey=True)
        for row, (way, figures) in zip(grid, found.items(), strict=True):
            for axes, (name, label, colors, low, high) in zip(row, columns, strict=True):
                frame = (*edges(cross), *edges(down))
                picture = axes.imshow(
                    figures[name],
                    extent=frame,
                    origin="lower",
                    cmap=colors,
                    vmin=low,
                    vmax=high,
                    interpolation="nearest",
                )
                axes.grid(False)
                if axes in grid[-1]:
                    axes.set_xlabel("cross-range [m]")
                if axes in grid[0]:
                    axes.set_title(label)
                figure.colorbar(picture, ax=axes, shrink=0.85, extend="both" if name == "ghost_db" else "max")
            row[0].set_ylabel(f"{way}\nrange [m]")
        svg = to_svg(figure)
    frame = pd.concat(
        pd.DataFrame(
            {
                "imager": way,
                "range_m": np.repeat(down, len(cross)),
                "crossrange_m": np.tile(cross, len(down)),
                "peak_loss_db": figures["loss_db"].ravel(),
                "ghost_db": figures["ghost_db"].ravel(),
                "position_error_pixels": figures["error"].ravel(),
            }
        )
        for way, figures in found.items()
    )
    worst = "; ".join(
        f"{way}: up to {max(figures['loss_db'].max(), 0):.1f} dB and {figures['error'].max():.2f} pixels"
        for way, figures in found.items()
    )
    return Figure(
        name="point_response",
        svg=svg,
        data=frame.round(4),
        alt=f"Peak loss, strongest ghost and position error of a point scatterer over the image. {worst}.",
        caption=(
            "What becomes of a single scatterer, wherever it stands in the unambiguous extent, for this sweep: by how "
            "much its peak is too low, the strongest echo outside its main lobe relative to that peak, and how far the "
            f"peak is off, read between the pixels. Worst loss and error - {worst}. This run's images: "
            f"{own.words()}. {own.compared_note}".rstrip()
        ),
    )
