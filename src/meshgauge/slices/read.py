"""A slice of a piece as a `Mesh` with its own points."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError, ReadError
from ..io.plumbing import ghosts
from ..io.plumbing.pieces import Piece, Pieces, ReadWhole, Rows
from ..io.plumbing.some_rows import n_read, some, some_lists
from ..io.plumbing.wedge_order import Decision, apply, has_wedges
from ..mesh import Mesh
from ..mesh.cast import check_cells, frozen, n_nodes_of
from ..mesh.high_order import DEGREES, WEIGHTS
from ..mesh.interface import INTERFACE
from ..mesh.labels import LABEL
from ..mesh.polyhedra import Polyhedra
from ..mesh.regions import place_of
from ..status import Purpose
from .points import ALL, Origins, Points

SIZE = 1 << 18
"""Cells of a slice, where memory is plenty."""

LEAST = 1 << 17
"""Cells of a slice, where memory is scarce: of fewer all values would be kept, and sorted, see `Tally`."""

OF_POLYHEDRA = 1 << 15
"""Cells of a slice at most where there are polyhedra: these take some kilobytes each."""

SPREAD = 64
"""Rows of faces that are read for each that is asked for, at most."""

PER_CELL = 1024
"""Bytes that points may take, for each cell of a slice: where they may take less, slices are smaller."""

Ids = NDArray[np.int64]

AS_READ = Decision()


@dataclass(frozen=True, slots=True)
class Place:
    """Some cells of a piece: ``start <= cell < stop``, as the piece counts them."""

    piece: int
    start: int
    stop: int


@dataclass(frozen=True, eq=False, slots=True)
class Slice:
    """Cells that were read, as a mesh; where they stand in the whole, and its points in the piece."""

    mesh: Mesh
    first_cell: int
    first_point: int
    origins: Origins
    beyond: Ids | None = None  #: what lies beyond faces of its polyhedra, if the file says so; see `Piece`

    def point(self, local: int) -> int:
        """The id, in the whole, of a point of the slice."""
        return self.first_point + self.origins.of(local)


@dataclass(frozen=True, slots=True)
class View:
    """What is measured of a mesh, as `Mesh.dimension` and `Mesh.up` say it."""

    dimension: Literal[2, 3]
    up: Literal[-1, 0, 1]


AS_SOLIDS = View(3, 0)


def places(pieces: Pieces, size: int | None = None, share: tuple[int, int] = (1, 1)) -> list[Place]:
    """All cells, or of n shares of them the k-th, in slices of so many; None: `SIZE`."""
    size = SIZE if size is None else size
    number, n = share
    first, last = ((at * pieces.n_cells) // n for at in (number - 1, number))
    return [
        Place(at, start, min(start + size, stop))
        for at, piece in enumerate(pieces.pieces)
        for stop in [min(last - pieces.cell_starts[at], piece.n_cells)]
        for start in range(max(first - pieces.cell_starts[at], 0), stop, size)
    ]


def slice_size(memory: int) -> int:
    """Cells of a slice where points may take so many bytes."""
    return min(max(1 << (memory // PER_CELL).bit_length(), LEAST), SIZE)


def most_cells(pieces: Pieces) -> int:
    """Cells of a slice at most."""
    return OF_POLYHEDRA if any(piece.polyhedra is not None for piece in pieces.pieces) else SIZE


def read_slice(
    pieces: Pieces,
    place: Place,
    points: Points,
    decision: Decision = AS_READ,
    purpose: Purpose = "fem",
    view: View = AS_SOLIDS,
) -> Slice:
    """Read some cells.

    Parameters
    ----------
    pieces, place
        Which.
    points
        Of the piece.
    decision
        What becomes of wedges.
    purpose
        Of the mesh.
    view
        As what its cells are measured.

    Raises
    ------
    ReadError
        If the file is broken or changed.
    ReadWhole
        If faces of its polyhedra are spread over the file.
    """
    piece = pieces.pieces[place.piece]
    first = pieces.cell_starts[place.piece] + place.start
    try:
        types, offsets, ids, are_even = _cells(piece, place)
        poly, face_points = _polyhedra(piece, place, pieces.face_starts[place.piece])
        try:
            xyz, local, origins = points.of(ids if poly is None else np.concatenate([ids, face_points]))
        except MeshError:
            check_cells(types, offsets, ids, points.n)  # names the cell
            raise
        if poly is not None:
            poly = replace(poly, face_points=local[len(ids) :])
        is_found = origins is not ALL  # then each id was found among those of the piece, and its point has a new one
        if is_found and not are_even:
            check_cells(types, offsets, local[: len(ids)], None)
        mesh = Mesh(
            points=xyz,
            types=types,
            offsets=offsets,
            connectivity=local[: len(ids)],
            polyhedra=poly,
            point_data=_weights(piece, len(xyz), origins),
            cell_data={name: _column(name, rows, place) for name, rows in piece.cell_data.items() if is_needed(name)},
            purpose=purpose,
            stored=pieces.stored,
            dimension=view.dimension,
            up=view.up,
            copy=False,
            is_checked=is_found,
        )
    except MeshError as error:
        raise ReadError(f"{pieces.path}: {_of_whole(str(error), first, place.stop - place.start)}") from error
    mesh = ghosts.note_ghosts(mesh)
    if decision.turn and has_wedges(mesh.types):
        mesh = apply(mesh, decision)
    return Slice(mesh, first, pieces.point_starts[place.piece], origins, _beyond(piece, place, poly))


_CELL = re.compile(r"\bcell (\d+)")


def _of_whole(message: str, first: int, n: int) -> str:
    """What is wrong with a slice, its cells by their numbers in the mesh."""
    named, count = _CELL.subn(lambda cell: f"cell {int(cell[1]) + first}", message)
    return named if count else f"among cells {first} to {first + n - 1}: {message}"


def is_needed(name: str) -> bool:
    """Whether something depends on cell data of this name."""
    return name in (*ghosts.NAMES, INTERFACE, DEGREES, LABEL) or place_of(name) is not None


def _column(name: str, rows: Rows, place: Place) -> NDArray[Any]:
    values = rows.read(place.start, place.stop)
    return values.astype(np.int64, copy=False) if name == LABEL else values


def _cells(piece: Piece, place: Place) -> tuple[NDArray[np.uint8], Ids, Ids, bool]:
    """Types, offsets and point ids of some cells; whether all are of one type, each with as many nodes as that has."""
    types, read = piece.types.read(place.start, place.stop), piece.offsets.read(place.start, place.stop + 1)
    first, last = int(read[0]), int(read[-1])
    n_nodes = n_nodes_of(types)
    are_even = n_nodes > 0 and last - first == n_nodes * len(types) and bool((read[1:] - read[:-1] == n_nodes).all())
    offsets = _even(len(types), n_nodes) if are_even else read.astype(np.int64, copy=False) - first
    n = piece.connectivity.shape[0]
    if (place.start == 0 and first != 0) or (place.stop == piece.n_cells and last != n) or not 0 <= first <= last <= n:
        raise MeshError(f"offsets run from {first} to {last}, of {n} point ids")
    return types, offsets, piece.connectivity.read(first, last).astype(np.int64, copy=False), are_even


@lru_cache(maxsize=4)
def _even(n: int, n_nodes: int) -> Ids:
    """Offsets of so many cells of as many nodes each, which slices share."""
    offsets: Ids = frozen(n_nodes * np.arange(n + 1))
    return offsets


def _offsets(rows: Rows, place: Place) -> tuple[Ids, int, int]:
    """Offsets of the cells from 0 on; where they begin and end in the piece."""
    offsets = rows.read(place.start, place.stop + 1).astype(np.int64, copy=False)
    first, last = int(offsets[0]), int(offsets[-1])
    return offsets - first, first, last


def _polyhedra(piece: Piece, place: Place, first_face: int) -> tuple[Polyhedra | None, Ids]:
    """Faces of the cells, with faces of other cells between them, numbered as in the whole, where the piece begins with
    the ``first_face``; and the ids of their points in the piece."""
    none = np.empty(0, np.int64)
    if piece.polyhedra is None:
        return None, none
    rows = piece.polyhedra
    offsets, first, last = _offsets(rows["cell_offsets"], place)
    if not 0 <= first <= last <= rows["cell_faces"].shape[0]:
        raise MeshError(f"offsets of faces run from {first} to {last}")
    faces = rows["cell_faces"].read(first, last).astype(np.int64, copy=False)
    if not len(faces):
        return None, none
    low, high = int(faces.min()), int(faces.max()) + 1
    if not 0 <= low < high < rows["face_offsets"].shape[0]:
        raise MeshError(f"faces {low} to {high - 1} are not all there")
    if high - low > 4 * len(faces):
        return _spread(rows, offsets, faces, first_face)
    of_faces, begin, end = _offsets(rows["face_offsets"], Place(0, low, high))
    if not 0 <= begin <= end <= rows["face_points"].shape[0]:
        raise MeshError(f"offsets of points of faces run from {begin} to {end}")
    points = rows["face_points"].read(begin, end).astype(np.int64, copy=False)
    labels = rows["labels"].read(low, high) if "labels" in rows else np.arange(low, high) + first_face
    return Polyhedra(offsets, faces - low, of_faces, points, labels=labels), points


def _spread(rows: Mapping[str, Rows], offsets: Ids, faces: Ids, first_face: int) -> tuple[Polyhedra, Ids]:
    """The same where the faces are not close to one another in the file."""
    ids, local = np.unique(faces, return_inverse=True)
    if n_read(ids) > SPREAD * len(faces):
        raise ReadWhole("the faces of its polyhedra are spread over the file")
    try:
        sizes, points = some_lists(rows["face_offsets"], rows["face_points"], ids)
    except IndexError:
        raise MeshError("offsets of points of faces do not ascend, or lie outside of the points") from None
    labels = some(rows["labels"], ids) if "labels" in rows else ids + first_face
    ends = np.concatenate([[0], np.cumsum(sizes)])
    return Polyhedra(offsets, local.reshape(-1), ends, points, labels=labels), points


def _beyond(piece: Piece, place: Place, poly: Polyhedra | None) -> Ids | None:
    """What lies beyond the faces of some polyhedra, if the file says so."""
    if poly is None or piece.polyhedra is None or "beyond" not in piece.polyhedra:
        return None
    _, first, last = _offsets(piece.polyhedra["cell_offsets"], place)
    return piece.polyhedra["beyond"].read(first, last)


def _weights(piece: Piece, n: int, origins: Origins) -> dict[str, NDArray[Any]]:
    """The weights of rational cells at the points of a slice."""
    rows = piece.point_data.get(WEIGHTS)
    if rows is None:
        return {}
    ids = origins.all(n)
    first = int(ids.min(initial=rows.shape[0]))
    return {WEIGHTS: rows.read(first, int(ids.max(initial=first - 1)) + 1)[ids - first]}
