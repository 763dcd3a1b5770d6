"""Cells with small whole coordinates, where zeros are common, against determinants in rational numbers."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from certificate_cells import separate
from hypothesis import given, settings
from hypothesis import strategies as st

from meshgauge.kernels.certificate.bounds import Validity, bounds

STEPS = [Fraction(n, 4) for n in range(5)]


def weights(name: str, r: Fraction, s: Fraction, t: Fraction) -> list[list[Fraction]]:
    """Derivatives of the linear shape functions by r, s, t, written out."""
    if name == "tetra":
        return [[-1, 1, 0, 0], [-1, 0, 1, 0], [-1, 0, 0, 1]]
    if name == "wedge":
        below, above = 1 - t, t
        return [
            [-below, below, 0, -above, above, 0],
            [-below, 0, below, -above, 0, above],
            [r + s - 1, -r, -s, 1 - r - s, r, s],
        ]
    quad_r, quad_s = [s - 1, 1 - s, s, -s], [r - 1, -r, r, 1 - r]
    quad = [(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s]
    if name == "pyramid":
        # By r and s divided by 1 - t.
        return [[*quad_r, 0], [*quad_s, 0], [*(-w for w in quad), 1]]
    return [
        [*((1 - t) * w for w in quad_r), *(t * w for w in quad_r)],
        [*((1 - t) * w for w in quad_s), *(t * w for w in quad_s)],
        [*(-w for w in quad), *quad],
    ]


def least_on_lattice(name: str, cell: list[list[int]]) -> Fraction:
    """Least determinant at the multiples of 1/4."""
    values = []
    for r, s, t in product(STEPS, repeat=3):
        if name == "wedge" and r + s > 1:
            continue
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (
            [sum(w * node[axis] for w, node in zip(row, cell, strict=True)) for axis in range(3)]
            for row in weights(name, r, s, t)
        )
        values.append(ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx))
    return Fraction(min(values))


@pytest.mark.parametrize(("name", "n_nodes"), [("tetra", 4), ("pyramid", 5), ("wedge", 6), ("hexahedron", 8)])
@settings(deadline=None, max_examples=15)
@given(data=st.data())
def test_verdict_and_rational_values(name: str, n_nodes: int, data: st.DataObject) -> None:
    base = {
        "tetra": [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2)],
        "pyramid": [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 1, 2)],
        "wedge": [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (0, 2, 2)],
        "hexahedron": [(x, y, z) for z in (0, 2) for x, y in ((0, 0), (2, 0), (2, 2), (0, 2))],
    }[name]
    shift = data.draw(st.lists(st.integers(-1, 1), min_size=3 * n_nodes, max_size=3 * n_nodes))
    cell = (np.array(base) + np.reshape(shift, (-1, 3))).tolist()
    result = bounds(name, *separate(np.array(cell, float)[None]))
    least = least_on_lattice(name, cell)
    if result.status == Validity.VALID:
        assert least > 0
    if least <= 0:
        assert result.status == Validity.INVALID
        assert result.lower <= 0
    if name in ("tetra", "pyramid"):
        assert (result.status == Validity.VALID) == (least > 0)
        assert (result.upper == 0) == (least == 0)
