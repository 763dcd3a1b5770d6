"""Meshes of polyhedra that are read slice by slice: the report of the whole, whatever keeps them."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from polyhedra_files import stream_of, write_vtu
from slice_meshes import boxes, spoiled, write_raw_vtu

import meshgauge
from meshgauge import Mesh, io
from meshgauge.errors import ReadError
from meshgauge.io.plumbing import made_cells
from meshgauge.io.plumbing.pieces import Pieces, ReadWhole
from meshgauge.kernels import path as kernels_path
from meshgauge.report import FileReport
from meshgauge.report.json import dumps
from meshgauge.report.stream import report_on

METRICS = ("jens", "scaled_jacobian")

MEMORY = {"whole": 1 << 30, "blocks": 1 << 17, "ids": 1, "close": 1}
"""Bytes for points: all of them, blocks, only those of a slice, all between the first and the last of a slice."""

FILES: dict[str, Callable[[Path, Mesh], Any]] = {
    "old.vtu": lambda path, mesh: write_vtu(path, mesh, is_old=True),
    "old packed.vtu": lambda path, mesh: write_vtu(path, mesh, is_old=True, packed=True),
    "new.vtu": lambda path, mesh: write_vtu(path, mesh, is_old=False),
    "new packed.vtu": lambda path, mesh: write_vtu(path, mesh, is_old=False, packed=True),
    "ours.vtu": io.write,
    "ours.vtkhdf": io.write,
}

MESHES: dict[str, Callable[[], Mesh]] = {"plain": boxes, "spoiled": lambda: spoiled(boxes())}


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels measure them all, as they do large meshes; few cells are made at a time."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0)
    monkeypatch.setattr(made_cells, "BLOCK", 16)
    monkeypatch.setattr(made_cells, "SPAN", 64)
    monkeypatch.setattr("meshgauge.report.diagnosis.CELLS", 61)
    monkeypatch.setattr("meshgauge.slices.points.BLOCK", 64)
    monkeypatch.setattr("meshgauge.slices.points.SHIFT", 6)


def written(folder: Path, kind: str, mesh: Mesh) -> Path:
    path = folder / kind
    FILES[kind](path, mesh.replace(cell_data={"material": np.arange(mesh.n_cells) % 3}))
    return path


def pieces_of(path: Path) -> Pieces:
    pieces = io.pieces(path)
    assert pieces is not None
    return pieces


def whole(path: Path, **how: Any) -> FileReport:
    quality = meshgauge.measure(io.read(path), metrics=METRICS)
    return FileReport.of(quality, path=str(path), by_region=True, **how)


def streamed(path: Path, memory: int = 1 << 30, **how: Any) -> FileReport:
    how = {"metrics": METRICS, "by_region": True, "memory": memory, "size": 50, **how}
    return report_on(pieces_of(path), path=str(path), **how)


def plain(report: FileReport) -> dict[str, Any]:
    """What JSON holds of a report, but for the notes."""
    every: dict[str, Any] = json.loads(dumps([report]))
    del every["files"][0]["notes"]
    return every


def assert_same(made: FileReport, expected: FileReport) -> None:
    assert plain(made) == plain(expected)
    assert made.summary == expected.summary
    assert made.regions == expected.regions


@cache
def of_mesh(mesh: str, *, with_diagnosis: bool) -> FileReport:
    made = MESHES[mesh]()
    made = made.replace(cell_data={"material": np.arange(made.n_cells) % 3})
    quality = meshgauge.measure(made, metrics=METRICS)
    return FileReport.of(quality, by_region=True, with_diagnosis=with_diagnosis)


@pytest.mark.parametrize(
    ("kind", "mesh", "memory"),
    [(kind, "spoiled", "whole") for kind in FILES]
    + [(kind, "plain", memory) for kind in ("old.vtu", "new packed.vtu") for memory in MEMORY],
)
def test_the_report_is_that_of_the_whole(
    kind: str, mesh: str, memory: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("meshgauge.slices.points.CLOSE", 0 if memory == "close" else 1 << 40)
    path = written(tmp_path, kind, MESHES[mesh]())
    is_diagnosed = memory == "whole"  # it takes more than others allow
    made = streamed(path, MEMORY[memory], with_diagnosis=is_diagnosed)
    assert_same(made, replace(of_mesh(mesh, with_diagnosis=is_diagnosed), path=str(path)))
    assert len(made.regions) == 3


@pytest.mark.parametrize("kind", FILES)
def test_the_whole_is_what_was_written(kind: str, tmp_path: Path) -> None:
    mesh = MESHES["spoiled"]()
    made = io.read(written(tmp_path, kind, mesh))
    assert mesh.polyhedra is not None
    assert made.polyhedra is not None
    for name in ("points", "types", "offsets", "connectivity"):
        assert np.array_equal(getattr(made, name), getattr(mesh, name))
    for name in ("cell_offsets", "cell_faces", "face_offsets", "face_points"):
        assert np.array_equal(getattr(made.polyhedra, name), getattr(mesh.polyhedra, name))


@pytest.mark.parametrize("size", [13, 48, 100_000])
def test_any_size_of_slice_gives_the_same(size: int, tmp_path: Path) -> None:
    path = written(tmp_path, "old.vtu", spoiled(boxes(4)))
    assert_same(streamed(path, size=size), whole(path))


@pytest.mark.long
def test_processes_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # in processes of their own few cells are those that are few everywhere
    path = written(tmp_path, "old.vtu", boxes())
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert_same(streamed(path, executor=pool, size=100), whole(path))


def test_every_row_of_a_stream(tmp_path: Path) -> None:
    """Any rows of the arrays are those of the arrays as a whole, also none, and those of one cell."""
    path = written(tmp_path, "old.vtu", spoiled(boxes(4)))
    expected = io.read(path).polyhedra
    assert expected is not None
    polyhedra = pieces_of(path).pieces[0].polyhedra
    assert polyhedra is not None
    rng = np.random.default_rng(0)
    for key, rows in polyhedra.items():
        values = getattr(expected, key)
        assert rows.shape == values.shape
        n = len(values)
        for start, stop in [(0, n), (0, 0), (n, n), (n - 1, n), *np.sort(rng.integers(0, n + 1, (40, 2))).tolist()]:
            assert np.array_equal(rows.read(start, stop), values[start:stop]), (key, start, stop)


def test_parts_of_which_some_have_no_polyhedra(tmp_path: Path) -> None:
    mesh = boxes(4)
    parts = [mesh[:20], mesh[np.flatnonzero(mesh.types == 12)], mesh[20:]]
    for number, part in enumerate(parts):
        write_raw_vtu(tmp_path / f"part_{number}.vtu", part.replace(polyhedra=part.polyhedra if number != 1 else None))
    path = tmp_path / "a.pvtu"
    items = "".join(f'<Piece Source="part_{number}.vtu"/>' for number in range(3))
    path.write_text(
        f'<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian"><PUnstructuredGrid GhostLevel="0">'
        f"{items}</PUnstructuredGrid></VTKFile>"
    )
    assert_same(streamed(path, with_diagnosis=True), whole(path, with_diagnosis=True))


def test_shared_faces(tmp_path: Path) -> None:
    """As the arrays allow since VTK 9.4: that of two cells stands there once."""
    mesh = boxes(4)
    assert mesh.polyhedra is not None
    rings = mesh.polyhedra.face_points.reshape(-1, 4)
    _, first, which = np.unique(np.sort(rings, axis=1), axis=0, return_index=True, return_inverse=True)
    shared = replace(
        mesh.polyhedra,
        cell_faces=which.reshape(-1),
        face_offsets=4 * np.arange(len(first) + 1),
        face_points=rings[first].reshape(-1),
    )
    path = tmp_path / "a.vtu"
    write_vtu(path, mesh.replace(polyhedra=shared), is_old=False)
    assert_same(streamed(path, size=100, with_diagnosis=True), whole(path, with_diagnosis=True))


@pytest.mark.parametrize("what", ["a count", "a size", "an end", "a stream that is too short"])
def test_what_does_not_fit(what: str, tmp_path: Path) -> None:
    """Never a number: the whole says what is wrong with it, or a line here."""
    mesh = boxes(4)
    stream, ends = stream_of(mesh)
    if what == "a count":
        stream[0] = 900
    if what == "a size":
        stream[1] = 5
    if what == "an end":
        ends[3] = 5
    if what == "a stream that is too short":
        stream = stream[:-1]
    path = tmp_path / "a.vtu"
    write_vtu(path, mesh, is_old=True, faces=[("faces", "Int64", stream), ("faceoffsets", "Int64", ends)])
    with pytest.raises((ReadError, ReadWhole), match=r"do not fit|not in the order"):
        streamed(path)


def test_faces_far_from_one_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those inside first and those at the boundary behind them; where all are in no order it is read whole."""
    mesh = boxes(7)
    poly = mesh.polyhedra
    assert poly is not None
    rings = poly.face_points.reshape(-1, 4)
    _, which, counts = np.unique(np.sort(rings, axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(counts[which.reshape(-1)] == 1, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    path = tmp_path / "a.vtu"
    apart = replace(poly, cell_faces=rank[poly.cell_faces], face_points=rings[order].reshape(-1))
    write_vtu(path, mesh.replace(polyhedra=apart), is_old=False)
    monkeypatch.setattr("meshgauge.io.plumbing.some_rows.FAR", 3)
    monkeypatch.setattr("meshgauge.io.plumbing.some_rows.WINDOW", 100)
    assert_same(streamed(path, with_diagnosis=True), whole(path, with_diagnosis=True))
    monkeypatch.setattr("meshgauge.slices.read.SPREAD", 0)
    with pytest.raises(ReadWhole, match="spread over the file"):
        streamed(path)
