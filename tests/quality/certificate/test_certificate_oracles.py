"""Whole cells against other ways of finding the minimum: Gmsh, dense samples, whole numbers."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import optional
import pytest
from certificate_cells import (
    KINDS,
    basis,
    cloud,
    coefficients,
    coefficients_and_errors,
    family,
    ideal,
    many,
    mean_edge_cubed,
    places,
    separate,
)

from meshgauge.kernels.certificate.bounds import Validity, bounds
from meshgauge.kernels.certificate.exact import combination, det, exact, root_ratio, whole_points, whole_table
from meshgauge.kernels.certificate.tables import table

# Gmsh's element type, and the volume of the reference cell of its determinant over ours.
GMSH_TYPES = {
    "tetra": (4, 1),
    "pyramid": (7, 4),
    "wedge": (6, 2),
    "hexahedron": (5, 8),
    "tetra10": (11, 1),
    "wedge15": (18, 2),
    "wedge18": (13, 2),
    "hexahedron20": (17, 8),
    "hexahedron27": (12, 8),
    "pyramid13": (19, 4),
    "pyramid14": (14, 4),
}
GMSH_TOLERANCE = 2e-3
"""Gmsh subdivides wedges, hexahedra and curved cells until its bound is within 1e-3, and returns a bound from below."""


@pytest.fixture(scope="module")
def gmsh() -> Iterator[Any]:
    """Gmsh's API; skips where it is not installed."""
    module = optional.gmsh()
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()


def reference_frame(name: str) -> tuple[np.ndarray, np.ndarray]:
    """The ideal cell as an affine image of the reference cell in [0, 1]: its origin and axes."""
    cell = ideal(name)
    axes = {"hexahedron": (1, 3, 4), "wedge": (1, 2, 3), "tetra": (1, 2, 3)}.get(family(name))
    if axes is None:
        return cell[:4].mean(0), np.array(
            [(cell[1] - cell[0]) / 2, (cell[3] - cell[0]) / 2, cell[4] - cell[:4].mean(0)]
        )
    return cell[0], cell[list(axes)] - cell[0]


def gmsh_order(gmsh: Any, name: str) -> list[int]:
    """Our node at each of Gmsh's positions, found by reference coordinates."""
    *_, local, _ = gmsh.model.mesh.getElementProperties(GMSH_TYPES[name][0])
    local = np.reshape(local, (-1, 3)).copy()
    if family(name) == "hexahedron":
        local = (local + 1) / 2
    elif family(name) == "wedge":
        local[:, 2] = (local[:, 2] + 1) / 2
    origin, axes = reference_frame(name)
    distance = np.linalg.norm((origin + local @ axes)[:, None] - ideal(name)[None], axis=-1)
    assert distance.min(1).max() < 1e-12
    return distance.argmin(1).tolist()


def gmsh_mesh(gmsh: Any, name: str, points: np.ndarray, connectivity: np.ndarray) -> np.ndarray:
    """Put the cells into a new Gmsh model; their tags."""
    gmsh.clear()
    gmsh.model.add(name)
    entity = gmsh.model.addDiscreteEntity(3)
    gmsh.model.mesh.addNodes(3, entity, np.arange(1, len(points) + 1), points.ravel())
    tags = np.arange(1, len(connectivity) + 1)
    nodes = connectivity[:, gmsh_order(gmsh, name)] + 1
    gmsh.model.mesh.addElementsByType(entity, GMSH_TYPES[name][0], tags, nodes.ravel())
    return tags


@pytest.mark.parametrize("amplitude", [0.05, 0.15, 0.4])
@pytest.mark.parametrize("name", [name for name in GMSH_TYPES if name not in ("pyramid13", "pyramid14")])
def test_agrees_with_gmsh(gmsh: Any, name: str, amplitude: float) -> None:
    """The sign of Gmsh's minDetJac in every cell, and its value between our bounds, up to its tolerance."""
    n = many({1: 3000, 2: 1500}[1 if table(name).n_nodes <= 10 else 2])
    points, connectivity = cloud(name, n, amplitude * (1 if table(name).n_nodes <= 8 else 0.5))
    ours = bounds(name, points, connectivity)
    tags = gmsh_mesh(gmsh, name, points, connectivity)
    theirs = np.array(gmsh.model.mesh.getElementQualities(tags, "minDetJac"))
    theirs *= GMSH_TYPES[name][1] / mean_edge_cubed(name, points[connectivity])
    assert np.array_equal(theirs > 0, ours.status == Validity.VALID)
    assert not (ours.status == Validity.UNDECIDED).any()
    assert (theirs <= ours.upper + 1e-12).all()
    if amplitude < 0.1 or name in ("tetra", "pyramid", "wedge"):
        # Where most determinants are negative, each side stops where the sign is known.
        assert (theirs >= ours.lower - GMSH_TOLERANCE).all()


@pytest.mark.parametrize("name", ["pyramid13", "pyramid14"])
def test_gmsh_passes_invalid_quadratic_pyramids(gmsh: Any, name: str) -> None:
    """Gmsh 4.15 gives many of them a minDetJac above determinants that its own getJacobians has inside.

    These are ours: equal at each place, and never below our bounds.
    """
    points, connectivity = cloud(name, many(60), 0.2)
    scale = 4 / mean_edge_cubed(name, points[connectivity])
    tags = gmsh_mesh(gmsh, name, points, connectivity)
    claimed = np.array(gmsh.model.mesh.getElementQualities(tags, "minDetJac")) * scale
    in_cube = np.array(list(product(*[np.linspace(0, 1, 9)] * 2, np.linspace(0, 0.98, 8))))
    r, s, t = in_cube.T
    local = np.stack([(2 * r - 1) * (1 - t), (2 * s - 1) * (1 - t), t], 1)
    _, determinants, _ = gmsh.model.mesh.getJacobians(GMSH_TYPES[name][0], local.ravel())
    theirs = np.reshape(determinants, (len(tags), -1)) * scale[:, None]
    assert coefficients(name, points[connectivity]) @ basis(name, in_cube).T == pytest.approx(theirs, abs=1e-9)
    sampled = theirs.min(1)
    ours = bounds(name, points, connectivity)
    assert (ours.lower <= sampled).all()
    assert (ours.status[sampled <= 0] == Validity.INVALID).all()
    assert (claimed > sampled + 1e-3).any()


@pytest.mark.parametrize("amplitude", [0.1, 0.25])
@pytest.mark.parametrize("name", KINDS)
def test_encloses_dense_samples(name: str, amplitude: float) -> None:
    """No sample of the determinant is below the lower bound, and none of a valid cell is at zero or below."""
    points, connectivity = cloud(name, many(300), amplitude * (1 if table(name).n_nodes <= 8 else 0.6))
    result = bounds(name, points, connectivity)
    samples = coefficients(name, points[connectivity]) @ basis(name, places(name, many(2000))).T
    least = samples.min(1)
    assert (least >= result.lower - 1e-12).all()
    assert (least[result.status == Validity.VALID] > 0).all()
    assert (result.lower <= result.upper).all()


@pytest.mark.parametrize("name", ["tetra", "pyramid", "wedge"])
def test_is_exact_for_linear_cells(name: str) -> None:
    """The bounds are the minimum, up to rounding: the least of dense samples along the lines that hold it."""
    points, connectivity = cloud(name, many(500), 0.3)
    result = bounds(name, points, connectivity)
    ends = [(0, 0), (1, 0), (0, 1)] if name == "wedge" else [(0, 0), (1, 0), (0, 1), (1, 1)]
    lines = np.array([(r, s, t) for t in np.linspace(0, 1, 2001) for r, s in (ends if name != "tetra" else [(0, 0)])])
    samples = coefficients(name, points[connectivity]) @ basis(name, lines).T
    assert (result.upper - result.lower).max() < 1e-13
    assert samples.min(1) == pytest.approx(result.lower, abs=1e-6)
    assert (samples.min(1) >= result.lower).all()


@pytest.mark.parametrize("name", KINDS)
def test_agrees_with_whole_numbers(name: str) -> None:
    """A few dozen cells in exact arithmetic: the same verdict, and bounds that overlap."""
    n = 24 if table(name).n_nodes < 20 else 6
    points, connectivity = cloud(name, n, 0.3 if table(name).n_nodes <= 8 else 0.15, seed=5)
    result = bounds(name, points, connectivity)
    for cell in range(n):
        proof = exact(name, points[connectivity[cell]].tolist(), 50)
        assert proof.status == result.status[cell]
        assert result.lower[cell] <= proof.upper
        assert proof.lower <= result.upper[cell]


@pytest.mark.parametrize("name", KINDS)
def test_rounding_is_within_its_bound(name: str) -> None:
    """Thin, turned and far from the origin: each coefficient is as near the exact one as the bound on rounding says."""
    row, whole = table(name), whole_table(name)
    rng = np.random.default_rng(6)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    m = 6 if row.n_nodes < 20 else 2
    for thickness, offset in product((1, 1e-5), (0, 1e6)):
        noise = rng.uniform(-0.1, 0.1, (m, row.n_nodes, 3))
        cells = (ideal(name) + noise) @ np.diag((1, 1, thickness)) @ rotation.T + offset
        values, errors = coefficients_and_errors(name, cells)
        for cell, found, bound in zip(cells, values, errors, strict=True):
            points = whole_points(cell.tolist())
            vectors = [combination(parts, points) for parts in whole.vectors]
            unit = whole.term_unit * whole.vector_unit**3
            square = Fraction(
                sum(
                    w * sum((p - q) ** 2 for p, q in zip(points[a], points[b], strict=True)) for a, b, w in whole.edges
                ),
                whole.edge_unit,
            )
            for value, terms in zip(found, whole.terms, strict=True):
                exact_value = Fraction(sum(w * det(vectors[a], vectors[b], vectors[c]) for a, b, c, w in terms), unit)
                expected = root_ratio(exact_value**2 / square**3, 1 / row.terms.ideal) if exact_value else 0.0
                expected = expected if exact_value > 0 else -expected
                assert abs(value - expected) <= bound + 1e-15 * abs(expected)
            assert bound < 1e-9


@pytest.mark.parametrize(("amplitude", "percent"), [(0.5, 0.44), (0.7, 5.7)])
def test_frequency_of_cells_with_fine_corners_and_invalid_inside(amplitude: float, percent: float) -> None:
    """SCIENCE.md §4: of unit cubes with noise whose eight corners are positive, this share is invalid."""
    cube = ideal("hexahedron")
    n = many(100_000)
    cells = cube + np.random.default_rng(2).uniform(-amplitude, amplitude, (n, 8, 3))
    result = bounds("hexahedron", *separate(cells))
    triples = [(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2)]
    triples.append((7, 6, 4, 3))
    corners = [np.linalg.det(cells[:, [i, j, k]] - cells[:, [a]]) for a, i, j, k in triples]
    fine = np.min(corners, 0) > 0
    found = 100 * (result.status[fine] == Validity.INVALID).mean()
    deviation = 100 * np.sqrt(percent / 100 / fine.sum())
    assert found == pytest.approx(percent, abs=4 * deviation + 0.05 * percent)
    assert not (result.status == Validity.UNDECIDED).any()
