"""Which cells take part in an improvement, and which points must stay where they are, and why."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cells import CELL_TYPES, IS_SOLID
from ..doctor import points as coincidence
from ..errors import MeshError
from ..mesh import Mesh
from ..mesh.regions import regions
from ..mesh.topology import MULTIPLE, Topology, topology
from ..quality.measure import Quality
from ..quality.polyhedra import PolyhedralQuality
from ..status import is_measured
from .curved import can_follow
from .faces import mask_of, nodes_of_faces
from .hanging import NONE, Hanging, hanging
from .notes import Counted

if TYPE_CHECKING:
    from .sizes import SizeLimits

Mask = NDArray[np.bool_]

PLACES = 4
"""Units in the last place of the stored coordinates within which points coincide."""


@dataclass(frozen=True, eq=False)
class Constraints:
    """What an improvement may touch. Arrays are of the whole mesh.

    Attributes
    ----------
    quality
        Of the mesh as it is.
    topology
        Its faces.
    cells
        ``(n_cells,)`` cells that take part: solid, measured, with coordinates that are finite.
    boundary
        ``(n_points,)`` points of the boundary, and of faces that three cells or more have.
    interface
        ``(n_points,)`` points of faces between regions.
    pinned
        ``(n_points,)`` points that never move: asked for by the user, coinciding ones, those of surface and line
        cells inside, of ghost cells and of cells that take no part.
    region_ids, region_names
        ``(n_cells,)`` the region of each cell, and the names of the regions.
    notes
        Notes for the report, a sentence each.
    sizes
        What good cells must keep of their sizes; None: nothing.
    away
        ``(n_points,)`` those of the pinned that stay only since no bad cell is near; None: there are none.
    hanging
        Points that follow what they hang on.
    """

    quality: Quality
    topology: Topology
    cells: Mask
    boundary: Mask
    interface: Mask
    pinned: Mask
    region_ids: NDArray[np.int64]
    region_names: tuple[str, ...]
    notes: tuple[str, ...]
    sizes: SizeLimits | None = None
    away: Mask | None = None
    hanging: Hanging = NONE

    @property
    def fixed(self) -> Mask:
        """``(n_points,)`` points that do not move as long as the boundary is fixed."""
        return self.boundary | self.interface | self.pinned

    def without_hanging(self) -> Constraints:
        """The same with what hangs, and what it hangs on, held."""
        return replace(self, pinned=self.pinned | self.hanging.linked(len(self.pinned)), hanging=NONE)

    @property
    def bounding(self) -> Mask:
        """``(n_points,)`` points that could not move either if all were to be improved."""
        return self.fixed if self.away is None else self.fixed & ~self.away


def constraints_of(
    mesh: Mesh,
    quality: Quality,
    fixed: ArrayLike | None,
    named: tuple[NDArray[np.int64], tuple[str, ...]] | None = None,
) -> Constraints:
    """Find out what may move.

    Parameters
    ----------
    mesh, quality
        The mesh and what was measured on it.
    fixed
        Further points that must not move: a mask ``(n_points,)``, or ids.
    named
        The regions of the cells, and their names; None: those of the mesh.

    Raises
    ------
    MeshError
        If the mask or the ids do not fit the mesh.
    """
    faces = topology(mesh)
    notes: list[str] = []
    n = mesh.n_points
    is_solid = IS_SOLID[mesh.types]
    takes_part = is_measured(quality.status)
    can = np.array(
        [(r := CELL_TYPES.get(t)) is not None and r.shape is not None and can_follow(r) for t in range(256)]
    )[mesh.types]
    if quality.polyhedra is not None:
        can[can_move(quality.polyhedra)] = True
    takes_part &= can
    if mesh.is_ghost is not None:
        takes_part &= ~mesh.is_ghost
    pinned = fixed_mask(fixed, n)
    if mesh.is_ghost is not None:
        pinned |= shared_with_pieces(mesh, mesh.is_ghost)
        notes.append("The points of ghost cells stay, and as many layers beside them: other pieces have them.")
    aside = is_solid & ~takes_part
    if mesh.is_ghost is not None:
        aside &= ~mesh.is_ghost
    left = int(np.count_nonzero(aside))
    if left:
        pinned |= mask_of(n, mesh.connectivity[np.repeat(aside, np.diff(mesh.offsets))])
        rest = "no part (of high order, not measured): their points stay."
        notes.append(Counted(left, f"solid cell takes {rest}", f"solid cells take {rest}"))

    alone = np.flatnonzero(faces.mates < 0)
    boundary = nodes_of_faces(faces, alone)
    n_multiple = int(np.count_nonzero(faces.mates == MULTIPLE))
    if n_multiple:
        rest = "to three cells or more: their points stay like the boundary."
        notes.append(Counted(faces.n_multiple, f"face belongs {rest}", f"faces belong {rest}"))

    region_ids, region_names = regions(mesh) if named is None else named
    pairs = faces.pairs()
    between = region_ids[faces.cells[pairs[:, 0]]] != region_ids[faces.cells[pairs[:, 1]]]
    interface = nodes_of_faces(faces, pairs[between, 0]) & ~boundary
    if between.any():
        rest = "kept where they are."
        notes.append(
            Counted(int(between.sum()), f"face between regions is {rest}", f"faces between regions are {rest}")
        )
    embedded = mask_of(n, mesh.connectivity[np.repeat(~is_solid, np.diff(mesh.offsets))]) & ~boundary
    used = mask_of(n, mesh.connectivity[np.repeat(takes_part, np.diff(mesh.offsets))])
    n_embedded = int(np.count_nonzero(embedded & used & ~interface))
    if n_embedded:
        to = "to surface, line or vertex cells and"
        notes.append(Counted(n_embedded, f"point inside belongs {to} stays.", f"points inside belong {to} stay."))
    pinned |= embedded

    together, n_together = coincident(mesh, used)
    if n_together:
        pinned |= together
        rest = "with another: parts that touch there stay together, unmoved."
        notes.append(Counted(n_together, f"point coincides {rest}", f"points coincide {rest}"))
    follows, unclear = hanging(quality)
    pinned |= mask_of(n, unclear)
    pinned |= follows.held_with(boundary | interface | pinned) & ~(boundary | interface)
    if follows:
        on = "on an edge or a face, and"
        notes.append(Counted(len(follows.points), f"point hangs {on} follows it.", f"points hang {on} follow it."))
    return Constraints(
        quality,
        faces,
        takes_part,
        boundary,
        interface,
        pinned,
        region_ids,
        region_names,
        tuple(notes),
        hanging=follows,
    )


def can_move(measured: PolyhedralQuality) -> NDArray[np.int64]:
    """Ids of the polyhedra that have a value."""
    return measured.cells[~np.isnan(measured.values)]


def coincident(mesh: Mesh, used: Mask) -> tuple[Mask, int]:
    """Points that coincide with another and stay where they are, and how many they are beside the first of each.

    Two points of one cell that coincide are an edge of no length: they are to be parted, not held together.
    """
    n = mesh.n_points
    representative = np.asarray(coincidence.representatives(mesh.points, tolerance=_tolerance(mesh)), np.int64)
    twice = coincidence.duplicates(representative, used)
    if not len(twice):
        return np.zeros(n, bool), 0
    in_group = mask_of(n, np.concatenate([twice, representative[twice]]))
    entries = np.flatnonzero(in_group[mesh.connectivity])
    nodes = np.asarray(mesh.connectivity, np.int64)[entries]
    cells = np.searchsorted(mesh.offsets, entries, side="right") - 1
    unique = np.unique(np.stack([cells, representative[nodes], nodes], axis=1), axis=0)
    same = (unique[1:, :2] == unique[:-1, :2]).all(axis=1)
    parted = mask_of(n, unique[1:][same, 1])
    held = in_group & ~parted[representative]
    return held, int(np.count_nonzero(held[twice]))


def shared_with_pieces(mesh: Mesh, is_ghost: Mask) -> Mask:
    """Points of ghost cells, and of the cells that other pieces have as ghosts: as many layers on this side."""
    owner = np.repeat(np.arange(mesh.n_cells), np.diff(mesh.offsets))

    def points_of(cells: Mask) -> Mask:
        return mask_of(mesh.n_points, mesh.connectivity[cells[owner]])

    def cells_at(points: Mask, among: Mask) -> Mask:
        return mask_of(mesh.n_cells, owner[points[mesh.connectivity]]) & among

    ghosts = points_of(is_ghost)
    near = far = ghosts & points_of(~is_ghost)
    reached = np.zeros(mesh.n_cells, bool)
    while True:
        layer = cells_at(far, is_ghost & ~reached)
        if not layer.any():
            return ghosts | near
        reached |= layer
        far, near = far | points_of(layer), near | points_of(cells_at(near, ~is_ghost))


def _tolerance(mesh: Mesh) -> float:
    """Relative distance of points that coincide: a few units in the last place of coordinates in single precision."""
    if mesh.stored != "single" or not mesh.n_points:
        return coincidence.TOLERANCE
    largest = float(np.nanmax(np.abs(mesh.points), initial=0.0, where=np.isfinite(mesh.points)))
    return max(coincidence.TOLERANCE, PLACES * float(np.spacing(np.float32(largest))) / coincidence.size(mesh.points))


def fixed_mask(fixed: ArrayLike | None, n: int) -> Mask:
    """``(n,)`` True for points that a mask or ids name; raises `MeshError` if they do not fit the mesh."""
    if fixed is None:
        return np.zeros(n, bool)
    array = np.asarray(fixed)
    if array.dtype.kind == "b":
        if array.shape != (n,):
            raise MeshError(f"the mask of fixed points has shape {array.shape}, expected ({n},)")
        return array.copy()
    if array.dtype.kind not in "iu" or array.ndim != 1:
        raise MeshError(f"fixed points have shape {array.shape} and dtype {array.dtype}, expected a mask or ids")
    if len(array) and (int(array.min()) < 0 or int(array.max()) >= n):
        raise MeshError(f"a fixed point's id is outside 0..{n - 1}")
    return mask_of(n, array.astype(np.int64))
