"""Medit's meshes written: one section a keyword, as programs that take the last of several for all expect.

Own, because meshio opens a section for each run of cells, of which Mmg reads the last, and writes version 3, which
some programs do not read.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME
from ....look.style import number_of
from ....mesh import Mesh
from ....mesh.regions import KEYS
from ...plumbing import writing
from .read import DIMENSION, END, REF, SECTIONS, VERTICES

_TYPES = ("line", "triangle", "quad", "tetra", "wedge", "hexahedron", "pyramid")
_LARGEST_VERSION_2 = 2**31 - 1
"""Bytes of a binary file whose positions version 2 can state."""
_LARGEST_REFERENCE = 2**31 - 1
"""Of binary files of version 2 and 3."""


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Text of version 2 or, for .meshb, binary: version 2, from 2 GB on 3.

    Of the data one integer a point and a cell is kept: a reference or what tells a region. Cells are kept by type.
    """
    mesh = writing.plain(mesh)
    is_point = mesh.types == BY_NAME["vertex"].vtk_id
    writing.check_types(mesh, ("vertex", *_TYPES))
    largest = _LARGEST_REFERENCE if path.suffix.lower() == ".meshb" else 2**53
    point_refs, point_name = _references(mesh.point_data, mesh.n_points, largest)
    refs, cell_name = _references(mesh.cell_data, mesh.n_cells, largest)
    tables = []
    for section in SECTIONS:
        if section.kind.name in _TYPES:
            cells = np.flatnonzero(mesh.types == section.kind.vtk_id)
            if len(cells):
                rows = np.column_stack([writing.nodes_of(mesh, cells) + 1, refs[cells]])
                tables.append((section.keyword, section.code, rows))
    points = np.asarray(mesh.points, np.float64)
    with path.open("wb") as file:
        if path.suffix.lower() == ".meshb":
            _binary(file, points, point_refs, tables)
        else:
            _text(file, points, point_refs, tables)
    notes = [f"The {what} data {name!r} became Medit's references."
             for what, name in (("point", point_name), ("cell", cell_name)) if name not in (None, REF)]  # fmt: skip
    if is_point.any():
        notes.append(
            f"{number_of(int(is_point.sum()), 'vertex cell was', 'vertex cells were')} left out: the format has none."
        )
    order = mesh.types[~is_point]
    if not np.array_equal(order, np.concatenate([order[:0], *(order[order == t] for t in _ids())])):
        notes.append("The format keeps cells by type: their order changed.")
    return (*notes, *writing.loss_notes(mesh, point={point_name or ""}, cell={cell_name or ""}))


def _ids() -> list[int]:
    return [section.kind.vtk_id for section in SECTIONS if section.kind.name in _TYPES]


def _references(data: Mapping[str, NDArray[Any]], n: int, largest: int) -> tuple[NDArray[np.int64], str | None]:
    """The first data that can be references, and their name; zeros if there are none."""
    for name in (REF, *(key for key in KEYS if key != REF)):
        values = data.get(name)
        is_integer = values is not None and values.ndim == 1 and values.dtype.kind in "iu"
        if values is not None and is_integer and (not n or max(int(values.max()), -int(values.min())) <= largest):
            return values.astype(np.int64), name
    return np.zeros(n, np.int64), None


def _text(file: BinaryIO, points: NDArray[np.float64], refs: NDArray[np.int64], tables: list[Any]) -> None:
    file.write(f"MeshVersionFormatted 2\n\nDimension 3\n\nVertices\n{len(points)}\n".encode())
    for point, ref in zip(points.tolist(), refs.tolist(), strict=True):
        file.write(f"{' '.join(map(repr, point))} {ref}\n".encode())
    for keyword, _, rows in tables:
        file.write(f"\n{keyword}\n{len(rows)}\n{writing.rows(rows)}".encode())
    file.write(b"\nEnd\n")


def _binary(file: BinaryIO, points: NDArray[np.float64], refs: NDArray[np.int64], tables: list[Any]) -> None:
    """Each section is its number, the byte where the next begins, a number of rows and the rows."""
    vertices = np.empty(len(points), [("x", "<f8", (3,)), ("ref", "<i4")])
    vertices["x"], vertices["ref"] = points, refs
    sections = [(VERTICES[1], vertices), *((code, rows.astype("<i4")) for _, code, rows in tables)]
    size = sum(rows.nbytes + 16 for _, rows in sections) + 64
    version = 2 if size <= _LARGEST_VERSION_2 else 3
    jump = np.dtype("<i4" if version == 2 else "<i8").type
    file.write(np.array([1, version], "<i4").tobytes())

    def begin(code: int, n_bytes: int) -> None:
        following = file.tell() + 8 + np.dtype(jump).itemsize + n_bytes
        file.write(np.int32(code).tobytes() + jump(following).tobytes())

    begin(DIMENSION[1], 0)
    file.write(np.int32(3).tobytes())
    for code, rows in sections:
        begin(code, rows.nbytes)
        file.write(np.int32(len(rows)).tobytes())
        file.write(rows.tobytes())
    file.write(np.int32(END[1]).tobytes() + jump(0).tobytes())
