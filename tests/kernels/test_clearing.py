"""What a kernel says to be valid inside at first sight is what the certificate proves."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge.cells import BY_NAME, CellType
from meshgauge.kernels.cells import driver, flat
from meshgauge.kernels.certificate.bounds import Validity, validity
from meshgauge.kernels.jit import JIT_DISABLED

HEXAHEDRON, WEDGE = BY_NAME["hexahedron"], BY_NAME["wedge"]
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
HALF = CUBE[[0, 1, 2, 4, 5, 6]]
N = 100 if JIT_DISABLED else 20_000


def cells(noise: float, *, of: np.ndarray = CUBE) -> tuple[np.ndarray, np.ndarray]:
    """Points ``(8 N, 3)`` and nodes of bricks, each corner moved by up to so much along each axis; or ``of`` others."""
    points = of + np.random.default_rng(0).uniform(-noise, noise, (N, *of.shape))
    return points.reshape(-1, 3), np.arange(len(of) * N).reshape(N, len(of))


def jens_and_clear(points: np.ndarray, nodes: np.ndarray, row: CellType = HEXAHEDRON) -> tuple[np.ndarray, np.ndarray]:
    """J_ENS, and of which cells it is clear that they are valid."""
    values, clear = np.empty(len(nodes)), np.empty(len(nodes), np.bool_)
    with np.errstate(all="ignore"):  # with the JIT off NumPy's scalars warn where compiled code goes on
        driver.cell_jens(points, nodes, row, values, compiled=True, clear=clear)
    return values, clear


@pytest.mark.parametrize("noise", [0.1, 0.3, 0.45, 0.7])
@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1e3, 1e6), (1e-20, 1e-20, 1e-20), (1e20, 1e16, 1e20)])
@pytest.mark.parametrize("away", [0.0, 1e3])
def test_what_is_clear_is_proved(noise: float, stretch: tuple[float, float, float], away: float) -> None:
    points, nodes = cells(noise)
    points = (points + away) * stretch
    values, clear = jens_and_clear(points, nodes)
    with np.errstate(all="ignore"):
        proved = validity("hexahedron", points, nodes, compiled=True)
    assert (proved[clear] == Validity.VALID).all()
    assert (values[clear] > flat.LIMIT).all()
    without = np.empty(N)
    with np.errstate(all="ignore"):
        driver.cell_jens(points, nodes, HEXAHEDRON, without, compiled=True)
    assert np.array_equal(values, without, equal_nan=True)
    is_stretched = len({*stretch}) > 1
    if noise == 0.1 and not is_stretched:
        assert clear.all()
    if noise == 0.45 and not is_stretched and not JIT_DISABLED:
        assert ((proved == Validity.INVALID) & (values > flat.LIMIT)).any()  # corners alone would not do


@pytest.mark.parametrize("noise", [0.1, 0.3, 0.45, 0.7])
@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1e3, 1e6), (1e20, 1e16, 1e20)])
def test_a_wedge_that_is_clear_is_proved(noise: float, stretch: tuple[float, float, float]) -> None:
    """As nearly all are that have no negative corner: the certificate asks nothing else of one whose middle is so."""
    points, nodes = cells(noise, of=HALF)
    points *= stretch
    values, clear = jens_and_clear(points, nodes, WEDGE)
    with np.errstate(all="ignore"):
        proved = validity("wedge", points, nodes, compiled=True)
    assert (proved[clear] == Validity.VALID).all()
    assert (values[clear] > flat.LIMIT).all()
    if max(stretch) == 1:
        good = (proved == Validity.VALID) & (values > 2 * flat.LIMIT)
        assert clear[good].mean() > 0.95
    if noise == 0.45 and max(stretch) == 1 and not JIT_DISABLED:
        assert ((proved == Validity.INVALID) & (values > 2 * flat.LIMIT)).any()  # corners alone would not do


@pytest.mark.parametrize(("row", "of"), [(HEXAHEDRON, CUBE), (WEDGE, HALF)])
@pytest.mark.parametrize("noise", [0.1, 0.7])
def test_what_is_told_in_passing_is_the_same(noise: float, row: CellType, of: np.ndarray) -> None:
    """To the last bit: a report tells it so of slices, and in passes of their own of whole meshes."""
    points, nodes = cells(noise, of=of)
    points[nodes[:3, 4]] = np.array([np.nan, np.inf, 1e300])[:, None]
    passing, own = [np.empty(N) for _ in range(3)], [np.empty(N) for _ in range(3)]
    clear = [np.empty(N, np.bool_) for _ in range(2)]
    with np.errstate(all="ignore"):
        for values, some, beside in ((passing, clear[0], (passing[1], passing[2])), (own, clear[1], None)):
            driver.cell_jens(points, nodes, row, values[0], compiled=True, clear=some, beside=beside)
        driver.companions(points, nodes, row, own[1], own[2])
    assert np.array_equal(passing, own, equal_nan=True)
    assert np.array_equal(*clear)
    assert np.isnan(own[1][:3]).all()


def test_thin_bricks_are_clear() -> None:
    points, nodes = cells(0.0)
    assert jens_and_clear(points * (1, 1e3, 1e6), nodes)[1].all()


def test_nothing_is_clear_of_what_is_no_number() -> None:
    points, nodes = cells(0.1)
    for corner, value in enumerate((np.nan, np.inf, -np.inf, 1e300, np.nan, np.nan, np.inf, np.nan)):
        points[nodes[corner, corner], corner % 3] = value
    values, clear = jens_and_clear(points, nodes)
    assert not clear[:8].any()
    assert clear[8:].all()
    assert (np.isnan(values[:8]) == [True, True, True, False, True, True, True, True]).all()


def test_a_cell_as_flat_as_rounding_is_not_clear() -> None:
    points, nodes = cells(0.0)
    points[:, 0] += points[:, 2] * np.repeat(np.linspace(50.0, 150.0, N), 8)  # sheared until corners are flat
    values, clear = jens_and_clear(points, nodes)
    assert values[0] > flat.LIMIT > values[-1] > 0
    assert np.array_equal(clear, values > flat.LIMIT)
