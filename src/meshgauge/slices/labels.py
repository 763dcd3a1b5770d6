"""The file's own numbers of a few cells and points of a mesh that is not in memory."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import replace

from ..io.plumbing.pieces import Pieces
from ..mesh.labels import LABEL
from .facts import Facts
from .partial import Partial


def cell_label(pieces: Pieces, facts: Facts, cell: int) -> int | None:
    """The number that the file gives to a cell of the whole; None if it gives none."""
    if facts.cell_labels != "stored":
        return cell + 1 if facts.cell_labels == "counted" else None
    piece = bisect_right(pieces.cell_starts, cell) - 1
    at = cell - pieces.cell_starts[piece]
    return _number(int(pieces.pieces[piece].cell_data[LABEL].read(at, at + 1)[0]))


def point_label(pieces: Pieces, facts: Facts, point: int) -> int | None:
    """That of a point."""
    if facts.point_labels != "stored":
        return point + 1 if facts.point_labels == "counted" else None
    piece = bisect_right(pieces.point_starts, point) - 1
    at = point - pieces.point_starts[piece]
    return _number(int(pieces.pieces[piece].point_data[LABEL].read(at, at + 1)[0]))


def _number(label: int) -> int | None:
    return label if label >= 0 else None


LabelOf = Callable[[int], int | None]


def labelled(partial: Partial, of_cell: LabelOf | None, of_point: LabelOf | None) -> Partial:
    """A result with the numbers that the file gives to the cells and points that are listed; None: it numbers none."""
    worst = tuple(
        (
            replace(
                one,
                cell_label=None if of_cell is None else of_cell(one.cell),
                point_label=None if of_point is None else of_point(one.point),
            ),
            region,
        )
        for one, region in partial.worst
    )
    findings = tuple(
        replace(one, labels=() if of_cell is None else tuple(map(of_cell, one.cells))) for one in partial.findings
    )
    return replace(partial, worst=worst, findings=findings)


def labelled_by_file(pieces: Pieces, facts: Facts, partial: Partial) -> Partial:
    """`labelled` with the numbers looked up in the file."""
    return labelled(
        partial,
        None if facts.cell_labels == "none" else lambda cell: cell_label(pieces, facts, cell),
        None if facts.point_labels == "none" else lambda point: point_label(pieces, facts, point),
    )
