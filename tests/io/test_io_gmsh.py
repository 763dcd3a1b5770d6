"""Gmsh's format beyond the plain round trip."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, assert_same_cells, mesh_of

from meshgauge import io
from meshgauge.cells import BY_NAME
from meshgauge.errors import ReadError
from meshgauge.io.formats.gmsh.cells import BY_ID

VTK_CELLS = {
    "line": "vtkLine",
    "triangle": "vtkTriangle",
    "quad": "vtkQuad",
    "tetra": "vtkTetra",
    "hexahedron": "vtkHexahedron",
    "pyramid": "vtkPyramid",
    "line3": "vtkQuadraticEdge",
    "triangle6": "vtkQuadraticTriangle",
    "quad8": "vtkQuadraticQuad",
    "quad9": "vtkBiQuadraticQuad",
    "tetra10": "vtkQuadraticTetra",
    "hexahedron20": "vtkQuadraticHexahedron",
    "hexahedron27": "vtkTriQuadraticHexahedron",
    "wedge15": "vtkQuadraticWedge",
    "wedge18": "vtkBiQuadraticQuadraticWedge",
}


@pytest.mark.parametrize("name", VTK_CELLS)
def test_nodes_are_in_the_order_of_vtk(name: str) -> None:
    """Gmsh's own reference nodes, reordered by our table, against VTK's."""
    from vtkmodules import vtkCommonDataModel as vtk

    theirs = reference_nodes(name)
    assert len(theirs) == BY_NAME[name].n_nodes
    cell = getattr(vtk, VTK_CELLS[name])()
    ours = np.reshape(cell.GetParametricCoords(), (-1, 3))[:, : theirs.shape[1]]
    # One reference cell is from 0 to 1, the other from -1 to 1.
    np.testing.assert_allclose(ours, affine(theirs, ours), atol=1e-12)


@pytest.mark.parametrize("name", ["pyramid13", "lagrange_pyramid"])
def test_nodes_of_pyramids_are_in_the_order_of_vtk(name: str) -> None:
    at = reference_nodes(name)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)]
    np.testing.assert_allclose(at[5:13], [(at[a] + at[b]) / 2 for a, b in edges], atol=1e-12)
    np.testing.assert_allclose(at[13:], np.repeat([at[:4].mean(axis=0)], len(at) - 13, axis=0), atol=1e-12)


def reference_nodes(name: str) -> np.ndarray:
    """Reference nodes of Gmsh's second-order cell of that name, put in our order."""
    gmsh = pytest.importorskip("gmsh")
    kind = next(row for row in BY_ID.values() if row.name == name)
    gmsh.initialize(interruptible=False)
    try:
        _, dimension, _, n_nodes, flat, _ = gmsh.model.mesh.getElementProperties(kind.gmsh_id)
    finally:
        gmsh.finalize()
    assert n_nodes == kind.n_nodes
    nodes = np.reshape(flat, (n_nodes, dimension))
    return nodes[list(kind.order)] if kind.order else nodes


def affine(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Points under the affine map that takes them closest to the target."""
    design = np.c_[points, np.ones(len(points))]
    return design @ np.linalg.lstsq(design, target, rcond=None)[0]


def test_data_tags_and_names_survive(tmp_path: Path) -> None:
    mesh = mesh_of(*LINEAR)
    n, p = mesh.n_cells, mesh.n_points
    rng = np.random.default_rng(2)
    mesh = mesh.replace(
        cell_data={
            "jens": rng.random(n),
            "stress": rng.random((n, 6)),
            "gmsh:physical": np.arange(n),
            "s": np.array(["a"] * n),
        },
        point_data={"u": rng.random((p, 3))},
        field_data={"body": np.array([7, 3]), "time": np.array([0.5])},
    )
    lost = io.write(tmp_path / "a.msh", mesh)
    back = io.read(tmp_path / "a.msh")
    assert_same_cells(mesh, back)
    np.testing.assert_array_equal(back.cell_data["jens"], mesh.cell_data["jens"])
    np.testing.assert_array_equal(back.cell_data["stress"][:, :6], mesh.cell_data["stress"])
    np.testing.assert_array_equal(back.cell_data["gmsh:physical"], np.arange(n))
    np.testing.assert_array_equal(back.point_data["u"], mesh.point_data["u"])
    assert back.field_data["body"].tolist() == [7, 3]
    assert [re.findall(r"'(\w+)'", sentence) for sentence in lost] == [["time"], ["stress"], ["s"]]


def test_gmsh_reads_what_we_write(tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    mesh = mesh_of(*LINEAR)
    io.write(tmp_path / "a.msh", mesh.replace(cell_data={"jens": np.arange(mesh.n_cells) / 8}))
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        types, tags, _ = gmsh.model.mesh.getElements(3)
        assert {int(t): len(k) for t, k in zip(types, tags, strict=True)} == {4: 2, 5: 2, 6: 2, 7: 2}
        quality = gmsh.model.mesh.getElementQualities([int(t) for k in tags for t in k], "minDetJac")
        assert min(quality) > 0
    finally:
        gmsh.finalize()


ASCII_22 = """$Comments
by hand
$EndComments
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
3 5 "a body"
$EndPhysicalNames
$Nodes
5
100 0 0 0
7 1 0 0
8 0 1 0
20 0 0 1
21 0 0 -1
$EndNodes
$Elements
4
11 15 2 0 1 100
12 4 2 5 1 100 7 8 20
13 4 3 5 1 0 100 8 7 21
15 2 2 0 1 100 7 8
$EndElements
$ElementData
1
"q"
1
0.0
3
0
1
2
13 0.5
12 0.25
$EndElementData
"""

ASCII_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
3 5 "all"
3 6 "half"
$EndPhysicalNames
$Entities
1 0 0 2
1 0 0 0 0
1 0 0 0 1 1 1 2 5 6 0
2 0 0 0 1 1 1 1 5 0
$EndEntities
$Nodes
2 5 1 9
0 1 1 1
9
0 0 0
3 1 1 4
1
2
3
4
1 0 0 .1 .2 .3
0 1 0 .1 .2 .3
0 0 1 .1 .2 .3
0 0 -1 .1 .2 .3
$EndNodes
$Elements
2 2 1 2
3 1 4 1
1 9 1 2 3
3 2 4 1
2 9 2 1 4
$EndElements
"""


def test_scattered_tags_and_partial_data(tmp_path: Path) -> None:
    (tmp_path / "a.msh").write_text(ASCII_22)
    mesh = io.read(tmp_path / "a.msh")
    assert mesh.types.tolist() == [1, 10, 10, 5]
    assert mesh.connectivity.tolist() == [0, 0, 1, 2, 3, 0, 2, 1, 4, 0, 1, 2]
    assert mesh.cell_data["gmsh:physical"].tolist() == [0, 5, 5, 0]
    np.testing.assert_array_equal(mesh.cell_data["q"], [np.nan, 0.25, 0.5, np.nan])
    assert mesh.field_data["a body"].tolist() == [5, 3]


def test_entities_become_blocks_and_overlapping_groups_data(tmp_path: Path) -> None:
    (tmp_path / "a.msh").write_text(ASCII_41)
    mesh = io.read(tmp_path / "a.msh")
    assert mesh.connectivity.tolist() == [0, 1, 2, 3, 0, 2, 1, 4]
    np.testing.assert_array_equal(mesh.points[1], [1, 0, 0])
    assert [block.name for block in mesh.blocks] == ["volume 1", "volume 2"]
    assert mesh.cell_data["gmsh:geometrical"].tolist() == [1, 2]
    assert mesh.cell_data["all"].tolist() == [1, 1]
    assert mesh.cell_data["half"].tolist() == [1, 0]


def test_big_endian(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    nodes = np.zeros(4, [("tag", ">i4"), ("x", ">f8", 3)])
    nodes["tag"], nodes["x"][1:] = [1, 2, 3, 4], np.eye(3)
    elements = np.array([4, 1, 2, 1, 0, 0, 1, 2, 3, 4], ">i4")
    path.write_bytes(
        b"$MeshFormat\n2.2 1 8\n\0\0\0\1\n$EndMeshFormat\n"
        + b"$Nodes\n4\n" + nodes.tobytes() + b"\n$EndNodes\n$Elements\n1\n" + elements.tobytes() + b"\n$EndElements\n"
    )  # fmt: skip
    mesh = io.read(path)
    np.testing.assert_array_equal(mesh.points[1:], np.eye(3))
    assert mesh.connectivity.tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("100 7 8 20", "100 7 8 99", "refers to node 99"),
        ("12 4 2 5", "12 77 2 5", "element type 77 is not known"),
        ("$Elements\n4", "$Elements\n5", "5 elements are stated, 4 found"),
        ("$Nodes\n5", "$Nodes\n6", "6 nodes are stated"),
        ("21 0 0 -1", "21 0 zero -1", "section Nodes holds something else"),
        ("2.2 0 8", "9.9 0 8", "version 9.9 is not known|version 9.9 with"),
        ("$EndElements", "$End", "section Elements has no end"),
        ('1\n"q"', '999999999999\n"q"', "999999999999 header lines"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    (tmp_path / "a.msh").write_text(ASCII_22.replace(old, new))
    with pytest.raises(ReadError, match=rf"a\.msh: .*({message})"):
        io.read(tmp_path / "a.msh")
