"""Threads of a repair: each item once, in order, and the same numbers for any number of them."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from repair_meshes import shaken

from meshgauge.quality.measure import measure
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.descent import RANGE, _ranges, workers
from meshgauge.repair.problem import Problem, problem


def test_items_are_worked_on_once_and_in_order() -> None:
    done: list[int] = []
    seen: set[int] = set()

    def work(n: int) -> int:
        time.sleep(0.001)
        done.append(n)
        seen.add(threading.get_ident())
        return n * n

    for threads in (1, 2, 5):
        with workers(threads) as team:
            done.clear()
            seen.clear()
            assert team.map(work, range(30)) == [n * n for n in range(30)]
            assert sorted(done) == list(range(30))
            assert 1 <= len(seen) <= threads
            assert (threads == 1) == (len(seen) == 1)
            assert team.map(work, []) == []


def test_what_an_item_raises_is_raised() -> None:
    def work(n: int) -> float:
        return 1 / (n - 3)

    with workers(2) as team, pytest.raises(ZeroDivisionError):
        team.map(work, range(6))


def test_ranges_cover_all_points_and_are_even() -> None:
    for n in (0, 1, RANGE, RANGE + 1, 2 * RANGE + 5, 7 * RANGE):
        ranges = _ranges(n)
        assert ranges[0][0] == 0
        assert ranges[-1][1] == n
        assert all(one[1] == other[0] for one, other in pairwise(ranges))
        assert max(last - first for first, last in ranges) <= RANGE
        assert len(ranges) == 1 or len(ranges) % 2 == 0


def _problem() -> tuple[Problem, np.ndarray]:
    mesh = shaken("mixed", 12, 0.3)
    quality = measure(mesh)
    part = problem(mesh, constraints_of(mesh, quality, None).cells)
    assert len(part.parts) > 2
    return part, np.asarray(mesh.points)[part.point_ids]


def test_values_and_lengths_are_the_same_on_threads() -> None:
    part, points = _problem()
    with workers(3) as team:
        shared = replace(part, team=team)
        for one, other in zip(part.qualities(points), shared.qualities(points), strict=True):
            np.testing.assert_array_equal(one.view(np.int64), other.view(np.int64))
        lengths = part.edge_lengths(points)
        np.testing.assert_array_equal(lengths, shared.edge_lengths(points))
    np.testing.assert_array_equal(lengths, part.edge_lengths(points, np.arange(len(part.corners))))
    sizes = part.point_sizes(lengths)
    at = part.corners[:, 0]
    total = np.bincount(at, lengths.sum(axis=1, dtype=np.float64), part.n_points)
    np.testing.assert_allclose(sizes, total / (3 * np.bincount(at, minlength=part.n_points)), rtol=1e-6)


def test_points_are_numbered_by_their_first_use() -> None:
    part, _ = _problem()
    flat = part.corners.reshape(-1)
    _, first = np.unique(flat, return_index=True)
    assert (np.diff(first) > 0).all()
    mesh_points = part.point_ids[flat]
    _, first = np.unique(mesh_points, return_index=True)
    np.testing.assert_array_equal(mesh_points[np.sort(first)], part.point_ids)
