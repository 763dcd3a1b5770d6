"""Where words stand in a text, and the coordinates of points."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from meshgauge import Mesh
from meshgauge.io.plumbing.numerals import Text
from meshgauge.io.plumbing.patch import Places
from meshgauge.io.plumbing.patch_nodes import _rows
from meshgauge.io.plumbing.spans import columns
from meshgauge.io.plumbing.text import marks_per_line, words_per_line
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


@pytest.mark.parametrize(
    ("text", "words", "marks"),
    [(b"", [], []), (b"1,2", [1], [1]), (b"1 2,3\n\n4\n", [2, 0, 1], [1, 0, 0]), (b"\n,5", [0, 1], [0, 1])],
)
def test_a_line_end_ends_a_line_and_begins_none(text: bytes, words: list[int], marks: list[int]) -> None:
    assert words_per_line(text).tolist() == words
    assert marks_per_line(text, b",").tolist() == marks


def test_cells_are_found_in_their_order_unless_all_pieces_number_them() -> None:
    mesh = Mesh.from_arrays(np.vstack([np.zeros(3), np.eye(3)]), {"tetra": [[0, 1, 2, 3]] * 3})
    some, others = (
        SimpleNamespace(labels=np.array([7, 8]), starts=np.zeros((2, 4))),
        SimpleNamespace(labels=None, starts=np.zeros((1, 4))),
    )
    rows, _ = _rows([some, others], mesh.replace(cell_data={LABEL: np.array([7, 8, 9])}), np.array([2, 0]))
    assert rows == [(1, 0), (0, 0)]
    others.labels = np.array([9])
    rows, _ = _rows([others, some], mesh.replace(cell_data={LABEL: np.array([7, 8, 9])}), np.array([2, 0]))
    assert rows == [(0, 0), (1, 0)]
