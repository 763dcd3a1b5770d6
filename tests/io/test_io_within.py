"""No reader leaves the folder of its file, whatever the file says, and none fetches anything."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

from meshgauge import io
from meshgauge.errors import ReadError

h5py = pytest.importorskip("h5py")

XDMF = """<?xml version="1.0"?>{head}<Xdmf Version="3.0"><Domain><Grid Name="g">
<Topology TopologyType="Tetrahedron" NumberOfElements="1">
<DataItem Dimensions="1 4" Format="{kind}" NumberType="Int">{cells}</DataItem></Topology>
<Geometry GeometryType="XYZ"><DataItem Dimensions="4 3" Format="XML">0 0 0 1 0 0 0 1 0 0 0 1</DataItem></Geometry>
{more}</Grid></Domain></Xdmf>"""

AWAY = {
    "h5.xdmf": XDMF.format(head="", kind="HDF", cells="../away/a.h5:/c", more=""),
    "absolute.xdmf": XDMF.format(head="", kind="HDF", cells="/etc/a.h5:/c", more=""),
    "url.xdmf": XDMF.format(head="", kind="HDF", cells="http://127.0.0.1/a.h5:/c", more=""),
    "include.xdmf": XDMF.format(head="", kind="XML", cells="0 1 2 3", more='<xi:include href="../away/a.xmf"/>'),
    "entity.xdmf": XDMF.format(
        head='<!DOCTYPE Xdmf [<!ENTITY x SYSTEM "file:///etc/passwd">]>', kind="XML", cells="0 1 2 3", more="&x;"
    ),
    "a.pvd": '<VTKFile type="Collection"><Collection><DataSet file="../away/a.vtu"/></Collection></VTKFile>',
    "b.pvd": '<VTKFile type="Collection"><Collection><DataSet file="http://127.0.0.1/a.vtu"/></Collection></VTKFile>',
    "a.pvtu": '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="../away/a.vtu"/>'
    "</PUnstructuredGrid></VTKFile>",
    "a.vtm": '<VTKFile type="vtkMultiBlockDataSet"><vtkMultiBlockDataSet><DataSet index="0" file="../away/a.vtu"/>'
    "</vtkMultiBlockDataSet></VTKFile>",
    "a.case": "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: ../away/a.geo\n",
    "b.case": "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\nVARIABLE\nscalar per node: s ../away/a.scl\n",
    "a.inp": "*NODE\n1, 0,0,0\n*INCLUDE, INPUT=../away/a.inp\n",
    "a.bdf": "BEGIN BULK\nINCLUDE '../away/a.bdf'\n",
    "b.bdf": "BEGIN BULK\nINCLUDE '/etc/passwd'\n",
    "b.inp": "*INCLUDE, INPUT=/etc/passwd\n*NODE\n",
}


@pytest.mark.parametrize("name", AWAY)
def test_files_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    for folder in ("here", "away"):
        (tmp_path / folder).mkdir()
    io.write(tmp_path / "away" / "a.vtu", mesh_of("tetra"))
    with h5py.File(tmp_path / "away" / "a.h5", "w") as file:
        file["c"] = np.array([[0, 1, 2, 3]])
    path = tmp_path / "here" / name
    path.write_text(AWAY[name])
    with pytest.raises(ReadError, match=r"outside its folder|not fetched|entities") as caught:
        io.read(path)
    assert str(path) in str(caught.value)


def test_files_of_the_folder_are_followed(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["c"] = np.array([[0, 1, 2, 3]])
    path = tmp_path / "a.xdmf"
    path.write_text(XDMF.format(head='<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>', kind="HDF", cells="a.h5:/c", more=""))
    assert io.read(path).type_counts() == {"tetra": 1}


@pytest.mark.parametrize("extension", [".vtkhdf", ".e", ".med", ".cgns", ".h5m"])
@pytest.mark.parametrize("kind", ["link", "virtual", "external"])
def test_hdf5_files_do_not_reach_into_others(tmp_path: Path, extension: str, kind: str) -> None:
    secret, path = tmp_path / "away" / "secret.h5", tmp_path / "here" / f"a{extension}"
    for folder in (secret.parent, path.parent):
        folder.mkdir()
    with h5py.File(secret, "w") as file:
        file["x"] = np.zeros(4)
    with h5py.File(path, "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["Type"] = b"UnstructuredGrid"
        if kind == "link":
            group["Points"] = h5py.ExternalLink(str(secret), "/x")
        elif kind == "virtual":
            layout = h5py.VirtualLayout(shape=(4,), dtype=float)
            layout[:] = h5py.VirtualSource(str(secret), "x", shape=(4,))
            group.create_virtual_dataset("Points", layout)
        else:
            group.create_dataset("Points", (4,), float, external=[(str(tmp_path / "raw"), 0, 32)])
    with pytest.raises(ReadError, match=r"not followed|in other files|outside its folder"):
        io.read(path)


def test_includes_that_include_one_another_end(tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    path.write_text("*NODE\n*INCLUDE, INPUT=a.inp\n")
    with pytest.raises(ReadError, match=r"includes this file again"):
        io.read(path)
