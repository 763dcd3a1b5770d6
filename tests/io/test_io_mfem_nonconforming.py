"""MFEM's non-conforming meshes: their leaves, hanging vertices in place. Periodic meshes of surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh

# A cube halved along x, and of its right half the upper part; one element that was removed; sides with attributes.
TREE = """MFEM NC mesh v1.0

# NCMesh supported geometry types:
# CUBE        = 5

dimension
3

# rank attr geom ref_type nodes/children
elements
6
-1 1 5 1 1 2
0 1 5 0 0 8 9 3 4 10 11 7
-1 1 5 4 3 4
0 2 5 0 8 1 2 9 12 13 14 15
0 3 5 0 12 13 14 15 10 5 6 11
-1 1 -1

# attr geom nodes
boundary
2
7 3 0 8 9 3
8 3 12 13 5 10

# vert_id p1 p2
vertex_parents
8
15 9 11
8 0 1
9 3 2
10 4 5
11 7 6
12 8 10
13 1 5
14 2 6

# root element orientation
root_state
1
0

# top-level node coordinates
coordinates
8
3
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1

mfem_mesh_end
"""


def read(tmp_path: Path, text: str) -> Mesh:
    (tmp_path / "a.mesh").write_text(text)
    return io.read(tmp_path / "a.mesh")


@pytest.mark.parametrize("change", [lambda s: s, lambda s: s.replace("\n", "\r\n"),
                                    lambda s: s.split("\nmfem_mesh_end")[0],
                                    lambda s: s.replace("NC mesh v1.0", "NC mesh v1.1"),
                                    lambda s: s.replace("8 0 1\n", "8 0 1 0.5\n")])  # fmt: skip
def test_leaves_are_the_mesh(change: object, tmp_path: Path) -> None:
    mesh = read(tmp_path, change(TREE))  # type: ignore[operator]
    assert mesh.type_counts() == {"hexahedron": 3, "quad": 2}
    assert mesh.cell_data["mfem:attribute"].tolist() == [1, 2, 3, 7, 8]
    assert [block.name for block in mesh.blocks] == ["elements", "boundary"]
    sizes = [np.ptp(mesh.points[mesh.connectivity[8 * k : 8 * k + 8]], axis=0).tolist() for k in range(3)]
    assert sizes == [[0.5, 1, 1], [0.5, 1, 0.5], [0.5, 1, 0.5]]
    assert (meshgauge.measure(mesh).values[:3] > 0).all()
    assert mesh.n_points == 16


def test_a_vertex_that_is_not_halfway(tmp_path: Path) -> None:
    mesh = read(tmp_path, TREE.replace("v1.0", "v1.1").replace("8 0 1\n", "8 0 1 0.25\n"))
    assert np.unique(mesh.points[:, 0]).tolist() == [0, 0.25, 0.375, 0.5, 1]


def test_elements_of_other_processes_are_ghosts(tmp_path: Path) -> None:
    text = TREE.replace("0 3 5 0 12", "1 3 5 0 12").replace("# rank attr", "rank\n0\n\n# rank attr")
    assert read(tmp_path, text).cell_data["vtkGhostType"].tolist() == [0, 0, 1, 0, 0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("8 0 1\n", "8 0 8\n", "hangs on itself, or on too many others"),
        ("8 0 1\n", "8 0 99\n", "vertex 99 has no place"),
        ("12 13 14 15 10 5 6 11", "12 13 14 15 10 5 6 99", "vertex 99 has no place"),
        ("12 13 14 15 10 5 6 11", "12 13 14 15 10 5 6", "7 nodes of a hexahedron, expected 8"),
        ("0 1 5 0 0", "0 1 9 0 0", "element type 9 is not known"),
        ("coordinates\n8", "nodes\nFiniteElementSpace", "a non-conforming mesh that is curved cannot be read"),
        ("coordinates\n8", "coordinates\n9999999999", "9999999999 vertices are stated"),
        ("root_state", "root_stat", "section 'root_stat' is not known"),
        ("elements\n6", "elements\n7", "7 elements are stated|something else than integers"),
        ("coordinates\n8\n3", "coordinates\n8\n7", "vertices of 7 coordinates"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, message: str, tmp_path: Path) -> None:
    assert old in TREE
    with pytest.raises(ReadError, match=message):
        read(tmp_path, TREE.replace(old, new))


def periodic(order: int) -> str:
    """Two squares side by side whose outer edges are one: each has its own nodes."""
    steps = np.linspace(0, 1, order + 1)
    nodes = "".join(f"{x + k} {y}\n" for k in range(2) for y in steps for x in steps)
    return (
        "MFEM mesh v1.0\n\ndimension\n2\n\nelements\n2\n1 3 0 1 3 2\n1 3 1 0 2 3\n\nboundary\n1\n1 1 0 1\n\n"
        "vertices\n4\n\nnodes\n"
        f"FiniteElementSpace\nFiniteElementCollection: L2_T1_2D_P{order}\nVDim: 2\nOrdering: 1\n\n{nodes}"
    )


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_periodic_surfaces_have_a_point_for_each_place(order: int, tmp_path: Path) -> None:
    mesh = read(tmp_path, periodic(order))
    assert mesh.type_counts() == {"quad": 2, "line": 1}
    corners = mesh.points[mesh.connectivity[:8]].reshape(2, 4, 3)
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    np.testing.assert_array_equal(corners, [square, square + np.array([1, 0, 0])])
    assert mesh.n_points == 6


def test_the_same_as_by_mfem(tmp_path: Path) -> None:
    """Of random refinements of each shape, and of periodic boxes: vertices, elements and the volume."""
    mfem = pytest.importorskip("mfem.ser")
    pyvista = pytest.importorskip("pyvista")
    kinds = ("HEXAHEDRON", "TETRAHEDRON", "WEDGE")
    whole = [mfem.Mesh.MakeCartesian3D(2, 2, 2, getattr(mfem.Element, kind)) for kind in kinds]
    for one in whole:
        one.EnsureNCMesh(True)
        one.RandomRefinement(0.4)
        one.RandomRefinement(0.4)
    box = mfem.Mesh.MakeCartesian3D(4, 4, 4, mfem.Element.HEXAHEDRON, 1.0, 1.0, 1.0)
    moves = [mfem.Vector([1.0, 0.0, 0.0]), mfem.Vector([0.0, 1.0, 0.0])]
    box = mfem.Mesh.MakePeriodic(box, box.CreatePeriodicVertexMapping(moves))
    for number, one in enumerate((*whole, box)):
        path = tmp_path / f"{number}.mesh"
        one.Print(str(path))
        mesh = io.read(path)
        n = one.GetNE()
        assert mesh.n_cells == n + one.GetNBE()
        assert mesh.n_points == (one.GetNV() if number < 3 else 125)
        assert (meshgauge.measure(mesh).values[:n] > 0).all()
        sizes = np.abs(pyvista.wrap(mesh.to_pyvista()).compute_cell_sizes()["Volume"][:n])
        np.testing.assert_allclose(np.sort(sizes), np.sort([one.GetElementVolume(k) for k in range(n)]), rtol=1e-9)
