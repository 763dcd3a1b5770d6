"""Where the arrays of a mesh stand in its file: what is needed to read some rows of them, and no others.

A format that can tell lists its *pieces* without reading them. All records can be sent to other processes.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import MeshgaugeError, ReadError
from ...mesh import CellBlock
from ...mesh.labels import LABEL
from ...mesh.mesh import Precision
from ...status import Purpose

MOST_UNPACKED = 64 << 20
"""Bytes of a chunk of HDF5 beyond which a file is read whole: for each slice the chunk would be unpacked anew."""


class ReadWhole(MeshgaugeError):
    """What a mesh holds, or is asked for, cannot be had slice by slice; the message says what."""


class Rows(Protocol):
    """Rows of an array in a file."""

    @property
    def dtype(self) -> np.dtype[Any]: ...

    @property
    def shape(self) -> tuple[int, ...]: ...

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """The rows ``start <= row < stop``, in native byte order. Raises `ReadError` if the file ends before."""
        ...


def row_bytes(rows: Rows) -> int:
    """Bytes of a row."""
    return rows.dtype.itemsize * int(np.prod(rows.shape[1:], dtype=np.int64))


def bytes_of(arrays: Iterable[Rows]) -> int:
    """Bytes of some arrays; those that are made may say for themselves what they count, as ``n_bytes``."""
    total = 0
    for rows in arrays:
        own: int | None = getattr(rows, "n_bytes", None)
        total += rows.shape[0] * row_bytes(rows) if own is None else own
    return total


@dataclass(frozen=True, slots=True)
class ArrayRows:
    """An array in memory."""

    array: NDArray[Any]

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.array.dtype

    @property
    def shape(self) -> tuple[int, ...]:
        return self.array.shape

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return self.array[start:stop]


@dataclass(frozen=True, slots=True)
class FileRows:
    """An array that lies in a file as it is in memory."""

    path: str
    offset: int  #: of its first byte
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        rows = np.empty((stop - start, *self.shape[1:]), self.dtype)
        into = rows.reshape(-1).view(np.uint8).data
        with open(self.path, "rb", buffering=0) as file:
            file.seek(self.offset + start * row_bytes(self))
            at = 0
            while at < len(into):
                n = file.readinto(into[at:])
                if not n:
                    raise ReadError(f"{self.path}: ends before row {stop} of an array at {self.offset}")
                at += n
        return _native(rows)


@dataclass(frozen=True, slots=True)
class PackedRows:
    """An array in blocks, each packed by zlib, as VTK appends it."""

    path: str
    starts: NDArray[np.int64]  #: ``(n_blocks + 1,)`` of the first byte of each block
    block: int  #: bytes that each block but the last unpacks to
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        size = row_bytes(self)
        first, last = start * size, min(stop, self.shape[0]) * size
        rows = np.empty((stop - start, *self.shape[1:]), self.dtype)
        into = rows.reshape(-1).view(np.uint8)
        if first >= last:
            return _native(rows)
        total = self.shape[0] * size
        with open(self.path, "rb", buffering=0) as file:
            for number in range(first // self.block, (last - 1) // self.block + 1):
                begin, end = number * self.block, min((number + 1) * self.block, total)
                file.seek(int(self.starts[number]))
                packed = file.read(int(self.starts[number + 1] - self.starts[number]))
                try:
                    unpacked = zlib.decompressobj().decompress(packed, end - begin)
                except zlib.error as error:
                    raise ReadError(f"{self.path}: an array cannot be unpacked: {error}") from error
                if len(unpacked) != end - begin:
                    raise ReadError(f"{self.path}: an array is not whole")
                a, b = max(begin, first), min(end, last)
                into[a - first : b - first] = np.frombuffer(unpacked, np.uint8)[a - begin : b - begin]
        return _native(rows)


@dataclass(frozen=True, slots=True)
class HdfRows:
    """Some rows of a data set of HDF5, in chunks, packed or not."""

    path: str
    name: str
    first: int
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        import h5py

        rows = np.empty((stop - start, *self.shape[1:]), self.dtype)
        if not rows.size:
            return _native(rows)
        try:
            with h5py.File(self.path, "r", rdcc_nbytes=MOST_UNPACKED) as file:
                file[self.name].read_direct(rows, np.s_[self.first + start : self.first + stop])
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            raise ReadError(f"{self.path}: array {self.name} cannot be read: {error}") from error
        return _native(rows)


def hdf_rows(dataset: Any, first: int, n: int) -> Rows:
    """Rows of an open data set. Raises `ReadWhole` where slices cannot be had for their own price."""
    kind, shape = dataset.dtype, (n, *dataset.shape[1:])
    if first < 0 or n < 0 or first + n > len(dataset):
        raise ReadError(f"{dataset.name} has {len(dataset)} rows, but rows {first} to {first + n} are stated")
    if kind.kind not in "iufb":
        raise ReadWhole(f"array {dataset.name} is of type {kind}")
    path, at = os.path.abspath(dataset.file.filename), dataset.id.get_offset()
    if dataset.chunks is None and not dataset.is_virtual and at is not None and not dataset.file.userblock_size:
        size = kind.itemsize * int(np.prod(shape[1:], dtype=np.int64))
        return FileRows(path, at + first * size, kind, shape)
    if dataset.chunks is not None and kind.itemsize * int(np.prod(dataset.chunks, dtype=np.int64)) > MOST_UNPACKED:
        raise ReadWhole(f"array {dataset.name} is in chunks of more than {MOST_UNPACKED >> 20} MiB")
    return HdfRows(path, dataset.name, first, kind, shape)


@dataclass(frozen=True, slots=True)
class EndsOnly:
    """Offsets that a file states without the zero in front: row 0 is that zero."""

    ends: Rows

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.ends.dtype

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.ends.shape[0] + 1,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        if start > 0:
            return self.ends.read(start - 1, stop - 1)
        return np.concatenate([np.zeros(1, self.dtype.newbyteorder("=")), self.ends.read(0, max(stop - 1, 0))])[:stop]


@dataclass(frozen=True)
class Piece:
    """Points and cells with a numbering of their own: arrays as in `Mesh`, as rows to be read.

    Attributes
    ----------
    name
        Of its block.
    points, types, offsets, connectivity
        Those of the piece; offsets begin at 0.
    polyhedra
        Four arrays of `Polyhedra` by name, or None. ``labels``, one a face, may be with them, and ``beyond``, one an
        entry of ``cell_faces``, as `meshgauge.mesh.beyond` has it for the mesh as a whole.
    cell_data, point_data
        Numbers only. The file's own numbers are called `LABEL`; they are another array as well, the same object, where
        they were taken from it.
    blocks
        Name, first cell and the one behind the last of each block, if the piece has several; else it is one.
    polyhedra_bytes
        Of the arrays in the file that `polyhedra` are made of.
    """

    name: str
    points: Rows
    types: Rows
    offsets: Rows
    connectivity: Rows
    polyhedra: Mapping[str, Rows] | None
    cell_data: Mapping[str, Rows]
    point_data: Mapping[str, Rows]
    blocks: tuple[tuple[str, int, int], ...] = ()
    polyhedra_bytes: int = 0

    @property
    def n_cells(self) -> int:
        return self.types.shape[0]

    @property
    def n_points(self) -> int:
        return self.points.shape[0]

    @property
    def n_faces(self) -> int:
        """Of its polyhedra."""
        return 0 if self.polyhedra is None else max(self.polyhedra["face_offsets"].shape[0] - 1, 0)


Stamp = tuple[str, int, int, int]
"""Path, size, time of the last change in nanoseconds, and number of a file."""


@dataclass(frozen=True)
class Pieces:
    """A mesh as pieces of files, one after another; points are not merged.

    Attributes
    ----------
    path
        What was asked for.
    pieces
        In the order of their cells; all with the same data, and points of one dtype.
    field_data, notes
        As of `Mesh`.
    has_both_wedge_orders
        See `Format`.
    renumbered
        VTK ids of cells that are numbered otherwise in this file: with them it has to be read whole.
    stamps
        Of the files that are read, to see that none changes meanwhile.
    stored
        As of `Mesh`; None: as the points are held.
    drops_counts
        Numbers that only count cells or points are none, whatever they were taken from.
    parts, purpose
        As of `Mesh`.
    point_numbers
        Of each piece: by which points of parts are known to be one where the file has no labels of them.
    in_one_go
        All of a piece is read, and kept for a while, to have some rows of it: it takes memory as a whole.
    """

    path: str
    pieces: tuple[Piece, ...]
    field_data: Mapping[str, NDArray[Any]]
    notes: tuple[str, ...] = ()
    has_both_wedge_orders: bool = False
    renumbered: tuple[int, ...] = ()
    stamps: tuple[Stamp, ...] = ()
    stored: Precision | None = None
    drops_counts: bool = False
    parts: tuple[int, ...] = ()
    purpose: Purpose = "fem"
    point_numbers: tuple[Rows, ...] = ()
    in_one_go: bool = False

    @property
    def n_cells(self) -> int:
        return sum(piece.n_cells for piece in self.pieces)

    @property
    def n_points(self) -> int:
        return sum(piece.n_points for piece in self.pieces)

    @cached_property
    def cell_starts(self) -> tuple[int, ...]:
        """The first cell of each piece, and at last how many there are."""
        return (0, *np.cumsum([piece.n_cells for piece in self.pieces], dtype=np.int64).tolist())

    @cached_property
    def point_starts(self) -> tuple[int, ...]:
        """The first point of each piece, and at last how many there are."""
        return (0, *np.cumsum([piece.n_points for piece in self.pieces], dtype=np.int64).tolist())

    @cached_property
    def face_starts(self) -> tuple[int, ...]:
        """The first face of the polyhedra of each piece, and at last how many there are."""
        numbers = [piece.n_faces for piece in self.pieces]
        return (0, *np.cumsum(numbers, dtype=np.int64).tolist())

    @cached_property
    def blocks(self) -> tuple[CellBlock, ...]:
        """Those of the whole that have cells."""
        return tuple(
            CellBlock(name, start + first, start + stop)
            for piece, start in zip(self.pieces, self.cell_starts, strict=False)
            for name, first, stop in piece.blocks or [(piece.name, 0, piece.n_cells)]
            if stop > first
        )

    @property
    def precision(self) -> Precision:
        """That of the points as the file holds them."""
        return self.stored or ("single" if self.pieces[0].points.dtype.itemsize == 4 else "double")

    @property
    def n_bytes(self) -> int:
        """Of all arrays, as they are read."""
        total = 0
        for piece in self.pieces:
            own = (piece.points, piece.types, piece.offsets, piece.connectivity)
            total += bytes_of([*own, *piece.cell_data.values(), *piece.point_data.values()]) + piece.polyhedra_bytes
        return total

    def check_unchanged(self) -> None:
        """Raise `ReadError` if a file is not the one it was when the pieces were listed."""
        for known in self.stamps:
            if stamp(known[0]) != known:
                raise ReadError(f"{known[0]}: was changed while it was read")


def stamp(path: str) -> Stamp:
    """What a file is known by."""
    state = os.stat(path)
    return path, state.st_size, state.st_mtime_ns, state.st_ino


def check_alike(pieces: tuple[Piece, ...]) -> None:
    """Raise `ReadWhole` unless all pieces have the same data of the same types, so that none has to be filled."""

    def kinds(piece: Piece) -> list[tuple[str, str, np.dtype[Any], tuple[int, ...]]]:
        named = [("cell", item) for item in piece.cell_data.items()]
        named += [("point", item) for item in piece.point_data.items()]
        return [(what, name, rows.dtype, rows.shape[1:]) for what, (name, rows) in sorted(named, key=str)]

    first = pieces[0]
    for piece in pieces:
        same = piece.points.dtype == first.points.dtype and (piece.polyhedra is None) == (first.polyhedra is None)
        if not same or kinds(piece) != kinds(first):
            raise ReadWhole("its pieces have different data")


def join_listed(listed: Sequence[Pieces | None], names: Sequence[str] = (), *, path: Path) -> Pieces | None:
    """The pieces of several files one after another; None if one of them has to be read whole, or all are empty.

    With ``names`` those of the blocks begin with them.

    Raises
    ------
    ReadWhole
        If the numbers of cells or points of a file may only count: then they are none.
    """
    files = [one for one in listed if one is not None]
    if len(files) < len(listed):
        return None
    filled: list[Piece] = []
    for number, one in enumerate(files):
        for piece in one.pieces:
            for numbers in (piece.cell_data.get(LABEL), piece.point_data.get(LABEL)):
                may_be_none = (0,) if one.drops_counts else (0, 1)
                if numbers is not None and numbers.shape[0] and int(numbers.read(0, 1)[0]) in may_be_none:
                    raise ReadWhole("whether its numbers say anything depends on each piece")
            called = ": ".join(filter(None, (names[number], piece.name))) if names else piece.name
            if piece.n_cells or piece.n_points:
                start = f"{names[number]}: " if names and names[number] else ""
                blocks = tuple((start + own if own else start[:-2], a, b) for own, a, b in piece.blocks)
                filled.append(replace(piece, name=called, blocks=blocks))
    return (
        Pieces(
            str(path),
            with_polyhedra(filled),
            {name: values for one in reversed(files) for name, values in one.field_data.items()},
            renumbered=tuple({vtk_id for one in files for vtk_id in one.renumbered}),
            stored="single" if any(one.stored == "single" for one in files) else None,
            purpose="fv" if any(one.purpose == "fv" for one in files) else "fem",
            in_one_go=any(one.in_one_go for one in files),
        )
        if filled
        else None
    )


def with_polyhedra(pieces: Sequence[Piece]) -> tuple[Piece, ...]:
    """The same, where some have polyhedra and others have not: these with no faces."""
    from .made_rows import SameRows

    if all(piece.polyhedra is None for piece in pieces):
        return tuple(pieces)
    int64 = np.dtype(np.int64)

    def none_in(piece: Piece) -> dict[str, Rows]:
        n_rows = {"cell_offsets": piece.n_cells + 1, "cell_faces": 0, "face_offsets": 1, "face_points": 0}
        return {key: SameRows(0, int64, (n,)) for key, n in n_rows.items()}

    return tuple(replace(one, polyhedra=none_in(one)) if one.polyhedra is None else one for one in pieces)


def is_stored_label(data: Mapping[str, Rows]) -> bool:
    """Whether numbers of the file stand there as `LABEL`, and not as a copy of another array."""
    return LABEL in data and not any(name != LABEL and rows is data[LABEL] for name, rows in data.items())


def _native(rows: NDArray[Any]) -> NDArray[Any]:
    return rows if rows.dtype.isnative else rows.astype(rows.dtype.newbyteorder("="))
