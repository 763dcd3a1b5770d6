"""Prisms over polygons, inside: against the hexahedron and wedge kernels, against samples, and in exact cases."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge import Mesh, Status, measure
from meshgauge.cells import BY_NAME
from meshgauge.kernels.certificate import prism
from meshgauge.kernels.certificate.bounds import Validity, bounds


def twisted(n: int, angle: float, stretch: float, height: float) -> np.ndarray:
    """A prism over a regular n-gon, its top turned, and stretched along y."""
    turn = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    c, s = np.cos(angle), np.sin(angle)
    top = ring * (1, stretch) @ np.array([[c, s], [-s, c]])
    return np.concatenate([np.pad(ring, ((0, 0), (0, 1))), np.pad(top, ((0, 0), (0, 1)), constant_values=height)])


def test_wedges_are_decided_as_by_the_kernel() -> None:
    rng = np.random.default_rng(0)
    points = np.array(BY_NAME["wedge"].shape.points) + rng.normal(0, 0.35, (4000, 6, 3))
    ids = np.arange(4000 * 6).reshape(-1, 6)
    expected = bounds("wedge", points.reshape(-1, 3), ids)[0]
    np.testing.assert_array_equal(prism.validity(points), expected)
    assert 100 < np.count_nonzero(expected == Validity.VALID) < 3900


@pytest.mark.usefixtures("path")
@pytest.mark.parametrize("n_cells", [1, 201])
@pytest.mark.parametrize(("kind", "n"), [("penta_prism", 5), ("hexa_prism", 6)])
def test_a_turned_and_stretched_top_is_inverted_inside(kind: str, n: int, n_cells: int) -> None:
    points = twisted(n, np.pi, 2.0, 60.0)
    nodes = np.arange(2 * n) + 2 * n * np.arange(n_cells)[:, None]
    quality = measure(Mesh.from_arrays(np.tile(points, (n_cells, 1)), [(kind, nodes)]), threads=2)
    assert (quality.values > 0.6).all()
    assert set(quality.status.tolist()) == {Status.INVERTED_INSIDE}
    ideal = np.array(BY_NAME[kind].shape.points)
    fine = measure(Mesh.from_arrays(np.tile(ideal, (n_cells, 1)), [(kind, nodes)]))
    assert set(fine.status.tolist()) == {Status.OK}
    assert fine.summary().corners_only == {}


def test_the_sign_is_exact() -> None:
    """A square prism whose top is turned by half a turn has determinant 0 in the middle: (1 - 2t)²."""
    square = np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)], float)
    cell = np.concatenate([square, -square + (0, 0, 1)])
    assert prism.validity(cell[None]).tolist() == [Validity.INVALID]
    cell[4:] *= (1, 1 - 2e-16, 1)
    samples = prism.validity(np.stack([cell, cell * 1e150, cell * 1e-150]))
    assert samples.tolist() == [samples[0]] * 3
    nothing = prism.validity(np.full((1, 10, 3), np.nan))
    assert nothing.tolist() == [Validity.UNDEFINED]
