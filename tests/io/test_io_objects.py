"""Meshes made of PyVista grids and meshio meshes."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from io_meshes import assert_same_cells, assert_same_data, mesh_of

from meshgauge import io
from meshgauge.cells import BY_NAME
from meshgauge.errors import MeshError, ReadError, WriteError
from meshgauge.io.plumbing import meshio as bridge
from meshgauge.io.plumbing import vtk
from meshgauge.mesh import CellBlock, Mesh
from meshgauge.mesh.regions import regions

pv = pytest.importorskip("pyvista")
meshio = pytest.importorskip("meshio")
RNG = np.random.default_rng(5)


def test_pyvista_grid(loaded: Mesh, polyhedral: Mesh) -> None:
    for mesh in (loaded, polyhedral):
        back = io.from_pyvista(pv.wrap(vtk.grid(mesh)[0]))
        assert_same_cells(mesh, back)
        assert_same_data(mesh, back)


def test_a_mesh_outlives_the_grid_it_was_made_of() -> None:
    grid = pv.ImageData(dimensions=(20, 20, 20)).cast_to_structured_grid().cast_to_unstructured_grid()
    points = grid.points.copy()
    mesh = io.from_pyvista(grid)
    del grid
    gc.collect()
    np.testing.assert_array_equal(mesh.points, points)


def test_objects_and_back(loaded: Mesh, polyhedral: Mesh) -> None:
    for mesh in (loaded, polyhedral):
        back = io.from_pyvista(mesh.to_pyvista())
        assert_same_cells(mesh, back)
        assert_same_data(mesh, back)
    loaded = loaded[loaded.types != BY_NAME["voxel"].vtk_id]  # which meshio has as a hexahedron
    back = io.from_meshio(loaded.to_meshio())
    assert_same_cells(loaded, back)
    assert_same_data(loaded, back)
    with pytest.raises(WriteError, match="polyhedron"):
        polyhedral.to_meshio()


def test_named_blocks_are_regions_of_the_objects() -> None:
    parts = (CellBlock("steel", 0, 2), CellBlock("glue", 2, 4))
    mesh = mesh_of("tetra", "wedge").replace(blocks=parts)
    for back in (io.from_pyvista(mesh.to_pyvista()), io.from_meshio(mesh.to_meshio())):
        ids, names = regions(back)
        assert np.array(names)[ids].tolist() == ["steel", "steel", "glue", "glue"]


def test_fixed_size_cell_arrays() -> None:
    grid = pv.UnstructuredGrid({pv.CellType.TETRA: np.array([[0, 1, 2, 3], [1, 2, 3, 4]])}, RNG.random((5, 3)))
    cells = grid.GetCells()
    if not hasattr(cells, "UseFixedSizeDefaultStorage"):
        pytest.skip("VTK before 9.5 has no cell arrays of fixed size")
    assert cells.ConvertToFixedSize64BitStorage()
    mesh = io.from_pyvista(grid)
    assert mesh.offsets.tolist() == [0, 4, 8]
    assert mesh.connectivity.tolist() == [0, 1, 2, 3, 1, 2, 3, 4]


def test_data_that_only_some_blocks_have_are_filled() -> None:
    a, b = (pv.wrap(vtk.grid(mesh_of("tetra"))[0]) for _ in range(2))
    a.cell_data["n"] = np.array([1, 2])
    b.cell_data["s"] = np.array(["x", "y"])
    mesh = io.from_pyvista(pv.MultiBlock({"a": a, "b": b}))
    np.testing.assert_array_equal(mesh.cell_data["n"], [1, 2, np.nan, np.nan])
    assert mesh.cell_data["s"].tolist() == ["", "", "x", "y"]
    assert [block.name for block in mesh.blocks] == ["a", "b"]


@pytest.mark.parametrize("wrong", [None, 3, "text", [1, 2]])
def test_what_is_no_mesh_is_refused(wrong: object) -> None:
    with pytest.raises(ReadError, match="not a PyVista"):
        io.from_pyvista(wrong)
    with pytest.raises(MeshError, match="not a meshio"):
        io.from_meshio(wrong)


def test_meshio_mesh_keeps_blocks_data_and_sets() -> None:
    source = meshio.Mesh(
        RNG.random((8, 3)),
        [("tetra", [[0, 1, 2, 3]]), ("triangle", [[0, 1, 2], [1, 2, 3]]), ("tetra", [[4, 5, 6, 7]])],
        cell_data={"m": [[1], [2, 3], [4]]},
        point_data={"t": np.arange(8)},
        cell_sets={"wall": [[], [1], [0]]},
    )
    mesh = io.from_meshio(source)
    assert mesh.types.tolist() == [10, 5, 5, 10]
    assert [(b.name, b.start, b.stop) for b in mesh.blocks] == [("tetra", 0, 1), ("triangle", 1, 3), ("tetra", 3, 4)]
    assert mesh.cell_data["m"].tolist() == [1, 2, 3, 4]
    assert mesh.cell_data["wall"].tolist() == [0, 0, 1, 1]
    assert mesh.point_data["t"].tolist() == list(range(8))


def test_meshio_two_dimensional_points() -> None:
    mesh = io.from_meshio(meshio.Mesh([[0.0, 0], [1, 0], [0, 1]], [("triangle", [[0, 1, 2]])]))
    assert mesh.points.shape == (3, 3)


@pytest.mark.parametrize(
    ("name", "n", "ours"),
    [
        ("pyramid14", 14, "higher_order_pyramid"),
        ("tetra20", 20, "higher_order_tetra"),
        ("wedge40", 40, "higher_order_wedge"),
        ("hexahedron64", 64, "higher_order_hexahedron"),
        ("VTK_LAGRANGE_TETRAHEDRON", 20, "lagrange_tetra"),
        ("hexahedron20", 20, "hexahedron20"),
    ],
)
def test_meshio_curved_types(name: str, n: int, ours: str) -> None:
    source = meshio.Mesh(RNG.random((n, 3)), [(name, [np.arange(n)])])
    mesh = io.from_meshio(source, wedge_order="gmsh")
    assert mesh.type_counts() == {ours: 1}
    assert mesh.nodes(0).tolist() == list(range(n))


def test_meshio_polyhedra() -> None:
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    source = meshio.Mesh(RNG.random((5, 3)), [("tetra", [[0, 1, 2, 4]]), ("polyhedron4", [faces])])
    mesh = io.from_meshio(source)
    assert mesh.type_counts() == {"tetra": 1, "polyhedron": 1}
    assert mesh.nodes(1).tolist() == [0, 1, 2, 3]
    assert mesh.polyhedra is not None
    assert mesh.polyhedra.cell_offsets.tolist() == [0, 0, 4]
    assert mesh.polyhedra.face_points.tolist() == [p for face in faces for p in face]


def test_every_meshio_type_with_a_dimension_has_a_row() -> None:
    for name in meshio._mesh.topological_dimension:
        assert bridge.row(name).dimension == meshio._mesh.topological_dimension[name]
    with pytest.raises(MeshError, match="'blob'"):
        bridge.row("blob")


@pytest.mark.parametrize("order", ["auto", "gmsh"])
def test_wedges_of_meshio_and_pyvista(order: str) -> None:
    mesh = mesh_of("wedge")
    assert_same_cells(mesh, io.from_meshio(bridge.from_mesh(mesh), wedge_order=order))
    assert_same_cells(mesh, io.from_pyvista(vtk.grid(mesh)[0], wedge_order=order))


@pytest.mark.parametrize("n", [bridge.MAX_SETS, bridge.MAX_SETS + 2])
def test_cell_sets_beyond_those_kept_are_counted(n: int) -> None:
    sets = {f"set {m}": [np.array([0])] for m in range(n)}
    source = meshio.Mesh(np.eye(4, 3), [("tetra", np.array([[0, 1, 2, 3]]))], cell_sets=sets)
    mesh = bridge.mesh(source)
    assert len(mesh.cell_data) == bridge.MAX_SETS
    assert [note for note in mesh.notes if "left out" in note] == (
        [f"2 of {n} cell sets were left out."] if n > bridge.MAX_SETS else []
    )


def test_cells_that_were_not_written_are_counted() -> None:
    points = np.concatenate([np.eye(4, 3), np.eye(4, 3) + 2.0])
    want = Mesh.from_arrays(points, {"tetra": [(0, 1, 2, 3), (4, 5, 6, 7), (3, 2, 1, 0)]})
    with pytest.raises(WriteError, match=r"cannot hold these cells: 2 tetra$"):
        bridge._losses(want, want[np.array([0])])


def test_arrays_behind_one_that_vtk_cannot_hold_are_kept() -> None:
    mesh = mesh_of("tetra")
    values = np.arange(mesh.n_cells)
    grid, lost = vtk.grid(mesh.replace(cell_data={"before": values, "wave": values * 1j, "behind": 2 * values}))
    assert lost == ("The cell data 'wave' (of type complex128) cannot be held by VTK's formats.",)
    assert set(vtk.mesh(grid).cell_data) == {"before", "behind"}
