"""Every other format that PyVista or meshio reads, and those that neither reads right, which are refused by name.

Which of the two reads a format was chosen by trying both on real files. A reader that drops cells, adds some or mixes
up zones is no choice: the format is refused with the reason until there is a right one.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...cells import type_name
from ...errors import ReadError, WriteError
from ...mesh import Mesh
from ...mesh.regions import KEYS
from ..plumbing import meshio, vtk, within, writing
from ..plumbing.format import Format, Reader, Sniffer, Writer, anything
from ..plumbing.messages import is_out_of_memory
from ..plumbing.spans import after_lines, in_place
from ..plumbing.writing import REGION
from . import rows_places, tecplot
from .netgen import netgen


def by_pyvista(path: Path) -> Mesh:
    """What PyVista reads; `ReadError` with its reason, or VTK's, if it fails or finds no cells."""
    import pyvista

    with vtk.listening() as log:
        try:
            data: Any = pyvista.get_reader(str(path)).read()
        except (Exception, SystemExit) as error:
            if is_out_of_memory(error):
                raise MemoryError from error
            messages = log.errors or vtk.error_messages(str(error)) or [" ".join(str(error).split())]
            raise ReadError(f"{path}: PyVista says: {'; '.join(messages[:3]) or type(error).__name__}") from error
    if log.errors:
        raise ReadError(f"{path}: VTK says: {'; '.join(log.errors[:3])}")
    return _require_cells(vtk.mesh(data, path), path)


def _by_meshio(module: str) -> Reader:
    def read(path: Path) -> Mesh:
        source, notes = meshio.read(path, module)
        return _require_cells(meshio.mesh(source, path, notes), path)

    return read


def _avs(path: Path) -> Mesh:
    """By meshio, which takes what is no number for NaN."""
    mesh = _by_meshio("avsucd")(path)
    wrong = np.flatnonzero(np.isnan(mesh.points).any(axis=1))
    data = in_place(path.read_bytes(), b"#")
    if len(wrong) and b"nan" not in data.lower():
        at = after_lines(data, 0, 1 + int(wrong[0]))
        raise ReadError(f"{path}, line {data.count(bytes([10]), 0, at) + 1}: a point has something else than numbers")
    return mesh


def _first_of(*readers: Reader) -> Reader:
    """Readers tried in turn; if all fail, the reasons of all."""

    def read(path: Path) -> Mesh:
        reasons = []
        for reader in readers:
            try:
                return reader(path)
            except ReadError as error:
                reasons.append(str(error).removeprefix(f"{path}: "))
        raise ReadError(f"{path}: {'; '.join(dict.fromkeys(reasons))}")

    return read


def _with_check(check: Callable[[Path], None], reader: Reader) -> Reader:
    """A reader of files that name others: only such as lie in their folder."""

    def read(path: Path) -> Mesh:
        check(path)
        return reader(path)

    return read


def _require_cells(mesh: Mesh, path: Path) -> Mesh:
    """These readers return nothing where they understood nothing."""
    if not mesh.n_cells:
        raise ReadError(f"{path}: no cells were found in it")
    return mesh


def _of_one_integer(module: str, key: str) -> Writer:
    """Of the cell data one integer only, under the name that the format has for it: the first that tells a region."""

    def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
        order = (key, *(k for k in KEYS if k != key))
        known = {
            n.lower(): n for n, v in reversed(list(mesh.cell_data.items())) if v.dtype.kind in "iu" and v.ndim == 1
        }
        name = next((known[k] for k in order if k in known), None)
        kept = {key: mesh.cell_data[name].astype(np.int64)} if name is not None else {}
        notes = [f"The cell data {name!r} became the format's {key.split(':')[1]}."] if name not in (key, None) else []
        gone = [n for n in mesh.cell_data if n not in (name, REGION)]
        if gone:
            notes.append(f"The format could not hold the cell data {', '.join(map(repr, gone))}.")
        # meshio takes field data for names of groups: a number and a dimension each.
        groups = {n: v for n, v in mesh.field_data.items() if v.shape == (2,) and v.dtype.kind in "iu"}
        gone = [n for n in mesh.field_data if n not in groups and n != f"{REGION}:names"]
        if gone:
            notes.append(f"The format could not hold the field data {', '.join(map(repr, gone))}.")
        return (*notes, *meshio.write(path, mesh.replace(cell_data=kept, field_data=groups), module))

    return write


def _surface(module: str, *types: str, precision: type = np.float32, **options: Any) -> Writer:
    """Surface cells of some types alone, their points as precise as readers hold them, without data."""

    def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
        writing.check_types(mesh, types)
        notes = [
            f"The format could not hold the {what} data {', '.join(map(repr, data))}."
            for what, data in (("point", mesh.point_data), ("cell", mesh.cell_data), ("field", mesh.field_data))
            if data
        ]
        bare = mesh.replace(points=mesh.points.astype(precision), point_data={}, cell_data={}, field_data={})
        return (*notes, *meshio.write(path, bare, module, **options))

    return write


_TECPLOT_CELLS = ("line", "triangle", "quad", "tetra", "hexahedron")


def _reduce_tecplot(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    """A zone holds cells of one type."""
    return writing.without_lesser(mesh, (), kept_dimension=3)


def _write_tecplot(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """By meshio; of points and cells all names are variables of one list, and so are x, y and z."""
    writing.check_types(writing.plain(mesh), _TECPLOT_CELLS)
    types = writing.type_counts(mesh.types)
    if len(types) != 1:
        what = ", ".join(f"{n} {type_name(t)}" for t, n in types.items()) or "none"
        raise WriteError(f"the format holds cells of one type, and of them some: {what}")
    taken, notes = {"x", "y", "z"}, []
    changes: dict[str, dict[str, Any]] = {"point": {}, "cell": {}}
    for what, renamed in changes.items():
        for name, values in getattr(mesh, f"{what}_data").items():
            key = name
            while key.lower() in taken:
                key += f"_of_{what}s"
            taken.add(key.lower())
            renamed[key] = values
            if key != name:
                notes.append(f"The {what} data {name!r} is called {key!r}: the format has one list of names.")
    given = mesh.replace(point_data=changes["point"], cell_data=changes["cell"])
    return (*notes, *meshio.write(path, given, "tecplot"))


def _mark(pattern: bytes) -> Sniffer:
    compiled = re.compile(pattern, re.IGNORECASE | re.MULTILINE)
    return lambda head, path: compiled.search(head) is not None


MATERIAL = "avsucd:material"

_BLANKS = "".join(filter(str.isspace, map(chr, range(0x3001))))
"""Of names of three words meshio's reader of Tecplot never ends."""
_FIVE_COUNTS = rb"\A(\s*#[^\n]*\n)*\s*\d+([ \t]+\d+){4}"
_HDF = _mark(rb"\A\x89HDF\r\n\x1a\n")

OTHERS: tuple[Format, ...] = (
    # By PyVista.
    Format("tecplot", "Tecplot ASCII", (".dat", ".tec", ".plt"), tecplot.sniff,
           foreign=_first_of(_by_meshio("tecplot"), by_pyvista), write=_write_tecplot, by_content=False,
           forbidden=",\"'=()" + _BLANKS, steps=tecplot.steps, read_step=tecplot.read,
           reduce=_reduce_tecplot),
    # By either.
    Format("stl", "STL", (".stl",), anything, foreign=_first_of(by_pyvista, _by_meshio("stl")), by_content=False,
           write=_surface("stl", "triangle", binary=True), is_single=True),
    Format("ply", "PLY", (".ply",), _mark(rb"\Aply\s"), foreign=_first_of(by_pyvista, _by_meshio("ply")),
           write=_surface("ply", "triangle", "quad"), is_single=True),
    Format("obj", "Wavefront OBJ", (".obj",), anything,
           foreign=_first_of(by_pyvista, _by_meshio("obj")), by_content=False,
           write=_surface("obj", "triangle", "quad", precision=np.float64)),
    # By meshio.
    Format("avs", "AVS UCD", (".inp", ".avs", ".ucd"), _mark(_FIVE_COUNTS),
           foreign=_avs, places=rows_places.avs, by_content=False,
           write=_of_one_integer("avsucd", MATERIAL)),
    Format("h5m", "MOAB", (".h5m",), _HDF,
           foreign=_with_check(within.check_hdf_file, _by_meshio("h5m")), by_content=False),
    netgen(_of_one_integer("netgen", "netgen:index")),
    Format("dolfin", "DOLFIN XML", (".xml",), _mark(rb"<dolfin\b"), foreign=_by_meshio("dolfin")),
    Format("flac3d", "FLAC3D", (".f3grid",), anything, foreign=_by_meshio("flac3d"),
           places=rows_places.flac3d, by_content=False),
    Format("permas", "PERMAS", (".post", ".dato"), _mark(rb"^\s*\$"),
           foreign=_by_meshio("permas"), by_content=False),
    Format("off", "OFF", (".off",), _mark(rb"\A\s*(#[^\n]*\n\s*)*OFF\b"), foreign=_by_meshio("off")),
)  # fmt: skip
"""A row a format."""
