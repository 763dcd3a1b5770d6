"""Tecplot's binary files: versions, orders of bytes, kinds of zones and numbers, sharing, steps, what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of
from plt_files import Zone, drawing, plt

import meshgauge
from meshgauge import io
from meshgauge.cells import SHAPES
from meshgauge.errors import ReadError

CUBE = np.array(SHAPES["hexahedron"].points, float)
CUBE -= CUBE.min(axis=0)
NAMES = ("X", "Y", "Z", "P")
GRID = np.stack([a.ravel(order="F") for a in np.meshgrid(*(np.arange(float(n)) for n in (3, 4, 2)), indexing="ij")])


def columns(points: np.ndarray, *more: np.ndarray) -> list[np.ndarray | None]:
    return [*points.T, *(more or (points.sum(axis=1),))]


def element(cell: str, **options: object) -> Zone:
    points = np.array(SHAPES[cell].points, float)
    return Zone(columns(points), cell, np.arange(len(points))[None], n_points=len(points), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("version", [101, 102, 103, 105, 106, 107, 108, 109, 111, 112])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("name", ["tetra", "hexahedron"])
def test_versions_and_orders_of_bytes(version: int, order: str, name: str, tmp_path: Path) -> None:
    zone = element(name, name="first", auxiliary={"a": "b"})
    mesh = io.read(plt(tmp_path / "a.plt", NAMES, [zone, zone], version=version, order=order))
    assert mesh.type_counts() == {name: 2}
    assert meshgauge.measure(mesh).values == pytest.approx([1, 1])
    assert [block.name for block in mesh.blocks] == ["first", "first"]
    np.testing.assert_allclose(mesh.point_data["P"], mesh.points.sum(axis=1))


@pytest.mark.parametrize("version", [101, 107, 111])
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_points_one_after_another(version: int, kind: str, tmp_path: Path) -> None:
    path = plt(tmp_path / "a.plt", NAMES, [element("tetra"), Zone([*GRID, GRID[0]], shape=(3, 4, 2))],
               version=version, kind=kind, point=True)  # fmt: skip
    mesh = io.read(path)
    assert mesh.type_counts() == {"tetra": 1, "hexahedron": 6}
    assert (meshgauge.measure(mesh).values > 0.999).all()
    assert mesh.stored == ("single" if kind == "f4" else "double")


@pytest.mark.parametrize("name", ["line", "triangle", "quad"])
def test_lines_and_surfaces(name: str, tmp_path: Path) -> None:
    n = {"line": 2, "triangle": 3, "quad": 4}[name]
    zone = Zone(columns(CUBE[:n]), name, np.arange(n)[None], n_points=n)
    assert io.read(plt(tmp_path / "a.plt", NAMES, [zone])).type_counts() == {name: 1}


def test_two_variables_are_a_plane(tmp_path: Path) -> None:
    zone = Zone([CUBE[:4, 0], CUBE[:4, 1]], "quad", np.arange(4)[None], n_points=4)
    mesh = io.read(plt(tmp_path / "a.plt", ("x", "y"), [zone]))
    np.testing.assert_array_equal(mesh.points, CUBE[:4])


@pytest.mark.parametrize("layers", ["all", "fewer"])
@pytest.mark.parametrize("shape", [(3, 4, 2), (3, 4, 1), (3, 1, 1)])
@pytest.mark.parametrize("last", [False, True])
def test_values_of_cells_of_ordered_zones(layers: str, shape: tuple[int, int, int], last: bool, tmp_path: Path) -> None:
    """They stand as if there were as many cells as points; some programs leave the last layer out, others do not."""
    n = int(np.prod(shape))
    cells = [max(k - 1, 1) for k in shape]
    padded = np.zeros(shape[::-1])
    padded[: cells[2], : cells[1], : cells[0]] = np.arange(1, np.prod(cells) + 1).reshape(cells[::-1])
    values = padded.ravel()
    if layers == "fewer":
        axis = max(k for k in range(3) if shape[k] > 1)
        values = values[: n // shape[axis] * (shape[axis] - 1)]
    zone = Zone([*GRID[:, :n], values], shape=shape, of_cells=(3,))
    more = element("tetra")
    mesh = io.read(plt(tmp_path / "a.plt", NAMES, [zone] if last else [zone, more, zone]))
    kept = mesh.cell_data["P"][: int(np.prod(cells))]
    np.testing.assert_array_equal(kept, np.arange(1, np.prod(cells) + 1))
    assert mesh.n_cells == np.prod(cells) * (1 if last else 2) + (not last)


def test_values_of_elements_and_whole_numbers(tmp_path: Path) -> None:
    zone = Zone([*CUBE.T, np.array([7], np.int16)], "hexahedron", np.arange(8)[None], n_points=8, of_cells=(3,))
    mesh = io.read(plt(tmp_path / "a.plt", NAMES, [zone]))
    assert mesh.cell_data["P"].tolist() == [7]


def test_what_is_shared_and_passive(tmp_path: Path) -> None:
    first = element("hexahedron")
    second = Zone([None, None, CUBE[:, 2] + 5, None], "hexahedron", n_points=8, n_cells=1,
                  shared={0: 0, 1: 0}, passive=(3,), nodes_of=0)  # fmt: skip
    mesh = io.read(plt(tmp_path / "a.plt", NAMES, [first, second]))
    assert mesh.type_counts() == {"hexahedron": 2}
    np.testing.assert_array_equal(mesh.points[8:, :2], mesh.points[:8, :2])
    assert not mesh.point_data["P"][8:].any()


def test_what_else_stands_in_a_header(tmp_path: Path) -> None:
    for order in "<>":
        path = plt(tmp_path / "a.plt", NAMES, [element("tetra")], order=order, extra=drawing(order))
        assert io.read(path).n_cells == 1


@pytest.mark.parametrize(
    ("mode", "links"), [(0, [0, 0, 0]), (1, [0, 0, 1, 2, 0, 0]), (2, [0, 0, 0, 0]), (3, [0, 0, 1, 1, 0, 0])]
)
def test_connections_of_faces_are_skipped(mode: int, links: list[int], tmp_path: Path) -> None:
    zone = element("hexahedron", neighbours=True, links=links, mode=mode)
    ordered = Zone([*GRID, GRID[0]], shape=(3, 4, 2), links=links, mode=mode)
    mesh = io.read(plt(tmp_path / "a.plt", NAMES, [zone, ordered, element("tetra")]))
    assert mesh.type_counts() == {"hexahedron": 7, "tetra": 1}


def test_elements_that_count_from_one(tmp_path: Path) -> None:
    zone = element("hexahedron")
    zone.nodes = zone.nodes + 1
    assert io.read(plt(tmp_path / "a.plt", NAMES, [zone])).connectivity.tolist() == list(range(8))


@pytest.mark.parametrize("sides", [("left", "right"), ("right", "left")])
def test_polyhedra(sides: tuple[str, str], tmp_path: Path) -> None:
    prism = mesh_of("penta_prism", n=1)
    cube = CUBE + np.array([5.0, 0, 0])
    rings = [[*face] for face in SHAPES["penta_prism"].faces] + [
        [10 + v for v in f] for f in SHAPES["hexahedron"].faces
    ]
    own = [0] * 7 + [1] * 6
    beside = {"left": own, "right": [-1] * len(own)}
    points = np.concatenate([prism.points, cube])
    zone = Zone(columns(points), faces=(rings, beside[sides[0]], beside[sides[1]]), n_points=18, n_cells=2)
    mesh = io.read(plt(tmp_path / "a.plt", NAMES, [zone, element("tetra")]))
    assert mesh.type_counts() == {"polyhedron": 1, "hexahedron": 1, "tetra": 1}
    assert (meshgauge.measure(mesh).values > 0.9).all()


def test_steps(tmp_path: Path) -> None:
    moved = [element("tetra", strand=0, time=float(t)) for t in (2, 1)]
    path = plt(tmp_path / "a.plt", NAMES, [*moved, element("hexahedron")])
    assert [step.time for step in io.steps(path)] == [1.0, 2.0]
    mesh = io.read(path, step="last")
    assert mesh.type_counts() == {"tetra": 1, "hexahedron": 1}
    assert io.steps(plt(tmp_path / "b.plt", NAMES, [element("tetra")] * 2)) == ()


def test_ascii_files_of_the_same_extension(tmp_path: Path) -> None:
    path = tmp_path / "a.plt"
    path.write_text(
        "VARIABLES = X Y Z\nZONE N=4, E=1, F=FEPOINT, ET=TETRAHEDRON\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 2 3 4\n"
    )
    assert io.read(path).type_counts() == {"tetra": 1}
    binary = plt(tmp_path / "b.dat", NAMES, [element("tetra")])
    assert io.read(binary).n_cells == 1


def changed(tmp_path: Path, old: bytes, new: bytes, **options: object) -> Path:
    path = plt(tmp_path / "a.plt", NAMES, [element("tetra")], **options)  # type: ignore[arg-type]
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new, 1))
    return path


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    cases = {
        "version 191 of Tecplot's binary files cannot be read": (b"#!TDV112", b"#!TDV191"),
        "the order of its bytes": (b"#!TDV112\x01\0\0\0", b"#!TDV112\x02\0\0\0"),
        "variables are stated, and the file is shorter": (b"\x04\0\0\0X\0\0\0", b"\xff\xff\xff\x7fX\0\0\0"),
        "-1 variables are stated": (b"\x04\0\0\0X\0\0\0", b"\xff\xff\xff\xffX\0\0\0"),
        "refers to a point outside of 0..3": (b"\x01\0\0\0\x02\0\0\0\x03\0\0\0", b"\x01\0\0\0\x02\0\0\0\x09\0\0\0"),
        "is of type 9, which is not known": (b"\xff\xff\xff\xff\x04\0\0\0", b"\xff\xff\xff\xff\x09\0\0\0"),
        "numbers of a variable are stated": (b"\x04\0\0\0\x01\0\0\0", b"\xff\xff\xff\x7f\x01\0\0\0"),
        "the mark 0 is not known|the mark": (np.float32(357.0).tobytes(), np.float32(5.0).tobytes()),
    }
    for message, (old, new) in cases.items():
        with pytest.raises(ReadError, match=message):
            io.read(changed(tmp_path, old, new))


def test_a_solution_without_its_grid(tmp_path: Path) -> None:
    path = plt(tmp_path / "a.plt", NAMES, [element("tetra")], file_type=2)
    with pytest.raises(ReadError, match="holds a solution only; its grid is in another file"):
        io.read(path)
    assert io.read(plt(path, NAMES, [element("tetra")], file_type=1)).n_cells == 1


def test_a_file_that_is_cut_off(tmp_path: Path) -> None:
    whole = plt(tmp_path / "a.plt", NAMES, [element("hexahedron"), element("tetra")]).read_bytes()
    for n in (*range(9, len(whole), 7), len(whole) - 1):
        (tmp_path / "b.plt").write_bytes(whole[:n])
        with pytest.raises(ReadError, match=r"b\.plt"):
            io.read(tmp_path / "b.plt")


@pytest.mark.parametrize("version", [102, 112])
def test_the_same_as_by_pynastran(version: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tecplot = pytest.importorskip("pyNastran.converters.tecplot.tecplot")
    monkeypatch.setattr(np, "in1d", np.isin, raising=False)  # it calls a name that NumPy has dropped
    path = plt(tmp_path / "a.plt", ("X", "Y", "Z", "P"), [element("hexahedron")], version=version, kind="f4")
    theirs = tecplot.read_tecplot(str(path), log=None, debug=None).zones[0]
    mine = io.read(path)
    np.testing.assert_allclose(mine.points, theirs.xyz, rtol=1e-6)
    np.testing.assert_array_equal(mine.connectivity.reshape(1, 8), theirs.hexa_elements - theirs.hexa_elements.min())
