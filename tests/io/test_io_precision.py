"""How exactly a file stores its coordinates, also where its reader makes doubles of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

import meshgauge
from meshgauge import io

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize(("dtype", "stored"), [(np.float32, "single"), (np.float64, "double")])
def test_precision_is_that_of_the_file(tmp_path: Path, dtype: type, stored: str) -> None:
    mesh = mesh_of("tetra")
    for extension in (".vtu", ".vtk", ".vtkhdf"):
        io.write(tmp_path / f"a{extension}", mesh.replace(points=mesh.points.astype(dtype), stored=None))
        assert io.read(tmp_path / f"a{extension}").stored == stored
    with h5py.File(tmp_path / "a.e", "w") as file:
        for axis, name in enumerate(("coordx", "coordy", "coordz")):
            file[name] = mesh.points[:, axis].astype(dtype)
        file["connect1"] = mesh.connectivity.reshape(-1, 4) + 1
        file["connect1"].attrs["elem_type"] = "TET4"
    back = io.read(tmp_path / "a.e")
    assert back.type_counts() == {"tetra": 2}
    assert back.stored == stored


SINGLE = [(np.float32, "single"), (np.float64, "double")]


@pytest.mark.parametrize(("dtype", "stored"), SINGLE)
def test_med(tmp_path: Path, dtype: type, stored: str) -> None:
    pytest.importorskip("meshio")
    path = tmp_path / "a.med"
    io.write(path, mesh_of("tetra"))
    with h5py.File(path, "r+") as file:
        nodes = next(iter(next(iter(file["ENS_MAA"].values())).values()))["NOE"]
        values, attributes = nodes["COO"][...], dict(nodes["COO"].attrs)
        del nodes["COO"]
        nodes.create_dataset("COO", data=values.astype(dtype)).attrs.update(attributes)
    assert io.read(path).stored == stored


@pytest.mark.parametrize(("dtype", "stored"), SINGLE)
def test_openfoam(tmp_path: Path, dtype: type, stored: str) -> None:
    folder = tmp_path / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype)
    head = 'FoamFile {{ version 2.0; format {0}; arch "LSB;label=32;scalar={1}"; class {2}; object {3}; }}\n'
    bits = 8 * points.itemsize
    first = head.format("binary", bits, "vectorField", "points").encode()
    (folder / "points").write_bytes(first + b"4\n(" + points.tobytes() + b")\n")
    texts = {
        "faces": ("faceList", "4\n(\n3(0 2 1)\n3(0 1 3)\n3(1 2 3)\n3(0 3 2)\n)\n"),
        "owner": ("labelList", "4\n(0 0 0 0)\n"),
        "neighbour": ("labelList", "0\n()\n"),
        "boundary": ("polyBoundaryMesh", "1\n(\nwall { type wall; nFaces 4; startFace 0; }\n)\n"),
    }
    for name, (kind, text) in texts.items():
        (folder / name).write_text(head.format("ascii", bits, kind, name) + text)
    mesh = io.read(tmp_path)
    assert mesh.type_counts()["tetra"] == 1
    assert mesh.stored == stored


def test_single_precision_is_named_where_it_flattens_cells() -> None:
    """Bricks of 0.25 at northing 4 649 776: in single precision there is nothing between .0 and .5."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)])[[0, 1, 3, 2, 4, 5, 7, 6]]
    origin = np.array((500_123.5, 4_649_776.0, 0.0))
    points = np.concatenate([origin + 0.25 * (corners + np.array((0, n, 0))) for n in range(4)])
    mesh = meshgauge.Mesh.from_arrays(points.astype(np.float32), {"hexahedron": np.arange(32).reshape(4, 8)})
    assert mesh.stored == "single"
    text = meshgauge.measure(mesh).findings()[0].text
    assert "single precision: steps of 0.5, shortest edge 0.25" in text
    good = meshgauge.Mesh.from_arrays(points, {"hexahedron": np.arange(32).reshape(4, 8)})
    assert meshgauge.measure(good).findings() == []


def test_single_precision_is_not_blamed_for_what_it_can_bear() -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], np.float32)
    flat = meshgauge.measure(meshgauge.Mesh.from_arrays(points, {"tetra": [(0, 1, 2, 3)]}))
    assert "single" not in flat.findings()[0].text
