"""What hangs on a surface."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge.repair.features import hanging

TRIANGLE = [[0.0, 0, 0], [3, 0, 0], [0, 3, 0]]
SQUARE = [[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
FAR = [[9.0, 0, 0], [9, 1, 0]]


@pytest.mark.parametrize(
    ("face", "point", "marked"),
    [
        (SQUARE, [1.0, 1.0, 0.0], [True] * 5),  # in the middle of the face: it and all corners stay
        (SQUARE, [1.0, 0.0, 0.0], [True, True, False, False, True]),  # in the middle of an edge: its ends stay
        (SQUARE, [1.0, 0.5, 0.0], [False] * 5),
        (TRIANGLE, [1.5, 1.5, 0.0], [False, True, True, True]),
        (TRIANGLE, [1.0, 1.0, 0.0], [False] * 4),  # triangles are refined from their edges
    ],
)
def test_points_hang_in_the_middle_of_edges_and_of_faces_of_more_than_three_corners(
    face: list[list[float]], point: list[float], marked: list[bool]
) -> None:
    points = np.array([*face, point, *FAR])
    n = len(face)
    ids = np.array([*range(n), n, n + 1, n + 2])  # the face, and a triangle that has the point
    marks = hanging(points, ids, np.array([0, n, n + 3]))
    assert marks.tolist() == [*marked, False, False]
