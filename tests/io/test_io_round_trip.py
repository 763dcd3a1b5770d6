"""What is written is what is read back, by us and by others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, assert_same_cells, assert_same_data, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError, WriteError
from meshgauge.mesh import CellBlock, Mesh
from meshgauge.mesh.regions import regions

pytestmark = pytest.mark.usefixtures("readers_here")

EXACT = (".vtu", ".vtk", ".vtkhdf")


@pytest.mark.parametrize("extension", EXACT)
def test_vtk_formats_keep_everything(tmp_path: Path, loaded: Mesh, extension: str) -> None:
    path = tmp_path / f"mesh{extension}"
    assert io.write(path, loaded) == ()
    back = io.read(path)
    assert_same_cells(loaded, back)
    assert_same_data(loaded, back)
    assert back.path == str(path)
    assert back.notes == ()


@pytest.mark.parametrize("extension", EXACT)
def test_vtk_formats_keep_polyhedra(tmp_path: Path, polyhedral: Mesh, extension: str) -> None:
    path = tmp_path / f"mesh{extension}"
    assert io.write(path, polyhedral) == ()
    assert_same_cells(polyhedral, io.read(path))


@pytest.mark.parametrize("extension", EXACT)
@pytest.mark.parametrize("points", [np.float32, np.float64])
@pytest.mark.parametrize("ids", [np.int32, np.int64])
def test_dtypes_are_kept(tmp_path: Path, solid: Mesh, extension: str, points: type, ids: type) -> None:
    mesh = solid.replace(points=solid.points.astype(points), connectivity=solid.connectivity.astype(ids))
    path = tmp_path / f"mesh{extension}"
    io.write(path, mesh)
    back = io.read(path)
    assert back.points.dtype == points
    assert_same_cells(mesh, back)


@pytest.mark.parametrize("extension", EXACT)
def test_pyvista_reads_what_we_write(tmp_path: Path, loaded: Mesh, extension: str) -> None:
    pv = pytest.importorskip("pyvista")
    path = tmp_path / f"mesh{extension}"
    io.write(path, loaded)
    grid = pv.read(path)
    np.testing.assert_array_equal(grid.points, loaded.points)
    np.testing.assert_array_equal(grid.celltypes, loaded.types)
    np.testing.assert_array_equal(grid.cell_connectivity, loaded.connectivity)
    np.testing.assert_array_equal(grid.cell_data["stress"], loaded.cell_data["stress"])


WRITTEN = {
    "vtu": (".vtu",),
    "vtk": (".vtk",),
    "vtkhdf": (".vtkhdf", ".hdf"),
    "gmsh": (".msh",),
    "medit": (".mesh", ".meshb"),
    "med": (".med",),
    "su2": (".su2",),
    "abaqus": (".inp",),
    "avs": (".avs", ".ucd"),
    "xdmf": (".xdmf",),
    "ugrid": (".ugrid", ".b8.ugrid", ".lb8.ugrid", ".lb4.ugrid", ".r8.ugrid", ".lr8.ugrid", ".b8l.ugrid"),
    "netgen": (".vol",),
    "tecplot": (".dat", ".tec"),
}
ONE_TYPE = {"tecplot": "hexahedron"}
"""Formats that hold one type of cell, and which is tried."""
NO_REGIONS = ("ugrid",)


SURFACES = {"stl", "ply", "obj", "vtp"}
"""Formats of surfaces alone: test_io_written_surfaces.py."""


def test_every_format_that_is_written_is_tried() -> None:
    assert set(WRITTEN) | SURFACES == {name for name, f in io.FORMATS.items() if f.write is not None}


@pytest.mark.parametrize(("name", "extension"), [(n, e) for n, extensions in WRITTEN.items() for e in extensions])
def test_every_format_keeps_cells(tmp_path: Path, name: str, extension: str) -> None:
    mesh = mesh_of(*([ONE_TYPE[name]] if name in ONE_TYPE else LINEAR))
    lost = io.write(tmp_path / f"a{extension}", mesh)
    back = io.read(tmp_path / f"a{extension}")
    accuracy = 1e-6 if "4" in extension else 1e-12
    assert back.type_counts() == mesh.type_counts()
    np.testing.assert_allclose(corners(back), corners(mesh), atol=accuracy)
    assert meshgauge.measure(back).values == pytest.approx(np.ones(mesh.n_cells), abs=10 * accuracy)
    assert not [note for note in back.notes if "turned" in note], "the cells had to be turned"
    assert not [sentence for sentence in lost if "could not hold" in sentence]


@pytest.mark.parametrize(("name", "extension"), [(n, e) for n, extensions in WRITTEN.items() for e in extensions])
def test_every_format_keeps_regions_or_says_that_it_does_not(tmp_path: Path, name: str, extension: str) -> None:
    mesh = mesh_of(*([ONE_TYPE[name]] if name in ONE_TYPE else LINEAR), n=8 if name in ONE_TYPE else 2)
    material = np.arange(8, dtype=np.int32) % 2 + 3
    lost = io.write(tmp_path / f"a{extension}", mesh.replace(cell_data={"material": material, "x": np.ones(8)}))
    back = io.read(tmp_path / f"a{extension}")
    said = " ".join(lost)
    assert ("x" in back.cell_data) != ("'x'" in said)
    if name in NO_REGIONS:
        assert "'material'" in said
        return
    ids, names = regions(back)
    assert len(names) == 2
    place = np.argsort([back.points[back.nodes(c)][:, 0].mean() for c in range(8)])  # some formats change the order
    assert ids[place].tolist() == (material - 3).tolist()
    assert "material" in " ".join(names) or "'material' became the format's" in said or "became" in said


def corners(mesh: Mesh) -> np.ndarray:
    """Coordinates of the nodes of every cell, the cells sorted by where they are."""
    x = [mesh.points[mesh.nodes(c)] for c in range(mesh.n_cells)]
    return np.concatenate(sorted(x, key=lambda own: float(own[:, 0].mean())))


@pytest.mark.parametrize("extension", [".inp", ".msh", ".vtkhdf"])
def test_curved_cells_stay_what_they_are(tmp_path: Path, extension: str) -> None:
    rng = np.random.default_rng(0)
    names = ("tetra10", "wedge15", "hexahedron20", "triangle6", "quad8", "line3")
    sizes = (10, 15, 20, 6, 8, 3)
    cells = [(name, [np.arange(62)[sum(sizes[:k]) : sum(sizes[: k + 1])]]) for k, name in enumerate(names)]
    mesh = Mesh.from_arrays(rng.random((62, 3)), cells)
    io.write(tmp_path / f"a{extension}", mesh)
    back = io.read(tmp_path / f"a{extension}", wedge_order="gmsh")
    assert_same_cells(mesh, back)


def test_abaqus_keeps_sets_materials_and_names(tmp_path: Path) -> None:
    mesh = mesh_of(*LINEAR).replace(
        cell_data={
            "abaqus:material": np.array([1, 1, 1, 1, 2, 2, 2, 0]),
            "SOME": (np.arange(8) % 3 == 0).astype(np.uint8),
            "x": np.ones(8),
        },
        field_data={"abaqus:material:names": np.array(["steel, hard", "rubber"])},
    )
    lost = io.write(tmp_path / "a.inp", mesh)
    back = io.read(tmp_path / "a.inp")
    assert back.cell_data["SOME"].tolist() == mesh.cell_data["SOME"].tolist()
    assert back.cell_data["abaqus:material"].tolist() == [2, 2, 2, 2, 1, 1, 1, 0]  # by the alphabet
    assert back.field_data["abaqus:material:names"].tolist() == ["rubber", "steel_ hard"]
    assert lost == (
        "Abaqus's names hold no commas or quotes: steel, hard changed.",
        "The format could not hold the cell data 'x'.",
    )


def test_su2_keeps_zones_and_markers_and_says_what_it_does_not(tmp_path: Path) -> None:
    mesh = mesh_of("tetra", "wedge")
    cells = [("tetra", [mesh.nodes(0)]), ("triangle", [mesh.nodes(0)[:3]])]
    cells += [("wedge", [mesh.nodes(1)]), ("tetra", [mesh.nodes(2)])]
    blocks = (CellBlock("air", 0, 1), CellBlock("the wall", 1, 2), CellBlock("air", 2, 3), CellBlock("ice", 3, 4))
    lost = io.write(tmp_path / "a.su2", Mesh.from_arrays(mesh.points, cells).replace(blocks=blocks))
    back = io.read(tmp_path / "a.su2")
    assert [(b.name, b.stop - b.start) for b in back.blocks] == [("zone 1", 2), ("the_wall", 1), ("zone 2", 1)]
    assert back.n_points == 4 + 6 + 4
    assert lost == (
        "SU2's zones have no names: 'air', 'ice' became zones 1 to 2.",
        "The format keeps solid cells before the markers: the order of the cells changed.",
    )
    assert io.write(tmp_path / "b.su2", back) == ()
    assert (tmp_path / "b.su2").read_bytes() == (tmp_path / "a.su2").read_bytes()
    touching = Mesh.from_arrays(np.eye(5, 3), [("tetra", [(0, 1, 2, 3), (0, 1, 2, 4)])], cell_data={"material": [1, 2]})
    assert io.write(tmp_path / "c.su2", touching) == (
        "SU2 knows no regions of cells that share points: 'material 1', 'material 2' are not kept.",
        "The format could not hold the cell data 'material'.",
    )
    flat = Mesh.from_arrays(np.eye(3) * [1, 1, 0], [("triangle", [(0, 1, 2)]), ("line", [(0, 1)])])
    io.write(tmp_path / "d.su2", flat)
    assert io.read(tmp_path / "d.su2").type_counts() == {"triangle": 1, "line": 1}
    with pytest.raises(WriteError, match="surfaces in the plane z = 0"):
        io.write(tmp_path / "d.su2", flat.replace(points=np.eye(3)))


def test_ugrid_keeps_tags_of_surfaces(tmp_path: Path) -> None:
    mesh = Mesh.from_arrays(np.eye(5, 3), [("tetra", [(0, 1, 2, 3)]), ("triangle", [(0, 1, 2), (1, 2, 3)])])
    for extension in WRITTEN["ugrid"]:
        path = tmp_path / f"a{extension}"
        lost = io.write(path, mesh.replace(cell_data={"ugrid:ref": np.array([0, 7, 8])}))
        assert lost == ("The format keeps cells by type: their order changed.",)
        assert io.read(path).cell_data["ugrid:ref"].tolist() == [7, 8, 0]
        path.write_bytes(path.read_bytes()[:-5])
        with pytest.raises(ReadError, match=r"need|truncated"):
            io.read(path)


def test_gmsh_keeps_tags_and_curved_nodes(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    cells = [(name, [rng.permutation(40)[:n]]) for name, n in (("wedge18", 18), ("wedge15", 15), ("pyramid13", 13))]
    cells.append(("lagrange_pyramid", [rng.permutation(40)[:14]]))
    mesh = Mesh.from_arrays(rng.random((40, 3)), cells, cell_data={"gmsh:physical": [1, 2, 3, 4]})
    mesh = mesh.replace(cell_data={**mesh.cell_data, "gmsh:geometrical": np.array([1, 1, 2, 2])})
    io.write(tmp_path / "a.msh", mesh)
    back = io.read(tmp_path / "a.msh", wedge_order="gmsh")
    assert_same_cells(mesh, back)
    np.testing.assert_array_equal(back.cell_data["gmsh:physical"], [1, 2, 3, 4])


def test_medit_says_what_it_lost(tmp_path: Path, solid: Mesh) -> None:
    n = solid.n_cells
    mesh = solid.replace(cell_data={"jens": np.ones(n), "medit:ref": np.arange(n)})
    lost = io.write(tmp_path / "a.mesh", mesh)
    assert lost == (
        "The format keeps cells by type: their order changed.",
        "The format could not hold the cell data 'jens'.",
    )
    back = io.read(tmp_path / "a.mesh")
    refs = back.cell_data["medit:ref"]
    assert sorted(refs.tolist()) == list(range(n))
    for cell, was in enumerate(refs.tolist()):  # each stays with its cell
        np.testing.assert_array_equal(back.points[back.nodes(cell)], mesh.points[mesh.nodes(was)])


@pytest.mark.parametrize("extension", [".mesh", ".msh", ".inp"])
def test_cells_that_a_format_cannot_hold_are_an_error(tmp_path: Path, polyhedral: Mesh, extension: str) -> None:
    path = tmp_path / f"a{extension}"
    with pytest.raises(WriteError, match="polyhedron"):
        io.write(path, polyhedral)
    assert list(tmp_path.iterdir()) == []


def test_medit_cannot_hold_curved_cells(tmp_path: Path, loaded: Mesh) -> None:
    with pytest.raises(WriteError, match="tetra10"):
        io.write(tmp_path / "a.mesh", loaded)
    assert list(tmp_path.iterdir()) == []


def test_input_is_not_overwritten_unasked(tmp_path: Path, solid: Mesh) -> None:
    path = tmp_path / "a.vtu"
    io.write(path, solid)
    before = path.read_bytes()
    mesh = io.read(path)
    with pytest.raises(WriteError, match="overwrite"):
        io.write(path, mesh)
    assert path.read_bytes() == before
    io.write(path, mesh.replace(cell_data={"new": np.zeros(mesh.n_cells)}), overwrite=True)
    assert "new" in io.read(path).cell_data
    io.write(path, solid)  # not read from there: replaced without asking
    assert [p.name for p in tmp_path.iterdir()] == ["a.vtu"]


def test_failed_write_leaves_the_old_file(tmp_path: Path, solid: Mesh, polyhedral: Mesh) -> None:
    path = tmp_path / "a.msh"
    io.write(path, solid)
    before = path.read_bytes()
    with pytest.raises(WriteError):
        io.write(path, polyhedral)
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def test_unknown_extension_and_missing_folder(tmp_path: Path, solid: Mesh) -> None:
    with pytest.raises(WriteError, match=r"\.xyz.*vtu"):
        io.write(tmp_path / "a.xyz", solid)
    with pytest.raises(WriteError, match="no folder"):
        io.write(tmp_path / "no" / "a.vtu", solid)
    with pytest.raises(WriteError, match="is a folder"):
        io.write(tmp_path, solid, file_format="vtu")


def test_format_by_name(tmp_path: Path, solid: Mesh) -> None:
    io.write(tmp_path / "a.dat", solid, file_format="vtu")
    assert_same_cells(solid, io.read(tmp_path / "a.dat", file_format="vtu"))
    assert_same_cells(solid, io.read(tmp_path / "a.dat"))  # told by its content
