"""Points that the parts of a mesh have in common: joined for the diagnosis, by their numbers or their coordinates."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..look.records import brief
from ..mesh import Mesh
from ..mesh.labels import labels_of
from . import points

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Joined:
    """Points that stand for others.

    Attributes
    ----------
    ids, onto
        ``(n,)`` points, ascending, that another part has as well, and the first of the same.
    by_numbers
        Whether the file's numbers say so, or coordinates that are equal.
    n_parts
        How many parts there are.
    is_said
        It is a finding; not of parts that are one mesh when it is read whole.
    """

    ids: Ids
    onto: Ids
    by_numbers: bool
    n_parts: int
    is_said: bool = True

    __repr__ = brief

    @classmethod
    def of(
        cls,
        ids: Ids,
        xyz: NDArray[np.floating],
        alike: Ids,
        labels: Ids | None,
        starts: tuple[int, ...],
        *,
        are_known: bool = False,
    ) -> Joined:
        """Among points that coincide with others.

        Parameters
        ----------
        ids, xyz
            ``(n,)`` these points, ascending, and where they are.
        alike
            ``(n,)`` equal for those that coincide within the tolerance.
        labels
            ``(n,)`` the file's numbers, if it has any.
        starts
            The first point of each part.
        are_known
            The labels say which points are one, and nothing is said of it.

        Notes
        -----
        Numbers count if at most places at which parts coincide they are equal: else each part counts for itself. Of
        several points of a part at one place the first belongs to the first of another, and so on.
        """
        part = np.searchsorted(starts, ids, side="right") - 1
        exact = np.unique(xyz.astype(np.float64) + 0.0, axis=0, return_inverse=True)[1].reshape(-1)
        by_place = _first_of(exact, part)
        by_numbers = are_known
        if not are_known and labels is not None and (labels >= 0).all():
            is_common = by_place != np.arange(len(ids))
            n_equal = np.count_nonzero((labels == labels[by_place])[is_common])
            by_numbers = bool(2 * n_equal > np.count_nonzero(is_common))
        if by_numbers and labels is not None:
            pairs = np.stack([labels, alike], axis=1)
            by_place = _first_of(np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1), part)
        moved = np.flatnonzero(by_place != np.arange(len(ids)))
        return cls(ids[moved], ids[by_place[moved]], by_numbers, len(starts), not are_known)

    @classmethod
    def of_mesh(cls, mesh: Mesh, tolerance: float) -> Joined:
        """Those of a mesh that was put together of several; points that ghosts alone have are not looked at."""
        representative = np.asarray(
            points.representatives(mesh.points, tolerance=tolerance, stored=mesh.stored), np.int64
        )
        moved = np.flatnonzero(representative != np.arange(mesh.n_points))
        ids = np.unique(np.concatenate([moved, representative[moved]]))
        if mesh.is_ghost is not None:
            ids = ids[~ghost_points([(0, mesh)], mesh.n_points)[ids]]
        labels = labels_of(mesh, "point")
        of_these = None if labels is None else labels[ids]
        return cls.of(ids, mesh.points[ids], representative[ids], of_these, mesh.parts)

    def applied(self, nodes: Ids) -> Ids:
        """Point ids with those that stand for others in place of these."""
        if not len(self.ids):
            return nodes
        at = np.minimum(np.searchsorted(self.ids, nodes), len(self.ids) - 1)
        return np.where(self.ids[at] == nodes, self.onto[at], nodes)

    def on(self, mesh: Mesh) -> Mesh:
        """The mesh with its cells at the joined points; the others stay, without a cell."""
        poly = mesh.polyhedra
        nodes = self.applied(np.asarray(mesh.connectivity, np.int64)).astype(mesh.connectivity.dtype)
        if poly is not None:
            poly = poly.with_points(self.applied(np.arange(mesh.n_points)))
        return mesh.replace(connectivity=nodes, polyhedra=poly)


def ghost_points(meshes: Iterable[tuple[int, Mesh]], n_points: int) -> NDArray[np.bool_]:
    """``(n_points,)`` points that ghosts alone have, of meshes with point ids from so many on."""
    real, ghost = np.zeros(n_points, np.bool_), np.zeros(n_points, np.bool_)
    for first, mesh in meshes:
        nodes = np.asarray(mesh.connectivity, np.int64) + first
        is_ghost = mesh.is_ghost
        of_ghosts = np.repeat(np.zeros(mesh.n_cells, np.bool_) if is_ghost is None else is_ghost, np.diff(mesh.offsets))
        real[nodes[~of_ghosts]] = True
        ghost[nodes[of_ghosts]] = True
    return ghost & ~real


def _first_of(groups: Ids, part: Ids) -> Ids:
    """For each of some items, whose parts ascend, the first that is the same: of its group, and the k-th of its part as
    the other is of its own."""
    order = np.lexsort((np.arange(len(groups)), part, groups))
    key = np.stack([groups[order], part[order]], axis=1)
    is_new = np.ones(len(order), np.bool_)
    is_new[1:] = (key[1:] != key[:-1]).any(axis=1)
    start = np.maximum.accumulate(np.where(is_new, np.arange(len(order)), 0))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order)) - start
    _, first, which = np.unique(np.stack([groups, rank], axis=1), axis=0, return_index=True, return_inverse=True)
    return np.asarray(first[which.reshape(-1)], np.int64)
