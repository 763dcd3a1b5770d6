"""How often points will be read, said before it is done."""

from __future__ import annotations

from ..io.plumbing.pieces import row_bytes
from .job import Job, points_of
from .points import BLOCK
from .read import places, slice_size

SAMPLE = 8
"""Slices that are looked at, evenly spread."""


def times_points_are_read(job: Job, size: int | None = None) -> float:
    """How often all points are read, estimated from a few slices; 1 where they are kept."""
    size = slice_size(job.memory) if size is None else size
    todo = [place for place in places(job.pieces, size) if not points_of(job, place.piece).fits]
    if not todo:
        return 1.0
    some = todo[:: max(len(todo) // SAMPLE, 1)]
    n_bytes = 0
    for place in some:
        piece, points = job.pieces.pieces[place.piece], points_of(job, place.piece)
        first, last = (int(piece.offsets.read(at, at + 1)[0]) for at in (place.start, place.stop))
        ids = piece.connectivity.read(first, last).astype("int64", copy=False)
        n_bytes += min(len(points.blocks_of(ids)) * BLOCK, points.n) * row_bytes(piece.points)
    numbers = {place.piece for place in todo}
    return n_bytes * len(todo) / len(some) / sum(points_of(job, number).n_bytes for number in numbers)
