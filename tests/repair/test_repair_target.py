"""A surface that the user gives, as any kind of mesh: its boundary is what points move on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from command_line import run
from repair_meshes import cells, shaken, slid
from thinned import quick

import meshgauge
from meshgauge import Mesh, MeshError, measure
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.surface import surface_of
from meshgauge.repair.target import target_surface


def flat_on_top(n: int = 4) -> Mesh:
    """A cube whose upper side is bent by up to a tenth of an edge, of two regions with a plane between."""
    mesh = slid(shaken("hexahedron", n, 0.1), n, 0.25)
    points = np.array(mesh.points)
    middle = shaken("hexahedron", n, 0.0).points[:, 0] == n / 2
    points[middle, 0] = n / 2
    inside = (points[:, :2] > 0.0).all(axis=1) & (points[:, :2] < n).all(axis=1)
    top = (points[:, 2] == n) & inside & ~middle
    points[top, 2] += 0.1 * np.sin(2.0 * np.pi * points[top, 0] / n)
    centres = points[mesh.connectivity.reshape(-1, 8)].mean(axis=1)
    return mesh.replace(points=points, cell_data={"material": np.where(centres[:, 0] < n / 2, 1, 2)})


def givens(n: int = 4) -> dict[str, Any]:
    """The plain cube, in many forms."""
    points, blocks = cells("tetra", n)
    solid = Mesh.from_arrays(points, dict(blocks))
    outside = pyvista.Box((0, n, 0, n, 0, n), level=3).triangulate()
    boundary = solid.to_pyvista().extract_surface(algorithm="dataset_surface")
    quads = pyvista.Box((0, n, 0, n, 0, n), quads=True)
    both = Mesh.from_arrays(points, [*blocks, ("triangle", [[0, 1, len(points) - 1]])])
    return {
        "solid": solid,
        "solid and a triangle inside": both,
        "surface": meshgauge.from_pyvista(boundary.cast_to_unstructured_grid()),
        "polydata": outside,
        "quads": quads,
        "grid": solid.to_pyvista(),
        "blocks": pyvista.MultiBlock([outside]),
        "image": pyvista.ImageData(dimensions=(3, 3, 3), spacing=(n / 2,) * 3),
    }


@pytest.mark.parametrize("name", quick(givens(), "solid and a triangle inside", "quads", "blocks"))
def test_any_mesh_is_a_surface_to_move_on(name: str) -> None:
    mesh, n = flat_on_top(), 4
    result = meshgauge.improve(mesh, everywhere=True, boundary="slide", surface=givens()[name])
    assert result.report.holds
    moved = (result.mesh.points != mesh.points).any(axis=1)
    at = shaken("hexahedron", n, 0.0).points
    top = (at[:, 2] == n) & ((at[:, :2] > 0) & (at[:, :2] < n)).all(axis=1) & (at[:, 0] != n / 2)
    assert moved[top].all()
    np.testing.assert_allclose(result.mesh.points[top, 2], n, atol=1e-6)
    between = (at[:, 0] == n / 2) & (at[:, 1:] > 0).all(axis=1) & (at[:, 1:] < n).all(axis=1)
    np.testing.assert_allclose(result.mesh.points[between, 0], n / 2, atol=1e-9)
    assert result.report.displacement.deviation < 1e-6
    assert not {"volume", "interfaces"} & {claim.name for claim in result.report.claims}
    assert len(result.report.region_volumes) == 2


@pytest.mark.parametrize("given", [3, Mesh.from_arrays([[0, 0, 0], [1, 0, 0]], {"line": [[0, 1]]}), pyvista.PolyData()])
def test_what_has_no_surface_is_refused(given: Any) -> None:
    with pytest.raises(MeshError, match="surface"):
        meshgauge.improve(flat_on_top(), everywhere=True, boundary="slide", surface=given)


@pytest.mark.parametrize(
    "name", quick(["cube.stl", "cube.ply", "cube.vtp", "cube.vtu", "cube.msh"], "cube.stl", "cube.msh")
)
def test_the_command_reads_it_from_any_format(name: str, tmp_path: Path) -> None:
    meshgauge.write(tmp_path / "in.vtu", flat_on_top())
    given = givens()
    if name.endswith((".vtu", ".msh")):
        meshgauge.write(tmp_path / name, given["solid"])
    else:
        given["polydata"].save(tmp_path / name)
    arguments = ("--everywhere", "--boundary", "slide", "--surface", tmp_path / name)
    done = run("improve", tmp_path / "in.vtu", "-o", tmp_path / "out.vtu", *arguments)
    assert done.returncode == 0, done.stderr
    at = shaken("hexahedron", 4, 0.0).points
    top = (at[:, 2] == 4) & ((at[:, :2] > 0) & (at[:, :2] < 4)).all(axis=1) & (at[:, 0] != 2)
    np.testing.assert_allclose(meshgauge.read(tmp_path / "out.vtu").points[top, 2], 4.0, atol=1e-6)


def test_faces_begin_their_search_at_the_item_nearest_to_their_middle() -> None:
    mesh, n = shaken("hexahedron", 4, 0.0), 4
    points = np.asarray(mesh.points)
    own = surface_of(constraints_of(mesh, measure(mesh), None), points, 40.0)
    surface = target_surface(own, givens(n)["polydata"], points)
    middles = points[surface.faces.reshape(-1, 4)].mean(axis=1)
    corners = surface.facets.points[surface.facets.items[surface.face_items]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    assert ((low <= middles + 1e-6) & (middles <= high + 1e-6)).all()
