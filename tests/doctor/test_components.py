"""Components of cells over their faces: whom a contradiction is blamed on, on both paths."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from meshgauge.kernels.topology import driver

pytestmark = pytest.mark.usefixtures("path")


def components(
    n_cells: int, faces: list[tuple[int, int, int]], handedness: list[int]
) -> tuple[list[int], list[int], int]:
    """Of cells that meet at faces ``(cell, other, winding)``."""
    cells = np.array([cell for a, b, _ in faces for cell in (a, b)], np.int32)
    mates = np.array([mate for n in range(len(faces)) for mate in (2 * n + 1, 2 * n)], np.int32)
    windings = np.array([w for *_, w in faces for _ in range(2)], np.int8)
    parent, sign, n_contradictions = driver.components_by_faces(cells, mates, windings, np.array(handedness, np.int8))
    assert len(parent) == n_cells
    return parent.tolist(), sign.tolist(), n_contradictions


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_the_face_that_geometry_contradicts_is_to_blame(order: tuple[int, ...]) -> None:
    faces = [(0, 1, 1), (1, 2, 1), (2, 0, -1)]  # the last one says that 2 is the other way round, the volumes do not
    assert components(3, [faces[n] for n in order], [1, 1, 1]) == ([0, 0, 0], [1, 1, 1], 1)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_a_cell_that_is_the_other_way_round_by_volume_and_faces_contradicts_nothing(order: tuple[int, ...]) -> None:
    faces = [(0, 1, 1), (1, 2, -1), (2, 0, -1)]
    assert components(4, [faces[n] for n in order], [1, 1, -1, 1]) == ([0, 0, 0, 3], [1, 1, -1, 1], 0)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_where_geometry_says_nothing_the_first_faces_are_believed(order: tuple[int, ...]) -> None:
    faces = [(0, 1, 1), (1, 2, 1), (2, 0, -1)]
    chosen = [faces[n] for n in order]
    parent, sign, n_contradictions = components(3, chosen, [0, 0, 0])
    assert parent == [0, 0, 0]
    assert n_contradictions == 1
    assert all(sign[a] * sign[b] == winding for a, b, winding in chosen[:2])
