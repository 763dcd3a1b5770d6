"""Fluent's HDF5 files: the cells, zones and patches of their text files; VTK as the oracle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fluent_files import cff
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh.regions import regions

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize("name", ["a.cas.h5", "a.msh.h5"])
def test_cells_zones_and_patches(tmp_path: Path, name: str) -> None:
    mesh = mesh_of(*LINEAR, "penta_prism")
    back = io.read(cff(tmp_path / name, mesh))
    solid = {"tetra": 2, "pyramid": 2, "wedge": 2, "hexahedron": 2, "polyhedron": 2}
    assert {k: n for k, n in back.type_counts().items() if k in solid} == solid
    assert meshgauge.measure(back).values[:10] == pytest.approx(np.ones(10))
    ids, names = regions(back)
    assert names == ("fluid", "solid", "wall")
    assert np.bincount(ids)[:2].tolist() == [5, 5]
    assert len(back.types) == 10 + 2 * (4 + 5 + 5 + 6 + 7)


def test_vtk_reads_the_same(tmp_path: Path) -> None:
    pytest.importorskip("vtkmodules.vtkIOFLUENTCFF")
    from vtkmodules.vtkIOFLUENTCFF import vtkFLUENTCFFReader

    from meshgauge.io.plumbing import vtk

    path = cff(tmp_path / "a.cas.h5", mesh_of("hexahedron"), **{"cells/zoneTopology/cellType": [4, 4]})
    for mesh in (vtk.mesh(vtk.output(vtkFLUENTCFFReader(), path), path), io.read(path)):
        hexahedra = np.flatnonzero(mesh.types == 12)
        assert len(hexahedra) == 2
        assert meshgauge.measure(mesh).values[hexahedra] == pytest.approx(np.ones(2))  # the same side is outside


def test_points_in_several_zones_and_refined_cells(tmp_path: Path) -> None:
    mesh = mesh_of("tetra", "hexahedron")
    path = cff(tmp_path / "a.cas.h5", mesh)
    with h5py.File(path, "a") as file:
        coords = file["meshes/1/nodes/coords"]
        del coords["1"]
        for key, part in (("1", slice(9, None)), ("2", slice(0, 9))):
            coords[key] = mesh.points[part]
            coords[key].attrs["minId"] = np.uint64(part.start + 1)
    np.testing.assert_array_equal(io.read(path).points, mesh.points)
    with h5py.File(path, "a") as file:
        file["meshes/1/faces/tree/1"] = np.zeros(3)
    with pytest.raises(ReadError, match="has faces refined into others"):
        io.read(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"faces/nodes/1/nnodes": np.full(50, 3)}, "do not have as many points as they state"),
        ({"faces/zoneTopology/maxId": [999]}, "zone 8 has the faces 1 to 999"),
        ({"faces/c1/1": np.zeros(60, int)}, "c1/1 has 60 faces from 1"),
        ({"faces/zoneTopology/id": [8, 9]}, "has columns of several lengths"),
        ({"cells/zoneTopology/maxId": [9, 10]}, "which others have too"),
        ({"nodes/coords/1": np.zeros((3, 3))}, "a face refers to point"),
        ({"faces/c0/1": np.full(18, 77)}, "a face refers to cell 77"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    path = cff(tmp_path / "a.cas.h5", mesh_of("tetra", "pyramid"), **changes)
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)
