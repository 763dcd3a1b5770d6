"""Which of two results is better, and what is refused at the door."""

from __future__ import annotations

import dataclasses
import io

import numpy as np
import pytest
from repair_meshes import shaken
from rich.console import Console

import meshgauge
from meshgauge import Quality, Status, measure
from meshgauge.repair.acceptance import is_better, n_unusable
from meshgauge.repair.report import losses
from meshgauge.repair.text import ROUNDING, cost, verdict_line

BEFORE = measure(shaken("hexahedron", 2, 0.0))
REPORT = meshgauge.improve(shaken("hexahedron", 2, 0.2), everywhere=True).report


def of(values: list[float], n_inverted: int = 0) -> Quality:
    """Eight cells of these values, the last ones repeated; the first are inverted."""
    every = np.array(values + values[-1:] * (BEFORE.n_cells - len(values)))
    status = np.full(BEFORE.n_cells, Status.OK, np.uint8)
    status[:n_inverted] = Status.INVERTED
    return Quality(BEFORE.mesh, every, status, {"jens": every})


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (of([0.1, 0.2]), of([-0.1, 0.9], 1), True),  # fewer unusable cells, whatever the rest
        (of([-0.1, 0.9], 1), of([0.1, 0.2]), False),
        (of([0.3, 0.4]), of([0.2, 0.9]), True),  # a better worst, whatever the mean
        (of([0.2, 0.9]), of([0.3, 0.4]), False),
        (of([0.3, 0.5]), of([0.3, 0.4]), True),  # an equal worst: the mean
        (of([0.3, 0.4]), of([0.3, 0.5]), False),
        (of([0.3, 0.4]), of([0.3, 0.4]), False),
    ],
)
def test_which_result_is_better(one: Quality, other: Quality, expected: bool) -> None:
    assert is_better(one, other) == expected


def test_cells_that_are_of_no_use_are_counted() -> None:
    assert n_unusable(of([0.5])) == 0
    assert n_unusable(of([-0.5, -0.5, 0.5], 2)) == 2


@pytest.mark.parametrize(
    "options", [{"floor": 0.0}, {"floor": 1.0}, {"target": 0.999}, {"target": 0.0}, {"seconds": 1e3}]
)
def test_options_at_their_ends_are_taken(options: dict[str, float]) -> None:
    assert meshgauge.improve(shaken("hexahedron", 2, 0.2), everywhere=True, **options).report.holds  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options", [{"floor": -1e-9}, {"floor": 1.01}, {"target": -1e-9}, {"target": 1.0}, {"seconds": 0}]
)
def test_options_beyond_their_ends_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(meshgauge.MeshError, match=next(iter(options))):
        meshgauge.improve(shaken("hexahedron", 2, 0.2), everywhere=True, **options)  # type: ignore[arg-type]


def test_cells_that_lost_are_the_ones_named() -> None:
    assert losses(of([0.5]), of([0.5])) == (0, (), 0.0, 0.0)
    n, cells, largest, mean = losses(of([0.5, 0.5, 0.5]), of([0.4, 0.6, 0.2, 0.5]))
    assert (n, [cell.cell for cell in cells]) == (2, [2, 0])
    assert (largest, mean) == (pytest.approx(0.3), pytest.approx(0.2))


@pytest.mark.parametrize(
    ("outcome", "n_below", "mark"), [("improved", 0, "✓"), ("improved", 3, "!"), ("refused", 0, "✗")]
)
def test_the_mark_of_the_verdict(outcome: str, n_below: int, mark: str) -> None:
    assert REPORT.after.all.n_invalid == 0
    out = io.StringIO()
    Console(file=out, width=200).print(verdict_line(dataclasses.replace(REPORT, outcome=outcome, n_below=n_below)))
    assert out.getvalue().split()[0] == mark


@pytest.mark.parametrize(
    ("volume", "surface", "lines"),
    [
        ((2.0, 2.0), (8.0, 8.0), ["volume 2 (unchanged)", "surface 8 (unchanged)"]),
        ((2.0, 2.1), (8.0, 7.2), ["volume 2.1 (+5 %)", "surface 7.2 (-10 %)"]),
        ((1e9, 1e9 + 1e9 * ROUNDING), (8.0, 8.0), ["volume 1e+09 (unchanged)", "surface 8 (unchanged)"]),
        ((0.0, 0.0), (8.0, 4.0), ["surface 4 (-50 %)"]),  # surface cells have no volume
    ],
)
def test_what_became_of_volume_and_surface(
    volume: tuple[float, float], surface: tuple[float, float], lines: list[str]
) -> None:
    report = dataclasses.replace(REPORT, volume=volume, surface=surface)
    out = io.StringIO()
    Console(file=out, width=200).print(*cost(report), sep="\n")
    text = [line.strip(" -") for line in out.getvalue().splitlines()]
    assert [line for line in text if line.startswith(("volume", "surface"))] == lines
