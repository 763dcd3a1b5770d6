"""Small meshes to improve, with points moved at random."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import meshgauge
from meshgauge import Improvement, Mesh
from meshgauge.cells import BY_NAME
from meshgauge.mesh.topology import topology
from meshgauge.repair.faces import face_points

Bits = NDArray[np.int64]

TETRAHEDRA = ((0, 1, 3, 7), (1, 2, 3, 7), (0, 7, 4, 1), (4, 7, 5, 1), (1, 7, 5, 6), (1, 2, 7, 6))
PYRAMIDS = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
"""Faces of a hexahedron, seen from inside counter-clockwise."""


def grid(n: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points of a grid of n³ unit cubes, and their hexahedra."""
    line = np.arange(n + 1.0)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    a, b = slice(None, -1), slice(1, None)
    corners = [i[a, a, a], i[b, a, a], i[b, b, a], i[a, b, a], i[a, a, b], i[b, a, b], i[b, b, b], i[a, b, b]]
    return points, np.stack(corners, axis=-1).reshape(-1, 8)


def cells(kind: str, n: int) -> tuple[NDArray[np.float64], list[tuple[str, NDArray[np.int64]]]]:
    """A cube of n³ cubes, each cut into cells of a kind; "mixed" has two layers of hexahedra beside cut ones."""
    points, hexahedra = grid(n)
    if kind == "hexahedron":
        return points, [("hexahedron", hexahedra)]
    if kind == "wedge":
        return points, [("wedge", np.concatenate([hexahedra[:, [0, 1, 3, 4, 5, 7]], hexahedra[:, [1, 2, 3, 5, 6, 7]]]))]
    if kind == "tetra":
        return points, [("tetra", np.concatenate([hexahedra[:, list(t)] for t in TETRAHEDRA]))]
    centres = points[hexahedra].mean(axis=1)
    middle = len(points) + np.arange(len(hexahedra))
    pyramids = np.concatenate([np.column_stack([hexahedra[:, list(face)], middle]) for face in PYRAMIDS])
    if kind == "pyramid":
        return np.concatenate([points, centres]), [("pyramid", pyramids)]
    cut = centres[:, 0] > n / 2
    used = np.tile(cut, len(PYRAMIDS))
    return np.concatenate([points, centres]), [("hexahedron", hexahedra[~cut]), ("pyramid", pyramids[used])]


def shaken(kind: str, n: int, by: float, seed: int = 0) -> Mesh:
    """A mesh whose inner points are moved at random by up to ``by`` along each axis."""
    points, blocks = cells(kind, n)
    inside = ((points > 1e-9) & (points < n - 1e-9)).all(axis=1)
    points[inside] += np.random.default_rng(seed).uniform(-by, by, (int(inside.sum()), 3))
    return Mesh.from_arrays(points, blocks)


def on_boundary(mesh: Mesh, n: int) -> NDArray[np.bool_]:
    """Points on the sides of the cube."""
    points = np.asarray(mesh.points)
    return np.asarray(((points == 0.0) | (points == n)).any(axis=1))


def curved(kind: str, n: int, by: float, bulge: float, seed: int = 0) -> Mesh:
    """`shaken` as cells of second order, the middle of each edge off by up to ``bulge`` along each axis.

    ``kind`` is "tetra", "wedge" or "hexahedron".
    """
    mesh = shaken(kind, n, by, seed)
    row = BY_NAME[{"tetra": "tetra10", "wedge": "wedge15", "hexahedron": "hexahedron20"}[kind]]
    corners = np.asarray(mesh.connectivity, np.int64).reshape(mesh.n_cells, -1)
    pairs = [edge[:2] for edge in row.edges]
    ends = np.sort(np.concatenate([corners[:, list(pair)] for pair in pairs]), axis=1)
    unique, inverse = np.unique(ends, axis=0, return_inverse=True)
    middles = np.asarray(mesh.points)[unique].mean(axis=1)
    inside = ((middles > 1e-9) & (middles < n - 1e-9)).all(axis=1)
    middles[inside] += np.random.default_rng(seed + 1).uniform(-bulge, bulge, (int(inside.sum()), 3))
    nodes = np.concatenate([corners, mesh.n_points + inverse.reshape(len(pairs), -1).T], axis=1)
    return Mesh.from_arrays(np.concatenate([mesh.points, middles]), {row.name: nodes})


def pipe(n: int) -> Mesh:
    """A quarter of a pipe wall of n³ hexahedra, all but its edges moved at random along its surface and inside."""
    grid = shaken("hexahedron", n, 0.0)
    points = np.array(grid.points)
    rng = np.random.default_rng(2)
    inside = (points > 0) & (points < n)
    points += np.where(inside & (inside.sum(axis=1) >= 2)[:, None], rng.uniform(-0.4, 0.4, points.shape), 0.0)
    radius, angle = 1.0 + points[:, 0] / n, 0.5 * np.pi * points[:, 1] / n
    return grid.replace(points=np.stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2] / n], axis=1))


def slid(mesh: Mesh, n: int, by: float, seed: int = 0) -> Mesh:
    """The mesh with points of its sides moved at random within them, by up to ``by`` along each axis."""
    points = np.array(mesh.points)
    inside = (points > 1e-9) & (points < n - 1e-9)
    on_side = inside.sum(axis=1) == 2
    points += np.where(inside & on_side[:, None], np.random.default_rng(seed).uniform(-by, by, points.shape), 0.0)
    return mesh.replace(points=points)


def ball(n: int, centre: float, radius: float, by: float = 0.1) -> Mesh:
    """The cubes of a grid near to a centre, their boundary drawn onto a ball: corners at it are flat or inverted."""
    points, hexahedra = grid(2 * n)
    points -= n + centre
    hexahedra = hexahedra[np.linalg.norm(points[hexahedra].mean(axis=1), axis=1) < radius]
    used, local = np.unique(hexahedra, return_inverse=True)
    mesh = Mesh.from_arrays(points[used], {"hexahedron": local.reshape(-1, 8)})
    faces = topology(mesh)
    outer = np.unique(face_points(faces, np.flatnonzero(faces.mates < 0))[0])
    moved = np.array(mesh.points)
    moved[outer] *= ((radius + by) / np.linalg.norm(moved[outer], axis=1))[:, None]
    return mesh.replace(points=moved)


def bits(mesh: Mesh) -> Bits:
    return np.array(mesh.points, np.float64).view(np.int64)


def dented(kind: str, n: int, points: tuple[int, ...] = (), by: float = 1.1) -> Mesh:
    """A mesh of even cells with one inner point, or those named, moved by more than an edge."""
    mesh = shaken(kind, n, 0.0)
    moved = np.array(mesh.points)
    if not points:
        points = (int(np.argmin(np.linalg.norm(moved - (n - 1), axis=1))),)
    moved[list(points)] += by * np.array([0.7, 0.6, -0.5])
    return mesh.replace(points=moved)


def mended(mesh: Mesh, **options: object) -> Improvement:
    return meshgauge.improve(mesh, everywhere=False, **options)  # type: ignore[arg-type]
