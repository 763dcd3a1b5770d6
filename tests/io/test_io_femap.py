"""FEMAP's neutral files: every type in its places, those of others without gaps, properties, what is no cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gmsh_files import assert_straight
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh
from meshgauge.mesh.regions import regions

# Type, and where the nodes are, a dot for an empty place of the twenty: as FEMAP's manual draws them.
NODES = {
    "tetra": (6, "000 200 020 . 002"),
    "wedge": (7, "000 200 020 . 002 202 022"),
    "hexahedron": (8, "000 200 220 020 002 202 222 022"),
    "tetra10": (10, "000 200 020 . 002 . . . 100 110 010 . 001 101 011"),
    "wedge15": (11, "000 200 020 . 002 202 022 . 100 110 010 . 001 201 021 . 102 112 012"),
    "hexahedron20": (12, "000 200 220 020 002 202 222 022 100 210 120 010 001 201 221 021 102 212 122 012"),
    "pyramid": (14, "000 200 220 020 112"),
    "pyramid13": (19, "000 200 220 020 112 . . . 100 210 120 010 551 x51 xx1 5x1"),
    "triangle6": (3, "000 200 020 . 100 110 010"),
    "triangle": (2, "000 200 020"),
    "quad": (4, "000 200 220 020"),
    "quad8": (5, "000 200 220 020 100 210 120 010"),
    "line": (0, "000 200"),
}
DIGIT = {**{str(n): n / 2 for n in range(3)}, "5": 0.25, "x": 0.75}
SOLID = [name for name in NODES if name not in ("triangle6", "triangle", "quad", "quad8", "line")]
FLAGS = "0.,0.,0.,\n0.,0.,0.,\n0.,0.,0.,\n0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,\n"


def block(number: int, body: str) -> str:
    return f"   -1\n   {number}\n{body}   -1\n"


def element(label: int, code: int, nodes: list[int], *, prop: int = 1, more: str = "") -> str:
    row = [*nodes, *[0] * (20 - len(nodes))]
    lines = "".join(",".join(map(str, row[at : at + 10])) + ",\n" for at in (0, 10))
    return f"{label},124,{prop},25,{code},1,0,0,{more}\n{lines}{FLAGS}"


def neutral(*names: str, close: bool = False, version: str = "8.2", more: str = "") -> str:
    """A file with one element of each name, labels from 11 on; ``close``: nodes without gaps."""
    nodes, elements, label = "", "", 101
    for n, name in enumerate(names):
        code, words = NODES[name]
        row = []
        for word in words.split():
            if word == "." and close:
                continue
            row.append(0 if word == "." else label)
            if word != ".":
                x, y, z = (DIGIT[c] for c in word)
                nodes += f"{label},0,0,1,46,0,0,0,0,0,0,{x + 2 * n},{y},{z},{more}\n"
                label += 1
        elements += element(11 + n, code, row, prop=n % 2 + 1)
    return block(100, f"<NULL>\n{version},\n") + block(403, nodes) + block(404, elements)


def read(tmp_path: Path, text: str) -> Mesh:
    (tmp_path / "a.neu").write_bytes(text.encode())
    return io.read(tmp_path / "a.neu")


@pytest.mark.parametrize("close", [False, True])
@pytest.mark.parametrize("name", SOLID)
def test_nodes_are_in_their_places(name: str, close: bool, tmp_path: Path) -> None:
    mesh = read(tmp_path, neutral(name, close=close))
    assert mesh.type_counts() == {name: 1}
    assert_straight(mesh)
    assert meshgauge.measure(mesh).values[0] > 0.3
    assert (mesh.cell_data["label"].tolist(), int(mesh.point_data["label"][0])) == ([11], 101)


@pytest.mark.parametrize("change", [lambda s: s, lambda s: s.replace("\n", "\r\n"), lambda s: s.replace(",\n", "\n"),
                                    lambda s: s.replace(",", " , "), lambda s: s.replace("-1\n", "-1   \n"),
                                    lambda s: s.replace("1,0,0,\n", "1,0,0,0,0,0,0,0,\n")])  # fmt: skip
def test_all_types_in_one_file(change: object, tmp_path: Path) -> None:
    mesh = read(tmp_path, change(neutral(*NODES)))  # type: ignore[operator]
    assert mesh.type_counts() == dict.fromkeys(NODES, 1)
    assert_straight(mesh)
    assert mesh.cell_data["label"].tolist() == list(range(11, 11 + len(NODES)))


def test_properties_are_regions(tmp_path: Path) -> None:
    properties = "".join(
        f"{n},110,0,25,1,0,\n{title}\n0,0,0,0,\n10,\n0,0,0,0,0,0,0,0,\n0,0,\n5,\n0.,0.,0.,0.,0.,\n0,\n0,\n"
        for n, title in ((1, "iron part"), (2, "wood"), (3, "unused"))
    )
    mesh = read(tmp_path, neutral("hexahedron", "tetra") + block(402, properties))
    ids, names = regions(mesh)
    assert [names[i] for i in ids] == ["iron part", "wood"]
    assert mesh.field_data["femap:property:names"].tolist() == ["iron part", "wood"]


def test_nodes_that_are_left_out_are_halfway(tmp_path: Path) -> None:
    text = neutral("tetra10")
    assert ",105," in text
    mesh = read(tmp_path, text.replace(",105,", ",0,", 1))
    assert_straight(mesh)
    assert any("1 node at the middle of an edge is not in the file" in note for note in mesh.notes)


@pytest.mark.parametrize("order", ["before", "after"])
def test_what_is_no_cell_is_counted(order: str, tmp_path: Path) -> None:
    nodes = "102,0,1.,1,1,1,0,0,0,\n103,0,1.,1,1,1,0,0,0,\n-1,-1,0.,0,0,0,0,0,0,\n"
    rigid = element(90, 13, [101]) + nodes
    text = neutral("hexahedron")
    head, body = text.split("   404\n")
    body = rigid + body if order == "before" else body.removesuffix("   -1\n") + rigid + "   -1\n"
    mesh = read(tmp_path, f"{head}   404\n{body}")
    assert mesh.type_counts() == {"hexahedron": 1}
    assert mesh.notes == ("Elements that are no cells were left out: 1 rigid.",)


def test_the_same_as_by_meshioplusplus(tmp_path: Path) -> None:
    package = pytest.importorskip("meshioplusplus")
    mesh = mesh_of(*LINEAR)
    rows = mesh.connectivity.tolist()
    cells = [(t, np.array([rows[mesh.offsets[c] : mesh.offsets[c + 1]]
                           for c in np.flatnonzero(mesh.types == BY_NAME[t].vtk_id)])) for t in LINEAR]  # fmt: skip
    path = tmp_path / "a.neu"
    package.write(str(path), package.Mesh(mesh.points, cells), file_format="femap")
    mine, theirs = io.read(path), package.read(str(path), file_format="femap")
    np.testing.assert_array_equal(mine.points, theirs.points)
    assert float(meshgauge.measure(mine).values.min()) == pytest.approx(1, abs=1e-9)
    assert [(b.type, b.data.tolist()) for b in theirs.cells] == [
        (t, mine.connectivity[mine.offsets[at] :][: 2 * len(c[0])].reshape(2, -1).tolist())
        for at, (t, c) in zip(range(0, 8, 2), cells, strict=True)
    ]
    assert mine.field_data["femap:property:names"].tolist() == ["property_1"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (",25,8,", ",25,99,", r"line 19: element 11 is of type 99, which is not known"),
        ("105,106,107,108,0,0,", "105,106,107,999,0,0,", "element 11 refers to node 999, which does not exist"),
        ("105,106,107,108,0,0,", "105,106,107,0,0,0,", "element 11 lacks a node that is no middle of an edge"),
        ("105,106,107,108,0,0,", "105,106,107,108,0,", "an element without a line of 8 numbers"),
        ("105,106,107,108,0,0,", "105,106,107,1.5,0,0,", "a node of an element is no integer"),
        (
            "105,106,107,108,0,0,",
            "105,106,107,x,0,0,",
            r"line 20: elements hold something else than numbers: '101",
        ),
        ("0,0,0,0,0,0,1.0,", "0,0,0,1.0,", "12 numbers of a node|11 numbers of a node"),
        ("   -1\n   404", "   404", "'404' where -1 is expected"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = neutral("hexahedron")
    assert old in text
    with pytest.raises(ReadError, match=message):
        read(tmp_path, text.replace(old, new, 1))


def test_a_file_that_ends_early(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="the file ends within a block; it is truncated"):
        read(tmp_path, neutral("hexahedron").removesuffix("   -1\n"))
    with pytest.raises(ReadError, match="no elements were found in it"):
        read(tmp_path, block(100, "<NULL>\n8.2,\n"))
    text = neutral("hexahedron", "hexahedron")
    with pytest.raises(ReadError, match=r"element 11 has 6 lines, expected 7|without a line"):
        read(tmp_path, text.replace(FLAGS, FLAGS.removeprefix("0.,0.,0.,\n"), 1))


def test_gambit_and_femap_are_told_apart(tmp_path: Path) -> None:
    assert read(tmp_path, neutral("tetra")).n_cells == 1
    with pytest.raises(ReadError, match=r"GAMBIT neutral: gambit or FEMAP neutral: femap"):
        read(tmp_path, "netgen\n1 2 3\n")
