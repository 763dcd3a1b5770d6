"""The picture of a mesh that is measured slice by slice: the cells that it shows are read again when all are known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...doctor.streamed import MarkCounter, Marks
from ...files.resources import give_back
from ...slices import Job, Partial
from ...slices.points import WINDOW
from ...slices.read import Slice, places, read_slice
from ...slices.some_cells import measured, points_of_cells, touching
from . import surface
from .cell_cards import INSIDE, MOST, Card, cards, inverted_inside
from .frame import Frame
from .page_cells import WHOLE, WORST, Ids, Values, drawable, lowest, order_to_show
from .picture import TRIANGLES, Picture, Skin, coarse_of

if TYPE_CHECKING:
    from ...doctor.streamed.few import Few
    from ...quality.measure import Quality
    from ...slices.points import Points
    from ..record import FileReport


@dataclass(frozen=True, eq=False)
class Shown(Marks):
    """Marks of some cells, and which of them a page would show, by ids in the whole.

    Attributes
    ----------
    ids, keys
        Of at most `WHOLE` cells that can be drawn, ascending, the lowest by `order_to_show`; and that order.
    n_drawn
        Cells that can be drawn.
    inside
        The first that are inverted inside, at most ``n_inside``.
    """

    ids: Ids
    keys: Values
    n_drawn: int
    inside: Ids
    n_inside: int

    def merge(self, other: Marks) -> Shown:
        """Those of both."""
        assert isinstance(other, Shown)  # they were asked for the same
        ids, keys = np.concatenate([self.ids, other.ids]), np.concatenate([self.keys, other.keys])
        order = np.argsort(ids, kind="stable")
        ids, keys = ids[order], keys[order]
        kept = lowest(keys, WHOLE)
        inside = np.sort(np.concatenate([self.inside, other.inside]))[: self.n_inside]
        n_drawn, marks = self.n_drawn + other.n_drawn, super().merge(other)
        return Shown(marks.parts, ids[kept], keys[kept], n_drawn, inside, self.n_inside, inward=marks.inward)

    @property
    def cells(self) -> Ids:
        """Ids, ascending, of those that are shown where there is room."""
        return self.ids if self.n_drawn <= WHOLE else self.ids[lowest(self.keys, WORST)]


@dataclass(frozen=True)
class ShownCounter(MarkCounter):
    """Marks the cells of every slice, and chooses those that a page would show; a `meshgauge.slices.ask.Counter`."""

    n_worst: int = 0

    def count(self, quality: Quality, part: Slice, regions: Any, facts: Any) -> Shown:  # type: ignore[override]
        """Marks and choice of a slice."""
        marks = super().count(quality, part, regions, facts)
        ids = np.flatnonzero(drawable(quality))
        keys = order_to_show(quality, ids)
        kept = lowest(keys, WHOLE)
        inside = inverted_inside(quality.status, self.n_worst) + part.first_cell
        n_inside = INSIDE + self.n_worst
        ids, n = ids[kept] + part.first_cell, len(ids)
        return Shown(marks.parts, ids, keys[kept], n, inside, n_inside, inward=marks.inward)


class Drawing:
    """The picture in the making.

    Parameters
    ----------
    job, partial
        A mesh and what was measured on it, counted by a `ShownCounter`.
    """

    def __init__(self, job: Job, partial: Partial) -> None:
        assert isinstance(partial.counted, Shown)
        self.job, self.shown = job, partial.counted
        self.frame = Frame.of_parts(_all_points(job))
        self._boundary: tuple[surface.Polygons, NDArray[np.floating]] | None = None
        self._skin: Skin | None = None
        if job.facts.view.dimension == 2:
            self._take_surface_cells()

    @property
    def lacks_boundary(self) -> bool:
        """Whether the faces of solid cells are not known yet."""
        return self._boundary is None and self._skin is None and self.job.facts.view.dimension == 3

    def take_boundary(self, few: Few) -> None:
        """The cells of which the diagnosis knows the faces at the boundary."""
        faces = surface.boundary(few.faces)
        used, local = np.unique(faces.points, return_inverse=True)
        points = few.mesh.points[used]
        faces = surface.Polygons(faces.offsets, local.reshape(-1), few.cells[faces.cells])
        if faces.n_triangles > TRIANGLES:
            self._skin = Skin.of(faces, points, self.frame)
        else:
            self._boundary = faces, points

    def _take_surface_cells(self) -> None:
        """All surface cells: gathered at once where they are many."""
        boxes: surface.Boxes | None = None
        kept: list[tuple[surface.Polygons, NDArray[np.floating]]] = []
        n = 0
        for part in _slices(self.job):
            faces, points = surface.of_surfaces(part.mesh), part.mesh.points
            n += faces.n_triangles
            kept.append((faces, points))
            if n > TRIANGLES:
                for known in kept:
                    boxes = coarse_of(*known, self.frame, boxes)
                kept = []
        if boxes is not None:
            for known in kept:
                boxes = coarse_of(*known, self.frame, boxes)
            points = np.empty((0, 3))
            self._skin = Skin(n, None, points, boxes.surface())

    def picture(self, report: FileReport) -> tuple[Picture | None, list[Card]]:
        """What is drawn, and the cards of cells."""
        job, shown = self.job, self.shown
        if not shown.n_drawn:
            return None, []
        of_cards = np.array([cell.cell for cell in report.worst[:MOST]], np.int64)
        near = touching(job.pieces, points_of_cells(job.pieces, np.union1d(of_cards, shown.inside)))
        wanted = [shown.cells, of_cards, shown.inside, near]
        if self._boundary is not None:
            wanted.append(self._boundary[0].cells)
        elif self._skin is None:
            wanted.append(np.arange(job.facts.n_cells))  # surface cells, which are few
        ids = np.unique(np.concatenate(wanted))
        give_back()
        quality, points = measured(job, ids)
        can_be_drawn = np.zeros(len(ids), np.bool_)
        can_be_drawn[np.searchsorted(ids, shown.cells)] = True
        picture = Picture(
            quality,
            can_be_drawn,
            shown.n_drawn,
            job.facts.regions.ids_of_cells(ids, quality.mesh.cell_data),
            job.facts.regions.names,
            self.frame,
            self._skin or self._fine(quality, ids),
            cells=ids,
            points=points,
        )
        worst = np.array([cell.cell for cell in report.worst], np.int64)
        return picture, cards(picture, worst, shown.inside)

    def _fine(self, quality: Quality, ids: Ids) -> Skin:
        if self._boundary is None:
            return Skin.of(surface.of_surfaces(quality.mesh), quality.mesh.points, self.frame)
        faces, points = self._boundary
        return Skin.of(replace(faces, cells=np.searchsorted(ids, faces.cells)), points, self.frame)


def _all_points(job: Job) -> Iterator[NDArray[np.floating]]:
    for piece in job.pieces.pieces:
        for start in range(0, piece.n_points, WINDOW):
            yield piece.points.read(start, min(start + WINDOW, piece.n_points))


def _slices(job: Job) -> Iterator[Slice]:
    from ...slices.job import share

    points: list[Points] = share(job.pieces, job.memory)
    for place in places(job.pieces):
        job.pieces.check_unchanged()
        yield read_slice(job.pieces, place, points[place.piece], job.facts.decision, job.purpose, job.facts.view)
