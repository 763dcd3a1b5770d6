"""Arrays added to files of which all else stays: `meshgauge report -o` into the format of the input."""

from __future__ import annotations

from collections.abc import Callable
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import cgns_files
import command_line
import h5py
import meshio
import numpy as np
import pytest
from patch_files import PATCHED, bricks
from test_io_patch import stored

import meshgauge
from meshgauge import Mesh, WriteError
from meshgauge.io.adding import CannotAdd, add_data
from meshgauge.io.formats.vtk import vtu_adding
from meshgauge.io.plumbing.added import Added
from meshgauge.io.registry import FORMATS

pytestmark = pytest.mark.usefixtures("readers_here")

ADDED = [name for name, (kind, _, _) in PATCHED.items() if FORMATS[kind].add is not None]
NAMES = pytest.mark.parametrize("name", ADDED)


def arrays_of(mesh: Mesh) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """As a report has them, a cell and a point of which have no value."""
    rng = np.random.default_rng(3)
    cells = {"jens": rng.uniform(-1, 1, mesh.n_cells), "status": np.arange(mesh.n_cells, dtype=np.uint8) % 5}
    points = {"jens_worst": rng.uniform(-1, 1, mesh.n_points)}
    cells["jens"][3] = points["jens_worst"][0] = np.nan
    return cells, points


def added(name: str, folder: Path) -> tuple[Path, Path, Mesh]:
    """A file, its copy with arrays, and the mesh of the first."""
    path = PATCHED[name][1](folder)
    (folder / "out").mkdir()
    mesh, target = meshgauge.read(path), folder / "out" / path.name
    cells, points = arrays_of(mesh)
    assert add_data(mesh, target, cells=cells, points=points)
    return path, target, mesh


def n_insertions(old: bytes, new: bytes) -> int:
    """How many pieces were put into some bytes, of which all others are the same."""
    lines = [data.replace(b"</AppendedData>", b"\n</AppendedData>").split(b"\n") for data in (old, new)]
    changes = [one for one in SequenceMatcher(None, *lines, autojunk=False).get_opcodes() if one[0] != "equal"]
    for _, a, b, c, d in changes:  # of a line that is longer now the first part is the old one
        assert b"\n".join(lines[1][c:d]).startswith(b"\n".join(lines[0][a:b]))
    return len(changes)


@NAMES
def test_nothing_else_is_touched(name: str, tmp_path: Path) -> None:
    path, target, _ = added(name, tmp_path)
    old, new = path.read_bytes(), target.read_bytes()
    if old.startswith(b"\x89HDF") and not name.startswith("exodus"):
        before, after = stored(path), stored(target)
        assert {key: after[key] for key in before} == before
    elif name.startswith("exodus"):
        before, after = variables(path), variables(target)
        assert {key: after[key] for key in before} == before
    else:
        assert 1 <= n_insertions(old, new) <= 4


def variables(path: Path) -> dict[str, Any]:
    """Of a netCDF file, by its own library."""
    netCDF4 = pytest.importorskip("netCDF4")
    with netCDF4.Dataset(path) as file:
        held: dict[str, Any] = {f"/{name}": (len(one), one.isunlimited()) for name, one in file.dimensions.items()}
        held |= {f"@{name}": str(file.getncattr(name)) for name in file.ncattrs()}
        for name, one in file.variables.items():
            values = np.ma.filled(one[...])
            held[name] = (one.dimensions, values.tobytes(), {key: str(one.getncattr(key)) for key in one.ncattrs()})
        return held


@NAMES
def test_all_is_read_back(name: str, tmp_path: Path) -> None:
    _, target, mesh = added(name, tmp_path)
    back, (cells, points) = meshgauge.read(target), arrays_of(mesh)
    for arrays, there in ((cells, back.cell_data), (points, back.point_data)):
        for key, values in arrays.items():
            np.testing.assert_array_equal(there[key], values)
    assert set(mesh.cell_data) | set(cells) == set(back.cell_data)
    np.testing.assert_array_equal(back.points, mesh.points)


def by_pyvista(path: Path) -> tuple[np.ndarray, np.ndarray]:
    pv = pytest.importorskip("pyvista")
    grid = pv.read(path)
    while isinstance(grid, pv.MultiBlock):
        grid = grid[0]
    return grid.cell_data["jens"], grid.point_data["jens_worst"]


def by_meshio(path: Path) -> tuple[np.ndarray, np.ndarray]:
    mesh = meshio.read(path)
    return mesh.cell_data["jens"][0].ravel(), mesh.point_data["jens_worst"].ravel()


def by_netcdf(path: Path) -> tuple[np.ndarray, np.ndarray]:
    netCDF4 = pytest.importorskip("netCDF4")
    with netCDF4.Dataset(path) as file:
        kinds = ("elem", "nod")
        names = [list(netCDF4.chartostring(file[f"name_{kind}_var"][...])) for kind in kinds]
        at = [names[0].index("jens") + 1, names[1].index("jens_worst") + 1]
        return (
            np.ma.filled(file[f"vals_elem_var{at[0]}eb1"][-1], np.nan),
            np.ma.filled(file[f"vals_nod_var{at[1]}"][-1], np.nan),
        )


THIRD_PARTY: dict[str, Callable[[Path], tuple[np.ndarray, np.ndarray]]] = {
    "vtu": by_pyvista,
    "vtk": by_pyvista,
    "vtkhdf": by_pyvista,
    "cgns": by_pyvista,
    "exodus": by_netcdf,
    "med": by_meshio,
}


@pytest.mark.parametrize("name", [name for name in ADDED if PATCHED[name][0] in THIRD_PARTY])
def test_a_third_party_reader_reads_it(name: str, tmp_path: Path) -> None:
    _, target, mesh = added(name, tmp_path)
    cells, points = arrays_of(mesh)
    on_cells, on_points = THIRD_PARTY[PATCHED[name][0]](target)
    np.testing.assert_array_equal(on_cells, cells["jens"])
    np.testing.assert_array_equal(on_points, points["jens_worst"])


@pytest.mark.parametrize("name", ["gmsh 2.2", "gmsh 4.1", "gmsh 4.1 binary"])
def test_gmsh_reads_its_views(name: str, tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    _, target, mesh = added(name, tmp_path)
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(target))
        names = [gmsh.option.getString(f"View[{k}].Name") for k in range(len(gmsh.view.getTags()))]
        tags, values = gmsh.view.getModelData(gmsh.view.getTags()[names.index("jens")], 0)[1:3]
    finally:
        gmsh.finalize()
    wanted = arrays_of(mesh)[0]["jens"]
    assert dict(zip(tags, np.ravel(values), strict=True)) == {
        k + 1: value for k, value in enumerate(wanted.tolist()) if np.isfinite(value)
    }


@NAMES
def test_a_second_time_the_first_arrays_are_replaced(name: str, tmp_path: Path) -> None:
    _, target, _ = added(name, tmp_path)
    mesh = meshgauge.read(target)
    cells, points = arrays_of(mesh)
    other = {**cells, "jens": -cells["jens"], "more": np.ones(mesh.n_cells)}
    again = target.with_stem("again")
    assert add_data(mesh, again, cells=other, points=points)
    if PATCHED[name][0] in ("vtu", "vtk"):  # and all else is where it was
        del other["more"]
        same = target.with_stem("same")
        assert add_data(mesh, same, cells=cells, points=points)
        assert same.read_bytes() == target.read_bytes()
        other["more"] = np.ones(mesh.n_cells)
    back = meshgauge.read(again)
    for key, values in other.items():
        np.testing.assert_array_equal(back.cell_data[key], values)
    assert set(back.cell_data) == set(mesh.cell_data) | {"more"}


@NAMES
def test_from_a_shell(name: str, tmp_path: Path) -> None:
    path = PATCHED[name][1](tmp_path)
    target = tmp_path / f"out_{path.name}"
    done = command_line.run("report", path, "-o", target, "--quiet")
    assert done.returncode == 0, done.stderr
    assert "anew" not in done.stderr
    quality = meshgauge.measure(meshgauge.read(path))
    np.testing.assert_array_equal(meshgauge.read(target).cell_data["jens"], quality.values)
    before = path.read_bytes()
    done = command_line.run("report", path, "--in-place", "--quiet")
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() != before
    np.testing.assert_array_equal(meshgauge.read(path).cell_data["jens"], quality.values)


def test_what_does_not_read_back_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = PATCHED["vtu appended"][1](tmp_path)
    mesh, real = meshgauge.read(path), FORMATS["vtu"].add
    assert real is not None

    def spoilt(old: Path, new: Path, what: Added) -> None:
        real(old, new, Added({name: values[::-1] for name, values in what.cells.items()}, what.points, what.mesh))

    object.__setattr__(FORMATS["vtu"], "add", spoilt)
    try:
        cells, points = arrays_of(mesh)
        with pytest.raises(WriteError, match="does not read back"):
            add_data(mesh, tmp_path / "b.vtu", cells=cells, points=points)
    finally:
        object.__setattr__(FORMATS["vtu"], "add", real)
    assert not (tmp_path / "b.vtu").exists()


def test_several_pieces_and_groups_that_are_not_there(tmp_path: Path) -> None:
    path = PATCHED["vtu ascii"][1](tmp_path)
    one = path.read_text()
    begin, end = one.index("<Piece"), one.index("</Piece>") + len("</Piece>")
    piece = one[begin:end]
    bare = piece
    for group in ("PointData", "CellData"):
        start, stop = bare.index(f"<{group}"), bare.index(f"</{group}>") + len(f"</{group}>")
        bare = bare[:start] + ("<CellData/>" if group == "CellData" else "") + bare[stop:]
    path.write_text(one[:begin] + bare + bare + one[end:])
    mesh = meshgauge.read(path)
    cells, points = arrays_of(mesh)
    assert mesh.n_cells == 54
    assert add_data(mesh, tmp_path / "b.vtu", cells=cells, points=points)
    np.testing.assert_array_equal(meshgauge.read(tmp_path / "b.vtu").cell_data["jens"], cells["jens"])


@pytest.mark.parametrize("kind", ["mixed", "structured", "boundary"])
def test_zones_of_cgns(kind: str, tmp_path: Path) -> None:
    """A solution that is there takes the arrays; cells of a boundary have no place in one."""
    path = tmp_path / "a.cgns"
    if kind == "mixed":
        cgns_files.mixed(path, bricks())
    else:
        with h5py.File(path, "w") as file:
            base = cgns_files.base(file)
            for name in ("First", "Second"):
                if kind == "structured":
                    shape = (3, 4, 5)
                    points = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).astype(float)
                    sizes = np.array([shape, [n - 1 for n in shape], [0, 0, 0]])
                    cgns_files.zone(base, name, points.transpose(2, 1, 0, 3), 0, sizes, "Structured")
                else:
                    mesh = bricks()
                    made = cgns_files.zone(base, name, mesh.points, mesh.n_cells)
                    cgns_files.section(made, "Wall", 7, 28, 1, [1, 2, 6, 5])
                    cgns_files.section(made, "Bricks", 17, 1, 27, mesh.connectivity + 1)
    mesh = meshgauge.read(path)
    cells, points = arrays_of(mesh)
    assert add_data(mesh, tmp_path / "b.cgns", cells=cells, points=points)
    back = meshgauge.read(tmp_path / "b.cgns")
    is_solid = meshgauge.cells.IS_SOLID[mesh.types]
    np.testing.assert_array_equal(back.cell_data["jens"][is_solid], cells["jens"][is_solid])
    np.testing.assert_array_equal(back.point_data["jens_worst"], points["jens_worst"])
    before, after = stored(path), stored(tmp_path / "b.cgns")
    assert {key: after[key] for key in before} == before
    if kind == "mixed":
        assert "Base/Zone/Solution/jens/ data" in after


@pytest.mark.parametrize("kind", ["NETCDF3_CLASSIC", "NETCDF3_64BIT_DATA", "NETCDF4"])
def test_several_blocks_and_times_of_exodus(kind: str, tmp_path: Path) -> None:
    """Behind variables that are there, at each time; one block has no elements."""
    netCDF4 = pytest.importorskip("netCDF4")
    mesh, path = bricks(), tmp_path / "a.e"
    with netCDF4.Dataset(path, "w", format=kind) as file:
        sizes = {"len_string": 33, "len_name": 20, "num_dim": 3, "num_nodes": 64, "num_elem": 27, "num_el_blk": 2}
        sizes |= {"num_el_in_blk1": 9, "num_el_in_blk2": 18, "num_nod_per_el1": 8, "num_nod_per_el2": 8}
        for name, size in {**sizes, "time_step": None, "num_elem_var": 1, "num_glo_var": 1}.items():
            file.createDimension(name, size)
        for axis, letter in enumerate("xyz"):
            file.createVariable(f"coord{letter}", "f8", ("num_nodes",))[:] = mesh.points[:, axis]
        rows = mesh.connectivity.reshape(-1, 8) + 1
        for number, part in ((1, rows[:9]), (2, rows[9:])):
            made = file.createVariable(f"connect{number}", "i4", (f"num_el_in_blk{number}", f"num_nod_per_el{number}"))
            made.elem_type = "HEX8"
            made[:] = part
        file.createVariable("eb_prop1", "i4", ("num_el_blk",))[:] = [7, 8]
        file.createVariable("time_whole", "f8", ("time_step",))[:] = [0.0, 1.0, 2.0]
        names = file.createVariable("name_elem_var", "S1", ("num_elem_var", "len_name"))
        names[0] = np.array(list("stress".ljust(20, "\0")), "S1")
        file.createVariable("elem_var_tab", "i4", ("num_el_blk", "num_elem_var"))[:] = [[1], [0]]
        file.createVariable("vals_glo_var", "f8", ("time_step", "num_glo_var"))[:] = [[1.5], [2.5], [3.5]]
        own = file.createVariable("vals_elem_var1eb1", "f8", ("time_step", "num_el_in_blk1"))
        own[:] = np.arange(27.0).reshape(3, 9)
    mesh = meshgauge.read(path, step=2)
    cells, points = arrays_of(mesh)
    assert add_data(mesh, tmp_path / "b.e", cells=cells, points=points, step=2)
    for step in (1, 3):
        back = meshgauge.read(tmp_path / "b.e", step=step)
        np.testing.assert_array_equal(back.cell_data["jens"], cells["jens"])
        np.testing.assert_array_equal(back.cell_data["stress"][:9], 9 * (step - 1) + np.arange(9.0))
    before, after = variables(path), variables(tmp_path / "b.e")
    changed = {key for key, value in before.items() if after[key] != value}
    assert changed == {"/num_elem_var", "name_elem_var", "elem_var_tab"}
    with netCDF4.Dataset(tmp_path / "b.e") as file:
        assert file["elem_var_tab"][...].tolist() == [[1, 1, 1], [0, 1, 1]]
    if kind == "NETCDF4":  # time steps can be added to what is of time steps, and to nothing else
        with h5py.File(tmp_path / "b.e") as file:
            assert file["vals_elem_var2eb1"].maxshape == (None, 9)
            assert file["elem_var_tab"].maxshape == (2, 3)


@pytest.mark.parametrize("moves", [False, True])
def test_time_steps_of_a_vtkhdf(moves: bool, tmp_path: Path) -> None:
    """One mesh at all times gets the arrays at each; one that moves is written anew, with a note."""
    path, target = PATCHED["vtkhdf"][1](tmp_path), tmp_path / "b.vtkhdf"
    with h5py.File(path, "r+") as file:
        root = file["VTKHDF"]
        n = len(root["Points"])
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 2
        steps["Values"] = np.array([0.5, 1.5])
        for name in ("PartOffsets", "CellOffsets", "ConnectivityIdOffsets"):
            steps[name] = np.zeros(2, np.int64)
        steps["NumberOfParts"] = np.ones(2, np.int64)
        steps["PointOffsets"] = np.array([0, n if moves else 0])
        both = np.concatenate([root["Points"][...]] * (1 + moves))
        del root["Points"], root["PointData"]
        root.create_group("PointData")
        root["Points"] = both
    done = command_line.run("report", path, "-o", target, "--quiet", "--step", "last")
    assert done.returncode == 0, done.stderr
    assert ("time steps of which each has points or cells of its own" in done.stderr) == moves
    assert ("the mesh is written anew" in done.stderr) == moves
    for step in ("first", "last") if not moves else ("last",):
        mesh = meshgauge.read(target, step=step)
        np.testing.assert_array_equal(mesh.cell_data["jens"], meshgauge.measure(mesh).values)
    done = command_line.run("improve", path, "-o", tmp_path / "c.vtkhdf", "--quiet", "--step", "last")
    assert done.returncode in (0, 1), done.stderr
    assert ("step 1 (time 0.5) has the same points, which move there, too" in done.stderr) == (not moves)


def test_time_steps_of_a_vtu(tmp_path: Path) -> None:
    """Its own arrays are of each time; those added are of all."""
    path = PATCHED["vtu appended"][1](tmp_path)
    text = path.read_bytes().replace(b"<UnstructuredGrid>", b'<UnstructuredGrid TimeValues="0.5 1.5">')
    at = text.index(b"<DataArray", text.index(b"<CellData"))
    end = text.index(b">", at) + 1
    tag = text[at:end]
    assert tag.endswith(b"/>")
    both = b"\n".join(tag.replace(b"<DataArray", b'<DataArray TimeStep="%d"' % step) for step in (0, 1))
    path.write_bytes(text[:at] + both + text[end:])
    done = command_line.run("report", path, "-o", tmp_path / "b.vtu", "--quiet", "--step", "last")
    assert done.returncode == 0, done.stderr
    assert "anew" not in done.stderr
    assert tag.replace(b"<DataArray", b'<DataArray TimeStep="1"') in (tmp_path / "b.vtu").read_bytes()
    for step in ("first", "last"):
        mesh = meshgauge.read(tmp_path / "b.vtu", step=step)
        np.testing.assert_array_equal(mesh.cell_data["jens"], meshgauge.measure(mesh).values)
    path.write_bytes(text.replace(b'Name="Points"', b'Name="Points" TimeStep="0"'))
    mesh = meshgauge.read(tmp_path / "b.vtu", step="last")
    new = Added(*arrays_of(mesh), mesh)
    with pytest.raises(CannotAdd, match="points or cells of its own"):
        vtu_adding.add(path, tmp_path / "c.vtu", new)


def test_a_spread_exodus_mesh_is_refused_by_name(tmp_path: Path) -> None:
    one = PATCHED["exodus classic"][1](tmp_path)
    for number in range(2):
        (tmp_path / f"a.e.2.{number}").write_bytes(one.read_bytes())
    done = command_line.run("report", tmp_path / "a.e.2.0", "-o", tmp_path / "b.e", "--quiet")
    assert done.returncode == 2
    assert (
        "nothing is added to a file that is spread over several files; join them first (epu); give -o OUT"
        in done.stderr
    )
    assert not (tmp_path / "b.e").exists()
