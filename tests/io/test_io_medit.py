"""Medit: ascii in any layout, binary of all versions, second-order cells, what is left out and what is wrong."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import optional
import pytest
from io_meshes import LINEAR, mesh_of

from meshgauge import io
from meshgauge.cells import BY_NAME
from meshgauge.errors import ReadError
from meshgauge.io.formats.medit import write as medit_write
from meshgauge.mesh import Mesh

TETRA = "Vertices 4\n0 0 0 1\n1 0 0 2\n0 1 0 3\n0 0 1 4\nTetrahedra\n1\n1 2 3 4 9\n"


def ascii_(path: Path, text: str, head: str = "MeshVersionFormatted 2\n\nDimension 3\n", end: str = "End\n") -> Path:
    path.write_text(head + text + end)
    return path


def binary(path: Path, version: int, order: str = "<", end: bool = True) -> Path:
    """One tetrahedron, and corners that are no cells."""
    real, integer, jump = "f" if version == 1 else "d", "q" if version > 3 else "i", "q" if version > 2 else "i"
    data = struct.pack(f"{order}ii", 1, version)

    def put(code: int, body: bytes) -> None:
        nonlocal data
        following = len(data) + 4 + struct.calcsize(jump) + len(body)
        data += struct.pack(f"{order}i{jump}", code, following) + body

    put(3, struct.pack(f"{order}i", 3))
    points = [(0, 0, 0, 1), (1, 0, 0, 2), (0, 1, 0, 3), (0, 0, 1, 4)]
    put(4, struct.pack(f"{order}{integer}", 4) + b"".join(struct.pack(f"{order}3{real}{integer}", *p) for p in points))
    put(13, struct.pack(f"{order}2{integer}", 1, 1))
    put(8, struct.pack(f"{order}6{integer}", 1, 1, 2, 3, 4, 9))
    if end:
        data += struct.pack(f"{order}i{jump}", 54, 0)
    path.write_bytes(data)
    return path


def assert_tetra(mesh: Mesh) -> None:
    assert mesh.type_counts() == {"tetra": 1}
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert mesh.nodes(0).tolist() == [0, 1, 2, 3]
    assert mesh.point_data["medit:ref"].tolist() == [1, 2, 3, 4]
    assert mesh.cell_data["medit:ref"].tolist() == [9]
    assert mesh.notes == ()


@pytest.mark.parametrize("version", [1, 2, 3, 4])
@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_of_all_versions(tmp_path: Path, version: int, order: str) -> None:
    assert_tetra(io.read(binary(tmp_path / "a.meshb", version, order)))


@pytest.mark.parametrize(
    "text",
    [
        TETRA,
        TETRA.replace("\n", " "),
        TETRA.replace("Vertices", "# a comment\nCorners\n1\n1\nVertices").replace("\n", "\r\n"),
        TETRA.replace("0 0 0 1\n", "0.0 0\n0e0 1 # the first\n"),
        TETRA + "RequiredVertices 1\n1\nNormals 1\n0 0 1\n",
    ],
)
def test_ascii_in_any_layout(tmp_path: Path, text: str) -> None:
    assert_tetra(io.read(ascii_(tmp_path / "a.mesh", text)))


def interleaved(n: int = 3) -> Mesh:
    """Cells of all types in turn, which a writer of runs would write as many sections of one keyword."""
    names = ("line", "triangle", "quad", *LINEAR)
    points = mesh_of(*LINEAR, n=2 * n).points
    cells = [(name, [(np.arange(BY_NAME[name].n_nodes or 0) + 5 * k).tolist()]) for k, name in enumerate(names * n)]
    mesh = Mesh.from_arrays(points, cells)
    refs = {"medit:ref": 5 * np.arange(mesh.n_cells) - 7}
    return mesh.replace(cell_data=refs, point_data={"medit:ref": np.arange(mesh.n_points) + 3})


def by_type(mesh: Mesh) -> dict[int, list[tuple[list[int], int]]]:
    """For each type the nodes and the reference of its cells, in their order."""
    table: dict[int, list[tuple[list[int], int]]] = {}
    for cell, (vtk_id, ref) in enumerate(zip(mesh.types.tolist(), mesh.cell_data["medit:ref"].tolist(), strict=True)):
        table.setdefault(vtk_id, []).append((mesh.nodes(cell).tolist(), ref))
    return table


def keywords_of_text(path: Path) -> dict[str, int]:
    """The rows of each section, counted line by line; a keyword that comes twice fails."""
    rows: dict[str, int] = {}
    keyword = ""
    for line in path.read_text().split("\n"):
        if line[:1].isalpha():
            keyword = line.split()[0]
            assert keyword not in rows
            rows[keyword] = 0
        elif len(line.split()) > 1:
            rows[keyword] += 1
    return rows


def keywords_of_binary(path: Path) -> tuple[int, dict[int, int]]:
    """The version, and the rows of each section as its head states them; the sections must fill the file."""
    data = path.read_bytes()
    one, version = struct.unpack_from("<ii", data)
    assert one == 1
    at, rows = 8, {}
    while True:
        code, following = struct.unpack_from("<iq" if version > 2 else "<ii", data, at)
        head = 12 if version > 2 else 8
        if code == 54:
            assert (following, at + head) == (0, len(data))
            return version, rows
        assert code not in rows
        rows[code] = struct.unpack_from("<i", data, at + head)[0]
        at = following


COUNTS = {"Edges": 2, "Triangles": 3, "Quadrilaterals": 4, "Tetrahedra": 4, "Prisms": 6, "Hexahedra": 8, "Pyramids": 5}
CODES = {"Edges": 5, "Triangles": 6, "Quadrilaterals": 7, "Tetrahedra": 8, "Prisms": 9, "Hexahedra": 10, "Pyramids": 49}


@pytest.mark.parametrize("extension", [".mesh", ".meshb"])
@pytest.mark.parametrize("largest", [None, 100], ids=["small", "large"])
def test_one_section_a_keyword(
    tmp_path: Path, extension: str, largest: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    if largest is not None:  # bytes from which on version 3 is written
        monkeypatch.setattr(medit_write, "_LARGEST_VERSION_2", largest)
    mesh = interleaved()
    path = tmp_path / f"a{extension}"
    assert io.write(path, mesh) == ("The format keeps cells by type: their order changed.",)
    if extension == ".mesh":
        counted = keywords_of_text(path)
        assert counted == {"MeshVersionFormatted": 0, "Dimension": 0, "Vertices": mesh.n_points, "End": 0,
                           **dict.fromkeys(COUNTS, 3)}  # fmt: skip
    else:
        version, rows = keywords_of_binary(path)
        assert version == (2 if largest is None else 3)
        assert rows == {3: 3, 4: mesh.n_points, **{CODES[keyword]: 3 for keyword in COUNTS}}
    back = io.read(path)
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.point_data["medit:ref"], mesh.point_data["medit:ref"])
    assert by_type(back) == by_type(mesh)


@pytest.mark.parametrize("extension", [".mesh", ".meshb"])
@pytest.mark.parametrize("reader", ["meshio", "meshioplusplus"])
def test_others_read_what_is_written(tmp_path: Path, extension: str, reader: str) -> None:
    mesh = interleaved()
    path = tmp_path / f"a{extension}"
    io.write(path, mesh)
    source = pytest.importorskip(reader).read(path)
    np.testing.assert_array_equal(source.points, mesh.points)
    expected = by_type(mesh)
    assert len(source.cells) == len(expected)
    for block, refs in zip(source.cells, source.cell_data["medit:ref"], strict=True):
        rows = list(zip(np.asarray(block.data).tolist(), np.ravel(refs).tolist(), strict=True))
        assert rows == expected[BY_NAME[block.type].vtk_id]


def test_gmsh_reads_what_is_written(tmp_path: Path) -> None:
    """It knows text only, and neither wedges nor pyramids."""
    gmsh = optional.gmsh()
    mesh = interleaved()
    io.write(tmp_path / "a.mesh", mesh)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.mesh"))
        found = {
            vtk_id: (gmsh.model.mesh.getElementsByType(gmsh_id)[1] - 1).tolist()
            for gmsh_id, vtk_id in ((1, 3), (2, 5), (3, 9), (4, 10), (5, 12))
        }
    finally:
        gmsh.finalize()
    assert found == {t: [n for nodes, _ in by_type(mesh)[t] for n in nodes] for t in found}


def test_cells_of_one_point_and_references_that_do_not_fit_are_named(tmp_path: Path) -> None:
    mesh = Mesh.from_arrays(np.eye(4, 3), [("vertex", [[0]]), ("tetra", [[3, 0, 1, 2]])])
    mesh = mesh.replace(cell_data={"medit:ref": np.array([1, 2**31])})
    assert io.write(tmp_path / "a.mesh", mesh) == ("1 vertex cell was left out: the format has none.",)
    assert io.read(tmp_path / "a.mesh").cell_data["medit:ref"].tolist() == [2**31]
    assert "could not hold the cell data 'medit:ref'" in " ".join(io.write(tmp_path / "a.meshb", mesh))


def test_sections_that_are_not_known_are_named_and_second_order_cells_kept(tmp_path: Path) -> None:
    rows = " ".join(f"{k} {k * k} {k % 3} 0" for k in range(18))
    text = f"Vertices 18 {rows}\nTetrahedraP2 1 {' '.join(map(str, range(1, 11)))} 5\nWhatsits 1 2 3\n"
    text += f"PrismsP2 1 {' '.join(map(str, range(1, 19)))} 6\n"
    mesh = io.read(ascii_(tmp_path / "a.mesh", text), wedge_order="gmsh")
    assert mesh.type_counts() == {"tetra10": 1, "higher_order_wedge": 1}
    assert mesh.notes == (
        "Of higher_order_wedge cells the corners are in place.",
        "Sections that are not known were left out: whatsits.",
    )


def test_a_file_without_an_end_mark_is_read_with_a_note(tmp_path: Path) -> None:
    mesh = io.read(ascii_(tmp_path / "a.mesh", TETRA, end=""))
    assert mesh.type_counts() == {"tetra": 1}
    assert mesh.notes == ("The file has no end mark; its sections are whole, but some may be missing.",)


def test_two_dimensions(tmp_path: Path) -> None:
    text = "Vertices 3 0 0 0 1 0 0 0 1 0 Triangles 1 1 2 3 0\n"
    mesh = io.read(ascii_(tmp_path / "a.mesh", text, head="MeshVersionFormatted 1 Dimension\n2\n"))
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("text", "end", "message"),
    [
        (TETRA[: TETRA.index("Tetra")], "", "has no cells; it ends before its end mark"),
        (TETRA[:-12], "", "the section tetrahedra does not begin with a number of rows"),
        (TETRA[:-3], "", "the section tetrahedra has 4 numbers for 1 rows of 5"),
        (TETRA.replace("1 2 3 4 9", "1 2 3 4"), "End\n", "the section tetrahedra has 4 numbers for 1 rows of 5"),
        (TETRA.replace("1 2 3 4 9", "1 2 3 5 9"), "End\n", r"refers to vertex 5, which is outside 1\.\.4"),
        (TETRA.replace("1 2 3 4 9", "1 2 3 4.5 9"), "End\n", "the section tetrahedra has a number that is no integer"),
        (TETRA.replace("Vertices 4", "Vertices -4"), "End\n", "does not begin with a number of rows"),
        (TETRA.replace("0 0 1 4", "0 0 1,5 4"), "End\n", "the section vertices holds something else than numbers"),
        (TETRA + TETRA, "End\n", "two sections of vertices"),
        ("Corners 1 1\n", "End\n", "has no vertices"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, end: str, message: str) -> None:
    path = ascii_(tmp_path / "a.mesh", text, end=end)
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("at", "value", "message"),
    [(20, 3, "next is at byte 3"), (24, 10**6, "section 4 is stated|not whole|keyword|rows"), (-1, 0, "truncated")],
)
def test_what_is_wrong_in_a_binary_file_is_said(tmp_path: Path, at: int, value: int, message: str) -> None:
    path = binary(tmp_path / "a.meshb", 2, end=at >= 0)
    data = bytearray(path.read_bytes())
    if at >= 0:
        place = 8 + 12 + (4 if at == 20 else 8)  # of the section of vertices: where the next is, and its rows
        data[place : place + 4] = struct.pack("<i", value)
    path.write_bytes(data)
    with pytest.raises(ReadError, match=message):
        io.read(path)
