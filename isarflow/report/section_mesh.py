"""The meshes: a picture of each target, and how good its mesh is in every band."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.colors import Normalize
from matplotlib.patches import Patch

from isarflow.core.words import counted, several
from isarflow.mesh import topology
from isarflow.mesh.table import table_of_bands
from isarflow.report.layout import BLACK, PALETTE, Section, canvas, figure, table
from isarflow.report.plots import OBLIQUE, SIDE, TOP, draw_mesh, paints
from isarflow.report.selection import evenly, in_full

PLACE, NEEDS = ("fields", 1), "targets"  # on the page, see page.py
QUALITY = matplotlib.cm.ScalarMappable(Normalize(0, 60), "RdYlBu")  # of the smallest angle in degrees: red is bad
SHOWN = 3  # bands that are drawn at most
BINS = {"edges": np.arange(0, 0.1801, 0.005), "angles": np.arange(0, 61, 2)}  # of histograms: wavelengths and degrees


def section(results):
    # The narrow pictures first, two abreast, then the wide ones.
    figures = [draw(results, name) for draw in (picture, comparison) for name in results.drawn_meshes]
    tables, text = (), []
    if results.meshed:
        tables = (folded(quality_table(results), in_full(results.settings["targets"])),)
        text.append("Each target has one mesh per frequency band, with edges sized to its shortest wavelength.")
        shown = [name for name, mesh in results.meshes.items() if name in results.drawn or mesh["repairs"]]
        repairs = [f"{name} ({counted(results.meshes[name]['repairs']) or 'none'})" for name in shown]
        text.append(f"Repairs in the CAD files: {'; '.join(repairs)}.")
    said = results.settings["targets"]
    if moving := [f"{name} {1 + len(said[name]['poses'])}" for name in results.targets if "poses" in said[name]]:
        text.append(f"Targets that move have several poses, each meshed and solved: {', '.join(moving)}.")
        text.append("The first is drawn. All rotors, or wings, of a family's model move together.")
    if without := [name for name in results.targets if name not in results.meshed]:
        text.append(f"No mesh: {', '.join(without)}, given by the field alone.")
    return Section("meshes", "Meshes", tuple(text), tuple(figures), tables)


def picture(results, target):
    """Draw the finest mesh of a target in three views: obliquely, from above and from the side."""
    vertices, triangles = results.surfaces[target]
    part, parts = results.part(target, results.finest)
    colors = {"colors": paints(parts)[part]} if parts else {}
    drawing = canvas(5.4, 3.7)
    panels = drawing.subplot_mosaic([["oblique", "oblique"], ["top", "side"]], height_ratios=[3, 2])
    if parts:
        patches = [Patch(color=color, label=name) for name, color in zip(parts, paints(parts), strict=True)]
        drawing.legend(handles=patches, loc="outside left upper")
    drawing.draw_without_rendering()
    draw_mesh(panels["oblique"], vertices, triangles, OBLIQUE, **colors)
    panels["oblique"].set_axis_off()
    for name, view, up in (("top", TOP, "y"), ("side", SIDE, "z")):
        draw_mesh(panels[name], vertices, triangles, view, **colors)
        panels[name].set(xlabel="x [m]", ylabel=f"{up} [m]")
    caption = f"{target}: the finest mesh, seen obliquely, from above (x to the nose) and from the side."
    if parts:
        caption += " Each part has a colour; one can see through sheets."
    return figure(f"mesh_{target}", drawing, table_of_bands(target, results.meshes[target]), caption)


def comparison(results, target):
    """Draw the CAD surface beside the mesh of each band, coloured by quality; below, how edges and angles spread."""
    bands = results.meshes[target]["bands"]
    meshes = {part: results.mesh(target, part) for part in ("source", *evenly(range(len(bands)), SHOWN))}
    rows = -(-len(meshes) // 2)
    drawing = canvas(8.2, 1.9 + 2.3 * rows)
    *shapes, edges, angles = drawing.subplots(rows + 1, 2, height_ratios=[5] * rows + [4]).flat
    for axes in shapes:
        axes.set_axis_off()
    drawing.draw_without_rendering()
    spreads = []
    for axes, (part, (vertices, triangles)), color in zip(shapes, meshes.items(), (None, *PALETTE), strict=False):
        angle, title = topology.shape(vertices[triangles])[2], "source"
        if part != "source":
            top = f"{bands[part]['frequencies']['last'] / 1e9:.3g} GHz"
            edge, title = topology.edge_lengths(vertices, triangles) / bands[part]["wavelength"], f"up to {top}"
            for below, values, (quantity, bins) in zip((edges, angles), (edge, angle), BINS.items(), strict=True):
                share = 100 * np.histogram(values, bins)[0] / len(values)
                below.stairs(share, bins, color=color, label=top)
                columns = {"target": target, "band": part, "quantity": quantity}
                spreads.append(pd.DataFrame({**columns, "from": bins[:-1], "to": bins[1:], "percent": share}))
        draw_mesh(axes, vertices, triangles, OBLIQUE, colors=QUALITY.to_rgba(angle)[:, :3])
        axes.set_title(f"{title}: {len(triangles):,} triangles")
    edges.axvline(bands[-1]["wanted_edge"] / bands[-1]["wavelength"], color=BLACK, lw=0.8, ls=":")
    edges.set(xlabel="edge [λ]", ylabel="edges [%]")
    edges.legend(loc="upper left")
    angles.set(xlabel="smallest angle of a triangle [°]", ylabel="triangles [%]")
    drawing.colorbar(QUALITY, ax=angles, label="colour above", pad=0.02)
    caption = (
        f"{target}: the CAD surface and the mesh of each band, coloured by the smallest angle of each triangle. Below: "
        "edges in wavelengths at the band's highest frequency, the wanted length dotted, and smallest angles."
    )
    return figure(f"bands_{target}", drawing, pd.concat(spreads), caption, wide=True)


def quality_table(results):
    """Return the Table of how good the meshes are beside what is asked of them: a row per target and band."""
    shown = {
        "target": "{target}",
        "up to [GHz]": lambda row: f"{row['frequency_last_hz'] / 1e9:.3f}",
        "triangles": "{triangles:,}",
        "unknowns": "{unknowns:,}",
        "of ideal (0.8 to 1.2)": lambda row: _marked(row["unknowns"] / row["ideal_unknowns"], 0.8, 1.2),
        "mean edge (≤ 1)": lambda row: _marked(row["edge_mean_m"] / row["wanted_edge_m"], 0, 1),
        "99 % edge (≤ 1.35)": lambda row: _marked(row["edge_p99_m"] / row["wanted_edge_m"], 0, 1.35),
        "longest (≤ 1.6)": lambda row: _marked(row["edge_max_m"] / row["wanted_edge_m"], 0, 1.6),
        "median angle (≥ 40°)": lambda row: _marked(row["smallest_angle_elsewhere_median_deg"], 40, 60, ".0f"),
        "1 % angle (≥ 15°)": lambda row: _marked(row["smallest_angle_elsewhere_p1_deg"], 15, 60, ".0f"),
        "thin": "{thin_triangles:,}",
        "off CAD [λ] (≤ 0.025)": lambda row: _marked(row["hausdorff_to_source_wavelengths"], 0, 0.025, ".4f"),
        "CAD off it [λ] (≤ 0.025)": lambda row: _marked(row["hausdorff_from_source_wavelengths"], 0, 0.025, ".4f"),
        "area [%] (±1)": lambda row: _change(row["area_before_m2"], row["area_after_m2"] - row["area_of_rods_m2"]),
        "volume [%] (±1)": lambda row: _change(row["volume_before_m3"], row["volume_after_m3"]),
        "mirror [m] (≤ 1e−9)": lambda row: _marked(row["mirror_error_m"], 0, 1e-9, ".1g"),
        "closed": lambda row: "yes" if row["watertight"] else "no",
        "rims": "{boundary_edges:,}",
        "junctions": "{junction_edges:,}",
    }
    data = pd.concat([table_of_bands(*pair) for pair in results.meshes.items()], ignore_index=True)
    caption = (
        "Mesh quality per target and band, with what is asked in parentheses; ✗ marks what misses it. Edges are in "
        "wanted lengths; ideal are equilateral triangles of that edge; angles are the smallest of each triangle but "
        "the thin ones between creases. Off CAD is the largest distance to the CAD surface and from it; area and "
        "volume are changes, without the area that thin rods gain; rims have one triangle, junctions more than two."
    )
    return table("meshes", data, shown, caption)


def folded(every, whole):
    """A table of quality with all rows of some targets, and of the others each row that misses a goal."""
    shown = every.shown[every.shown["target"].isin(whole) | _misses(every.shown)]
    if len(shown) == len(every.shown):
        return every
    left = f"; {several(len(every.shown) - len(shown), 'row')} of models of the same kinds, all within, are in the CSV."
    return every._replace(shown=shown, caption=every.caption.removesuffix(".") + left)


def _misses(shown):
    return shown.apply(lambda column: column.str.endswith("✗")).any(axis=1)


def missed(results):
    shown = quality_table(results).shown
    return _misses(shown).groupby(shown["target"]).sum().to_dict()


def _change(before, after):
    return _marked(100 * (after / before - 1), -1, 1, "+z.2f")


def _marked(value, least, most, form=".2f"):
    """Return a number as text, marked if it is out of its bounds; a dash where there is none."""
    mark = "" if least <= value <= most else " ✗"
    return "–" if pd.isna(value) else f"{value:{form}}{mark}".replace("-", "−")
