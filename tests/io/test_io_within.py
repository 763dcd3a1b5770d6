"""No reader leaves the folder of its file, whatever the file says, and none fetches anything."""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.io.plumbing import sandbox

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
    "reference.xdmf": XDMF.format(head="", kind="HDF", cells="&#46;./away/a.h5:/c", more=""),
    "cdata.xdmf": XDMF.format(head="", kind="HDF", cells="<![CDATA[../away/]]>a.h5:/c", more=""),
    "comment.xdmf": XDMF.format(head="", kind="hdf", cells="..<!-- -->/away/a.h5:/c", more=""),
    "binary.xdmf": XDMF.format(head="", kind="Binary", cells="../away/passwd", more=""),
    "internal.xdmf": XDMF.format(
        head='<!DOCTYPE Xdmf [<!ENTITY x "../away/a.h5">]>', kind="HDF", cells="&x;:/c", more=""
    ),
    "parameter.xdmf": XDMF.format(
        head='<!DOCTYPE Xdmf [<!ENTITY % x SYSTEM "../away/a">%x;]>', kind="XML", cells="0 1 2 3", more=""
    ),
    "wide.xdmf": XDMF.format(head="", kind="HDF", cells="../away/a.h5:/c", more="").replace(
        '"1.0"?>',
        '"1.0" encoding="UTF-16"?><!--\u583c\u6d64\u2066-->',  # whose bytes are "<Xdmf "
    ),
    "other.xdmf": XDMF.format(head="", kind="XML", cells="0 1 2 3", more="").replace(
        '"1.0"', '"1.0" encoding="EBCDIC"'
    ),
    "reference.vtm": '<VTKFile type="vtkMultiBlockDataSet"><vtkMultiBlockDataSet>'
    '<DataSet index="0" file="..&#47;away&#x2F;a.vtu"/></vtkMultiBlockDataSet></VTKFile>',
    "entity.vtm": '<!DOCTYPE x [<!ENTITY e "../away/a.vtu">]><VTKFile type="vtkMultiBlockDataSet">'
    '<vtkMultiBlockDataSet><DataSet index="0" file="&e;"/></vtkMultiBlockDataSet></VTKFile>',
    "reference.pvd": '<VTKFile type="Collection"><Collection><DataSet file="..&#47;away/a.vtu"/>'
    "</Collection></VTKFile>",
    "quoted.case": 'FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: "../away/a.geo"\n',
    "single.case": "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: 1 '../away/a b.geo'\n",
    "a.case": "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: ../away/a.geo\n",
    "b.case": "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\nVARIABLE\nscalar per node: s ../away/a.scl\n",
    "a.inp": "*NODE\n1, 0,0,0\n*INCLUDE, INPUT=../away/a.inp\n",
    "a.bdf": "BEGIN BULK\nINCLUDE '../away/a.bdf'\n",
    "b.bdf": "BEGIN BULK\nINCLUDE '/etc/passwd'\n",
    "b.inp": "*INCLUDE, INPUT=/etc/passwd\n*NODE\n",
}


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("name", AWAY)
def test_files_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    for folder in ("here", "away"):
        (tmp_path / folder).mkdir()
    io.write(tmp_path / "away" / "a.vtu", mesh_of("tetra"))
    with h5py.File(tmp_path / "away" / "a.h5", "w") as file:
        file["c"] = np.array([[0, 1, 2, 3]])
    path = tmp_path / "here" / name
    path.write_text(AWAY[name], encoding="utf-16" if name == "wide.xdmf" else "utf-8")
    with pytest.raises(ReadError, match=r"outside its folder|not fetched|entity|expected UTF-8|neither in") as caught:
        io.read(path)
    assert str(path) in str(caught.value)


def test_files_of_the_folder_are_followed(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["c"] = np.array([[0, 1, 2, 3]])
    path = tmp_path / "a.xdmf"
    path.write_text(XDMF.format(head='<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>', kind="HDF", cells="a.h5:/c", more=""))
    assert io.read(path).type_counts() == {"tetra": 1}


@pytest.mark.usefixtures("readers_here")
def test_an_entity_may_stand_for_a_file_beside(tmp_path: Path) -> None:
    """As PETSc writes it."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["c"] = np.array([[0, 1, 2, 3]])
    path = tmp_path / "a.xdmf"
    head = '<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" [<!ENTITY HeavyData "a.h5">]>'
    path.write_text(XDMF.format(head=head, kind="HDF", cells="&HeavyData;:/c", more=""))
    assert io.read(path).type_counts() == {"tetra": 1}


@pytest.mark.usefixtures("readers_here")
def test_what_is_included_is_checked_as_well(tmp_path: Path) -> None:
    for folder in ("here", "away"):
        (tmp_path / folder).mkdir()
    (tmp_path / "away" / "a.h5").touch()
    path = tmp_path / "here" / "a.xdmf"
    path.write_text(XDMF.format(head="", kind="XML", cells="0 1 2 3", more='<xi:include href="b.xmf"/>'))
    (tmp_path / "here" / "b.xmf").write_text('<Grid><DataItem Format="HDF">../away/a.h5:/c</DataItem></Grid>')
    with pytest.raises(ReadError, match="outside its folder"):
        io.read(path)
    (tmp_path / "here" / "b.xmf").write_text('<Grid><xi:include href="b.xmf"/></Grid>')
    with pytest.raises(ReadError, match="includes a file"):
        io.read(path)


def test_packed_pieces_are_read(tmp_path: Path) -> None:
    io.write(tmp_path / "a.vtu", mesh_of("tetra"))
    (tmp_path / "a.vtu.gz").write_bytes(gzip.compress((tmp_path / "a.vtu").read_bytes()))
    (tmp_path / "a.vtu").unlink()
    path = tmp_path / "a.pvd"
    path.write_text('<VTKFile type="Collection"><Collection><DataSet file="a.vtu.gz"/></Collection></VTKFile>')
    assert io.read(path).type_counts() == {"tetra": 2}


SANDBOX = """
import os, sys
from pathlib import Path
from meshgauge.io.plumbing import child, sandbox
here, away, how = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
if how == "child":
    from meshgauge.io import registry
    confine = sandbox.confine
    registry.read_here = lambda *_: (print((here / "a.vtu").read_text()), away.read_text())
    child.main({"seconds": 60, "memory": 8 << 30, "fd": None, "result": str(here / "out"), "path": str(here / "a.vtu"),
                "name": "a.vtu", "format": "vtu", "step": None, "scratch": sys.argv[4], "roots": [],
                "parent": os.getppid()})
sandbox.confine([here], scratch=sys.argv[4], uses_kernel=how == "kernel")
(Path(sys.argv[4]) / "new").write_text("x")
(Path(sys.argv[4]) / "new").unlink()
print((here / "a.vtu").read_text())
for path, mode in ((away, "r"), (here / ".." / "away", "r"), (here / "link", "r"), (here / "new", "w"),
                   (here / "a.vtu", "r+"), ("/etc/passwd", "r")):
    try:
        open(path, mode).close()
    except PermissionError:
        continue
    print("opened", path, mode)
open("/dev/null", "w").close()
import h5py, numpy.fft, vtkmodules.vtkIOXML
print("imports work")
"""


@pytest.mark.skipif(os.name != "posix", reason="made of links and of /etc/passwd")
@pytest.mark.parametrize("how", ["kernel", "python", "child"])
def test_a_child_sees_the_folder_and_the_installation_only(how: str, tmp_path: Path) -> None:
    """Also what no guard knows of: a reader that opens a file elsewhere gets none."""
    here = tmp_path / "here"
    here.mkdir()
    (here / "a.vtu").write_text("inside")
    (here / "out").touch()
    (tmp_path / "away").write_text("secret")
    (here / "link").symlink_to(tmp_path / "away")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", SANDBOX, here, tmp_path / "away", how, scratch], capture_output=True, text=True, cwd="/"
    )
    assert done.stdout.startswith("inside\n"), done.stderr
    assert "opened" not in done.stdout
    assert "secret" not in done.stdout
    if how == "child":
        assert "PermissionError" in done.stderr
    else:
        assert done.stdout.endswith("imports work\n"), done.stderr


@pytest.mark.skipif(os.name != "posix", reason="made of a child process")
def test_the_environment_names_further_folders(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "a").write_text("seen")
    code = (
        "import sys; from pathlib import Path; from meshgauge.io.plumbing import sandbox; sandbox.confine([]);"
        "print(Path(sys.argv[1]).read_text())"
    )
    for name, seen in (("MESHGAUGE_READ_FOLDERS", True), ("LD_LIBRARY_PATH", True), ("OTHER", False)):
        environment = {**os.environ, name: f"{tmp_path / 'none'}{os.pathsep}{tmp_path / 'lib'}"}
        done = subprocess.run(
            [sys.executable, "-c", code, tmp_path / "lib" / "a"], capture_output=True, text=True, env=environment
        )
        assert (done.stdout == "seen\n") == seen, done.stderr


@pytest.mark.usefixtures("readers_here")
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


def test_packages_of_pythonpath_are_part_of_the_installation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), "", ".", "beside"]))
    seen = sandbox.installation()
    assert str(tmp_path) in seen
    assert not {"", ".", "beside"} & set(seen)
