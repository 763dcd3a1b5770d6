"""A face that points the wrong way is found in CGNS and Fluent, and has the number that the file gives it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cgns_files
import fluent_files
import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import IS_SOLID
from meshgauge.check import State, check
from meshgauge.doctor import diagnosis
from meshgauge.doctor.inward import inward
from meshgauge.mesh.labels import cell_label

h5py = pytest.importorskip("h5py")


def row_of_cubes(n: int = 3, at: float = 0.0) -> Mesh:
    """``n`` unit cubes along x."""
    x = np.arange(n + 1.0)
    points = np.array([(at + x[i], j, k) for k in (0, 1) for j in (0, 1) for i in range(n + 1)], float)
    layer, row = 2 * (n + 1), n + 1
    bottom = np.array([[i, i + 1, i + 1 + row, i + row] for i in range(n)])
    return Mesh.from_arrays(points, [("hexahedron", np.hstack([bottom, bottom + layer]))])


def spoil(nodes: Any, face: int, *, has_sizes: bool = False) -> None:
    """Let a quadrilateral of an HDF5 array of rings, counted from 0, run the other way."""
    first = 5 * face + 1 if has_sizes else 4 * face
    nodes[first : first + 4] = nodes[first : first + 4][::-1]


def cgns(form: str) -> Callable[[Path, int | None], tuple[Path, int]]:
    def write(folder: Path, face: int | None) -> tuple[Path, int]:
        path = cgns_files.polyhedral(folder / "x.cgns", row_of_cubes(), form)
        if face is not None:
            with h5py.File(path, "r+") as file:
                spoil(file["Base/Zone/Faces/ElementConnectivity/ data"], face, has_sizes=form == "sizes")
        return path, 1

    return write


def fluent(folder: Path, face: int | None) -> tuple[Path, int]:
    path = fluent_files.cff(folder / "x.cas.h5", row_of_cubes())
    if face is not None:
        with h5py.File(path, "r+") as file:
            spoil(file["meshes/1/faces/nodes/1/nodes"], face)
    return path, 1


def fluent_text(folder: Path, face: int | None) -> tuple[Path, int]:
    """As text; the zone of faces begins at number 17 (hexadecimal 11)."""
    mesh = row_of_cubes()
    faces, cells = cgns_files.faces_of(mesh)
    sides = np.zeros((len(faces), 2), np.int64)
    for cell, row in enumerate(cells, 1):
        for one in row:
            sides[abs(one) - 1, int(one > 0)] = cell  # the normal points into the first cell
    if face is not None:
        faces[face] = faces[face][::-1]
    points = "\n".join(" ".join(map(str, point)) for point in mesh.points)
    rings = "\n".join(" ".join(f"{i:x}" for i in (4, *ring, *pair)) for ring, pair in zip(faces, sides, strict=True))
    path = folder / "x.cas"
    path.write_text(
        f"(2 3)\n(10 (0 1 {mesh.n_points:x} 0))\n(10 (1 1 {mesh.n_points:x} 1 3)(\n{points}))\n(12 (0 1 3 0))\n"
        f"(12 (2 1 3 1 4))\n(13 (0 1 {16 + len(faces):x} 0))\n(13 (3 11 {16 + len(faces):x} 3 0)(\n{rings}))\n"
    )
    return path, 17


FORMATS = {
    "cgns": cgns("offsets"),
    "cgns, sizes": cgns("sizes"),
    "cgns, parents": cgns("parents"),
    "fluent hdf5": fluent,
    "fluent": fluent_text,
}


@pytest.mark.parametrize("face", [0, 1, 5, 11])
@pytest.mark.parametrize("kind", FORMATS)
def test_the_face_is_named_with_its_cells(kind: str, face: int, tmp_path: Path) -> None:
    assert inward(meshgauge.read(FORMATS[kind](tmp_path, None)[0])).n_faces == 0
    path, first = FORMATS[kind](tmp_path, face)
    mesh = meshgauge.read(path)
    found = inward(mesh)
    solid = np.flatnonzero(IS_SOLID[mesh.types])  # walls may stand before them
    rows = cgns_files.faces_of(row_of_cubes())[1]
    cells = [int(solid[c]) for c, row in enumerate(rows) if face + 1 in map(abs, row)]
    assert found.faces.tolist() == [face + first]
    assert list(found.cells_of(0)) == cells
    finding = diagnosis(mesh).finding("misoriented_faces")
    assert finding is not None
    cell = (
        f"cell {cells[0]}" if kind.startswith("fluent") else f"element {cell_label(mesh, cells[0])} (cell {cells[0]})"
    )
    assert f"(face {face + first} of {cell}" in finding.text
    quality = meshgauge.measure(mesh)
    assert quality.values[solid] == pytest.approx(1.0)
    outcome = check(quality, ["nothing misoriented"]).outcomes[0]
    assert (outcome.state, [cell.cell for cell in outcome.cells]) == (State.FAIL, cells)
    assert finding.text in quality.report()


def test_two_zones_that_number_their_faces_alike(tmp_path: Path) -> None:
    path = tmp_path / "x.cgns"
    with h5py.File(path, "w") as file:
        base = cgns_files.base(file)
        for name, at in (("A", 0.0), ("B", 10.0)):
            mesh = row_of_cubes(1, at)
            faces, cells = cgns_files.faces_of(mesh)
            faces[1] = faces[1][::-1]
            zone = cgns_files.zone(base, name, mesh.points, 1)
            cgns_files.section(zone, "Faces", 22, 1, 6, *cgns_files.flat(faces))
            cgns_files.section(zone, "Cells", 23, 7, 1, *cgns_files.flat(cells))
    found = inward(meshgauge.read(path))
    assert found.faces.tolist() == [2, 2]
    assert found.cells.tolist() == [[0, -1], [1, -1]]


def test_cells_whose_faces_all_point_inward_are_turned_in_the_file(tmp_path: Path) -> None:
    """Nothing writes such files, so that renumbering is no remedy that could be named alone."""
    mesh = row_of_cubes()
    mirrored = mesh.replace(points=mesh.points * (1, 1, -1), purpose="fv")
    finding = diagnosis(mirrored).finding("orientation")
    assert finding is not None
    assert "all of theirs point inward and have to be turned there" in finding.text
    finding = diagnosis(mirrored.replace(purpose="fem")).finding("orientation")
    assert finding is not None
    assert finding.text.endswith("with valid shapes: run `meshgauge orient`.")
