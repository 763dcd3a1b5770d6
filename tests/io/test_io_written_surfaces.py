"""STL, PLY, OBJ and VTP are written, and read back by others."""

from __future__ import annotations

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, WriteError
from meshgauge.cli.main import main

POINTS = np.array([(0, 0, 0), (1, 0, 0.1), (1.1, 1, 0), (0, 1, 0.3), (2, 0.5, 0.2), (0.3, 0.7, 0.9)]) / 3.0
TRIANGLES, QUADS = [(0, 1, 2), (0, 2, 3), (1, 4, 2)], [(0, 1, 2, 3)]


@pytest.mark.parametrize("extension", ["stl", "ply", "obj", "vtp"])
def test_triangles_are_read_back_by_others(extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{extension}"
    mesh = Mesh.from_arrays(POINTS[:5], {"triangle": TRIANGLES})
    assert meshgauge.write(path, mesh) == ()
    if extension == "vtp":
        import pyvista

        data = pyvista.read(path)
        points, cells = np.asarray(data.points), np.asarray(data.faces).reshape(-1, 4)[:, 1:]
        assert points.tobytes() == mesh.points.tobytes()
    else:
        read = meshio.read(path)
        points, cells = read.points, read.cells_dict["triangle"]
    assert np.allclose(points[cells], mesh.points[np.array(TRIANGLES)], atol=1e-7)


@pytest.mark.parametrize("extension", ["ply", "obj"])
def test_triangles_beside_quads(extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{extension}"
    mesh = Mesh.from_arrays(POINTS, {"triangle": TRIANGLES, "quad": QUADS}, cell_data={"part": np.arange(4)})
    (note,) = meshgauge.write(path, mesh)
    assert "'part'" in note
    counts = {block.type: len(block.data) for block in meshio.read(path).cells}
    assert counts == {"triangle": 3, "quad": 1}


def test_polygonal_data_keep_all_data_and_the_order_of_the_lists(tmp_path: Path) -> None:
    blocks = {"triangle": TRIANGLES, "line": [(0, 1), (1, 4)], "polygon": [(0, 1, 4, 2, 3)], "vertex": [(5,)]}
    mesh = Mesh.from_arrays(POINTS, blocks, cell_data={"of <all>": np.arange(7.0)}, point_data={"v": POINTS + 1.0})
    (note,) = meshgauge.write(tmp_path / "a.vtp", mesh)
    assert "another order" in note
    import pyvista

    data = pyvista.read(tmp_path / "a.vtp")
    assert (data.n_verts, data.n_lines, data.n_faces) == (1, 2, 4)
    assert data.cell_data["of <all>"].tolist() == [6, 3, 4, 0, 1, 2, 5]
    assert np.array_equal(data.point_data["v"], mesh.point_data["v"])
    back = meshgauge.read(tmp_path / "a.vtp")
    assert meshgauge.write(tmp_path / "b.vtp", back) == ()
    assert (tmp_path / "a.vtp").read_bytes() == (tmp_path / "b.vtp").read_bytes()


@pytest.mark.parametrize("extension", ["stl", "ply", "obj", "vtp"])
def test_solids_are_refused(extension: str, tmp_path: Path) -> None:
    mesh = Mesh.from_arrays(np.eye(4)[:, :3], {"tetra": [(0, 1, 2, 3)]})
    with pytest.raises(WriteError, match="1 tetra"):
        meshgauge.write(tmp_path / f"a.{extension}", mesh)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("extension", ["stl", "ply", "obj", "vtp"])
def test_a_surface_is_improved_in_its_file(extension: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What is reported is what the file holds, and undo brings the old one back to the last byte."""
    n = 12
    rng = np.random.default_rng(2)
    i, j = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    inside = (i > 0) & (i < n) & (j > 0) & (j < n)
    x, y = (one + inside * rng.uniform(-0.38, 0.38, one.shape) for one in (i, j))
    points = np.stack([x, y, np.cos(x / 5) * np.sin(y / 4)], axis=-1).reshape(-1, 3)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    path, better = tmp_path / f"a.{extension}", tmp_path / f"b.{extension}"
    meshgauge.write(path, Mesh.from_arrays(points, {"triangle": np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])}))
    given = path.read_bytes()
    assert main(["improve", str(path), "-o", str(better), "--everywhere", "--json"]) == 0
    out = capfd.readouterr().out
    told = json.loads(out)["after"]["all"]["min"]
    values = meshgauge.measure(meshgauge.read(better)).values
    assert values.min() > 0.4
    assert told == pytest.approx(values.min(), abs=1e-12)
    assert main(["improve", str(path), "--in-place", "--everywhere", "-q"]) == 0
    assert path.read_bytes() != given
    assert main(["undo", str(path), f"{path}.undo.npz", "--in-place", "-q"]) == 0
    assert path.read_bytes() == given


def test_polygonal_data_that_are_not_packed_are_patched(tmp_path: Path) -> None:
    """Where coordinates stand as they are in the file, all else stays, byte for byte."""
    import pyvista

    triangles = np.array(TRIANGLES)
    data = pyvista.PolyData.from_regular_faces(POINTS[:5], triangles)
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    writer.SetDataModeToAscii()
    writer.SetFileName(str(tmp_path / "a.vtp"))
    writer.SetInputData(data)
    writer.Write()
    from meshgauge.io.patching import patch_of

    mesh = meshgauge.read(tmp_path / "a.vtp")
    patch = patch_of(mesh, tmp_path / "b.vtp")
    assert patch is not None
    points = np.array(mesh.points)
    points[4] += 0.01
    points[4] = patch.rounded(np.array([4]), points[[4]])[0]
    patch.write(mesh.replace(points=points))
    old, new = ((tmp_path / name).read_bytes() for name in ("a.vtp", "b.vtp"))
    assert np.array_equal(meshgauge.read(tmp_path / "b.vtp").points, points)
    assert old != new
    assert old.split(b"<Polys>")[1] == new.split(b"<Polys>")[1]
