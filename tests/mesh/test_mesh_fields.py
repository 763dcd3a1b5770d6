"""What a mesh says of itself beside its arrays: purpose, stored precision, ghosts; and the ways it goes unharmed."""

from __future__ import annotations

import copy
import pickle
import tempfile
from collections.abc import Callable

import numpy as np
import pytest
from mesh_examples import CELLS, POINTS, all_types, parts, two_polyhedra

import meshgauge
from meshgauge import Mesh
from meshgauge.io.plumbing import handover


def through_handover(mesh: Mesh) -> Mesh:
    with tempfile.TemporaryFile() as file:
        handover.dump(file, mesh)
        return handover.load(file, mesh.path or "")


WAYS: dict[str, Callable[[Mesh], Mesh]] = {
    "replace": lambda mesh: mesh.replace(notes=mesh.notes),
    "pickle": lambda mesh: pickle.loads(pickle.dumps(mesh)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "handover": through_handover,
    "subset": lambda mesh: mesh[:],
}


@pytest.mark.parametrize("way", WAYS)
def test_everything_survives(way: str) -> None:
    mesh = two_polyhedra()
    again = WAYS[way](mesh)
    before, after = parts(mesh), parts(again)
    assert list(before) == list(after)
    for name, values in before.items():
        assert values.dtype == after[name].dtype or (way == "subset" and "flipped" not in name), name
        np.testing.assert_array_equal(values, after[name], err_msg=name)
        assert not after[name].flags.writeable, name
    for name in ("point_data", "cell_data", "field_data"):
        with pytest.raises(TypeError):
            getattr(again, name)["new"] = POINTS
    assert (again.blocks, again.path, again.notes) == (mesh.blocks, mesh.path, mesh.notes)
    assert (again.purpose, again.stored, again.sources) == ("fv", "double", ("/here", "/beside"))
    assert again.counted == ("points",)
    assert again.is_ghost is not None
    assert again.is_ghost.tolist() == [False, True]


def test_stored_is_that_of_the_points_unless_it_is_given() -> None:
    single = Mesh.from_arrays(POINTS, CELLS)
    double = Mesh.from_arrays(POINTS.astype(np.float64), CELLS)
    assert (single.stored, double.stored) == ("single", "double")
    assert single.replace(points=double.points).stored == "single", "the file stored no more than that"
    assert (single.purpose, single.is_ghost) == ("fem", None)


@pytest.mark.parametrize("wrong", [{"purpose": "fvm"}, {"stored": "half"}])
def test_words_that_are_not_known_are_refused(wrong: dict[str, str]) -> None:
    with pytest.raises(meshgauge.MeshError, match="expected one of"):
        Mesh.from_arrays(POINTS, CELLS).replace(**wrong)


@pytest.mark.parametrize(
    ("marks", "ghosts"),
    [
        (np.array([1, 0], np.uint8), [True, False]),
        (np.array([2, 32], np.int64), [False, True]),
        (np.array([np.nan, 33.0]), [False, True]),
        (np.array([2, 64], np.uint8), None),
        (np.array(["a", "b"]), None),
        (np.zeros((2, 3), np.uint8) + 1, None),
    ],
    ids=["duplicate", "hidden", "filled", "refined and hanging", "text", "vector"],
)
def test_ghosts(marks: np.ndarray, ghosts: list[bool] | None) -> None:
    mesh = Mesh.from_arrays(POINTS, CELLS, cell_data={"vtkGhostType": marks})
    assert (None if mesh.is_ghost is None else mesh.is_ghost.tolist()) == ghosts


def test_pickles_are_as_large_as_the_arrays() -> None:
    assert len(pickle.dumps(two_polyhedra())) < 4000


@pytest.mark.parametrize(
    ("blocks", "message"),
    [([(0, 3), (4, 9)], "start at 3"), ([(0, 3)], "end at cell 3"), ([(0, 9), (9, 8)], "start at 9")],
)
def test_blocks_cover_all_cells(blocks: list[tuple[int, int]], message: str) -> None:
    with pytest.raises(meshgauge.MeshError, match=message):
        all_types().replace(blocks=[meshgauge.CellBlock("", *ends) for ends in blocks])


@pytest.mark.parametrize("types", [[10.0, 10.0], [10, 256], [-1, 10], [[10, 10]]])
def test_types_are_vtk_ids(types: list) -> None:
    mesh = Mesh.from_arrays(POINTS, CELLS)
    with pytest.raises(meshgauge.MeshError, match="types"):
        mesh.replace(types=np.array(types))
