"""Meshes of surfaces in slices, in shares and in parts: what comes of it is that of the whole."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from slice_meshes import garden
from surface_meshes import SURFACES, surface
from thinned import quick

import meshgauge
from meshgauge import io
from meshgauge.cli.main import main
from meshgauge.errors import MeshgaugeError
from meshgauge.kernels import path as kernels_path
from meshgauge.report import FileReport
from meshgauge.report.json import report_dict
from meshgauge.report.stream import report_on

METRICS = ("jens", "edge_ratio", "jens_mean")

pytestmark = pytest.mark.usefixtures("readers_here")


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 60)


def plain(report: FileReport) -> object:
    return json.loads(json.dumps(report_dict([report])))


@pytest.mark.parametrize(
    ("name", "memory"),
    quick(
        [(name, memory) for name in SURFACES for memory in (1 << 30, 50_000_000)],
        ("from below", 50_000_000),
        ("all of it", 1 << 30),
        ("some are ghosts", 50_000_000),
    ),
)
def test_the_report_is_that_of_the_whole(tmp_path: Path, name: str, memory: int) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, SURFACES[name]())
    quality = meshgauge.measure(io.read(path), metrics=METRICS)
    expected = FileReport.of(quality, path=str(path), by_region=True, with_diagnosis=True)
    listed = io.pieces(path)
    assert listed is not None
    made = report_on(
        listed, path=str(path), metrics=METRICS, by_region=True, with_diagnosis=True, size=37, memory=memory
    )
    assert plain(made) == plain(expected)
    assert made.summary == expected.summary
    assert made.dimension == 2


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_other_cells_are_measured_where_that_is_asked(tmp_path: Path, dimension: int) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, garden() if dimension == 2 else surface(mirrored=True))
    quality = meshgauge.measure(io.read(path), dimension=dimension)
    listed = io.pieces(path)
    assert listed is not None
    made = report_on(listed, path=str(path), dimension=dimension, size=97, with_diagnosis=True)
    assert plain(made) == plain(FileReport.of(quality, path=str(path), with_diagnosis=True))


def test_shares_are_those_of_the_whole_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, surface(mirrored=True, turned=0.1))
    shares = [meshgauge.partial(path, share=(k, 3)) for k in (1, 2, 3)]
    assert {(one.dimension, one.up) for one in shares} == {(2, -1)}
    merged = meshgauge.merge(shares)
    assert merged.dimension == 2
    kernels_path.NUMPY_UP_TO, before = 0, kernels_path.NUMPY_UP_TO  # shares are measured as if cells were many
    try:
        expected = meshgauge.measure(io.read(path)).summary()
    finally:
        kernels_path.NUMPY_UP_TO = before
    assert merged.summary == expected
    out = tmp_path / "p.mgp"
    assert main(["report", str(path), "--share", "1/2", "--partial", str(out)]) == 0
    assert meshgauge.PartialReport.load(out).up == -1
    capsys.readouterr()


def test_parts_that_were_seen_otherwise_are_refused(tmp_path: Path) -> None:
    flat, below, solid = surface(), surface(mirrored=True), garden()
    with pytest.raises(MeshgaugeError, match=r"is seen from -z, that of .* is seen from \+z"):
        meshgauge.merge([meshgauge.partial(flat, part=(0, 2)), meshgauge.partial(below, part=(1, 2))])
    with pytest.raises(MeshgaugeError, match=r"surface cells of .* were measured, and solid ones of .*--dimension"):
        meshgauge.merge([meshgauge.partial(solid, part=(0, 2)), meshgauge.partial(flat, part=(1, 2))])
    both = [meshgauge.partial(solid, part=(0, 2)), meshgauge.partial(flat, part=(1, 2), dimension=3)]
    assert meshgauge.merge(both).n_cells == flat.n_cells + int(np.count_nonzero(~solid.is_ghost))


def test_the_command_line_reads_them_in_slices(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, surface(turned=0.1, more="twice"))
    assert main(["report", str(path)]) == 0
    whole = capsys.readouterr().out
    assert main(["check", str(path), "--fail", "nothing invalid"]) == 1
    checked = capsys.readouterr().out
    monkeypatch.setattr("meshgauge.cli.batch.DIAGNOSED", 0)
    monkeypatch.setattr("meshgauge.cli.batch.Batch.read", None)  # nothing is read whole
    assert main(["report", str(path), "--memory", "70MB"]) == 0
    assert capsys.readouterr().out == whole
    assert main(["check", str(path), "--fail", "nothing invalid", "--memory", "70MB"]) == 1
    assert capsys.readouterr().out == checked
