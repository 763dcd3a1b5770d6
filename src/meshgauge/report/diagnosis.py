"""The diagnosis of a mesh that is read in slices."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..doctor import LIMIT, Diagnosis, not_diagnosed
from ..doctor.joined import Joined
from ..doctor.points import TOLERANCE
from ..doctor.streamed import MarkCounter, Marks, bytes_needed
from ..doctor.streamed.marks import STANDS
from ..files.resources import free_memory, give_back
from ..io.plumbing.pieces import Pieces, ReadWhole
from ..mesh import CellBlock, Mesh
from ..mesh.collapsed import resolve
from ..mesh.ghosts import without_ghosts
from ..mesh.labels import LABEL
from ..mesh.mesh import Precision
from ..slices import Job, Partial
from ..slices.labels import cell_label, point_label
from ..slices.points import WINDOW, Points
from ..slices.read import places, read_slice, slice_size
from ..slices.some_cells import gathered
from ..status import Purpose

if TYPE_CHECKING:
    from ..doctor.hanging import Hanging
    from ..doctor.streamed.few import Few

Ids = NDArray[np.int64]

CELLS = 1 << 14
"""Cells that pass by at a time."""


def why_not(listed: Pieces, memory: int | None) -> str:
    """Why such a mesh is not diagnosed in slices, a clause; empty if it is. ``memory`` are the bytes that are allowed;
    None: half of what is free."""
    needed, allowed = bytes_needed(listed.n_cells, listed.n_points), _allowed(memory)
    if allowed is not None and needed > allowed:
        return f"that takes {needed / 1e6:,.0f} MB, more than --memory allows, or is free"
    return ""


def _allowed(memory: int | None) -> int | None:
    free = free_memory()
    return memory if memory is not None else None if free is None else free // 2


def why_not_drawn(listed: Pieces, memory: int | None) -> str:
    """Why a page of such a mesh is not drawn in slices, see `why_not`."""
    return "it has polyhedra, and is not in memory as a whole" if _has_polyhedra(listed) else why_not(listed, memory)


def _has_polyhedra(listed: Pieces) -> bool:
    return any(piece.polyhedra is not None for piece in listed.pieces)


def with_marks(listed: Pieces, counter: Any, memory: int | None) -> Any:
    """The counter, or None if it is to mark cells for a diagnosis that is not made; one that only marks them if it is
    to choose what is drawn of a mesh that is not."""
    if not isinstance(counter, MarkCounter):
        return counter
    if why_not(listed, memory):
        return None
    return MarkCounter() if _has_polyhedra(listed) else counter


def streamed_diagnosis(
    job: Job,
    partial: Partial,
    memory: int | None,
    on_few: Callable[[Few], object] | None = None,
    *,
    tolerance: float = TOLERANCE,
) -> Diagnosis:
    """The diagnosis, if the cells were marked for it; else one that says why there is none. ``on_few`` and
    ``tolerance`` as for `diagnosis_of`."""
    if not isinstance(partial.counted, Marks):
        return not_diagnosed(job.facts.n_cells, LIMIT, reason=why_not(job.pieces, memory))
    from ..doctor.streamed.diagnose import diagnosis_of  # with kernels, which take a quarter of a second to load

    source, inward, why = _source(job, partial.counted, tolerance), partial.counted.inward, ""
    room = _room(job, memory)
    for size in (CELLS, slice_size(job.memory)):  # faces of polyhedra may be too far apart for fewer than were measured
        try:
            made = replace(source, size=size)
            return diagnosis_of(made, source.marks, inward, tolerance=tolerance, room=room, on_few=on_few)
        except ReadWhole as error:
            why = str(error)
    return not_diagnosed(job.facts.n_cells, LIMIT, reason=why)


def boundary_cells(job: Job, partial: Partial, memory: int | None) -> Few:
    """The cells with a face at the boundary, and others, of solid cells that were marked."""
    from ..doctor.streamed.diagnose import few_of

    assert isinstance(partial.counted, Marks)
    source = _source(job, partial.counted)
    return few_of(source, source.marks, room=_room(job, memory))


@dataclass(frozen=True, eq=False)
class Beside:
    """Ids, ascending, of the cells that `doctor.misoriented` and `doctor.hanging` mean."""

    misoriented: Ids
    hanging: Ids


def cells_beside(job: Job, marks: Marks, memory: int | None) -> Beside:
    """What `doctor.misoriented` and `doctor.hanging` say of the whole, which has no polyhedra.

    Raises `ReadWhole` where points or cells coincide: then the diagnosis knows of more neighbours than these do.
    """
    from ..doctor.streamed.diagnose import diagnosis_of

    none = np.empty(0, np.int64)
    if job.facts.view.dimension == 2:
        return Beside(none, none)
    found: list[Hanging] = []
    source = _source(job, marks)
    made = diagnosis_of(source, source.marks, room=_room(job, memory), on_hanging=found.append)
    for name in ("duplicate_points", "duplicate_cells", "interfaces"):
        if made.finding(name) is not None:
            raise ReadWhole("some of its points or cells coincide, which decides on the cells beside")
    reversed_cells = none if made.orientation is None else made.orientation.reversed_cells
    return Beside(reversed_cells, found[0].cells)


def _source(job: Job, marks: Marks, tolerance: float = TOLERANCE) -> _Source:
    of_all = marks.all(job.facts.n_cells)
    give_back()
    source = _Source(job, of_all)
    return replace(source, joined=_joined(source, tolerance)) if job.pieces.parts else source


def _room(job: Job, memory: int | None) -> int:
    from ..doctor.streamed.faces import ROOM

    left = 0 if memory is None else memory - bytes_needed(job.facts.n_cells, job.facts.n_points)
    return max(ROOM, left // 2)


def _joined(source: _Source, tolerance: float) -> Joined:
    """The points that parts have in common, of those that coincide."""
    from ..doctor.streamed.doubles import crowd

    pieces, facts = source.job.pieces, source.job.facts
    crowded = crowd(source.points, source.n_points, tolerance, source.stored)
    at = crowded.moved
    ids, labels = crowded.ids[at], None
    if pieces.point_numbers:
        labels = gathered(pieces.point_numbers, pieces.point_starts, ids).astype(np.int64)
    elif facts.point_labels == "counted":
        labels = ids + 1
    elif facts.point_labels == "stored":
        columns = [piece.point_data[LABEL] for piece in pieces.pieces]
        labels = gathered(columns, pieces.point_starts, ids).astype(np.int64)
    are_known = bool(pieces.point_numbers)
    return Joined.of(ids, crowded.points[at], crowded.representative[at], labels, pieces.parts, are_known=are_known)


@dataclass(frozen=True)
class _NoCoordinates:
    """Points of which nobody asks where they are: memory that is never written takes none."""

    n: int

    @property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(np.float32)

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n, 3)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return np.zeros((stop - start, 3), np.float32)


@dataclass(frozen=True)
class _Source:
    """A `meshgauge.doctor.streamed.Source`."""

    job: Job
    marks: NDArray[np.uint8]
    joined: Joined | None = None
    size: int = CELLS

    @property
    def n_cells(self) -> int:
        return self.job.facts.n_cells

    @property
    def n_points(self) -> int:
        return self.job.facts.n_points

    @property
    def stored(self) -> Precision:
        return self.job.pieces.precision

    @property
    def purpose(self) -> Purpose:
        return self.job.purpose

    @property
    def dimension(self) -> Literal[2, 3]:
        return self.job.facts.view.dimension

    @property
    def up(self) -> Literal[-1, 0, 1]:
        return self.job.facts.view.up

    @property
    def blocks(self) -> Sequence[CellBlock]:
        return self.job.pieces.blocks

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        pieces = self.job.pieces
        points = [Points(_NoCoordinates(piece.n_points), 0, keeps_ids=True) for piece in pieces.pieces]
        nowhere = np.zeros((self.n_points if self.joined is not None else 0, 3), np.float32)
        for place in places(pieces, self.size):
            pieces.check_unchanged()
            facts = self.job.facts
            part = read_slice(pieces, place, points[place.piece], facts.decision, self.purpose, facts.view)
            mesh, first = part.mesh, part.first_cell
            stands = self.marks[first : first + mesh.n_cells] & STANDS > 0
            if stands.any():
                mesh = resolve(mesh, stands)
            mesh, first_point = without_ghosts(mesh), part.first_point
            poly = None if mesh.polyhedra is None else mesh.polyhedra.with_own_faces()
            if self.joined is not None:  # cells are at points of other parts, too
                nodes = self.joined.applied(np.asarray(mesh.connectivity, np.int64) + first_point)
                if poly is not None:
                    of_faces = self.joined.applied(np.asarray(poly.face_points, np.int64) + first_point)
                    poly = replace(poly, face_points=of_faces)
                mesh = replace(mesh, points=nowhere, connectivity=nodes, polyhedra=poly, copy=False)
                first_point = 0
            elif poly is not mesh.polyhedra:
                mesh = mesh.replace(polyhedra=poly)
            yield first, first_point, mesh

    def points(self) -> Iterator[NDArray[np.floating]]:
        for piece in self.job.pieces.pieces:
            for start in range(0, piece.n_points, WINDOW):
                yield piece.points.read(start, min(start + WINDOW, piece.n_points))

    def points_of(self, ids: Ids) -> NDArray[np.floating]:
        pieces = self.job.pieces
        return gathered([piece.points for piece in pieces.pieces], pieces.point_starts, ids)

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        if self.job.facts.cell_labels == "none":
            return ()
        return tuple(cell_label(self.job.pieces, self.job.facts, int(cell)) for cell in ids)

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        if self.job.facts.point_labels == "none":
            return ()
        return tuple(point_label(self.job.pieces, self.job.facts, int(point)) for point in ids)
