"""Determinants that are zero or almost: decided exactly, or said to be undecided."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from certificate_cells import CURVED, KINDS, LINEAR, ideal, many, mean_edge_cubed, separate, with_vanishing_tangent

from meshgauge.kernels.certificate.bounds import Bounds, Validity, bounds
from meshgauge.kernels.certificate.tables import row_of


def one(name: str, nodes: object) -> Bounds:
    return bounds(name, *separate(np.array(nodes, float)[None]))


def twisted(name: str, factors: tuple[float, float], height: float) -> np.ndarray:
    """A prism whose base (x, y) goes to a top (f·x, g·y): determinant ``area·h·(1-t+ft)(1-t+gt)``."""
    base = [(-1, -1), (1, -1), (1, 1), (-1, 1)] if name == "hexahedron" else [(0, 0), (1, 0), (0, 1)]
    f, g = factors
    return np.array([(x, y, 0) for x, y in base] + [(f * x, g * y, height) for x, y in base], float)


@pytest.mark.parametrize("height", [10.0, 100.0])
def test_hexahedron_of_two_parameters(height: float) -> None:
    """SCIENCE.md §4: E_q .941 (h = 10) and .9994 (h = 100), and (1-2t)(1-3t) negative between 1/3 and 1/2."""
    cell = twisted("hexahedron", (-1, -2), height)
    result = one("hexahedron", cell)
    least = 4 * height * (1 - 2 * 5 / 12) * (1 - 3 * 5 / 12) / mean_edge_cubed("hexahedron", cell[None])[0]
    assert result.status == Validity.INVALID
    assert result.lower <= least <= result.upper < 0
    wedge = twisted("wedge", (-1, -2), height)
    exact = one("wedge", wedge)
    least = height * (1 - 2 * 5 / 12) * (1 - 3 * 5 / 12) / mean_edge_cubed("wedge", wedge[None])[0]
    assert exact.status == Validity.INVALID
    assert exact.lower == pytest.approx(least, rel=1e-13)


@pytest.mark.parametrize("name", ["wedge", "hexahedron"])
def test_zero_inside_and_positive_elsewhere(name: str) -> None:
    """Top turned by 180°: (1 - 2t)², exactly zero half-way up, is not valid."""
    result = one(name, twisted(name, (-1, -1), 4))
    assert result.status == Validity.INVALID
    assert result.lower <= result.upper == 0


def test_zero_inside_at_no_binary_fraction() -> None:
    """(1 - 3t)²: the wedge's quadratic has an exact discriminant; the hexahedron's minimum is never reached."""
    wedge = one("wedge", twisted("wedge", (-2, -2), 4))
    assert (wedge.status, wedge.lower, wedge.upper) == (Validity.INVALID, 0, 0)
    hexahedron = one("hexahedron", twisted("hexahedron", (-2, -2), 4))
    assert hexahedron.status == Validity.UNDECIDED
    assert -1e-6 < hexahedron.lower <= 0 < hexahedron.upper < 1e-6


@pytest.mark.parametrize("name", ["wedge", "hexahedron"])
@pytest.mark.parametrize("turn", [1e-3, 1e-7])
def test_almost_zero_inside(name: str, turn: float) -> None:
    """Top turned by π less a little: the least determinant is area·h·(1 + cos)/2, positive down to 2.5e-15."""
    angle = np.pi - turn
    rotation = np.array([(np.cos(angle), -np.sin(angle), 0), (np.sin(angle), np.cos(angle), 0), (0, 0, 1)])
    cell = twisted(name, (1, 1), 1)
    cell[len(cell) // 2 :] = cell[len(cell) // 2 :] @ rotation.T
    result = one(name, cell)
    area = 4.0 if name == "hexahedron" else 1.0
    least = area * np.sin(turn / 2) ** 2 / mean_edge_cubed(name, cell[None])[0]
    assert result.status == Validity.VALID
    assert 0 < result.lower <= result.upper
    assert result.lower <= least * (1 + 1e-6) + 1e-16


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_sign_of_nearly_flat_tetrahedra(offset: float) -> None:
    """Four points on a plane up to rounding: the sign of the determinant in rational numbers, in every cell."""
    rng = np.random.default_rng(0)
    m = many(400)
    cells = np.empty((m, 4, 3))
    cells[:, :3] = rng.random((m, 3, 3)) + offset
    cells[:, 3] = np.einsum("mk,mkx->mx", rng.dirichlet((1, 1, 1), m), cells[:, :3])
    result = bounds("tetra", *separate(cells))
    for n, cell in enumerate(cells.tolist()):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (
            [Fraction(p) - Fraction(q) for p, q in zip(node, cell[0], strict=True)] for node in cell[1:]
        )
        det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        assert (result.status[n] == Validity.VALID) == (det > 0)
        assert np.sign(result.upper[n]) == np.sign(result.lower[n]) == (det > 0) - (det < 0)


@pytest.mark.parametrize("name", KINDS)
def test_flat_and_collapsed_cells(name: str) -> None:
    """A flat cell, and one with all nodes on one point, are zero exactly."""
    flat = ideal(name) * (1, 1, 0)
    for cell in (flat, flat @ np.array([(0.5, 0.25, 1), (2, 1, 0), (1, 3, 7)]), np.full_like(flat, 0.1)):
        result = one(name, cell)
        assert (result.status, result.upper) == (Validity.INVALID, 0)
        assert -1e-12 < result.lower <= 0


def test_hexahedron_collapsed_to_a_wedge() -> None:
    """Repeated nodes: corners of determinant zero, none negative."""
    cell = ideal("hexahedron")
    cell[3], cell[7] = cell[2], cell[6]
    result = one("hexahedron", cell)
    assert result.status == Validity.INVALID
    assert result.upper == 0


def test_flat_corner_that_is_positive_by_a_rounding() -> None:
    """A tiny positive corner beside ordinary ones is valid: zero is not a matter of tolerance."""
    cell = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    # At node 6 the three edges lie in the plane x + y + z = 2; the node is moved through it by roundings.
    seen = set()
    for step in range(-3, 4):
        cell[6] = (2 / 3 + step * 2.0**-53, 2 / 3, 2 / 3)
        total = sum(Fraction(float(x)) for x in cell[6])
        result = one("hexahedron", cell)
        assert (result.status == Validity.VALID) == (total > 2)
        assert np.sign(result.upper) == (total > 2) - (total < 2)
        seen.add(int(result.status[0]))
    assert seen == {Validity.VALID, Validity.INVALID}


@pytest.mark.parametrize("name", CURVED)
def test_quarter_points(name: str) -> None:
    """A node at a quarter of its edge, a control point at its end: the tangent there is zero, so the determinant is."""
    edge = next(edge for edge in row_of(name).edges if len(edge) == 3)
    cell = np.round(64 * ideal(name)) / 64
    result = one(name, with_vanishing_tangent(name, cell, edge))
    assert result.status == Validity.INVALID
    assert result.upper == 0
    assert one(name, with_vanishing_tangent(name, cell, edge, 0.96)).upper > 0


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite_coordinates(name: str, value: float) -> None:
    """Every node, every axis: undefined, and the cell beside it is not touched."""
    cell = ideal(name)
    cells = np.repeat(cell[None], 3 * len(cell) + 1, axis=0)
    for n in range(3 * len(cell)):
        cells[n, n // 3, n % 3] = value
    result = bounds(name, *separate(cells))
    assert (result.status[:-1] == Validity.UNDEFINED).all()
    assert np.isnan(result.lower[:-1]).all()
    assert np.isnan(result.upper[:-1]).all()
    assert result.status[-1] == Validity.VALID


@pytest.mark.parametrize("name", LINEAR)
def test_coordinates_of_mixed_size(name: str) -> None:
    """An edge of 1e-170 beside edges of 1e150: valid, with the smallest positive numbers as bounds."""
    cell = ideal(name) * (1e-170, 1e150, 1.0)
    result = one(name, cell)
    assert result.status == Validity.VALID
    assert 0 < result.lower <= result.upper
    mirrored = one(name, cell * (1, 1, -1))
    assert mirrored.status == Validity.INVALID
    assert mirrored.upper < 0


def test_budget_runs_out() -> None:
    """Without subdivision a cell that needs it is left undecided, never guessed."""
    cell = twisted("hexahedron", (-0.5, -0.55), 10)
    points, connectivity = separate(cell[None])
    assert bounds("hexahedron", points, connectivity, max_splits=0).status == Validity.UNDECIDED
    assert bounds("hexahedron", points, connectivity).status == Validity.INVALID
