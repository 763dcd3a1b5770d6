"""What is looked for in surfaces: which way cells run about, surfaces without two sides, T-joints, edges of three."""

from __future__ import annotations

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, Status
from meshgauge.doctor import diagnosis, orient

pytestmark = pytest.mark.usefixtures("path")


def grid(n: int, *, bump: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Points and quadrilaterals of a square of n by n, curved if there is a bump."""
    axis = np.linspace(0, 1, n + 1)
    x, y = (side.ravel() for side in np.meshgrid(axis, axis))
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = np.stack([first, first + 1, first + n + 2, first + n + 1], axis=1)
    return np.stack([x, y, bump * np.sin(3 * x) * y], axis=1), cells


def names(mesh: Mesh) -> list[str]:
    return [finding.name for finding in diagnosis(mesh).findings]


@pytest.mark.parametrize("bump", [0.0, 0.4])
def test_a_sound_surface_has_no_finding(bump: float) -> None:
    points, cells = grid(5, bump=bump)
    found = diagnosis(Mesh.from_arrays(points, {"quad": cells}))
    assert found.findings == found.skipped == ()
    assert (found.dimension, found.n_interior_faces, found.n_boundary_faces) == (2, 40, 20)
    assert found.n_parts == 1
    assert "hanging points" in found.checked


@pytest.mark.parametrize("bump", [0.0, 0.4])
def test_cells_that_run_the_other_way_round_are_named_and_turned(bump: float) -> None:
    points, cells = grid(5, bump=bump)
    wrong = cells.copy()
    for cell in (3, 7, 24):
        wrong[cell] = wrong[cell][::-1]
    mesh = Mesh.from_arrays(points, {"quad": wrong})
    (finding,) = diagnosis(mesh).findings
    assert (finding.name, finding.level, finding.examples) == ("turned_cells", "defect", (3, 7, 24))
    assert (meshgauge.measure(mesh).values < 0).sum() == (3 if bump == 0 else 0)
    after, changes = orient(mesh)
    assert changes.cells.tolist() == [3, 7, 24]
    assert names(after) == []
    assert (meshgauge.measure(after).status == Status.OK).all()


def test_a_whole_part_that_runs_clockwise_in_a_plane_is_turned() -> None:
    points, cells = grid(3)
    both = np.concatenate([points, 0.5 * points + np.array([2, 0, 0])])
    mesh = Mesh.from_arrays(both, {"quad": np.concatenate([cells, (cells + len(points))[:, ::-1]])})
    assert diagnosis(mesh).finding("turned_cells").count == 9


def test_an_inverted_cell_that_is_numbered_as_it_should_be_is_not_turned() -> None:
    points, cells = grid(4)
    points = points.copy()
    points[12] = points[6] + np.array([-0.05, -0.05, 0])  # the middle beyond the corner of a cell
    mesh = Mesh.from_arrays(points, {"triangle": np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])})
    assert (meshgauge.measure(mesh).status == Status.INVERTED).any()
    assert names(mesh) == []


@pytest.mark.parametrize("name", ["triangle6", "quad6", "quad8", "quad9", "polygon", "pixel"])
def test_a_turned_cell_of_any_type_is_valid_again(name: str) -> None:
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)])
    triangle = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)])
    own = {
        "triangle6": triangle,
        "quad6": square[[0, 1, 2, 3, 4, 6]],
        "quad8": square[:8],
        "quad9": square,
        "polygon": square[[0, 1, 2, 3]],
        "pixel": square[[0, 1, 3, 2]],
    }[name]
    big = 4 * own + np.array([9.0, 0.0])
    mirrored = own * (-1, 1)
    n = len(own)
    mesh = Mesh.from_arrays(np.concatenate([big, mirrored]), {name: np.arange(2 * n).reshape(2, n)})
    assert meshgauge.measure(mesh).values == pytest.approx(
        [meshgauge.measure(mesh).values[0], -meshgauge.measure(mesh).values[0]]
    )
    after, changes = orient(mesh)
    assert changes.cells.tolist() == [1]
    assert (meshgauge.measure(after).status == Status.OK).all()


def test_a_strip_with_one_side() -> None:
    n = 20
    turns = 2 * np.pi * np.arange(n) / n
    rows = [
        ((1 + s * np.cos(t / 2)) * np.cos(t), (1 + s * np.cos(t / 2)) * np.sin(t), s * np.sin(t / 2))
        for t in turns
        for s in (-0.3, 0.3)
    ]
    cells = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(n - 1)]
    strip = Mesh.from_arrays(np.array(rows), {"quad": [*cells, (2 * n - 2, 1, 0, 2 * n - 1)]})
    (finding,) = diagnosis(strip).findings
    assert (finding.name, finding.level, finding.count) == ("not_orientable", "defect", 1)
    # Closed without a twist it is a ring.
    ring = np.stack([np.repeat(np.cos(turns), 2), np.repeat(np.sin(turns), 2), np.tile([0.0, 1.0], n)], axis=1)
    assert names(Mesh.from_arrays(ring, {"quad": [*cells, (2 * n - 2, 0, 1, 2 * n - 1)]})) == []


@pytest.mark.parametrize("n", [1, 3])
def test_points_that_hang_on_an_edge(n: int) -> None:
    # One cell on the left, and more on the right whose points lie on its edge.
    heights = np.linspace(0, 1, n + 2)
    left = [(0, 0), (1, 0), (1, 1), (0, 1)]
    right = [(2, h) for h in heights] + [(1, h) for h in heights[1:-1]]
    points = np.array(left + right, float)
    column = [1, *range(len(left) + n + 2, len(points)), 2]
    cells = [(0, 1, 2, 3)] + [(column[m], 4 + m, 5 + m, column[m + 1]) for m in range(n + 1)]
    mesh = Mesh.from_arrays(points, {"quad": cells})
    (finding,) = diagnosis(mesh).findings
    assert (finding.name, finding.level, finding.count) == ("hanging_points", "defect", n)


def test_edges_of_three_cells() -> None:
    points = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (-1, -1, 0)], float)
    cells = [(0, 1, 2), (1, 0, 3), (0, 1, 4)]
    (finding,) = diagnosis(Mesh.from_arrays(points, {"triangle": cells})).findings
    assert (finding.name, finding.level, finding.count) == ("multiple_edges", "notice", 1)
    flat = Mesh.from_arrays(points[:, [0, 2]] + points[:, [1, 1]] * 0.3, {"triangle": cells})
    assert diagnosis(flat).finding("multiple_edges").level == "defect"


def test_cells_that_are_there_twice_and_points_twice() -> None:
    points, cells = grid(2)
    twice = Mesh.from_arrays(points, {"quad": np.concatenate([cells, cells[1:2, ::-1]])})
    assert "duplicate_cells" in names(twice)
    assert "turned_cells" not in names(twice)
    assert names(Mesh.from_arrays(points, {"quad": [(0, 1, 1, 3)]}))[0] == "repeated_points"
