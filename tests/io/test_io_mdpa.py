"""Kratos: shapes by names and numbers of nodes, geometries, labels, and names that leave the shape open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME, SHAPES
from meshgauge.errors import ReadError
from meshgauge.io import registry
from meshgauge.mesh import Mesh

VERTICALS_FIRST = {  # Kratos: edges around the bottom, upright ones, around the top
    "hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
}


def nodes(name: str) -> np.ndarray:
    """Points of an ideal cell in Kratos' order, with nodes halfway where it has some."""
    base = name.rstrip("0123456789")
    corners = np.array(SHAPES[base].points, float)
    halves = [(corners[a] + corners[b]) / 2 for a, b in SHAPES[base].edges] if base != name else []
    points = np.concatenate([corners, np.reshape(halves, (-1, 3))])
    edges = BY_NAME[name]
    assert len(points) == edges.n_nodes
    return points[np.argsort(VERTICALS_FIRST[name])] if name in VERTICALS_FIRST else points


def text(*blocks: tuple[str, str, np.ndarray], first: int = 1, more: str = "") -> str:
    """A file of one cell a block: its kind, its name and its points, which have numbers from ``first`` on."""
    rows, bodies, at = [], [], first
    for number, (kind, name, points) in enumerate(blocks, 1):
        ids = range(at, at + len(points))
        rows += [f" {i} {x} {y} {z}\n" for i, (x, y, z) in zip(ids, points.tolist(), strict=True)]
        head = f"{10 * number} {number}" if kind != "Geometries" else f"{10 * number}"
        bodies.append(f"Begin {kind} {name} // a comment\n {head} {' '.join(map(str, ids))} // one\n\nEnd {kind}\n")
        at += len(points)
    return f"Begin ModelPartData\nEnd ModelPartData\nBegin Nodes\n{''.join(rows)}End Nodes\n{''.join(bodies)}{more}"


def read(path: Path, content: str) -> Mesh:
    pytest.importorskip("meshioplusplus")
    path.write_text(content)
    return registry.read_here(registry.FORMATS["mdpa"], path)  # in this process, which is faster


NAMES = [
    ("tetra", "Element3D4N"),
    ("tetra", "SmallDisplacementElement3D4N"),
    ("tetra", "VMS3D"),
    ("tetra", "QSVMS3D4N"),
    ("tetra", "Element3D4N//"),
    ("tetra", "Tetrahedra3D4"),
    ("pyramid", "Element3D5N"),
    ("wedge", "TotalLagrangianElement3D6N"),
    ("wedge", "SolidShellElementSprism3D6N"),
    ("hexahedron", "UpdatedLagrangianElement3D8N"),
    ("hexahedron", "Hexahedra3D8"),
    ("tetra10", "SmallStrainUPwDiffOrderElement3D10N"),
    ("tetra10", "AnyName"),
    ("pyramid13", "Element3D13N"),
    ("wedge15", "Element3D15N"),
    ("hexahedron20", "SmallDisplacementElement3D20N"),
]


@pytest.mark.parametrize(("shape", "name"), NAMES)
def test_solids_are_solids_and_good(tmp_path: Path, shape: str, name: str) -> None:
    mesh = read(tmp_path / "a.mdpa", text(("Elements", name, nodes(shape))))
    assert mesh.type_counts() == {shape: 1}
    quality = meshgauge.measure(mesh)
    linear = shape.rstrip("0123456789")
    corners = Mesh.from_arrays(nodes(shape), [(linear, [list(range(SHAPES[linear].n_nodes))])])
    assert quality.values[0] == pytest.approx(meshgauge.measure(corners).values[0], abs=1e-12)
    assert mesh.notes == ()


@pytest.mark.parametrize("kind", ["Elements", "Conditions"])
@pytest.mark.parametrize(
    ("shape", "name", "n"),
    [
        ("quad", "ShellThinElement3D4N", 4),
        ("quad", "ShellThickCorotationalElement3D4N", 4),
        ("quad", "MembraneElement3D4N", 4),
        ("quad", "SurfaceLoadCondition3D4N", 4),
        ("quad", "Element2D4N", 4),
        ("triangle", "WallCondition3D3N", 3),
        ("line3", "LineLoadCondition3D3N", 3),
        ("line", "CrBeamElement3D2N", 2),
        ("vertex", "NodalConcentratedElement3D1N", 1),
    ],
)
def test_shells_and_conditions_are_no_solids(tmp_path: Path, kind: str, shape: str, name: str, n: int) -> None:
    tetra = ("Elements", "Element3D4N", nodes("tetra"))
    mesh = read(tmp_path / "a.mdpa", text(tetra, (kind, name, nodes("hexahedron")[:n])))
    assert mesh.type_counts() == {"tetra": 1, shape: 1}


def test_conditions_of_any_name_are_faces(tmp_path: Path) -> None:
    tetra = ("Elements", "Element3D4N", nodes("tetra"))
    mesh = read(tmp_path / "a.mdpa", text(tetra, ("Conditions", "ThermalFace", nodes("hexahedron")[:4])))
    assert mesh.type_counts() == {"tetra": 1, "quad": 1}


def test_geometries_are_read_where_there_are_no_elements(tmp_path: Path) -> None:
    geometries = ("Geometries", "Tetrahedra3D4", nodes("tetra")), ("Geometries", "Prism3D6", nodes("wedge"))
    assert read(tmp_path / "a.mdpa", text(*geometries)).type_counts() == {"tetra": 1, "wedge": 1}
    element = ("Elements", "Element3D8N", nodes("hexahedron"))
    assert read(tmp_path / "b.mdpa", text(*geometries, element)).type_counts() == {"hexahedron": 1}


def test_numbers_properties_and_parts_are_kept(tmp_path: Path) -> None:
    part = (
        "Begin SubModelPart Left\n Begin SubModelPartNodes\n 101\n End SubModelPartNodes\n"
        " Begin SubModelPartElements\n 10\n 30\n End SubModelPartElements\nEnd SubModelPart\n"
    )
    tetra, face = nodes("tetra"), nodes("hexahedron")[:3]
    blocks = [("Elements", "A3D4N", tetra), ("Conditions", "B3D3N", face), ("Elements", "C3D8N", nodes("hexahedron"))]
    mesh = read(tmp_path / "a.mdpa", text(*blocks, first=101, more=part))
    assert mesh.type_counts() == {"tetra": 1, "triangle": 1, "hexahedron": 1}
    assert mesh.cell_data["label"].tolist() == [10, 20, 30]
    assert mesh.cell_data["kratos:property"].tolist() == [1, 2, 3]
    assert mesh.cell_data["Left"].tolist() == [1, 0, 1]
    assert mesh.point_data["label"].tolist() == list(range(101, 116))


def test_interface_cells_are_marked(tmp_path: Path) -> None:
    flat = nodes("hexahedron") * [1, 1, 0]
    mesh = read(tmp_path / "a.mdpa", text(("Elements", "UPwSmallStrainInterfaceElement3D8N", flat)))
    assert mesh.cell_data["interface"].tolist() == [1]


@pytest.mark.parametrize(
    ("name", "n", "message"),
    [
        ("CylindricalFluid", 4, "the name CylindricalFluid does not say which shape 4 nodes have"),
        ("Element3D4N", 3, "the name Element3D4N does not say which shape 3 nodes have"),
        ("Tetrahedra3D4", 3, "does not say which shape 3 nodes have"),
        ("Element3D7N", 7, "does not say which shape 7 nodes have"),
    ],
)
def test_a_name_that_leaves_the_shape_open_is_an_error(tmp_path: Path, name: str, n: int, message: str) -> None:
    with pytest.raises(ReadError, match=rf"a\.mdpa, line \d+: .*{message}"):
        read(tmp_path / "a.mdpa", text(("Elements", name, nodes("hexahedron")[:n])))


def test_rows_of_different_length_and_blocks_without_an_end_are_errors(tmp_path: Path) -> None:
    content = text(("Elements", "Element3D4N", nodes("tetra")))
    with pytest.raises(ReadError, match="have 3 to 4 nodes"):
        read(tmp_path / "a.mdpa", content.replace("// one", "\n 11 1 1 2 3"))
    with pytest.raises(ReadError, match="have no end"):
        read(tmp_path / "b.mdpa", content.replace("End Elements", ""))


def test_without_the_library_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "packages" / "meshioplusplus"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("raise ImportError('none')")
    monkeypatch.syspath_prepend(package.parent)
    path = tmp_path / "a.mdpa"
    path.write_text(text(("Elements", "Element3D4N", nodes("tetra"))))
    with pytest.raises(ReadError, match=r"pip install 'meshgauge\[meshioplusplus\]'"):
        io.read(path)


def test_a_file_is_read_by_its_name(tmp_path: Path) -> None:
    pytest.importorskip("meshioplusplus")
    (tmp_path / "a.mdpa").write_text(text(("Elements", "Element3D4N", nodes("tetra"))))
    assert io.read(tmp_path / "a.mdpa").type_counts() == {"tetra": 1}
