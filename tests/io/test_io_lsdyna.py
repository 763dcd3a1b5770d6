"""LS-DYNA: every layout of its cards, its own numbers, bricks with repeated nodes, parts, includes, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME
from meshgauge.errors import ReadError
from meshgauge.mesh.regions import regions

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def nodes(labels: range = range(11, 19), width: int = 8, mark: str = "") -> str:
    """A cube; labels in order from the bottom up."""
    x = 20 if width == 20 else 16
    rows = (f"{n:{width}}" + "".join(f"{v:{x}.3f}" for v in p) for n, p in zip(labels, CUBE, strict=True))
    return f"*NODE{mark}\n" + "\n".join(rows) + "\n"


def fields(*values: int, width: int = 8) -> str:
    return "".join(f"{v:{width}}" for v in values) + "\n"


BRICK = range(11, 19)


def read(folder: Path, *texts: str, name: str = "a.k") -> meshgauge.Mesh:
    (folder / name).write_text("".join(("*KEYWORD\n$ a comment\n", *texts, "*END\nnonsense\n")))
    return io.read(folder / name)


@pytest.mark.parametrize(
    "element",
    [
        "*ELEMENT_SOLID\n" + fields(7000, 3, *BRICK),
        "*element_solid\n$ eid pid\n" + fields(7000, 3) + fields(*BRICK),
        "*ELEMENT_SOLID (ten nodes format)\n" + fields(7000, 3) + fields(*BRICK, 0, 0),
        "*ELEMENT_SOLID\n7000,3,11,12,13,14,15,16,17,18\n",
        "*ELEMENT_SOLID\n7000, 3\n11, 12,13,14,15,16,17,18\n",
        "*ELEMENT_SOLID%\n" + fields(7000, 3, *BRICK, width=10),
        "*ELEMENT_SOLID+\n" + fields(7000, 3, width=20) + fields(*BRICK, width=20),
        "*ELEMENT_SOLID_ORTHO\n" + fields(7000, 3, *BRICK) + "             1.0\n             0.0             1.0\n",
        "*ELEMENT_SOLID_DOF\n" + fields(7000, 3) + fields(*BRICK) + fields(*range(8)),
        "*ELEMENT_SOLID_H8TOH20\n" + fields(7000, 3) + fields(*BRICK),
        "*ELEMENT_TSHELL\n" + fields(7000, 3, *BRICK),
        "*ELEMENT_TSHELL_BETA\n" + fields(7000, 3, *BRICK) + "            45.0\n",
    ],
)
def test_a_brick(tmp_path: Path, element: str) -> None:
    mesh = read(tmp_path, nodes(), element, "*PART\nsteel\n" + fields(3, 1, 1, width=10))
    assert mesh.type_counts() == {"hexahedron": 1}
    assert (mesh.cell_data["label"].tolist(), mesh.cell_data["lsdyna:part"].tolist()) == ([7000], [3])
    assert mesh.point_data["label"].tolist() == list(BRICK)
    assert (regions(mesh)[1], mesh.notes) == (("steel",), ())
    assert meshgauge.measure(mesh).values.tolist() == [1.0]


@pytest.mark.parametrize(
    ("head", "width", "mark"), [("LONG=Y", 20, ""), ("I10=Y", 10, ""), ("", 20, "+"), ("", 10, "%")]
)
def test_widths_of_columns(tmp_path: Path, head: str, width: int, mark: str) -> None:
    (tmp_path / "a.k").write_text(
        f"*KEYWORD {head}\n{nodes(width=width, mark=mark)}*ELEMENT_SOLID{mark}\n"
        + fields(1234567, 1, *BRICK, width=width)
    )
    mesh = io.read(tmp_path / "a.k")
    assert mesh.cell_data["label"].tolist() == [1234567]
    assert meshgauge.measure(mesh).values.tolist() == [1.0]


REPEATED = {
    (11, 12, 14, 15, 15, 15, 15, 15): ("tetra", "tetra"),
    (11, 12, 14, 15, 0, 0, 0, 0): ("tetra", "tetra"),
    (11, 12, 13, 14, 15, 15, 15, 15): ("hexahedron", "pyramid"),
    (11, 14, 18, 15, 12, 12, 16, 16): ("hexahedron", "wedge"),
    (11, 12, 14, 14, 15, 16, 18, 18): ("hexahedron", "wedge"),
}


@pytest.mark.parametrize("ids", REPEATED)
@pytest.mark.parametrize("n_lines", [1, 2])
def test_repeated_nodes(tmp_path: Path, ids: tuple[int, ...], n_lines: int) -> None:
    """The file's brick is kept, and measured as what it stands for; reversed it is inverted."""
    of_file, measured = REPEATED[ids]
    mesh = read(tmp_path, nodes(), "*ELEMENT_SOLID\n", fields(5, 1), *(["\n"] * (n_lines - 1)), fields(*ids))
    assert mesh.type_counts() == {of_file: 1}
    quality = meshgauge.measure(mesh)
    assert quality.mesh.type_counts() == {measured: 1}
    assert quality.values[0] == pytest.approx({"tetra": 0.7071, "pyramid": 0.4082, "wedge": 0.8165}[measured], abs=1e-4)
    mirrored = mesh.replace(points=mesh.points * (1, 1, -1))
    assert meshgauge.measure(mirrored).values[0] == -quality.values[0]


def test_ten_nodes(tmp_path: Path) -> None:
    middles = "".join(f"{n:8}{x:16.2f}{y:16.2f}{z:16.2f}\n" for n, (x, y, z) in enumerate(
        [(0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0, 0, 0.5), (0.5, 0, 0.5), (0, 0.5, 0.5)], 21))  # fmt: skip
    mesh = read(tmp_path, nodes(), middles, "*ELEMENT_SOLID\n", fields(5, 1), fields(11, 12, 14, 15, *range(21, 27)))
    assert mesh.type_counts() == {"tetra10": 1}
    quality = meshgauge.measure(mesh)
    assert (quality.values[0], quality.status[0]) == (pytest.approx(0.7071, abs=1e-4), 0)


def test_parts_shells_beams_and_what_is_no_cell(tmp_path: Path) -> None:
    mesh = read(
        tmp_path,
        nodes(),
        "*ELEMENT_SOLID\n",
        fields(9, 2, *BRICK),
        "*ELEMENT_SHELL_THICKNESS_OFFSET\n",
        fields(4, 3, 11, 12, 13, 14) + "       1.0       1.0\n       0.5\n",
        fields(5, 3, 11, 12, 13, 13) + "       1.0       1.0\n       0.5\n",
        "*ELEMENT_BEAM\n",
        fields(6, 4, 11, 12, 13),
        "*ELEMENT_SHELL_COMPOSITE\n",
        fields(7, 3, 11, 12, 13, 14) + "       1       0.5\n",
        "*ELEMENT_SPH\n",
        fields(8, 1),
        "*PART\n\n" + fields(2, width=10) + "\u00fc plate  \n" + fields(3, width=10),
        "*PART_INERTIA\nrod\n" + fields(4, width=10) + "1.0\n",
    )
    assert mesh.type_counts() == {"line": 1, "triangle": 1, "quad": 1, "hexahedron": 1}
    assert mesh.cell_data["label"].tolist() == [9, 4, 5, 6]
    assert mesh.cell_data["lsdyna:part"].tolist() == [2, 3, 3, 4]
    assert regions(mesh) == (pytest.approx([0, 1, 1, 2]), ("part 2", "\u00fc plate", "rod"))
    assert mesh.notes == ("No cells, and left out: *ELEMENT_SHELL_COMPOSITE, *ELEMENT_SPH.",)


def test_includes(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "nodes.k").write_text(nodes() + "*END\n*NODE\nnonsense\n")
    element = "*ELEMENT_SOLID\n" + fields(1, 1, *BRICK)
    assert read(tmp_path, "*INCLUDE\nsub/no +\ndes.k\n", element).n_points == 8
    assert read(tmp_path, "*INCLUDE\n$ those\nsub/nodes.k\n", element).n_points == 8
    for text, message in {
        "*INCLUDE\n/etc/passwd\n": r"line 3: \*INCLUDE includes .*, which is outside its folder",
        "*INCLUDE\na.k\n": "includes this file again",
        "*INCLUDE_TRANSFORM\nsub/nodes.k\n": r"\*INCLUDE_TRANSFORM is not followed",
    }.items():
        with pytest.raises(ReadError, match=message):
            read(tmp_path, text, element)


@pytest.mark.parametrize("card", ["TSHELL_COMPOSITE", "SOLID_H20", "SOLID_T20", "GENERALIZED_SOLID", "BEZIER3D"])
def test_solid_elements_that_are_not_known_are_an_error(tmp_path: Path, card: str) -> None:
    with pytest.raises(ReadError, match=rf"a\.k, line 12: \*ELEMENT_{card} is not read"):
        read(tmp_path, nodes(), f"*ELEMENT_{card}\n", fields(7, 1, *BRICK))


@pytest.mark.parametrize(
    ("element", "message"),
    [
        (fields(7, 1, *BRICK) + fields(8, 1, *range(11, 18), 99), "element 8 refers to node 99, which does not exist"),
        (
            fields(7, 1, *BRICK) + "       8  &steel" + fields(*BRICK),
            r"line 14: .*'&steel' .*: parameters are not followed",
        ),
        (fields(7, 1) + fields(*BRICK) + fields(8, 1), "line 15: .*has 3 lines, expected 2 an element"),
        (fields(7, 1) + fields(*BRICK) + fields(8, 1, *BRICK) * 2, "line 15: .*one line among those of two"),
        ("       7       x" + fields(*BRICK), "line 13: .*has 'x' where an integer is expected"),
        ("$ nothing\n", "no elements were found in it"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, element: str, message: str) -> None:
    with pytest.raises(ReadError, match=message):
        read(tmp_path, nodes(), "*ELEMENT_SOLID\n", element)


def test_nodes_that_are_moved_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"line 12: \*NODE_TRANSFORM moves nodes"):
        read(tmp_path, nodes(), "*NODE_TRANSFORM\n       1       1\n")


def test_what_another_writes(tmp_path: Path) -> None:
    package = pytest.importorskip("meshioplusplus")
    mesh = mesh_of(*LINEAR)
    rows = mesh.connectivity.tolist()
    cells = {t: [rows[mesh.offsets[c] : mesh.offsets[c + 1]] for c in np.flatnonzero(mesh.types == BY_NAME[t].vtk_id)]
             for t in LINEAR}  # fmt: skip
    blocks = [(t, np.array(c)) for t, c in cells.items()]
    package.write(str(tmp_path / "a.k"), package.Mesh(mesh.points, blocks), file_format="lsdyna")
    quality = meshgauge.measure(io.read(tmp_path / "a.k"))
    assert quality.mesh.type_counts() == mesh.type_counts()
    assert float(quality.values.min()) == pytest.approx(1)
    assert quality.mesh.counted == ("cells", "points")


def test_parts_of_one_title_are_told_apart(tmp_path: Path) -> None:
    elements = fields(1, 5, *BRICK) + fields(2, 9, *BRICK)
    mesh = read(tmp_path, nodes(), "*ELEMENT_SOLID\n", elements, "*PART\na\n         5\na\n         9\n")
    assert regions(mesh)[1] == ("a (5)", "a (9)")
    io.write(tmp_path / "a.vtu", mesh)
    assert regions(io.read(tmp_path / "a.vtu"))[1] == ("a (5)", "a (9)")
