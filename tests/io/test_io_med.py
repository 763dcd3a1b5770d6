"""MED: its own order of nodes, groups, polyhedra; what is written is right for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gmsh_files
import numpy as np
import optional
import pytest
from io_meshes import LINEAR, assert_same_cells, mesh_of

import meshgauge
from meshgauge import Mesh, io
from meshgauge.cells import SHAPES
from meshgauge.errors import ReadError
from meshgauge.mesh.regions import regions

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize(("order", "is_incomplete"), [(1, False), (2, False), (2, True)])
def test_what_gmsh_writes_is_read_right(tmp_path: Path, order: int, is_incomplete: bool) -> None:
    gmsh = optional.gmsh()
    path = tmp_path / "a.med"
    gmsh_files.three_bodies(gmsh, path, order, is_incomplete=is_incomplete)
    mesh = io.read(path)
    assert mesh.notes == ()
    assert gmsh_files.solids(mesh) == gmsh_files.CELLS
    gmsh_files.assert_straight(mesh)
    ids, names = regions(mesh)
    assert {name: int((ids == k).sum()) for k, name in enumerate(names)} == gmsh_files.BODIES | dict([gmsh_files.FLOOR])


def test_gmsh_reads_what_we_write(tmp_path: Path) -> None:
    gmsh = optional.gmsh()
    mesh = mesh_of(*LINEAR).replace(cell_data={"material": np.array([1, 1, 1, 1, 2, 2, 2, 2])})
    io.write(tmp_path / "a.med", mesh)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.med"))
        _, tags, _ = gmsh.model.mesh.getElements(3)
        quality = [gmsh.model.mesh.getElementQualities(of_type, "minSJ") for of_type in tags]
        groups = {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups(3)}
    finally:
        gmsh.finalize()
    assert len(np.concatenate(quality)) == 8
    assert np.concatenate(quality).min() > 0
    assert groups == {"material 1", "material 2"}
    back = io.read(tmp_path / "a.med")
    assert meshgauge.measure(back).values == pytest.approx(np.ones(8))
    assert back.notes == ()
    assert regions(back)[1] == ("material 1", "material 2")


def test_curved_cells_survive_a_round_trip(tmp_path: Path) -> None:
    gmsh = optional.gmsh()
    gmsh_files.three_bodies(gmsh, tmp_path / "a.msh", 2, is_incomplete=True)
    mesh = io.read(tmp_path / "a.msh")
    assert io.write(tmp_path / "a.med", mesh) == ("The format keeps cells by type: their order changed.",)
    back = io.read(tmp_path / "a.med")
    assert back.type_counts() == mesh.type_counts()
    lost = io.write(tmp_path / "a.inp", back)
    assert lost == ("The format could not hold the cell data 'gmsh:geometrical'.",)
    assert sorted(regions(io.read(tmp_path / "a.inp"))[1]) == sorted(regions(mesh)[1])
    assert regions(back)[1] == regions(mesh)[1]
    gmsh_files.assert_straight(back)


def test_cells_that_are_by_type_already_keep_their_order_without_a_note(tmp_path: Path) -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (2, 0, 0), (1, 0, 1)]
    cells = [("tetra", [(0, 1, 2, 3), (1, 4, 2, 3)]), ("pyramid", [(1, 5, 4, 6, 3)])]
    for blocks, has_note in ((cells, True), (cells[::-1], False)):  # PY5 comes before TE4
        mesh = Mesh.from_arrays(points, blocks)
        assert any("order" in note for note in io.write(tmp_path / "a.med", mesh, overwrite=True)) == has_note
        assert io.read(tmp_path / "a.med").types.tolist() == [14, 10, 10]


def test_files_of_meshio_have_vtks_order(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    mesh = mesh_of("tetra", "hexahedron", n=1)
    meshio.Mesh(mesh.points, [("tetra", [mesh.nodes(0)]), ("hexahedron", [mesh.nodes(1)])]).write(tmp_path / "a.med")
    back = io.read(tmp_path / "a.med")
    assert meshgauge.measure(back).values == pytest.approx(np.ones(2))
    assert "VTK's was taken, as meshio writes" in back.notes[0]


def test_a_mirrored_mesh_stays_mirrored(tmp_path: Path) -> None:
    mesh = mesh_of("tetra", "wedge", "hexahedron", n=1)
    io.write(tmp_path / "a.med", mesh.replace(points=mesh.points * (1, 1, -1)))
    back = io.read(tmp_path / "a.med")
    assert meshgauge.measure(back).values == pytest.approx(-np.ones(3))
    assert not back.notes


def med(path: Path, points: np.ndarray, cells: dict[str, dict[str, np.ndarray]], **attributes: Any) -> Path:
    """A file of one mesh, with the families that its cells name: -1 has two groups, -2 one."""
    with h5py.File(path, "w") as file:
        mesh = file.create_group("ENS_MAA/m")
        for key, value in {"ESP": 3, "DIM": 3, "TYP": 0, **attributes}.items():
            mesh.attrs[key] = value
        step = mesh.create_group("-0000000000000000001-0000000000000000001")
        step["NOE/COO"] = points.T.ravel()
        for code, arrays in cells.items():
            for key, values in arrays.items():
                step[f"MAI/{code}/{key}"] = values
            step[f"MAI/{code}/NOD"].attrs["NBR"] = len(arrays.get("FAM", [0]))
        for number, names in ((-1, ("rotor", "all")), (-2, ("all",))):
            family = file.create_group(f"FAS/m/ELEME/FAM_{-number}")
            family.attrs["NUM"] = number
            rows = [list(name.encode().ljust(80, b"\0")) for name in names]
            family["GRO/NOM"] = np.array(rows, np.int8)
    return path


PRISM = np.array(SHAPES["penta_prism"].points)


def polyhedra() -> dict[str, np.ndarray]:
    """Two pentagonal prisms by their faces, one in each family, on the same points."""
    faces = [*SHAPES["penta_prism"].faces] * 2
    ends = np.cumsum([0, *(len(face) for face in faces)])
    nodes = np.concatenate([np.array(face) for face in faces]) + 1
    return {"NOD": nodes, "INN": ends + 1, "IFN": np.array([1, 8, 15]), "FAM": np.array([-1, -2])}


def test_polyhedra_polygons_and_groups(tmp_path: Path) -> None:
    polygon = {"NOD": np.arange(1, 6), "INN": np.array([1, 6]), "FAM": np.array([0])}
    mesh = io.read(med(tmp_path / "a.med", PRISM, {"POE": polyhedra(), "POG": polygon}))
    assert mesh.type_counts() == {"polyhedron": 2, "polygon": 1}
    assert meshgauge.measure(mesh).values[:2] == pytest.approx(np.ones(2))
    assert mesh.cell_data["med:group"].tolist() == [1, 2, 0]
    ids, names = regions(mesh)
    assert [names[i] for i in ids] == ["rotor + all", "all", "no group"]


def of_version_2(path: Path, fields: bool = False) -> Path:
    """The same file as version 2 has it: no steps, families within the mesh, names a byte longer, polyhedra's indices
    under each other's name."""
    old = path.with_name(f"old_{path.name}")
    with h5py.File(path) as new, h5py.File(old, "w") as file:
        for name, mesh in new["ENS_MAA"].items():
            target = file.create_group(f"ENS_MAA/{name}")
            target.attrs.update({"DIM": int(mesh.attrs["DIM"]), "TYP": 0})
            (step,) = mesh.values()
            for key in step:
                step.copy(key, target)
            if "MAI/POE" in target:
                target.move("MAI/POE/INN", "MAI/POE/x")
                target.move("MAI/POE/IFN", "MAI/POE/INN")
                target.move("MAI/POE/x", "MAI/POE/IFN")
            new.copy(f"FAS/{name}", target, "FAS")
            for family in target["FAS"].get("ELEME", {}).values():
                names = family["GRO/NOM"][...].ravel()
                del family["GRO/NOM"]
                family["GRO/NOM"] = np.append(names, np.int8(0))
        file.create_group("INFOS_GENERALES").attrs.update({"MAJ": 2, "MIN": 2, "REL": 2})
        if fields:
            file.create_group("CHA/temperature/x")
    return old


def test_files_of_version_2(tmp_path: Path) -> None:
    polygon = {"NOD": np.arange(1, 6), "INN": np.array([1, 6]), "FAM": np.array([0])}
    path = med(tmp_path / "a.med", PRISM, {"POE": polyhedra(), "POG": polygon})
    new, old = io.read(path), io.read(of_version_2(path))
    assert old.type_counts() == {"polyhedron": 2, "polygon": 1}
    assert_same_cells(new, old)
    assert old.cell_data["med:group"].tolist() == [1, 2, 0]
    assert old.field_data["med:group:names"].tolist() == ["rotor + all", "all"]
    assert old.notes == ()
    (note,) = io.read(of_version_2(path, fields=True)).notes
    assert "Fields of a file of MED's version 2 are not read" in note


def test_nodes_of_version_2_are_in_meds_order(tmp_path: Path) -> None:
    mesh = mesh_of(*LINEAR)
    io.write(tmp_path / "a.med", mesh)
    new, old = io.read(tmp_path / "a.med"), io.read(of_version_2(tmp_path / "a.med"))
    assert_same_cells(new, old)
    assert meshgauge.measure(old).values == pytest.approx(np.ones(old.n_cells))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"NOD": np.ones(59, int)}, "does not fit its 59 items"),
        ({"IFN": np.array([1, 8, 16])}, "an index of polygons or polyhedra does not fit its 14 items"),
        ({"NOD": polyhedra()["NOD"] + 1}, r"refer to point 11, which is outside 1\.\.10"),
        ({"FAM": np.array([0])}, "1 families of POE are stated, but 2 were found"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, change: dict[str, np.ndarray], message: str) -> None:
    path = med(tmp_path / "a.med", PRISM, {"POE": polyhedra() | change})
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("code", "nodes", "message"),
    [("XYZ", 4, "cells of type 'XYZ' are not known"), ("TE4", 5, "5 nodes of cells of type TE4, which have 4")],
)
def test_unknown_types_and_odd_lengths_are_errors(tmp_path: Path, code: str, nodes: int, message: str) -> None:
    with pytest.raises(ReadError, match=message):
        io.read(med(tmp_path / "a.med", PRISM, {code: {"NOD": np.arange(1, nodes + 1)}}))
    with pytest.raises(ReadError, match="mesh 'm' is structured"):
        io.read(med(tmp_path / "a.med", PRISM, {"POE": polyhedra()}, TYP=1))
