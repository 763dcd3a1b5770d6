"""The diagnosis of a mesh that is read in slices."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..doctor import LIMIT, Diagnosis, not_diagnosed
from ..doctor.joined import Joined, ghost_points
from ..doctor.points import TOLERANCE
from ..doctor.streamed import MarkCounter, Marks, bytes_needed
from ..doctor.streamed.marks import STANDS
from ..doctor.streamed.passes import Passes, Share
from ..files.resources import free_memory, give_back
from ..io.plumbing.ghosts import NAMES as GHOSTS
from ..io.plumbing.pieces import Pieces, ReadWhole, Rows
from ..kernels.threads import ahead
from ..mesh import CellBlock, Mesh
from ..mesh.collapsed import resolve
from ..mesh.ghosts import without_ghosts
from ..mesh.labels import LABEL
from ..mesh.mesh import Precision
from ..slices import Job, Partial
from ..slices.facts import Labels
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


def why_not(listed: Pieces, memory: int | None, n_shares: int = 1) -> str:
    """Why such a mesh, or one of so many shares of it, is not diagnosed in slices, a clause; empty if it is. ``memory``
    are the bytes that are allowed; None: half of what is free."""
    return why_no_memory(listed.n_cells // n_shares, listed.n_points // n_shares, memory)


def why_no_memory(n_cells: int, n_points: int, memory: int | None, more: int = 0) -> str:
    """The same of so many cells and points, and so many bytes beside."""
    needed, allowed = bytes_needed(n_cells, n_points) + more, _allowed(memory)
    if allowed is not None and needed > allowed:
        return f"that takes {needed / 1e6:,.0f} MB, more than --memory allows, or is free"
    return ""


def _allowed(memory: int | None) -> int | None:
    free = free_memory()
    return memory if memory is not None else None if free is None else free // 2


def with_marks(listed: Pieces, counter: Any, memory: int | None) -> Any:
    """The counter, or None if it is to mark cells for a diagnosis that is not made."""
    return None if isinstance(counter, MarkCounter) and why_not(listed, memory) else counter


def streamed_diagnosis(
    job: Job,
    partial: Partial,
    memory: int | None,
    on_few: Callable[[Few], object] | None = None,
    *,
    tolerance: float = TOLERANCE,
    tell: Share | None = None,
) -> Diagnosis:
    """The diagnosis, if the cells were marked for it; else one that says why there is none. ``on_few`` and
    ``tolerance`` as for `diagnosis_of`; ``tell`` is told how far it is."""
    if not isinstance(partial.counted, Marks):
        return not_diagnosed(job.facts.n_cells, LIMIT, reason=why_not(job.pieces, memory))
    from ..doctor.streamed.diagnose import diagnosis_of  # with kernels, which take a quarter of a second to load

    source, inward, why = source_of(job, partial.counted, tolerance), partial.counted.inward, ""
    source = replace(source, passes=Passes(tell))
    room = room_for(job, memory)
    for size in (CELLS, slice_size(job.memory)):  # faces of polyhedra may be too far apart for fewer than were measured
        try:
            made = replace(source, size=size)
            diagnosis = diagnosis_of(made, source.marks, inward, tolerance=tolerance, room=room, on_few=on_few)
            if tell is not None:
                tell(1.0)
            return diagnosis
        except ReadWhole as error:
            why = str(error)
    return not_diagnosed(job.facts.n_cells, LIMIT, reason=why)


def boundary_cells(job: Job, partial: Partial, memory: int | None) -> Few:
    """The cells with a face at the boundary, and others, of solid cells that were marked."""
    from ..doctor.streamed.diagnose import few_of

    assert isinstance(partial.counted, Marks)
    source = source_of(job, partial.counted)
    return few_of(source, source.marks, room=room_for(job, memory))


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
    source = source_of(job, marks)
    made = diagnosis_of(source, source.marks, room=room_for(job, memory), on_hanging=found.append)
    for name in ("duplicate_points", "duplicate_cells", "interfaces"):
        if made.finding(name) is not None:
            raise ReadWhole("some of its points or cells coincide, which decides on the cells beside")
    reversed_cells = none if made.orientation is None else made.orientation.reversed_cells
    return Beside(reversed_cells, found[0].cells)


def source_of(job: Job, marks: Marks, tolerance: float = TOLERANCE, share: tuple[int, int] = (1, 1)) -> StreamedSource:
    """A mesh that was marked, or a share of it, as the diagnosis wants it."""
    source = StreamedSource(job, np.empty(0, np.uint8), share=share)
    source = replace(source, marks=marks.all(source.n_cells, source.first_cell))
    give_back()
    if share[1] > 1:
        low, high = _span_of_points(job.pieces, share)
        source = replace(source, first_point=low, n_points_of_share=high - low)
    return replace(source, joined=_joined(source, tolerance)) if job.pieces.parts and share[1] == 1 else source


def _span_of_points(pieces: Pieces, share: tuple[int, int]) -> tuple[int, int]:
    """Between which points those of a share of the cells are."""
    low, high = pieces.n_points, 0
    for place in places(pieces, None, share):
        piece, first = pieces.pieces[place.piece], pieces.point_starts[place.piece]
        ends = piece.offsets.read(place.start, place.stop + 1)
        ids = [piece.connectivity.read(int(ends[0]), int(ends[-1]))]
        if piece.polyhedra is not None:
            low, high = min(low, first), max(high, first + piece.n_points)  # as their faces may name any
        for some in ids:
            if len(some):
                low, high = min(low, int(some.min()) + first), max(high, int(some.max()) + first + 1)
    return min(low, high), high


def room_for(job: Job, memory: int | None) -> int:
    """Bytes that the faces which wait for their mates may take."""
    from ..doctor.streamed.faces import ROOM

    left = 0 if memory is None else memory - bytes_needed(job.facts.n_cells, job.facts.n_points)
    return max(ROOM, left // 2)


def _joined(source: StreamedSource, tolerance: float) -> Joined:
    """The points that parts have in common, of those that coincide."""
    from ..doctor.streamed.doubles import crowd_of

    pieces, facts = source.job.pieces, source.job.facts
    crowded = crowd_of(source, tolerance)
    at = crowded.moved
    if any(name in piece.cell_data for piece in pieces.pieces for name in GHOSTS):
        at = at[~ghost_points(((first, mesh) for _, first, mesh in source.cells()), source.n_points)[crowded.ids[at]]]
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
class StreamedSource:
    """A `meshgauge.doctor.streamed.Source`."""

    job: Job
    marks: NDArray[np.uint8]
    joined: Joined | None = None
    size: int = CELLS
    silent: None = None
    known: None = None
    share: tuple[int, int] = (1, 1)
    first_point: int = 0
    n_points_of_share: int = 0
    passes: Passes = field(default_factory=Passes)

    @property
    def first_cell(self) -> int:
        """The first cell of the share."""
        return (self.share[0] - 1) * self.job.facts.n_cells // self.share[1]

    @property
    def n_cells(self) -> int:
        return self.share[0] * self.job.facts.n_cells // self.share[1] - self.first_cell

    @property
    def n_points(self) -> int:
        return self.job.facts.n_points if self.share[1] == 1 else self.n_points_of_share

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
        first, stop = self.first_cell, self.first_cell + self.n_cells
        return tuple(
            CellBlock(one.name, max(one.start, first) - first, min(one.stop, stop) - first)
            for one in self.job.pieces.blocks
            if max(one.start, first) < min(one.stop, stop)
        )

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        """See `meshgauge.doctor.streamed.Source`; the next are read meanwhile."""
        self.passes.begin()
        for first, first_point, mesh in ahead(self._cells()):
            yield first, first_point, mesh
            self.passes.reach((first + mesh.n_cells) / self.n_cells)

    def _cells(self) -> Iterator[tuple[int, int, Mesh]]:
        pieces = self.job.pieces
        points = [Points(_NoCoordinates(piece.n_points), 0, keeps_ids=True) for piece in pieces.pieces]
        nowhere = np.zeros((self.n_points if self.joined is not None else 0, 3), np.float32)
        for place in places(pieces, self.size, self.share):
            pieces.check_unchanged()
            facts = self.job.facts
            part = read_slice(pieces, place, points[place.piece], facts.decision, self.purpose, facts.view)
            mesh, first = part.mesh, part.first_cell - self.first_cell
            stands = self.marks[first : first + mesh.n_cells] & STANDS > 0
            if stands.any():
                mesh = resolve(mesh, stands)
            mesh, first_point = without_ghosts(mesh), part.first_point - self.first_point
            poly = None if mesh.polyhedra is None else mesh.polyhedra.with_own_faces()
            if self.joined is not None:  # cells are at points of other parts, too
                nodes = self.joined.applied(np.asarray(mesh.connectivity, np.int64) + first_point)
                if poly is not None:
                    of_faces = self.joined.applied(np.asarray(poly.face_points, np.int64) + first_point)
                    poly = replace(poly, face_points=of_faces)
                mesh = replace(mesh, points=nowhere, connectivity=nodes, polyhedra=poly, copy=False, is_checked=False)
                first_point = 0
            elif poly is not mesh.polyhedra:
                mesh = mesh.replace(polyhedra=poly)
            yield first, first_point, mesh

    def points(self) -> Iterator[NDArray[np.floating]]:
        """Likewise."""
        self.passes.begin(of_points=True)
        n_seen = 0
        for window in ahead(self._points()):
            yield window
            n_seen += len(window)
            self.passes.reach(n_seen / self.n_points)

    def _points(self) -> Iterator[NDArray[np.floating]]:
        first, stop = self.first_point, self.first_point + self.n_points
        for piece, begin in zip(self.job.pieces.pieces, self.job.pieces.point_starts, strict=False):
            last = min(stop - begin, piece.n_points)
            for start in range(max(first - begin, 0), last, WINDOW):
                yield piece.points.read(start, min(start + WINDOW, last))

    def points_of(self, ids: Ids) -> NDArray[np.floating]:
        pieces = self.job.pieces
        return gathered([piece.points for piece in pieces.pieces], pieces.point_starts, ids + self.first_point)

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        pieces, facts = self.job.pieces, self.job.facts
        columns = [piece.cell_data.get(LABEL) for piece in pieces.pieces]
        return _labels(facts.cell_labels, columns, pieces.cell_starts, np.asarray(ids, np.int64) + self.first_cell)

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        pieces, facts = self.job.pieces, self.job.facts
        columns = [piece.point_data.get(LABEL) for piece in pieces.pieces]
        return _labels(facts.point_labels, columns, pieces.point_starts, np.asarray(ids, np.int64) + self.first_point)


def _labels(how: Labels, columns: Sequence[Rows | None], starts: Sequence[int], ids: Ids) -> tuple[int | None, ...]:
    """The file's own numbers of some cells or points in any order; none if it numbers none."""
    if how != "stored":
        return tuple((ids + 1).tolist()) if how == "counted" else ()
    order = np.argsort(ids)
    numbers = np.empty(len(ids), np.int64)
    numbers[order] = gathered([rows for rows in columns if rows is not None], starts, ids[order])
    return tuple(number if number >= 0 else None for number in numbers.tolist())
