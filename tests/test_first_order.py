"""The finite elements of ``benchmarks/first_order.py``, on which docs/meaning.md stands."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
TYPES = ("tetra", "pyramid", "wedge", "hexahedron")

types = pytest.mark.parametrize("name", TYPES)


@pytest.fixture
def first_order(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    pytest.importorskip("scipy")
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("first_order")


def moved(first_order: ModuleType, name: str, n: int = 5) -> np.ndarray:
    ideal = first_order.ideal(name)
    return ideal + 0.15 * np.random.default_rng(0).uniform(-1.0, 1.0, (n, *ideal.shape))


@types
def test_linear_functions_are_exact_and_their_energy_is_that_of_the_volume(first_order: ModuleType, name: str) -> None:
    x = moved(first_order, name)
    cells = first_order.Cells.of(name, x)
    assert np.einsum("mqia,mib->mqab", cells.gradients, x) == pytest.approx(
        np.broadcast_to(np.eye(3), (*cells.gradients.shape[:2], 3, 3)), abs=1e-12
    )
    poisson, elastic = cells.stiffness()
    assert np.einsum("mia,mij,mjb->mab", x, poisson, x) == pytest.approx(
        cells.volumes[:, None, None] * np.eye(3), abs=1e-13
    )
    stretch = x.reshape(len(x), -1)  # displacement x: strain 1, energy 3 (3 λ + 2 μ) V
    energy = np.einsum("mi,mij,mj->m", stretch, elastic, stretch)
    assert energy == pytest.approx(3.0 * (3.0 * first_order.LAMBDA + 2.0 * first_order.MU) * cells.volumes)
    turn = np.cross([0.3, -0.5, 0.8], x).reshape(len(x), -1)
    assert np.abs(elastic @ turn[:, :, None]).max() < 1e-13  # a rotation costs nothing


@types
def test_costs_do_not_depend_on_size_place_or_direction_and_the_ideal_cell_has_one(
    first_order: ModuleType, name: str
) -> None:
    x = moved(first_order, name)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    before = first_order.cell_losses(name, x)
    after = first_order.cell_losses(name, 7.0 * x @ (turn * np.sign(np.linalg.det(turn))) + 3.0)
    assert list(before) == list(first_order.LOSSES)
    for loss, values in before.items():
        assert after[loss] == pytest.approx(values), loss
        assert first_order.cell_losses(name, first_order.ideal(name)[None])[loss] == pytest.approx([1.0])


@types
@pytest.mark.parametrize("library", ["skfem", "ngsolve"])
def test_matrices_are_those_of_other_libraries(
    first_order: ModuleType, monkeypatch: pytest.MonkeyPatch, name: str, library: str
) -> None:
    pytest.importorskip(library)
    if (library, name) == ("skfem", "pyramid"):
        pytest.skip("scikit-fem has no pyramid")
    found = import_module("first_order_check").difference(library, name, 1)
    assert max(found) < (1e-9 if name == "pyramid" else 1e-12)
