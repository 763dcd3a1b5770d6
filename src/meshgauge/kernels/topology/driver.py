"""Half-faces and their mates, components, coincident points, each on the path that `kernels.path` chooses."""

from __future__ import annotations

import numpy as np

from .. import path
from ..arrays import BoolArray, Float64Array, FloatArray, Int8Array, Int64Array, IntArray, UInt8Array, read_only
from . import numpy_path


def index_type(n: int) -> type[np.signedinteger]:
    """The narrowest type for positions among so many items."""
    return np.int32 if n < 2**31 - 1 else np.int64


def match(
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    longest: int,
    n_points: int,
) -> tuple[IntArray, Int8Array, int]:
    """The mate of each half-face, their windings, and the number of faces that three or more cells have.

    Parameters are those of `half_faces.match`, and the number of points.
    """
    n, width = len(cells), cells.dtype
    mates, windings = np.empty(n, width), np.zeros(n, np.int8)
    cells, starts, types = read_only(cells), read_only(starts), read_only(types)
    common = (cells, starts, types, read_only(offsets), read_only(nodes), read_only(table), poly, longest)
    if not path.is_compiled(len(types), is_once=True):
        return mates, windings, numpy_path.match(*common, mates, windings)
    from .half_faces import match as kernel

    ends, buckets, hashes = np.zeros(n_points + 1, width), np.empty(n, width), np.empty((2, n), np.int16)
    return mates, windings, kernel(*common, ends, buckets, hashes[0], hashes[1], mates, windings)


def face_points(
    half_faces: Int64Array,
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    width: type[np.signedinteger],
) -> tuple[IntArray, Int64Array]:
    """Points of half-faces one after another, and where each one's begin; always compiled.

    Parameters are those of `face_points.face_points`, and the type of the points.
    """
    from .face_points import face_points as kernel
    from .face_points import face_sizes

    ends = np.empty(len(half_faces) + 1, np.int64)
    common = (read_only(half_faces), read_only(cells), read_only(starts), read_only(types), read_only(table), poly)
    face_sizes(*common, ends)
    points: IntArray = np.empty(int(ends[-1]), width)
    kernel(*common, read_only(offsets), read_only(nodes), read_only(ends), points)
    return points, ends


def signatures(
    types: UInt8Array, offsets: IntArray, nodes: IntArray, is_solid: BoolArray, n_points: int
) -> tuple[BoolArray, BoolArray, Int64Array]:
    """Of each point whether a cell has it, of each cell whether it has a point twice, and the hash of its points.

    See `signatures.signatures`.
    """
    last_cell: IntArray = np.zeros(n_points, index_type(max(len(types), n_points)))
    has_repeats, hashes = np.empty(len(types), np.bool_), np.empty(len(types), np.int64)
    types, offsets, nodes, is_solid = read_only(types), read_only(offsets), read_only(nodes), read_only(is_solid)
    arguments = (types, offsets, nodes, is_solid, last_cell, has_repeats, hashes)
    if path.is_compiled(len(types), is_once=True):
        from .signatures import signatures as kernel

        kernel(*arguments)
    else:
        numpy_path.signatures(*arguments)
    return last_cell > 0, has_repeats, hashes


def components_by_points(cells: BoolArray, offsets: IntArray, nodes: IntArray, n_points: int) -> IntArray:
    """``(n_points,)`` the lowest point of each point's component, where some of the cells connect their points."""
    parent: IntArray = np.arange(n_points, dtype=index_type(n_points))
    if path.is_compiled(len(cells), is_once=True):
        from .union_find import components_by_points as kernel

        kernel(read_only(cells), read_only(offsets), read_only(nodes), parent)
    else:
        numpy_path.components_by_points(cells, offsets, nodes, parent)
    return parent


def components_by_faces(
    cells: IntArray, mates: IntArray, windings: Int8Array, handedness: Int8Array
) -> tuple[IntArray, Int8Array, int]:
    """The lowest cell of each cell's component, its orientation relative to that one, and the number of faces that
    contradict the others; see `union_find.components_by_faces`."""
    n_cells = len(handedness)
    parent: IntArray = np.arange(n_cells, dtype=cells.dtype)
    sign = np.ones(n_cells, np.int8)
    if not path.is_compiled(n_cells, is_once=True):
        return parent, sign, numpy_path.components_by_faces(cells, mates, windings, handedness, parent, sign)
    from .union_find import components_by_faces as kernel

    cells, mates, windings, handedness = map(read_only, (cells, mates, windings, handedness))
    return parent, sign, kernel(cells, mates, windings, handedness, parent, sign)


def coincident(points: FloatArray, origin: Float64Array, tolerance: float) -> IntArray:
    """``(n_points,)`` the lowest point within the tolerance of each; see `coincident.coincident`."""
    width = index_type(len(points))
    representative: IntArray = np.empty(len(points), width)
    if not path.is_compiled(len(points), is_once=True):
        numpy_path.coincident(points, origin, tolerance, representative)
        return representative
    from .coincident import coincident as kernel

    bits = (len(points) - 1).bit_length() if len(points) else 0
    head, after = np.full(1 << bits, -1, width), np.empty(len(points), width)
    kernel(read_only(points), read_only(origin), tolerance, bits, head, after, representative)
    return representative
