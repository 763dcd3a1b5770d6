"""One mesh in every encoding that others write."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import optional
import pytest
from io_meshes import assert_same_cells, assert_same_data
from vtkmodules.vtkCommonCore import vtkVersion

import meshgauge
from meshgauge import io
from meshgauge.cells import SHAPES
from meshgauge.errors import ReadError
from meshgauge.io.plumbing import isolate, vtk
from meshgauge.mesh import Mesh
from meshgauge.mesh.regions import regions

pytestmark = pytest.mark.usefixtures("readers_here")


def save_vtu(path: Path, mesh: Mesh, mode: str, compressor: str, header: int, order: str = "Little") -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    grid, _ = vtk.grid(mesh)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    getattr(writer, f"SetDataModeTo{mode.removesuffix('Raw')}")()
    writer.SetEncodeAppendedData(not mode.endswith("Raw"))
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    getattr(writer, f"SetHeaderTypeToUInt{header}")()
    getattr(writer, f"SetByteOrderTo{order}Endian")()
    assert writer.Write()


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended", "AppendedRaw"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("header", [32, 64])
def test_vtu(tmp_path: Path, loaded: Mesh, polyhedral: Mesh, mode: str, compressor: str, header: int) -> None:
    for mesh in (loaded, loaded.replace(field_data={}), polyhedral):
        save_vtu(tmp_path / "a.vtu", mesh, mode, compressor, header)
        back = io.read(tmp_path / "a.vtu")
        assert_same_cells(mesh, back)
        assert_same_data(mesh, back)


@pytest.mark.parametrize("compressor", ["None", "ZLib"])
@pytest.mark.parametrize("order", ["Little", "Big"])
def test_the_common_vtu_needs_no_other_process(
    tmp_path: Path, loaded: Mesh, compressor: str, order: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(isolate, "read", None)
    texts = {"names": np.array(["fluid", "", "solid é"]), "pairs": np.array([["a", "b"], ["c", "d"]])}
    large = loaded.replace(field_data={"many": np.arange(100_000), **texts})  # several blocks
    save_vtu(tmp_path / "a.vtu", large, "AppendedRaw", compressor, 32, order)
    back = io.read(tmp_path / "a.vtu")
    assert_same_cells(large, back)
    assert_same_data(large, back)
    data = (tmp_path / "a.vtu").read_bytes()
    at = data.index(b"_", data.index(b"<AppendedData"))
    (tmp_path / "a.vtu").write_bytes(data[: at + 200])
    with pytest.raises(ReadError, match=r"is not whole|needs \d+ bytes|cannot be unpacked|states"):
        io.read(tmp_path / "a.vtu")


@pytest.mark.parametrize("mode", ["Binary", "AppendedRaw"])
def test_big_endian_vtu(tmp_path: Path, loaded: Mesh, mode: str) -> None:
    mesh = loaded.replace(field_data={"time": np.array([0.5])})
    save_vtu(tmp_path / "a.vtu", mesh, mode, "None", 64, "Big")
    back = io.read(tmp_path / "a.vtu")
    assert_same_cells(mesh, back)
    assert_same_data(mesh, back)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("is_alone", [False, True])
def test_legacy_vtk(
    tmp_path: Path,
    loaded: Mesh,
    polyhedral: Mesh,
    binary: bool,
    version: int,
    is_alone: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What others wrote; alone, without strings and polyhedra, it is read without another process."""
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

    if is_alone:
        monkeypatch.setattr(isolate, "read", None)
    for mesh in (loaded.replace(field_data={"a name": np.arange(5.0)}),) if is_alone else (loaded, polyhedral):
        grid, _ = vtk.grid(mesh)
        writer = vtkUnstructuredGridWriter()
        writer.SetFileName(str(tmp_path / "a.vtk"))
        writer.SetInputData(grid)
        writer.SetFileType(2 if binary else 1)
        writer.SetFileVersion(version)
        assert writer.Write()
        back = io.read(tmp_path / "a.vtk")
        np.testing.assert_allclose(back.points, mesh.points, rtol=1e-5)
        np.testing.assert_array_equal(back.connectivity, mesh.connectivity)
        assert back.type_counts() == mesh.type_counts()
        assert set(back.point_data) == set(mesh.point_data)
        assert set(back.cell_data) == set(mesh.cell_data)


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize(
    ("name", "n"), [("tetra", 4), ("tetra10", 10), ("hexahedron27", 27), ("pyramid13", 13), ("wedge15", 15)]
)
def test_gmsh(tmp_path: Path, version: str, binary: bool, name: str, n: int) -> None:
    from meshgauge.io.plumbing import meshio

    rng = np.random.default_rng(1)
    mesh = Mesh.from_arrays(rng.random((40, 3)), [(name, [rng.permutation(40)[:n] for _ in range(3)])])
    source = meshio.from_mesh(mesh)
    gmsh = pytest.importorskip("meshio").gmsh
    with meshio.captured_output():
        gmsh.write(tmp_path / "a.msh", source, fmt_version=version, binary=binary)
    back = io.read(tmp_path / "a.msh", wedge_order="gmsh")
    np.testing.assert_allclose(back.points, mesh.points, rtol=1e-15)
    np.testing.assert_array_equal(back.connectivity, mesh.connectivity)
    np.testing.assert_array_equal(back.types, mesh.types)


def vtkhdf_by_vtk(path: Path, data: Any) -> None:
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    writer = vtkHDFWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    assert writer.Write()


@pytest.fixture(params=["loaded", "polyhedral"])
def of_vtk(request: pytest.FixtureRequest) -> Mesh:
    """A mesh that VTK's own writer of VTKHDF can write."""
    version = vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()
    if request.param == "polyhedral" and version < (9, 7):
        pytest.skip("VTK before 9.7 writes polyhedra without their faces into VTKHDF")
    mesh: Mesh = request.getfixturevalue(request.param)
    return mesh


def test_vtkhdf_by_vtk(tmp_path: Path, of_vtk: Mesh) -> None:
    vtkhdf_by_vtk(tmp_path / "a.vtkhdf", vtk.grid(of_vtk)[0])
    back = io.read(tmp_path / "a.vtkhdf")
    assert_same_cells(of_vtk, back)
    assert_same_data(of_vtk, back)


def test_partitions_of_vtkhdf_become_blocks(tmp_path: Path, of_vtk: Mesh) -> None:
    from vtkmodules.vtkCommonDataModel import vtkPartitionedDataSet

    parts = vtkPartitionedDataSet()
    parts.SetPartition(0, vtk.grid(of_vtk)[0])
    parts.SetPartition(1, vtk.grid(of_vtk)[0])
    vtkhdf_by_vtk(tmp_path / "a.vtkhdf", parts)
    back = io.read(tmp_path / "a.vtkhdf")
    n = of_vtk.n_cells
    assert [(b.start, b.stop) for b in back.blocks] == [(0, n), (n, 2 * n)]
    assert_twice(of_vtk, back)


def test_composite_data_sets_become_blocks(tmp_path: Path, of_vtk: Mesh) -> None:
    from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkMultiBlockDataSet
    from vtkmodules.vtkIOXML import vtkXMLMultiBlockDataWriter

    blocks = vtkMultiBlockDataSet()
    for index, name in enumerate(("fluid", "solid")):
        blocks.SetBlock(index, vtk.grid(of_vtk)[0])
        blocks.GetMetaData(index).Set(vtkCompositeDataSet.NAME(), name)
    vtkhdf_by_vtk(tmp_path / "a.vtkhdf", blocks)
    writer = vtkXMLMultiBlockDataWriter()
    writer.SetFileName(str(tmp_path / "a.vtm"))
    writer.SetInputData(blocks)
    assert writer.Write()
    for back in (io.read(tmp_path / "a.vtkhdf"), io.read(tmp_path / "a.vtm"), io.from_pyvista(blocks)):
        assert [b.name for b in back.blocks] == ["fluid", "solid"]
        assert_twice(of_vtk, back)


def assert_twice(mesh: Mesh, back: Mesh) -> None:
    """``back`` is ``mesh`` two times."""
    n, p = len(mesh.connectivity), mesh.n_points
    np.testing.assert_array_equal(back.types, np.tile(mesh.types, 2))
    np.testing.assert_array_equal(back.points, np.tile(mesh.points, (2, 1)))
    np.testing.assert_array_equal(back.connectivity[:n], mesh.connectivity)
    np.testing.assert_array_equal(back.connectivity[n:], mesh.connectivity + p)
    for name, values in mesh.cell_data.items():
        np.testing.assert_array_equal(back.cell_data[name], np.concatenate([values, values]))
    if mesh.polyhedra is not None:
        assert back.polyhedra is not None
        np.testing.assert_array_equal(
            back.polyhedra.face_points, np.r_[mesh.polyhedra.face_points, mesh.polyhedra.face_points + p]
        )
        assert back.polyhedra.cell_offsets.tolist() == [0, 0, 6, 6, 12]
        assert back.polyhedra.cell_faces.tolist() == list(range(12))


def test_first_of_several_time_steps(tmp_path: Path, solid: Mesh) -> None:
    import h5py

    path = tmp_path / "a.vtkhdf"
    n, p = solid.n_cells, solid.n_points
    io.write(path, solid)
    with h5py.File(path, "a") as file:
        root = file["VTKHDF"]
        root["CellData"]["t"] = np.arange(2 * n)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 2
        steps["Values"] = [0.0, 1.0]
        for name in ("PartOffsets", "PointOffsets"):
            steps[name] = [0, 0]
        steps["NumberOfParts"] = [1, 1]
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            steps[name] = [[0], [0]]
        steps.create_group("CellDataOffsets")["t"] = [n, 0]
    back = io.read(path)
    assert_same_cells(solid, back)
    assert back.n_points == p
    np.testing.assert_array_equal(back.cell_data["t"], np.arange(n, 2 * n))
    assert "2 time steps" in back.notes[0]


def test_gzipped_file(tmp_path: Path, solid: Mesh) -> None:
    import gzip

    io.write(tmp_path / "a.vtk", solid)
    packed = tmp_path / "b.vtk.gz"
    packed.write_bytes(gzip.compress((tmp_path / "a.vtk").read_bytes()))
    back = io.read(packed)
    assert_same_cells(solid, back)
    assert back.path == str(packed)


@pytest.mark.parametrize(("extension", "name"), [(".vti", "voxel"), (".vtr", "voxel"), (".vts", "hexahedron")])
def test_grids_become_cells(tmp_path: Path, extension: str, name: str) -> None:
    pv = pytest.importorskip("pyvista")
    image = pv.ImageData(dimensions=(3, 4, 5))
    image.cell_data["k"] = np.arange(image.n_cells)
    cast = {".vti": lambda: image, ".vtr": image.cast_to_rectilinear_grid, ".vts": image.cast_to_structured_grid}
    cast[extension]().save(tmp_path / f"a{extension}")
    mesh = io.read(tmp_path / f"a{extension}")
    assert mesh.type_counts() == {name: 24}
    np.testing.assert_array_equal(mesh.cell_data["k"], np.arange(24))


def test_surfaces_are_read_as_surfaces(tmp_path: Path) -> None:
    pv = pytest.importorskip("pyvista")
    pv.Sphere(theta_resolution=6, phi_resolution=6).save(tmp_path / "a.vtp")
    assert set(io.read(tmp_path / "a.vtp").type_counts()) == {"triangle"}


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("serendipity", [False, True])
def test_second_order_nodes_of_gmsh_are_at_the_middle_of_their_edges(
    tmp_path: Path, version: float, binary: bool, serendipity: bool
) -> None:
    gmsh = optional.gmsh()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", serendipity)
        square = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        gmsh.model.occ.extrude([(2, square)], 0, 0, 1, numElements=[2], recombine=True)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(tmp_path / "a.msh"))
    finally:
        gmsh.finalize()
    mesh = io.read(tmp_path / "a.msh")
    name, edges = ("wedge15" if serendipity else "wedge18"), [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3)]
    edges += [(0, 3), (1, 4), (2, 5)]
    assert mesh.type_counts()[name] > 4
    assert not [note for note in mesh.notes if "turned" in note]
    wedges = np.flatnonzero(mesh.types == (26 if serendipity else 32))
    for cell in wedges:
        at = mesh.points[mesh.nodes(int(cell))]
        np.testing.assert_allclose(at[6:15], [(at[a] + at[b]) / 2 for a, b in edges], atol=1e-12)
        if not serendipity:
            faces = [(0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
            np.testing.assert_allclose(at[15:18], [at[list(f)].mean(axis=0) for f in faces], atol=1e-12)


def grid(name: str, x: float, more: str = "") -> str:
    return (
        f'<Grid Name="{name}">{more}<Topology TopologyType="Tetrahedron" NumberOfElements="1">'
        '<DataItem Dimensions="1 4" Format="XML" NumberType="Int">0 1 2 3</DataItem></Topology>'
        f'<Geometry GeometryType="XYZ"><DataItem Dimensions="4 3" Format="XML">{x} 0 0 {x + 1} 0 0 {x} 1 0 {x} 0 1'
        "</DataItem></Geometry></Grid>"
    )


def test_collections_of_xdmf(tmp_path: Path) -> None:
    def written(kind: str, *grids: str) -> Mesh:
        path = tmp_path / f"{kind}.xdmf"
        path.write_text(
            f'<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid Name="all" GridType="Collection" '
            f'CollectionType="{kind}">{"".join(grids)}</Grid></Domain></Xdmf>'
        )
        return io.read(path)

    mesh = written("Spatial", grid("fluid", 0), grid("solid", 5))
    assert [block.name for block in mesh.blocks] == ["fluid", "solid"]
    assert mesh.type_counts() == {"tetra": 2}
    assert mesh.points[:, 0].max() == 6
    mesh = written("Temporal", grid("a", 0, '<Time Value="0"/>'), grid("a", 5, '<Time Value="1"/>'))
    assert mesh.points[:, 0].max() == 1
    assert mesh.notes == ("The file holds 2 time steps; the first (time 0) was read.",)


def test_ensight_polyhedra_and_names_of_parts(tmp_path: Path) -> None:
    def part(number: int, name: str, points: np.ndarray, *lines: str) -> str:
        columns = "".join(f"{v:12.5e}\n" for axis in range(3) for v in points[:, axis])
        return f"part\n{number:10d}\n{name}\ncoordinates\n{len(points):10d}\n{columns}" + "".join(
            f"{x}\n" for x in lines
        )

    def ids(*rows: tuple[int, ...]) -> list[str]:
        return ["".join(f"{k + 1:10d}" for k in row) for row in rows]

    prism = SHAPES["penta_prism"]
    sizes = [f"{len(face):10d}" for face in prism.faces]
    path = tmp_path / "a.case"
    path.write_text("FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\n")
    (tmp_path / "a.geo").write_text(
        "one\ntwo\nnode id off\nelement id off\n"
        + part(1, "rotor", np.array(prism.points), "nfaced", f"{1:10d}", f"{7:10d}", *sizes, *ids(*prism.faces))
        + part(2, "stator", np.array(SHAPES["hexahedron"].points) + 5, "hexa8", f"{1:10d}", *ids(tuple(range(8))))
        + part(3, "wall", np.array(prism.points[:5]), "nsided", f"{1:10d}", f"{5:10d}", *ids(tuple(range(5))))
    )
    mesh = io.read(path)
    assert mesh.type_counts() == {"polygon": 1, "hexahedron": 1, "polyhedron": 1}
    assert [block.name for block in mesh.blocks] == ["rotor", "stator", "wall"]
    assert meshgauge.measure(mesh).values[:2] == pytest.approx(np.ones(2), abs=1e-4)


def test_pieces_in_a_folder_below_keep_their_data(tmp_path: Path, solid: Mesh) -> None:
    (tmp_path / "pieces").mkdir()
    tagged = solid.replace(cell_data={"material": np.arange(8) // 4})
    for number in (0, 1):
        io.write(tmp_path / "pieces" / f"{number}.vtu", tagged)
    (tmp_path / "a.pvtu").write_text(
        '<VTKFile type="PUnstructuredGrid" version="1.0"><PUnstructuredGrid><PPoints><PDataArray type="Float64" '
        'NumberOfComponents="3"/></PPoints><PCellData><PDataArray type="Int64" Name="material"/></PCellData>'
        '<Piece Source="pieces/0.vtu"/><Piece Source="pieces/1.vtu"/></PUnstructuredGrid></VTKFile>'
    )
    mesh = io.read(tmp_path / "a.pvtu")
    ids, names = regions(mesh)
    assert names == ("material 0", "material 1")
    assert np.bincount(ids).tolist() == [8, 8]
