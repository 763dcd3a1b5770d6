"""Finite volumes take star-shaped cells of any type; finite elements do not."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge import Mesh, Status, measure
from meshgauge.check import check
from meshgauge.mesh import CellBlock
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality import concave
from meshgauge.report.verdict import verdict

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
PRISM = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], float)
PYRAMID = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)], float)


def moved(points: np.ndarray, node: int, to: tuple[float, float, float]) -> np.ndarray:
    points = points.copy()
    points[node] = to
    return points


CASES = {
    "hexahedron": moved(CUBE, 6, (0.6, 0.6, 0.6)),
    "wedge": moved(PRISM, 3, (0.4, 0.4, 0.3)),
    "pyramid": moved(PYRAMID, 0, (0.6, 0.6, 0.1)),
}


def mesh_of(kind: str, points: np.ndarray, n: int = 1, purpose: str = "fem") -> Mesh:
    nodes = np.arange(len(points)) + len(points) * np.arange(n)[:, None]
    return Mesh.from_arrays(np.tile(points, (n, 1)), [(kind, nodes)]).replace(purpose=purpose)


@pytest.mark.usefixtures("path")
@pytest.mark.parametrize("n", [1, 201])
@pytest.mark.parametrize("kind", CASES)
def test_a_star_shaped_cell_is_concave_for_finite_volumes_only(
    kind: str, n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(concave, "CHUNK", 100)
    mesh = mesh_of(kind, CASES[kind], n)
    elements, volumes = measure(mesh), measure(mesh, purpose="fv", threads=2)
    assert set(elements.status.tolist()) == {Status.INVERTED}
    assert set(volumes.status.tolist()) == {Status.CONCAVE}
    np.testing.assert_array_equal(elements.values, volumes.values)
    assert (elements.values < 0).all()
    assert not check(elements, ["nothing invalid"]).is_passed
    assert check(volumes, ["nothing invalid"]).is_passed
    assert verdict(elements.summary()).level == "bad"
    assert "usable for finite volumes, not for finite elements" in verdict(volumes.summary()).text


@pytest.mark.parametrize("kind", CASES)
def test_a_cell_that_no_point_sees_stays_inverted(kind: str) -> None:
    points = CASES[kind] * (1, 1, -1)  # numbered in reverse: seen from outside only
    assert measure(mesh_of(kind, points, purpose="fv")).status.tolist() == [Status.INVERTED]
    tetra = np.array([(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1)], float)
    assert measure(mesh_of("tetra", tetra, purpose="fv")).status.tolist() == [Status.INVERTED]


def test_a_flat_corner_does_no_harm_to_finite_volumes() -> None:
    points = moved(CUBE, 6, (2 / 3, 2 / 3, 2 / 3))
    flat = moved(CUBE, 6, (1, 0.5, 0.5))
    assert measure(mesh_of("hexahedron", flat)).status.tolist() == [Status.DEGENERATE]
    assert measure(mesh_of("hexahedron", flat, purpose="fv")).status.tolist() == [Status.CONCAVE]
    assert measure(mesh_of("hexahedron", points * (1, 1, 0), purpose="fv")).status[0] != Status.CONCAVE


def test_openfoam_cases_are_for_finite_volumes(shared: object) -> None:
    import meshgauge

    for case, n_bad in (("snap", 248), ("dual", 33)):
        quality = measure(meshgauge.read(f"{shared}/cases/finite_volume/{case}"))
        assert quality.mesh.purpose == "fv"
        assert quality.summary().all.statuses["concave"] == n_bad
        assert check(quality, ["nothing invalid", "nothing degenerate"]).is_passed


SPLIT = np.vstack([CUBE, [(0.5, 0, 1), (0.5, 1, 1), (0.6, 0.4, 1)]])
"""A cube whose top is two pentagons: 8 and 9 are on edges of it, 10 is where the edge between them bends."""

TOPS = [(4, 8, 10, 9, 7), (8, 5, 6, 9, 10)]
SPLIT_FACES = [(0, 3, 2, 1), *TOPS, (0, 1, 5, 8, 4), (1, 2, 6, 5), (2, 3, 7, 9, 6), (3, 0, 4, 7)]


def split_cube(points: np.ndarray = SPLIT, patches: tuple[str, ...] = ()) -> Mesh:
    """The cube; beside it the halves of its top as surface cells of these patches."""
    tops = TOPS[: len(patches)]
    blocks = [CellBlock("cells", 0, 1)] + [CellBlock(name, n, n + 1) for n, name in enumerate(patches, 1)]
    return Mesh(
        points=points,
        types=np.array([42] + [7] * len(tops), np.uint8),
        offsets=np.cumsum([0, 11, *map(len, tops)]),
        connectivity=np.array([*range(11), *(p for top in tops for p in top)]),
        polyhedra=Polyhedra(
            cell_offsets=np.array([0, 7] + [7] * len(tops)),
            cell_faces=np.arange(7),
            face_offsets=np.cumsum([0, *map(len, SPLIT_FACES)]),
            face_points=np.array([p for face in SPLIT_FACES for p in face]),
        ),
        blocks=tuple(blocks),
    )


@pytest.mark.parametrize("patches", [(), ("wall",), ("wall", "wall")], ids=len)
def test_coplanar_faces_of_one_patch_are_one_face(patches: tuple[str, ...]) -> None:
    """A face without a surface cell is of no named patch: such faces are one patch of their own."""
    quality = measure(split_cube(patches=patches))
    if len(patches) == 1:
        assert quality.status[0] == Status.DEGENERATE
        return
    assert quality.status[0] == Status.OK
    assert quality.values[0] == pytest.approx(1.0)
    assert quality.polyhedra is not None
    hanging = quality.polyhedra.node_points[quality.polyhedra.node_is_hanging]
    assert sorted(hanging.tolist()) == [8, 9, 10]


def test_faces_of_two_patches_and_faces_that_bend_stay_apart() -> None:
    assert measure(split_cube(patches=("wall", "inlet"))).status[0] == Status.DEGENERATE
    for angle, is_one in ((0.05, True), (0.2, False)):
        points = SPLIT.copy()
        points[8:, 2] -= np.tan(np.radians(angle)) * 0.5 / 2
        points[10, 2] = points[8, 2]
        assert (measure(split_cube(points)).status[0] == Status.OK) == is_one, angle


def test_however_the_cell_is_turned_and_moved() -> None:
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    for points in (SPLIT @ rotation.T + 100, (SPLIT @ rotation.T).astype(np.float32), SPLIT * 1e-9):
        quality = measure(split_cube(points))
        assert quality.status.tolist() == [Status.OK]
        assert quality.values[0] == pytest.approx(1.0, abs=1e-5)
