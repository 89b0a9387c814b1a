"""Where scattering centres lie on the dataset's targets, against edges and tips: `make bench-centres`.

Centres are fitted in three dimensions to the apertures about some directions of each target (VV, without noise). Their
power is counted within half a range cell of the surface, of its edges (creases, rims and junctions) and of its tips
(corners where edges end or bend), beside the share of the surface that is as near, where chance would put them. A table
goes to results/benchmarks/centres.csv.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from imaged import TARGETS
from runner import options_of
from scipy.spatial import cKDTree

from isarflow.core.sweep import C0
from isarflow.imaging.target_centres import near, target_centres
from isarflow.mesh import topology
from isarflow.mesh.io import read_ply

FIELDS, MESHES = Path("resources/fields"), Path("results/optics/mesh")
APERTURE, ELEVATIONS, AZIMUTHS = 21, (0,), (0, 45, 90, 135, 180)  # samples; degrees, one side of a mirror plane
SHARP = 40  # degrees by which an edge bends at a tip
POINTS = 20_000  # random ones of a surface


def edges_and_tips(vertices, triangles):
    """Points (n, 3) on the edges, at the mesh's spacing, and the tips, (m, 3), in m."""
    edges = topology.edges(triangles).ends[topology.features(vertices, triangles)]
    ends = vertices[edges]
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    tips = []
    for vertex in np.unique(edges):
        away = np.concatenate([along[edges[:, 0] == vertex], -along[edges[:, 1] == vertex]])
        if len(away) != 2 or away[0] @ away[1] > -np.cos(np.radians(SHARP)):
            tips.append(vertices[vertex])
    return np.concatenate([ends.mean(axis=1), ends[:, 0]]), np.array(tips)


def on_surface(vertices, triangles):
    """Random points of a surface, (POINTS, 3) in m."""
    random, area = np.random.default_rng(0), topology.areas(vertices, triangles)
    corners = vertices[triangles[random.choice(len(triangles), POINTS, p=area / area.sum())]]
    return np.einsum("nk,nkx->nx", random.dirichlet([1, 1, 1], POINTS), corners)


def rows_of(target):
    """Rows of (target, direction) with the number of centres and the shares of their power, and of the surface."""
    field = xr.open_zarr(FIELDS / f"{target}.zarr").field.sel(polarization="VV").load()
    vertices, triangles = read_ply(MESHES / f"{target}-0.ply")
    random = on_surface(vertices, triangles)
    edges, tips = edges_and_tips(vertices, triangles)
    frequency = field.frequency.values
    half = C0 / (4 * len(frequency) * (frequency[1] - frequency[0]))
    trees = {"surface": cKDTree(random), "edges": cKDTree(edges), "tips": cKDTree(tips)}
    chance = {f"{name}_chance": (tree.query(random)[0] < half).mean() for name, tree in trees.items()}
    for elevation in ELEVATIONS:
        for azimuth in AZIMUTHS:
            places, amplitudes = target_centres(near(field, APERTURE, elevation, azimuth), vertices)
            power = np.abs(amplitudes) ** 2 / (np.abs(amplitudes) ** 2).sum()
            shares = {name: power[tree.query(places)[0] < half].sum() for name, tree in trees.items()}
            where = {"target": target, "elevation": elevation, "azimuth": azimuth, "half_cell_m": half}
            yield where | {"centres": len(places)} | shares | chance


def main():
    options = options_of(__doc__)
    rows = []
    for target in TARGETS:
        rows += rows_of(target)
        print(f"{target}: {rows[-1]['edges']:.2f} of the power of the last direction lies at edges", flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(options.out / "centres.csv", index=False, float_format="%.4g")
    print(table.groupby("target").mean(numeric_only=True).round(2).to_string())


if __name__ == "__main__":
    main()
