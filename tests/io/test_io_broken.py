"""Files that are missing, cut off, of another format or hostile: an error with the name, nothing printed, no crash."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError, WriteError
from meshgauge.io import registry
from meshgauge.io.plumbing.format import Format
from meshgauge.mesh import Mesh

WRITABLE = (".vtu", ".vtk", ".vtkhdf", ".msh", ".mesh", ".meshb")


@pytest.mark.parametrize("name", ["no.vtu", "no.msh", "no.xyz", "n" * 300 + ".vtu", "a\0b.vtu"])
def test_missing(tmp_path: Path, name: str) -> None:
    with pytest.raises(ReadError, match=r"no such file|cannot be opened"):
        io.read(tmp_path / name)


def test_folder_and_empty_file(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="is a folder"):
        io.read(tmp_path)
    (tmp_path / "a.vtu").touch()
    with pytest.raises(ReadError, match=r"a\.vtu: is empty"):
        io.read(tmp_path / "a.vtu")


@pytest.mark.parametrize("extension", sorted({e for f in io.FORMATS.values() for e in f.extensions}))
def test_garbage(tmp_path: Path, extension: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"a{extension}"
    path.write_bytes(np.random.default_rng(0).bytes(3000))
    with pytest.raises(ReadError, match=re.escape(str(path))):
        io.read(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("extension", WRITABLE)
@pytest.mark.parametrize(
    "share", [0.02, pytest.param(0.3, marks=pytest.mark.long), 0.6, pytest.param(0.9, marks=pytest.mark.long)]
)
def test_cut_off(tmp_path: Path, extension: str, share: float, capfd: pytest.CaptureFixture[str]) -> None:
    mesh = mesh_of("tetra", "hexahedron", n=40)
    whole, cut = tmp_path / f"a{extension}", tmp_path / f"b{extension}"
    io.write(whole, mesh)
    data = whole.read_bytes()
    cut.write_bytes(data[: int(share * len(data))])
    with pytest.raises(ReadError, match=re.escape(str(cut))):
        io.read(cut)
    assert capfd.readouterr() == ("", "")


def test_point_ids_out_of_range(tmp_path: Path) -> None:
    import h5py

    io.write(tmp_path / "a.vtkhdf", mesh_of("tetra", "hexahedron"))
    with h5py.File(tmp_path / "a.vtkhdf", "a") as file:
        file["VTKHDF/Connectivity"][5] = 999
    (tmp_path / "a.vtk").write_text(
        legacy("POINTS 4 float\n" + "0 0 0\n" * 4 + "CELLS 1 5\n4 0 1 2 7\nCELL_TYPES 1\n10\n")
    )
    xml = vtu('NumberOfPoints="1" NumberOfCells="1"', points="0 0 0", connectivity="0 0 0 -3", offsets="4", types="10")
    (tmp_path / "a.vtu").write_text(xml)
    expected = {
        ".vtkhdf": r"cell 1 \(hexahedron\): point id 999 is outside 0\.\.23",
        ".vtk": r"cell 0 \(tetra\): point id 7 is outside 0\.\.3",
        ".vtu": r"cell 0 \(tetra\): point id -3 is outside 0\.\.0",
    }
    for extension, message in expected.items():
        with pytest.raises(ReadError, match=rf"a\{extension}: {message}"):
            io.read(tmp_path / f"a{extension}")


def legacy(body: str) -> str:
    return f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n{body}"


def vtu(counts: str, **arrays: str) -> str:
    def array(name: str, kind: str) -> str:
        width = 'NumberOfComponents="3"' if name == "points" else ""
        return f'<DataArray type="{kind}" Name="{name}" {width} format="ascii">{arrays[name]}</DataArray>'

    cells = "".join(array(n, "Int64") for n in ("connectivity", "offsets") if n in arrays)
    cells += array("types", "UInt8") if "types" in arrays else ""
    points = array("points", "Float64") if "points" in arrays else ""
    piece = f"<Piece {counts}><Points>{points}</Points><Cells>{cells}</Cells></Piece>"
    return f'<VTKFile type="UnstructuredGrid"><UnstructuredGrid>{piece}</UnstructuredGrid></VTKFile>'


HOSTILE = {
    "points.vtk": legacy("POINTS 99999999999 float\n"),
    "cells.vtk": legacy("POINTS 1 float\n0 0 0\nCELLS 9999999999 99999999999\n"),
    "fewer_cells.vtk": legacy("POINTS 1 float\n0 0 0\nCELLS 3 6\n1 0\n1 0\n1 0\nCELL_TYPES 3\n1 1\n"),
    "arrays.vtk": legacy("POINTS 1 float\n0 0 0\nCELLS 1 2\n1 0\nCELL_TYPES 1\n1\nPOINT_DATA 1\nFIELD a 16777216\n"),
    "points.vtu": vtu('NumberOfPoints="99999999999" NumberOfCells="1"'),
    "negative.vtu": vtu('NumberOfPoints="1" NumberOfCells="-7"', points="0 0 0"),
    "away.pvtu": '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="../../etc/a.vtu"/>'
    "</PUnstructuredGrid></VTKFile>",
    "away.vtm": '<VTKFile type="vtkMultiBlockDataSet"><vtkMultiBlockDataSet><DataSet index="0" file="/etc/a.vtu"/>'
    "</vtkMultiBlockDataSet></VTKFile>",
    "kind.vtu": '<VTKFile type="Rubbish"></VTKFile>',
    "nodes.msh": "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n999999999999\n1 0 0 0\n$EndNodes\n",
    "vertices.mesh": "MeshVersionFormatted 2\nDimension 3\nVertices\n999999999999\n0 0 0 0\nEnd\n",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    path.write_text(HOSTILE[name])
    with pytest.raises(ReadError, match=re.escape(str(path))):
        io.read(path)
    assert capfd.readouterr() == ("", "")


def test_no_array_is_looked_for_that_no_file_of_this_size_can_hold(tmp_path: Path) -> None:
    """VTK looks for each of them behind the end of the file: 1.8 GB in twelve seconds."""
    path = tmp_path / "arrays.vtk"
    path.write_text(HOSTILE["arrays.vtk"])
    with pytest.raises(ReadError, match="states a FIELD of 16777216 arrays"):
        io.read(path)


def test_content_decides_between_formats_of_one_extension(tmp_path: Path) -> None:
    (tmp_path / "mfem.mesh").write_text("MFEM mesh v1.0\n\ndimension\n3\n")
    with pytest.raises(ReadError, match="has no vertices or no elements"):
        io.read(tmp_path / "mfem.mesh")
    (tmp_path / "fluent.msh").write_text('(0 "a")\n(2 3)\n(10 (0 1 8 0))\n')
    with pytest.raises(ReadError, match="has no cells or no faces"):
        io.read(tmp_path / "fluent.msh")
    mesh = mesh_of("tetra")
    io.write(tmp_path / "a.msh", mesh)
    (tmp_path / "a.mesh").write_bytes((tmp_path / "a.msh").read_bytes())
    assert io.read(tmp_path / "a.mesh").type_counts() == {"tetra": 2}  # the wrong extension does not matter


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "a.vtuu",
            r"'\.vtuu' and the content are of no known format; nearest are \.vtu \(vtu\), .*; --format NAME reads",
        ),
        ("a.mshh", r"nearest are \.msh \(gmsh or fluent or frontistr\)"),
        ("a.qqqqqq", r"of no known format; --format NAME reads it as another format$"),
        ("a", "has no extension, and its content is of no known format; --format NAME"),
        ("a.neu", r"\.neu does \(GAMBIT neutral: gambit or FEMAP neutral: femap\); --format NAME reads it as another"),
    ],
)
def test_an_unknown_format_names_the_nearest_and_the_option(name: str, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("hello")
    with pytest.raises(ReadError, match=message) as caught:
        io.read(tmp_path / name)
    assert len(str(caught.value).removeprefix(str(tmp_path))) < 250


def test_a_partial_report_is_no_mesh(tmp_path: Path) -> None:
    path = tmp_path / "a.mgp"
    meshgauge.partial(mesh_of("tetra")).save(path)
    with pytest.raises(ReadError, match=r"a\.mgp: is the partial report of .*; 'meshgauge merge' makes the report"):
        io.read(path)


def test_an_unknown_name_of_a_format(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("hello")
    with pytest.raises(ReadError, match=r"no format 'gmhs'; did you mean 'gmsh'"):
        io.read(tmp_path / "a.xyz", file_format="gmhs")
    with pytest.raises(ReadError, match=r"no format 'qqqqqq'; 'meshgauge formats' lists"):
        io.read(tmp_path / "a.xyz", file_format="qqqqqq")


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
def test_nan_coordinates_and_no_cells_are_legal(tmp_path: Path, extension: str) -> None:
    mesh = mesh_of("tetra")
    points = mesh.points.copy()
    points[0] = np.nan
    points[1] = np.inf
    path = tmp_path / f"a{extension}"
    io.write(path, mesh.replace(points=points))
    np.testing.assert_array_equal(io.read(path).points, points)
    none = Mesh.from_arrays(np.zeros((4, 3)), [])
    io.write(path, none)
    assert io.read(path).n_cells == 0


def test_unwritable_folder(tmp_path: Path) -> None:
    mesh = mesh_of("tetra")
    (tmp_path / "file").touch()
    with pytest.raises(WriteError, match="no folder"):
        io.write(tmp_path / "file" / "a.vtu", mesh)


def test_importing_the_door_loads_numpy_only() -> None:
    heavy = "('vtk', 'vtkmodules', 'h5py', 'meshio', 'pyvista', 'numba', 'gmsh')"
    code = f"import sys, meshgauge.io; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_reading_vtu_loads_neither_pyvista_nor_meshio(tmp_path: Path) -> None:
    io.write(tmp_path / "a.vtu", mesh_of("tetra"))
    loaded = "print('pyvista' in sys.modules, 'meshio' in sys.modules)"
    code = f"import sys, meshgauge.io as i; i.read({str(tmp_path / 'a.vtu')!r}); {loaded}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


@pytest.mark.parametrize("error", [RuntimeError, KeyError, OSError, ValueError])
def test_a_damaged_beginning_is_no_error_of_a_library(
    error: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HDF5 raises RuntimeError where the tables of a group are damaged, already when a format looks for its mark."""

    def sniff(head: bytes, path: Path) -> bool:
        raise error("bad local heap signature")

    monkeypatch.setattr(registry, "ALL", (Format("x", "X", (".x",), sniff),))
    (tmp_path / "a.x").write_bytes(b"\x89HDF")
    with pytest.raises(ReadError, match=r"a\.x: does not begin as"):
        io.read(tmp_path / "a.x")
