"""How exactly a file stores its coordinates, also where its reader makes doubles of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import mesh_of

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
