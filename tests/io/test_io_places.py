"""Where words stand in a text, and the coordinates of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meshgauge import Mesh
from meshgauge.io.plumbing.numerals import Text
from meshgauge.io.plumbing.patch import Places
from meshgauge.io.plumbing.spans import columns
from meshgauge.mesh.labels import LABEL


def test_a_line_may_have_fewer_words_the_last_one_too() -> None:
    data = b"10 20 30\n\n 4\n5 6"
    starts, ends = columns(data, 0, len(data), 0, 3)
    assert starts.tolist() == [[0, 3, 6], [11, -1, -1], [13, 15, -1]]
    assert ends.tolist() == [[2, 5, 8], [12, -1, -1], [14, 16, -1]]


def test_points_that_the_file_does_not_number_have_no_place(tmp_path: Path) -> None:
    """Nor have those of one number; though their coordinates are those of a point that has a place."""
    path = tmp_path / "a.txt"
    path.write_bytes(b"1 0 0 0\n2 1 0 0\n4 3 0 0\n")
    starts = np.array([[2, 4, 6], [10, 12, 14], [18, 20, 22]])
    places = Places.of(path, Text(), starts, starts + 1, np.array([1, 2, 4]))
    points = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0], [3, 0, 0], [3, 0, 0]])
    mesh = Mesh.from_arrays(points, [], point_data={LABEL: np.array([1, 2, 3, 4, 4])})
    assert places.aligned(mesh).has_place.tolist() == [True, True, False, False, False]
    mesh = Mesh.from_arrays(points[:4], [], point_data={LABEL: np.array([1, 2, 3, 4])})
    assert places.aligned(mesh).starts.tolist() == [*starts[:2].tolist(), [-1] * 3, starts[2].tolist()]
