"""Where the arrays of an Exodus file stand, and of a mesh that is spread over several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import ReadError
from ...mesh.labels import LABEL
from ...mesh.mesh import Precision
from ..plumbing import within
from ..plumbing.made_rows import INT, ColumnRows, CountedRows, NodeRows, RaisedRows, SameRows, filled, joined
from ..plumbing.netcdf import Variable, variables
from ..plumbing.pieces import Piece, Pieces, ReadWhole, Rows, check_alike
from . import spread
from .exodus_blocks import block_name, blocks, kind_of, of_corners
from .spread_rows import join_pieces

_DOUBLE = np.dtype(np.float64)


@dataclass(frozen=True)
class _File:
    piece: Piece
    stored: Precision
    notes: tuple[str, ...]
    numbers: Rows | None  #: of its nodes, if it numbers them


def pieces(path: Path, at: int) -> Pieces | None:
    """One piece, whose blocks are those of the file; of a mesh that is spread over files, of all of them.

    Raises
    ------
    ReadWhole
        If it has polyhedra or polygons, or fields in a form of old.
    """
    own = _file(path, at)
    files = spread.all_pieces(path)
    if not files or own.numbers is None:
        alone = spread.alone(path, has_numbers=own.numbers is not None)
        return _pieces(path, own.piece, own.stored, (*own.notes, *alone))
    within.check(path, [file.name for file in files])
    others = [own if file == path else _file(file, at) for file in files]
    numbers = [other.numbers for other in others if other.numbers is not None]
    if len(numbers) < len(others) or any(_begins_with_zero(one.piece) for one in others):
        raise ReadWhole("what its nodes are joined by depends on each piece")
    check_alike(tuple(other.piece for other in others))
    whole = join_pieces([other.piece for other in others], numbers, files, path)
    stored: Precision = "single" if any(other.stored == "single" for other in others) else "double"
    noted = dict.fromkeys(note for other in others for note in other.notes)
    return _pieces(path, whole, stored, (*noted, *spread.notes_of(path)))


def _begins_with_zero(piece: Piece) -> bool:
    return any(int(data[LABEL].read(0, 1)[0]) == 0 for data in (piece.cell_data, piece.point_data))


def _pieces(path: Path, piece: Piece, stored: Precision, notes: tuple[str, ...]) -> Pieces:
    return Pieces(str(path), (piece,), {}, notes, stored=stored, drops_counts=True)


def _file(path: Path, at: int) -> _File:
    with variables(path, held=False) as arrays:
        points, stored = _points(arrays, path)
        known = [block for block in blocks(arrays, path) if block.n]
        if not known:
            raise ReadWhole("it has no elements")
        ids = arrays["eb_prop1"].values() if "eb_prop1" in arrays else np.empty(0, np.int64)
        types, offsets, nodes, data, named, notes = [], [], [], [], [], []
        n_cells = n_nodes = 0
        for block in known:
            if block.element in ("NFA", "NSI"):
                raise ReadWhole("it has polyhedra or polygons")
            if len(block.connect.shape) != 2:
                raise ReadWhole("its connectivity is of another shape")  # reading it says which
            width = block.connect.shape[1]
            kind = kind_of(block, width, path)
            own = NodeRows(block.connect.rows(path), width, kind.order)
            number, name = block_name(block, ids)
            types.append(SameRows(kind.vtk_id, np.dtype(np.uint8), (block.n,)))
            offsets.append(CountedRows(n_nodes, block.n, own.n_nodes))
            nodes.append(own)
            data.append({**_fields(arrays, "elem", f"eb{block.number}", block.n, path, at), **_number(number, block.n)})
            named.append((name, n_cells, n_cells + block.n))
            n_cells, n_nodes = n_cells + block.n, n_nodes + block.n * own.n_nodes
            notes += of_corners(block, kind, width)
        point_numbers = _numbers(arrays, "node_num_map", points.shape[0], path)
        cell_numbers = _numbers(arrays, "elem_num_map", n_cells, path)
        piece = Piece(
            named[0][0] if len(named) == 1 else "",
            points,
            joined(types),
            joined([*offsets, CountedRows(n_nodes, 1)]),
            joined(nodes),
            None,
            {**filled(data, [block.n for block in known]), LABEL: cell_numbers},
            {**_fields(arrays, "nod", "", points.shape[0], path, at), LABEL: point_numbers},
            tuple(named),
        )
        has_numbers = "node_num_map" in arrays
    return _File(piece, stored, tuple(dict.fromkeys(notes)), point_numbers if has_numbers else None)


def _number(number: int, n: int) -> dict[str, Rows]:
    return {"exodus:block": SameRows(number, INT, (n,))}


def _points(arrays: Mapping[str, Variable], path: Path) -> tuple[Rows, Precision]:
    if "coord" in arrays:
        coord = arrays["coord"]
        columns = [coord.rows(path, axis) for axis in range(coord.shape[0])] if len(coord.shape) == 2 else []
    else:
        columns = [arrays[name].rows(path) for name in ("coordx", "coordy", "coordz") if name in arrays]
    if not 1 <= len(columns) <= 3 or len({c.shape for c in columns}) != 1 or len(columns[0].shape) != 1:
        raise ReadWhole("its coordinates are not whole")  # reading it says why
    return ColumnRows(tuple(columns), _DOUBLE), "single" if columns[0].dtype.itemsize == 4 else "double"


def _numbers(arrays: Mapping[str, Variable], name: str, n: int, path: Path) -> Rows:
    if name not in arrays:
        return CountedRows(1, n)
    rows = arrays[name].rows(path)
    if rows.shape != (n,):
        raise ReadError(f"{path}: {name} has {rows.shape[0]} numbers, expected {n}")
    return RaisedRows(rows, 0)


def _fields(arrays: Mapping[str, Variable], kind: str, suffix: str, n: int, path: Path, at: int) -> dict[str, Rows]:
    """Fields at a time step, of the points or of a block; see `exodus.read`."""
    if f"name_{kind}_var" not in arrays:
        return {}
    if f"vals_{kind}_var{suffix}" in arrays:
        raise ReadWhole("its fields stand in one array")
    made: dict[str, Rows] = {}
    for index, name in enumerate(arrays[f"name_{kind}_var"].text(), 1):
        own = arrays.get(f"vals_{kind}_var{index}{suffix}")
        if own is None or own.shape[0] <= at:
            continue
        rows = own.rows(path, at)
        if rows.shape != (n,):
            raise ReadWhole("its fields are not whole")
        made[name or f"field {index}"] = rows
    return made
