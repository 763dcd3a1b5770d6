"""Abaqus input decks: labels, continued lines, what decks generate, element types that are no cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME, SHAPES
from meshgauge.errors import ReadError
from meshgauge.io.formats.abaqus.types import element_type
from meshgauge.mesh import Mesh
from meshgauge.mesh.interface import is_interface

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
CUBE = "*NODE\n" + "".join(f"{n},{x},{y},{z}\n" for n, (x, y, z) in enumerate(CORNERS, 1))
BRICK = "*ELEMENT, TYPE=C3D8\n1,1,2,3,4,5,6,7,8\n"
STRIP = """*NODE
1,0.,0.,0.
5,4.,0.,0.
101,0.,1.,0.
105,4.,1.,0.
1001,0.,0.,1.
1005,4.,0.,1.
1101,0.,1.,1.
1105,4.,1.,1.
*NGEN
1,5,1
101,105
1001,1005,1
1101,1105,1
*ELEMENT, TYPE=C3D8
1,1,2,102,101,1001,1002,1102,1101
"""


def read(folder: Path, text: str) -> Mesh:
    (folder / "a.inp").write_text(text)
    return io.read(folder / "a.inp")


def points(mesh: Mesh) -> dict[int, list[float]]:
    """Coordinates by label."""
    return dict(zip(mesh.point_data["label"].tolist(), mesh.points.tolist(), strict=True))


def test_labels_are_those_of_the_file(tmp_path: Path) -> None:
    mesh = read(tmp_path, "*NODE\n100,0,0,0\n7,1,0,0\n300,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n7000, 100,7,300,4\n")
    assert mesh.cell_data["label"].tolist() == [7000]
    assert mesh.point_data["label"].tolist() == [100, 7, 300, 4]
    assert mesh.cell_data["label"].dtype == mesh.point_data["label"].dtype == np.int64
    assert io.write(tmp_path / "b.inp", mesh) == ()
    back = io.read(tmp_path / "b.inp")
    assert back.cell_data["label"].tolist() == [7000]
    assert back.point_data["label"].tolist() == [100, 7, 300, 4]
    assert "'label'" in " ".join(io.write(tmp_path / "b.su2", mesh))


@pytest.mark.parametrize(
    "text",
    [
        "1, 1, 2, 3, 4,\n2, 1, 3, 2, 5,\n",  # a comma behind an element that has its nodes
        "1, 1, 2,\n3, 4\n2, 1,\n 3, 2, 5\n",
        "1, 1, 2\n3, 4\n2, 1, 3\n 2, 5\n",  # continued without a comma
        "1, 1, 2, 3, 4\n** between\n\n2, 1, 3, 2, 5\n",
        "1 , 1 , 2,3,4 ,\r\n2,1,3,2,5\r\n",
    ],
)
def test_an_element_that_has_its_nodes_is_whole(tmp_path: Path, text: str) -> None:
    head = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,0,0,-1,\n*ELEMENT, TYPE=C3D4, ELSET=E\n"
    mesh = read(tmp_path, head + text)
    assert mesh.type_counts() == {"tetra": 2}
    assert mesh.connectivity.tolist() == [0, 1, 2, 3, 0, 2, 1, 4]


@pytest.mark.parametrize("rest", ["1, 1, 2, 3, 4, 5\n", "1, 1, 2, 3\n", "1, 1, 2, 3, 4\n2, 1, 2\n"])
def test_an_element_with_other_nodes_is_an_error_with_its_line(tmp_path: Path, rest: str) -> None:
    with pytest.raises(ReadError, match=r"a\.inp, line \d+: an element of type C3D4 with [235] nodes, expected 4"):
        read(tmp_path, CUBE + "*ELEMENT, TYPE=C3D4\n" + rest)


def test_elgen_makes_rows_and_layers(tmp_path: Path) -> None:
    mesh = read(tmp_path, STRIP + "*ELGEN, ELSET=E\n1,4,1,10\n")
    assert mesh.type_counts() == {"hexahedron": 4}
    assert mesh.cell_data["label"].tolist() == [1, 11, 21, 31]
    assert mesh.cell_data["E"].tolist() == [1, 1, 1, 1]
    assert meshgauge.measure(mesh).values == pytest.approx(np.ones(4))
    grid = "*NODE\n" + "".join(
        f"{1 + x + 10 * y + 100 * z},{x},{y},{z}\n" for z in range(4) for y in range(3) for x in range(3)
    )
    whole = read(tmp_path, grid + "*ELEMENT,TYPE=C3D8\n1,1,2,12,11,101,102,112,111\n*ELGEN\n1,2,1,1,2,10,2,3,100,4\n")
    assert whole.cell_data["label"].tolist() == list(range(1, 13))
    values = meshgauge.measure(whole).values
    assert values == pytest.approx(np.ones(12))
    centres = np.array([whole.points[whole.nodes(c)].mean(axis=0) for c in range(12)])
    assert np.unique(centres, axis=0).shape == (12, 3)
    assert centres[5].tolist() == [1.5, 0.5, 1.5]  # element 6: second of its row in the second layer


def test_elgen_of_what_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"line 18: refers to element 9, which does not exist"):
        read(tmp_path, STRIP + "*ELGEN\n9,2\n")
    with pytest.raises(ReadError, match=r"element 5 \(hexahedron\) refers to node 6, which does not exist"):
        read(tmp_path, STRIP + "*ELGEN\n1,5\n")
    with pytest.raises(ReadError, match=r"line 17: \*ELGEN: .* more than the 20,000,000"):
        read(tmp_path, STRIP + "*ELGEN\n1,99999,1,1,99999\n")


@pytest.mark.parametrize("how", ["", ", REFLECT"])
def test_elcopy_with_ncopy_makes_the_other_half(tmp_path: Path, how: str) -> None:
    kinds = {
        "C3D8": (1, 2, 3, 4, 5, 6, 7, 8),
        "C3D6": (1, 2, 3, 5, 6, 7),
        "C3D4": (1, 2, 3, 6),
        "C3D5": (1, 2, 3, 4, 6),
    }
    text = CUBE + "*NSET, NSET=ALL, GENERATE\n1,8\n"
    for label, (name, nodes) in enumerate(kinds.items(), 1):
        text += f"*ELEMENT, TYPE={name}, ELSET=OLD\n{label},{','.join(map(str, nodes))}\n"
    move = "REFLECT=MIRROR\n1,0,0,1,1,0\n1,0,1\n" if how else "SHIFT\n10,,\n\n"
    text += f"*NCOPY, CHANGE NUMBER=100, OLD SET=ALL, NEW SET=NEW, {move}"
    text += f"*ELCOPY, ELEMENT SHIFT=10, OLD SET=OLD, SHIFT NODES=100, NEW SET=COPY{how}\n"
    mesh = read(tmp_path, text)
    assert mesh.cell_data["label"].tolist() == [1, 2, 3, 4, 11, 12, 13, 14]
    assert mesh.cell_data["COPY"].tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
    values = meshgauge.measure(mesh).values
    assert values[4:] == pytest.approx(values[:4])
    assert points(mesh)[101] == ([2, 0, 0] if how else [10, 0, 0])


@pytest.mark.parametrize("name", ["C3D10", "C3D13", "C3D15", "C3D15V", "C3D20", "C3D27"])
def test_elcopy_reflects_curved_elements(tmp_path: Path, name: str) -> None:
    made = element_type(name)
    assert made is not None
    assert made.kind is not None
    kind = made.kind
    x = reference(kind.name)
    order = np.array(kind.order or range(len(x)))
    filed = np.empty_like(x)
    filed[order] = x  # as Abaqus numbers the nodes
    text = "*NODE, NSET=ALL\n" + "".join(f"{n},{a!r},{b!r},{c!r}\n" for n, (a, b, c) in enumerate(filed.tolist(), 1))
    nodes = list(range(1, len(x) + 1))
    lines = ",\n".join(",".join(map(str, part)) for part in ([1, *nodes][:16], [1, *nodes][16:]) if part)
    text += f"*ELEMENT, TYPE={name}, ELSET=OLD\n{lines}\n"
    text += "*NCOPY, CHANGE NUMBER=100, OLD SET=ALL, REFLECT=POINT\n5,0,0\n"
    text += "*ELCOPY, ELEMENT SHIFT=1, OLD SET=OLD, SHIFT NODES=100, REFLECT\n"
    mesh = read(tmp_path, text)
    assert mesh.type_counts() == {kind.name: 2}
    values = meshgauge.measure(mesh).values
    assert values[0] > 0
    assert values[1] == pytest.approx(values[0])
    np.testing.assert_allclose(mesh.points[mesh.nodes(0)], x)
    certificate = meshgauge.measure(mesh).certificate
    assert certificate.lower[1] == pytest.approx(certificate.lower[0])


def reference(name: str) -> np.ndarray:
    """Places of the nodes of a quadratic cell with straight edges."""
    base = name.rstrip("0123456789")
    shape = SHAPES[base]
    x = np.array(shape.points)
    middles = [x[list(edge)].mean(axis=0) for edge in shape.edges]
    more = []
    if name in ("wedge18", "hexahedron27"):
        faces = {
            "wedge18": ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
            "hexahedron27": ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)),
        }
        more = [x[list(face)].mean(axis=0) for face in faces[name]]
    if name == "hexahedron27":
        more.append(x.mean(axis=0))
    return np.concatenate([x, middles, *([more] if more else [])])


def test_c3d27_may_lack_its_nodes_in_faces(tmp_path: Path) -> None:
    x = reference("hexahedron27")
    text = "*NODE\n" + "".join(f"{n},{a!r},{b!r},{c!r}\n" for n, (a, b, c) in enumerate(x.tolist(), 1))
    nodes = [1, *range(1, 21), 27]
    lines = ",".join(map(str, nodes[:16])) + ",\n" + ",".join(map(str, nodes[16:])) + "\n"
    mesh = read(tmp_path, text + "*ELEMENT, TYPE=C3D27\n" + lines + lines.replace("1,", "2,", 1))
    assert mesh.type_counts() == {"hexahedron20": 2}
    assert mesh.notes == ("Nodes in faces are given of some elements only; those were read without: 2 C3D27.",)


def test_ngen_on_lines_parabolas_and_arcs(tmp_path: Path) -> None:
    head = "*NODE\n1,0,0,0\n5,2,0,0\n9,1,1,0\n11,1,0,0\n13,0,1,0\n"
    assert points(read(tmp_path, head + "*NGEN\n1,5,2\n" + ONE))[3] == [1, 0, 0]
    arc = points(read(tmp_path, head + "*NGEN, LINE=C\n11,13,1,1\n" + ONE))
    assert arc[12] == pytest.approx([0.5**0.5, 0.5**0.5, 0])
    parabola = points(read(tmp_path, head + "*NGEN, LINE=P\n1,5,1,9\n" + ONE))
    assert parabola[2] == pytest.approx([0.5, 0.75, 0])
    assert parabola[3] == pytest.approx([1, 1, 0])
    long_way = points(read(tmp_path, head + "*NGEN, LINE=C\n11,13,1,,0,0,0,0,0,-1\n" + ONE))
    assert long_way[12] == pytest.approx([-(0.5**0.5), -(0.5**0.5), 0])
    with pytest.raises(ReadError, match=r"line 8: \*NGEN from 1 to 5 by 3 does not end at the last node"):
        read(tmp_path, head + "*NGEN\n1,5,3\n" + ONE)
    with pytest.raises(ReadError, match=r"\*NGEN refers to node 6, which does not exist"):
        read(tmp_path, head + "*NGEN\n1,6\n" + ONE)


ONE = "*NODE\n1001,0,0,0\n1002,1,0,0\n1003,0,1,0\n1004,0,0,1\n*ELEMENT,TYPE=C3D4\n1,1001,1002,1003,1004\n"


@pytest.mark.parametrize(
    ("options", "n", "expected"),
    [
        ("", 4, [0.25, 0.5, 0.75]),
        (", BIAS=0.5", 2, [1 / 3]),  # each interval is twice the one before
        (", BIAS=0.5, TWO STEP", 4, [1 / 6, 1 / 3, 2 / 3]),
    ],
)
def test_nfill_fills_between_sets(tmp_path: Path, options: str, n: int, expected: list[float]) -> None:
    text = "*NODE, NSET=LOW\n1,0,0,0\n2,0,1,0\n*NODE, NSET=HIGH\n101,1,0,0\n102,1,1,0\n"
    found = points(read(tmp_path, f"{text}*NFILL{options}\nLOW,HIGH,{n},{100 // n}\n{ONE}"))
    for k, x in enumerate(expected, 1):
        assert found[1 + k * (100 // n)] == pytest.approx([x, 0, 0])
        assert found[2 + k * (100 // n)] == pytest.approx([x, 1, 0])
    with pytest.raises(ReadError, match="between a set of 2 nodes and one of 1"):
        read(tmp_path, f"{text}*NSET, NSET=ONE\n101\n*NFILL\nLOW,ONE,2,50\n{ONE}")
    with pytest.raises(ReadError, match=r"\*NFILL, SINGULAR is not followed"):
        read(tmp_path, f"{text}*NFILL, SINGULAR=1\nLOW,HIGH,2,50\n{ONE}")


def test_ncopy_moves_turns_and_reflects(tmp_path: Path) -> None:
    head = "*NODE, NSET=A\n1,1,0,0\n2,1,2,0\n*NCOPY, CHANGE NUMBER=10, OLD SET=A, "
    for how, first, second in (
        ("SHIFT\n1,0,0\n", [2, 0, 0], [2, 2, 0]),
        ("SHIFT, MULTIPLE=2\n,,\n0,0,0,0,0,1,45\n", [0, 1, 0], [-2, 1, 0]),
        ("REFLECT=POINT\n0,0,0\n", [-1, 0, 0], [-1, -2, 0]),
        ("REFLECT=LINE\n0,0,0,0,1,0\n", [-1, 0, 0], [-1, 2, 0]),
        ("REFLECT=MIRROR\n0,0,0,0,1,0\n0,0,1\n", [-1, 0, 0], [-1, 2, 0]),
        ("POLE\n0,0,0\n", [2, 0, 0], [2, 4, 0]),
    ):
        found = points(read(tmp_path, head + how + ONE))
        assert found[11] == pytest.approx(first, abs=1e-15)
        assert found[12] == pytest.approx(second, abs=1e-15)
    with pytest.raises(ReadError, match="there is no set 'B'"):
        read(tmp_path, head.replace("OLD SET=A", "OLD SET=B") + "SHIFT\n1\n" + ONE)


def test_nodes_in_cylindrical_and_spherical_systems(tmp_path: Path) -> None:
    found = points(read(tmp_path, "*NODE, SYSTEM=C\n1,2,90,3\n*NODE, SYSTEM=S\n2,2,90,30\n" + ONE))
    assert found[1] == pytest.approx([0, 2, 3], abs=1e-15)
    assert found[2] == pytest.approx([0, 3**0.5, 1], abs=1e-15)


def test_data_lines_in_files_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "e.txt").write_text("1,1,2,3,4,5,6,7,8\n** a comment\n")
    (tmp_path / "n.txt").write_text("".join(CUBE.splitlines(keepends=True)[1:5]))
    text = "*NODE, NSET=N, INPUT=n.txt\n" + "".join(CUBE.splitlines(keepends=True)[5:])
    mesh = read(tmp_path, f"{text}*ELEMENT, TYPE=C3D8, INPUT=e.txt\n*ELEMENT, TYPE=C3D8\n10,1,2,3,4,5,6,7,8\n")
    assert mesh.cell_data["label"].tolist() == [1, 10]
    assert meshgauge.measure(mesh).values.tolist() == [1, 1]
    assert str(tmp_path / "e.txt") in mesh.sources
    (tmp_path / "e.txt").write_text("1,1,2,3\n")
    with pytest.raises(ReadError, match=r"line \d+: an element of type C3D8 with 3 nodes"):
        io.read(tmp_path / "a.inp")
    with pytest.raises(ReadError, match=r"line 10: includes .*, which is outside its folder"):
        read(tmp_path, CUBE + "*ELEMENT, TYPE=C3D8, INPUT=../e.txt\n")
    with pytest.raises(ReadError, match=r"line 10: includes gone\.txt, which does not exist"):
        read(tmp_path, CUBE + "*ELEMENT, TYPE=C3D8, INPUT=gone.txt\n")


def test_included_files_that_double_end_with_an_error(tmp_path: Path) -> None:
    for n in range(12):
        (tmp_path / f"e{n}.inp").write_text(f"*INCLUDE, INPUT=e{n + 1}.inp\n" * 2)
    (tmp_path / "e12.inp").write_text(ONE)
    with pytest.raises(ReadError, match=r"includes .*: 1,001 files included"):
        io.read(tmp_path / "e0.inp")
    with pytest.raises(ReadError, match="includes this file again"):
        read(tmp_path, "*INCLUDE, INPUT=a.inp\n")


def test_a_set_that_refers_to_itself_is_an_error(tmp_path: Path) -> None:
    text = CUBE + BRICK + "*ELSET, ELSET=B\n1\n*ELSET, ELSET=B\n" + ",".join("B" * 26) + "\n"
    with pytest.raises(ReadError, match=r"line 15: the set 'B' refers to itself"):
        read(tmp_path, text)
    doubled = CUBE + BRICK + "*ELSET, ELSET=S0\n1\n"
    doubled += "".join(f"*ELSET, ELSET=S{n + 1}\n{','.join([f'S{n}'] * 16)}\n" for n in range(60))
    assert read(tmp_path, doubled).cell_data["S60"].tolist() == [1]


def test_quoted_names_hold_commas(tmp_path: Path) -> None:
    mesh = read(tmp_path, CUBE + BRICK + '*ELSET, ELSET="my set, with comma", INTERNAL\n1\n')
    assert mesh.cell_data["MY SET, WITH COMMA"].tolist() == [1]


def test_sets_of_instances(tmp_path: Path) -> None:
    part = f"*PART, NAME=P\n{CUBE}{BRICK}*END PART\n*ASSEMBLY, NAME=A\n"
    instances = "".join(f"*INSTANCE, NAME=P-{n}, PART=P\n{9 * n},0,0\n*END INSTANCE\n" for n in (1, 2))
    mesh = read(tmp_path, f"{part}{instances}*ELSET, ELSET=S, INSTANCE=P-2\n1\n*END ASSEMBLY\n")
    assert mesh.cell_data["S"].tolist() == [0, 1]
    assert mesh.cell_data["label"].tolist() == [1, 1]


@pytest.mark.parametrize(
    "name",
    ["DCOUP3D", "DCOUP2D", "GAPUNI", "GAPCYL", "SPRINGA", "SPRING1", "DASHPOTA", "U1", "US3", "VU21", "JOINTC",
     "ITSUNI", "PSI24", "CIN3D8", "GK3D18", "GK3D2", "DRAG3D", "PC3D"],
)  # fmt: skip
def test_what_is_no_continuum_is_counted_by_name(tmp_path: Path, name: str) -> None:
    mesh = read(tmp_path, CUBE + BRICK + f"*ELEMENT, TYPE={name}\n9,1,2\n10,2,3\n")
    assert mesh.type_counts() == {"hexahedron": 1}
    assert mesh.notes == (f"Couplings, gaps, springs and user elements are no cells and were left out: 2 {name}.",)


def test_a_type_that_nobody_knows_is_an_error(tmp_path: Path) -> None:
    for name in ("C3D99", "XYZ8", "", "CCL12"):
        with pytest.raises(ReadError, match=f"types that are not known: 1 of type '{name}'"):
            read(tmp_path, CUBE + BRICK + f"*ELEMENT, TYPE={name}\n9,1,2,3\n")


@pytest.mark.parametrize(
    ("name", "corners", "expected"),
    [("COH3D8", 8, "hexahedron"), ("COH3D6", 6, "wedge"), ("GK3D8", 8, "hexahedron"), ("GK3D6N", 6, "wedge"),
     ("COD3D8P", 8, "hexahedron")],
)  # fmt: skip
def test_cohesive_and_gasket_cells_are_kept_and_marked(tmp_path: Path, name: str, corners: int, expected: str) -> None:
    nodes = ",".join(map(str, range(1, corners + 1)))
    mesh = read(tmp_path, CUBE + BRICK + f"*ELEMENT, TYPE={name}\n9,{nodes}\n")
    assert mesh.types.tolist() == [12, BY_NAME[expected].vtk_id]
    marks = is_interface(mesh)
    assert marks is not None
    assert marks.tolist() == [False, True]
    assert "1 cohesive or gasket cell is flat by design" in mesh.notes[0]
    io.write(tmp_path / "b.inp", mesh)
    back = io.read(tmp_path / "b.inp")
    assert back.cell_data["interface"].tolist() == [0, 1]
    assert meshgauge.measure(mesh).summary().n_cells == 1
    assert back.connectivity.tolist() == mesh.connectivity.tolist()


def test_fluid_elements_of_calculix_are_solids(tmp_path: Path) -> None:
    mesh = read(tmp_path, CUBE + BRICK.replace("C3D8", "F3D8"))
    assert mesh.type_counts() == {"hexahedron": 1}
    four = CUBE + "*ELEMENT, TYPE=F3D4\n1,1,2,3,6\n"
    assert read(tmp_path, four).type_counts() == {"tetra": 1}
    assert read(tmp_path, four + "*FLUID PROPERTY, REF NODE=1\n").type_counts() == {"quad": 1}


@pytest.mark.parametrize(("line", "n"), [("1,<L>,0.,0.", 4), ("<N>,1.,0.,0.", 4)])
def test_parameters_are_refused_by_their_card_and_line(line: str, n: int, tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    others = "2,1.,0.,0.\n3,0.,1.,0.\n4,0.,0.,1.\n"
    path.write_text(f"*PARAMETER\nL=2.0\n*NODE\n{line}\n{others}*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n")
    with pytest.raises(ReadError, match=rf"a\.inp, line {n}: .*\*PARAMETER is not followed, write the values out"):
        io.read(path)


@pytest.mark.parametrize("name", ["C3D6", "C3D6H", "DC3D6", "AC3D6", "SC6R"])
def test_wedges_numbered_in_reverse_stay_inverted(name: str, tmp_path: Path) -> None:
    """The format has one order: Abaqus stops on such a cell."""
    path = tmp_path / "a.inp"
    points = "1,0.,0.,0.\n2,1.,0.,0.\n3,0.,1.,0.\n4,0.,0.,1.\n5,1.,0.,1.\n6,0.,1.,1.\n"
    path.write_text(f"*NODE\n{points}*ELEMENT, TYPE={name}\n1,1,3,2,4,6,5\n")
    mesh = io.read(path)
    assert mesh.connectivity.tolist() == [0, 2, 1, 3, 5, 4]
    assert mesh.notes == ()


@pytest.mark.parametrize("comma", ["", ",", " , "])
def test_a_comma_behind_a_keyword_does_not_eat_the_data(comma: str, tmp_path: Path) -> None:
    """It continues the keyword only where options follow."""
    nodes = "1, 0, 0, 0,\n2, 1, 0, 0,\n3, 0, 1, 0,\n4, 0, 0, 1,\n"
    text = f"*NODE{comma}\n{nodes}*ELEMENT, TYPE=C3D4{comma}\n1, 1, 2, 3, 4{comma}\n"
    assert read(tmp_path, text).type_counts() == {"tetra": 1}
    text = f"*NODE\n{nodes}*ELEMENT,\n TYPE=C3D4,\nELSET=A\n1, 1, 2, 3, 4\n"
    assert read(tmp_path, text).blocks[0].name == "A"
