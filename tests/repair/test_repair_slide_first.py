"""Sliding where it helps: before all else, without faces that cut corners, and never worse than without."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from repair_meshes import ball, pipe, shaken, slid
from thinned import quick

import meshgauge
from meshgauge import Mesh, measure
from meshgauge.repair import whole
from meshgauge.repair.acceptance import is_better, n_unusable
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.deviation import deviation
from meshgauge.repair.problem import Part, Points, problem
from meshgauge.repair.projection import Projection
from meshgauge.repair.surface import surface_of
from meshgauge.repair.surface_edges import MOST, SurfaceEdges

MESHES: dict[str, Callable[[], Mesh]] = {
    "pipe": lambda: pipe(4),
    "ball": lambda: ball(3, 0.25, 2.4),
    "cube": lambda: slid(shaken("hexahedron", 4, 0.4), 4, 0.3),
    "tetra": lambda: slid(shaken("tetra", 3, 0.35), 3, 0.3),
    "mixed": lambda: slid(shaken("mixed", 4, 0.3), 4, 0.3),
}

WAYS: dict[str, dict[str, object]] = {
    "near": {},
    "everywhere": {"everywhere": True},
    "strict": {"everywhere": True, "strict": True},
}

FEW = [("pipe", "near"), ("mixed", "everywhere")]


def worst(result: meshgauge.Improvement) -> float:
    return float(np.nanmin(result.after.values))


def improve(mesh: Mesh, **options: object) -> meshgauge.Improvement:
    return meshgauge.improve(mesh, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "way"), quick(product(MESHES, WAYS), *FEW))
def test_sliding_is_never_worse_than_a_fixed_boundary(name: str, way: str) -> None:
    mesh, options = MESHES[name](), WAYS[way]
    fixed = improve(mesh, **options)
    for tolerance in (None, 0.01):
        slides = improve(mesh, boundary="slide", tolerance=tolerance, **options)
        assert slides.report.holds
        assert not is_better(fixed.after, slides.after, None if way != "near" else 0.2)
        assert worst(slides) >= worst(fixed) - 1e-12 or n_unusable(slides.after) < n_unusable(fixed.after)


@pytest.mark.parametrize(
    ("name", "boundary"), quick(product(MESHES, ("fixed", "slide")), ("pipe", "fixed"), ("pipe", "slide"))
)
def test_everywhere_leaves_no_more_invalid_cells_than_near_bad_ones(name: str, boundary: str) -> None:
    mesh = MESHES[name]()
    near, everywhere = improve(mesh, boundary=boundary), improve(mesh, boundary=boundary, everywhere=True)
    assert n_unusable(everywhere.after) <= n_unusable(near.after)
    if n_unusable(everywhere.after):
        assert not is_better(near.after, everywhere.after)
    counts = [one.evaluations for one in everywhere.history]
    assert counts == sorted(counts)
    assert counts[-1] == everywhere.report.evaluations


def test_what_sliding_untangles_is_all_positive() -> None:
    """Where a fixed boundary leaves two cells inverted; with raising the worst alone sliding left one of them."""
    mesh = pipe(4)
    assert n_unusable(improve(mesh).after) == 2
    for everywhere in (False, True):
        result = improve(mesh, boundary="slide", everywhere=everywhere)
        assert n_unusable(result.after) == 0
        assert worst(result) > 0.9


def test_sliding_comes_first_where_the_boundary_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it reaches beyond the ceiling needs no comparison: the phases with the boundary fixed are not run."""
    mesh = pipe(4)
    fixed = improve(mesh, everywhere=True)
    assert fixed.report.ceiling < 0.2

    def never(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr(whole, "_phases", never)
    result = improve(mesh, everywhere=True, boundary="slide")
    assert worst(result) > 0.9
    assert result.report.evaluations < fixed.report.evaluations


def edges_of(mesh: Mesh, weight: float) -> tuple[SurfaceEdges, Points, tuple[Part, ...]]:
    points = np.asarray(mesh.points, np.float64)
    constraints = constraints_of(mesh, measure(mesh), None)
    part = problem(mesh, constraints.cells)
    edges = SurfaceEdges(part, surface_of(constraints, points, 40.0), points, weight)
    return edges, points[part.point_ids], part.parts


def test_edges_of_a_curved_surface_are_pulled_where_they_are_long() -> None:
    edges, points, (part,) = edges_of(pipe(3), 2.0)
    assert len(edges.ends) > 20

    def nothing(*_: object) -> tuple[float, float]:
        return 0.0, 1.0

    energy = edges.added_to(nothing)

    def of(points: Points) -> tuple[float, Points]:
        gradient = np.zeros((part.high - part.low, 3))
        value, least = energy(points, part, gradient)
        assert least == 1.0
        return value, gradient

    lengths = np.linalg.norm(points[edges.ends[:, 0]] - points[edges.ends[:, 1]], axis=1)
    over = np.maximum(lengths / edges.most - 1.0, 0.0)
    assert of(points)[0] == pytest.approx(2.0 * (over**2).sum(), abs=1e-15)
    stretched = 1.5 * MOST * points
    value, gradient = of(stretched)
    assert value > 0.0
    for p, axis in ((3, 0), (17, 1), (30, 2)):
        step = np.zeros_like(points)
        step[p, axis] = 1e-6
        slope = (of(stretched + step)[0] - of(stretched - step)[0]) / 2e-6
        assert gradient[p - part.low, axis] == pytest.approx(slope, abs=1e-6)


def test_edges_of_flat_patches_are_not_pulled() -> None:
    assert len(edges_of(shaken("hexahedron", 3, 0.2), 1.0)[0].ends) == 0


def test_what_is_off_by_rounding_is_not_looked_for_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = slid(shaken("hexahedron", 3, 0.0), 3, 0.2)
    surface = surface_of(constraints_of(mesh, measure(mesh), None), np.asarray(mesh.points), 40.0)

    def never(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(Projection, "_nearest_triangles", never)
    moved = np.asarray(slid(shaken("hexahedron", 3, 0.0), 3, 0.2, seed=1).points)
    assert deviation(surface, moved, is_given=False).largest < 1e-14
    with pytest.raises(AssertionError):
        deviation(surface, moved + 0.01, is_given=False)
