"""Bricks, wedges and pyramids with repeated nodes: the tetrahedra, pyramids and wedges that they stand for.

Programs without such cells write them as bricks whose nodes coincide by number::

    7-----6           6 = 7
    |\\    |\\          |\
    | 4-----5         | 4-----5       nodes 0 1 2 2 4 5 6 6: a wedge of 0 1 2 and 4 5 6
    3-|---2 |       2 = 3     |
     \\|    \\|          \\|     |
      0-----1           0-----1

A cell stands for another if the faces that are left, those with three different nodes or more, are those of a
tetrahedron, a pyramid or a wedge. A brick with one collapsed edge is no such shape.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME, CELL_TYPES, HEXAHEDRON, PYRAMID, TETRA, WEDGE, CellType, Shape
from ..look.style import plural
from . import connectivity
from .cast import count_types
from .mesh import Mesh

Ints = NDArray[np.int64]
Corners = tuple[int, ...]
"""For each corner of a shape, the first corner that has the same node."""

_NONE = np.empty(0, np.int64)
_TARGETS: dict[int, Shape] = {shape.n_nodes: shape for shape in (TETRA, PYRAMID, WEDGE)}
_QUADRATIC = {
    row.shape: row
    for row in CELL_TYPES.values()
    if row.shape is not None
    and row.shape in _TARGETS.values()
    and row.n_nodes == row.shape.n_nodes + len(row.shape.edges)
}
_SOURCES = tuple(
    row
    for row in CELL_TYPES.values()
    if row.shape is not None
    and min(_TARGETS) < row.shape.n_nodes <= HEXAHEDRON.n_nodes
    and row.n_nodes is not None
    and (row.n_nodes == row.shape.n_nodes or row.n_middles == len(row.shape.edges))
)
"""Types that may stand for others: linear ones, and those with a node on every edge."""


@dataclass(frozen=True, slots=True)
class Standing:
    """What a collapsed cell stands for: a type, and the position in the collapsed cell of each of its nodes."""

    row: CellType
    nodes: tuple[int, ...]


def resolve(mesh: Mesh, is_doubtful: NDArray[np.bool_] | None = None) -> Mesh:
    """The mesh as it is measured: every collapsed cell is what it stands for, and a note counts them.

    Cells, points and data are those of the file, in its order; only types and nodes of collapsed cells differ, and each
    of them has another type. Cells with repeated corners that stand for no other type stay. The same object if nothing
    was collapsed.

    Parameters
    ----------
    mesh
        Any mesh.
    is_doubtful
        ``(n_cells,)``: linear cells that may be collapsed, as those without a positive value are; None: all.
    """
    types, sizes = mesh.types, _NONE
    changed: list[tuple[Ints, tuple[int, ...]]] = []
    counts: Counter[str] = Counter()
    counts_of = count_types(mesh.types)
    is_sound = is_doubtful is not None and not is_doubtful.any()
    for row in _SOURCES:
        is_asked = counts_of[row.vtk_id] > 0 and (row.is_curved or not is_sound)
        cells = _repeated(mesh, row, is_doubtful) if is_asked else _NONE
        if not len(cells):
            continue
        patterns = _patterns(connectivity.pick(mesh, row, cells, row.corners))
        for pattern in np.unique(patterns, axis=0):
            standing = stands_for(row.vtk_id, tuple(int(corner) for corner in pattern))
            if standing is None:
                continue
            if not changed:
                types, sizes = types.copy(), np.diff(mesh.offsets).astype(np.int64)
            own = cells[(patterns == pattern).all(axis=1)]
            types[own], sizes[own] = standing.row.vtk_id, len(standing.nodes)
            counts[standing.row.name] += len(own)
            changed.append((own, standing.nodes))
    if not changed:
        return mesh
    offsets = np.zeros(mesh.n_cells + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    before = np.asarray(mesh.offsets[:-1], np.int64)
    origins = np.arange(offsets[-1]) - np.repeat(offsets[:-1] - before, sizes)
    for own, nodes in changed:
        origins[offsets[own][:, None] + np.arange(len(nodes))] = before[own][:, None] + np.array(nodes)
    ids = mesh.connectivity[origins]
    return mesh.replace(types=types, offsets=offsets, connectivity=ids, notes=(*mesh.notes, note_on(counts)))


def note_on(counts: Counter[str]) -> str:
    """The note on cells with repeated nodes, by the type that they stand for."""
    n = counts.total()
    what = ", ".join(f"{k:,} {name}" for name, k in sorted(counts.items()))
    means = "is measured as what it stands for" if n == 1 else "are measured as what they stand for"
    return f"{plural(n, 'cell')} with repeated nodes {means}: {what}."


def _repeated(mesh: Mesh, row: CellType, is_doubtful: NDArray[np.bool_] | None) -> Ints:
    """Cells of a type in which the ends of an edge are one point."""
    assert row.shape is not None
    cells = mesh.cells_of_type(row.vtk_id)
    if is_doubtful is not None and not row.is_curved:
        first = cells.start if isinstance(cells, slice) else 0
        at = np.flatnonzero(is_doubtful[cells])
        cells = at + first if isinstance(cells, slice) else cells[at]
    repeated = [_NONE]
    for part in connectivity.chunks(cells):
        ids = connectivity.pick(mesh, row, part, row.corners)
        mask = np.zeros(len(ids), np.bool_)
        for a, b in row.shape.edges:
            mask |= ids[:, a] == ids[:, b]
        at = np.flatnonzero(mask)
        repeated.append(at + part.start if isinstance(part, slice) else part[at])
    return np.concatenate(repeated)


def _patterns(corners: Ints) -> Ints:
    """For each corner the first corner of the cell that has its node."""
    return np.asarray(np.argmax(corners[:, :, None] == corners[:, None, :], axis=2), np.int64)


@cache
def stands_for(vtk_id: int, pattern: Corners) -> Standing | None:
    """What a cell stands for whose corners repeat as the pattern says; None if it is no other shape, or none.

    The corners of the result are numbered as they come in the cell, as far as its faces allow.
    """
    row = CELL_TYPES[vtk_id]
    shape = row.shape
    if row not in _SOURCES or shape is None:
        return None
    target = _TARGETS.get(len(set(pattern)))
    if target is None or target is shape:
        return None
    faces = set()
    for face in shape.faces:
        ring = _ring([pattern[node] for node in face])
        if len(set(ring)) != len(ring) or (ring and ring in faces):
            return None
        if ring:
            faces.add(ring)
    for order in permutations(sorted(set(pattern))):
        if {_ring([order[node] for node in face]) for face in target.faces} == faces:
            return _standing(row, shape, target, pattern, order)
    return None


def _ring(nodes: list[int]) -> tuple[int, ...]:
    """The different nodes round a face, from the lowest on; empty if they are less than three."""
    ring = [node for k, node in enumerate(nodes) if node != nodes[k - 1]]
    if len(set(ring)) < 3:
        return ()
    first = ring.index(min(ring))
    return tuple(ring[first:] + ring[:first])


def _standing(row: CellType, shape: Shape, target: Shape, pattern: Corners, order: Corners) -> Standing:
    corners = tuple(row.corners[node] for node in order)
    if row.n_nodes == shape.n_nodes:
        return Standing(BY_NAME[target.name], corners)
    middles = []
    for a, b in target.edges:
        ends = {order[a], order[b]}
        edge = next(k for k, (i, j) in enumerate(shape.edges) if {pattern[i], pattern[j]} == ends)
        middles.append(shape.n_nodes + edge)
    return Standing(_QUADRATIC[target], (*corners, *middles))
