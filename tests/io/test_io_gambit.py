"""GAMBIT neutral files: all shapes in its order of nodes, groups, lines that go on, and what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh

# Points of a brick row by row, one above it and one beside it.
POINTS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)] + [(0.5, 0.5, 2), (2, 0.5, 0), (2, 0.5, 1)]
CELLS = {"hexahedron": (4, range(8)), "pyramid": (7, (4, 5, 6, 7, 8)), "wedge": (5, (1, 9, 3, 5, 10, 7)),
         "tetra": (6, (1, 9, 3, 5)),
         "quad": (2, (0, 1, 3, 2)), "triangle": (3, (0, 1, 3)), "line": (1, (0, 1))}  # fmt: skip


def neutral(*names: str, more: str = "", dimension: int = 3, first: int = 11) -> str:
    """A file with one cell of each name; labels of points from ``first`` on, of cells by fives."""
    head = (
        "        CONTROL INFO 2.4.6\n** GAMBIT NEUTRAL FILE\nA title\nPROGRAM:  Gambit  VERSION:  2.4.6\n 1 Jan 2020\n"
        f"     NUMNP     NELEM     NGRPS    NBSETS     NDFCD     NDFVL\n{len(POINTS):10d}{len(names):10d}"
        f"         0         0{dimension:10d}{dimension:10d}\nENDOFSECTION\n   NODAL COORDINATES 2.4.6\n"
    )
    points = "".join(f"{n:10d}{''.join(f'{x:20.11e}' for x in p[:dimension])}\n" for n, p in enumerate(POINTS, first))
    rows = ""
    for number, name in enumerate(names, 1):
        code, nodes = CELLS[name]
        words = [f"{n + first:8d}" for n in nodes]
        parts = ["".join(words[at : at + 7]) for at in range(0, len(words), 7)]  # seven a line
        rows += f"{5 * number:8d} {code:2d} {len(words):2d} " + ("\n" + " " * 15).join(parts) + "\n"
    return f"{head}{points}ENDOFSECTION\n      ELEMENTS/CELLS 2.4.6\n{rows}ENDOFSECTION\n{more}"


def read(tmp_path: Path, content: str) -> Mesh:
    path = tmp_path / "a.neu"
    path.write_text(content)
    return io.read(path)


def test_all_shapes_are_valid_in_their_order(tmp_path: Path) -> None:
    mesh = read(tmp_path, neutral(*CELLS))
    assert mesh.type_counts() == dict.fromkeys(CELLS, 1)
    assert meshgauge.measure(mesh).values[0] == 1  # the brick is a cube
    assert (meshgauge.measure(mesh).values[:4] > 0.3).all()
    assert mesh.cell_data["label"].tolist() == [5, 10, 15, 20, 25, 30, 35]
    assert mesh.point_data["label"].tolist() == list(range(11, 22))


def test_a_cell_that_is_numbered_in_reverse_stays(tmp_path: Path) -> None:
    text = neutral("wedge").replace("      12      20      14", "      12      14      20")
    assert meshgauge.measure(read(tmp_path, text)).values[0] < 0


def test_groups_are_regions(tmp_path: Path) -> None:
    groups = "".join(
        f"       ELEMENT GROUP 2.4.6\nGROUP: {n:10d} ELEMENTS: {len(ids):10d} MATERIAL: 2 NFLAGS: 1\n"
        f"{name:>32}\n       0\n{''.join(f'{i:8d}' for i in ids)}\nENDOFSECTION\n"
        for n, (name, ids) in enumerate({"fluid": (5, 15), "solid part": (10,)}.items(), 1)
    )
    boundary = " BOUNDARY CONDITIONS 2.4.6\n   wall  1  1  0  6\n  5  4  2\nENDOFSECTION\n"
    mesh = read(tmp_path, neutral("hexahedron", "pyramid", "wedge", more=groups + boundary))
    ids, names = meshgauge.mesh.regions.regions(mesh)
    assert [names[i] for i in ids] == ["fluid", "solid part", "fluid"]
    assert mesh.notes == ("Sections that hold no cells were left out: 1 boundary conditions.",)


def test_two_dimensions(tmp_path: Path) -> None:
    mesh = read(tmp_path, neutral("quad", "triangle", dimension=2))
    np.testing.assert_array_equal(mesh.points[:, :2], np.array(POINTS)[:, :2])
    assert not mesh.points[:, 2].any()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" 4  8 ", " 4 20 ", r"line \d+: a hexahedron of 20 nodes cannot be read, only of 8"),
        (" 4  8 ", " 9  8 ", "element type 9 is not known"),
        ("      18\n", "      18      19\n", "9 nodes of a hexahedron, expected 8"),
        ("      18\n", "      99\n", "an element refers to node 99, which does not exist"),
        ("         1         0", "         2         0", "where an element is expected|ENDOFSECTION"),
        ("ENDOFSECTION\n   NODAL", "   NODAL", "where ENDOFSECTION is expected"),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = neutral("hexahedron")
    assert old in text
    with pytest.raises(ReadError, match=message):
        read(tmp_path, text.replace(old, new))
