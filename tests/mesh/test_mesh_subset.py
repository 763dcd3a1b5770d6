"""``mesh[cells]``, against what PyVista's extract_cells makes of the same mesh."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_examples import all_types, parts, two_polyhedra

import meshgauge
from meshgauge import Mesh
from meshgauge.mesh.regions import regions

pytest.importorskip("pyvista")

CHOICES = {
    "mask": np.array([True, False, True, True, False, True, False, False, True]),
    "ids": [0, 5, 3],
    "ids that repeat": [5, 5, 1, 0],
    "slice": slice(1, 7),
    "steps": slice(None, None, 2),
    "backwards": slice(None, None, -3),
    "from the end": [-1, -4],
    "one": 6,
    "polyhedra only": [1, 5],
    "no polyhedra": [0, 2, 4],
    "all": slice(None),
}


@pytest.mark.parametrize("name", CHOICES)
def test_as_extract_cells(name: str) -> None:
    mesh, chosen = all_types(), CHOICES[name]
    part = mesh[chosen]
    ids = np.unique(np.arange(9)[chosen])
    expected = mesh.to_pyvista().extract_cells(ids)
    if len(ids) == mesh.n_cells:
        expected = mesh[:].to_pyvista()  # VTK keeps all points when all cells are asked for
        expected.point_data["vtkOriginalPointIds"] = np.unique(mesh.connectivity)
    again = meshgauge.from_pyvista(expected)
    assert part.n_cells == len(ids)
    for key, values in parts(part).items():
        if key in parts(again):
            np.testing.assert_array_equal(values, parts(again)[key], err_msg=key)
    assert (part.polyhedra is None) == (not (part.types == 42).any())
    used = np.asarray(expected.point_data["vtkOriginalPointIds"])
    np.testing.assert_array_equal(part.points, mesh.points[used])
    np.testing.assert_array_equal(part.point_data["name"], mesh.point_data["name"][used])
    np.testing.assert_array_equal(part.cell_data["v"], mesh.cell_data["v"][ids])
    assert part.field_data["x"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("name", CHOICES)
def test_few_cells_of_many_points_are_as_many_cells_are(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, reached = all_types(), []
    for least in (1e-9, 1e9):  # both ways to number points anew
        monkeypatch.setattr("meshgauge.mesh.subset.FEW", least)
        reached.append(parts(mesh[CHOICES[name]]))
    assert reached[0].keys() == reached[1].keys()
    for key, values in reached[0].items():
        np.testing.assert_array_equal(values, reached[1][key], err_msg=key)
        assert values.dtype == reached[1][key].dtype


@pytest.mark.parametrize("name", CHOICES)
def test_regions_and_values_follow(name: str) -> None:
    mesh, chosen = all_types(), CHOICES[name]
    part, ids = mesh[chosen], np.unique(np.arange(9)[chosen])

    def of_cells(one: Mesh) -> np.ndarray:
        labels, names = regions(one)
        return np.array(names)[labels]

    assert of_cells(mesh[:]).tolist() == of_cells(mesh).tolist()
    held = np.concatenate([[b.name] * (b.stop - b.start) for b in mesh.blocks])[ids]
    assert np.concatenate([[b.name] * (b.stop - b.start) for b in part.blocks]).tolist() == held.tolist()
    before, after = meshgauge.measure(mesh), meshgauge.measure(part)
    np.testing.assert_array_equal(after.values, before.values[ids])


def test_faces_that_two_cells_share_stay_as_they_are() -> None:
    mesh = two_polyhedra().replace(cell_data={})  # both measured, none a ghost
    for cell in (0, 1):
        part = mesh[cell]
        assert part.polyhedra is not None
        assert part.polyhedra.n_faces == 4
        value = meshgauge.measure(mesh).values[cell]
        assert abs(value) > 0.5
        assert meshgauge.measure(part).values == value


def test_points_that_only_faces_name_are_kept() -> None:
    mesh = two_polyhedra()
    short = mesh.replace(offsets=np.array([0, 3, 6]), connectivity=np.array([0, 1, 2, 1, 2, 3]))
    part = short[1]
    assert part.polyhedra is not None
    assert part.n_points == 4
    np.testing.assert_array_equal(part.points, mesh.points[1:])
    assert part.polyhedra.face_points.max() == 3


def test_none_is_an_empty_mesh() -> None:
    for nothing in ([], slice(0, 0), np.zeros(9, bool)):
        part = all_types()[nothing]
        assert (part.n_cells, part.n_points, part.polyhedra) == (0, 0, None)
        assert list(part.cell_data) == ["material", "v"]
        assert len(meshgauge.measure(part).values) == 0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ([9], "cell 9 is outside 0..8"),
        ([-10], "cell -10 is outside"),
        (np.ones(8, bool), r"shape \(8,\), expected \(9,\)"),
        ([0.5], "expected a mask, ids or a slice"),
        (["a"], "expected a mask, ids or a slice"),
        ([[0], [1, 2]], "do not make an array"),
        (np.ma.masked_array([1, 2], mask=[True, False]), "masked"),
    ],
)
def test_what_is_no_choice_of_cells_is_refused(wrong: object, message: str) -> None:
    with pytest.raises(meshgauge.MeshError, match=message):
        all_types()[wrong]  # type: ignore[index]


def test_a_mesh_is_not_run_through_cell_by_cell() -> None:
    with pytest.raises(TypeError):
        iter(all_types())  # type: ignore[call-overload]
