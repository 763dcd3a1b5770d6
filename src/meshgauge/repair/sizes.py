"""Sizes of cells: what good cells must keep of them, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES
from ..kernels.repair.ascent import Sizes
from ..mesh.polyhedra import ragged_positions
from ..mesh.topology import Topology
from ..quality.measure import Quality
from .faces import face_points, half_faces
from .problem import Ids, Points, Problem
from .volumes import cone_volumes

GOOD = 0.9
"""J_ENS from which on a cell is good: its size is as it was meant."""

SHORTEST = 0.5
"""Share of its shortest edge that every other good cell must keep: J_ENS does not see an edge shrink."""

STRETCHED = 5.0
"""Longest over shortest edge from which on the shortest edge of a wedge or hexahedron is the height of a layer."""

MOST = 0.99
"""Share of the good cells for which the change of sizes is reported, beside the largest of all."""

WITHIN = 0.999
"""Share of the bounds that is aimed for: what is drawn back to them stops about there."""

ROUNDING = 1e-9
"""What bounds are wider by, so that sizes that did not change are within."""


@dataclass(frozen=True, slots=True)
class SizeChange:
    """What became of the sizes of cells that were good: ratios of the larger to the smaller, before and after.

    1 is no change, infinite where a volume is not positive any more.
    """

    n_cells: int  #: that were good, near bad ones: those whose sizes could change
    volume: float  #: largest ratio of volumes
    volume_most: float  #: that 99 % of the cells do not pass
    edge: float  #: largest ratio of the lengths of an edge
    edge_most: float  #: that 99 % of the cells do not pass with any of their edges


@dataclass(frozen=True, eq=False)
class SizeLimits:
    """Volumes, and heights of layers, of good cells, and how far they may change.

    Attributes
    ----------
    topology
        Of the mesh as it was.
    problem
        Corners of the cells that take part.
    cells
        ``(n,)`` those that were good.
    volumes, shortest
        ``(n,)`` their volumes and shortest edges.
    is_layer
        ``(n,)`` True for stretched wedges and hexahedra, whose shortest edge is the height of a layer.
    share
        By which each may change.
    """

    topology: Topology
    problem: Problem
    cells: Ids
    volumes: Points
    shortest: Points
    is_layer: NDArray[np.bool_]
    share: float

    def passed(self, points: Points) -> NDArray[np.bool_]:
        """``(n_cells,)`` of the mesh: True where a size has changed by more than it may."""
        out = np.zeros(self.topology.mesh.n_cells, bool)
        if len(self.cells):
            sizes = (
                cell_volumes(self.topology, self.cells, points),
                _edges(self.problem, points, self.cells)[0],
            )
            bounds = self._bounds(self.share)
            is_kept = np.ones(len(self.cells), bool)
            for n, size in enumerate(sizes):
                low, high = bounds[:, 2 * n], bounds[:, 2 * n + 1]
                is_kept &= (size >= low - ROUNDING * np.abs(low)) & (size <= high * (1.0 + ROUNDING))
            out[self.cells[~is_kept]] = True
        return out

    def _bounds(self, share: float) -> Points:
        """``(n, 4)`` least and largest volume and shortest edge."""
        low, high = 1.0 - share, 1.0 + share
        least = np.where(self.is_layer, low, min(low, SHORTEST)) * self.shortest
        most = np.where(self.is_layer, high * self.shortest, np.inf)
        return np.stack([low * self.volumes, high * self.volumes, least, most], axis=1)

    def rows(self, part: Problem) -> Sizes:
        """For `kernels.repair.ascent.ascend` on a part of the problem; curved cells are taken with straight edges."""
        at = np.full(self.topology.mesh.n_cells, -1, np.int64)
        at[self.cells] = np.arange(len(self.cells))
        row_of = at[part.cell_ids]
        rows = np.where(row_of >= 0, np.cumsum(row_of >= 0) - 1, -1)
        mine = row_of[row_of >= 0]
        cells = self.cells[mine]
        bounds = self._bounds(WITHIN * self.share)[mine]
        slots, counts = half_faces(self.topology, cells)
        ids, offsets = face_points(self.topology, slots)
        is_curved = _is_curved()[self.topology.mesh.types[cells]]
        if is_curved.any():
            old = np.asarray(self.topology.mesh.points, np.float64)
            straight = cell_volumes(self.topology, cells[is_curved], old, rings=False)
            bounds[is_curved, :2] *= (straight / self.volumes[mine[is_curved]])[:, None]
            bounds[is_curved, 2:] = -np.inf, np.inf
        ends = np.concatenate([[0], np.cumsum(counts)])
        local = np.full(self.topology.mesh.n_points, -1, np.int64)
        local[part.point_ids] = np.arange(part.n_points)
        return rows, bounds, ends, offsets, local[ids]


def size_limits(quality: Quality, topology: Topology, problem: Problem, share: float) -> SizeLimits:
    """The limits for a mesh as it is.

    Parameters
    ----------
    quality, topology
        Of the mesh.
    problem
        Corners of the cells that take part.
    share
        By which a size may change.
    """
    mesh = quality.mesh
    points = np.asarray(mesh.points, np.float64)
    with np.errstate(invalid="ignore"):
        is_good = quality.values >= GOOD
    takes_part = np.zeros(mesh.n_cells, bool)
    takes_part[problem.cell_ids] = True
    cells = np.flatnonzero(is_good & takes_part)
    volumes = cell_volumes(topology, cells, points)
    cells, volumes = cells[volumes > 0.0], volumes[volumes > 0.0]
    shortest, longest = _edges(problem, points, cells)
    is_layer = _has_height()[mesh.types[cells]] & (longest > STRETCHED * shortest)
    return SizeLimits(topology, problem, cells, volumes, shortest, is_layer, share)


@dataclass(frozen=True, eq=False)
class SizeRatios:
    """Of each good cell the ratio of the larger to the smaller, before and after: ``(n,)`` of its volumes, and the
    largest of its edges."""

    volumes: Points
    edges: Points


def size_ratios(limits: SizeLimits, before: NDArray[np.floating], after: NDArray[np.floating]) -> SizeRatios:
    """What became of the sizes of each good cell, with the points of the mesh before and after."""
    cells, problem = limits.cells, limits.problem
    if not len(cells):
        return SizeRatios(np.empty(0), np.empty(0))
    with np.errstate(divide="ignore", invalid="ignore"):
        volumes = cell_volumes(limits.topology, cells, after) / limits.volumes
        volumes = np.where(volumes > 0.0, np.maximum(volumes, 1.0 / volumes), np.inf)
        at, starts = _corners_of(problem, cells)
        was, now = (problem.edge_lengths(np.asarray(x, np.float64)[problem.point_ids], at) for x in (before, after))
        edges = np.maximum(was / now, now / was).max(axis=1).astype(np.float64)
    return SizeRatios(volumes, np.maximum.reduceat(np.where(np.isnan(edges), 1.0, edges), starts))


def size_change(ratios: SizeRatios) -> SizeChange:
    """What became of the sizes of the good cells."""
    n = len(ratios.volumes)
    if not n:
        return SizeChange(0, 1.0, 1.0, 1.0, 1.0)
    volumes, edges = ratios.volumes, ratios.edges
    return SizeChange(
        n,
        float(volumes.max()),
        float(np.quantile(volumes, MOST, method="lower")),
        float(edges.max()),
        float(np.quantile(edges, MOST, method="lower")),
    )


def cell_volumes(topology: Topology, cells: Ids, points: NDArray[np.floating], *, rings: bool = True) -> Points:
    """``(n,)`` volumes of some cells, each face cut into triangles from the mean of its points; ``rings`` as for
    `face_points`."""
    slots, counts = half_faces(topology, cells)
    volumes = cone_volumes(topology, slots, points, rings=rings)
    sums = np.zeros(len(cells))
    np.add.at(sums, np.repeat(np.arange(len(cells)), counts), volumes)
    return sums


def _edges(problem: Problem, points: Points, cells: Ids) -> tuple[Points, Points]:
    """``(n,)`` the shortest and the longest edge of some cells of the mesh that are in the problem."""
    if not len(cells):
        return np.empty(0), np.empty(0)
    at, starts = _corners_of(problem, cells)
    lengths = problem.edge_lengths(points[problem.point_ids], at).astype(np.float64)
    return np.minimum.reduceat(lengths.min(axis=1), starts), np.maximum.reduceat(lengths.max(axis=1), starts)


def _corners_of(problem: Problem, cells: Ids) -> tuple[Ids, Ids]:
    """The corners of some cells of the mesh that are in the problem, and where those of each begin among them."""
    place = np.full(int(problem.cell_ids.max(initial=-1)) + 1, -1, np.int64)
    place[problem.cell_ids] = np.arange(problem.n_cells)
    starts = problem.cells[place[cells]]
    sizes = problem.cells[place[cells] + 1] - starts
    return ragged_positions(starts, sizes), np.cumsum(sizes) - sizes


@cache
def _has_height() -> NDArray[np.bool_]:
    """``(256,)`` True for the types whose stretched cells have a height: prisms, with sides of four points around."""
    mark = np.zeros(256, bool)
    for vtk_id, row in CELL_TYPES.items():
        if row.shape is not None and not row.is_curved:
            mark[vtk_id] = sum(len(face) == 4 for face in row.shape.faces) >= 3
    return mark


@cache
def _is_curved() -> NDArray[np.bool_]:
    """``(256,)`` True for curved types."""
    return np.array([(row := CELL_TYPES.get(t)) is not None and row.is_curved for t in range(256)])
