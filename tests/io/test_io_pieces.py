"""Exodus files, those of a spread mesh, and zones of CGNS are read in slices: what comes of it is that of the whole."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import cgns_files as cgns
import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, io
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.errors import ReadError
from meshgauge.io.formats import spread_rows
from meshgauge.io.plumbing import made_cells, some_rows
from meshgauge.io.plumbing.pieces import Pieces, ReadWhole, Rows
from meshgauge.kernels import path as kernels_path
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.report import FileReport
from meshgauge.report.stream import job_of, report_on
from meshgauge.slices import Ask
from meshgauge.slices.some_cells import measured

h5py = pytest.importorskip("h5py")
netCDF4 = pytest.importorskip("netCDF4")

RANDOM = np.random.default_rng(3)
N = 4


def grid(n: int = N) -> tuple[np.ndarray, np.ndarray]:
    """Points of a cube, moved at random, and its hexahedra."""
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    bottom = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    top = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return points + np.random.default_rng(1).normal(size=points.shape) * 0.2, np.stack(bottom + top, -1).reshape(-1, 8)


POINTS, HEXAHEDRA = grid()
WEDGES = np.concatenate([HEXAHEDRA[20:40][:, [0, 1, 2, 4, 5, 6]], HEXAHEDRA[20:40][:, [0, 2, 3, 4, 6, 7]]])


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 30)


def pieces_of(path: Path, step: int | None = None) -> Pieces:
    listed = io.pieces(path, step=step)
    assert listed is not None
    return listed


def rows(data: Rows) -> np.ndarray:
    """All of them, in steps that fit nothing."""
    n = data.shape[0]
    parts = [data.read(at, min(at + 7, n)) for at in range(0, n, 7)] or [data.read(0, 0)]
    return np.concatenate(parts)


def assert_same_mesh(listed: Pieces, mesh: Mesh) -> None:
    """Array by array, as they are sent to another process."""
    listed = pickle.loads(pickle.dumps(listed))
    assert (listed.n_cells, listed.n_points) == (mesh.n_cells, mesh.n_points)
    for name in ("points", "types"):
        np.testing.assert_array_equal(
            np.concatenate([rows(getattr(p, name)) for p in listed.pieces]), getattr(mesh, name)
        )
    nodes = [rows(p.connectivity) + start for p, start in zip(listed.pieces, listed.point_starts, strict=False)]
    np.testing.assert_array_equal(np.concatenate(nodes), mesh.connectivity)
    if mesh.polyhedra is not None:
        assert_same_polyhedra(listed, mesh.polyhedra)
    sizes = np.concatenate([np.diff(rows(p.offsets)) for p in listed.pieces])
    np.testing.assert_array_equal(sizes, np.diff(mesh.offsets))
    assert listed.blocks == tuple(mesh.blocks)
    for kind in ("cell_data", "point_data"):
        held, expected = (
            {k: [getattr(p, kind)[k] for p in listed.pieces] for k in getattr(listed.pieces[0], kind)},
            getattr(mesh, kind),
        )
        assert set(held) - {"label"} == set(expected) - {"label"}
        for name, values in expected.items():
            own = np.concatenate([rows(one) for one in held[name]])
            np.testing.assert_array_equal(own, values)
            assert own.dtype == values.dtype


def assert_same_polyhedra(listed: Pieces, expected: Polyhedra) -> None:
    every = [piece.polyhedra or {} for piece in listed.pieces]
    for key in ("cell_offsets", "face_offsets"):
        sizes = np.concatenate([np.diff(rows(own[key])) for own in every])
        np.testing.assert_array_equal(sizes, np.diff(getattr(expected, key)))
    for key, starts in (("cell_faces", listed.face_starts), ("face_points", listed.point_starts)):
        made = np.concatenate([rows(own[key]) + start for own, start in zip(every, starts, strict=False)])
        np.testing.assert_array_equal(made, getattr(expected, key))
    assert expected.labels is not None
    np.testing.assert_array_equal(np.concatenate([rows(own["labels"]) for own in every]), expected.labels)


def assert_same(path: Path, step: int | None = None, **how: Any) -> FileReport:
    """To the last bit, with the diagnosis, whatever the memory; the report of the whole."""
    listed, mesh = pieces_of(path, step), io.read(path, step=step)
    assert_same_mesh(listed, mesh)
    expected = FileReport.of(
        meshgauge.measure(mesh, metrics=("jens", "edge_ratio")), path=str(path), by_region=True, with_diagnosis=True
    )
    for memory in (1 << 30, 50_000_000):
        made = report_on(
            listed,
            path=str(path),
            metrics=("jens", "edge_ratio"),
            by_region=True,
            with_diagnosis=True,
            size=23,
            memory=memory,
        )
        assert made.diagnosis is not None
        assert expected.diagnosis is not None
        assert set(made.notes) == set(expected.notes)
        for name in ("summary", "others", "worst", "worst_regions", "regions", "findings", "n_cells", "n_points"):
            assert getattr(made, name) == getattr(expected, name), name
        assert made.diagnosis.findings == expected.diagnosis.findings
    return expected


def exodus(
    path: Path, *, kind: str = "NETCDF4", dtype: str = "f8", numbered: bool = True, together: bool = False
) -> Path:
    """Hexahedra, wedges and quads, with fields at two times that some blocks lack."""
    with netCDF4.Dataset(path, "w", format=kind) as file:
        blocks = [("HEX8", HEXAHEDRA[:20]), ("WEDGE6", WEDGES), ("SHELL4", HEXAHEDRA[:9, :4]), ("HEX8", HEXAHEDRA[40:])]
        file.createDimension("len", 33)
        file.createDimension("time_step", None)
        file.createDimension("nodes", len(POINTS))
        file.createDimension("elements", sum(len(cells) for _, cells in blocks))
        file.createDimension("n_blocks", len(blocks))
        file.createDimension("two", 2)
        packed = {"zlib": True} if kind == "NETCDF4" else {}

        def text(name: str, dimension: str, words: list[str]) -> None:
            file.createVariable(name, "S1", (dimension, "len"))[:] = np.array(
                [list(word.ljust(33, "\0")) for word in words], "S1"
            )

        file.createVariable("time_whole", "f8", ("time_step",))[:] = [0.0, 0.5]
        file.createVariable("eb_prop1", "i4", ("n_blocks",))[:] = [4, 9, 11, 12]
        text("eb_names", "n_blocks", ["core", "", "skin", "core"])
        if together:
            file.createDimension("three", 3)
            file.createVariable("coord", dtype, ("three", "nodes"), **packed)[:] = POINTS.T
        else:
            for axis, column in zip("xyz", POINTS.T, strict=True):
                file.createVariable(f"coord{axis}", dtype, ("nodes",), **packed)[:] = column
        for number, (element, cells) in enumerate(blocks, 1):
            file.createDimension(f"n{number}", len(cells))
            file.createDimension(f"w{number}", cells.shape[1])
            own = file.createVariable(f"connect{number}", "i4", (f"n{number}", f"w{number}"), **packed)
            own[:] = cells + 1
            own.elem_type = element
        if numbered:
            file.createVariable("node_num_map", "i4", ("nodes",))[:] = (
                np.random.default_rng(5).permutation(len(POINTS)) + 300
            )
            file.createVariable("elem_num_map", "i4", ("elements",))[:] = np.arange(len(HEXAHEDRA) + 29)[::-1] + 70
        text("name_elem_var", "two", ["stress", "damage"])
        text("name_nod_var", "two", ["dx", "dy"])
        for number in (1, 3):
            file.createVariable(f"vals_elem_var1eb{number}", dtype, ("time_step", f"n{number}"))[:] = RANDOM.random(
                (2, len(blocks[number - 1][1]))
            )
        file.createVariable("vals_elem_var2eb2", dtype, ("time_step", "n2"))[:] = RANDOM.random((2, 40))
        for index in (1, 2):
            file.createVariable(f"vals_nod_var{index}", dtype, ("time_step", "nodes"), **packed)[:] = RANDOM.random(
                (2, len(POINTS))
            )
    return path


@pytest.mark.parametrize(
    ("kind", "dtype", "numbered", "together"),
    [
        ("NETCDF4", "f8", True, False),
        ("NETCDF3_64BIT_OFFSET", "f4", True, False),
        ("NETCDF3_64BIT_DATA", "f8", False, True),
        ("NETCDF4", "f4", False, True),
    ],
)
def test_exodus(tmp_path: Path, kind: str, dtype: str, numbered: bool, together: bool) -> None:
    path = exodus(tmp_path / "a.e", kind=kind, dtype=dtype, numbered=numbered, together=together)
    report = assert_same(path, step=2)
    assert [name for name, _ in report.regions] == ["core", "block 9", "skin"]
    assert report.worst[0].cell_label != report.worst[0].cell


def test_a_truncated_file_is_an_error(tmp_path: Path) -> None:
    path = exodus(tmp_path / "a.e", kind="NETCDF3_64BIT_OFFSET")
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(ReadError, match="not a whole netCDF file"):
        io.pieces(path, step=2)


def spread(folder: Path, n: int = 3, *, sparse: bool = False, shift: float = 0.0) -> Path:
    """The hexahedra in slabs, one a file, with the nodes that they have."""
    numbers = np.random.default_rng(6).permutation(len(POINTS)) * (1000 if sparse else 1) + 17
    for k, cells in enumerate(np.array_split(np.arange(len(HEXAHEDRA)), n)):
        used = np.unique(HEXAHEDRA[cells])
        used = used[np.random.default_rng(k).permutation(len(used))]
        place = np.full(len(POINTS), -1)
        place[used] = np.arange(len(used))
        with h5py.File(folder / f"x.e.{n}.{k}", "w") as file:
            for axis, column in zip("xyz", (POINTS[used] + shift * k).T, strict=True):
                file[f"coord{axis}"] = column
            half = len(cells) // 2
            for number, own in ((1, cells[:half]), (2, cells[half:])):
                file[f"connect{number}"] = (place[HEXAHEDRA[own]] + 1).astype(np.int32)
                file[f"connect{number}"].attrs["elem_type"] = b"HEX8"
            file["eb_prop1"] = np.array([7, 8], np.int32)
            file["elem_num_map"] = (cells + 500).astype(np.int32)
            file["node_num_map"] = numbers[used].astype(np.int32)
            file["name_nod_var"] = np.array([list("t".ljust(9, "\0"))], "S1")
            file["vals_nod_var1"] = POINTS[used, 0][None]
            file["time_whole"] = [0.0]
    return folder / f"x.e.{n}.1"


@pytest.mark.parametrize("sparse", [False, True])
def test_a_spread_mesh_is_one(tmp_path: Path, sparse: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread_rows, "_WINDOW", 11)
    path = spread(tmp_path, sparse=sparse)
    report = assert_same(path)
    assert report.n_points == len(POINTS)
    assert len(pieces_of(path).stamps) == 3
    (tmp_path / "x.e.3.2").unlink()
    assert assert_same(path).notes[0].endswith("x.e.3.2 not found.")


def test_a_node_at_two_places_is_an_error(tmp_path: Path) -> None:
    path = spread(tmp_path, shift=0.01)
    with pytest.raises(ReadError) as whole:
        io.read(path)
    with pytest.raises(ReadError) as listed:
        io.pieces(path)
    assert str(listed.value) == str(whole.value)


def zoned(path: Path, kinds: str) -> Path:
    """Zones of CGNS: of elements (u), of mixed ones (m), structured (s), with points around it (r)."""
    n = N + 1
    nodes = POINTS.reshape(n, n, n, 3).transpose(2, 1, 0, 3)
    with h5py.File(path, "w") as file:
        root = cgns.base(file)
        for number, kind in enumerate(kinds):
            away = np.array([100.0 * number, 0, 0])
            if kind == "s":
                sizes = np.array([[n, n, 3], [N, N, 2], [0] * 3])
                made = cgns.zone(root, f"S{number}", nodes[:3] + away, 0, sizes, "Structured")
            elif kind == "r":
                sizes = np.array([[n - 2, n - 1, n], [N - 2, N - 1, N], [0] * 3])
                made = cgns.zone(root, f"R{number}", nodes + away, 0, sizes, "Structured")
                cgns.put(made["GridCoordinates"], "Rind", "Rind_t", np.array([1, 1, 0, 1, 0, 0], np.int32))
                materials = np.arange((N - 2) * (N - 1) * N).reshape(N, N - 1, N - 2) % 3
                solution = cgns.put(made, "Cells", "FlowSolution_t")
                cgns.put(solution, "GridLocation", "GridLocation_t", "CellCenter")
                cgns.put(solution, "MaterialId", "DataArray_t", materials.astype(np.int32))
            elif kind == "m":
                made = cgns.zone(root, f"M{number}", POINTS + away, len(HEXAHEDRA))
                every = [[17, *cell] for cell in HEXAHEDRA[40:] + 1] + [[14, *cell] for cell in WEDGES + 1]
                every = [every[at] for at in np.random.default_rng(4).permutation(len(every))]
                cgns.section(made, "All", 20, 1, len(every), *cgns.flat(every))
            else:
                made = cgns.zone(root, f"U{number}", POINTS + away, len(HEXAHEDRA) + 40)
                cgns.section(made, "Wedges", 14, 90, 40, (WEDGES + 1).ravel())
                cgns.section(made, "Hexahedra", 17, 5, 44, (HEXAHEDRA[20:] + 1).ravel())
                cgns.section(made, "Quads", 7, 60, 9, (HEXAHEDRA[:9, :4] + 1).ravel())
                boundary = cgns.put(cgns.put(made, "ZoneBC", "ZoneBC_t"), "Wall", "BC_t", "BCWall")
                cgns.put(boundary, "GridLocation", "GridLocation_t", "CellCenter")
                cgns.put(boundary, "PointList", "IndexArray_t", np.array([[7], [8], [62]]))
                solution = cgns.put(made, "Cells", "FlowSolution_t")
                cgns.put(solution, "GridLocation", "GridLocation_t", "CellCenter")
                cgns.put(solution, "P", "DataArray_t", np.arange(84.0))
                cgns.put(solution, "Wrong", "DataArray_t", np.arange(5.0))
                cgns.put(cgns.put(made, "Nodal", "FlowSolution_t"), "T", "DataArray_t", POINTS[:, 0].astype(np.float32))
                cgns.put(cgns.put(made, "Second", "FlowSolution_t"), "T", "DataArray_t", POINTS[:, 0])
    return path


@pytest.mark.parametrize(("kinds", "n_regions"), [("u", 2), ("uu", 3), ("ss", 2), ("r", 3), ("m", 1), ("usm", 4)])
def test_zones(tmp_path: Path, kinds: str, n_regions: int) -> None:
    assert len(assert_same(zoned(tmp_path / "a.cgns", kinds)).regions) == n_regions


@pytest.fixture
def few_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(made_cells, "BLOCK", 8)
    monkeypatch.setattr(made_cells, "SPAN", 24)
    monkeypatch.setattr(some_rows, "FAR", 5)


@pytest.mark.usefixtures("few_at_a_time")
@pytest.mark.parametrize("n_zones", [1, 2])
def test_polyhedra(tmp_path: Path, n_zones: int) -> None:
    """Points of some might hang: the file says what lies beyond each face."""
    path = tmp_path / "a.cgns"
    cgns.by_faces(path, [cgns.split_boxes(N, seed) for seed in range(n_zones)])
    expected = assert_same(path)
    assert {"polyhedron", "hexahedron"} <= set(expected.summary.types)
    assert len(expected.regions) == n_zones + 1


@pytest.mark.usefixtures("few_at_a_time")
def test_some_polyhedra_are_measured_as_in_the_whole(tmp_path: Path) -> None:
    """With the points that hang."""
    path = tmp_path / "a.cgns"
    cgns.by_faces(path, [cgns.split_boxes(N, seed) for seed in range(2)])
    job, mesh = job_of(pieces_of(path), Ask()), io.read(path)
    quality = meshgauge.measure(mesh)
    for ids in (np.arange(3, mesh.n_cells, 7), np.array([5]), np.flatnonzero(mesh.types == 42)):
        made, points = measured(job, ids)
        assert np.array_equal(made.values, quality.values[ids], equal_nan=True)
        assert np.array_equal(made.status, quality.status[ids])
        assert np.array_equal(mesh.points[points], made.mesh.points)


@pytest.mark.usefixtures("few_at_a_time")
@pytest.mark.parametrize("n_up_to", [30, 10_000])
def test_polyhedra_beside_others(tmp_path: Path, n_up_to: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What lies beyond faces that others may have is not known; cells are recognised by kernels, or NumPy alone."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", n_up_to)
    path = tmp_path / "a.cgns"
    cgns.by_faces(path, [cgns.split_boxes(N, seed) for seed in range(2)], n_tetra=9)
    assert_same_mesh(pieces_of(path), io.read(path))
    with pytest.raises(ReadWhole, match="hang depends on the cells beside"):
        report_on(pieces_of(path), size=23)


@pytest.mark.usefixtures("few_at_a_time")
def test_faces_that_coincide_are_those_of_two_cells(tmp_path: Path) -> None:
    """A baffle: each side has a face of its own. The whole knows by the points that a cell lies beyond."""
    points, faces, cells = cgns.split_boxes(N)
    for number in [face for face in range(1, len(faces) + 1) if sum(-face in own for own in cells)][::3]:
        second = next(own for own in cells if -number in own)
        faces.append(faces[number - 1][::-1])
        second[second.index(-number)] = len(faces)
    path = tmp_path / "a.cgns"
    cgns.by_faces(path, [(points, faces, cells)])
    assert_same(path)


def test_hexahedra_by_their_faces(tmp_path: Path) -> None:
    """No polyhedron is left of them."""
    mesh = Mesh.from_arrays(POINTS, {"hexahedron": HEXAHEDRA})
    path = cgns.polyhedral(tmp_path / "a.cgns", mesh)
    assert list(assert_same(path).summary.types) == ["hexahedron"]


@pytest.mark.parametrize(
    ("name", "at", "value", "message"),
    [
        ("Zone 0/Cells/ElementConnectivity", 3, 9999, "refers to face 9999, which does not exist"),
        ("Zone 0/Faces/ElementConnectivity", 3, 9999, "refers to point 9999, which does not exist"),
        ("Zone 0/Cells/ElementStartOffset", 7, 1, "offsets that do not fit"),
        ("Zone 0/Faces/ElementStartOffset", 7, 1, "offsets that do not fit"),
    ],
)
def test_faces_that_do_not_fit(tmp_path: Path, name: str, at: int, value: int, message: str) -> None:
    path = tmp_path / "a.cgns"
    cgns.by_faces(path, [cgns.split_boxes(N)])
    with h5py.File(path, "r+") as file:
        file[f"Base/{name}/ data"][at] = value
    with pytest.raises(ReadError, match=message):
        report_on(pieces_of(path), size=23)
    with pytest.raises(ReadError, match=message):
        io.read(path)


def test_what_has_to_be_read_whole(tmp_path: Path) -> None:
    mesh = Mesh(
        points=POINTS, types=np.full(64, 12, np.uint8), offsets=8 * np.arange(65), connectivity=HEXAHEDRA.ravel()
    )
    for form in ("sizes", "parents"):
        assert io.pieces(cgns.polyhedral(tmp_path / f"{form}.cgns", mesh, form)) is None
    assert io.pieces(cgns.mixed(tmp_path / "b.cgns", mesh, has_offsets=False)) is None
    assert io.pieces(cgns.mixed(tmp_path / "c.cgns", mesh)) is not None


def test_the_command_line_reads_them_in_slices(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in (exodus(tmp_path / "a.e"), zoned(tmp_path / "a.cgns", "us"), spread(tmp_path)):
        asked = ["report", str(path), "--by", "region", "--step", "first"]
        assert main(asked) == 0
        whole = capsys.readouterr().out
        with monkeypatch.context() as patch:
            patch.setattr("meshgauge.cli.batch.LARGE", 0)
            patch.setattr("meshgauge.cli.batch.DIAGNOSED", 0)  # as if it were large
            patch.setattr("meshgauge.cli.batch.Batch.read", None)  # nothing is read whole
            assert main([*asked, "--memory", "70MB"]) == 0
        assert capsys.readouterr().out == whole


@pytest.mark.parametrize("kind", ["exodus", "cgns"])
def test_what_is_written_of_it(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy with the bad cells as a set, and the mesh in another format with its blocks as regions."""
    source = exodus(tmp_path / "a.e") if kind == "exodus" else zoned(tmp_path / "a.cgns", "us")
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 23)
    for way in ("whole", "slices"):
        (tmp_path / way).mkdir()
        monkeypatch.chdir(tmp_path / way)
        if way == "slices":
            monkeypatch.setattr(batch, "LARGE", 0)
            monkeypatch.setattr(batch, "DIAGNOSED", 0)
            monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
        asked = ["report", f"../{source.name}", "-q", "--bad-set", f"set{source.suffix}", "--bad", "bad.csv"]
        assert main([*asked, "-o", "out.vtu"]) == 0
    assert Path("bad.csv").read_text() == Path("../whole/bad.csv").read_text()
    assert Path("../whole/out.vtu").stat().st_size > 0
    for name in (f"set{source.suffix}", "out.vtu"):
        whole, made = io.read(f"../whole/{name}"), io.read(name)
        for data in ("cell_data", "point_data", "field_data"):
            assert set(getattr(made, data)) == set(getattr(whole, data))
            for key, values in getattr(whole, data).items():
                np.testing.assert_array_equal(getattr(made, data)[key], values)
        np.testing.assert_array_equal(made.connectivity, whole.connectivity)
    if kind == "exodus":
        assert Path("set.e").read_bytes() == Path("../whole/set.e").read_bytes()
    assert "region" in io.read("out.vtu").cell_data
