"""Faces that point into their cell: found in every format of faces, named, and nothing said of sound meshes."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, measure
from meshgauge.check import State, check
from meshgauge.doctor import diagnosis
from meshgauge.doctor.inward import inward
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.reference import antiprism, prism

DATA = Path(__file__).parent / "data"
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
CUBE_FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def polyhedron(points: np.ndarray, faces: list[tuple[int, ...]]) -> Mesh:
    return Mesh(
        points=points,
        types=np.array([42], np.uint8),
        offsets=np.array([0, len(points)]),
        connectivity=np.arange(len(points)),
        polyhedra=Polyhedra(
            np.array([0, len(faces)]),
            np.arange(len(faces)),
            np.cumsum([0, *map(len, faces)]),
            np.array([point for face in faces for point in face]),
        ),
    )


def turned(faces: list[tuple[int, ...]], which: set[int]) -> list[tuple[int, ...]]:
    return [face[::-1] if n in which else face for n, face in enumerate(faces)]


def test_a_reversed_face_of_an_openfoam_case_names_face_and_cells() -> None:
    mesh = meshgauge.read(DATA / "internal_reversed")
    finding = diagnosis(mesh).finding("misoriented_faces")
    assert finding is not None
    assert (finding.level, finding.count) == ("defect", 1)
    assert finding.text == "1 face points the wrong way, inward (face 0 of cells 0 and 1)."
    # The shape is what it was.
    assert meshgauge.measure(mesh).values[:2] == pytest.approx(1.0)


def test_the_same_case_put_right_has_no_finding(tmp_path: Path) -> None:
    case = tmp_path / "good"
    shutil.copytree(DATA / "internal_reversed", case)
    faces = case / "constant" / "polyMesh" / "faces"
    text = faces.read_text()
    first = text[text.index("4(") :].split("\n")[0]
    ids = first[2:-1].split()
    faces.write_text(text.replace(first, f"4({' '.join(reversed(ids))})", 1))
    found = diagnosis(meshgauge.read(case))
    assert found.findings == ()
    assert meshgauge.read(case).types[:2].tolist() == [12, 12]


@pytest.mark.parametrize("which", [{0}, {1, 4}, set(range(6))], ids=["one", "two", "all"])
def test_faces_of_a_polyhedron_that_point_inward(which: set[int]) -> None:
    found = inward(polyhedron(CUBE, turned(CUBE_FACES, which)))
    assert found.faces.tolist() == sorted(which)
    assert found.cells.tolist() == [[0, -1]] * len(which)


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("solid", [prism(5), prism(6), antiprism(4)], ids=["penta", "hexa", "antiprism"])
def test_of_any_polyhedron_and_written_to_any_format_of_faces(
    solid: meshgauge.quality.reference.Solid, tmp_path: Path
) -> None:
    faces = [tuple(face) for face in solid.faces]
    assert diagnosis(polyhedron(solid.points, faces)).findings == ()
    spoiled = polyhedron(solid.points, turned(faces, {2}))
    for suffix in (".vtu", ".vtk", ".vtkhdf"):
        path = tmp_path / f"x{suffix}"
        meshgauge.write(path, spoiled)
        assert inward(meshgauge.read(path)).faces.tolist() == [2]


def test_a_mesh_without_polyhedra_has_none_and_the_text_does_not_name_them() -> None:
    mesh = Mesh.from_arrays(CUBE, [("hexahedron", [range(8)])])
    assert inward(mesh).n_faces == 0
    assert "faces that point inward" not in diagnosis(mesh).checked
    checked = diagnosis(polyhedron(CUBE, CUBE_FACES)).checked
    assert "faces that point inward" in checked
    assert "cells numbered in reverse" not in checked


def test_what_is_no_closed_surface_is_not_judged() -> None:
    assert inward(polyhedron(CUBE, CUBE_FACES[:5])).n_faces == 0


def test_a_mesh_of_surfaces_says_that_nothing_was_looked_at() -> None:
    plate = Mesh.from_arrays(CUBE, [("quad", [(0, 1, 2, 3), (1, 2, 6, 5)])])
    found = diagnosis(plate.as_measured(3))
    assert found.skipped == ("The mesh has no solid cells: nothing was looked at but its points.",)


def misoriented_rule(mesh: Mesh, purpose: str = "fv") -> State | None:
    """How the rule comes out among those that are held by default; None if it is not among them."""
    outcomes = check(measure(mesh, purpose=purpose)).outcomes
    return next((o.state for o in outcomes if str(o.rule) == "nothing misoriented"), None)


def test_the_rule_is_held_by_default_for_finite_volumes_only() -> None:
    mesh = polyhedron(CUBE, turned(CUBE_FACES, {3}))
    assert misoriented_rule(mesh) == State.FAIL
    assert misoriented_rule(mesh, "fem") is None
    assert check(measure(mesh), ["nothing misoriented"]).outcomes[0].state == State.FAIL
    assert misoriented_rule(polyhedron(CUBE, CUBE_FACES)) == State.PASS
    assert misoriented_rule(meshgauge.read(DATA / "internal_reversed")) == State.FAIL


def test_a_cell_that_is_numbered_in_reverse_is_misoriented_and_one_that_is_inverted_is_not() -> None:
    two = np.vstack([CUBE, CUBE + np.array([3.0, 0, 0])])
    nodes = np.array([range(8), (8, 11, 10, 9, 12, 15, 14, 13)])
    outcome = check(measure(Mesh.from_arrays(two, [("hexahedron", nodes)])), ["nothing misoriented"]).outcomes[0]
    assert (outcome.state, [cell.cell for cell in outcome.cells]) == (State.FAIL, [1])
    tangled = CUBE.copy()
    tangled[6] = (0.1, 0.1, 0.1)
    mesh = Mesh.from_arrays(tangled, [("hexahedron", [range(8)])])
    assert check(measure(mesh), ["nothing misoriented"]).is_passed
    assert not check(measure(mesh), ["nothing invalid"]).is_passed


def test_ghosts_are_not_looked_at() -> None:
    mesh = polyhedron(CUBE, turned(CUBE_FACES, {3}))
    assert misoriented_rule(mesh.replace(cell_data={"vtkGhostType": np.array([1], np.uint8)})) == State.UNCHECKED
