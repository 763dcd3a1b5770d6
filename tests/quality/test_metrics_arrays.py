"""The layout of the arrays, slices and threads change no value."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from metric_cells import N, array_pairs, cell_values, one_by_one, pairs, public_values, random_cells

import meshgauge
from meshgauge.cells import BY_NAME, SHAPES, Shape
from meshgauge.mesh import CellIds, connectivity
from meshgauge.quality.metrics import METRICS, Metric, tetra

pytestmark = pytest.mark.usefixtures("path")


@array_pairs
def test_float32_points_are_taken_at_their_exact_value(row: Metric, shape: Shape) -> None:
    narrow = random_cells(shape, 200).astype(np.float32)
    _, cells = one_by_one(narrow)  # type: ignore[arg-type]
    for ids in (cells, cells.astype(np.int32), cells.astype(np.uint16)):
        got = public_values(row, shape.name, narrow, ids)  # type: ignore[arg-type]
        np.testing.assert_array_equal(got, cell_values(row, shape.name, narrow.astype(np.float64)))


@array_pairs
def test_arrays_and_meshes_have_the_same_values(row: Metric, shape: Shape) -> None:
    x = random_cells(shape, 300)
    np.testing.assert_array_equal(public_values(row, shape.name, x), cell_values(row, shape.name, x))


@pairs
def test_slices_and_threads_change_nothing(row: Metric, shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    x = random_cells(shape)
    whole = cell_values(row, shape.name, x)
    sizes = cut_into(monkeypatch, 150)
    for threads in (1, 2):
        np.testing.assert_array_equal(cell_values(row, shape.name, x, threads), whole)
    assert {150, N % 150} <= sizes


def cut_into(monkeypatch: pytest.MonkeyPatch, size: int) -> set[int]:
    """Have slices hold so many cells at most; the sizes of those that are then made."""
    real, sizes = connectivity.chunks, set()

    def chunks(cells: CellIds, at_most: int = size) -> Iterator[CellIds]:
        for part in real(cells, min(size, at_most)):
            sizes.add(connectivity.count(part))
            yield part

    monkeypatch.setattr(connectivity, "chunks", chunks)
    monkeypatch.setattr(tetra, "CHUNK", size)
    return sizes


def test_more_cells_than_a_slice_holds() -> None:
    x = random_cells(SHAPES["tetra"])
    many = np.tile(x, (connectivity.CHUNK // N + 2, 1, 1))
    one, two = (cell_values(METRICS["jens"], "tetra", many, threads) for threads in (1, 2))
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one.reshape(-1, N), np.broadcast_to(one[:N], (len(many) // N, N)))
    np.testing.assert_allclose(one[:N], cell_values(METRICS["jens"], "tetra", x), rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize("dtype", [np.int64, np.int32])
@pytest.mark.parametrize("name", [*SHAPES, "voxel", "triangle", "tetra10"])
def test_an_id_that_is_no_points_is_named(name: str, dtype: type) -> None:
    """Also by kernels that find it themselves, wherever it stands in their blocks."""
    n = BY_NAME[name].n_nodes or 0
    points = np.random.default_rng(0).random((n, 3))
    cells = np.tile(np.arange(n, dtype=dtype), (130, 1))
    for at, wrong in (
        (0, n),
        (70 * n + n // 2, -1),
        (129 * n + n - 1, n),
        (64 * n, np.iinfo(dtype).max),
        (5, -(2**31)),
    ):
        ids = cells.copy()
        ids.flat[at] = wrong
        with pytest.raises(
            meshgauge.MeshError,
            match=rf"^{name}: point id {wrong} of cell {at // n}, node {at % n}, is outside 0..{n - 1}$",
        ):
            meshgauge.jens(points, ids, name)
