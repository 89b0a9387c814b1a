"""The meshes: a picture of each target, and how good its mesh is in every band."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.colors import Normalize

from isarflow.core.words import counted
from isarflow.mesh import topology
from isarflow.report import draw_mesh
from isarflow.report.layout import BLACK, PALETTE, Section, canvas, duration, figure, signed, table
from isarflow.report.selection import evenly

QUALITY = "RdYlBu"  # colours of the smallest angle: red is bad
ANGLES = Normalize(0, 60)  # degrees
SHOWN = 3  # bands that are drawn at most
# What a band's entry in the mesh's JSON is called in the CSV file; {} is the name of one of several measures.
COLUMNS = {
    "vertices": "vertices",
    "triangles": "triangles",
    "unknowns": "unknowns",
    "ideal_unknowns": "ideal_unknowns",
    "wanted_edge": "wanted_edge_m",
    "edge": "edge_{}_m",
    "edge_wavelengths": "edge_{}_wavelengths",
    "smallest_angle": "smallest_angle_{}_deg",
    "thin_triangles": "thin_triangles",
    "smallest_angle_elsewhere": "smallest_angle_elsewhere_{}_deg",
    "watertight": "watertight",
    "components": "components",
    "boundary_edges": "boundary_edges",
    "junction_edges": "junction_edges",
    "mirror_error": "mirror_error_m",
    "area": "area_{}_m2",
    "volume": "volume_{}_m3",
    "hausdorff": "hausdorff_{}_m",
}


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
        figures=tuple(draw(results, name) for draw in (picture, comparison) for name in meshed),
        tables=(quality_table(results), source_table(results)) if meshed else (),
    )


def picture(results, target):
    """The finest mesh of a target in three views: oblique, from above, from the side."""
    vertices, triangles = results.surfaces[target]
    drawing = canvas(5.4, 3.7)
    mosaic = drawing.subplot_mosaic([["oblique", "oblique"], ["top", "side"]], height_ratios=[3, 2])
    large, top, side = mosaic.values()
    drawing.draw_without_rendering()
    draw_mesh.draw(large, vertices, triangles, draw_mesh.OBLIQUE)
    large.set_axis_off()
    draw_mesh.room_below(large)
    for axes, view, up in ((top, draw_mesh.TOP, "y"), (side, draw_mesh.SIDE, "z")):
        draw_mesh.draw(axes, vertices, triangles, view)
        axes.set(xlabel="x [m]", ylabel=f"{up} [m]")
    drawing.draw_without_rendering()
    draw_mesh.triad(large, draw_mesh.OBLIQUE, vertices)
    finest = results.meshes[target]["bands"][-1]
    alt = f"Triangle mesh of {target} with {len(triangles)} triangles, seen obliquely, from above and from the side."
    caption = (
        f"{target}: {len(triangles):,} triangles, {finest['unknowns']:,} unknowns, mean edge "
        f"{1000 * finest['edge']['mean']:.1f} mm. Oblique view, view from above (x to the nose) and from the side."
    )
    return figure(f"mesh_{target}", drawing, quality(target, results.meshes[target]), alt, caption)


def comparison(results, target):
    """The CAD surface beside the mesh of each band, coloured by quality; below, how edges and angles spread."""
    bands = results.meshes[target]["bands"]
    meshes = {"source": results.mesh(target, "source")}
    meshes |= {band: results.mesh(target, band) for band in evenly(range(len(bands)), SHOWN)}
    names = [*meshes, *["."] * (len(meshes) % 2)]
    pairs = [list(map(str, names[k : k + 2])) for k in range(0, len(names), 2)]
    drawing = canvas(8.2, 1.9 + 2.3 * len(pairs))
    axes = drawing.subplot_mosaic([*pairs, ["edges", "angles"]], height_ratios=[5] * len(pairs) + [4])
    drawing.draw_without_rendering()
    color, rows = iter(PALETTE), []
    for band, (vertices, triangles) in meshes.items():
        angle, panel = topology.shape(vertices[triangles])[2], axes[str(band)]
        colors = matplotlib.colormaps[QUALITY](ANGLES(angle))[:, :3]
        draw_mesh.draw(panel, vertices, triangles, draw_mesh.OBLIQUE, colors=colors)
        panel.set_axis_off()
        if band == "source":
            panel.set_title(f"source: {len(triangles):,} triangles")
            continue
        top, look = f"{bands[band]['frequencies']['last'] / 1e9:.3g} GHz", next(color)
        panel.set_title(f"up to {top}: {len(triangles):,} triangles")
        length = topology.edge_lengths(vertices, triangles) / bands[band]["wavelength"]
        histograms = {"edges": (length, np.arange(0, 0.1801, 0.005)), "angles": (angle, np.arange(0, 61, 2))}
        for key, (values, bins) in histograms.items():
            share = 100 * np.histogram(values, bins)[0] / len(values)
            axes[key].stairs(share, bins, color=look, label=top)
            head = {"target": target, "band": band, "quantity": key}
            rows.append(pd.DataFrame({**head, "from": bins[:-1], "to": bins[1:], "percent": share}))
    axes["edges"].axvline(bands[-1]["wanted_edge"] / bands[-1]["wavelength"], color=BLACK, lw=0.8, ls=":")
    axes["edges"].set(xlabel="edge [λ]", ylabel="edges [%]")
    axes["angles"].set(xlabel="smallest angle of a triangle [°]", ylabel="triangles [%]")
    axes["edges"].legend(loc="upper left")
    scale = matplotlib.cm.ScalarMappable(ANGLES, QUALITY)
    drawing.colorbar(scale, ax=axes["angles"], label="colour above", pad=0.02)
    alt = f"The CAD surface of {target} beside the meshes of its bands, and histograms of edges and angles."
    caption = (
        f"{target}: the source and the mesh of each band, coloured by the smallest angle of each triangle (blue is "
        "near 60°, red is a sliver). Below: edges in wavelengths at the band's highest frequency, the wanted length "
        "dotted, and smallest angles."
    )
    return figure(f"bands_{target}", drawing, pd.concat(rows), alt, caption, wide=True)


def quality(target, measures):
    """One row per band of a target's mesh, in full precision. Lengths in m, angles in degrees. measures: its JSON."""
    rows = []
    for place, band in enumerate(measures["bands"]):
        row = {"target": target, "band": place}
        row |= {f"frequency_{end}_hz": band["frequencies"][end] for end in ("first", "last")}
        for name, column in COLUMNS.items():
            values = band[name] if isinstance(band[name], dict) else {"": band[name]}
            row |= {column.format(key): value for key, value in values.items()}
        row |= {f"hausdorff_{way}_wavelengths": far / band["wavelength"] for way, far in band["hausdorff"].items()}
        rows.append(row | _planned(band["solve"]["megabytes"], band["solve"]["seconds"]))
    return pd.DataFrame(rows)


def _planned(megabytes, seconds):
    return {"planned_memory_mb": megabytes, "planned_time_s": seconds}


def quality_table(results):
    """How good the meshes are beside what is asked of them: a row per target and band."""

    def within(value, least, most, form=".2f", of=None):
        """A column of what shall lie between two bounds, in parts of another column if there is one."""
        return lambda row: _within(row[value] / row[of] if of else row[value], least, most, form)

    def change(quantity):
        """A column of what `quantity` changes by, but for what rods thinner than an edge gain."""
        kept = quantity.format("of_rods")
        before, after = quantity.format("before"), quantity.format("after")
        return lambda row: _change(row[before], row[after], row.get(kept, 0.0))

    shown = {
        "target": "{target}",
        "up to [GHz]": lambda row: f"{row['frequency_last_hz'] / 1e9:.3f}",
        "triangles": "{triangles:,}",
        "unknowns": "{unknowns:,}",
        "of ideal (0.8 to 1.2)": within("unknowns", 0.8, 1.2, of="ideal_unknowns"),
        "mean edge (≤ 1)": within("edge_mean_m", 0, 1, of="wanted_edge_m"),
        "99 % edge (≤ 1.35)": within("edge_p99_m", 0, 1.35, of="wanted_edge_m"),
        "longest (≤ 1.6)": within("edge_max_m", 0, 1.6, of="wanted_edge_m"),
        "median angle (≥ 40°)": within("smallest_angle_elsewhere_median_deg", 40, 60, ".0f"),
        "1 % angle (≥ 15°)": within("smallest_angle_elsewhere_p1_deg", 15, 60, ".0f"),
        "thin": "{thin_triangles:,}",
        "off CAD [λ] (≤ 0.025)": within("hausdorff_to_source_wavelengths", 0, 1 / 40, ".4f"),
        "CAD off it [λ] (≤ 0.025)": within("hausdorff_from_source_wavelengths", 0, 1 / 40, ".4f"),
        "area [%] (±1)": change("area_{}_m2"),
        "volume [%] (±1)": change("volume_{}_m3"),
        "mirror [m] (≤ 1e−9)": within("mirror_error_m", 0, 1e-9, ".1g"),
        "closed": lambda row: "yes" if row["watertight"] else "no",
        "rims": "{boundary_edges:,}",
        "junctions": "{junction_edges:,}",
    }
    data = pd.concat([quality(*pair) for pair in results.meshes.items()], ignore_index=True)
    caption = (
        "Mesh quality per target and band, with what is asked in parentheses; ✗ marks what misses it. Edges are in the "
        "wanted length. Angles are the smallest of each triangle, without the thin ones: triangles that creases force "
        "to be narrow, as on the rim of a plate. Off CAD is the largest distance from the mesh to the CAD surface, "
        "then the other way round, in wavelengths at the band's highest frequency. Area and volume are their change "
        "from the repaired CAD surface, without what rods thinner than an edge gain in area: they have few sides and "
        "their volume. Ideal are equilateral triangles of the wanted edge. Rims are edges with one "
        "triangle, junctions with three or more."
    )
    return table("meshes", data, shown, caption)


def missed(results):
    """How many of each target's bands miss a goal of `quality_table`, by target."""
    shown = quality_table(results).shown
    marked = shown.apply(lambda column: column.str.endswith("✗")).any(axis=1)
    return marked.groupby(shown["target"]).sum().to_dict()


def source_table(results):
    """What the CAD files held, what was repaired in them, and what their solves will need: a row per target."""
    rows = []
    for name, measures in results.meshes.items():
        source, raw, bands = measures["source"], measures["source"]["raw"], measures["bands"]
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
                **measures["repairs"],
                "components": bands[-1]["components"],
                **_planned(
                    max(band["solve"]["megabytes"] for band in bands), sum(band["solve"]["seconds"] for band in bands)
                ),
            }
        )

    def repairs(row):
        return counted(results.meshes[row["target"]]["repairs"]) or "none"

    shown = {
        "target": "{target}",
        "triangles in the file": "{file_triangles:,}",
        "repaired": "{triangles:,}",
        "repairs": repairs,
        "size in the file [m]": "{file_x_m:.3f} × {file_y_m:.3f} × {file_z_m:.3f}",
        "size change [%]": lambda row: _change(*(max(row[f"{of}{axis}_m"] for axis in "xyz") for of in ("file_", ""))),
        "area in the file [m²]": "{file_area_m2:.4f}",
        "area change [%]": lambda row: _change(row["file_area_m2"], row["area_m2"], most=np.inf),
        "pieces": "{components}",
        "solve [GB]": lambda row: f"{row['planned_memory_mb'] / 1000:.1f}",
        "solve, estimate": lambda row: f"about {duration(row['planned_time_s'])}",
    }
    caption = (
        "The CAD files as read, the repairs made in them, and how these change the largest length and the area "
        "(doubled faces and parts inside others vanish). What the solves need is predicted before they start: the "
        "memory of the largest, and the time of all on two cores of a server processor, which is an estimate: "
        "times measured have been up to 2.5 times as long."
    )
    return table("mesh_sources", pd.DataFrame(rows), shown, caption)


def _within(value, least, most, form):
    """A number as text, marked if it is out of its bounds; a dash where there is none."""
    if pd.isna(value):
        return "–"
    return f"{value:{form}}{'' if least <= value <= most else ' ✗'}"


def _change(before, after, kept=0.0, most=1.0):
    """Change in percent as text, but for what is `kept`; a dash where an open surface has no volume to compare."""
    change = np.nan if pd.isna(before) or pd.isna(after) else 100 * ((after - kept) / before - 1)
    text = "0.00" if abs(change) < 0.005 else signed(change, 2)
    return f"{text}{' ✗' if abs(change) > most else ''}"
