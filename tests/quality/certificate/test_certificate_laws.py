"""Laws that hold for every cell type."""

from __future__ import annotations

import numpy as np
import pytest
from certificate_cells import KINDS, LINEAR, cloud, family, ideal, many, separate

from meshgauge.kernels import path as kernels_path
from meshgauge.kernels.certificate.bounds import Bounds, Validity, bounds, validity
from meshgauge.kernels.certificate.numpy_path import can_decide
from meshgauge.kernels.certificate.tables import row_of, table

AMPLITUDE = {name: 0.7 if name in LINEAR else 0.15 for name in KINDS}


def sample(name: str) -> tuple[np.ndarray, np.ndarray, Bounds]:
    points, connectivity = cloud(name, many(300), AMPLITUDE[name])
    return points, connectivity, bounds(name, points, connectivity)


@pytest.mark.parametrize("name", KINDS)
def test_ideal_cell_is_one(name: str) -> None:
    result = bounds(name, *separate(ideal(name)[None]))
    assert result.status == Validity.VALID
    # The bounds include those on rounding, which grow with the number of terms.
    assert 1 - 1e-9 < result.lower <= 1 <= result.upper < 1 + 1e-9


@pytest.mark.parametrize("name", KINDS)
def test_affine_image_is_constant(name: str) -> None:
    """On an affine image of the ideal cell the determinant is constant: both bounds are it, however thin the cell."""
    for thickness in (1.0, 1e-3, 1e-6):
        rng = np.random.default_rng(4)
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix = rotation * np.sign(np.linalg.det(rotation)) @ np.diag((1, 1, thickness))
        result = bounds(name, *separate((ideal(name) @ matrix.T)[None]))
        assert result.status == Validity.VALID
        assert result.lower == pytest.approx(result.upper, rel=1e-4)


@pytest.mark.parametrize("name", KINDS)
def test_signs_and_status_say_the_same(name: str) -> None:
    points, connectivity, _ = sample(name)
    points[: table(name).n_nodes] = ideal(name)
    points[-table(name).n_nodes :] = -ideal(name)
    result = bounds(name, points, connectivity)
    assert set(np.unique(result.status)) == {Validity.VALID, Validity.INVALID}
    assert (result.lower <= result.upper).all()
    assert np.array_equal(result.lower > 0, result.status == Validity.VALID)
    assert np.array_equal(result.upper <= 0, result.status == Validity.INVALID)


@pytest.mark.parametrize("name", KINDS)
def test_rotation_and_translation(name: str) -> None:
    points, connectivity, result = sample(name)
    rng = np.random.default_rng(3)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    moved = bounds(name, points @ rotation.T + rng.normal(size=3), connectivity)
    assert np.array_equal(moved.status, result.status)
    valid = result.status == Validity.VALID
    assert moved.upper[valid] == pytest.approx(result.upper[valid], abs=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_unit_of_length(name: str) -> None:
    """From 1e-199 to 1e301 the same verdicts and the same numbers."""
    points, connectivity, result = sample(name)
    for power in (-660, -400, 500, 1000):
        scaled = bounds(name, points * 2.0**power, connectivity)
        assert np.array_equal(scaled.status, result.status), power
        assert scaled.lower == pytest.approx(result.lower, rel=1e-13, abs=1e-13), power
        assert scaled.upper == pytest.approx(result.upper, rel=1e-13, abs=1e-13), power


@pytest.mark.parametrize("name", KINDS)
def test_reflection_inverts(name: str) -> None:
    points, connectivity, result = sample(name)
    mirrored = bounds(name, points * (1, 1, -1), connectivity)
    assert (mirrored.status[result.status == Validity.VALID] == Validity.INVALID).all()
    assert (mirrored.upper[result.status == Validity.VALID] < 0).all()


@pytest.mark.parametrize("name", KINDS)
def test_layouts_of_arrays(name: str) -> None:
    """float32 points, int32 connectivity, read-only arrays, any number of cells: the same cells, the same result."""
    points, connectivity, _ = sample(name)
    single = points.astype(np.float32)
    result = bounds(name, single.astype(np.float64), connectivity)
    single.flags.writeable = False
    parts = [bounds(name, single, part.astype(np.int32)) for part in np.array_split(connectivity, 7)]
    assert np.array_equal(np.concatenate([p.status for p in parts]), result.status)
    assert np.array_equal(np.concatenate([p.lower for p in parts]), result.lower)
    assert np.array_equal(np.concatenate([p.upper for p in parts]), result.upper)
    assert len(bounds(name, points, connectivity[:0]).status) == 0


TURNS = {
    "tetra": [1, 2, 0, 3],
    "pyramid": [1, 2, 3, 0, 4],
    "wedge": [1, 2, 0, 4, 5, 3],
    "hexahedron": [1, 5, 6, 2, 0, 4, 7, 3],
}


@pytest.mark.parametrize("name", KINDS)
def test_renumbering(name: str) -> None:
    """A cell numbered from another of its corners is the same cell."""
    cell = ideal(name)
    # The 24-node hexahedron has nodes on four of its faces: only turns around its axis map it to itself.
    turn = [1, 2, 3, 0, 5, 6, 7, 4] if name == "hexahedron24" else TURNS[family(name)]
    matrix, *_ = np.linalg.lstsq(np.c_[cell[: len(turn)], np.ones(len(turn))], cell[turn], rcond=None)
    image = np.c_[cell, np.ones(len(cell))] @ matrix
    permutation = np.linalg.norm(image[:, None] - cell[None], axis=-1).argmin(1)
    assert sorted(permutation) == list(range(table(name).n_nodes))
    points, connectivity, result = sample(name)
    turned = bounds(name, points, np.ascontiguousarray(connectivity[:, permutation]))
    assert np.array_equal(turned.status, result.status)
    valid = result.status == Validity.VALID
    assert (turned.lower[valid] <= result.upper[valid]).all()
    assert (result.lower[valid] <= turned.upper[valid]).all()


DECIDED = [name for name in LINEAR if can_decide(row_of(name))]


def verdicts(name: str, points: np.ndarray, connectivity: np.ndarray) -> np.ndarray:
    return validity(name, points, connectivity, compiled=kernels_path.is_compiled(len(connectivity)))


@pytest.mark.usefixtures("path")
@pytest.mark.parametrize("name", DECIDED)
def test_laws_of_the_verdict_on_both_paths(name: str) -> None:
    """What holds for the bounds holds for the verdict alone: rotation, unit of length, reflection, NaN, no cells."""
    points, connectivity, result = sample(name)
    expected = result.status
    assert set(np.unique(expected)) == {Validity.VALID, Validity.INVALID}
    assert np.array_equal(verdicts(name, points, connectivity), expected)
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    assert np.array_equal(verdicts(name, points @ rotation.T + 2.0, connectivity), expected)
    for scale in (2.0**-660, 2.0**-400, 2.0**500, 2.0**1000):
        assert np.array_equal(verdicts(name, points * scale, connectivity), expected)
    mirrored = verdicts(name, points * (1, 1, -1), connectivity)
    assert (mirrored[expected == Validity.VALID] == Validity.INVALID).all()
    spoiled = points.copy()
    spoiled[connectivity[:2, 1], (0, 2)] = (np.nan, np.inf)
    assert (verdicts(name, spoiled, connectivity)[:2] == Validity.UNDEFINED).all()
    assert np.array_equal(verdicts(name, spoiled, connectivity)[2:], expected[2:])
    assert len(verdicts(name, points, connectivity[:0])) == 0
