"""Several files that are one mesh: the report on them is that of the joined mesh, whole and in slices."""

from __future__ import annotations

import itertools
import json
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from slice_meshes import boxes, garden, spoiled, write_parallel, write_parts

import meshgauge
from meshgauge import Mesh, io
from meshgauge.cli.main import main
from meshgauge.errors import ReadError
from meshgauge.report import FileReport
from meshgauge.report.json import report_dict
from meshgauge.slices import read as slices_read

Captured = pytest.CaptureFixture[str]
N = 11


def cut(mesh: Mesh) -> list[Mesh]:
    """Without data that only some parts would have."""
    mesh = mesh.replace(cell_data={name: mesh.cell_data[name] for name in ("GlobalElementId", "material")})
    ends = np.linspace(0, mesh.n_cells, N + 1).astype(int)
    return [mesh[a:b] for a, b in itertools.pairwise(ends)]


@pytest.fixture(params=[".vtu", ".vtk"], ids=["in slices", "whole"])
def files(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    monkeypatch.setattr(slices_read, "SIZE", 31)
    paths = [tmp_path / f"part_{number}{request.param}" for number in range(N)]
    for path, part in zip(paths, cut(garden()), strict=True):
        io.write(path, part)
    return paths


def expected(tmp_path: Path) -> FileReport:
    path, parts = tmp_path / "all.pvtu", cut(garden())
    write_parallel(path, parts)
    starts = tuple(np.cumsum([0, *(part.n_points for part in parts)]).tolist()[:-1])
    mesh = io.read(path).replace(parts=starts)
    return FileReport.of(meshgauge.measure(mesh), by_region=True, with_diagnosis=True)


def plain(text: str) -> dict[str, object]:
    (file,) = json.loads(text)["files"]
    del file["path"], file["notes"]
    return dict(file)


@pytest.mark.parametrize("more", [(), ("--scheduler", "1")], ids=["whole", "in slices"])
def test_the_command(files: list[Path], more: tuple[str, ...], tmp_path: Path, capsys: Captured) -> None:
    pattern = str(tmp_path / f"part_*{files[0].suffix}")
    assert main(["report", pattern, "--as-one", "--json", "--by", "region", *more]) == 0
    out = capsys.readouterr().out
    assert plain(out) == plain(json.dumps(report_dict([expected(tmp_path)])))
    assert f"part_10{files[0].suffix} (11 files)" in json.loads(out)["files"][0]["path"]


def test_stream(files: list[Path], tmp_path: Path) -> None:
    made = meshgauge.stream(files, by_region=True, with_diagnosis=True)
    assert plain(json.dumps(report_dict([made]))) == plain(json.dumps(report_dict([expected(tmp_path)])))


def cube(n: int = 6, *, with_slit: bool) -> Mesh:
    """Hexahedra of which some are numbered in reverse, with a slit whose points are there twice, or without."""
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    bottom = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    top = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    cells = np.stack(bottom + top, -1).reshape(-1, 8)
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    slit = i[2:5, 3, 2:5].ravel() if with_slit else i[:0, 0, 0]
    above = points[cells].mean(axis=1)[:, 1] > 3
    for k, point in enumerate(slit):
        cells[above] = np.where(cells[above] == point, len(points) + k, cells[above])
    points = np.vstack([points, points[slit]])
    cells[5::17] = cells[5::17][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return Mesh.from_arrays(points, {"hexahedron": cells}, point_data={"GlobalNodeId": np.arange(len(points)) * 3 + 50})


def test_polyhedra_of_parts_are_diagnosed_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slices_read, "SIZE", 31)
    mesh, files = spoiled(boxes(6)), []
    for k, ids in enumerate(np.array_split(np.random.default_rng(2).permutation(mesh.n_cells), 4)):
        files.append(tmp_path / f"p{k}.vtkhdf")
        io.write(files[-1], mesh[ids])
    expected = FileReport.of(meshgauge.measure(io.read_as_one(files)), with_diagnosis=True).diagnosis
    made = meshgauge.stream(files, with_diagnosis=True).diagnosis
    assert made is not None
    assert expected is not None
    assert made.to_dict() == expected.to_dict()
    assert made.finding("misoriented_faces") is not None
    assert made.finding("multiple_faces") is not None


@pytest.mark.parametrize("numbers", ["global", "local", "none"])
@pytest.mark.parametrize("kind", ["files", "pvtu", "partitions"])
@pytest.mark.parametrize("way", ["whole", "in slices"])
def test_points_of_parts_are_joined_for_the_diagnosis(
    way: str, kind: str, numbers: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slices_read, "SIZE", 31)
    mesh = cube(with_slit=numbers == "global")  # on which side of it a point is coordinates cannot tell
    alone = FileReport.of(meshgauge.measure(mesh), with_diagnosis=True).diagnosis
    parts = []
    for ids in np.array_split(np.random.default_rng(2).permutation(mesh.n_cells), 4):
        part = mesh[ids]
        if numbers != "global":
            local = {"GlobalNodeId": np.arange(part.n_points) + 7} if numbers == "local" else {}
            part = part.replace(point_data=local)
        parts.append(part)
    files = [tmp_path / "all.pvtu"] if kind == "pvtu" else [tmp_path / "all.vtkhdf"]
    if kind == "pvtu":
        write_parallel(files[0], parts)
    elif kind == "partitions":
        write_parts(files[0], parts)
    else:
        files = [tmp_path / f"p{k}.vtkhdf" for k in range(len(parts))]
        for path, part in zip(files, parts, strict=True):
            io.write(path, part)
    if way == "whole":
        made = FileReport.of(meshgauge.measure(io.read_as_one(files)), with_diagnosis=True).diagnosis
    else:
        made = meshgauge.stream(files, with_diagnosis=True).diagnosis
    assert alone is not None
    assert made is not None
    of = {finding.name: finding for finding in made.findings}
    joined = of.pop("joined_points")
    how = "numbers" if numbers == "global" else "equal coordinates"
    assert joined.text.startswith("Of 4 parts ")
    assert joined.text.endswith(f"by their {how}.")
    assert joined.count > 100
    assert ("duplicate_points" in of) == (numbers == "global")
    assert "orientation" in of
    counts = Counter[str]()  # those of each block
    for finding in made.findings:
        counts[finding.name] += finding.count
    del counts["joined_points"]
    assert counts == {finding.name: finding.count for finding in alone.findings}
    assert (made.n_interior_faces, made.n_boundary_faces) == (alone.n_interior_faces, alone.n_boundary_faces)
    assert made.part_sizes == alone.part_sizes


def test_the_gate(files: list[Path], capsys: Captured) -> None:
    names = [str(path) for path in files]
    assert main(["check", *names, "--as-one", "--fail", "jens >= -1", "--fail", "nothing invalid", "--json"]) == 1
    (one,) = json.loads(capsys.readouterr().out)["files"]
    assert one["n_cells"] == garden().n_cells


def test_wedges_are_decided_for_all(tmp_path: Path) -> None:
    """A wedge that is negative in every part, beside hexahedra that are positive in one."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], float)
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    io.write(tmp_path / "a.vtu", Mesh.from_arrays(points, {"wedge": [[0, 2, 1, 3, 5, 4]]}))
    io.write(tmp_path / "b.vtu", Mesh.from_arrays(cube, {"hexahedron": [range(8)]}))
    io.write(tmp_path / "c.vtu", Mesh.from_arrays(points, {"wedge": [[0, 1, 2, 3, 4, 5]]}))
    paths = [tmp_path / f"{name}.vtu" for name in "abc"]
    whole = io.read_as_one(paths)
    assert meshgauge.measure(whole).summary().all.n_invalid == meshgauge.stream(paths).summary.all.n_invalid == 1


def test_folders_of_a_decomposed_case(tmp_path: Path, capsys: Captured) -> None:
    """As ``decomposePar`` leaves them: each a case of OpenFOAM."""
    case = Path(__file__).parents[1] / "doctor" / "data" / "internal_reversed"
    for number in range(2):
        shutil.copytree(case, tmp_path / f"processor{number}")
    assert main(["report", str(tmp_path / "processor*"), "--as-one", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["files"]
    alone = meshgauge.measure(io.read(case))
    assert one["n_cells"] == 2 * alone.n_cells
    assert one["purpose"] == "fv"
    names = [tmp_path / f"processor{number}" for number in range(2)]
    merged = meshgauge.merge([meshgauge.partial(name) for name in names])
    assert merged.summary.all.n_cells == one["all"]["n_cells"]
    assert merged.summary.all.total == 2 * alone.summary().all.total


def test_what_does_not_go_with_it(files: list[Path], tmp_path: Path, capsys: Captured) -> None:
    for more in (["--in-place"], ["--partial", str(tmp_path / "a.mgp")]):
        assert main(["report", str(files[0]), str(files[1]), "--as-one", *more]) == 2
        assert "--as-one makes one mesh of several files" in capsys.readouterr().err


def test_a_mesh_of_several_files_is_written(files: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out.vtkhdf"
    assert main(["report", *map(str, files), "--as-one", "-q", "-o", str(out)]) == 0
    assert io.read(out).n_cells == garden().n_cells


def test_a_missing_file_is_named(files: list[Path], tmp_path: Path, capsys: Captured) -> None:
    assert main(["report", str(files[0]), str(tmp_path / "nothing.vtu"), "--as-one"]) == 2
    assert "nothing.vtu" in capsys.readouterr().err
    with pytest.raises(ReadError, match="no file is given"):
        meshgauge.stream([])
