"""What is written is what is read back, by us and by others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, assert_same_cells, assert_same_data, mesh_of

from meshgauge import io
from meshgauge.errors import WriteError
from meshgauge.mesh import Mesh

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


@pytest.mark.parametrize("extension", [".msh", ".mesh", ".meshb", ".inp", ".xdmf", ".su2", ".avs", ".b8.ugrid", ".med"])
def test_other_formats_keep_the_cells(tmp_path: Path, extension: str) -> None:
    without_pyramids = (".inp",)
    mesh = mesh_of(*LINEAR[: 3 if extension in without_pyramids else 4])
    path = tmp_path / f"mesh{extension}"
    io.write(path, mesh)
    back = io.read(path)
    np.testing.assert_allclose(back.points, mesh.points, atol=1e-6)
    assert back.type_counts() == mesh.type_counts()
    assert cells_as_sets(back) == cells_as_sets(mesh)
    assert not [note for note in back.notes if "wedge" in note], "the wedges had to be turned"


def cells_as_sets(mesh: Mesh) -> set[tuple[int, ...]]:
    return {(int(mesh.types[c]), *mesh.nodes(c).tolist()) for c in range(mesh.n_cells)}


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
    assert len(lost) == 1
    assert "'jens'" in lost[0]
    np.testing.assert_array_equal(io.read(tmp_path / "a.mesh").cell_data["medit:ref"], np.arange(n))


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
        io.write(tmp_path, solid, format="vtu")


def test_format_by_name(tmp_path: Path, solid: Mesh) -> None:
    io.write(tmp_path / "a.dat", solid, format="vtu")
    assert_same_cells(solid, io.read(tmp_path / "a.dat", format="vtu"))
    assert_same_cells(solid, io.read(tmp_path / "a.dat"))  # told by its content
