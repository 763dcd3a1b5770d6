"""Ghost and hidden cells: kept, counted in a note, and otherwise not looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from thinned import quick

import meshgauge
from meshgauge import io
from meshgauge.doctor import diagnosis, orient
from meshgauge.mesh import Mesh
from meshgauge.status import Status

pytestmark = pytest.mark.usefixtures("readers_here")


def strip(first: int, n: int) -> Mesh:
    """Bricks in a row; the middle ones of a ghost are upside down to see whether they are looked at."""
    x = np.arange(first, first + n + 1)
    points = np.array([(i, j, k) for i in x for j in (0, 1) for k in (0, 1)], float)
    a = 4 * np.arange(n)[:, None]
    return Mesh.from_arrays(points, [("hexahedron", a + np.array([0, 4, 6, 2, 1, 5, 7, 3]))])


def with_ghosts(mesh: Mesh, *cells: int, mark: int = 1, name: str = "vtkGhostType") -> Mesh:
    marks = np.zeros(mesh.n_cells, np.int32 if name == "ghostRank" else np.uint8)
    marks += -1 if name == "ghostRank" else 0
    marks[list(cells)] = mark
    return mesh.replace(cell_data={name: marks})


def reversed_at(mesh: Mesh, cell: int) -> Mesh:
    nodes = mesh.connectivity.copy()
    nodes[8 * cell : 8 * cell + 8] = nodes[8 * cell : 8 * cell + 8][[4, 5, 6, 7, 0, 1, 2, 3]]
    return mesh.replace(connectivity=nodes)


@pytest.mark.parametrize(
    ("extension", "mark"),
    quick(
        [(extension, mark) for extension in (".vtu", ".vtk", ".vtkhdf") for mark in (1, 32, 33)],
        (".vtu", 1), (".vtk", 32), (".vtkhdf", 33),
    ),
)  # fmt: skip
@pytest.mark.parametrize("n", [6, 3000])
def test_ghosts_are_kept_and_not_looked_at(tmp_path: Path, extension: str, mark: int, n: int) -> None:
    path = tmp_path / f"a{extension}"
    written = with_ghosts(reversed_at(strip(0, n), n - 1), n - 2, n - 1, mark=mark)
    io.write(path, written)
    mesh = io.read(path)
    assert mesh.notes == ("2 cells are ghosts or hidden, and are not looked at.",)
    quality = meshgauge.measure(mesh, metrics=["scaled_jacobian"])
    assert quality.status.tolist() == [Status.OK] * (n - 2) + [Status.GHOST] * 2
    assert np.isnan(quality.values[-2:]).all()
    assert np.isnan(quality.metrics["scaled_jacobian"][-2:]).all()
    assert np.isnan(quality.node_jens[-16:]).all()
    assert np.isnan(quality.point_values[-4:]).all()
    assert quality.summary().all.n_cells == n - 2
    assert quality.findings() == []
    found = diagnosis(mesh)
    assert [finding.name for finding in found.findings] == []
    assert found.part_sizes == (n - 2,)
    after, changes = orient(mesh)
    assert after is mesh
    assert len(changes.cells) == 0


def test_bits_that_mean_something_else_make_no_ghost(tmp_path: Path) -> None:
    io.write(tmp_path / "a.vtu", with_ghosts(strip(0, 3), 0, mark=2 | 4 | 8 | 16))
    mesh = io.read(tmp_path / "a.vtu")
    assert mesh.is_ghost is None
    assert mesh.notes == ()


@pytest.mark.parametrize(("name", "mark"), [("ghostRank", 0), ("ghostRank", 3), ("vtkGhostLevels", 1)])
def test_other_names_of_ghosts(tmp_path: Path, name: str, mark: int) -> None:
    io.write(tmp_path / "a.vtu", with_ghosts(strip(0, 3), 1, mark=mark, name=name))
    mesh = io.read(tmp_path / "a.vtu")
    assert mesh.is_ghost is not None
    assert mesh.is_ghost.tolist() == [False, True, False]
    assert mesh.cell_data[name][1] == mark


def test_pieces_with_ghosts_are_one_mesh(tmp_path: Path) -> None:
    io.write(tmp_path / "0.vtu", with_ghosts(strip(0, 4), 3))
    io.write(tmp_path / "1.vtu", with_ghosts(reversed_at(strip(2, 4), 0), 0))
    io.write(tmp_path / "2.vtu", strip(6, 1))  # says nothing of ghosts
    pieces = "".join(f'<Piece Source="{n}.vtu"/>' for n in range(3))
    (tmp_path / "a.pvtu").write_text(
        f'<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid GhostLevel="1">{pieces}</PUnstructuredGrid></VTKFile>'
    )
    mesh = io.read(tmp_path / "a.pvtu")
    quality = meshgauge.measure(mesh)
    assert quality.summary().all.n_cells == 7
    assert quality.summary().all.n_invalid == 0
    assert mesh.notes == ("2 cells are ghosts or hidden, and are not looked at.",)


GMSH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Nodes
1 5 1 5
3 1 0 5
1
2
3
4
5
0 0 0
1 0 0
0 1 0
0 0 1
1 1 1
$EndNodes
$Elements
1 2 1 2
3 1 4 2
7 1 2 3 4
8 2 3 4 5
$EndElements
$GhostElements
{}
$EndGhostElements
"""


def test_gmsh_ghosts_are_those_of_partitions_that_are_not_here(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_text(GMSH.format("1\n8 2 1 1"))  # element 8 is of partition 2, and a ghost in partition 1
    assert meshgauge.measure(io.read(path)).status.tolist() == [Status.OK, Status.GHOST]
    path.write_text(GMSH.format("2\n8 2 1 1\n7 1 1 2"))  # a file of both partitions holds each element once
    assert io.read(path).is_ghost is None


def test_the_parts_of_a_gmsh_mesh_add_up(shared: Path) -> None:
    parts = [io.read(shared / "cases" / "parts" / f"split_{n}.msh") for n in (1, 2, 3)]
    assert sum(meshgauge.measure(part).summary().types["tetra"].n_cells for part in parts) == 1140
