"""The meshes: a picture of each target, and how good its mesh is in every band."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.colors import Normalize

from mesh import topology
from mesh.io import read_ply
from report import draw_mesh
from report.layout import PALETTE, Figure, Section, Table, canvas, duration, style, to_svg

QUALITY = "RdYlBu"  # colours of the smallest angle: red is bad
ANGLES = Normalize(0, 60)  # degrees
SHOWN = 3  # bands that are drawn at most


def thumbnail(target, surface):
    """A small picture of a target's shape for the head of the page."""
    vertices, triangles = surface
    with style():
        figure = canvas(2.2, 1.5)
        axes = figure.add_subplot()
        draw_mesh.draw(axes, vertices, triangles, draw_mesh.OBLIQUE, edges=False)
        axes.set_axis_off()
        svg = to_svg(figure)
    size = extent(vertices)
    return Figure(
        name=f"target_{target}",
        svg=svg,
        data=pd.DataFrame({"target": [target], "x_m": size[0], "y_m": size[1], "z_m": size[2]}),
        alt=f"The target {target}, seen obliquely from above.",
        caption=target,
    )


def extent(vertices):
    """Size of the target along x, y and z in m."""
    return (vertices.max(axis=0) - vertices.min(axis=0)).tolist()


def picture(target, surface, figures):
    """The finest mesh of a target in three views: oblique, from above, from the side."""
    vertices, triangles = surface
    band = figures["bands"][-1]
    with style():
        figure = canvas(5.4, 3.7)
        large, top, side = figure.subplot_mosaic(
            [["oblique", "oblique"], ["top", "side"]], height_ratios=[3, 2]
        ).values()
        figure.draw_without_rendering()
        draw_mesh.draw(large, vertices, triangles, draw_mesh.OBLIQUE)
        large.set_axis_off()
        draw_mesh.room_below(large)
        for axes, view, up in ((top, draw_mesh.TOP, "y"), (side, draw_mesh.SIDE, "z")):
            draw_mesh.draw(axes, vertices, triangles, view)
            axes.set(xlabel="x [m]", ylabel=f"{up} [m]")
        figure.draw_without_rendering()
        draw_mesh.triad(large, draw_mesh.OBLIQUE, vertices)
        svg = to_svg(figure)
    return Figure(
        name=f"mesh_{target}",
        svg=svg,
        data=quality(target, figures),
        alt=f"Triangle mesh of {target} with {len(triangles)} triangles, seen obliquely, from above and from the side.",
        caption=(
            f"{target}: {len(triangles):,} triangles, {band['unknowns']:,} unknowns, mean edge "
            f"{1000 * band['edge']['mean']:.1f} mm. Oblique view, view from above (x to the nose) and from the side."
        ),
    )


def bands_shown(count):
    """Numbers of the bands that are drawn, lowest first: all, or evenly spread with the first and the last."""
    return sorted(set(np.linspace(0, count - 1, min(SHOWN, count)).round().astype(int).tolist()))


def comparison(target, source, meshes, figures):
    """The CAD surface beside the mesh of each band, coloured by quality; below, how edges and angles spread.

    source: (vertices, triangles); meshes: {band: (vertices, triangles)}; figures: the target's mesh JSON
    """
    rows = []
    with style():
        names = ["source", *(f"band {band}" for band in meshes)]
        pairs = [names[k : k + 2] + ["."] * (2 - len(names[k : k + 2])) for k in range(0, len(names), 2)]
        figure = canvas(8.2, 1.9 + 2.3 * len(pairs))
        mosaic = [*pairs, ["edges", "angles"]]
        axes = figure.subplot_mosaic(mosaic, height_ratios=[5] * len(pairs) + [4])
        figure.draw_without_rendering()
        for name, (vertices, triangles) in zip(names, (source, *meshes.values()), strict=True):
            angle = topology.shape(vertices[triangles])[2]
            colors = matplotlib.colormaps[QUALITY](ANGLES(angle))[:, :3]
            draw_mesh.draw(axes[name], vertices, triangles, draw_mesh.OBLIQUE, colors=colors)
            axes[name].set_axis_off()
        axes["source"].set_title(f"source: {len(source[1]):,} triangles")
        for color, (band, (vertices, triangles)) in zip(PALETTE, meshes.items(), strict=False):
            band_figures = figures["bands"][band]
            top = f"{band_figures['frequencies']['last'] / 1e9:.3g} GHz"
            axes[f"band {band}"].set_title(f"up to {top}: {len(triangles):,} triangles")
            length = topology.edge_lengths(vertices, triangles) / band_figures["wavelength"]
            angle = topology.shape(vertices[triangles])[2]
            for key, values, bins in (
                ("edges", length, np.arange(0, 0.1801, 0.005)),
                ("angles", angle, np.arange(0, 61, 2)),
            ):
                share, _ = np.histogram(values, bins)
                share = 100 * share / len(values)
                axes[key].stairs(share, bins, color=color, label=top)
                rows += [
                    {"target": target, "band": band, "quantity": key, "from": low, "to": high, "percent": percent}
                    for low, high, percent in zip(bins[:-1], bins[1:], share, strict=True)
                ]
        wanted = [band["wanted_edge"] / band["wavelength"] for band in figures["bands"]]
        axes["edges"].axvline(wanted[-1], color="#222222", lw=0.8, ls=":")
        axes["edges"].set(xlabel="edge [λ]", ylabel="edges [%]")
        axes["angles"].set(xlabel="smallest angle of a triangle [°]", ylabel="triangles [%]")
        axes["edges"].legend(loc="upper left")
        colors = matplotlib.cm.ScalarMappable(ANGLES, QUALITY)
        figure.colorbar(colors, ax=axes["angles"], label="colour above", pad=0.02)
        svg = to_svg(figure)
    return Figure(
        name=f"bands_{target}",
        svg=svg,
        data=pd.DataFrame(rows),
        alt=f"The CAD surface of {target} beside the meshes of its bands, and histograms of edges and angles.",
        caption=(
            f"{target}: the source and the mesh of each band, coloured by the smallest angle of each triangle (blue is "
            "near 60°, red is a sliver). Below: edges in wavelengths at the band's highest frequency, the wanted "
            "length dotted, and smallest angles."
        ),
        wide=True,
    )


def quality(target, figures):
    """One row per band of a target's mesh, in full precision. Lengths in m, angles in degrees."""
    rows = []
    for place, band in enumerate(figures["bands"]):
        area, volume = band["area"], band["volume"]
        rows.append(
            {
                "target": target,
                "band": place,
                "frequency_first_hz": band["frequencies"]["first"],
                "frequency_last_hz": band["frequencies"]["last"],
                **{key: band[key] for key in ("vertices", "triangles", "unknowns", "ideal_unknowns")},
                "wanted_edge_m": band["wanted_edge"],
                **{f"edge_{key}_m": value for key, value in band["edge"].items()},
                **{f"edge_{key}_wavelengths": value for key, value in band["edge_wavelengths"].items()},
                **{f"smallest_angle_{key}_deg": value for key, value in band["smallest_angle"].items()},
                "thin_triangles": band["thin_triangles"],
                **{f"smallest_angle_elsewhere_{key}_deg": v for key, v in band["smallest_angle_elsewhere"].items()},
                **{key: band[key] for key in ("watertight", "components", "boundary_edges", "junction_edges")},
                "mirror_error_m": band["mirror_error"],
                "area_before_m2": area["before"],
                "area_after_m2": area["after"],
                "volume_before_m3": volume["before"],
                "volume_after_m3": volume["after"],
                "hausdorff_to_source_m": band["hausdorff"]["to_source"],
                "hausdorff_from_source_m": band["hausdorff"]["from_source"],
                "hausdorff_to_source_wavelengths": band["hausdorff"]["to_source"] / band["wavelength"],
                "hausdorff_from_source_wavelengths": band["hausdorff"]["from_source"] / band["wavelength"],
                "planned_memory_mb": band["solve"]["megabytes"],
                "planned_time_s": band["solve"]["seconds"],
            }
        )
    return pd.DataFrame(rows)


def quality_table(targets, meshes):
    """How good the meshes are beside what is asked of them: a row per target and band."""
    data = pd.concat([quality(name, meshes[name]) for name in targets], ignore_index=True)
    shown = [
        {
            "target": row.target,
            "up to [GHz]": f"{row.frequency_last_hz / 1e9:.3f}",
            "triangles": f"{row.triangles:,}",
            "unknowns": f"{row.unknowns:,}",
            "of ideal (0.8 to 1.2)": _within(row.unknowns / row.ideal_unknowns, 0.8, 1.2),
            "mean edge (≤ 1)": _within(row.edge_mean_m / row.wanted_edge_m, 0, 1),
            "99 % edge (≤ 1.35)": _within(row.edge_p99_m / row.wanted_edge_m, 0, 1.35),
            "longest (≤ 1.6)": _within(row.edge_max_m / row.wanted_edge_m, 0, 1.6),
            "median angle (≥ 40°)": _within(row.smallest_angle_elsewhere_median_deg, 40, 60, ".0f"),
            "1 % angle (≥ 15°)": _within(row.smallest_angle_elsewhere_p1_deg, 15, 60, ".0f"),
            "thin": f"{row.thin_triangles:,}",
            "off CAD [λ] (≤ 0.025)": _within(row.hausdorff_to_source_wavelengths, 0, 1 / 40, ".4f"),
            "CAD off it [λ] (≤ 0.025)": _within(row.hausdorff_from_source_wavelengths, 0, 1 / 40, ".4f"),
            "area [%] (±1)": _change(row.area_before_m2, row.area_after_m2),
            "volume [%] (±1)": _change(row.volume_before_m3, row.volume_after_m3),
            "mirror [m] (≤ 1e−9)": _within(row.mirror_error_m, 0, 1e-9, ".1g"),
            "closed": "yes" if row.watertight else "no",
            "rims": f"{row.boundary_edges:,}",
            "junctions": f"{row.junction_edges:,}",
        }
        for row in data.itertuples()
    ]
    return Table(
        name="meshes",
        shown=pd.DataFrame(shown),
        data=data,
        caption=(
            "Mesh quality per target and band, with what is asked in parentheses; ✗ marks what misses it. Edges are "
            "in the wanted length. Angles are the smallest of each triangle, without the thin ones: triangles that "
            "creases force to be narrow, as on the rim of a plate. Off CAD is the largest distance from the mesh to "
            "the CAD surface, then the other way round, in wavelengths at the band's highest frequency. Area and "
            "volume are their change from the repaired CAD surface. Ideal are equilateral triangles of the wanted "
            "edge. Rims are edges with one triangle, junctions with three or more."
        ),
    )


def source_table(targets, meshes):
    """What the CAD files held, what was repaired in them, and what their solves will need: a row per target."""
    rows, shown = [], []
    for name in targets:
        figures = meshes[name]
        source, raw, bands = figures["source"], figures["source"]["raw"], figures["bands"]
        megabytes = max(band["solve"]["megabytes"] for band in bands)
        seconds = sum(band["solve"]["seconds"] for band in bands)
        rows.append(
            {
                "target": name,
                "file_triangles": raw["triangles"],
                **{f"file_{axis}_m": length for axis, length in zip("xyz", raw["box"], strict=True)},
                "file_area_m2": raw["area"],
                "triangles": source["triangles"],
                **{f"{axis}_m": length for axis, length in zip("xyz", source["box"], strict=True)},
                "area_m2": source["area"],
                "volume_m3": source["volume"],
                **figures["repairs"],
                "components": bands[-1]["components"],
                "planned_memory_mb": megabytes,
                "planned_time_s": seconds,
            }
        )
        made = [f"{count:,} {key.replace('_', ' ')}" for key, count in figures["repairs"].items() if count]
        shown.append(
            {
                "target": name,
                "triangles in the file": f"{raw['triangles']:,}",
                "repaired": f"{source['triangles']:,}",
                "repairs": ", ".join(made) or "none",
                "size in the file [m]": " × ".join(f"{length:.3f}" for length in raw["box"]),
                "size change [%]": _change(max(raw["box"]), max(source["box"])),
                "area in the file [m²]": f"{raw['area']:.4f}",
                "area change [%]": _change(raw["area"], source["area"], np.inf),
                "pieces": str(bands[-1]["components"]),
                "solve [GB]": f"{megabytes / 1000:.1f}",
                "solve, estimate": f"about {duration(seconds)}",
            }
        )
    return Table(
        name="mesh_sources",
        shown=pd.DataFrame(shown),
        data=pd.DataFrame(rows),
        caption=(
            "The CAD files as read, the repairs made in them, and how these change the largest length and the area "
            "(doubled faces and parts inside others vanish). What the solves need is predicted before they start: the "
            "memory of the largest, and the time of all on two cores of a server processor, which is an estimate: "
            "times measured have been up to 2.5 times as long."
        ),
    )


def _within(value, least, most, form=".2f"):
    """A number as text, marked if it is out of its bounds; a dash where there is none."""
    if value is None or pd.isna(value):
        return "–"
    text = f"{value:{form}}"
    return text if least <= value <= most else f"{text} ✗"


def _change(before, after, most=1.0):
    """Change in percent as text; a dash where there is nothing to compare (an open surface has no volume)."""
    if pd.isna(before) or pd.isna(after):
        return "–"
    change = 100 * (after / before - 1)
    text = f"{change:+.2f}".replace("-", "−") if abs(change) >= 0.005 else "0.00"
    return text if abs(change) <= most else f"{text} ✗"


def section(results):
    meshed = results.meshed
    text = (
        "Each target has one mesh per frequency band, with edges sized to the shortest wavelength of the band. "
        "The pictures show the finest, and the CAD surface beside the bands.",
    )
    without = [name for name in results.targets if name not in meshed]
    if without:
        text = (*(text if meshed else ()), f"No mesh: {', '.join(without)}, given by the field alone.")
    return Section(
        id="meshes",
        title="Meshes",
        text=text,
        # The narrow pictures first, two abreast, then the wide ones.
        figures=tuple(f for pair in zip(*(_figures(name, results) for name in meshed), strict=True) for f in pair),
        tables=tuple(table(meshed, results.meshes) for table in (quality_table, source_table)) if meshed else (),
    )


def _figures(name, results):
    figures, folder = results.meshes[name], results.fields / "mesh"
    source = read_ply(folder / f"{name}-source.ply")
    meshes = {band: read_ply(folder / f"{name}-{band}.ply") for band in bands_shown(len(figures["bands"]))}
    return picture(name, results.surfaces[name], figures), comparison(name, source, meshes, figures)
