"""Cells that are renumbered in their files: nothing else changes, or the file is refused by name."""

from __future__ import annotations

from pathlib import Path

import command_line
import numpy as np
import pytest
from patch_files import PATCHED, WORD

import meshgauge
from meshgauge import Mesh, WriteError
from meshgauge.files import undo
from meshgauge.io.patching import patch_of

NAMES = (
    "abaqus",
    "su2",
    "nastran",
    "nastran free",
    "gmsh 2.2",
    "gmsh 4.0",
    "gmsh 4.1",
    "medit",
    "exodus",
    "exodus classic",
)
MIRROR = (4, 5, 6, 7, 0, 1, 2, 3)
TURNED = (2, 5, 20)


def turned(mesh: Mesh) -> Mesh:
    """The mesh with some cells numbered in reverse."""
    connectivity = np.array(mesh.connectivity)
    for cell in TURNED:
        at = mesh.offsets[cell]
        connectivity[at : at + 8] = mesh.connectivity[at : at + 8][list(MIRROR)]
    return mesh.replace(connectivity=connectivity)


def made(name: str, folder: Path) -> Path:
    """A file with nothing that names faces by local numbers."""
    path = PATCHED[name][1](folder)
    if "exodus" in name:
        netCDF4 = pytest.importorskip("netCDF4")
        with netCDF4.Dataset(path, "a") as file:
            for array in ("elem_ss1", "side_ss1"):
                file.renameVariable(array, f"other_{array}")
    (folder / "out").mkdir()
    return path


@pytest.mark.parametrize("name", NAMES)
def test_only_nodes_of_renumbered_cells_change(name: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / path.name, changes="order")
    assert patch is not None
    patch.write(turned(mesh), undo_file=tmp_path / "undo.npz")
    back = meshgauge.read(patch.target)
    assert np.array_equal(back.connectivity, turned(mesh).connectivity)
    assert np.array_equal(back.points, mesh.points)
    old, new = path.read_bytes(), patch.target.read_bytes()
    if PATCHED[name][2] != "bytes":
        words = [WORD.findall(data) for data in (old, new)]
        assert sum(a != b for a, b in zip(*words, strict=True)) == 8 * len(TURNED)
        assert [WORD.sub(b"", line) for line in old.split(b"\n")] == [WORD.sub(b"", line) for line in new.split(b"\n")]
    else:
        assert 0 < sum(a != b for a, b in zip(old, new, strict=True)) <= 8 * 8 * len(TURNED)
    assert b"".join(undo.restored(tmp_path / "undo.npz", patch.target)[""].pieces()) == old
    patch.write(mesh)
    assert patch.target.read_bytes() == old


@pytest.mark.parametrize("name", ["abaqus", "nastran", "gmsh 2.2"])
def test_from_a_shell(name: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / path.name, changes="order")
    assert patch is not None
    patch.write(turned(mesh))
    done = command_line.run("orient", patch.target, "--in-place", "--undo", tmp_path / "undo.npz")
    assert done.returncode == 0, done.stderr
    assert "3 of 27 hexahedron cells were numbered in reverse and are renumbered" in done.stdout
    before, after = path.read_bytes(), patch.target.read_bytes()
    assert np.array_equal(np.sort(meshgauge.read(patch.target).connectivity), np.sort(mesh.connectivity))
    assert (meshgauge.measure(meshgauge.read(patch.target)).values > -1).all()
    assert len(before.splitlines()) == len(after.splitlines())
    done = command_line.run("orient", path, "-o", tmp_path / "same")  # an extension of no format: of the input's
    assert done.returncode == 2
    done = command_line.run("orient", path, "-o", tmp_path / f"same{path.suffix}")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"same{path.suffix}").read_bytes() == before


ABAQUS_FACES = ((1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1))
EXODUS_SIDES = ((1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (1, 5, 8, 4), (1, 4, 3, 2), (5, 6, 7, 8))
ON_FACES = (
    b"*Elset, elset=mixed\r\n1, 3, 4\r\n*Elset, elset=turned\r\n3, 6, 21\r\n*Surface, name=S\r\n mixed , S1 \r\n"
    b"turned, S2\r\n5,S3\r\n*Dload, op=NEW\r\n3, P1, 5.\r\nmixed, p2nu, 7.  \r\nturned, GRAV, 9.81, 0., 0., 1.\r\n"
)


def on_faces(path: Path) -> list[tuple[str, list[int], str]]:
    """What the lines of a deck name: a keyword, the nodes of a face of an element, and the rest of the line."""
    elements: dict[int, list[int]] = {}
    sets: dict[str, list[int]] = {"mixed": [1, 3, 4], "turned": [3, 6, 21]}
    named, keyword = [], ""
    for line in path.read_text().splitlines():
        fields = [field.strip() for field in line.split(",")]
        if line.startswith("*"):
            keyword = fields[0].lower()
        elif keyword == "*element":
            elements[int(fields[0])] = [int(field) for field in fields[1:9]]
        elif keyword in ("*surface", "*dload") and "GRAV" not in line:
            for element in sets.get(fields[0]) or [int(fields[0])]:
                nodes = [elements[element][corner - 1] for corner in ABAQUS_FACES[int(fields[1][1]) - 1]]
                named.append((keyword, sorted(nodes), ",".join(fields[2:])))
    return sorted(named)


def test_faces_that_abaqus_names_stay_where_they_are(tmp_path: Path) -> None:
    """Elements 3, 6 and 21 are renumbered: their first two faces change places."""
    path = PATCHED["abaqus"][1](tmp_path)
    (tmp_path / "out").mkdir()
    text = path.read_bytes()
    path.write_bytes(text.replace(b"*Cload", ON_FACES + b"*Cload"))
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / "deck.inp", changes="order")
    assert patch is not None
    patch.write(turned(mesh), undo_file=tmp_path / "undo.npz")
    assert len(on_faces(path)) == 3 + 3 + 1 + 1 + 3
    assert on_faces(patch.target) == on_faces(path)
    new = patch.target.read_bytes()
    assert b"\r\n1, S1 \r\n3, S2 \r\n4, S1 \r\nturned, S1\r\n5,S3\r\n" in new
    assert b"\r\n3, P2, 5.\r\n1, p2nu, 7.  \r\n3, p1nu, 7.  \r\n4, p2nu, 7.  \r\nturned, GRAV" in new
    assert b"".join(undo.restored(tmp_path / "undo.npz", patch.target)[""].pieces()) == path.read_bytes()
    back = patch_of(meshgauge.read(patch.target), path, changes="order")
    assert back is not None
    back.write(mesh, overwrite=True)
    assert on_faces(path) == on_faces(patch.target)


@pytest.mark.parametrize("name", ["exodus", "exodus classic"])
def test_sides_that_exodus_names_stay_where_they_are(name: str, tmp_path: Path) -> None:
    netCDF4 = pytest.importorskip("netCDF4")
    path = PATCHED[name][1](tmp_path)
    with netCDF4.Dataset(path, "a") as file:
        n = file.dimensions[file["elem_ss1"].dimensions[0]].size
        file["elem_ss1"][:] = ([3, 6, 21, 4] * n)[:n]
        file["side_ss1"][:] = ([5, 6, 1, 5] * n)[:n]
    (tmp_path / "out").mkdir()
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / path.name, changes="order")
    assert patch is not None
    patch.write(turned(mesh))

    def sides(path: Path) -> list[frozenset[int]]:
        with netCDF4.Dataset(path) as file:
            nodes = np.asarray(file["connect1"])
            rows = zip(file["elem_ss1"][:].tolist(), file["side_ss1"][:].tolist(), strict=True)
            return [frozenset(nodes[cell - 1][np.array(EXODUS_SIDES[side - 1]) - 1].tolist()) for cell, side in rows]

    assert sides(patch.target) == sides(path)
    with netCDF4.Dataset(patch.target) as file:
        assert file["side_ss1"][:4].tolist() == [6, 5, 1, 5][:n]


SHELLS = (
    "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,1.,1.,0.\nGRID,4,,0.,1.,0.\nGRID,5,,2.,0.,0.\nGRID,6,,2.,1.,0.\n"
    "CQUAD4,1,1,1,2,3,4\nCQUAD4,2,1,2,3,6,5"
)


@pytest.mark.parametrize(
    ("name", "old", "new", "error"),
    [
        ("abaqus", "*Cload", "*Dload\r\n3, EDNOR1, 1.\r\n*Cload", r"\*DLOAD in line \d+ names"),
        ("abaqus", "*Cload", "*Film\r\n, F1, 1., 2.\r\n*Cload", ""),
        ("abaqus", "*Cload", "*Surface, name=S\r\n3, SPOS\r\n*Cload", r"\*SURFACE in line \d+ names"),
        ("abaqus", "*Cload", "*Rebar, element=continuum, name=R\r\n3, 1.\r\n*Cload", r"\*REBAR in line \d+ names"),
        ("abaqus", "*Cload", "*Solid section, elset=E, composite, stack direction=3\r\n*Cload", ""),
        ("nastran", "ENDDATA", "CHBDYE,900,3,1\nENDDATA", r"CHBDYE in line \d+ names"),
        ("gmsh 2.2", "$Elements", "$ElementNodeData\n$EndElementNodeData\n$Elements", r"\$ElementNodeData names"),
    ],
)
def test_what_cannot_follow_is_refused_by_name(name: str, old: str, new: str, error: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    path.write_bytes(path.read_bytes().replace(old.encode(), new.encode()))
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / path.name, changes="order")
    assert patch is not None
    if not error:  # an element of the set or not: what is on all of them can be written line by line, a section cannot
        error = r"\*SOLID SECTION in line \d+ names" if "section" in new else r"\*FILM in line \d+ names"
    with pytest.raises(WriteError, match=f"{error} faces or sides of "):
        patch.write(turned(mesh))
    assert not patch.target.exists()
    patch.write(mesh)
    assert patch.target.read_bytes() == path.read_bytes()


@pytest.mark.parametrize("card", ["PLOAD2,1,5.,1,THRU,2", "PLOAD4,1,2,5.", "CQUAD4,2,1,2,3,6,5,,.1"])
def test_pressure_and_offsets_of_shells_are_refused(card: str, tmp_path: Path) -> None:
    path = tmp_path / "a.bdf"
    plain = f"BEGIN BULK\n{SHELLS}\nENDDATA\n"
    deck = (
        plain.replace("CQUAD4,2,1,2,3,6,5", card) if "CQUAD4" in card else plain.replace("ENDDATA", f"{card}\nENDDATA")
    )
    path.write_text(deck)
    done = command_line.run("orient", path, "--in-place")
    assert done.returncode == 2, done.stdout
    assert f"{card.split(',')[0]} in line" in done.stderr
    assert "faces or sides of element 2" in done.stderr
    assert path.read_text() == deck
    path.write_text(plain)
    done = command_line.run("orient", path, "--in-place")
    assert done.returncode == 0, done.stderr
    assert path.read_text() != plain


def test_no_file_of_another_format_takes_the_place_of_one(tmp_path: Path) -> None:
    """MFEM's files are not written, and Medit's have the same extension."""
    path = PATCHED["mfem"][1](tmp_path)
    had = path.read_text().replace("1 5 1 17 21 5 2 18 22 6", "1 5 2 18 22 6 1 17 21 5")
    path.write_text(had)
    done = command_line.run("orient", path, "--in-place")
    assert done.returncode == 2
    assert "cannot be written, and Medit has the same extension: nothing is replaced" in done.stderr
    assert path.read_text() == had
    done = command_line.run("orient", path, "-o", tmp_path / "other.mesh")
    assert done.returncode == 0, done.stderr
    assert "MFEM is not patched where cells change: the mesh is written as Medit" in done.stderr


def test_a_cell_with_a_node_twice_is_refused(tmp_path: Path) -> None:
    deck = "*NODE\n1,0.,0.,0.\n2,1.,0.,0.\n3,1.,1.,0.\n4,0.,0.,1.\n5,1.,0.,1.\n6,1.,1.,1.\n*ELEMENT,TYPE=C3D8\n"
    (tmp_path / "a.inp").write_text(deck + "1,1,2,3,3,4,5,6,6\n")
    mesh = meshgauge.read(tmp_path / "a.inp")
    patch = patch_of(mesh, tmp_path / "b.inp", changes="order")
    assert patch is not None
    with pytest.raises(WriteError, match=r"element 1 .* does not stand in the file with its nodes, each once"):
        patch.write(mesh.replace(connectivity=mesh.connectivity[list(MIRROR)]))
    assert not (tmp_path / "b.inp").exists()
