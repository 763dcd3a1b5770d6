"""The compiled kernels on few cells, where the public functions would do without: with the JIT on, and off in CI."""

from __future__ import annotations

import numpy as np
import oracle
import pytest

import meshgauge
from meshgauge.cells import BY_NAME, SHAPES
from meshgauge.kernels import path
from meshgauge.kernels.cells import driver
from meshgauge.kernels.certificate.bounds import Validity, bounds
from meshgauge.kernels.certificate.numpy_path import can_decide, validity

N = 130  # two blocks and a bit


def random_nodes(name: str, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    ideal = np.array(SHAPES[name].points, float)
    return ideal + rng.normal(0, 0.25, (N, *ideal.shape))


def special(name: str) -> np.ndarray:
    """Cells that the fast path must leave to the robust one, between ones that it need not."""
    nodes = random_nodes(name, 1)
    nodes[3] *= 1e-200
    nodes[7] *= 1e300
    nodes[11, :, 1] = 0.5  # flat
    nodes[17, 1] = nodes[17, 0]  # an edge of no length
    nodes[23, 2, 0] = np.nan
    nodes[29, 0, 1] = np.inf
    nodes[31] = np.round(nodes[31] * 4) / 4  # corners may be exactly flat
    nodes[64] = 1.0  # all in one point
    for cell, short, long in ((70, 1e-160, 1e80), (71, 1e-170, 1e150), (72, 1e-150, 1e75), (74, 1e-160, 1e40)):
        nodes[cell] *= long
        nodes[cell, 0] = 0.0
        nodes[cell, 1] = (short, short / 3, -short / 7)  # its square has lost bits
    # Two such edges opposite each other, so that the products of three squares are of ordinary size.
    nodes[73] = 0.0
    nodes[73, 1] = (1e-159, 0, 0)
    nodes[73, 2:] = (0, 0, 1e80)
    nodes[73, 3] += (0, 1e-159 / 3, 0)
    return nodes


def cell_values(name: str, nodes: np.ndarray, dtype: type = np.float64) -> np.ndarray:
    points = np.ascontiguousarray(nodes.reshape(-1, 3), dtype)
    cells = np.arange(len(points)).reshape(nodes.shape[:2])
    out = np.full(len(nodes), 9.0)
    with np.errstate(all="ignore"):  # with the JIT off NumPy's scalars warn where compiled code goes on
        driver.cell_jens(points, cells, BY_NAME[name], out, compiled=True)
    return out


def node_values(name: str, nodes: np.ndarray, *, compiled: bool = True) -> np.ndarray:
    points = np.ascontiguousarray(nodes.reshape(-1, 3))
    cells = np.arange(len(points)).reshape(nodes.shape[:2])
    out = np.full(cells.shape, 9.0)
    with np.errstate(all="ignore"):
        driver.node_scaled_jacobian(points, cells, BY_NAME[name], out, compiled=compiled)
    return out


@pytest.mark.parametrize("name", SHAPES)
def test_cell_kernels_against_the_oracle(name: str) -> None:
    nodes = random_nodes(name)
    np.testing.assert_allclose(cell_values(name, nodes), oracle.cell_jens(name, nodes), rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", SHAPES)
def test_cell_kernels_leave_no_special_value_wrong(name: str) -> None:
    nodes = special(name)
    expected = np.array([oracle.exact_cell_jens(name, cell) for cell in nodes])
    got = cell_values(name, nodes)
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-14)
    np.testing.assert_array_equal(np.sign(got), np.sign(expected))
    assert not np.signbit(got[got == 0]).any()


@pytest.mark.parametrize("name", SHAPES)
def test_cell_kernels_take_float32(name: str) -> None:
    nodes = random_nodes(name, 2).astype(np.float32)
    wide = nodes.astype(np.float64)
    np.testing.assert_allclose(cell_values(name, nodes, np.float32), cell_values(name, wide), rtol=0, atol=1e-15)


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("name", SHAPES)
def test_node_values_against_the_oracle(name: str, compiled: bool) -> None:
    nodes = special(name)
    out = node_values(name, nodes, compiled=compiled)
    expected = np.array([oracle.exact_node_scaled_jacobian(name, cell) for cell in nodes])
    np.testing.assert_allclose(out, expected, rtol=1e-9, atol=1e-14)


def near_flat_tetrahedra(n: int) -> np.ndarray:
    """Points on a common plane up to rounding, far from and near to the origin: J_S of 1e-17 to 1e-13, either sign."""
    rng = np.random.default_rng(4)
    nodes = rng.random((n, 4, 3)) + rng.choice([0.0, 1.0, 100.0], n)[:, None, None]
    weights = rng.dirichlet((1, 1, 1), n)
    nodes[:, 3] = np.einsum("nk,nkx->nx", weights, nodes[:, :3])
    return nodes


def test_the_sign_of_a_flat_cell_is_exact_on_the_compiled_path() -> None:
    """More cells than NumPy takes, so that the limit itself sends them to the kernels; each sign in rational numbers.

    A kernel that trusts the rounded determinant a little too far gets a few of them wrong.
    """
    nodes = near_flat_tetrahedra(path.NUMPY_UP_TO + 5000)
    assert path.is_compiled(len(nodes))
    values = meshgauge.jens(nodes.reshape(-1, 3), np.arange(4 * len(nodes)).reshape(-1, 4), "tetra")
    exact = [oracle.exact_volume_sign(cell) for cell in nodes]
    assert {-1, 0, 1} >= set(exact) >= {-1, 1}
    np.testing.assert_array_equal(np.sign(values), exact)


def test_the_sign_of_a_flat_cell_is_exact_without_kernels() -> None:
    nodes = near_flat_tetrahedra(300)
    values = node_values("tetra", nodes, compiled=False)
    exact = np.array([oracle.exact_volume_sign(cell) for cell in nodes])
    np.testing.assert_array_equal(np.sign(values), np.broadcast_to(exact[:, None], values.shape))


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("name", SHAPES)
def test_no_node_exceeds_one(name: str, compiled: bool) -> None:
    """Turned cells with right angles: rounding lifts the quotient above 1, and J_ENS would be told from a wrong J_S."""
    rng = np.random.default_rng(5)
    turned = np.linalg.qr(rng.normal(size=(500, 3, 3)))[0]
    turned[np.linalg.det(turned) < 0, 0] *= -1
    corner = np.eye(4, 3, k=-1)  # a corner of a cube
    cells = np.einsum("pxy,ny->pnx", turned, corner)
    out = node_values("tetra", np.concatenate([cells, cells[:, [0, 2, 1, 3]]]), compiled=compiled)
    assert np.abs(out).max() == 1.0
    assert (np.abs(out[:, 0]) > 1 - 1e-15).all()
    if name != "tetra":
        ideal = np.einsum("pxy,ny->pnx", turned, np.array(SHAPES[name].points))
        assert np.abs(node_values(name, ideal, compiled=compiled)).max() <= 1.0


@pytest.mark.parametrize("name", ["tetra", "pyramid", "wedge", "hexahedron"])
@pytest.mark.parametrize("n", [0, 1, 3, 7, 8, 9, 63, 64, 65, 129])
def test_any_number_of_cells(n: int, name: str) -> None:
    """To the last bit: kernels take eight at once, and the last ones with those before them, or again and again."""
    nodes = random_nodes(name)
    np.testing.assert_array_equal(cell_values(name, nodes[:n]), cell_values(name, nodes)[:n])


@pytest.mark.parametrize("name", ["tetra", "pyramid", "wedge", "hexahedron"])
@pytest.mark.parametrize("n", [3, 130])
def test_an_id_of_no_point_is_found_wherever_it_stands(n: int, name: str) -> None:
    nodes = random_nodes(name)[:n]
    points = nodes.reshape(-1, 3)
    for cell in {0, 7, 8, 63, 64, 71, 127, 128, 129} & set(range(n)) | {n - 1}:
        for wrong in (-1, len(points), 1 << 62):
            cells = np.arange(len(points)).reshape(nodes.shape[:2])
            cells[cell, cell % nodes.shape[1]] = wrong
            with pytest.raises(IndexError):
                driver.cell_jens(points, cells, BY_NAME[name], np.empty(n), compiled=True)


@pytest.mark.parametrize("name", [name for name in SHAPES if can_decide(BY_NAME[name])])
def test_few_cells_get_the_verdict_of_the_certificate(name: str) -> None:
    nodes = special(name)
    cells = np.arange(nodes.shape[0] * nodes.shape[1]).reshape(len(nodes), -1)
    with np.errstate(all="ignore"):
        proved = bounds(name, nodes.reshape(-1, 3), cells).status
    found = validity(name, nodes)
    np.testing.assert_array_equal(found, proved)
    assert {Validity.VALID, Validity.INVALID, Validity.UNDEFINED} <= set(found.tolist())
