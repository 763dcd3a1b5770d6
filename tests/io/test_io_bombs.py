"""A small file takes neither all memory nor all day: it is read in a time that grows with its size, or refused."""

from __future__ import annotations

import contextlib
import gzip
import time
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

from meshgauge import io
from meshgauge.errors import ReadError

LONG = 300_000
"""Characters with which anything of their square takes minutes."""

FOAM = "FoamFile {{ version 2.0; format ascii; class x; object x; {entry} }}\n"


def openfoam(boundary: str, entry: str = "", comment: str = "") -> Callable[[Path], Path]:
    """A case of one hexahedron without patches but what is given."""
    files = {
        "points": "8((0 0 0)(1 0 0)(1 1 0)(0 1 0)(0 0 1)(1 0 1)(1 1 1)(0 1 1))",
        "faces": "6(4(0 3 2 1)4(4 5 6 7)4(0 1 5 4)4(3 7 6 2)4(0 4 7 3)4(1 2 6 5))",
        "owner": "6(0 0 0 0 0 0)",
        "neighbour": "0()",
        "boundary": boundary,
    }

    def write(folder: Path) -> Path:
        mesh = folder / "case" / "constant" / "polyMesh"
        mesh.mkdir(parents=True)
        for name, text in files.items():
            (mesh / name).write_text(FOAM.format(entry=entry) + comment + text)
        return folder / "case"

    return write


def text(name: str, content: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(content)
        return folder / name

    return write


SLOW = {
    "patches without braces": openfoam("1(w { type wall; nFaces 6; startFace 0; })" + "a" * LONG),
    "patches of quotes": openfoam('0()"' + '"a' * LONG),
    "entries without end": openfoam("0()", entry="a " * LONG),
    "entries of quotes": openfoam("0()", entry='a "' + 'b" "' * (LONG // 3)),
    "comments without end": openfoam("0()", comment="\n" + "// " + "/*" * LONG + "\n"),
    "texts without end": text("a.cas", '(0 "x")\n(2 3)\n(0 "' + '\\"' * LONG),
    "quotes without end": text("b.cas", '(0 "x")\n(2 3)\n(0 ' + '"' * LONG),
    "properties of spaces": text("a.ovm", "OVM ASCII\nVertices\n0\nEdges\n0\nFaces\n0\nPolyhedra\n0\n" + " \n" * LONG),
    "lines without numbers": text(
        "a.tec", 'VARIABLES = "X" "Y" "Z"\nZONE N=1, E=0, F=FEPOINT\n0 0' + "\n" * LONG + "0\n"
    ),
    "a number that repeats nothing": text("b.tec", 'VARIABLES = "X"\nZONE N=1\n' + "1" * LONG + " 1*1\n"),
    "comments and spaces": text("a.ele", " #\n" * 1300 + "x"),
}


@pytest.mark.parametrize("name", SLOW)
def test_time_grows_with_the_size(name: str, tmp_path: Path) -> None:
    path = SLOW[name](tmp_path)
    start = time.monotonic()
    with contextlib.suppress(ReadError):
        io.read(path)
    assert time.monotonic() - start < 60


def vtu(arrays: int, n: int = 1_000_000) -> bytes:
    """A tetrahedron among many points, with arrays that all stand where the points do."""
    blocks, places = [], []
    for values in (np.zeros(3 * n, "<f4"), np.arange(4), np.array([4]), np.array([10], np.uint8)):
        packed = zlib.compress(values.tobytes())
        places.append(sum(map(len, blocks)))
        blocks.append(np.array([1, values.nbytes, 0, len(packed)], "<u8").tobytes() + packed)
    names = "".join(
        f'<DataArray type="Float32" Name="a{k}" NumberOfComponents="3" format="appended" offset="0"/>'
        for k in range(arrays)
    )
    head = (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        f'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="{n}" NumberOfCells="1"><Points>'
        '<DataArray type="Float32" Name="P" NumberOfComponents="3" format="appended" offset="0"/></Points><Cells>'
        f'<DataArray type="Int64" Name="connectivity" format="appended" offset="{places[1]}"/>'
        f'<DataArray type="Int64" Name="offsets" format="appended" offset="{places[2]}"/>'
        f'<DataArray type="UInt8" Name="types" format="appended" offset="{places[3]}"/></Cells>'
        f'<PointData>{names}</PointData></Piece></UnstructuredGrid><AppendedData encoding="raw">_'
    )
    return head.encode() + b"".join(blocks) + b"</AppendedData></VTKFile>"


def test_many_arrays_at_one_place_of_a_vtu(tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    path.write_bytes(vtu(1))
    assert io.read(path).n_points == 1_000_000
    path.write_bytes(vtu(100))
    with pytest.raises(ReadError, match=r"more than the .* bytes may take"):
        io.read(path)


@pytest.mark.parametrize("link", ["arrays", "groups"])
def test_many_names_of_one_array_of_hdf5(tmp_path: Path, link: str) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.vtkhdf"
    mesh = mesh_of("tetra")
    io.write(path, mesh.replace(point_data={"a": np.zeros(mesh.n_points)}))
    assert io.read(path).n_cells == 2
    with h5py.File(path, "r+") as file:
        group = file["VTKHDF"]
        if link == "arrays":
            large = group.create_dataset("PointData/large", (1_000_000, 3), "f8", compression="gzip")
            for k in range(200):
                group[f"PointData/a{k}"] = large
        else:
            group.create_dataset("Below/large", (1_000_000, 3), "f8", compression="gzip")
            for k in range(200):
                group[f"b{k}"] = group["Below"]
    with pytest.raises(ReadError, match=r"more than the .* bytes may take"):
        io.read(path)


def test_a_ladder_of_groups_is_climbed_once(tmp_path: Path) -> None:
    """Each of 60 groups holds the next twice: 2^60 ways to the last."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.vtkhdf"
    io.write(path, mesh_of("tetra"))
    with h5py.File(path, "r+") as file:
        root = file["VTKHDF"]
        grid = file.create_group("grid")
        for name in list(root):
            file.move(f"VTKHDF/{name}", f"grid/{name}")
        for name, value in root.attrs.items():
            grid.attrs[name] = value
        root.attrs["Type"] = np.bytes_("MultiBlockDataSet")
        file.move("grid", "VTKHDF/grid")
        group = root.create_group("Assembly")
        for _ in range(60):
            below = group.create_group("a")
            group["b"] = below
            group = below
        group["tetra"] = h5py.SoftLink("/VTKHDF/grid")
    assert [block.name for block in io.read(path).blocks] == ["tetra"]


def test_names_times_elements(tmp_path: Path) -> None:
    """2 000 sets of one element each, in 4 000 elements: of the sets some are kept, and the others counted."""
    rows = "\n".join(f"{n}, 1, 2, 3, 4" for n in range(1, 4001))
    sets = "\n".join(f"*ELSET, ELSET=S{n}\n{n}" for n in range(2000))
    deck = f"*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT, TYPE=C3D4\n{rows}\n{sets}\n"
    (tmp_path / "a.inp").write_text(deck)
    tracemalloc.start()
    mesh = io.read(tmp_path / "a.inp")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50 * len(deck)  # with a member for each it is 12 MB, not 4
    assert any("of 2000 element sets were left out" in note for note in mesh.notes)
    assert mesh.cell_data["S0"].sum() == 0
    assert mesh.cell_data["S1"].sum() == 1


def test_a_packed_file_is_unpacked_only_if_it_begins_as_a_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, start in (("a.vtk", b"nothing"), ("b.dat", b"\0" * 8)):
        path = tmp_path / f"{name}.gz"
        path.write_bytes(gzip.compress(start + bytes(50_000_000)))
        monkeypatch.setattr("shutil.copyfileobj", lambda *_: pytest.fail("it was unpacked"))
        with pytest.raises(ReadError, match=rf"{name}\.gz: "):
            io.read(path)


def test_no_room_to_unpack_is_not_blamed_on_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.vtk.gz"
    path.write_bytes(gzip.compress(b"# vtk DataFile Version 3.0\n" + bytes(10_000)))

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("shutil.copyfileobj", fail)
    with pytest.raises(ReadError, match=r"no space left on .* while writing"):
        io.read(path)
