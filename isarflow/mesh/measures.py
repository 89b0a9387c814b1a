"""Measure a mesh: its quality for the method of moments, and its distance from its source."""

import numpy as np
from scipy.spatial import cKDTree

from isarflow.mesh import symmetry, topology

NARROW = 1 / 3  # wanted edges: a triangle between creases of smaller height belongs to a thin feature


def size(vertices, triangles):
    """Area in m^2, volume in m^3 (None unless watertight) and, in m, the bounding box and the reach from the origin."""
    watertight = topology.is_watertight(triangles)
    return {
        "area": float(topology.areas(vertices, triangles).sum()),
        "volume": float(topology.tetrahedra(vertices, triangles).sum()) if watertight else None,
        "box": np.ptp(vertices, axis=0).tolist(),
        "reach": float(np.linalg.norm(vertices, axis=1).max()),
    }


def warnings(measures):
    """Warnings from a target's measures (mesh/<target>.json): sentences on its CAD file, then on each band's mesh."""
    yield from measures["source"].get("warnings", ())
    for number, band in enumerate(measures["bands"]):
        if band.get("missed"):  # meshes of earlier versions do not have it
            yield f"the mesh of band {number} {band['missed']}"


def ideal_unknowns(area, edge):
    """Unknowns of a closed surface of this area in m^2 in equilateral triangles with edges of `edge` metres."""
    return float(1.5 * area / (np.sqrt(3) / 4 * edge**2))


def _spread(angle):
    """Least, first percentile and median of angles (N,) in degrees; None if there is none."""
    if len(angle) == 0:
        return {"min": None, "p1": None, "median": None}
    return {"min": float(angle.min()), "p1": float(np.percentile(angle, 1)), "median": float(np.median(angle))}


def describe(mesh, source, apart, wavelength, edge, axes=(), of_rods=0.0):
    """The measures of one band's mesh (vertices, triangles) beside its source's as a mapping; lengths in metres.

    `source` has the CAD surface's `area` and `volume`, as from `size`, and `thinned_by`, its shift by thinning. `apart`
    is the Hausdorff distance to the thinned surface as two pairs of metres and a point, to the source and from it.
    `axes` are the mesh's mirror planes. `of_rods`: m^2 of its area that thin rods gain, which does no harm.
    """
    vertices, triangles = mesh
    edges, (_, height, angle) = topology.edges(triangles), topology.shape(vertices[triangles])
    length = topology.lengths(vertices, edges.ends)
    lengths = {"mean": length.mean(), "max": length.max(), "p99": np.percentile(length, 99)}
    on_line = np.zeros(len(vertices), dtype=bool)
    on_line[edges.ends[topology.features(vertices, triangles)]] = True
    thin = on_line[triangles].all(axis=1) & (height < NARROW * edge)
    after, thinned_by, tree = size(*mesh), source["thinned_by"], cKDTree(vertices)
    mirror_errors = [float(tree.query(symmetry.mirrored(vertices, axis))[0].max()) for axis in axes]
    return {
        "wavelength": wavelength,
        "wanted_edge": edge,
        "vertices": len(vertices),
        "triangles": len(triangles),
        "unknowns": topology.unknowns(triangles),
        "ideal_unknowns": ideal_unknowns(source["area"], edge),
        "edge": {key: float(value) for key, value in lengths.items()},
        "edge_wavelengths": {key: float(value / wavelength) for key, value in lengths.items()},
        "smallest_angle": _spread(angle),
        "thin_triangles": int(thin.sum()),
        "smallest_angle_elsewhere": _spread(angle[~thin]),
        "watertight": topology.is_watertight(triangles),
        "components": topology.components(triangles)[0],
        "boundary_edges": int((edges.count == 1).sum()),
        "junction_edges": int((edges.count > 2).sum()),
        "area": {"before": source["area"], "after": after["area"], "of_rods": of_rods},
        "volume": {"before": source["volume"], "after": after["volume"]},
        "box": after["box"],
        "mirror_error": max(mirror_errors, default=None),
        "hausdorff": {"to_source": apart[0][0] + thinned_by, "from_source": apart[1][0] + thinned_by},
        "hausdorff_place": max(apart, key=lambda pair: pair[0])[1].tolist(),
    }
