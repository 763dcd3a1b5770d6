"""Points of the faces of cells."""

from __future__ import annotations

from ..arrays import Int8Array, Int64Array, IntArray, UInt8Array
from ..jit import kernel


@kernel
def face_sizes(
    half_faces: Int64Array,
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    offsets: Int64Array,
) -> None:
    """Receive in ``offsets`` ``(n + 1,)`` where the points of each half-face begin; see `face_points`."""
    offsets[0] = 0
    for n in range(len(half_faces)):
        half_face = half_faces[n]
        cell = cells[half_face]
        local = half_face - starts[cell]
        if table[types[cell], 0, 0] >= 0:
            size = table[types[cell], local, 0]
        else:
            face = poly[1][poly[0][cell] + local]
            size = poly[2][face + 1] - poly[2][face]
        offsets[n + 1] = offsets[n] + size


@kernel
def face_points(
    half_faces: Int64Array,
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    node_offsets: IntArray,
    nodes: IntArray,
    offsets: Int64Array,
    points: IntArray,
) -> None:
    """Receive the points of half-faces one after another.

    Parameters
    ----------
    half_faces
        ``(n,)`` which.
    cells, starts, types, table, poly, node_offsets, nodes
        As for `half_faces.match`.
    offsets
        ``(n + 1,)`` where the points of each begin, as `face_sizes` gives it.
    points
        ``(offsets[-1],)``; receives them.
    """
    for n in range(len(half_faces)):
        half_face = half_faces[n]
        cell, to = cells[half_face], offsets[n]
        local, size = half_face - starts[cell], offsets[n + 1] - to
        if table[types[cell], 0, 0] >= 0:
            first = node_offsets[cell]
            for m in range(size):
                points[to + m] = nodes[first + table[types[cell], local, m + 1]]
        else:
            first = poly[2][poly[1][poly[0][cell] + local]]
            for m in range(size):
                points[to + m] = poly[3][first + m]
