"""Surface cells as improvement sees them: rings of corners, and the sizes that good ones keep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...cells import CellType
from ...kernels.arrays import Int32Array
from ...kernels.repair import surface_cells
from ...kernels.repair.corners import at_points
from ...mesh import Mesh
from ...mesh.connectivity import pick
from ..constraints import Mask
from ..curved import edge_bends, node_between
from ..faces import mask_of
from ..problem import Ids, Points, along_a_curve
from ..sizes import SHORTEST


@dataclass(frozen=True, eq=False)
class Sizes:
    """What good cells must keep of their areas, and of the heights of layers: rows of `bounds` for those with some."""

    part: Part
    cells: Ids
    areas: Points
    shortest: Points
    is_layer: Mask
    share: float
    is_wide: bool

    def bounds(self, share: float) -> Points:
        """``(n, 4)`` least and largest area and shortest edge."""
        low, high = 1.0 - share, 1.0 + share
        n = len(self.cells)
        area = (np.full(n, -np.inf), np.full(n, np.inf)) if self.is_wide else (low * self.areas, high * self.areas)
        least = np.where(self.is_layer, low, min(low, SHORTEST)) * self.shortest
        return np.stack([*area, least, np.where(self.is_layer, high * self.shortest, np.inf)], axis=1)

    def passed(self, points: Points) -> Mask:
        """``(n_cells,)`` of the mesh: True where a size has changed by more than it may."""
        out = np.zeros(self.part.n_all, bool)
        areas, shortest, _ = self.part.sizes(points)
        bounds, a, s = self.bounds(self.share), areas[self.cells], shortest[self.cells]
        slack = 1e-9 * np.abs(np.where(np.isfinite(bounds), bounds, 0.0))
        fits = (a >= bounds[:, 0] - slack[:, 0]) & (a <= bounds[:, 1] + slack[:, 1])
        fits &= (s >= bounds[:, 2] - slack[:, 2]) & (s <= bounds[:, 3] + slack[:, 3])
        out[self.part.cell_ids[self.cells[~fits]]] = True
        return out


@dataclass(frozen=True, eq=False)
class Part:
    """Rings of the cells that take part, as the kernels take them; points are those of the mesh."""

    corners: np.ndarray  #: ``(n_corners, 4)`` the corner first; the others are not looked at
    kinds: np.ndarray
    constants: Points
    cells: Ids
    cell_ids: Ids
    around: tuple[Ids, Int32Array]
    bends: Points  #: ``(n_corners, 2, 4)`` of the edges to the next and the previous corner; empty if none is curved
    middles: Ids  #: ``(n_corners,)`` the node on the edge to the next corner, or -1; empty if no edge is curved
    n_all: int
    up: int  #: 1 or -1 in a plane, 0 in space

    @property
    def ring(self) -> Ids:
        return np.asarray(self.corners[:, 0], np.int64)

    def qualities(self, points: Points) -> tuple[Points, Points]:
        """``(n,)`` the least J_S/k of each cell, and its J_ENS; in space along its own normal."""
        lowest, folded = np.empty(len(self.cell_ids)), np.empty(len(self.cell_ids))
        normals = np.empty((0, 3)) if self.up else self.normals(points)
        surface_cells.cell_quality(
            points, self.corners, self.kinds, self.constants, self.cells, self.bends, float(self.up), normals, lowest,
            folded,
        )  # fmt: skip
        return lowest, folded

    def values(self, points: Points) -> Points:
        """``(n,)`` the least J_S/k of a cell that is inverted, J_ENS of another."""
        lowest, folded = self.qualities(points)
        return np.where(lowest <= 0.0, lowest, folded)

    @property
    def edges(self) -> tuple[Ids, Ids]:
        """``(n_corners,)`` twice: the point at each corner, and that at the next of its cell."""
        ring = self.ring
        following = np.arange(1, len(ring) + 1)
        following[self.cells[1:] - 1] = self.cells[:-1]
        return ring, ring[following]

    def _edges(self, points: Points) -> tuple[Points, Points]:
        a, b = self.edges
        return (points[a, :2], points[b, :2]) if self.up else (points[a], points[b])

    def normals(self, points: Points, *, curved: bool = True) -> Points:
        """``(n, 3)`` along the cells, each as long as its area; ``curved``: with the nodes between the corners."""
        starts, sizes = self.cells[:-1], np.diff(self.cells)
        x = points[self.ring]
        x = x - np.repeat(x[starts], sizes, axis=0)
        following = np.arange(1, len(x) + 1)
        following[self.cells[1:] - 1] = starts
        y = x[following]
        twice = np.cross(x, y)
        if curved and len(self.middles):
            on = np.flatnonzero(self.middles >= 0)
            first = points[np.repeat(self.ring[starts], sizes)[on]]
            m = points[self.middles[on]] - first - 0.5 * (x[on] + y[on])
            twice[on] += np.cross(x[on] - y[on], m) * (4.0 / 3.0)
        return np.asarray(0.5 * np.add.reduceat(twice, starts))

    def areas(self, points: Points) -> Points:
        """``(n,)`` of the cells, with the nodes between the corners; in a plane negative where they run clockwise."""
        normals = self.normals(points)
        return np.asarray(self.up * normals[:, 2] if self.up else np.linalg.norm(normals, axis=1))

    def sizes(self, points: Points) -> tuple[Points, Points, Points]:
        """``(n,)`` area, shortest and longest edge of each cell, all between its corners."""
        x, y = self._edges(points)
        starts = self.cells[:-1]
        if self.up:
            origin = np.repeat(x[starts], np.diff(self.cells), axis=0)
            a, b = x - origin, y - origin
            areas = 0.5 * self.up * np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], starts)
        else:
            areas = np.linalg.norm(self.normals(points, curved=False), axis=1)
        lengths = np.linalg.norm(y - x, axis=1)
        return areas, np.minimum.reduceat(lengths, starts), np.maximum.reduceat(lengths, starts)

    def edge_lengths(self, points: Points) -> Points:
        """``(n_corners,)`` of the edge from each corner to the next."""
        x, y = self._edges(points)
        return np.asarray(np.linalg.norm(y - x, axis=1))

    def points_at(self, cells: Mask, n_points: int) -> Mask:
        """``(n_points,)`` those of some cells."""
        return mask_of(n_points, self.ring[np.repeat(cells, np.diff(self.cells))])

    def grow(self, cells: Mask, rings: int, n_points: int) -> Mask:
        """Some cells, and those that share a point with them, and so on."""
        for _ in range(rings):
            cells = np.logical_or.reduceat(self.points_at(cells, n_points)[self.ring], self.cells[:-1])
        return cells


def part_of(mesh: Mesh, takes_part: Mask, fixed: Mask | None = None) -> Part:
    """The rings of some cells of a mesh of surfaces, along a curve in space; ``fixed`` are points that stay."""
    order = along_a_curve(mesh, np.flatnonzero(takes_part))
    sizes, place = np.zeros(mesh.n_cells, np.int64), np.full(mesh.n_cells, -1, np.int64)
    place[order] = np.arange(len(order))
    groups, constants = list[tuple[CellType, Ids, Ids, int]](), list[float]()
    for row, _, some in mesh.groups():
        if row is None or row.shape is None:
            continue
        ids = np.arange(mesh.n_cells)[some]
        ids = ids[takes_part[ids]]
        sizes[ids] = row.shape.n_nodes
        groups.append((row, ids, pick(mesh, row, ids, row.corners), len(constants)))
        constants.append(row.shape.k)
    cells = np.concatenate([[0], np.cumsum(sizes[order])])
    n = int(cells[-1])
    corners, kinds = np.empty((n, 4), np.int32), np.empty(n, np.int32)
    is_curved = any(row.is_curved and len(ids) for row, ids, _, _ in groups)
    bends, middles = np.zeros((n if is_curved else 0, 2, 4)), np.full(n if is_curved else 0, -1)
    for row, ids, nodes, kind in groups:
        at, last = cells[place[ids]], nodes.shape[1] - 1
        for m in range(last + 1):
            corners[at + m] = nodes[:, [m]]
            kinds[at + m] = kind
            if row.is_curved:
                around = (m, m + 1 if m < last else 0, m - 1 if m else last)
                bends[at + m] = edge_bends(mesh, row, ids, around, fixed)[:, :2]
                middle = node_between(row, *around[:2])
                if middle is not None:
                    middles[at + m] = pick(mesh, row, ids, (middle,))[:, 0]
    _, _, starts, at_point = at_points(corners, cells, mesh.n_points)
    return Part(
        corners, kinds, np.array(constants), cells, order, (starts, at_point), bends, middles, mesh.n_cells,
        mesh.up,
    )  # fmt: skip
