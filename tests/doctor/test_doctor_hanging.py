"""Hanging points: found wherever finer cells stand beside coarser ones, and nowhere else."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from meshgauge import Mesh, measure
from meshgauge.check import State, check
from meshgauge.doctor import diagnosis, hanging
from meshgauge.mesh.polyhedra import Polyhedra

CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def octree(n: int, parts: Callable[[int, int, int], int]) -> Mesh:
    """``n³`` cubes, each cut into ``parts³`` (1, 2 or 4); points are shared where they are the same."""
    ids: dict[tuple[int, int, int], int] = {}
    cells = []
    for place in np.ndindex(n, n, n):
        m = parts(*place)
        size = 4 // m
        for sub in np.ndindex(m, m, m):
            low = [4 * p + size * s for p, s in zip(place, sub, strict=True)]
            corners = [tuple(a + size * c for a, c in zip(low, corner, strict=True)) for corner in CUBE]
            cells.append([ids.setdefault(corner, len(ids)) for corner in corners])
    return Mesh.from_arrays(np.array(list(ids), float), [("hexahedron", cells)])


def expected(mesh: Mesh) -> tuple[list[int], list[int]]:
    """By looking at every point for each cell: those in its box that are no nodes of it, and the cells with some."""
    corners = mesh.points[mesh.connectivity].reshape(-1, 8, 3)
    points, cells = set(), []
    for cell in range(mesh.n_cells):
        low, high = corners[cell].min(axis=0), corners[cell].max(axis=0)
        inside = np.flatnonzero(((mesh.points >= low) & (mesh.points <= high)).all(axis=1))
        extra = set(inside.tolist()) - set(mesh.nodes(cell).tolist())
        points |= extra
        cells += [cell] if extra else []
    return sorted(points), cells


def as_polyhedra(mesh: Mesh) -> Mesh:
    n = mesh.n_cells
    faces = mesh.connectivity.reshape(-1, 8)[:, np.array(FACES)]
    poly = Polyhedra(6 * np.arange(n + 1), np.arange(6 * n), 4 * np.arange(6 * n + 1), faces.reshape(-1))
    return mesh.replace(types=np.full(n, 42, np.uint8), polyhedra=poly)


RNG = np.random.default_rng(5)
SIZES = RNG.choice([1, 2, 4], (3, 3, 3))
GRADED = {
    "one fine cell": lambda i, j, k: 2 if (i, j, k) == (1, 1, 1) else 1,
    "checkerboard": lambda i, j, k: 1 + (i + j + k) % 2,
    "four to one": lambda i, j, k: 4 if i == 1 else 1,
    "any": lambda i, j, k: int(SIZES[i, j, k]),
}


@pytest.mark.parametrize("kind", GRADED)
def test_all_hanging_points_and_the_cells_in_which_they_hang(kind: str) -> None:
    mesh = octree(3, GRADED[kind])
    points, cells = expected(mesh)
    for one in (mesh, as_polyhedra(mesh)):
        found = hanging(measure(one))
        assert found.points.tolist() == points
        assert found.cells.tolist() == cells
        assert found.n_edges > 0
        assert found.n_faces > 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_however_the_mesh_is_turned_moved_and_numbered(dtype: type) -> None:
    mesh = octree(3, GRADED["any"])
    points, cells = expected(mesh)
    rotation = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    place, order = RNG.permutation(mesh.n_points), RNG.permutation(mesh.n_cells)
    moved = np.empty((mesh.n_points, 3), dtype)
    moved[place] = mesh.points @ rotation.T * 1e-3 + 5
    nodes = place[mesh.connectivity].reshape(-1, 8)[order]
    found = hanging(measure(Mesh.from_arrays(moved, [("hexahedron", nodes)])))
    assert found.points.tolist() == sorted(place[points].tolist())
    assert found.cells.tolist() == np.flatnonzero(np.isin(order, cells)).tolist()


def test_two_halves_against_one_face() -> None:
    mesh = octree(1, lambda i, j, k: 1)
    points = np.vstack([mesh.points / 4, [(1, 0.5, 0), (1, 0.5, 1), (2, 0, 0), (2, 0.5, 0), (2, 1, 0)]])
    points = np.vstack([points, points[-3:] + np.array([0, 0, 1])])
    find = {tuple(point): n for n, point in enumerate(points.tolist())}
    cells = [mesh.nodes(0).tolist()]
    cells += [[find[1 + x, low + y / 2, float(z)] for x, y, z in CUBE] for low in (0.0, 0.5)]
    found = diagnosis(Mesh.from_arrays(points, [("hexahedron", cells)]))
    finding = found.finding("hanging_points")
    assert finding is not None
    assert (finding.level, finding.examples) == ("defect", (8, 9))
    assert finding.text == ("2 points hang, in 2 edges of 1 coarser cell, which does not have them (points 8, 9).")
    assert found.finding("hinges") is None
    assert "hanging points" in found.checked


@pytest.mark.parametrize("kind", ["plain", "in contact", "apart", "tetra"])
def test_conforming_meshes_have_none(kind: str) -> None:
    mesh = octree(3, lambda i, j, k: 1)
    if kind == "in contact":  # a finer body beside, with points of its own: nothing leads there
        finer = octree(3, lambda i, j, k: 2)
        points = np.vstack([mesh.points, finer.points + np.array([12, 0, 0])])
        nodes = [mesh.connectivity.reshape(-1, 8), finer.connectivity.reshape(-1, 8) + mesh.n_points]
        mesh = Mesh.from_arrays(points, [("hexahedron", np.vstack(nodes))])
    elif kind == "apart":
        nodes = np.arange(8 * mesh.n_cells).reshape(-1, 8)
        mesh = Mesh.from_arrays(mesh.points[mesh.connectivity], [("hexahedron", nodes)])
    elif kind == "tetra":
        five = np.array([(0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 5, 6), (3, 4, 6, 7), (1, 3, 4, 6)])
        mesh = Mesh.from_arrays(mesh.points, [("tetra", mesh.nodes(0)[five])])
    assert diagnosis(mesh).finding("hanging_points") is None
    outcome = check(measure(mesh), ["nothing hanging"]).outcomes[0]
    assert (outcome.state, outcome.text.split(" is ")[1]) == (State.PASS, "at a hanging point")


def test_the_rule_names_the_coarser_cells() -> None:
    mesh = octree(3, GRADED["one fine cell"])
    outcome = check(measure(mesh), ["nothing hanging"]).outcomes[0]
    assert outcome.state == State.FAIL
    assert outcome.n_failing == len(expected(mesh)[1]) == 18
    assert check(measure(mesh)).is_passed  # not among the rules that are held by default


def test_ghosts_are_not_looked_at() -> None:
    mesh = octree(3, GRADED["one fine cell"])
    marks = np.zeros(mesh.n_cells, np.uint8)
    marks[expected(mesh)[1]] = 1
    assert diagnosis(mesh.replace(cell_data={"vtkGhostType": marks})).finding("hanging_points") is None
