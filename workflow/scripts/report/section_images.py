"""Galleries of ISAR images: every target over azimuth, one target over SNR."""

import numpy as np
import pandas as pd

from common.radar import snr_label
from report.layout import Figure, Section, Table, canvas, style, to_svg
from report.selection import GALLERY_AZIMUTHS, noise_snrs, noise_target

FLOOR_DB = -40
COLUMNS = 4


def section(results):
    noise = results.settings["noise"]
    return Section(
        id="images",
        title="Images",
        text=(
            "Every image is divided by its own peak. Range is measured from the target's origin along the line of "
            "sight, negative towards the radar, which looks from the bottom of each image. Cross-range is at right "
            "angles to it, in the plane of the turn.",
        ),
        figures=(
            *(azimuth_gallery(name, results.images(name, "clean")) for name in results.targets),
            noise_gallery(
                noise_target(results.settings["targets"]),
                lambda target, store: results.images(target, store),
                noise_snrs(noise["snr_db"]),
                noise["definition"],
            ),
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
                "aperture_deg": attrs["aperture_angle"],
                "range_resolution_m": attrs["range_resolution"],
                "crossrange_resolution_m": attrs["crossrange_resolution"],
                "range_extent_m": attrs["range_extent"],
                "crossrange_extent_m": attrs["crossrange_extent"],
                "snr_definition_offset_db": attrs["snr_definition_offset_db"],
            }
        )
    shown = [
        {
            "target": row["target"],
            "images": f"{row['images']:,}",
            "pixels": row["pixels"],
            "aperture [°]": f"{row['aperture_deg']:.1f}",
            "resolution, range × cross-range [m]": (
                f"{row['range_resolution_m']:.3f} × {row['crossrange_resolution_m']:.3f}"
            ),
            "extent, range × cross-range [m]": f"{row['range_extent_m']:.2f} × {row['crossrange_extent_m']:.2f}",
            "peak_3db over mean [dB]": f"{row['snr_definition_offset_db']:.2f}",
        }
        for row in rows
    ]
    return Table(
        name="images",
        shown=pd.DataFrame(shown),
        data=pd.DataFrame(rows),
        caption=(
            "Noise-free images of each target. The last column says by how many dB the same noise reads higher as SNR "
            "when signal power is the mean over samples within 3 dB of the aperture's peak (peak_3db) than when it is "
            f"the mean over the whole aperture (mean); this run uses {results.settings['noise']['definition']}."
        ),
    )


def decibels(image):
    """Magnitude of a peak-normalised complex image in dB, no lower than -100."""
    return 20 * np.log10(np.maximum(np.abs(image), 1e-5))


def azimuth_gallery(target, dataset):
    """Noise-free images of a target at evenly spread azimuths, elevation nearest 0."""
    cut = dataset.image.sel(elevation=0, method="nearest")
    count = cut.sizes["azimuth"]
    # As on a circle: the last azimuth is not the first one again.
    picks = np.unique(np.arange(GALLERY_AZIMUTHS) * count // GALLERY_AZIMUTHS)
    cut = cut.isel(azimuth=picks).load()
    panels = [(f"azimuth {float(azimuth):.0f}°", cut.sel(azimuth=azimuth)) for azimuth in cut.azimuth.values]
    svg, frame = _gallery(panels)
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


def noise_gallery(target, read, snrs, definition):
    """One aspect of one target, clean and at several SNRs. `read(target, store)` opens a store of images."""
    clean = read(target, "clean").image.sel(elevation=0, method="nearest")
    clean = clean.isel(azimuth=clean.sizes["azimuth"] // 8)
    panels = [("no noise", clean.load())]
    for snr in reversed(snrs):
        noisy = read(target, snr_label(snr)).image.isel(realization=0)
        where = {"elevation": clean.elevation, "azimuth": clean.azimuth}
        panels.append((f"SNR {snr:g} dB", noisy.sel(where, method="nearest").load()))
    svg, frame = _gallery(panels)
    frame.insert(0, "target", target)
    return Figure(
        name="images_snr",
        svg=svg,
        data=frame,
        alt=f"One ISAR image of {target} with ever more noise, from none to an SNR of {snrs[0]:g} dB.",
        caption=(
            f"{target} at azimuth {float(clean.azimuth):.0f}°, elevation {float(clean.elevation):g}°, with ever more "
            f"noise, one realization. Noise is added before the image is formed; SNR definition: {definition}."
        ),
    )


def _gallery(panels):
    """Draw titled images (range, crossrange) side by side; return the SVG and the pixels as a table."""
    first = panels[0][1]
    distance, cross = first.range.values, first.crossrange.values
    # One digit, and not at the edge, where it would run into the neighbour's.
    tick = float(f"{0.8 * _edges(cross)[1]:.0e}")
    ticks = [-tick, 0, tick]
    rows = -(-len(panels) // COLUMNS)
    across = 1.05  # inches
    height = across * np.ptp(_edges(distance)) / np.ptp(_edges(cross))
    with style():
        figure = canvas(1.3 + (across + 0.1) * COLUMNS, 0.5 + rows * (height + 0.3), layout="compressed")
        grid = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True, sharey=True)
        for axes in grid.flat[len(panels) :]:
            axes.set_axis_off()
        for axes, (title, image) in zip(grid.flat, panels, strict=False):
            picture = axes.imshow(
                decibels(image.transpose("range", "crossrange").values),
                extent=(*_edges(cross), *_edges(distance)),
                origin="lower",
                cmap="viridis",
                vmin=FLOOR_DB,
                vmax=0,
                interpolation="nearest",
            )
            axes.set_title(title)
            axes.grid(False)
            axes.set_xticks(ticks)
        for axes in grid[:, 0]:
            axes.set_ylabel("range [m]")
        for column in range(min(COLUMNS, len(panels))):
            lowest = max(row for row in range(rows) if row * COLUMNS + column < len(panels))
            grid[lowest, column].set_xlabel("cross-range [m]")
            grid[lowest, column].tick_params(labelbottom=True)
        figure.colorbar(picture, ax=grid, label="|image| [dB]", shrink=0.8, aspect=30, pad=0.02)
        svg = to_svg(figure)
    frame = pd.concat(
        pd.DataFrame(
            {
                "image": title,
                "azimuth_deg": float(image.azimuth),
                "elevation_deg": float(image.elevation),
                "range_m": np.repeat(distance, len(cross)),
                "crossrange_m": np.tile(cross, len(distance)),
                "level_db": decibels(image.transpose("range", "crossrange").values).ravel().round(2),
            }
        )
        for title, image in panels
    )
    return svg, frame


def _edges(centers):
    """Outer edges of uniform pixels from their centres."""
    half = (centers[1] - centers[0]) / 2
    return float(centers[0] - half), float(centers[-1] + half)
