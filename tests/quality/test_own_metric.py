"""A metric of the user's own: measured, counted and reported as those of the table are."""

from __future__ import annotations

import io
import json
import threading
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console

import meshgauge
from meshgauge import MetricError
from meshgauge.cells import SHAPES
from meshgauge.mesh import Mesh, connectivity
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.metrics import Cells, Metric, PolyhedralCells, Standard
from meshgauge.report import FileReport
from meshgauge.report.csv import CsvWriter
from meshgauge.report.json import dumps
from meshgauge.report.text import other_metric

Floats = NDArray[np.float64]


def longest(cells: Cells) -> Floats:
    a, b = np.array(cells.shape.edges).T
    return np.asarray(np.linalg.norm(cells.coordinates[:, a] - cells.coordinates[:, b], axis=-1).max(axis=1))


def longest_of_polyhedra(cells: PolyhedralCells) -> Floats:
    """Of each cell; the faces tell its edges."""
    faces, worst, start = cells.faces, np.zeros(cells.n_cells), 0
    owner = np.repeat(np.arange(cells.n_cells), faces.counts)
    for cell, size in zip(owner, faces.sizes, strict=True):
        x = cells.points[faces.points[start : start + size]]
        worst[cell] = max(worst[cell], np.linalg.norm(x - np.roll(x, 1, axis=0), axis=1).max())
        start += size
    return worst


LONGEST = Metric(
    name="longest_edge",
    values=longest,
    polyhedra=longest_of_polyhedra,
    range=(0.0, inf),
    acceptable=(0.0, 1.5),
    better="lower",
    unit="length",
)


def height_of_centre(cells: Cells) -> Floats:
    return np.asarray(cells.coordinates[..., 2].mean(axis=1))


HEIGHT = Metric(name="height", values=height_of_centre, range=(-inf, inf), acceptable=(-1.0, 1.0), better="higher")


def mixed() -> Mesh:
    """One ideal cell of each shape, each as long again as the one before, and a triangle."""
    points: list[tuple[float, ...]] = []
    blocks: dict[str, list[list[int]]] = {}
    for n, shape in enumerate(SHAPES.values()):
        blocks[shape.name] = [list(range(len(points), len(points) + shape.n_nodes))]
        points += [tuple((n + 1.0) * c for c in x) for x in shape.points]
    return Mesh.from_arrays(points, {**blocks, "triangle": [[0, 1, 2]]})


def test_it_is_measured_by_name_beside_jens() -> None:
    quality = meshgauge.measure(mixed(), metrics=[LONGEST, "scaled_jacobian"])
    assert list(quality.metrics) == ["jens", "longest_edge", "scaled_jacobian"]
    np.testing.assert_allclose(quality.values_of("longest_edge"), [1, 2, 3, 4, 5, 6, nan])
    assert quality.cell_data()["longest_edge"] is quality.values_of("longest_edge")


def test_one_name_or_one_metric_may_stand_for_itself() -> None:
    mesh = mixed()
    assert list(meshgauge.measure(mesh, metrics="scaled_jacobian").metrics) == ["jens", "scaled_jacobian"]
    assert list(meshgauge.measure(mesh, metrics=LONGEST).metrics) == ["jens", "longest_edge"]
    assert list(meshgauge.measure(mesh, metrics=(LONGEST, "jens", LONGEST)).metrics) == ["jens", "longest_edge"]


def test_its_summary_counts_and_merges() -> None:
    mesh = mixed()
    quality = meshgauge.measure(mesh, metrics=LONGEST)
    summary = quality.summary("longest_edge")
    assert summary.metric == "longest_edge"
    assert (summary.all.n_good, summary.all.n_poor, summary.all.n_invalid, summary.all.n_degenerate) == (1, 5, 0, 0)
    assert summary.types["hexahedron"].max == pytest.approx(4)
    parts = [
        meshgauge.summarise(quality.values_of("longest_edge")[at], quality.status[at], mesh.types[at], LONGEST)
        for at in (slice(0, 3), slice(3, None))
    ]
    assert parts[0].merge(parts[1]) == summary


def test_the_status_says_what_is_invalid_and_the_row_whether_below_0_can_be_good() -> None:
    values, ok, types = np.array([-3.0, -0.5, 0.0, 0.5, 3.0]), np.zeros(5, np.uint8), np.full(5, 10, np.uint8)
    signed = Metric(
        name="height", values=height_of_centre, range=(-inf, inf), acceptable=(-1, 1), better="higher", is_signed=True
    )
    for metric, n_good in ((HEIGHT, 3), (signed, 2)):
        tally = meshgauge.summarise(values, ok, types, metric).all
        assert (tally.n_invalid, tally.n_degenerate, tally.n_good, tally.n_poor) == (0, 0, n_good, 5 - n_good)
        # Also where all are within the acceptable range, which is counted at once.
        assert meshgauge.summarise(values[1:2], ok[1:2], types[1:2], metric).all.n_good == n_good - 2
        inside_out = np.full(5, meshgauge.Status.INVERTED_INSIDE, np.uint8)
        all_invalid = meshgauge.summarise(values, inside_out, types, metric).all
        assert (all_invalid.n_invalid, all_invalid.n_good, all_invalid.n_poor) == (5, 0, 0)


def test_it_is_in_json_csv_and_text(tmp_path: Path) -> None:
    mesh = mixed()
    quality = meshgauge.measure(mesh, metrics=LONGEST)
    report = FileReport(
        path="mesh.vtu",
        n_points=mesh.n_points,
        n_cells=mesh.n_cells,
        summary=quality.summary(),
        others=(quality.summary("longest_edge"),),
    )
    stored = json.loads(dumps([report]))["files"][0]["other_metrics"][0]
    assert stored["metric"] == "longest_edge"
    assert stored["acceptable"] == [0, 1.5]
    assert stored["cell_types"]["hexahedron"]["max"] == pytest.approx(4)
    with CsvWriter(tmp_path / "cells.csv", tuple(quality.metrics), with_file=False) as table:
        table.add("mesh.vtu", mesh.types, quality.status, quality.metrics)
    lines = (tmp_path / "cells.csv").read_text().splitlines()
    assert lines[0] == "cell,cell_label,type,status,jens,longest_edge"
    assert lines[4].split(",")[1:5] == ["", "hexahedron", "ok", "1.0"]
    assert float(lines[4].split(",")[5]) == quality.values_of("longest_edge")[3]
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(*other_metric(quality.summary("longest_edge")))
    text = console.export_text()
    assert "longest_edge (usually acceptable: 0 to 1.5)" in text
    assert "hexahedron" in text


def test_polyhedra_have_a_value_where_the_metric_has_a_function_for_them() -> None:
    hexahedron = SHAPES["hexahedron"]
    points = np.concatenate([np.array(hexahedron.points) * scale for scale in (1, 3, 5)])
    n = len(hexahedron.faces)
    faces = np.array(hexahedron.faces)
    broken = np.concatenate([faces.reshape(-1), faces.reshape(-1) + 8, faces[:3].reshape(-1) + 16])
    polyhedra = Polyhedra(
        cell_offsets=np.array([0, n, 2 * n, 2 * n + 3]),
        cell_faces=np.arange(2 * n + 3),
        face_offsets=np.arange(0, 4 * (2 * n + 3) + 1, 4),
        face_points=broken,
    )
    mesh = Mesh(
        points=points,
        connectivity=np.arange(24),
        offsets=np.array([0, 8, 16, 24]),
        types=np.full(3, 42, np.uint8),
        polyhedra=polyhedra,
    )
    quality = meshgauge.measure(mesh, metrics=[LONGEST, HEIGHT])
    assert quality.polyhedra is not None
    np.testing.assert_allclose(quality.values_of("longest_edge"), [1, 3, nan])
    assert np.isnan(quality.values_of("height")).all()
    assert LONGEST.is_defined_for("polyhedron")
    assert not HEIGHT.is_defined_for("polyhedron")
    assert (LONGEST.cell_types, HEIGHT.cell_types) == ("all", "all but polyhedra")
    second = quality.polyhedra.part(slice(1, 2))
    assert second.cells.tolist() == [1]
    assert second.node_offsets.tolist() == [0, 8]
    assert second.node_points.tolist() == quality.polyhedra.node_points[8:16].tolist()


def test_a_cell_without_a_place_has_no_value() -> None:
    mesh = mixed()
    points = mesh.points.copy()
    points[0, 1] = inf
    assert np.isnan(meshgauge.measure(mesh.replace(points=points), metrics=LONGEST).values_of("longest_edge")[0])


def many_tetrahedra() -> Mesh:
    n = 2 * connectivity.CHUNK + 5
    return Mesh.from_arrays(SHAPES["tetra"].points, {"tetra": np.tile(np.arange(4), (n, 1))})


def test_its_function_is_called_with_slices_on_threads_and_with_one_cell_before() -> None:
    calls: list[tuple[int, bool]] = []

    def seen(cells: Cells) -> Floats:
        calls.append((cells.n_cells, threading.current_thread() is threading.main_thread()))
        return longest(cells)

    metric = Metric(name="seen", values=seen, range=(0, inf), acceptable=(0, 2), better="lower")
    values = meshgauge.measure(many_tetrahedra(), metrics=metric, threads=2).values_of("seen")
    np.testing.assert_allclose(values, 1.0)
    assert calls[0] == (1, True)
    assert sorted(calls[1:]) == [(5, False), (connectivity.CHUNK, False), (connectivity.CHUNK, False)]


def test_a_function_that_needs_all_cells_gets_them_in_one_call() -> None:
    calls: list[int] = []

    def share_of_all(cells: Cells) -> Floats:
        calls.append(cells.n_cells)
        return np.full(cells.n_cells, 1.0 / cells.n_cells)

    metric = Metric(name="share", values=share_of_all, range=(0, 1), acceptable=(0, 1), better="lower", in_slices=False)
    mesh = many_tetrahedra()
    assert meshgauge.measure(mesh, metrics=metric, threads=2).values_of("share")[0] == 1.0 / mesh.n_cells
    assert calls == [mesh.n_cells]


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (np.zeros(3), r"metric wrong: its function returned an array of shape \(3,\) for 1 cells, expected \(1,\)"),
        (np.zeros((1, 1)), r"an array of shape \(1, 1\)"),
        (0.5, r"an array of shape \(\)"),
        (None, r"an array of shape \(\)|no array of numbers"),
        ("abc", "its function returned no array of numbers"),
    ],
    ids=str,
)
def test_a_function_that_returns_something_else_is_an_error(returned: object, message: str) -> None:
    metric = Metric(name="wrong", values=lambda _: returned, range=(0, 1), acceptable=(0, 1), better="lower")  # type: ignore[arg-type, return-value]
    with pytest.raises(MetricError, match=message):
        meshgauge.measure(mixed(), metrics=metric)


def test_two_metrics_of_one_name_are_an_error() -> None:
    named_so = Metric(name="scaled_jacobian", values=longest, range=(0, inf), acceptable=(0, 1), better="lower")
    with pytest.raises(MetricError, match="metric 'scaled_jacobian': another metric has this name"):
        meshgauge.measure(mixed(), metrics=named_so)
    again = Metric(name="longest_edge", values=longest, range=(0, inf), acceptable=(0, 1), better="lower")
    with pytest.raises(MetricError, match="metric 'longest_edge': another metric has this name"):
        meshgauge.measure(mixed(), metrics=[LONGEST, again])
    with pytest.raises(MetricError, match="no metric 'beauty'"):
        meshgauge.measure(mixed(), metrics="beauty")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "longest edge"}, "a metric is named 'longest edge', expected an identifier"),
        ({"acceptable": (2, 1)}, "metric edge: acceptable is"),
        ({"acceptable": (-1, 1)}, r"expected ascending, within \(0, 10\)"),
        ({"per_shape": {"tetra": Standard(1, (5, 11))}}, r"metric edge: acceptable is \(5, 11\)"),
    ],
    ids=str,
)
def test_a_row_that_cannot_be_is_an_error(change: dict[str, object], message: str) -> None:
    row: dict[str, object] = {"name": "edge", "values": longest, "range": (0, 10), "acceptable": (0, 5)}
    with pytest.raises(MetricError, match=message):
        Metric(better="lower", **{**row, **change})  # type: ignore[arg-type]


def test_acceptable_may_be_one_value_at_an_end_of_the_range() -> None:
    for value in (0.0, 10.0):
        row = Metric(name="edge", values=longest, range=(0, 10), acceptable=(value, value), better="lower")
        assert row.acceptable == (value, value)
