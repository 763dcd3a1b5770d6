"""Time steps: every format that holds several says so, reads any of them, and is never written over."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from io_meshes import mesh_of

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError, WriteError
from meshgauge.io import Step
from meshgauge.io.plumbing.merge import join_pieces
from meshgauge.mesh import Mesh

pytestmark = pytest.mark.usefixtures("readers_here")

h5py = pytest.importorskip("h5py")

HEIGHTS = (1.0, 0.5, -1.0)
"""Of the apex of a tetrahedron at three steps: the last is inverted."""

TIMES = (0.0, 0.25, 4.0)


def tetra(height: float) -> Mesh:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, height)], float)
    return Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3)])])


def pvd(folder: Path) -> Path:
    for n, height in enumerate(HEIGHTS):
        io.write(folder / f"s{n}.vtu", tetra(height))
    # Not in the order of time, which is that of the steps.
    sets = [f'<DataSet timestep="{TIMES[n]}" part="0" file="s{n}.vtu"/>' for n in (2, 0, 1)]
    path = folder / "a.pvd"
    path.write_text(f'<VTKFile type="Collection"><Collection>{"".join(sets)}</Collection></VTKFile>')
    return path


def series(folder: Path) -> Path:
    for n, height in enumerate(HEIGHTS):
        io.write(folder / f"s{n}.vtk", tetra(height))
    files = [{"name": f"s{n}.vtk", "time": TIMES[n]} for n in range(3)]
    path = folder / "s.vtk.series"
    path.write_text(json.dumps({"file-series-version": "1.0", "files": files}))
    return path


def vtkhdf(folder: Path, *, moves: bool = True, external: bool = False) -> Path:
    """As VTK writes them: inline, or each step in a file beside and all together by virtual data sets."""
    path = folder / "a.vtkhdf"
    used = HEIGHTS if moves else HEIGHTS[:1]
    arrays: dict[str, list[np.ndarray]] = {}
    for height in used:
        mesh = tetra(height)
        for key, values in (
            ("Points", mesh.points),
            ("Types", mesh.types),
            ("Offsets", mesh.offsets),
            ("Connectivity", mesh.connectivity),
            *((f"NumberOf{what}", np.array([n])) for what, n in (("Points", 4), ("Cells", 1), ("ConnectivityIds", 4))),
        ):
            arrays.setdefault(key, []).append(values)
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = [2, 2]
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        for key, values in arrays.items():
            if external:
                layout = h5py.VirtualLayout((sum(map(len, values)), *values[0].shape[1:]), values[0].dtype)
                at = 0
                for n, own in enumerate(values):
                    with h5py.File(folder / f"a_{n}.vtkhdf", "a") as beside:
                        beside[f"VTKHDF/{key}"] = own
                    layout[at : at + len(own)] = h5py.VirtualSource(f"a_{n}.vtkhdf", f"VTKHDF/{key}", own.shape)
                    at += len(own)
                root.create_virtual_dataset(key, layout)
            else:
                root[key] = np.concatenate(values)
        root["PointData/u"] = np.arange(12.0).reshape(12, 1) * [0, 0, 1]
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 3
        steps["Values"] = np.array(TIMES)
        place = np.arange(3) if moves else np.zeros(3, int)
        steps["PartOffsets"], steps["NumberOfParts"] = place, np.ones(3, int)
        steps["PointOffsets"], steps["CellOffsets"], steps["ConnectivityIdOffsets"] = 4 * place, place, 4 * place
        steps["PointDataOffsets/u"] = 4 * np.arange(3)
    return path


def vtkhdf_beside(folder: Path) -> Path:
    return vtkhdf(folder, external=True)


def vtu(folder: Path, mode: str = "Appended") -> Path:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    from meshgauge.io.plumbing import vtk

    path = folder / f"{mode}.vtu"
    grids = [vtk.grid(tetra(height))[0] for height in HEIGHTS]
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    getattr(writer, f"SetDataModeTo{mode}")()
    writer.EncodeAppendedDataOff()
    writer.SetNumberOfTimeSteps(3)
    writer.SetInputData(grids[0])
    writer.Start()
    for time, grid in zip(TIMES, grids, strict=True):
        writer.SetInputData(grid)
        writer.WriteNextTime(time)
    writer.Stop()
    return path


def xdmf(folder: Path) -> Path:
    grids = [
        f'<Grid Name="g"><Time Value="{time}"/><Topology TopologyType="Tetrahedron" NumberOfElements="1">'
        '<DataItem Dimensions="1 4" Format="XML" NumberType="Int">0 1 2 3</DataItem></Topology>'
        '<Geometry GeometryType="XYZ"><DataItem Dimensions="4 3" Format="XML">'
        f"0 0 0 1 0 0 0 1 0 0 0 {height}</DataItem></Geometry></Grid>"
        for time, height in zip(TIMES, HEIGHTS, strict=True)
    ]
    path = folder / "a.xdmf"
    path.write_text(
        '<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid Name="all" GridType="Collection" '
        f'CollectionType="Temporal">{"".join(grids)}</Grid></Domain></Xdmf>'
    )
    return path


GEO = """by hand
for a test
node id assign
element id assign
part
         1
box
coordinates
         4
{}tetra4
         1
         1         2         3         4
"""


def ensight(folder: Path, *, moves: bool = True) -> Path:
    for n, height in enumerate(HEIGHTS):
        columns = tetra(height).points.T.ravel()
        (folder / f"g{n:03d}.geo").write_text(GEO.format("".join(f"{x:12.5e}\n" for x in columns)))
        moved = (tetra(height).points - tetra(1).points).T.ravel()
        vectors = "".join(f"{x:12.5e}\n" for x in moved)
        (folder / f"d{n:03d}.vec").write_text(f"u\npart\n         1\ncoordinates\n{vectors}")
    path = folder / "a.case"
    path.write_text(
        f"FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: {'1 g***.geo' if moves else 'g000.geo'}\n"
        "VARIABLE\nvector per node: 1 u d***.vec\n"
        "TIME\ntime set: 1\nnumber of steps: 3\nfilename start number: 0\nfilename increment: 1\n"
        f"time values: {' '.join(map(str, TIMES))}\n"
    )
    return path


FOAM = "FoamFile {{ version 2.0; format ascii; class {}; object {}; }}\n{}"


def openfoam(folder: Path) -> Path:
    """A tetrahedron in ``constant``, with new points at two times."""
    faces = "4(3(0 2 1) 3(0 1 3) 3(0 3 2) 3(1 2 3))"
    boundary = "1(wall { type wall; nFaces 4; startFace 0; })"
    case = folder / "case"
    for time, height in zip(("constant", "0.25", "4"), HEIGHTS, strict=True):
        mesh = case / time / "polyMesh"
        mesh.mkdir(parents=True)
        points = " ".join(f"({x} {y} {z})" for x, y, z in tetra(height).points)
        (mesh / "points").write_text(FOAM.format("vectorField", "points", f"4({points})"))
    for name, kind, text in (
        ("faces", "faceList", faces),
        ("owner", "labelList", "4(0 0 0 0)"),
        ("neighbour", "labelList", "0()"),
        ("boundary", "polyBoundaryMesh", boundary),
    ):
        (case / "constant" / "polyMesh" / name).write_text(FOAM.format(kind, name, text))
    return case


MOVING: dict[str, Callable[[Path], Path]] = {
    make.__name__: make for make in (pvd, series, vtkhdf, vtkhdf_beside, vtu, xdmf, ensight, openfoam)
}


@pytest.mark.parametrize("name", MOVING)
def test_every_format_that_holds_steps_says_so_and_reads_each(tmp_path: Path, name: str) -> None:
    path = MOVING[name](tmp_path)
    found = io.steps(path)
    assert [step.number for step in found] == [1, 2, 3]
    assert [step.time for step in found] == ([None, *TIMES[1:]] if name == "openfoam" else list(TIMES))
    assert len({step.geometry for step in found}) == 3
    first = io.read(path)
    assert any("holds 3 time steps; the first" in note for note in first.notes)
    assert first.points.max() == 1.0
    for choice, height in ((1, 1.0), (2, 0.5), (3, -1.0), ("first", 1.0), ("last", -1.0)):
        mesh = io.read(path, step=choice)  # type: ignore[arg-type]
        assert mesh.points[:, 2].sum() == height
        assert mesh.type_counts()["tetra"] == 1
        assert any("holds 3 time steps; step" in note for note in mesh.notes)
    with pytest.raises(ReadError, match="holds 3 time steps, step 4 is not among them") as caught:
        io.read(path, step=4)
    assert str(path) in str(caught.value)
    states = [(steps, meshgauge.measure(mesh).values[0]) for steps, mesh in io.read_steps(path)]
    assert [[step.number for step in steps] for steps, _ in states] == [[1], [2], [3]]
    assert [value > 0 for _, value in states] == [True, True, False]


def test_steps_of_one_geometry_are_one_state(tmp_path: Path) -> None:
    for path in (vtkhdf(tmp_path, moves=False), ensight(tmp_path, moves=False)):
        assert [step.geometry for step in io.steps(path)] == [0, 0, 0]
        ((steps, _),) = io.read_steps(path)
        assert [step.number for step in steps] == [1, 2, 3]
    assert io.read(tmp_path / "a.vtkhdf", step=2).point_data["u"][:, 2].tolist() == [4, 5, 6, 7]


def test_a_displacement_gives_the_deformed_shape(tmp_path: Path) -> None:
    path = ensight(tmp_path, moves=False)
    for step, height in enumerate(HEIGHTS, 1):
        mesh = io.read(path, step=step, displacement="u")
        np.testing.assert_allclose(mesh.points, tetra(height).points, atol=1e-6)
        assert "The points are displaced by 'u'." in mesh.notes
    assert len(list(io.read_steps(path, displacement="u"))) == 3
    with pytest.raises(ReadError, match=r"a\.case: has no displacement 'v'; it has u"):
        io.read(path, displacement="v")


def test_a_displacement_may_be_kept_by_components(tmp_path: Path) -> None:
    mesh = tetra(1.0)
    for letters in ("_x _y _z", "X Y Z", "_1 _2 _3"):
        data: dict[str, Any] = {f"u{letter}": np.arange(4.0) + n for n, letter in enumerate(letters.split())}
        io.write(tmp_path / "a.vtu", mesh.replace(point_data={**data, "t": np.ones(4)}))
        moved = io.read(tmp_path / "a.vtu", displacement="u").points - mesh.points
        np.testing.assert_array_equal(moved, np.arange(4.0)[:, None] + [0, 1, 2])
        with pytest.raises(ReadError, match=r"has no displacement 't'; it has u$"):
            io.read(tmp_path / "a.vtu", displacement="t")
    flat = mesh.replace(point_data={"u": np.ones((4, 2))})
    io.write(tmp_path / "a.vtu", flat)
    np.testing.assert_array_equal(io.read(tmp_path / "a.vtu", displacement="u").points - mesh.points, [[1, 1, 0]] * 4)


def test_a_single_state_is_step_1(tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    io.write(path, tetra(1.0))
    assert io.steps(path) == ()
    for choice in (None, "first", "last", 1):
        assert io.read(path, step=choice).notes == ()  # type: ignore[arg-type]
    with pytest.raises(ReadError, match="holds one state, step 2 is not among them"):
        io.read(path, step=2)
    ((steps, mesh),) = io.read_steps(path)
    assert steps == (Step(1),)
    assert mesh.n_cells == 1


@pytest.mark.parametrize("choice", ["middle", 0, -1, True, 1.0])
def test_what_is_no_step_is_an_error(tmp_path: Path, choice: Any) -> None:
    io.write(tmp_path / "a.vtu", tetra(1.0))
    with pytest.raises(ReadError, match=r"a\.vtu: (step is .*expected 'first', 'last' or a number|holds one state)"):
        io.read(tmp_path / "a.vtu", step=choice)


@pytest.mark.parametrize("make", [vtkhdf, vtu])
def test_a_file_of_several_steps_is_not_written_over(tmp_path: Path, make: Callable[[Path], Path]) -> None:
    path = make(tmp_path)
    before = path.read_bytes()
    with pytest.raises(WriteError, match="holds 3 time steps, of which all but one would be lost"):
        io.write(path, io.read(path, step=2), overwrite=True)
    assert path.read_bytes() == before


@pytest.mark.parametrize("mode", ["Ascii", "Binary"])
def test_steps_that_vtk_wrote_so_that_nobody_can_read_them_are_refused(tmp_path: Path, mode: str) -> None:
    with pytest.raises(ReadError, match="holds 3 time steps inline"):
        io.read(vtu(tmp_path, mode))


@pytest.mark.parametrize(("n", "more"), [(3, ""), (5, " and 2 more")])
def test_of_parts_without_some_data_three_are_named(n: int, more: str) -> None:
    mesh = mesh_of("tetra")
    parts = [mesh.replace(cell_data={"m": np.array([1, 2])}), *[mesh] * n]
    whole = join_pieces(parts, ["a", *(f"b{k}" for k in range(n))], path=Path("all"), names_blocks=False)
    assert whole.notes == (f"The cell data 'm' are missing in b0, b1, b2{more}.",)


def test_parts_of_a_step_are_one_mesh(tmp_path: Path) -> None:
    io.write(tmp_path / "a.vtu", mesh_of("tetra").replace(cell_data={"m": np.array([1, 2])}))
    io.write(tmp_path / "b.vtu", mesh_of("hexahedron"))
    (tmp_path / "a.pvd").write_text(
        '<VTKFile type="Collection"><Collection><DataSet timestep="1" part="0" file="a.vtu"/>'
        '<DataSet timestep="1" part="1" file="b.vtu"/></Collection></VTKFile>'
    )
    mesh = io.read(tmp_path / "a.pvd")
    assert mesh.type_counts() == {"tetra": 2, "hexahedron": 2}
    assert [block.name for block in mesh.blocks] == ["part 0", "part 1"]
    assert mesh.notes == ("The cell data 'm' are missing in part 1.",)
    assert {Path(source).name for source in mesh.sources} == {"a.pvd", "a.vtu", "b.vtu"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('<VTKFile type="Collection"><Collection/></VTKFile>', "names no files"),
        ('<VTKFile type="Collection"><Collection><DataSet file="gone.vtu"/></Collection></VTKFile>', "gone.vtu, which"),
        ('<VTKFile type="Collection"><Collection><DataSet file="a.pvd"/></Collection></VTKFile>', "3 deep"),
        (
            '<VTKFile type="Collection"><Collection><DataSet timestep="x" file="a.vtu"/></Collection></VTKFile>',
            "no time",
        ),
        ('<VTKFile type="Collection"><Collection><DataSet timestep="1"/></Collection></VTKFile>', "names no file"),
        ('<VTKFile type="Collection"><Collection><DataSet', "no XML"),
    ],
)
def test_collections_that_are_broken(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.pvd"
    path.write_text(text)
    with pytest.raises(ReadError, match=message):
        io.read(path)


def test_a_virtual_data_set_whose_file_is_missing_is_an_error(tmp_path: Path) -> None:
    path = vtkhdf_beside(tmp_path)
    (tmp_path / "a_1.vtkhdf").unlink()  # HDF5 would read zeros
    with pytest.raises(ReadError, match=r"refers to a_1\.vtkhdf, which is missing"):
        io.read(path)


def test_links_to_files_of_the_folder_are_followed(tmp_path: Path) -> None:
    io.write(tmp_path / "piece.vtkhdf", tetra(0.5))
    path = tmp_path / "all.vtkhdf"
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = [2, 2]
        root.attrs["Type"] = np.bytes_("PartitionedDataSetCollection")
        root["grid"] = h5py.ExternalLink("piece.vtkhdf", "/VTKHDF")
        root["Assembly/grid"] = h5py.SoftLink("/VTKHDF/grid")
    mesh = io.read(path)
    assert mesh.points.max() == 1.0
    assert {Path(source).name for source in mesh.sources} == {"all.vtkhdf", "piece.vtkhdf"}
    with h5py.File(tmp_path / "piece.vtkhdf", "a") as file:
        file["more"] = h5py.ExternalLink("other.h5", "/x")
    with pytest.raises(ReadError, match="not followed"):
        io.read(path)


def test_a_grid_that_a_time_series_refers_to_is_one_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # meshio puts the arrays there
    meshio = pytest.importorskip("meshio")
    path = tmp_path / "a.xdmf"
    mesh = tetra(1.0)
    with meshio.xdmf.TimeSeriesWriter(path) as writer:
        writer.write_points_cells(mesh.points, [("tetra", np.array([[0, 1, 2, 3]]))])
        for time, height in zip(TIMES, HEIGHTS, strict=True):
            writer.write_data(time, point_data={"u": tetra(height).points - mesh.points})
    for step, height in enumerate(HEIGHTS, 1):
        back = io.read(path, step=step, displacement="u")
        assert back.type_counts() == {"tetra": 1}
        np.testing.assert_array_equal(back.points, tetra(height).points)
    (tmp_path / "a.h5").unlink()
    with pytest.raises(ReadError, match=r"refers to a\.h5, which is missing"):
        io.read(path)


def test_points_of_a_time_may_come_with_faces_of_a_time_before(tmp_path: Path) -> None:
    case = openfoam(tmp_path)
    for name in ("faces", "owner", "neighbour", "boundary"):
        text = (case / "constant" / "polyMesh" / name).read_text()
        (case / "0.25" / "polyMesh" / name).write_text(text.replace("wall {", "inlet {"))
    assert [block.name for block in io.read(case, step=3).blocks] == ["cells", "inlet"]
    assert [block.name for block in io.read(case, step=1).blocks] == ["cells", "wall"]
    assert io.steps(case / "0.25") == ()
    assert io.read(case / "0.25").points[:, 2].sum() == 0.5
    assert io.steps(case / "constant") == ()
