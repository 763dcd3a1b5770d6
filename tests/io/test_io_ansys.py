"""ANSYS archives: elements with repeated nodes, nodes at the middle of edges, columns without blanks, components."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meshgauge import io
from meshgauge.cells import SHAPES
from meshgauge.errors import ReadError
from meshgauge.io.formats.ansys.cells import BRICKS, CODES, KINDS, quadratic
from meshgauge.mesh.regions import regions

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
EDGES = SHAPES["hexahedron"].edges
Elements = list[tuple[int, tuple[int, ...]]]


def archive(path: Path, points: np.ndarray, elements: Elements, more: str = "", types: str = "ET,1,185\n") -> Path:
    """An archive of elements of (type number, nodes); their numbers start at 11, their materials are 1, 2, 1, 2..."""
    text = "/PREP7\n" + types + f"NBLOCK,6,SOLID,{len(points)},{len(points)}\n(3i8,6e20.13)\n"
    for number, x in enumerate(points, 1):
        text += f"{number:8d}{0:8d}{0:8d}" + "".join(f"{v:20.13e}" for v in x) + "\n"
    text += f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{len(elements)},{len(elements)}\n(19i8)\n"
    for n, (kind, nodes) in enumerate(elements):
        row = [1 + n % 2, kind, 1, 1, 0, 0, 0, 0, len(nodes), 0, 11 + n, *nodes]
        text += "".join(f"{v:8d}" for v in row[:19]) + "\n"
        text += "".join(f"{v:8d}" for v in row[19:]) + "\n" * (len(nodes) > 8)
    path.write_text(text + "      -1\n" + more)
    return path


def brick(pattern: tuple[int, ...]) -> tuple[np.ndarray, tuple[int, ...]]:
    """Points and the 20 nodes of a cube that is collapsed as a pattern says, about the middle of what coincides."""
    corners = np.array([CUBE[[d for d in range(8) if pattern[d] == p]].mean(axis=0) for p in pattern])
    points, nodes = [*corners], [p + 1 for p in pattern]
    middles: dict[frozenset[int], int] = {}
    for a, b in EDGES:
        key = frozenset((nodes[a], nodes[b]))
        if len(key) == 2 and key not in middles:
            points.append((corners[a] + corners[b]) / 2)
            middles[key] = len(points)
        nodes.append(middles[key] if len(key) == 2 else nodes[a])
    return np.array(points), tuple(nodes)


@pytest.mark.parametrize("is_curved", [False, True])
@pytest.mark.parametrize("pattern", BRICKS, ids=str)
def test_a_collapsed_brick_is_a_right_handed_cell_with_its_middles(
    tmp_path: Path, pattern: tuple[int, ...], is_curved: bool
) -> None:
    points, nodes = brick(pattern)
    mesh = io.read(archive(tmp_path / "a.cdb", points, [(1, nodes[: 20 if is_curved else 8])], types="ET,1,186\n"))
    name = BRICKS[pattern].name
    assert mesh.type_counts() == {quadratic(name) if is_curved else name: 1}
    shape, own = SHAPES[name], mesh.points[mesh.nodes(0)]
    assert all(np.linalg.det(own[[i, j, k]] - own[a]) > 0 for a, i, j, k in shape.triples)
    if is_curved:
        middles = {tuple(own[a] + own[b]) for a, b in shape.edges}
        assert {tuple(2 * x) for x in own[shape.n_nodes :]} == middles
    assert ("repeated nodes" in "".join(mesh.notes)) == (name != "hexahedron")


def test_nodes_at_the_middle_are_in_the_order_of_vtk() -> None:
    """As the table says which: PyVista's quadratic cells have the same edges in the same order."""
    import pyvista

    for name, vtk in (("tetra", "QUADRATIC_TETRA"), ("pyramid", "QUADRATIC_PYRAMID"), ("wedge", "QUADRATIC_WEDGE")):
        found = next(c for p, c in BRICKS.items() if c.name == name)
        k, n = SHAPES[name].n_nodes, KINDS[CODES[quadratic(name)]].n_nodes
        corners, middles = found.nodes[:k], found.nodes[k:n]
        pattern = next(p for p, c in BRICKS.items() if c is found)
        grid = pyvista.UnstructuredGrid({getattr(pyvista.CellType, vtk): np.arange(n)[None]}, np.zeros((n, 3)))
        cell = grid.get_cell(0)
        for e in range(cell.n_edges):
            a, b, middle = cell.edges[e].point_ids
            ends = {pattern[i] for i in EDGES[middles[middle - k] - 8]}
            assert ends == {pattern[corners[a]], pattern[corners[b]]}, (name, e)


def test_an_impossible_brick_is_an_error(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.cdb", CUBE, [(1, (1, 1, 1, 1, 5, 6, 5, 6))])
    with pytest.raises(ReadError, match=r"a\.cdb: element 11 repeats its nodes \[1, 1, 1, 1, 5"):
        io.read(path)


def test_numbers_that_touch_and_a_tetrahedron_without_its_middles(tmp_path: Path) -> None:
    points = -1e-3 * CUBE[:5]  # 20 characters each: no blank is between them
    path = archive(tmp_path / "a.cdb", points, [(1, (1, 2, 4, 5)), (1, (1, 2, 4, 5, *[0] * 6))], types="ET,1,187\n")
    assert b"e-03-1" in path.read_bytes()
    mesh = io.read(path)
    np.testing.assert_allclose(mesh.points, points)
    assert mesh.type_counts() == {"tetra": 2}
    assert mesh.connectivity.tolist() == [0, 1, 3, 4] * 2


def test_materials_are_regions_and_components_are_data(tmp_path: Path) -> None:
    elements: Elements = [(1, tuple(range(1, 9)))] * 4
    more = "CMBLOCK,ROTOR   ,ELEM,       3  ! of elements\n(8i10)\n        11       -12        14\n"
    more += "CMBLOCK,FIXED,NODE,       1\n(8i10)\n         1\n"
    mesh = io.read(archive(tmp_path / "a.cdb", CUBE, elements, more))
    assert mesh.cell_data["ROTOR"].tolist() == [1, 1, 0, 1]
    assert "FIXED" not in mesh.cell_data
    ids, names = regions(mesh)
    assert [names[i] for i in ids] == ["material 1", "material 2"] * 2


def test_contacts_are_counted_and_other_types_are_errors(tmp_path: Path) -> None:
    elements: Elements = [(1, tuple(range(1, 9))), (2, (1, 2, 3, 4)), (3, (1, 2, 3, 3)), (4, (1, 2))]
    types = "ET,1,SOLID185\nET,2,174\nET,3,181\nET,4,188\n"
    mesh = io.read(archive(tmp_path / "a.cdb", CUBE, elements, types=types))
    assert mesh.type_counts() == {"line": 1, "triangle": 1, "hexahedron": 1}
    assert any("1 of type 174" in note for note in mesh.notes)
    with pytest.raises(ReadError, match="not known: 1 of type 999"):
        io.read(archive(tmp_path / "b.cdb", CUBE, elements, types=types.replace("174", "999")))
    with pytest.raises(ReadError, match="type number 2, which no ET defines"):
        io.read(archive(tmp_path / "b.cdb", CUBE, elements, types=types.replace("ET,2,174\n", "")))


def test_the_input_that_workbench_writes(tmp_path: Path) -> None:
    path = tmp_path / "ds.dat"
    points = "".join(f"{n:9d}" + "".join(f"{v:20.9e}" for v in x) + "\n" for n, x in enumerate(CUBE, 1))
    path.write_text(
        f"/com,*********** Nodes\n/prep7\nnblock,3,,8\n(1i9,3e20.9e3)\n{points}-1\net,1,285\ntype,1\n"
        "eblock,10,,,1\n(15i9)\n" + "".join(f"{v:9d}" for v in (7, 1, 1, 3, 0, 1, 2, 4, 5)) + "\n-1\nen,8,1,2,4,5\n"
    )
    mesh = io.read(path)
    assert mesh.type_counts() == {"tetra": 2}
    assert mesh.nodes(1).tolist() == [0, 1, 3, 4]
    assert mesh.cell_data["ansys:material"].tolist() == [3, 1]


def test_nodes_and_elements_given_one_by_one(tmp_path: Path) -> None:
    points, nodes = brick(tuple(range(8)))
    commands = "/PREP7\nET,1,186\nET,2,187\n" + "".join(f"N,{n},{x},{y},{z}\n" for n, (x, y, z) in enumerate(points, 1))
    first = ",".join(map(str, nodes[:8]))
    commands += f"MAT,5\nE,{first}\nEMORE,{','.join(map(str, nodes[8:16]))}\nEMORE,{','.join(map(str, nodes[16:]))}\n"
    commands += "TYPE,2\nMAT,6\nEN,77,1,2,4,5 ! a tetrahedron\nMPTEMP\n"
    unblocked = "/PREP7\nET,1,186\nET,2,187\n" + "".join(
        f"N,R5.3,LOC,{n:9d},0,0,{x},{y},{z}\nN,R5.3,ANG,{n:9d},0,0,1.0\n" for n, (x, y, z) in enumerate(points, 1)
    )
    unblocked += "N,R5.3,LOC,       -1,\nEN,R5.5,ATTR, 20,5,1,1,1,0,1,0,0,0\n" + "".join(
        f"EN,R5.5,NODE,{','.join(map(str, nodes[at : at + 8]))}\n" for at in (0, 8, 16)
    )
    unblocked += "EN,R5.5,ATTR,4,6,2,1,1,0,77,0,0,0\nEN,R5.5,NODE,1,2,4,5\nEN,R5.5,ATTR,-1\n"
    for text in (commands, unblocked):
        path = tmp_path / "a.cdb"
        path.write_text(text)
        mesh = io.read(path)
        assert mesh.type_counts() == {"tetra": 1, "hexahedron20": 1}
        np.testing.assert_array_equal(mesh.points, points)
        assert mesh.nodes(0).tolist() == [n - 1 for n in nodes]
        assert mesh.nodes(1).tolist() == [0, 1, 3, 4]
        assert mesh.cell_data["ansys:material"].tolist() == [5, 6]
    for old, new, message in (
        ("TYPE,2", "TYPE,2\nCSYS,1\nN,99,1,1,1", "a node in the coordinate system 1"),
        ("EN,77,1,2,4,5", "EN,77,1,2,4,x", "'x' where an integer is expected"),
        ("N,1,0", "N,1,o", "'o.0' where a number is expected"),
        ("TYPE,2", "EMORE,1,2,3", "element 1 has 23 nodes, expected 1 to 20"),
    ):
        assert old in commands
        path.write_text(commands.replace(old, new, 1))
        with pytest.raises(ReadError, match=message):
            io.read(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("EBLOCK,19,SOLID,1,1", "EBLOCK,19,SOLID,1,7", "line 16: 7 elements are stated, but 1 were read"),
        ("(19i8)", "(oops)", r"line 15: '\(oops\)' where the format of a block is expected"),
        ("       8\n      -1", "      99\n      -1", "element 11 refers to node 99, which does not exist"),
        ("1.0000000000000e+00", "1.00000000000x0e+00", "something else than numbers of 20 columns"),
    ],
)
def test_what_is_wrong_is_said_with_the_place(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = archive(tmp_path / "a.cdb", CUBE, [(1, tuple(range(1, 9)))])
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)


def test_every_pattern_is_that_of_its_cell() -> None:
    """The faces of the brick that are left are the faces of the cell."""
    for pattern, found in BRICKS.items():
        assert len(set(pattern)) == SHAPES[found.name].n_nodes
        left = {frozenset(pattern[i] for i in face) for face in SHAPES["hexahedron"].faces}
        faces = {frozenset(pattern[found.nodes[i]] for i in face) for face in SHAPES[found.name].faces}
        assert faces == {face for face in left if len(face) > 2}
