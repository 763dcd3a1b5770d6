"""Between meshio's meshes and `Mesh`, and meshio's readers and writers kept from printing and from exiting."""

from __future__ import annotations

import contextlib
import importlib
import io
import re
import threading
import warnings
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, CELL_TYPES, POLYHEDRON, CellType, type_name
from ...errors import MeshError, ReadError, WriteError
from ...look.style import number_of
from ...mesh import CellBlock, Mesh
from ...mesh.polyhedra import Polyhedra
from .messages import is_out_of_memory
from .writing import plain, type_counts

_LOCK = threading.RLock()
"""Standard output, standard error and the warnings filter belong to the whole process."""

MAX_SETS = 64
"""Cell sets that are kept as cell data, a byte a cell each."""

_FAMILY = {
    "line": "lagrange_line",
    "triangle": "lagrange_triangle",
    "quad": "lagrange_quad",
    "tetra": "higher_order_tetra",
    "pyramid": "higher_order_pyramid",
    "wedge": "higher_order_wedge",
    "hexahedron": "higher_order_hexahedron",
}
_VTK_NAME = {
    "CURVE": "line",
    "TRIANGLE": "triangle",
    "QUADRILATERAL": "quad",
    "TETRAHEDRON": "tetra",
    "HEXAHEDRON": "hexahedron",
    "WEDGE": "wedge",
    "PYRAMID": "pyramid",
}


_OWN_LIST = "med:nom"
"""Field data in which meshio's MED reader keeps the names of fields for its writer, which fails on an empty one."""

_DIMENSION = {"wedge15": 3, "wedge12": 3, "pyramid13": 3, "hexahedron24": 3, "penta_prism": 3, "hexa_prism": 3}
"""Of types that meshio 5.3 reads and writes, but does not know the dimension of, so that it raises `KeyError`."""


def _dimensions() -> dict[str, int]:
    from meshio import _mesh

    known: dict[str, int] = _mesh.topological_dimension
    for name, dimension in _DIMENSION.items():
        known.setdefault(name, dimension)
    return known


@contextlib.contextmanager
def captured_output() -> Iterator[io.StringIO]:
    """Keep meshio from printing, warning and exiting; the yielded text is what it said."""
    text = io.StringIO()
    with _LOCK, contextlib.redirect_stdout(text), contextlib.redirect_stderr(text), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield text


def read(path: Path, module: str, file: io.StringIO | None = None) -> tuple[Any, tuple[str, ...]]:
    """What one reader of meshio makes of a file, and what it warned of (cells or sections that it skipped).

    With ``file`` that text is read in place of what the file holds.

    Raises
    ------
    ReadError
        Whatever meshio did instead of returning a mesh: raise, print, or end the process.
    """
    _dimensions()
    with captured_output() as output:
        try:
            source = importlib.import_module(f"meshio.{module}").read(file if file is not None else str(path))
        except (Exception, SystemExit) as error:
            if is_out_of_memory(error):
                raise MemoryError from error
            raise ReadError(f"{path}: meshio ({module}) says: {_reason(error, output)}{_where(path, error)}") from error
    warned = re.split(r"\bWarning:\s*", " ".join(output.getvalue().split()))
    return source, tuple(f"meshio warns: {text.strip()}" for text in dict.fromkeys(warned) if text.strip())


def _where(path: Path, error: BaseException) -> str:
    """The line of the word that an error is about, if it quotes one that stands in the file."""
    word = re.search(r"convert string (?:to float: )?'([^'\s]+)'|invalid literal for .*'([^'\s]+)'", str(error))
    if word is None:
        return ""
    data, text = path.read_bytes(), (word[1] or word[2]).encode()
    at = re.search(rb"(?<!\S)" + re.escape(text) + rb"(?!\S)", data)
    if at is None:
        return ""
    line = data.count(b"\n", 0, at.start()) + 1
    return f"; it stands in line {line}"


def _reason(error: BaseException, output: io.StringIO) -> str:
    reason = str(error) if str(error) and not isinstance(error, SystemExit) else output.getvalue()
    reason = " ".join(reason.split()) or "failed"
    kind = type(error).__name__
    return reason if kind in ("ReadError", "WriteError", "SystemExit") else f"{reason} ({kind})"


def row(name: str) -> CellType:
    """The row of one of meshio's cell types; types without a VTK id of their own become cells of
    which only the corners are known to be in place.

    Raises
    ------
    MeshError
        If there is none.
    """
    if name in BY_NAME:
        return BY_NAME[name]
    if name.startswith("polyhedron"):
        return BY_NAME["polyhedron"]
    if name.startswith("polygon"):
        return BY_NAME["polygon"]
    vtk = re.fullmatch(r"VTK_(LAGRANGE|BEZIER|HIGHER_ORDER)_([A-Z]+)", name)
    if vtk and vtk.group(2) in _VTK_NAME:
        return BY_NAME[f"{vtk.group(1).lower()}_{_VTK_NAME[vtk.group(2)]}"]
    family = re.fullmatch(r"([a-z]+)\d+", name)
    if family and family.group(1) in _FAMILY:
        return BY_NAME[_FAMILY[family.group(1)]]
    raise MeshError(f"cells of meshio's type {name!r} are unknown")


def name_of(cell: CellType) -> str:
    """meshio's name of a cell type, where it has one."""
    if cell.name.startswith(("lagrange_", "bezier_", "higher_order_")):
        kind, _, base = cell.name.rpartition("_")
        return f"VTK_{kind.upper()}_" + next(k for k, v in _VTK_NAME.items() if v == base)
    return cell.name


def mesh(source: Any, path: Path | None = None, notes: Sequence[str] = (), *, copy: bool = False) -> Mesh:
    """A meshio mesh as a `Mesh`: its blocks in their order, its data, its cell sets as data of 0 and 1.

    Without ``copy`` nobody else may hold its arrays.
    """
    points = np.asarray(source.points)
    if points.ndim == 2 and points.shape[1] < 2:  # of two coordinates the mesh is in a plane
        points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    types, sizes, nodes, faces, blocks, kept, start = [], [], [], [], [], [], 0
    for block in source.cells:
        cell = row(block.type)
        n = len(block.data)
        if cell is POLYHEDRON:
            lists = [[np.asarray(f, np.int64) for f in polyhedron] for polyhedron in block.data]
            ids = [np.unique(np.concatenate(polyhedron)) for polyhedron in lists]
            sizes.append(np.array([len(i) for i in ids], np.int64))
            nodes.extend(ids)
        else:
            lists = [[] for _ in range(n)] if any(b.type.startswith("polyhedron") for b in source.cells) else []
            dense = np.asarray(block.data)
            if dense.dtype not in (np.int32, np.int64):  # unsigned and signed ids would join as floats
                dense = dense.astype(np.int64)
            width = dense.shape[1] if dense.ndim == 2 else 0
            sizes.append(np.full(n, width, np.int64))
            nodes.append(dense.ravel())
            if cell.name != block.type and not block.type.startswith(("VTK_", "polygon")) and n:
                kept.append(
                    number_of(n, f"cell of type {block.type} is", f"cells of type {block.type} are")
                    + f" kept as {cell.name}."
                )
        faces.extend(lists)
        types.append(np.full(n, cell.vtk_id, np.uint8))
        blocks.append(CellBlock(block.type, start, start + n))
        start += n
    offsets = np.zeros(start + 1, np.int64)
    if sizes:
        np.cumsum(np.concatenate(sizes), out=offsets[1:])
    data, more = _cell_data(source, [b.stop - b.start for b in blocks])
    return Mesh(
        points=points,
        types=np.concatenate(types) if types else np.empty(0, np.uint8),
        offsets=offsets,
        connectivity=np.concatenate(nodes) if nodes else np.empty(0, np.int64),
        polyhedra=_polyhedra(faces) if faces else None,
        blocks=tuple(b for b in blocks if b.stop > b.start),
        point_data={k: _plain(v) for k, v in source.point_data.items()},
        cell_data=data,
        field_data={k: _plain(v) for k, v in (source.field_data or {}).items() if k != _OWN_LIST},
        path=str(path) if path is not None else None,
        notes=(*notes, *kept, *more),
        copy=copy,
    )


def _cell_data(source: Any, sizes: list[int]) -> tuple[dict[str, NDArray[Any]], list[str]]:
    data, notes = {}, []
    for name, blocks in source.cell_data.items():
        arrays = [_plain(a) for a in blocks]
        if arrays:
            data[name] = np.concatenate(arrays)
    sets = {k: v for k, v in (source.cell_sets or {}).items() if not k.startswith("gmsh:")}
    for name, blocks in list(sets.items())[:MAX_SETS]:
        members = [np.zeros(n, np.uint8) for n in sizes]
        for member, ids in zip(members, blocks, strict=False):
            if ids is not None and len(ids):
                member[np.asarray(ids, np.int64)] = 1
        data.setdefault(name, np.concatenate(members) if members else np.empty(0, np.uint8))
    if len(sets) > MAX_SETS:
        notes.append(f"{len(sets) - MAX_SETS} of {len(sets)} cell sets were left out.")
    return data, notes


def _plain(values: Any) -> NDArray[Any]:
    array = np.asarray(values)
    return array.astype(np.str_) if array.dtype == object else array


def _polyhedra(cells: list[list[NDArray[np.int64]]]) -> Polyhedra:
    flat = [face for cell in cells for face in cell]
    none = np.empty(0, np.int64)
    return Polyhedra(
        cell_offsets=np.concatenate([[0], np.cumsum([len(cell) for cell in cells])]).astype(np.int64),
        cell_faces=np.arange(len(flat)),
        face_offsets=np.concatenate([[0], np.cumsum([len(face) for face in flat])]).astype(np.int64),
        face_points=np.concatenate(flat) if flat else none,
    )


def from_mesh(mesh: Mesh, *, by_type: bool = False) -> Any:
    """A `Mesh` as a meshio mesh: a block for each run of cells of one type and size, so that the order is kept.

    With ``by_type`` a block for each type and size instead, for formats that hold no more.

    Raises
    ------
    WriteError
        If a cell has no type in meshio.
    """
    import meshio

    mesh = plain(mesh)
    known = _dimensions()
    sizes = np.diff(mesh.offsets)
    kinds = np.stack([mesh.types.astype(np.int64), sizes])
    if by_type:
        kinds_found, inverse = np.unique(kinds, axis=1, return_inverse=True)
        runs = [np.flatnonzero(inverse.reshape(-1) == k) for k in range(kinds_found.shape[1])]
    else:
        breaks = np.flatnonzero((np.diff(kinds, axis=1) != 0).any(axis=0)) + 1
        runs = [r for r in np.split(np.arange(mesh.n_cells), breaks) if len(r)]
    cells = []
    for ids in runs:
        cell, n_nodes = CELL_TYPES.get(int(mesh.types[ids[0]])), int(sizes[ids[0]])
        name = name_of(cell) if cell is not None else None
        if name is None or name not in known:
            raise WriteError(f"cells of type {type_name(mesh.types[ids[0]])} cannot be written in this format")
        dense = mesh.connectivity[mesh.offsets[ids][:, None] + np.arange(n_nodes)]
        cells.append((name, dense))
    return meshio.Mesh(
        mesh.points,
        cells,
        point_data=dict(mesh.point_data),
        cell_data={k: [v[ids] for ids in runs] for k, v in mesh.cell_data.items()} if runs else {},
        field_data=dict(mesh.field_data),
    )


def write(path: Path, mesh: Mesh, module: str, **options: Any) -> tuple[str, ...]:
    """Write by one of meshio's writers and read the result back; what is then missing is what the format lost.

    Raises
    ------
    WriteError
        If meshio cannot write the mesh, or if cells are missing from what it wrote.
    """
    return write_source(path, from_mesh(of_numbers(mesh, _SHAPES.get(module))), mesh, module, **options)


_SHAPES = {"xdmf": ((), (1,), (2,), (3,), (6,), (9,))}
"""Shapes of one item of data that a format holds; else numbers, and vectors of any length."""


def of_numbers(mesh: Mesh, shapes: Collection[tuple[int, ...]] | None = None) -> Mesh:
    """The mesh without data that are no numbers, or of other shapes: meshio's writers fail on them."""
    data = {
        f"{what}_data": {
            k: v
            for k, v in values.items()
            if v.dtype.kind in "biuf" and (v.ndim <= 2 if shapes is None else v.shape[1:] in shapes)
        }
        for what, values in (("point", mesh.point_data), ("cell", mesh.cell_data))
    }
    return mesh.replace(**data)


def write_source(path: Path, source: Any, original: Mesh, module: str, **options: Any) -> tuple[str, ...]:
    """As `write`, for a meshio mesh that was made of ``original`` and then adapted to the format."""
    with captured_output() as output:
        try:
            importlib.import_module(f"meshio.{module}").write(str(path), source, **options)
        except (Exception, SystemExit) as error:
            if isinstance(error, KeyError) and error.args[0] in _dimensions():
                raise WriteError(f"{path}: cells of type {error.args[0]} cannot be written in this format") from error
            raise WriteError(f"{path}: meshio ({module}) says: {_reason(error, output)}") from error
    try:
        back = mesh(read(path, module)[0], path)
    except (ReadError, MeshError) as error:
        raise WriteError(f"{path}: what was written cannot be read again: {error}") from error
    return _losses(original, back)


def _losses(before: Mesh, after: Mesh) -> tuple[str, ...]:
    want, have = type_counts(before.types), type_counts(after.types)
    missing = [f"{n - have.get(t, 0)} {type_name(t)}" for t, n in want.items() if have.get(t, 0) < n]
    if missing:
        raise WriteError(f"the format cannot hold these cells: {', '.join(missing)}")
    lost = []
    for what in ("point_data", "cell_data", "field_data"):
        gone = [name for name in getattr(before, what) if name not in getattr(after, what)]
        if gone:
            lost.append(f"The format could not hold the {what.replace('_', ' ')} {', '.join(map(repr, gone))}.")
    if after.n_points != before.n_points:
        lost.append(f"The mesh has {before.n_points} points, the file {after.n_points}.")
    return tuple(lost)
