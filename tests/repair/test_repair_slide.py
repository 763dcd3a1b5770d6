"""Sliding: what the surface is, what of it is kept, and how far the mesh leaves it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import cells, curved, pipe, shaken, slid
from thinned import quick

import meshgauge
from meshgauge import Mesh, measure
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.deviation import deviation
from meshgauge.repair.features import kept_edges
from meshgauge.repair.phases import slide
from meshgauge.repair.problem import problem
from meshgauge.repair.surface import CORNER, EDGE, FACE, Faces, _triangles, surface_of


def worst(result: meshgauge.Improvement) -> float:
    return float(np.nanmin(result.after.values))


def halves(n: int) -> Mesh:
    """A cube of n³ hexahedra of two materials, the points between them moved at random within their plane."""
    mesh = slid(shaken("hexahedron", n, 0.2), n, 0.3)
    points = np.array(mesh.points)
    middle = np.asarray(shaken("hexahedron", n, 0.0).points)[:, 0] == n / 2
    points[middle, 0] = n / 2
    material = np.where(np.arange(mesh.n_cells) < mesh.n_cells // 2, 7, 3)
    return mesh.replace(points=points, cell_data={"material": material})


def shuffled(mesh: Mesh, seed: int) -> Mesh:
    order = np.random.default_rng(seed).permutation(mesh.n_cells)
    nodes = mesh.connectivity.reshape(mesh.n_cells, -1)[order]
    return Mesh.from_arrays(
        mesh.points, {"hexahedron": nodes}, cell_data={k: v[order] for k, v in mesh.cell_data.items()}
    )


def test_sliding_does_not_depend_on_the_order_of_cells() -> None:
    mesh = halves(4)
    results = [
        meshgauge.improve(one, boundary="slide", everywhere=True)
        for one in (mesh, shuffled(mesh, 1), shuffled(mesh, 2))
    ]
    fixed = meshgauge.improve(mesh, everywhere=True)
    assert worst(results[0]) > worst(fixed) + 0.1
    for other in results[1:]:
        assert worst(other) == pytest.approx(worst(results[0]), abs=1e-3)
        assert other.after.values.mean() == pytest.approx(results[0].after.values.mean(), abs=1e-3)
        for name, volumes in results[0].report.region_volumes.items():
            assert other.report.region_volumes[name] == pytest.approx(volumes)
    between = np.asarray(shaken("hexahedron", 4, 0.0).points)[:, 0] == 2.0
    assert (results[0].mesh.points[between] != mesh.points[between]).any()
    np.testing.assert_allclose(results[0].mesh.points[between, 0], 2.0, atol=1e-12)


def renumbered(mesh: Mesh, seed: int) -> tuple[Mesh, NDArray[np.int64]]:
    """The mesh with its points and the cells of each type in another order; for each of its points the one it was."""
    rng = np.random.default_rng(seed)
    old = rng.permutation(mesh.n_points)
    new = np.argsort(old)
    blocks, order = [], []
    for row, _, cells_ in mesh.groups():
        assert row is not None
        ids = rng.permutation(np.arange(mesh.n_cells)[cells_])
        blocks.append((row.name, new[np.array([mesh.nodes(int(cell)) for cell in ids])]))
        order.append(ids)
    data = {name: values[np.concatenate(order)] for name, values in mesh.cell_data.items()}
    return Mesh.from_arrays(np.asarray(mesh.points)[old], blocks, cell_data=data), old


@pytest.mark.parametrize("seed", quick((1, 2), 1))
@pytest.mark.parametrize("name", quick(["pipe", "patched", "tetra", "mixed", "near"], "pipe", "tetra", "near"))
def test_the_result_is_the_same_for_any_numbering(name: str, seed: int) -> None:
    """To the last bit: cells, faces and edges are worked on in the order of their places."""
    mesh = {
        "pipe": lambda: pipe(4).replace(cell_data={"material": np.where(np.arange(64) < 32, 1, 2)}),
        "patched": lambda: patched(4),
        "tetra": lambda: slid(shaken("tetra", 3, 0.35), 3, 0.3),
        "mixed": lambda: slid(shaken("mixed", 4, 0.3), 4, 0.3),
        "near": lambda: shaken("hexahedron", 4, 0.55),
    }[name]()
    options = {} if name == "near" else {"everywhere": True, "boundary": "slide"}
    first = meshgauge.improve(mesh, **options)  # type: ignore[arg-type]
    assert first.report.displacement.n_points > 0
    other, old = renumbered(mesh, seed)
    result = meshgauge.improve(other, **options)  # type: ignore[arg-type]
    np.testing.assert_allclose(result.mesh.points, np.asarray(first.mesh.points)[old], rtol=0, atol=1e-9)
    assert worst(result) == pytest.approx(worst(first), abs=1e-9)


def test_patches_are_the_same_in_any_order() -> None:
    mesh = halves(4)
    for seed in range(3):
        one = shuffled(mesh, seed)
        surface = surface_of(constraints_of(one, measure(one), None), np.asarray(one.points), 40.0)
        assert (surface.n_patches, surface.n_curves) == (11, 20)


def test_quadratic_cells_slide_as_linear_ones_do() -> None:
    linear = slid(shaken("hexahedron", 4, 0.1), 4, 0.3)
    quadratic = straight(linear)
    one, two = (meshgauge.improve(mesh, boundary="slide", everywhere=True) for mesh in (linear, quadratic))
    assert worst(one) > 0.95 > worst(meshgauge.improve(quadratic, everywhere=True)) + 0.1
    assert worst(two) == pytest.approx(worst(one), abs=1e-3)
    assert two.report.displacement.deviation < 1e-12


def straight(mesh: Mesh) -> Mesh:
    """The same of second order, with every node between corners in the middle of its edge."""
    quadratic = curved("hexahedron", 4, 0.0, 0.0)
    points = np.array(quadratic.points)
    points[: mesh.n_points] = mesh.points
    for a, b, m in edges_of(quadratic):
        points[m] = 0.5 * (points[a] + points[b])
    return quadratic.replace(points=points)


def edges_of(mesh: Mesh) -> NDArray[np.int64]:
    row = next(mesh.groups())[0]
    assert row is not None
    nodes = mesh.connectivity.reshape(mesh.n_cells, -1)
    return np.unique(np.concatenate([nodes[:, list(edge)] for edge in row.edges if len(edge) == 3]), axis=0)


def test_nodes_between_corners_follow_on_a_curved_surface() -> None:
    flat = straight(slid(shaken("hexahedron", 4, 0.1), 4, 0.3))
    points = np.array(flat.points)
    radius, angle = 1.0 + points[:, 0] / 4, 0.5 * np.pi * points[:, 1] / 4
    bent = flat.replace(points=np.stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2] / 4], axis=1))
    result = meshgauge.improve(bent, boundary="slide", everywhere=True)
    assert result.report.displacement.n_boundary > 0
    outer = points[:, 0] == 4.0
    now = np.linalg.norm(np.asarray(result.mesh.points)[outer, :2], axis=1)
    assert (result.mesh.points[outer] != bent.points[outer]).any(axis=1).sum() > 20
    assert np.abs(now - 2.0).max() < 0.02  # the middle of a chord would be off by .04


def hanging(n: int) -> tuple[Mesh, NDArray[np.int64]]:
    """Cubes of edge 2 beside cubes of edge 1, and for each point that hangs between them the corners it hangs on."""
    coarse, fine = shaken("hexahedron", n, 0.0), shaken("hexahedron", 2 * n, 0.0)
    left = 2.0 * np.asarray(coarse.points) - (2.0 * n, 0.0, 0.0)
    points = np.concatenate([left, np.asarray(fine.points)])
    keep, merged = np.unique(points, axis=0, return_inverse=True)
    nodes = np.concatenate([coarse.connectivity, fine.connectivity + len(left)])
    mesh = Mesh.from_arrays(keep, {"hexahedron": merged.reshape(-1)[nodes].reshape(-1, 8)})
    place = {tuple(x): p for p, x in enumerate(keep)}
    loose = [p for p, x in enumerate(keep) if x[0] == 0.0 and (x % 2).any()]
    steps = [np.array((0.0, y, z)) for y in (-1, 1) for z in (-1, 1)]
    corners = [[place[tuple(keep[p] + step * (keep[p] % 2))] for step in steps] for p in loose]
    rng = np.random.default_rng(3)
    inside = ((keep > keep.min(axis=0)) & (keep < keep.max(axis=0))).all(axis=1) & (keep[:, 0] != 0.0)
    on_top = (keep[:, 2] == 2.0 * n) & ((keep[:, :2] > (-2.0 * n, 0)) & (keep[:, :2] < 2.0 * n)).all(axis=1)
    on_top &= np.abs(keep[:, 0]) > 1.0
    keep = keep + np.where(inside[:, None], rng.uniform(-0.3, 0.3, keep.shape), 0.0)
    keep[on_top, :2] += rng.uniform(-0.3, 0.3, (int(on_top.sum()), 2))
    return mesh.replace(points=keep), np.column_stack([loose, corners])


def test_hanging_points_stay_on_the_edge_or_face_that_they_hang_on() -> None:
    mesh, loose = hanging(2)
    result = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    assert result.report.displacement.n_boundary > 0
    points = np.asarray(result.mesh.points)
    np.testing.assert_allclose(points[loose[:, 0]], points[loose[:, 1:]].mean(axis=1), atol=1e-12)


def thirds() -> tuple[Mesh, list[tuple[int, int, int, float]]]:
    """A layer of cubes of edge 3 beside one of cubes of edge 1; the points that hang on edges of its upper side, the
    ends of these edges, and how far along they are."""
    coarse, fine = shaken("hexahedron", 2, 0.0), shaken("hexahedron", 6, 0.0)
    points = np.concatenate([3.0 * np.asarray(coarse.points) - (6.0, 0.0, 0.0), np.asarray(fine.points)])
    keep, merged = np.unique(points, axis=0, return_inverse=True)
    nodes = np.concatenate([coarse.connectivity, fine.connectivity + coarse.n_points])
    mesh = Mesh.from_arrays(keep, {"hexahedron": merged.reshape(-1)[nodes].reshape(-1, 8)})
    place = {tuple(x): p for p, x in enumerate(keep)}
    hangs = [
        (place[0.0, y, 6.0], place[0.0, y - y % 3, 6.0], place[0.0, y - y % 3 + 3, 6.0], (y % 3) / 3.0)
        for y in (1.0, 2.0, 4.0, 5.0)
    ]
    rng = np.random.default_rng(5)
    inside = ((keep > keep.min(axis=0)) & (keep < keep.max(axis=0))).all(axis=1) & (keep[:, 0] != 0.0)
    on_top = (keep[:, 2] == 6.0) & ((keep[:, :2] > (-6.0, 0)) & (keep[:, :2] < 6.0)).all(axis=1) & (keep[:, 0] != 0.0)
    keep = keep + np.where(inside[:, None], rng.uniform(-0.3, 0.3, keep.shape), 0.0)
    keep[on_top, :2] += rng.uniform(-0.35, 0.35, (int(on_top.sum()), 2))
    at = keep[:, 0] == 0.0  # the middle of the edge goes along it, and what hangs between goes with it
    keep[at & (keep[:, 1] == 3.0), 1] += 0.3
    for y, to in ((1.0, 1.1), (2.0, 2.2), (4.0, 4.2), (5.0, 5.1)):
        keep[at & (keep[:, 1] == y), 1] = to
    return mesh.replace(points=keep), hangs


def test_points_hang_anywhere_on_an_edge() -> None:
    mesh, hangs = thirds()
    assert (measure(mesh).status == 0).all()
    result = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    assert result.report.displacement.n_boundary > 0
    points = np.asarray(result.mesh.points)
    for p, a, b, share in hangs:
        np.testing.assert_allclose(points[p], (1.0 - share) * points[a] + share * points[b], atol=1e-9)


def patched(n: int) -> Mesh:
    """A cube with its sides as surface cells; a rectangle on the upper one is a patch of its own."""
    mesh = slid(shaken("hexahedron", n, 0.2), n, 0.25)
    faces = surface_of(constraints_of(mesh, measure(mesh), None), np.asarray(mesh.points), 40.0).faces.reshape(-1, 4)
    middle = np.asarray(shaken("hexahedron", n, 0.0).points)[faces].mean(axis=1)
    inlet = (middle[:, 2] == n) & (np.abs(middle[:, :2] - n / 2) < n / 2 - 1).all(axis=1)
    region = np.concatenate([np.zeros(mesh.n_cells, int), np.where(inlet, 2, 1)])
    return Mesh.from_arrays(
        mesh.points,
        [("hexahedron", mesh.connectivity.reshape(-1, 8)), ("quad", faces)],
        cell_data={"region": region},
    )


def area(mesh: Mesh, cells_: NDArray[np.int64]) -> float:
    x = np.asarray(mesh.points)[np.array([mesh.nodes(int(cell)) for cell in cells_])]
    return float(np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1).sum() / 2.0)


def test_patches_of_surface_cells_keep_their_rims() -> None:
    mesh = patched(5)
    result = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    assert result.report.displacement.n_boundary > 0
    inlet = np.flatnonzero(mesh.cell_data["region"] == 2)
    assert len(inlet) == 9
    assert area(result.mesh, inlet) == pytest.approx(area(mesh, inlet), rel=1e-3)
    plain = Mesh.from_arrays(mesh.points, {"hexahedron": mesh.connectivity[: 8 * 125].reshape(-1, 8)})
    moved = meshgauge.improve(plain, boundary="slide", everywhere=True)
    without = mesh.replace(points=moved.mesh.points)
    assert abs(area(without, inlet) / area(mesh, inlet) - 1.0) > 5e-3


def test_line_and_vertex_cells_on_the_surface_are_kept() -> None:
    mesh = slid(shaken("hexahedron", 4, 0.1), 4, 0.2)
    at = np.asarray(shaken("hexahedron", 4, 0.0).points)
    line = np.flatnonzero((at[:, 2] == 4.0) & (at[:, 1] == 2.0))
    line = line[np.argsort(at[line, 0])]
    point = int(np.flatnonzero((at == (2.0, 3.0, 4.0)).all(axis=1))[0])
    both = Mesh.from_arrays(
        mesh.points,
        [
            ("hexahedron", mesh.connectivity.reshape(-1, 8)),
            ("line", np.stack([line[:-1], line[1:]], axis=1)),
            ("vertex", [[point]]),
        ],
    )
    surface = surface_of(constraints_of(both, measure(both), None), np.asarray(both.points), 40.0)
    assert set(surface.kind[line[1:-1]]) <= {CORNER, EDGE}
    assert surface.kind[point] == CORNER
    result = meshgauge.improve(both, boundary="slide", everywhere=True)
    np.testing.assert_array_equal(result.mesh.points[point], mesh.points[point])
    assert result.report.displacement.n_boundary > 0
    bare = surface_of(constraints_of(mesh, measure(mesh), None), np.asarray(mesh.points), 40.0)
    assert (bare.kind[line[1:-1]] == FACE).all()


def test_regions_keep_their_volumes_though_the_surface_between_is_curved() -> None:
    mesh = pipe(4).replace(cell_data={"material": np.where(np.arange(64) < 32, 1, 2)})
    result = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    volumes = result.report.region_volumes
    assert len(volumes) == 2
    for was, now in volumes.values():
        assert now == pytest.approx(was, rel=1e-3)
    between = np.asarray(shaken("hexahedron", 4, 0.0).points)[:, 0] == 2.0
    assert (result.mesh.points[between] != mesh.points[between]).any(axis=1).sum() > 5
    assert sum(was for was, _ in volumes.values()) == pytest.approx(result.report.volume[0])


def distance(points: NDArray[np.float64], triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each point from the nearest of some triangles, from many places of each."""
    n = 40
    w = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    places = np.einsum("pw,twx->tpx", w, triangles).reshape(-1, 3)
    return np.array([np.sqrt(((places - x) ** 2).sum(axis=1).min()) for x in points])


def test_the_deviation_is_the_largest_distance_from_either_side() -> None:
    points, blocks = cells("tetra", 2)
    corner = np.flatnonzero((points == 2.0).all(axis=1))
    mesh = Mesh.from_arrays(points, dict(blocks))
    surface = surface_of(constraints_of(mesh, measure(mesh), None), points, 40.0)
    out = points.copy()
    out[corner] -= (0.3, 0.2, 0.1)
    found = deviation(surface, out, is_given=False)
    triangles = surface.faces.reshape(-1, 3)
    near = triangles[(triangles == corner).any(axis=1)]
    old, new = points[near], out[near]
    samples = np.concatenate([old.mean(axis=1), old.reshape(-1, 3), 0.5 * (old[:, 0] + old[:, 1])])
    from_old = distance(samples, np.concatenate([new, out[triangles]]))
    assert found.largest >= from_old.max() - 0.02
    assert found.largest == pytest.approx(np.linalg.norm((0.3, 0.2, 0.1)), rel=0.1)
    same = deviation(surface, points, is_given=False)
    assert same.largest < 1e-12
    assert (same.of_faces < 1e-12).all()


def test_the_deviation_is_found_where_it_is_largest() -> None:
    """A square bent by a quarter of its side: the largest distance is not in the middle of an edge or a face."""
    mesh = shaken("hexahedron", 1, 0.0)
    points = np.asarray(mesh.points)
    surface = surface_of(constraints_of(mesh, measure(mesh), None), points, 40.0)
    out = points.copy()
    out[int(np.flatnonzero((points == 1.0).all(axis=1))[0])] += (0.0, 0.0, -0.5)
    assert deviation(surface, out, is_given=False).largest == pytest.approx(0.5, rel=1e-3)


def folded() -> Mesh:
    """A cube of 5³ with two edges of its top pushed over each other: the face between them is turned over."""
    mesh = shaken("hexahedron", 5, 0.0)
    points = np.array(mesh.points)
    x, y, top = points[:, 0], points[:, 1], points[:, 2] == 5.0
    pushed = top & ((y == 2.0) | (y == 3.0))
    way = np.where(pushed & (x == 2.0), 1.3, np.where(pushed & (x == 3.0), -1.3, 0.0))
    points[:, 0] += way
    points[:, 2] += 0.02 * np.abs(way)
    return mesh.replace(points=points)


def test_edges_of_faces_that_are_folded_are_no_features() -> None:
    mesh = folded()
    surface = surface_of(constraints_of(mesh, measure(mesh), None), np.asarray(mesh.points), 40.0)
    assert (surface.n_patches, surface.n_curves) == (6, 12)
    assert np.count_nonzero(surface.kind == CORNER) == 8
    assert np.count_nonzero(surface.kind == FACE) == 6 * 16


def test_faces_of_few_cells_at_a_sharp_edge_are_not_folded() -> None:
    mesh = shaken("hexahedron", 4, 0.0)
    points = np.array(mesh.points)
    points[:, 2] *= 0.25 * (1.02 - points[:, 0] / 4)  # a wedge of less than 15 degrees
    surface = surface_of(constraints_of(mesh, measure(mesh), None), points, 40.0)
    assert (surface.n_patches, surface.n_curves) == (6, 12)


def test_the_deviation_from_a_folded_surface_is_no_larger_than_it_is() -> None:
    """A search from item to item would end in the fold."""
    mesh, flat = folded(), shaken("hexahedron", 5, 0.0)
    surface = surface_of(constraints_of(mesh, measure(mesh), None), np.asarray(mesh.points), 40.0)
    found = deviation(surface, np.asarray(flat.points), is_given=False)
    assert found.largest == pytest.approx(0.026, rel=0.05)
    assert 0.0 < found.mean < 0.026


def test_what_was_mended_by_points_before_does_not_take_sliding_back() -> None:
    mesh = shaken("hexahedron", 12, 0.0)
    points = np.array(mesh.points)
    inside, on_side = ((points == place).all(axis=1) for place in ((2, 2, 2), (12, 10, 10)))
    points[inside] += 0.75
    points[on_side, 1:] += 0.6
    result = meshgauge.improve(mesh.replace(points=points), boundary="slide")
    assert result.report.after.all.min > 0.9
    assert all(claim.holds for claim in result.report.claims)
    assert not any("taken back" in note for note in result.report.notes)


def test_a_surface_of_corners_only_does_not_slide() -> None:
    result = meshgauge.improve(shaken("hexahedron", 1, 0.1), boundary="slide", everywhere=True)
    assert any("No point of the boundary can slide." in note for note in result.report.notes)


def test_only_line_cells_are_edges_to_be_kept() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], float)
    mesh = Mesh.from_arrays(
        points,
        [("triangle", [[0, 1, 3]]), ("line", [[0, 1]]), ("line3", [[0, 2, 1]]), ("quad", [[0, 1, 2, 3]])],
    )
    assert {tuple(edge) for edge in np.sort(kept_edges(mesh), axis=1).tolist()} == {(0, 1), (0, 2), (1, 2)}


def test_a_face_may_have_the_first_point_in_its_middle() -> None:
    """Its triangles meet in that point, not in one that is made for faces without."""
    ring = np.arange(1, 5)
    faces = Faces(
        ids=ring,
        offsets=np.array([0, 4]),
        owner=np.zeros(4, np.int64),
        following=np.array([1, 2, 3, 0]),
        centre_ids=np.array([0]),
        centres=np.zeros((1, 3)),
        normals=np.array([[0.0, 0.0, 1.0]]),
        areas=np.ones(1),
    )
    triangles, of_face = _triangles(5, faces)
    assert triangles.tolist() == [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 1, 0]]
    assert of_face.tolist() == [0, 0, 0, 0]


def test_sliding_starts_where_the_worst_was_raised_unless_that_was_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shaken("hexahedron", 2, 0.1)
    before, fixed, starts = measure(mesh), measure(mesh.replace(points=mesh.points + 1.0)), []

    class Started(Exception):
        pass

    def start(sliding: slide._Sliding, *_: object, **__: object) -> None:
        starts.append(sliding.here[0].tolist())
        raise Started

    monkeypatch.setattr(slide._Sliding, "raised", start)
    constraints = SimpleNamespace(pinned=np.zeros(mesh.n_points, bool))
    surface = SimpleNamespace(kind=np.full(mesh.n_points, FACE, np.uint8), n_patches=1, n_curves=0, feature_angle=40.0)
    whole, first = problem(mesh, np.ones(mesh.n_cells, bool)), np.zeros(1, np.int64)
    assert whole.point_ids[0] == 0
    for reached, raised in ((before, 9.0), (fixed, 9.0), (fixed, None)):
        run = SimpleNamespace(
            raised=None if raised is None else np.full((1, 3), raised), points_of_moving=first, whole=whole, form=None
        )
        promise = SimpleNamespace(before=before, constraints=constraints)
        with pytest.raises(Started):
            slide.slide(promise, reached, run, surface, np.zeros(mesh.n_points, bool), 1.0, target=None, threads=1)  # type: ignore[arg-type]
    assert starts == [[0.0] * 3, [9.0] * 3, [1.0] * 3]
