"""Laws of joining tetrahedra anew: what must stay stays, nothing overlaps, and what is raised is higher."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import shaken

import meshgauge
from meshgauge import Mesh
from meshgauge.kernels.repair import cavities, flips, reconnection, tetrahedra
from meshgauge.kernels.repair.tetrahedra import FIXED, N_CELLS, N_POINTS, NO_FLOOR, NOW, Tetrahedra
from meshgauge.mesh import CellBlock
from meshgauge.mesh.topology import topology
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.reconnection import OBJECTIVES, Reconnection, reconnect

Faces = Counter[frozenset[int]]
TETRA, TRIANGLE = 10, 5


def delaunay(n: int = 4, seed: int = 0) -> Mesh:
    """Slivers among others: a grid on the sides of a cube, points at random inside."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    sides = grid[((grid == 0) | (grid == n)).any(axis=1)]
    points = np.concatenate([sides, rng.uniform(0.2, n - 0.2, ((n - 1) ** 3, 3))])
    cells = Delaunay(points).simplices
    x = points[cells]
    volumes = np.einsum("ij,ij->i", x[:, 1] - x[:, 0], np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 0]))
    cells[volumes < 0] = cells[volumes < 0][:, [1, 0, 2, 3]]
    return Mesh.from_arrays(points, {"tetra": cells[abs(volumes) > 1e-9]})


def rejoin(mesh: Mesh, fixed: NDArray[np.integer] | None = None, **options: object) -> Reconnection:
    constraints = constraints_of(mesh, meshgauge.measure(mesh), fixed)
    result = reconnect(mesh, constraints, **options)  # type: ignore[arg-type]
    assert result is not None
    return result


def faces_of(mesh: Mesh, of_type: int = TETRA) -> Faces:
    cells = np.flatnonzero(mesh.types == of_type)
    nodes = [mesh.nodes(int(cell)).tolist() for cell in cells]
    return Counter(frozenset(c[:i] + c[i + 1 :]) for c in nodes for i in range(4))


def volume(mesh: Mesh) -> float:
    x = np.asarray(mesh.points, np.float64)[mesh.connectivity.reshape(-1, 4)]
    return float(np.linalg.det(x[:, 1:] - x[:, :1]).sum() / 6.0)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(3))
def test_worst_and_mean_rise_and_what_bounds_the_mesh_stays(seed: int, objective: str) -> None:
    mesh = delaunay(seed=seed)
    result = rejoin(mesh, objective=objective)
    before, after = meshgauge.measure(mesh).values, meshgauge.measure(result.mesh).values
    if objective == "jens":
        assert after.min() > before.min() + 0.1
        assert after.mean() > before.mean() + 0.05
    else:
        assert dihedral(result.mesh) > dihedral(mesh) + 5.0
    assert volume(result.mesh) == pytest.approx(volume(mesh), rel=1e-13)
    counts = faces_of(result.mesh)
    assert max(counts.values()) == 2  # no face of three cells
    old = result.old_points
    boundary = {frozenset(old[list(face)].tolist()) for face, n in counts.items() if n == 1}
    assert boundary == {face for face, n in faces_of(mesh).items() if n == 1}
    assert len({frozenset(c) for c in result.mesh.connectivity.reshape(-1, 4).tolist()}) == result.mesh.n_cells
    on_sides = ((mesh.points == 0.0) | (mesh.points == 4.0)).any(axis=1)[old] & (old >= 0)
    assert np.array_equal(result.mesh.points[on_sides], mesh.points[old[on_sides]])


def dihedral(mesh: Mesh) -> float:
    """Least distance of a dihedral angle of tetrahedra from 0 and from 180 degrees."""
    cells = np.flatnonzero(mesh.types == TETRA)
    x = np.asarray(mesh.points)[mesh.connectivity[mesh.offsets[cells][:, None] + np.arange(4)]]
    normals = [
        np.cross(x[:, j] - x[:, i], x[:, k] - x[:, i]) for i, j, k in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))
    ]
    normals = [n / np.linalg.norm(n, axis=1)[:, None] for n in normals]
    cosines = [-(normals[i] * normals[j]).sum(axis=1) for i in range(4) for j in range(i)]
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    return float(min(angles.min(), 180.0 - angles.max()))


def test_angles_rise_only_as_far_as_the_worst_quality_lets_them() -> None:
    """A mesh that was joined for its quality gives little of it for angles: it would lose a third."""
    mesh = rejoin(delaunay()).mesh
    worst = meshgauge.measure(mesh).values.min()
    lost, kept = (rejoin(mesh, objective="dihedral", floor=floor).mesh for floor in (0.0, worst))
    assert meshgauge.measure(lost).values.min() < worst - 0.1
    assert meshgauge.measure(kept).values.min() >= worst - 1e-12
    assert dihedral(lost) > dihedral(kept) > dihedral(mesh)


def test_a_tangled_mesh_keeps_its_signed_volume() -> None:
    mesh = shaken("tetra", 4, 0.6)
    assert meshgauge.measure(mesh).values.min() < 0
    result = rejoin(mesh)
    assert volume(result.mesh) == pytest.approx(volume(mesh), rel=1e-12)
    assert max(faces_of(result.mesh).values()) == 2
    assert meshgauge.measure(result.mesh).values.min() > meshgauge.measure(mesh).values.min()


def test_old_cells_are_the_cells_they_were_and_data_follow() -> None:
    mesh = delaunay()
    numbers = np.arange(mesh.n_cells)
    mesh = mesh.replace(
        cell_data={"number": numbers, "label": numbers + 500},
        point_data={"x": mesh.points[:, 0], "label": np.arange(mesh.n_points) + 7, "kind": np.arange(mesh.n_points)},
    )
    result = rejoin(mesh)
    same = np.flatnonzero(result.old_cells >= 0)
    assert 0 < len(same) < result.mesh.n_cells
    for cell in same:
        assert np.array_equal(result.old_points[result.mesh.nodes(int(cell))], mesh.nodes(int(result.old_cells[cell])))
    assert np.array_equal(result.mesh.cell_data["number"][same], result.old_cells[same])
    labels = result.mesh.cell_data["label"]
    assert np.array_equal(labels[same], result.old_cells[same] + 500)
    assert len(np.unique(labels)) == len(labels)
    new = result.old_points < 0
    assert new.any()
    assert np.allclose(result.mesh.point_data["x"][new], result.mesh.points[new, 0], atol=0.3)
    assert len(np.unique(result.mesh.point_data["label"])) == result.mesh.n_points
    assert set(result.mesh.point_data["kind"].tolist()) <= set(range(mesh.n_points))


def test_the_first_cell_is_an_old_one_only_if_it_is_still_there() -> None:
    mesh = delaunay()
    cells = mesh.connectivity.reshape(-1, 4)
    order = np.argsort(meshgauge.measure(mesh).values, kind="stable")  # the worst becomes cell 0, and goes
    mesh = Mesh.from_arrays(mesh.points, {"tetra": cells[order]})
    result = rejoin(mesh)
    new = {frozenset(result.old_points[nodes].tolist()) for nodes in result.mesh.connectivity.reshape(-1, 4)}
    assert frozenset(mesh.nodes(0).tolist()) not in new
    assert 0 not in result.old_cells


def test_linear_point_data_stay_linear_at_new_points() -> None:
    mesh = delaunay()
    fixed = np.arange(mesh.n_points)
    mesh = mesh.replace(point_data={"f": mesh.points @ np.array([1.0, -2.0, 3.0])})
    result = rejoin(mesh, fixed)
    assert (result.old_points < 0).any()
    assert np.allclose(result.mesh.point_data["f"], result.mesh.points @ np.array([1.0, -2.0, 3.0]), atol=1e-9)
    kept = result.old_points >= 0
    assert kept.sum() == mesh.n_points  # what the user fixes neither moves nor goes
    assert np.array_equal(result.mesh.points[kept], mesh.points[result.old_points[kept]])


def test_faces_between_regions_stay() -> None:
    mesh = delaunay()
    x = mesh.points[mesh.connectivity.reshape(-1, 4)].mean(axis=1)[:, 0]
    order = np.argsort(x > 2.0, kind="stable")
    cells = mesh.connectivity.reshape(-1, 4)[order]
    n = int((x <= 2.0).sum())
    mesh = Mesh.from_arrays(mesh.points, {"tetra": cells})
    mesh = mesh.replace(blocks=(CellBlock("left", 0, n), CellBlock("right", n, len(cells))))
    result = rejoin(mesh)
    assert [block.name for block in result.mesh.blocks] == ["left", "right"]

    def between(of: Mesh, names: NDArray[np.int64]) -> set[frozenset[int]]:
        stop = of.blocks[0].stop
        nodes = names[of.connectivity.reshape(-1, 4)].tolist()
        parts = [
            {frozenset(c[:i] + c[i + 1 :]) for c in part for i in range(4)} for part in (nodes[:stop], nodes[stop:])
        ]
        return parts[0] & parts[1]

    old = result.old_points
    kept = between(result.mesh, np.where(old < 0, mesh.n_points + np.arange(len(old)), old))
    assert kept == between(mesh, np.arange(mesh.n_points))
    assert len(kept) > 10


def test_a_surface_inside_stays() -> None:
    mesh = delaunay()
    on_sides = ((mesh.points == 0.0) | (mesh.points == 4.0)).any(axis=1)
    inner = [sorted(face) for face, n in sorted(faces_of(mesh).items(), key=lambda item: sorted(item[0])) if n == 2]
    inner = [face for face in inner if on_sides[face].sum() < 3][::5]
    outer = [sorted(face) for face, n in faces_of(mesh).items() if n == 1]
    with_surface = Mesh.from_arrays(mesh.points, {"tetra": mesh.connectivity.reshape(-1, 4), "triangle": inner + outer})
    result = rejoin(with_surface)
    new = {frozenset(result.old_points[list(face)].tolist()) for face in faces_of(result.mesh)}
    assert {frozenset(face) for face in inner} <= new
    assert np.count_nonzero(result.mesh.types == TRIANGLE) == len(inner) + len(outer)
    without = rejoin(mesh)
    assert not {frozenset(face) for face in inner} <= {
        frozenset(without.old_points[list(face)].tolist()) for face in faces_of(without.mesh)
    }


def test_other_cells_and_cells_outside_of_the_mask_stay() -> None:
    mesh = delaunay()
    x = mesh.points[mesh.connectivity.reshape(-1, 4)].mean(axis=1)[:, 0]
    result = rejoin(mesh, cells=x < 2.0)
    outside = np.flatnonzero(x >= 2.0)
    assert set(outside.tolist()) <= set(result.old_cells.tolist())
    points = np.unique(mesh.connectivity.reshape(-1, 4)[outside])
    where = np.flatnonzero(np.isin(result.old_points, points))
    assert np.array_equal(result.mesh.points[where], mesh.points[result.old_points[where]])
    assert topology(result.mesh).n_multiple == 0


def test_the_same_every_time() -> None:
    mesh = delaunay()
    first, second = rejoin(mesh), rejoin(mesh)
    assert np.array_equal(first.mesh.points, second.mesh.points)
    assert np.array_equal(first.mesh.connectivity, second.mesh.connectivity)
    assert first.done == second.done
    assert all(first.done[name] for name in ("edges removed", "faces removed", "points moved", "points inserted"))


def test_nothing_to_do_is_none() -> None:
    mesh = Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], {"tetra": [(0, 1, 2, 3)]})
    assert reconnect(mesh, constraints_of(mesh, meshgauge.measure(mesh), None)) is None
    hexahedra = shaken("hexahedron", 3, 0.2)
    assert reconnect(hexahedra, constraints_of(hexahedra, meshgauge.measure(hexahedra), None)) is None


def _tetrahedra(points: list[tuple[float, float, float]], cells: list[tuple[int, ...]]) -> Tetrahedra:
    room, n, m = 200, len(points), len(cells)
    nodes = np.full((room, 4), -1, np.int32)
    nodes[:m] = cells
    x = np.zeros((room, 3))
    x[:n] = points
    ints = [np.zeros(room, np.int32) for _ in range(6)]
    ints[3][:] = -1
    t = Tetrahedra(
        x, nodes, np.zeros(room), ints[0], ints[1], ints[2], ints[3], ints[4], np.zeros(4 * room, np.int32),
        np.zeros(4 * room, np.int32), np.full(room, FIXED, np.uint8), np.ones(room), ints[5],
        np.array([m, 0, n, 1, -1]), np.zeros((9, 9), np.int64), np.zeros((9, 3)), NO_FLOOR,
    )  # fmt: skip
    tetrahedra.link(t)
    return t


@pytest.mark.parametrize("n", range(3, 10))
def test_an_edge_with_any_ring_is_removed(n: int) -> None:
    # A short edge along z in the middle of a wide ring, lifted at every other point: no cell is good with it.
    ring = [(np.cos(a), np.sin(a), 0.0) for a in 2 * np.pi * np.arange(n) / n]
    t = _tetrahedra([(0, 0, -0.9), (0, 0, 0.9), *ring], [(0, 1, 2 + i, 2 + (i + 1) % n) for i in range(n)])
    t.points[:2, :2] += 0.55  # so close to one side that its cells are thin
    tetrahedra.link(t)
    done = np.zeros(5, np.int64)
    before = t.quality[:n].min()
    changed = reconnection.raise_least(t, tetrahedra.scratch(), np.arange(n), 1.0, 1e-3, done)
    alive = np.flatnonzero(t.nodes[: t.counts[N_CELLS], 0] >= 0)
    if n == 3:
        assert (changed, len(alive)) == (1, 2)
    assert t.quality[alive].min() >= before
    assert done[0] == changed
    if changed:
        assert len(alive) == 2 * (n - 2)
        assert not (t.nodes[alive] == 0).any(axis=1)[(t.nodes[alive] == 1).any(axis=1)].any()


def test_limits_are_what_the_room_holds() -> None:
    room = tetrahedra.scratch()
    assert len(room.ring) >= flips.RING
    assert len(room.cells) >= 2 * flips.RING
    assert len(room.best) >= flips.RING
    assert len(room.cells) >= cavities.CAVITY
    assert len(room.faces) >= 2 * cavities.CAVITY + 2


def test_no_room_for_points_or_cells_is_no_error() -> None:
    mesh = delaunay(3)
    constraints = constraints_of(mesh, meshgauge.measure(mesh), None)
    from meshgauge.repair import reconnection as driver

    state = driver._state(mesh, constraints, np.ones(mesh.n_cells, bool), NO_FLOOR)
    n, m = int(state.counts[N_POINTS]), int(state.counts[N_CELLS])
    tight = state._replace(points=state.points[:n].copy(), nodes=state.nodes[: m + 1].copy())
    done = np.zeros(5, np.int64)
    order = np.argsort(tight.quality[:m], kind="stable")
    tight.counts[NOW] += 1
    reconnection.raise_least(tight, tetrahedra.scratch(), order, 1.0, 1e-3, done)
    assert done[:4].sum() > 0
    assert done[4] == 0
    assert tight.counts[N_CELLS] <= m + 1


def test_smoothing_moves_each_point_that_may_and_tells_what_it_gains() -> None:
    mesh = delaunay(3)
    from meshgauge.repair import reconnection as driver

    state = driver._state(
        mesh, constraints_of(mesh, meshgauge.measure(mesh), None), np.ones(mesh.n_cells, bool), NO_FLOOR
    )
    n, before = mesh.n_cells, state.quality[: mesh.n_cells].sum()
    gained = reconnection.smooth(state, np.arange(mesh.n_points), 0.2)
    assert gained == pytest.approx(state.quality[:n].sum() - before)
    has_moved = (state.points[: mesh.n_points] != mesh.points).any(axis=1)
    may_move = state.marks[: mesh.n_points] & FIXED == 0
    assert 0.8 * may_move.sum() < has_moved.sum() <= may_move.sum()
    assert not has_moved[~may_move].any()


@pytest.mark.parametrize("is_taken", [False, True])
def test_an_edge_that_is_there_is_not_made_again(is_taken: bool) -> None:
    """The two sides of a face are joined by an edge, unless a cell that lies across has it: then there would be two."""
    from meshgauge.repair import reconnection as driver

    around = [[np.cos(t), np.sin(t), 0.0] for t in (0.0, 2.0944, 4.1888)]
    points = np.array([*around, [0.0, 0.0, 0.3], [0.0, 0.0, -0.3], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]])
    mesh = Mesh.from_arrays(points, {"tetra": [[0, 1, 2, 3], [0, 2, 1, 4], [3, 4, 6, 5]][: 3 if is_taken else 2]})
    every = np.arange(mesh.n_points)
    constraints = constraints_of(mesh, meshgauge.measure(mesh), every)
    state, done = driver._state(mesh, constraints, np.ones(mesh.n_cells, bool), NO_FLOOR), np.zeros(5, np.int64)
    state.counts[NOW] += 1
    reconnection.raise_least(state, tetrahedra.scratch(), np.array([0]), 1.0, 1e-3, done)
    assert done[1] == (0 if is_taken else 1)


OCTANTS = [
    [6, a, b, c] if (a < 3) ^ (b < 3) ^ (c < 3) else [6, b, a, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)
]
"""Cells of an octahedron about a point inside: node 3 is opposite to 0, 4 to 1 and 5 to 2."""


def octahedron(x: float) -> Tetrahedra:
    """Its state, with the point inside on the first axis; all others are fixed."""
    from meshgauge.repair import reconnection as driver

    mesh = Mesh.from_arrays(np.array([*np.eye(3), *-np.eye(3), [x, 0.0, 0.0]]), {"tetra": OCTANTS})
    constraints = constraints_of(mesh, meshgauge.measure(mesh), np.arange(6))
    state = driver._state(mesh, constraints, np.ones(8, bool), 0)
    state.counts[NOW] += 1
    return state


def test_a_point_goes_on_while_it_gains() -> None:
    """To the middle of an octahedron, further than all steps together if each were the last of its length."""
    state, done = octahedron(0.75), np.zeros(5, np.int64)
    state.regions[:8] = np.arange(8)  # so that no two are joined anew
    reconnection.raise_least(state, tetrahedra.scratch(), np.argsort(state.quality[:8])[:1], 1.0, 1e-3, done)
    assert done.tolist() == [0, 0, 1, 0, 0]
    assert np.abs(state.points[6]).max() < 0.03


@pytest.mark.parametrize(("size", "n"), [(1.26, 1), (1.24, 0)])
def test_a_collapse_makes_no_edge_longer_than_1_6_of_those_around(size: float, n: int) -> None:
    """The point inside goes to the corner beside it, which then has an edge of length 2."""
    state, done = octahedron(0.95), np.zeros(5, np.int64)
    state.sizes[:] = size
    reconnection.raise_mean(state, tetrahedra.scratch(), np.argsort(state.quality[:8])[:1], 0.3, 0.0, 1e-3, done)
    assert done.tolist() == [0, 0, 0, n, 0]


def _links(state: Tetrahedra) -> list[set[int]]:
    """The corners at each point."""
    found = []
    for point in range(int(state.counts[N_POINTS])):
        corner, of_point = int(state.heads[point]), set()
        while corner >= 0:
            assert state.after[corner] < 0 or state.before[state.after[corner]] == corner
            of_point.add(corner)
            corner = int(state.after[corner])
        found.append(of_point)
    return found


def test_what_is_tried_in_vain_is_undone_to_the_last_bit() -> None:
    """With a gain that nothing has; and with one that is had, something stays."""
    from meshgauge.repair import reconnection as driver

    mesh, done = delaunay(3), np.zeros(5, np.int64)
    state = driver._state(
        mesh, constraints_of(mesh, meshgauge.measure(mesh), None), np.ones(mesh.n_cells, bool), NO_FLOOR
    )
    n, m = mesh.n_cells, mesh.n_points
    before = [getattr(state, name)[:n].copy() for name in ("nodes", "quality", "regions", "origins", "changed")]
    points, links = state.points[:m].copy(), _links(state)
    order = np.argsort(state.quality[:n], kind="stable")[:40]
    state.counts[NOW] += 1
    assert reconnection.untie(state, tetrahedra.scratch(), order, 3.0, 0.5, done) == 0
    assert not done.any()
    alive = np.flatnonzero(state.nodes[: state.counts[N_CELLS], 0] >= 0)
    assert np.array_equal(alive, np.arange(n))
    for name, was in zip(("nodes", "quality", "regions", "origins", "changed"), before, strict=True):
        assert np.array_equal(getattr(state, name)[:n], was), name
    assert state.counts[N_POINTS] == m
    assert np.array_equal(state.points[:m], points)
    assert _links(state) == links
    worst = state.quality[order[0]]
    assert reconnection.untie(state, tetrahedra.scratch(), order[:1], 1e-3, 0.5, done) == 1
    assert done.any()
    assert state.nodes[order[0], 0] < 0 or state.quality[order[0]] > worst


@pytest.mark.parametrize("seed", [1, 2])
def test_more_is_tried_on_the_worst(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Where a third of the points stay, single operations are soon stuck."""
    from meshgauge.repair import reconnection as driver

    mesh = delaunay(4, seed)
    fixed = np.arange(0, mesh.n_points, 3)
    worst = meshgauge.measure(rejoin(mesh, fixed).mesh).values.min()
    monkeypatch.setattr(driver, "TRIES", 0)
    without = meshgauge.measure(rejoin(mesh, fixed).mesh).values.min()
    assert worst > without + 0.08


@pytest.mark.parametrize("seed", range(3))
def test_the_same_however_points_cells_and_nodes_are_numbered(seed: int) -> None:
    mesh, random = delaunay(), np.random.default_rng(seed)
    new = random.permutation(mesh.n_points)
    points = np.empty((mesh.n_points, 3))
    points[new] = mesh.points
    nodes = new[mesh.connectivity.reshape(-1, 4)][random.permutation(mesh.n_cells)]
    turns = np.array([[0, 1, 2, 3], [1, 2, 0, 3], [3, 0, 2, 1], [2, 3, 0, 1]])
    nodes = np.take_along_axis(nodes, turns[random.integers(4, size=len(nodes))], axis=1)
    one, other = rejoin(mesh), rejoin(Mesh.from_arrays(points, {"tetra": nodes}))
    assert one.done == other.done
    values = [np.sort(meshgauge.measure(each.mesh).values) for each in (one, other)]
    assert np.allclose(*values, rtol=0, atol=1e-9)


def test_what_was_tried_in_vain_is_tried_again_only_near_changes() -> None:
    from meshgauge.repair import reconnection as driver

    mesh = delaunay(3)
    state = driver._state(
        mesh, constraints_of(mesh, meshgauge.measure(mesh), None), np.ones(mesh.n_cells, bool), NO_FLOOR
    )
    done, order = np.zeros(5, np.int64), np.arange(mesh.n_points)
    passes = driver._Passes(state, tetrahedra.scratch(), done, lambda: False, order)
    alive = np.arange(mesh.n_cells)
    threshold = float(np.median(state.quality[: mesh.n_cells]))
    first = passes._changed("mean", alive, threshold)
    assert np.array_equal(first, np.flatnonzero(state.quality[: mesh.n_cells] < threshold))
    assert len(passes._changed("mean", alive, threshold)) == 0
    point = int(state.nodes[first[0], 0])
    state.points[point] += 0.005 * state.sizes[point]
    assert len(passes._changed("mean", alive, threshold)) == 0
    state.points[point] += 0.005 * state.sizes[point]  # both together are not small any more
    beside = np.unique(state.nodes[alive][(state.nodes[alive] == point).any(axis=1)])
    near = np.isin(state.nodes[alive], beside).any(axis=1)
    assert np.array_equal(passes._changed("mean", alive, threshold), first[near[first]])
    assert len(passes._changed("mean", alive, threshold)) == 0
    state.changed[first[0]] = state.counts[NOW]
    assert first[0] in passes._changed("mean", alive, threshold)
    higher = passes._changed("mean", alive, threshold + 0.1)
    assert (state.quality[higher] >= threshold).all() or first[0] in higher
