"""The examples run, and the meshes they come with are what their README says."""

from __future__ import annotations

import importlib.util
import runpy
from collections import Counter, defaultdict
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from meshgauge.cells import CELL_TYPES
from meshgauge.io import read
from meshgauge.mesh import Mesh

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
MESHES = {"bracket_good.vtu": 6192, "bracket.vtu": 6192, "bracket_small.msh": 282}

meshes = pytest.mark.parametrize("name", MESHES)


@pytest.fixture(scope="module")
def make_meshes() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_meshes", EXAMPLES / "make_meshes.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def mesh_of() -> dict[str, Mesh]:
    return {name: read(EXAMPLES / "meshes" / name) for name in MESHES}


def faces(mesh: Mesh) -> list[tuple[int, ...]]:
    """Point ids of every face of every cell, outward."""
    found = []
    for cell in range(mesh.n_cells):
        shape = CELL_TYPES[int(mesh.types[cell])].shape
        assert shape is not None
        nodes = mesh.nodes(cell).tolist()
        found += [tuple(nodes[a] for a in face) for face in shape.faces]
    return found


def canonical(face: tuple[int, ...]) -> tuple[int, ...]:
    at = face.index(min(face))
    return face[at:] + face[:at]


@meshes
def test_every_inner_face_is_shared_by_two_cells_from_opposite_sides(name: str, mesh_of: dict[str, Mesh]) -> None:
    sides = defaultdict(list)
    for face in faces(mesh_of[name]):
        sides[frozenset(face)].append(face)
    boundary = [same[0] for same in sides.values() if len(same) == 1]
    for same in sides.values():
        assert len(same) <= 2
        if len(same) == 2:
            assert canonical(same[0]) == canonical(same[1][::-1])
    darts = Counter(dart for face in boundary for dart in pairwise((*face, face[0])))
    assert all(darts[b, a] == n for (a, b), n in darts.items()), "the boundary has an edge"
    # A crack would leave both its sides on the boundary, at the same place.
    centres = np.array([mesh_of[name].points[list(face)].mean(axis=0) for face in boundary])
    assert len(np.unique(centres.round(6), axis=0)) == len(centres)


@meshes
def test_meshes_hold_all_four_types_and_every_point_is_used(name: str, mesh_of: dict[str, Mesh]) -> None:
    mesh = mesh_of[name]
    assert set(mesh.type_counts()) == {"hexahedron", "wedge", "pyramid", "tetra"}
    assert mesh.n_cells == MESHES[name]
    assert np.bincount(mesh.connectivity, minlength=mesh.n_points).min() > 0
    readme = (EXAMPLES / "README.md").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert f"`meshes/{name}` | {mesh.n_cells:,} |".replace(",", " ") in readme


@pytest.mark.parametrize("name", ["bracket_good.vtu", "bracket.vtu"])
def test_regions_follow_one_another(name: str, mesh_of: dict[str, Mesh]) -> None:
    mesh = mesh_of[name]
    region = np.asarray(mesh.cell_data["region"])
    assert np.unique(region).tolist() == [0, 1, 2, 3]
    only = {12: {0}, 13: {1}, 14: {2}, 10: {2, 3}}
    for vtk_id, regions in only.items():
        assert set(region[mesh.types == vtk_id].tolist()) == regions


def test_the_damage_is_as_described(mesh_of: dict[str, Mesh]) -> None:
    import meshgauge

    good = meshgauge.measure(mesh_of["bracket_good.vtu"]).values
    assert good.min() >= 0.2
    damaged = mesh_of["bracket.vtu"]
    values = meshgauge.measure(damaged).values
    inverted = np.flatnonzero(values < 0)
    assert sorted(CELL_TYPES[int(t)].name for t in damaged.types[inverted]) == ["hexahedron", "pyramid", "wedge"]
    assert np.count_nonzero((values > 0) & (values < 0.2)) == 36
    assert meshgauge.measure(mesh_of["bracket_small.msh"]).values.min() >= 0.2
    moved = (damaged.points != mesh_of["bracket_good.vtu"].points).any(axis=1)
    assert np.count_nonzero(moved) == 28


def are_equal(made: Mesh, shipped: Mesh) -> None:
    np.testing.assert_allclose(made.points, shipped.points, atol=1e-9)
    np.testing.assert_array_equal(made.connectivity, shipped.connectivity)
    np.testing.assert_array_equal(made.types, shipped.types)
    assert made.cell_data.keys() == shipped.cell_data.keys()
    for key, values in shipped.cell_data.items():
        np.testing.assert_array_equal(made.cell_data[key], values)


@pytest.mark.long
def test_the_meshes_are_those_the_program_makes(
    make_meshes: ModuleType, mesh_of: dict[str, Mesh], tmp_path: Path
) -> None:
    make_meshes.main(tmp_path)
    for name, shipped in mesh_of.items():
        are_equal(read(tmp_path / name), shipped)


def test_the_small_mesh_is_that_the_program_makes(
    make_meshes: ModuleType, mesh_of: dict[str, Mesh], tmp_path: Path
) -> None:
    make_meshes.write_gmsh(tmp_path / "a.msh", make_meshes.bracket((4, 3, 2, 2), 2, 3, holes=False))
    are_equal(read(tmp_path / "a.msh"), mesh_of["bracket_small.msh"])


@pytest.mark.parametrize(
    ("name", "limit"), [("bracket_good.vtu", 400e3), ("bracket.vtu", 400e3), ("bracket_small.msh", 50e3)]
)
def test_the_files_are_small(name: str, limit: float) -> None:
    assert (EXAMPLES / "meshes" / name).stat().st_size < limit


def test_quickstart(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLES / "quickstart.py"), run_name="__main__")
    printed = capsys.readouterr().out
    assert "a cube: [1.]" in printed
    assert "inverted: 3 " in printed
    assert printed.count("cell ") == 3
