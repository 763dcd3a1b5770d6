"""Elmer's folders: types in the order of its elements.def, names of bodies and boundaries, parts, what is wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from gmsh_files import assert_straight

import meshgauge
from meshgauge import io
from meshgauge.cells import CELL_TYPES
from meshgauge.cli.main import main
from meshgauge.errors import ReadError
from meshgauge.files import undo
from meshgauge.io.patching import patch_of
from meshgauge.mesh.regions import regions

# Where the nodes of each type are: coordinates u, v, w in elements.def of Elmer's sources.
NODES = {
    504: "000 200 020 002",
    510: "000 200 020 002 100 110 010 001 101 011",
    605: "000 200 220 020 112",
    613: "000 200 220 020 112 100 210 120 010 " + "551 x51 xx1 5x1",
    706: "000 200 020 002 202 022",
    715: "000 200 020 002 202 022 100 110 010 102 112 012 001 201 021",
    808: "000 200 220 020 002 202 222 022",
    820: "000 200 220 020 002 202 222 022 100 210 120 010 001 201 221 021 102 212 122 012",
    827: "000 200 220 020 002 202 222 022 100 210 120 010 001 201 221 021 102 212 122 012 101 211 121 011 110 112 111",
    303: "000 200 020",
    404: "000 200 220 020",
    408: "000 200 220 020 100 210 120 010",
    409: "000 200 220 020 100 210 120 010 110",
}
SOLID = {504: "tetra", 510: "tetra10", 605: "pyramid", 613: "pyramid13", 706: "wedge", 715: "wedge15",
         808: "hexahedron", 820: "hexahedron20", 827: "hexahedron27"}  # fmt: skip
DIGIT = {**{str(n): n / 2 for n in range(3)}, "5": 0.25, "x": 0.75}

Row = tuple[int, ...]


def places(code: int) -> list[tuple[float, ...]]:
    return [tuple(DIGIT[c] for c in word) for word in NODES[code].split()]


def write(
    folder: Path,
    nodes: Sequence[tuple[float, ...]],
    bulk: Sequence[Row],
    boundary: Sequence[Row] = (),
    *,
    stem: str = "mesh",
    ids: Sequence[int] | None = None,
    marks: dict[int, int] | None = None,
    end: str = "\n",
) -> Path:
    """Rows of body, type and nodes; of boundaries with two parents between; labels of elements by tens."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = ids or range(1, len(nodes) + 1)
    marks = marks or {}
    codes = sorted({row[1] for row in bulk} | {row[1] for row in boundary})
    counts = [f"{c} {sum(row[1] == c for row in (*bulk, *boundary))}" for c in codes]
    files = {
        "header": [f"{len(nodes)} {len(bulk)} {len(boundary)} ", str(len(codes)), *counts],
        "nodes": [f"{n} -1 {x} {y} {z}" for n, (x, y, z) in zip(numbers, nodes, strict=True)],
        "elements": [
            f"{10 * n}{f'/{marks[n]}' if n in marks else ''} {' '.join(map(str, row))}" for n, row in enumerate(bulk, 1)
        ],
        "boundary": [f"{n} {b} 10 0 {' '.join(map(str, rest))}" for n, (b, *rest) in enumerate(boundary, 1)],
    }
    for name, lines in files.items():
        (folder / f"{stem}.{name}").write_bytes("".join(line + end for line in lines).encode())
    return folder


@pytest.mark.parametrize("code", SOLID)
def test_nodes_of_solids_are_in_their_places(code: int, tmp_path: Path) -> None:
    n = code % 100
    mesh = io.read(write(tmp_path, places(code), [(1, code, *range(1, n + 1))]))
    assert mesh.type_counts() == {SOLID[code]: 1}
    assert_straight(mesh)
    assert meshgauge.measure(mesh).values[0] > 0.3
    if code // 100 == 8:
        assert meshgauge.measure(mesh).values[0] == 1


def test_surfaces_and_lines(tmp_path: Path) -> None:
    rows = [(code, *range(1, code % 100 + 1)) for code in (303, 404, 408, 409)]
    line = [(3, 202, 1, 2), (3, 203, 1, 2, 5), (4, 101, 1)]
    mesh = io.read(write(tmp_path, places(409), [(2, *rows[-1])], [*((1, *row) for row in rows), *line]))
    names = [CELL_TYPES[t].name for t in mesh.types]
    assert names == ["quad9", "triangle", "quad", "quad8", "quad9", "line", "line3", "vertex"]
    assert mesh.cell_data["elmer:boundary"].tolist() == [0, 1, 1, 1, 1, 3, 3, 4]
    assert mesh.cell_data["label"].tolist() == [10, *[-1] * 7]


def test_cubic_surfaces_keep_their_corners(tmp_path: Path) -> None:
    nodes = [(float(n % 4), float(n // 4), 0.0) for n in range(16)]
    mesh = io.read(write(tmp_path, nodes, [(1, 416, 1, 4, 16, 13, *range(5, 13), 2, 3, 14, 15)]))
    assert mesh.type_counts() == {"quad": 1}
    assert mesh.connectivity.tolist() == [0, 3, 15, 12]
    assert "1 cells of 16 nodes became quad cells of 4: the other nodes were left out." in mesh.notes


@pytest.mark.parametrize("end", ["\n", "\r\n", " \n"])
def test_names_of_bodies_are_regions(tmp_path: Path, end: str) -> None:
    nodes = [*places(808), *[(x, y, z + 1) for x, y, z in places(808)[4:]]]
    bulk = [(1, 808, *range(1, 9)), (7, 808, *range(5, 13))]
    folder = write(tmp_path / "m", nodes, bulk, [(2, 404, 1, 2, 3, 4)], end=end)
    lines = ("! ----- names for bodies -----", "$ upper block = 7", "$ lower = 1", "! ----- names for boundaries -----",
             "$ wall = 2", "$ lower = 9")  # fmt: skip
    (folder / "mesh.names").write_bytes(end.join(lines).encode())
    for path in (folder, folder / "mesh.header", folder / "mesh.nodes", folder / "mesh.elements"):
        mesh = io.read(path)
        ids, names = regions(mesh)
        assert [names[i] for i in ids][:2] == ["lower", "upper block"]
        assert mesh.field_data["elmer:boundary:names"].tolist() == ["wall", "lower"]
        assert mesh.path == str(path)
        assert {Path(name).name for name in mesh.sources} >= {
            f"mesh.{name}" for name in ("header", "nodes", "elements", "boundary", "names")
        }


def parts(folder: Path) -> Path:
    """Two cubes, one a part, on the same four nodes; of each the other knows a copy."""
    nodes = [*places(808), *[(x, y, z + 1) for x, y, z in places(808)[4:]]]
    first, second = (1, 808, *range(1, 9)), (1, 808, *range(5, 13))
    wall = (5, 404, 5, 6, 7, 8)
    inside = folder / "partitioning.2"
    write(inside, nodes, [first, second], [wall], stem="part.1", marks={2: 2})
    write(inside, nodes, [first, second], [wall], stem="part.2", marks={1: 1})
    (folder / "mesh.names").write_text("! bodies\n$ all = 1\n")
    return folder


def test_parts_are_joined(tmp_path: Path) -> None:
    folder = parts(tmp_path / "m")
    for path in (folder, folder / "partitioning.2", folder / "partitioning.2" / "part.2.header"):
        mesh = io.read(path)
        assert (mesh.n_points, mesh.type_counts()) == (12, {"hexahedron": 2, "quad": 1})
        assert (meshgauge.measure(mesh).values[:2] == 1).all()
        assert mesh.field_data["elmer:body:names"].tolist() == ["all"]
        assert "All 2 parts" in mesh.notes[0]


@pytest.mark.parametrize("given", ["m", "m/partitioning.2", "m/partitioning.2/part.1.header"])
def test_parts_are_patched(given: str, tmp_path: Path) -> None:
    """A node of several parts moves in each; what is not read of a folder goes along."""
    folder = parts(tmp_path / "m")
    for n in (1, 2):
        (folder / "partitioning.2" / f"part.{n}.shared").write_text("5 2 1 2\n")
    had = {one.relative_to(folder): one.read_bytes() for one in folder.rglob("*") if one.is_file()}
    mesh = io.read(tmp_path / given)
    (tmp_path / "out").mkdir()
    patch = patch_of(mesh, tmp_path / "out" / Path(given).name)
    assert patch is not None
    assert not patch.is_fixed.any()
    points = np.array(mesh.points)
    points[[0, 4, 5, 11]] += 0.0625
    into = tmp_path / "out2" / Path(given).name
    into.parent.mkdir()
    patch = dataclasses.replace(patch, target=into)
    patch.write(mesh.replace(points=points), undo_file=tmp_path / "undo.npz")
    assert np.array_equal(io.read(into).points, points)
    root = into.parent if into.is_file() else into
    new = {one.name: one.read_bytes() for one in root.rglob("*") if one.is_file()}
    assert {path.name for path in had if path.parts[0] != "mesh.names" or given == "m"} == set(new)
    changed = [path.name for path, data in had.items() if new.get(path.name, data) != data]
    assert sorted(changed) == ["part.1.nodes", "part.2.nodes"]
    for name in changed:
        lines = [data.splitlines() for data in (had[Path("partitioning.2", name)], new[name])]
        assert sum(a != b for a, b in zip(*lines, strict=True)) == 4
    back = undo.restored(tmp_path / "undo.npz", into)
    assert {b"".join(one.pieces()) for one in back.values()} >= {had[Path("partitioning.2", name)] for name in changed}


def test_a_part_that_is_missing(tmp_path: Path) -> None:
    inside = parts(tmp_path) / "partitioning.2"
    (inside / "part.2.header").unlink()
    with pytest.raises(ReadError, match=r"needs part\.2\.header beside it"):
        io.read(inside)


def test_several_partitionings_and_no_mesh(tmp_path: Path) -> None:
    parts(tmp_path)
    (tmp_path / "partitioning.2").rename(tmp_path / "partitioning.3")
    parts(tmp_path)
    with pytest.raises(ReadError, match=r"give one of partitioning\.2, partitioning\.3"):
        io.read(tmp_path)


def test_a_node_at_two_places(tmp_path: Path) -> None:
    inside = parts(tmp_path) / "partitioning.2"
    nodes = inside / "part.2.nodes"
    nodes.write_text(nodes.read_text().replace("5 -1 0.0", "5 -1 0.5"))
    with pytest.raises(ReadError, match="node 5 is at different places"):
        io.read(inside)


def test_a_boundary_that_is_not_there(tmp_path: Path) -> None:
    folder = write(tmp_path, places(504), [(1, 504, 1, 2, 3, 4)])
    (folder / "mesh.boundary").unlink()
    assert io.read(folder).type_counts() == {"tetra": 1}
    write(tmp_path, places(504), [(1, 504, 1, 2, 3, 4)], [(1, 303, 1, 2, 3)])
    (folder / "mesh.boundary").unlink()
    with pytest.raises(ReadError, match=r"needs mesh\.boundary beside it"):
        io.read(folder)


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("elements", "504 1 2 3 4", "504 1 2 3 9", "element 10 refers to node 9, which does not exist"),
        ("elements", "504 1 2 3 4", "504 1 2 3", r"elements, line 1: 3 nodes of a tetra, expected 4"),
        ("elements", "504", "505", "element type 505 is not known; known are 101"),
        ("elements", "504 1 2 3 4", "504 1 2 x 4", "something else than integers"),
        ("elements", "10 1", "10", "3 nodes of a tetra|is not known"),
        ("header", "4 1 0", "4 2 0", "2 elements are stated, but 1 lines follow"),
        ("header", "4 1 0", "3 1 0", "3 nodes are stated, but 1 more lines follow"),
        ("header", "4 1 0", "999999999999 1 0", "999999999999 nodes are stated"),
        ("nodes", "4 -1", "3 -1", "two nodes have the same number"),
        ("nodes", "4 -1", "4.5 -1", "the number of a node is no integer"),
        ("elements", "10 1 504 1 2 3 4\n", "", r"1 elements are stated, but 0 lines"),
    ],
)
def test_what_is_wrong_is_named(file: str, old: str, new: str, message: str, tmp_path: Path) -> None:
    path = write(tmp_path, places(504), [(1, 504, 1, 2, 3, 4)]) / f"mesh.{file}"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ReadError, match=message):
        io.read(tmp_path)


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, places(808), [(1, 808, *range(1, 9))])
    assert main(["check", str(tmp_path)]) == 0
    assert "1 cell" in capsys.readouterr().out


def test_counts_beside_other_formats(tmp_path: Path) -> None:
    """Files of TetGen and others of these extensions are not taken for Elmer's."""
    (tmp_path / "a.nodes").write_text("1 2 3\n")
    with pytest.raises(ReadError, match=r"does not begin as a file with the extension \.nodes does \(Elmer: elmer\)"):
        io.read(tmp_path / "a.nodes")


def test_points_are_those_of_the_file(tmp_path: Path) -> None:
    nodes = np.random.default_rng(0).random((4, 3))
    mesh = io.read(write(tmp_path, nodes.tolist(), [(1, 504, 11, 12, 13, 14)], ids=range(11, 15)))
    np.testing.assert_array_equal(mesh.points, nodes)
    assert mesh.point_data["label"].tolist() == [11, 12, 13, 14]
