"""Cells with repeated nodes: measured as what they stand for, kept as the file has them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME, CELL_TYPES, SHAPES, CellType
from meshgauge.doctor import diagnosis, orient
from meshgauge.mesh import Mesh
from meshgauge.mesh.collapsed import resolve, stands_for
from meshgauge.quality.flat import volumes
from meshgauge.status import Status

Pattern = tuple[int, ...]
SOURCES = ("hexahedron", "hexahedron20", "hexahedron27", "voxel", "wedge", "wedge15", "wedge18", "pyramid", "pyramid13")


def patterns(n: int) -> Iterator[Pattern]:
    """Every way in which n corners may share nodes."""

    def more(pattern: list[int]) -> Iterator[Pattern]:
        if len(pattern) == n:
            yield tuple(pattern)
            return
        for first in [*sorted(set(pattern)), len(pattern)]:
            yield from more([*pattern, first])

    yield from more([])


@cache
def standing(name: str) -> list[Pattern]:
    """Patterns by which a cell stands for another shape; of a curved one among those of its linear cell."""
    row = BY_NAME[name]
    assert row.shape is not None
    among = patterns(row.shape.n_nodes) if name == row.shape.name else standing(row.shape.name)
    return [p for p in among if len(set(p)) < len(p) and stands_for(row.vtk_id, p)]


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("hexahedron", {"tetra": 102, "pyramid": 54, "wedge": 12}),
        ("wedge", {"tetra": 11, "pyramid": 3}),
        ("pyramid", {"tetra": 4}),
    ],
)
def test_which_patterns_stand_for_what(name: str, counts: dict[str, int]) -> None:
    found = [stands_for(BY_NAME[name].vtk_id, p) for p in standing(name)]
    names = [one.row.name for one in found if one is not None]
    assert {n: names.count(n) for n in counts} == counts
    documented = {
        (0, 1, 2, 2, 4, 5, 6, 6): ("wedge", (0, 1, 2, 4, 5, 6)),
        (0, 1, 2, 3, 4, 4, 4, 4): ("pyramid", (0, 1, 2, 3, 4)),
        (0, 1, 2, 2, 4, 4, 4, 4): ("tetra", (0, 1, 2, 4)),
    }
    for pattern, expected in documented.items() if name == "hexahedron" else ():
        one = stands_for(12, pattern)
        assert one is not None
        assert (one.row.name, one.nodes) == expected


@pytest.mark.parametrize(
    "pattern",
    [(0, 1, 2, 2, 4, 5, 6, 7), (0, 1, 0, 3, 4, 5, 6, 7), (0, 0, 0, 0, 4, 5, 4, 5), (0,) * 8, (0, 1, 2, 3, 4, 5, 5, 5)],
)
def test_one_collapsed_edge_is_no_other_shape(pattern: Pattern) -> None:
    assert stands_for(12, pattern) is None


def collapsed(name: str, pattern: Pattern) -> tuple[np.ndarray, list[int], str]:
    """Points of the ideal shape that a pattern stands for, the nodes of the cell on them, the name of the shape."""
    row = BY_NAME[name]
    one = stands_for(row.vtk_id, pattern)
    assert one is not None
    assert row.shape is not None
    target = one.row.shape
    assert target is not None
    points = [np.array(x) for x in target.points]
    # Node of the target at each corner of the shape, by the first corner with that node.
    at = {row.corners.index(one.nodes[k]): k for k in range(target.n_nodes)}
    corner_nodes = [at[first] for first in pattern]
    nodes = [0] * (row.n_nodes or 0)
    for corner, node in zip(row.corners, corner_nodes, strict=True):
        nodes[corner] = node
    middles: dict[frozenset[int], int] = {}
    for a, b, *middle in row.edges:
        ends = frozenset((nodes[a], nodes[b]))
        if not middle:
            continue
        if len(ends) == 2 and ends not in middles:
            middles[ends] = len(points)
            points.append(sum(points[n] for n in ends) / 2)
        nodes[middle[0]] = middles[ends] if len(ends) == 2 else nodes[a]
    for extra in range(row.shape.n_nodes + row.n_middles, row.n_nodes or 0):
        nodes[extra] = len(points)
        points.append(np.mean(points[: target.n_nodes], axis=0))
    return np.array(points), nodes, target.name


def mesh_of(name: str, chosen: list[Pattern], copies: int = 1) -> tuple[Mesh, list[str]]:
    points, cells, names, first = [], [], [], 0
    for pattern in chosen * copies:
        x, nodes, target = collapsed(name, pattern)
        points.append(x + 3 * len(cells))
        cells.append([first + n for n in nodes])
        names.append(target)
        first += len(x)
    return Mesh.from_arrays(np.concatenate(points), [(name, cells)]), names


@pytest.mark.parametrize("name", SOURCES)
def test_a_collapsed_cell_scores_as_what_it_stands_for(name: str) -> None:
    mesh, names = mesh_of(name, standing(name))
    quality = meshgauge.measure(mesh)
    np.testing.assert_allclose(quality.values, 1.0, atol=1e-12)
    assert not quality.status.any()
    assert quality.source is mesh
    assert [BY_NAME_OF[int(t)].shape.name for t in quality.mesh.types] == names  # type: ignore[union-attr]
    assert np.isfinite(quality.certificate.lower).all()
    mirrored = meshgauge.measure(mesh.replace(points=mesh.points * (1, 1, -1)))
    np.testing.assert_allclose(mirrored.values, -1.0, atol=1e-12)


BY_NAME_OF: dict[int, CellType] = CELL_TYPES


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("copies", [1, 3000])
def test_few_cells_and_many_and_among_others(copies: int, threads: int) -> None:
    chosen = [(0, 1, 2, 2, 4, 5, 6, 6), (0, 1, 2, 3, 4, 4, 4, 4), (0, 1, 2, 2, 4, 4, 4, 4)]
    part, _ = mesh_of("hexahedron", chosen)
    cube = np.array(SHAPES["hexahedron"].points) + 50
    one = np.concatenate([part.connectivity.reshape(-1, 8), len(part.points) + np.arange(8)[None]])
    points = np.concatenate([part.points, cube])
    cells = (one[None] + len(points) * np.arange(copies)[:, None, None]).reshape(-1, 8)
    mesh = Mesh.from_arrays(np.tile(points, (copies, 1)), [("hexahedron", cells)])
    quality = meshgauge.measure(mesh, threads=threads)
    np.testing.assert_allclose(quality.values, 1.0, atol=1e-12)
    assert quality.mesh.type_counts() == {"tetra": copies, "hexahedron": copies, "wedge": copies, "pyramid": copies}
    n = 3 * copies
    listed = ", ".join(f"{copies:,} {name}" for name in ("pyramid", "tetra", "wedge"))
    assert quality.mesh.notes == (f"{n:,} cells with repeated nodes are measured as what they stand for: {listed}.",)
    assert mesh.type_counts() == {"hexahedron": 4 * copies}
    assert quality.summary().n_cells == 4 * copies


def test_keep_bricks_measures_all_as_bricks() -> None:
    mesh, _ = mesh_of("hexahedron", [(0, 1, 2, 2, 4, 5, 6, 6)])
    quality = meshgauge.measure(mesh, keep_bricks=True)
    assert quality.mesh is mesh
    assert quality.status.tolist() == [Status.REPEATED_POINTS]


def test_a_mesh_without_collapsed_cells_is_measured_itself() -> None:
    mesh = Mesh.from_arrays(np.array(SHAPES["hexahedron"].points), [("hexahedron", [range(8)])])
    assert resolve(mesh) is mesh
    assert meshgauge.measure(mesh).mesh is mesh


def test_a_brick_with_one_collapsed_edge_is_measured_as_a_brick_and_named() -> None:
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    flat = cube * (1, 1, 0)
    mesh = Mesh.from_arrays(
        np.concatenate([cube, flat + 5]), [("hexahedron", [(0, 1, 2, 2, 4, 5, 6, 7), range(8, 16)])]
    )
    quality = meshgauge.measure(mesh)
    assert quality.mesh.type_counts() == {"hexahedron": 2}
    texts = {one.status: (one.n_cells, one.cells, one.text) for one in quality.findings()}
    assert texts["repeated_points"][:2] == (1, (0,))
    assert "(1 with a collapsed edge and a positive volume)" in texts["repeated_points"][2]
    assert "(1 without volume)" in texts["degenerate"][2]


@pytest.mark.parametrize("name", SHAPES)
def test_volumes_are_those_of_the_shapes(name: str) -> None:
    shape = SHAPES[name]
    x = np.array(shape.points)
    apex = x.mean(axis=0)
    exact = (
        sum(
            np.linalg.det([x[face[0]] - apex, x[face[k]] - apex, x[face[k + 1]] - apex])
            for face in shape.faces
            for k in range(1, len(face) - 1)
        )
        / 6
    )
    size = np.abs(x - apex).max()
    assert volumes(x[None], shape)[0] * size**3 == pytest.approx(exact)
    assert volumes(x[None] * (1, 1, -1), shape)[0] * size**3 == pytest.approx(-exact)


def test_worst_node_is_counted_in_the_cell_of_the_file() -> None:
    mesh, _ = mesh_of("hexahedron", [(0, 0, 2, 3, 4, 4, 6, 7)])
    points = mesh.points.copy()
    points[mesh.nodes(0)[7]] *= 0.3
    worst = meshgauge.measure(mesh.replace(points=points)).worst(1)[0]
    assert mesh.nodes(0)[worst.node] == worst.point
    assert worst.type == "wedge"


EXTENSIONS = [".vtu", ".vtk", ".vtkhdf", ".inp", ".msh", ".mesh", ".su2", ".ugrid", ".med", ".xdmf"]


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_the_brick_of_the_file_is_written_back(tmp_path: Path, extension: str) -> None:
    mesh, _ = mesh_of("hexahedron", [(0, 1, 2, 2, 4, 5, 6, 6), (0, 1, 2, 3, 4, 4, 4, 4), (0, 1, 2, 2, 4, 4, 4, 4)])
    io.write(tmp_path / f"a{extension}", mesh)
    back = io.read(tmp_path / f"a{extension}")
    assert back.type_counts() == {"hexahedron": 3}
    np.testing.assert_array_equal(back.connectivity, mesh.connectivity)
    np.testing.assert_allclose(meshgauge.measure(back).values, 1.0, atol=1e-6)
    from meshgauge.cli.main import main

    assert main(["check", "-q", str(tmp_path / f"a{extension}")]) == 0
    assert main(["report", "-q", str(tmp_path / f"a{extension}"), "-o", str(tmp_path / "b.vtu")]) == 0
    written = io.read(tmp_path / "b.vtu")
    assert written.type_counts() == {"hexahedron": 3}
    np.testing.assert_array_equal(written.connectivity, mesh.connectivity)
    np.testing.assert_allclose(written.cell_data["jens"], 1.0, atol=1e-6)


def test_doctor_sees_faces_of_what_a_brick_stands_for() -> None:
    """A wedge as a brick on top of a cube: the square is the face of both, and none is left over."""
    cube = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    points = np.array([*cube, (0.5, 0, 2), (0.5, 1, 2)], float)
    mesh = Mesh.from_arrays(points, [("hexahedron", [range(8), (4, 5, 6, 7, 8, 8, 9, 9)])])
    found = diagnosis(mesh)
    assert not [one for one in found.findings if one.level == "defect"]
    assert found.n_boundary_faces == 5 + 4


def test_reversed_bricks_are_renumbered_as_the_bricks_of_the_file() -> None:
    mesh, _ = mesh_of("hexahedron", [(0, 1, 2, 2, 4, 5, 6, 6)] * 3 + [(0, 1, 2, 3, 4, 4, 4, 4)])
    nodes = mesh.connectivity.copy()
    nodes[:8] = nodes[[0, 3, 2, 1, 4, 7, 6, 5]]
    bad = mesh.replace(connectivity=nodes)
    assert meshgauge.measure(bad).values[0] < 0
    after, _ = orient(bad)
    assert after.type_counts() == {"hexahedron": 4}
    np.testing.assert_allclose(meshgauge.measure(after).values, 1.0, atol=1e-12)


def test_improve_moves_the_points_and_keeps_the_bricks() -> None:
    n = 4
    x = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    index = np.arange(n**3).reshape(n, n, n)
    cells = []
    for i, j, k in np.ndindex(n - 1, n - 1, n - 1):
        a = index[i : i + 2, j : j + 2, k : k + 2]
        b = [a[0, 0, 0], a[1, 0, 0], a[1, 1, 0], a[0, 1, 0], a[0, 0, 1], a[1, 0, 1], a[1, 1, 1], a[0, 1, 1]]
        cells += [[b[0], b[1], b[2], b[2], b[4], b[5], b[6], b[6]], [b[0], b[2], b[3], b[3], b[4], b[6], b[7], b[7]]]
    inner = ((x > 0) & (x < n - 1)).all(axis=1)
    x[inner] += np.random.default_rng(1).uniform(-0.35, 0.35, (int(inner.sum()), 3))
    mesh = Mesh.from_arrays(x, [("hexahedron", cells)])
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.mesh.type_counts() == mesh.type_counts()
    np.testing.assert_array_equal(result.mesh.connectivity, mesh.connectivity)
    assert meshgauge.measure(result.mesh).values.min() > meshgauge.measure(mesh).values.min() + 0.02
    assert result.undo() is mesh
