"""Small shapes that the tests build, sound and broken: vertices (V, 3) in metres and triangles (T, 3)."""

import numpy as np
import pymeshlab
import pytest

from isarflow.mesh import topology


def save(path, vertices, triangles):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.asarray(vertices, float), np.asarray(triangles, np.int32)))
    meshes.save_current_mesh(str(path))
    return path


def sphere(radius=0.15, subdivisions=4):
    meshes = pymeshlab.MeshSet()
    meshes.create_sphere(radius=radius, subdiv=subdivisions)
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def cube(size=1.0):
    corners = np.array([[n & 1, n >> 1 & 1, n >> 2 & 1] for n in range(8)], float) - 0.5
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return size * corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def fine_cube(size=1.0, cuts=3):
    """A cube whose triangles are halved `cuts` times."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(*(np.ascontiguousarray(x) for x in cube(size))))
    meshes.meshing_surface_subdivision_midpoint(iterations=cuts, threshold=pymeshlab.PureValue(0))
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def soup(vertices, triangles):
    """Every triangle with corners of its own."""
    return vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def together(*parts):
    counts = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    return (
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate([triangles + count for (_, triangles), count in zip(parts, counts[:-1], strict=True)]),
    )


def moebius(radius=0.2):
    angle = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = [((1 + s * np.cos(a / 2)) * np.cos(a), (1 + s * np.cos(a / 2)) * np.sin(a), s * np.sin(a / 2))
            for a in angle for s in (-0.3, 0.3)]  # fmt: skip
    faces = [t for k in range(19) for a in [2 * k] for t in ((a, a + 1, a + 2), (a + 1, a + 3, a + 2))]
    return radius * np.array(ring), np.array([*faces, (38, 39, 1), (39, 0, 1)])


def torus(large, small, around, across):
    """A ring of 2 * around * across triangles."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    radius = large + small * np.cos(b)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), small * np.sin(b)], axis=-1).reshape(-1, 3)
    one = u * across + v
    two, three, four = (
        (u + 1) % around * across + v,
        (u + 1) % around * across + (v + 1) % across,
        u * across + (v + 1) % across,
    )
    return points, np.concatenate([np.stack([one, two, three], -1), np.stack([one, three, four], -1)]).reshape(-1, 3)


def needle_fan(radius=0.15, count=2000):
    """A disc of needles around its centre, 1/300 of a radius wide."""
    angle = 2 * np.pi * np.arange(count) / count
    rim = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    number = np.arange(count)
    return np.concatenate([[[0.0, 0, 0]], rim]), np.stack([0 * number, 1 + number, 1 + (number + 1) % count], axis=1)


def lofted(sections):
    """A closed solid through sections (S, N, 3) of as many points each, its two ends closed to their middles."""
    sections = np.asarray(sections, float)
    count, size = sections.shape[:2]
    k = np.arange(size)
    ring = np.stack([k, (k + 1) % size], axis=1)
    sides = [np.concatenate([[s * size + ring[:, 0], s * size + ring[:, 1], (s + 1) * size + ring[:, 1]],
                             [s * size + ring[:, 0], (s + 1) * size + ring[:, 1], (s + 1) * size + ring[:, 0]]], axis=1)
             for s in range(count - 1)]  # fmt: skip
    last, middle = (count - 1) * size, count * size
    ends = [[0 * k + middle, ring[:, 1], ring[:, 0]], [0 * k + middle + 1, last + ring[:, 0], last + ring[:, 1]]]
    vertices = np.concatenate([sections.reshape(-1, 3), sections[[0, -1]].mean(axis=1)])
    return vertices, np.concatenate([*sides, *ends], axis=1).T


def cone(radius=0.03, length=0.3, count=48):
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.stack([0 * angle, radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    k, after = np.arange(count), (np.arange(count) + 1) % count
    faces = [np.stack([k, after, 0 * k + count], 1), np.stack([after, k, 0 * k + count + 1], 1)]
    return np.concatenate([rim, [[length, 0, 0], [0, 0, 0]]]), np.concatenate(faces)


def tube(radius, wall, length, count):
    """A round tube about the x axis, open at both ends."""
    angle = 2 * np.pi * np.arange(count) / count
    rings = [(radius, -1), (radius, 1), (radius - wall, 1), (radius - wall, -1)]
    vertices = [np.stack([0 * angle + end * length / 2, r * np.cos(angle), r * np.sin(angle)], 1) for r, end in rings]
    here, there = np.arange(4 * count).reshape(4, count), np.roll(np.arange(4 * count).reshape(4, count), -1, axis=1)
    quads = np.stack([here, there, np.roll(there, -1, axis=0), np.roll(here, -1, axis=0)], axis=-1).reshape(-1, 4)
    return np.concatenate(vertices), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


def binary_stl(vertices, triangles):
    record = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["corners"] = vertices[triangles]
    return bytes(80) + len(triangles).to_bytes(4, "little") + record.tobytes()


def check_solid(edge, mesh, volume, area):
    """A closed mesh of this volume and area with triangles fit for edges of `edge` metres."""
    assert topology.is_watertight(mesh[1])
    assert topology.tetrahedra(*mesh).sum() == pytest.approx(volume, rel=0.01)
    assert topology.areas(*mesh).sum() == pytest.approx(area, rel=0.01)
    length = topology.edge_lengths(*mesh)
    assert length.mean() <= edge and length.max() <= 1.6 * edge
    assert np.median(topology.shape(mesh[0][mesh[1]])[2]) >= 40
