"""Writing a mesh that is read in pieces, and never in memory, to another format."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ReadError, WriteError
from ..files.output import replacing
from ..mesh.high_order import DEGREES, WEIGHTS
from ..mesh.labels import LABEL
from ..mesh.mesh import GHOST_TYPE
from ..mesh.regions import block_regions, have_names
from . import registry
from .adding import difference
from .plumbing import ghosts
from .plumbing.added import CannotAdd
from .plumbing.made_rows import CountedRows, CutRows, RaisedRows, SameRows, filled, joined
from .plumbing.mesh_rows import MeshRows, OfType
from .plumbing.pieces import Piece, Pieces, Rows
from .plumbing.writing import REGION
from .reading import StrPath, pieces


def writes_pieces(target: StrPath) -> bool:
    """Whether meshes that are not in memory are written in the format of a file."""
    try:
        return registry.for_writing(Path(target), None).write_rows is not None
    except WriteError:
        return False


def write_pieces(
    listed: Pieces,
    target: StrPath,
    *,
    cells: Mapping[str, Rows],
    points: Mapping[str, Rows],
    with_labels: tuple[bool, bool],
    turned: bool,
) -> None:
    """Write a mesh with further data, some rows at a time: what `meshgauge.write` writes of the whole.

    Parameters
    ----------
    listed
        The mesh, as `meshgauge.io.pieces` tells it.
    target
        The output, of a format of `writes_pieces`; it is whole or not there.
    cells, points
        By name, ``(n_cells,)`` and ``(n_points,)`` numbers.
    with_labels
        Whether the numbers that the file stores for cells, and for points, say anything.
    turned
        Whether nodes of wedges are in another order than in the file.

    Raises
    ------
    CannotAdd
        If this mesh has to be written as a whole; the message says why.
    WriteError
        If it cannot be written, or does not read back as it should.
    """
    target = Path(target)
    chosen = registry.for_writing(target, None)
    assert chosen.write_rows is not None  # see `writes_pieces`
    _check_whole(listed, turned=turned)
    whole = _whole(listed, cells, points, with_labels)
    field_data = dict(listed.field_data)
    names = (*whole.cell_data, *whole.point_data, *field_data)
    if have_names(listed.blocks) and REGION not in whole.cell_data:
        whole, field_data = _with_regions(listed, whole, field_data)
    _check_names(names, chosen.forbidden)
    if {os.path.realpath(known[0]) for known in listed.stamps} & {os.path.realpath(target)}:
        raise WriteError(f"{target}: is a file that the mesh was read from")
    with replacing(target) as staged:
        chosen.write_rows(staged, MeshRows(whole, field_data))
        listed.check_unchanged()
        try:
            back = pieces(staged, file_format=chosen.name)
        except ReadError as error:
            raise WriteError(f"{target}: does not read back as it was to be: {error}") from error
        wrong = difference(Pieces(str(target), (whole,), field_data), back, {}, {})
        if wrong:
            raise WriteError(f"{target}: does not read back as it was to be: {wrong} differ")


def _check_whole(listed: Pieces, *, turned: bool) -> None:
    """Raise `CannotAdd` for what is changed when a mesh is written as a whole."""
    first = listed.pieces[0]
    if any(piece.polyhedra is not None for piece in listed.pieces):
        raise CannotAdd("has polyhedra")
    if turned:
        raise CannotAdd("has wedges that are numbered otherwise")
    if {DEGREES, WEIGHTS} & {*first.cell_data, *first.point_data}:
        raise CannotAdd("has rational cells")
    if GHOST_TYPE not in first.cell_data and set(ghosts.NAMES) & set(first.cell_data):
        raise CannotAdd("marks ghosts in a way of its own")
    for rows in (*first.cell_data.values(), *first.point_data.values()):
        if rows.dtype.kind not in "fiu" or rows.dtype.itemsize > 8 or rows.dtype == np.float16 or len(rows.shape) > 2:
            raise CannotAdd(f"has data of type {rows.dtype} and shape {rows.shape[1:]}")
    for values in listed.field_data.values():
        if values.dtype.kind not in "fiuU" or values.ndim > 1:
            raise CannotAdd("has field data of another kind")


def _check_names(names: tuple[str, ...], forbidden: str) -> None:
    """Raise `CannotAdd` for names that are changed when they are written."""
    for name in names:
        if not name.isprintable() or set(name) & {*forbidden, "/"} or name.strip(".") != name or not name:
            raise CannotAdd(f"has data with a name that is changed: {name!r}")


def _whole(
    listed: Pieces, cells: Mapping[str, Rows], points: Mapping[str, Rows], with_labels: tuple[bool, bool]
) -> Piece:
    """All pieces as one, with all data."""
    parts = listed.pieces
    n_nodes = [piece.connectivity.shape[0] for piece in parts]
    starts = np.cumsum([0, *n_nodes]).tolist()
    offsets: list[Rows] = [
        RaisedRows(CutRows(piece.offsets, 0, piece.n_cells), start) for piece, start in zip(parts, starts, strict=False)
    ]
    data = []
    for kind, sizes, is_kept, added in (
        ("cell_data", [piece.n_cells for piece in parts], with_labels[0], cells),
        ("point_data", [piece.n_points for piece in parts], with_labels[1], points),
    ):
        held = filled([getattr(piece, kind) for piece in parts], sizes)
        labels = held.pop(LABEL, None)
        if is_kept and labels is not None:
            held[LABEL] = OfType(labels, np.dtype(np.int64))
        data.append({**held, **added})
    return Piece(
        name="",
        points=joined([piece.points for piece in parts]),
        types=joined([piece.types for piece in parts]),
        offsets=joined([*offsets, CountedRows(starts[-1], 1)]),
        connectivity=joined(
            [RaisedRows(piece.connectivity, first) for piece, first in zip(parts, listed.point_starts, strict=False)]
        ),
        polyhedra=None,
        cell_data=data[0],
        point_data=data[1],
    )


def _with_regions(
    listed: Pieces, whole: Piece, field_data: dict[str, NDArray[Any]]
) -> tuple[Piece, dict[str, NDArray[Any]]]:
    """See `plumbing.writing.with_regions`."""
    found = block_regions(listed.blocks)
    assert found is not None  # they have names
    of_blocks, names = found
    rows: list[Rows] = [
        SameRows(region + 1, np.dtype(np.int32), (block.stop - block.start,))
        for block, region in zip(listed.blocks, of_blocks, strict=True)
    ]
    data = {**whole.cell_data, REGION: joined(rows)}
    return replace(whole, cell_data=data), {**field_data, f"{REGION}:names": np.array(names)}
