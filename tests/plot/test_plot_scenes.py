"""Where scenes look from: the plane of the cut, the camera, places of labels. What is rendered: test_plot_command."""

from __future__ import annotations

import ctypes.util
import sys
from pathlib import Path

import numpy as np
import pytest

from meshgauge import Mesh, MeshgaugeError, measure, read
from meshgauge.cells import SHAPES
from meshgauge.plot import callouts, chart_style, cut_scene, worst_cells_scene, worst_faces_scene
from meshgauge.plot.pyvista_cells import drawable, surface
from meshgauge.plot.rendering import frame, over

BOX = np.array([(x, y, z) for x in (0.0, 4.0) for y in (0.0, 1.0) for z in (0.0, 2.0)])


def test_the_cut_is_at_the_worst_cell_along_the_thinnest_axis() -> None:
    centres = np.array([(2.0, 0.6, 1.0), (3.0, 0.1, 1.0)])
    towards, depth = cut_scene._plane(BOX, np.array([2.0, 0.65, 1.0]), centres, None, None)
    np.testing.assert_array_equal(towards, [0, 1, 0])
    assert depth == pytest.approx(0.65)
    assert centres[0] @ towards <= depth
    # Near the outside of that axis another one is cut.
    towards, depth = cut_scene._plane(BOX, np.array([2.0, 0.01, 0.7]), centres, None, None)
    np.testing.assert_array_equal(np.abs(towards), [0, 0, 1])


def test_a_mesh_of_the_plane_is_shown_whole_from_above() -> None:
    flat = BOX * (1.0, 1.0, 0.0) + (0.0, 0.0, 7.0)
    towards, depth = cut_scene._plane(flat, flat[0], flat, None, None)
    np.testing.assert_array_equal(towards, [0, 0, 1])
    assert (flat @ towards <= depth + 1e-9).all()
    eye, up = cut_scene._view(towards, is_plane=True)
    np.testing.assert_array_equal(frame(eye, up), np.eye(3))
    aside, _ = cut_scene._view(towards, is_plane=False)
    assert aside[0] != 0.0


def test_a_cut_that_is_asked_for() -> None:
    towards, depth = cut_scene._plane(BOX, None, BOX, (3.0, 0.0, 0.0), 0.25)
    np.testing.assert_array_equal(towards, [1, 0, 0])
    assert depth == 1.0
    for normal, at in (((0.0, 0.0, 0.0), 0.5), ((np.nan, 0.0, 0.0), 0.5), (None, 1.5)):
        with pytest.raises(MeshgaugeError, match="expected"):
            cut_scene._plane(BOX, None, BOX, normal, at)


@pytest.mark.parametrize("towards", [(0, 0, 1), (1, 2, 3), (0, -1, 0), (0, 0, -1e-9)])
def test_a_frame_is_a_rotation_that_ends_towards_the_eye(towards: tuple[float, float, float]) -> None:
    axes = frame(np.array(towards, float), np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    np.testing.assert_allclose(axes[2], np.array(towards) / np.linalg.norm(towards))


def test_badges_and_labels_do_not_cover_each_other() -> None:
    at = np.array([(50.0, 50.0)] * 5 + [(52.0, 51.0), (300.0, 10.0)])
    places = callouts.apart(at, 20.0)
    far = np.linalg.norm(places[:, None] - places[None, :], axis=2) + 1e3 * np.eye(len(at))
    assert far.min() >= 19
    assert np.linalg.norm(places - at, axis=1).max() < 100
    column = callouts._spread(np.array([5.0, 6.0, 7.0, 300.0]), 60.0, 400.0)
    assert np.diff(column).min() > 55
    assert 0 <= column.min() <= column.max() <= 400


def test_a_picture_over_another() -> None:
    front = np.array([[[200, 0, 0, 255], [200, 0, 0, 0]]], np.uint8)
    behind = np.full((1, 2, 3), 100, np.uint8)
    np.testing.assert_array_equal(over(front, behind), [[[200, 0, 0], [100, 100, 100]]])
    np.testing.assert_array_equal(over(front, behind, 0.5)[0, 0], [150, 50, 50])


TETRA = np.array([(0, 0, 0), (1, 0, 0), (0.5, 3**0.5 / 2, 0), (0.5, 3**0.5 / 6, (2 / 3) ** 0.5)])


@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-200, 0.0), (1e300, 0.0), (1e-2, 1e7), (0.0, 3.0)])
def test_cells_of_any_size_fill_the_unit(scale: float, shift: float) -> None:
    pytest.importorskip("pyvista")
    stray = np.array([(np.nan, 0, 0), (1e100, 0, 0)])  # of no cell that can be drawn
    points = np.r_[TETRA * scale + shift, stray]
    mesh = Mesh.from_arrays(points, {"triangle": [(0, 1, 5)], "tetra": [(0, 1, 2, 3), (0, 1, 2, 4)]})
    solids = drawable(measure(mesh))
    assert solids.grid.n_cells == 1
    assert solids.grid.cell_data["cell"].tolist() == [1]
    drawn = np.asarray(solids.grid.points)[: solids.grid.n_points]
    used = drawn[np.asarray(solids.grid.cell_connectivity)]
    np.testing.assert_allclose(used, solids.place(points[:4]), atol=1e-6)
    assert np.ptp(used, axis=0).max() == pytest.approx(1.0 if scale else 0.0, rel=1e-6)
    assert np.abs(used).max() <= 0.5 + 1e-6


def test_cells_above_second_order_are_drawn_by_their_corners() -> None:
    pytest.importorskip("pyvista")
    pyramid = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.7)])
    points = np.r_[pyramid, np.full((9, 3), 0.3), TETRA + 2]
    mesh = Mesh.from_arrays(points, [("lagrange_pyramid", [range(14)]), ("tetra", [(14, 15, 16, 17)])])
    grid = drawable(measure(mesh)).grid
    assert grid.celltypes.tolist() == [14, 10]
    assert grid.cell_connectivity.tolist() == [0, 1, 2, 3, 4, 14, 15, 16, 17]
    assert surface(grid).n_cells == 5 + 4


def test_the_edges_that_meet_at_the_worst_node() -> None:
    root = Path(__file__).resolve().parents[2] / "examples"
    for name in ("wrong_answers/polyhedron_corner_inverted.vtu", "wrong_answers/pyramid_inverted.vtk"):
        quality = measure(read(root / name))
        (worst,) = quality.worst(1)
        ends = worst_cells_scene._ends(quality, worst)
        assert len(ends) in (3, 4)
        assert not (ends == np.array(worst.coordinates)).all(axis=1).any()
        assert {tuple(end) for end in ends} <= {tuple(p) for p in quality.mesh.points[quality.mesh.nodes(0)]}
    hexahedron = measure(read(root / "wrong_answers" / "hexahedron_corner_inverted.vtk"))
    (worst,) = hexahedron.worst(1)
    nodes = hexahedron.mesh.nodes(0)
    np.testing.assert_array_equal(
        worst_cells_scene._ends(hexahedron, worst),
        [hexahedron.mesh.points[nodes[b if a == worst.node else a]] for a, b in SHAPES["hexahedron"].edges
         if worst.node in (a, b)],
    )  # fmt: skip


def test_cells_inverted_inside_are_pointed_out_before_poor_ones() -> None:
    crossed = read(Path(__file__).resolve().parents[2] / "examples" / "wrong_answers" / "hexahedron_crossed.vtk")
    flat = TETRA * (1, 1, 0.02) + 5
    mesh = Mesh.from_arrays(
        np.r_[flat, flat[[0, 2, 1, 3]] + 1, crossed.points],
        [("tetra", [(0, 1, 2, 3), (4, 5, 6, 7)]), ("hexahedron", 8 + crossed.connectivity.reshape(1, 8))],
    )
    quality = measure(mesh)
    found = quality.worst(3)
    assert [cell.status for cell in found] == ["inverted", "inverted_inside", "ok"]
    assert [cell.cell for cell in quality.worst(1)] == [1]
    assert callouts.caption(found[1]) == ("hexahedron 2", "0.960", "inverted inside")
    assert callouts.colour_of(found[1]) == callouts.colour_of(found[0]) != callouts.colour_of(found[2])
    assert "1 inverted inside" in chart_style.sentence(quality.summary())


@pytest.mark.skipif(
    sys.platform.startswith("linux") and not any(map(ctypes.util.find_library, ("EGL", "GL", "OSMesa"))),
    reason="there is no library to draw scenes with",
)
def test_the_worst_faces_are_numbered_and_say_their_cells() -> None:
    x = np.array([(i, j, k) for k in (0.0, 1.0, 2.0) for j in (0.0, 1.0) for i in (0.0, 1.0)])
    x[8:, 0] += 4.0  # the upper cell leans: the line of the centres is far from the face's normal
    cells = [(0, 1, 3, 2, 4, 5, 7, 6), (4, 5, 7, 6, 8, 9, 11, 10)]
    quality = measure(Mesh.from_arrays(x, {"hexahedron": cells}))
    figure = worst_faces_scene.worst_faces(quality, "non_orthogonality", 3)
    said = [text.get_text() for axes in figure.axes for text in axes.texts]
    angle = np.degrees(np.arctan(2.0))
    assert "cells 0, 1" in said
    assert f"{angle:.3f}" in said
    assert "within its limit" in said
    assert sum(text == "1" for text in said) == 2  # in the whole, and from near
    pixels = np.asarray(figure.axes[1].images[0].get_array()).astype(int)
    blue = (pixels[..., 2] > pixels[..., 0] + 30) & (pixels[..., 2] > 60)
    assert np.count_nonzero(blue) > 500
    outside = worst_faces_scene.worst_faces(quality, "boundary_skewness", 1)
    assert any("boundary" in text.get_text() for text in outside.axes[1].texts)
    for wrong, n, said_why in (("jens", 3, "known are non_orthogonality"), ("skewness", 13, "1 to 12")):
        with pytest.raises(MeshgaugeError, match=said_why):
            worst_faces_scene.worst_faces(quality, wrong, n)
    alone = measure(Mesh.from_arrays(x[:8], {"hexahedron": cells[:1]}))
    with pytest.raises(MeshgaugeError, match="no face has a value"):
        worst_faces_scene.worst_faces(alone, "skewness", 3)
