"""Named sets of cells in files: each is read back by somebody else's library, and nothing else is touched."""

from __future__ import annotations

from pathlib import Path

import cgns_files
import h5py
import numpy as np
import pytest
from patch_files import PATCHED, bricks
from test_io_adding import variables
from test_io_patch import stored

import meshgauge
from meshgauge import Mesh, WriteError
from meshgauge.cli.main import main
from meshgauge.io.plumbing import vtk
from meshgauge.io.sets import write_set

pytestmark = pytest.mark.usefixtures("readers_here")

EXODUS = ["exodus classic", "exodus 64 bit", "exodus", "exodus packed"]
NAME = "MESHGAUGE_BAD"


def with_set(path: Path, cells: list[int], target: Path, name: str = NAME) -> Path:
    write_set(meshgauge.read(path), target, np.array(cells), name)
    return target


@pytest.mark.parametrize("kind", EXODUS)
def test_a_set_of_exodus(kind: str, tmp_path: Path) -> None:
    netCDF4 = pytest.importorskip("netCDF4")
    path = PATCHED[kind][1](tmp_path)
    first = with_set(path, [0, 3, 7], tmp_path / "first.e")
    second = with_set(first, [2, 5], tmp_path / "second.e", "OTHER")
    for old, new in ((path, first), (first, second)):
        before, after = variables(old), variables(new)
        ours = ("num_elem_sets", "els_", "elem_els", "num_ele_els")
        assert {k: after[k] for k in before if not k.lstrip("/").startswith(ours)} == {
            k: v for k, v in before.items() if not k.lstrip("/").startswith(ours)
        }
    with netCDF4.Dataset(second) as file:
        assert file["els_prop1"][:].tolist() == [1, 2]
        assert file["els_prop1"].getncattr("name") == "ID"
        assert file["els_status"][:].tolist() == [1, 1]
        assert [netCDF4.chartostring(row).item().strip("\0") for row in file["els_names"][:]] == [NAME, "OTHER"]
        assert [file[f"elem_els{n}"][:].tolist() for n in (1, 2)] == [[1, 4, 8], [3, 6]]
    with pytest.raises(WriteError, match=f"has a set {NAME} already"):
        with_set(second, [1], tmp_path / "third.e")
    assert not (tmp_path / "third.e").exists()


def test_vtk_reads_the_set_of_exodus(tmp_path: Path) -> None:
    from vtkmodules.vtkIOExodus import vtkExodusIIReader, vtkExodusIIWriter

    writer = vtkExodusIIWriter()
    writer.SetFileName(str(tmp_path / "mesh.e"))
    writer.SetInputData(vtk.grid(bricks())[0])
    writer.Write()
    made = with_set(tmp_path / "mesh.e", [0, 3, 7], tmp_path / "a.e")
    reader = vtkExodusIIReader()
    reader.SetFileName(str(made))
    reader.UpdateInformation()
    kinds = vtkExodusIIReader.ELEM_SET
    assert reader.GetNumberOfObjects(kinds) == 1
    assert reader.GetObjectName(kinds, 0).startswith(NAME)
    assert reader.GetObjectId(kinds, 0) == 1
    assert reader.GetNumberOfEntriesInObject(kinds, 0) == 3


def test_cells_that_are_bad_in_a_deformed_shape(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The set is of the shape that was measured, the coordinates of the copy are those of the file."""
    from vtkmodules.vtkIOExodus import vtkExodusIIWriter

    mesh = bricks()
    moves = np.zeros_like(mesh.points)
    moves[mesh.nodes(3)[0]] = 10 * (mesh.points.max(axis=0) - mesh.points.min(axis=0))
    writer = vtkExodusIIWriter()
    writer.SetFileName(str(tmp_path / "mesh.e"))
    writer.SetInputData(vtk.grid(mesh.replace(point_data={"u": moves}))[0])
    writer.Write()
    monkeypatch.chdir(tmp_path)
    assert main(["report", "mesh.e", "-q", "--displacement", "u", "--bad-set", "a.e", "--bad", "bad.txt"]) == 0
    before, after = variables(tmp_path / "mesh.e"), variables(tmp_path / "a.e")
    for name in ("coordx", "coordy", "coordz"):
        assert after[name] == before[name]
    assert "4" in (tmp_path / "bad.txt").read_text().split()


@pytest.mark.parametrize("kind", ["cgns", "cgns packed"])
def test_a_region_of_cgns(kind: str, tmp_path: Path) -> None:
    path = PATCHED[kind][1](tmp_path)
    made = with_set(path, [0, 3, 7], tmp_path / "out.cgns")
    before, after = stored(path), stored(made)
    assert {key: after[key] for key in before} == before
    with h5py.File(made) as file:
        region = file[f"Base/Zone/{NAME}"]
        assert region.attrs["label"] == b"ZoneSubRegion_t"
        assert region[" data"][:].tolist() == [3]
        assert region["PointList/ data"][:].tolist() == [[1], [4], [8]]
        assert region["GridLocation/ data"][:].tobytes() == b"CellCenter"
    with pytest.raises(WriteError, match="already"):
        with_set(made, [1], tmp_path / "again.cgns")


def test_cells_of_zones_that_are_structured_or_have_faces_first(tmp_path: Path) -> None:
    """Cells along the axes; and numbers of elements, which begin with the faces."""
    path, mesh = tmp_path / "a.cgns", bricks()
    x = np.stack(np.meshgrid(range(3), range(4), range(5), indexing="ij"), axis=-1).astype(float)
    points = np.transpose(x, (2, 1, 0, 3))  # the first index runs fastest
    with h5py.File(path, "w") as file:
        base = cgns_files.base(file)
        cgns_files.zone(base, "A", points, 0, np.array([[3, 4, 5], [2, 3, 4], [0, 0, 0]]).T.T, "Structured")
        zone = cgns_files.zone(base, "B", mesh.points, mesh.n_cells)
        nodes = mesh.connectivity.reshape(-1, 8) + 1
        cgns_files.section(zone, "Faces", 7, 1, 2, nodes[:2, :4].ravel())
        cgns_files.section(zone, "Bricks", 17, 3, mesh.n_cells, nodes.ravel())
    read = meshgauge.read(path)
    n = 2 * 3 * 4
    assert read.n_cells == n + 2 + mesh.n_cells
    bricks_at = np.flatnonzero(read.types == 12)[n:]
    made = with_set(path, [1, 2, 6, *bricks_at[[0, 4]].tolist()], tmp_path / "b.cgns")
    with h5py.File(made) as file:
        assert file[f"Base/A/{NAME}/PointList/ data"][:].tolist() == [[2, 1, 1], [1, 2, 1], [1, 1, 2]]
        assert file[f"Base/B/{NAME}/PointList/ data"][:].tolist() == [[3], [7]]


def grouped() -> Mesh:
    """Eight bricks in two physical groups of one volume, the last in none, and a face."""
    mesh = bricks()
    kinds = [("hexahedron", mesh.connectivity.reshape(-1, 8)[:8]), ("quad", mesh.connectivity.reshape(-1, 8)[:1, :4])]
    physical = np.array([5, 5, 5, 5, 9, 9, 9, 0, 3])
    made = Mesh.from_arrays(mesh.points, kinds)
    return made.replace(
        cell_data={
            "gmsh:physical": physical,
            "gmsh:geometrical": np.array([1] * 8 + [4]),
            "heat": np.arange(9.0),
        },
        field_data={"steel": np.array([5, 3]), "air": np.array([9, 3]), "wall": np.array([3, 2])},
    )


def test_a_physical_group_of_gmsh_beside_those_there_are(tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    path = tmp_path / "a.msh"
    mesh = grouped()
    assert write_set(mesh, path, np.array([1, 4, 7, 8]), NAME) == ()
    back = meshgauge.read(path)
    np.testing.assert_array_equal(back.cell_data["gmsh:physical"], [5, 5, 5, 5, 9, 9, 9, 10, 10 - 7])
    np.testing.assert_array_equal(back.cell_data["heat"], np.arange(9.0))
    np.testing.assert_array_equal(back.connectivity, mesh.connectivity)
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        members: dict[str, list[int]] = {}
        for dimension, tag in gmsh.model.getPhysicalGroups():
            for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
                for tags in gmsh.model.mesh.getElements(dimension, entity)[1]:
                    members.setdefault(gmsh.model.getPhysicalName(dimension, tag), []).extend(map(int, tags))
        n_nodes = len(gmsh.model.mesh.getNodes()[0])
    finally:
        gmsh.finalize()
    assert {name: sorted(tags) for name, tags in members.items()} == {
        "steel": [1, 2, 3, 4],
        "air": [5, 6, 7],
        "wall": [9],
        NAME: [2, 5, 8, 9],
    }
    assert n_nodes == mesh.n_points


def test_what_has_no_sets_is_refused(tmp_path: Path) -> None:
    for name in ("a.vtu", "a.e", "a.xyzzy", "a"):
        with pytest.raises(WriteError, match=r"files of Exodus II and CGNS, or written with any mesh as \.msh"):
            write_set(bricks(), tmp_path / name, np.array([0]), NAME)
    with pytest.raises(WriteError, match="standard output"):
        write_set(bricks(), "-", np.array([0]), NAME)
    assert list(tmp_path.iterdir()) == []
