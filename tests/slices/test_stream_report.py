"""A report that was made slice by slice is that of the whole, to the last bit."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slice_meshes import boxes, garden, spoiled, write_packed_hdf, write_parallel, write_parts, write_raw_vtu
from thinned import quick

import meshgauge
from meshgauge import Mesh, io
from meshgauge.cells import IS_SOLID
from meshgauge.doctor.inward import InwardEntries
from meshgauge.doctor.streamed import MarkCounter
from meshgauge.errors import MeshgaugeError, ReadError
from meshgauge.io.plumbing import wedge_order
from meshgauge.io.plumbing.pieces import Pieces, ReadWhole
from meshgauge.kernels import path as kernels_path
from meshgauge.quality.measure import Quality
from meshgauge.report import FileReport
from meshgauge.report.json import report_dict
from meshgauge.report.stream import job_of, report_on
from meshgauge.slices import Ask, facts, measure_pieces
from meshgauge.slices.job import Lowest
from meshgauge.slices.points import Points
from meshgauge.slices.read import places

ALL = tuple(name for name, row in meshgauge.METRICS.items() if row.in_slices and row.of_faces is None)
"""All that can be measured in slices."""

METRICS = ("jens", "jens_mean", "edge_ratio")

pytestmark = pytest.mark.usefixtures("readers_here")

MEMORY = {"whole": 1 << 30, "blocks": 1 << 20, "ids": 1, "close": 1}
"""Bytes for points: all of them, blocks, only those of a slice, all between the first and the last of a slice."""


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hexahedra and tetrahedra are many, other types few; blocks of points are small."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)


def pieces_of(path: Path) -> Pieces:
    pieces = io.pieces(path)
    assert pieces is not None
    return pieces


def plain(report: FileReport) -> dict[str, Any]:
    """What JSON holds of a report, but for the notes."""
    every = json.loads(json.dumps(report_dict([report])))
    del every["files"][0]["notes"]
    return every


def assert_same(made: FileReport, expected: FileReport) -> None:
    """To the last bit, also of what JSON rounds: sums."""
    assert plain(made) == plain(expected)
    assert made.summary == expected.summary
    assert made.others == expected.others
    assert made.regions == expected.regions
    assert made.region_companions == expected.region_companions


def whole(path: Path, metrics: Sequence[str] = METRICS, **how: Any) -> FileReport:
    mesh = io.read(path, wedge_order=how.pop("wedge_order", "auto"))
    quality = meshgauge.measure(mesh, metrics=metrics, keep_bricks=how.pop("keep_bricks", False))
    return FileReport.of(quality, path=str(path), by_region=True, **how)


def streamed(path: Path, memory: int = 1 << 30, size: int = 97, **how: Any) -> FileReport:
    how = {"metrics": METRICS, "by_region": True, "memory": memory, "size": size, **how}
    return report_on(pieces_of(path), path=str(path), **how)


@pytest.fixture(autouse=True)
def how_points_are_read(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first to the last of a slice where a test is about that, and nowhere else."""
    call = getattr(request.node, "callspec", None)
    asked = None if call is None else call.params.get("memory")
    if asked is not None:
        monkeypatch.setattr("meshgauge.slices.points.CLOSE", 0 if asked == "close" else 1 << 40)


def write(path: Path, mesh: Mesh, kind: str) -> Path:
    path = path / f"mesh{kind}"
    {".vtkhdf": io.write, ".vtu": io.write, ".raw.vtu": write_raw_vtu, ".gz.vtkhdf": write_packed_hdf}[kind](path, mesh)
    return path


KINDS = (".vtkhdf", ".gz.vtkhdf", ".vtu", ".raw.vtu")
PLACES = ((False, "whole"), (True, "blocks"), (True, "ids"), (True, "close"))


@pytest.mark.parametrize(
    ("kind", "shuffled", "memory"),
    quick(
        [(kind, *place) for kind in KINDS for place in PLACES],
        (".vtkhdf", True, "ids"),
        (".gz.vtkhdf", True, "blocks"),
        (".vtu", True, "blocks"),
        (".vtu", False, "whole"),
        (".raw.vtu", True, "ids"),
        (".vtkhdf", True, "close"),
    ),
)
def test_the_report_is_that_of_the_whole(
    tmp_path: Path, kind: str, shuffled: bool, memory: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("meshgauge.slices.points.SHIFT", 6)
    monkeypatch.setattr("meshgauge.slices.points.BLOCK", 64)
    path = write(tmp_path, garden(shuffled=shuffled), kind)
    expected, made = whole(path), streamed(path, MEMORY[memory])
    assert_same(made, expected)
    assert set(made.notes) == set(expected.notes)
    counts = made.summary.all
    assert min(counts.n_invalid, counts.n_degenerate, counts.n_unmeasured, len(made.findings[0].labels)) > 0
    assert len(made.regions) == 4
    assert None not in (made.worst[0].cell_label, made.worst[0].point_label)


@pytest.mark.parametrize("memory", ["whole", "close"])
def test_the_diagnosis_is_that_of_the_whole(tmp_path: Path, memory: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.report.diagnosis.CELLS", 61)
    path = write(tmp_path, garden(), ".vtkhdf")
    made = streamed(path, MEMORY["whole"], with_diagnosis=True)
    assert made.diagnosis is not None
    assert made.diagnosis.findings
    assert_same(made, whole(path, with_diagnosis=True))


@pytest.mark.parametrize("name", ["plain", "spoiled"])
def test_the_diagnosis_of_polyhedra_is_that_of_the_whole(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("meshgauge.report.diagnosis.CELLS", 61)
    path = write(tmp_path, boxes(7) if name == "plain" else spoiled(boxes(7)), ".vtkhdf")
    made = streamed(path, with_diagnosis=True)
    assert_same(made, whole(path, with_diagnosis=True))
    assert made.diagnosis is not None
    assert len(made.diagnosis.findings) >= (5 if name == "spoiled" else 0)


def test_faces_that_point_inward_are_those_of_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.slices.points.CLOSE", 0)  # points of a slice from the first to the last
    path = write(tmp_path, spoiled(boxes(7)), ".vtkhdf")
    ask = Ask(counter=MarkCounter())
    marks = measure_pieces(job_of(pieces_of(path), ask), size=50, threads=1).counted
    expected = InwardEntries.of(io.read(path))
    for name in ("numbers", "leasts", "cells"):
        assert getattr(marks.inward, name).tolist() == getattr(expected, name).tolist()


def test_all_metrics_of_slices_are_those_of_the_whole(tmp_path: Path) -> None:
    assert len(ALL) > len(METRICS)
    path = write(tmp_path, garden(), ".vtkhdf")
    assert_same(streamed(path, metrics=ALL), whole(path, ALL))


@pytest.mark.parametrize("size", [13, 100_000])
def test_any_size_of_slice_gives_the_same(tmp_path: Path, size: int) -> None:
    path = write(tmp_path, garden(), ".vtkhdf")
    assert_same(streamed(path, size=size), whole(path))


@pytest.mark.parametrize("threads", [1, 2])
def test_any_number_of_threads_gives_the_same(tmp_path: Path, threads: int) -> None:
    path = write(tmp_path, garden(shuffled=True), ".vtkhdf")
    assert_same(streamed(path, threads=threads), whole(path))


def test_an_executor_gives_the_same(tmp_path: Path) -> None:
    path = write(tmp_path, garden(), ".vtu")
    with ThreadPoolExecutor(2) as pool:
        assert_same(streamed(path, executor=pool), whole(path))


def test_processes_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # in processes of their own few cells are those that are few everywhere
    path = write(tmp_path, garden(), ".vtu")
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert_same(streamed(path, executor=pool, size=500), whole(path))


@pytest.mark.parametrize("keep_bricks", [False, True])
def test_collapsed_bricks(tmp_path: Path, keep_bricks: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 8)  # fewer than all collapsed cells, more than those of a slice
    path = write(tmp_path, garden(), ".vtkhdf")
    assert_same(streamed(path, keep_bricks=keep_bricks), whole(path, keep_bricks=keep_bricks))


def test_single_precision(tmp_path: Path) -> None:
    path = write(tmp_path, garden(single=True), ".vtkhdf")
    assert_same(streamed(path), whole(path))


@pytest.mark.parametrize("memory", MEMORY)
def test_polyhedra(tmp_path: Path, memory: str) -> None:
    path = write(tmp_path, boxes(), ".vtkhdf")
    assert_same(streamed(path, MEMORY[memory]), whole(path))


@pytest.mark.parametrize("memory", quick(MEMORY, "blocks"))
def test_partitions_are_regions(tmp_path: Path, memory: str) -> None:
    path = tmp_path / "a.vtkhdf"
    parts = [garden(seed=1), garden(seed=2, shuffled=True), garden(seed=3)]
    parts = [m.replace(cell_data={k: v for k, v in m.cell_data.items() if k != "material"}) for m in parts]
    write_parts(path, parts)
    made = streamed(path, MEMORY[memory])
    assert_same(made, whole(path))
    assert [name for name, _ in made.regions] == ["partition 0", "partition 1", "partition 2"]


@pytest.mark.parametrize(
    ("with_regions", "memory"),
    quick([(regions, memory) for regions in (False, True) for memory in MEMORY], (False, "blocks"), (True, "ids")),
)
def test_files_of_pieces(tmp_path: Path, with_regions: bool, memory: str) -> None:
    path = tmp_path / "a.pvtu"
    kept = ("GlobalElementId", "vtkGhostType", "material" if with_regions else "interface")
    parts = [garden(seed=1), garden(seed=2, shuffled=True)]
    write_parallel(path, [m.replace(cell_data={k: m.cell_data[k] for k in kept}) for m in parts])
    made = streamed(path, MEMORY[memory])
    assert_same(made, whole(path))
    assert len(made.regions) == (4 if with_regions else 1)


@pytest.mark.parametrize("step", [1, 2])
def test_time_steps_of_a_collection(tmp_path: Path, step: int) -> None:
    files = {"a.vtu": garden(seed=1), "b.vtkhdf": garden(seed=2), "c.vtu": garden(seed=3)}
    kept = ("GlobalElementId", "vtkGhostType")
    for name, mesh in files.items():
        write = write_raw_vtu if name.endswith(".vtu") else io.write
        write(tmp_path / name, mesh.replace(cell_data={k: mesh.cell_data[k] for k in kept}))
    path = tmp_path / "run.pvd"
    sets = ('timestep="0" file="a.vtu"', 'timestep="1" part="0" file="b.vtkhdf"', 'timestep="1" part="1" file="c.vtu"')
    items = "".join(f"<DataSet {one}/>" for one in sets)
    path.write_text(f'<VTKFile type="Collection"><Collection>{items}</Collection></VTKFile>')
    pieces = io.pieces(path, step=step)
    assert pieces is not None
    made = report_on(pieces, path=str(path), metrics=METRICS, by_region=True, size=97)
    quality = meshgauge.measure(io.read(path, step=step), metrics=METRICS)
    assert_same(made, FileReport.of(quality, path=str(path), by_region=True))
    assert len(made.regions) == step


def test_steps_of_which_another_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "run.pvd"
    io.write(tmp_path / "a.vtu", garden())
    items = "".join(f'<DataSet timestep="{at}" file="{name}.vtu"/>' for at, name in enumerate("ab"))
    path.write_text(f'<VTKFile type="Collection"><Collection>{items}</Collection></VTKFile>')
    pieces = io.pieces(path, step=1)
    assert pieces is not None
    assert pieces.n_cells == garden().n_cells
    assert {Path(stamp[0]).name for stamp in pieces.stamps} == {"run.pvd", "a.vtu"}
    with pytest.raises(ReadError, match=r"refers to b\.vtu, which is missing"):
        io.pieces(path, step=2)


def test_pieces_that_differ_are_read_whole(tmp_path: Path) -> None:
    path, mesh = tmp_path / "a.pvtu", garden()
    write_parallel(path, [mesh, mesh.replace(cell_data={})])
    assert io.pieces(path) is None


@pytest.mark.parametrize(
    ("order", "turned"),
    quick(
        [(order, turned) for order in ("auto", "gmsh", "vtk-legacy") for turned in ("all", "none")],
        ("auto", "all"),
        ("auto", "none"),
        ("vtk-legacy", "all"),
    ),
)
def test_the_order_of_wedges_is_that_of_the_whole(tmp_path: Path, order: str, turned: str) -> None:
    mesh = garden()
    if turned == "all":
        ids = mesh.connectivity.copy()
        for first in mesh.offsets[:-1][mesh.types == 13]:
            ids[first : first + 6] = ids[first : first + 6][[0, 2, 1, 3, 5, 4]]
        mesh = mesh.replace(connectivity=ids)
    path = write(tmp_path, mesh, ".vtkhdf")
    expected, made = whole(path, wedge_order=order), streamed(path, wedge_order=order, size=50)
    assert_same(made, expected)
    assert [n for n in made.notes if "turned" in n] == [n for n in expected.notes if "turned" in n]


def test_wedges_that_their_neighbours_decide_are_read_whole(tmp_path: Path) -> None:
    mesh = garden()
    ids = mesh.connectivity.copy()
    for first in mesh.offsets[:-1][mesh.types == 12][::2]:
        ids[first : first + 8] = ids[first : first + 8][[4, 5, 6, 7, 0, 1, 2, 3]]
    path = write(tmp_path, mesh.replace(connectivity=ids), ".vtkhdf")
    with pytest.raises(ReadWhole, match="order of its wedges"):
        streamed(path)


def test_the_sample_of_signs_is_that_of_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wedge_order, "SAMPLE", 40)
    monkeypatch.setattr("meshgauge.slices.read.SIZE", 50)
    path = write(tmp_path, garden(shuffled=True), ".vtkhdf")
    signs: list[wedge_order.Signs] = []
    monkeypatch.setattr(facts, "decide", lambda total: signs.append(total) or wedge_order.Decision())
    streamed(path)
    assert signs == [wedge_order.signs_of(io.read(path, wedge_order="gmsh"))]


def test_the_regions_are_those_that_part_the_solid_cells(tmp_path: Path) -> None:
    mesh = garden()
    is_solid, n = IS_SOLID[mesh.types], mesh.n_cells
    data = {"material": np.where(is_solid, 3, 4 + np.arange(n) % 2), "zone": np.arange(n) % 3}
    path = write(tmp_path, mesh.replace(cell_data=data), ".vtkhdf")
    made = streamed(path)
    assert [name for name, _ in made.regions] == ["zone 0", "zone 1", "zone 2"]
    assert_same(made, whole(path))


def test_metrics_of_all_cells_at_once_are_read_whole(tmp_path: Path) -> None:
    path = write(tmp_path, garden(), ".vtkhdf")
    with pytest.raises(ReadWhole, match="metric verdict_condition takes all"):
        report_on(pieces_of(path), metrics=("jens", "verdict_condition"))


def test_a_file_that_changes_is_an_error(tmp_path: Path) -> None:
    path = write(tmp_path, garden(), ".vtkhdf")

    def touch(done: int, total: int) -> None:
        os.utime(path, ns=(done, done))

    with pytest.raises(ReadError, match="was changed while it was read"):
        streamed(path, progress=touch)


def test_nodes_are_looked_at_of_cells_that_may_be_the_worst(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To list the ten worst of each slice would take longer than to measure it."""
    path, looked_at = write(tmp_path, garden(), ".vtkhdf"), []
    worst_node = Quality.worst_node
    monkeypatch.setattr(Quality, "worst_node", lambda *of: looked_at.append(of) or worst_node(*of))
    made = streamed(path, size=20, threads=1)
    n_cells = len(looked_at)
    assert_same(made, whole(path))
    assert 10 <= n_cells < made.n_cells // 20 * 5  # of some, and not ten of each


def test_the_lowest_of_several_looks_are_the_lowest_of_all() -> None:
    lowest = Lowest()
    assert lowest.take([(0, 0.5, 1), (0, 0.5, 7)], 2) == 2
    assert lowest.take([(0, 0.5, 1), (0, 0.5, 7)], 2) == 2  # the same once more: a slice that was measured again
    assert lowest.take([(0, 0.5, 3), (1, 0.1, 9)], 2) == 1
    assert lowest.take([(0, 0.5, 4)], 2) == 0
    assert lowest.take([(0, -0.5, 99)], 2) == 1


def test_cells_are_covered_once(tmp_path: Path) -> None:
    path = write(tmp_path, garden(), ".vtkhdf")
    job = job_of(pieces_of(path), Ask())
    first, second, *_ = (job(place) for place in places(job.pieces, 100)[:3])
    with pytest.raises(MeshgaugeError, match="cells 0 to 99 were measured twice"):
        first.merge(second).merge(first)
    with pytest.raises(MeshgaugeError, match="only some were measured"):
        first.merge(second).check_covers(job.facts.n_cells)
    with pytest.raises(MeshgaugeError, match="different questions"):
        first.merge(replace(second, n_worst=3))


@pytest.mark.parametrize("memory", MEMORY)
def test_a_bad_id_names_the_place(tmp_path: Path, memory: str) -> None:
    mesh = garden()
    path = write(tmp_path, mesh, ".raw.vtu")
    data = bytearray(path.read_bytes())
    needle = mesh.connectivity[2000:2016].astype(np.int64).tobytes()
    at = data.index(needle)
    data[at : at + 8] = np.int64(1 << 40).tobytes()
    path.write_bytes(data)
    with pytest.raises(ReadError, match=r"cell \d+ .*point id 1099511627776 .*is outside"):
        streamed(path, MEMORY[memory])


@pytest.mark.parametrize("memory", MEMORY.values())
def test_points_of_ids(memory: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.slices.points.SHIFT", 3)
    monkeypatch.setattr("meshgauge.slices.points.BLOCK", 8)
    monkeypatch.setattr("meshgauge.slices.points.WINDOW", 50)
    path = write(tmp_path, garden(), ".vtkhdf")
    piece = pieces_of(path).pieces[0]
    points, mesh = Points(piece.points, memory), io.read(path)
    for ids in ([0], [5, 5, 3], [mesh.n_points - 1, 0], np.random.default_rng(0).integers(0, mesh.n_points, 300)):
        ids = np.asarray(ids, np.int64)
        xyz, local, origins = points.of(ids)
        np.testing.assert_array_equal(xyz[local], mesh.points[ids])
        np.testing.assert_array_equal(origins.all(len(xyz))[local], ids)
        assert [origins.of(int(at)) for at in local] == ids.tolist()
