"""PLOT3D's grids in every layout, the same as VTK reads them; hidden cells; what is none."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError

SHAPES = ((4, 3, 5), (2, 3, 3))
LAYOUTS = [("text", "", "f8", *rest) for rest in itertools.product((False, True), (False, True), (3, 2))] + list(
    itertools.product(("records", "bytes"), "<>", ("f4", "f8"), (False, True), (False, True), (3, 2))
)


def block(shape: tuple[int, ...], shift: float = 0.0) -> np.ndarray:
    grid = np.meshgrid(*(np.arange(n) + 0.25 for n in shape), indexing="ij")
    return np.stack([axis.ravel(order="F") for axis in grid]) + shift


def write(
    path: Path, kind: str, order: str, real: str, several: bool, blanked: bool, dimension: int, *, holes: int = 0
) -> list[np.ndarray]:
    shapes = [shape[:dimension] for shape in (SHAPES if several else SHAPES[:1])]
    grids = [block(shape, 10.0 * n) for n, shape in enumerate(shapes)]
    blanks = [np.where(np.arange(grid.shape[1]) < holes, 0, 1) for grid in grids]
    if kind == "text":
        text = f"{len(shapes)}\n" if several else ""
        text += "".join(" ".join(map(str, shape)) + "\n" for shape in shapes)
        for grid, blank in zip(grids, blanks, strict=True):
            text += "\n".join(" ".join(map(str, axis)) for axis in grid) + "\n"
            text += " ".join(map(str, blank)) + "\n" if blanked else ""
        path.write_text(text)
        return grids

    def record(data: bytes) -> bytes:
        mark = np.array([len(data)], f"{order}i4").tobytes() if kind == "records" else b""
        return mark + data + mark

    out = record(np.array([len(shapes)], f"{order}i4").tobytes()) if several else b""
    out += record(np.array(shapes, f"{order}i4").tobytes())
    for grid, blank in zip(grids, blanks, strict=True):
        out += record(grid.astype(order + real).tobytes() + (blank.astype(f"{order}i4").tobytes() if blanked else b""))
    path.write_bytes(out)
    return grids


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_every_layout(layout: tuple[str, str, str, bool, bool, int], tmp_path: Path) -> None:
    grids = write(tmp_path / "a.x", *layout)
    mesh = io.read(tmp_path / "a.x")
    dimension = layout[-1]
    np.testing.assert_array_equal(mesh.points[:, :dimension], np.concatenate(grids, axis=1).T)
    cells = [int(np.prod([n - 1 for n in shape[:dimension]])) for shape in SHAPES[: 2 if layout[3] else 1]]
    assert mesh.type_counts() == {"hexahedron" if dimension == 3 else "quad": sum(cells)}
    assert [b.stop - b.start for b in mesh.blocks] == cells
    assert mesh.stored == ("single" if layout[2] == "f4" else "double")
    assert ("iblank" in mesh.point_data) == layout[4]
    assert mesh.notes == ()
    if dimension == 3:
        assert (meshgauge.measure(mesh).values == 1).all()


@pytest.mark.parametrize("layout", [one for one in LAYOUTS if one[-1] == 3 and one[0] != "text"][::3], ids=str)
def test_the_same_as_by_vtk(layout: tuple[str, str, str, bool, bool, int], tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtkmodules.vtkIOParallel")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    path = tmp_path / "a.x"
    write(path, *layout, holes=3)
    reader = vtk.vtkMultiBlockPLOT3DReader()
    reader.SetAutoDetectFormat(1)
    reader.SetFileName(str(path))
    reader.Update()
    blocks = [reader.GetOutput().GetBlock(n) for n in range(reader.GetOutput().GetNumberOfBlocks())]
    mesh = io.read(path)
    np.testing.assert_array_equal(
        mesh.points, np.concatenate([vtk_to_numpy(one.GetPoints().GetData()) for one in blocks])
    )
    theirs = [not one.IsCellVisible(c) for one in blocks for c in range(one.GetNumberOfCells())]
    mine = np.zeros(mesh.n_cells, bool) if mesh.is_ghost is None else mesh.is_ghost
    assert mine.tolist() == theirs


def test_cells_with_a_blanked_corner_are_hidden(tmp_path: Path) -> None:
    write(tmp_path / "a.p3d", "bytes", "<", "f8", True, True, 3, holes=2)
    mesh = io.read(tmp_path / "a.p3d")
    assert mesh.cell_data["vtkGhostType"].tolist()[:4] == [32, 32, 0, 0]
    assert mesh.notes == ("3 cells are ghosts or hidden, and are not looked at.",)


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s,
        lambda s: s.replace("\n", "\r\n"),
        lambda s: s.replace(" ", ", "),
        lambda s: s.replace("0.25 1.25", "  0.25\n\n1.25"),
        lambda s: s.replace("0.25 0.25 0.25 0.25 ", "4*0.25 "),
        lambda s: re.sub(r"\b0\.25\b", "2.5D-01", s),
        lambda s: "\n\n " + s,
        lambda s: s.replace("\n", " "),
    ],
)
def test_ways_to_write_a_text(change: object, tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    grids = write(path, "text", "", "f8", True, False, 3)
    path.write_bytes(change(path.read_text()).encode())  # type: ignore[operator]
    np.testing.assert_array_equal(io.read(path).points, np.concatenate(grids, axis=1).T)


def test_many_blocks(tmp_path: Path) -> None:
    n = 1500
    text = f"{n}\n" + "2 2 2\n" * n + " ".join(map(str, block((2, 2, 2)).ravel())) * 1
    text += "".join("\n" + " ".join(map(str, block((2, 2, 2), k).ravel())) for k in range(1, n))
    (tmp_path / "a.xyz").write_text(text)
    assert io.read(tmp_path / "a.xyz").type_counts() == {"hexahedron": n}
    raw = np.concatenate([[n], [2] * 3 * n]).astype("<i4").tobytes()
    raw += b"".join(block((2, 2, 2), k).astype("<f4").tobytes() for k in range(n))
    (tmp_path / "b.xyz").write_bytes(raw)
    assert io.read(tmp_path / "b.xyz").type_counts() == {"hexahedron": n}


@pytest.mark.parametrize("extension", [".xyz", ".p3d", ".x", ".g"])
def test_what_is_none(extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{extension}"
    for content in (b"3\nwater\nO 0 0 0\nH 0 0 1\nH 0 1 0\n", b"0.1 0.2 0.3\n0.3 0.4 0.5\n", b"xof 0303txt 0032\n",
                    bytes(range(256)) * 4):  # fmt: skip
        path.write_bytes(content)
        with pytest.raises(ReadError, match=r"does not begin as a file with the extension"):
            io.read(path)
    path.write_bytes(b"2 2 2\n" + b"1.5 " * 23)
    with pytest.raises(ReadError, match="holds 26 numbers, which are those of no grid of PLOT3D"):
        io.read(path)
    path.write_bytes(b"99999999 99999999 99999999\n1.5 2.5\n")
    with pytest.raises(ReadError, match="those of no grid"):
        io.read(path)
    write(path, "records", "<", "f8", True, True, 3)
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(ReadError):
        io.read(path)


def test_exodus_files_of_one_extension(tmp_path: Path, shared: Path) -> None:
    found = sorted(shared.glob("meshes/**/*.e")) + sorted(shared.glob("cases/**/*.e"))
    (tmp_path / "a.g").write_bytes(found[0].read_bytes())
    assert io.read(tmp_path / "a.g").n_cells == io.read(found[0]).n_cells
