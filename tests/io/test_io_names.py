"""Names that break files: escaped or written out with a note; nothing replaces a file that does not read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

from meshgauge import io
from meshgauge.mesh import CellBlock, Mesh

pytestmark = pytest.mark.usefixtures("readers_here")

NAMES = ("p<0", "a & b", '5" pipe', "it's", "a>b", "u_{1}", "{}", "100 %", "a, b", "é ü 漢", "METADATA", "a\tb", "a\nb")
HOSTILE = ("a\x00b", "\x1b[31m", "a\u2028b", "a\u0085b", "\udcff", "\x9b")


def loaded(names: tuple[str, ...]) -> Mesh:
    mesh = mesh_of("tetra", "hexahedron")
    rng = np.random.default_rng(0)
    return mesh.replace(
        point_data={name: rng.random(mesh.n_points) for name in names},
        cell_data={name: rng.integers(0, 9, mesh.n_cells) for name in names},
        field_data={name: np.array([1.0, 2.0]) for name in names},
    )


def columns(mesh: Mesh) -> list[list[float]]:
    return sorted(values.tolist() for values in mesh.point_data.values())


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
@pytest.mark.parametrize("names", [NAMES, HOSTILE])
def test_no_name_costs_an_array(tmp_path: Path, extension: str, names: tuple[str, ...]) -> None:
    pv = pytest.importorskip("pyvista")
    path = tmp_path / f"a{extension}"
    mesh = loaded(names)
    lost = io.write(path, mesh)
    back = io.read(path)
    assert columns(back) == columns(mesh)
    kept = set(back.point_data)
    for name in names:
        assert name in kept or any(repr(name) in sentence for sentence in lost)
    assert not any(ord(c) < 32 or c in "\u2028\u0085" for name in kept for c in name)
    grid = pv.read(path)
    assert sorted(np.asarray(grid.point_data[name]).tolist() for name in grid.point_data) == columns(mesh)
    if extension != ".vtk":
        assert {"p<0", "a & b", '5" pipe', "u_{1}"} <= kept or names is HOSTILE


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf", ".msh", ".inp", ".su2", ".mesh", ".xdmf", ".ugrid"])
def test_no_name_of_a_region_breaks_a_file(tmp_path: Path, extension: str) -> None:
    mesh = mesh_of("tetra", "hexahedron")
    blocks = (CellBlock("a\u2028b\x00", 0, 2), CellBlock("c\nd\x85", 2, 4))
    path = tmp_path / f"a{extension}"
    io.write(path, mesh.replace(blocks=blocks))
    assert io.read(path).type_counts() == mesh.type_counts()


@pytest.mark.parametrize("name", [", ", "von Mises stress", "\xa0"])
def test_commas_and_blanks_do_not_hang_tecplot(tmp_path: Path, name: str) -> None:
    mesh = mesh_of("tetra")
    lost = io.write(tmp_path / "a.dat", mesh.replace(point_data={name: np.ones(mesh.n_points)}))
    assert any(repr(name) in sentence for sentence in lost)
    assert io.read(tmp_path / "a.dat").n_cells == 2


def test_names_that_become_the_same_stay_apart(tmp_path: Path) -> None:
    mesh = mesh_of("tetra")
    data = {"a\\x1b": np.zeros(mesh.n_points), "a\x1b": np.ones(mesh.n_points)}
    io.write(tmp_path / "a.vtu", mesh.replace(point_data=data))
    assert sorted(values[0] for values in io.read(tmp_path / "a.vtu").point_data.values()) == [0.0, 1.0]


def test_one_name_of_points_and_cells_in_tecplot(tmp_path: Path) -> None:
    mesh = mesh_of("tetra")
    given = mesh.replace(point_data={"a": np.ones(8), "X": np.zeros(8)}, cell_data={"a": np.ones(2)})
    lost = io.write(tmp_path / "a.dat", given)
    assert [sentence.split(":")[0] for sentence in lost] == [
        "The point data 'X' is called 'X_of_points'",
        "The cell data 'a' is called 'a_of_cells'",
    ]
    back = io.read(tmp_path / "a.dat")
    assert (set(back.point_data), set(back.cell_data)) == ({"a", "X_of_points"}, {"a_of_cells"})
    np.testing.assert_array_equal(back.points, mesh.points)


@pytest.mark.parametrize("extension", [".vol", ".avs"])
def test_field_data_that_name_no_group_are_left_out(tmp_path: Path, extension: str) -> None:
    lost = io.write(tmp_path / f"a{extension}", mesh_of("tetra").replace(field_data={"time": np.array([0.25])}))
    assert lost == ("The format could not hold the field data 'time'.",)


def test_texts_of_the_file_lose_control_characters_with_a_note(tmp_path: Path) -> None:
    mesh = mesh_of("tetra").replace(field_data={"by": np.array(["one\x01", "two"])})
    lost = io.write(tmp_path / "a.vtu", mesh)
    assert any("'by' were changed" in sentence for sentence in lost)
    assert io.read(tmp_path / "a.vtu").n_cells == mesh.n_cells
    assert not any("changed" in sentence for sentence in io.write(tmp_path / "b.vtu", mesh_of("tetra")))
