"""The mesh as improvement sees it: one flat list of corners for cells of every type, along a curve in space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..cells import SHAPES
from ..kernels import improve_quality
from ..mesh import Mesh

Points = NDArray[np.float64]
Ids = NDArray[np.int64]

PART_CORNERS = 24_000
"""Corners from which on another part, for another thread, is worth its while."""

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
    constants
        ``(n_kinds,)`` k.
    ideals
        ``(n_kinds, 3, 3)`` inverse of the ideal corner's edges, of length 1 each, as columns.
    counts
        ``(n_kinds,)`` False for corners whose shape says nothing new: those of a tetrahedron but its first.
    parts
        Ranges of cells of about equally many corners.
    """

    point_ids: Ids
    cell_ids: Ids
    cells: Ids
    corners: NDArray[np.int32]
    kinds: NDArray[np.int32]
    constants: Points
    ideals: Points
    counts: NDArray[np.bool_]
    parts: tuple[Part, ...]

    @property
    def n_points(self) -> int:
        return len(self.point_ids)

    @property
    def n_cells(self) -> int:
        return len(self.cell_ids)

    @property
    def most_corners(self) -> int:
        """The most corners of a cell."""
        return int(np.diff(self.cells).max(initial=1))

    def qualities(self, points: Points) -> tuple[Points, Points]:
        """``(n_cells,)`` the least J_S/k of each cell's corners, and its J_ENS."""
        lowest, folded = np.empty(self.n_cells), np.empty(self.n_cells)
        improve_quality.cell_quality(points, self.corners, self.kinds, self.constants, self.cells, lowest, folded)
        return lowest, folded

    def edge_lengths(self, points: Points) -> Points:
        """``(n_corners, 3)`` lengths of the edges from each corner to its neighbours."""
        here = points[self.corners[:, 0]]
        return np.stack([np.linalg.norm(points[self.corners[:, m]] - here, axis=1) for m in (1, 2, 3)], axis=1)

    def point_sizes(self, lengths: Points) -> Points:
        """``(n_points,)`` mean length of the edges at each point."""
        at = self.corners[:, 0]
        sums = np.bincount(at, lengths.sum(axis=1), minlength=self.n_points)
        sizes: Points = sums / np.maximum(3.0 * np.bincount(at, minlength=self.n_points), 1.0)
        return sizes

    def reference_lengths(self, points: Points) -> NDArray[np.float32]:
        """`edge_lengths`, none below a thousandth of the mean around its corner."""
        lengths = self.edge_lengths(points)
        sizes = self.point_sizes(lengths)[self.corners[:, 0]][:, None]
        return np.maximum(lengths, 1e-3 * sizes).astype(np.float32)

    def cell_of_corner(self) -> Ids:
        """``(n_corners,)`` the cell that each belongs to."""
        return np.repeat(np.arange(self.n_cells), np.diff(self.cells))

    def of_corners(self, keep: NDArray[np.bool_]) -> tuple[Problem, Ids, Ids]:
        """The problem of some corners only; the points, and the cells, here that its points and cells are."""
        sizes = np.add.reduceat(keep, self.cells[:-1]) if self.n_cells else np.empty(0, np.int64)
        chosen = np.flatnonzero(sizes)
        used, corners = _renumbered(self.corners[keep])
        part = _problem(
            self.point_ids[used],
            self.cell_ids[chosen],
            np.asarray(sizes, np.int64)[chosen],
            corners,
            self.kinds[keep],
            self.constants,
            self.ideals,
        )
        return part, used, chosen

    def grown(self, cells: NDArray[np.bool_], rings: int) -> NDArray[np.bool_]:
        """Some cells, and those that share a point with them, and so on, so many times."""
        of_cell = self.cell_of_corner()
        touched = np.zeros(self.n_points, bool)
        for _ in range(rings):
            touched[self.corners[cells[of_cell]]] = True
            cells = np.zeros(self.n_cells, bool)
            cells[of_cell[touched[self.corners].any(axis=1)]] = True
        return cells


def problem(mesh: Mesh, cells: NDArray[np.bool_]) -> Problem:
    """The corners of the chosen cells of a mesh.

    Parameters
    ----------
    mesh
        Any mesh.
    cells
        ``(n_cells,)`` which cells take part; of them those of types with corners in the tables do.
    """
    kinds_of = _kinds()
    constants, ideals = _kind_tables()
    owner, corners, kinds = [], [], []
    for row, _, of_type in mesh.groups():
        if row is None or row.shape is None:
            continue
        ids = np.arange(mesh.n_cells)[of_type]
        ids = ids[cells[ids]]
        starts = np.asarray(mesh.offsets[ids], np.int64)[:, None]
        nodes = mesh.connectivity[starts + np.array(row.corners)]
        triples = np.array(row.shape.triples)
        owner.append(np.repeat(ids, len(triples)))
        corners.append(nodes[:, triples].reshape(-1, 4).astype(np.int64))
        kinds.append(np.tile(kinds_of[row.shape.name], len(ids)))
    if not owner:
        none = np.empty(0, np.int64)
        return _problem(none, none, none, np.empty((0, 4), np.int32), none.astype(np.int32), constants, ideals)
    of_cell = np.concatenate(owner)
    all_corners = np.concatenate(corners)
    order = _along_a_curve(mesh, of_cell, all_corners)
    of_cell, all_corners = of_cell[order], all_corners[order]
    is_first = np.ones(len(of_cell), bool)
    is_first[1:] = of_cell[1:] != of_cell[:-1]
    starts = np.flatnonzero(is_first)
    used, local = _renumbered(all_corners)
    sizes = np.diff(np.append(starts, len(of_cell)))
    return _problem(used, of_cell[starts], sizes, local, np.concatenate(kinds)[order], constants, ideals)


def _problem(
    point_ids: Ids,
    cell_ids: Ids,
    sizes: Ids,
    corners: NDArray[np.int32],
    kinds: NDArray[np.int32],
    constants: Points,
    ideals: Points,
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
        constants=constants,
        ideals=ideals,
        counts=_counts(),
        parts=tuple(parts),
    )


@cache
def _kinds() -> dict[str, NDArray[np.int32]]:
    """For each shape the kinds of its corners."""
    found, n = {}, 0
    for shape in SHAPES.values():
        found[shape.name] = np.arange(n, n + len(shape.triples), dtype=np.int32)
        n += len(shape.triples)
    return found


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


@cache
def _counts() -> NDArray[np.bool_]:
    counts = np.ones(sum(len(shape.triples) for shape in SHAPES.values()), np.bool_)
    counts[_kinds()["tetra"][1:]] = False
    return counts


def _renumbered(corners: NDArray[np.integer]) -> tuple[Ids, NDArray[np.int32]]:
    """The points used, in the order of their first use, and the corners with points numbered so."""
    flat = corners.ravel()
    first = np.full(int(flat.max(initial=-1)) + 1, len(flat), np.int64)
    np.minimum.at(first, flat, np.arange(len(flat)))
    used = np.flatnonzero(first < len(flat))
    used = used[np.argsort(first[used])]
    local = np.empty(len(first), np.int32)
    local[used] = np.arange(len(used), dtype=np.int32)
    return used, local[corners]


def _along_a_curve(mesh: Mesh, of_cell: Ids, corners: Ids) -> Ids:
    """Order of the corners by cell, cells along a Morton curve: neighbours in space are neighbours in memory."""
    points = np.asarray(mesh.points, np.float64)
    is_first = np.zeros(mesh.n_cells, bool)
    is_first[of_cell] = True
    cells = np.flatnonzero(is_first)
    anchor = np.zeros(mesh.n_cells, np.int64)
    anchor[of_cell] = corners[:, 0]
    at = points[anchor[cells]]
    low, high = at.min(axis=0), at.max(axis=0)
    spread = float((high - low).max()) or 1.0
    code = np.zeros(len(cells), np.uint64)
    for axis in range(3):
        code |= _spread_bits(((at[:, axis] - low[axis]) / spread * 1023.0).astype(np.uint64)) << np.uint64(axis)
    place = np.empty(mesh.n_cells, np.int64)
    place[cells[np.argsort(code, kind="stable")]] = np.arange(len(cells))
    return np.argsort(place[of_cell], kind="stable")


def _spread_bits(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Ten bits with two zeros between each."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        values = (values | (values << np.uint64(shift))) & np.uint64(mask)
    return values
