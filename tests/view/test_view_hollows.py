"""Light in hollows against what boxes of known form must give; volumes of cells against those of ideal ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from view_meshes import cubes

from meshgauge.cells import BY_NAME
from meshgauge.view import hollows
from meshgauge.view.hollows import normals, roughly
from meshgauge.view.model import Model


def light(model: Model, shown: NDArray[np.bool_]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Middles of the faces that are seen, and their light."""
    surface = model.surface(shown)
    middle, normal = normals(surface, model.points[surface.points])
    grid = model.grid(shown)
    assert grid is not None
    return middle, grid.light(middle, normal)


@pytest.mark.parametrize("fine", [hollows.FINE, 0])
def test_a_convex_body_has_no_hollow_and_a_pit_is_darkest_at_its_bottom(
    monkeypatch: pytest.MonkeyPatch, fine: int
) -> None:
    monkeypatch.setattr("meshgauge.view.model.FINE", fine)  # by volume, and by count
    model = cubes(16)
    shown = model.is_solid.copy()
    assert light(model, shown)[1].min() > 0.97
    x, y, z = model.centres.T
    wide = 0.125 * np.ptp(x)
    shown[(np.abs(x) < wide) & (np.abs(y) < wide) & (z > -0.25 * np.ptp(z))] = False
    middle, value = light(model, shown)
    inside = (np.abs(middle[:, :2]) < wide + 1e-3).all(axis=1) & (np.abs(middle[:, 2]) < 0.45 * np.ptp(z))
    bottom = inside & (middle[:, 2] < middle[inside, 2].min() + 1e-3)
    assert value[bottom].max() < 0.8
    assert value[bottom].min() < 0.72
    assert value[inside].min() >= 1 - hollows.DARKEST - 1e-6
    assert np.median(value[middle[:, 2] < middle[:, 2].min() + 1e-3]) > 0.97  # below it nothing changed


def test_roughly_is_much_the_same() -> None:
    model = cubes(6, noise=0.05)
    surface = model.surface(model.is_solid)
    points = model.points[surface.points]
    exact, rough = normals(surface, points), roughly(surface, points, model.centres)
    assert np.abs(exact[0] - rough[0]).max() < 0.2 * np.ptp(points, axis=0).max() / 6
    assert (exact[1] * rough[1]).sum(axis=1).min() > 0.85


def test_cells_apart_let_more_light_in() -> None:
    model = cubes(12)
    near, far = (model.grid(model.is_solid, shrink) for shrink in (0.0, 0.5))
    assert near is not None
    assert far is not None
    assert far.full[1].max() == pytest.approx(near.full[1].max() / 8, rel=0.1)


def test_nothing_shown_has_no_grid() -> None:
    model = cubes(4)
    assert model.grid(np.zeros(64, np.bool_)) is None


@pytest.mark.parametrize("name", ["tetra", "pyramid", "wedge", "hexahedron"])
def test_volumes_are_those_of_hulls(name: str) -> None:
    hull = pytest.importorskip("scipy.spatial").ConvexHull
    shape = BY_NAME[name].shape
    assert shape is not None
    turn = np.array([[3.0, 0.5, 0.1], [0.2, 1.0, -0.4], [0.0, 0.3, 0.5]])
    points = (np.array(shape.reference) @ turn).astype(np.float32)
    (found,) = hollows.volumes(points, np.arange(len(points)), np.array([0, len(points)]))
    assert found == pytest.approx(hull(points).volume, rel=0.05)
