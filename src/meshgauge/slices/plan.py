"""How often points will be read, and how long that will take, said before it is done."""

from __future__ import annotations

import contextlib
import time

from ..errors import MeshError
from ..io.plumbing.pieces import row_bytes
from .job import Job, points_of
from .points import BLOCK, WINDOW
from .read import most_cells, places, slice_size

SAMPLE = 8
"""Slices that are looked at, evenly spread."""


def seconds_of_reading(job: Job, times: float) -> float:
    """How long it takes to read all points so often, estimated from some of them."""
    n_bytes, start = 0, time.perf_counter()
    every = [(piece.points, row) for piece in job.pieces.pieces for row in range(0, piece.n_points, WINDOW)]
    for rows, row in every[:: max(len(every) // SAMPLE, 1)]:
        stop = min(row + WINDOW, rows.shape[0])
        rows.read(row, stop)
        n_bytes += (stop - row) * row_bytes(rows)
    passed = time.perf_counter() - start
    total = sum(piece.n_points * row_bytes(piece.points) for piece in job.pieces.pieces)
    return passed * times * total / max(n_bytes, 1)


def times_points_are_read(job: Job, size: int | None = None) -> float:
    """How often all points are read, estimated from a few slices; 1 where they are kept."""
    size = min(slice_size(job.memory), most_cells(job.pieces)) if size is None else size
    todo = [place for place in places(job.pieces, size) if not points_of(job, place.piece).fits]
    if not todo:
        return 1.0
    some = todo[:: max(len(todo) // SAMPLE, 1)]
    n_bytes = 0
    for place in some:
        piece, points = job.pieces.pieces[place.piece], points_of(job, place.piece)
        first, last = (int(piece.offsets.read(at, at + 1)[0]) for at in (place.start, place.stop))
        ids = piece.connectivity.read(first, last).astype("int64", copy=False)
        with contextlib.suppress(MeshError):  # no such point: measuring names the cell
            n_bytes += min(len(points.blocks_of(ids)) * BLOCK, points.n) * row_bytes(piece.points)
    numbers = {place.piece for place in todo}
    return n_bytes * len(todo) / len(some) / sum(points_of(job, number).n_bytes for number in numbers)
