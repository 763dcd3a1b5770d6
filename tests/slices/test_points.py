"""Points of a slice by their ids: each once, ascending, and the place of each id among them."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge.errors import MeshError
from meshgauge.kernels import blocks
from meshgauge.slices import points
from meshgauge.slices.points import BLOCK, SOME, Points


class InMemory:
    """Rows that are there."""

    def __init__(self, values: np.ndarray) -> None:
        self.values, self.dtype, self.shape = values, values.dtype, values.shape

    def read(self, start: int, stop: int) -> np.ndarray:
        return self.values[start:stop]


@pytest.mark.parametrize("n", [1, 63, 64, 65, 1000, 20_000])
def test_ids_are_gathered_as_unique_does(n: int) -> None:
    rng = np.random.default_rng(n)
    for ids in (rng.integers(0, n, 500), np.array([0, n - 1, n - 1, 0]), np.arange(n), np.empty(0, np.int64)):
        expected, places = np.unique(ids, return_inverse=True)
        words = np.zeros((n >> 6) + 1, np.uint64)
        before = np.empty(len(words) + 1, np.int64)
        assert blocks.gather(ids, words, before) == len(expected)
        made, at = np.empty(len(expected), np.int64), np.empty(len(ids), np.int64)
        blocks.listed(words, made)
        blocks.ranks(ids, words, before, at)
        assert np.array_equal(made, expected)
        assert np.array_equal(at, places)


def test_they_are_read_window_by_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points, "WINDOW", 100)
    xyz = np.random.default_rng(0).random((1234, 3))
    ids = np.random.default_rng(1).integers(0, 1234, 400)
    made, local, origins = Points(InMemory(xyz), 1).of(ids)
    assert np.array_equal(made[local], xyz[ids])
    assert len(made) == len(np.unique(ids))
    assert [origins.of(int(at)) for at in local] == ids.tolist()


@pytest.mark.parametrize("budget", [1, 1 << 30])
@pytest.mark.parametrize("is_read", [True, False], ids=["ids-read-for-it", "ids-of-others"])
def test_points_that_are_close_are_read_from_the_first_to_the_last(*, is_read: bool, budget: int) -> None:
    xyz = np.random.default_rng(0).random((5000, 3))
    ids = np.random.default_rng(1).integers(1000, 1100, 400)
    known = ids.copy()
    if not is_read:
        ids.flags.writeable = False
    some = Points(InMemory(xyz), budget)
    made, local, origins = some.of(ids)
    assert len(made) == known.max() + 1 - known.min()
    assert some.bytes_read == made.nbytes
    assert np.array_equal(made[local], xyz[known])
    assert origins.all(len(made))[local].tolist() == known.tolist()
    assert is_read or np.array_equal(ids, known)


@pytest.mark.parametrize("wrong", [-1, 5000])
def test_an_id_of_no_point_is_refused_where_the_others_are_close(wrong: int) -> None:
    with pytest.raises(MeshError, match=f"point id {wrong} is outside 0..4999"):
        Points(InMemory(np.zeros((5000, 3))), 1).of(np.array([*range(4995, 5000), *range(4995, 5000), wrong]))


N = 3 * BLOCK
XYZ = np.random.default_rng(0).random((N, 3))
CLOSE = np.random.default_rng(1).integers(1000, 1400, 80 * SOME)


@pytest.mark.parametrize("budget", [0, XYZ.nbytes // 2, 2 * XYZ.nbytes])
@pytest.mark.parametrize("odd", [1000, 990, 0, N - 1])
@pytest.mark.parametrize("is_read", [True, False], ids=["ids-read-for-it", "ids-of-others"])
def test_one_id_is_not_close_to_those_that_are_looked_at_first(budget: int, odd: int, *, is_read: bool) -> None:
    ids = CLOSE.copy()
    ids[SOME + 1] = odd
    given = ids.copy() if is_read else ids.view()
    made, local, origins = Points(InMemory(XYZ), budget).of(given)
    assert np.array_equal(made[local], XYZ[ids])
    assert np.array_equal(origins.all(len(made))[local], ids)
    assert len(made) < 500 or odd not in (1000, 990)
    assert ids[SOME + 1] == odd


@pytest.mark.parametrize("budget", [0, 2 * XYZ.nbytes])
@pytest.mark.parametrize("wrong", [-1, N, -(2**63), 2**63 - 1])
@pytest.mark.parametrize("at", [0, SOME + 1])
def test_ids_are_as_they_were_where_one_is_of_no_point(budget: int, wrong: int, at: int) -> None:
    ids = CLOSE.copy()
    ids[at] = wrong
    given, some = ids.copy(), Points(InMemory(XYZ), budget)
    if some.fits:  # the mesh says so
        assert some.of(given)[1] is given
    else:
        with pytest.raises(MeshError, match=f"point id {wrong} is outside 0..{N - 1}"):
            some.of(given)
    assert np.array_equal(given, ids)
