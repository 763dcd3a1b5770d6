"""Gmsh's format beyond the plain round trip."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import optional
import pytest
from io_meshes import LINEAR, assert_same_cells, mesh_of

from meshgauge import io
from meshgauge.cells import BY_NAME, BY_NODES
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


@pytest.mark.parametrize(("n_nodes", "order"), [(20, 3), (35, 4), (64, 3), (125, 4)])
def test_nodes_above_second_order_are_in_the_order_of_vtk(n_nodes: int, order: int) -> None:
    kind = next(row for row in BY_ID.values() if row.n_nodes == n_nodes and row.name in _ABOVE)
    theirs = reference_nodes(kind.name, n_nodes)
    ours = np.array(BY_NODES[BY_NAME[kind.name].vtk_id, n_nodes].places) / order
    np.testing.assert_allclose(ours, affine(theirs, ours), atol=1e-12)


_ABOVE = ("lagrange_tetra", "lagrange_hexahedron")


@pytest.mark.parametrize("name", ["pyramid13", "lagrange_pyramid"])
def test_nodes_of_pyramids_are_in_the_order_of_vtk(name: str) -> None:
    at = reference_nodes(name)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)]
    np.testing.assert_allclose(at[5:13], [(at[a] + at[b]) / 2 for a, b in edges], atol=1e-12)
    np.testing.assert_allclose(at[13:], np.repeat([at[:4].mean(axis=0)], len(at) - 13, axis=0), atol=1e-12)


def reference_nodes(name: str, size: int | None = None) -> np.ndarray:
    """Reference nodes of Gmsh's second-order cell of that name (or of so many nodes), put in our order."""
    gmsh = optional.gmsh()
    kind = next(row for row in BY_ID.values() if row.name == name and size in (None, row.n_nodes))
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
    gmsh = optional.gmsh()
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
    with pytest.raises(ReadError, match=rf"a\.msh.*: .*({message})"):
        io.read(tmp_path / "a.msh")


OLDER = {
    "1": "$NOD\n4\n7 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n2\n1 4 5 6 4 7 2 3 4\n9 2 3 1 3 7 2 3\n$ENDELM\n",
    "2.0": '$MeshFormat\n2.0 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n5 "a body"\n3 "a face"\n$EndPhysicalNames\n'
    "$Nodes\n4\n7 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
    "$Elements\n2\n1 4 3 5 6 0 7 2 3 4\n9 2 3 3 1 0 7 2 3\n$EndElements\n",
    "4.0": '$MeshFormat\n4 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 5 "a body"\n2 3 "a face"\n$EndPhysicalNames\n'
    "$Entities\n1 0 1 1\n8 0 0 0 0 0 0 0\n1 0 0 0 1 1 1 1 3 0\n6 0 0 0 1 1 1 1 5 1 1\n$EndEntities\n"
    "$Nodes\n2 4\n8 0 0 1\n7 0 0 0\n1 2 1 3\n2 1 0 0 .5 .5\n3 0 1 0 .5 .5\n4 0 0 1 .5 .5\n$EndNodes\n"
    "$Elements\n2 2\n6 3 4 1\n1 7 2 3 4\n1 2 2 1\n9 7 2 3\n$EndElements\n",
}


@pytest.mark.parametrize("version", OLDER)
def test_older_versions_are_read(version: str, tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_text(OLDER[version])
    mesh = io.read(path)
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert [mesh.nodes(cell).tolist() for cell in range(2)] == [[0, 1, 2, 3], [0, 1, 2]]
    assert mesh.cell_data["gmsh:physical"].tolist() == [5, 3]
    assert mesh.cell_data["gmsh:geometrical"].tolist() == [6, 1]
    names = {name: values.tolist() for name, values in mesh.field_data.items()}
    assert names == ({} if version == "1" else {"a body": [5, 3], "a face": [3, 2]})
    assert mesh.notes == ()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("parametric", [0, 1])
@pytest.mark.parametrize(("version", "binary"), [(1, 0), (2.2, 0), (2.2, 1), (4.0, 0), (4.1, 1)])
def test_what_gmsh_writes_in_each_version(
    version: float, binary: int, parametric: int, order: int, tmp_path: Path
) -> None:
    """Two boxes with groups, of tetrahedra, against what Gmsh itself holds."""
    gmsh = optional.gmsh()
    path = tmp_path / "a.msh"
    gmsh.initialize(interruptible=False)
    try:
        for option, value in {
            "General.Terminal": 0,
            "Mesh.MeshSizeMin": 0.5,
            "Mesh.MshFileVersion": version,
            "Mesh.Binary": binary,
            "Mesh.SaveParametric": parametric,
        }.items():
            gmsh.option.setNumber(option, value)
        for x in (0, 1):
            gmsh.model.occ.addBox(x, 0, 0, 1, 1, 1)
        gmsh.model.occ.fragment([(3, 1)], [(3, 2)])
        gmsh.model.occ.synchronize()
        for tag, name in ((7, "left"), (8, "right")):
            gmsh.model.addPhysicalGroup(3, [tag - 6], tag, name)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
        tags, flat, _ = gmsh.model.mesh.getNodes(includeBoundary=True)
        points = dict(zip(tags.tolist(), np.reshape(flat, (-1, 3)).tolist(), strict=False))
        held = {7: [], 8: []}
        for tag in held:
            _, _, (nodes,) = gmsh.model.mesh.getElements(3, tag - 6)
            rows = np.reshape(nodes, (-1, 4 if order == 1 else 10))[:, :4]
            held[tag] = sorted([points[n] for n in row] for row in rows.tolist())
    finally:
        gmsh.finalize()
    mesh = io.read(path)
    assert mesh.type_counts() == {"tetra" if order == 1 else "tetra10": sum(map(len, held.values()))}
    for tag, cells in held.items():
        own = np.flatnonzero(mesh.cell_data["gmsh:physical"] == tag)
        ours = sorted(mesh.points[mesh.nodes(cell)[:4]].tolist() for cell in own)
        np.testing.assert_allclose(ours, cells, atol=1e-12)
    if version > 1:
        assert {name: values.tolist() for name, values in mesh.field_data.items()} == {"left": [7, 3], "right": [8, 3]}


@pytest.mark.parametrize(
    ("version", "old", "new", "message"),
    [
        ("1", "$NOD\n4", "$NOD\n5", "5 nodes are stated, 4 lines given"),
        ("1", "$ELM\n2", "$ELM\n3", "3 elements are stated, 2 read"),
        ("1", "1 4 5 6 4", "1 4 5 6 3", "an element of type tetra has 3 nodes, expected 4"),
        ("4.0", "1 2 1 3\n", "1 2 1 30\n", "a block of 30 nodes of 6 numbers"),
        ("4.0", "$Nodes\n2 4", "$Nodes\n1 4", "the blocks of nodes hold 10 numbers, 32 are given"),
        ("4.0", "4 0 8", "4 1 8", "binary files of version 4.0 are not read"),
        ("2.0", "2.0 0 8", "3.0 0 8", "version 3.0 with numbers of 8 bytes is not known"),
        ("2.0", '5 "a body"', 'five "a body"', "a physical name is not of the form"),
    ],
)
def test_what_is_wrong_in_older_versions_is_said(
    version: str, old: str, new: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.msh"
    assert old in OLDER[version]
    path.write_text(OLDER[version].replace(old, new))
    with pytest.raises(ReadError, match=message):
        io.read(path)
