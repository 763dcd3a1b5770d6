"""Masks of cells against plain loops; layers, faces and rays against what a cube of cubes must give."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from view_meshes import cubes

import meshgauge
from meshgauge.look.colours import INVALID, POOR, RAMP, UNKNOWN, css
from meshgauge.mesh.topology import topology
from meshgauge.view import layers as layering
from meshgauge.view.camera import Camera
from meshgauge.view.card import card, number
from meshgauge.view.filters import AXES, Filters, Plane, ViewError, in_range, shown
from meshgauge.view.histogram import EDGES, histogram
from meshgauge.view.model import Frame, Model
from meshgauge.view.picking import hit
from meshgauge.view.surface import polygons, seen_faces


def test_without_filters_every_solid_cell_is_shown(bracket: Model) -> None:
    assert shown(bracket, Filters()).all()


@pytest.mark.parametrize(
    "wanted",
    [
        Filters(low=-1.0, high=0.0),
        Filters(low=0.2, high=0.5, types=frozenset({"tetra", "wedge"})),
        Filters(statuses=frozenset({"inverted"})),
        Filters(regions=frozenset({"region 1", "region 3"}), high=0.6),
        Filters(types=frozenset()),
        Filters(peel=2, planes=(Plane(AXES["y"], 0.4),)),
        Filters(planes=(Plane(AXES["x"], 0.7), Plane((0.0, -1.0, 0.5), 0.6))),
    ],
)
def test_masks_are_those_of_a_plain_loop(bracket: Model, wanted: Filters) -> None:
    quality, mesh = bracket.quality, bracket.mesh
    ids, names = meshgauge.mesh.regions.regions(mesh)  # type: ignore[attr-defined]
    centres = np.array([mesh.points[mesh.nodes(c)].mean(axis=0) for c in range(mesh.n_cells)])
    sides = [(plane.at, centres @ np.array(plane.normal)) for plane in wanted.planes]
    result = shown(bracket, wanted)
    for cell in range(mesh.n_cells):
        value = quality.values[cell]
        expected = wanted.low <= value < wanted.high or (wanted.high == 1 and value == 1)
        expected &= wanted.types is None or meshgauge.CELL_TYPES[int(mesh.types[cell])].name in wanted.types
        expected &= wanted.statuses is None or meshgauge.Status(quality.status[cell]).name.lower() in wanted.statuses
        expected &= wanted.regions is None or names[ids[cell]] in wanted.regions
        expected &= bracket.layers[cell] >= wanted.peel
        cuts = [(along[cell], along.min() + at * np.ptp(along)) for at, along in sides]
        if any(abs(there - cut) < 1e-6 for there, cut in cuts):
            continue  # single precision decides
        expected &= all(there <= cut for there, cut in cuts)
        assert result[cell] == expected, cell


def test_ranges_side_by_side_share_no_cell_and_miss_none() -> None:
    values = np.array([-1.0, -1e-300, 0.0, 0.1999, 0.2, 1.0, np.nan])
    bands = [in_range(values, Filters(low=a, high=b, undefined=False)) for a, b in ((-1, 0), (0, 0.2), (0.2, 1))]
    assert np.sum(bands, axis=0).tolist() == [1, 1, 1, 1, 1, 1, 0]
    assert in_range(values, Filters(low=0.5)).tolist() == [False] * 5 + [True, True]


@pytest.mark.parametrize(
    "wrong",
    [{"low": 0.5, "high": 0.2}, {"low": -2.0}, {"high": float("nan")}, {"peel": -1}],
)
def test_filters_that_cannot_be(wrong: dict[str, float]) -> None:
    with pytest.raises(ViewError):
        Filters(**wrong)  # type: ignore[arg-type]
    with pytest.raises(ViewError, match="at most 3"):
        Filters(planes=(Plane(AXES["x"], 0.5),) * 4)
    with pytest.raises(ViewError):
        Plane((0.0, 0.0, 0.0), 0.5)


@pytest.mark.parametrize("n", [1, 2, 5, 6])
def test_layers_of_a_cube_are_the_distances_from_its_faces(n: int) -> None:
    i = np.arange(n)
    depth = np.minimum(i, n - 1 - i)
    expected = np.minimum(np.minimum(depth[:, None, None], depth[None, :, None]), depth[None, None, :]).ravel()
    assert np.array_equal(cubes(n).layers, expected)


def test_layers_grow_by_one_from_neighbour_to_neighbour(bracket: Model) -> None:
    faces = bracket.topology
    pairs = faces.cells[faces.pairs()]
    depth = bracket.layers
    assert np.abs(np.diff(depth[pairs], axis=1)).max() == 1
    for cell in np.flatnonzero(depth > 0):
        own = slice(int(faces.starts[cell]), int(faces.starts[cell + 1]))
        assert depth[faces.cells[faces.mates[own]]].min() == depth[cell] - 1


def test_cells_that_nothing_joins_to_the_boundary_are_in_the_deepest_layer() -> None:
    """Two cells face to face on all sides bound nothing: to peel one layer more than there is must not show them."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    closed = meshgauge.Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 2, 1, 3)])])
    assert layering.layers(topology(closed)).tolist() == [0, 0]
    box = cubes(3).mesh
    both = meshgauge.Mesh.from_arrays(
        np.concatenate([box.points, points]),
        [("hexahedron", box.connectivity.reshape(-1, 8)), ("tetra", box.n_points + closed.connectivity.reshape(-1, 4))],
    )
    found = layering.layers(topology(both))
    assert found[:27].tolist() == cubes(3).layers.tolist()
    assert found[27:].tolist() == [1, 1]


def test_what_is_not_solid_has_no_layer() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    mesh = meshgauge.Mesh.from_arrays(points, [("triangle", [(0, 1, 2)]), ("tetra", [(0, 1, 2, 3)])])
    assert layering.layers(topology(mesh)).tolist() == [layering.NONE, 0]
    assert shown(Model.of(mesh, "both"), Filters()).tolist() == [False, True]


def test_exposed_faces_are_those_of_one_shown_cell(bracket: Model) -> None:
    mask = np.random.default_rng(3).random(bracket.mesh.n_cells) < 0.3
    faces, seen = bracket.topology, {}
    for slot in range(len(faces.cells)):
        if mask[faces.cells[slot]]:
            seen.setdefault(frozenset(faces.face(slot)), []).append(slot)
    expected = sorted(slots[0] for slots in seen.values() if len(slots) == 1)
    slots = seen_faces(faces, mask)
    assert slots.tolist() == expected
    offsets, points = polygons(faces, slots)
    for f in range(0, len(slots), 37):
        assert tuple(points[offsets[f] : offsets[f + 1]]) == faces.face(int(slots[f]))


def test_faces_of_polyhedra_among_other_cells(shared: Path) -> None:
    path = Path(shared, "meshes/jdroniou+HArDCore3D-release/meshes/Voro-Tets-1/RF_fmt/voro.4.ele")
    model = Model.of(meshgauge.read(path), "voronoi")
    slots = seen_faces(model.topology, model.values > np.median(model.values))
    offsets, points = polygons(model.topology, slots)
    for f in range(0, len(slots), 11):
        assert tuple(points[offsets[f] : offsets[f + 1]]) == model.topology.face(int(slots[f]))


def test_a_cell_with_a_point_that_cannot_be_drawn_is_left_out() -> None:
    model = cubes(2)
    points = model.mesh.points.copy()
    points[13] = np.nan  # the middle of the cube, then a corner
    points[0] = np.inf
    broken = Model.of(model.mesh.replace(points=points), "broken")
    assert np.isnan(broken.values).all()
    faces = broken.surface(broken.is_solid)
    assert faces.n_faces == 24 - 3
    assert np.isfinite(broken.points[faces.points]).all()


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e150, 1e305])
def test_a_mesh_of_any_size_fills_the_scene(scale: float) -> None:
    corners = np.array(list(itertools.product((0, 1), repeat=3))) * scale + 3 * scale
    frame = Frame.of(corners)
    assert np.linalg.norm(frame.to_scene(corners), axis=1) == pytest.approx(1.0)


def test_nothing_to_show_is_an_error() -> None:
    surface = meshgauge.Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("line", [(0, 1)])])
    with pytest.raises(ViewError, match="nothing to show"):
        Model.of(surface, "lines")


def test_a_ray_hits_what_a_plain_loop_says_first() -> None:
    model = cubes(4, noise=0.1)
    faces = model.surface(model.is_solid)
    points, random = model.points[faces.points], np.random.default_rng(5)
    for _ in range(40):
        origin = random.normal(size=3)
        origin *= 4 / np.linalg.norm(origin)
        ray = random.normal(size=3) * 0.4 - origin
        result = hit(faces, points, origin, ray)
        best = None
        for f in range(faces.n_faces):
            corners = points[faces.connectivity[faces.offsets[f] : faces.offsets[f + 1]]].astype(float)
            for k in (1, 2):
                a, b, c = corners[0], corners[k], corners[k + 1]
                matrix = np.stack([b - a, c - a, -ray], axis=1)
                u, v, t = np.linalg.solve(matrix, origin - a)
                if u >= 0 and v >= 0 and u + v <= 1 and t > 0 and (best is None or t < best[1]):
                    best = f, t
        assert (result is None) == (best is None)
        if result is not None and best is not None:
            assert result[1] == pytest.approx(best[1], rel=1e-5)


def test_the_ray_of_the_middle_is_the_line_of_sight() -> None:
    camera = Camera()
    assert camera.ray(0.5, 0.5, 1.7) == pytest.approx(camera.forward)
    left, right = camera.ray(0.0, 0.5, 1.7), camera.ray(1.0, 0.5, 1.7)
    assert np.cross(left, right) @ camera.up < 0
    assert camera.ray(0.5, 1.0, 1.0) @ camera.forward == pytest.approx(np.cos(np.radians(15)))


def test_a_camera_flown_to_a_cell_looks_at_it(bracket: Model) -> None:
    centre, size = bracket.place_of(521)
    camera = Camera().looking_at(centre, size)
    assert camera.forward == pytest.approx(Camera().forward)
    assert camera.focus == pytest.approx(centre)


def test_the_card_of_a_cell(bracket: Model) -> None:
    result = card(bracket, 1743)
    worst = bracket.quality.worst(3)[2]
    assert (worst.cell, result.type, result.status, result.region) == (1743, "pyramid", "inverted", "region 2")
    assert (result.quality, len(result.nodes)) == (worst.quality, 5)
    assert result.worst is not None
    assert (result.worst.node, result.worst.point, result.worst.quality) == (4, 2260, worst.node_quality)
    assert result.worst.coordinates == worst.coordinates
    with pytest.raises(ViewError, match="no cell 6192"):
        card(bracket, 6192)


def test_numbers_on_the_page() -> None:
    values = (0.5, -0.054, 0.0, -3e-7, float("nan"))
    assert [number(value) for value in values] == ["0.500", "−0.054", "0.000", "−3e−07", "–"]


@given(st.lists(st.floats(-1, 1) | st.sampled_from([*EDGES.tolist(), float("nan")])))
def test_bins_count_every_value_once(values: list[float]) -> None:
    array = np.array(values, float)
    counts = histogram(array)
    assert np.array_equal(counts, np.histogram(array[~np.isnan(array)], EDGES)[0])


def test_colours_tell_the_bands_apart() -> None:
    values = np.array([-0.5, 0.0, 1e-9, 0.1999, 0.2, 1.0, np.nan])
    assert css(values) == [INVALID, INVALID, POOR, POOR, RAMP[0], RAMP[-1], UNKNOWN]


def test_values_of_one_cell_are_those_of_the_whole_mesh(bracket: Model) -> None:
    for cell in range(0, bracket.mesh.n_cells, 97):
        start, stop = (int(at) for at in bracket.mesh.offsets[cell : cell + 2])
        result = [row.quality for row in card(bracket, cell).nodes]
        assert np.array_equal(result, bracket.quality.node_jens[start:stop])


def test_values_of_the_nodes_of_a_polyhedron(shared: Path) -> None:
    path = shared / "meshes/GEOS-DEV+GEOS/inputFiles/singlePhaseFlow/pebi3d_with_properties.vtu"
    model = Model.of(meshgauge.read(path), "pebi")
    for cell in range(0, model.mesh.n_cells, 211):
        start, stop = (int(at) for at in model.mesh.offsets[cell : cell + 2])
        result = [row.quality for row in card(model, cell).nodes]
        assert np.array_equal(result, model.quality.node_jens[start:stop], equal_nan=True)
