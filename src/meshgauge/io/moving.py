"""A copy of a large file with other coordinates of a few points, slice by slice; all else stays byte for byte."""

from __future__ import annotations

import itertools
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ReadError, WriteError
from ..files import undo
from ..files.hunks import Hunks
from ..files.output import replacing
from .patching import same_format
from .plumbing.pieces import FileRows, HdfRows, Pieces, ReadWhole, Rows, row_bytes
from .reading import pieces

Ids = NDArray[np.int64]

WINDOW = 1 << 18
"""Rows that are changed, or compared, at a time."""


def check_movable(listed: Pieces, target: Path, *, file_format: str | None = None, keeps_undo: bool = False) -> None:
    """Raise `ReadWhole` unless points of a mesh can be moved in a copy of its file, with or without undo data."""
    source = os.path.realpath(listed.path)
    chosen = same_format(Path(listed.path), target, file_format=file_format)
    if chosen is None or not chosen.is_patched:
        raise ReadWhole("the output is of another format")
    begins = set()
    filled = [piece.points for piece in listed.pieces if piece.n_points]
    for rows in filled:
        if not isinstance(rows, FileRows | HdfRows) or rows.dtype.kind != "f" or rows.shape[1:] != (3,):
            raise ReadWhole("its points do not stand in the file as they are in memory")
        if keeps_undo and isinstance(rows, HdfRows):
            raise ReadWhole("its points are in chunks, of which undo data do not know the bytes")
        if os.path.realpath(rows.path) != source:
            raise ReadWhole("its points are in another file")
        begins.add((rows.path, rows.offset) if isinstance(rows, FileRows) else (rows.name, rows.first))
    if len(begins) < len(filled):
        raise ReadWhole("pieces of it share points")


def move_points(
    listed: Pieces,
    target: Path,
    points: Ids,
    coordinates: NDArray[np.float64],
    *,
    file_format: str | None = None,
    overwrite: bool = False,
    undo_file: Path | None = None,
) -> None:
    """Copy the file of a mesh, with some of its points elsewhere.

    What was written is read back, and compared with the file, slice by slice, before it takes its place. Undo data are
    on the disk before.

    Parameters
    ----------
    listed
        The mesh, which passes `check_movable`.
    target
        Where to.
    points, coordinates
        ``(n,)`` points of the mesh, ascending, and ``(n, 3)`` where to; as the file will hold them.
    file_format
        As the mesh was read.
    overwrite
        Allow to replace the file itself.
    undo_file
        Keeps the old bytes, see `meshgauge.files.undo`.

    Raises
    ------
    WriteError
        If the target is the file, unless that is allowed, or what was written does not read back as it was to be.
    """
    source = Path(listed.path)
    if not overwrite and os.path.realpath(target) == os.path.realpath(source):
        raise WriteError(f"{target}: is a file that the mesh was read from; it is not overwritten")
    starts = [np.empty(0, np.int64)]
    with replacing(target, overwrite=overwrite) as copy:
        shutil.copyfile(source, copy)
        for at, piece in zip(listed.point_starts, listed.pieces, strict=False):
            first, last = np.searchsorted(points, [at, at + piece.n_points]).tolist()
            if last > first:
                rows, own = piece.points, points[first:last] - at
                _put(rows, copy, own, coordinates[first:last])
                if isinstance(rows, FileRows):
                    starts.append(rows.offset + own * row_bytes(rows))
        listed.check_unchanged()
        _check(listed, copy, points, coordinates, file_format)
        if undo_file is not None:
            size = row_bytes(next(piece.points for piece in listed.pieces if piece.n_points))
            bounds = np.concatenate(starts)[:, None] + (0, size)
            undo.store(undo_file, [undo.Change(source, copy, Hunks(bounds, bounds))])


def _put(rows: Rows, copy: Path, ids: Ids, coordinates: NDArray[np.float64]) -> None:
    """Change some rows of an array of points in a copy of its file."""
    if isinstance(rows, FileRows):
        size, values = row_bytes(rows), np.ascontiguousarray(coordinates, rows.dtype)
        cuts = [0, *(np.flatnonzero(np.diff(ids) > 1) + 1).tolist(), len(ids)]
        with copy.open("r+b") as file:
            for first, last in itertools.pairwise(cuts):  # rows side by side
                file.seek(rows.offset + int(ids[first]) * size)
                file.write(values[first:last].tobytes())
        return
    import h5py

    assert isinstance(rows, HdfRows)  # it is one of the two
    with h5py.File(copy, "r+") as file:
        array = file[rows.name]
        for begin, own in _windows(ids, rows.shape[0]):
            end = min(begin + WINDOW, rows.shape[0])
            values = array[rows.first + begin : rows.first + end]
            values[ids[own] - begin] = coordinates[own]
            array[rows.first + begin : rows.first + end] = values


def _windows(ids: Ids, n: int) -> Iterator[tuple[int, slice]]:
    """The first row of each window that has some of the rows, ascending, and which of them."""
    starts = np.arange(0, n, WINDOW)
    ends = np.searchsorted(ids, starts + WINDOW).tolist()
    for begin, first, last in zip(starts.tolist(), [0, *ends], ends, strict=False):
        if last > first:
            yield begin, slice(first, last)


def _check(listed: Pieces, copy: Path, points: Ids, coordinates: NDArray[np.float64], file_format: str | None) -> None:
    """Raise `WriteError` unless a copy holds the same arrays, but for the points that moved."""
    wrong = f"{copy}: what was written does not read back as it was to be; nothing is changed"
    try:
        back = pieces(copy, file_format=file_format)
    except ReadError as error:
        raise WriteError(f"{copy}: what was written cannot be read back: {error}") from error
    if back is None or len(back.pieces) != len(listed.pieces):
        raise WriteError(wrong)
    for start, old, new in zip(listed.point_starts, listed.pieces, back.pieces, strict=False):
        for rows, now in zip(_arrays(old), _arrays(new), strict=True):
            for begin in range(0, rows.shape[0], WINDOW):
                expected = rows.read(begin, min(begin + WINDOW, rows.shape[0]))
                if rows is old.points:
                    first, last = np.searchsorted(points, [start + begin, start + begin + len(expected)]).tolist()
                    expected[points[first:last] - start - begin] = coordinates[first:last]
                if now.shape != rows.shape or now.read(begin, begin + len(expected)).tobytes() != expected.tobytes():
                    raise WriteError(wrong)


def _arrays(piece: Any) -> list[Rows]:
    return [piece.points, piece.types, piece.offsets, piece.connectivity, *piece.cell_data.values()]
