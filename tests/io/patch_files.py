"""Files of formats that are patched, each with what else such files hold, and awkward ways to write numbers."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cgns_files
import fluent_files
import h5py
import meshio
import numpy as np
import ovm_files
import pytest

import meshgauge
from meshgauge import Mesh

CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def bricks(n: int = 3) -> Mesh:
    """Hexahedra of the unit cube, inner points pulled aside."""
    ticks = np.arange(n + 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3) / n
    ids = np.arange(len(points)).reshape(n + 1, n + 1, n + 1)
    cells = np.stack([ids[i : n + i, j : n + j, k : n + k].ravel() for i, j, k in CUBE], axis=1)
    inside = ((points > 0) & (points < 1)).all(axis=1)
    shift = np.random.default_rng(2).uniform(-0.2, 0.2, points.shape) * inside[:, None]
    return Mesh.from_arrays(points + shift, {"hexahedron": cells})


def rows(mesh: Mesh, form: str = "%.9g", separator: str = "  ") -> list[str]:
    """The coordinates of each point."""
    return [separator.join(form % x for x in row) for row in mesh.points.tolist()]


def cells(mesh: Mesh, first: int = 0) -> list[list[int]]:
    return (mesh.connectivity.reshape(-1, 8) + first).tolist()


def abaqus(folder: Path) -> Path:
    """A deck with steps, loads, comments, odd spacing, exponents of Fortran and lines that end as in Windows."""
    mesh = bricks()
    nodes = [
        f"  {n},{x},   {y} ,{z}," if n % 2 else f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(_fortran(mesh), 1)
    ]
    elements = [f"{n}, " + ", ".join(map(str, row)) for n, row in enumerate(cells(mesh, 1), 1)]
    lines = ["** a deck", "*Heading", " with, words 1.5", "*NODE, NSET=all", *nodes[:9], "** 7, 1., 2., 3.", *nodes[9:]]
    lines += ["*Element, type=C3D8, elset=E", *elements, "*Nset, nset=fix", "1, 2, 3", "*Step", "*Static", "0.1, 1."]
    lines += ["*Boundary", "fix, 1, 3", "*Cload", "64, 3, -1.0D+01", "*End Step", "** the end"]
    return _text(folder / "deck.inp", lines, "\r\n")


def su2(folder: Path) -> Path:
    """Comments, tabs, numbers behind the coordinates, and keywords of the solver."""
    mesh = bricks()
    points = [f" {row}\t{n}" for n, row in enumerate(rows(mesh, "%.7e", "\t "))]
    points[3] += " % a comment 1.0 2.0"
    elements = [f"12 {' '.join(map(str, row))} {n}" for n, row in enumerate(cells(mesh))]
    lines = [
        "% 1 2 3",
        "NDIME= 3",
        f"NELEM= {len(elements)}",
        *elements,
        "",
        f"NPOIN = {mesh.n_points} {mesh.n_points}",
    ]
    lines += [*points[:5], "", *points[5:], "NMARK= 1", "MARKER_TAG= wall", "MARKER_ELEMS= 1", "9 0 1 5 4", "% end"]
    return _text(folder / "mesh.su2", lines)


def _fortran(mesh: Mesh) -> list[tuple[str, str, str]]:
    """Coordinates, every third with an exponent, some of them with a D."""
    return [(f"{x:.8g}", f"{y:.7E}".replace("E", "D"), f"{z:.10f}") for x, y, z in mesh.points.tolist()]


def _text(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode())
    return path


def nastran(folder: Path, *, width: int = 8, separator: str = "") -> Path:
    """A deck with a case control, comments, exponents without a letter, and points of a local system."""
    mesh = bricks()
    points = [
        " " * 0 + line for n, row in enumerate(mesh.points.tolist(), 1) for line in _grid(n, row, width, separator)
    ]
    elements = []
    for n, row in enumerate(cells(mesh, 1), 1):
        fields = [f"{k:<8d}" for k in row]
        elements += ["CHEXA   " + f"{n:<8d}" + f"{1:<8d}" + "".join(fields[:6]), " " * 8 + "".join(fields[6:])]
    lines = [
        "SOL 101",
        "CEND",
        "LOAD = 1",
        "BEGIN BULK",
        "$ GRID,1,,0.,0.,0.",
        *points[:4],
        "$ between",
        *points[4:],
        *elements,
    ]
    lines += [
        "PSOLID  1       1",
        "MAT1    1       2.1+5           .3",
        "FORCE   1       64      0       1.0-3   0.0     0.0     1.0",
    ]
    return _text(folder / "deck.bdf", [*lines, "ENDDATA"])


def _grid(n: int, row: list[float], width: int, separator: str) -> list[str]:
    texts = [f"{x:.4f}" if k else f"{x:.4e}".replace("e-0", "-").replace("e+0", "+") for k, x in enumerate(row)]
    if separator:
        return [f"GRID, {n},,{','.join(texts)}  $ {n}"]
    if width == 8:
        return [f"GRID    {n:<8d}{'':8s}" + "".join(f"{text:>8s}" for text in texts)]
    fields = [f"{text:<16s}" for text in texts]
    return [f"GRID*   {n:<16d}{'0':>16s}{fields[0]}{fields[1]}", f"*       {fields[2]}"]


def gmsh(folder: Path, *, version: str, is_binary: bool) -> Path:
    """As meshio writes it."""
    mesh = bricks()
    whole = meshio.Mesh(mesh.points, {"hexahedron": mesh.connectivity.reshape(-1, 8)})
    whole.write(folder / "mesh.msh", file_format=version, binary=is_binary)
    return folder / "mesh.msh"


def gmsh_40(folder: Path) -> Path:
    """By hand: each node after its tag, some of them parametric."""
    mesh = bricks()
    nodes = [f"{n} {row}" for n, row in enumerate(rows(mesh), 1)]
    elements = [f"{n} " + " ".join(map(str, row)) for n, row in enumerate(cells(mesh, 1), 1)]
    lines = ["$MeshFormat", "4.0 0 8", "$EndMeshFormat", "$Comments", "1 2 3", "$EndComments", "$Nodes", "2 64"]
    lines += ["1 2 1 4", *(f"{node} 0.5 0.25" for node in nodes[:4]), "1 3 0 60", *nodes[4:], "$EndNodes"]
    lines += ["$Elements", f"1 {len(elements)}", f"1 3 5 {len(elements)}", *elements, "$EndElements"]
    return _text(folder / "mesh.msh", lines)


def medit(folder: Path, *, suffix: str, is_single: bool = False) -> Path:
    """As our writer makes it; the text with comments, and numbers of single precision."""
    path = folder / f"mesh.{suffix}"
    meshgauge.write(path, bricks())
    if suffix == "mesh":
        text = path.read_text().replace("Vertices", "# 1 2 3\nVertices # of 64\n", 1)
        if is_single:
            text = text.replace("MeshVersionFormatted 2", "MeshVersionFormatted 1")
            assert "MeshVersionFormatted 1" in text
        path.write_text(text)
    return path


def vtu(folder: Path, *, mode: str, compressor: str = "None", header: int = 32, is_single: bool = False) -> Path:
    """By VTK: in small blocks, with data of points and cells, in front of the points and behind."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    path, writer = folder / "cube.vtu", vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(_with_data(is_single=is_single).to_pyvista())
    getattr(writer, f"SetDataModeTo{mode.split()[0].title()}")()
    writer.SetEncodeAppendedData("base64" in mode)
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    getattr(writer, f"SetHeaderTypeToUInt{header}")()
    writer.SetBlockSize(480)
    assert writer.Write() == 1
    return path


def vtk_legacy(folder: Path, *, is_binary: bool, is_single: bool = False) -> Path:
    """By VTK, with data of points, cells and the file."""
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

    path, writer = folder / "cube.vtk", vtkUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(_with_data(is_single=is_single).to_pyvista())
    writer.SetFileType(2 if is_binary else 1)
    assert writer.Write() == 1
    return path


def vtkhdf(folder: Path, *, is_packed: bool) -> Path:
    """As our writer makes it; or in chunks, packed."""
    path = folder / "cube.vtkhdf"
    meshgauge.write(path, _with_data())
    if is_packed:
        with h5py.File(path, "r+") as file:
            points = file["VTKHDF/Points"][...]
            del file["VTKHDF/Points"]
            file["VTKHDF"].create_dataset("Points", data=points, chunks=(16, 3), compression="gzip")
    return path


def _with_data(*, is_single: bool = False) -> Mesh:
    mesh = bricks()
    return mesh.replace(
        points=mesh.points.astype(np.float32 if is_single else np.float64),
        point_data={"level": np.linspace(0.0, 1.0, mesh.n_points)},
        cell_data={"material": np.arange(mesh.n_cells) // 9},
        field_data={"TIME": np.array([0.25])},
    )


SIDES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
"""Faces of a hexahedron, outward."""


def poly_mesh(folder: Path, points: np.ndarray, bodies: list[list[int]], form: str) -> None:
    """A polyMesh of hexahedra; ``form`` of its points: ascii, binary, single or gzip."""
    owners: dict[tuple[int, ...], list[tuple[int, list[int]]]] = {}
    for cell, nodes in enumerate(bodies):
        for side in SIDES:
            face = [nodes[k] for k in side]
            owners.setdefault(tuple(sorted(face)), []).append((cell, face))
    inner = sorted((one for one in owners.values() if len(one) == 2), key=lambda one: (one[0][0], one[1][0]))
    outer = [one for one in owners.values() if len(one) == 1]
    faces = [one[0][1] for one in (*inner, *outer)]
    folder.mkdir(parents=True)
    text = {
        "faces": [f"4({' '.join(map(str, face))})" for face in faces],
        "owner": [str(one[0][0]) for one in (*inner, *outer)],
        "neighbour": [str(one[1][0]) for one in inner],
    }
    for name, rows_ in text.items():
        body = "\n".join([str(len(rows_)), "(", *rows_, ")"])
        (folder / name).write_text(f"{_head('ascii', name)}\n{body}\n")
    patch = f"walls {{ type wall; nFaces {len(outer)}; startFace {len(inner)}; }}"
    (folder / "boundary").write_text(f"{_head('ascii', 'boundary')}\n1\n(\n{patch}\n)\n")
    if form in ("binary", "single"):
        kind = "<f8" if form == "binary" else "<f4"
        data = (
            f"{_head('binary', 'points', 32 if form == 'single' else 64)}\n{len(points)}\n(".encode()
            + points.astype(kind).tobytes()
        )
        (folder / "points").write_bytes(data + b")\n// end\n")
        return
    lines = [f"({x:.10g} {y:.8e} {z:.10g})" for x, y, z in points.tolist()]
    data = (
        f"{_head('ascii', 'points')}\n// 2 (1 2 3)\n{len(points)}\n(\n" + "\n".join(lines) + "\n)\n\n// end\n"
    ).encode()
    if form == "gzip":
        (folder / "points.gz").write_bytes(gzip.compress(data))
    else:
        (folder / "points").write_bytes(data)


CLASSES = {"points": "vectorField", "faces": "faceList", "boundary": "polyBoundaryMesh"}


def _head(form: str, name: str, bits: int = 64) -> str:
    arch = f'"LSB;label=32;scalar={bits}"'
    kind = CLASSES.get(name, "labelList")
    return f"/* a (comment) */ FoamFile {{ version 2.0; format {form}; arch {arch}; class {kind}; object {name}; }}"


def case(folder: Path, form: str, *, is_decomposed: bool = False) -> Path:
    """A case with a time and settings beside its mesh; or one of two processors that share the points between."""
    mesh, root = bricks(), folder / "case"
    bodies, points = cells(mesh), np.asarray(mesh.points)
    for name, text in (("system/controlDict", "deltaT 1;"), ("0/p", "uniform 0;"), ("0.5/p", "uniform 1;")):
        (root / name).parent.mkdir(parents=True)
        (root / name).write_text(text)
    (root / "Allrun").write_text("#!/bin/sh\n")
    (root / "Allrun").chmod(0o755)
    if not is_decomposed:
        poly_mesh(root / "constant" / "polyMesh", points, bodies, form)
        return root
    for number, own in enumerate((bodies[:12], bodies[12:])):
        ids, nodes = np.unique(np.array(own), return_inverse=True)
        piece = root / f"processor{number}" / "constant" / "polyMesh"
        poly_mesh(piece, points[ids], nodes.reshape(-1, 8).tolist(), form)
        addresses = "\n".join(map(str, ids.tolist()))
        (piece / "pointProcAddressing").write_text(
            f"{_head('ascii', 'pointProcAddressing')}\n{len(ids)}\n(\n{addresses}\n)\n"
        )
    return root


def ansys(folder: Path) -> Path:
    """An archive with a load on a face, and exponents of three digits."""
    mesh = bricks()
    numbered = enumerate(mesh.points.tolist(), 1)
    nodes = [f"{n:9d}{0:9d}{0:9d}" + "".join(_three_digits(x) for x in row) for n, row in numbered]
    heads = [1, 1, 1, 1, 0, 0, 0, 0, 8, 0]
    elements = ["".join(f"{k:9d}" for k in (*heads, n, *row)) for n, row in enumerate(cells(mesh, 1), 1)]
    lines = ["/COM,ANSYS RELEASE 2021 R2", "/PREP7", "ET,1,185", f"NBLOCK,6,SOLID,{len(nodes):9d},{len(nodes):9d}"]
    lines += ["(3i9,6e21.13e3)", *nodes, "N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{len(elements):9d}", "(19i9)"]
    lines += [*elements, "       -1", "SFE,1,1,PRES,0,1.0", "D,1,ALL,0.", "/SOLU", "SOLVE", "FINISH"]
    return _text(folder / "model.cdb", lines, "\r\n")


def _three_digits(x: float) -> str:
    mantissa, exponent = f"{x:.13e}".split("e")
    return f"{mantissa}E{int(exponent):+04d}".rjust(21)


def lsdyna(folder: Path) -> Path:
    """Columns, comments, and constraints behind the coordinates."""
    mesh = bricks()
    nodes = [f"{n:8d}{x:16.8f}{y:16.8E}{z:16.9f}{0:8d}{7:8d}" for n, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    elements = ["".join(f"{k:8d}" for k in (n, 1, *row)) for n, row in enumerate(cells(mesh, 1), 1)]
    lines = ["*KEYWORD", "*TITLE", "a title, 1.0", "*NODE", "$    nid               x", *nodes, "*ELEMENT_SOLID"]
    lines += [*elements, "*PART", "steel", f"{1:10d}{1:10d}{1:10d}", "*LOAD_NODE_POINT"]
    return _text(folder / "model.k", [*lines, f"{64:10d}{3:10d}{1:10d}{-1.0:10.3f}", "*END"])


def unv(folder: Path) -> Path:
    """Doubles of Fortran, and a header before."""
    mesh = bricks()
    lines = ["    -1", "   151", "made by hand", "    -1", "    -1", "  2411"]
    for n, row in enumerate(mesh.points.tolist(), 1):
        lines += [f"{n:10d}{1:10d}{1:10d}{11:10d}", "".join(f"{x:25.16E}" for x in row).replace("E", "D")]
    lines += ["    -1", "    -1", "  2412"]
    for n, row in enumerate(cells(mesh, 1), 1):
        lines += [f"{n:10d}{115:10d}{1:10d}{1:10d}{7:10d}{8:10d}", "".join(f"{k:10d}" for k in row)]
    return _text(folder / "model.unv", [*lines, "    -1"])


KUHN = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
"""Tetrahedra of a hexahedron."""


def tetgen(folder: Path) -> Path:
    """A pair of files, with attributes and comments."""
    mesh = bricks()
    bodies = [[row[k] for k in tetra] for row in cells(mesh) for tetra in KUHN]
    points = [f"{n}  {row}  {n}.5  0" for n, row in enumerate(rows(mesh))]
    _text(folder / "mesh.ele", [f"{len(bodies)} 4 0", *(f"{n} {' '.join(map(str, b))}" for n, b in enumerate(bodies))])
    return _text(folder / "mesh.node", ["# 1 2 3 4", f"{len(points)} 3 1 1", *points, "# made by hand"])


def rf(folder: Path) -> Path:
    """Cells by their faces."""
    mesh = bricks()
    lines = [f"{len(cells(mesh))} 0"]
    for n, row in enumerate(cells(mesh)):
        lines += [f"{n} 6", *(f"{k} 4 {' '.join(str(row[i]) for i in side)}" for k, side in enumerate(SIDES))]
    _text(folder / "mesh.ele", lines)
    return _text(folder / "mesh.node", [f"{mesh.n_points} 3 0 0", *(f"{n} {x}" for n, x in enumerate(rows(mesh)))])


def mfem(folder: Path) -> Path:
    """Comments, and a boundary."""
    mesh = bricks()
    lines = ["MFEM mesh v1.0", "# 1 2 3", "dimension", "3", "elements", str(len(cells(mesh)))]
    lines += [f"1 5 {' '.join(map(str, row))}" for row in cells(mesh)]
    lines += ["boundary", "1", "1 3 0 1 5 4", "vertices", str(mesh.n_points), "3", *rows(mesh, "%.12g", "\t"), ""]
    return _text(folder / "cube.mesh", lines)


def by_meshio(folder: Path, *, name: str, file_format: str) -> Path:
    """As meshio writes it."""
    mesh = bricks()
    whole = meshio.Mesh(mesh.points, {"hexahedron": mesh.connectivity.reshape(-1, 8)})
    whole.write(folder / name, file_format=file_format)
    return folder / name


def written_by(name: str) -> Callable[[Path], Path]:
    """A file as our own writer makes it."""

    def make(folder: Path) -> Path:
        meshgauge.write(folder / name, bricks())
        return folder / name

    return make


def exodus(folder: Path, kind: str, **how: Any) -> Path:
    """By netCDF4: with two times, a field and a set of sides."""
    netCDF4 = pytest.importorskip("netCDF4")
    mesh, path = bricks(), folder / "mesh.e"
    with netCDF4.Dataset(path, "w", format=kind) as file:
        sizes = {"len_string": 33, "num_dim": 3, "num_nodes": mesh.n_points, "num_elem": mesh.n_cells, "num_el_blk": 1}
        sizes |= {"num_el_in_blk1": mesh.n_cells, "num_nod_per_el1": 8, "time_step": None, "num_side_ss1": 2}
        for name, size in sizes.items():
            file.createDimension(name, size)
        file.api_version = np.float32(5.22)
        for axis, letter in enumerate("xyz"):
            file.createVariable(f"coord{letter}", "f8", ("num_nodes",), **how)[:] = mesh.points[:, axis]
        connect = file.createVariable("connect1", "i4", ("num_el_in_blk1", "num_nod_per_el1"))
        connect.elem_type = "HEX8"
        connect[:] = np.array(cells(mesh, 1))
        file.createVariable("eb_prop1", "i4", ("num_el_blk",))[:] = 7
        file.createVariable("eb_status", "i4", ("num_el_blk",))[:] = 1
        file.createVariable("elem_ss1", "i4", ("num_side_ss1",))[:] = [1, 2]
        file.createVariable("side_ss1", "i4", ("num_side_ss1",))[:] = [5, 6]
        file.createVariable("time_whole", "f8", ("time_step",))[:] = [0.0]
    return path


def cgns(folder: Path, **how: Any) -> Path:
    """By h5py; ``how`` its coordinates are stored."""
    mesh, path = bricks(), folder / "mesh.cgns"
    with h5py.File(path, "w") as file:
        zone = cgns_files.zone(cgns_files.base(file), "Zone", mesh.points, mesh.n_cells)
        cgns_files.section(zone, "Bricks", 17, 1, mesh.n_cells, np.array(cells(mesh, 1)).ravel())
        if how:
            for letter in "XYZ":
                group = zone["GridCoordinates"][f"Coordinate{letter}"]
                values = group[" data"][...]
                del group[" data"]
                group.create_dataset(" data", data=values, **how)
    return path


def hedra(folder: Path) -> Path:
    """Cells by faces, each face of its own."""
    mesh = bricks()
    faces = [[row[k] + 1 for k in side] for row in cells(mesh) for side in SIDES]
    lines = [
        f"{mesh.n_points} {len(faces)} {mesh.n_cells}",
        *rows(mesh),
        *(f"4 {' '.join(map(str, f))}" for f in faces),
    ]
    lines += [f"6 {' '.join(str(6 * n + k + 1) for k in range(6))}" for n in range(mesh.n_cells)]
    return _text(folder / "mesh.hedra", lines)


def elmer(folder: Path) -> Path:
    """Four files of one name."""
    mesh = bricks()
    _text(folder / "mesh.header", [f"{mesh.n_points} {mesh.n_cells} 1", "2", "808 27", "404 1"])
    _text(folder / "mesh.elements", [f"{n} 1 808 {' '.join(map(str, row))}" for n, row in enumerate(cells(mesh, 1), 1)])
    _text(folder / "mesh.boundary", ["1 1 1 0 404 1 2 6 5"])
    return _text(folder / "mesh.nodes", [f"{n} -1 {row}" for n, row in enumerate(rows(mesh), 1)])


def fluent(folder: Path, *, form: str) -> Path:
    """By its faces, hexadecimal; the points in two zones, as text, as bytes of 4 or 8, or in HDF5."""
    mesh, half = bricks(), 20
    if form == "hdf":
        return fluent_files.cff(folder / "cube.msh.h5", mesh)
    faces, bodies = cgns_files.faces_of(mesh)
    owner = np.zeros((2, len(faces)), int)
    for cell, row in enumerate(bodies, 1):
        for face in row:
            owner[int(face > 0), abs(face) - 1] = cell
    rows_ = [f"{len(face):x} " + " ".join(f"{k:x}" for k in face) + f" {a:x} {b:x}"
             for face, a, b in zip(faces, *owner.tolist(), strict=True)]  # fmt: skip
    path = folder / "cube.msh"
    with path.open("wb") as file:
        file.write(b'(0 "by (hand")\n(2 3)\n(10 (0 1 40 0 3))\n')
        for first, part in ((1, mesh.points[:half]), (half + 1, mesh.points[half:])):
            head = f"({first // half + 1:x} {first:x} {first + len(part) - 1:x} 1 3)"
            if form == "text":
                lines = "\n".join(" ".join(f"{x:.12e}" for x in row) for row in part.tolist())
                file.write(f"(10 {head}(\n{lines}\n))\n".encode())
            else:
                number, kind = (2010, "<f4") if form == "single" else (3010, "<f8")
                file.write(f"({number} {head}\n(".encode().replace(b"\n(", b"(") + part.astype(kind).tobytes())
                file.write(f")\nEnd of Binary Section   {number})\n".encode())
        file.write(f"(12 (0 1 {mesh.n_cells:x} 0))\n(12 (5 1 {mesh.n_cells:x} 1 0))\n".encode())
        file.write(f"(13 (0 1 {len(faces):x} 0))\n(13 (6 1 {len(faces):x} 3 0)(\n".encode())
        file.write(("\n".join(rows_) + "\n))\n(45 (5 fluid body)())\n").encode())
    return path


def ovm(folder: Path, *, suffix: str) -> Path:
    """As its library writes it, with a comment."""
    made = getattr(ovm_files, suffix)(folder / f"cube.{suffix}", bricks())
    if suffix == "ovm":
        made.write_text(made.read_text().replace("Vertices\n", "# Vertices\nVertices\n", 1))
    return Path(made)


def xdmf(folder: Path, *, data_format: str, is_single: bool = False) -> Path:
    """As meshio writes it: with a field on the points."""
    mesh, path = bricks(), folder / "cube.xdmf"
    points = mesh.points.astype(np.float32 if is_single else np.float64)
    whole = meshio.Mesh(points, {"hexahedron": mesh.connectivity.reshape(-1, 8)}, point_data={"x": points[:, 0]})
    meshio.xdmf.write(path, whole, data_format=data_format, **({"compression": None} if data_format == "HDF" else {}))
    path.write_text(path.read_text().replace(f"{folder}/", ""))  # names of heavy data from the folder of the file
    return path


PATCHED: dict[str, tuple[str, Callable[[Path], Path], str]] = {
    "abaqus": ("abaqus", abaqus, "text"),
    "su2": ("su2", su2, "text"),
    "nastran": ("nastran", nastran, "columns"),
    "nastran large": ("nastran", partial(nastran, width=16), "columns"),
    "nastran free": ("nastran", partial(nastran, separator=","), "text"),
    "gmsh 2.2": ("gmsh", partial(gmsh, version="gmsh22", is_binary=False), "text"),
    "gmsh 2.2 binary": ("gmsh", partial(gmsh, version="gmsh22", is_binary=True), "bytes"),
    "gmsh 4.0": ("gmsh", gmsh_40, "text"),
    "gmsh 4.1": ("gmsh", partial(gmsh, version="gmsh", is_binary=False), "text"),
    "gmsh 4.1 binary": ("gmsh", partial(gmsh, version="gmsh", is_binary=True), "bytes"),
    "ansys": ("ansys", ansys, "columns"),
    "lsdyna": ("lsdyna", lsdyna, "columns"),
    "unv": ("unv", unv, "columns"),
    "tetgen": ("tetgen", tetgen, "text"),
    "rf": ("rf", rf, "text"),
    "mfem": ("mfem", mfem, "text"),
    "ugrid": ("ugrid", written_by("cube.ugrid"), "text"),
    "ugrid big-endian": ("ugrid", written_by("cube.b8.ugrid"), "bytes"),
    "ugrid single": ("ugrid", written_by("cube.lb4.ugrid"), "bytes"),
    "ugrid records": ("ugrid", written_by("cube.lr8.ugrid"), "bytes"),
    "netgen": ("netgen", written_by("cube.vol"), "text"),
    "avs": ("avs", written_by("cube.avs"), "text"),
    "flac3d": ("flac3d", partial(by_meshio, name="cube.f3grid", file_format="flac3d"), "text"),
    "exodus classic": ("exodus", partial(exodus, kind="NETCDF3_CLASSIC"), "bytes"),
    "exodus 64 bit": ("exodus", partial(exodus, kind="NETCDF3_64BIT_OFFSET"), "bytes"),
    "exodus": ("exodus", partial(exodus, kind="NETCDF4", contiguous=True), "bytes"),
    "exodus packed": ("exodus", partial(exodus, kind="NETCDF4", zlib=True), "arrays"),
    "cgns": ("cgns", cgns, "bytes"),
    "cgns packed": ("cgns", partial(cgns, chunks=(16,), compression="gzip"), "arrays"),
    "med": ("med", written_by("cube.med"), "bytes"),
    "hedra": ("hedra", hedra, "text"),
    "elmer": ("elmer", elmer, "text"),
    "fluent": ("fluent", partial(fluent, form="text"), "text"),
    "fluent binary": ("fluent", partial(fluent, form="double"), "bytes"),
    "fluent binary single": ("fluent", partial(fluent, form="single"), "bytes"),
    "fluent hdf5": ("fluent", partial(fluent, form="hdf"), "bytes"),
    "ovm": ("ovm", partial(ovm, suffix="ovm"), "text"),
    "ovmb": ("ovm", partial(ovm, suffix="ovmb"), "bytes"),
    "medit": ("medit", partial(medit, suffix="mesh"), "text"),
    "medit single": ("medit", partial(medit, suffix="mesh", is_single=True), "text"),
    "medit binary": ("medit", partial(medit, suffix="meshb"), "bytes"),
    "vtu ascii": ("vtu", partial(vtu, mode="ascii"), "text"),
    "vtu ascii single": ("vtu", partial(vtu, mode="ascii", is_single=True), "text"),
    "vtu binary": ("vtu", partial(vtu, mode="binary"), "packed"),
    "vtu binary lzma": ("vtu", partial(vtu, mode="binary", compressor="LZMA", header=64), "packed"),
    "vtu appended": ("vtu", partial(vtu, mode="appended", header=64), "bytes"),
    "vtu appended single": ("vtu", partial(vtu, mode="appended", is_single=True), "bytes"),
    "vtu appended zlib": ("vtu", partial(vtu, mode="appended", compressor="ZLib"), "packed"),
    "vtu appended lz4": ("vtu", partial(vtu, mode="appended", compressor="LZ4", is_single=True), "packed"),
    "vtu base64": ("vtu", partial(vtu, mode="appended base64", header=64), "packed"),
    "vtu base64 zlib": ("vtu", partial(vtu, mode="appended base64", compressor="ZLib"), "packed"),
    "vtk": ("vtk", partial(vtk_legacy, is_binary=False), "text"),
    "vtk single": ("vtk", partial(vtk_legacy, is_binary=False, is_single=True), "text"),
    "vtk binary": ("vtk", partial(vtk_legacy, is_binary=True), "bytes"),
    "vtk binary single": ("vtk", partial(vtk_legacy, is_binary=True, is_single=True), "bytes"),
    "vtkhdf": ("vtkhdf", partial(vtkhdf, is_packed=False), "bytes"),
    "vtkhdf packed": ("vtkhdf", partial(vtkhdf, is_packed=True), "arrays"),
}
"""By name: the format, what makes a file in a folder, and how numbers stand in it: as words, in columns, as bytes
or in packed arrays."""

WORD = re.compile(rb"[^\s,]+")
