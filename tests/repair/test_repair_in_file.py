"""Meshes in files, repaired by slices: the points of the whole, to the last bit, and all else of the file stays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import command_line
import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import bits, dented, shaken
from slice_meshes import write_parts
from thinned import quick

import meshgauge
import meshgauge.repair
from meshgauge import Mesh
from meshgauge.errors import WriteError
from meshgauge.io.moving import check_movable, move_points
from meshgauge.io.patching import patch_of
from meshgauge.io.plumbing.pieces import ReadWhole
from meshgauge.look.bands import PoorBelow
from meshgauge.quality.measure import measure
from meshgauge.repair.in_file import Moved, improve_file, measured_file
from meshgauge.repair.patch import Patch, PatchOfMesh, WholeMesh, whole_patch


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small meshes are repaired in their files, in several slices."""
    monkeypatch.setattr("meshgauge.repair.in_file.LEAST", 0)
    monkeypatch.setattr("meshgauge.slices.read.SIZE", 30)
    monkeypatch.setattr("meshgauge.cli.large_repair.LARGE", 0)


def repaired(path: Path, *, target: float = 0.2, size_change: float = 0.1, **options: Any) -> Moved:
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    source = measured_file(listed, target=target, threads=options.pop("threads", 1), memory=options.pop("memory", None))
    return improve_file(source, size_change=size_change, **options)


def hard() -> Mesh:
    """Small patches leave a cell below the target, and larger ones follow."""
    return shaken("hexahedron", 6, 0.36, seed=7)


def with_regions(kind: str, n: int) -> Mesh:
    mesh = dented(kind, n, by=0.8)
    middle = np.array([mesh.points[mesh.connectivity[a:b]].mean(axis=0) for a, b in
                       zip(mesh.offsets, mesh.offsets[1:], strict=False)])  # fmt: skip
    return mesh.replace(cell_data={"material": (middle[:, 0] > n / 2).astype(np.int32)})


def single(mesh: Mesh) -> Mesh:
    return Mesh(np.asarray(mesh.points, np.float32), mesh.types, mesh.offsets, mesh.connectivity)


MESHES: dict[str, Callable[[], Mesh]] = {
    "one point": lambda: dented("hexahedron", 14),
    "larger patches": hard,
    "regions": lambda: with_regions("mixed", 10),
    "single precision": lambda: single(dented("hexahedron", 12)),
    "much is bad": lambda: shaken("hexahedron", 8, 0.8),
    "nothing bad": lambda: shaken("hexahedron", 10, 0.0),
    "tetrahedra": lambda: dented("tetra", 9, by=0.9),
}


def as_whole(path: Path, **options: Any) -> meshgauge.Improvement:
    """The same of the mesh in memory, with points rounded as the file holds them."""
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, path.with_name("other" + path.suffix))
    return meshgauge.improve(mesh, rounding=None if patch is None else patch.roundings, **options)


def flat(value: Any) -> dict[str, Any]:
    """Numbers and texts of nested data, by where they stand."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    if not isinstance(value, dict | list):
        return {"": value}
    return {f"{key}.{below}": one for key, child in pairs for below, one in flat(child).items()}


def compare(path: Path, moved: Moved, whole: meshgauge.Improvement) -> None:
    points = np.array(meshgauge.read(path).points, np.float64)
    points[moved.points] = moved.coordinates
    np.testing.assert_array_equal(points.view(np.int64), bits(whole.mesh))
    one, other = moved.report.to_dict(), whole.report.to_dict()
    for name in ("before", "after", "below", "worse", "reasons", "displacement", "sizes", "region_volumes", "outcome"):
        one_flat, other_flat = flat(one[name]), flat(other[name])
        assert one_flat.keys() == other_flat.keys()
        for key, value in one_flat.items():
            assert value == (pytest.approx(other_flat[key], rel=1e-9) if isinstance(value, float) else other_flat[key])
    assert moved.report.holds
    assert [claim.name for claim in moved.report.claims if claim.name != "elsewhere"] == [
        claim.name for claim in whole.report.claims if claim.name != "elsewhere"
    ]


@pytest.mark.parametrize("suffix", [".vtkhdf", ".vtu"])
@pytest.mark.parametrize("name", quick(list(MESHES), "larger patches"))
def test_points_move_as_in_the_whole_mesh(tmp_path: Path, name: str, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    meshgauge.write(path, MESHES[name]())
    compare(path, repaired(path), as_whole(path))


def test_threads_memory_and_slices_change_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, hard())
    first = repaired(path)
    assert len(first.points) > 1
    monkeypatch.setattr("meshgauge.slices.read.SIZE", 17)
    second = repaired(path, threads=2, memory=1)
    np.testing.assert_array_equal(second.points, first.points)
    np.testing.assert_array_equal(second.coordinates.view(np.int64), first.coordinates.view(np.int64))


def test_what_is_promised_holds(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, dented("hexahedron", 14))
    moved = repaired(path, target=0.0, strict=True)
    assert moved.n_unusable == 0
    assert {claim.name for claim in moved.report.claims} >= {"valid", "worst", "fixed", "strict", "elsewhere"}
    compare(path, moved, as_whole(path, target=0.0, strict=True))


def chunked(path: Path, packed: bool) -> None:
    """Store the points of a VTKHDF file in chunks."""
    with h5py.File(path, "r+") as file:
        points = file["VTKHDF/Points"][...]
        del file["VTKHDF/Points"]
        file["VTKHDF"].create_dataset("Points", data=points, chunks=(50, 3), compression="gzip" if packed else None)


@pytest.mark.parametrize("packed", [None, False, True])
def test_a_copy_of_the_file_has_other_points_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, packed: bool | None
) -> None:
    monkeypatch.setattr("meshgauge.io.moving.WINDOW", 331)
    path, out, whole = (tmp_path / f"{name}.vtkhdf" for name in "abc")
    meshgauge.write(path, with_regions("hexahedron", 12))
    if packed is not None:
        chunked(path, packed)
    with h5py.File(path, "r+") as file:
        file["VTKHDF"].create_dataset("unknown", data=[1.5])
    assert command_line.run("improve", path, "-o", out).returncode == 0
    assert command_line.run("improve", path, "-o", whole, "--fixed-box", "1e9,,,,,").returncode == 0
    if packed is None:
        assert out.read_bytes() == whole.read_bytes()
        assert len(out.read_bytes()) == len(path.read_bytes())
    before, after, other = (meshgauge.read(one) for one in (path, out, whole))
    np.testing.assert_array_equal(bits(after), bits(other))
    assert not np.array_equal(bits(after), bits(before))
    np.testing.assert_array_equal(after.cell_data["material"], before.cell_data["material"])
    with h5py.File(out) as file:
        assert file["VTKHDF/unknown"][...].tolist() == [1.5]


def test_the_command_goes_by_slices_and_says_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, out = tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf"
    meshgauge.write(path, hard())
    asked: list[Path] = []

    def noted(listed: Any, target: Path, *rest: Any, **options: Any) -> None:
        asked.append(target)
        move_points(listed, target, *rest, **options)

    monkeypatch.setattr("meshgauge.cli.large_repair.move_points", noted)
    done = command_line.run("improve", path, "-o", out)
    assert asked == [out]
    assert done.returncode == 0
    assert f"written to {out}" in done.stdout
    page = "--html", tmp_path / "p.html"
    assert command_line.run("improve", path, "-o", tmp_path / "c.vtkhdf", *page).returncode == 0
    assert asked == [out]  # with a page the mesh is read whole
    assert out.read_bytes() == (tmp_path / "c.vtkhdf").read_bytes()


def test_what_was_replaced_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.files.undo.PART", 777)
    path, out, kept = tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf", tmp_path / "u.npz"
    meshgauge.write(path, dented("hexahedron", 14))
    old = path.read_bytes()
    assert command_line.run("improve", path, "-o", out, "--undo", kept).returncode == 0
    assert command_line.run("undo", out, kept, "-o", tmp_path / "c.vtkhdf").returncode == 0
    assert (tmp_path / "c.vtkhdf").read_bytes() == old != out.read_bytes()
    done = command_line.run("improve", path, "--in-place")
    assert (done.returncode, path.read_bytes()) == (0, out.read_bytes())
    assert f"meshgauge undo {path} {path}.undo.npz --in-place" in done.stderr
    assert command_line.run("undo", path, f"{path}.undo.npz", "--in-place").returncode == 0
    assert path.read_bytes() == old
    meshgauge.write(path, shaken("hexahedron", 5, 0.0))
    assert command_line.run("improve", path, "--in-place", "-q").returncode == 0
    assert not (tmp_path / "a.vtkhdf.undo-2.npz").exists()  # nothing was bad, nothing is written


def test_undo_data_of_packed_points_need_the_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, dented("hexahedron", 8))
    chunked(path, packed=True)
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    check_movable(listed, tmp_path / "b.vtkhdf")
    with pytest.raises(ReadWhole, match="chunks"):
        check_movable(listed, tmp_path / "b.vtkhdf", keeps_undo=True)
    old, out, kept = path.read_bytes(), tmp_path / "b.vtkhdf", tmp_path / "u.npz"
    assert command_line.run("improve", path, "-o", out, "--undo", kept).returncode == 0
    assert command_line.run("undo", out, kept, "--in-place").returncode == 0
    assert out.read_bytes() == old


def test_what_does_not_read_back_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, out = tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf"
    meshgauge.write(path, dented("hexahedron", 8))

    listed = meshgauge.io.pieces(path)
    assert listed is not None
    ids, places = np.array([5]), np.array([[0.1, 0.2, 0.3]])
    monkeypatch.setattr("meshgauge.io.moving._put", _shifted)
    with pytest.raises(WriteError, match="does not read back"):
        move_points(listed, out, ids, places)
    assert sorted(tmp_path.iterdir()) == [path]
    with pytest.raises(WriteError, match="is a file that the mesh was read from"):
        move_points(listed, path, ids, places)


def _shifted(rows: Any, copy: Path, ids: NDArray[np.int64], coordinates: NDArray[np.float64]) -> None:
    with copy.open("r+b") as file:
        file.seek(rows.offset)
        file.write(coordinates.tobytes())


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda mesh: mesh.replace(cell_data={"vtkGhostType": np.eye(1, mesh.n_cells, 3, np.uint8)[0]}), "ghost"),
        (lambda mesh: mesh.replace(points=np.asarray(mesh.points) * 1e-20), "very small"),
        (lambda mesh: mesh.replace(connectivity=_collapsed(mesh)), "repeated nodes"),
    ],
)
def test_what_has_to_be_read_whole_says_why(tmp_path: Path, change: Callable[[Mesh], Mesh], reason: str) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, change(dented("hexahedron", 8)))
    with pytest.raises(ReadWhole, match=reason):
        repaired(path)
    done = command_line.run("improve", path, "-o", tmp_path / "b.vtkhdf", "-q")
    assert done.returncode in (0, 1)
    assert (tmp_path / "b.vtkhdf").exists()


def _collapsed(mesh: Mesh) -> NDArray[np.int64]:
    """Nodes with those of the first hexahedron repeated, so that it stands for a wedge."""
    nodes = np.array(mesh.connectivity)
    nodes[[2, 6]] = nodes[[3, 7]]
    return nodes


def test_where_there_is_no_memory_for_a_larger_patch_the_first_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, hard())
    all_of_it = repaired(path)
    for answers in ([10**9, 10**9, 1], [10**9, 10**9, 10**9, 1]):  # not to read a larger patch, or not to repair it
        left = iter(answers)
        monkeypatch.setattr("meshgauge.repair.file_patches.free_memory", lambda left=left: next(left))
        moved = repaired(path)
        assert moved.report.holds
        assert not np.array_equal(moved.coordinates, all_of_it.coordinates)
    monkeypatch.setattr("meshgauge.repair.file_patches.free_memory", lambda: 1)
    with pytest.raises(ReadWhole, match="memory"):
        repaired(path)


def test_another_format_is_a_conversion(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, dented("hexahedron", 8))
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    check_movable(listed, tmp_path / "b.vtkhdf")
    with pytest.raises(ReadWhole, match="another format"):
        check_movable(listed, tmp_path / "b.vtu")


def test_a_wrong_option_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, dented("hexahedron", 8))
    for words in (["--target", "2"], ["--size-change", "-1"], ["--memory", "much"]):
        done = command_line.run("improve", path, "-o", tmp_path / "b.vtkhdf", *words)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert not (tmp_path / "b.vtkhdf").exists()


def test_partitions_have_points_of_their_own(tmp_path: Path) -> None:
    path, out, whole = (tmp_path / f"{name}.vtkhdf" for name in "abc")
    write_parts(path, [dented("hexahedron", 5), dented("hexahedron", 6), shaken("hexahedron", 3, 0.0)])
    moved = repaired(path)
    assert len(moved.points) == 2
    compare(path, moved, as_whole(path))
    assert command_line.run("improve", path, "-o", out).returncode == 0
    assert command_line.run("improve", path, "-o", whole, "--fixed-box", "1e9,,,,,").returncode == 0
    np.testing.assert_array_equal(bits(meshgauge.read(out)), bits(meshgauge.read(whole)))


@pytest.mark.parametrize(("is_shuffled", "size"), [(True, 40), (False, 1)])
def test_patches_are_those_of_the_whole_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_shuffled: bool, size: int
) -> None:
    monkeypatch.setattr("meshgauge.slices.read.SIZE", size)
    path, rng = tmp_path / "a.vtkhdf", np.random.default_rng(1)
    mesh = shaken("hexahedron", 8, 0.1)
    new = rng.permutation(mesh.n_points) if is_shuffled else np.arange(mesh.n_points)
    points = np.empty_like(mesh.points)
    points[new] = mesh.points
    mesh = Mesh(points, mesh.types, mesh.offsets, new[mesh.connectivity])
    meshgauge.write(path, mesh)
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    ours, theirs = measured_file(listed, target=0.2, threads=1), WholeMesh(whole_patch(measure(mesh)), 1)
    for rings, first, second in ((0, [5], [300]), (0, [0, 90], [200, 511]), (1, [200], [300])):
        one: Patch | None = None
        other: PatchOfMesh | None = None
        for bad in (np.array(first), np.array(second)):
            np.testing.assert_array_equal(ours.near(bad, rings + 1), theirs.near(bad, rings + 1))
            one, other = ours.patch(bad, rings, beside=one), theirs.patch(bad, rings, beside=other)
            assert one is not None
            assert other.cells is not None
            for name in ("cells", "points", "pinned", "region_ids", "free"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
            np.testing.assert_array_equal(one.quality.values, other.quality.values)
            np.testing.assert_array_equal(one.quality.mesh.connectivity, other.quality.mesh.connectivity)


def test_poor_is_counted_below_a_limit_of_ones_own(tmp_path: Path) -> None:
    mesh, own = hard(), PoorBelow(0.45)
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, mesh)
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    in_file = improve_file(measured_file(listed, target=0.2, poor_below=own, threads=1), size_change=0.1).report
    whole = meshgauge.repair.improve(mesh, poor_below=own)
    n_poor = [measure(one, poor_below=own).summary().all.n_poor for one in (mesh, whole.mesh)]
    assert n_poor[1] > measure(whole.mesh).summary().all.n_poor
    for report in (in_file, whole.report):
        assert [one.all.n_poor for one in (report.before, report.after)] == n_poor
    assert whole.after.poor_below == own
    anew = meshgauge.repair.improve(shaken("tetra", 2, 0.3, seed=1), topology=True, poor_below=own)
    assert anew.report.after.poor_below == own


def test_where_no_point_may_move_no_other_way_of_moving_is_advised() -> None:
    mesh = hard()
    (note,) = [
        note
        for note in meshgauge.repair.improve(mesh, fixed=np.ones(mesh.n_points, np.bool_)).report.notes
        if "mended" in note
    ]
    assert "fewer points are fixed" in note
