"""Faces that are kept: those between regions, and those between values of cell data that the user names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import run
from numpy.typing import NDArray
from repair_meshes import shaken
from thinned import quick

import meshgauge
from meshgauge import Mesh, MeshError
from meshgauge.repair.kept import kept_regions, unkept


def layered(kind: str = "hexahedron") -> tuple[Mesh, NDArray[np.bool_]]:
    """A cube with a ply number that changes halfway up, and which points lie between the plies."""
    mesh = shaken(kind, 4, 0.0)
    centres = np.asarray(mesh.points)[mesh.connectivity.reshape(mesh.n_cells, -1)].mean(axis=1)
    between = mesh.points[:, 2] == 2.0
    ply = np.where(centres[:, 2] < 2.0, 4, 9)
    return shaken(kind, 4, 0.35).replace(cell_data={"ply": ply}), between


@pytest.mark.parametrize(
    ("everywhere", "topology"),
    quick([(False, False), (False, True), (True, False), (True, True)], (False, False), (True, True)),
)
def test_faces_between_values_that_are_kept_stay(everywhere: bool, topology: bool) -> None:
    mesh, between = layered("tetra")
    free = meshgauge.improve(mesh, everywhere=everywhere, target=0.4, topology=topology)
    kept = meshgauge.improve(mesh, everywhere=everywhere, target=0.4, topology=topology, keep=["ply"])
    assert (free.mesh.points[: mesh.n_points][between] != mesh.points[between]).any() or topology
    place = {tuple(x) for x in np.asarray(kept.mesh.points)}
    assert all(tuple(x) in place for x in np.asarray(mesh.points)[between])
    assert "interfaces" in {claim.name for claim in kept.report.claims}
    assert kept.report.holds
    assert kept.report.options["keep"] == ["ply"]
    assert any("'ply' are not kept" in note for note in free.report.notes)
    assert not any("not kept" in note for note in kept.report.notes)


def test_what_is_kept_slides_in_its_surface_and_keeps_its_volumes() -> None:
    mesh, between = layered()
    points = np.array(mesh.points)
    points[between, 2] = 2.0
    mesh = mesh.replace(points=points)
    result = meshgauge.improve(mesh, everywhere=True, boundary="slide", keep="ply")
    np.testing.assert_allclose(result.mesh.points[between, 2], 2.0, atol=1e-12)
    assert (result.mesh.points[between] != mesh.points[between]).any()
    assert set(result.report.region_volumes) == {"ply 4", "ply 9"}


def test_regions_are_parted_by_what_is_kept() -> None:
    mesh = shaken("hexahedron", 2, 0.0).replace(
        cell_data={
            "material": np.array([1, 1, 1, 1, 2, 2, 2, 2]),
            "heat": np.array([0.5, 0.5, 1.25, 1.25, 0.5, 0.5, 0.5, 0.5]),
            "axis": np.array([[1, 0, 0]] * 6 + [[0, 1, 0]] * 2),
        }
    )
    ids, names = kept_regions(mesh, ["heat"])
    assert names == ("material 1, heat 0.5", "material 1, heat 1.25", "material 2, heat 0.5")
    assert ids.tolist() == [0, 0, 1, 1, 2, 2, 2, 2]
    ids, names = kept_regions(mesh, ["heat", "axis"])
    assert len(names) == 4
    assert names[-1].startswith("material 2, heat 0.5, axis (")
    with pytest.raises(MeshError, match="no cell data 'ply' to keep; there is 'material', 'heat', 'axis'"):
        kept_regions(mesh, ["ply"])


def test_data_that_may_be_regions_are_named() -> None:
    mesh = shaken("hexahedron", 5, 0.0)
    n = np.arange(mesh.n_cells)
    data = {
        "material": n // 25,
        "status": (n % 3).astype(np.uint8),
        "label": n % 3,
        "meshgauge:old_cell": n % 3,
        "vtkGhostType": np.zeros(len(n), np.uint8),
        "same": np.ones(len(n), int),
        "coarser": n // 50,
        "number": n,
        "real": (n % 2).astype(float),
        "flag": n % 2 == 0,
        "ply": n % 64,
        "ply65": n % 65,
    }
    mesh = mesh.replace(cell_data=data)
    assert unkept(mesh, kept_regions(mesh, [])[0]) == ("flag", "ply")
    assert unkept(mesh, kept_regions(mesh, ["ply", "flag"])[0]) == ()
    of_user = mesh.replace(cell_data={**data, "status": n % 20})
    assert unkept(of_user, kept_regions(of_user, [])[0]) == ("status", "flag", "ply")


def test_the_command_keeps_what_is_named(tmp_path: Path) -> None:
    mesh, between = layered()
    mesh = mesh.replace(cell_data={**mesh.cell_data, "batch": np.arange(mesh.n_cells) % 2})
    meshgauge.write(tmp_path / "a.vtu", mesh)
    done = run("improve", tmp_path / "a.vtu", "-o", tmp_path / "b.vtu", "--everywhere", "--keep", "ply")
    assert done.returncode == 0
    assert "cell data 'batch' are not kept" in done.stdout
    better = meshgauge.read(tmp_path / "b.vtu")
    np.testing.assert_array_equal(better.points[between], mesh.points[between])
    wrong = run("improve", tmp_path / "a.vtu", "-o", tmp_path / "c.vtu", "--keep", "plie")
    assert wrong.returncode == 2
    assert "no cell data 'plie'" in wrong.stderr
    assert not (tmp_path / "c.vtu").exists()
