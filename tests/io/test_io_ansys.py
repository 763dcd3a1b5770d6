"""ANSYS archives: elements with repeated nodes, nodes at the middle of edges, columns without blanks, components."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.cells import SHAPES
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh
from meshgauge.mesh.labels import labels_of
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


PATTERNS = [(0, 1, 2, 3, 4, 5, 6, 7), (0, 1, 2, 2, 4, 5, 6, 6), (0, 1, 2, 3, 4, 4, 4, 4), (0, 1, 2, 2, 4, 4, 4, 4)]


@pytest.mark.parametrize("n_nodes", [8, 20])
@pytest.mark.parametrize("pattern", PATTERNS, ids=str)
def test_a_collapsed_brick_stays_the_brick_of_the_file(tmp_path: Path, pattern: tuple[int, ...], n_nodes: int) -> None:
    points, nodes = brick(pattern)
    own = nodes[:n_nodes]
    mesh = io.read(archive(tmp_path / "a.cdb", points, [(1, own)], types="ET,1,186\n"))
    assert mesh.type_counts() == {"hexahedron" if n_nodes == 8 else "hexahedron20": 1}
    assert mesh.point_data["label"][mesh.nodes(0)].tolist() == list(own)
    assert mesh.cell_data["label"].tolist() == [11]
    assert mesh.n_points == len(points)
    assert mesh.notes == ()


def test_nodes_that_are_left_out_are_in_the_middle_of_their_edges(tmp_path: Path) -> None:
    for pattern in PATTERNS:
        points, nodes = brick(pattern)
        whole = archive(tmp_path / "a.cdb", points, [(1, nodes)], types="ET,1,186\n")
        some = tuple(0 if k in (9, 12, 19) else n for k, n in enumerate(nodes))
        part = archive(tmp_path / "b.cdb", points, [(1, some)], types="ET,1,186\n")
        a, b = io.read(whole), io.read(part)
        assert b.type_counts() == {"hexahedron20": 1}
        np.testing.assert_allclose(b.points[b.nodes(0)], a.points[a.nodes(0)], atol=1e-12)
        n_new = b.n_points - a.n_points
        assert b.point_data["label"][a.n_points :].tolist() == [-1] * n_new
        assert (f"{n_new} node" in "".join(b.notes)) == (n_new > 0)
    tetra = [1, 2, 4, 5, 0, 0, 0, 0, 0, 6]
    points = np.concatenate([CUBE[:5], [[0, 0.5, 0.5]]])
    mesh = io.read(archive(tmp_path / "a.cdb", points, [(1, tuple(tetra)), (1, (1, 2, 4, 5))], types="ET,1,187\n"))
    assert mesh.type_counts() == {"tetra": 1, "tetra10": 1}
    x = mesh.points[mesh.nodes(0)]
    ends = SHAPES["tetra"].edges
    np.testing.assert_allclose(x[4:], [(x[a] + x[b]) / 2 for a, b in ends])
    assert "5 nodes at the middle of edges are not in the file" in mesh.notes[0]


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
        ("TYPE,2", "TYPE,2\nCSYS,5\nN,99,1,1,1", "a node in the coordinate system 5"),
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


CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
PREP = "/PREP7\nET,1,185\n" + "".join(f"N,{n},{x},{y},{z}\n" for n, (x, y, z) in enumerate(CORNERS, 1))
ELEMENT = "E,1,2,3,4,5,6,7,8\n"


def read(folder: Path, text: str) -> Mesh:
    (folder / "a.cdb").write_text(text)
    return io.read(folder / "a.cdb")


def test_what_ngen_and_egen_generate(tmp_path: Path) -> None:
    mesh = read(tmp_path, PREP + "NGEN,3,4,5,8,1,0,0,1\n" + ELEMENT + "EGEN,3,4,1\n")
    assert mesh.type_counts() == {"hexahedron": 3}
    assert mesh.cell_data["label"].tolist() == [1, 2, 3]
    assert meshgauge.measure(mesh).values == pytest.approx(np.ones(3))
    for copies in ("NGEN,2,100,ALL,,,2\nEGEN,2,100,-1,,,5\n", "EGEN,2,100,ALL,,,5,,,,,2,0,0\n"):
        mesh = read(tmp_path, PREP + ELEMENT + copies)
        assert mesh.cell_data["ansys:material"].tolist() == [1, 6]
        assert mesh.points[mesh.nodes(1)].tolist() == [[x + 2, y, z] for x, y, z in CORNERS]
        assert mesh.point_data["label"][mesh.nodes(1)].tolist() == list(range(101, 109))


def test_fill_and_cylindrical_nodes(tmp_path: Path) -> None:
    mesh = read(tmp_path, PREP + "N,12,4,0,0\nFILL,2,12,2,20,1\nCSYS,1\nN,30,2,90,3\n" + ELEMENT)
    where = dict(zip(mesh.point_data["label"].tolist(), mesh.points.tolist(), strict=True))
    assert (where[20], where[21]) == ([2, 0, 0], [3, 0, 0])
    assert where[30] == pytest.approx([0, 2, 3], abs=1e-15)


def test_commands_on_one_line_and_simple_parameters(tmp_path: Path) -> None:
    text = PREP + "*SET,tid,2\nnew = tid*3 ! six\net,tid,187\ntype,tid $ MAT, new $ REAL, 1\nEN,(new+1)*10,1,2,4,5\n"
    mesh = read(tmp_path, text)
    assert mesh.type_counts() == {"tetra": 1}
    assert mesh.cell_data["label"].tolist() == [70]
    assert mesh.cell_data["ansys:material"].tolist() == [6]
    with pytest.raises(ReadError, match=r"line 12: N: 'h' where a number is expected"):
        read(tmp_path, PREP + "*GET,h,NODE,,MXLOC,X\nN,9,h,0,0\n" + ELEMENT)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("*DO,i,1,3\nE,1,2,3,4,5,6,7,8\n*ENDDO\n", r"line 12: E in \*DO of line 11: loops and conditions are not"),
        ("*IF,a,EQ,1,THEN\nN,9,1,1,1\n*ENDIF\n", r"line 12: N in \*IF of line 11"),
        ("*REPEAT,3,1\n", r"line 11: \*REPEAT is not followed"),
        ("*USE,MACRO\n", r"\*USE is not followed"),
        ("VMESH,ALL\n", "VMESH is not followed; write the mesh with CDWRITE"),
        ("NSEL,S,LOC,Z,0\nNGEN,2,10,ALL,,,0,0,1\n", "NGEN of what is selected is not followed"),
        ("NGEN,2,10,1,8,1,0,0,1,2\n", "NGEN with SPACE"),
        ("NGEN,2,10,9,9,1\n", "NGEN refers to node 9, which does not exist"),
        ("EGEN,2,10,7\n", "EGEN refers to element 7, which does not exist"),
        ("NGEN,99999999,10,1,8\n", "nodes and elements generated or copied, more than the 20,000,000"),
        ("/INPUT,gone,inp\n", r"line 11: includes gone\.inp, which does not exist"),
        ("/INPUT,'../a',cdb\n", "which is outside its folder"),
        ("/INPUT,a,cdb\n", "includes this file again"),
    ],
)
def test_what_is_a_language_is_refused_by_name_and_line(tmp_path: Path, lines: str, message: str) -> None:
    with pytest.raises(ReadError, match=message):
        read(tmp_path, PREP + lines + ELEMENT)


def test_loops_and_macros_without_cells_do_not_matter(tmp_path: Path) -> None:
    lines = "*DO,i,1,3\nMP,EX,i,1\n*ENDDO\n*CREATE,m,mac\nE,9,9,9,9\n*END\n*IF,a,EQ,1,EXIT\n/TITLE,a $ sign\n"
    assert read(tmp_path, PREP + lines + ELEMENT).type_counts() == {"hexahedron": 1}


def test_files_that_are_read_in(tmp_path: Path) -> None:
    (tmp_path / "nodes.inp").write_text(PREP + "*SET,k,3\n/EOF\nN,99,0,0\n")
    mesh = read(tmp_path, "/PREP7\n/INPUT,nodes,inp\nMAT,k\n" + ELEMENT)
    assert mesh.n_points == 8
    assert mesh.cell_data["ansys:material"].tolist() == [3]


def test_blocks_of_other_releases(tmp_path: Path) -> None:
    blocks = "/COM,ANSYS RELEASE 2023 R1\n/PREP7\nETBLOCK,        2,        2\n(2i9,19a9)\n"
    blocks += f"{1:9d}{200:9d}{10:9d}" + f"{0:9d}" * 18 + f"\n{2:9d}{187:9d}\n       -1\n"
    blocks += "NBLOCK,6,SOLID,8,8\n(1i7,2i9,6e21.13e3)\n"
    for n, x in enumerate(CORNERS, 1):
        blocks += f"{n:7d}{0:9d}{0:9d}" + "".join(f"{v:21.13e}" for v in x) + "\n"
    blocks += "N,UNBL,LOC,       -1,\nTYPE, 1  $ MAT, 1  $ REAL, 1\nEBLOCK,19,SOLID,1,1\n(19i10)\n"
    blocks += "".join(f"{v:10d}" for v in (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 5, *range(1, 9))) + "\n        -1\n"
    mesh = read(tmp_path, blocks)
    assert mesh.type_counts() == {"hexahedron": 1}
    assert mesh.cell_data["label"].tolist() == [5]
    np.testing.assert_allclose(mesh.points, CORNERS)


@pytest.mark.parametrize(("routine", "n"), [(195, 8), (205, 8), (194, 16), (204, 16)])
def test_gasket_and_cohesive_elements_are_kept_and_marked(tmp_path: Path, routine: int, n: int) -> None:
    nodes = (*range(1, 9), *range(1, 9))[:n]
    mesh = io.read(archive(tmp_path / "a.cdb", CUBE, [(1, tuple(range(1, 9))), (2, nodes)],
                           types=f"ET,1,185\nET,2,{routine}\n"))  # fmt: skip
    assert mesh.type_counts() == {"hexahedron": 2}
    assert mesh.cell_data["interface"].tolist() == [0, 1]


def test_surfaces_of_triangles(tmp_path: Path) -> None:
    elements: Elements = [(1, (1, 2, 3)), (1, (1, 2, 3, 3)), (2, (1, 2, 3, 4, 5, 6)), (1, (1, 2, 3, 4))]
    mesh = io.read(archive(tmp_path / "a.cdb", CUBE, elements, types="ET,1,181\nET,2,2\n"))
    assert mesh.type_counts() == {"triangle": 2, "quad": 1, "triangle6": 1}


@pytest.mark.parametrize(
    "deletion", ["_CDRDOFF=             !reset flag", "*SET,_CDRDOFF", "*SET,_CDRDOFF,", "*SET,_CDRDOFF, "]
)
def test_the_first_lines_of_every_archive_delete_a_parameter(deletion: str, tmp_path: Path) -> None:
    points, nodes = brick((0, 1, 2, 3, 4, 5, 6, 7))
    path = archive(tmp_path / "a.cdb", points, [(1, nodes[:8])])
    head = (
        "/COM,ANSYS RELEASE 2019 R2           BUILD 19.4\n/PREP7\n/NOPR\n/TITLE,\nANTYPE, 2\n"
        f"*IF,_CDRDOFF,EQ,1,THEN     !if solid model was read in\n{deletion}\n"
        "*ELSE              !offset database for the following FE model\nNUMOFF,NODE,      8\n*ENDIF\n"
    )
    path.write_text(head + path.read_text())
    assert io.read(path).type_counts() == {"hexahedron": 1}


def test_the_same_as_by_mapdl_archive(tmp_path: Path) -> None:
    """On the archives that come with it, and on one of ours."""
    mapdl = pytest.importorskip("mapdl_archive")
    points, nodes = brick((0, 1, 2, 3, 4, 5, 6, 7))
    own = archive(tmp_path / "a.cdb", points, [(1, nodes)], types="ET,1,186\n")
    examples = sorted(Path(mapdl.__file__).parent.rglob("*.cdb"))
    assert len(examples) > 2
    for path in (own, *examples):
        theirs, mine = mapdl.Archive(str(path), parse_vtk=False), io.read(path)
        np.testing.assert_allclose(mine.points, theirs.nodes[:, :3], rtol=1e-14)  # it rounds the last digit otherwise
        assert labels_of(mine, "point").tolist() == theirs.nnum.tolist()
        assert labels_of(mine, "cell").tolist() == theirs.enum.tolist()
        for cell, element in enumerate(theirs.elem):
            given = element[10:][element[10:] > 0]
            own_nodes = labels_of(mine, "point")[mine.nodes(cell)]
            assert set(own_nodes.tolist()) == set(given.tolist())
