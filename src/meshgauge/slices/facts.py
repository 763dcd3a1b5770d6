"""Facts of the whole mesh: what the measuring of a slice depends on beyond its own cells. The first of two rounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID
from ..io.plumbing import ghosts
from ..io.plumbing.pieces import Pieces, ReadWhole, Rows, is_stored_label
from ..io.plumbing.wedge_order import (
    AS_ASKED,
    Decision,
    Signs,
    count,
    decide,
    sample_step,
    signs_of,
    turned,
    undecided,
)
from ..kernels.surfaces import plane
from ..mesh.cast import count_types
from ..mesh.labels import LABEL
from ..mesh.mesh import IS_SOLID_OR_UNKNOWN
from ..mesh.plane import side
from ..surface_cells import IS_SURFACE
from .points import Points
from .read import AS_SOLIDS, Place, View, most_cells, places, read_slice
from .regions import Regions, regions_of

Labels = Literal["none", "counted", "stored"]
"""How the file numbers its cells, or points: not at all; from 1 on in their order; by numbers that it stores."""

MANY = 1 << 40
"""Cells that are more than few in any case, see `meshgauge.kernels.path`."""


@dataclass(frozen=True)
class Facts:
    """What is known of the whole before a slice is measured.

    Attributes
    ----------
    n_cells, n_points
        Of all, ghosts too.
    n_measured
        Of types that are measured, ghosts not.
    decision
        What becomes of the wedges.
    regions
        The partition of the cells, where it was asked for.
    cell_labels, point_labels
        How the file numbers them.
    notes
        What a reader would have noted.
    view
        What is measured: solid cells, or surface cells, and from which side.
    is_part
        This is a part of a mesh of which nothing else is known: its cells count as many.
    parts
        As of `Mesh`.
    """

    n_cells: int
    n_points: int
    n_measured: int
    decision: Decision
    regions: Regions
    cell_labels: Labels
    point_labels: Labels
    notes: tuple[str, ...]
    view: View = AS_SOLIDS
    is_part: bool = False
    parts: tuple[int, ...] = ()

    @property
    def n_deciding(self) -> int:
        """Measured cells of all types, without ghosts, as far as that decides how they are measured."""
        return MANY if self.is_part else self.n_measured


def facts_of(
    pieces: Pieces,
    points: list[Points],
    *,
    wedge_order: str = "auto",
    with_regions: bool = False,
    dimension: Literal[2, 3] | None = None,
) -> Facts:
    """Look through the types, and through what else there is to decide.

    Parameters
    ----------
    pieces, points
        The mesh, and the points of each piece.
    wedge_order
        As for `meshgauge.read`.
    with_regions
        Whether regions are wanted.
    dimension
        As for `meshgauge.measure`.

    Raises
    ------
    ReadError
        If a file is broken.
    ReadWhole
        If something cannot be decided slice by slice.
    """
    counts = np.zeros(256, np.int64)
    others: list[int] = []  #: of each slice
    n_ghosts = wedges = 0
    of_all = np.zeros(256, np.int64)  # ghosts too
    all_places = places(pieces, most_cells(pieces))
    for place in all_places:
        types = pieces.pieces[place.piece].types.read(place.start, place.stop)
        by_type = count_types(types)
        of_all += by_type
        own_wedges, own_others = count(by_type)
        wedges += own_wedges
        others.append(own_others)
        is_ghost = _ghosts(pieces, place)
        if is_ghost is not None:
            n_ghosts += int(is_ghost.sum())
            by_type = count_types(types[~is_ghost])
        counts += by_type
    if set(np.flatnonzero(counts).tolist()) & set(pieces.renumbered):
        raise ReadWhole("cells are numbered as in older files")
    view, seen_from = _view(pieces, points, all_places, of_all, dimension)
    decision = _decision(pieces, points, all_places, others, wedge_order) if wedges else Decision()
    notes = [*pieces.notes, *seen_from]
    if decision.turn:
        notes.append(turned(wedges, decision.turn))
    elif decision.doubt:
        notes.append(undecided(decision.doubt))
    if n_ghosts:
        notes.append(ghosts.not_looked_at(n_ghosts))
    return Facts(
        n_cells=pieces.n_cells,
        n_points=pieces.n_points,
        n_measured=int(counts[IS_SURFACE if view.dimension == 2 else IS_SOLID].sum()),
        decision=decision,
        regions=regions_of(pieces) if with_regions else Regions(),
        cell_labels=_labels([piece.cell_data for piece in pieces.pieces], pieces.cell_starts, pieces.drops_counts),
        point_labels=_labels([piece.point_data for piece in pieces.pieces], pieces.point_starts, pieces.drops_counts),
        notes=tuple(notes),
        view=view,
        parts=pieces.parts,
    )


def _view(
    pieces: Pieces,
    points: list[Points],
    all_places: list[Place],
    of_all: NDArray[np.int64],
    dimension: Literal[2, 3] | None,
) -> tuple[View, list[str]]:
    """What is measured, of ``(256,)`` cells of each type, and notes on that."""
    there = of_all > 0
    own: Literal[2, 3] = 2 if IS_SURFACE[there].any() and not IS_SOLID_OR_UNKNOWN[there].any() else 3
    if own == 3 and dimension != 2:
        return AS_SOLIDS, []
    known, up, note = plane.Side(), AS_SOLIDS.up, ""
    for place in all_places:
        up, note = side(read_slice(pieces, place, points[place.piece], view=View(2, 0)).mesh, known)
        if known.is_in_space:
            break
    return (AS_SOLIDS if dimension == 3 else View(2, up)), [note] if note else []


def _ghosts(pieces: Pieces, place: Place) -> NDArray[np.bool_] | None:
    """``(n,)`` True for the ghosts among some cells, if there are any."""
    columns = {name: rows for name, rows in pieces.pieces[place.piece].cell_data.items() if name in ghosts.NAMES}
    return ghosts.ghosts_of({name: rows.read(place.start, place.stop) for name, rows in columns.items()})


def _decision(
    pieces: Pieces, points: list[Points], all_places: list[Place], others: list[int], wedge_order: str
) -> Decision:
    """What becomes of the wedges of the whole."""
    if wedge_order == "vtk-legacy":
        return AS_ASKED
    if wedge_order == "gmsh" or not pieces.has_both_wedge_orders:
        return Decision()
    step, before = sample_step(sum(others)), 0
    total = Signs(0, 0, 0, 0)
    for place, n in zip(all_places, others, strict=True):
        mesh = read_slice(pieces, place, points[place.piece]).mesh
        part = signs_of(mesh, step=step, first=-before % step)
        total = Signs(*(a + b for a, b in zip(total, part, strict=True)))
        before += n
    decision = decide(total)
    if decision is None:
        raise ReadWhole("the order of its wedges depends on their neighbours")
    return decision


def _labels(data: list[Mapping[str, Rows]], starts: tuple[int, ...], drops_counts: bool) -> Labels:
    """How the items are numbered; numbers that were taken from another array, or are dropped if they only count, and
    count from 0, are none."""
    rows = [columns.get(LABEL) for columns in data]
    first = rows[0]
    if first is None or len(first.shape) != 1 or first.dtype.kind not in "iu":
        return "none"
    if is_stored_label(data[0]) and not drops_counts:
        if first.dtype != np.int64:
            return "none"
        if _count_from([one for one in rows if one is not None], starts) is not None:
            raise ReadWhole("whether its numbers say anything depends on other data")
        return "stored"
    begin = _count_from([one for one in rows if one is not None], starts)
    return "stored" if begin is None else "counted" if begin == 1 else "none"


def _count_from(rows: list[Rows], starts: tuple[int, ...]) -> int | None:
    """0 or 1 if numbers only count their items from there; else None."""
    begin: int | None = None
    for one, start in zip(rows, starts, strict=False):
        for at in range(0, one.shape[0], 1 << 18):
            numbers = one.read(at, min(at + (1 << 18), one.shape[0]))
            begin = int(numbers[0]) - start - at if begin is None else begin
            if begin not in (0, 1) or not np.array_equal(numbers, np.arange(len(numbers)) + (start + at + begin)):
                return None
    return begin
