"""Targets of several parts, of a CAD file each or of one: meshed as one surface of which each triangle keeps its part.

A part without `material` is metal. It hides what lies inside of it, as opaque bodies do. Others are thin sheets, which
waves pass.
"""

import igl
import numpy as np
from scipy.spatial import cKDTree

from isarflow.core.errors import InputError
from isarflow.mesh import symmetry, topology
from isarflow.mesh.ground import Ground
from isarflow.mesh.read.target import REST, hides

MOST_SHARED = 20  # times the reach, squared: the most area on which two sheets may lie on each other, as beside a seam
NOT_ON = 1e-3  # edges: the least distance of a hollow's wall from the outer one
UNLIKE = 0.1  # of a part's area: the most whose mirror image is of another part than that of the rest


class Parts:
    """The surfaces of a target's parts.

    said: the `parts` of a target; surfaces: of each part by name, (vertices, triangles) in metres; completed: mirror
    planes at which the file's half model was completed; reach: metres within which a part lies on another.
    """

    def __init__(self, said, surfaces, completed, reach):
        self.names, self.reach = sorted(surfaces), reach
        self.may_lack = REST if not said.get(REST) else None  # named by no user, it may lie in metal
        self.sheets = np.array([not hides(said[name]) for name in self.names])
        for axis in symmetry.axes(completed):
            surfaces = {
                name: (
                    np.concatenate([points, symmetry.mirrored(points, axis)]),
                    np.concatenate([corners, corners + len(points)]),
                )
                for name, (points, corners) in surfaces.items()
            }
        self.surfaces = []
        for points, corners in (surfaces[name] for name in self.names):
            has_area = topology.areas(points, corners) > 0
            self.surfaces.append((np.ascontiguousarray(points, float), corners[has_area].astype(np.int64)))

    def passed(self, vertices, triangles):
        """True for each triangle (T, 3) that waves pass, (T,)."""
        return self.sheets[self._nearest(self._apart(vertices, triangles))]

    def of(self, vertices, triangles, name):
        """The number of the part that each triangle of a target is of, (T,): of metal, where a sheet lies on it.

        Raises InputError for a part of which there is nothing, and for sheets that lie on each other.
        """
        apart = self._apart(vertices, triangles)
        part = self._nearest(apart)
        for number, of_part in enumerate(self.names):
            if of_part != self.may_lack and not (part == number).any():
                inside = "it lies inside of metal, where no wave reaches, or on other parts, or is too small a detail"
                raise InputError(f"{name}: nothing is left of the part '{of_part}': {inside}; leave it out.")
        on_both = self.sheets[part] & (((apart <= self.reach) & self.sheets[:, None]).sum(axis=0) > 1)
        area = topology.areas(vertices, triangles) * on_both
        if area.sum() > (MOST_SHARED * self.reach) ** 2:
            at = area.argmax()
            both = " and ".join(f"'{self.names[number]}'" for number in sorted(apart[:, at].argsort()[:2]))
            where = f"near {topology.place(vertices[triangles[at]].mean(axis=0))}"
            raise InputError(
                f"{name}: the parts {both} lie on each other {where}: leave one of the two walls out there."
            )
        return part

    def _apart(self, vertices, triangles):
        """Metres from each part to the middles of triangles, (P, T)."""
        middles = np.ascontiguousarray(vertices[triangles].mean(axis=1))
        return np.sqrt([igl.point_mesh_squared_distance(middles, *surface)[0] for surface in self.surfaces])

    def _nearest(self, apart):
        return (apart + self.reach * self.sheets[:, None]).argmin(axis=0)


def alternating(vertices, triangles):
    """Triangles of a surface, of which closed pieces that lie in an odd number of others are turned inwards.

    A closed surface has then one inside, between its pieces, and one volume.
    """
    piece, closed = topology.closed_pieces(triangles)
    depth = np.zeros(len(closed), int)
    first = vertices[triangles[np.unique(piece, return_index=True)[1]]].mean(axis=1)
    for number in np.flatnonzero(closed):
        within = igl.winding_number(vertices, triangles[piece == number].astype(np.int64), first) > 0.5
        depth += within & (np.arange(len(closed)) != number)
    inward = (closed & (depth % 2 == 1))[piece]
    return np.where(inward[:, None], triangles[:, ::-1], triangles)


def hollows(vertices, triangles, united, edge):
    """True for each closed piece of a surface that lies in the solid bodies of `united`, and a place on each piece.

    united: vertices and triangles of the same surface without what lies in it; edge: metres between vertices.
    """
    piece, closed = topology.closed_pieces(triangles)
    middles = vertices[triangles[np.unique(piece, return_index=True)[1]]].mean(axis=1)
    apart = np.abs(Ground(*united).distance(middles)[0]) > NOT_ON * edge
    return closed & apart & (igl.winding_number(united[0], united[1].astype(np.int64), middles) > 0.5), middles


def carried(source, mesh, planes, name):
    """The part of each triangle of a `mesh` (vertices, triangles) that was made of a Source, (T,).

    A piece of the mesh is one of the source; within it the nearest of the source's triangles says which part it is.
    planes: of the mesh's exact symmetry. Raises InputError for parts that are less symmetric.
    """
    (count, piece), own = topology.components(mesh[1]), topology.components(source.triangles)[1]
    middles = mesh[0][mesh[1]].mean(axis=1)
    nearest, part = own[Ground(*source[:2]).distance(middles)[1]], np.zeros(len(middles), int)
    for number in range(count):
        mine = np.flatnonzero(piece == number)
        there = np.flatnonzero(own == np.bincount(nearest[mine]).argmax())
        part[mine] = source.part[there[Ground(source.vertices, source.triangles[there]).distance(middles[mine])[1]]]
    area, count = topology.areas(*mesh), int(part.max()) + 1
    for plane in planes:
        axis = symmetry.AXES[plane]
        other = cKDTree(middles).query(symmetry.mirrored(middles, axis))[1]
        shared = np.zeros((count, count))
        np.add.at(shared, (part, part[other]), area)
        image = shared.argmax(axis=1)
        unlike = (part[other] != image[part]) | (image[image[part]] != part)
        if (np.bincount(part, area * unlike, count) > UNLIKE * np.bincount(part, area, count)).any():
            place = topology.place(middles[unlike][area[unlike].argmax()])
            raise InputError(f"{name}: its parts are not symmetric about the plane {plane}, as near {place}; mend it.")
        positive = middles[:, axis] > 0
        part[other[positive]] = image[part[positive]]
    return part
