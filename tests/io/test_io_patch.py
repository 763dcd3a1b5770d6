"""Files that are patched: the same bytes but for the coordinates of the points that moved."""

from __future__ import annotations

import gzip
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import command_line
import h5py
import meshio
import numpy as np
import pytest
from patch_files import CUBE, PATCHED, WORD, bricks

import meshgauge
from meshgauge import Mesh, ReadError, WriteError
from meshgauge.files import undo
from meshgauge.io.patching import Patch, patch_of
from meshgauge.io.registry import FORMATS

EXPONENT = re.compile(rb"(?<=[0-9.])([+-][0-9]+)$")
pytestmark = pytest.mark.usefixtures("readers_here")

NAMES = pytest.mark.parametrize("name", PATCHED)


def opened(name: str, folder: Path) -> tuple[Path, Mesh, Patch]:
    """A file, its mesh, and how it is patched into ``out``."""
    folder.joinpath("out").mkdir(exist_ok=True)
    path = PATCHED[name][1](folder)
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, folder / "out" / path.name)
    assert patch is not None
    return path, mesh, patch


def shifted(mesh: Mesh, patch: Patch, every: int = 7) -> tuple[Mesh, np.ndarray]:
    """The mesh with some points elsewhere, and which."""
    ids = np.flatnonzero(~patch.is_fixed)[::every]
    points = np.array(mesh.points, np.float64)
    points[ids] += np.random.default_rng(1).uniform(-0.03, 0.03, (len(ids), 3))
    points[ids] = patch.rounded(ids, points[ids])
    return mesh.replace(points=points), ids


def test_every_format_that_is_patched_is_here() -> None:
    here = {kind for kind, _, _ in PATCHED.values()} | {"openfoam"}  # test_io_patch_folder.py
    here |= {"vtk-xml", "pvd", "series", "xdmf"}  # test_io_patch_collections.py, test_io_patch_xdmf.py
    here |= {"vtp"}  # test_io_written_surfaces.py
    assert here == {f.name for f in FORMATS.values() if f.is_patched}


def stored(path: Path) -> dict[str, tuple[object, ...]]:
    """Every array of an HDF5 file: its values, how they are held, its attributes."""
    held: dict[str, tuple[object, ...]] = {}

    def take(name: str, item: h5py.Dataset | h5py.Group) -> None:
        attributes = {key: str(value) for key, value in item.attrs.items() if key != "REFERENCE_LIST"}
        if isinstance(item, h5py.Dataset):
            held[name] = (item[...].tobytes(), item.dtype, item.chunks, item.compression, attributes)
        else:
            held[name] = (attributes,)

    with h5py.File(path) as file:
        file.visititems(take)
    return held


def assert_equal_but_for_points(path: Path, other: Path) -> None:
    """By VTK's reader, and by the elements of the files."""
    pv = pytest.importorskip("pyvista")
    old, new = pv.read(path), pv.read(other)
    for what in ("point_data", "cell_data", "field_data"):
        assert set(getattr(old, what)) == set(getattr(new, what))
        for key, values in getattr(old, what).items():
            np.testing.assert_array_equal(values, getattr(new, what)[key])
    np.testing.assert_array_equal(old.cells, new.cells)
    heads = [
        re.sub(rb"offset=\"\d+\"", b"", re.sub(rb">[^<]+<", b"><", file.read_bytes().split(b"<AppendedData")[0]))
        for file in (path, other)
    ]
    assert heads[0] == heads[1]


@NAMES
def test_nothing_moved_gives_the_same_bytes(name: str, tmp_path: Path) -> None:
    path, mesh, patch = opened(name, tmp_path)
    assert not patch.is_fixed.any()
    patch.write(mesh)
    assert patch.target.read_bytes() == path.read_bytes()


@NAMES
def test_only_coordinates_of_moved_points_change(name: str, tmp_path: Path) -> None:
    path, mesh, patch = opened(name, tmp_path)
    moved, ids = shifted(mesh, patch)
    patch.write(moved, undo_file=tmp_path / "undo.npz")
    back = meshgauge.read(patch.target)
    assert np.asarray(back.points, np.float64).tobytes() == moved.points.tobytes()
    assert np.array_equal(back.connectivity, mesh.connectivity)
    old, new = path.read_bytes(), patch.target.read_bytes()
    if PATCHED[name][2] == "text":
        words = [WORD.findall(data) for data in (old, new)]
        assert len(words[0]) == len(words[1])
        changed = [(a, b) for a, b in zip(*words, strict=True) if a != b]
        assert len(changed) == 3 * len(ids)
        assert [WORD.sub(b"", line) for line in old.split(b"\n")] == [WORD.sub(b"", line) for line in new.split(b"\n")]
        values = [float(EXPONENT.sub(rb"e\1", b.replace(b"D", b"e"))) for _, b in changed]
        assert sorted(np.array(values, mesh.points.dtype).tolist()) == sorted(moved.points[ids].ravel().tolist())
        assert all((b"D" in b) == (b"D" in a) for a, b in changed if b"E" in b or b"D" in b)
    elif PATCHED[name][2] == "columns":
        lines = [data.split(b"\n") for data in (old, new)]
        assert list(map(len, lines[0])) == list(map(len, lines[1]))
        changed_lines = [a for a, b in zip(*lines, strict=True) if a != b]
        assert len(changed_lines) == len(ids) * (1 + any(line.startswith(b"*") for line in changed_lines))
    elif PATCHED[name][2] == "arrays":
        arrays = [stored(path), stored(patch.target)]
        assert arrays[0].keys() == arrays[1].keys()
        changed_names = [key for key, value in arrays[0].items() if value != arrays[1][key]]
        assert len(changed_names) == (1 if name.startswith("vtk") else 3)
        assert all("coord" in key.lower() or key == "VTKHDF/Points" for key in changed_names)
    elif PATCHED[name][2] == "packed":
        assert_equal_but_for_points(path, patch.target)
    else:
        assert len(old) == len(new)
        assert sum(a != b for a, b in zip(old, new, strict=True)) <= 24 * len(ids)
    assert b"".join(undo.restored(tmp_path / "undo.npz", patch.target)[""].pieces()) == old


@pytest.mark.parametrize("name", ["abaqus", "nastran", "gmsh 2.2 binary", "tetgen"])
def test_from_a_shell(name: str, tmp_path: Path) -> None:
    path, mesh, patch = opened(name, tmp_path)
    done = command_line.run("improve", path, "-o", patch.target, "--target", "0.9", "--undo", tmp_path / "undo.npz")
    assert done.returncode == 0, done.stderr
    better = meshgauge.read(patch.target)
    assert np.nanmin(meshgauge.measure(better).values) > np.nanmin(meshgauge.measure(mesh).values)
    lines = [data.split(b"\n") for data in (path.read_bytes(), patch.target.read_bytes())]
    if PATCHED[name][2] == "text":
        n_moved = np.count_nonzero((better.points != mesh.points).any(axis=1))
        assert sum(a != b for a, b in zip(*lines, strict=True)) == n_moved > 0
    done = command_line.run("undo", patch.target, tmp_path / "undo.npz", "--in-place")
    assert done.returncode == 0, done.stderr
    assert patch.target.read_bytes() == path.read_bytes()


@pytest.mark.parametrize("is_packed", [True, False])
@pytest.mark.parametrize("name", ["abaqus", "gmsh 2.2 binary", "exodus packed", "vtu appended zlib"])
def test_a_file_packed_by_gzip(name: str, is_packed: bool, tmp_path: Path) -> None:
    """It stays packed, unless the output is not to be: then it is what the plain file would have become."""
    plain, suffix = PATCHED[name][1](tmp_path), ".gz" if is_packed else ""
    path, target = plain.with_name(f"{plain.name}.gz"), tmp_path / f"out_{plain.name}{suffix}"
    path.write_bytes(gzip.compress(plain.read_bytes(), 5))
    mesh = meshgauge.read(path)
    patch, of_plain = patch_of(mesh, target), patch_of(meshgauge.read(plain), plain)
    assert patch is not None
    assert of_plain is not None
    patch.write(mesh)
    assert target.read_bytes() == (path if is_packed else plain).read_bytes()
    moved, _ = shifted(mesh, patch)
    patch.write(moved, undo_file=tmp_path / "undo.npz")
    assert np.asarray(meshgauge.read(target).points, np.float64).tobytes() == moved.points.tobytes()
    assert b"".join(undo.restored(tmp_path / "undo.npz", target)[""].pieces()) == path.read_bytes()
    of_plain.write(moved, overwrite=True)
    data = target.read_bytes()
    assert (gzip.decompress(data) if is_packed else data) == plain.read_bytes()


@pytest.mark.parametrize(("command", "name"), [("improve", "abaqus"), ("report", "vtu appended zlib")])
def test_a_packed_file_from_a_shell(command: str, name: str, tmp_path: Path) -> None:
    plain = PATCHED[name][1](tmp_path)
    path, target = plain.with_name(f"{plain.name}.gz"), tmp_path / f"out{plain.suffix}.gz"
    path.write_bytes(gzip.compress(plain.read_bytes()))
    options = ["--target", "0.9"] if command == "improve" else []
    done = command_line.run(command, path, "-o", target, *options)
    assert done.returncode == 0, done.stderr
    assert "anew" not in done.stderr
    back = meshgauge.read(target)
    assert ("jens" in back.cell_data) == (command == "report")
    assert (back.points != meshgauge.read(path).points).any() == (command == "improve")


@pytest.mark.parametrize("suffix", ["inp", "su2", "msh", "mesh"])
def test_a_third_party_reader_reads_the_new_coordinates(suffix: str, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    meshgauge.write(tmp_path / f"a.{suffix}", bricks())
    mesh = meshgauge.read(tmp_path / f"a.{suffix}")
    patch = patch_of(mesh, tmp_path / "out" / f"b.{suffix}")
    assert patch is not None
    moved, _ = shifted(mesh, patch)
    patch.write(moved)
    assert np.array_equal(meshio.read(patch.target).points, moved.points)


def test_what_has_no_place_does_not_move(tmp_path: Path) -> None:
    _, mesh, patch = opened("abaqus", tmp_path)
    text = (tmp_path / "deck.inp").read_text()
    first = text.index("\n", text.index("NSET=all")) + 1
    second = text.index("\n", first) + 1
    (tmp_path / "deck.inp").write_text(text[:first] + "1, , , \n" + text[second:])
    mesh = meshgauge.read(tmp_path / "deck.inp")
    patch = patch_of(mesh, tmp_path / "out" / "deck.inp")
    assert patch is not None
    assert np.flatnonzero(patch.is_fixed).tolist() == [0]
    points = np.array(mesh.points)
    points[0] += 0.1
    with pytest.raises(WriteError, match="1 points that moved have no place"):
        patch.write(mesh.replace(points=points))


def test_what_does_not_read_back_is_refused(tmp_path: Path) -> None:
    _, mesh, patch = opened("abaqus", tmp_path)
    points = np.array(mesh.points)
    points[5, 0] += 1e-3 * np.pi  # not rounded: 18 digits do not fit into twenty characters with an exponent
    points[5, 1] = -1.2345678901234567e-5
    with pytest.raises(WriteError, match="does not read back"):
        patch.write(mesh.replace(points=points))
    assert not patch.target.exists()


def test_generated_nodes_are_named(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    deck = "*NODE\n1,0.,0.,0.\n3,2.,0.,0.\n4,0.,1.,0.\n5,0.,0.,1.\n*NGEN\n1,3\n*ELEMENT,TYPE=C3D4\n1,1,2,4,5\n"
    (tmp_path / "a.inp").write_text(deck)
    with pytest.raises(ReadError, match=r"line 6: \*NGEN generates nodes.*--convert"):
        patch_of(meshgauge.read(tmp_path / "a.inp"), tmp_path / "out" / "a.inp")


def test_nodes_in_included_files(tmp_path: Path) -> None:
    """Into another folder all go along; in place they are patched where they are."""
    text = PATCHED["abaqus"][1](tmp_path).read_bytes()
    start, end = text.index(b"*NODE"), text.index(b"*Element")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "nodes.inc").write_bytes(text[start:end])
    deck = tmp_path / "deck.inp"
    deck.write_bytes(text[:start] + b"*INCLUDE, INPUT=in/nodes.inc\r\n" + text[end:])
    had = [path.read_bytes() for path in (deck, tmp_path / "in" / "nodes.inc")]
    mesh = meshgauge.read(deck)
    (tmp_path / "there").mkdir()
    elsewhere = patch_of(mesh, tmp_path / "there" / "better.inp")
    assert elsewhere is not None
    moved, _ = shifted(mesh, elsewhere)
    elsewhere.write(moved)
    assert meshgauge.read(tmp_path / "there" / "better.inp").points.tobytes() == moved.points.tobytes()
    assert (tmp_path / "there" / "better.inp").read_bytes() == had[0]
    assert [path.read_bytes() for path in (deck, tmp_path / "in" / "nodes.inc")] == had
    here = patch_of(mesh, deck)
    assert here is not None
    here.write(moved, overwrite=True, undo_file=tmp_path / "undo.npz")
    assert meshgauge.read(deck).points.tobytes() == moved.points.tobytes()
    assert undo.bring_back(tmp_path / "undo.npz", deck, deck)
    assert [path.read_bytes() for path in (deck, tmp_path / "in" / "nodes.inc")] == had


KILLED = """
import os, sys
import meshgauge
from meshgauge.files import output
from meshgauge.io.patching import patch_of
import numpy as np
left, real = int(sys.argv[2]), os.replace
def replace(*arguments):
    global left
    if left == 0:
        os.kill(os.getpid(), 9)
    left -= 1
    real(*arguments)
os.replace = replace
deck = meshgauge.read(sys.argv[1])
patch = patch_of(deck, sys.argv[1])
points = np.array(deck.points)
points[20:30] += 0.01
points[20:30] = patch.rounded(np.arange(20, 30), points[20:30])
patch.write(deck.replace(points=points), overwrite=True, undo_file="undo.npz")
"""


@pytest.mark.skipif(os.name != "posix", reason="there is no such signal")
@pytest.mark.parametrize("n_replaced", [0, 1, 2])
def test_a_kill_leaves_each_file_old_or_new_and_undo_all_old_bytes(n_replaced: int, tmp_path: Path) -> None:
    """Undo data, an included file and the deck, one after another."""
    text = PATCHED["abaqus"][1](tmp_path).read_bytes()
    deck, (start, middle, end) = tmp_path / "deck.inp", map(text.index, (b"*NODE", b"** 7, 1.", b"*Element"))
    line = text.rindex(b"\n", 0, middle) + 1
    (tmp_path / "a.inc").write_bytes(text[start:line])
    (tmp_path / "b.inc").write_bytes(b"*NODE\r\n" + text[middle:end])
    deck.write_bytes(text[:start] + b"*INCLUDE, INPUT=a.inc\r\n*INCLUDE, INPUT=b.inc\r\n" + text[end:])
    names = ("a.inc", "b.inc", "deck.inp")
    had = {name: (tmp_path / name).read_bytes() for name in names}
    command = [sys.executable, "-c", KILLED, str(deck), str(n_replaced)]
    killed = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60)
    assert killed.returncode == -9, killed.stderr
    now = {name: (tmp_path / name).read_bytes() for name in names}
    assert (now != had) == (n_replaced > 1)
    assert sum(now[name] != had[name] for name in names) == max(n_replaced - 1, 0)
    assert (tmp_path / "undo.npz").exists() == (n_replaced > 0)
    if n_replaced:
        undo.bring_back(tmp_path / "undo.npz", deck, deck)
    assert {name: (tmp_path / name).read_bytes() for name in names} == had


def test_what_is_certified_is_what_the_file_holds(tmp_path: Path) -> None:
    """Far from the origin a field of 8 characters holds three decimals."""
    path = PATCHED["nastran"][1](tmp_path)
    lines = path.read_text().splitlines()
    for at, line in enumerate(lines):
        if line.startswith("GRID "):
            fields = [line[k : k + 8] for k in (24, 32, 40)]
            lines[at] = line[:24] + "".join(f"{1000.0 + _real(field):8.3f}" for field in fields)
    path.write_text("\n".join(lines) + "\n")
    better = tmp_path / "better.bdf"
    done = command_line.run("improve", path, "-o", better, "--everywhere", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    values = meshgauge.measure(meshgauge.read(better)).values
    assert report["after"]["all"]["min"] == values.min()
    assert any("rounded to the digits that the file holds" in note for note in report["notes"])
    assert all(claim["holds"] for claim in report["claims"])
    assert values.min() > meshgauge.measure(meshgauge.read(path)).values.min()


def _real(field: str) -> float:
    return float(re.sub(r"(?<=[0-9.])([+-][0-9]+)$", r"e\1", field.strip()))


def spread(name: str, folder: Path) -> Path:
    """A deck that includes a file that includes the first nodes; and another that has no nodes."""
    path = PATCHED[name][1](folder)
    text = path.read_bytes()
    end = b"\r\n" if b"\r\n" in text else b"\n"
    first, last, include = {
        "abaqus": (b"*NODE", b"*Element", b"*INCLUDE, INPUT=%b" + end),
        "nastran": (b"GRID  ", b"CHEXA", b"INCLUDE '%b'" + end),
        "lsdyna": (b"*NODE", b"*ELEMENT", b"*INCLUDE" + end + b"%b" + end),
    }[name]
    start, stop = text.index(first), text.index(last)
    (folder / "in").mkdir()
    (folder / "in" / "nodes.inc").write_bytes(text[start:stop])
    (folder / "outer.inc").write_bytes(include % b"in/nodes.inc")
    (folder / "other.inc").write_bytes(
        {"abaqus": b"** nothing", "nastran": b"$ nothing", "lsdyna": b"$ nothing"}[name] + end
    )
    path.write_bytes(text[:start] + include % b"outer.inc" + include % b"other.inc" + text[stop:])
    return path


@pytest.mark.parametrize("name", ["abaqus", "nastran", "lsdyna"])
def test_beside_the_old_deck_included_files_that_change_get_new_names(name: str, tmp_path: Path) -> None:
    path = spread(name, tmp_path)
    had = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
    mesh = meshgauge.read(path)
    target = path.with_stem("better")
    patch = patch_of(mesh, target)
    assert patch is not None
    assert not patch.is_fixed.any()
    moved, _ = shifted(mesh, patch)
    patch.write(moved, undo_file=tmp_path / "undo.npz")
    assert meshgauge.read(target).points.tobytes() == moved.points.tobytes()
    assert {one: one.read_bytes() for one in had} == had
    new = {one.relative_to(tmp_path).as_posix() for one in tmp_path.rglob("*") if one.is_file() and one not in had}
    assert new == {target.name, "better_outer.inc", "in/better_nodes.inc", "undo.npz"}
    assert had[path].replace(b"outer.inc", b"better_outer.inc") == target.read_bytes()
    assert b"in/better_nodes.inc" in (tmp_path / "better_outer.inc").read_bytes()
    undo.bring_back(tmp_path / "undo.npz", target, target)
    assert target.read_bytes() == had[path]
    assert (tmp_path / "in" / "better_nodes.inc").read_bytes() == had[tmp_path / "in" / "nodes.inc"]
    same = path.with_stem("same")
    again = patch_of(mesh, same)
    assert again is not None
    again.write(mesh)
    assert same.read_bytes() == had[path]


def fixed_labels(path: Path) -> list[int]:
    """Numbers of the points that have no place."""
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, path.with_stem("better"))
    assert patch is not None
    return np.asarray(mesh.point_data["label"])[patch.is_fixed].tolist()


def test_points_that_define_a_system_stay(tmp_path: Path) -> None:
    """Points 1 to 3 define one; those that are given in another move."""
    grids = ["GRID,1,,0.,0.,0.", "GRID,2,,0.,0.,1.", "GRID,3,,1.,0.,0.", "GRID,4,0,0.,1.,0.", "GRID,5,7,1.,90.,1."]
    grids += ["GRID,6,7,2.,0.,0.", "GRID,7,,3.,3.,3."]
    lines = ["CORD1R,9,1,2,3", "CORD2C,7,,0.,0.,0.,0.,0.", ",1.,1.,0.,0.", *grids]
    lines += ["CTETRA,1,1,1,3,4,2", "CTETRA,2,1,5,6,7,4"]
    path = tmp_path / "a.bdf"
    path.write_text("\n".join(["BEGIN BULK", *lines, "ENDDATA", ""]))
    assert fixed_labels(path) == [1, 2, 3]
    path.write_text(path.read_text().replace("BEGIN BULK", "BEGIN BULK\nGRDSET,,7"))
    assert fixed_labels(path) == [1, 2, 3]


SYSTEMS = {
    7: ("CORD2C,7,,-1.,-1.,-1.,-1.,-1.,0.\n,0.,-1.,-1.", lambda x, y, z: (np.hypot(x, y), _degrees(y, x) + 360, z)),
    8: (
        "CORD2S,8,,-1.,-1.,-1.,-1.,-1.,0.\n,0.,-1.,-1.",
        lambda x, y, z: (np.sqrt(x * x + y * y + z * z), _degrees(np.hypot(x, y), z), _degrees(y, x)),
    ),
    9: ("CORD2R,9,,-1.,-1.,-1.,0.,-1.,-1.\n,-1.,0.,-1.", lambda x, y, z: (y, z, x)),
}
"""Cards, and coordinates from the point (-1, -1, -1) on; the axes z, x and y of the last are x, y and z."""


def _degrees(a: float, b: float) -> float:
    return float(np.degrees(np.arctan2(a, b)))


@pytest.mark.parametrize("width", [8, 16, 0])
def test_points_in_other_systems_are_turned_back(width: int, tmp_path: Path) -> None:
    """Angles stay near what they were; fields keep their width, or become wider."""
    mesh = bricks()
    lines = ["BEGIN BULK", *(card for card, _ in SYSTEMS.values())]
    for n, point in enumerate((mesh.points + 1).tolist(), 1):
        system = (0, 7, 8, 9)[(n + n // 16 * 2) % 4]
        own = SYSTEMS[system][1](*point) if system else [x - 1 for x in point]
        texts = [f"{x:.6f}"[:8] if width == 8 else f"{x:.9f}" for x in own]
        if width == 8:
            lines.append(f"GRID    {n:<8d}{system:<8d}" + "".join(f"{x:>8s}" for x in texts))
        elif width:
            lines += [f"GRID*   {n:<16d}{system:<16d}{texts[0]:>16s}{texts[1]:>16s}", f"*       {texts[2]:>16s}"]
        else:
            lines.append(f"GRID,{n},{system},{','.join(texts)}")
    for n, cell in enumerate((mesh.connectivity.reshape(-1, 8) + 1).tolist(), 1):
        lines.append(f"CHEXA,{n},1,{','.join(map(str, cell[:6]))}\n,{cell[6]},{cell[7]}")
    path, better = tmp_path / "a.bdf", tmp_path / "better.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    before = meshgauge.read(path)
    np.testing.assert_allclose(before.points, mesh.points, atol=1e-4)
    assert fixed_labels(path) == []
    done = command_line.run("improve", path, "-o", better, "--everywhere", "--json", "--undo", tmp_path / "undo.npz")
    assert done.returncode == 0, done.stderr
    report, after = json.loads(done.stdout), meshgauge.read(better)
    values = [meshgauge.measure(one).values for one in (before, after)]
    assert report["after"]["all"]["min"] == values[1].min() > values[0].min()
    moved = np.flatnonzero((before.points != after.points).any(axis=1)) + 1
    assert {(n + n // 16 * 2) % 4 for n in moved.tolist()} == {0, 1, 2, 3}
    old, new = (one.read_text().splitlines() for one in (path, better))
    changed = [line for line in new if line.startswith("GRID") and line not in old]
    assert {line.replace("*", " ").replace(",", " ").split()[1] for line in changed} <= {str(n) for n in moved}
    for line in new:
        if line.startswith("GRID,") and line.split(",")[2] == "7":
            assert float(line.split(",")[4]) > 180
    patch = patch_of(before, tmp_path / "same.bdf")
    assert patch is not None
    patch.write(before)
    assert (tmp_path / "same.bdf").read_bytes() == path.read_bytes()
    undo.bring_back(tmp_path / "undo.npz", better, better)
    assert better.read_bytes() == path.read_bytes()


PART = "*Part, name=P\n*Node\n1,0.,0.,0.\n2,1.,0.,0.\n3,0.,1.,0.\n4,0.,0.,1.\n*Element, type=C3D4\n1,1,2,3,4\n"
FIRST = "*Instance, name=I, part=P\n"
SECOND = "*Instance, name=J, part=P\n5.,0.,0.\n*End Instance\n"


@pytest.mark.parametrize(
    ("instances", "fixed"),
    [
        (f"{FIRST}*End Instance\n", []),
        (f"{FIRST}1., 0., 0.\n*End Instance\n", [1, 2, 3, 4]),
        (f"{FIRST}*End Instance\n{SECOND}", [1, 2, 3, 4] * 2),
    ],
)
def test_points_of_instances_that_are_moved_or_shared_stay(instances: str, fixed: list[int], tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    path.write_text(f"{PART}*End Part\n*Assembly, name=A\n{instances}*End Assembly\n")
    assert fixed_labels(path) == fixed


def test_a_part_with_several_instances_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    path.write_text(f"{PART}*End Part\n*Assembly, name=A\n{FIRST}*End Instance\n{SECOND}*End Assembly\n")
    done = command_line.run("improve", path, "-o", tmp_path / "b.inp", "--everywhere")
    assert done.returncode == 2
    assert "part 'P' has 2 instances: flatten it" in done.stderr


def test_nodes_in_another_system_of_abaqus_stay(tmp_path: Path) -> None:
    deck = "*Node\n1,0.,0.,0.\n2,1.,0.,0.\n3,0.,1.,0.\n*Node, system=C\n4,1.,0.,1.\n*Element, type=C3D4\n1,1,2,3,4\n"
    (tmp_path / "a.inp").write_text(f"{deck}*Orientation, name=O, definition=nodes\n2, 3\n")
    assert fixed_labels(tmp_path / "a.inp") == [2, 3, 4]


def test_nodes_that_the_file_leaves_out_hold_those_of_their_cells(tmp_path: Path) -> None:
    """They are read halfway between others, and would move with them."""
    grids = [f"GRID,{n},,{x}" for n, x in enumerate(("0.,0.,0.", "1.,0.,0.", "0.,1.,0.", "0.,0.,1.", ".5,0.,0."), 1)]
    lines = [*grids, "GRID,6,,2.,2.,2.", "CTETRA,1,1,1,2,3,4,5", "CTETRA,2,1,2,3,4,6"]
    (tmp_path / "a.bdf").write_text("\n".join(["BEGIN BULK", *lines, "ENDDATA", ""]))
    assert sorted(set(fixed_labels(tmp_path / "a.bdf"))) == [-1, 1, 2, 3, 4, 5]


NARROW = "GRID          14        1000000.     .25    -.5            246        $ within"
"""The point in the middle, on a face of the boundary: with 8 columns it can only go to another."""


def far_away(path: Path, narrow: str, far: float = 1e6) -> Path:
    """Eight bricks a million from the origin, in wide fields but for the point in the middle."""
    ticks = (far, far + 0.5, far + 1.0), (0.0, 0.5, 1.0), (-1.0, -0.5, 0.0)
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3).tolist()
    lines = [f"GRID*,{n},,{x},{y}\n*,{z}" for n, (x, y, z) in enumerate(points, 1)]
    lines[13] = narrow
    ids = np.arange(27).reshape(3, 3, 3) + 1
    corners = [ids[i : 2 + i, j : 2 + j, k : 2 + k].ravel() for i, j, k in CUBE]
    for n, cell in enumerate(np.stack(corners, axis=1).tolist(), 1):
        lines.append(f"CHEXA,{n},1,{','.join(map(str, cell[:6]))}\n,{cell[6]},{cell[7]}")
    path.write_bytes("\r\n".join("\n".join(lines).split("\n")).encode())
    return path


@pytest.mark.parametrize("narrow", [NARROW, "GRID,14,,1000000.,.25,-.5,,246"])
def test_a_grid_gets_wide_fields_where_rounding_would_break_a_promise(narrow: str, tmp_path: Path) -> None:
    path, better = far_away(tmp_path / "a.bdf", narrow), tmp_path / "better.bdf"
    done = command_line.run("improve", path, "-o", better, "--everywhere", "--json", "--undo", tmp_path / "undo.npz")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert any("1 point gets a wider field in the file" in note for note in report["notes"])
    assert np.nanmin(meshgauge.measure(meshgauge.read(path)).values) <= 0
    assert np.nanmin(meshgauge.measure(meshgauge.read(better)).values) == report["after"]["all"]["min"] > 0.99
    old, new = (one.read_bytes().decode().split("\r\n") for one in (path, better))
    at = old.index(narrow)
    assert [*new[:at], narrow, *new[at + 2 :]] == old
    first, second = new[at], new[at + 1]
    if "," in narrow:
        words = [*first.split(","), *second.split(",")]
        assert [words[n] for n in (0, 1, 2, 5, 6, 7, 8)] == ["GRID*", "14", "", "*", "-.5", "", "246"]
    else:
        assert len(first) == 72
        words = [first[:8].strip(), *(first[n : n + 16].strip() for n in range(8, 72, 16))]
        assert words[:3] == ["GRID*", "14", ""]
        assert second == "*".ljust(8) + f"{'-.5':>16}{'':16}{'246':>16} $ within"
    np.testing.assert_allclose([float(x) for x in words[3:5]], [1_000_000.5, 0.5], atol=1e-6)
    assert all(len(x) <= 16 for x in words)
    assert undo.bring_back(tmp_path / "undo.npz", better, better)
    assert better.read_bytes() == path.read_bytes()


FITS = "GRID          14         100000.     .25    -.5            246        $ within"


@pytest.mark.parametrize(("narrow", "far"), [(FITS, 1e5), (f"{NARROW}\r\n+", 1e6)])
def test_a_grid_keeps_its_fields_where_they_do_or_the_card_goes_on(narrow: str, far: float, tmp_path: Path) -> None:
    path, better = far_away(tmp_path / "a.bdf", narrow, far), tmp_path / "better.bdf"
    done = command_line.run("improve", path, "-o", better, "--everywhere", "--json")
    assert done.returncode == (0 if narrow == FITS else 1), done.stderr
    old, new = (one.read_bytes().splitlines() for one in (path, better))
    assert sum(a != b for a, b in zip(old, new, strict=True)) == (narrow == FITS)
    assert not any("wider" in note for note in json.loads(done.stdout)["notes"])


@pytest.mark.parametrize(
    ("name", "added", "lost"),
    [
        ("abaqus", "*Dload\r\nE, GRAV, 9.81, 0., 0., 1.\r\n", "*HEADING, *NSET, *STEP, *STATIC, *BOUNDARY, *CLOAD"),
        ("gmsh 2.2", "$Periodic\n0\n$EndPeriodic\n", "$PERIODIC"),
        ("medit", "Corners\n1\n1\nEnd\n", "CORNERS"),
    ],
)
def test_what_is_lost_where_cells_change_is_listed(name: str, added: str, lost: str, tmp_path: Path) -> None:
    path = PATCHED[name][1](tmp_path)
    text = path.read_text().replace("\nEnd\n", "\n") if name == "medit" else path.read_text()
    path.write_text(text + added)
    done = command_line.run("improve", path, "-o", path.with_stem("other"), "--split-hopeless", "--quiet")
    assert done.returncode in (0, 1), done.stderr
    line = next(line for line in done.stderr.splitlines() if "without what the file holds beside it" in line)
    assert f"beside it: {lost}" in line
