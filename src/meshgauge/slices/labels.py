"""The file's own numbers of a few cells and points of a mesh that is not in memory."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import replace

from ..io.plumbing.pieces import Pieces
from ..mesh.labels import LABEL
from ..quality.worst import StatusCells, WorstCell
from .facts import Facts


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


def labelled_worst(pieces: Pieces, facts: Facts, cells: Iterable[WorstCell]) -> tuple[WorstCell, ...]:
    """Worst cells with the numbers of the file."""
    return tuple(
        replace(
            one,
            cell_label=cell_label(pieces, facts, one.cell),
            point_label=point_label(pieces, facts, one.point),
        )
        for one in cells
    )


def labelled_findings(pieces: Pieces, facts: Facts, findings: Iterable[StatusCells]) -> tuple[StatusCells, ...]:
    """Findings with the numbers of the file."""
    if facts.cell_labels == "none":
        return tuple(findings)
    return tuple(replace(one, labels=tuple(cell_label(pieces, facts, cell) for cell in one.cells)) for one in findings)
