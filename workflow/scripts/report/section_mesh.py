"""The meshes: a picture of each target, and how good its mesh is in every band."""

import pandas as pd

from report import draw_mesh
from report.layout import Figure, Section, Table, canvas, style, to_svg


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
                **{key: band[key] for key in ("vertices", "triangles", "unknowns")},
                **{f"edge_{key}_m": value for key, value in band["edge"].items()},
                **{f"edge_{key}_wavelengths": value for key, value in band["edge_wavelengths"].items()},
                **{f"smallest_angle_{key}_deg": value for key, value in band["smallest_angle"].items()},
                **{key: band[key] for key in ("watertight", "components", "boundary_edges", "junction_edges")},
                "area_before_m2": area["before"],
                "area_after_m2": area["after"],
                "volume_before_m3": volume["before"],
                "volume_after_m3": volume["after"],
                "hausdorff_to_source_m": band["hausdorff"]["to_source"],
                "hausdorff_from_source_m": band["hausdorff"]["from_source"],
            }
        )
    return pd.DataFrame(rows)


def quality_table(targets, meshes):
    """How good the meshes are: a row per target and band."""
    data = pd.concat([quality(name, meshes[name]) for name in targets], ignore_index=True)
    shown = [
        {
            "target": row.target,
            "up to [GHz]": f"{row.frequency_last_hz / 1e9:.3f}",
            "triangles": f"{row.triangles:,}",
            "unknowns": f"{row.unknowns:,}",
            "edge, mean / p99 / max [λ]": " / ".join(
                f"{length:.3f}"
                for length in (row.edge_mean_wavelengths, row.edge_p99_wavelengths, row.edge_max_wavelengths)
            ),
            "smallest angle, min / p1 / median [°]": " / ".join(
                f"{angle:.0f}"
                for angle in (row.smallest_angle_min_deg, row.smallest_angle_p1_deg, row.smallest_angle_median_deg)
            ),
            "surface": "closed" if row.watertight else "open",
            "pieces": str(row.components),
            "area change [%]": _change(row.area_before_m2, row.area_after_m2),
            "volume change [%]": _change(row.volume_before_m3, row.volume_after_m3),
            "Hausdorff, to / from CAD [mm]": (
                f"{1000 * row.hausdorff_to_source_m:.2f} / {1000 * row.hausdorff_from_source_m:.2f}"
            ),
        }
        for row in data.itertuples()
    ]
    return Table(
        name="meshes",
        shown=pd.DataFrame(shown),
        data=data,
        caption=(
            "Mesh quality per target and band. Edges are in wavelengths at the band's highest frequency, angles are "
            "the smallest of each triangle, p1 and p99 are percentiles. Hausdorff distances are between the mesh and "
            "the CAD surface."
        ),
    )


def _change(before, after):
    """Change in percent as text; a dash where there is nothing to compare (an open surface has no volume)."""
    if pd.isna(before) or pd.isna(after):
        return "–"
    return f"{100 * (after / before - 1):+.2f}"


def section(results):
    targets = results.targets
    return Section(
        id="meshes",
        title="Meshes",
        text=(
            "Each target has one mesh per frequency band, with edges sized to the shortest wavelength of the band. "
            "The pictures show the finest.",
        ),
        figures=tuple(picture(name, results.surfaces[name], results.meshes[name]) for name in targets),
        tables=(quality_table(targets, results.meshes),),
    )
