"""The diagnosis of parts that were measured apart is that of their files as one mesh, or of their file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slice_meshes import boxes, garden, spoiled, write_parts
from test_as_one import cube
from thinned import quick

import meshgauge
from meshgauge import Mesh, PartialReport, io
from meshgauge.doctor import Diagnosis
from meshgauge.errors import MeshgaugeError, ReadError
from meshgauge.kernels import path as kernels_path
from meshgauge.report import FileReport, part_diagnosis
from meshgauge.report.json import dumps
from meshgauge.report.partial_report import VERSION
from meshgauge.slices import read as slices_read

MESHES: dict[str, Callable[[], Mesh]] = {
    "joined by numbers": lambda: cube(with_slit=True),
    "joined by coordinates": lambda: cube(with_slit=False).replace(point_data={}),
    "polyhedra": lambda: boxes(6),
    "all types": garden,
    "polyhedra with faults": lambda: spoiled(boxes(6)),
}


@pytest.fixture(autouse=True)
def slices_are_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slices_read, "SIZE", 53)


def cut(mesh: Mesh, n: int = 4, *, in_order: bool = True) -> list[Mesh]:
    ids = np.arange(mesh.n_cells) if in_order else np.random.default_rng(2).permutation(mesh.n_cells)
    return [mesh[np.sort(some)] for some in np.array_split(ids, n)]


def written(folder: Path, parts: list[Mesh], extension: str = ".vtkhdf") -> list[Path]:
    files = [folder / f"part_{number}{extension}" for number in range(len(parts))]
    for file, part in zip(files, parts, strict=True):
        io.write(file, part)
    return files


def as_one(files: list[Path]) -> Diagnosis:
    made = FileReport.of(meshgauge.measure(io.read_as_one(files)), with_diagnosis=True).diagnosis
    assert made is not None
    return made


def merged(partials: list[Any], **how: Any) -> Diagnosis:
    made = meshgauge.merge(partials, **how).diagnosis
    assert made is not None
    return made


def assert_same(made: Diagnosis, expected: Diagnosis) -> None:
    """But for what parts do not know."""
    one, other = made.to_dict(), expected.to_dict()
    one["skipped"] = [why for why in one["skipped"] if why != part_diagnosis.IN_OTHERS]
    assert one == other


@pytest.mark.parametrize("in_order", quick([True, False], True))
@pytest.mark.parametrize("extension", [".vtkhdf", ".vtk"], ids=["in slices", "whole"])
@pytest.mark.parametrize("name", MESHES)
def test_files(name: str, extension: str, in_order: bool, tmp_path: Path) -> None:
    if "polyhedra" in name and extension == ".vtk":
        pytest.skip("the format has no polyhedra")
    if name == "polyhedra with faults":
        pytest.skip("cells of two files are the same")
    files = written(tmp_path, cut(MESHES[name](), 3, in_order=in_order), extension)
    for file in files:
        meshgauge.partial(file, with_diagnosis=True).save(file.with_suffix(".mgp"))
    made = merged([file.with_suffix(".mgp") for file in files])
    assert_same(made, as_one(files))
    assert made.finding("joined_points") is not None


@pytest.mark.parametrize("name", MESHES)
def test_shares_of_a_file(name: str, tmp_path: Path) -> None:
    """Their points are joined by their ids."""
    io.write(tmp_path / "whole.vtkhdf", MESHES[name]())
    path = tmp_path / "whole.vtkhdf"
    made = merged([meshgauge.partial(path, share=(k, 3), with_diagnosis=True) for k in (3, 1, 2)])
    expected = FileReport.of(meshgauge.measure(io.read(path)), with_diagnosis=True).diagnosis
    assert expected is not None
    assert_same(made, expected)


def test_shares_of_a_file_of_partitions(tmp_path: Path) -> None:
    path = tmp_path / "whole.vtkhdf"
    write_parts(path, cut(cube(with_slit=True)))
    made = merged([meshgauge.partial(path, share=(k, 3), with_diagnosis=True) for k in (1, 2, 3)])
    expected = FileReport.of(meshgauge.measure(io.read(path)), with_diagnosis=True).diagnosis
    assert expected is not None
    assert expected.finding("joined_points") is not None
    assert_same(made, expected)


def test_all_of_the_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight parts of polyhedra, hexahedra and cells of all types: as the files as one, to the last bit."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)
    plain = garden().replace(point_data={}, cell_data={"vtkGhostType": garden().cell_data["vtkGhostType"]})
    files = written(tmp_path, [*cut(boxes(7)), *cut(plain)])
    partials = [meshgauge.partial(file, metrics=["scaled_jacobian"], with_diagnosis=True) for file in files]
    quality = meshgauge.measure(io.read_as_one(files), metrics=["scaled_jacobian"])
    made, whole = (
        json.loads(dumps([one]))["files"][0]
        for one in (meshgauge.merge(partials), FileReport.of(quality, with_diagnosis=True))
    )
    assert made["diagnosis"]["skipped"] == [part_diagnosis.IN_OTHERS]
    for one in (made, whole):
        del one["path"], one["notes"], one["diagnosis"]["skipped"]
    assert made == whole
    assert len(quality.mesh.type_counts()) > 12


def test_what_a_simulation_has_in_memory() -> None:
    mesh = cube(with_slit=False).replace(point_data={})
    parts = [meshgauge.partial(one, part=(k, 4), with_diagnosis=True) for k, one in enumerate(cut(mesh))]
    made = merged(parts)
    alone = FileReport.of(meshgauge.measure(mesh), with_diagnosis=True).diagnosis
    assert alone is not None
    assert made.n_interior_faces == alone.n_interior_faces
    assert made.part_sizes == alone.part_sizes
    assert [one.text for one in made.findings if one.name != "joined_points"] == [one.text for one in alone.findings]


def test_points_of_ghosts_alone_are_not_joined(tmp_path: Path) -> None:
    """Each part with a layer of cells of the next, marked: as if they were not there."""
    mesh = cube(with_slit=False).replace(point_data={})
    ids = np.arange(mesh.n_cells)
    parts = []
    for own in (ids < 108, ids >= 108):
        near = np.isin(mesh.connectivity.reshape(-1, 8), np.unique(mesh.connectivity.reshape(-1, 8)[own])).any(axis=1)
        chosen = own | near
        part = mesh[np.flatnonzero(chosen)]
        parts.append(part.replace(cell_data={"vtkGhostType": (~own[chosen]).astype(np.uint8)}))
    files = written(tmp_path, parts)
    made = merged([meshgauge.partial(file, with_diagnosis=True) for file in files])
    assert_same(made, as_one(files))
    assert_same(made, meshgauge.stream(files, with_diagnosis=True).diagnosis or made)
    assert made.n_parts == 1
    joined = made.finding("joined_points")
    assert joined is not None
    assert joined.count == 49  # the points between the two, and no other


def test_cells_of_one_share_inside_of_another_are_said(tmp_path: Path) -> None:
    """Surfaces between the cells of the first share are all in the last."""
    mesh = cube(6, with_slit=False)
    inside = mesh.connectivity.reshape(-1, 8)[43][[0, 1, 2, 3]]
    both = Mesh(
        points=mesh.points,
        types=np.append(mesh.types, 9).astype(np.uint8),
        offsets=np.append(mesh.offsets, mesh.offsets[-1] + 4),
        connectivity=np.concatenate([mesh.connectivity, inside]),
    )
    io.write(tmp_path / "a.vtkhdf", both)
    made = merged([meshgauge.partial(tmp_path / "a.vtkhdf", share=(k, 2), with_diagnosis=True) for k in (1, 2)])
    assert made.findings == ()
    assert "some cells of a part lie inside of another" in made.skipped[0]


def test_too_much_is_left_out_and_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(part_diagnosis, "MOST", 100)
    one, two = cut(cube(with_slit=False), 2)
    large = meshgauge.partial(one, part=(0, 2), with_diagnosis=True)
    assert large.open_cells is None
    made = merged([large, meshgauge.partial(two, part=(1, 2), with_diagnosis=True)])
    assert "MB, more than the 0 that are kept" in made.skipped[0]
    files = written(tmp_path, [one])
    small = meshgauge.partial(files[0], with_diagnosis=True, memory=1000)
    assert "more than --memory allows" in small.not_diagnosed


FIELDS = ("marks", "types", "parent", "flags", "cells", "sizes", "nodes", "inside", "groups", "known", "coordinates")


@pytest.mark.parametrize("field", FIELDS)
def test_a_strangers_numbers_are_refused(field: str, tmp_path: Path) -> None:
    """Kernels look up what they name without asking: nothing is where the numbers of another field lead."""
    path = tmp_path / "a.mgp"
    meshgauge.partial(cube(with_slit=False), with_diagnosis=True).save(path)
    data = json.loads(path.read_text().split("\n")[1])
    kept = data["open_cells"]
    donor = "block_ends" if field != "nodes" else "coordinates"
    kept[field] = {**kept[donor], "n": kept[field]["n"]}
    body = json.dumps(data)
    path.write_text(f"meshgauge-partial {VERSION} {hashlib.sha256(body.encode()).hexdigest()}\n{body}\n")
    with pytest.raises(ReadError, match="is damaged"):
        meshgauge.merge([PartialReport.load(path)])


def _sealed(path: Path, data: Any) -> Path:
    body = json.dumps(data)
    path.write_text(f"meshgauge-partial {VERSION} {hashlib.sha256(body.encode()).hexdigest()}\n{body}\n")
    return path


FORGED = (
    ("first_cell", 5),
    ("first_cell", 10**12),
    ("n_points", 10**12),
    ("first_point", 10**7),
    ("dimension", 2),
    ("nodes", -1),
    ("inside", 1 << 63),
    ("n_cells", -4),
)


@pytest.mark.parametrize(("field", "value"), FORGED)
def test_numbers_that_lead_outside_of_a_part_are_refused(field: str, value: int, tmp_path: Path) -> None:
    """They ended in a segmentation fault, or asked for terabytes."""
    path = tmp_path / "a.mgp"
    meshgauge.partial(cube(with_slit=False), with_diagnosis=True).save(path)
    data = json.loads(path.read_text().split("\n")[1])
    kept = data["open_cells"]
    kept[field] = {**kept[field], "n": value} if isinstance(kept[field], dict) else value
    with pytest.raises(ReadError, match="is damaged"):
        meshgauge.merge([_sealed(path, data)], memory=1 << 80)


def test_a_real_number_of_too_many_digits_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mgp"
    meshgauge.partial(cube(with_slit=False)).save(path)
    data = json.loads(path.read_text().split("\n")[1])
    data["result"]["worst"][0][0]["quality"] = 10**400
    with pytest.raises(ReadError, match="is damaged"):
        PartialReport.load(_sealed(path, data))


def test_shares_of_a_file_have_its_size(tmp_path: Path) -> None:
    io.write(tmp_path / "a.vtkhdf", cube(with_slit=False))
    one, two = (meshgauge.partial(tmp_path / "a.vtkhdf", share=(k, 2)) for k in (1, 2))
    with pytest.raises(MeshgaugeError, match="points in one partial report, and"):
        meshgauge.merge([one, replace(two, n_points=two.n_points + 1)])


def test_what_is_said_to_be_packed_is_not_unpacked_where_it_does_not_fit() -> None:
    made = meshgauge.partial(cube(with_slit=False), with_diagnosis=True)
    kept = made.open_cells
    assert kept is not None
    many = replace(made, open_cells=replace(kept, nodes=replace(kept.nodes, n=1 << 40)))
    assert "more than --memory allows" in merged([many], memory=1 << 34).skipped[0]
    assert merged([made], memory=1 << 34).skipped == ()
