"""OpenVolumeMesh: any cells, whichever side the writer has outside; an inverted cell stays inverted."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of
from ovm_files import chunk, ovm, ovmb

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError


@pytest.mark.parametrize("is_inside_out", [False, True])
@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("real", ["<f4", "<f8"])
def test_binary_files_hold_the_same(tmp_path: Path, is_inside_out: bool, parts: int, real: str) -> None:
    mesh = mesh_of(*LINEAR, "penta_prism", n=12)  # more than 256 points and half-faces
    ascii_, binary = (
        io.read(ovm(tmp_path / "a.ovm", mesh, is_inside_out)),
        io.read(ovmb(tmp_path / "a.ovmb", mesh, is_inside_out, parts, real)),
    )
    assert mesh.n_points > 256
    assert binary.type_counts() == {"tetra": 12, "pyramid": 12, "wedge": 12, "hexahedron": 12, "polyhedron": 12}
    np.testing.assert_array_equal(binary.types, ascii_.types)
    np.testing.assert_array_equal(binary.connectivity, ascii_.connectivity)
    np.testing.assert_allclose(binary.points, mesh.points, rtol=1e-6)
    assert binary.polyhedra is not None
    assert ascii_.polyhedra is not None
    np.testing.assert_array_equal(binary.polyhedra.face_points, ascii_.polyhedra.face_points)
    assert binary.cell_data["region"].tolist() == [7, *range(1, mesh.n_cells)]  # the first has the default
    assert binary.cell_data["odd"].tolist() == [bool(i % 2) for i in range(mesh.n_cells)]
    np.testing.assert_array_equal(binary.point_data["force"], mesh.points)
    assert binary.notes == ("Properties that are no numbers of vertices or cells were left out: of edges, label.",)


def test_properties_of_ascii_files(tmp_path: Path) -> None:
    path = ovm(tmp_path / "a.ovm", mesh_of("tetra", n=2))
    more = 'CProp int "region"\n4\n5\nMProp string "s"\n4\ntext\nVProp vec3d "u"\n' + "0 1 .5\n" * 8
    path.write_text(path.read_text() + more + 'Cell_Property double "q"\n0.5\n1\n')
    mesh = io.read(path)
    assert mesh.cell_data["region"].tolist() == [4, 5]
    assert mesh.cell_data["q"].tolist() == [0.5, 1]
    assert mesh.point_data["u"].tolist() == [[0, 1, 0.5]] * 8
    assert mesh.notes == ("Properties that are no numbers of vertices or cells were left out: s.",)
    path.write_text(path.read_text().replace("4\n5\nMProp", "4\nMProp"))
    with pytest.raises(ReadError, match="values of the property 'region' hold something else"):
        io.read(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"EOF ", b"EOG ", "a chunk b'EOG ' of version 0"),
        (chunk(b"EOF "), b"", "ends before its end mark; it is truncated"),
        (b"VERT\0", b"VERT\1", "a chunk b'VERT' of version 1"),
        (struct.pack("<QQQ", 6, 4, 1), struct.pack("<QQQ", 6, 4, 2), r"states \[4, 6, 4, 2\] vertices, edges, faces"),
        (struct.pack("<QQQ", 6, 4, 1), struct.pack("<QQQ", 6, 4, 2**60), "but the file has"),
        (struct.pack("<QIB3x", 0, 4, 2), struct.pack("<QIB3x", 0, 4, 3), "encoding that is not known"),
        (struct.pack("<QIB3x", 0, 4, 2), struct.pack("<QIB3x", 1, 3, 2), "vertices 1 to 4 after 0 of 4"),
        (struct.pack("<QI4B", 0, 6, 1, 2, 0, 1), struct.pack("<QI4B", 0, 6, 1, 9, 0, 1), "edges of 9 ends"),
        (
            struct.pack("<QI4BQ", 0, 4, 2, 3, 0, 1, 0),
            struct.pack("<QI4BQ", 0, 4, 2, 3, 0, 1, 90),
            "refers to half-edge",
        ),
    ],
)
def test_what_is_wrong_in_a_binary_file_is_said(tmp_path: Path, old: bytes, new: bytes, message: str) -> None:
    path = ovmb(tmp_path / "a.ovmb", mesh_of("tetra", n=1))
    data = path.read_bytes()
    assert data.count(old) == 1
    path.write_bytes(data.replace(old, new))
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("is_inside_out", [False, True])
def test_cells_come_back_and_the_mirrored_one_is_inverted(tmp_path: Path, is_inside_out: bool) -> None:
    mesh = mesh_of(*LINEAR, "penta_prism", n=3)
    points = mesh.points.copy()
    first = mesh.nodes(0)
    points[first, 2] *= -1  # a tetrahedron that is inverted, its numbering as it was
    back = io.read(ovm(tmp_path / "a.ovm", mesh.replace(points=points), is_inside_out))
    expected = np.where(mesh.types == 15, 42, mesh.types)
    assert back.types.tolist() == expected.tolist()
    values = meshgauge.measure(back).values
    assert values[0] == pytest.approx(-1)
    assert values[1:] == pytest.approx(np.ones(len(values) - 1))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Faces\n", "Fases\n", "'Fases' where the section faces is expected"),
        ("Edges\n6", "Edges\n7", "edges hold something else than integers"),
        ("Edges\n6", "Edges\n999", "999 edges are stated, but"),
        ("Polyhedra\n1\n4 ", "Polyhedra\n1\n5 ", "does not hold as many half-faces as it states"),
        ("OVM ASCII", "OVM BINARY", "never defined; its binary format is .ovmb"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = ovm(tmp_path / "a.ovm", mesh_of("tetra", n=1))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)
