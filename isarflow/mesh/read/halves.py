"""Half models: targets of which a file has the part on one side of a mirror plane alone, cut at the plane."""

from typing import NamedTuple

import numpy as np

from isarflow.mesh import symmetry, topology

IN_PLANE = 1 / 40  # wanted edges: what is nearer to a plane lies in it; rims so near each other are joined, too
FLAT = 0.99  # cosine between the normals of the plane and of a triangle that lies in it
STEPS = 10**6  # in the largest extent: vertices at the same of these in x, y and z are one


class Beside(NamedTuple):
    """A surface beside a plane."""

    vertices: np.ndarray  # (V, 3), each place once
    triangles: np.ndarray  # (T, 3), each once
    side: int  # 1 or -1 if all of it is on this side of the plane, though not all in it; else 0
    cut: np.ndarray  # (C, 2) rims in the plane, of triangles that leave it
    flat: np.ndarray  # (T,) True for triangles in the plane
    cap: np.ndarray  # (T,) True for those of a body's face: each of its outer edges has another face, too


def completed(vertices, triangles, planes, tolerance):
    """Complete a target by its mirror images about those of `planes` at which it is a half model.

    A half model lies on one side of the plane, and rims or a flat face of it lie in the plane within `tolerance`
    metres. The face of a closed body there becomes an inner wall and is dropped; other triangles in the plane occur
    once. Returns vertices, triangles, and the names of the planes.
    """
    cuts = []
    for axis in symmetry.axes(planes):
        beside = _beside(*_joined(vertices, triangles), axis, tolerance)
        if not beside.side or not (len(beside.cut) or beside.cap.any()):
            continue
        vertices, triangles = beside.vertices, beside.triangles
        in_plane = np.union1d(beside.cut, triangles[beside.flat])
        body = ~beside.flat | beside.cap  # without fins in the plane, which may share edges with a body
        piece, closed = topology.closed_pieces(triangles[body])
        inner = np.zeros(len(triangles), bool)
        inner[body] = beside.cap[body] & closed[piece]
        half = triangles[~inner]
        vertices[:, axis] = beside.side * np.maximum(beside.side * vertices[:, axis], 0.0)
        vertices[in_plane, axis] = 0.0
        vertices, triangles = symmetry.with_mirror(*topology.compact(vertices, half), axis)
        cuts.append(symmetry.PLANES[axis])
    return vertices, triangles, cuts


def cut_open(vertices, triangles, tolerance):
    """Names of the planes beside which a surface is cut open along whole lines of rims, as a half model is.

    Rims that go on outside of the planes, as of a sheet that stands on one, are not meant.
    """
    corners = vertices[topology.used(triangles)]
    at_end = np.abs([corners.min(axis=0), corners.max(axis=0)]).min(axis=0) <= tolerance
    if not at_end.any():
        return []
    joined = _joined(vertices, triangles)
    every = {axis: _beside(*joined, axis, tolerance) for axis in np.flatnonzero(at_end).tolist()}
    cuts = {axis: beside.cut for axis, beside in every.items() if beside.side and len(beside.cut)}
    if not cuts:
        return []
    rims = np.concatenate(list(cuts.values()))
    line = topology.groups(rims, len(joined[0]))[1]
    going_on = line[np.bincount(rims.ravel(), minlength=len(line)) % 2 == 1]
    return [symmetry.PLANES[axis] for axis, cut in cuts.items() if not np.isin(line[cut[:, 0]], going_on).all()]


def sentences(vertices, triangles, cuts, planes, tolerance):
    """Sentences on a target completed at the planes `cuts`, or that may be half of one beside more than `planes`."""
    if cuts:
        part, images = {1: ("half", "image"), 2: ("a quarter", "images"), 3: ("an eighth", "images")}[len(cuts)]
        yield f"The file has {part} of the target, beside {_named(cuts)}; its mirror {images} completed it."
    if cut := cut_open(vertices, triangles, tolerance):
        use = f"'symmetry: [{', '.join([*planes, *cut])}]' completes it"
        yield f"It lies on one side of {_named(cut)} and is cut open there: is it a half model? If so, {use}."


def advice(vertices, triangles, axis, tolerance):
    """Say what to do about a target that is not symmetric about a plane that its config names."""
    joined, triangles = _joined(vertices, triangles)
    low, high = joined[:, axis].min(), joined[:, axis].max()
    leave = "leave this plane out if the target is whole as it is"
    if len(_beside(joined, triangles, axis, tolerance).cut):
        beyond = f"goes on beyond it by {min(-low, high) * 1000:.3g} mm"
        return f"it is cut open in this plane, as a half model is, but {beyond}: cut that off, or {leave}"
    for end in (low, high):
        moved = joined - end * (np.arange(3) == axis)
        is_open = symmetry.PLANES[axis] in cut_open(moved, triangles, tolerance)
        if is_open or _beside(moved, triangles, axis, tolerance).cap.any():
            what = "is cut open" if is_open else "has a flat face"
            where = f"{'xyz'[axis]} = {end:.4g} m, and if it is a half model, this must be 0: translate it"
            return f"it {what} at {where}, or {leave}"
    if low >= -tolerance or high <= tolerance:
        return f"it lies on one side, but is not cut in this plane, as a half model is: mend it, or {leave}"
    return "mend it or leave this plane out"


def _named(planes):
    *others, last = planes
    return f"the planes {', '.join(others)} and {last}" if others else f"the plane {last}"


def _joined(vertices, triangles):
    """A surface with one vertex at each place, and triangles of three corners, each once."""
    vertices, triangles = topology.compact(vertices, triangles)
    x, y, z = np.round((vertices - vertices.min(axis=0)) * (STEPS / np.ptp(vertices, axis=0).max())).astype(np.int64).T
    _, first, name = np.unique((x * (STEPS + 1) + y) * (STEPS + 1) + z, return_index=True, return_inverse=True)
    triangles = name[triangles]
    triangles = triangles[topology.have_three_corners(triangles)]
    return vertices[first], triangles[topology.first_of_each(triangles)]


def _beside(vertices, triangles, axis, tolerance):
    """The Beside of a joined surface (vertices in metres) and a plane."""
    along = vertices[:, axis]
    near = np.abs(along) <= tolerance
    sides = [side for side in (1, -1) if (side * along).min() >= -tolerance and not near.all()]
    flat = near[triangles].all(axis=1)
    flat &= np.abs(topology.shape(vertices[triangles])[0][:, axis]) >= FLAT
    edges = topology.edges(triangles)
    of_flat = np.bincount(edges.sides[flat].ravel(), minlength=len(edges.ends))
    cut = edges.ends[(edges.count == 1) & (of_flat == 0) & near[edges.ends].all(axis=1)]
    cap, around = flat.copy(), edges.sides[flat]
    if flat.any():
        # Faces in the plane end where a body's wall begins, also if a fin in the plane goes on beyond it.
        within = (of_flat == 2) & (edges.count == 2)
        count, piece = topology.groups(topology.side_pairs(edges, within) // 3, len(triangles))
        open_there = ((of_flat[around] == 1) & (edges.count[around] != 2)).any(axis=1)
        cap[flat] = (np.bincount(piece[flat], open_there, count) == 0)[piece[flat]]
    return Beside(vertices, triangles, sides[0] if sides else 0, cut, flat, cap)
