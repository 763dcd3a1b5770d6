"""What a format has no place for is left out with a note or refused, in our own words; names of groups stay."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import optional
import pytest
from fluent_files import cff
from io_meshes import mesh_of

from meshgauge import io
from meshgauge.errors import ReadError, WriteError
from meshgauge.io.formats.vtk import legacy
from meshgauge.mesh import CellBlock, Mesh
from meshgauge.mesh.regions import regions

POINTS = np.random.default_rng(0).random((30, 3))
CELLS = {
    "line": ("tetra", "line"),
    "triangle": ("tetra", "triangle"),
    "vertex": ("tetra", "vertex"),
    "quad8": ("tetra", "quad8"),
    "curved": ("tetra10",),
    "curved and not": ("tetra", "tetra10"),
    "brick": ("hexahedron27",),
    "wedge18": ("wedge18",),
    "prism": ("penta_prism",),
    "pyramid13": ("pyramid13",),
    "voxel": ("voxel",),
    "mixed": ("tetra", "hexahedron", "wedge", "pyramid"),
    "none": (),
}
N_NODES = {"tetra": 4, "line": 2, "triangle": 3, "vertex": 1, "quad8": 8, "tetra10": 10, "hexahedron27": 27,
           "wedge18": 18, "penta_prism": 10, "pyramid13": 13, "voxel": 8, "hexahedron": 8, "wedge": 6,
           "pyramid": 5, "quad": 4}  # fmt: skip


def mesh(*names: str) -> Mesh:
    return Mesh.from_arrays(POINTS, [(name, [np.arange(N_NODES[name])]) for name in names])


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("extension", [".vol", ".dat", ".xdmf", ".avs", ".med", ".ugrid", ".su2", ".inp", ".msh"])
def test_every_error_is_in_our_words(extension: str, tmp_path: Path) -> None:
    data = {"v": np.zeros((30, 7)), "o": np.zeros((30, 3, 3)), "s": np.array(["x"] * 30), "n": np.arange(30.0)}
    for name, cells in CELLS.items():
        for given in (
            mesh(*cells),
            mesh(*cells).replace(point_data=data, cell_data={"t": np.array(["x"] * len(cells))}),
        ):
            path = tmp_path / f"{name}{extension}"
            path.unlink(missing_ok=True)
            error = _error(path, given)
            if error is not None:
                assert re.search("^cells of type|the format (holds|cannot hold)", error), (name, error)


def _error(path: Path, given: Mesh) -> str | None:
    """What is said of a mesh that is not written, without the name of the file."""
    try:
        io.write(path, given)
    except WriteError as error:
        return str(error).removeprefix(f"{path}: ")
    return None


@pytest.mark.parametrize("extension", [".ugrid", ".b8.ugrid", ".su2", ".dat"])
@pytest.mark.parametrize("lesser", ["line", "vertex", "quad8"])
def test_cells_of_lower_dimension_are_left_out_with_a_note(extension: str, lesser: str, tmp_path: Path) -> None:
    given = mesh("tetra", lesser, "tetra").replace(
        cell_data={"n": np.arange(3)}, blocks=(CellBlock("a", 0, 1), CellBlock("b", 1, 3))
    )
    notes = io.write(tmp_path / f"a{extension}", given)
    assert f"The format could not hold cells of lower dimension: 1 {lesser} left out." in notes
    back = io.read(tmp_path / f"a{extension}")
    assert (back.type_counts(), back.n_points) == ({"tetra": 2}, 30)
    if extension == ".dat":
        assert back.cell_data["n"].tolist() == [0, 2]


def test_solids_are_never_left_out(tmp_path: Path) -> None:
    for extension in (".ugrid", ".su2", ".dat"):
        with pytest.raises(WriteError, match="tetra10"):
            io.write(tmp_path / f"a{extension}", mesh("tetra", "tetra10"))
    assert io.write(tmp_path / "a.su2", mesh("tetra", "triangle")) == ()
    assert io.read(tmp_path / "a.su2").n_cells == 2


def test_lines_of_a_plane_are_markers(tmp_path: Path) -> None:
    flat = mesh("quad", "line").replace(points=POINTS * (1, 1, 0))
    assert io.write(tmp_path / "a.su2", flat) == ()
    assert io.read(tmp_path / "a.su2").type_counts() == {"quad": 1, "line": 1}


def test_regions_of_any_format_are_named_groups_of_gmsh(tmp_path: Path) -> None:
    cells = mesh("tetra", "tetra", "triangle")
    blocks = tuple(CellBlock(name, k, k + 1) for k, name in enumerate(("iron", 'a "b"\\', "wall")))
    io.write(tmp_path / "a.msh", cells.replace(blocks=blocks))
    assert b'$PhysicalNames\n3\n2 3 "wall"\n3 1 "iron"\n3 2 "a \'b\'"\n$End' in (tmp_path / "a.msh").read_bytes()
    names = np.array(["wood"])
    material = cells.replace(cell_data={"abaqus:material": np.array([1, 0, 1])},
                             field_data={"abaqus:material:names": names})  # fmt: skip
    assert io.write(tmp_path / "b.msh", material) == ()
    back = io.read(tmp_path / "b.msh")
    assert back.cell_data["gmsh:physical"].tolist() == [1, 0, 1]
    assert regions(back)[1] == ("no physical", "wood")
    numbered = cells.replace(cell_data={"nastran:property": np.array([7, 9, 7])})
    io.write(tmp_path / "c.msh", numbered)
    back = io.read(tmp_path / "c.msh")
    assert back.cell_data["gmsh:physical"].tolist() == [7, 9, 7]
    assert regions(back)[1] == ("property 7", "property 9")


def test_gmsh_reads_the_groups(tmp_path: Path) -> None:
    gmsh = optional.gmsh()
    two = mesh_of("tetra", n=2).replace(blocks=(CellBlock("iron", 0, 1), CellBlock("wood", 1, 2)))
    io.write(tmp_path / "a.msh", two)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        assert {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()} == {"iron", "wood"}
    finally:
        gmsh.finalize()


def test_names_of_groups_in_med_are_not_lost(tmp_path: Path) -> None:
    given = mesh_of("tetra", n=2).replace(
        cell_data={"group": np.array([1, 2])},
        field_data={"group:names": np.array(["iron", "wood"]), "group:numbers": np.array([1, 2])},
    )
    assert io.write(tmp_path / "a.med", given) == ()
    assert regions(io.read(tmp_path / "a.med"))[1] == ("iron", "wood")


@pytest.mark.parametrize(
    ("name", "written"), [("a b", '"a b"'), ("1st", '"1st"'), ("plain-1", "plain-1"), ("é", '"é"')]
)
def test_names_of_abaqus_are_quoted_where_they_need_it(name: str, written: str, tmp_path: Path) -> None:
    cells = mesh_of("tetra", n=2)
    blocks = (CellBlock(name, 0, 1), CellBlock("other", 1, 2))
    io.write(tmp_path / "a.inp", cells.replace(blocks=blocks))
    assert f"ELSET={written}\n" in (tmp_path / "a.inp").read_text(encoding="utf-8")
    assert io.read(tmp_path / "a.inp").blocks == blocks
    data = {"abaqus:material": np.array([1, 1]), f"{name} 2": np.array([0, 1], np.uint8)}
    io.write(tmp_path / "b.inp", cells.replace(cell_data=data, field_data={"abaqus:material:names": np.array([name])}))
    text = (tmp_path / "b.inp").read_text(encoding="utf-8")
    assert f"MATERIAL={written}\n" in text
    back = io.read(tmp_path / "b.inp")
    assert back.cell_data[f"{name} 2".upper()].tolist() == [0, 1]
    assert back.field_data["abaqus:material:names"].tolist() == [name]


PLANE = "(10 (1 1 4 1 2)(\n0 0\n1 0\n1 1\n0 1\n))\n"
SPACE = "(10 (1 1 4 1 3)(\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n))\n"
SIDES = "(12 (2 1 1 1 3))\n(13 (3 1 4 3 2)(\n1 2 1 0\n2 3 1 0\n3 4 1 0\n4 1 1 0\n))\n"


@pytest.mark.parametrize("text", [f"(2 2)\n{PLANE}{SIDES}", f"(2 2)\n{SIDES}{PLANE}", f"(0 0)\n{SPACE}{SIDES}"])
@pytest.mark.parametrize("extension", [".msh", ".cas"])
def test_fluent_in_two_dimensions_is_one_message(text: str, extension: str, tmp_path: Path) -> None:
    (tmp_path / f"a{extension}").write_text(f'(0 "x")\n{text}')
    with pytest.raises(ReadError, match=rf"{extension}: is a mesh of two dimensions, which has no solid cells$"):
        io.read(tmp_path / f"a{extension}")


def test_fluent_in_two_dimensions_in_hdf5(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = cff(tmp_path / "a.cas.h5", mesh_of("tetra"))
    with h5py.File(path, "r+") as file:
        next(iter(file["meshes"].values())).attrs["dimension"] = 2
    with pytest.raises(ReadError, match=r"is a mesh of two dimensions, which has no solid cells$"):
        io.read(path)


def test_counts_of_vtk_are_those_of_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From version 5 on the section of cells counts their offsets, one more."""
    io.write(tmp_path / "a.vtk", mesh_of("tetra", n=2))
    monkeypatch.setattr(legacy, "_stated_counts", lambda path: {"CELLS": 4})
    with pytest.raises(ReadError, match="states 3 cells, but 2 could be read"):
        legacy.read(tmp_path / "a.vtk")
