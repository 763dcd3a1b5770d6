"""What a mesh says of itself beside its arrays: purpose, stored precision, ghosts; and that it stays what it is."""

from __future__ import annotations

import copy
import pickle
import tempfile
from collections.abc import Callable

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh
from meshgauge.io.plumbing import handover
from meshgauge.mesh.polyhedra import Polyhedra

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], np.float32)
CELLS = [("tetra", [(0, 1, 2, 3), (1, 2, 3, 4)])]


def pyramids() -> Mesh:
    """Two polyhedra that share a face, which is flipped for the second; the second is a ghost."""
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
    poly = Polyhedra.from_owner_neighbour(
        np.arange(0, 22, 3), np.array(faces).ravel(), [0, 0, 0, 0, 1, 1, 1], [-1, -1, 1, -1, -1, -1, -1]
    )
    return Mesh(
        POINTS,
        np.full(2, 42, np.uint8),
        np.array([0, 4, 8]),
        np.array([0, 1, 2, 3, 1, 2, 3, 4]),
        poly,
        cell_data={"vtkGhostType": np.array([0, 1], np.uint8), "label": np.array([7, 8])},
        field_data={"names": np.array(["a", "b"])},
        path="here",
        notes=("one",),
        purpose="fv",
        stored="double",
    )


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
}


@pytest.mark.parametrize("way", WAYS)
def test_everything_survives(way: str) -> None:
    mesh = pyramids()
    again = WAYS[way](mesh)
    for name in ("points", "types", "offsets", "connectivity"):
        own, other = getattr(mesh, name), getattr(again, name)
        assert own.dtype == other.dtype
        assert np.array_equal(own, other)
        assert not other.flags.writeable
    assert mesh.polyhedra is not None
    assert again.polyhedra is not None
    for name in Polyhedra.__slots__:
        assert np.array_equal(getattr(mesh.polyhedra, name), getattr(again.polyhedra, name)), name
    for name in ("point_data", "cell_data", "field_data"):
        own, other = getattr(mesh, name), getattr(again, name)
        assert list(own) == list(other)
        assert all(np.array_equal(own[key], other[key]) and not other[key].flags.writeable for key in own)
        with pytest.raises(TypeError):
            other["new"] = own
    assert (again.blocks, again.path, again.notes) == (mesh.blocks, mesh.path, mesh.notes)
    assert (again.purpose, again.stored) == ("fv", "double")
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
    mesh = pyramids()
    assert len(pickle.dumps(mesh)) < 4000
