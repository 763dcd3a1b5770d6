"""The numbers that files give to elements and nodes: read from every format that has them, and written back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import optional
import pytest

import meshgauge
from meshgauge import io
from meshgauge.mesh.labels import cell_label, find_cell, point_label

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], float)
CELLS = np.array([(0, 1, 2, 3), (1, 2, 3, 4)])
NODES, ELEMENTS = [100, 7, 300, 44, 5], [7000, 31]


def labelled() -> meshgauge.Mesh:
    return meshgauge.Mesh.from_arrays(
        POINTS, {"tetra": CELLS}, point_data={"label": np.array(NODES)}, cell_data={"label": np.array(ELEMENTS)}
    )


def assert_labelled(mesh: meshgauge.Mesh) -> None:
    for data, labels in ((mesh.point_data, NODES), (mesh.cell_data, ELEMENTS)):
        assert data["label"].dtype == np.int64
        assert data["label"].tolist() == labels
    np.testing.assert_array_equal(mesh.connectivity.reshape(-1, 4), CELLS)
    np.testing.assert_array_equal(mesh.points, POINTS)


def rows(table: np.ndarray) -> str:
    return "\n".join(" ".join(map(str, row)) for row in table.tolist())


def unv(path: Path, nodes: list[int], elements: list[int]) -> None:
    points = "".join(f"{n} 1 1 11\n{x} {y} {z}\n" for n, (x, y, z) in zip(nodes, POINTS.tolist(), strict=True))
    cells = "".join(
        f"{e} 111 1 1 7 4\n{' '.join(str(nodes[p]) for p in own)}\n" for e, own in zip(elements, CELLS, strict=True)
    )
    path.write_text(f"    -1\n  2411\n{points}    -1\n    -1\n  2412\n{cells}    -1\n")


def msh2(path: Path, nodes: list[int], elements: list[int]) -> None:
    points = rows(np.column_stack([np.array(nodes, object), POINTS]))
    cells = "\n".join(
        f"{e} 4 2 1 1 {' '.join(str(nodes[p]) for p in own)}" for e, own in zip(elements, CELLS, strict=True)
    )
    path.write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n{points}\n$EndNodes\n$Elements\n2\n{cells}\n$EndElements\n"
    )


def msh4(path: Path, nodes: list[int], elements: list[int]) -> None:
    tags, points = "\n".join(map(str, nodes)), rows(POINTS)
    cells = "\n".join(f"{e} {' '.join(str(nodes[p]) for p in own)}" for e, own in zip(elements, CELLS, strict=True))
    path.write_text(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
        f"$Nodes\n1 5 {min(nodes)} {max(nodes)}\n3 1 0 5\n{tags}\n{points}\n$EndNodes\n"
        f"$Elements\n1 2 {min(elements)} {max(elements)}\n3 1 4 2\n{cells}\n$EndElements\n"
    )


def exodus(path: Path, nodes: list[int], elements: list[int]) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for axis, column in zip("xyz", POINTS.T, strict=True):
            file[f"coord{axis}"] = column
        file["connect1"] = (CELLS[:1] + 1).astype(np.int32)
        file["connect2"] = (CELLS[1:] + 1).astype(np.int32)
        for name in ("connect1", "connect2"):
            file[name].attrs["elem_type"] = b"TETRA"
        file["eb_prop1"] = [7, 9]
        file["node_num_map"], file["elem_num_map"] = np.array(nodes, np.int32), np.array(elements, np.int32)


def tetgen(path: Path, nodes: list[int], elements: list[int]) -> None:
    points = rows(np.column_stack([np.array(nodes, object), POINTS]))
    path.with_suffix(".node").write_text(f"5 3 0 0\n{points}\n")
    cells = rows(np.column_stack([elements, np.array(nodes)[CELLS]]))
    path.write_text(f"2 4 0\n{cells}\n")


def med(path: Path, nodes: list[int], elements: list[int]) -> None:
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("meshio")
    io.write(path, meshgauge.Mesh.from_arrays(POINTS, {"tetra": CELLS}))
    with h5py.File(path, "r+") as file:
        step = next(iter(next(iter(file["ENS_MAA"].values())).values()))
        step["NOE"].create_dataset("NUM", data=np.array(nodes, np.int32))
        step["MAI"]["TE4"].create_dataset("NUM", data=np.array(elements, np.int32))


def vtk_legacy(path: Path, nodes: list[int], elements: list[int]) -> None:
    cells = rows(np.column_stack([np.full(2, 4), CELLS]))
    path.write_text(
        f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n{rows(POINTS)}\n"
        f"CELLS 2 10\n{cells}\nCELL_TYPES 2\n10\n10\n"
        f"CELL_DATA 2\nGLOBAL_IDS numbers int\n{' '.join(map(str, elements))}\n"
        f"POINT_DATA 5\nGLOBAL_IDS numbers int\n{' '.join(map(str, nodes))}\n"
    )


FILES = {
    "a.unv": unv,
    "a.msh": msh2,
    "b.msh": msh4,
    "a.exo": exodus,
    "a.gen": exodus,
    "a.ele": tetgen,
    "a.med": med,
    "a.vtk": vtk_legacy,
}


@pytest.mark.parametrize("name", FILES)
def test_numbers_of_the_file_are_labels(tmp_path: Path, name: str) -> None:
    FILES[name](tmp_path / name, NODES, ELEMENTS)
    assert_labelled(io.read(tmp_path / name))


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("first", [0, 1])
def test_numbers_that_only_count_are_not_kept(tmp_path: Path, name: str, first: int) -> None:
    if first == 0 and name.endswith((".unv", ".msh")):
        pytest.skip("the format counts from 1")
    FILES[name](tmp_path / name, list(range(first, first + 5)), [first, first + 1])
    mesh = io.read(tmp_path / name)
    assert "label" not in mesh.cell_data
    assert "label" not in mesh.point_data
    assert mesh.counted == (("cells", "points") if first == 1 else ())
    assert (cell_label(mesh, 1), point_label(mesh, 4)) == ((2, 5) if first == 1 else (None, None))
    assert find_cell(mesh, "1") == (0 if first == 1 else 1)


def test_numbers_that_count_become_labels_where_positions_change(tmp_path: Path) -> None:
    msh2(tmp_path / "a.msh", [1, 2, 3, 4, 5], [1, 2])
    mesh = io.read(tmp_path / "a.msh")
    second = mesh[[1]]
    assert (second.cell_data["label"].tolist(), second.point_data["label"].tolist()) == ([2], [2, 3, 4, 5])
    assert second.counted == ()
    moved = mesh.replace(points=mesh.points + 1)
    assert moved.counted == ("cells", "points")
    assert mesh.replace(points=mesh.points[[0, 1, 2, 3, 4, 4]], point_data={}).counted == ("cells",)


def test_exodus_without_maps_counts_from_one(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    exodus(tmp_path / "a.exo", NODES, ELEMENTS)
    with h5py.File(tmp_path / "a.exo", "r+") as file:
        del file["node_num_map"], file["elem_num_map"]
    assert io.read(tmp_path / "a.exo").counted == ("cells", "points")


@pytest.mark.parametrize("names", [("GlobalElementId", "GlobalNodeId"), ("GlobalCellIds", "GlobalPointIds")])
@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf", ".pvtu"])
def test_global_ids_of_vtk_are_labels(tmp_path: Path, names: tuple[str, str], extension: str) -> None:
    own = labelled()
    mesh = own.replace(
        cell_data={names[0]: own.cell_data["label"].astype(np.int32)}, point_data={names[1]: own.point_data["label"]}
    )
    file = tmp_path / f"a{'.vtu' if extension == '.pvtu' else extension}"
    io.write(file, mesh)
    if extension == ".pvtu":
        (tmp_path / "a.pvtu").write_text(
            '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid>'
            f'<PPointData><PDataArray type="Int64" Name="{names[1]}"/></PPointData>'
            f'<PCellData><PDataArray type="Int32" Name="{names[0]}"/></PCellData>'
            '<PPoints><PDataArray type="Float64" NumberOfComponents="3"/></PPoints>'
            '<Piece Source="a.vtu"/></PUnstructuredGrid></VTKFile>'
        )
    read = io.read(tmp_path / f"a{extension}")
    assert_labelled(read)
    assert names[0] in read.cell_data
    assert read.cell_data[names[0]].dtype == np.int32


@pytest.mark.parametrize("extension", [".inp", ".msh", ".vtu", ".vtk", ".vtkhdf"])
def test_labels_are_written_back(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a{extension}"
    assert io.write(path, labelled()) == ()
    assert_labelled(io.read(path))


@pytest.mark.parametrize("extension", [".inp", ".msh"])
def test_labels_that_a_format_cannot_hold_are_counted_anew(tmp_path: Path, extension: str) -> None:
    """Numbers that stand there twice, or that are no numbers: each item has one of its own in the file."""
    path = tmp_path / f"a{extension}"
    io.write(path, labelled().replace(cell_data={"label": np.array([5, 5])}, point_data={"label": np.arange(-1, 4)}))
    mesh = io.read(path)
    assert meshgauge.measure(mesh).status.tolist() == [0, 0]
    assert mesh.cell_data.get("label", np.array([1, 2])).tolist() in ([1, 2], [5.0, 5.0])


def test_numbers_in_med(tmp_path: Path) -> None:
    """Cells are kept by type: their numbers go with them, and are no field."""
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("meshio")
    mesh = meshgauge.Mesh.from_arrays(
        POINTS,
        [("tetra", CELLS[:1]), ("pyramid", [(0, 1, 4, 2, 3)]), ("tetra", CELLS[1:])],
        point_data={"label": np.array(NODES)},
        cell_data={"label": np.array([7000, 8, 31])},
    )
    path = tmp_path / "a.med"
    assert io.write(path, mesh) == ("The format keeps cells by type: their order changed.",)
    back = io.read(path)
    assert dict(zip(back.cell_data["label"].tolist(), np.diff(back.offsets).tolist(), strict=True)) == {
        7000: 4, 31: 4, 8: 5,
    }  # fmt: skip
    assert back.point_data["label"].tolist() == NODES
    with h5py.File(path) as file:
        step = next(iter(file["ENS_MAA/mesh"].values()))
        assert step["NOE/NUM"][...].tolist() == NODES
        assert step["MAI/TE4/NUM"][...].tolist() == [7000, 31]
        assert list(file.get("CHA", ())) == []
    io.write(path, mesh.replace(cell_data={"label": np.array([5, 5, 0])}))
    assert sorted(io.read(path).cell_data["label"].tolist()) == [0, 5, 5]


def test_others_read_the_numbers(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    io.write(tmp_path / "a.msh", labelled())
    other = meshio.read(tmp_path / "a.msh")
    np.testing.assert_array_equal(other.points[other.cells[0].data], POINTS[CELLS])
    pyvista = pytest.importorskip("pyvista")
    for extension in (".vtu", ".vtk"):
        io.write(tmp_path / f"a{extension}", labelled())
        grid = pyvista.read(tmp_path / f"a{extension}")
        assert grid.GetCellData().GetGlobalIds().GetName() == "label"
        assert grid.point_data["label"].tolist() == NODES


def test_gmsh_reads_the_numbers(tmp_path: Path) -> None:
    gmsh = optional.gmsh()
    io.write(tmp_path / "a.msh", labelled())
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        _, tags, nodes = gmsh.model.mesh.getElements(3)
        found = dict(zip(tags[0].tolist(), nodes[0].reshape(-1, 4).tolist(), strict=True))
        assert found == dict(zip(ELEMENTS, np.array(NODES)[CELLS].tolist(), strict=True))
    finally:
        gmsh.finalize()


def test_pieces_keep_the_numbers_of_the_whole(tmp_path: Path) -> None:
    """The first of two parts counts from 0, as positions do; the second goes on."""
    h5py = pytest.importorskip("h5py")
    mesh = labelled().replace(point_data={}, cell_data={"GlobalElementId": np.array([0, 1])})
    io.write(tmp_path / "a.vtkhdf", mesh)
    assert "label" not in io.read(tmp_path / "a.vtkhdf").cell_data
    with h5py.File(tmp_path / "a.vtkhdf", "r+") as file:
        file["VTKHDF/CellData/GlobalElementId"][...] = [4, 5]
    assert io.read(tmp_path / "a.vtkhdf").cell_data["label"].tolist() == [4, 5]


def test_exodus_is_known_by_content_only_if_it_is_one(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["temperature"] = [1.0]
    with pytest.raises(meshgauge.ReadError, match="no known format"):
        io.read(tmp_path / "a.nc")
    exodus(tmp_path / "a.e-s001", NODES, ELEMENTS)
    assert_labelled(io.read(tmp_path / "a.e-s001"))
