"""Nothing that anybody does to arrays or grids outside changes a mesh, and nothing is copied without need."""

from __future__ import annotations

import array
import tracemalloc

import numpy as np
import pytest
from mesh_examples import CELLS, POINTS, all_types, parts

import meshgauge
from meshgauge import Mesh
from meshgauge.kernels.arrays import read_only
from meshgauge.mesh import cast

pyvista = pytest.importorskip("pyvista")
meshio = pytest.importorskip("meshio")


def thawed(mesh: Mesh) -> tuple[dict[str, object], dict[str, np.ndarray]]:
    """Arguments that make the mesh, of writeable arrays, and these arrays by name."""
    held = {name: np.array(values) for name, values in parts(mesh).items()}
    given: dict[str, object] = {name: held[name] for name in ("points", "types", "offsets", "connectivity")}
    given["polyhedra"] = meshgauge.Polyhedra(
        **{name.removeprefix("polyhedra."): values for name, values in held.items() if "polyhedra" in name}
    )
    for data in ("point_data", "cell_data", "field_data"):
        given[data] = {name.partition(".")[2]: values for name, values in held.items() if name.startswith(data)}
    return given, held


def spoil(held: dict[str, np.ndarray]) -> None:
    for values in held.values():
        values[...] = values.ravel()[::-1].reshape(values.shape)
        values.ravel()[:1] = values.ravel()[-1:]


@pytest.mark.parametrize("way", ["constructor", "replace"])
def test_writing_to_the_arrays_given_changes_nothing(way: str) -> None:
    before = all_types()
    given, held = thawed(before)
    mesh = Mesh(**given) if way == "constructor" else before.replace(**given)  # type: ignore[arg-type]
    spoil(held)
    for name, values in parts(mesh).items():
        np.testing.assert_array_equal(values, parts(before)[name], err_msg=name)


def test_a_cell_made_of_arrays_is_not_turned_over() -> None:
    points = POINTS.astype(np.float64)
    ids = np.array([(0, 1, 2, 3)])
    data = np.array([1.0])
    mesh = Mesh.from_arrays(points, [("tetra", ids)], cell_data={"d": data}, point_data={"x": points})
    points[3] *= -1
    ids[0] = (0, 2, 1, 3)
    data[0] = 2.0
    assert meshgauge.jens(mesh.points, mesh.connectivity.reshape(1, 4), "tetra")[0] > 0.7
    assert mesh.cell_data["d"][0] == 1.0
    assert mesh.point_data["x"][3, 2] == 1.0


@pytest.mark.parametrize("kind", ["buffer", "view", "read-only view", "fortran", "memoryview"])
def test_points_of_every_kind_are_copied(kind: str) -> None:
    base = np.array(POINTS, np.float64)
    given = {
        "buffer": np.frombuffer(array.array("d", base.ravel()), np.float64).reshape(-1, 3),
        "view": base[:],
        "read-only view": read_only(base),
        "fortran": np.asfortranarray(base),
        "memoryview": memoryview(base),
    }[kind]
    mesh = Mesh.from_arrays(given, CELLS)  # type: ignore[arg-type]
    held = np.asarray(given)
    if not held.flags.writeable:
        held = base
    held[...] = 7.0
    np.testing.assert_array_equal(mesh.points, POINTS)
    assert held.flags.writeable, "what the caller holds stays his"


def test_what_nobody_can_write_to_is_not_copied() -> None:
    points = np.array(POINTS, np.float64)
    points.flags.writeable = False
    mesh = Mesh.from_arrays(points, CELLS)
    assert np.shares_memory(mesh.points, points)
    other = mesh.replace(notes=("x",), cell_data={"new": np.zeros(2)})
    again = Mesh(mesh.points, mesh.types, mesh.offsets, mesh.connectivity, cell_data=other.cell_data)
    for name in ("points", "types", "offsets", "connectivity"):
        assert np.shares_memory(getattr(other, name), getattr(mesh, name)), name
        assert np.shares_memory(getattr(again, name), getattr(mesh, name)), name
    assert np.shares_memory(again.cell_data["new"], other.cell_data["new"])


def test_arrays_that_are_handed_over_become_read_only() -> None:
    given, held = thawed(all_types())
    mesh = Mesh(**given, copy=False)  # type: ignore[arg-type]
    for name, values in parts(mesh).items():
        assert np.shares_memory(values, held[name]), name
        with pytest.raises(ValueError, match="read-only"):
            held[name][...] = values


def test_nothing_of_a_mesh_can_be_set() -> None:
    mesh = all_types()
    with pytest.raises(AttributeError):
        mesh.points = POINTS  # type: ignore[misc]
    with pytest.raises(AttributeError):
        mesh.copy  # noqa: B018  # type: ignore[attr-defined]
    for name, values in parts(mesh).items():
        with pytest.raises(ValueError, match="read-only"):
            values[...] = values
        assert cast.is_frozen(values), name


def test_a_grid_of_pyvista_may_change_afterwards() -> None:
    grid = pyvista.ImageData(dimensions=(9, 9, 9)).cast_to_unstructured_grid()
    grid.cell_data["n"] = np.arange(512)
    grid.field_data["f"] = np.arange(3)
    mesh = meshgauge.from_pyvista(grid)
    values = meshgauge.measure(mesh).values.copy()
    grid.points[:] = np.nan
    grid.cell_connectivity[:] = 10**15
    pyvista.convert_array(grid.GetCells().GetOffsetsArray())[:] = 10**15
    grid.celltypes[:] = 42
    grid.cell_data["n"][:] = -1
    grid.field_data["f"][:] = -1
    np.testing.assert_array_equal(meshgauge.measure(mesh).values, values)
    assert mesh.cell_data["n"].tolist() == list(range(512))
    assert mesh.field_data["f"].tolist() == [0, 1, 2]


def test_polyhedra_and_blocks_of_pyvista_may_change_afterwards() -> None:
    grid = all_types().to_pyvista()
    both = pyvista.MultiBlock({"a": grid, "b": grid.copy()})
    both.field_data["f"] = np.arange(3)
    for given, leaves in ((grid, [grid]), (both, list(both))):
        mesh = meshgauge.from_pyvista(given)
        before = {name: values.copy() for name, values in parts(mesh).items()}
        for leaf in leaves:
            leaf.points[:] = 0.0
            leaf.cell_connectivity[:] = 0
            faces = leaf.GetPolyhedronFaces()
            pyvista.convert_array(faces.GetConnectivityArray())[:] = 0
            leaf.cell_data["v"][:] = 0.0
        both.field_data["f"][:] = 0
        for name, values in parts(mesh).items():
            np.testing.assert_array_equal(values, before[name], err_msg=name)


def test_a_mesh_of_meshio_may_change_afterwards() -> None:
    ids, points = np.array([(0, 1, 2, 3)]), np.array(POINTS, np.float64)
    source = meshio.Mesh(points, [("tetra", ids)], point_data={"p": points}, cell_data={"c": [ids[:, 0]]})
    mesh = meshgauge.from_meshio(source)
    ids[:], points[:] = 0, 0.0
    assert mesh.connectivity.tolist() == [0, 1, 2, 3]
    np.testing.assert_array_equal(mesh.points, POINTS)
    np.testing.assert_array_equal(mesh.point_data["p"], POINTS)
    assert source.points.flags.writeable


def test_what_is_made_of_a_mesh_may_change() -> None:
    mesh = all_types()
    before = {name: values.copy() for name, values in parts(mesh).items()}
    grid = mesh.to_pyvista()
    grid.points[:] = 5.0
    grid.cell_connectivity[:] = 0
    grid.cell_data["v"][:] = 5.0
    pyvista.convert_array(grid.GetPolyhedronFaces().GetConnectivityArray())[:] = 0
    plain = mesh[mesh.types != 42]
    other = plain.to_meshio()
    other.points[:] = 5.0
    other.point_data["t"][:] = 5.0
    other.cells[0].data[:] = 0
    other.cell_data["v"][0][:] = 5.0
    other.field_data["x"][:] = 5
    for name, values in parts(mesh).items():
        np.testing.assert_array_equal(values, before[name], err_msg=name)
    assert plain.points.max() < 1.0
    assert plain.point_data["t"].max() < 1.0


def test_reading_and_replacing_large_meshes_copies_nothing(tmp_path) -> None:  # type: ignore[no-untyped-def]
    grid = pyvista.ImageData(dimensions=(41, 41, 41)).cast_to_unstructured_grid()
    grid.save(tmp_path / "large.vtu", binary=True)
    mesh = meshgauge.read(tmp_path / "large.vtu")
    size = sum(values.nbytes for values in parts(mesh).values())
    tracemalloc.start()
    mesh.replace(path="elsewhere", cell_data={"n": mesh.types}, notes=("moved",))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 0.15 * size
    tracemalloc.start()
    mesh = meshgauge.read(tmp_path / "large.vtu")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1.5 * (sum(values.nbytes for values in parts(mesh).values()) + 1e6)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32])
def test_masked_coordinates_and_data_are_nan(dtype: type) -> None:
    points = np.ma.masked_array(POINTS.astype(dtype), mask=np.arange(15).reshape(5, 3) == 4)
    number = np.ma.masked_array([1, 2], mask=[False, True])
    mesh = Mesh.from_arrays(points, CELLS, cell_data={"n": number})
    assert mesh.points.dtype == (np.float32 if dtype is np.float32 else np.float64)
    assert np.argwhere(np.isnan(mesh.points)).tolist() == [[1, 1]]
    np.testing.assert_array_equal(mesh.cell_data["n"], [1.0, np.nan])
    assert np.isnan(meshgauge.jens(points, CELLS[0][1], "tetra")).all()
    assert meshgauge.measure(mesh).status.tolist() == [meshgauge.Status.NON_FINITE] * 2


def test_masked_arrays_without_a_mask_are_arrays() -> None:
    mesh = Mesh.from_arrays(np.ma.masked_array(POINTS), {"tetra": np.ma.masked_array(CELLS[0][1])})
    assert type(mesh.points) is np.ndarray
    assert type(mesh.connectivity) is np.ndarray


def test_masked_ids_and_text_are_refused() -> None:
    ids = np.ma.masked_array(CELLS[0][1], mask=[[False] * 4, [False, False, True, False]])
    for call in (
        lambda: Mesh.from_arrays(POINTS, [("tetra", ids)]),
        lambda: meshgauge.jens(POINTS, ids, "tetra"),
        lambda: meshgauge.aspect_ratio_gamma(POINTS, ids),
    ):
        with pytest.raises(meshgauge.MeshError, match=r"id at \(1, 2\) is masked"):
            call()
    names = np.ma.masked_array(["a", "b"], mask=[True, False])
    with pytest.raises(meshgauge.MeshError, match="masked"):
        Mesh.from_arrays(POINTS, CELLS, cell_data={"name": names})


@pytest.mark.parametrize(
    ("points", "cells"),
    [
        (POINTS, [(0, 1, 2, 3), (1, 2, 3)]),
        ([(0, 0, 0), (1, 0)], [(0, 1, 2, 3)]),
        (POINTS, [(0, 1, 2, "x")]),
        (POINTS, [(0, 1, 2, 2**70)]),
        (POINTS, [(0.0, 1.0, 2.0, 3.0)]),
        (POINTS, [None]),
        (None, [(0, 1, 2, 3)]),
        (POINTS, {0: 1}),
        ("points", [(0, 1, 2, 3)]),
        (POINTS + 1j, [(0, 1, 2, 3)]),
    ],
)
def test_what_makes_no_arrays_is_our_error(points: object, cells: object) -> None:
    for call in (
        lambda: Mesh.from_arrays(points, [("tetra", cells)]),  # type: ignore[arg-type, list-item]
        lambda: meshgauge.jens(points, cells, "tetra"),  # type: ignore[arg-type]
        lambda: meshgauge.scaled_jacobian(points, cells, "tetra", nodes=True),  # type: ignore[arg-type]
    ):
        with pytest.raises(meshgauge.MeshError):
            call()


def test_ragged_data_are_our_error() -> None:
    with pytest.raises(meshgauge.MeshError, match="do not make an array"):
        Mesh.from_arrays(POINTS, CELLS, cell_data={"d": [[1], [1, 2]]})
