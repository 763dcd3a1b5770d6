"""CGNS: sections of every kind, polyhedra, structured zones, families and boundaries, and what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gmsh_files
import numpy as np
import optional
import pytest
from cgns_files import base, mixed, polyhedral, put, section, zone
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh.regions import regions

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize(("order", "is_incomplete"), [(1, False), (2, False), (2, True)])
def test_what_gmsh_writes_is_read_right(tmp_path: Path, order: int, is_incomplete: bool) -> None:
    gmsh = optional.gmsh()
    path = tmp_path / "a.cgns"
    gmsh_files.three_bodies(gmsh, path, order, is_incomplete=is_incomplete)
    mesh = io.read(path)
    assert mesh.notes == ()
    assert gmsh_files.solids(mesh) == gmsh_files.CELLS
    gmsh_files.assert_straight(mesh)
    ids, names = regions(mesh)
    assert {name: int((ids == k).sum()) for k, name in enumerate(names)} == gmsh_files.BODIES | dict([gmsh_files.FLOOR])


@pytest.mark.parametrize("has_offsets", [True, False])
def test_mixed_sections(tmp_path: Path, has_offsets: bool) -> None:
    mesh = mesh_of(*LINEAR)
    back = io.read(mixed(tmp_path / "a.cgns", mesh, has_offsets=has_offsets))
    np.testing.assert_array_equal(back.types, mesh.types)
    np.testing.assert_array_equal(back.connectivity, mesh.connectivity)
    assert back.cell_data["Pressure"].tolist() == list(range(8))
    np.testing.assert_allclose(back.point_data["Density"], mesh.points[:, 0], rtol=1e-6)
    assert back.notes == ()


@pytest.mark.parametrize("form", ["offsets", "sizes", "parents"])
def test_polyhedra(tmp_path: Path, form: str) -> None:
    back = io.read(polyhedral(tmp_path / "a.cgns", mesh_of(*LINEAR, "penta_prism", n=2), form))
    solid = back.types != 5
    assert back.type_counts() == {"tetra": 2, "pyramid": 2, "wedge": 2, "hexahedron": 2, "polyhedron": 2, "triangle": 2}
    assert meshgauge.measure(back).values[solid] == pytest.approx(np.ones(10))
    assert sorted({b.name for b in back.blocks}) == ["Wall", "Zone"]


def test_structured_zones_with_families_rind_and_degrees(tmp_path: Path) -> None:
    x = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0), np.arange(2.0), indexing="ij"), axis=-1)  # i, j, k
    path = tmp_path / "a.cgns"
    with h5py.File(path, "w") as file:
        root = base(file)
        put(root, "Fluid", "Family_t")
        sizes = np.array([[4, 3, 2], [3, 2, 1], [0, 0, 0]])
        made = zone(root, "First", x.transpose(2, 1, 0, 3), 6, sizes, "Structured")
        put(made, "FamilyName", "FamilyName_t", "Fluid")
        solution = put(made, "Solution", "FlowSolution_t")
        put(solution, "GridLocation", "GridLocation_t", "CellCenter")
        put(solution, "Order", "DataArray_t", np.arange(6).reshape(1, 2, 3))
        wide = np.pad(x, ((1, 0), (0, 1), (0, 0), (0, 0)), constant_values=99.0)
        second = zone(root, "Second", wide.transpose(2, 1, 0, 3) + 10, 6, sizes, "Structured")
        put(second["GridCoordinates"], "Rind", "Rind_t", np.array([1, 0, 0, 1, 0, 0]))
        polar = zone(root, "Third", x.transpose(2, 1, 0, 3), 6, sizes, "Structured")["GridCoordinates"]
        for old, new in (("CoordinateX", "CoordinateR"), ("CoordinateY", "CoordinateTheta")):
            polar.move(old, new)
        polar["CoordinateR"][" data"][...] += 1
        polar["CoordinateTheta"][" data"][...] *= 30
        put(polar["CoordinateTheta"], "DimensionalUnits", "DimensionalUnits_t", "Null Meter Second Null Degree")
    mesh = io.read(path)
    assert mesh.type_counts() == {"hexahedron": 18}
    assert (meshgauge.measure(mesh).values > 0.8).all()
    assert meshgauge.measure(mesh).values[:12] == pytest.approx(np.ones(12))
    assert regions(mesh)[1] == ("Fluid", "Second", "Third")
    assert mesh.cell_data["Order"][:6].tolist() == list(range(6))
    assert mesh.points[mesh.nodes(1)[0]].tolist() == [1, 0, 0]  # the first index runs fastest
    assert mesh.points[24:48].max() == 13


def test_empty_names_of_families(tmp_path: Path) -> None:
    """Some programs write the node without an array: the zone has the name of its own."""
    path = mixed(tmp_path / "a.cgns", mesh_of(*LINEAR))
    with h5py.File(path, "a") as file:
        zones = [group for group in file["Base"].values() if group.attrs.get("label") == b"Zone_t"]
        for group in zones:
            put(group, "ORPHAN", "FamilyName_t")
    assert io.read(path).type_counts() == mesh_of(*LINEAR).type_counts()


def test_files_of_the_old_kind_are_left_to_vtk(tmp_path: Path) -> None:
    path = tmp_path / "a.cgns"
    path.write_bytes(b"\xc0\xa8\xa3\xa9ADF Database Version A02011>" + bytes(500))
    with pytest.raises(ReadError, match="PyVista says: "):
        io.read(path)


def test_sections_may_leave_gaps_in_their_numbers(tmp_path: Path) -> None:
    mesh, path = mesh_of("tetra", "wedge", n=1), tmp_path / "a.cgns"
    with h5py.File(path, "w") as file:
        made = zone(base(file), "Zone", mesh.points, 2)
        section(made, "Second", 14, 9, 1, mesh.nodes(1) + 1)
        section(made, "First", 10, 3, 1, mesh.nodes(0) + 1)
    back = io.read(path)
    np.testing.assert_array_equal(back.connectivity, mesh.connectivity)
    assert (back.cell_data["label"].tolist(), back.counted) == ([3, 9], ("points",))
    for first, message in ((3, "elements of the same numbers"), (10**9, "far beyond how many they are")):
        with h5py.File(path, "a") as file:
            file["Base/Zone/Second/ElementRange/ data"][...] = first
        with pytest.raises(ReadError, match=message):
            io.read(path)


def broken_zone(file: Any, what: str) -> None:
    mesh = mesh_of("tetra", n=1)
    root = base(file)
    if what == "zones":
        return
    made = zone(root, "Z", mesh.points, 1)
    if what == "coordinates":
        del made["GridCoordinates"]["CoordinateX"][" data"]
        made["GridCoordinates"]["CoordinateX"][" data"] = np.zeros(3)
    if what == "link":
        made["Linked"] = h5py.ExternalLink("/etc/passwd", "/x")
    codes = {"type": 99, "range": 10, "mixed": 20, "polyhedra": 23, "faces": 22}
    ids = {"point": [1, 2, 3, 5], "nodes": [1, 2, 3], "mixed": [10, 1, 2, 3], "polyhedra": [1, 2, 3, 9]}.get(
        what, [1, 2, 3, 4]
    )
    n = 10**9 if what == "range" else 1
    section(made, "S", codes.get(what, 10), 1, n, ids, [0, 4] if what in ("polyhedra", "faces") else None)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("zones", r"has no zones \(Zone_t\)"),
        ("coordinates", r"Base/Z/GridCoordinates/CoordinateX: has shape \(3,\), expected \(4,\)"),
        ("type", "Base/Z/S: is of elements of type 99"),
        ("range", "Base/Z/S: states 1000000000 elements, but has 4 items"),
        ("point", r"refers to point 5, which is outside 1\.\.4"),
        ("nodes", "Base/Z/S: has 3 nodes of 1 elements of 4"),
        ("mixed", "Base/Z/S: has 4 items, which do not fit its 1 elements"),
        ("polyhedra", "a polyhedron refers to face"),
        ("faces", r"has faces \(NGON_n\), but neither cells"),
        ("link", "such links are not followed"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, what: str, message: str) -> None:
    path = tmp_path / "a.cgns"
    with h5py.File(path, "w") as file:
        broken_zone(file, what)
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)
