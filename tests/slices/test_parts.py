"""Parts of a mesh that were measured apart, merged: the report on the whole, to the last bit."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slice_meshes import boxes, garden

import meshgauge
from meshgauge import Mesh, PartialReport, io
from meshgauge.errors import MeshError, MeshgaugeError, MetricError, OptionError, ReadError
from meshgauge.kernels import path as kernels_path
from meshgauge.report import FileReport
from meshgauge.report.json import report_dict
from meshgauge.report.partial_report import VERSION
from meshgauge.slices import read as slices_read

METRICS = ("scaled_jacobian", "edge_ratio")
N = 8


@pytest.fixture(autouse=True)
def all_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0)
    monkeypatch.setattr(slices_read, "SIZE", 53)


def cut(mesh: Mesh, n: int = N) -> list[Mesh]:
    ends = np.linspace(0, mesh.n_cells, n + 1).astype(int)
    return [mesh[a:b] for a, b in itertools.pairwise(ends)]


def files(folder: Path, mesh: Mesh, extension: str = ".vtu", n: int = N) -> list[Path]:
    paths = [folder / f"part_{number}{extension}" for number in range(n)]
    for path, part in zip(paths, cut(mesh, n), strict=True):
        io.write(path, part)
    return paths


def whole(mesh: Mesh, **how: Any) -> FileReport:
    return FileReport.of(meshgauge.measure(mesh, metrics=METRICS, **how), by_region=True)


def asked(mesh: Any, **how: Any) -> PartialReport:
    return meshgauge.partial(mesh, metrics=METRICS, by_region=True, **how)


def assert_same(made: FileReport, expected: FileReport, *, points: bool = False) -> None:
    """All that JSON holds but for the path and notes, and the ids of points, of which parts have their own."""
    one, other = (json.loads(json.dumps(report_dict([report])))["files"][0] for report in (made, expected))
    for file in (one, other):
        for name in ("path", "notes", *(() if points else ("n_points",))):
            del file[name]
        for cell in () if points else file["worst"]:
            del cell["point"]
    assert one == other
    assert made.summary == expected.summary
    assert dict(made.regions) == dict(expected.regions)


def of_file(folder: Path, mesh: Mesh, extension: str = ".vtu") -> Mesh:
    """The mesh as its reader gives it: with numbers."""
    path = folder / f"whole{extension}"
    io.write(path, mesh)
    return io.read(path)


MAKERS: dict[str, Callable[[Path, Mesh], tuple[list[Any], Mesh]]] = {
    "in slices": lambda folder, mesh: (list(files(folder, mesh, ".vtu")), of_file(folder, mesh, ".vtu")),
    "whole": lambda folder, mesh: (list(files(folder, mesh, ".vtk")), of_file(folder, mesh, ".vtk")),
    "meshes": lambda _, mesh: (list(cut(mesh)), mesh),
    "grids": lambda _, mesh: ([one.to_pyvista() for one in cut(mesh)], io.from_pyvista(mesh.to_pyvista())),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_parts_are_the_whole(tmp_path: Path, kind: str) -> None:
    parts, mesh = MAKERS[kind](tmp_path, garden())
    made = meshgauge.merge([asked(part) for part in parts])
    assert_same(made, whole(mesh))
    assert min(len(made.regions), len(made.findings), made.summary.all.n_invalid) > 2
    assert "25 cells are ghosts or hidden, and are not looked at." in made.notes


def test_numbers_in_names_count_by_value_and_files_are_as_good_as_records(tmp_path: Path) -> None:
    mesh = garden(shuffled=True)
    paths = files(tmp_path, mesh, n=12)
    saved = []
    for path in reversed(paths):
        saved.append(path.with_suffix(".mgp"))
        asked(path).save(saved[-1])
    assert_same(meshgauge.merge([*saved, saved[3]]), whole(of_file(tmp_path, mesh)))


@pytest.mark.parametrize("way", ["pickled", "saved", "as it is"])
def test_ranks_give_the_order_and_a_part_that_arrives_twice_counts_once(tmp_path: Path, way: str) -> None:
    mesh = garden(seed=4)
    parts = [asked(part, part=(rank, N)) for rank, part in enumerate(cut(mesh))]
    given: list[Any] = [*parts[::-1], parts[2]]
    if way == "pickled":
        given = [pickle.loads(pickle.dumps(one)) for one in given]
    if way == "saved":
        for number, one in enumerate(given):
            one.save(tmp_path / f"{number}.mgp")
        given = [tmp_path / f"{number}.mgp" for number in range(len(given))]
    assert_same(meshgauge.merge(given), whole(mesh))


@pytest.mark.parametrize("n", [1, 3, 8])
def test_shares_of_one_file_are_the_file(tmp_path: Path, n: int) -> None:
    path, mesh = tmp_path / "mesh.vtkhdf", garden(shuffled=True)
    io.write(path, mesh)
    shares = [asked(path, share=(k, n)) for k in range(n, 0, -1)]
    made = meshgauge.merge([*shares, asked(path, share=(1, n))])
    assert meshgauge.merge([*shares, shares[0]], parts=n).summary == made.summary  # shares are counted too
    with pytest.raises(MeshgaugeError, match=f"1 part given, of {n + 1}"):
        meshgauge.merge(shares, parts=n + 1)
    assert_same(made, whole(io.read(path)), points=True)
    assert made.path == str(path)
    assert any(label for one in made.findings for label in one.labels)


def test_polyhedra(tmp_path: Path) -> None:
    mesh = boxes(5)
    made = meshgauge.merge([meshgauge.partial(part, metrics=METRICS) for part in cut(mesh, 3)])
    assert_same(made, replace(whole(mesh), regions=(), worst_regions=()))


def test_types_of_few_cells_have_the_same_last_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 60 wedges each part has some, and only the whole knows that there are many cells."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)
    mesh = garden()
    made = meshgauge.merge([asked(part) for part in cut(mesh)])
    assert made.summary.all.n_cells > 150 > made.summary.types["wedge"].n_cells
    assert_same(made, whole(mesh))
    assert not any(note.startswith("Last bits") for note in made.notes)


@pytest.mark.parametrize(("types", "is_said"), [((12, 13), True), ((24,), False)], ids=["linear", "curved"])
def test_meshes_of_few_cells_are_said(
    types: tuple[int, ...],
    is_said: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They are compiled in parts however few: the last bits are those of many. Curved cells are always compiled."""
    mesh = garden()
    mesh = mesh[np.isin(mesh.types, types)]
    expected = whole(mesh)
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 5000)
    made = meshgauge.merge([asked(part) for part in cut(mesh, 2)])
    assert_same(made, expected)
    assert any(note.startswith("Last bits") for note in made.notes) == is_said


def test_other_last_bits_are_marked() -> None:
    one, two = (asked(part, part=(rank, 2)) for rank, part in enumerate(cut(garden(), 2)))
    assert not report_dict([meshgauge.merge([one, two])])["files"][0]["mixed_processors"]
    made = meshgauge.merge([one, replace(two, last_bits="another")])
    assert report_dict([made])["files"][0]["mixed_processors"]
    assert any("last bits of values differ" in note for note in made.notes)


def test_the_probe_is_the_same_again() -> None:
    from meshgauge.kernels.probe import last_bits

    assert last_bits() == last_bits()
    assert len(last_bits()) == 16


def wedges(order: list[int]) -> Mesh:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], float)
    return Mesh.from_arrays(points, {"wedge": [order]})


@pytest.fixture
def pair() -> list[PartialReport]:
    return [asked(part, part=(rank, 2)) for rank, part in enumerate(cut(garden(), 2))]


def test_a_missing_rank_is_an_error(pair: list[PartialReport]) -> None:
    with pytest.raises(MeshgaugeError, match=r"of 2 parts 1 are missing: 0 \(counted from 0\)"):
        meshgauge.merge(pair[1:])
    with pytest.raises(MeshgaugeError, match="say that they are 2, not 3"):
        meshgauge.merge(pair, parts=3)


def test_two_parts_of_one_number_that_differ_are_an_error(pair: list[PartialReport]) -> None:
    """As of two time steps; else one of them would count, whichever came first."""
    moved = cut(garden(), 2)[0]
    moved = moved.replace(points=moved.points * np.array([1.0, 1.0, 1.1]))
    with pytest.raises(MeshgaugeError, match=r"two parts that differ are both number 0 of 2 \(counted from 0\)"):
        meshgauge.merge([*pair, asked(moved, part=(0, 2))])
    other = replace(asked(moved, part=(0, 2)), last_bits="other")  # last bits may differ: which is right is not known
    assert meshgauge.merge([*pair, other]).mixed_processors


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    parts = [asked(path) for path in files(tmp_path, garden(), n=4)]
    with pytest.raises(MeshgaugeError, match=r"between part_1\.vtu and part_3\.vtu a part is missing"):
        meshgauge.merge([parts[0], parts[1], parts[3]])
    assert meshgauge.merge([parts[0], parts[1], parts[3]], parts=3).n_cells > 0
    with pytest.raises(MeshgaugeError, match="3 parts given, of 4"):
        meshgauge.merge(parts[:3], parts=4)


def test_a_missing_share_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "mesh.vtkhdf"
    io.write(path, garden())
    shares = [asked(path, share=(k, 4)) for k in (1, 3, 4)]
    n = garden().n_cells
    with pytest.raises(MeshgaugeError, match=f"cells {n // 4} to {n // 2 - 1} are in none"):
        meshgauge.merge(shares)
    with pytest.raises(MeshgaugeError, match="measured twice"):
        meshgauge.merge([*shares, asked(path, share=(1, 2))])


def test_a_file_that_changed_between_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "mesh.vtkhdf"
    io.write(path, garden())
    one = asked(path, share=(1, 2))
    os.utime(path, ns=(5, 5))
    with pytest.raises(MeshgaugeError, match="was changed between"):
        meshgauge.merge([one, asked(path, share=(2, 2))])


@pytest.mark.parametrize(
    ("how", "text"),
    [
        ({"metrics": ()}, "other metrics"),
        ({"worst": 3}, "another number of worst cells"),
        ({"by_region": False}, "--by"),
        ({"keep_bricks": True}, "--keep-bricks"),
        ({"purpose": "fv"}, "another purpose"),
    ],
)
def test_parts_that_were_asked_for_other_things_are_refused(how: dict[str, Any], text: str) -> None:
    one, two = cut(garden(), 2)
    other = meshgauge.partial(two, **{"metrics": METRICS, "by_region": True, "part": (1, 2), **how})
    with pytest.raises(MeshgaugeError, match=text):
        meshgauge.merge([asked(one, part=(0, 2)), other])


def test_parts_of_other_versions_are_refused(pair: list[PartialReport]) -> None:
    with pytest.raises(MeshgaugeError, match="another version of meshgauge"):
        meshgauge.merge([pair[0], replace(pair[1], made_by="9.9")])


def test_wedges_of_two_orders_are_refused(tmp_path: Path) -> None:
    """Each part decides for itself; parts without wedges go with any."""
    for number, mesh in enumerate([wedges([0, 1, 2, 3, 4, 5]), wedges([0, 2, 1, 3, 5, 4]), garden()]):
        kept = mesh if number < 2 else mesh[mesh.types == 12]
        io.write(tmp_path / f"part_{number}.vtu", kept.replace(cell_data={}, point_data={}))
    parts = [meshgauge.partial(tmp_path / f"part_{number}.vtu") for number in range(3)]
    with pytest.raises(MeshgaugeError, match=r"part_1.vtu are turned, those of .*as stored; .*--wedge-order"):
        meshgauge.merge(parts)
    assert meshgauge.merge(parts[1:]).n_cells == parts[1].n_cells + parts[2].n_cells
    same = [meshgauge.partial(tmp_path / f"part_{number}.vtu", wedge_order="gmsh") for number in range(3)]
    assert meshgauge.merge(same).summary.types["wedge"].n_invalid == 1


def test_regions_of_two_kinds_are_refused() -> None:
    one, two = cut(garden(), 2)
    two = two.replace(cell_data={"gmsh:physical": np.ones(two.n_cells, np.int32)})
    with pytest.raises(MeshgaugeError, match=r"told by gmsh:physical, those of .* material; .*--as-one"):
        meshgauge.merge([asked(one, part=(0, 2)), asked(two, part=(1, 2))])


@pytest.mark.parametrize(
    ("parts", "expected"),
    [(("ac", "bc"), "bac"), (("ab", "bcd", "d"), "abcd"), (("c", "abc"), "abc"), (("ab", "cd"), "cdab")],
)
def test_regions_keep_the_order_that_they_have_in_parts(
    parts: tuple[str, str], expected: str, pair: list[PartialReport]
) -> None:
    from meshgauge.report.merging import _region_names

    given = [replace(pair[0], region_names=tuple(names)) for names in parts]
    assert "".join(_region_names(given)) == expected


def test_what_depends_on_cells_beside_is_refused() -> None:
    for metric in ("non_orthogonality", "verdict_condition"):
        with pytest.raises(MetricError, match=r"depends on the cells beside|takes all cells at once"):
            meshgauge.partial(garden(), metrics=[metric])


def test_wrong_options() -> None:
    mesh = garden()
    with pytest.raises(OptionError, match="part is 2 of 2, expected 0 to 1"):
        meshgauge.partial(mesh, part=(2, 2))
    with pytest.raises(OptionError, match="share is 0 of 2"):
        meshgauge.partial(mesh, share=(0, 2))
    with pytest.raises(OptionError, match="is not read in slices"):
        meshgauge.partial(mesh, share=(1, 2))
    with pytest.raises(OptionError, match="worst is -1"):
        meshgauge.partial(mesh, worst=-1)
    with pytest.raises(OptionError, match="no partial report"):
        meshgauge.merge([])
    with pytest.raises(MeshError, match="no cells"):
        meshgauge.partial(mesh[[]])


def damaged(data: bytes) -> Iterator[bytes]:
    for at in range(0, len(data), max(len(data) // 60, 1)):
        yield data[:at]
        yield data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


def test_a_damaged_file_is_one_error(tmp_path: Path, pair: list[PartialReport]) -> None:
    path = tmp_path / "a.mgp"
    pair[0].save(path)
    for data in damaged(path.read_bytes()):
        path.write_bytes(data)
        with pytest.raises(ReadError, match=r"a\.mgp: is ") as caught:
            PartialReport.load(path)
        assert "\n" not in str(caught.value)


CHANGES: dict[str, Callable[[dict[str, Any]], object]] = {
    "a field less": lambda data: data.pop("notes"),
    "a field more": lambda data: data.update(more=1),
    "a text for a number": lambda data: data.update(n_cells="7"),
    "a number below 0": lambda data: data["result"]["spans"].insert(0, [-5, 0]),
    "a region that is not there": lambda data: data["result"]["worst"][0].__setitem__(1, 99),
    "an array cut off": lambda data: data["result"]["summaries"][0][1]["tallies"][0][1].update(values="AAAA"),
    "another status": lambda data: data["result"]["findings"][0].update(status="worse"),
    "no J_ENS": lambda data: data["result"]["summaries"].pop(0),
    "a list": lambda data: data.update(result=[]),
    "deep": lambda data: data.update(result=json.loads("[" * 500 + "]" * 500)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_strangers_file_is_refused(tmp_path: Path, change: str, pair: list[PartialReport]) -> None:
    """With a right checksum: whoever writes one can write that too."""
    path = tmp_path / "a.mgp"
    pair[0].save(path)
    data = json.loads(path.read_text().split("\n")[1])
    CHANGES[change](data)
    body = json.dumps(data)
    path.write_text(f"meshgauge-partial {VERSION} {hashlib.sha256(body.encode()).hexdigest()}\n{body}\n")
    with pytest.raises(ReadError, match=r"a\.mgp: is damaged: "):
        PartialReport.load(path)


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mgp"
    path.write_bytes(pickle.dumps([1]))
    with pytest.raises(ReadError, match="is no partial report"):
        meshgauge.merge([path])
    path.write_text("meshgauge-partial 7 x\n{}\n")
    with pytest.raises(ReadError, match="of another version of partial reports"):
        meshgauge.merge([path])
    with pytest.raises(ReadError, match="No such file"):
        meshgauge.merge([tmp_path / "nothing.mgp"])
