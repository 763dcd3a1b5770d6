"""FrontISTR's and HEC-MW's meshes: every type in its order of nodes, groups, materials, broken lines, what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gmsh_files import assert_straight

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh
from meshgauge.mesh.regions import regions

# Where the nodes are, twice: corners, then middles as in the manual's figures and in examples/static/exF of FrontISTR.
NODES = {
    341: "000 200 020 002",
    342: "000 200 020 002 110 010 100 001 101 011",
    351: "000 200 020 002 202 022",
    352: "000 200 020 002 202 022 110 010 100 112 012 102 001 201 021",
    361: "000 200 220 020 002 202 222 022",
    362: "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021",
    371: "000 200 220 020 112",
    372: "000 200 220 020 112 100 210 120 010 551 x51 xx1 5x1",
}
NAMES = {341: "tetra", 342: "tetra10", 351: "wedge", 352: "wedge15", 361: "hexahedron", 362: "hexahedron20",
         371: "pyramid", 372: "pyramid13"}  # fmt: skip
DIGIT = {**{str(n): n / 2 for n in range(3)}, "5": 0.25, "x": 0.75}
CUBES = "!NODE\n" + "".join(f"{1 + n}, {n % 2}.0, {n // 2 % 2}.0, {n // 4}.0\n" for n in range(12))  # in rows of two
FIRST, SECOND = "1, 2, 4, 3, 5, 6, 8, 7", "5, 6, 8, 7, 9, 10, 12, 11"


def deck(code: int, *, first: int = 1) -> str:
    words = NODES[code].split()
    nodes = "".join(f"  {first + n},  {', '.join(str(DIGIT[c]) for c in word)}\n" for n, word in enumerate(words))
    element = ", ".join(map(str, (7, *range(first, first + len(words)))))
    return f"!HEADER\n a mesh\n!NODE\n{nodes}!ELEMENT, TYPE={code}, EGRP=E1\n {element}\n!END\n"


def read(tmp_path: Path, text: str, name: str = "a.msh") -> Mesh:
    (tmp_path / name).write_bytes(text.encode())
    return io.read(tmp_path / name)


@pytest.mark.parametrize("code", NODES)
def test_nodes_are_in_their_places(code: int, tmp_path: Path) -> None:
    mesh = read(tmp_path, deck(code, first=101))
    assert mesh.type_counts() == {NAMES[code]: 1}
    assert_straight(mesh)
    assert meshgauge.measure(mesh).values[0] > 0.3
    assert (mesh.cell_data["label"].tolist(), int(mesh.point_data["label"][0])) == ([7], 101)


@pytest.mark.parametrize(
    ("code", "nodes", "name", "corners"),
    [
        (231, "1, 2, 4", "triangle", [0, 1, 3]),
        (741, "1, 2, 4, 3", "quad", [0, 1, 3, 2]),
        (761, "1, 2, 4, 9, 10, 12", "triangle", [0, 1, 3]),
        (781, "1, 2, 4, 3, 9, 10, 12, 11", "quad", [0, 1, 3, 2]),
        (301, "1, 2", "line", [0, 1]),
        (641, "1, 2, 9, 10", "line", [0, 1]),
        (232, "1, 2, 3, 4, 5, 6", "triangle6", [0, 1, 2, 5, 3, 4]),
    ],
)
def test_surfaces_and_lines(code: int, nodes: str, name: str, corners: list[int], tmp_path: Path) -> None:
    mesh = read(tmp_path, f"{CUBES}!ELEMENT,TYPE={code}\n1,{nodes}\n")
    assert mesh.type_counts() == {name: 1}
    assert mesh.connectivity.tolist() == corners


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s,
        lambda s: s.replace("\n", "\r\n"),
        lambda s: s.lower(),
        lambda s: s.replace("!", "  ! ").replace(" ! END", " !END"),
        lambda s: s.replace(", TYPE=361", " , TYPE = 361 "),
        lambda s: s.replace("!NODE", "!! a remark\n# another\n!NODE"),
        lambda s: s.replace("6, 8, 7\n", "6,\n 8, 7\n"),
        lambda s: s.replace("!END\n", ""),
        lambda s: s.removeprefix("!HEADER\n a mesh\n"),
        lambda s: s.replace(".0", ".0e0"),
    ],
)
def test_ways_to_write_the_same(change: object, tmp_path: Path) -> None:
    text = (
        f"!HEADER\n a mesh\n{CUBES}!ELEMENT, TYPE=361\n1, {FIRST}\n2, {SECOND}\n"
        "!MATERIAL, NAME=M1, ITEM=1\n!ITEM=1, SUBITEM=2\n 4000., 0.3\n!NGROUP, NGRP=FIX, GENERATE\n 1, 4, 1\n!END\n"
    )
    mesh = read(tmp_path, change(text))  # type: ignore[operator]
    assert mesh.type_counts() == {"hexahedron": 2}
    assert (meshgauge.measure(mesh).values == 1).all()
    assert mesh.notes == ()


def test_groups_and_materials(tmp_path: Path) -> None:
    third = FIRST.replace("1,", "9,", 1)
    mesh = read(
        tmp_path,
        f"{CUBES}!ELEMENT, TYPE=361, EGRP=lower\n1, {FIRST}\n!ELEMENT, TYPE=361, EGRP=upper\n5, {SECOND}\n9, {third}\n"
        "!EGROUP, EGRP=some, GENERATE\n1, 5, 4\n!EGROUP, EGRP=some\n lower\n!EGROUP, EGRP=one, GENERATE\n9\n"
        "!SECTION, TYPE=SOLID, EGRP=ALL, MATERIAL=iron\n1.0\n!SECTION, TYPE=SOLID, EGRP=UPPER, MATERIAL=wood\n",
    )
    ids, names = regions(mesh)
    assert [names[i] for i in ids] == ["iron", "wood", "wood"]
    sets = {name: mesh.cell_data[name].tolist() for name in ("LOWER", "UPPER", "SOME", "ONE")}
    assert sets == {"LOWER": [1, 0, 0], "UPPER": [0, 1, 1], "SOME": [1, 1, 0], "ONE": [0, 0, 1]}


def test_values_of_materials_behind_the_nodes(tmp_path: Path) -> None:
    mesh = read(tmp_path, f"{CUBES}!ELEMENT, TYPE=361, MATITEM=2\n1, {FIRST}, 2.1e5, 0.3\n2, {SECOND}, 1e5, 0.3\n")
    assert mesh.connectivity.tolist() == [0, 1, 3, 2, 4, 5, 7, 6, 4, 5, 7, 6, 8, 9, 11, 10]


def test_cylindrical_nodes(tmp_path: Path) -> None:
    text = "!NODE, SYSTEM=C\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 90, 0\n4, 0, 0, 1\n!ELEMENT, TYPE=341\n1, 1, 2, 3, 4\n"
    np.testing.assert_allclose(read(tmp_path, text).points[2], (0, 1, 0), atol=1e-15)


def test_systems_move_no_node_as_in_the_solver(tmp_path: Path) -> None:
    """HEC-MW's own library takes their lines and leaves coordinates as they are."""
    plain = f"{CUBES}!ELEMENT, TYPE=361\n1, {FIRST}\n"
    (tmp_path / "plain").mkdir()
    mesh, other = read(tmp_path, plain.replace("!NODE", "!SYSTEM\n1, 2, 3\n!NODE")), read(tmp_path / "plain", plain)
    np.testing.assert_array_equal(mesh.points, other.points)
    assert any("!SYSTEM moves no node" in note for note in mesh.notes)
    assert not other.notes


def test_files_that_are_included(tmp_path: Path) -> None:
    (tmp_path / "nodes.txt").write_text(CUBES.removeprefix("!NODE\n"))
    (tmp_path / "cells.msh").write_text(f"!ELEMENT, TYPE=361\n1, {FIRST}\n")
    mesh = read(tmp_path, "!NODE, INPUT=nodes.txt\n!INCLUDE, INPUT=cells.msh\n!END\n")
    assert mesh.n_cells == 1
    assert {Path(name).name for name in mesh.sources} == {"a.msh", "nodes.txt", "cells.msh"}
    with pytest.raises(ReadError, match="outside its folder"):
        read(tmp_path, "!INCLUDE, INPUT=../b.msh\n")
    with pytest.raises(ReadError, match="includes this file again"):
        read(tmp_path, "!INCLUDE, INPUT=a.msh\n")


def test_links_and_interfaces(tmp_path: Path) -> None:
    mesh = read(tmp_path, f"{CUBES}!ELEMENT, TYPE=541\n1, {FIRST}\n!ELEMENT, TYPE=511\n2, 1, 2\n")
    assert mesh.cell_data["interface"].tolist() == [1]
    assert "Links and contacts are no cells and were left out: 1 of type 511." in mesh.notes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("TYPE=361", "TYPE=999", r"line 15: !ELEMENT has elements of type 999, which is not known; known are 111"),
        ("TYPE=361", "TYPE=x", "has 'x' where TYPE is a number"),
        ("TYPE=361", "TYP=361", "type -1"),
        ("8, 7\n2", "8\n2", r"line 17: expected elements of 8 nodes \(type 361\); this line does not fit"),
        ("12, 11", "12, 99", "element 2 refers to node 99, which does not exist"),
        ("12, 11", "12, x", "elements hold something else than integers: 'x'"),
        ("3, 0.0, 1.0, 0.0", "3, 0.0, 1.0", "2 numbers where|3 numbers where"),
        ("3, 0.0", "3.5, 0.0", "a number of a node that is no integer"),
        ("!END", "!EGROUP, EGRP=A\n nothing\n!END", "'A' names the group 'nothing', which does not exist"),
        ("!END", "!EGROUP, EGRP=A, GENERATE\n 1, 5, -1\n!END", "goes on by -1"),
        ("!END", "!EGROUP, EGRP=A, GENERATE\n 1, 50000000000, 1\n!END", "nodes and elements generated or copied"),
        ("!ELEMENT", "!END\n!ELEMENT", "no elements were found in it"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = f"!HEADER\n{CUBES}!ELEMENT, TYPE=361\n1, {FIRST}\n2, {SECOND}\n!END\n"
    assert old in text
    with pytest.raises(ReadError, match=message):
        read(tmp_path, text.replace(old, new, 1))


def test_other_formats_of_the_extension_are_told_apart(tmp_path: Path) -> None:
    io.write(tmp_path / "gmsh.msh", io.read(_written(tmp_path)))
    assert io.read(tmp_path / "gmsh.msh").n_cells == 1
    with pytest.raises(ReadError, match=r"Gmsh: gmsh or Fluent: fluent or FrontISTR"):
        read(tmp_path, "StartNode\n")


def _written(tmp_path: Path) -> Path:
    (tmp_path / "b.msh").write_text(deck(361))
    return tmp_path / "b.msh"
