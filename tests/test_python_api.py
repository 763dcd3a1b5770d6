"""The Python interface as its user meets it: the words of errors, the order of columns, tables, sums."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import command_line
import numpy as np
import pytest

import meshgauge
from meshgauge import CELL_TYPES, Mesh, plot

POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
TETRAS = [(0, 1, 2, 3), (1, 2, 3, 4)]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("tet", "tetra"),
        ("TETRA", "tetra"),
        ("tet10", "tetra10"),
        ("tetrahedron", "tetra"),
        ("hexa", "hexahedron"),
        ("hex20", "hexahedron20"),
        ("hexahedra", "hexahedron"),
        ("brick", "hexahedron"),
        ("prism", "wedge"),
        ("penta15", "wedge15"),
        ("pyr5", "pyramid"),
    ],
)
def test_a_wrong_name_of_a_type_names_the_one_that_is_meant(given: str, meant: str) -> None:
    for call in (
        lambda: meshgauge.jens(POINTS, TETRAS, given),
        lambda: meshgauge.scaled_jacobian(POINTS, TETRAS, given),
        lambda: Mesh.from_arrays(POINTS, [(given, TETRAS)]),
    ):
        with pytest.raises(meshgauge.MeshgaugeError, match=f"no cell type '{given}', did you mean '{meant}'"):
            call()


@pytest.mark.parametrize("given", ["C3D4", "", 999, -1, 1.5, None])
def test_a_name_that_is_like_none_lists_the_types(given: object) -> None:
    with pytest.raises(meshgauge.MetricError, match=r"no cell type .*; those that can be measured are tetra, voxel"):
        meshgauge.jens(POINTS, TETRAS, given)  # type: ignore[arg-type]


@pytest.mark.parametrize("given", ["mesh.vtu", None, np.zeros((4, 3))], ids=["name", "nothing", "points"])
def test_what_is_no_mesh_says_how_one_is_made(given: Any, tmp_path: Path) -> None:
    for call in (
        meshgauge.measure,
        meshgauge.improve,
        meshgauge.certify,
        meshgauge.regions,
        lambda mesh: meshgauge.write(tmp_path / "out.vtu", mesh),
        meshgauge.doctor.orient,
        meshgauge.doctor.diagnosis,
    ):
        with pytest.raises(meshgauge.MeshError, match=r"is no Mesh: meshgauge\.read makes one of a file"):
            call(given)
    assert not list(tmp_path.iterdir())


def test_a_mesh_where_values_are_asked_for_says_how_they_are_measured() -> None:
    mesh: Any = Mesh.from_arrays(POINTS, {"tetra": TETRAS})
    for call in (meshgauge.check.check, plot.worst, plot.worst_faces, plot.cut, plot.plotter):
        with pytest.raises(meshgauge.MeshError, match=r"a Mesh is no Quality: meshgauge\.measure makes one"):
            call(mesh)
    with pytest.raises(meshgauge.MeshError, match="no Quality"):
        plot.one_cell(mesh, 0)


@pytest.mark.parametrize("threads", [0, -1])
@pytest.mark.parametrize("n", [2, 300], ids=["few", "many"])
def test_no_threads_is_our_error(threads: int, n: int) -> None:
    points, cells = np.tile(POINTS, (n, 1)), np.add.outer(5 * np.arange(n), [0, 1, 2, 3])
    mesh = Mesh.from_arrays(points, {"tetra": cells})
    quality = meshgauge.measure(mesh)
    for call in (
        lambda: meshgauge.jens(points, cells, "tetra", threads=threads),
        lambda: meshgauge.scaled_jacobian(points, cells, "tetra", threads=threads, nodes=True),
        lambda: meshgauge.measure(mesh, threads=threads),
        lambda: meshgauge.measure(mesh[[]], threads=threads),
        lambda: meshgauge.certify(mesh, threads=threads),
        lambda: meshgauge.improve(mesh, threads=threads),
        lambda: meshgauge.summarise(quality.values, quality.status, mesh.types, threads=threads),
    ):
        with pytest.raises(meshgauge.OptionError, match=f"threads is {threads}, expected 1 or more"):
            call()


MEASURED = [row for row in CELL_TYPES.values() if row.shape is not None and row.n_nodes == row.shape.n_nodes]


@pytest.mark.parametrize("n", [3, 600], ids=["few", "many"])
@pytest.mark.parametrize("function", [meshgauge.jens, meshgauge.scaled_jacobian])
@pytest.mark.parametrize("row", MEASURED, ids=lambda row: row.name)
def test_values_of_nodes_stand_in_the_columns_of_the_nodes(
    row: meshgauge.CellType, function: Callable[..., np.ndarray], n: int
) -> None:
    """By brute force: the value of a corner is made by itself and its three neighbours alone."""
    assert row.shape is not None
    rng = np.random.default_rng(row.vtk_id)
    ideal = np.empty((row.shape.n_nodes, 3))
    ideal[list(row.corners)] = row.shape.points
    points = (ideal + rng.uniform(-0.1, 0.1, (n, *ideal.shape))).reshape(-1, 3)
    cells = np.arange(len(points)).reshape(n, -1)
    before = function(points, cells, row, nodes=True)
    assert before.shape == cells.shape
    for node in range(row.shape.n_nodes):
        moved = points.copy()
        moved[node :: row.shape.n_nodes] += 0.05
        changed = np.flatnonzero((function(moved, cells, row, nodes=True) != before).any(axis=0))
        edges = [{row.corners[a], row.corners[b]} for a, b in row.shape.edges]
        neighbours = {other for edge in edges if node in edge for other in edge}
        assert set(changed) == neighbours


def test_columns_of_a_voxel_are_those_of_the_mesh() -> None:
    box = np.array(list(itertools.product((0.0, 1.0), repeat=3)))[:, ::-1]  # x fastest, as a voxel has it
    box[7] += 0.3
    values = meshgauge.jens(box, [range(8)], "voxel", nodes=True)[0]
    quality = meshgauge.measure(Mesh.from_arrays(box, {"voxel": [range(8)]}))
    np.testing.assert_array_equal(values, quality.node_jens)
    worst = quality.worst(1)[0]
    assert worst.node_quality == values[worst.node] == values.min()


def test_summaries_add() -> None:
    points = np.random.default_rng(1).random((50, 3))
    cells = np.random.default_rng(2).permuted(np.tile(np.arange(50), (40, 1)), axis=1)[:, :4]
    quality = meshgauge.measure(Mesh.from_arrays(points, {"tetra": cells}))
    whole = quality.summary()

    def part(which: slice) -> meshgauge.Summary:
        return meshgauge.summarise(quality.values[which], quality.status[which], quality.mesh.types[which])

    thirds = [part(slice(0, 10)), part(slice(10, 30)), part(slice(30, None))]
    assert thirds[0] + thirds[1] + thirds[2] == whole
    assert sum(thirds) == whole
    with pytest.raises(TypeError):
        whole + 1  # type: ignore[operator]
    with pytest.raises(meshgauge.OptionError, match="cannot merge summaries of jens and scaled_jacobian"):
        whole + meshgauge.measure(quality.mesh, metrics="scaled_jacobian").summary("scaled_jacobian")
    counts, edges = whole.all.histogram()[::-1]
    assert (len(counts), len(edges), counts.sum()) == (20, 21, 40)


def test_a_summary_as_a_table() -> None:
    pandas = pytest.importorskip("pandas")
    mesh = Mesh.from_arrays(
        [*POINTS, (np.nan, 0, 0)], [("tetra", [*TETRAS, (0, 2, 1, 3)]), ("pyramid", [(0, 1, 4, 2, 5)])]
    )
    summary = meshgauge.measure(mesh).summary()
    table = summary.frame()
    assert isinstance(table, pandas.DataFrame)
    assert table.index.tolist() == ["tetra", "pyramid", "all"]
    assert table.loc["all", "n_cells"] == 4
    assert table.loc["tetra", ["n_invalid", "n_good"]].tolist() == [1, 2]
    assert table.loc["tetra", "quantile_0.5"] == summary.types["tetra"].quantiles([0.5])[0.5]
    assert np.isnan(table.loc["pyramid", "mean"])
    assert table.loc["all", "max"] == summary.all.max


BRACKET = Path(__file__).resolve().parent.parent / "examples" / "meshes" / "bracket.vtu"


@pytest.fixture(scope="module")
def bracket() -> meshgauge.Quality:
    return meshgauge.measure(meshgauge.read(BRACKET))


@pytest.mark.parametrize("options", [[], ["--by", "region", "--worst", "3"]], ids=["plain", "regions"])
def test_the_report_is_what_the_command_prints(bracket: meshgauge.Quality, options: list[str]) -> None:
    done = command_line.run("report", BRACKET, *options)
    text = bracket.report(worst=3, by_region=True) if options else bracket.report()
    assert text == done.stdout.rstrip("\n")
    assert max(map(len, bracket.report(width=80).splitlines())) <= 80


def test_summaries_by_region(bracket: meshgauge.Quality) -> None:
    ids, names = meshgauge.regions(bracket.mesh)
    found = bracket.by_region()
    assert list(found) == list(names)
    assert len(names) > 1
    for n, name in enumerate(names):
        assert found[name] == meshgauge.measure(bracket.mesh[ids == n]).summary()
    assert sum(found.values()) == bracket.summary()
    assert list(meshgauge.measure(Mesh.from_arrays(POINTS, {"tetra": TETRAS})).by_region()) == ["all"]


def test_a_page_is_written_whole_and_never_over_an_input(bracket: meshgauge.Quality, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    bracket.to_html(page, worst=2)
    text = page.read_text()
    assert text.startswith("<!doctype html>")
    assert "bracket.vtu" in text
    copy = tmp_path / "mesh.vtu"
    copy.write_bytes(BRACKET.read_bytes())
    (tmp_path / "link.html").symlink_to(copy)
    quality = meshgauge.measure(meshgauge.read(copy))
    for target in (copy, tmp_path / "link.html", tmp_path / "no folder" / "page.html", tmp_path):
        with pytest.raises(meshgauge.WriteError):
            quality.to_html(target)
    assert copy.read_bytes() == BRACKET.read_bytes()


def test_counts_that_cannot_be_are_refused(bracket: meshgauge.Quality, tmp_path: Path) -> None:
    for call in (
        lambda: bracket.report(worst=-1),
        lambda: bracket.report(width=0),
        lambda: bracket.to_html(tmp_path / "page.html", worst=-1),
        lambda: bracket.summary().all.histogram(0),
    ):
        with pytest.raises(meshgauge.OptionError):
            call()
    assert not (tmp_path / "page.html").exists()
