"""Medit: ascii in any layout, binary of all versions, second-order cells, what is left out and what is wrong."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, assert_same_cells, mesh_of

from meshgauge import io
from meshgauge.errors import ReadError
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


@pytest.mark.parametrize("extension", [".mesh", ".meshb"])
def test_all_types_come_back(tmp_path: Path, extension: str) -> None:
    mesh = mesh_of(*LINEAR)
    io.write(tmp_path / f"a{extension}", mesh)
    back = io.read(tmp_path / f"a{extension}")
    assert_same_cells(mesh.replace(points=back.points), back)
    np.testing.assert_allclose(back.points, mesh.points, rtol=1e-15)


def test_sections_that_are_not_known_are_named_and_second_order_cells_kept(tmp_path: Path) -> None:
    rows = " ".join(f"{k} {k * k} {k % 3} 0" for k in range(18))
    text = f"Vertices 18 {rows}\nTetrahedraP2 1 {' '.join(map(str, range(1, 11)))} 5\nWhatsits 1 2 3\n"
    text += f"PrismsP2 1 {' '.join(map(str, range(1, 19)))} 6\n"
    mesh = io.read(ascii_(tmp_path / "a.mesh", text), wedge_order="gmsh")
    assert mesh.type_counts() == {"tetra10": 1, "lagrange_wedge": 1}
    assert mesh.notes == (
        "Of lagrange_wedge cells the corners are in place.",
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
