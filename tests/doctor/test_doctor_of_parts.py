"""The diagnosis of a mesh of which every part was looked at apart is that of the whole mesh."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from streamed_meshes import MESHES, InMemory, assert_same, grid, hexahedra, of_shares
from test_doctor_streamed_polyhedra import SPOILED
from thinned import quick

import meshgauge
from meshgauge.doctor import Diagnosis, diagnosis
from meshgauge.doctor.inward import NONE
from meshgauge.doctor.streamed.marks import marks_of
from meshgauge.doctor.streamed.of_parts import Overlap
from meshgauge.doctor.streamed.open_cells import PartOf
from meshgauge.doctor.streamed.opening import open_cells_of
from meshgauge.quality.measure import Quality

OVERLAP = ("some twice", "some twice, reversed", "all three times", "four at a face", "surfaces")
"""Cells of one share lie inside of another: of the same points, or surfaces between its cells."""


@cache
def whole(name: str) -> tuple[Quality, Diagnosis]:
    quality = meshgauge.measure({**MESHES, **SPOILED}[name]())
    return quality, diagnosis(quality.mesh, quality)


@pytest.mark.filterwarnings("ignore:overflow encountered", "ignore:invalid value encountered")
@pytest.mark.parametrize("n", quick([1, 3], 3))
@pytest.mark.parametrize(
    "name", [*MESHES, *quick(SPOILED, "some twice, all", "some inward, mixed", "hanging, a third")]
)
def test_shares_are_the_whole(name: str, n: int) -> None:
    quality, expected = whole(name)
    if n == 3 and name.removesuffix(", all") in OVERLAP:
        with pytest.raises(Overlap):
            of_shares(quality, n)
        return
    assert_same(of_shares(quality, n), expected)


def test_many_shares_of_few_cells() -> None:
    """Points of two cells are so because of two shares."""
    quality, expected = whole("hanging")
    assert_same(of_shares(quality, 60), expected)


def test_what_is_kept_grows_with_the_surface() -> None:
    """Of 8 times the cells four times as many lie at the boundary."""
    kept = []
    for n in (12, 24):
        quality = meshgauge.measure(hexahedra(*grid(n)))
        made = open_cells_of(InMemory(quality, 1000), marks_of(quality), NONE, PartOf(), tolerance=1e-9)
        assert made.cells.n == n**3 - (n - 2) ** 3
        assert made.known.n == (n + 1) ** 3 - (n - 1) ** 3
        kept.append(made.n_bytes)
    assert kept[1] < 5 * kept[0]
    assert np.isfinite(kept).all()
