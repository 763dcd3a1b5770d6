"""The mesh as improvement sees it: one flat list of corners for cells of every type, along a curve in space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..cells import SHAPES, TETRA
from ..kernels.repair import cells as improve_cells
from ..kernels.repair.corners import edge_lengths, grow, mark_points, number_anew, point_sizes
from ..mesh import Mesh
from ..mesh.connectivity import chunks, pick
from ..mesh.polyhedra import ragged_positions
from .curved import edge_bends

if TYPE_CHECKING:
    from .descent import Workers

Points = NDArray[np.float64]
Ids = NDArray[np.int64]

PART_CORNERS = 6_000
"""Corners from which on another part, for another thread, is worth its while."""

CHUNK = 1 << 17
"""Corners for which temporaries are made at a time."""

BITS = 21
"""Bits of each coordinate of a cell in its place along a curve."""

MOST_PARTS = 8
"""Sums are taken part by part, so their number must not depend on the number of threads."""


@dataclass(frozen=True, slots=True)
class Part:
    """A range of cells, with the range of points that they use."""

    first: int
    last: int
    low: int
    high: int


@dataclass(frozen=True, eq=False)
class Problem:
    """Corners of cells, on points numbered anew in the order of their first use.

    Attributes
    ----------
    point_ids
        ``(n_points,)`` the point of the mesh that each is.
    cell_ids
        ``(n_cells,)`` the cell of the mesh that each is.
    cells
        ``(n_cells + 1,)`` corners of cell ``e`` are ``cells[e] <= c < cells[e + 1]``.
    corners
        ``(n_corners, 4)`` int32: the corner and its right-handed neighbours. An apex of a pyramid has four.
    kinds
        ``(n_corners,)`` int32, rows of `constants`, `ideals` and `counts`.
    bends
        ``(n_corners, 3, 4)`` what turns the three edges into the tangents of curved cells, see `kernels.repair.shape`;
        ``(0, 3, 4)`` if no cell is curved.
    constants
        ``(n_kinds,)`` k.
    ideals
        ``(n_kinds, 3, 3)`` inverse of the ideal corner's edges, of length 1 each, as columns.
    counts
        ``(n_kinds,)`` False for corners whose shape says nothing new: those of a tetrahedron but its first.
    parts
        Ranges of cells of about equally many corners.
    team
        Threads that share what is asked of all cells; None: none do. They have no influence on the result.
    """

    point_ids: Ids
    cell_ids: Ids
    cells: Ids
    corners: NDArray[np.int32]
    kinds: NDArray[np.int32]
    bends: Points
    constants: Points
    ideals: Points
    counts: NDArray[np.bool_]
    parts: tuple[Part, ...]
    team: Workers | None = None

    @property
    def n_points(self) -> int:
        return len(self.point_ids)

    @property
    def n_cells(self) -> int:
        return len(self.cell_ids)

    @cached_property
    def most_corners(self) -> int:
        """The most corners of a cell."""
        return int(np.diff(self.cells).max(initial=1))

    @cached_property
    def is_tetrahedra(self) -> bool:
        """True if all cells are tetrahedra with straight edges."""
        return not len(self.bends) and bool(np.isin(self.kinds, _kinds()[TETRA.name]).all())

    @cached_property
    def has_tetrahedra(self) -> bool:
        """True if some cell is a tetrahedron."""
        return bool(np.isin(self.kinds, _kinds()[TETRA.name]).any())

    def qualities(self, points: Points) -> tuple[Points, Points]:
        """``(n_cells,)`` the least J_S/k of each cell's corners, and its J_ENS."""
        lowest, folded = np.empty(self.n_cells), np.empty(self.n_cells)

        def of_part(part: Part) -> None:
            some = slice(part.first, part.last)
            cells = self.cells[part.first : part.last + 1]
            its = slice(int(cells[0]), int(cells[-1]))
            improve_cells.cell_quality(
                points,
                self.corners[its],
                self.kinds[its],
                self.bends[its],
                self.constants,
                cells - cells[0],
                lowest[some],
                folded[some],
            )

        self._map(of_part, self.parts)
        return lowest, folded

    def _map(self, work: Callable[[Part], None], parts: Sequence[Part]) -> None:
        if self.team is None:
            for part in parts:
                work(part)
        else:
            self.team.map(work, parts)

    def edges(self, points: Points, which: slice | Ids) -> Points:
        """``(n, 3, 3)`` the edges at some corners, one a row; of curved cells their tangents."""
        corners = self.corners[which]
        ends, at = points[corners[:, 1:]], points[corners[:, :1]]
        if not len(self.bends):
            return np.asarray(ends - at)
        bends = self.bends[which]
        return np.asarray(ends - at + bends[:, :, :3] - 2.0 * bends[:, :, 3:] * (ends + at))

    def edge_lengths(self, points: Points, which: Ids | None = None) -> NDArray[np.float32]:
        """``(n, 3)`` lengths of the edges from each corner, or from some of them, to its neighbours."""
        corners = self.corners if which is None else self.corners[which]
        bends = self.bends if which is None or not len(self.bends) else self.bends[which]
        out = np.empty((len(corners), 3), np.float32)
        if which is not None:
            edge_lengths(points, corners, bends, 0, len(out), out)
            return out

        def of_part(part: Part) -> None:
            first, last = int(self.cells[part.first]), int(self.cells[part.last])
            edge_lengths(points, corners, bends, first, last, out[first:last])

        self._map(of_part, self.parts)
        return out

    def draw_lengths(self, points: Points, lengths: NDArray[np.float32]) -> None:
        """Bring reference lengths to those of the edges as they are, by a factor of two at most, in place."""
        for start in range(0, len(lengths), CHUNK):
            part = lengths[start : start + CHUNK]
            now = np.empty_like(part)
            edge_lengths(points, self.corners, self.bends, start, start + len(part), now)
            np.clip(now, 0.5 * part, 2.0 * part, out=now)
            part[...] = now

    def point_sizes(self, lengths: NDArray[np.float32]) -> Points:
        """``(n_points,)`` mean length of the edges at each point."""
        sizes = np.zeros(self.n_points)
        point_sizes(self.corners, lengths, sizes)
        return sizes

    def reference_lengths(self, points: Points) -> NDArray[np.float32]:
        """`edge_lengths`, none below a thousandth of the mean around its corner."""
        lengths = self.edge_lengths(points)
        sizes = (1e-3 * self.point_sizes(lengths)).astype(np.float32)
        for start in range(0, len(lengths), CHUNK):
            part = lengths[start : start + CHUNK]
            np.maximum(part, sizes[self.corners[start : start + CHUNK, 0]][:, None], out=part)
        return lengths

    def cell_of_corner(self) -> Ids:
        """``(n_corners,)`` the cell that each belongs to."""
        return np.repeat(np.arange(self.n_cells), np.diff(self.cells))

    def of_corners(self, keep: NDArray[np.bool_]) -> tuple[Problem, Ids, Ids]:
        """The problem of some corners only; the points, and the cells, here that its points and cells are."""
        if keep.all():
            return self, np.arange(self.n_points), np.arange(self.n_cells)
        sizes = np.add.reduceat(keep, self.cells[:-1], dtype=np.int64) if self.n_cells else np.empty(0, np.int64)
        chosen = np.flatnonzero(sizes)
        used, corners = _renumber(self.corners[keep])
        part = _problem(
            self.point_ids[used],
            self.cell_ids[chosen],
            np.asarray(sizes, np.int64)[chosen],
            corners,
            self.kinds[keep],
            self.bends[keep] if len(self.bends) else self.bends,
            (self.constants, self.ideals, self.counts),
        )
        return replace(part, team=self.team), used, chosen

    def points_at(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """``(n_points,)`` True for points of some cells."""
        mark = np.zeros(self.n_points, np.bool_)
        mark_points(self.corners, self.cells, np.asarray(cells, np.bool_), mark)
        return mark

    def grow(self, cells: NDArray[np.bool_], rings: int) -> NDArray[np.bool_]:
        """Some cells, and those that share a point with them, and so on, so many times."""
        chosen, touched = np.array(cells, np.bool_), np.zeros(self.n_points, np.bool_)
        for _ in range(rings):
            grow(self.corners, self.cells, chosen, touched)
        return chosen


def problem(
    mesh: Mesh,
    cells: NDArray[np.bool_],
    polyhedral: tuple[Ids, Ids, Points] | None = None,
    fixed: NDArray[np.bool_] | None = None,
) -> Problem:
    """The corners of the chosen cells of a mesh.

    Parameters
    ----------
    mesh
        Any mesh.
    cells
        ``(n_cells,)`` which cells take part; of them those of types with corners in the tables do.
    polyhedral
        Corners of polyhedra: cell, points ``(n, 4)`` and k of each; k is 0 where four points are to be in a plane.
    fixed
        ``(n_points,)`` nodes between the corners of curved cells that do not follow them; None: all follow.
    """
    kinds_of, tables = _kinds(), (*_kind_tables(), _counts())
    groups = []
    for row, _, of_type in mesh.groups():
        if row is not None and row.shape is not None:
            ids = np.arange(mesh.n_cells)[of_type]
            groups.append((row, ids[cells[ids]], np.array(row.shape.triples)))
    numbers = np.zeros(mesh.n_cells, np.int64)
    for _, ids, triples in groups:
        numbers[ids] = len(triples)
    if polyhedral is not None and len(polyhedral[0]):
        of_cell = polyhedral[0][cells[polyhedral[0]]]
        behind = numbers[of_cell]
        numbers += np.bincount(of_cell, minlength=mesh.n_cells)
    order = along_a_curve(mesh, np.flatnonzero(numbers))
    starts = np.zeros(mesh.n_cells, np.int64)
    starts[order] = np.cumsum(numbers[order]) - numbers[order]
    n_corners = int(numbers.sum())
    corners, kinds = np.empty((n_corners, 4), np.int32), np.empty(n_corners, np.int32)
    is_curved = any(row.is_curved and len(ids) for row, ids, _ in groups)
    bends = np.zeros((n_corners if is_curved else 0, 3, 4))
    for row, ids, triples in groups:
        assert row.shape is not None
        for part in chunks(ids, CHUNK // len(triples)):
            nodes = pick(mesh, row, part, row.corners)
            for m, triple in enumerate(triples):
                corners[starts[part] + m] = nodes[:, triple]
                kinds[starts[part] + m] = kinds_of[row.shape.name][m]
                if row.is_curved:
                    bends[starts[part] + m] = edge_bends(mesh, row, part, tuple(triple), fixed)
    if polyhedral is not None and len(polyhedral[0]):
        keep = cells[polyhedral[0]]
        known, which = np.unique(polyhedral[2][keep], return_inverse=True)
        turn = np.arange(len(of_cell)) - np.searchsorted(of_cell, of_cell) + behind
        corners[starts[of_cell] + turn] = polyhedral[1][keep]
        kinds[starts[of_cell] + turn] = len(tables[0]) + which.reshape(-1)
        tables = (
            np.concatenate([tables[0], known]),
            np.concatenate([tables[1], [_even_corner(float(k)) for k in known]]),
            np.concatenate([tables[2], known > 0.0]),
        )
    used, local = _renumber(corners)
    return _problem(used, order, numbers[order], local, kinds, bends, tables)


def _problem(
    point_ids: Ids,
    cell_ids: Ids,
    sizes: Ids,
    corners: NDArray[np.int32],
    kinds: NDArray[np.int32],
    bends: Points,
    tables: tuple[Points, Points, NDArray[np.bool_]],
) -> Problem:
    cells = np.zeros(len(cell_ids) + 1, np.int64)
    np.cumsum(sizes, out=cells[1:])
    n_parts = min(max(len(corners) // PART_CORNERS, 1), MOST_PARTS)
    bounds = np.searchsorted(cells, np.linspace(0, len(corners), n_parts + 1).astype(np.int64))
    parts = []
    for first, last in pairwise(bounds):
        ids = corners[cells[first] : cells[last]]
        low, high = (int(ids.min()), int(ids.max()) + 1) if len(ids) else (0, 0)
        parts.append(Part(int(first), int(last), low, high))
    return Problem(
        point_ids=point_ids,
        cell_ids=cell_ids,
        cells=cells,
        corners=np.ascontiguousarray(corners),
        kinds=np.ascontiguousarray(kinds, np.int32),
        bends=np.ascontiguousarray(bends),
        constants=tables[0],
        ideals=tables[1],
        counts=tables[2],
        parts=tuple(parts),
    )


@cache
def _kinds() -> dict[str, NDArray[np.int32]]:
    """For each shape the kinds of its corners."""
    kinds, n = {}, 0
    for shape in SHAPES.values():
        kinds[shape.name] = np.arange(n, n + len(shape.triples), dtype=np.int32)
        n += len(shape.triples)
    return kinds


@cache
def _kind_tables() -> tuple[Points, Points]:
    """k, and the inverse of the ideal corner, of each kind."""
    constants, ideals = [], []
    for shape in SHAPES.values():
        points = np.array(shape.points, np.float64)
        for o, i, j, k in shape.triples:
            edges = points[[i, j, k]] - points[o]
            edges /= np.linalg.norm(edges, axis=1)[:, None]
            constants.append(shape.k)
            ideals.append(np.linalg.inv(edges.T))
    return np.array(constants), np.array(ideals)


def _even_corner(k: float) -> Points:
    """Inverse of three unit edges at equal angles whose determinant is k; of a right angle for k = 0, not used."""
    cosines = np.roots([2.0, -3.0, 0.0, 1.0 - min(k * k, 1.0)])
    c = float(min((x.real for x in cosines if abs(x.imag) < 1e-6 and -0.5 < x.real < 1.0), key=abs)) if k else 0.0
    inverse: Points = np.linalg.inv(np.linalg.cholesky(np.full((3, 3), c) + (1.0 - c) * np.eye(3)).T)
    return inverse


@cache
def _counts() -> NDArray[np.bool_]:
    counts = np.ones(sum(len(shape.triples) for shape in SHAPES.values()), np.bool_)
    counts[_kinds()[TETRA.name][1:]] = False
    return counts


def gather(values: NDArray[Any], ids: NDArray[np.integer]) -> NDArray[Any]:
    """``values[ids]``, some rows at a time: NumPy makes a copy of all ids, as int64, first."""
    out = np.empty(ids.shape, values.dtype)
    for start in range(0, len(ids), CHUNK):
        out[start : start + CHUNK] = values[ids[start : start + CHUNK]]
    return out


def _renumber(corners: NDArray[np.int32]) -> tuple[Ids, NDArray[np.int32]]:
    """The points used, in the order of their first use, and the corners with points numbered so."""
    n = int(corners.max(initial=-1)) + 1
    used, out = np.empty(n, np.int64), np.empty_like(corners)
    n_used = number_anew(corners, np.full(n, -1, np.int32), used, out)
    return used[:n_used].copy(), out


def along_a_curve(mesh: Mesh, cells: Ids) -> Ids:
    """The cells along a Morton curve: neighbours in space are neighbours in memory.

    By their middles, so finely that the order, and with it every sum, is the same however cells and points are
    numbered.
    """
    if not len(cells):
        return cells
    middles = np.empty((len(cells), 3))
    starts = np.asarray(mesh.offsets, np.int64)
    for first in range(0, len(cells), CHUNK):
        some = cells[first : first + CHUNK]
        sizes = starts[some + 1] - starts[some]
        nodes = mesh.connectivity[ragged_positions(starts[some], sizes)]
        sums = np.add.reduceat(np.asarray(mesh.points[nodes], np.float64), np.cumsum(sizes) - sizes)
        middles[first : first + CHUNK] = sums / sizes[:, None]
    low, high = middles.min(axis=0), middles.max(axis=0)
    scale = float((1 << BITS) - 1) / (float((high - low).max()) or 1.0)
    code = np.zeros(len(cells), np.uint64)
    for axis in range(3):
        places = np.rint((middles[:, axis] - low[axis]) * scale).astype(np.uint64)
        code |= _spread_bits(places) << np.uint64(axis)
    return cells[np.argsort(code, kind="stable")]


def _spread_bits(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """`BITS` bits with two zeros between each."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        values = (values | (values << np.uint64(shift))) & np.uint64(mask)
    return values
