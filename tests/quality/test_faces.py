"""Measures of finite volumes: known values, an oracle written cell by cell, checkMesh's own numbers, and laws."""

from __future__ import annotations

import re
from math import acos, degrees, inf, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, Polyhedra
from meshgauge.cells import SHAPES, Shape
from meshgauge.check import check
from meshgauge.kernels.finite_volume import driver
from meshgauge.mesh import CellBlock
from meshgauge.mesh.labels import LABEL
from meshgauge.quality.faces import FaceQuality, mean_angle
from meshgauge.quality.metrics import LIMITS, METRICS

NAMES = tuple(LIMITS)

pytestmark = pytest.mark.usefixtures("path")


def grid(n: int = 3, *, noise: float = 0.0, tetra: bool = False, seed: int = 0) -> Mesh:
    """Unit cubes of a grid, or six tetrahedra in the place of each."""
    ticks = np.arange(n + 1.0)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3)
    points += np.random.default_rng(seed).uniform(-noise, noise, points.shape)
    ids = np.arange(len(points)).reshape(n + 1, n + 1, n + 1)
    low, high = slice(None, -1), slice(1, None)
    corners = [(low, low, low), (high, low, low), (high, high, low), (low, high, low)]
    corners += [(a, b, high) for a, b, _ in corners]
    cells = np.stack([ids[c] for c in corners], -1).reshape(-1, 8)
    if not tetra:
        return Mesh.from_arrays(points, {"hexahedron": cells})
    path = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
    return Mesh.from_arrays(points, {"tetra": np.concatenate([cells[:, list(p)] for p in path])})


def mixed(seed: int = 1) -> Mesh:
    """A hexahedron with pyramids on two sides, a wedge on a third and tetrahedra behind, points moved at random."""
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    points += [(2.0, 0.5, 0.5), (0.5, 0.5, 2.0), (0.0, -0.8, 0.5), (1.0, -0.8, 0.5), (1.8, 1.4, 1.3)]
    moved = np.array(points) + np.random.default_rng(seed).uniform(-0.15, 0.15, (len(points), 3))
    cells = {
        "hexahedron": [(0, 1, 2, 3, 4, 5, 6, 7)],
        "pyramid": [(1, 5, 6, 2, 8)[::1], (4, 7, 6, 5, 9)],
        "wedge": [(0, 4, 10, 1, 5, 11)],
        "tetra": [(6, 2, 8, 12)],
    }
    return meshgauge.doctor.orient(Mesh.from_arrays(moved, cells))[0]


def as_polyhedra(mesh: Mesh) -> Mesh:
    """The same cells, each given by its faces."""
    faces, cell_faces = [], [0]
    for cell in range(mesh.n_cells):
        shape = SHAPES[meshgauge.cells.type_name(int(mesh.types[cell]))]
        faces += [mesh.nodes(cell)[list(face)] for face in shape.faces]
        cell_faces.append(len(faces))
    offsets = np.r_[0, np.cumsum([len(face) for face in faces])]
    poly = Polyhedra(np.array(cell_faces), np.arange(len(faces)), offsets, np.concatenate(faces))
    return Mesh(mesh.points, np.full(mesh.n_cells, 42, np.uint8), mesh.offsets, mesh.connectivity, poly, purpose="fv")


def by_hand(mesh: Mesh) -> dict[str, list[float]]:
    """The measures of each cell, a cell and a face at a time, as the definitions read."""
    points = np.asarray(mesh.points, float)
    faces: dict[frozenset[int], list[tuple[int, list[int]]]] = {}
    of_cell: list[list[frozenset[int]]] = []
    for cell in range(mesh.n_cells):
        shape = SHAPES[meshgauge.cells.type_name(int(mesh.types[cell]))]
        mine = [[int(mesh.nodes(cell)[m]) for m in face] for face in shape.faces]
        of_cell.append([frozenset(face) for face in mine])
        for face in mine:
            faces.setdefault(frozenset(face), []).append((cell, face))

    def geometry(face: list[int]) -> tuple[Any, Any, float]:
        x = points[face]
        about, area, weighted, total = x.mean(axis=0), np.zeros(3), np.zeros(3), 0.0
        for a, b in zip(x, np.roll(x, -1, axis=0), strict=True):
            normal = np.cross(b - a, about - a)
            size = sqrt(normal @ normal)
            area, total, weighted = area + normal / 2, total + size, weighted + size * (a + b + about) / 3
        centre = weighted / total
        flat = sum(
            sqrt((n := np.cross(b - a, centre - a)) @ n) / 2 for a, b in zip(x, np.roll(x, -1, axis=0), strict=True)
        )
        return centre, area, flat

    shapes = {key: geometry(sides[0][1]) for key, sides in faces.items()}

    def outward(key: frozenset[int], cell: int) -> Any:
        return shapes[key][1] if faces[key][0][0] == cell else -shapes[key][1]

    centres, volumes = [], []
    for cell, keys in enumerate(of_cell):
        about = np.mean([shapes[key][0] for key in keys], axis=0)
        parts = [(outward(key, cell) @ (shapes[key][0] - about), shapes[key][0]) for key in keys]
        whole = sum(v for v, _ in parts)
        centres.append(sum(v * (0.75 * c + 0.25 * about) for v, c in parts) / whole)
        volumes.append(whole / 3)

    def skew(key: frozenset[int], cell: int, d: Any, least: float) -> float:
        centre, area, _ = shapes[key]
        to = centre - centres[cell]
        off = to - (area @ to) / (area @ d) * d
        length = sqrt(off @ off)
        if length == 0:
            return 0.0
        reach = max(abs(off / length @ (points[p] - centre)) for p in key)
        return length / max(least * sqrt(d @ d), reach)

    out: dict[str, list[float]] = {name: [] for name in NAMES}
    for cell, keys in enumerate(of_cell):
        v = {"non_orthogonality": [0.0], "skewness": [0.0], "boundary_skewness": [0.0], "face_weight": [0.5]}
        v |= {"volume_ratio": [1.0], "flatness": [1.0], "pyramid_volume": []}
        inner = [key for key in keys if len(faces[key]) == 2]
        for key in keys:
            centre, area, flat = shapes[key]
            size = sqrt(area @ area)
            v["pyramid_volume"].append(outward(key, cell) @ (centre - centres[cell]) / 3)
            if len(key) > 3:
                v["flatness"].append(size / flat)
            if key not in inner:
                normal = outward(key, cell) / size
                v["boundary_skewness"].append(skew(key, cell, normal * (normal @ (centre - centres[cell])), 0.4))
                continue
            other = next(c for c, _ in faces[key] if c != cell)
            d, s = centres[other] - centres[cell], outward(key, cell)
            v["pyramid_volume"].append(-s @ (centre - centres[other]) / 3)
            v["non_orthogonality"].append(degrees(acos(max(-1, min(1, d @ s / sqrt(d @ d) / size)))))
            v["skewness"].append(skew(key, cell, d, 0.2))
            near, far = abs(s @ (centre - centres[cell])), abs(s @ (centres[other] - centre))
            v["face_weight"].append(min(near, far) / (near + far))
            pair = abs(volumes[cell]), abs(volumes[other])
            v["volume_ratio"].append(min(pair) / max(pair))
        for name in ("non_orthogonality", "skewness", "boundary_skewness"):
            out[name].append(max(v[name]))
        for name in ("face_weight", "volume_ratio", "flatness", "pyramid_volume"):
            out[name].append(min(v[name]))
        seen = sum(abs(shapes[key][1]) for key in keys)
        out["aspect_ratio"].append(max(seen.max() / seen.min(), seen.sum() / 6 / abs(volumes[cell]) ** (2 / 3)))
        mean = np.mean([sqrt(shapes[key][1] @ shapes[key][1]) for key in inner]) if inner else 1.0
        total = sum((np.outer(shapes[key][1], shapes[key][1]) / mean**2 for key in inner), np.zeros((3, 3)))
        out["determinant"].append(abs(np.linalg.det(total)) / 8)
    return out


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("block", [1 << 16, 5])
@pytest.mark.parametrize(
    "mesh", [grid(3, noise=0.25), grid(2, noise=0.2, tetra=True), mixed(1), mixed(2)], ids=["hex", "tet", "mix", "mix2"]
)
def test_cell_by_cell(mesh: Mesh, block: int, threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "BLOCK", block)
    quality = meshgauge.measure(mesh, metrics=NAMES, threads=threads)
    for name, values in by_hand(mesh).items():
        np.testing.assert_allclose(quality.values_of(name), values, rtol=1e-10, atol=1e-12, err_msg=name)


def test_polyhedra_have_the_values_of_the_cells_that_they_are() -> None:
    mesh = mixed()
    poly = as_polyhedra(mesh)
    one, other = meshgauge.measure(mesh, metrics=NAMES), meshgauge.measure(poly, metrics=NAMES)
    for name in NAMES:
        np.testing.assert_allclose(other.values_of(name), one.values_of(name), rtol=1e-12, atol=1e-13, err_msg=name)


def test_a_grid_of_cubes_is_ideal() -> None:
    mesh = grid(3)
    quality = meshgauge.measure(mesh, metrics=NAMES)
    best = {"face_weight": 0.5, "volume_ratio": 1.0, "aspect_ratio": 1.0, "flatness": 1.0, "pyramid_volume": 1 / 6}
    for name in NAMES:
        if name != "determinant":
            np.testing.assert_allclose(quality.values_of(name), best.get(name, 0.0), atol=1e-6, err_msg=name)
    assert quality.values_of("determinant").reshape(3, 3, 3)[1, 1, 1] == pytest.approx(1.0)
    # At a corner of the grid three faces are to neighbours: the sum of S Sᵀ is the unit matrix.
    assert quality.values_of("determinant")[0] == pytest.approx(1 / 8)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=lambda shape: shape.name)
def test_the_ideal_least_pyramid_is_that_of_the_ideal_cell(shape: Shape) -> None:
    """Wherever the origin is: it need not be the middle of the cell."""
    points = np.array(shape.points, np.float64)
    points *= 2.0 / np.linalg.norm(np.diff(points[list(shape.faces[0][:2])], axis=0))
    row = METRICS["pyramid_volume"]
    cell = Mesh.from_arrays(points + 7.0, {shape.name: [list(range(len(points)))]})
    assert meshgauge.measure(cell, metrics=row.name).values_of(row.name) / 8 == pytest.approx(
        row.standard(shape.name).ideal
    )


def test_sheared_and_graded_grids_have_known_values() -> None:
    mesh = grid(3)
    points = np.array(mesh.points)
    sheared = meshgauge.measure(mesh.replace(points=points + points[:, [2]] * (1.0, 0, 0)), metrics=NAMES)
    assert sheared.values_of("non_orthogonality") == pytest.approx(np.full(27, 45.0))
    assert sheared.values_of("skewness") == pytest.approx(np.zeros(27), abs=1e-12)
    graded = points.copy()
    graded[:, 0] = np.array([0, 1, 4, 13])[points[:, 0].astype(int)]
    quality = meshgauge.measure(mesh.replace(points=graded), metrics=NAMES)
    assert quality.values_of("volume_ratio") == pytest.approx(np.full(27, 1 / 3))
    assert quality.values_of("face_weight") == pytest.approx(np.full(27, 1 / 4))
    widths = np.repeat([1.0, 3.0, 9.0], 9)
    assert quality.values_of("aspect_ratio") == pytest.approx(
        np.maximum(widths, (2 + 4 * widths) / 6 / widths ** (2 / 3))
    )


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("thickness", [1.0, 40.0])
def test_a_mesh_one_cell_thick_is_measured_in_its_plane(axis: int, thickness: float) -> None:
    """As checkMesh measures cases whose front and back are empty: how thick the cells are does not count."""
    mesh = slab(axis, thickness)
    quality = meshgauge.measure(mesh, metrics=NAMES)
    faces = quality.faces
    assert faces is not None
    assert np.flatnonzero(~faces.axes).tolist() == [axis]
    across = [a for a in range(3) if a != axis]
    for cell in range(9):
        is_its = (faces.owner == cell) | (faces.neighbour == cell)
        seen = np.abs(faces.areas[is_its][:, across]).sum(axis=0)
        assert quality.values_of("aspect_ratio")[cell] == pytest.approx(seen.max() / seen.min(), rel=1e-12)
        inner = faces.areas[is_its & faces.is_inner][:, across]
        inner /= np.linalg.norm(inner, axis=1).mean()
        expected = abs(np.linalg.det(inner.T @ inner)) / 8
        assert quality.values_of("determinant")[cell] == pytest.approx(expected, rel=1e-12)
    assert quality.values_of("determinant").min() > 0.05
    assert quality.values_of("aspect_ratio").max() < 3.0


def slab(axis: int, thickness: float) -> Mesh:
    """Three by three hexahedra, one cell thick along an axis; points moved at random in the plane."""
    ticks = [np.arange(2.0) * thickness if a == axis else np.arange(4.0) for a in range(3)]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), -1)
    shape = points.shape[:3]
    moved = np.random.default_rng(axis).uniform(-0.2, 0.2, points.shape)
    moved[..., axis] = 0.0
    points += np.take(moved, [0], axis=axis)
    ids = np.arange(points.size // 3).reshape(shape)
    a, b = slice(None, -1), slice(1, None)
    base = [(a, a), (b, a), (b, b), (a, b)]
    cells = np.stack([ids[(*side, z)] for z in (a, b) for side in base], -1).reshape(-1, 8)
    return Mesh.from_arrays(points.reshape(-1, 3), {"hexahedron": cells})


def test_a_row_of_cells_is_measured_along_it() -> None:
    quality = meshgauge.measure(grid(2).replace(points=grid(2).points * (1.0, 7.0, 3.0)), metrics=NAMES)
    assert quality.faces is not None
    assert quality.faces.axes.all()
    row = Mesh.from_arrays(
        [(x, y, z) for x in range(4) for y, z in ((0, 0), (9, 0), (9, 5), (0, 5))],
        {"hexahedron": [range(4 * x, 4 * x + 8) for x in range(3)]},
    )
    along = meshgauge.measure(row, metrics=NAMES)
    for name in ("aspect_ratio", "determinant"):
        assert along.values_of(name).tolist() == [1.0, 1.0, 1.0]
    alone = meshgauge.measure(grid(1), metrics=NAMES)  # no face between cells: nothing says that it is thin
    assert alone.values_of("determinant").tolist() == [0.0]
    assert alone.faces is not None
    assert alone.faces.axes.all()


@pytest.mark.parametrize("angles", [[0.0, 0.0], [1e-9, 3e-9], [10.0, 50.0, 0.0], [180.0, 180.0], [170.0, 20.0]])
def test_the_mean_of_angles_is_the_angle_of_the_mean_cosine(angles: list[float]) -> None:
    exact = [1 - 2 * np.sin(np.radians(a) / 2) ** 2 for a in angles]
    found = mean_angle(np.array(angles))
    assert np.cos(np.radians(found)) == pytest.approx(np.mean(exact), abs=1e-15)
    small = sqrt(np.mean(np.square(angles)))  # as long as cos a is 1 - a²/2
    assert found == pytest.approx(small, rel=1e-12) or max(angles) > 1.0


@pytest.mark.parametrize("case", ["snap", "dual"])
def test_numbers_of_checkmesh(case: str, shared: Path) -> None:
    folder = shared / "cases" / "finite_volume" / case
    log = (folder / "checkMesh.txt").read_text()
    mesh = meshgauge.read(folder)
    faces = FaceQuality(mesh)
    solid = faces.volumes != 0.0
    flat = faces.flatness[~np.isnan(faces.flatness)]
    number = r"([-\d.e+]*\d)"
    rows = {
        rf"Max aspect ratio = {number}": [faces.aspect_ratio[solid].max()],
        rf"Total volume = {number}": [faces.volumes.sum()],
        rf"non-orthogonality Max: {number} average: {number}": [
            np.nanmax(faces.non_orthogonality),
            mean_angle(faces.non_orthogonality[faces.is_inner]),
        ],
        rf"Max skewness = {number}": [max(np.nanmax(faces.skewness), np.nanmax(faces.boundary_skewness))],
        rf"butterfly\) : min = {number}  average = {number}": [flat.min(), flat.mean()],
        rf"wellposedness\) : minimum: {number} average: {number}": [
            faces.determinant[solid].min(),
            faces.determinant[solid].mean(),
        ],
        rf"weight : minimum: {number} average: {number}": [np.nanmin(faces.face_weight), np.nanmean(faces.face_weight)],
        rf"ratio : minimum: {number} average: {number}": [
            np.nanmin(faces.volume_ratio),
            np.nanmean(faces.volume_ratio),
        ],
    }
    for pattern, values in rows.items():
        match = re.search(pattern, log)
        assert match is not None, pattern
        assert values == pytest.approx([float(text) for text in match.groups()], rel=1e-12), pattern


def test_what_cannot_be_measured_is_nan_and_spoils_only_its_neighbours() -> None:
    mesh = grid(3)
    points = np.array(mesh.points)
    points[0] = nan
    quality = meshgauge.measure(mesh.replace(points=points), metrics=NAMES)
    for name in NAMES:
        values = quality.values_of(name)
        assert np.isnan(values[0])
        assert not np.isnan(values[26])
        assert np.isnan(values).sum() <= 4  # the cell and those beside it, which have a face without a value
        if name not in ("aspect_ratio", "determinant"):
            assert np.isnan(values[[0, 1, 3, 9]]).all()


def test_cells_that_are_not_solid_have_no_value() -> None:
    mesh = Mesh.from_arrays(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [("tetra", [(0, 1, 2, 3)]), ("triangle", [(0, 2, 1)])]
    )
    quality = meshgauge.measure(mesh, metrics=NAMES)
    assert all(np.isnan(quality.values_of(name)).tolist() == [False, True] for name in NAMES)
    assert quality.values_of("non_orthogonality")[0] == 0.0
    assert quality.values_of("determinant")[0] == 0.0


def test_flat_and_folded_cells() -> None:
    points = np.array(grid(1).points)
    flat = points * (1, 1, 0)
    quality = meshgauge.measure(grid(1).replace(points=flat), metrics=NAMES)
    assert quality.values_of("aspect_ratio").tolist() == [inf]
    assert quality.values_of("pyramid_volume")[0] <= 0.0
    turned = meshgauge.measure(Mesh.from_arrays(points, {"hexahedron": [(4, 5, 7, 6, 0, 1, 3, 2)]}), metrics=NAMES)
    assert turned.values_of("pyramid_volume") == pytest.approx([1 / 6]) or turned.values[0] < 0


def test_the_worst_faces_have_cells_and_place() -> None:
    points = np.array(grid(2).points)
    points[13] += (0.3, 0.1, -0.2)  # the one inside
    faces = FaceQuality(grid(2).replace(points=points, cell_data={LABEL: 10 * np.arange(8)}))
    worst = faces.worst("non_orthogonality", 3, highest=True)
    values = faces.non_orthogonality
    assert [face.value for face in worst] == sorted(values[~np.isnan(values)].tolist(), reverse=True)[:3]
    for face in worst:
        assert face.neighbour is not None
        assert face.patch is None
        assert (face.owner_label, face.neighbour_label) == (10 * face.owner, 10 * face.neighbour)
        assert 13 in face.points
        both = set(faces.mesh.nodes(face.owner).tolist()) & set(faces.mesh.nodes(face.neighbour).tolist())
        assert both == set(face.points)
    least = faces.worst("face_weight", 100, highest=False)
    assert len(least) == 12  # faces inside
    assert [face.value for face in least] == sorted(face.value for face in least)


def test_faces_of_the_boundary_are_named_by_their_patch(tmp_path: Path) -> None:
    mesh = grid(1)
    quads = mesh.nodes(0)[[list(face) for face in SHAPES["hexahedron"].faces]]
    named = Mesh(
        np.array(mesh.points) + np.random.default_rng(0).uniform(-0.2, 0.2, (8, 3)),
        np.array([12, *[9] * 6], np.uint8),
        np.r_[0, 8, 8 + 4 * np.arange(1, 7)],
        np.r_[mesh.nodes(0), quads.ravel()],
        blocks=(CellBlock("cells", 0, 1), *(CellBlock(f"side {n}", n + 1, n + 2) for n in range(6))),
    )
    worst = FaceQuality(named).worst("boundary_skewness", 6, highest=True)
    for face in worst:
        assert face.patch is not None
        assert (face.neighbour, face.neighbour_label) == (None, None)
        assert set(quads[int(face.patch.split()[1])].tolist()) == set(face.points)


# --- the gate ---------------------------------------------------------------------------------------------------------


def stretched() -> Mesh:
    """Two cubes, the second moved aside within the plane of their face: a line that passes the face far off."""
    points = np.array(grid(2).points)
    points[:, 1] += np.where(points[:, 0] == 2, 9.0, 0.0)
    return grid(2).replace(points=points, purpose="fv")


def test_the_gate_holds_the_limits_for_finite_volumes_only() -> None:
    mesh = stretched()
    outcome = check(meshgauge.measure(mesh))
    states = {str(one.rule): one.state.value for one in outcome.outcomes}
    assert {f"{name} {limit}" for name, limit in LIMITS.items()} <= set(states)
    assert states["non_orthogonality <= 70"] == "fail"
    assert states["pyramid_volume > 0"] == "pass"
    assert outcome.state.value == "fail"
    finite_elements = check(meshgauge.measure(mesh.replace(purpose="fem")))
    assert not any(name in str(one.rule) for one in finite_elements.outcomes for name in NAMES)


def test_a_rule_on_faces_counts_polyhedra() -> None:
    quality = meshgauge.measure(as_polyhedra(grid(2, noise=0.2)), metrics="skewness")
    (one,) = check(quality, ["skewness <= 0"]).outcomes
    assert (one.n_cells, one.state.value) == (8, "fail")
    (one,) = check(quality, ["skewness <= 0 for polyhedron"]).outcomes
    assert one.n_cells == 8
